"""The binaries of co-simulation units: those of the package, or built once on this machine."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from mbody.core.cache_folder import STAMP_DIGITS, cache_folder
from mbody.core.native import builder_command, place
from mbody.core.selection import linker
from mbody.core.sources import PACKAGE, source_hash
from mbody.errors import ModelError
from mbody.image.image_kernels import IMAGE_KERNELS

__all__ = ["PLATFORMS", "SHELL", "SOURCES", "Platform", "fmu_binaries"]

#: Where the C files are, and those that make a unit of an image and the kernels.
SHELL = PACKAGE / "image" / "c"
SOURCES = ("mbody.c", "fmi2.c", "fmi3.c", "fmu.c")
#: What is read beside them.
HEADERS = ("mbody.h", "fmu.h")


@dataclass(frozen=True)
class Platform:
    """A kind of machine, as FMI names it.

    Attributes
    ----------
    target : str
        Of `mbody compile`.
    file : str
        What the compiler names the binary.
    fmi_2, fmi_3 : str
        Its folder under binaries/; empty where the version has none.
    """

    target: str
    file: str
    fmi_2: str
    fmi_3: str


PLATFORMS = (
    Platform("x86-64-v2", "linux-x86-64-v2.fmu.so", "linux64", "x86_64-linux"),
    Platform("aarch64", "linux-aarch64.fmu.so", "", "aarch64-linux"),
    Platform("windows", "windows-x86-64-v3.fmu.dll", "win64", "x86_64-windows"),
    Platform("macos", "macos-arm64.fmu.dylib", "darwin64", "aarch64-darwin"),
)
#: What is made where nothing links for other machines: the kernels of this one.
OF_THIS_MACHINE = "host.fmu.so"


def fmu_binaries() -> Mapping[Platform, Path]:
    """The binaries by platform, built where neither the package nor the cache has them.

    Raises
    ------
    ModelError
        Where they would have to be built, and cannot be.
    """
    found = _there(PACKAGE / "core_libraries")
    if found:
        return found
    folder = cache_folder(_stamp())
    if folder is None:
        raise ModelError(
            "the binaries of co-simulation units have to be built, and no folder to keep them can "
            "be written: set MBODY_CACHE_DIR"
        )
    found = _there(folder)
    if not found:
        _build(folder)
        found = _there(folder)
    return found


def _there(folder: Path) -> dict[Platform, Path]:
    """Those of a folder that were made from the present sources; none without one of Linux on
    this machine's processor where they are made here.
    """
    sources = (source_hash() or "none").encode()
    found = {}
    for one in PLATFORMS:
        names = [one.file]
        if one is _here():
            names.append(OF_THIS_MACHINE)
        for file in (folder / name for name in names):
            if one not in found and file.exists() and sources in file.read_bytes():
                found[one] = file
    return found


def _here() -> Platform | None:
    """The platform of this machine, where binaries are built."""
    if not sys.platform.startswith("linux"):
        return None
    return PLATFORMS[1] if platform.machine() in ("aarch64", "arm64") else PLATFORMS[0]


def _stamp() -> str:
    """Of the sources of kernels and shell, the name of the folder that has their binaries."""
    digest = hashlib.sha256(f"fmu {source_hash() or ''}".encode())
    for name in (*SOURCES, *HEADERS):
        digest.update((SHELL / name).read_bytes())
    return digest.hexdigest()[:STAMP_DIGITS]


def _build(folder: Path) -> None:
    """Build the binaries into a folder: with ziglang for all machines, else for this one."""
    zig = find_spec("ziglang") is not None
    here = _here()
    missing = [] if find_spec("numba") else ["numba"]
    if not zig and (here is None or linker() is None):
        missing.append("ziglang")
    if missing:
        raise ModelError(
            "the binaries of co-simulation units are built by numba and a C compiler, not all of "
            f"which are installed: pip install {' '.join(missing)}"
        )
    if os.environ.get("MBODY_QUIET", "0") in ("", "0") and sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print("mbody: building the binaries of co-simulation units (once) ...", file=sys.stderr)
    targets = [one.target for one in PLATFORMS] if zig else ["host"]
    options = [word for target in targets[1:] for word in ("--also", target)]
    options += [word for name in SOURCES for word in ("--with", str(SHELL / name))]
    names = [place(kernel) for kernel in IMAGE_KERNELS]
    with tempfile.TemporaryDirectory(dir=folder) as made:
        out = Path(made)
        command, settings = builder_command(names, targets[0], out, "--whole", *options)
        done = subprocess.run(command, env=settings, capture_output=True, text=True)
        if done.returncode:
            last = "\n".join(done.stderr.strip().splitlines()[-6:])
            raise ModelError(
                f"the binaries of co-simulation units could not be built; the builder said:\n{last}"
            )
        for file in out.iterdir():
            file.replace(folder / file.name)
