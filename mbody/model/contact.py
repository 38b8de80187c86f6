"""Contacts between shapes of bodies, and ropes: what holds in one sense only, and may separate."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.contact_spots import Spot, contact_spots
from mbody.model.element import (
    InheritedPlace,
    NumberField,
    OptionalNumberField,
    listed,
    number_field,
    place_field,
    two_bodies,
)
from mbody.model.one_sided_constraint import OneSided
from mbody.model.primitives import ConstraintPrimitive
from mbody.model.static_friction import refuse_static
from mbody.model.touching_shapes import Shape, Vertex, points_of, refuse_shapes

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem

__all__ = [
    "IMPACT_LAWS",
    "Between",
    "Contact",
    "Rope",
    "refuse_coefficients",
    "restitutions",
    "shape_names",
]

#: Contacts of one group, at most: each is watched by itself.
MOST_CONTACTS = 2000
#: Laws of impacts.
IMPACT_LAWS = ("poisson", "newton")


@dataclass(frozen=True)
class Contact(OneSided):
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

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: str = ""
    j: str = ""
    friction: NumberField = number_field("number", 0.0, sign="not negative")
    static: OptionalNumberField = number_field("number", None, sign="not negative")
    restitution: NumberField = number_field("number", 0.0, sign="not negative")
    law: str = "poisson"
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

    def _check(self) -> None:
        super()._check()
        refuse_coefficients(self.name, self.friction, self.static, self.restitution)

    def refuse(self, at: Numbers, unit: str) -> None:
        """As of one contact, of every design; arcs without length, and discs that fill a ring."""
        refuse_of_designs(self, at)
        refuse_shapes(self.name, (self.i, self.j), self.shapes, at, unit)

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.partition(".")[0], self.j.partition(".")[0]

    def with_shapes(self, known: Mapping[str, Any]) -> Contact:
        """The contact with the shapes that it is between; `known` are the bodies by name.

        Raises
        ------
        ModelError
            For a shape that is not there, and shapes that cannot touch.
        """
        made = replace(
            self, shapes=tuple(_shape(self.name, known, one) for one in (self.i, self.j))
        )
        i, j = made.shapes
        if not contact_spots((made.i, i), (made.j, j)):
            raise ModelError(
                f"'{self.name}': a {_named(i)} and a {_named(j)} do not touch: points and discs "
                "touch lines, segments, polygons and discs, and rings from within; of segments and "
                "polygons the corners do",
                self.name,
            )
        return made

    def points(self) -> set[str]:
        """Those of its shapes."""
        pairs = zip(self.bodies, self.shapes, strict=True)
        return {f"{body}.{point}" for body, shape in pairs for point in points_of(shape)}

    def every_spot(self, at: Numbers) -> list[Spot]:
        """Each point with each line, and each two circles."""
        sides = zip((self.i, self.j), self.shapes, strict=True)
        return [make(at) for make in contact_spots(*sides)]

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

    def coefficients(self, at: Numbers) -> tuple[float, float]:
        """Kinetic and static friction."""
        mu = at[f"{self.name}.friction"]
        return mu, mu if self.static is None else at[f"{self.name}.static"]  # type: ignore[return-value]  # one design

    def restitution_of(self, at: Numbers) -> float:
        """Restitution, from 0 to 1."""
        return at[f"{self.name}.restitution"]  # type: ignore[return-value]  # one design


@dataclass(frozen=True)
class Between(OneSided):
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

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: str = ""
    j: str = ""
    friction: NumberField = number_field("number", 0.0, sign="not negative")
    static: OptionalNumberField = number_field("number", None, sign="not negative")
    restitution: NumberField = number_field("number", 0.0, sign="not negative")
    law: str = "poisson"

    @property
    def bodies(self) -> tuple[str, ...]:
        """None by name."""
        return ()

    def _check(self) -> None:
        super()._check()
        refuse_coefficients(self.name, self.friction, self.static, self.restitution)

    def refuse(self, at: Numbers, unit: str) -> None:
        """As of one contact, of every design."""
        refuse_of_designs(self, at)

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

    def every_spot(self, at: Numbers) -> list[Spot]:
        """The one distance."""
        arms = [*at.arm(self, "i"), *at.arm(self, "j")]
        return [Spot.taut(self.bodies, arms, at[f"{self.name}.length"])]

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
    """Refuse coefficients of friction and restitution that cannot be.

    Raises
    ------
    ModelError
    """
    if static is not None:
        refuse_static(name, mu, static)
    if restitution > 1.0:
        raise ModelError(
            f"'{name}': restitution is {restitution:g}, which would gain energy: give 0 to 1",
            name,
        )


def refuse_of_designs(one: Contact | Between, at: Numbers) -> None:
    """The same of every design."""
    static = None if one.static is None else at[f"{one.name}.static"]
    numbers = (at[f"{one.name}.friction"], static, at[f"{one.name}.restitution"])
    rows = np.broadcast_arrays(*(np.nan if part is None else part for part in numbers))
    for mu, most, e in zip(*map(np.ravel, rows), strict=True):
        refuse_coefficients(one.name, float(mu), None if np.isnan(most) else float(most), float(e))


def _named(shape: Shape) -> str:
    return "point" if isinstance(shape, Vertex) else type(shape).__name__.lower()


def _shape(contact: str, known: Mapping[str, Any], place: str) -> Shape:
    """The shape, or the point as a shape, of that dotted name."""
    name, _, key = place.partition(".")
    body = known[name]
    if key in body.shapes:
        found: Shape = body.shapes[key]
        return found
    if key in body.points:
        return Vertex(key)
    raise ModelError(
        f"'{contact}' refers to shape {brief(key)} of '{name}', which is not there (it has the "
        f"shapes {listed(body.shapes)} and the points {listed(body.points)}): name one of these, "
        "or add it to the body",
        contact,
    )
