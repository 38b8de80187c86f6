"""Contacts between shapes of bodies, and ropes: what holds in one direction and may separate."""

from __future__ import annotations

import fnmatch
import functools
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from mbody.core.lanes import value, where
from mbody.errors import ModelError, brief
from mbody.laws import Constant
from mbody.model.driver import Constraint, refuse_static
from mbody.model.element import InheritedPlace, listed, number_field, place_field, two_bodies
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive, Signal
from mbody.model.touching_shapes import (
    ArcEnd,
    CurveShape,
    Disc,
    Line,
    Polygon,
    Ring,
    Segment,
    Shape,
    Vertex,
    points_of,
    refuse_shapes,
)
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.laws.smooth_contour import Contour
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem


# -- Rows of round contacts that roll without slip, counted from where they begin to -----------

#: A position of link axes: x, y [length] and angle [rad].
Pose = tuple[float, float, float]


def rolling_from(
    row: ConstraintPrimitive, at: Numbers, poses: Mapping[str, Pose]
) -> ConstraintPrimitive:
    """The row along a contact, always on, zero where both bodies have these positions.

    On a line u·d + r (θ_j − θ_i) keeps the value that it has there, on a circle the angle between
    n(ψ) and the line of centres.
    """
    parameters = list(row.parameters)
    (ix, iy), (jx, jy) = _row_end(row, 0, at, poses), _row_end(row, 1, at, poses)
    rotation_i, rotation_j = poses[row.i][2], poses[row.j][2]
    dx, dy = jx - ix, jy - iy
    if row.kind == "rack":
        ux, uy, radius = parameters[4:]
        c, s = np.cos(rotation_i), np.sin(rotation_i)
        along = (c * ux - s * uy) * dx + (s * ux + c * uy) * dy + radius * (rotation_j - rotation_i)
        parameters[0], parameters[1] = parameters[0] + along * ux, parameters[1] + along * uy
    elif row.kind == "contour":
        law: Any = row.law.law  # type: ignore[union-attr]  # it has one
        parameters[6] = law.rolled(dx, dy, rotation_i, rotation_j, parameters[4])
    else:
        i, j = parameters[4], parameters[5]
        parameters[6] = np.arctan2(dy, dx) - i * rotation_i - j * rotation_j
    return replace(row, parameters=parameters, active_set=False)


def _row_end(
    row: ConstraintPrimitive, side: int, at: Numbers, poses: Mapping[str, Pose]
) -> tuple[Any, Any]:
    """End of the row is fixed on one of its bodies, in axes of the ground."""
    body = (row.i, row.j)[side]
    x, y, angle = poses[body]
    (cx, cy), c, s = at.point(f"{body}.cg"), np.cos(angle), np.sin(angle)
    ax, ay = cx + row.parameters[2 * side], cy + row.parameters[2 * side + 1]
    return x + c * ax - s * ay, y + s * ax + c * ay


# -- Pairs of a point or circle with a straight line or another circle -------------------------
# Each such contact candidate has a normal row, the gap up to its direction, and a row along it,
# whose rate is the sliding velocity; both are of the kinds of physics that joints have:
#
# * a circle of radius r on a line, r = 0 of a point: n_i · d − r and u_i · d + r (θ_j − θ_i);
# * two circles of signed radii: their `clearance` |d| − (r_i + r_j) and `slipping`, the row of a
#   gear pair whose direction follows the line of centres.

#: A shape with its dotted name, such as "wheel.rim".
Side: TypeAlias = "tuple[str, Shape]"
#: A circle or corner.
CircleShape: TypeAlias = "Disc | Ring | Vertex | ArcEnd"
#: The same with the dotted name of its shape.
Round: TypeAlias = "tuple[str, CircleShape]"
#: What makes a contact candidate of numbers.
MakeCandidate: TypeAlias = "Callable[[Numbers], ContactCandidate]"
#: What has no radius.
CORNERS = (Vertex, ArcEnd)


@dataclass(frozen=True)
class Arc:
    """How far a circle of a contact candidate goes round.

    `second`: Whether it is on the second body of the rows.
    `begin`, `extent`: Where it begins in the axes of its body, and how far it goes,
      counter-clockwise [rad].
    `radius`: Positive.
    `ahead`: Where it touches from its centre: along (1) or against (−1) the direction from the
      first position to the second; None where it touches an edge.
    """

    second: bool
    begin: Any
    extent: Any
    radius: Any
    ahead: float | None


