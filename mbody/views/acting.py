"""The forces and torques on one link at an instant, ready to be drawn: name, place, look."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import FreeBody
from mbody.core.tolerances import (
    CONTACT_GAP_CLOSED_RESULT,
    DRAWN_DIRECTION_LEAST,
    PRINTED_NONE,
    PRINTED_NONE_FINE,
    TINY,
)
from mbody.model import loads
from mbody.model.contact import Rope, ShapeContact
from mbody.model.driver import AngleDriver, CoordinateDriver, Driver
from mbody.model.joints import Joint, Prismatic, Revolute
from mbody.solution.contact_points import ContactPointHistory, contact_points_at, contact_points_of
from mbody.solution.histories import place as end_place
from mbody.solution.measures import measured
from mbody.summaries.text_table import force_floor, force_names, forces_on
from mbody.views.labels import DRIVER, FORCE, INK, LINK, LOAD, PAPER, SOFT, WHEEL, Z, symbolic
from mbody.views.shapes import (
    Carrier,
    arc,
    between,
    box,
    direction,
    hatching,
    heading,
    on,
    placed,
    spiral,
    zigzag,
)
from mbody.views.sketch import MODES, mark, nice, rounded

if TYPE_CHECKING:
    from mbody.solution.solution import Solution
    from mbody.views.shapes import Pose
    from mbody.views.sketch import Sketch


# -- Symbols of contacts and friction: marks of modes, ropes, cones, friction circles ----------

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


COLORS = {"joint": FORCE, "contact": FORCE, "coupling": FORCE, "driver": DRIVER, "load": LOAD}
COLORS["inertia"] = INK


@dataclass(frozen=True)
class Acting:
    """A force, or a torque, on a link.

    `gid`, `text`: Plain name, and the name in the notation of books.
    `cause`: Of the joint, driver, coupling or load; "inertia".
    `place` (2,): Where it acts.
    `force` (2,): Of a torque there is none.
    `torque`: Of a torque, counter-clockwise positive.
    `dashed`: Whether it is d'Alembert's.
    `where`: Place of action in words.
    """

    gid: str
    text: str
    cause: str
    place: Array
    force: Array | None
    torque: float
    color: str
    dashed: bool
    where: str

    def value(self, units: Any) -> tuple[str, str]:
        """The amount with its unit, and the direction."""
        if self.force is None:
            return rounded(self.torque, "torque", units), ""
        degrees = math.degrees(math.atan2(self.force[1], self.force[0])) % 360.0
        size = rounded(float(np.hypot(*self.force)), "force", units)
        return size, f"@ {round(degrees, 2) % 360.0:.2f}°"


def notation(name: str) -> str:
    r"""A name of `force_names`, as books write it.

    >>> notation("F32"), notation("F(12,3)"), notation("T12,motor"), notation("F_P")
    ('$F_{32}$', '$F_{12,3}$', '$T_{12,\\mathrm{motor}}$', '$F_{P}$')
    """
    parts = re.fullmatch(r"([A-Z])(\d\d|\(\d+,\d+\))(?:,(.*))?", name)
    if parts is None:
        return symbolic(name)
    index = parts[2].strip("()")
    if parts[3]:
        element = re.sub(r"([_$%#&{}])", r"\\\1", parts[3]).replace(" ", r"\ ")
        index += rf",\mathrm{{{element}}}"
    return f"${parts[1]}_{{{index}}}$"


def acting_on(free: FreeBody, pose: Pose) -> list[Acting]:
    """Everything on a link that is no rounding, forces before torques."""
    floor = force_floor(free.solution)
    names = forces_on(pose.mechanism, free.body)
    number = 2 + [body.name for body in pose.mechanism.bodies].index(free.body)
    forces, torques = [], []
    for wrench in free:
        place, parts = np.array([wrench.x, wrench.y]), (wrench.fx, wrench.fy, wrench.torque)
        own = wrench.kind in ("driver", "load")
        element: Any = pose.mechanism[wrench.cause] if own else None
        if wrench.kind == "load" and (field := element.sides().get(free.body)) is not None:
            place = pose.place(element, field)
            parts = about_place(place, pose.centre(free.body), parts)
        force, torque = np.array(parts[:2]), float(parts[2])
        name, twist = wrench_names(wrench.kind, wrench.cause, names, number, pose)
        where = application_point(wrench.kind, wrench.cause, pose)
        color, dashed = COLORS[wrench.kind], wrench.kind == "inertia"
        if wrench.force > max(floor, 0.0):
            forces.append(Acting(*name, wrench.cause, place, force, 0.0, color, dashed, where))
        if abs(torque) > max(floor * pose.system.length, PRINTED_NONE * abs(wrench.torque)):
            if own and not wrench.force > 0.0:
                place = torque_pivot(element, free.body, pose)
            torques.append(Acting(*twist, wrench.cause, place, None, torque, color, dashed, where))
    return [*forces, *torques]


def about_place(place: Any, centre: Any, parts: Any) -> tuple[Any, Any, Any]:
    """A force and its torque about a place, of those about the mass centre."""
    fx, fy, torque = parts
    moment = (place[0] - centre[0]) * fy - (place[1] - centre[1]) * fx
    left = torque - moment
    rounding = PRINTED_NONE * (np.abs(moment) + np.abs(torque))
    return fx, fy, np.where(np.abs(left) > rounding, left, 0.0)


def torque_pivot(element: Any, body: str, pose: Pose) -> Array:
    """Place of the symbol of a torque without a force: about the pin on which the body turns."""
    ends = [name for name in element.bodies if name != body]
    return pose.pivot(ends[0] if ends else "", body)


def application_point(kind: str, cause: str, pose: Pose) -> str:
    """Place of action, in words; none of a load whose name says it."""
    machine = pose.mechanism
    if kind == "contact":
        touching = (one for one in machine.contacts if isinstance(one, ShapeContact | Rope))
        return (
            f"at {cause}" if cause in {one.name for one in (*touching, *machine.groups)} else "at G"
        )
    if kind == "joint":
        return f"at {cause}"
    element: Any = None if kind == "inertia" else machine[cause]
    if isinstance(element, loads.Force) and isinstance(element.at.point, str):
        return f"at {element.at.point}"
    if kind == "driver" and element in pose.system.independent_drivers:
        return cause
    return "" if kind == "load" and not isinstance(element, loads.Gravity) else "at G"


def wrench_names(
    kind: str, cause: str, names: dict[str, str], number: int, pose: Pose
) -> tuple[tuple[str, str], tuple[str, str]]:
    """The plain name and that of books, of the force and of the torque."""
    if kind == "inertia":
        force = f"$-m_{{{number}}}\\,a_{{G{number}}}$"
        return ("-ma", force), ("-Ialpha", f"$-I_{{{number}}}\\,\\alpha_{{{number}}}$")
    if cause in names:
        plain, twist = names[cause], f"T{names[cause][1:]}"
        return (plain, notation(plain)), (twist, notation(twist))
    if isinstance(pose.mechanism[cause], loads.Gravity):
        return ((f"{cause}", f"$m_{{{number}}}\\,g$"),) * 2
    return ((cause, symbolic(cause)),) * 2


# -- Symbols of loads and drivers, by class, and the arrows of forces --------------------------
# As `joint_symbols`: another kind is one function, registered for its class with
# ``@load_symbol.register(Class)`` or
# ``@driver_symbol.register(Class)``.

# -- Tyres: their circles ----------------------------------------------------------------------


def tyre_circle(load: loads.Tyre, pose: Pose) -> tuple[Array, float]:
    """The centre of the wheel, and the radius of the tyre."""
    return pose.place(load, "j"), pose.number(load, "radius")


def tyre_symbol(load: loads.Tyre, sketch: Sketch) -> None:
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


# -- Cylinders of pressure loads: place and drawing of the barrel and the piston ---------------
# Pressure acts along a line, so the place of the piston on it is arbitrary. It is drawn ahead of
# the place that it acts on, at the end of a piston rod, so that it does not cover a pin or
# crosshead.

#: Default clearance beyond the dead centres, relative to the stroke.
CLEARANCE = 0.12


@dataclass(frozen=True)
class Barrel:
    """A cylinder with its piston.

    `head`, `mouth` (2,): Middles of the closed end, and of the end where the piston rod comes out.
    `piston` (2,): Its middle.
    `place` (2,): End of the piston rod.
    `angle`: From the mouth to the head [rad].
    """

    head: Array
    mouth: Array
    piston: Array
    place: Array
    angle: float


def barrel(
    load: loads.PistonPressure | loads.ReciprocatingCylinder, pose: Pose, block: float
) -> Barrel:
    """A cylinder for a piston of that size, at one instant.

    The stroke is between the dead centres of the load; without any it is the range in this run.
    """
    angle, place = pose.direction(load, "i"), pose.place(load, "j")
    u = direction(angle)
    here = float(u @ (place - pose.place(load, "i")))
    if isinstance(load, loads.ReciprocatingCylinder):
        head_end, crank_end = pose.number(load, "near"), pose.number(load, "far")
        sign, spare = math.copysign(1.0, head_end - crank_end), pose.number(load, "clearance")
    else:
        head_end, crank_end = _stroke(load, pose, 2.0 * block, here)
        sign = -1.0
        spare = CLEARANCE * abs(head_end - crank_end)
    # from here on counted towards the head
    head_end, crank_end, here, thick = sign * head_end, sign * crank_end, sign * here, 0.3 * block
    ahead = head_end - crank_end + spare + thick + 1.3 * block
    if head_end < 0.0:  # the place on i lies beyond: it is the head
        ahead = max(min(ahead, -head_end - spare - thick), 0.0)
    w = sign * u
    piston = place + ahead * w
    head = piston + (head_end - here + spare + thick) * w
    mouth = piston + (crank_end - here - spare - thick) * w
    return Barrel(head, mouth, piston, place, math.atan2(w[1], w[0]))


def _stroke(
    load: loads.PistonPressure, pose: Pose, least: float, here: float
) -> tuple[float, float]:
    """Coordinates of the piston nearest to the head and farthest from it."""
    angle = pose.run[load.i.body].angle + float(pose.system.numbers.angle(load, "i"))
    separation = pose.track(load, "j") - pose.track(load, "i")
    along = separation[:, 0] * np.cos(angle) + separation[:, 1] * np.sin(angle)
    if np.ptp(along) < least:
        return here - 0.5 * least, here + 0.5 * least
    return float(along.min()), float(along.max())


def barrel_symbol(load: loads.PistonPressure | loads.ReciprocatingCylinder, sketch: Sketch) -> None:
    """A barrel with its piston and piston rod, hatched where it is fixed; open where no pressure
    acts on the side of the rod.
    """
    own = barrel(load, sketch.pose, sketch.size("block"))
    half, z = 0.85 * sketch.size("block"), Z["block"] - 0.5
    u = direction(own.angle)
    n = np.array([-u[1], u[0]])
    if n[1] > PRINTED_NONE:  # below, or on the right
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
        sketch.label(symbolic(load.name), middle, wanted, gap, rotation_cost=0.4, italic=True)


def _double(load: loads.PistonPressure | loads.ReciprocatingCylinder, pose: Pose) -> bool:
    """Whether pressure acts on the side of the piston rod too."""
    if isinstance(load, loads.ReciprocatingCylinder):
        return load.opposite_area is not None
    return pose.number(load, "rod_area") > 0.0


# -- forces ------------------------------------------------------------------------------------


def drawn_forces(pose: Any, joints: bool) -> list[tuple[str, Array, Array, str, str]]:
    """Forces that are drawn: name, place, components, colour, and the body that they act on.

    Applied forces always, joint forces if requested, as in the summary: F_ij of
    link i on link j.
    """
    found = []
    for load in pose.mechanism.loads:
        if isinstance(load, loads.Force):
            angle = pose.number(load, "angle")
            if load.follows:
                angle += pose.direction(load, "at")
            vector = pose.law(load, "value") * direction(angle)
            found.append((load.name, pose.place(load, "at"), vector, LOAD, load.at.body))
    if not joints:
        return found
    names = force_names(pose.mechanism)
    for joint in pose.mechanism.joints:
        name, on = names[joint.name]
        reaction = pose.run.reaction(joint.name, on)
        vector = np.array([reaction.fx[pose.k], reaction.fy[pose.k]])
        found.append((name, pose.reaction_point(joint), vector, FORCE, on))
    return found


def force_arrow(
    sketch: Sketch,
    name: str,
    place: Array,
    vector: Array,
    color: str,
    text: str,
    scale: float,
    *,
    begins: bool = False,
) -> None:
    """An arrow that begins or ends at the place, on the side with fewer obstacles; one that
    `begins` there in any case.
    """
    shaft = scale * vector
    if np.hypot(*shaft) < 2.5 * sketch.unit:
        return
    u = shaft / np.hypot(*shaft)
    clear = _clear(sketch, place, u) * u
    pulls, pushes = place + clear + shaft, place - clear - shaft
    along_side = begins or (
        _covered(sketch, place + clear, pulls) <= _covered(sketch, place - clear, pushes)
    )
    if along_side:
        free = pulls
        sketch.arrow(place + clear, free, color, name=f"force:{name}")
    else:
        free = pushes
        sketch.arrow(free, place - clear, color, name=f"force:{name}")
    wanted = heading(free - place)
    sketch.label(
        text, free, wanted, 4.0 * sketch.unit, color=color, rotation_cost=1.5, name=f"label:{name}"
    )


def _clear(sketch: Sketch, place: Array, u: Array) -> float:
    """Distance of the beginning of an arrow from its place: outside the pin, or the slider."""
    for block, angle in sketch.blocks:
        if np.hypot(*(block - place)) < sketch.size("pin"):
            along, across = (
                abs(float(u @ direction(angle))),
                abs(float(u @ direction(angle + 0.5 * math.pi))),
            )
            half = sketch.size("block")
            return (
                min(
                    half / max(along, DRAWN_DIRECTION_LEAST),
                    0.6 * half / max(across, DRAWN_DIRECTION_LEAST),
                )
                + 1.5 * sketch.unit
            )
    return 1.8 * sketch.size("pin")


def _covered(sketch: Sketch, fixed: Array, free: Array) -> float:
    """How much an arrow would cover what is already drawn."""
    places = [fixed + p * (free - fixed) for p in (0.25, 0.4, 0.55, 0.7, 0.85, 1.0)]
    return _crowded(sketch, places)


def _crowded(sketch: Sketch, places: Sequence[Array]) -> float:
    """How much is drawn within a few points of places, as a sum."""
    return sketch.places.crowd(places, 7.0 * sketch.unit)


def clear_arc(sketch: Sketch, centre: Array, radius: float, choices: Any) -> tuple[float, float]:
    """First and last angle of the arc with the fewest obstacles, the first of equal ones."""

    def crowd(ends: tuple[float, float]) -> float:
        angles = np.linspace(*ends, 9)
        return _crowded(sketch, [centre + radius * direction(angle) for angle in angles])

    costs = [round(crowd(ends), 6) + 0.04 * n for n, ends in enumerate(choices)]
    return choices[int(np.argmin(costs))]


# -- loads ------------------------------------------------------------------------------------


@singledispatch
def load_symbol(load: loads.Load, sketch: Sketch) -> None:
    """A load of any other type: a dotted line between its places with a lozenge, or its name at the
    body.
    """
    pose = sketch.pose
    ends = [pose.place(load, field) for field in load.places()]
    bodies = [name for name in load.bodies if name != "ground"]
    if not ends:
        ends = [pose.centre(name) for name in bodies]
    if not ends:
        return
    on_bodies = [marker.body for marker in load.places().values()] or bodies
    sites = [pose.fixed(*one) for one in zip(on_bodies, ends, strict=True)]
    if len(ends) > 1:
        with sketch.carried(between(sites[0], sites[-1])):
            sketch.line(ends, 1.1, LOAD, Z["block"], dashes=(0, (1.2, 2)), name=f"load:{load.name}")
    half = 1.1 * sketch.size("pin")
    lozenge = box(ends[-1], half, half, math.pi / 4.0)
    middle = np.mean(ends, axis=0)
    look: dict[str, Any] = {"color": LOAD, "italic": True}
    with sketch.carried(on(on_bodies[-1])):
        sketch.shape(lozenge, PAPER, LOAD, 1.2, Z["pin"] + 0.1, name=f"at:{load.name}")
        sketch.label(symbolic(load.name), middle, math.pi / 2.0, 6.0 * sketch.unit, **look)


@load_symbol.register(loads.Force)
@load_symbol.register(loads.Gravity)
def _(load: loads.Force | loads.Gravity, sketch: Sketch) -> None:
    """Arrows of forces are drawn together; gravity is in the key."""


@load_symbol.register(loads.Spring)
def _(load: loads.Spring, sketch: Sketch) -> None:
    i, j = (sketch.pose.place(load, side) for side in "ij")
    _anchored(sketch, load, i, j)
    lead = 9.0 * sketch.unit * sketch.small
    if sketch.lasting:
        lead = min(lead, 0.3 * _shortest(sketch, load))
    coil = zigzag(i, j, 4.6 * sketch.unit * sketch.small, lead)
    with sketch.carried(_carrier(sketch, load, lead=lead)):
        # below sliders, which it presses on
        sketch.line(coil, 1.2, INK, Z["block"] - 0.3, name=f"spring:{load.name}")
        _label_middle(sketch, load.name, i, j)


@load_symbol.register(loads.Damper)
def _(load: loads.Damper, sketch: Sketch) -> None:
    i, j = (sketch.pose.place(load, side) for side in "ij")
    _anchored(sketch, load, i, j)
    with sketch.carried(_carrier(sketch, load)):
        _dashpot(sketch, i, j, f"damper:{load.name}", INK, 4.4)
        _label_middle(sketch, load.name, i, j)


def _carrier(sketch: Sketch, element: Any, *, stretches: bool = True, lead: float = 0.0) -> Carrier:
    """The carrier from the place on i to that on j."""
    i, j = (sketch.pose.site(element, side) for side in "ij")
    return between(i, j, stretches=stretches, lead=lead)


def _anchored(sketch: Sketch, load: Any, i: Array, j: Array) -> None:
    """Eyes at both ends, and a support where one is the ground."""
    for marker, place, other in ((load.i, i, j), (load.j, j, i)):
        with sketch.carried(on(marker.body)):
            sketch.disc(place, 0.6 * sketch.size("pin"), z=Z["pin"] - 0.1)
        if marker.body == "ground":
            sketch.support(place, [other], load.name)


def _dashpot(sketch: Sketch, i: Array, j: Array, name: str, color: str, half: float) -> None:
    """A cylinder on the side of i and a piston on that of j."""
    separation = j - i
    length = float(np.hypot(*separation))
    if length == 0.0:
        return
    n = np.array([-separation[1], separation[0]]) / length
    half *= sketch.unit * sketch.small
    a, b, p = i + 0.28 * separation, i + 0.72 * separation, i + 0.52 * separation
    sketch.line([i, a], 1.2, color, Z["block"])
    sketch.line([b + half * n, a + half * n, a - half * n, b - half * n], 1.2, color, Z["block"])
    sketch.line([p + 0.75 * half * n, p - 0.75 * half * n], 2.2, color, Z["block"])
    sketch.line([p, j], 1.2, color, Z["block"], name=name)


def _label_middle(sketch: Sketch, name: str, i: Array, j: Array, color: str = INK) -> None:
    wanted = heading(j - i) + math.pi / 2.0
    gap = 7.0 * sketch.unit
    sketch.label(
        symbolic(name), 0.5 * (i + j), wanted, gap, rotation_cost=0.2, italic=True, color=color
    )


@load_symbol.register(loads.Torque)
def _(load: loads.Torque, sketch: Sketch) -> None:
    """An arc about the body's pin, in the direction of the torque; none where it is zero."""
    value = sketch.pose.law(load, "value")
    signs = _arrow_signs(sketch, f"{load.name}.torque", value)
    if not signs or (not value and not sketch.lasting):
        return
    text = rounded(value, "torque", sketch.pose.mechanism.shown)
    _torque_symbol(sketch, load, f"{symbolic(load.name)} = {text}", signs)


