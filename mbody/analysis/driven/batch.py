"""All designs of a batch, one a lane; a lane that fails goes the scalar path."""

from __future__ import annotations

import numpy as np

from mbody.analysis.driven.lanes import closed_poses, in_all_lanes, with_middle
from mbody.analysis.driven.runner import Runner, Stuck
from mbody.analysis.driven.time_grid import BY_INSTANT, Plan
from mbody.analysis.position.assembly_analysis import check_determined, closed, rounding
from mbody.analysis.position.closed_position import Closed
from mbody.analysis.position.whole_turns import by_springs
from mbody.compiler.lanes import LANES
from mbody.errors import SolveError
from mbody.solution.histories import Record
from mbody.solution.solution import Solution

__all__ = ["batch"]


def batch(runner: Runner, start: Closed, plan: Plan) -> Solution:
    """Every design over all instants.

    Raises
    ------
    SolveError
        Of the first design that cannot be solved, with its number.
    """
    system = runner.system
    designs, n = int(system.batch or 0), system.coordinates
    reach = runner.reach(start, plan)
    poses = _poses(runner, start, plan)
    simple = not (system.has_user_code or start.soft or plan.mode == BY_INSTANT)
    middled, kept = with_middle(plan)
    s, t, given = in_all_lanes(middled)
    blocks = []
    for low in range(0, designs, LANES):
        chosen = np.minimum(np.arange(low, low + LANES), designs - 1)
        if simple:
            work = system.work(LANES, chosen)
            work.q[:n] = poses[chosen, :n].T
            output, bad = runner.march(work, middled, s, t, given, reach)
            runner.branches.on_lanes(output, bad, t, chosen)
            output = output[kept]
        else:
            output, bad = np.empty((len(plan.s), runner.rows, LANES)), np.ones((1, LANES))
        for lane in np.flatnonzero(bad[0, : designs - low]):
            design = int(chosen[lane])
            output[:, :, lane] = _one(runner, design, poses[design], start.soft, plan)
        blocks.append(output)
    return runner.solution(start, plan, Record(blocks, designs, batch=True))


def _poses(runner: Runner, start: Closed, plan: Plan) -> np.ndarray:
    """First poses of all designs, closed from that of the first one: (designs, coordinates)."""
    system = runner.system
    designs, time = int(system.batch or 0), float(plan.t[0])
    first = plan.first(system)
    pose = start.work.q[:, 0].copy()
    poses, good = np.tile(pose, (designs, 1)), np.zeros(designs, dtype=bool)
    if not (start.soft or system.has_user_code):
        poses, good = closed_poses(system, plan, pose, rounding(system, start.work))
    for design in np.flatnonzero(~good):
        try:
            one = closed(system, time, first, None, int(design), pose)
            check_determined(system, one, runner.analysis)
        except SolveError as error:
            raise _numbered(error, int(design)) from error
        poses[design] = one.work.q[:, 0]
    by_springs(system, poses)
    return poses


def _one(runner: Runner, design: int, pose: np.ndarray, soft: float, plan: Plan) -> np.ndarray:
    """One design on the scalar path: (instants, rows)."""
    start = Closed(runner.system.work(designs=design), soft)
    start.work.q[:, 0] = pose
    try:
        return runner.scalar(start, plan, design=design)[:, :, 0]
    except Stuck as stuck:
        raise _numbered(runner.explain(stuck, start, plan, design), design) from None
    except SolveError as error:
        raise _numbered(error, design) from error


def _numbered(error: SolveError, design: int) -> SolveError:
    return SolveError(f"design {design} of the batch: {error}", error.element)
