"""When the modes of a motion change, and when events are, with derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.analysis.dynamics.located import Guard
from mbody.analysis.initial.initial_state import event_measure
from mbody.core.dual_number import DualNumber, value
from mbody.derivatives.dual_motion import DualInstant, DualMotion, Tangents
from mbody.derivatives.dual_solution import DualRecord, dual_solution
from mbody.derivatives.event_time import EventTime
from mbody.derivatives.formula_jumps import JumpGuard
from mbody.derivatives.guard_duals import GuardDuals
from mbody.derivatives.lost_numbers import LostNumbers
from mbody.derivatives.mode_record import ModeStretch
from mbody.solution.measures import valued
from mbody.solution.solution import Solution

__all__ = ["APART", "TOLERANCES", "ChangeTimes"]

Array = np.ndarray

#: A rate with which a guard becomes zero below this part of its usual one: it grazes zero.
GRAZING = 1e-6
#: By what part the tangents of a state may differ from what the modes that follow allow; by so many
#: tolerances besides.
APART, TOLERANCES = 1e-5, 1e3
#: Times nearer to each other than this part of the motion are one.
SAME = 1e-12


class ChangeTimes:
    """Times of changes and events of one motion, ṫ* = −(g_y S + g_p)/ġ.

    Parameters
    ----------
    run : Solution
        Of `simulate`.
    motion : DualMotion
    values : dict
        Numbers of the description by dotted name, dual ones among them.
    lost : LostNumbers
    """

    def __init__(
        self, run: Solution, motion: DualMotion, values: dict[str, Any], lost: LostNumbers
    ) -> None:
        self.run, self.motion, self.values, self.lost = run, motion, values, lost
        self.guards = GuardDuals(motion.uni, values)
        #: By time alone, along which no number changes.
        self.along = GuardDuals(motion.uni, {name: value(one) for name, one in values.items()})
        self.width = len(lost.names)
        self.short = SAME * float(run.t[-1] - run.begun[0].start.t[0])
        self.events: list[EventTime] = []
        self.own = [event for event in run.events if not event.contact]
        self.measures = {
            event.name: event_measure(run.mechanism, event) for event in run.begun[0].request.events
        }
        #: The last change, and its derivatives.
        self.before: tuple[float, Array] = (-np.inf, np.zeros(self.width))

    def when(self, stretch: ModeStretch, now: DualInstant, tangents: Tangents) -> DualNumber:
        """The time at which the guard of a stretch is zero."""
        guard, end = stretch.guard, stretch.end
        assert guard is not None
        ahead = self.ahead(stretch, now, tangents)
        row = self._zero(stretch, guard, now, ahead)
        if row is None:
            why = "the derivative of when that changes is not there"
            if self.guards.value(guard, stretch, now) is not None:
                why = "what changes there only grazes its limit"
            self.lost.lose(True, end, why)
            row = np.zeros(self.width)
        together = "two changes fall together there, in another order beside it"
        for other in stretch.also:
            if self.guards.kind_of(other) != self.guards.kind_of(guard):
                continue
            if self.guards.behind(other, now):
                continue
            beside = self._zero(stretch, other, now, ahead)
            if beside is None and other.kind == "close":
                # of edges on one line one comes upon the other where it passes its end
                beside = self._zero(stretch, Guard("enter", other.number), now, ahead)
            gone = True if beside is None else self._differ(row, beside)
            self.lost.lose(gone, end, together)
        if end - self.before[0] <= self.short:
            self.lost.lose(self._differ(row, self.before[1]), end, together)
        self.before = end, row
        self._record(stretch, row)
        return DualNumber(end, np.where(self.lost.gone, 0.0, row))

    def ahead(self, stretch: ModeStretch, now: DualInstant, tangents: Tangents) -> DualInstant:
        """An instant with derivatives by time along the motion, its one direction."""
        y = DualNumber(now.y.value, now.slope.value[:, None])
        t = DualNumber(float(now.t), np.ones(1))
        return self.motion.at(stretch, t, y, tangents.none())

    def event(self, event: Any, stretch: ModeStretch, y: DualNumber, tangents: Tangents) -> None:
        """A zero of a measured quantity, with the state at its time."""
        motion, width = self.motion, self.width
        now = motion.at(stretch, DualNumber(event.t, np.zeros(width)), y, tangents)
        ahead = self.ahead(stretch, now, tangents)
        g, rate = (self._measured(event.name, one, part) for one, part in ((now, 0), (ahead, 1)))
        row = np.full(width, np.nan)
        if isinstance(rate, DualNumber) and rate.tangents[0] != 0.0:
            slopes = g.tangents if isinstance(g, DualNumber) else np.zeros(width)
            row = -slopes / rate.tangents[0]
        row = np.where(self.lost.gone, np.nan, row)
        self.events.append(EventTime(event.name, "", event.t, row))

    def _differ(self, row: Array, other: Array) -> Array:
        size = np.maximum(np.abs(row), np.abs(other))
        return np.abs(row - other) > (APART + TOLERANCES * self.motion.way.rtol) * size

    def _zero(
        self, stretch: ModeStretch, guard: Any, now: DualInstant, ahead: DualInstant
    ) -> Array | None:
        """−(g_y S + g_p)/ġ of a guard; None where it has no derivative, or grazes zero."""
        g = self.guards.value(guard, stretch, now)
        rate = self.along.value(guard, stretch, ahead)
        if g is None or rate is None:
            return None
        change = float(rate.tangents[0])
        return None if not abs(change) > GRAZING * self._usual(guard) else -g.tangents / change

    def _usual(self, guard: Guard | JumpGuard) -> float:
        """With what rate a guard changes as a rule; of forces it is not known."""
        n = self.motion.system.coordinates
        scale = self.motion.scale
        speed = float((scale[n : 2 * n] / scale[:n]).max()) * self.motion.system.length
        if isinstance(guard, JumpGuard):
            return guard.size / float(self.run.t[-1] - self.run.begun[0].start.t[0])
        if guard.kind == "close":
            return speed
        if guard.kind in ("stop", "lock"):
            return speed * speed / self.motion.system.length
        return 0.0

    def _record(self, stretch: ModeStretch, row: Array) -> None:
        """The events at the end of a stretch."""
        row = np.where(self.lost.gone, np.nan, row)
        for one in self.run.events:
            if one.contact and abs(one.t - stretch.end) <= self.short:
                self.events.append(EventTime(one.name, one.contact, one.t, row))

    def _measured(self, name: str, now: DualInstant, part: int) -> Any:
        """What an event is of, at an instant; of its part 1 numbers have no tangents."""
        page, n = now.page, self.motion.system.coordinates
        width = page.tangents.shape[-1]
        record = DualRecord(page.value[None], page.tangents[None], self.motion.first_load, n)
        values = self.values
        if part:
            values = {
                one: DualNumber(x.value, np.zeros(width)) if isinstance(x, DualNumber) else x
                for one, x in values.items()
            }
        found = valued(dual_solution(self.run, values, record), self.measures[name])[0]
        return found[0] if isinstance(found, DualNumber) and found.ndim else found