def _arrow_signs(sketch: Sketch, quantity: str, value: float) -> list[tuple[str, float]]:
    """The directions that an arrow has, and the quantity by which each is chosen; "" where there is
    nothing to choose.
    """
    if not sketch.lasting:
        return [("", math.copysign(1.0, value))]
    return _signs_of(measured(sketch.pose.run, quantity)[0], quantity)


def _signs_of(history: Array, quantity: str) -> list[tuple[str, float]]:
    """The signs that a history has, and the quantity where it has not one throughout."""
    floor = PRINTED_NONE * float(np.abs(history).max(initial=0.0))
    found = [sign for sign in (1.0, -1.0) if bool((sign * history > floor).any())]
    whole = len(found) == 1 and bool((found[0] * history > floor).all())
    return [("" if whole else quantity, sign) for sign in found]


def _drive_signs(sketch: Sketch, driver: Driver) -> list[tuple[str, float]]:
    """The directions that the arrow of a driver has, with forces beside it and without."""
    if not sketch.lasting:
        return [("", math.copysign(1.0, sketch.pose.rate(driver.name)))]
    either = [drive_sense(sketch.pose.run, driver.name, forces) for forces in (False, True)]
    signs = np.concatenate([np.sign(one) for one in either])
    return _signs_of(signs, f"drive:{driver.name}")


