"""Linear programs of few unknowns: the greatest aim · x with A x ≤ b.

A simplex tableau of the unknowns alone: x, which are free, enter first and stay. Limits,
right sides and the aim are scaled by powers of two; x must be pure numbers. Of equal ratios the
lexicographically least leaves, so that it cannot cycle. What is returned solves the equations of
the limits that are active, and counts by its residuals alone: limits kept, multipliers that are not
negative and add up to the aim.

Dantzig, Orden, Wolfe: The generalized simplex method (1955).
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import LINEAR_PROGRAM_RESIDUAL, LINEAR_PROGRAM_ZERO, TINY
from mbody.kernels.complementarity import eliminate, power_of_two

#: Numbers in `LinearProgram.count`: of unknowns, of limits; exchanges that were made.
UNKNOWNS, LIMITS, EXCHANGED = range(3)
#: What was found; what is uncertain has residuals beyond rounding.
OPTIMAL, UNBOUNDED, INCONSISTENT, UNCERTAIN = range(4)
#: Exchanges at most, in parts of limits and unknowns.
EXCHANGES = 50
#: Numbers in `LinearProgram.number`: scales of b and of the aim, residual.
SCALE, AIM, RESIDUAL = range(3)


class LinearProgram(Bundle):
    """Memory of a program of at most n unknowns and m limits."""

    count: Ints
    aim: Floats
    A: Rows
    b: Floats
    x: Floats
    load: Floats  # multipliers of the limits
    number: Floats
    row: Floats  # scales of limits
    table: Rows  # (m + 1, n + 2): other unknowns and the artificial one, right sides; the gains
    basic: Ints  # (m,): x_0 …, slacks of the limits, the artificial one
    other: Ints  # (n + 1,)
    dense: Rows  # (n, n + 1)


def linear_program_memory(n: int, m: int) -> LinearProgram:
    """A program of at most n unknowns and m limits."""
    return LinearProgram(
        count=np.array([n, m, 0]), aim=np.zeros(n), A=np.zeros((m, n)), b=np.zeros(m),
        x=np.zeros(n), load=np.zeros(m), number=np.zeros(3), row=np.zeros(m),
        table=np.zeros((m + 1, n + 2)), basic=np.zeros(m, dtype=np.int64),
        other=np.zeros(n + 1, dtype=np.int64), dense=np.zeros((n, n + 1)),
    )  # fmt: skip


@njit
def scaled_table(P):
    """The tableau of x = 0, whose right sides may be negative."""
    n, m, T = P.count[UNKNOWNS], P.count[LIMITS], P.table
    most, steepest = 0.0, 0.0
    for r in range(m):
        largest = 0.0
        for c in range(n):
            largest = max(largest, abs(P.A[r, c]))
        P.row[r] = 1.0 / power_of_two(largest) if largest > TINY else 1.0
        most = max(most, abs(P.b[r]) * P.row[r])
    for c in range(n):
        steepest = max(steepest, abs(P.aim[c]))
        P.other[c] = c
    P.number[SCALE] = power_of_two(most) if most > TINY else 1.0
    P.number[AIM] = power_of_two(steepest) if steepest > TINY else 1.0
    for r in range(m):
        for c in range(n):
            T[r, c] = scaled(P, r, c)
        T[r, n], T[r, n + 1], P.basic[r] = 0.0, scaled_side(P, r), n + r
    P.other[n] = n + m


@inline
def scaled(P, r, c):
    """A number of limit r."""
    return P.A[r, c] * P.row[r]


@inline
def scaled_side(P, r):
    """Right side of limit r."""
    return P.b[r] * P.row[r] / P.number[SCALE]


@inline
def scaled_aim(P, c):
    """A number of the aim."""
    return P.aim[c] / P.number[AIM]


@njit
def exchange(P, r, k):
    """The unknown of column k enters for that of row r."""
    n, m, T = P.count[UNKNOWNS], P.count[LIMITS], P.table
    per = 1.0 / T[r, k]
    for c in range(n + 2):
        T[r, c] *= per
    for i in range(m + 1):
        part = T[i, k]
        if i != r and part != 0.0:
            for c in range(n + 2):
                T[i, c] -= part * T[r, c]
            T[i, k] = -part * per
    T[r, k] = per
    P.basic[r], P.other[k] = P.other[k], P.basic[r]
    P.count[EXCHANGED] += 1


@njit
def of_slack(P, r, s):
    """What row r has of slack s."""
    if P.basic[r] == s:
        return 1.0
    for c in range(P.count[UNKNOWNS] + 1):
        if P.other[c] == s:
            return P.table[r, c]
    return 0.0


@njit
def leaving(P, k, sign):
    """The row of the least ratio as the unknown of column k grows in this sign, the artificial one
    first, then the lexicographically least; −1 without a bound.
    """
    n, m, T, best, row = P.count[UNKNOWNS], P.count[LIMITS], P.table, math.inf, -1
    largest = 0.0
    for r in range(m):
        part = sign * T[r, k]
        if P.basic[r] < n or part <= LINEAR_PROGRAM_ZERO:
            continue
        ratio = max(T[r, n + 1], 0.0) / part
        # by what one of both exceeds its limit where the other leaves
        tie = LINEAR_PROGRAM_ZERO * max(ratio, 1.0 / max(part, largest))
        less = ratio < best - tie
        if not less and ratio <= best + tie and P.basic[row] != n + m:
            less = P.basic[r] == n + m
            if not less:
                for s in range(n, n + m):
                    new, old = of_slack(P, r, s) / part, of_slack(P, row, s) / (sign * T[row, k])
                    if abs(new - old) > LINEAR_PROGRAM_ZERO * max(1.0, abs(old)):
                        less = new < old
                        break
        if less:
            best, row, largest = ratio, r, part
    return row


@njit
def climb(P, first):
    """Exchanges up to the greatest value of the last row, of the unknown by which it grows most or,
    with `first`, by number; whether there is one.
    """
    n, m, T = P.count[UNKNOWNS], P.count[LIMITS], P.table
    for _ in range(EXCHANGES * (n + m)):
        best, k = 0.0, -1
        for c in range(n + 1):
            gain = abs(T[m, c]) if P.other[c] < n else T[m, c]
            if P.other[c] == n + m or gain <= LINEAR_PROGRAM_ZERO:
                continue
            if k < 0 or (P.other[c] < P.other[k] if first else gain > best):
                best, k = gain, c
        if k < 0:
            return True
        row = leaving(P, k, 1.0 if T[m, k] > 0.0 else -1.0)
        if row < 0:
            return False
        exchange(P, row, k)
    return False


@njit
def keeps_all(P, first):
    """Exchanges to where all limits are kept; whether there is such a place."""
    n, m, T, least, row = P.count[UNKNOWNS], P.count[LIMITS], P.table, 0.0, -1
    for r in range(m):
        if T[r, n + 1] < least:
            least, row = T[r, n + 1], r
    if row < 0:
        return True
    for r in range(m):
        T[r, n] = -1.0 if T[r, n + 1] < 0.0 else 0.0
    for c in range(n + 2):
        T[m, c] = -1.0 if c == n else 0.0
    exchange(P, row, n)
    climb(P, first)
    for r in range(m):
        if P.basic[r] == n + m:
            if T[r, n + 1] > LINEAR_PROGRAM_ZERO:
                return False
            T[r, n + 1] = 0.0
            best, k = LINEAR_PROGRAM_ZERO, -1
            for c in range(n + 1):
                if abs(T[r, c]) > best:
                    best, k = abs(T[r, c]), c
            if k < 0:
                return False
            exchange(P, r, k)
    return True


@njit
def by_equations(P):
    """x and the loads of the limits that are active, by their equations, with scales; the greatest
    residual of both.
    """
    n, m, M, off = P.count[UNKNOWNS], P.count[LIMITS], P.dense, 0.0
    for transposed in range(2):
        i = 0
        for c in range(n + 1):
            s = P.other[c]
            if s == n + m:
                continue
            for j in range(n):
                part = scaled(P, s - n, j) if s >= n else 1.0 if s == j else 0.0
                if transposed:
                    M[j, i] = part
                else:
                    M[i, j] = part
            if not transposed:
                M[i, n] = scaled_side(P, s - n) if s >= n else 0.0
            i += 1
        for j in range(n if transposed else 0):
            M[j, n] = scaled_aim(P, j)
        if not eliminate(M, n):
            return math.inf
        if not transposed:
            for j in range(n):
                P.x[j] = M[j, n]
    for r in range(m):
        P.load[r] = 0.0
        total, terms = -scaled_side(P, r), 1.0
        for j in range(n):
            total += scaled(P, r, j) * P.x[j]
            terms += abs(scaled(P, r, j) * P.x[j])
        off = max(off, total / terms)
    i, largest = 0, 1.0
    for c in range(n + 1):
        s = P.other[c]
        if s != n + m:
            largest = max(largest, abs(M[i, n]))
            if s >= n:
                P.load[s - n] = max(M[i, n], 0.0)
                off = max(off, -M[i, n] / largest)
            else:
                off = max(off, abs(M[i, n]) / largest)
            i += 1
    for j in range(n):
        total, terms = -scaled_aim(P, j), 1.0
        for r in range(m):
            total += P.load[r] * scaled(P, r, j)
            terms += abs(P.load[r] * scaled(P, r, j))
        off = max(off, abs(total) / terms)
    return off if off == off else math.inf


@njit
def solve_program(P):
    """P.x, P.load ← the greatest aim · x within A x ≤ b; what was found."""
    n, m, T = P.count[UNKNOWNS], P.count[LIMITS], P.table
    P.count[EXCHANGED] = 0
    for first in range(2):
        scaled_table(P)
        if not keeps_all(P, first == 1):
            return INCONSISTENT
        for c in range(n + 2):
            total = scaled_aim(P, P.other[c]) if c <= n and P.other[c] < n else 0.0
            for r in range(m):
                if P.basic[r] < n:
                    total -= scaled_aim(P, P.basic[r]) * T[r, c]
            T[m, c] = total
        if not climb(P, first == 1):
            return UNBOUNDED
        P.number[RESIDUAL] = by_equations(P)
        if P.number[RESIDUAL] <= LINEAR_PROGRAM_RESIDUAL:
            break
    for j in range(n):
        P.x[j] *= P.number[SCALE]
    for r in range(m):
        P.load[r] *= P.row[r] * P.number[AIM]
    return OPTIMAL if P.number[RESIDUAL] <= LINEAR_PROGRAM_RESIDUAL else UNCERTAIN


@kernel
def linear_program(P: LinearProgram) -> int:
    """P.x, P.load ← the greatest aim · x within A x ≤ b; what was found."""
    return solve_program(P)
