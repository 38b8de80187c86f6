"""Revolute joint: a pin that keeps two places together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.core.decorators import inline
from mbody.model.geometry import between
from mbody.model.joints._base import TURNING_PAIR, Joint
from mbody.model.primitives import ConstraintPrimitive, constraint_physics

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["Revolute", "revolute"]


@dataclass(frozen=True)
class Revolute(Joint):
    """Pin joint, hinge, turning pair: the place on i and the place on j coincide.

    Φ = r_i + A_i s_i − r_j − A_j s_j = 0 (Haug 1989, section 3.3), two rows.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two places that coincide.

    Examples
    --------
    >>> Revolute("A", "crank.A", "coupler.A").rows
    'll'
    """

    rows = "ll"
    coincident = True
    coordinates = TURNING_PAIR
    unknowns = ("x", "y")

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One pair of rows; parameters are both arms in link axes."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j")]
        return [ConstraintPrimitive("revolute", self.i.body, self.j.body, self.rows, parameters)]


@constraint_physics()
@inline
def revolute(i, j, p, f):
    """Φ = (r_i + p_i) − (r_j + p_j);  Φ_q = [1, k×p_i | −1, −k×p_j];  γ = ω_i² p_i − ω_j² p_j."""
    (pix, piy, pjx, pjy), (dx, dy), _, (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    blocks = (1.0, 0.0, -piy, 0.0, 1.0, pix, -1.0, 0.0, pjy, 0.0, -1.0, -pjx)
    return (-dx, -dy), blocks, (0.0, 0.0), (dax, day)
