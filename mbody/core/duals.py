"""Dual numbers: a value and its derivatives by up to `TANGENTS` parameters, in one row of lanes.

Kernels run on them as they run on floats and on lanes (`mbody.core.lanes`): with the witness
:func:`dual` a row of ``LANES`` numbers is one number, whose value is in lane 0 and whose tangents
are in the others. Every operation follows the chain rule, exactly; every choice (a branch, a
comparison, the larger of two) is made by the values::

    (a b)˙ = a ḃ + b ȧ      (a / b)˙ = (ȧ − (a/b) ḃ) / b      √a˙ = ȧ / (2 √a)

So dual numbers are one position, as floats are, and can be compared in an ``if``. Iterations need
one pass more than the values do, as tangents lag by one: :func:`passes_more` says so.

What computes lane by lane, since it has branches that lanes cannot take together, is written as a
loop that reads by :func:`entry`, one lane at a time, or one dual number::

    for n in range(rounds(W.scratch, w)):
        lane = lane_at(n, w)
        put_entry(W.scratch, 1, g(entry(W.scratch, 0, lane)), lane)

What compiled code makes of these functions is in `mbody.compiler.numba_duals`; in plain Python a
dual number is a `DualNumber`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber, value
from mbody.core.lanes import LANES

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
