"""Shapes of contacts as numbers for other engines, from the description read independently."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from mbody.engines.independent_reading import Reading
from mbody.engines.opinion import Inexpressible
from mbody.model.closed_mechanism import contacts_of
from mbody.model.contact import Contact, Rope
from mbody.model.mechanism import Mechanism
from mbody.model.touching_shapes import Disc, Line, Polygon, Ring, Segment, points_of


@dataclass(frozen=True)
class Outline:
    """A shape on a body.

    Attributes
    ----------
    body : str
    kind : str
        "line", "segment", "polygon", "disc" or "ring"; points are discs without radius.
    points : tuple of pairs
        From the mass centre, link axes [length].
    radius : float
        Of discs and rings [length].
    direction : float
        Of a line, link axes [rad].
    """

    body: str
    kind: str
    points: tuple[tuple[float, float], ...]
    radius: float = 0.0
    direction: float = 0.0

    @property
    def convex(self) -> bool:
        """Whether a polygon has no corner that points inwards."""
        corners = (*self.points, *self.points[:2])
        sides = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(corners)]
        turns = [a[0] * b[1] - a[1] * b[0] for a, b in pairwise(sides)]
        return all(one >= 0.0 for one in turns) or all(one <= 0.0 for one in turns)


def outlines(at: Reading, contact: Contact) -> tuple[Outline, Outline]:
    """The two shapes of a contact."""
    i, j = (
        _outline(at, body, place, shape)
        for body, place, shape in zip(
            contact.bodies, (contact.i, contact.j), contact.shapes, strict=True
        )
    )
    return i, j


def _outline(at: Reading, body: str, place: str, shape: Any) -> Outline:
    cx, cy = (0.0, 0.0) if body == "ground" else at.point(f"{body}.cg")
    places = (at.point(f"{body}.{name}") for name in points_of(shape))
    points = tuple((x - cx, y - cy) for x, y in places)
    kind = {Line: "line", Segment: "segment", Polygon: "polygon", Ring: "ring"}.get(
        type(shape), "disc"
    )
    radius = float(at[f"{place}.radius"]) if isinstance(shape, Disc | Ring) else 0.0
    direction = float(at[f"{place}.angle"]) if isinstance(shape, Line) else 0.0
    return Outline(body, kind, points, radius, direction)


def not_as_rigid_contacts(machine: Mechanism, engine: str) -> Iterator[Inexpressible]:
    """Contacts of a mechanism that engines of rigid bodies with shapes have not."""
    for joint in machine.joints:
        if contacts_of(joint):
            why = "it has limits or separates: no shapes of two bodies that touch"
            yield Inexpressible(joint.name, f"{engine}: {why}")
    for one in machine.contacts:
        if isinstance(one, Rope):
            continue
        if not isinstance(one, Contact):
            why = f"{engine} has no stop along a formula of positions, only shapes that touch"
            yield Inexpressible(one.name, why)
            continue
        if any(isinstance(shape, Ring) for shape in one.shapes):
            yield Inexpressible(one.name, f"{engine} has no hollow circle")
