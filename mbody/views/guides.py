"""Guides of sliding joints: the body with the guide, and its ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.model.joints import PinSlot, Prismatic
from mbody.views.shapes import direction

if TYPE_CHECKING:
    from mbody.views.sketch import Sketch

__all__ = ["guide", "travel"]

Array = np.ndarray


def guide(joint: Prismatic | PinSlot) -> tuple[str, str, str]:
    """The body that carries the guide, the field of its marker, and that of what slides.

    It is body i, except for a prismatic joint whose body j is the ground.

    >>> guide(Prismatic("slot", "block", "ground"))
    ('ground', 'j', 'i')
    """
    if isinstance(joint, Prismatic) and joint.j.body == "ground":
        return "ground", "j", "i"
    return joint.i.body, "i", "j"


def travel(sketch: Sketch, joint: Prismatic | PinSlot) -> tuple[Array, Array]:
    """The ends of a guide: the range of the slider in this run, with a margin."""
    pose = sketch.pose
    _, rail, slides = guide(joint)
    more = 2.1 * sketch.size("block") if isinstance(joint, Prismatic) else 2.2 * sketch.size("pin")
    angle = pose.run[getattr(joint, rail).body].angle
    angle = angle + float(pose.system.numbers.angle(joint, rail))
    way = pose.track(joint, slides) - pose.track(joint, rail)
    along = way[:, 0] * np.cos(angle) + way[:, 1] * np.sin(angle)
    origin, u = pose.place(joint, rail), direction(pose.direction(joint, rail))
    return origin + (along.min() - more) * u, origin + (along.max() + more) * u
