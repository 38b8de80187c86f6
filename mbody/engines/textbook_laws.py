"""Tables by SciPy's interpolators and cam programs by Norton's formulas, for engines that check."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.core.tolerances import TABLE_RANGE_MARGIN
from mbody.laws import Cam, Dwell, Rise, Table

Array = np.ndarray
#: f, f′, f″.
Three = tuple[Any, Any, Any]


class Tabulated:
    """A `Table`: called it gives values, and `derivatives` (f, f′, f″), at places or arrays."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.x, self.y = np.array(table.x, dtype=float), np.array(table.y, dtype=float)
        self.curve = self._curve(table.interpolation or "spline")

    def _curve(self, kind: str) -> Callable[[Array, int], Array]:
        """Function of places within the table and the order of the derivative."""
        from scipy.interpolate import CubicSpline, PchipInterpolator

        x, y = self.x, self.y
        if kind == "spline":
            end = "periodic" if self.table.periodic else self.table.end or "not-a-knot"
            return CubicSpline(x, y, bc_type=end)
        if kind == "pchip":
            if self.table.periodic:  # three periods: the ends of the middle one are inner points
                period = x[-1] - x[0]
                x = np.concatenate([x[:-1] - period, x, x[1:] + period])
                y = np.concatenate([y[:-1], y, y[1:]])
            return PchipInterpolator(x, y)
        slopes = np.diff(y) / np.diff(x) * (kind == "linear")

        def pieces(at: Array, order: int) -> Array:
            n = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
            if kind == "hold" and order == 0:
                return y[np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 1)]
            return (y[n] + slopes[n] * (at - x[n]), slopes[n], 0.0 * at)[order]

        return pieces

    def __call__(self, x: Any) -> Any:
        """Values."""
        return self.derivatives(x)[0]

    def derivatives(self, x: Any) -> Three:
        """(f, f′, f″); NaN outside of a table that has no values there."""
        first, last = self.x[0], self.x[-1]
        span = last - first
        at = np.asarray(x, dtype=float)
        if self.table.periodic:
            at = first + np.mod(at - first, span)
        within = np.clip(at, first, last)
        f, f1, f2 = (np.array(self.curve(within, n), dtype=float) for n in range(3))
        beyond = at - within
        if self.table.interpolation == "hold":
            held = last + (self.x[-1] - self.x[-2])  # the last value lasts as the one before it
            outside = (at > held) | (beyond < -TABLE_RANGE_MARGIN * span)
            f1, f2 = 0.0 * f1, 0.0 * f2
        else:
            outside = np.abs(beyond) > TABLE_RANGE_MARGIN * span
            if self.table.outside == "hold":
                f1, f2 = np.where(outside, 0.0, f1), np.where(outside, 0.0, f2)
            else:
                f, f2 = f + f1 * beyond, np.where(outside, 0.0, f2)
        if self.table.outside == "error":
            f, f1, f2 = (np.where(outside, np.nan, one) for one in (f, f1, f2))
        return (f, f1, f2) if at.ndim else (float(f), float(f1), float(f2))


class FormulaProgram:
    """A `Rise`, or a `Cam` program: called it gives values, and `derivatives` (f, f′, f″)."""

    def __init__(self, law: Rise | Cam) -> None:
        self.period = law.period if isinstance(law, Cam) else math.inf
        segments = law.segments if isinstance(law, Cam) else (law,)
        self.rises: list[tuple[Rise, float, float]] = []
        end, level = 0.0, None
        for one in segments:
            if isinstance(one, Dwell):
                end += one.duration
                continue
            level = one.base if level is None else level
            self.rises.append((one, end + one.start, level))
            end, level = end + one.start + one.duration, level + one.height
        self.base = self.rises[0][2]

    def __call__(self, x: Any) -> Any:
        """Values."""
        return self.derivatives(x)[0]

    def derivatives(self, x: Any) -> Three:
        """(f, f′, f″) at a place, or at an array of them."""
        if np.ndim(x):
            table = np.array([self.derivatives(one) for one in np.ravel(x).tolist()])
            f, f1, f2 = table.reshape(*np.shape(x), 3).transpose(-1, *range(np.ndim(x)))
            return f, f1, f2
        x = float(x) % self.period if math.isfinite(self.period) else float(x)
        found: Three = (self.base, 0.0, 0.0)
        for rise, start, level in self.rises:
            u = (x - start) / rise.duration
            if u >= 1.0:
                found = (level + rise.height, 0.0, 0.0)
            elif u >= 0.0:
                s, v, a = shape(rise.shape, u)
                h, b = rise.height, rise.duration
                found = (level + h * s, h * v / b, h * a / b**2)
        return found


#: Coefficients of the polynomials of standard cams, from u³ on.
POLYNOMIALS = {"3-4-5": (10.0, -15.0, 6.0), "4-5-6-7": (0.0, 35.0, -84.0, 70.0, -20.0)}
#: Parts of a rise in which the acceleration grows and in which it falls, of the modified curves.
GROWS_FALLS = {
    "parabolic": (0.0, 0.0),
    "modified-trapezoidal": (0.25, 0.25),
    "modified-sine": (0.25, 0.75),
}


def shape(name: str, u: float) -> tuple[float, float, float]:
    """s, s′, s″ of a rise of height 1 and duration 1, at 0 ≤ u ≤ 1."""
    if name == "cycloidal":
        w = 2.0 * math.pi
        return u - math.sin(w * u) / w, 1.0 - math.cos(w * u), w * math.sin(w * u)
    if name == "harmonic":
        w = math.pi
        return (
            0.5 * (1.0 - math.cos(w * u)),
            0.5 * w * math.sin(w * u),
            0.5 * w * w * math.cos(w * u),
        )
    if name in POLYNOMIALS:
        curve = np.polynomial.Polynomial([0.0, 0.0, 0.0, *POLYNOMIALS[name]])
        return float(curve(u)), float(curve.deriv()(u)), float(curve.deriv(2)(u))
    if u >= 0.5:  # symmetric about the middle; where f″ jumps there, it is that to the right
        s, v, a = _half(*GROWS_FALLS[name], 1.0 - u)
        return 1.0 - s, v, -a
    return _half(*GROWS_FALLS[name], u)


def _half(b: float, d: float, u: float) -> tuple[float, float, float]:
    """s, s′, s″ up to the middle: the acceleration grows as a sine over b/2, stays, and falls as a
    cosine over d/2 (Norton's family).
    """
    top = 0.5 / _grown(b, d, 0.5)[0]
    s, v, a = _grown(b, d, u)
    return top * s, top * v, top * a


def _grown(b: float, d: float, u: float) -> tuple[float, float, float]:
    """s, s′, s″ whose greatest acceleration is 1, not brought to the height 1."""
    p, q, stays = b / math.pi, d / math.pi, 0.5 * (1.0 - d)
    if u < 0.5 * b:
        return p * (u - p * math.sin(u / p)), p * (1.0 - math.cos(u / p)), math.sin(u / p)
    first = p * (0.5 * b - p)
    if u <= stays:
        w = u - 0.5 * b
        return first + p * w + 0.5 * w * w, p + w, 1.0
    whole = stays - 0.5 * b
    w, speed = u - stays, p + whole
    place = first + p * whole + 0.5 * whole**2
    return (
        place + speed * w + q * q * (1.0 - math.cos(w / q)),
        speed + q * math.sin(w / q),
        math.cos(w / q),
    )
