"""Laws from formulas: derivatives against hand and Cauchy's formula, polynomials, units, times."""

import math
import os
import pickle
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mbody import AngleDriver, ModelError, SolveError, Spring, Torque, assemble, kinetostatics
from mbody.laws import (
    ConstantAcceleration,
    Expression,
    Function,
    Harmonic,
    Polynomial,
    compiled,
    law,
    times_of,
)
from mbody.laws.machine import DEEPEST, LONGEST, OPERATIONS
from mbody.makers import makers
from mbody.quantities import FormulaError, Scope, Valued, evaluate, parse, read, text_of
from mbody.quantities.tree import Binary, Call, Measured, Name, Negative, Plain
from mbody.quantities.units import DIMENSIONS, NUMBER

PI = math.pi
EPS = 2.3e-16
TIME, ANGLE, LENGTH = (DIMENSIONS[name] for name in ("time", "angle", "length"))


def made(text, dimension=None, argument=TIME, angle="rad", **names):
    """The law of a formula, with parameters that are plain numbers or `Valued`."""
    scope = Scope(names={k: v if isinstance(v, Valued) else Valued(v) for k, v in names.items()})
    return compiled(read(text, dimension, angle), scope, argument)


def program(text, **names):
    """The same, where it must be a program."""
    found = made(text, **names)[0]
    assert isinstance(found, Expression)
    return found


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
}  # fmt: skip


def by_hand(text):
    """The program of such a formula, of a plain x: some functions ask for it by their units."""
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
    """The smaller or the larger, told at the centre; NaN where they meet."""
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


def on_circle(node, x):
    """A tree on complex numbers, analytic where each function is, NaN where it is not real:
    no code of mbody.
    """
    match node:
        case Plain(value=value):
            return np.full(x.shape, complex(value))
        case Name():
            return x
        case Negative(of=of):
            return -on_circle(of, x)
        case Call(function=function, arguments=arguments):
            given = [on_circle(argument, x) for argument in arguments]
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
            one, two = on_circle(a, x), on_circle(b, x)
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
    mirrored = np.conj(np.roll(found[::-1], 1))
    alike = np.abs(found - mirrored) <= 1e-6 * np.abs(found).max()
    return found if alike.all() else np.nan * found


def by_cauchy(node, x, radius, count=32):
    """f, f′, f″ = k!/(2π r^k) ∫ f(x + r e^iθ) e^−ikθ dθ: the error falls as (r/R)^count."""
    turn = np.exp(2j * PI * np.arange(count) / count)
    with np.errstate(all="ignore"):
        f = on_circle(node, x + radius * turn)
    top = np.abs(f).max()
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
    # the oracle's own error: what it changes by with the radius, and rounding over r^k
    allowed = 10 * error + 50 * EPS * (1 + top) / size[1] ** np.arange(3)
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


def test_powers_of_zero():
    for n, expected in ((0, (1, 0, 0)), (1, (0, 1, 0)), (2, (0, 0, 2)), (3, (0, 0, 0))):
        assert program("(t - 1)^n", n=float(n)).derivatives(1.0) == expected
    assert program("(t - 1)^2.5").derivatives(1.0) == (0.0, 0.0, 0.0)
    assert program("(t - 1)^1.5").derivatives(1.0) == (0.0, 0.0, math.inf)
    assert program("0^(1 + t)").derivatives(1.0) == (0.0, 0.0, 0.0)
    assert program("(t - 3)^n", n=3.0).derivatives(1.0) == (-8.0, 12.0, -12.0)
    assert program("(t - 3)^min(2, 1 + t)").derivatives(1.5) == (2.25, -3.0, 2.0)


# --- where there is no value --------------------------------------------------------------------


