"""Walks on plane curves that are known in closed form."""

import math

import numpy as np
import pytest

from mbody.core.arclength import CurvePoint, Pace, walk, zero_on

PACE = Pace(0.01, 0.2, 1e-9, 0.2, leap=1e-7)


def plane(function, gradient):
    """`close` of the curve function = 0, by Newton steps of least norm."""

    def close(_, x, ahead):
        for _ in range(20):
            g = gradient(x)
            x = x - function(x) * g / (g @ g)
        g = gradient(x) / np.linalg.norm(gradient(x))
        along = np.array([-g[1], g[0]])
        along = along if along @ ahead >= 0.0 else -along
        return CurvePoint(x, along, float(np.sign(g[0] * along[1] - g[1] * along[0])), None)

    return close


def hyperbola(gap):
    """Two branches of xy = gap that come within √(2 gap) of where they would cross."""
    return plane(lambda x: x[0] * x[1] - gap, lambda x: x[::-1])


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_the_branch_is_followed_round_a_near_crossing(gap):
    """Straight on is the other branch, with the same direction: its side alone is another."""
    close = hyperbola(gap)
    start = close(None, np.array([2.0, gap / 2.0]), np.array([-1.0, 0.0]))
    for n, (_, there, leapt) in enumerate(walk(start, close, PACE)):
        assert not leapt and there.x.min() > 0.0 and n < 500
        if there.x[1] > 2.0:
            return
    pytest.fail("it does not come round")


def test_a_crossing_is_told():
    """The axes themselves: straight on, and said once."""
    close = hyperbola(0.0)
    start = close(None, np.array([2.0, 0.0]), np.array([-1.0, 0.0]))
    told = []
    for here, there, leapt in walk(start, close, PACE):
        if leapt:
            told.append((here.x[0], there.x[0]))
        if there.x[0] < -2.0:
            break
    (before, after) = told[0]
    assert len(told) == 1 and -1e-7 < after < 0.0 < before < 1e-7


def test_a_turning_point_of_a_circle():
    """x is greatest at (5, 0), y at (0, 5): located to rounding; all steps turn within the pace."""
    close = plane(lambda x: x @ x - 25.0, lambda x: 2.0 * x)
    start, found = close(None, np.array([3.0, -4.0]), np.array([1.0, 1.0])), []
    for here, there, _ in walk(start, close, PACE):
        assert math.acos(min(1.0, here.along @ there.along)) <= PACE.turn
        for axis in (0, 1):
            if here.along[axis] * there.along[axis] < 0.0:

                def rate(point, axis=axis):
                    return float(point.along[axis])

                found.append(zero_on(close, here, there, rate, 1e-15)[0].x)
        if len(found) == 2:
            break
    assert np.abs(np.array(found) - [[5.0, 0.0], [0.0, 5.0]]).max() < 1e-14


def test_a_corner_ends_the_walk():
    """Nothing goes on straight from the tip of a cusp, y² = x³."""
    close = plane(lambda x: x[1] ** 2 - x[0] ** 3, lambda x: np.array([-3 * x[0] ** 2, 2 * x[1]]))
    start = close(None, np.array([1.0, 1.0]), np.array([-1.0, -1.0]))
    points = [there.x for _, there, _ in walk(start, close, PACE)]
    assert len(points) < 300 and np.linalg.norm(points[-1]) < 1e-2


def test_a_step_that_is_thrown_back_to_where_it_begins_is_none():
    """As where a distance passes zero: its direction turns over, and leads back to the corner."""
    corner = CurvePoint(np.array([1.0, 2.0]), np.array([1.0, 0.0]), 1.0, None)
    assert next(walk(corner, lambda here, x, ahead: here, PACE), None) is None
