"""A slow, obvious oracle: planar mechanisms in dense matrices, as the book writes them.

Haug, Computer-Aided Kinematics and Dynamics (1989). It reads the description (`Mechanism`, frozen
elements) and shares no numerical code with mbody: only laws are asked through their public
`derivatives`. Coordinates are (x, y, θ) of every body's mass
centre, bodies in the order of the description; rows are those of the joints in the order of the
description, then those of the drivers.

Beside it: Norton's example 11-3 written by hand, and a maker of random linkages of one freedom.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from mbody.bodies import Body, Guess
from mbody.drivers import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.elements import Element, Marker, Polar, polar
from mbody.joints import CustomJoint, Distance, Fixed, Prismatic, Revolute
from mbody.laws import ConstantAcceleration, Harmonic, Law, Polynomial
from mbody.loads import (
    CustomLoad,
    Damper,
    Force,
    Gravity,
    Load,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from mbody.mechanism import Mechanism

STEP = 1e-30  # of the complex step


class Jet:
    """f, f′, f″ along one line: arithmetic of second-order Taylor series, exact to rounding."""

    def __init__(self, f: float, f1: float = 0.0, f2: float = 0.0) -> None:
        self.f, self.f1, self.f2 = f, f1, f2

    def _of(self, f: float, g: float, h: float) -> Jet:
        """A function of self with value f, derivative g, second derivative h."""
        return Jet(f, g * self.f1, g * self.f2 + h * self.f1**2)

    def __add__(self, other: Any) -> Jet:
        b = other if isinstance(other, Jet) else Jet(other)
        return Jet(self.f + b.f, self.f1 + b.f1, self.f2 + b.f2)

    def __mul__(self, other: Any) -> Jet:
        a, b = self, other if isinstance(other, Jet) else Jet(other)
        return Jet(a.f * b.f, a.f1 * b.f + a.f * b.f1, a.f2 * b.f + 2.0 * a.f1 * b.f1 + a.f * b.f2)

    def __pow__(self, p: float) -> Jet:
        if p == 0:
            return Jet(1.0)
        if p == 1:
            return self
        return self._of(
            self.f**p, p * self.f ** (p - 1), p * (p - 1) * self.f ** (p - 2) if p != 2 else 2.0
        )

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Any) -> Jet:
        return self + other * -1.0

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __truediv__(self, other: Any) -> Jet:
        return self * (other**-1 if isinstance(other, Jet) else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return self**-1 * other

    __radd__, __rmul__ = __add__, __mul__

    # NumPy's functions call these methods on objects
    def sqrt(self) -> Jet:
        return self**0.5

    def cos(self) -> Jet:
        c, s = math.cos(self.f), math.sin(self.f)
        return self._of(c, -s, -c)

    def sin(self) -> Jet:
        c, s = math.cos(self.f), math.sin(self.f)
        return self._of(s, c, -s)

    def exp(self) -> Jet:
        return self._of(*[math.exp(self.f)] * 3)

    def log(self) -> Jet:
        return self._of(math.log(self.f), 1.0 / self.f, -1.0 / self.f**2)


def law_at(law: Law, t: Any) -> Any:
    """A law at a time that is a float, complex (f + f′ i Im t) or a jet."""
    if isinstance(t, Jet):
        return t._of(*law.derivatives(t.f))
    if isinstance(t, complex | np.complexfloating):
        f, f1, _ = law.derivatives(t.real)
        return f + 1j * f1 * t.imag
    return law(t)


class _Numbers:
    """What a user's `parameters(at)` may ask, answered by the oracle's own arithmetic."""

    def __init__(self, reference: Reference) -> None:
        self._reference = reference

    def __getitem__(self, name: str) -> float:
        element, _, _ = name.partition(".")
        return self._reference.mechanism[element].numbers()[name]

    def arm(self, element: Element, field: str) -> tuple[float, float]:
        return self._reference.arm(element.places()[field])

    def angle(self, element: Element, field: str) -> float:
        return element.places()[field].angle

    def point(self, name: str) -> tuple[float, float]:
        body, _, point = name.partition(".")
        found = self._reference.body(body)
        return _pair(found.cg if point == "cg" else found.points[point])


def _pair(point: Any) -> tuple[float, float]:
    if isinstance(point, Polar):
        return point.r * math.cos(point.angle), point.r * math.sin(point.angle)
    return float(point[0]), float(point[1])


class Reference:
    """The oracle of one mechanism.

    Attributes
    ----------
    n : int
        Moving bodies; q, v, a are (3n,). The ground is body n in arrays with "all" in their name.
    rows : dict
        Slice of rows of every joint and driver by name.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        names = [body.name for body in mechanism.bodies]
        self.n = len(names)
        self.index = {name: k for k, name in enumerate([*names, "ground"])}
        self.elements = (*mechanism.joints, *mechanism.drivers)
        ends = list(itertools.accumulate((len(e.rows) for e in self.elements), initial=0))
        self.rows = {e.name: slice(*ends[k : k + 2]) for k, e in enumerate(self.elements)}
        self.m = ends[-1]

    # -- geometry ---------------------------------------------------------------------------

    def body(self, name: str) -> Body:
        return self.mechanism.ground if name == "ground" else self.mechanism[name]  # type: ignore

    def arm(self, marker: Marker) -> tuple[float, float]:
        """From the mass centre to the marker, link axes [length]."""
        body = self.body(marker.body)
        place = body.points[marker.point] if isinstance(marker.point, str) else marker.point
        (x, y), (cx, cy) = _pair(place), _pair(body.cg)
        return x - cx, y - cy

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
        return np.array(self.place(self._all(q), marker))

    def side(self, q_all: Any, v_all: Any, body: str) -> tuple[Any, ...]:
        """(x, y, θ, cos θ, sin θ, vx, vy, ω), as users' physics takes it."""
        x, y, theta = self.pose(q_all, body)
        return x, y, theta, np.cos(theta), np.sin(theta), *self.pose(v_all, body)

    def _all(self, q: Any) -> np.ndarray:
        """With the ground's three zeros at the end."""
        q = np.asarray(q)
        return np.concatenate([q, np.zeros((3, *q.shape[1:]), q.dtype)])

    def pose_of_axes(self, q: Any, body: str) -> np.ndarray:
        """(x, y, θ) of a body's link axes at q (3n,), instead of its mass centre."""
        x, y = self.point(q, Marker(body, (0.0, 0.0)))
        return np.array([x, y, self._all(q)[3 * self.index[body] + 2]])

    def guess(self) -> np.ndarray:
        """Rough q (3n,) from the descriptions; what they leave out is found along the joints."""
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
                        turns = isinstance(joint, Fixed | Prismatic)
                        base = self.pose(q, here.body)[2] + here.angle - there.angle
                        angle = base if turns else 0.0
                    self._set(q, body, angle, 0.0, 0.0)
                    k = 3 * self.index[body.name]
                    gap = np.subtract(self.place(q, here), self.place(q, there))
                    q[k : k + 2] += gap
                    known.add(body.name)
        return q[:-3]

    def _set(self, q: np.ndarray, body: Body, angle: float, x: float, y: float) -> None:
        k = 3 * self.index[body.name]
        cx, cy = _pair(body.cg)
        c, s = math.cos(angle), math.sin(angle)
        q[k : k + 3] = x + c * cx - s * cy, y + s * cx + c * cy, angle

    # -- constraints ------------------------------------------------------------------------

    def phi(self, q: Any, t: Any) -> np.ndarray:
        """Φ (m,), or (m, k) for q (3n, k); takes floats, complex numbers and jets."""
        return self._phi(self._all(q), t)

    def _phi(self, q_all: Any, t: Any) -> np.ndarray:
        return np.array([row for e in self.elements for row in self._rows(e, q_all, t)])

    def _rows(self, e: Any, q: Any, t: Any) -> list[Any]:
        """The rows of one element at q (3n + 3,)."""
        if isinstance(e, CustomJoint):
            return self._custom_phi(e, q, t)
        if isinstance(e, AngleDriver):
            return [self._angle(q, e.body) - self._angle(q, e.relative_to) - law_at(e.law, t)]
        (xi, yi), (xj, yj) = self.place(q, e.i), self.place(q, e.j)
        direction = self._angle(q, e.i.body) + e.i.angle
        turn = self._angle(q, e.j.body) + e.j.angle - direction
        if isinstance(e, Revolute):
            return [xj - xi, yj - yi]
        if isinstance(e, Fixed):
            return [xj - xi, yj - yi, turn]
        if isinstance(e, Prismatic):
            return [np.cos(direction) * (yj - yi) - np.sin(direction) * (xj - xi), turn]
        if isinstance(e, Distance):
            return [np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - e.length(0.0)]
        if isinstance(e, DistanceDriver):
            return [np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2) - law_at(e.law, t)]
        if isinstance(e, CoordinateDriver):
            along = np.cos(direction) * (xj - xi) + np.sin(direction) * (yj - yi)
            return [along - law_at(e.law, t)]
        raise NotImplementedError(f"the oracle has no {type(e).__name__}")

    def _angle(self, q: Any, body: str) -> Any:
        return self.pose(q, body)[2]

    def _physics(self, e: CustomJoint, q: Any, v: Any, t: Any) -> tuple[Any, ...]:
        sides = (self.side(q, v, e.i.body), self.side(q, v, e.j.body))
        return e.physics(*sides, np.array(e.parameters(_Numbers(self))), t)  # type: ignore

    def _custom_phi(self, e: CustomJoint, q: Any, t: Any) -> list[Any]:
        if q.ndim == 1:
            return list(self._physics(e, q, np.zeros(len(q)), t)[0][: len(e.rows)])
        columns = [self._custom_phi(e, column, t) for column in q.T]
        return list(np.array(columns).T)

    def phi_q_all(self, q: Any, t: float) -> np.ndarray:
        """Φ_q (m, 3n + 3) by complex step, the ground's columns last."""
        q_all = self._all(np.asarray(q, dtype=float))
        steps = q_all[:, None] + 1j * STEP * np.eye(len(q_all))
        return self._phi(steps, t).imag / STEP

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

    # -- motion -----------------------------------------------------------------------------

    def _active(self, drive: Iterable[str] | None) -> np.ndarray:
        """Indices of rows of all joints and of the drivers named (None or a mapping: all)."""
        every = drive is None or isinstance(drive, Mapping)
        active = {d.name for d in self.mechanism.drivers} if every else set(drive)
        active |= {joint.name for joint in self.mechanism.joints}
        return np.array(
            [
                k
                for e in self.elements
                if e.name in active
                for k in range(self.rows[e.name].start, self.rows[e.name].stop)
            ],
            dtype=int,
        )

    def _changed(
        self, rows: np.ndarray, given: Mapping[str, float] | None, t: float, order: int
    ) -> np.ndarray:
        """Right-hand sides with the driven value (order 0), rate (1) or acceleration (2) given."""
        for name, value in (given or {}).items():
            law = self.mechanism[name].law  # type: ignore[attr-defined]
            rows[self.rows[name]] += value - law.derivatives(t)[order]
        return rows

    def close(
        self, q0: Any, t: float, values: Mapping[str, float] | None = None, tol: float = 1e-15
    ) -> np.ndarray:
        """q (3n,) near q0 with Φ(q, t) = 0, by plain Newton until a step is below `tol`.

        `values` {driver: value} overrides the driven values; ArithmeticError where it fails.
        """
        q = np.array(q0, dtype=float)
        last = math.inf
        for _ in range(60):
            phi = -self._changed(-self.phi(q, t), values, t, 0)
            step = np.linalg.lstsq(self.phi_q(q, t), -phi, rcond=1e-13)[0]
            q += step
            size = float(np.abs(step).max(initial=0.0)) / (1.0 + float(np.abs(q).max(initial=0.0)))
            if size < tol or (size < 1e-12 and size > 0.5 * last):
                break
            last = size
        phi = self._changed(-self.phi(q, t), values, t, 0)
        if not np.abs(phi).max(initial=0.0) < 1e-11 * (1.0 + np.abs(q).max(initial=0.0)):
            raise ArithmeticError(f"loops do not close: {np.abs(phi).max():.2e}")
        return q

    def velocities(self, q: Any, t: float, rates: Mapping[str, float] | None = None) -> np.ndarray:
        """v (3n,) from Φ_q v = ν; `rates` {driver: rate} overrides the laws' rates."""
        nu = self._changed(self.nu(q, t), rates, t, 1)
        return np.linalg.lstsq(self.phi_q(q, t), nu, rcond=1e-13)[0]

    def accelerations(
        self, q: Any, v: Any, t: float, accelerations: Mapping[str, float] | None = None
    ) -> np.ndarray:
        """a (3n,) from Φ_q a = γ; `accelerations` {driver: value} overrides the laws'."""
        gamma = self._changed(self.gamma(q, v, t), accelerations, t, 2)
        return np.linalg.lstsq(self.phi_q(q, t), gamma, rcond=1e-13)[0]

    def motion(self, times: Any, q0: Any = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(q, v, a), each (len(times), 3n), one instant after the other on one branch.

        Instants should lie close together: each starts Newton from the last one's q + v dt.
        """
        q = self.guess() if q0 is None else np.asarray(q0)
        found, before, v = [], None, None
        for t in map(float, times):
            q = self.close(q if before is None else q + v * (t - before), t)
            v = self.velocities(q, t)
            found.append((q, v, self.accelerations(q, v, t)))
            before = t
        q_t, v_t, a_t = (np.array(part) for part in zip(*found))
        return q_t, v_t, a_t

    # -- forces -----------------------------------------------------------------------------

    def mass_matrix(self) -> np.ndarray:
        """M (3n, 3n) = diag(m, m, I, …)."""
        g = self.mechanism.g
        masses = [(b.mass or (b.weight or 0.0) / g, b.inertia) for b in self.mechanism.bodies]
        return np.diag([x for m, inertia in masses for x in (m, m, inertia)]).reshape(
            3 * self.n, 3 * self.n
        )

    def applied(self, q: Any, v: Any, t: float, only: str | None = None) -> np.ndarray:
        """f (3n,): forces and torques at the mass centres, of all loads or of the one named."""
        f = np.zeros((self.n + 1, 3))
        q_all, v_all = self._all(q), self._all(v)
        for load in self.mechanism.loads:
            if only is None or load.name == only:
                self._act(load, q_all, v_all, float(t), f)
        return f[:-1].ravel()

    def _push(self, f: np.ndarray, q: np.ndarray, marker: Marker, fx: float, fy: float) -> None:
        """A force at a marker, moved to the mass centre."""
        k = self.index[marker.body]
        (px, py), (x, y, _) = self.place(q, marker), self.pose(q, marker.body)
        f[k] += fx, fy, (px - x) * fy - (py - y) * fx

    def _stretch(self, q: np.ndarray, v: np.ndarray, load: Any) -> tuple[np.ndarray, float, float]:
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

    def _act(self, load: Load, q: np.ndarray, v: np.ndarray, t: float, f: np.ndarray) -> None:
        if isinstance(load, CustomLoad):
            sides = (self.side(q, v, load.i.body), self.side(q, v, load.j.body))
            six = load.physics(*sides, np.array(load.parameters(_Numbers(self))), t)
            f[self.index[load.i.body]] += six[:3]
            f[self.index[load.j.body]] += six[3:]
        elif isinstance(load, Gravity):
            mass = np.diag(self.mass_matrix())[::3]
            f[:-1, 0] += mass * load.x(t)
            f[:-1, 1] += mass * load.y(t)
        elif isinstance(load, Force):
            angle = load.angle
            if load.follows:
                angle += self._angle(q, load.at.body) + load.at.angle
            size = load.value(t)
            self._push(f, q, load.at, size * math.cos(angle), size * math.sin(angle))
        elif isinstance(load, Spring | Damper):
            u, length, rate = self._stretch(q, v, load)
            if isinstance(load, Spring):
                x = length - load.free_length
                tension = load.preload + load.stiffness * x if load.law is None else load.law(x)
            else:
                tension = load.coefficient * rate if load.law is None else load.law(rate)
            self._push(f, q, load.i, *(tension * u))
            self._push(f, q, load.j, *(-tension * u))
        elif isinstance(load, Torque | TorsionSpring | TorsionDamper):
            x = self._angle(q, load.body) - self._angle(q, load.by)
            rate = self._angle(v, load.body) - self._angle(v, load.by)
            if isinstance(load, Torque):
                torque = load.value(t)
            elif isinstance(load, TorsionSpring):
                x -= load.free_angle
                back = load.preload + load.stiffness * x if load.law is None else load.law(x)
                torque = -back
            else:
                torque = -(load.coefficient * rate if load.law is None else load.law(rate))
            f[self.index[load.body], 2] += torque
            f[self.index[load.by], 2] -= torque
        else:
            raise NotImplementedError(f"the oracle has no {type(load).__name__}")

    def kinetostatics(
        self, q: Any, v: Any, a: Any, t: float, drive: Iterable[str] | None = None
    ) -> dict[str, Any]:
        """Forces of a known motion: Φ_qᵀ λ = f − M a by least squares.

        Parameters
        ----------
        q, v, a : arrays (3n,)
            The motion at time t.
        drive : names, optional
            The drivers that hold the motion, by default all (also where a mapping is given, as
            analyses take it: values do not matter here).

        Returns
        -------
        dict
            "lam" (m,), zero in rows of idle drivers; "reactions" {joint: (Fx, Fy, T)}, force on
            body j by body i in world axes and torque at the marker on j; "unique" {joint: (3,)
            bool}; "efforts" {driver: effort}; "residual", the largest |Φ_qᵀ λ − f + M a|.
        """
        rows = self._active(drive)
        g = self.phi_q(q, t)[rows]
        right = self.applied(q, v, t) - self.mass_matrix() @ np.asarray(a)
        lam = np.zeros(self.m)
        lam[rows] = np.linalg.lstsq(g.T, right, rcond=1e-12)[0]
        free = np.zeros((self.m, len(rows)))  # columns: multipliers that do nothing
        _, s, vt = np.linalg.svd(g.T)
        rank = int((s > 1e-10 * s.max(initial=0.0)).sum())
        free[rows] = np.hstack([vt[rank:].T, np.zeros((len(rows), rank))])
        unique = {
            name: np.abs(matrix @ free).max(axis=1) < 1e-8 * (1.0 + np.abs(matrix).max())
            for name, matrix in self.reaction_matrices(q, t).items()
        }
        return {
            "lam": lam,
            "reactions": self.reactions(q, t, lam),
            "unique": unique,
            "efforts": {d.name: -float(lam[self.rows[d.name]][0]) for d in self.mechanism.drivers},
            "residual": float(np.abs(g.T @ lam[rows] - right).max(initial=0.0)),
        }

    def reaction_matrices(self, q: Any, t: float) -> dict[str, np.ndarray]:
        """(3, m) of every joint: its (Fx, Fy, T) at the marker on j is that matrix times λ."""
        q_all, g = self._all(q), self.phi_q_all(q, t)
        found = {}
        for joint in self.mechanism.joints:
            k = 3 * self.index[joint.j.body]
            matrix = np.zeros((3, self.m))
            rows = self.rows[joint.name]
            matrix[:, rows] = -g[rows, k : k + 3].T
            (px, py), (x, y, _) = self.place(q_all, joint.j), self.pose(q_all, joint.j.body)
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

        Drivers that `drive` does not name run free, with the `efforts` given or none.
        """
        rows, size = self._active(drive), 3 * self.n
        every = self.phi_q(q, t)
        f = self.applied(q, v, t)
        for name, effort in (efforts or {}).items():
            f += effort * every[self.rows[name]][0]
        g = every[rows]
        matrix = np.block([[self.mass_matrix(), g.T], [g, np.zeros((len(rows), len(rows)))]])
        right = np.concatenate([f, self.gamma(q, v, t)[rows]])
        solution = np.linalg.lstsq(matrix, right, rcond=1e-13)[0]
        lam = np.zeros(self.m)
        lam[rows] = solution[size:]
        return solution[:size], lam

    def residual_power(self, q: Any, v: Any, a: Any, t: float) -> float:
        """Virtual work Σ (f − M a)·v + Σ effort · driven rate: zero where all is right."""
        efforts = self.kinetostatics(q, v, a, t)["efforts"]
        g = self.phi_q(q, t)
        power = (self.applied(q, v, t) - self.mass_matrix() @ a) @ v
        return float(power + sum(efforts[n] * (g[self.rows[n]][0] @ v) for n in efforts))


# -- Norton, Design of Machinery, example 11-3 ------------------------------------------------

# in-lbf-s: lengths 2, 3, 4 and 1; mass centres (r, angle); inertias; force at P, torque on link 4
CRANK, COUPLER, ROCKER, GROUND = 5.0, 15.0, 10.0, 19.0
CG = np.array([[3.0, math.radians(30.0)], [9.0, math.radians(45.0)], [5.0, 0.0]])
CG_XY = np.column_stack([CG[:, 0] * np.cos(CG[:, 1]), CG[:, 0] * np.sin(CG[:, 1])])
INERTIA = np.array([0.4, 1.5, 0.8])
WEIGHTS, G = np.array([1.5, 7.7, 5.8]), 386.0
EXACT_MASSES, PRINTED_MASSES = WEIGHTS / G, np.array([0.004, 0.020, 0.015])
PUSH, PUSH_ANGLE, TORQUE = 80.0, math.radians(330.0), 120.0
P_FROM_CG = (3.0, math.radians(100.0))
NORTON_ROWS = tuple(f"{what} of link {k}" for k in (2, 3, 4) for what in ("Fx", "Fy", "T"))
NORTON_COLUMNS = ("F12x", "F12y", "F32x", "F32y", "F43x", "F43y", "F14x", "F14y", "T12")


class NortonMotion(NamedTuple):
    """Links 2, 3, 4: angles, rates, accelerations (n, 3) [rad, s], a_G (n, 3, 2) [in/s²]."""

    theta: np.ndarray
    omega: np.ndarray
    alpha: np.ndarray
    acc: np.ndarray


def norton_motion(theta2: Any, omega2: Any, alpha2: Any) -> NortonMotion:
    """Closed-form motion of the open branch for crank angles, rates, accelerations (n,)."""
    t2, w2, a2 = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(x, dtype=float)) for x in (theta2, omega2, alpha2))
    )
    ax, ay = CRANK * np.cos(t2), CRANK * np.sin(t2)
    dx, dy = GROUND - ax, -ay
    diagonal = np.hypot(dx, dy)
    opening = np.arccos((COUPLER**2 + diagonal**2 - ROCKER**2) / (2.0 * COUPLER * diagonal))
    t3 = np.arctan2(dy, dx) + opening
    t4 = np.arctan2(ay + COUPLER * np.sin(t3), ax + COUPLER * np.cos(t3) - GROUND)
    # Norton eqs. 6.18 and 7.12
    w3 = CRANK * w2 / COUPLER * np.sin(t4 - t2) / np.sin(t3 - t4)
    w4 = CRANK * w2 / ROCKER * np.sin(t2 - t3) / np.sin(t4 - t3)
    # a ω̇2 terms: b α3 u3⊥ − c α4 u4⊥ = e
    ex = CRANK * (a2 * np.sin(t2) + w2**2 * np.cos(t2)) + COUPLER * w3**2 * np.cos(t3)
    ex -= ROCKER * w4**2 * np.cos(t4)
    ey = CRANK * (-a2 * np.cos(t2) + w2**2 * np.sin(t2)) + COUPLER * w3**2 * np.sin(t3)
    ey -= ROCKER * w4**2 * np.sin(t4)
    turn = np.sin(t4 - t3)
    a3 = (ex * np.cos(t4) + ey * np.sin(t4)) / (COUPLER * turn)
    a4 = (ex * np.cos(t3) + ey * np.sin(t3)) / (ROCKER * turn)
    theta, omega = np.stack([t2, t3, t4], 1), np.stack([w2, w3, w4], 1)
    alpha = np.stack([a2, a3, a4], 1)
    c, s = np.cos(theta), np.sin(theta)
    gx, gy = c * CG_XY[:, 0] - s * CG_XY[:, 1], s * CG_XY[:, 0] + c * CG_XY[:, 1]
    acc = np.stack([-alpha * gy - omega**2 * gx, alpha * gx - omega**2 * gy], 2)
    acc[:, 1, 0] += -CRANK * (a2 * np.sin(t2) + w2**2 * np.cos(t2))  # the acceleration of A
    acc[:, 1, 1] += CRANK * (a2 * np.cos(t2) - w2**2 * np.sin(t2))
    return NortonMotion(theta, omega, alpha, acc)


