"""Numbers of many lanes: one physics source for one design or for ``LANES`` of them at a time.

The physics is written once, for numbers.  Compiled for float64 it works on one design (or one
position); compiled for ``Lanes(n)`` the same source works on n of them in step, each operation
being one of LLVM's on ``<n x double>``.  Loops over lanes that the compiler is left to vectorise
itself are two to five times slower.

Kernels keep their numbers in 2-D float64 C-contiguous arrays of shape ``(rows, lanes)``: a row is
one quantity.  A *witness* ``w``, any number of the type to work with, tells how a row is read:
``0.0`` in a scalar kernel (arrays of one column), :func:`wide` in a wide one (``LANES`` columns)::

    x = ld(W, row, w)
    s, c = sincos(x)
    st(W, row + 1, select_le(c, 0.0, s, x * s), w)

Nothing checks rows or columns.  Numbers of many lanes live inside compiled code only; they are
added, subtracted, multiplied and divided among themselves and with ordinary numbers, and taken by
``np.sqrt`` and ``np.abs``.  They cannot be compared in an ``if``, which has one outcome for all.

Every function here is also a plain Python function that does the same to NumPy rows of any
length, of floats or of complex numbers, so that with ``NUMBA_DISABLE_JIT=1`` whole kernels run on
either (complex steps give derivatives).  A row is there an array: ``a += b`` would change every
name of it, so sources for both write ``a = a + b``.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import signature
from numba.extending import (
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_model,
    type_callable,
)

from ._jit import FASTMATH, PLAIN, inline

__all__ = [
    "LANES",
    "Lanes",
    "aligned",
    "count",
    "highest",
    "larger",
    "ld",
    "lowest",
    "select_le",
    "sincos",
    "smaller",
    "st",
    "wide",
]

#: Lanes of a wide kernel.  More do not pay: the workspace of a small mechanism leaves the
#: first-level cache; fewer leave the arithmetic units waiting for each other.
LANES = 16

#: float, complex, or a row of either; in compiled code float64 or Lanes.
Number = Any


# ---------------------------------------------------------------------------------------------
# The functions as plain Python sees them.  Their compiled meaning is given further below.


def aligned(rows: int, lanes: int) -> np.ndarray:
    """Zeros of shape (rows, lanes), float64, C-contiguous, beginning on a 64-byte boundary.

    Rows of 8 lanes or more then fill whole cache lines, which saves up to a third of the time.
    """
    size = rows * lanes * 8
    memory = np.zeros(size + 64, dtype=np.uint8)
    start = -memory.ctypes.data % 64
    return memory[start : start + size].view(np.float64).reshape(rows, lanes)


def wide() -> Number:
    """The witness of ``LANES`` lanes: zeros."""
    return np.zeros(LANES)


def ld(array: np.ndarray, row: int, w: Number) -> Number:
    """Row of an array of shape (rows, lanes), as a number of the type of the witness ``w``."""
    return array[row].copy()


def st(array: np.ndarray, row: int, value: Number, w: Number) -> None:
    """Set a row of an array of shape (rows, lanes) to a value, which may be a plain constant."""
    array[row] = value


def count(w: Number) -> int:
    """Number of lanes of a number; a constant to the compiler."""
    return int(np.size(w))


def _chosen(condition: Any, x: Number, y: Number) -> Number:
    found: np.ndarray = np.asarray(np.where(condition, x, y))
    return found if found.ndim else found.item()


def select_le(a: Number, b: Number, x: Number, y: Number) -> Number:
    """Lane by lane, x where a <= b, else y: a NaN in a or b gives y.  Both are evaluated."""
    return _chosen(np.real(a) <= np.real(b), x, y)


def smaller(a: Number, b: Number) -> Number:
    """Lane by lane the smaller of two; NaN where either is NaN."""
    return _chosen(np.isnan(a) | (np.real(a) < np.real(b)), a, b)


def larger(a: Number, b: Number) -> Number:
    """Lane by lane the larger of two; NaN where either is NaN."""
    return _chosen(np.isnan(a) | (np.real(a) > np.real(b)), a, b)


def lowest(a: Number) -> float:
    """The least of all lanes as one float; NaN if any lane is NaN."""
    return float(np.min(np.real(a)))


def highest(a: Number) -> float:
    """The greatest of all lanes as one float; NaN if any lane is NaN."""
    return float(np.max(np.real(a)))


def sincos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine of an angle in rad.

    Compiled: off by less than 2e-16 for |x| <= 1e5.  Beyond that a float64 goes to ``np.sin`` and
    ``np.cos``; lanes stay good to 1e6 and lose figures further on.  NaN and infinities give NaN.
    """
    return np.sin(x), np.cos(x)


