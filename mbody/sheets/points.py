"""The table of points on a sheet of one instant: places, velocities, accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.model.moving_points import moving_points
from mbody.sheets.names import ROUNDING, swiftness
from mbody.sheets.text_table import Column, numbers, polars, table

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["points"]

#: Points that a sheet shows.
SHOWN = 24


def points(solution: Solution) -> list[str]:
    """Lines of a table of the first instant; none for a mechanism without such points."""
    names = moving_points(solution.mechanism)
    if not names:
        return []
    found = [solution.point(name) for name in names[:SHOWN]]
    x, y, vx, vy, ax, ay = (
        np.array([getattr(one, key)[0] for one in found])
        for key in ("x", "y", "vx", "vy", "ax", "ay")
    )
    unit, length = solution.mechanism.units.of, solution.system.length
    swift = swiftness(solution)
    lines = table(
        [
            Column("POINTS", names[:SHOWN], text=True),
            Column("x", numbers(x, ROUNDING * length), unit("length")),
            Column("y", numbers(y, ROUNDING * length), unit("length")),
            Column("v", polars(vx, vy, ROUNDING * np.sqrt(swift) * length), unit("velocity")),
            Column("a", polars(ax, ay, ROUNDING * swift * length), unit("acceleration")),
        ]
    )
    more = len(names) - SHOWN
    return [*lines, f"{more} points more are among the data and in tables"] if more > 0 else lines
