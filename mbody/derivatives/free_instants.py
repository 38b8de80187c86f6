"""Instants of a free motion in dual numbers: the motion once more, with derivatives by numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mbody.analysis.dynamics.repeated import REPEATED
from mbody.core.dual_number import DualNumber
from mbody.derivatives.change_times import TOLERANCES, ChangeTimes
from mbody.derivatives.dual_impacts import ImpactDuals
from mbody.derivatives.dual_motion import DualMotion, Tangents
from mbody.derivatives.dual_solution import DualRecord, DualSolution, dual_solution
from mbody.derivatives.dual_walk import DualWalk
from mbody.derivatives.event_time import EventTime
from mbody.derivatives.first_states import FirstState
from mbody.derivatives.lost_numbers import LostNumbers
from mbody.derivatives.mode_record import stretches_of
from mbody.derivatives.named_numbers import number_sizes, unit_of
from mbody.derivatives.number_tangents import dual_values, number_tangents
from mbody.derivatives.sampled_inputs import SampledInputs, reads_loads
from mbody.derivatives.unfollowed_jumps import unfollowed_jumps
from mbody.model.element import listed
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["FreeInstants", "spread"]

Array = np.ndarray

#: A change of the state, in its sizes, by a change of a number by its own size: what is less is
#: integrated with the errors of this one.
RESOLVED = 1e-3


class FreeInstants:
    """Derivatives of the instants of one motion by some numbers.

    Parameters
    ----------
    run : Solution
        Of `simulate`, of one design.
    first : FirstState
        Where the motion begins, with derivatives.
    names : iterable of str
        Dotted names of numbers of the description; those of the first state are its own.
    whole : System, optional
        With all numbers, of a motion that is a part of one of this system.
    """

    def __init__(
        self, run: Solution, first: FirstState, names: Iterable[str], whole: System | None = None
    ) -> None:
        self.run, self.first, self.names = run, first, list(names)
        self.unclosed: set[str] = set()
        system = run.system
        own = [name for name in self.names if name in system.values]
        par, mass = number_tangents(system, own)
        places = [self.names.index(name) for name in own]
        self.par = np.zeros((len(par), len(self.names)))
        self.mass = np.zeros((len(mass), len(self.names)))
        self.par[:, places], self.mass[:, places] = par, mass
        self.values = spread(dual_values(system, own), own, self.names)
        self.resolved = _resolved(whole or system, self.names)
        self.sizes = number_sizes(whole or system, self.names)
        self.stretches = stretches_of(run)
        self.lost = self._nothing_lost()
        self.events: list[EventTime] = []
        self.walk: DualWalk | None = None

    @property
    def notes(self) -> list[str]:
        """Where there are no derivatives."""
        sampled = [] if self.walk is None else self.walk.inputs.notes
        return [*self.lost.notes(self.run.mechanism.units.time), *sampled]

    def at(self, instants: Array, with_loads: bool) -> DualSolution:
        """The result at some of its instants with derivatives.

        Raises
        ------
        SolveError
            Where a user's function failed, or the steps vanish.
        """
        return dual_solution(self.run, self.values, self.rows(instants, with_loads))

    def rows(
        self, instants: Array, with_loads: bool, before: FreeInstants | None = None
    ) -> DualRecord:
        """The rows of these instants; `before`: the part of the motion that this one goes on from.

        Raises
        ------
        SolveError
            As of `at`.
        """
        first, system = self.first, self.run.system
        motion = DualMotion(
            self.run,
            first.way,
            first.y[system.coordinates : 2 * system.coordinates],
            first.accelerations,
            with_loads or reads_loads(self.run),
        )
        self.lost = self._nothing_lost()
        if before is not None:
            self.lost.why = before.lost.why | self.lost.why
        times = ChangeTimes(self.run, motion, self.values, self.lost)
        uni = motion.uni
        tangents = Tangents(
            self.par,
            self.mass,
            np.zeros((len(uni.layout.switched), len(self.names))),
            self.par[uni.phase_rows],
            np.zeros((len(motion.held), len(self.names))),
            self.resolved,
        )
        impacts = ImpactDuals(uni, self.values, DualNumber(system.mass[:, 0], self.mass))
        inputs = SampledInputs(self.run, motion, self.values, self.sizes, self.lost)
        if before is not None and before.walk is not None:
            inputs.go_on_from(before.walk.inputs)
        self.walk = DualWalk(motion, first, self.stretches, tangents, times, impacts, inputs)
        pages = self.walk.pages(np.array(self.run.t[instants]))
        self._compare(motion, pages, instants)
        self.events = times.events
        return DualRecord(pages.value, pages.tangents, motion.first_load, system.coordinates)

    def _compare(self, motion: DualMotion, pages: DualNumber, instants: Array) -> None:
        """Controllers that are no functions of what they read make another motion each time."""
        machine, n = self.run.mechanism, 2 * self.run.system.coordinates
        if not machine.controllers:
            return
        kept = self.run.record.table(slice(0, n))[instants]
        apart = np.abs(pages.value[:, :n] - kept) / (motion.scale[:n] + np.abs(kept))
        if float(apart.max(initial=0.0)) <= max(REPEATED, TOLERANCES * motion.way.rtol):
            return
        names = listed([one.name for one in machine.controllers])
        why = f"followed again the motion is another: {names} must be functions of what they read"
        self.lost.lose(True, self.first.t, f"{why}, or objects, which are copied with their memory")
        pages.tangents[:] = np.nan

    def without_derivative(self, instants: Array, _: DualRecord) -> Array:
        """Which of some instants have no derivatives by any number, (instants,): none; what has
        none by some numbers has NaN.
        """
        return np.zeros(len(instants), dtype=bool)

    def _nothing_lost(self) -> LostNumbers:
        """The numbers that have no derivatives from the beginning on."""
        found = LostNumbers(self.names, self.first.t, self.first.lost)
        for why, which in unfollowed_jumps(self.run.system, self.values).items():
            found.lose(which, self.first.t, why)
        return found


def _resolved(system: System, names: Sequence[str]) -> Array:
    """Of each number the tangents, in sizes of the state, below which errors do not count.

    A mass by which a pendulum does not swing otherwise has tangents of rounding alone, which no
    step is short enough for. A number that is zero has the greatest size of its unit.
    """
    sizes = number_sizes(system, names)
    units = [unit_of(system.mechanism, name) for name in names]
    for k in np.flatnonzero(sizes == 0.0):
        alike = [one for one in system.values if unit_of(system.mechanism, one) == units[k]]
        sizes[k] = number_sizes(system, alike).max(initial=0.0)
    sizes[sizes == 0.0] = np.inf
    return RESOLVED / sizes


def spread(values: dict[str, Any], own: list[str], names: list[str]) -> dict[str, Any]:
    """Dual numbers by the numbers of the description, as such by all the names."""
    places = [names.index(name) for name in own]
    found = dict(values)
    for name, one in values.items():
        if isinstance(one, DualNumber):
            tangents = np.zeros(len(names))
            tangents[places] = one.tangents
            found[name] = DualNumber(one.value, tangents)
    return found
