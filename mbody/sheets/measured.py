"""The table of measured quantities on a sheet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.model.reductions import outermost
from mbody.model.study import Measure
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.sheets.names import ROUNDING, force_floor, swiftness
from mbody.sheets.text_table import Column, number, table
from mbody.solution.measures import found_by, measured

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["measures"]


def _floor(solution: Solution, dimension: Dimension) -> float:
    """What of a quantity is rounding beside the greatest of its kind in the mechanism; 0 of what
    there is nothing to compare with.
    """
    length, swift = solution.system.length, swiftness(solution)
    force = force_floor(solution) if solution.has_forces else 0.0
    floors = {
        "length": ROUNDING * length,
        "angle": ROUNDING,
        "velocity": ROUNDING * length * np.sqrt(swift),
        "angular velocity": ROUNDING * np.sqrt(swift),
        "acceleration": ROUNDING * length * swift,
        "angular acceleration": ROUNDING * swift,
        "force": force,
        "torque": force * length,
        "power": force * length * np.sqrt(swift),
    }
    return next((floor for name, floor in floors.items() if DIMENSIONS[name] == dimension), 0.0)


def _cleared(solution: Solution, measure: Measure, values: np.ndarray) -> np.ndarray:
    """Values with 0 for what is rounding, beside the mechanism or beside the greatest of them.

    What is one number of all instants is compared itself, with the rounding of its history: of an
    integral with that over the whole time.
    """
    history, dimension, _ = measured(solution, Measure(outermost(measure.of).of))
    floor = max(_floor(solution, dimension), ROUNDING * float(np.abs(history).max()))
    plain = history
    if measure.by:
        plain = measured(solution, Measure(measure.of))[0]
        floor *= float(np.ptp(solution.t)) if measure.by == "integral" else 1.0
    return np.where(np.abs(plain) <= floor, 0.0, values)


def measures(solution: Solution) -> list[str]:
    """Lines of a table: the value of every measure, of many instants the least and the greatest.

    What needs forces is left open where the analysis finds none.
    """
    if not solution.mechanism.measures or solution.record.batch:
        return []
    cells: dict[str, list[str]] = {
        key: [] for key in ("name", "least", "greatest", "value", "unit", "of")
    }
    for name, measure in solution.mechanism.measures.items():
        cells["name"].append(name)
        cells["of"].append(measure.of)
        alone = bool(measure.by) or len(solution) == 1
        if not found_by(solution, measure):
            for key in ("value", "unit") if alone else ("least", "greatest", "unit"):
                cells[key].append("–")
            for key in ("least", "greatest") if alone else ("value",):
                cells[key].append("")
            continue
        values, dimension, unit = measured(solution, measure)
        if dimension == DIMENSIONS["angle"] and not measure.unit:
            values, unit = np.degrees(values), "deg"
        values = _cleared(solution, measure, values)
        extremes = (
            number(np.fmin.reduce(values, axis=None)),
            number(np.fmax.reduce(values, axis=None)),
        )
        cells["unit"].append(unit)
        shown = ("", "", extremes[0]) if alone else (*extremes, "")
        for key, cell in zip(("least", "greatest", "value"), shown, strict=True):
            cells[key].append(cell)
    columns = [
        Column("MEASURES", cells["name"], text=True),
        Column("least", cells["least"]),
        Column("greatest", cells["greatest"]),
        Column("value", cells["value"]),
        Column("unit", cells["unit"], text=True),
        Column("of", cells["of"], text=True),
    ]
    return table(columns)
