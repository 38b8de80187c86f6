"""`mbody.core.stack.numbers_in_frame` in compiled code."""

# mypy: disallow-any-unimported=False, disallow-untyped-decorators=False
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import lower_builtin, type_callable

from mbody.compiler.lanes_type import Lanes, llvm_type
from mbody.core.stack import FRAME_NUMBERS, numbers_in_frame

__all__: list[str] = []


@type_callable(numbers_in_frame)
def _typer(context: Any) -> Any:
    def typer(like: Any) -> Any:
        kind = like if isinstance(like, Lanes) else types.float64
        return signature(types.CPointer(kind), kind)

    return typer


@lower_builtin(numbers_in_frame, types.Any)
def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    size = ir.Constant(ir.IntType(32), FRAME_NUMBERS)
    return cgutils.alloca_once(builder, llvm_type(sig.args[0]), size=size)
