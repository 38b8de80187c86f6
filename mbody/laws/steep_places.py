"""Where a formula of time has corners, and short pulses that steps could pass without seeing them.

The span is cut until, by interval arithmetic, the formula is nearly straight in every part of
it; what is constant for long is left at once. A switch (of `abs`, `sign`, `step`, `min`, `max`) is
located where what decides it changes its sign. Of parts that are much shorter than most of the span
the extrema and the inflections are pulses and steep places.

Moore, Kearfott, Cloud, *Introduction to Interval Analysis* (2009), chapters 5 and 6.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from mbody.core.bracket import zeros_between
from mbody.core.tolerances import FORMULA_SAME, TINY
from mbody.laws.kernels import (
    ABS,
    ADD,
    CONSTANT,
    COS,
    LOG,
    MAX,
    MIN,
    MULTIPLY,
    OPERATIONS,
    POWER_CONSTANT,
    SIGN,
    STEP,
    SUBTRACT,
    FloatArray,
)

#: How far a formula may be from straight in a part, of its greatest value; levels, and parts of one
#: level, at which cutting ends.
STRAIGHT, LEVELS, MOST = 0.01, 24, 20_000
#: Parts of the span, and of a part that is cut.
FIRST, PARTS = 64, 8
#: Part of the span that is short, and how much of the span places as short as one may take.
SHORT, ISOLATED = 1.0 / 32.0, 0.2
#: Operations that make no corners, and no pulses but by high powers; low ones.
SMOOTH = frozenset((*range(COS + 1), ADD, SUBTRACT, MULTIPLY))
LOW_POWERS = (0.0, 1.0, 2.0, 3.0, 4.0)

Codes = tuple[int, ...]
#: A `mbody.laws.expression.Expression`, which asks here for its corners.
Expression = Any


class Places(NamedTuple):
    """Ascending places: corners at which the value is continuous, jumps of the value, pulses."""

    kinks: FloatArray
    jumps: FloatArray
    pulses: FloatArray


@functools.lru_cache(maxsize=256)
def steep_places(law: Expression, first: float, last: float) -> Places:
    """Corners and pulses of a formula between two values of its variable."""
    if is_smooth(law):
        return Places(np.empty(0), np.empty(0), np.empty(0))
    with np.errstate(all="ignore"):
        left, right, found, size = _parts(law, first, last)
        corners = np.unique(np.concatenate([np.empty(0), *found]))
        corners = corners[(corners > first) & (corners < last)]
        before, after = (law.raw(one)[:, 0] for one in (np.nextafter(corners, -np.inf), corners))
        jumps = np.abs(after - before) > FORMULA_SAME * size
        smooth = np.searchsorted(corners, left) == np.searchsorted(corners, right, side="right")
        pulses = _pulses(law, left[smooth], right[smooth], last - first, size)
    return Places(corners[~jumps], corners[jumps], pulses)


def is_smooth(law: Expression) -> bool:
    """Whether a formula varies no faster than the waves that it is made of."""
    taking = [code for code in law.program if CONSTANT <= code <= POWER_CONSTANT]
    powers = [c for code, c in zip(taking, law.constants, strict=True) if code == POWER_CONSTANT]
    return SMOOTH.issuperset(law.program) and set(powers) <= set(LOW_POWERS)


def _parts(
    law: Expression, first: float, last: float
) -> tuple[FloatArray, FloatArray, list[FloatArray], float]:
    """Ends of parts (parts,), where these were not too many to be cut further, in ascending order;
    the places of each switch, and the greatest value.
    """
    deciding, size = deciding_programs(law), 0.0
    left, right = _cut(np.array([first]), np.array([last]), FIRST)
    done: list[FloatArray] = [np.empty((2, 0))]
    found: list[FloatArray] = []
    for _ in range(LEVELS if last > first else 0):
        n, width, middle = left.size, right - left, 0.5 * (left + right)
        enclosure = enclosed(law, np.array([[*left, *middle], [*right, *middle]]))
        value, rate = enclosure.value, enclosure.rate
        met = np.abs(value[0, n:])
        size = max(size, float(met[np.isfinite(met)].max(initial=0.0)))
        bent = ~(0.125 * width * (rate[1, :n] - rate[0, :n]) <= STRAIGHT * size)
        bent &= rate[1, :n] != rate[0, :n]
        brackets: list[Any] = []
        for own, slope in enclosure.switches:
            # by the mean value too, which is exact where both sides are the same
            reach = (0.5 + FORMULA_SAME) * width * np.abs(slope[:, :n]).max(axis=0)
            low = np.fmax(own[0, :n], own[0, n:] - reach)
            high = np.fmin(own[1, :n], own[1, n:] + reach)
            may_switch = (low < 0.0) & (high >= 0.0)
            one_way = (slope[0, :n] > 0.0) | (slope[1, :n] < 0.0)
            bent |= may_switch & ~one_way
            brackets.append(may_switch & one_way)
        bent &= (middle > left) & (middle < right)
        for program, here in zip(deciding, brackets, strict=True):
            some = here & ~bent
            if some.any():
                found.append(_changes(program, left[some], right[some]))
        done.append(np.array([left, right])[:, ~bent])
        if not bent.any() or PARTS * int(bent.sum()) > MOST:
            break
        left, right = _cut(left[bent], right[bent], PARTS)
    ends = np.concatenate(done, axis=1)
    ends = ends[:, np.argsort(ends[0])]
    return ends[0], ends[1], found, size


def _cut(left: FloatArray, right: FloatArray, parts: int) -> tuple[FloatArray, FloatArray]:
    """Ends of intervals (n,), each cut into so many."""
    places = left[:, None] + (right - left)[:, None] * (np.arange(parts + 1) / parts)
    places[:, -1] = right
    return places[:, :-1].ravel(), places[:, 1:].ravel()


def _changes(law: Expression, low: FloatArray, high: FloatArray, order: int = 0) -> FloatArray:
    """Where the value, or a derivative, becomes negative or ceases to be within brackets (n,): the
    first number behind; none of a bracket without a change.
    """

    def values(x: FloatArray) -> FloatArray:
        found = law.raw(x)[:, order]
        return np.where(found < 0.0, found, np.fmax(found, TINY))  # zero and NaN are on one side

    columns = np.array([low, high, values(low), values(high), 0.0 * low])
    changing = (columns[2] < 0.0) != (columns[3] < 0.0)
    found = zeros_between(values, *columns[:, changing])
    return np.array([max(one.above, one.below) for one in found])


def _pulses(
    law: Expression, left: FloatArray, right: FloatArray, span: float, size: float
) -> FloatArray:
    """Extrema and inflections in parts that are short, and take little of the span together."""
    width = right - left
    order = np.argsort(width)
    together = np.cumsum(width[order])
    # what parts of at most twice its width take
    last = np.searchsorted(width[order], 2.0 * width, side="right") - 1
    chosen = (width <= SHORT * span) & (together[last] <= ISOLATED * span)
    left, right = left[chosen], right[chosen]
    ends = np.abs(law.raw(left))
    great = ends[:, 0] + (right - left) * ends[:, 1] > STRAIGHT * size
    left, right = left[great], right[great]
    return np.unique([*_changes(law, left, right, 1), *_changes(law, left, right, 2)])


# -- Enclosures of a formula and its rate ------------------------------------------------------

#: The least and the greatest of many numbers, (2, n).
Interval = FloatArray
SWITCHES = (ABS, SIGN, STEP, MIN, MAX)


class Enclosure(NamedTuple):
    """Enclosures of the value, of its rate, and of what decides each switch and its rate."""

    value: Interval
    rate: Interval
    switches: list[tuple[Interval, Interval]]


def deciding_programs(law: Expression) -> list[Expression]:
    """What decides each switch of a formula by its sign."""
    stack: list[tuple[Codes, tuple[float, ...]]] = []
    constants, found = iter(law.constants), []
    for code in law.program:
        if code <= CONSTANT:
            stack.append(((code,), () if code == 0 else (next(constants),)))
            continue
        own = (next(constants),) if code <= POWER_CONSTANT else ()
        second = stack.pop() if code > LOG else ((), ())
        first = stack.pop()
        both = first[0] + second[0], first[1] + second[1]
        if code in SWITCHES:
            minus = (SUBTRACT,) if code > LOG else ()
            found.append(replace(law, program=both[0] + minus, constants=both[1]))
        stack.append((both[0] + (code,), both[1] + own))
    return found


def enclosed(law: Expression, x: Interval) -> Enclosure:
    """Enclosures over intervals (2, n) of the variable, but for rounding."""
    n, constants = x.shape[1], iter(law.constants)
    nothing = np.zeros((2, n))
    stack: list[tuple[Interval, Interval]] = []
    switches: list[tuple[Interval, Interval]] = []
    for code in law.program:
        name = OPERATIONS[code]
        if name == "variable":
            stack.append((x, nothing + 1.0))
        elif name == "constant":
            stack.append((nothing + next(constants), nothing))
        elif code > LOG:
            b, a = stack.pop(), stack.pop()
            stack.append(_of_two(name, a, b, switches))
        elif name.endswith(" constant"):
            c = (nothing + next(constants), nothing)
            stack.append(_of_two(name[0], stack.pop(), c, switches))
        else:
            stack.append(_of_one(name, *stack.pop(), switches))
        stack[-1] = _known(stack[-1][0]), _known(stack[-1][1])
    return Enclosure(*stack.pop(), switches)


def _known(a: Interval) -> Interval:
    """Anything where an end is not a number."""
    return np.where(np.isnan(a).any(axis=0), [[-np.inf], [np.inf]], a)


def _ends(*values: FloatArray) -> Interval:
    """Least and greatest of values (n,)."""
    return np.array([np.min(values, axis=0), np.max(values, axis=0)])


def _times(a: Interval, b: Interval) -> Interval:
    parts = [np.where((p == 0.0) | (q == 0.0), 0.0, p * q) for p in a for q in b]
    return _ends(*parts)


def _over(a: Interval, b: Interval) -> Interval:
    parts = np.where((b[0] > 0.0) | (b[1] < 0.0), 1.0 / b[::-1], [[-np.inf], [np.inf]])
    return _times(a, parts)


def _minus(a: Interval, b: Interval) -> Interval:
    return a - b[::-1]


def _hull(a: Interval, b: Interval) -> Interval:
    return np.array([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])


def _periodic(a: Interval, g: FloatArray, top: float) -> Interval:
    """Values of a sine (2, n) at the ends, with its extrema between them; the first greatest value
    is at `top`.
    """
    low, high = np.min(g, axis=0), np.max(g, axis=0)
    turn = 2.0 * np.pi
    up = np.floor((a[1] - top) / turn) >= np.ceil((a[0] - top) / turn)
    down = np.floor((a[1] - top) / turn - 0.5) >= np.ceil((a[0] - top) / turn - 0.5)
    return np.array([np.where(down, -1.0, low), np.where(up, 1.0, high)])


def _power(a: Interval, p: float) -> Interval:
    """a^p of one exponent."""
    if p == round(p) and p % 2.0 == 1.0:
        through = (p < 0.0) & (a[0] <= 0.0) & (a[1] >= 0.0)
        return np.where(through, [[-np.inf], [np.inf]], _ends(*a**p))
    if p == round(p):
        small = np.where((a[0] < 0.0) & (a[1] > 0.0), 0.0, np.abs(a).min(axis=0))
        return _ends(small**p, np.abs(a).max(axis=0) ** p)
    return _ends(*np.maximum(a, 0.0) ** p)


def _of_one(
    name: str, a: Interval, a1: Interval, switches: list[tuple[Interval, Interval]]
) -> tuple[Interval, Interval]:
    if name == "negative":
        return -a[::-1], -a1[::-1]
    if name in ("abs", "sign", "step"):
        switches.append((a, a1))
        if name == "abs":
            least = np.where((a[0] < 0.0) & (a[1] > 0.0), 0.0, np.abs(a).min(axis=0))
            sides = np.array([least, np.abs(a).max(axis=0)])
            part = np.where(a[0] >= 0.0, 1.0, -1.0), np.where(a[1] > 0.0, 1.0, -1.0)
            return sides, _times(a1, np.array(part))
        jump = np.sign(a) if name == "sign" else np.where(a >= 0.0, 1.0, 0.0)
        return np.asarray(jump), np.zeros(a.shape)
    if name in ("sin", "cos"):
        top = 0.5 * np.pi if name == "sin" else 0.0
        value = _periodic(a, np.sin(a) if name == "sin" else np.cos(a), top)
        rate = np.cos(a) if name == "sin" else -np.sin(a)
        return value, _times(_periodic(a, rate, top - 0.5 * np.pi), a1)
    if name == "tan":
        pole = np.floor(a[1] / np.pi - 0.5) >= np.ceil(a[0] / np.pi - 0.5)
        g = np.where(pole, [[-np.inf], [np.inf]], np.tan(a))
        return g, _times(1.0 + _power(g, 2.0), a1)
    if name == "exp":
        g = np.exp(a)
        return g, _times(g, a1)
    if name == "sqrt":
        g = np.sqrt(np.maximum(a, 0.0))
        return g, _times(np.array([0.5 / g[1], 0.5 / g[0]]), a1)
    if name == "log":
        return np.log(np.maximum(a, 0.0)), _over(a1, np.maximum(a, 0.0))
    if name == "atan":
        return np.arctan(a), _over(a1, 1.0 + _power(a, 2.0))
    inside = np.clip(a, -1.0, 1.0)
    g, steep = np.arcsin(inside), np.sqrt(1.0 - _power(inside, 2.0)[::-1])
    if name == "asin":
        return g, _times(1.0 / steep[::-1], a1)
    return 0.5 * np.pi - g[::-1], -_times(1.0 / steep[::-1], a1)[::-1]


def _of_two(
    name: str,
    first: tuple[Interval, Interval],
    second: tuple[Interval, Interval],
    switches: list[tuple[Interval, Interval]],
) -> tuple[Interval, Interval]:
    (a, a1), (b, b1) = first, second
    if name == "+":
        return a + b, a1 + b1
    if name == "-":
        return _minus(a, b), _minus(a1, b1)
    if name == "*":
        return _times(a, b), _times(a1, b) + _times(a, b1)
    if name == "/":
        q = _over(a, b)
        return q, _over(_minus(a1, _times(q, b1)), b)
    if name in ("min", "max"):
        switches.append((_minus(a, b), _minus(a1, b1)))
        less, other = (a, b) if name == "min" else (b, a)
        first_holds, second_holds = less[1] <= other[0], other[1] <= less[0]
        rate = np.where(first_holds, a1, np.where(second_holds, b1, _hull(a1, b1)))
        value = np.minimum(a, b) if name == "min" else np.maximum(a, b)
        return value, rate
    if name == "hypot":
        square = _power(a, 2.0) + _power(b, 2.0)
        h = np.sqrt(square)
        return h, _over(_times(a, a1) + _times(b, b1), h)
    if name == "atan2":
        parts = [np.arctan2(p, q) for p in a for q in b]
        around = (a[0] <= 0.0) & (a[1] >= 0.0) & (b[0] <= 0.0)
        angle = np.where(around, [[-np.pi], [np.pi]], _ends(*parts))
        square = _power(a, 2.0) + _power(b, 2.0)
        return angle, _over(_minus(_times(a1, b), _times(a, b1)), square)
    if (b[0] == b[1]).all() and (b == b[0, 0]).all() and not b1.any():
        p = float(b[0, 0])
        return _power(a, p), _times(_times(b, _power(a, p - 1.0)), a1)
    log = np.log(np.maximum(a, 0.0))
    f = np.exp(_times(b, log))
    return f, _times(f, _times(b1, log) + _over(_times(b, a1), np.maximum(a, 0.0)))
