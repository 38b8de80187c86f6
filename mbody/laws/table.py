"""A law through given points: linear interpolation, a monotone cubic (pchip) or a C² spline."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from mbody.core.decorators import njit
from mbody.core.lanes import larger, smaller, value
from mbody.core.tolerances import TABLE_CLOSES, TABLE_RANGE_MARGIN, TABLE_SPLINE_BEYOND
from mbody.errors import ModelError
from mbody.laws.base import FixedLaw, Law, law_field, law_numbers, with_dimension
from mbody.laws.kernels import OUTSIDE, FloatArray, interval, thomas
from mbody.quantities import FormulaError
from mbody.quantities.formula import Converted, NumberRow, is_pending, required
from mbody.quantities.units import DIMENSIONS, Dimension

# -- Slopes at the points of a table (pchip, cubic splines), from its intervals and chord slopes


def of_pchip(h: FloatArray, chord: FloatArray, periodic: bool) -> FloatArray:
    """f′ at the points of a monotone piecewise cubic, (N,), from the intervals h and the slopes of
    their chords, (N − 1,).

    At inner points the weighted harmonic mean of both chords, 0 at an extreme (Fritsch and Butland
    1984); at the ends a three-point formula, limited so that the curve remains monotone.
    """
    if periodic:  # every point is an inner point
        before, left = np.roll(h, 1), np.roll(chord, 1)
        d = _mean(before, h, left, chord)
        return np.append(d, d[0])
    if h.size == 1:
        return np.array([chord[0], chord[0]])
    inner = _mean(h[:-1], h[1:], chord[:-1], chord[1:])
    first = _end(h[0], h[1], chord[0], chord[1])
    return np.concatenate([[first], inner, [_end(h[-1], h[-2], chord[-1], chord[-2])]])


def _mean(h0: FloatArray, h1: FloatArray, s0: FloatArray, s1: FloatArray) -> FloatArray:
    """Slope between two chords: 0 where their signs differ."""
    w0, w1 = 2.0 * h1 + h0, h1 + 2.0 * h0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = (w0 + w1) / (w0 / s0 + w1 / s1)
    return np.where(np.sign(s0) * np.sign(s1) > 0.0, mean, 0.0)


def _end(h0: float, h1: float, s0: float, s1: float) -> float:
    """Slope at an end: s0 is the slope of the chord there, s1 that of the next chord."""
    d = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1)
    if np.sign(d) != np.sign(s0):
        return 0.0
    if np.sign(s0) != np.sign(s1) and abs(d) > 3.0 * abs(s0):
        return float(3.0 * s0)
    return float(d)


def of_spline(h: FloatArray, chord: FloatArray, end: str) -> FloatArray:
    """f′ at the knots of a cubic spline, (N,), from the intervals h and the slopes of their chords,
    (N − 1,); `end` as of a `Table`.
    """
    n = h.size + 1
    if end == "not-a-knot" and n == 2:
        return np.array([chord[0], chord[0]])
    if end == "not-a-knot" and n == 3:  # the parabola through three points
        second_difference = (chord[1] - chord[0]) / (h[0] + h[1])
        return np.array(
            [
                chord[0] - second_difference * h[0],
                chord[0] + second_difference * h[0],
                chord[1] + second_difference * h[1],
            ]
        )
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


def of_periodic_spline(h: FloatArray, chord: FloatArray) -> FloatArray:
    """f′ at the knots of a periodic spline, (N,): cyclic system by a rank-one correction."""
    n = h.size
    before, left = np.roll(h, 1), np.roll(chord, 1)
    lower, diagonal, upper = h.copy(), 2.0 * (before + h), before.copy()
    right = 3.0 * (h * left + before * chord)
    if n < 3:  # the corners fall onto the other entries
        full = np.zeros((n, n))
        for i in range(n):
            for j, entry in ((i - 1, lower[i]), (i, diagonal[i]), (i + 1, upper[i])):
                full[i, j % n] += entry
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


# -- A table of two variables in the kernels: bicubic patches ----------------------------------

#: Numbers before the knots: how many along x, how many along y, the code of what holds outside.
HEAD = 3
#: Coefficients of a patch.
PATCH = 16


@njit
def surface(tab: FloatArray, k: int, x: float, y: float) -> tuple[float, float, float]:
    """f, ∂f/∂x, ∂f/∂y; NaN where there is none.

    tab = (m, n, outside code, m knots of x, n knots of y, patches), a patch of 16 coefficients of
    uⁱ vʲ, i first, with u and v from the lower corner; those along y follow each other.
    """
    m, n, outside = int(tab[k]), int(tab[k + 1]), int(tab[k + 2])
    of_x = k + HEAD
    of_y = of_x + m
    x0, x1 = tab[of_x], tab[of_x + m - 1]
    y0, y1 = tab[of_y], tab[of_y + n - 1]
    p, q = x, y
    if outside > 0:
        p, q = smaller(larger(x, x0), x1), smaller(larger(y, y0), y1)
    wide, high = TABLE_RANGE_MARGIN * (x1 - x0), TABLE_RANGE_MARGIN * (y1 - y0)
    within = p >= x0 - wide and p <= x1 + wide and q >= y0 - high and q <= y1 + high
    if not within or x != x or y != y:
        return math.nan, math.nan, math.nan
    i, j = interval(tab, of_x, m, value(p)), interval(tab, of_y, n, value(q))
    u, v = p - tab[of_x + i], q - tab[of_y + j]
    c = of_y + n + PATCH * (i * (n - 1) + j)
    f = fx = fy = 0.0
    for a in range(3, -1, -1):
        o = c + 4 * a
        g = tab[o] + v * (tab[o + 1] + v * (tab[o + 2] + v * tab[o + 3]))
        gy = tab[o + 1] + v * (2.0 * tab[o + 2] + v * 3.0 * tab[o + 3])
        fx = fx * u + f
        f = f * u + g
        fy = fy * u + gy
    if outside == 2:
        return f + fx * (x - p) + fy * (y - q), fx, fy
    if outside == 1:
        return f, (fx if p == x else 0.0), (fy if q == y else 0.0)
    return f, fx, fy


Interpolation = Literal["hold", "linear", "pchip", "spline"]
End = Literal["natural", "not-a-knot", "clamped"]
Outside = Literal["error", "hold", "line"]


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
            if abs(y[-1] - y[0]) > TABLE_CLOSES * np.ptp(y):
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
        """A copy for a law of that dimension, which decides the interpolation where none is given;
        errors as `Law.dimensioned`.
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

    @property
    def may_have_corners(self) -> bool:
        """True but for a spline."""
        return self._between != "spline"

    def corners_between(self, first: float, last: float) -> FloatArray:
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

    def rate_jumps(self, first: float, last: float) -> FloatArray:
        """Its points between straight lines."""
        straight = self.interpolation == "linear"
        return self.corners_between(first, last) if straight else np.empty(0)

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
        if not over.size or over.max() <= TABLE_SPLINE_BEYOND * np.ptp(y):
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


