"""Measures of a result with derivatives: which instants they need, and the reductions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber, corners, value
from mbody.derivatives.dual_solution import DualSolution
from mbody.errors import ModelError
from mbody.model.reductions import in_time, mean_over, mean_weights
from mbody.quantities import parse
from mbody.solution.measures import measured, valued
from mbody.solution.solution import Solution
from mbody.sweeps.columns import MeasuredColumn, reduced

__all__ = ["NeededInstants", "Derived", "derived", "instants_of", "integral_slope", "mean_slope"]

#: Values this close, as a part of the greatest, count as equal.
EQUAL = 1e-9
#: Derivatives this close count as equal, as a part of the greatest.
ALIKE = 1e-6
#: Names of functions in formulas by NumPy's.
SHOWN = {"absolute": "abs", "minimum": "min", "maximum": "max"}


@dataclass(frozen=True)
class NeededInstants:
    """The instants that a measure needs.

    Attributes
    ----------
    needed : array of int
        Numbers of instants; the first is that of a greatest or least value, others share it. Of
        "span" those of the greatest value, then those of the least.
    single : bool
        Whether one instant decides.
    value : float or array
        As the result has it.
    loads : bool
        Whether it has what loads do.
    greatest : int
        Of "span", how many of the needed are of the greatest value.
    """

    needed: np.ndarray
    single: bool
    value: Any
    unit: str
    loads: bool
    greatest: int = 0


@dataclass(frozen=True)
class Derived:
    """Value and derivatives of one measure."""

    value: Any
    row: np.ndarray
    unit: str
    at: float | None
    notes: tuple[str, ...]


def instants_of(run: Solution, column: MeasuredColumn) -> NeededInstants:
    """The instants that the derivative of a measure needs."""
    history, _, unit = measured(run, column.measure)
    count = len(run.t)
    if column.by == "at" and not -count <= column.instant < count:
        raise ModelError(
            f"'{column.name}': there is no such instant, they are 0 to {count - 1}", column.name
        )
    found = np.asarray(reduced(column, history, run.t / run.mechanism.units.second))
    single, needed, greatest = True, np.arange(count), 0
    if column.by in ("peak", "max", "min"):
        size = {"peak": np.abs(history), "max": history, "min": -history}[column.by]
        needed = _greatest(size)
    elif column.by == "span":
        single, high, low = False, _greatest(history), _greatest(-history)
        needed, greatest = np.concatenate([high, low]), len(high)
    elif column.by in ("first", "last", "at"):
        place = {"first": 0, "last": -1, "at": column.instant}[column.by]
        needed = np.array([place % count])
    elif count > 1 or column.by:
        single = False
    names = parse(column.measure.of, curves=True).names
    loads = {load.name for load in run.mechanism.loads}
    owned = any(name.partition(".")[0] in loads for name in names)
    exact = float(found) if found.ndim == 0 else found
    if found.shape == (1,) and not column.by:
        exact = float(found[0])
    return NeededInstants(needed, single, exact, unit, owned, greatest)


def _greatest(size: np.ndarray) -> np.ndarray:
    """The instant of the greatest value, then those elsewhere that share it."""
    best = int(np.argmax(size))
    equal = np.flatnonzero(size >= size[best] - EQUAL * abs(size[best]))
    others = [int(k) for k in equal if k != best]
    return np.array([best, *others[:8]])


def derived(
    whole: DualSolution, instants: np.ndarray, column: MeasuredColumn, choice: NeededInstants
) -> Derived:
    """The derivatives of a measure from the instants of a dual result.

    Raises
    ------
    ModelError
        For a measure that has no derivatives here.
    """
    part = whole.part(np.searchsorted(instants, choice.needed))
    record: Any = part.record
    count, width = record.tangents.shape[0], record.tangents.shape[2]
    try:
        with corners() as found:
            history, _, _ = valued(part, column.measure)
    except TypeError as error:
        raise ModelError(
            f"'{column.name}' has no exact derivatives: {error}; vary the numbers by sweep"
        ) from None
    if not isinstance(history, DualNumber):
        history = DualNumber(np.asarray(history, dtype=float), np.zeros(width))
    values = np.broadcast_to(history.value, (count,))
    tangents = np.broadcast_to(history.tangents, (count, width))
    times = np.broadcast_to(value(part.t), (count,))
    notes, second = _at_corners(column, found), whole.mechanism.units.time
    if choice.single:
        sign = -1.0 if column.by == "peak" and values[0] < 0.0 else 1.0
        row = sign * tangents[0]
        if column.by == "peak" and values[0] == 0.0:
            notes.append(_at_zero(column))
        notes += _tied(column, values, tangents, times, second)
        return Derived(choice.value, row, choice.unit, float(times[0]), tuple(notes))
    row = tangents
    if column.by == "mean":
        row = mean_slope(values, tangents, part.t)
    elif column.by == "integral":
        row = integral_slope(values, tangents, part.t) / part.mechanism.units.second
    elif column.by == "span":
        low = choice.greatest
        row = tangents[0] - tangents[low]
        for k in (slice(None, low), slice(low, None)):
            notes += _tied(column, values[k], tangents[k], times[k], second)
    elif column.by == "rms":
        square = np.square(values)
        size = float(np.sqrt(mean_over(square, times)))
        half = mean_slope(0.5 * square, values[:, None] * tangents, part.t)
        row = half / size if size else 0.0 * tangents[0]
        if size == 0.0:
            notes.append(_at_zero(column))
    return Derived(choice.value, row, choice.unit, None, tuple(notes))


def integral_slope(values: np.ndarray, tangents: np.ndarray, t: Any) -> np.ndarray:
    """Derivatives of an integral by the trapezoidal rule: of the history (instants, numbers), and
    of the times t, a dual number where they move.
    """
    times = np.broadcast_to(value(t), values.shape)
    row = np.trapezoid(tangents, times, axis=0)
    if isinstance(t, DualNumber):
        row = row + (0.5 * (values[1:] + values[:-1])) @ np.diff(t.tangents, axis=0)
    return row


def mean_slope(values: np.ndarray, tangents: np.ndarray, t: Any) -> np.ndarray:
    """Derivatives (numbers,) of a mean over the motion: of the history (instants,) with its
    tangents (instants, numbers), and of the times t, a dual number where they move.

    m = ∫ x dt / T, so m′ = ((∫ x dt)′ − m T′) / T.
    """
    times = np.broadcast_to(value(t), values.shape)
    if not in_time(times) or not isinstance(t, DualNumber):
        return np.asarray(mean_weights(times) @ tangents)
    whole, mean = times[-1] - times[0], mean_over(values, times)
    stretch = t.tangents[-1] - t.tangents[0]
    return np.asarray((integral_slope(values, tangents, t) - mean * stretch) / whole)


def _at_corners(column: MeasuredColumn, found: set[str]) -> list[str]:
    """A note where functions in the formula of a measure are at their corners."""
    if not found:
        return []
    return [
        f"'{column.name}' has no derivative where {_listed(found)} is at its corner: that of one "
        "side is given"
    ]


def _at_zero(column: MeasuredColumn) -> str:
    """A note where a reduction, "peak" or "rms", has a corner at zero."""
    what = "|x|" if column.by == "peak" else "its root"
    return f"'{column.name}' is zero: {what} has no derivative there"


def _listed(found: set[str]) -> str:
    """Functions by their names in formulas."""
    return " and ".join(f"'{SHOWN.get(name, name)}'" for name in sorted(found))


def _tied(
    column: MeasuredColumn, values: np.ndarray, tangents: np.ndarray, times: np.ndarray, unit: str
) -> list[str]:
    """A note where other instants share the greatest value and change otherwise."""
    signs = np.where(values < 0.0, -1.0, 1.0) if column.by == "peak" else np.ones(len(values))
    changes = signs[:, None] * tangents
    top = np.abs(changes).max(initial=0.0)
    apart = np.abs(changes - changes[0]).max(axis=1, initial=0.0)
    others = np.flatnonzero(apart > ALIKE * top)
    if not len(others):
        return []
    return [
        f"'{column.name}' is as great at t = {times[others[0]]:.6g} {unit} as at t = "
        f"{times[0]:.6g} {unit}, and changes otherwise there: it has no derivative; that at the "
        "second is given"
    ]
