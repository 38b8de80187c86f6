"""A law from any Python function, with numerical derivatives where none are given."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbody.core.tolerances import (
    COMPLEX_STEP,
    FUNCTION_SCALE_LEAST,
    FUNCTION_SLOPES_AGREE,
    LAW_EPSILON,
)
from mbody.errors import ModelError
from mbody.laws.base import FixedLaw, finite
from mbody.laws.kernels import FloatArray

# Steps of the differences, as fractions of the scale. They have no simple ratio to each other or to
# 1, so that the period of a user's function does not coincide with several of them.
FIRST_STEP = 0.0837
RATIO = 1.87
LEVELS = 20


@dataclass(frozen=True)
class Function(FixedLaw):
    """f = function(x), any Python function of one number.

    Parameters
    ----------
    function : callable
        f(x); takes and returns one float.
    rate, acceleration : callable, optional
        f′(x) and f″(x). If missing, they are found numerically (see the notes).
    scale : float
        Length in x over which the function changes smoothly (> 0), for example the duration of a
        motion; an upper bound will do.

    Raises
    ------
    ModelError
        An argument is not callable; later, a function that does not return one finite number.
        Exceptions of the function itself are passed on unchanged.

    Notes
    -----
    A first derivative is exact to rounding (complex step) where the function takes complex numbers
    and the result agrees with a difference, which is checked at every x. All other derivatives
    come from central differences at steps from ``0.084 scale`` downwards, extrapolated to step 0
    until the error no longer shrinks (Ridders 1982). Measured on smooth functions, relative to the
    largest value of the derivative nearby: f′ 1e-15 (complex) or 1e-12 (not); f″ 1e-15 where a
    given `rate` takes complex numbers, 1e-12 where the function does, otherwise 1e-10. A function
    that varies up to a thousand times faster than `scale` costs twice the calls and one or two
    digits.

    About 10 to 50 calls of the function are made for one x (15 to 50 µs), up to ``0.084 scale`` to
    either side of it: give `rate` and `acceleration` to be fast, and at the edge of what the
    function accepts. Within that distance of a corner of f the accuracy falls. To be saved, the law
    must pickle: name the function with ``def`` in a module.

    Squire and Trapp, SIAM Review 40 (1998) 110; Ridders, Adv. Eng. Software 4 (1982) 75.

    >>> Function(np.sin, np.cos, lambda x: -np.sin(x)).derivatives(0.0)
    (0.0, 1.0, -0.0)
    >>> f, f1, f2 = Function(np.exp).derivatives(0.0)
    >>> abs(f1 - 1.0) < 1e-14, abs(f2 - 1.0) < 1e-11
    (True, True)
    """

    kind: ClassVar[str] = "user"

    function: Callable[[float], float]
    rate: Callable[[float], float] | None = None
    acceleration: Callable[[float], float] | None = None
    scale: float = 1.0

    def _check(self) -> None:
        for field in ("function", "rate", "acceleration"):
            value = getattr(self, field)
            if not (callable(value) or (value is None and field != "function")):
                raise ModelError(
                    f"Function: {field} must be a function of one number, not {value!r}"
                )
        object.__setattr__(self, "scale", finite(self.scale, "Function", "scale"))
        if self.scale <= 0.0:
            raise ModelError(f"Function: scale must be positive, it is {self.scale:g}")

    def hook(self, derivatives: bool = True) -> Callable[[FloatArray, FloatArray], None]:
        """The function to register: y (3,) = f, f′, f″ at x[0], or f, 0, 0 where the derivatives
        are not wanted, as of a force; pickles if the law does.
        """
        return self._fill if derivatives else self._fill_value

    def _fill_value(self, x: FloatArray, y: FloatArray) -> None:
        y[:] = finite_value(self.function, float(x[0])), 0.0, 0.0

    def _fill(self, x: FloatArray, y: FloatArray) -> None:
        y[:] = self._value_and_derivatives(float(x[0]))

    def _value_and_derivatives(self, x: float) -> tuple[float, float, float]:
        function, rate, acceleration = self.function, self.rate, self.acceleration
        if rate is not None and acceleration is not None:
            return finite_value(function, x), finite_value(rate, x), finite_value(acceleration, x)
        if rate is not None:
            return finite_value(function, x), *_differentiate(rate, x, self.scale, False)[:2]
        if acceleration is not None:
            f, f1, _ = _differentiate(function, x, self.scale, False)
            return f, f1, finite_value(acceleration, x)
        return _differentiate(function, x, self.scale, True)

    def raw(self, xs: FloatArray) -> FloatArray:
        """f, f′, f″, (N, 3), at xs (N,)."""
        # the same values as the compiled loop gets from the hook, without the callback
        out = np.empty((xs.size, 3))
        for i, x in enumerate(xs.tolist()):
            out[i] = self._value_and_derivatives(x)
        return out


def finite_value(function: Callable[[float], float], x: float) -> float:
    """The function's value as a float; ModelError if it is not one finite number."""
    value = function(x)
    try:
        result = float(value)
    except (TypeError, ValueError):
        result = math.nan
    if not math.isfinite(result):
        name = getattr(function, "__name__", repr(function))
        raise ModelError(
            f"Function: {name} returned {value!r} at x = {x:g}; it must return one finite number"
        )
    return result


