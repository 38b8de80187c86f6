"""Synthesis of any mechanism: the demand on it, and its designs followed through all points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import kinematics, kinetostatics
from mbody.core import tolerances as tol
from mbody.core.searches import Searches
from mbody.derivatives.dual_solution import checked_names
from mbody.derivatives.gradient import gradient_at
from mbody.errors import ModelError, SolveError, brief
from mbody.files.model.other_units import described_with
from mbody.model.driver import AngleDriver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.model.simulation import Instants, Measure
from mbody.quantities import Scope
from mbody.quantities.formula import range_given
from mbody.quantities.units import DIMENSIONS
from mbody.solution.measures import check_measure
from mbody.sweeps import latin_hypercube, sweep
from mbody.synthesis import judging
from mbody.synthesis.linkages import INSTANTS, Effort, timings
from mbody.system.assembler import assemble
from mbody.system.system import System

# -- Search over the numbers of any mechanism, with the best timing of each design -------------

#: Motions that a refinement may take.
EVALUATIONS = 120


@dataclass(frozen=True, eq=False)
class Demand:
    """Requirements on a mechanism in synthesis.

    `quantities`: Measured ones: x and y of a point, or one output.
    `goals` (quantities, points)
    `timing` (points,): Values of the driver at the points: of a path their differences count.
    `fixed`: Whether the values themselves count.
    `closed`, `angular`: Whether the path is closed, and whether an output is an angle, of which
      revolutions do not count.
    `span`: Range of the driver that is searched.
    `whole`: Whether that is a revolution.
    `by`: Bounds by name.
    `point`: The numbers of `by` that are coordinates of the point on its body, x and y, or empty.
    `body`: That body.
    """

    system: System
    driver: str
    quantities: tuple[str, ...]
    goals: np.ndarray
    timing: np.ndarray | None
    fixed: bool
    closed: bool
    angular: bool
    span: tuple[float, float]
    whole: bool
    by: Mapping[str, tuple[float, float]]
    point: tuple[str, ...] = ()
    body: str = ""


@dataclass(frozen=True, eq=False)
class DesignCandidate:
    """Numbers, values of the driver at the points, first poses of the bodies, and the misses."""

    values: dict[str, float]
    theta: np.ndarray
    guess: dict[str, tuple[float, float, float]]
    misses: np.ndarray


def searched(demand: Demand, effort: Effort) -> tuple[list[_ModelCandidate], list[str]]:
    """The refined designs of the best starts, the best first, and notes."""
    starts = _starts(demand, effort.search, effort.starts, effort.seed)
    searches = Searches(len(starts))
    found = list(searches.ends(starts, lambda start: _refined(demand, *start)))
    found.sort(key=lambda one: float(np.square(one.misses).sum()))
    return found, [searches.stopped] if searches.stopped else []


def _starts(
    demand: Demand, count: int, keep: int, seed: int
) -> list[tuple[np.ndarray, np.ndarray, dict[str, tuple[float, float, float]]]]:
    """Numbers, values of the driver and first poses of the best designs of a sweep."""
    order, s = _orders(demand)
    place = order % len(s)
    bodies = [body.name for body in demand.system.mechanism.bodies]
    measures = {f"q{n}": quantity for n, quantity in enumerate(demand.quantities)}
    measures |= {
        f"{body} {key}": f"{body}.{quantity}"
        for body in bodies
        for key, quantity in (("x", "origin.x"), ("y", "origin.y"), ("angle", "angle"))
    }
    samples = latin_hypercube(dict(demand.by), count, seed)
    run = sweep(demand.system, samples, "kinematics", measures, drive={demand.driver: s})
    values = np.column_stack([run.parameter(name) for name in demand.by])
    curves = np.stack([run[f"q{n}"] for n in range(len(demand.quantities))], axis=1)
    poses = np.stack([run[f"{b} {k}"] for b in bodies for k in ("x", "y", "angle")], axis=1)
    found: list[tuple[float, Any]] = []
    for n in np.flatnonzero(np.isfinite(curves).all(axis=(1, 2))):
        off = demand.goals[:, None, :] - curves[n][:, place]  # (quantities, timings, points)
        x = values[n].copy()
        if demand.point:
            off, x = _placed(demand, off, x, run[f"{demand.body} angle"][n][place])
        if demand.angular:
            off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
        errors = np.square(off).sum(axis=(0, 2))
        k = int(errors.argmin())
        theta = s[place[k]] + (order[k] // len(s)) * 2.0 * np.pi * demand.whole
        pose = poses[n][:, place[k][0]].reshape(-1, 3)
        guess = {body: (*map(float, row),) for body, row in zip(bodies, pose, strict=True)}
        best = x[k] if demand.point else x
        found.append((float(errors[k]), (best, theta, guess)))
    found.sort(key=lambda pair: pair[0])
    return [start for _, start in found[:keep]]


def _orders(demand: Demand) -> tuple[np.ndarray, np.ndarray]:
    """Timings as instants, and the values of the driver at those."""
    low, high = demand.span
    if demand.fixed:
        timing = np.asarray(demand.timing)
        return np.arange(len(timing))[None, :], timing
    points = demand.goals[0] + 1j * demand.goals[1]
    s = low + np.arange(INSTANTS) * ((high - low) / INSTANTS)
    order = timings(points, demand.timing, demand.closed and demand.whole, high - low)
    if not demand.whole:
        order = order[((order >= 0) & (order < INSTANTS)).all(axis=1)]
    return order, s


def _placed(
    demand: Demand, off: np.ndarray, x: np.ndarray, angle: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The place of the point on its body that suits every timing best, within bounds: what is left
    of the distances, and the numbers of each timing.
    """
    rotated = (off[0] + 1j * off[1]) * np.exp(-1j * angle)  # in the axes of the body
    shift = rotated.mean(axis=-1)
    rows = np.tile(x, (len(shift), 1))
    names = list(demand.by)
    for name, part in zip(demand.point, (shift.real, shift.imag), strict=True):
        k = names.index(name)
        rows[:, k] = np.clip(rows[:, k] + part, *demand.by[name])
    moved = [rows[:, names.index(name)] - x[names.index(name)] for name in demand.point]
    left = rotated - (moved[0] + 1j * moved[1])[:, None]
    return np.stack([left.real, left.imag]), rows


