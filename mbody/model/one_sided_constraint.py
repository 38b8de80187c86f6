"""The base of contacts, ropes, stops and freewheels: what holds in one sense only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.model.constraint import Constraint
from mbody.model.contact_spots import Spot
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive
from mbody.model.rolling_rows import rolling_from

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem

__all__ = ["OneSided", "joined"]


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

    def every_spot(self, at: Numbers) -> list[Spot]:
        """Where it may act, with the rows of each."""
        raise NotImplementedError

    def spots(self, at: Numbers) -> list[Spot]:
        """Where it may act, or does where it is closed."""
        every = self.every_spot(at)
        return [every[n] for n in self.closed] if self.closed else every

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """The normal row of every spot, off at first; of what is closed rows that are always on, of
        what rolls those along it, too.
        """
        spots = self.spots(at)
        if not self.closed:
            return [spot.normal for spot in spots]
        across = [replace(spot.normal, switched=False) for spot in spots]
        if not self.rolls:
            return across
        i, j = self.bodies
        x, y, angle, *other = self.rolls_from
        poses = {i: (x, y, angle), j: (other[0], other[1], other[2])}
        along = [rolling_from(s.tangent, at, poses) for s in spots if s.tangent is not None]
        return [*across, *along]

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The friction of every spot, by the row along it; none of what rolls."""
        if self.rolls:
            return []
        mu, static = self.coefficients(at)

        def one_way(spot: Spot) -> float:
            # where it may open, the decision sees to it that it does not pull
            return spot.sense if self.closed else 0.0

        return [
            FrictionPrimitive(
                "pressed", spot.tangent, n, [mu, static, 0.0, 0.0, one_way(spot), 0.0]
            )
            for n, spot in enumerate(self.spots(at))
            if spot.tangent is not None
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

        Raises
        ------
        ModelError
        """

    @property
    def described_as(self) -> str:
        """The element of the description that it belongs to."""
        return self.name

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """The sentence of a motion that begins beyond it.

        Parameters
        ----------
        depth : float
            By how much, in the unit of its row.
        place : pair
            Where, world axes [length].
        values : mapping
            Numbers of the system by dotted name.
        units : UnitSystem
        """
        raise NotImplementedError

    def quantities(self) -> dict[str, str]:
        """The force, its components and torque about the mass centre of j; the pressing force."""
        forces = dict.fromkeys(("fx", "fy", "force", "contact"), "force")
        return forces | {"torque": "torque"}
