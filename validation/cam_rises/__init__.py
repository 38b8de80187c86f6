"""Peaks of velocity, acceleration and jerk of the usual cam rises, at a follower on its cam."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

import mbody
from mbody.quantities import deg
from validation.case import Row, Source

__all__ = ["build", "rows"]

BOOK = Source("cam_rises", "peaks of v, a, j by h/β, h/β², h/β³ (Norton, Cam Design, ch. 3)")
CLOSED_FORM = Source("cam_rises", "the lift at every half degree, from its formula")
NATURE = Source("cam_rises", "power of the cam = power of the follower")

h, beta, base, roller = 0.02, deg(120.0), 0.04, 0.01  # m, rad
omega, mass, stiffness = 10.0, 0.5, 2000.0  # rad/s, kg, N/m


class Peaks(NamedTuple):
    """Greatest values, and the parts u = θ/β of the rise where they are."""

    v: float
    a: float
    j: float | None
    at_v: float
    at_a: float
    at_j: float


REFERENCE = {
    "cycloidal": Peaks(2.0, 2.0 * math.pi, 4.0 * math.pi**2, 0.5, 0.25, 0.0),
    "harmonic": Peaks(math.pi / 2.0, math.pi**2 / 2.0, None, 0.5, 0.0, 0.0),
    "3-4-5": Peaks(1.875, 10.0 / math.sqrt(3.0), 60.0, 0.5, (3.0 - math.sqrt(3.0)) / 6.0, 0.0),
    "4-5-6-7": Peaks(2.1875, 16.8 / math.sqrt(5.0), 52.5, 0.5, (5.0 - math.sqrt(5.0)) / 10.0, 0.5),
}

#: The follower's lift as written in books, by u.
LIFT = {
    "cycloidal": lambda u: u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi),
    "harmonic": lambda u: 0.5 * (1.0 - np.cos(np.pi * u)),
    "3-4-5": lambda u: 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5,
    "4-5-6-7": lambda u: 35.0 * u**4 - 84.0 * u**5 + 70.0 * u**6 - 20.0 * u**7,
}

ROUNDING = (
    1e-11,
    "of the peak; a whole turn accepts a last correction of 1e-12 of its greatest angle, 6.3 rad, "
    "which accelerations follow",
)
#: Step of the difference, in parts of the rise.
STEP = 1e-3
DIFFERENCE = (
    STEP**4 / 5.0 * (2.0 * math.pi) ** 6 / 39.0 + 10.7 * 6.3e-12 / STEP / 39.0,
    "of the peak; a difference of five points leaves step⁴/5 of the sixth derivative of the lift, "
    "and 10.7 times (its weights) the error of accelerations by the step",
)


def build(shape: str = "cycloidal") -> mbody.Mechanism:
    """A roller follower above its cam: rise, dwell, the same back, dwell."""
    up = deg(90.0)
    rise = mbody.laws.Rise(shape, height=h, start=0.0, duration=beta)
    back = mbody.laws.Rise(shape, height=-h, start=0.0, duration=beta)
    rest = mbody.laws.Dwell(deg(60.0))
    machine = mbody.Mechanism(f"a {shape} cam")
    machine.add(
        mbody.Body("cam", mass=1.0, inertia=1e-3),
        mbody.Body("follower", mass=mass),
        mbody.Revolute("O", "ground", "cam"),
        mbody.Prismatic(
            "guide",
            mbody.Marker("ground", (0.0, 0.0), up),
            mbody.Marker("follower", (0.0, 0.0), up),
        ),
        mbody.CamFollower(
            "contact",
            mbody.Marker("cam", (0.0, 0.0), up),
            "follower",
            mbody.laws.Cam([rest, rise, rest, back], period=2.0 * math.pi),
            base_radius=base,
            roller=roller,
        ),
        mbody.AngleDriver("motor", "cam", mbody.laws.ConstantSpeed(0.0, omega)),
        mbody.Spring("spring", "ground", "follower", stiffness=stiffness, free_length=2.0 * base),
    )
    return machine


def at(run_of: mbody.System, u: np.ndarray) -> mbody.Solution:
    """The cam at parts u of its rise."""
    return mbody.kinetostatics(run_of, drive={"motor": (deg(60.0) + beta * u, omega, 0.0)})


def rows() -> list[Row]:
    return [row for shape, peaks in REFERENCE.items() for row in of_shape(shape, peaks)]


def of_shape(shape: str, peaks: Peaks) -> list[Row]:
    """All rows of one kind of rise."""
    system = mbody.assemble(build(shape))
    turn = mbody.kinetostatics(system, turn="motor", instants=721)
    v, a = h / beta * omega, h / beta**2 * omega**2
    # the greatest of the whole turn and of the places where books find it
    u = np.sort(np.array([peaks.at_v, peaks.at_a]))
    there = at(system, u)
    fastest = max(np.abs(run["follower"].vy).max() for run in (turn, there))
    most = max(np.abs(run["follower"].ay).max() for run in (turn, there))
    found = [
        BOOK.relative(f"{shape}: peak velocity / (h/β)", fastest / v, peaks.v, *ROUNDING),
        BOOK.relative(f"{shape}: peak acceleration / (h/β²)", most / a, peaks.a, *ROUNDING),
    ]
    if peaks.j is not None:
        found.append(jerk(shape, system, peaks))
    part = np.clip((turn["cam"].angle - deg(60.0)) / beta, 0.0, 1.0)
    part -= np.clip((turn["cam"].angle - deg(240.0)) / beta, 0.0, 1.0)
    wanted = base + roller + h * LIFT[shape](part)
    found.append(
        CLOSED_FORM.relative(
            f"{shape}: lift, whole turn", turn["follower"].y, wanted, *ROUNDING, "m"
        )
    )
    pull = stiffness * (turn["follower"].y - 2.0 * base)
    power = (mass * turn["follower"].ay + pull) * turn["follower"].vy / omega
    tolerance, reason = ROUNDING
    found.append(
        NATURE.relative(
            f"{shape}: torque, whole turn",
            turn.effort("motor"),
            power,
            tolerance,
            reason,
            "N·m",
        )
    )
    return found


def jerk(shape: str, system: mbody.System, peaks: Peaks) -> Row:
    """The slope of the follower's acceleration where it is steepest."""
    if peaks.at_j == 0.0:  # from the right: where the rise begins it jumps
        u, weights = np.arange(5.0), np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
    else:
        u, weights = np.arange(-2.0, 3.0), np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
    run = at(system, peaks.at_j + STEP * u)
    slope = float(weights @ run["follower"].ay) / STEP / (h / beta**2 * omega**2)
    assert peaks.j is not None
    return BOOK.relative(f"{shape}: peak jerk / (h/β³)", abs(slope), peaks.j, *DIFFERENCE)
