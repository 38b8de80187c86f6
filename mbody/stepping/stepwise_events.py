"""Integration to one time after another with events, which every step looks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mbody.analysis.dynamics.events import EventIntegration
from mbody.kernels.step_state import DONE, LAST_STEP_ALLOWED, MORE, NEXT, STEPS, TIME
from mbody.stepping.stepwise import Carried, Stepwise

__all__ = ["StepwiseEvents"]

Array = np.ndarray
#: What reads one number.
Read = Callable[[], float]

#: A step is short if it is this part of the one that the tolerance allows.
QUARTER = 0.25
#: Control points keep this part of their spread from zero.
CLEAR = 1e-2
#: Rates are differences over this part of a step.
LITTLE = 1e-4


class StepwiseEvents(Stepwise, EventIntegration):
    """The same with events, which every step looks for."""

    #: Of each event the value at the state in `at`; none where one needs more than that.
    values: Sequence[Read] = ()
    at: tuple[Array, Array]
    #: Whether `page` is of an earlier instant.
    late = False

    def start_at(self, t: float, q: Array, v: Array, own: Array | None = None) -> None:
        """Begin anew, without the events before."""
        self.total, self.late = np.zeros(self.causes), False
        self.occurred = []
        self.forces = {one.name: [] for one in self.sided}
        self._forget()
        super().start_at(t, q, v, own)

    def _forget(self) -> None:
        """Nothing of former calls is kept."""
        self.instants, self.pages, self.works = list[float](), list[Array](), list[Array]()

    def reach(self, until: float) -> str:
        """See `Stepwise`."""
        if not self.state[STEPS]:
            self.until = until
            self._begin_steps()
        self.passage.whole = until - self.first
        return "" if self._quiet(until) else self._far(until)

    def _quiet(self, until: float) -> bool:
        """Go on by one short step that nothing crosses; False, where that is not certain.

        The cubic through values and rates at both ends of a step a quarter as long as the tolerance
        allows, as far apart as samples of longer steps are: where its four control points have one
        sign, so has the cubic.
        """
        state = self.state
        t = state.item(TIME)
        short = state.item(STEPS) > 0.0 and until - t <= QUARTER * state.item(NEXT)
        busy = self.guarded or self.closely or self.sided
        if not short or busy or not self.values:
            return False
        saved, first = self._save(), self._sampled_ends(until - t)
        self.outputs.work[-1] = self.total
        state[LAST_STEP_ALLOWED] = 1.0
        code = self._advance(until, 1, self.outputs)
        if code in (MORE, DONE) and state.item(TIME) == until:
            last, third = self._sampled_ends(until - t), (until - t) / 3.0
            for (v0, r0), (v1, r1) in zip(first, last, strict=True):
                hull = v0, v0 + third * r0, v1 - third * r1, v1
                low, high = min(hull), max(hull)
                if not min(abs(low), abs(high)) > CLEAR * (high - low) or low < 0.0 < high:
                    break
            else:
                self.total, self.late = self.outputs.work[-1].copy(), True
                return True
        self._restore(saved)
        return False

    def _sampled_ends(self, h: float) -> list[tuple[float, float]]:
        """Value and rate of every event at the present state."""
        y, slots = self.at
        t, little, found = self.state.item(TIME), LITTLE * h, []
        for sign in (0.0, 1.0, -1.0):
            y[:] = self.y + sign * little * self.K[0]
            slots[TIME] = t + sign * little
            found.append([value() for value in self.values])
        here, after, before = found
        return [(v, (a - b) / (2.0 * little)) for v, a, b in zip(here, after, before, strict=True)]

    def _renew(self) -> None:
        """The page of the present instant."""
        if self.late:
            self.page, self.late = self.instant().copy(), False

    def refresh(self) -> None:
        """See `Stepwise`."""
        super().refresh()
        self.late = False

    def _far(self, until: float) -> str:
        self._renew()
        return super()._far(until)

    def _all_steps(self) -> str:
        self._forget()
        self._set_times()
        self.wanted = self._instants() if self.closely else np.array([self.until])
        code, status = MORE, ""
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
        if code not in (DONE, MORE):
            raise self._stopped(self._solution(""), code)
        for name, parts in self.forces.items():
            for part in parts:
                self.meet(name, part)
            self.forces[name] = []
        return status

    def _watched_steps(self) -> str:
        status = self._all_steps()
        if self.instants:
            self.samples = np.array(self.instants), np.array(self.pages)
        return status

    def snapshot(self) -> Carried:
        """See `Stepwise`."""
        self._renew()
        return super().snapshot()

    def go_on_from(self, given: Carried) -> None:
        """See `Stepwise`."""
        super().go_on_from(given)
        self.late = False
        t = float(self.state[TIME])
        self.occurred = [one for one in self.occurred if one.t <= t]
        self._forget()

    @property
    def _gained(self) -> Array:
        return self.total
