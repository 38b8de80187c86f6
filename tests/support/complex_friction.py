"""Friction of joints in complex numbers: the forces at every place with friction, all at once.

The unknowns are the multipliers of all rows and the forces at the places of contact. Newton's
method takes the slope at real numbers, by complex steps: where its values have converged one more
step brings the complex step of a number of the description, to first order exactly.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.model.joints import (
    BandBrake,
    Belt,
    CamFollower,
    Clutch,
    FrictionForce,
    Gear,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)
from tests.support.taylor import cos, exp, lifted, sin, size, sqrt

__all__ = ["GIVEN", "ComplexFriction", "has_friction"]

#: Joints without rows, whose friction follows a law.
GIVEN = (BandBrake, Belt, Clutch, FrictionForce)
STEP = 1e-30
#: A rate below this part of the swiftest motion is none.
RESTS = 1e-11
Array = Any


def has_friction(joint: Any) -> bool:
    fields = ("friction", "viscous", "efficiency", "pressure_angle", "resistance")
    return isinstance(joint, GIVEN) or any(getattr(joint, f, None) is not None for f in fields)


class ComplexFriction:
    """The equations of one instant of a `ComplexOracle`."""

    def __init__(self, o: Any, q: Any, v: Any, g: Any, right: Any) -> None:
        self.o, self.q, self.v, self.g, self.right = o, q, v, g, right
        self.joints = [joint for joint in o.mechanism.joints if has_friction(joint)]
        # of the position alone, which stays as it is
        self.points = {joint.name: o.reaction_point(q, joint) for joint in self.joints}
        self.normals: dict[str, tuple[Any, Any]] = {}
        velocity_scale = float(np.abs(v.real).max(initial=0.0))
        self.rates = {joint.name: self._rate(joint) for joint in self.joints}
        self.slip_signs = {
            name: 0.0
            if abs(complex(r).real) <= RESTS * velocity_scale
            else math.copysign(1.0, r.real)
            for name, r in self.rates.items()
        }
        self.columns = {
            joint.name: o.column(q, joint, self._side(joint))
            for joint in self.joints
            if joint.name in o.rows
        }
        self.count = [self._unknowns(joint) for joint in self.joints]

    def _side(self, joint: Any) -> str:
        return str(joint.j.body if joint.j.body != "ground" else joint.i.body)

    def _unknowns(self, joint: Any) -> int:
        if isinstance(joint, Revolute):
            return 2
        if isinstance(joint, Prismatic):
            return 2 if joint.length else 0
        if isinstance(joint, CamFollower):
            return 1
        return int(getattr(joint, "efficiency", None) is not None)

    # -- kinematics of contacts ----------------------------------------------------------------

    def _velocity(self, body: str, place: Any) -> tuple[Any, Any]:
        (x, y, _), (vx, vy, w) = self.o.pose(self.q, body), self.o.pose(self.v, body)
        return vx - w * (place[1] - y), vy + w * (place[0] - x)

    def _along(self, joint: Any) -> tuple[Any, Any]:
        if isinstance(joint, CamFollower):
            fx, fy = self._normal(joint)
            return -fy, fx
        axis = self.o.heading(self.q, joint, "i")
        return cos(axis), sin(axis)

    def _normal(self, joint: Any) -> tuple[Any, Any]:
        """The direction in which the first row of a joint pushes body j, λ being −1."""
        if joint.name in self.normals:
            return self.normals[joint.name]
        side = self._side(joint)
        gx, gy, _ = self.o.column(self.q, joint, side)[0]
        whole = sqrt(gx * gx + gy * gy)
        if side != joint.j.body:
            whole = -whole
        self.normals[joint.name] = gx / whole, gy / whole
        return self.normals[joint.name]

    def _rate(self, joint: Any) -> Any:
        wi, wj = (self.o.pose(self.v, body)[2] for body in joint.bodies)
        if isinstance(joint, Revolute | BandBrake | Clutch | Gear | RackPinion | Rolling):
            return complex(wj - wi)
        if isinstance(joint, Belt):
            side = -1.0 if joint.crossed else 1.0
            ri, rj = self.o.p.get(joint, "radius_i"), self.o.p.get(joint, "radius_j")
            return complex(ri * wi - side * rj * wj)
        place = self.points[joint.name]
        (ax, ay), (bx, by) = (self._velocity(body, place) for body in joint.bodies)
        ux, uy = self._along(joint)
        return complex((bx - ax) * ux + (by - ay) * uy)

    # -- the equations -----------------------------------------------------------------------

    def residual(self, z: Any) -> Any:
        o = self.o
        lam, rest = z[: len(self.g)], list(z[len(self.g) :])
        force = np.zeros(3 * o.n + 3, complex)
        said: list[Any] = []
        for joint, count in zip(self.joints, self.count, strict=True):
            own, rest = rest[:count], rest[count:]
            wrench, equations = self._contact(joint, lam, own)
            said += equations
            self._act(force, joint, wrench)
        balance = self.right - self.g.T @ lam + force[:-3]
        return np.concatenate([balance, np.array(said, complex)])

    def _act(self, force: Any, joint: Any, wrench: Any) -> None:
        px, py = self.points[joint.name]
        fx, fy, torque = wrench
        for body, sign in ((joint.j.body, 1.0), (joint.i.body, -1.0)):
            k, (x, y, _) = 3 * self.o.index[body], self.o.pose(self.q, body)
            force[k] += sign * fx
            force[k + 1] += sign * fy
            force[k + 2] += sign * (torque + (px - x) * fy - (py - y) * fx)

    def _pushed(self, joint: Any, lam: Any, row: int | None = None) -> tuple[Any, Any, Any]:
        """(Fx, Fy, T) of a joint's rows, or of one of them, on body j at the joint's place."""
        rows, column = self.o.rows[joint.name], self.columns[joint.name]
        own = lam[rows]
        if row is not None:
            own, column = own[row : row + 1], column[row : row + 1]
        side = self._side(joint)
        fx, fy, torque = (-1.0 if side == joint.j.body else 1.0) * column.T @ own
        (px, py), (x, y, _) = self.points[joint.name], self.o.pose(self.q, side)
        return fx, fy, torque - (px - x) * fy + (py - y) * fx

    def _mu(self, joint: Any) -> Any:
        p = self.o.p
        kinetic = p.get(joint, "friction")
        if kinetic is None:
            return 0.0
        if joint.stribeck is None:
            return kinetic
        speed = size(self.rates[joint.name])
        if isinstance(joint, Revolute):
            speed = speed * p.get(joint, "pin_radius")
        if isinstance(joint, CamFollower) and joint.pin_radius is not None:
            speed = speed * p.get(joint, "pin_radius") / p.get(joint, "roller")
        ratio = speed / p.get(joint, "stribeck")
        return kinetic + (p.get(joint, "static") - kinetic) * exp(-ratio * ratio)

    def _given(self, joint: Any, field: str) -> Any:
        p = self.o.p
        given = p.law(joint, field, self.o.t)
        if complex(given).real < 0.0:
            return 0.0
        if joint.stribeck is None:
            return given
        speed = self.rates[joint.name] / p.get(joint, "stribeck")
        return given * (1.0 + (p.get(joint, "static") - 1.0) * exp(-speed * speed))

    def _contact(self, joint: Any, lam: Any, own: Any) -> tuple[Any, list[Any]]:
        p, slip_sign, rate = self.o.p, self.slip_signs[joint.name], self.rates[joint.name]
        viscous = getattr(joint, "viscous", None)
        drag = 0.0 if viscous is None else -p.get(joint, "viscous") * rate
        if isinstance(joint, Clutch):
            return (0.0, 0.0, -slip_sign * self._given(joint, "torque")), []
        if isinstance(joint, FrictionForce):
            (ux, uy), force = self._along(joint), -slip_sign * self._given(joint, "force")
            return (force * ux, force * uy, 0.0), []
        if isinstance(joint, BandBrake):
            return (0.0, 0.0, -slip_sign * self._band(joint, slip_sign)), []
        if isinstance(joint, Belt):
            return self._belt(joint, slip_sign), []
        if isinstance(joint, Gear | RackPinion):
            return self._teeth(joint, lam, own, slip_sign)
        if isinstance(joint, Rolling):
            nx, ny, _ = self._pushed(joint, lam, 0)
            px, py = self._normal(joint)
            arm = p.get(joint, "resistance")
            return (
                0.0,
                0.0,
                -slip_sign * (0.0 if arm is None else arm) * size(nx * px + ny * py),
            ), []
        mu = self._mu(joint)
        fx, fy, torque = self._pushed(joint, lam)
        if isinstance(joint, Revolute):
            nx, ny = own
            pressed = sqrt(nx * nx + ny * ny)
            said = [nx + slip_sign * mu * ny - fx, ny - slip_sign * mu * nx - fy]
            radius = p.get(joint, "pin_radius")
            arm = 0.0 if radius is None else radius
            return (0.0, 0.0, drag - slip_sign * mu * arm * pressed), said
        ux, uy = self._along(joint)
        press = uy * -fx + ux * fy
        said = []
        if isinstance(joint, Prismatic) and joint.length:
            one, two = own
            height = p.get(joint, "height")
            half = 0.5 * p.get(joint, "length")
            sides = 0.5 * (0.0 if height is None else height)
            turn = sum(sides * mu * -slip_sign * force for force in own)
            said = [one + two - press, half * (one - two) + turn - torque]
            friction = -slip_sign * mu * (size(one) + size(two))
        elif isinstance(joint, CamFollower):
            (friction,) = own
            said = [friction + slip_sign * mu * size(press)]
            if joint.pin_radius is not None:
                arm = p.get(joint, "pin_radius") * mu / sqrt(1.0 + mu * mu)
                whole = sqrt(press * press + friction * friction)
                said = [friction * p.get(joint, "roller") + slip_sign * arm * whole]
        else:
            friction = -slip_sign * mu * size(press)
        return ((friction + drag) * ux, (friction + drag) * uy, 0.0), said

    def _band(self, joint: Any, slip_sign: float) -> Any:
        p = self.o.p
        ratio = exp(p.get(joint, "friction") * p.get(joint, "wrap") * slip_sign)
        # T₁ = ratio T₂ of the slipping band, and F ℓ + T₁ b₁ = T₂ b₂
        pull = self._given(joint, "force") * p.get(joint, "lever")
        second = pull / (p.get(joint, "arm") - p.get(joint, "helping_arm") * ratio)
        return size(ratio * second - second) * p.get(joint, "radius")

    def _belt(self, joint: Any, slip_sign: float) -> Any:
        p, o = self.o.p, self.o
        mean = p.law(joint, "tension", o.t)
        holds = self._given(joint, "tension") / mean
        (xi, yi), (xj, yj) = o.place(self.q, joint, "i"), o.place(self.q, joint, "j")
        apart = sqrt((xj - xi) ** 2 + (yj - yi) ** 2)
        ux, uy = (xj - xi) / apart, (yj - yi) / apart
        side = -1.0 if joint.crossed else 1.0
        ri, rj = p.get(joint, "radius_i"), p.get(joint, "radius_j")
        sine = complex((ri - side * rj) / apart)
        lean = lifted(sine, math.asin(sine.real), 1.0 / math.sqrt(1.0 - sine.real**2))
        wrap = math.pi + (2.0 * lean if joint.crossed else -2.0 * size(lean))
        ratio = exp(p.get(joint, "friction") * wrap)
        half = slip_sign * holds * mean * (ratio - 1.0) / (ratio + 1.0)
        total = np.zeros(3, complex)
        for n in (1.0, -1.0):
            mx = sin(lean) * ux - n * cos(lean) * uy
            my = sin(lean) * uy + n * cos(lean) * ux
            arm = side * rj * mx, side * rj * my
            tx, ty = xi + ri * mx - xj - arm[0], yi + ri * my - yj - arm[1]
            length = sqrt(tx * tx + ty * ty)
            turning = (arm[0] * ty - arm[1] * tx) / length
            pull = mean + half * math.copysign(1.0, complex(turning).real * side)
            total += np.array([pull * tx / length, pull * ty / length, pull * turning])
        return tuple(total)

    def _teeth(self, joint: Any, lam: Any, own: Any, slip_sign: float) -> tuple[Any, list[Any]]:
        p, o = self.o.p, self.o
        nx, ny = self._normal(joint)
        fx, fy, _ = self._pushed(joint, lam)
        force = fx * nx + fy * ny
        (px, py), (cx, cy) = self.points[joint.name], o.place(self.q, joint, "j")
        ex, ey = cx - px, cy - py
        rj = sqrt(ex * ex + ey * ey)
        said: list[Any] = []
        torque: Any = 0.0
        if joint.efficiency is not None:
            (torque,) = own
            said = [self._power(joint, force, torque, (px, py), (nx, ny)) if slip_sign else torque]
        elif joint.friction is not None:
            angle = p.get(joint, "pressure_angle")
            slide = p.get(joint, "friction") * self._mean_arm(joint) / cos(angle)
            torque = -slip_sign * slide * size(force)
        apart: Any = 0.0
        if joint.pressure_angle is not None:
            angle = p.get(joint, "pressure_angle")
            apart = sin(angle) / cos(angle) * size(force)
        return (apart * ex / rj, apart * ey / rj, torque), said

    def _power(self, joint: Any, force: Any, torque: Any, pitch: Any, normal: Any) -> Any:
        o = self.o
        wi, wj = (o.pose(self.v, body)[2] for body in joint.bodies)
        centres = [o.place(self.q, joint, side) for side in "ij"]
        arms = [(pitch[0] - c[0]) * normal[1] - (pitch[1] - c[1]) * normal[0] for c in centres]
        if isinstance(joint, RackPinion):
            to_j = (torque + force * arms[1]) * (wj - wi)
            to_i = -force * arms[1] * (wj - wi)
        else:
            ri, rj = o.radii(joint)
            carrier = (ri * wi + rj * wj) / (ri + rj)
            to_j = (torque + force * arms[1]) * (wj - carrier)
            to_i = (-torque - force * arms[0]) * (wi - carrier)
        first = complex(to_i).real < complex(to_j).real
        driven, driving = (to_j, to_i) if first else (to_i, to_j)
        return (driven + o.p.get(joint, "efficiency") * driving) / size(wj - wi)

    def _mean_arm(self, joint: Any) -> Any:
        """Mean distance of the contact from the pitch point, between the tip circles."""
        p = self.o.p
        angle = p.get(joint, "pressure_angle")
        if isinstance(joint, RackPinion):
            small = p.get(joint, "radius")
            wheels: list[Any] = [(None, 1.0), (small, 1.0)]
        else:
            both = [p.get(joint, "radius_i"), p.get(joint, "radius_j")]
            small, great = sorted(both, key=lambda r: complex(r).real)
            wheels = [(great, -1.0 if joint.internal else 1.0), (small, 1.0)]
        module = p.get(joint, "module")
        if module is None:
            module = small * sin(angle) ** 2

        def end(radius: Any, outside: float) -> Any:
            if radius is None:
                return module / sin(angle)
            foot, base = radius * sin(angle), radius * cos(angle)
            tip = radius + outside * module
            return outside * (sqrt(tip * tip - base * base) - foot)

        (one, kind), (two, _) = wheels
        first, second = end(one, kind), end(two, 1.0)
        first = _least(first, two * sin(angle))
        if kind > 0.0 and one is not None:
            second = _least(second, one * sin(angle))
        # ∫|s| ds from −first to second, by the length
        return 0.5 * (first * first + second * second) / (first + second)

    # -- the solution ----------------------------------------------------------------------------

    def solve(self, real: tuple[Array, Array] | None = None) -> dict[str, Any]:
        """Multipliers, friction by joint as (Fx, Fy, T) on body j at the joint's place, and the
        real unknowns with their slope: those are the same whatever number has the complex step,
        and taken from `real` where it is given.
        """
        z, slope = self._newton() if real is None else real
        real, z = (z, slope), z.astype(complex)
        for _ in range(2):
            z = z - np.linalg.solve(slope.astype(complex), self.residual(z))
        lam, rest, friction = z[: len(self.g)], list(z[len(self.g) :]), {}
        for joint, count in zip(self.joints, self.count, strict=True):
            own, rest = rest[:count], rest[count:]
            friction[joint.name] = np.array(self._contact(joint, lam, own)[0], complex)
        return {"multipliers": lam, "friction": friction, "real": real}

    def _newton(self) -> tuple[Array, Array]:
        """The real unknowns and the slope of the residual there."""
        lam = np.linalg.solve(self.g.T, self.right)
        # a place of contact begins with what presses there without friction
        rest: list[Any] = []
        for joint, count in zip(self.joints, self.count, strict=True):
            start = [1e-3] * count
            if isinstance(joint, Revolute):
                start = [1e-3 + x for x in self._pushed(joint, lam)[:2]]
            rest += start
        z = np.concatenate([lam, np.array(rest, complex)])
        for _ in range(60):
            z = z.real.astype(complex)
            # the complex step of the description is there as well: it is taken off
            still = self.residual(z).imag
            columns = [self.residual(z + 1j * STEP * e).imag - still for e in np.eye(len(z))]
            slope = np.array(columns).T / STEP
            step = np.linalg.solve(slope, self.residual(z).real)
            z = z - step
            if np.abs(step).max() <= 1e-13 * np.abs(z).max():
                break
        return z.real, slope


def _least(a: Any, b: Any) -> Any:
    return a if complex(a).real <= complex(b).real else b
