"""Tyres: their circles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mbody.model.loads import Tyre
from mbody.views.carriers import on
from mbody.views.labels import symbolic
from mbody.views.shapes import direction
from mbody.views.style import INK, SOFT, WHEEL, Z

if TYPE_CHECKING:
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["tyre_circle", "tyre_symbol"]

Array = np.ndarray


def tyre_circle(load: Tyre, pose: Pose) -> tuple[Array, float]:
    """The centre of the wheel, and the radius of the tyre."""
    return pose.place(load, "j"), pose.number(load, "radius")


def tyre_symbol(load: Tyre, sketch: Sketch) -> None:
    """The tyre on its wheel; its road is drawn with the shapes of the ground."""
    centre, radius = tyre_circle(load, sketch.pose)
    body = load.places()["j"].body
    with sketch.carried(on(body)):
        sketch.disc(
            centre, radius, WHEEL, INK, 1.5, Z["wheel"], name=f"load:{load.name}", weight=0.6
        )
        rim = centre + 0.86 * radius * direction(sketch.pose.angle(body))
        sketch.line([centre, rim], 0.9, SOFT, Z["wheel"] + 0.01, weight=0.2)
        sketch.label(symbolic(load.name), centre, math.pi / 4.0, 0.6 * radius, italic=True)
