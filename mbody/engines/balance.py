"""The balance of a result by plain arithmetic: Newton and Euler of every body, virtual power, laws.

Motion, reactions and efforts are taken from the result. Loads are computed again from their laws
where possible. Σ F = m a, Σ M = I α of every free body;  Σ (f − M a)·v + Σ effort·rate = 0.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from mbody.analysis.driven.free_body import acting_on_several, coupled, driven
from mbody.core.presentation import Presented
from mbody.core.tolerances import BALANCE_EXPECTED, RATE_NONE_MECHANISM
from mbody.engines.independent_reading import Reading, law_by_formula, laws_of, reading
from mbody.engines.oracle.friction import band_torque, has_friction
from mbody.engines.spanning_tree import MarkerFrame, marker_frame
from mbody.laws import MeasuredFormula
from mbody.model.contact import Contact, Rope
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element, Marker, listed
from mbody.model.joint_limits import contacts_of
from mbody.model.joints import (
    BandBrake,
    CamFollower,
    Clutch,
    Distance,
    FrictionForce,
    Gear,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)
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
from mbody.model.stop import Stop
from mbody.model.touching_shapes import CurveShape, Disc, Line, Polygon, Ring, Segment, points_of
from mbody.solution.checks import each_load_of
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- The cross-check of a result by another engine: rows of numbers, with the expected
#    difference --------------------------------------------------------------------------------

AGREES, DIFFERS = "agrees", "differs"


@dataclass(frozen=True)
class Row(Presented):
    """One quantity, by both engines.

    `quantity`: ``"motor.effort"``, ``"A.force"``, ``"crank.angle"``, at the instant of the greatest
      difference.
    `ours`, `theirs`: Its values there, in the units of the mechanism.
    `difference`: Relative to the greatest value of its kind (forces, torques, angles) over all
      instants.
    `expected`: The greatest difference that still agrees for this engine.
    `reason`: Why this difference is expected.
    """

    quantity: str
    ours: float
    theirs: float
    difference: float
    expected: float
    reason: str

    declared = ("quantity", "ours", "theirs", "difference", "expected", "reason", "verdict")

    @property
    def verdict(self) -> str:
        """``"agrees"`` or ``"differs"``; NaN differs."""
        return AGREES if self.difference <= self.expected else DIFFERS


@dataclass(frozen=True)
class Inexpressible(Presented):
    """An element that an engine cannot model, and why."""

    element: str
    why: str


@dataclass(frozen=True)
class CrosscheckResult(Presented):
    """The cross-check of one result by one engine.

    `engine`: With its version.
    `not_expressible`: What this engine could not check: elements, or the whole model.
    `notes`: How the check was made.
    `adopted`: Elements whose forces it took from the result, by formulas of mbody.
    """

    engine: str
    rows: tuple[Row, ...]
    not_expressible: tuple[Inexpressible, ...] = ()
    notes: tuple[str, ...] = ()
    adopted: tuple[str, ...] = ()

    declared = ("engine", "rows", "not_expressible", "notes")

    @property
    def agrees(self) -> bool:
        """Whether no row differs."""
        return all(row.verdict == AGREES for row in self.rows)

    @property
    def verdict(self) -> str:
        """``"agrees"``, ``"differs"``, or ``"compared nothing"``."""
        if not self.rows:
            return "compared nothing"
        return AGREES if self.agrees else DIFFERS


class Engine(Protocol):
    """The function `crosscheck_result` of an engine; each engine is a module of `mbody.engines`."""

    def __call__(self, system: System, run: Solution) -> CrosscheckResult:
        """Check a result, of kinetostatics, statics or simulate, against this engine's own.

        The other engine models `system`. The run may be of another system with the same names, as
        in tests with a planted fault.
        """


# -- Rows of a cross-check from the histories of both engines -------------------------------------

Array = np.ndarray


@dataclass
class Comparison:
    """Collects histories of quantities and makes a row of each.

    Differences are relative to the greatest value of their kind (all forces, all torques …) over
    all instants. A row has the instant at which the difference is greatest relative to the expected
    one.
    """

    kinds: dict[str, list[tuple[str, Array, Array]]] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)

    def add(self, kind: str, quantity: str, ours: Any, theirs: Any) -> None:
        """Histories (instants,) of one quantity."""
        pair = np.atleast_1d(np.asarray(ours, dtype=float)), np.atleast_1d(theirs)
        self.kinds.setdefault(kind, []).append((quantity, *pair))

    def size(self, kind: str, values: Any) -> None:
        """Set the least reference value of a kind, as a length of the mechanism."""
        top = float(np.abs(values).max(initial=0.0))
        self.sizes[kind] = max(self.sizes.get(kind, 0.0), top)

    def top(self, kind: str) -> float:
        """The greatest value of a kind over all instants; 1 where all are zero."""
        parts = [part for _, *both in self.kinds.get(kind, []) for part in both]
        tops = [float(np.abs(part[np.isfinite(part)]).max(initial=0.0)) for part in parts]
        return max([*tops, self.sizes.get(kind, 0.0)]) or 1.0

    def rows(self, expected: dict[str, Array | float], reasons: dict[str, str]) -> list[Row]:
        """A row for each quantity; the expected differences are by kind, one number or one
        per instant.
        """
        found = []
        for kind, quantities in self.kinds.items():
            top = self.top(kind)
            for quantity, ours, theirs in quantities:
                part = np.abs(theirs - ours) / top
                # NaN differs most
                part = np.where(np.isnan(part), np.inf, part)
                limit = np.broadcast_to(expected[kind], part.shape)
                if not part.size:
                    continue
                k = int(np.argmax(part / limit))
                found.append(
                    Row(
                        quantity,
                        float(ours[k]),
                        float(theirs[k]),
                        float(part[k]),
                        float(limit[k]),
                        reasons[kind],
                    )
                )
        return found


# -- Force laws of the loads for the engines that check a result, independent of the kernels ---
#
# The numbers and laws are those of `independent_reading`. Kinematics belongs to each engine: an
# engine gives `BodyState` objects, or its own places and directions. The dense oracle does not use
# this file: it has the force laws once more, so that both can be compared.

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


# -- Instants at which no stop presses: other engines have no force along a formula of positions


def without_pressing_stops(run: Solution) -> tuple[Solution, list[str]]:
    """A result without the instants at which a stop presses, and a note where there are such."""
    stops = [one.name for one in run.mechanism.contacts if isinstance(one, Stop)]
    if run.analysis != "simulate" or not stops:
        return run, []
    free = np.all([run.contact(name) == 0.0 for name in stops], axis=0)
    if free.all():
        return run, []
    note = (
        f"forces are not compared at {int((~free).sum())} instants at which {listed(stops)} press"
    )
    return run.take(np.flatnonzero(free)), [note]


# -- Constraints of gears, racks, wheels, cams and couplings, checked by the motion ------------
# The constraints are differentiated by hand: the rate and the acceleration of each must vanish for
# the histories of a result and the numbers of the description. Δ goes from the place on i to that
# on j.

#: First and second derivative, arrays (instants,), and the sizes of their terms.
Rates = tuple[Array, Array, Array, Array]

#: Joints whose constraint rates are computed here.
MESHING = (Gear, RackPinion, Rolling, CamFollower)


def constraint_rates(system: System, run: Solution, element: Any) -> list[Rates]:
    """Rate and acceleration of every constraint row of a joint of `MESHING` or a coupling.

    >>> import mbody
    >>> made = mbody.gallery.load("planetary_train")
    >>> run = mbody.kinetostatics(made)
    >>> rows = constraint_rates(run.system, run, made.joints[-1])
    >>> bool(abs(rows[0][0]) <= 1e-12 * rows[0][2])
    True
    """
    if isinstance(element, MESHING):
        return _of_joint(_Pair(system, run, element, element.i, element.j), element)
    parts = [_of_term(system, run, element, n) for n in range(len(element.parts))]
    first, second, size, sizes = (sum(some) for some in zip(*parts, strict=True))
    return [(first, second, size, sizes)]


class _Pair:
    """Two places in the world: Δ and its derivatives, and the rotation of both bodies."""

    def __init__(self, system: System, run: Solution, element: Any, i: Marker, j: Marker) -> None:
        self.run, self.at, self.element = run, reading(system), element
        self.angle_i, self.w_i, self.a_i = self.rotation(i.body)
        self.angle_j, self.w_j, self.a_j = self.rotation(j.body)
        at_i, at_j = self.place("i", i), self.place("j", j)
        self.d, self.v, self.a = (b - a for a, b in zip(at_i, at_j, strict=True))

    def rotation(self, body: str) -> tuple[Array, Array, Array]:
        one = self.run[body]
        return one.angle, one.omega, one.alpha

    def place(self, side: str, marker: Marker) -> tuple[Array, Array, Array]:
        """Place, velocity, acceleration (2, instants)."""
        one = self.run[marker.body]
        x, y = self._body_fixed(side)
        c, s = np.cos(one.angle), np.sin(one.angle)
        r = np.array([c * x - s * y, s * x + c * y])
        across = np.array([-r[1], r[0]])
        return (
            np.array([one.x, one.y]) + r,
            np.array([one.vx, one.vy]) + one.omega * across,
            np.array([one.ax, one.ay]) + one.alpha * across - one.omega**2 * r,
        )

    def _body_fixed(self, side: str) -> tuple[float, float]:
        return self.at.arm(self.element, side)

    def beta(self, side: str) -> float:
        """Direction of a marker on its body."""
        return self.at.angle(self.element, side)

    def along(self, angle: Array, w: Array, alpha: Array) -> tuple[Array, Array, Array, Array]:
        """Derivatives of u·Δ, where u turns at the rate w, and the sizes of the terms."""
        u = np.array([np.cos(angle), np.sin(angle)])
        t = np.array([-u[1], u[0]])
        ud, uv, ua = (_dot(u, part) for part in (self.d, self.v, self.a))
        td, tv = _dot(t, self.d), _dot(t, self.v)
        first, second = uv + w * td, ua + 2.0 * w * tv + alpha * td - w * w * ud
        size = np.hypot(*self.v) + np.abs(w) * np.hypot(*self.d)
        sizes = np.hypot(*self.a) + 2.0 * np.abs(w) * np.hypot(*self.v)
        return first, second, size, sizes + (np.abs(alpha) + w * w) * np.hypot(*self.d)

    def distance(self) -> Rates:
        """Derivatives of |Δ|."""
        length = np.hypot(*self.d)
        e = self.d / length
        first = _dot(e, self.v)
        second = _dot(e, self.a) + (_dot(self.v, self.v) - first * first) / length
        return first, second, np.hypot(*self.v), np.hypot(*self.a) + _dot(self.v, self.v) / length

    def polar(self) -> tuple[Array, Array]:
        """Derivatives of the direction of Δ."""
        square = _dot(self.d, self.d)
        cross = self.d[0] * self.v[1] - self.d[1] * self.v[0]
        more = self.d[0] * self.a[1] - self.d[1] * self.a[0]
        return cross / square, more / square - 2.0 * _dot(self.d, self.v) * cross / square**2


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=0))


def _of_joint(pair: _Pair, joint: Any) -> list[Rates]:
    w, alpha = pair.w_j - pair.w_i, pair.a_j - pair.a_i
    number = pair.at.values
    if isinstance(joint, CamFollower):
        return [_cam(pair, joint)]
    if isinstance(joint, Gear) or joint.__dict__.get("on_radius") is not None:
        keys = ("radius_i", "radius_j") if isinstance(joint, Gear) else ("on_radius", "radius")
        ri, rj = (float(number[f"{joint.name}.{key}"]) for key in keys)
        if joint.internal:  # internal gear: the contact is on the other side of its centre
            ri, rj = (ri, -rj) if ri > rj else (-ri, rj)
        # rolling: the line of centres turns by R ψ = r_i θ_i + r_j θ_j
        first, second = pair.polar()
        whole = ri + rj
        rolled = whole * first - ri * pair.w_i - rj * pair.w_j
        change = whole * second - ri * pair.a_i - rj * pair.a_j
        size = np.abs(ri * pair.w_i) + np.abs(rj * pair.w_j)
        sizes = np.abs(ri * pair.a_i) + np.abs(rj * pair.a_j) + size * size / abs(whole)
        rows = [(rolled, change, size, sizes)]
        return rows if isinstance(joint, Gear) else [pair.distance(), *rows]
    radius = float(number[f"{joint.name}.radius"])
    line = pair.angle_i + pair.beta("i")
    first, second, size, sizes = pair.along(line, pair.w_i, pair.a_i)
    sizes = sizes + radius * (np.abs(alpha) + w * w)
    rows = [(first + radius * w, second + radius * alpha, size + radius * np.abs(w), sizes)]
    if isinstance(joint, Rolling):
        rows.append(pair.along(line + 0.5 * math.pi, pair.w_i, pair.a_i))
    return rows


def _cam(pair: _Pair, joint: CamFollower) -> Rates:
    """|Δ| or n·Δ, less the profile at its angle."""
    sign = 1.0 if joint.clockwise else -1.0
    profile = law_by_formula(joint.profile)
    if joint.flat:
        face = pair.angle_j + pair.beta("j") + 0.5 * math.pi
        rates = pair.along(face, pair.w_j, pair.a_j)
        angle = face
        omega, more = pair.w_j - pair.w_i, pair.a_j - pair.a_i
    else:
        rates = pair.distance()
        angle = np.arctan2(pair.d[1], pair.d[0])
        omega, more = pair.polar()
        omega, more = omega - pair.w_i, more - pair.a_i
    place = (sign * (angle - pair.angle_i - pair.beta("i"))) % (2.0 * math.pi)
    table = np.array([profile.derivatives(float(x)) for x in place])
    f1, f2 = sign * table[:, 1], table[:, 2]
    first, second, size, sizes = rates
    lift, change = f1 * omega, f2 * omega**2 + f1 * more
    sizes = sizes + np.abs(f2 * omega**2) + np.abs(f1 * more)
    return first - lift, second - change, size + np.abs(lift), sizes


def _of_term(system: System, run: Solution, coupling: Any, n: int) -> Rates:
    """Derivatives of one term of a coupling, times its factor."""
    term = coupling.parts[n]
    factor = float(reading(system)[f"{coupling.name}.{n}.factor"])
    if term.angle is not None:
        one, base = run[term.angle], run[term.relative_to]
        w, alpha = one.omega - base.omega, one.alpha - base.alpha
        # at uniform rotation the accelerations are rounding, compared with ω²
        rates: Rates = w, alpha, np.abs(w), np.abs(alpha) + w * w
    else:
        pair = _TermPair(system, run, coupling, n)
        if term.distance is not None:
            rates = pair.distance()
        else:
            line = pair.angle_i + pair.beta("i")
            rates = pair.along(line, pair.w_i, pair.a_i)
    first, second, size, sizes = rates
    return factor * first, factor * second, abs(factor) * size, abs(factor) * sizes


class _TermPair(_Pair):
    """The two places of a term of a coupling."""

    def __init__(self, system: System, run: Solution, coupling: Any, n: int) -> None:
        self.n = n
        term = coupling.parts[n]
        super().__init__(system, run, coupling, *term.ends)

    def _body_fixed(self, side: str) -> tuple[float, float]:
        return self.at.arm(self.element, f"{self.n}.{side}")

    def beta(self, side: str) -> float:
        """Direction of a marker on its body."""
        return self.at.angle(self.element, f"{self.n}.{side}")


def crosscheck_result(system: System, run: Solution) -> CrosscheckResult:
    """The balance of forces and of power for a result."""
    run, notes = without_pressing_stops(run)
    loads, adopted = _loads(system, run)
    n, count = len(system.mechanism.bodies), len(run)
    mass = reading(system).masses
    motion = np.zeros((3, count, n, 3))
    for b, name in enumerate(run):
        keys = (("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha"))
        for order, row in enumerate(keys):
            for part, key in enumerate(row):
                motion[order, :, b, part] = getattr(run[name], key)
    inertia = mass * motion[2] * (run.analysis != "statics")
    joints, size = _joints(system, run, motion[0])
    left = loads + joints - inertia
    comparison = Comparison()
    length = system.length
    parts = [size, np.abs(loads).max(axis=(1, 2), initial=0.0)]
    comparison.size("force", np.array([*parts[0], *np.abs(loads[..., :2]).ravel()]))
    comparison.size("force", inertia[..., :2])
    comparison.size("torque", np.abs(np.concatenate([loads[..., 2], inertia[..., 2]])))
    comparison.size("torque", length * comparison.top("force"))
    for b, body in enumerate(system.mechanism.bodies):
        for part, key in enumerate(("fx", "fy", "torque")):
            kind = "torque" if part == 2 else "force"
            comparison.add(kind, f"{body.name}: sum of {key}", np.zeros(count), left[:, b, part])
    if run.stepped is not None:
        notes.append("power is not compared: forces are means of steps, rates are of their ends")
    elif run.analysis != "statics":
        _power(system, run, (loads, inertia), motion[1], comparison)
    _laws(system, run, comparison)
    _meshing(system, run, comparison)
    _contacts_press(reading(system).values, run, comparison)
    _joints_within_friction(system, run, comparison)
    why = "residual of Newton's method, and rounding of sums"
    expected: dict[str, Array | float] = dict.fromkeys(comparison.kinds, BALANCE_EXPECTED)
    reasons = dict.fromkeys(comparison.kinds, why)
    if run.stepped is not None:
        ratio = comparison.top("force") / comparison.top("torque") * _passed_in_a_step(run)
        expected["torque"] = BALANCE_EXPECTED + ratio
        reasons["torque"] = "contacts of a step act in its middle, bodies are at its end"
    rows = comparison.rows(expected, reasons)
    if adopted:
        notes.append(f"taken from our result as forces: {listed(adopted)}")
    return CrosscheckResult("balance", tuple(rows), (), tuple(notes), tuple(adopted))


# -- What presses and does not pull, and friction within its limit --------------------------------


def _contacts_press(values: dict[str, Any], run: Solution, comparison: Comparison) -> None:
    """N ≥ 0 of every contact and rope, and |F| ≤ N √(1 + μ²) where there is friction."""
    for contact in acting_contacts(run):
        if getattr(contact, "closed", False):
            continue  # it is kept closed, and the result says where it would have to pull
        press = run.contact(contact.name)
        comparison.add("force", f"{contact.name}: presses", np.minimum(press, 0.0), 0.0 * press)
        mu = values.get(f"{contact.name}.friction")
        if mu is None or run.stepped is not None:
            continue
        static = values.get(f"{contact.name}.static")
        sticks = np.isin(run.mode(contact.name), ("stick", "roll"))
        mu = np.where(sticks & (static is not None), static or 0.0, mu)
        reaction = run.reaction(contact.name)
        whole = np.hypot(reaction.fx, reaction.fy)
        most = np.maximum(press, 0.0) * np.sqrt(1.0 + mu * mu)
        name = f"{contact.name}: force within its friction cone"
        comparison.add("force", name, whole, np.minimum(whole, most))


def _joints_within_friction(system: System, run: Solution, comparison: Comparison) -> None:
    """Friction of pins, slides, clutches, brakes and packings is at most what their coefficients,
    or laws, let them hold.
    """
    moving = run.analysis == "simulate"
    for joint in system.mechanism.joints:
        if joint.has_friction and not (moving and joint.can_separate):
            found = _friction_and_limit(system, run, joint)
            if found is not None:
                kind, friction, most = found
                size = np.abs(friction)
                name = f"{joint.name}: friction within its limit"
                comparison.add(kind, name, size, np.minimum(size, most))


def _friction_and_limit(
    system: System, run: Solution, joint: Any
) -> tuple[str, Array, Array] | None:
    """Friction of a joint and its greatest magnitude; None where it is not of this kind."""
    at, one = reading(system), run.reaction(joint.name)
    force = np.hypot(one.fx, one.fy)

    def number(key: str) -> float:
        return float(at.values.get(f"{joint.name}.{key}") or 0.0)

    i, j = (run[body] for body in joint.bodies)
    if isinstance(joint, Revolute):
        mu = max(number("friction"), number("static"))
        radius = number("pin_radius") * mu / math.sqrt(1.0 + mu * mu)
        return "torque", one.torque + number("viscous") * (j.omega - i.omega), radius * force
    if isinstance(joint, Clutch | FrictionForce | BandBrake):
        field = joint.law or joint.size
        if isinstance(getattr(joint, field), MeasuredFormula):
            return None
        law = at.law(joint, field)
        given = np.array([max(0.0, float(law(float(t)))) for t in run.t]) * number("static")
        if isinstance(joint, FrictionForce):
            return "force", force, given
        if isinstance(joint, BandBrake):
            ways = [[band_torque(joint, f, sign) for f in given] for sign in (1.0, -1.0)]
            given = np.max(ways, axis=0)
        return "torque", one.torque, given
    if isinstance(joint, Prismatic | PinSlot):
        angle = i.angle + at.angle(joint, "i")
        along = one.fx * np.cos(angle) + one.fy * np.sin(angle)
        press = np.abs(one.fy * np.cos(angle) - one.fx * np.sin(angle))
        if isinstance(joint, Prismatic) and joint.length:
            # both ends of a slider press: their moment is the torque, and that of their friction
            half, height = 0.5 * number("length"), 0.5 * number("height")
            press = press + (np.abs(one.torque) + height * np.abs(along)) / half
        if number("viscous"):
            return None
        return "force", along, max(number("friction"), number("static")) * press
    return None


def _loads(system: System, run: Solution) -> tuple[Array, list[str]]:
    """All loads on the bodies (instants, bodies, 3), and names of those taken from our result."""
    loads, names = system.mechanism.loads, [body.name for body in system.mechanism.bodies]
    mass = reading(system).masses[:, 0]
    found = np.zeros((len(run), len(names), 3))
    adopted = [
        one.name
        for one in loads
        if not has_force_law(one) and (type(one) is not Gravity or follows_formula(one))
    ]
    for k in range(len(run)):
        t = float(run.t[k])
        found[k, :, :2] = mass[:, None] * gravity_of(system, t)
        poses: dict[str, Any] = {"ground": BodyState(np.zeros(2), 0.0, np.zeros(3))}
        for name in names:
            one = run[name]
            place = np.array([one.x[k], one.y[k]])
            rates = np.array([one.vx[k], one.vy[k], one.omega[k]])
            poses[name] = BodyState(place, float(one.angle[k]), rates)
        for load in loads:
            if has_force_law(load):
                for body, wrench in wrenches(system, load, poses, t).items():
                    found[k, names.index(body)] += wrench
        if adopted:
            whole = each_load_of(run, k)
            for n, load in enumerate(loads):
                if load.name in adopted:
                    found[k] += whole[n]
    return found, adopted


def _passed_in_a_step(run: Solution) -> Array:
    """How far bodies are, at most, from where they were when contacts of a step with impulses acted
    on them (instants,): half a step of two bodies, and the overlap of their shapes.
    """
    stepped = run.stepped
    if stepped is None or run.restart is None:
        return np.zeros(len(run))
    speed = np.max([np.hypot(run[name].vx, run[name].vy) for name in run], axis=0)
    overlap = [
        float(np.max(-stepped.numbers[low:high, 6], initial=0.0))
        for low, high in itertools.pairwise(stepped.first)
    ]
    passed: Array = run.restart.settings.step * speed + np.array(overlap)
    return passed


def _joints(system: System, run: Solution, pose: Array) -> tuple[Array, Array]:
    """Forces of joints, couplings and drivers on the bodies (instants, bodies, 3), and the greatest
    of them at every instant.
    """
    index = system.bodies
    found, size = np.zeros(pose.shape), np.zeros(len(run))

    def act(element: Any, force: Array, torque: Array, place: Any) -> None:
        for body, sign in ((element.bodies[1], 1.0), (element.bodies[0], -1.0)):
            if body == "ground":
                continue
            b = index[body]
            dx, dy = place[0] - pose[:, b, 0], place[1] - pose[:, b, 1]
            found[:, b, 0] += sign * force[0]
            found[:, b, 1] += sign * force[1]
            found[:, b, 2] += sign * (torque + dx * force[1] - dy * force[0])
        size[:] = np.maximum(size, np.hypot(*force))

    # of a motion over time contacts are in the place of joints that can separate
    moving = run.analysis == "simulate"
    for joint in system.mechanism.joints:
        if moving and joint.can_separate:
            continue
        one = run.reaction(joint.name)
        place = run.reaction_point(joint.name)
        act(joint, np.array([one.fx, one.fy]), one.torque, place)
    for driver in system.independent_drivers:
        fx, fy, torque = driven(run, driver.name).T
        ahead = "j" in driver.places()
        place = (
            run.reaction_point(driver.name) if ahead else (np.zeros(len(run)), np.zeros(len(run)))
        )
        act(driver, np.array([fx, fy]), torque, place)
    for contact in acting_contacts(run):
        one, body = run.reaction(contact.name), contact.bodies[1]
        # its torque is about the mass centre of j
        centre = (0.0, 0.0) if body == "ground" else (run[body].x, run[body].y)
        act(contact, np.array([one.fx, one.fy]), one.torque, centre)
    for element, _ in acting_on_several(run):
        for k in range(len(run)):
            found[k] += coupled(run, element.name, k)[: pose.shape[1]]
    return found, size


def _laws(system: System, run: Solution, comparison: Comparison) -> None:
    """Compare angle, rate and acceleration of driven bodies with the laws."""
    parts = (("angle", 1.0), ("omega", 0.0), ("alpha", 0.0))
    for driver in system.drivers:
        by_law = laws_of(system, run, driver)
        if by_law is None or not isinstance(driver, AngleDriver):
            continue
        body, base = run[driver.body], run[driver.relative_to]
        for n, (key, least) in enumerate(parts[: 1 if run.analysis == "statics" else 3]):
            kind = f"driven {key}"
            comparison.size(kind, np.append(by_law[n], least))
            if comparison.sizes[kind] > 0.0:
                ours = getattr(body, key) - getattr(base, key)
                comparison.add(kind, f"{driver.name}: {key} by its law", ours, by_law[n])


def _meshing(system: System, run: Solution, comparison: Comparison) -> None:
    """Rate and acceleration of constraints of gears, racks, wheels, cams, couplings: both are 0."""
    if run.analysis == "statics":
        return
    machine = system.mechanism
    moving = run.analysis == "simulate"  # in which joints that can separate do
    joints = [
        joint
        for joint in machine.joints
        if isinstance(joint, MESHING) and not (moving and joint.can_separate)
    ]
    for element in (*joints, *machine.couplings):
        for n, (first, second, *sizes) in enumerate(constraint_rates(system, run, element)):
            for key, part, size in (("rate", first, sizes[0]), ("acceleration", second, sizes[1])):
                kind = f"{element.name} {key}"
                comparison.size(kind, size)
                if comparison.sizes[kind] > 0.0:
                    name = f"{element.name}: {key} of row {n}"
                    comparison.add(kind, name, np.zeros(len(run)), part)


def _power(
    system: System, run: Solution, forces: tuple[Array, Array], rates: Array, comparison: Comparison
) -> None:
    """Power of loads, inertia and drivers: their sum is 0, since ideal joints do no work."""
    loads, inertia = forces
    terms = (loads - inertia) * rates
    given = [run.measure(f"{d.name}.power") for d in system.drivers]
    whole = terms.sum(axis=(1, 2)) + sum(given, np.zeros(len(run)))
    for one in forces:  # where a body is free, one is the other to rounding
        comparison.size("power", one * rates)
    for part in given:
        comparison.size("power", part)
    for loss in run.losses.values():
        whole -= loss
        comparison.size("power", loss)
    if not comparison.sizes["power"] > 0.0:
        return
    # what is slower than this part of the speed that its forces would give it is at rest
    units = np.array([1.0, 1.0, system.length])
    top = float(np.abs(loads / units).max(initial=0.0))
    whole_mass = float(system.mass[: system.coordinates : 3].sum())
    if whole_mass > 0.0:
        comparison.size(
            "power", RATE_NONE_MECHANISM * top * np.sqrt(top * system.length / whole_mass)
        )
    comparison.add("power", "power", np.zeros(len(run)), whole)
