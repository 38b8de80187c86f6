"""Measures of `--angle deg`: those of angles in degrees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.model.study import Measure

__all__ = ["measures_in_degrees"]


def measures_in_degrees(mechanism: Mechanism, names: Sequence[str]) -> dict[str, Measure]:
    """The measures by name, those of angles that have no unit of their own in degrees."""
    from mbody.model.reductions import outermost
    from mbody.model.study import Measure, measure_named
    from mbody.quantities.units import DIMENSIONS
    from mbody.solution.measures import check_measure

    rad = mechanism.units.of(DIMENSIONS["angle"])
    found = {}
    for name in names:
        one = measure_named(mechanism.measures, name)
        by, of, instant = outermost(one.of)
        inner = measure_named(mechanism.measures, of)
        of = inner.of
        if by:
            of = f"at({of}, {instant})" if by == "at" else f"{by}({of})"
        unit = "" if inner.by else check_measure(mechanism, Measure(of, one.unit).history)
        found[name] = Measure(of, "deg") if unit == rad and not one.unit else one
    return found
