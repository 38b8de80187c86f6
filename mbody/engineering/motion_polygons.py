"""Velocity and acceleration polygons: the images of points and links from one pole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import kinematics
from mbody.analysis.driven.free_body import free_body
from mbody.analysis.driven.transmission import pose_at
from mbody.core.presentation import Presented
from mbody.core.tolerances import ACCELERATION_NONE, POINT_SAME
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.model.joints import Distance, Fixed, Joint, Revolute
from mbody.model.touching_shapes import middles_of_arcs
from mbody.solution.declared_result import Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import BodyHistory, PointHistory, one_design, with_fields
from mbody.solution.solution import Solution, as_solution

# -- The motion of bodies and points in the axes of a body: places, velocities and accelerations
# Places are complex numbers in the axes of that body, from its mass centre.

Array = np.ndarray

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
