"""Force laws of the loads for the engines that check a result, independent of the kernels.

The numbers and laws are those of `independent_reading`. Kinematics belongs to each engine: an
engine gives `BodyState` objects, or its own places and directions. The dense oracle does not use
this file: it has the force laws once more, so that both can be compared.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.engines.crosscheck_result import Inexpressible
from mbody.engines.independent_reading import Reading, reading
from mbody.engines.oracle.friction import has_friction
from mbody.engines.spanning_tree import MarkerFrame, marker_frame
from mbody.laws import MeasuredFormula
from mbody.model.contact import Contact, Rope
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element, listed
from mbody.model.joint_limits import contacts_of
from mbody.model.joints import Distance
from mbody.model.loads import (
    Damper,
    Force,
    Gravity,
    Load,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from mbody.model.mechanism import Mechanism
from mbody.model.touching_shapes import CurveShape, Disc, Line, Polygon, Ring, Segment, points_of
from mbody.system.system import System

# -- Shapes of contacts as numbers for other engines, from the description read independently --


@dataclass(frozen=True)
class Outline:
    """A shape on a body.

    `kind`: "line", "segment", "polygon", "disc" or "ring"; points are discs without radius.
    `points`: From the mass centre, link axes [length].
    `radius`: Of discs and rings [length].
    `direction`: Of a line, link axes [rad].
    """

    body: str
    kind: str
    points: tuple[tuple[float, float], ...]
    radius: float = 0.0
    direction: float = 0.0

    @property
    def convex(self) -> bool:
        """Whether a polygon has no corner that points inwards."""
        corners = (*self.points, *self.points[:2])
        sides = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(corners)]
        crosses = [a[0] * b[1] - a[1] * b[0] for a, b in pairwise(sides)]
        return all(one >= 0.0 for one in crosses) or all(one <= 0.0 for one in crosses)


def outlines(at: Reading, contact: Contact) -> tuple[Outline, Outline]:
    """The two shapes of a contact."""
    i, j = (
        _outline(at, body, place, shape)
        for body, place, shape in zip(
            contact.bodies, (contact.i, contact.j), contact.shapes, strict=True
        )
    )
    return i, j


def _outline(at: Reading, body: str, place: str, shape: Any) -> Outline:
    cx, cy = (0.0, 0.0) if body == "ground" else at.point(f"{body}.cg")
    places = (at.point(f"{body}.{name}") for name in points_of(shape))
    points = tuple((x - cx, y - cy) for x, y in places)
    kind = {Line: "line", Segment: "segment", Polygon: "polygon", Ring: "ring"}.get(
        type(shape), "disc"
    )
    radius = float(at[f"{place}.radius"]) if isinstance(shape, Disc | Ring) else 0.0
    direction = float(at[f"{place}.angle"]) if isinstance(shape, Line) else 0.0
    return Outline(body, kind, points, radius, direction)


def not_as_rigid_contacts(machine: Mechanism, engine: str) -> Iterator[Inexpressible]:
    """Contacts of a mechanism that engines of rigid bodies with shapes have not."""
    for joint in machine.joints:
        if contacts_of(joint):
            why = "it has limits or separates: no shapes of two bodies that touch"
            yield Inexpressible(joint.name, f"{engine}: {why}")
    for one in machine.contacts:
        if isinstance(one, Rope):
            continue
        if not isinstance(one, Contact):
            why = f"{engine} has no stop along a formula of positions, only shapes that touch"
            yield Inexpressible(one.name, why)
            continue
        if any(isinstance(shape, Ring) for shape in one.shapes):
            yield Inexpressible(one.name, f"{engine} has no hollow circle")
        if any(isinstance(shape, CurveShape) for shape in one.shapes):
            yield Inexpressible(one.name, f"{engine} has no smooth curve")


# -- Elements that other engines lack: loads by formulas, inputs, friction, contacts -----------


def follows_formula(element: Element) -> bool:
    """Whether one of its laws is a formula of measured quantities."""
    fields = dataclasses.fields(element)
    return any(isinstance(getattr(element, part.name), MeasuredFormula) for part in fields)


def without_counterpart(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """Features of a mechanism without a counterpart in other engines: loads and drivers by
    formulas, inputs, auxiliary states, controllers, friction in joints.

    >>> from mbody import makers
    >>> without_counterpart(makers.four_bar(1, 3, 2, 3.5))
    ()
    """
    loads = (one.name for one in (*mechanism.loads, *mechanism.drivers) if follows_formula(one))
    why = "its law is a formula of measured quantities"
    frictional = (joint.name for joint in mechanism.joints if has_friction(joint))
    found = [Inexpressible(name, why) for name in loads] + list(signals_of(mechanism))
    why = "its friction is of the real reaction"
    return (*found, *(Inexpressible(name, why) for name in frictional))


def contacts_without_counterpart(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The contacts of a mechanism, for an engine that has none."""
    why = "it is a contact, whose impacts and sticking the oracle follows"
    touching = (*mechanism.contacts, *mechanism.groups)
    return tuple(Inexpressible(one.name, why) for one in touching)


