"""Where the rates that drivers prescribe jump, as at the points of a table in straight lines.

There the driver gives an impulse μ, and velocities jump with it: M (v⁺ − v⁻) = Gᵀ μ, G v⁺ = ν⁺. Its
work is μ (ν⁻ + ν⁺)/2. Steps end just before such a time, so that no step sees two rates.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.kernels.layout import Layout, Work
from mbody.kernels.loop_closure import laws_of_time, violation
from mbody.kernels.step_state import JACOBIAN_VALID, TIME
from mbody.laws import Table
from mbody.laws.measured_formula import MeasuredFormula
from mbody.solution.energy import causes
from mbody.system.rank import dense, dense_rates
from mbody.system.system import System

__all__ = ["RateJumps", "jump_times", "works_of_drivers"]

Array = np.ndarray

#: Rates that differ by less than this part of the greatest are the same.
SAME = 1e-12


def jump_times(system: System, first: float, until: float) -> Array:
    """Times after `first`, up to `until`, at which the rate of a driver may jump, ascending: points
    of its own table in straight lines, or of inputs that its formula may follow.
    """
    drivers = system.mechanism.drivers
    laws = [getattr(one, "law", None) for one in drivers]
    if any(isinstance(law, MeasuredFormula) for law in laws):
        laws += [one.value for one in system.mechanism.inputs]
    beyond = float(np.nextafter(until, np.inf))
    found = [
        law.corners(first, beyond)
        for law in laws
        if isinstance(law, Table) and law.interpolation == "linear"
    ]
    return np.unique(np.concatenate(found)) if found else np.empty(0)


def works_of_drivers(
    system: System, work: Work, momentum: Array, nu: Array, sticking: Array | None = None
) -> dict[str, float]:
    """What drivers give, by name, where velocities jump at the position in the workspace.

    Parameters
    ----------
    momentum : array (coordinates,)
        M Δv less the impulses of what else acts, that is Gᵀ μ of the rows that hold.
    nu : array (rows,)
        The rates at which drivers move their rows; of rates that jump the mean.
    sticking : array (rows, coordinates), optional
        Rows of what sticks, which hold too.
    """
    if not system.drivers:
        return {}
    scale = system.coordinate_units
    rows = dense(system, work)[1]
    count = len(rows)
    if sticking is not None and len(sticking):
        rows = np.vstack([rows, sticking * scale])
    works = np.linalg.lstsq(rows.T, momentum * scale, rcond=None)[0][:count] * nu
    owners = [system.owners[int(e)][0].name for e in system.row_table[0]]
    found = dict.fromkeys((driver.name for driver in system.drivers), 0.0)
    for name, part in zip(owners, works, strict=True):
        if name in found:
            found[name] += float(part)
    return found


class RateJumps:
    """The part of an integration that passes such times."""

    system: System
    layout: Layout
    work: Work
    y: Array
    K: Array
    state: Array
    motion: Any
    steps: Any
    work_done: Array

    def evaluate(self) -> bool:
        """Project the state, evaluate its derivative and its page; whether the loops close."""
        raise NotImplementedError

    def _check_finite(self, K: Array, t: float) -> None:
        raise NotImplementedError

    def _pass_jump(self, corner: float) -> None:
        """Go from just before a time to it: velocities jump with the rates of the drivers."""
        work, n = self.work, self.system.coordinates
        work.q[:n, 0], v = self.y[:n], self.y[n : 2 * n].copy()
        before, after = (self._prescribed(t) for t in (float(self.state[TIME]), corner))
        self.state[TIME] = corner
        size = max(np.abs(before).max(initial=0.0), np.abs(after).max(initial=0.0))
        if not np.abs(after - before).max(initial=0.0) > SAME * size:
            return
        self._loosen()
        self.evaluate()
        self._check_finite(self.K, corner)
        work.q[:n, 0] = self.y[:n]
        momentum = self.system.mass[:n, 0] * (self.y[n : 2 * n] - v)
        self._give(works_of_drivers(self.system, work, momentum, 0.5 * (before + after)))
        self.state[JACOBIAN_VALID] = 0.0
        self.steps.jumped(self.motion)
        self._settle_jump()

    def _prescribed(self, t: float) -> Array:
        """ν of every row at a time, the position being in the workspace; lengths by the model
        length.
        """
        self.work.time[0, 0] = t
        laws_of_time(self.layout, self.work)
        violation(self.layout, self.work)
        return dense_rates(self.system, self.work)

    def _loosen(self) -> None:
        """What does not hold where drivers jerk holds no more."""

    def _settle_jump(self) -> None:
        """What follows at once from velocities that jumped with drivers."""

    def _give(self, works: Mapping[str, float]) -> None:
        """Add what drivers gave at one instant to the work since the beginning."""
        names, gained = causes(self.system), self._gained
        for name, part in works.items():
            gained[names.index(name)] += part

    @property
    def _gained(self) -> Array:
        """Work of every cause since the beginning, in place."""
        return np.asarray(self.work_done[-1])
