"""Many designs of one topology over the same instants: what all share, and the lanes that follow
them.

Designs go side by side, one a lane. What is shared (the pivots, the pose that all begin from, the
size by which corrections are judged) comes from the description alone, and a group of lanes holds
the same designs wherever a batch is cut: so the numbers do not depend on how it is cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.runner import Runner
from mbody.analysis.driven.time_grid import BY_DRIVER, BY_INSTANT, Plan
from mbody.analysis.position.assembly_analysis import SUSPICIOUS, rounding
from mbody.analysis.position.closed_position import Closed
from mbody.compiler.lanes import LANES, aligned
from mbody.kernels.continuation_lanes import (
    FOUND,
    SHARED,
    Designs,
    FollowedLanes,
    follow_designs,
)
from mbody.kernels.loop_closure import close_designs
from mbody.kernels.output import PER_PRIMITIVE
from mbody.system.pivoting import PivotChoices, lane_workspace
from mbody.system.system import System

__all__ = ["Course", "closed_poses", "course_of", "in_all_lanes", "on_lanes", "with_middle"]


@dataclass(frozen=True, eq=False)
class Course:
    """What the designs of a batch share.

    Attributes
    ----------
    analysis : str
    plan : Plan
        The instants.
    pose : array (coordinates + 3,)
        Closed position of the description at the first instant, from which all designs are closed.
    small, reach : float
        Rounding of a closed position, and the greatest coordinate, in model lengths and radians.
    pivots : PivotChoices
    """

    analysis: str
    plan: Plan
    pose: np.ndarray
    small: float
    reach: float
    pivots: PivotChoices


def course_of(runner: Runner, start: Closed, plan: Plan) -> Course | None:
    """The course of a system of one design; None where its designs must go one by one."""
    if start.soft or runner.system.has_user_code or plan.mode == BY_INSTANT:
        return None
    pivots = runner.pivots_along(start, plan)
    if pivots is None:
        return None
    return Course(
        runner.analysis,
        plan,
        start.work.q[:, 0].copy(),
        rounding(runner.system, start.work),
        runner.reach(start, plan),
        pivots,
    )


def closed_poses(
    system: System, plan: Plan, pose: np.ndarray, small: float
) -> tuple[np.ndarray, np.ndarray]:
    """Every design closed at the first instant from one pose, to corrections below `small`:
    (designs, coordinates + 3), and whether it is.
    """
    designs = int(system.batch or 0)
    first = plan.first(system)
    values = np.tile([first.get(d.name, np.nan) for d in system.drivers], (designs, 1))
    poses, state = np.tile(pose, (designs, 1)), np.zeros((designs, 2))
    work = system.work()
    work.time[:] = plan.t[0]
    errors = np.full(designs, small)
    close_designs(system.layout, work, errors, system.par, values, poses, state)
    return poses, (state[:, 0] > 0.0) & (state[:, 1] >= SUSPICIOUS)


def in_all_lanes(plan: Plan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Path parameter, time, and rate and acceleration of the one driver, the same in every lane."""
    s, t = (np.repeat(part[:, None], LANES, axis=1) for part in (plan.s, plan.t))
    if plan.mode != BY_DRIVER:
        return s, t, np.zeros((2, LANES))
    return s, t, np.repeat(plan.given[:, 0, 1:].reshape(-1, 1), LANES, axis=1)


def with_middle(plan: Plan) -> tuple[Plan, np.ndarray]:
    """The plan for lanes, and which of its instants are those of the plan. Between two instants
    there is one more: by two alone no one can tell how the determinants bend.
    """
    if len(plan.s) != 2:
        return plan, np.arange(len(plan.s))
    s = np.array([plan.s[0], plan.s.mean(), plan.s[1]])
    if plan.mode != BY_DRIVER:
        return Plan(plan.mode, s, s, plan.given), np.array([0, 2])
    t = np.array([plan.t[0], plan.t.mean(), plan.t[1]])
    given = np.stack([plan.given[0], plan.given.mean(axis=0), plan.given[1]])
    return Plan(plan.mode, s, t, given), np.array([0, 2])


def on_lanes(
    system: System, course: Course, poses: np.ndarray, wanted: np.ndarray
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
    runner = Runner(system, course.analysis)
    plan, kept = with_middle(course.plan)
    s, t, given = in_all_lanes(plan)
    followed = FollowedLanes(
        output=np.empty((len(wanted), len(poses), len(plan.s))),
        found=aligned(FOUND, LANES),
        shared=np.zeros(SHARED, dtype=np.int64),
    )
    designs = Designs(
        par=system.par,
        mass=system.mass,
        q=np.ascontiguousarray(poses.T),
        wanted=wanted,
        page=aligned(len(wanted) + PER_PRIMITIVE, LANES),
        failed=np.empty(len(poses)),
    )
    follow_designs(
        system.layout,
        *course.pivots,
        system.work(LANES),
        lane_workspace(course.pivots, LANES),
        runner.lane_path(plan.mode, s, t, given, course.reach),
        followed,
        designs,
    )
    output = followed.output
    return (output if len(kept) == len(plan.s) else output[:, :, kept]), designs.failed == 0.0
