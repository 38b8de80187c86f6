"""The motion of one body in the axes of another: places, velocities and accelerations.

In complex numbers: z is the place of the moving body's mass centre in the axes of the other body,
from its mass centre, and θ the angle between both bodies' axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.solution.solution import Solution

__all__ = ["RelativeMotion", "relative_motion"]

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


def relative_motion(run: Solution, body: str, relative_to: str) -> RelativeMotion:
    """How one body moves in the axes of another; "ground" is one of them.

    Raises
    ------
    ModelError
        For a body that does not exist.
    """
    a, b = run[body], run[relative_to]
    into = np.exp(-1j * b.angle)
    apart = a.x - b.x + 1j * (a.y - b.y)
    rate = a.vx - b.vx + 1j * (a.vy - b.vy)
    second = a.ax - b.ax + 1j * (a.ay - b.ay)
    turning = 1j * b.omega
    return RelativeMotion(
        into * apart,
        into * (rate - turning * apart),
        into * (second - 2.0 * turning * rate - (1j * b.alpha + b.omega**2) * apart),
        a.angle - b.angle,
        a.omega - b.omega,
        a.alpha - b.alpha,
    )
