"""Guards of steps that are watched in one kernel, and their first zeros, against plain formulas."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from mbody.kernels.contact_guards import (
    CLOSE,
    LOOKS,
    PARADOX,
    SLIP,
    STOP,
    fourth_difference,
    is_quiet,
    node,
    quiet_by_ends,
)
from mbody.kernels.guard_zeros import NO_ZERO, first_guard, first_zero, slope

#: Gaps up to this are none.
NONE = 1e-10


def looked_at(kind, value, rate=None, past=None, past_rate=None):
    """Looks at one guard by functions of the part of a step of length 1."""
    at = [node(m) for m in range(LOOKS)]

    def table(of, otherwise):
        return np.array([[otherwise if of is None else of(x)] for x in at])

    gap, beyond = table(value, 0.0), table(past, -math.inf)
    return SimpleNamespace(
        count=[1],
        kind=[kind],
        value=np.maximum(gap, beyond),
        gap=gap,
        rate=table(rate, math.nan),
        past=beyond,
        past_rate=table(past_rate, 0.0),
        fresh=np.zeros(1),
        seen=-np.ones(1),
        events=SimpleNamespace(
            direction=np.zeros(0), number=np.array([1.0, 0.0, 1.0, 0.0, 0.1, 0.1])
        ),
    )


def test_what_stays_clear_of_zero_is_quiet():
    still = looked_at(STOP, lambda x: 2.0 + 0.1 * x, lambda x: 0.1)
    assert quiet_by_ends(still, 1.0, NONE)
    assert is_quiet(still, 0, 1.0, NONE)
    assert first_zero(still, 0, 1.0, NONE) == NO_ZERO


@pytest.mark.parametrize("depth", [0.9, 1.1, 3.0])
def test_a_dip_between_the_ends_is_never_quiet(depth):
    """Both ends are alike, a parabola between them comes near to zero or passes it."""
    dips = looked_at(
        STOP, lambda x: 1.0 - 4.0 * depth * x * (1.0 - x), lambda x: 4.0 * depth * (2.0 * x - 1.0)
    )
    assert not quiet_by_ends(dips, 1.0, NONE)
    x = first_zero(dips, 0, 1.0, NONE)
    if depth < 1.0:
        assert x == NO_ZERO
    else:
        exact = 0.5 * (1.0 - math.sqrt(1.0 - 1.0 / depth))
        # the cubics are the parabola itself
        assert math.isclose(x, exact, abs_tol=1e-15)
        assert math.isclose(slope(dips, 0, 1.0, x), 4.0 * depth * (2.0 * x - 1.0), rel_tol=1e-8)


def test_forces_whose_rates_are_not_known():
    """Without rates: what five looks show, and what swings too fast for them."""
    falls = looked_at(SLIP, lambda x: 1.0 - 1.25 * x)
    assert math.isclose(first_zero(falls, 0, 1.0, NONE), 0.8, abs_tol=1e-14)
    assert first_guard(falls, 1.0, NONE)[0] == 0
    for turns in range(1, 60):
        swings = looked_at(
            SLIP, lambda x, turns=turns: 1.0 + 1.5 * math.cos(2 * math.pi * turns * x)
        )
        assert not is_quiet(swings, 0, 1.0, NONE), turns
        assert turns < 2 or first_zero(swings, 0, 1.0, NONE) < 0.0 or swings.value.min() < 0.0


def test_what_is_past_an_edge_closes_nothing():
    """A gap closes where what touches has come back over its edge, not where it is none before."""
    gap = {"value": lambda x: 0.3 - x, "rate": lambda x: -1.0}
    comes = looked_at(CLOSE, **gap, past=lambda x: 0.5 - x, past_rate=lambda x: -1.0)
    assert math.isclose(first_zero(comes, 0, 1.0, NONE), 0.5, abs_tol=1e-14)
    stays = looked_at(CLOSE, **gap, past=lambda x: 1.5 - x, past_rate=lambda x: -1.0)
    assert first_zero(stays, 0, 1.0, NONE) == NO_ZERO
    assert is_quiet(stays, 0, 1.0, NONE)


def test_what_is_well_behind_an_edge_closes_nothing():
    """What comes past the ends of an edge behind it meets nothing there, as a corner below a table;
    it does where the gap is none.
    """
    past = {"past": lambda x: 0.5 - x, "past_rate": lambda x: -1.0}
    behind = looked_at(CLOSE, lambda x: -0.3 - 0.1 * x, lambda x: -0.1, **past)
    assert behind.value.min() < 0.0 < behind.value.max()
    assert quiet_by_ends(behind, 1.0, NONE)
    assert is_quiet(behind, 0, 1.0, NONE)
    assert first_zero(behind, 0, 1.0, NONE) == NO_ZERO
    flush = looked_at(CLOSE, lambda x: -1e-16, lambda x: 0.0, **past)
    assert not quiet_by_ends(flush, 1.0, NONE)
    assert math.isclose(first_zero(flush, 0, 1.0, NONE), 0.5, abs_tol=1e-14)
    # it comes in front of the edge while it is past its ends, and then back over it
    front = looked_at(
        CLOSE,
        lambda x: 0.5 - 3.0 * (x - 0.5) ** 2,
        lambda x: 6.0 * (0.5 - x),
        past=lambda x: 0.4 - 4.0 * (x - 0.5) ** 2,
        past_rate=lambda x: 8.0 * (0.5 - x),
    )
    exact = 0.5 + math.sqrt(0.5 / 3.0)
    assert math.isclose(first_zero(front, 0, 1.0, NONE), exact, abs_tol=1e-14)


def test_a_determinant_may_jump_far_from_zero():
    jumps = looked_at(PARADOX, lambda x: 0.7 if x < 0.6 else 1.3)
    assert first_zero(jumps, 0, 1.0, NONE) == NO_ZERO
    near = looked_at(PARADOX, lambda x: 0.05 + x)
    assert first_zero(near, 0, 1.0, NONE) == NO_ZERO


def test_the_fourth_difference_is_that_of_even_looks():
    quartic = looked_at(SLIP, lambda x: 5.0 * x**4 - x**3 + 2.0 * x - 7.0)
    assert math.isclose(fourth_difference(quartic.value, 0), 5.0 * 24.0 / 256.0, rel_tol=1e-12)
