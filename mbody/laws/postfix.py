"""Evaluation of a law given by a formula: a postfix program on jets (f, f′, f″).

The last value is in local variables. Values that wait for a second operand are on a stack in the
frame of the kernel: nothing is allocated, no parameter is written, and every thread has its own
stack. Each operation propagates the first two derivatives exactly (automatic differentiation).
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mbody.core.decorators import PLAIN, inline, njit
from mbody.core.duals import constant, entry
from mbody.core.stack import FRAME_NUMBERS, numbers_in_frame

__all__ = ["MAX_STACK", "MAX_OPERATIONS", "OPERATIONS", "expression"]

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
        return (-a, -a1, -a2) if less(a, a1, a2, 0.0, 0.0, 0.0) else (a, a1, a2)
    if code == SIGN:  # a NaN remains one
        return (1.0 if a > 0.0 else -1.0 if a < 0.0 else a), 0.0, 0.0
    if code == STEP:
        return (1.0 if a >= 0.0 else 0.0 if a < 0.0 else a), 0.0, 0.0
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
        # a NaN is selected, so that it is not hidden
        first = a != a or (b == b and less(a, a1, a2, b, b1, b2) == (code == MIN))
        return (a, a1, a2) if first else (b, b1, b2)
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
