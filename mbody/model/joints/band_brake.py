"""Band brake: a band around a drum, pulled tight by a lever, whose torque has two sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import LawLike, law_field, number_field
from mbody.model.joints._base import TURNING_PAIR, GivenFriction
from mbody.model.primitives import ConstraintPrimitive
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class BandBrake(GivenFriction):
    """Band brake: where the drum turns against the body that carries the lever, its band slips with
    the ratio of tensions e^(μβ) of Euler and Eytelwein; where it does not it sticks.

    The lever is in balance, F ℓ + T₁ b₁ = T₂ b₂: the first end of the band, which is tight while
    the drum turns counterclockwise, helps to pull the lever where b₁ > 0, the second one resists.
    With E = e^(μβ) the torque that slips is

        F ℓ r (E − 1)/(b₂ − b₁ E) against counterclockwise, F ℓ r (E − 1)/(b₂ E − b₁) else.

    Where b₁ E ≥ b₂ it would lock itself: the drum could not turn counterclockwise, whatever F is.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        Places on the body that carries the lever and on the drum, such as ``"ground.O"`` and
        ``"drum.O"``; the reaction, a torque, acts on the drum. A pin keeps it in place.
    force : Law, float, str or callable
        F on the lever [force]: a number, a law of time, or a formula of measured quantities and
        inputs. Where it is negative there is no torque.
    radius : float
        Of the drum [length].
    wrap : float
        β, by which the band is wrapped around the drum [rad].
    friction : float
        μ between them.
    lever : float
        ℓ, arm of F about the pivot of the lever [length].
    arm : float
        b₂, arm of the second end of the band [length].
    helping_arm : float
        b₁, arm of the first end [length]; 0 of a simple brake, whose first end is at the pivot.
    static, stribeck
        As of a `Clutch`.

    Notes
    -----
    Shigley, *Mechanical Engineering Design*, 16-4.

    Examples
    --------
    >>> numbers = {"radius": 0.15, "wrap": "240 deg", "friction": 0.3, "lever": 0.5, "arm": 0.1}
    >>> BandBrake("brake", "ground.O", "drum.O", force=200.0, **numbers).helping_arm
    0.0
    """

    force: LawLike = law_field("force", 0.0)
    radius: NumberField = number_field("length", 0.0, sign="positive")
    wrap: NumberField = number_field("angle", 0.0, sign="positive")
    friction: NumberField = number_field("number", 0.0, sign="not negative")
    lever: NumberField = number_field("length", 0.0, sign="positive")
    arm: NumberField = number_field("length", 0.0, sign="positive")
    helping_arm: NumberField = number_field("length", 0.0, sign="not negative")
    stribeck: OptionalNumberField = number_field("angular velocity", None, sign="positive")
    coordinates = TURNING_PAIR
    unknowns = ("T",)
    size, law = "torque", "force"

    def _check(self) -> None:
        super()._check()
        own = (self.friction, self.wrap, self.arm, self.helping_arm)
        self._refuse_locking(*(float(number) for number in own))

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse a brake that locks itself, of any design."""
        super().refuse(at, unit)
        fields = ("friction", "wrap", "arm", "helping_arm")
        numbers = np.broadcast_arrays(*(at[f"{self.name}.{field}"] for field in fields))
        for own in zip(*(np.ravel(part) for part in numbers), strict=True):
            self._refuse_locking(*(float(number) for number in own))

    def _refuse_locking(self, friction: float, wrap: float, arm: float, helping: float) -> None:
        ratio = math.exp(friction * wrap)
        if helping * ratio >= arm:
            raise ModelError(
                f"'{self.name}': self-locking: helping_arm = {helping:g} times the ratio of "
                f"tensions {ratio:.4g} is not less than arm = {arm:g}, so that the drum does not "
                f"turn counterclockwise, whatever the force; give less than {arm / ratio:.4g}",
                self.name,
            )

    def tangent(self, at: Numbers) -> ConstraintPrimitive:
        """The angle of the drum from the body that carries the lever."""
        return ConstraintPrimitive("angle", *self.bodies, "a", [0.0], active_set=True)

    def per_value(self, at: Numbers) -> tuple[Any, Any]:
        """Torque for a force of 1 on the lever, from the balance of the lever."""
        name = self.name
        ratio = np.exp(at[f"{name}.friction"] * at[f"{name}.wrap"])
        arm, helping = at[f"{name}.arm"], at[f"{name}.helping_arm"]
        pull = at[f"{name}.lever"] * at[f"{name}.radius"] * (ratio - 1.0)
        one, other = pull / (arm - helping * ratio), pull / (arm * ratio - helping)
        # in the direction of rotation that helps, and in the other
        return 0.5 * (one + other), (arm + helping) / (arm - helping) * (ratio - 1.0) / (
            ratio + 1.0
        )
