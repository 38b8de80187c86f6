"""Compilation of the kernels: one decorator, one disk cache, one door to users' Python.

Every compiled function of the package carries ``@njit`` (or ``@inline``) of this module.  What
is compiled is kept on disk and found again by later processes.  Three names in the environment
matter:

``MBODY_CACHE_DIR``    the folder to keep compiled kernels in,
``MBODY_QUIET``        any text but "0": do not announce a compilation,
``NUMBA_DISABLE_JIT``  ``1``: every function stays the plain Python function that was written.

Numba's own disk cache asks only whether the file of the *calling* function has changed, so after
an edit of a callee in another file it answers with the old code; and it refuses to import where
nothing can be written.  The cache below is filed under a hash of all sources of the package, and
where it finds no folder it does without.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import os
import platform
import shutil
import stat
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, overload

import llvmlite
import llvmlite.binding
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

__all__ = [
    "FASTMATH",
    "cache_folder",
    "call_user",
    "compilations",
    "failure",
    "inline",
    "kernel",
    "njit",
    "raise_failure",
    "register",
    "release",
]

F = TypeVar("F", bound=Callable[..., Any])

#: Freedoms given to the compiler: fuse a multiplication and an addition, forget the sign of a
#: zero.  Sums keep their order and NaN and infinity keep their meaning: the kernels rely on both.
FASTMATH = frozenset({"contract", "nsz"})

#: True where functions stay plain Python.
PLAIN = bool(getattr(numba.config, "DISABLE_JIT", 0))

_PACKAGE = Path(__file__).resolve().parent
_KEEP_SECONDS = 30 * 86400.0
_DIGITS = 32


# ---------------------------------------------------------------------------------------------
# The decorators


def _compile(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    if PLAIN:
        return function
    options = dict(options)
    cached = options.pop("cache", True)
    settings: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": set(FASTMATH),
        **options,
    }
    dispatcher = numba.njit(**settings)(function)
    if cached:
        _attach_cache(dispatcher, function)
    return dispatcher


if TYPE_CHECKING:

    @overload
    def njit(function: F, /) -> F: ...
    @overload
    def njit(**options: Any) -> Callable[[F], F]: ...
    def njit(function: Any = None, /, **options: Any) -> Any: ...

    def inline(function: F, /) -> F: ...

    def kernel(function: F, /) -> F: ...

else:

    def njit(function=None, /, **options):
        """Compile a function: ``@njit`` or ``@njit(forceinline=True, ...)``.

        The options are those of ``numba.njit``; here ``cache`` and ``nogil`` are on, a division
        by zero gives an infinity instead of an exception, and ``fastmath`` is ``FASTMATH``.
        """
        if function is None:
            return lambda function: _compile(function, options)
        return _compile(function, options)

    def inline(function, /):
        """Compile a small function so that its code is always copied into the caller."""
        return _compile(function, {"forceinline": True})

    def kernel(function, /):
        """Compile an entry point that makes no arrays and returns none.

        Numba counts the references to arrays: each ``fields.rows`` of a named tuple is an atomic
        addition, which costs a scalar kernel 40 % and makes threads wait for each other.  A kernel
        works in memory that it was given, so here, and in the functions compiled for it, nothing
        is counted.  For the same reason a function that *returns* an array must not be called
        both from a kernel and from a function compiled with ``njit``.
        """
        return _compile(function, {"_nrt": False})


# ---------------------------------------------------------------------------------------------
# The cache on disk


def _sources() -> Iterator[Path]:
    """All Python sources of the package, in a fixed order."""
    return iter(sorted(_PACKAGE.rglob("*.py")))


def _fingerprint() -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the sources: changes when a file is edited."""
    found = []
    for path in _sources():
        status = path.stat()
        found.append((str(path), status.st_mtime_ns, status.st_size))
    return tuple(found)


@functools.cache
def _stamp() -> tuple[str, tuple[tuple[str, int, int], ...]] | None:
    """Hash of everything that the compiled code depends on, and the files' state with it.

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
    """Make the folder and really write in it: permission bits alone tell too little."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"mbody")
    except (OSError, ValueError):
        return False
    return True


def _owned(folder: Path) -> bool:
    """Whether an existing folder belongs to this user.

    Cache files are pickles and can run anything: those of somebody else are never opened.
    """
    if not hasattr(os, "getuid"):
        return True
    try:
        return folder.stat().st_uid == os.getuid()
    except OSError:
        return False


