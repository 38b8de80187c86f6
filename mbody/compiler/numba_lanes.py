"""What the functions of `mbody.core.lanes` are in compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import lower_builtin, overload, type_callable

from mbody.compiler.jit import inline
from mbody.compiler.lanes_type import (
    Lanes,
    elementwise,
    extreme,
    if_odd,
    is_plain,
    lane_count,
    llvm_type,
    negate_if_two,
    reduction,
    row_load,
    row_store,
    select_ordered,
    witness,
)
from mbody.core import lanes as plain
from mbody.core.interface import FASTMATH
from mbody.core.lanes import LANES, Number, sincos
from mbody.core.stack import FRAME_NUMBERS, numbers_in_frame

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


# -- `mbody.core.stack.numbers_in_frame` in compiled code --------------------------------------

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
