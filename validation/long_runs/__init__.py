"""Long runs and runs back: a thousand periods, and motions that return to where they came from."""

from __future__ import annotations

import math

import numpy as np

import mbody
from mbody import AngleDriver, gallery
from mbody.engineering import close_loops
from mbody.solution.histories import link_poses
from validation import oscillators
from validation.case import Row, Source

__all__ = ["build", "rows"]

CASE = "long_runs"
PERIODIC = Source(CASE, "after a whole number of periods it is where it began")
ENERGY = Source(CASE, "kinetic energy against the work of gravity and springs, integrated beside")
REVERSED = Source(CASE, "a conservative motion with its rates turned round goes back")

#: Of the level release of a pendulum of 1 m, 4 √(l/g) K(1/√2) [s] (references).
PERIOD = 2.36784194757623577
PERIODS = 1000
#: By how much the period grows with the energy there, d ln T/d ln E, from dK/dm at m = 1/2.
LONGER = 0.2285
#: The default of `simulate`, and a tight one.
RTOLS = (1e-8, 1e-12)
STEPS = "steps × their error, were the errors of all steps to add up"
LAG = "a drift of the energy as allowed above makes the period longer: half of that lag in all"

#: There and back: the model, its leaders, and the time [s].
BACK = (
    ("double_pendulum", ("upper", "lower"), 5.0),
    ("free_fourbar", ("crank",), 5.0),
    ("n_windows_2", ("c0",), 10.0),
    ("andrews_squeezer", ("OF",), 0.03),
)
GROWN = "there and back, steps × 1e-12, and errors of the way there that grow tenfold"


def build() -> mbody.Mechanism:
    """The gallery's simple pendulum."""
    return gallery.load("simple_pendulum")


def rows() -> list[Row]:
    return [*swinging(), *oscillating(), *back()]


def swinging() -> list[Row]:
    """A pendulum released level: energy, and the rate where it should be at rest."""
    found = []
    time = PERIODS * PERIOD
    for rtol in RTOLS:
        # at quarters of a period it is seen level and at its lowest
        run = mbody.simulate(build(), time, rtol=rtol, instants=4 * PERIODS + 1)
        bob, P = run["pendulum"], run.point("pendulum.P")
        energy = 0.5 * (P.vx**2 + P.vy**2) / 9.81 + P.y
        drift, told = run.stats["steps"] * rtol, f"{PERIODS} swings, rtol {rtol:g}"
        lag = 9.81 * 0.5 * LONGER * drift * time
        balance = np.abs(run.energy.balance).max() / run.energy.size
        found += [
            PERIODIC.absolute(f"{told}, energy by m g l", energy, 0.0, drift, STEPS),
            ENERGY.absolute(f"{told}, balance, relative", balance, 0.0, drift, STEPS),
            PERIODIC.absolute(f"{told}, rate", bob.omega[-1], 0.0, lag, LAG, "rad/s"),
        ]
    return found


def oscillating() -> list[Row]:
    """A block on a spring, released at 0.1 m."""
    found = []
    for rtol in RTOLS:
        time = PERIODS * 2.0 * math.pi / oscillators.OMEGA
        run = mbody.simulate(oscillators.build(), time, rtol=rtol, instants=PERIODS + 1)
        block, small = run["block"], run.stats["steps"] * rtol * run.system.length
        told = f"{PERIODS} periods of a spring, rtol {rtol:g}"
        speed = small * oscillators.OMEGA
        found += [
            PERIODIC.absolute(f"{told}, way", block.x, 0.1, small, STEPS, "m"),
            PERIODIC.absolute(f"{told}, rate", block.vx, 0.0, speed, STEPS, "m/s"),
        ]
    return found


def back() -> list[Row]:
    """Forward, the rates turned round, and forward again."""
    found = []
    for name, leaders, time in BACK:
        machine = gallery.load(name)
        there = mbody.simulate(machine, time, rtol=1e-12, instants=2)
        start = turned(there, leaders)
        again = mbody.simulate(machine, time, start=start, rtol=1e-12, instants=2)
        steps = there.stats["steps"] + again.stats["steps"]
        ours = np.array([again[body].angle[-1] for body in again])
        first = np.array([there[body].angle[0] for body in again])
        told = f"{name}, {time:g} s there and back, angles"
        found.append(REVERSED.absolute(told, ours, first, 10.0 * steps * 1e-12, GROWN, "rad"))
    return found


def turned(run: mbody.Solution, leaders: tuple[str, ...]) -> mbody.Solution:
    """The last instant with all rates turned round: its leaders say the others'."""
    held, drive = run.mechanism.copied(), {}
    for body in leaders:
        held.add(AngleDriver(f"hold {body}", body, 0.0))
        drive[f"hold {body}"] = (float(run[body].angle[-1]), -float(run[body].omega[-1]))
    return close_loops(held, drive=drive, guess=link_poses(run))
