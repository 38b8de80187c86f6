"""The greatest value of several unknowns: climbs from many starts, checked by samples.

A climb is a search of `optimize`: sequential quadratic programming with exact derivatives, ended by
linear steps. Its end is a local greatest value; that it is the greatest of all is not proved, and
in doubt where climbs end at different values, or a sample is better than all.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.inverse.roots import HOLDS, Affine, Residuals, newton, spread
from mbody.inverse.unknowns import Wanted
from mbody.optimization.aims_and_limits import AimRows
from mbody.optimization.nonlinear_program import Program

__all__ = ["Climbed", "climbed"]

Array = np.ndarray

#: Starts of climbs, samples that check them, and combinations of binding rows that are tried.
STARTS, SAMPLES, CORNERS = 12, 80, 60
#: An unknown without bounds is sought so many steps about a place, then farther.
REACHES = (10.0, 1e2, 1e3, 1e4)
#: Values that differ by less than this part of their size are one; a row binds below it.
SAME = 1e-6
#: What binds is met to rounding within this part of the unknowns.
NEAR = 1e-3


@dataclass(frozen=True)
class Climbed:
    """What climbs found.

    Attributes
    ----------
    u : array (unknowns,) or None
        The best place; None where no side conditions could be met.
    nearest : array (unknowns,) or None
        The place that breaks them least, where none meets them.
    endless : bool
        Whether values grow as far as was searched.
    starts, agreeing : int
        Climbs that ended, and those that ended at the best value.
    better : bool
        Whether a sample was better than all climbs.
    """

    u: Array | None
    nearest: Array | None
    endless: bool = False
    starts: int = 0
    agreeing: int = 0
    better: bool = False

    @property
    def sure(self) -> bool:
        """Whether all agree."""
        return not self.better and self.agreeing == self.starts and self.starts > 1


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
        """Its value and its slopes."""
        k = [self.index]
        return AimRows(at.rows.rest[k], at.rows.slope[k], np.array([0])).times(self.sign)

    def margin(self, at: _Place) -> float:
        """By how much it holds."""
        value = float(at.rows.rest[self.index])
        return -abs(value) if self.equal else value


class _Hill:
    """Climbs over rows within the bounds of the unknowns."""

    def __init__(
        self, rows: Residuals, equations: int, wanted: Sequence[Wanted], sign: float
    ) -> None:
        self.rows, self.equations, self.sign = rows, equations, sign
        self.wanted = wanted
        self.start = np.array([one.start / one.scale for one in wanted])
        self.low, self.high = self._box(self.start, REACHES[-1])
        bounds = np.array([one.bounds for one in wanted])
        self.given = bounds == np.stack([self.low, self.high], axis=1)
        rest, size = rows(self.start[None])
        self.scale = np.where(np.isfinite(size[0]) & (size[0] > 0.0), size[0], 1.0)
        last = rest.shape[1] - 1
        self.aim = _Row(last, -sign)
        self.limits = [_Row(k, equal=k < equations) for k in range(last)]

    def _box(self, middle: Array, reach: float) -> tuple[Array, Array]:
        """Bounds of a search about a place: those of the unknowns, where they have none, so far."""
        bounds = np.array([one.bounds for one in self.wanted])
        far = np.array([one.turn or reach for one in self.wanted])
        return np.maximum(bounds[:, 0], middle - far), np.minimum(bounds[:, 1], middle + far)

    def _at(self, x: Array) -> _Place | None:
        here = self.rows.about(x)
        return None if here is None else _Place(x, here)

    def climb(self, u: Array) -> Array | None:
        """The end of a climb; None where it cannot begin. Where an unknown has no bounds the box is
        widened as long as climbs end at its sides.
        """
        end = np.clip(u, self.low, self.high)
        for reach in REACHES:
            low, high = self._box(end, reach)
            low, high = np.maximum(low, self.low), np.minimum(high, self.high)
            program = Program(self._at, (low, high), self.aim, self.limits, _nothing)
            program.sizes = self.scale[:-1].tolist()
            program.scale, program.mobile = float(self.scale[-1]), 1.0
            found = program.search(end)
            if found is None:
                return None
            end = found.at.x
            near = SAME * (high - low)
            inner = (end <= low + near) & (low > self.low)
            inner |= (end >= high - near) & (high < self.high)
            if not inner.any():
                break
        return np.asarray(np.clip(end, self.low, self.high))

    def met(self, u: Array) -> tuple[float, float] | None:
        """The value at a place and by how much it breaks conditions, as a part of their terms."""
        here = self.rows.about(u)
        if here is None:
            return None
        part = here.rest[:-1] / np.maximum(here.size[:-1], 1e-300)
        part[: self.equations] = -np.abs(part[: self.equations])
        return self.sign * float(here.rest[-1]), -min(float(part.min(initial=0.0)), 0.0)

    def refined(self, u: Array) -> Array:
        """The same with conditions, and what binds, met to rounding."""
        here = self.rows.about(u)
        if here is None:
            return u
        part = np.abs(here.rest[:-1]) / np.maximum(here.size[:-1], 1e-300)
        bind = [k for k in range(len(part)) if k < self.equations or part[k] < SAME]
        if not bind or len(bind) > len(u):
            return u
        found = newton(self.rows, bind, u)
        if found is None or np.abs(found.base - u).max() > NEAR * (1.0 + np.abs(u).max()):
            return u
        inside = (found.base >= self.low).all() and (found.base <= self.high).all()
        return found.base if inside else u


def _nothing() -> None:
    """Climbs are not stopped."""


def climbed(rows: Residuals, equations: int, wanted: Sequence[Wanted], sign: float) -> Climbed:
    """Where the objective, times a sign, is greatest: of rows as those of `Trials.rows`.

    Parameters
    ----------
    equations : int
        How many rows, the first ones, are to be zero; all others but the last not negative.
    """
    hill = _Hill(rows, equations, wanted, sign)
    start = hill.start
    grids = [one.grid for one in wanted]
    every = spread(grids, STARTS + SAMPLES)
    ends: list[tuple[float, Array]] = []
    nearest: tuple[float, Array | None] = (math.inf, None)
    for u in [start, *every[:STARTS]]:
        end = hill.climb(u)
        if end is None:
            continue
        end = hill.refined(end)
        met = hill.met(end)
        if met is not None and met[1] <= HOLDS:
            ends.append((met[0], end))
        elif met is not None:
            nearest = min(nearest, (met[1], end), key=lambda pair: pair[0])
    others: list[tuple[float, Array]] = []
    for u in [start, *_corners(rows, equations, start), *every[STARTS:]]:
        place = u
        if equations:
            at = newton(rows, range(equations), u)
            if at is None:
                continue
            place = at.base
        if (place < hill.low).any() or (place > hill.high).any():
            continue
        met = hill.met(place)
        if met is not None and met[1] <= HOLDS:
            others.append((met[0], place))
        elif met is not None:
            nearest = min(nearest, (met[1], place), key=lambda pair: pair[0])
    if not ends and not others:
        return Climbed(None, nearest[1])
    top, best = max(ends + others, key=lambda pair: pair[0])
    floor = SAME * max(abs(top), max(abs(value) for value, _ in ends + others))
    agreeing = sum(value >= top - floor for value, _ in ends)
    near = SAME * (hill.high - hill.low)
    on_end = np.stack([best <= hill.low + near, best >= hill.high - near], axis=1) & ~hill.given
    on_end &= np.array([[not one.angle] * 2 for one in wanted])
    better = not ends or max(value for value, _ in ends) < top - floor
    return Climbed(best, None, bool(on_end.any()), len(ends), agreeing, better)


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
