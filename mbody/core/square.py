"""LU of the square Φ_q with fixed pivots: the fast way of the lanes (see `mbody.square`)."""

from __future__ import annotations

from typing import Any, NamedTuple

from mbody._jit import njit
from mbody._lanes import ld, st

__all__ = ["Square", "factor_square", "solve_square", "solve_transposed"]

Ints = Any  # int64 arrays, one-dimensional


class Square(NamedTuple):
    """Index lists of one pattern of pivots; numbers are rows of the array F (pattern, lanes)."""

    # numbers of the blocks that go into F, where, and what only elimination fills
    source: Ints
    target: Ints
    fill: Ints
    # pivots in order, and which are ±1 for good
    pivot: Ints
    unit: Ints
    # below each pivot: numbers, and place of their row
    low_start: Ints
    low: Ints
    low_row: Ints
    # what each of these changes, by which number of the pivot's row
    change_start: Ints
    change: Ints
    change_by: Ints
    # right of each pivot: numbers, and place of their column
    up_start: Ints
    up: Ints
    up_column: Ints
    # row on nodes and column on slots of each pivot
    row: Ints
    column: Ints


@njit
def factor_square(P, W, w, F):
    """F ← L and U of the blocks, pivots inverted; returns the sum of squares of L, the growth."""
    for n in range(P.source.shape[0]):
        st(F, P.target[n], ld(W.block, P.source[n], w), w)
    for n in range(P.fill.shape[0]):
        st(F, P.fill[n], 0.0, w)
    growth = 0.0 * ld(W.size, 0, w)
    for k in range(P.pivot.shape[0]):
        p = ld(F, P.pivot[k], w)
        if P.unit[k] == 0:
            p = 1.0 / p
            st(F, P.pivot[k], p, w)
        for a in range(P.low_start[k], P.low_start[k + 1]):
            low = ld(F, P.low[a], w) * p
            st(F, P.low[a], low, w)
            growth = growth + low * low
            for b in range(P.change_start[a], P.change_start[a + 1]):
                o = P.change[b]
                st(F, o, ld(F, o, w) - low * ld(F, P.change_by[b], w), w)
    return growth


@njit
def solve_square(P, W, w, F, x):
    """x ← Φ_q⁻¹ x: rows in the order of the pivots become columns in the order of the pivots."""
    size = P.pivot.shape[0]
    for k in range(size):
        y = ld(x, k, w)
        for a in range(P.low_start[k], P.low_start[k + 1]):
            r = P.low_row[a]
            st(x, r, ld(x, r, w) - ld(F, P.low[a], w) * y, w)
    for m in range(size):
        k = size - 1 - m
        y = ld(x, k, w)
        for a in range(P.up_start[k], P.up_start[k + 1]):
            y = y - ld(F, P.up[a], w) * ld(x, P.up_column[a], w)
        st(x, k, y * ld(F, P.pivot[k], w), w)


@njit
def solve_transposed(P, W, w, F, x):
    """x ← Φ_q⁻ᵀ x: columns in the order of the pivots become rows in the order of the pivots."""
    size = P.pivot.shape[0]
    for k in range(size):
        y = ld(x, k, w) * ld(F, P.pivot[k], w)
        st(x, k, y, w)
        for a in range(P.up_start[k], P.up_start[k + 1]):
            c = P.up_column[a]
            st(x, c, ld(x, c, w) - ld(F, P.up[a], w) * y, w)
    for m in range(size):
        k = size - 1 - m
        y = ld(x, k, w)
        for a in range(P.low_start[k], P.low_start[k + 1]):
            y = y - ld(F, P.low[a], w) * ld(x, P.low_row[a], w)
        st(x, k, y, w)