def test_no_value_is_a_sentence():
    for text, x in (("log(t)", -1.0), ("1/t", 0.0), ("sqrt(t - 1)", 0.5), ("exp(t)", 1e4)):
        example = program(text)
        with pytest.raises(ModelError, match=rf"'{re.escape(text)}' has no value at"):
            example(np.array([2.0, x]))
        par = np.array(example.parameters(example.numbers()), dtype=float).reshape(-1, 1)
        out = law(example.code, par, 0, len(par), 0, example.table(), 0, np.float64(x))
        assert np.isnan(out).all()
    corner = program("sqrt(t)")
    assert corner(0.0) == 0.0 and corner.derivatives(0.0) == (0.0, math.inf, -math.inf)
    unknown = program("sqrt(t^2)")
    assert unknown(0.0) == 0.0
    with pytest.raises(ModelError, match=r"'sqrt\(t\^2\)' has no rate at 0"):
        unknown.derivatives(0.0)


def four_bar(angle_law, *loads):
    """Norton's proportions, driven by that law."""
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=1.0)
    fresh = type(machine)("four-bar", ground=dict(machine.ground.points))
    fresh.add(*machine.bodies, *machine.joints, AngleDriver("motor", "crank", angle_law), *loads)
    return fresh


def test_analyses_name_the_driver_the_time_and_the_text():
    times = np.linspace(0.0, 2.0, 9)
    with pytest.raises(ModelError, match=r"driver 'motor': 'log\(1 - t\)' has no value at 1: ask"):
        kinetostatics(four_bar(program("log(1 - t)")), t=times)
    with pytest.raises(ModelError, match=r"'motor', .*sqrt\(t\).*, has an infinite rate at t = 0"):
        kinetostatics(four_bar(program("sqrt(t)")), t=times)
    assert len(kinetostatics(four_bar(program("sqrt(t)")), t=times[1:]).t) == 8
    steady = made("t")[0]
    brake = Torque("brake", "rocker", value=program("5/(t - 1)"))
    with pytest.raises(ModelError, match=r"value of load 'brake': '5/\(t - 1\)' has no value at 1"):
        kinetostatics(four_bar(steady, brake), t=times)
    # a force needs no rate
    brake = Torque("brake", "rocker", value=program("5*sqrt(t)"))
    assert len(kinetostatics(four_bar(steady, brake), t=times).t) == 9
    spring = Spring("spring", "ground.O2", "rocker.B", law=made("log(x - 9)", argument=LENGTH)[0])
    with pytest.raises(SolveError, match=r"'spring' has no value at t = 0 s: 'log\(x - 9\)'"):
        kinetostatics(four_bar(steady, spring))


def test_a_design_without_a_value_is_numbered():
    machine = four_bar(program("log(2 + c*t)", c=1.0))
    system = assemble(machine).with_values({"motor.law.c0": [1.0, 0.5, -3.0]})
    with pytest.raises(ModelError, match=r"design 2 of the batch: .*'log\(2 \+ c\*t\)'.* at 1"):
        kinetostatics(system, t=[0.0, 0.5, 1.0])
    spring = Spring(
        "spring", "ground.O2", "rocker.B", law=made("log(x - b)", argument=LENGTH, b=-9.0)[0]
    )
    system = assemble(four_bar(made("t")[0], spring))
    system = system.with_values({"spring.law.c0": [9.0, 9.0, -9.0]})
    with pytest.raises(SolveError, match=r"design 2 of the batch: load 'spring' has no value"):
        kinetostatics(system, t=[0.0, 0.5, 1.0])


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


def test_plain_degrees_are_scaled():
    line, numbers = made("a + 90*t", ANGLE, angle="deg", a=60.0)
    assert line(1.0) == pytest.approx(150 * PI / 180, rel=1e-15)
    assert list(numbers) == ["c0"]
    assert numbers["c0"].value(Scope(names={"a": Valued(180.0)})) == PI
    swing, _ = made("30*sin(2*t)", ANGLE, angle="deg")
    assert swing(0.4) == pytest.approx(30 * math.sin(0.8) * PI / 180, rel=1e-15)
    assert made("30*sin(2*t)", ANGLE)[0](0.4) == 30 * math.sin(0.8)
    # with units the angle is known
    assert made("60 deg + 1 rev/s*t", ANGLE, angle="deg")[0](1.0) == pytest.approx(
        PI / 3 + 2 * PI, rel=1e-15
    )


def test_a_program_that_keeps_too_many_waiting():
    text = "t"
    for _ in range(DEEPEST):
        text = f"sin(t)+({text})*sin(t)" if len(text) < 20 else f"exp(t)*({text})"
    with pytest.raises(FormulaError, match=rf"numbers waiting, at most {LONGEST} with {DEEPEST}"):
        made(text)


