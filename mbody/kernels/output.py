"""What is kept of an instant: motion by coordinate, then multipliers and reaction by primitive."""

from __future__ import annotations

from mbody.core.decorators import inline, njit
from mbody.core.lanes import ld, st
from mbody.kernels.layout import FRICTION_NUMBERS

__all__ = ["PER_PRIMITIVE", "keep", "keep_primitive", "keep_primitives", "keep_some"]

#: Numbers of one primitive: λ₀, λ₁, then force (x, y) and torque on body j at the marker on j.
PER_PRIMITIVE = 5


@njit
def keep(L, W, w, page):
    """Rows of page: q, v, a of all bodies, `PER_PRIMITIVE` rows a primitive, what is known of all
    rough pairs where there are any, own states, inputs.
    """
    n3 = 3 * L.bodies
    for n in range(n3):
        st(page, n, ld(W.q, n, w), w)
        st(page, n3 + n, ld(W.v, n, w), w)
        st(page, 2 * n3 + n, ld(W.a, n, w), w)
    keep_primitives(L, W, w, page, 3 * n3)
    first = 3 * n3 + PER_PRIMITIVE * L.primitive_node.shape[0]
    if L.friction_kind.shape[0] > 0:
        for n in range(FRICTION_NUMBERS):
            st(page, first + n, ld(W.friction, n, w), w)
        first += FRICTION_NUMBERS
    for n in range(L.owns):
        st(page, first + n, ld(W.own, n, w), w)
    for n in range(L.input_row.shape[0]):
        st(page, first + L.owns + n, ld(W.signal, L.input_row[n], w), w)


@njit
def keep_primitives(L, W, w, page, first):
    """Reactions of all primitives, from row `first` on."""
    for e in range(L.primitive_node.shape[0]):
        keep_primitive(L, W, w, e, page, first + PER_PRIMITIVE * e)


@inline
def keep_primitive(L, W, w, e, page, row):
    """Reaction of a primitive: −(block of j)ᵀ λ, moved from the mass centre to the marker on j."""
    k, j, arm = L.primitive_node[e], L.primitive_j[e], L.primitive_arm[e]
    o = 12 * L.written_node[e] + 6
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


@njit
def keep_some(L, W, w, rows, page):
    """Only these rows (numbered as in `keep`, ascending), one after the other."""
    n3 = 3 * L.bodies
    pairs = 3 * n3 + PER_PRIMITIVE * L.primitive_node.shape[0]
    owns = pairs + (FRICTION_NUMBERS if L.friction_kind.shape[0] > 0 else 0)
    last = -1
    for n in range(rows.shape[0]):
        row = rows[n]
        if row < n3:
            st(page, n, ld(W.q, row, w), w)
        elif row < 2 * n3:
            st(page, n, ld(W.v, row - n3, w), w)
        elif row < 3 * n3:
            st(page, n, ld(W.a, row - 2 * n3, w), w)
        elif row >= owns + L.owns:
            st(page, n, ld(W.signal, L.input_row[row - owns - L.owns], w), w)
        elif row >= owns:
            st(page, n, ld(W.own, row - owns, w), w)
        elif row >= pairs:
            st(page, n, ld(W.friction, row - pairs, w), w)
        else:
            e = (row - 3 * n3) // PER_PRIMITIVE
            spare = rows.shape[0]
            if e != last:
                keep_primitive(L, W, w, e, page, spare)
            last = e
            st(page, n, ld(page, spare + row - 3 * n3 - PER_PRIMITIVE * e, w), w)