class Refinement:
    """Misses and their derivatives by the numbers and the values of the driver that are free."""

    def __init__(self, demand: Demand, guess: dict[str, tuple[float, float, float]]) -> None:
        self.demand, self.guess = demand, guess
        self.names = list(demand.by)
        timing = demand.timing
        self.steps = np.zeros(1) if timing is None else timing - timing[0]
        self.free = 0 if demand.fixed else (1 if timing is not None else demand.goals.shape[1])
        self.run: Any = None
        self.y: np.ndarray | None = None

    def theta(self, y: np.ndarray) -> np.ndarray:
        """Values of the driver at the points."""
        if self.demand.fixed:
            return np.asarray(self.demand.timing)
        return np.asarray(y[len(self.names) :] + self.steps)

    def residual(self, y: np.ndarray) -> np.ndarray:
        """NaN where the mechanism does not close or does not reach all points."""
        system = self.demand.system.with_values(dict(zip(self.names, y.tolist(), strict=False)))
        drive = {self.demand.driver: (self.theta(y), 1.0)}
        try:
            self.run = kinematics(system, drive=drive, guess=self.guess)
        except SolveError:
            return np.full(self.demand.goals.size, np.nan)
        self.y = y.copy()
        off = np.stack([self.run.measure(q) for q in self.demand.quantities]) - self.demand.goals
        if self.demand.angular:
            off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(off.reshape(-1))

    def jacobian(self, y: np.ndarray) -> np.ndarray:
        """Exact derivatives of the misses; the next positions are closed near those of y."""
        if self.y is None or (self.y != y).any():
            self.residual(y)
        self.guess = self.poses()
        found = gradient_at(self.run, list(self.demand.quantities), self.names)
        by = found.jacobian if found.jacobian.ndim == 3 else found.jacobian[:, None, :]
        columns = [by.reshape(-1, len(self.names))]
        if self.free:
            owner = self.demand.quantities[0][:-2]
            rates = np.concatenate([self.run.measure(f"{owner}.v{axis}") for axis in "xy"])
            points = self.demand.goals.shape[1]
            whole = np.zeros((2 * points, self.free))
            places = np.tile(np.arange(points), 2) if self.free > 1 else np.zeros(2 * points, int)
            whole[np.arange(2 * points), places] = rates
            columns.append(whole)
        return np.hstack(columns)

    def poses(self) -> dict[str, tuple[float, float, float]]:
        """Poses of the bodies at the first point."""
        return {
            body.name: (
                float(self.run.measure(f"{body.name}.origin.x")[0]),
                float(self.run.measure(f"{body.name}.origin.y")[0]),
                float(self.run[body.name].angle[0]),
            )
            for body in self.demand.system.mechanism.bodies
        }


