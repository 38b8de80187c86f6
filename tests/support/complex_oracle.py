"""Driven motions and their forces by dense textbook equations in complex numbers.

The equations are those of joints, drivers and loads as their docstrings have them, in the
coordinates of mass centres; a complex step of 1e-30 in one number of the description gives the
derivative of everything, to rounding. Nothing of mbody's kernels is used.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.model.coupling import Coupling
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.joints import (
    CamFollower,
    Distance,
    Fixed,
    Gear,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)
from tests.support.complex_friction import GIVEN, ComplexFriction, has_friction
from tests.support.complex_loads import applied
from tests.support.complex_reading import STEP, ComplexReading, remainder
from tests.support.taylor import Taylor, circle, cos, direction, lines, sin, sqrt

__all__ = ["ComplexOracle", "Unwritten"]


class Unwritten(Exception):
    """What the equations here do not have."""


class ComplexOracle:
    """One instant of one mechanism with a complex step in one number.

    Parameters
    ----------
    system : System
    by : str
        Dotted name of the number.
    t : float
    given : array (drivers, 3), optional
        Value, rate and acceleration of every driver, instead of the laws.
    """

    def __init__(self, system: Any, by: str, t: float, given: Any = None) -> None:
        self.system, self.mechanism, self.t = system, system.mechanism, t
        self.p = ComplexReading(system, by)
        self.bodies = [body.name for body in self.mechanism.bodies]
        self.n = len(self.bodies)
        self.index = {name: k for k, name in enumerate([*self.bodies, "ground"])}
        self.elements = [e for e in self.mechanism.constraints if not isinstance(e, GIVEN)]
        self.given = given
        self.drivers = {d.name: k for k, d in enumerate(self.mechanism.drivers)}
        self.rows: dict[str, slice] = {}

    # -- geometry ----------------------------------------------------------------------------

    def pose(self, q: Any, body: str) -> tuple[Any, Any, Any]:
        if body == "ground":
            return 0.0, 0.0, 0.0
        k = 3 * self.index[body]
        return q[k], q[k + 1], q[k + 2]

    def place(self, q: Any, element: Any, field: str) -> tuple[Any, Any]:
        """World place of a marker."""
        body = element.places()[field].body
        sx, sy = self.p.arm(element, field)
        if body == "ground":
            return sx, sy
        x, y, angle = self.pose(q, body)
        c, s = circle(angle)
        return x + c * sx - s * sy, y + s * sx + c * sy

    def heading(self, q: Any, element: Any, field: str) -> Any:
        body = element.places()[field].body
        return self.pose(q, body)[2] + self.p.angle(element, field)

    # -- constraints -------------------------------------------------------------------------

    def phi(self, q: Any, t: Any) -> list[Any]:
        found: list[Any] = []
        for e in self.elements:
            own = self._rows(e, q, t)
            self.rows[e.name] = slice(len(found), len(found) + len(own))
            found += own
        return found

    def _law(self, driver: Any, t: Any) -> Any:
        if self.given is None:
            return self.p.law(driver, "law", t)
        value, rate, change = self.given[self.drivers[driver.name]]
        return t.through(value, rate, change) if isinstance(t, Taylor) else value

    def _rows(self, e: Any, q: Any, t: Any) -> list[Any]:
        if isinstance(e, Coupling):
            names = [f"{e.name}.{k}.factor" for k in range(len(e.parts))]
            parts = [self.p[n] * self._term(e, k, q) for k, n in enumerate(names)]
            return [sum(parts[1:], parts[0]) - self.p[f"{e.name}.value"]]
        if isinstance(e, AngleDriver):
            turn = self.pose(q, e.body)[2] - self.pose(q, e.relative_to)[2]
            return [turn - self._law(e, t)]
        if not {"i", "j"} <= e.places().keys():
            raise Unwritten(type(e).__name__)
        (xi, yi), (xj, yj) = self.place(q, e, "i"), self.place(q, e, "j")
        axis, other = self.heading(q, e, "i"), self.heading(q, e, "j")
        dx, dy, turn = xj - xi, yj - yi, other - axis
        if isinstance(e, Revolute):
            return [dx, dy]
        if isinstance(e, Fixed):
            return [dx, dy, turn]
        c, s = circle(axis)
        along = c * dx + s * dy
        across = c * dy - s * dx
        if isinstance(e, Prismatic):
            return [across, turn]
        if isinstance(e, PinSlot):
            return [across]
        if isinstance(e, RackPinion):
            return [along + self.p.get(e, "radius") * turn - self.p.get(e, "offset")]
        if isinstance(e, Rolling) and e.on_radius is None:
            radius, offset = self.p.get(e, "radius"), self.p.get(e, "offset")
            return [across - radius, along + radius * turn - offset]
        if isinstance(e, CamFollower):
            return [self._cam(e, (along, across), (dx, dy), axis, other)]
        apart = sqrt(dx * dx + dy * dy)
        if isinstance(e, Gear | Rolling):
            ri, rj = self.radii(e)
            line = direction(dx, dy)
            arcs = ri * (axis - line) + rj * (other - line) + (ri + rj) * self.p.get(e, "phase")
            # equal arcs but for half turns of the line of centres, which either way is square to n
            turns = remainder(arcs * (1.0 / (ri + rj)) + 0.5 * math.pi, math.pi) - 0.5 * math.pi
            return (
                [turns * (ri + rj)]
                if isinstance(e, Gear)
                else [apart - (ri + rj), turns * (ri + rj)]
            )
        if isinstance(e, Distance):
            return [apart - self.p.law(e, "length", 0.0)]
        if isinstance(e, DistanceDriver):
            return [apart - self._law(e, t)]
        if isinstance(e, CoordinateDriver):
            return [along - self._law(e, t)]
        raise Unwritten(type(e).__name__)

    def _term(self, coupling: Any, k: int, q: Any) -> Any:
        term = coupling.parts[k]
        if term.angle is not None:
            return self.pose(q, term.angle)[2] - self.pose(q, term.relative_to)[2]
        (ax, ay), (bx, by) = (self.place(q, coupling, f"{k}.{end}") for end in "ij")
        dx, dy = bx - ax, by - ay
        if term.distance is not None:
            return sqrt(dx * dx + dy * dy)
        axis = self.heading(q, coupling, f"{k}.i")
        return cos(axis) * dx + sin(axis) * dy

    def radii(self, e: Any) -> tuple[Any, Any]:
        """Radii of two wheels from their centres towards each other, that of a ring negative."""
        first, second = ("radius_i", "radius_j") if isinstance(e, Gear) else ("on_radius", "radius")
        ri, rj = self.p.get(e, first), self.p.get(e, second)
        if not e.internal:
            return ri, rj
        return (ri, -rj) if complex(ri).real > complex(rj).real else (-ri, rj)

    def _beyond(self, e: Any) -> Any:
        base = self.p.get(e, "base_radius")
        return 0.0 if base is None else base + self.p.get(e, "roller")

    def _cam(self, e: Any, polar: Any, d: Any, axis: Any, other: Any) -> Any:
        sign = 1.0 if e.clockwise else -1.0
        if not e.flat:
            angle = remainder(sign * direction(*polar))
            apart = sqrt(d[0] * d[0] + d[1] * d[1])
            return apart - self._beyond(e) - self.p.law(e, "profile", angle)
        support = cos(other) * d[1] - sin(other) * d[0]
        angle = remainder(sign * (other - axis + 0.5 * math.pi))
        return support - self._beyond(e) - self.p.law(e, "profile", angle)

    def touched(self, q: Any, e: Any) -> tuple[Any, Any]:
        """The point of contact of a cam, at complex q."""
        (xi, yi), (xj, yj) = self.place(q, e, "i"), self.place(q, e, "j")
        axis, sign = self.heading(q, e, "i"), 1.0 if e.clockwise else -1.0
        if e.flat:
            polar = self.heading(q, e, "j") + 0.5 * math.pi
        else:
            polar = direction(xj - xi, yj - yi)
        at = remainder(sign * (polar - axis))
        line = Taylor(at, np.ones(1, complex), np.zeros(1, complex))
        law = self.p.law(e, "profile", line)
        h, h1 = law.f + self._beyond(e), sign * law.f1[0]
        c, s = cos(polar), sin(polar)
        if e.flat:
            return xi + h * c - h1 * s, yi + h * s + h1 * c
        # the normal of the pitch curve R e^(iφ), from the cam outwards: R − i R′ turned by φ
        whole = sqrt(h * h + h1 * h1)
        nx, ny = (h * c + h1 * s) / whole, (h * s - h1 * c) / whole
        wheel = self.p.get(e, "roller")
        return xj - wheel * nx, yj - wheel * ny

    # -- the instant -------------------------------------------------------------------------

    def solve(self, q: Any, at_rest: bool = False, real: Any = None) -> dict[str, Any]:
        """Position, velocity, acceleration, multipliers and reactions from a closed position.

        Where joints rub, "real" of the result, as of `ComplexFriction.solve`, serves the oracles of
        other numbers at the same instant.
        """
        n3 = 3 * self.n
        q, v = np.array(q, complex), np.zeros(n3, complex)
        # one step brings the complex step, as far as the position is closed; another closes it
        for _ in range(2):
            phi, g, _, _ = self._linear(q, v)
            q = q - _solved(g, phi)
        _, g, nu, _ = self._linear(q, v)
        a = np.zeros(n3, complex)
        if not at_rest:
            v = _solved(g, nu)
            gamma = self._linear(q, v)[3]
            a = _solved(g, gamma)
        masses = [self.p.mass(body) for body in self.mechanism.bodies]
        m = np.array([x for mass, inertia in masses for x in (mass, mass, inertia)], complex)
        right = applied(self, q, v) - m * a
        friction: dict[str, Any] = {}
        if any(has_friction(joint) for joint in self.mechanism.joints):
            found = ComplexFriction(self, q, v, g, right).solve(real)
            lam, friction, real = (found[key] for key in ("multipliers", "friction", "real"))
        else:
            lam = _least(g, right)
        return {
            "q": q,
            "v": v,
            "a": a,
            "g": g,
            "real": real,
            "reactions": self._reactions(q, lam, friction),
            "efforts": {d.name: -lam[self.rows[d.name]][0] for d in self.mechanism.drivers},
        }

    def accelerations(self, q: Any, v: Any, t: float) -> Any:
        """Of free motion: M a + Φ_qᵀ λ = f with Φ_q a = γ."""
        self.t = t
        _, g, _, gamma = self._linear(q, v)
        masses = [self.p.mass(body) for body in self.mechanism.bodies]
        m = np.array([x for mass, inertia in masses for x in (mass, mass, inertia)], complex)
        count = len(g)
        whole = np.block([[np.diag(m), g.T], [g, np.zeros((count, count))]])
        right = np.concatenate([applied(self, q, v), gamma])
        return np.linalg.solve(whole, right)[: len(m)]

    def _linear(self, q: Any, v: Any) -> tuple[Any, Any, Any, Any]:
        """Φ, Φ_q, ν = −Φ_t and γ."""
        along, clock = lines(q, v, self.t)
        rows = self.phi(along, clock)
        count = 3 * self.n
        g = np.array([row.f1[:count] for row in rows])
        nu = np.array([-row.f1[count] for row in rows])
        gamma = np.array([-row.f2[count + 1] for row in rows])
        return np.array([row.f for row in rows]), g, nu, gamma

    def reaction_point(self, q: Any, e: Any) -> tuple[Any, Any]:
        (xi, yi), (xj, yj) = self.place(q, e, "i"), self.place(q, e, "j")
        if isinstance(e, Gear) or (isinstance(e, Rolling) and e.on_radius is not None):
            radius, dx, dy = self.radii(e)[0], xj - xi, yj - yi
            apart = sqrt(dx * dx + dy * dy)
            return xi + radius * dx / apart, yi + radius * dy / apart
        if isinstance(e, CamFollower):
            return self.touched(q, e)
        if isinstance(e, RackPinion | Rolling):
            axis, radius = self.heading(q, e, "i"), self.p.get(e, "radius")
            return xj + radius * sin(axis), yj - radius * cos(axis)
        return xj, yj

    def column(self, q: Any, e: Any, body: str) -> Any:
        """Rows of an element by the coordinates of a body that may be the ground: (rows, 3)."""
        one, zero = np.eye(3, dtype=complex), np.zeros(3, complex)
        moved = {name: self.pose(q, name) for name in self.bodies} | {"ground": (0.0, 0.0, 0.0)}
        along = []
        for name in self.bodies:
            own = one if name == body else np.zeros((3, 3), complex)
            along += [Taylor(x, f1, zero) for x, f1 in zip(moved[name], own, strict=True)]
        return np.array([row.f1 for row in self._rows(e, along, Taylor(self.t, zero, zero))])

    def _reactions(self, q: Any, lam: Any, friction: Any) -> dict[str, Any]:
        """(Fx, Fy, T) of every joint on its body j, or the negative of that on i where j is the
        ground, at the reaction point.
        """
        found = {}
        for joint in self.mechanism.joints:
            wrench = friction.get(joint.name, np.zeros(3, complex))
            if joint.name in self.rows:
                body = joint.j.body if joint.j.body != "ground" else joint.i.body
                sign = -1.0 if body == joint.j.body else 1.0
                fx, fy, torque = sign * self.column(q, joint, body).T @ lam[self.rows[joint.name]]
                (px, py), (x, y, _) = self.reaction_point(q, joint), self.pose(q, body)
                torque = torque - (px - x) * fy + (py - y) * fx
                wrench = wrench + np.array([fx, fy, torque])
            found[joint.name] = wrench
        return found


def _solved(g: Any, right: Any) -> Any:
    """Rows solved; of redundant ones that fit together by the normal equations."""
    if g.shape[0] == g.shape[1]:
        return np.linalg.solve(g, right)
    return np.linalg.solve(g.T @ g, g.T @ right)


def _least(g: Any, right: Any) -> Any:
    """Multipliers by the balance; the least ones of redundant rows."""
    if g.shape[0] == g.shape[1]:
        return np.linalg.solve(g.T, right)
    return g @ np.linalg.solve(g.T @ g, right)


def derivative(x: Any) -> Any:
    """By the number with the complex step."""
    return np.asarray(x).imag / STEP