@dataclass(frozen=True)
class ContactCandidate:
    """One place where two bodies may touch.

    `normal`: Its row is `sign` times the gap.
    `tangent`: Its rate is the sliding velocity; None of ropes.
    `sign`: 1 where the row of the normal grows as the bodies part, −1 where it falls.
    `swapped`: Whether the first body of the rows is that of the contact's j.
    `edge`: (x, y) of the beginning of an edge from the mass centre of the rows' first body, its
      direction (x, y), and its length: where it may touch.
    `position`: The point or centre from the mass centre of the rows' second body.
    `round`: Whether a circle is in it, which can roll.
    `solid`: What the edge belongs to: "line", "segment", "polygon", else "circle", "rope", or "row"
      of what has no shapes; "one way" of what has no gap, but a rate that may grow one way.
    `edge_radius`: Radius of the circle on an edge.
    `arcs`: Of its circles those that do not go all round.
    `contour`: The smooth contour of a curve that it is on.
    """

    normal: ConstraintPrimitive
    tangent: ConstraintPrimitive | None
    sign: float
    swapped: bool
    edge: tuple[Any, ...] | None
    position: tuple[Any, Any]
    round: bool
    solid: str
    edge_radius: Any = 0.0
    arcs: tuple[Arc, ...] = ()
    contour: Contour | None = None

    @property
    def ends(self) -> bool:
        """Whether what touches may go past an end of an edge, an arc or a curve."""
        if self.contour is not None:
            return not self.contour.closed
        return bool(self.arcs) or (self.edge is not None and bool(np.isfinite(self.edge[2])))

    @classmethod
    def taut(cls, bodies: tuple[str, str], positions: list[Any], length: Any) -> ContactCandidate:
        """That of a rope."""
        law = Signal(Constant(0.0), [length])
        row = ConstraintPrimitive("clearance", *bodies, "l", positions, law, active_set=True)
        return cls(row, None, -1.0, False, None, (positions[2], positions[3]), False, "rope")

    @classmethod
    def row(
        cls, normal: ConstraintPrimitive, sign: float, tangent: ConstraintPrimitive | None = None
    ) -> ContactCandidate:
        """That of a row, `sign` times which is the gap: of a stop, or of a one-sided joint."""
        return cls(normal, tangent, sign, False, None, (0.0, 0.0), False, "row")

    @classmethod
    def one_way(cls, normal: ConstraintPrimitive, sign: float) -> ContactCandidate:
        """That of a freewheel: `sign` times the rate of the row is not negative."""
        return cls(normal, None, sign, False, None, (0.0, 0.0), False, "one way")


def contact_candidates(i: Side, j: Side) -> list[MakeCandidate]:
    """The contact candidates of two shapes; none where they cannot touch."""
    found: list[MakeCandidate] = []
    for (_, curve), (_, shape) in ((i, j), (j, i)):
        whole = isinstance(shape, Vertex) or (isinstance(shape, Disc) and shape.begin is None)
        if isinstance(curve, CurveShape) and (curve.law is None or not whole):
            return found
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
    """Number of edges of a shape."""
    if isinstance(shape, Polygon):
        return len(shape.polygon)
    return int(isinstance(shape, Line | Segment | CurveShape))


def _rounds(shape: Shape) -> Iterator[CircleShape]:
    """The circles and corners of a shape."""
    if isinstance(shape, Disc | Ring | Vertex):
        yield shape
        if not isinstance(shape, Vertex) and shape.begin is not None:
            yield from (ArcEnd(shape, last) for last in (False, True))
    elif isinstance(shape, Segment):
        yield from map(Vertex, shape.segment)
    elif isinstance(shape, Polygon):
        yield from map(Vertex, shape.polygon)
    elif isinstance(shape, CurveShape) and shape.law is not None and not shape.law.closed:
        yield from (Vertex(shape.point, shape.law.end(last)) for last in (False, True))


def _body(name: str) -> str:
    return name.partition(".")[0]


