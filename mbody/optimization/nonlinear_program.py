"""One search for the best design from one start: sequential quadratic programming.

A greatest value over the cycle is no smooth function of the numbers, each instant is: the search
minimises a bound z of all instants (epigraph form), with the limits at instants as constraints. It
takes some instants of each limit, then adds those that are broken between them (exchange method;
Hettich and Kortanek, SIAM Review 35, 1993). The search itself is SLSQP (Kraft 1988) of SciPy.
Designs that cannot be analysed are behind a wall from which its line search comes back; before it
stands the limit of mobility, which is differentiable.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from mbody.analysis.driven.batch import BatchSetup
from mbody.core import tolerances as tol
from mbody.core.least_squares import nonnegative
from mbody.core.searches import Searches, latin
from mbody.derivatives.dual_solution import checked_names, influential, unit_of
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.linear_program import INCONSISTENT, UNBOUNDED
from mbody.model.element import listed
from mbody.model.numbers import dimension_named
from mbody.model.simulation import OVER_TIME, Measure
from mbody.optimization.design_evaluation import (
    Aim,
    AimRows,
    Evaluation,
    Evaluator,
    Limit,
    MotionEvaluator,
)
from mbody.quantities.formula import range_given, value_given
from mbody.solution.shared_forces import greatest
from mbody.sweeps.job import Job, MeasuredColumn, side_by_side
from mbody.system.system import System

# -- The end of a search: linear programs within a trust region --------------------------------
# Where an optimum is a corner of several limits and peaks, sequential quadratic programming may
# stop short of it. There each linear program, of all rows at the design, within a box that shrinks
# where it promised more than the design keeps, leads on quadratically (sequential linear
# programming; Fletcher, *Practical Methods of Optimization*, 1987, section 14.4).

#: Steps of a program.
STEPS = 40
#: How much more than its multipliers a broken limit counts.
HEAVIER = 2.0


@dataclass(frozen=True)
class Linearized:
    """A design and all rows about it, as parts of sizes and ranges.

    `u` (numbers,): Between 0 and 1.
    `aims`, `by_aims` (rows,) (rows, numbers): Of which the greatest is to be least.
    `limits`, `by_limits` (rows,) (rows, numbers): Not to be negative.
    `equal`, `by_equal` (rows,) (rows, numbers): To be zero.
    """

    u: np.ndarray
    aims: np.ndarray
    by_aims: np.ndarray
    limits: np.ndarray
    by_limits: np.ndarray
    equal: np.ndarray
    by_equal: np.ndarray

    def merit(self, weight: float) -> float:
        """Merit function: objective, plus weighted violations of the constraints."""
        broken = max(0.0, -float(self.limits.min(initial=0.0)))
        return float(self.aims.max()) + weight * (broken + float(np.abs(self.equal).sum()))


def linear_steps(start: Linearized, look: Callable[[np.ndarray], Linearized | None]) -> Linearized:
    """The end of linear steps from a design; `look` gives the rows about a place, None where the
    design cannot be analysed.
    """
    here, box, weight = start, tol.OPTIMUM_BOX_FIRST, 10.0
    for _ in range(STEPS):
        step = _step(here, box)
        if step is None:
            return here
        step_found, promised, heaviest = step
        weight = max(weight, HEAVIER * heaviest)
        now = here.merit(weight)
        foretold = now - promised
        if foretold <= tol.OPTIMUM_GAIN_LAST * max(abs(now), tol.TINY):
            return here
        there = look(np.clip(here.u + step_found, 0.0, 1.0))
        gained = -1.0 if there is None else (now - there.merit(weight)) / foretold
        if there is not None and gained > 1e-2:
            here = there
            box = min(1.0, 2.0 * box) if gained > 0.75 else box
        if gained < 0.25:
            box = 0.25 * float(np.abs(step_found).max())
        if box < tol.UNKNOWN_STEP_ROUNDING:
            return here
    return here


def _step(at: Linearized, box: float) -> tuple[np.ndarray, float, float] | None:
    """The step that is best to first order, the merit that it promises with what it must leave
    broken, and the greatest sum of multipliers.
    """
    n, free = len(at.u), len(at.equal)
    may_bind = at.limits - np.abs(at.by_limits).sum(axis=1) * box <= 0.0
    may_bind |= at.limits <= at.limits.min(initial=np.inf)
    own, derivatives = at.limits[may_bind], at.by_limits[may_bind]
    top = at.aims + np.abs(at.by_aims).sum(axis=1) * box
    high = top >= at.aims.max() - np.abs(at.by_aims[at.aims.argmax()]).sum() * box
    aims, by_aims = at.aims[high], at.by_aims[high]
    # unknowns: the step, z above all aims, s ≥ 0 by which limits may stay broken, sizes of what is
    # left of equations
    z, s, *left = np.eye(n + 2 + free)[n:]
    each = np.reshape(left, (free, n + 2 + free))
    ends = np.minimum(box, 1.0 - at.u), np.minimum(box, at.u)

    def rows(by: np.ndarray) -> np.ndarray:
        return np.pad(by, ((0, 0), (0, 2 + free)))

    found, x, loads = greatest(
        -z - 1e4 * s - 1e4 * each.sum(axis=0),
        np.vstack(
            [
                rows(by_aims) - z,
                rows(-derivatives) - s,
                rows(at.by_equal) - each,
                rows(-at.by_equal) - each,
                rows(np.eye(n)),
                rows(-np.eye(n)),
                -s,
            ]
        ),
        np.concatenate([-aims, own, -at.equal, at.equal, *ends, [0.0]]),
    )
    if found in (INCONSISTENT, UNBOUNDED):
        return None
    _, pulls, above, below, _ = np.split(loads, np.cumsum([len(aims), len(own), free, free]))
    heaviest = max(pulls.sum(), np.abs(above - below).max(initial=0.0))
    heaviest = min(float(heaviest), 1e3)
    weight = max(10.0, HEAVIER * heaviest)
    return x[:n], float(x[n]) + weight * float(x[n + 1 :].sum()), heaviest


#: Rows of a limit with which the search begins, rounds of exchange, and steps of each.
ROWS, ROUNDS, ITERATIONS = 40, 8, 100
#: A design moves no faster than so many times the description, by unit rate of its drivers.
FASTEST = 50.0
#: How bad a design is that cannot be analysed, in sizes of what is minimised.
WALL = 1e4


class Goal(Protocol):
    """Interface of an objective, such as `Aim`."""

    @property
    def each(self) -> bool:
        """Whether the worst of several rows decides."""

    @property
    def squared(self) -> bool:
        """Whether its square bends as a quadratic does."""

    def rows(self, at: Any) -> AimRows:
        """AimRows of which the greatest is to be least."""


class Bound(Protocol):
    """Interface of a constraint, such as `Limit`."""

    @property
    def equal(self) -> bool:
        """Whether its rows are to be zero, not only not negative."""

    def rows(self, at: Any) -> AimRows:
        """Residuals with derivatives, not negative where the constraint holds."""

    def margin(self, at: Any) -> float:
        """By how much it holds."""


@dataclass(frozen=True)
class SearchResult:
    """The end of a search.

    `at`: Evaluation, or another design with derivatives
    `value`: What is least, with the sign that makes it so.
    `broken`: How much the worst limit is broken, as a part of its size.
    `begun`: The value where it began.
    """

    at: Any
    value: float
    broken: float
    begun: float = math.nan


@dataclass(frozen=True)
class Ending:
    """What searches from several starts found.

    `best`: Of those that keep the limits.
    `starts`: Searches that ended.
    `alike`: Those of them that ended at its value.
    """

    best: SearchResult
    starts: int
    alike: tuple[SearchResult, ...]

    @property
    def agreeing(self) -> int:
        """How many ended at the best value."""
        return len(self.alike)


def ending(
    ends: Sequence[SearchResult], holds: float, same: float, checks: Sequence[SearchResult] = ()
) -> Ending | None:
    """The best of the ends of searches, and of places that check them; None where none keeps the
    limits, by the part `holds`.

    `same`: The part of the best value by which others differ that are one with it; of a value to
    which something is added whatever the numbers are, of what half of the starts were worse by.
    """
    good = [one for one in (*ends, *checks) if one.broken <= holds]
    if not good:
        return None
    best = min(good, key=lambda one: one.value)
    begun = [one.begun for one in ends] + [one.value for one in checks]
    worse = sorted(abs(value - best.value) for value in begun)[(len(begun) - 1) // 2]
    near = max(
        same * min(abs(best.value), worse),
        tol.OPTIMUM_GAIN_LAST * worse,
        tol.QUANTITY_ROUNDING * abs(best.value),
    )
    alike = (one for one in ends if one.broken <= holds and one.value <= best.value + near)
    return Ending(best, len(ends), tuple(alike))


@dataclass(frozen=True)
class Binding:
    """One thing that binds.

    `limit`: Number of the limit; -1 of a bound, -2 of mobility.
    `number`, `upper`: Of a bound: which number, and whether it is the upper one.
    `multiplier`: In units of the objective by units of the limit.
    `instant`: Where it binds most; -1 where that is no instant.
    """

    limit: int
    multiplier: float
    instant: int = -1
    number: int = -1
    upper: bool = False


class Program:
    """A minimization within limits and bounds, for searches from many starts. `low`, `high`
    (numbers,).
    """

    def __init__(
        self,
        evaluator: Callable[[np.ndarray], Any],
        bounds: tuple[np.ndarray, np.ndarray],
        aim: Goal,
        limits: Sequence[Bound],
        mark: Callable[[], None] = lambda: None,
    ) -> None:
        self.evaluator, self.aim, self.mark = evaluator, aim, mark
        self.limits: list[Any] = list(limits)
        self.low, self.high = bounds
        self.width = self.high - self.low
        self.sizes: list[float] | None = None
        self.scale, self.span, self.mobile = 1.0, 1.0, 0.0
        #: By how much the objective would change over the ranges, at the steepest of all starts.
        self.steepest = 0.0
        self._last_x = np.empty(0)
        self._last_evaluation: Any | None = None

    # -- sizes ----------------------------------------------------------------------------------

    def measure_by(self, at: Any) -> None:
        """Take the sizes of everything from one design: of the objective its change over the ranges
        too, without which steps of one that is nearly flat are too short.
        """
        self.sizes = [_size(limit.rows(at)) for limit in self.limits]
        rows = self.aim.rows(at).values
        self.scale = float(np.abs(rows).max()) or 1.0
        self.span = max(self._change(at), tol.OPTIMUM_FLATTEST * self.scale)
        self.mobile = at.mobility()[0] / FASTEST**2

    def _change(self, at: Any) -> float:
        """By how much the objective would change over a range, by its greatest derivative."""
        return float(np.abs(self.aim.rows(at).derivatives * self.width).max(initial=0.0))

    def broken(self, at: Any) -> float:
        """Violation of the worst limit, as a part of its size; 0 where all hold."""
        assert self.sizes is not None
        parts = [limit.margin(at) / s for limit, s in zip(self.limits, self.sizes, strict=True)]
        return max(0.0, -min(parts, default=0.0))

    def limit_rows(self, at: Any) -> list[AimRows]:
        """Rows of the limits as parts of their sizes."""
        limits = zip(self.limits, self.sizes or [], strict=True)
        return [limit.rows(at).times(1.0 / size) for limit, size in limits]

    def value(self, at: Any) -> float:
        """Objective, with the sign that makes it a minimum."""
        return float(self.aim.rows(at).values.max())

    # -- the search -----------------------------------------------------------------------------

    def at(self, x: np.ndarray) -> Any:
        """A design with derivatives, the last one kept."""
        if not np.array_equal(x, self._last_x):
            self.mark()
            self._last_x, self._last_evaluation = (
                x.copy(),
                self.evaluator(np.clip(x, self.low, self.high)),
            )
        return self._last_evaluation

    def _bounded(self, u: np.ndarray) -> np.ndarray:
        """The numbers at a place in their ranges; what is at a bound to rounding is there."""
        x = np.where(u <= tol.BOUND_AT, self.low, self.low + self.width * u)
        return np.where(u >= 1.0 - tol.BOUND_AT, self.high, x)

    def search(self, x: np.ndarray) -> SearchResult | None:
        """The end of a search from a design; None where that cannot be analysed."""
        at = self.at(x)
        if at is None:
            return None
        if self.sizes is None:
            self.measure_by(at)
        self.steepest = max(self.steepest, self._change(at))
        best = begun = self._result(at)
        chosen, stalled = _Chosen(self, at), 0
        for _ in range(ROUNDS):
            end = self._round(at, chosen)
            if end is None:
                break
            found, at = self._result(end), end
            more = chosen.add(end)
            gain = best.value - found.value if found.broken <= tol.LIMIT_HOLDS else 0.0
            if _better(found, best):
                stalled = (
                    0
                    if gain > tol.OPTIMUM_GAIN_LAST * self.scale or best.broken > tol.LIMIT_HOLDS
                    else stalled + 1
                )
                best = found
            else:
                stalled += 1
            if (not more and gain <= tol.OPTIMUM_GAIN_SLIGHT * abs(best.value)) or stalled > 1:
                break
        return replace(self._polished(best), begun=begun.value)

    def _polished(self, best: SearchResult) -> SearchResult:
        """The end of linear steps with all rows, where it is better."""
        found = [best]

        def look(u: np.ndarray) -> Linearized | None:
            at = self.at(self._bounded(u))
            if at is None:
                return None
            found.append(self._result(at))
            return self._linearized(u, at)

        linear_steps(self._linearized((best.at.x - self.low) / self.width, best.at), look)
        for one in found[1:]:
            if _better(one, best):
                best = one
        return best

    def _linearized(self, u: np.ndarray, at: Any) -> Linearized:
        """All rows about a design."""
        aims = self.aim.rows(at).times(1.0 / self.scale)
        own: dict[bool, list[AimRows]] = {True: [], False: []}
        for limit, rows_of_limit in zip(self.limits, self.limit_rows(at), strict=True):
            own[limit.equal].append(rows_of_limit)
        least, derivative, k = at.mobility()
        margin = np.log(least / max(self.mobile, tol.TINY))
        own[False].append(
            AimRows(np.array([margin]), derivative[None] / max(least, tol.TINY), np.array([k]))
        )
        empty = np.zeros((0, len(u)))
        values = {
            kind: np.concatenate([np.zeros(0), *(r.values for r in rows)])
            for kind, rows in own.items()
        }
        derivatives = {
            kind: np.vstack([empty, *(r.derivatives * self.width for r in rows)])
            for kind, rows in own.items()
        }
        return Linearized(
            u=u,
            aims=aims.values,
            by_aims=aims.derivatives * self.width,
            limits=values[False],
            by_limits=derivatives[False],
            equal=values[True],
            by_equal=derivatives[True],
        )

    def _result(self, at: Any) -> SearchResult:
        return SearchResult(at, self.value(at), self.broken(at))

    # -- what is said of its end ----------------------------------------------------------------

    def optimality(self, at: Any) -> tuple[list[Binding], float]:
        """What binds at a design, by Karush's, Kuhn's and Tucker's conditions: the derivatives of
        the objective as those of the binding rows, with multipliers that are not negative
        (non-negative least squares; Lawson and Hanson 1974). Also what is left of the derivatives,
        as a part of the greatest, or of that of the starts where all are small.
        """
        found = []
        for tolerance in tol.LIMIT_BINDS:
            found.append(self._optimality(at, tolerance))
            if found[-1][1] <= tol.LIMIT_BALANCED:
                break
        return min(found, key=lambda pair: pair[1])

    def _optimality(self, at: Any, tolerance: float) -> tuple[list[Binding], float]:
        """The same with what is nearer to its limit than a part `tolerance` of its size."""
        width = self.width
        # effect, limit with number and side of a bound, instant, unit of the multiplier
        near: list[tuple[np.ndarray, tuple[int, int, bool], int, float]] = []
        limits = zip(self.limits, self.limit_rows(at), self.sizes or [], strict=True)
        for n, (limit, rows, size) in enumerate(limits):
            left = np.abs(rows.values) if limit.equal else rows.values
            for k in np.flatnonzero(left <= tolerance):
                effect, instant = rows.derivatives[k] * width, int(rows.instants[k])
                for sign in (1.0, -1.0) if limit.equal else (1.0,):
                    near.append((sign * effect, (n, -1, False), instant, sign * self.scale / size))
        own, derivative, instant = at.mobility()
        if own < self.mobile * (1.0 + tolerance):
            effect = derivative * width / self.mobile
            near.append((effect, (-2, -1, False), instant, self.scale / self.mobile))
        for j, one in enumerate(np.eye(len(width))):
            for upper, gap in ((False, at.x[j] - self.low[j]), (True, self.high[j] - at.x[j])):
                if gap <= tolerance * 1e-2 * width[j]:
                    effect = -one if upper else one
                    near.append((effect, (-1, j, upper), -1, self.scale / width[j]))
        rows = self.aim.rows(at)
        # what is added whatever the numbers are has no say in what is near the greatest
        part = tolerance * min(self.scale, max(self.span, self.steepest))
        top = rows.derivatives[rows.values >= rows.values.max() - part] * width / self.scale
        # weights of the instants that share the greatest value: their sum is 1
        heavy = 1e3 * max(1.0, float(np.abs(top).max(initial=0.0)))
        effects = np.array([*-top, *(one[0] for one in near)])
        sums = heavy * (np.arange(len(effects)) < len(top))
        found = nonnegative(np.vstack([effects.T, sums]), np.append(np.zeros(len(width)), heavy))
        flat = tol.OPTIMUM_FLAT * self.steepest / self.scale
        greatest = max(float(np.abs(top).max(initial=0.0)), flat, tol.TINY)
        pulls: dict[tuple[int, int, bool], list[tuple[float, int, float]]] = {}
        for pull, (_, key, instant, unit) in zip(found[len(top) :].tolist(), near, strict=True):
            if pull > tol.OPTIMUM_MULTIPLIER_COUNTS * greatest:
                pulls.setdefault(key, []).append((pull, instant, pull * unit))
        made = [
            Binding(limit, sum(one[2] for one in own), max(own)[1], number, upper)
            for (limit, number, upper), own in sorted(
                pulls.items(), key=lambda one: -max(one[1])[0]
            )
        ]
        return made, float(np.abs(found @ effects).max(initial=0.0)) / greatest

    # -- a round --------------------------------------------------------------------------------

    def _round(self, start: Any, chosen: _Chosen) -> Any:
        """One search with the rows that are chosen."""
        from scipy.optimize import minimize

        n, each = len(self.width), self.aim.each
        squared = self.aim.squared
        size = abs(self.value(start)) or self.scale
        last = [start]

        def design(y: np.ndarray) -> tuple[Any, bool]:
            at = self.at(self.low + self.width * np.clip(y[:n], 0.0, 1.0))
            if at is not None:
                last[0] = at
            return last[0], at is not None

        def value(y: np.ndarray) -> float:
            at, good = design(y)
            if each:
                return float(y[n]) + (0.0 if good else WALL)
            own = float(self.aim.rows(at).values[0]) / self.span
            return own * (own * self.span / size if squared else 1.0) + (0.0 if good else WALL)

        def derivative(y: np.ndarray) -> np.ndarray:
            if each:
                return np.eye(n + 1)[n]
            at, _ = design(y)
            rows = self.aim.rows(at)
            factor = 2.0 * rows.values[0] / size if squared else 1.0
            return np.asarray(factor * rows.derivatives[0] * self.width / self.span)

        def rows(y: np.ndarray) -> np.ndarray:
            at, good = design(y)
            found = chosen.values(at, y[n] if each else None)
            return found if good else found - WALL

        def derivatives(y: np.ndarray) -> np.ndarray:
            at, _ = design(y)
            return chosen.derivatives(at, each)

        first = (start.x - self.low) / self.width
        bounds: list[tuple[float | None, float | None]] = [(0.0, 1.0)] * n
        if each:
            first = np.append(first, self.value(start) / self.span)
            bounds.append((None, None))
        equal = chosen.equal()
        conditions = [
            {
                "type": kind,
                "fun": lambda y, own=own: rows(y)[own],
                "jac": lambda y, own=own: derivatives(y)[own],
            }
            for kind, own in (("eq", equal), ("ineq", ~equal))
            if own.any()
        ]
        with np.errstate(all="ignore"):
            found = minimize(
                value,
                first,
                jac=derivative,
                bounds=bounds,
                constraints=conditions,
                method="SLSQP",
                options={"maxiter": ITERATIONS, "ftol": tol.OPTIMUM_ENDS},
            )
        if not np.isfinite(found.x).all():
            return None
        return self.at(self._bounded(found.x[:n]))


class _Chosen:
    """The rows of every limit that a search looks at; the last group is what is minimised."""

    def __init__(self, program: Program, at: Any) -> None:
        self.program = program
        self.picked: list[np.ndarray] = []
        for rows in self._all(at):
            count = len(rows.values)
            some = np.unique(np.linspace(0, count - 1, min(count, ROWS)).astype(int))
            self.picked.append(np.union1d(some, _lowest(rows.values)))

    def _all(self, at: Any) -> list[AimRows]:
        """All limits as parts of their sizes, then the rows that z is to be above, negative."""
        program = self.program
        found = program.limit_rows(at)
        if program.aim.each:
            found.append(program.aim.rows(at).times(-1.0 / program.span))
        return found

    def add(self, at: Any) -> bool:
        """Add the rows that are worse than all that were looked at; whether there are any."""
        more = False
        for n, rows in enumerate(self._all(at)):
            own = rows.values
            floor = own[self.picked[n]].min()
            if n < len(self.program.limits):
                floor = min(floor, 0.0)
            new = [k for k in _lowest(own) if own[k] < floor - tol.LIMIT_HOLDS]
            if new:
                self.picked[n] = np.union1d(self.picked[n], new)
                more = True
        return more

    def equal(self) -> np.ndarray:
        """Which of all rows are to be zero."""
        limits = self.program.limits
        parts = [
            np.full(len(own), n < len(limits) and limits[n].equal)
            for n, own in enumerate(self.picked)
        ]
        return np.concatenate([*parts, [False]])

    def values(self, at: Any, z: float | None) -> np.ndarray:
        """The rows that are picked, none to be negative; the last one is mobility."""
        found = [rows.values[own] for rows, own in zip(self._all(at), self.picked, strict=True)]
        if z is not None:
            found[-1] = found[-1] + z
        own = at.mobility()[0]
        return np.concatenate([*found, [np.log(own / max(self.program.mobile, tol.TINY))]])

    def derivatives(self, at: Any, with_z: bool) -> np.ndarray:
        """Their derivatives by the numbers, each as a part of its range, and by z."""
        found = [
            rows.derivatives[own] for rows, own in zip(self._all(at), self.picked, strict=True)
        ]
        own, derivative, _ = at.mobility()
        whole = np.vstack([*found, derivative[None] / max(own, tol.TINY)]) * self.program.width
        if not with_z:
            return whole
        by_z = np.zeros(len(whole))
        by_z[len(whole) - 1 - len(found[-1]) : -1] = 1.0
        return np.column_stack([whole, by_z])


def _lowest(values: np.ndarray) -> np.ndarray:
    """Places at which a row is lower than both neighbours, and the lowest of all."""
    if len(values) < 3:
        return np.arange(len(values))
    inner = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:])) + 1
    order = inner[np.argsort(values[inner])][:12]
    return np.union1d(order, [int(values.argmin())])


def _size(rows: AimRows) -> float:
    """Scale of the rows of a limit."""
    return max(float(np.abs(rows.values).max(initial=0.0)), tol.TINY)


def _better(one: SearchResult, other: SearchResult) -> bool:
    """Whether an end is better than another: limits first."""
    if one.broken > tol.LIMIT_HOLDS or other.broken > tol.LIMIT_HOLDS:
        return one.broken < other.broken
    return one.value < other.value


# -- Searches from several starts: the description, then the best of a Latin hypercube ---------

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
    low, high = np.array([_bounds(system, g, n, by[g]) for g, n in names.items()]).T
    if start is not None and not isinstance(start, Mapping):
        raise ModelError(f"optimize: start must be a dict of numbers, not {brief(start)}")
    strange = [name for name in start or {} if name not in by]
    if strange:
        raise ModelError(
            f"optimize: start has {brief(strange[0])}, which by does not vary (it varies: "
            f"{listed(by)})",
            str(strange[0]),
        )
    first, notes, machine = [], [], system.mechanism
    for n, (given, name) in enumerate(names.items()):
        own = float(system.values[name])
        if start is not None and given in start:
            dimension, scope = dimension_named(machine, name), machine.parameters.scope()
            own = value_given(start[given], dimension, scope, "optimize", given)
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
    machine = system.mechanism
    dimension, scope = dimension_named(machine, name), machine.parameters.scope()
    low, high = range_given(pair, dimension, scope, "optimize", given)
    sign, _ = system.rule(name)
    if sign and (low < 0.0 or (sign == "positive" and low == 0.0)):
        raise ModelError(
            f"optimize: '{given}' goes from {low:g} {unit_of(machine, name)}".rstrip()
            + f", it must {'be positive' if sign == 'positive' else 'not be negative'}: give a "
            "greater lowest value",
            given,
        )
    return low, high


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


#: Designs of the hypercube for each number and each search, and the least number of them.
EACH, LEAST = 24, 256
#: Starts are apart by this part of the ranges, where there are enough.
START_SPACING = 0.15


@dataclass(frozen=True)
class SearchEnding(Ending):
    """Result of the searches from all starts."""

    program: Program
    notes: tuple[str, ...]


@dataclass
class MultiStart:
    """Searches of designs of one system within ranges, `starts` for each aim; `seed`: Of starts."""

    evaluator: Evaluator | MotionEvaluator
    screen: Screen
    ranges: Ranges
    starts: int
    seed: int
    searches: Searches
    spread: np.ndarray | None = None
    merits: tuple[np.ndarray, np.ndarray] | None = field(default=None)

    def program(self, aim: Aim, limits: Sequence[Limit]) -> Program:
        """Nonlinear program of an objective within limits and ranges."""
        bounds = self.ranges.low, self.ranges.high
        return Program(self.evaluator, bounds, aim, limits, self.searches.mark)

    def ended(self, aim: Aim, limits: Sequence[Limit]) -> SearchEnding:
        """The best of all searches."""
        program, notes = self.program(aim, limits), list(self.ranges.notes)
        starts = self.chosen(aim)
        program.measure_by(program.at(starts[0]))
        notes += self._examined(program, aim, limits, starts)
        if len(starts) < self.starts:
            notes.append(
                f"only {len(starts)} of {self.starts} searches could begin: no other design that "
                "was tried can be analysed"
            )
        found = list(self.searches.ends(starts, program.search))
        ended = ending(found, tol.LIMIT_HOLDS, tol.OPTIMUM_VALUES_AGREE)
        if ended is None:
            raise self._none(min(found, key=lambda one: one.broken), limits)
        return SearchEnding(**vars(ended), program=program, notes=tuple(notes))

    def chosen(self, aim: Aim) -> list[np.ndarray]:
        """Starts of the searches: the one that was given, then the best of many that are apart."""
        ranges = self.ranges
        if self.spread is None or self.merits is None:
            many = max(LEAST, EACH * len(ranges.names), 4 * self.starts)
            if not self.screen.by_lanes:
                many = 4 * self.starts  # one by one
            parts = latin(many, len(ranges.names), self.seed)
            self.spread = ranges.low + (ranges.high - ranges.low) * parts
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
                if len(chosen) < self.starts and min(distances, default=1.0) > spacing:
                    chosen.append(x)
        begun = [x for x in chosen if self.evaluator(x) is not None]
        if not begun:
            raise self._unreachable(len(values))
        return begun[: self.starts]

    def _examined(
        self, program: Program, aim: Aim, limits: Sequence[Limit], starts: Sequence[np.ndarray]
    ) -> list[str]:
        """Refuse an aim that no number changes; sentences for limits that none changes, and for
        numbers that change nothing.
        """
        points = [at for at in map(self.evaluator, starts[:3]) if at is not None]
        names, system = list(self.ranges.names), self.evaluator.system

        def movers(one: Any) -> np.ndarray:  # which of the numbers change an aim or a limit
            rows = [one.rows(at) for at in points]
            each = [influential(system, names, own.values, own.derivatives) for own in rows]
            return np.any(each, axis=0)

        if not movers(aim).any():
            given = ", ".join(f"'{name}'" for name in self.ranges.given)
            raise ModelError(
                f"optimize: none of {given} changes '{aim.text}': its derivatives are zero; vary "
                "other numbers, or choose another aim"
            )
        by_limits = [movers(limit) for limit in limits]
        used = np.any([*map(movers, self.screen.aims), *by_limits], axis=0)
        notes = [
            f"none of the numbers changes '{limit.text}'"
            for limit, own in zip(limits, by_limits, strict=True)
            if not own.any()
        ]
        return notes + [
            f"'{name}' changes neither the aim nor a limit where searches began: that its "
            "value is best is not shown"
            for name, own in zip(self.ranges.given, used, strict=True)
            if not own
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
    sizes = np.maximum(np.median(np.abs(margins[places]), axis=0), tol.TINY) if len(places) else 1.0
    broken = np.maximum(0.0, -margins[places] / sizes).sum(axis=1)
    return places[np.lexsort((values[places], np.where(broken > 0.0, broken, 0.0)))]
