"""The table of couplings in the sheets of one instant and of many."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.names import force_floor
from mbody.sheets.text_table import Column, numbers, table, there

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["couplings"]


def couplings(solution: Solution) -> list[str]:
    """Efforts of the couplings, of those of angles and of those of lengths; of many instants or
    designs the least and the greatest.
    """
    lines: list[str] = []
    if not solution.has_forces:
        return lines
    unit, floor = solution.mechanism.units.of, force_floor(solution)
    for kind in ("torque", "force"):
        chosen = [c for c in solution.mechanism.couplings if c.effort_dimension == kind]
        if not chosen:
            continue
        efforts = [solution.effort(coupling.name).ravel() for coupling in chosen]
        least = floor * (solution.system.length if kind == "torque" else 1.0)
        columns = [Column("COUPLINGS", [coupling.name for coupling in chosen], text=True)]
        if efforts[0].size == 1:
            columns.append(Column(kind, numbers(np.concatenate(efforts), least), unit(kind)))
        else:
            ends = np.array([(there(effort).min(), there(effort).max()) for effort in efforts]).T
            columns.append(Column(f"least {kind}", numbers(ends[0], least), unit(kind)))
            columns.append(Column("greatest", numbers(ends[1], least), unit(kind)))
        bodies = [", ".join(coupling.bodies) for coupling in chosen]
        columns.append(Column("between", bodies, text=True, whole=True))
        lines += [*([""] if lines else []), *table(columns)]
    return lines
