"""Numbers with many lanes (SIMD): one physics source for one design or for ``LANES`` at a time.

The physics is written once, for numbers.  Compiled for float64 it works on one design (or one
position); compiled for ``Lanes(n)`` the same source works on n of them in parallel: each operation
is one LLVM operation on ``<n x double>``.  Loops over lanes that the compiler vectorises by itself
are two to five times slower.

Kernels keep their numbers in 2-D float64 C-contiguous arrays of shape ``(rows, lanes)``: a row is
one quantity.  A *witness* ``w``, any number of the type to work with, decides how a row is read:
``0.0`` in a scalar kernel (arrays of one column), :func:`wide` in a wide one (``LANES`` columns)::

    x = ld(W, row, w)
    s, c = sincos(x)
    st(W, row + 1, select_le(c, 0.0, s, x * s), w)

Rows and columns are not checked.  Numbers with many lanes exist inside compiled code only.  They
can be added, subtracted, multiplied and divided among themselves and with ordinary numbers, and
``np.sqrt`` and ``np.abs`` accept them.  They cannot be compared in an ``if``, which has one outcome
for all lanes.

Every function here is also a plain Python function that does the same to NumPy rows of any
length, of floats or of complex numbers, so that with ``NUMBA_DISABLE_JIT=1`` whole kernels run on
either (complex steps give derivatives).  There a row is an array, and ``a += b`` would change it
in place under every name: sources for both write ``a = a + b``.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.core.typing.templates import signature
from numba.extending import overload

from mbody.compiler.jit import FASTMATH, PLAIN, inline
from mbody.compiler.lanes_type import (
    Lanes,
    elementwise,
    extreme,
    if_odd,
    is_plain,
    lane_count,
    negate_if_two,
    reduction,
    row_load,
    row_store,
    select_ordered,
    witness,
)

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
    "st_varying",
    "wide",
]

#: Lanes of a wide kernel, measured best on a four-bar: with 32 lanes of 8 bytes the compiler runs
#: out of registers; with fewer lanes the arithmetic units wait for each other.
LANES = 16

#: float, complex, or a row of either; in compiled code float64 or Lanes.
Number = Any


# ---------------------------------------------------------------------------------------------
# The functions in plain Python.  Their decorators define the compiled versions.


def aligned(rows: int, lanes: int) -> np.ndarray:
    """Zeros of shape (rows, lanes), float64, C-contiguous, beginning on a 64-byte boundary.

    Rows of 8 lanes or more then fill whole cache lines, which saves up to a third of the time.
    """
    size = rows * lanes * 8
    memory = np.zeros(size + 64, dtype=np.uint8)
    start = -memory.__array_interface__["data"][0] % 64
    return memory[start : start + size].view(np.float64).reshape(rows, lanes)


@witness(LANES)
def wide() -> Number:
    """The witness of ``LANES`` lanes: zeros."""
    return np.zeros(LANES)


@row_load
def ld(array: np.ndarray, row: int, w: Number) -> Number:
    """Row of an array of shape (rows, lanes), as a number of the type of the witness ``w``.

    For ``w = 0.0`` the array may have the shape (rows,) as well.
    """
    if array.ndim == 1:
        return array[row]
    return array[row, 0] if array.shape[1] == 1 else array[row].copy()


@row_store(constants=True)
def st(array: np.ndarray, row: int, value: Number, w: Number) -> None:
    """Set a row of an array, shaped as for `ld`, to a value, which may be a plain constant."""
    array[row] = value


@row_store(constants=False)
def st_varying(array: np.ndarray, row: int, value: Number, w: Number) -> None:
    """As `st`, but with many lanes a value that is a constant in the source is not stored: the row
    must contain it already. Stores are the slowest part of wide kernels.
    """
    if array.shape[1] == 1 or np.ndim(value):
        array[row] = value


@lane_count
def count(w: Number) -> int:
    """Number of lanes of a number; a constant to the compiler."""
    return int(np.size(w))


def _where(condition: Any, x: Number, y: Number) -> Number:
    found: np.ndarray = np.asarray(np.where(condition, x, y))
    return found if found.ndim else found.item()


@elementwise(4, select_ordered)
def select_le(a: Number, b: Number, x: Number, y: Number) -> Number:
    """Lane by lane, x where a <= b, else y (also where a or b is NaN).  Both are evaluated."""
    return _where(np.real(a) <= np.real(b), x, y)


@elementwise(2, extreme("<"))
def smaller(a: Number, b: Number) -> Number:
    """Lane by lane the smaller of two; NaN where either is NaN."""
    return _where(np.isnan(a) | (np.real(a) < np.real(b)), a, b)


@elementwise(2, extreme(">"))
def larger(a: Number, b: Number) -> Number:
    """Lane by lane the larger of two; NaN where either is NaN."""
    return _where(np.isnan(a) | (np.real(a) > np.real(b)), a, b)


@reduction(extreme("<"))
def lowest(a: Number) -> float:
    """The least of all lanes as one float; NaN if any lane is NaN."""
    return float(np.min(np.real(a)))


@reduction(extreme(">"))
def highest(a: Number) -> float:
    """The greatest of all lanes as one float; NaN if any lane is NaN."""
    return float(np.max(np.real(a)))


def sincos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine of an angle in rad.

    Compiled: off by less than 2e-16 for |x| <= 1e5.  Beyond that a float64 goes to ``np.sin`` and
    ``np.cos``; lanes are accurate to 1e6 and lose digits beyond.  NaN and infinities return NaN.
    """
    return np.sin(x), np.cos(x)


# ---------------------------------------------------------------------------------------------
# Sine and cosine, compiled

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
    """x where the last bit of t is set, else y.  Compiled code only, like the next one."""
    raise NotImplementedError


@elementwise(2, negate_if_two)
def _negate_if_two(t: Number, x: Number) -> Number:
    """-x where the last bit but one of t is set, else x."""
    raise NotImplementedError


@inline
def _sincos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine by the polynomials of Sun's fdlibm, on the octant around the nearest k pi/2.

    Compiled only: the type of x decides between one number and many lanes.
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
    # The C library's by name: LLVM would evaluate its own sin and cos before taking the branch.
    _far_sine: Any = types.ExternalFunction("sin", signature(types.float64, types.float64))
    _far_cosine: Any = types.ExternalFunction("cos", signature(types.float64, types.float64))

    @overload(sincos, jit_options={"forceinline": True, "fastmath": set(FASTMATH)})
    def _overload_sincos(x: Any) -> Any:
        # Numba requires that the signatures below equal that above, including the annotations.
        def lanes(x: Any) -> Any:
            return _sincos(x)

        def scalar(x: Any) -> Any:
            number = np.float64(x)
            if np.abs(number) > _FAR:
                return _far_sine(number), _far_cosine(number)
            return _sincos(number)

        if isinstance(x, Lanes):
            return lanes
        return scalar if is_plain(x) else None
