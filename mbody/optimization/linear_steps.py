"""The end of a search: linear programs within a trust region.

Where an optimum is a corner of several limits and peaks, sequential quadratic programming may stop
short of it. There each linear program, of all rows at the design, within a box that shrinks where
it promised more than the design keeps, leads on quadratically (sequential linear programming;
Fletcher, *Practical Methods of Optimization*, 1987, section 14.4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["Linearized", "linear_steps"]

#: The first box and the least, as parts of the ranges; steps; what is gained by the last.
FIRST, LEAST, STEPS, GAIN = 0.02, 1e-8, 40, 1e-9
#: How much more than its multipliers a broken limit counts.
HEAVIER = 2.0


@dataclass(frozen=True)
class Linearized:
    """A design and all rows about it, as parts of sizes and ranges.

    Attributes
    ----------
    u : array (numbers,)
        Between 0 and 1.
    aims, by_aims : array (rows,), (rows, numbers)
        Of which the greatest is to be least.
    limits, by_limits : array (rows,), (rows, numbers)
        Not to be negative.
    equal, by_equal : array (rows,), (rows, numbers)
        To be zero.
    """

    u: np.ndarray
    aims: np.ndarray
    by_aims: np.ndarray
    limits: np.ndarray
    by_limits: np.ndarray
    equal: np.ndarray
    by_equal: np.ndarray

    def merit(self, weight: float) -> float:
        """What is least, with the sum of what is broken by its weight."""
        broken = max(0.0, -float(self.limits.min(initial=0.0)))
        return float(self.aims.max()) + weight * (broken + float(np.abs(self.equal).sum()))


def linear_steps(start: Linearized, look: Callable[[np.ndarray], Linearized | None]) -> Linearized:
    """The end of linear steps from a design; `look` gives the rows about a place, None where the
    design cannot be analysed.
    """
    here, box, weight = start, FIRST, 10.0
    for _ in range(STEPS):
        step = _step(here, box)
        if step is None:
            return here
        way, promised, heaviest = step
        weight = max(weight, HEAVIER * heaviest)
        now = here.merit(weight)
        foretold = now - promised
        if foretold <= GAIN * max(abs(now), 1e-300):
            return here
        there = look(np.clip(here.u + way, 0.0, 1.0))
        gained = -1.0 if there is None else (now - there.merit(weight)) / foretold
        if there is not None and gained > 1e-2:
            here = there
            box = min(1.0, 2.0 * box) if gained > 0.75 else box
        if gained < 0.25:
            box = 0.25 * float(np.abs(way).max())
        if box < LEAST:
            return here
    return here


def _step(at: Linearized, box: float) -> tuple[np.ndarray, float, float] | None:
    """The step that is best to first order, the merit that it promises with what it must leave
    broken, and the greatest sum of multipliers.
    """
    from scipy.optimize import linprog

    n = len(at.u)
    near = at.limits - np.abs(at.by_limits).sum(axis=1) * box <= 0.0
    near |= at.limits <= at.limits.min(initial=np.inf)
    own, slopes = at.limits[near], at.by_limits[near]
    top = at.aims + np.abs(at.by_aims).sum(axis=1) * box
    high = top >= at.aims.max() - np.abs(at.by_aims[at.aims.argmax()]).sum() * box
    aims, by_aims = at.aims[high], at.by_aims[high]
    # unknowns: the step, z above all aims, s ≥ 0 by which limits may stay broken, ± of equations
    free = len(at.equal)
    cost = np.concatenate([np.zeros(n), [1.0, 1e4], np.full(2 * free, 1e4)])
    above = np.column_stack(
        [by_aims, -np.ones((len(aims), 1)), np.zeros((len(aims), 1 + 2 * free))]
    )
    below = np.column_stack(
        [-slopes, np.zeros((len(own), 1)), -np.ones((len(own), 1)), np.zeros((len(own), 2 * free))]
    )
    equal = np.column_stack([at.by_equal, np.zeros((free, 2)), np.eye(free), -np.eye(free)])
    bounds = [(max(-box, -u), min(box, 1.0 - u)) for u in at.u]
    bounds += [(None, None), (0.0, None)] + [(0.0, None)] * (2 * free)
    found = linprog(
        cost,
        A_ub=np.vstack([above, below]),
        b_ub=np.concatenate([-aims, own]),
        A_eq=equal if free else None,
        b_eq=-at.equal if free else None,
        bounds=bounds,
        method="highs",
    )
    if found.status != 0:
        return None
    way, z, slack = found.x[:n], float(found.x[n]), float(found.x[n + 1])
    left = slack + float(found.x[n + 2 :].sum())
    pulls = np.abs(found.ineqlin.marginals[len(aims) :]).sum()
    heaviest = min(float(pulls), 1e3) if len(own) else 0.0
    if free:
        heaviest = max(heaviest, min(float(np.abs(found.eqlin.marginals).max()), 1e3))
    weight = max(10.0, HEAVIER * heaviest)
    return way, z + weight * left, heaviest
