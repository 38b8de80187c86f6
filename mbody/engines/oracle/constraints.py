"""The oracle's constraints: Φ as in textbooks, derivatives by complex steps and jets."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engines.independent_reading import law_by_formula
from mbody.engines.jets import Jet
from mbody.engines.oracle.geometry import Geometry, ReferenceNumbers
from mbody.engines.oracle.measured import formula_of_positions
from mbody.laws import Law, MeasuredFormula
from mbody.model.coupling import Coupling
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.joints import (
    CamFollower,
    CustomJoint,
    Distance,
    Fixed,
    Gear,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)

__all__ = ["STEP", "Constraints"]

STEP = 1e-30  # of the complex step


def law_at(law: Law, t: Any) -> Any:
    """A law at a time that is a float, complex (f + f′ i Im t) or a jet."""
    law = law_by_formula(law)
    if isinstance(t, Jet):
        return t.through(*law.derivatives(t.f))
    if isinstance(t, complex | np.complexfloating):
        f, f1, _ = law.derivatives(float(t.real))
        return f + 1j * f1 * t.imag
    return law(t)


def law_around(law: Law, angle: Any) -> Any:
    """A law of one turn at angles that are floats, complex arrays or jets."""
    law = law_by_formula(law)
    if isinstance(angle, Jet):
        return angle.through(*law.derivatives(angle.f % (2.0 * math.pi)))
    f, f1, _ = law.derivatives(np.real(angle) % (2.0 * math.pi))
    return f + 1j * f1 * np.imag(angle) if np.iscomplexobj(angle) else f


def _real(x: Any) -> Any:
    return np.real(x) if not isinstance(x, Jet) else x.f


def _direction(dx: Any, dy: Any) -> Any:
    """Angle of a vector [rad], with derivatives, in the principal range."""
    # the finite one of both ratios
    flat = np.all(np.abs(_real(dx)) >= np.abs(_real(dy)))
    found = np.arctan(dy / dx) if flat else -np.arctan(dx / dy)
    shift = np.arctan2(_real(dy), _real(dx)) - _real(found)
    return found + shift


def _nearest(arc: Any, radius: float) -> Any:
    """An arc about a circle of that radius without whole turns."""
    round_ = 2.0 * math.pi * radius
    return arc - round_ * np.round(_real(arc) / round_)


class Constraints(Geometry):
    """Φ, Φ_q, ν and γ of one mechanism."""

    def phi(self, q: Any, t: Any) -> np.ndarray:
        """Φ (m,), or (m, k) for q (3n, k); takes floats, complex numbers and jets."""
        return self._phi(self.with_ground(q), t)

    def _phi(self, q_all: Any, t: Any) -> np.ndarray:
        return np.array([row for e in self.elements for row in self._rows(e, q_all, t)])

    def _rows(self, e: Any, q: Any, t: Any) -> list[Any]:
        """The rows of one element at q (3n + 3,)."""
        if isinstance(e, CustomJoint):
            return self._custom_phi(e, q, t)
        if isinstance(e, Coupling):
            whole: Any = e
            parts = [term.factor * self._coordinate(term, q) for term in e.parts]
            return [sum(parts) - whole.value]
        if isinstance(e, AngleDriver):
            return [self._angle(q, e.body) - self._angle(q, e.relative_to) - self._law(e, q, t)]
        (xi, yi), (xj, yj) = self.place(q, e.i), self.place(q, e.j)
        if isinstance(e, Revolute):
            return [xj - xi, yj - yi]
        direction = self._angle(q, e.i.body) + e.i.angle
        turn = self._angle(q, e.j.body) + e.j.angle - direction
        if isinstance(e, Fixed):
            return [xj - xi, yj - yi, turn]
        if isinstance(e, Prismatic):
            return [np.cos(direction) * (yj - yi) - np.sin(direction) * (xj - xi), turn]
        along = np.cos(direction) * (xj - xi) + np.sin(direction) * (yj - yi)
        across = np.cos(direction) * (yj - yi) - np.sin(direction) * (xj - xi)
        if isinstance(e, PinSlot):
            return [across]
        if isinstance(e, RackPinion):
            return [along + e.radius * turn - e.offset]
        if isinstance(e, Rolling) and e.on_radius is None:
            return [across - e.radius, along + e.radius * turn - e.offset]
        if isinstance(e, CamFollower):
            # the profile in polar coordinates of the cam's axes, opposite to its sense of rotation
            sense = 1.0 if e.clockwise else -1.0
            beyond = e.base_radius + e.roller if e.base_radius is not None else 0.0
            if not e.flat:
                polar = _direction(along, across)
                apart = np.sqrt(along * along + across * across)
                return [apart - beyond - law_around(e.profile, sense * polar)]
            # the distance of the face's line from the centre is the support function of the cam
            face = direction + turn
            support = np.cos(face) * (yj - yi) - np.sin(face) * (xj - xi)
            return [support - beyond - law_around(e.profile, sense * (turn + 0.5 * math.pi))]
        if isinstance(e, Gear | Rolling):
            ri, rj = self.signed_radii(e)
            # rolling: equal arcs on both wheels
            line = _direction(xj - xi, yj - yi)
            first = self._angle(q, e.i.body) + e.i.angle - line
            second = self._angle(q, e.j.body) + e.j.angle - line
            arcs = _nearest(ri * first + rj * second + (ri + rj) * e.phase, ri + rj)
            apart = np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - (ri + rj)
            return [arcs] if isinstance(e, Gear) else [apart, arcs]
        if isinstance(e, Distance):
            return [np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - e.length(0.0)]
        if isinstance(e, DistanceDriver):
            return [np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - self._law(e, q, t)]
        if isinstance(e, CoordinateDriver):
            return [along - self._law(e, q, t)]
        return list(e.equations((xi, yi, direction), (xj, yj, direction + turn)))

    def _law(self, driver: Any, q: Any, t: Any) -> Any:
        """What a driver follows, at q and t that are floats, complex numbers or jets."""
        if not isinstance(driver.law, MeasuredFormula):
            return law_at(driver.law, t)
        inputs = {one.name: law_at(one.value, t) for one in self.mechanism.inputs}
        return formula_of_positions(self, driver.law, q, t, inputs)

    def _coordinate(self, term: Any, q: Any) -> Any:
        """The angle, distance or displacement of a term of a coupling."""
        if term.angle is not None:
            return self._angle(q, term.angle) - self._angle(q, term.relative_to)
        i, j = term.distance or term.coordinate
        (xi, yi), (xj, yj) = self.place(q, i), self.place(q, j)
        if term.distance is not None:
            return np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2)
        direction = self._angle(q, i.body) + i.angle
        return np.cos(direction) * (xj - xi) + np.sin(direction) * (yj - yi)

    @staticmethod
    def signed_radii(e: Any) -> tuple[float, float]:
        """Radii of two wheels from their centres towards each other, that in a ring negative."""
        ri, rj = (e.radius_i, e.radius_j) if isinstance(e, Gear) else (e.on_radius, e.radius)
        if not e.internal:
            return ri, rj
        return (ri, -rj) if ri > rj else (-ri, rj)

    def reaction_point(self, q_all: Any, e: Any) -> tuple[float, float]:
        """World place of the reaction point of a joint: at j, or the contact of wheels."""
        (xi, yi), (xj, yj) = self.place(q_all, e.i), self.place(q_all, e.j)
        if isinstance(e, Gear) or (isinstance(e, Rolling) and e.on_radius is not None):
            radius = self.signed_radii(e)[0]
            apart = math.hypot(xj - xi, yj - yi)
            return xi + radius * (xj - xi) / apart, yi + radius * (yj - yi) / apart
        if isinstance(e, CamFollower):
            return self._touched(q_all, e, (xi, yi), (xj, yj))
        if isinstance(e, RackPinion | Rolling):
            direction = self._angle(q_all, e.i.body) + e.i.angle
            return xj + e.radius * math.sin(direction), yj - e.radius * math.cos(direction)
        return xj, yj

    def _touched(self, q_all: Any, e: Any, centre: Any, follower: Any) -> tuple[float, float]:
        """Contact point of a cam: on its contour, by the tangent of a curve z(φ) in the cam's axes,
        with complex numbers for vectors.
        """
        axes = self._angle(q_all, e.i.body) + e.i.angle
        sense = 1.0 if e.clockwise else -1.0
        beyond = e.base_radius + e.roller if e.base_radius is not None else 0.0
        d = complex(*np.subtract(follower, centre)) * np.exp(-1j * axes)
        if e.flat:
            polar = self._angle(q_all, e.j.body) + e.j.angle + 0.5 * math.pi - axes
        else:
            polar = float(np.angle(d))
        f, f1, _ = law_by_formula(e.profile).derivatives((sense * polar) % (2.0 * math.pi))
        h, h1 = f + beyond, sense * f1
        if e.flat:  # the contour of a support function: (h + i h′) e^(iφ)
            touched = (h + 1j * h1) * np.exp(1j * polar)
        else:  # the tangent of the pitch curve R e^(iφ) is (R′ + i R) e^(iφ); inwards is i times it
            tangent = (h1 + 1j * h) * np.exp(1j * polar)
            touched = d + e.roller * 1j * tangent / abs(tangent)
        world = complex(*centre) + touched * np.exp(1j * axes)
        return world.real, world.imag

    def _angle(self, q: Any, body: str) -> Any:
        return self.pose(q, body)[2]

    def _physics(self, e: CustomJoint, q: Any, v: Any, t: Any) -> tuple[Any, ...]:
        sides = (self.side(q, v, e.i.body), self.side(q, v, e.j.body))
        numbers: Any = ReferenceNumbers(self)
        (primitive,) = e.primitives(numbers)
        assert primitive.function is not None
        return tuple(primitive.function(*sides, np.array(primitive.parameters), t))

    def _custom_phi(self, e: CustomJoint, q: Any, t: Any) -> list[Any]:
        if q.ndim == 1:
            return list(self._physics(e, q, np.zeros(len(q)), t)[0][: len(e.rows)])
        columns = [self._custom_phi(e, column, t) for column in q.T]
        return list(np.array(columns).T)

    def phi_q_all(self, q: Any, t: float) -> np.ndarray:
        """Φ_q (m, 3n + 3) by complex step, the ground's columns last."""
        q_all = self.with_ground(np.asarray(q, dtype=float))
        steps = q_all[:, None] + 1j * STEP * np.eye(len(q_all))
        return self._phi(steps, t).reshape(self.m, len(q_all)).imag / STEP

    def phi_q(self, q: Any, t: float) -> np.ndarray:
        """Φ_q (m, 3n) by complex step."""
        return self.phi_q_all(q, t)[:, : 3 * self.n]

    def nu(self, q: Any, t: float) -> np.ndarray:
        """ν = −Φ_t (m,) by complex step in time."""
        return -self.phi(np.asarray(q, dtype=complex), complex(t, STEP)).imag / STEP

    def gamma(self, q: Any, v: Any, t: float) -> np.ndarray:
        """γ (m,) = −d²Φ(q + s v, t + s)/ds² at s = 0, exact by jets."""
        line = np.array([Jet(x, x1) for x, x1 in zip(q, v)], dtype=object)
        rows = self.phi(line, Jet(float(t), 1.0))
        return np.array([-row.f2 if isinstance(row, Jet) else 0.0 for row in rows])