def body_fixed(at: Numbers, name: str, point: str) -> tuple[Any, Any]:
    """A named point from the mass centre of its body, in link axes; `name` of the shape."""
    body = _body(name)
    (x, y), (cx, cy) = at.point(f"{body}.{point}"), at.point(f"{body}.cg")
    return x - cx, y - cy


def circle_of(at: Numbers, one: Round) -> tuple[tuple[Any, Any], Any]:
    """Centre from the mass centre, and radius, of a circle or a corner."""
    name, shape = one
    if isinstance(shape, Vertex):
        (x, y), (ox, oy) = body_fixed(at, name, shape.point), shape.offset
        return (x + ox, y + oy), 0.0
    if isinstance(shape, ArcEnd):
        (x, y), radius = circle_of(at, (name, shape.arc))
        angle = at[f"{name}.end" if shape.last else f"{name}.begin"]
        return (x + radius * np.cos(angle), y + radius * np.sin(angle)), 0.0
    centre = shape.disc if isinstance(shape, Disc) else shape.ring
    return body_fixed(at, name, centre), at[f"{name}.radius"]


def _arcs(at: Numbers, one: Round, second: bool, ahead: float | None) -> tuple[Arc, ...]:
    """That of a circle that does not go all round."""
    name, shape = one
    if not isinstance(shape, Disc | Ring) or shape.begin is None:
        return ()
    begin = at[f"{name}.begin"]
    return (Arc(second, begin, at[f"{name}.end"] - begin, at[f"{name}.radius"], ahead),)


def edge_of_side(
    at: Numbers, side: Side, number: int
) -> tuple[tuple[Any, Any], tuple[Any, Any], Any]:
    """Beginning from the mass centre, direction and length of an edge, free on its left."""
    name, shape = side
    if isinstance(shape, Line):
        angle = at[f"{name}.angle"]
        return body_fixed(at, name, shape.point), (np.cos(angle), np.sin(angle)), np.inf
    names = shape.segment if isinstance(shape, Segment) else shape.polygon  # type: ignore[union-attr]
    corners = [body_fixed(at, name, point) for point in names]
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


def _on_edge(edged: Side, edge: int, one: Round, swapped: bool, at: Numbers) -> ContactCandidate:
    """A circle or corner on an edge."""
    position, radius = circle_of(at, one)
    bodies, rolls = (_body(edged[0]), _body(one[0])), not isinstance(one[1], CORNERS)
    if isinstance(edged[1], CurveShape):
        law: Any = edged[1].law
        more: dict[str, Any] = {"law": Signal(law, []), "active_set": True}
        own = [*body_fixed(at, edged[0], edged[1].point), *position, radius]
        normal, tangent = (
            ConstraintPrimitive("contour", *bodies, "l", [*own, part, 0.0], **more)
            for part in (0.0, -1.0 if law.closed else 1.0)
        )
        solid = "curve" if law.closed else "segment"
        return ContactCandidate(
            normal, tangent, 1.0, swapped, None, position, rolls, solid, radius, contour=law
        )
    (ix, iy), (ux, uy), length = edge_of_side(at, edged, edge)
    shifted = [ix - radius * uy, iy + radius * ux, *position, -uy, ux]
    normal = ConstraintPrimitive("coordinate", *bodies, "l", shifted, active_set=True)
    along = [ix, iy, *position, ux, uy, *([radius] if rolls else [])]
    kind = "rack" if rolls else "coordinate"
    tangent = ConstraintPrimitive(kind, *bodies, "l", along, active_set=True)
    solid = type(edged[1]).__name__.lower()
    begin = (ix, iy), (ux, uy), length
    arcs = _arcs(at, one, True, None)
    return ContactCandidate(
        normal, tangent, 1.0, swapped, begin, position, rolls, solid, radius, arcs
    )


