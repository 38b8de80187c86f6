"""Searches from several starts: the description, then the best of a Latin hypercube."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.batch import BatchSetup
from mbody.core.tolerances import LIMIT_HOLDS, OPTIMUM_VALUE_NONE, OPTIMUM_VALUES_AGREE, TINY
from mbody.derivatives.named_numbers import checked_names, influential, unit_of
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed
from mbody.model.numbers import dimension_named
from mbody.model.study import OVER_TIME, Measure
from mbody.optimization.aims_and_limits import Aim, Limit
from mbody.optimization.design_evaluation import Evaluation, Evaluator, MotionEvaluator
from mbody.optimization.nonlinear_program import Program, SearchResult
from mbody.quantities import Formula, FormulaError
from mbody.quantities.formula import NotFinite, float_or_formula
from mbody.sweeps.job import Job, MeasuredColumn, side_by_side
from mbody.system.system import System

# -- Between which values the numbers of an optimization may go, and where it begins -----------


@dataclass(frozen=True, eq=False)
class Ranges:
    """The numbers that are varied.

    `names`: Dotted names.
    `given`: The names as given.
    `low`, `high`, `start` (numbers,)
    `notes`: Numbers of the description that lie beyond their bounds, where the search does not
      begin.
    """

    names: tuple[str, ...]
    given: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    units: tuple[str, ...]
    notes: tuple[str, ...] = ()


def ranges_of(
    system: System, by: Mapping[str, Any] | None, start: Mapping[str, Any] | None
) -> Ranges:
    """Ranges of the numbers from `by` and `start`."""
    if not isinstance(by, Mapping) or not by:
        raise ModelError(
            'optimize: by must be a dict of bounds such as {"crank.A.x": (0.1, 0.3)}, not '
            f"{brief(by)}"
        )
    names = checked_names(system, list(by), "optimize")
    low, high = (
        np.array([_bounds(system, g, n, by[g])[k] for g, n in names.items()]) for k in (0, 1)
    )
    if start is not None and not isinstance(start, Mapping):
        raise ModelError(f"optimize: start must be a dict of numbers, not {brief(start)}")
    strange = [name for name in start or {} if name not in by]
    if strange:
        raise ModelError(
            f"optimize: start has {brief(strange[0])}, which by does not vary (it varies: "
            f"{listed(by)})",
            str(strange[0]),
        )
    first, notes = [], []
    for n, (given, name) in enumerate(names.items()):
        own = float(system.values[name])
        if start is not None and given in start:
            own = _number(system, name, start[given], given)
            if not low[n] <= own <= high[n]:
                raise ModelError(
                    f"optimize: start of '{given}' is {own:g}, beyond its bounds {low[n]:g} to "
                    f"{high[n]:g}",
                    given,
                )
        elif not low[n] <= own <= high[n]:
            notes.append(_beyond(system, given, name, own, (low[n], high[n])))
        first.append(own)
    return Ranges(
        names=tuple(names.values()),
        given=tuple(names),
        low=low,
        high=high,
        start=np.clip(np.array(first), low, high),
        units=tuple(unit_of(system.mechanism, name) for name in names.values()),
        notes=tuple(notes),
    )


def _beyond(system: System, given: str, name: str, own: float, bounds: tuple[float, float]) -> str:
    """The note of a number whose bounds leave the description out."""
    unit = unit_of(system.mechanism, name)
    clipped = float(np.clip(own, *bounds))
    return (
        f"'{given}' is {own:.6g} {unit}".rstrip()
        + f" in the description, beyond its bounds: the first search begins at {clipped:.6g} {unit}"
    ).rstrip()


def _bounds(system: System, given: str, name: str, pair: Any) -> tuple[float, float]:
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise ModelError(
            f"optimize: '{given}' needs its lowest and greatest value (low, high), not "
            f"{brief(pair)}",
            given,
        )
    low, high = (_number(system, name, one, given) for one in pair)
    unit = unit_of(system.mechanism, name)
    if not low < high:
        raise ModelError(
            f"optimize: '{given}' goes from {low:g} to {high:g} {unit}".rstrip()
            + ": give its lowest value, then its greatest",
            given,
        )
    sign, _ = system.rule(name)
    if sign and (low < 0.0 or (sign == "positive" and low == 0.0)):
        raise ModelError(
            f"optimize: '{given}' goes from {low:g} {unit}".rstrip()
            + f", it must {'be positive' if sign == 'positive' else 'not be negative'}: give a "
            "greater lowest value",
            given,
        )
    return low, high


def _number(system: System, name: str, value: Any, given: str) -> float:
    """One number in the units of the mechanism."""
    machine = system.mechanism
    try:
        made = value if isinstance(value, Formula) else float_or_formula(value, None)
        if isinstance(made, Formula):
            dimension, scope = dimension_named(machine, name), machine.parameters.scope()
            made = (made if dimension is None else made.of(dimension)).value(scope)
        number = float(made)
    except NotFinite as error:
        raise ModelError(f"optimize: '{given}' is {error}, it must be finite", given) from None
    except FormulaError as error:
        raise ModelError(f"optimize: '{given}': {error}", given) from None
    return number


# -- Designs to begin searches from: a Latin hypercube, judged side by side on lanes -----------


@dataclass(frozen=True, eq=False)
class _Values:
    """Histories of one design without derivatives, as an `Evaluation` has them."""

    histories: dict[Measure, np.ndarray]

    def history(self, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
        """A quantity, (instants,), and no derivatives."""
        value = self.histories[measure]
        return value, np.zeros((len(value), 0))


class Screen:
    """Judges many designs of one system by an aim and limits. `known` (numbers,)."""

    def __init__(
        self,
        job: Job | None,
        evaluator: Evaluator | MotionEvaluator,
        aims: Sequence[Aim],
        limits: Sequence[Limit],
        known: np.ndarray | None = None,
    ) -> None:
        self.job, self.evaluator, self.aims, self.limits = job, evaluator, aims, limits
        self._known = evaluator.present() if known is None else known

    def about(self, at: Evaluation) -> Screen:
        """A copy whose designs are closed from the position of an evaluated one."""
        job = self.job
        if job is not None and isinstance(job.course, BatchSetup):
            started = replace(job.course, pose=at.pose, origin=at.run.system.par[:, 0].copy())
            job = replace(job, course=started)
        return Screen(job, self.evaluator, self.aims, self.limits, at.x)

    @functools.cached_property
    def by_lanes(self) -> bool:
        """Whether designs go side by side. Lanes go from one instant to the next by steps of one
        length: where instants lie far apart, one design gets there and lanes do not.
        """
        if self.job is None:
            return False
        found = side_by_side(self.job, self._known[None])
        return found is not None and (bool(found[1][0]) or self.evaluator(self._known) is None)

    @staticmethod
    def columns(aims: Sequence[Aim], limits: Sequence[Limit]) -> tuple[MeasuredColumn, ...]:
        """The histories that aims and limits are made of."""
        every = [aim.column for aim in aims]
        every += [side for limit in limits for side in (limit.left, limit.right)]
        measures = dict.fromkeys(column.measure for column in every)
        if any(column.by in OVER_TIME for column in every):
            measures[Measure("t", "s")] = None
        return tuple(MeasuredColumn(f"{n}", one) for n, one in enumerate(measures))

    def evaluate(self, designs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of the aims, with the signs that make them least, (designs, aims), and margins of
        the limits, (designs, limits); NaN where a design cannot be analysed.
        """
        values = np.full((len(designs), len(self.aims)), np.nan)
        margins = np.full((len(designs), len(self.limits)), np.nan)
        for design, at in enumerate(self._histories(designs)):
            if at is None:
                continue
            values[design] = [aim.sign * aim.value(at) for aim in self.aims]
            margins[design] = [limit.margin(at) for limit in self.limits]
        return values, margins

    def _histories(self, designs: np.ndarray) -> list[Any]:
        job = self.job
        found = side_by_side(job, designs) if job is not None and self.by_lanes else None
        if job is None or found is None:
            return [self.evaluator.plain(x) for x in designs]
        columns, good = found
        measures = [column.measure for column in job.columns]
        made: list[Any] = []
        for design in range(len(designs)):
            own = [column[design].reshape(-1) for column in columns]
            fine = good[design] and all(np.isfinite(row).all() for row in own)
            made.append(_Values(dict(zip(measures, own, strict=True))) if fine else None)
        return made


