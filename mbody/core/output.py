"""What is kept of an instant: motion by coordinate, then multipliers and reaction by atom."""

from __future__ import annotations

from mbody._jit import njit
from mbody._lanes import ld, st

__all__ = ["PER_ATOM", "keep", "keep_atoms"]

#: Numbers of one atom: λ₀, λ₁, then force (x, y) and torque on body j by body i at the marker on j.
PER_ATOM = 5


@njit
def keep(L, W, w, page):
    """Rows of page: q, v, a of all bodies, then `PER_ATOM` rows an atom."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(page, n, ld(W.q, n, w), w)
        st(page, n3 + n, ld(W.v, n, w), w)
        st(page, 2 * n3 + n, ld(W.a, n, w), w)
    keep_atoms(L, W, w, page, 3 * n3)


@njit
def keep_atoms(L, W, w, page, first):
    """Reaction of every atom: −(block of j)ᵀ λ, moved from the mass centre to the marker on j."""
    for e in range(L.atom_node.shape[0]):
        k, j, arm = L.atom_node[e], L.atom_j[e], L.atom_arm[e]
        o, row = 12 * k + 6, first + 5 * e
        x, y = ld(W.lam, 2 * k, w), ld(W.lam, 2 * k + 1, w)
        fx = -(ld(W.block, o, w) * x + ld(W.block, o + 3, w) * y)
        fy = -(ld(W.block, o + 1, w) * x + ld(W.block, o + 4, w) * y)
        t = -(ld(W.block, o + 2, w) * x + ld(W.block, o + 5, w) * y)
        c, s = ld(W.turn, 2 * j, w), ld(W.turn, 2 * j + 1, w)
        ax, ay = ld(W.par, arm, w), ld(W.par, arm + 1, w)
        px, py = c * ax - s * ay, s * ax + c * ay
        st(page, row, x, w)
        st(page, row + 1, y, w)
        st(page, row + 2, fx, w)
        st(page, row + 3, fy, w)
        st(page, row + 4, t - (px * fy - py * fx), w)
