"""Outlines as arrays (points, 2): pure geometry, in any unit of length."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.dead_centres import driver_range
from mbody.analysis.driven.driven import analyse_system_at, dimension_of_instants, kinetostatics
from mbody.analysis.dynamics.simulate import simulate
from mbody.core.tolerances import DRAWN_OUTLINE, TINY
from mbody.errors import ModelError, SolveError
from mbody.laws import MeasuredFormula
from mbody.model.joint_limits import JointContact
from mbody.model.joints import Joint, Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.simulation import Instants
from mbody.model.touching_shapes import middles_of_arcs
from mbody.solution.histories import Place, moved, reaction_point, whole_instant
from mbody.solution.measures import formula_history
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.model.driver import Driver
    from mbody.model.element import Element
    from mbody.solution.histories import BodyHistory, PointHistory


# -- One instant of a solution for drawings: places, directions, numbers -----------------------

# -- Carriers of shapes: a body, a point that keeps a direction, the line of two points --------
# A shape is kept in the axes of its carrier, so that the motion of the carriers is the motion of
# the picture.

Array = np.ndarray


@dataclass(frozen=True)
class Carrier:
    """Axes that shapes are kept in.

    `start`: Origin of the axes.
    `rotates_with`: The body whose angle the axes have; "" where they point from `start` to `end`.
    `end`: Of what reaches from one place to another.
    `stretches`: Whether the shapes become longer with the distance, as a spring: a point has then
      three numbers, the part of the distance, and how far along and across the line from there.
    `lead`: Length at both ends that does not stretch.
    """

    start: Place = ("ground", 0.0, 0.0)
    rotates_with: str = "ground"
    end: Place | None = None
    stretches: bool = False
    lead: float = 0.0

    def kept(self, points: Array, pose: Pose) -> Array:
        """World points (n, 2) of an instant in these axes: (n, 2), or (n, 3) of what stretches."""
        origin, u, length = (part[pose.k] for part in pose.axes(self))
        away = points - origin
        along, across = away @ u, away @ np.array([-u[1], u[0]])
        if not self.stretches:
            return np.array([along, across]).T
        part = (along - self.lead) / max(float(length) - 2.0 * self.lead, TINY)
        part = np.clip(part, 0.0, 1.0)
        return np.column_stack([part, along - part * length, across])

    def in_world(self, kept: Array, axes: tuple[Array, Array, Array], k: int) -> Array:
        """World points (n, 2) of an instant, of points in these axes."""
        origin, u, length = (part[k] for part in axes)
        along, across = kept[:, -2], kept[:, -1]
        if self.stretches:
            along = along + kept[:, 0] * length
        return np.asarray(origin + np.outer(along, u) + np.outer(across, (-u[1], u[0])))

    def axes(self, run: Any) -> tuple[Array, Array, Array]:
        """Origin (instants, 2), direction (instants, 2) and length (instants,) of the axes."""
        origin = moved(run, self.start)
        if self.end is None:
            angle = run[self.rotates_with].angle
            return origin, np.column_stack([np.cos(angle), np.sin(angle)]), np.ones(len(run))
        separation = moved(run, self.end) - origin
        length = np.hypot(*separation.T)
        return origin, separation / np.maximum(length, TINY)[:, None], length


GROUND_CARRIER = Carrier()


def on(body: str) -> Carrier:
    """The axes of a body."""
    return Carrier((body, 0.0, 0.0), body)


def placed(place: Place, rotates_with: str = "ground") -> Carrier:
    """Axes at a place of one body with the angle of another."""
    return Carrier(place, rotates_with)


def between(start: Place, end: Place, *, stretches: bool = True, lead: float = 0.0) -> Carrier:
    """The line from one place to another."""
    return Carrier(start, "", end, stretches, lead)


class Pose:
    """Places and angles at one instant."""

    def __init__(self, run: Solution, instant: int) -> None:
        self.run, self.k = run, whole_instant(run, instant)
        self.mechanism, self.system = run.mechanism, run.system
        self._bodies: dict[str, BodyHistory] = {}
        self._axes: dict[Carrier, tuple[Array, Array, Array]] = {}
        self.t = float(run.t[self.k])

    @functools.cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints; those that can separate are contacts of the system of a motion."""
        parted = [
            one.joint
            for one in self.mechanism.contacts
            if isinstance(one, JointContact) and one.name == one.joint.name
        ]
        return (*self.mechanism.joints, *parted)

    @functools.cached_property
    def joint_places(self) -> Array:
        """The places of all joints on both their bodies (places, 2), from the left to the right."""
        found = [self.place(joint, side) for joint in self.joints for side in "ij"]
        places = np.array(found).reshape(-1, 2)
        return np.asarray(places[np.argsort(places[:, 0], kind="stable")])

    def at_joint(self, place: Array, clearance: float) -> bool:
        """Whether a place is nearer to that of a joint than `clearance`."""
        ends = np.searchsorted(
            self.joint_places[:, 0], [place[0] - clearance, place[0] + clearance]
        )
        offsets = self.joint_places[slice(*ends.tolist())] - place
        return bool((np.hypot(offsets[:, 0], offsets[:, 1]) < clearance).any())

    def centre(self, body: str) -> Array:
        """The mass centre of a body."""
        history = self.body(body)
        return np.array([history.x[self.k], history.y[self.k]])

    def angle(self, body: str) -> float:
        """The angle of a body's x axis [rad]."""
        return float(self.body(body).angle[self.k])

    def body(self, name: str) -> BodyHistory:
        """The motion of a body, read from the run once."""
        if name not in self._bodies:
            self._bodies[name] = self.run[name]
        return self._bodies[name]

    def axes(self, carrier: Carrier) -> tuple[Array, Array, Array]:
        """The axes of a carrier over the run, read once."""
        if carrier not in self._axes:
            self._axes[carrier] = carrier.axes(self.run)
        return self._axes[carrier]

    def track(self, element: Element, field: str) -> Array:
        """Places (instants, 2) of an element's marker over the whole run."""
        body = self.body(element.places()[field].body)
        x, y = self.system.numbers.arm(element, field)
        c, s = np.cos(body.angle), np.sin(body.angle)
        return np.column_stack([body.x + c * x - s * y, body.y + s * x + c * y])

    def place(self, element: Element, field: str) -> Array:
        """The place of an element's marker."""
        return self._world_point(
            element.place(field).body, *self.system.numbers.arm(element, field)
        )

    def _world_point(self, name: str, x: Any, y: Any) -> Array:
        """A place (x, y) from the mass centre of a body, in its axes."""
        body, k = self.body(name), self.k
        angle = float(body.angle[k])
        c, s = math.cos(angle), math.sin(angle)
        return np.array([body.x[k] + c * x - s * y, body.y[k] + s * x + c * y])

    def site(self, element: Element, field: str) -> Place:
        """The place of an element's marker on its body."""
        x, y = self.system.numbers.arm(element, field)
        return element.places()[field].body, float(x), float(y)

    def fixed(self, body: str, place: Any) -> Place:
        """A place of this instant on a body."""
        x, y = on(body).kept(np.array([place]), self)[0]
        return body, float(x), float(y)

    def direction(self, element: Element, field: str) -> float:
        """The direction of a marker's x axis [rad]."""
        marker = element.places()[field]
        return self.angle(marker.body) + float(self.system.numbers.angle(element, field))

    def point(self, name: str) -> Array:
        """A named point, such as ``"coupler.P"``."""
        history: PointHistory = self.run.point(name)
        return np.array([history.x[self.k], history.y[self.k]])

    def number(self, element: Element, field: str) -> float:
        """A number of an element, with the values that the system has."""
        return float(self.system.values[f"{element.name}.{field}"])

    def law(self, element: Element, field: str) -> float:
        """The value of one of an element's laws of time, or of a formula of measured quantities."""
        law = getattr(element, field)
        if isinstance(law, MeasuredFormula):
            return float(formula_history(self.run, law, f"{element.name}.{field}")[self.k])
        return float(self.system.law_of(element, field).derivatives(self.t)[0])

    def rate(self, driver: str) -> float:
        """The rate of a driven coordinate."""
        return float(self.run.driven(driver)[1][self.k])

    def mass(self, body: str) -> float:
        """The mass of a body."""
        return float(self.system.mass[3 * self.system.bodies[body], 0])

    def reaction_point(self, joint: Joint) -> Array:
        """The reaction point of a joint: a point of contact, or the place on j."""
        return np.array([float(part[self.k]) for part in reaction_point(self.run, joint)])

    def pivot(self, by: str, body: str) -> Array:
        """The centre of rotation of a body: its pin on the other body, on the ground, any pin, or
        its mass centre.
        """
        pins = [joint for joint in self.joints if isinstance(joint, Revolute)]
        pins = [joint for joint in pins if body in (joint.i.body, joint.j.body)]
        for other in (by, "ground", ""):
            for joint in pins:
                if not other or other in (joint.i.body, joint.j.body):
                    return self.place(joint, "j")
        return self.centre(body)

    @functools.cached_property
    def joints_of(self) -> dict[str, list[Joint]]:
        """The joints of each body."""
        found: dict[str, list[Joint]] = {}
        for joint in self.joints:
            for body in {joint.i.body, joint.j.body}:
                found.setdefault(body, []).append(joint)
        return found

    @functools.cached_property
    def nodes(self) -> dict[str, list[Array]]:
        """Places on each body: of joints, drivers and loads, and its points."""
        found: dict[str, list[Array]] = {name: [] for name in self.system.bodies}
        for element in self.mechanism:
            for field, marker in element.places().items():
                found[marker.body].append(self.place(element, field))
        for body in self.mechanism.bodies:
            off = middles_of_arcs(body.shapes)
            at, centre = self.system.numbers.point, self.system.numbers.point(f"{body.name}.cg")
            for name in (one for one in body.points if one not in off):
                x, y = at(f"{body.name}.{name}")
                found[body.name].append(self._world_point(body.name, x - centre[0], y - centre[1]))
        return found

    @property
    def middle(self) -> Array:
        """The middle of all moving bodies' nodes."""
        names = [body.name for body in self.mechanism.bodies]
        places = [np.mean(self.nodes[n] or [self.centre(n)], axis=0) for n in names]
        return np.mean(places, axis=0) if places else np.zeros(2)


