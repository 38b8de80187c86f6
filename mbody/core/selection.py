"""Which core runs the kernels: a library of machine code, numba, or plain Python.

``MBODY_CORE=native|numba|plain`` decides. Without it the best that is here is taken: the library of
the installed package, if it was made from these sources; else machine code made once on this
machine, where numba and a linker are installed; else numba; else plain Python, some thousand times
slower, with a warning. ``NUMBA_DISABLE_JIT=1`` means plain.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import json
import os
import platform
import shutil
import stat
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mbody.core import registered
from mbody.core.callbacks import DOOR
from mbody.errors import ModelError, ModelWarning

# -- The folder in which compiled kernels are kept, one for each version of the sources --------

_KEEP_SECONDS = 30 * 86400.0
#: Length of a stamp, the name of a folder, in hexadecimal digits.
STAMP_DIGITS = 32


def _writable(folder: Path) -> bool:
    """Make the folder and write a file in it: permission bits alone are not enough."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"mbody")
    except (OSError, ValueError):
        return False
    return True


def _owned(folder: Path) -> bool:
    """Whether an existing folder belongs to this user.

    Cache files are pickles and can run any code: those of another user are never opened.
    """
    if not hasattr(os, "getuid"):
        return True
    try:
        return folder.stat().st_uid == os.getuid()
    except OSError:
        return False


def _private_temporary() -> Path | None:
    """A folder in the temporary directory that belongs to this user and that only this user can
    enter.
    """
    user = str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    try:
        folder = Path(tempfile.gettempdir()) / f"mbody-{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    if not stat.S_ISDIR(status.st_mode):
        return None
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o077):
        return None
    return folder


def _candidates() -> Iterator[tuple[Path, bool]]:
    """Folders for the caches of all versions, best first, each with whether the user named it."""
    for name, suffix in (("MBODY_CACHE_DIR", ""), ("NUMBA_CACHE_DIR", "mbody")):
        value = os.environ.get(name)
        if value:
            yield Path(value).expanduser().absolute() / suffix, True
    home = os.environ.get("XDG_CACHE_HOME") or (
        os.environ.get("LOCALAPPDATA") if os.name == "nt" else None
    )
    try:
        cache = Path(home) if home else Path.home() / ".cache"
    except RuntimeError:  # no home directory is known
        pass
    else:
        if cache.is_absolute():
            yield cache / "mbody", False
    temporary = _private_temporary()
    if temporary is not None:
        yield temporary, False


@functools.cache
def cache_folder(stamp: str) -> Path | None:
    """The folder of compiled kernels with this stamp, or None if there is none.

    The first that can be written of ``$MBODY_CACHE_DIR/<stamp>``,
    ``$NUMBA_CACHE_DIR/mbody/<stamp>``, ``$XDG_CACHE_HOME/mbody/<stamp>`` (by default
    ``~/.cache``), and a private temporary folder.
    """
    for base, named in _candidates():
        folder = base / stamp
        if _writable(folder) and (named or _owned(folder)):
            _prune(base, folder)
            return folder
    return None


def _prune(base: Path, used: Path) -> None:
    """Mark a folder as used today and remove those of other versions that were not used for 30
    days.
    """
    now = time.time()
    try:
        if now - used.stat().st_mtime < 86400.0 and any(used.iterdir()):
            return  # done by an earlier process today
        os.utime(used)
        old = [
            entry
            for entry in base.iterdir()
            if len(entry.name) == STAMP_DIGITS
            and set(entry.name) <= set("0123456789abcdef")
            and entry != used
            and not entry.is_symlink()
            and now - entry.stat().st_mtime > _KEEP_SECONDS
        ]
    except OSError:
        return
    for folder in old:
        shutil.rmtree(folder, ignore_errors=True)


# -- The sources of all compiled code, and their hash: machine code of other sources is never
#    run ---------------------------------------------------------------------------------------

#: The sources that may contain a compiled function or a constant of one; a test checks the list.
COMPILED = (
    "compiler/*.py",
    "core/bundle.py",
    "core/callbacks.py",
    "core/decorators.py",
    "core/lanes.py",
    "core/interface.py",
    "core/libraries.py",
    "core/slopes.py",
    "core/tolerances.py",
    "kernels/*.py",
    "laws/*.py",
    "model/joints/*.py",
    "model/loads/*.py",
    "model/primitives.py",
)

PACKAGE = Path(__file__).resolve().parents[1]


def sources() -> Iterator[Path]:
    """All sources of compiled functions, in a fixed order."""
    return iter(sorted(path for part in COMPILED for path in PACKAGE.glob(part)))


