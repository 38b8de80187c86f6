"""The numbers of Φ_q at positions, by which pivots are chosen (`mbody.system.pivoting`)."""

from __future__ import annotations

import numpy as np

from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import violation
from mbody.system.system import System

__all__ = ["blocks_at", "workspaces_near"]


def blocks_at(system: System, places: np.ndarray) -> list[np.ndarray]:
    """The blocks of Φ_q at positions (positions, coordinates)."""
    blocks, sample = [], system.work()
    for q in places:
        sample.q[: len(q), 0] = q
        violation(system.runtime(), sample)
        blocks.append(sample.block[:, 0].copy())
    return blocks


def workspaces_near(system: System, place: np.ndarray) -> tuple[Work, Work]:
    """Workspaces near a position (coordinates,), and a little off, of other numbers."""
    samples = []
    for shift in (0.0, 0.1):
        sample = system.work()
        sample.q[: len(place), 0] = place + shift * np.sin(np.arange(len(place)))
        sample.par[:] += shift * np.cos(np.arange(len(sample.par)))[:, None]
        violation(system.runtime(), sample)
        samples.append(sample)
    return samples[0], samples[1]