def heading(vector: Any) -> float:
    """The direction of a vector [rad]."""
    return math.atan2(vector[1], vector[0])


# -- The motion that a moving picture shows of a model: a turn, the requested instants, or free

# -- The cycle of a mechanism: the instants of plots and paths ---------------------------------

#: Instants of a smooth curve.
SMOOTH = 181


def one_way(run: Solution) -> tuple[Driver, np.ndarray] | None:
    """The one driver that moves, where it goes one way, and its values (instants,)."""
    values = [(driver, run.driven(driver.name)[0]) for driver in run.mechanism.drivers]
    moving = [(driver, value) for driver, value in values if np.ptp(value) > 0.0]
    if len(moving) != 1:
        return None
    steps = np.diff(moving[0][1])
    return moving[0] if np.all(steps > 0.0) or np.all(steps < 0.0) else None


def times(mechanism: Mechanism, ask: Instants | None) -> np.ndarray | None:
    """Times (instants,) between the first and the last requested; None for other instants."""
    return _smooth(mechanism, "t", ask.at["t"]) if ask and "t" in ask.at else None


def _smooth(mechanism: Mechanism, name: str, row: Sequence[Any]) -> np.ndarray | None:
    """The values of a row, with as many between them as a smooth curve needs."""
    if len(row) < 2:
        return None
    dimension = dimension_of_instants(mechanism, name)
    values = np.array([number_in(mechanism, value, dimension, "ask", name) for value in row])
    if len(values) >= SMOOTH:
        return values
    between = np.linspace(0.0, len(values) - 1.0, SMOOTH)
    return np.asarray(np.interp(between, np.arange(len(values)), values))


