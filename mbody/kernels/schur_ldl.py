"""The Schur complement S = G W⁻¹ Gᵀ in blocks of 2×2, its LDLᵀ, and the products with G and Gᵀ.

The equations of motion and every projection onto the constraints have the form

    [W Gᵀ; G 0] [u; λ] = [f; c],

G = Φ_q by nodes, W positive weights: masses for free motion, geometric weights where the drivers
determine everything. Elimination of u = W⁻¹ (f − Gᵀ λ) leaves the Schur complement, up to its sign:

    G W⁻¹ Gᵀ λ = G W⁻¹ f − c.

S is positive definite where the rows are independent, in every position, so no pivoting is needed
and one symbolic phase serves for good. Elimination without pivoting, S = L D Lᵀ, goes node by node
with 2×2 pivots D_k = [1 0; l 1] diag(d₀, d₁) [1 l; 0 1].

Redundant rows make S singular. They get the regularization (S + ρ E) λ = b, E the units of the rows
(W.regularization_weight) and ρ = 1e-9: a proximal term. Iterations on the residual,
λ ← λ + (S + ρ E)⁻¹ (b − S λ), converge to the solution of least norm where b is consistent. A pivot
that vanishes all the same drops its row (its multiplier is zero).
"""

from __future__ import annotations

from mbody.core.decorators import inline, njit
from mbody.core.lanes import ld, select_le, smaller, st
from mbody.core.tolerances import PIVOT_VANISHED


@inline
def form(L, W, w, regularization):
    """S from the blocks: the diagonal, then what is below; with regularization."""
    B, V, S = W.block, W.weight, W.schur
    for k in range(L.nodes):
        i, j, o = L.node_column[2 * k], L.node_column[2 * k + 1], 12 * k
        w0, w1, w2 = ld(V, i, w), ld(V, i + 1, w), ld(V, i + 2, w)
        p0, p1, p2 = ld(B, o, w), ld(B, o + 1, w), ld(B, o + 2, w)
        r0, r1, r2 = ld(B, o + 3, w), ld(B, o + 4, w), ld(B, o + 5, w)
        a = w0 * p0 * p0 + w1 * p1 * p1 + w2 * p2 * p2
        b = w0 * p0 * r0 + w1 * p1 * r1 + w2 * p2 * r2
        c = w0 * r0 * r0 + w1 * r1 * r1 + w2 * r2 * r2
        w0, w1, w2 = ld(V, j, w), ld(V, j + 1, w), ld(V, j + 2, w)
        p0, p1, p2 = ld(B, o + 6, w), ld(B, o + 7, w), ld(B, o + 8, w)
        r0, r1, r2 = ld(B, o + 9, w), ld(B, o + 10, w), ld(B, o + 11, w)
        a += w0 * p0 * p0 + w1 * p1 * p1 + w2 * p2 * p2 + ld(W.pad, 2 * k, w)
        b += w0 * p0 * r0 + w1 * p1 * r1 + w2 * p2 * r2
        c += w0 * r0 * r0 + w1 * r1 * r1 + w2 * r2 * r2 + ld(W.pad, 2 * k + 1, w)
        a += regularization * ld(W.regularization_weight, 2 * k, w)
        c += regularization * ld(W.regularization_weight, 2 * k + 1, w)
        st(S, 3 * k, a, w)
        st(S, 3 * k + 1, b, w)
        st(S, 3 * k + 2, c, w)
        st(W.diagonal, 2 * k, a, w)
        st(W.diagonal, 2 * k + 1, c, w)
        st(W.cross, k, b, w)
    for n in range(L.more.shape[0]):
        k, i, o = L.more[n, 0], L.more[n, 1], 12 * L.nodes + 6 * n
        p0, p1, p2 = ld(B, o, w), ld(B, o + 1, w), ld(B, o + 2, w)
        a = ld(S, 3 * k, w) + ld(V, i, w) * p0 * p0
        a += ld(V, i + 1, w) * p1 * p1 + ld(V, i + 2, w) * p2 * p2
        st(S, 3 * k, a, w)
        st(W.diagonal, 2 * k, a, w)
    for n in range(L.fill.shape[0]):
        for m in range(4):
            st(S, L.fill[n] + m, 0.0, w)
    for n in range(L.form_block.shape[0]):
        t, a, b, i = L.form_block[n], L.form_a[n], L.form_b[n], L.form_column[n]
        w0, w1, w2 = ld(V, i, w), ld(V, i + 1, w), ld(V, i + 2, w)
        p0, p1, p2 = w0 * ld(B, b, w), w1 * ld(B, b + 1, w), w2 * ld(B, b + 2, w)
        r0, r1, r2 = w0 * ld(B, b + 3, w), w1 * ld(B, b + 4, w), w2 * ld(B, b + 5, w)
        g0, g1, g2 = ld(B, a, w), ld(B, a + 1, w), ld(B, a + 2, w)
        s0, s1 = g0 * p0 + g1 * p1 + g2 * p2, g0 * r0 + g1 * r1 + g2 * r2
        g0, g1, g2 = ld(B, a + 3, w), ld(B, a + 4, w), ld(B, a + 5, w)
        s2, s3 = g0 * p0 + g1 * p1 + g2 * p2, g0 * r0 + g1 * r1 + g2 * r2
        if L.form_more[n]:
            s0, s1 = s0 + ld(S, t, w), s1 + ld(S, t + 1, w)
            s2, s3 = s2 + ld(S, t + 2, w), s3 + ld(S, t + 3, w)
        st(S, t, s0, w)
        st(S, t + 1, s1, w)
        st(S, t + 2, s2, w)
        st(S, t + 3, s3, w)


