"""A table of two variables in the kernels: bicubic patches."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mbody.core.decorators import njit
from mbody.core.dual_number import value
from mbody.core.lanes import larger, smaller
from mbody.laws.kernels import TOLERANCE, interval

__all__ = ["HEAD", "PATCH", "surface"]

FloatArray: TypeAlias = NDArray[np.float64]

#: Numbers before the knots: how many along x, how many along y, the code of what holds outside.
HEAD = 3
#: Coefficients of a patch.
PATCH = 16


@njit
def surface(tab: FloatArray, k: int, x: float, y: float) -> tuple[float, float, float]:
    """f, ∂f/∂x, ∂f/∂y; NaN where there is none.

    tab = (m, n, outside code, m knots of x, n knots of y, patches), a patch of 16 coefficients of
    uⁱ vʲ, i first, with u and v from the lower corner; those along y follow each other.
    """
    m, n, outside = int(tab[k]), int(tab[k + 1]), int(tab[k + 2])
    of_x = k + HEAD
    of_y = of_x + m
    x0, x1 = tab[of_x], tab[of_x + m - 1]
    y0, y1 = tab[of_y], tab[of_y + n - 1]
    p, q = x, y
    if outside > 0:
        p, q = smaller(larger(x, x0), x1), smaller(larger(y, y0), y1)
    wide, high = TOLERANCE * (x1 - x0), TOLERANCE * (y1 - y0)
    within = p >= x0 - wide and p <= x1 + wide and q >= y0 - high and q <= y1 + high
    if not within or x != x or y != y:
        return math.nan, math.nan, math.nan
    i, j = interval(tab, of_x, m, value(p)), interval(tab, of_y, n, value(q))
    u, v = p - tab[of_x + i], q - tab[of_y + j]
    c = of_y + n + PATCH * (i * (n - 1) + j)
    f = fx = fy = 0.0
    for a in range(3, -1, -1):
        o = c + 4 * a
        g = tab[o] + v * (tab[o + 1] + v * (tab[o + 2] + v * tab[o + 3]))
        gy = tab[o + 1] + v * (2.0 * tab[o + 2] + v * 3.0 * tab[o + 3])
        fx = fx * u + f
        f = f * u + g
        fy = fy * u + gy
    if outside == 2:
        return f + fx * (x - p) + fy * (y - q), fx, fy
    if outside == 1:
        return f, (fx if p == x else 0.0), (fy if q == y else 0.0)
    return f, fx, fy