def _on_circle(i: Round, j: Round, at: Numbers) -> ContactCandidate:
    """Two circles, one of which may be a corner or a ring."""
    (position_i, ri), (position_j, rj) = circle_of(at, i), circle_of(at, j)
    inside = isinstance(i[1], Ring) or isinstance(j[1], Ring)
    if isinstance(i[1], Ring):
        rj = -rj
    elif isinstance(j[1], Ring):
        ri = -ri
    distance, bodies, positions = ri + rj, (_body(i[0]), _body(j[0])), [*position_i, *position_j]
    law = Signal(Constant(0.0), [distance])
    normal = ConstraintPrimitive("clearance", *bodies, "l", positions, law, active_set=True)
    parameters = [*positions, ri / distance, rj / distance, 0.0]
    tangent = ConstraintPrimitive("slipping", *bodies, "l", parameters, active_set=True)
    sign = -1.0 if inside else 1.0
    # within a ring both touch on the side that the centre of the inner one is on
    here = -1.0 if isinstance(j[1], Ring) else 1.0
    there = 1.0 if isinstance(i[1], Ring) else -1.0
    arcs = _arcs(at, i, False, here) + _arcs(at, j, True, there)
    # what goes through an arc, which is thin, to its other side
    edge_radius = np.abs(rj if arcs[0].second is False else ri) if len(arcs) == 1 else 0.0
    return ContactCandidate(
        normal, tangent, sign, False, None, position_j, True, "circle", edge_radius, arcs
    )


# -- The base of contacts, ropes, stops and freewheels: what holds in one direction only -----------


def joined(mechanism: Any) -> tuple[Any, ...]:
    """The joints of a mechanism, and the contacts between two bodies that are closed for good."""
    contacts = (one for one in mechanism.contacts if one.closed and len(one.bodies) == 2)
    return (*mechanism.joints, *contacts)


@dataclass(frozen=True)
class OneSided(Constraint):
    """Base of contacts and ropes: distances that may grow, or shrink, but not the other way.

    `simulate` decides what is open and what is closed. Analyses of driven motions and of rest take
    as closed those places that touch where nothing else determines the position, with a note, and
    leave out all others.
    """

    role: ClassVar[str] = "contact"

    #: Of its places, by number, those that are closed for good, as a joint is; without any all may
    #: open and close.
    closed: tuple[int, ...] = field(
        default=(), kw_only=True, repr=False, metadata={"internal": True}
    )
    #: Where what is closed rolls from: x, y and angle of the link axes of both bodies, i and j;
    #: empty where it does not roll.
    rolls_from: tuple[float, ...] = field(
        default=(), kw_only=True, repr=False, metadata={"internal": True}
    )

    @property
    def rolls(self) -> bool:
        """Whether what is closed rolls."""
        return bool(self.rolls_from)

    @property
    def described(self) -> str:
        """The name of the element that was described: of what a joint brings the joint."""
        return self.name

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """Where it may act, with the rows of each."""
        raise NotImplementedError

    def candidates(self, at: Numbers) -> list[ContactCandidate]:
        """Where it may act, or does where it is closed."""
        every = self.every_candidate(at)
        return [every[n] for n in self.closed] if self.closed else every

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """The normal row of every contact candidate, off at first; of what is closed rows that are
        always on, of what rolls those along it, too.
        """
        candidates = self.candidates(at)
        if not self.closed:
            return [candidate.normal for candidate in candidates]
        across = [replace(candidate.normal, active_set=False) for candidate in candidates]
        if not self.rolls:
            return across
        i, j = self.bodies
        x, y, angle, *other = self.rolls_from
        poses = {i: (x, y, angle), j: (other[0], other[1], other[2])}
        along = [rolling_from(s.tangent, at, poses) for s in candidates if s.tangent is not None]
        return [*across, *along]

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The friction of every contact candidate, by the row along it; none of what rolls."""
        if self.rolls:
            return []
        mu, static = self.coefficients(at)

        # what would pull has none: with that of its size others than those that are admissible
        # balance the bodies, too
        return [
            FrictionPrimitive(
                "pressed", candidate.tangent, n, [mu, static, 0.0, 0.0, candidate.sign, 0.0]
            )
            for n, candidate in enumerate(self.candidates(at))
            if candidate.tangent is not None
        ]

    def points(self) -> set[str]:
        """Dotted names of the points that it touches."""
        markers = self.places().values()
        return {f"{one.body}.{one.point}" for one in markers if isinstance(one.point, str)}

    def coefficients(self, at: Numbers) -> tuple[float, float]:
        """Kinetic and static friction."""
        return 0.0, 0.0

    def restitution_of(self, at: Numbers) -> float:
        """Restitution, from 0 to 1."""
        return 0.0

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse numbers, of one design or of a batch, that do not fit together.

        Raises ModelError.
        """

    @property
    def described_as(self) -> str:
        """The element of the description that it belongs to."""
        return self.name

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """The sentence of a motion that begins beyond it.

        `depth`: By how much, in the unit of its row.
        `place`: Where, world axes [length].
        `values`: Numbers of the system by dotted name.
        """
        raise NotImplementedError

    def quantities(self) -> dict[str, str]:
        """The force, its components and torque about the mass centre of j; the pressing force."""
        forces = dict.fromkeys(("fx", "fy", "force", "contact"), "force")
        return forces | {"torque": "torque"}


