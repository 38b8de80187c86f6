"""All designs of a batch, one a lane; a lane that fails goes the scalar path.

First positions, the grid of the lanes and their path are those of sweeps
(`mbody.analysis.driven.batch_continuation`). The kernel is another one: a batch keeps every row of
all instants as the kernel writes them, with the distance from other branches, a sweep only the rows
that are measured, of all designs in one call. Of 64 four-bars at 361 instants, on one core, a
position takes 163 ns here and 224 ns with all rows by the kernel of sweeps; there it takes 95 ns
with one row.
"""

from __future__ import annotations

import functools
import warnings
import weakref
from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.path_following import PathEnded, Runner, lanes_output
from mbody.analysis.driven.time_grid import TimeGrid
from mbody.analysis.position.assembly_analysis import check_determined, closed, rounding
from mbody.analysis.position.closed_position import ClosedDesigns, ClosedPosition, close_in_stages
from mbody.core.lanes import LANES, aligned
from mbody.core.tolerances import PIVOT_SUSPICIOUS
from mbody.errors import ModelWarning, SolveError
from mbody.kernels.continuation import BY_DRIVER
from mbody.kernels.continuation_lanes import FAILED, Designs, LanePath, follow_designs
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.straight_line.programs import StraightLineCode, straight_line_code
from mbody.system.pivoting import PivotChoices, diagonal_blocks, lane_workspace
from mbody.system.rank import dense
from mbody.system.system import System, too_large

# -- Designs of one topology over equal instants, on lanes -------------------------------------
# Designs go side by side, one a lane. What is shared (the pivots, the pose that all begin from, the
# size by which corrections are judged) comes from the description alone, and a group of lanes holds
# the same designs wherever a batch is cut: so the numbers do not depend on how it is cut.


@dataclass(frozen=True, eq=False)
class BatchSetup:
    """Settings and first position that all designs of a batch share.

    `grid`: The instants.
    `pose` (coordinates + 3,): Closed position of the description at the first instant, from which
      all designs are closed.
    `origin` (parameters,): The numbers of the description, as kernels take them.
    `small`, `position_norm`: Rounding of a closed position, and the greatest coordinate, in model
      lengths and radians.
    `straight`: Whether there are so many designs that straight-line code pays
      (`mbody.straight_line.programs`).
    """

    analysis: str
    grid: TimeGrid
    pose: np.ndarray
    origin: np.ndarray
    small: float
    position_norm: float
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
        runner.position_norm(start, grid),
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
    return close_in_stages(system, float(grid.t[0]), values, pose, origin, small, PIVOT_SUSPICIOUS)


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
    """Rows of all instants: (rows, designs, instants), and which designs can be trusted. `poses`
    (designs, coordinates + 3), `wanted` (rows,).
    """
    runner = Runner(system, setup.analysis)
    grid, kept = with_middle(setup.grid)
    output = np.empty((len(wanted), len(poses), len(grid.s)))
    path = runner.lane_instants(grid, in_all_lanes(grid), setup.position_norm).path
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
    record = aligned(len(wanted) + PER_PRIMITIVE, LANES)
    return Designs(
        par=par, mass=mass, q=q, wanted=wanted, record=record, failed=np.empty(q.shape[1])
    )


def _follow(
    system: System, setup: BatchSetup, path: LanePath, designs: Designs, output: np.ndarray
) -> None:
    """Follow designs by the kernel that serves all topologies: output (rows, designs, instants)."""
    work, numbers = system.work(LANES), lane_workspace(setup.pivots, LANES)
    path_output = lanes_output(output)
    follow_designs(system.layout, *setup.pivots, work, numbers, path, path_output, designs)


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


#: Designs that a note names.
NAMED = 8


