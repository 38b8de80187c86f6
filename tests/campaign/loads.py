"""Random loads with their forces and potentials by plain arithmetic."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody import Damper, Force, Gravity, Spring, Torque
from tests.campaign.linkage import Linkage

__all__ = ["Acting", "random_loads"]

Array = Any


class Acting:
    """Loads of a linkage: what they do to its bodies, and their potential.

    Parameters
    ----------
    of : Linkage
    conservative : bool
        Whether there are gravity and springs only.
    """

    def __init__(self, of: Linkage, conservative: bool) -> None:
        self.of, self.elements = of, []
        rng = of.rng
        self.gravity = rng.uniform(-10.0, 10.0, 2)
        self.elements.append(Gravity("gravity", x=self.gravity[0], y=self.gravity[1]))
        moving = [
            f"{name}.{key}" for name, keys in of.points.items() if name != "ground" for key in keys
        ]
        fixed = [f"ground.{key}" for key in of.points["ground"]]
        self.springs: list[tuple[str, str, float, float, float]] = []
        for n in range(int(rng.integers(0, 3))):
            ends = str(rng.choice(fixed)), str(rng.choice(moving))
            k, free = float(rng.uniform(1.0, 40.0)), float(rng.uniform(0.0, 1.0))
            c = 0.0 if conservative else float(rng.uniform(0.0, 2.0))
            if nearest(of, *ends) < 0.1:  # a spring of no length has no direction
                continue
            self.springs.append((*ends, k, free, c))
            self.elements.append(Spring(f"spring{n}", *ends, stiffness=k, free_length=free))
            if c:
                self.elements.append(Damper(f"damper{n}", *ends, coefficient=c))
        self.forces: list[tuple[str, float, float]] = []
        self.torques: list[tuple[str, float]] = []
        if not conservative:
            size, angle = float(rng.uniform(-20.0, 20.0)), float(rng.uniform(-3.0, 3.0))
            place = str(rng.choice(moving))
            self.forces.append((place, size * math.cos(angle), size * math.sin(angle)))
            self.elements.append(Force("push", place, size, angle=angle))
            body, torque = str(rng.choice(list(of.points)[1:])), float(rng.uniform(-9.0, 9.0))
            self.torques.append((body, torque))
            self.elements.append(Torque("twist", body, value=torque))

    def wrenches(self, motion: dict[str, Array], values: Any = None) -> dict[str, Array]:
        """By body (3, …): force at the mass centre and torque of all loads."""
        values = self.of.values if values is None else values
        found = {}
        for name, rows in motion.items():
            m = values.get(f"{name}.mass", 0.0) + 0.0 * rows[0]
            found[name] = np.array([m * self.gravity[0], m * self.gravity[1], 0.0 * rows[0]])
        for place, fx, fy in self.forces:
            self._push(found, motion, values, place, fx, fy)
        for body, torque in self.torques:
            found[body][2] += torque
        for near, far, k, free, c in self.springs:
            (x0, y0), _ = self._place(motion, values, near)
            (x, y), (vx, vy) = self._place(motion, values, far)
            dx, dy = x - x0, y - y0
            length = np.hypot(dx, dy)
            pull = k * (length - free) + c * (dx * vx + dy * vy) / length
            self._push(found, motion, values, far, -pull * dx / length, -pull * dy / length)
        return found

    def potential(self, motion: dict[str, Array], values: Any = None) -> Array:
        """Of gravity and springs."""
        values = self.of.values if values is None else values
        total: Array = 0.0
        for name, rows in motion.items():
            m = values.get(f"{name}.mass", 0.0)
            total = total - m * (self.gravity[0] * rows[0] + self.gravity[1] * rows[1])
        for near, far, k, free, _ in self.springs:
            (x0, y0), _ = self._place(motion, values, near)
            (x, y), _ = self._place(motion, values, far)
            total = total + 0.5 * k * (np.hypot(x - x0, y - y0) - free) ** 2
        return total

    def _place(self, motion: Any, values: Any, place: str) -> tuple[Any, Any]:
        """World place and velocity of a named point."""
        body = place.partition(".")[0]
        px, py = values[f"{place}.x"], values[f"{place}.y"]
        if body == "ground":
            return (px, py), (0.0, 0.0)
        rows = motion[body]
        px = px - values.get(f"{body}.cg.x", 0.0)
        py = py - values.get(f"{body}.cg.y", 0.0)
        c, s = np.cos(rows[2]), np.sin(rows[2])
        rx, ry = c * px - s * py, s * px + c * py
        return (rows[0] + rx, rows[1] + ry), (rows[3] - rows[5] * ry, rows[4] + rows[5] * rx)

    def _push(self, found: Any, motion: Any, values: Any, place: str, fx: Any, fy: Any) -> None:
        body = place.partition(".")[0]
        (x, y), _ = self._place(motion, values, place)
        rx, ry = x - motion[body][0], y - motion[body][1]
        found[body] = found[body] + np.array([fx + 0.0 * rx, fy + 0.0 * rx, rx * fy - ry * fx])


def nearest(of: Linkage, p: str, q: str) -> float:
    """Least distance of two places over the span."""
    poses = of.poses(of.times)
    (px, py), (qx, qy) = (of.world(poses, of.values, place) for place in (p, q))
    return float(np.hypot(qx - px, qy - py).min())


def random_loads(of: Linkage, *, conservative: bool = False) -> Acting:
    """Loads drawn by the linkage's own generator."""
    return Acting(of, conservative)
