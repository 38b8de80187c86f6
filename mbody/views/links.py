"""Links: bars, plates, cranks of one pin, and their mass centres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import DRAWN_OUTLINE, POINT_SAME, TINY
from mbody.model.joints import CamFollower, Fixed, Joint, PinSlot, Prismatic, Revolute
from mbody.model.touching_shapes import middles_of_arcs
from mbody.views.body_shapes import covered, face, guide, outline, travel, wheels
from mbody.views.labels import FreePlaces, Label, symbolic
from mbody.views.pose import heading, on
from mbody.views.shapes import arc, box, direction, hull, rounded, unique, within
from mbody.views.style import INK, LINK, PAPER, PLATE, SOFT, WHEEL, Z

if TYPE_CHECKING:
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch


Array = np.ndarray

#: Places of a link's name along an edge, and their costs.
PARTS = ((0.5, 0.0), (0.4, 0.1), (0.6, 0.1), (0.28, 0.4), (0.72, 0.4), (0.18, 0.6), (0.82, 0.6))


def link(sketch: Sketch, body: str, order: int) -> None:
    """A body as a bar or plate through its nodes; later ones lie above."""
    with sketch.carried(on(body)):
        _link(sketch, body, order)


def _link(sketch: Sketch, body: str, order: int) -> None:
    nodes = places(sketch, body)
    half = sketch.size("link")
    if covered(sketch.pose, body, nodes):
        mass_centre(sketch, body)
        return
    if len(nodes) < 2:
        if _has_symbol(sketch, body):
            mass_centre(sketch, body)
            return
        centre = sketch.pose.centre(body)
        if not nodes or np.hypot(*(nodes[0] - centre)) > half:
            nodes = [*nodes, centre]
        half *= 1.0 if len(nodes) > 1 else 1.8
    # plates lie below bars, which they would hide
    plate = len(hull(nodes, half)) > 2
    # however many there are, all are below the next layer
    step = min(1e-3, 0.9 / len(sketch.pose.system.bodies))
    z = Z["plate" if plate else "link"] + step * order
    fill = PLATE if plate else LINK
    sketch.shape(rounded(nodes, half), fill, INK, 1.1, z, name=f"link:{body}")
    sketch.edges[body] = hull(nodes, DRAWN_OUTLINE * half)
    mass_centre(sketch, body)


def places(sketch: Sketch, body: str) -> list[Array]:
    """The places that a link connects: its nodes, and the ends of the guides on it."""
    found = list(sketch.pose.nodes[body])
    for joint in sketch.pose.joints_of.get(body, ()):
        if isinstance(joint, (Prismatic, PinSlot)) and guide(joint)[0] == body:
            found += travel(sketch, joint)
    return unique(found, 0.3 * sketch.size("pin"))


def _has_symbol(sketch: Sketch, body: str) -> bool:
    """Whether a body of one place is drawn by its joint: a slider, a pin in a slot, a wheel, a
    cam, what is welded to a link."""

    def drawn(joint: Joint) -> bool:
        if isinstance(joint, (Prismatic, PinSlot)):
            return guide(joint)[0] != body and body in (joint.i.body, joint.j.body)
        if isinstance(joint, Fixed):
            return body in (joint.i.body, joint.j.body)
        circles = wheels(joint, sketch.pose)
        return any(getattr(joint, side).body == body for side, _ in circles)

    return any(drawn(joint) for joint in sketch.pose.joints_of.get(body, ()))


def mass_centre(sketch: Sketch, body: str) -> None:
    """The sign of a mass centre, where it is not at a joint."""
    centre = sketch.pose.centre(body)
    clearance = 1.2 * sketch.size("pin")
    if sketch.kinematic or not sketch.pose.mass(body) or sketch.pose.at_joint(centre, clearance):
        return
    sketch.centres.append(centre)
    _line_to_centre(sketch, body, centre)
    radius = 0.8 * sketch.size("pin")
    sketch.disc(centre, radius, PAPER, INK, 0.8, Z["pin"] - 0.5, name=f"cg:{body}", weight=0.5)
    for start in (0.0, math.pi):
        quarter = np.vstack([centre, arc(centre, radius, start, start + math.pi / 2.0)])
        sketch.shape(quarter, INK, INK, 0.3, Z["pin"] - 0.4, name=f"centre:{body}", weight=0.0)


def _line_to_centre(sketch: Sketch, body: str, centre: Array) -> None:
    """A thin line from a link to its mass centre, where that lies off it."""
    nodes = unique(sketch.pose.nodes[body], sketch.size("pin"))
    if len(nodes) != 2:
        return
    a, edge = nodes[0], nodes[1] - nodes[0]
    foot = a + np.clip((centre - a) @ edge / (edge @ edge), 0.0, 1.0) * edge
    if np.hypot(*(centre - foot)) > 2.0 * sketch.size("link"):
        look: dict[str, Any] = {"dashes": (0, (2, 2)), "weight": 0.2}
        sketch.line([foot, centre], 0.8, SOFT, Z["path"], name=f"tie:{body}", **look)


def link_label(sketch: Sketch, body: str) -> None:
    """The name of a link beside one of its edges, or within it where it fits."""
    nodes = places(sketch, body)
    named = f"link:{body}:name"
    if len(nodes) < 2:
        place = nodes[0] if nodes else sketch.pose.centre(body)
        gap = 0.9 * sketch.size("block")
        wanted, rotation_cost = -math.pi / 2.0, 0.3
        for joint in sketch.pose.joints:
            if isinstance(joint, CamFollower) and joint.j.body == body:
                # on the cam it would be that of the cam
                wanted, rotation_cost = heading(place - sketch.pose.place(joint, "i")), 1.5
        sketch.label(body, place, wanted, gap, rotation_cost=rotation_cost, name=named)
        return
    label = Label(body, [], name=named)
    width, height = (sketch.unit * part for part in FreePlaces.measured(label))
    corners = hull(nodes, DRAWN_OUTLINE * sketch.size("link"))
    gap = sketch.size("link") + 1.5 * sketch.unit
    edges = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
    for a, b in edges:
        u = (b - a) / np.hypot(*(b - a))
        n = np.array([u[1], -u[0]])
        offset = gap + 0.5 * (width * abs(n[0]) + height * abs(n[1]))
        for part, cost in PARTS:
            place = a + part * (b - a)
            x, y = place + offset * n
            cost += _mistaken(sketch, place + gap * n, gap, body)
            label.spots.append((float(x), float(y), cost))
    if len(corners) > 2:
        x, y = corners.mean(axis=0)
        label.spots.append((float(x), float(y), -0.2))
    sketch.labels.append(label)


def _mistaken(sketch: Sketch, place: Array, own: float, body: str) -> float:
    """The cost of a label that could be read as that of another link or pin."""
    cost = 0.0
    for pin, _ in sketch.pins:
        cost += 0.8 * (np.hypot(*(pin - place)) < 2.2 * own)
    for other, corners in sketch.edges.items():
        if other != body:
            cost += 0.7 * within(place, corners)
            for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                edge = b - a
                part = np.clip((place - a) @ edge / max(float(edge @ edge), TINY), 0.0, 1.0)
                cost += 0.5 * float(np.hypot(*(a + part * edge - place)) < 1.5 * own)
    return cost


def points(sketch: Sketch, body: str) -> None:
    """Named points that no pin covers: a dot and the name."""
    pose = sketch.pose
    own: Any = pose.mechanism[body]
    off = middles_of_arcs(own.shapes)
    for name in (one for one in own.points if one not in off):
        place = pose.point(f"{body}.{name}")
        if pose.at_joint(place, sketch.size("pin")):
            continue
        radius = 0.42 * sketch.size("pin")
        away = place - pose.centre(body)
        wanted = math.atan2(away[1], away[0]) if np.hypot(*away) > sketch.unit else math.pi / 2.0
        gap = 1.6 * sketch.size("pin")
        with sketch.carried(on(body)):
            if not any(np.hypot(*(place - centre)) < radius for centre in sketch.centres):
                sketch.disc(place, radius, INK, INK, 0.5, Z["pin"], name=f"point:{body}.{name}")
            sketch.label(symbolic(name), place, wanted, gap, italic=True)


# -- One link alone, cut free from all others: its outline, pins, wheels, and its mass centre --

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
    """Draws the part of a joint that belongs to the body; whether it shows the body where that is
    one point.
    """
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


# -- Mechanisms of very many short links, as lines: symbols of their own would hide them -------
# Links whose typical length on the page is a few points are bare lines, all of them one artist;
# joints between them have no symbol, unless they are no plain pins, or on the ground.

#: Bodies from which on, and points of a link's typical length up to which, links are lines.
MANY, SHORT = 200, 8.0
#: Width of the lines [points].
WIDTH = 0.8


def are_lines(pose: Pose, bodies: Sequence[str], unit: float) -> bool:
    """Whether the links of these bodies are drawn as lines, where a point is `unit` long."""
    if len(bodies) < MANY:
        return False
    sizes = [
        np.ptp(np.array(pose.nodes[body]), axis=0).max() for body in bodies if pose.nodes[body]
    ]
    sizes = [size for size in sizes if size > 0.0]
    return bool(sizes) and float(np.median(sizes)) < SHORT * unit


def link_lines(sketch: Sketch, bodies: Sequence[str]) -> None:
    """All links: a line between two places, the outline of more; a body of one place to its mass
    centre.
    """
    pose, gap = sketch.pose, np.full((1, 2), np.nan)
    tolerance = POINT_SAME * pose.system.length
    parts: list[Array] = []
    for body in bodies:
        nodes = unique(pose.nodes[body], tolerance)
        if len(nodes) < 2:
            nodes = [*nodes, pose.centre(body)]
        corners = np.array(nodes) if len(nodes) < 3 else hull(nodes, tolerance)
        parts += [corners, corners[:1], gap] if len(corners) > 2 else [corners, gap]
    look: dict[str, Any] = {"name": "links", "weight": 0.0}
    sketch.line(np.vstack(parts), WIDTH, INK, Z["link"], **look)


def with_symbols(joints: Sequence[Joint]) -> list[Joint]:
    """The joints that have symbols where links are lines: those on the ground, and others than
    pins.
    """
    return [
        joint
        for joint in joints
        if not isinstance(joint, Revolute) or "ground" in (joint.i.body, joint.j.body)
    ]
