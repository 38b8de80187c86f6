"""Measured quantities with their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.solution.doubts import Inherited
from mbody.system.read_only import lock

__all__ = ["EventGradient", "Gradient", "per"]


@dataclass(frozen=True)
class EventGradient:
    """When something happens in a motion, an `EventRecord`, with derivatives.

    Attributes
    ----------
    name, contact : str
        As of the record.
    t : float
    by : dict
        Derivatives of the time by number; NaN where there is none.
    """

    name: str
    contact: str
    t: float
    by: dict[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Inherited):
    """Measured quantities with their derivatives.

    Attributes
    ----------
    value : dict
        By measure: a float, or an array (instants,).
    by : tuple of str
        The numbers.
    jacobian : array (measures, numbers), or (measures, instants, numbers)
        Derivatives in the units of the mechanism and of the measures; NaN where redundant loops do
        not close with another number, and at instants without forces or with limits, which a note
        says.
    units : dict
        By measure, then by number: the unit of the derivative.
    at : dict
        By measure the time of the instant that was taken, of a greatest or least value and of one
        instant; None where all instants count.
    measured : dict
        By measure its unit.
    events : tuple of EventGradient
        Of a motion over time: when what happens in it does.
    status, doubts : str, tuple of Doubt
        Of the result.
    notes : tuple of str
        Where there is no derivative, measures that no number changes, and the doubts.
    """

    value: dict[str, Any]
    by: tuple[str, ...]
    jacobian: np.ndarray
    units: dict[str, dict[str, str]]
    at: dict[str, float | None]
    measured: dict[str, str]
    events: tuple[EventGradient, ...] = ()
    _rows: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_rows", {name: n for n, name in enumerate(self.value)})
        lock(self)

    def __getitem__(self, measure: str) -> dict[str, Any]:
        """The derivatives of one measure by name: floats, or arrays (instants,)."""
        if measure not in self._rows:
            raise ModelError(
                f"there is no measure {measure!r} here (there are: {listed(self.value)})",
                str(measure),
            )
        row = self.jacobian[self._rows[measure]]
        parts = row if row.ndim == 1 else row.T
        whole = (float(part) if row.ndim == 1 else part for part in parts)
        return dict(zip(self.by, whole, strict=True))

    def __repr__(self) -> str:
        shape = " × ".join(str(size) for size in self.jacobian.shape)
        return f"Gradient({listed(self.value)} by {len(self.by)} numbers: {shape})"


def per(unit: str, by: str) -> str:
    """Unit of a quotient."""
    if not by:
        return unit
    below = f"({by})" if any(letter in by for letter in "·/ ") else by
    return f"{unit or '1'}/{below}"
