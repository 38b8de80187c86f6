"""Diagrams of axial force, shear force, bending moment and stress along a link."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.views.backend import blank, styled
from mbody.views.style import CURVES, INK, SOFT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.engineering.internal_loads import InternalLoads

__all__ = ["internal_diagram"]

#: Inches.
WIDTH, PANEL, MARGIN = 6.4, 1.5, 0.9


def internal_diagram(found: InternalLoads, instant: int | None = None) -> Figure:
    """Diagrams of what a link carries inside: N, V, M, and the equivalent stress of its section.

    Parameters
    ----------
    found : InternalLoads
    instant : int, optional
        Which of its instants, counted from 0; by default that of the greatest bending moment. Where
        there are several, the area between the least and the greatest of all is shaded.

    Raises
    ------
    ModelError
        Where matplotlib is not installed.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True, instants=25)
    >>> len(internal_diagram(mbody.engineering.internal_loads(run, "coupler")).axes)
    3
    """
    unit = found.run.mechanism.units
    rows: list[tuple[str, Any, str]] = [
        ("axial force", found.axial, unit.force),
        ("shear force", found.shear, unit.force),
        ("bending moment", found.bending, unit.of("torque")),
    ]
    if found.section is not None:
        rows.append(("equivalent stress", found.stress().equivalent, unit.of("pressure")))
    greatest = np.abs(found.bending).max(axis=1)
    k = int(greatest.argmax()) if instant is None else range(len(found.axial))[instant]
    with styled():
        figure = blank()
        figure.set_size_inches(WIDTH, PANEL * len(rows) + MARGIN)
        panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
        s = found.place
        for n, (axes, (title, values, of)) in enumerate(zip(panels, rows, strict=True)):
            color = CURVES[n % len(CURVES)][0]
            if len(values) > 1:
                low, high = values.min(axis=0), values.max(axis=0)
                axes.fill_between(s, low, high, color=color, alpha=0.15, linewidth=0.0)
            axes.plot(s, values[k], color=color, linewidth=1.6)
            axes.axhline(0.0, color=INK, linewidth=0.7)
            axes.set_ylabel(f"{title}\n{of}")
            axes.grid(color=SOFT, alpha=0.35, linewidth=0.5)
            axes.spines[["top", "right"]].set_visible(False)
        panels[-1].set_xlabel(f"from {found.along[0]} to {found.along[1]}, {unit.length}")
        at = f"t = {found.run.t[k]:.6g} {unit.time}"
        shaded = "" if len(found.axial) == 1 else "; shaded: all instants"
        panels[0].set_title(f"{found.body}: {at}{shaded}")
        figure.tight_layout()
    return figure
