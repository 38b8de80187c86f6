"""What is looked at between the ends of calls: tables that are left, contacts that lift off."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from mbody.analysis.driven.contact_report import OneSidedForce, one_sided, one_sided_force
from mbody.analysis.driven.law_doubts import (
    derivative_doubts,
    law_doubts,
    open_curves,
    open_tables,
)
from mbody.analysis.dynamics.integration import Integration, solution_of_records
from mbody.kernels.step_state import TIME
from mbody.solution.doubts import Doubt
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import Present, Read

Array = np.ndarray


class Monitor:
    """Tables, contacts and ropes of one motion; events look for themselves."""

    def __init__(self, integration: Integration, present: Present, events: bool) -> None:
        self.integration, self.present = integration, present
        self.system = system = integration.system
        described = system.mechanism
        left = (*open_tables(described), *open_curves(described))
        integration.closely = bool(left)
        self.contacts: list[tuple[str, Any, Read | None, Read | None]] = []
        for one in [] if events else one_sided(system):
            force: Read | None = None
            size: Read | None = None
            with contextlib.suppress(Exception):  # what no list of operations gives
                forces = one_sided_force(present.instant, one)
                force, size = present.read(forces.force), present.read(forces.size)
            self.contacts.append((one.name, one, force, size))
        integration.watched = bool(self.contacts)
        self.any = bool(self.contacts) or integration.closely or system.has_user_code

    def after_call(self, known: tuple[Doubt, ...]) -> tuple[Doubt, ...]:
        """Look at what the last call went through; the doubts of tables that were left."""
        engine = self.integration
        if engine.samples is None:
            self._at_the_end()
            if not self.system.has_user_code:
                return known
            new = derivative_doubts(self.system)
            return (*known, *(one for one in new if one not in known))
        (times, records), engine.samples = engine.samples, None
        run = self._result(times, records)
        names = {one.elements for one in known}
        for name, one, _, _ in self.contacts:
            engine.meet(name, one_sided_force(run, one))
        return (*known, *(one for one in law_doubts(run) if one.elements not in names))

    def _at_the_end(self) -> None:
        """Forces of contacts and ropes at the end of a call that was one step."""
        engine, t = self.integration, np.array([self.integration.state[TIME]])
        for name, one, force, size in self.contacts:
            if force is None or size is None:
                run = self._result(t, np.array(self.present.record())[None, :, None])
                engine.meet(name, one_sided_force(run, one))
                continue
            known, now, large = engine.extremes.get(name), force(), size()
            if known is None or now < known.force.min() or large > known.size.max():
                engine.meet(name, OneSidedForce(t, np.array([now]), np.array([large])))

    def _result(self, times: Array, records: Array) -> Solution:
        """Instants as a result."""
        return solution_of_records(self.system, times, records, self.integration.regularization)