@njit
def factor(L, W, w, regularization, guard):
    """S = L D Lᵀ by blocks; returns the least of (pivot − guard · diagonal).

    Negative or zero where a pivot is that small a part of its diagonal, NaN where a number was NaN.
    """
    form(L, W, w, regularization)
    S, Y, D = W.schur, W.lower, W.pivot
    base = 3 * L.nodes
    n = 0
    least = ld(W.diagonal, 0, w)
    for k in range(L.nodes):
        a, b, c = ld(S, 3 * k, w), ld(S, 3 * k + 1, w), ld(S, 3 * k + 2, w)
        low = PIVOT_VANISHED * ld(W.diagonal, 2 * k, w)
        i0 = select_le(a, low, 0.0 * a, 1.0 / a)
        least = smaller(least, a - guard * ld(W.diagonal, 2 * k, w))
        lower = b * i0
        d = c - b * lower
        low = PIVOT_VANISHED * ld(W.diagonal, 2 * k + 1, w)
        i1 = select_le(d, low, 0.0 * d, 1.0 / d)
        least = smaller(least, d - guard * ld(W.diagonal, 2 * k + 1, w))
        st(D, 3 * k, i0, w)
        st(D, 3 * k + 1, lower, w)
        st(D, 3 * k + 2, i1, w)
        first = L.node_start[k]
        for p in range(first, L.node_start[k + 1]):
            o, y = base + 4 * p, 4 * p
            m0, m1, m2, m3 = ld(S, o, w), ld(S, o + 1, w), ld(S, o + 2, w), ld(S, o + 3, w)
            y1, y3 = (m1 - lower * m0) * i1, (m3 - lower * m2) * i1
            y0, y2 = m0 * i0 - lower * y1, m2 * i0 - lower * y3
            st(Y, y, y0, w)
            st(Y, y + 1, y1, w)
            st(Y, y + 2, y2, w)
            st(Y, y + 3, y3, w)
            r = 3 * L.block_row[p]
            st(S, r, ld(S, r, w) - (y0 * m0 + y1 * m1), w)
            st(S, r + 1, ld(S, r + 1, w) - (y0 * m2 + y1 * m3), w)
            st(S, r + 2, ld(S, r + 2, w) - (y2 * m2 + y3 * m3), w)
            for p2 in range(first, p):
                t, o2 = L.update[n], base + 4 * p2
                n += 1
                g0, g1, g2, g3 = ld(S, o2, w), ld(S, o2 + 1, w), ld(S, o2 + 2, w), ld(S, o2 + 3, w)
                st(S, t, ld(S, t, w) - (y0 * g0 + y1 * g1), w)
                st(S, t + 1, ld(S, t + 1, w) - (y0 * g2 + y1 * g3), w)
                st(S, t + 2, ld(S, t + 2, w) - (y2 * g0 + y3 * g1), w)
                st(S, t + 3, ld(S, t + 3, w) - (y2 * g2 + y3 * g3), w)
    return least


@njit
def constraint_conditioning(L, W):
    """Least pivot as a part of its diagonal: the square of the sine of the least angle between a
    row and those eliminated before it, zero where rows depend on each other.
    """
    least = 1.0
    for k in range(L.nodes):
        for row in range(2):
            part = W.pivot[3 * k + 2 * row, 0] * W.diagonal[2 * k + row, 0]
            least = min(least, 1.0 / part if part > 0.0 else 0.0)
    return least


