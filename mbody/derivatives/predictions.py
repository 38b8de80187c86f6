"""What a mechanism with other numbers would have shown in place of measured histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbody.analysis.dynamics.simulate import simulate
from mbody.derivatives.data_series import DataSeries
from mbody.derivatives.gradient import gradient
from mbody.derivatives.prepared_gradient import PreparedGradient
from mbody.errors import ModelError, SolveError
from mbody.solution.measures import measured
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["DrivenPrediction", "FreePrediction"]

Array = np.ndarray

#: Steps of differences of free motions, of the size of a number: their truncation is 1e-8 of a
#: derivative, and the error of the integrator, `RTOL`, 1e-6.
STEP = 1e-4
#: By default error of a step of free motions whose differences are taken.
RTOL = 1e-10


class DrivenPrediction:
    """Histories of a driven analysis with exact derivatives."""

    exact = True
    #: The result with the last numbers.
    run: Solution

    def __init__(
        self,
        system: System,
        series: DataSeries,
        names: Sequence[str],
        analysis: str,
        options: Mapping[str, Any],
    ) -> None:
        own = system.with_values(series.known) if series.known else system
        self.shape = series.values.shape
        how = {**options, **series.instants}
        self.prepared = PreparedGradient(own, dict(series.measures), names, analysis, **how)

    def at(self, numbers: Array) -> tuple[Array, Any]:
        """Values (columns, instants), and what makes derivatives of them."""
        point = self.prepared.at(numbers)
        self.run = point.run
        return point.value.reshape(self.shape), point

    def jacobian(self, point: Any) -> Array:
        """Derivatives (columns, instants, numbers)."""
        return np.asarray(point.jacobian.reshape(*self.shape, -1))


class FreePrediction:
    """Histories of `simulate`, with exact derivatives where there are, else differences."""

    #: The result with the last numbers.
    run: Solution

    def __init__(
        self,
        system: System,
        series: DataSeries,
        names: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        self.system = system.with_values(series.known) if series.known else system
        self.names, self.measures = list(names), dict(series.measures)
        self.shape = series.values.shape
        t = series.instants["t"]
        # a motion has its beginning, whether it was measured or not
        self.first = 0 if t[0] == 0.0 else 1
        times = t if self.first == 0 else np.concatenate([[0.0], t])
        self.options = {"rtol": RTOL, **options, "until": float(t[-1]), "times": times}
        lengths = max(self.system.length, 1e-300)
        self.sizes = np.array(
            [abs(float(self.system.values[name])) or lengths for name in self.names]
        )
        try:
            self.exact = bool(np.isfinite(self._gradient(self.system)).all())
        except (ModelError, SolveError):
            # methods and beginnings whose motions have no derivatives
            self.exact = False
        self.least = np.array([0.0 if self.system.rule(n)[0] else -np.inf for n in self.names])

    def at(self, numbers: Array) -> tuple[Array, Any]:
        """Values (columns, instants), and where they are."""
        return self._histories(numbers[None, :])[:, 0], numbers

    def jacobian(self, numbers: Any) -> Array:
        """Derivatives (columns, instants, numbers)."""
        if self.exact:
            values = dict(zip(self.names, numbers.tolist(), strict=True))
            found = self._gradient(self.system.with_values(values))
            # NaN where changes of modes have no derivative
            if np.isfinite(found).all():
                return found
        return self._differences(numbers)

    def _gradient(self, system: System) -> Array:
        found = gradient(system, self.measures, self.names, "simulate", **self.options).jacobian
        return np.asarray(found.reshape(len(self.measures), -1, len(self.names))[:, self.first :])

    def _differences(self, numbers: Array) -> Array:
        """By two differences each; where a number may not be less, to one side, of second order
        too.
        """
        count = len(numbers)
        steps = STEP * np.maximum(np.abs(numbers), self.sizes)
        one_sided = numbers - steps < self.least
        low = np.where(one_sided, 2.0, -1.0)
        here = np.repeat(numbers[None, :], 2 * count + 1, axis=0)
        for k in range(count):
            here[2 * k, k] += steps[k]
            here[2 * k + 1, k] += low[k] * steps[k]
        found = self._histories(here)
        middle = found[:, -1]
        parts = []
        for k in range(count):
            ahead, other = found[:, 2 * k], found[:, 2 * k + 1]
            if one_sided[k]:
                parts.append((4.0 * ahead - other - 3.0 * middle) / (2.0 * steps[k]))
            else:
                parts.append((ahead - other) / (2.0 * steps[k]))
        return np.stack(parts, axis=-1)

    def _histories(self, designs: Array) -> Array:
        """(columns, designs, instants)."""
        found = np.empty((len(self.measures), len(designs), *self.shape[1:]))
        for n, design in enumerate(designs.tolist()):
            system = self.system.with_values(dict(zip(self.names, design, strict=True)))
            self.run = run = simulate(system, **self.options)
            if run.t[-1] < self.options["until"]:
                unit = run.mechanism.units.time
                raise SolveError(
                    f"fit: the motion is {run.status}, at t = {run.t[-1]:.6g} {unit}, data go on "
                    f"to {self.options['until']:.6g} {unit}: leave out those that come later"
                )
            for row, measure in zip(found, self.measures.values(), strict=True):
                row[n] = measured(run, measure)[0][self.first :]
        return found
