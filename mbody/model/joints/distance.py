"""Distance joint: a massless rod between two places; and the driver that changes its length."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.decorators import inline
from mbody.errors import ModelError, brief
from mbody.laws import Constant
from mbody.model.element import LawLike, law_field
from mbody.model.joints._base import Flank, StrikingJoint
from mbody.model.primitives import ConstraintPrimitive, between, constraint_physics

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class Distance(StrikingJoint):
    """Massless rod, two-force link: the places on i and j keep their distance.

    Φ = |r_j + A_j s_j − r_i − A_i s_i| − l = 0, one row; the reaction is the force along the rod.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two ends.
    length : float
        Positive [length].
    one_sided : str, optional
        ``"push"`` for a strut that keeps its ends apart but does not pull, ``"pull"`` for a bar
        that does not push: in `simulate` it separates.
    restitution : float, optional
        e of impacts where it holds again, from 0, the default, to 1.

    Examples
    --------
    >>> Distance("rod", "crank.A", "rocker.B", length=2.0).rows
    'l'
    """

    length: LawLike = law_field("length", sign="positive")
    one_sided: str = ""
    rows = "l"
    unknowns = ("F",)

    def _check(self) -> None:
        super()._check()
        if not isinstance(self.length, Constant):
            raise ModelError(
                f"'{self.name}': length must be one positive number; a DistanceDriver takes a law "
                "of time",
                self.name,
            )
        if self.length.value <= 0.0:
            raise ModelError(
                f"'{self.name}': length is {self.length.value:g}, it must be positive; a Revolute "
                "keeps two places together",
                self.name,
            )

        if self.one_sided not in ("", "push", "pull"):
            raise ModelError(
                f"'{self.name}': one_sided is {brief(self.one_sided)}: give \"push\" for a strut, "
                '"pull" for what does not push',
                self.name,
            )

    @property
    def can_separate(self) -> bool:
        """Whether it holds in one direction only."""
        return bool(self.one_sided)

    def flanks(self, at: Numbers) -> list[Flank]:
        """The distance, one way."""
        (row,) = self.primitives(at)
        free = replace(row, kind="clearance", active_set=True)
        return [Flank(free, 1.0 if self.one_sided == "push" else -1.0)]

    def distances(self) -> tuple[tuple[str, str], ...]:
        """That of the two places."""
        return (("i", "j"),)

    def apart(self, at: Any) -> Any:
        """The length of the rod."""
        return at[f"{self.name}.length"]

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; parameters are both arms."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j")]
        length = at.law(self, "length")
        return [
            ConstraintPrimitive("distance", self.i.body, self.j.body, self.rows, parameters, length)
        ]


@constraint_physics()
@inline
def distance(i, j, p, f):
    """Φ = |d| − f;  Φ_q = u·∂d with u = d/|d|;  γ = f̈ − (ḋ² − (u·ḋ)²)/|d| − u·(rest of d̈)."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    length = np.sqrt(dx * dx + dy * dy)
    ux, uy = dx / length, dy / length
    across = ux * dvy - uy * dvx
    block_i = (-ux, -uy, ux * piy - uy * pix, 0.0, 0.0, 0.0)
    block_j = (ux, uy, uy * pjx - ux * pjy, 0.0, 0.0, 0.0)
    gamma = f[2] - across * across / length - (ux * dax + uy * day)
    return (length - f[0], 0.0), (*block_i, *block_j), (f[1], 0.0), (gamma, 0.0)