def _torque_symbol(
    sketch: Sketch, load: loads.Torque, text: str, signs: list[tuple[str, float]]
) -> None:
    centre = sketch.pose.pivot(load.by, load.body)
    radius = free_radius(sketch, centre)
    wanted = outward_from(sketch, centre, load.body)
    look: dict[str, Any] = {"color": LOAD, "name": f"label:{load.name}"}
    with sketch.carried(placed(sketch.pose.fixed(load.body, centre))):
        for quantity, sign in signs[::-1]:
            choices = [(wanted + a, wanted + a + 2.4 * sign) for a in _STARTS]
            first, last = clear_arc(sketch, centre, radius, choices)
            with sketch.where_sign(quantity, sign):
                sketch.curved(centre, radius, first, last, LOAD, name=f"torque:{load.name}")
        wanted = 0.5 * (first + last)
        sketch.label(text, centre, wanted, radius + 3.0 * sketch.unit, **look)


@load_symbol.register(loads.TorsionSpring)
@load_symbol.register(loads.TorsionDamper)
def _(load: loads.TorsionSpring | loads.TorsionDamper, sketch: Sketch) -> None:
    """A spiral about the body's pin; a damper's is an arc in a cup."""
    centre = sketch.pose.pivot(load.by, load.body)
    start, radius = outward_from(sketch, centre, load.body), free_radius(sketch, centre)
    gap = radius + 3.0 * sketch.unit
    with sketch.carried(on(load.body)):
        if isinstance(load, loads.TorsionSpring):
            coil = spiral(centre, 1.3 * sketch.size("pin"), radius, start)
            sketch.line(coil, 1.0, INK, Z["block"], name=f"spring:{load.name}", weight=0.5)
        else:
            for part in (0.8, 1.0):
                wing = centre + part * radius * np.array([direction(start + a) for a in _CUP])
                sketch.line(wing, 1.2, INK, Z["block"], name=f"damper:{load.name}")
        sketch.label(symbolic(load.name), centre, start + math.pi, gap, italic=True)


