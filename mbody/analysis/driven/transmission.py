"""The verb `transmission`: how well a force comes through, from a driver to an output.

With the output load alone in balance with the driver, at rest and without weights, F is the force
in the joint that drives the output body and v the velocity of its place on that body. The
transmission angle is μ = arcsin |F·v|/(|F||v|), the pressure angle 90° − μ. Of a rocker that is the
angle between coupler and rocker, of a slider the angle between the rod and the normal of its guide,
of a cam follower the angle of the contact normal: the textbooks' angles, by one definition.

Contacts that are closed are joints, at every instant of a motion of `simulate` those that are
closed then; a place of contact is the centre of the pin or roller that touches, through which the
force goes. So a Geneva's wheel has the velocity ratio of its slot while the pin is in it, 0 while
the lock holds it, and none where it is loose.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from mbody.analysis.contact.closed_contacts import ContactPhase, contact_phases
from mbody.analysis.driven.driven import kinematics
from mbody.core.presentation import Presented
from mbody.core.tolerances import CHANGE_POINT_LENGTHS, LEAST_SQUARES_RANK, RATE_NONE_COORDINATE
from mbody.errors import ModelError, SolveError, brief
from mbody.model.contact import Contact, joined
from mbody.model.driver import Driver
from mbody.model.element import listed, unknown_name
from mbody.model.joints import CamFollower
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import ColumnTable, Sentence, Value, in_units
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import moved, one_design
from mbody.solution.known_forces import not_unique
from mbody.solution.solution import Solution, as_solution
from mbody.system.rank import dense, rank_of
from mbody.system.system import System

# -- Grashof's class of four-bar loops, in words -----------------------------------------------


def grashof_class(ground: float, crank: float, coupler: float, rocker: float) -> str:
    """The class of a four-bar by the lengths of its fixed link, its driven link, the coupler and
    the output link.

    Shortest and longest link together shorter than the other two: some link turns all the way round
    (Grashof 1883); which one is fixed decides the inversion.

    >>> grashof_class(3.5, 1, 3, 2)
    'Grashof: crank-rocker'
    >>> grashof_class(8, 6, 18, 12)
    'not Grashof: triple rocker'
    """
    word = inversion(ground, crank, coupler, rocker)
    return f"{'not Grashof' if word == 'triple rocker' else 'Grashof'}: {word}"


def inversion(ground: float, crank: float, coupler: float, rocker: float) -> str:
    """The word of that class alone.

    >>> inversion(4, 1, 3, 3.5), inversion(1, 3, 3, 3.5)
    ('crank-rocker', 'double crank')
    """
    lengths = sorted((ground, crank, coupler, rocker))
    short, long = lengths[0] + lengths[3], lengths[1] + lengths[2]
    if abs(short - long) <= CHANGE_POINT_LENGTHS * (short + long):
        return "change point"
    if short > long:
        return "triple rocker"
    kinds = {ground: "double crank", coupler: "double rocker", rocker: "rocker-crank"}
    return ({crank: "crank-rocker"} | kinds)[lengths[0]]


def four_bar_loops(system: System) -> list[tuple[str, str]]:
    """Loops of four pins of one design, by their four links, and Grashof's class of each.

    The fixed link is the ground where it is among them, else the first; then the link that a driver
    turns, else the first of the description.
    """
    pins: dict[frozenset[str], list[tuple[str, complex, str, complex]]] = {}
    for joint in system.mechanism.joints:
        if joint.pin:
            ends = [complex(*map(float, system.numbers.place(joint, side))) for side in "ij"]
            entry = joint.i.body, ends[0], joint.j.body, ends[1]
            pins.setdefault(frozenset(joint.bodies), []).append(entry)
    bodies = ["ground", *(body.name for body in system.mechanism.bodies)]
    driven = {driver.bodies[1] for driver in system.drivers}
    order = sorted(bodies[1:], key=lambda name: name not in driven)
    found, seen = [], set()
    for fixed in bodies:
        for first, last in combinations(order, 2):
            for middle in order:
                links = fixed, first, middle, last
                sides = [frozenset((links[k], links[(k + 1) % 4])) for k in range(4)]
                if len(set(links)) < 4 or frozenset(links) in seen:
                    continue
                if not all(side in pins for side in sides):
                    continue
                places = [
                    dict(zip((one[0], one[2]), (one[1], one[3]), strict=True))
                    for one in (pins[side][0] for side in sides)
                ]
                lengths = [abs(places[k][links[k]] - places[k - 1][links[k]]) for k in range(4)]
                if min(lengths) > 0.0:
                    seen.add(frozenset(links))
                    words = grashof_class(lengths[0], lengths[1], lengths[2], lengths[3])
                    found.append((listed(links), words))
    return found


# -- The force that goes through a mechanism from a driver to an output, instant by instant ----

Array = np.ndarray

#: Instants at which it is looked for what carries a force.
LOOKED = 8


@dataclass(frozen=True)
class Transferred:
    """Transmission angle, ratio and index at one instant.

    `by`: The joint or contact whose force it is; empty where none has any.
    `angle`: μ [rad].
    `ratio`, `advantage`: ẏ/ẋ and ẋ/ẏ.
    `index`: Joint force index.
    """

    by: str
    angle: float
    ratio: float
    advantage: float
    index: float


#: Where nothing drives the output, or more than one motion is left.
NOTHING = Transferred("", math.nan, math.nan, math.nan, math.nan)


class ForcePath:
    """How a driver drives an output over a result.

    `run`: Of one design; of `simulate` with the contacts that are closed at each instant.
    `body`, `point`: The output, and its point or "".
    `joint`: The joint, contact or group of contacts that drives it; None to find it.

    `names`: Joints and contacts that may drive the output: one joint, or contacts of two bodies.
    """

    def __init__(
        self, run: Solution, driver: Driver, body: str, point: str, joint: str | None
    ) -> None:
        self.run, self.body, self.output = run, body, (driver, body, point)
        self.phases, self.phase_at = self._phases(touching=False)
        self.names = self._transmitters() if joint is None else self._named_transmitters(joint)

    def at(self, k: int) -> Transferred:
        """Transmission angle, ratio and index at instant k."""
        found = self.phase_at[k].at(k, self.names)
        # what stands by friction lies against its lock without a force
        return self.touching_at[k].at(k, self.names) if found is NOTHING else found

    @cached_property
    def touching_at(self) -> dict[int, _Phase]:
        """The phases of all instants with what touches without a force, too."""
        return self._phases(touching=True)[1]

    def _phases(self, *, touching: bool) -> tuple[list[_Phase], dict[int, _Phase]]:
        """Phases, and that of each instant."""
        every = contact_phases(self.run, touching=touching)
        phases = [_Phase(self.run, one, *self.output) for one in every]
        return phases, {int(k): phase for phase in phases for k in phase.instants}

    @property
    def turns(self) -> bool:
        """Whether the output is an angle."""
        return self.phases[0].rotates

    def _candidates(self) -> dict[str, tuple[str, ...]]:
        """The bodies of the joints of the output body, and of contacts that are ever closed."""
        found: dict[str, tuple[str, ...]] = {}
        for phase in self.phases:
            for one in joined(phase.system.mechanism):
                if self.body in one.bodies:
                    found[one.name] = tuple(one.bodies)
        return found

    def _named_transmitters(self, name: str) -> tuple[str, ...]:
        machine, found = self.run.mechanism, self._candidates()
        contacts = [one for one in machine.contacts if self.body in one.bodies]
        own = [one.name for one in contacts if one.name == name]
        own += [one.name for one in machine.contacts_of(name) if self.body in one.bodies]
        if name in found:
            return (name,)
        if own:
            return tuple(own)
        known = listed([*found, *(one.name for one in contacts if one.name not in found)])
        raise ModelError(f"{brief(name)} is no joint of '{self.body}' ({known})", name)

    def _transmitters(self) -> tuple[str, ...]:
        found = self._candidates()
        if not found:
            raise ModelError(
                f"'{self.body}' has no joint: the transmission angle is of the force in one",
                self.body,
            )
        moving = [name for name, bodies in found.items() if "ground" not in bodies]
        loaded = [name for name in moving if any(p.carries(name) for p in self.phases)]
        contacts = {one.name for one in self.run.mechanism.contacts}
        pairs = {frozenset(found[name]) for name in loaded}
        if len(loaded) == 1 or (loaded and len(pairs) == 1 and contacts.issuperset(loaded)):
            return tuple(loaded)
        if loaded:
            raise ModelError(
                f"{listed(loaded)} drive '{self.body}': name the joint of which you want the "
                "transmission angle",
                self.body,
            )
        raise ModelError(
            f"no joint with a moving link drives '{self.body}', so there is no transmission "
            "angle: for the ratios alone name one of its joints as the joint "
            f"({listed(found)}){self._contact_remedy()}",
            self.body,
        )

    def _contact_remedy(self) -> str:
        """Advice where contacts drive the output that no instant of the result has closed."""
        contacts = [one for one in self.run.mechanism.contacts if self.body in one.bodies]
        if not contacts:
            return ""
        return (
            f"; contacts drive it ({listed((one.name for one in contacts), 4)}): take a result of "
            "simulate, which closes and opens them"
        )


@dataclass(frozen=True, eq=False)
class _Carrier:
    """A joint, or one place of a contact: its rows and where its force acts on the output."""

    name: str
    rows: list[int]
    place: Array


class _Phase:
    """Forces and velocities of one output while the same contacts are closed, without units."""

    def __init__(
        self, run: Solution, phase: ContactPhase, driver: Driver, body: str, point: str
    ) -> None:
        self.run, self.system, self.instants = run, phase.system, phase.instants
        self.n, self.body = self.system.coordinates, body
        self.first = 3 * self.system.bodies[body]
        self.point = f"{body}.{point}" if point else ""
        machine = self.system.mechanism
        self.elements = [one for one in joined(machine) if one.name not in phase.open]
        open_primitives = {e for name in phase.open for e in self.system.primitives_of[name]}
        primitive = self.system.row_table[0]
        #: Rows of the system that act, of which all numbers of rows are.
        self.kept = np.flatnonzero([e not in open_primitives for e in primitive])
        self.primitive = primitive[self.kept]
        names = [d.name for d in self.system.drivers]
        row = self.system.rows - len(names) + names.index(driver.name)
        self.row = int(np.flatnonzero(self.kept == row)[0])
        self.others = np.arange(len(self.kept)) != self.row
        self.unit = driver.unit(self.system.length)
        self.work = self.system.work()
        self.q = run.record.table(slice(None))[:, : self.n]
        self.rows_of = {
            one.name: self._rows(self.system.primitives_of[one.name]) for one in self.elements
        }
        self.rotates = not point and not self._keeps_direction()
        #: Whether contacts decide how many motions are left.
        self.decided = phase.system is not run.system or bool(phase.open)
        self._carriers: dict[str, list[_Carrier]] = {}

    def _rows(self, primitives: Any) -> list[int]:
        own = set(np.atleast_1d(np.asarray(primitives, dtype=int)).tolist())
        return [r for r, e in enumerate(self.primitive) if int(e) in own]

    def carriers(self, name: str) -> list[_Carrier]:
        """Reactions that may carry a force, of a joint or of the points of a contact; none where it
        is open.
        """
        if name not in self.rows_of:
            return []
        if name not in self._carriers:
            (one,) = (one for one in self.elements if one.name == name)
            self._carriers[name] = self._places(one)
        return self._carriers[name]

    def _places(self, one: Any) -> list[_Carrier]:
        if isinstance(one, Contact):
            own = self.system.primitives_of[one.name]
            candidates = one.candidates(self.system.numbers)
            return [
                _Carrier(one.name, self._rows(own[n]), self._centre(one, candidate))
                for n, candidate in enumerate(candidates)
            ]
        if one.role == "contact":  # a rope, a limit
            return []
        if isinstance(one, CamFollower) and one.roller:
            centre = self.run.point(one.j)
            x, y = centre.x, centre.y
        else:
            x, y = self.run.reaction_point(one.name)
        place = np.stack([np.atleast_1d(x), np.atleast_1d(y)], axis=1)
        return [_Carrier(one.name, self.rows_of[one.name], place)]

    def _centre(self, contact: Contact, candidate: Any) -> Array:
        """Of the circle or corner that touches an edge, of the smaller of two circles: the line of
        the force goes through it, as through the centre of a cam's roller.
        """
        first, second = contact.bodies[::-1] if candidate.swapped else contact.bodies
        tip = (second, float(candidate.position[0]), float(candidate.position[1]))
        if candidate.edge is None and candidate.contour is None:
            ri, rj = (abs(float(x)) for x in candidate.tangent.parameters[4:6])
            if ri < rj:
                x, y = (float(part) for part in candidate.normal.parameters[:2])
                tip = (first, x, y)
        return moved(self.run, tip)

    def _keeps_direction(self) -> bool:
        """Whether slides keep the output body parallel to the ground."""
        kept, before = {"ground"}, 0
        while len(kept) > before:
            before = len(kept)
            for joint in self.system.mechanism.joints:
                if joint.parallel and kept & set(joint.bodies):
                    kept |= set(joint.bodies)
        return self.body in kept

    def _jacobian(self, k: int) -> Array:
        self.work.q[: self.n, 0] = self.q[k]
        self.work.time[:] = self.run.t[k]
        return dense(self.system, self.work)[1][self.kept]

    def _motion(self, k: int) -> tuple[Array, Array | None]:
        """Φ_q, and the motion that the joints leave when the driver is released; None where
        contacts leave none, or more than one.
        """
        G = self._jacobian(k)
        if self.decided and rank_of(G[self.others]).free != 1:
            return G, None
        return G, np.linalg.svd(G[self.others])[2][-1]

    def carries(self, name: str) -> bool:
        """Whether a force goes through a joint or contact at any of some instants."""
        if name not in self.rows_of:
            return False
        some = self.instants[:: max(1, len(self.instants) // LOOKED)]
        for k in some.tolist():
            G, along = self._motion(k)
            if along is None:
                continue
            multipliers, _ = self._multipliers(G, self._load(k, along))
            force = self._force(G, multipliers, self.rows_of[name], self._side(name))
            if np.hypot(*force) > RATE_NONE_COORDINATE * self._most(G, multipliers):
                return True
        return False

    def _relative_position(self, k: int, place: Array) -> Array:
        return np.asarray(place - self.q[k, self.first : self.first + 2])

    def _velocity(self, along: Array, relative: Array) -> Array:
        """Velocity of a place of the output body, by the model length."""
        x, y, rotation = along[self.first : self.first + 3]
        a = relative / self.system.length
        return np.array([x - rotation * a[1], y + rotation * a[0]])

    def _output(self, k: int, along: Array) -> tuple[Array, float, Array]:
        """Position of loaded point from the mass centre, rate of the output and its direction."""
        relative = np.zeros(2)
        if self.point:
            px, py = self.system.numbers.point(self.point)
            cx, cy = self.system.numbers.point(f"{self.body}.cg")
            c, s = math.cos(self.q[k, self.first + 2]), math.sin(self.q[k, self.first + 2])
            px, py = float(px - cx), float(py - cy)
            relative = np.array([c * px - s * py, s * px + c * py])
        v = self._velocity(along, relative)
        speed = float(np.hypot(*v))
        return relative, speed, v / speed if speed > RATE_NONE_COORDINATE else np.zeros(2)

    def _load(self, k: int, along: Array) -> Array:
        """A unit load on the output, as coordinates have it without units."""
        Q = np.zeros(self.n)
        if self.rotates:
            Q[self.first + 2] = 1.0
            return Q
        relative, _, u = self._output(k, along)
        a = relative / self.system.length
        Q[self.first : self.first + 3] = u[0], u[1], a[0] * u[1] - a[1] * u[0]
        return Q

    def _multipliers(self, G: Array, Q: Array) -> tuple[Array, float]:
        """(λ, w) with Gᵀ λ + w Q = 0: multipliers and how much load goes with them."""
        if len(G) == self.n:
            both = np.concatenate([G.T, Q[:, None]], axis=1)
            null = np.linalg.svd(both)[2][-1]
            return null[:-1], float(null[-1])
        return np.linalg.lstsq(G.T, -Q, rcond=LEAST_SQUARES_RANK)[0], 1.0

    def _side(self, name: str) -> str:
        """The body on which the force of a joint or contact is taken: the output, or its j."""
        (one,) = (one for one in self.elements if one.name == name)
        side = self.body if self.body in one.bodies else one.bodies[1]
        return str(one.bodies[0] if side == "ground" else side)

    def _force(self, G: Array, multipliers: Array, rows: list[int], body: str) -> Array:
        first = 3 * self.system.bodies[body]
        return np.asarray(multipliers[rows] @ G[rows, first : first + 2])

    def _most(self, G: Array, multipliers: Array) -> float:
        """The greatest force in any joint or contact."""
        return max(
            float(np.hypot(*self._force(G, multipliers, rows, self._side(name))))
            for name, rows in self.rows_of.items()
        )

    def at(self, k: int, names: tuple[str, ...]) -> Transferred:
        """Transmission at instant k, by the joint or contact of `names` that carries the greatest
        force.
        """
        G, along = self._motion(k)
        if along is None:
            return NOTHING
        multipliers, load = self._multipliers(G, self._load(k, along))
        most = self._most(G, multipliers)
        angle, by, size = math.nan, "", RATE_NONE_COORDINATE * most
        for one in (one for name in names for one in self.carriers(name)):
            F = self._force(G, multipliers, one.rows, self.body)
            if float(np.hypot(*F)) <= size:
                continue
            by, size = one.name, float(np.hypot(*F))
            v = self._velocity(along, self._relative_position(k, one.place[k]))
            angle = math.nan
            if np.hypot(*v) > RATE_NONE_COORDINATE:
                angle = math.asin(min(1.0, abs(float(F @ v)) / (size * float(np.hypot(*v)))))
        x = float(G[self.row] @ along) * self.unit
        y = float(along[self.first + 2])
        if not self.rotates:  # along a path: of no direction
            x, y = abs(x), self._output(k, along)[1] * self.system.length
        y = y if abs(y) > RATE_NONE_COORDINATE * self.system.length else 0.0
        ratio = (
            y / x if abs(x) > RATE_NONE_COORDINATE * self.unit else math.copysign(math.inf, x * y)
        )
        advantage = x / y if y else math.copysign(math.inf, x * y)
        scale = self.system.length if self.rotates else 1.0
        index = most / (abs(load) * scale) if abs(load) > RATE_NONE_COORDINATE * most else math.inf
        if not y and not self.rotates:  # the load has no direction
            index = math.nan
        return Transferred(by, angle, ratio, advantage, index)


#: A greatest value is searched between instants on finer grids, and places of each.
ZOOMS, GRID = 6, 21


@dataclass(frozen=True)
class LeastAngle:
    """The least transmission angle and where it is.

    `value`: [rad].
    `driver`: Value of the driver there [rad or length].
    `t`: Time of the nearest instant.
    """

    value: float
    driver: float
    t: float | None


def _least_dimensions(found: Transmission) -> dict[str, str]:
    return {"value": "angle", "driver": found.driver_dimension, "t": "time"}


def _least_sentence(found: Transmission) -> str:
    """Where the least angle is."""
    if found.least is None:
        return ""
    x, unit = in_units(found.mechanism.shown, found.driver_dimension, found.least.driver)
    return (
        f"least transmission angle {math.degrees(found.least.value):.3f}° at '{found.joint}', "
        f"where '{found.driver}' = {x:.6g} {unit}"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Transmission(Inherited, Presented):
    """From a driver to an output at every instant; ``print`` shows it.

    `driver`, `output`, `joint`: The joint is the one that drives the output body, or the contacts
      that do so one after the other, with commas.
    `t` (instants,)
    `driver_value`: [rad or length].
    `angle`, `pressure_angle`: μ and 90° − μ [rad], 0 … π/2; NaN where the place stands still or no
      force goes through it.
    `velocity_ratio`: ẏ/ẋ of the output and the driver, of a path its size; infinite at a dead
      centre of the driver; NaN, as all else, where the contacts that are closed do not make the
      output follow.
    `mechanical_advantage`: ẋ/ẏ: output load by effort without losses; infinite where the output
      stands still.
    `joint_force_index`: Greatest force in any joint by the output load (Holte and Chase 1994);
      infinite at a dead centre of the driver, NaN where a path has no direction; of a torque in
      1/length.
    `least`: Of all instants, and between them; None where μ is nowhere defined.
    `loops` (str, str): Four-bar loops and Grashof's class of each.
    """

    mechanism: Mechanism = field(repr=False)
    driver: str
    output: str
    joint: str
    t: Array = field(repr=False)
    driver_value: Array = field(repr=False)
    angle: Array = field(repr=False)
    pressure_angle: Array = field(repr=False)
    velocity_ratio: Array = field(repr=False)
    mechanical_advantage: Array = field(repr=False)
    joint_force_index: Array = field(repr=False)
    least: LeastAngle | None
    loops: tuple[tuple[str, str], ...] = ()

    analysis_name = "transmission"
    about_text = "transmission from '{0.driver}' to '{0.output}'"
    angle_unit = "deg"
    declared = (
        "driver output joint",
        Value("t", "", "time"),
        Value("least", "", _least_dimensions, lambda found: found.least and vars(found.least)),
        Value("grashof", value=lambda found: [{"loop": k, "class": c} for k, c in found.loops]),
        Sentence(_least_sentence),
        Sentence(lambda found: [f"four-bar {loop}: {kind}" for loop, kind in found.loops]),
        ColumnTable(
            (
                Value("driver_value", "{0.driver}", lambda found: found.driver_dimension),
                Value("transmission_angle", "transmission angle", "angle", "angle"),
                Value("pressure_angle", "pressure angle", "angle"),
                Value("velocity_ratio", "velocity ratio"),
                Value("mechanical_advantage", "mech. advantage"),
                Value("joint_force_index", "joint force index"),
            )
        ),
    )

    @property
    def driver_dimension(self) -> str:
        """What the driver gives."""
        return "angle" if self.angular else "length"

    def __len__(self) -> int:
        return len(self.t)

    @property
    def angular(self) -> bool:
        """Whether the driver drives an angle."""
        return any(d.angular for d in self.mechanism.drivers if d.name == self.driver)


def transmission(
    run: Solution, driver: str | None = None, output: str = "", joint: str | None = None
) -> Transmission:
    """Transmission angle, pressure angle, mechanical advantage, velocity ratio and joint force
    index of any mechanism, at every instant of a result.

    Parameters
    ----------
    run : Solution
        Of a driven mechanism, such as ``mbody.kinematics(machine, turn=True)``; of `simulate` where
        contacts drive that open and close, as of a Geneva.
    driver : str, optional
        Name of the driver, or of its body; where there is one driver, that one.
    output : str
        The output body: its angle, loaded by a torque, where it turns, else the path of its mass
        centre; or one of its points, as ``"coupler.P"``, loaded along its path.
    joint : str, optional
        The joint, contact or group of contacts that drives the output body, where several could.

    Returns
    -------
    Transmission

    Raises
    ------
    ModelError
        For names that there are not, and where the joint must be named.

    Notes
    -----
    Forces follow from Φ_qᵀ λ = −Q with the output load Q alone; where joints are redundant they
    are those of least norm. Source: J. E. Holte, T. R. Chase, *A force transmission index for
    planar linkage mechanisms*, ASME DETC 1994.

    Examples
    --------
    The crank-rocker's least angle is where the crank lies on the ground line, here where it points
    away from the rocker, |cos μ| = |b² + c² − (d + a)²|/(2 b c):

    >>> import mbody
    >>> import numpy as np
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True, instants=37)
    >>> found = mbody.transmission(run, output="rocker")
    >>> found.joint, round(float(np.degrees(found.least.value)), 6)
    ('B', 52.8311)
    """
    run = as_solution(run)
    one_design(run, "transmission is of one design")
    input_driver = _driver(run, driver)
    output_body, _, point = output.partition(".")
    names = [body.name for body in run.mechanism.bodies]
    if output_body not in names:
        raise unknown_name("body", output, names, use=" to be the output")
    if point and not run.system.numbers.has_point(output):
        raise ModelError(f"'{output_body}' has no point {brief(point)}", output)
    path = ForcePath(run, input_driver, output_body, point, joint)
    found = [path.at(k) for k in range(len(run))]
    angle = np.array([one.angle for one in found])
    ratio = np.array([one.ratio for one in found])
    carried = dict.fromkeys(one.by for one in found if math.isfinite(one.angle))
    through = ", ".join(carried or path.names)
    x = np.asarray(run.driven(input_driver.name)[0], dtype=float)
    least = _least(run, input_driver, output, joint, angle, x)
    notes = []
    if not np.isfinite(angle).any():
        notes.append(_undefined(through, output_body))
    repeated = [name for name, parts in (run.dependencies or {}).items() if any(parts)]
    if repeated:
        notes.append(not_unique(repeated, "joint_force_index"))
    loose = np.isnan(ratio)
    if loose.any():
        notes.append(
            f"at {int(loose.sum())} of {len(run)} instants no closed contact makes '{output_body}' "
            f"follow '{input_driver.name}': there is no ratio there"
        )
    return Transmission(
        mechanism=run.mechanism,
        driver=input_driver.name,
        output=output,
        joint=through,
        t=np.array(run.t),
        driver_value=x,
        angle=angle,
        pressure_angle=0.5 * math.pi - angle,
        velocity_ratio=ratio,
        mechanical_advantage=np.array([one.advantage for one in found]),
        joint_force_index=np.array([one.index for one in found]),
        least=least,
        loops=tuple(four_bar_loops(run.system)),
        **inherited(run, notes=notes),
    )


def _undefined(joint: str, body: str) -> str:
    return (
        f"the transmission angle is undefined: the place of '{joint}' on '{body}' "
        "stands still, or no force goes through it"
    )


def _driver(run: Solution, name: str | None) -> Driver:
    independent = run.system.independent_drivers
    known = listed(d.name for d in independent) or "none"
    if name is None and len(independent) == 1:
        return independent[0]
    for one in independent:
        if name in (one.name, getattr(one, "body", None)):
            return one
    if name is None:
        raise ModelError(
            f"'{run.mechanism.name}' has {len(independent)} drivers ({known}): name the one from "
            "which the motion is transmitted"
        )
    raise ModelError(f"there is no driver {brief(name)} (there are: {known})", name)


def _least(
    run: Solution, driver: Driver, output: str, joint: str | None, angle: Array, x: Array
) -> LeastAngle | None:
    """The least μ of the instants, then between those on either side of it."""
    if not np.isfinite(angle).any():
        return None
    k = int(np.nanargmin(angle))
    best = LeastAngle(float(angle[k]), float(x[k]), float(run.t[k]))
    if run.analysis == "simulate":
        return best
    point = output.partition(".")

    def less(finer: Solution, values: Array) -> tuple[Array, Array]:
        path = ForcePath(finer, driver, point[0], point[2], joint)
        return -np.array([path.at(n).angle for n in range(GRID)]), values

    for value, place in greatest_between(run, x, k, less):
        if -value <= best.value:
            best = LeastAngle(-value, place, best.t)
    return best


def greatest_between(
    run: Solution, x: Array, k: int, look: Callable[[Solution, Array], tuple[Array, Array]]
) -> Iterator[tuple[float, float]]:
    """Greatest values on finer and finer grids between the instants on either side of the k-th, and
    where; of motions by one driver that goes one way. `x`: Its values. `look`: From a motion and
    its driver's values to values and places.
    """
    steps, independent = np.diff(x), run.system.independent_drivers
    one_way = len(x) > 2 and ((steps > 0.0).all() or (steps < 0.0).all())
    if len(independent) != 1 or not one_way:
        return
    low, high, pose = float(x[max(k - 1, 0)]), float(x[min(k + 1, len(x) - 1)]), pose_at(run, k)
    for _ in range(ZOOMS):
        values = np.linspace(low, high, GRID)
        try:
            finer = kinematics(run.system, drive={independent[0].name: values}, guess=pose)
        except SolveError:
            return
        found, where = look(finer, values)
        if not np.isfinite(found).any():
            return
        n = int(np.nanargmax(found))
        yield float(found[n]), float(where[n])
        low, high = float(values[max(n - 1, 0)]), float(values[min(n + 1, GRID - 1)])
        pose = pose_at(finer, max(n - 1, 0))


def pose_at(run: Solution, k: int) -> dict[str, tuple[float, float, float]]:
    """(x, y, angle) of the link axes of every body at one instant of one design: a guess.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), [0.0])
    >>> print(*np.round(pose_at(run, 0)["crank"], 6))
    0.0 0.0 1.047198
    """
    found = {}
    for body in run.mechanism.bodies:
        one = run[body.name]
        pose = (float(values[k]) for values in (one.x, one.y, one.angle))
        found[body.name] = run.system.numbers.link_axes(body.name, *pose)
    return found
