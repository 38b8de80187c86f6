"""Where two shapes may touch: pairs of a point or circle with a straight line or another circle.

Each such spot has a normal row, the gap up to its sense, and a row along it, whose rate is the
sliding velocity; both are of the kinds of physics that joints have:

* a circle of radius r on a line, r = 0 of a point: n_i · d − r and u_i · d + r (θ_j − θ_i);
* two circles of signed radii: their `clearance` |d| − (r_i + r_j) and `slipping`, the row of a
  gear pair whose direction follows the line of centres.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mbody.core.dual_number import value, where
from mbody.laws import Constant
from mbody.model.primitives import ConstraintPrimitive, Signal
from mbody.model.touching_shapes import ArcEnd, Disc, Line, Polygon, Ring, Segment, Shape, Vertex

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["Arc", "Spot", "contact_spots"]

#: A shape with its dotted name, such as "wheel.rim".
Side: TypeAlias = "tuple[str, Shape]"
#: A circle or corner.
Touching: TypeAlias = "Disc | Ring | Vertex | ArcEnd"
#: The same with the dotted name of its shape.
Round: TypeAlias = "tuple[str, Touching]"
#: What makes a spot of numbers.
MakeSpot: TypeAlias = "Callable[[Numbers], Spot]"
#: What has no radius.
CORNERS = (Vertex, ArcEnd)


@dataclass(frozen=True)
class Arc:
    """How far a circle of a spot goes round.

    Attributes
    ----------
    second : bool
        Whether it is on the second body of the rows.
    begin, extent : float
        Where it begins in the axes of its body, and how far it goes, counter-clockwise [rad].
    radius : float
        Positive.
    ahead : float or None
        Where it touches from its centre: along (1) or against (−1) the way from the first arm to
        the second; None where it touches an edge.
    """

    second: bool
    begin: Any
    extent: Any
    radius: Any
    ahead: float | None


@dataclass(frozen=True)
class Spot:
    """One place where two bodies may touch.

    Attributes
    ----------
    normal : ConstraintPrimitive
        Its row is `sense` times the gap.
    tangent : ConstraintPrimitive or None
        Its rate is the sliding velocity; None of ropes.
    sense : float
        1 where the row of the normal grows as the bodies part, −1 where it falls.
    swapped : bool
        Whether the first body of the rows is that of the contact's j.
    edge : tuple or None
        (x, y) of the beginning of an edge from the mass centre of the rows' first body, its
        direction (x, y), and its length: where it may touch.
    arm : pair
        The point or centre from the mass centre of the rows' second body.
    round : bool
        Whether a circle is in it, which can roll.
    solid : str
        What the edge belongs to: "line", "segment", "polygon", else "circle", "rope", or "row" of
        what has no shapes; "one way" of what has no gap, but a rate that may grow one way.
    reach : float
        Radius of the circle on an edge.
    arcs : tuple of Arc
        Of its circles those that do not go all round.
    """

    normal: ConstraintPrimitive
    tangent: ConstraintPrimitive | None
    sense: float
    swapped: bool
    edge: tuple[Any, ...] | None
    arm: tuple[Any, Any]
    round: bool
    solid: str
    reach: Any = 0.0
    arcs: tuple[Arc, ...] = ()

    @property
    def ends(self) -> bool:
        """Whether what touches may go past an end of an edge or an arc."""
        return bool(self.arcs) or (self.edge is not None and bool(np.isfinite(self.edge[2])))

    @classmethod
    def taut(cls, bodies: tuple[str, str], arms: list[Any], length: Any) -> Spot:
        """That of a rope."""
        law = Signal(Constant(0.0), [length])
        row = ConstraintPrimitive("clearance", *bodies, "l", arms, law, switched=True)
        return cls(row, None, -1.0, False, None, (arms[2], arms[3]), False, "rope")

    @classmethod
    def row(
        cls, normal: ConstraintPrimitive, sense: float, tangent: ConstraintPrimitive | None = None
    ) -> Spot:
        """That of a row, `sense` times which is the gap: of a stop, or of a joint of one sense."""
        return cls(normal, tangent, sense, False, None, (0.0, 0.0), False, "row")

    @classmethod
    def one_way(cls, normal: ConstraintPrimitive, sense: float) -> Spot:
        """That of a freewheel: `sense` times the rate of the row is not negative."""
        return cls(normal, None, sense, False, None, (0.0, 0.0), False, "one way")


def contact_spots(i: Side, j: Side) -> list[MakeSpot]:
    """The spots of two shapes; none where they cannot touch."""
    found: list[MakeSpot] = []
    for swapped, (edged, other) in enumerate(((i, j), (j, i))):
        for edge in range(_edges(edged[1])):
            for one in _rounds(other[1]):
                if not isinstance(one, Ring):
                    touching = (other[0], one)
                    found.append(functools.partial(_on_edge, edged, edge, touching, bool(swapped)))
    for one, two in itertools.product(_rounds(i[1]), _rounds(j[1])):
        hollow = isinstance(one, Ring) + isinstance(two, Ring)
        if hollow < 2 and not (isinstance(one, CORNERS) and isinstance(two, CORNERS)):
            found.append(functools.partial(_on_circle, (i[0], one), (j[0], two)))
    return found


def _edges(shape: Shape) -> int:
    """How many straight edges a shape has."""
    if isinstance(shape, Polygon):
        return len(shape.polygon)
    return int(isinstance(shape, Line | Segment))


def _rounds(shape: Shape) -> Iterator[Touching]:
    """The circles and corners of a shape."""
    if isinstance(shape, Disc | Ring | Vertex):
        yield shape
        if not isinstance(shape, Vertex) and shape.begin is not None:
            yield from (ArcEnd(shape, last) for last in (False, True))
    elif isinstance(shape, Segment):
        yield from map(Vertex, shape.segment)
    elif isinstance(shape, Polygon):
        yield from map(Vertex, shape.polygon)


def _body(name: str) -> str:
    return name.partition(".")[0]


def _arm(at: Numbers, name: str, point: str) -> tuple[Any, Any]:
    """A named point from the mass centre of its body, in link axes; `name` of the shape."""
    body = _body(name)
    (x, y), (cx, cy) = at.point(f"{body}.{point}"), at.point(f"{body}.cg")
    return x - cx, y - cy


def _circle(at: Numbers, one: Round) -> tuple[tuple[Any, Any], Any]:
    """Centre from the mass centre, and radius, of a circle or a corner."""
    name, shape = one
    if isinstance(shape, Vertex):
        return _arm(at, name, shape.point), 0.0
    if isinstance(shape, ArcEnd):
        (x, y), radius = _circle(at, (name, shape.arc))
        angle = at[f"{name}.end" if shape.last else f"{name}.begin"]
        return (x + radius * np.cos(angle), y + radius * np.sin(angle)), 0.0
    centre = shape.disc if isinstance(shape, Disc) else shape.ring
    return _arm(at, name, centre), at[f"{name}.radius"]


def _arcs(at: Numbers, one: Round, second: bool, ahead: float | None) -> tuple[Arc, ...]:
    """That of a circle that does not go all round."""
    name, shape = one
    if not isinstance(shape, Disc | Ring) or shape.begin is None:
        return ()
    begin = at[f"{name}.begin"]
    return (Arc(second, begin, at[f"{name}.end"] - begin, at[f"{name}.radius"], ahead),)


def _edge(at: Numbers, side: Side, number: int) -> tuple[tuple[Any, Any], tuple[Any, Any], Any]:
    """Beginning from the mass centre, direction and length of an edge, free on its left."""
    name, shape = side
    if isinstance(shape, Line):
        angle = at[f"{name}.angle"]
        return _arm(at, name, shape.point), (np.cos(angle), np.sin(angle)), np.inf
    names = shape.segment if isinstance(shape, Segment) else shape.polygon  # type: ignore[union-attr]
    corners = [_arm(at, name, point) for point in names]
    a, b = corners[number], corners[(number + 1) % len(corners)]
    if isinstance(shape, Polygon):
        # its inside is on the left of a polygon that goes round counter-clockwise
        following = corners[1:] + corners[:1]
        pairs = zip(corners, following, strict=True)
        area = sum(p[0] * q[1] - p[1] * q[0] for p, q in pairs)
        inside_left = value(area) > 0.0
        a, b = (
            tuple(where(inside_left, q, p)[()] for p, q in zip(a, b, strict=True)),
            tuple(where(inside_left, p, q)[()] for p, q in zip(a, b, strict=True)),
        )
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = np.hypot(dx, dy)
    return a, (dx / length, dy / length), length


def _on_edge(edged: Side, edge: int, one: Round, swapped: bool, at: Numbers) -> Spot:
    """A circle or corner on a straight edge."""
    (ix, iy), (ux, uy), length = _edge(at, edged, edge)
    arm, radius = _circle(at, one)
    bodies = _body(edged[0]), _body(one[0])
    shifted = [ix - radius * uy, iy + radius * ux, *arm, -uy, ux]
    normal = ConstraintPrimitive("coordinate", *bodies, "l", shifted, switched=True)
    turning = not isinstance(one[1], CORNERS)
    along = [ix, iy, *arm, ux, uy, *([radius] if turning else [])]
    kind = "rack" if turning else "coordinate"
    tangent = ConstraintPrimitive(kind, *bodies, "l", along, switched=True)
    solid = type(edged[1]).__name__.lower()
    begin = (ix, iy), (ux, uy), length
    arcs = _arcs(at, one, True, None)
    return Spot(normal, tangent, 1.0, swapped, begin, arm, turning, solid, radius, arcs)


def _on_circle(i: Round, j: Round, at: Numbers) -> Spot:
    """Two circles, one of which may be a corner or a ring."""
    (arm_i, ri), (arm_j, rj) = _circle(at, i), _circle(at, j)
    inside = isinstance(i[1], Ring) or isinstance(j[1], Ring)
    if isinstance(i[1], Ring):
        rj = -rj
    elif isinstance(j[1], Ring):
        ri = -ri
    apart, bodies, arms = ri + rj, (_body(i[0]), _body(j[0])), [*arm_i, *arm_j]
    law = Signal(Constant(0.0), [apart])
    normal = ConstraintPrimitive("clearance", *bodies, "l", arms, law, switched=True)
    parameters = [*arms, ri / apart, rj / apart, 0.0]
    tangent = ConstraintPrimitive("slipping", *bodies, "l", parameters, switched=True)
    sense = -1.0 if inside else 1.0
    # within a ring both touch on the side that the centre of the inner one is on
    here = -1.0 if isinstance(j[1], Ring) else 1.0
    there = 1.0 if isinstance(i[1], Ring) else -1.0
    arcs = _arcs(at, i, False, here) + _arcs(at, j, True, there)
    # what goes through an arc, which is thin, to its other side
    reach = np.abs(rj if arcs[0].second is False else ri) if len(arcs) == 1 else 0.0
    return Spot(normal, tangent, sense, False, None, arm_j, True, "circle", reach, arcs)
