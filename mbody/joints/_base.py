"""The base of all joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mbody.atoms import Atom
from mbody.elements import Element, Place, place_field, two_bodies

if TYPE_CHECKING:
    from mbody.elements import Numbers

__all__ = ["Joint"]


@dataclass(frozen=True)
class Joint(Element):
    """A constraint between a place on body i and a place on body j.

    The reaction of a joint is the force on body j by body i, at the place on j.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        Places such as ``crank.at("A")`` or ``"crank.A"``.
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: Place = place_field()
    j: Place = place_field()

    def _check(self) -> None:
        super()._check()
        two_bodies(self)

    def atoms(self, at: Numbers) -> list[Atom]:
        """The joint's constraints with their numbers."""
        raise NotImplementedError
