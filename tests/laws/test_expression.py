"""Formulas of laws: derivatives against hand and Cauchy's formula, polynomials, units."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mbody.laws import Expression, Polynomial
from mbody.laws.kernels import MAX_OPERATIONS, MAX_STACK, OPERATIONS
from mbody.quantities import FormulaError, Valued, text_of
from mbody.quantities.parse import Binary, Call, Name, Negative, Plain
from mbody.quantities.units import DIMENSIONS, NUMBER
from tests.support.expressions import made, program

PI = math.pi
EPS = 2.3e-16
TIME, ANGLE, LENGTH = (DIMENSIONS[name] for name in ("time", "angle", "length"))


# --- derivatives --------------------------------------------------------------------------------

X = np.array([0.13, 0.4, 0.77])
S, C, E = np.sin(3 * X), np.cos(3 * X), np.exp(3 * X)
W = 1 + 2 * X
T = np.tan(2 * X)
BY_HAND = {
    "sin(3*t)": (S, 3 * C, -9 * S),
    "cos(3*t)": (C, -3 * S, -9 * C),
    "tan(2*t)": (T, 2 * (1 + T**2), 8 * T * (1 + T**2)),
    "asin(t)": (np.arcsin(X), (1 - X**2) ** -0.5, X * (1 - X**2) ** -1.5),
    "acos(t)": (np.arccos(X), -((1 - X**2) ** -0.5), -X * (1 - X**2) ** -1.5),
    "atan(2*t)": (np.arctan(2 * X), 2 / (1 + 4 * X**2), -16 * X / (1 + 4 * X**2) ** 2),
    "sqrt(1 + 2*t)": (W**0.5, W**-0.5, -(W**-1.5)),
    "exp(3*t)": (E, 3 * E, 9 * E),
    "log(1 + 2*t)": (np.log(W), 2 / W, -4 / W**2),
    "abs(sin(3*t) - 2)": (2 - S, -3 * C, 9 * S),
    "-sin(3*t)": (-S, -3 * C, 9 * S),
    "1 + sin(3*t)": (1 + S, 3 * C, -9 * S),
    "sin(3*t) - 1": (S - 1, 3 * C, -9 * S),
    "1 - sin(3*t)": (1 - S, -3 * C, 9 * S),
    "sin(3*t)*5": (5 * S, 15 * C, -45 * S),
    "sin(3*t)/5": (S / 5, 3 * C / 5, -9 * S / 5),
    "5/(1 + 2*t)": (5 / W, -10 / W**2, 40 / W**3),
    "sin(3*t) + exp(3*t)": (S + E, 3 * C + 3 * E, 9 * E - 9 * S),
    "sin(3*t) - exp(3*t)": (S - E, 3 * C - 3 * E, -9 * E - 9 * S),
    "t*exp(3*t)": (X * E, (1 + 3 * X) * E, (6 + 9 * X) * E),
    "t/(1 + 2*t)": (X / W, W**-2, -4 * W**-3),
    "(1 + 2*t)^2": (W**2, 4 * W, 8 + 0 * W),
    "(1 + 2*t)^3": (W**3, 6 * W**2, 24 * W),
    "(1 + 2*t)^-1": (1 / W, -2 / W**2, 8 / W**3),
    "(1 + 2*t)^1.5": (W**1.5, 3 * W**0.5, 3 * W**-0.5),
    "(-1 - 2*t)^3": (-(W**3), -6 * W**2, -24 * W),
    "(1 + 2*t)^n": (W**2.5, 5 * W**1.5, 15 * W**0.5),
    "2^t": (2**X, 2**X * np.log(2), 2**X * np.log(2) ** 2),
    "t^t": (X**X, X**X * (1 + np.log(X)), X**X * ((1 + np.log(X)) ** 2 + 1 / X)),
    "atan2(sin(3*t), cos(3*t))": (np.arctan2(S, C), 3 + 0 * X, 0 * X),
    "hypot(3*t, 4*t)": (5 * X, 5 + 0 * X, 0 * X),
    "hypot(t, 2)": ((4 + X**2) ** 0.5, X * (4 + X**2) ** -0.5, 4 * (4 + X**2) ** -1.5),
    "min(sin(3*t), 2)": (S, 3 * C, -9 * S),
    "max(2, exp(3*t) + 2)": (E + 2, 3 * E, 9 * E),
    "sign(sin(3*t) - 2)*exp(3*t)": (-E, -3 * E, -9 * E),
    "step(sin(3*t) - 2) + exp(3*t)": (E, 3 * E, 9 * E),
}  # fmt: skip


def by_hand(text):
    """The program of such a formula, of a plain x: some functions need it for their units."""
    example, _ = made(re.sub(r"\bt\b", "x", text), argument=NUMBER, n=2.5)
    assert isinstance(example, Expression)
    return example


@pytest.mark.parametrize("text", BY_HAND)
def test_derivatives_by_hand(text):
    example = by_hand(text)
    for found, expected in zip(example.derivatives(X), BY_HAND[text], strict=True):
        # a dozen operations, each to half a unit of its last digit
        np.testing.assert_allclose(found, expected, rtol=2e-14, atol=2e-14)


def test_every_operation_is_tried_by_hand():
    tried = {OPERATIONS[code] for text in BY_HAND for code in by_hand(text).program}
    assert tried == set(OPERATIONS)


def apart(a, b):
    """Whether two functions are clearly different at the centre, or the same all around."""
    return abs((a - b).mean()) > 1e-6 or np.allclose(a, b, rtol=1e-13, atol=1e-13)


def chosen(a, b, smaller):
    """The smaller or the larger, decided at the centre; NaN where they meet."""
    first = (a.mean().real < b.mean().real) == smaller
    return (a if first else b) if apart(a, b) else np.nan * a


COMPLEX = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log, "sqrt": np.sqrt,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "abs": lambda a: chosen(a, -a, False),
    "min": lambda a, b: chosen(a, b, True),
    "max": lambda a, b: chosen(a, b, False),
    "hypot": lambda a, b: np.sqrt(a * a + b * b),
    "atan2": lambda a, b: -1j * np.log((b + 1j * a) / np.sqrt(a * a + b * b)),
}  # fmt: skip


def on_circle(node, x, sizes):
    """A tree on complex numbers, analytic where each function is, NaN where it is not real:
    no code of mbody. `sizes` gets the greatest size of every part.
    """
    match node:
        case Plain(value=value):
            return np.full(x.shape, complex(value))
        case Name():
            return x
        case Negative(of=of):
            return -on_circle(of, x, sizes)
        case Call(function=function, arguments=arguments):
            given = [on_circle(argument, x, sizes) for argument in arguments]
            found = COMPLEX[function](*given)
            # where a function is vertical or has a corner, it is not analytic
            edge = {
                "sqrt": given[0], "asin": 1 - given[0] ** 2, "acos": 1 - given[0] ** 2,
                "hypot": sum(a * a for a in given), "atan2": sum(a * a for a in given),
            }.get(function, np.ones(1))  # fmt: skip
            cut = function == "atan2" and given[1].mean().real < 0 and abs(given[0].mean()) < 1e-6
            if cut or abs(edge.mean()) < 1e-6:
                return np.nan * found
        case Binary(operator=operator, a=a, b=b):
            one, two = on_circle(a, x, sizes), on_circle(b, x, sizes)
            if operator == "^" and abs(one.mean()) < 1e-6:
                return np.nan * one
            found = {
                "+": lambda: one + two,
                "-": lambda: one - two,
                "*": lambda: one * two,
                "/": lambda: one / two,
                "^": lambda: np.exp(two * np.log(one)),
            }[operator]()
    # real on the real axis: conjugate at conjugate places
    sizes.append(np.abs(found).max())
    mirrored = np.conj(np.roll(found[::-1], 1))
    alike = np.abs(found - mirrored) <= 1e-6 * np.abs(found).max()
    return found if alike.all() else np.nan * found


def by_cauchy(node, x, radius, count=32):
    """f, f′, f″ = k!/(2π r^k) ∫ f(x + r e^iθ) e^−ikθ dθ: the error falls as (r/R)^count; and the
    size by which all is rounded, the greatest of any part: cos 1000 is as far off as its angle is.
    """
    sizes = []
    turn = np.exp(2j * PI * np.arange(count) / count)
    with np.errstate(all="ignore"):
        f = on_circle(node, x + radius * turn, sizes)
    top = max(sizes, default=0.0)
    if not np.isfinite(f).all():
        return np.full(3, np.nan), top
    # powers of 1/z are those of a pole within the circle, to which the rest is blind
    if np.abs((f * turn ** np.arange(1, 4)[:, None]).mean(axis=1)).max() > 1e-12 * (1 + top):
        return np.full(3, np.nan), top
    k = np.arange(3)
    found = (f * turn ** -k[:, None]).mean(axis=1) * np.array([1, 1, 2]) / radius**k
    return found.real, top


numbers = st.builds(Fraction, st.integers(1, 30), st.just(10))
leaves = st.one_of(st.just(Name("x")), st.just(Name("x")), st.builds(Plain, numbers))
trees = st.recursive(
    leaves,
    lambda below: st.one_of(
        st.builds(Negative, below),
        st.builds(Binary, st.sampled_from("+-*/^"), below, below),
        st.builds(lambda f, a: Call(f, (a,)), st.sampled_from(sorted(
            set(COMPLEX) - {"min", "max", "hypot", "atan2"})), below),
        st.builds(lambda f, a, b: Call(f, (a, b)),
                  st.sampled_from(["min", "max", "hypot", "atan2"]), below, below),
    ),
    max_leaves=12,
)  # fmt: skip


@given(tree=trees, x=st.floats(0.2, 2.0))
@settings(max_examples=300)
def test_derivatives_of_random_formulas(tree, x):
    # inverse functions give angles, so that all units are taken out before
    assume("x" in text_of(tree))
    size = 0.01 * np.array([1.0, 0.5])
    (far, top), (near, _) = (by_cauchy(tree, x, radius) for radius in size)
    error = np.abs(far - near)
    # a singularity within the circles, or a result that is none
    assume(np.isfinite(far).all() and top < 1e6 and (error < 1e-6 * (1 + np.abs(far))).all())
    try:
        example, _ = made(text_of(tree), argument=NUMBER)
    except FormulaError:  # a constant that is not finite, or an angle among plain numbers
        assume(False)
    found = np.array(example.derivatives(x))
    # the oracle's own error: what it changes by with the radius, and rounding over r^k, of which
    # tan makes 1 + tan² times as much: of tan(tan(1)) 5600 times
    allowed = 10 * error + 50 * EPS * (1 + top) ** 2 / size[1] ** np.arange(3)
    assert (np.abs(found - near) <= allowed).all(), (text_of(tree), x, found, near, allowed)


def test_corners_take_what_holds_to_the_right():
    one = program("abs(t)*1 + 0*sin(t)")
    assert one.derivatives(0.0) == (0.0, 1.0, 0.0)
    assert program("abs(-t^3 - 2*t)").derivatives(0.0)[:2] == (0.0, 2.0)
    assert program("abs(-t^2)").derivatives(0.0) == (0.0, 0.0, 2.0)
    assert program("max(0, t - 1)").derivatives(1.0) == (0.0, 1.0, 0.0)
    assert program("min(0, t - 1)").derivatives(1.0) == (0.0, 0.0, 0.0)
    assert program("hypot(3*t, 4*t)").derivatives(0.0) == (0.0, 5.0, 0.0)
    assert program("hypot(3*t^2, 4*t^2)").derivatives(0.0) == (0.0, 0.0, 10.0)


@pytest.mark.parametrize(
    ("text", "places", "expected"),
    [
        ("clamp(2*t, -1, 4)", (-1.0, 1.0, 3.0), ((-1, 0, 0), (2, 2, 0), (4, 0, 0))),
        ("clamp(t^2, 1, 4)", (0.5, 1.5, 3.0), ((1, 0, 0), (2.25, 3, 2), (4, 0, 0))),
        ("deadband(t^2, 4)", (1.0, 3.0), ((0, 0, 0), (5, 6, 2))),
        ("deadband(-t^3, 1)", (0.5, 2.0), ((0, 0, 0), (-7, -12, -12))),
        ("sign(t)*(2 + t)", (-1.0, 0.0, 3.0), ((-1, -1, 0), (0, 0, 0), (5, 1, 0))),
        ("step(t - 1)*t^2", (0.5, 1.0, 2.0), ((0, 0, 0), (1, 2, 2), (4, 4, 2))),
    ],
)
def test_saturation_dead_band_and_steps(text, places, expected):
    """By hand, left of the corners, between them and right of them; sign(0) = 0, step(0) = 1."""
    example = program(text)
    for place, three in zip(places, expected, strict=True):
        assert example.derivatives(place) == three


# --- where there is no value --------------------------------------------------------------------


# --- polynomials --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "coefficients"),
    [
        ("3", [3.0]),
        ("t", [0.0, 1.0]),
        ("-t", [0.0, -1.0]),
        ("5 - 2*t", [5.0, -2.0]),
        ("2 - (t^2 - 3*t)/4", [2.0, 0.75, -0.25]),
        ("t*(1 + t)*t", [0.0, 0.0, 1.0, 1.0]),
        ("(2*t)^3", [0.0, 0.0, 0.0, 8.0]),
        ("t^8", [0.0] * 8 + [1.0]),
        ("t^0", [1.0]),
        ("sin(0.5)*t + max(2, a)", [3.0, math.sin(0.5)]),
        ("t²", [0.0, 0.0, 1.0]),
    ],
)
def test_polynomials_are_found(text, coefficients):
    found, _ = made(text, a=3.0)
    assert found == Polynomial(coefficients)


@pytest.mark.parametrize(
    "text", ["t^9", "t^8*t", "1/t", "t^0.5", "t^-1", "t^n", "(t - 2)*(t - 3)", "(t - 10)^8", "2^t"]
)
def test_what_is_no_polynomial_or_would_lose_digits(text):
    assert isinstance(made(text, n=2.0)[0], Expression)


def test_products_of_sums_keep_their_digits():
    example = program("(t - 10)^8")
    # multiplied out, terms of 1e8 · 70 would leave 1e-6 of error
    assert example(10.5) == pytest.approx(0.5**8, rel=1e-15)


# --- units --------------------------------------------------------------------------------------


def test_units_of_laws():
    found, _ = made("60 deg + 25 rad/s*t - 20 rad/s^2*t^2", ANGLE)
    assert found == Polynomial([60 * PI / 180, 25.0, -20.0])
    found, numbers = made(
        "F0*sin(w*t)", DIMENSIONS["force"],
        F0=Valued(3.0, DIMENSIONS["force"]), w=Valued(5.0, DIMENSIONS["angular velocity"]),
    )  # fmt: skip
    assert found(0.3) == 3.0 * math.sin(1.5)
    assert {name: number.text for name, number in numbers.items()} == {"c0": "w", "c1": "F0"}
    found, _ = made("20 N/mm*x + 3 N/mm^3*x^3", DIMENSIONS["force"], LENGTH)
    assert found(0.01) == pytest.approx(200.0 + 3000.0, rel=1e-15)
    found, _ = made("(sin(3 rad/s*t)*2) rad", ANGLE)
    assert found(0.2) == pytest.approx(2 * math.sin(0.6), rel=1e-15)
    found, _ = made("(t/2 s + 1) deg", ANGLE)
    assert found == Polynomial([PI / 180, 0.5 * (PI / 180)])


def test_a_program_that_keeps_too_many_waiting():
    text = "t"
    for _ in range(MAX_STACK):
        text = f"sin(t)+({text})*sin(t)" if len(text) < 20 else f"exp(t)*({text})"
    with pytest.raises(FormulaError, match=rf"numbers, at most {MAX_OPERATIONS} and {MAX_STACK}"):
        made(text)
