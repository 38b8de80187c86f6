"""The greatest value of several unknowns: climbs from many starts, checked by samples.

A climb ends at a local greatest value (sequential quadratic programming, Kraft 1988). That it is
the greatest of all is not proved; it is in doubt where climbs end at different values, or a sample
is better than all.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.inverse.roots import HOLDS, Residuals, about, newton, spread
from mbody.analysis.inverse.unknowns import Wanted

__all__ = ["Climbed", "climbed"]

Array = np.ndarray

#: Starts of climbs, samples that check them, and combinations of binding rows that are tried.
STARTS, SAMPLES, CORNERS = 12, 80, 60
#: An unknown without bounds is sought up to so many steps from the start.
REACH = 1e4
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


class _Hill:
    """Rows about a place, kept while one asks for values and slopes there."""

    def __init__(
        self, rows: Residuals, equations: int, wanted: Sequence[Wanted], sign: float
    ) -> None:
        self.rows, self.equations, self.sign = rows, equations, sign
        low, high = np.array([self._bounds(one) for one in wanted]).T
        self.low, self.high = low, high
        self.given = np.array([[one.bounds[k] == (low, high)[k][n] for k in (0, 1)]
                               for n, one in enumerate(wanted)])  # fmt: skip
        start = np.array([one.start / one.scale for one in wanted])
        rest, size = rows(start[None])
        self.scale = np.where(np.isfinite(size[0]) & (size[0] > 0.0), size[0], 1.0)
        self.place, self.rest, self.slope = np.full(len(start), np.nan), rest[0], np.zeros((1, 1))

    @staticmethod
    def _bounds(one: Wanted) -> tuple[float, float]:
        start, (low, high) = one.start / one.scale, one.bounds
        reach = one.turn or REACH
        return max(low, start - reach), min(high, start + reach)

    def look(self, u: Array) -> None:
        """Values and slopes at a place; where there are none, far below and flat."""
        if np.array_equal(u, self.place):
            return
        found = about(self.rows, np.clip(u, self.low, self.high))
        self.place = u.copy()
        if found is None:
            self.rest = np.where(np.arange(len(self.rest)) == len(self.rest) - 1, -1e6, -1.0)
            self.rest = (
                self.rest
                * self.scale
                * np.where(np.arange(len(self.rest)) == len(self.rest) - 1, self.sign, 1.0)
            )
            self.slope = np.zeros((len(self.rest), len(u)))
        else:
            self.rest, self.slope = found.rest, found.slope

    def climb(self, u: Array) -> Array | None:
        """The end of a climb; None where it does not end."""
        from scipy.optimize import minimize

        def part(name: str, rows: slice | int, factor: Array | float) -> Callable[[Array], Array]:
            def rows_at(u: Array) -> Array:
                self.look(u)
                found: Array = (getattr(self, name)[rows].T * factor).T
                return found

            return rows_at

        last = len(self.rest) - 1
        conditions = []
        for kind, rows in (("eq", slice(0, self.equations)), ("ineq", slice(self.equations, last))):
            if rows.start < rows.stop:
                factor = 1.0 / self.scale[rows]
                conditions.append(
                    {
                        "type": kind,
                        "fun": part("rest", rows, factor),
                        "jac": part("slope", rows, factor),
                    }
                )
        with np.errstate(all="ignore"):
            found = minimize(
                part("rest", last, -self.sign / self.scale[last]),
                np.clip(u, self.low, self.high),
                jac=part("slope", last, -self.sign / self.scale[last]),
                bounds=list(zip(self.low, self.high, strict=True)),
                constraints=conditions,
                method="SLSQP",
                options={"maxiter": 80, "ftol": 1e-13},
            )
        if found.status not in (0, 8) or not np.isfinite(found.x).all():
            return None
        return np.asarray(np.clip(found.x, self.low, self.high))

    def met(self, u: Array) -> tuple[float, float] | None:
        """The value at a place and by how much it breaks conditions, as a part of their terms."""
        here = about(self.rows, u)
        if here is None:
            return None
        part = here.rest[:-1] / np.maximum(here.size[:-1], 1e-300)
        part[: self.equations] = -np.abs(part[: self.equations])
        return self.sign * float(here.rest[-1]), -min(float(part.min(initial=0.0)), 0.0)

    def refined(self, u: Array) -> Array:
        """The same with conditions, and what binds, met to rounding."""
        here = about(self.rows, u)
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


def climbed(rows: Residuals, equations: int, wanted: Sequence[Wanted], sign: float) -> Climbed:
    """Where the objective, times a sign, is greatest: of rows as those of `Trials.rows`.

    Parameters
    ----------
    equations : int
        How many rows, the first ones, are to be zero; all others but the last not negative.
    """
    hill = _Hill(rows, equations, wanted, sign)
    start = np.array([one.start / one.scale for one in wanted])
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
