"""A law through given points: C² cubic spline."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FloatArray, Law, let_in_all, term
from mbody.laws.kernels import OUTSIDE, thomas

__all__ = ["Table"]

End = Literal["natural", "not-a-knot", "clamped"]
Outside = Literal["error", "hold", "line"]


@dataclass(frozen=True, repr=False)
class Table(Law):
    """The cubic spline through given points, with continuous f, f′ and f″.

    Parameters
    ----------
    x, y : array_like (N,)
        Points, N ≥ 2, x strictly increasing.
    periodic : bool
        The table repeats with the period x[−1] − x[0]; then y[−1] must equal y[0].
    end : {"natural", "not-a-knot", "clamped"}
        At both ends f″ = 0, or one cubic over the two outer intervals, or f′ = 0. Of no effect
        when periodic. "not-a-knot" is the most accurate for a smooth function; "natural" has an
        error of order h² near the ends unless f″ is 0 there.
    outside : {"error", "hold", "line"}
        Outside the range: an error, the end value, or the end's tangent. A margin of 1e-9 of the
        range is always granted.

    Raises
    ------
    ModelError
        Points that are not as above; later, when asked outside the range with "error". The kernel
        gives NaN there.

    Notes
    -----
    de Boor, A Practical Guide to Splines, chapter IV: a tridiagonal system for the slopes.

    >>> t = np.linspace(0.0, 1.0, 5)
    >>> np.round(Table(t, t**3).derivatives(0.5), 12)
    array([0.125, 0.75 , 3.   ])
    """

    kind: ClassVar[str] = "spline"

    x: Sequence[float] | FloatArray = term(argument=1)
    y: Sequence[float] | FloatArray = term(1)
    periodic: bool = False
    end: End = "not-a-knot"
    outside: Outside = "error"

    def _enter(self) -> None:
        object.__setattr__(self, "x", let_in_all(self.x, "Table", "x"))
        object.__setattr__(self, "y", let_in_all(self.y, "Table", "y"))

    def _check(self) -> None:
        x, y = np.asarray(self.x), np.asarray(self.y)
        for field, choices in (("end", get_args(End)), ("outside", get_args(Outside))):
            if getattr(self, field) not in choices:
                raise ModelError(
                    f"Table: {field} must be one of {', '.join(choices)}, "
                    f"not {getattr(self, field)!r}"
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
        more = "periodic" if self.periodic else f"end={self.end!r}, outside={self.outside!r}"
        return f"Table(<{size} points, x from {x[0]:g} to {x[-1]:g}>, {more})"

    def numbers(self) -> dict[str, float]:
        """None: the points are fixed."""
        return {}

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """None."""
        return []

    def table(self) -> FloatArray:
        """[N, outside code, N knots, (N − 1) × 4 ascending coefficients of x − knot]."""
        return self._table

    @cached_property
    def _table(self) -> FloatArray:
        x, y = np.asarray(self.x), np.asarray(self.y)
        h = np.diff(x)
        chord = np.diff(y) / h
        d = _periodic_slopes(h, chord) if self.periodic else _slopes(h, chord, self.end)
        c2 = (3.0 * chord - 2.0 * d[:-1] - d[1:]) / h
        c3 = (d[:-1] + d[1:] - 2.0 * chord) / h**2
        rows = np.column_stack([y[:-1], d[:-1], c2, c3])
        outside = OUTSIDE.index("periodic" if self.periodic else self.outside)
        return np.concatenate([[x.size, outside], x, rows.ravel()])

    def _refuse(self, xs: FloatArray, out: FloatArray) -> None:
        bad = np.isnan(out[:, 0])
        if bad.any():
            raise ModelError(
                f"Table: the table covers {self.x[0]:g} to {self.x[-1]:g}, asked for "
                f'{xs[bad][0]:g}: add points, or choose outside="hold" or "line"'
            )

    def turns(self, x: float) -> FloatArray:
        """Knots and extremes after x: over one period, or to the end of the table."""
        knots = np.asarray(self.x)
        c = self._table[2 + knots.size :].reshape(-1, 4)
        with np.errstate(all="ignore"):  # roots of c1 + 2 c2 w + 3 c3 w², of equal sign first
            q = -(c[:, 2] + np.copysign(np.sqrt(c[:, 2] ** 2 - 3.0 * c[:, 1] * c[:, 3]), c[:, 2]))
            roots = np.concatenate([q / (3.0 * c[:, 3]), c[:, 1] / q])
        w = np.tile(np.diff(knots), 2)
        inside = (roots > 0.0) & (roots < w)
        places = np.concatenate([knots, (np.tile(knots[:-1], 2) + roots)[inside]])
        if self.periodic:
            period = knots[-1] - knots[0]
            places = places + period * math.floor((x - knots[0]) / period)
            places = np.append(np.concatenate([places, places + period]), x + period)
            places = places[places <= x + period]
        elif self.outside == "line":
            places = np.append(places, math.inf)
        return np.unique(places[places > x])


def _slopes(h: FloatArray, chord: FloatArray, end: str) -> FloatArray:
    """f′ at the knots, (N,), from the intervals h and their chords' slopes, (N − 1,)."""
    n = h.size + 1
    if end == "not-a-knot" and n == 2:
        return np.array([chord[0], chord[0]])
    if end == "not-a-knot" and n == 3:  # the parabola through three points
        bend = (chord[1] - chord[0]) / (h[0] + h[1])
        return np.array([chord[0] - bend * h[0], chord[0] + bend * h[0], chord[1] + bend * h[1]])
    lower, diagonal, upper, right = np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n)
    # equal f″ from both sides of an inner knot
    lower[1:-1], diagonal[1:-1], upper[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * (h[1:] * chord[:-1] + h[:-1] * chord[1:])
    if end == "natural":
        diagonal[0] = diagonal[-1] = 2.0
        upper[0] = lower[-1] = 1.0
        right[0], right[-1] = 3.0 * chord[0], 3.0 * chord[-1]
    elif end == "not-a-knot":
        for k, a, b in ((0, 0, 1), (n - 1, -1, -2)):  # equal f‴ on both sides of the next knot
            both = h[a] + h[b]
            diagonal[k] = h[b]
            right[k] = ((h[a] + 2.0 * both) * h[b] * chord[a] + h[a] ** 2 * chord[b]) / both
        upper[0], lower[-1] = h[0] + h[1], h[-1] + h[-2]
    solution = right.reshape(-1, 1)
    thomas(lower, diagonal, upper, solution)
    return solution[:, 0]


def _periodic_slopes(h: FloatArray, chord: FloatArray) -> FloatArray:
    """f′ at the knots of a periodic spline, (N,): cyclic system by a rank-one correction."""
    n = h.size
    before, left = np.roll(h, 1), np.roll(chord, 1)
    lower, diagonal, upper = h.copy(), 2.0 * (before + h), before.copy()
    right = 3.0 * (h * left + before * chord)
    if n < 3:  # the corners fall onto the other entries
        full = np.zeros((n, n))
        for i in range(n):
            for j, value in ((i - 1, lower[i]), (i, diagonal[i]), (i + 1, upper[i])):
                full[i, j % n] += value
        d = np.linalg.solve(full, right)
        return np.append(d, d[0])
    top, corner, shift = lower[0], upper[-1], -diagonal[0]
    diagonal[0] -= shift
    diagonal[-1] -= top * corner / shift
    both = np.zeros((n, 2))
    both[:, 0] = right
    both[0, 1], both[-1, 1] = shift, corner
    thomas(lower, diagonal, upper, both)
    p, u = both[:, 0], both[:, 1]
    d = p - u * (p[0] + top * p[-1] / shift) / (1.0 + u[0] + top * u[-1] / shift)
    return np.append(d, d[0])
