"""Accelerations and multipliers of free motion, from one factor of the Schur complement.

The equations of motion with the constraints differentiated twice are the augmented system

    [M  Gᵀ] [a]   [f]
    [G  0 ] [λ] = [γ],

where γ is what Φ̈ = G a − γ has of velocities and time. Its first row gives a = M⁻¹ (f − Gᵀ λ); put
into the second,

    S λ = G M⁻¹ f − γ,   S = G M⁻¹ Gᵀ  (the Schur complement, `mbody.kernels.schur_ldl`).

A body with several slots is the sum of its slots, each with a share of its mass and of its load,
tied by weld rows. Where W.weight = W⁻¹ is not M⁻¹ (massless bodies have a small mass there) or S is
regularised (redundant rows), (a, λ) is refined by the residuals of both rows,

    r = f − M a − Gᵀ λ,   c = G (a + W⁻¹ r) − γ,
    S δλ = c,             a ← a + W⁻¹ r − W⁻¹ Gᵀ δλ,   λ ← λ + δλ,

which is one step of iterative refinement with [W Gᵀ; G 0] in place of the augmented matrix.
"""

from __future__ import annotations

from mbody.core.decorators import kernel, njit
from mbody.core.lanes import highest, ld, st
from mbody.core.tolerances import PIVOT_VANISHED
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import (
    add_sliding,
    any_sliding,
    friction_changes,
    friction_sizes,
    responses,
    store_sliding,
    viscous_friction,
)
from mbody.kernels.layout import Layout, Work
from mbody.kernels.position_velocity import clear, weigh
from mbody.kernels.schur_ldl import apply_g, apply_gt, factor, solve

#: Solutions with friction as a load, at most: one as a rule, more where rows are redundant.
FRICTION_PASSES = 6


@njit
def free_accelerations(L, W, w, regularization, refinements):
    """a and λ at W.q, W.v, W.time, with W.weight the inverse masses; see `augmented_solution`."""
    signals(L, W, w, L.varying)
    body_rotations(L, W, w)
    rows(L, W, w, True, True)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    augmented_solution(L, W, w, refinements)


@njit
def augmented_solution(L, W, w, refinements):
    """W.a and W.lam ← a and λ by the present rows and their factor, refined so many times."""
    forces(L, W, w, -1)
    if L.friction_kind.shape[0] == 0:
        balanced_motion(L, W, w, refinements)
        return
    viscous_friction(L, W, w)
    balanced_motion(L, W, w, refinements)
    if highest(any_sliding(L, W, w)) > 0.0:
        responses(L, W, w)
        friction_sizes(L, W, w)
        for _ in range(FRICTION_PASSES):
            add_sliding(L, W, w)
            balanced_motion(L, W, w, refinements)
            if not friction_changes(L, W, w):
                break
    store_sliding(L, W, w)


@njit
def balanced_motion(L, W, w, refinements):
    """W.a and W.lam ← a and λ for the loads in W.force; see `augmented_solution`."""
    # u = M⁻¹ f on slots
    clear(W.u, w)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            st(W.u, 3 * s + n, share * ld(W.force, o + n, w) * ld(W.weight, 3 * s + n, w), w)
    # S λ = G u − γ
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        st(W.x, n, ld(W.x, n, w) - ld(W.gamma, n, w), w)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        st(W.lam, n, ld(W.x, n, w), w)
    # a = u − M⁻¹ Gᵀ λ
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    for n in range(3 * L.slots):
        st(W.u, n, ld(W.u, n, w) - ld(W.r, n, w), w)
    for _ in range(refinements):
        refine(L, W, w)
    for b in range(L.bodies):
        for n in range(3):
            st(W.a, 3 * b + n, ld(W.u, 3 * L.body_slot[b] + n, w), w)


@njit
def refine(L, W, w):
    """One refinement of (a, λ) in (W.u, W.lam) by the residuals of both equations."""
    # r = W⁻¹ (f − M a − Gᵀ λ)
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            f = ld(W.force, o + n, w) - ld(W.mass, o + n, w) * ld(W.u, 3 * s + n, w)
            st(W.r, 3 * s + n, share * f - ld(W.r, 3 * s + n, w), w)
    weigh(L, W, w, W.r)
    # S δλ = G (a + r) − γ: one solve serves both residuals
    for n in range(W.u.shape[0]):
        st(W.u, n, ld(W.u, n, w) + ld(W.r, n, w), w)
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        st(W.x, n, ld(W.x, n, w) - ld(W.gamma, n, w), w)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        st(W.lam, n, ld(W.lam, n, w) + ld(W.x, n, w), w)
    # a ← a + r − W⁻¹ Gᵀ δλ
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    for n in range(W.u.shape[0]):
        st(W.u, n, ld(W.u, n, w) - ld(W.r, n, w), w)


@kernel
def free_motion(L: Layout, W: Work, regularization: float, refinements: int) -> None:
    """W.a and W.lam ← accelerations and multipliers at W.q, W.v and W.time."""
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    free_accelerations(L, W, w, regularization, refinements)


@kernel
def repeat(L: Layout, W: Work, times: int) -> float:
    """Evaluate `times` times at positions that differ a little, for measurements of speed."""
    total = 0.0
    for _ in range(times):
        W.q[2, 0] += 1e-9
        free_accelerations(L, W, 0.0, 0.0, 0)
        total += W.a[0, 0]
    return total
