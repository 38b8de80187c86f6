"""A single motion cut into pieces of equal length, one a lane, with the memory that a call needs.

Pieces begin at positions of the same motion that are found by large steps on the scalar path; the
last instant of a piece is the first of the next one, where they must meet. Of some thousand
instants the arrays and tables around the kernels took as long to make as the kernels ran: they are
kept, and a call borrows them, so that threads do not share them.
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from mbody.analysis.driven.own_machine_code import own_motion_call
from mbody.analysis.driven.time_grid import BY_DRIVER, TimeGrid
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core.lanes import LANES
from mbody.kernels.continuation import DONE, PROGRESS, DrivenPath, FollowedPath, follow
from mbody.kernels.layout import Work
from mbody.straight_line.lane_instants import LaneInstants
from mbody.straight_line.programs import MotionCall
from mbody.system.pivoting import PivotChoices
from mbody.system.system import System

__all__ = ["MANY", "MotionPieces", "borrowed_pieces", "instants_on_lanes"]

#: Instants from which lanes pay for their first positions.
MANY = 6 * LANES
#: Kinds of motion of a system of which the memory is kept, the last ones.
KEPT = 4
#: Instants up to which it is kept: beside longer motions it takes no time to make.
LONGEST = 50_000


class MotionPieces:
    """The memory of one call, for all motions of a system that have as many instants and reach as
    far.

    Attributes
    ----------
    index : array (steps, lanes)
        Which instant every lane takes at every step; the last step is the next lane's first.
    instants : LaneInstants
        What the drivers prescribe at them.
    seeds : array (coordinates, lanes)
        First positions of all lanes.
    """

    def __init__(
        self, system: System, grid: TimeGrid, reach: float, with_forces: bool, at_rest: bool
    ) -> None:
        # not the system itself: it is freed when nobody else has it
        self._layout = system.runtime()
        self.index = _pieces(len(grid.s))
        self.instants = instants_on_lanes(grid, self.index, reach, with_forces, at_rest)
        first = grid.take(self.index[0])
        self._path = DrivenPath(
            mode=grid.mode,
            s=first.s,
            t=first.t,
            given=first.given,
            chords=np.zeros((1, 1)),
            with_forces=False,
            at_rest=at_rest,
            monitored=False,
            regularization=0.0,
            reach=reach,
        )
        rows, n = system.page_rows, system.coordinates
        self._followed = FollowedPath(
            output=np.empty((LANES, rows, 1)),
            progress=np.zeros(PROGRESS),
            nearest=np.zeros(3),
            passed=np.empty((1, 1 + n)),
        )
        self.seeds = self._followed.output[:, :n, 0].T
        self._near = system.work()
        self._lengths = 1.0 / system.coordinate_units[:, None]
        self._own: MotionCall | None = None
        self._tried = False

    def take(self, grid: TimeGrid) -> None:
        """Take the numbers of another grid of the same kind."""
        first, s, t = self.index[0], self.instants.s, self.instants.t
        for all_of_them, lanes, seeds in ((grid.s, s, self._path.s), (grid.t, t, self._path.t)):
            all_of_them.take(self.index, out=lanes, mode="clip")
            all_of_them.take(first, out=seeds, mode="clip")
            if grid.t is grid.s and t is s and self._path.t is self._path.s:
                break
        if grid.mode == BY_DRIVER:
            self.instants.given[:] = _rates(grid, self.index)
            self._path.given[:] = grid.given[first]

    def find_seeds(self, start: ClosedPosition) -> bool:
        """Find the first positions of all lanes, on a branch that is likely; False where the path
        ends.
        """
        q = start.work.q.copy()
        self._followed.progress[:] = 0.0
        code = follow(self._layout, start.work, self._path, self._followed)
        start.work.q[:] = q
        return bool(code == DONE)

    def own_code(self, system: System, pivots: PivotChoices) -> MotionCall | None:
        """The machine code of the system for this kind of motion, where it has one."""
        if system.machine_code and not self._tried:
            work = system.work(LANES)
            self._own = own_motion_call(system, pivots, work, self.instants, joined=True)
            self._tried = True
        if self._own is not None:
            self._own.q[: len(self.seeds)] = self.seeds
        return self._own

    def gap(self, ends: np.ndarray) -> float:
        """How far the ends of pieces, (rows, lanes), are from where the next ones begin, in model
        lengths and radians.
        """
        apart = ends[: len(self.seeds), :-1] - self.seeds[:, 1:]
        apart *= self._lengths
        return float(np.abs(apart, out=apart).max())

    def near(self, output: np.ndarray, ends: np.ndarray, k: int, lane: int) -> Work:
        """A workspace at the position of a step and a lane, of (steps, rows, lanes) without the
        last step and of that, (rows, lanes).
        """
        n = len(self.seeds)
        found = ends[:n, lane] if k == len(output) else output[k, :n, lane]
        self._near.q[:n, 0] = found
        return self._near


#: Memory that is not in use, by system and kind of motion.
_idle: weakref.WeakKeyDictionary[System, dict[Hashable, list[MotionPieces]]] = (
    weakref.WeakKeyDictionary()
)


@contextmanager
def borrowed_pieces(
    system: System, grid: TimeGrid, reach: float, with_forces: bool, at_rest: bool
) -> Iterator[MotionPieces]:
    """The pieces of a motion for one call."""
    kinds = _idle.setdefault(system, {})
    key = grid.mode, len(grid.s), reach, with_forces, at_rest
    idle = kinds.get(key)
    if idle is None:
        # of a list, which is made at once: other threads may keep others meanwhile
        for old in list(kinds)[: max(len(kinds) - KEPT + 1, 0)]:
            kinds.pop(old, None)
        idle = kinds[key] = []
    try:
        pieces = idle.pop()
        pieces.take(grid)
    except IndexError:
        pieces = MotionPieces(system, grid, reach, with_forces, at_rest)
    yield pieces
    if len(grid.s) <= LONGEST:
        idle.append(pieces)


def instants_on_lanes(
    grid: TimeGrid, index: np.ndarray, reach: float, with_forces: bool, at_rest: bool
) -> LaneInstants:
    """What the drivers prescribe in every lane, by the instants of the grid that it takes: (steps,
    lanes).
    """
    given = np.zeros((2, LANES))
    if grid.mode == BY_DRIVER:
        given = np.ascontiguousarray(_rates(grid, index))
    s = grid.s.take(index)
    t = s if grid.t is grid.s else grid.t.take(index)
    return LaneInstants(
        mode=grid.mode,
        s=s,
        t=t,
        given=given,
        reach=reach,
        with_forces=with_forces,
        at_rest=at_rest,
    )


def _rates(grid: TimeGrid, index: np.ndarray) -> Any:
    """Rate and acceleration of the one driver: (2·steps, lanes)."""
    rates = grid.given[index, 0, 1:]
    return rates.transpose(0, 2, 1).reshape(-1, index.shape[1])


@functools.lru_cache(maxsize=16)
def _pieces(count: int) -> np.ndarray:
    """Which instant every lane takes at every step."""
    steps = -(-count // LANES)
    index = steps * np.arange(LANES)[None, :] + np.arange(steps + 1)[:, None]
    return np.minimum(index, count - 1)
