"""Instant centres of velocity of all pairs of bodies, and the centrodes that they trace."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.driven import kinematics
from mbody.analysis.driven.free_body import free_body
from mbody.analysis.driven.transmission import pose_at
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.core.tolerances import (
    ACCELERATION_NONE,
    CURVATURE_NONE,
    POINT_SAME,
    RATE_NONE_COORDINATE,
)
from mbody.errors import ModelError
from mbody.model.element import Marker, listed
from mbody.model.joints import (
    Distance,
    Fixed,
    Gear,
    Joint,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)
from mbody.model.touching_shapes import middles_of_arcs
from mbody.solution.declared_result import Value, data_only, declared_data
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import BodyHistory, PointHistory, one_design, with_fields
from mbody.solution.solution import Solution, as_solution
from mbody.system.system import Locked

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.output_units import OutputUnits


# -- Curvature of the paths of points, the inflection circle, and the pole of accelerations ----

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class PathCurvature(Inherited):
    """Curvature of a path and its centre: arrays (instants,).

    Attributes
    ----------
    curvature : array
        Signed, positive where the path turns to its left [1/length]; NaN at a cusp, where the point
        stands still.
    radius : array
        1/|curvature|, infinite where the path is straight.
    centre_x, centre_y : arrays
        In the axes of the body on which the path is seen, from the origin of the ground or from the
        mass centre of that body; NaN where the path is straight.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> mbody.engineering.path_curvature(run, "crank.A").curvature
    array([1.])
    """

    curvature: Array
    radius: Array
    centre_x: Array
    centre_y: Array


def path_curvature(
    run: Solution, place: Marker | str, relative_to: str = "ground"
) -> PathCurvature:
    """Curvature of the path that a point describes on a body.

    Parameters
    ----------
    run : Solution
        Of one design, with accelerations.
    place : Marker or str
        The point, such as ``"coupler.P"``.
    relative_to : str
        The body on which its path is seen.

    Returns
    -------
    PathCurvature
        κ = (v × a)/|v|³.

    Raises
    ------
    ModelError
        For a batch, an analysis without accelerations, a body or a point that does not exist.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.0, 0.5])
    >>> path_curvature(run, "crank.A").radius
    array([1., 1.])
    """
    run = as_solution(run)
    check_moving(run, "the curvature of a path is")
    position, v, a = relative_path(run, run.point(place), relative_to)
    speed = np.abs(v)
    speed = np.where(speed > RATE_NONE_COORDINATE * speed.max(initial=0.0), speed, np.nan)
    curvature = (np.conj(v) * a).imag / speed**3
    bent = np.where(np.abs(curvature) * run.system.length > CURVATURE_NONE, curvature, np.nan)
    # numbers that are none stand for cusps and straight paths
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = position + 1j * v / speed / bent
        radius = 1.0 / np.abs(curvature)
    return PathCurvature(curvature, radius, centre.real, centre.imag, **inherited(run))


@dataclass(frozen=True, eq=False)
class InflectionCircle(Inherited):
    """The circle of the points whose paths have a point of inflection: arrays (instants,).

    All places are in the axes of the body that is taken as fixed, from the origin of the ground or
    from that body's mass centre; NaN where both bodies do not turn against each other.

    Attributes
    ----------
    pole_x, pole_y : arrays
        The instant centre, on the circle.
    x, y : arrays
        The inflection pole, opposite to the instant centre on the circle.
    diameter : array
    acceleration_pole_x, acceleration_pole_y : arrays
        The point without acceleration.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> found = mbody.engineering.inflection_circle(run, "coupler")
    >>> across = np.hypot(found.x - found.pole_x, found.y - found.pole_y)
    >>> bool(abs(across - found.diameter)[0] < 1e-9)
    True
    """

    pole_x: Array
    pole_y: Array
    x: Array
    y: Array
    diameter: Array
    acceleration_pole_x: Array
    acceleration_pole_y: Array


def inflection_circle(run: Solution, body: str, relative_to: str = "ground") -> InflectionCircle:
    """The inflection circle of a body's motion.

    Its diameter runs from the instant centre P to P + a_P/ω², a_P the acceleration of the body's
    point at P.

    Parameters
    ----------
    run : Solution
        Of one design, with accelerations.
    body : str
        The moving body.
    relative_to : str
        The body that is taken as fixed.

    Returns
    -------
    InflectionCircle

    Raises
    ------
    ModelError
        For a batch, an analysis without accelerations, or a body that does not exist.

    Notes
    -----
    Source: Uicker, Pennock, Shigley: *Theory of Machines and Mechanisms*, 4.13 (inflection circle,
    Euler–Savary); Bottema, Roth: *Theoretical Kinematics* (1979), VIII.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> found = inflection_circle(run, "coupler")
    >>> bool(found.diameter[0] > 0)
    True
    """
    run = as_solution(run)
    check_moving(run, "an inflection circle is")
    m = relative_motion(run, body, relative_to)
    rotation, pole = 1j * m.alpha - m.omega**2, m.instant_centre(RATE_NONE_COORDINATE)
    omega = np.where(np.isnan(pole.real), np.nan, m.omega)
    # numbers that are none stand for bodies that do not turn
    with np.errstate(divide="ignore", invalid="ignore"):
        opposite = pole + (m.acceleration + rotation * (pole - m.place)) / omega**2
        still = m.place - m.acceleration / np.where(rotation != 0.0, rotation, np.nan)
    return InflectionCircle(
        pole.real,
        pole.imag,
        opposite.real,
        opposite.imag,
        np.abs(opposite - pole),
        still.real,
        still.imag,
        **inherited(run),
    )


# -- Velocity and acceleration polygons: the images of points and links from one pole ----------

# -- The motion of bodies and points in the axes of a body: places, velocities and accelerations
# Places are complex numbers in the axes of that body, from its mass centre.


#: What is said of a motion that its driver does not make.
AT_REST = "the instant centres are those at unit speed"


@dataclass(frozen=True, eq=False)
class RelativeMotion:
    """Motion of a body in the axes of another one: arrays (instants,), complex and real.

    `place`, `velocity`, `acceleration`: Of the mass centre, from that of the other body.
    `angle`, `omega`, `alpha`: Of the body's axes in those of the other.
    """

    place: Array
    velocity: Array
    acceleration: Array
    angle: Array
    omega: Array
    alpha: Array

    def instant_centre(self, least: float) -> Array:
        """The instant centre, complex; NaN where the rate is below `least` of its greatest."""
        rotates = np.abs(self.omega) > least * np.abs(self.omega).max(initial=0.0)
        with np.errstate(invalid="ignore"):  # NaN where it does not turn
            return self.place + 1j * self.velocity / np.where(rotates, self.omega, np.nan)


def check_moving(run: Solution, what: str) -> None:
    """Refuse what has no motion of one design, in a sentence that begins with `what` there is."""
    one_design(run, f"{what} of one design")
    if run.analysis == "statics":
        raise ModelError(f"{what} of a motion, and statics computes no velocities: use kinematics")


def at_unit_speed(run: Solution) -> Solution:
    """The instants of a run whose only driver is at rest, at unit speed of that driver; the run
    itself where it has several drivers or none.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=0.0), [0.0])
    >>> float(at_unit_speed(run)["crank"].omega[0])
    1.0
    """
    independent = run.system.independent_drivers
    if len(independent) != 1:
        return run
    (driver,) = independent
    values = run.driven(driver.name)[0]
    moved = kinematics(run.system, drive={driver.name: (values, 1.0)}, guess=pose_at(run, 0))
    note = f"'{driver.name}' is at rest: {AT_REST}"
    return with_fields(moved, notes=(*run.notes, note))


def motion_that_begins(run: Solution) -> Array:
    """At which instants (instants,) nothing moves yet and something accelerates: a release from
    rest. Velocities are then a t, in proportion to the accelerations a.

    >>> import mbody
    >>> run = mbody.simulate(mbody.gallery.load("double_pendulum"), times=[0.0, 0.1])
    >>> print(motion_that_begins(run))
    [ True False]
    """
    bodies = [run[name] for name in run]
    moving = np.any([(one.vx != 0.0) | (one.vy != 0.0) | (one.omega != 0.0) for one in bodies], 0)
    begins = np.zeros(len(run), dtype=bool)
    for k in np.flatnonzero(~moving) if run.has_forces else ():
        begins[k] = _accelerates(run, int(k))
    return begins


def _accelerates(run: Solution, k: int) -> bool:
    """Whether the forces of an instant do not cancel: a rate of each body, beside those that each
    of its forces alone would give it.
    """
    length, found, alone = run.system.length, [0.0], [0.0]
    masses = run.system.mass[:, 0].reshape(-1, 3)
    for name, (mass, _, inertia) in zip(run, masses[: len(run.mechanism.bodies)], strict=True):
        one = run[name]
        found.append(float(np.hypot(one.ax[k], one.ay[k])) / length + abs(float(one.alpha[k])))
        for force in free_body(run, name, k):
            dx, dy = force.x - one.x[k], force.y - one.y[k]
            moment = force.torque + dx * force.fy - dy * force.fx
            alone.append(force.force / mass / length if mass > 0.0 else 0.0)
            alone.append(abs(float(moment)) / inertia if inertia > 0.0 else 0.0)
    return max(found) > ACCELERATION_NONE * max(alone)


def relative_path(
    run: Solution, moving: BodyHistory | PointHistory, relative_to: str
) -> tuple[Array, Array, Array]:
    """Place, velocity and acceleration of a point, or of a body's mass centre, in the axes of a
    body; "ground" is one of them.
    """
    seen = run[relative_to]
    into, rotation = np.exp(-1j * seen.angle), 1j * seen.omega
    offset = moving.x - seen.x + 1j * (moving.y - seen.y)
    rate = moving.vx - seen.vx + 1j * (moving.vy - seen.vy)
    second = moving.ax - seen.ax + 1j * (moving.ay - seen.ay)
    second = second - 2.0 * rotation * rate - (1j * seen.alpha + seen.omega**2) * offset
    return into * offset, into * (rate - rotation * offset), into * second


def relative_motion(run: Solution, body: str, relative_to: str) -> RelativeMotion:
    """How one body moves in the axes of another; "ground" is one of them."""
    a, b = run[body], run[relative_to]
    path = relative_path(run, a, relative_to)
    return RelativeMotion(*path, a.angle - b.angle, a.omega - b.omega, a.alpha - b.alpha)


@dataclass(frozen=True, eq=False)
class MotionPolygon(Inherited, Presented):
    """The polygon of velocities or accelerations of named points.

    The image of a point is the end of its velocity (acceleration) drawn from the pole, which is
    the image of the ground. The line between two images is the relative velocity. The image of a
    link is similar to the link: rotated by 90° and ω times as large in the velocity polygon,
    √(ω⁴ + α²) times as large in that of accelerations.

    Attributes
    ----------
    quantity : str
        "velocity" or "acceleration".
    x, y : dict of str to array (instants,)
        Images of the points by their dotted names, from the pole.
    links : dict of str to tuple of str
        Of every body the points on it: the corners of its image.
    joints : dict of str to tuple of str
        Of every joint of one place the two points that meet there, one on each body. Of pins they
        have one image; of slides, slots and cams the line between their images is the sliding.

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0)
    >>> found = mbody.engineering.velocity_polygon(mbody.kinematics(made, [0.0]))
    >>> x, y = found.between("crank.O2", "crank.A")
    >>> round(float(np.hypot(x, y)[0]), 12)
    2.0
    """

    quantity: str = "velocity"
    x: dict[str, Array] = field(default_factory=dict)
    y: dict[str, Array] = field(default_factory=dict)
    links: dict[str, tuple[str, ...]] = field(default_factory=dict)
    joints: dict[str, tuple[str, ...]] = field(default_factory=dict)

    declared = (
        Value("quantity"),
        Value(
            "points",
            dimension=lambda found: found.quantity,
            value=lambda found: {key: {"x": found.x[key], "y": found.y[key]} for key in found.x},
        ),
        Value("links"),
        Value("joints"),
    )

    def between(self, first: str, second: str) -> tuple[Array, Array]:
        """The side from the image of one point to that of another: the relative velocity or
        acceleration of the second, x and y.

        Raises
        ------
        ModelError
            For a point that is not in the polygon.
        """
        for name in (first, second):
            if name not in self.x:
                raise ModelError(f"{name!r} is not in the polygon, which has {listed(self.x, 30)}")
        return self.x[second] - self.x[first], self.y[second] - self.y[first]


def velocity_polygon(run: Solution, points: Sequence[str] | None = None) -> MotionPolygon:
    """The velocity polygon.

    Parameters
    ----------
    run : Solution
        Of one design, with velocities.
    points : sequence of str, optional
        Dotted names of points, such as ``"coupler.P"``; by default those at which joints are and
        all other named points. A point of a body that has no name there is called by the joint, as
        in ``"rocker at A"``; where a joint slides or rolls it is the point of the body that is just
        there.

    Returns
    -------
    MotionPolygon
        In lengths by time, arrays (instants,).

    Raises
    ------
    ModelError
        For a batch, an analysis without velocities, or a point that does not exist.

    Notes
    -----
    Source: Uicker, Pennock, Shigley: *Theory of Machines and Mechanisms*, 3.4 and 4.4.

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0)
    >>> found = velocity_polygon(mbody.kinematics(made, [0.0]))
    >>> x, y = found.between("crank.O2", "crank.A")
    >>> round(float(np.hypot(x, y)[0]), 12)
    2.0
    """
    return _polygon(run, points, "velocity")


def acceleration_polygon(run: Solution, points: Sequence[str] | None = None) -> MotionPolygon:
    """The acceleration polygon; arguments and errors as of `velocity_polygon`.

    Parameters
    ----------
    run : Solution
    points : sequence of str, optional

    Returns
    -------
    MotionPolygon
        In lengths by time squared.

    Raises
    ------
    ModelError

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0)
    >>> found = acceleration_polygon(mbody.kinematics(made, [0.0]))
    >>> x, y = found.between("crank.O2", "crank.A")
    >>> round(float(np.hypot(x, y)[0]), 12)
    4.0
    """
    return _polygon(run, points, "acceleration")


def _polygon(run: Solution, points: Sequence[str] | None, quantity: str) -> MotionPolygon:
    run = as_solution(run)
    check_moving(run, f"a {quantity} polygon is")
    x: dict[str, Array] = {}
    y: dict[str, Array] = {}
    bodies: dict[str, str] = {}
    joints: dict[str, tuple[str, ...]] = {}
    if points is None:
        for joint in run.mechanism.joints:
            met = []
            for name, body, place in _meeting(run, joint):
                bodies[name] = body
                x[name], y[name] = _carried(run, body, place, quantity)
                met.append(name)
            if not isinstance(joint, Distance):
                joints[joint.name] = tuple(met)
        points = [name for name in _named(run) if name not in x]
    letter = "v" if quantity == "velocity" else "a"
    for name in dict.fromkeys(points):
        history = run.point(name)
        x[name], y[name] = getattr(history, f"{letter}x"), getattr(history, f"{letter}y")
        bodies[name] = name.partition(".")[0]
    links = {
        body: tuple(name for name in x if bodies[name] == body)
        for body in dict.fromkeys(bodies[name] for name in x)
    }
    return MotionPolygon(quantity, x, y, links, joints, **inherited(run))


def _meeting(run: Solution, joint: Joint) -> list[tuple[str, str, tuple[Array, Array]]]:
    """Of both bodies of a joint the point there: its name, the body and its places."""
    found = []
    fixed = isinstance(joint, Revolute | Fixed | Distance)
    there = None if fixed else run.reaction_point(joint.name)
    for marker in (joint.i, joint.j):
        history = run.point(marker)
        place = (history.x, history.y)
        named = fixed or _is_there(run, place, there)
        name = f"{marker.body} at {joint.name}"
        if named and isinstance(marker.point, str):
            name = f"{marker.body}.{marker.point}"
        found.append((name, marker.body, place if there is None else there))
    return found


def _is_there(run: Solution, place: tuple[Array, Array], there: Any) -> bool:
    """Whether a marker is at the place of its joint at every instant."""
    away = np.hypot(place[0] - there[0], place[1] - there[1])
    return bool((away <= POINT_SAME * run.system.length).all())


def _carried(
    run: Solution, body: str, place: tuple[Array, Array], quantity: str
) -> tuple[Array, Array]:
    """The velocity or acceleration of the point of a body that is at a place."""
    b = run[body]
    away = place[0] - b.x + 1j * (place[1] - b.y)
    if quantity == "velocity":
        found = b.vx + 1j * b.vy + 1j * b.omega * away
    else:
        found = b.ax + 1j * b.ay + (1j * b.alpha - b.omega**2) * away
    return np.real(found), np.imag(found)


def _named(run: Solution) -> list[str]:
    """Dotted names of the points of moving bodies, without those of arcs of shapes."""
    return [
        f"{body.name}.{point}"
        for body in run.mechanism.bodies
        for point in body.points
        if point not in middles_of_arcs(body.shapes)
    ]


#: What is said of instants at which nothing moves yet.
BEGINNING = "the instant centres are those that it begins with, from accelerations"


@dataclass(frozen=True, eq=False)
class InstantCentre(Locked, Presented):
    """The instant centre of one pair of bodies: arrays (instants,).

    Attributes
    ----------
    bodies : pair of str
    x, y : arrays
        Its place, world axes; NaN where it is at infinity or there is none.
    direction : array
        Where it is at infinity the angle [rad] of the line towards it, across the sliding, from
        −π/2 to π/2; NaN elsewhere.
    kind : tuple of str
        "finite", "infinite" (the bodies slide on each other without turning), or "none" (they do
        not move against each other).
    permanence : str
        "fixed" where a pin or a slide on the ground keeps it, "permanent" where one between two
        moving bodies does, else "instantaneous".

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.slider_crank(1.0, 3.0, speed=1.0), [0.2])
    >>> pole = mbody.engineering.instant_centres(run)["slider", "ground"]
    >>> pole.kind, pole.permanence
    (('infinite',), 'fixed')
    """

    bodies: tuple[str, str]
    x: Array
    y: Array
    direction: Array
    kind: tuple[str, ...]
    permanence: str

    declared = (
        Value("bodies"),
        *data_only("x", "y", dimension="length"),
        Value("direction", "", "angle"),
        *data_only("kind", "permanence"),
    )

    def homogeneous(self, length: float = 1.0) -> Array:
        """(X, Y, W) of unit length, places by `length`: (instants, 3); NaN where there is none."""
        infinite = np.array([kind == "infinite" for kind in self.kind])
        x = np.where(infinite, np.cos(self.direction), self.x / length)
        y = np.where(infinite, np.sin(self.direction), self.y / length)
        found = np.column_stack([x, y, np.where(infinite, 0.0, 1.0)])
        return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


@dataclass(frozen=True, eq=False)
class InstantCentres(Inherited):
    """The instant centres of all pairs of bodies, the ground among them.

    ``centres["coupler", "ground"]`` is one of them, in either order of the names.

    Attributes
    ----------
    pairs : tuple of InstantCentre
        n (n − 1)/2 of n bodies, in the order of the description, the ground last.
    length : float
        The model length, to which places that are one are compared.
    units : OutputUnits or None
        Of places in sentences; None for those of the model.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> len(mbody.engineering.instant_centres(run).pairs)
    6
    """

    pairs: tuple[InstantCentre, ...] = field(default=())
    length: float = 1.0
    units: OutputUnits | None = field(default=None, repr=False)

    def __getitem__(self, names: tuple[str, str]) -> InstantCentre:
        found = None if isinstance(names, str) else self._by_bodies.get(frozenset(names))
        if found is not None:
            return found
        known = ", ".join(dict.fromkeys(f"'{name}'" for one in self.pairs for name in one.bodies))
        raise ModelError(
            f"there is no instant centre of {names!r}: give two of the bodies {known}, as in "
            'centres["coupler", "ground"]'
        )

    def __len__(self) -> int:
        return len(self.pairs)

    @functools.cached_property
    def _numbers(self) -> dict[str, int]:
        return {name: number for number, name in enumerate(self.bodies, 1)}

    @functools.cached_property
    def _by_bodies(self) -> dict[frozenset[str], InstantCentre]:
        return {frozenset(one.bodies): one for one in self.pairs}

    @functools.cached_property
    def bodies(self) -> tuple[str, ...]:
        """All bodies in the order of their numbers: the ground is link 1."""
        names = dict.fromkeys(name for one in self.pairs for name in one.bodies)
        return ("ground", *(name for name in names if name != "ground"))

    def symbol(self, one: InstantCentre) -> str:
        """The letter I with the numbers of both links, as in books: I13, I2,10."""
        numbers = sorted(self._numbers[name] for name in one.bodies)
        return "I" + ("," if numbers[-1] > 9 else "").join(map(str, numbers))

    def coincident(self, instant: int = 0) -> list[list[InstantCentre]]:
        """Centres that are one point at an instant, those of two at least together."""
        groups: list[list[InstantCentre]] = []
        firsts = np.empty(len(self.pairs), dtype=complex)
        for one in self.pairs:
            if one.kind[instant] != "finite":
                continue
            place = complex(one.x[instant], one.y[instant])
            others = firsts[: len(groups)]
            size = np.maximum(np.abs(others), max(self.length, abs(place)))
            alike = np.flatnonzero(np.abs(others - place) <= tol.POINT_SAME * size)
            if len(alike):
                groups[alike[0]].append(one)
            else:
                firsts[len(groups)] = place
                groups.append([one])
        return [group for group in groups if len(group) > 1]

    def sentences(self, instant: int = 0) -> list[str]:
        """Sentences on centres at infinity, on coincident centres, and on bodies that move as one.

        Examples
        --------
        >>> import mbody
        >>> run = mbody.kinematics(mbody.gallery.load("slider_crank"), [0.1])
        >>> print(instant_centres(run).sentences()[0])
        I14 is at infinity, towards 90°: the motion of slider against ground is parallel to 0°
        """
        found = []
        for one in self.pairs:
            i, j = sorted(one.bodies, key=self._numbers.__getitem__, reverse=True)
            if one.kind[instant] == "infinite":
                towards = float(one.direction[instant])
                across = towards + (0.5 if towards <= 0.0 else -0.5) * np.pi
                where = f"{self.symbol(one)} is at infinity, towards {_degrees(towards)}"
                found.append(
                    f"{where}: the motion of {i} against {j} is parallel to {_degrees(across)}"
                )
            elif one.kind[instant] == "none":
                found.append(f"there is no {self.symbol(one)}: {i} does not move against {j}")
        for group in self.coincident(instant):
            first = group[0]
            names = sorted(self.symbol(one) for one in group)
            x, y = (round(float(v[instant]) / self.length, 12) for v in (first.x, first.y))
            size = 1.0 if self.units is None else self.units.size("length")
            x, y = (part * self.length / size + 0.0 for part in (x, y))
            place = f"({x:.6g}, {y:.6g})"
            found.append(f"{', '.join(names[:-1])} and {names[-1]} are one point, {place}")
        return found

    def collinearity(self) -> float:
        """How far the three centres of any three bodies are from one line (Aronhold and Kennedy's
        theorem): the greatest |det| of their homogeneous coordinates, scaled to unit vectors.
        """
        at = {frozenset(one.bodies): one.homogeneous() for one in self.pairs}
        names = list(dict.fromkeys(name for one in self.pairs for name in one.bodies))
        worst = 0.0
        for three in itertools.combinations(names, 3):
            sides = [at[frozenset(pair)] for pair in itertools.combinations(three, 2)]
            for rows in zip(*sides, strict=True):
                if np.isfinite(rows).all():
                    worst = max(worst, abs(float(np.linalg.det(np.array(rows)))))
        return worst

    def data(self, units: OutputUnits | None = None) -> list[dict[str, Any]]:
        """Plain lists of all centres, for JSON; in units of the model, or in others."""
        return [{"symbol": self.symbol(one)} | declared_data(one, units) for one in self.pairs]


def instant_centres(run: Solution) -> InstantCentres:
    """Instant centres of velocity (poles) of all pairs of bodies.

    The instant centre of two bodies is the point at which both have the same velocity: with the
    velocity v(P) = u + ω k × P of each it is (−Δu_y : Δu_x : Δω) in homogeneous coordinates.

    Parameters
    ----------
    run : Solution
        Of one design, with velocities: kinematics, kinetostatics or simulate. Where the only driver
        is at rest, the centres are those of a motion at unit speed; where a motion begins from
        rest, those that it begins with, from accelerations. A note says so.

    Returns
    -------
    InstantCentres

    Raises
    ------
    ModelError
        For a batch, an analysis without velocities, or a mechanism of which nothing moves.

    Notes
    -----
    By Aronhold and Kennedy's theorem the three centres of three bodies are on one line:
    `InstantCentres.collinearity` says how nearly.

    Source: Uicker, Pennock, Shigley: *Theory of Machines and Mechanisms*, 3.12 to 3.15.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    >>> pole = instant_centres(run)["coupler", "ground"]
    >>> round(float(pole.x[0]), 6), round(float(pole.y[0]), 6)
    (13.148531, 22.773924)
    """
    run = as_solution(run)
    check_moving(run, "instant centres are")
    found = _by_rates(run)
    if found is None:
        found = _by_rates(at_unit_speed(run))
    if found is None:
        raise ModelError(
            f"nothing moves in '{run.mechanism.name}', so that there are no instant centres: give "
            "a driver a speed, or take instants at which it moves"
        )
    return found


def _by_rates(run: Solution) -> InstantCentres | None:
    """Those of the velocities of a run; None where nothing moves."""
    names = [*run, "ground"]
    begins = motion_that_begins(run)
    omega, u = {}, {}
    for name, one in ((name, run[name]) for name in names):
        rotation = omega[name] = np.where(begins, one.alpha, one.omega)
        vx, vy = np.where(begins, one.ax, one.vx), np.where(begins, one.ay, one.vy)
        u[name] = vx + rotation * one.y, vy - rotation * one.x
    length = run.system.length
    # the velocity scale of all motion, as a rate
    size = np.max([np.abs(w) + np.hypot(*u[n]) / length for n, w in omega.items()], axis=0)
    if not size.any():
        return None
    kept = _keeping(run)
    pairs = []
    for i, j in itertools.combinations(names, 2):
        dx, dy = u[j][0] - u[i][0], u[j][1] - u[i][1]
        rotation = omega[j] - omega[i]
        slides, rotates = (
            np.hypot(dx, dy) / length > tol.RATE_NONE_INSTANT_CENTRE * size,
            np.abs(rotation),
        )
        rotates = rotates > tol.RATE_NONE_INSTANT_CENTRE * np.maximum(
            size, np.hypot(dx, dy) / length
        )
        kind = np.where(rotates, "finite", np.where(slides, "infinite", "none"))
        rate = np.where(rotates, rotation, np.nan)
        across = np.arctan2(dx, -dy)
        found = InstantCentre(
            (i, j),
            -dy / rate,
            dx / rate,
            np.where(kind == "infinite", _line(across), np.nan),
            tuple(kind.tolist()),
            "instantaneous",
        )
        joint = kept.get(frozenset((i, j)))
        pairs.append(found if joint is None else _of_joint(run, joint, (i, j)))
    notes = [note for note in run.notes if note.endswith(AT_REST)]
    units = run.mechanism.shown
    if begins.any():
        times = [f"{t:.6g}" for t in units.converted(run.t[begins][:3], "time")]
        more = f" and {begins.sum() - 3} more instants" if begins.sum() > 3 else ""
        at = f"{', '.join(times)} {units.of('time')}{more}"
        notes.append(f"at t = {at} the motion begins from rest: {BEGINNING}")
    return InstantCentres(tuple(pairs), length, units, **inherited(run, notes=notes))


def _degrees(angle: float) -> str:
    return f"{round(np.degrees(angle), 4) + 0.0:.6g}°"


def _line(angle: Array) -> Array:
    """Directions of lines [rad], above −π/2 and up to π/2."""
    line_angle = np.remainder(angle, np.pi)
    return np.where(
        line_angle > 0.5 * np.pi + tol.DIRECTION_ROUNDING, line_angle - np.pi, line_angle
    )


def _keeping(run: Solution) -> dict[frozenset[str], Revolute | Prismatic]:
    """The pin or the slide of pairs that have one."""
    joints = [one for one in run.mechanism.joints if isinstance(one, Revolute | Prismatic)]
    return {frozenset(joint.bodies): joint for joint in reversed(joints)}


def _of_joint(run: Solution, joint: Revolute | Prismatic, pair: tuple[str, str]) -> InstantCentre:
    """The centre that a joint keeps: exact also where its bodies hardly move."""
    nothing = np.full(len(run), np.nan)
    permanence = "fixed" if "ground" in pair else "permanent"
    if isinstance(joint, Revolute):
        pin = run.point(joint.i)
        kind = ("finite",) * len(run)
        return InstantCentre(pair, pin.x.copy(), pin.y.copy(), nothing, kind, permanence)
    guide = run[joint.i.body].angle + float(run.system.numbers.angle(joint, "i"))
    kind = ("infinite",) * len(run)
    across = _line(guide + 0.5 * np.pi)
    return InstantCentre(pair, nothing, nothing.copy(), across, kind, permanence)


@dataclass(frozen=True, eq=False)
class Centrodes(Inherited):
    """The paths of the instant centre of two bodies, on both: arrays (instants,).

    The moving centrode rolls on the fixed one.

    Attributes
    ----------
    fixed_x, fixed_y : arrays
        In the axes of the body that is taken as fixed: from the origin of the ground, or from that
        body's mass centre in its own axes.
    moving_x, moving_y : arrays
        From the mass centre of the moving body, in its axes.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.slider_crank(1.0, 3.0, speed=1.0), [0.2, 0.4])
    >>> found = mbody.engineering.centrodes(run, "crank")  # turns about a pin: one point
    >>> bool(abs(found.fixed_x).max() < 1e-12)
    True
    """

    fixed_x: Array
    fixed_y: Array
    moving_x: Array
    moving_y: Array


def centrodes(run: Solution, body: str, relative_to: str = "ground") -> Centrodes:
    """The fixed and the moving centrode of a body's motion.

    Parameters
    ----------
    run : Solution
        Of one design, with velocities.
    body : str
        The moving body.
    relative_to : str
        The body that is taken as fixed.

    Returns
    -------
    Centrodes
        NaN where both bodies do not turn against each other.

    Raises
    ------
    ModelError
        For a batch, an analysis without velocities, or a body that does not exist.

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0)
    >>> run = mbody.kinematics(made, [0.0, 0.5, 1.0])
    >>> centrodes(run, "coupler").fixed_x.shape
    (3,)
    """
    run = as_solution(run)
    check_moving(run, "centrodes are")
    m = relative_motion(run, body, relative_to)
    pole = m.instant_centre(tol.RATE_NONE_INSTANT_CENTRE)
    moving = np.exp(-1j * m.angle) * (pole - m.place)
    return Centrodes(pole.real, pole.imag, moving.real, moving.imag, **inherited(run))


# -- Lines of Aronhold and Kennedy -------------------------------------------------------------
# The three centres of three bodies are on one line. From the centres that joints show (pins,
# guides, pitch points of gears) every other one is where two such lines meet, if the mechanism can
# be solved by lines alone.

Pair = frozenset[str]


@dataclass(frozen=True)
class KennedyLine:
    """A line through three centres.

    `pair`: The bodies whose centre is sought.
    `through`: The bodies whose centres are known, both with the same third body.
    """

    pair: tuple[str, str]
    through: tuple[tuple[str, str], tuple[str, str]]


def centres_of_joints(mechanism: Mechanism) -> set[Pair]:
    """Pairs of bodies whose instant centre a joint shows: a pin, the normal of a guide, a pitch
    point, a point of rolling contact.

    >>> import mbody
    >>> len(centres_of_joints(mbody.makers.four_bar(1, 3, 2, 3.5)))
    4
    """
    kinds = Revolute, Prismatic, Fixed, Gear, RackPinion, Rolling
    return {frozenset(joint.bodies) for joint in mechanism.joints if isinstance(joint, kinds)}


def kennedy_lines(
    centres: InstantCentres, mechanism: Mechanism, instant: int = 0
) -> tuple[KennedyLine, ...]:
    """Two lines for every centre that follows from those before it, in the order of construction.

    >>> import mbody
    >>> from mbody.engineering import instant_centres
    >>> run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    >>> lines = kennedy_lines(instant_centres(run), run.mechanism)
    >>> [line.pair for line in lines][::2]
    [('crank', 'rocker'), ('coupler', 'ground')]
    """
    pairs = [one.bodies for one in centres.pairs]
    at = {frozenset(one.bodies): one.homogeneous(centres.length)[instant] for one in centres.pairs}
    known = centres_of_joints(mechanism)
    found: list[KennedyLine] = []
    while True:
        new = []
        for i, j in pairs:
            if frozenset((i, j)) in known:
                continue
            lines = {}
            for k in centres.bodies:
                ends = frozenset((i, k)), frozenset((k, j))
                if k not in (i, j) and known.issuperset(ends):
                    lines[k] = np.cross(at[ends[0]], at[ends[1]])
            best, thirds = _crossing(lines)
            if best > tol.LINES_PARALLEL:
                new.append(frozenset((i, j)))
                found += [KennedyLine((i, j), ((i, k), (k, j))) for k in thirds]
        if not new:
            return tuple(found)
        known |= set(new)


def _crossing(lines: dict[str, np.ndarray]) -> tuple[float, tuple[str, ...]]:
    """The two lines that cross at the greatest angle, and its measure."""
    if len(lines) < 2:
        return 0.0, ()
    names, whole = list(lines), np.array(list(lines.values()))
    sizes = np.linalg.norm(whole, axis=1)
    units = whole / np.maximum(sizes, tol.TINY)[:, None]
    sines = np.linalg.norm(np.cross(units[:, None], units[None, :]), axis=2)
    # lines through centres that are one point, or of which one is missing, are none
    sound = sizes > tol.LINES_PARALLEL
    sines = np.where(np.triu(sound[:, None] & sound, 1), sines, 0.0)
    one, other = np.unravel_index(int(np.argmax(sines)), sines.shape)
    best = float(sines[one, other])
    return best, (names[one], names[other]) if best > 0.0 else ()
