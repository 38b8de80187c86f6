"""One instant analysed again and again with other values of some of its numbers."""

from __future__ import annotations

import contextlib
import copy
import functools
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.requests import ANALYSES, analyse_at
from mbody.analysis.driven.runner import PathEnded, Runner
from mbody.analysis.driven.time_grid import by_time
from mbody.analysis.inverse.conditions import Relation
from mbody.analysis.position.assembly_analysis import SUSPICIOUS, check_determined, closed_near
from mbody.errors import ModelError, ModelWarning, SolveError
from mbody.inverse.unknowns import Wanted
from mbody.laws import Polynomial
from mbody.model.closed_mechanism import snapshot, with_element
from mbody.model.driver import DRIVEN
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import meant, moves_nothing, plain
from mbody.model.study import Instants, Question, Unknown
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.solution.histories import Record
from mbody.solution.measures import measured
from mbody.solution.places import link_poses
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.rank import dense, too_large
from mbody.system.system import System

__all__ = ["Trials"]

Array = np.ndarray

Poses = dict[str, tuple[float, float, float]]

#: A body that turns by more [rad] between two places may have gone to another branch.
LEAP = 0.5
#: The least part of a way that is tried in one step; where no smaller step came on, either.
SMALLEST, SMALL = 2.0**-10, 2.0**-2


