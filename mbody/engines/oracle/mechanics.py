"""The oracle's mechanics: geometry, constraints, motion and loads, from the descriptions alone."""

from __future__ import annotations

import functools
import itertools
import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from mbody.core.tolerances import (
    COMPLEX_STEP,
    LEAST_SQUARES_RANK,
    LEAST_SQUARES_RANK_FINE,
    LEAST_SQUARES_RANK_ORACLE,
    LOOP_CLOSURE_ORACLE,
    LOOP_CLOSURE_ORACLE_STALLED,
    LOOP_OPEN_ORACLE,
    ORACLE_FORCE_UNIQUE,
)
from mbody.engines.independent_reading import Jet, evaluated, law_by_formula
from mbody.engines.oracle import friction
from mbody.engines.oracle import friction as element_laws
from mbody.laws import Law, MeasuredFormula
from mbody.model import joints, loads
from mbody.model.body import Body, SlenderRod
from mbody.model.contact import OneSided
from mbody.model.coupling import Coupling
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver, Driver
from mbody.model.element import Element, Marker, Polar
from mbody.model.mechanism import Mechanism
from mbody.model.states import quantities_named


class ReferenceNumbers:
    """The numbers for a user's `parameters(at)`, by the oracle's own arithmetic."""

    def __init__(self, reference: Geometry) -> None:
        self._reference = reference

    def __getitem__(self, name: str) -> float:
        element, _, _ = name.partition(".")
        return self._reference.mechanism[element].numbers()[name]

    def arm(self, element: Element, field: str) -> tuple[float, float]:
        """From the mass centre to a marker, link axes."""
        return self._reference.arm(element.places()[field])

    def angle(self, element: Element, field: str) -> float:
        """Direction of a marker in link axes [rad]."""
        return element.places()[field].angle

    def point(self, name: str) -> tuple[float, float]:
        """A named point in link axes."""
        body, _, point = name.partition(".")
        found = self._reference.body(body)
        return pair(found.cg if point == "cg" else found.points[point])


def pair(point: Any) -> tuple[float, float]:
    """(x, y) of a point, polar or not."""
    if isinstance(point, Polar):
        return point.r * math.cos(point.angle), point.r * math.sin(point.angle)
    return float(point[0]), float(point[1])


class Geometry:
    """Coordinates of one mechanism.

    `n`: Moving bodies; q, v, a are (3n,). The ground is body n in arrays with "all" in their name.
    `rows`: Slice of rows of every joint and driver by name.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        names = [body.name for body in mechanism.bodies]
        self.n = len(names)
        self.index = {name: k for k, name in enumerate([*names, "ground"])}
        # contacts have an engine of their own
        every: tuple[Any, ...] = mechanism.constraints
        self.elements = tuple(one for one in every if not isinstance(one, OneSided))
        ends = list(itertools.accumulate((len(e.rows) for e in self.elements), initial=0))
        self.rows = {e.name: slice(*ends[k : k + 2]) for k, e in enumerate(self.elements)}
        self.m = ends[-1]
        self._arms: dict[tuple[str, Any], tuple[float, float]] = {}

    def body(self, name: str) -> Body:
        """A body by name; the ground is one."""
        found: Any = self.mechanism.ground if name == "ground" else self.mechanism[name]
        body: Body = found
        return body

    def arm(self, marker: Marker) -> tuple[float, float]:
        """From the mass centre to the marker, link axes [length]."""
        key = marker.body, marker.point
        if key not in self._arms:
            body = self.body(marker.body)
            place = body.points[marker.point] if isinstance(marker.point, str) else marker.point
            (x, y), (cx, cy) = pair(place), pair(body.cg)
            self._arms[key] = x - cx, y - cy
        return self._arms[key]

    def pose(self, q_all: Any, body: str) -> tuple[Any, Any, Any]:
        """(x, y, θ) of one body's mass centre."""
        k = 3 * self.index[body]
        return q_all[k], q_all[k + 1], q_all[k + 2]

    def place(self, q_all: Any, marker: Marker) -> tuple[Any, Any]:
        """World place of a marker: r + A s."""
        x, y, theta = self.pose(q_all, marker.body)
        sx, sy = self.arm(marker)
        c, s = np.cos(theta), np.sin(theta)
        return x + c * sx - s * sy, y + s * sx + c * sy

    def point(self, q: Any, marker: Marker) -> np.ndarray:
        """World place (2,) of a marker at q (3n,)."""
        return np.array(self.place(self.with_ground(q), marker))

    def side(self, q_all: Any, v_all: Any, body: str) -> tuple[Any, ...]:
        """(x, y, θ, cos θ, sin θ, vx, vy, ω), the arguments of users' physics."""
        x, y, theta = self.pose(q_all, body)
        return x, y, theta, np.cos(theta), np.sin(theta), *self.pose(v_all, body)

    def with_ground(self, q: Any) -> np.ndarray:
        """q with the three zeros of the ground at the end."""
        q = np.asarray(q)
        return np.concatenate([q, np.zeros((3, *q.shape[1:]), q.dtype)])

    def guess(self) -> np.ndarray:
        """Initial guess q (3n,) from the descriptions; missing poses follow from the joints."""
        q = np.zeros(3 * self.n + 3)
        known = {"ground"}
        for body in self.mechanism.bodies:
            if body.guess.x is not None and body.guess.y is not None:
                self._set(q, body, body.guess.angle or 0.0, body.guess.x, body.guess.y)
                known.add(body.name)
        for _ in range(self.n):
            for joint in self.mechanism.joints:
                for here, there in ((joint.i, joint.j), (joint.j, joint.i)):
                    if here.body not in known or there.body in known:
                        continue
                    body = self.body(there.body)
                    angle = body.guess.angle
                    if angle is None:
                        keeps_angle = isinstance(joint, joints.Fixed | joints.Prismatic)
                        base = self.pose(q, here.body)[2] + here.angle - there.angle
                        angle = base if keeps_angle else 0.0
                    self._set(q, body, angle, 0.0, 0.0)
                    k = 3 * self.index[body.name]
                    gap = np.subtract(self.place(q, here), self.place(q, there))
                    q[k : k + 2] += gap
                    known.add(body.name)
        return q[:-3]

    def _set(self, q: np.ndarray, body: Body, angle: float, x: float, y: float) -> None:
        k = 3 * self.index[body.name]
        cx, cy = pair(body.cg)
        c, s = math.cos(angle), math.sin(angle)
        q[k : k + 3] = x + c * cx - s * cy, y + s * cx + c * cy, angle


