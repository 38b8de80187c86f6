"""Numba's cache of compiled functions on disk, under one hash of all sources that they are made of.

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
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite
import numba

from mbody.core.selection import PACKAGE, STAMP_DIGITS, cache_folder, fingerprint, source_hash


@functools.cache
def _before() -> tuple[tuple[str, int, int], ...]:
    """The fingerprint of the sources before the first compilation."""
    return fingerprint()


@functools.cache
def stamp() -> str | None:
    """Hash of everything that the compiled code depends on; None where that cannot be read."""
    try:
        _before()
    except OSError:
        return None
    sources = source_hash()
    if sources is None:
        return None
    versions = (sys.version, platform.machine(), numba.__version__, llvmlite.__version__)
    # Settings of numba that change the code but not numba's own key of a cache entry.
    names = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "SLP_VECTORIZE")
    settings = tuple(str(getattr(numba.config, name, "")) for name in names)
    digest = hashlib.sha256(repr((sources, versions, settings)).encode())
    return digest.hexdigest()[:STAMP_DIGITS]


def numba_folder() -> Path | None:
    """The folder of this version's compiled functions, or None if there is none."""
    found = stamp()
    return None if found is None else cache_folder(found)


@functools.cache
def _cache_type() -> Any:
    """Numba's cache of compiled functions, filed under the stamp of the package.

    None where nothing can be stored.  The classes extended here are not numba's public interface:
    callers treat any exception as "no cache".
    """
    found, folder, before = stamp(), numba_folder(), _before()
    if folder is None or found is None:
        return None
    digest: str = found
    from numba.core import caching

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
                if fingerprint() == before:
                    super().save_overload(signature, data)

    return PackageCache


_off = False


def without_cache() -> None:
    """Attach no cache from now on."""
    global _off
    _off = True


def attach_cache(dispatcher: Any, function: Callable[..., Any], form: str = "") -> None:
    """Attach the disk cache to a compiled function, if there is one; `form` is a prefix of its
    files.

    A dispatcher with a method `rebuilt` restores its compiled code from the cache by that method.
    """
    if _off:
        return
    try:
        # The hash covers the package alone, so functions from elsewhere are not cached.
        if PACKAGE in Path(function.__code__.co_filename).resolve().parents:
            kind = _cache_type()
            if kind is not None:
                dispatcher._cache = kind(function, form, getattr(dispatcher, "rebuilt", None))
    except Exception:
        return  # an interface of numba has changed: compile in each process
