"""Laws from tables against scipy's spline and their own definitions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from mbody.errors import ModelError
from mbody.laws import Table, law

PI = math.pi


@pytest.mark.parametrize("end", ["natural", "not-a-knot", "clamped", "periodic"])
@pytest.mark.parametrize("n", [2, 3, 4, 5, 12])
def test_spline_against_scipy(end, n):
    rng = np.random.default_rng(n)
    x = np.cumsum(rng.uniform(0.1, 1.0, n)) - 2.0
    y = rng.normal(size=n)
    if end == "periodic":
        y[-1] = y[0]
        table = Table(x, y, periodic=True)
    else:
        table = Table(x, y, end=end)
    oracle = CubicSpline(x, y, bc_type=end)
    at = np.concatenate([x, np.linspace(x[0], x[-1], 201)])
    for order, found in enumerate(table.derivatives(at)):
        expected = oracle(at, order)
        size = max(1.0, np.max(np.abs(expected)))
        if end == "periodic":  # at the very end scipy gives the end, here it is the beginning
            assert found[-1] == pytest.approx(expected[0], abs=1e-12 * size)
        np.testing.assert_allclose(found, expected, atol=1e-11 * size)


def test_periodic_table_repeats():
    x = np.linspace(0.3, 1.3, 41)
    table = Table(x, np.sin(2 * PI * x), periodic=True)
    t = np.linspace(-3.0, 5.0, 77)
    for found, expected in zip(
        table.derivatives(t),
        (np.sin(2 * PI * t), 2 * PI * np.cos(2 * PI * t), -4 * PI**2 * np.sin(2 * PI * t)),
        strict=True,
    ):
        # error of f'' of a cubic spline: h²/12 max f⁗ = 5e-5 × (2π)⁴ = 0.08 of 39
        np.testing.assert_allclose(found, expected, atol=0.003 * np.max(np.abs(expected)))


def test_outside_a_table():
    x, y = [0.0, 0.1, 0.2], [1.0, 2.0, 4.0]
    strict = Table(x, y)
    with pytest.raises(ModelError, match=r"the table covers 0 to 0\.2, but 0\.31 was requested"):
        strict(np.array([0.1, 0.31, 0.5]))
    # 0.2 as a time that was summed up is still inside
    assert strict(0.2 * (1 + 1e-10)) == pytest.approx(4.0, abs=1e-8)
    empty = np.empty((0, 1))
    tab = strict.table()
    assert np.isnan(law(strict.code, empty, 0, 0, 0, tab, 0, 0.31)).all()
    assert np.isnan(law(strict.code, empty, 0, 0, 0, tab, 0, math.nan)).all()
    hold, line = Table(x, y, outside="hold"), Table(x, y, outside="line")
    assert hold.derivatives(-1.0) == (1.0, 0.0, 0.0) and hold.derivatives(9.0) == (4.0, 0.0, 0.0)
    end = line.derivatives(0.2)
    assert line.derivatives(0.3) == pytest.approx((4.0 + 0.1 * end[1], end[1], 0.0))


@given(
    steps=st.lists(st.floats(0.01, 10.0), min_size=1, max_size=30),
    data=st.data(),
    end=st.sampled_from(["natural", "not-a-knot", "clamped", "periodic"]),
)
@settings(max_examples=80)
def test_a_spline_meets_its_points_and_is_smooth(steps, data, end):
    x = np.concatenate([[0.0], np.cumsum(steps)])
    values = st.floats(-100.0, 100.0)
    y = np.array(data.draw(st.lists(values, min_size=x.size, max_size=x.size)))
    if end == "periodic":
        y[-1] = y[0]
        table = Table(x, y, periodic=True)
    else:
        table = Table(x, y, end=end)
    np.testing.assert_allclose(table(x), y, atol=1e-9)
    c = table.table()[2 + x.size :].reshape(-1, 4)
    h = np.diff(x)
    f1 = c[:, 1] + h * (2 * c[:, 2] + 3 * h * c[:, 3])
    f2 = 2 * c[:, 2] + 6 * h * c[:, 3]
    size1, size2 = np.max(np.abs(c[:, 1])) + 1, np.max(np.abs(2 * c[:, 2])) + 1
    np.testing.assert_allclose(f1[:-1], c[1:, 1], atol=1e-9 * size1)
    np.testing.assert_allclose(
        f2[:-1], 2 * c[1:, 2], atol=1e-9 * size2 + 1e-12 * 200 / h.min() ** 2
    )
    if end == "periodic":
        assert f1[-1] == pytest.approx(c[0, 1], abs=1e-9 * size1)
