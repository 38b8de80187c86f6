"""The greatest value of a function of one unknown, over the whole range that it may take.

The function and the side conditions are sampled along the range, finer where a cubic through the
neighbours does not foretell them and checked at places between; zeros of side conditions, edges of
what can be analysed and summits between samples are then found to rounding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.inverse.roots import HOLDS

__all__ = ["CLOSED", "Best", "Profile"]

Array = np.ndarray
#: Values (places, columns) and the sizes of their terms at places (places,); NaN where there are
#: none. The last column is to be greatest where all others are not negative.
Values = Callable[[Array], tuple[Array, Array]]
#: Values and derivatives at one place, (columns,) each; NaN where there are none.
Slopes = Callable[[float], tuple[Array, Array]]

#: Samples of a range at first, places between that check them, and how many there may be in all.
SAMPLES, CHECKS, MOST = 120, 41, 1500
#: A cubic through neighbours that is off by more of their spread asks for more samples, down to
#: this part of the first spacing.
ROUGH, FINEST = 0.03, 1.0 / 300.0
#: Values nearer to each other than this part are equal.
EQUAL = 1e-10
#: Part of the greatest value that is rounding.
FLOOR = 1e-10
#: Samples that are tried together where a range ends at the first failure.
STRIDE = 8
#: Summits that are followed in one round.
PEAKS = 12
#: Steps of a search for a zero or a summit.
STEPS = 100
#: Parts of a spacing by which values near an edge are compared, from far to near.
NEAR = (1e-2, 1e-4, 1e-6)

#: What is at a place: the side conditions or bounds decide, or a value in between; the place is the
#: last that can be analysed; the values grow without bound towards it.
CLOSED, OPEN, ENDLESS = "closed", "open", "endless"


@dataclass(frozen=True)
class Best:
    """The place of the greatest value.

    Attributes
    ----------
    x : float
    value : float
    end : str
        `CLOSED` where it is taken; `OPEN` where it is only come near to, at the edge of what can be
        analysed; `ENDLESS` where values grow without bound towards that edge.
    outer : int
        −1 or 1 where it is the lower or the upper end of the range; else 0.
    """

    x: float
    value: float
    end: str = CLOSED
    outer: int = 0


class Profile:
    """Samples of a function along a range, in the order of their places.

    Parameters
    ----------
    values : Values
    slopes : Slopes
    low, high, start : float
        The range and a place in it, from which one goes to both sides.
    noise : array (columns,)
        What is rounding of every column.
    stops : pair of bool
        Whether the range ends, below and above, where values first fail.
    also : sequence of float
        Places that are to be among the samples, such as zero.
    """

    def __init__(
        self,
        values: Values,
        slopes: Slopes,
        low: float,
        high: float,
        start: float,
        noise: Array,
        stops: tuple[bool, bool],
        also: Sequence[float],
    ) -> None:
        self.noise = noise
        self.values, self.slopes, self.low, self.high = values, slopes, low, high
        self.spacing = (high - low) / SAMPLES
        self.x = np.empty(0)
        self.y = self.size = np.empty((0, 0))
        #: Edges of what can be analysed: the last place and what it is.
        self.edges: dict[float, str] = {}
        self.steady = True
        start = min(max(start, low), high)
        places = np.union1d(np.linspace(low, high, SAMPLES + 1), [start])
        places = np.union1d(places, [x for x in also if low <= x <= high])
        self._take(places[places >= start], stops[1])
        self._take(places[places < start][::-1], stops[0])
        if not self.x.size:
            return
        self._refine()
        self._check()
        self._edges()
        self._zeros()

    # -- samples ------------------------------------------------------------------------------

    def add(self, x: Array) -> None:
        """Sample further places, in the order given."""
        x = x[~np.isin(x, self.x)]
        if not x.size:
            return
        y, size = self.values(x)
        y = np.where(np.isfinite(y).all(axis=1, keepdims=True), y, np.nan)
        if self.x.size:
            x, y = np.append(self.x, x), np.concatenate([self.y, y])
            size = np.concatenate([self.size, size])
        order = np.argsort(x)
        self.x, self.y, self.size = x[order], y[order], size[order]

    def _take(self, places: Array, stops: bool) -> None:
        """Sample places one after the other, no further than the first failure where it `stops`."""
        stride = STRIDE if stops else max(len(places), 1)
        for first in range(0, len(places), stride):
            chosen = places[first : first + stride]
            self.add(chosen)
            lost = chosen[np.isnan(self.y[np.searchsorted(self.x, chosen), -1])]
            if stops and lost.size:
                keep = ~np.isin(self.x, chosen[chosen.tolist().index(lost[0]) + 1 :])
                self.x, self.y, self.size = self.x[keep], self.y[keep], self.size[keep]
                return

    def at(self, x: float) -> Array:
        """The row of one place: (columns,)."""
        self.add(np.array([x]))
        row: Array = self.y[int(np.searchsorted(self.x, x))]
        return row

    @property
    def found(self) -> Array:
        """Which samples have values."""
        return np.isfinite(self.y[:, -1])

    @property
    def allowed(self) -> Array:
        """At which samples all side conditions hold."""
        margins = self.y[:, :-1] >= -HOLDS * self.size[:, :-1] - self.noise[:-1]
        good: Array = self.found & margins.all(axis=1)
        return good

    def _off(self) -> Array:
        """By how much every sample is off the cubic through its neighbours, as a part of the spread
        of the five: (samples,), the greatest of all columns; 0 at ends.
        """
        off = np.zeros(len(self.x))
        if len(self.x) < 5:
            return off
        k = np.arange(2, len(self.x) - 2)
        near = np.stack([k - 2, k - 1, k + 1, k + 2])
        x, y = self.x[near] - self.x[k], self.y[near]
        weights = np.ones((4, len(k)))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for a, b in itertools.permutations(range(4), 2):
                weights[a] *= x[b] / (x[b] - x[a])
            fitted = np.einsum("ak,akc->kc", weights, y)
        five = np.concatenate([y, self.y[None, k]])
        spread = five.max(axis=0) - five.min(axis=0)
        floor = FLOOR * (self.size[k] + np.abs(five).max(axis=0)) + self.noise + 1e-300
        with np.errstate(invalid="ignore"):
            part = np.abs(fitted - self.y[k]) / (spread + floor / ROUGH)
        # places that nearly coincide show nothing
        apart = np.abs(x).min(axis=0) > FINEST**2 * self.spacing
        off[2:-2] = np.where(apart, np.nan_to_num(part).max(axis=1), 0.0)
        return off

    def _refine(self) -> None:
        """More samples where a cubic does not foretell them."""
        while len(self.x) < MOST:
            rough = np.flatnonzero(self._off() > ROUGH)
            left = np.union1d(rough - 1, rough)
            wide = np.diff(self.x)[left] > FINEST * self.spacing
            known = self.found[left] & self.found[left + 1]
            left = left[wide & known]
            if not left.size:
                return
            self.add(0.5 * (self.x[left] + self.x[left + 1]))
        self.steady = False

    def _check(self) -> None:
        """Places between, spread evenly and unevenly spaced, must not change the picture."""
        part = np.modf(0.37 + 0.6180339887498949 * np.arange(CHECKS))[0]
        places = self.low + (self.high - self.low) * part
        inside = (places > self.x[0]) & (places < self.x[-1])
        self.add(np.sort(places[inside]))
        self._refine()

    # -- edges and zeros ----------------------------------------------------------------------

    def _edges(self) -> None:
        """Find to rounding where values begin to fail."""
        k = np.flatnonzero(self.found[1:] != self.found[:-1])
        sides = np.where(self.found[k], k, k + 1), np.where(self.found[k], k + 1, k)
        width = self.spacing
        for far, bad in zip(*(self.x[side].tolist() for side in sides), strict=True):
            good = far
            while abs(good - bad) > 4e-16 * (abs(good) + abs(bad) + width):
                middle = 0.5 * (good + bad)
                if middle in (good, bad):
                    break
                if np.isfinite(self.at(middle)).all():
                    good = middle
                else:
                    bad = middle
            if good == far:  # a bound of the number itself, as zero of a mass
                continue
            sense = math.copysign(width, far - bad)
            near = good + sense * np.concatenate([NEAR, 10.0 ** np.arange(-9, 0)])
            self.add(np.append(near[(near - far) * sense <= 0.0], good))
            self.edges[good] = self._end(good, sense)

    def _end(self, edge: float, width: float) -> str:
        """Whether values grow without bound towards an edge, by how fast they grow."""
        far, middle, near = (self.at(edge + part * width)[-1] for part in NEAR)
        if near > middle > far and near - middle > 0.7 * (middle - far):
            return ENDLESS
        return OPEN

    def _zeros(self) -> None:
        """Sample where side conditions are just met, between samples that meet them and others,
        and where one comes near to that between samples.
        """
        for column in range(self.y.shape[1] - 1):
            for sign in (1.0, -1.0):
                for k in self._turns(column, sign):
                    self._summit(column, sign, k)
            y = self.y[:, column]
            change = np.flatnonzero(
                (y[:-1] < 0.0) & (y[1:] >= 0.0) | (y[:-1] >= 0.0) & (y[1:] < 0.0)
            )
            for a, b in self.x[np.stack([change, change + 1], axis=1)]:
                self._zero(column, float(a), float(b))

    def _turns(self, column: int, sign: float) -> list[float]:
        """Samples next to which a side condition may be met, or broken, between samples alone."""
        y, found = sign * self.y[:, column], []
        for k in range(1, len(self.x) - 1):
            three = y[k - 1 : k + 2]
            if three[1] < 0.0 and three[1] >= max(three[0], three[2]):
                top = three[1] + (three[1] - min(three[0], three[2]))
                if top >= 0.0:
                    found.append(float(self.x[k]))
        return found

    def _summit(self, column: int, sign: float, x: float) -> float:
        """Sample the summit of a column, of the given sign, about a sample."""
        k = int(np.searchsorted(self.x, x))

        def look(place: float) -> tuple[float, float]:
            value, slope = self.slopes(place)
            here = sign * float(value[column]), sign * float(slope[column])
            return here if math.isfinite(here[0] + here[1]) else (-math.inf, -1.0)

        top = summit(look, *self.x[k - 1 : k + 2].tolist())
        self.add(np.array([top]))
        return top

    def _zero(self, column: int, a: float, b: float) -> None:
        """Sample the last place of a side condition that is met, between two of different sign."""
        (fa, fb), side = (self.at(x)[column] for x in (a, b)), 0
        weak = [fa, fb]
        for _ in range(STEPS):
            if abs(b - a) <= 4e-16 * (abs(a) + abs(b) + self.spacing) or 0.0 in (fa, fb):
                break
            x = (a * weak[1] - b * weak[0]) / (weak[1] - weak[0])
            if not min(a, b) < x < max(a, b):
                x = 0.5 * (a + b)
            if x in (a, b):
                break
            f = float(self.values(np.array([x]))[0][0, column])
            if not math.isfinite(f):
                return
            if (f >= 0.0) == (fb >= 0.0):
                b, fb = x, f
                weak = [0.5 * weak[0] if side == 1 else weak[0], f]
                side = 1
            else:
                a, fa = x, f
                weak = [f, 0.5 * weak[1] if side == -1 else weak[1]]
                side = -1
        self.add(np.array([a if fa >= 0.0 else b]))

    # -- what is greatest ---------------------------------------------------------------------

    def best(self, near: float) -> Best | None:
        """Where the last column is greatest, of equal ones the nearest to a place; None where no
        sample is allowed.
        """
        for _ in range(3):
            for x in self._promising():
                self._summit(-1, 1.0, x)
        good = self.allowed
        if not good.any():
            return None
        y = np.where(good, self.y[:, -1], -np.inf)
        top = float(y.max())
        endless = [x for x, end in self.edges.items() if end == ENDLESS]
        for x in endless:
            if good[int(np.searchsorted(self.x, x))]:
                return Best(x, top, ENDLESS)
        equal = np.flatnonzero(y >= top - self._floor)
        k = int(equal[np.abs(self.x[equal] - near).argmin()])
        while y[max(k - 1, 0) : k + 2].max() > y[k]:
            k = int(max(k - 1, 0) + y[max(k - 1, 0) : k + 2].argmax())
        x = float(self.x[k])
        outer = -1 if x == self.x[0] else 1 if x == self.x[-1] else 0
        return Best(x, float(self.at(x)[-1]), self.edges.get(x, CLOSED), outer)

    @property
    def _floor(self) -> float:
        """By how much values may differ that are equal."""
        top = int(np.where(self.allowed, self.y[:, -1], -np.inf).argmax())
        return float(self.noise[-1] + EQUAL * self.size[top, -1])

    def _promising(self) -> list[float]:
        """Samples greater than their neighbours, all three allowed, whose summit may be best."""
        y, good = self.y[:, -1], self.allowed
        if not good.any():
            return []
        top, floor = y[good].max(), self._floor
        summits = []
        for k in np.flatnonzero(good[1:-1] & good[:-2] & good[2:]) + 1:
            three = y[k - 1 : k + 2]
            drop = three[1] - three.min()
            wide = self.x[k + 1] - self.x[k - 1] > 1e-7 * self.spacing
            if wide and drop > floor and three[1] >= max(three[0], three[2], top - drop):
                summits.append((-three[1], float(self.x[k])))
        found = [x for _, x in sorted(summits)[:PEAKS]]
        # at the end of a run the summit may lie between it and its neighbour
        ends = []
        for k in np.flatnonzero(good[1:] != good[:-1]):
            inside, end = (k + 2, k + 1) if good[k + 1] else (k - 1, k)
            if 0 <= inside < len(self.x) and good[inside] and y[end] >= y[inside]:
                ends.append(float(self.x[end] + 0.01 * (self.x[inside] - self.x[end])))
        self.add(np.array(ends))
        return found


def summit(look: Callable[[float], tuple[float, float]], a: float, x: float, c: float) -> float:
    """The place of the greatest value between a and c, x being greater than both: where the slope
    changes its sign, at a kink as well (regula falsi, Illinois).

    Parameters
    ----------
    look : callable
        Value and slope at a place; −inf where there is none.
    """
    top, slope = look(x)
    best = top, x
    # the slope is positive at `low`; at `high` it is not, or the value is less than at `low`
    low, high, bottom = (x, c, top) if slope > 0.0 else (a, x, -math.inf)
    rising, falling = (slope, math.nan) if slope > 0.0 else (math.nan, slope)
    side = 0
    for _ in range(STEPS):
        if high - low <= 4e-16 * (abs(low) + abs(high)) + 1e-14 * (c - a) or slope == 0.0:
            break
        middle = (low * falling - high * rising) / (falling - rising)
        if not low < middle < high:
            middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        value, slope = look(middle)
        best = max(best, (value, middle))
        if slope > 0.0 and value >= bottom:
            falling = 0.5 * falling if side == 1 else falling
            low, bottom, rising, side = middle, value, slope, 1
        else:
            rising = 0.5 * rising if side == -1 else rising
            high, falling, side = middle, slope if slope <= 0.0 else math.nan, -1
    return best[1]