def _complex_slope(function: Callable[..., Any], x: float, quiet: bool) -> float:
    """f′(x) by complex step; NaN where the function does not take complex numbers."""
    try:
        if quiet:
            return complex(function(complex(x, COMPLEX_STEP))).imag / COMPLEX_STEP
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a function that drops the imaginary part warns
            return complex(function(complex(x, COMPLEX_STEP))).imag / COMPLEX_STEP
    except Exception:  # its own errors occur again with real numbers, and are passed on then
        return math.nan


class _Limit:
    """Extrapolation to step 0 of an estimate with an even error expansion (Richardson)."""

    def __init__(self) -> None:
        self.row: list[float] = []
        self.value = math.nan
        self.error = math.inf

    def add(self, estimate: float, noise: float) -> None:
        """Add the estimate at the next smaller step; `noise` is its rounding error."""
        row, factor = [estimate], 1.0
        for m, before in enumerate(self.row):
            factor *= RATIO * RATIO
            row.append(row[m] + (row[m] - before) / (factor - 1.0))
            error = max(abs(row[m + 1] - row[m]), abs(row[m + 1] - before)) + noise
            if error < self.error:
                self.value, self.error = row[m + 1], error
        self.row = row


def _differentiate(
    function: Callable[[float], float], x: float, scale: float, second: bool
) -> tuple[float, float, float]:
    """f, f′, f″ of a Python function at x (f″ only if `second`, otherwise 0)."""
    f = finite_value(function, x)
    slope = _complex_slope(function, x, quiet=False)
    slope_d, second_c, second_d = (
        _Limit(),
        _Limit(),
        _Limit(),
    )  # from differences, from complex slopes
    step, size, steepest = (
        FIRST_STEP * max(scale, FUNCTION_SCALE_LEAST * abs(x)),
        abs(f),
        abs(slope),
    )
    agree = False
    for level in range(LEVELS):
        right, left = x + step, x - step
        f_right, f_left = finite_value(function, right), finite_value(function, left)
        width = 0.5 * (right - left)
        size = max(size, abs(f_right), abs(f_left))
        first = (f_right - f_left) / (2.0 * width)
        noise = LAW_EPSILON * (size + abs(x * first)) / width
        slope_d.add(first, noise)
        second_d.add((f_right - 2.0 * f + f_left) / width**2, 4.0 * noise / width)
        # converged where smaller steps would add more rounding error than they remove
        converged = slope_d.error <= 4.0 * noise and (
            not second or second_d.error <= 4.0 * (4.0 * noise / width)
        )
        if slope == slope:
            s_right = _complex_slope(function, right, quiet=True)
            s_left = _complex_slope(function, left, quiet=True)
            steepest = max(steepest, abs(s_right), abs(s_left))
            second_derivative = (s_right - s_left) / (2.0 * width)
            noise = LAW_EPSILON * (steepest + abs(x * second_derivative)) / width
            second_c.add(second_derivative, noise)
            agree = abs(slope - slope_d.value) + slope_d.error <= FUNCTION_SLOPES_AGREE * steepest
            if agree:
                converged = not second or second_c.error <= 4.0 * noise
        if converged and level > 1:
            break
        step /= RATIO
    if agree:
        return f, slope, second_c.value if second else 0.0
    return f, slope_d.value, second_d.value if second else 0.0
