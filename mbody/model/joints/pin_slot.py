"""Pin in slot: a place on one body stays on a straight line of another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mbody.laws import Constant
from mbody.model.element import LimitsField, limits_field, number_field
from mbody.model.joints._base import SLIDING_PAIR, Flank, LimitedJoint
from mbody.model.joints.coordinate import along_axis
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive, Signal
from mbody.quantities.formula import OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True, kw_only=True)
class PinSlot(LimitedJoint):
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
    one_sided : bool
        Whether the slot has one flank only, on which the pin rests: its x axis, from the side of
        its y axis. In `simulate` the pin may leave it.
    clearance : float, optional
        By how much the slot is wider than the pin [length]: in `simulate` the pin moves between two
        flanks. All other analyses keep it in the middle.
    limits : pair of float, optional
        The least and the greatest travel of the pin along the slot [length]: its ends; see
        `LimitedJoint`.
    restitution : float, optional
        e of impacts at the limits and on the flanks.

    Examples
    --------
    >>> PinSlot("slot", "lever", "block.pin").rows
    'l'
    """

    viscous: OptionalNumberField = number_field("damping", None, sign="not negative")
    one_sided: bool = False
    clearance: OptionalNumberField = number_field("length", None, sign="positive")
    limits: LimitsField = limits_field("length")
    rows = "l"
    coordinates = SLIDING_PAIR
    strikes_by = "limits, clearance or one_sided"

    def _check(self) -> None:
        super()._check()
        self._check_switches("one_sided")
        if self.one_sided:
            self._refuse_beside("one_sided", "clearance")
        if self.can_separate:
            self._refuse_beside("clearance or one_sided", "viscous", "stribeck")

    @property
    def can_separate(self) -> bool:
        """Whether the pin may leave its flank, or has play."""
        return self.one_sided or self.clearance is not None

    def flanks(self, at: Numbers) -> list[Flank]:
        """One flank, or two by half the clearance to both sides."""
        (row,) = self.primitives(at)
        tangent = along_axis(self, at) if self.friction is not None else None
        if self.one_sided:
            return [Flank(replace(row, active_set=True), 1.0, tangent)]
        half = 0.5 * at[f"{self.name}.clearance"]
        return [
            Flank(
                replace(row, active_set=True, signal=Signal(Constant(0.0), [-sign * half])),
                sign,
                tangent,
            )
            for sign in (1.0, -1.0)
        ]

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; parameters are both arms and the normal on i."""
        beta = at.angle(self, "i")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), -np.sin(beta), np.cos(beta)]
        return [ConstraintPrimitive("coordinate", self.i.body, self.j.body, self.rows, parameters)]

    def free_row(self, at: Numbers) -> ConstraintPrimitive:
        """The travel."""
        return along_axis(self, at)

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The pin along its slot."""
        if not self.has_friction:
            return []
        parameters = [*self.coefficients(at), 0.0, 0.0]
        return [FrictionPrimitive("pressed", along_axis(self, at), 0, parameters)]
