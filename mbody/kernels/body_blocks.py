"""Symmetric positive matrices in blocks of 3×3, one a pair of bodies that touch or are tied.

H = M + Wᵀ Θ W + Gᵀ Δ⁻¹ G has the pattern of what touches what. Bodies are numbered breadth first
from the end of a longest way through it, and backward (Cuthill, McKee; George): then row p
reaches from its first body on to the diagonal, and H = L Lᵀ fills nothing else. A row block p has
three rows of 3 (p − first + 1) numbers one after the other, so that products run along them.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.kernels.contact_geometry import FOUND

__all__ = ["add_block", "arrange", "factor_blocks", "put_masses", "solve_blocks"]

#: A pivot below this part of its diagonal is rounding.
LOST = 1e-15


@njit
def arrange(B, N):
    """Number the bodies by the contacts of the step and the joints; returns how many numbers the
    matrix has.
    """
    bodies = N.place.shape[0]
    start = N.start
    for b in range(bodies + 1):
        start[b] = 0
    for c in range(B.counts[FOUND]):
        i, j = B.who[c, 0], B.who[c, 1]
        if i < bodies and j < bodies and i != j:
            start[i + 1] += 1
            start[j + 1] += 1
    for n in range(N.tied.shape[0]):
        start[N.tied[n, 0] + 1] += 1
        start[N.tied[n, 1] + 1] += 1
    for b in range(bodies):
        start[b + 1] += start[b]
        N.place[b] = start[b]
    for c in range(B.counts[FOUND]):
        i, j = B.who[c, 0], B.who[c, 1]
        if i < bodies and j < bodies and i != j:
            join(N, i, j)
    for n in range(N.tied.shape[0]):
        join(N, N.tied[n, 0], N.tied[n, 1])
    return number_bodies(N)


@inline
def join(N, i, j):
    """Bodies i and j as neighbours of each other; `place` is where the next one is written."""
    N.neighbour[N.place[i]] = j
    N.place[i] += 1
    N.neighbour[N.place[j]] = i
    N.place[j] += 1


@njit
def number_bodies(N):
    """N.place of every body, and the first body and the offset of every row."""
    bodies = N.place.shape[0]
    for b in range(bodies):
        N.place[b] = -1
    done = 0
    for b in range(bodies):
        if N.place[b] >= 0:
            continue
        met = breadth_first(N, b, done)
        far = N.order[met - 1]
        for n in range(done, met):
            N.place[N.order[n]] = -1
        done = breadth_first(N, far, done)
    for n in range(bodies):
        N.place[N.order[n]] = bodies - 1 - n
    offset = 0
    for n in range(bodies):
        b = N.order[bodies - 1 - n]
        least = n
        for k in range(N.start[b], N.start[b + 1]):
            least = min(least, N.place[N.neighbour[k]])
        N.first[n], N.offset[n] = least, offset
        offset += 9 * (n - least + 1)
    N.offset[bodies] = offset
    return offset


@njit
def breadth_first(N, root, done):
    """N.order from `done` on ← the bodies that are connected with one; returns where they end."""
    N.order[done] = root
    N.place[root] = done
    end, n = done + 1, done
    while n < end:
        b = N.order[n]
        for k in range(N.start[b], N.start[b + 1]):
            other = N.neighbour[k]
            if N.place[other] < 0:
                N.place[other] = end
                N.order[end] = other
                end += 1
        n += 1
    return end


@njit
def put_masses(B, N):
    """The matrix ← masses alone."""
    for n in range(N.offset[N.place.shape[0]]):
        N.matrix[n] = 0.0
    for b in range(N.place.shape[0]):
        for n in range(3):
            N.matrix[diagonal_of(N, N.place[b]) + n * (width_of(N, N.place[b]) + 1)] = (
                1.0 / B.inverse[3 * b + n]
            )


@inline
def width_of(N, p):
    """Numbers in a row of row block p."""
    return 3 * (p - N.first[p] + 1)


@inline
def diagonal_of(N, p):
    """Where the diagonal block of row block p begins."""
    return N.offset[p] + width_of(N, p) - 3


@inline
def add_block(N, i, j, x, y):
    """Add the block x yᵀ of bodies i and j, three numbers each; only what is on or below the
    diagonal is kept.
    """
    p, q = N.place[i], N.place[j]
    if p >= q:
        o, w = N.offset[p] + 3 * (q - N.first[p]), width_of(N, p)
        N.matrix[o] += x[0] * y[0]
        N.matrix[o + 1] += x[0] * y[1]
        N.matrix[o + 2] += x[0] * y[2]
        N.matrix[o + w] += x[1] * y[0]
        N.matrix[o + w + 1] += x[1] * y[1]
        N.matrix[o + w + 2] += x[1] * y[2]
        N.matrix[o + 2 * w] += x[2] * y[0]
        N.matrix[o + 2 * w + 1] += x[2] * y[1]
        N.matrix[o + 2 * w + 2] += x[2] * y[2]


@njit
def factor_blocks(N):
    """The matrix ← L, with the inverses of its diagonal; returns whether it is positive."""
    A, good = N.matrix, True
    for p in range(N.place.shape[0]):
        start, width = N.first[p], width_of(N, p)
        row = N.offset[p]
        for q in range(start, p + 1):
            other, far = N.first[q], width_of(N, q)
            low = max(start, other)
            a, b, o = (
                row + 3 * (low - start),
                N.offset[q] + 3 * (low - other),
                row + 3 * (q - start),
            )
            s00, s01, s02 = A[o], A[o + 1], A[o + 2]
            s10, s11, s12 = A[o + width], A[o + width + 1], A[o + width + 2]
            s20, s21, s22 = A[o + 2 * width], A[o + 2 * width + 1], A[o + 2 * width + 2]
            for n in range(3 * (q - low)):
                x0, x1, x2 = A[a + n], A[a + width + n], A[a + 2 * width + n]
                y0, y1, y2 = A[b + n], A[b + far + n], A[b + 2 * far + n]
                s00 -= x0 * y0
                s01 -= x0 * y1
                s02 -= x0 * y2
                s10 -= x1 * y0
                s11 -= x1 * y1
                s12 -= x1 * y2
                s20 -= x2 * y0
                s21 -= x2 * y1
                s22 -= x2 * y2
            if q < p:
                d = diagonal_of(N, q)
                i0, i1, i2 = A[d], A[d + far + 1], A[d + 2 * far + 2]
                l10, l20, l21 = A[d + far], A[d + 2 * far], A[d + 2 * far + 1]
                s00, s10, s20 = s00 * i0, s10 * i0, s20 * i0
                s01, s11, s21 = (
                    (s01 - s00 * l10) * i1,
                    (s11 - s10 * l10) * i1,
                    (s21 - s20 * l10) * i1,
                )
                A[o], A[o + 1], A[o + 2] = s00, s01, (s02 - s00 * l20 - s01 * l21) * i2
                A[o + width], A[o + width + 1] = s10, s11
                A[o + width + 2] = (s12 - s10 * l20 - s11 * l21) * i2
                A[o + 2 * width], A[o + 2 * width + 1] = s20, s21
                A[o + 2 * width + 2] = (s22 - s20 * l20 - s21 * l21) * i2
            else:
                d0 = A[o]
                good = good and s00 > LOST * d0
                i0 = 1.0 / math.sqrt(s00) if s00 > LOST * d0 else 0.0
                l10, l20 = s10 * i0, s20 * i0
                d1 = s11 - l10 * l10
                good = good and d1 > 0.0
                i1 = 1.0 / math.sqrt(d1) if d1 > 0.0 else 0.0
                l21 = (s21 - l20 * l10) * i1
                d2 = s22 - l20 * l20 - l21 * l21
                good = good and d2 > 0.0
                i2 = 1.0 / math.sqrt(d2) if d2 > 0.0 else 0.0
                A[o], A[o + width], A[o + 2 * width] = i0, l10, l20
                A[o + width + 1], A[o + 2 * width + 1], A[o + 2 * width + 2] = i1, l21, i2
    return good


@njit
def solve_blocks(N, x):
    """x ← H⁻¹ x, by bodies; N.sorted is memory."""
    A, y, bodies = N.matrix, N.sorted, N.place.shape[0]
    for b in range(bodies):
        p = 3 * N.place[b]
        y[p], y[p + 1], y[p + 2] = x[3 * b], x[3 * b + 1], x[3 * b + 2]
    for p in range(bodies):
        a, k, w = N.offset[p], 3 * N.first[p], width_of(N, p)
        s0, s1, s2 = y[3 * p], y[3 * p + 1], y[3 * p + 2]
        for n in range(w - 3):
            s0 -= A[a + n] * y[k + n]
            s1 -= A[a + w + n] * y[k + n]
            s2 -= A[a + 2 * w + n] * y[k + n]
        d = a + w - 3
        s0 *= A[d]
        s1 = (s1 - A[d + w] * s0) * A[d + w + 1]
        y[3 * p], y[3 * p + 1] = s0, s1
        y[3 * p + 2] = (s2 - A[d + 2 * w] * s0 - A[d + 2 * w + 1] * s1) * A[d + 2 * w + 2]
    for m in range(bodies):
        p = bodies - 1 - m
        a, k, w = N.offset[p], 3 * N.first[p], width_of(N, p)
        d = a + w - 3
        s2 = y[3 * p + 2] * A[d + 2 * w + 2]
        s1 = (y[3 * p + 1] - A[d + 2 * w + 1] * s2) * A[d + w + 1]
        s0 = (y[3 * p] - A[d + w] * s1 - A[d + 2 * w] * s2) * A[d]
        y[3 * p], y[3 * p + 1], y[3 * p + 2] = s0, s1, s2
        for n in range(w - 3):
            y[k + n] -= A[a + n] * s0 + A[a + w + n] * s1 + A[a + 2 * w + n] * s2
    for b in range(bodies):
        p = 3 * N.place[b]
        x[3 * b], x[3 * b + 1], x[3 * b + 2] = y[p], y[p + 1], y[p + 2]
