"""Functions of `mbody.core.lanes` in compiled code."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, TypeVar

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

from mbody.compiler.jit import inline
from mbody.core import lanes as plain
from mbody.core.callbacks import FRAME_NUMBERS, numbers_in_frame
from mbody.core.interface import FASTMATH
from mbody.core.lanes import LANES, Number, sincos

# -- Numba's type of numbers with many lanes, and the LLVM instructions of their operations ----
#
# The arithmetic of :class:`Lanes` is defined here.  The functions of `mbody.core.lanes` are plain
# Python there, each with a decorator of this module that defines its compiled version.

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False


F = TypeVar("F", bound=Callable[..., Any])


# ---------------------------------------------------------------------------------------------
# The type


class Lanes(types.Type):
    """Numba's type of ``lanes`` float64 numbers that are computed in parallel."""

    #: Whether the lanes are one number with its derivatives (`mbody.compiler.numba_duals`).
    dual = False

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        super().__init__(f"{type(self).__name__}({lanes})")

    @property
    def key(self) -> int:
        return self.lanes

    @property
    def positions(self) -> int:
        """How many positions a number is of."""
        return 1 if self.dual else self.lanes

    def can_convert_from(self, typing_context: Any, other: Any) -> Any:
        return Conversion.safe if is_plain(other) else None

    def unify(self, typing_context: Any, other: Any) -> Any:
        return self if other is self or is_plain(other) else None


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, llvm_type(kind))


def is_plain(kind: Any) -> bool:
    """Whether a type is one ordinary number."""
    return isinstance(kind, types.Float | types.Integer)


def llvm_type(kind: Any) -> Any:
    if isinstance(kind, Lanes):
        return ir.VectorType(ir.DoubleType(), kind.lanes)
    return ir.DoubleType()


def common(*kinds: Any) -> Any:
    """The type to compute in: the Lanes among the operands, or float64; None if they do not
    match.
    """
    found = {kind for kind in kinds if isinstance(kind, Lanes)}
    if len(found) > 1 or not all(isinstance(kind, Lanes) or is_plain(kind) for kind in kinds):
        return None
    return found.pop() if found else types.float64


@lower_cast(types.Float, Lanes)
@lower_cast(types.Integer, Lanes)
def _broadcast(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    """Copy one ordinary number to all lanes."""
    number = context.cast(builder, value, source, types.float64)
    vector = llvm_type(target)
    index = ir.IntType(32)
    undefined = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(index, 0))
    zeros = ir.Constant(ir.VectorType(index, target.lanes), [0] * target.lanes)
    return builder.shuffle_vector(first, undefined, zeros)


# ---------------------------------------------------------------------------------------------
# Arithmetic


def _unary(function: Any, generate: Callable[[Any, Any], Any]) -> None:
    """Define a function of one number for lanes."""

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
            kind = common(a, b)
            return signature(kind, kind, kind) if isinstance(kind, Lanes) else None

        return typer

    @lower_builtin(function, Lanes, Lanes)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(*arguments, flags=tuple(FASTMATH))


def intrinsic(name: str) -> Callable[[Any, Any], Any]:
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
_unary(np.sqrt, intrinsic("sqrt"))
_unary(np.abs, intrinsic("fabs"))
_unary(abs, intrinsic("fabs"))


# ---------------------------------------------------------------------------------------------
# Rows of arrays


def witness(lanes: int, kind: type[Lanes] = Lanes) -> Callable[[F], F]:
    """Decorator of the function without arguments that returns this many zeros."""

    def decorate(function: F) -> F:
        @type_callable(function)
        def _typer(context: Any) -> Any:
            def typer() -> Any:
                return kind(lanes)

            return typer

        @lower_builtin(function)
        def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            return ir.Constant(llvm_type(sig.return_type), None)

        return function

    return decorate


def is_rows(array: Any, row: Any, w: Any) -> bool:
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.layout == "C"
        and isinstance(row, types.Integer)
        and ((array.ndim == 2 and isinstance(w, Lanes)) or _is_column(array, w))
    )


def _is_column(array: Any, w: Any) -> bool:
    """Whether the numbers of one design: of shape (rows, 1) or (rows,)."""
    return w == types.float64 and array.ndim in (1, 2)


