"""Pin in slot: a place on one body stays on a straight line of another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.model.element import OptionalNumberField, number_field
from mbody.model.joints._base import SLIDING_PAIR
from mbody.model.joints._friction import RubbingJoint
from mbody.model.joints.coordinate import along_axis
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["PinSlot"]


@dataclass(frozen=True, kw_only=True)
class PinSlot(RubbingJoint):
    """Pin in slot, half joint, point on line: the place on j stays on the x axis of the marker on i
    and may turn there.

    Φ = n_i · (r_j + A_j s_j − r_i − A_i s_i) = 0, n_i normal to the slot: one row, the coordinate
    of the pin across the slot. The reaction is the force of the slot on the pin, normal to it.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        A place in the slot; the marker's `angle` is the slot's direction.
    j : Marker or str
        The pin.
    friction, static, stribeck : float, optional
        Coefficients of the slot on the pin, or on a block that the pin turns in; see
        `RubbingJoint`. The friction is μ |N| at the place on j along the slot.
    viscous : float, optional
        Force by the speed along the slot [force·time/length].

    Examples
    --------
    >>> PinSlot("slot", "lever", "block.pin").rows
    'l'
    """

    viscous: OptionalNumberField = number_field("damping", None, sign="not negative")
    rows = "l"
    coordinates = SLIDING_PAIR

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; parameters are both arms and the normal on i."""
        beta = at.angle(self, "i")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), -np.sin(beta), np.cos(beta)]
        return [ConstraintPrimitive("coordinate", self.i.body, self.j.body, self.rows, parameters)]

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The pin along its slot."""
        if not self.rubs:
            return []
        parameters = [*self.coefficients(at), 0.0, 0.0]
        return [FrictionPrimitive("pressed", along_axis(self, at), 0, parameters)]
