"""Functions of `mbody.core.lanes`, and of NumPy, for dual numbers in compiled code."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import (
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_model,
    type_callable,
)

from mbody.compiler.jit import njit
from mbody.compiler.numba_lanes import (
    Lanes,
    common,
    intrinsic,
    is_plain,
    llvm_type,
    row_address,
    witness,
)
from mbody.core import lanes
from mbody.core import lanes as plain
from mbody.core.interface import FASTMATH
from mbody.core.lanes import chained, constant, value
from mbody.core.slopes import SLOPES

# -- Numba's type of dual numbers, and the LLVM instructions of their arithmetic ---------------
#
# A dual number has the memory of `Lanes`: sums, differences, loads and stores are theirs. What is
# different is here: products, quotients, roots, and all choices, which the values make.

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False


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
    """A dual number with another value and equal tangents."""
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
    changes = builder.fadd(scaled(builder, b, x), scaled(builder, a, y), flags=FLAGS)
    return with_first(builder, changes, builder.fmul(x, y))


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


# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False


witness(lanes.LANES, Dual)(plain.dual)
OPTIONS: Any = {"forceinline": True, "fastmath": set(FASTMATH), "error_model": "numpy"}


# ---------------------------------------------------------------------------------------------
# Choices, by the values


def _by_value(relation: str) -> Callable[..., Any]:
    """The smaller or the larger of two, where NaN prevails."""

    def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        a, b = arguments
        x, y = first(builder, a), first(builder, b)
        chosen = builder.select(builder.fcmp_unordered(relation, x, y), a, b)
        return builder.select(builder.fcmp_unordered("uno", y, y), b, chosen)

    return lower


lower_builtin(lanes.smaller, Dual, Dual)(_by_value("<"))
lower_builtin(lanes.larger, Dual, Dual)(_by_value(">"))


@lower_builtin(lanes.select_le, Dual, Dual, Dual, Dual)
def _select_le(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    a, b, x, y = arguments
    return builder.select(builder.fcmp_ordered("<=", first(builder, a), first(builder, b)), x, y)


@lower_builtin(lanes.highest, Dual)
@lower_builtin(lanes.lowest, Dual)
def _value_of(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return first(builder, arguments[0])


# ---------------------------------------------------------------------------------------------
# Values and tangents


@type_callable(value)
def _typed_value(context: Any) -> Any:
    def typer(x: Any) -> Any:
        if isinstance(x, Dual):
            return signature(types.float64, x)
        return signature(types.float64, types.float64) if is_plain(x) else None

    return typer


lower_builtin(value, Dual)(_value_of)


@lower_builtin(value, types.float64)
def _same(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return arguments[0]


def _by_type(function: Any, found: Callable[[Any], int]) -> None:
    """Define a whole number that the type of a number decides."""

    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(x: Any) -> Any:
            return types.intp if common(x) is not None else None

        return typer

    @lower_builtin(function, types.Any)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return context.get_constant(types.intp, found(sig.args[0]))


_by_type(plain.tangents, lambda kind: kind.lanes - 1 if isinstance(kind, Dual) else 0)
_by_type(plain.passes_more, lambda kind: 1 if isinstance(kind, Dual) else 0)


@type_callable(plain.tangent)
def _typed_tangent(context: Any) -> Any:
    def typer(x: Any, n: Any) -> Any:
        if not isinstance(n, types.Integer):
            return None
        if isinstance(x, Dual):
            return signature(types.float64, x, types.intp)
        return signature(types.float64, types.float64, types.intp) if is_plain(x) else None

    return typer


def _lane(builder: Any, n: Any) -> Any:
    """The lane of tangent n."""
    return builder.add(n, ir.Constant(n.type, 1))


@lower_builtin(plain.tangent, Dual, types.intp)
def _tangent(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return builder.extract_element(arguments[0], _lane(builder, arguments[1]))


@lower_builtin(plain.tangent, types.float64, types.intp)
def _no_tangent(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return ir.Constant(ir.DoubleType(), 0.0)


@type_callable(plain.with_tangent)
def _typed_with_tangent(context: Any) -> Any:
    def typer(x: Any, n: Any, change: Any) -> Any:
        if not (isinstance(n, types.Integer) and is_plain(change)):
            return None
        kind = x if isinstance(x, Dual) else types.float64
        return signature(kind, kind, types.intp, types.float64)

    return typer


@lower_builtin(plain.with_tangent, Dual, types.intp, types.float64)
def _with_tangent(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    x, n, change = arguments
    return builder.insert_element(x, change, _lane(builder, n))


@lower_builtin(plain.with_tangent, types.float64, types.intp, types.float64)
def _float_as_it_is(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return arguments[0]


@type_callable(constant)
def _typed_constant(context: Any) -> Any:
    def typer(x: Any) -> Any:
        if isinstance(x, Lanes):
            return signature(types.boolean, x)
        return signature(types.boolean, types.float64) if is_plain(x) else None

    return typer


@lower_builtin(constant, Dual)
def _is_constant(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    changes = with_first(builder, arguments[0], ir.Constant(ir.DoubleType(), 0.0))
    differ = builder.fcmp_unordered("!=", changes, ir.Constant(changes.type, None))
    bits = ir.IntType(changes.type.count)
    return builder.icmp_unsigned("==", builder.bitcast(differ, bits), ir.Constant(bits, 0))


@lower_builtin(constant, Lanes)
@lower_builtin(constant, types.float64)
def _float_is_constant(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return ir.Constant(ir.IntType(1), 1)


@type_callable(chained)
def _typed_chained(context: Any) -> Any:
    def typer(f: Any, slope: Any, x: Any) -> Any:
        if not (is_plain(f) and is_plain(slope)):
            return None
        kind = x if isinstance(x, Dual) else types.float64
        return signature(kind, types.float64, types.float64, kind)

    return typer


@lower_builtin(chained, types.float64, types.float64, Dual)
def _chained(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    f, slope, x = arguments
    zeros = ir.Constant(x.type, None)
    # what does not change leaves no trace where the slope is infinite
    still = builder.fcmp_ordered("==", x, zeros)
    return with_first(builder, builder.select(still, zeros, scaled(builder, x, slope)), f)


@lower_builtin(chained, types.float64, types.float64, types.float64)
def _unchained(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return arguments[0]


# ---------------------------------------------------------------------------------------------
# One lane at a time


@overload(plain.rounds, jit_options=OPTIONS)
def _overload_rounds(array: Any, w: Any) -> Any:
    def one(array: Any, w: Any) -> int:
        return 1

    def all_lanes(array: Any, w: Any) -> Any:
        return array.shape[1]

    return one if isinstance(w, Dual) else all_lanes


@type_callable(plain.lane_at)
def _typed_lane(context: Any) -> Any:
    def typer(n: Any, w: Any) -> Any:
        if not isinstance(n, types.Integer) or common(w) is None:
            return None
        return signature(w if isinstance(w, Dual) else types.intp, types.intp, w)

    return typer


@lower_builtin(plain.lane_at, types.intp, types.Any)
def _lane_at(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return arguments[1] if isinstance(sig.return_type, Dual) else arguments[0]


def _is_table(array: Any, row: Any, lane: Any) -> bool:
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.layout == "C"
        and array.ndim == 2
        and isinstance(row, types.Integer)
        and isinstance(lane, types.Integer | Dual)
    )


def _entry_address(context: Any, builder: Any, sig: Any, arguments: Any, lane: int) -> Any:
    """Address of an entry; argument number `lane` says which lane, or is the dual number."""
    kinds = sig.args
    if isinstance(kinds[lane], Dual):
        short = signature(types.none, kinds[0], kinds[1], kinds[lane])
        return row_address(context, builder, short, [arguments[0], arguments[1]])
    array = context.make_array(kinds[0])(context, builder, arguments[0])
    places = [arguments[1], arguments[lane]]
    return cgutils.get_item_pointer(context, builder, kinds[0], array, places)


@type_callable(plain.entry)
def _typed_entry(context: Any) -> Any:
    def typer(array: Any, row: Any, lane: Any) -> Any:
        if not _is_table(array, row, lane):
            return None
        if isinstance(lane, Dual):
            return signature(lane, array, types.intp, lane)
        return signature(types.float64, array, types.intp, types.intp)

    return typer


@lower_builtin(plain.entry, types.Array, types.intp, Dual)
@lower_builtin(plain.entry, types.Array, types.intp, types.intp)
def _entry(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    found = builder.load(_entry_address(context, builder, sig, arguments, 2))
    found.align = 8
    return found


@type_callable(plain.put_entry)
def _typed_put_entry(context: Any) -> Any:
    def typer(array: Any, row: Any, number: Any, lane: Any) -> Any:
        if not _is_table(array, row, lane) or not array.mutable:
            return None
        if isinstance(lane, Dual):
            ok = common(number, lane) == lane
            return signature(types.none, array, types.intp, lane, lane) if ok else None
        if not is_plain(number):
            return None
        return signature(types.none, array, types.intp, types.float64, types.intp)

    return typer


@lower_builtin(plain.put_entry, types.Array, types.intp, Dual, Dual)
@lower_builtin(plain.put_entry, types.Array, types.intp, types.float64, types.intp)
def _put_entry(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    store = builder.store(arguments[2], _entry_address(context, builder, sig, arguments, 3))
    store.align = 8
    return context.get_dummy_value()


# ---------------------------------------------------------------------------------------------
# Functions of NumPy


@overload(lanes.sincos, jit_options=OPTIONS)
def _overload_sincos(x: Any) -> Any:
    if not isinstance(x, Dual):
        return None

    def both(x: Any) -> Any:
        s, c = lanes.sincos(value(x))
        return chained(s, c, x), chained(c, -s, x)

    return both


def _rules(function: Any) -> Any:
    """The partial derivatives of a function, compiled."""
    return [njit(forceinline=True, cache=False)(one) for one in SLOPES[function.__name__]]


def _of_one(function: Any) -> None:
    """Define a function of one number."""
    (slope,) = _rules(function)

    @overload(function, jit_options=OPTIONS)
    def _overload(x: Any) -> Any:
        def of_dual(x: Any) -> Any:
            f = function(value(x))
            return chained(f, slope(f, value(x)), x)

        return of_dual if isinstance(x, Dual) else None


def _of_two(function: Any) -> None:
    """Define a function of two numbers."""
    first_slope, second_slope = _rules(function)

    @overload(function, jit_options=OPTIONS)
    def _overload(x: Any, y: Any) -> Any:
        def of_dual(x: Any, y: Any) -> Any:
            a, b = value(x), value(y)
            f = function(a, b)
            return chained(f, first_slope(f, a, b), x) + chained(0.0, second_slope(f, a, b), y)

        return of_dual if isinstance(common(x, y), Dual) else None


for _elementary in (
    np.sin,
    np.cos,
    np.tan,
    np.exp,
    np.log,
    np.arctan,
    np.arcsin,
    np.arccos,
):
    _of_one(_elementary)
_of_two(np.arctan2)
_of_two(np.hypot)


@overload(np.isfinite, jit_options=OPTIONS)
def _overload_isfinite(x: Any) -> Any:
    def of_dual(x: Any) -> Any:
        return np.isfinite(value(x))

    return of_dual if isinstance(x, Dual) else None


@overload(np.power, jit_options=OPTIONS)
def _overload_power(x: Any, p: Any) -> Any:
    if not isinstance(common(x, p), Dual):
        return None

    def of_dual(x: Any, p: Any) -> Any:
        a, b = value(x), value(p)
        f = np.power(a, b)
        # a factor of zero counts, also where the other is infinite
        found = chained(f, b * np.power(a, b - 1.0) if b != 0.0 else 0.0, x)
        if not constant(p) and f != 0.0:
            found = found + chained(0.0, f * np.log(a), p)
        return found

    return of_dual