def norton_system(
    theta: np.ndarray, alpha: np.ndarray, acc: np.ndarray, exact_masses: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """A (n, 9, 9) and b (n, 9) of Norton's eq. 11.9, from the motion of links 2, 3, 4.

    Vectors R lie in non-rotating axes at each mass centre: R32 goes to where link 3 acts on 2.
    """
    mass = EXACT_MASSES if exact_masses else PRINTED_MASSES
    c, s = np.cos(theta), np.sin(theta)
    gx, gy = c * CG_XY[:, 0] - s * CG_XY[:, 1], s * CG_XY[:, 0] + c * CG_XY[:, 1]
    length = np.array([CRANK, COUPLER, ROCKER])
    near_x, near_y = -gx, -gy  # R12, R23, R14
    far_x, far_y = c * length - gx, s * length - gy  # R32, R43, R34
    A = np.zeros((len(theta), 9, 9))
    b = np.empty((len(theta), 9))
    A[:, 0, 0] = A[:, 0, 2] = A[:, 1, 1] = A[:, 1, 3] = A[:, 2, 8] = 1.0
    A[:, 3, 4] = A[:, 4, 5] = A[:, 6, 6] = A[:, 7, 7] = 1.0
    A[:, 3, 2] = A[:, 4, 3] = A[:, 6, 4] = A[:, 7, 5] = -1.0
    A[:, 2, 0], A[:, 2, 1] = -near_y[:, 0], near_x[:, 0]
    A[:, 2, 2], A[:, 2, 3] = -far_y[:, 0], far_x[:, 0]
    A[:, 5, 2], A[:, 5, 3] = near_y[:, 1], -near_x[:, 1]
    A[:, 5, 4], A[:, 5, 5] = -far_y[:, 1], far_x[:, 1]
    A[:, 8, 4], A[:, 8, 5] = far_y[:, 2], -far_x[:, 2]
    A[:, 8, 6], A[:, 8, 7] = -near_y[:, 2], near_x[:, 2]
    b[:, 0::3], b[:, 1::3] = mass * acc[:, :, 0], mass * acc[:, :, 1]
    b[:, 2::3] = INERTIA * alpha
    fx, fy = PUSH * math.cos(PUSH_ANGLE), PUSH * math.sin(PUSH_ANGLE)
    rp, at = P_FROM_CG
    px, py = rp * np.cos(theta[:, 1] + at), rp * np.sin(theta[:, 1] + at)
    b[:, 3] -= fx
    b[:, 4] -= fy
    b[:, 5] -= px * fy - py * fx
    b[:, 8] -= TORQUE
    return A, b


def norton_batched_given_kinematics(
    theta: np.ndarray, alpha: np.ndarray, acc: np.ndarray, exact_masses: bool = True
) -> np.ndarray:
    """Forces (n, 9) by hand-batched NumPy with the motion given: the benchmark's opponent."""
    A, b = norton_system(theta, alpha, acc, exact_masses)
    return np.linalg.solve(A, b[:, :, None])[:, :, 0]


def norton_newton_euler(
    theta2: Any, omega2: Any, alpha2: Any, exact_masses: bool = True
) -> np.ndarray:
    """Forces (n, 9) in the order of `NORTON_COLUMNS` [lbf, lbf·in], by hand.

    F_ij is the force of link i on link j. With `exact_masses` m = W/386, otherwise the print's
    rounded 0.004, 0.020, 0.015 blob.
    """
    motion = norton_motion(theta2, omega2, alpha2)
    return norton_batched_given_kinematics(motion.theta, motion.alpha, motion.acc, exact_masses)


def norton_matrix(
    theta2: float = math.radians(60.0),
    omega2: float = 25.0,
    alpha2: float = -40.0,
    exact_masses: bool = True,
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...], tuple[str, ...]]:
    """(A (9, 9), b (9,), names of the rows, names of the columns) at one instant."""
    motion = norton_motion(theta2, omega2, alpha2)
    A, b = norton_system(motion.theta, motion.alpha, motion.acc, exact_masses)
    return A[0], b[0], NORTON_ROWS, NORTON_COLUMNS