@load_symbol.register(loads.PistonPressure)
@load_symbol.register(loads.ReciprocatingCylinder)
def _(load: loads.PistonPressure | loads.ReciprocatingCylinder, sketch: Sketch) -> None:
    barrel_symbol(load, sketch)


@load_symbol.register(loads.Tyre)
def _(load: loads.Tyre, sketch: Sketch) -> None:
    tyre_symbol(load, sketch)


@load_symbol.register(loads.CentrifugalField)
def _(load: loads.CentrifugalField, sketch: Sketch) -> None:
    """The axis, and at its end an arrow around it with ω, seen a little from above."""
    with sketch.carried(on(load.places()["axis"].body)):
        _field(load, sketch)


def _field(load: loads.CentrifugalField, sketch: Sketch) -> None:
    pose = sketch.pose
    origin, u = pose.place(load, "axis"), direction(pose.direction(load, "axis"))
    across = np.array([u[1], -u[0]])
    corners = np.array(np.meshgrid(*zip(sketch.low, sketch.high, strict=True))).reshape(2, -1).T
    along, half = (corners - origin) @ u, sketch.size("support")
    top = max([along.max(), *_arc_tops(sketch, origin, u)])
    ends = origin + (along.min() - half) * u, origin + (top + 1.6 * half) * u
    look: dict[str, Any] = {"dashes": (0, (12, 3, 2, 3)), "weight": 0.4}
    sketch.line(ends, 0.9, LOAD, Z["path"], name=f"axis:{load.name}", **look)
    speed = float(load.spindle(pose.run).speed[pose.k])
    angles = np.linspace(2.3, 6.6, 40)
    angles = angles if speed >= 0.0 else math.pi - angles
    ring = np.outer(np.cos(angles), across) + 0.32 * np.outer(np.sin(angles), u)
    centre = ends[1] - 0.9 * half * u
    if speed:
        sketch.bent(centre + 1.3 * half * ring, LOAD, name=f"field:{load.name}")
    text = f"$\\omega$ = {rounded(speed, 'angular velocity', pose.mechanism.shown)}"
    gap = 1.3 * half + 6.0 * sketch.unit
    sketch.label(text, centre, heading(across), gap, color=LOAD, name=f"label:{load.name}")


