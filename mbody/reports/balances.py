"""Chapters of balances: energy over the cycle, and the shaking force on the frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.engineering.fluctuation import fluctuation
from mbody.engineering.shaking import shaking_force
from mbody.errors import ModelError
from mbody.quantities.units import DIMENSIONS
from mbody.reports.blocks import Block, Cells, Grid, Picture, Text
from mbody.reports.figures import untitled
from mbody.reports.peaks import peak, where_columns
from mbody.sheets.text_table import number, numbers
from mbody.views.plotting import PlottedCurve, plot_curves

if TYPE_CHECKING:
    from mbody.reports.subject import Subject

__all__ = ["energy", "shaking"]

Array = np.ndarray


def energy(subject: Subject) -> list[Block]:
    """Of a motion the balance of energy; of a cycle the work, and its fluctuation."""
    run = subject.run
    if not subject.many or run.analysis == "statics":
        return []
    unit = subject.unit("torque")
    if run.energy is not None:
        own = run.energy
        rows = {
            "kinetic": own.kinetic,
            "potential": own.potential,
            "work of drivers and loads": own.work,
            "dissipated": own.dissipated,
        }
        moving = {name: values for name, values in rows.items() if np.ptp(values) > 0.0}
        curves = [_curve(name, values, unit) for name, values in moving.items()]
        if not curves:
            return []
        error = f"{own.error:.1e}" if own.error else "0"
        return [
            Picture("energy", untitled(plot_curves(run, [curves])), "Energy over time"),
            Text(
                f"Kinetic + potential + dissipated − work stays the same to {error} of the "
                f"greatest energy, {number(own.size)} {unit}."
            ),
        ]
    curves = [_curve("kinetic", kinetic(subject), unit)]
    blocks: list[Block] = []
    for driver in subject.mechanism.drivers if subject.loaded else ():
        if not driver.angular or not np.ptp(run.driven(driver.name)[0]) > 0.0:
            continue
        try:
            found = fluctuation(run, driver.name)
        except ModelError:  # of part of a turn, or of a cycle that does not close
            continue
        curves.append(_curve(f"fed by {driver.name} less its mean", found.energy, unit))
        # a mean of equal instants is no closer than that where the torque has corners
        works = abs(found.mean) > float(np.max(np.abs(found.torque))) / len(run) ** 2
        rows_of = [
            ("work of the cycle", found.work * works, unit),
            ("mean torque", found.mean * works, subject.unit("torque")),
            ("greatest fluctuation of energy ΔE", found.fluctuation, unit),
        ]
        if works:
            rows_of.append(("coefficient of fluctuation of energy", found.energy_coefficient, ""))
        columns = [
            Cells("quantity", [row[0] for row in rows_of], text=True),
            Cells("value", [number(row[1]) for row in rows_of]),
            Cells("unit", [row[2] for row in rows_of], text=True),
        ]
        blocks.append(Grid(f"Turning moment of {driver.name}", columns))
    if not any(np.ptp(curve.values) > 0.0 for curve in curves):
        return blocks
    return [
        Picture("energy", untitled(plot_curves(run, [curves])), "Energy over the cycle"),
        *blocks,
    ]


def kinetic(subject: Subject) -> Array:
    """½ Σ (m v² + I ω²) over the instants."""
    run, total = subject.run, np.zeros(len(subject.run))
    for n, body in enumerate(subject.mechanism.bodies):
        at, (m, _, inertia) = run[body.name], run.system.mass[3 * n : 3 * n + 3, 0]
        total = total + 0.5 * (m * (at.vx**2 + at.vy**2) + inertia * at.omega**2)
    return total


def _curve(name: str, values: Array, unit: str) -> PlottedCurve:
    return PlottedCurve(name, values, DIMENSIONS["torque"], unit, of="energy")


def shaking(subject: Subject) -> list[Block]:
    """What the mechanism does to its frame, by two ways."""
    run = subject.run
    if not run.has_forces or not subject.mechanism.joints:
        return []
    found = shaking_force(run)
    size = found.magnitude
    greatest = float(np.nanmax(size))
    moment = float(np.nanmax(np.abs(found.moment)))
    if greatest <= subject.floor and moment <= subject.floor * run.system.length:
        return []
    turns = moment > subject.floor * run.system.length
    at = [peak(size), *([peak(found.moment)] * turns)]
    force, torque = subject.unit("force"), subject.unit("torque")
    differ = np.hypot(found.fx - found.fx_inertia, found.fy - found.fy_inertia)
    columns = [
        Cells(
            "quantity", ["shaking force", *(["shaking moment about the origin"] * turns)], text=True
        ),
        Cells("peak", [number(greatest), *(number(float(found.moment[k])) for k in at[1:])]),
        Cells("unit", [force, *([torque] * turns)], text=True),
        *where_columns(subject, at),
    ]
    part = float(np.nanmax(differ)) / (greatest or 1.0)
    blocks: list[Block] = [
        Text(
            "The resultant of all joints, drivers and loads on the frame. Weights and forces from "
            "outside are part of it."
        ),
        Grid("On the frame", columns),
        Text(
            "By the reactions, and by the inertia forces of all links: both ways agree to "
            f"{numbers([part])[0] if part >= 1e-3 else f'{part:.1e}'} of the peak."
        ),
    ]
    if subject.many:
        kind, turning = DIMENSIONS["force"], DIMENSIONS["torque"]
        panels = [
            [
                PlottedCurve("along x", found.fx, kind, force, of="force on the frame"),
                PlottedCurve("along y", found.fy, kind, force, of="force on the frame"),
                PlottedCurve("magnitude", size, kind, force, of="force on the frame"),
            ]
        ]
        panels += [[PlottedCurve("moment", found.moment, turning, torque)]] * turns
        caption = "Shaking force and shaking moment" if turns else "Shaking force"
        blocks.append(Picture("shaking", untitled(plot_curves(run, panels)), caption))
    return blocks
