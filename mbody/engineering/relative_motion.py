"""The motion of bodies and points in the axes of a body: places, velocities and accelerations.

Places are complex numbers in the axes of that body, from its mass centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.driven import kinematics
from mbody.analysis.driven.free_body import free_body
from mbody.errors import ModelError
from mbody.model.element import Marker
from mbody.solution.checks import changed, one_design
from mbody.solution.histories import BodyHistory, PointHistory
from mbody.solution.solution import Solution

Array = np.ndarray

#: What is said of a motion that its driver does not make.
AT_REST = "the instant centres are those at unit speed"
#: Of the accelerations that forces would give one by one, what is none: contacts that hold a pile
#: at rest are solved to some 1e-7 of its weight.
NO_ACCELERATION = 1e-6


@dataclass(frozen=True, eq=False)
class RelativeMotion:
    """Motion of a body in the axes of another one: arrays (instants,), complex and real.

    Attributes
    ----------
    place, velocity, acceleration : complex arrays
        Of the mass centre, from that of the other body.
    angle, omega, alpha : arrays
        Of the body's axes in those of the other.
    """

    place: Array
    velocity: Array
    acceleration: Array
    angle: Array
    omega: Array
    alpha: Array

    def instant_centre(self, least: float) -> Array:
        """The instant centre, complex; NaN where the rate is below `least` of its greatest."""
        turns = np.abs(self.omega) > least * np.abs(self.omega).max(initial=0.0)
        with np.errstate(invalid="ignore"):  # NaN where it does not turn
            return self.place + 1j * self.velocity / np.where(turns, self.omega, np.nan)


def check_moving(run: Solution, what: str) -> None:
    """Refuse what has no motion of one design, in a sentence that begins with `what` there is."""
    one_design(run, f"{what} of one design")
    if run.analysis == "statics":
        raise ModelError(f"{what} of a motion, and statics computes no velocities: use kinematics")


def at_unit_speed(run: Solution) -> Solution:
    """The instants of a run whose only driver is at rest, at unit speed of that driver; the run
    itself where it has several drivers or none.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=0.0), [0.0])
    >>> float(at_unit_speed(run)["crank"].omega[0])
    1.0
    """
    leaders = run.system.leaders
    if len(leaders) != 1:
        return run
    (driver,) = leaders
    values = run.driven(driver.name)[0]
    moved = kinematics(run.system, drive={driver.name: (values, 1.0)}, guess=pose_at(run, 0))
    note = f"'{driver.name}' is at rest: {AT_REST}"
    return changed(moved, notes=(*run.notes, note))


def motion_that_begins(run: Solution) -> Array:
    """At which instants (instants,) nothing moves yet and something accelerates: a release from
    rest. Velocities are then a t, in proportion to the accelerations a.

    Examples
    --------
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
    return max(found) > NO_ACCELERATION * max(alone)


def pose_at(run: Solution, k: int) -> dict[str, tuple[float, float, float]]:
    """(x, y, angle) of the link axes of every body at one instant of one design: a guess.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), [0.0])
    >>> print(*np.round(pose_at(run, 0)["crank"], 6))
    0.0 0.0 1.047198
    """
    found = {}
    for body in run.mechanism.bodies:
        origin = run.point(Marker(body.name, (0.0, 0.0)))
        found[body.name] = float(origin.x[k]), float(origin.y[k]), float(run[body.name].angle[k])
    return found


def relative_path(
    run: Solution, moving: BodyHistory | PointHistory, relative_to: str
) -> tuple[Array, Array, Array]:
    """Place, velocity and acceleration of a point, or of a body's mass centre, in the axes of a
    body; "ground" is one of them.
    """
    seen = run[relative_to]
    into, turning = np.exp(-1j * seen.angle), 1j * seen.omega
    apart = moving.x - seen.x + 1j * (moving.y - seen.y)
    rate = moving.vx - seen.vx + 1j * (moving.vy - seen.vy)
    second = moving.ax - seen.ax + 1j * (moving.ay - seen.ay)
    second = second - 2.0 * turning * rate - (1j * seen.alpha + seen.omega**2) * apart
    return into * apart, into * (rate - turning * apart), into * second


def relative_motion(run: Solution, body: str, relative_to: str) -> RelativeMotion:
    """How one body moves in the axes of another; "ground" is one of them."""
    a, b = run[body], run[relative_to]
    path = relative_path(run, a, relative_to)
    return RelativeMotion(*path, a.angle - b.angle, a.omega - b.omega, a.alpha - b.alpha)
