"""Forces by pymunk at single instants of a known motion, or at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.analysis.driven.free_body import coupled
from mbody.core.tolerances import PYMUNK_ARTIFICIAL_MASS, PYMUNK_SETTLED, PYMUNK_STEP_LONGEST, TINY
from mbody.engines.independent_reading import reading
from mbody.engines.pymunk.space import Space, SpaceStepper, inexpressible
from mbody.model.joints import Joint
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- Richardson extrapolation of a first-order method to step size 0, with an error estimate ---

Array = np.ndarray


def extrapolated(values: Sequence[Array]) -> tuple[Array, Array]:
    """The limit of results with the steps h, h/2, h/4 … and the change by the last correction.

    Repeated Richardson extrapolation: an error a h + b h² + c h³ … loses one power per level.

    L. F. Richardson, The approximate arithmetical solution by finite differences (1911).

    >>> found, spread = extrapolated([np.array(1.0 + h + h * h) for h in (0.4, 0.2, 0.1)])
    >>> round(float(found), 12), round(float(spread), 12)
    (1.0, 0.02)
    """
    level, before = list(values), values[-1]
    for power in range(1, len(values)):
        before = level[-1]
        level = [b + (b - a) / (2.0**power - 1.0) for a, b in pairwise(level)]
    return level[-1], np.abs(level[-1] - before)


def order(values: Sequence[Array]) -> float:
    """Observed order of results with h, h/2, h/4: log₂ of the ratio of their differences.

    >>> round(order([np.array(1.0 + h) for h in (0.4, 0.2, 0.1)]), 9)
    1.0
    """
    coarse, fine = (float(np.abs(b - a).max()) for a, b in pairwise(values))
    return math.log2(coarse / fine) if coarse > 0.0 and fine > 0.0 else math.nan


#: Number of step sizes: the remaining error is of order 4.
HALVES = 4
#: Step sizes of further sets relative to the first; for few instants there are more sets.
SETS, MORE_SETS, FEW_INSTANTS = (1.0, 0.8), (1.0, 0.9, 0.8, 0.7), 5
#: Sum of the absolute weights of the extrapolation.
WEIGHTS = 6.5
#: Steps from an instant on. The first ones have errors of the start, which does not fit pymunk.
STEPS = 5
#: Iterations of the solver, at first and at most.
FEW, MANY = 64, 65536
#: Greatest work, in iterations of one constraint (about 25 ns), beyond which fewer instants are
#: compared, but no fewer than two.
WORK = 1.2e8


@dataclass(frozen=True)
class Sizes:
    """Scales of a run, for steps, artificial masses and rounding.

    `rate`: Characteristic rate of the motion [1/time].
    `lump`: Artificial mass in place of zero [mass].
    `extent`: Greatest coordinate, with angles times the model length [length].
    `mass`: Greatest mass, artificial ones included [mass].
    """

    rate: float
    lump: float
    extent: float
    mass: float


@dataclass(frozen=True)
class InstantForces:
    """Results of pymunk at some instants of a run.

    `instants`: Of the run.
    `values`, `spread` (instants, numbers): Numbers as of `SpaceStepper.go`, extrapolated, and the
      error estimate of the extrapolation.
    `rounding`, `jitter`: Rounding error of forces [force], and of accelerations [length/time²].
    `parts`: Owners of the parts whose forces are in the values.
    `over`: Loads and joints with forces from mbody.
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
    """The scales of a run."""
    L = system.length
    unit = np.array([L, L, 1.0])
    extent = float(np.abs(kinematic(run, "place") / unit).max()) * L
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
        # in a driven motion inertia forces of an artificial mass must not be greater than the loads
        lump = force / (L * rate * rate) if force else mean or 1.0
        lump = min(lump, mean) if mean else lump
    return Sizes(rate, lump, max(extent, L), max(float(own.max()), lump))


