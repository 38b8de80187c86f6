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

import numpy as np

from mbody.analysis.driven.batch_continuation import closed_poses, in_all_lanes, with_middle
from mbody.analysis.driven.runner import PathEnded, Runner
from mbody.analysis.driven.time_grid import TimeGrid
from mbody.analysis.position.assembly_analysis import check_determined, closed, rounding
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core.lanes import LANES
from mbody.errors import ModelWarning, SolveError
from mbody.kernels.continuation_lanes import FAILED
from mbody.kernels.layout import Work
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.assur_groups import diagonal_blocks
from mbody.system.rank import dense, too_large
from mbody.system.system import System

__all__ = ["batch"]

#: Designs that a note names.
NAMED = 8


def batch(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> Solution:
    """Every design over all instants.

    Raises
    ------
    SolveError
        Of the first design that cannot be solved, with its number.
    """
    system = runner.system
    designs, n = int(system.batch or 0), system.coordinates
    poses = _poses(runner, start, grid)
    simple = runner.fits_lanes(start, grid)
    middled, kept = with_middle(grid)
    instants = runner.lane_instants(middled, in_all_lanes(middled), runner.reach(start, grid))
    blocks = []
    for low in range(0, designs, LANES):
        chosen = np.minimum(np.arange(low, low + LANES), designs - 1)
        if simple:
            work = system.work(LANES, chosen)
            work.q[:n] = poses[chosen, :n].T
            output, found = runner.on_lanes(work, instants)
            near = functools.partial(_near, system, chosen, output)
            runner.branches.on_lanes(found, instants.t, near)
            output, failed = output[kept], found[FAILED]
        else:
            output, failed = np.empty((len(grid.s), runner.rows, LANES)), np.ones(LANES)
        for lane in np.flatnonzero(failed[: designs - low]):
            design = int(chosen[lane])
            output[:, :, lane] = _one(runner, design, poses[design], start.regularization, grid)
        blocks.append(output)
    return runner.solution(start, grid, Record(blocks, designs, batch=True))


def _near(system: System, designs: np.ndarray, output: np.ndarray, k: int, lane: int) -> Work:
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
    if not (start.regularization or system.has_user_code):
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


def _one(
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