# -- Formulas of measured quantities, from their text and the oracle's own geometry ------------


def formula_at(
    reference: Any, law: MeasuredFormula, x: float, t: float, q: Any, v: Any, own: Any
) -> float:
    """The value of a formula. `q`, `v` (3n + 3,)."""
    known = {"t": t, "x": x, **own}
    return float(_value(reference, law, known, lambda name: _quantity(reference, name, q, v, t)))


def formula_of_positions(
    reference: Any, law: MeasuredFormula, q: Any, t: Any, own: Mapping[str, Any]
) -> Any:
    """The value of what a driver follows, at positions (3n + 3, …) and a time that are floats,
    complex numbers or jets.
    """
    return _value(reference, law, {"t": t, **own}, lambda name: _position(reference, name, q))


def _value(
    reference: Any, law: MeasuredFormula, known: Mapping[str, Any], measure: Callable[[str], Any]
) -> Any:
    """A formula whose dotted names `measure` gives."""
    machine = reference.mechanism
    scope = machine.parameters.scope().names
    names: dict[str, Any] = {
        name: float(one.value) for name, one in scope.items() if name not in machine.curves
    }
    names |= {name: functools.partial(law_at, one.law) for name, one in machine.curves.items()}
    for one in quantities_named(machine, law.variables):
        if one.name not in known:
            known = {**known, one.name: _value(reference, one.formula, known, measure)}
    names |= known
    text = law.text
    for n, name in enumerate(sorted(set(law.variables), key=len, reverse=True)):
        if "." in name:
            text = re.sub(rf"(?<![\w.]){re.escape(name)}(?![\w.])", f"own_{n}_", text)
            names[f"own_{n}_"] = measure(name)
    found = evaluated(text, names, machine)
    if found is None:
        raise NotImplementedError(f"it does not read the formula '{law.text}'")
    return found[0]


def _position(reference: Any, name: str, q: Any) -> Any:
    """An angle, a place or a distance by its dotted name."""
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    if element in reference.index and key in ("x", "y", "angle"):
        x, y, angle = reference.pose(q, element)
        if point:
            x, y = reference.place(q, Marker(element, point if point != "origin" else (0.0, 0.0)))
        return {"x": x, "y": y, "angle": angle}[key]
    one: Any = next((e for e in reference.mechanism if e.name == element), None)
    if isinstance(one, joints.Revolute) and key == "angle":
        return reference.pose(q, one.j.body)[2] - reference.pose(q, one.i.body)[2]
    if isinstance(one, AngleDriver) and key == "value":
        return reference.pose(q, one.body)[2] - reference.pose(q, one.relative_to)[2]
    if isinstance(one, DistanceDriver | loads.Spring | loads.Damper) and key in ("value", "length"):
        (xi, yi), (xj, yj) = reference.place(q, one.i), reference.place(q, one.j)
        return np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2)
    raise NotImplementedError(f"it does not measure '{name}'")


def _quantity(reference: Any, name: str, q: Any, v: Any, t: float) -> float:
    """A quantity by its dotted name, from positions and rates."""
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    if element in reference.index:
        x, y, angle = reference.pose(q, element)
        vx, vy, omega = reference.pose(v, element)
        if point:
            at = point if point != "origin" else (0.0, 0.0)
            px, py = reference.place(q, Marker(element, at))
            vx, vy, x, y = vx - omega * (py - y), vy + omega * (px - x), px, py
        values = {"x": x, "y": y, "angle": angle, "vx": vx, "vy": vy, "omega": omega}
        return float(values[key])
    one: Any = reference.mechanism[element]
    if one.role == "driver" and key in ("value", "rate"):
        return float(one.law.derivatives(t)[0 if key == "value" else 1])
    if hasattr(one, "body") and key in ("angle", "rate"):
        rows = q if key == "angle" else v
        return float(reference.pose(rows, one.body)[2] - reference.pose(rows, one.by)[2])
    if isinstance(one, joints.Revolute) and key in ("angle", "rate"):
        rows = q if key == "angle" else v
        i, j = (reference.pose(rows, marker.body)[2] for marker in (one.i, one.j))
        return float(j - i)
    if one.role == "load" and key in ("length", "rate"):
        _, length, rate = reference.stretch(q, v, one)
        return length if key == "length" else rate
    raise NotImplementedError(f"it does not measure '{name}'")


