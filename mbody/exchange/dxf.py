"""DXF: the links and cams of a mechanism as drawings for CAD and for cutting."""

from __future__ import annotations

import functools
import importlib
import io
import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core.tolerances import POINT_SAME, TINY
from mbody.engineering.cam_limits import cam_contour
from mbody.errors import ModelError, SolveError
from mbody.model.body import Body
from mbody.model.element import Element
from mbody.model.joints import CamFollower, Distance, Gear, PinSlot, Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.touching_shapes import (
    CurveShape,
    Disc,
    Line,
    Polygon,
    Ring,
    Segment,
    Shape,
    Vertex,
)
from mbody.quantities.formula import Number, evaluated, number
from mbody.quantities.units import unit_system
from mbody.system.assembler import assemble
from mbody.system.system import System
from mbody.views.shapes import hull, unique

# -- The parts of a mechanism for drawings: their holes, outlines and marks in link axes -------

Place = tuple[float, float]
#: Points of a cam's contour, every quarter of a degree.
POINTS = 1440


@dataclass(frozen=True)
class PartContour:
    """A line of (x, y, bulge): the bulge is the tangent of a quarter of an arc's angle, 0 of a
    straight line to the next point.
    """

    points: tuple[tuple[float, float, float], ...]
    closed: bool = True


@dataclass
class PartOutline:
    """A link alone, in its own axes [length].

    `bar`: Whether its outline is a bar, a plate or a circle of their width.
    `holes`: Those for pins: place, radius, and the joints that have a radius of their own.
    `circles`: Pitch circles and rollers, which are no edges.
    `contours`, `edges`: Its edges; circles.
    `slots`: Outlines of those that end.
    `lines`: Directions of guides and slots.
    `marks`: Named points.
    """

    name: str
    bar: bool = False
    holes: list[tuple[Place, float, str]] = field(default_factory=list)
    slots: list[PartContour] = field(default_factory=list)
    circles: list[tuple[Place, float]] = field(default_factory=list)
    contours: list[PartContour] = field(default_factory=list)
    edges: list[tuple[Place, float]] = field(default_factory=list)
    lines: list[tuple[Place, Place]] = field(default_factory=list)
    marks: dict[str, Place] = field(default_factory=dict)

    def bore(self, at: Place, radius: float, near: float, joint: str = "") -> None:
        """A hole for a pin; pins within a distance of each other have the widest hole."""
        same = [hole for hole in self.holes if math.dist(at, hole[0]) < near]
        widest = max((*same, (at, radius, joint)), key=lambda hole: (bool(hole[2]), hole[1]))
        self.holes = [hole for hole in self.holes if hole not in same] + [widest]

    def nearest_edge(self, at: Place) -> float:
        """Distance of a place to the nearest edge."""
        found = [abs(radius - math.dist(at, centre)) for centre, radius in self.edges]
        for contour in self.contours:
            x, y, bulge = np.transpose(contour.points)
            ends = np.roll([x, y], -1, axis=1)
            a, d = np.array([x, y]), ends - np.array([x, y])
            p = np.array(at)[:, None] - a
            size = np.maximum(np.sum(d * d, axis=0), TINY)
            part = np.clip(np.sum(p * d, axis=0) / size, 0.0, 1.0)
            away = np.hypot(*(p - part * d))
            straight = bulge == 0.0
            straight[-1] &= contour.closed
            found += [*away[straight], *np.hypot(*p)]
        return float(min(found, default=math.inf))


def rounded_bar(points: list[Place], radius: float) -> PartContour | None:
    """The outline of all that is within a radius of the convex hull of points: a bar about two.

    None about one point, where it is a circle.

    >>> bar = rounded_bar([(0.0, 0.0), (3.0, 0.0)], 1.0)
    >>> sorted({round(bulge, 9) for _, _, bulge in bar.points})
    [0.0, 1.0]
    """
    corners = hull(points, POINT_SAME * radius)
    if len(corners) < 2:
        return None
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.arctan2(-edges[:, 0], edges[:, 1])  # of each edge, outward
    found = []
    for n, (x, y) in enumerate(corners):
        start = float(normals[n - 1])
        sweep = (float(normals[n]) - start) % math.tau
        for angle, bulge in ((start, math.tan(sweep / 4.0)), (start + sweep, 0.0)):
            place = x + radius * math.cos(angle), y + radius * math.sin(angle)
            found.append((float(place[0]), float(place[1]), bulge))
    return PartContour(tuple(found))


