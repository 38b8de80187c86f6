"""Where a formula of time has corners, and short pulses that steps could pass without seeing them.

The span is cut until, by interval arithmetic, the formula is nearly straight in every part of
it; what is constant for long is left at once. A switch (of `abs`, `sign`, `step`, `min`, `max`) is
located where what decides it changes its sign. Of parts that are much shorter than most of the span
the extrema and the inflections are pulses and steep places.

Moore, Kearfott, Cloud, *Introduction to Interval Analysis* (2009), chapters 5 and 6.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from mbody.core.bracket import zeros_between
from mbody.core.slopes import change
from mbody.core.tolerances import FORMULA_SAME, TINY
from mbody.laws.kernels import (
    ADD,
    CONSTANT,
    COS,
    MULTIPLY,
    OPERATIONS,
    POWER_CONSTANT,
    SUBTRACT,
    FloatArray,
)
from mbody.quantities.evaluate import Postfix, by_numpy, joined, numpy_function, postfix_value

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
Ends = FloatArray
ANY = np.array([[-np.inf], [np.inf]])
SWITCHES = ("abs", "sign", "step", "min", "max")


class Interval(NDArrayOperatorsMixin):
    """Intervals; operators and NumPy's functions give enclosures, but for rounding."""

    def __init__(self, ends: Ends) -> None:
        # anything where an end is not a number
        self.ends = np.where(np.isnan(ends).any(axis=0), ANY, ends)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any) -> Interval:
        ends = [one.ends if isinstance(one, Interval) else np.full((2, 1), one) for one in inputs]
        if ufunc is np.multiply and inputs[0] is inputs[1]:
            return Interval(_power(ends[0], np.full((2, 1), 2.0)))
        return Interval(IMAGES.get(ufunc, ufunc)(*ends))


class Enclosure(NamedTuple):
    """Enclosures of the value, of its rate, and of what decides each switch and its rate."""

    value: Ends
    rate: Ends
    switches: list[tuple[Ends, Ends]]


def deciding_programs(law: Expression) -> list[Expression]:
    """What decides each switch of a formula by its sign."""
    found = []

    def applied(name: str, *parts: Postfix) -> Postfix:
        if name in SWITCHES:
            own = joined("-", *parts) if parts[1:] else parts[0]
            codes = tuple(map(OPERATIONS.index, own.operations))
            found.append(replace(law, program=codes, constants=own.constants))
        return joined(name, *parts)

    law.postfix().value(applied)
    return found


def enclosed(law: Expression, x: Ends) -> Enclosure:
    """Enclosures over intervals (2, n) of the variable, but for rounding."""
    nothing = np.zeros(x.shape)
    switches: list[tuple[Ends, Ends]] = []

    def ends(one: Interval | None) -> Ends:
        return nothing if one is None else nothing + one.ends

    def applied(name: str, *given: tuple[Interval, Interval | None]) -> Any:
        values, rates = zip(*given, strict=True)
        value = by_numpy(name, *values)
        if name in SWITCHES:
            own = np.subtract(*values) if given[1:] else values[0]
            rate = change("subtract", own, values, rates) if given[1:] else rates[0]
            switches.append((ends(own), ends(rate)))
        if name in ("sign", "step"):
            return value, None
        if name not in ("min", "max"):
            return value, change(numpy_function(name).__name__, value, values, rates)
        # of one of the two, or of any between
        less, other = (one.ends for one in (values if name == "min" else values[::-1]))
        a, b = map(ends, rates)
        hull = np.array([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])
        second = np.where(other[1] <= less[0], b, hull)
        return value, Interval(np.where(less[1] <= other[0], a, second))

    constants = ((Interval(nothing + one), None) for one in law.constants)
    variables = repeat((Interval(x), Interval(nothing + 1.0)))
    value, rate = postfix_value(law.postfix().operations, constants, variables, applied)
    return Enclosure(ends(value), ends(rate), switches)


def _hull(*values: FloatArray) -> Ends:
    """Least and greatest of values (n,)."""
    return np.array([np.min(values, axis=0), np.max(values, axis=0)])


def _times(a: Ends, b: Ends) -> Ends:
    return _hull(*(np.where((p == 0.0) | (q == 0.0), 0.0, p * q) for p in a for q in b))


def _over(a: Ends, b: Ends) -> Ends:
    low, high = b  # of which zero is met from within
    inverse = np.where([high == 0.0, low == 0.0], ANY, 1.0 / b[::-1])
    return _times(a, np.where((low < 0.0) & (high > 0.0), ANY, inverse))


def _periodic(top: float, function: Any) -> Any:
    """Of a sine, whose first greatest value is at `top`."""

    def image(a: Ends) -> Ends:
        turns = (a - top) / (2.0 * np.pi)
        up, down = (np.floor(turns[1] - part) >= np.ceil(turns[0] - part) for part in (0.0, 0.5))
        low, high = _hull(*function(a))
        return np.array([np.where(down, -1.0, low), np.where(up, 1.0, high)])

    return image


def _tan(a: Ends) -> Ends:
    pole = np.floor(a[1] / np.pi - 0.5) >= np.ceil(a[0] / np.pi - 0.5)
    return np.where(pole, ANY, np.tan(a))


def _abs(a: Ends) -> Ends:
    least, greatest = _hull(*np.abs(a))
    return np.array([np.where((a[0] < 0.0) & (a[1] > 0.0), 0.0, least), greatest])


def _power(a: Ends, b: Ends) -> Ends:
    p = b[0, 0]
    if (b != p).any():
        return np.exp(_times(b, np.log(np.maximum(a, 0.0))))
    if p != round(p):
        return _hull(*np.maximum(a, 0.0) ** p)
    if p % 2.0 == 0.0:
        return _hull(*_abs(a) ** p)
    through = (p < 0.0) & (a[0] <= 0.0) & (a[1] >= 0.0)
    return np.where(through, ANY, _hull(*a**p))


def _atan2(a: Ends, b: Ends) -> Ends:
    around = (a[0] <= 0.0) & (a[1] >= 0.0) & (b[0] <= 0.0)
    turn = np.array([[-np.pi], [np.pi]])
    return np.where(around, turn, _hull(*(np.arctan2(p, q) for p in a for q in b)))


#: Functions on ends; others increase with all that they take.
IMAGES: dict[Any, Callable[..., Ends]] = {
    np.negative: lambda a: -a[::-1],
    np.subtract: lambda a, b: a - b[::-1],
    np.multiply: _times,
    np.divide: _over,
    np.power: _power,
    np.absolute: _abs,
    np.sin: _periodic(0.5 * np.pi, np.sin),
    np.cos: _periodic(0.0, np.cos),
    np.tan: _tan,
    np.sqrt: lambda a: np.sqrt(np.maximum(a, 0.0)),
    np.log: lambda a: np.log(np.maximum(a, 0.0)),
    np.arcsin: lambda a: np.arcsin(np.clip(a, -1.0, 1.0)),
    np.arccos: lambda a: np.arccos(np.clip(a[::-1], -1.0, 1.0)),
    np.hypot: lambda a, b: np.hypot(_abs(a), _abs(b)),
    np.arctan2: _atan2,
}
