"""Free motion: accelerations and multipliers together, [M Gᵀ; G 0] [a; λ] = [f; γ]."""

from __future__ import annotations

import numpy as np

from mbody.compiler.jit import kernel, njit
from mbody.compiler.lanes import ld, st
from mbody.kernels.constraints import rows, turns
from mbody.kernels.forces import forces, signals
from mbody.kernels.position_velocity import clear, weigh
from mbody.kernels.schur_ldl import VANISHED, apply_g, apply_gt, factor, solve

__all__ = ["balance", "free_motion", "repeat"]


@njit
def kkt(L, W, w, soft, passes):
    """a and λ at q, v, t, with W.weight the inverse masses; see `balance`."""
    signals(L, W, w, L.varying)
    turns(L, W, w)
    rows(L, W, w, True, True)
    factor(L, W, w, soft, VANISHED)
    balance(L, W, w, passes)


@njit
def balance(L, W, w, passes):
    """a and λ by the present rows and their factor. `passes` corrections by the residual serve
    massless bodies (which stand in W.weight with a small mass) and redundant rows.
    """
    forces(L, W, w, -1)
    clear(W.u, w)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            st(W.u, 3 * s + n, share * ld(W.force, o + n, w) * ld(W.weight, 3 * s + n, w), w)
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        st(W.x, n, ld(W.x, n, w) - ld(W.gamma, n, w), w)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        st(W.lam, n, ld(W.x, n, w), w)
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    for n in range(3 * L.slots):
        st(W.u, n, ld(W.u, n, w) - ld(W.r, n, w), w)
    for _ in range(passes):
        correct(L, W, w)
    for b in range(L.bodies):
        for n in range(3):
            st(W.a, 3 * b + n, ld(W.u, 3 * L.body_slot[b] + n, w), w)


@njit
def correct(L, W, w):
    """One correction of (a, λ) in (W.u, W.lam) by the residual of both equations."""
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            f = ld(W.force, o + n, w) - ld(W.mass, o + n, w) * ld(W.u, 3 * s + n, w)
            st(W.r, 3 * s + n, share * f - ld(W.r, 3 * s + n, w), w)
    weigh(L, W, w, W.r)
    # G (u + W⁻¹ r) − γ, then both corrections from one solve
    for n in range(W.u.shape[0]):
        st(W.u, n, ld(W.u, n, w) + ld(W.r, n, w), w)
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        st(W.x, n, ld(W.x, n, w) - ld(W.gamma, n, w), w)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        st(W.lam, n, ld(W.lam, n, w) + ld(W.x, n, w), w)
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    for n in range(W.u.shape[0]):
        st(W.u, n, ld(W.u, n, w) - ld(W.r, n, w), w)


@njit
def remaining(L, W, w):
    """Size of f − M a − Gᵀ λ: root of the sum of squares."""
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    rest = 0.0 * ld(W.size, 0, w)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            f = ld(W.force, o + n, w) - ld(W.mass, o + n, w) * ld(W.a, o + n, w)
            x = share * f - ld(W.r, 3 * s + n, w)
            rest = rest + x * x
    return np.sqrt(rest)


@kernel
def free_motion(L, W, soft, passes):
    """Accelerations into W.a and multipliers into W.lam at the W.q, W.v and W.time given; returns
    what is left unbalanced.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    kkt(L, W, w, soft, passes)
    return remaining(L, W, w)


@kernel
def repeat(L, W, times):
    """Evaluate `times` times at positions that differ a little, for measurements of speed."""
    total = 0.0
    for _ in range(times):
        W.q[2, 0] += 1e-9
        kkt(L, W, 0.0, 0.0, 0)
        total += W.a[0, 0]
    return total
