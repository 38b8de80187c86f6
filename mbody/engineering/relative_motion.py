"""The motion of bodies and points in the axes of a body: places, velocities and accelerations.

Places are complex numbers in the axes of that body, from its mass centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.errors import ModelError
from mbody.solution.checks import one_design
from mbody.solution.histories import BodyHistory, PointHistory
from mbody.solution.solution import Solution

__all__ = ["RelativeMotion", "check_moving", "relative_motion", "relative_path"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class RelativeMotion:
    """Motion of a body in the axes of another one: arrays (instants,), complex and real.

    Attributes
    ----------
    place, velocity, acceleration : complex arrays
        Of the mass centre, from that of the other body.
    angle, omega, alpha : arrays
        Of the body's axes in those of the other.
    """

    place: Array
    velocity: Array
    acceleration: Array
    angle: Array
    omega: Array
    alpha: Array

    def instant_centre(self, least: float) -> Array:
        """The instant centre, complex; NaN where the rate is below `least` of its greatest."""
        turns = np.abs(self.omega) > least * np.abs(self.omega).max(initial=0.0)
        return self.place + 1j * self.velocity / np.where(turns, self.omega, np.nan)


def check_moving(run: Solution, what: str) -> None:
    """Refuse what has no motion of one design, in a sentence that begins with `what` there is.

    Raises
    ------
    ModelError
    """
    one_design(run, f"{what} of one design")
    if run.analysis == "statics":
        raise ModelError(f"{what} of a motion, and statics computes no velocities: use kinematics")


def relative_path(
    run: Solution, moving: BodyHistory | PointHistory, relative_to: str
) -> tuple[Array, Array, Array]:
    """Place, velocity and acceleration of a point, or of a body's mass centre, in the axes of a
    body; "ground" is one of them.

    Raises
    ------
    ModelError
        For a body that does not exist.
    """
    seen = run[relative_to]
    into, turning = np.exp(-1j * seen.angle), 1j * seen.omega
    apart = moving.x - seen.x + 1j * (moving.y - seen.y)
    rate = moving.vx - seen.vx + 1j * (moving.vy - seen.vy)
    second = moving.ax - seen.ax + 1j * (moving.ay - seen.ay)
    second = second - 2.0 * turning * rate - (1j * seen.alpha + seen.omega**2) * apart
    return into * apart, into * (rate - turning * apart), into * second


def relative_motion(run: Solution, body: str, relative_to: str) -> RelativeMotion:
    """How one body moves in the axes of another; "ground" is one of them.

    Raises
    ------
    ModelError
        For a body that does not exist.
    """
    a, b = run[body], run[relative_to]
    path = relative_path(run, a, relative_to)
    return RelativeMotion(*path, a.angle - b.angle, a.omega - b.omega, a.alpha - b.alpha)