def _arc_tops(sketch: Sketch, origin: Array, u: Array) -> list[float]:
    """How far along an axis the arcs of those drivers reach whose pivot is near it."""
    pose, found = sketch.pose, []
    for driver in pose.mechanism.drivers:
        if isinstance(driver, AngleDriver):
            pivot = pose.pivot(driver.relative_to, driver.body)
            extent = sketch.size("arc") + 8.0 * sketch.unit
            along = float((pivot - origin) @ u)
            if math.hypot(*(pivot - origin - along * u)) < 2.0 * extent:
                found.append(along + extent)
    return found


#: Where an arc may begin, from the direction of its link [rad].
_STARTS = [sign * n * math.pi / 12.0 for n in range(1, 12) for sign in (1.0, -1.0)]
_CUP = np.linspace(-0.8, 0.8, 12)


def free_radius(sketch: Sketch, centre: Array) -> float:
    """Radius of a new arc at a place, outside the arcs that are already there."""
    arcs = sum(np.hypot(*(centre - other)) < sketch.size("pin") for other in sketch.arcs)
    sketch.arcs.append(centre)
    return (1.0 + 0.5 * arcs) * sketch.size("arc")


def outward_from(sketch: Sketch, centre: Array, body: str) -> float:
    """The direction in which a body lies from a place [rad]."""
    offsets = [node - centre for node in sketch.pose.nodes[body]]
    offsets.append(sketch.pose.centre(body) - centre)
    farthest = max(offsets, key=lambda offset: round(float(np.hypot(*offset)) / sketch.unit, 3))
    return heading(farthest) if np.hypot(*farthest) > sketch.unit else 0.0


