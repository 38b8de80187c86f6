"""Zero crossings between samples, by values and rates: no two pass unseen where a cubic shows them.

Two crossings between two samples leave no change of sign, but an extremum, and its place is where
the rate changes its sign: a cubic through values and rates of both ends (Hermite's) tells it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["bracketed_root", "extrema", "may_be_zero", "refined", "sign_changes"]

Array = np.ndarray
#: Times, values and rates of one quantity, ascending.
Samples = tuple[Array, Array, Array]

#: Rounds in which samples are added; places converge quadratically, so that few are used.
ROUNDS = 12
#: An extremum this near to zero, in errors of the cubic that shows it, may lie beyond it.
UNSURE = 10.0
#: An extremum that goes towards zero by less than this part of the nearer end hides none: a cubic
#: through values and rates is not wrong by a hundred times what it shows.
SHALLOW = 0.01
#: Part of an interval in which an extremum is not distinguished from its end.
END = 1e-6


def extrema(h: Array, a: Array, b: Array, da: Array, db: Array) -> tuple[Array, Array]:
    """Where cubics are extreme within their intervals: parts of these (2, intervals), and the
    values there; NaN where there is none.

    Parameters
    ----------
    h : array (intervals,)
        Lengths.
    a, b, da, db : arrays (intervals,)
        Values and rates at both ends.

    >>> x, value = extrema(*np.array([[2.0], [0.1], [0.1], [-1.0], [1.0]]))
    >>> x[:, 0], value[:, 0]
    (array([0.5, nan]), array([-0.4,  nan]))
    """
    with np.errstate(all="ignore"):
        p, q, d = h * da, h * db, b - a
        # the slope p + 2 (3d − 2p − q) x + 3 (p + q − 2d) x², its roots by the stable formula
        half, square = 3.0 * d - 2.0 * p - q, 3.0 * (p + q - 2.0 * d)
        root = np.sqrt(half * half - square * p)
        w = -(half + np.copysign(root, half))
        x = np.array([w / square, p / w])
        x[0] = np.where(square == 0.0, np.nan, x[0])
        x[~((x > 0.0) & (x < 1.0))] = np.nan
        x = np.sort(x, axis=0)
        value = a + x * (p + x * (half + (square / 3.0) * x))
    return x, value


def _hidden(samples: Samples, near: float, unsure: Any) -> tuple[Array, Array, Array]:
    """Extrema of cubics (2, …, intervals), as `extrema` has them, and which of them may hide a zero
    between two samples of the same sign, or two beside the one that the samples show.
    """
    t, g, r = samples
    h, a, b = np.diff(t), g[..., :-1], g[..., 1:]
    places, predicted = extrema(h, a, b, r[..., :-1], r[..., 1:])
    # what lies between both ends, on their side of zero, hides nothing
    low, high = np.minimum(a, b), np.maximum(a, b)
    deep = 1.0 - SHALLOW
    beyond = ((predicted < deep * low) & (low > 0.0) & (predicted < unsure)) | (
        (predicted > deep * high) & (high < 0.0) & (-predicted < unsure)
    )
    # of ends on both sides, what goes back across zero on its way
    back = (low <= 0.0) & (high >= 0.0) & ((predicted < low) | (predicted > high))
    inner = (places > END) & (places < 1.0 - END) & (h > near) & (beyond | back)
    return places, predicted, inner


def may_be_zero(t: Array, g: Array, r: Array, near: float) -> Array:
    """Which of many functions (functions,) have a zero, or an extremum that may hide one: times
    (instants,), values and rates (functions, instants), and `near` as in `refined`.
    """
    hides = _hidden((t, g, r), near, np.inf)[2].any(axis=(0, -1))
    return np.asarray(hides | _changes_sign(g).any(axis=-1))


def refined(
    sample: Callable[[Array], tuple[Array, Array]], samples: Samples, near: float
) -> Samples:
    """Samples with extrema added, until no cubic between two of them reaches beyond zero without
    a sample there.

    Parameters
    ----------
    sample : callable
        Values and rates at times.
    given : triple of arrays (instants,)
        Times, values, rates.
    near : float
        Times nearer to each other than this are one.
    """
    t, g, r = samples
    fresh = np.ones(len(t) - 1, dtype=bool)  # intervals that are still to be looked at
    unsure = np.full(len(t) - 1, np.inf)
    for _ in range(ROUNDS):
        places, predicted, inner = _hidden((t, g, r), near, unsure)
        inner &= fresh
        if not inner.any():
            break
        row, column = np.nonzero(inner)
        times = t[column] + places[row, column] * np.diff(t)[column]
        values, rates = sample(times)
        error = np.abs(values - predicted[row, column])
        order = np.argsort(times, kind="stable")
        at = np.searchsorted(t, times[order])
        fresh = np.zeros(len(t) + len(times) - 1, dtype=bool)
        bound = np.zeros_like(fresh, dtype=float)
        t = np.insert(t, at, times[order])
        g = np.insert(g, at, values[order])
        r = np.insert(r, at, rates[order])
        for k, off in zip(at + np.arange(len(at)), error[order], strict=True):
            fresh[k - 1 : k + 1] = True
            bound[k - 1 : k + 1] = np.maximum(bound[k - 1 : k + 1], UNSURE * off)
        unsure = bound
    return t, g, r


def sign_changes(t: Array, g: Array) -> list[int]:
    """Numbers of the intervals whose ends lie on two sides of zero, or end at it."""
    return np.flatnonzero(_changes_sign(g)).tolist()


def _changes_sign(g: Array) -> Array:
    a, b = g[..., :-1], g[..., 1:]
    return np.asarray(((a > 0.0) & (b <= 0.0)) | ((a < 0.0) & (b >= 0.0)))


def bracketed_root(
    value: Callable[[float], float],
    left: tuple[float, float],
    right: tuple[float, float],
    near: float,
) -> float:
    """A zero between two places of opposite signs, (x, value) each, to `near`; never many more
    steps than bisection.

    Oliveira, Takahashi: An enhancement of the bisection method average performance preserving
    minmax optimality (2021), the method ITP.

    >>> round(bracketed_root(lambda x: x * x - 2.0, (1.0, -1.0), (2.0, 2.0), 1e-12), 11)
    1.41421356237
    """
    (a, fa), (b, fb) = left, right
    if fb == 0.0:
        return b
    near = max(near, 4.0 * math.ulp(max(abs(a), abs(b))))
    slack = near * 2.0 ** (math.ceil(math.log2(max((b - a) / (2.0 * near), 1.0))) + 1)
    blunt = 0.2 / (b - a)
    while b - a > 2.0 * near:
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        straight = (b * fa - a * fb) / (fa - fb)
        sense, off = math.copysign(1.0, middle - straight), blunt * (b - a) ** 2
        x = straight + sense * off if off <= abs(middle - straight) else middle
        if abs(x - middle) > slack - half:
            x = middle - sense * (slack - half)
        here = value(x)
        if here == 0.0:
            return x
        if (here > 0.0) == (fa > 0.0):
            a, fa = x, here
        else:
            b, fb = x, here
        slack *= 0.5
    return min(max((b * fa - a * fb) / (fa - fb), a), b)
