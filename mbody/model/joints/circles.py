"""Rows of two circles that may touch: their clearance, and the velocity of sliding.

Where both centres coincide neither has a direction; their blocks are zero there.
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import inline
from mbody.core.lanes import sincos
from mbody.core.tolerances import TINY
from mbody.model.primitives import between, constraint_physics


@constraint_physics()
@inline
def clearance(i, j, p, f):
    """Φ = |d| − f as of a distance;  Φ_q = u·∂d with u = d/|d|, zero where d is;
    γ = f̈ − (ḋ² − (u·ḋ)²)/|d| − u·(rest of d̈).
    """
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    length = np.sqrt(dx * dx + dy * dy)
    ux, uy = dx / (length + TINY), dy / (length + TINY)
    across = ux * dvy - uy * dvx
    block_i = (-ux, -uy, ux * piy - uy * pix, 0.0, 0.0, 0.0)
    block_j = (ux, uy, uy * pjx - ux * pjy, 0.0, 0.0, 0.0)
    gamma = f[2] - across * across / (length + TINY) - (ux * dax + uy * day)
    return (length - f[0], 0.0), (*block_i, *block_j), (f[1], 0.0), (gamma, 0.0)


@constraint_physics()
@inline
def slipping(i, j, p, f):
    """Φ = n(ψ)·d as of a gear pair, ψ = p₄θ_i + p₅θ_j + p₆, but its rate taken across the line of
    centres wherever that is: s = n·ḋ − |d| w with u = d/|d|, n = k×u, w = p₄ω_i + p₅ω_j.

    The same where n(ψ) is across the line of centres, as while circles roll, for which p₆ is set
    where that begins. ṡ = n·d̈ − (n·ḋ/|d| + w) u·ḋ − |d| ẇ.
    """
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    s, c = sincos(p[4] * i[2] + p[5] * j[2] + p[6])
    length = np.sqrt(dx * dx + dy * dy)
    nx, ny = -dy / (length + TINY), dx / (length + TINY)
    w = p[4] * i[7] + p[5] * j[7]
    block_i = (-nx, -ny, nx * piy - ny * pix - p[4] * length, 0.0, 0.0, 0.0)
    block_j = (nx, ny, ny * pjx - nx * pjy - p[5] * length, 0.0, 0.0, 0.0)
    apart = ny * dvx - nx * dvy
    turning = (nx * dvx + ny * dvy) / (length + TINY)
    gamma = (turning + w) * apart - (nx * dax + ny * day)
    return (c * dy - s * dx, 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)