def parts_of(system: System, width: float, hole: float) -> list[PartOutline]:
    """All parts of a mechanism, the ground first. `width`, `hole` [length]."""
    bodies = (system.mechanism.ground, *system.mechanism.bodies)
    return [_outline_of(system, body, width, hole) for body in bodies]


def _outline_of(system: System, link: Body, width: float, hole: float) -> PartOutline:
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
        part.bar = True
    return part


@functools.singledispatch
def _add(
    joint: Element, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    """Drawing of a joint on one of its parts: nothing by default."""


@_add.register
def _(
    joint: Revolute, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    if joint.pin_radius is None:
        part.bore(at, hole / 2.0, POINT_SAME * hole)
    else:
        radius = float(system.numbers[f"{joint.name}.pin_radius"])
        part.bore(at, radius, POINT_SAME * hole, joint.name)


@_add.register
def _(
    joint: Distance, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    part.bore(at, hole / 2.0, POINT_SAME * hole)


@_add.register
def _(
    joint: Prismatic, part: PartOutline, side: str, at: Place, system: System, hole: float
) -> None:
    part.lines.append(_guide(joint, side, at, system, hole))


@_add.register
def _(joint: PinSlot, part: PartOutline, side: str, at: Place, system: System, hole: float) -> None:
    if side == "j":
        part.bore(at, hole / 2.0, POINT_SAME * hole)
        return
    start, end = _guide(joint, side, at, system, hole)
    part.lines.append((start, end))
    limited = joint.limits is not None and None not in joint.limits
    if limited and (slot := rounded_bar([start, end], hole / 2.0)):
        part.slots.append(slot)


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
        part.contours.append(PartContour(tuple((float(x), float(y), 0.0) for x, y in places)))
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


#: Places of every piece of a curve that are drawn.
DRAWN = 4


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
        sweep = (end - begin) % math.tau
        ends = [
            (centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a))
            for a in (begin, end)
        ]
        first, last = (*ends[0], math.tan(sweep / 4.0)), (*ends[1], 0.0)
        part.contours.append(PartContour((first, last), closed=False))
    elif isinstance(shape, CurveShape):
        contour, (ox, oy) = shape.contour(system.mechanism.curves, name), points[shape.point]
        places = tuple((ox + x, oy + y, 0.0) for x, y in contour.places(DRAWN)[0].tolist())
        part.contours.append(PartContour(places, closed=contour.closed))
    elif isinstance(shape, Segment | Polygon):
        closed = isinstance(shape, Polygon)
        names = shape.polygon if isinstance(shape, Polygon) else shape.segment
        corners = tuple((*points[key], 0.0) for key in names)
        part.contours.append(PartContour(corners, closed=closed))
    elif not isinstance(shape, Line | Vertex):
        raise TypeError(f"a shape without a drawing: {shape!r}")


def _bar(part: PartOutline, width: float) -> None:
    """A bar or a plate with round corners about the places of its joints and points."""
    places = [*(centre for centre, _, _ in part.holes), *part.marks.values()]
    places += [place for start, end in part.lines for place in (start, end)]
    places = [(float(x), float(y)) for x, y in unique(places or [(0.0, 0.0)], POINT_SAME * width)]
    if contour := rounded_bar(places, width / 2.0):
        part.contours.append(contour)
    else:
        part.edges.append((places[0], width / 2.0))


#: Codes of $INSUNITS.
UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6}
#: The layer of what is not cut: names, pitch circles, directions.
MARKS = "marks"
#: Parts of the mean distance of places on a link: the width of bars; of that, of holes.
WIDTH, HOLE = 0.2, 0.4


@dataclass(frozen=True)
class PartDrawing:
    """The text of a drawing, and what it assumes."""

    text: str
    notes: tuple[str, ...] = ()


def to_dxf(
    mechanism: Mechanism, width: Number | None = None, hole: Number | None = None
) -> PartDrawing:
    """All links side by side, each a block in its own axes, on a layer of its name.

    Parameters
    ----------
    mechanism : Mechanism
    width, hole : float or str, optional
        Of bars, and the diameter of holes for pins without `pin_radius` [length], which a model
        does not have: by default a fifth of the mean extent of links, and 0.4 of that.

    Returns
    -------
    PartDrawing
        `text` and `notes`.

    Raises
    ------
    ModelError
        For a width or a diameter that is not positive, or a hole that is wider than its bar.
    SolveError
        Where ezdxf is not installed.

    Notes
    -----
    Circles are holes, at the places of pins, as wide as their `pin_radius`, else as `hole`; pins at
    one place have the widest. Bars have round ends about them; those that nobody gave a width are
    wide enough for them. A cam is its contour in 1440 points, to be cut as it is. Bodies with
    shapes have the edges of these. The layer ``marks`` has names, named points, pitch circles,
    rollers and the lines of guides.

    Examples
    --------
    >>> import mbody
    >>> drawing = to_dxf(mbody.gallery.load("norton_fourbar"), width=1.0, hole=0.5)
    >>> drawing.text.count("coupler") > 0
    True
    """
    try:
        ezdxf: Any = importlib.import_module("ezdxf")
    except ImportError:
        raise SolveError(
            "a drawing in DXF needs the package ezdxf, which is not installed: pip install ezdxf"
        ) from None
    system = assemble(mechanism)
    notes = []
    unit = mechanism.units.length
    broad = _length(mechanism, width, "width")
    if broad is None:
        bare = parts_of(system, 1.0, 1.0)
        widest = max((2.0 * r for part in bare for _, r, own in part.holes if own), default=0.0)
        broad = max(WIDTH * _span(bare), widest / HOLE)
        notes.append(f"bars are {broad:.4g} {unit} wide: the model does not say how wide")
    bore = _length(mechanism, hole, "hole")
    if bore is None:
        bore = HOLE * broad
        notes.append(f"holes without a pin_radius have a diameter of {bore:.4g} {unit}")
    for what, value in (("the width of bars", broad), ("the diameter of holes", bore)):
        if not (np.isfinite(value) and value > 0.0):
            raise ModelError(f"{what} is {value:g} {unit}: it must be positive")
    if bore >= broad:
        raise ModelError(
            f"holes of {bore:g} {unit} do not fit into bars of {broad:g} {unit}: give wider bars"
        )
    scale = 1.0
    if unit not in UNITS:
        scale = unit_system(mechanism.units).unit("length").factor * 1e3
        notes.append("lengths are in mm")
    parts = [part for part in parts_of(system, broad, bore) if _drawn(part)]
    _check_bars(parts, broad, unit)
    notes += _notes_on_holes(parts, bore if hole is not None else None, unit)
    if any(isinstance(joint, Gear) for joint in mechanism.joints):
        notes.append("wheels are pitch circles, without teeth")
    text = _written(ezdxf, parts, broad, scale, UNITS.get(unit, UNITS["mm"]))
    return PartDrawing(text, tuple(notes))


def _check_bars(parts: list[PartOutline], broad: float, unit: str) -> None:
    """Refuse bars with holes that are wider."""
    for part in parts:
        for at, radius, joint in part.holes if part.bar else ():
            if radius >= part.nearest_edge(at):
                raise ModelError(
                    f"the hole of the pin '{joint}' is {2.0 * radius:g} {unit} wide, twice its "
                    f"pin_radius, and the bar '{part.name}' {broad:g} {unit}: give wider bars"
                )


def _notes_on_holes(parts: list[PartOutline], bore: float | None, unit: str) -> list[str]:
    """Those of another width than was asked for, and those that cross an edge."""
    notes: list[str] = []
    own: dict[str, float] = {}
    for part in parts:
        for at, radius, joint in part.holes:
            own |= {joint: 2.0 * radius} if joint else {}
            if radius >= part.nearest_edge(at):
                pin = f"the hole of the pin '{joint}'" if joint else "a hole"
                wide = f"{2.0 * radius:.4g} {unit} wide"
                notes.append(f"{pin}, {wide}, crosses an edge of '{part.name}'")
    other = [f"{name} {width:.4g} {unit}" for name, width in own.items() if width != bore]
    if other and bore is not None:
        notes.append(
            f"holes of pins with a pin_radius are as wide as these: {', '.join(other)}; "
            f"{bore:.4g} {unit} is that of the others"
        )
    return notes


def _length(mechanism: Mechanism, given: Number | None, field: str) -> float | None:
    """A length in the units of the mechanism."""
    if given is None:
        return None
    value = number(given, "length", "drawing", field)
    return float(evaluated(value, mechanism.parameters.scope(), "drawing", field))


def _span(parts: list[PartOutline]) -> float:
    """The mean extent of the places on a link."""
    spans, sizes = [], []
    for part in parts:
        places = np.array([*(c for c, _, _ in part.holes), *part.marks.values()]).reshape(-1, 2)
        if len(places) > 1:
            spans.append(float(np.hypot(*np.ptp(places, axis=0))))
        round_ones = [2.0 * radius for _, radius in part.circles]
        wide = [float(np.ptp([p[:2] for p in c.points], axis=0).max()) for c in part.contours]
        sizes += [*round_ones, *wide]
    found = [span for span in spans if span > 0.0] or sizes
    return float(np.mean(found)) if found else 1.0


def _drawn(part: PartOutline) -> bool:
    return bool(part.holes or part.slots or part.contours or part.edges or part.circles)


def _written(ezdxf: Any, parts: list[PartOutline], width: float, scale: float, units: int) -> str:
    document = ezdxf.new("R2010")
    document.units = units
    document.layers.add(MARKS, color=8)
    extents = importlib.import_module("ezdxf.bbox").extents
    space, across, gap = document.modelspace(), 0.0, width * scale
    used = {MARKS.lower(), "0", "defpoints"}
    for n, part in enumerate(parts):
        layer = _layer(part.name, used)
        document.layers.add(layer, color=1 + n % 6)
        block = document.blocks.new(layer)
        _draw(block, part, layer, scale)
        box = extents(block)
        at = across - box.extmin.x, -box.extmin.y
        space.add_blockref(layer, at, dxfattribs={"layer": layer})
        name = {"layer": MARKS, "height": 0.5 * gap}
        space.add_text(part.name, dxfattribs=name).set_placement((across, -gap))
        # a letter is about as wide as 0.4 of a bar
        across += max(box.size.x, 0.4 * gap * len(part.name)) + gap
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _layer(name: str, used: set[str]) -> str:
    """A name that a layer may have."""
    plain = re.sub(r'[<>/\\":;?*|=`,]', "_", name)
    while plain.lower() in used:
        plain += "_"
    used.add(plain.lower())
    return plain


def _draw(block: Any, part: PartOutline, layer: str, scale: float) -> None:
    edge, mark = {"layer": layer}, {"layer": MARKS}
    for (x, y), radius in (*((at, radius) for at, radius, _ in part.holes), *part.edges):
        block.add_circle((x * scale, y * scale), radius * scale, dxfattribs=edge)
    for contour in (*part.contours, *part.slots):
        points = [(x * scale, y * scale, bulge) for x, y, bulge in contour.points]
        block.add_lwpolyline(points, format="xyb", close=contour.closed, dxfattribs=edge)
    for (x, y), radius in part.circles:
        block.add_circle((x * scale, y * scale), radius * scale, dxfattribs=mark)
    for start, end in part.lines:
        block.add_line(np.multiply(start, scale), np.multiply(end, scale), dxfattribs=mark)
    for x, y in part.marks.values():
        block.add_point((x * scale, y * scale), dxfattribs=mark)
