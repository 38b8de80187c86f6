"""What a body, a point and a joint do at the present instant: numbers, made when they are read
by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mbody.solution.compiled_measures import Present, Read

__all__ = ["BodyNow", "PointNow", "ReactionNow"]


class BodyNow:
    """The present motion of one body: its mass centre and its angle.

    Attributes
    ----------
    x, y, vx, vy, ax, ay : float
        Mass centre, world axes [length, length/time, length/time²].
    angle, omega, alpha : float
        Of the link's x axis [rad], and its rates.
    """

    __slots__ = ("_angle", "_first", "_omega", "_page", "_rate", "_second", "_y", "name")

    def __init__(self, name: str, present: Present) -> None:
        n, b = present.system.coordinates, present.system.bodies[name]
        self.name, self._y, self._page = name, present.y, present.page
        self._first, self._rate, self._second = 3 * b, n + 3 * b, 2 * n + 3 * b
        self._angle, self._omega = self._first + 2, self._rate + 2

    @property
    def x(self) -> float:
        """Mass centre [length]."""
        return self._y[self._first]

    @property
    def y(self) -> float:
        """Mass centre [length]."""
        return self._y[self._first + 1]

    @property
    def angle(self) -> float:
        """Angle of the link's x axis [rad]."""
        return self._y[self._angle]

    @property
    def vx(self) -> float:
        """Velocity of the mass centre [length/time]."""
        return self._y[self._rate]

    @property
    def vy(self) -> float:
        """Velocity of the mass centre [length/time]."""
        return self._y[self._rate + 1]

    @property
    def omega(self) -> float:
        """Angular velocity [rad/time]."""
        return self._y[self._omega]

    @property
    def ax(self) -> float:
        """Acceleration of the mass centre [length/time²]."""
        return self._page()[self._second]

    @property
    def ay(self) -> float:
        """Acceleration of the mass centre [length/time²]."""
        return self._page()[self._second + 1]

    @property
    def alpha(self) -> float:
        """Angular acceleration [rad/time²]."""
        return self._page()[self._second + 2]

    def __repr__(self) -> str:
        return f"{self.name}: x {self.x:.6g}, y {self.y:.6g}, angle {self.angle:.6g} rad"


class _Compiled:
    """Numbers of one history of results, each made when it is first read."""

    __slots__ = ("_made", "_make", "name")

    def __init__(self, name: str, make: Callable[[str], Read]) -> None:
        self.name, self._make = name, make
        self._made: dict[str, Read] = {}

    def _read(self, key: str) -> float:
        read = self._made.get(key)
        if read is None:
            read = self._made[key] = self._make(key)
        return read()


class PointNow(_Compiled):
    """The present motion of a point of a body.

    Attributes
    ----------
    x, y, vx, vy, ax, ay : float
        World axes [length, length/time, length/time²].
    """

    __slots__ = ()

    @property
    def x(self) -> float:
        """Place [length]."""
        return self._read("x")

    @property
    def y(self) -> float:
        """Place [length]."""
        return self._read("y")

    @property
    def vx(self) -> float:
        """Velocity [length/time]."""
        return self._read("vx")

    @property
    def vy(self) -> float:
        """Velocity [length/time]."""
        return self._read("vy")

    @property
    def ax(self) -> float:
        """Acceleration [length/time²]."""
        return self._read("ax")

    @property
    def ay(self) -> float:
        """Acceleration [length/time²]."""
        return self._read("ay")

    def __repr__(self) -> str:
        return f"{self.name}: x {self.x:.6g}, y {self.y:.6g}"


class ReactionNow(_Compiled):
    """The present force and torque on body `on` by body `by` at a joint, world axes.

    Attributes
    ----------
    fx, fy, torque, magnitude : float
        [force, force, force·length, force].
    unique : tuple of three bool, or None
        Whether each of fx, fy, torque is determined, as of `mbody.Reaction`.
    """

    __slots__ = ("by", "on", "unique")

    def __init__(
        self, joint: str, on: str, by: str, unique: Any, make: Callable[[str], Read]
    ) -> None:
        super().__init__(joint, make)
        self.on, self.by, self.unique = on, by, unique

    @property
    def fx(self) -> float:
        """Force [force]."""
        return self._read("fx")

    @property
    def fy(self) -> float:
        """Force [force]."""
        return self._read("fy")

    @property
    def torque(self) -> float:
        """Torque about the joint's place on body j [force·length]."""
        return self._read("torque")

    @property
    def magnitude(self) -> float:
        """√(fx² + fy²) [force]."""
        return math.hypot(self.fx, self.fy)

    def __repr__(self) -> str:
        return f"{self.name} on {self.on}: fx {self.fx:.6g}, fy {self.fy:.6g}"
