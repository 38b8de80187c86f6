"""Freewheels: clutches that hold one way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.errors import ModelError
from mbody.model.contact_spots import Spot
from mbody.model.element import InheritedPlace, place_field, two_bodies
from mbody.model.one_sided_constraint import OneSided
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem

__all__ = ["Freewheel"]


@dataclass(frozen=True)
class Freewheel(OneSided):
    """Freewheel, one-way clutch, ratchet, backstop: body j may turn ahead of body i, not fall
    behind it.

    ω_j − ω_i ≥ 0 and the torque T ≥ 0 of i on j with T (ω_j − ω_i) = 0: it holds without play at
    whatever angle it is, and separates as soon as it would have to hold back. Pins keep the bodies
    in place. Where it is turned the wrong way by an impact it holds without rebound.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        Places on the two bodies, such as ``"ground.O"`` and ``"wheel.O"``; i drives j.
    clockwise : bool
        Whether ahead is clockwise.

    Notes
    -----
    It acts in `simulate`, where ``run.contact(name)`` is the torque and ``run.mode(name)`` "open"
    or "stick"; all other analyses leave it out, with a note.

    Examples
    --------
    >>> Freewheel("hub", "sprocket.O", "wheel.O").bodies
    ('sprocket', 'wheel')
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: InheritedPlace = place_field()
    j: InheritedPlace = place_field()
    clockwise: bool = False

    def _check(self) -> None:
        super()._check()
        two_bodies(self)
        if not isinstance(self.clockwise, bool):
            raise ModelError(
                f"'{self.name}': clockwise must be True or False, not {self.clockwise!r}", self.name
            )

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.body, self.j.body

    def quantities(self) -> dict[str, str]:
        """As of a contact; it presses with a torque."""
        return super().quantities() | {"contact": "torque"}

    def every_spot(self, at: Numbers) -> list[Spot]:
        """The angle between the bodies, from where it holds."""
        row = ConstraintPrimitive("angle", *self.bodies, "a", [0.0], switched=True)
        return [Spot.one_way(row, -1.0 if self.clockwise else 1.0)]

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """Nowhere: any angle will do."""
        raise AssertionError(f"'{self.name}' has no angle that it must not have")
