"""Many designs of one topology over the same instants: what all share, and the lanes that follow
them.

Designs go side by side, one a lane. What is shared (the pivots, the pose that all begin from, the
size by which corrections are judged) comes from the description alone, and a group of lanes holds
the same designs wherever a batch is cut: so the numbers do not depend on how it is cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody._lanes import LANES, aligned
from mbody.analysis.closure import SUSPICIOUS, Closed, rounding
from mbody.analysis.instants import BY_DRIVER, BY_INSTANT, Plan
from mbody.analysis.runner import Runner
from mbody.core.close import close_designs
from mbody.core.march import march_designs
from mbody.core.output import PER_ATOM
from mbody.square import Plans, room
from mbody.system import System

__all__ = ["Course", "closed_poses", "course_of", "on_lanes"]


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
    pivots : Plans
    """

    analysis: str
    plan: Plan
    pose: np.ndarray
    small: float
    reach: float
    pivots: Plans


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


def closed_poses(system: System, course: Course) -> tuple[np.ndarray, np.ndarray]:
    """Every design closed from the course's pose: (designs, coordinates + 3), and whether it is."""
    plan, designs = course.plan, int(system.batch or 0)
    first = plan.first(system)
    values = np.tile([first.get(d.name, np.nan) for d in system.drivers], (designs, 1))
    poses, state = np.tile(course.pose, (designs, 1)), np.zeros((designs, 2))
    work, small = system.work(), np.full(designs, course.small)
    work.time[:] = plan.t[0]
    close_designs(system.layout, work, small, system.par, values, poses, state)
    return poses, (state[:, 0] > 0.0) & (state[:, 1] >= SUSPICIOUS)


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
        Which rows, as `mbody.core.output` numbers them.
    """
    plan, runner = course.plan, Runner(system, course.analysis)
    s, t = (np.repeat(part[:, None], LANES, axis=1) for part in (plan.s, plan.t))
    given = np.zeros((2, LANES))
    if plan.mode == BY_DRIVER:
        given = np.repeat(plan.given[:, 0, 1:].reshape(-1, 1), LANES, axis=1)
    output, bad = np.empty((len(wanted), len(poses), len(plan.s))), np.empty(len(poses))
    march_designs(
        system.layout,
        *course.pivots,
        system.work(LANES),
        *room(course.pivots, LANES),
        plan.mode,
        s,
        t,
        given,
        course.reach,
        runner.loads,
        runner.still,
        system.par,
        system.mass,
        np.ascontiguousarray(poses.T),
        wanted,
        aligned(len(wanted) + PER_ATOM, LANES),
        output,
        bad,
    )
    return output, bad == 0.0
