"""Compiled laws: f, f′ and f″ at one x, selected by an integer code; no objects, no strings.

`KERNELS` is the one list of the built-in kinds: their codes and the branches that select them
follow. A law reads its variable numbers from ``par[o : o + n, lane]`` and its fixed data from
``tab[k : k + m]``; a user's function is called through its handle. Where f″ jumps (the ends of a
harmonic or parabolic rise) the value is that to the right.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mbody.core.bundle import Floats, Rows
from mbody.core.callbacks import FRAME_NUMBERS, numbers_in_frame
from mbody.core.decorators import PLAIN, inline, kernel, njit
from mbody.core.lanes import chained, constant, entry, larger, smaller, value
from mbody.core.tolerances import TABLE_RANGE_MARGIN

# -- Evaluation of a law given by a formula: a postfix program on jets (f, f′, f″) -------------
#
# The last value is in local variables. Values that wait for a second operand are on a stack in the
# frame of the kernel: nothing is allocated, no parameter is written, and every thread has its own
# stack. Each operation propagates the first two derivatives exactly (automatic differentiation).

VARIABLE, CONSTANT = 0, 1
ADD_CONSTANT, MULTIPLY_CONSTANT, DIVIDE_CONSTANT, POWER_CONSTANT = 2, 3, 4, 5
NEGATIVE, SIN, COS, TAN, ASIN, ACOS, ATAN, SQRT, ABS, EXP, SIGN, STEP, LOG = range(6, 19)
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, ATAN2, HYPOT, MIN, MAX = range(19, 28)

OPERATIONS = (
    # put a number on the stack
    "variable",
    "constant",
    # take the next constant
    "+ constant",
    "* constant",
    "/ constant",
    "^ constant",
    # of one number
    "negative",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sqrt",
    "abs",
    "exp",
    "sign",
    "step",
    "log",
    # of two numbers
    "+",
    "-",
    "*",
    "/",
    "^",
    "atan2",
    "hypot",
    "min",
    "max",
)
"""Operations of a program; the integer code of an operation is its index."""

MAX_OPERATIONS = 200
"""Most operations of a program."""

MAX_STACK = FRAME_NUMBERS // 3 - 1
"""Most numbers on the stack of a program."""

FloatArray: TypeAlias = NDArray[np.float64]
Three: TypeAlias = tuple[float, float, float]


@njit
def expression(par: FloatArray, o: int, lane: int, tab: FloatArray, k: int, x: float) -> Three:
    """f, f′, f″ of a program at x; NaN where f is not finite.

    tab = (length, operations), par = the constants in the order in which the program takes them.
    """
    stack = numbers_in_frame(x)
    depth = 0
    c = o
    f, f1, f2 = 0.0, 0.0, 0.0
    for i in range(k + 1, k + 1 + int(tab[k])):
        code = int(tab[i])
        if code <= CONSTANT:
            stack[depth], stack[depth + 1], stack[depth + 2] = f, f1, f2
            depth += 3
            if code == VARIABLE:
                f, f1, f2 = x, 1.0, 0.0
            else:
                f, f1, f2 = entry(par, c, lane), 0.0, 0.0
                c += 1
        elif code <= POWER_CONSTANT:
            f, f1, f2 = with_constant(code, f, f1, f2, entry(par, c, lane))
            c += 1
        elif code <= LOG:
            f, f1, f2 = unary(code, f, f1, f2)
        else:
            depth -= 3
            a, a1, a2 = stack[depth], stack[depth + 1], stack[depth + 2]
            f, f1, f2 = binary(code, a, a1, a2, f, f1, f2)
    if not np.isfinite(f):
        return math.nan, math.nan, math.nan
    return f, f1, f2


if PLAIN:
    # NumPy would warn where the compiled code is silent
    expression = np.errstate(all="ignore")(expression)


@inline
def with_constant(code: int, a: float, a1: float, a2: float, c: float) -> Three:
    """a + c, a · c, a / c, a ^ c."""
    if code == ADD_CONSTANT:
        return a + c, a1, a2
    if code == MULTIPLY_CONSTANT:
        return a * c, a1 * c, a2 * c
    if code == DIVIDE_CONSTANT:
        return a / c, a1 / c, a2 / c
    return constant_power(a, a1, a2, c)


@inline
def unary(code: int, a: float, a1: float, a2: float) -> Three:
    """g(a):  f′ = g′ a′, f″ = g″ a′² + g′ a″."""
    if code == NEGATIVE:
        return -a, -a1, -a2
    if code == ABS:
        sign = -1.0 if less(a, a1, a2, 0.0, 0.0, 0.0) else 1.0
        return chained(np.abs(value(a)), sign, a), sign * a1, sign * a2  # also of −0
    if code == SIGN:  # a NaN remains one
        return (1.0 if a > 0.0 else -1.0 if a < 0.0 else value(a)), 0.0, 0.0
    if code == STEP:
        return (1.0 if a >= 0.0 else 0.0 if a < 0.0 else value(a)), 0.0, 0.0
    if code == SIN:
        g, g1 = np.sin(a), np.cos(a)
        g2 = -g
    elif code == COS:
        g, g1 = np.cos(a), -np.sin(a)
        g2 = -g
    elif code == TAN:
        g = np.tan(a)
        g1 = 1.0 + g * g
        g2 = 2.0 * g * g1
    elif code == EXP:
        g = np.exp(a)
        g1 = g2 = g
    elif code == SQRT:
        g = np.sqrt(a)
        g1 = 0.5 / g
        g2 = -0.5 * g1 / a
    elif code == LOG:
        g = np.log(a)
        g1 = 1.0 / a
        g2 = -g1 * g1
    elif code == ATAN:
        g = np.arctan(a)
        g1 = 1.0 / (1.0 + a * a)
        g2 = -2.0 * a * g1 * g1
    else:
        g = np.arcsin(a) if code == ASIN else np.arccos(a)
        g1 = 1.0 / np.sqrt((1.0 - a) * (1.0 + a))
        if code == ACOS:
            g1 = -g1
        g2 = a * g1 / ((1.0 - a) * (1.0 + a))
    return g, g1 * a1, g2 * a1 * a1 + second_term(g1, a2)


@inline
def second_term(slope: float, a2: float) -> float:
    """g′ a″, or 0 where a″ = 0, also where g′ is infinite: then g″ a′² alone counts."""
    return 0.0 if a2 == 0.0 and constant(a2) else slope * a2


@inline
def binary(code: int, a: float, a1: float, a2: float, b: float, b1: float, b2: float) -> Three:
    """g(a, b) with its derivatives along x."""
    if code == ADD:
        return a + b, a1 + b1, a2 + b2
    if code == SUBTRACT:
        return a - b, a1 - b1, a2 - b2
    if code == MULTIPLY:
        return a * b, a1 * b + a * b1, a2 * b + 2.0 * a1 * b1 + a * b2
    if code == DIVIDE:  # from q b = a
        q = a / b
        q1 = (a1 - q * b1) / b
        return q, q1, (a2 - 2.0 * q1 * b1 - q * b2) / b
    if code == ATAN2:  # ψ′ = (a′ b − a b′)/(a² + b²)
        square = a * a + b * b
        f1 = (a1 * b - a * b1) / square
        return np.arctan2(a, b), f1, (a2 * b - a * b2 - 2.0 * f1 * (a * a1 + b * b1)) / square
    if code == HYPOT:
        return length(a, a1, a2, b, b1, b2)
    if code >= MIN:
        # of equal ones, and a NaN, as `mbody.core.lanes.smaller` selects
        before = less(a, a1, a2, b, b1, b2) if code == MIN else less(b, b1, b2, a, a1, a2)
        return (a, a1, a2) if before or a != a else (b, b1, b2)
    return power(a, a1, a2, b, b1, b2)


@inline
def less(a: float, a1: float, a2: float, b: float, b1: float, b2: float) -> bool:
    """Whether a < b at x or, where they are equal, just to the right of it."""
    return a < b or (a == b and (a1 < b1 or (a1 == b1 and a2 < b2)))


@njit
def length(a: float, a1: float, a2: float, b: float, b1: float, b2: float) -> Three:
    """h = √(a² + b²):  h′ = (a a′ + b b′)/h, h″ = (((a′ b − a b′)/h)² + a a″ + b b″)/h."""
    h = np.hypot(a, b)
    if h > 0.0:
        cross = (a1 * b - a * b1) / h
        return h, (a * a1 + b * b1) / h, (cross * cross + a * a2 + b * b2) / h
    speed = np.hypot(a1, b1)  # away from the corner, to the right
    if speed > 0.0:
        return h, speed, (a1 * a2 + b1 * b2) / speed
    return h, speed, np.hypot(a2, b2)


@njit
def constant_power(a: float, a1: float, a2: float, p: float) -> Three:
    """a ^ p:  g′ = p a^(p−1), g″ = p (p − 1) a^(p−2), or 0 where the factor before is 0."""
    if p == 2.0 and constant(p):
        return a * a, 2.0 * a * a1, 2.0 * (a1 * a1 + a * a2)
    if p == 1.0 and constant(p):
        return a, a1, a2
    if p == 0.0 and constant(p):
        return 1.0, 0.0, 0.0
    g = np.power(a, p)
    second = np.power(a, p - 2.0)
    first = second * a if a != 0.0 else np.power(a, p - 1.0)
    return g, p * first * a1, p * ((p - 1.0) * second * a1 * a1 + second_term(first, a2))


@njit
def power(a: float, a1: float, a2: float, b: float, b1: float, b2: float) -> Three:
    """a ^ b = exp u, u = b log a:  f′ = f u′, f″ = f (u″ + u′²)."""
    if b1 == 0.0 and b2 == 0.0 and constant(b1) and constant(b2):
        return constant_power(a, a1, a2, b)
    if a == 0.0 and (b > 2.0 or (b > 0.0 and a1 == 0.0 and a2 == 0.0)):
        return 0.0, 0.0, 0.0
    f = np.power(a, b)
    log, r1, r2 = np.log(a), a1 / a, a2 / a
    u1 = b1 * log + b * r1
    u2 = b2 * log + 2.0 * b1 * r1 + b * (r2 - r1 * r1)
    return f, f * u1, f * (u2 + u1 * u1)


SHAPES = (
    "cycloidal",
    "harmonic",
    "3-4-5",
    "4-5-6-7",
    "parabolic",
    "modified-trapezoidal",
    "modified-sine",
)
"""Shapes of a rise; the integer code of a shape is its index."""

OUTSIDE = ("error", "hold", "line", "periodic")
"""What a table does outside its range; the integer code is the index."""

"""A table is extended by this fraction of its range, so that rounding does not leave it."""

PI = math.pi

#: f, f′, f″ by (par, o, n, lane, tab, k, x). With dual numbers `lane` is one, as x is, so that the
#: derivatives of all three by numbers and by x come with them (`mbody.core.lanes`).
LawKernel: TypeAlias = Callable[[FloatArray, int, int, int, FloatArray, int, float], Three]


@njit
def polynomial(
    par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float
) -> Three:
    """Polynomial f = Σ cᵢ xⁱ and its derivatives by Horner's rule, ascending coefficients."""
    f = 0.0
    f1 = 0.0
    f2 = 0.0
    for i in range(o + n - 1, o - 1, -1):
        f2 = f2 * x + 2.0 * f1
        f1 = f1 * x + f
        f = f * x + entry(par, i, lane)
    return f, f1, f2


