"""Rows of a circle or a point on a smooth contour, see `mbody.laws.contour`."""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import inline
from mbody.core.lanes import larger, sincos
from mbody.model.primitives import between, constraint_physics


@inline
def place_on(i, j, p):
    """The centre of the circle in the axes of the contour."""
    _, (dx, dy), _, _ = between(i, j, p[0], p[1], p[2], p[3])
    return i[3] * dx + i[4] * dy, i[3] * dy - i[4] * dx


@inline
def speed_along(i, j, p, phi):
    """t·u at the angle φ of a foot: the speed of the centre along the contour, as its body sees."""
    _, (dx, dy), (dvx, dvy), _ = between(i, j, p[0], p[1], p[2], p[3])
    ty, tx = sincos(i[2] + phi)
    return tx * (dvx + i[7] * dy) + ty * (dvy - i[7] * dx)


@constraint_physics(argument=place_on, of_place=True)
@inline
def contour(i, j, p, f):
    """The gap D − p₄, p₅ = 0; or s − p₄ φ + p₄ (θ_j − θ_i) − p₆, whose rate is the sliding velocity
    t·u + p₄ (ω_j − ω_i), p₅ = 1, or −1 where Φ is not counted.

    With u = ḋ − ω_i k×d, e = n or t at the foot: Φ_q = e·∂u (+ p₄ ∂(θ_j − θ_i)), ė = Ω k×e with
    Ω = ω_i + κ/(1 − κ D) t·u.
    """
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    along, counted = np.abs(p[5]), larger(p[5], 0.0)
    ty, tx = sincos(i[2] + f[2])
    ex, ey = along * (tx + ty) - ty, along * (ty - tx) + tx
    r = along * p[4]
    # k×e, e·k×d and u
    qx, qy, w = -ey, ex, i[7]
    arm = qx * dx + qy * dy
    ux, uy = dvx + w * dy, dvy - w * dx
    block_i = (-ex, -ey, ex * piy - ey * pix + arm - r, 0.0, 0.0, 0.0)
    block_j = (ex, ey, ey * pjx - ex * pjy + r, 0.0, 0.0, 0.0)
    turn = w + f[3] * (tx * ux + ty * uy)
    gamma = -(ex * dax + ey * day + turn * (qx * ux + qy * uy) + w * (qx * dvx + qy * dvy))
    rolled = f[1] - p[4] * f[2] + p[4] * (j[2] - i[2]) - p[6]
    phi = (1.0 - along) * (f[0] - p[4]) + counted * rolled
    return (phi, 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)
