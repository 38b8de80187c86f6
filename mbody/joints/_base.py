"""The base of all joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

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
    #: Whether other joints must hold the places `apart` from each other, as those of gears.
    held: ClassVar[bool] = False

    i: Place = place_field()
    j: Place = place_field()

    def _check(self) -> None:
        super()._check()
        two_bodies(self)

    def atoms(self, at: Numbers) -> list[Atom]:
        """The joint's constraints with their numbers."""
        raise NotImplementedError

    def told_at(self, at: Any, d: Any, angle: Any) -> tuple[Any, Any] | None:
        """Where the reaction is told, from the place on j: None for that place itself.

        Parameters
        ----------
        at : mapping
            Numbers by dotted name.
        d : pair of arrays (instants,)
            From the place on i to the place on j, world axes [length].
        angle : array (instants,)
            Direction of the marker on i from the world's x axis [rad].

        Returns
        -------
        pair of arrays (instants,), or None
            World axes [length]: a point of contact.
        """
        return None

    def pressing(self, at: Any, d: Any, angle: Any, force: tuple[Any, Any]) -> Any | None:
        """How hard a contact presses on the body of j: None for a joint that holds both ways.

        Parameters
        ----------
        at, d, angle
            As of `told_at`.
        force : pair of arrays (instants,)
            The reaction on the body of j, world axes [force].

        Returns
        -------
        array (instants,), or None
            [force]; negative where it would have to pull, which a contact cannot.
        """
        return None

    def apart(self, at: Any) -> Any:
        """How far apart the two places are where the joint lets them be [length]: a rough start."""
        return 0.0
