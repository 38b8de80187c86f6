"""Users' plain Python, called from compiled code.

A function is registered and gets a handle. :func:`call_user` calls it by that handle, from a kernel
or from plain Python. An exception that it raises is stored until :func:`failure` returns it.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

# -- A stack of numbers in the frame of a kernel: no allocation, and every thread has its own --

#: How many numbers it has.
FRAME_NUMBERS = 99


def numbers_in_frame(like: Any) -> Any:
    """`FRAME_NUMBERS` numbers of any value, of the type of another; in compiled code in the frame
    of the caller.
    """
    return [0.0] * FRAME_NUMBERS


UserFunction = Callable[[np.ndarray, np.ndarray], Any]

# reentrant: the garbage collector may release a handle while this thread has the lock
_lock = threading.RLock()
_functions: dict[int, UserFunction] = {}
_failures: dict[int, BaseException] = {}
_next_handle = 0

_DONE, _FAILED = 0, 1


def register(function: UserFunction) -> int:
    """Register ``function(x, y)`` for :func:`call_user`; the handle is valid until released."""
    global _next_handle
    if not callable(function):
        raise TypeError(f"not a function: {function!r}")
    with _lock:
        _next_handle += 1
        _functions[_next_handle] = function
        return _next_handle


def release(handle: int) -> None:
    """Remove a registered function and its stored exception; any handle is accepted."""
    with _lock:
        _functions.pop(handle, None)
        _failures.pop(handle, None)


def failure(handle: int | None = None) -> tuple[int, BaseException] | None:
    """Return and remove the exception of a user's function: (handle, exception), or None.

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
    """Raise the stored exception of a user's function again, if there is one."""
    found = failure(handle)
    if found is not None:
        raise found[1]


def _keep_failure(handle: int, error: BaseException) -> int:
    with _lock:
        _failures.setdefault(handle, error)
    return _FAILED


def _call(handle: int, x: np.ndarray, y: np.ndarray) -> int:
    """Call a registered function, on copies: the function may keep them, but a kernel's memory is
    reused.
    """
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
    """Called by compiled code, which has acquired the lock of the interpreter."""
    try:
        if x_size < 0:
            result = _keep_failure(handle, KeyboardInterrupt())
        else:
            result = _call(handle, _view(x_address, x_size), _view(y_address, y_size))
    except BaseException as error:
        result = _keep_failure(handle, error)
    ctypes.c_int64.from_address(status).value = result


#: What compiled code calls, with the lock of the interpreter: (handle, address and size of x,
#: address and size of y, address of the status). A negative size of x reports an interrupt.
DOOR = ctypes.CFUNCTYPE(
    None,
    ctypes.c_int64,
    ctypes.c_size_t,
    ctypes.c_int64,
    ctypes.c_size_t,
    ctypes.c_int64,
    ctypes.c_size_t,
)(_enter)


def call_user(handle: int, x: np.ndarray, y: np.ndarray) -> int:
    """Call a registered function as ``function(x, y)``.

    ``x`` and ``y`` are contiguous 1-D float64 arrays; the function fills ``y``.  Returns 0, or 1 if
    it raised: then ``y`` is as before and :func:`failure` gives the exception. In compiled code the
    same, through `DOOR` (`mbody.compiler.numba_bundle`).
    """
    return _call(handle, x, y)
