"""The oracle's geometry: poses, places and initial guesses from the descriptions alone."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from mbody.model.body import Body
from mbody.model.element import Element, Marker, Polar
from mbody.model.joints import Fixed, Prismatic
from mbody.model.mechanism import Mechanism
from mbody.model.one_sided_constraint import OneSided

__all__ = ["Geometry", "ReferenceNumbers", "pair"]


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

    def pose_of_axes(self, q: Any, body: str) -> np.ndarray:
        """(x, y, θ) of a body's link axes at q (3n,), instead of its mass centre."""
        x, y = self.point(q, Marker(body, (0.0, 0.0)))
        return np.array([x, y, self.with_ground(q)[3 * self.index[body] + 2]])

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
        cx, cy = pair(body.cg)
        c, s = math.cos(angle), math.sin(angle)
        q[k : k + 3] = x + c * cx - s * cy, y + s * cx + c * cy, angle