def norton_mechanism(
    exact_masses: bool = True, law: Law | None = None, angle: float = math.radians(60.0)
) -> Mechanism:
    """Example 11-3 as a description; joints "O2", "A", "B", "O4", driver "motor".

    Reaction on j by i, as the book's: "O2" is F12, "A" F32, "B" F43, "O4" F14. Guesses fit a crank
    at `angle` on the open branch.
    """
    theta = norton_motion(angle, 0.0, 0.0).theta[0]
    masses = [
        {"weight": float(w)} if exact_masses else {"mass": float(m)}
        for w, m in zip(WEIGHTS, PRINTED_MASSES)
    ]
    rp, at = P_FROM_CG
    p = (CG_XY[1] + [rp * math.cos(at), rp * math.sin(at)]).tolist()
    names, lengths = ("crank", "coupler", "rocker"), (CRANK, COUPLER, ROCKER)
    ends = ({"A": CRANK}, {"B": COUPLER}, {"B": ROCKER})
    origins = ("O2", "A", "O4")
    bodies = []
    for k, name in enumerate(names):
        points: dict[str, Any] = {origins[k]: (0.0, 0.0)}
        points |= {key: (lengths[k], 0.0) for key in ends[k]}
        if name == "coupler":
            points["P"] = p
        bodies.append(
            Body(
                name,
                inertia=float(INERTIA[k]),
                cg=polar(*CG[k].tolist()),
                points=points,
                guess=round(float(theta[k]), 1),
                **masses[k],
            )
        )
    mechanism = Mechanism(
        "Norton, example 11-3",
        units="in-lbf-s",
        g=G,
        ground={"O2": (0.0, 0.0), "O4": (GROUND, 0.0)},
    )
    mechanism.add(
        *bodies,
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "coupler.A", "crank.A"),
        Revolute("B", "rocker.B", "coupler.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", "crank", law or ConstantAcceleration(angle, 25.0, -40.0)),
        Force("push", "coupler.P", PUSH, angle=PUSH_ANGLE),
        Torque("load", "rocker", value=TORQUE),
    )
    return mechanism


