"""Zeros in brackets, of one function or of many side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any, NamedTuple, TypeVar

import numpy as np

T = TypeVar("T")

#: Evaluations at most.
STEPS = 120


class Bracket(NamedTuple):
    """A bracket of a zero, as narrow as was asked for.

    `x`: The end with the lesser value.
    `above`, `below`: The end where the function is not negative, and the one where it is.
    `converged`: Whether it is so narrow, or `x` a zero; else the function had no value within it,
      or one sign at both ends.
    """

    x: float
    above: float
    below: float
    converged: bool


def _search(
    a: float, b: float, fa: float, fb: float, width: float, guess: float = math.nan
) -> Generator[float, float, Bracket]:
    """The places to be tried one after the other; it is sent the values there.

    The secant at first, then inverse quadratic interpolation where the last three places are in
    order for it, else the middle (Chandrupatla, Adv. Eng. Software 28 (1997) 145). Values that
    are ±1 alone, or infinite, so lead to bisection.
    """
    part = fa / (fa - fb) if math.isfinite(fa - fb) and fa != fb else 0.5
    part = part if math.isnan(guess) else (guess - a) / (b - a)
    narrow = False
    for _ in range(STEPS if (fa >= 0.0) != (fb >= 0.0) else 0):
        least = max(width, math.ulp(max(abs(a), abs(b))))
        narrow = abs(b - a) <= least or fa == 0.0 or fb == 0.0
        if narrow:
            break
        edge = min(least / abs(b - a), 0.5)
        x = a + min(max(part, edge), 1.0 - edge) * (b - a)
        f = yield x
        if math.isnan(f):
            break
        # the newest place becomes a, the end of other sign b, the place that is left over c
        c, fc, b, fb = (a, fa, b, fb) if (f >= 0.0) == (fa >= 0.0) else (b, fb, a, fa)
        a, fa = x, f
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        part = 0.5
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc)
            part += (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    ends = (a, b) if fa >= 0.0 else (b, a)
    return Bracket(a if abs(fa) <= abs(fb) else b, *ends, narrow)


def zero_between(
    function: Callable[[float], float],
    ends: tuple[float, float],
    values: tuple[float, float],
    width: float = 0.0,
    guess: float = math.nan,
) -> Bracket:
    """Zero of a function between two ends with values of different sign, to a width or to the last
    bit, from a guess where there is one; the search ends early where the function is NaN.

    >>> zero_between(lambda x: x * x - 2.0, (1.0, 2.0), (-1.0, 2.0)).above
    1.4142135623730951
    """
    columns = [(float(one),) for one in (*ends, *values, width, guess)]
    return zeros_between(lambda x: np.array([function(x.item())]), *columns)[0]


def zeros_between(function: Callable[[np.ndarray], np.ndarray], *columns: Any) -> list[Bracket]:
    """Zeros in many brackets, evaluated together; `columns`: both ends, values there and widths,
    (n,) each.
    """
    searches = [_search(*row) for row in np.column_stack(columns).tolist()]
    x, found = np.array(columns[0], dtype=float), dict[int, Bracket]()
    f: Any = [None] * len(searches)
    while True:
        for n, search in enumerate(searches):
            if n not in found:
                try:
                    x[n] = search.send(f[n])
                except StopIteration as end:
                    found[n] = end.value
        if len(found) == len(searches):
            return [found[n] for n in range(len(searches))]
        f = function(x).tolist()


def place_between(
    at: Callable[[float], T | None],
    value: Callable[[T], float],
    ends: dict[float, T],
    width: float,
    guess: float = math.nan,
) -> tuple[T, T, T]:
    """The place on a curve at which a value passes zero, and the ends of its bracket in their order
    on the curve; `at` gives places, None where there is none, `ends` two by their parameters.
    """
    places = dict(ends)

    def passing(x: float) -> float:
        place = at(x)
        if place is None:
            return math.nan
        places[x] = place
        return value(place)

    first, last = ends
    values = value(ends[first]), value(ends[last])
    found = zero_between(passing, (first, last), values, width, guess)
    low, high = sorted((found.above, found.below), reverse=last < first)
    return places[found.x], places[low], places[high]


def last_place(
    holds: Callable[[float], bool], good: float, bad: float, width: float = 0.0
) -> float:
    """The last place at which a condition holds on the way from a good one to a bad one, by
    bisection.
    """
    return zero_between(lambda x: 1.0 if holds(x) else -1.0, (good, bad), (1.0, -1.0), width).above
