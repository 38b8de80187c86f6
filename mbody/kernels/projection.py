"""Projection onto the constraints Φ = 0 and Φ_q v = ν, in the metric of the masses.

The nearest position and the nearest velocity are the solutions of

    min ½ (q − q₀)ᵀ M (q − q₀)  with  Φ(q, t) = 0,     min ½ (v − v₀)ᵀ M (v − v₀)  with  G v = ν.

With multipliers μ the second has M (v − v₀) + Gᵀ μ = 0 and G v = ν, so that S μ = G v₀ − ν and

    v = v₀ − M⁻¹ Gᵀ S⁻¹ (G v₀ − ν),   S = G M⁻¹ Gᵀ.

The first is solved by Newton's method, δq = −M⁻¹ Gᵀ S⁻¹ Φ, with G at the present position: what it
moves lies across the manifold to first order, so that its limit differs from the nearest position
by no more than the square of the distance. The same factor of S gives the accelerations afterwards.

Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4 and VII.1.
"""

from __future__ import annotations

from mbody.core.decorators import njit
from mbody.core.lanes import highest, larger, ld, select_le, smaller, st
from mbody.kernels.accelerations import augmented_solution
from mbody.kernels.constraints import rows, turns
from mbody.kernels.forces import signals
from mbody.kernels.position_velocity import (
    clear,
    copy,
    least_motion,
    newton,
    rates_of_rows,
    reach,
    take_off,
)
from mbody.kernels.schur_ldl import VANISHED, apply_g, factor
from mbody.kernels.singularity_monitor import node_conditioning

__all__ = [
    "constrained_accelerations",
    "least_conditioning",
    "project_position",
    "project_velocity",
    "projected_accelerations",
    "tangential_part",
]

#: Newton steps of one projection, at most.
NEWTON = 12
#: What a Newton step of this size leaves is of second order, and so rounding: a later step, and the
#: first one, whose size is the error of a stage.
CLOSED, CLOSED_FIRST = 1e-7, 1e-9


@njit
def project_position(L, W, w, regularization, among):
    """W.q ← the nearest position with Φ = 0 in the lanes where `among` is one; others get numbers
    of no use. A lane that has converged keeps its position while others go on, so that what it gets
    does not depend on its neighbours.

    Returns how far the first Newton step goes, and one in lanes that did not converge, else zero.
    """
    zero = 0.0 * among
    one = zero + 1.0
    left, failed, first, last = among, zero, zero, one
    for n in range(NEWTON):
        if n > 0:
            copy(W.q, W.base, w)
        size, _ = newton(L, W, w, regularization, VANISHED)
        if n == 0:
            first = size
        else:
            for m in range(3 * L.bodies):
                st(W.q, m, select_le(one, left, ld(W.q, m, w), ld(W.base, m, w)), w)
        # NaN is far
        off = left * select_le(size, zero + (CLOSED if n > 0 else CLOSED_FIRST), zero, one)
        lost = off * select_le(size, zero + 1e6, zero, one)
        if n > 1:
            lost = larger(lost, off * select_le(size, 0.5 * last, zero, one))
        failed = larger(failed, lost)
        left = off - lost
        last = size
        if highest(left) <= 0.0:
            break
    return first, larger(failed, left)


@njit
def project_velocity(L, W, w, refinements):
    """W.v ← the nearest velocity with G v = ν, by the present factor. Returns how far it moves."""
    first = 0.0 * ld(W.size, 0, w)
    for n in range(1 + refinements):
        # v ← v − M⁻¹ Gᵀ S⁻¹ (G v − ν)
        rates_of_rows(L, W, w)
        for m in range(2 * L.nodes):
            st(W.x, m, ld(W.x, m, w) - ld(W.nu, m, w), w)
        least_motion(L, W, w, W.x, False)
        if n == 0:
            first = reach(L, W, w)
        take_off(L, w, W.u, W.v)
    return first


@njit
def projected_accelerations(L, W, w, regularization, refinements, among):
    """W.a and W.lam ← a and λ at the projection of W.q and W.v, in the lanes where `among` is one.

    Returns how far position and velocity are moved, and one in lanes where the projection of the
    position did not converge, else zero.
    """
    signals(L, W, w, L.varying)
    far, failed = project_position(L, W, w, regularization, among)
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, VANISHED)
    fast = project_velocity(L, W, w, refinements)
    rows(L, W, w, None, True)
    augmented_solution(L, W, w, refinements)
    return far, fast, failed


@njit
def constrained_accelerations(L, W, w, regularization, refinements, projected):
    """W.a and W.lam ← a and λ at W.q, W.v, W.time of one motion; `projected`: at their projection.
    Returns how far that moves position and velocity, and whether it converged.
    """
    if projected:
        far, fast, failed = projected_accelerations(L, W, w, regularization, refinements, 1.0)
        return far, fast, failed < 0.5
    signals(L, W, w, L.varying)
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, VANISHED)
    rows(L, W, w, None, True)
    augmented_solution(L, W, w, refinements)
    return 0.0, 0.0, True


@njit
def least_conditioning(L, W, w):
    """The least part that elimination leaves of the determinant of a node: the square of how far
    the rows are from depending on each other; see `node_conditioning`.
    """
    least = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(L.nodes):
        least = smaller(least, node_conditioning(L, W, w, k))
    return least


@njit
def tangential_part(L, W, w, e):
    """e (coordinates,) ← e − M⁻¹ Gᵀ S⁻¹ G e, its part along the manifold."""
    clear(W.u, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.u, 3 * s + n, e[3 * L.slot_body[s] + n], w)
    apply_g(L, W, w, W.u, W.x)
    least_motion(L, W, w, W.x, False)
    for b in range(L.bodies):
        for n in range(3):
            e[3 * b + n] -= ld(W.u, 3 * L.body_slot[b] + n, w)
