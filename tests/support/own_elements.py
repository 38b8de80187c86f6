"""Joints and loads of a user's own, and the bodies that they act on."""

import math
from dataclasses import dataclass

from mbody import Marker
from mbody.model.element import number_field
from mbody.model.joints import CustomJoint
from mbody.model.loads import CustomLoad

I, J = Marker("bar", "P", 0.3), Marker("arm", (0.2, 0.5), -0.7)
ON_GROUND = Marker("ground", (1.0, -2.0), 0.4)


def turned(side, x, y):
    return side[3] * x - side[4] * y, side[4] * x + side[3] * y


@dataclass(frozen=True)
class PointOnLine(CustomJoint):
    """Pin in a slot: the place on j stays on the x axis of the marker on i."""

    rows = "l"

    def physics(self, i, j, p, t):
        """Φ = n·d;  γ = ω²n·d − 2ω (k×n)·ḋ − n·(rest of d̈)."""
        pix, piy = turned(i, p[0], p[1])
        pjx, pjy = turned(j, p[2], p[3])
        nx, ny = turned(i, -math.sin(p[4]), math.cos(p[4]))
        w, wj = i[7], j[7]
        dx, dy = j[0] + pjx - i[0] - pix, j[1] + pjy - i[1] - piy
        dvx = j[5] - wj * pjy - i[5] + w * piy
        dvy = j[6] + wj * pjx - i[6] - w * pix
        rest = nx * (w * w * pix - wj * wj * pjx) + ny * (w * w * piy - wj * wj * pjy)
        bi = nx * dy - ny * dx + nx * piy - ny * pix
        blocks = (-nx, -ny, bi, 0, 0, 0, nx, ny, ny * pjx - nx * pjy, 0, 0, 0)
        gamma = w * w * (nx * dx + ny * dy) - 2.0 * w * (nx * dvy - ny * dvx) - rest
        return (nx * dx + ny * dy, 0.0), blocks, (0.0, 0.0), (gamma, 0.0)


@dataclass(frozen=True)
class OwnRevolute(CustomJoint):
    """A pin like the built-in one."""

    rows = "ll"

    def physics(self, i, j, p, t):
        pix, piy = turned(i, p[0], p[1])
        pjx, pjy = turned(j, p[2], p[3])
        wi, wj = i[7] ** 2, j[7] ** 2
        phi = i[0] + pix - j[0] - pjx, i[1] + piy - j[1] - pjy
        blocks = (1, 0, -piy, 0, 1, pix, -1, 0, pjy, 0, -1, -pjx)
        return phi, blocks, (0, 0), (wi * pix - wj * pjx, wi * piy - wj * pjy)


@dataclass(frozen=True)
class Drag(CustomLoad):
    """Air drag F = −c v at a place on j, by the ground."""

    coefficient: float = number_field("damping", 0.5)

    def physics(self, i, j, p, t):
        px, py = turned(j, p[2], p[3])
        fx = -self.coefficient * (j[5] - j[7] * py)
        fy = -self.coefficient * (j[6] + j[7] * px)
        x, y = j[0] + px, j[1] + py
        return -fx, -fy, -(x * fy - y * fx), fx, fy, px * fy - py * fx


@dataclass(frozen=True)
class Attraction(CustomLoad):
    """Inverse-square attraction of two places."""

    strength: float = 2.0

    def physics(self, i, j, p, t):
        pix, piy = turned(i, p[0], p[1])
        pjx, pjy = turned(j, p[2], p[3])
        dx, dy = j[0] + pjx - i[0] - pix, j[1] + pjy - i[1] - piy
        f = self.strength / (dx * dx + dy * dy) ** 1.5
        fx, fy = f * dx, f * dy
        return fx, fy, pix * fy - piy * fx, -fx, -fy, pjy * fx - pjx * fy
