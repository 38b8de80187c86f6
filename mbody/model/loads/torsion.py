"""Springs and dampers between the angles of two bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.core.decorators import inline
from mbody.model.element import OptionalLaw, law_field, number_field
from mbody.model.loads._base import LINE, Turning, one_of
from mbody.model.primitives import ForcePrimitive, Signal, load_physics
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class TorsionSpring(Turning):
    """Rotational spring (half of an RSDA): turns a body back with T(θ − θ₀).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body : str
        Name of the body that it acts on.
    by : str
        The body that carries the opposite torque; θ is measured from it.
    stiffness : float, optional
        T = preload + stiffness · (θ − θ₀) [force·length/rad].
    free_angle : float
        θ₀ [rad].
    preload : float
        Torque at the free angle [force·length].
    law : Law or callable, optional
        Instead of the stiffness: restoring torque as a function of θ − θ₀.

    Examples
    --------
    >>> TorsionSpring("spring", "arm", stiffness=3.0).bodies
    ('ground', 'arm')
    """

    stiffness: OptionalNumberField = number_field("torsion stiffness", None)
    free_angle: NumberField = number_field("angle", 0.0)
    preload: NumberField = number_field("torque", 0.0)
    law: OptionalLaw = law_field("torque", None, of="angle")
    conservative = True
    by_angle = True
    free = "free_angle"

    def _check(self) -> None:
        super()._check()
        one_of(self, "stiffness")

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; the parameter is the free angle."""
        name = self.name
        if self.law is None:
            torque = Signal(LINE, [at[f"{name}.preload"], at[f"{name}.stiffness"]])
        else:
            torque = at.law(self, "law")
        parameters = [at[f"{name}.free_angle"], 0.0]
        return [ForcePrimitive("twist", self.by, self.body, parameters, law=torque)]


@dataclass(frozen=True)
class TorsionDamper(Turning):
    """Rotational damper: resists the rate of an angle with T(θ̇).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body, by : str
        The body that it acts on, and the one that carries the opposite torque.
    coefficient : float, optional
        T = coefficient · θ̇ [force·length·time/rad].
    law : Law or callable, optional
        Instead: resisting torque as a function of the rate [rad/time].

    Examples
    --------
    >>> import mbody
    >>> fan = mbody.Mechanism("fan")
    >>> fan.add(mbody.Body("fan", mass=1.0, inertia=0.1), mbody.Revolute("O", "ground", "fan"))
    >>> fan.add(mbody.AngleDriver("motor", "fan", "10 rad/s*t"))
    >>> fan.add(TorsionDamper("air", "ground", "fan", coefficient=0.3))
    >>> round(float(mbody.kinetostatics(fan).effort("motor")[0]), 9)
    3.0
    """

    coefficient: OptionalNumberField = number_field("torsion damping", None, sign="not negative")
    law: OptionalLaw = law_field("torque", None, of="angular velocity")
    dissipative = True
    by_angle = True

    def _check(self) -> None:
        super()._check()
        one_of(self, "coefficient")

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action without a free angle."""
        if self.law is None:
            torque = Signal(LINE, [0.0, at[f"{self.name}.coefficient"]])
        else:
            torque = at.law(self, "law")
        return [ForcePrimitive("twist", self.by, self.body, [0.0, 1.0], law=torque)]


@inline
def relative_angle(i, j, p):
    """Argument of the law: θ_j − θ_i − θ₀, or the rate ω_j − ω_i where p₁ = 1."""
    rate = p[1]
    return (1.0 - rate) * (j[2] - i[2] - p[0]) + rate * (j[7] - i[7]), None


@load_physics(argument=relative_angle)
@inline
def twist(i, j, p, f, known):
    """T = −f on j, f on i: it turns back."""
    return (0.0, 0.0, f), (0.0, 0.0, -f)
