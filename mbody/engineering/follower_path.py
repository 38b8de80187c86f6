"""Followers on a guide or an arm, their motion kept, over base circles of other radii."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.model.joints import CamFollower, Prismatic, Revolute
from mbody.solution.solution import Solution

__all__ = ["FollowerPath", "follower_path"]

Array = np.ndarray

#: How many base circles are tried, and how often the limit between two of them is halved.
TRIED, HALVED = 400, 50
#: The greatest base circle of a follower on a guide, by the greatest radius of the pitch curve.
GREATEST = 30.0
#: Of the greatest radius, a base circle that is none.
NOTHING = 1e-9
#: Of its greatest radius, by which the centre of a cam may move and is taken as fixed.
FIXED = 1e-9


@dataclass(frozen=True, eq=False)
class FollowerPath:
    """The path of a follower's place beside its cam, whose centre is the origin; the cam turns
    counter-clockwise by θ, a cam that turns clockwise is mirrored.

    Attributes
    ----------
    place : complex array (n,)
        Of the roller's centre, the knife edge, or the place in the face [length].
    first, second : arrays (n,)
        Derivatives by θ of the follower's coordinate: of its way along the guide [length], of its
        angle on the arm [1].
    along : complex
        Direction of the guide; 0 on an arm.
    pivot : complex
        Of the arm.
    normal : complex array (n,) or None
        Of a flat face.
    roller : float
        [length]

    >>> turn = np.linspace(0.0, 2.0 * np.pi, 361)
    >>> place = 1j * (0.05 + 0.01 * (1.0 - np.cos(turn)))
    >>> first, second = 0.01 * np.sin(turn), 0.01 * np.cos(turn)
    >>> path = FollowerPath(place, first, second, 1j, 0j, None, 0.01)
    >>> round(path.base_radius(), 9)
    0.04
    """

    place: Array
    first: Array
    second: Array
    along: complex
    pivot: complex
    normal: Array | None
    roller: float

    def shifted(self, by: float) -> FollowerPath:
        """The same motion from another place on the guide [length] or the arm [rad]."""
        if self.along:
            return replace(self, place=self.place + by * self.along)
        turn = complex(math.cos(by), math.sin(by))
        normal = None if self.normal is None else self.normal * turn
        return replace(self, place=self.pivot + (self.place - self.pivot) * turn, normal=normal)

    def base_radius(self) -> float:
        """Radius of the base circle [length]."""
        if self.normal is not None:
            return float(self._support()[0].min())
        return float(np.abs(self.place).min()) - self.roller

    def pressure_angle(self) -> Array:
        """Between the contact's normal and the way of the follower [rad], 0 … π/2."""
        n = self.normal
        if n is None:
            p1 = self._pitch()[0]
            n, at = 1j * p1 / np.abs(p1), self.place
        else:
            h, slope, _ = self._support()
            at = h * n + slope * 1j * n
        way = self.along if self.along else 1j * (at - self.pivot)
        with np.errstate(invalid="ignore", divide="ignore"):
            angle: Array = np.arccos(np.minimum(np.abs((n * np.conj(way)).real) / np.abs(way), 1.0))
        return angle

    def clearance(self) -> float:
        """Least radius of curvature of the contour [length]; where it is not positive the cam is
        undercut, or is no cam: -inf where the follower runs faster around it than it turns."""
        if self.normal is not None:
            return float(self._support()[2].min())
        p1, p2 = self._pitch()
        around = (1j * p1 * np.conj(self.place)).real
        if not around.min() > 0.0:
            return -math.inf
        bend = -(np.conj(p1) * p2).imag
        convex = bend > 0.0
        if not convex.any():
            return math.inf
        return float((np.abs(p1[convex]) ** 3 / bend[convex]).min()) - self.roller

    def least_base(self, limit: float | None = None) -> float | None:
        """The least base circle without undercutting, and, with a limit, of a pressure angle
        nowhere above it [rad]; 0 where every one will do, None where there is none.
        """
        if self.along:
            # from beside the cam's centre outwards: closer near it, where most happens
            way = (self.place * np.conj(self.along)).real
            out = math.copysign(1.0, float(way.mean()))
            low, high = -float((out * way).min()), GREATEST * float(np.abs(self.place).max())
            shifts = out * (low + (high - low) * np.linspace(0.0, 1.0, TRIED) ** 2)
        else:
            # all positions of the arm on its side of the line to the cam's centre
            start = float(np.angle((self.place - self.pivot).mean() / -self.pivot))
            out = math.copysign(1.0, start)
            shifts = out * np.linspace(0.0, math.pi, TRIED + 2)[1:-1] - start
        worst = self._excess(limit)
        tried = [(worst(self.shifted(s)), s) for s in shifts.tolist()]
        if tried[0][0] <= 0.0:
            return self.shifted(tried[0][1]).base_radius()
        for (before, low), (here, high) in itertools.pairwise(tried):
            if here <= 0.0 < before:
                for _ in range(HALVED):
                    middle = 0.5 * (low + high)
                    inside = worst(self.shifted(middle)) <= 0.0
                    low, high = (low, middle) if inside else (middle, high)
                base = self.shifted(high).base_radius()
                return base if base > NOTHING * float(np.abs(self.place).max()) else 0.0
        return None

    def _excess(self, limit: float | None) -> Callable[[FollowerPath], float]:
        """By how much the limits are exceeded, -1 where they are kept."""

        def found(path: FollowerPath) -> float:
            if not path.base_radius() > 0.0 or not path.clearance() > 0.0:
                return math.inf
            if limit is None:
                return -1.0
            return float(path.pressure_angle().max()) - limit

        return found

    def _pitch(self) -> tuple[Array, Array]:
        """Derivatives of the pitch curve in the cam's axes by θ, turned back into the ground's."""
        if self.along:
            rate, second = self.along * self.first, self.along * self.second
        else:
            arm = self.place - self.pivot
            rate, second = 1j * arm * self.first, 1j * arm * self.second - arm * self.first**2
        return rate - 1j * self.place, second - 2j * rate - self.place

    def _support(self) -> tuple[Array, Array, Array]:
        """h, its derivative by the direction of n in the cam's axes, and the radius h + h″."""
        n: Any = self.normal
        h = (np.conj(n) * self.place).real
        if self.along:
            c = (np.conj(n) * self.along).real
            return h, -c * self.first, h + c * self.second
        over, beside = (np.conj(n) * self.pivot).real, (np.conj(1j * n) * self.pivot).real
        # dχ/dθ = x′ − 1
        turn = self.first - 1.0
        rate, rate2 = beside * self.first, beside * self.second - over * self.first**2
        return h, rate / turn, h + (rate2 * turn - rate * self.second) / turn**3


