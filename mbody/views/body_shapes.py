"""Shapes of bodies that contacts are between: discs, rings, lines, segments, polygons, curves."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from mbody.core.tolerances import POINT_SAME
from mbody.engineering.cam_limits import cam_contour
from mbody.model.joints import CamFollower, Gear, Joint, PinSlot, Prismatic, RackPinion, Rolling
from mbody.model.loads import PistonPressure, ReciprocatingCylinder, Tyre
from mbody.model.touching_shapes import CurveShape, Disc, Line, Polygon, Ring, Segment, Shape
from mbody.views.acting import barrel, tyre_circle
from mbody.views.labels import INK, PLATE, SOFT, WHEEL, Z
from mbody.views.shapes import arc, direction, on, within

if TYPE_CHECKING:
    from mbody.model.coupling import Coupling
    from mbody.views.shapes import Pose
    from mbody.views.sketch import Sketch


# -- Guides of sliding joints: the body with the guide, and its ends ---------------------------

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
    separation = pose.track(joint, slides) - pose.track(joint, rail)
    along = separation[:, 0] * np.cos(angle) + separation[:, 1] * np.sin(angle)
    origin, u = pose.place(joint, rail), direction(pose.direction(joint, rail))
    return origin + (along.min() - more) * u, origin + (along.max() + more) * u


# -- Outlines of cams: the curve that touches a roller, an edge or a flat face -----------------

#: Places of a revolution at which an outline has a corner: every two degrees.
CORNERS = 181


def _radius(joint: CamFollower, pose: Pose) -> tuple[Array, Array, Array]:
    """ψ over a revolution, with the radius of the pitch curve, or the support function, and its
    derivative.
    """
    psi = np.linspace(0.0, math.tau, CORNERS)
    R, derivative, _ = np.broadcast_arrays(*joint.radius(pose.system.numbers, psi))
    return psi, R, derivative


def outline(joint: CamFollower, pose: Pose) -> Array:
    """Points (corners, 2) of the cam at this instant."""
    psi = np.linspace(0.0, math.tau, CORNERS)
    numbers, rotation = pose.system.numbers, pose.angle(joint.i.body)
    x, y = (cam_contour(joint, numbers, psi) - numbers.place(joint, "i")).T
    c, s = math.cos(rotation), math.sin(rotation)
    return pose.place(joint, "i") + np.column_stack([c * x - s * y, s * x + c * y])


def base_circle(joint: CamFollower, pose: Pose) -> float:
    """The radius of the base circle: as given, else the least radius of the profile."""
    if joint.base_radius is not None:
        return pose.number(joint, "base_radius")
    return float(_radius(joint, pose)[1].min()) - pose.number(joint, "roller")


def face(joint: CamFollower, pose: Pose, more: float) -> Array:
    """The ends (2, 2) of a flat face: the range of the contact, with the marker's place."""
    centre, angle = pose.place(joint, "i"), pose.direction(joint, "j")
    u = np.array([math.cos(angle), math.sin(angle)])
    n = np.array([-u[1], u[0]])
    to_place = pose.place(joint, "j") - centre
    offset = float(np.abs(_radius(joint, pose)[2]).max())
    along = np.array([to_place @ u, (pose.reaction_point(joint) - centre) @ u, offset, -offset])
    foot = centre + (to_place @ n) * n
    return np.array([foot + (along.min() - more) * u, foot + (along.max() + more) * u])


#: Places of every piece of a curve that are drawn.
PARTS = 4

#: An endless line goes beyond what moves by this part of its extent along it.
BEYOND = 0.06


def body_shapes(sketch: Sketch, body: str) -> None:
    """The shapes of a body, or of the ground."""
    with sketch.carried(on(body)):
        for name, shape in _shapes(sketch.pose, body).items():
            _drawn(shape, sketch, body, f"shape:{body}.{name}")
    if body == "ground":
        for load in sketch.pose.mechanism.loads:
            if isinstance(load, Tyre):
                _road(load, sketch)


def _road(tyre: Tyre, sketch: Sketch) -> None:
    """The road of a tyre, as far as bodies are along it."""
    place, u = sketch.pose.place(tyre, "i"), direction(sketch.pose.direction(tyre, "i"))
    low, high = _along(sketch, "ground", place, u)
    margin = sketch.pose.number(tyre, "radius") + 2.0 * sketch.size("block")
    ends = place + (low - margin) * u, place + (high + margin) * u
    sketch.rail(*ends, f"road:{tyre.name}", math.inf)


