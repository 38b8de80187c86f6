"""The coefficients of friction that joints have as attributes, and how they fit together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.model.element import OptionalNumberField, number_field
from mbody.model.joints._base import Joint
from mbody.model.static_friction import refuse_static, refuse_static_of_designs

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["RubbingJoint"]


@dataclass(frozen=True, kw_only=True)
class RubbingJoint(Joint):
    """Base of joints with Coulomb friction between two surfaces.

    The coefficient is `friction` while the surfaces slide and at most `static` while they stick;
    with a Stribeck speed v_s it falls with the sliding speed v from the one to the other,

        μ(v) = μ_k + (μ_s − μ_k) exp(−(v/v_s)²).

    Parameters
    ----------
    friction : float, optional
        Kinetic coefficient. Without it, nor `viscous`, the joint is without friction; with 0 the
        coefficient can be given another value later.
    static : float, optional
        Static coefficient, at least `friction`; by default the same.
    stribeck : float, optional
        Speed of the Stribeck curve [velocity], of the surfaces on each other.
    """

    friction: OptionalNumberField = number_field("number", None, sign="not negative")
    static: OptionalNumberField = number_field("number", None, sign="not negative")
    stribeck: OptionalNumberField = number_field("velocity", None, sign="positive")

    def _check(self) -> None:
        super()._check()
        if self.friction is None and self.static is not None:
            raise ModelError(
                f"'{self.name}': static is {self.static:g}, but there is no friction while it "
                "slides: give friction too, at most as much",
                self.name,
            )
        if self.stribeck is not None and self.static is None:
            raise ModelError(
                f"'{self.name}': a stribeck speed is how fast friction falls from static to "
                "friction: give both, or leave it out",
                self.name,
            )
        if self.friction is not None and self.static is not None:
            refuse_static(self.name, float(self.friction), float(self.static))

    @property
    def rubs(self) -> bool:
        """Whether friction or damping is given, be it 0."""
        return self.friction is not None or getattr(self, "viscous", None) is not None

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse a static coefficient below the kinetic one, of any design."""
        super().refuse(at, unit)
        if self.static is not None and self.friction is not None:
            name = self.name
            refuse_static_of_designs(name, at[f"{name}.friction"], at[f"{name}.static"])

    def coefficients(self, at: Numbers, reach: Any = 1.0) -> list[Any]:
        """(μ_k, μ_s, Stribeck speed, viscous) as the kernels take them, of a rate that is `reach`
        times smaller than the sliding speed, as the angular velocity of a pin is by its radius.
        """
        name = self.name
        kinetic = 0.0 if self.friction is None else at[f"{name}.friction"]
        static = kinetic if self.static is None else at[f"{name}.static"]
        stribeck = 0.0 if self.stribeck is None else at[f"{name}.stribeck"] / reach
        viscous = 0.0 if getattr(self, "viscous", None) is None else at[f"{name}.viscous"]
        return [kinetic, static, stribeck, viscous]
