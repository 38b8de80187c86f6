"""Instants of a free motion in dual numbers: the motion once more, with derivatives by numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mbody.analysis.dynamics.initial_step import REFINEMENTS, coordinate_sizes
from mbody.analysis.dynamics.own_states import own_sizes
from mbody.analysis.position.assembly_analysis import SOFT, raise_user_error
from mbody.core.dual_number import DualNumber
from mbody.core.duals import TANGENTS
from mbody.core.lanes import LANES, aligned
from mbody.derivatives.dual_solution import DualRecord, DualSolution, dual_solution
from mbody.derivatives.first_states import FirstState
from mbody.derivatives.named_numbers import number_sizes, unit_of
from mbody.derivatives.number_tangents import dual_values, number_tangents
from mbody.errors import SolveError
from mbody.kernels.free_duals import NEXT_LENGTH, T_NOW, FreeDuals, free_duals
from mbody.kernels.layout import Work, stand_ins
from mbody.kernels.step_state import DONE
from mbody.kernels.tableaus import order_8
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["FreeInstants"]

#: Steps from one instant to the next, at most.
STEPS = 20_000

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
    """

    def __init__(self, run: Solution, first: FirstState, names: Iterable[str]) -> None:
        self.run, self.first, self.names = run, first, list(names)
        self.unclosed: set[str] = set()
        own = [name for name in self.names if name in run.system.values]
        par, mass = number_tangents(run.system, own)
        places = [self.names.index(name) for name in own]
        self.par = np.zeros((len(par), len(self.names)))
        self.mass = np.zeros((len(mass), len(self.names)))
        self.par[:, places], self.mass[:, places] = par, mass
        self._resolved = _resolved(run.system, self.names)

    def at(self, instants: np.ndarray, with_loads: bool) -> DualSolution:
        """The result at some of its instants with derivatives.

        Raises
        ------
        SolveError
            Where a user's function failed, or the steps vanish.
        """
        system, count = self.run.system, len(self.names)
        loads = len(system.mechanism.loads) if with_loads else 0
        first_load = system.page_rows + 1 + 3 * len(system.drivers)
        rows = first_load + loads * system.coordinates
        values = np.empty((len(instants), rows))
        tangents = np.zeros((len(instants), rows, max(count, 1)))
        for begin in range(0, max(count, 1), TANGENTS):
            part = slice(begin, min(begin + TANGENTS, count))
            output = self._followed(np.array(self.run.t[instants]), part, rows, loads)
            values[:] = output[:, :, 0]
            tangents[:, :, part] = output[:, :, 1 : 1 + part.stop - part.start]
        record = DualRecord(values, tangents, first_load, system.coordinates)
        own = [name for name in self.names if name in system.values]
        return dual_solution(self.run, _spread(dual_values(system, own), own, self.names), record)

    def without_derivative(self, instants: np.ndarray, _: DualRecord) -> np.ndarray:
        """Which of some instants have no derivatives, (instants,): none of a smooth motion."""
        return np.zeros(len(instants), dtype=bool)

    def _followed(self, t: np.ndarray, part: slice, rows: int, loads: int) -> np.ndarray:
        """Values and tangents of some of the numbers at rising times: (instants, rows, lanes)."""
        system, way, method = self.run.system, self.first.way, order_8()
        # one row more than the state has: a constant, below which tangents are not resolved
        size, stages = system.state_count + 1, len(method.B)
        light = stand_ins(system.layout, system.mass, system.length).any()
        regularization = SOFT * bool(self.run.regularization)
        y = aligned(size, LANES)
        width = part.stop - part.start
        y[:-1, 0], y[:-1, 1 : 1 + width] = self.first.y, self.first.tangents[:, part]
        y[-1, 1 : 1 + width] = self._resolved[part]
        n3 = system.coordinates
        rates = self.first.y[n3 : 2 * n3]
        sizes = coordinate_sizes(system.length, rates, self.first.accelerations)
        state = np.zeros(4)
        state[T_NOW] = self.first.t
        state[NEXT_LENGTH] = 1e-4 * max(float(t[-1]) - self.first.t, 1e-12)
        free = FreeDuals(
            t=t,
            relative=way.rtol,
            absolute=way.atol,
            regularization=regularization,
            refinements=1 + REFINEMENTS if light or regularization else 0,
            rows=system.page_rows,
            loads=loads,
            scale=np.concatenate([sizes, own_sizes(system), [1.0]]),
            state=state,
            y=y,
            K=np.zeros((stages + 1, size, LANES)),
            stage=aligned(size, LANES),
            end=aligned(size, LANES),
            error=np.zeros((2, size, LANES)),
            output=np.zeros((len(t), rows, LANES)),
        )
        code = free_duals(system.runtime(), self._work(part), method, free, STEPS)
        raise_user_error(system)
        if code != DONE or not np.isfinite(free.output).all():
            unit = system.mechanism.units.time
            raise SolveError(
                f"the derivatives of the motion of '{system.mechanism.name}' cannot be followed "
                f"beyond t = {state[T_NOW]:.6g} {unit}, it is stiff there: keep more "
                "instants, or take differences by sweep"
            )
        output: np.ndarray = free.output
        return output

    def _work(self, part: slice) -> Work:
        """A workspace of dual numbers, with weights of free motion."""
        work = self.run.system.work(LANES, masses=True)
        work.memory[:, 1:] = 0.0
        width = slice(1, 1 + part.stop - part.start)
        work.par[:, width] = self.par[:, part]
        work.mass[: len(self.mass), width] = self.mass[:, part]
        # weights are inverses, 1/m with the change −dm/m², of shares of the masses; what stands in
        # for a missing mass does not change
        L = self.run.system.layout
        share = 1.0 / np.bincount(L.slot_body, minlength=L.bodies)[L.slot_body]
        own = work.mass.reshape(-1, 3, LANES)[L.slot_body] * share[:, None, None]
        weights = work.weight[: 3 * L.slots].reshape(L.slots, 3, LANES)
        there = np.abs(own[:, :, 0] * weights[:, :, 0] - 1.0) < 1e-9
        slopes = -own[:, :, width] * np.square(weights[:, :, :1])
        weights[:, :, width] = np.where(there[:, :, None], slopes, 0.0)
        return work


def _resolved(system: System, names: Sequence[str]) -> np.ndarray:
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


def _spread(values: dict[str, Any], own: list[str], names: list[str]) -> dict[str, Any]:
    """Dual numbers by the numbers of the description, as such by all the names."""
    places = [names.index(name) for name in own]
    found = dict(values)
    for name, one in values.items():
        if isinstance(one, DualNumber):
            tangents = np.zeros(len(names))
            tangents[places] = one.tangents
            found[name] = DualNumber(one.value, tangents)
    return found