# -- The oracle's constraints: Φ as in textbooks, derivatives by complex steps and jets --------


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
    """A law of one revolution at angles that are floats, complex arrays or jets."""
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
    """An arc about a circle of that radius without whole revolutions."""
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
        if isinstance(e, joints.CustomJoint):
            return self._custom_phi(e, q, t)
        if isinstance(e, Coupling):
            whole: Any = e
            parts = [term.factor * self._coordinate(term, q) for term in e.parts]
            return [sum(parts) - whole.value]
        if isinstance(e, AngleDriver):
            return [self._angle(q, e.body) - self._angle(q, e.relative_to) - self._law(e, q, t)]
        (xi, yi), (xj, yj) = self.place(q, e.i), self.place(q, e.j)
        if isinstance(e, joints.Revolute):
            return [xj - xi, yj - yi]
        direction = self._angle(q, e.i.body) + e.i.angle
        rotation = self._angle(q, e.j.body) + e.j.angle - direction
        if isinstance(e, joints.Fixed):
            return [xj - xi, yj - yi, rotation]
        if isinstance(e, joints.Prismatic):
            return [np.cos(direction) * (yj - yi) - np.sin(direction) * (xj - xi), rotation]
        along = np.cos(direction) * (xj - xi) + np.sin(direction) * (yj - yi)
        across = np.cos(direction) * (yj - yi) - np.sin(direction) * (xj - xi)
        if isinstance(e, joints.PinSlot):
            return [across]
        if isinstance(e, joints.RackPinion):
            return [along + e.radius * rotation - e.offset]
        if isinstance(e, joints.Rolling) and e.on_radius is None:
            return [across - e.radius, along + e.radius * rotation - e.offset]
        if isinstance(e, joints.CamFollower):
            # the profile in polar coordinates of the cam's axes, opposite to its direction of
            # rotation
            sign = 1.0 if e.clockwise else -1.0
            beyond = e.base_radius + e.roller if e.base_radius is not None else 0.0
            if not e.flat:
                polar = _direction(along, across)
                distance = np.sqrt(along * along + across * across)
                return [distance - beyond - law_around(e.profile, sign * polar)]
            # the distance of the face's line from the centre is the support function of the cam
            face = direction + rotation
            support = np.cos(face) * (yj - yi) - np.sin(face) * (xj - xi)
            return [support - beyond - law_around(e.profile, sign * (rotation + 0.5 * math.pi))]
        if isinstance(e, joints.Gear | joints.Rolling):
            ri, rj = self.signed_radii(e)
            # rolling: equal arcs on both wheels
            line = _direction(xj - xi, yj - yi)
            first = self._angle(q, e.i.body) + e.i.angle - line
            second = self._angle(q, e.j.body) + e.j.angle - line
            arcs = _nearest(ri * first + rj * second + (ri + rj) * e.phase, ri + rj)
            distance = np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - (ri + rj)
            return [arcs] if isinstance(e, joints.Gear) else [distance, arcs]
        if isinstance(e, joints.Distance):
            return [np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - e.length(0.0)]
        if isinstance(e, DistanceDriver):
            return [np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - self._law(e, q, t)]
        if isinstance(e, CoordinateDriver):
            return [along - self._law(e, q, t)]
        return list(e.equations((xi, yi, direction), (xj, yj, direction + rotation)))

    def _law(self, driver: Any, q: Any, t: Any) -> Any:
        """Prescribed value of a driver, at q and t that are floats, complex numbers or jets."""
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
        ri, rj = (e.radius_i, e.radius_j) if isinstance(e, joints.Gear) else (e.on_radius, e.radius)
        if not e.internal:
            return ri, rj
        return (ri, -rj) if ri > rj else (-ri, rj)

    def reaction_point(self, q_all: Any, e: Any) -> tuple[float, float]:
        """World place of the reaction point of a joint: at j, or the contact of wheels."""
        (xi, yi), (xj, yj) = self.place(q_all, e.i), self.place(q_all, e.j)
        if isinstance(e, joints.Gear) or (
            isinstance(e, joints.Rolling) and e.on_radius is not None
        ):
            radius = self.signed_radii(e)[0]
            distance = math.hypot(xj - xi, yj - yi)
            return xi + radius * (xj - xi) / distance, yi + radius * (yj - yi) / distance
        if isinstance(e, joints.CamFollower):
            return self._touched(q_all, e, (xi, yi), (xj, yj))
        if isinstance(e, joints.RackPinion | joints.Rolling):
            direction = self._angle(q_all, e.i.body) + e.i.angle
            return xj + e.radius * math.sin(direction), yj - e.radius * math.cos(direction)
        return xj, yj

    def _touched(self, q_all: Any, e: Any, centre: Any, follower: Any) -> tuple[float, float]:
        """Contact point of a cam: on its contour, by the tangent of a curve z(φ) in the cam's axes,
        with complex numbers for vectors.
        """
        axes = self._angle(q_all, e.i.body) + e.i.angle
        sign = 1.0 if e.clockwise else -1.0
        beyond = e.base_radius + e.roller if e.base_radius is not None else 0.0
        d = complex(*np.subtract(follower, centre)) * np.exp(-1j * axes)
        if e.flat:
            polar = self._angle(q_all, e.j.body) + e.j.angle + 0.5 * math.pi - axes
        else:
            polar = float(np.angle(d))
        f, f1, _ = law_by_formula(e.profile).derivatives((sign * polar) % (2.0 * math.pi))
        h, h1 = f + beyond, sign * f1
        if e.flat:  # the contour of a support function: (h + i h′) e^(iφ)
            touched = (h + 1j * h1) * np.exp(1j * polar)
        else:  # the tangent of the pitch curve R e^(iφ) is (R′ + i R) e^(iφ); inwards is i times it
            tangent = (h1 + 1j * h) * np.exp(1j * polar)
            touched = d + e.roller * 1j * tangent / abs(tangent)
        world = complex(*centre) + touched * np.exp(1j * axes)
        return world.real, world.imag

    def _angle(self, q: Any, body: str) -> Any:
        return self.pose(q, body)[2]

    def _physics(self, e: joints.CustomJoint, q: Any, v: Any, t: Any) -> tuple[Any, ...]:
        sides = (self.side(q, v, e.i.body), self.side(q, v, e.j.body))
        numbers: Any = ReferenceNumbers(self)
        (primitive,) = e.primitives(numbers)
        assert primitive.function is not None
        return tuple(primitive.function(*sides, np.array(primitive.parameters), t))

    def _custom_phi(self, e: joints.CustomJoint, q: Any, t: Any) -> list[Any]:
        if q.ndim == 1:
            return list(self._physics(e, q, np.zeros(len(q)), t)[0][: len(e.rows)])
        columns = [self._custom_phi(e, column, t) for column in q.T]
        return list(np.array(columns).T)

    def phi_q_all(self, q: Any, t: float) -> np.ndarray:
        """Φ_q (m, 3n + 3) by complex step, the ground's columns last."""
        q_all = self.with_ground(np.asarray(q, dtype=float))
        steps = q_all[:, None] + 1j * COMPLEX_STEP * np.eye(len(q_all))
        return self._phi(steps, t).reshape(self.m, len(q_all)).imag / COMPLEX_STEP

    def phi_q(self, q: Any, t: float) -> np.ndarray:
        """Φ_q (m, 3n) by complex step."""
        return self.phi_q_all(q, t)[:, : 3 * self.n]

    def nu(self, q: Any, t: float) -> np.ndarray:
        """ν = −Φ_t (m,) by complex step in time."""
        return -self.phi(np.asarray(q, dtype=complex), complex(t, COMPLEX_STEP)).imag / COMPLEX_STEP

    def gamma(self, q: Any, v: Any, t: float) -> np.ndarray:
        """γ (m,) = −d²Φ(q + s v, t + s)/ds² at s = 0, exact by jets."""
        line = np.array([Jet(x, x1) for x, x1 in zip(q, v)], dtype=object)
        rows = self.phi(line, Jet(float(t), 1.0))
        return np.array([-row.f2 if isinstance(row, Jet) else 0.0 for row in rows])