def spread_designs(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Designs within bounds, one in each of so many slices of every number (McKay 1979): (count,
    numbers).
    """
    rng = np.random.default_rng(seed)
    slices = rng.permuted(np.tile(np.arange(count), (len(low), 1)), axis=1).T
    parts = (slices + rng.random((count, len(low)))) / count
    return np.asarray(low + (high - low) * parts)


#: Designs of the hypercube for each number and each search, and the least number of them.
EACH, LEAST = 24, 256
#: Starts are apart by this part of the ranges, where there are enough.
START_SPACING = 0.15


@dataclass(frozen=True)
class SearchEnding:
    """Result of the searches from all starts."""

    best: SearchResult
    program: Program
    starts: int
    agreeing: int
    status: str
    notes: tuple[str, ...]


@dataclass
class MultiStart:
    """Searches of designs of one system within ranges.

    `count`, `seed`: Of searches.
    `seen`: Called with the finished searches and all.
    """

    evaluator: Evaluator | MotionEvaluator
    screen: Screen
    ranges: Ranges
    count: int
    seed: int
    seen: Callable[[int, int], None] | None = None
    done: int = 0
    spread: np.ndarray | None = None
    merits: tuple[np.ndarray, np.ndarray] | None = field(default=None)

    def mark(self) -> None:
        """The point at which a search may be stopped."""
        if self.seen is not None:
            self.seen(self.done, self.count * len(self.screen.aims))

    def program(self, aim: Aim, limits: Sequence[Limit]) -> Program:
        """Nonlinear program of an objective within limits and ranges."""
        bounds = self.ranges.low, self.ranges.high
        return Program(self.evaluator, bounds, aim, limits, self.mark)

    def ended(self, aim: Aim, limits: Sequence[Limit]) -> SearchEnding:
        """The best of all searches."""
        program, notes = self.program(aim, limits), list(self.ranges.notes)
        status, found = "completed", []
        try:
            starts = self.starts(aim)
            first = program.at(starts[0])
            assert first is not None
            program.measure_by(first)
            notes += self._examined(program, aim, limits, starts)
            for x in starts:
                end = program.search(x)
                if end is not None:
                    found.append(end)
                self.done += 1
                self.mark()
        except KeyboardInterrupt:
            if not found:
                raise
            status = f"stopped: after {len(found)} of {self.count} searches"
        feasible = [one for one in found if one.broken <= LIMIT_HOLDS]
        if not feasible:
            raise self._none(min(found, key=lambda one: one.broken), limits)
        best = min(feasible, key=lambda one: one.value)
        tolerance = OPTIMUM_VALUES_AGREE * max(abs(best.value), OPTIMUM_VALUE_NONE * program.scale)
        agreeing = sum(one.value <= best.value + tolerance for one in feasible)
        return SearchEnding(best, program, len(found), agreeing, status, tuple(notes))

    def starts(self, aim: Aim) -> list[np.ndarray]:
        """Starts of the searches: the one that was given, then the best of many that are apart."""
        ranges = self.ranges
        if self.spread is None or self.merits is None:
            many = max(LEAST, EACH * len(ranges.names), 4 * self.count)
            if not self.screen.by_lanes:
                many = 4 * self.count  # one by one
            self.spread = spread_designs(ranges.low, ranges.high, many, self.seed)
            self.merits = self.screen.evaluate(self.spread)
        values, margins = self.merits
        first = self.evaluator(ranges.start)
        sound = first is not None and bool(np.isfinite(aim.rows(first).values).all())
        closing = np.isfinite(values).all(axis=1)
        if not sound and not closing.any():
            raise self._unreachable(len(values))
        order = _by_merit(values[:, self.screen.aims.index(aim)], margins, closing)
        chosen = [ranges.start] if sound else []
        width = ranges.high - ranges.low
        for spacing in (START_SPACING, 0.0):
            for k in order:
                x = self.spread[k]
                distances = [np.abs((x - other) / width).max() for other in chosen]
                if len(chosen) < self.count and min(distances, default=1.0) > spacing:
                    chosen.append(x)
        begun = [x for x in chosen if self.evaluator(x) is not None]
        if not begun:
            raise self._unreachable(len(values))
        return begun[: self.count]

    def _examined(
        self, program: Program, aim: Aim, limits: Sequence[Limit], starts: Sequence[np.ndarray]
    ) -> list[str]:
        """Refuse an aim that no number changes; sentences for limits that none changes."""
        points = [at for at in map(self.evaluator, starts[:3]) if at is not None]
        names, system = list(self.ranges.names), self.evaluator.system
        ranges = self.ranges.high - self.ranges.low

        def moves(rows: list[tuple[np.ndarray, np.ndarray]]) -> bool:
            return any(
                influential(system, names, value, derivative).any()
                and (np.abs(derivative) * ranges).any()
                for value, derivative in rows
            )

        own = [(rows.values, rows.derivatives) for rows in (aim.rows(at) for at in points)]
        if not moves(own):
            given = ", ".join(f"'{name}'" for name in self.ranges.given)
            raise ModelError(
                f"optimize: none of {given} changes '{aim.text}': its derivatives are zero; vary "
                "other numbers, or choose another aim"
            )
        return [
            f"none of the numbers changes '{limit.text}'"
            for limit in limits
            if not moves(
                [(rows.values, rows.derivatives) for rows in (limit.rows(at) for at in points)]
            )
        ]

    def _unreachable(self, count: int) -> SolveError:
        """The error where no design within the bounds can be analysed."""
        ranges = self.ranges
        why = self.evaluator.failure(ranges.start)
        return SolveError(
            f"optimize: none of {count} designs within the bounds can be analysed at all instants "
            f"with derivatives; at the start: {why}; give other bounds"
        )

    def _none(self, nearest: SearchResult, limits: Sequence[Limit]) -> SolveError:
        """The error where no design meets the limits."""
        sizes = nearest.at
        worst = min(limits, key=lambda limit: limit.margin(sizes))
        given, x = self.ranges.given, nearest.at.x
        at = ", ".join(f"{name} = {value:.6g}" for name, value in zip(given, x, strict=True))
        return SolveError(
            f"optimize: no design within the bounds meets all limits: '{worst.text}' is missed by "
            f"{-worst.margin(sizes):.4g} {worst.unit}".rstrip()
            + f" at the nearest, {at}: give it more, or widen the bounds"
        )


def _by_merit(values: np.ndarray, margins: np.ndarray, closing: np.ndarray) -> np.ndarray:
    """Designs that can be analysed, those that break limits least first, then the better ones."""
    places = np.flatnonzero(closing)
    sizes = np.maximum(np.median(np.abs(margins[places]), axis=0), TINY) if len(places) else 1.0
    broken = np.maximum(0.0, -margins[places] / sizes).sum(axis=1)
    return places[np.lexsort((values[places], np.where(broken > 0.0, broken, 0.0)))]
