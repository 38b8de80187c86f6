"""Revolute joint: a pin that keeps two places together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.core.decorators import inline
from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.element import LimitsField, limits_field, number_field
from mbody.model.joints._base import TURNING_PAIR, Flank, LimitedJoint
from mbody.model.primitives import (
    ConstraintPrimitive,
    FrictionPrimitive,
    Signal,
    between,
    constraint_physics,
)
from mbody.quantities.formula import OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True, kw_only=True)
class Revolute(LimitedJoint):
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
    clearance : float, optional
        By how much the radius of the hole is greater than that of the pin [length]: in `simulate`
        the pin moves in its hole, a disc in a ring, with impacts and, where there is friction, with
        that at `pin_radius`. All other analyses keep it in the middle.
    limits : pair of float, optional
        The least and the greatest angle of the marker on j from that on i [rad], whole turns
        counted; see `LimitedJoint`.
    restitution : float, optional
        e of impacts at the limits, and of the pin in its hole.

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
    clearance: OptionalNumberField = number_field("length", None, sign="positive")
    limits: LimitsField = limits_field("angle")

    rows = "ll"
    coincident = True
    coordinates = TURNING_PAIR
    unknowns = ("x", "y")

    strikes_by = "limits or clearance"

    @property
    def can_separate(self) -> bool:
        """Whether the pin has play."""
        return self.clearance is not None

    def lets_turn(self, body: str) -> bool:
        """Either body."""
        return True

    def _check(self) -> None:
        super()._check()
        if self.can_separate:
            self._refuse_beside("clearance", "viscous", "stribeck")
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
        if not self.has_friction:
            return []
        radius = 0.0 if self.friction is None else at[f"{self.name}.pin_radius"]
        slowest = 1.0 if self.stribeck is None else radius
        numbers = [*self.coefficients(at, slowest), radius, 0.0]
        return [FrictionPrimitive("pin", self.free_row(at), 0, numbers)]

    def flanks(self, at: Numbers) -> list[Flank]:
        """The pin, a disc on j, in the hole, a ring on i."""
        gap = at[f"{self.name}.clearance"]
        radius = 0.0 if self.pin_radius is None else at[f"{self.name}.pin_radius"]
        arms = [*at.arm(self, "i"), *at.arm(self, "j")]
        law = Signal(Constant(0.0), [gap])
        normal = ConstraintPrimitive("clearance", *self.bodies, "l", arms, law, active_set=True)
        if self.friction is None:
            return [Flank(normal, -1.0)]
        # radii of a ring and a disc in it, as parts of their difference
        numbers = [*arms, (radius + gap) / gap, -radius / gap, 0.0]
        tangent = ConstraintPrimitive("slipping", *self.bodies, "l", numbers, active_set=True)
        return [Flank(normal, -1.0, tangent)]

    def free_row(self, at: Numbers) -> ConstraintPrimitive:
        """The angle."""
        beta = at.angle(self, "j") - at.angle(self, "i")
        return ConstraintPrimitive("angle", self.i.body, self.j.body, "a", [beta], active_set=True)


@constraint_physics()
@inline
def revolute(i, j, p, f):
    """Φ = (r_i + p_i) − (r_j + p_j);  Φ_q = [1, k×p_i | −1, −k×p_j];  γ = ω_i² p_i − ω_j² p_j."""
    (pix, piy, pjx, pjy), (dx, dy), _, (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    blocks = (1.0, 0.0, -piy, 0.0, 1.0, pix, -1.0, 0.0, pjy, 0.0, -1.0, -pjx)
    return (-dx, -dy), blocks, (0.0, 0.0), (dax, day)
