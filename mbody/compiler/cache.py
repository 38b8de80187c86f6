"""The cache of compiled functions on disk, under one hash of all sources that they are made of.

Numba's own disk cache checks only the file of the *calling* function. After an edit of a called
function in another file it returns the old code, and where nothing can be written the import
fails. The cache below is stored under a hash of all sources that contain compiled functions or
their constants. Where no folder can be written, nothing is cached.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba

__all__ = ["COMPILED", "PLAIN", "attach_cache", "cache_folder"]

#: True where functions stay plain Python; then nothing is compiled or cached.
PLAIN = bool(getattr(numba.config, "DISABLE_JIT", 0))

#: The sources that may contain a compiled function or a constant of one; a test checks the list.
COMPILED = (
    "compiler/*.py",
    "kernels/*.py",
    "laws/*.py",
    "model/joints/*.py",
    "model/loads/*.py",
    "model/geometry.py",
    "model/primitives.py",
    "system/layout.py",
)

_PACKAGE = Path(__file__).resolve().parents[1]
_KEEP_SECONDS = 30 * 86400.0
_DIGITS = 32


def _sources() -> Iterator[Path]:
    """All sources of compiled functions, in a fixed order."""
    return iter(sorted(path for part in COMPILED for path in _PACKAGE.glob(part)))


def _fingerprint() -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the sources: changes when a file is edited."""
    found = []
    for path in _sources():
        status = path.stat()
        found.append((str(path), status.st_mtime_ns, status.st_size))
    return tuple(found)


@functools.cache
def _stamp() -> tuple[str, tuple[tuple[str, int, int], ...]] | None:
    """Hash of everything that the compiled code depends on, and the fingerprint of the sources.

    None where the sources cannot be read (a package without sources, or inside an archive).
    """
    digest = hashlib.sha256()
    try:
        before = _fingerprint()
        if not before:
            return None
        for path in _sources():
            content = path.read_bytes()
            name = path.relative_to(_PACKAGE).as_posix()
            digest.update(f"{name}\0{len(content)}\0".encode())
            digest.update(content)
    except OSError:
        return None
    versions = (sys.version, platform.machine(), numba.__version__, llvmlite.__version__)
    # Settings of numba that change the code but not numba's own key of a cache entry.
    names = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "SLP_VECTORIZE")
    settings = tuple(str(getattr(numba.config, name, "")) for name in names)
    digest.update(repr((versions, settings)).encode())
    return digest.hexdigest()[:_DIGITS], before


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
def cache_folder() -> Path | None:
    """The folder of this version's compiled kernels, or None if there is none.

    The first that can be written of ``$MBODY_CACHE_DIR/<hash>``, ``$NUMBA_CACHE_DIR/mbody/<hash>``,
    ``$XDG_CACHE_HOME/mbody/<hash>`` (by default ``~/.cache``), and a private temporary folder.
    """
    stamp = _stamp()
    if PLAIN or stamp is None:
        return None
    for base, named in _candidates():
        folder = base / stamp[0]
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
            if len(entry.name) == _DIGITS
            and set(entry.name) <= set("0123456789abcdef")
            and entry != used
            and not entry.is_symlink()
            and now - entry.stat().st_mtime > _KEEP_SECONDS
        ]
    except OSError:
        return
    for folder in old:
        shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def _cache_type() -> Any:
    """Numba's cache of compiled functions, filed under the stamp of the package.

    None where nothing can be stored.  The classes extended here are not numba's public interface:
    callers treat any exception as "no cache".
    """
    folder, stamp = cache_folder(), _stamp()
    if folder is None or stamp is None:
        return None
    from numba.core import caching

    digest, fingerprint = stamp
    token = os.urandom(6).hex()

    class Locator(caching._CacheLocator):
        def __init__(self, function: Any, file: str) -> None:
            self._py_file = file  # numba prints it in its warnings
            self._label = f"{function.__module__}-{function.__code__.co_firstlineno}"

        @classmethod
        def from_function(cls, function: Any, file: str) -> Locator:
            return cls(function, file)

        def get_cache_path(self) -> str:
            return str(folder)

        def get_source_stamp(self) -> str:
            return digest

        def get_disambiguator(self) -> str:
            return self._label

    class Implementation(caching.CompileResultCacheImpl):
        _locator_classes: Any = (Locator,)
        rebuilt: Any = None

        def rebuild(self, target_context: Any, payload: Any) -> Any:
            if self.rebuilt is not None:
                return self.rebuilt(target_context, payload)
            return super().rebuild(target_context, payload)

    class PackageCache(caching.FunctionCache):
        _impl_class = Implementation

        def __init__(self, function: Any, form: str, rebuilt: Any) -> None:
            super().__init__(function)
            self._impl.rebuilt = rebuilt
            # Numba numbers the data files of a function 1, 2, ...  Two processes that compile it
            # for different types at once would both write number 1, and one would load the
            # code of the other.
            file = self._cache_file
            pattern = file._data_name_pattern
            pattern = form + pattern.replace("{number:d}", "{number:d}-" + token)
            file._data_name_pattern, file._index_name = pattern, form + file._index_name
            file._index_path = os.path.join(file._cache_path, file._index_name)
            if not isinstance(self._impl.locator, Locator):  # NUMBA_CACHE_LOCATOR_CLASSES is set
                self.disable()

        def load_overload(self, signature: Any, target_context: Any) -> Any:
            try:
                return super().load_overload(signature, target_context)
            except Exception:  # a damaged file: clear the cache and compile
                with contextlib.suppress(OSError):
                    self.flush()
                return None

        def save_overload(self, signature: Any, data: Any) -> None:
            # A full disk or a removed folder only means that nothing is cached.
            with contextlib.suppress(OSError):
                # If sources were edited since this process started, they are not what was compiled.
                if _fingerprint() == fingerprint:
                    super().save_overload(signature, data)

    return PackageCache


def attach_cache(dispatcher: Any, function: Callable[..., Any], form: str = "") -> None:
    """Attach the disk cache to a compiled function, if there is one; `form` is a prefix of its
    files.

    A dispatcher with a method `rebuilt` restores its compiled code from the cache by that method.
    """
    try:
        # The hash covers the package alone, so functions from elsewhere are not cached.
        if _PACKAGE in Path(function.__code__.co_filename).resolve().parents:
            kind = _cache_type()
            if kind is not None:
                dispatcher._cache = kind(function, form, getattr(dispatcher, "rebuilt", None))
    except Exception:
        return  # an interface of numba has changed: compile in each process
