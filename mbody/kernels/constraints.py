"""Constraint equations: Φ, Φ_q, ν and γ of every primitive, each by the physics of its joint."""

from __future__ import annotations

import functools
from typing import Any

from mbody.core.decorators import inline, njit
from mbody.core.lanes import count, highest, ld, sincos, st, st_varying
from mbody.kernels.law_values import law_of_direction
from mbody.kernels.measured_formulas import formula_rows
from mbody.kernels.user_calls import user_numbers
from mbody.model.joints import CONSTRAINTS
from mbody.model.joints.angle import angle
from mbody.model.joints.coordinate import coordinate
from mbody.model.joints.distance import distance

__all__ = ["BY_DIRECTION", "KINDS", "further_block", "rows", "side", "turns"]

#: Kinds of physics; the number of a kind is its place. Those of joints in the order of
#: `mbody.model.joints`, then the sum of a coupling, then a driver that follows positions, then a
#: user's own.
KINDS = (*CONSTRAINTS, "sum", "formula", "user")
ANGLE, DISTANCE, SUM, FORMULA = map(KINDS.index, ("angle", "distance", "sum", "formula"))
#: Numbers of the kinds with a law of a direction that the position gives, as cams have.
BY_DIRECTION = tuple(n for n, one in enumerate(CONSTRAINTS.values()) if one.argument)


@njit
def rows(L, W, w, position, velocity):
    """Fill Φ, Φ_q and ν (unless `position` is None) and γ (unless `velocity` is None)."""
    for e in range(L.primitive_kind.shape[0]):
        every_kind(L, W, w, e, L.primitive_kind[e], position, velocity)
    # on lanes no row is switched on
    if count(w) == 1 and L.switched.shape[0] > 0:
        switch(L, W, w, position, velocity)


@njit
def switch(L, W, w, position, velocity):
    """Rows that can be on or off ← what their physics gave, less the anchor of Φ, or nothing."""
    for s in range(L.switched.shape[0]):
        e = L.switched[s]
        k, m = L.primitive_node[e], L.written_node[e]
        # a row that is off may be no number, as where two centres coincide
        on = highest(ld(W.on, s, w)) != 0.0
        if position is not None:
            phi = ld(W.phi, 2 * m, w) - ld(W.anchor, s, w)
            st(W.phi, 2 * k, phi if on else 0.0, w)
            st(W.nu, 2 * k, ld(W.nu, 2 * m, w) if on else 0.0, w)
            for n in range(3):
                st(W.block, 12 * k + n, ld(W.block, 12 * m + n, w) if on else 0.0, w)
                st(W.block, 12 * k + 6 + n, ld(W.block, 12 * m + 6 + n, w) if on else 0.0, w)
            for side in range(L.more.shape[0]):
                if L.more[side, 0] == k:
                    o, own = 12 * L.nodes + 6 * side, further_block(L, side)
                    for n in range(3):
                        st(W.block, o + n, ld(W.block, own + n, w) if on else 0.0, w)
        if velocity is not None:
            st(W.gamma, 2 * k, ld(W.gamma, 2 * m, w) if on else 0.0, w)


