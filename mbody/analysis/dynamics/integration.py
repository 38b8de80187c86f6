"""One motion over time: the kernel's memory, its calls, what comes of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from mbody.analysis.driven.contacts import Held, pulled
from mbody.analysis.driven.diagnosis import (
    adjusted,
    branching,
    stuck,
    undetermined,
    valueless,
    weightless,
)
from mbody.analysis.driven.time_grid import check_reach
from mbody.analysis.driven.uniqueness import open_reactions, told_open
from mbody.analysis.dynamics.branch_passage import BranchWatch
from mbody.analysis.dynamics.initial_step import CORRECTIONS, first_step, sizes
from mbody.analysis.dynamics.integrators import Memory, stepper
from mbody.analysis.position.assembly_analysis import SOFT, raise_user_error
from mbody.analysis.position.vanishing_distances import GONE, vanishing
from mbody.errors import ModelError, SolveError
from mbody.kernels.output import PER_PRIMITIVE
from mbody.kernels.state_derivative import begin
from mbody.kernels.step_state import (
    BRANCH,
    CAREFUL,
    DONE,
    LAST,
    LAST_ONE,
    MET,
    MORE,
    NEXT,
    PROGRESS,
    REJECTED,
    SLOPES,
    STEEP,
    STEPS,
    TANGENTS,
    TIME,
)
from mbody.model.simulation import EVEN
from mbody.solution.certificate import as_said, changed
from mbody.solution.doubts import doubted
from mbody.solution.energy import account, causes
from mbody.solution.event_record import EventRecord
from mbody.solution.histories import Record
from mbody.solution.restart import Restart, Way
from mbody.solution.solution import Solution
from mbody.system.layout import stand_ins
from mbody.system.rank import dense, rank_of, too_large
from mbody.system.system import System

__all__ = ["Course"]

Array = np.ndarray

#: Steps of one call of the kernel; between calls there is progress, and Ctrl-C is heard.
AT_ONCE = 500
#: Of so many steps the mean is judged: what falls below this part of the greatest and of the time
#: in which the motion changes, with so many steps still to go, crawls.
JUDGED, SHRUNK, SLOW, PATIENT = 10_000, 0.1, 1e-4, 300_000


class Course:
    """Integrates one system from a first state."""

    def __init__(self, system: System, start: Solution, way: Way) -> None:
        self.system, self.start, self.way = system, start, way
        self.layout = system.runtime()
        self.work = system.work(masses=True)
        self.soft = start.soft if start.system is system else SOFT * bool(start.soft)
        # a small mass stands where there is none: corrections by the residual take it back
        light = stand_ins(self.layout, system.mass, system.length).any()
        regular = CORRECTIONS if light or self.soft else 0
        self.causes = len(causes(system))
        self.passes = CORRECTIONS
        self.steps = stepper(way.method, self.layout, self.work, way.step)
        n, m = 2 * system.coordinates, self.steps
        self.y, self.state = np.zeros(n), np.zeros(PROGRESS)
        self.K, self.P = np.zeros((m.slopes, n)), np.zeros((m.slopes, self.causes))
        room = np.zeros((m.polynomial, n)), np.zeros((m.polynomial, self.causes))
        self.memory = Memory(
            *(self.layout, self.work, self.soft, regular, self.passes, way.rtol, way.atol),
            *(self.y, self.K, self.P, *room, self.state),
        )
        self.begun = np.zeros(self.causes)
        self.anchor: Restart | None = None
        self.judged, self.longest = (0.0, 0.0), 0.0
        self.occurred: list[EventRecord] = []
        self.stops: list[str] = []

    def run(
        self,
        first: float,
        q: Array,
        v: Array,
        times: Array,
        progress: Callable[[float], None] | None,
        restart: Restart | None = None,
    ) -> Solution:
        """The motion at the times, after `restart` as if it had gone on."""
        self._begin(first, q, v, float(times[-1]))
        code, status = MORE, "completed"
        if restart is not None:
            self._resume(restart)
        try:
            code, status = self._follow(times, progress)
        except KeyboardInterrupt:
            unit = self.system.mechanism.units.time
            status = f"stopped: at t = {self.state[TIME]:.6g} {unit} by the user"
            self._keep_now()
        found = self._solution(status)
        lost = np.flatnonzero(~np.isfinite(found.record.blocks[0][:, :, 0]).all(axis=1))
        if lost.size:  # an instant at which a load has no value, though the steps passed it
            self.state[TIME] = found.t[lost[0]]
            found = found.take(np.arange(lost[0]))
        if lost.size or code not in (DONE, MORE):
            raise self._stopped(found, code)
        return found

    def _begin(self, first: float, q: Array, v: Array, until: float) -> None:
        """The memory of the kernel with the first state, its slope and the first step."""
        n3 = self.system.coordinates
        self.first, self.until = first, until
        self.rows = 3 * n3 + PER_PRIMITIVE * len(self.system.owners)
        self.y[:n3], self.y[n3:] = q, v
        self.page = np.empty((self.rows, 1))
        self.state[TIME] = first
        self.watch = BranchWatch(self.system, bool(self.soft), self.state, until - first)
        if not self._slope():
            raise SolveError(
                f"the start does not fit '{self.system.mechanism.name}': its loops do not close "
                "near it; give a motion of this mechanism, or its own guesses"
            )
        problem = undetermined(self.system, first, self.y[:n3], self.y[n3:])
        problem = problem or weightless(self.system)
        if problem is not None:
            raise problem
        self.notes = adjusted(self.system, np.concatenate([q, v]), self.y, until - first)
        if self.soft:
            self.notes += branching(self.system, first, self.y[:n3], self.y[n3:])
        self._check_slope(self.K, first)
        self.watch.begun = self.y[:n3].copy()
        self.memory.scale = self.scale = sizes(self.system.length, v, self.K[0, n3:])
        first_one = first_step(self.way, self.y, self.K[0], self.scale, until - first)
        self.state[NEXT] = self.way.step or first_one
        self.judged, self.longest = (0.0, first), 0.0

    def _slope(self) -> bool:
        """Project the state, take its slope and its page; whether the loops close."""
        begun = begin(
            *(self.layout, self.work, self.soft, self.passes),
            *(self.y, self.K, self.P, self.page, self.state),
        )
        raise_user_error(self.system)
        return bool(begun)

    def _flow(self, until: float, steps: int, times: Array, output: Array, gained: Array) -> int:
        """At most so many steps; see `mbody.kernels.runge_kutta`."""
        code, left = MORE, steps
        while code == MORE and left > 0:
            done = self.state[STEPS]
            count = 1 if self.watch.open else left
            code = self.steps.steps(self.memory, until, count, times, output, gained)
            left -= max(1, int(self.state[STEPS] - done))
            self.watch.note(self.y)
            self.watch.weigh(self.y)
            if code == BRANCH:
                self.watch.decide(self.y, self.K[0])
                code = MORE
            elif code == LAST:
                if until == self.until:
                    self.anchor = self._anchored(gained[-1])
                self.state[LAST_ONE] = 1.0
                code, left = MORE, left + 1
        raise_user_error(self.system)
        return code

    def _follow(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        """The whole motion, its instants kept: the last code of the kernel, and the status."""
        self.times, self.output = times, np.empty((len(times), self.rows, 1))
        self.gained = np.zeros((len(times) + 1, self.causes))
        self.gained[-1] = self.begun
        if times[0] <= self.first:
            self.output[0], self.state[MET] = self.page, 1.0
        code = MORE
        while code == MORE:
            code = self._flow(self.until, AT_ONCE, times, self.output, self.gained)
            self._judge()
            if progress is not None:
                progress(float(self.state[TIME]))
        return code, "completed"

    def _judge(self) -> None:
        """Refuse to crawl: at loads that jump to and fro steps are cut for ever. Refuse to go on
        where a distance has become zero.
        """
        n, unit = self.system.coordinates, self.system.mechanism.units.time
        gone = vanishing(self.system, self.y[:n], f"t = {self.state[TIME]:.6g} {unit}", GONE)
        if gone is not None:
            gone.solution = self._solution("")
            raise gone
        (count, since), (done, t) = self.judged, (self.state[STEPS], self.state[TIME])
        if done - count < JUDGED:
            return
        mean = float(t - since) / float(done - count)
        self.judged, self.longest = (float(done), float(t)), max(self.longest, mean)
        left = (self.until - t) / max(mean, 1e-300)
        rate = float(np.abs(self.y[n:] / self.scale[:n]).max())
        rate = max(rate, float(np.sqrt(np.abs(self.K[0, n:] / self.scale[:n]).max())))
        if mean < SHRUNK * self.longest and mean * rate < SLOW and left > PATIENT:
            raise SolveError(
                f"the loads jump to and fro at t = {t:.6g} {unit}: the last {JUDGED} steps were "
                f"{mean:.1g} {unit} each, the end would take {left:.1g} more; smooth what jumps, "
                "as dry friction and valves do where rates change their sign",
                solution=self._solution(""),
            )

    # -- restarts -----------------------------------------------------------------------------

    def _anchored(self, gained: Array) -> Restart:
        """All that the next step depends on; `gained` since the beginning."""
        return Restart(
            *(self.way, self.scale.copy(), self.y.copy(), self.K[0].copy(), self.P[0].copy()),
            *(gained.copy(), self.state.copy(), tuple(part.copy() for part in self.steps.own)),
        )

    def _resume(self, restart: Restart) -> None:
        """Take up what was left."""
        self.y[:], self.state[TIME] = restart.y, restart.state[TIME]
        page = self.page.copy()
        self._slope()  # for the distances from singular positions with which the next step begins
        self.page = page
        self.memory.scale = self.scale = restart.scale.copy()
        self.y[:], self.K[0], self.P[0] = restart.y, restart.slope, restart.powers
        self.begun[:], self.state[:] = restart.gained, restart.state
        self.state[MET], self.judged = 0.0, (float(self.state[STEPS]), float(self.state[TIME]))
        for own, part in zip(self.steps.own, restart.own, strict=True):
            own[:] = part

    def _restart(self, gained: Array) -> Restart | None:
        """Where to take up, as seen from the last instant that was kept."""
        if self.anchor is None or not len(gained):
            return None
        return replace(self.anchor, gained=self.anchor.gained - gained[-1, : self.causes])

    def _keep_now(self) -> None:
        """Keep the instant that a motion has come to, to go on from there."""
        if not self.state[STEPS]:
            return
        self.anchor = self._anchored(self.gained[-1])
        met, done = int(self.state[MET]), self.gained[-1].copy()
        self._slope()
        if met and self.times[met - 1] == self.state[TIME]:
            met -= 1
        self.times = np.append(self.times[:met], self.state[TIME])
        self.output = np.concatenate([self.output[:met], self.page[None]])
        self.gained = np.concatenate([self.gained[:met], done[None]])
        self.state[MET] = met + 1

    def _kept(self) -> tuple[Array, Array, Array]:
        """Times, pages and work of the instants that are met."""
        met = int(self.state[MET])
        return self.times[:met], self.output[:met], self.gained[:met]

    def _check_slope(self, K: Array, t: float) -> None:
        if np.isfinite(K[0]).all():
            return
        n = self.system.coordinates
        raise valueless(self.system, self.work, t, self.y[:n], self.y[n:])

    def _stopped(self, found: Solution, code: int) -> SolveError:
        """The sentence of a motion that cannot be followed."""
        state = self.state
        unit = self.system.mechanism.units.time
        t = float(state[TIME])
        when = f"t = {t:.6g} {unit}"
        if code == STEEP:
            left = (self.until - t) / state[NEXT]
            return SolveError(
                f"the loads are too stiff for explicit steps: at {when} the step has shrunk to "
                f"{state[NEXT]:.2g} {unit}, the end would take {left:.1g} more; ask for the "
                "method 'radau5'",
                solution=found,
            )
        beyond = np.array([t + part * max(t, 1e-6) for part in (0.0, 1e-9, 1e-6, 1e-3)])
        try:
            check_reach(self.system, beyond, {})
        except ModelError as error:
            why = f"the motion ends at {when}: {error}"
            return SolveError(why, error.element, found)
        q = self.y[: self.system.coordinates]
        reason = vanishing(self.system, q, when) or stuck(self.system, t, q)
        if reason is not None:
            reason.solution = found
            return reason
        if self.way.method in EVEN:
            return SolveError(
                f"the equations of a step of '{self.way.method}' have no solution at {when}: "
                f"{self.way.step:g} {unit} is too long there, or the loads jump or grow without "
                "bound; take shorter steps, or the method 'dop853'",
                solution=found,
            )
        return SolveError(
            f"the steps vanish at {when}: the loads jump there, grow without bound, or are too "
            "stiff; smooth them, or ask for less accuracy",
            solution=found,
        )

    def _solution(self, status: str) -> Solution:
        n, state = self.system.coordinates, self.state
        times, output, gained = self._kept()
        stats = {
            "steps": int(state[STEPS]),
            "rejected": int(state[REJECTED]),
            "careful": int(state[CAREFUL]),
            "evaluations": int(state[SLOPES]),
        }
        if state[TANGENTS]:
            stats["tangents"] = int(state[TANGENTS])
        found = Solution(
            system=self.system,
            analysis="simulate",
            t=times,
            record=Record([output], len(times), batch=False),
            given=None,
            soft=self.soft,
            dependencies=self._dependencies(output[:, :n, 0]),
            notes=as_said(self.start).notes if self.start.analysis == "close_loops" else (),
            status=status,
            stats=stats,
            energy=account(self.system, output[:, : 2 * n, 0], gained, self.stops),
            events=tuple(self.occurred),
            restart=self._restart(gained),
        )
        last = float(times[-1]) if len(times) else self.first
        notes = (*as_said(found).notes, *self.notes, *self.watch.notes(last))
        notes += tuple(pulled(found, self._between()))
        if self.soft:
            notes += told_open(found.dependencies)
        found = changed(found, notes=notes, branch=self.watch.least(last))
        return doubted(found, self.watch.doubts)

    def _between(self) -> Mapping[str, Held] | None:
        """Forces of contacts and ropes between the instants that are kept."""
        return None

    def _dependencies(self, q: Array) -> dict[str, list[bool]] | None:
        """What redundant rows leave open, at the one of some positions (instants, coordinates) at
        which they are fewest: a singular position has more of them.
        """
        if not self.soft or too_large(self.system) or not len(q):
            return None
        work, reports = self.system.work(), []
        for k in {0, len(q) // 2, len(q) - 1}:
            work.q[: q.shape[1], 0] = q[k]
            G = dense(self.system, work)[1]
            if np.isfinite(G).all():
                reports.append(rank_of(G))
        best = min(reports, key=lambda report: report.redundant, default=None)
        return open_reactions(self.system, best)