# -- drivers -----------------------------------------------------------------------------------


@singledispatch
def driver_symbol(driver: Driver, sketch: Sketch, text: str) -> None:
    """A driver between two places: a cylinder with its piston."""
    i, j = (sketch.pose.place(driver, side) for side in "ij")
    for marker, place, other in ((driver.places()["i"], i, j), (driver.places()["j"], j, i)):
        with sketch.carried(on(marker.body)):
            sketch.pin(place, "")
        if marker.body == "ground":
            sketch.support(place, [other], driver.name)
    separation = j - i
    length = float(np.hypot(*separation))
    if length > sketch.unit:
        half, u = 4.2 * sketch.unit * sketch.small, separation / length
        # a barrel keeps its length in the whole motion: that of the shortest distance
        part = _shortest(sketch, driver) / length if sketch.lasting else 1.0
        with sketch.carried(_carrier(sketch, driver)):
            sketch.line([i, j], 2.0, DRIVER, Z["block"], name=f"driver:{driver.name}")
        barrel = box(i + 0.36 * part * separation, 0.26 * part * length, half, heading(u))
        with sketch.carried(_carrier(sketch, driver, stretches=False)):
            sketch.shape(barrel, PAPER, DRIVER, 1.2, Z["block"] + 0.1)
    wanted = heading(separation) + math.pi / 2.0
    gap = 7.0 * sketch.unit
    with sketch.carried(_carrier(sketch, driver)):
        sketch.label(text, 0.5 * (i + j), wanted, gap, rotation_cost=0.2, color=DRIVER)


