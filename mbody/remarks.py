"""Remarks on a description: what is allowed, but perhaps meant otherwise."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from mbody.drivers import Driver
from mbody.elements import Element
from mbody.laws import Table
from mbody.mechanism import Mechanism
from mbody.units import DIMENSIONS, Dimension, UnitSystem, dimension_of

__all__ = ["remarks"]


def remarks(mechanism: Mechanism, kept: dict[str, Any] | None = None) -> tuple[str, ...]:
    """Sentences for the user, each with the element, the number and what to do; they stand among
    the notes of every analysis and leave its status.

    Parameters
    ----------
    kept : dict, optional
        Where they are kept for the next time, as the plans of a system.

    >>> from mbody import makers
    >>> remarks(makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2)))
    ()
    """
    kept = {} if kept is None else kept
    if "remarks" not in kept:
        kept["remarks"] = (*_tables(mechanism),)
    found: tuple[str, ...] = kept["remarks"]
    return found


def _tables(mechanism: Mechanism) -> Iterator[str]:
    """Splines that leave the range of their points, and motions whose rate jumps."""
    for element in mechanism:
        for field in dataclasses.fields(element):
            law = getattr(element, field.name)
            if isinstance(law, Table) and "law" in field.metadata:
                of, value = (dimension_of(field.metadata[key]) for key in ("of", "law"))
                yield from _table(mechanism.units, element, field.name, law, of, value)


def _table(
    units: UnitSystem, element: Element, field: str, table: Table, of: Dimension, value: Dimension
) -> Iterator[str]:
    beyond = table.beyond()
    if beyond is not None:
        low, high = min(table.y), max(table.y)
        yield (
            f"'{element.name}': the spline through the table of its {field} leaves the range of "
            f"its points, {_told(low, value, units)} to {_told(high, value, units)}: it goes to "
            f"{_told(beyond[1], value, units)} at {_told(beyond[0], of, units)}; give "
            'interpolation = "pchip" or "linear", or more points'
        )
    if isinstance(element, Driver) and table.interpolation == "linear" and len(table.x) > 2:
        yield (
            f"'{element.name}': the table of its {field} goes in straight lines, so that the rate "
            "jumps at every point: accelerations and forces between the points leave the jumps "
            'out; give interpolation = "spline"'
        )


def _told(value: float, dimension: Dimension, units: UnitSystem) -> str:
    """A number with its unit, angles in degrees."""
    if dimension == DIMENSIONS["angle"]:
        return f"{value * 57.29577951308232:.6g} deg"
    return f"{value:.6g} {units.of(dimension)}".strip()
