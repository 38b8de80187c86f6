"""Zeros in brackets, against closed forms."""

import math

import numpy as np
import pytest

from mbody.core.bracket import last_place, place_between, zero_between, zeros_between


@pytest.mark.parametrize(
    ("function", "low", "high", "zero"),
    [
        (lambda x: x * x - 2.0, 0.0, 2.0, math.sqrt(2.0)),
        (lambda x: 1e-3 - math.exp(x), -20.0, 1.0, math.log(1e-3)),
        (lambda x: math.copysign(1.0, x - 0.3), 0.0, 1.0, 0.3),
        (lambda x: -math.inf if x < 0.1 else x - 0.4, 1.0, 0.0, 0.4),
    ],
)
def test_zero_to_the_last_bits(function, low, high, zero):
    found = zero_between(function, (low, high), (function(low), function(high)))
    assert found.converged
    assert found.x == pytest.approx(zero, rel=4e-16)  # two units of the last digit
    assert function(found.above) >= 0.0


def test_many_brackets_have_the_zeros_of_each():
    squares = np.array([2.0, 3.0, 1e-9])
    none, far = np.zeros(3), np.full(3, 100.0)
    found = zeros_between(lambda x: x * x - squares, none, far, -squares, far**2 - squares, none)
    np.testing.assert_allclose([one.x for one in found], np.sqrt(squares), rtol=4e-16)


def test_search_ends_where_there_is_no_value_or_no_change_of_sign():
    assert not zero_between(lambda x: math.nan, (0.0, 1.0), (-1.0, 1.0)).converged
    assert not zero_between(lambda x: x, (1.0, 2.0), (1.0, 2.0)).converged


def test_last_place_and_place_on_a_curve():
    assert last_place(lambda x: x <= math.pi, 0.0, 10.0) == math.pi
    found, low, high = place_between(
        lambda x: (x, x - 1.0), lambda place: place[1], {3.0: (3.0, 2.0), 0.0: (0.0, -1.0)}, 1e-12
    )
    assert found[0] == pytest.approx(1.0, abs=1e-12)
    assert low[1] >= 0.0 > high[1] or found[1] == 0.0
