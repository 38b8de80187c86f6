"""The inverse of a law: the times at which it reaches given values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.core.tolerances import TABLE_RATE_AGREES, TABLE_TIMES_SHORTEST, TABLE_TURNING_POINT
from mbody.errors import ModelError
from mbody.laws.base import Law, finite, finite_array
from mbody.laws.expression import Constant, ConstantAcceleration, ConstantSpeed, Expression
from mbody.laws.function import Function, finite_value
from mbody.laws.kernels import FloatArray
from mbody.laws.measured_formula import MeasuredFormula

# -- Places between which a formula is monotonic, found by adaptive sampling -------------------
#
# A formula does not know its own extremes.

# in one stretch: unevenly spaced, so that they do not coincide with an oscillation
PLACES = np.cumsum(1.0 + 0.5 * np.sin(2.4 * np.arange(33)))
PLACES = (PLACES - PLACES[0]) / np.ptp(PLACES)
WITHIN = 0.382  # of an interval: there f′ is compared with its interpolation from the ends
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
    """
    first = length = _length(law.raw(np.array([t0]))[0], rest)
    found, count, end, best = [np.array([t0])], 1, t0, 0.0
    for _ in range(MAX_STRETCHES):
        nodes, values = _stretch(law, end, end + length, MAX_PLACES - count)
        if not np.isfinite(values[:, 0]).all():
            if length < TABLE_TIMES_SHORTEST * max(first, abs(end)):
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
            bad = (
                ~(np.abs(got[:, 1] - predicted) <= TABLE_RATE_AGREES * near)
                & (new > left)
                & (new < right)
            )
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
    """Where f′ or f″ changes its sign within intervals, (n,)."""
    from mbody.core.bracket import zeros_between

    def values(x: FloatArray) -> FloatArray:
        return law.raw(x)[:, column]

    columns = low, high, values(low), values(high), np.zeros(low.size)
    return np.array([one.x for one in zeros_between(values, *columns)])


SAMPLES = 32  # per scale of a Python function, in the search for turning points
MAX_SCALES = 1024  # of a Python function, in that search
REMEDY = "request values before that, or change the law or the start"