def outlines(pose: Pose) -> tuple[list[Array], list[tuple[Array, float]]]:
    """The corners of all shapes, and the centres and radii of circles."""
    corners: list[Array] = []
    circles: list[tuple[Array, float]] = []
    for body in (*pose.mechanism.bodies, pose.mechanism.ground):
        for name, shape in body.shapes.items():
            if isinstance(shape, Disc | Ring):
                circles.append(_circle(pose, body.name, name, shape))
            elif isinstance(shape, Segment | Polygon):
                corners += _corners(pose, body.name, shape)
            elif isinstance(shape, CurveShape):
                corners += list(_curve(pose, body.name, name, shape))
            else:
                assert isinstance(shape, Line)
                corners.append(pose.point(f"{body.name}.{shape.point}"))
    return corners, circles


def covered(pose: Pose, body: str, nodes: list[Array]) -> bool:
    """Whether discs and polygons of a body cover its nodes, so that no link need be drawn."""
    solid = [
        (name, shape)
        for name, shape in _shapes(pose, body).items()
        if isinstance(shape, Polygon) or (isinstance(shape, Disc) and shape.begin is None)
    ]
    return bool(solid) and all(
        any(_within(pose, body, name, shape, node) for name, shape in solid) for node in nodes
    )


def hatched_circle(
    sketch: Sketch,
    centre: Array,
    edge: float,
    outside: bool,
    z: float,
    span: tuple[float, float] = (0.0, math.tau),
) -> None:
    """Ticks around a circle, or an arc of it, that belongs to the ground, on its solid side."""
    depth = sketch.size("hatch")
    end, lean = edge + (depth if outside else -depth), depth / edge
    count = max(12, round((span[1] - span[0]) * edge / (2.0 * depth)))
    around = np.linspace(*span, count, endpoint=False)
    ticks = [centre + np.array([edge * direction(a), end * direction(a + lean)]) for a in around]
    sketch.strokes(ticks, z, 0.2)


def _shapes(pose: Pose, body: str) -> dict[str, Shape]:
    machine = pose.mechanism
    owner = machine.ground if body == "ground" else machine[body]
    found: dict[str, Shape] = owner.shapes  # type: ignore[attr-defined]  # a body
    return found


def _circle(pose: Pose, body: str, name: str, shape: Disc | Ring) -> tuple[Array, float]:
    point = shape.disc if isinstance(shape, Disc) else shape.ring
    return pose.point(f"{body}.{point}"), float(pose.system.values[f"{body}.{name}.radius"])


def _corners(pose: Pose, body: str, shape: Segment | Polygon) -> list[Array]:
    names: tuple[str, ...] = tuple(shape.segment if isinstance(shape, Segment) else shape.polygon)
    return [pose.point(f"{body}.{name}") for name in names]


def _curve(pose: Pose, body: str, name: str, shape: CurveShape) -> Array:
    """Places along a curve, (n, 2)."""
    contour = shape.contour(pose.mechanism.curves, f"{body}.{name}")
    places = contour.places(PARTS)[0] @ (1.0, 1.0j)
    turned = places * np.exp(1j * (0.0 if body == "ground" else pose.angle(body)))
    return np.column_stack([turned.real, turned.imag]) + pose.point(f"{body}.{shape.point}")


def _within(pose: Pose, body: str, name: str, shape: Shape, node: Array) -> bool:
    if isinstance(shape, Disc):
        centre, radius = _circle(pose, body, name, shape)
        return bool(np.hypot(*(node - centre)) <= radius * (1.0 + 1e-9))
    assert isinstance(shape, Polygon)
    corners = np.array(_corners(pose, body, shape))
    tolerance = POINT_SAME * float(np.ptp(corners, axis=0).max())
    return within(node, corners) or bool((np.hypot(*(corners - node).T) <= tolerance).any())


@functools.singledispatch
def _drawn(shape: Shape, sketch: Sketch, body: str, name: str) -> None:
    """Draw one shape."""
    raise NotImplementedError(f"there is no picture of a {type(shape).__name__}")


def _arc_drawn(shape: Disc | Ring, sketch: Sketch, body: str, name: str) -> bool:
    """Draw an arc of a circle; False of a whole one."""
    if shape.begin is None:
        return False
    key, numbers = name.rpartition(".")[2], sketch.pose.system.values
    centre, radius = _circle(sketch.pose, body, key, shape)
    rotation = 0.0 if body == "ground" else sketch.pose.angle(body)
    first, last = (rotation + float(numbers[f"{body}.{key}.{end}"]) for end in ("begin", "end"))
    points = list(arc(centre, radius, first, last))
    sketch.line(points, 2.4, INK, Z["link"] + 0.5, name=name)
    if body == "ground":
        outside = isinstance(shape, Ring)
        hatched_circle(sketch, centre, radius, outside, Z["ring"], (first, last))
    return True


