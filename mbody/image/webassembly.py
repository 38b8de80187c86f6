"""The compiled core for browsers: WebAssembly of the package, or built once on this machine."""

from __future__ import annotations

import contextlib
import hashlib
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from mbody.core.cache_folder import STAMP_DIGITS, cache_folder
from mbody.core.native import builder_command, place
from mbody.core.sources import PACKAGE, source_hash
from mbody.errors import ModelError
from mbody.image.image_kernels import IMAGE_KERNELS

__all__ = ["FILE", "MODULE", "TARGET", "browser_core", "build_browser_core"]

#: Name of the target of the compiler.
TARGET = "wasm32"
#: Name of the core for browsers, in the package and beside it.
FILE = "mbody.wasm"
#: The ES module that loads it.
MODULE = Path(__file__).parent / "browser" / "mbody.mjs"


def browser_core() -> Path:
    """The file of the core for browsers, built where neither the package nor the cache has it.

    Raises
    ------
    ModelError
        Where it would have to be built, and cannot be.
    """
    sources = source_hash() or ""
    packaged = PACKAGE / "core_libraries" / FILE
    if packaged.exists() and made_from(packaged, sources):
        return packaged
    stamp = hashlib.sha256(f"{TARGET} {sources}".encode()).hexdigest()[:STAMP_DIGITS]
    folder = cache_folder(stamp)
    if folder is None:
        raise ModelError(
            "the core for browsers has to be built, and no folder to keep it can be written: set "
            "MBODY_CACHE_DIR"
        )
    file = folder / FILE
    if not (file.exists() and made_from(file, sources)):
        _announce()
        build_browser_core(folder, quiet=True)
    return file


def _announce() -> None:
    """Say that building takes its time."""
    if os.environ.get("MBODY_QUIET", "0") in ("", "0") and sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print("mbody: building the core for browsers (once) ...", file=sys.stderr)


def build_browser_core(folder: Path, quiet: bool = False) -> None:
    """Build the core for browsers into a folder.

    Raises
    ------
    ModelError
        Where numba or ziglang is missing, or the builder fails.
    """
    missing = [name for name in ("numba", "ziglang") if find_spec(name) is None]
    if missing:
        raise ModelError(
            "the core for browsers is built by numba and ziglang, not all of which are installed: "
            f"pip install {' '.join(missing)}"
        )
    names = [place(kernel) for kernel in IMAGE_KERNELS]
    command, settings = builder_command(names, TARGET, folder, "--whole")
    done = subprocess.run(command, env=settings, capture_output=quiet, text=True)
    if done.returncode:
        last = "" if done.stderr is None else "\n".join(done.stderr.strip().splitlines()[-6:])
        raise ModelError(f"the core for browsers could not be built; the builder said:\n{last}")


def made_from(file: Path, sources: str) -> bool:
    """Whether a core was made from these sources; their hash is among its data."""
    return bool(sources) and sources.encode() in file.read_bytes()