def _private_temporary() -> Path | None:
    """A folder in the temporary directory that nobody else can have prepared or can enter."""
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
    """Folders to keep the caches of all versions in, best first, and whether the user named it."""
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
    """The folder that keeps this version's compiled kernels, or None if there is none.

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
    """Mark a folder as used today and remove those of other versions unused for long."""
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

    None where nothing can be kept.  The classes extended here are not numba's public interface:
    whoever calls this takes any exception as "no cache".
    """
    folder, stamp = cache_folder(), _stamp()
    if folder is None or stamp is None:
        return None
    from numba.core import caching

    digest, fingerprint = stamp
    token = os.urandom(6).hex()

    class Locator(caching._CacheLocator):
        def __init__(self, function: Any, file: str) -> None:
            self._py_file = file  # numba names it in its warnings
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

    class PackageCache(caching.FunctionCache):
        _impl_class = Implementation

        def __init__(self, function: Any) -> None:
            super().__init__(function)
            # Numba numbers the data files of a function 1, 2, ...  Two processes that compile it
            # for different types at once would both write number 1, and one would find the
            # other's code there.
            file = self._cache_file
            pattern = file._data_name_pattern
            file._data_name_pattern = pattern.replace("{number:d}", "{number:d}-" + token)
            if not isinstance(self._impl.locator, Locator):  # NUMBA_CACHE_LOCATOR_CLASSES is set
                self.disable()

        def load_overload(self, signature: Any, target_context: Any) -> Any:
            try:
                return super().load_overload(signature, target_context)
            except Exception:  # a damaged file is as good as none: start afresh and compile
                with contextlib.suppress(OSError):
                    self.flush()
                return None

        def save_overload(self, signature: Any, data: Any) -> None:
            # No harm in a full disk or a folder that has gone.
            with contextlib.suppress(OSError):
                # Sources edited since this process started are not what was compiled.
                if _fingerprint() == fingerprint:
                    super().save_overload(signature, data)

    return PackageCache


def _attach_cache(dispatcher: Any, function: Callable[..., Any]) -> None:
    """Give a compiled function its place on disk, if there is any."""
    try:
        # The stamp covers the package alone, so functions from elsewhere are not kept.
        if _PACKAGE in Path(function.__code__.co_filename).resolve().parents:
            kind = _cache_type()
            if kind is not None:
                dispatcher._cache = kind(function)
    except Exception:
        return  # an interface of numba has changed: compile in each process


# ---------------------------------------------------------------------------------------------
# What has been compiled

_compiled = 0


def compilations() -> int:
    """Number of functions of the package compiled, not loaded from disk, in this process."""
    return _compiled


def _announce() -> None:
    if os.environ.get("MBODY_QUIET", "0") not in ("", "0") or sys.stderr is None:
        return
    if cache_folder() is not None:
        detail = "once, up to a minute"
    else:
        detail = "no folder to keep them in, see MBODY_CACHE_DIR"
    with contextlib.suppress(OSError, ValueError):
        print(f"mbody: compiling kernels for this machine ({detail}) ...", file=sys.stderr)


def _count(dispatcher: Any) -> None:
    global _compiled
    module = getattr(getattr(dispatcher, "py_func", None), "__module__", None) or ""
    if module.partition(".")[0] == __name__.partition(".")[0]:
        _compiled += 1
        if _compiled == 1:
            _announce()


def _listen() -> None:
    """Have numba tell of each compilation; it says nothing of functions loaded from disk."""
    try:
        from numba.core import event

        class Compilations(event.Listener):
            def on_start(self, event: Any) -> None:
                _count(event.data.get("dispatcher"))

            def on_end(self, event: Any) -> None:
                pass

        event.register("numba:compile", Compilations())
    except Exception:
        return  # an interface of numba has changed: compilations go uncounted


if not PLAIN:
    _listen()


# ---------------------------------------------------------------------------------------------
# Users' plain Python, called from compiled code

UserFunction = Callable[[np.ndarray, np.ndarray], Any]

_lock = threading.Lock()
_functions: dict[int, UserFunction] = {}
_failures: dict[int, BaseException] = {}
_next_handle = 0

_DONE, _FAILED, _LOST = 0, 1, 2


def register(function: UserFunction) -> int:
    """Keep ``function(x, y)`` for :func:`call_user`; the handle is valid until released."""
    global _next_handle
    if not callable(function):
        raise TypeError(f"not a function: {function!r}")
    with _lock:
        _next_handle += 1
        _functions[_next_handle] = function
        return _next_handle


def release(handle: int) -> None:
    """Forget a registered function and what it may have raised; any handle is accepted."""
    with _lock:
        _functions.pop(handle, None)
        _failures.pop(handle, None)