def row_address(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    """Address of a row, from the arguments (array, row, ...) of a load or a store."""
    kind = sig.args[-1]
    array = context.make_array(sig.args[0])(context, builder, arguments[0])
    row = context.cast(builder, arguments[1], sig.args[1], types.intp)
    if isinstance(kind, Lanes):
        row = builder.mul(row, ir.Constant(row.type, kind.lanes), flags=("nsw",))
    return builder.bitcast(builder.gep(array.data, [row]), llvm_type(kind).as_pointer())


def row_load(function: F) -> F:
    """Decorator of the load of a row: (array, row, witness)."""

    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(array: Any, row: Any, w: Any) -> Any:
            return w if is_rows(array, row, w) else None

        return typer

    @lower_builtin(function, types.Array, types.Integer, Lanes)
    @lower_builtin(function, types.Array, types.Integer, types.float64)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        value = builder.load(row_address(context, builder, sig, arguments))
        value.align = 8  # LLVM would assume the alignment of a whole row
        return value

    return function


def row_store(*, constants: bool) -> Callable[[F], F]:
    """Decorator of a store of a row: (array, row, value, witness). Without `constants` a plain
    number is left out where there are lanes.
    """

    def decorated(function: F) -> F:
        @type_callable(function)
        def _typer(context: Any) -> Any:
            def typer(array: Any, row: Any, value: Any, w: Any) -> Any:
                if not is_rows(array, row, w) or not array.mutable or common(value, w) != w:
                    return None
                left = not constants and isinstance(w, Lanes) and is_plain(value)
                return signature(types.none, array, row, types.float64 if left else w, w)

            return typer

        @lower_builtin(function, types.Array, types.Integer, Lanes, Lanes)
        @lower_builtin(function, types.Array, types.Integer, types.float64, types.float64)
        def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            store = builder.store(arguments[2], row_address(context, builder, sig, arguments))
            store.align = 8
            return context.get_dummy_value()

        @lower_builtin(function, types.Array, types.Integer, types.float64, Lanes)
        def _left_out(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            return context.get_dummy_value()

        return function

    return decorated


def lane_count(function: F) -> F:
    """Decorator of the function that returns the number of positions."""

    @type_callable(function)
    def _typer(context: Any) -> Any:
        def typer(w: Any) -> Any:
            return types.intp if common(w) is not None else None

        return typer

    @lower_builtin(function, types.Any)
    def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = sig.args[0]
        return context.get_constant(types.intp, kind.positions if isinstance(kind, Lanes) else 1)

    return function


# ---------------------------------------------------------------------------------------------
# Choices and reductions


def elementwise(operands: int, generate: Callable[..., Any]) -> Callable[[F], F]:
    """Decorator of a function of several numbers, of lanes or of float64."""

    def typed(*kinds: Any) -> Any:
        kind = common(*kinds)
        return None if kind is None else signature(kind, *[kind] * operands)

    def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return generate(builder, *arguments)

    def decorate(function: F) -> F:
        @type_callable(function)
        def _typer(context: Any) -> Any:
            if operands == 2:
                return lambda a, b: typed(a, b)
            if operands == 3:
                return lambda a, b, c: typed(a, b, c)
            return lambda a, b, x, y: typed(a, b, x, y)

        for kind in (Lanes, types.float64):
            lower_builtin(function, *[kind] * operands)(lower)
        return function

    return decorate


def extreme(relation: str) -> Callable[[Any, Any, Any], Any]:
    """Generator of the smaller or the larger of two numbers, where NaN prevails."""

    def generate(builder: Any, a: Any, b: Any) -> Any:
        # "Unordered" relations are true for NaN: this is a if either is NaN ...
        chosen = builder.select(builder.fcmp_unordered(relation, a, b), a, b)
        # ... so that only a NaN in b alone remains.
        return builder.select(builder.fcmp_unordered("uno", b, b), b, chosen)

    return generate


def select_ordered(builder: Any, a: Any, b: Any, x: Any, y: Any) -> Any:
    """Instructions of x where a <= b, else y."""
    return builder.select(builder.fcmp_ordered("<=", a, b), x, y)


def _integer_type(kind: Any) -> Any:
    """The type of 64-bit integers with as many lanes as a type of floats."""
    word = ir.IntType(64)
    return ir.VectorType(word, kind.count) if isinstance(kind, ir.VectorType) else word


def _constant(kind: Any, value: int) -> Any:
    return ir.Constant(kind, [value] * kind.count if isinstance(kind, ir.VectorType) else value)


def if_odd(builder: Any, t: Any, x: Any, y: Any) -> Any:
    """Instructions of x where the last bit of t is set, else y."""
    kind = _integer_type(t.type)
    bit = builder.and_(builder.bitcast(t, kind), _constant(kind, 1))
    return builder.select(builder.icmp_unsigned("!=", bit, _constant(kind, 0)), x, y)


def negate_if_two(builder: Any, t: Any, x: Any) -> Any:
    """Instructions of -x where the last bit but one of t is set, else x."""
    kind = _integer_type(t.type)
    bit = builder.and_(builder.bitcast(t, kind), _constant(kind, 2))
    sign = builder.shl(bit, _constant(kind, 62))
    return builder.bitcast(builder.xor(builder.bitcast(x, kind), sign), x.type)


def reduction(combine: Callable[[Any, Any, Any], Any]) -> Callable[[F], F]:
    """Decorator of a function from all lanes to one float64: halves against each other."""

    def decorate(function: F) -> F:
        @type_callable(function)
        def _typer(context: Any) -> Any:
            def typer(a: Any) -> Any:
                kind = common(a)
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

        return function

    return decorate


# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False


witness(LANES)(plain.wide)
row_load(plain.ld)
row_store(constants=True)(plain.st)
row_store(constants=False)(plain.st_varying)
lane_count(plain.count)
elementwise(4, select_ordered)(plain.select_le)
elementwise(2, extreme("<"))(plain.smaller)
elementwise(2, extreme(">"))(plain.larger)
reduction(extreme("<"))(plain.lowest)
reduction(extreme(">"))(plain.highest)


# ---------------------------------------------------------------------------------------------
# Sine and cosine

_TWO_OVER_PI = 0.6366197723675814
# pi/2 in three pieces.  The first two have 33 bits, so their multiples up to 2**20 are exact.
_HALF_PI_1 = 1.5707963267341256e00
_HALF_PI_2 = 6.0771005063039660e-11
_HALF_PI_3 = 2.0222662487959506e-21
# Added to a small number this leaves no bits for a fraction: the last bits of the sum are the
# nearest integer.  (Reordering of sums would undo it; FASTMATH does not allow that.)
_ROUND = 1.5 * 2.0**52
_FAR = 1e5


@elementwise(3, if_odd)
def _if_odd(t: Number, x: Number, y: Number) -> Number:
    """x where the last bit of t is set, else y. Not of plain numbers, like the next one: of what
    has these methods.
    """
    return t.if_odd(x, y)


@elementwise(2, negate_if_two)
def _negate_if_two(t: Number, x: Number) -> Number:
    """-x where the last bit but one of t is set, else x."""
    return t.negate_if_two(x)


@inline
def sincos_near_zero(x: Number) -> tuple[Number, Number]:
    """Sine and cosine by the polynomials of Sun's fdlibm, on the octant around the nearest k pi/2.

    The type of x decides between one number and many lanes.
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


# The C library's by name: LLVM would evaluate its own sin and cos before taking the branch.
_far_sine: Any = types.ExternalFunction("sin", signature(types.float64, types.float64))
_far_cosine: Any = types.ExternalFunction("cos", signature(types.float64, types.float64))


@overload(sincos, jit_options={"forceinline": True, "fastmath": set(FASTMATH)})
def _overload_sincos(x: Any) -> Any:
    # Numba requires that the signatures below equal that above, including the annotations.
    def lanes(x: Any) -> Any:
        return sincos_near_zero(x)

    def scalar(x: Any) -> Any:
        number = np.float64(x)
        if np.abs(number) > _FAR:
            return _far_sine(number), _far_cosine(number)
        return sincos_near_zero(number)

    if isinstance(x, Lanes):
        return None if x.dual else lanes
    return scalar if is_plain(x) else None


# -- `mbody.core.callbacks.numbers_in_frame` in compiled code --------------------------------------

# mypy: disallow-any-unimported=False, disallow-untyped-decorators=False
# mypy: disallow-untyped-calls=False


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
