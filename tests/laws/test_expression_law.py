"""Laws from formulas: as other laws, over batches, their times, without compiler."""

import numpy as np
import pytest

from mbody import ModelError, assemble, kinetostatics
from mbody.laws import ConstantAcceleration, Expression, Function, Harmonic, Polynomial, times_of
from mbody.quantities import Scope, Valued, parse
from mbody.quantities.units import DIMENSIONS
from tests.support.expressions import four_bar, made, program

TIME, ANGLE, LENGTH = (DIMENSIONS[name] for name in ("time", "angle", "length"))


# --- as a law -----------------------------------------------------------------------------------


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
        ("cos(t)", [1.0, 1.5], r"other direction from t = 0"),
        ("1 - 2/(exp(2*t) + 1)", [0.0, 1.5], r"no further than 1, at t = "),
        ("0*sin(t)", [0.0, 1.5], r"stays at 0 from t = 0"),
        ("5*t + sin(6*t)", [0.0, 9.0], r"turns back at t = 0\.42\d* where"),
        ("100*t + 0.06*sin(2000*t)", [0.0, 9.0], r"turns back at t = 0\.00\d* where"),
        ("max(1, 2 - t) + sin(t)/9", [2.0, 3.0], r"other direction from t = 0"),
        ("log(1 + t) - t", [0.0, 1.0], r"other direction from t = 0"),
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


# --- plain Python -------------------------------------------------------------------------------
