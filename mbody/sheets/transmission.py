"""Sheet of a transmission."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.sheets.names import certified, title
from mbody.sheets.text_table import Column, even, numbers, paragraph, table

if TYPE_CHECKING:
    from mbody.analysis.driven.transmission import Transmission

__all__ = ["sheet"]

#: Instants that are shown.
SHOWN = 13


def sheet(found: Transmission) -> str:
    """A transmission as text, at most 100 characters wide.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True, instants=37)
    >>> print(sheet(mbody.transmission(run, output="rocker")).splitlines()[3])
    least transmission angle 52.831° at 'B', where 'motor' = 180 deg
    """
    unit = found.mechanism.units.length
    words = f"transmission from '{found.driver}' to '{found.output}'"
    lines = [*title(found.mechanism.name, words, found.mechanism.units), ""]
    if found.least is not None:
        x = found.least.driver
        where = f"{math.degrees(x):.6g} deg" if found.angular else f"{x:.6g} {unit}"
        lines += paragraph(
            f"least transmission angle {math.degrees(found.least.value):.3f}° at '{found.joint}', "
            f"where '{found.driver}' = {where}"
        )
    for loop, kind in found.loops:
        lines += paragraph(f"four-bar {loop}: {kind}")
    last = len(found) - 1
    kept = sorted({round(n * last / (min(SHOWN, len(found)) - 1 or 1)) for n in range(SHOWN)})
    kept = [k for k in kept if k <= last]
    value = np.degrees(found.driver_value) if found.angular else found.driver_value
    columns = [
        Column(found.driver, numbers(value[kept]), "deg" if found.angular else unit),
        Column("transmission angle", _cells(np.degrees(found.angle[kept])), "deg"),
        Column("pressure angle", _cells(np.degrees(found.pressure_angle[kept])), "deg"),
        Column("velocity ratio", _cells(found.velocity_ratio[kept])),
        Column("mech. advantage", _cells(found.mechanical_advantage[kept])),
        Column("joint force index", _cells(found.joint_force_index[kept])),
    ]
    lines += ["", *table(columns)]
    if len(kept) <= last:
        lines.append(f"{len(kept)} of {last + 1} instants; all of them with --json")
    return "\n".join(even([*lines, *certified(found)]))


def _cells(values: Any) -> list[str]:
    """Numbers of a column; a dash where there is none."""
    finite = [value for value in values.tolist() if math.isfinite(value)]
    cells = iter(numbers(finite or [0.0]))
    words = {math.inf: "infinite", -math.inf: "infinite"}
    return [next(cells) if math.isfinite(v) else words.get(v, "–") for v in values.tolist()]
