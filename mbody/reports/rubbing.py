"""The chapter of friction: what joints lose, where they rest, and where the mechanism jams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.quantities.units import DIMENSIONS
from mbody.reports.blocks import Block, Cells, Grid, Picture, Text
from mbody.reports.figures import untitled
from mbody.sheets.text_table import number, numbers
from mbody.views.mode_bars import MODES, mode_rows
from mbody.views.plotting import PlottedCurve, plot_curves

if TYPE_CHECKING:
    from mbody.reports.subject import Subject

__all__ = ["friction"]

#: A loss below this part of the greatest kinetic energy over the motion is rounding.
ROUNDING = 1e-9


def friction(subject: Subject) -> list[Block]:
    """Modes, losses by joint and contact, their curves, and the bands of efforts at rest."""
    run = subject.run
    blocks: list[Block] = _modes(subject)
    if not run.has_forces or not run.losses:
        return blocks
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


def _modes(subject: Subject) -> list[Block]:
    """How long each contact and rough joint is in each mode of a motion, how often it changes."""
    run = subject.run
    if run.analysis != "simulate" or not run.modes or not subject.many:
        return []
    rows, left_out = mode_rows(run)
    whole = max(float(run.t[-1] - run.t[0]), 1e-300)
    there = [mode for mode in MODES if any(s.mode == mode for row in rows for s in row.spans)]
    columns = [Cells("contact or joint", [row.name for row in rows], text=True)]
    for mode in there:
        parts = [sum(s.high - s.low for s in row.spans if s.mode == mode) / whole for row in rows]
        columns.append(Cells(MODES[mode][0], [f"{100 * part:.1f}" for part in parts], "%"))
    columns.append(Cells("changes", [str(len(row.spans) - 1) for row in rows]))
    if any(row.impacts for row in rows):
        columns.append(Cells("impacts", [str(len(row.impacts)) for row in rows]))
    if run.energy is not None:
        lost = [float(run.energy.lost[row.name][-1]) for row in rows]
        columns.append(Cells("energy lost", numbers(np.array(lost)), subject.unit("torque")))
    found: list[Block] = [Grid("Modes, in parts of the motion", columns)]
    if left_out:
        found.append(Text(f"{left_out} more change less often and are left out."))
    return found


def _losses(subject: Subject) -> list[Block]:
    run, unit = subject.run, subject.unit("power")
    names = list(run.losses)
    losses = np.array([np.nan_to_num(run.losses[name]) for name in names])
    columns = [Cells(_kind(subject, names), names, text=True)]
    if not subject.many:
        columns.append(Cells("loss", numbers(losses[:, 0]), unit))
        return [Grid(_title(subject, names), columns)]
    if run.energy is not None:
        # what sticks slides by rounding only
        least = ROUNDING * float(run.energy.kinetic.max()) / max(float(np.ptp(run.t)), 1e-300)
        losses = np.where(losses.max(axis=1, keepdims=True) > least, losses, 0.0)
        if not losses.any():
            return []
    columns.append(Cells("greatest", numbers(losses.max(axis=1)), unit))
    if run.energy is None:
        work = np.trapezoid(losses, run.t, axis=1)
        columns.append(Cells("work lost", numbers(work), subject.unit("torque")))
    curves = [
        PlottedCurve(name, loss, DIMENSIONS["power"], unit, of="power lost")
        for name, loss in zip(names, losses, strict=True)
        if np.ptp(loss) > 0.0
    ]
    found: list[Block] = [Grid(_title(subject, names), columns)]
    if curves:
        found.append(Picture("friction", untitled(plot_curves(run, [curves])), "Power lost"))
    return found


def _kind(subject: Subject, names: list[str]) -> str:
    """What a table of losses is of."""
    contacts = {one.name for one in subject.mechanism.contacts}
    kinds = [
        word for word, there in (("joint", set(names) - contacts), ("contact", contacts)) if there
    ]
    return " or ".join(kinds)


def _title(subject: Subject, names: list[str]) -> str:
    return f"Power lost by sliding, by {_kind(subject, names)}"


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
