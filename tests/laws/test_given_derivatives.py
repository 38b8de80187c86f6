"""Given derivatives of Python functions: right ones are never doubted, wrong ones always."""

import math

import numpy as np
import pytest

from mbody.laws.function import Function, wrong_derivative


def polynomial(rng, span):
    p = np.polynomial.Polynomial(rng.normal(size=rng.integers(2, 8)), domain=[0.0, span])
    return p, p.deriv(), p.deriv(2)


def exponential(rng, span):
    k, a, offset = rng.normal(scale=6.0) / span, rng.normal(), rng.normal(scale=10.0)
    return (
        lambda x: offset + a * math.exp(k * x),
        lambda x: a * k * math.exp(k * x),
        lambda x: a * k * k * math.exp(k * x),
    )


def wave(rng, span):
    w = 10.0 ** rng.uniform(0.0, 7.0) / span
    p, a, mean = rng.normal(), rng.normal(), rng.normal()
    return (
        lambda x: mean + a * math.sin(w * x + p),
        lambda x: a * w * math.cos(w * x + p),
        lambda x: -a * w * w * math.sin(w * x + p),
    )


def spline(rng, span):
    from mbody.laws import Table

    knots = np.linspace(0.0, span, rng.integers(4, 40))
    law = Table(knots, rng.normal(size=knots.size), outside="line")
    return tuple(lambda x, n=n: law.derivatives(float(x))[n] for n in range(3))


def straight_lines(rng, span):
    from mbody.laws import Table

    knots = np.linspace(0.0, span, rng.integers(4, 200))
    law = Table(knots, rng.normal(size=knots.size), interpolation="linear", outside="line")
    return tuple(lambda x, n=n: law.derivatives(float(x))[n] for n in range(3))


def bent(rng, span):
    """An abs with a corner, sometimes where the function is looked at."""
    corner, k = rng.uniform(0.0, span), rng.normal() / span
    return (
        lambda x: k * abs(x - corner) + 0.3,
        lambda x: math.copysign(k, k * (x - corner)),
        lambda x: 0.0,
    )


def stairs(rng, span):
    n, a = int(rng.integers(3, 1000)), rng.normal()
    return lambda x: a * math.floor(n * x / span), lambda x: 0.0, lambda x: 0.0


def steep(rng, span):
    k, m = 10.0 ** rng.uniform(1.0, 5.0) / span, rng.uniform(0.0, span)

    def slope(x):
        return k / math.cosh(k * (x - m)) ** 2 if abs(k * (x - m)) < 300.0 else 0.0

    return (
        lambda x: math.tanh(k * (x - m)),
        slope,
        lambda x: -2.0 * k * math.tanh(k * (x - m)) * slope(x),
    )


def pulse(rng, span):
    w, m = span * 10.0 ** rng.uniform(-5.0, 0.0), rng.uniform(0.0, span)

    def value(x):
        return math.exp(-(((x - m) / w) ** 2)) if abs(x - m) < 26.0 * w else 0.0

    return (
        value,
        lambda x: -2.0 * (x - m) / w**2 * value(x),
        lambda x: (4.0 * (x - m) ** 2 / w**4 - 2.0 / w**2) * value(x),
    )


def noisy(rng, span):
    """A wave with values that are only known to some digits, as of a solver inside."""
    size, w = 10.0 ** rng.uniform(-12.0, -1.0), rng.uniform(1.0, 20.0) / span
    return (
        lambda x: math.sin(w * x) + size * math.sin(1e9 * math.sin(1e9 * x / span)),
        lambda x: w * math.cos(w * x),
        lambda x: -w * w * math.sin(w * x),
    )


KINDS = (
    polynomial, exponential, wave, spline, straight_lines, bent, stairs, steep, pulse, noisy
)  # fmt: skip


def scaled(parts, size):
    return tuple(lambda x, f=f: size * float(f(x)) for f in parts)


def drawn(kind, rng):
    """Functions of a kind, of values and spans of any size, and the range they are used in."""
    span = 10.0 ** rng.choice([-9.0, -3.0, 0.0, 0.0, 3.0, 9.0])
    parts = scaled(kind(rng, span), 10.0 ** rng.choice([-9.0, -3.0, 0.0, 0.0, 3.0, 9.0]))
    low, high = np.sort(rng.uniform(0.0, span, 2))
    return parts, float(low), float(high)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_right_derivative_is_never_doubted(kind):
    for seed in range(20):
        parts, low, high = drawn(kind, np.random.default_rng(seed))
        assert wrong_derivative(Function(*parts), low, high) is None, seed
        f, rate, acceleration = parts
        assert wrong_derivative(Function(f, None, acceleration), low, high) is None, seed
        assert wrong_derivative(Function(f, rate, scale=high), low, low) is None, seed


#: Mistakes: which derivative, and what it becomes.
MISTAKES = {
    "rate 1 % off": lambda f, g, h: (f, lambda x: 1.01 * g(x), h),
    "rate of half": lambda f, g, h: (f, lambda x: 0.5 * g(x), h),
    "sign of the rate": lambda f, g, h: (f, lambda x: -g(x), h),
    "second 1 % off": lambda f, g, h: (f, g, lambda x: 0.99 * h(x)),
    "sign of the second": lambda f, g, h: (f, g, lambda x: -h(x)),
    "second alone": lambda f, g, h: (f, None, lambda x: 1.3 * h(x)),
    "no rate": lambda f, g, h: (f, lambda x: 0.0, lambda x: 0.0),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_derivative_is_found(mistake):
    kinds = (polynomial, exponential, wave, spline)
    for seed in range(16):
        rng = np.random.default_rng(seed)
        parts, low, high = drawn(kinds[seed % len(kinds)], rng)
        if abs(parts[2](low)) <= 1e-9 * abs(parts[1](low)) / max(high, 1e-300):
            continue  # a straight line, whose second derivative is nothing
        found = wrong_derivative(Function(*MISTAKES[mistake](*parts)), low, high)
        assert found is not None, seed
        order = 2 if "second" in mistake else 1
        assert found.order == order
        assert low <= found.x <= high
        assert found.wanted == pytest.approx(parts[order](found.x), rel=1e-3)
