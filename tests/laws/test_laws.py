"""Motion and force laws against independent formulas and their own definitions."""

import math
import pickle
import warnings

import numpy as np
import pytest

from mbody.core import callbacks
from mbody.laws import (
    LAW_KINDS,
    SHAPES,
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Function,
    Harmonic,
    Law,
    Polynomial,
    Rise,
    Table,
    evaluate,
    law,
    times_of,
)
from tests.support.law_examples import CAM, EXAMPLES, IDS, broken_function

PI = math.pi
KNOTS = np.array([0.0, 0.1, 0.25, 0.3, 0.55, 0.7, 1.0])


def difference(function, x, h=2e-3):
    """Central difference of order 8."""
    weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    return sum(
        w * (function(x + k * h) - function(x - k * h)) for k, w in enumerate(weights, 1)
    ) / h  # fmt: skip


# --- every law ----------------------------------------------------------------------------------


@pytest.mark.parametrize("example", EXAMPLES, ids=IDS)
def test_derivatives_are_the_differences_of_f(example):
    # places that keep 8 ms from every join of the examples, where f'' or f''' jumps
    x = np.array([0.033, 0.21, 0.2725, 0.31, 0.4, 0.5, 0.62, 0.77, 0.835, 0.87])
    _, f1, f2 = example.derivatives(x)
    size = 1.0 + np.max(np.abs(f1)) + np.max(np.abs(f2))
    # order 8 with h = 2 ms on time scales of 0.1: (h ω)⁸ < 1e-9; rounding ε/h = 1e-13
    np.testing.assert_allclose(difference(example, x), f1, atol=2e-9 * size)
    np.testing.assert_allclose(
        difference(lambda t: example.derivatives(t)[1], x), f2, atol=2e-8 * size
    )


@pytest.mark.parametrize("example", EXAMPLES, ids=IDS)
def test_floats_and_arrays_give_the_same(example):
    x = np.array([[0.1, 0.4], [0.6, 0.9]])
    rows = example.derivatives(x)
    assert all(row.shape == (2, 2) for row in rows)
    one = example.derivatives(0.6)
    assert all(type(value) is float for value in one)
    assert one == tuple(row[1, 0] for row in rows)
    assert example(0.6) == one[0]
    np.testing.assert_array_equal(example(x), rows[0])
    assert example.derivatives(np.empty(0))[0].shape == (0,)


@pytest.mark.parametrize("example", EXAMPLES, ids=IDS)
def test_laws_pickle_compare_and_are_frozen(example):
    copy = pickle.loads(pickle.dumps(example))
    assert copy == example and hash(copy) == hash(example)
    assert copy.derivatives(0.37) == example.derivatives(0.37)
    assert isinstance(example, Law) and example.kind in LAW_KINDS
    assert LAW_KINDS[example.code] == example.kind
    with pytest.raises(AttributeError):
        example.mean = 3.0


@pytest.mark.parametrize(
    "example", [e for e in EXAMPLES if e.numbers()], ids=lambda e: type(e).__name__
)
def test_parameters_over_a_batch(example):
    numbers = example.numbers()
    factor = np.array([1.0, 1.3, 0.7])
    first = next(iter(numbers))
    batch = {**numbers, first: numbers[first] * factor}
    rows = example.parameters(batch)
    par = np.array(np.broadcast_arrays(*rows, factor)[:-1])
    assert par.shape == (len(rows), 3)
    seen = set()
    for lane, f in enumerate(factor):
        one = example.parameters({**numbers, first: numbers[first] * f})
        np.testing.assert_array_equal(par[:, lane], one)
        out = np.empty((2, 3))
        tab = example.table()
        evaluate(example.code, par, 0, len(rows), lane, tab, 0, np.array([0.3, 0.8]), out)
        changed = law(example.code, np.array(one)[:, None], 0, len(one), 0, tab, 0, 0.8)
        assert tuple(out[1]) == changed
        seen.add(changed[0])
    assert len(seen) == 3


