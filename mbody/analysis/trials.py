"""One instant analysed again and again with other values of some of its numbers."""

from __future__ import annotations

import copy
import math
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.asked import ANALYSES, asked
from mbody.analysis.relations import Relation
from mbody.assembler import assemble
from mbody.drivers import Driver
from mbody.ends import link_poses
from mbody.errors import ModelError, ModelWarning, SolveError
from mbody.formulas import convert
from mbody.laws import Polynomial
from mbody.measures import measured
from mbody.mechanism import Mechanism
from mbody.named import DRIVEN, meant, moves_nothing, plain
from mbody.questions import Ask, Question, Unknown
from mbody.solution import Solution
from mbody.units import DIMENSIONS, Dimension

__all__ = ["Trials", "Wanted"]

Array = np.ndarray

#: Part of a step by which a bound may be passed.
SLACK = 1e-6


@dataclass(frozen=True)
class Wanted:
    """An unknown as the search takes it: floats in the units of the mechanism.

    Attributes
    ----------
    unknown : Unknown
        As it was asked for.
    name : str
        Dotted name of the number, or driver and part of its motion.
    dimension : Dimension or None
        What it measures.
    start, low, high : float
        Where the search begins, and its bounds.
    scale : float
        What is one step.
    steady : bool
        Whether no position depends on it.
    turns : bool
        Whether it is the angle of a driver without bounds: the same after a turn, as a rule.
    """

    unknown: Unknown
    name: str
    dimension: Dimension | None
    start: float
    low: float
    high: float
    scale: float
    steady: bool
    turns: bool = False

    @property
    def grid(self) -> Array:
        """Where it is tried, in steps."""
        low, high, start = (part / self.scale for part in (self.low, self.high, self.start))
        if math.isfinite(low) and math.isfinite(high):
            return np.linspace(low, high, 73)
        if self.turns:
            grid = start + np.linspace(0.0, 2.0 * math.pi, 73) / self.scale
        else:
            powers = 10.0 ** np.linspace(-3.0, 3.0, 37)
            grid = np.concatenate([-powers[::-1], powers])
        inside = grid[(grid >= low) & (grid <= high)]
        return inside if len(inside) else np.array([start])

    def allows(self, u: float) -> bool:
        """Whether a value, in steps, lies within the bounds."""
        slack = SLACK * (1.0 + abs(u))
        return (u + slack) * self.scale >= self.low and (u - slack) * self.scale <= self.high

    def unwound(self, u: float) -> float:
        """A value, in steps, without whole turns away from the start."""
        if not self.turns:
            return u
        start, turn = self.start / self.scale, 2.0 * math.pi / self.scale
        return start + math.remainder(u - start, turn) if abs(u - start) > 0.5 * turn else u

    def apart(self, a: float, b: float) -> float:
        """How far two values are from each other, in steps."""
        if self.turns:
            return abs(math.remainder(a - b, 2.0 * math.pi / self.scale))
        return abs(a - b)

    def told(self, u: float, mechanism: Mechanism) -> tuple[float, str]:
        """A value as it is told, and its unit."""
        value, dimension = u * self.scale, self.dimension
        own = mechanism.units.of(dimension) if dimension else ""
        unit = self.unknown.unit or ("deg" if dimension == DIMENSIONS["angle"] else own)
        if unit == own or dimension is None:
            return value, own
        return float(convert(value, own, unit)), unit


class Trials:
    """Analyses of the one instant of a question; every unknown is a number of its system."""

    def __init__(self, mechanism: Mechanism, question: Question) -> None:
        self.question = question
        self.analysis = ANALYSES[question.analysis]
        first = asked(mechanism, "kinematics", Ask(at=question.at))
        self.time = float(first.t[0])
        self.states = {
            driver.name: np.array([float(part[0]) for part in first.driven(driver.name)])
            for driver in mechanism.drivers
        }
        self.poses = [link_poses(first)]
        moved = {self._driver(mechanism, one.name) for one in question.unknowns} - {""}
        if first.given is not None:
            moved |= self.states.keys()
        self.system = assemble(self._freed(mechanism, moved))
        self.wanted = [self._wanted(mechanism, first, one) for one in question.unknowns]
        #: Where the poses were found: (trials, unknowns), in steps.
        self.places = self.start[None]
        self.steady = all(one.steady for one in self.wanted)
        #: The last sentence of a trial that failed.
        self.refusal = ""

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
        is_one = owner in mechanism and isinstance(mechanism[owner], Driver)
        return owner if is_one and key in DRIVEN else ""

    def _freed(self, mechanism: Mechanism, names: set[str]) -> Mechanism:
        """The mechanism with motions of drivers that are numbers: f = c₀ + c₁ t + c₂ t²."""
        made = copy.copy(mechanism.snapshot())
        for name in names:
            law = Polynomial(self._coefficients(self.states[name]))
            # those that _driver names have a law
            made = made.replaced(replace(mechanism[name], law=law))  # type: ignore[call-arg]
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
            present = float(self.states[driver][list(DRIVEN).index(key)])
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
            start=start,
            low=low,
            high=high,
            scale=(0.0 if place else abs(start)) or self._natural(first, dimension),
            steady=not place if moving else moves_nothing(mechanism, name),
            turns=place and dimension == DIMENSIONS["angle"] and not np.isfinite([low, high]).any(),
        )

    def _natural(self, first: Solution, dimension: Dimension | None) -> float:
        """A size that such a number may have in this mechanism."""
        if dimension is None:
            return 1.0
        length, g = first.system.length, first.mechanism.g
        masses = first.system.mass
        mass = float(masses.reshape(-1, 3, masses.shape[1])[:, :2].max()) or 1.0
        time = np.sqrt(length / g)
        powers = (dimension.length, dimension.mass, dimension.time)
        sizes = zip((length, mass, time), powers, strict=True)
        return float(np.prod([size ** float(power) for size, power in sizes]))

    # -- trials -------------------------------------------------------------------------------

    def run(self, u: Array) -> Solution:
        """The analysis with one set of values, in steps; errors as of the analysis."""
        near = self.poses[int(np.abs(self.places - u).sum(axis=1).argmin())]
        run = self._analysed({k: v[0] for k, v in self._values(u[None]).items()}, near)
        if not self.steady:
            self.poses.append(link_poses(run))
            self.places = np.vstack([self.places, u])
        return run

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
            try:
                run = self._analysed(self._values(us), self.poses[0])
                return self._whole(run, relations, objective, len(us))
            except (ModelError, SolveError):
                pass  # one by one, so that the others are told
        found = np.full((2, len(us), len(relations) + 1), np.nan)
        for n, u in enumerate(us):
            try:
                found[:, n] = np.array(self._whole(self.run(u), relations, objective, 1))[:, 0]
            except (ModelError, SolveError) as error:
                self.refusal = str(error)
        return found[0], found[1]

    def told(self, run: Solution, relations: list[Relation], objective: str) -> Array:
        """right − left of every relation, then the objective: (relations + 1,)."""
        return self._whole(run, relations, objective, 1)[0][0]

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

    def _analysed(self, values: dict[str, Any], guess: dict[str, Any]) -> Solution:
        with warnings.catch_warnings():
            # a trial far away may come out on another branch: the solution is looked at, not it
            warnings.simplefilter("ignore", ModelWarning)
            return self.analysis(self.system.with_values(values), t=self.time, guess=guess)

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
                state[list(DRIVEN).index(key)] = column
            else:
                values[one.name] = column
        for driver, state in moving.items():
            for n, c in enumerate(self._coefficients(state)):
                values[f"{driver}.law.c{n}"] = c
        return values
