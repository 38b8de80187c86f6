"""Data less fit of measured histories, with derivatives by the unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbody.derivatives.data_series import DataSeries, split_heading
from mbody.derivatives.predictions import DrivenPrediction, FreePrediction
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.solution.measures import check_measure
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["FitProblem"]

Array = np.ndarray


class FitProblem:
    """Residuals of all runs, with their derivatives."""

    def __init__(
        self,
        system: System,
        series: Sequence[DataSeries],
        names: Mapping[str, str],
        analysis: str,
        offsets: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        self.system, self.series = system, series
        own = list(names.values())
        self.runs: list[Any] = [
            FreePrediction(system, one, own, options)
            if analysis == "simulate"
            else DrivenPrediction(system, one, own, analysis, options)
            for one in series
        ]
        self.exact = all(run.exact for run in self.runs)
        self.start = np.array([float(system.values[name]) for name in own])
        self.columns = list(series[0].measures)
        self.units = {
            name: check_measure(system.mechanism, one) for name, one in series[0].measures.items()
        }
        self.masks = [np.isfinite(one.values) for one in series]
        self.count = sum(int(mask.sum()) for mask in self.masks)
        self.shifts = self._shifts(offsets)
        self.evaluations = 0
        self._last: tuple[bytes, list[Any]] | None = None

    def column(self, given: Any, what: str) -> str:
        """The name of a column that is named by it or by its heading, "slider.x [mm]"; what is
        given of it, such as "an offset", is in the sentence where there is no such column.
        """
        for name in (split_heading(given)[0] if isinstance(given, str) else given, given):
            if name in self.columns:
                return str(name)
        raise ModelError(
            f"fit: there is no column {brief(given)} with {what} (there are: "
            f"{listed(self.columns)})",
            str(given),
        )

    def _shifts(self, offsets: Sequence[str]) -> dict[str, tuple[int, str]]:
        """Names of the offsets, and the run and column of each."""
        given = [offsets] if isinstance(offsets, str) else list(offsets)
        wanted = [self.column(name, "an offset") for name in given]
        several = len(self.series) > 1
        return {
            _shift(name, n + 1 if several else 0): (n, name)
            for name in wanted
            for n in range(len(self.series))
        }

    def _found(self, numbers: Array) -> list[Any]:
        """Histories of all runs, and what makes their derivatives; those of the last numbers are
        kept.
        """
        key = numbers.tobytes()
        if self._last is None or self._last[0] != key:
            own = numbers[: len(self.start)]
            self._last = key, [run.at(own) for run in self.runs]
            self.evaluations += 1
        return self._last[1]

    def results(self, numbers: Array) -> list[Solution]:
        """The results of all runs."""
        for run in self.runs:
            run.at(numbers[: len(self.start)])
        return [run.run for run in self.runs]

    def histories(self, numbers: Array) -> list[Array]:
        """Data less fit of every run, (columns, instants)."""
        found = []
        for n, (values, _) in enumerate(self._found(numbers)):
            values = values.copy()
            for k, (run, name) in enumerate(self.shifts.values()):
                if run == n:
                    values[self.columns.index(name)] += numbers[len(self.start) + k]
            found.append(self.series[n].values - values)
        return found

    def residual(self, numbers: Array, sigma: Array) -> Array:
        """Fit less data by the deviations of the columns, all in a row."""
        parts = [
            (-left / sigma[:, None])[mask]
            for left, mask in zip(self.histories(numbers), self.masks, strict=True)
        ]
        return np.concatenate(parts)

    def jacobian(self, numbers: Array, sigma: Array) -> Array:
        """Its derivatives, (data, unknowns)."""
        rows = []
        for n, (_, point) in enumerate(self._found(numbers)):
            own = self.runs[n].jacobian(point)
            shifts = np.zeros((*own.shape[:2], len(self.shifts)))
            for k, (run, name) in enumerate(self.shifts.values()):
                if run == n:
                    shifts[self.columns.index(name), :, k] = 1.0
            whole = np.concatenate([own, shifts], axis=-1) / sigma[:, None, None]
            rows.append(whole[self.masks[n]])
        return np.concatenate(rows)

    def sizes(self, numbers: Array) -> tuple[Array, Array]:
        """Sum of squares and number of the residuals of each column."""
        squares, counts = np.zeros(len(self.columns)), np.zeros(len(self.columns))
        for left, mask in zip(self.histories(numbers), self.masks, strict=True):
            squares += np.square(np.where(mask, left, 0.0)).sum(axis=1)
            counts += mask.sum(axis=1)
        return squares, counts

    def ranges(self) -> Array:
        """How far the data of each column go."""
        rows = [
            np.concatenate([one.values[k] for one in self.series]) for k in range(len(self.columns))
        ]
        return np.array([max(np.nanmax(np.abs(row)), 1e-300) for row in rows])


def _shift(column: str, run: int) -> str:
    """The name of an offset, of the one run or of several."""
    return f"{column} offset, run {run}" if run else f"{column} offset"
