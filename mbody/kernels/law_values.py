"""Laws of what the position gives, lane by lane: they have branches that lanes cannot take."""

from __future__ import annotations

import math

import numpy as np

from mbody.core.callbacks import call_user
from mbody.core.decorators import inline, njit
from mbody.core.dual_number import value
from mbody.core.duals import chained, constant, entry, lane_at, put_entry, rounds
from mbody.core.lanes import ld, st
from mbody.laws.kernels import USER, built_in

__all__ = ["STEP", "law_at", "law_of_direction"]

TURN = 2.0 * math.pi
#: Step of differences of users' functions, as a part of what is varied: their error is of its
#: fourth power.
STEP = 1e-3


@inline
def law_at(L, W, n, lane, x):
    """(f, f′, f″) of law n at x in one lane; NaN where a user's function raised."""
    code = L.law_kind[n]
    if code == USER:
        return user_law(L, W, n, x)
    size, k = L.law_count[n], L.law_table[n]
    return built_in(code, W.par, L.law_par[n], size, lane, L.table, k, x)


@inline
def law_of_direction(L, W, w, n, x, y):
    """(f, f′, f″) of law n at the angle of the vector (x, y), 0 … 2π."""
    st(W.scratch, 0, x, w)
    st(W.scratch, 1, y, w)
    around(L, W, w, n)
    return ld(W.scratch, 2, w), ld(W.scratch, 3, w), ld(W.scratch, 4, w)


@njit
def around(L, W, w, n):
    """Law n at the angle of scratch rows (0, 1), into rows 2 to 4."""
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        x = np.arctan2(entry(W.scratch, 1, lane), entry(W.scratch, 0, lane))
        f, f1, f2 = law_at(L, W, n, lane, x + TURN if x < 0.0 else x)
        put_entry(W.scratch, 2, f, lane)
        put_entry(W.scratch, 3, f1, lane)
        put_entry(W.scratch, 4, f2, lane)


@njit
def user_law(L, W, n, x):
    """(f, f′, f″) of a user's law at x; NaN where it raised. The derivative of f″ of a dual number
    is by differences of four places.
    """
    at = value(x)
    f, f1, f2 = called(L, W, n, at)
    slope = 0.0
    if not constant(x):
        h = STEP * max(abs(at), 1.0)
        _, _, far = called(L, W, n, at + 2.0 * h)
        _, _, near = called(L, W, n, at + h)
        _, _, back = called(L, W, n, at - h)
        _, _, first = called(L, W, n, at - 2.0 * h)
        slope = (8.0 * (near - back) - (far - first)) / (12.0 * h)
    return chained(f, f1, x), chained(f1, f2, x), chained(f2, slope, x)


@inline
def called(L, W, n, x):
    """What a user's law gives at x; NaN where it raised."""
    W.user_arguments[0] = x
    if call_user(L.law_handle[n], W.user_arguments[:1], W.user_results[:3]) != 0:
        return np.nan, np.nan, np.nan
    return W.user_results[0], W.user_results[1], W.user_results[2]
