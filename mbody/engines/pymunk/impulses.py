"""Constraints and springs of a pymunk space, with the directions in which their impulses act.

pymunk returns the size of an impulse but not its direction. So every constraint has its own
columns: the effect of each unit impulse on all bodies. The impulses are then found from the
momenta.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["ImpulseConstraint", "SpringImpulse", "place"]

Array = np.ndarray


def place(pose: Array, body: int, arm: tuple[float, float]) -> Array:
    """World place (2,) of an arm from the mass centre of a body; pose (bodies, 3)."""
    x, y, theta = pose[body]
    c, s = math.cos(theta), math.sin(theta)
    return np.array([x + c * arm[0] - s * arm[1], y + s * arm[0] + c * arm[1]])


@dataclass(eq=False)
class ImpulseConstraint:
    """One constraint of the space.

    Attributes
    ----------
    owner : str
        Name of the joint or driver that it belongs to.
    kind : str
        "pin", "slot", "rod", "turn" or "contact".
    native : pymunk.Constraint, or tuple of pymunk.Shape
    i, j : int
        Bodies; the ground is the last.
    arm_i, arm_j : pair of float
        Places from the mass centres in link axes [length].
    torque_at : pair of float, or None
        Reference place on j of torques, where it differs from arm_j [length].
    normal : float
        Of a slot or a contact line: direction in axes of i [rad].
    radius : float
        Of a rolling wheel [length].
    target : float
        Value that a slot, a rod or a turn keeps.
    reach : float
        Half the length of a slot.
    """

    owner: str
    kind: str
    native: Any
    i: int
    j: int
    arm_i: tuple[float, float] = (0.0, 0.0)
    arm_j: tuple[float, float] = (0.0, 0.0)
    torque_at: tuple[float, float] | None = None
    normal: float = 0.0
    radius: float = 0.0
    target: float = 0.0
    reach: float = 0.0

    def forces(self, pose: Array) -> Array:
        """Force and torque of each unit impulse on body j, about the reference place
        (impulses, 3).
        """
        units = self.units(pose)
        if self.torque_at is not None:
            x, y = place(pose, self.j, self.arm_j) - place(pose, self.j, self.torque_at)
            units[:, 2] += x * units[:, 1] - y * units[:, 0]
        return units

    def units(self, pose: Array) -> Array:
        """The same about the place where the impulse acts."""
        if self.kind == "turn":
            return np.array([[0.0, 0.0, 1.0]])
        if self.kind == "slot":
            beta = pose[self.i, 2] + self.normal
            return np.array([[math.cos(beta), math.sin(beta), 0.0]])
        if self.kind == "rod":
            way = place(pose, self.j, self.arm_j) - place(pose, self.i, self.arm_i)
            return np.array([[*(way / max(float(np.hypot(*way)), 1e-300)), 0.0]])
        return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

    def columns(self, pose: Array) -> Array:
        """Effect of each unit impulse on all bodies (impulses, bodies, 3), torques about mass
        centres.
        """
        unit = self.units(pose)
        at_i, at_j = self._points(pose)
        columns = np.zeros((len(unit), len(pose), 3))
        for sign, body, point in ((1.0, self.j, at_j), (-1.0, self.i, at_i)):
            x, y = point - pose[body, :2]
            columns[:, body] += sign * unit
            columns[:, body, 2] += sign * (x * unit[:, 1] - y * unit[:, 0])
        return columns

    def _points(self, pose: Array) -> tuple[Array, Array]:
        """Where the impulse acts on i and on j."""
        on_i, on_j = place(pose, self.i, self.arm_i), place(pose, self.j, self.arm_j)
        if self.kind == "slot":
            normal = self.units(pose)[0, :2]
            on_i = on_j - normal * (normal @ (on_j - on_i) - self.target)
        elif self.kind == "contact":
            beta = pose[self.i, 2] + self.normal
            normal = np.array([math.cos(beta), math.sin(beta)])
            on_i = on_j = on_j - self.radius * normal
        return on_i, on_j

    def aim(self, value: float, h: float) -> None:
        """Set the value that the constraint has at the end of the next step.

        pymunk first moves the bodies and then corrects their rates: the rates of this step move
        them in the next.
        """
        self.target = value
        if self.kind == "slot":
            self.native.groove_a, self.native.groove_b = self.groove()
        elif self.kind == "rod":
            self.native.distance = value
        else:
            a, b = self.native.a, self.native.b
            angle = b.angle - a.angle + h * (b.angular_velocity - a.angular_velocity)
            # a motor of pymunk turns a against b
            self.native.rate = -(value - angle) / h

    def groove(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Both ends of a slot in axes of i, from its mass centre."""
        c, s = math.cos(self.normal), math.sin(self.normal)
        x, y = self.arm_i[0] + self.target * c, self.arm_i[1] + self.target * s
        return (x - self.reach * s, y + self.reach * c), (x + self.reach * s, y - self.reach * c)


@dataclass(eq=False)
class SpringImpulse:
    """A spring or damper of the space, and the sign of its impulse by the motion."""

    part: ImpulseConstraint
    sense: Callable[[Array, Array], float]

    def impulse(self, pose: Array, vel: Array) -> Array:
        """Impulse of the last step on all bodies (bodies, 3)."""
        size = math.copysign(self.part.native.impulse, self.sense(pose, vel))
        return np.asarray(size * self.part.columns(pose)[0])


def stretched(part: ImpulseConstraint, rest: float, stiffness: float) -> SpringImpulse:
    """A spring of length or angle: its impulse on j is opposite to the extension."""

    def sense(pose: Array, vel: Array) -> float:
        if part.kind == "turn":
            return -stiffness * float(pose[part.j, 2] - pose[part.i, 2] - rest)
        way = place(pose, part.j, part.arm_j) - place(pose, part.i, part.arm_i)
        return -stiffness * float(np.hypot(*way) - rest)

    return SpringImpulse(part, sense)


def damped(part: ImpulseConstraint) -> SpringImpulse:
    """A damper of length or angle: its impulse on j is opposite to the rate."""

    def sense(pose: Array, vel: Array) -> float:
        return -float((part.columns(pose)[0] * vel).sum())

    return SpringImpulse(part, sense)
