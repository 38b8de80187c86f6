"""Numbers that were found from measured histories, with what is known of their errors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.derivatives.identifiability import Combination, OpenDirection
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.sheets.text_table import Column, number, paragraph, table
from mbody.solution.doubts import Inherited
from mbody.system.read_only import lock

__all__ = ["Fit"]


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Inherited):
    """Numbers that fit measured histories best.

    Attributes
    ----------
    values, units : dict
        By the names of `by`.
    offsets : dict
        Unknown constants of columns, by ``"slider.x offset"``, of several runs by ``"slider.x
        offset, run 2"``.
    covariance : array (unknowns, unknowns)
        s² (JᵀJ)⁻¹ of values, then offsets; infinite variances of what is not determined, NaN
        beside them.
    deviations, intervals : dict
        Standard deviation, and (low, high) of the confidence, by unknown and offset; infinite where
        the data do not determine it.
    confidence : float
    undetermined : tuple of OpenDirection
        Changes of unknowns that change no datum; ``str`` says them.
    combinations : tuple of Combination
        Sums of those unknowns that the data do determine.
    residual : dict
        By column the root of the mean square of data less fit, in its unit.
    residuals : tuple of dict
        Of every run, by column, data less fit: arrays (instants,), NaN where nothing was measured.
    data, evaluations : int
        Data that were used, and analyses of each run.
    system : System
        With the values.
    """

    model: str = ""
    values: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    offsets: dict[str, float] = field(default_factory=dict)
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    deviations: dict[str, float] = field(default_factory=dict)
    intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    confidence: float = 0.95
    undetermined: tuple[OpenDirection, ...] = ()
    combinations: tuple[Combination, ...] = ()
    residual: dict[str, float] = field(default_factory=dict)
    residuals: tuple[dict[str, np.ndarray], ...] = ()
    data_units: dict[str, str] = field(default_factory=dict)
    count: int = 0
    evaluations: int = 0
    system: Any = None

    def __post_init__(self) -> None:
        lock(self)

    def __getitem__(self, name: str) -> float:
        """The value of one number."""
        if name not in self.values:
            raise ModelError(
                f"the fit has no number {name!r} (there are: {listed(self.values)})", str(name)
            )
        return self.values[name]

    def data(self) -> dict[str, Any]:
        """As plain values, ready for JSON; None for what is infinite or no number."""

        def finite(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        return {
            "values": dict(self.values),
            "units": dict(self.units),
            "offsets": dict(self.offsets),
            "deviations": {k: finite(v) for k, v in self.deviations.items()},
            "intervals": {k: [finite(v) for v in pair] for k, pair in self.intervals.items()},
            "confidence": self.confidence,
            "covariance": [[finite(v) for v in row] for row in self.covariance],
            "undetermined": [
                {"direction": dict(one.direction), "sentence": one.sentence}
                for one in self.undetermined
            ],
            "combinations": [
                {"terms": dict(c.terms), "value": c.value, "deviation": finite(c.deviation)}
                for c in self.combinations
            ],
            "residual": dict(self.residual),
            "count": self.count,
            "evaluations": self.evaluations,
        }

    def __str__(self) -> str:
        whole = {**self.values, **self.offsets}
        keys = list(whole)
        units = [self.units[key] for key in keys]
        known = [np.isfinite(self.deviations[key]) for key in keys]

        def cells(values: list[float]) -> list[str]:
            return [number(v) if k else "open" for v, k in zip(values, known, strict=True)]

        rows = table(
            [
                Column("NUMBERS", keys, text=True),
                Column("value", [number(whole[key]) for key in keys]),
                Column("deviation", cells([self.deviations[key] for key in keys])),
                Column("low", cells([self.intervals[key][0] for key in keys])),
                Column("high", cells([self.intervals[key][1] for key in keys])),
                Column("unit", units, text=True),
            ]
        )
        shown = table(
            [
                Column("DATA", list(self.residual), text=True),
                Column("residual", [number(value) for value in self.residual.values()]),
                Column("unit", [self.data_units[name] for name in self.residual], text=True),
            ]
        )
        head = f"{self.count} data; low and high of {100.0 * self.confidence:g} % confidence"
        lines = [self.model, "", *rows, "", *shown, "", head]
        lines += [f"determined: {one} = {number(one.shown(whole))}" for one in self.combinations]
        return "\n".join(
            [*lines, *(line for note in self.notes for line in paragraph(f"note: {note}"))]
        )

    def __repr__(self) -> str:
        parts = (f"{name} = {value:.6g}" for name, value in self.values.items())
        return f"Fit({', '.join(parts)})"