# --- as a law -----------------------------------------------------------------------------------


def test_an_expression_is_a_law_like_others():
    example = program("10*sin(5*t)*exp(-t/2)")
    copy = pickle.loads(pickle.dumps(example))
    assert copy == example and hash(copy) == hash(example)
    assert repr(example) == "Expression('10*sin(5*t)*exp(-t/2)')"
    assert example.numbers() == {"c0": 5.0, "c1": 10.0, "c2": 2.0}
    changed = example.with_numbers({"c0": 5.0, "c1": 20.0, "c2": 2.0})
    assert changed != example and changed(0.3) == 2 * example(0.3)
    assert all(type(value) is float for value in example.derivatives(0.3))
    assert example(np.full((2, 3), 0.3)).shape == (2, 3)


def test_the_kernel_reads_its_own_rows_lane_and_table_and_writes_none():
    example = program("10*sin(5*t)*exp(-t/2) + hypot(t, 3)")
    values, own = example.parameters(example.numbers()), example.table()
    par = np.full((len(values) + 5, 3), np.nan)
    par[2 : 2 + len(values), 1] = values
    before = par.copy()
    tab = np.concatenate([[np.nan] * 3, own, [np.nan]])
    assert law(example.code, par, 2, len(values), 1, tab, 3, 0.37) == example.derivatives(0.37)
    np.testing.assert_array_equal(par, before)


def test_numbers_over_a_batch_equal_compiling_again():
    text, a, w = "a*sin(w*t)^2 + b/(1 + a)", np.array([1.0, 2.5, -0.5]), np.array([3.0, 4.0, 7.0])
    names = {"a": 1.0, "w": 3.0, "b": 2.0}
    example, numbers = made(text, **names)
    assert sorted(numbers) == [name for name in example.numbers() if name != "c1"]
    scope = Scope(names={"a": Valued(a), "w": Valued(w), "b": Valued(2.0)})
    rows = {name: number.value(scope) for name, number in numbers.items()}
    for k in range(3):
        again, _ = made(text, a=a[k], w=w[k], b=2.0)
        taken = {n: float(np.broadcast_to(v, 3)[k]) for n, v in rows.items()}
        assert example.with_numbers({**example.numbers(), **taken}) == again
    line, numbers = made("(a + 2*w)*t^2 - w*t/b", **names)
    assert isinstance(line, Polynomial) and sorted(numbers) == ["c1", "c2"]
    np.testing.assert_array_equal(numbers["c2"].value(scope), a + 2 * w)
    np.testing.assert_array_equal(numbers["c1"].value(scope), -(w / 2.0))
    for number in numbers.values():
        assert parse(number.text) == number.tree


def test_a_mechanism_over_a_batch_of_constants():
    example = program("0.3*sin(w*t) + 5*t", w=4.0)
    speeds, times = np.array([4.0, 5.0, 6.5]), np.linspace(0.0, 1.0, 7)
    place = next(k for k, v in example.numbers().items() if v == 4.0)
    system = assemble(four_bar(example)).with_values({f"motor.law.{place}": speeds})
    run = kinetostatics(system, t=times)
    for k, w in enumerate(speeds):
        alone = kinetostatics(four_bar(program("0.3*sin(w*t) + 5*t", w=w)), t=times)
        np.testing.assert_allclose(
            run["crank"].angle[..., k] if run["crank"].angle.shape[-1] == 3 else
            run["crank"].angle[k], alone["crank"].angle, rtol=1e-13,
        )  # fmt: skip


