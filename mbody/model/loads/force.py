"""A force at a place, keeping its direction in the world or following the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mbody.core.decorators import inline
from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.element import LawLike, Marker, Place, law_field, number_field, place_field
from mbody.model.loads._base import Load
from mbody.model.primitives import ForcePrimitive, load_physics
from mbody.quantities.formula import NumberField, one_number

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.model.loads._base import LoadSummary


@dataclass(frozen=True)
class Force(Load):
    """External force: a law of time along a direction, applied at a place on a body.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    at : Marker or str
        Where it acts.
    value : Law, float or callable
        Magnitude [force] as a function of time.
    angle : float
        Direction [rad], from the world's x axis, or from the marker's when it follows the body.
    follows : bool
        Whether the direction turns with the body.

    Examples
    --------
    >>> Force("push", "coupler.P", 80.0, angle="330 deg").bodies
    ('coupler',)
    """

    main: ClassVar[tuple[str, ...]] = ("value",)

    at: Place = place_field()
    value: LawLike = law_field("force", 0.0)
    angle: NumberField = number_field("angle", 0.0)
    follows: bool = False

    def _check(self) -> None:
        super()._check()
        if not isinstance(self.follows, (bool, np.bool_)):
            raise ModelError(
                f"'{self.name}': follows must be True or False, not {self.follows!r}", self.name
            )

    def line(self, summary: LoadSummary) -> str:
        """Size, direction and place."""
        frame = f" from the axes of {self.at.body}" if self.follows else ""
        size = f"{summary.value(self, 'value')} {summary.unit('force')}"
        return f"{size} @ {summary.degrees(self, 'angle')}°{frame} on {self.at}"

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; parameters are the arm and the direction."""
        angle = at[f"{self.name}.angle"]
        if self.follows:
            angle = angle + at.angle(self, "at")
        parameters = [*at.arm(self, "at"), np.cos(angle), np.sin(angle), float(self.follows)]
        return [
            ForcePrimitive("force", "ground", self.at.body, parameters, (at.law(self, "value"),))
        ]

    @staticmethod
    def components(name: str, at: Marker | str, x: float, y: float) -> Force:
        """A constant force by its world components [force].

        >>> Force.components("push", "coupler.P", 3.0, 4.0).value
        Constant(value=5.0)
        """
        x, y = (one_number(value, "force", name, key) for key, value in (("x", x), ("y", y)))
        return Force(name, at, Constant(float(np.hypot(x, y))), float(np.arctan2(y, x)))


@load_physics()
@inline
def force(i, j, p, f):
    """F = f u on j, with u fixed in the world or in the body; T = p_j × F."""
    c, s = j[3], j[4]
    px, py = c * p[0] - s * p[1], s * p[0] + c * p[1]
    fixed = 1.0 - p[4]
    ux = fixed * p[2] + p[4] * (c * p[2] - s * p[3])
    uy = fixed * p[3] + p[4] * (s * p[2] + c * p[3])
    fx, fy = f * ux, f * uy
    return None, (fx, fy, px * fy - py * fx)
