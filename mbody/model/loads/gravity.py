"""Gravity: a uniform field on every body with mass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mbody.core.decorators import inline
from mbody.model.element import LawLike, law_field
from mbody.model.loads._base import Load
from mbody.model.primitives import ForcePrimitive, load_physics

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.model.loads._base import LoadSummary


@dataclass(frozen=True)
class Gravity(Load):
    """Weight of every body, in any direction: the force m (x, y) at each mass centre.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    x, y : Law, float or callable
        Components of the gravitational acceleration [length/time²]; both may follow time.

    Examples
    --------
    >>> Gravity("gravity", y=-9.81).bodies
    ()
    """

    main: ClassVar[tuple[str, ...]] = ("x", "y")

    x: LawLike = law_field("acceleration", 0.0)
    y: LawLike = law_field("acceleration", 0.0)
    conservative = True

    def line(self, summary: LoadSummary) -> str:
        """Its components."""
        parts = ", ".join(summary.value(self, key) for key in "xy")
        return f"({parts}) {summary.unit('acceleration')} on every mass"

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action on all bodies."""
        return [
            ForcePrimitive(
                "gravity", "ground", "ground", [], (at.law(self, "x"), at.law(self, "y"))
            )
        ]


@load_physics(form="every mass")
@inline
def gravity(m, gx, gy):
    """F = m g."""
    return m * gx, m * gy