@njit
def harmonic(
    par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float
) -> Three:
    """Sinusoid f = mean + amplitude sin(frequency x + phase)."""
    amplitude = entry(par, o + 1, lane)
    frequency = entry(par, o + 2, lane)
    angle = frequency * x + entry(par, o + 3, lane)
    s = amplitude * np.sin(angle)
    c = amplitude * np.cos(angle)
    return entry(par, o, lane) + s, frequency * c, -frequency * frequency * s


@njit
def interval(tab: FloatArray, first: int, count: int, r: float) -> int:
    """The interval of r among the knots tab[first : first + count]: a guess for equidistant knots,
    then bisection where the guess is wrong.
    """
    low, high = tab[first], tab[first + count - 1]
    i = min(max(int((r - low) / (high - low) * (count - 1)), 0), count - 2)
    if tab[first + i] > r or r >= tab[first + i + 1]:
        i = 0
        j = count - 1
        while j - i > 1:
            mid = (i + j) // 2
            if tab[first + mid] <= r:
                i = mid
            else:
                j = mid
    return i


@njit
def spline(par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float) -> Three:
    """Cubic spline: tab = (knots N, outside code, N knots, 4 (N − 1) coefficients)."""
    count = int(tab[k])
    outside = int(tab[k + 1])
    first = k + 2
    low = tab[first]
    high = tab[first + count - 1]
    span = high - low
    if outside == 3:
        x = x - span * np.floor(value((x - low) / span))
    margin = TABLE_RANGE_MARGIN * span if outside == 0 or outside == 3 else 0.0
    r = smaller(larger(x, low), high) if outside == 1 or outside == 2 else x
    if not (r >= low - margin and r <= high + margin) or x != x:
        return math.nan, math.nan, math.nan
    i = interval(tab, first, count, value(r))
    c = first + count + 4 * i
    w = r - tab[first + i]
    f = tab[c] + w * (tab[c + 1] + w * (tab[c + 2] + w * tab[c + 3]))
    f1 = tab[c + 1] + w * (2.0 * tab[c + 2] + w * 3.0 * tab[c + 3])
    f2 = 2.0 * tab[c + 2] + 6.0 * w * tab[c + 3]
    if outside == 1 and (x < low or x > high):
        return f, 0.0, 0.0
    if outside == 2 and (x < low or x > high):
        return f + f1 * (x - r), f1, 0.0
    return f, f1, f2


