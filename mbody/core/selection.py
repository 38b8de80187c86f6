"""Which core runs the kernels: a library of machine code, numba, or plain Python.

``MBODY_CORE=native|numba|plain`` decides. Without it the best that is here is taken: the library of
the installed package, if it was made from these sources; else machine code made once on this
machine, where numba and a linker are installed; else numba; else plain Python, some thousand times
slower, with a warning. ``NUMBA_DISABLE_JIT=1`` means plain.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shutil
import sys
import warnings
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mbody.core import registered
from mbody.core.cache_folder import STAMP_DIGITS, cache_folder
from mbody.core.library import Library, LibraryError, best_levels, open_library, processor_features
from mbody.core.sources import PACKAGE, source_hash
from mbody.errors import ModelError, ModelWarning

CORES = ("native", "numba", "plain")
#: The C compiler of the package `ziglang`, which links for other machines too.
ZIG = [sys.executable, "-m", "ziglang", "cc"]
_DISABLED = "NUMBA_DISABLE_JIT is set"


@dataclass(frozen=True)
class Choice:
    """A core, and why it was chosen."""

    name: str
    reason: str
    #: The library of the package, or the folder of kernels made on this machine.
    file: Path | None = None
    level: str | None = None
    library: Library | None = None


class _Missing(Exception):
    """Why a core cannot run here."""


#: What to do where a distribution `mbody` stands beside this one.
NAMESAKE = (
    "a distribution 'mbody' {} is installed in {}: on the public index this name is another "
    "project, and both have the import name mbody; this one is 'mbody-planar': pip uninstall "
    "mbody, then install mbody-planar again"
)


def namesake() -> str | None:
    """A sentence where a distribution named mbody is installed beside this one, which is named
    mbody-planar; else None.
    """
    for folder in filter(None, dict.fromkeys(sys.path)):
        for found in Path(folder).glob("mbody-*.dist-info"):
            return NAMESAKE.format(found.name[len("mbody-") : -len(".dist-info")], folder)
    return None


@functools.cache
def chosen() -> Choice:
    """The core of this process."""
    if beside := namesake():
        warnings.warn(beside, ModelWarning, stacklevel=2)
    wanted = os.environ.get("MBODY_CORE", "")
    if wanted and wanted not in CORES:
        raise ModelError(
            f"MBODY_CORE={wanted} is none of the cores {', '.join(CORES)}: set one of them"
        )
    disabled = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
    if disabled and wanted in ("", "plain"):
        return Choice("plain", _DISABLED)
    tried: list[str] = []
    for name, find in (("native", _native), ("numba", _numba), ("plain", _plain)):
        if wanted not in ("", name):
            continue
        try:
            found = find()
        except _Missing as missing:
            tried.append(str(missing))
            continue
        if wanted:
            return found
        if name == "plain":
            why = "; ".join(tried)
            warnings.warn(
                f"mbody runs in plain Python, some thousand times slower ({why}): install a wheel "
                "with libraries for this machine, or numba (pip install mbody-planar[jit])",
                ModelWarning,
                stacklevel=2,
            )
        return replace(found, reason="; ".join([*tried, found.reason]))
    raise ModelError(f"MBODY_CORE={wanted}, but that core cannot run here: {'; '.join(tried)}")


def _plain() -> Choice:
    return Choice("plain", "plain Python")


def _numba() -> Choice:
    if find_spec("numba") is None:
        raise _Missing("numba is not installed")
    return Choice(
        "numba", "numba compiles the kernels in each process that finds none in its cache"
    )


def _native() -> Choice:
    """The library of the package, or machine code made on this machine."""
    reasons = []
    try:
        return _packaged()
    except _Missing as missing:
        reasons.append(str(missing))
    try:
        return _made_here("; ".join(reasons))
    except _Missing as missing:
        reasons.append(str(missing))
    raise _Missing("; ".join(reasons))


def _packaged() -> Choice:
    folder = PACKAGE / "core_libraries"
    if not folder.is_dir():
        raise _Missing("the package has no libraries")
    sources, reasons = source_hash(), []
    for level in best_levels():
        file = folder / level.file
        if not file.exists():
            continue
        try:
            library = open_library(file, sources)
        except LibraryError as error:
            reasons.append(str(error))
            continue
        return Choice(
            "native", "; ".join([*reasons, "the library of the package"]), file, level.name, library
        )
    raise _Missing("; ".join(reasons) or f"the package has no library for {platform.machine()}")


def linker() -> list[str] | None:
    """The command that links objects into a library on this machine, or None."""
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name)
        if found:
            return [found]
    return ZIG if find_spec("ziglang") else None


def _made_here(why: str) -> Choice:
    """Kernels that are built when they are first called, and kept."""
    sources = source_hash()
    if sources is None:
        raise _Missing("the sources of the kernels cannot be read")
    if find_spec("numba") is None:
        raise _Missing("numba, which builds it, is not installed")
    if linker() is None:
        raise _Missing("no C compiler (cc) links it")
    if sys.platform == "win32":
        raise _Missing("kernels are not linked on Windows")
    level = os.environ.get("MBODY_CORE_LEVEL", "host")
    folder = cache_folder(_stamp(sources, level))
    if folder is None:
        raise _Missing("no folder to keep it can be written, see MBODY_CACHE_DIR")
    return Choice("native", f"{why}: kernels are made on this machine, once", folder, level)


def machine_code_folder() -> tuple[Path, str] | None:
    """The folder for machine code made on this machine, and its level, where machine code is the
    core and can be made; else None.
    """
    choice, sources = chosen(), source_hash()
    if choice.name != "native" or choice.level is None or sources is None:
        return None
    if find_spec("numba") is None or linker() is None or sys.platform == "win32":
        return None
    folder = cache_folder(_stamp(sources, choice.level))
    return None if folder is None else (folder, choice.level)


def _date(package: str) -> tuple[int, int]:
    """Date and size of the first file of a package."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return 0, 0
    status = os.stat(spec.origin)
    return status.st_mtime_ns, status.st_size


def _stamp(sources: str, level: str) -> str:
    """Hash of everything that machine code made here depends on; numba by the dates of its files,
    since to read the versions of packages takes longer than all the rest.
    """
    features = sorted(processor_features())
    settings = [
        f"{n}={os.environ.get(n)}" for n in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT")
    ]
    made = (
        sources,
        _date("numba"),
        _date("llvmlite"),
        platform.machine(),
        level,
        features,
        settings,
    )
    return hashlib.sha256(repr(made).encode()).hexdigest()[:STAMP_DIGITS]


@functools.cache
def compiler() -> Any:
    """The numba half of bundles, lanes and decorators, where numba is the core; else None."""
    if chosen().name != "numba":
        return None
    return import_module(registered.compiler)
