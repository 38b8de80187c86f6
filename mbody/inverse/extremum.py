"""The greatest value of one unknown: over which range it is sought, and what is reported of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mbody.inverse.global_maximum import ENDLESS, OPEN, Profile, Slopes, Values
from mbody.inverse.unknowns import Wanted

__all__ = ["Extremum", "Unbounded", "extremum"]

Array = np.ndarray

#: An unknown without bounds is sought up to so many steps from the start, then farther.
REACHES = (1e3, 1e6)
#: The angle of a driver without bounds is sought over so many turns to both sides, then farther.
TURNS = (1.0, 4.0)


class Unbounded(Exception):
    """There is no greatest value: towards where it grows, and whether without bound."""

    def __init__(self, u: float, value: float, *, edge: bool) -> None:
        super().__init__(u)
        self.u, self.value, self.edge = u, value, edge


@dataclass(frozen=True)
class Extremum:
    """What the search over one unknown found, in its steps.

    Attributes
    ----------
    u : float or None
        The place; None where no sample is allowed.
    nearest : float
        Of samples that can be analysed, the one that breaks side conditions least; NaN where none
        can be.
    low, high : float
        The range that was searched.
    gaps : tuple of pairs
        Where within it values fail.
    inwards : tuple of float
        Where the place is the edge of what can be analysed: places ever further from it, at which
        an analysis has more digits left. Empty elsewhere.
    rough : bool
        Whether samples still did not foretell each other when there were enough of them.
    """

    u: float | None
    nearest: float
    low: float
    high: float
    gaps: tuple[tuple[float, float], ...] = field(default=())
    inwards: tuple[float, ...] = ()
    rough: bool = False


class _Range:
    """The places of one unknown as a range of a parameter s, finer near the start where the unknown
    is no angle: u = start + sinh s.
    """

    def __init__(self, one: Wanted, reach: float) -> None:
        self.start = one.start / one.scale
        low, high = one.bounds
        self.stops = not math.isfinite(low), not math.isfinite(high)
        self.even = one.angle
        if one.angle:
            self.stops = False, False
            low = low if math.isfinite(low) else min(self.start, high) - reach * one.turn
            high = high if math.isfinite(high) else max(self.start, low) + reach * one.turn
        else:
            low = max(low, self.start - reach)
            high = min(high, self.start + reach)
        self.low, self.high = low, high
        #: Whether the ends are none of the user's bounds.
        self.given = low <= one.bounds[0], high >= one.bounds[1]

    def u(self, s: Array) -> Array:
        """The unknown at parameters s, exactly the bounds at its ends."""
        u = s if self.even else self.start + np.sinh(s)
        u = np.where(np.abs(u) <= 1e-15 * (1.0 + abs(self.start)), 0.0, u)
        clipped: Array = np.clip(u, self.low, self.high)
        return clipped

    def s(self, u: float) -> float:
        """The parameter of a place."""
        return u if self.even else math.asinh(u - self.start)

    def profile(self, values: Values, slopes: Slopes, noise: Array) -> Profile:
        """The samples of a function of the unknown."""
        low, high = self.s(self.low), self.s(self.high)
        start, zero = self.s(self.start), self.s(0.0)
        return Profile(
            lambda s: values(self.u(s)),
            lambda s: self._by_parameter(slopes, s),
            low,
            high,
            start,
            noise,
            self.stops,
            also=(zero,),
        )

    def _by_parameter(self, slopes: Slopes, s: float) -> tuple[Array, Array]:
        """Values and derivatives by the parameter."""
        value, slope = slopes(float(self.u(np.array([s]))[0]))
        return value, slope if self.even else slope * math.cosh(s)


def extremum(one: Wanted, values: Values, slopes: Slopes, noise: Array) -> Extremum:
    """Where the last column is greatest while no other is negative.

    Parameters
    ----------
    values : Values
        Of the unknown in its steps.
    slopes : Slopes
        The same with derivatives.
    noise : array (columns,)
        What is rounding of every column.

    Raises
    ------
    Unbounded
    """
    for reach in TURNS if one.angle else REACHES:
        space = _Range(one, reach)
        profile = space.profile(values, slopes, noise)
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
        rough=not profile.steady,
    )


def _inwards(profile: Profile, space: _Range, edge: float) -> tuple[float, ...]:
    """See `Extremum`."""
    k = int(np.searchsorted(profile.x, edge))
    below = k > 0 and bool(profile.found[k - 1])
    step = (-1.0 if below else 1.0) * profile.spacing
    places = edge + step * np.append(0.0, 10.0 ** np.arange(-14.0, -2.0))
    return tuple(space.u(places).tolist())


def _nearest(profile: Profile, space: _Range) -> float:
    """See `Extremum`."""
    if not profile.found.any():
        return math.nan
    margins = profile.y[:, :-1] / np.maximum(profile.size[:, :-1], 1e-300)
    worst = np.nan_to_num(margins.min(axis=1, initial=0.0), nan=-np.inf)
    worst[~profile.found] = -np.inf
    return float(space.u(profile.x[[int(worst.argmax())]])[0])


def _gaps(profile: Profile, space: _Range) -> tuple[tuple[float, float], ...]:
    """Runs of samples without values, from edge to edge."""
    found = np.concatenate([[True], profile.found, [True]])
    x = np.concatenate([profile.x[:1], profile.x, profile.x[-1:]])
    begins, ends = np.flatnonzero(found[:-1] & ~found[1:]), np.flatnonzero(~found[:-1] & found[1:])
    return tuple(
        (float(space.u(x[[a]])[0]), float(space.u(x[[b + 1]])[0]))
        for a, b in zip(begins, ends, strict=True)
    )