# ---------------------------------------------------------------------------------------------
# The type


class Lanes(types.Type):
    """Numba's type of ``lanes`` float64 numbers that go through a computation in step."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        super().__init__(f"Lanes({lanes})")

    @property
    def key(self) -> int:
        return self.lanes

    def can_convert_from(self, typing_context: Any, other: Any) -> Any:
        return Conversion.safe if _is_plain(other) else None

    def unify(self, typing_context: Any, other: Any) -> Any:
        return self if other is self or _is_plain(other) else None


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _llvm_type(kind))


def _is_plain(kind: Any) -> bool:
    return isinstance(kind, types.Float | types.Integer)


def _llvm_type(kind: Any) -> Any:
    if isinstance(kind, Lanes):
        return ir.VectorType(ir.DoubleType(), kind.lanes)
    return ir.DoubleType()


def _common(*kinds: Any) -> Any:
    """The type to compute in: the Lanes among the operands, or float64; None if they misfit."""
    found = {kind for kind in kinds if isinstance(kind, Lanes)}
    if len(found) > 1 or not all(isinstance(kind, Lanes) or _is_plain(kind) for kind in kinds):
        return None
    return found.pop() if found else types.float64


@lower_cast(types.Float, Lanes)
@lower_cast(types.Integer, Lanes)
def _spread(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    """One ordinary number to all lanes."""
    number = context.cast(builder, value, source, types.float64)
    vector = _llvm_type(target)
    index = ir.IntType(32)
    undefined = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(index, 0))
    zeros = ir.Constant(ir.VectorType(index, target.lanes), [0] * target.lanes)
    return builder.shuffle_vector(first, undefined, zeros)


# ---------------------------------------------------------------------------------------------
# Arithmetic


def _unary(function: Any, generate: Callable[[Any, Any], Any]) -> None:
    """Give a function of one number its meaning for lanes."""

    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(x: Any) -> Any:
            return x if isinstance(x, Lanes) else None

        return typer

    @lower_builtin(function, Lanes)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return generate(builder, arguments[0])


def _binary(function: Any, instruction: str) -> None:
    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(a: Any, b: Any) -> Any:
            kind = _common(a, b)
            return signature(kind, kind, kind) if isinstance(kind, Lanes) else None

        return typer

    @lower_builtin(function, Lanes, Lanes)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(*arguments, flags=tuple(FASTMATH))


def _intrinsic(name: str) -> Callable[[Any, Any], Any]:
    """Generator of a call of LLVM's function ``llvm.<name>`` of one number."""

    def generate(builder: Any, x: Any) -> Any:
        lanes = f"v{x.type.count}" if isinstance(x.type, ir.VectorType) else ""
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(x.type, [x.type]), f"llvm.{name}.{lanes}f64"
        )
        return builder.call(function, [x])

    return generate


for _function, _instruction in (
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.isub, "fsub"),
    (operator.mul, "fmul"),
    (operator.imul, "fmul"),
    (operator.truediv, "fdiv"),
    (operator.itruediv, "fdiv"),
):
    _binary(_function, _instruction)

_unary(operator.neg, lambda builder, x: builder.fneg(x))
_unary(np.sqrt, _intrinsic("sqrt"))
_unary(np.abs, _intrinsic("fabs"))
_unary(abs, _intrinsic("fabs"))


# ---------------------------------------------------------------------------------------------
# Rows of arrays, and choices


@type_callable(wide)
def _type_wide(context: Any) -> Any:
    def typer() -> Any:
        return Lanes(LANES)

    return typer


@lower_builtin(wide)
def _lower_wide(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return ir.Constant(_llvm_type(sig.return_type), None)


def _is_rows(array: Any, row: Any, w: Any) -> bool:
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.ndim == 2
        and array.layout == "C"
        and isinstance(row, types.Integer)
        and (isinstance(w, Lanes) or w == types.float64)
    )


@type_callable(ld)
def _type_ld(context: Any) -> Any:
    def typer(array: Any, row: Any, w: Any) -> Any:
        return w if _is_rows(array, row, w) else None

    return typer


