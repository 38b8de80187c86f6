"""Second-order Taylor arithmetic: derivatives along a line, exact to rounding."""

from __future__ import annotations

import math
from typing import Any


class Jet:
    """f, f′, f″ along one line: arithmetic of second-order Taylor series, exact to rounding."""

    __slots__ = ("f", "f1", "f2")

    def __init__(self, f: float, f1: float = 0.0, f2: float = 0.0) -> None:
        self.f, self.f1, self.f2 = f, f1, f2

    def through(self, f: float, g: float, h: float) -> Jet:
        """A function of self with value f, derivative g, second derivative h."""
        return Jet(f, g * self.f1, g * self.f2 + h * self.f1**2)

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.f + other, self.f1, self.f2)
        return Jet(self.f + other.f, self.f1 + other.f1, self.f2 + other.f2)

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.f * other, self.f1 * other, self.f2 * other)
        a, b = self, other
        return Jet(a.f * b.f, a.f1 * b.f + a.f * b.f1, a.f2 * b.f + 2.0 * a.f1 * b.f1 + a.f * b.f2)

    def __pow__(self, p: float) -> Jet:
        if p == 0:
            return Jet(1.0)
        if p == 1:
            return self
        return self.through(
            self.f**p, p * self.f ** (p - 1), p * (p - 1) * self.f ** (p - 2) if p != 2 else 2.0
        )

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Any) -> Jet:
        return self + other * -1.0

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __truediv__(self, other: Any) -> Jet:
        return self * (other**-1 if isinstance(other, Jet) else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return self**-1 * other

    __radd__, __rmul__ = __add__, __mul__

    # NumPy's functions call these methods on objects
    def sqrt(self) -> Jet:
        """√f."""
        return self**0.5

    def cos(self) -> Jet:
        """cos f."""
        c, s = math.cos(self.f), math.sin(self.f)
        return self.through(c, -s, -c)

    def sin(self) -> Jet:
        """sin f."""
        c, s = math.cos(self.f), math.sin(self.f)
        return self.through(s, c, -s)

    def arctan(self) -> Jet:
        """arctan f."""
        slope = 1.0 / (1.0 + self.f**2)
        return self.through(math.atan(self.f), slope, -2.0 * self.f * slope**2)

    def exp(self) -> Jet:
        """e to the f."""
        return self.through(*[math.exp(self.f)] * 3)

    def log(self) -> Jet:
        """The natural logarithm."""
        return self.through(math.log(self.f), 1.0 / self.f, -1.0 / self.f**2)