#: Contacts of one group, at most: each is watched by itself.
MOST_CONTACTS = 2000
#: Laws of impacts.
IMPACT_LAWS = ("poisson", "newton")


@dataclass(frozen=True)
class ShapeContact(OneSided):
    """Base of contacts between shapes: their laws of friction and impacts."""

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: str = ""
    j: str = ""
    friction: NumberField = number_field("number", 0.0, sign="not negative")
    static: OptionalNumberField = number_field("number", None, sign="not negative")
    restitution: NumberField = number_field("number", 0.0, sign="not negative")
    law: str = "poisson"

    def _check(self) -> None:
        super()._check()
        refuse_coefficients(self.name, self.friction, self.static, self.restitution)

    def quantities(self) -> dict[str, str]:
        """The force of a contact, and the power that its friction takes."""
        return super().quantities() | {"loss": "power"}

    def coefficients(self, at: Numbers) -> tuple[float, float]:
        """Kinetic and static friction."""
        mu = at[f"{self.name}.friction"]
        return mu, mu if self.static is None else at[f"{self.name}.static"]  # type: ignore[return-value]  # one design

    def restitution_of(self, at: Numbers) -> float:
        """Restitution, from 0 to 1."""
        return at[f"{self.name}.restitution"]  # type: ignore[return-value]  # one design

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuses friction, static friction and restitution out of range in any design."""
        static = None if self.static is None else at[f"{self.name}.static"]
        numbers = (at[f"{self.name}.friction"], static, at[f"{self.name}.restitution"])
        rows = np.broadcast_arrays(*(np.nan if part is None else part for part in numbers))
        for mu, most, e in zip(*map(np.ravel, rows), strict=True):
            own = None if np.isnan(most) else float(most)
            refuse_coefficients(self.name, float(mu), own, float(e))


@dataclass(frozen=True)
class Contact(ShapeContact):
    """Contact between two shapes, or points, of two bodies: unilateral, with Coulomb friction and
    impacts.

    The gap g ≥ 0 and the pressing force λ_N ≥ 0 with g λ_N = 0; the friction |λ_T| ≤ μ_s λ_N where
    it sticks, which a constraint does, and λ_T = −μ λ_N sign γ_T where it slides. Points and discs
    touch lines, segments, polygons and discs from outside, rings from within; polygons and segments
    touch by their corners and ends.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : str
        Shapes or points of two bodies, such as ``"ground.floor"`` and ``"ladder.A"``.
    friction : float
        Kinetic coefficient μ.
    static : float, optional
        Coefficient μ_s of what sticks, at least `friction`; by default the same.
    restitution : float
        e of impacts, from 0 (no rebound) to 1 (no loss).
    law : str
        ``"poisson"`` gives back e of each impulse of compression, ``"newton"`` e of each velocity
        of approach; they differ where several contacts are closed at an impact. With friction
        Newton's may gain energy.

    Notes
    -----
    The force that `run.reaction` reports is that on body j by body i, its torque about the mass
    centre of j; `run.contact` is the pressing force and `run.mode` says what it does.

    Examples
    --------
    >>> Contact("foot", "ground.floor", "ladder.A", friction=0.25).bodies
    ('ground', 'ladder')
    """

    #: The two shapes, which the mechanism looks up when the contact is added.
    shapes: tuple[Shape, ...] = field(default=(), repr=False, metadata={"internal": True})

    def _enter(self) -> None:
        super()._enter()
        for side in ("i", "j"):
            value = getattr(self, side)
            body, _, shape = value.partition(".") if isinstance(value, str) else ("", "", "")
            if not body or not shape:
                raise ModelError(
                    f"'{self.name}': {side} is {brief(value)}, it must name a shape or a point of "
                    'a body: "ground.floor" or "ladder.A"',
                    self.name,
                )
        if self.bodies[0] == self.bodies[1]:
            raise ModelError(
                f"'{self.name}' would be between '{self.bodies[0]}' and itself: give shapes of two "
                "bodies",
                self.name,
            )
        if self.law not in IMPACT_LAWS:
            raise ModelError(
                f"'{self.name}': law is {brief(self.law)}: give one of {', '.join(IMPACT_LAWS)}",
                self.name,
            )

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuses coefficients of any design, arcs without length, and discs that fill a ring."""
        super().refuse(at, unit)
        refuse_shapes(self.name, (self.i, self.j), self.shapes, at, unit)

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.partition(".")[0], self.j.partition(".")[0]

    def with_shapes(self, known: Mapping[str, Any], curves: Mapping[str, Any]) -> Contact:
        """The contact with the shapes that it is between; `known` are the bodies and `curves` those
        of the mechanism, by name.

        Raises
        ------
        ModelError
            For a shape that is not there, and shapes that cannot touch.
        """
        made = replace(
            self, shapes=tuple(_shape(self.name, known, curves, one) for one in (self.i, self.j))
        )
        i, j = made.shapes
        if not contact_candidates((made.i, i), (made.j, j)):
            raise ModelError(
                f"'{self.name}': a {_named(i)} and a {_named(j)} do not touch: points and discs "
                "touch lines, segments, polygons and discs, and rings from within; of segments and "
                "polygons the corners do; curves are touched by points and whole discs",
                self.name,
            )
        return made

    def points(self) -> set[str]:
        """Those of its shapes."""
        pairs = zip(self.bodies, self.shapes, strict=True)
        return {f"{body}.{point}" for body, shape in pairs for point in points_of(shape)}

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """Each point with each line, and each two circles."""
        sides = zip((self.i, self.j), self.shapes, strict=True)
        return [make(at) for make in contact_candidates(*sides)]

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """By how much its shapes overlap, and where."""
        unit = units.length
        return (
            f"the shapes '{self.i}' and '{self.j}' of contact '{self.name}' overlap by {depth:.6g} "
            f"{unit} at the beginning, at ({place[0]:.6g}, {place[1]:.6g}) {unit}: begin with them "
            "apart, or touching"
        )