# -- A table of two variables: bilinear, or piecewise bicubic by monotone slopes or splines ----

Patches = Literal["linear", "pchip", "spline"]

#: From the values, slopes and twists at the ends of an interval of length one to the coefficients
#: of the cubic through them (Hermite): rows f₀, f₁, f₀′, f₁′.
HERMITE = np.array([[1, 0, -3, 2], [0, 0, 3, -2], [0, 1, -2, 1], [0, 0, -1, 1]], dtype=float)


@dataclass(frozen=True, repr=False)
class Table2(FixedLaw):
    """A function of two variables through the points of a grid, such as the torque of an engine by
    speed and throttle.

    A mechanism has it by name, and formulas call it: ``Mechanism(curves={"engine": Table2(…)})``,
    ``Torque("drive", "crank", value="engine(crank.omega, throttle)")``.

    Parameters
    ----------
    x, y : array_like (m,), (n,)
        Places of the grid, m, n ≥ 2, strictly increasing.
    z : array_like (m, n)
        Values, a row for each x.
    interpolation : {"linear", "pchip", "spline"}
        Between the points: bilinear; bicubic patches with slopes that are monotone along every grid
        line where the points are; or a bicubic spline (not-a-knot) with continuous second
        derivatives. Along a grid line it is the `Table` of the points there.
    outside : {"error", "hold", "line"}
        Outside the grid: no value, that of the nearest edge, or the edge's tangent plane. A margin
        of 1e-9 of the range is always allowed.

    Raises
    ------
    ModelError
        For points that are no grid; later, when evaluated outside the range with "error".

    Notes
    -----
    A patch has 16 coefficients, from values, slopes and twists at its corners; the twist is the
    mean of the slopes along y of the slopes along x and of those along x of those along y, which
    for a spline are alike. Source: de Boor, J. Math. Phys. 41 (1962) 212, bicubic splines; slopes
    as of `Table`.

    >>> table = Table2([0, 1, 2], [0, 1, 2], [[0, 0, 0], [0, 1, 2], [0, 2, 4]])
    >>> table(1.5, 0.5), table.derivatives_at(1.5, 0.5)
    (0.75, (0.75, 0.5, 1.5))
    """

    kind: ClassVar[str] = "surface"

    x: Converted[tuple[float, ...], NumberRow] = required()
    y: Converted[tuple[float, ...], NumberRow] = required()
    z: Converted[tuple[tuple[float, ...], ...], Any] = required()
    interpolation: Patches = "linear"
    outside: Outside = "error"

    def _read_numbers(self) -> None:
        object.__setattr__(self, "x", law_numbers(self.x, "Table2", "x"))
        object.__setattr__(self, "y", law_numbers(self.y, "Table2", "y"))
        try:
            rows: Any = tuple(self.z)
        except TypeError:
            rows = ()
        if not rows or any(isinstance(row, str) or np.ndim(row) == 0 for row in rows):
            raise ModelError("Table2: z must be rows of numbers, one for each x")
        z = tuple(law_numbers(row, "Table2", f"z[{n}]") for n, row in enumerate(rows))
        object.__setattr__(self, "z", z)

    def _check(self) -> None:
        for field, choices in (
            ("interpolation", get_args(Patches)),
            ("outside", get_args(Outside)),
        ):
            if getattr(self, field) not in choices:
                raise ModelError(
                    f"Table2: {field} must be one of {', '.join(choices)}, "
                    f"not {getattr(self, field)!r}"
                )
        for name in "xy":
            places = np.asarray(getattr(self, name))
            if places.size < 2:
                raise ModelError(f"Table2: {name} needs at least 2 places, it has {places.size}")
            bad = np.flatnonzero(np.diff(places) <= 0.0)
            if bad.size:
                i = int(bad[0])
                raise ModelError(
                    f"Table2: {name} must increase from place to place, but {name}[{i + 1}] = "
                    f"{places[i + 1]:g} follows {name}[{i}] = {places[i]:g}: sort the grid"
                )
        if len(self.z) != len(self.x):
            raise ModelError(
                f"Table2: z has {len(self.z)} rows and x has {len(self.x)} places: give a row of z "
                "for each x"
            )
        for n, row in enumerate(self.z):
            if len(row) != len(self.y):
                raise ModelError(
                    f"Table2: z[{n}] has {len(row)} numbers and y has {len(self.y)} places: give a "
                    "number for each y"
                )

    def __repr__(self) -> str:
        size = f"{len(self.x)} × {len(self.y)} points"
        return f"Table2(<{size}>, interpolation={self.interpolation!r}, outside={self.outside!r})"

    def dimensioned(self, value: Dimension, argument: Dimension) -> Law:
        """It has two variables: an element's law cannot be one.

        Raises
        ------
        FormulaError
            Always.
        """
        raise FormulaError(
            "a Table2 has two variables: give it to the mechanism as one of its curves and call it "
            "in a formula, as in value = 'engine(crank.omega, throttle)'"
        )

    def of_dimensions(self, value: Dimension, x: Dimension, y: Dimension) -> Table2:
        """A copy with the units of its text checked.

        Raises
        ------
        FormulaError
            For a unit that does not fit.
        """
        wanted = {"x": x, "y": y, "z": value}
        pending = {name: of for name, of in wanted.items() if is_pending(getattr(self, name))}
        changed: Any = {n: with_dimension(getattr(self, n), of, n) for n, of in pending.items()}
        return replace(self, **changed)

    def table(self) -> FloatArray:
        """Coefficients of the table for `mbody.laws.table.surface`."""
        return self._table

    @cached_property
    def _table(self) -> FloatArray:
        x, y = np.asarray(self.x), np.asarray(self.y)
        patches = self._patches(x, y, np.asarray(self.z))
        head = [x.size, y.size, OUTSIDE.index(self.outside)]
        return np.concatenate([head, x, y, patches.ravel()])

    def _patches(self, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Coefficients (m − 1, n − 1, 4, 4) of uⁱ vʲ."""
        hx, hy = np.diff(x)[:, None], np.diff(y)[None, :]
        found = np.zeros((x.size - 1, y.size - 1, 4, 4))
        if self.interpolation == "linear":
            corner, along_x = z[:-1, :-1], (z[1:, :-1] - z[:-1, :-1]) / hx
            along_y = (z[:-1, 1:] - z[:-1, :-1]) / hy
            twist = (z[1:, 1:] - z[1:, :-1] - z[:-1, 1:] + z[:-1, :-1]) / (hx * hy)
            found[..., 0, 0], found[..., 1, 0] = corner, along_x
            found[..., 0, 1], found[..., 1, 1] = along_y, twist
            return found
        zx, zy = self._slopes(x, z.T).T, self._slopes(y, z)
        zxy = 0.5 * (self._slopes(y, zx) + self._slopes(x, zy.T).T)
        # at each corner f, f_u, f_v, f_uv of the unit square, (…, ends and slopes along x, along y)
        data = np.empty((*found.shape[:2], 4, 4))
        lower, upper = slice(None, -1), slice(1, None)
        for a, i in enumerate((lower, upper)):
            for b, j in enumerate((lower, upper)):
                data[..., a, b] = z[i, j]
                data[..., 2 + a, b] = zx[i, j] * hx
                data[..., a, 2 + b] = zy[i, j] * hy
                data[..., 2 + a, 2 + b] = zxy[i, j] * hx * hy
        power = np.arange(4)
        unit = HERMITE.T @ data @ HERMITE
        scale = hx[..., None, None] ** power[:, None] * hy[..., None, None] ** power
        return np.asarray(unit / scale)

    def _slopes(self, places: FloatArray, rows: FloatArray) -> FloatArray:
        """Slopes of each row at the places."""
        h = np.diff(places)
        chords = np.diff(rows, axis=1) / h
        if self.interpolation == "pchip":
            return np.array([of_pchip(h, chord, False) for chord in chords])
        return np.array([of_spline(h, chord, "not-a-knot") for chord in chords])

    def __call__(self, x: Any, y: Any) -> Any:  # type: ignore[override]
        """The value at (x, y), numbers or arrays; errors as `derivatives_at`."""
        return self.derivatives_at(x, y)[0]

    def derivatives_at(self, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """(f, ∂f/∂x, ∂f/∂y) at (x, y), each a float or an array.

        Raises
        ------
        ModelError
            Outside the grid with outside = "error", and for a table with text, which has a value
            only in a mechanism.
        """
        if self.pending:
            raise ModelError(
                "Table2: its numbers are text, which has a value only in a mechanism: give it to "
                "one as a curve"
            )
        whole = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        rows = [one.reshape(-1) for one in whole]
        found = self.raw(*rows)
        bad = np.isnan(found[:, 0])
        if bad.any():
            raise ModelError(
                f"Table2: the table covers x from {self.x[0]:g} to {self.x[-1]:g} and y from "
                f"{self.y[0]:g} to {self.y[-1]:g}, but ({rows[0][bad][0]:g}, {rows[1][bad][0]:g}) "
                'was requested: add points, or choose outside="hold" or "line"'
            )
        f, fx, fy = (column.reshape(whole[0].shape) for column in found.T)
        return (f, fx, fy) if f.shape else (float(f), float(fx), float(fy))

    def raw(self, xs: FloatArray, ys: FloatArray | None = None) -> FloatArray:
        """f, ∂f/∂x, ∂f/∂y, (N, 3), at places (N,); NaN where it has no value."""
        assert ys is not None
        table = self.table()
        found = [surface(table, 0, float(x), float(y)) for x, y in zip(xs, ys, strict=True)]
        return np.array(found, dtype=float).reshape(-1, 3)
