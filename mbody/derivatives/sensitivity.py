"""Which number of a mechanism changes a measured quantity most."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.requests import ANALYSES
from mbody.derivatives.gradient import gradient_of
from mbody.derivatives.gradient_result import Gradient
from mbody.derivatives.named_numbers import changed, checked_names
from mbody.errors import ModelError
from mbody.model.study import Measure
from mbody.sheets.text_table import Column, number, paragraph, table
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution
from mbody.sweeps.columns import columns_of

__all__ = ["Sensitivity", "sensitivity", "sensitivity_of"]


@dataclass(frozen=True)
class Sensitivity(Inherited):
    """Derivatives of one measured quantity, those of most weight first.

    Attributes
    ----------
    measure, unit : str
    value : float
    by : dict
        By number: ``{"derivative", "unit", "relative"}``, the last in per cent per per cent, None
        where the number or the quantity is zero.
    numbers : dict
        The present values of the numbers.
    at : float or None
        Time of the instant that was taken; None where all count.
    time_unit : str
    status, doubts, notes
        Of the result, and where there is no derivative.
    """

    model: str
    measure: str
    unit: str
    value: float
    by: dict[str, dict[str, Any]]
    numbers: dict[str, float]
    at: float | None
    time_unit: str

    def data(self) -> dict[str, Any]:
        """As plain dicts: ``{"measure", "value", "unit", "by", "at"}``."""
        return {
            "measure": self.measure,
            "value": None if math.isnan(self.value) else self.value,
            "unit": self.unit,
            "by": {name: dict(row) for name, row in self.by.items()},
            "at": self.at,
        }

    def __str__(self) -> str:
        where = "" if self.at is None else f" at t = {self.at:.6g} {self.time_unit}"
        head = f"{self.measure} = {self.value:.6g} {self.unit}".rstrip() + where
        rows = list(self.by.items())
        parts = [row["relative"] for _, row in rows]
        columns = [
            Column("NUMBERS", [name for name, _ in rows], text=True),
            Column("value", [number(self.numbers[name]) for name, _ in rows]),
            Column("derivative", [number(row["derivative"]) for _, row in rows]),
            Column("unit", [row["unit"] for _, row in rows], text=True),
            Column("% per %", ["–" if part is None else f"{part:.4g}" for part in parts]),
        ]
        notes = [line for note in self.notes for line in paragraph(f"note: {note}")]
        lines = ["", *table(columns)] if rows else []
        return "\n".join([self.model, "", head, *lines, *notes])


def sensitivity(
    run: Solution, measure: str | Measure, by: Sequence[str] | None = None
) -> Sensitivity:
    """The table of one measured quantity of a result; see `Solution.sensitivity`.

    Raises
    ------
    ModelError
        For a result of another analysis or of a batch, a history of many instants, and as
        `mbody.gradient`.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    >>> found = run.sensitivity("A.force", ["crank.A.x", "coupler.weight"])
    >>> list(found.by)
    ['crank.A.x', 'coupler.weight']
    """
    if run.analysis not in ANALYSES:
        raise ModelError(
            f"sensitivity is of kinematics, kinetostatics and statics, not of {run.analysis}"
        )
    if run.record.batch:
        raise ModelError("sensitivity is of one design: analyse one of the batch, system.design(n)")
    columns = columns_of(run.mechanism, [measure], "sensitivity")
    names = checked_names(run.system, by, "sensitivity")
    if len(run.t) > 1 and not columns[0].by:
        of = columns[0].name
        raise ModelError(
            f"sensitivity: '{of}' is a history of {len(run.t)} instants: say how it becomes one "
            f"number, such as peak({of})"
        )
    return sensitivity_of(run, gradient_of(run, columns, names), names, by is None)


def sensitivity_of(
    run: Solution, found: Gradient, by: Mapping[str, str], only_those_that_count: bool
) -> Sensitivity:
    """The table of the one measure of a gradient; without rows of zeros where it `only` has those
    that count.
    """
    ((measure, value),) = found.value.items()
    rows: dict[str, dict[str, Any]] = {}
    numbers: dict[str, float] = {}
    row = found.jacobian[0]
    counts = changed(run.system, list(by.values()), np.asarray(value), row)
    for (name, derivative), count in zip(found[measure].items(), counts, strict=True):
        if math.isnan(derivative) or (only_those_that_count and not count):
            continue
        numbers[name] = own = float(run.system.values[by[name]])
        relative = derivative * own / value if own and value else None
        unit = found.units[measure][name]
        rows[name] = {"derivative": derivative, "unit": unit, "relative": relative}
    order = sorted(rows, key=lambda name: _weight(rows[name]), reverse=True)
    return Sensitivity(
        model=run.mechanism.name,
        measure=measure,
        unit=found.measured[measure],
        value=value,
        by={name: rows[name] for name in order},
        numbers=numbers,
        at=found.at[measure],
        time_unit=run.mechanism.units.time,
        **inherited(found, notes=found.notes),
    )


def _weight(row: dict[str, Any]) -> float:
    relative = row["relative"]
    return -1.0 if relative is None or math.isnan(relative) else abs(relative)
