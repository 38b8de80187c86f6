"""Constraint rows of cut joints and drivers, by the kinematics of another engine.

A row constrains n·d, with n fixed in body i or along d, or an angle. Its force n on j acts at the
place on j, the opposite on i at the same place. The Jacobian is the generalised force of n. With p
the place on j, and of body i the point that is there:  Φ̇ = n·v_rel,  Φ̈ = n·(a_rel − 2 ω_i ×
v_rel).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engines.spanning_tree import MarkerFrame, marker_frame
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element
from mbody.model.joints import Distance, Fixed, PinSlot, Prismatic, Revolute
from mbody.system.system import System

__all__ = ["CUT_JOINTS", "ConstraintRow", "constraint_rows"]

Array = np.ndarray

#: Joints that have rows of this kind.
CUT_JOINTS = (Revolute, Prismatic, Fixed, Distance, PinSlot)


@dataclass(frozen=True)
class ConstraintRow:
    """One row: its force direction, value, rate, acceleration and Jacobian.

    Attributes
    ----------
    i, j : str
        The bodies.
    place : array (2,)
    force : array (2,)
        On j at the place, of a unit multiplier.
    torque : float
    value, rate, change : float
        The constrained quantity and its derivatives.
    jacobian : array (n,)
    """

    i: str
    j: str
    place: Array
    force: Array
    torque: float
    value: float
    rate: float
    change: float
    jacobian: Array


def constraint_rows(system: System, element: Element, bodies: Any) -> list[ConstraintRow]:
    """The rows of a joint or a driver.

    Parameters
    ----------
    bodies : mapping
        Poses by name, with ``place``, ``angle``, ``arm``, ``moving``, ``velocity``,
        ``acceleration`` and ``pulled``.
    """
    if isinstance(element, AngleDriver):
        return [_angle(element.relative_to, element.body, bodies, 0.0)]
    one: Any = element
    i, j = marker_frame(system, element, "i"), marker_frame(system, element, "j")
    row = _PointPair(one.i.body, one.j.body, i, j, bodies)
    direction = bodies[one.i.body].angle + i.angle
    along = np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    turn = _angle(one.i.body, one.j.body, bodies, j.angle - i.angle)
    if isinstance(element, Revolute):
        return [row.fixed(np.array([1.0, 0.0])), row.fixed(np.array([0.0, 1.0]))]
    if isinstance(element, Fixed):
        return [row.fixed(np.array([1.0, 0.0])), row.fixed(np.array([0.0, 1.0])), turn]
    if isinstance(element, Prismatic):
        return [row.fixed(across), turn]
    if isinstance(element, PinSlot):
        return [row.fixed(across)]
    if isinstance(element, CoordinateDriver):
        return [row.fixed(along)]
    assert isinstance(element, Distance | DistanceDriver)
    return [row.distance()]


def _angle(i: str, j: str, bodies: Any, more: float) -> ConstraintRow:
    """θ_j − θ_i + `more`, within −π … π."""
    a, b = bodies[i], bodies[j]
    jacobian = b.jacobian[2] - a.jacobian[2]
    rate, change = b.velocity[2] - a.velocity[2], b.acceleration[2] - a.acceleration[2]
    turn = math.remainder(b.angle - a.angle + more, 2.0 * math.pi)
    return ConstraintRow(
        i, j, b.place, np.zeros(2), 1.0, turn, float(rate), float(change), jacobian
    )


class _PointPair:
    """Rows between two places."""

    def __init__(self, i: str, j: str, at_i: MarkerFrame, at_j: MarkerFrame, bodies: Any) -> None:
        self.i, self.j, self.a, self.b = i, j, bodies[i], bodies[j]
        self.near = self.a.place + self.a.arm(at_i)
        self.place = self.b.place + self.b.arm(at_j)
        self.d = self.place - self.near
        # the point of body i that coincides with the place on j
        arms = self.place - self.a.place, self.place - self.b.place
        self.v = self.b.velocity_at(arms[1]) - self.a.velocity_at(arms[0])
        aa, ab = self.a.acceleration_at(arms[0]), self.b.acceleration_at(arms[1])
        w = self.a.velocity[2]
        self.acceleration = ab - aa - 2.0 * w * np.array([-self.v[1], self.v[0]])

    def fixed(self, n: Array) -> ConstraintRow:
        """n·d, n fixed in i."""
        return self._row(n, float(n @ self.d), float(n @ self.acceleration))

    def distance(self) -> ConstraintRow:
        """|d|: its second derivative contains the square of the transverse velocity."""
        length = math.hypot(*self.d)
        n = self.d / length
        across = float(n[0] * self.v[1] - n[1] * self.v[0])
        return self._row(n, length, float(n @ self.acceleration) + across * across / length)

    def _row(self, n: Array, value: float, change: float) -> ConstraintRow:
        jacobian = self.b.generalized_force(n, 0.0, self.place)
        jacobian = jacobian - self.a.generalized_force(n, 0.0, self.place)
        return ConstraintRow(
            self.i, self.j, self.place, n, 0.0, value, float(n @ self.v), change, jacobian
        )
