"""Shapes of bodies, which contacts are between: discs, rings, edges, polygons, curves, points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import check_name, listed
from mbody.quantities import Formula
from mbody.quantities.formula import NumberField, OptionalNumberField, default, number, required

if TYPE_CHECKING:
    from mbody.laws.smooth_contour import Contour
    from mbody.model.element import Numbers


#: The fewest corners of a polygon.
LEAST_CORNERS = 3


@dataclass(frozen=True)
class Vertex:
    """A point of a body as a shape, or a place at an offset from it in the axes of the body."""

    point: str
    offset: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Disc:
    """A circle about a point, full: other shapes touch it from outside.

    With `begin` and `end`, angles [rad] in the axes of the body, it is the arc from one to the
    other, counter-clockwise, with its ends.
    """

    disc: str
    radius: NumberField = required()
    begin: OptionalNumberField = default(None)
    end: OptionalNumberField = default(None)


@dataclass(frozen=True)
class Ring:
    """A circle about a point, hollow: discs and points touch it from within; with `begin` and `end`
    an arc of it.
    """

    ring: str
    radius: NumberField = required()
    begin: OptionalNumberField = default(None)
    end: OptionalNumberField = default(None)


@dataclass(frozen=True)
class ArcEnd:
    """An end of an arc, as a corner: its last one, or its first."""

    arc: Disc | Ring
    last: bool


@dataclass(frozen=True)
class Line:
    """An endless straight line through a point, at an angle [rad] in the axes of the body; the body
    is on its right, what touches it on its left.
    """

    point: str
    angle: NumberField = default(0.0)


@dataclass(frozen=True)
class Segment:
    """A straight line from one point to another with its ends; other shapes touch it on its left,
    seen from the first point to the second.
    """

    segment: tuple[str, ...]


@dataclass(frozen=True)
class Polygon:
    """A full polygon of three points or more, in the order of its corners, either way round."""

    polygon: tuple[str, ...]


@dataclass(frozen=True)
class CurveShape:
    """A smooth contour by a named curve y(x) from a point, or by two, x and y of one number, closed
    where both are periodic; other shapes touch it on its left, as its numbers grow.
    """

    curve: str | tuple[str, ...]
    point: str = ""
    #: The contour, which the mechanism makes when a contact with it is added.
    law: Contour | None = field(default=None, repr=False, compare=False)

    def contour(self, curves: Mapping[str, Any], place: str) -> Contour:
        """Its contour by the curves of the mechanism; `place` is its dotted name."""
        from mbody.model.curves import contour_named

        return contour_named(self.curve, curves, place)


Shape: TypeAlias = Disc | Ring | Line | Segment | Polygon | CurveShape | Vertex
#: A shape, or a table of it as in a file: ``{"disc": "O", "radius": 0.3}``.
ShapeLike: TypeAlias = "Shape | Mapping[str, Any]"

#: What a table of a shape is recognised by, what else it has, and what it may have.
TABLES: dict[str, tuple[type, tuple[str, ...], tuple[str, ...]]] = {
    "disc": (Disc, ("radius",), ("begin", "end")),
    "ring": (Ring, ("radius",), ("begin", "end")),
    "segment": (Segment, (), ()),
    "line": (Line, (), ()),
    "polygon": (Polygon, (), ()),
    "curve": (CurveShape, ("point",), ()),
}


def as_shapes(given: Any, body: str, points: Mapping[str, Any]) -> dict[str, Shape]:
    """Checked shapes of a body by name."""
    if not isinstance(given, Mapping):
        raise ModelError(
            f"'{body}': shapes must be a dict such as "
            f'{{"rim": {{"disc": "O", "radius": 0.3}}}}, not {brief(given)}',
            body,
        )
    found: dict[str, Shape] = {}
    for name, value in given.items():
        check_name(name, "shape")
        if name in points or name in ("cg", "mass", "weight", "inertia", "spread", "section"):
            raise ModelError(
                f"'{body}': the name of shape '{name}' is taken by a point or a number of the "
                "body: choose another",
                body,
            )
        found[name] = _checked(_shape(value, body, name), body, name, points)
    return found


def _shape(value: Any, body: str, name: str) -> Shape:
    """A shape, from itself or from a table."""
    if isinstance(value, Disc | Ring | Line | Segment | Polygon | CurveShape):
        return value
    keys = list(value) if isinstance(value, Mapping) else []
    kind = next((key for key in TABLES if key in keys), None)
    if kind is None:
        raise ModelError(
            f"'{body}': {name} is {brief(value)}, no shape: give one of {listed(TABLES)}, such as "
            '{"disc": "O", "radius": 0.3}',
            body,
        )
    cls, more, optional = TABLES[kind]
    unknown = [key for key in keys if key not in (kind, *more, *optional)]
    missing = [key for key in more if key not in keys]
    if unknown or missing:
        what = f"has no {listed(unknown)}" if unknown else f"needs {listed(missing)}"
        raise ModelError(f"'{body}': {name}: a {kind} {what}", body)
    if kind != "line":
        return cls(**value)
    table = value["line"]
    if not isinstance(table, Mapping) or "point" not in table or set(table) - {"point", "angle"}:
        raise ModelError(
            f"'{body}': {name}: line must be {{ point = …, angle = … }}, not {brief(table)}", body
        )
    return Line(**table)


def _checked(shape: Shape, body: str, name: str, points: Mapping[str, Any]) -> Shape:
    """The shape with its points looked up and its numbers let in."""
    if isinstance(shape, Disc | Ring):
        centre = shape.disc if isinstance(shape, Disc) else shape.ring
        named: tuple[Any, ...] = (centre,)
        radius = number(shape.radius, "length", body, f"{name}.radius")
        if not isinstance(radius, Formula) and radius <= 0.0:
            raise ModelError(
                f"'{body}': {name}.radius is {radius:g}, it must be positive: a shape without "
                "radius is a point, which a contact names by itself",
                body,
            )
        made: Shape = type(shape)(centre, radius, *_arc(shape, body, name))
    elif isinstance(shape, CurveShape):
        named, curves = (shape.point,), shape.curve
        curves = tuple(curves) if isinstance(curves, list) else curves
        made = CurveShape(curves, shape.point)
    elif isinstance(shape, Line):
        named = (shape.point,)
        made = Line(shape.point, number(shape.angle, "angle", body, f"{name}.angle"))
    else:
        assert not isinstance(shape, Vertex)  # no table makes one
        given = shape.segment if isinstance(shape, Segment) else shape.polygon
        if isinstance(given, str) or not isinstance(given, list | tuple):
            raise ModelError(
                f"'{body}': {name} must list its points by name, not {brief(given)}", body
            )
        named = tuple(given)
        two = isinstance(shape, Segment)
        if len(set(map(str, named))) != len(named) or not (
            len(named) == 2 if two else len(named) >= LEAST_CORNERS
        ):
            wanted = "two points" if two else f"at least {LEAST_CORNERS} points"
            raise ModelError(
                f"'{body}': {name} needs {wanted} of different names, not {brief(given)}", body
            )
        made = Segment(named) if two else Polygon(named)
    for point in named:
        if not isinstance(point, str) or point not in points:
            raise ModelError(
                f"'{body}': {name} names point {brief(point)}, which the body has not (it has: "
                f"{listed(points)}): add it to its points",
                body,
            )
    return made


def _arc(shape: Disc | Ring, body: str, name: str) -> tuple[Any, Any]:
    """The checked angles of an arc, None of a whole circle."""
    given = shape.begin, shape.end
    if given == (None, None):
        return given
    if None in given:
        raise ModelError(
            f"'{body}': {name} has begin or end alone: an arc goes from begin to end, "
            "counter-clockwise; a whole circle has neither",
            body,
        )
    begin, end = (
        number(angle, "angle", body, f"{name}.{key}")
        for key, angle in zip(("begin", "end"), given, strict=True)
    )
    numbers = [angle for angle in (begin, end) if not isinstance(angle, Formula)]
    if len(numbers) == 2:
        _refuse_no_arcs(f"{body}.{name}", *numbers)
    return begin, end


def _refuse_no_arcs(name: str, begin: Any, end: Any) -> None:
    """Refuse arcs without length, or of a revolution and more, of one design or of a batch."""
    body, _, shape = name.partition(".")
    for first, last in zip(*map(np.ravel, np.broadcast_arrays(begin, end)), strict=True):
        if not 0.0 < last - first < math.tau:
            raise ModelError(
                f"'{body}': {shape} goes from {math.degrees(first):g} deg to "
                f"{math.degrees(last):g} deg: end must be above begin, by less than a turn; a "
                "whole circle has neither",
                body,
            )


def refuse_shapes(
    contact: str, names: tuple[str, str], shapes: tuple[Shape, ...], at: Numbers, unit: str
) -> None:
    """Refuse, of one design or of a batch, arcs without length, discs as large as the ring that
    they touch from within, and those that would touch a curve at two places.
    """
    for name, shape in zip(names, shapes, strict=True):
        if isinstance(shape, Disc | Ring) and shape.begin is not None:
            _refuse_no_arcs(name, at[f"{name}.begin"], at[f"{name}.end"])
    for (disc, inner), (ring, outer) in itertools.permutations(zip(names, shapes, strict=True)):
        if isinstance(inner, Disc) and isinstance(outer, CurveShape) and outer.law is not None:
            outer.law.refuse_wide(contact, disc, ring, at[f"{disc}.radius"], unit)
        if not (isinstance(inner, Disc) and isinstance(outer, Ring)):
            continue
        radii = np.broadcast_arrays(at[f"{disc}.radius"], at[f"{ring}.radius"])
        for small, large in zip(*map(np.ravel, radii), strict=True):
            if small >= large:
                raise ModelError(
                    f"'{contact}': the disc '{disc}' of radius {small:g} {unit} is not within the "
                    f"ring '{ring}' of radius {large:g} {unit}: give it a smaller one",
                    contact,
                )


def points_of(shape: Shape) -> tuple[str, ...]:
    """The points of the body that a shape is made of."""
    if isinstance(shape, Segment):
        return shape.segment
    if isinstance(shape, Polygon):
        return shape.polygon
    if isinstance(shape, Disc | Ring):
        return (shape.disc if isinstance(shape, Disc) else shape.ring,)
    return (shape.point,)


def middles_of_arcs(shapes: Mapping[str, Shape]) -> set[str]:
    """The points about which arcs go, which may be off the body, and no other shape is made of."""
    arcs = [s for s in shapes.values() if isinstance(s, Disc | Ring) and s.begin is not None]
    others = [shape for shape in shapes.values() if shape not in arcs]
    return {p for s in arcs for p in points_of(s)} - {p for s in others for p in points_of(s)}


def shape_numbers(name: str, shape: Shape) -> dict[str, Any]:
    """The changeable numbers of a shape, by dotted name."""
    if isinstance(shape, Disc | Ring):
        own = {"radius": shape.radius, "begin": shape.begin, "end": shape.end}
        return {f"{name}.{key}": value for key, value in own.items() if value is not None}
    return {f"{name}.angle": shape.angle} if isinstance(shape, Line) else {}