@pytest.mark.parametrize("instants", [7, 1000])  # the scalar path and the lanes
@pytest.mark.parametrize(
    ("text", "built_in"),
    [
        ("0.2 rad + 0.9 rad*sin(3 rad/s*t + 0.4 rad)", Harmonic(0.2, 0.9, 3.0, 0.4)),
        ("1 rad + t*max(25 rad/s - 4 rad/s^2*t, 0 rad/s)", ConstantAcceleration(1.0, 25.0, -8.0)),
    ],
)
def test_a_four_bar_by_a_formula_and_by_the_equal_law(text, built_in, instants):
    example, _ = made(text, ANGLE)
    assert isinstance(example, Expression)
    times = np.linspace(0.0, 2.0, instants)
    asked = [{"t": times}]
    if isinstance(built_in, ConstantAcceleration):
        asked.append({"turn": True, "instants": instants})
    for how in asked:
        one, two = (kinetostatics(four_bar(each), **how) for each in (example, built_in))
        # rounding of times and angles, of accelerations of 600 rad/s² and forces of 1e4 N
        np.testing.assert_allclose(one.t, two.t, rtol=1e-13, atol=1e-14)
        for body in ("crank", "coupler", "rocker"):
            for what, size in (("angle", 10.0), ("omega", 1e2), ("alpha", 1e4)):
                found, expected = getattr(one[body], what), getattr(two[body], what)
                np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12 * size)


# --- times --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "t0", "t1"),
    [
        ("3000 rpm*t + 0.02 rad*sin(2000 rad/s*t)", 0.0, 0.04),
        ("3000 rpm*t + 0.15 rad*sin(2000 rad/s*t)", 0.0, 5.0),  # nearly at rest 1600 times
        ("1e-6 rad/s*t + 1e-7 rad*sin(1e-3 rad/s*t)", 5.0, 7e6),
        ("(1 - cos(3 rad/s*t)) rad", 0.0, 1.04),
        ("(2 - exp(-t/3 s)) rad", 0.0, 60.0),
        ("2 rad*sqrt(t/1 s)", 0.0, 30.0),
        ("-log(1 - t/1 s)*1 rad", 0.0, 0.999999),
        ("max(t - 2 s, 0 s)*1 rad/s", 0.0, 9.0),
        ("-5 rad/s*t - 0.5 rad*sin(8 rad/s*t)", -1.0, 9.0),
        ("(t/1 s)^7*1 rad*exp(t/1 s)", 0.0, 3.0),
    ],
)
def test_times_of_a_formula(text, t0, t1):
    example, _ = made(text, ANGLE)
    assert isinstance(example, Expression)
    values = np.linspace(example(t0), example(t1), 721)
    times = times_of(example, values, t0)
    assert times[0] == t0 and (np.diff(times) >= 0.0).all() and times[-1] <= t1 * (1 + 1e-7)
    _, rate, _ = example.derivatives(times[1:])
    size = np.max(np.abs(values)) + np.max(np.abs(rate * times[1:]))
    np.testing.assert_allclose(example(times), values, atol=8e-15 * size)


@pytest.mark.parametrize(
    ("text", "values", "sentence"),
    [
        ("sin(t)", [0.0, 1.5], r"turns back at t = 1\.5708 where it has reached 1;"),
        ("cos(t)", [1.0, 1.5], r"other way from t = 0"),
        ("1 - 2/(exp(2*t) + 1)", [0.0, 1.5], r"no further than 1, at t = "),
        ("0*sin(t)", [0.0, 1.5], r"stays at 0 from t = 0"),
        ("5*t + sin(6*t)", [0.0, 9.0], r"turns back at t = 0\.42\d* where"),
        ("100*t + 0.06*sin(2000*t)", [0.0, 9.0], r"turns back at t = 0\.00\d* where"),
        ("max(1, 2 - t) + sin(t)/9", [2.0, 3.0], r"other way from t = 0"),
        ("log(1 + t) - t", [0.0, 1.0], r"other way from t = 0"),
        ("sqrt(1 - t)*0 + sin(t)", [0.0, 2.0], r"'sqrt\(1 - t\)\*0 \+ sin\(t\)' has no value at 1"),
    ],
)
def test_why_a_value_of_a_formula_is_not_reached(text, values, sentence):
    with pytest.raises(ModelError, match=sentence):
        times_of(program(text), values, 0.0)


def test_times_agree_with_those_of_the_python_function():
    values = np.linspace(0.0, 5.0, 41)
    ours = times_of(program("2*t + 0.3*sin(6*t)"), values, 0.0)
    theirs = times_of(Function(lambda t: 2 * t + 0.3 * np.sin(6 * t)), values, 0.0)
    np.testing.assert_allclose(ours, theirs, atol=1e-14)


