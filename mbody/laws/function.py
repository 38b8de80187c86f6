"""A law from any Python function, with numerical derivatives where none are given."""

from __future__ import annotations

import math
import warnings
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mbody.core.tolerances import (
    COMPLEX_STEP,
    DERIVATIVE_CERTAIN,
    DERIVATIVE_ROUNDING,
    DERIVATIVE_SLIGHT,
    DERIVATIVE_WRONG,
    FUNCTION_SCALE_LEAST,
    FUNCTION_SLOPES_AGREE,
    LAW_EPSILON,
)
from mbody.errors import ModelError
from mbody.laws.base import FixedLaw, finite, finite_array
from mbody.laws.kernels import FloatArray

# Steps of the differences, as fractions of the scale. They have no simple ratio to each other or to
# 1, so that the period of a user's function does not coincide with several of them.
FIRST_STEP = 0.0837
RATIO = 1.87
LEVELS = 20
# Of the comparison of given derivatives: places, steps at each, and how far beside a place that is
# off the next one is, and the growth of the range that has it compared again, as parts of it.
PLACES, STEPS, BESIDE, GROWN = 12, 40, 0.00137, 0.25
# Calls of a law that may not be called without an end after which it is compared at once.
SUSPECT = 2000
# Calls of which the places are kept until the widest gap between them is looked for.
KEPT = 100_000


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
    corners : sequence of float
        Where f jumps, bends or has a short pulse: steps of motions end there, as at the points of a
        table. Where there are none, write an empty list: a motion then says nothing about them.

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

    Given derivatives are compared with differences of the function over the range in which an
    analysis calls it; one that differs is a doubt of kind "derivative".

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
    corners: Sequence[float] | None = None

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
        if self.corners is not None:
            corners = finite_array(self.corners, "Function", "corners")
            object.__setattr__(self, "corners", tuple(np.unique(corners).tolist()))

    def hook(self, derivatives: bool = True) -> FunctionCalls:
        """The function to register: y (3,) = f, f′, f″ at x[0], or f, 0, 0 where the derivatives
        are not wanted, as of a force; pickles if the law does.
        """
        return FunctionCalls(self, derivatives)

    @property
    def may_have_corners(self) -> bool:
        """Whether some are given."""
        return bool(self.corners)

    def corners_between(self, first: float, last: float) -> FloatArray:
        """The given ones between two values of x."""
        known = np.array(self.corners or ())
        return known[(known > first) & (known < last)]

    def rate_jumps(self, first: float, last: float) -> FloatArray:
        """The given corners."""
        return self.corners_between(first, last)

    def value_and_derivatives(self, x: float) -> tuple[float, float, float]:
        """f, f′, f″ at x."""
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
            out[i] = self.value_and_derivatives(x)
        return out


class FunctionCalls:
    """The function of a law as kernels call it; it notes where it was called.

    `low`, `high`: The range of its calls. `count`: How many there were, at most `most`. `steepest`:
    Size and place of the greatest rate and second derivative. `met`: Where it was called last;
    `widest`: The widest gap before.
    `wrong`: A given derivative that was found to be none: what, place, given, wanted.
    """

    def __init__(self, law: Function, derivatives: bool) -> None:
        self.law, self.function, self.derivatives = law, law.function, derivatives
        self.low, self.high, self.count, self.most = math.inf, -math.inf, 0, math.inf
        self.met, self.widest = array("d"), 0.0
        self.steepest = [(-1.0, math.nan), (-1.0, math.nan)]
        self.wrong: WrongDerivative | None = None
        self.compared: tuple[float, float] | None = None

    def __call__(self, x: FloatArray, y: FloatArray) -> None:
        """Fill y (3,) at x (1,)."""
        at = float(x[0])
        self.low, self.high = min(self.low, at), max(self.high, at)
        self.count += 1
        self.met.append(at)
        if len(self.met) > KEPT:
            self.gap()
        if self.count == SUSPECT and self.most < math.inf and self.compare() is not None:
            self.most = 0
        if self.count > self.most:
            raise ModelError(
                f"{self.count} calls did not lead the motion beyond x = {at:.6g}: the "
                "function varies too fast to be followed; give a smoother one"
            )
        if self.derivatives:
            y[:] = self.law.value_and_derivatives(at)
            for n, (steepness, _) in enumerate(self.steepest):
                if not abs(y[1 + n]) <= steepness:
                    self.steepest[n] = abs(y[1 + n]), at
        else:
            y[:] = finite_value(self.function, at), 0.0, 0.0

    def begin(self) -> None:
        """Forget where it was called."""
        self.met, self.widest = array("d"), 0.0

    def gap(self) -> float:
        """The widest distance between two of its calls since the beginning."""
        at = np.sort(self.met)
        self.widest = max(self.widest, float(np.diff(at).max(initial=0.0)))
        self.met = array("d", at[-1:])
        return self.widest

    def __reduce__(self) -> Any:
        return FunctionCalls, (self.law, self.derivatives)

    def compare(self, more: Sequence[float] = ()) -> WrongDerivative | None:
        """A given derivative that is not one, in the range of the calls, and at `more` places."""
        span = self.high - self.low
        if self.wrong is None and span >= 0.0:
            low, high = self.compared or (math.inf, -math.inf)
            margin = GROWN * (high - low)
            if more or self.low < low - margin or self.high > high + margin:
                self.compared = self.low, self.high
                places = *more, *(at for _, at in self.steepest if math.isfinite(at))
                self.wrong = wrong_derivative(self.law, self.low, self.high, places)
        return self.wrong


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


