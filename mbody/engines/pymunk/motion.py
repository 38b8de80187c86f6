"""A motion integrated by pymunk from the first instant of a run, with three step sizes."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.pymunk.instants import (
    LUMP,
    MANY,
    Sizes,
    extrapolated,
    kinematic,
    order,
    settled,
    sizes_of,
)
from mbody.engines.pymunk.space import Space, SpaceStepper, of_system
from mbody.solution.solution import Solution
from mbody.system.system import System

Array = np.ndarray

#: Longest time of a motion that is compared [time].
HORIZON = 1.0
#: Longest step, as a part of the characteristic time of the motion, and the fewest steps.
STEP, FEWEST = 2e-3, 400
#: Steps above this part are too long for the extrapolation: then a shorter time is integrated.
COARSE = 0.02
#: Instants that are compared, at most.
SAMPLES = 10
#: Greatest work of all runs, in iterations of one constraint (about 16 ns); and the work of a step
#: itself, of a driver, and of applied loads.
WORK = 3e7
STEPPING, DRIVING, APPLYING = 200, 300, 3000
#: Range of observed orders in which the extrapolation is valid.
REGULAR = (0.8, 2.5)
#: Steps after which the number of iterations is checked, and the accepted change of the forces.
BURST, SETTLED = 40, 1e-8
#: Accepted change of positions by more iterations, and the sum of the weights of the
#: extrapolation.
STILL, WEIGHTS = 1e-8, 5.0
#: Differences of positions below this part of the model length are rounding, and have no order.
ROUNDED = 1e-10


@dataclass(frozen=True)
class Trajectory:
    """The result of a motion integrated by pymunk.

    Attributes
    ----------
    instants : list of int
        Of the run.
    values, spread : arrays (instants, numbers)
        Numbers as of `SpaceStepper.go`, then the kinetic energy, extrapolated, and the error
        estimate of the extrapolation.
    order : float
        Observed, of the positions at the last instant; NaN where the step size has no effect.
    horizon : float
        Time of the last instant after the first [time].
    step : float
        The longest [time].
    shortened : bool
        Whether the motion was shortened, because the order was not observed or too many steps were
        needed.
    loose : float
        Change by more iterations, relative to the greatest force.
    parts, lumped, over : tuples of str
        As of `InstantForces`.
    """

    instants: list[int]
    values: Array
    spread: Array
    order: float
    horizon: float
    step: float
    shortened: bool
    loose: float
    parts: tuple[str, ...]
    lumped: tuple[str, ...]
    over: tuple[str, ...]


def trajectory(system: System, run: Solution) -> Trajectory | None:
    """The motion from the first instant of a run on; None where there is only one.

    It ends where three step sizes no longer converge with the expected order, since nearby motions
    diverge after that, or where too much work would be needed. Stand-ins for masses are halved
    twice too, and extrapolated to zero.
    """
    end = _end(run)
    instants = _instants(run, end)
    if not instants:
        return None
    sizes = sizes_of(system, run.take([0, *range(1, instants[-1] + 1)]))
    trial = _MotionTrial(system, run, sizes)
    shortened = False
    while len(instants) > 1 and trial.step(instants) * sizes.rate > COARSE:
        end = 0.5 * (float(run.t[instants[-1]]) + float(run.t[0]))
        instants, shortened = _instants(run, end) or instants[:1], True
    while True:
        found, seen = trial.go(instants)
        n = system.coordinates
        places = [values[-1, :n] for values in seen]
        apart = float(np.abs(places[2] - places[1]).max()) / min(system.length, 1.0)
        seen_order = order(places)
        regular = apart < ROUNDED or REGULAR[0] <= seen_order <= REGULAR[1]
        if regular or len(instants) == 1:
            break
        end = 0.5 * (float(run.t[instants[-1]]) + float(run.t[0]))
        shorter = _instants(run, end)
        if not shorter or shorter[-1] >= instants[-1]:
            break
        instants, shortened = shorter, True
    value, spread = found
    # errors accumulate along a motion, and that of a single number may vanish by chance
    spread = np.maximum(spread, np.median(spread, axis=0))
    if run.analysis == "simulate":
        spread = np.maximum.accumulate(spread)
    space = trial.spaces[0]
    return Trajectory(
        instants,
        value,
        spread,
        order=float("nan") if apart < ROUNDED else seen_order,
        horizon=float(run.t[instants[-1]] - run.t[0]),
        step=trial.longest,
        shortened=shortened,
        loose=trial.loose,
        parts=tuple(part.owner for part in space.parts),
        lumped=space.lumped,
        over=tuple(system.mechanism.loads[n].name for n in space.over),
    )


def _end(run: Solution) -> float:
    """The last time that may be compared: before the first impact on a stop."""
    first = float(run.t[0])
    impacts = [one.t for one in run.events if one.after is not None]
    return min([first + HORIZON, float(run.t[-1]), *impacts])


def _instants(run: Solution, end: float) -> list[int]:
    """Instants of the run that are compared, after the first and not after the end."""
    there = np.flatnonzero((run.t > run.t[0]) & (run.t <= end + 1e-12 * abs(end)))
    picked = np.linspace(0, len(there) - 1, min(len(there), SAMPLES)).round().astype(int)
    return [int(there[k]) for k in picked]


class _MotionTrial:
    """Runs of pymunk from the first instant on."""

    def __init__(self, system: System, run: Solution, sizes: Sizes) -> None:
        self.system, self.run, self.sizes = system, run, sizes
        self.pose, self.vel = kinematic(run, "place")[0], kinematic(run, "rate")[0]
        free = Space(system, sizes.lump, 1)
        moving = run.analysis == "simulate" and bool(free.lumped)
        self.lumps = tuple(LUMP * sizes.lump / 2**n for n in range(3)) if moving else (sizes.lump,)
        h = STEP / sizes.rate
        # the smallest stand-in needs the most iterations
        most = min(MANY, int(WORK / (BURST * max(len(free.parts), 1))))
        self.iterations, self.loose = settled(lambda count: self._burst(count, h), SETTLED, most)
        self.spaces = [Space(system, lump, self.iterations) for lump in self.lumps]
        self.longest = h

    def _stepper(self, space: Space) -> SpaceStepper:
        last = float(self.run.t[-1])
        drive = functools.partial(of_system, self.run.system, last=last)
        stepper = SpaceStepper(space, drive, last=last)
        stepper.put(self.pose, self.vel)
        return stepper

    def _burst(self, iterations: int, h: float) -> Array:
        """Forces after some steps; each step starts with the impulses of the one before."""
        stepper = self._stepper(Space(self.system, self.lumps[-1], iterations))
        return stepper.go(float(self.run.t[0]), h, BURST)[3 * self.system.coordinates :]

    def _work(self) -> float:
        """Work of a step."""
        space = self.spaces[0]
        work = STEPPING + DRIVING * len(space.drives) + self.iterations * len(space.parts)
        return work + (APPLYING if self._stepper(space).pushed else 0)

    def step(self, instants: list[int]) -> float:
        """The longest step for a motion up to the last instant [time], by the greatest work."""
        span = float(self.run.t[instants[-1]] - self.run.t[0])
        wanted = max(FEWEST, span * self.sizes.rate / STEP)
        most = WORK / (7.0 * self._work() * len(self.spaces))
        return span / max(min(wanted, most), 4.0 * len(instants))

    def go(self, instants: list[int]) -> tuple[tuple[Array, Array], list[Array]]:
        """The limit with its spread, and the results of the three step sizes with the first
        stand-in.
        """
        times = self.run.t[[0, *instants]]
        self.longest = self.step(instants)
        loose = self._settle(times)
        sets = [[self._once(space, times, n) for n in (1, 2, 4)] for space in self.spaces]
        limits = [extrapolated(seen) for seen in sets]
        value, spread = limits[0]
        if len(limits) > 1:
            value, more = extrapolated([one[0] for one in limits])
            spread = limits[-1][1] + more
        return (value, spread + WEIGHTS * loose), sets[0]

    def _settle(self, times: Array) -> Array:
        """Set the iterations that the whole motion needs; returns the change by four times as many
        (instants, numbers).
        """
        space, n = self.spaces[-1], self.system.coordinates
        found = self._once(space, times, 1)
        while True:
            space.space.iterations = 4 * self.iterations
            more = self._once(space, times, 1)
            change = np.abs(more - found)
            if change[:, :n].max() <= STILL * min(self.sizes.reach, 1.0):
                break
            steps = float(times[-1] - times[0]) / self.longest
            # the next trial needs sixteen times as many as the start of this one
            if 16.0 * self._work() * steps > WORK:
                break
            self.iterations, found = 4 * self.iterations, more
        for one in self.spaces:
            one.space.iterations = self.iterations
        return np.asarray(change)

    def _once(self, space: Space, times: Array, finer: int) -> Array:
        """(instants, numbers) of one motion."""
        stepper, rows = self._stepper(space), []
        own = reading(self.system).masses.ravel()
        n = self.system.coordinates
        for begin, end in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
            steps = max(1, round((end - begin) / self.longest)) * finer
            result = stepper.go(begin, (end - begin) / steps, steps)
            rows.append(np.append(result, 0.5 * own @ result[n : 2 * n] ** 2))
        return np.array(rows)
