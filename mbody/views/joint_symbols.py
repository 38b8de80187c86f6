"""Symbols of joints, by class: each takes the joint and the sketch, and draws itself on it.

A joint of another class gets the symbol of the class that it derives from, at last the general one.
A kind of its own is one function, registered for its class::

    @joint_symbol.register(Revolute)
    def _(joint: Revolute, sketch: Sketch) -> None: ...
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import DRAWN_OUTLINE, POINT_SAME, PRINTED_NONE, TINY
from mbody.model import joints
from mbody.model.coupling import Coupling
from mbody.model.joints import CamFollower, Fixed, Joint, PinSlot, Prismatic, Revolute
from mbody.model.touching_shapes import middles_of_arcs
from mbody.solution.histories import reaction_point
from mbody.views.body_shapes import (
    base_circle,
    covered,
    face,
    guide,
    hatched_circle,
    outline,
    pulleys,
    travel,
    wheels,
)
from mbody.views.labels import INK, LINK, PAPER, PLATE, SOFT, WHEEL, FreePlaces, Label, Z, symbolic
from mbody.views.shapes import (
    arc,
    between,
    box,
    direction,
    heading,
    hull,
    on,
    placed,
    rounded,
    unique,
    within,
)

if TYPE_CHECKING:
    from mbody.views.shapes import Pose
    from mbody.views.sketch import Sketch


# -- Links: bars, plates, cranks of one pin, and their mass centres ----------------------------

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


def outward(sketch: Sketch, place: Array, *bodies: str) -> float:
    """The direction [rad] from a place away from the nodes of the bodies that meet there."""
    sum_of = np.zeros(2)
    for body in bodies:
        for node in sketch.pose.nodes[body] if body != "ground" else ():
            offset = node - place
            if np.hypot(*offset) > sketch.unit:
                sum_of -= offset / np.hypot(*offset)
    if np.hypot(*sum_of) < 0.1:
        sum_of = (place - sketch.pose.middle) / sketch.unit
    if np.hypot(*sum_of) < 0.1:
        return math.pi / 2.0
    return math.atan2(sum_of[1], sum_of[0])


def named(sketch: Sketch, element: joints.Joint, place: Array, *bodies: str) -> None:
    """The name of a joint beside its symbol."""
    wanted = outward(sketch, place, *bodies)
    with sketch.carried(on(element.j.body)):
        sketch.label(symbolic(element.name), place, wanted, 1.9 * sketch.size("pin"), italic=True)


@singledispatch
def joint_symbol(joint: joints.Joint, sketch: Sketch) -> None:
    """A joint of no known kind: a lozenge at its place on j, tied to the place on i."""
    i, j = sketch.pose.place(joint, "i"), sketch.pose.place(joint, "j")
    if np.hypot(*(j - i)) > sketch.size("pin"):
        with sketch.carried(between(sketch.pose.site(joint, "i"), sketch.pose.site(joint, "j"))):
            sketch.line([i, j], 1.0, INK, Z["block"], dashes=(0, (3, 2)))
    half = 1.25 * sketch.size("pin")
    lozenge = box(j, half, half, math.pi / 4.0)
    with sketch.carried(on(joint.j.body)):
        sketch.shape(lozenge, PAPER, INK, 1.2, Z["pin"], name=f"joint:{joint.name}")
    named(sketch, joint, j, joint.i.body, joint.j.body)


@joint_symbol.register(joints.Revolute)
def _(joint: joints.Revolute, sketch: Sketch) -> None:
    place = sketch.pose.place(joint, "j")
    with sketch.carried(on(joint.j.body)):
        sketch.pin(place, joint.name)
    for here, there in (("i", "j"), ("j", "i")):
        if getattr(joint, here).body == "ground":
            sketch.support(place, sketch.pose.nodes[getattr(joint, there).body], joint.name)


@joint_symbol.register(joints.Prismatic)
def _(joint: joints.Prismatic, sketch: Sketch) -> None:
    """A block on a rail of the ground, or in the slot of a link."""
    pose = sketch.pose
    body, rail, slides = guide(joint)
    angle, place = pose.direction(joint, rail), pose.place(joint, slides)
    start, end = travel(sketch, joint)
    aside = _beyond_cam(sketch, joint, slides, angle)
    sliding = on(getattr(joint, slides).body)
    if aside.any():
        stem = rounded([place, place + aside], 1.2 * sketch.size("link"))
        with sketch.carried(sliding):
            sketch.shape(stem, LINK, INK, 1.1, Z["block"] - 0.25, name=f"stem:{joint.name}")
        place, start, end = place + aside, start + aside, end + aside
    with sketch.carried(sliding):
        sketch.block(place, angle, joint.name)
    if body == "ground":
        u = direction(angle)
        n = np.array([-u[1], u[0]])
        side = float(n @ (pose.middle - place))
        if abs(side) < 2.0 * sketch.size("block"):  # neither side is the inner one
            side = n[1] if abs(n[1]) > PRINTED_NONE else -n[0]
        away = -math.copysign(0.6 * sketch.size("block"), side) * n
        ends = (start + away, end + away)
        sketch.rail(*(ends if side > 0.0 else ends[::-1]), f"rail:{joint.name}")
    else:
        with sketch.carried(on(body)):
            _slot(sketch, start, end, 0.5 * sketch.size("link"))
    wanted = angle + math.pi / 2.0
    gap = 0.75 * sketch.size("block")
    with sketch.carried(sliding):
        sketch.label(symbolic(joint.name), place, wanted, gap, rotation_cost=0.3, italic=True)


def _beyond_cam(sketch: Sketch, joint: joints.Prismatic, slides: str, angle: float) -> Array:
    """Offset of a slider along its line, so that it does not cover the roller of a follower.

    Its place on the line is arbitrary.
    """
    pose, u = sketch.pose, direction(angle)
    place, body = pose.place(joint, slides), getattr(joint, slides).body
    for cam in pose.joints:
        if isinstance(cam, joints.CamFollower) and cam.j.body == body:
            roller = pose.number(cam, "roller")
            if np.hypot(*(pose.place(cam, "j") - place)) < roller + sketch.size("block"):
                sign = math.copysign(1.0, float(u @ (place - pose.place(cam, "i"))))
                clear = max(roller, 2.0 * sketch.size("pin")) + 1.5 * sketch.size("block")
                return sign * clear * u
    return np.zeros(2)


def _slot(sketch: Sketch, start: Array, end: Array, half: float) -> None:
    sketch.shape(rounded([start, end], half), PAPER, INK, 0.9, Z["link"] + 0.2)


@joint_symbol.register(joints.PinSlot)
def _(joint: joints.PinSlot, sketch: Sketch) -> None:
    start, end = travel(sketch, joint)
    half = 1.2 * sketch.size("pin")
    if joint.i.body == "ground":
        u = (end - start) / max(float(np.hypot(*(end - start))), TINY)
        n = np.array([-u[1], u[0]])
        sketch.ground(start - half * n, end - half * n, name=f"rail:{joint.name}")
        sketch.ground(end + half * n, start + half * n)
    else:
        with sketch.carried(on(joint.i.body)):
            _slot(sketch, start, end, half)
    with sketch.carried(on(joint.j.body)):
        sketch.pin(sketch.pose.place(joint, "j"), joint.name)


@joint_symbol.register(joints.Fixed)
def _(joint: joints.Fixed, sketch: Sketch) -> None:
    """A square where two links are one; the ground is a wall."""
    place = sketch.pose.place(joint, "j")
    if "ground" not in (joint.i.body, joint.j.body):
        half = 0.75 * sketch.size("pin")
        with sketch.carried(on(joint.j.body)):
            sketch.shape(box(place, half, half, 0.0), INK, INK, 0.8, Z["pin"], name=joint.name)
    else:
        body = joint.j.body if joint.i.body == "ground" else joint.i.body
        into = direction(sketch.roomy(place, sketch.pose.nodes[body]))
        along = 1.2 * sketch.size("support") * np.array([-into[1], into[0]])
        edge = place + sketch.size("link") * into
        sketch.ground(edge - along, edge + along, name=f"wall:{joint.name}")
    named(sketch, joint, place, joint.i.body, joint.j.body)


@joint_symbol.register(joints.Distance)
def _(joint: joints.Distance, sketch: Sketch) -> None:
    """A thin rod between two pins."""
    i, j = sketch.pose.place(joint, "i"), sketch.pose.place(joint, "j")
    rod = between(sketch.pose.site(joint, "i"), sketch.pose.site(joint, "j"))
    with sketch.carried(rod):
        sketch.line([i, j], 2.2, INK, Z["block"], name=f"rod:{joint.name}")
    for side, place in (("i", i), ("j", j)):
        with sketch.carried(on(getattr(joint, side).body)):
            sketch.pin(place, "")
        if getattr(joint, side).body == "ground":
            sketch.support(place, [i + j - place], f"{joint.name}.{side}")
    wanted = math.atan2(*(j - i)[::-1]) + math.pi / 2.0
    with sketch.carried(rod):
        sketch.label(symbolic(joint.name), 0.5 * (i + j), wanted, 4.0 * sketch.unit, italic=True)


@joint_symbol.register(joints.CamFollower)
def _(joint: joints.CamFollower, sketch: Sketch) -> None:
    """The cam with its base circle; on it a roller, an edge or a flat face."""
    pose = sketch.pose
    centre, place, contact = (
        pose.place(joint, "i"),
        pose.place(joint, "j"),
        pose.reaction_point(joint),
    )
    cam = outline(joint, pose)
    with sketch.carried(on(joint.i.body)):
        sketch.shape(cam, PLATE, INK, 1.3, Z["wheel"], name=f"cam:{joint.name}", weight=0.6)
        look: dict[str, Any] = {"dashes": (0, (4, 3)), "name": f"base:{joint.name}", "weight": 0.2}
        sketch.disc(centre, base_circle(joint, pose), "none", SOFT, 0.7, Z["wheel"] + 0.1, **look)
    with sketch.carried(on(joint.j.body)):
        _follower(joint, sketch, place, centre)
        across = math.atan2(*(contact - centre)[::-1]) - math.pi / 2.0
        gap = max(pose.number(joint, "roller"), sketch.size("pin")) + 3.0 * sketch.unit
        sketch.label(symbolic(joint.name), contact, across, gap, rotation_cost=0.3, italic=True)


def _follower(joint: joints.CamFollower, sketch: Sketch, place: Array, centre: Array) -> None:
    pose, z = sketch.pose, Z["block"] - 0.2
    roller = pose.number(joint, "roller")
    if joint.flat:
        ends = face(joint, pose, 1.5 * sketch.size("pin"))
        sketch.line(ends, 3.0, INK, z, name=f"face:{joint.name}")
    elif roller:
        sketch.disc(place, roller, PAPER, INK, 1.3, z, name=f"roller:{joint.name}", weight=0.6)
        sketch.disc(place, min(0.6 * sketch.size("pin"), 0.5 * roller), z=z + 0.1, weight=0.2)
    else:
        away = math.atan2(*(place - centre)[::-1])
        wings = [place + 2.2 * sketch.size("pin") * direction(away + s) for s in (0.5, -0.5)]
        sketch.shape([place, *wings], LINK, INK, 1.1, z, name=f"edge:{joint.name}")


@joint_symbol.register(joints.Gear)
@joint_symbol.register(joints.Rolling)
@joint_symbol.register(joints.RackPinion)
def _(joint: joints.Gear | joints.Rolling | joints.RackPinion, sketch: Sketch) -> None:
    """Circles that touch, or a circle on a line."""
    pose, toothed = sketch.pose, not isinstance(joint, joints.Rolling)
    circles = wheels(joint, pose)
    greatest = max(radius for _, radius in circles)
    for side, radius in circles:
        ring = bool(getattr(joint, "internal", False)) and radius == greatest
        with sketch.carried(on(getattr(joint, side).body)):
            _wheel(sketch, joint, side, radius, ring, toothed)
    if len(circles) == 1:
        point, along = pose.reaction_point(joint), pose.direction(joint, "i")
        u, half = direction(along), 1.7 * greatest
        start, end = point - half * u, point + half * u
        if sketch.lasting:
            start, end = _rolled(sketch, joint, start, end)
        if joint.i.body == "ground" and not toothed:
            sketch.rail(start, end, f"road:{joint.name}", math.inf)
        else:
            with sketch.carried(on(joint.i.body)):
                if toothed:
                    _rack(sketch, start, end, joint.name, joint.i.body == "ground")
                else:
                    sketch.line([start, end], 2.4, INK, Z["link"], name=f"road:{joint.name}")
    contact = pose.reaction_point(joint)
    wanted = outward(sketch, contact, joint.i.body, joint.j.body)
    # of the contact, which moves on both bodies, the centre of the wheel is what stays near
    with sketch.carried(placed(pose.site(joint, "j"), joint.i.body)):
        sketch.label(
            symbolic(joint.name), contact, wanted, 4.0 * sketch.unit, rotation_cost=0.3, italic=True
        )


def _rolled(sketch: Sketch, joint: joints.Joint, start: Array, end: Array) -> tuple[Array, Array]:
    """The ends of a road that is long enough for the whole motion."""
    pose, u = sketch.pose, (end - start) / max(float(np.hypot(*(end - start))), TINY)
    body = pose.run[joint.i.body]
    offset = np.column_stack(reaction_point(pose.run, joint)) - np.column_stack([body.x, body.y])
    rotation = pose.run[joint.i.body].angle - pose.angle(joint.i.body)
    c, s = np.cos(rotation), np.sin(rotation)
    along = (c * offset[:, 0] + s * offset[:, 1]) * u[0] + (
        c * offset[:, 1] - s * offset[:, 0]
    ) * u[1]
    along = along - along[pose.k]
    return start + along.min() * u, end + along.max() * u


def _wheel(
    sketch: Sketch, joint: joints.Joint, side: str, radius: float, ring: bool, toothed: bool
) -> None:
    """A wheel with its hub and a mark that turns with it; a ring, or one that is the ground, is
    hatched outside."""
    centre, body = sketch.pose.place(joint, side), getattr(joint, side).body
    fill = "none" if ring else WHEEL
    # the smaller of two wheels lies above
    z = Z["ring"] if ring else Z["wheel"] - 0.3 * radius / (radius + sketch.pose.system.length)
    dashes = (0, (9, 2, 2, 2)) if toothed else "-"
    if toothed:
        from_centre = radius + (2.2 if ring else -2.2) * sketch.unit * sketch.small
        sketch.disc(centre, from_centre, fill, SOFT, 0.6, z, weight=0.2)
        fill = "none"
    look: dict[str, Any] = {"dashes": dashes, "name": f"wheel:{joint.name}.{side}"}
    sketch.disc(centre, radius, fill, INK, 0.9 if toothed else 1.5, z, weight=0.6, **look)
    if body == "ground":
        edge = radius + (2.2 * sketch.unit * sketch.small if ring and toothed else 0.0)
        hatched_circle(sketch, centre, edge, ring, z)
        return
    if not ring:
        mark = sketch.pose.direction(joint, side)
        rim = centre + 0.86 * radius * direction(mark)
        sketch.line([centre, rim], 0.9, SOFT, z + 0.01, weight=0.2)
        if not any(np.hypot(*(centre - place)) < sketch.size("pin") for place, _ in sketch.pins):
            sketch.disc(centre, 0.7 * sketch.size("pin"), z=Z["block"], weight=0.2)


def _rack(sketch: Sketch, start: Array, end: Array, name: str, fixed: bool) -> None:
    """The pitch line of a rack, and its teeth below."""
    length = float(np.hypot(*(end - start)))
    u = (end - start) / length
    n = np.array([u[1], -u[0]])
    deep = 2.6 * sketch.unit * sketch.small
    count = max(4, round(length / (3.2 * deep)))
    profile = [(0.0, -1), (0.2, -1), (0.35, 1), (0.65, 1), (0.8, -1)]
    teeth = [
        start + length * (k + part) / count * u - side * deep * n
        for k in range(count)
        for part, side in profile
    ]
    back = 3.5 * deep * n
    corners = [start + back, *(start + deep * n, *teeth, end + deep * n), end + back]
    sketch.shape(corners, WHEEL, INK, 1.0, Z["wheel"] - 0.1, name=f"rack:{name}", weight=0.5)
    sketch.line([start, end], 0.6, SOFT, Z["wheel"], dashes=(0, (9, 2, 2, 2)), weight=0.2)
    if fixed:
        sketch.ground(start + back, end + back)


# -- Symbols of couplings: ropes between places, belts between wheels, lines between what turns

#: More parts of a rope than these are not drawn side by side.
SYMBOL_PARTS = 6


@singledispatch
def coupling_symbol(coupling: Coupling, sketch: Sketch) -> None:
    """Ropes for distances, as many side by side as the factor says; wheels of the radii for angles
    among lengths, with a belt where they are two; thin lines between what else turns together.
    """
    look: dict[str, Any]
    ends = _ropes(sketch, coupling)
    wheels = pulleys(coupling, sketch.pose)
    wheel_bodies = {n: coupling.parts[n].bodies[1] for n in wheels}
    hubs = [sketch.pose.fixed(wheel_bodies[n], centre) for n, (centre, _) in wheels.items()]
    for n, (centre, radius) in wheels.items():
        if radius > sketch.size("pin"):
            name = f"pulley:{coupling.name}.{n}"
            with sketch.carried(on(wheel_bodies[n])):
                sketch.disc(centre, radius, WHEEL, INK, 1.1, Z["wheel"], name=name, weight=0.5)
    named = f"belt:{coupling.name}"
    centres = [centre for centre, _ in wheels.values()]
    belt = _belt(sketch, coupling, list(wheels.values()))
    if belt:
        for n, side in enumerate(belt):
            with sketch.carried(between(*hubs)):
                sketch.line(side, 1.3, INK, Z["wheel"] + 0.2, name=f"{named}:{n}" if n else named)
    else:
        n = 0
        for pair, ends_of in zip(itertools.pairwise(centres), itertools.pairwise(hubs)):
            if np.hypot(*(pair[1] - pair[0])):
                look = {"dashes": (0, (5, 2)), "name": "" if n else named}
                n += 1
                with sketch.carried(between(*ends_of)):
                    sketch.line(pair, 0.9, SOFT, Z["path"], **look)
    places = [*ends, *centres]
    if places:
        middle = np.mean(places[:2], axis=0)
        offset = places[min(1, len(places) - 1)] - places[0]
        wanted, gap = heading(offset) + math.pi / 2.0, 5.0 * sketch.unit
        look = {"italic": True, "name": f"coupling:{coupling.name}"}
        body = next(name for term in coupling.parts for name in term.bodies if name != "ground")
        with sketch.carried(on(body)):
            sketch.label(symbolic(coupling.name), middle, wanted, gap, rotation_cost=0.3, **look)


def _ropes(sketch: Sketch, coupling: Coupling) -> list[Array]:
    """Draw the lengths; returns their places."""
    found: list[Array] = []
    for n, term in enumerate(coupling.parts):
        if not term.ends:
            continue
        i, j = (sketch.pose.place(coupling, f"{n}.{side}") for side in "ij")
        found += [i, j]
        if not np.hypot(*(j - i)):
            continue
        name = f"rope:{coupling.name}.{n}"
        sites = [sketch.pose.site(coupling, f"{n}.{side}") for side in "ij"]
        if not term.distance:
            look: dict[str, Any] = {"dashes": (0, (7, 2, 1.5, 2)), "name": name}
            with sketch.carried(between(*sites)):
                sketch.line([i, j], 0.9, SOFT, Z["path"], **look)
            continue
        across = direction(heading(j - i) + math.pi / 2.0)
        parts = min(max(round(abs(sketch.pose.number(coupling, f"{n}.factor"))), 1), SYMBOL_PARTS)
        for k in range(parts):
            aside = (k - 0.5 * (parts - 1)) * 2.8 * sketch.unit * across
            own = f"{name}:{k}" if k else name
            with sketch.carried(between(*sites)):
                sketch.line([i + aside, j + aside], 1.2, INK, Z["link"] - 0.1, name=own)
        for place, marker in zip((i, j), term.ends, strict=True):
            with sketch.carried(on(marker.body)):
                sketch.disc(place, 0.6 * sketch.size("pin"), z=Z["pin"] - 0.1, weight=0.3)
            if marker.body == "ground":
                sketch.support(place, [i + j - place], f"{coupling.name}.{n}")
    return found


def _belt(sketch: Sketch, coupling: Coupling, wheels: list[tuple[Array, float]]) -> list[Array]:
    """The two straight parts of a belt on two wheels: open where they turn one way, else crossed;
    none where it is no belt.
    """
    if len(wheels) != 2 or len(coupling.parts) != 2 or not coupling.lengths:
        return []
    (a, r), (b, s) = wheels
    separation = b - a
    length = float(np.hypot(*separation))
    first, second = (sketch.pose.number(coupling, f"{n}.factor") for n in range(2))
    crossed = first * second > 0.0
    part = (r + s if crossed else r - s) / max(length, TINY)
    if abs(part) >= 1.0:
        return []
    found = []
    for side in (1.0, -1.0):
        u = direction(heading(separation) + side * math.acos(part))
        found.append(np.array([a + r * u, b + (-s if crossed else s) * u]))
    return found
