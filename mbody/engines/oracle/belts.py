"""The oracle's belts: tensions of both ends of a band or of both strands, where these leave."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.model.joints import BandBrake, Belt

__all__ = ["band_torque", "pull_of_strands"]


def band_torque(joint: BandBrake, force: float, sense: float) -> float:
    """Torque on a drum that slips, by the balance of the lever and the ratio of tensions."""
    ratio = math.exp(joint.friction * joint.wrap * sense)
    lever = [[1.0, -ratio], [-joint.helping_arm, joint.arm]]
    first, second = np.linalg.solve(lever, [0.0, force * joint.lever])
    return abs(float(first - second)) * joint.radius


def pull_of_strands(
    joint: Belt, centres: list[tuple[Any, Any]], mean: float, sense: float
) -> tuple[float, float, float]:
    """(Fx, Fy, T) of both strands on pulley j about its centre; `sense`: that of slipping, times
    the part of the greatest force on the rim.
    """
    (xi, yi), (xj, yj) = centres
    apart = math.hypot(xj - xi, yj - yi)
    ux, uy = (xj - xi) / apart, (yj - yi) / apart
    side = -1.0 if joint.crossed else 1.0
    lean = math.asin((joint.radius_i - side * joint.radius_j) / apart)
    wrap = math.pi + (2.0 * lean if joint.crossed else -2.0 * abs(lean))
    ratio = math.exp(joint.friction * wrap)
    half = sense * mean * (ratio - 1.0) / (ratio + 1.0)
    total = np.zeros(3)
    for n in (1.0, -1.0):
        # the normal of pulley i where the strand leaves it, and that of pulley j up to its sign
        mx = math.sin(lean) * ux - n * math.cos(lean) * uy
        my = math.sin(lean) * uy + n * math.cos(lean) * ux
        arm = side * joint.radius_j * mx, side * joint.radius_j * my
        tx, ty = xi + joint.radius_i * mx - xj - arm[0], yi + joint.radius_i * my - yj - arm[1]
        length = math.hypot(tx, ty)
        turning = (arm[0] * ty - arm[1] * tx) / length
        # pulley j is driven on where the rim of i is faster
        pull = mean + half * math.copysign(1.0, turning * side)
        total += pull * np.array([tx / length, ty / length, turning])
    return float(total[0]), float(total[1]), float(total[2])
