"""A chain as plain numbers without mbody, for processes whose memory is a peer's alone."""

from __future__ import annotations

import numpy as np

from benchmarks.models import LENGTH, MASS, G
from benchmarks.planar import GROUND, Pin, Planar

__all__ = ["chain"]


def chain(count: int) -> Planar:
    """As `benchmarks.models.chain`."""
    pose = np.zeros((count, 3))
    pose[:, 0] = LENGTH * (np.arange(count) + 0.5)
    half = 0.5 * LENGTH
    pins = [
        Pin(n - 1, n, (half, 0.0), (-half, 0.0)) if n else Pin(GROUND, 0, (0.0, 0.0), (-half, 0.0))
        for n in range(count)
    ]
    inertia = np.full(count, MASS * LENGTH**2 / 12.0)
    return Planar(np.full(count, MASS), inertia, pose, np.zeros((count, 3)), pins, -G)
