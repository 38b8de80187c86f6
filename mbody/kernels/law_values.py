"""Laws of what the position gives, lane by lane: they have branches that lanes cannot take."""

from __future__ import annotations

import math

import numpy as np

from mbody.core.callbacks import call_user
from mbody.core.decorators import inline, njit
from mbody.core.lanes import count, ld, st
from mbody.laws.kernels import USER, built_in

__all__ = ["law_at", "law_of_direction"]

TURN = 2.0 * math.pi


@inline
def law_at(L, W, n, lane, x):
    """(f, f′, f″) of law n at x in one lane; NaN where a user's function raised."""
    code = L.law_kind[n]
    if code == USER:
        W.user_arguments[0] = x
        if call_user(L.law_handle[n], W.user_arguments[:1], W.user_results[:3]) != 0:
            return np.nan, np.nan, np.nan
        return W.user_results[0], W.user_results[1], W.user_results[2]
    size, k = L.law_count[n], L.law_table[n]
    return built_in(code, W.par, L.law_par[n], size, lane, L.table, k, x)


@inline
def law_of_direction(L, W, w, n, x, y):
    """(f, f′, f″) of law n at the angle of the vector (x, y), 0 … 2π."""
    st(W.scratch, 0, x, w)
    st(W.scratch, 1, y, w)
    around(L, W, n, count(w))
    return ld(W.scratch, 2, w), ld(W.scratch, 3, w), ld(W.scratch, 4, w)


@njit
def around(L, W, n, lanes):
    """Law n at the angle of scratch rows (0, 1), into rows 2 to 4."""
    for lane in range(lanes):
        x = math.atan2(W.scratch[1, lane], W.scratch[0, lane])
        f, f1, f2 = law_at(L, W, n, lane, x + TURN if x < 0.0 else x)
        W.scratch[2, lane] = f
        W.scratch[3, lane] = f1
        W.scratch[4, lane] = f2