def fingerprint() -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the sources: changes when a file is edited."""
    found = []
    for path in sources():
        status = path.stat()
        found.append((str(path), status.st_mtime_ns, status.st_size))
    return tuple(found)


@functools.cache
def source_hash() -> str | None:
    """Hash of all sources as they were when this process first needed it, in hexadecimal.

    None where the sources cannot be read (a package without sources, or inside an archive).
    """
    digest = hashlib.sha256()
    count = 0
    try:
        for path in sources():
            content = path.read_bytes()
            name = path.relative_to(PACKAGE).as_posix()
            digest.update(f"{name}\0{len(content)}\0".encode())
            digest.update(content)
            count += 1
    except OSError:
        return None
    return digest.hexdigest() if count else None


# -- A library of machine code: finding the level of the processor, opening, checking its hash -


class LibraryError(OSError):
    """Why a library cannot be used."""


@dataclass(frozen=True)
class Level:
    """Processors that one library is for."""

    name: str
    system: str
    machine: str
    file: str
    #: Features of the processor that it needs, by NumPy's names.
    needs: tuple[str, ...] = ()


#: Best first.
LEVELS = (
    Level("x86-64-v4", "linux", "x86_64", "linux-x86-64-v4.so", ("AVX512_SKX", "AVX2", "FMA3")),
    Level("x86-64-v3", "linux", "x86_64", "linux-x86-64-v3.so", ("AVX2", "FMA3")),
    Level("x86-64-v2", "linux", "x86_64", "linux-x86-64-v2.so", ("SSE42",)),
    Level("aarch64", "linux", "aarch64", "linux-aarch64.so"),
    Level("x86-64-v3", "win32", "x86_64", "windows-x86-64-v3.dll", ("AVX2", "FMA3")),
    Level("arm64", "darwin", "aarch64", "macos-arm64.dylib"),
)
_SEAL = hashlib.sha256().digest_size
_MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}


def processor_features() -> frozenset[str]:
    """Features of the processor, by NumPy's names."""
    # NumPy has no types of its private modules
    from numpy._core._multiarray_umath import __cpu_features__  # type: ignore[import-not-found]

    return frozenset(name for name, there in __cpu_features__.items() if there)


def best_levels() -> Iterator[Level]:
    """The levels that this processor has, best first; ``MBODY_CORE_LEVEL`` names the only one."""
    features = processor_features()
    wanted = os.environ.get("MBODY_CORE_LEVEL")
    machine = platform.machine().lower()
    machine = _MACHINES.get(machine, machine)
    if wanted and wanted != "host" and wanted not in {level.name for level in LEVELS}:
        names = ", ".join(dict.fromkeys(level.name for level in LEVELS))
        raise ModelError(f"MBODY_CORE_LEVEL={wanted} is none of the levels host, {names}")
    for level in LEVELS:
        if (level.system, level.machine) != (sys.platform, machine):
            continue
        lacking = [name for name in level.needs if name not in features]
        if wanted == level.name and lacking:
            raise ModelError(
                f"MBODY_CORE_LEVEL={wanted}, but this processor has no {', '.join(lacking)}: "
                "choose a lower level"
            )
        if not lacking and wanted in (None, "", level.name):
            yield level


class Library:
    """An opened library of kernels."""

    def __init__(self, opened: ctypes.CDLL, file: Path) -> None:
        self._opened, self.file = opened, file

    def entries(self) -> dict[str, Any]:
        """Its table: ``"kernels"``, the arguments and results of each, and ``"needs"``, the
        functions of the C library that it calls.
        """
        found: dict[str, Any] = json.loads(
            ctypes.string_at(_address(self._opened, "mbody_entries"))
        )
        return found

    def function(self, name: str, arguments: list[Any]) -> Any:
        """The entry of a kernel for calls from Python."""
        try:
            found = self._opened[f"mbody_{name}_np"]
        except AttributeError:
            raise LibraryError(f"{self.file} has no kernel {name!r}") from None
        found.argtypes, found.restype = arguments, ctypes.c_int32
        return found


def seal(file: Path) -> None:
    """Append the hash of a library to it, so that half a file is recognised before it is opened:
    the loader of the system would read beyond its end.
    """
    with file.open("r+b") as opened:
        digest = hashlib.sha256(opened.read()).digest()
        opened.write(digest)


def _check_whole(file: Path) -> None:
    content = file.read_bytes()
    whole, digest = content[:-_SEAL], content[-_SEAL:]
    if len(content) <= _SEAL or hashlib.sha256(whole).digest() != digest:
        raise ValueError("its content is not what was written")


def _address(opened: ctypes.CDLL, name: str) -> int:
    return ctypes.addressof(ctypes.c_char.in_dll(opened, name))


def open_library(file: Path, sources: str | None) -> Library:
    """Open a library that was made from these sources, and give it the door to users' Python."""
    try:
        _check_whole(file)
        opened = ctypes.CDLL(str(file))
        made_from = (ctypes.c_char * 64).in_dll(opened, "mbody_sources").value.decode()
        door = ctypes.c_void_p.in_dll(opened, "mbody_user_door")
        head = ctypes.c_int64.in_dll(opened, "mbody_object_head")
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise LibraryError(f"{file} is damaged ({error}): install mbody again") from None
    if made_from != sources:
        raise LibraryError(f"{file} was made from other sources ({made_from[:8]} …)")
    door.value = ctypes.cast(DOOR, ctypes.c_void_p).value
    # where NumPy's public structure of an array begins: behind the head of any Python object
    head.value = object.__basicsize__
    return Library(opened, file)


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