@njit
def solve(L, W, w):
    """x ← S⁻¹ x on nodes."""
    X, Y, D = W.x, W.lower, W.pivot
    for k in range(L.nodes):
        x0, x1 = ld(X, 2 * k, w), ld(X, 2 * k + 1, w)
        for p in range(L.node_start[k], L.node_start[k + 1]):
            r, y = 2 * L.block_row[p], 4 * p
            st(X, r, ld(X, r, w) - (ld(Y, y, w) * x0 + ld(Y, y + 1, w) * x1), w)
            st(X, r + 1, ld(X, r + 1, w) - (ld(Y, y + 2, w) * x0 + ld(Y, y + 3, w) * x1), w)
    for m in range(L.nodes):
        k = L.nodes - 1 - m
        lower = ld(D, 3 * k + 1, w)
        x0 = ld(X, 2 * k, w)
        x1 = (ld(X, 2 * k + 1, w) - lower * x0) * ld(D, 3 * k + 2, w)
        x0 = x0 * ld(D, 3 * k, w) - lower * x1
        for p in range(L.node_start[k], L.node_start[k + 1]):
            r, y = 2 * L.block_row[p], 4 * p
            z0, z1 = ld(X, r, w), ld(X, r + 1, w)
            x0 = x0 - (ld(Y, y, w) * z0 + ld(Y, y + 2, w) * z1)
            x1 = x1 - (ld(Y, y + 1, w) * z0 + ld(Y, y + 3, w) * z1)
        st(X, 2 * k, x0, w)
        st(X, 2 * k + 1, x1, w)


@njit
def apply_gt(L, W, w, x, u):
    """u ← u + Gᵀ x: from nodes to columns (those of the ground collect what nobody reads)."""
    B = W.block
    for k in range(L.nodes):
        x0, x1 = ld(x, 2 * k, w), ld(x, 2 * k + 1, w)
        o = 12 * k
        i = L.node_column[2 * k]
        st(u, i, ld(u, i, w) + ld(B, o, w) * x0 + ld(B, o + 3, w) * x1, w)
        st(u, i + 1, ld(u, i + 1, w) + ld(B, o + 1, w) * x0 + ld(B, o + 4, w) * x1, w)
        st(u, i + 2, ld(u, i + 2, w) + ld(B, o + 2, w) * x0 + ld(B, o + 5, w) * x1, w)
        j = L.node_column[2 * k + 1]
        st(u, j, ld(u, j, w) + ld(B, o + 6, w) * x0 + ld(B, o + 9, w) * x1, w)
        st(u, j + 1, ld(u, j + 1, w) + ld(B, o + 7, w) * x0 + ld(B, o + 10, w) * x1, w)
        st(u, j + 2, ld(u, j + 2, w) + ld(B, o + 8, w) * x0 + ld(B, o + 11, w) * x1, w)
    for n in range(L.more.shape[0]):
        x0, i, o = ld(x, 2 * L.more[n, 0], w), L.more[n, 1], 12 * L.nodes + 6 * n
        for m in range(3):
            st(u, i + m, ld(u, i + m, w) + ld(B, o + m, w) * x0, w)


@njit
def apply_g(L, W, w, u, x):
    """x ← G u: from columns to nodes (the columns of the ground must be zero)."""
    B = W.block
    for k in range(L.nodes):
        i, j, o = L.node_column[2 * k], L.node_column[2 * k + 1], 12 * k
        u0, u1, u2 = ld(u, i, w), ld(u, i + 1, w), ld(u, i + 2, w)
        z0, z1, z2 = ld(u, j, w), ld(u, j + 1, w), ld(u, j + 2, w)
        x0 = ld(B, o, w) * u0 + ld(B, o + 1, w) * u1 + ld(B, o + 2, w) * u2
        x1 = ld(B, o + 3, w) * u0 + ld(B, o + 4, w) * u1 + ld(B, o + 5, w) * u2
        x0 += ld(B, o + 6, w) * z0 + ld(B, o + 7, w) * z1 + ld(B, o + 8, w) * z2
        x1 += ld(B, o + 9, w) * z0 + ld(B, o + 10, w) * z1 + ld(B, o + 11, w) * z2
        st(x, 2 * k, x0, w)
        st(x, 2 * k + 1, x1, w)
    for n in range(L.more.shape[0]):
        r, i, o = 2 * L.more[n, 0], L.more[n, 1], 12 * L.nodes + 6 * n
        x0 = ld(x, r, w)
        for m in range(3):
            x0 += ld(B, o + m, w) * ld(u, i + m, w)
        st(x, r, x0, w)
