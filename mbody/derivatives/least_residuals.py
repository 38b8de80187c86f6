"""The numbers with the least sum of squares of residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mbody.derivatives.fit_problem import FitProblem
from mbody.derivatives.identifiability import Identified, identified
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed

__all__ = ["BestNumbers", "best_numbers"]

Array = np.ndarray

#: Where a singular value is zero: exact derivatives, and differences.
ZERO = {True: 1e-9, False: 1e-5}
#: Passes that find the deviations of several columns from their residuals, and when they end.
PASSES, SETTLED = 12, 1e-3
#: A deviation is at least this part of the greatest datum of a column.
LEAST = 1e-12
#: How often what is held is chosen anew.
CHOICES = 4


@dataclass(frozen=True, eq=False)
class BestNumbers:
    """The least sum of squares.

    Attributes
    ----------
    numbers : array (unknowns,)
        Values, then offsets.
    sigma : array (columns,)
        Deviations of the columns by which residuals are divided.
    known : Identified
        What the data determine, by the derivatives there.
    settled : bool
    """

    numbers: Array
    sigma: Array
    known: Identified
    settled: bool


def best_numbers(
    problem: FitProblem,
    units: Mapping[str, str],
    bounds: tuple[Array, Array],
    deviations: Mapping[str, float] | None,
) -> BestNumbers:
    """The best numbers. Where data leave directions open, one unknown of each is held as it is.

    Raises
    ------
    ModelError
        For deviations that do not fit the columns, and where no unknown changes any datum.
    SolveError
        Where the start has no histories.
    """
    search = _ResidualSearch(problem, units, bounds)
    given = _given(problem, deviations)
    sigma = problem.ranges() if given is None else given
    numbers = np.concatenate([problem.start, np.zeros(len(problem.shifts))])
    numbers, known = search.best(numbers, sigma)
    if given is None and len(problem.columns) > 1:
        for _ in range(PASSES):
            squares, counts = problem.sizes(numbers)
            # each column bears its part of the unknowns
            free = np.maximum(counts * (1.0 - known.rank / problem.count), 1.0)
            new = np.maximum(np.sqrt(squares / free), LEAST * problem.ranges())
            done = np.abs(new / sigma - 1.0).max() <= SETTLED
            sigma = new
            numbers, known = search.best(numbers, sigma)
            if done:
                break
    return BestNumbers(numbers, sigma, known, search.settled)


class _ResidualSearch:
    """Least squares of one problem with different deviations of its columns."""

    def __init__(
        self, problem: FitProblem, units: Mapping[str, str], bounds: tuple[Array, Array]
    ) -> None:
        self.problem, self.units, self.bounds = problem, units, bounds
        self.settled = True

    def best(self, start: Array, sigma: Array) -> tuple[Array, Identified]:
        """The least from a start, and what is known there."""
        numbers, known = start, self._known(start, sigma)
        for _ in range(CHOICES):
            held = list(known.pivots)
            free = np.array([k for k in range(len(start)) if k not in held], dtype=int)
            if not len(free):
                raise ModelError(
                    f"fit: none of {listed(self.units)} changes any of the data: measure others"
                )
            numbers = self._least(numbers, sigma, free)
            known = self._known(numbers, sigma)
            if known.rank <= len(free):
                break
        return numbers, known

    def _known(self, numbers: Array, sigma: Array) -> Identified:
        system = self.problem.system
        first = np.concatenate([self.problem.start, np.zeros(len(self.problem.shifts))])
        sizes = np.maximum(np.abs(numbers), np.abs(first))
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        lengths = np.array([unit == system.mechanism.units.length for unit in self.units.values()])
        sizes = np.where(lengths, np.maximum(sizes, system.length), sizes)
        jacobian = self.problem.jacobian(numbers, sigma)
        return identified(jacobian, list(self.units), self.units, sizes, ZERO[self.problem.exact])

    def _least(self, start: Array, sigma: Array, free: Array) -> Array:
        """The least by some of the unknowns, the others as they are."""
        from scipy.optimize import least_squares

        problem, bounds = self.problem, (self.bounds[0][free], self.bounds[1][free])
        # by what they change, so that no unit has a say in when the gradient is small
        effect = np.linalg.norm(problem.jacobian(start, sigma)[:, free], axis=0)
        unit = 1.0 / np.where(effect > 0.0, effect, 1.0)

        def whole(part: Array) -> Array:
            numbers = start.copy()
            numbers[free] = np.clip(unit * part, *bounds)
            return numbers

        def residual(part: Array) -> Array:
            try:
                return problem.residual(whole(part), sigma)
            except (SolveError, ModelError):
                # a design that does not close: the step becomes shorter
                return np.full(problem.count, np.inf)

        found = least_squares(
            residual,
            np.clip(start[free] / unit, bounds[0] / unit, bounds[1] / unit),
            lambda part: unit * problem.jacobian(whole(part), sigma)[:, free],
            bounds=(bounds[0] / unit, bounds[1] / unit),
            x_scale="jac",
            **{"ftol": 1e-12, "xtol": 1e-12, "gtol": 1e-14, "max_nfev": 200},
        )
        self.settled = bool(found.status != 0)
        return whole(found.x)


def _given(problem: FitProblem, given: Mapping[str, float] | None) -> Array | None:
    if given is None:
        return None
    given = {problem.column(name, "a deviation"): value for name, value in given.items()}
    for name in problem.columns:
        value = given.get(name)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not 0.0 < value < math.inf
        ):
            raise ModelError(
                f"fit: the deviation of '{name}' is {brief(value)}: give each column a positive "
                "number",
                name,
            )
    return np.array([float(given[name]) for name in problem.columns])
