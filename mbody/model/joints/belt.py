"""Flat belt between two pulleys: they turn together up to the friction of Euler and Eytelwein."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.decorators import inline
from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.element import LawLike, law_field, number_field
from mbody.model.joints._base import GivenFriction
from mbody.model.primitives import (
    ConstraintPrimitive,
    FrictionPrimitive,
    Signal,
    between,
    constraint_physics,
)
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class Belt(GivenFriction):
    """Flat belt between two pulleys, open or crossed, of a given mean tension.

    While it slips on a pulley its strands have the ratio of tensions e^(μβ) of Euler and Eytelwein,
    β being the least wrap. With T = (T₁ + T₂)/2 the force on the rim is at most

        T₁ − T₂ = 2 T tanh(μβ/2),

    where less is needed it sticks and the pulleys turn together, r_i ω_i = ± r_j ω_j. The strands
    pull the centres towards each other with 2 T cos α and across with (T₁ − T₂) sin α, α being
    their angle with the line of centres.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The centres of the pulleys. Other joints keep them in their places: the line between them
        does not turn.
    tension : Law, float, str or callable
        T, by the pretension of the belt [force]: a number, a law of time, or a formula of measured
        quantities and inputs.
    radius_i, radius_j : float
        Of the pulleys [length].
    distance : float
        Of the centres [length].
    friction : float
        μ between belt and pulleys.
    crossed : bool
        Whether the belt is crossed, so that the pulleys turn against each other.
    static : float
        How many times as much force it takes while it sticks, at least 1.
    stribeck : float, optional
        Rate of the rims against each other over which the force falls from what sticks to what
        slips [velocity].

    Notes
    -----
    The least wrap is π − 2 asin(|r_i − r_j|/distance) of an open belt, π + 2 asin((r_i +
    r_j)/distance) of a crossed one. The belt has no mass and does not stretch. Shigley, *Mechanical
    Engineering Design*, 17-2.

    Examples
    --------
    >>> sizes = {"radius_i": 0.1, "radius_j": 0.25, "distance": 0.8, "friction": 0.3}
    >>> Belt("belt", "motor.O", "fan.O", tension=400.0, **sizes).crossed
    False
    """

    tension: LawLike = law_field("force", 0.0)
    radius_i: NumberField = number_field("length", 0.0, sign="positive")
    radius_j: NumberField = number_field("length", 0.0, sign="positive")
    distance: NumberField = number_field("length", 0.0, sign="positive")
    friction: NumberField = number_field("number", 0.0, sign="not negative")
    crossed: bool = False
    unknowns = ("F",)
    size, law = "force", "tension"

    def _check(self) -> None:
        super()._check()
        self._check_switches("crossed")
        self._refuse_near(float(self.radius_i), float(self.radius_j), float(self.distance), "")

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse pulleys without room for the belt between them, of any design."""
        super().refuse(at, unit)
        fields = ("radius_i", "radius_j", "distance")
        numbers = np.broadcast_arrays(*(at[f"{self.name}.{field}"] for field in fields))
        for ri, rj, apart in zip(*(np.ravel(part) for part in numbers), strict=True):
            self._refuse_near(float(ri), float(rj), float(apart), f" {unit}")

    def _refuse_near(self, ri: float, rj: float, apart: float, unit: str) -> None:
        if apart <= ri + rj:
            raise ModelError(
                f"'{self.name}': distance is {apart:g}{unit}, but pulleys of {ri:g} and {rj:g}"
                f"{unit} touch at {ri + rj:g}{unit}: give more",
                self.name,
            )

    def apart(self, at: Any) -> Any:
        """The distance of the centres."""
        return at[f"{self.name}.distance"]

    def sine(self, at: Any) -> Any:
        """sin α of the strands and the line of centres."""
        ri, rj = (at[f"{self.name}.radius_{side}"] for side in "ij")
        difference = ri + rj if self.crossed else np.abs(ri - rj)
        return difference / at[f"{self.name}.distance"]

    def tangent(self, at: Numbers) -> ConstraintPrimitive:
        """The row whose rate is that of the rims along the belt."""
        sign = -1.0 if self.crossed else 1.0
        radii = [at[f"{self.name}.radius_i"], sign * at[f"{self.name}.radius_j"]]
        numbers = [*at.arm(self, "i"), *at.arm(self, "j"), *radii]
        return ConstraintPrimitive("belt", *self.bodies, "l", numbers, active_set=True)

    def per_value(self, at: Numbers) -> tuple[Any, Any]:
        """The force on the rim for a mean tension of 1."""
        lean = np.arcsin(self.sine(at))
        wrap = np.pi + 2.0 * (lean if self.crossed else -lean)
        return 2.0 * np.tanh(0.5 * at[f"{self.name}.friction"] * wrap), 0.0

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """Slip on the rims, and the pull between the centres."""
        arms = [*at.arm(self, "i"), *at.arm(self, "j")]
        free = Signal(Constant(0.0), [0.0])
        line = ConstraintPrimitive("clearance", *self.bodies, "l", arms, free, active_set=True)
        part = 2.0 * np.sqrt(1.0 - self.sine(at) ** 2)
        numbers = [part, part, 0.0, 0.0, 1.0, 0.0]
        pull = FrictionPrimitive("pull", line, 0, numbers, at.law(self, "tension"))
        return [*super().frictions(at), pull]


@constraint_physics()
@inline
def belt(i, j, p, f):
    """s = p₄ω_i − p₅ω_j − (p₄ − p₅) w, w = n·ḋ/|d| the rate of the line of centres;  ṡ has
    ẇ = n·d̈/|d| − 2 u·ḋ n·ḋ/|d|².  Φ = p₄θ_i − p₅θ_j, as the line of centres does not turn.
    """
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    length = np.sqrt(dx * dx + dy * dy)
    ux, uy = dx / length, dy / length
    nx, ny = -uy, ux
    c = (p[4] - p[5]) / length
    block_i = (c * nx, c * ny, p[4] + c * (ux * pix + uy * piy), 0.0, 0.0, 0.0)
    block_j = (-c * nx, -c * ny, -p[5] - c * (ux * pjx + uy * pjy), 0.0, 0.0, 0.0)
    spread = 2.0 * (ux * dvx + uy * dvy) * (nx * dvx + ny * dvy) / length
    gamma = c * (nx * dax + ny * day - spread)
    return (p[4] * i[2] - p[5] * j[2], 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)
