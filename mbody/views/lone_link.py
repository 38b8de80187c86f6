"""One link alone, cut free from all others: its outline, pins, wheels, and its mass centre."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.joints import CamFollower, Fixed, Joint, PinSlot, Prismatic
from mbody.views.bounds import wheels
from mbody.views.cam_outlines import face, outline
from mbody.views.guides import guide, travel
from mbody.views.links import link
from mbody.views.shapes import box, direction, rounded
from mbody.views.style import INK, LINK, PAPER, PLATE, SOFT, WHEEL, Z

if TYPE_CHECKING:
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["lone_link", "scale_of"]

Array = np.ndarray

#: Points that the outline of a link takes at most, and how large the symbol of one place is.
WIDE, HIGH, SYMBOL = 165.0, 115.0, 1.7


def _joints(pose: Pose, body: str) -> list[Joint]:
    return [joint for joint in pose.joints if body in (joint.i.body, joint.j.body)]


def _circles(pose: Pose, body: str) -> list[tuple[Joint, str, Array, float]]:
    """Circles of wheels, rollers and cams of a body: joint, side, centre and radius."""
    found = []
    for joint in _joints(pose, body):
        for side, radius in wheels(joint, pose):
            if getattr(joint, side).body == body and radius > 0.0:
                found.append((joint, side, pose.place(joint, side), radius))
    return found


def scale_of(pose: Pose, body: str) -> tuple[float, float]:
    """Length of a point (1/72 in) in the units of the mechanism, and the factor of symbols, so that
    the body fills its place.
    """
    places = [*pose.nodes[body], pose.centre(body)]
    for _, _, centre, radius in _circles(pose, body):
        places += [centre - radius, centre + radius]
    wide, high = np.ptp(np.array(places), axis=0)
    unit = float(max(wide / WIDE, high / HIGH))
    if unit > 1e-3 * pose.system.length / WIDE:
        return unit, 1.0
    # of one place: a slider, which its symbol shows larger than in the whole mechanism
    return pose.system.length / WIDE, SYMBOL


def lone_link(sketch: Sketch, body: str) -> None:
    """Draw a body without what it is joined to."""
    pose = sketch.pose
    link(sketch, body, 0)
    drawn = bool(body in sketch.edges)
    for joint, side, centre, radius in _circles(pose, body):
        drawn = True
        if isinstance(joint, CamFollower):
            _cam(sketch, joint, side, radius)
        else:
            look: dict[str, Any] = {"name": f"wheel:{joint.name}.{side}", "weight": 0.6}
            dashes = "-" if type(joint).__name__ == "Rolling" else (0, (9, 2, 2, 2))
            sketch.disc(centre, radius, WHEEL, INK, 1.1, Z["wheel"], dashes=dashes, **look)
            mark = centre + 0.9 * radius * direction(pose.direction(joint, side))
            sketch.line([centre, mark], 0.9, SOFT, Z["wheel"] + 0.01, weight=0.2)
    for joint in _joints(pose, body):
        drawn = _end(sketch, joint, body) or drawn
    if not drawn:
        half = 0.8 * sketch.size("block")
        sketch.shape(box(pose.centre(body), half, half, pose.angle(body)), LINK, name=body)


def _cam(sketch: Sketch, joint: CamFollower, side: str, radius: float) -> None:
    """A cam by its outline, or the roller that follows it."""
    if side == "i":
        cam = outline(joint, sketch.pose)
        sketch.shape(cam, PLATE, INK, 1.2, Z["wheel"], name=f"cam:{joint.name}", weight=0.6)
    else:
        centre = sketch.pose.place(joint, "j")
        sketch.disc(centre, radius, PAPER, INK, 1.2, Z["block"], name=f"roller:{joint.name}")


def _end(sketch: Sketch, joint: Joint, body: str) -> bool:
    """What of a joint belongs to the body; whether that shows the body where it is one place."""
    pose = sketch.pose
    side = "i" if joint.i.body == body else "j"
    place = pose.place(joint, side)
    if isinstance(joint, (Prismatic, PinSlot)):
        carrier, _, slides = guide(joint)
        if carrier == body:
            half = (0.5 if isinstance(joint, Prismatic) else 1.0) * sketch.size("link")
            slot = rounded(travel(sketch, joint), half)
            sketch.shape(slot, PAPER, INK, 0.9, Z["link"] + 0.2, name=f"slot:{joint.name}")
        elif isinstance(joint, Prismatic):
            sketch.block(place, pose.direction(joint, slides), joint.name)
        else:
            sketch.pin(place, joint.name)
        return True
    if isinstance(joint, CamFollower) and joint.flat and side == "j":
        ends = face(joint, pose, 1.5 * sketch.size("pin"))
        sketch.line(ends, 3.0, INK, Z["block"], name=f"face:{joint.name}")
        return True
    if isinstance(joint, Fixed):
        half = 0.75 * sketch.size("pin")
        sketch.shape(box(place, half, half, 0.0), INK, INK, 0.8, Z["pin"], name=joint.name)
        return False
    if not wheels(joint, pose):
        sketch.pin(place, joint.name)
    return False
