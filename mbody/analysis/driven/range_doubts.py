"""The doubt of a table that was evaluated outside the range of its points, as a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem
from mbody.solution.doubts import Doubt

__all__ = ["MARGIN", "range_doubt"]

#: Part of a table's range by which it may be left: what rounding may put beyond its ends.
MARGIN = 1e-9
#: What holds beyond the points.
INSTEAD = {"hold": "the value at its end", "line": "the tangent at its end"}


def range_doubt(
    units: UnitSystem,
    what: tuple[str, str],
    points: Any,
    of: Dimension | None,
    outside: str,
    met: tuple[float, float, float],
) -> Doubt:
    """The doubt.

    Parameters
    ----------
    what : tuple of str
        The element, and what covers the points: "the table of its value".
    points : sequence of float
        The places of the points, ascending.
    of : Dimension or None
        What they measure.
    outside : str
        What holds beyond them.
    met : tuple of float
        The least and the greatest argument, and the time of the first one beyond.
    """
    name, table = what
    low, high, since = met
    unit, size = (units.of(of), 1.0) if of is not None else ("", 1.0)
    if of == DIMENSIONS["angle"]:
        unit, size = "deg", float(np.degrees(1.0))
    has = f"{size * points[0]:.6g} to {size * points[-1]:.6g} {unit}".rstrip()
    went = f"{size * low:.6g} to {size * high:.6g} {unit}".rstrip()
    return Doubt(
        "extrapolation",
        f"'{name}': {table} covers {has}, this result goes from {went} and takes "
        f"{INSTEAD[outside]} beyond it, from t = {since:.6g} {units.time} on: add points to the "
        f"{'curve' if 'curve' in table else 'table'}",
        since,
        (name,),
    )
