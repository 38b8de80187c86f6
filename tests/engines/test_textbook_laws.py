"""Laws of tables and cams as the checking engines have them, beside those of the kernels."""

import numpy as np
import pytest

from mbody.engines.independent_reading import law_by_formula
from mbody.errors import ModelError
from mbody.laws import Cam, Dwell, Rise, Table
from mbody.laws.kernels import SHAPES


def same(law, places):
    second = law_by_formula(law)
    assert second is not law
    for x in places.tolist():
        try:
            ours = law.derivatives(x)
        except ModelError:  # outside
            ours = np.full(3, np.nan)
        np.testing.assert_allclose(second.derivatives(x), ours, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("count", [2, 3, 7])
@pytest.mark.parametrize("between", ["hold", "linear", "pchip", "spline", None])
def test_tables(between, count):
    rng = np.random.default_rng(count)
    x, y = np.sort(rng.uniform(0.0, 3.0, count)), rng.normal(size=count)
    for outside in ("error", "hold", "line"):
        same(Table(x, y, outside=outside, interpolation=between), rng.uniform(-0.5, 3.5, 20))
    if count > 2 and between not in ("hold", None):
        closed = Table(x, np.append(y[:-1], y[0]), periodic=True, interpolation=between)
        same(closed, rng.uniform(-5.0, 8.0, 20))


@pytest.mark.parametrize("end", ["natural", "clamped"])
def test_ends_of_splines(end):
    rng = np.random.default_rng(1)
    table = Table(np.arange(6.0), rng.normal(size=6), end=end, outside="line")
    same(table, rng.uniform(-1.0, 6.0, 30))


@pytest.mark.parametrize("shape", SHAPES)
def test_rises_and_cams(shape):
    places = np.random.default_rng(2).uniform(-3.0, 7.0, 40)
    same(Rise(shape, 2.0, 0.3, 1.1, 0.4), places)
    back = Rise("3-4-5", -2.0, 0.0, 1.0)
    same(Cam([Rise(shape, 2.0, 0.1, 1.0, 0.3), Dwell(0.5), back], period=4.0), places)