# -- random linkages --------------------------------------------------------------------------


class _Link:
    """A link while it is being drawn: true axes (x, y, θ) and places, all in the world."""

    def __init__(self, name: str, axes: np.ndarray, spine: tuple[np.ndarray, np.ndarray]) -> None:
        self.name, self.axes, self.spine = name, axes, spine
        self.points: dict[str, Any] = {}

    def local(self, place: np.ndarray) -> np.ndarray:
        x, y, theta = self.axes
        c, s = math.cos(theta), math.sin(theta)
        return np.array([[c, s], [-s, c]]) @ (place - [x, y])


class _Draft:
    """A random linkage while it is being drawn; lengths are about 1, masses about 1."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        box = (np.array([-0.5, 0.0]), np.array([1.5, 0.0]))
        self.links = {"ground": _Link("ground", np.zeros(3), box)}
        self.joints: list[Any] = []
        self.bodies: list[Body] = []

    def link(self, name: str, p: np.ndarray, q: np.ndarray) -> _Link:
        """A link from p to q: axes as in a textbook, or anywhere."""
        angle = math.atan2(*(q - p)[::-1])
        axes = np.array([*p, angle])
        if self.rng.random() < 0.5:
            axes += [*self.rng.uniform(-0.3, 0.3, 2), self.rng.uniform(-3.0, 3.0)]
            axes[2] = math.remainder(axes[2], 2.0 * math.pi)
        self.links[name] = _Link(name, axes, (p, q))
        return self.links[name]

    def mark(self, link: _Link, place: np.ndarray, direction: float | None = None) -> Marker:
        """A marker at a world place: a named point, polar or not, or bare coordinates."""
        x, y = link.local(place).tolist()
        angle = 0.0 if direction is None else direction - link.axes[2]
        how = self.rng.integers(3)
        point: Any = (x, y) if how else polar(math.hypot(x, y), math.atan2(y, x))
        if how == 2:
            return Marker(link.name, point, angle)
        name = f"P{len(link.points)}"
        link.points[name] = point
        return Marker(link.name, name, angle)

    def join(self, kind: Any, a: _Link, b: _Link, *where: Any, **more: Any) -> None:
        """A joint at one place (or two, one on each link), its sides in random order."""
        places = (where[0], where[-1]) if len(where) < 3 else where[:2]
        direction = where[2] if len(where) == 3 else None
        markers = [self.mark(x, p, direction) for x, p in zip((a, b), places)]
        if self.rng.random() < 0.5:
            markers.reverse()
        self.joints.append(kind(f"J{len(self.joints)}", *markers, **more))

    def near(self, link: _Link) -> np.ndarray:
        """A random place on a link, off its line."""
        p, q = link.spine
        along, off = self.rng.uniform(-0.1, 1.1), self.rng.uniform(-0.5, 0.5)
        if link.name == "ground":
            off = self.rng.uniform(-1.3, 1.3)
        return p + along * (q - p) + off * np.array([-(q - p)[1], (q - p)[0]])

    def two(self) -> tuple[_Link, _Link, np.ndarray, np.ndarray]:
        """Places on two different links, neither close together nor far apart."""
        while True:
            names = self.rng.choice(len(self.links), 2, replace=False)
            a, b = (list(self.links.values())[k] for k in names)
            p, q = self.near(a), self.near(b)
            if 0.5 < math.dist(p, q) < 1.8:
                return a, b, p, q

    def four_bar(self) -> float:
        """A crank-rocker that turns fully; the motor's first angle comes back."""
        u = self.rng.uniform
        while True:
            crank, coupler, rocker = u(0.2, 0.4), u(0.7, 1.3), u(0.6, 1.2)
            reach = np.array([1.0 - crank, 1.0 + crank])
            cosine = (coupler**2 + rocker**2 - reach**2) / (2.0 * coupler * rocker)
            if np.abs(cosine).max() < math.cos(math.radians(35.0)):
                break
        theta, side = u(-math.pi, math.pi), self.rng.choice([-1.0, 1.0])
        o2, o4 = np.zeros(2), np.array([1.0, 0.0])
        a = crank * np.array([math.cos(theta), math.sin(theta)])
        d = math.dist(a, o4)
        t3 = math.atan2(*(o4 - a)[::-1]) + side * math.acos(
            (coupler**2 + d**2 - rocker**2) / (2.0 * coupler * d)
        )
        b = a + coupler * np.array([math.cos(t3), math.sin(t3)])
        ground = self.links["ground"]
        l2, l3, l4 = self.link("L1", o2, a), self.link("L2", a, b), self.link("L3", o4, b)
        for one, other, place in ((ground, l2, o2), (l2, l3, a), (l3, l4, b), (ground, l4, o4)):
            self.join(Revolute, one, other, place)
        return float(l2.axes[2])

    def dyad(self, kind: str) -> None:
        """Two more links between two that are there: "RRR", "RRP" or "RPR"."""
        u = self.rng.uniform
        a, b, p, q = self.two()
        k = len(self.links)
        names = f"L{k}", f"L{k + 1}"
        side = self.rng.choice([-1.0, 1.0])
        base, line = math.dist(p, q), math.atan2(*(q - p)[::-1])
        apex = math.radians(u(55.0, 125.0))
        at_p = (math.pi - apex) * u(0.3, 0.7)
        reach = base * math.sin(math.pi - apex - at_p) / math.sin(apex)
        c = p + reach * np.array([math.cos(line + side * at_p), math.sin(line + side * at_p)])
        first = self.link(names[0], p, c)
        second = self.link(names[1], c, q)
        self.join(Revolute, a, first, p)
        if kind == "RRR":
            self.join(Revolute, first, second, c)
            self.join(Revolute, b, second, q)
        elif kind == "RRP":  # the second link slides on b, about along the first one
            self.join(Revolute, first, second, c)
            self.slide(b, second, line + side * at_p + math.radians(u(-45.0, 45.0)), q)
        else:  # the second link slides on the first one, about along the line of the pins
            self.slide(first, second, line + math.radians(u(-45.0, 45.0)), c)
            self.join(Revolute, b, second, q)

    def slide(self, a: _Link, b: _Link, direction: float, place: np.ndarray) -> None:
        way = self.rng.uniform(-0.5, 0.5) * np.array([math.cos(direction), math.sin(direction)])
        self.join(Prismatic, a, b, place, place + way, direction)

    def extras(self) -> None:
        """A body welded on, and a link held by a pin and a rod."""
        host = self.links[f"L{self.rng.integers(1, len(self.links))}"]
        place = self.near(host)
        k = len(self.links)
        weld = self.link(f"L{k}", place, place + self.rng.uniform(0.2, 0.5, 2))
        self.join(Fixed, host, weld, place, place, float(self.rng.uniform(-1.0, 1.0)))
        a, b, p, q = self.two()
        dx, dy = q - p
        apex = p + 0.6 * (q - p) + self.rng.choice([-0.6, 0.6]) * np.array([-dy, dx])
        held = self.link(f"L{k + 1}", p, apex)
        self.join(Revolute, a, held, p)
        self.join(Distance, held, b, apex, q, length=math.dist(apex, q))

    def mass(self, link: _Link, rough: float) -> Body:
        """The link's body: masses, mass centre off its line, a rough guess of its axes."""
        u = self.rng.uniform
        p, q = link.spine
        cg = link.local(0.5 * (p + q) + u(-0.3, 0.3, 2)).tolist()
        kind = self.rng.integers(5) if link.name != "L1" else 4
        mass: dict[str, Any] = {"mass": u(0.3, 4.0), "inertia": u(0.02, 0.5)}
        if kind == 0:
            mass = {}
        elif kind == 1:
            mass = {"weight": u(3.0, 40.0), "inertia": u(0.02, 0.5)}
        place: Any = polar(math.hypot(*cg), math.atan2(*cg[::-1])) if u() < 0.4 else tuple(cg)
        x, y, angle = (link.axes + rough * np.array([*u(-1, 1, 2), 2.0 * u(-1, 1)])).tolist()
        return Body(
            link.name, cg=place, points=link.points, guess=Guess(angle=angle, x=x, y=y), **mass
        )

    def loads(self) -> list[Load]:
        """One of every kind, each somewhere."""
        u, rng = self.rng.uniform, self.rng
        moving = [link for name, link in self.links.items() if name != "ground"]

        def some() -> _Link:
            return moving[rng.integers(len(moving))]

        def on(link: _Link) -> Marker:
            return self.mark(link, self.near(link), link.axes[2] + u(-2.0, 2.0))

        def ends() -> tuple[Marker, Marker]:
            a, b, p, q = self.two()
            return self.mark(a, p), self.mark(b, q)

        def pair() -> dict[str, str]:
            a, b = rng.choice(len(self.links), 2, replace=False)
            names = list(self.links)
            return {"body": names[a], "by": names[b]}

        return [
            Gravity("gravity", x=u(-2.0, 2.0), y=-9.81),
            Force("wind", on(some()), Harmonic(u(-5, 5), 10.0, u(1, 9), 0.3), angle=u(-3, 3)),
            Force("thrust", on(some()), u(-20.0, 20.0), angle=u(-3, 3), follows=True),
            Torque("torque", **pair(), value=Polynomial([u(-5, 5), u(-5, 5), 1.0])),
            Spring("spring", *ends(), stiffness=u(10, 50), free_length=u(0, 1), preload=u(-5, 5)),
            Spring("hard spring", *ends(), free_length=0.8, law=Polynomial([2.0, 20.0, 5.0, 30.0])),
            Damper("damper", *ends(), coefficient=u(1.0, 9.0)),
            Damper("hard damper", *ends(), law=Polynomial([0.0, 2.0, 0.3, 1.0])),
            TorsionSpring("twist", **pair(), stiffness=u(1, 9), free_angle=u(-1, 1), preload=1.0),
            TorsionSpring("hard twist", **pair(), law=Polynomial([1.0, 3.0, 0.5, 0.2])),
            TorsionDamper("drag", **pair(), coefficient=u(0.1, 2.0)),
            TorsionDamper("hard drag", **pair(), law=Polynomial([0.0, 0.5, 0.1, 0.05])),
        ]


