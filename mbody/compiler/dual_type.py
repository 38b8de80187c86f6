"""Numba's type of dual numbers, and the LLVM instructions of their arithmetic.

A dual number has the memory of `Lanes`: sums, differences, loads and stores are theirs. What is
different is here: products, quotients, roots, and all choices, which the values make.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import signature
from numba.extending import lower_builtin, lower_cast, models, register_model, type_callable

from mbody.compiler.lanes_type import Lanes, common, intrinsic, llvm_type
from mbody.core.interface import FASTMATH

FLAGS = tuple(FASTMATH)
INDEX = ir.IntType(32)


class Dual(Lanes):
    """Numba's type of a number and its derivatives by ``lanes`` − 1 parameters."""

    dual = True


@register_model(Dual)
class _DualModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Dual) -> None:
        super().__init__(manager, kind, llvm_type(kind))


def first(builder: Any, x: Any) -> Any:
    """The value."""
    return builder.extract_element(x, ir.Constant(INDEX, 0))


def with_first(builder: Any, x: Any, value: Any) -> Any:
    """The same tangents with another value."""
    return builder.insert_element(x, value, ir.Constant(INDEX, 0))


def all_lanes(builder: Any, number: Any, like: Any) -> Any:
    """One float64 in every lane."""
    undefined = ir.Constant(like.type, ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(INDEX, 0))
    zeros = ir.Constant(ir.VectorType(INDEX, like.type.count), [0] * like.type.count)
    return builder.shuffle_vector(one, undefined, zeros)


def scaled(builder: Any, x: Any, factor: Any) -> Any:
    """A dual number times a float64."""
    return builder.fmul(x, all_lanes(builder, factor, x), flags=FLAGS)


@lower_cast(types.Float, Dual)
@lower_cast(types.Integer, Dual)
def _constant(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    number = context.cast(builder, value, source, types.float64)
    return with_first(builder, ir.Constant(llvm_type(target), None), number)


def _product(builder: Any, a: Any, b: Any) -> Any:
    x, y = first(builder, a), first(builder, b)
    changes = with_first(builder, a, ir.Constant(ir.DoubleType(), 0.0))
    left = scaled(builder, b, x)
    return builder.fadd(left, scaled(builder, changes, y), flags=FLAGS)


def _quotient(builder: Any, a: Any, b: Any) -> Any:
    x, y = first(builder, a), first(builder, b)
    q = builder.fdiv(x, y)
    inverse = builder.fdiv(ir.Constant(ir.DoubleType(), 1.0), y)
    change = builder.fsub(a, scaled(builder, b, q), flags=FLAGS)
    return with_first(builder, scaled(builder, change, inverse), q)


def _root(builder: Any, a: Any) -> Any:
    root = intrinsic("sqrt")(builder, first(builder, a))
    slope = builder.fdiv(ir.Constant(ir.DoubleType(), 0.5), root)
    # what does not change leaves no trace where the slope is infinite
    zeros = ir.Constant(a.type, None)
    still = builder.fcmp_ordered("==", a, zeros)
    return with_first(builder, builder.select(still, zeros, scaled(builder, a, slope)), root)


def _size(builder: Any, a: Any) -> Any:
    zero = ir.Constant(ir.DoubleType(), 0.0)
    negative = builder.fcmp_ordered("<", first(builder, a), zero)
    return builder.select(negative, builder.fneg(a), a)


def _generated(function: Any, operands: int, generate: Any) -> None:
    """Define a function of dual numbers."""

    @lower_builtin(function, *[Dual] * operands)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return generate(builder, *arguments)


_generated(operator.mul, 2, _product)
_generated(operator.imul, 2, _product)
_generated(operator.truediv, 2, _quotient)
_generated(operator.itruediv, 2, _quotient)
_generated(np.sqrt, 1, _root)
_generated(np.abs, 1, _size)
_generated(abs, 1, _size)


def _compared(function: Any, relation: str) -> None:
    """Define a comparison by the values."""
    compare = "fcmp_unordered" if relation == "!=" else "fcmp_ordered"

    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(a: Any, b: Any) -> Any:
            kind = common(a, b)
            return signature(types.boolean, kind, kind) if isinstance(kind, Dual) else None

        return typer

    @lower_builtin(function, Dual, Dual)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return getattr(builder, compare)(relation, *(first(builder, x) for x in arguments))


for _function, _relation in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _compared(_function, _relation)
