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

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from mbody.core.recorded_numbers import Traced, Untraceable, apply
from mbody.core.slopes import SLOPES, slope

# -- Dual numbers in plain Python: a number, or an array of them, with derivatives by parameters


class DualNumber(NDArrayOperatorsMixin):
    """A number, or an array of them, with derivatives by parameters. tangents (…, parameters).

    Examples
    --------
    >>> x = DualNumber(2.0, [1.0, 0.0])
    >>> (x * x + np.sin(x)).tangents.round(6).tolist()
    [3.583853, 0.0]
    """

    __slots__ = ("tangents", "value")

    def __init__(self, value: Any, tangents: Any) -> None:
        self.value, self.tangents = value, np.asarray(tangents, dtype=np.float64)

    def __repr__(self) -> str:
        return f"DualNumber({self.value!r}, {self.tangents!r})"

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the value."""
        return np.shape(self.value)

    @property
    def ndim(self) -> int:
        """Axes of the value."""
        return np.ndim(self.value)

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, place: Any) -> DualNumber:
        return DualNumber(self.value[place], self.tangents[place])

    def __float__(self) -> float:
        raise TypeError("float() of a dual number would lose its derivatives")

    def __bool__(self) -> bool:
        return bool(self.value)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method == "reduce" and ufunc.__name__ in _ABOUT:  # `numpy.any` and `numpy.all`
            return ufunc.reduce(value(inputs[0]), **options)
        # `a += b` gives a new number under the name of a
        if method != "__call__" or options.pop("out", (self,))[0] is not self or options:
            return NotImplemented
        return _applied(ufunc, inputs)


#: Where functions were evaluated that have no derivative there, as |x| at 0: names of functions.
_corners: ContextVar[set[str] | None] = ContextVar("corners", default=None)


@contextmanager
def corners() -> Iterator[set[str]]:
    """Collect the names of functions that were evaluated where they have no derivative.

    >>> with corners() as found:
    ...     x = np.abs(DualNumber(0.0, [1.0]))
    >>> found
    {'absolute'}
    """
    found: set[str] = set()
    token = _corners.set(found)
    try:
        yield found
    finally:
        _corners.reset(token)


def _at_corner(name: str, values: list[Any], inputs: tuple[Any, ...]) -> bool:
    """Whether a function is evaluated where it has no derivative, of numbers that change."""
    if name in ("absolute", "fabs", "sign", "sqrt"):
        at = np.equal(values[0], 0.0)
    elif name == "hypot":
        at = np.equal(values[0], 0.0) & np.equal(values[1], 0.0)
    elif name in ("minimum", "maximum"):
        at = np.equal(values[0], values[1])
    else:
        return False
    if not at.any():
        return False
    if name == "sqrt":
        return True
    changes = [one.tangents if isinstance(one, DualNumber) else np.zeros(1) for one in inputs]
    change = changes[0] if len(changes) == 1 or name == "hypot" else changes[0] - changes[1]
    return bool((np.abs(change).max(axis=-1, initial=0.0) * at).any())


#: Functions that ask about values.
_ABOUT = {
    "less",
    "less_equal",
    "greater",
    "greater_equal",
    "equal",
    "not_equal",
    "isfinite",
    "isnan",
    "signbit",
    "logical_not",
    "logical_and",
    "logical_or",
}


def _applied(ufunc: Any, inputs: tuple[Any, ...]) -> Any:
    """A function of NumPy of numbers of which one at least is dual."""
    name = ufunc.__name__
    values = [value(one) for one in inputs]
    noted = _corners.get()
    if noted is not None and _at_corner(name, values, inputs):
        noted.add(name)
    with np.errstate(all="ignore"):
        found = ufunc(*values)
        if name in _ABOUT:
            return found
        if name not in SLOPES:
            raise TypeError(f"numpy.{name} has no derivative here")
        change: Any = 0.0
        # Python's own floats would stop at 1/0, where NumPy's go on
        given = [np.asarray(each)[()] for each in values]
        for one, rule in zip(inputs, SLOPES[name], strict=True):
            if isinstance(one, DualNumber):
                tangents = one.tangents
                if one.ndim < np.ndim(found):
                    missing = (1,) * (np.ndim(found) - one.ndim)
                    tangents = tangents.reshape(missing + tangents.shape)
                # what does not change leaves no trace where a slope is infinite
                part = np.multiply(np.asarray(slope(rule, found, given))[..., None], tangents)
                change = change + np.where(tangents == 0.0, 0.0, part)
    return DualNumber(found, np.broadcast_to(change, (*np.shape(found), change.shape[-1])))


def where(choice: Any, x: Any, y: Any) -> Any:
    """`numpy.where` of numbers of which some may be dual.

    >>> where(True, DualNumber(2.0, [1.0]), 3.0).tangents
    array([1.])
    """
    both = x, y
    duals = [one for one in both if isinstance(one, DualNumber)]
    if not duals:
        return np.where(choice, x, y)
    width = duals[0].tangents.shape[-1]
    changes = [one.tangents if isinstance(one, DualNumber) else np.zeros(width) for one in both]
    found = np.where(choice, value(x), value(y))
    return DualNumber(found, np.where(np.asarray(choice)[..., None], *changes))


def value(x: Any) -> Any:
    """The value of a dual number; any other number as it is."""
    return x.value if isinstance(x, DualNumber) else x


#: Lanes of a wide kernel, measured best on a four-bar: with 32 lanes of 8 bytes the compiler runs
#: out of registers; with fewer lanes the arithmetic units wait for each other.
LANES = 16


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


# -- Dual numbers: a value and its derivatives by up to `TANGENTS` parameters, in one row of
#    lanes -------------------------------------------------------------------------------------
#
# Kernels run on them as they run on floats and on lanes (`mbody.core.lanes`): with the witness
# :func:`dual` a row of ``LANES`` numbers is one number, whose value is in lane 0 and whose tangents
# are in the others. Every operation follows the chain rule, exactly; every choice (a branch, a
# comparison, the larger of two) is made by the values::
#
#     (a b)˙ = a ḃ + b ȧ      (a / b)˙ = (ȧ − (a/b) ḃ) / b      √a˙ = ȧ / (2 √a)
#
# So dual numbers are one position, as floats are, and can be compared in an ``if``. Iterations need
# one pass more than the values do, as tangents lag by one: :func:`passes_more` says so.
#
# What computes lane by lane, since it has branches that lanes cannot take together, is written as a
# loop that reads by :func:`entry`, one lane at a time, or one dual number::
#
#     for n in range(rounds(W.scratch, w)):
#         lane = lane_at(n, w)
#         put_entry(W.scratch, 1, g(entry(W.scratch, 0, lane)), lane)
#
# What compiled code makes of these functions is in `mbody.compiler.numba_duals`; in plain Python a
# dual number is a `DualNumber`.

#: Derivatives of one number.
TANGENTS = LANES - 1

Number = Any


def dual() -> Number:
    """The witness of dual numbers: zero, with tangents of zero."""
    return DualNumber(0.0, np.zeros(TANGENTS))


def tangents(x: Number) -> int:
    """How many tangents numbers of this type have: `TANGENTS`, or none of a float."""
    return TANGENTS if isinstance(x, DualNumber) else 0


def passes_more(w: Number) -> int:
    """Passes that an iteration needs after its values have converged: one with dual numbers."""
    return 1 if isinstance(w, DualNumber) else 0


def tangent(x: Number, n: int) -> float:
    """Derivative by parameter n; zero of a float."""
    return float(x.tangents[n]) if isinstance(x, DualNumber) else 0.0


def with_tangent(x: Number, n: int, change: float) -> Number:
    """A number with another derivative by parameter n; a float unchanged."""
    if not isinstance(x, DualNumber):
        return x
    changed = x.tangents.copy()
    changed[n] = change
    return DualNumber(x.value, changed)


def constant(x: Number) -> bool:
    """Whether a number has no derivatives but zeros; true of a float and of lanes."""
    return not (isinstance(x, DualNumber) and x.tangents.any())


def chained(f: float, slope: float, x: Number) -> Number:
    """The number f whose tangents are slope · ẋ; of a float x just f."""
    return DualNumber(f, slope * x.tangents) if isinstance(x, DualNumber) else f


def lane_at(n: int, w: Number) -> Any:
    """Argument of round n of a loop over `count`: lane n, or the dual number."""
    return w if isinstance(w, DualNumber) else n


def rounds(array: np.ndarray, w: Number) -> int:
    """How many positions the rows of an array are of. It is read from the array: a number that the
    compiler knew would have it write the loop out, 16 copies of all laws wherever one is called.
    """
    return 1 if isinstance(w, DualNumber) else array.shape[1]


def entry(array: np.ndarray, row: int, lane: Any) -> Number:
    """The number of a row in that lane; the dual number where `lane` is one."""
    if isinstance(lane, DualNumber):
        return DualNumber(float(array[row, 0]), array[row, 1:].copy())
    return array[row, lane]


def put_entry(array: np.ndarray, row: int, number: Number, lane: Any) -> None:
    """Set the number of a row in that lane; the dual number where `lane` is one."""
    if isinstance(lane, DualNumber):
        array[row, 0] = value(number)
        array[row, 1:] = number.tangents if isinstance(number, DualNumber) else 0.0
    else:
        array[row, lane] = number