def times_of(
    law: Law, values: Any, t0: float, formatted: Callable[[float], str] = "{:g}".format
) -> FloatArray:
    """Times, increasing from `t0`, at which a law takes increasing or decreasing values.

    f(tᵢ) = valuesᵢ by bracketing and safeguarded Newton steps on all values together, in closed
    form for a uniform or uniformly accelerated motion.

    Parameters
    ----------
    law : Law
        Of time; monotonic from `t0` until it has taken the last value. A dwell is left at its
        earliest time.
    values : array_like (N,)
        All increasing or all decreasing (equal neighbours are allowed), from f(t0) onwards.
    t0 : float
        Where the search begins.
    formatted : callable, optional
        Formats a value with its unit, for error messages.

    Returns
    -------
    ndarray (N,)
        To about 1e-15 of the time, where f′ is not close to 0.

    Raises
    ------
    ModelError
        The law begins in the other direction, turns back, or never reaches a value; or the values
        are not monotonic.

    Notes
    -----
    A Python `Function` is sampled for turning points 32 times per `scale`, over at most 1024
    scales; an `Expression` as densely as its f′ and f″ require.

    >>> from mbody.laws import ConstantAcceleration
    >>> times_of(ConstantAcceleration(0.0, 25.0, -40.0), [0.0, 4.2, 7.8], 0.0)
    array([0. , 0.2, 0.6])
    """
    t0 = finite(t0, "times_of", "t0")
    wanted = finite_array(values, "times_of", "values")
    if not wanted.size:
        return wanted
    steps = np.diff(wanted)
    if (steps > 0.0).any() and (steps < 0.0).any():
        i = int(np.flatnonzero(steps * np.sign(steps[steps != 0.0][0]) < 0.0)[0])
        raise ModelError(
            f"the values must all increase or all decrease, but {formatted(wanted[i + 1])} "
            f"follows {formatted(wanted[i])}: request each stretch separately"
        )
    begin = law(t0)
    size = max(abs(begin), float(np.max(np.abs(wanted))))
    sign = 1.0 if wanted[-1] - begin >= 0.0 else -1.0
    if float(np.min(sign * (wanted - begin))) < -TABLE_TURNING_POINT * size:
        raise ModelError(
            f"the law is at {formatted(begin)} at t = {t0:g}, already past {formatted(wanted[0])}: "
            "start earlier, or from a later value"
        )
    # from here on the law and the values increase
    rest = np.maximum(sign * (wanted - begin), 0.0)
    if rest[-1] <= TABLE_TURNING_POINT * size:
        return np.full(wanted.size, t0)
    if isinstance(law, Constant | ConstantSpeed | ConstantAcceleration):
        return _accelerated(
            law, sign, rest, t0, begin, wanted[-1], TABLE_TURNING_POINT * size, formatted
        )
    if isinstance(law, Function):
        nodes = _sampled(law, sign, begin, float(rest[-1]), t0)
        reached = np.array([finite_value(law.function, t) for t in nodes.tolist()])
    elif isinstance(law, Expression) or law.kind == MeasuredFormula.kind:
        nodes = monotonic_nodes(law, sign, begin, float(rest[-1]), t0, TABLE_TURNING_POINT * size)
        reached = law(nodes)
    else:
        nodes = _refined(law, sign, begin, float(rest[-1]), t0)
        reached = law(nodes)
    gain = sign * (reached - begin)
    ended = len(nodes) - 1
    back = np.flatnonzero(np.diff(gain) < -TABLE_TURNING_POINT * size)
    if back.size:
        ended = int(back[0])
    if rest[-1] > gain[: ended + 1].max() + TABLE_TURNING_POINT * size:
        at, last = float(nodes[ended]), float(wanted[-1])
        raise ModelError(
            _not_reached(
                law, at, t0, begin, sign * gain[ended] + begin, last, back.size > 0, formatted
            )
        )
    return _solve(law, sign, begin, rest, nodes[: ended + 1], gain[: ended + 1])


def _not_reached(
    law: Law,
    at: float,
    t0: float,
    begin: float,
    reached: float,
    wanted: float,
    back: bool,
    formatted: Callable[[float], str],
) -> str:
    """The message for a value that is not reached."""
    if back and at == t0:
        return (
            f"the law goes in the other direction from t = {t0:g}, where it is {formatted(begin)}: "
            f"it does not reach {formatted(wanted)}; {REMEDY}"
        )
    if back:
        return (
            f"the law turns back at t = {at:g} where it has reached {formatted(reached)}; it does "
            f"not reach {formatted(wanted)}: {REMEDY}"
        )
    if reached == begin:
        return (
            f"the law stays at {formatted(begin)} from t = {t0:g}: it does not reach "
            f"{formatted(wanted)}; {REMEDY}"
        )
    more = ", or give a larger scale" if isinstance(law, Function) else ""
    return (
        f"the law goes no further than {formatted(reached)}, at t = {at:g}; it does not reach "
        f"{formatted(wanted)}: {REMEDY}{more}"
    )


def _accelerated(
    law: Law,
    sign: float,
    rest: FloatArray,
    t0: float,
    begin: float,
    wanted: float,
    close: float,
    formatted: Callable[[float], str],
) -> FloatArray:
    """Closed form: rest = v τ + a τ²/2 with τ = 2 rest/(v + √(v² + 2 a rest))."""
    _, v, a = (sign * d for d in law.derivatives(t0))
    if v < 0.0 and v * v <= 2.0 * a * close:
        v = 0.0  # a start at the turning point, apart from rounding
    if v < 0.0 or (v == 0.0 and a <= 0.0):
        stays = v == 0.0 and a == 0.0
        raise ModelError(_not_reached(law, t0, t0, begin, begin, wanted, not stays, formatted))
    square = v * v + 2.0 * a * rest
    if a < 0.0 and rest[-1] + v * v / (2.0 * a) > close:
        reached = begin - sign * v * v / (2.0 * a)
        raise ModelError(_not_reached(law, t0 - v / a, t0, begin, reached, wanted, True, formatted))
    below = v + np.sqrt(np.maximum(square, 0.0))
    return t0 + 2.0 * rest / np.where(below > 0.0, below, 1.0)


