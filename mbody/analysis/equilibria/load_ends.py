"""Ends of loads at positions: how far they are apart, and how that changes along the surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.analysis.position.tangent_space import Array
from mbody.model.loads import Load
from mbody.system.system import System

__all__ = ["LoadEnds", "two_ended"]


def two_ended(system: System) -> list[Load]:
    """The loads that have two ends."""
    return [one for one in system.mechanism.loads if hasattr(one, "i") and hasattr(one, "j")]


class LoadEnds:
    """From one end of each of some loads to the other, in model lengths, at many positions.

    Attributes
    ----------
    numbers : list of int
        Of the loads, in the order of the description.
    along : array (loads,)
        Whether each pulls along the line between its ends.
    """

    def __init__(self, system: System, loads: Sequence[Load]) -> None:
        self.loads, self.length = list(loads), system.length
        every = list(system.mechanism.loads)
        self.numbers = [every.index(load) for load in loads]
        self.along = np.array([load.along_line for load in loads], dtype=np.bool_)
        ends = [(load, side) for side in "ij" for load in loads]
        # the ground is the last body and has no coordinates
        bodies = [system.bodies[load.place(side).body] for load, side in ends]
        arms = [system.numbers.arm(load, side) for load, side in ends]
        self.bodies = np.array(bodies, dtype=np.int64).reshape(2, -1)
        self.arms = np.array(arms, dtype=float).reshape(2, -1, 2) / self.length

    def _turned(self, q: Array) -> tuple[Array, Array]:
        """Poses (…, 2, loads, 3) in model lengths, and arms in world axes (…, 2, loads, 2)."""
        pose = q.reshape(*q.shape[:-1], -1, 3)
        pose = np.concatenate([pose, np.zeros((*q.shape[:-1], 1, 3))], axis=-2)
        pose = pose[..., self.bodies, :]
        pose[..., :2] /= self.length
        c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        x, y = self.arms[..., 0], self.arms[..., 1]
        return pose, np.stack([c * x - s * y, s * x + c * y], axis=-1)

    def vectors(self, q: Array) -> Array:
        """At positions (…, coordinates): (…, loads, 2)."""
        pose, arms = self._turned(q)
        places = pose[..., :2] + arms
        return np.asarray(places[..., 1, :, :] - places[..., 0, :, :])

    def slopes(self, q: Array, ways: Array) -> Array:
        """Change along directions (…, free, coordinates) without units: (…, loads, 2, free)."""
        arms = self._turned(q)[1][..., None, :, :, :]
        rates = ways.reshape(*ways.shape[:-1], -1, 3)
        still = np.zeros((*rates.shape[:-2], 1, 3))
        rates = np.concatenate([rates, still], axis=-2)[..., self.bodies, :]
        turning = np.stack([-arms[..., 1], arms[..., 0]], axis=-1) * rates[..., 2:]
        moved = rates[..., :2] + turning
        return np.moveaxis(moved[..., 1, :, :] - moved[..., 0, :, :], -3, -1)