@_drawn.register(Disc)
def _(shape: Disc, sketch: Sketch, body: str, name: str) -> None:
    if _arc_drawn(shape, sketch, body, name):
        return
    centre, radius = _circle(sketch.pose, body, name.rpartition(".")[2], shape)
    z = Z["wheel"] - 0.3 * radius / (radius + sketch.pose.system.length)
    sketch.disc(centre, radius, WHEEL, INK, 1.5, z, name=name, weight=0.6)
    if body == "ground":
        hatched_circle(sketch, centre, radius, False, z)
        return
    # it turns with the body, from its centre to the rim
    rim = centre + 0.86 * radius * direction(sketch.pose.angle(body))
    sketch.line([centre, rim], 0.9, SOFT, z + 0.01, weight=0.2)


@_drawn.register(Ring)
def _(shape: Ring, sketch: Sketch, body: str, name: str) -> None:
    if _arc_drawn(shape, sketch, body, name):
        return
    centre, radius = _circle(sketch.pose, body, name.rpartition(".")[2], shape)
    sketch.disc(centre, radius, "none", INK, 1.5, Z["ring"], name=name, weight=0.6)
    if body == "ground":
        hatched_circle(sketch, centre, radius, True, Z["ring"])


@_drawn.register(Segment)
def _(shape: Segment, sketch: Sketch, body: str, name: str) -> None:
    start, end = _corners(sketch.pose, body, shape)
    if body == "ground":
        sketch.rail(start, end, name)
    else:
        sketch.line([start, end], 2.4, INK, Z["link"] + 0.5, name=name)