# --- elementary laws ----------------------------------------------------------------------------


def test_elementary_laws_against_the_complex_step():
    coefficients = [1.0, -2.0, 0.5, 3.0]
    cases = [
        (Polynomial(coefficients), lambda z: sum(c * z**i for i, c in enumerate(coefficients))),
        (ConstantAcceleration(1.0, 2.0, -3.0), lambda z: 1.0 + 2.0 * z - 1.5 * z * z),
        (Harmonic(1.0, 2.0, 30.0, 0.4), lambda z: 1.0 + 2.0 * np.sin(30.0 * z + 0.4)),
    ]
    x = np.linspace(-2.0, 2.0, 41)
    for example, formula in cases:
        f, f1, _ = example.derivatives(x)
        np.testing.assert_allclose(f, formula(x), rtol=1e-13, atol=1e-13)
        slope = formula(x + 1e-30j).imag / 1e-30
        np.testing.assert_allclose(f1, slope, rtol=1e-12, atol=1e-13 * np.max(np.abs(slope)))


# --- Python functions ---------------------------------------------------------------------------


def test_missing_derivatives_by_complex_step():
    x = np.linspace(0.0, 3.0, 31)
    for w in (0.5, 3.0, 2 * PI * 20, 1000.0):  # also much faster than the scale of 1
        f, f1, f2 = Function(lambda t, w=w: np.sin(w * t)).derivatives(x)
        np.testing.assert_array_equal(f, np.sin(w * x))
        np.testing.assert_allclose(f1, w * np.cos(w * x), atol=1e-15 * w)
        np.testing.assert_allclose(f2, -w * w * np.sin(w * x), atol=1e-11 * w * w)


def test_missing_derivatives_by_differences():
    x = np.linspace(0.0, 3.0, 31)
    for w, scale in ((0.5, 1.0), (3.0, 1.0), (2 * PI * 20, 1.0), (2 * PI * 20, 0.01), (800.0, 1.0)):
        _, f1, f2 = Function(lambda t, w=w: math.sin(w * t), scale=scale).derivatives(x)
        np.testing.assert_allclose(f1, w * np.cos(w * x), atol=1e-11 * w)
        np.testing.assert_allclose(f2, -w * w * np.sin(w * x), atol=2e-9 * w * w)


def test_given_derivatives_are_used():
    f = Function(lambda t: t, rate=lambda t: 7.0 * t, acceleration=lambda t: 9.0)
    assert f.derivatives(2.0) == (2.0, 14.0, 9.0)
    assert Function(lambda t: t, rate=lambda t: np.sin(t)).derivatives(0.5) == pytest.approx(
        (0.5, math.sin(0.5), math.cos(0.5)), rel=1e-15
    )
    only = Function(math.sin, acceleration=lambda t: 3.0).derivatives(0.5)
    assert only == pytest.approx((math.sin(0.5), math.cos(0.5), 3.0), rel=1e-11)


def drops_the_imaginary_part(t):
    return float(np.real(t)) ** 2


def warns_of_complex_numbers(t):
    return float(np.asarray(t).astype(float)) ** 3


@pytest.mark.parametrize(
    ("function", "slope", "bend"),
    [
        (lambda t: np.abs(t) ** 3, 3 * 0.7**2, 6 * 0.7),
        (drops_the_imaginary_part, 1.4, 2.0),
        (warns_of_complex_numbers, 3 * 0.7**2, 6 * 0.7),
        (lambda t: np.conj(t) * t, 1.4, 2.0),
        (lambda t: np.interp(t, [0.0, 2.0], [0.0, 4.0]), 2.0, 0.0),
        (lambda t: 5, 0.0, 0.0),
    ],
)
def test_a_wrong_complex_derivative_is_noticed(function, slope, bend):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, f1, f2 = Function(function).derivatives(0.7)
    assert f1 == pytest.approx(slope, abs=1e-11)
    assert f2 == pytest.approx(bend, abs=1e-9)


