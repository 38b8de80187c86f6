"""Chapters of figures: plots over the cycle, hodographs of forces, free-body diagrams."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.reports.blocks import Block, Picture, Text
from mbody.views.free_bodies import MOST, draw_free_bodies, when
from mbody.views.plotting import all_measures, plot
from mbody.views.polar import hodograph

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.reports.subject import Subject

__all__ = ["freebody", "plots", "polar", "untitled"]

#: Panels of one figure; joints whose forces are plotted where nobody says which.
PANELS, FORCES = 4, 6
#: Inches that a title takes.
TITLE = 0.3
#: Links whose diagrams are shown where there are more.
LINKS = 12


def plots(subject: Subject) -> list[Block]:
    """Efforts, joint forces and measures over the cycle."""
    run = subject.run
    if not subject.many:
        return []
    groups: list[tuple[str, list[str]]] = []
    if subject.plots:
        groups = _panels("Chosen quantities", list(subject.plots))
    else:
        drivers = subject.mechanism.drivers if subject.loaded else ()
        efforts = [f"{driver.name}.effort" for driver in drivers]
        joints = [f"{name}.force" for name in greatest(subject)]
        if efforts or joints:
            groups = [("Efforts and joint forces", [*efforts[:3], *joints])]
        if subject.mechanism.measures:
            groups += _panels("Measures", all_measures(run))
        if not groups:
            bodies = [body.name for body in subject.mechanism.bodies][:3]
            groups = [
                ("Motion", [f"{body}.{key}" for key in ("angle", "omega") for body in bodies])
            ]
    return [
        # the bars of modes are below the first
        Picture(
            f"plot-{n}", untitled(plot(run, *names, modes=n == 1)), f"{title}: {', '.join(names)}"
        )
        for n, (title, names) in enumerate(groups, 1)
    ]


def untitled(figure: Figure) -> Figure:
    """The same figure without its title, which every figure of a report would repeat."""
    titles = [text for text in figure.texts if text.get_gid() == "title"]
    if not titles:
        return figure
    wide, tall = figure.get_size_inches()
    ratio = tall / (tall - TITLE)
    for text in titles:
        text.remove()
    for axes in figure.axes:
        box = axes.get_position()
        axes.set_position((box.x0, ratio * box.y0, box.width, ratio * box.height))
    for text in figure.texts:
        text.set_y(ratio * text.get_position()[1])
    drawn: list[Any] = [*figure.lines, *figure.artists]
    for line in drawn:  # those of the legend
        line.set_ydata(ratio * np.asarray(line.get_ydata()))
    figure.set_size_inches(wide, tall - TITLE)
    return figure


def _panels(title: str, names: list[str]) -> list[tuple[str, list[str]]]:
    """Names in figures of a few panels."""
    most = 2 * PANELS
    return [(title, names[n : n + most]) for n in range(0, len(names), most)]


def greatest(subject: Subject) -> list[str]:
    """The joints of the greatest forces, one of those that are alike."""
    if not subject.run.has_forces:
        return []
    peaks: dict[str, float] = {}
    known: list[np.ndarray] = []
    for joint in subject.mechanism.joints:
        size = subject.run.reaction(joint.name).magnitude
        top = float(np.nanmax(size, initial=0.0))
        alike = any(np.allclose(size, other, rtol=1e-3, atol=1e-3 * top) for other in known)
        if top > subject.floor and not alike:
            peaks[joint.name] = top
            known.append(size)
    return sorted(sorted(peaks, key=lambda name: -peaks[name])[:FORCES], key=list(peaks).index)


def polar(subject: Subject) -> list[Block]:
    """The tips of joint forces in world axes, and in those of the crank."""
    run = subject.run
    names = list(subject.polar) or greatest(subject)
    if not subject.many or not names:
        return []
    blocks: list[Block] = [
        Text(
            "The curve of the tip of each force over the cycle: how far and in which direction it "
            "loads its bearing. Dots are 30 degrees of the driver apart, the circle is the first "
            "instant."
        ),
        Picture("forces-world", untitled(hodograph(run, *names)), "Joint forces in world axes"),
    ]
    for driver in subject.mechanism.drivers[:1]:
        body = getattr(driver, "body", None)
        own = [name for name in names if body in _ends(subject, name)]
        if body is not None and own:
            figure = untitled(hodograph(run, *own, axes=body))
            caption = f"Forces on {body}, in its own axes: where its journals are loaded"
            blocks.append(Picture("forces-link", figure, caption))
    return blocks


def _ends(subject: Subject, joint: str) -> set[str]:
    element = next(one for one in subject.mechanism.joints if one.name == joint)
    return {element.i.body, element.j.body}


def freebody(subject: Subject) -> list[Block]:
    """Every link alone, at the chosen instants."""
    run = subject.run
    if not subject.marked or not (subject.loaded or run.analysis == "simulate"):
        return []
    bodies = [body.name for body in subject.mechanism.bodies]
    shown = bodies[:LINKS]
    blocks: list[Block] = [
        Text(
            "Every link alone, to scale; d'Alembert's forces −m·a_{G} and torques −I·α are dashed. "
            "Beside it its force polygon, which closes."
        )
    ]
    if len(bodies) > len(shown):
        blocks.append(Text(f"The first {len(shown)} of {len(bodies)} links are shown."))
    for k in subject.marked[: max(1, MOST // len(shown))]:
        for n, body in enumerate(shown, 2):
            figure = draw_free_bodies(run, [body], [k], headed=False)
            caption = f"Link {n}, {body}: {when(run, k)}"
            blocks.append(Picture(f"freebody-{k}-{body}", figure, caption))
    return blocks
