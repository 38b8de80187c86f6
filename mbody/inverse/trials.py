"""One instant analysed again and again with other values of some of its numbers."""

from __future__ import annotations

import contextlib
import copy
import functools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mbody.analysis.driven.driven import ANALYSES, analyse_at
from mbody.analysis.driven.path_following import PathEnded, Runner
from mbody.analysis.driven.time_grid import by_time
from mbody.analysis.dynamics.integrators import natural_size
from mbody.analysis.inverse.conditions import Relation, search_range
from mbody.analysis.position.assembly_analysis import check_determined, closed_near
from mbody.core import tolerances as tol
from mbody.core.bracket import zero_between
from mbody.core.lanes import DualNumber
from mbody.core.searches import halton
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.errors import ModelError, ModelWarning, SolveError
from mbody.laws import Polynomial
from mbody.model.driver import DRIVEN
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import snapshot, with_element
from mbody.model.numbers import moves_nothing, resolve_number
from mbody.model.simulation import Instants, Measure, Question, Unknown
from mbody.quantities import convert
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.solution.histories import Record, link_poses
from mbody.solution.measures import evaluate_measure, measured
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.rank import dense
from mbody.system.system import System, too_large

# -- Numbers that make rows zero: straight where rows are straight, by Newton's method where not
#
# `Residuals` are a function of an array of trials (trials, unknowns) that gives (residuals, size),
# each (trials, rows): the residual of every row and how large its terms are; NaN where a trial
# fails. They know their Jacobian at a place.

Array = np.ndarray

#: Places of a grid that are tried together.
STRIDE = 8


class SingularEquations(Exception):
    """The rows do not determine the unknowns: a direction that they leave open, and whether a
    solution exists at all.
    """

    def __init__(self, direction: Array, solvable: bool) -> None:
        super().__init__("singular")
        self.direction, self.solvable = direction, solvable


@dataclass(frozen=True)
class Affine:
    """rows(u) = residuals + jacobian (u − base), with the size of the terms of each row."""

    base: Array
    residuals: Array
    jacobian: Array
    size: Array

    def __call__(self, u: Array) -> Array:
        """Residual of every row at u: (rows,)."""
        return self.residuals + self.jacobian @ (u - self.base)

    def solve(self, rows: Sequence[int]) -> Array:
        """The unknowns that make rows zero, of several such ones the nearest to the base."""
        chosen = list(rows)
        if not chosen:
            return self.base
        size = np.maximum(self.size[chosen], tol.TINY)
        jacobian, residuals = self.jacobian[chosen] / size[:, None], self.residuals[chosen] / size
        u, s, vt = np.linalg.svd(jacobian)
        if s[-1] <= tol.UNKNOWN_OPEN * max(float(s[0]), tol.TINY):
            small = s <= tol.UNKNOWN_OPEN * max(float(s[0]), tol.TINY)
            raise SingularEquations(
                vt[-1], bool(np.abs(u[:, small].T @ residuals).max() < tol.ROW_HOLDS)
            )
        step: Array = -((u.T @ residuals) / s) @ vt[: len(s)]
        return self.base + step


class Residuals(Protocol):
    """Rows as functions of the unknowns."""

    def __call__(self, us: Array) -> tuple[Array, Array]:
        """Values and the size of their terms at places, (places, rows) each."""

    def about(self, u: Array) -> Affine | None:
        """All rows about a place; None where they have no values."""


def affine(rows: Residuals, start: Array) -> Affine | None:
    """The rows as straight functions of the unknowns; None where they are not straight."""
    n = len(start)
    odd = np.array([0.7 + 0.31 * k for k in range(n)]) * (-1.0) ** np.arange(n)
    probes = np.vstack([start, start + np.eye(n), start + odd, start - 900.0 * odd])
    residuals, size = rows(probes)
    if not np.isfinite(residuals).all():
        return None
    jacobian = (residuals[1 : n + 1] - residuals[0]).T
    guessed = residuals[0] + (probes - start) @ jacobian.T
    terms = size.max(axis=0) + np.abs(probes - start) @ np.abs(jacobian).T
    if (np.abs(residuals - guessed) > tol.ROW_HOLDS * terms).any():
        return None
    whole = size[: n + 1].max(axis=0) + np.abs(jacobian).sum(axis=1)
    return Affine(start, residuals[0], jacobian, whole)


