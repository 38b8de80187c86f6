"""The chapter that compares two designs: the same quantities of both, and their curves together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.quantities.units import DIMENSIONS
from mbody.reports.blocks import Block, Cells, Grid, Picture, Text
from mbody.reports.figures import greatest, untitled
from mbody.sheets.text_table import number, unit_text
from mbody.solution.measures import found_by, measured
from mbody.views.plotting import plot

if TYPE_CHECKING:
    from mbody.reports.subject import Subject

__all__ = ["comparison"]

#: What of the greatest amount of a quantity is rounding.
ROUNDING = 1e-9


def comparison(subject: Subject) -> list[Block]:
    """Peaks of both designs with the change, and curves of efforts and forces."""
    other = subject.other
    if other is None:
        return []
    here, there = amounts(subject), amounts(other)
    names = [name for name in here if name in there and here[name][1] == there[name][1]]
    pairs = [(here[name][0], there[name][0]) for name in names]
    columns = [
        Cells("quantity", names, text=True),
        Cells(subject.label or "this design", [number(a) for a, _ in pairs]),
        Cells(other.label or "other design", [number(b) for _, b in pairs]),
        Cells("change", [_change(a, b) for a, b in pairs], "%"),
        Cells("unit", [here[name][1] for name in names], text=True),
    ]
    blocks: list[Block] = [
        Text(f"This design beside another one, {other.label or other.mechanism.name}."),
        Grid("Two designs", columns),
    ]
    efforts = [f"{driver.name}.effort" for driver in subject.mechanism.drivers[:2]]
    known = {joint.name for joint in other.mechanism.joints}
    drawn = [name for name in efforts if name.partition(".")[0] in _drivers(other)]
    drawn += [f"{name}.force" for name in greatest(subject)[:2] if name in known]
    if subject.many and other.many and drawn and subject.loaded:
        labels = [subject.label or "this design", other.label or "other design"]
        figure = untitled(plot([subject.run, other.run], *drawn, labels=labels))
        blocks.append(Picture("comparison", figure, f"Both designs: {', '.join(drawn)}"))
    return blocks


def _drivers(subject: Subject) -> set[str]:
    return {driver.name for driver in subject.mechanism.drivers}


def _change(here: float, there: float) -> str:
    """From this design to the other, in percent."""
    if not here:
        return ""
    part = round(100.0 * (there - here) / abs(here), 1)
    return f"{part:+.1f}" if part else "0.0"


def amounts(subject: Subject) -> dict[str, tuple[float, str]]:
    """What is compared: peaks of forces and efforts, extremes of measures, with their units."""
    run, found = subject.run, {}
    if subject.loaded:
        for joint in subject.mechanism.joints:
            size = float(np.nanmax(run.reaction(joint.name).magnitude))
            if size > subject.floor:
                found[f"peak force at {joint.name}"] = (size, subject.unit("force"))
        for driver in subject.mechanism.drivers:
            effort = run.effort(driver.name)
            kind = "torque" if driver.angular else "force"
            top = float(np.nanmax(np.abs(effort)))
            found[f"peak {kind} of {driver.name}"] = (top, subject.unit(kind))
            power = float(np.nanmax(np.abs(run.measure(f"{driver.name}.power"))))
            if power:
                found[f"peak power of {driver.name}"] = (power, subject.unit("power"))
    for name, measure in subject.mechanism.measures.items():
        if not found_by(run, measure):
            continue
        values, dimension, unit = measured(run, measure)
        if dimension == DIMENSIONS["angle"] and not measure.unit:
            values, unit = np.degrees(values), "deg"
        top = float(np.nanmax(np.abs(values)))
        for word, extreme in (("least", np.nanmin), ("greatest", np.nanmax)):
            value = float(extreme(values))
            value = 0.0 if abs(value) <= ROUNDING * top else value
            found[f"{name}, {word}"] = (value, unit_text(unit))
    return found
