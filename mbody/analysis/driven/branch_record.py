"""What following a motion shows of its branch: how near others came, and change points passed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.time_grid import BY_TIME, TimeGrid
from mbody.kernels.branch_monitor import branch_distance
from mbody.kernels.continuation_lanes import FAILED, GREATEST, GREATEST_AT
from mbody.kernels.layout import Work
from mbody.solution.histories import BranchDistance
from mbody.system.rank import dense, too_large
from mbody.system.system import System

__all__ = ["BranchRecord", "Passed", "meeting"]

#: Change points that a note names, and elements of each.
NAMED, ELEMENTS = 4, 8
#: Places closer than this part of all that is followed are one.
SAME = 1e-6
#: An element takes part where its share of what rows have in common is at least this.
SHARE = 0.05


@dataclass(frozen=True)
class Passed:
    """A change point: path parameter, position close to it, design of a batch."""

    s: float
    q: np.ndarray
    design: int


class BranchRecord:
    """What is known of the branch of one analysis, gathered from all its pieces.

    Attributes
    ----------
    least : float
        Square of the least distance.
    t : float
        The instant of it.
    passed : list of Passed
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.least, self.t = math.inf, math.nan
        self.passed: list[Passed] = []

    @property
    def distance(self) -> BranchDistance | None:
        """As results have it; None where nothing was followed."""
        if not math.isfinite(self.least):
            return None
        return BranchDistance(math.sqrt(max(self.least, 0.0)), self.t)

    def followed(
        self, grid: TimeGrid, nearest: np.ndarray, passed: np.ndarray, design: int = 0
    ) -> None:
        """What `follow` found on a piece: nearest (3,), passed (change points, 1 + coordinates)."""
        least, s, k = nearest.tolist()
        if least < self.least:
            self.least = least
            self.t = s if grid.mode == BY_TIME else float(grid.t[min(int(k), len(grid.t) - 1)])
        apart = SAME * max(float(np.ptp(grid.s)), 1e-300)
        known = np.array([one.s for one in self.passed if one.design == design])
        for row in passed:
            if not (np.abs(known - row[0]) <= apart).any():
                self.passed.append(Passed(float(row[0]), row[1:].copy(), design))

    def on_lanes(self, found: np.ndarray, t: np.ndarray, near: Callable[[int, int], Work]) -> None:
        """What `follow_lanes` found, (FOUND, lanes); t (steps, lanes); `near` gives a workspace at
        the position of a step and a lane.
        """
        greatest = found[GREATEST]
        if found[FAILED].any():
            greatest = np.where(found[FAILED] == 0.0, greatest, -math.inf)
        lane = int(greatest.argmax())
        if greatest[lane] == -math.inf:
            return
        k = int(found[GREATEST_AT, lane])
        least = branch_distance(self.system.runtime(), near(k, lane), 0.0)
        if least < self.least:
            self.least, self.t = least, float(t[k, lane])

    def notes(self, place: Callable[[Passed], str]) -> list[str]:
        """Sentences of the change points; `place` says where one is."""
        if not self.passed:
            return []
        if self.system.batch is not None:
            designs = sorted({one.design for one in self.passed})
            listing = ", ".join(map(str, designs[:NAMED])) + (", …" if designs[NAMED:] else "")
            one = "design goes" if len(designs) == 1 else "designs go"
            return [
                f"{len(designs)} {one} on smoothly through change points, where branches meet: "
                f"{listing}"
            ]
        named = self.passed[:NAMED]
        names = dict.fromkeys(name for one in named for name in self.meeting_at(one))
        listing = "; ".join(place(one) for one in named)
        more = len(self.passed) - NAMED
        listing += f"; and {more} more" if more > 0 else ""
        which = "a change point" if len(self.passed) == 1 else f"{len(self.passed)} change points"
        where = f", in {', '.join(repr(name) for name in names)}" if names else ""
        return [
            f"the motion goes on smoothly through {which}, where branches meet{where}: at {listing}"
        ]

    def meeting_at(self, one: Passed) -> list[str]:
        """Names of the elements whose rows depend on each other at a change point."""
        work = self.system.work(designs=one.design)
        work.q[: self.system.coordinates, 0] = one.q
        return meeting(self.system, work)


def meeting(system: System, work: Work) -> list[str]:
    """Names of the elements whose rows become dependent at a position, those with the
    greatest shares; none of a system that is too large for dense matrices.
    """
    if too_large(system):
        return []
    u, sizes, _ = np.linalg.svd(dense(system, work)[1])
    if not np.isfinite(sizes).all() or not len(sizes):
        return []
    shares: dict[str, float] = {}
    for e, part in zip(system.row_table[0], np.abs(u[:, len(sizes) - 1]), strict=True):
        name = system.owners[int(e)][0].name
        shares[name] = max(shares.get(name, 0.0), float(part))
    top = max(shares.values())
    return [name for name, part in shares.items() if part >= SHARE * top][:ELEMENTS]
