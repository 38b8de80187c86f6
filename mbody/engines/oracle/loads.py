"""The oracle's loads: forces and torques at the mass centres, each kind as it is defined."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.engines.independent_reading import law_by_formula
from mbody.engines.oracle.constraints import STEP
from mbody.engines.oracle.geometry import ReferenceNumbers
from mbody.engines.oracle.measured import formula_at
from mbody.engines.oracle.motion import ReferenceMotion
from mbody.laws import MeasuredFormula
from mbody.model.body import Body, SlenderRod
from mbody.model.element import Marker
from mbody.model.loads import (
    CentrifugalField,
    CustomLoad,
    Damper,
    Force,
    Gravity,
    PistonPressure,
    ReciprocatingCylinder,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)

__all__ = ["Loads"]


class Loads(ReferenceMotion):
    """Masses and loads of one mechanism."""

    #: Values of inputs and own states by name; those of the description where they are not given.
    own: Mapping[str, float] | None = None
    #: Positions and rates (3n + 3,) and the time, for formulas of measured quantities.
    now: tuple[Any, Any, float] = ((), (), 0.0)

    def value(self, law: Any, x: float) -> float:
        """A law's value, by the independent formulas; of measured quantities at the instant."""
        if not isinstance(law, MeasuredFormula):
            return float(law_by_formula(law)(x))
        q, v, t = self.now
        own = self.own
        if own is None:
            own = {one.name: float(law_by_formula(one.value)(t)) for one in self._inputs}
            starts = {one.name: one.start for one in self.mechanism.states}
            own |= {name: start for name, start in starts.items() if isinstance(start, float)}
        return formula_at(self, law, x, t, q, v, own)

    @property
    def _inputs(self) -> Any:
        return self.mechanism.inputs

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

    def _spin(self, load: CentrifugalField, q: np.ndarray, t: float, f: np.ndarray) -> None:
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
        if isinstance(load, CustomLoad):
            sides = (self.side(q, v, load.i.body), self.side(q, v, load.j.body))
            (action,) = load.actions(at)
            assert action.function is not None
            six = action.function(*sides, np.array(action.parameters), t)
            f[self.index[load.i.body]] += six[:3]
            f[self.index[load.j.body]] += six[3:]
        elif isinstance(load, Gravity):
            f[:-1, 0] += self.masses * self.value(load.x, t)
            f[:-1, 1] += self.masses * self.value(load.y, t)
        elif isinstance(load, CentrifugalField):
            self._spin(load, q, t, f)
        elif isinstance(load, Force):
            angle = load.angle
            if load.follows:
                angle += self._angle(q, load.at.body) + load.at.angle
            size = self.value(load.value, t)
            self._push(f, q, load.at, size * math.cos(angle), size * math.sin(angle))
        elif isinstance(load, Spring | Damper):
            u, length, rate = self.stretch(q, v, load)
            one: Any = load
            if isinstance(load, Spring):
                x = length - load.free_length
                tension = (
                    one.preload + one.stiffness * x if one.law is None else self.value(one.law, x)
                )
            else:
                tension = one.coefficient * rate if one.law is None else self.value(one.law, rate)
            self._push(f, q, load.i, *(tension * u))
            self._push(f, q, load.j, *(-tension * u))
        elif isinstance(load, PistonPressure):
            angle = math.remainder(self._angle(q, load.cycle) + load.phase, 2.0 * math.pi)
            angle += 2.0 * math.pi if angle < 0.0 else 0.0
            self._thrust(f, q, load, load.head_area * self.value(load.head, angle))
            self._thrust(f, q, load, -load.rod_area * self.value(load.rod, angle))
        elif isinstance(load, ReciprocatingCylinder):
            x, rate = self._stroke(q, v, load)
            size = load.area * self._charge(load, load.near, load.far, x, rate)
            if load.opposite_area is not None:
                other = self._charge(load, load.far, load.near, x, rate)
                size -= load.opposite_area * other
            self._thrust(f, q, load, size * math.copysign(1.0, load.far - load.near))
        elif isinstance(load, Torque | TorsionSpring | TorsionDamper):
            x = self._angle(q, load.body) - self._angle(q, load.by)
            rate = self._angle(v, load.body) - self._angle(v, load.by)
            if isinstance(load, Torque):
                torque = self.value(load.value, t)
            elif isinstance(load, TorsionSpring):
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

        return float(along(q)), float(along(q + 1j * STEP * v).imag / STEP)

    @staticmethod
    def _charge(load: Any, near: float, far: float, x: float, rate: float) -> float:
        """Pressure of the chamber whose volume is least with the piston at `near`."""
        stroke, c = abs(far - near), load.clearance
        way = (x - near) / (far - near) * stroke
        if way <= 0.0 or way >= stroke:
            return float(load.delivery if way <= 0.0 else load.suction)
        grows = rate * (far - near) > 0.0
        p, full = (load.delivery, c) if grows else (load.suction, c + stroke)
        if load.exponent is None:
            p += load.bulk_modulus * math.log(full / (c + way))
        else:
            p = (p + load.ambient) * (full / (c + way)) ** load.exponent - load.ambient
        return float(max(p, load.suction) if grows else min(p, load.delivery))
