"""Follow a motion through all instants: on lanes where there are many, else step by step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbody._lanes import LANES
from mbody.analysis.closure import (
    SUSPICIOUS,
    TOLERANCE,
    Closed,
    as_system,
    check_determined,
    closed,
    drivers,
    raise_user_error,
    smallest_ratio,
)
from mbody.analysis.instants import BY_DRIVER, BY_INSTANT, BY_TIME, Plan, check_laws, plan
from mbody.analysis.uniqueness import open_reactions
from mbody.core.close import close_designs
from mbody.core.follow import DONE, STUCK, follow
from mbody.core.march import march
from mbody.core.output import PER_ATOM
from mbody.errors import SolveError
from mbody.mechanism import Mechanism
from mbody.solution import Record, Solution
from mbody.system import System

__all__ = ["sweep"]

#: Instants from which lanes pay for their seeds.
MANY = 6 * LANES
#: Lanes must meet within this, in model lengths and radians.
SEAM = 1e-8
#: Unbalanced part of the loads above which there is no equilibrium.
UNBALANCED = 1e-7


def sweep(
    model: Mechanism | System,
    analysis: str,
    t: Any,
    drive: Mapping[str, Any] | None,
    turn: str | bool | None,
    instants: int | None,
    guess: Mapping[str, Any] | None,
) -> Solution:
    """Close the loops at the first instant and follow the motion through all of them."""
    system = as_system(model)
    asked = plan(system, t, drive, turn, instants)
    runner = _Runner(system, asked, analysis)
    names = [driver.name for driver in system.mechanism.drivers]
    first = {} if asked.mode == BY_TIME else dict(zip(names, asked.given[0, :, 0], strict=True))
    start = closed(system, float(asked.t[0]), first, guess)
    if system.batch is not None:
        return runner.batch(start, first)
    check_determined(system, start, analysis)
    return runner.single(start)


class _Runner:
    def __init__(self, system: System, asked: Plan, analysis: str) -> None:
        self.system, self.plan, self.analysis = system, asked, analysis
        self.loads = analysis != "kinematics"
        self.still = analysis == "statics"
        self.layout = system.runtime()
        self.rows = 3 * system.coordinates + PER_ATOM * len(system.owners)

    def single(self, start: Closed) -> Solution:
        count = len(self.plan.s)
        reach = self._reach(start)
        block = None
        if count >= MANY and not (
            start.soft or self.system.has_user_code or self.plan.mode == BY_INSTANT
        ):
            block = self._lanes(start, reach)
        if block is None:
            block = self._follow(start, reach, np.arange(count))
        record = Record([block], count, batch=False)
        return self._solution(start, record)

    def _solution(self, start: Closed, record: Record) -> Solution:
        given = None if self.plan.mode == BY_TIME else self.plan.given
        dependencies = open_reactions(self.system, start.mobility) if start.soft else None
        notes = list(start.notes)
        if start.soft and self.loads and dependencies is None:
            notes.append("rows are redundant; which reactions are unique was not looked at")
        return Solution(
            system=self.system,
            analysis=self.analysis,
            t=self.plan.t,
            record=record,
            given=given,
            soft=start.soft,
            dependencies=dependencies,
            notes=tuple(notes),
        )

    def _reach(self, start: Closed) -> float:
        q = start.work.q[: self.system.coordinates, 0].reshape(-1, 3)
        turned = np.abs(self.plan.s).max() if self.plan.mode == BY_DRIVER else 0.0
        size = np.abs(q[:, :2]).max() / self.system.length
        return float(1.0 + max(size, np.abs(q[:, 2]).max(), turned))

    def _follow(
        self, start: Closed, reach: float, at: np.ndarray, *, loads: bool | None = None
    ) -> np.ndarray:
        """Instants `at` on the scalar path: (instants, rows, 1); leaves `start` where it was."""
        asked = self.plan
        q = start.work.q.copy()
        output = np.empty((len(at), self.rows, 1))
        state = np.zeros(6)
        state[5] = reach
        given = asked.given if asked.mode == BY_TIME else np.ascontiguousarray(asked.given[at])
        chords = np.zeros((1, 1)) if asked.mode != BY_INSTANT else asked.chords
        s = np.ascontiguousarray(asked.s[at])
        times = np.ascontiguousarray(asked.t[at])
        with_loads = self.loads if loads is None else loads
        code = follow(
            self.layout,
            start.work,
            start.soft,
            asked.mode,
            s,
            times,
            given,
            chords,
            with_loads,
            self.still,
            output,
            state,
        )
        if code != DONE:
            self._explain(code, state, start, output)
        if with_loads and not state[4] < UNBALANCED:
            self._explain_balance(state[4])
        start.work.q[:] = q
        return output

    def _lanes(self, start: Closed, reach: float) -> np.ndarray | None:
        """All instants on lanes: (steps, rows, lanes), or None where a lane cannot be trusted."""
        count = len(self.plan.s)
        steps = -(-count // LANES)
        index = np.minimum(
            steps * np.arange(LANES)[None, :] + np.arange(steps + 1)[:, None], count - 1
        )
        seeds = self._follow(start, reach, index[0], loads=False)[:, :, 0]
        n = self.system.coordinates
        work = self.system.work(LANES)
        work.q[:n] = seeds[:, :n].T
        output = np.empty((steps + 1, self.rows, LANES))
        bad = np.zeros((1, LANES))
        given = np.zeros((2, LANES))
        if self.plan.mode == BY_DRIVER:
            rates = self.plan.given[index, 0, 1:]
            given = np.ascontiguousarray(rates.transpose(0, 2, 1)).reshape(-1, LANES)
        s = np.ascontiguousarray(self.plan.s[index])
        t = np.ascontiguousarray(self.plan.t[index])
        mode, soft = self.plan.mode, start.soft
        march(
            self.layout, work, soft, mode, s, t, given, reach, self.loads, self.still, output, bad
        )
        gap = np.abs(output[-1, :n, :-1] - seeds[1:, :n].T)
        gap.reshape(-1, 3, LANES - 1)[:, :2] /= self.system.length
        if bad.any() or not gap.max() <= SEAM * reach:
            return None
        return output

    def batch(self, start: Closed, first: Mapping[str, float]) -> Solution:
        """All designs of a batch, one a lane; a lane that fails goes the scalar path."""
        system = self.system
        designs = int(system.batch or 0)
        n, steps = system.coordinates, len(self.plan.s)
        reach = self._reach(start)
        poses = self._close_designs(start, first)
        simple = not (system.has_user_code or start.soft or self.plan.mode == BY_INSTANT)
        blocks = []
        for low in range(0, designs, LANES):
            chosen = np.minimum(np.arange(low, low + LANES), designs - 1)
            output = np.empty((steps, self.rows, LANES))
            bad = np.ones((1, LANES))
            if simple:
                work = system.work(LANES, chosen)
                work.q[:n] = poses[chosen, :n].T
                self._march_designs(work, reach, output, bad)
            for lane in np.flatnonzero(bad[0, : designs - low]):
                design = int(chosen[lane])
                output[:, :, lane] = self._one_design(design, poses[design], start.soft, reach)
            blocks.append(output)
        return self._solution(start, Record(blocks, designs, batch=True))

    def _close_designs(self, start: Closed, first: Mapping[str, float]) -> np.ndarray:
        """First poses of all designs, from that of the first one: (designs, coordinates)."""
        system = self.system
        designs = int(system.batch or 0)
        values = np.array([first.get(d.name, np.nan) for d in system.mechanism.drivers])
        pose = start.work.q[:, 0].copy()
        poses, state = np.empty((designs, len(pose))), np.zeros((designs, 2))
        work = system.work()
        work.time[:] = self.plan.t[0]
        if start.soft or system.has_user_code:
            state[:, 0] = 0.0
        else:
            close_designs(self.layout, work, TOLERANCE, system.par, values, pose, poses, state)
        for design in np.flatnonzero((state[:, 0] == 0.0) | (state[:, 1] < SUSPICIOUS)):
            try:
                one = closed(system, float(self.plan.t[0]), first, None, int(design), pose)
                check_determined(system, one, self.analysis)
            except SolveError as error:
                raise SolveError(f"design {design} of the batch: {error}", error.element) from error
            poses[design] = one.work.q[:, 0]
        return poses

    def _march_designs(self, work: Any, reach: float, output: np.ndarray, bad: np.ndarray) -> None:
        asked = self.plan
        s, t = (np.repeat(part[:, None], LANES, axis=1) for part in (asked.s, asked.t))
        given = np.zeros((2, LANES))
        if asked.mode == BY_DRIVER:
            given = np.repeat(asked.given[:, 0, 1:].reshape(-1, 1), LANES, axis=1)
        march(
            self.layout, work, 0.0, asked.mode, s, t, given, reach, self.loads, self.still,
            output, bad,
        )  # fmt: skip

    def _one_design(self, design: int, pose: np.ndarray, soft: float, reach: float) -> np.ndarray:
        """One design on the scalar path: (instants, rows)."""
        start = Closed(self.system.work(designs=design), soft)
        start.work.q[:, 0] = pose
        try:
            return self._follow(start, reach, np.arange(len(self.plan.s)))[:, :, 0]
        except SolveError as error:
            raise SolveError(f"design {design} of the batch: {error}", error.element) from error

    def _explain(self, code: int, state: np.ndarray, start: Closed, output: np.ndarray) -> None:
        """Say why the path ended: a user's function, a law, a dead centre."""
        system = self.system
        raise_user_error(system)
        done = int(state[0])
        if self.plan.mode == BY_TIME:
            check_laws(system, self.plan.t)
        so_far = None
        if done and system.batch is None:
            record = Record([output[:done]], done, batch=False)
            so_far = replace(self._solution(start, record), t=self.plan.t[:done], status="stopped")
        driver, row = drivers(system)[0]
        work = start.work
        where = float(work.q0[3 * system.bodies[driver.bodies[1]] + 2, 0])
        at_time = f", t = {state[1]:.6g}" if self.plan.mode == BY_TIME else ""
        if code == STUCK and (smallest_ratio(system, work) < 1e-4 or driver.rows == "a"):
            rates = np.abs(work.q0_s[2 : system.coordinates : 3, 0])
            rates[system.bodies[driver.bodies[1]]] = 0.0
            fastest = system.mechanism.bodies[int(rates.argmax())].name
            raise SolveError(
                f"dead centre at {np.degrees(where):.4g} deg of '{driver.bodies[1]}'{at_time}: "
                f"driver '{driver.name}' cannot drive it any further; drive '{fastest}', or stop "
                "before",
                driver.name,
                so_far,
            )
        raise SolveError(
            f"the motion of '{system.mechanism.name}' cannot be followed beyond "
            f"{np.degrees(where):.4g} deg of '{driver.bodies[1]}'{at_time}: does a law jump there?",
            driver.name,
            so_far,
        )

    def _explain_balance(self, rest: float) -> None:
        raise SolveError(
            f"reactions leave {rest:.2g} of the loads of '{self.system.mechanism.name}' "
            "unbalanced: its position is singular, or it can still move"
        )