LEAST_TURN = 0.4


@functools.lru_cache(maxsize=512)
def random_linkage(
    seed: int, loops: int, *, sliders: bool = False, extras: bool = False, loads: bool = True
) -> tuple[Mechanism, float]:
    """A random driven linkage of one freedom, and the turn of its crank that is safe.

    Parameters
    ----------
    seed : int
        The same seed makes the same linkage.
    loops : int
        A crank-rocker and ``loops − 1`` dyads: 2 + 2·loops links with the ground.
    sliders : bool
        Whether some dyads have a prismatic joint (always the first one).
    extras : bool
        Whether there are also a welded body and a link held by a Distance rod.
    loads : bool
        Whether a load of every kind acts.

    Returns
    -------
    mechanism : Mechanism
        Bodies L1 (the crank), L2, …; joints J0, J1, …; driver "motor" on L1 with a
        `ConstantAcceleration` law that begins at t = 0 and turns forwards, beyond the safe turn.
    turn : float
        The crank may go from its first angle that far [rad], at most 2π, and stays assembled and
        away from singular positions.
    """
    for attempt in itertools.count():
        rng = np.random.default_rng([seed, loops, sliders, extras, attempt])
        mechanism = _drawn(rng, loops, sliders, extras, loads)
        turn = safe_turn(mechanism)
        if turn >= LEAST_TURN:
            return mechanism, turn
    raise AssertionError


