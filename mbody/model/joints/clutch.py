"""Friction clutch or brake: two bodies that turn together or slip with a torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import LawLike, NumberField, OptionalNumberField, law_field, number_field
from mbody.model.joints._base import TURNING_PAIR, Joint
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["Clutch"]


@dataclass(frozen=True)
class Clutch(Joint):
    """Friction clutch, or brake where one of the bodies is the ground: while the bodies turn
    against each other it slips, with the torque of its law against the relative rate; where they do
    not it sticks as long as no more torque than that is needed, and they turn together.

    It has no rows, a pin keeps the bodies in place. The torque of a clutch of n surfaces between
    the radii a and b, pressed by F, is n μ F (a + b)/2 as it wears evenly, and
    n μ F ⅔ (b³ − a³)/(b² − a²) when it is new (Shigley, *Mechanical Engineering Design*, 16-5).

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
    static: NumberField = number_field("number", 1.0, sign="positive")
    stribeck: OptionalNumberField = number_field("angular velocity", None, sign="positive")
    rows = ""
    follows_formulas = True
    coordinates = TURNING_PAIR
    unknowns = ("T",)

    def _check(self) -> None:
        super()._check()
        self._refuse_static(float(self.static))
        if self.stribeck is not None and self.static == 1.0:
            raise ModelError(
                f"'{self.name}': a stribeck rate is how fast the torque falls from what sticks to "
                "what slips: give static too, above 1, or leave it out",
                self.name,
            )

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse that it holds less than it slips with, in any design."""
        super().refuse(at, unit)
        for static in np.ravel(at[f"{self.name}.static"]):
            self._refuse_static(float(static))

    def _refuse_static(self, static: float) -> None:
        if static < 1.0:
            raise ModelError(
                f"'{self.name}': static is {static:g}: a clutch that sticks holds at least as much "
                "as it slips with; give 1 or more",
                self.name,
            )

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """None: it takes no freedom of its own."""
        return []

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The torque between both bodies."""
        name = self.name
        stribeck: Any = 0.0 if self.stribeck is None else at[f"{name}.stribeck"]
        turning = ConstraintPrimitive("angle", *self.bodies, "a", [0.0], switched=True)
        numbers = [1.0, at[f"{name}.static"], stribeck, 0.0, 0.0, 0.0]
        return [FrictionPrimitive("given", turning, 0, numbers, at.law(self, "torque"))]
