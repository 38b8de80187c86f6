"""Prismatic joint: a slider on a straight guide, kept from turning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.core.decorators import inline
from mbody.model.geometry import between, turned
from mbody.model.joints._base import SLIDING_PAIR, Joint
from mbody.model.primitives import ConstraintPrimitive, constraint_physics

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["Prismatic", "prismatic"]


@dataclass(frozen=True)
class Prismatic(Joint):
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
        The place that slides; its marker's x axis stays along the guide.

    Examples
    --------
    >>> Prismatic("guide", "ground", "piston").rows
    'la'
    """

    rows = "la"
    coordinates = SLIDING_PAIR
    parallel = True
    counts_turns = True
    unknowns = ("N", "T")

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One pair of rows; parameters are both arms, the normal on i, and β_j − β_i."""
        beta_i, beta_j = at.angle(self, "i"), at.angle(self, "j")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j")]
        parameters += [-np.sin(beta_i), np.cos(beta_i), beta_j - beta_i]
        return [ConstraintPrimitive("prismatic", self.i.body, self.j.body, self.rows, parameters)]


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
