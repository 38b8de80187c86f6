"""LU of the square Φ_q with fixed pivots: the fast way of the lanes (see `mbody.system.pivoting`).

Where the drivers determine everything Φ_q is square, and P Φ_q Q = L U with permutations P, Q that
are chosen once. Velocities and accelerations solve Φ_q v = ν and Φ_q a = γ, reactions Φ_qᵀ λ =
f − M a. One motion solves by LDLᵀ of S instead (`mbody.kernels.position_velocity`), which bears
redundant rows and every position: 130 ns a position of a four-bar on lanes, this LU 100.

Sums run over rows of L and columns of U, so that each number is written once: lanes would wait for
numbers that are written and read again.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import njit
from mbody.core.lanes import ld, st

__all__ = [
    "Square",
    "SquareWork",
    "factor_square",
    "solve_both",
    "solve_both_transposed",
    "solve_square",
    "solve_transposed",
]


class Square(Bundle):
    """Index lists of one pattern of pivots; numbers are rows of `SquareWork.factor`.

    A place is the number of a pivot; a row is one on nodes, a column one on slots.
    """

    # numbers of the blocks that go into F, where, and what only elimination fills
    source: Ints
    target: Ints
    fill: Ints
    # pivots in order, and which are ±1 for good
    pivot: Ints
    unit: Ints
    # below each pivot: numbers and their rows
    low_start: Ints
    low: Ints
    low_row: Ints
    # what each of these changes, by which number of the pivot's row
    change_start: Ints
    change: Ints
    change_by: Ints
    # left of each pivot: numbers and places of their columns
    left_start: Ints
    left: Ints
    left_place: Ints
    # right of each pivot: numbers and their columns
    up_start: Ints
    up: Ints
    up_column: Ints
    # above each pivot: numbers and places of their rows
    above_start: Ints
    above: Ints
    above_place: Ints
    # row and column of each pivot
    row: Ints
    column: Ints
    # numbers of the blocks in the column of each pivot, and their rows
    entry_start: Ints
    entry: Ints
    entry_row: Ints
    # diagonal blocks that vary: the pivots of each that are no constants; by what their product's
    # inverse goes into the block's determinant, with the sign of the exchanges and without units
    group_start: Ints
    group: Ints
    scale: Floats


class SquareWork(Bundle):
    """Numbers of the LU in all lanes."""

    factor: Rows  # (pattern, lanes)
    x: Rows  # (2·places, lanes): two right-hand sides


@njit
def factor_square(P, W, w, F):
    """F.factor ← L and U of the blocks, pivots inverted; returns the growth, the sum of squares of
    the multipliers of elimination (L).
    """
    A = F.factor
    for n in range(P.source.shape[0]):
        st(A, P.target[n], ld(W.block, P.source[n], w), w)
    for n in range(P.fill.shape[0]):
        st(A, P.fill[n], 0.0, w)
    growth = 0.0 * ld(W.size, 0, w)
    for k in range(P.pivot.shape[0]):
        p = ld(A, P.pivot[k], w)
        if P.unit[k] == 0:
            p = 1.0 / p
            st(A, P.pivot[k], p, w)
        for a in range(P.low_start[k], P.low_start[k + 1]):
            low = ld(A, P.low[a], w) * p
            st(A, P.low[a], low, w)
            growth = growth + low * low
            for b in range(P.change_start[a], P.change_start[a + 1]):
                o = P.change[b]
                st(A, o, ld(A, o, w) - low * ld(A, P.change_by[b], w), w)
    return growth


@njit
def solve_square(P, W, w, F, c, u):
    """u ← Φ_q⁻¹ c, from nodes to columns."""
    size = P.pivot.shape[0]
    A, x = F.factor, F.x
    for k in range(size):
        y = ld(c, P.row[k], w)
        for a in range(P.left_start[k], P.left_start[k + 1]):
            y = y - ld(A, P.left[a], w) * ld(x, P.left_place[a], w)
        st(x, k, y, w)
    for m in range(size):
        k = size - 1 - m
        y = ld(x, k, w)
        for a in range(P.up_start[k], P.up_start[k + 1]):
            y = y - ld(A, P.up[a], w) * ld(u, P.up_column[a], w)
        st(u, P.column[k], y * ld(A, P.pivot[k], w), w)


@njit
def solve_both(P, W, w, F, c, u, d, v):
    """u ← Φ_q⁻¹ c and v ← Φ_q⁻¹ d at once."""
    size = P.pivot.shape[0]
    A, x = F.factor, F.x
    for k in range(size):
        y, z = ld(c, P.row[k], w), ld(d, P.row[k], w)
        for a in range(P.left_start[k], P.left_start[k + 1]):
            f, n = ld(A, P.left[a], w), P.left_place[a]
            y = y - f * ld(x, n, w)
            z = z - f * ld(x, size + n, w)
        st(x, k, y, w)
        st(x, size + k, z, w)
    for m in range(size):
        k = size - 1 - m
        y, z, p = ld(x, k, w), ld(x, size + k, w), ld(A, P.pivot[k], w)
        for a in range(P.up_start[k], P.up_start[k + 1]):
            f, n = ld(A, P.up[a], w), P.up_column[a]
            y = y - f * ld(u, n, w)
            z = z - f * ld(v, n, w)
        st(u, P.column[k], y * p, w)
        st(v, P.column[k], z * p, w)


@njit
def solve_both_transposed(P, W, w, F, c, u, d, v):
    """u ← Φ_q⁻ᵀ c and v ← Φ_q⁻ᵀ d at once."""
    size = P.pivot.shape[0]
    A, x = F.factor, F.x
    for k in range(size):
        y, z = ld(c, P.column[k], w), ld(d, P.column[k], w)
        for a in range(P.above_start[k], P.above_start[k + 1]):
            f, n = ld(A, P.above[a], w), P.above_place[a]
            y = y - f * ld(x, n, w)
            z = z - f * ld(x, size + n, w)
        p = ld(A, P.pivot[k], w)
        st(x, k, y * p, w)
        st(x, size + k, z * p, w)
    for m in range(size):
        k = size - 1 - m
        y, z = ld(x, k, w), ld(x, size + k, w)
        for a in range(P.low_start[k], P.low_start[k + 1]):
            f, n = ld(A, P.low[a], w), P.low_row[a]
            y = y - f * ld(u, n, w)
            z = z - f * ld(v, n, w)
        st(u, P.row[k], y, w)
        st(v, P.row[k], z, w)


@njit
def solve_transposed(P, W, w, F, c, u):
    """u ← Φ_q⁻ᵀ c, from columns to nodes."""
    size = P.pivot.shape[0]
    A, x = F.factor, F.x
    for k in range(size):
        y = ld(c, P.column[k], w)
        for a in range(P.above_start[k], P.above_start[k + 1]):
            y = y - ld(A, P.above[a], w) * ld(x, P.above_place[a], w)
        st(x, k, y * ld(A, P.pivot[k], w), w)
    for m in range(size):
        k = size - 1 - m
        y = ld(x, k, w)
        for a in range(P.low_start[k], P.low_start[k + 1]):
            y = y - ld(A, P.low[a], w) * ld(u, P.low_row[a], w)
        st(u, P.row[k], y, w)