def failure(handle: int | None = None) -> tuple[int, BaseException] | None:
    """Take what a user's function raised: (handle, exception), or None.

    Without a handle, the oldest failure of any function.  ``KeyboardInterrupt`` and ``SystemExit``
    are among them and must be raised again by the caller.
    """
    with _lock:
        if handle is None:
            handle = next(iter(_failures), None)
        if handle is None or handle not in _failures:
            return None
        return handle, _failures.pop(handle)


def raise_failure(handle: int | None = None) -> None:
    """Raise again what a user's function raised, if anything."""
    found = failure(handle)
    if found is not None:
        raise found[1]


def _keep_failure(handle: int, error: BaseException) -> int:
    with _lock:
        _failures.setdefault(handle, error)
    return _FAILED


def _call(handle: int, x: np.ndarray, y: np.ndarray) -> int:
    """Call a registered function, on copies: it may keep them, a kernel's memory does not last."""
    try:
        with _lock:
            function = _functions.get(handle)
        if function is None:
            raise LookupError(f"no user function has the handle {handle}")
        result = y.copy()
        function(x.copy(), result)
        y[:] = result
    except BaseException as error:
        return _keep_failure(handle, error)
    return _DONE


def _view(address: int, size: int) -> np.ndarray:
    if size == 0:
        return np.empty(0)
    return np.asarray((ctypes.c_double * size).from_address(address))


def _enter(
    handle: int, x_address: int, x_size: int, y_address: int, y_size: int, status: int
) -> None:
    """Called by compiled code, with the lock of the interpreter held."""
    try:
        if x_size < 0:
            result = _keep_failure(handle, KeyboardInterrupt())
        else:
            result = _call(handle, _view(x_address, x_size), _view(y_address, y_size))
    except BaseException as error:
        result = _keep_failure(handle, error)
    ctypes.c_int64.from_address(status).value = result


# Compiled code finds the door by name, which (unlike an address) can be written into a cache
# file.  Numba's object mode would do the same but compile its block anew in every process.
_DOOR = "mbody_call_user"
_door = ctypes.CFUNCTYPE(
    None,
    ctypes.c_int64,
    ctypes.c_size_t,
    ctypes.c_int64,
    ctypes.c_size_t,
    ctypes.c_int64,
    ctypes.c_size_t,
)(_enter)
llvmlite.binding.add_symbol(_DOOR, ctypes.cast(_door, ctypes.c_void_p).value)


@intrinsic
def _through_door(typing_context: Any, handle: Any, x: Any, y: Any) -> Any:
    """Call ``_enter``; an interrupt that meets it before its first line leaves ``_LOST``."""
    for array in (x, y):
        if not (
            isinstance(array, types.Array)
            and array.dtype == types.float64
            and array.ndim == 1
            and array.layout == "C"
        ):
            raise TypingError(f"call_user needs contiguous 1-D float64 arrays, not {array}")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        number = context.cast(builder, arguments[0], signature.args[0], types.int64)
        status = cgutils.alloca_once_value(builder, ir.Constant(word, _LOST))
        status_address = builder.ptrtoint(status, word)
        values = [number]
        for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
            array = context.make_array(kind)(context, builder, value)
            values += [builder.ptrtoint(array.data, word), array.nitems]
        door = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [word] * 6), _DOOR
        )
        builder.store(ir.Constant(word, _LOST), status)
        builder.call(door, [*values, status_address])
        # An exception that ctypes met before the first line of _enter is gone.  Python looks for
        # signals just there, so it was a keyboard interrupt: have that kept.
        lost = builder.icmp_signed("==", builder.load(status), ir.Constant(word, _LOST))
        with builder.if_then(lost, likely=False):
            nothing = ir.Constant(word, 0)
            builder.store(ir.Constant(word, _FAILED), status)
            builder.call(
                door, [number, nothing, ir.Constant(word, -1), nothing, nothing, status_address]
            )
        return builder.load(status)

    return types.int64(handle, x, y), generate


if TYPE_CHECKING or PLAIN:

    def call_user(handle: int, x: np.ndarray, y: np.ndarray) -> int:
        """Call a registered function as ``function(x, y)``, from plain Python."""
        return _call(handle, x, y)

else:

    @njit
    def call_user(handle, x, y):
        """Call a registered function as ``function(x, y)``, from compiled code.

        ``x`` and ``y`` are contiguous 1-D float64 arrays; the function fills ``y``.  Returns 0, or
        1 if it raised: then ``y`` is as before and :func:`failure` gives the exception.
        """
        return _through_door(handle, x, y)
