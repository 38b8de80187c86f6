"""Many designs closed at once: in one call of the kernels, or in stages from a closed one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.position.whole_turns import by_springs
from mbody.kernels.loop_closure import close_designs
from mbody.system.system import System


def close_batch(
    system: System, t: float, values: np.ndarray, poses: np.ndarray, small: Any, least: float
) -> np.ndarray:
    """Close every design of a batch at time t; which of them are closed, away from singular
    positions: (designs,).
    """
    work, state = system.work(), np.empty((len(poses), 2))
    work.time[:] = t
    close_designs(system.layout, work, np.full(len(poses), small), system.par, values, poses, state)
    by_springs(system, poses)
    closes, pivot = state.T
    return np.asarray((closes > 0.0) & (pivot >= least))


# -- Designs far from a closed position, closed in stages: from its numbers straight to each
#    design's ----------------------------------------------------------------------------------
#
# The numbers go λ of the way, 0 ≤ λ ≤ 1, and the closed position goes along (homotopy; Allgower and
# Georg, *Introduction to Numerical Continuation Methods*, 2003). A stage that moves a body far, or
# does not close, is halved, so that the branch is kept: a path that ends at a singular position has
# none for that design. All designs that are still on their way take a stage in one call.

#: A stage may move coordinates by so much, in model lengths and radians, so that no other branch
#: is near: as `mbody.inverse.trials`.
LEAP = 0.5
#: A stage may miss where the last one led by this part of its way and of the last one's.
BENT = 0.5
#: The first stage, and the least one, as parts of the way.
FIRST, LEAST = 0.25, 2.0**-12


@dataclass(frozen=True, eq=False)
class ClosedDesigns:
    """First positions of many designs.

    Attributes
    ----------
    poses : array (designs, coordinates + 3)
        Where they closed, or where their way ended.
    good : array (designs,)
        Whether they closed, away from singular positions.
    way : array (designs,)
        How much of the way in the numbers closes, 1 of all.
    """

    poses: np.ndarray
    good: np.ndarray
    way: np.ndarray


def close_in_stages(
    system: System,
    t: float,
    values: np.ndarray,
    pose: np.ndarray,
    origin: np.ndarray,
    small: float,
    least: float,
) -> ClosedDesigns:
    """Close every design of a batch at time t, on the branch of one closed position."""
    poses = np.tile(pose, (len(values), 1))
    good = close_batch(system, t, values, poses, small, least)
    good &= system.extent(poses - pose) <= LEAP
    way = np.where(good, 1.0, 0.0)
    far = np.flatnonzero(~good)
    if len(far):
        stages = _Stages(system, t, values[far], (origin, far), small, least)
        poses[far], way[far] = stages.all(pose)
        by_springs(system, poses)
    return ClosedDesigns(poses, way == 1.0, way)


class _Stages:
    """Designs on their way from the same numbers."""

    def __init__(
        self,
        system: System,
        t: float,
        values: np.ndarray,
        numbers: tuple[np.ndarray, np.ndarray],
        small: float,
        least: float,
    ) -> None:
        origin, designs = numbers
        self.system, self.values, self.small, self.least = system, values, small, least
        self.origin, self.goal = origin[:, None], system.par[:, designs]
        self.work = system.work()
        self.work.time[:] = t

    def all(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the ways end, (designs, coordinates + 3), and how far they come, (designs,)."""
        count = len(self.values)
        poses, way, stage = np.tile(pose, (count, 1)), np.zeros(count), np.full(count, FIRST)
        slope = np.zeros_like(poses)
        # of the first stage nothing foretells where it leads
        begun = np.zeros(count, dtype=bool)
        active = np.arange(count)
        while len(active):
            to = np.minimum(way[active] + stage[active], 1.0)
            step = (to - way[active])[:, None]
            found, closes = self._closed(active, to, poses[active])
            moved = found - poses[active]
            bent = self.system.extent(moved - step * slope[active])
            straight = self.system.extent(moved) + self.system.extent(step * slope[active])
            kept = closes & (self.system.extent(moved) <= LEAP)
            kept &= ~begun[active] | (bent <= BENT * straight) | (straight <= 1e-3)
            on = active[kept]
            poses[on], slope[on], begun[on] = found[kept], (moved / step)[kept], True
            way[on] = to[kept]
            stage[on] *= 2.0
            stage[active[~kept]] *= 0.5
            active = active[(way[active] < 1.0) & (stage[active] >= LEAST)]
        return poses, way

    def _closed(
        self, active: np.ndarray, to: np.ndarray, poses: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Some designs closed at their next stage, and which of them are."""
        goal = self.goal[:, active]
        between = np.where(to < 1.0, self.origin + to * (goal - self.origin), goal)
        par = np.ascontiguousarray(between)
        found, state = poses.copy(), np.empty((len(active), 2))
        small = np.full(len(active), self.small)
        values = np.ascontiguousarray(self.values[active])
        close_designs(self.system.layout, self.work, small, par, values, found, state)
        closes, pivot = state.T
        moved: Any = self.system.extent(found - poses)
        return found, (closes > 0.0) & (pivot >= self.least) & np.isfinite(moved)
