"""The call of users' Python from compiled code: `mbody.core.callbacks.call_user` for numba."""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import ctypes
from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import lower_builtin, type_callable

from mbody.core.callbacks import DOOR, call_user

#: Compiled code finds the callback by this name, which (unlike an address) can be written into a
#: file. Numba's object mode would do the same but compile its block in every process.
SYMBOL = "mbody_call_user"
llvmlite.binding.add_symbol(SYMBOL, ctypes.cast(DOOR, ctypes.c_void_p).value)

_FAILED, _INTERRUPTED = 1, 2


def _is_plain_row(array: Any) -> bool:
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.ndim == 1
        and array.layout == "C"
    )


@type_callable(call_user)
def _typer(context: Any) -> Any:
    def typer(handle: Any, x: Any, y: Any) -> Any:
        if isinstance(handle, types.Integer) and _is_plain_row(x) and _is_plain_row(y):
            return signature(types.int64, types.int64, x, y)
        return None

    return typer


@lower_builtin(call_user, types.Integer, types.Array, types.Array)
def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    """Call the door; an interrupt before its first line leaves the status ``_INTERRUPTED``."""
    word = ir.IntType(64)
    number = context.cast(builder, arguments[0], sig.args[0], types.int64)
    status = cgutils.alloca_once_value(builder, ir.Constant(word, _INTERRUPTED))
    status_address = builder.ptrtoint(status, word)
    values = [number]
    for kind, value in zip(sig.args[1:], arguments[1:], strict=True):
        array = context.make_array(kind)(context, builder, value)
        values += [builder.ptrtoint(array.data, word), array.nitems]
    callback = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(ir.VoidType(), [word] * 6), SYMBOL
    )
    builder.store(ir.Constant(word, _INTERRUPTED), status)
    builder.call(callback, [*values, status_address])
    # An exception that occurred in ctypes before the first line of the door is lost.  Python checks
    # for signals there, so it was a keyboard interrupt: store one.
    interrupted = builder.icmp_signed("==", builder.load(status), ir.Constant(word, _INTERRUPTED))
    with builder.if_then(interrupted, likely=False):
        nothing = ir.Constant(word, 0)
        builder.store(ir.Constant(word, _FAILED), status)
        builder.call(
            callback, [number, nothing, ir.Constant(word, -1), nothing, nothing, status_address]
        )
    return builder.load(status)