def cycle(mechanism: Mechanism, ask: Instants | None) -> Instants:
    """The instants of a plot: a turn, or between the requested times or places of a driver; a turn
    if one instant is requested.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> cycle(machine, Instants(at={"t": 0.0})).over
    'turn'
    >>> len(cycle(machine, Instants(at={"t": [0, 1]})).at["t"])
    181
    """
    if ask and len(ask.at) == 1:
        name, row = next(iter(ask.at.items()))
        smooth = _smooth(mechanism, name, row)
        if smooth is not None:
            return Instants(at={name: smooth.tolist()})
    if ask is None or (not ask.over and max(map(len, ask.at.values()), default=1) == 1):
        return Instants(over="turn")
    return ask


#: Instants of free motion between two of which nothing is missed on a screen: 60 a second for some
#: seconds, and more where the motion is longer.
FREE = 601
#: Part of the range of a driver that is left out at its ends, where a dead centre is singular.
SHORT = 0.01


def motion(
    model: Mechanism | System,
    wanted: Instants | None = None,
    to: Any = None,
    progress: Callable[[float], None] | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """The motion of a model that has not been analysed.

    >>> import mbody
    >>> len(motion(mbody.gallery.load("norton_fourbar")))
    361
    """
    system = model if isinstance(model, System) else assemble(model)
    mechanism = system.mechanism
    free = mechanism.simulation is not None or not mechanism.drivers
    if to is not None and not free:
        last = number_in(mechanism, to, "time", "view", "to")
        if not last > 0.0 or not math.isfinite(last):
            unit = mechanism.units.of("time")
            raise ModelError(
                f"the last time of a motion must be positive and finite, not {last:g} {unit}: "
                "give a later one"
            )
        try:
            return kinetostatics(
                system, t=np.linspace(0.0, last, 2 * SMOOTH - 1), assembly=assembly
            )
        except ModelError:
            free = True  # drivers leave a freedom: what is left moves by itself
    if free and wanted is None:
        if assembly is not None:
            raise ModelError(
                "an assembly mode is of driven analyses, and this is a free motion: leave it out, "
                "or choose instants"
            )
        return simulate(system, to, instants=FREE, progress=progress)
    if wanted is not mechanism.ask and wanted is not None:
        run = analyse_system_at(system, "kinetostatics", wanted, assembly)
        # requested positions are shown in the order in which the motion has them
        return run if np.all(np.diff(run.t) >= 0.0) else run.take(np.argsort(run.t, kind="stable"))
    try:
        ask = cycle(mechanism, mechanism.ask)
        return analyse_system_at(system, "kinetostatics", ask, assembly)
    except (ModelError, SolveError) as error:
        # of the mode that the guesses choose
        found = _range(system) if assembly is None else None
        if found is None:
            raise error from None
        return found


def _range(system: System) -> Solution | None:
    """The motion of a driver that makes no turn, through the range that it has."""
    if len(system.mechanism.drivers) != 1:
        return None
    driver = system.mechanism.drivers[0]
    try:
        found = driver_range(system)
        middle = found.start
        size = math.pi if driver.angular else system.length
        low = found.low if math.isfinite(found.low) else middle - size
        high = found.high if math.isfinite(found.high) else middle + size
        spare = SHORT * (high - low)
        values = np.linspace(low + spare, high - spare, SMOOTH)
        run = kinetostatics(system, drive={driver.name: values})
    except (ModelError, SolveError):
        return None
    return run


def direction(angle: float) -> Array:
    """The unit vector at an angle [rad] from x."""
    return np.array([math.cos(angle), math.sin(angle)])


def unique(points: Sequence[Any], tolerance: float) -> list[Array]:
    """The points, without those nearer than `tolerance` to one before.

    >>> len(unique([(0, 0), (1, 0), (0, 1e-9)], 1e-6))
    2
    """
    found: list[Array] = []
    for point in map(np.asarray, points):
        if all(np.hypot(*(point - other)) > tolerance for other in found):
            found.append(point)
    return found


def hull(points: Sequence[Any], flat: float = 0.0) -> Array:
    """Corners of the convex hull, counter-clockwise; corners that protrude less than `flat` are
    left out.

    >>> hull([(0, 0), (2, 0), (1, 1e-9), (1, 1), (1, 0.5)], 1e-6).tolist()
    [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]]
    """
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) < 3:
        return np.array(ordered)

    def side(half: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        chain: list[tuple[float, float]] = []
        for c in half:
            while len(chain) > 1:
                a, b = chain[-2], chain[-1]
                across = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
                if across > flat * math.hypot(c[0] - a[0], c[1] - a[1]):
                    break
                chain.pop()
            chain.append(c)
        return chain[:-1]

    return np.array(side(ordered) + side(ordered[::-1]))


def within(point: Any, corners: Array) -> bool:
    """Whether a point lies inside a convex outline, counter-clockwise.

    >>> square = np.array([(0, 0), (2, 0), (2, 2), (0, 2)])
    >>> within((1, 1), square), within((3, 1), square), within((1, 0), square[:2])
    (True, False, False)
    """
    edges, offsets = np.roll(corners, -1, axis=0) - corners, np.asarray(point) - corners
    left = edges[:, 0] * offsets[:, 1] - edges[:, 1] * offsets[:, 0]
    return len(corners) > 2 and bool(np.all(left > 0.0))


def rounded(points: Sequence[Any], radius: float) -> Array:
    """Outline of all that lies within `radius` of the convex hull of the points: a disc about one
    point, a bar with round ends about two, a plate with round corners about more.

    >>> outline = rounded([(0, 0), (3, 0)], 1.0)
    >>> round(float(outline[:, 0].max()), 1), round(float(outline[:, 1].min()), 1)
    (4.0, -1.0)
    """
    corners = hull(points, DRAWN_OUTLINE * radius)
    if len(corners) == 1:
        return arc(corners[0], radius, 0.0, 2.0 * math.pi)
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.arctan2(-edges[:, 0], edges[:, 1])  # of each edge, outward
    parts = []
    for n, corner in enumerate(corners):
        start, end = normals[n - 1], normals[n]
        sweep = (end - start) % (2.0 * math.pi)
        parts.append(arc(corner, radius, start, start + sweep))
    return np.concatenate(parts)


def arc(centre: Any, radius: float, start: float, end: float) -> Array:
    """Points on an arc from the angle `start` to `end` [rad], every nine degrees at least."""
    count = 2 + int(abs(end - start) / math.radians(9.0))
    angles = np.linspace(start, end, count)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def box(centre: Any, along: float, across: float, angle: float) -> Array:
    """Corners of a rectangle of half sides `along` and `across`, turned by `angle` [rad]."""
    u, n = direction(angle), direction(angle + math.pi / 2.0)
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return np.array([np.asarray(centre) + a * along * u + b * across * n for a, b in corners])


def hatching(start: Any, end: Any, depth: float, gap: float) -> list[Array]:
    """Slanted strokes on the right of the line from `start` to `end`.

    >>> strokes = hatching((0, 0), (4, 0), 0.5, 1.0)
    >>> len(strokes), bool(max(stroke[1, 1] for stroke in strokes) < 0)
    (4, True)
    """
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = math.hypot(*(end - start))
    u = (end - start) / max(length, TINY)
    slant = depth * (np.array([u[1], -u[0]]) - u)
    count = max(1, round(length / gap))
    places = (np.arange(count) + 0.8) / count
    return [
        np.array([start + p * (end - start), start + p * (end - start) + slant]) for p in places
    ]


def zigzag(start: Any, end: Any, width: float, lead: float, coils: int = 7) -> Array:
    """A spring between two points, straight for `lead` at both ends, `width` to each side."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = math.hypot(*(end - start))
    if length == 0.0:
        return np.array([start, end])
    u = (end - start) / length
    n = np.array([-u[1], u[0]])
    lead = min(lead, 0.3 * length)
    places = lead + (length - 2.0 * lead) * (np.arange(2 * coils) + 0.5) / (2 * coils)
    sides = np.where(np.arange(2 * coils) % 2, -width, width)
    teeth = start + places[:, None] * u + sides[:, None] * n
    return np.vstack([start, start + lead * u, teeth, end - lead * u, end])


def spiral(
    centre: Any, inner: float, outer: float, start: float, revolutions: float = 2.25
) -> Array:
    """A torsion spring: a spiral from the inner radius to the outer one."""
    part = np.linspace(0.0, 1.0, 60)
    angles = start + 2.0 * math.pi * revolutions * part
    radius = inner + (outer - inner) * part
    return np.asarray(centre) + (radius * np.array([np.cos(angles), np.sin(angles)])).T