@type_callable(st)
def _type_st(context: Any) -> Any:
    def typer(array: Any, row: Any, value: Any, w: Any) -> Any:
        if not _is_rows(array, row, w) or not array.mutable or _common(value, w) != w:
            return None
        return signature(types.none, array, row, w, w)

    return typer


def _address(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    """Address of a row, from the arguments (array, row, ...) of ld and st."""
    kind = sig.args[-1]
    array = context.make_array(sig.args[0])(context, builder, arguments[0])
    row = context.cast(builder, arguments[1], sig.args[1], types.intp)
    if isinstance(kind, Lanes):
        row = builder.mul(row, ir.Constant(row.type, kind.lanes), flags=("nsw",))
    return builder.bitcast(builder.gep(array.data, [row]), _llvm_type(kind).as_pointer())


@lower_builtin(ld, types.Array, types.Integer, Lanes)
@lower_builtin(ld, types.Array, types.Integer, types.float64)
def _lower_ld(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    value = builder.load(_address(context, builder, sig, arguments))
    value.align = 8  # LLVM would take for granted the alignment of a whole row
    return value


@lower_builtin(st, types.Array, types.Integer, Lanes, Lanes)
@lower_builtin(st, types.Array, types.Integer, types.float64, types.float64)
def _lower_st(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    store = builder.store(arguments[2], _address(context, builder, sig, arguments))
    store.align = 8
    return context.get_dummy_value()


@type_callable(count)
def _type_count(context: Any) -> Any:
    def typer(w: Any) -> Any:
        return types.intp if _common(w) is not None else None

    return typer


@lower_builtin(count, types.Any)
def _lower_count(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    lanes = sig.args[0].lanes if isinstance(sig.args[0], Lanes) else 1
    return context.get_constant(types.intp, lanes)


def _elementwise(function: Any, operands: int, generate: Callable[..., Any]) -> None:
    """Give a function of several numbers its meaning for lanes and for float64."""

    def typed(*kinds: Any) -> Any:
        kind = _common(*kinds)
        return None if kind is None else signature(kind, *[kind] * operands)

    @type_callable(function)
    def _typer(context: Any) -> Any:
        if operands == 2:
            return lambda a, b: typed(a, b)
        if operands == 3:
            return lambda a, b, c: typed(a, b, c)
        return lambda a, b, x, y: typed(a, b, x, y)

    def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return generate(builder, *arguments)

    for kind in (Lanes, types.float64):
        lower_builtin(function, *[kind] * operands)(lower)


def _extreme(relation: str) -> Callable[[Any, Any, Any], Any]:
    """Generator of the smaller or the larger of two numbers, where NaN prevails."""

    def generate(builder: Any, a: Any, b: Any) -> Any:
        # "Unordered" relations hold for NaN: this gives a if either is NaN ...
        chosen = builder.select(builder.fcmp_unordered(relation, a, b), a, b)
        # ... so that only a NaN in b alone is left to see to.
        return builder.select(builder.fcmp_unordered("uno", b, b), b, chosen)

    return generate


def _select_le(builder: Any, a: Any, b: Any, x: Any, y: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<=", a, b), x, y)


_elementwise(select_le, 4, _select_le)
_elementwise(smaller, 2, _extreme("<"))
_elementwise(larger, 2, _extreme(">"))


def _reduction(function: Any, combine: Callable[[Any, Any, Any], Any]) -> None:
    """Give a function from all lanes to one float64 its meaning: halves against each other."""

    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(a: Any) -> Any:
            kind = _common(a)
            return None if kind is None else signature(types.float64, kind)

        return typer

    @lower_builtin(function, Lanes)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        value = arguments[0]
        index = ir.IntType(32)
        parts = [value]
        lanes = sig.args[0].lanes
        while lanes > 1 and lanes % 2 == 0:
            lanes //= 2
            kind = ir.VectorType(index, lanes)
            low = ir.Constant(kind, list(range(lanes)))
            high = ir.Constant(kind, list(range(lanes, 2 * lanes)))
            undefined = ir.Constant(value.type, ir.Undefined)
            parts = [builder.shuffle_vector(value, undefined, half) for half in (low, high)]
            value = combine(builder, *parts)
        result = builder.extract_element(value, ir.Constant(index, 0))
        for lane in range(1, lanes):  # of an odd number of lanes
            other = builder.extract_element(value, ir.Constant(index, lane))
            result = combine(builder, result, other)
        return result

    @lower_builtin(function, types.float64)
    def _lower_one(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return arguments[0]


_reduction(lowest, _extreme("<"))
_reduction(highest, _extreme(">"))


# ---------------------------------------------------------------------------------------------
# Sine and cosine

_TWO_OVER_PI = 0.6366197723675814
# pi/2 in three pieces.  The first two have 33 bits, so their multiples up to 2**20 are exact.
_HALF_PI_1 = 1.5707963267341256e00
_HALF_PI_2 = 6.0771005063039660e-11
_HALF_PI_3 = 2.0222662487959506e-21
# Added to a small number this leaves no room for a fraction: the sum's last bits are the nearest
# whole number.  (Freedom to reorder sums would undo it; FASTMATH does not give it.)
_ROUND = 1.5 * 2.0**52
_FAR = 1e5


def _if_odd(t: Number, x: Number, y: Number) -> Number:
    """x where the last bit of t is set, else y.  Compiled code only, like the next one."""
    raise NotImplementedError


def _negate_if_two(t: Number, x: Number) -> Number:
    """-x where the last bit but one of t is set, else x."""
    raise NotImplementedError


def _whole(kind: Any) -> Any:
    """The type of 64-bit integers with as many lanes as a type of floats."""
    word = ir.IntType(64)
    return ir.VectorType(word, kind.count) if isinstance(kind, ir.VectorType) else word


def _constant(kind: Any, value: int) -> Any:
    return ir.Constant(kind, [value] * kind.count if isinstance(kind, ir.VectorType) else value)


def _lower_if_odd(builder: Any, t: Any, x: Any, y: Any) -> Any:
    kind = _whole(t.type)
    bit = builder.and_(builder.bitcast(t, kind), _constant(kind, 1))
    return builder.select(builder.icmp_unsigned("!=", bit, _constant(kind, 0)), x, y)


def _lower_negate_if_two(builder: Any, t: Any, x: Any) -> Any:
    kind = _whole(t.type)
    bit = builder.and_(builder.bitcast(t, kind), _constant(kind, 2))
    sign = builder.shl(bit, _constant(kind, 62))
    return builder.bitcast(builder.xor(builder.bitcast(x, kind), sign), x.type)


_elementwise(_if_odd, 3, _lower_if_odd)
_elementwise(_negate_if_two, 2, _lower_negate_if_two)


@inline
def _sincos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine by the polynomials of Sun's fdlibm, on the octant around the nearest k pi/2.

    Compiled only: the type of x says whether this is one number or many lanes.
    """
    t = x * _TWO_OVER_PI + _ROUND
    k = t - _ROUND
    r = ((x - k * _HALF_PI_1) - k * _HALF_PI_2) - k * _HALF_PI_3
    z = r * r
    s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    s = 2.75573137070700676789e-06 + z * s
    s = -1.98412698298579493134e-04 + z * s
    s = 8.33333333332248946124e-03 + z * s
    s = -1.66666666666666324348e-01 + z * s
    s = r + (r * z) * s
    c = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    c = -2.75573143513906633035e-07 + z * c
    c = 2.48015872894767294178e-05 + z * c
    c = -1.38888888888741095749e-03 + z * c
    c = 4.16666666666666019037e-02 + z * c
    c = 1.0 - (0.5 * z - (z * z) * c)
    # Each quarter turn makes a cosine of the sine, and a negative sine of the cosine.
    sine = _negate_if_two(t, _if_odd(t, c, s))
    cosine = _negate_if_two(t + 1.0, _if_odd(t, s, c))
    return sine, cosine


if not PLAIN:
    # The C library's by name: LLVM would compute its own sin and cos before asking for the branch.
    _far_sine: Any = types.ExternalFunction("sin", signature(types.float64, types.float64))
    _far_cosine: Any = types.ExternalFunction("cos", signature(types.float64, types.float64))

    @overload(sincos, jit_options={"forceinline": True, "fastmath": set(FASTMATH)})
    def _overload_sincos(x: Any) -> Any:
        # Numba wants the signatures below equal to that above, annotations and all.
        def lanes(x: Any) -> Any:
            return _sincos(x)

        def scalar(x: Any) -> Any:
            number = np.float64(x)
            if np.abs(number) > _FAR:
                return _far_sine(number), _far_cosine(number)
            return _sincos(number)

        if isinstance(x, Lanes):
            return lanes
        return scalar if _is_plain(x) else None