def at_instants(system: System, run: Solution, instants: list[int]) -> InstantForces:
    """Forces, efforts and accelerations by pymunk, each instant by itself.

    From the positions and rates of the run a few steps are taken, with four step sizes; in the
    limit they remain at the instant. Drivers move by their values, rates and accelerations there.
    For a known motion, forces are linear in the artificial masses, so two of them determine
    the limit of zero; for a free motion three small ones are extrapolated. Where the solver needs
    many iterations, fewer of the instants are taken.
    """
    sizes = sizes_of(system, run)
    trial = _InstantTrial(system, run, sizes)
    h = PYMUNK_STEP_LONGEST / sizes.rate
    smallest = h / 2.0 ** (HALVES - 1)
    iterations = trial.settled(instants, smallest)
    most = max(2, int(WORK / max(trial.work(iterations), 1.0)))
    if len(instants) > most:
        instants = [
            instants[n] for n in np.linspace(0, len(instants) - 1, most).round().astype(int)
        ]
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
    # two sets may agree by chance, but not at most instants
    noises = np.array(noise)
    noises = np.maximum(noises, 2.0 * np.median(noises, axis=0))
    # a position is rounded and divided by h twice; the extrapolation adds several of them
    jitter = 30.0 * np.finfo(float).eps * sizes.extent / smallest**2
    space = trial.space(iterations, trial.lumps[-1])
    machine = system.mechanism
    over = (*(machine.loads[n].name for n in space.over), *trial.over)
    owners = tuple(part.owner for part in space.parts)
    return InstantForces(
        instants,
        np.array(values),
        spread=np.array(spread) + noises,
        rounding=jitter * sizes.mass,
        jitter=jitter,
        parts=owners,
        lumped=space.lumped,
        over=over,
    )


def settled(result_of: Any, enough: float = PYMUNK_SETTLED, most: int = MANY) -> tuple[int, float]:
    """Number of iterations that is enough, and the relative change by twice as many."""
    count, last = FEW, result_of(FEW)
    while True:
        found = result_of(2 * count)
        top = max(float(np.abs(found).max(initial=0.0)), TINY)
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
            self.lumps = (
                (2.0, 1.0)
                if self.linear
                else tuple(PYMUNK_ARTIFICIAL_MASS / 2.0**n for n in range(3))
            )

    def space(self, iterations: int, lump: float) -> Space:
        key = (iterations, lump)
        if key not in self.spaces:
            self.spaces[key] = Space(self.system, lump * self.sizes.lump, iterations)
        return self.spaces[key]

    def steps(self, iterations: int, lump: float, k: int, h: float) -> Array:
        """The result of a few steps from instant k on."""
        value, rate, change = (part[:, None] for part in self.driven[:, :, k].T)
        stepper = SpaceStepper(
            self.space(iterations, lump),
            lambda times: value + rate * times + 0.5 * change * times**2,
            self._forces_of_ours(k),
            float(self.run.t[k]),
            float(self.run.t[-1]),
        )
        stepper.put(self.pose[k], self.vel[k])
        return stepper.go(0.0, h, STEPS)

    def settled(self, instants: list[int], h: float) -> int:
        """Iterations that are enough at some of the instants."""
        some = [instants[n] for n in sorted({0, *np.linspace(0, len(instants) - 1, 5).astype(int)})]
        forces = slice(3 * self.system.coordinates, None)
        return max(
            settled(lambda count, k=k: self.steps(count, self.lumps[-1], k, h)[forces])[0]
            for k in some
        )

    def work(self, iterations: int) -> float:
        """Iterations of one constraint that an instant needs, at least."""
        runs = len(self.parts) * HALVES + 2  # those of the check have twice the iterations
        parts = len(self.space(iterations, self.lumps[-1]).parts)
        return float(iterations * parts * STEPS * runs * len(self.lumps))

    def extrapolated(
        self, iterations: int, lump: float, k: int, h: float
    ) -> tuple[Array, Array, Array]:
        """The result extrapolated to step size 0, the errors of extrapolation and solver, and the
        spread between sets of steps by rounding, which a mechanism may amplify.
        """
        sets = [
            [self.steps(iterations, lump, k, part * h / 2.0**n) for n in range(HALVES)]
            for part in self.parts
        ]
        limits, lefts = (np.array(both) for both in zip(*map(extrapolated, sets), strict=True))
        more = self.steps(2 * iterations, lump, k, h / 2.0 ** (HALVES - 1))
        loose = WEIGHTS * np.abs(more - sets[0][-1])
        return limits.mean(axis=0), lefts[0] + loose, np.ptp(limits, axis=0)

    def _forces_of_ours(self, k: int) -> Array:
        """Forces of joints and couplings that pymunk does not have, on the bodies (bodies, 3)."""
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
