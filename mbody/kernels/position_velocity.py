"""One instant: position by Newton, velocity, acceleration and multipliers, from one factor.

With G = Φ_q, positive weights W and the Schur complement S = G W⁻¹ Gᵀ = L D Lᵀ
(`mbody.kernels.schur_ldl`), each is one half of [W Gᵀ; G 0] [u; λ] = [f; c] and costs one solve:

    position       Δq = −W⁻¹ Gᵀ S⁻¹ Φ          (Newton: Φ_q Δq = −Φ)
    velocity       v  =  W⁻¹ Gᵀ S⁻¹ ν          (Φ_q v = ν = −Φ_t)
    acceleration   a  =  W⁻¹ Gᵀ S⁻¹ γ          (Φ_q a = γ)
    multipliers    λ  =  S⁻¹ G W⁻¹ (f − M a)   (Φ_qᵀ λ = f − M a)

Near a singular position the least singular value σ of G W^(−½) is small, as a part of the greatest,
and S has σ²: with rounding ε a solution x = S⁻¹ c is off by ε/σ² |x|. That error is along the left
singular vector of σ, which Gᵀ multiplies by σ, so that u is off by ε/σ |x|. For λ nothing damps it.
Both are refined by their residuals, c − G u and f − M a − Gᵀ λ, which multiplies the error by ε/σ²
each time.
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.duals import passes_more
from mbody.core.lanes import highest, ld, st
from mbody.core.tolerances import RESIDUAL_ROUNDING, TINY
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.friction import (
    BY_RATES,
    add_sliding,
    friction_changes,
    friction_sizes,
    responses,
    slip_signs_by_rates,
    store_sliding,
)
from mbody.kernels.schur_ldl import apply_g, apply_gt, factor, solve

#: Corrections by the residual: one as a rule, more where rows are redundant or nearly so.
REFINEMENTS = 6


@inline
def clear(array, w):
    """Every row zero."""
    for n in range(array.shape[0]):
        st(array, n, 0.0, w)


@inline
def copy(source, target, w):
    """Row by row."""
    for n in range(target.shape[0]):
        st(target, n, ld(source, n, w), w)


@inline
def square_on_nodes(L, W, w, x):
    """Sum of squares on nodes, each row by its diagonal of S, so that rows of lengths and of angles
    are of one unit; NaN where there is one.
    """
    total = 0.0 * ld(x, 0, w)
    for n in range(2 * L.nodes):
        y = ld(x, n, w)
        total = total + y * y / (ld(W.diagonal, n, w) + TINY)
    return total


@inline
def weigh(L, W, w, u):
    """u ← W⁻¹ u, and zero on the ground."""
    for n in range(u.shape[0]):
        st(u, n, ld(u, n, w) * ld(W.weight, n, w), w)


@njit
def least_motion(L, W, w, c, checked):
    """u = W⁻¹ Gᵀ S⁻¹ c: the u with G u = c that makes uᵀ W u least, refined by its residual c − G u
    if `checked`, which nearly dependent rows need.
    """
    copy(c, W.x, w)
    solve(L, W, w)
    clear(W.u, w)
    apply_gt(L, W, w, W.x, W.u)
    weigh(L, W, w, W.u)
    if not checked:
        return
    terms = square_on_nodes(L, W, w, c)
    left = passes_more(w)
    for _ in range(REFINEMENTS + left):
        apply_g(L, W, w, W.u, W.x)
        for n in range(2 * L.nodes):
            st(W.x, n, ld(c, n, w) - ld(W.x, n, w), w)
        if (
            highest(square_on_nodes(L, W, w, W.x) - RESIDUAL_ROUNDING * RESIDUAL_ROUNDING * terms)
            <= 0.0
        ):
            if left == 0:
                break
            left -= 1
        solve(L, W, w)
        clear(W.r, w)
        apply_gt(L, W, w, W.x, W.r)
        weigh(L, W, w, W.r)
        for n in range(W.u.shape[0]):
            st(W.u, n, ld(W.u, n, w) + ld(W.r, n, w), w)


@inline
def columns_to_bodies(L, w, u, target):
    """Columns to coordinates: a body moves as its first slot."""
    for b in range(L.bodies):
        o, s = 3 * b, 3 * L.body_slot[b]
        st(target, o, ld(u, s, w), w)
        st(target, o + 1, ld(u, s + 1, w), w)
        st(target, o + 2, ld(u, s + 2, w), w)


@inline
def take_off(L, w, u, target):
    """Subtract columns from coordinates: a body moves as its first slot."""
    for b in range(L.bodies):
        o, s = 3 * b, 3 * L.body_slot[b]
        st(target, o, ld(target, o, w) - ld(u, s, w), w)
        st(target, o + 1, ld(target, o + 1, w) - ld(u, s + 1, w), w)
        st(target, o + 2, ld(target, o + 2, w) - ld(u, s + 2, w), w)


@njit
def rates_of_rows(L, W, w):
    """x = Φ_q v on nodes."""
    clear(W.u, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.u, 3 * s + n, ld(W.v, 3 * L.slot_body[s] + n, w), w)
    apply_g(L, W, w, W.u, W.x)


@inline
def put_column(source, column, target, lane):
    """A column of numbers, one of a set, into a lane."""
    for n in range(source.shape[0]):
        target[n, lane] = source[n, column]


@njit
def newton(L, W, w, regularization, guard):
    """One Newton step on Φ; returns its size (in model lengths and radians) and factor's pivot."""
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    least = factor(L, W, w, regularization, guard)
    copy(W.phi, W.x, w)
    solve(L, W, w)
    clear(W.u, w)
    apply_gt(L, W, w, W.x, W.u)
    weigh(L, W, w, W.u)
    size = motion_norm(L, W, w)
    take_off(L, w, W.u, W.q)
    return size, least