# -- Given derivatives compared with differences of the function -------------------------------


class WrongDerivative(NamedTuple):
    """A given derivative, `order` 1 or 2, that is not one: at x it is `given`, by differences
    `wanted`.
    """

    order: int
    x: float
    given: float
    wanted: float


def wrong_derivative(
    law: Function, low: float, high: float, more: Sequence[float] = ()
) -> WrongDerivative | None:
    """The first given derivative that is not one, at places between two values of x, and at `more`.

    At every place differences at ever smaller steps are extrapolated to step 0. An estimate counts
    where it is certain to a part of its size that is smaller than what is called wrong. A
    derivative is right where it agrees with any of these, so that corners, jumps and noise do not
    make a right one wrong, and wrong where it agrees with none of them at two places.
    """
    span = high - low
    inner = low + span * ((np.arange(PLACES) + 0.5) * (math.sqrt(5.0) - 1.0) / 2.0 % 1.0)
    places = np.unique([*inner, *more])
    scale = span if span > 0.0 else law.scale
    rate, acceleration = law.rate, law.acceleration
    for order, given in ((1, rate), (2, acceleration)):
        if given is None:
            continue
        base, second = (law.function, False) if order == 1 else (rate or law.function, rate is None)
        looked = [one for x in places for one in _compared(base, given, x, scale, second)]
        size = max((max(abs(one.given), one.largest) for one in looked), default=0.0)
        values = max((one.size for one in looked), default=0.0)
        slight = DERIVATIVE_SLIGHT * size + DERIVATIVE_ROUNDING * values / scale ** (1 + second)
        off = [one for one in looked if not one.right(slight)]
        if len(off) == 1:
            beside = [off[0].x + sign * BESIDE * scale for sign in (-1.0, 1.0)]
            looked = [one for x in beside for one in _compared(base, given, x, scale, second)]
            off += [one for one in looked if not one.right(slight)]
            off = off if len(off) == 3 else []
        if len(off) > 1:
            worst = max(off, key=lambda one: abs(one.given - one.wanted))
            return WrongDerivative(order, float(worst.x), worst.given, worst.wanted)
    return None


class _Comparison(NamedTuple):
    """A given derivative at x, and the certain estimates by differences (k,) with their errors, the
    smallest step last; `size`: of the function's values.
    """

    x: float
    given: float
    estimates: FloatArray
    errors: FloatArray
    size: float

    @property
    def largest(self) -> float:
        """Size of the greatest estimate."""
        return float(np.abs(self.estimates).max(initial=0.0))

    @property
    def wanted(self) -> float:
        """The derivative by differences: the middle one of the estimates."""
        return float(np.median(self.estimates))

    def right(self, slight: float) -> bool:
        """Whether it agrees with an estimate, or there are none that agree with each other."""
        found = self.estimates
        if len(found) < 2:
            return True
        allowed = DERIVATIVE_WRONG * np.maximum(abs(self.given), np.abs(found))
        allowed += self.errors + slight
        apart = np.abs(np.diff(found)) <= np.minimum(allowed[1:], allowed[:-1])
        return bool((np.abs(self.given - found) <= allowed).any() or not apart.any())


def _compared(
    function: Callable[[float], float],
    given: Callable[[float], float],
    x: float,
    scale: float,
    second: bool,
) -> list[_Comparison]:
    """The comparison at x, one or none where the functions have no value there."""
    try:
        derivative, middle = finite_value(given, x), finite_value(function, x)
    except Exception:
        return []  # an error is raised where an analysis meets it
    step, size, limit = FIRST_STEP * scale, abs(middle), _Limit()
    steepest, found = abs(derivative), []
    for _ in range(STEPS):
        right, left = x + step, x - step
        step /= RATIO
        if not left < x < right:
            break
        try:
            f_right, f_left = finite_value(function, right), finite_value(function, left)
        except Exception:
            limit = _Limit()
            continue
        width, size = 0.5 * (right - left), max(size, abs(f_right), abs(f_left))
        first = (f_right - f_left) / (2.0 * width)
        noise = LAW_EPSILON * (size + abs(x * first)) / width
        if second:
            first, noise = (f_right - 2.0 * middle + f_left) / width**2, 4.0 * noise / width
        limit.error, steepest = math.inf, max(steepest, abs(first))
        limit.add(first, noise)
        if limit.error <= DERIVATIVE_CERTAIN * steepest:
            found.append((limit.value, limit.error))
    estimates, errors = np.array(found).reshape(-1, 2).T
    return [_Comparison(x, derivative, estimates, errors, size)]
