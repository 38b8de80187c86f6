"""Tables of two variables, and curves that formulas call by name."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RectBivariateSpline

from mbody import Body, Input, Mechanism, ModelError, Revolute, Torque, simulate
from mbody.laws import ConstantSpeed, Table, Table2
from tests.errors.test_errors import says

pytestmark = pytest.mark.processor

X = np.array([0.0, 0.4, 1.0, 1.7, 2.0])
Y = np.array([-1.0, -0.3, 0.5, 1.0])
KINDS = ("linear", "pchip", "spline")
AT = np.array([0.0, 0.13, 0.4, 0.77, 1.69, 2.0])


def grid(function):
    return function(X[:, None], Y[None, :])


def wavy(x, y):
    return np.sin(2.0 * x) * np.exp(0.7 * y) + x * y**2


# -- tables of two variables ----------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_bilinear_functions_are_exact(kind):
    table = Table2(X, Y, grid(lambda x, y: 2.0 - 3.0 * x + y + 5.0 * x * y), kind)
    x, y = np.meshgrid(AT, np.linspace(-1.0, 1.0, 7), indexing="ij")
    f, fx, fy = table.derivatives_at(x, y)
    np.testing.assert_allclose(f, 2.0 - 3.0 * x + y + 5.0 * x * y, atol=2e-14)
    np.testing.assert_allclose(fx, -3.0 + 5.0 * y, atol=1e-13)
    np.testing.assert_allclose(fy, 1.0 + 5.0 * x, atol=1e-13)


def test_a_spline_is_exact_for_bicubic_functions():
    def f(x, y):
        return (1.0 + x - 2.0 * x**2 + 0.5 * x**3) * (2.0 - y + y**2 - 3.0 * y**3)

    table = Table2(X, Y, grid(f), "spline")
    x, y = np.meshgrid(AT, np.linspace(-1.0, 1.0, 7), indexing="ij")
    found, fx, fy = table.derivatives_at(x, y)
    np.testing.assert_allclose(found, f(x, y), atol=1e-12)
    np.testing.assert_allclose(
        fx, (1.0 - 4.0 * x + 1.5 * x**2) * (2.0 - y + y**2 - 3.0 * y**3), atol=1e-12
    )
    np.testing.assert_allclose(
        fy, (1.0 + x - 2.0 * x**2 + 0.5 * x**3) * (-1.0 + 2.0 * y - 9.0 * y**2), atol=1e-12
    )


def test_a_spline_is_that_of_scipy():
    """FITPACK's interpolating bicubic spline drops the knots next to the ends: not-a-knot."""
    table = Table2(X, Y, grid(wavy), "spline")
    theirs = RectBivariateSpline(X, Y, grid(wavy), kx=3, ky=3, s=0)
    y = np.linspace(-1.0, 1.0, 9)
    np.testing.assert_allclose(table(AT[:, None], y), theirs(AT, y), atol=1e-12)
    _, fx, fy = table.derivatives_at(AT[:, None], y)
    np.testing.assert_allclose(fx, theirs(AT, y, dx=1), atol=1e-11)
    np.testing.assert_allclose(fy, theirs(AT, y, dy=1), atol=1e-11)


@pytest.mark.parametrize("kind", KINDS)
def test_along_grid_lines_it_is_the_table_there(kind):
    z = grid(wavy)
    table = Table2(X, Y, z, kind)
    for j, y in enumerate(Y):
        one = Table(X, z[:, j], interpolation=kind)
        np.testing.assert_allclose(table(AT, y), one(AT), atol=1e-13)
        inner = AT[~np.isin(AT, X)]
        slopes = table.derivatives_at(inner, y)[1]
        np.testing.assert_allclose(slopes, one.derivatives(inner)[1], atol=1e-12)
    for i, x in enumerate(X):
        places = np.linspace(-1.0, 1.0, 11)
        one = Table(Y, z[i], interpolation=kind)
        np.testing.assert_allclose(table(x, places), one(places), atol=1e-13)


@pytest.mark.parametrize("kind", ("pchip", "spline"))
@given(x=st.sampled_from(X[1:-1].tolist()), y=st.floats(-1.0, 1.0), of=st.integers(0, 2))
def test_values_and_slopes_are_continuous_between_patches(kind, x, y, of):
    table = Table2(X, Y, grid(wavy), kind)
    left, right = (table.derivatives_at(x + step, y)[of] for step in (-1e-9, 1e-9))
    assert left == pytest.approx(right, abs=1e-6)


@settings(max_examples=50)
@given(st.lists(st.floats(-5.0, 5.0), min_size=20, max_size=20), st.sampled_from(KINDS))
def test_the_surface_meets_its_points(values, kind):
    z = np.reshape(values, (5, 4))
    np.testing.assert_allclose(Table2(X, Y, z, kind)(X[:, None], Y), z, atol=1e-12)


