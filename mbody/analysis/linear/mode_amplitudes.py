"""Where a mode shape has amplitudes: the angles of bodies, and x and y of any of their points.

For unit rates of the leaders a body goes with (vx, vy, ω) at its mass centre, and a point at
(rx, ry) from there with (vx − ω ry, vy + ω rx): the velocities of a small motion are those of a
rigid body, and so are its amplitudes.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import Marker, listed
from mbody.model.mechanism import Mechanism
from mbody.model.state_quantities import ORIGIN
from mbody.solution.solution import Solution

__all__ = ["ModePlace", "mode_place", "rates_at"]

Array = np.ndarray

#: What moves of a body, and of a point.
KEYS = ("x", "y", "angle")


@dataclass(frozen=True)
class ModePlace:
    """A coordinate of a mechanism that has an amplitude.

    Attributes
    ----------
    body : str
    point : Marker or None
        None of the mass centre, and of an angle.
    key : int
        0 of x, 1 of y, 2 of the angle.
    """

    body: str
    point: Marker | None
    key: int

    @property
    def turns(self) -> bool:
        """Whether it is an angle [rad]; else it is a length."""
        return self.key == 2


def mode_place(mechanism: Mechanism, given: object, where: str = "") -> ModePlace:
    """The coordinate of that name; sentences begin with `where`.

    ``"rod.angle"``; ``"rod.x"`` of the mass centre; ``"rod.P.y"`` of a point, ``"rod.origin.y"`` of
    where the axes of the link begin; ``"A.x"`` of a pin, by the name of the joint.

    Raises
    ------
    ModelError
        For what has no amplitude.
    """
    owner, _, key = given.rpartition(".") if isinstance(given, str) else ("", "", "")
    first, _, point = owner.partition(".")
    bodies = {"ground": mechanism.ground} | {one.name: one for one in mechanism.bodies}
    pins = {one.name: one.i for one in mechanism.joints if one.coincident}
    if first in bodies and not point and key in KEYS:
        return ModePlace(first, None, KEYS.index(key))
    if first in bodies and key in KEYS[:2] and point:
        if point in bodies[first].points:
            return ModePlace(first, Marker(first, point), KEYS.index(key))
        if point == ORIGIN:
            return ModePlace(first, Marker(first, (0.0, 0.0)), KEYS.index(key))
        close = difflib.get_close_matches(point, bodies[first].points, n=3)
        raise ModelError(
            f"{where}'{first}' has no point {brief(point)} (it has: "
            f"{listed(close or [*bodies[first].points, ORIGIN])})",
            first,
        )
    if owner in pins and key in KEYS[:2]:
        return ModePlace(pins[owner].body, pins[owner], KEYS.index(key))
    example = mechanism.bodies[0].name
    raise ModelError(
        f"{where}amplitudes are of the angle of a body, and of x and y of its mass centre or a "
        f"point, such as {example}.angle, {example}.x or {_pointed(mechanism)}, not {brief(given)} "
        f"(bodies: {listed(one.name for one in mechanism.bodies)})",
        str(given),
    )


def rates_at(solution: Solution, rates: Array, place: ModePlace) -> Array:
    """What a coordinate does for unit rates of the leaders, (free,), from those of all bodies
    (free, bodies, 3) at the last instant.
    """
    if place.body == "ground":
        return np.zeros(len(rates))
    ways = rates[:, solution.system.bodies[place.body]]
    if place.point is None:
        return np.asarray(ways[:, place.key])
    centre, point = solution[place.body], solution.point(place.point)
    if place.key == 0:
        return np.asarray(ways[:, 0] - ways[:, 2] * float(point.y[-1] - centre.y[-1]))
    return np.asarray(ways[:, 1] + ways[:, 2] * float(point.x[-1] - centre.x[-1]))


def _pointed(mechanism: Mechanism) -> str:
    """x of a point that there is."""
    named = (f"{one.name}.{point}.x" for one in mechanism.bodies for point in one.points)
    return next(named, f"{mechanism.bodies[0].name}.origin.x")