@dataclass(frozen=True)
class Between(ShapeContact):
    """Contacts between all shapes of two groups: a `Contact` for each pair that two bodies make.

    In a system the contacts stand in its place, named by it with a number each: "pile_1", "pile_2";
    but for `simulate` by ``method="moreau"``, which looks only at the shapes that are near.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : str
        Shapes or points by name, in which ``*`` stands for any letters and ``?`` for one:
        ``"ground.floor"``, ``"stone*.rim"``.
    friction, static, restitution, law
        As of `Contact`.

    Examples
    --------
    >>> Between("pile", "stone*.rim", "stone*.rim").pairs(["stone1.rim", "stone2.rim"])
    [('stone1.rim', 'stone2.rim')]
    """

    @property
    def bodies(self) -> tuple[str, ...]:
        """None by name."""
        return ()

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """None of its own."""
        return []

    def sides(self, known: Sequence[str]) -> tuple[list[str], list[str]]:
        """The names that fit i and j, among those known."""
        i, j = ([n for n in known if fnmatch.fnmatchcase(n, str(p))] for p in (self.i, self.j))
        return i, j

    def pairs(self, known: Sequence[str]) -> list[tuple[str, str]]:
        """The pairs of shapes of different bodies, each once, among those known."""
        groups = self.sides(known)
        found: dict[frozenset[str], tuple[str, str]] = {}
        for one in groups[0]:
            for other in groups[1]:
                if one.partition(".")[0] != other.partition(".")[0]:
                    found.setdefault(frozenset((one, other)), (one, other))
            if len(found) > MOST_CONTACTS:
                raise ModelError(
                    f"'{self.name}' would be more than {MOST_CONTACTS} contacts, {len(groups[0])} "
                    f"shapes with {len(groups[1])}: every pair is watched by itself; simulate by "
                    'the method "moreau", which looks at those that are near, or name fewer shapes',
                    self.name,
                )
        return list(found.values())

    def refuse_empty(self, bodies: Sequence[Any]) -> None:
        """Refuse a group of which no two shapes are on different bodies.

        Raises
        ------
        ModelError
        """
        known = shape_names(bodies)
        i, j = ({name.partition(".")[0] for name in side} for side in self.sides(known))
        if not i or not j or (len(i) == 1 and i == j):
            raise ModelError(
                f"'{self.name}': no two shapes of different bodies fit {brief(self.i)} and "
                f"{brief(self.j)} (there are: {listed(known)})",
                self.name,
            )

    def contacts(self, bodies: Sequence[Any]) -> list[Contact]:
        """The contacts of the group between bodies.

        Raises
        ------
        ModelError
            Where there are too many.
        """
        pairs = self.pairs(shape_names(bodies))
        own = {key: getattr(self, key) for key in ("friction", "static", "restitution", "law")}
        return [
            Contact(f"{self.name}_{n}", one, other, **own)
            for n, (one, other) in enumerate(pairs, start=1)
        ]