@dataclass(frozen=True)
class Reached:
    """A trial that succeeded: what was found, the poses of the links, the sign of det Φ_q (0 where
    it is not looked at), which is another one on the branch beyond a singular position, whether
    rows depend on each other, and the least pivot as a part of its diagonal.
    """

    run: Solution
    poses: Poses
    side: float
    redundant: bool
    ratio: float = 1.0

    def leaps_from(self, near: Reached) -> bool:
        """Whether the branch of a place nearby may have been left on the way."""
        turned = max(abs(self.poses[name][2] - pose[2]) for name, pose in near.poses.items())
        return turned > LEAP or self.side != near.side


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
        self.known: list[Reached] = []
        self.known.append(self._first(first))
        #: The last place at which a trial failed, and how many there were.
        self.failed: Array | None = None
        self.count = 0

    @property
    def start(self) -> Array:
        """Where the search begins, in steps of the unknowns: (unknowns,)."""
        return np.array([one.start / one.scale for one in self.wanted])

    @property
    def scales(self) -> Array:
        """Steps of the unknowns in the units of the mechanism: (unknowns,)."""
        return np.array([one.scale for one in self.wanted])

    # -- what the unknowns are ----------------------------------------------------------------

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

    def _wanted(self, mechanism: Mechanism, first: Solution, one: Unknown) -> Wanted:
        name, dimension = meant(mechanism, one.name)
        driver, _, key = name.partition(".")
        moving = bool(self._driver(mechanism, name))
        if moving:
            present = float(self.states[driver][DRIVEN.index(key)])
        else:
            present = float(first.system.values[name])
        start, low, high = (
            default if given is None else plain(mechanism, one.name, given, dimension)
            for given, default in ((one.start, present), (one.low, -np.inf), (one.high, np.inf))
        )
        if low > high:
            unit = mechanism.units.of(dimension) if dimension else ""
            raise ModelError(
                f"unknown '{one.name}': low is {low:g}, more than high, {high:g} {unit}".rstrip()
                + ": give low ≤ high",
                one.name,
            )
        start = float(np.clip(start, low, high))
        place = moving and key == "value"
        return Wanted(
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
        if dimension is None:
            return 1.0
        length, g = first.system.length, first.mechanism.g
        masses = first.system.mass
        mass = float(masses.reshape(-1, 3, masses.shape[1])[:, :2].max()) or 1.0
        time = 1.0 / (rate + np.sqrt(g / length))
        powers = (dimension.length, dimension.mass, dimension.time)
        sizes = zip((length, mass, time), powers, strict=True)
        return float(np.prod([size ** float(power) for size, power in sizes]))

    def size_of(self, measure: str) -> float:
        """A size that a measured quantity may have in this mechanism."""
        run = self.known[0].run
        rates = [abs(float(run[body.name].omega[-1])) for body in run.mechanism.bodies]
        return self._natural(run, measured(run, measure)[1], max(rates, default=0.0))

    def _first(self, first: Solution) -> Reached:
        """The design as it is described."""
        poses = link_poses(first)
        as_described = Reached(first, poses, 0.0, redundant=bool(first.regularization))
        return self._from(self.places[0], poses) or as_described

    # -- trials -------------------------------------------------------------------------------

    def run(self, u: Array) -> Solution:
        """The analysis with one set of values, in steps; errors as of the analysis."""
        near = self.known[self._nearest(u)]
        with warnings.catch_warnings():
            # a place far away may be on another branch: the solution is looked at, not it
            warnings.simplefilter("ignore", ModelWarning)
            return self.analysis(self._system(u), t=self.time, guess=near.poses)

    def rows(self, relations: list[Relation], objective: str, us: Array) -> tuple[Array, Array]:
        """right − left of every relation, then the objective, and the size of their terms.

        Parameters
        ----------
        us : array (trials, unknowns)
            In steps.

        Returns
        -------
        arrays (trials, relations + 1), NaN where a trial fails
        """
        if self.steady and len(us) > 1:
            self.count += len(us)
            try:
                batch = self.system.with_values(self._values(us))
                run = self.analysis(batch, t=self.time, guess=self.known[0].poses)
                return self._whole(run, relations, objective, len(us))
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
        near = self.known[self._nearest(u)]
        return 1.0 if near.redundant else near.ratio

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
        near, begin = self.known[nearest], self.places[nearest]
        direct = there = self._from(u, near.poses)
        done, part = 0.0, 1.0
        while there is None or there.leaps_from(near):
            part *= 0.5
            # without any progress a gap is in the way, which no small step passes
            if part < (SMALLEST if done or there else SMALL):
                break
            there = self._from(begin + (done + part) * (u - begin), near.poses)
            if there is not None and not there.leaps_from(near):
                done += part
                near = self._kept(there, begin + done * (u - begin))
                there, part = self._from(u, near.poses), 1.0 - done
        else:
            return self._kept(there, u).run
        # beyond a gap in which loops do not close its side is all that is known of a branch
        if direct is not None and direct.side and direct.side == self.known[0].side:
            return self._kept(direct, u).run
        return None

    def _from(self, u: Array, poses: Poses) -> Reached | None:
        """What is found there from the poses of a place nearby; None where nothing is."""
        try:
            return self._reached(u, poses)
        except (ModelError, SolveError):
            return None

    def _kept(self, there: Reached, u: Array) -> Reached:
        self.known.append(there)
        self.places = np.vstack([self.places, u])
        return there

    def _reached(self, u: Array, poses: Poses) -> Reached | None:
        """The analysis from one guess, without other starts; None where loops do not close near
        it, the position is singular, or the analysis comes no further.
        """
        system = self._system(u)
        start = closed_near(system, self.time, poses)
        if start is None:
            return None
        check_determined(system, start, self.question.analysis)
        redundant = bool(start.regularization)
        nearly = not redundant and start.ratio < SUSPICIOUS
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
        return Reached(run, link_poses(run), side, redundant, float(start.ratio))

    def measured(
        self, run: Solution, relations: list[Relation], objective: str
    ) -> tuple[Array, Array]:
        """right − left of every relation, then the objective, and the size of their terms, of one
        trial: (relations + 1,) each.
        """
        rest, size = self._whole(run, relations, objective, 1)
        return rest[0], size[0]

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

    def _whole(
        self, run: Solution, relations: list[Relation], objective: str, count: int
    ) -> tuple[Array, Array]:
        rest, size = np.zeros((2, count, len(relations) + 1))
        for n, one in enumerate(relations):
            rest[:, n], size[:, n] = one(run)
        if objective:
            rest[:, -1] = np.reshape(measured(run, objective)[0], (-1, len(run)))[:, -1]
            size[:, -1] = np.abs(rest[:, -1])
        return rest, size

    @functools.cached_property
    def numbers(self) -> tuple[list[str], Array]:
        """Numbers of the system that depend on the unknowns, and their derivatives by these, in
        steps: (numbers, unknowns).
        """
        n = len(self.wanted)
        made = self._values(np.vstack([np.zeros(n), np.eye(n)]))
        names = list(made)
        ways = [made[name][1:] - made[name][0] for name in names]
        return names, np.array(ways).reshape(len(names), n)

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
