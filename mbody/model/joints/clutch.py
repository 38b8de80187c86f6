"""Friction clutch or brake: two bodies that turn together or slip with a torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.model.element import LawLike, law_field, number_field
from mbody.model.joints._base import TURNING_PAIR, GivenFriction
from mbody.model.primitives import ConstraintPrimitive
from mbody.quantities.formula import OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class Clutch(GivenFriction):
    """Friction clutch, or brake where one of the bodies is the ground: while the bodies turn
    against each other it slips, with the torque of its law against the relative rate; where they do
    not it sticks as long as no more torque than that is needed, and they turn together.

    It has no rows; a pin keeps the bodies in place. The torque of n surfaces between the radii a
    and b, pressed by F, is n μ F (a + b)/2 as they wear evenly, n μ F ⅔ (b³ − a³)/(b² − a²) when
    they are new (Shigley, *Mechanical Engineering Design*, 16-5).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        Places on the two bodies, such as ``"ground.O"`` and ``"wheel.O"``; the reaction, a torque,
        acts on the body of j.
    torque : Law, float, str or callable
        Torque while it slips [force·length]: a number, a law of time, or a formula of measured
        quantities and inputs, such as ``"0.35*40 mm*press"``. Where it is negative there is none.
    static : float
        How many times as much it holds while it sticks, at least 1.
    stribeck : float, optional
        Relative rate over which the torque falls from what sticks to what slips [angular velocity].

    Examples
    --------
    >>> Clutch("brake", "ground.O", "wheel.O", torque=120.0).bodies
    ('ground', 'wheel')
    """

    torque: LawLike = law_field("torque", 0.0)
    stribeck: OptionalNumberField = number_field("angular velocity", None, sign="positive")
    coordinates = TURNING_PAIR
    unknowns = ("T",)
    size = "torque"

    def tangent(self, at: Numbers) -> ConstraintPrimitive:
        """The angle between the bodies."""
        return ConstraintPrimitive("angle", *self.bodies, "a", [0.0], active_set=True)
