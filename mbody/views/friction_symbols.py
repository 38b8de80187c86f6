"""Symbols of contacts and friction: marks of modes, ropes, cones, friction circles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import CONTACT_GAP_CLOSED_RESULT, PRINTED_NONE_FINE, TINY
from mbody.model.contact import Rope
from mbody.model.joints import Joint, Prismatic, Revolute
from mbody.solution.contact_points import ContactPointHistory, contact_points_at, contact_points_of
from mbody.solution.histories import place as end_place
from mbody.solution.measures import measured
from mbody.summaries.text_table import force_floor
from mbody.views.frame import MODES, mark, nice
from mbody.views.labels import symbolic
from mbody.views.pose import Carrier, between, heading, on
from mbody.views.shapes import arc, direction
from mbody.views.style import FORCE, INK, SOFT, Z

if TYPE_CHECKING:
    from mbody.solution.solution import Solution
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch


Array = np.ndarray

#: How names of shapes begin that belong to forces, and are shown with them only.
CONSTRUCTION = ("cone:", "friction:")
#: Points: the length of a cone beyond the arrow, and at least; radius of a friction circle.
BEYOND, SHORTEST, SEEN = 9.0, 30.0, 9.0
#: What has more contacts than this has no names of them.
NAMED = 24
#: A gap beyond this part of the model length is not shown.
GREATEST_GAP = 0.35
#: More places than these, by the kinds of their marks, are not kept for a moving picture.
MOST = 400


# -- contacts and joints ------------------------------------------------------------------------


def contact_symbol(element: Any, sketch: Sketch, *, forces: bool = False) -> None:
    """A contact with the marks of its modes and its cones, or a rope; contacts of a result in which
    nothing decided their modes have none.
    """
    if isinstance(element, Rope):
        _rope(element, sketch)
        return
    if sketch.lasting:
        _lasting(element, sketch)
        return
    pose = sketch.pose
    for one in (
        contact_points_at(pose.run, pose.k, element.name) if _decided(pose.run, element) else ()
    ):
        if one.mode[0] == "open":
            _gap(sketch, one)
            continue
        place, normal = one.place[0], one.normal[0]
        if forces:
            _cone(sketch, one, 0, _cone_length(sketch, one))
        mark(sketch, place, one.mode[0], normal, f"contact:{element.name}")


def _decided(run: Solution, element: Any) -> bool:
    return element.name in run.modes or run.stepped is not None


def _gap(sketch: Sketch, one: ContactPointHistory) -> None:
    """Draws a gap: a dashed circle, and a dotted line to the nearest point."""
    gap = float(one.gap[0])
    if not 0.0 < gap < GREATEST_GAP * sketch.pose.system.length:
        return
    place, other = one.place[0], one.other[0]
    name = f"contact:{one.contact}"
    if gap > 2.0 * sketch.size("pin"):
        look: dict[str, Any] = {"dashes": (0, (1.0, 2.2)), "weight": 0.2}
        sketch.line([place, other], 0.9, SOFT, Z["pin"], name=name, **look)
    mark(sketch, place, "open", one.normal[0], name)


def _lasting(element: Any, sketch: Sketch) -> None:
    """The marks of every place and mode that the motion has, each there while it is so."""
    run = sketch.pose.run
    if not _decided(run, element) or run.stepped is not None:
        return
    for n, one in enumerate(contact_points_of(run, element)):
        if not one.closed.any() or one.axes is None or _many(run):
            continue
        k, carrier = int(np.argmax(one.closed)), Carrier(*one.axes)
        with sketch.carried(carrier):
            origin, u, _ = carrier.axes(run)
            place, normal = _brought(one, k, sketch.pose.k, origin, u)
            for mode in dict.fromkeys(one.mode):
                if mode == "open":
                    continue
                with sketch.where_sign(f"touch:{element.name}:{n}:{mode}", 1.0):
                    mark(sketch, place, mode, normal, f"contact:{element.name}")
            with sketch.where_sign(f"touch:{element.name}:{n}:closed", 1.0):
                edges = _edges(place, normal, one.friction, 52.0 * sketch.unit)
                _cone_lines(sketch, edges, element.name, "")


def _brought(
    one: ContactPointHistory, k: int, to: int, origin: Array, u: Array
) -> tuple[Array, Array]:
    """Place and normal of an instant, by their places in the carrier, at another instant."""

    def rotated(vector: Array, by: Array) -> Array:
        along, across = vector @ u[k], vector @ np.array([-u[k][1], u[k][0]])
        return np.asarray(along * by + across * np.array([-by[1], by[0]]))

    return origin[to] + rotated(one.place[k] - origin[k], u[to]), rotated(one.normal[k], u[to])


def _many(run: Solution) -> bool:
    """Whether there are too many contacts for marks in a moving picture."""
    return len(run.mechanism.contacts) > MOST


def drive_sense(run: Solution, driver: str, forces: bool) -> Array:
    """The history whose sign is that of a driver's arrow: beside forces its effort, where there is
    one, else its rate.
    """
    rate = np.asarray(run.driven(driver)[1], dtype=float)
    if not forces or not run.has_forces:
        return rate
    effort, floor = run.effort(driver), force_floor(run)
    if run.mechanism[driver].angular:  # type: ignore[attr-defined]  # a driver
        floor *= run.system.length
    return np.where(np.abs(effort) > floor, effort, rate)


def sign_history(run: Solution, quantity: str, forces: bool = False) -> Array:
    """History that decides when a shape is shown: a measured quantity, the sense of "drive:DRIVER",
    or 1 where a mark is there and −1 where not, of "touch:CONTACT:PLACE:MODE" and
    "mode:JOINT:MODE"; `forces`: whether forces are shown.
    """
    kind, _, parts = quantity.partition(":")
    if not parts:
        return np.asarray(measured(run, quantity)[0])
    if kind == "drive":
        return drive_sense(run, parts, forces)
    name, *fields = parts.split(":")
    if kind == "mode":
        here = [word == fields[0] for word in run.mode(name)]
    else:
        one = contact_points_of(run, run.mechanism[name])[int(fields[0])]
        here = [
            word == fields[1] or (fields[1] == "closed" and word != "open") for word in one.mode
        ]
    return np.where(here, 1.0, -1.0)


def sticking_symbol(joint: Joint, sketch: Sketch) -> None:
    """A filled square at a frictional joint while it sticks."""
    run = sketch.pose.run
    known = run.modes if run.modes else run.losses
    if joint.name not in known or run.analysis == "statics":
        return
    words = run.mode(joint.name)
    side = "i" if isinstance(joint, Prismatic) and joint.j.body == "ground" else "j"
    place = sketch.pose.place(joint, side)
    with sketch.carried(on(getattr(joint, side).body)):
        if not sketch.lasting:
            if words[sketch.pose.k] == "stick":
                mark(sketch, place, "stick", np.array([1.0, 0.0]), f"sticks:{joint.name}")
        elif "stick" in words:
            with sketch.where_sign(f"mode:{joint.name}:stick", 1.0):
                mark(sketch, place, "stick", np.array([1.0, 0.0]), f"sticks:{joint.name}")


def drawn_modes(pose: Pose) -> list[str]:
    """Which marks a picture of an instant has, for its key."""
    run, k = pose.run, pose.k
    names = [one.name for one in run.mechanism.contacts if one.name in run.modes]
    # ropes, stops and flanks of teeth have no marks
    found = {run.mode(name)[k] for name in names if contact_points_of(run, run.mechanism[name])}
    if run.stepped is not None:
        groups = (*run.mechanism.contacts, *run.mechanism.groups)
        found = {one.mode[0] for group in groups for one in contact_points_at(run, k, group.name)}
    frictional = [name for name in (run.modes or run.losses) if name not in names]
    if run.analysis != "statics":
        found |= {"stick" for name in frictional if run.mode(name)[k] == "stick"}
    return [mode for mode in MODES if mode in found]


# -- ropes -------------------------------------------------------------------------------------


def _rope(rope: Rope, sketch: Sketch) -> None:
    """A rope: a line where it is taut, a dashed one that hangs through where it is slack."""
    pose, name = sketch.pose, f"rope:{rope.name}"
    i, j = pose.place(rope, "i"), pose.place(rope, "j")
    slack = float(pose.system.values[f"{rope.name}.length"]) - float(np.hypot(*(j - i)))
    taut = slack <= CONTACT_GAP_CLOSED_RESULT * pose.system.length
    if sketch.lasting:
        with sketch.carried(between(pose.site(rope, "i"), pose.site(rope, "j"))):
            sketch.line([i, j], 1.1, INK, Z["link"] + 0.4, name=name, dashes=(0, (4, 2.5)))
            if rope.name in pose.run.modes and "stick" in pose.run.mode(rope.name):
                with sketch.where_sign(f"mode:{rope.name}:stick", 1.0):
                    sketch.line([i, j], 1.6, INK, Z["link"] + 0.41, name=name)
        return
    line = np.array([i, j]) if taut else _hanging(i, j, slack)
    dashes: Any = "-" if taut else (0, (4, 2.5))
    sketch.line(line, 1.6 if taut else 1.1, INK, Z["link"] + 0.4, name=name, dashes=dashes)
    middle = line[len(line) // 2] if not taut else 0.5 * (i + j)
    wanted = heading(j - i) + 0.5 * math.pi
    sketch.label(symbolic(rope.name), middle, wanted, 3.0 * sketch.unit, italic=True, name=name)


def _hanging(i: Array, j: Array, slack: float) -> Array:
    """A parabola of about the length of the rope: s ≈ l + 8 f²/(3 l)."""
    away = float(np.hypot(*(j - i)))
    sag = math.sqrt(0.375 * slack * (away + slack))
    part = np.linspace(0.0, 1.0, 25)[:, None]
    return np.asarray(i + part * (j - i) - 4.0 * sag * part * (1.0 - part) * np.array([0.0, 1.0]))


# -- forces ------------------------------------------------------------------------------------


def contact_forces(pose: Pose) -> list[tuple[str, Array, Array, str, str]]:
    """Forces at contacts that are drawn, as of `drawn_forces`: on j by i, at each place."""
    run, found = pose.run, []
    elements = (*run.mechanism.contacts, *run.mechanism.groups)
    for element in elements:
        if not _decided(run, element):
            continue
        for one in contact_points_at(run, pose.k, element.name):
            if one.mode[0] != "open":
                found.append((element.name, one.place[0], one.force[0], FORCE, one.j))
    return found


def contact_arrows(run: Solution) -> list[tuple[str, Array, Array]]:
    """Forces of contacts over a motion: name, places and components, both (instants, 2)."""
    found: list[tuple[str, Array, Array]] = []
    if run.stepped is not None or _many(run):
        return found
    for element in run.mechanism.contacts:
        if element.name not in run.modes:
            continue
        if isinstance(element, Rope):
            own = run.reaction(element.name)
            where = np.column_stack(end_place(run, element, "j"))
            found.append((element.name, where, np.column_stack([own.fx, own.fy])))
            continue
        found += [
            (element.name, one.place, one.force)
            for one in contact_points_of(run, element)
            if one.closed.any()
        ]
    return found


def _cone_length(sketch: Sketch, one: ContactPointHistory) -> float:
    """Somewhat longer than the arrow of the force."""
    arrow = sketch.force_scale * float(np.hypot(*one.force[0]))
    return max(arrow + BEYOND * sketch.unit, SHORTEST * sketch.unit)


def _cone(sketch: Sketch, one: ContactPointHistory, k: int, length: float) -> None:
    """The edges of the friction cone at an instant: those of rest where it sticks."""
    sticks = one.mode[k] in ("stick", "roll")
    edges = _edges(one.place[k], one.normal[k], one.static if sticks else one.friction, length)
    _cone_lines(sketch, edges, one.contact, f"{one.contact}")


def _edges(place: Array, normal: Array, friction: float, length: float) -> Array:
    """One edge, the place, the other edge (3, 2); none of a smooth contact."""
    if not friction > 0.0:
        return np.empty((0, 2))
    half, middle = math.atan(friction), heading(normal)
    ends = [place + length * direction(middle + part) for part in (half, -half)]
    return np.array([ends[0], place, ends[1]])


def _cone_lines(sketch: Sketch, edges: Array, name: str, label: str) -> None:
    if not len(edges):
        return
    look: dict[str, Any] = {"dashes": (0, (4.0, 2.0)), "weight": 0.3}
    sketch.line(edges, 0.9, FORCE, Z["arrow"] - 0.5, name=f"cone:{name}", **look)
    place, low, high = edges[1], heading(edges[2] - edges[1]), heading(edges[0] - edges[1])
    radius = 0.42 * float(np.hypot(*(edges[0] - place)))
    wide = (high - low) % math.tau
    line = arc(place, radius, low, low + wide)
    sketch.line(line, 0.6, FORCE, Z["arrow"] - 0.5, name=f"cone:{name}", weight=0.1)


# -- friction circles --------------------------------------------------------------------------


def _circle(pose: Pose, joint: Revolute, *, sticking: bool) -> float:
    """ρ = μ r/√(1 + μ²) of a pin, with the coefficient of what rests or slides; 0 of a smooth
    one.
    """
    if joint.friction is None or joint.pin_radius is None:
        return 0.0
    static = joint.static is not None and sticking
    mu = pose.number(joint, "static" if static else "friction")
    return float(friction_radius(mu, pose.number(joint, "pin_radius")))


def friction_radius(mu: Any, pin_radius: Any) -> Any:
    """Radius of the circle that the reaction of a sliding pin touches."""
    return mu * pin_radius / np.sqrt(1.0 + mu * mu)


def circle_scale(pose: Pose, unit: float, joints: Sequence[Joint]) -> float:
    """By how much friction circles are drawn larger than they are, so that they can be seen: a
    round number.
    """
    radii = [_circle(pose, one, sticking=False) for one in joints if isinstance(one, Revolute)]
    most = max(radii, default=0.0)
    if not most > 0.0:
        return 1.0
    wanted = SEEN * unit / most
    return 1.0 if wanted <= 1.5 else nice(1.5 * wanted)


def friction_circles(sketch: Sketch, joints: Sequence[Joint], scale: float) -> None:
    """The circle that the reaction of a pin touches while it slides, for each pin with friction."""
    pose = sketch.pose
    for joint in joints:
        if not isinstance(joint, Revolute):
            continue
        sticks = not sketch.lasting and _sticks(pose, joint)
        radius = scale * _circle(pose, joint, sticking=sticks)
        if radius > 0.0:
            place, name, z = pose.place(joint, "j"), f"friction:{joint.name}", Z["arrow"] - 0.4
            with sketch.carried(on(joint.j.body)):
                sketch.disc(place, radius, "none", FORCE, 0.9, z, name=name, weight=0.4)
            if not sketch.lasting:
                own = pose.run.reaction(joint.name)
                force = np.array([own.fx[pose.k], own.fy[pose.k]])
                foot = place + line_of_action(pose.run, joint, scale)[pose.k]
                half = 1.8 * radius * force / max(float(np.hypot(*force)), TINY)
                look: dict[str, Any] = {"dashes": (0, (5.0, 2.0)), "weight": 0.3}
                sketch.line([foot - half, foot + half], 0.8, FORCE, z, name=name, **look)


def _sticks(pose: Pose, joint: Joint) -> bool:
    run = pose.run
    known = joint.name in (run.modes or run.losses) and run.analysis != "statics"
    return known and run.mode(joint.name)[pose.k] == "stick"


def line_of_action(run: Solution, joint: Any, scale: float) -> Array:
    """From the centre of a pin with friction to the line of its reaction, (instants, 2), so many
    times as far; zero of all other joints.
    """
    if not isinstance(joint, Revolute) or joint.friction is None:
        return np.zeros((len(run), 2))
    own = run.reaction(joint.name)
    square = own.fx**2 + own.fy**2
    floor = PRINTED_NONE_FINE * float(np.nanmax(square, initial=0.0))
    part = np.where(square > floor, own.torque / np.maximum(square, max(floor, TINY)), 0.0)
    return np.asarray(scale * np.column_stack([part * own.fy, -part * own.fx]))
