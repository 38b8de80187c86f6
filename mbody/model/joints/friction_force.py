"""Friction of a given force along a guide: packings, seals, piston rings, rail brakes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.model.element import LawLike, law_field
from mbody.model.joints._base import SLIDING_PAIR, GivenFriction
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class FrictionForce(GivenFriction):
    """Friction along the x axis of the marker on i, of a force that does not depend on what
    presses: a packing, a seal, piston rings, the sleeve of a governor, a rail brake.

    While the place on j moves along that axis it slips, with the force of its law against the rate;
    where it does not it sticks as long as no more force than that is needed. It has no rows; a
    guide keeps the bodies in line. What depends on the reaction is an attribute of the guide:
    ``Prismatic(…, friction=0.1)``.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        A place on the guide; the marker's `angle` is the direction.
    j : Marker or str
        The place that slides; the reaction acts on it.
    force : Law, float, str or callable
        Force while it slips: a number, a law of time, or a formula of measured quantities and
        inputs, such as ``"40 N + 0.02*pressure"``. Where it is negative there is none.
    static : float
        How many times as much it holds while it sticks, at least 1.
    stribeck : float, optional
        Rate over which the force falls from what sticks to what slips [velocity].

    Examples
    --------
    >>> FrictionForce("packing", "ground", "rod.A", force=60.0).bodies
    ('ground', 'rod')
    """

    force: LawLike = law_field("force", 0.0)
    coordinates = SLIDING_PAIR
    unknowns = ("F",)
    size = "force"

    def tangent(self, at: Numbers) -> ConstraintPrimitive:
        """The displacement along the axis."""
        beta = at.angle(self, "i")
        numbers = [*at.arm(self, "i"), *at.arm(self, "j"), np.cos(beta), np.sin(beta)]
        return ConstraintPrimitive("coordinate", *self.bodies, "l", numbers, active_set=True)
