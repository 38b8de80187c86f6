"""LU of the square Φ_q with fixed pivots: the fast method of the lanes (see
`mbody.system.pivoting`).

Where the drivers determine everything Φ_q is square, and P Φ_q Q = L U with permutations P, Q that
are chosen once. Velocities and accelerations solve Φ_q v = ν and Φ_q a = γ, reactions Φ_qᵀ λ =
f − M a. One motion solves by LDLᵀ of S instead (`mbody.kernels.constraints`), which bears
redundant rows and every position: 130 ns a position of a four-bar on lanes, this LU 100.

Sums run over rows of L and columns of U, so that each number is written once: lanes would wait for
numbers that are written and read again.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import ld, st
from mbody.core.tolerances import PIVOT_NONE, PIVOT_THRESHOLD, TINY


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
    # what takes the units off their squares
    low_unit: Floats
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
    # row and column of each pivot, and what makes squares of rows those of lengths
    row: Ints
    column: Ints
    row_unit: Floats
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
    the multipliers of elimination (L), without units.
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
            growth = growth + low * low * P.low_unit[a]
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


# -- The search of the symbolic phase of the square Φ_q: its diagonal blocks, and its pivots ---
#
# Pivots go by Markowitz's rule with a threshold at several positions at once (Duff, Erisman & Reid,
# *Direct Methods for Sparse Matrices*, chapters 7 and 10). Only numbers that can be pivots are
# looked at: a column has the list of its rows, fill is appended. What depends on values is one
# number for each entry, renewed only in columns that the last pivot changed.
#
# Products are stored before they are added: a compiler that joined both in one operation would
# round otherwise, and ties of pivots would be decided by the processor.


class PivotSearch(Bundle):
    """A pattern of numbers at several positions, and what the search keeps of it."""

    # numbers by row and column, one row of the matrix after another, (size², positions); becomes
    # what elimination leaves
    numbers: Rows
    # by row and column: what is there, filled by the search; what is the same at every position,
    # and stays so; what may be a pivot
    pattern: Tables
    constant: Tables
    inside: Tables
    # pivots in their order, (size, 2): row and column; sum of squares of L at every position
    order: Tables
    growth: Floats
    # rows of each column; what each of its numbers is worth as a pivot; its greatest number
    rows_of: Tables  # (size, size)
    worth: Rows  # (size, size)
    greatest: Rows  # (size, positions)
    # of every column how many rows it has, whether it is open, whether its worth is to be renewed;
    # of every row how many numbers it has
    count: Ints
    open: Ints
    stale: Ints
    width: Ints
    # of every position: the least pivot, the multiplier, a product; of every column its best worth
    least: Floats
    factor: Floats
    product: Floats
    best: Floats


@kernel
def search_pivots(S: PivotSearch) -> int:
    """Pivots of least cost (rows − 1)(columns − 1) in order; returns how many there are, fewer than
    columns where a pivot is too small at one of the positions.

    Of equal cost constants come first, they need no division; then what is worth most.
    """
    size = S.count.shape[0]
    begin(S)
    for k in range(size):
        renew(S)
        row, column = cheapest(S)
        if row < 0:
            return k
        S.order[k, 0], S.order[k, 1] = row, column
        close_pivot(S, row, column)
        eliminate_column(S, row, column)
    return size


@njit
def begin(S):
    """Lists of the rows of all columns; everything is open."""
    size = S.count.shape[0]
    for n in range(size):
        S.count[n], S.width[n] = 0, 0
        S.open[n], S.stale[n] = 1, 1
    for c in range(size):
        for r in range(size):
            if S.pattern[r, c] != 0:
                S.rows_of[c, S.count[c]] = r
                S.count[c] += 1
                S.width[r] += 1
    for m in range(S.growth.shape[0]):
        S.growth[m] = 0.0


@njit
def renew(S):
    """Renews the values of the columns that have changed, at the worst of the positions, and the
    least pivots.
    """
    size, positions = S.count.shape[0], S.growth.shape[0]
    for m in range(positions):
        S.least[m] = 1.0
    for c in range(size):
        if S.open[c] == 0:
            continue
        if S.stale[c] != 0:
            S.stale[c] = 0
            value_column(S, c)
        for m in range(positions):
            S.least[m] = max(S.least[m], S.greatest[c, m])
    for m in range(positions):
        S.least[m] = PIVOT_NONE * S.least[m]


@njit
def value_column(S, c):
    """Values of the numbers of a column as pivots, and the greatest of them."""
    size, positions = S.count.shape[0], S.growth.shape[0]
    for m in range(positions):
        S.greatest[c, m] = 0.0
    for n in range(S.count[c]):
        at = S.rows_of[c, n] * size + c
        for m in range(positions):
            S.greatest[c, m] = max(S.greatest[c, m], abs(S.numbers[at, m]))
    S.best[c] = 0.0
    for n in range(S.count[c]):
        r = S.rows_of[c, n]
        part = math.inf
        for m in range(positions):
            part = min(part, abs(S.numbers[r * size + c, m]) / max(S.greatest[c, m], TINY))
        S.worth[c, n] = part
        if S.inside[r, c] != 0:
            S.best[c] = max(S.best[c], part)


@njit
def cheapest(S):
    """Row and column of the next pivot; −1 where there is none."""
    size = S.count.shape[0]
    limit = 0.0
    for c in range(size):
        if S.open[c] != 0:
            limit = max(limit, S.best[c])
    limit = min(PIVOT_THRESHOLD, limit)
    least, row, column, place = math.inf, -1, -1, size * size
    for c in range(size):
        if S.open[c] == 0:
            continue
        for n in range(S.count[c]):
            r = S.rows_of[c, n]
            if S.inside[r, c] == 0 or S.worth[c, n] < limit:
                continue
            key = (S.width[r] - 1) * (S.count[c] - 1) - 0.5 * S.constant[r, c]
            key -= 0.25 * S.worth[c, n]
            # of equal ones the first by rows
            first = key < least or (key == least and r * size + c < place)
            if first and is_there(S, r * size + c):
                least, row, column, place = key, r, c, r * size + c
    return row, column


@inline
def is_there(S, at):
    """Whether a number is more than rounding at every position."""
    there = True
    for m in range(S.least.shape[0]):
        there = there and abs(S.numbers[at, m]) > S.least[m]
    return there


@njit
def close_pivot(S, row, column):
    """Take the pivot's row out of all columns, and the pivot's column out of all rows."""
    S.open[column] = 0
    for c in range(S.count.shape[0]):
        if S.open[c] == 0 or S.pattern[row, c] == 0:
            continue
        S.stale[c] = 1
        last = S.count[c] - 1
        for n in range(last):
            if S.rows_of[c, n] == row:
                S.rows_of[c, n] = S.rows_of[c, last]
                break
        S.count[c] = last
    for n in range(S.count[column]):
        S.width[S.rows_of[column, n]] -= 1


@njit
def eliminate_column(S, row, column):
    """Take multiples of the pivot's row off the rows below; notes the growth and the fill."""
    size, positions = S.count.shape[0], S.growth.shape[0]
    for n in range(S.count[column]):
        i = S.rows_of[column, n]
        if i == row:
            continue
        for m in range(positions):
            S.factor[m] = S.numbers[i * size + column, m] / S.numbers[row * size + column, m]
            S.product[m] = S.factor[m] * S.factor[m]
        for m in range(positions):
            S.growth[m] += S.product[m]
        for c in range(size):
            if S.open[c] == 0 or S.pattern[row, c] == 0:
                continue
            S.constant[i, c] = 0
            if S.pattern[i, c] == 0:
                S.pattern[i, c] = 1
                S.rows_of[c, S.count[c]] = i
                S.count[c] += 1
                S.width[i] += 1
            for m in range(positions):
                S.product[m] = S.factor[m] * S.numbers[row * size + c, m]
            for m in range(positions):
                S.numbers[i * size + c, m] -= S.product[m]


