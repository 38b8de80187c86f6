"""The parts of a mechanism for drawings: their holes, outlines and marks in link axes."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from mbody.engineering.cam_contour import cam_contour
from mbody.model.body import Body
from mbody.model.element import Element
from mbody.model.joints import CamFollower, Distance, Gear, PinSlot, Prismatic, Revolute
from mbody.model.touching_shapes import Disc, Line, Polygon, Ring, Segment, Shape, Vertex
from mbody.system.system import System
from mbody.views.shapes import hull, unique

__all__ = ["Contour", "PartOutline", "parts_of", "rounded_bar"]

Place = tuple[float, float]
#: Points of a cam's contour, every quarter of a degree.
POINTS = 1440


@dataclass(frozen=True)
class Contour:
    """A line of (x, y, bulge): the bulge is the tangent of a quarter of an arc's angle, 0 of a
    straight line to the next point.
    """

    points: tuple[tuple[float, float, float], ...]
    closed: bool = True


@dataclass
class PartOutline:
    """A link alone, in its own axes [length].

    Attributes
    ----------
    name : str
    holes, circles : list of (centre, radius)
        Holes for pins; pitch circles and rollers, which are no edges.
    contours : list of Contour
        Its edges.
    lines : list of (start, end)
        Directions of guides and slots.
    marks : dict
        Named points.
    """

    name: str
    holes: list[tuple[Place, float]] = field(default_factory=list)
    circles: list[tuple[Place, float]] = field(default_factory=list)
    contours: list[Contour] = field(default_factory=list)
    edges: list[tuple[Place, float]] = field(default_factory=list)
    lines: list[tuple[Place, Place]] = field(default_factory=list)
    marks: dict[str, Place] = field(default_factory=dict)


def rounded_bar(points: list[Place], radius: float) -> Contour | None:
    """The outline of all that is within a radius of the convex hull of points: a bar about two.

    None about one point, where it is a circle.

    >>> bar = rounded_bar([(0.0, 0.0), (3.0, 0.0)], 1.0)
    >>> sorted({round(bulge, 9) for _, _, bulge in bar.points})
    [0.0, 1.0]
    """
    corners = hull(points, 1e-9 * radius)
    if len(corners) < 2:
        return None
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.arctan2(-edges[:, 0], edges[:, 1])  # of each edge, outward
    found = []
    for n, (x, y) in enumerate(corners):
        start = float(normals[n - 1])
        turn = (float(normals[n]) - start) % math.tau
        for angle, bulge in ((start, math.tan(turn / 4.0)), (start + turn, 0.0)):
            place = x + radius * math.cos(angle), y + radius * math.sin(angle)
            found.append((float(place[0]), float(place[1]), bulge))
    return Contour(tuple(found))


def parts_of(system: System, width: float, hole: float) -> list[PartOutline]:
    """All parts of a mechanism, the ground first.

    Parameters
    ----------
    system : System
        Of one design.
    width, hole : float
        Of bars, and the diameter of holes whose pins have no radius [length].
    """
    bodies = (system.mechanism.ground, *system.mechanism.bodies)
    return [_part(system, body, width, hole) for body in bodies]


def _part(system: System, link: Body, width: float, hole: float) -> PartOutline:
    body, numbers = link.name, system.numbers
    part = PartOutline(body)
    for joint in system.mechanism.joints:
        for side, marker in joint.places().items():
            if marker.body == body:
                x, y = numbers.place(joint, side)
                _add(joint, part, side, (float(x), float(y)), system, hole)
    for name in link.points:
        x, y = numbers.point(f"{body}.{name}")
        part.marks[name] = float(x), float(y)
    for name, shape in link.shapes.items():
        _shape(shape, part, system, f"{body}.{name}")
    if not part.contours and not part.edges and body != "ground":
        _bar(part, width)
    return part


@functools.singledispatch
def _add(
    joint: Element, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    """What a joint needs on one of its parts: here nothing."""


@_add.register
def _(
    joint: Revolute, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    own = joint.pin_radius is not None
    radius = float(system.numbers[f"{joint.name}.pin_radius"]) if own else hole / 2.0
    if not any(math.dist(at, centre) < 1e-9 * hole for centre, _ in part.holes):
        part.holes.append((at, radius))


@_add.register
def _(
    joint: Distance, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    part.holes.append((at, hole / 2.0))


@_add.register
def _(
    joint: Prismatic, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    part.lines.append(_guide(joint, side, at, system, hole))


@_add.register
def _(joint: PinSlot, part: PartOutline, side: str, at: Place, system: System, hole: float) -> None:
    if side == "j":
        part.holes.append((at, hole / 2.0))
        return
    start, end = _guide(joint, side, at, system, hole)
    if joint.limits is None or None in joint.limits:
        part.lines.append((start, end))
    elif slot := rounded_bar([start, end], hole / 2.0):
        part.contours.append(slot)


@_add.register
def _(joint: Gear, part: PartOutline, side: str, at: Place, system: System, hole: float) -> None:
    part.circles.append((at, float(system.numbers[f"{joint.name}.radius_{side}"])))


@_add.register
def _(
    joint: CamFollower, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    if side == "i":
        psi = np.linspace(0.0, math.tau, POINTS, endpoint=False)
        places = cam_contour(joint, system.numbers, psi)
        part.contours.append(Contour(tuple((float(x), float(y), 0.0) for x, y in places)))
    elif not joint.flat and (roller := float(system.numbers[f"{joint.name}.roller"])):
        part.circles.append((at, roller))


def _guide(
    joint: Prismatic | PinSlot, side: str, at: Place, system: System, hole: float
) -> tuple[Place, Place]:
    """The line of a guide: between its limits, else four holes to both sides."""
    angle = float(system.numbers.angle(joint, side))
    low, high = -4.0 * hole, 4.0 * hole
    if side == "i" and joint.limits is not None and None not in joint.limits:
        low, high = (float(system.numbers[f"{joint.name}.limits.{end}"]) for end in ("low", "high"))
    u = math.cos(angle), math.sin(angle)
    return tuple((at[0] + s * u[0], at[1] + s * u[1]) for s in (low, high))  # type: ignore[return-value]  # two places


def _shape(shape: Shape, part: PartOutline, system: System, name: str) -> None:
    """The edges of a shape that contacts touch."""
    points = {key: (x, y) for key, (x, y) in part.marks.items()}
    if isinstance(shape, Disc | Ring):
        centre = points[shape.disc if isinstance(shape, Disc) else shape.ring]
        radius = float(system.numbers[f"{name}.radius"])
        if shape.begin is None or shape.end is None:
            part.edges.append((centre, radius))
            return
        begin, end = (float(system.numbers[f"{name}.{key}"]) for key in ("begin", "end"))
        turn = (end - begin) % math.tau
        ends = [
            (centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a))
            for a in (begin, end)
        ]
        first, last = (*ends[0], math.tan(turn / 4.0)), (*ends[1], 0.0)
        part.contours.append(Contour((first, last), closed=False))
    elif isinstance(shape, Segment | Polygon):
        closed = isinstance(shape, Polygon)
        names = shape.polygon if isinstance(shape, Polygon) else shape.segment
        corners = tuple((*points[key], 0.0) for key in names)
        part.contours.append(Contour(corners, closed=closed))
    elif not isinstance(shape, Line | Vertex):
        raise TypeError(f"a shape without a drawing: {shape!r}")


def _bar(part: PartOutline, width: float) -> None:
    """A bar or a plate with round corners about the places of its joints and points."""
    places = [*(centre for centre, _ in part.holes), *part.marks.values()]
    places += [place for start, end in part.lines for place in (start, end)]
    places = [(float(x), float(y)) for x, y in unique(places or [(0.0, 0.0)], 1e-9 * width)]
    if contour := rounded_bar(places, width / 2.0):
        part.contours.append(contour)
    else:
        part.edges.append((places[0], width / 2.0))
