"""Close the loops at the first instant and follow the motion through all of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.analysis.batch import batch
from mbody.analysis.change_points import through_change_points
from mbody.analysis.closure import Closed, as_system, check_determined, closed
from mbody.analysis.dead_centres import DeadCentre, with_ends
from mbody.analysis.instants import Plan, plan
from mbody.analysis.runner import Runner, Stuck
from mbody.certify import as_said
from mbody.errors import SolveError
from mbody.histories import Record
from mbody.mechanism import Mechanism
from mbody.solution import Solution
from mbody.system import System

__all__ = ["driven"]


def driven(
    model: Mechanism | System,
    analysis: str,
    t: Any,
    drive: Mapping[str, Any] | None,
    turn: str | bool | None,
    instants: int | None,
    guess: Mapping[str, Any] | None,
    before: int = 0,
) -> Solution:
    """Run a driven analysis: on lanes where there are many instants, else step by step. The first
    so many instants `before` those that are asked for lead there, and are left out.
    """
    system = as_system(model)
    asked = plan(system, t, drive, turn, instants)
    runner = Runner(system, analysis)
    start = closed(system, float(asked.t[0]), asked.first(system), guess)
    found = _followed(runner, start, asked)
    if before:
        found = found.take(np.arange(before, len(found)))
    pulling = runner.pulled(start, asked, found)
    if pulling:
        object.__setattr__(found, "notes", (*as_said(found).notes, *pulling))
    return found


def _followed(runner: Runner, start: Closed, asked: Plan) -> Solution:
    """The motion at all instants of the plan."""
    system = runner.system
    if system.batch is not None:
        return batch(runner, start, asked)
    try:
        check_determined(system, start, runner.analysis)
    except SolveError as error:
        return through_change_points(runner, start, asked, {0}, error)
    try:
        return _single(runner, start, asked)
    except DeadCentre as stop:
        raise with_ends(stop, system, start) from None


def _single(runner: Runner, start: Closed, asked: Plan) -> Solution:
    block = runner.lanes(start, asked)
    if block is None:
        try:
            block = runner.scalar(start, asked)
        except Stuck as stuck:
            error = runner.explain(stuck, start, asked)
            # an instant at which branches meet is reached as a limit, where the path goes on
            near = abs(stuck.place - asked.s[stuck.done]) <= 1e-3 * np.ptp(asked.s)
            if not near:
                raise error from None
            return through_change_points(runner, start, asked, {stuck.done}, error)
    return runner.solution(start, asked, Record([block], len(asked.s), batch=False))
