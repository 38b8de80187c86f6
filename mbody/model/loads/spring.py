"""Springs and dampers between two places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mbody.core.decorators import inline
from mbody.core.tolerances import TINY
from mbody.model.element import OptionalLaw, law_field, number_field
from mbody.model.loads._base import LINE, BetweenPlaces, one_of
from mbody.model.primitives import ForcePrimitive, Signal, between, load_physics
from mbody.quantities.formula import LeftOut, NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class _AlongLine(BetweenPlaces):
    """A force along the line between its places."""

    main: ClassVar[tuple[str, ...]] = ("i", "j")
    along_line: ClassVar[bool] = True


@dataclass(frozen=True)
class Spring(_AlongLine):
    """Translational spring (half of a TSDA): pulls two places together with F(l − l₀).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two ends.
    stiffness : float, optional
        F = preload + stiffness · (l − l₀) [force/length].
    free_length : float
        l₀ [length].
    preload : float
        Tension at the free length [force].
    law : Law or callable, optional
        Instead of the stiffness: tension [force] as a function of the stretch l − l₀ [length].

    Examples
    --------
    >>> Spring("spring", "ground.C", "arm.B", stiffness=20.0, free_length=1.0).bodies
    ('ground', 'arm')
    """

    stiffness: OptionalNumberField = number_field("stiffness", None)
    free_length: NumberField = number_field("length", LeftOut(0.0), sign="not negative")
    preload: NumberField = number_field("force", 0.0)
    law: OptionalLaw = law_field("force", None, of="length")
    conservative = True
    free = "free_length"

    def _check(self) -> None:
        super()._check()
        one_of(self, "stiffness")

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; parameters are both arms and the free length."""
        name = self.name
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), at[f"{name}.free_length"], 0.0]
        if self.law is None:
            tension = Signal(LINE, [at[f"{name}.preload"], at[f"{name}.stiffness"]])
        else:
            tension = at.law(self, "law")
        return [ForcePrimitive("stretch", self.i.body, self.j.body, parameters, law=tension)]


@dataclass(frozen=True)
class Damper(_AlongLine):
    """Translational damper, dashpot: resists the rate of the distance with F(l̇).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two ends.
    coefficient : float, optional
        F = coefficient · l̇ [force·time/length].
    law : Law or callable, optional
        Instead: tension [force] as a function of the rate [length/time].

    Examples
    --------
    >>> import mbody
    >>> cart = mbody.Mechanism("cart", ground={"G": (0.0, 0.0)})
    >>> cart.add(mbody.Body("cart", mass=1.0), mbody.Prismatic("rail", "ground.G", "cart"))
    >>> cart.add(mbody.CoordinateDriver("pull", "ground.G", "cart", "1 m + 0.5 m/s*t"))
    >>> cart.add(Damper("damper", "ground.G", "cart", coefficient=4.0))
    >>> round(float(mbody.kinetostatics(cart).effort("pull")[0]), 9)
    2.0
    """

    coefficient: OptionalNumberField = number_field("damping", None, sign="not negative")
    law: OptionalLaw = law_field("force", None, of="velocity")
    dissipative = True

    def _check(self) -> None:
        super()._check()
        one_of(self, "coefficient")

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; parameters are both arms."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), 0.0, 1.0]
        if self.law is None:
            tension = Signal(LINE, [0.0, at[f"{self.name}.coefficient"]])
        else:
            tension = at.law(self, "law")
        return [ForcePrimitive("stretch", self.i.body, self.j.body, parameters, law=tension)]


@inline
def elongation(i, j, p):
    """(x, (u, arms)): what the law takes (stretch, or its rate where p₅ = 1), and where it pulls.

    u = d/|d|; two ends at one point have no direction: the pull is then zero.
    """
    arms, (dx, dy), (dvx, dvy), _ = between(i, j, p[0], p[1], p[2], p[3])
    length = np.sqrt(dx * dx + dy * dy)
    distance = np.sqrt(dx * dx + dy * dy + TINY)
    ux, uy = dx / distance, dy / distance
    rate = p[5]
    x = (1.0 - rate) * (length - p[4]) + rate * (ux * dvx + uy * dvy)
    return x, ((ux, uy), arms)


@load_physics(argument=elongation)
@inline
def stretch(i, j, p, f, known):
    """A tension f along the line between two places: f u on i, −f u on j."""
    (ux, uy), (pix, piy, pjx, pjy) = known
    fx, fy = f * ux, f * uy
    return (fx, fy, pix * fy - piy * fx), (-fx, -fy, pjy * fx - pjx * fy)