@_drawn.register(Polygon)
def _(shape: Polygon, sketch: Sketch, body: str, name: str) -> None:
    corners = np.array(_corners(sketch.pose, body, shape))
    if body != "ground":
        sketch.shape(corners, PLATE, INK, 1.1, Z["plate"], name=name)
        return
    # its inside is hatched, which is on the right of edges that go round clockwise
    following = np.roll(corners, -1, axis=0)
    area = float((corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum())
    for a, b in zip(corners, following, strict=True):
        first, last = (b, a) if area > 0.0 else (a, b)
        sketch.ground(first, last, name=name)


@_drawn.register(CurveShape)
def _(shape: CurveShape, sketch: Sketch, body: str, name: str) -> None:
    places = _curve(sketch.pose, body, name.rpartition(".")[2], shape)
    sketch.line(list(places), 2.4, INK, Z["link"] + 0.5, name=name)
    if body != "ground":
        return
    # ticks on its right, which is solid
    depth = sketch.size("hatch")
    steps = np.diff(places, axis=0)
    along = np.append(0.0, np.cumsum(np.hypot(*steps.T)))
    at = np.arange(depth, along[-1], 2.0 * depth)
    x, y = (np.interp(at, along, part) for part in places.T)
    u = steps[np.searchsorted(along, at) - 1]
    u = u / np.hypot(*u.T)[:, None]
    start = np.column_stack([x, y])
    ends = start + depth * (np.column_stack([u[:, 1], -u[:, 0]]) - u)
    sketch.strokes(list(np.stack([start, ends], axis=1)), Z["ring"], 0.2)


@_drawn.register(Line)
def _(shape: Line, sketch: Sketch, body: str, name: str) -> None:
    pose = sketch.pose
    place = pose.point(f"{body}.{shape.point}")
    own = float(pose.system.values[f"{body}.{name.rpartition('.')[2]}.angle"])
    u = direction(own + (0.0 if body == "ground" else pose.angle(body)))
    low, high = _along(sketch, body, place, u)
    margin = BEYOND * (high - low) + 2.0 * sketch.size("block")
    ends = place + (low - margin) * u, place + (high + margin) * u
    if body != "ground":
        sketch.line(ends, 2.4, INK, Z["link"], name=name)
        return
    sketch.rail(*ends, name, math.inf)


def _along(sketch: Sketch, carrier: str, place: Array, u: Array) -> tuple[float, float]:
    """From where to where bodies are along an endless line, seen from the body that carries it; in
    the whole motion if that is drawn.
    """
    pose = sketch.pose
    corners, circles = outlines(pose)
    every = [*corners, *(centre for centre, _ in circles)]
    widest = max((radius for _, radius in circles), default=0.0)
    ends = [float((point - place) @ u) for point in every]
    low, high = min([0.0, *(e - widest for e in ends)]), max([0.0, *(e + widest for e in ends)])
    instants = slice(None) if sketch.lasting else slice(pose.k, pose.k + 1)
    origin, frame = _carried(pose, carrier, instants)
    for body in pose.mechanism.bodies:
        nodes = np.array(pose.nodes[body.name] or [pose.centre(body.name)]) @ (1.0, 1.0j)
        centre, rotation = _carried(pose, body.name, instants)
        places = centre[:, None] + rotation[:, None] * (nodes - complex(*pose.centre(body.name)))
        seen = (places - origin[:, None]) / frame[:, None] + complex(*_centre(pose, carrier))
        ahead = ((seen - complex(*place)) * complex(u[0], -u[1])).real
        radii = [
            _circle(pose, body.name, name, shape)[1]
            for name, shape in body.shapes.items()
            if isinstance(shape, Disc | Ring)
        ]
        wide = max(radii, default=0.0)
        low, high = min(low, float(ahead.min()) - wide), max(high, float(ahead.max()) + wide)
    return low, high


def _carried(pose: Pose, body: str, instants: slice) -> tuple[Array, Array]:
    """The mass centre of a body in the complex plane, and how it has rotated since the instant that
    is drawn, as factors.
    """
    if body == "ground":
        count = len(pose.run.t[instants])
        return np.zeros(count, complex), np.ones(count, complex)
    own = pose.body(body)
    rotation = np.exp(1j * (own.angle[instants] - pose.angle(body)))
    return own.x[instants] + 1j * own.y[instants], rotation


def _centre(pose: Pose, body: str) -> Array:
    return np.zeros(2) if body == "ground" else pose.centre(body)


# -- Circles of wheels and pulleys at one instant, and the rectangle that a mechanism takes ----


def wheels(joint: Joint, pose: Pose) -> list[tuple[str, float]]:
    """The circles of a joint: pitch circles, rollers, the circle around a cam.

    Each is the field of the centre's marker, and the radius.
    """
    if isinstance(joint, CamFollower):
        offset = outline(joint, pose) - pose.place(joint, "i")
        return [("i", float(np.hypot(*offset.T).max())), ("j", pose.number(joint, "roller"))]
    if isinstance(joint, Gear):
        return [(side, pose.number(joint, f"radius_{side}")) for side in "ij"]
    if isinstance(joint, RackPinion):
        return [("j", pose.number(joint, "radius"))]
    if isinstance(joint, Rolling):
        found = [("j", pose.number(joint, "radius"))]
        if joint.on_radius is not None:
            found.append(("i", pose.number(joint, "on_radius")))
        return found
    return []


def pulleys(coupling: Coupling, pose: Pose) -> dict[int, tuple[Array, float]]:
    """Centres and radii of the bodies that a coupling turns, by the number of the term.

    Among lengths the factor of an angle is a radius; otherwise the radius is 0.
    """
    found = {}
    for n, term in enumerate(coupling.parts):
        if not term.ends:
            radius = abs(pose.number(coupling, f"{n}.factor")) if coupling.lengths else 0.0
            found[n] = (pose.pivot(*term.bodies), radius)
    return found


def bounds(pose: Pose) -> Array:
    """The corners (2, 2) of the rectangle around a mechanism with its wheels and cylinders."""
    places = [node for nodes in pose.nodes.values() for node in nodes]
    places += [pose.centre(body.name) for body in pose.mechanism.bodies]
    circles = [
        (pose.place(joint, field), radius)
        for joint in pose.joints
        for field, radius in wheels(joint, pose)
    ]
    corners, solid = outlines(pose)
    places, circles = places + corners, circles + solid
    for coupling in pose.mechanism.couplings:
        circles += pulleys(coupling, pose).values()
    circles += [tyre_circle(load, pose) for load in pose.mechanism.loads if isinstance(load, Tyre)]
    for centre, radius in circles:
        places += [centre - radius, centre + radius]
    for load in pose.mechanism.loads:
        if isinstance(load, (PistonPressure, ReciprocatingCylinder)):
            own = barrel(load, pose, 0.0)
            places += [own.head, own.mouth]
    if not places:
        places = [np.zeros(2)]
    return np.array([np.min(places, axis=0), np.max(places, axis=0)])
