"""One step of the generalised-α method on the accelerations of free motion.

    (1 − α_m) â₁ + α_m â₀ = (1 − α_f) a₁ + α_f a₀,  a = a(q, v, t) with its multipliers,
    q₁ = q₀ + h v₀ + h² ((½ − β) â₀ + β â₁),  v₁ = v₀ + h ((1 − γ) â₀ + γ â₁).

Chung, Hulbert (1993); the algorithmic acceleration â as of Arnold, Brüls (2007).
"""

from __future__ import annotations

import math

from mbody.compiler.jit import njit
from mbody.kernels.dense_jacobian import eliminate, iteration_matrix, substitute, tangents
from mbody.kernels.state_derivative import slope
from mbody.kernels.step_state import FRESH, SLOPES

__all__ = ["alpha_step"]

#: Rounds of corrections, at most; more than so many want new tangents for the next step.
ROUNDS, MANY = 25, 6
#: Corrections below this part of the acceleration are rounding; those that no longer shrink, below
#: the next one, or where they move less than the last, in model lengths and radians.
CLOSED, STALLED, STILL = 1e-14, 1e-10, 2e-16


@njit
def alpha_step(L, W, soft, passes, rho, t, h, y, K, P, ys, x, hat, scale, Jq, Jv, S, pivots, state):
    """y (2·coordinates,) ← the state after one step from t, whose slope is row 0 of K; hat
    (coordinates,) ← â. Rows 1 and 3 of K are room. Returns whether it converged.
    """
    n3 = hat.shape[0]
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (gamma + 0.5) ** 2
    if state[FRESH] < 0.5:
        tangents(L, W, t, y, K, P, ys, scale, soft, passes, Jq, Jv, state)
        state[FRESH] = 1.0
    part = 1.0 - alpha_f
    iteration_matrix(Jq, Jv, 1.0 - alpha_m, part * h * gamma, part * h * h * beta, S)
    if not eliminate(S, pivots):
        return False
    new = K[2, :n3]
    for n in range(n3):
        new[n] = K[0, n3 + n]
    last, good, k = 1e300, False, 0
    while k < ROUNDS and not good:
        for n in range(n3):
            ys[n] = y[n] + h * (y[n3 + n] + h * ((0.5 - beta) * hat[n] + beta * new[n]))
            ys[n3 + n] = y[n3 + n] + h * ((1.0 - gamma) * hat[n] + gamma * new[n])
        slope(L, W, t + h, ys, K[1], P[1], soft, passes, False)
        state[SLOPES] += 1
        for n in range(n3):
            x[n] = part * K[1, n3 + n] + alpha_f * K[0, n3 + n]
            x[n] -= (1.0 - alpha_m) * new[n] + alpha_m * hat[n]
        substitute(S, pivots, x)
        off, whole = 0.0, 0.0
        for n in range(n3):
            off += (x[n] / scale[n]) ** 2
            whole += (new[n] / scale[n]) ** 2 + (scale[n3 + n] / scale[n]) ** 4
            new[n] += x[n]
        k += 1
        if not off < 1e300:
            return False
        near = math.sqrt(off / whole) if whole > 0.0 else 0.0
        # at rest the accelerations of a driven mechanism are nothing but rounding
        lost = near <= STALLED or h * h * math.sqrt(off) <= STILL
        good = near <= CLOSED or (near >= 0.3 * last and lost)
        last = near
    if k > MANY:
        state[FRESH] = 0.0
    if not good:
        return False
    for n in range(n3):
        y[n] += h * (y[n3 + n] + h * ((0.5 - beta) * hat[n] + beta * new[n]))
        y[n3 + n] += h * ((1.0 - gamma) * hat[n] + gamma * new[n])
        hat[n] = new[n]
    return True
