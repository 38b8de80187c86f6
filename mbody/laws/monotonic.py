"""Places between which a formula is monotonic, found by adaptive sampling.

A formula does not know its own extremes.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.laws.base import FloatArray, Law

__all__ = ["monotonic_nodes"]

# in one stretch: unevenly spaced, so that they do not coincide with an oscillation
PLACES = np.cumsum(1.0 + 0.5 * np.sin(2.4 * np.arange(33)))
PLACES = (PLACES - PLACES[0]) / np.ptp(PLACES)
WITHIN = 0.382  # of an interval: there f′ is compared with its interpolation from the ends
CLOSE = 0.05  # of f′ nearby: tolerance of that comparison
MAX_PLACES = 1 << 18
MAX_BISECTIONS = 40  # of an interval, at a corner
MAX_STRETCHES = 400


def monotonic_nodes(
    law: Law, sign: float, begin: float, rest: float, t0: float, close: float
) -> FloatArray:
    """Places from t0 on, until ``sign · (f − begin)`` has gained `rest` or fallen by `close`.

    Stretches from t0 on are sampled. The first is as long as the law needs for the rest at its
    present rate, each following one is twice as long. Where the cubic through f′ and f″ at two
    neighbouring places does not predict f′ between them, the interval is bisected. Every extreme
    becomes a place.

    Raises
    ------
    ModelError
        Where the formula has no value.
    """
    first = length = _length(law.raw(np.array([t0]))[0], rest)
    found, count, end, best = [np.array([t0])], 1, t0, 0.0
    for _ in range(MAX_STRETCHES):
        nodes, values = _stretch(law, end, end + length, MAX_PLACES - count)
        if not np.isfinite(values[:, 0]).all():
            if length < 1e-12 * max(first, abs(end)):
                law(nodes)  # raises the error that names the place
            length *= 0.5
            continue
        nodes, values = _with_extremes(law, nodes, values)
        gain = np.append(best, sign * (values[:, 0] - begin))
        best = float(gain.max())
        found.append(nodes[1:])
        count, end = count + nodes.size, float(nodes[-1])
        fallen = np.maximum.accumulate(gain)[:-1] - gain[1:] > close
        if best >= rest or fallen.any() or count >= MAX_PLACES or length > 1e100:
            break
        length *= 2.0 if nodes.size < 64 * PLACES.size else 0.5
    return np.concatenate(found)


def _length(three: FloatArray, rest: float) -> float:
    """Estimated length over which the law gains the rest, from f′ and f″ at the start."""
    _, f1, f2 = np.abs(three)
    with np.errstate(all="ignore"):
        times = np.divide([rest, math.sqrt(2.0 * rest)], [f1, np.sqrt(f2)])
    times = times[(times > 0.0) & np.isfinite(times)]
    return float(times.min()) if times.size else 1.0


def _stretch(law: Law, a: float, b: float, most: int) -> tuple[FloatArray, FloatArray]:
    """Places from a to b (n,) close enough for f′ to be interpolated, and f, f′, f″ there (n,
    3).
    """
    nodes = a + (b - a) * PLACES
    values = law.raw(nodes)
    todo = np.arange(nodes.size - 1)
    for _ in range(MAX_BISECTIONS):
        left, right = nodes[todo], nodes[todo + 1]
        new = left + WITHIN * (right - left)
        got = law.raw(new)
        predicted = _between(right - left, values[todo], values[todo + 1])
        with np.errstate(invalid="ignore"):
            near = np.abs(values[todo, 1]) + np.abs(values[todo + 1, 1])
            bad = ~(np.abs(got[:, 1] - predicted) <= CLOSE * near) & (new > left) & (new < right)
        order = np.argsort(np.concatenate([nodes, new]), kind="stable")
        place = np.empty(order.size, dtype=int)
        place[order] = np.arange(order.size)
        nodes = np.concatenate([nodes, new])[order]
        values = np.concatenate([values, got])[order]
        middle = place[-new.size :][bad]
        todo = np.concatenate([middle - 1, middle])
        if not todo.size or nodes.size > most or not np.isfinite(values[:, 0]).all():
            break
    return nodes, values


def _between(width: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """f′ within an interval, by the cubic through f′ and f″ at its ends (n, 3)."""
    s = WITHIN
    with np.errstate(invalid="ignore"):
        ends = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * a[:, 1] + s * s * (3.0 - 2.0 * s) * b[:, 1]
        return ends + width * (s * (1.0 - s) ** 2 * a[:, 2] - s * s * (1.0 - s) * b[:, 2])


def _with_extremes(
    law: Law, nodes: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The places, together with those where f′ is extreme or changes its sign."""
    for column in (2, 1):
        change = np.flatnonzero(values[:-1, column] * values[1:, column] < 0.0)
        if change.size:
            new = _zeros(law, column, nodes[change], nodes[change + 1])
            order = np.argsort(np.concatenate([nodes, new]), kind="stable")
            values = np.concatenate([values, law.raw(new)])[order]
            nodes = np.concatenate([nodes, new])[order]
    return nodes, values


def _zeros(law: Law, column: int, low: FloatArray, high: FloatArray) -> FloatArray:
    """Where f′ or f″ changes its sign within intervals, (n,), by bisection."""
    low, high = low.copy(), high.copy()
    above = law.raw(low)[:, column] > 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = (law.raw(middle)[:, column] > 0.0) == above
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low
