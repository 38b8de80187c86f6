"""Which shapes overlap at a position, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.unilateral import Rows, Unilateral
from mbody.kernels.layout import Work

__all__ = ["Overlap", "deepest_overlap"]

Array = np.ndarray


@dataclass(frozen=True)
class Overlap:
    """Two shapes that overlap.

    Attributes
    ----------
    contact : str
        Its name.
    touch : int
        Number of the touch that is nearest to being open.
    depth : float
        In the unit of its row.
    """

    contact: str
    touch: int
    depth: float


def deepest_overlap(uni: Unilateral, rows: Rows, work: Work, near: float) -> Overlap | None:
    """The contact that overlaps most at the position in a workspace, by more than `near`; None
    where none does.
    """
    gaps, along = uni.gaps(rows), uni.along(work).min(axis=1, initial=np.inf)
    worst: dict[str, tuple[float, int]] = {}
    edges: dict[tuple[str, str, tuple[float, ...], float], list[int]] = {}
    for n, (touch, gap) in enumerate(zip(uni.touches, gaps, strict=True)):
        spot = touch.spot
        if spot.solid == "polygon" and not spot.arcs:
            arm = tuple(float(part) for part in spot.arm)
            key = touch.name, str(spot.swapped), arm, float(spot.reach)
            edges.setdefault(key, []).append(n)
        elif gap >= -near:
            continue
        elif spot.solid == "segment" or spot.arcs:
            # from behind a thin wall, or an arc, nothing overlaps it but a disc
            if along[n] >= 0.0 and gap > -2.0 * float(spot.reach):
                worst.setdefault(touch.name, (float(gap), n))
        else:
            worst[touch.name] = min(worst.get(touch.name, (0.0, n)), (float(gap), n))
    whole = uni.along(work)
    for (name, _, _, reach), about in edges.items():
        gap, n = _to_polygon(gaps[about] + reach, whole[about])
        if gap - reach < -near:
            worst[name] = min(worst.get(name, (0.0, 0)), (gap - reach, about[n]))
    if not worst:
        return None
    name = min(worst, key=lambda one: worst[one][0])
    gap, n = worst[name]
    return Overlap(name, n, -gap / uni.unit_of(n))


def _to_polygon(across: Array, along: Array) -> tuple[float, int]:
    """The distance of a point from a polygon, negative within, and the number of the nearest edge;
    of every edge the distance `across` its line (edges,), positive outside, and those `along` it
    from both ends (edges, 2). The polygon may bend inwards.
    """
    past = np.maximum(-along.min(axis=1), 0.0)
    distances = np.hypot(across, past)
    least = distances.min()
    # nearest to a corner both edges there are as near: the one that is seen more squarely decides
    near = np.flatnonzero(distances <= least * (1.0 + 1e-12) + 1e-300)
    n = int(near[np.argmax(np.abs(across[near]))])
    return float(np.copysign(least, across[n])), n
