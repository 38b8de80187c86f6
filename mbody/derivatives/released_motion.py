"""Motions in which drivers are released, in dual numbers: one part after the other.

A driver is released at a set time. Position and rates go on, with their derivatives; from then on
the system has a freedom more, and the state that the driver has led to is the first one of a free
motion. Instants at that time belong to the part after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from mbody.analysis.dynamics.joining import phase_rows
from mbody.analysis.dynamics.own_states import first_own_states
from mbody.analysis.dynamics.release import integrate_phases
from mbody.analysis.dynamics.repeated import beginning
from mbody.analysis.freedom.single_design import released
from mbody.analysis.initial.initial_state import state_of
from mbody.derivatives.dual_solution import DualRecord, DualSolution, dual_solution
from mbody.derivatives.event_time import EventTime
from mbody.derivatives.first_states import FirstState, first_state
from mbody.derivatives.free_instants import FreeInstants, spread
from mbody.derivatives.lost_numbers import LostNumbers
from mbody.derivatives.number_tangents import dual_values
from mbody.solution.certificate import changed
from mbody.solution.driven_motion import driven_motion
from mbody.solution.solution import Solution

__all__ = ["MotionInstants", "ReleasedInstants", "motion_instants"]

Array = np.ndarray


class ReleasedInstants:
    """Derivatives of the instants of a motion in which drivers are released.

    Parameters
    ----------
    run : Solution
        Of `simulate`, of one design.
    first : FirstState
        Where the motion begins, with derivatives.
    names : sequence of str
        As of `FreeInstants`.
    """

    def __init__(self, run: Solution, first: FirstState, names: Sequence[str]) -> None:
        self.run, self.first, self.names = run, first, list(names)
        self.unclosed: set[str] = set()
        system = run.system
        own = [name for name in self.names if name in system.values]
        self.values = spread(dual_values(system, own), own, self.names)
        self.parts = _parts(run)
        self.followed: list[FreeInstants] = []
        self.lost = LostNumbers(self.names, first.t, first.lost)

    @property
    def notes(self) -> list[str]:
        """Where there are no derivatives."""
        return self.followed[-1].notes if self.followed else []

    @property
    def events(self) -> list[EventTime]:
        """Those of all parts."""
        return [one for part in self.followed for one in part.events]

    def at(self, instants: Array, with_loads: bool) -> DualSolution:
        """The result at some of its instants with derivatives.

        Raises
        ------
        SolveError
            As of `FreeInstants`.
        """
        t, first = np.asarray(self.run.t[instants]), self.first
        loads = len(self.run.mechanism.loads) if with_loads else 0
        system = self.run.system
        first_load = system.page_rows + 1 + 3 * len(system.drivers)
        rows = first_load + loads * system.coordinates
        values, changes = np.zeros((len(t), rows)), np.zeros((len(t), rows, len(self.names)))
        self.followed = []
        for k, run in enumerate(self.parts):
            part = FreeInstants(run, first, self.names, system)
            inside = t >= run.begun[0].first if k else np.ones(len(t), dtype=bool)
            if k < len(self.parts) - 1:
                inside &= t < run.t[-1]
            places = np.searchsorted(run.t, t[inside])
            before = self.followed[-1] if k else None
            found = part.rows(places, with_loads, before)
            self._widen(run, found, np.flatnonzero(inside), values, changes)
            self.followed.append(part)
            if k < len(self.parts) - 1:
                first = self._going_on(part, self.parts[k + 1])
        self.lost = self.followed[-1].lost
        record = DualRecord(values, changes, first_load, system.coordinates)
        return self._since_release(t, dual_solution(self.run, self.values, record), record)

    def without_derivative(self, instants: Array, _: DualRecord) -> Array:
        """As of `FreeInstants`."""
        return np.zeros(len(instants), dtype=bool)

    def _going_on(self, part: FreeInstants, after: Solution) -> FirstState:
        """The state at the end of a part as the first one of the next."""
        begun, walk = after.begun[0], part.walk
        assert walk is not None
        t, q, v = state_of(after.system, begun.start)
        n = after.system.coordinates
        accelerations = np.abs(after.record.table(slice(2 * n, 3 * n))[0])
        y = np.concatenate([q, v, first_own_states(after.system, begun.start)])
        return FirstState(t, y, walk.y.tangents, accelerations, begun.request.way)

    def _widen(
        self, run: Solution, found: DualRecord, places: Array, values: Array, changes: Array
    ) -> None:
        """Put the rows of a part where those of the whole system are."""
        whole, part = self.run.system, run.system
        to, of = phase_rows(whole, part)
        to, of = np.append(to, whole.page_rows), np.append(of, part.page_rows)
        names = [one.name for one in whole.drivers]
        signals = np.arange(3)
        for k, one in enumerate(part.drivers):
            to = np.append(to, whole.page_rows + 1 + 3 * names.index(one.name) + signals)
            of = np.append(of, part.page_rows + 1 + 3 * k + signals)
        first = whole.page_rows + 1 + 3 * len(names)
        loads = np.arange(values.shape[1] - first)
        to, of = np.append(to, first + loads), np.append(of, found.loads + loads)
        values[np.ix_(places, to)] = found.values[:, of]
        changes[np.ix_(places, to)] = found.tangents[:, of]

    def _since_release(self, t: Array, found: DualSolution, record: DualRecord) -> DualSolution:
        """Of what released drivers drove, the motion from then on."""
        system = self.run.system
        for n, driver in enumerate(system.drivers):
            free = t >= self.run.released.get(driver.name, np.inf)
            if free.any():
                row = system.page_rows + 1 + 3 * n
                for k, one in enumerate(driven_motion(found, driver)):
                    record.values[free, row + k] = one.value[free]
                    record.tangents[free, row + k] = one.tangents[free]
        return found


#: The instants of a motion over time, with derivatives.
MotionInstants: TypeAlias = FreeInstants | ReleasedInstants


def motion_instants(run: Solution, names: Sequence[str], given: bool) -> MotionInstants:
    """The instants of a motion of `simulate`; `given`: whether it begins as another result ends.

    Raises
    ------
    ModelError
        As of `first_state`.
    """
    first = first_state(run, names, given)
    kind = ReleasedInstants if run.released else FreeInstants
    return kind(run, first, list(names))


def _parts(run: Solution) -> list[Solution]:
    """The motion between releases, followed again, each part with its beginning."""
    (begun,) = run.begun
    request, system, start = begun.request, begun.system, begun.start
    gone = {name for name, t in run.released.items() if t <= request.first}
    later = {name: t for name, t in run.released.items() if name not in gone}
    last, first, found = float(run.t[-1]), request.first, list[Solution]()
    for until in [*sorted(set(later.values())), np.inf]:
        free = released(system, sorted(gone)) if gone else system
        ends = min(until, float(request.times[-1]))
        times = request.times[(request.times >= first) & (request.times <= ends)]
        times = np.union1d(times, [ends])
        part = replace(request, first=first, times=times, release={})
        one = integrate_phases(free, start, None, part, None)
        found.append(changed(one, begun=(beginning(free, start, part),)))
        if one.t[-1] >= last:
            break
        start, first = found[-1], until
        gone |= {name for name, t in later.items() if t == until}
    return found
