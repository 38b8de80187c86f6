"""The inverse of a law: the times at which it reaches given values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FloatArray, Law, finite, finite_array
from mbody.laws.elementary import Constant, ConstantAcceleration, ConstantSpeed
from mbody.laws.expression import Expression
from mbody.laws.function import Function, finite_value
from mbody.laws.measured_formula import MeasuredFormula
from mbody.laws.monotonic import monotonic_nodes

__all__ = ["times_of"]

CLOSE = 1e-12  # of the values' size: rounding may exceed a turning point by this
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
    if float(np.min(sign * (wanted - begin))) < -CLOSE * size:
        raise ModelError(
            f"the law is at {formatted(begin)} at t = {t0:g}, already past {formatted(wanted[0])}: "
            "start earlier, or from a later value"
        )
    # from here on the law and the values increase
    rest = np.maximum(sign * (wanted - begin), 0.0)
    if rest[-1] <= CLOSE * size:
        return np.full(wanted.size, t0)
    if isinstance(law, Constant | ConstantSpeed | ConstantAcceleration):
        return _accelerated(law, sign, rest, t0, begin, wanted[-1], CLOSE * size, formatted)
    if isinstance(law, Function):
        nodes = _sampled(law, sign, begin, float(rest[-1]), t0)
        reached = np.array([finite_value(law.function, t) for t in nodes.tolist()])
    elif isinstance(law, Expression) or law.kind == MeasuredFormula.kind:
        nodes = monotonic_nodes(law, sign, begin, float(rest[-1]), t0, CLOSE * size)
        reached = law(nodes)
    else:
        nodes = _refined(law, sign, begin, float(rest[-1]), t0)
        reached = law(nodes)
    gain = sign * (reached - begin)
    ended = len(nodes) - 1
    back = np.flatnonzero(np.diff(gain) < -CLOSE * size)
    if back.size:
        ended = int(back[0])
    if rest[-1] > gain[: ended + 1].max() + CLOSE * size:
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
    step = law.scale / SAMPLES
    nodes, best = [t0], 0.0
    for i in range(1, SAMPLES * MAX_SCALES + 1):
        nodes.append(t0 + i * step)
        gain = sign * (finite_value(law.function, nodes[-1]) - begin)
        if gain >= rest:
            break
        if gain < best:  # turned back: find the extreme
            low, high = nodes[max(i - 2, 0)], nodes[i]
            if i == 1 and sign * law.derivatives(low)[1] <= 0.0:
                break
            for _ in range(60):
                middle = 0.5 * (low + high)
                if sign * law.derivatives(middle)[1] > 0.0:
                    low = middle
                else:
                    high = middle
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