def _refined(law: Law, sign: float, begin: float, rest: float, t0: float) -> FloatArray:
    """Places from t0 between which the law is monotonic, until it has gained `rest`."""
    turns = law.turns(t0)
    nodes = np.append(t0, turns[np.isfinite(turns)])
    if turns.size and turns[-1] == math.inf:
        step = max(1.0, abs(t0), float(np.ptp(nodes)))
        while sign * (law(float(nodes[-1])) - begin) < rest:
            if step > 1e150:
                break
            nodes = np.append(nodes, nodes[-1] + step)
            step *= 2.0
            if sign * law.derivatives(float(nodes[-1]))[1] <= 0.0:
                break
    if nodes.size > 64:
        return nodes
    parts = np.linspace(nodes[:-1], nodes[1:], 33)[:-1]
    return np.append(parts.T.ravel(), nodes[-1])


def _sampled(law: Function, sign: float, begin: float, rest: float, t0: float) -> FloatArray:
    """Samples of a Python function until it has gained `rest` or turned back."""
    from mbody.core.bracket import last_place

    step = law.scale / SAMPLES
    nodes, best = [t0], 0.0
    for i in range(1, SAMPLES * MAX_SCALES + 1):
        nodes.append(t0 + i * step)
        gain = sign * (finite_value(law.function, nodes[-1]) - begin)
        if gain >= rest:
            break
        if gain < best:  # turned back: find the extreme
            low = nodes[max(i - 2, 0)]
            if i == 1 and sign * law.derivatives(low)[1] <= 0.0:
                break
            low = last_place(lambda t: sign * law.derivatives(t)[1] > 0.0, low, nodes[i])
            nodes = [t for t in nodes if t < low] + [low, nodes[-1]]
            break
        best = gain
    return np.array(nodes)


def _solve(
    law: Law, sign: float, begin: float, rest: FloatArray, nodes: FloatArray, gain: FloatArray
) -> FloatArray:
    """Times at which an increasing law has gained `rest` (N,), bracketed by nodes."""
    gain = np.maximum.accumulate(gain)
    i = np.clip(np.searchsorted(gain, rest, side="left"), 1, len(nodes) - 1)
    low, high = nodes[i - 1].copy(), nodes[i].copy()
    rest = np.minimum(rest, gain[-1])
    with np.errstate(all="ignore"):
        part = (rest - gain[i - 1]) / (gain[i] - gain[i - 1])
    t = np.where(np.isfinite(part), low + np.clip(part, 0.0, 1.0) * (high - low), low)
    t = np.where(rest <= gain[0], nodes[0], np.where(rest == gain[i], high, t))
    todo = np.flatnonzero((t > low) & (t < high))
    last = high - low
    for _ in range(100):
        if not todo.size:
            break
        now = t[todo]
        f, f1, _ = law.derivatives(now)
        error = sign * (f - begin) - rest[todo]
        low[todo] = np.where(error <= 0.0, now, low[todo])
        high[todo] = np.where(error >= 0.0, now, high[todo])
        with np.errstate(all="ignore"):
            new = now - error / (sign * f1)
        # Newton, unless it leaves the bracket or does not halve the step before
        good = (new >= low[todo]) & (new <= high[todo])
        good &= np.abs(new - now) <= 0.5 * last[todo]
        new = np.where(good, new, 0.5 * (low[todo] + high[todo]))
        step = np.abs(new - now)
        t[todo], last[todo] = new, step
        todo = todo[(step > 4.4e-16 * np.maximum(np.abs(new), nodes[-1] - nodes[0])) & (error != 0)]
    return np.maximum.accumulate(t)