def shape_names(bodies: Sequence[Any]) -> list[str]:
    """The dotted names of all shapes and points of bodies."""
    return [f"{b.name}.{key}" for b in bodies for key in (*b.shapes, *b.points)]


@dataclass(frozen=True)
class Rope(OneSided):
    """Rope, chain, one-sided bar: two places are no farther apart than the length.

    |r_j + A_j s_j − r_i − A_i s_i| ≤ l: it pulls where it is taut and is slack else; where it
    becomes taut in motion there is an impact with restitution 0.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two ends.
    length : float
        Positive [length].

    Examples
    --------
    >>> Rope("leash", "ground.O", "ball.C", length=2.0).rows
    'l'
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: InheritedPlace = place_field()
    j: InheritedPlace = place_field()
    length: NumberField = number_field("length", math.nan, sign="positive")

    def _check(self) -> None:
        super()._check()
        two_bodies(self)

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.body, self.j.body

    def distances(self) -> tuple[tuple[str, str], ...]:
        """None that must not vanish: a slack rope's ends may meet."""
        return ()

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """The one distance."""
        positions = [*at.arm(self, "i"), *at.arm(self, "j")]
        return [ContactCandidate.taut(self.bodies, positions, at[f"{self.name}.length"])]

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """By how much it is too short."""
        return (
            f"rope '{self.name}' is {depth:.6g} {units.length} too short at the beginning: begin "
            "with its ends nearer to each other, or give it more length"
        )


def restitutions(name: str, at: Numbers) -> list[float]:
    """The restitution of an element, of every design."""
    return [float(value) for value in np.ravel(at[f"{name}.restitution"])]


def refuse_coefficients(name: str, mu: float, static: float | None, restitution: float) -> None:
    """Refuse coefficients of friction and restitution that cannot be."""
    if static is not None:
        refuse_static(name, mu, static)
    if restitution > 1.0:
        raise ModelError(
            f"'{name}': restitution is {restitution:g}, which would gain energy: give 0 to 1", name
        )


def _named(shape: Shape) -> str:
    if isinstance(shape, CurveShape):
        return "curve"
    return "point" if isinstance(shape, Vertex) else type(shape).__name__.lower()


def _shape(contact: str, known: Mapping[str, Any], curves: Mapping[str, Any], place: str) -> Shape:
    """The shape, or the point as a shape, of that dotted name."""
    name, _, key = place.partition(".")
    body = known[name]
    if key in body.shapes:
        found: Shape = body.shapes[key]
        if isinstance(found, CurveShape):
            return replace(found, law=found.contour(curves, place))
        return found
    if key in body.points:
        return Vertex(key)
    raise ModelError(
        f"'{contact}' refers to shape {brief(key)} of '{name}', which is not there (it has the "
        f"shapes {listed(body.shapes)} and the points {listed(body.points)}): name one of these, "
        "or add it to the body",
        contact,
    )