def _shortest(sketch: Sketch, element: Any) -> float:
    """The least distance of the places of an element in this run."""
    return float(_carrier(sketch, element).axes(sketch.pose.run)[2].min())


@driver_symbol.register(AngleDriver)
def _(driver: AngleDriver, sketch: Sketch, text: str) -> None:
    """A curved arrow that runs ahead of the driven link."""
    centre = sketch.pose.pivot(driver.relative_to, driver.body)
    start, radius = outward_from(sketch, centre, driver.body), free_radius(sketch, centre)
    gap = radius + 3.0 * sketch.unit
    signs = _drive_signs(sketch, driver)
    with sketch.carried(placed(sketch.pose.fixed(driver.body, centre), driver.relative_to)):
        for quantity, sign in signs[::-1] or [("", 1.0)]:
            ahead = [
                (start + a * sign, start + (a + b) * sign) for b in (1.6, 1.2) for a in (0.45, 0.6)
            ]
            behind = [(start - a * sign, start - 0.45 * sign) for a in (2.05, 1.7)]
            first, last = clear_arc(sketch, centre, radius, [*ahead, *behind])
            with sketch.where_sign(quantity, sign):
                sketch.curved(centre, radius, first, last, DRIVER, name=f"driver:{driver.name}")
        sketch.label(text, centre, 0.5 * (first + last), gap, rotation_cost=2.0, color=DRIVER)


@driver_symbol.register(CoordinateDriver)
def _(driver: CoordinateDriver, sketch: Sketch, text: str) -> None:
    """An arrow along the driven direction."""
    pose = sketch.pose
    place, u = pose.place(driver, "j"), direction(pose.direction(driver, "i"))
    first = 1.5 * sketch.size("block")
    signs = _drive_signs(sketch, driver)
    with sketch.carried(placed(pose.site(driver, "j"), driver.places()["i"].body)):
        for quantity, sign in signs[::-1] or [("", 1.0)]:
            tail, tip = place + sign * first * u, place + sign * 3.6 * first * u
            with sketch.where_sign(quantity, sign):
                sketch.arrow(tail, tip, DRIVER, name=f"driver:{driver.name}")
        sketch.label(text, tip, heading(tip - tail), 4.0 * sketch.unit, color=DRIVER)
