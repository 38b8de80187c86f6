"""A kinematic picture of one instant: instant centres, centrodes, curvature, and the polygons of
velocities and accelerations beside the mechanism.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.engineering.instant_centres import instant_centres
from mbody.engineering.motion_polygons import acceleration_polygon, velocity_polygon
from mbody.views.backend import blank, styled
from mbody.views.bounds import bounds
from mbody.views.curvature_marks import mark_centrodes, mark_curvature, mark_inflection
from mbody.views.frame import captions, key_row
from mbody.views.image_polygon import draw_polygon
from mbody.views.mechanism_sketch import Shown, sketch_mechanism, sketch_scale
from mbody.views.pole_marks import PolesShown, shown_poles
from mbody.views.pose import Pose
from mbody.views.sketch import Sketch
from mbody.views.style import INK, SIZE, SOFT, Z

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.solution.solution import Solution

__all__ = ["KinematicMarks", "kinematic_picture"]

Array = np.ndarray

#: Points: gaps between the parts, the edge, a line of words, and how many letters one has at most.
GAP, EDGE, LINE = 30.0, 14.0, 12.5
#: How far curves are drawn beyond the mechanism, as a part of its size.
MARGIN = 0.5
#: Least width of the words.
LEAST = 340.0


@dataclass(frozen=True)
class KinematicMarks:
    """What is drawn into and beside a mechanism.

    Attributes
    ----------
    poles, polygons : bool
        All instant centres; the polygons of velocities and accelerations.
    centrodes, inflection : sequence of str
        Bodies.
    curvature : sequence of str
        Points.
    """

    poles: bool = False
    polygons: bool = False
    centrodes: Sequence[str] = ()
    inflection: Sequence[str] = ()
    curvature: Sequence[str] = ()

    def __bool__(self) -> bool:
        return bool(
            self.poles or self.polygons or self.centrodes or self.inflection or self.curvature
        )


class _KinematicSketch(Sketch):
    kinematic = True


def kinematic_picture(
    run: Solution, instant: int, marks: KinematicMarks, tracks: dict[str, Array], whole: Solution
) -> Figure:
    """Draw one instant.

    Parameters
    ----------
    run : Solution
        With velocities and accelerations, of one design.
    instant : int
    marks : KinematicMarks
    tracks : dict of str to array (points, 2)
        Paths of points that are drawn too.
    whole : Solution
        The motion of which centrodes are drawn.

    Raises
    ------
    ModelError
        As of the analyses in `mbody.engineering`.
    """
    run = run.take([instant])
    pose, shown = Pose(run, 0), Shown(run.mechanism, ())
    corners = bounds(pose)
    centres = instant_centres(run) if marks.poles else None
    poles = None if centres is None else shown_poles(centres, pose, corners)
    extent = np.array(poles.places) if poles is not None else np.empty((0, 2))
    wide = np.ptp(corners, axis=0).max()
    frame = np.vstack([corners, extent]) if len(extent) else corners
    reach = np.array([frame.min(axis=0) - MARGIN * wide, frame.max(axis=0) + MARGIN * wide])
    with styled():
        figure = blank()
        lines = [*tracks.values(), *([extent] if len(extent) else [])]
        scale = sketch_scale([pose], shown, lines, 1.0)
        sketch = _KinematicSketch(_part(figure), pose, *scale)
        words: list[str] = []

        def more(drawn: Sketch) -> None:
            words.extend(_marked(drawn, marks, poles, whole, reach))

        sketch_mechanism(sketch, False, tracks, shown, more=more)
        parts = [(sketch.axes, sketch.low, sketch.high, sketch.unit)]
        if marks.polygons:
            for found in (velocity_polygon(run), acceleration_polygon(run)):
                polygon = Sketch(_part(figure), pose, 1.0, 1.0)
                said = draw_polygon(polygon, found, pose)
                if said:
                    words.append(said)
                    polygon.axes.remove()
                else:
                    parts.append((polygon.axes, polygon.low, polygon.high, 1.0))
        _laid_out(figure, sketch, parts, words)
    return figure


def _marked(
    sketch: Sketch,
    marks: KinematicMarks,
    poles: PolesShown | None,
    whole: Solution,
    reach: Array,
) -> list[str]:
    words = []
    for body in marks.centrodes:
        mark_centrodes(sketch, whole, body, reach)
    for body in marks.inflection:
        words.append(mark_inflection(sketch, body, reach))
    for point in marks.curvature:
        words.append(mark_curvature(sketch, point, reach))
    if poles is not None:
        poles.mark(sketch)
        words += [_numbers(sketch.pose), *poles.words]
    return words


def _numbers(pose: Pose) -> str:
    """Which link has which number."""
    names = ["ground", *(body.name for body in pose.mechanism.bodies)]
    return "links: " + ", ".join(f"{n} {name}" for n, name in enumerate(names, 1))


def _part(figure: Figure) -> Any:
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), label=f"part {len(figure.axes)}")
    axes.set_axis_off()
    return axes


def _laid_out(
    figure: Figure,
    sketch: Sketch,
    parts: Sequence[tuple[Any, Array, Array, float]],
    words: Sequence[str],
) -> None:
    """The mechanism on the left, polygons beside it where both fit one below the other, words
    below all.
    """
    sizes = [(high - low) / unit for _, low, high, unit in parts]
    main, beside = sizes[0], sizes[1:]
    stacked = len(beside) == 2 and sum(size[1] for size in beside) + GAP <= 1.25 * max(
        main[1], 250.0
    )
    columns = [[1, 2]] if stacked else [[n] for n in range(1, len(parts))]
    wide = main[0] + sum(GAP + max(sizes[n][0] for n in column) for column in columns)
    tall = max([main[1], *(sum(sizes[n][1] for n in c) + GAP * (len(c) - 1) for c in columns)])
    heading, instant = captions(sketch)
    wide = max(wide, LEAST, sketch.wide(heading, SIZE["title"]) / sketch.unit)
    letters = int(wide / (0.44 * SIZE["text"]))
    signed = [re.sub(r"(?<![\w.])-(?=\d)", "−", sentence) for sentence in words]
    text = [part for sentence in signed for part in textwrap.wrap(sentence, letters)]
    key = 30.0
    whole = np.array([wide, tall + 40.0 + key + LINE * len(text)]) + 2.0 * EDGE
    figure.set_size_inches(*(whole / 72.0))
    left: dict[str, Any] = {"ha": "left", "va": "baseline"}
    y = whole[1] - EDGE - SIZE["title"]
    x0 = EDGE / whole[0]
    clean = heading.replace("$", r"\$")
    figure.text(x0, y / whole[1], clean, size=SIZE["title"], color=INK, **left)
    y -= 14.0
    figure.text(x0, y / whole[1], instant, size=0.9 * SIZE["text"], color=SOFT, **left)
    top = y - 12.0
    _placed(parts[0], EDGE, top - 0.5 * (tall + main[1]), whole)
    x = EDGE + main[0]
    for column in columns:
        x += GAP
        down = top
        spare = (tall - sum(sizes[n][1] for n in column) - GAP * (len(column) - 1)) / 2.0
        down -= max(spare, 0.0)
        for n in column:
            down -= sizes[n][1]
            _placed(parts[n], x, down, whole)
            down -= GAP
        x += max(sizes[n][0] for n in column)
    foot = top - tall - key
    axes = figure.add_axes((x0, foot / whole[1], 1.0 - x0, key / whole[1]), label="key")
    axes.set_axis_off()
    axes.set_xlim(0.0, (whole[0] - EDGE) * sketch.unit)
    axes.set_ylim(0.0, key * sketch.unit)
    key_row(sketch, axes, 0.45 * key * sketch.unit, main[0] * sketch.unit, None)
    y = foot
    for line in text:
        y -= LINE
        clean = line.replace("$", r"\$")
        look = {"size": 0.92 * SIZE["text"], "color": SOFT, "zorder": Z["text"], **left}
        figure.text(x0, (y + 3.0) / whole[1], clean, **look)


def _placed(part: tuple[Any, Array, Array, float], x: float, y: float, whole: Array) -> None:
    """Put axes at a place of the figure [points], in their scale."""
    axes, low, high, unit = part
    wide, tall = (high - low) / unit
    axes.set_position((x / whole[0], y / whole[1], wide / whole[0], tall / whole[1]))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
