"""A law through given points: linear interpolation, a monotone cubic (pchip) or a C² spline."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FixedLaw, FloatArray, law_field, law_numbers
from mbody.laws.kernels import OUTSIDE
from mbody.laws.slopes import of_pchip, of_periodic_spline, of_spline
from mbody.quantities.types import Converted, NumberRow
from mbody.quantities.units import DIMENSIONS, Dimension

__all__ = ["End", "Interpolation", "Outside", "Table"]

Interpolation = Literal["hold", "linear", "pchip", "spline"]
End = Literal["natural", "not-a-knot", "clamped"]
Outside = Literal["error", "hold", "line"]


#: A spline is reported to leave the range of its points if it does so by more than this part of the
#: range: rounding of the coefficients may exceed it by less.
BEYOND = 1e-9
#: Dimensions of a motion, whose tables are smooth by default.
MOTIONS = (DIMENSIONS["length"], DIMENSIONS["angle"])


@dataclass(frozen=True, repr=False)
class Table(FixedLaw):
    """A curve through given points: straight lines, a monotone cubic, or a cubic spline.

    Parameters
    ----------
    x, y : array_like (N,)
        Points, N ≥ 2, x strictly increasing.
    periodic : bool
        The table repeats with the period x[−1] − x[0]; then y[−1] must equal y[0].
    end : {"not-a-knot", "natural", "clamped"}, optional
        Of a spline, at both ends: one cubic over the two outer intervals (the default), f″ = 0, or
        f′ = 0. Of no effect when periodic. "not-a-knot" is the most accurate for a smooth function;
        "natural" has an error of order h² near the ends unless f″ is 0 there.
    outside : {"error", "hold", "line"}
        Outside the range: an error, the end value, or the end's tangent. A margin of 1e-9 of the
        range is always allowed. A result that used "hold" or "line" has a doubt.
    interpolation : {"hold", "linear", "pchip", "spline"}, optional
        Between the points:

        * "hold", steps: f keeps the value of the last point (zero-order hold, as of a sampled
          signal), f′ = 0; the last value lasts as long as the one before it;
        * "linear", straight lines: f is continuous, f′ jumps at the points;
        * "pchip", a piecewise cubic that is monotone wherever the points are, so that it never
          leaves their range: f′ is continuous, f″ jumps at the points;
        * "spline", a cubic spline with continuous f, f′ and f″: the most accurate for points of a
          smooth function, but it overshoots where the points jump.

        By default the element decides: "spline" for a motion (a length or an angle, as of a driver
        or a cam), "pchip" for everything else, such as a force. Where `end` is given, and for a
        table without an element, it is "spline".

    Raises
    ------
    ModelError
        For points that are not as above; later, when evaluated outside the range with "error". The
        kernel returns NaN there.

    Notes
    -----
    Spline: de Boor, A Practical Guide to Splines, chapter IV, a tridiagonal system for the slopes.
    Pchip: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300, as in SciPy.

    >>> t = np.linspace(0.0, 1.0, 5)
    >>> np.round(Table(t, t**3).derivatives(0.5), 12)
    array([0.125, 0.75 , 3.   ])
    >>> step = Table([0, 1, 1.1, 2], [0, 0, 5, 5], interpolation="pchip")
    >>> bool(step(np.linspace(0, 2, 99)).max() <= 5.0)
    True
    """

    kind: ClassVar[str] = "spline"

    x: Converted[tuple[float, ...], NumberRow] = law_field(argument=1)
    y: Converted[tuple[float, ...], NumberRow] = law_field(1)
    periodic: bool = False
    end: End | None = None
    outside: Outside = "error"
    interpolation: Interpolation | None = None

    def _read_numbers(self) -> None:
        object.__setattr__(self, "x", law_numbers(self.x, "Table", "x"))
        object.__setattr__(self, "y", law_numbers(self.y, "Table", "y"))

    def _check(self) -> None:
        x, y = np.asarray(self.x), np.asarray(self.y)
        for field, choices in (
            ("end", (*get_args(End), None)),
            ("outside", get_args(Outside)),
            ("interpolation", (*get_args(Interpolation), None)),
        ):
            if getattr(self, field) not in choices:
                raise ModelError(
                    f"Table: {field} must be one of {', '.join(filter(None, choices))}, "
                    f"not {getattr(self, field)!r}"
                )
        if self.end is not None and self.interpolation not in (None, "spline"):
            raise ModelError(
                f"Table: end = {self.end!r} is for a spline, not for interpolation = "
                f"{self.interpolation!r}: leave out end, or choose interpolation = 'spline'"
            )
        if x.size != y.size:
            raise ModelError(f"Table: x has {x.size} points and y has {y.size}; give as many")
        if x.size < 2:
            raise ModelError(f"Table: at least 2 points are needed, there is {x.size}")
        bad = np.flatnonzero(np.diff(x) <= 0.0)
        if bad.size:
            i = int(bad[0])
            raise ModelError(
                f"Table: x must increase from point to point, but x[{i + 1}] = "
                f"{x[i + 1]:g} follows x[{i}] = {x[i]:g}: sort the points and drop "
                "repeated ones"
            )
        if self.periodic and y[0] != y[-1]:
            if abs(y[-1] - y[0]) > 1e-9 * np.ptp(y):
                raise ModelError(
                    f"Table: a periodic table must end where it begins, but y[0] = "
                    f"{y[0]:g} and y[-1] = {y[-1]:g}: repeat the first point one "
                    "period later as the last"
                )
            object.__setattr__(self, "y", (*self.y[:-1], self.y[0]))

    def __repr__(self) -> str:
        size, x = len(self.x), self.x
        if self.pending:
            return f"Table(<{size} points, text among them>)"
        more = "periodic" if self.periodic else f"outside={self.outside!r}"
        kind = f"interpolation={self._between!r}"
        if self.end is not None:
            kind += f", end={self.end!r}"
        return f"Table(<{size} points, x from {x[0]:g} to {x[-1]:g}>, {kind}, {more})"

    @property
    def _between(self) -> str:
        """The interpolation between the points."""
        return self.interpolation or "spline"

    def dimensioned(self, value: Dimension, argument: Dimension) -> Table:
        """The same table for a law of that dimension, which decides the interpolation where none is
        given; errors as `Law.dimensioned`.
        """
        made: Any = super().dimensioned(value, argument)
        if made.interpolation is None:
            smooth = made.end is not None or value in MOTIONS
            made = replace(made, interpolation="spline" if smooth else "pchip")
        table: Table = made
        return table

    def table(self) -> FloatArray:
        """[N, outside code, N knots, (N − 1) × 4 ascending coefficients of x − knot]."""
        return self._table

    @cached_property
    def _table(self) -> FloatArray:
        x, y = np.asarray(self.x), np.asarray(self.y)
        h = np.diff(x)
        chord = np.diff(y) / h
        if self._between == "hold":
            # the last value, for as long as the one before
            x, y, h = np.append(x, 2.0 * x[-1] - x[-2]), np.append(y, y[-1]), np.append(h, h[-1])
            nothing = np.zeros(h.size)
            rows = np.column_stack([y[:-1], nothing, nothing, nothing])
        elif self._between == "linear":
            nothing = np.zeros(h.size)
            rows = np.column_stack([y[:-1], chord, nothing, nothing])
        else:
            d = self._slopes(h, chord)
            c2 = (3.0 * chord - 2.0 * d[:-1] - d[1:]) / h
            c3 = (d[:-1] + d[1:] - 2.0 * chord) / h**2
            rows = np.column_stack([y[:-1], d[:-1], c2, c3])
        outside = OUTSIDE.index("periodic" if self.periodic else self.outside)
        return np.concatenate([[x.size, outside], x, rows.ravel()])

    def _slopes(self, h: FloatArray, chord: FloatArray) -> FloatArray:
        if self._between == "pchip":
            return of_pchip(h, chord, self.periodic)
        return (
            of_periodic_spline(h, chord)
            if self.periodic
            else of_spline(h, chord, self.end or "not-a-knot")
        )

    def corners(self, first: float, last: float) -> FloatArray:
        """The points of the argument, between two values of it, at which f or a derivative that
        motions depend on jumps: none of a spline.
        """
        if self._between == "spline":
            return np.empty(0)
        knots = np.asarray(self.x)
        if self.periodic:
            period = knots[-1] - knots[0]
            low, high = (math.floor((end - knots[0]) / period) for end in (first, last))
            knots = np.concatenate([knots + n * period for n in range(low, high + 1)])
        return np.unique(knots[(knots > first) & (knots < last)])

    @cached_property
    def _extremes(self) -> tuple[FloatArray, FloatArray]:
        """Places within the intervals at which f′ = 0, and f there."""
        knots = np.asarray(self.x)
        if self._between == "hold":
            return np.empty(0), np.empty(0)
        c = self._table[2 + knots.size :].reshape(-1, 4)
        with np.errstate(all="ignore"):  # roots of c1 + 2 c2 w + 3 c3 w², of equal sign first
            q = -(c[:, 2] + np.copysign(np.sqrt(c[:, 2] ** 2 - 3.0 * c[:, 1] * c[:, 3]), c[:, 2]))
            roots = np.concatenate([q / (3.0 * c[:, 3]), c[:, 1] / q])
        w = np.tile(np.diff(knots), 2)
        inside = np.flatnonzero((roots > 0.0) & (roots < w))
        at, piece = roots[inside], c[inside % len(c)]
        values = piece[:, 0] + at * (piece[:, 1] + at * (piece[:, 2] + at * piece[:, 3]))
        return knots[inside % len(c)] + at, values

    def beyond(self) -> tuple[float, float] | None:
        """The place at which it exceeds the range of its points most, and its value there; None
        where it stays within the range, apart from rounding.

        >>> Table([0, 1, 1.1, 2], [0, 0, 5, 5], interpolation="pchip").beyond() is None
        True
        >>> [round(v, 3) for v in Table([0, 1, 1.1, 2], [0, 0, 5, 5]).beyond()]
        [0.425, -18.981]
        """
        places, values = self._extremes
        y = np.asarray(self.y)
        over = np.maximum(values - y.max(), y.min() - values)
        if not over.size or over.max() <= BEYOND * np.ptp(y):
            return None
        worst = int(over.argmax())
        return float(places[worst]), float(values[worst])

    def _check_values(self, xs: FloatArray, out: FloatArray) -> None:
        bad = np.isnan(out[:, 0])
        if bad.any():
            raise ModelError(
                f"Table: the table covers {self.x[0]:g} to {self.x[-1]:g}, but "
                f'{xs[bad][0]:g} was requested: add points, or choose outside="hold" or "line"'
            )

    def turns(self, x: float) -> FloatArray:
        """Knots and extremes after x: within one period, or up to the end of the table."""
        knots = np.asarray(self.x)
        places = np.concatenate([knots, self._extremes[0]])
        if self.periodic:
            period = knots[-1] - knots[0]
            places = places + period * math.floor((x - knots[0]) / period)
            places = np.append(np.concatenate([places, places + period]), x + period)
            places = places[places <= x + period]
        elif self.outside == "line":
            places = np.append(places, math.inf)
        return np.unique(places[places > x])