def test_errors_of_a_function_are_not_swallowed():
    broken = Function(broken_function)
    with pytest.raises(RuntimeError, match=r"no entry for 0\.4"):
        broken.derivatives(0.4)
    handle = callbacks.register(broken.hook())
    try:
        assert callbacks.call_user(handle, np.array([0.4]), np.empty(3)) == 1
        with pytest.raises(RuntimeError, match=r"no entry for 0\.4"):
            callbacks.raise_failure(handle)
    finally:
        callbacks.release(handle)


ACCELERATED = ConstantAcceleration(0.0, 25.0, -40.0)


# --- times --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("example", "t0", "t1"),
    [
        (ConstantSpeed(1.0, 3.0), -1.0, 2.0),
        (ConstantSpeed(1.0, -3.0), -1.0, 2.0),
        (ConstantAcceleration(60.0, 25.0, -40.0), 0.1, 0.625),
        (ConstantAcceleration(60.0, 25.0, -40.0), 0.625, 2.0),
        (ConstantAcceleration(0.0, 0.0, 2.0), 0.0, 5.0),
        (Polynomial([1.0, 2.0]), 0.0, 50.0),
        (Polynomial([0.0, 0.0, 0.0, 1.0]), -3.0, 40.0),  # its slope is 0 on the way
        (Polynomial([0.0, 1.0, 0.0, -1.0]), -0.57, 0.57),
        (Harmonic(1.0, 2.0, 30.0, 0.4), 0.05, 0.14),
        (Harmonic(1.0, -2.0, -30.0, 0.4), -0.039, 0.0656),
        (Table(KNOTS, np.cos(3.0 * KNOTS), end="clamped"), 0.0, 1.0),
        (Table(KNOTS, KNOTS**2, outside="line"), 0.2, 700.0),
        (Table(KNOTS, np.sin(2 * PI * KNOTS), periodic=True), 3.76, 4.24),
        *[(Rise(shape, -2.0, 0.2, 0.7, 1.5), 0.0, 0.9) for shape in SHAPES],
        (CAM, 3.8, 5.0),
        (CAM, 1.2, 3.25),
        (Function(np.expm1), 0.0, 3.0),
        (Function(math.sin, math.cos, scale=2.0), -1.5, 1.5),
    ],
    ids=lambda v: type(v).__name__ if isinstance(v, Law) else str(v),
)
def test_times_take_the_law_back_to_its_values(example, t0, t1):
    n = 61 if example.kind == "user" else 3600
    values = np.linspace(example(t0), example(t1), n)
    times = times_of(example, values, t0)
    assert times.shape == (n,) and (np.diff(times) >= 0.0).all()
    assert times[0] == t0 and times[-1] <= t1 * (1 + 1e-7) + 1e-7
    size = np.max(np.abs(values)) + np.max(np.abs(example.derivatives(times)[1] * times))
    np.testing.assert_allclose(example(times), values, atol=4e-15 * size)
    np.testing.assert_array_equal(times_of(example, values[-1:], t0), times[-1:])


def test_times_leave_a_dwell_at_its_beginning():
    assert times_of(Rise("3-4-5", 2.0, 1.0, 1.0), [0.0, 1.0, 2.0, 2.0], -5.0) == pytest.approx(
        [-5.0, 1.5, 2.0, 2.0], abs=1e-5
    )
    assert times_of(Constant(3.0), [3.0, 3.0], 1.0).tolist() == [1.0, 1.0]
    assert times_of(Constant(3.0), [], 1.0).size == 0


def test_times_from_a_turning_point_that_is_known_but_for_rounding():
    for example, t0 in ((ACCELERATED, 0.625 - 1e-9), (Harmonic(0.0, 1.0, 1.0), PI / 2 - 1e-9)):
        values = np.linspace(example(t0), 0.5, 9)
        np.testing.assert_allclose(example(times_of(example, values, t0)), values, atol=1e-14)


# --- plain Python -------------------------------------------------------------------------------
