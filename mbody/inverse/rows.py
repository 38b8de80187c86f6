"""What is left of conditions at one instant, with exact derivatives by the unknowns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.analysis.inverse.conditions import Relation
from mbody.core.dual_number import DualNumber
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.errors import ModelError, SolveError
from mbody.inverse.roots import Affine, differences
from mbody.inverse.trials import Trials
from mbody.model.study import Measure
from mbody.solution.measures import valued
from mbody.solution.solution import Solution

__all__ = ["ConditionRows"]

Array = np.ndarray
_FIRST = np.array([0])


class ConditionRows:
    """right − left of every relation, then the objective, as functions of the unknowns in steps.

    Parameters
    ----------
    trials : Trials
    relations : sequence of Relation
    objective : str
        A quantity, empty where there is none.
    """

    def __init__(self, trials: Trials, relations: Sequence[Relation], objective: str) -> None:
        self.trials, self.relations, self.objective = trials, list(relations), objective

    def __call__(self, us: Array) -> tuple[Array, Array]:
        """Values and the size of their terms, (trials, rows) each; NaN where a trial fails."""
        return self.trials.rows(self.relations, self.objective, us)

    def about(self, u: Array) -> Affine | None:
        """Values and slopes at a place; None where the trial fails."""
        run = self.trials.reached(u)
        if run is None:
            return None
        slope = self._slopes(run)
        if slope is None or not np.isfinite(slope).all():
            return differences(self, u)
        rest, size = self.trials.measured(run, self.relations, self.objective)
        if not np.isfinite(rest).all():
            return None
        terms = np.abs(slope) @ np.maximum(1.0, np.abs(u))
        return Affine(u, rest, slope, np.maximum(size, terms))

    def _slopes(self, run: Solution) -> Array | None:
        """Derivatives of all rows by the unknowns, (rows, unknowns); None where there are none."""
        names, ways = self.trials.numbers
        instants = DrivenInstants(run, names)
        try:
            whole = instants.at(_FIRST, self.trials.with_loads)
            if instants.unclosed or instants.without_derivative(_FIRST, whole.record).any():
                return None
            rows = [
                self._slope(whole, one.right, len(names)) - self._slope(whole, one.left, len(names))
                for one in self.relations
            ]
            last = np.zeros(len(names))
            if self.objective:
                last = self._slope(whole, self.objective, len(names))
        except (TypeError, ModelError, SolveError):  # as of users' compiled functions
            return None
        return np.asarray(np.vstack([*rows, last]) @ ways)

    @staticmethod
    def _slope(whole: object, text: str, count: int) -> Array:
        history, _, _ = valued(whole, Measure(text))  # type: ignore[arg-type]
        if not isinstance(history, DualNumber):
            return np.zeros(count)
        return np.array(np.broadcast_to(history.tangents, (1, count))[-1])
