"""The table of measured quantities on a sheet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.io.parts import force_floor
from mbody.io.text import Column, number, table, there
from mbody.measures import found_by, measured
from mbody.units import DIMENSIONS, Dimension

if TYPE_CHECKING:
    from mbody.solution import Solution

__all__ = ["measures"]

FORCE, TORQUE = DIMENSIONS["force"], DIMENSIONS["torque"]


def _floor(solution: Solution, dimension: Dimension) -> float:
    """What of a measured force or torque is rounding; nothing is of other quantities."""
    if not solution.has_forces or dimension not in (FORCE, TORQUE):
        return 0.0
    return force_floor(solution) * (solution.system.length if dimension == TORQUE else 1.0)


def measures(solution: Solution) -> list[str]:
    """Lines of a table: the value of every measure, of many instants the least and the greatest.

    What needs forces is left open where the analysis finds none.
    """
    if not solution.mechanism.measures or solution.record.batch:
        return []
    cells: dict[str, list[str]] = {key: [] for key in ("name", "least", "greatest", "unit", "of")}
    for name, measure in solution.mechanism.measures.items():
        cells["name"].append(name)
        cells["of"].append(measure.of)
        if not found_by(solution, measure):
            for key in ("least", "greatest", "unit"):
                cells[key].append("–")
            continue
        values, dimension, unit = measured(solution, measure)
        if dimension == DIMENSIONS["angle"] and not measure.unit:
            values, unit = np.degrees(values), "deg"
        floor = 0.0 if measure.unit else _floor(solution, dimension)
        told = tuple(
            number(v if abs(v) > floor else 0.0) for v in (there(values).min(), there(values).max())
        )
        for key, cell in zip(("least", "greatest", "unit"), (*told, unit), strict=True):
            cells[key].append(cell)
    columns = [
        Column("MEASURES", cells["name"], text=True),
        Column("least", cells["least"]),
        Column("greatest", cells["greatest"]),
        Column("unit", cells["unit"], text=True),
        Column("of", cells["of"], text=True),
    ]
    if len(solution) == 1:
        columns[1:3] = [Column("value", cells["least"])]
    return table(columns)
