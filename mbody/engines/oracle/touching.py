"""The oracle's contacts: what may touch what, gaps, and rates across and along each place.

Read from the description: a shape is circles, of the radius 0 at points, or a straight line. All
functions take complex coordinates, so that steps give derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engines.oracle.reference import Reference
from mbody.model.contact import Contact, Rope
from mbody.model.element import Marker
from mbody.model.touching_shapes import Disc, Line, Polygon, Ring, Segment, Vertex

__all__ = ["STEP", "OracleSpot", "OracleTouching", "spots_of"]

#: Of the complex step.
STEP = 1e-30
#: A gap that is never closed.
FAR = 1e9

Array = np.ndarray


@dataclass(frozen=True)
class OracleSpot:
    """A place where two bodies may touch: a circle on one of them, and on the other a line that
    begins at a place with a direction (or ends at another place), a circle, or a ring.
    """

    name: str
    circle: Marker
    radius: float
    other: Marker
    kind: str  # "line", "segment", "circle", "ring", "rope"
    end: Marker | None = None
    reach: float = 0.0  # radius of the other circle or ring, length of a rope
    friction: float = 0.0
    static: float = 0.0
    restitution: float = 0.0
    newton: bool = False


def spots_of(contact: Any) -> list[OracleSpot]:
    """The places of a contact.

    Raises
    ------
    NotImplementedError
        For shapes of which both have straight edges, unless one is an endless line.
    """
    if isinstance(contact, Rope):
        length = float(contact.length)
        return [OracleSpot(contact.name, contact.j, 0.0, contact.i, "rope", reach=length)]
    if not isinstance(contact, Contact):
        raise NotImplementedError(f"'{contact.name}': it has no contacts between groups")
    mu = float(contact.friction)
    more: dict[str, Any] = {
        "friction": mu,
        "static": mu if contact.static is None else float(contact.static),
        "restitution": float(contact.restitution),
        "newton": contact.law == "newton",
    }
    sides = list(zip(contact.bodies, contact.shapes, strict=True))
    if any(isinstance(s, Disc | Ring) and s.begin is not None for s in contact.shapes):
        raise NotImplementedError(f"'{contact.name}': it has no arcs")
    for (one, shape), (other, flat) in (sides, sides[::-1]):
        circles = _circles(one, shape)
        straight = isinstance(flat, Line | Segment)
        corners = isinstance(shape, Polygon | Segment)
        if circles and straight and not (corners and isinstance(flat, Segment)):
            place, kind, end = _straight(other, flat)
            return [OracleSpot(contact.name, c, r, place, kind, end, **more) for c, r in circles]
        if circles and isinstance(flat, Ring) and not corners:
            ((c, r),) = circles
            hole, size = Marker(other, flat.ring), float(flat.radius)
            return [OracleSpot(contact.name, c, r, hole, "ring", reach=size, **more)]
    rounds = [_circles(body, shape) for body, shape in sides if isinstance(shape, Disc | Vertex)]
    if len(rounds) == 2:
        ((i, ri),), ((j, rj),) = rounds
        return [OracleSpot(contact.name, j, rj, i, "circle", reach=ri, **more)]
    raise NotImplementedError(f"'{contact.name}': it has no contacts of corners with edges")


def _circles(body: str, shape: Any) -> list[tuple[Marker, float]]:
    """Circles that touch a straight line: a disc, a point, corners."""
    if isinstance(shape, Disc):
        return [(Marker(body, shape.disc), float(shape.radius))]
    if isinstance(shape, Vertex):
        return [(Marker(body, shape.point), 0.0)]
    corners = {Segment: "segment", Polygon: "polygon"}.get(type(shape))
    return [(Marker(body, point), 0.0) for point in getattr(shape, corners)] if corners else []


def _straight(body: str, shape: Any) -> tuple[Marker, str, Marker | None]:
    if isinstance(shape, Line):
        return Marker(body, shape.point, float(shape.angle)), "line", None
    first, last = shape.segment
    return Marker(body, first), "segment", Marker(body, last)


class OracleTouching:
    """All places of a mechanism where bodies may touch."""

    def __init__(self, reference: Reference, contacts: Any) -> None:
        self.reference = reference
        self.spots = [spot for contact in contacts for spot in spots_of(contact)]

    def __len__(self) -> int:
        return len(self.spots)

    def _frame(self, q: Any, spot: OracleSpot) -> tuple[Any, ...]:
        """Gap, normal from the other body to that of the circle, and the point of contact."""
        r = self.reference
        cx, cy = r.place(q, spot.circle)
        ox, oy = r.place(q, spot.other)
        dx, dy = cx - ox, cy - oy
        if spot.kind in ("line", "segment"):
            if spot.end is None:
                angle = r.pose(q, spot.other.body)[2] + spot.other.angle
                ux, uy = np.cos(angle), np.sin(angle)
            else:
                ex, ey = r.place(q, spot.end)
                whole = np.sqrt((ex - ox) ** 2 + (ey - oy) ** 2)
                ux, uy = (ex - ox) / whole, (ey - oy) / whole
                along = dx * ux + dy * uy
                beyond = np.real(along) < 0.0 or np.real(along) > np.real(whole)
                if beyond and spot.radius == 0.0:
                    return FAR + 0.0 * dx, -uy, ux, cx, cy
                if beyond:
                    if np.real(along) > 0.0:
                        dx, dy = cx - ex, cy - ey
                    far = np.sqrt(dx * dx + dy * dy)
                    nx, ny = dx / far, dy / far
                    return far - spot.radius, nx, ny, cx - spot.radius * nx, cy - spot.radius * ny
            nx, ny = -uy, ux
            gap = nx * dx + ny * dy - spot.radius
            return gap, nx, ny, cx - spot.radius * nx, cy - spot.radius * ny
        far = np.sqrt(dx * dx + dy * dy)
        if spot.kind == "circle":
            nx, ny = dx / far, dy / far
            gap = far - spot.radius - spot.reach
            return gap, nx, ny, cx - spot.radius * nx, cy - spot.radius * ny
        # within a ring, or on a rope: the normal points back
        if np.real(far) == 0.0:
            return spot.reach - spot.radius + 0.0 * dx, 1.0, 0.0, cx, cy
        nx, ny = -dx / far, -dy / far
        return spot.reach - spot.radius - far, nx, ny, cx - spot.radius * nx, cy - spot.radius * ny

    def gaps(self, q: Array) -> Array:
        """Gaps (spots,) at q (3n,)."""
        every = self.reference.with_ground(q)
        return np.array([np.real(self._frame(every, spot)[0]) for spot in self.spots], dtype=float)

    def rates(self, q: Array, v: Array, which: Sequence[int] | None = None) -> Array:
        """Rates of gaps, then of sliding (2 spots, …), for velocities v (3n, …); of those spots
        alone, or of all.
        """
        r = self.reference
        every, moves = r.with_ground(q), r.with_ground(v)
        across, along = [], []
        for spot in self.spots if which is None else [self.spots[k] for k in which]:
            _, nx, ny, px, py = self._frame(every, spot)
            ends = []
            for body in (spot.circle.body, spot.other.body):
                x, y, _ = r.pose(every, body)
                vx, vy, w = r.pose(moves, body)
                ends.append((vx - w * (py - y), vy + w * (px - x)))
            (ax, ay), (bx, by) = ends
            across.append(nx * (ax - bx) + ny * (ay - by))
            along.append(ny * (ax - bx) - nx * (ay - by))
        return np.array([*across, *along])

    def rows(self, q: Array, which: Sequence[int] | None = None) -> Array:
        """(2 spots, 3n): rates are rows · v."""
        return self.rates(q, np.eye(len(q)), which).reshape(-1, len(q)).real

    def drift(self, q: Array, v: Array, which: Sequence[int] | None = None) -> Array:
        """What accelerations of the rates have without those of the bodies, (2 spots,)."""
        found = self.rates(q + 1j * STEP * v, v.astype(complex), which)
        return np.asarray(found.imag / STEP)

    def length(self) -> float:
        """A length of the places: the greatest radius, or arm."""
        arms = [math.hypot(*self.reference.arm(s.circle)) + s.radius for s in self.spots]
        return max([*arms, *(s.reach for s in self.spots)]) or 1.0
