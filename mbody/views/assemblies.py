"""All assembly modes of a mechanism beside each other, at one scale."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.errors import ModelError
from mbody.solution.histories import Record
from mbody.views.drawing import draw_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.analysis.assemblies.assembly_mode import AssemblyModes

__all__ = ["draw_assemblies"]

#: Modes that a picture shows.
MOST = 60


def draw_assemblies(modes: AssemblyModes) -> Figure:
    """A strip of all modes, each with its number and its name.

    Raises
    ------
    ModelError
        Where there is no mode; where matplotlib is not installed.

    Examples
    --------
    >>> import mbody
    >>> figure = draw_assemblies(mbody.assembly_modes(mbody.makers.four_bar(1, 3, 2, 3.5)))
    >>> len([axes for axes in figure.axes if axes.get_label() != "key"])
    2
    """
    shown = list(modes)[:MOST]
    if not shown:
        raise ModelError(
            f"'{modes.mechanism.name}' closes nowhere there: there is no assembly mode to draw"
        )
    drive = dict(modes.at) or None
    runs = [kinematics(modes.mechanism, drive=drive, guess=mode) for mode in shown]
    first = runs[0]
    rows = np.concatenate([run.record.table(slice(None))[:1] for run in runs])
    given = [run.given[:1] for run in runs if run.given is not None]
    whole = dataclasses.replace(
        first,
        t=np.repeat(first.t[:1], len(runs)),
        record=Record([np.ascontiguousarray(rows[:, :, None])], len(runs), batch=False),
        given=np.concatenate(given) if given else None,
    )
    return draw_cells(whole, [f"{m.number} {m.name}{' (used)' if m.used else ''}" for m in shown])
