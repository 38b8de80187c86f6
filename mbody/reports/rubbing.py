"""The chapter of friction: what joints lose, where they rest, and where the mechanism jams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.quantities.units import DIMENSIONS
from mbody.reports.blocks import Block, Cells, Grid, Picture, Text
from mbody.reports.figures import untitled
from mbody.sheets.text_table import number, numbers
from mbody.views.plotting import PlottedCurve, plot_curves

if TYPE_CHECKING:
    from mbody.reports.subject import Subject

__all__ = ["friction"]


def friction(subject: Subject) -> list[Block]:
    """Losses by joint, their curves, and the bands of efforts at rest."""
    run = subject.run
    if not run.has_forces or not run.losses:
        return []
    blocks: list[Block] = []
    if run.analysis != "statics":
        blocks += _losses(subject)
    report = run.friction
    if report is not None and run.analysis != "simulate":
        certified = int(np.sum(report.certified))
        blocks.append(
            Text(
                f"Friction is certain to have one solution at {certified} of "
                f"{report.certified.size} instants."
            )
        )
        if report.jams:
            worst = min(report.jams, key=lambda one: one.coefficient)
            blocks.append(
                Text(
                    f"The mechanism jams at {len(report.jams)} instants, from a coefficient of "
                    f"{number(worst.coefficient)} in {worst.joint} on."
                )
            )
        blocks += _bands(subject)
    return blocks


def _losses(subject: Subject) -> list[Block]:
    run, unit = subject.run, subject.unit("power")
    names = list(run.losses)
    losses = np.array([np.nan_to_num(run.losses[name]) for name in names])
    columns = [Cells("joint", names, text=True)]
    if not subject.many:
        columns.append(Cells("loss", numbers(losses[:, 0]), unit))
        return [Grid("Power lost in joints", columns)]
    work = np.trapezoid(losses, run.t, axis=1)
    columns += [
        Cells("greatest", numbers(losses.max(axis=1)), unit),
        Cells("work lost", numbers(work), subject.unit("torque")),
    ]
    curves = [
        PlottedCurve(name, run.losses[name], DIMENSIONS["power"], unit, of="power lost")
        for name in names
        if np.ptp(np.nan_to_num(run.losses[name])) > 0.0
    ]
    found: list[Block] = [Grid("Power lost in joints", columns)]
    if curves:
        found.append(Picture("friction", untitled(plot_curves(run, [curves])), "Power lost"))
    return found


def _bands(subject: Subject) -> list[Block]:
    """Drivers whose effort is open where joints rest."""
    run = subject.run
    rows = []
    for driver in subject.mechanism.drivers if run.resting else ():
        limits = run.range(driver.name)
        for k in np.flatnonzero(limits.low != limits.high):
            ends = [_end(float(one[k])) for one in (limits.low, limits.high)]
            unit = subject.unit(driver.effort_dimension)
            rows.append((driver.name, number(float(run.t[k])), *ends, unit))
    if not rows:
        return []
    names, times, lows, highs, units = zip(*rows, strict=True)
    columns = [
        Cells("driver", list(names), text=True),
        Cells("at t", list(times), subject.unit("time")),
        Cells("from", list(lows)),
        Cells("to", list(highs)),
        Cells("unit", list(units), text=True),
    ]
    return [Grid("Efforts where joints rest", columns)]


def _end(value: float) -> str:
    if np.isfinite(value):
        return number(value)
    return "−∞" if value < 0.0 else "∞"
