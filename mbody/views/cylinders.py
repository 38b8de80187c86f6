"""Cylinders of pressure loads: place and drawing of the barrel and the piston.

Pressure acts along a line, so the place of the piston on it is arbitrary. It is drawn ahead of the
place that it acts on, at the end of a piston rod, so that it does not cover a pin or crosshead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.model.loads import PistonPressure, ReciprocatingCylinder
from mbody.views.carriers import on, placed
from mbody.views.labels import symbolic
from mbody.views.shapes import box, direction, hatching
from mbody.views.style import INK, LINK, WHEEL, Z

if TYPE_CHECKING:
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["Barrel", "barrel", "barrel_symbol"]

Array = np.ndarray

#: Default clearance beyond the dead centres, relative to the stroke.
CLEARANCE = 0.12


@dataclass(frozen=True)
class Barrel:
    """A cylinder with its piston.

    Attributes
    ----------
    head, mouth : arrays (2,)
        Middles of the closed end, and of the end where the piston rod comes out.
    piston : array (2,)
        Its middle.
    place : array (2,)
        End of the piston rod.
    angle : float
        From the mouth to the head [rad].
    """

    head: Array
    mouth: Array
    piston: Array
    place: Array
    angle: float


def barrel(load: PistonPressure | ReciprocatingCylinder, pose: Pose, block: float) -> Barrel:
    """A cylinder for a piston of that size, at one instant.

    The stroke is between the dead centres of the load; without any it is the range in this run.
    """
    angle, place = pose.direction(load, "i"), pose.place(load, "j")
    u = direction(angle)
    here = float(u @ (place - pose.place(load, "i")))
    if isinstance(load, ReciprocatingCylinder):
        near, far = pose.number(load, "near"), pose.number(load, "far")
        sense, spare = math.copysign(1.0, near - far), pose.number(load, "clearance")
    else:
        near, far = _stroke(load, pose, 2.0 * block, here)
        sense = -1.0
        spare = CLEARANCE * abs(near - far)
    # from here on counted towards the head
    near, far, here, thick = sense * near, sense * far, sense * here, 0.3 * block
    ahead = near - far + spare + thick + 1.3 * block
    if near < 0.0:  # the place on i lies beyond: it is the head
        ahead = max(min(ahead, -near - spare - thick), 0.0)
    w = sense * u
    piston = place + ahead * w
    head = piston + (near - here + spare + thick) * w
    mouth = piston + (far - here - spare - thick) * w
    return Barrel(head, mouth, piston, place, math.atan2(w[1], w[0]))


def _stroke(load: PistonPressure, pose: Pose, least: float, here: float) -> tuple[float, float]:
    """Coordinates of the piston nearest to the head and farthest from it."""
    angle = pose.run[load.i.body].angle + float(pose.system.numbers.angle(load, "i"))
    way = pose.track(load, "j") - pose.track(load, "i")
    along = way[:, 0] * np.cos(angle) + way[:, 1] * np.sin(angle)
    if np.ptp(along) < least:
        return here - 0.5 * least, here + 0.5 * least
    return float(along.min()), float(along.max())


def barrel_symbol(load: PistonPressure | ReciprocatingCylinder, sketch: Sketch) -> None:
    """A barrel with its piston and piston rod, hatched where it is fixed; open where no pressure
    acts on the side of the rod.
    """
    own = barrel(load, sketch.pose, sketch.size("block"))
    half, z = 0.85 * sketch.size("block"), Z["block"] - 0.5
    u = direction(own.angle)
    n = np.array([-u[1], u[0]])
    if n[1] > 1e-9:  # below, or on the right
        n = -n
    length = float(np.hypot(*(own.head - own.mouth)))
    inside = box(0.5 * (own.head + own.mouth), 0.5 * length, half, own.angle)
    fixed, moving = on(load.i.body), placed(sketch.pose.site(load, "j"), load.i.body)
    with sketch.carried(fixed):
        sketch.shape(inside, WHEEL, "none", 0.0, z, weight=0.0)
    walls = [own.mouth + half * n, own.head + half * n, own.head - half * n, own.mouth - half * n]
    if _double(load, sketch.pose):
        walls.append(walls[0])
    with sketch.carried(fixed):
        sketch.line(walls, 1.5, INK, z + 0.1, name=f"cylinder:{load.name}")
    if load.i.body == "ground":
        depth = sketch.size("hatch")
        ends = (own.mouth, own.head) if n @ (u[1], -u[0]) > 0.0 else (own.head, own.mouth)
        edge = [end + half * n for end in ends]
        sketch.strokes(hatching(edge[0], edge[1], depth, 1.05 * depth), Z["ground"])
    thick = 0.3 * sketch.size("block")
    disc = box(own.piston, thick, 0.92 * half, own.angle)
    with sketch.carried(moving):
        sketch.line([own.place, own.piston], 2.6, INK, z + 0.2, name=f"rod:{load.name}")
        sketch.shape(disc, LINK, INK, 1.1, z + 0.3, name=f"piston:{load.name}")
    wanted, gap = math.atan2(-n[1], -n[0]), half + 3.0 * sketch.unit
    middle = 0.5 * (own.head + own.mouth)
    with sketch.carried(fixed):
        sketch.label(symbolic(load.name), middle, wanted, gap, turn=0.4, italic=True)


def _double(load: PistonPressure | ReciprocatingCylinder, pose: Pose) -> bool:
    """Whether pressure acts on the side of the piston rod too."""
    if isinstance(load, ReciprocatingCylinder):
        return load.opposite_area is not None
    return pose.number(load, "rod_area") > 0.0
