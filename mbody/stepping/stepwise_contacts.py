"""Integration to one time after another with contacts, ropes and rough joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mbody.analysis.contact.unilateral import has_modes, refuse_modes
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.analysis.dynamics.modal_motion import Closing
from mbody.kernels.layout import Work
from mbody.model.event import Event
from mbody.model.simulation import ADAPTIVE
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.stepping.carried_modes import CarriedModes
from mbody.stepping.stepwise import Carried, Stepwise
from mbody.stepping.stepwise_events import StepwiseEvents
from mbody.system.system import System

__all__ = ["StepwiseContacts", "stepwise"]

Array = np.ndarray


class StepwiseContacts(StepwiseEvents, ContactIntegration):
    """The same with contacts, ropes and rough joints: modes as of `simulate`, found again where
    inputs change.
    """

    first_modes: dict[str, str]

    def start_at(self, t: float, q: Array, v: Array, own: Array | None = None) -> None:
        """See `Stepwise`; what is open, sticks and slides is decided anew.

        Raises
        ------
        SolveError
            Where shapes overlap.
        """
        self._open_all()
        self.lost[:] = 0.0
        super().start_at(t, q, v, own)
        self.ending = self.begin_modes()
        self.first_modes = self.named_modes()
        self.reference = self.page.copy()
        self._show(None)

    def place_at(self, t: float, page: Array) -> None:
        """See `Stepwise`."""
        self._open_all()
        super().place_at(t, page)
        self.first_modes = self.named_modes()

    def _open_all(self) -> None:
        """Nothing touches, and no joint sticks."""
        self.modes, self.pairs = ["open"] * len(self.modes), ["slip+"] * len(self.pairs)
        self.groups, self.struck, self.fresh, self.beyond = {}, {}, {}, set()
        self.shared = None
        self.guards, self.closing, self.contact_notes = [], Closing(), []
        self.changed_at, self.changes, self.ending = -np.inf, 0, ""
        self.work.anchor[:] = 0.0
        self.work.par[:] = self.probe.par
        self.on = np.zeros(len(self.on))
        self.uni.set_rows(self.work, self.on, np.zeros(len(self.layout.friction_kind)))
        self.eliminate_rows_that_are_on()

    def _forget(self) -> None:
        super()._forget()
        self.kept_modes = []

    def reach(self, until: float) -> str:
        """See `Stepwise`."""
        return self.ending or super().reach(until)

    def _quiet(self, until: float) -> bool:
        """Never: guards are looked at in every step."""
        return False

    def refresh(self) -> None:
        """See `Stepwise`; forces that change may end what sticks."""
        super().refresh()
        self.ending = self.settle_jump()

    # -- what is carried on -------------------------------------------------------------------

    def _rows_of(self, work: Work) -> tuple[Array, ...]:
        return work.on, work.pad, work.regularization_weight, work.anchor, work.sense, work.par

    def snapshot(self) -> Carried:
        """See `Stepwise`."""
        self.before_end = None  # that of the present state
        return replace(super().snapshot(), modes=self._modes_carried())

    def _modes_carried(self) -> CarriedModes:
        return CarriedModes(
            modes=tuple(self.modes),
            pairs=tuple(self.pairs),
            first=dict(self.first_modes),
            rows=tuple(part.copy() for part in self._rows_of(self.work)),
            groups={key: list(one) for key, one in self.groups.items()},
            shared=self.shared,
            struck=dict(self.struck),
            beyond=frozenset(self.beyond),
            closed=frozenset(self.closing.closed),
            guards=tuple(self.guards),
            fresh=dict(self.fresh),
            changes=(self.changed_at, self.changes),
            notes=tuple(self.contact_notes),
            lost=self.lost.copy(),
        )

    def go_on_from(self, given: Carried) -> None:
        """See `Stepwise`."""
        super().go_on_from(given)
        assert given.modes is not None
        self._take_modes(given.modes)

    def _take_modes(self, given: CarriedModes) -> None:
        self.modes, self.pairs = list(given.modes), list(given.pairs)
        self.first_modes = dict(given.first)
        for part, was in zip(self._rows_of(self.work), given.rows, strict=True):
            part[:] = was
        self.on = self.work.on[: len(self.on), 0].copy()
        self.eliminate_rows_that_are_on()
        self.groups = {key: list(one) for key, one in given.groups.items()}
        self.shared = given.shared
        self.struck, self.beyond = dict(given.struck), set(given.beyond)
        self.closing = Closing(set(given.closed))
        self.guards, self.fresh = list(given.guards), dict(given.fresh)
        self.changed_at, self.changes = given.changes
        self.lost[:] = given.lost
        self.contact_notes, self.ending = list(given.notes), ""

    def unfit(self, given: Carried, inputs: Array) -> str:
        """See `Stepwise`."""
        modes = given.modes
        if modes is None or [part.shape for part in modes.rows] != [
            part.shape for part in self._rows_of(self.work)
        ]:
            return "is of another mechanism, with other contacts"
        before = self._modes_carried(), self.ending
        self._take_modes(modes)
        try:
            return super().unfit(given, inputs)
        finally:
            self._take_modes(before[0])
            self.ending = before[1]

    def _works(self) -> Array:
        works = np.zeros((2, self.causes + len(self.stops)))
        works[1] = np.concatenate([self.total, self.lost])
        return works

    # -- what is shown ------------------------------------------------------------------------

    def instant(
        self, inputs: Array | None = None, held: Mapping[str, float] | None = None
    ) -> Array:
        """See `Stepwise`; in the present modes."""
        probe = self._probe[0]
        for part, own in zip(self._rows_of(probe), self._rows_of(self.work), strict=True):
            part[:] = own
        return super().instant(inputs, held)

    def _solution(self, status: str) -> Solution:
        kept = self.kept_modes
        self.kept_modes = [self.first_modes, self.named_modes()][: len(self.ends[0])]
        try:
            return super()._solution(status)
        finally:
            self.kept_modes = kept


def stepwise(system: System, start: Solution, way: Way, events: tuple[Event, ...]) -> Stepwise:
    """The integration of a system.

    Raises
    ------
    ModelError
        For contacts and friction with a method that does not decide their modes.
    """
    if has_modes(system):
        if way.method not in ADAPTIVE:
            refuse_modes(system, f"the method '{way.method}'")
        return StepwiseContacts(system, start, way, events)
    if events:
        return StepwiseEvents(system, start, way, events)
    return Stepwise(system, start, way)