def follower_path(run: Solution, joint: CamFollower) -> FollowerPath | None:
    """The path of a follower on a guide or an arm of the ground, about a cam with a fixed centre
    that turns at all instants; None for others.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.gallery.load("cam_follower"), turn=True)
    >>> path = follower_path(run, run.mechanism["contact"])
    >>> round(path.base_radius(), 9), path.along
    (40.0, (6.123233995736766e-17+1j))
    """
    follower = joint.j.body
    held = [
        one
        for one in run.mechanism.joints
        if set(one.bodies) == {"ground", follower} and isinstance(one, Prismatic | Revolute)
    ]
    centre, place = run.point(joint.i), run.point(joint.j)
    middle, seen = centre.x + 1j * centre.y, place.x + 1j * place.y
    size = float(np.abs(seen - middle).max())
    moved = float(np.abs(middle - middle[0]).max())
    omega, alpha = run[joint.i.body].omega, run[joint.i.body].alpha
    steady = np.abs(omega).min() > FIXED * np.abs(omega).max(initial=0.0)
    if len(held) != 1 or moved > FIXED * size or not steady or np.ptp(np.sign(omega)):
        return None
    (guide,) = held
    p = seen - middle
    v, a = place.vx + 1j * place.vy, place.ax + 1j * place.ay
    numbers = run.system.numbers
    mirror = bool(omega[0] < 0.0)
    side = "i" if guide.i.body == "ground" else "j"
    along, pivot = 0j, 0j
    if isinstance(guide, Prismatic):
        along = complex(np.exp(1j * float(numbers.angle(guide, side))))
        x1, x2 = (v * np.conj(along)).real, (a * np.conj(along)).real
    else:
        pivot = complex(*map(float, numbers.place(guide, side))) - complex(middle[0])
        x1, x2 = run[follower].omega, run[follower].alpha
    normal: Any = None
    if joint.flat:
        normal = 1j * np.exp(1j * (run[follower].angle + float(numbers.angle(joint, "j"))))
    # by the angle of a cam that turns counter-clockwise
    first, second = x1 / np.abs(omega), (x2 - x1 * alpha / omega) / omega**2
    if mirror:
        p, along, pivot = np.conj(p), along.conjugate(), pivot.conjugate()
        normal = None if normal is None else np.conj(normal)
        if isinstance(guide, Revolute):
            first, second = -first, -second
    roller = 0.0 if joint.flat else float(numbers[f"{joint.name}.roller"])
    return FollowerPath(p, first, second, along, pivot, normal, roller)
