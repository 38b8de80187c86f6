"""Measures of a result with derivatives: which instants they need, and the reductions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core.lanes import LANES, TANGENTS, DualNumber, aligned, corners, value
from mbody.core.recorded_numbers import Untraceable
from mbody.core.tolerances import DERIVATIVE_VALUES_EQUAL, DERIVATIVES_EQUAL
from mbody.derivatives.dual_solution import DualRecord, DualSolution, dual_solution
from mbody.errors import ModelError
from mbody.image.model_image import changeable_numbers
from mbody.kernels.number_program import NumberProgram, number_duals
from mbody.model.simulation import Measure, in_time, mean_over, mean_weights
from mbody.quantities import parse
from mbody.solution.measures import evaluate_measure, measured
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import Recording, Rule, of_what_is_read
from mbody.sweeps.job import MeasuredColumn, reduced

#: Names of functions in formulas by NumPy's.
FORMULA_NAMES = {"absolute": "abs", "minimum": "min", "maximum": "max"}


@dataclass(frozen=True)
class NeededInstants:
    """The instants that a measure needs.

    `needed`: Numbers of instants; the first is that of a greatest or least value, others share it.
      Of "span" those of the greatest value, then those of the least.
    `single`: Whether one instant decides.
    `value`: As the result has it.
    `loads`: Whether it has what loads do.
    `greatest`: Of "span", how many of the needed are of the greatest value.
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
    equal = np.flatnonzero(size >= size[best] - DERIVATIVE_VALUES_EQUAL * abs(size[best]))
    others = [int(k) for k in equal if k != best]
    return np.array([best, *others[:8]])


def derived(
    whole: DualSolution, instants: np.ndarray, column: MeasuredColumn, choice: NeededInstants
) -> Derived:
    """The derivatives of a measure from the instants of a dual result."""
    part = whole.part(np.searchsorted(instants, choice.needed))
    record: Any = part.record
    count, width = record.tangents.shape[0], record.tangents.shape[2]
    try:
        with corners() as found:
            history, _, _ = evaluate_measure(part, column.measure)
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
        row = mean_derivative(values, tangents, part.t)
    elif column.by == "integral":
        row = integral_derivative(values, tangents, part.t) / part.mechanism.units.second
    elif column.by == "span":
        low = choice.greatest
        row = tangents[0] - tangents[low]
        for k in (slice(None, low), slice(low, None)):
            notes += _tied(column, values[k], tangents[k], times[k], second)
    elif column.by == "rms":
        square = np.square(values)
        size = float(np.sqrt(mean_over(square, times)))
        half = mean_derivative(0.5 * square, values[:, None] * tangents, part.t)
        row = half / size if size else 0.0 * tangents[0]
        if size == 0.0:
            notes.append(_at_zero(column))
    return Derived(choice.value, row, choice.unit, None, tuple(notes))


def integral_derivative(values: np.ndarray, tangents: np.ndarray, t: Any) -> np.ndarray:
    """Derivatives of an integral by the trapezoidal rule: of the history (instants, numbers), and
    of the times t, a dual number where they move.
    """
    times = np.broadcast_to(value(t), values.shape)
    row = np.trapezoid(tangents, times, axis=0)
    if isinstance(t, DualNumber):
        row = row + (0.5 * (values[1:] + values[:-1])) @ np.diff(t.tangents, axis=0)
    return row


def mean_derivative(values: np.ndarray, tangents: np.ndarray, t: Any) -> np.ndarray:
    """Derivatives (numbers,) of a mean over the motion: of the history (instants,) with its
    tangents (instants, numbers), and of the times t, a dual number where they move.

    m = ∫ x dt / T, so m′ = ((∫ x dt)′ − m T′) / T.
    """
    times = np.broadcast_to(value(t), values.shape)
    if not in_time(times) or not isinstance(t, DualNumber):
        return np.asarray(mean_weights(times) @ tangents)
    whole, mean = times[-1] - times[0], mean_over(values, times)
    stretch = t.tangents[-1] - t.tangents[0]
    return np.asarray((integral_derivative(values, tangents, t) - mean * stretch) / whole)


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
    return " and ".join(f"'{FORMULA_NAMES.get(name, name)}'" for name in sorted(found))