def _drawn(
    rng: np.random.Generator, loops: int, sliders: bool, extras: bool, loads: bool
) -> Mechanism:
    draft = _Draft(rng)
    start = draft.four_bar()
    for k in range(loops - 1):
        slides = sliders and (k == 0 or rng.random() < 0.4)
        draft.dyad(str(rng.choice(["RRP", "RPR"])) if slides else "RRR")
    if extras:
        draft.extras()
    acting = draft.loads()
    ground = draft.links.pop("ground")
    mechanism = Mechanism(f"{loops} loops", ground=ground.points, g=float(rng.uniform(9.0, 11.0)))
    rng.shuffle(draft.joints)  # type: ignore[arg-type]
    speed = rng.uniform(1.0, 8.0)
    law = ConstantAcceleration(start, speed, rng.uniform(-0.3, 0.3) * speed**2 / (2.0 * math.pi))
    bodies = [draft.mass(link, 0.04) for link in draft.links.values()]
    mechanism.add(*bodies, *draft.joints, AngleDriver("motor", "L1", law))
    if loads:
        mechanism.add(*acting)
    return mechanism


def safe_turn(mechanism: Mechanism, step: float = math.radians(2.0)) -> float:
    """How far the motor may turn forwards [rad], by marching in small steps on one branch.

    It ends where the smallest singular value of Φ_q falls to 40 % of its first value, a step jumps,
    or the ends of a spring meet; four fifths of that are given, 2π where nothing ends it.
    """
    oracle = Reference(mechanism)
    start = mechanism["motor"].law(0.0)  # type: ignore[attr-defined]
    try:
        q = oracle.close(oracle.guess(), 0.0)
    except ArithmeticError:
        return 0.0
    if np.abs(q - oracle.guess()).max() > 0.4:
        return 0.0  # closed far from the guess: perhaps another branch
    springs = [load for load in mechanism.loads if isinstance(load, Spring | Damper)]
    drive, first = oracle.rows["motor"], None
    steps = round(2.0 * math.pi / step)
    zero = np.zeros(3 * oracle.n + 3)
    for k in range(steps + 1):
        g = oracle.phi_q(q, 0.0)
        least = float(np.linalg.svd(g, compute_uv=False)[-1])
        first = least if first is None else first
        q_all = oracle._all(q)
        short = min((oracle._stretch(q_all, zero, load)[1] for load in springs), default=1.0)
        if first < 0.03 or least < max(0.4 * first, 0.03) or short < 0.15:
            return 0.8 * max(k - 1, 0) * step
        unit = np.zeros(oracle.m)
        unit[drive] = 1.0
        guess = q + step * np.linalg.solve(g, unit)
        try:
            q = oracle.close(guess, 0.0, {"motor": start + (k + 1) * step}, 1e-7)
        except ArithmeticError:
            return 0.8 * max(k - 1, 0) * step
        if np.abs(q - guess).max() > 0.03:
            return 0.8 * max(k - 1, 0) * step
    return 2.0 * math.pi


def times_within(mechanism: Mechanism, turn: float, count: int) -> np.ndarray:
    """Times (count,) from 0 at which the motor has turned evenly through `turn` [rad]."""
    law: Any = mechanism["motor"].law  # type: ignore[attr-defined]
    way = np.linspace(0.0, turn, count)
    v, a = law.speed, law.acceleration
    return 2.0 * way / (v + np.sqrt(v * v + 2.0 * a * way))


def differences(function: Callable[[float], np.ndarray], x: float, h: float) -> np.ndarray:
    """Derivative of a function by an eighth-order central difference with step h."""
    weights = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
    return sum(  # type: ignore[return-value]
        w * (function(x + k * h) - function(x - k * h)) / h for k, w in enumerate(weights, 1)
    )
