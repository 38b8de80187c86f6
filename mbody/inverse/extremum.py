"""The greatest value of one unknown: over which range it is sought, and what is reported of it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.bracket import last_place, zero_between
from mbody.core.searches import Searches
from mbody.inverse.trials import Affine, Residuals, SearchVariable, newton, spread
from mbody.optimization.design_evaluation import AimRows
from mbody.optimization.nonlinear_program import Program, SearchResult, ending

# -- The greatest value of a function of one unknown, over the whole range that it may take ----
# The function and the side conditions are sampled along the range, finer where a cubic through the
# neighbours does not foretell them and checked at places between; zeros of side conditions, edges
# of what can be analysed and summits between samples are then found to rounding.

Array = np.ndarray
#: Values (places, columns) and the sizes of their terms at places (places,); NaN where there are
#: none. The last column is to be greatest where all others are not negative.
Values = Callable[[Array], tuple[Array, Array]]
#: Values and derivatives at one place, (columns,) each; NaN where there are none.
Derivatives = Callable[[float], tuple[Array, Array]]

#: Samples of a range at first, places between that check them, and how many there may be in all.
SAMPLES, CHECKS, MOST = 120, 41, 1500
#: Samples that are tried together where a range ends at the first failure.
STRIDE = 8
#: Summits that are followed in one round.
PEAKS = 12

#: What is at a place: the side conditions or bounds decide, or a value in between; the place is the
#: last that can be analysed; the values grow without bound towards it.
CLOSED, OPEN, ENDLESS = "closed", "open", "endless"


@dataclass(frozen=True)
class Best:
    """The place of the greatest value.

    `end`: `CLOSED` where it is taken; `OPEN` where it is only come near to, at the edge of what can
      be analysed; `ENDLESS` where values grow without bound towards that edge.
    `outer`: −1 or 1 where it is the lower or the upper end of the range; else 0.
    """

    x: float
    value: float
    end: str = CLOSED
    outer: int = 0


class Profile:
    """Samples of a function along a range, in the order of their places. `noise` (columns,)."""

    def __init__(
        self,
        values: Values,
        derivatives: Derivatives,
        low: float,
        high: float,
        start: float,
        noise: Array,
        stops: tuple[bool, bool],
        also: Sequence[float],
    ) -> None:
        self.noise = noise
        self.values, self.derivatives, self.low, self.high = values, derivatives, low, high
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
    def evaluated(self) -> Array:
        """Which samples have values."""
        return np.isfinite(self.y[:, -1])

    @property
    def allowed(self) -> Array:
        """At which samples all side conditions hold."""
        margins = self.y[:, :-1] >= -tol.ROW_HOLDS * self.size[:, :-1] - self.noise[:-1]
        good: Array = self.evaluated & margins.all(axis=1)
        return good

    def _off(self) -> Array:
        """By how much every sample is off the cubic through its neighbours, as a part of the spread
        of the five: (samples,), the greatest of all columns; 0 at ends.
        """
        off = np.zeros(len(self.x))
        if len(self.x) < 5:
            return off
        k = np.arange(2, len(self.x) - 2)
        neighbours = np.stack([k - 2, k - 1, k + 1, k + 2])
        x, y = self.x[neighbours] - self.x[k], self.y[neighbours]
        weights = np.ones((4, len(k)))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for a, b in itertools.permutations(range(4), 2):
                weights[a] *= x[b] / (x[b] - x[a])
            fitted = np.einsum("ak,akc->kc", weights, y)
        five = np.concatenate([y, self.y[None, k]])
        spread = five.max(axis=0) - five.min(axis=0)
        floor = (
            tol.EXTREMUM_VALUES_EQUAL * (self.size[k] + np.abs(five).max(axis=0))
            + self.noise
            + tol.TINY
        )
        with np.errstate(invalid="ignore"):
            part = np.abs(fitted - self.y[k]) / (spread + floor / tol.EXTREMUM_CUBIC_ROUGH)
        # places that nearly coincide show nothing
        resolved = np.abs(x).min(axis=0) > tol.EXTREMUM_SPACING_FINEST**2 * self.spacing
        off[2:-2] = np.where(resolved, np.nan_to_num(part).max(axis=1), 0.0)
        return off

    def _refine(self) -> None:
        """More samples where a cubic does not foretell them."""
        while len(self.x) < MOST:
            unresolved = np.flatnonzero(self._off() > tol.EXTREMUM_CUBIC_ROUGH)
            left = np.union1d(unresolved - 1, unresolved)
            wide = np.diff(self.x)[left] > tol.EXTREMUM_SPACING_FINEST * self.spacing
            known = self.evaluated[left] & self.evaluated[left + 1]
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
        k = np.flatnonzero(self.evaluated[1:] != self.evaluated[:-1])
        sides = np.where(self.evaluated[k], k, k + 1), np.where(self.evaluated[k], k + 1, k)
        width = self.spacing
        for outside, bad in zip(*(self.x[side].tolist() for side in sides), strict=True):
            rounding = tol.EXTREMUM_BRACKET * (abs(outside) + abs(bad) + width)
            good = last_place(lambda x: bool(np.isfinite(self.at(x)).all()), outside, bad, rounding)
            if good == outside:  # a bound of the number itself, as zero of a mass
                continue
            sign = math.copysign(width, outside - bad)
            trials = good + sign * np.concatenate(
                [tol.EXTREMUM_EDGE_NEAR, 10.0 ** np.arange(-9, 0)]
            )
            self.add(np.append(trials[(trials - outside) * sign <= 0.0], good))
            self.edges[good] = self._end(good, sign)

    def _end(self, edge: float, width: float) -> str:
        """Whether values grow without bound towards an edge, by how fast they grow."""
        outer, middle, inner = (self.at(edge + part * width)[-1] for part in tol.EXTREMUM_EDGE_NEAR)
        if inner > middle > outer and inner - middle > 0.7 * (middle - outer):
            return ENDLESS
        return OPEN

    def _zeros(self) -> None:
        """Sample where side conditions are just met, between samples that meet them and others,
        and where one comes near to that between samples.
        """
        for column in range(self.y.shape[1] - 1):
            for sign in (1.0, -1.0):
                for k in self._local_extrema(column, sign):
                    self._summit(column, sign, k)
            y = self.y[:, column]
            change = np.flatnonzero(
                (y[:-1] < 0.0) & (y[1:] >= 0.0) | (y[:-1] >= 0.0) & (y[1:] < 0.0)
            )
            for a, b in self.x[np.stack([change, change + 1], axis=1)]:
                self._zero(column, float(a), float(b))

    def _local_extrema(self, column: int, sign: float) -> list[float]:
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
            value, derivative = self.derivatives(place)
            here = sign * float(value[column]), sign * float(derivative[column])
            return here if math.isfinite(here[0] + here[1]) else (-math.inf, -1.0)

        top = summit(look, *self.x[k - 1 : k + 2].tolist())
        self.add(np.array([top]))
        return top

    def _zero(self, column: int, a: float, b: float) -> None:
        """Sample the last place of a side condition that is met, between two of different sign."""

        def value(x: float) -> float:
            f = float(self.values(np.array([x]))[0][0, column])
            return f if math.isfinite(f) else math.nan

        values = float(self.at(a)[column]), float(self.at(b)[column])
        width = tol.EXTREMUM_BRACKET * (abs(a) + abs(b) + self.spacing)
        found = zero_between(value, (a, b), values, width)
        if found.converged:
            self.add(np.array([found.above]))

    # -- greatest values -----------------------------------------------------------------------

    def best(self, wanted: float) -> Best | None:
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
        k = int(equal[np.abs(self.x[equal] - wanted).argmin()])
        while y[max(k - 1, 0) : k + 2].max() > y[k]:
            k = int(max(k - 1, 0) + y[max(k - 1, 0) : k + 2].argmax())
        x = float(self.x[k])
        outer = -1 if x == self.x[0] else 1 if x == self.x[-1] else 0
        return Best(x, float(self.at(x)[-1]), self.edges.get(x, CLOSED), outer)

    @property
    def _floor(self) -> float:
        """By how much values may differ that are equal."""
        top = int(np.where(self.allowed, self.y[:, -1], -np.inf).argmax())
        return float(self.noise[-1] + tol.EXTREMUM_VALUES_EQUAL * self.size[top, -1])

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
            wide = self.x[k + 1] - self.x[k - 1] > tol.EXTREMUM_SPACING_WIDE * self.spacing
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
    """The place of the greatest value between a and c, x being greater than both: where the
    derivative changes its sign, at a nonsmooth point as well.
    """
    top, derivative = look(x)
    tried = [(top, x)]
    bottom = top if derivative > 0.0 else -math.inf

    def rising(place: float) -> float:
        """The derivative; where the value is less than at a place before it, it has fallen."""
        nonlocal bottom
        value, derivative = look(place)
        tried.append((value, place))
        if derivative <= 0.0:
            return derivative
        if value < bottom:
            return -math.inf
        bottom = value
        return derivative

    right = derivative > 0.0
    ends, values = ((x, c), (derivative, -math.inf)) if right else ((a, x), (math.inf, derivative))
    width = tol.EXTREMUM_BRACKET * (abs(a) + abs(c)) + tol.EXTREMUM_BRACKET_PART * (c - a)
    zero_between(rising, ends, values, width)
    return max(tried)[1]


#: An unknown without bounds is sought up to so many steps from the start, then farther.
WIDTHS = (1e3, 1e6)
#: The angle of a driver without bounds is sought over so many revolutions to both sides, then
#: farther.
REVOLUTIONS = (1.0, 4.0)


class Unbounded(Exception):
    """There is no greatest value: towards where it grows, and whether without bound."""

    def __init__(self, u: float, value: float, *, edge: bool) -> None:
        super().__init__(u)
        self.u, self.value, self.edge = u, value, edge


@dataclass(frozen=True)
class Extremum:
    """Result of the search over one unknown, in its steps.

    `u`: The place; None where no sample is allowed.
    `nearest`: Of samples that can be analysed, the one that breaks side conditions least; NaN where
      none can be.
    `low`, `high`: The range that was searched.
    `gaps`: Where within it values fail.
    `inwards`: Where the place is the edge of what can be analysed: places ever further from it, at
      which an analysis has more digits left. Empty elsewhere.
    `unresolved`: Whether samples still did not foretell each other when there were enough of them.
    """

    u: float | None
    nearest: float
    low: float
    high: float
    gaps: tuple[tuple[float, float], ...] = field(default=())
    inwards: tuple[float, ...] = ()
    unresolved: bool = False


class _Range:
    """The places of one unknown as a range of a parameter s, finer near the start where the unknown
    is no angle: u = start + sinh s.
    """

    def __init__(self, one: SearchVariable, width: float) -> None:
        self.start = one.start / one.scale
        low, high = one.bounds
        self.stops = not math.isfinite(low), not math.isfinite(high)
        self.even = one.angle
        if one.angle:
            self.stops = False, False
            low = low if math.isfinite(low) else min(self.start, high) - width * one.revolution
            high = high if math.isfinite(high) else max(self.start, low) + width * one.revolution
        else:
            low = max(low, self.start - width)
            high = min(high, self.start + width)
        self.low, self.high = low, high
        #: Whether the ends are none of the user's bounds.
        self.given = low <= one.bounds[0], high >= one.bounds[1]

    def u(self, s: Array) -> Array:
        """The unknown at parameters s, exactly the bounds at its ends."""
        u = s if self.even else self.start + np.sinh(s)
        u = np.where(np.abs(u) <= tol.EXTREMUM_UNKNOWN_NONE * (1.0 + abs(self.start)), 0.0, u)
        clipped: Array = np.clip(u, self.low, self.high)
        return clipped

    def s(self, u: float) -> float:
        """The parameter of a place."""
        return u if self.even else math.asinh(u - self.start)

    def profile(self, values: Values, derivatives: Derivatives, noise: Array) -> Profile:
        """The samples of a function of the unknown."""
        low, high = self.s(self.low), self.s(self.high)
        start, zero = self.s(self.start), self.s(0.0)
        return Profile(
            lambda s: values(self.u(s)),
            lambda s: self._by_parameter(derivatives, s),
            low,
            high,
            start,
            noise,
            self.stops,
            also=(zero,),
        )

    def _by_parameter(self, derivatives: Derivatives, s: float) -> tuple[Array, Array]:
        """Values and derivatives by the parameter."""
        value, derivative = derivatives(float(self.u(np.array([s]))[0]))
        return value, derivative if self.even else derivative * math.cosh(s)


def extremum(
    one: SearchVariable, values: Values, derivatives: Derivatives, noise: Array
) -> Extremum:
    """Place at which the last column is greatest while no other is negative. `noise` (columns,)."""
    for width in REVOLUTIONS if one.angle else WIDTHS:
        space = _Range(one, width)
        profile = space.profile(values, derivatives, noise)
        best = profile.best(space.s(space.start))
        at_end = best is not None and best.outer and not space.given[best.outer > 0]
        if not at_end and (best is not None or all(space.given)):
            break
    u = None if best is None else float(space.u(np.array([best.x]))[0])
    if best is not None and u is not None and (at_end or best.end == ENDLESS):
        raise Unbounded(u, best.value, edge=best.end == ENDLESS)
    low, high = (float(u) for u in space.u(profile.x[[0, -1]]))
    return Extremum(
        u=u,
        nearest=_nearest(profile, space),
        low=low,
        high=high,
        gaps=_gaps(profile, space),
        inwards=_inwards(profile, space, best.x) if best is not None and best.end == OPEN else (),
        unresolved=not profile.steady,
    )


def _inwards(profile: Profile, space: _Range, edge: float) -> tuple[float, ...]:
    """Unknowns close to an edge of the range, towards its inside: see `Extremum.inwards`."""
    k = int(np.searchsorted(profile.x, edge))
    below = k > 0 and bool(profile.evaluated[k - 1])
    step = (-1.0 if below else 1.0) * profile.spacing
    places = edge + step * np.append(0.0, 10.0 ** np.arange(-14.0, -2.0))
    return tuple(space.u(places).tolist())


def _nearest(profile: Profile, space: _Range) -> float:
    """Unknown with the least violation of conditions: see `Extremum.nearest`."""
    if not profile.evaluated.any():
        return math.nan
    margins = profile.y[:, :-1] / np.maximum(profile.size[:, :-1], tol.TINY)
    worst = np.nan_to_num(margins.min(axis=1, initial=0.0), nan=-np.inf)
    worst[~profile.evaluated] = -np.inf
    return float(space.u(profile.x[[int(worst.argmax())]])[0])


def _gaps(profile: Profile, space: _Range) -> tuple[tuple[float, float], ...]:
    """Runs of samples without values, from edge to edge."""
    found = np.concatenate([[True], profile.evaluated, [True]])
    x = np.concatenate([profile.x[:1], profile.x, profile.x[-1:]])
    begins, ends = np.flatnonzero(found[:-1] & ~found[1:]), np.flatnonzero(~found[:-1] & found[1:])
    return tuple(
        (float(space.u(x[[a]])[0]), float(space.u(x[[b + 1]])[0]))
        for a, b in zip(begins, ends, strict=True)
    )


# -- The greatest value of several unknowns: climbs from many starts, checked by samples -------
# A climb is a search of `optimize`: sequential quadratic programming with exact derivatives, ended
# by linear steps. Its end is a local greatest value; that it is the greatest of all is not proved,
# and in doubt where climbs end at different values, or a sample is better than all.

#: Starts of climbs, samples that check them, and combinations of binding rows that are tried.
STARTS, CLIMB_SAMPLES, CORNERS = 12, 80, 60
#: An unknown without bounds is sought so many steps about a place, then farther.
BOX_HALF_WIDTHS = (10.0, 1e2, 1e3, 1e4)


@dataclass(frozen=True)
class ClimbResult:
    """Result of the climbs from all starts.

    `u` (unknowns,): The best place; None where no side conditions could be met.
    `nearest` (unknowns,): The place that breaks them least, where none meets them.
    `endless`: Whether values grow as far as was searched.
    `starts`, `agreeing`: Climbs that ended, and those that ended at the best value; none where a
      sample was better.
    `stopped`: How they were stopped; empty where all were made.
    """

    u: Array | None
    nearest: Array | None
    endless: bool = False
    starts: int = 0
    agreeing: int = 0
    stopped: str = ""

    @property
    def sure(self) -> bool:
        """Whether all agree."""
        return not self.stopped and self.agreeing == self.starts and self.starts > 1


@dataclass(frozen=True)
class _Place:
    """Rows about a place, as a design of the optimizer."""

    x: Array
    rows: Affine

    def mobility(self) -> tuple[float, Array, int]:
        """No limit: one instant may be near to a singular position, which the answer says."""
        return 1.0, np.zeros(len(self.x)), 0


@dataclass(frozen=True)
class _Row:
    """One of the rows, as an aim of the optimizer or a limit."""

    index: int
    sign: float = 1.0
    equal: bool = False
    #: One row is smooth, and neither the worst of several nor a root of squares.
    each: bool = False
    squared: bool = False

    def rows(self, at: _Place) -> AimRows:
        """Its value and its derivatives."""
        k = [self.index]
        return AimRows(at.rows.residuals[k], at.rows.jacobian[k], np.array([0])).times(self.sign)

    def margin(self, at: _Place) -> float:
        """By how much it holds."""
        value = float(at.rows.residuals[self.index])
        return -abs(value) if self.equal else value


class _Hill:
    """Climbs over rows within the bounds of the unknowns."""

    def __init__(
        self, rows: Residuals, equations: int, wanted: Sequence[SearchVariable], sign: float
    ) -> None:
        self.rows, self.equations, self.sign = rows, equations, sign
        self.wanted = wanted
        self.start = np.array([one.start / one.scale for one in wanted])
        self.low, self.high = self._box(self.start, BOX_HALF_WIDTHS[-1])
        bounds = np.array([one.bounds for one in wanted])
        self.given = bounds == np.stack([self.low, self.high], axis=1)
        residuals, size = rows(self.start[None])
        self.scale = np.where(np.isfinite(size[0]) & (size[0] > 0.0), size[0], 1.0)
        last = residuals.shape[1] - 1
        self.aim = _Row(last, -sign)
        self.limits = [_Row(k, equal=k < equations) for k in range(last)]

    def _box(self, middle: Array, half_width: float) -> tuple[Array, Array]:
        """Bounds of a search about a place: those of the unknowns, where they have none, so far."""
        bounds = np.array([one.bounds for one in self.wanted])
        half_widths = np.array([one.revolution or half_width for one in self.wanted])
        return np.maximum(bounds[:, 0], middle - half_widths), np.minimum(
            bounds[:, 1], middle + half_widths
        )

    def _linearized_at(self, x: Array) -> _Place | None:
        here = self.rows.about(x)
        return None if here is None else _Place(x, here)

    def climb(self, u: Array) -> SearchResult | None:
        """The end of a climb; None where it cannot begin. Where an unknown has no bounds the box is
        widened as long as climbs end at its sides.
        """
        end, begun = np.clip(u, self.low, self.high), math.nan
        for half_width in BOX_HALF_WIDTHS:
            low, high = self._box(end, half_width)
            low, high = np.maximum(low, self.low), np.minimum(high, self.high)
            bounds = low, high
            program = Program(self._linearized_at, bounds, self.aim, self.limits)
            program.sizes = self.scale[:-1].tolist()
            program.scale, program.mobile = float(self.scale[-1]), 1.0
            found = program.search(end)
            if found is None:
                return None
            end, begun = found.at.x, found.begun if math.isnan(begun) else begun
            tolerance = tol.EXTREMUM_VALUES_SAME * (high - low)
            inner = (end <= low + tolerance) & (low > self.low)
            inner |= (end >= high - tolerance) & (high < self.high)
            if not inner.any():
                break
        met = self.met(self.refined(np.clip(end, self.low, self.high)))
        return None if met is None else replace(met, begun=begun)

    def met(self, u: Array) -> SearchResult | None:
        """A place, with the sign that makes the best value least, and by how much it breaks
        conditions as a part of their terms.
        """
        here = self.rows.about(u)
        if here is None:
            return None
        part = here.residuals[:-1] / np.maximum(here.size[:-1], tol.TINY)
        part[: self.equations] = -np.abs(part[: self.equations])
        broken = -min(float(part.min(initial=0.0)), 0.0)
        return SearchResult(u, -self.sign * float(here.residuals[-1]), broken)

    def refined(self, u: Array) -> Array:
        """Unknowns at which the conditions, and those that bind, are met to rounding."""
        here = self.rows.about(u)
        if here is None:
            return u
        part = np.abs(here.residuals[:-1]) / np.maximum(here.size[:-1], tol.TINY)
        bind = [
            k for k in range(len(part)) if k < self.equations or part[k] < tol.EXTREMUM_VALUES_SAME
        ]
        if not bind or len(bind) > len(u):
            return u
        found = newton(self.rows, bind, u)
        if found is None or np.abs(found.base - u).max() > tol.EXTREMUM_BINDS_NEAR * (
            1.0 + np.abs(u).max()
        ):
            return u
        inside = (found.base >= self.low).all() and (found.base <= self.high).all()
        return found.base if inside else u


def best_climb(
    rows: Residuals, equations: int, wanted: Sequence[SearchVariable], sign: float
) -> ClimbResult:
    """Maximum of the objective, times a sign: of rows as those of `Trials.rows`."""
    hill = _Hill(rows, equations, wanted, sign)
    start = hill.start
    every = spread([one.grid for one in wanted], STARTS + CLIMB_SAMPLES)
    searches = Searches(1 + STARTS)

    def sample(u: Array) -> SearchResult | None:
        at = newton(rows, range(equations), u) if equations else None
        place = u if at is None else at.base
        inside = (place >= hill.low).all() and (place <= hill.high).all()
        return hill.met(place) if inside and (at is not None or not equations) else None

    climbs = list(searches.ends([start, *every[:STARTS]], hill.climb))
    samples = [start, *_corners(rows, equations, start), *every[STARTS:]]
    checks = [] if searches.stopped else [one for one in map(sample, samples) if one is not None]
    ended = ending(climbs, tol.ROW_HOLDS, tol.EXTREMUM_VALUES_SAME, checks)
    if ended is None:
        nearest = min(climbs + checks, key=lambda one: one.broken, default=None)
        return ClimbResult(None, None if nearest is None else nearest.at)
    tolerance = tol.EXTREMUM_VALUES_SAME * (hill.high - hill.low)
    best = ended.best.at
    on_end = (
        np.stack([best <= hill.low + tolerance, best >= hill.high - tolerance], axis=1)
        & ~hill.given
    )
    on_end &= np.array([[not one.angle] * 2 for one in wanted])
    starts = sum(one.broken <= tol.ROW_HOLDS for one in climbs)
    endless = bool(on_end.any())
    return ClimbResult(best, None, endless, starts, ended.agreeing, searches.stopped)


def _corners(rows: Residuals, equations: int, start: Array) -> list[Array]:
    """Places where as many side conditions bind as unknowns are left."""
    count, sides = len(start) - equations, len(rows(start[None])[0][0]) - 1 - equations
    if not 0 < count <= sides or math.comb(sides, count) > CORNERS:
        return []
    found = []
    for more in itertools.combinations(range(equations, equations + sides), count):
        at = newton(rows, [*range(equations), *more], start)
        if at is not None:
            found.append(at.base)
    return found
