"""An unknown as a search takes it: its size, its bounds, where it is tried."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mbody.model.mechanism import Mechanism
from mbody.model.study import Unknown
from mbody.quantities import convert
from mbody.quantities.units import DIMENSIONS, Dimension

__all__ = ["Wanted"]

Array = np.ndarray

#: Part of a step by which a bound may be passed.
SLACK = 1e-6


@dataclass(frozen=True)
class Wanted:
    """An unknown as the search takes it: floats in the units of the mechanism.

    Attributes
    ----------
    unknown : Unknown
        As the question gives it.
    name : str
        Dotted name of the number, or driver and part of its motion.
    dimension : Dimension or None
        What it measures.
    present, start, low, high : float
        What it is in the description, where the search begins, and its bounds.
    scale : float
        What is one step.
    steady : bool
        Whether no position depends on it.
    angle : bool
        Whether it is the angle of a driver: positions are the same after a turn, as a rule.
    """

    unknown: Unknown
    name: str
    dimension: Dimension | None
    present: float
    start: float
    low: float
    high: float
    scale: float
    steady: bool
    angle: bool = False

    @property
    def turns(self) -> bool:
        """Whether it is the angle of a driver without bounds."""
        return self.angle and not (math.isfinite(self.low) or math.isfinite(self.high))

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds in steps, infinite where there are none."""
        return self.low / self.scale, self.high / self.scale

    @property
    def turn(self) -> float:
        """A whole turn in steps, of the angle of a driver; else 0."""
        return 2.0 * math.pi / self.scale if self.angle else 0.0

    @property
    def grid(self) -> Array:
        """Where it is tried, in steps."""
        low, high, start = (part / self.scale for part in (self.low, self.high, self.start))
        if math.isfinite(low) and math.isfinite(high):
            return np.linspace(low, high, 73)
        if self.turns:
            grid = start + np.linspace(0.0, 2.0 * math.pi, 73) / self.scale
        else:
            powers = 10.0 ** np.linspace(-3.0, 3.0, 37)
            grid = np.concatenate([-powers[::-1], powers])
        inside = grid[(grid >= low) & (grid <= high)]
        return inside if len(inside) else np.array([start])

    def allows(self, u: float) -> bool:
        """Whether a value, in steps, lies within the bounds."""
        slack = SLACK * (1.0 + abs(u))
        return (u + slack) * self.scale >= self.low and (u - slack) * self.scale <= self.high

    def unwound(self, u: float) -> float:
        """A value, in steps, without whole turns away from the start."""
        if not self.turns:
            return u
        start, turn = self.start / self.scale, 2.0 * math.pi / self.scale
        return start + math.remainder(u - start, turn) if abs(u - start) > 0.5 * turn else u

    def apart(self, a: float, b: float) -> float:
        """How far two values are from each other, in steps."""
        if self.turns:
            return abs(math.remainder(a - b, 2.0 * math.pi / self.scale))
        return abs(a - b)

    def shown(self, u: float, mechanism: Mechanism) -> tuple[float, str]:
        """A value as results give it, and its unit."""
        value, dimension = u * self.scale, self.dimension
        own = mechanism.units.of(dimension) if dimension else ""
        unit = self.unknown.unit or ("deg" if dimension == DIMENSIONS["angle"] else own)
        if unit == own or dimension is None:
            return value, own
        return float(convert(value, own, unit)), unit
