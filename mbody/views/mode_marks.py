"""Marks of modes: what sticks, slides, rolls or is open, told apart without colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.views.pose import heading
from mbody.views.shapes import box
from mbody.views.style import INK, PAPER, SOFT, Z

if TYPE_CHECKING:
    from mbody.views.sketch import Sketch

__all__ = ["mark"]

Array = np.ndarray


def mark(sketch: Sketch, place: Array, mode: str, normal: Array, name: str) -> None:
    """The mark of a mode at a place, with the normal on j: a filled square sticks, an open circle
    slides, with the way of j beside it, a ring with a dot rolls, a dashed circle is open.
    """
    size, z = sketch.size("pin"), Z["pin"] + 0.3
    if mode == "open":
        dashes = (0, (2.0, 1.6))
        sketch.disc(place, 0.8 * size, "none", SOFT, 0.9, z, name=name, dashes=dashes, weight=0.3)
    elif mode == "stick":
        corners = box(place, 0.78 * size, 0.78 * size, heading(normal))
        sketch.shape(corners, INK, PAPER, 0.7, z, name=name)
    elif mode == "roll":
        sketch.disc(place, 0.95 * size, PAPER, INK, 1.1, z, name=name)
        sketch.disc(place, 0.4 * size, INK, INK, 0.3, z + 0.01, name=name, weight=0.0)
    else:
        sketch.disc(place, 0.8 * size, PAPER, INK, 1.1, z, name=name)
        _sliding(sketch, place, normal, 1.0 if mode == "slip+" else -1.0, name)


def _sliding(sketch: Sketch, place: Array, normal: Array, sense: float, name: str) -> None:
    """A half arrow beside the mark, on the side of j, the way that j slides over i."""
    size = sketch.size("pin")
    u = sense * np.array([normal[1], -normal[0]])
    tail = place + 1.5 * size * normal - 1.6 * size * u
    tip = tail + 3.4 * size * u
    barb = tip - 1.3 * size * u + 0.85 * size * normal
    sketch.line([tail, tip, barb], 0.9, INK, Z["pin"] + 0.3, name=name, weight=0.4)
