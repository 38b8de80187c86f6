"""Where what sticks or closes began to, with derivatives."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.core.dual_number import DualNumber
from mbody.derivatives.dual_motion import DualInstant, Tangents
from mbody.derivatives.mode_record import ModeStretch

__all__ = ["anchored"]

Array = np.ndarray


def anchored(
    uni: Unilateral, tangents: Tangents, stretch: ModeStretch, now: DualInstant
) -> Tangents:
    """The same tangents; where sticking begins at an instant depends on the numbers."""
    anchor, phases = 0.0 * tangents.anchor, tangents.phases.copy()
    for n, touch in enumerate(uni.touches):
        if uni.one_way[n] and stretch.on[touch.normal]:
            anchor[touch.normal] = now.value[touch.normal].tangents / uni.unit_of(n)
        if touch.tangent < 0 or not stretch.on[touch.tangent]:
            continue
        if touch.spot.solid == "circle":
            e = int(uni.layout.switched[touch.tangent])
            row = int(uni.layout.primitive_par[e])
            place = uni.phase_rows.index(row + 6)
            phases[place] = now.par[row + 6].tangents + _turned(uni, n, row, now)
        else:
            anchor[touch.tangent] = now.value[touch.tangent].tangents
    for pair in uni.rough:
        if stretch.on[pair.tangent]:
            anchor[pair.tangent] = now.value[pair.tangent].tangents
    return replace(tangents, anchor=anchor, phases=phases)


def _turned(uni: Unilateral, n: int, row: int, now: DualInstant) -> Array:
    """Tangents of the angle by which the row along touch n, of two circles, is turned."""
    found = []
    for b, k in zip(uni.bodies[n], (0, 2), strict=True):
        x, y, angle = _pose(uni, b, now)
        c, s = np.cos(angle), np.sin(angle)
        ax, ay = now.par[row + k], now.par[row + k + 1]
        found.append((x + c * ax - s * ay, y + s * ax + c * ay, angle))
    (ax, ay, i), (bx, by, j) = found
    psi = now.par[row + 4] * i + now.par[row + 5] * j + now.par[row + 6]
    return np.asarray((np.arctan2(by - ay, bx - ax) - psi).tangents)


def _pose(uni: Unilateral, body: int, now: DualInstant) -> tuple[Any, Any, Any]:
    if 3 * body >= uni.system.coordinates:
        zero = DualNumber(0.0, np.zeros(now.y.tangents.shape[1]))
        return zero, zero, zero
    x, y, angle = (now.y[3 * body + k] for k in range(3))
    return x, y, angle
