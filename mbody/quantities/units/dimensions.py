"""Dimensions as powers of length, mass, time, angle, electric current and temperature.

The angle counts as a dimension of its own, so that 5 Hz differs from 5 rad/s and N·m from N·m/rad;
in products of quantities a radian is one, as usual, and in every electrical quantity, so that the
constant of a motor may be written in N·m/A or in V·s/rad.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

__all__ = ["DIMENSIONS", "NUMBER", "Dimension", "dimension_of", "name_of"]


@dataclass(frozen=True)
class Dimension:
    """Powers of the six base dimensions.

    >>> DIMENSIONS["length"] / DIMENSIONS["time"] == DIMENSIONS["velocity"]
    True
    """

    length: Fraction = Fraction(0)
    mass: Fraction = Fraction(0)
    time: Fraction = Fraction(0)
    angle: Fraction = Fraction(0)
    current: Fraction = Fraction(0)
    temperature: Fraction = Fraction(0)

    def _with(self, other: Dimension, sign: int) -> Dimension:
        return Dimension(
            self.length + sign * other.length,
            self.mass + sign * other.mass,
            self.time + sign * other.time,
            self.angle + sign * other.angle,
            self.current + sign * other.current,
            self.temperature + sign * other.temperature,
        )

    def __mul__(self, other: Dimension) -> Dimension:
        return self._with(other, 1)

    def __truediv__(self, other: Dimension) -> Dimension:
        return self._with(other, -1)

    def __pow__(self, power: Fraction | int) -> Dimension:
        return Dimension(
            self.length * power,
            self.mass * power,
            self.time * power,
            self.angle * power,
            self.current * power,
            self.temperature * power,
        )

    @property
    def mechanical(self) -> Dimension:
        """The same with the radian counted as one."""
        return replace(self, angle=Fraction(0))


def _make(*powers: int) -> Dimension:
    return Dimension(*map(Fraction, powers))


#: No dimension: a ratio, a count.
NUMBER = Dimension()

#: Dimensions by name; where several names have the same dimension, messages use the first.
DIMENSIONS = {
    "number": NUMBER,
    "length": _make(1, 0, 0),
    "mass": _make(0, 1, 0),
    "time": _make(0, 0, 1),
    "angle": _make(0, 0, 0, 1),
    "force": _make(1, 1, -2),
    "force rate": _make(1, 1, -3),
    "weight": _make(1, 1, -2),
    "torque": _make(2, 1, -2),
    "velocity": _make(1, 0, -1),
    "acceleration": _make(1, 0, -2),
    "angular velocity": _make(0, 0, -1, 1),
    "angular acceleration": _make(0, 0, -2, 1),
    "inertia": _make(2, 1, 0),
    "stiffness": _make(0, 1, -2),
    "damping": _make(0, 1, -1),
    "torsion stiffness": _make(2, 1, -2, -1),
    "torsion damping": _make(2, 1, -1, -1),
    "power": _make(2, 1, -3),
    "angular momentum": _make(2, 1, -1),
    "frequency": _make(0, 0, -1),
    "pressure": _make(-1, 1, -2),
    "area": _make(2, 0, 0),
    "density": _make(-3, 1, 0),
    "volume": _make(3, 0, 0),
    "volume flow": _make(3, 0, -1),
    "current": _make(0, 0, 0, 0, 1),
    "voltage": _make(2, 1, -3, 0, -1),
    "resistance": _make(2, 1, -3, 0, -2),
    "inductance": _make(2, 1, -2, 0, -2),
    "capacitance": _make(-2, -1, 4, 0, 2),
    "motor constant": _make(2, 1, -2, 0, -1),
    "temperature": _make(0, 0, 0, 0, 0, 1),
}

_NAMES: dict[Dimension, str] = {}
for _name, _dimension in DIMENSIONS.items():
    _NAMES.setdefault(_dimension, _name)


def dimension_of(name: str | Dimension) -> Dimension:
    """The dimension of that name.

    >>> dimension_of("torque") == dimension_of("force") * dimension_of("length")
    True
    """
    return name if isinstance(name, Dimension) else DIMENSIONS[name]


def name_of(dimension: Dimension) -> str:
    """Its name, empty where it has none.

    >>> name_of(DIMENSIONS["force"] * DIMENSIONS["length"])
    'torque'
    """
    return _NAMES.get(dimension, "")