@kernel
def divide_blocks(pattern: Tables, rows: Ints, columns: Ints, work: Tables) -> int:
    """Number of the diagonal block of every row and column, counted by their first columns; returns
    how many blocks there are, −1 where no transversal exists. work: (6, size).
    """
    size = rows.shape[0]
    # rows ← the column that is matched with each
    row_of = work[0]
    if not match(pattern, rows, row_of, work):
        return -1
    blocks = connect(pattern, row_of, columns, work)
    for c in range(size):
        rows[row_of[c]] = columns[c]
    return blocks


@njit
def match(pattern, column_of, row_of, work):
    """A transversal by augmenting paths, row_of[column], column_of[row]; whether there is one."""
    size = column_of.shape[0]
    seen, came, waiting = work[1], work[2], work[3]
    for n in range(size):
        row_of[n], column_of[n], seen[n] = -1, -1, -1
    for start in range(size):
        waiting[0] = start
        depth, end = 1, -1
        while depth > 0 and end < 0:
            depth -= 1
            row = waiting[depth]
            for column in range(size):
                if pattern[row, column] == 0 or seen[column] == start:
                    continue
                seen[column], came[column] = start, row
                if row_of[column] < 0:
                    end = column
                    break
                waiting[depth] = row_of[column]
                depth += 1
        if end < 0:
            return False
        while end >= 0:
            row = came[end]
            before = column_of[row]
            row_of[end], column_of[row] = row, end
            end = before
    return True


@njit
def connect(pattern, row_of, number, work):
    """Strongly connected parts of the graph of the columns, where c leads to those in its row
    (Tarjan's algorithm, without recursion): number ← that of each column's part; returns how many.
    """
    size = number.shape[0]
    found, low, path, stack, place = work[1], work[2], work[3], work[4], work[5]
    for c in range(size):
        found[c], number[c] = -1, -1
    visited, held = 0, 0
    for first in range(size):
        if found[first] >= 0:
            continue
        path[0], depth = first, 1
        while depth > 0:
            c = path[depth - 1]
            if found[c] < 0:
                found[c], low[c], place[c] = visited, visited, 0
                visited += 1
                stack[held] = c
                held += 1
            deeper = False
            while place[c] < size and not deeper:
                other = place[c]
                if pattern[row_of[c], other] != 0:
                    if found[other] < 0:
                        path[depth] = other
                        depth += 1
                        deeper = True
                        continue
                    if number[other] < 0:
                        low[c] = min(low[c], low[other])
                place[c] += 1
            if deeper:
                continue
            depth -= 1
            if low[c] == found[c]:
                # a part is whole; until they are counted, parts go by their last column
                while True:
                    held -= 1
                    number[stack[held]] = c
                    if stack[held] == c:
                        break
    # count the parts by their first columns
    for c in range(size):
        low[c] = -1
    parts = 0
    for c in range(size):
        if low[number[c]] < 0:
            low[number[c]] = parts
            parts += 1
        number[c] = low[number[c]]
    return parts
