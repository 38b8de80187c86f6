"""Revolute joint: a pin that keeps two places together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.core.decorators import inline
from mbody.errors import ModelError
from mbody.model.element import OptionalNumberField, number_field
from mbody.model.geometry import between
from mbody.model.joints._base import TURNING_PAIR
from mbody.model.joints._friction import RubbingJoint
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive, constraint_physics

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["Revolute", "revolute"]


@dataclass(frozen=True, kw_only=True)
class Revolute(RubbingJoint):
    """Pin joint, hinge, turning pair: the place on i and the place on j coincide.

    Φ = r_i + A_i s_i − r_j − A_j s_j = 0 (Haug 1989, section 3.3), two rows.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two places that coincide.
    friction, static, stribeck : float, optional
        Coefficients of the pin in its hole; see `RubbingJoint`. Needs `pin_radius`.
    viscous : float, optional
        Torque by the rate of turning [force·length·time/rad].
    pin_radius : float, optional
        Of the pin [length].

    Notes
    -----
    The whole reaction R, which has friction in it, passes the centre of the pin at the radius of
    the friction circle, ρ = μ r/√(1 + μ²): the friction torque is ρ |R| against the rate of
    turning, and at most that while the pin rests in its hole.

    Examples
    --------
    >>> Revolute("A", "crank.A", "coupler.A").rows
    'll'
    >>> Revolute("A", "crank.A", "rod.A", friction=0.1, pin_radius=0.01).numbers()["A.friction"]
    0.1
    """

    viscous: OptionalNumberField = number_field("torsion damping", None, sign="not negative")
    pin_radius: OptionalNumberField = number_field("length", None, sign="positive")

    rows = "ll"
    coincident = True
    coordinates = TURNING_PAIR
    unknowns = ("x", "y")

    def _check(self) -> None:
        super()._check()
        if self.friction is not None and self.pin_radius is None:
            raise ModelError(
                f"'{self.name}': friction is {self.friction:g}, but the pin has no radius at which "
                'it acts: give pin_radius, as in pin_radius="10 mm"',
                self.name,
            )

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One pair of rows; parameters are both arms in link axes."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j")]
        return [ConstraintPrimitive("revolute", self.i.body, self.j.body, self.rows, parameters)]

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The pin in its hole: it turns by the angle of j from i."""
        if not self.rubs:
            return []
        radius = 0.0 if self.friction is None else at[f"{self.name}.pin_radius"]
        beta = at.angle(self, "j") - at.angle(self, "i")
        turning = ConstraintPrimitive("angle", self.i.body, self.j.body, "a", [beta], switched=True)
        slowest = 1.0 if self.stribeck is None else radius
        return [
            FrictionPrimitive("pin", turning, 0, [*self.coefficients(at, slowest), radius, 0.0])
        ]


@constraint_physics()
@inline
def revolute(i, j, p, f):
    """Φ = (r_i + p_i) − (r_j + p_j);  Φ_q = [1, k×p_i | −1, −k×p_j];  γ = ω_i² p_i − ω_j² p_j."""
    (pix, piy, pjx, pjy), (dx, dy), _, (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    blocks = (1.0, 0.0, -piy, 0.0, 1.0, pix, -1.0, 0.0, pjy, 0.0, -1.0, -pjx)
    return (-dx, -dy), blocks, (0.0, 0.0), (dax, day)