@inline
def further_block(L, side):
    """Where the physics of a row that can be on or off writes the block of a further side, which
    is that number of `L.more`.
    """
    return 12 * (L.nodes + (L.more.shape[0] + 1) // 2 + L.switched.shape[0]) + 6 * side


@inline
def ends(L, W, w, e):
    """Both sides, the parameters and the signal of primitive e, as the physics takes them."""
    o, f = L.primitive_par[e], L.primitive_signal[e]
    p = (
        ld(W.par, o, w),
        ld(W.par, o + 1, w),
        ld(W.par, o + 2, w),
        ld(W.par, o + 3, w),
        ld(W.par, o + 4, w),
        ld(W.par, o + 5, w),
        ld(W.par, o + 6, w),
    )
    signal = (ld(W.signal, f, w), ld(W.signal, f + 1, w), ld(W.signal, f + 2, w))
    return side(W, L.primitive_i[e], w), side(W, L.primitive_j[e], w), p, signal


@inline
def side(W, b, w):
    """(x, y, θ, cos θ, sin θ, vx, vy, ω) of body b."""
    o = 3 * b
    return (
        ld(W.q, o, w),
        ld(W.q, o + 1, w),
        ld(W.q, o + 2, w),
        ld(W.turn, 2 * b, w),
        ld(W.turn, 2 * b + 1, w),
        ld(W.v, o, w),
        ld(W.v, o + 1, w),
        ld(W.v, o + 2, w),
    )


@inline
def put(L, W, w, e, position, velocity, physics):
    """Store what the physics of primitive e gave at its node; constants are there already."""
    phi, blocks, nu, gamma = physics
    k = L.written_node[e]
    if position is not None:
        st_varying(W.phi, 2 * k, phi[0], w)
        st_varying(W.phi, 2 * k + 1, phi[1], w)
        o = 12 * k
        st_varying(W.block, o, blocks[0], w)
        st_varying(W.block, o + 1, blocks[1], w)
        st_varying(W.block, o + 2, blocks[2], w)
        st_varying(W.block, o + 3, blocks[3], w)
        st_varying(W.block, o + 4, blocks[4], w)
        st_varying(W.block, o + 5, blocks[5], w)
        st_varying(W.block, o + 6, blocks[6], w)
        st_varying(W.block, o + 7, blocks[7], w)
        st_varying(W.block, o + 8, blocks[8], w)
        st_varying(W.block, o + 9, blocks[9], w)
        st_varying(W.block, o + 10, blocks[10], w)
        st_varying(W.block, o + 11, blocks[11], w)
        st_varying(W.nu, 2 * k, nu[0], w)
        st_varying(W.nu, 2 * k + 1, nu[1], w)
    if velocity is not None:
        st_varying(W.gamma, 2 * k, gamma[0], w)
        st_varying(W.gamma, 2 * k + 1, gamma[1], w)


@njit
def total(L, W, w, e, position, velocity):
    """Φ = Σ c·(coordinate) − p₀ over the parts of primitive e, in the first row of its node."""
    k, o = L.primitive_node[e], L.primitive_par[e]
    first, end = L.sum_start[e], L.sum_start[e + 1]
    if position is not None:
        st(W.phi, 2 * k, -ld(W.par, o, w), w)
        for n in range(first, end):
            clear_block(W, w, L.part[n, 3])
            clear_block(W, w, L.part[n, 4])
    if velocity is not None:
        st(W.gamma, 2 * k, 0.0, w)
    none = (0.0, 0.0, 0.0)
    for n in range(first, end):
        at = o + 1 + 7 * (n - first)
        i, j, c = side(W, L.part[n, 1], w), side(W, L.part[n, 2], w), ld(W.par, at, w)
        p = (
            ld(W.par, at + 1, w),
            ld(W.par, at + 2, w),
            ld(W.par, at + 3, w),
            ld(W.par, at + 4, w),
            ld(W.par, at + 5, w),
            ld(W.par, at + 6, w),
        )
        kind = L.part[n, 0]
        if kind == ANGLE:
            add_part(L, W, w, k, n, position, velocity, weighted(c, angle(i, j, p, none)))
        elif kind == DISTANCE:
            add_part(L, W, w, k, n, position, velocity, weighted(c, distance(i, j, p, none)))
        else:
            add_part(L, W, w, k, n, position, velocity, weighted(c, coordinate(i, j, p, none)))


@inline
def clear_block(W, w, o):
    """Zeros in the first row of a block that is not the ground's."""
    if o >= 0:
        for m in range(3):
            st(W.block, o + m, 0.0, w)


@inline
def weighted(c, physics):
    """c times Φ, Φ_q by both bodies and γ, of the first row of a part."""
    phi, blocks, _, gamma = physics
    by_i = c * blocks[0], c * blocks[1], c * blocks[2]
    by_j = c * blocks[6], c * blocks[7], c * blocks[8]
    return c * phi[0], by_i, by_j, c * gamma[0]


@inline
def add_part(L, W, w, k, n, position, velocity, part):
    """Add what part n gives, as `weighted`, to node k."""
    phi, by_i, by_j, gamma = part
    if position is not None:
        st(W.phi, 2 * k, ld(W.phi, 2 * k, w) + phi, w)
        o = L.part[n, 3]
        if o >= 0:
            st(W.block, o, ld(W.block, o, w) + by_i[0], w)
            st(W.block, o + 1, ld(W.block, o + 1, w) + by_i[1], w)
            st(W.block, o + 2, ld(W.block, o + 2, w) + by_i[2], w)
        o = L.part[n, 4]
        if o >= 0:
            st(W.block, o, ld(W.block, o, w) + by_j[0], w)
            st(W.block, o + 1, ld(W.block, o + 1, w) + by_j[1], w)
            st(W.block, o + 2, ld(W.block, o + 2, w) + by_j[2], w)
    if velocity is not None:
        st(W.gamma, 2 * k, ld(W.gamma, 2 * k, w) + gamma, w)


@inline
def custom(L, W, w, e):
    """Rows of a user's joint, lane by lane through the hook."""
    i, j, first = L.primitive_i[e], L.primitive_j[e], L.primitive_par[e]
    user_numbers(W, w, L.primitive_handle[e], i, j, first, L.primitive_count[e], 18)
    s = W.scratch
    phi = (ld(s, 0, w), ld(s, 1, w))
    blocks = (
        ld(s, 2, w),
        ld(s, 3, w),
        ld(s, 4, w),
        ld(s, 5, w),
        ld(s, 6, w),
        ld(s, 7, w),
        ld(s, 8, w),
        ld(s, 9, w),
        ld(s, 10, w),
        ld(s, 11, w),
        ld(s, 12, w),
        ld(s, 13, w),
    )
    return phi, blocks, (ld(s, 14, w), ld(s, 15, w)), (ld(s, 16, w), ld(s, 17, w))


@njit
def turns(L, W, w):
    """Cosine and sine of every body's angle: once a body, not once a joint."""
    for b in range(L.bodies):
        s, c = sincos(ld(W.q, 3 * b + 2, w))
        st(W.turn, 2 * b, c, w)
        st(W.turn, 2 * b + 1, s, w)


@njit(forceinline=True)
def last_kinds(L, W, w, e, kind, position, velocity):
    """What no joint's physics is: a sum, a driver that follows positions, or a user's own."""
    if kind == SUM:
        total(L, W, w, e, position, velocity)
    elif kind == FORMULA:
        formula_rows(L, W, w, e, position, velocity)
    else:
        put(L, W, w, e, position, velocity, custom(L, W, w, e))


def branch(otherwise, number):
    """Compiled ``if kind == number: … else: otherwise(…)`` with the physics of that kind.

    Numba compiles no table of functions that lanes could take, so that the chain of branches over
    `CONSTRAINTS` is made here, one inside the other. None of them is kept on disk: `rows` is, with
    all of them.
    """
    one: Any = CONSTRAINTS[KINDS[number]]
    physics, direction = one.function, one.argument

    @njit(forceinline=True, cache=False)
    def direct(L, W, w, e, kind, position, velocity):
        if kind == number:
            put(L, W, w, e, position, velocity, physics(*ends(L, W, w, e)))
        else:
            otherwise(L, W, w, e, kind, position, velocity)

    # a function of its own: with its loop over lanes inside `rows` all other kinds would be slower
    @njit(cache=False)
    def evaluated(L, W, w, e, position, velocity):
        i, j, p, _ = ends(L, W, w, e)
        f = law_of_direction(L, W, w, L.primitive_law[e], *direction(i, j, p))
        put(L, W, w, e, position, velocity, physics(i, j, p, f))

    @njit(forceinline=True, cache=False)
    def by_direction(L, W, w, e, kind, position, velocity):
        if kind == number:
            evaluated(L, W, w, e, position, velocity)
        else:
            otherwise(L, W, w, e, kind, position, velocity)

    return by_direction if direction else direct


#: The branch of the first kind is the outermost one.
every_kind = functools.reduce(branch, reversed(range(len(CONSTRAINTS))), last_kinds)
