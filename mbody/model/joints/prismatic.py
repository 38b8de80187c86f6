"""Prismatic joint: a slider on a straight guide, kept from turning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.core.decorators import inline
from mbody.errors import ModelError
from mbody.model.element import LimitsField, limits_field, number_field
from mbody.model.joints._base import SLIDING_PAIR, LimitedJoint
from mbody.model.joints.coordinate import along_axis
from mbody.model.primitives import (
    ConstraintPrimitive,
    FrictionPrimitive,
    between,
    constraint_physics,
    turned,
)
from mbody.quantities.formula import OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True, kw_only=True)
class Prismatic(LimitedJoint):
    """Sliding pair, slider, guide: the place on j stays on the x axis of the marker on i, and the
    two markers keep one direction.

    Φ = [n_i · (r_j + A_j s_j − r_i − A_i s_i),  θ_j + β_j − θ_i − β_i] = 0, n_i normal to the guide
    (Haug 1989, section 3.3).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        A place on the guide; the marker's `angle` is the guide's direction.
    j : Marker or str
        The place that slides; its marker's x axis stays along the guide. The middle of a slider
        that has a length.
    friction, static, stribeck : float, optional
        Coefficients of the slider on its guide; see `RubbingJoint`.
    viscous : float, optional
        Force by the speed [force·time/length].
    length : float, optional
        Between the two places, half of it before and half behind the place on j, at which the
        slider touches its guide [length]. Without it the slider presses with the force across the
        guide alone, whatever its torque.
    height : float, optional
        Between the two rails that guide it from both sides [length], by default 0.
    limits : pair of float, optional
        The least and the greatest travel of the place on j [length]; see `LimitedJoint`.
    restitution : float, optional
        e of impacts at the limits.

    Notes
    -----
    With N the force across the guide and T the torque about the place on j, the places at both ends
    press with N/2 ± (T − μ h N/2)/ℓ, where the friction of both rails is counted to T, so that the
    friction is μ max(|N|, 2 |T + μ s h N/2|/ℓ) with s the sign of the sliding speed.

    Examples
    --------
    >>> Prismatic("guide", "ground", "piston").rows
    'la'
    >>> Prismatic("guide", "ground", "piston", friction=0.1, length=0.06).length
    0.06
    """

    viscous: OptionalNumberField = number_field("damping", None, sign="not negative")
    length: OptionalNumberField = number_field("length", None, sign="positive")
    height: OptionalNumberField = number_field("length", None, sign="not negative")
    limits: LimitsField = limits_field("length")

    rows = "la"
    coordinates = SLIDING_PAIR
    parallel = True
    counts_turns = True
    unknowns = ("N", "T")

    def _check(self) -> None:
        super()._check()
        if self.height is not None and self.length is None:
            raise ModelError(
                f"'{self.name}': height is {self.height:g}, but a slider without a length touches "
                "one rail at one place: give length too, or leave out height",
                self.name,
            )

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One pair of rows; parameters are both arms, the normal on i, and β_j − β_i."""
        beta_i, beta_j = at.angle(self, "i"), at.angle(self, "j")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j")]
        parameters += [-np.sin(beta_i), np.cos(beta_i), beta_j - beta_i]
        return [ConstraintPrimitive("prismatic", self.i.body, self.j.body, self.rows, parameters)]

    def free_row(self, at: Numbers) -> ConstraintPrimitive:
        """The travel."""
        return along_axis(self, at)

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The slider on its guide."""
        if not self.has_friction:
            return []
        own = [
            0.0 if getattr(self, field) is None else at[f"{self.name}.{field}"]
            for field in ("length", "height")
        ]
        return [FrictionPrimitive("guide", along_axis(self, at), 0, [*self.coefficients(at), *own])]


@constraint_physics()
@inline
def prismatic(i, j, p, f):
    """Φ₀ = n·d, Φ₁ = θ_j − θ_i + β;  with n turning at ω_i: n̈·d and ṅ·ḋ make γ₀."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    nx, ny = turned(i[3], i[4], p[4], p[5])
    w = i[7]
    # ∂Φ₀/∂θ_i = (k×n)·d − n·(k×p_i), ∂Φ₀/∂θ_j = n·(k×p_j)
    bi = nx * dy - ny * dx + nx * piy - ny * pix
    bj = ny * pjx - nx * pjy
    blocks = (-nx, -ny, bi, 0.0, 0.0, -1.0, nx, ny, bj, 0.0, 0.0, 1.0)
    # Φ̈₀ = n·d̈ + 2 ω k×n·ḋ + (α k×n − ω² n)·d
    gamma = w * w * (nx * dx + ny * dy) - 2.0 * w * (nx * dvy - ny * dvx) - (nx * dax + ny * day)
    return (nx * dx + ny * dy, j[2] - i[2] + p[6]), blocks, (0.0, 0.0), (gamma, 0.0)