def batch(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> Solution:
    """Every design over all instants."""
    system = runner.system
    designs, n = int(system.batch or 0), system.coordinates
    poses = _poses(runner, start, grid)
    simple = runner.fits_lanes(start, grid)
    middled, kept = with_middle(grid)
    instants = runner.lane_instants(
        middled, in_all_lanes(middled), runner.position_norm(start, grid)
    )
    blocks = []
    for low in range(0, designs, LANES):
        chosen = np.minimum(np.arange(low, low + LANES), designs - 1)
        if simple:
            work = system.work(LANES, chosen)
            work.q[:n] = poses[chosen, :n].T
            output, found = runner.on_lanes(work, instants)
            workspace_at = functools.partial(_workspace_at, system, chosen, output)
            runner.branches.on_lanes(found, instants.t, workspace_at)
            output, failed = output[kept], found[FAILED]
        else:
            output, failed = np.empty((len(grid.s), runner.rows, LANES)), np.ones(LANES)
        for lane in np.flatnonzero(failed[: designs - low]):
            design = int(chosen[lane])
            output[:, :, lane] = _scalar_design(
                runner, design, poses[design], start.regularization, grid
            )
        blocks.append(output)
    return runner.solution(start, grid, Record(blocks, designs, batch=True))


def _workspace_at(
    system: System, designs: np.ndarray, output: np.ndarray, k: int, lane: int
) -> Work:
    """A workspace at the position of a step and a lane."""
    work = system.work(designs=int(designs[lane]))
    work.q[: system.coordinates, 0] = output[k, : system.coordinates, lane]
    return work


def _poses(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> np.ndarray:
    """First poses of all designs, closed from that of the first one: (designs, coordinates)."""
    system = runner.system
    designs, time = int(system.batch or 0), float(grid.t[0])
    first = grid.first(system)
    pose = start.work.q[:, 0].copy()
    poses, good = np.tile(pose, (designs, 1)), np.zeros(designs, dtype=bool)
    if not (start.regularization or system.has_user_code or system.has_loops):
        origin = system.par[:, 0].copy()
        found = closed_poses(system, grid, pose, origin, rounding(system, pose))
        poses, good = found.poses, found.good
    elsewhere = []
    for design in np.flatnonzero(~good).tolist():
        try:
            one = closed(system, time, first, None, design, pose)
            check_determined(system, one, runner.analysis)
        except SolveError as error:
            raise _numbered(error, design) from error
        poses[design] = one.work.q[:, 0]
        if not one.straight and not _same_branch(system, start.work, one.work):
            elsewhere.append(str(design))
    if elsewhere:
        which = "1 design is" if len(elsewhere) == 1 else f"{len(elsewhere)} designs are"
        named = ", ".join(elsewhere[:NAMED]) + (", …" if elsewhere[NAMED:] else "")
        note = (
            f"{which} closed on another branch than the first one: {named}; "
            "analyse them alone, with a guess"
        )
        start.notes.append(note)
        warnings.warn(note, ModelWarning, stacklevel=5)
    return poses


def _same_branch(system: System, one: Work, other: Work) -> bool:
    """Whether no Assur group has determinants of different sign at two positions; not where that
    cannot be decided: Φ_q is not square, or too large.
    """
    if system.rows != system.coordinates or too_large(system):
        return False
    first, second = dense(system, one)[1], dense(system, other)[1]
    blocks = diagonal_blocks((first != 0.0) | (second != 0.0))
    if blocks is None:
        return False
    for block in range(blocks.max() + 1):
        group = np.ix_(blocks[0] == block, blocks[1] == block)
        if np.linalg.slogdet(first[group])[0] * np.linalg.slogdet(second[group])[0] <= 0.0:
            return False
    return True


def _scalar_design(
    runner: Runner, design: int, pose: np.ndarray, regularization: float, grid: TimeGrid
) -> np.ndarray:
    """One design on the scalar path: (instants, rows)."""
    start = ClosedPosition(runner.system.work(designs=design), regularization)
    start.work.q[:, 0] = pose
    try:
        return runner.scalar(start, grid, design=design)[:, :, 0]
    except PathEnded as stuck:
        raise _numbered(runner.explain(stuck, start, grid, design), design) from None
    except SolveError as error:
        raise _numbered(error, design) from error


def _numbered(error: SolveError, design: int) -> SolveError:
    return SolveError(f"design {design} of the batch: {error}", error.element)
