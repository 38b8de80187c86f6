"""One step of RATTLE: symmetric, symplectic where loads have a potential, exact on constraints.

    M (v½ − v₀) = ½h (f(q₀, v½, t₀) − G₀ᵀ λ),  q₁ = q₀ + h v½,  Φ(q₁, t₁) = 0,
    M (v₁ − v½) = ½h (f(q₁, v½, t₁) − G₁ᵀ μ),  G₁ v₁ = ν(t₁).

Both halves are accelerations u = (v½ − v₀)/(½h) and u = (v₁ − v½)/(½h).

The first one is found by Newton's method with the factor of the beginning. The residuals of
M u + G₀ᵀ λ = f and of Φ(q₁) = 0, where ∂q₁/∂u = ½h² 1, are removed by the augmented system

    [M  G₀ᵀ] [δu]   [f − M u − G₀ᵀ λ]
    [G₀ 0  ] [δλ] = [−2 Φ(q₁)/h²   ],

that is S δλ = G₀ M⁻¹ (f − M u − G₀ᵀ λ) + 2 Φ/h² with S = G₀ M⁻¹ G₀ᵀ.

The second one is the augmented system of `mbody.kernels.accelerations` as it is, since
G₁ v₁ = ν requires G₁ u = (ν − G₁ v½)/(½h), which takes the place of γ.

Loads take the velocity in the middle in both halves, so that the step is its own reverse with
dampers too. Andersen, Rattle (1983); Hairer, Lubich, Wanner: Geometric Numerical Integration,
VII.1.
"""

from __future__ import annotations

import math

from mbody.core.decorators import njit
from mbody.kernels.accelerations import augmented_solution
from mbody.kernels.constraints import rows, turns
from mbody.kernels.forces import forces, signals
from mbody.kernels.position_velocity import clear, weigh
from mbody.kernels.schur_ldl import VANISHED, apply_g, apply_gt, factor, solve
from mbody.kernels.step_state import EVALUATIONS

__all__ = ["factor_position", "rattle_step"]

#: Newton iterations for the position, at most.
ROUNDS = 60
#: A correction below this, in model lengths and radians, is rounding; one below the next, which no
#: longer shrinks, too.
CLOSED, STALLED = 2e-16, 1e-13


@njit
def rattle_step(L, W, M, S, t, h, refinements):
    """S.y ← the state after one step from t.

    Row 0 of K holds an acceleration to begin with, and that of the end. M: a `FixedStep`, whose
    `blocks` is workspace for those of the rows. Needs the rows and the factor of the position (of
    `factor_position` or of the step before) and its multipliers; leaves those of the end. Returns
    whether Newton's method converged.
    """
    n3, w, y, blocks = 3 * L.bodies, 0.0, S.y, M.blocks
    u = S.K[0, n3:]
    for n in range(blocks.shape[0]):
        blocks[n] = W.block[n, 0]
    last, good = 1e300, False
    for _ in range(ROUNDS):
        size = first_half(L, W, y, u, t, h, blocks)
        if not size < 1e6:
            return False
        if size <= CLOSED or (size <= STALLED and size >= 0.5 * last):
            good = True
            break
        last = size
    if not good:
        return False
    for n in range(n3):
        half = y[n3 + n] + 0.5 * h * u[n]
        y[n] += h * half
        W.q[n, 0], W.v[n, 0] = y[n], half
        y[n3 + n] = half
    factor_position(L, W, t + h, S.regularization)
    # G₁ u = (ν − G₁ v½)/(½h) takes the place of γ
    clear(W.u, w)
    for s in range(3 * L.slots):
        W.u[s, 0] = W.v[3 * L.slot_body[s // 3] + s % 3, 0]
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        W.gamma[n, 0] = (W.nu[n, 0] - W.x[n, 0]) * 2.0 / h
    augmented_solution(L, W, w, refinements)
    for n in range(n3):
        u[n] = W.a[n, 0]
        y[n3 + n] += 0.5 * h * u[n]
    S.state[EVALUATIONS] += 1
    return True


@njit
def factor_position(L, W, t, regularization):
    """Rows and factor of the position W.q."""
    W.time[0, 0] = t
    signals(L, W, 0.0, L.varying)
    turns(L, W, 0.0)
    rows(L, W, 0.0, True, None)
    factor(L, W, 0.0, regularization, VANISHED)


@njit
def first_half(L, W, y, u, t, h, blocks):
    """One Newton iteration for the acceleration u (coordinates,) of the first half and for W.lam,
    with the factor at the beginning. Returns the size of the correction, as of positions.
    """
    n3, w = 3 * L.bodies, 0.0
    # Φ(q₁)
    W.time[0, 0] = t + h
    signals(L, W, w, L.varying)
    for n in range(n3):
        W.q[n, 0] = y[n] + h * (y[n3 + n] + 0.5 * h * u[n])
    turns(L, W, w)
    rows(L, W, w, True, None)
    for n in range(blocks.shape[0]):
        W.block[n, 0] = blocks[n]
    # f(q₀, v½, t₀)
    W.time[0, 0] = t
    signals(L, W, w, L.varying)
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = y[n], y[n3 + n] + 0.5 * h * u[n]
    turns(L, W, w)
    forces(L, W, w, -1)
    # W.u ← M⁻¹ (f − M u − G₀ᵀ λ)
    clear(W.u, w)
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    for s in range(L.slots):
        o = 3 * L.slot_body[s]
        for n in range(3):
            off = W.share[s, 0] * (W.force[o + n, 0] - W.mass[o + n, 0] * u[o + n])
            W.u[3 * s + n, 0] = off - W.r[3 * s + n, 0]
    weigh(L, W, w, W.u)
    # S δλ = G₀ W.u + 2 Φ/h²
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        W.x[n, 0] += 2.0 * W.phi[n, 0] / (h * h)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        W.lam[n, 0] += W.x[n, 0]
    # δu = W.u − M⁻¹ G₀ᵀ δλ
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    total, per_length = 0.0, 1.0 / W.size[0, 0]
    for b in range(L.bodies):
        s = 3 * L.body_slot[b]
        for n in range(3):
            change = W.u[s + n, 0] - W.r[s + n, 0]
            u[3 * b + n] += change
            total += (change * (per_length if n < 2 else 1.0)) ** 2
    return 0.5 * h * h * math.sqrt(total)
