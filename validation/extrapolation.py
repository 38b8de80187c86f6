"""Ordinary differential equations by extrapolation: a route that no step of mbody takes.

Gragg's midpoint rule over an interval in 2, 4, … 16 parts, extrapolated in the square of the part
(Bulirsch and Stoer): order 16. W. B. Gragg: On extrapolation algorithms for ordinary initial value
problems, SIAM Journal on Numerical Analysis 2 (1965), 384-403.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

__all__ = ["AGREED", "followed"]

Array = np.ndarray

COLUMNS = 8
#: Two runs, one in twice as many intervals as the other, agree to this part of the greatest number.
AGREED = 1e-12


def followed(slope: Callable[[Array], Array], y: Array, time: float) -> Array:
    """y after a time, of y' = slope(y): intervals are halved until two runs agree to `AGREED`."""
    parts, last = 8, np.full(y.shape, np.nan)
    while parts <= 4096:
        here = y
        for _ in range(parts):
            here = _interval(slope, here, time / parts)
        if np.abs(here - last).max() <= AGREED * np.abs(here).max():
            return here
        parts, last = 2 * parts, here
    raise ArithmeticError("the intervals do not become fine enough")


def _interval(slope: Callable[[Array], Array], y: Array, step: float) -> Array:
    """One interval: midpoint rules, then Neville's table in the squares of their parts."""
    row: list[Array] = []
    first = slope(y)
    for n in range(1, COLUMNS + 1):
        h = step / (2 * n)
        before, here = y, y + h * first
        for _ in range(2 * n - 1):
            before, here = here, before + 2.0 * h * slope(here)
        new = [0.5 * (here + before + h * slope(here))]
        for k, older in enumerate(row, start=1):
            new.append(new[-1] + (new[-1] - older) / ((n / (n - k)) ** 2 - 1.0))
        row = new
    return row[-1]
