"""What can be read of a motion at its present instant, by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.analysis.dynamics.simulate import judged
from mbody.errors import ModelError, brief
from mbody.kernels.step_state import TIME
from mbody.model.element import as_marker, listed
from mbody.model.study import Measure
from mbody.solution.compiled_measures import Present, Read
from mbody.solution.doubts import Doubt
from mbody.solution.event_record import EventRecord
from mbody.solution.histories import Record
from mbody.solution.measures import ORIGIN
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.stepping.present import BodyNow, PointNow, ReactionNow
from mbody.stepping.stepwise import Stepwise
from mbody.stepping.stepwise_contacts import StepwiseContacts
from mbody.system.system import System

__all__ = ["Readings"]

Array = np.ndarray


class Readings:
    """Readings of the present instant; what steps is in `Simulator`."""

    system: System
    _integration: Stepwise
    _slots: memoryview
    #: The first part of a motion that leaves a singular position.
    _before: Solution | None = None
    _origin: tuple[float, Array, Array] | None = None
    _ended = ""
    _notes: tuple[str, ...] = ()
    #: Tables that were left.
    _beyond: tuple[Doubt, ...] = ()
    _way: Way

    def _show(self, integration: Stepwise, way: Way) -> None:
        """Read from this integration."""
        self._integration, self._way = integration, way
        y, slots, shown = integration.y, integration.state, integration.shown.reshape(-1)
        self._slots, self._shown = memoryview(slots.data), memoryview(shown.data)
        self._present = Present(self.system, memoryview(y.data), self._slots, self._page)
        self._named: dict[str, BodyNow | PointNow] = {}
        self._found: dict[Any, Any] = {}
        self._measures: dict[Any, Read] = {}
        self._changed()

    def _changed(self) -> None:
        """Nothing that was evaluated holds any more."""
        self._page_valid = False
        self._certified: Solution | None = None

    @property
    def t(self) -> float:
        """Time."""
        return self._slots[TIME]

    @property
    def q(self) -> Array:
        """A copy of the coordinates (coordinates,): mass centre (x, y) [length] and angle [rad] of
        every body, in the order of the description.
        """
        return self._integration.y[: self.system.coordinates].copy()

    @property
    def v(self) -> Array:
        """A copy of their rates (coordinates,) [length/time, rad/time]."""
        n = self.system.coordinates
        return self._integration.y[n : 2 * n].copy()

    def __getitem__(self, name: str) -> Any:
        """The present motion of a body, ``sim["crank"]``, or of a point, ``sim["crank.A"]``."""
        try:
            return self._named[name]
        except KeyError:
            found = self._named[name] = self._place(name)
            return found

    def _place(self, name: str) -> BodyNow | PointNow:
        if isinstance(name, str) and name in self.system.bodies and name != "ground":
            return BodyNow(name, self._present)
        if not isinstance(name, str) or name.partition(".")[0] not in self.system.bodies:
            known = listed(body.name for body in self.system.mechanism.bodies)
            raise ModelError(f"there is no body {brief(name)} (there are: {known})", str(name))
        body, _, own = name.partition(".")
        element: Any = self.system.mechanism[body] if body != "ground" else None
        at_origin = own == ORIGIN and (element is None or own not in element.points)
        marker = as_marker(body if at_origin else name, "point", "place")
        point = self._present.instant.point(marker)
        return PointNow(name, lambda key: self._present.read(getattr(point, key)))

    def reaction(self, joint: str, on: str | None = None) -> ReactionNow:
        """Present force and torque of a joint on body `on` (by default body j); see
        `mbody.Solution.reaction`.
        """
        key = "reaction", joint, on
        found = self._found.get(key)
        if found is None:
            found = self._found[key] = self._reaction(joint, on)
        return found

    def _reaction(self, joint: str, on: str | None) -> ReactionNow:
        own = self._present.instant.reaction(joint, on)
        unique: tuple[bool, bool, bool] | None = (True, True, True)
        if self._integration.regularization:
            unique = self.solution().reaction(joint, on).unique

        def make(key: str) -> Read:
            try:
                return self._present.read(getattr(own, key))
            except Exception:  # what no list of operations gives
                return lambda: float(getattr(self._instant().reaction(joint, on), key)[-1])

        return ReactionNow(joint, own.on, own.by, unique, make)

    def mode(self, name: str) -> str:
        """Present mode of a contact, a rope or a rough joint: "open", "stick", "slip+", "slip-" or
        "roll"; see `mbody.Solution.mode`.

        Raises
        ------
        ModelError
            For what has none.
        """
        engine = self._integration
        known = engine.named_modes() if isinstance(engine, StepwiseContacts) else {}
        if name not in known:
            raise ModelError(
                f"{brief(name)} is no contact, rope or joint with friction (there are: "
                f"{listed(known)}): give a joint friction, as in friction=0.1",
                str(name),
            )
        return known[name]

    def contact(self, name: str) -> float:
        """Present pressing force of a contact, or pull of a rope [force]."""
        return float(self.measure(f"{name}.contact"))

    def effort(self, name: str) -> float:
        """Present effort of a driver or a coupling [force·length, or force]."""
        key = "effort", name
        read = self._found.get(key)
        if read is None:
            read = self._found[key] = self._present.read(self._present.instant.effort(name))
        return float(read())

    def measure(self, of: str | Measure) -> float:
        """A measured quantity at present: one of the mechanism's measures by name, a `Measure`, or
        a formula such as ``"coupler.P.y - 2*rocker.angle"``; see `mbody.Solution.measure`.

        The formula is compiled when it is first read.
        """
        read = self._measures.get(of)
        if read is None:
            read = self._measures[of] = self._present.measure(of, self._instant)
        return read()

    def _page(self) -> memoryview:
        """What is kept of the present instant."""
        if not self._page_valid:
            self._integration.instant()
            self._page_valid = True
        return self._shown

    def _instant(self) -> Solution:
        """The present instant as a result."""
        page = np.array(self._page())[None, :, None]
        record = Record([page], 1, batch=False)
        t = np.array([self.t])
        regular = self._integration.regularization
        return Solution(self.system, "simulate", t, record, None, regularization=regular)

    def solution(self) -> Solution:
        """The motion since it began or was reset as a result of `simulate`, of its first and its
        present instant: with energy, events, checks, status, doubts and notes; also to begin
        another motion or an analysis with.
        """
        if self._certified is None:
            if self._origin is not None and self._before is not None:
                found = self._before
            else:
                self._page()
                found = self._integration.now(self._ended or "completed")
            self._certified = judged(found, self._way, self._beyond)
        return self._certified

    @property
    def status(self) -> str:
        """Whether all is well: "completed"; "ended: …" where an event or a stop ended the motion;
        "doubtful: …" with the first doubt.
        """
        doubts = self.doubts
        return f"doubtful: {doubts[0].message}" if doubts else (self._ended or "completed")

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """What the evidence does not support, of the motion since it began or was reset."""
        before = () if self._before is None else self._before.doubts
        return tuple(dict.fromkeys((*before, *self.solution().doubts)))

    @property
    def notes(self) -> tuple[str, ...]:
        """Facts in sentences, the messages of the doubts among them."""
        before = () if self._before is None else self._before.notes
        return tuple(dict.fromkeys((*self._notes, *before, *self.solution().notes)))

    @property
    def events(self) -> tuple[EventRecord, ...]:
        """Events and impacts that were met, as of `Solution.events`."""
        return tuple(self._integration.occurred)
