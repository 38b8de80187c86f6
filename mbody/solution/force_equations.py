"""The system of force equations of one instant, as arrays: Newton and Euler of every link."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core.presentation import present
from mbody.system.read_only import lock

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Equations:
    """matrix · unknowns = right-hand side: Newton's and Euler's equations of every moving link.

    A row is Σ of what joints and drivers exert = m a − loads, moments about the mass centre. A
    column is what a unit of its unknown exerts on all links. ``print(run.equations())`` shows them.

    Attributes
    ----------
    rows, row_units : tuples of str
        ΣFx, ΣFy and ΣM of the links in the order of the description, and their units.
    unknowns, units, meanings : tuples of str
        Names of the unknowns in the order of joints, couplings, drivers; their units; what each is.
    matrix : array (rows, unknowns)
        Square where constraints determine the motion and none is redundant.
    rhs : array (rows,)
        m a_Gx, m a_Gy and I_G α less what the loads exert.
    values : array (unknowns,)
        The solution: reactions and efforts.
    rank : int
        Independent columns; where it is less than their number, values are not unique.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10))
    >>> system = run.equations()
    >>> system.unknowns
    ('F12x', 'F12y', 'F32x', 'F32y', 'F43x', 'F43y', 'F14x', 'F14y', 'T12')
    >>> bool(np.allclose(np.linalg.solve(system.matrix, system.rhs), system.values))
    True
    """

    rows: tuple[str, ...]
    row_units: tuple[str, ...]
    unknowns: tuple[str, ...]
    units: tuple[str, ...]
    meanings: tuple[str, ...]
    matrix: Array
    rhs: Array
    values: Array
    rank: int
    heading: tuple[str, ...] = field(repr=False)

    def __post_init__(self) -> None:
        lock(self)

    @property
    def residual(self) -> Array:
        """What the solution leaves, matrix · values − rhs (rows,)."""
        return self.matrix @ self.values - self.rhs

    def data(self) -> dict[str, Any]:
        """Everything as plain lists and texts, ready for JSON."""
        return {
            "rows": list(self.rows),
            "row_units": list(self.row_units),
            "unknowns": list(self.unknowns),
            "units": list(self.units),
            "matrix": self.matrix.tolist(),
            "rhs": self.rhs.tolist(),
            "values": self.values.tolist(),
        }

    def __str__(self) -> str:
        return str(present("sheet", self))
