"""Many designs of one topology over the same instants: what all share, and the lanes that follow
them.

Designs go side by side, one a lane. What is shared (the pivots, the pose that all begin from, the
size by which corrections are judged) comes from the description alone, and a group of lanes holds
the same designs wherever a batch is cut: so the numbers do not depend on how it is cut.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.runner import Runner, followed_lanes
from mbody.analysis.driven.time_grid import BY_DRIVER, TimeGrid
from mbody.analysis.position.assembly_analysis import SUSPICIOUS, rounding
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.analysis.position.staged_closing import ClosedDesigns, close_in_stages
from mbody.core.lanes import LANES, aligned
from mbody.kernels.continuation_lanes import Designs, LanePath, follow_designs
from mbody.kernels.output import PER_PRIMITIVE
from mbody.straight_line.programs import StraightLineCode, straight_line_code
from mbody.system.pivoting import PivotChoices, lane_workspace
from mbody.system.system import System

__all__ = ["BatchSetup", "closed_poses", "batch_setup", "in_all_lanes", "on_lanes", "with_middle"]


@dataclass(frozen=True, eq=False)
class BatchSetup:
    """What the designs of a batch share.

    Attributes
    ----------
    analysis : str
    grid : TimeGrid
        The instants.
    pose : array (coordinates + 3,)
        Closed position of the description at the first instant, from which all designs are closed.
    origin : array (parameters,)
        The numbers of the description, as kernels take them.
    small, reach : float
        Rounding of a closed position, and the greatest coordinate, in model lengths and radians.
    pivots : PivotChoices
    straight : bool
        Whether there are so many designs that straight-line code pays
        (`mbody.straight_line.programs`).
    """

    analysis: str
    grid: TimeGrid
    pose: np.ndarray
    origin: np.ndarray
    small: float
    reach: float
    pivots: PivotChoices
    straight: bool = False


#: The straight-line code of every setup; machine code is not sent to other machines.
_codes: weakref.WeakKeyDictionary[BatchSetup, StraightLineCode | None] = weakref.WeakKeyDictionary()


def batch_setup(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> BatchSetup | None:
    """The setup of a system of one design; None where its designs must go one by one."""
    if not runner.fits_lanes(start, grid):
        return None
    pivots = runner.pivots_along(start, grid)
    if pivots is None:
        return None
    return BatchSetup(
        runner.analysis,
        grid,
        start.work.q[:, 0].copy(),
        runner.system.par[:, 0].copy(),
        float(rounding(runner.system, start.work.q[:, 0])),
        runner.reach(start, grid),
        pivots,
    )


def closed_poses(
    system: System, grid: TimeGrid, pose: np.ndarray, origin: np.ndarray, small: float
) -> ClosedDesigns:
    """Every design closed at the first instant from the one pose of the numbers `origin`, to
    corrections below `small`; see `close_in_stages`.
    """
    designs = int(system.batch or 0)
    first = grid.first(system)
    values = np.tile([first.get(d.name, np.nan) for d in system.drivers], (designs, 1))
    return close_in_stages(system, float(grid.t[0]), values, pose, origin, small, SUSPICIOUS)


def in_all_lanes(grid: TimeGrid) -> np.ndarray:
    """The instants of a grid, in every lane all of them: (instants, lanes)."""
    return np.repeat(np.arange(len(grid.s))[:, None], LANES, axis=1)


def with_middle(grid: TimeGrid) -> tuple[TimeGrid, slice]:
    """The grid for lanes, and which of its instants are those of the grid. Between two instants
    there is one more: two alone do not show how the determinants bend.
    """
    if len(grid.s) != 2:
        return grid, slice(None)
    s = np.array([grid.s[0], grid.s.mean(), grid.s[1]])
    if grid.mode != BY_DRIVER:
        return TimeGrid(grid.mode, s, s, grid.given), slice(None, None, 2)
    t = np.array([grid.t[0], grid.t.mean(), grid.t[1]])
    given = np.stack([grid.given[0], grid.given.mean(axis=0), grid.given[1]])
    return TimeGrid(grid.mode, s, t, given), slice(None, None, 2)


def on_lanes(
    system: System, setup: BatchSetup, poses: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of all instants: (rows, designs, instants), and which designs can be trusted.

    Parameters
    ----------
    system : System
        A batch.
    poses : array (designs, coordinates + 3)
        First positions.
    wanted : array (rows,)
        Which rows, as `mbody.kernels.output` numbers them.
    """
    runner = Runner(system, setup.analysis)
    grid, kept = with_middle(setup.grid)
    output = np.empty((len(wanted), len(poses), len(grid.s)))
    path = runner.lane_instants(grid, in_all_lanes(grid), setup.reach).path
    q = np.ascontiguousarray(poses.T)
    designs = _designs(system.par, system.mass, q, wanted)
    code = _code(system, setup, path)
    if code is None:
        _follow(system, setup, path, designs, output)
    else:
        code.follow_designs(system.layout, system.work(LANES), path, designs, output)
        _again(system, setup, path, designs, output)
    return output[:, :, kept], designs.failed == 0.0


def _designs(par: np.ndarray, mass: np.ndarray, q: np.ndarray, wanted: np.ndarray) -> Designs:
    page = aligned(len(wanted) + PER_PRIMITIVE, LANES)
    return Designs(par=par, mass=mass, q=q, wanted=wanted, page=page, failed=np.empty(q.shape[1]))


def _follow(
    system: System, setup: BatchSetup, path: LanePath, designs: Designs, output: np.ndarray
) -> None:
    """Follow designs by the kernel that serves all topologies: output (rows, designs, instants)."""
    work, numbers = system.work(LANES), lane_workspace(setup.pivots, LANES)
    followed = followed_lanes(output)
    follow_designs(system.layout, *setup.pivots, work, numbers, path, followed, designs)


def _code(system: System, setup: BatchSetup, path: LanePath) -> StraightLineCode | None:
    """The straight-line code of a setup where it pays, found or made when it is first needed."""
    if not setup.straight:
        return None
    if setup not in _codes:
        work = system.work(LANES)
        _codes[setup] = straight_line_code(system.layout, setup.pivots, path, work)
    return _codes[setup]


def _again(
    system: System, setup: BatchSetup, path: LanePath, designs: Designs, output: np.ndarray
) -> None:
    """Follow the designs that failed once more by the kernel, each with all of its group of lanes,
    so that their numbers do not depend on how a batch is cut.
    """
    failed = np.flatnonzero(designs.failed)
    if not len(failed):
        return
    members = (np.unique(failed // LANES)[:, None] * LANES + np.arange(LANES)).ravel()
    members = members[members < len(designs.failed)]
    numbers = (designs.par, designs.mass, designs.q)
    par, mass, q = (np.ascontiguousarray(rows[:, members]) for rows in numbers)
    fewer = _designs(par, mass, q, designs.wanted)
    found = np.empty((len(output), len(members), output.shape[2]))
    _follow(system, setup, path, fewer, found)
    place = np.searchsorted(members, failed)
    output[:, failed], designs.failed[failed] = found[:, place], fewer.failed[place]
