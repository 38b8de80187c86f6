"""Pin in slot: a place on one body stays on a straight line of another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.model.joints._base import SLIDING_PAIR, Joint
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["PinSlot"]


@dataclass(frozen=True)
class PinSlot(Joint):
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

    Examples
    --------
    >>> PinSlot("slot", "lever", "block.pin").rows
    'l'
    """

    rows = "l"
    coordinates = SLIDING_PAIR

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; parameters are both arms and the normal on i."""
        beta = at.angle(self, "i")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), -np.sin(beta), np.cos(beta)]
        return [ConstraintPrimitive("coordinate", self.i.body, self.j.body, self.rows, parameters)]
