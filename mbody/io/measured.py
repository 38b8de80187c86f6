"""The table of measured quantities on a sheet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.io.text import Column, number, table
from mbody.measures import found_by, measured
from mbody.units import DIMENSIONS

if TYPE_CHECKING:
    from mbody.solution import Solution

__all__ = ["measures"]


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
        told = (number(values.min()), number(values.max()))
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
