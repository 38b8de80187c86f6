"""The verb `optimize`: the numbers of a mechanism at which a quantity is least or greatest."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import ANALYSES, revolving_driver
from mbody.analysis.dynamics.interruptions import counted
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.core.bracket import zeros_between
from mbody.core.presentation import Presented
from mbody.core.searches import Searches
from mbody.core.tolerances import OPTIMUM_MARGIN_NONE
from mbody.errors import ModelError, brief
from mbody.files.model.other_units import described_with, file_unit, same_number
from mbody.files.model.study_tables import optimization_tasks
from mbody.model.element import listed, takes_one_design, whole_number
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import OptimizationTask
from mbody.optimization.design_evaluation import (
    Aim,
    AimRows,
    Evaluation,
    Evaluator,
    Limit,
    MotionEvaluator,
    aim_of,
    limit_of,
)
from mbody.optimization.nonlinear_program import (
    FASTEST,
    Binding,
    MultiStart,
    Program,
    Ranges,
    Screen,
    SearchEnding,
    ending,
    ranges_of,
)
from mbody.quantities.formula import Number
from mbody.solution.declared_result import ColumnTable, ItemTable, Sentence, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import link_poses
from mbody.solution.measures import measured
from mbody.solution.solution import Solution
from mbody.summaries.text_table import number
from mbody.sweeps.job import MeasuredColumn, prepared
from mbody.system.assembler import assemble
from mbody.system.system import System

# -- The best design that was found, and how much it can be trusted and moved ------------------

# -- A mechanism with the numbers of a design, as a model file would have them -----------------

#: Digits of a guess, which only chooses the branch.
GUESS_DIGITS = 4


def _described(run: Solution, values: Mapping[str, float]) -> Mechanism:
    """The mechanism of a result with other numbers, guesses at its first position."""
    poses = link_poses(run.take([0]))
    size = max((abs(part) for x, y, _ in poses.values() for part in (x, y)), default=0.0)
    guesses = {
        name: (_rough(x, size), _rough(y, size), math.radians(_rough(math.degrees(angle), 360.0)))
        for name, (x, y, angle) in poses.items()
    }
    return described_with(run.mechanism, {**_overridden(run), **values}, guesses)


def _rough(value: float, size: float) -> float:
    """A number of a guess to a few digits, by the greatest of its kind.

    >>> _rough(0.123456789, 20.0), _rough(1e-17, 20.0)
    (0.12, 0.0)
    """
    return round(value, GUESS_DIGITS - math.ceil(math.log10(size))) + 0.0 if size else value


def _overridden(run: Solution) -> dict[str, float]:
    """Numbers of the system of a result that its description does not have, formulas aside."""
    system, described = run.system, assemble(run.mechanism).values
    own = {name: float(value) for name, value in system.values.items() if name in described}
    return {
        name: value
        for name, value in own.items()
        if name not in system.formulas and not same_number(described[name], value)
    }


@dataclass(frozen=True)
class Active(Presented):
    """A limit, or a bound of a number, that holds the optimum back.

    `constraint`: Its text.
    `multiplier`: By how much the objective gets better if the limit gives way by one unit, at first
      order.
    `unit`: Of the multiplier.
    `t`: The instant at which it binds; None of bounds and of what all instants make.
    """

    constraint: str
    multiplier: float
    unit: str
    t: float | None


@dataclass(frozen=True)
class ParetoPoint(Presented):
    """One of the designs of which none is better in both aims.

    `values`: By number.
    """

    objective: tuple[float, ...]
    values: dict[str, float]


def _aim(n: int) -> Callable[[ParetoPoint], float]:
    return lambda one: one.objective[n]


def _aims(found: Optimum) -> list[str]:
    """The objectives, before and after."""
    several = isinstance(found.objective, tuple)
    values = found.objective if several else (found.objective,)
    before: Any = found.start_objective if several else (found.start_objective,)
    if found.start_objective is None:
        before = (None,) * len(values)
    return [
        f"{aim} = {number(value)} {unit}".rstrip()
        + (f", before {number(old)}" if old is not None else "")
        for (aim, unit), value, old in zip(found.aims, values, before, strict=True)
    ]


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(Inherited, Presented):
    """Result of `mbody.optimize`.

    `aim`: What is least or greatest, in words.
    `aims` (str, str): The same of each aim, with its unit.
    `objective`, `start_objective`: Its value at the optimum and of the description; None where that
      cannot be analysed. Of two aims tuples.
    `values`, `start_values`: The numbers by name, in the units of the mechanism, angles in rad.
    `units`: Their units; ``"objective"`` has that of the objective, of two aims both, with a comma.
    `bounds`: By number its lowest and greatest value.
    `constraints`: By text the margin with which each limit holds.
    `active`: What binds, with multipliers.
    `starts`, `agreeing`: Searches that ended, and those that ended at this value.
    `evaluations`: Analyses with derivatives.
    `band`: By number from where to where it may go alone, the others held, while the objective gets
      no worse than by the part `loss` of its size and no limit is broken by more than that part.
    `written`: The numbers with the digits that matter, as `save` writes them: with them the limits
      hold as at the optimum, and the objective gets worse by a small part of `loss` at most.
    `pareto`: Of two aims, by the first one; otherwise empty.
    `run`: The analysis of the optimum.
    `case`: Its name, where there are several.
    """

    aim: str
    aims: tuple[tuple[str, str], ...]
    objective: Any
    start_objective: Any
    values: dict[str, float]
    start_values: dict[str, float]
    units: dict[str, str]
    bounds: dict[str, tuple[float, float]]
    constraints: dict[str, float]
    active: tuple[Active, ...]
    starts: int
    agreeing: int
    evaluations: int
    band: dict[str, tuple[float, float]]
    loss: float
    pareto: tuple[ParetoPoint, ...]
    run: Solution
    case: str = ""
    written: dict[str, float] = field(default_factory=dict)
    _cache: dict[str, Mechanism] = field(default_factory=dict)

    about_text = "{0.case}"

    @property
    def declared(self) -> tuple[Any, ...]:
        """Aims, numbers, limits, what binds, and the front."""
        front = [
            Value("", f"{aim} [{unit}]" if unit else aim, "each", _aim(n))
            for n, (aim, unit) in enumerate(self.aims)
        ]
        return (
            "aim objective start_objective units",
            Sentence(_aims),
            ColumnTable(
                (
                    Value("", "before", "each", "start_values"),
                    Value("values", "optimum", "each"),
                    Value("", "unit", "text", "units"),
                    Value("", f"band from ({self.loss:.3g})", "each", lambda one: one.band_ends(0)),
                    Value("", "to", "each", lambda one: one.band_ends(1)),
                ),
                "NUMBERS",
            ),
            ColumnTable(
                (Value("constraints", "margin", "each", floor=OPTIMUM_MARGIN_NONE),), "LIMITS"
            ),
            ItemTable(
                "active",
                (
                    Value("constraint", "BINDS", "text"),
                    Value("multiplier", "per unit", "each"),
                    Value("unit", "unit", "text"),
                    Value("t", "at t", "time"),
                ),
            ),
            "starts agreeing evaluations band loss pareto",
            ItemTable("", tuple(front), "FRONT", lambda one: dict(enumerate(one.pareto))),
            Sentence(
                lambda one: (
                    f"{one.agreeing} of {one.starts} searches ended at "
                    + ("the ends of the front" if one.pareto else "this value")
                    + f"; {one.evaluations} analyses with derivatives"
                )
            ),
            "status notes",
        )

    def band_ends(self, end: int) -> dict[str, float]:
        """Lower (0) or upper (1) ends of the bands."""
        return {name: pair[end] for name, pair in self.band.items()}

    def __post_init__(self) -> None:
        kept = self._cache
        super().__post_init__()
        object.__setattr__(self, "_cache", kept)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism with the numbers of the optimum, guesses at its first position.

        Raises
        ------
        ModelError
            Where no model file can have such a mechanism; `run.system` is the optimum all the same.
        """
        if "whole" not in self._cache:
            self._cache["whole"] = _described(self.run, self.values)
        return self._cache["whole"]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism as a model file, with the numbers of `written`: of a model that was
        read from TOML all else stays as it was, comments, order and units.
        """
        from mbody.files.model import save

        save(_described(self.run, self.written or self.values), path)

    def __repr__(self) -> str:
        return f"Optimum({self.aim}: {self.objective}, {self.agreeing} of {self.starts} starts)"


# -- Range of each number of an optimum with the others held -----------------------------------

#: Places on the way to a bound, and halvings between two of them.
PLACES, HALVINGS = 24, 20


def tolerance_band(
    screen: Screen,
    x: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    sizes: np.ndarray,
    loss: float,
) -> np.ndarray:
    """From where to where each number may go while the others are held: (numbers, 2). `x`
    (numbers,), `sizes` (aims + limits,).

    Places between the optimum and each bound are judged, denser near the optimum; the first one
    that is too bad is then approached by halving. All numbers go side by side.
    """
    n, aims = len(x), len(screen.aims)
    ends = np.concatenate([bounds[0], bounds[1]])
    who = np.tile(np.arange(n), 2)
    values, margins = screen.evaluate(x[None])
    if not np.isfinite(values).all():
        return np.column_stack([x, x])
    worst = values[0] + loss * sizes[:aims]
    least = np.minimum(margins[0], 0.0) - loss * sizes[aims:]

    def good(parts: np.ndarray) -> np.ndarray:
        """Whether designs so far on their paths, (2 numbers, places), are good enough."""
        designs = np.tile(x, (parts.size, 1))
        own = np.repeat(who, parts.shape[1])
        steps = (ends - x[who])[:, None] * parts
        designs[np.arange(parts.size), own] += steps.reshape(-1)
        values, margins = screen.evaluate(designs)
        with np.errstate(invalid="ignore"):
            fine = (values <= worst).all(axis=1) & (margins >= least).all(axis=1)
        return np.asarray(fine.reshape(parts.shape))

    places = np.linspace(0.0, 1.0, PLACES + 1)[1:] ** 3
    fine = good(np.tile(places, (2 * n, 1)))
    first = np.where(fine.all(axis=1), PLACES, (~fine).argmax(axis=1))
    known = np.append(0.0, places)
    low, high = known[first], known[np.minimum(first + 1, PLACES)]
    signs, width = np.ones(2 * n), (high - low) * 0.5**HALVINGS
    brackets = zeros_between(
        lambda parts: 2.0 * good(parts[:, None])[:, 0] - 1.0, low, high, signs, -signs, width
    )
    found = x[who] + np.array([one.above for one in brackets]) * (ends - x[who])
    return np.column_stack([found[:n], found[n:]])


#: A rounded design may be worse by this part of what the band may lose; decades of digits that are
#: tried, and numbers of which every one is rounded both ways.
ROUNDED, DECADES, BOTH_WAYS = 0.05, 8, 4


def rounded_design(
    screen: Screen,
    x: np.ndarray,
    band: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    units: np.ndarray,
    most: np.ndarray,
) -> np.ndarray:
    """The design of fewest digits that keeps the limits as x (numbers,) does and is hardly worse.

    `band` (numbers, 2): From where to where each may go alone. `units` (numbers,): Of the digits,
    in units of the numbers. `most` (aims,): What the band may lose of the aims.
    """
    n = len(x)
    values, margins = screen.evaluate(x[None])
    width = (band[:, 1] - band[:, 0]) / units
    if not np.isfinite(values).all():
        return x
    wide = np.where(width > 0.0, width, np.abs(x / units))
    first = np.floor(np.log10(np.where(wide > 0.0, wide, 1.0) / 10.0))
    up = (band[:, 1] - x) > (x - band[:, 0])
    #: Of each number whether it is rounded up; first to the nearest, then away from what binds.
    ways = [up, *itertools.product((False, True), repeat=n)] if n <= BOTH_WAYS else [up]
    for decade in range(DECADES):
        step = 10.0 ** (first - decade)
        part = x / units / step
        whole = [np.rint(part), *(np.where(way, np.ceil(part), np.floor(part)) for way in ways)]
        designs = np.array(whole) * step * units
        found = np.clip(designs, *bounds)
        theirs, left = screen.evaluate(found)
        with np.errstate(invalid="ignore"):
            good = (theirs <= values + ROUNDED * most).all(axis=1)
            good &= (left >= np.minimum(margins, 0.0)).all(axis=1)
        if good.any():
            return np.asarray(found[int(np.argmax(good))])
    return x


# -- From the end of searches to what the user gets --------------------------------------------

MOBILE = "mobility: no body moves {} times as fast as in the description"


def optimum_of(
    search: MultiStart,
    ended: SearchEnding,
    aim: Aim,
    limits: Sequence[Limit],
    loss: float,
    front: tuple[ParetoPoint, ...] = (),
    aims: Sequence[Aim] = (),
) -> Optimum:
    """The result of searches; of two `aims` with their front."""
    at, program, ranges = ended.best.at, ended.program, search.ranges
    run = at.run
    found, residual = program.optimality(at)
    unit = measured(run, aim.column.measure)[2]
    active = tuple(_active(one, program, at, search, unit) for one in found)
    notes = list(ended.notes)
    if ended.starts > 1 and ended.agreeing == 1:
        notes.append(
            f"only one of {ended.starts} searches ended at this value, others at worse ones: more "
            "starts may find a better one"
        )
    if residual > tol.OPTIMUM_OPEN and not search.searches.stopped:
        notes.append(
            f"the search ended where the objective still falls by {residual:.1%} of its steepest "
            "slope: it is near a place without derivatives, or stopped early"
        )
    goals = list(aims) or [aim]
    starting = search.evaluator(search.evaluator.present())
    begin = None if starting is None else tuple(one.value(starting) for one in goals)
    values = tuple(one.value(at) for one in goals)
    sizes = np.array([abs(value) for value in values] + list(program.sizes or []))
    band = tolerance_band(search.screen.about(at), at.x, (ranges.low, ranges.high), sizes, loss)
    apart = [((one.at.x < band[:, 0]) | (one.at.x > band[:, 1])).any() for one in ended.alike]
    if any(apart) and not front and np.ptp(band, axis=1).any():
        notes.append(
            f"of {len(apart)} searches that ended at this value {sum(apart)} ended beyond the "
            "bands of these numbers: other designs are as good"
        )
    units_of_file = np.array([file_unit(run.mechanism, name) for name in ranges.given])
    written = rounded_design(
        search.screen.about(at),
        at.x,
        band,
        (ranges.low, ranges.high),
        units_of_file,
        loss * sizes[: len(goals)],
    )
    words = [f"{'greatest' if one.greatest else 'least'} {one.text}" for one in goals]
    theirs = [measured(run, one.column.measure)[2] for one in goals]
    columns = [one.column for one in goals]
    columns += [side for one in limits for side in (one.left, one.right)]
    own = inherited(run, of=columns, notes=tuple(notes))
    if search.searches.stopped and own["status"] == "completed":
        own["status"] = search.searches.stopped
    given = ranges.given
    return Optimum(
        aim=", ".join(words),
        aims=tuple(zip(words, theirs, strict=True)),
        objective=values if aims else values[0],
        start_objective=begin if aims or begin is None else begin[0],
        values=dict(zip(given, at.x.tolist(), strict=True)),
        start_values=dict(zip(given, search.evaluator.present().tolist(), strict=True)),
        units={**dict(zip(given, ranges.units, strict=True)), "objective": ", ".join(theirs)},
        bounds={
            name: (float(low), float(high))
            for name, low, high in zip(given, ranges.low, ranges.high, strict=True)
        },
        constraints={limit.text: limit.margin(at) for limit in limits},
        active=active,
        starts=ended.starts,
        agreeing=ended.agreeing,
        evaluations=search.evaluator.count,
        band={
            name: (float(low), float(high)) for name, (low, high) in zip(given, band, strict=True)
        },
        loss=loss,
        pareto=front,
        run=run,
        written=dict(zip(given, written.tolist(), strict=True)),
        **own,
    )


def _active(
    one: Binding, program: Program, at: Evaluation, search: MultiStart, unit: str
) -> Active:
    t = float(at.run.t[one.instant]) if one.instant >= 0 else None
    if one.limit == -2:
        return Active(MOBILE.format(f"{FASTEST:g}"), one.multiplier, unit, t)
    if one.limit == -1:
        ranges, sign = search.ranges, "<=" if one.upper else ">="
        own = ranges.units[one.number]
        bound = (ranges.high if one.upper else ranges.low)[one.number]
        text = f"{ranges.given[one.number]} {sign} {bound:.6g} {own}".rstrip()
        return Active(text, one.multiplier, _per(unit, own), None)
    limit = program.limits[one.limit]
    return Active(limit.text, one.multiplier, _per(unit, limit.unit), t)


def _per(unit: str, by: str) -> str:
    """Unit of a quotient."""
    if not by:
        return unit
    below = f"({by})" if any(letter in by for letter in "·/ ") else by
    return f"{unit or '1'}/{below}"


# -- Two aims: the designs of which none is better in both, by bounds of one aim (ε-constraints)


class _Bounded:
    """The limit that an aim stays below a value, with the sign that makes it least."""

    equal = False

    def __init__(self, aim: Aim, value: float, unit: str) -> None:
        self.aim, self.value, self.unit = aim, value, unit
        self.text = f"{aim.text} {'>=' if aim.greatest else '<='} {aim.sign * value:.6g} {unit}"

    def rows(self, at: Evaluation) -> AimRows:
        """By how much each instant stays below."""
        own = self.aim.rows(at)
        return AimRows(self.value - own.values, -own.derivatives, own.instants)

    def margin(self, at: Evaluation) -> float:
        """By how much all do."""
        return float(self.rows(at).values.min())


def pareto_front(
    search: MultiStart, aims: Sequence[Aim], limits: Sequence[Limit], points: int, loss: float
) -> Optimum:
    """The front from the best of the first aim to the best of the second, and of its designs the
    one that is nearest to the best of both, each aim by its range on the front.
    """
    first, second = aims
    ends = [search.ended(aim, limits) for aim in aims]
    values = np.array([[_least(aim, end.best.at) for aim in aims] for end in ends])
    scales = [end.program.scale for end in ends]
    found, low, high = list(ends), values[1, 1], values[0, 1]
    places = [one.best.at.x for one in ends]

    def bounded(value: float) -> SearchEnding | None:
        """The best of the first aim where the second is no worse than a value."""
        limit: Any = _Bounded(second, value, "")
        program = search.program(first, [*limits, limit])
        program.steepest = ends[0].program.steepest
        tried = [end for x in places if (end := program.search(x)) is not None]
        found = ending(tried, tol.LIMIT_HOLDS, tol.OPTIMUM_VALUES_AGREE)
        if found is None:
            return None
        places[0] = found.best.at.x
        return replace(ends[0], best=found.best, program=program)

    if high - low > tol.LIMIT_HOLDS * scales[1] and not search.searches.stopped:
        between = np.linspace(high, low, points)[1:-1].tolist()
        found += search.searches.ends(between, bounded)
    both = np.array([[_least(aim, one.best.at) for aim in aims] for one in found])
    kept = [n for n, own in enumerate(both) if not _beaten(own, both)]
    order = sorted(kept, key=lambda n: tuple(both[n]))
    span = np.maximum(np.ptp(both[order], axis=0), tol.TINY)
    distances = [float(np.hypot(*((both[n] - both[order].min(axis=0)) / span))) for n in order]
    knee = order[int(np.argmin(distances))]
    names = search.ranges.given
    front = tuple(
        ParetoPoint(
            tuple(aim.value(found[n].best.at) for aim in aims),
            dict(zip(names, found[n].best.at.x.tolist(), strict=True)),
        )
        for n in order
    )
    ended = replace(
        found[knee],
        starts=sum(end.starts for end in ends),
        alike=sum((end.alike for end in ends), ()),
    )
    return optimum_of(search, ended, first, limits, loss, front, aims)


def _least(aim: Aim, at: Evaluation) -> float:
    """An aim with the sign that makes it least."""
    return aim.sign * aim.value(at)


def _beaten(own: np.ndarray, every: np.ndarray) -> bool:
    """Whether another design is as good in both aims and better in one."""
    return bool(((every <= own).all(axis=1) & (every < own).any(axis=1)).any())


#: Options for the instants, and those of a motion over time.
INSTANTS = ("t", "drive", "turn", "instants", "turns", "guess", "at", "over")
MOTION = "simulate"
OF_MOTION = ("until", "method", "rtol", "atol", "step", "instants", "every", "times", "events")
#: Two aims as one, for the signature.
Objective = str | Sequence[str] | None


def optimize(
    model: Mechanism | System,
    task: str | OptimizationTask | None = None,
    /,
    *,
    minimize: Objective = None,
    maximize: Objective = None,
    by: Mapping[str, tuple[Number, Number]] | None = None,
    subject_to: str | Sequence[str] = (),
    analysis: str = "kinetostatics",
    start: Mapping[str, Number] | None = None,
    starts: int = 8,
    seed: int = 0,
    loss: float = 0.01,
    points: int = 9,
    progress: Callable[[int, int], None] | bool | None = None,
    **options: Any,
) -> Optimum:
    """The numbers of a mechanism at which a quantity is least, or greatest, within limits.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left, with its own numbers.
    task : str or OptimizationTask, optional
        A task of the mechanism by name, as [optimize.NAME] of its file; other arguments then have
        no meaning, except `progress`.
    minimize, maximize : str, or a list of two
        As of `sweep`: ``"peak(B.force)"``, ``"rms(motor.effort)"``. Of two aims the Pareto front is
        found: designs of which none is better in both.
    by : mapping
        Lowest and greatest value by number: floats in the units of the mechanism, angles in rad, or
        text with units.
    subject_to : str or list
        Limits on the whole cycle: ``"min(abs(sin(coupler.angle - rocker.angle))) >= 0.64"``,
        ``"peak(motor.effort) <= 20 N*m"``, ``"coupler.P.y >= 2 mm"`` (at all instants).
    analysis : str
        "kinetostatics", "kinematics", "statics", or "simulate" for a motion over time.
    start : mapping, optional
        By number where the first search begins, instead of the description.
    starts : int
        Searches; all but the first begin at the best of a Latin hypercube.
    seed : int
        Of the hypercube.
    loss : float
        The part of the objective that its tolerance band may cost.
    points : int
        Designs of a Pareto front.
    progress : callable or bool, optional
        Called with the number of finished searches and of all; True shows it on standard error.
    **options
        The instants: ``over="turn"``, ``at``, ``t``, ``drive``, ``turn``, ``turns``,
        ``instants``, ``guess``, as of `sweep`; by default those of the mechanism itself. Of a
        motion: ``until``, ``times``, ``instants``, ``every``, ``events``, ``method``, ``rtol``,
        ``atol``, ``step``, as of `simulate`.

    Returns
    -------
    Optimum
        Values, what binds with its multiplier, tolerance band, how many searches agree.

    Raises
    ------
    ModelError
        For names, bounds, limits or options that do not fit the mechanism; for a quantity that none
        of the numbers changes.
    SolveError
        Where no design within the bounds can be analysed; where none meets the limits, with the
        least that is missing.

    Notes
    -----
    Every search is sequential quadratic programming with exact derivatives; a greatest value over
    the cycle is minimised as a bound of all instants. Designs stay on the branch of the description
    and away from singular positions: nothing may move more than 50 times as fast, by the rate of
    the drivers, as in the design that a search is measured by. That the optimum is the best of all
    is not proved; `agreeing` says how many searches ended at it. After Ctrl-C the best design so
    far is returned, with a status "stopped: …".

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> found = mbody.optimize(
    ...     machine,
    ...     minimize="peak(motor.effort)",
    ...     by={"coupler.cg.x": (0.0, 3.0), "rocker.cg.x": (-1.0, 1.0)},
    ...     over="turn",
    ...     starts=2,
    ... )
    >>> found.objective < found.start_objective and found.agreeing == found.starts
    True
    """
    system = as_system(model)
    takes_one_design("optimize", system.batch)
    if task is not None:
        own = _task(system.mechanism, task)
        return optimize(system, progress=progress, **own.arguments())
    _check_options(analysis, options)
    aims = _aims_given(minimize, maximize)
    starts = whole_number("optimize: starts", starts, 1, 10_000)
    points = whole_number("optimize: points", points, 3, 10_000)
    ranges = ranges_of(system, by, start)
    machine, names = system.mechanism, list(ranges.names)
    motion = MotionEvaluator(system, names, options) if analysis == MOTION else None
    if motion is not None:
        count = motion.instants
    else:
        count = len(_job(system, ranges, (), analysis, options).instants)
    goals = [aim_of(machine, text, greatest, count) for text, greatest in aims]
    texts = [subject_to] if isinstance(subject_to, str) else list(subject_to)
    limits = [limit_of(machine, text, count) for text in texts]
    if motion is not None:
        screen = Screen(None, motion, goals, limits)
    else:
        job = _job(system, ranges, Screen.columns(goals, limits), analysis, options)
        revolving = revolving_driver(system, job.how.get("turn"))
        screen = Screen(job, Evaluator(job, names, revolving), goals, limits)
    seen = counted("searches") if progress is True else progress or None
    searches = Searches(starts * len(goals) + (len(goals) - 1) * (points - 2), seen)
    search = MultiStart(screen.evaluator, screen, ranges, starts, seed, searches)
    if len(goals) == 2:
        return pareto_front(search, goals, limits, points, loss)
    ended = search.ended(goals[0], limits)
    return optimum_of(search, ended, goals[0], limits, loss)


def _task(machine: Mechanism, task: str | OptimizationTask) -> OptimizationTask:
    if isinstance(task, OptimizationTask):
        return task
    tasks = optimization_tasks(machine)
    own = tasks.get(task) if isinstance(task, str) else None
    if own is None:
        known = listed(tasks) or "none"
        raise ModelError(
            f"'{machine.name}' has no optimization {brief(task)} (it has: {known})", str(task)
        )
    return own


def _aims_given(minimize: Objective, maximize: Objective) -> list[tuple[Any, bool]]:
    """Objectives with the choice of least or greatest: one, or two."""
    found: list[tuple[Any, bool]] = []
    for given, greatest in ((minimize, False), (maximize, True)):
        several = list(given) if isinstance(given, list | tuple) else [given]
        found += [(one, greatest) for one in several if one is not None]
    if not found:
        raise ModelError(
            'optimize: say what is to be least or greatest, such as minimize="peak(motor.effort)"'
        )
    if len(found) > 2:
        raise ModelError(
            f"optimize: there are {len(found)} aims: give one, or two for their Pareto front, and "
            "make limits of the others by subject_to"
        )
    return found


def _check_options(analysis: str, options: Mapping[str, Any]) -> None:
    known = [*ANALYSES, MOTION]
    if analysis not in known:
        raise ModelError(
            f"optimize: there is no analysis {brief(analysis)} with derivatives (there are: "
            f"{listed(known)})"
        )
    own = OF_MOTION if analysis == MOTION else INSTANTS
    for name in options:
        if name not in own:
            from mbody.core.other_words import meant

            close = meant(name, ("minimize", "maximize", *own), 0.8)
            hint = f": did you mean {close}=?" if close else f" (there are: {', '.join(own)})"
            raise ModelError(f"optimize: {analysis} has no option {name!r}{hint}")


def _job(
    system: System,
    ranges: Ranges,
    columns: tuple[MeasuredColumn, ...],
    analysis: str,
    options: Mapping[str, Any],
) -> Any:
    return prepared(system, tuple(ranges.names), columns, analysis, options)