def separating(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The joints that separate or meet limits in a motion, for an engine that has none."""
    why = "it separates, or has limits, at which the motion strikes"
    found = [one for one in mechanism.joints if one.can_separate or one.limited]
    return tuple(Inexpressible(one.name, why) for one in found)


def unsupported_states(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The loads of a mechanism with states of their own, as currents, pressures and the slip of a
    tyre are, which no other engine follows over time.
    """
    found = []
    for load in mechanism.loads:
        if states := [one.name for one in load.auxiliary_states() if not one.accounts]:
            found.append(Inexpressible(load.name, f"a state of its own: {listed(states)}"))
    return tuple(found)


def signals_of(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The inputs, auxiliary states and controllers of a mechanism, as what another engine lacks."""
    found: list[Inexpressible] = []
    for what, elements in (
        ("an input", mechanism.inputs),
        ("a state of one's own", mechanism.described_states),
        ("a sampled controller", mechanism.controllers),
    ):
        found += [Inexpressible(one.name, f"it is {what}") for one in elements]
    return tuple(found)


def smooth_alone(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """Features of elements that a file of smooth joints, always closed, lacks: contacts, friction,
    separation, limits.

    >>> from mbody import gallery
    >>> [one.element for one in smooth_alone(gallery.load("bouncing_ball"))]
    ['floor']
    """
    found = []
    for one in (*mechanism.contacts, *mechanism.groups):
        slack = isinstance(one, Rope)
        why = "it is a rope, without which places part" if slack else "bodies pass there"
        found.append(Inexpressible(one.name, why))
    for joint in mechanism.joints:
        besides = {
            "its friction": has_friction(joint),
            "its limits": bool(joint.limited),
            "that it separates": joint.can_separate,
        }
        if lost := [what for what, has in besides.items() if has]:
            found.append(Inexpressible(joint.name, ", ".join(lost)))
    return tuple(found)


Array = np.ndarray

#: Loads with force laws here; gravity is that of each engine.
NATIVE = (Force, Torque, Spring, Damper, TorsionSpring, TorsionDamper)


def has_force_law(load: Load) -> bool:
    """Whether the force law of a load is here; a formula of measured quantities is not."""
    return type(load) in NATIVE and not follows_formula(load)


@dataclass(frozen=True)
class BodyState:
    """Position and rates of one body, as an engine has them.

    `place` (2,): Of the mass centre, in the world.
    `angle`: [rad]
    `velocity` (3,): (vx, vy, ω).
    """

    place: Array
    angle: float
    velocity: Array

    @property
    def whole_angle(self) -> float:
        """The angle with whole revolutions."""
        return self.angle

    def relative_position(self, at: MarkerFrame) -> Array:
        """From the mass centre to a place, world axes (2,)."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return np.array([c * at.x - s * at.y, s * at.x + c * at.y])

    def velocity_at(self, relative: Array) -> Array:
        """Velocity (2,) of the body's point at a position from the mass centre in world axes."""
        across = np.array([-relative[1], relative[0]])
        return np.asarray(self.velocity[:2] + self.velocity[2] * across)

    def wrench(self, force: Array, torque: float, at: Array) -> Array:
        """A force at a place of the world and a torque, about the mass centre (3,)."""
        relative = at - self.place
        return np.array([*force, torque + relative[0] * force[1] - relative[1] * force[0]])


@dataclass(frozen=True)
class PointForce:
    """A force (2,) and a torque on a body at a place (2,) of the world."""

    body: str
    at: Array
    force: Array
    torque: float = 0.0


def gravity_of(system: System, t: float) -> Array:
    """The acceleration of all gravity at a time (2,)."""
    found, at = np.zeros(2), reading(system)
    for load in system.mechanism.loads:
        if type(load) is Gravity and not follows_formula(load):
            found += at.law(load, "x")(t), at.law(load, "y")(t)
    return found


def applied_forces(
    system: System,
    element: Element,
    value: float,
    point: Callable[[str, MarkerFrame], Array],
    direction: Callable[[str, float], Array],
) -> list[PointForce]:
    """The forces of a load, a driver or a rod on its bodies, where its force or torque is `value`.

    A positive value pushes the ends of a line apart, or turns the second body forwards.
    """
    one: Any = element
    if isinstance(element, Spring | Damper | Distance | DistanceDriver):
        ends = [marker_frame(system, element, side) for side in ("i", "j")]
        i, j = (point(m.body, at) for m, at in zip((one.i, one.j), ends, strict=True))
        d = j - i
        length = math.hypot(*d)
        push = value * (d / length if length else np.zeros(2))
        return [PointForce(one.i.body, i, -push), PointForce(one.j.body, j, push)]
    if isinstance(element, CoordinateDriver):
        push = value * direction(one.i.body, marker_frame(system, element, "i").angle)
        j = point(one.j.body, marker_frame(system, element, "j"))
        return [PointForce(one.i.body, j, -push), PointForce(one.j.body, j, push)]
    if isinstance(element, Force):
        at = marker_frame(system, element, "at")
        angle = float(reading(system)[f"{element.name}.angle"])
        if element.follows:
            push = value * direction(element.at.body, angle + at.angle)
        else:
            push = value * direction("ground", angle)
        return [PointForce(element.at.body, point(element.at.body, at), push)]
    base = one.relative_to if isinstance(element, AngleDriver) else one.by
    return torque_pair(base, one.body, value)


def geometry_of(
    bodies: Any,
) -> tuple[Callable[[str, MarkerFrame], Array], Callable[[str, float], Array]]:
    """The functions `point` and `direction` of `applied_forces` from a `BodyState` by name."""

    def point(body: str, at: MarkerFrame) -> Array:
        return np.asarray(bodies[body].place + bodies[body].relative_position(at))

    def direction(body: str, angle: float) -> Array:
        angle += bodies[body].angle
        return np.array([math.cos(angle), math.sin(angle)])

    return point, direction


def torque_pair(base: str, body: str, torque: float) -> list[PointForce]:
    """A torque on a body, and its opposite on the base."""
    zero = np.zeros(2)
    return [PointForce(base, zero, zero, -torque), PointForce(body, zero, zero, torque)]


def wrenches(system: System, load: Load, bodies: Any, t: float) -> dict[str, Array]:
    """Force and torque about the mass centres (3,) of one load of `NATIVE`, by body."""
    found: dict[str, Array] = {}

    value = _value(system, load, bodies, t)
    for one in applied_forces(system, load, value, *geometry_of(bodies)):
        wrench = bodies[one.body].wrench(one.force, one.torque, one.at)
        found[one.body] = found.get(one.body, np.zeros(3)) + wrench
    found.pop("ground", None)
    return found


def _value(system: System, load: Any, bodies: Any, t: float) -> float:
    """The force law: the force or torque of a load, with the sign of `applied_forces`."""
    at = reading(system)
    values, name = at.values, load.name
    if isinstance(load, Force | Torque):
        return float(at.law(load, "value")(t))
    x, rate = _deflection(system, load, bodies)
    if isinstance(load, Damper | TorsionDamper):
        if load.law is not None:
            return -float(at.law(load)(rate))
        return -float(values[f"{name}.coefficient"]) * rate
    free = "free_length" if isinstance(load, Spring) else "free_angle"
    x -= float(values[f"{name}.{free}"])
    if load.law is not None:
        return -float(at.law(load)(x))
    return -float(values[f"{name}.preload"]) - float(values[f"{name}.stiffness"]) * x


def _deflection(system: System, load: Any, bodies: Any) -> tuple[float, float]:
    """Length or angle between the two ends of a spring or damper, and its rate."""
    if isinstance(load, TorsionSpring | TorsionDamper):
        a, b = bodies[load.by], bodies[load.body]
        return b.whole_angle - a.whole_angle, b.velocity[2] - a.velocity[2]
    poses = [bodies[marker.body] for marker in (load.i, load.j)]
    relative_positions = [
        pose.relative_position(marker_frame(system, load, side))
        for pose, side in zip(poses, ("i", "j"), strict=True)
    ]
    i, j = (pose.place + relative for pose, relative in zip(poses, relative_positions, strict=True))
    vi, vj = (
        pose.velocity_at(relative) for pose, relative in zip(poses, relative_positions, strict=True)
    )
    d = j - i
    length = math.hypot(*d)
    u = d / length if length else np.zeros(2)
    return length, float(u @ (vj - vi))