def _problem(
    demand: Demand,
    x: np.ndarray,
    theta: np.ndarray,
    guess: dict[str, tuple[float, float, float]],
) -> judging.MissProblem:
    """The misses by the numbers and the free values of the driver, near a start."""
    task = Refinement(demand, guess)
    low, high = np.array(list(demand.by.values())).T
    width = tol.BOUND_AT * (high - low)
    begin = np.concatenate([np.clip(x, low + width, high - width), theta[: task.free]])
    endless = np.full(task.free, np.inf)
    # what is small in the gradient is so beside the goals, whatever the unit
    size = 1.0 if demand.angular else float(np.ptp(demand.goals, axis=-1).max()) or 1.0

    def candidate(y: np.ndarray) -> _ModelCandidate | None:
        off = task.residual(y)
        if not np.isfinite(off).all():
            return None
        values = dict(zip(task.names, y.tolist(), strict=False))
        misses = np.sqrt(np.square(off.reshape(demand.goals.shape)).sum(axis=0))
        made = DesignCandidate(values, task.theta(y), task.poses(), misses)
        return _ModelCandidate(demand, made)

    return judging.MissProblem(
        lambda y: task.residual(y) / size,
        lambda y: task.jacobian(y) / size,
        begin,
        np.concatenate([low, -endless]),
        np.concatenate([high, endless]),
        len(low),
        candidate,
    )


def _refined(
    demand: Demand,
    x: np.ndarray,
    theta: np.ndarray,
    guess: dict[str, tuple[float, float, float]],
) -> _ModelCandidate | None:
    problem = _problem(demand, x, theta, guess)
    found = problem.least(EVALUATIONS)
    made: Any = None if found is None else problem.candidate(found)
    return made


@dataclass(frozen=True, eq=False)
class StudiedModel:
    """A mechanism with its driver and what is measured of it.

    `driver`, `driven`: Its name, and whether it is an "angle" or a "length".
    `quantities`: x and y of the point, or the output.
    `output`: Whether an output is an "angle" or a "length".
    """

    system: System
    driver: str
    driven: str
    quantities: tuple[str, ...]
    output: str


def model_subject(mechanism: Mechanism, of: Any, path: bool) -> StudiedModel:
    """Subject of a demand on a mechanism: the path of a point, or an output."""
    if not isinstance(of, str) or not of:
        raise ModelError(
            'synthesize: of must name the point of the path, such as "coupler.P", or the output, '
            f'such as "rocker.angle", not {brief(of)}'
        )
    system = assemble(mechanism)
    if len(system.independent_drivers) != 1:
        raise ModelError(
            f"synthesize: '{mechanism.name}' has {len(system.independent_drivers)} drivers: one is "
            "needed"
        )
    quantities = (f"{of}.x", f"{of}.y") if path else (of,)
    unit, *_ = (check_measure(mechanism, Measure(one)) for one in quantities)
    kinds = {"rad": "angle", mechanism.units.of("length"): "length"}
    if unit not in kinds:
        raise ModelError(
            f"synthesize: '{of}' is in {unit or 'plain numbers'}: the output of a function is an "
            "angle or a length",
            of,
        )
    driver = system.independent_drivers[0]
    driven = "angle" if isinstance(driver, AngleDriver) else "length"
    return StudiedModel(system, driver.name, driven, quantities, kinds[unit])


def model_demand(
    subject: StudiedModel,
    by: Mapping[str, Any] | None,
    span: Any,
    goals: np.ndarray,
    timing: np.ndarray | None,
    closed: bool,
) -> Demand:
    """A checked demand on a mechanism: goals (quantities, points) at values of the driver."""
    system, path = subject.system, len(subject.quantities) == 2
    mechanism = system.mechanism
    if not isinstance(by, Mapping) or not by:
        raise ModelError(
            "synthesize: by must say which numbers of the model are sought, between which bounds: "
            'by={"crank.A.x": (low, high)}'
        )
    _refuse_made(system, by)
    names = checked_names(system, list(by), "synthesize")
    scope = Scope(mechanism.units)
    limits = {
        number: range_given(
            by[name], dimension_named(mechanism, number), scope, "synthesize", name, equal=True
        )
        for name, number in names.items()
    }
    whole = subject.driven == "angle" and span is None
    if path and span is None and not whole:
        raise ModelError(
            f"synthesize: driver '{subject.driver}' makes no turns: give its range, "
            "span=(low, high)"
        )
    first = float(kinematics(system).measure(f"{subject.driver}.value")[0]) if whole else 0.0
    driver_range = (first, first + 2.0 * math.pi)
    if span is not None:
        dimension = DIMENSIONS[subject.driven]
        driver_range = range_given(span, dimension, scope, "synthesize", "span")
    body = subject.quantities[0].partition(".")[0]
    point = tuple(one for one in subject.quantities if path and one in limits)
    return Demand(
        system=system,
        driver=subject.driver,
        quantities=subject.quantities,
        goals=goals,
        timing=timing,
        fixed=not path,
        closed=closed,
        angular=not path and subject.output == "angle",
        span=driver_range,
        whole=whole,
        by=limits,
        point=point if len(point) == 2 and body != "ground" else (),
        body=body,
    )