@njit
def half(shape: int, u: float) -> Three:
    """First half (0 ≤ u ≤ ½) of a unit rise s(u), s(0) = 0, s(1) = 1: s, s′, s″.

    Norton, Cam Design and Manufacturing Handbook, chapters 3 and 4.
    """
    if shape == 0:  # cycloidal: s″ = 2π sin 2πu
        a = 2.0 * PI * u
        return u - np.sin(a) / (2.0 * PI), 1.0 - np.cos(a), 2.0 * PI * np.sin(a)
    if shape == 1:  # simple harmonic: s = (1 − cos πu)/2
        a = PI * u
        h = np.sin(0.5 * a)
        return h * h, 0.5 * PI * np.sin(a), 0.5 * PI * PI * np.cos(a)
    if shape == 2:  # 3-4-5: s = 10u³ − 15u⁴ + 6u⁵
        v = 1.0 - u
        return (
            u * u * u * (10.0 + u * (-15.0 + 6.0 * u)),
            30.0 * u * u * v * v,
            60.0 * u * v * (1.0 - 2.0 * u),
        )
    if shape == 3:  # 4-5-6-7: s = 35u⁴ − 84u⁵ + 70u⁶ − 20u⁷
        p = u * (1.0 - u)
        return (
            u * u * u * u * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u))),
            140.0 * p * p * p,
            420.0 * p * p * (1.0 - 2.0 * u),
        )
    if shape == 4:  # parabolic: s″ = 4, then −4
        return 2.0 * u * u, 4.0 * u, 4.0
    if shape == 5:  # modified trapezoidal: s″ = C sin 4πu, C, C cos 4π(u − 3/8)
        c = 8.0 * PI / (2.0 + PI)
        b = 1.0 / (4.0 * PI)
        if u < 0.125:
            a = u / b
            return c * b * (u - b * np.sin(a)), c * b * (1.0 - np.cos(a)), c * np.sin(a)
        if u < 0.375:
            w = u - 0.125
            return c * (b * (0.125 - b) + w * (b + 0.5 * w)), c * (b + w), c
        w = u - 0.375
        a = w / b
        start = b * (0.125 - b) + 0.25 * (b + 0.125)
        return (
            c * (start + w * (0.25 + b) + b * b * (1.0 - np.cos(a))),
            c * (0.25 + b + b * np.sin(a)),
            c * np.cos(a),
        )
    # modified sine: s″ = C sin 4πu, then C sin(4πu/3 + π/3)
    c = 1.0 / (4.0 + PI)
    if u < 0.125:
        a = 4.0 * PI * u
        return (
            c * (PI * u - 0.25 * np.sin(a)),
            c * PI * (1.0 - np.cos(a)),
            c * 4.0 * PI * PI * np.sin(a),
        )
    a = (4.0 * u + 1.0) * PI / 3.0
    return (
        c * (2.0 + PI * u - 2.25 * np.sin(a)),
        c * PI * (1.0 - 3.0 * np.cos(a)),
        c * 4.0 * PI * PI * np.sin(a),
    )


