"""A torque on a body, by the ground or by another body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mbody.core.decorators import inline
from mbody.model.element import LawLike, law_field
from mbody.model.loads._base import Turning
from mbody.model.primitives import ForcePrimitive, load_physics

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class Torque(Turning):
    """External couple on a body; its opposite acts on the body that it comes from.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body : str
        Name of the body that it acts on.
    by : str
        The body that carries the opposite torque, by default the ground.
    value : Law, float or callable
        Counter-clockwise torque [force·length] as a function of time.

    Examples
    --------
    >>> Torque("load", "rocker", value=120.0).bodies
    ('ground', 'rocker')
    """

    main: ClassVar[tuple[str, ...]] = ("value",)

    value: LawLike = law_field("torque", 0.0)

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action without parameters."""
        return [ForcePrimitive("torque", self.by, self.body, [], (at.law(self, "value"),))]


@load_physics()
@inline
def torque(i, j, p, f):
    """T = f on j, −f on i."""
    return (0.0, 0.0, -f), (0.0, 0.0, f)