def _refuse_made(system: System, by: Mapping[str, Any]) -> None:
    """Refuse a number that a formula makes of others."""
    for name in by:
        formula = system.formulas.get(name)
        if formula is not None:
            used = listed(sorted(system.mechanism.parameters.used_by(formula)))
            raise ModelError(
                f"synthesize: '{name}' is made by the formula '{formula.text}': seek {used}, or "
                f"give '{name}' a number of its own in the model",
                name,
            )


def for_model(
    demand: Demand, effort: Effort, judge: judging.Judge, count: int
) -> judging.DesignList:
    """Designs of a mechanism whose point passes the points, or whose output has the values."""
    found, stopped = searched(demand, effort)
    exact = demand.goals.shape[1] * (tol.SYNTHESIS_POINT_MET * judge.size) ** 2
    judge.take(found, count, exact)
    judge.require("design of the mechanism passes all points without defects within the bounds")
    best = judge.best(count, exact)
    notes = [] if demand.angular else judge.off_point_notes()
    return judging.DesignList(best, effort.search, effort.seed, notes + stopped)


@dataclass(frozen=True, eq=False)
class _ModelCandidate:
    """A design of any mechanism, as `Candidate`."""

    demand: Demand
    found: DesignCandidate
    zeros = None
    described = ""

    @property
    def row(self) -> np.ndarray:
        return np.array(list(self.found.values.values()))

    @property
    def misses(self) -> np.ndarray:
        return self.found.misses

    @property
    def problem(self) -> judging.MissProblem:
        """The misses near it."""
        one = self.found
        return _problem(self.demand, self.row, one.theta, one.guess)

    def revolves(self) -> bool:
        """Whether the driver may turn round, which following it decides."""
        return self.demand.whole

    def motion(self, units: str, full_turn: bool) -> Any:
        """Of the assembled system with its numbers, without a file of it."""
        system = self.demand.system.with_values(self.found.values)
        return self._motion(system, self.found.theta, self.found.guess)[0]

    def follow(self, units: str, full_turn: bool) -> judging.DesignMotion:
        """The mechanism of the file that was made goes through the points, and round."""
        demand, theta = self.demand, self.found.theta
        at = {demand.driver: [float(one) for one in theta]}
        machine = described_with(
            demand.system.mechanism, self.found.values, self.found.guess, Instants(at=at)
        )
        system = assemble(machine)
        steps = np.diff(theta)
        order = bool((steps > 0.0).all() or (steps < 0.0).all())
        if demand.whole:
            order = order and abs(float(steps.sum())) < 2.0 * math.pi + tol.SYNTHESIS_TURN_ROUNDING
        defects = () if order else ("order: the driver turns back between the points",)
        try:
            run = kinematics(system, drive={demand.driver: theta})
        except SolveError as error:
            stop = str(error).partition(";")[0]
            return judging.DesignMotion(system, theta, False, (f"branch: {stop}",), None, None)
        if doubts := [one.message for one in run.doubts if one.kind == "branch"]:
            defects = (f"branch: {doubts[0]}", *defects)
        motion, stop = self._motion(system, theta)
        if full_turn and stop:
            defects = (f"branch: {stop}", *defects)
        return judging.DesignMotion(system, theta, order, defects, run, motion)

    def _motion(self, system: System, theta: np.ndarray, guess: Any = None) -> tuple[Any, str]:
        """The whole revolution at the rate of the law where the driver turns round, else from the
        first point to the last; and what stopped it.
        """
        stop = ""
        if self.demand.whole:
            try:
                first = float(theta[0])
                angles = first + np.linspace(0.0, 2.0 * math.pi, judging.MOTION)
                name = self.demand.driver
                rate = float(kinematics(system, guess=guess).measure(f"{name}.rate")[0])
                return kinetostatics(system, drive={name: (angles, rate)}, guess=guess), ""
            except SolveError as error:
                stop = str(error).partition(";")[0]
        whole = np.linspace(0.0, len(theta) - 1.0, judging.MOTION)
        values = np.interp(whole, np.arange(len(theta)), theta)
        return kinetostatics(system, drive={self.demand.driver: values}, guess=guess), stop

    def measured(self, run: Any) -> np.ndarray:
        off = np.stack([run.measure(q) for q in self.demand.quantities]) - self.demand.goals
        if self.demand.angular:
            off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(np.sqrt(np.square(off).sum(axis=0)))

    def values(self, found: judging.DesignMotion) -> dict[str, float]:
        return dict(self.found.values)

    def transmission(self, found: judging.DesignMotion) -> float:
        return math.nan

    def cognate(self) -> None:
        return None
