"""Geometry that the physics of joints and loads share; scalar functions, on floats or lanes.

A body enters physics as its side (x, y, θ, cos θ, sin θ, vx, vy, ω) at the mass centre.
"""

from __future__ import annotations

from mbody.core.decorators import inline


@inline
def turned(c, s, x, y):
    """Link axes to world axes: (c x − s y, s x + c y)."""
    return c * x - s * y, s * x + c * y


@inline
def between(i, j, aix, aiy, ajx, ajy):
    """From marker i to marker j: (d, ḋ, and d̈ without the angular and linear accelerations).

    d = r_j + A_j s_j − r_i − A_i s_i;  the rest of d̈ is −ω_j² A_j s_j + ω_i² A_i s_i.
    """
    xi, yi, _, ci, si, vxi, vyi, wi = i
    xj, yj, _, cj, sj, vxj, vyj, wj = j
    pix, piy = turned(ci, si, aix, aiy)
    pjx, pjy = turned(cj, sj, ajx, ajy)
    dx = xj + pjx - xi - pix
    dy = yj + pjy - yi - piy
    dvx = vxj - wj * pjy - vxi + wi * piy
    dvy = vyj + wj * pjx - vyi - wi * pix
    dax = wi * wi * pix - wj * wj * pjx
    day = wi * wi * piy - wj * wj * pjy
    return (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day)