# --- the text of a tree -------------------------------------------------------------------------

units = st.sampled_from(["m", "in", "N*m", "rad/s^2", "in-lbf", "deg", "kg*m^2", "s^-1", "1/3 in"])


def _measured(node, unit):
    spelled = parse(f"2 {unit}") if unit != "1/3 in" else parse("1/3 in")
    return Measured(spelled.of if unit == "1/3 in" else node, spelled.unit, spelled.symbols)


any_trees = st.recursive(
    st.one_of(
        st.sampled_from([Name("a"), Name("t"), Name("pi"), Name("mm")]),
        st.builds(Plain, st.builds(Fraction, st.integers(0, 10**20), st.sampled_from(
            [1, 10, 8, 10**6, 10**18]))),
    ),
    lambda below: st.one_of(
        st.builds(Negative, below),
        st.builds(_measured, below, units),
        st.builds(Binary, st.sampled_from("+-*/^"), below, below),
        st.builds(lambda a: Call("sin", (a,)), below),
        st.builds(lambda a, b: Call("atan2", (a, b)), below, below),
    ),
    max_leaves=10,
)  # fmt: skip


@given(tree=any_trees)
@settings(max_examples=500)
def test_the_text_of_a_tree_says_the_same_tree(tree):
    assert parse(text_of(tree)) == tree, text_of(tree)


@pytest.mark.parametrize(
    ("text", "shorter"),
    [
        ("((a))+((b*c))", "a + b * c"),
        ("(a+b)*c", "(a + b) * c"),
        ("a-(b-c)", "a - (b - c)"),
        ("(a-b)-c", "a - b - c"),
        ("a/(b*c)", "a / (b * c)"),
        ("(a^b)^c", "(a^b)^c"),
        ("a^(b^c)", "a^b^c"),
        ("-(a^2)", "-a^2"),
        ("(-a)^2", "(-a)^2"),
        ("(2 m)^2", "(2 m)^2"),
        ("1/4 in", "0.25 in"),
        ("1/3 in", "1/3 in"),
        ("5 N*m*2", "5 N·m * 2"),
        ("(a) furlong", "(a) furlong"),
        ("1e300 + 0.001", "1e300 + 0.001"),
    ],
)
def test_texts_have_few_brackets(text, shorter):
    assert text_of(parse(text)) == shorter
    assert parse(shorter) == parse(text)


def test_the_text_of_a_number_that_no_decimals_write():
    tree = Plain(Fraction(1, 3))
    assert text_of(Binary("*", Name("a"), tree)) == "a * (1 / 3)"
    assert evaluate(parse(text_of(tree)), Scope()).value == 1 / 3


# --- plain Python -------------------------------------------------------------------------------

PLAIN = """
import numpy as np
from mbody.quantities import Scope, read
from mbody.laws import compiled
from mbody.quantities.units import NUMBER
texts = ["exp(-x)*sin(5*x)^2/(1 + x^3)", "atan2(sin(x), cos(2*x)) + asin(x/3)", "x^x - tan(x)",
         "hypot(x, 1) - log(1 + x)*sqrt(x)", "min(x, 0.5) + max(abs(x - 0.3), x)^1.5", "-acos(x/2)"]
laws = [compiled(read(text, None), Scope(), NUMBER)[0] for text in texts]
x = np.linspace(0.01, 1, 23)
print(repr(np.array([l.derivatives(x) for l in laws[:1] + laws[2:5]]).tolist()))
"""


def test_plain_mode_gives_the_same_numbers():
    root = Path(__file__).resolve().parents[1]
    found = []
    for plain in ("1", "0"):
        env = {**os.environ, "NUMBA_DISABLE_JIT": plain, "PYTHONPATH": str(root)}
        run = subprocess.run(
            [sys.executable, "-W", "error", "-c", PLAIN], env=env, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr
        found.append([np.array(eval(line)) for line in run.stdout.splitlines()])
    for plain, compiled_ in zip(*found, strict=True):
        np.testing.assert_allclose(plain, compiled_, rtol=1e-12, atol=1e-12)
