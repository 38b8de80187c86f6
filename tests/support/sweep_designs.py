"""Mechanisms that are swept, a scatter of their lengths, and the comparison of two sweeps."""

from numpy.testing import assert_array_equal

from mbody import makers
from mbody.sweeps import Normal, Uniform, monte_carlo

CRANK, ROD, SPEED = 1.0, 3.0, 10.0


def slider_crank(crank=CRANK, rod=ROD):
    return makers.slider_crank(crank, rod, masses=(1.0, 2.0, 3.0), speed=SPEED)


def four_bar():
    return makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=SPEED)


def scattered(count=700):
    # one in some hundred cannot turn, and goes alone
    names = {"crank.A.x": Normal(deviation=0.2), "coupler.mass": Uniform(1.0)}
    return monte_carlo(names, count, seed=9)


def same(one, other):
    assert one.failures == other.failures
    for name in one.names:
        assert_array_equal(one[name], other[name])