def differences(rows: Residuals, u: Array) -> Affine | None:
    """All rows about a place with their Jacobian by differences, of what has no exact derivatives;
    None where they have no values.
    """
    h = tol.DIFFERENCE_STEP_UNKNOWNS * np.maximum(1.0, np.abs(u))
    residuals, size = rows(np.vstack([u, u + np.diag(h)]))
    if not np.isfinite(residuals[0]).all():
        return None
    lost = ~np.isfinite(residuals[1:]).all(axis=1)
    if lost.any():  # at the edge of what can be analysed: look to the other side
        h = np.where(lost, -h, h)
        residuals, size = rows(np.vstack([u, u + np.diag(h)]))
        if not np.isfinite(residuals).all():
            return None
    jacobian = ((residuals[1:] - residuals[0]) / h[:, None]).T
    return Affine(
        u,
        residuals[0],
        jacobian,
        np.maximum(size[0], np.abs(jacobian) @ np.maximum(1.0, np.abs(u))),
    )


def newton(rows: Residuals, chosen: Sequence[int], start: Array) -> Affine | None:
    """Newton's method, its steps shortened where what is left grows."""
    index, n = list(chosen), len(start)
    u, before = start.copy(), np.inf
    best: tuple[float, Affine] | None = None
    for _ in range(40):
        here = rows.about(u)
        if here is None:
            return None
        jacobian, terms = here.jacobian, here.size[index] + tol.TINY
        left = float(np.abs(here.residuals[index] / terms).max())
        if best is None or left < best[0]:
            best = (left, here)
        if left < tol.ROW_REST_ROUNDING or (left < tol.ROW_HOLDS and left >= 0.5 * before):
            break
        before = left
        step, *_ = np.linalg.lstsq(jacobian[index] / terms[:, None], -here.residuals[index] / terms)
        longest = float(np.abs(step / np.maximum(1.0, np.abs(u))).max())
        step *= min(1.0, 2.0 / longest) if longest > 0.0 else 1.0
        for _ in range(12):
            trial, _ = rows((u + step)[None])
            there = np.abs(trial[0][index] / terms).max()
            if (
                there < max((1.0 - tol.UNKNOWN_STEP_GAIN) * left, tol.ROW_REST_ROUNDING)
                and np.isfinite(trial).all()
            ):
                break
            step = 0.5 * step
        u = u + step
        if n and np.abs(step).max() < tol.UNKNOWN_STEP_ROUNDING:
            break
    if best is None or not best[0] < tol.ROW_HOLDS:
        return None
    return best[1]


def scan(rows: Residuals, chosen: int, grid: Array, start: float) -> list[Array]:
    """Starts for Newton's method in one unknown: where a row changes its sign along the grid, and
    where it comes near to zero without.

    The grid is walked from the start to both sides, no further than where trials begin to fail.
    """

    def row(x: float) -> float:
        return float(rows(np.array([[x]]))[0][0, chosen])

    middle = int(np.searchsorted(grid, start))
    residuals = np.full(len(grid), np.nan)
    for side in (np.arange(middle, len(grid)), np.arange(middle - 1, -1, -1)):
        for first in range(0, len(side), STRIDE):
            index = side[first : first + STRIDE]
            residuals[index] = rows(grid[index][:, None])[0][:, chosen]
            if np.isnan(residuals[index]).all():
                break
    found: list[Array] = []
    for k, here in enumerate(residuals):
        if here == 0.0:
            found.append(grid[k : k + 1])
        elif k and here * residuals[k - 1] < 0.0:
            ends, values = (grid[k - 1], grid[k]), (residuals[k - 1], here)
            width = tol.UNKNOWN_BRACKET * max(abs(one) for one in ends)
            found.append(np.array([zero_between(row, ends, values, width).x]))
        elif 0 < k < len(grid) - 1 and abs(here) <= min(
            abs(residuals[k - 1]), abs(residuals[k + 1])
        ):
            found.append(grid[k : k + 1])
    return found


def spread(grids: Sequence[Array], count: int) -> Array:
    """Starts that fill the space of the grids evenly, the same ones always: (count, unknowns)."""
    parts = halton(count, len(grids)).T
    return np.stack(
        [grid[(part * len(grid)).astype(int)] for grid, part in zip(grids, parts, strict=True)],
        axis=1,
    )


# -- An unknown as a search takes it: its size, its bounds, where it is tried ------------------


