"""What is looked at between the ends of calls: tables that may be left, contacts that may lift off,
and events, whose values short steps ask for.
"""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from mbody.analysis.driven.contacts import OneSidedForce, one_sided, one_sided_force
from mbody.analysis.driven.curve_extrapolation import open_curves
from mbody.analysis.driven.table_extrapolation import extrapolated, open_tables
from mbody.kernels.step_state import TIME
from mbody.solution.compiled_measures import Present, Read
from mbody.solution.doubts import Doubt
from mbody.solution.histories import Record
from mbody.solution.measures import valued
from mbody.solution.solution import Solution
from mbody.stepping.stepwise import Stepwise
from mbody.stepping.stepwise_events import StepwiseEvents

__all__ = ["Watched"]

Array = np.ndarray


class Watched:
    """Tables, contacts and ropes of one motion; events look for themselves.

    Parameters
    ----------
    integration : Stepwise
    present : Present
        The present instant of it.
    events : bool
        Whether there are any: every step then looks at contacts and ropes, too.
    """

    def __init__(self, integration: Stepwise, present: Present, events: bool) -> None:
        self.integration, self.present = integration, present
        self.system = system = integration.system
        described = system.mechanism
        left = (*open_tables(described), *open_curves(described))
        integration.closely = bool(left)
        self.contacts: list[tuple[str, Any, Read | None, Read | None]] = []
        if isinstance(integration, StepwiseEvents):
            _find_values(integration)
        for one in [] if events else one_sided(system):
            force: Read | None = None
            size: Read | None = None
            with contextlib.suppress(Exception):  # what no list of operations gives
                forces = one_sided_force(present.instant, one)
                force, size = present.read(forces.force), present.read(forces.size)
            self.contacts.append((one.name, one, force, size))
        integration.watched = bool(self.contacts)
        self.any = bool(self.contacts) or integration.closely

    def after_call(self, known: tuple[Doubt, ...]) -> tuple[Doubt, ...]:
        """Look at what the last call went through; the doubts of tables that were left."""
        engine = self.integration
        if engine.samples is None:
            self._at_the_end()
            return known
        (times, pages), engine.samples = engine.samples, None
        run = self._result(times, pages)
        names = {one.elements for one in known}
        for name, one, _, _ in self.contacts:
            engine.meet(name, one_sided_force(run, one))
        return (*known, *(one for one in extrapolated(run) if one.elements not in names))

    def _at_the_end(self) -> None:
        """Forces of contacts and ropes at the end of a call that was one step."""
        engine, t = self.integration, np.array([self.integration.state[TIME]])
        for name, one, force, size in self.contacts:
            if force is None or size is None:
                run = self._result(t, np.array(self.present.page())[None, :, None])
                engine.meet(name, one_sided_force(run, one))
                continue
            known, now, large = engine.extremes.get(name), force(), size()
            if known is None or now < known.force.min() or large > known.size.max():
                engine.meet(name, OneSidedForce(t, np.array([now]), np.array([large])))

    def _result(self, times: Array, pages: Array) -> Solution:
        """Instants as a result."""
        regular = self.integration.regularization
        record = Record([pages], len(times), batch=False)
        return Solution(self.system, "simulate", times, record, None, regularization=regular)


def _find_values(integration: StepwiseEvents) -> None:
    """Values of events at other states than the present one, where no forces are in them."""
    integration.at = np.zeros_like(integration.y), np.zeros_like(integration.state)
    y, slots = (memoryview(part.data) for part in integration.at)
    beside = Present(integration.system, y, slots, _no_page)
    with contextlib.suppress(Exception):  # what no list of operations gives, or forces
        found = [beside.read(valued(beside.instant, one)[0]) for one in integration.measures]
        for value in found:
            value()
        integration.values = found


def _no_page() -> memoryview:
    raise LookupError("there are no forces beside the present instant")
