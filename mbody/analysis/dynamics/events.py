"""Motion over time with events: zero crossings are located.

Every step is sampled by its polynomial, values and rates; where a sample has another sign than the
one before, or a cubic between two of them reaches beyond zero, the step is run again from its
beginning to trial times until the crossing is closed in.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from mbody.analysis.driven.contacts import OneSidedForce, one_sided, one_sided_force
from mbody.analysis.dynamics.integration import AT_ONCE, Integration
from mbody.analysis.dynamics.located import Guard, LocatedZero, Saved
from mbody.analysis.dynamics.measured_events import has_exact_rates, motion_at, rates, values
from mbody.analysis.dynamics.zero_crossings import (
    bracketed_root,
    may_be_zero,
    refined,
    sign_changes,
)
from mbody.analysis.initial.initial_state import event_measure
from mbody.kernels.step_state import (
    DELIVERED,
    DONE,
    EVALUATIONS,
    MORE,
    NEXT,
    TIME,
    Outputs,
)
from mbody.model.event import Event
from mbody.solution.event_record import EventRecord
from mbody.solution.histories import Record
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["OF_A_STEP", "EventIntegration"]

Array = np.ndarray

#: Samples of a step, and of the whole motion, at least.
OF_A_STEP, OF_ALL = 4, 400
#: Where these do not resolve what is watched they become so many times more, up to so many a step,
#: which is made shorter then.
FINER, MOST_OF_A_STEP = 4, 4**8
#: Where a rate follows from two samples only: how far the second sample is, as a part of the time
#: between samples.
BESIDE = 1e-4
#: What is noted of contacts and ropes.
FORCES = tuple(part.name for part in fields(OneSidedForce))
#: A crossing is located to this part of its step. The instants of what is zero together, as a rate
#: and the sliding that it reverses, differ by no more than the second part.
LOCATED, TOGETHER = 1e-12, 1e-11
#: Rounding of times.
ROUNDING = 1e-15


class EventIntegration(Integration):
    """Integrates one system and locates events."""

    def __init__(
        self, system: System, start: Solution, way: Way, events: tuple[Event, ...]
    ) -> None:
        super().__init__(system, start, way)
        self.events = list(events)
        self.measures = [event_measure(system.mechanism, event) for event in self.events]
        #: What each of `stops` has gained by impacts, below zero.
        self.lost = np.zeros(len(self.stops))
        self.total = np.zeros(self.causes)
        carried = [has_exact_rates(measure) for measure in self.measures]
        self.carried = np.array(carried, dtype=bool)
        #: What is located besides, as guards of contacts are: see `_watched`.
        self.guards: list[Guard] = []
        self.sided = one_sided(system)
        self.forces: dict[str, list[OneSidedForce]] = {one.name: [] for one in self.sided}

    # -- the motion ---------------------------------------------------------------------------

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        self.wanted, self.instants = times, list[float]()
        self.pages, self.works = list[Array](), list[Array]()
        if times[0] <= self.first:
            self._keep(self.first, self.page, self.total)
        self.total = self.initial_work.copy()
        self._begin()
        code, status = MORE, ""
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return (MORE if status else code), status or "completed"

    def _begin(self) -> None:
        """Before the first step, the first instant being kept."""

    def _kept(self) -> tuple[Array, Array, Array]:
        count = len(self.instants)
        return (
            np.array(self.instants),
            np.array(self.pages).reshape(count, self.rows, 1),
            np.array(self.works).reshape(count, self.causes + len(self.stops)),
        )

    def _keep_now(self) -> None:
        if self.instants:
            self.restart_point = None if self.stops else self._restart_state(self.total)
            self._keep(float(self.state[TIME]), self.page, self.total)

    def _keep(self, t: float, page: Array, work: Array) -> None:
        """Keep an instant; once, the last state of it."""
        if self.instants and self.instants[-1] == t:
            for kept in (self.instants, self.pages, self.works):
                kept.pop()
        self.instants.append(t)
        self.pages.append(page.copy())
        self.works.append(np.concatenate([work, self.lost]))

    def _save(self) -> Saved:
        parts = (self.y, self.K[0], self.P[0], self.state, self.page, self.total, self.work.near)
        y, K, P, state, page, total, near = (part.copy() for part in parts)
        own = tuple(part.copy() for part in self.steps.own)
        return Saved(y, K, P, state, page, total, near, own, self.passage.known)

    def _restore(self, saved: Saved) -> None:
        """Go back, or ahead; the count of evaluations goes on."""
        evaluations = self.state[EVALUATIONS]
        self.y[:], self.K[0], self.P[0], self.state[:] = saved.y, saved.K, saved.P, saved.state
        self.page, self.total = saved.page.copy(), saved.total.copy()
        self.work.near[:], self.passage.known = saved.near, saved.passage
        for part, was in zip(self.steps.own, saved.own, strict=True):
            part[:] = was
        self.state[EVALUATIONS] = evaluations

    def _run(self, until: float, steps: int, times: Array) -> tuple[int, Array, Array]:
        """Steps of the kernel: its code, pages and work at the times."""
        output = np.empty((len(times), self.rows, 1))
        work_done = np.zeros((len(times) + 1, self.causes))
        work_done[-1], self.state[DELIVERED] = self.total, 0.0
        outputs = Outputs(times=times, pages=output, work=work_done)
        code = self._advance(until, steps, outputs)
        self.total = work_done[-1].copy()
        return code, output, work_done

    def _step(self) -> tuple[int, str]:
        """One step, or one that was refused: the code of the kernel, and the status at an end."""
        state = self.state
        t = float(state[TIME])
        if t >= self.until:
            return DONE, ""
        if t >= self.target and (t := self._pass_set_time(t)) >= self.until:
            return DONE, ""
        saved, h = self._save(), float(state[NEXT])
        end = t + h
        if end >= self.target - self.steps.slack(self.target):  # as the kernel clips it
            h, end = self.target - t, self.target
        self.step = (t, end)
        first, last = np.searchsorted(self.wanted, [t, end], side="right")
        wanted = self.wanted[first:last]
        count = self._sample_count(h)
        while True:
            times = self._sample_times(t, h, count, wanted)
            times = np.append(t, np.unique(np.append(times[(times > t) & (times < end)], end)))
            marks = np.union1d(self._marks(times[1:], times), wanted)
            code, pages, work_done = self._run(self.target, 1, marks)
            if state[TIME] == t:
                return code, ""
            self.page = pages[-1].copy()
            after = self._save()
            found, rising = self._sampled(
                times, np.append(t, marks), np.concatenate([saved.page[None], pages])
            )
            if self._resolved(times, found, rising):
                break
            self._restore(saved)
            count *= FINER
            if count > MOST_OF_A_STEP:
                state[NEXT] = h / FINER**2
                return MORE, ""
        crossings = self._crossings(saved, times, found, rising)
        together = max(TOGETHER * (end - t), ROUNDING * abs(end))
        cut = _first_end(crossings, together)
        self._record_forces(np.append(t, marks), np.concatenate([saved.page[None], pages]), cut)
        for n in np.flatnonzero(np.isin(marks, wanted)):
            if cut is None or marks[n] <= cut.t:
                self._keep(float(marks[n]), pages[n], work_done[n])
        for one in crossings:
            if one.t <= self.first:  # reported by the motion that this one continues
                continue
            late = cut is not None and (one is cut or one.t > cut.t + together)
            if late or isinstance(one.event, Guard):
                continue
            if not self._is_known(one.event, one.t, together):
                self._record(one.event, one.t, one.saved.page)
        if cut is None:
            self._restore(after)
            return code, ""
        self._restore(cut.saved)
        state[NEXT] = min(state[NEXT], h)
        if isinstance(cut.event, Guard):
            return MORE, self._passed(cut.event)
        self._record(cut.event, cut.t, self.page)
        return MORE, self._ended(f"'{cut.event.of}' is zero")

    def _is_known(self, event: Event, t: float, together: float) -> bool:
        """Whether a crossing was recorded beside the change of modes that ended the last step."""
        own = (one for one in self.occurred if one.name == event.name and not one.contact)
        return any(abs(one.t - t) <= together for one in own)

    def _pass_set_time(self, t: float) -> float:
        """Do what is due at a set time, or just after it where rates of drivers jump; the time from
        which it goes on.
        """
        self._interrupt(t)
        now = float(self.state[TIME])
        if now > t and now in self.wanted:
            self._keep(now, self.page, self.total)
        if now >= self.until:
            self.restart_point = self._restart_state(self.total)
        return now

    @property
    def _gained(self) -> Array:
        return self.total

    def _passed(self, guard: Guard) -> str:
        """Go on from where a guard is zero; a status where the motion ends there."""
        raise NotImplementedError

    def _sample_count(self, h: float) -> int:
        """Samples of a step of length h."""
        return max(OF_A_STEP, math.ceil(OF_ALL * h / (self.until - self.first)))

    def _sample_times(self, t: float, h: float, count: int, wanted: Array) -> Array:
        """Where a step from t on is sampled."""
        return np.concatenate([t + np.arange(1, count) / count * h, wanted])

    def _resolved(self, times: Array, found: Array, rising: Array) -> bool:
        """Whether samples, values and rates (events, times), are near enough to each other."""
        return True

    def _values(self, which: list[int], t: Array, pages: Array) -> Array:
        """Values (events, instants) of some of the events."""
        return values(self.system, [self.measures[n] for n in which], t, pages)

    def _record_forces(self, marks: Array, pages: Array, cut: LocatedZero | None) -> None:
        """Record the forces of contacts and ropes over a step, within the output instants."""
        if not self.sided:
            return
        last = float(self.wanted[-1]) if cut is None else min(cut.t, float(self.wanted[-1]))
        inside = (marks >= self.wanted[0]) & (marks <= last)
        if not inside.any():
            return
        run = motion_at(self.system, marks[inside], pages[inside])
        for one in self.sided:
            self.forces[one.name].append(one_sided_force(run, one))

    def _between(self) -> dict[str, OneSidedForce]:
        found = {}
        for name, parts in self.forces.items():
            if parts:
                whole = {k: np.concatenate([getattr(p, k) for p in parts]) for k in FORCES}
                found[name] = OneSidedForce(**whole)
        return found

    def _record(self, event: Event, t: float, page: Array) -> None:
        self.occurred.append(EventRecord(event.name, t, self._instant(t, page)))

    def _instant(self, t: float, page: Array) -> Solution:
        """A page as a solution of one instant."""
        record = Record([page[None].copy()], 1, batch=False)
        return Solution(
            self.system, "simulate", np.array([t]), record, None, regularization=self.regularization
        )

    def _ended(self, why: str) -> str:
        """Keep the last instant; the status of a motion that ends there."""
        t, self.restart_point = float(self.state[TIME]), None
        self._keep(t, self.page, self.total)
        return f"ended: at t = {t:.6g} {self.system.mechanism.units.time}, {why}"

    # -- zeros --------------------------------------------------------------------------------

    def _marks(self, wanted: Array, times: Array) -> Array:
        """`wanted` and, where a rate follows from two samples, others beside `times`."""
        if self.carried.all() and not self.guards:
            return wanted
        return np.unique(np.concatenate([wanted, self._beside(times)]))

    def _beside(self, times: Array) -> Array:
        """Times a little later than `times`, a little earlier than the end of the step."""
        last = self.step[1]
        little = BESIDE * (last - self.step[0]) / OF_A_STEP
        return np.where(times + little < last, times + little, times - little)

    def _sampled(self, times: Array, marks: Array, pages: Array) -> tuple[Array, Array]:
        """Values and rates (events, times) by pages at the marks, the times being among them."""
        at = np.searchsorted(marks, times)
        every = [*self.events, *self.guards]
        found = self._values(list(range(len(every))), marks, pages)
        rising = np.empty((len(every), len(times)))
        carried = np.append(self.carried, np.zeros(len(self.guards), dtype=bool))
        if carried.any():
            measures = [self.measures[n] for n in np.flatnonzero(self.carried)]
            apart = (self.step[1] - self.step[0]) / OF_A_STEP
            rising[carried] = rates(self.system, measures, times, pages[at], apart)
        if not carried.all():
            own = ~carried
            beside = np.searchsorted(marks, self._beside(times))
            change = found[own][:, beside] - found[own][:, at]
            apart = marks[beside] - times
            rising[own] = change / np.where(apart == 0.0, 1.0, apart)
        return found[:, at], rising

    def _crossings(
        self, saved: Saved, times: Array, found: Array, rising: Array
    ) -> list[LocatedZero]:
        """The zero crossings of a step up to the first that ends it, located, in the order of
        time.
        """
        brackets = []
        watched: list[Event | Guard] = [*self.events, *self.guards]
        near = LOCATED * (self.step[1] - self.step[0])
        for k in np.flatnonzero(may_be_zero(times, found, rising, near)).tolist():
            event = watched[k]
            again = functools.partial(self._again, saved, k)
            t, history, _ = refined(again, (times, found[k], rising[k]), near)
            for n in sign_changes(t, history):
                left, right = ((float(t[m]), float(history[m])) for m in (n, n + 1))
                if event.direction * left[1] <= 0.0:
                    brackets.append((left, right, event))
        crossings, ends = [], math.inf
        for left, right, event in sorted(brackets, key=lambda one: one[0][0]):
            if left[0] > ends:
                break
            if not self._may_count(saved, event, np.array([left[0], right[0]])):
                continue
            one = self._located(saved, event, left, right)
            # what is zero but for rounding where the motion begins crosses nothing
            begins = not isinstance(event, Guard) and one.t <= self.first + near
            if self._counts(one) and not begins:
                crossings.append(one)
                ends = min(ends, one.t) if event.stop else ends
        return sorted(crossings, key=lambda one: one.t)

    def _may_count(self, saved: Saved, event: Event | Guard, times: Array) -> bool:
        """Whether a zero between two times can be an event."""
        return True

    def _counts(self, one: LocatedZero) -> bool:
        """Whether what is zero there is an event."""
        return True

    def _again(self, saved: Saved, k: int, times: Array) -> tuple[Array, Array]:
        """Values and rates of one event at further times of a step."""
        order = np.argsort(times, kind="stable")
        marks = self._marks(times[order], times)
        self._restore(saved)
        _, pages, _ = self._run(self.target, 1, marks)
        found, rising = self._sampled(times[order], marks, pages)
        back = np.argsort(order, kind="stable")
        return found[k][back], rising[k][back]

    def _located(
        self,
        saved: Saved,
        event: Event | Guard,
        left: tuple[float, float],
        right: tuple[float, float],
    ) -> LocatedZero:
        """The crossing between two times at which the value is known."""
        which = [*self.events, *self.guards].index(event)

        def value(t: float, within: bool) -> float:
            self._restore(saved)
            # steps of one length have another error where they are cut
            until, steps = (self.target, 1) if within else (t, AT_ONCE)
            code, pages, _ = self._run(until, steps, np.array([t]))
            if code != DONE and not within:
                raise self._stopped(self._solution(""), code)
            self.page = pages[-1].copy()
            return float(self._values([which], np.array([t]), pages)[0, 0])

        near = LOCATED * float(saved.state[NEXT])
        t = bracketed_root(lambda t: value(t, self.steps.fixed), left, right, near)
        value(t, within=False)
        return LocatedZero(t, event, self._save())


def _first_end(crossings: list[LocatedZero], together: float) -> LocatedZero | None:
    """The first crossing that ends a step; an event that ends the motion comes before the change of
    modes that it meets, behind which it would begin at zero and be no crossing.
    """
    ends = [one for one in crossings if one.event.stop]
    if not ends:
        return None
    own = (one for one in ends if not isinstance(one.event, Guard))
    return next((one for one in own if one.t <= ends[0].t + together), ends[0])