@njit
def rise(shape: int, base: float, height: float, start: float, duration: float, x: float) -> Three:
    """A rise between two dwells; every shape is point-symmetric, s(1 − u) = 1 − s(u)."""
    w = x - start
    if w < 0.0:
        return base, 0.0, 0.0
    if w >= duration or duration <= 0.0:
        return base + height, 0.0, 0.0
    u = w / duration
    if u < 0.5:
        s, s1, s2 = half(shape, u)
    else:
        s, s1, s2 = half(shape, 1.0 - u)
        s = 1.0 - s
        s2 = -s2
    return base + height * s, height * s1 / duration, height * s2 / (duration * duration)


@njit
def pieces(par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float) -> Three:
    """A rise, or the rise of a cam program that contains x.

    Rise: par = (height, start, duration, base), tab = (shape). Cam: no par, tab = (period, count,
    then shape, height, start, duration, base of each rise).
    """
    if n == 4:
        shape = int(tab[k])
        base, height = entry(par, o + 3, lane), entry(par, o, lane)
        return rise(shape, base, height, entry(par, o + 1, lane), entry(par, o + 2, lane), x)
    period = tab[k]
    r = x - period * np.floor(value(x / period))
    i = k + 2
    for _ in range(1, int(tab[k + 1])):
        if r < tab[i + 7]:
            break
        i += 5
    return rise(int(tab[i]), tab[i + 4], tab[i + 1], tab[i + 2], tab[i + 3], r)