def _tied(
    column: MeasuredColumn, values: np.ndarray, tangents: np.ndarray, times: np.ndarray, unit: str
) -> list[str]:
    """A note where other instants share the greatest value and change otherwise."""
    signs = np.where(values < 0.0, -1.0, 1.0) if column.by == "peak" else np.ones(len(values))
    changes = signs[:, None] * tangents
    top = np.abs(changes).max(initial=0.0)
    difference = np.abs(changes - changes[0]).max(axis=1, initial=0.0)
    others = np.flatnonzero(difference > DERIVATIVES_EQUAL * top)
    if not len(others):
        return []
    return [
        f"'{column.name}' is as great at t = {times[others[0]]:.6g} {unit} as at t = "
        f"{times[0]:.6g} {unit}, and changes otherwise there: it has no derivative; that at the "
        "second is given"
    ]


# -- A measure as a list of operations on what dual kernels keep of an instant -----------------
# The formula of a measure is evaluated once on traced numbers
# (`mbody.solution.traced_instant`); the list of operations is then repeated in dual numbers, in
# microseconds instead of a tenth of a millisecond.


@dataclass(frozen=True)
class MeasureProgram:
    """Operations from the rows of an instant, and the numbers of the description, to a measure.

    `program`: Its inputs are what is read alone: the rows, then the numbers.
    `rows` (read,): The rows that are read.
    `place`: Of the numbers that are read, the place by name.
    `memory`: Free ones: the slots, and a row for what is found.
    """

    program: NumberProgram
    rows: np.ndarray
    place: dict[str, int]
    memory: list[np.ndarray] = field(default_factory=list, repr=False, compare=False)

    def evaluated(
        self, record: DualRecord, instant: int, values: Mapping[str, Any], names: Sequence[str]
    ) -> tuple[float, np.ndarray]:
        """The measure at one instant, and its derivatives by the named numbers; those of a first
        state change only the rows.
        """
        tangents, read = np.empty(len(names)), len(self.rows)
        try:
            # another thread may take the last one
            memory = self.memory.pop()
        except IndexError:
            memory = aligned(len(self.program.slots) + 1, LANES)
        slots, found = memory[:-1], memory[-1:]
        slots[:read, 0] = record.values[instant, self.rows]
        own = record.tangents[instant, self.rows]
        for first in range(0, max(len(names), 1), TANGENTS):
            part = names[first : first + TANGENTS]
            last = 1 + len(part)
            slots[:read, 1:last] = own[:, first : first + len(part)]
            slots[:read, last:] = 0.0
            for name, place in self.place.items():
                slots[place] = 0.0
                slots[place, 0] = values[name]
                if name in part:
                    slots[place, 1 + part.index(name)] = 1.0
            number_duals(self.program, slots, found)
            tangents[first : first + len(part)] = found[0, 1:last]
        value = float(found[0, 0])
        self.memory.append(memory)
        return value, tangents


def recorded_measure(
    run: Solution, record: DualRecord, measure: Measure, names: Sequence[str]
) -> MeasureProgram | None:
    """The program of a measure without its reduction; None where what it needs cannot be recorded,
    or one of the named numbers is no input of it.
    """
    changeable = changeable_numbers(run.system)
    if not all(name in changeable.rules for name in names if name in run.system.values):
        return None
    rows = record.values.shape[1]
    inputs = {f"row {n}": Rule(0.0) for n in range(rows)}
    # names of numbers, of which one may be that of a row
    inputs |= {f"number {name}": rule for name, rule in changeable.rules.items()}
    recording = Recording(inputs)
    traced = list(recording.inputs.values())
    numbers = dict(zip(changeable.rules, traced[rows:], strict=True))
    found = dual_solution(run, changeable.values(numbers), _Traced(record, traced[:rows]))
    try:
        program = recording.program([evaluate_measure(found, measure)[0]])
    except (Untraceable, ModelError, TypeError):
        return None
    short, read = of_what_is_read(program)
    place = {list(numbers)[k - rows]: n for n, k in enumerate(read.tolist()) if k >= rows}
    return MeasureProgram(short, read[read < rows], place)


class _Traced(DualRecord):
    """The rows of one instant as traced numbers."""

    def __init__(self, like: DualRecord, rows: list[Any]) -> None:
        super().__init__(like.values, like.tangents, like.loads, like.size)
        self.rows = rows

    def take(self, row: int) -> Any:
        """One number."""
        return self.rows[row]
