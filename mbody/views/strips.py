"""Several instants beside each other, in cells of one size and one scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.views.frame import captions, key_row
from mbody.views.style import INK, SIZE, SOFT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.views.sketch import Sketch

__all__ = ["in_strip"]

#: Points: the width of a page of cells, gaps, the height of a caption.
PAGE, GAP, CAPTION = 760.0, 18.0, 18.0


def in_strip(
    figure: Figure,
    sketches: Sequence[Sketch],
    arrows: tuple[float, float, str] | None,
    texts: Sequence[str] = (),
) -> None:
    """Lay out drawings that are finished.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    sketches : list of Sketch
        Each on axes of its own, all of one scale.
    arrows : (length of a unit of force, greatest force, colour), optional
        As of `framed`.
    texts : sequence of str, optional
        Captions; by default their instants.
    """
    first, unit = sketches[0], sketches[0].unit
    low = np.min([sketch.low for sketch in sketches], axis=0)
    high = np.max([sketch.high for sketch in sketches], axis=0)
    wide, tall = (high - low) / unit
    columns = max(1, min(len(sketches), int((PAGE + GAP) // (wide + GAP))))
    rows = math.ceil(len(sketches) / columns)
    margin, head, foot = SIZE["margin"], 1.6 * SIZE["title"] + 8.0, 30.0
    whole = columns * wide + (columns - 1) * GAP + 2.0 * margin
    height = rows * (tall + CAPTION) + (rows - 1) * GAP + head + foot + 2.0 * margin
    title = captions(first)
    whole = max(whole, 2.0 * margin + first.wide(title[0], SIZE["title"]) / unit, 340.0)
    figure.set_size_inches(whole / 72.0, height / 72.0)
    look: dict[str, Any] = {"ha": "left", "va": "baseline"}
    y = height - margin - SIZE["title"]
    figure.text(margin / whole, y / height, title[0], size=SIZE["title"], color=INK, **look)
    for n, sketch in enumerate(sketches):
        row, column = divmod(n, columns)
        x = margin + column * (wide + GAP)
        y = height - margin - head - row * (tall + CAPTION + GAP) - CAPTION
        text = texts[n] if texts else captions(sketch)[1]
        figure.text(x / whole, (y + 5.0) / height, text, size=SIZE["text"], color=SOFT, **look)
        sketch.axes.set_position((x / whole, (y - tall) / height, wide / whole, tall / height))
        sketch.axes.set_xlim(low[0], high[0])
        sketch.axes.set_ylim(low[1], high[1])
    key = figure.add_axes((margin / whole, 0.0, 1.0 - margin / whole, foot / height), label="key")
    key.set_axis_off()
    key.set_xlim(0.0, (whole - margin) * unit)
    key.set_ylim(0.0, foot * unit)
    key_row(first, key, 0.4 * foot * unit, wide * unit, arrows)
