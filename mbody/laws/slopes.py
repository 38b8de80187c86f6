"""Slopes at the points of a table (pchip, cubic splines), from its intervals and chord slopes."""

from __future__ import annotations

import numpy as np

from mbody.laws.base import FloatArray
from mbody.laws.kernels import thomas

__all__ = ["of_pchip", "of_periodic_spline", "of_spline"]


def of_pchip(h: FloatArray, chord: FloatArray, periodic: bool) -> FloatArray:
    """f′ at the points of a monotone piecewise cubic, (N,), from the intervals h and the slopes of
    their chords, (N − 1,).

    At inner points the weighted harmonic mean of both chords, 0 at an extreme (Fritsch and Butland
    1984); at the ends a three-point formula, limited so that the curve remains monotone.
    """
    if periodic:  # every point is an inner point
        before, left = np.roll(h, 1), np.roll(chord, 1)
        d = _mean(before, h, left, chord)
        return np.append(d, d[0])
    if h.size == 1:
        return np.array([chord[0], chord[0]])
    inner = _mean(h[:-1], h[1:], chord[:-1], chord[1:])
    first = _end(h[0], h[1], chord[0], chord[1])
    return np.concatenate([[first], inner, [_end(h[-1], h[-2], chord[-1], chord[-2])]])


def _mean(h0: FloatArray, h1: FloatArray, s0: FloatArray, s1: FloatArray) -> FloatArray:
    """Slope between two chords: 0 where their signs differ."""
    w0, w1 = 2.0 * h1 + h0, h1 + 2.0 * h0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = (w0 + w1) / (w0 / s0 + w1 / s1)
    return np.where(np.sign(s0) * np.sign(s1) > 0.0, mean, 0.0)


def _end(h0: float, h1: float, s0: float, s1: float) -> float:
    """Slope at an end: s0 is the slope of the chord there, s1 that of the next chord."""
    d = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1)
    if np.sign(d) != np.sign(s0):
        return 0.0
    if np.sign(s0) != np.sign(s1) and abs(d) > 3.0 * abs(s0):
        return float(3.0 * s0)
    return float(d)


def of_spline(h: FloatArray, chord: FloatArray, end: str) -> FloatArray:
    """f′ at the knots of a cubic spline, (N,), from the intervals h and the slopes of their chords,
    (N − 1,); `end` as of a `Table`.
    """
    n = h.size + 1
    if end == "not-a-knot" and n == 2:
        return np.array([chord[0], chord[0]])
    if end == "not-a-knot" and n == 3:  # the parabola through three points
        bend = (chord[1] - chord[0]) / (h[0] + h[1])
        return np.array([chord[0] - bend * h[0], chord[0] + bend * h[0], chord[1] + bend * h[1]])
    lower, diagonal, upper, right = np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n)
    # equal f″ from both sides of an inner knot
    lower[1:-1], diagonal[1:-1], upper[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * (h[1:] * chord[:-1] + h[:-1] * chord[1:])
    if end == "natural":
        diagonal[0] = diagonal[-1] = 2.0
        upper[0] = lower[-1] = 1.0
        right[0], right[-1] = 3.0 * chord[0], 3.0 * chord[-1]
    elif end == "not-a-knot":
        for k, a, b in ((0, 0, 1), (n - 1, -1, -2)):  # equal f‴ on both sides of the next knot
            both = h[a] + h[b]
            diagonal[k] = h[b]
            right[k] = ((h[a] + 2.0 * both) * h[b] * chord[a] + h[a] ** 2 * chord[b]) / both
        upper[0], lower[-1] = h[0] + h[1], h[-1] + h[-2]
    solution = right.reshape(-1, 1)
    thomas(lower, diagonal, upper, solution)
    return solution[:, 0]


def of_periodic_spline(h: FloatArray, chord: FloatArray) -> FloatArray:
    """f′ at the knots of a periodic spline, (N,): cyclic system by a rank-one correction."""
    n = h.size
    before, left = np.roll(h, 1), np.roll(chord, 1)
    lower, diagonal, upper = h.copy(), 2.0 * (before + h), before.copy()
    right = 3.0 * (h * left + before * chord)
    if n < 3:  # the corners fall onto the other entries
        full = np.zeros((n, n))
        for i in range(n):
            for j, value in ((i - 1, lower[i]), (i, diagonal[i]), (i + 1, upper[i])):
                full[i, j % n] += value
        d = np.linalg.solve(full, right)
        return np.append(d, d[0])
    top, corner, shift = lower[0], upper[-1], -diagonal[0]
    diagonal[0] -= shift
    diagonal[-1] -= top * corner / shift
    both = np.zeros((n, 2))
    both[:, 0] = right
    both[0, 1], both[-1, 1] = shift, corner
    thomas(lower, diagonal, upper, both)
    p, u = both[:, 0], both[:, 1]
    d = p - u * (p[0] + top * p[-1] / shift) / (1.0 + u[0] + top * u[-1] / shift)
    return np.append(d, d[0])
