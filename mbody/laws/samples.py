"""Places between which a formula is monotonic, found by looking: it does not tell its turns."""

from __future__ import annotations

import math

import numpy as np

from mbody.laws.base import FloatArray
from mbody.laws.expression import Expression

__all__ = ["looked_through"]

# of a stretch: uneven, so that no oscillation falls in step with them
PLACES = np.cumsum(1.0 + 0.5 * np.sin(2.4 * np.arange(33)))
PLACES = (PLACES - PLACES[0]) / np.ptp(PLACES)
WITHIN = 0.382  # of an interval, where its neighbours must foretell f′
CLOSE = 0.05  # of f′ nearby: how well they must
MOST = 1 << 18  # places in all
HALVINGS = 40  # of an interval, at a corner
STRETCHES = 400


def looked_through(
    law: Expression, sign: float, begin: float, rest: float, t0: float, close: float
) -> FloatArray:
    """Places from t0 on, until ``sign · (f − begin)`` has gained `rest` or fallen by `close`.

    Stretches of t0 … are sampled, each as long as the law needs by its rate for the rest, then
    twice the one before. Where f′ and f″ at two places do not foretell f′ between them, the
    interval is parted, as often as it takes; every extreme becomes a place.

    Raises
    ------
    ModelError
        Where the formula ceases to have a value.
    """
    first = length = _length(law.raw(np.array([t0]))[0], rest)
    found, count, end, best = [np.array([t0])], 1, t0, 0.0
    for _ in range(STRETCHES):
        nodes, values = _stretch(law, end, end + length, MOST - count)
        if not np.isfinite(values[:, 0]).all():
            if length < 1e-12 * max(first, abs(end)):
                law(nodes)  # says what has no value, and where
            length *= 0.5
            continue
        nodes, values = _with_extremes(law, nodes, values)
        gain = np.append(best, sign * (values[:, 0] - begin))
        best = float(gain.max())
        found.append(nodes[1:])
        count, end = count + nodes.size, float(nodes[-1])
        fallen = np.maximum.accumulate(gain)[:-1] - gain[1:] > close
        if best >= rest or fallen.any() or count >= MOST or length > 1e100:
            break
        length *= 2.0 if nodes.size < 64 * PLACES.size else 0.5
    return np.concatenate(found)


def _length(three: FloatArray, rest: float) -> float:
    """How long the law may take for the rest, by its rate and the change of it at the start."""
    _, f1, f2 = np.abs(three)
    with np.errstate(all="ignore"):
        times = np.divide([rest, math.sqrt(2.0 * rest)], [f1, np.sqrt(f2)])
    times = times[(times > 0.0) & np.isfinite(times)]
    return float(times.min()) if times.size else 1.0


def _stretch(law: Expression, a: float, b: float, most: int) -> tuple[FloatArray, FloatArray]:
    """Places from a to b (n,) close enough to know f′ between them, and f, f′, f″ there (n, 3)."""
    nodes = a + (b - a) * PLACES
    values = law.raw(nodes)
    todo = np.arange(nodes.size - 1)
    for _ in range(HALVINGS):
        left, right = nodes[todo], nodes[todo + 1]
        new = left + WITHIN * (right - left)
        got = law.raw(new)
        told = _between(right - left, values[todo], values[todo + 1])
        with np.errstate(invalid="ignore"):
            near = np.abs(values[todo, 1]) + np.abs(values[todo + 1, 1])
            bad = ~(np.abs(got[:, 1] - told) <= CLOSE * near) & (new > left) & (new < right)
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
    law: Expression, nodes: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The places with those added where f′ is extreme or changes its sign."""
    for column in (2, 1):
        change = np.flatnonzero(values[:-1, column] * values[1:, column] < 0.0)
        if change.size:
            new = _zeros(law, column, nodes[change], nodes[change + 1])
            order = np.argsort(np.concatenate([nodes, new]), kind="stable")
            values = np.concatenate([values, law.raw(new)])[order]
            nodes = np.concatenate([nodes, new])[order]
    return nodes, values


def _zeros(law: Expression, column: int, low: FloatArray, high: FloatArray) -> FloatArray:
    """Where f′ or f″ changes its sign within intervals, (n,), by bisection."""
    low, high = low.copy(), high.copy()
    above = law.raw(low)[:, column] > 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = (law.raw(middle)[:, column] > 0.0) == above
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low
