"""Fixed joint: two bodies welded at a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.model.joints._base import Joint
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class Fixed(Joint):
    """Weld, rigid connection: the two markers coincide and keep one direction.

    A pin and an equal angle, θ_j + β_j = θ_i + β_i: three rows. The reaction has a force and a
    torque.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two markers; their `angle` fields set the relative direction.

    Examples
    --------
    >>> Fixed("weld", "arm.tip", "tool").rows
    'lla'
    """

    rows = "lla"
    coincident = True
    parallel = True
    counts_turns = True
    unknowns = ("x", "y", "T")

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """A pair of rows as of a pin, and one for the angle."""
        i, j = self.i.body, self.j.body
        pin = [*at.arm(self, "i"), *at.arm(self, "j")]
        beta = [at.angle(self, "j") - at.angle(self, "i")]
        return [
            ConstraintPrimitive("revolute", i, j, "ll", pin),
            ConstraintPrimitive("angle", i, j, "a", beta),
        ]
