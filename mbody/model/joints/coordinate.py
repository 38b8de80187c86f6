"""Coordinate row: the displacement of a place on j along an axis of i follows a law."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.decorators import inline
from mbody.model.primitives import ConstraintPrimitive, between, constraint_physics, turned

if TYPE_CHECKING:
    from mbody.model.element import Numbers


def along_axis(joint: Any, at: Numbers) -> ConstraintPrimitive:
    """The row of a place on j that sticks on the x axis of the marker on i."""
    beta = at.angle(joint, "i")
    parameters = [*at.arm(joint, "i"), *at.arm(joint, "j"), np.cos(beta), np.sin(beta)]
    bodies = joint.i.body, joint.j.body
    return ConstraintPrimitive("coordinate", *bodies, "l", parameters, active_set=True)


@constraint_physics()
@inline
def coordinate(i, j, p, f):
    """Φ = u·d − f with u fixed in i;  γ = f̈ + ω²u·d − 2ω (k×u)·ḋ − u·(rest of d̈)."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    ux, uy = turned(i[3], i[4], p[4], p[5])
    w = i[7]
    # ∂Φ/∂θ_i = (k×u)·d − u·(k×p_i), ∂Φ/∂θ_j = u·(k×p_j)
    block_i = (-ux, -uy, ux * dy - uy * dx + ux * piy - uy * pix, 0.0, 0.0, 0.0)
    block_j = (ux, uy, uy * pjx - ux * pjy, 0.0, 0.0, 0.0)
    turning = w * w * (ux * dx + uy * dy) - 2.0 * w * (ux * dvy - uy * dvx)
    gamma = f[2] + turning - (ux * dax + uy * day)
    return (ux * dx + uy * dy - f[0], 0.0), (*block_i, *block_j), (f[1], 0.0), (gamma, 0.0)