# -- The oracle's motion: Newton's method, and least squares for velocities and accelerations --


class ReferenceMotion(Constraints):
    """Driven motion of one mechanism."""

    def active_rows(self, drive: Iterable[str] | None) -> np.ndarray:
        """Indices of rows of all joints and of the drivers named (None or a mapping: all)."""
        if drive is None or isinstance(drive, Mapping):
            active = {d.name for d in self.mechanism.drivers}
        else:
            active = set(drive)
        active |= {each.name for each in self.elements if not isinstance(each, Driver)}
        return np.array(
            [
                k
                for e in self.elements
                if e.name in active
                for k in range(self.rows[e.name].start, self.rows[e.name].stop)
            ],
            dtype=int,
        )

    def with_driver_values(
        self, rows: np.ndarray, given: Mapping[str, float] | None, t: float, order: int
    ) -> np.ndarray:
        """Right-hand sides with other driven values (order 0), rates (1) or accelerations (2)."""
        for name, value in (given or {}).items():
            driver: Any = self.mechanism[name]
            rows[self.rows[name]] += value - driver.law.derivatives(t)[order]
        return rows

    def close(
        self,
        q0: Any,
        t: float,
        values: Mapping[str, float] | None = None,
        tol: float = LOOP_CLOSURE_ORACLE,
    ) -> np.ndarray:
        """q (3n,) near q0 with Φ(q, t) = 0, by Newton's method until a step is below `tol`.

        `values` {driver: value} overrides the driven values; ArithmeticError where it fails.
        """
        q = np.array(q0, dtype=float)
        last = math.inf
        for _ in range(60):
            phi = -self.with_driver_values(-self.phi(q, t), values, t, 0)
            step = np.linalg.lstsq(self.phi_q(q, t), -phi, rcond=LEAST_SQUARES_RANK_ORACLE)[0]
            q += step
            size = float(np.abs(step).max(initial=0.0)) / (1.0 + float(np.abs(q).max(initial=0.0)))
            if size < tol or (size < LOOP_CLOSURE_ORACLE_STALLED and size > 0.5 * last):
                break
            last = size
        phi = self.with_driver_values(-self.phi(q, t), values, t, 0)
        if not np.abs(phi).max(initial=0.0) < LOOP_OPEN_ORACLE * (1.0 + np.abs(q).max(initial=0.0)):
            raise ArithmeticError(f"loops do not close: {np.abs(phi).max():.2e}")
        return q

    def velocities(self, q: Any, t: float, rates: Mapping[str, float] | None = None) -> np.ndarray:
        """v (3n,) from Φ_q v = ν; `rates` {driver: rate} overrides the laws' rates."""
        nu = self.with_driver_values(self.nu(q, t), rates, t, 1)
        return np.linalg.lstsq(self.phi_q(q, t), nu, rcond=LEAST_SQUARES_RANK_ORACLE)[0]

    def accelerations(
        self, q: Any, v: Any, t: float, accelerations: Mapping[str, float] | None = None
    ) -> np.ndarray:
        """a (3n,) from Φ_q a = γ; `accelerations` {driver: value} overrides the laws'."""
        gamma = self.with_driver_values(self.gamma(q, v, t), accelerations, t, 2)
        return np.linalg.lstsq(self.phi_q(q, t), gamma, rcond=LEAST_SQUARES_RANK_ORACLE)[0]

    def motion(self, times: Any, q0: Any = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(q, v, a), each (len(times), 3n), one instant after the other on one branch.

        Instants should be close together: Newton's method starts each from the last q + v dt.
        """
        q = self.guess() if q0 is None else np.asarray(q0)
        found: list[Any] = []
        before: float | None = None
        v = np.zeros(3 * self.n)
        for t in map(float, times):
            q = self.close(q if before is None else q + v * (t - before), t)
            v = self.velocities(q, t)
            found.append((q, v, self.accelerations(q, v, t)))
            before = t
        q_t, v_t, a_t = (np.array(part) for part in zip(*found))
        return q_t, v_t, a_t


# -- The oracle's loads: forces and torques at the mass centres, each kind as it is defined ----


class Loads(ReferenceMotion):
    """Masses and loads of one mechanism."""

    #: Values of inputs and auxiliary states by name; those of the description where they are not
    #: given.
    own: Mapping[str, float] | None = None
    #: Positions and rates (3n + 3,) and the time, for formulas of measured quantities.
    now: tuple[Any, Any, float] = ((), (), 0.0)

    def value(self, law: Any, x: float) -> float:
        """A law's value, by the independent formulas; of measured quantities at the instant."""
        if not isinstance(law, MeasuredFormula):
            return float(law_by_formula(law)(x))
        q, v, t = self.now
        return formula_at(self, law, x, t, q, v, self._own())

    def _own(self) -> Mapping[str, float]:
        """Values of inputs and auxiliary states at the instant."""
        if self.own is not None:
            return self.own
        t = self.now[2]
        own = {one.name: float(law_by_formula(one.value)(t)) for one in self.mechanism.inputs}
        starts = {one.name: one.start for one in self.mechanism.states}
        return own | {name: start for name, start in starts.items() if isinstance(start, float)}

    def states_of(self, load: Any) -> dict[str, float]:
        """Values of a load's own states at the instant, by their last names."""
        first = f"{load.name}."
        return {
            name.removeprefix(first): one
            for name, one in self._own().items()
            if name.startswith(first)
        }

    def state_rates(self, q: Any, v: Any, t: float) -> dict[str, float]:
        """The rates of all auxiliary states, by the equations of the oracle's own."""
        q, v, t = self.now = self.with_ground(q), self.with_ground(v), float(t)
        found = {}
        for one in self.mechanism.described_states:
            found[one.name] = self.value(one.rate, t)
        for load in self.mechanism.loads:
            own = self.states_of(load)
            law: Any = functools.partial(self._law_of, load)
            rates: dict[str, float] = {}
            if isinstance(load, element_laws.MOTORS):
                turning = self._angle(v, load.body) - self._angle(v, load.by)
                rates = element_laws.motor_rates(load, turning, law, own)
            elif isinstance(load, element_laws.PUSHERS):
                _, length, rate = self.stretch(q, v, load)
                rates = element_laws.pusher_rates(load, length, rate, law, own)
            elif isinstance(load, loads.Tyre):
                _, height, speed, _, spin = self._on_road(q, v, load)
                rates = element_laws.tyre_rates(load, height, speed, spin, own)
            elif load.auxiliary_states():
                raise NotImplementedError(f"the oracle has no states of a {type(load).__name__}")
            found |= {f"{load.name}.{key}": rate for key, rate in rates.items()}
        return found

    def _law_of(self, load: Any, field: str) -> float:
        return self.value(getattr(load, field), self.now[2])

    def _on_road(self, q: np.ndarray, v: np.ndarray, tyre: loads.Tyre) -> tuple[float, ...]:
        """Direction of the road, height of the wheel's centre, its speed along the road and away
        from it, and the rate of the wheel.
        """
        angle = tyre.i.angle
        c, s = math.cos(angle), math.sin(angle)
        (ox, oy), (px, py) = self.place(q, tyre.i), self.place(q, tyre.j)
        (x, y, _), (vx, vy, w) = self.pose(q, tyre.j.body), self.pose(v, tyre.j.body)
        vx, vy = vx - w * (py - y), vy + w * (px - x)
        return angle, c * (py - oy) - s * (px - ox), c * vx + s * vy, c * vy - s * vx, w

    def mass_matrix(self) -> np.ndarray:
        """M (3n, 3n) = diag(m, m, I, …)."""
        g = self.mechanism.g
        masses = [(b.mass or (b.weight or 0.0) / g, b.inertia) for b in self.mechanism.bodies]
        return np.diag([x for m, inertia in masses for x in (m, m, inertia)]).reshape(
            3 * self.n, 3 * self.n
        )

    @functools.cached_property
    def masses(self) -> np.ndarray:
        """Mass of every body (n,)."""
        return np.diag(self.mass_matrix())[::3]

    def applied(self, q: Any, v: Any, t: float, only: str | None = None) -> np.ndarray:
        """f (3n,): forces and torques at the mass centres, of all loads or of the one named."""
        f = np.zeros((self.n + 1, 3))
        q_all, v_all = self.with_ground(q), self.with_ground(v)
        self.now = q_all, v_all, float(t)
        for load in self.mechanism.loads:
            if only is None or load.name == only:
                self._act(load, q_all, v_all, float(t), f)
        return f[:-1].ravel()

    def _push(self, f: np.ndarray, q: np.ndarray, marker: Marker, fx: float, fy: float) -> None:
        """A force at a marker, moved to the mass centre."""
        k = self.index[marker.body]
        (px, py), (x, y, _) = self.place(q, marker), self.pose(q, marker.body)
        f[k] += fx, fy, (px - x) * fy - (py - y) * fx

    def mass_elements(self, body: Body) -> list[tuple[float, float, float]]:
        """Mass elements (dm, x, y) from the mass centre in link axes, with the `spread` of
        the body.
        """
        m = self.mass_matrix()[3 * self.index[body.name], 3 * self.index[body.name]]
        spread: Any = body.spread
        if spread in (None, "point"):
            return [(m, 0.0, 0.0)]
        if isinstance(spread, SlenderRod):
            half = math.sqrt(3.0 * body.inertia / m)
            c, s = math.cos(spread.angle), math.sin(spread.angle)
            pairs = zip(*np.polynomial.legendre.leggauss(5))
            return [(0.5 * m * w, c * half * p, s * half * p) for p, w in pairs]
        moments = np.array([[spread.xx, spread.xy], [spread.xy, spread.yy]])
        found = []
        sizes, axes = np.linalg.eigh(moments)
        for size, (x, y) in zip(sizes, axes.T):
            radius = math.sqrt(2.0 * max(size, 0.0) / m)
            found += [(0.25 * m, sign * radius * x, sign * radius * y) for sign in (1.0, -1.0)]
        return found

    def _spin(self, load: loads.CentrifugalField, q: np.ndarray, t: float, f: np.ndarray) -> None:
        """Centrifugal force on every mass element: ω² times its distance from the axis."""
        (x0, y0), angle = self.place(q, load.axis), load.axis.angle
        normal = np.array([-math.sin(angle), math.cos(angle)])
        grains = []
        for body in self.mechanism.bodies:
            x, y, theta = self.pose(q, body.name)
            c, s = math.cos(theta), math.sin(theta)
            for dm, px, py in self.mass_elements(body):
                rx, ry = c * px - s * py, s * px + c * py
                off = normal @ (x + rx - x0, y + ry - y0)
                grains.append((self.index[body.name], dm, rx, ry, off))
        if load.momentum is None:
            omega = self.value(load.speed, t)
        else:
            omega = self.value(load.momentum, t) / (
                load.inertia + sum(dm * r * r for _, dm, _, _, r in grains)
            )
        for k, dm, rx, ry, off in grains:
            fx, fy = dm * omega**2 * off * normal
            f[k] += fx, fy, rx * fy - ry * fx

    def stretch(self, q: np.ndarray, v: np.ndarray, load: Any) -> tuple[np.ndarray, float, float]:
        """(unit vector from i to j, length, its rate) between two markers."""
        ends, rates = [], []
        for marker in (load.i, load.j):
            (px, py), (x, y, _) = self.place(q, marker), self.pose(q, marker.body)
            vx, vy, w = self.pose(v, marker.body)
            ends.append((px, py))
            rates.append((vx - w * (py - y), vy + w * (px - x)))
        d, rate = np.subtract(ends[1], ends[0]), np.subtract(rates[1], rates[0])
        length = math.hypot(*d)
        return d / length, length, float(d @ rate / length)

    def _act(self, load: Any, q: np.ndarray, v: np.ndarray, t: float, f: np.ndarray) -> None:
        at: Any = ReferenceNumbers(self)
        if isinstance(load, loads.CustomLoad):
            sides = (self.side(q, v, load.i.body), self.side(q, v, load.j.body))
            (action,) = load.actions(at)
            assert action.function is not None
            six = action.function(*sides, np.array(action.parameters), t)
            f[self.index[load.i.body]] += six[:3]
            f[self.index[load.j.body]] += six[3:]
        elif isinstance(load, loads.Gravity):
            f[:-1, 0] += self.masses * self.value(load.x, t)
            f[:-1, 1] += self.masses * self.value(load.y, t)
        elif isinstance(load, loads.CentrifugalField):
            self._spin(load, q, t, f)
        elif isinstance(load, loads.Force):
            angle = load.angle
            if load.follows:
                angle += self._angle(q, load.at.body) + load.at.angle
            size = self.value(load.value, t)
            self._push(f, q, load.at, size * math.cos(angle), size * math.sin(angle))
        elif isinstance(load, loads.Spring | loads.Damper):
            u, length, rate = self.stretch(q, v, load)
            one: Any = load
            if isinstance(load, loads.Spring):
                x = length - load.free_length
                tension = (
                    one.preload + one.stiffness * x if one.law is None else self.value(one.law, x)
                )
            else:
                tension = one.coefficient * rate if one.law is None else self.value(one.law, rate)
            self._push(f, q, load.i, *(tension * u))
            self._push(f, q, load.j, *(-tension * u))
        elif isinstance(load, element_laws.MOTORS):
            rate = self._angle(v, load.body) - self._angle(v, load.by)
            torque = element_laws.motor_torque(load, rate, t, self.states_of(load))
            f[self.index[load.body], 2] += torque
            f[self.index[load.by], 2] -= torque
        elif isinstance(load, element_laws.PUSHERS):
            u, _, _ = self.stretch(q, v, load)
            law: Any = functools.partial(self._law_of, load)
            push = element_laws.push_apart(load, law, self.states_of(load))
            self._push(f, q, load.i, *(-push * u))
            self._push(f, q, load.j, *(push * u))
        elif isinstance(load, loads.Tyre):
            angle, height, _, sinking, _ = self._on_road(q, v, load)
            pressed, along = element_laws.tyre_forces(load, height, sinking, self.states_of(load))
            c, s = math.cos(angle), math.sin(angle)
            self._push(f, q, load.j, along * c - pressed * s, along * s + pressed * c)
            f[self.index[load.j.body], 2] += height * along
        elif isinstance(load, loads.PistonPressure):
            angle = math.remainder(self._angle(q, load.cycle) + load.phase, 2.0 * math.pi)
            angle += 2.0 * math.pi if angle < 0.0 else 0.0
            self._thrust(f, q, load, load.head_area * self.value(load.head, angle))
            self._thrust(f, q, load, -load.rod_area * self.value(load.rod, angle))
        elif isinstance(load, loads.ReciprocatingCylinder):
            x, rate = self._stroke(q, v, load)
            size = load.area * self._charge(load, load.near, load.far, x, rate)
            if load.opposite_area is not None:
                other = self._charge(load, load.far, load.near, x, rate)
                size -= load.opposite_area * other
            self._thrust(f, q, load, size * math.copysign(1.0, load.far - load.near))
        elif isinstance(load, loads.Torque | loads.TorsionSpring | loads.TorsionDamper):
            x = self._angle(q, load.body) - self._angle(q, load.by)
            rate = self._angle(v, load.body) - self._angle(v, load.by)
            if isinstance(load, loads.Torque):
                torque = self.value(load.value, t)
            elif isinstance(load, loads.TorsionSpring):
                x -= load.free_angle
                back = (
                    load.preload + load.stiffness * x
                    if load.law is None
                    else self.value(load.law, x)
                )
                torque = -back
            else:
                torque = -(
                    load.coefficient * rate if load.law is None else self.value(load.law, rate)
                )
            f[self.index[load.body], 2] += torque
            f[self.index[load.by], 2] -= torque
        else:
            self._new(load, q, v, t, f)

    def _new(self, load: Any, q: np.ndarray, v: np.ndarray, t: float, f: np.ndarray) -> None:
        """A load between two places by the equations that it gives itself."""
        ends: list[Any] = [None, None]
        for n, marker in enumerate(load.places().get(side) for side in "ij"):
            if marker is not None:
                (px, py), (x, y, theta) = self.place(q, marker), self.pose(q, marker.body)
                vx, vy, w = self.pose(v, marker.body)
                rates = vx - w * (py - y), vy + w * (px - x), w
                ends[n] = (px, py, theta + marker.angle, *rates)
        found = load.wrenches(*ends, t, lambda field, x: self.value(getattr(load, field), x))
        for marker, (fx, fy, torque) in zip((load.i, load.j), found, strict=True):
            self._push(f, q, marker, fx, fy)
            f[self.index[marker.body], 2] += torque

    def _thrust(self, f: np.ndarray, q: np.ndarray, load: Any, size: float) -> None:
        """A force along the line of stroke on the piston, and its opposite on the cylinder, on the
        same line.
        """
        angle = self._angle(q, load.i.body) + load.i.angle
        fx, fy = size * math.cos(angle), size * math.sin(angle)
        self._push(f, q, load.j, fx, fy)
        (px, py), (x, y, _) = self.place(q, load.j), self.pose(q, load.i.body)
        f[self.index[load.i.body]] -= fx, fy, (px - x) * fy - (py - y) * fx

    def _stroke(self, q: np.ndarray, v: np.ndarray, load: Any) -> tuple[float, float]:
        """Coordinate of the piston along the line of stroke, and its rate by complex step."""

        def along(q: Any) -> Any:
            (xi, yi), (xj, yj) = self.place(q, load.i), self.place(q, load.j)
            angle = self._angle(q, load.i.body) + load.i.angle
            return (xj - xi) * np.cos(angle) + (yj - yi) * np.sin(angle)

        return float(along(q)), float(along(q + 1j * COMPLEX_STEP * v).imag / COMPLEX_STEP)

    @staticmethod
    def _charge(load: Any, head: float, crank_end: float, x: float, rate: float) -> float:
        """Pressure of the chamber whose volume is least with the piston at `head`."""
        stroke, c = abs(crank_end - head), load.clearance
        travel = (x - head) / (crank_end - head) * stroke
        if travel <= 0.0 or travel >= stroke:
            return float(load.delivery if travel <= 0.0 else load.suction)
        grows = rate * (crank_end - head) > 0.0
        p, full = (load.delivery, c) if grows else (load.suction, c + stroke)
        if load.exponent is None:
            p += load.bulk_modulus * math.log(full / (c + travel))
        else:
            p = (p + load.ambient) * (full / (c + travel)) ** load.exponent - load.ambient
        return float(max(p, load.suction) if grows else min(p, load.delivery))


# -- The oracle: planar mechanisms with dense matrices, slow and simple, as in the textbook ----
# Haug, Computer-Aided Kinematics and Dynamics (1989). It reads the description (`Mechanism`, frozen
# elements) and shares no numerical code with mbody: only laws are evaluated by their public
# `derivatives`. Coordinates are (x, y, θ) of every body's mass centre, bodies in the order of the
# description; rows are those of the joints in the order of the description, then those of the
# drivers.


class Reference(Loads):
    """The oracle of one mechanism: forces of a motion, and accelerations by forces."""

    def kinetostatics(
        self, q: Any, v: Any, a: Any, t: float, drive: Iterable[str] | None = None
    ) -> dict[str, Any]:
        """Forces of a known motion: Φ_qᵀ λ = f − M a by least squares.

        `q`, `v`, `a` (3n,): The motion at time t.
        `drive`: The drivers that act, by default all (a mapping, as in analyses, means all too).
        Returns "lam" (m,), zero in rows of idle drivers; "reactions" {joint: (Fx, Fy, T)}, force on
        body j by body i in world axes and torque at the marker on j; "unique" {joint: (3,) bool};
        "efforts" {driver: effort}; "residual", the largest |Φ_qᵀ λ − f + M a|.
        """
        rows = self.active_rows(drive)
        frictional = any(friction.has_friction(joint) for joint in self.mechanism.joints)
        if frictional and len(rows) == self.m == 3 * self.n:
            return self._with_friction(q, v, a, t)
        if frictional:
            raise NotImplementedError("it solves for friction where the reactions are unique")
        g = self.phi_q(q, t)[rows]
        right = self.applied(q, v, t) - self.mass_matrix() @ np.asarray(a)
        lam = np.zeros(self.m)
        lam[rows] = np.linalg.lstsq(g.T, right, rcond=LEAST_SQUARES_RANK_FINE)[0]
        free = np.zeros((self.m, len(rows)))  # columns: multipliers without effect (null space)
        _, s, vt = np.linalg.svd(g.T)
        rank = int((s > LEAST_SQUARES_RANK * s.max(initial=0.0)).sum())
        free[rows] = np.hstack([vt[rank:].T, np.zeros((len(rows), rank))])
        unique = {
            name: np.abs(matrix @ free).max(axis=1)
            < ORACLE_FORCE_UNIQUE * (1.0 + np.abs(matrix).max())
            for name, matrix in self.reaction_matrices(q, t).items()
        }
        return {
            "lam": lam,
            "reactions": self.reactions(q, t, lam),
            "unique": unique,
            "efforts": {
                e.name: -float(lam[self.rows[e.name]][0])
                for e in (*self.mechanism.couplings, *self.mechanism.drivers)
            },
            "residual": float(np.abs(g.T @ lam[rows] - right).max(initial=0.0)),
        }

    def _with_friction(self, q: Any, v: Any, a: Any, t: float) -> dict[str, Any]:
        """Multipliers, reactions and efforts with friction in joints, none in those at rest; NaN
        where it jams.
        """
        found = friction.DenseFriction(self, q, v, a, t).solve()
        lam = np.full(self.m, np.nan) if found is None else found.lam
        reactions = self.reactions(q, t, lam)
        if found is not None:
            reactions = {name: r + found.wrench.get(name, 0.0) for name, r in reactions.items()}
        efforts = (*self.mechanism.couplings, *self.mechanism.drivers)
        return {
            "lam": lam,
            "reactions": reactions,
            "unique": {joint.name: np.ones(3, dtype=bool) for joint in self.mechanism.joints},
            "efforts": {e.name: -float(lam[self.rows[e.name]][0]) for e in efforts},
            "residual": 0.0,
        }

    def reaction_matrices(self, q: Any, t: float) -> dict[str, np.ndarray]:
        """(3, m) of every joint: its (Fx, Fy, T) at the reaction point is that matrix times λ."""
        q_all, g = self.with_ground(q), self.phi_q_all(q, t)
        found = {}
        for joint in self.mechanism.joints:
            k = 3 * self.index[joint.j.body]
            matrix = np.zeros((3, self.m))
            rows = self.rows[joint.name]
            matrix[:, rows] = -g[rows, k : k + 3].T
            (px, py), (x, y, _) = self.reaction_point(q_all, joint), self.pose(q_all, joint.j.body)
            matrix[2] -= (px - x) * matrix[1] - (py - y) * matrix[0]
            found[joint.name] = matrix
        return found

    def reactions(self, q: Any, t: float, lam: Any) -> dict[str, np.ndarray]:
        """(Fx, Fy, T) of every joint: on body j by body i, at the marker on j."""
        return {name: matrix @ lam for name, matrix in self.reaction_matrices(q, t).items()}

    def dynamics(
        self,
        q: Any,
        v: Any,
        t: float,
        drive: Iterable[str] | None = (),
        efforts: Mapping[str, float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """(a (3n,), λ (m,)) from [M Φ_qᵀ; Φ_q 0]: forward dynamics.

        Drivers that are not in `drive` are free, with their `efforts` or none.
        """
        if any(friction.has_friction(joint) for joint in self.mechanism.joints):
            raise NotImplementedError("friction of joints takes their modes: frictional_dynamics")
        rows, size = self.active_rows(drive), 3 * self.n
        every = self.phi_q(q, t)
        f = self.applied(q, v, t)
        for name, effort in (efforts or {}).items():
            f += effort * every[self.rows[name]][0]
        g = every[rows]
        matrix = np.block([[self.mass_matrix(), g.T], [g, np.zeros((len(rows), len(rows)))]])
        right = np.concatenate([f, self.gamma(q, v, t)[rows]])
        solution = np.linalg.lstsq(matrix, right, rcond=LEAST_SQUARES_RANK_ORACLE)[0]
        lam = np.zeros(self.m)
        lam[rows] = solution[size:]
        return solution[:size], lam

    def frictional_dynamics(
        self, q: Any, v: Any, t: float, drive: Iterable[str] | None, modes: Mapping[str, str]
    ) -> friction.FrictionMotion:
        """Accelerations and forces with friction in joints of which some stick, by their modes."""
        return friction.FrictionDynamics(self, q, v, t, self.active_rows(drive), modes).motion()

    def residual_power(self, q: Any, v: Any, a: Any, t: float) -> float:
        """Virtual work Σ (f − M a)·v + Σ effort · driven rate: zero for a correct result."""
        every = self.kinetostatics(q, v, a, t)["efforts"]
        efforts = {d.name: every[d.name] for d in self.mechanism.drivers}
        g = self.phi_q(q, t)
        power = (self.applied(q, v, t) - self.mass_matrix() @ a) @ v
        return float(power + sum(efforts[n] * (g[self.rows[n]][0] @ v) for n in efforts))
