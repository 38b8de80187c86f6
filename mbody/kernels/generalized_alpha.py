"""One step of the generalised-α method on the accelerations of free motion.

    (1 − α_m) â₁ + α_m â₀ = (1 − α_f) a₁ + α_f a₀,  a = a(q, v, t) with its multipliers,
    q₁ = q₀ + h v₀ + h² ((½ − β) â₀ + β â₁),  v₁ = v₀ + h ((1 − γ) â₀ + γ â₁).

α_m, α_f, β and γ follow from the spectral radius ρ at infinite frequency. Newton's method for â₁:
its derivative by (1 − α_m) â₁ − (1 − α_f) a(q₁, v₁) is, with ∂v₁/∂â₁ = h γ and ∂q₁/∂â₁ = h² β,

    (1 − α_m) 1 − (1 − α_f) (h γ ∂a/∂v + h² β ∂a/∂q).

Own states have the same with their rates r,

    (1 − δ) r̂₁ + δ r̂₀ = (1 − α_f) r₁ + α_f r₀,  z₁ = z₀ + h ((1 − θ) r̂₀ + θ r̂₁),

of order 2 with θ = ½ − δ + α_f, and of the spectral radius ρ with δ = (3 ρ − 1)/(2 ρ + 2).

Chung, Hulbert (1993); the algorithmic acceleration â as of Arnold, Brüls (2007); equations of first
order: Jansen, Whiting, Hulbert (2000), beside those of mechanisms Brüls, Golinval (2006).
"""

from __future__ import annotations

import math

from mbody.core.decorators import njit
from mbody.kernels.dense_jacobian import (
    eliminate,
    iteration_matrix,
    state_jacobian,
    substitute,
)
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import EVALUATIONS, JACOBIAN_VALID, TIME

__all__ = ["generalized_alpha_step"]

#: Newton iterations, at most; more than so many want a new Jacobian for the next step.
ROUNDS, MANY = 25, 6
#: Corrections below this part of the acceleration are rounding; those that no longer shrink, below
#: the next one, or where they move less than the last, in model lengths and radians.
CLOSED, STALLED, STILL = 1e-14, 1e-10, 2e-16


@njit
def generalized_alpha_step(L, W, M, S, h, refinements):
    """S.y ← the state after one step from the time in its slot; row 0 of K is its derivative, rows
    1 to 3 are workspace. M: a `FixedStep`, whose `acceleration` (â, r̂) is carried on. Returns
    whether Newton's method converged.
    """
    y, stage, K, state, scale = S.y, S.stage, S.K, S.state, S.scale
    hat, rho, t = M.acceleration, M.spectral_radius, S.state[TIME]
    count, n3 = hat.shape[0], 3 * L.bodies
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (gamma + 0.5) ** 2
    delta = (3.0 * rho - 1.0) / (2.0 * rho + 2.0)
    theta = 0.5 - delta + alpha_f
    if state[JACOBIAN_VALID] < 0.5:
        state_jacobian(L, W, S, refinements, M.J)
        state[JACOBIAN_VALID] = 1.0
    part = 1.0 - alpha_f
    rate, place, own = part * h * gamma, part * h * h * beta, part * h * theta
    iteration_matrix(M.J, 1.0 - alpha_m, rate, place, 1.0 - delta, own, M.matrix)
    if not eliminate(M.matrix, M.exchanges):
        return False
    new, x = K[2, :count], S.error[0, :count]
    for n in range(count):
        new[n] = K[0, n3 + n]
    last, good, k = 1e300, False, 0
    while k < ROUNDS and not good:
        for n in range(n3):
            stage[n] = y[n] + h * (y[n3 + n] + h * ((0.5 - beta) * hat[n] + beta * new[n]))
            stage[n3 + n] = y[n3 + n] + h * ((1.0 - gamma) * hat[n] + gamma * new[n])
        for n in range(n3, count):
            stage[n3 + n] = y[n3 + n] + h * ((1.0 - theta) * hat[n] + theta * new[n])
        state_derivative(L, W, S, t + h, stage, 1, refinements, False)
        state[EVALUATIONS] += 1
        for n in range(count):
            x[n] = part * K[1, n3 + n] + alpha_f * K[0, n3 + n]
            older = alpha_m if n < n3 else delta
            x[n] -= (1.0 - older) * new[n] + older * hat[n]
        for n in range(n3, count):
            x[n] /= scale[n3 + n]
        substitute(M.matrix, M.exchanges, x)
        off, whole = 0.0, 0.0
        # what rates move in a step, as accelerations do
        for n in range(n3, count):
            off += (x[n] / h) ** 2
            whole += (new[n] / (h * scale[n3 + n])) ** 2
            new[n] += x[n] * scale[n3 + n]
        for n in range(n3):
            off += (x[n] / scale[n]) ** 2
            whole += (new[n] / scale[n]) ** 2 + (scale[n3 + n] / scale[n]) ** 4
            new[n] += x[n]
        k += 1
        if not off < 1e300:
            return False
        size = math.sqrt(off / whole) if whole > 0.0 else 0.0
        # at rest the accelerations of a driven mechanism are nothing but rounding
        lost = size <= STALLED or h * h * math.sqrt(off) <= STILL
        good = size <= CLOSED or (size >= 0.3 * last and lost)
        last = size
    if k > MANY:
        state[JACOBIAN_VALID] = 0.0
    if not good:
        return False
    for n in range(n3):
        y[n] += h * (y[n3 + n] + h * ((0.5 - beta) * hat[n] + beta * new[n]))
        y[n3 + n] += h * ((1.0 - gamma) * hat[n] + gamma * new[n])
        hat[n] = new[n]
    for n in range(n3, count):
        y[n3 + n] += h * ((1.0 - theta) * hat[n] + theta * new[n])
        hat[n] = new[n]
    return True
