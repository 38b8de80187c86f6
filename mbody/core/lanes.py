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
in place under every name: sources for both write ``a = a + b``.  Recorded numbers
(`mbody.core.recorded_numbers`) stand in arrays of objects of one column; straight-line code is
made of what kernels do with them.  What a compiler makes of these functions is in
`mbody.compiler.numba_lanes`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber, value
from mbody.core.recorded_numbers import Traced, Untraceable, apply

#: Lanes of a wide kernel, measured best on a four-bar: with 32 lanes of 8 bytes the compiler runs
#: out of registers; with fewer lanes the arithmetic units wait for each other.
LANES = 16

#: float, complex, or a row of either; in compiled code float64 or Lanes.
Number = Any


def aligned(rows: int, lanes: int) -> np.ndarray:
    """Zeros of shape (rows, lanes), float64, C-contiguous, beginning on a 64-byte boundary.

    Rows of 8 lanes or more then fill whole cache lines, which saves up to a third of the time.
    """
    size = rows * lanes * 8
    memory = np.zeros(size + 64, dtype=np.uint8)
    start = -memory.__array_interface__["data"][0] % 64
    return memory[start : start + size].view(np.float64).reshape(rows, lanes)


def wide() -> Number:
    """The witness of ``LANES`` lanes: zeros."""
    return np.zeros(LANES)


def ld(array: np.ndarray, row: int, w: Number) -> Number:
    """Row of an array of shape (rows, lanes), as a number of the type of the witness ``w``.

    For ``w = 0.0`` the array may have the shape (rows,) as well.
    """
    if array.ndim == 1:
        return array[row]
    if isinstance(w, DualNumber):
        return DualNumber(float(array[row, 0]), array[row, 1:].copy())
    return array[row, 0] if array.shape[1] == 1 else array[row].copy()


def st(array: np.ndarray, row: int, number: Number, w: Number) -> None:
    """Set a row of an array, shaped as for `ld`, to a number, which may be a plain constant."""
    if isinstance(w, DualNumber):
        array[row, 0] = value(number)
        array[row, 1:] = number.tangents if isinstance(number, DualNumber) else 0.0
    else:
        array[row] = number


def st_varying(array: np.ndarray, row: int, number: Number, w: Number) -> None:
    """Store of a number, as `st`; with many lanes a number that is a constant in the source is not
    stored: the row must contain it already. Stores are the slowest part of wide kernels.
    """
    if array.shape[1] == 1 or np.ndim(number) or isinstance(number, DualNumber):
        st(array, row, number, w)


def count(w: Number) -> int:
    """Number of positions that a number is of: its lanes, one of a float or a dual number; a
    constant to the compiler.
    """
    return 1 if isinstance(w, DualNumber) else int(np.size(w))


def _any_dual(*numbers: Number) -> bool:
    return any(isinstance(number, DualNumber) for number in numbers)


def _where(condition: Any, x: Number, y: Number) -> Number:
    found: np.ndarray = np.asarray(np.where(condition, x, y))
    return found if found.ndim else found.item()


def _any_traced(*numbers: Number) -> bool:
    return any(isinstance(number, Traced) for number in numbers)


def _no_traced(number: Number) -> None:
    if _any_traced(number):
        raise Untraceable("what all lanes do depends on their numbers")


def select_le(a: Number, b: Number, x: Number, y: Number) -> Number:
    """Lane by lane, x where a <= b, else y (also where a or b is NaN).  Both are evaluated."""
    if _any_traced(a, b, x, y):
        return apply("select_le", (a, b, x, y))
    if _any_dual(a, b, x, y):
        return x if value(a) <= value(b) else y
    return _where(np.real(a) <= np.real(b), x, y)


def smaller(a: Number, b: Number) -> Number:
    """Lane by lane the smaller of two, the second of equal ones; NaN where either is NaN."""
    if _any_traced(a, b):
        return apply("minimum", (a, b))
    if _any_dual(a, b):
        return a if np.isnan(value(a)) or value(a) < value(b) else b
    return _where(np.isnan(a) | (np.real(a) < np.real(b)), a, b)


def larger(a: Number, b: Number) -> Number:
    """Lane by lane the larger of two, the second of equal ones; NaN where either is NaN."""
    if _any_traced(a, b):
        return apply("maximum", (a, b))
    if _any_dual(a, b):
        return a if np.isnan(value(a)) or value(a) > value(b) else b
    return _where(np.isnan(a) | (np.real(a) > np.real(b)), a, b)


def lowest(a: Number) -> float:
    """The least of all lanes as one float; NaN if any lane is NaN."""
    _no_traced(a)
    return float(np.min(np.real(value(a))))


def highest(a: Number) -> float:
    """The greatest of all lanes as one float; NaN if any lane is NaN."""
    _no_traced(a)
    return float(np.max(np.real(value(a))))


def sincos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine of an angle in rad.

    Compiled: off by less than 2e-16 for |x| <= 1e5.  Beyond that a float64 goes to ``np.sin`` and
    ``np.cos``; lanes are accurate to 1e6 and lose digits beyond.  NaN and infinities return NaN.
    """
    return np.sin(x), np.cos(x)
