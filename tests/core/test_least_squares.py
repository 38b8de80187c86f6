"""The least sum of squares beside closed forms, and multipliers without negative ones."""

import numpy as np
import pytest

from mbody.core.least_squares import least_squares, nonnegative
from mbody.errors import ModelError


def rosenbrock(x):
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def slopes(x):
    return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
def test_a_curved_valley_in_any_unit(unit):
    sizes = np.array([unit, 1.0 / unit])
    found = least_squares(
        lambda x: rosenbrock(x / sizes), lambda x: slopes(x / sizes) / sizes, [-1.2, 1.0] * sizes
    )
    assert found.settled
    assert found.x / sizes == pytest.approx([1.0, 1.0], abs=1e-12)
    assert found.cost == pytest.approx(0.0, abs=1e-28)


def test_a_bound_and_a_number_that_is_held():
    """On x = 0.5 the least is y = x²; where y = 0 is held, 200 x³ + x = 1 (of one real root)."""
    low, high = np.array([-2.0, -2.0]), np.array([0.5, 2.0])
    found = least_squares(rosenbrock, slopes, np.array([-1.2, 1.0]), (low, high))
    assert found.x[0] == 0.5
    assert found.x[1] == pytest.approx(0.25, abs=1e-12)
    low[1] = high[1] = 0.0
    found = least_squares(rosenbrock, slopes, np.array([-1.2, 0.0]), (low, high))
    roots = np.roots([200.0, 0.0, 1.0, -1.0])
    assert found.x == pytest.approx([roots[np.abs(roots.imag) < 1e-12].real[0], 0.0], abs=1e-7)


@pytest.mark.parametrize("refused", [True, False])
def test_a_place_without_a_value_makes_steps_shorter(refused):
    """ln x = 2 from x = 40: the first step goes below zero."""
    seen = []

    def residual(x):
        seen.append(x[0])
        if x[0] <= 0.0:
            if refused:
                raise ModelError("x is positive")
            return np.array([np.nan])
        return np.log(x) - 2.0

    found = least_squares(residual, lambda x: np.array([1.0 / x]), np.array([40.0]))
    assert min(seen) < 0.0
    assert found.settled
    assert found.x[0] == pytest.approx(np.exp(2.0), rel=1e-12)


def test_what_is_not_negative():
    """Of columns at a right angle the projections, none for negative ones and for no column."""
    rotation = np.array([[0.6, -0.8], [0.8, 0.6]])
    columns = np.column_stack([1e6 * rotation[:, 0], 1e-6 * rotation[:, 1], np.zeros(2)])
    found = nonnegative(columns, rotation @ [3.0, 2.0])
    assert found == pytest.approx([3e-6, 2e6, 0.0], rel=1e-14)
    assert nonnegative(columns, rotation @ [3.0, -2.0]) == pytest.approx([3e-6, 0.0, 0.0])