@njit
def formula(par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float) -> Three:
    """A law given by a formula, see `mbody.laws.kernels`."""
    return expression(par, o, lane, tab, k, x)


#: The kernels of the built-in laws by kind, in the order of their codes. A new kind is its kernel
#: and a line at the end.
KERNELS: dict[str, LawKernel] = {
    "polynomial": polynomial,
    "harmonic": harmonic,
    "spline": spline,
    "pieces": pieces,
    "expression": formula,
}
LAW_KINDS = (*KERNELS, "user", "measured", "surface")
"""Kinds of laws; the integer code of a law is the index of its kind. One that is "measured" or a
"surface" is no function of one number: `mbody.kernels.constraints` has its value."""
POLYNOMIAL, USER = LAW_KINDS.index("polynomial"), LAW_KINDS.index("user")


def branch(otherwise: Any, number: int) -> Any:
    """Compiled ``if code == number: … else: otherwise(…)`` with the kernel of that kind; the chain
    of branches is made as that of `mbody.kernels.constraints`.
    """
    one = KERNELS[LAW_KINDS[number]]

    @njit(forceinline=True, cache=False)
    def last(
        code: int, par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float
    ) -> Three:
        return one(par, o, n, lane, tab, k, x)

    @njit(forceinline=True, cache=False)
    def chosen(
        code: int, par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float
    ) -> Three:
        if code == number:
            return one(par, o, n, lane, tab, k, x)
        found: Three = otherwise(code, par, o, n, lane, tab, k, x)
        return found

    return last if otherwise is None else chosen


#: The branch of the first kind is the outermost one. The last kind is what no other is: a check of
#: its code would cost a tenth of a polynomial.
every_kind: Any = functools.reduce(branch, reversed(range(len(KERNELS))), None)


# without it the chain of branches is a call of its own, which takes three times as long as a
# polynomial
@njit(forceinline=True)
def built_in(
    code: int, par: FloatArray, o: int, n: int, lane: int, tab: FloatArray, k: int, x: float
) -> Three:
    """f, f′, f″ at one x of the built-in law with that code.

    par (rows, lanes): parameters par[o : o + n, lane]; tab: fixed data from tab[k] on.
    """
    found: Three = every_kind(code, par, o, n, lane, tab, k, x)
    return found


@kernel
def law(code: int, par: Rows, o: int, n: int, lane: int, tab: Floats, k: int, x: float) -> Three:
    """`built_in`, for calls from Python."""
    return built_in(code, par, o, n, lane, tab, k, x)


@kernel
def evaluate(
    code: int, par: Rows, o: int, n: int, lane: int, tab: Floats, k: int, xs: Floats, out: Rows
) -> None:
    """Fill out (len(xs), 3) with f, f′, f″ at every x."""
    for i in range(xs.size):
        f, f1, f2 = built_in(code, par, o, n, lane, tab, k, xs[i])
        out[i, 0] = f
        out[i, 1] = f1
        out[i, 2] = f2


@kernel
def thomas(lower: Floats, diagonal: Floats, upper: Floats, right: Rows) -> None:
    """Solve a tridiagonal system in place (Thomas algorithm).

    `right` (n, r) becomes the solution; `diagonal` (n,) is overwritten.
    """
    n = diagonal.size
    for i in range(1, n):
        w = lower[i] / diagonal[i - 1]
        diagonal[i] -= w * upper[i - 1]
        for j in range(right.shape[1]):
            right[i, j] -= w * right[i - 1, j]
    for i in range(n - 1, -1, -1):
        for j in range(right.shape[1]):
            if i + 1 < n:
                right[i, j] -= upper[i] * right[i + 1, j]
            right[i, j] /= diagonal[i]
