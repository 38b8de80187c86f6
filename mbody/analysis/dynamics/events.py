"""Motion over time with events: zero crossings are located, impacts on stops resolved.

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
from mbody.analysis.dynamics.impacts import (
    StopCoordinate,
    has_exact_rates,
    motion_at,
    rates,
    second_rate,
    stop_coordinate,
    values,
    velocity_jump,
)
from mbody.analysis.dynamics.integration import AT_ONCE, Integration
from mbody.analysis.dynamics.located import Guard, LocatedZero, Saved
from mbody.analysis.dynamics.zero_crossings import bracketed_root, refined, sign_changes
from mbody.analysis.initial.initial_state import event_measure
from mbody.errors import SolveError
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    DELIVERED,
    DONE,
    EVALUATIONS,
    MORE,
    NEAR_SINGULAR,
    NEXT,
    TIME,
    Outputs,
)
from mbody.model.event import Event, Stop
from mbody.solution.event_record import EventRecord
from mbody.solution.histories import Record
from mbody.solution.measures import check_measure
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
#: A crossing is located to this part of its step.
LOCATED = 1e-12
#: What is nearer to a stop than this, in model lengths and radians, touches it.
TOUCH = 1e-9
#: Rebounds no higher than this, likewise, are not resolved: a position has sixteen digits.
RESOLVED = 1e-14
#: A rate of a stop's coordinate below this part of the greatest rates is none.
STILL = 1e-13
#: Impacts at one instant, of stops that push on each other, before they count as rest.
STRIKES = 200


class EventIntegration(Integration):
    """Integrates one system and locates events."""

    def __init__(
        self,
        system: System,
        start: Solution,
        way: Way,
        events: dict[Event | Stop, float],
    ) -> None:
        """`events` with the restitution of each stop."""
        super().__init__(system, start, way)
        self.events, self.restitution = list(events), events
        self.measures = [event_measure(system.mechanism, event) for event in self.events]
        self.stops = [event.name for event in self.events if isinstance(event, Stop)]
        self.lost = np.zeros(len(self.stops))
        self.total = np.zeros(self.causes)
        self.touching: dict[Stop, float] = {}
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
        code, status = MORE, self._resolve_impacts()
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return (MORE if status else code), status or "completed"

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
        if t >= self.target:
            self._interrupt(t)
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
        came_back, touching = self._check_touching(found[:, 1])
        if came_back:
            self._restore(saved)
            state[NEXT] = 0.25 * h
            if h < LOCATED * (self.until - self.first):
                return MORE, self._at_rest(came_back)
            return MORE, ""
        for stop, size in touching.items():
            # what lies on a stop without load does not strike it by rounding
            row, rounding = self.events.index(stop), 0.1 * RESOLVED * size
            found[row] = np.where(np.abs(found[row]) <= rounding, rounding, found[row])
        crossings = self._crossings(saved, times, found, rising)
        cut = next((one for one in crossings if _interrupts(one.event)), None)
        self._record_forces(np.append(t, marks), np.concatenate([saved.page[None], pages]), cut)
        for n in np.flatnonzero(np.isin(marks, wanted)):
            if cut is None or marks[n] <= cut.t:
                self._keep(float(marks[n]), pages[n], work_done[n])
        for one in crossings[: crossings.index(cut) if cut else None]:
            if one.t <= self.first:  # reported by the motion that this one continues
                continue
            if not isinstance(one.event, Guard):
                self._record(one.event, one.t, one.saved.page)
        self.touching = touching
        if cut is None:
            self._restore(after)
            return code, ""
        self._restore(cut.saved)
        state[NEXT] = min(state[NEXT], h)
        if isinstance(cut.event, Guard):
            return MORE, self._passed(cut.event)
        if isinstance(cut.event, Stop):
            return MORE, self._resolve_impacts()
        self._record(cut.event, cut.t, self.page)
        return MORE, self._ended(f"'{cut.event.of}' is zero")

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

    def _record(
        self, event: Event | Stop, t: float, page: Array, after: Array | None = None
    ) -> None:
        states = [None if one is None else self._instant(t, one) for one in (page, after)]
        assert states[0] is not None
        self.occurred.append(EventRecord(event.name, t, states[0], states[1]))

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

    def _at_rest(self, stop: Stop) -> str:
        return self._ended(f"what strikes '{stop.name}' comes to rest there")

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
        """Every zero crossing of a step, located, in the order of time."""
        crossings = []
        for k, event in enumerate([*self.events, *self.guards]):
            sense = -1 if isinstance(event, Stop) else event.direction
            rounding, t, history = 0.0, times, found[k]
            if self.touching and isinstance(event, Event):
                rounding = 1e-9 * float(np.abs(history).max())
            if event not in self.touching:
                near = LOCATED * (self.step[1] - self.step[0])
                sampled = (times, history, rising[k])
                again = functools.partial(self._again, saved, k)
                t, history, _ = refined(again, sampled, near)
            for n in sign_changes(t, history):
                a, b = float(history[n]), float(history[n + 1])
                if n == 0 and abs(a) <= rounding:
                    continue  # a restart at a stop begins at its zero
                if sense * a <= 0.0:
                    crossings.append(
                        self._located(saved, event, (float(t[n]), a), (float(t[n + 1]), b))
                    )
        return sorted(crossings, key=lambda one: one.t)

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
        event: Event | Stop | Guard,
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

    # -- stops --------------------------------------------------------------------------------

    def _check_touching(self, first: Array) -> tuple[Stop | None, dict[Stop, float]]:
        """By the first sample of a step, (events,): a stop that was touched and lies behind again,
        and those that still are touched.
        """
        still = {}
        for stop, size in self.touching.items():
            value = float(first[self.events.index(stop)])
            if value < -0.1 * RESOLVED * size:
                return stop, {}
            if value <= 0.1 * RESOLVED * size:
                still[stop] = size
        return None, still

    def _coordinate_of(self, stop: Stop) -> StopCoordinate:
        measure = self.measures[self.events.index(stop)]
        q = self.y[: self.system.coordinates]
        return stop_coordinate(
            self.system, measure, float(self.state[TIME]), q, self.until - self.first
        )

    def _resolve_impacts(self) -> str:
        """Strike every stop that is touched and approached, and begin anew; a status where what
        strikes comes to rest.
        """
        n, state = self.system.coordinates, self.state
        stops = [event for event in self.events if isinstance(event, Stop)]
        swift = float((self.scale[n : 2 * n] / self.scale[:n]).max())
        for _ in range(STRIKES):
            v = self.y[n : 2 * n]
            touched = []
            for stop in stops:
                at = self._coordinate_of(stop)
                if at.value < -TOUCH * at.size:
                    raise self._beyond(stop, at)
                if at.value <= TOUCH * at.size:
                    touched.append((at.rate(v) / (at.size * swift or 1.0), stop, at))
            if not touched:
                break
            rate, stop, at = min(touched, key=lambda one: one[0])
            if rate >= -STILL:
                break
            self._strike(stop, at)
        else:
            return self._at_rest(stop)
        self.touching = {}
        for _, stop, at in touched:
            measure = self.measures[self.events.index(stop)]
            q, v, a = (self.page[k * n : (k + 1) * n, 0] for k in range(3))
            back = -second_rate(self.system, measure, float(state[TIME]), q, v, a)
            away = max(at.rate(v), 0.0)
            if back > 1e-8 * at.size * swift**2:
                if away * away <= 2.0 * RESOLVED * at.size * back:
                    return self._at_rest(stop)
                # the first step ends at the height of the rebound
                state[NEXT] = min(state[NEXT], away / back)
            self.touching[stop] = at.size
        return ""

    def _strike(self, stop: Stop, at: StopCoordinate) -> None:
        """One impact: the velocities after it, their derivative, the energy that it took."""
        n, t = self.system.coordinates, float(self.state[TIME])
        before, best = self.page.copy(), float(self.state[BEST_CONDITIONING])
        self.evaluate()
        v = self.y[n : 2 * n].copy()
        way = velocity_jump(self.system, self.work, at)
        if way is None:
            raise SolveError(
                f"nothing that strikes the stop '{stop.name}' is free to rebound: '{stop.of}' "
                "follows drivers alone; take them off, or record it by an Event",
                stop.name,
                self._solution(""),
            )
        self.y[n : 2 * n] = v - (1.0 + self.restitution[stop]) * at.rate(v) * way
        mass = self.system.mass[:n, 0]
        self.lost[self.stops.index(stop.name)] += 0.5 * float(
            mass @ (self.y[n : 2 * n] ** 2 - v**2)
        )
        self.evaluate()
        self._check_finite(self.K, t)
        self.steps.jumped(self.motion)
        self.state[NEAR_SINGULAR] = 0.0
        self.state[BEST_CONDITIONING] = max(self.state[BEST_CONDITIONING], best)
        self._record(stop, t, before, self.page)

    def _beyond(self, stop: Stop, at: StopCoordinate) -> SolveError:
        mechanism = self.system.mechanism
        own = check_measure(mechanism, event_measure(mechanism, stop))
        return SolveError(
            f"at t = {self.state[TIME]:.6g} {mechanism.units.time} the motion is beyond the stop "
            f"'{stop.name}': '{stop.of}' is "
            + f"{at.value:.6g} {own}".rstrip()
            + "; begin where it is not negative",
            stop.name,
        )


def _interrupts(event: Event | Stop | Guard) -> bool:
    """Whether the motion does not go on as it was."""
    return isinstance(event, Stop) or event.stop
