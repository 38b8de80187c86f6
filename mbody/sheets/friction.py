"""The tables of friction on a sheet: what joints lose, and between what efforts lie at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.names import everyday
from mbody.sheets.text_table import Column, number, numbers, table

if TYPE_CHECKING:
    from mbody.solution.friction_results import Efficiency
    from mbody.solution.solution import Solution

__all__ = ["efficiency_line", "friction"]

#: Losses below this part of the greatest are rounding.
ROUNDING = 1e-12


def friction(solution: Solution) -> list[list[str]]:
    """Tables of the losses of rough joints, and of the bands of efforts where joints rest; none of
    mechanisms without friction.

    Examples
    --------
    >>> import mbody
    >>> friction(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    []
    """
    if not solution.has_forces or not solution.losses:
        return []
    parts = [_losses(solution)] if solution.analysis != "statics" else []
    if solution.analysis != "simulate":
        parts.append(_bands(solution))
    return [part for part in parts if part]


def efficiency_line(solution: Solution, output: str, found: Efficiency) -> str:
    """The account of work of a motion."""
    unit = solution.mechanism.units.of("torque")
    given, useful, lost = (number(x) for x in (found.given, found.useful, found.lost))
    return (
        f"EFFICIENCY   {found.value:.6g} of '{output}': given {given}, useful {useful}, lost in "
        f"joints {lost} {unit}"
    )


def _losses(solution: Solution) -> list[str]:
    units = solution.mechanism.units
    unit = units.of("power")
    names = list(solution.losses)
    losses = np.array([solution.losses[name] for name in names]).reshape(len(names), -1)
    if losses.shape[1] == 1:
        power = losses[:, 0]
        modes = [np.ravel(solution.mode(name))[0] for name in names]
        least = ROUNDING * float(np.abs(power).max(initial=0.0))
        return table(
            [
                Column("FRICTION", names, text=True),
                Column("loss", numbers(power, least), unit),
                *everyday(units, "power", power, least),
                Column("", modes, text=True),
            ]
        )
    peak = np.fmax.reduce(losses, axis=1)
    floor = ROUNDING * float(np.nanmax(peak, initial=0.0))
    known = np.isfinite(losses)
    mean = np.where(known, losses, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    return table(
        [
            Column("FRICTION", names, text=True),
            Column("peak loss", numbers(peak, floor), unit),
            *everyday(units, "power", peak, floor),
            Column("mean of the instants", numbers(mean, floor), unit),
            *everyday(units, "power", mean, floor),
        ]
    )


def _bands(solution: Solution) -> list[str]:
    """Drivers whose effort friction leaves open."""
    found = []
    for driver in solution.mechanism.drivers:
        limits = solution.range(driver.name)
        open_at = (limits.low != limits.high) & ~np.isnan(limits.low)
        if open_at.any():
            unit = solution.mechanism.units.of(driver.effort_dimension)
            ends = limits.low[open_at].min(), limits.high[open_at].max()
            found.append((driver.name, *ends, unit))
    if not found:
        return []
    names, low, high, units = zip(*found, strict=True)
    return table(
        [
            Column("AT REST", list(names), text=True),
            Column("from", _ends(low)),
            Column("to", _ends(high)),
            Column("unit", list(units), text=True),
        ]
    )


def _ends(values: tuple[float, ...]) -> list[str]:
    """Numbers, of which infinite ones are said."""
    found = numbers(np.nan_to_num(np.array(values), posinf=0.0, neginf=0.0))
    return [
        cell if np.isfinite(value) else ("−∞" if value < 0.0 else "∞")
        for cell, value in zip(found, values, strict=True)
    ]