@dataclass(frozen=True)
class SearchVariable:
    """An unknown as the search takes it: floats in the units of the mechanism.

    `unknown`: As the question gives it.
    `name`: Dotted name of the number, or driver and part of its motion.
    `dimension`: What it measures.
    `present`, `start`, `low`, `high`: What it is in the description, where the search begins, and
      its bounds.
    `scale`: What is one step.
    `steady`: Whether no position depends on it.
    `angle`: Whether it is the angle of a driver: positions are the same after a revolution, as a
      rule.
    """

    unknown: Unknown
    name: str
    dimension: Dimension | None
    present: float
    start: float
    low: float
    high: float
    scale: float
    steady: bool
    angle: bool = False

    @property
    def revolves(self) -> bool:
        """Whether it is the angle of a driver without bounds."""
        return self.angle and not (math.isfinite(self.low) or math.isfinite(self.high))

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds in steps, infinite where there are none."""
        return self.low / self.scale, self.high / self.scale

    @property
    def revolution(self) -> float:
        """A whole revolution in steps, of the angle of a driver; else 0."""
        return 2.0 * math.pi / self.scale if self.angle else 0.0

    @property
    def grid(self) -> Array:
        """Place at which it is tried, in steps."""
        low, high, start = (part / self.scale for part in (self.low, self.high, self.start))
        if math.isfinite(low) and math.isfinite(high):
            return np.linspace(low, high, 73)
        if self.revolves:
            grid = start + np.linspace(0.0, 2.0 * math.pi, 73) / self.scale
        else:
            powers = 10.0 ** np.linspace(-3.0, 3.0, 37)
            grid = np.concatenate([-powers[::-1], powers])
        inside = grid[(grid >= low) & (grid <= high)]
        return inside if len(inside) else np.array([start])

    def allows(self, u: float) -> bool:
        """Whether a value, in steps, lies within the bounds."""
        slack = tol.BOUND_SLACK * (1.0 + abs(u))
        return (u + slack) * self.scale >= self.low and (u - slack) * self.scale <= self.high

    def unwound(self, u: float) -> float:
        """A value, in steps, without whole revolutions away from the start."""
        if not self.revolves:
            return u
        start, period = self.start / self.scale, 2.0 * math.pi / self.scale
        return start + math.remainder(u - start, period) if abs(u - start) > 0.5 * period else u

    def distance(self, a: float, b: float) -> float:
        """Distance of two values from each other, in steps."""
        if self.revolves:
            return abs(math.remainder(a - b, 2.0 * math.pi / self.scale))
        return abs(a - b)

    def in_unit(self, u: float, mechanism: Mechanism) -> tuple[float, str]:
        """A value as results give it, and its unit."""
        value, dimension = u * self.scale, self.dimension
        own = mechanism.units.of(dimension) if dimension else ""
        unit = self.unknown.unit or ("deg" if dimension == DIMENSIONS["angle"] else own)
        if unit == own or dimension is None:
            return value, own
        return float(convert(value, own, unit)), unit


Poses = dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class TrialResult:
    """A trial that succeeded: what was found, the poses of the links, the sign of det Φ_q (0 where
    it is not looked at), which is another one on the branch beyond a singular position, whether
    rows depend on each other, and the least pivot as a part of its diagonal.
    """

    run: Solution
    poses: Poses
    side: float
    redundant: bool
    ratio: float = 1.0

    def leaps_from(self, nearby: TrialResult) -> bool:
        """Whether the branch of a place nearby may have been left on the way."""
        rotation = max(abs(self.poses[name][2] - pose[2]) for name, pose in nearby.poses.items())
        return rotation > tol.BRANCH_LEAP or self.side != nearby.side


class Trials:
    """Analyses of the one instant of a question; every unknown is a number of its system."""

    def __init__(self, mechanism: Mechanism, question: Question) -> None:
        self.question = question
        self.analysis = ANALYSES[question.analysis]
        first = analyse_at(mechanism, "kinematics", Instants(at=question.at))
        self.time = float(first.t[0])
        self.states = {
            driver.name: np.array([float(part[0]) for part in first.driven(driver.name)])
            for driver in mechanism.drivers
        }
        moved = {self._driver(mechanism, one.name) for one in question.unknowns} - {""}
        if first.given is not None:
            moved |= self.states.keys()
        self.system = assemble(self._freed(mechanism, moved))
        self.wanted = [self._wanted(mechanism, first, one) for one in question.unknowns]
        self.steady = all(one.steady for one in self.wanted)
        #: Whether a quantity may be of what loads do.
        self.with_loads = bool(self.system.mechanism.loads)
        self._times = np.array([self.time])
        #: Where trials succeeded: (trials, unknowns), in steps; and what was found there.
        self.places = np.array([[one.present / one.scale for one in self.wanted]])
        self.known: list[TrialResult] = []
        self.known.append(self._first(first))
        #: The last place at which a trial failed, and how many there were.
        self.failed: Array | None = None
        self.count = 0

    @property
    def start(self) -> Array:
        """Start of the search, in steps of the unknowns: (unknowns,)."""
        return np.array([one.start / one.scale for one in self.wanted])

    @property
    def scales(self) -> Array:
        """Steps of the unknowns in the units of the mechanism: (unknowns,)."""
        return np.array([one.scale for one in self.wanted])

    # -- unknowns ------------------------------------------------------------------------------

    def _driver(self, mechanism: Mechanism, name: str) -> str:
        """The driver whose motion is meant, empty where it is none."""
        owner, _, key = name.partition(".")
        is_one = owner in mechanism and mechanism[owner].role == "driver"
        return owner if is_one and key in DRIVEN else ""

    def _freed(self, mechanism: Mechanism, names: set[str]) -> Mechanism:
        """The mechanism with motions of drivers that are numbers: f = c₀ + c₁ t + c₂ t²."""
        made = copy.copy(snapshot(mechanism))
        for name in names:
            law = Polynomial(self._coefficients(self.states[name]))
            # those that _driver names have a law
            made = with_element(made, replace(mechanism[name], law=law))  # type: ignore[call-arg]
        return made

    def _coefficients(self, state: Any) -> list[Any]:
        """Coefficients of the motion that has this value, rate and acceleration at the instant."""
        value, rate, change = state
        t = self.time
        return [value - rate * t + 0.5 * change * t * t, rate - change * t, 0.5 * change]

    def _wanted(self, mechanism: Mechanism, first: Solution, one: Unknown) -> SearchVariable:
        name, dimension = resolve_number(mechanism, one.name)
        driver, _, key = name.partition(".")
        moving = bool(self._driver(mechanism, name))
        if moving:
            present = float(self.states[driver][DRIVEN.index(key)])
        else:
            present = float(first.system.values[name])
        start, low, high = search_range(mechanism, one, dimension)
        start = float(np.clip(present if start is None else start, low, high))
        place = moving and key == "value"
        return SearchVariable(
            unknown=one,
            name=name,
            dimension=dimension,
            present=present,
            start=start,
            low=low,
            high=high,
            scale=(0.0 if place else abs(start)) or self._natural(first, dimension),
            steady=not place if moving else moves_nothing(mechanism, name),
            angle=place and dimension == DIMENSIONS["angle"],
        )

    def _natural(self, first: Solution, dimension: Dimension | None, rate: float = 0.0) -> float:
        """A size that such a number may have in this mechanism, whose bodies turn at a rate."""
        falls = math.sqrt(abs(first.mechanism.g) / first.system.length)
        return natural_size(first.system, dimension, rate + falls)

    def size_of(self, measure: str) -> float:
        """A size that a measured quantity may have in this mechanism."""
        run = self.known[0].run
        rates = [abs(float(run[body.name].omega[-1])) for body in run.mechanism.bodies]
        return self._natural(run, measured(run, measure)[1], max(rates, default=0.0))

    def _first(self, first: Solution) -> TrialResult:
        """The design as it is described."""
        poses = link_poses(first)
        as_described = TrialResult(first, poses, 0.0, redundant=bool(first.regularization))
        return self._from(self.places[0], poses) or as_described

    # -- trials -------------------------------------------------------------------------------

    def run(self, u: Array) -> Solution:
        """The analysis with one set of values, in steps; errors as of the analysis."""
        nearest = self.known[self._nearest(u)]
        with warnings.catch_warnings():
            # a place far away may be on another branch: the solution is looked at, not it
            warnings.simplefilter("ignore", ModelWarning)
            return self.analysis(self._system(u), t=self.time, guess=nearest.poses)

    def rows(self, relations: list[Relation], objective: str, us: Array) -> tuple[Array, Array]:
        """right − left of every relation, then the objective, and the size of their terms. (trials,
        relations + 1) at `us` (trials, unknowns), NaN where a trial fails.
        """
        if self.steady and len(us) > 1:
            self.count += len(us)
            try:
                batch = self.system.with_values(self._values(us))
                run = self.analysis(batch, t=self.time, guess=self.known[0].poses)
                return self._residuals(run, relations, objective, len(us))
            except (ModelError, SolveError):
                pass  # one by one, so that the others have values
        found = np.full((2, len(us), len(relations) + 1), np.nan)
        for n, u in enumerate(us):
            there = self.reached(u)
            if there is not None:
                with contextlib.suppress(ModelError, SolveError):
                    found[:, n] = self.measured(there, relations, objective)
        return found[0], found[1]

    @property
    def refusal(self) -> str:
        """Why the last trial that failed did so; empty where none failed."""
        if self.failed is None:
            return ""
        try:
            self.run(self.failed)
        except (ModelError, SolveError) as error:
            return str(error)
        return ""

    def pivot(self, u: Array) -> float:
        """The least pivot of the trial nearest to a place, as a part of its diagonal; 1 where rows
        are redundant, whose pivots show nothing.
        """
        nearest = self.known[self._nearest(u)]
        return 1.0 if nearest.redundant else nearest.ratio

    def _system(self, u: Array) -> System:
        return self.system.with_values({k: v[0] for k, v in self._values(u[None]).items()})

    def _nearest(self, u: Array) -> int:
        return int(np.abs(self.places - u).sum(axis=1).argmin())

    def _trial(self, u: Array) -> Solution | None:
        """The analysis with one set of values, on the branch of the start where positions depend
        on them: one goes there from the nearest place known, in parts where one step would leap.
        None where it cannot be made, or that branch does not come there.
        """
        if self.steady:
            there = self._from(u, self.known[0].poses)
            return None if there is None else there.run
        nearest = self._nearest(u)
        neighbour, begin = self.known[nearest], self.places[nearest]
        direct = there = self._from(u, neighbour.poses)
        done, part = 0.0, 1.0
        while there is None or there.leaps_from(neighbour):
            part *= 0.5
            # without any progress a gap is in the way, which no small step passes
            if part < (tol.WAY_STEP_SMALLEST if done or there else tol.WAY_STEP_SMALL):
                break
            there = self._from(begin + (done + part) * (u - begin), neighbour.poses)
            if there is not None and not there.leaps_from(neighbour):
                done += part
                neighbour = self._remember(there, begin + done * (u - begin))
                there, part = self._from(u, neighbour.poses), 1.0 - done
        else:
            return self._remember(there, u).run
        # beyond a gap in which loops do not close its side is all that is known of a branch
        if direct is not None and direct.side and direct.side == self.known[0].side:
            return self._remember(direct, u).run
        return None

    def _from(self, u: Array, poses: Poses) -> TrialResult | None:
        """Result at u from the poses of a place nearby; None where there is none."""
        try:
            return self._reached(u, poses)
        except (ModelError, SolveError):
            return None

    def _remember(self, there: TrialResult, u: Array) -> TrialResult:
        self.known.append(there)
        self.places = np.vstack([self.places, u])
        return there

    def _reached(self, u: Array, poses: Poses) -> TrialResult | None:
        """The analysis from one guess, without other starts; None where loops do not close near
        it, the position is singular, or the analysis comes no further.
        """
        system = self._system(u)
        start = closed_near(system, self.time, poses)
        if start is None:
            return None
        check_determined(system, start, self.question.analysis)
        redundant = bool(start.regularization)
        nearly = not redundant and start.ratio < tol.PIVOT_SUSPICIOUS
        if self.known and (nearly or redundant > self.known[0].redundant):
            return None
        regular = (
            system.rows == system.coordinates and not start.regularization and not too_large(system)
        )
        side = float(np.linalg.slogdet(dense(system, start.work)[1])[0]) if regular else 0.0
        runner, instant = Runner(system, self.question.analysis), by_time(system, self._times)
        try:
            block = runner.scalar(start, instant)
        except PathEnded:
            return None
        run = runner.solution(start, instant, Record([block], 1, batch=False))
        return TrialResult(run, link_poses(run), side, redundant, float(start.ratio))

    def measured(
        self, run: Solution, relations: list[Relation], objective: str
    ) -> tuple[Array, Array]:
        """right − left of every relation, then the objective, and the size of their terms, of one
        trial: (relations + 1,) each.
        """
        residuals, size = self._residuals(run, relations, objective, 1)
        return residuals[0], size[0]

    def reached(self, u: Array) -> Solution | None:
        """The analysis with one set of values on the branch of the start; None where there is
        none.
        """
        self.count += 1
        with contextlib.suppress(ModelError, SolveError):
            there = self._trial(u)
            if there is not None:
                return there
        self.failed = u
        return None

    def _residuals(
        self, run: Solution, relations: list[Relation], objective: str, count: int
    ) -> tuple[Array, Array]:
        residuals, size = np.zeros((2, count, len(relations) + 1))
        for n, one in enumerate(relations):
            residuals[:, n], size[:, n] = one(run)
        if objective:
            residuals[:, -1] = np.reshape(measured(run, objective)[0], (-1, len(run)))[:, -1]
            size[:, -1] = np.abs(residuals[:, -1])
        return residuals, size

    @functools.cached_property
    def numbers(self) -> tuple[list[str], Array]:
        """Numbers of the system that depend on the unknowns, and their derivatives by these, in
        steps: (numbers, unknowns).
        """
        n = len(self.wanted)
        made = self._values(np.vstack([np.zeros(n), np.eye(n)]))
        names = list(made)
        differences = [made[name][1:] - made[name][0] for name in names]
        return names, np.array(differences).reshape(len(names), n)

    def _values(self, us: Array) -> dict[str, Array]:
        """Numbers of the system for such unknowns, by dotted name: arrays (trials,)."""
        values: dict[str, Array] = {}
        moving: dict[str, Array] = {}
        for one, column in zip(self.wanted, (us * self.scales).T, strict=True):
            driver, _, key = one.name.partition(".")
            if driver in self.states and key in DRIVEN:
                state = moving.setdefault(
                    driver, np.repeat(self.states[driver][:, None], len(us), axis=1)
                )
                state[DRIVEN.index(key)] = column
            else:
                values[one.name] = column
        for driver, state in moving.items():
            for n, c in enumerate(self._coefficients(state)):
                values[f"{driver}.law.c{n}"] = c
        return values


# -- Residuals of conditions at one instant, with exact derivatives by the unknowns ------------

_FIRST = np.array([0])


class ConditionRows:
    """right − left of every relation, then the objective, as functions of the unknowns in steps."""

    def __init__(self, trials: Trials, relations: Sequence[Relation], objective: str) -> None:
        self.trials, self.relations, self.objective = trials, list(relations), objective

    def __call__(self, us: Array) -> tuple[Array, Array]:
        """Values and the size of their terms, (trials, rows) each; NaN where a trial fails."""
        return self.trials.rows(self.relations, self.objective, us)

    def about(self, u: Array) -> Affine | None:
        """Values and derivatives at a place; None where the trial fails."""
        run = self.trials.reached(u)
        if run is None:
            return None
        jacobian = self._jacobian(run)
        if jacobian is None or not np.isfinite(jacobian).all():
            return differences(self, u)
        residuals, size = self.trials.measured(run, self.relations, self.objective)
        if not np.isfinite(residuals).all():
            return None
        terms = np.abs(jacobian) @ np.maximum(1.0, np.abs(u))
        return Affine(u, residuals, jacobian, np.maximum(size, terms))

    def _jacobian(self, run: Solution) -> Array | None:
        """Derivatives of all rows by the unknowns, (rows, unknowns); None where there are none."""
        names, differences = self.trials.numbers
        instants = DrivenInstants(run, names)
        try:
            whole = instants.at(_FIRST, self.trials.with_loads)
            if instants.unclosed or instants.without_derivative(_FIRST, whole.record).any():
                return None
            rows = [
                self._derivative(whole, one.right, len(names))
                - self._derivative(whole, one.left, len(names))
                for one in self.relations
            ]
            last = np.zeros(len(names))
            if self.objective:
                last = self._derivative(whole, self.objective, len(names))
        except (TypeError, ModelError, SolveError):  # as of users' compiled functions
            return None
        return np.asarray(np.vstack([*rows, last]) @ differences)

    @staticmethod
    def _derivative(whole: object, text: str, count: int) -> Array:
        history, _, _ = evaluate_measure(whole, Measure(text))  # type: ignore[arg-type]
        if not isinstance(history, DualNumber):
            return np.zeros(count)
        return np.array(np.broadcast_to(history.tangents, (1, count))[-1])
