"""Second-order Taylor arithmetic along many lines, of complex numbers: derivatives by coordinates,
whose imaginary parts carry a complex step by a number of the description.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def lifted(x: Any, f: float, slope: float) -> complex:
    """A function of a complex step: its value and slope at the real part."""
    return complex(f, complex(x).imag * slope)


def sin(x: Any) -> Any:
    if isinstance(x, Taylor):
        return circle(x)[1]
    return lifted(x, math.sin(complex(x).real), math.cos(complex(x).real))


def cos(x: Any) -> Any:
    if isinstance(x, Taylor):
        return circle(x)[0]
    return lifted(x, math.cos(complex(x).real), -math.sin(complex(x).real))


def circle(x: Any) -> tuple[Any, Any]:
    """(cos, sin), which an angle along lines keeps: a body's angle turns all of its places."""
    if not isinstance(x, Taylor):
        return cos(x), sin(x)
    if x.turned is None:
        c, s = cos(x.f), sin(x.f)
        x.turned = x.through(c, -s, -c), x.through(s, c, -s)
    return x.turned


def sqrt(x: Any) -> Any:
    if isinstance(x, Taylor):
        root = sqrt(x.f)
        return x.through(root, 0.5 / root, -0.25 / (root * x.f))
    root = math.sqrt(complex(x).real)
    return lifted(x, root, 0.5 / root)


def exp(x: Any) -> complex:
    f = math.exp(complex(x).real)
    return lifted(x, f, f)


def log(x: Any) -> complex:
    return lifted(x, math.log(complex(x).real), 1.0 / complex(x).real)


def size(x: Any) -> Any:
    """|x| of a number that is not complex but for its step."""
    return x if complex(x).real >= 0.0 else -x


def direction(dx: Any, dy: Any) -> Any:
    """Angle of a vector [rad] in the principal range."""
    if isinstance(dx, Taylor):
        square = dx.f * dx.f + dy.f * dy.f
        # dφ = (x dy − y dx)/r²; the second derivative by the product rule
        turn = (dx.f * dy.f1 - dy.f * dx.f1) / square
        bend = (dx.f * dy.f2 - dy.f * dx.f2) / square
        bend = bend - 2.0 * turn * (dx.f * dx.f1 + dy.f * dy.f1) / square
        return Taylor(direction(dx.f, dy.f), turn, bend)
    x, y = complex(dx), complex(dy)
    square = x.real**2 + y.real**2
    angle = math.atan2(y.real, x.real)
    return complex(angle, (x.real * y.imag - y.real * x.imag) / square)


class Taylor:
    """f, f′, f″ along every line: f a complex number, the others arrays (lines,)."""

    __slots__ = ("f", "f1", "f2", "turned")
    __array_ufunc__ = None

    def __init__(self, f: Any, f1: Any, f2: Any) -> None:
        self.f, self.f1, self.f2 = complex(f), f1, f2
        self.turned: tuple[Taylor, Taylor] | None = None

    def through(self, f: Any, g: Any, h: Any) -> Taylor:
        """A function of self with value f, derivative g, second derivative h."""
        return Taylor(f, g * self.f1, g * self.f2 + h * self.f1 * self.f1)

    def __add__(self, b: Any) -> Taylor:
        if isinstance(b, Taylor):
            return Taylor(self.f + b.f, self.f1 + b.f1, self.f2 + b.f2)
        return Taylor(self.f + b, self.f1, self.f2)

    def __neg__(self) -> Taylor:
        return Taylor(-self.f, -self.f1, -self.f2)

    def __sub__(self, b: Any) -> Taylor:
        return self + (-b)

    def __rsub__(self, b: Any) -> Taylor:
        return -self + b

    def __mul__(self, b: Any) -> Taylor:
        if isinstance(b, Taylor):
            second = self.f2 * b.f + 2.0 * self.f1 * b.f1 + self.f * b.f2
            return Taylor(self.f * b.f, self.f1 * b.f + self.f * b.f1, second)
        return Taylor(self.f * b, self.f1 * b, self.f2 * b)

    def __truediv__(self, b: Any) -> Taylor:
        if isinstance(b, Taylor):
            one = 1.0 / b.f
            return self * b.through(one, -one * one, 2.0 * one * one * one)
        return self * (1.0 / b)

    __radd__, __rmul__ = __add__, __mul__


def lines(q: Any, v: Any, t: Any) -> tuple[list[Taylor], Taylor]:
    """Coordinates and time along 3n + 2 lines: each coordinate, time alone, and the motion."""
    count = len(q) + 2
    zero = np.zeros(count, complex)
    found = []
    for n, x in enumerate(q):
        f1 = zero.copy()
        f1[n], f1[-1] = 1.0, v[n]
        found.append(Taylor(x, f1, zero))
    clock = zero.copy()
    clock[-2:] = 1.0
    return found, Taylor(t, clock, zero)
