"""Users' plain Python, called from compiled code.

A function is registered and gets a handle. :func:`call_user` calls it by that handle, from a kernel
or from plain Python. An exception that it raises is stored until :func:`failure` returns it.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

from mbody.compiler.jit import PLAIN, njit

__all__ = ["call_user", "failure", "raise_failure", "register", "release"]

UserFunction = Callable[[np.ndarray, np.ndarray], Any]

# reentrant: the garbage collector may release a handle while this thread has the lock
_lock = threading.RLock()
_functions: dict[int, UserFunction] = {}
_failures: dict[int, BaseException] = {}
_next_handle = 0

_DONE, _FAILED, _INTERRUPTED = 0, 1, 2


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


# Compiled code finds the callback by a symbol name, which (unlike an address) can be written into a
# cache file.  Numba's object mode would do the same but compile its block in every process.
_SYMBOL = "mbody_call_user"
_callback = ctypes.CFUNCTYPE(
    None,
    ctypes.c_int64,
    ctypes.c_size_t,
    ctypes.c_int64,
    ctypes.c_size_t,
    ctypes.c_int64,
    ctypes.c_size_t,
)(_enter)
llvmlite.binding.add_symbol(_SYMBOL, ctypes.cast(_callback, ctypes.c_void_p).value)


@intrinsic
def _call_by_symbol(typing_context: Any, handle: Any, x: Any, y: Any) -> Any:
    """Call ``_enter``; an interrupt before its first line leaves the status ``_INTERRUPTED``."""
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
        status = cgutils.alloca_once_value(builder, ir.Constant(word, _INTERRUPTED))
        status_address = builder.ptrtoint(status, word)
        values = [number]
        for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
            array = context.make_array(kind)(context, builder, value)
            values += [builder.ptrtoint(array.data, word), array.nitems]
        callback = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [word] * 6), _SYMBOL
        )
        builder.store(ir.Constant(word, _INTERRUPTED), status)
        builder.call(callback, [*values, status_address])
        # An exception that occurred in ctypes before the first line of _enter is lost.  Python
        # checks for signals there, so it was a keyboard interrupt: store one.
        interrupted = builder.icmp_signed(
            "==", builder.load(status), ir.Constant(word, _INTERRUPTED)
        )
        with builder.if_then(interrupted, likely=False):
            nothing = ir.Constant(word, 0)
            builder.store(ir.Constant(word, _FAILED), status)
            builder.call(
                callback, [number, nothing, ir.Constant(word, -1), nothing, nothing, status_address]
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
        return _call_by_symbol(handle, x, y)
