"""The loosest tolerances that keep a quantity in its band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.derivatives.named_numbers import changed, unit_of
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.quantities import (
    Formula,
    FormulaError,
    Scope,
    dimension_text,
    evaluate,
    parse,
    parse_unit,
)
from mbody.quantities.number import float_or_formula
from mbody.quantities.units import NUMBER
from mbody.sheets.text_table import Column, number, table
from mbody.sweeps.tolerances import SIGMAS, Normal, Scatter
from mbody.system.system import System

__all__ = ["Allocation", "allocated", "limits"]


@dataclass(frozen=True)
class Allocation:
    """Tolerances of least cost Σ c/t with the quantity in its band.

    Attributes
    ----------
    low, high : float
        The band.
    tolerance : dict
        By number ±, as its distribution has it: 99.73 % of the values are in the band, to first
        order. Infinite where the number changes nothing.
    worst_case : dict
        The same where the quantity is in its band with all numbers at the ends at once.
    units : dict
    inside : float or None
        The part of random designs with `tolerance` that is in the band.
    count : int
        How many these are.
    """

    low: float
    high: float
    tolerance: dict[str, float]
    worst_case: dict[str, float]
    units: dict[str, str]
    inside: float | None = None
    count: int = 0
    _spreads: Mapping[str, tuple[Scatter, float, float]] = field(
        default_factory=dict, repr=False, compare=False
    )

    def scatter(self) -> dict[str, Scatter]:
        """Distributions with these tolerances about their means, of numbers that count."""
        return {
            name: _with(self._spreads[name], wide)
            for name, wide in self.tolerance.items()
            if np.isfinite(wide)
        }

    def tried(self, inside: float, count: int) -> Allocation:
        """The same with the part of random designs in the band."""
        return replace(self, inside=inside, count=count)

    def data(self) -> dict[str, Any]:
        """As plain values, ready for JSON; None for no limit."""

        def finite(row: Mapping[str, float]) -> dict[str, float | None]:
            return {k: v if np.isfinite(v) else None for k, v in row.items()}

        return {
            "low": self.low,
            "high": self.high,
            "tolerance": finite(self.tolerance),
            "worst_case": finite(self.worst_case),
            "units": dict(self.units),
            "inside": self.inside,
            "count": self.count,
        }

    def lines(self) -> list[str]:
        """The table of a sheet."""
        names = list(self.tolerance)

        def cells(row: Mapping[str, float]) -> list[str]:
            return [number(row[name]) if np.isfinite(row[name]) else "any" for name in names]

        columns = [
            Column(f"LOOSEST FOR {self.low:g} … {self.high:g}", names, text=True),
            Column("±", cells(self.tolerance)),
            Column("± worst case", cells(self.worst_case)),
            Column("unit", [self.units[name] for name in names], text=True),
        ]
        found = table(columns)
        if self.inside is not None:
            found.append(f"{100.0 * self.inside:.2f} % of {self.count} random designs are in it")
        return found


def _with(spread: tuple[Scatter, float, float], tolerance: float) -> Scatter:
    how, middle, _ = spread
    if isinstance(how, Normal):
        return Normal(tolerance=tolerance, mean=middle)
    return replace(how, tolerance=tolerance, mean=middle)


def limits(system: System, name: str, unit: str, within: Any, value: float) -> tuple[float, float]:
    """The band, in the unit of the quantity.

    Raises
    ------
    ModelError
        For what is no pair, text of another dimension, a band upside down, or around another value.
    """
    if not isinstance(within, tuple | list) or len(within) != 2:
        raise ModelError(f"tolerances: within is a pair (low, high), not {brief(within)}")
    try:
        low, high = (_limit(system, one, unit) for one in within)
    except FormulaError as error:
        raise ModelError(f"tolerances: within: {error}") from None
    if not low < high:
        raise ModelError(
            f"tolerances: the band goes from {low:g} to {high:g} {unit}".rstrip()
            + ": give its lowest value, then its greatest"
        )
    if not low < value < high:
        raise ModelError(
            f"tolerances: '{name}' is {value:.6g} {unit} at the means, which is not between "
            f"{low:g} and {high:g}: move the design or the band",
            name,
        )
    return low, high


def _limit(system: System, given: Any, unit: str) -> float:
    """An end of the band from a number, or from text with units."""
    made = float_or_formula(given, None)
    if not isinstance(made, Formula):
        return float(made)
    scope = Scope(system.mechanism.units, {})
    found = evaluate(parse(made.text), scope)
    if found.dimension is None:
        return float(found.value)
    one = evaluate(parse_unit(unit), scope) if unit else None
    if found.dimension != (NUMBER if one is None else one.dimension):
        raise FormulaError(
            f"{made.text!r} is {dimension_text(found.dimension)}, the quantity is in {unit or '1'}"
        )
    return float(found.value / (1.0 if one is None else one.value))


def allocated(
    system: System,
    names: Mapping[str, str],
    spreads: Mapping[str, tuple[Scatter, float, float]],
    row: np.ndarray,
    value: float,
    band: tuple[float, float],
    cost: Mapping[str, float] | None,
) -> Allocation:
    """The tolerances of least cost Σ c/t, by Lagrange's multipliers.

    Statistically Σ (m_i r_i t_i)² = T²/9 with the deviation r t of a distribution, so that t is in
    proportion to ∛(c/(m r)²); in the worst case Σ |m_i| t_i = T, and t to √(c/|m|). T is the
    distance to the nearer end of the band.

    Raises
    ------
    ModelError
        For costs that are no positive numbers of these names, and where no number counts.
    """
    half = min(value - band[0], band[1] - value)
    costs = np.array([_cost(name, spreads[name], cost) for name in names])
    if cost is not None:
        unknown = [name for name in cost if name not in names]
        if unknown:
            raise ModelError(
                f"tolerances: cost of '{unknown[0]}', which does not scatter (these do: "
                f"{listed(names)})",
                str(unknown[0]),
            )
    slope = np.abs(row)
    counts = changed(system, list(names.values()), np.asarray(value), row)
    if not counts.any():
        raise ModelError(
            f"tolerances: none of {listed(names)} changes the quantity: any tolerance will do"
        )
    ratio = np.array([_ratio(how) for how, _, _ in spreads.values()])
    loose, worst = np.full(len(costs), np.inf), np.full(len(costs), np.inf)
    effect = slope[counts] * ratio[counts]
    parts = np.cbrt(costs[counts] / effect**2)
    loose[counts] = parts * half / (SIGMAS * np.linalg.norm(effect * parts))
    parts = np.sqrt(costs[counts] / slope[counts])
    worst[counts] = parts * half / float(slope[counts] @ parts)
    return Allocation(
        low=band[0],
        high=band[1],
        tolerance=dict(zip(names, loose.tolist(), strict=True)),
        worst_case=dict(zip(names, worst.tolist(), strict=True)),
        units={name: unit_of(system.mechanism, own) for name, own in names.items()},
        _spreads=dict(spreads),
    )


def _ratio(how: Scatter) -> float:
    """Standard deviation by tolerance."""
    return 1.0 / SIGMAS if isinstance(how, Normal) else how.deviation_of(1.0)


def _cost(
    name: str, spread: tuple[Scatter, float, float], cost: Mapping[str, float] | None
) -> float:
    how, _, width = spread
    own = SIGMAS * how.deviation_of(width) if isinstance(how, Normal) else width
    given = own if cost is None else cost.get(name, own)
    if not own and (cost is None or name not in cost):
        raise ModelError(
            f"tolerances: '{name}' has the tolerance 0, which says nothing of what another costs: "
            "give its cost, or leave it out of scatter",
            name,
        )
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 < given < np.inf:
        raise ModelError(
            f"tolerances: the cost of '{name}' is {brief(given)}: give a positive number", name
        )
    return float(given)
