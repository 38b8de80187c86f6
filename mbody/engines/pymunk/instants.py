"""Forces by pymunk at single instants of a motion that is given, or at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.free_body import coupled
from mbody.engines.independent_reading import reading
from mbody.engines.pymunk.extrapolation import extrapolated
from mbody.engines.pymunk.space import Space, inexpressible
from mbody.engines.pymunk.steps import SpaceStepper
from mbody.model.joints import Joint
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = [
    "LUMP",
    "MANY",
    "InstantForces",
    "Sizes",
    "at_instants",
    "kinematic",
    "settled",
    "sizes_of",
]

Array = np.ndarray

#: Longest step, as a part of the time in which the motion changes; the next are halves of it.
STEP = 2e-3
#: Halvings: what is left is of the fourth power of the step.
HALVES = 4
#: Steps of further sets, as parts of those of the first; of a few instants more sets are made.
SETS, MORE_SETS, FEW_INSTANTS = (1.0, 0.8), (1.0, 0.9, 0.8, 0.7), 5
#: Sum of the weights, without their signs, that the extrapolation of so many gives them.
WEIGHTS = 6.5
#: Steps from an instant on. The first ones carry the start, which pymunk's rates do not fit.
STEPS = 5
#: A stand-in for a mass in a free motion, as a part of the others.
LUMP = 0.005
#: Iterations of the solver, at first and at most.
FEW, MANY = 64, 65536
#: What more iterations may still change, as a part of the greatest.
SETTLED = 1e-10


@dataclass(frozen=True)
class Sizes:
    """What is large in a run, by which steps, stand-ins and rounding are judged.

    Attributes
    ----------
    rate : float
        How fast the motion changes [1/time].
    lump : float
        What stands in for no mass [mass].
    reach : float
        Greatest coordinate, angles by the model length [length].
    mass : float
        Greatest mass, stand-ins included [mass].
    """

    rate: float
    lump: float
    reach: float
    mass: float


@dataclass(frozen=True)
class InstantForces:
    """What pymunk found at some instants of a run.

    Attributes
    ----------
    instants : list of int
        Of the run.
    values, spread : arrays (instants, numbers)
        Numbers as of `SpaceStepper.go`, extrapolated, and what the extrapolation leaves open.
    rounding, jitter : float
        What rounding makes of forces [force], and of accelerations [length/time²].
    parts : tuple of str
        Owners of the parts whose forces stand in the values.
    lumped : tuple of str
    over : tuple of str
        Loads and joints that were taken over.
    """

    instants: list[int]
    values: Array
    spread: Array
    rounding: float
    jitter: float
    parts: tuple[str, ...]
    lumped: tuple[str, ...]
    over: tuple[str, ...]


def kinematic(run: Solution, part: str) -> Array:
    """(instants, bodies, 3) of all bodies: "place", "rate" or "acceleration"."""
    names = {
        "place": ("x", "y", "angle"),
        "rate": ("vx", "vy", "omega"),
        "acceleration": ("ax", "ay", "alpha"),
    }
    bodies = [run[body.name] for body in run.mechanism.bodies]
    rows = [[getattr(body, key) for key in names[part]] for body in bodies]
    return np.moveaxis(np.array(rows), 2, 0)


def sizes_of(system: System, run: Solution) -> Sizes:
    """What is large in a run."""
    L = system.length
    unit = np.array([L, L, 1.0])
    reach = float(np.abs(kinematic(run, "place") / unit).max()) * L
    rates = kinematic(run, "rate") / unit
    changes = kinematic(run, "acceleration") / unit
    if run.analysis == "statics":
        changes = np.zeros_like(changes)
    rate = max(float(np.abs(rates).max()), float(np.sqrt(np.abs(changes).max())))
    own = reading(system).masses[:, 0]
    mean = float(own[own > 0.0].mean()) if own.any() else 0.0
    force = max(
        (float(run.reaction(j.name).magnitude.max()) for j in run.mechanism.joints), default=0.0
    )
    if not rate:
        rate = float(np.sqrt(force / (mean * L))) if mean and force else 1.0
    lump = mean
    if run.analysis != "simulate" or not mean:
        # what moves as it is told has inertia forces: those of a stand-in shall not outweigh loads
        lump = force / (L * rate * rate) if force else mean or 1.0
        lump = min(lump, mean) if mean else lump
    return Sizes(rate, lump, max(reach, L), max(float(own.max()), lump))


def at_instants(system: System, run: Solution, instants: list[int]) -> InstantForces:
    """Forces, efforts and accelerations by pymunk, each instant by itself.

    From the positions and rates of the run a few steps are taken, with four step sizes; in the
    limit they stay at the instant. Drivers move by their values, rates and accelerations there.
    Where the motion is given, forces are linear in the stand-ins for masses, so that two of them
    tell what none would; of a free motion three small ones are extrapolated.
    """
    sizes = sizes_of(system, run)
    trial = _InstantTrial(system, run, sizes)
    h = STEP / sizes.rate
    smallest = h / 2.0 ** (HALVES - 1)
    iterations = trial.settled(instants, smallest)
    trial.parts = SETS if len(instants) > FEW_INSTANTS else MORE_SETS
    values, spread, noise = [], [], []
    for k in instants:
        found = [trial.extrapolated(iterations, lump, k, h) for lump in trial.lumps]
        value, left = extrapolated([one[0] for one in found])
        if trial.linear:
            left = np.zeros_like(left)
        for n, one in enumerate(found):
            left = left + 2.0**n * one[1]
        noise.append(sum(2.0**n * one[2] for n, one in enumerate(found)))
        values.append(value)
        spread.append(left)
    # two sets may meet by chance, though not at most instants
    noises = np.array(noise)
    noises = np.maximum(noises, 2.0 * np.median(noises, axis=0))
    # a position is rounded, and its step divides by h twice; extrapolation adds up some of them
    jitter = 30.0 * np.finfo(float).eps * sizes.reach / smallest**2
    space = trial.space(iterations, trial.lumps[-1])
    machine = system.mechanism
    over = (*(machine.loads[n].name for n in space.over), *trial.over)
    owners = tuple(part.owner for part in space.parts)
    return InstantForces(
        *(instants, np.array(values), np.array(spread) + noises, jitter * sizes.mass, jitter),
        *(owners, space.lumped, over),
    )


def settled(told: Any, enough: float = SETTLED, most: int = MANY) -> tuple[int, float]:
    """How many iterations are enough, and what twice as many still change: a part of the whole."""
    count, last = FEW, told(FEW)
    while True:
        found = told(2 * count)
        top = max(float(np.abs(found).max(initial=0.0)), 1e-300)
        change = float(np.abs(found - last).max(initial=0.0)) / top
        if change <= enough or 2 * count >= most:
            return count if change <= enough else 2 * count, change
        count, last = 2 * count, found


class _InstantTrial:
    """Steps from single instants of a run."""

    def __init__(self, system: System, run: Solution, sizes: Sizes) -> None:
        self.system, self.run, self.sizes = system, run, sizes
        self.pose, self.vel = kinematic(run, "place"), kinematic(run, "rate")
        if run.analysis == "statics":
            self.vel = np.zeros_like(self.vel)
        states = [np.array(run.driven(d.name)) for d in run.mechanism.drivers]
        self.driven = np.array(states).reshape(len(states), 3, len(run))
        if run.analysis == "statics":
            self.driven[:, 1:] = 0.0
        self.over = tuple(one.element for one in inexpressible(system))
        self.spaces: dict[tuple[int, float], Space] = {}
        self.parts: tuple[float, ...] = SETS
        self.linear = run.analysis != "simulate"
        self.lumps: tuple[float, ...] = (1.0,)
        if self.space(FEW, 1.0).lumped:
            self.lumps = (2.0, 1.0) if self.linear else tuple(LUMP / 2.0**n for n in range(3))

    def space(self, iterations: int, lump: float) -> Space:
        key = (iterations, lump)
        if key not in self.spaces:
            self.spaces[key] = Space(self.system, lump * self.sizes.lump, iterations)
        return self.spaces[key]

    def steps(self, iterations: int, lump: float, k: int, h: float) -> Array:
        """What a few steps from instant k on tell."""
        value, rate, change = (part[:, None] for part in self.driven[:, :, k].T)
        stepper = SpaceStepper(
            self.space(iterations, lump),
            lambda times: value + rate * times + 0.5 * change * times**2,
            self._taken(k),
            float(self.run.t[k]),
            float(self.run.t[-1]),
        )
        stepper.put(self.pose[k], self.vel[k])
        return stepper.go(0.0, h, STEPS)

    def settled(self, instants: list[int], h: float) -> int:
        """Iterations that are enough at all instants, as seen from some of them."""
        some = [instants[n] for n in sorted({0, *np.linspace(0, len(instants) - 1, 5).astype(int)})]
        forces = slice(3 * self.system.coordinates, None)
        return max(
            settled(lambda count, k=k: self.steps(count, self.lumps[-1], k, h)[forces])[0]
            for k in some
        )

    def extrapolated(
        self, iterations: int, lump: float, k: int, h: float
    ) -> tuple[Array, Array, Array]:
        """The same with steps of no length; what that and the solver leave open; and how far sets
        of steps are apart that round in their own ways, which a mechanism may magnify.
        """
        sets = [
            [self.steps(iterations, lump, k, part * h / 2.0**n) for n in range(HALVES)]
            for part in self.parts
        ]
        limits, lefts = (np.array(both) for both in zip(*map(extrapolated, sets), strict=True))
        more = self.steps(2 * iterations, lump, k, h / 2.0 ** (HALVES - 1))
        loose = WEIGHTS * np.abs(more - sets[0][-1])
        return limits.mean(axis=0), lefts[0] + loose, np.ptp(limits, axis=0)

    def _taken(self, k: int) -> Array:
        """What joints and couplings that pymunk has not do to the bodies (bodies, 3)."""
        run, found = self.run, np.zeros((len(self.pose[k]) + 1, 3))
        for name in self.over:
            element: Any = run.mechanism[name]
            if not isinstance(element, Joint):
                if name in [c.name for c in run.mechanism.couplings]:
                    found[:-1] += coupled(run, name, k)
                continue
            px, py = (float(part[k]) for part in run.reaction_point(name))
            for body in (element.i.body, element.j.body):
                if body == "ground":
                    continue
                b, reaction = run.system.bodies[body], run.reaction(name, on=body)
                fx, fy, torque = (
                    float(part[k]) for part in (reaction.fx, reaction.fy, reaction.torque)
                )
                x, y = px - self.pose[k, b, 0], py - self.pose[k, b, 1]
                found[b] += fx, fy, torque + x * fy - y * fx
        return found[:-1]