@inline
def motion_norm(L, W, w):
    """Size of a motion on columns, lengths by the model length: root of the sum of squares."""
    return np.sqrt(size_square(L, W, w))


@inline
def size_square(L, W, w):
    """The square of `motion_norm`."""
    per_length = 1.0 / ld(W.size, 0, w)
    far, turned = 0.0 * per_length, 0.0 * per_length
    for b in range(L.bodies):
        s = 3 * L.body_slot[b]
        x, y, t = ld(W.u, s, w), ld(W.u, s + 1, w), ld(W.u, s + 2, w)
        far = far + x * x + y * y
        turned = turned + t * t
    return far * per_length * per_length + turned


@njit
def velocities(L, W, w, checked):
    """v from G v = ν, with the ν of the last position."""
    least_motion(L, W, w, W.nu, checked)
    columns_to_bodies(L, w, W.u, W.v)


@njit
def set_rates(L, W, w, d, rate, acceleration):
    """Set rate and acceleration of driver d, instead of those that its law gave; one that follows
    positions has those of its formula.
    """
    if L.driver_dependent[d] == 1:
        return
    st(W.nu, 2 * L.driver_node[d], rate, w)
    st(W.signal, L.driver_row[d] + 1, rate, w)
    st(W.signal, L.driver_row[d] + 2, acceleration, w)


@njit
def accelerations(L, W, w, checked):
    """a from G a = γ, the velocities being set."""
    rows(L, W, w, None, True)
    least_motion(L, W, w, W.gamma, checked)
    columns_to_bodies(L, w, W.u, W.a)


@inline
def force_residual(L, W, w):
    """r = f − M a − Gᵀ λ on columns, each slot taking its share of f − M a.

    Returns the sums of squares of r and of its terms, forces and torques in the metric W⁻¹."""
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    terms = 0.0 * ld(W.size, 0, w)
    rest = terms
    for s in range(L.slots):
        for n in range(3):
            f, g = applied_share(L, W, w, s, n), ld(W.r, 3 * s + n, w)
            x, unit = f - g, ld(W.weight, 3 * s + n, w)
            terms = terms + (f * f + g * g) * unit
            rest = rest + x * x * unit
            st(W.r, 3 * s + n, x, w)
    return rest, terms


@inline
def applied_share(L, W, w, s, n):
    """Share of slot s in f − M a of its body, component n."""
    o = 3 * L.slot_body[s] + n
    return ld(W.share, s, w) * (ld(W.force, o, w) - ld(W.mass, o, w) * ld(W.a, o, w))


@njit
def multipliers(L, W, w):
    """λ from Gᵀ λ = f − M a, the loads being in W.force, friction included; returns the size of the
    residual, as a part of the terms.
    """
    rest = balancing_multipliers(L, W, w)
    if L.friction_kind.shape[0] == 0:
        return rest
    if L.slip_signs == BY_RATES:
        slip_signs_by_rates(L, W, w)
    responses(L, W, w)
    friction_sizes(L, W, w)
    left = passes_more(w)
    for _ in range(REFINEMENTS + left):
        add_sliding(L, W, w)
        rest = balancing_multipliers(L, W, w)
        if not friction_changes(L, W, w):
            if left == 0:
                break
            left -= 1
    store_sliding(L, W, w)
    return rest


@njit
def balancing_multipliers(L, W, w):
    """λ from Gᵀ λ = f − M a for the loads in W.force; see `multipliers`."""
    clear(W.lam, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.r, 3 * s + n, applied_share(L, W, w, s, n), w)
    for n in range(3 * L.slots, W.r.shape[0]):
        st(W.r, n, 0.0, w)
    rest = 0.0 * ld(W.size, 0, w)
    terms = rest
    left = passes_more(w)
    for _ in range(REFINEMENTS + left):
        weigh(L, W, w, W.r)
        apply_g(L, W, w, W.r, W.x)
        solve(L, W, w)
        for n in range(2 * L.nodes):
            st(W.lam, n, ld(W.lam, n, w) + ld(W.x, n, w), w)
        rest, terms = force_residual(L, W, w)
        if highest(rest - RESIDUAL_ROUNDING * RESIDUAL_ROUNDING * terms) <= 0.0:
            if left == 0:
                break
            left -= 1
    return np.sqrt(rest / (terms + TINY))
