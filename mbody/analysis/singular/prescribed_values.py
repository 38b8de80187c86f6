"""Values that a start prescribes: coordinates of bodies and rates, as equations in q and v."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.system.system import System

__all__ = ["Prescribed"]

Array = np.ndarray

#: Keys of coordinates and rates by the row that both share: ∂(x, y, θ)/∂q = ∂(vx, vy, ω)/∂v.
X, Y, TURN = ("x", "vx"), ("y", "vy"), ("angle", "omega")


@dataclass(frozen=True)
class Prescribed:
    """A coordinate of a body, or its rate, and the value that it is to have.

    `key` is x or y of the origin of the body's axes, or angle; vx or vy of that origin, or omega.
    """

    body: str
    key: str
    value: float

    @property
    def name(self) -> str:
        """Such as "crank.angle"."""
        return f"{self.body}.{self.key}"

    def unit(self, system: System) -> float:
        """The model length, or one of angles: what values are divided by for `row`."""
        return 1.0 if self.key in TURN else system.length

    def row(self, system: System, q: Array) -> Array:
        """Derivative by coordinates without units of length, (coordinates,), at a position q.

        The origin is r − A(θ) c with the mass centre r and its place c on the body, so that its
        derivative by θ is −A′(θ) c.
        """
        first = 3 * system.bodies[self.body]
        row = np.zeros(system.coordinates)
        if self.key in TURN:
            row[first + 2] = 1.0
            return row
        x, y = self._arm(system, q)
        row[first + (self.key in Y)] = 1.0
        row[first + 2] = (-x if self.key in Y else y) / system.length
        return row

    def at(self, system: System, q: Array) -> float:
        """The coordinate at a position q, by its unit."""
        first = 3 * system.bodies[self.body]
        if self.key in TURN:
            return float(q[first + 2])
        k = int(self.key in Y)
        return float(q[first + k] - self._arm(system, q)[k]) / system.length

    def _arm(self, system: System, q: Array) -> tuple[float, float]:
        """The mass centre from the origin of the body's axes: A(θ) c."""
        cx, cy = system.numbers.point(f"{self.body}.cg")
        theta = q[3 * system.bodies[self.body] + 2]
        c, s = np.cos(theta), np.sin(theta)
        return c * cx - s * cy, s * cx + c * cy

    def unit_name(self, system: System) -> str:
        """Unit in which the value is written: angles in degrees, all else in the model's units."""
        units = system.mechanism.units
        names = {"angle": "deg", "x": units.length, "y": units.length}
        rate = "angular velocity" if self.key in TURN else "velocity"
        return names.get(self.key) or units.of(rate)

    def with_value(self, system: System, value: float) -> str:
        """Such as "crank.angle = 30 deg" or "crank.omega = 6 rad/s"."""
        shown, digits = value, 6
        if self.key in ("x", "y", "angle"):
            shown, digits = (np.degrees(value) if self.key == "angle" else value), 7
        return f"{self.name} = {shown:.{digits}g} {self.unit_name(system)}"