def test_derivatives_are_those_of_the_values():
    table = Table2(X, Y, grid(wavy), "pchip")
    x, y, h = 0.63, 0.21, 1e-6
    _, fx, fy = table.derivatives_at(x, y)
    assert fx == pytest.approx((table(x + h, y) - table(x - h, y)) / (2 * h), abs=1e-8)
    assert fy == pytest.approx((table(x, y + h) - table(x, y - h)) / (2 * h), abs=1e-8)


def test_outside_the_grid():
    z = grid(wavy)
    with says(ModelError, "Table2: the table covers x from 0 to 2", "(2.5, 0)", 'outside="hold"'):
        Table2(X, Y, z)([1.0, 2.5], 0.0)
    Table2(X, Y, z)(2.0 + 1e-10, 1.0 + 1e-10)  # rounding does not leave it
    hold = Table2(X, Y, z, "spline", outside="hold")
    assert hold(3.0, 0.2) == hold(2.0, 0.2) and hold(-1.0, 9.0) == hold(0.0, 1.0)
    assert hold.derivatives_at(3.0, 0.2)[1:] == (0.0, hold.derivatives_at(2.0, 0.2)[2])
    line = Table2(X, Y, z, "spline", outside="line")
    f, fx, fy = line.derivatives_at(2.0, 1.0)
    assert line(2.5, 1.25) == pytest.approx(f + 0.5 * fx + 0.25 * fy, rel=1e-14)


# -- curves in formulas ---------------------------------------------------------------------------

SPEED = Table(
    ["0 rpm", "600 rpm", "1200 rpm"], ["20 N*m", "15 N*m", "0 N*m"], interpolation="linear"
)
ENGINE = Table2(
    ["0 rad/s", "100 rad/s"], [0, 1], [["0 N*m", "10 N*m"], ["0 N*m", "6 N*m"]], outside="hold"
)


def wheel(*loads, inertia=0.02, **how):
    machine = Mechanism("a wheel", **how)
    machine.add(Body("wheel", mass=1.0, inertia=inertia), Revolute("O", "ground", "wheel"))
    machine.add(*loads)
    return machine


def test_a_motor_follows_its_curve():
    """On the first straight line T = T₀ − k ω: ω = T₀/k (1 − e^(−k t/J)); ratio 4."""
    drive = Torque("drive", "wheel", value="4*motor(4*wheel.omega)")
    run = simulate(wheel(drive, inertia=8.0, curves={"motor": SPEED}), 1.0, rtol=1e-12, instants=11)
    slope = 5.0 / (20.0 * math.pi)
    decay = 16.0 * slope / 8.0
    expected = 5.0 / slope * (1.0 - np.exp(-decay * run.t))
    np.testing.assert_allclose(run["wheel"].omega, expected, rtol=1e-10, atol=1e-12)
    assert run.energy.error < 1e-10


def test_a_curve_of_two_variables():
    """At full throttle T = 10 − 0.04 ω, at half of it half as much."""
    for throttle in (1.0, 0.5):
        drive = Torque("drive", "wheel", value="engine(wheel.omega, throttle)")
        machine = Mechanism("a wheel", curves={"engine": ENGINE})
        machine.add(Input("throttle", throttle))
        machine.add(Body("wheel", mass=1.0, inertia=0.5), Revolute("O", "ground", "wheel"), drive)
        run = simulate(machine, 2.0, rtol=1e-12, instants=5)
        expected = 250.0 * (1.0 - np.exp(-0.08 * throttle * run.t))
        np.testing.assert_allclose(run["wheel"].omega, expected, rtol=1e-10, atol=1e-10)


def test_curves_of_time_and_of_parameters():
    """A curve of t alone, and one of a parameter, which is a number."""
    drive = Torque("drive", "wheel", value="ramp(t) + 2*ramp(late)")
    curves = {"ramp": Table(["0 s", "1 s"], ["0 N*m", "3 N*m"], interpolation="linear")}
    machine = wheel(drive, curves=curves, parameters={"late": "0.5 s"})
    run = simulate(machine, 1.0, rtol=1e-11, instants=6)
    np.testing.assert_allclose(run.load("drive").torque, 3.0 * run.t + 3.0, rtol=1e-13)
    other = wheel(Torque("drive", "wheel", value="2*ramp(0.5 s)"), curves=curves)
    assert other["drive"].value(0.0) == 3.0


def test_any_law_may_be_a_curve():
    drive = Torque("drive", "wheel", value="line(wheel.omega)")
    machine = wheel(drive, inertia=1.0, curves={"line": ConstantSpeed(2.0, -1.0)})
    run = simulate(machine, 1.0, rtol=1e-12, instants=3)
    np.testing.assert_allclose(run["wheel"].omega, 2.0 * (1.0 - np.exp(-run.t)), atol=1e-11)
