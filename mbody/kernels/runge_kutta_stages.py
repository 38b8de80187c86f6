"""Runge–Kutta formulas that one motion and many lanes have in common: one source for both.

A step of an explicit method with the coefficients A, b, c is

    Y_s = y + h Σ_{r<s} A_{sr} K_r,   K_s = f(t + c_s h, Y_s),   y₁ = y + h Σ_r b_r K_r.

Arrays are (2·coordinates,) for the witness 0.0 and (2·coordinates, lanes) for lanes.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.lanes import larger, ld, select_le, st
from mbody.kernels.step_state import FASTEST, SMOOTH_COUNT, STIFF_COUNT

__all__ = [
    "STIFF_LIMIT",
    "SAFETY",
    "along",
    "along_rate",
    "combined",
    "count_stiff",
    "hermite_cubic",
    "higher_rows",
    "next_length",
    "stable_growth",
    "stage_state",
    "stiffness_estimate",
]

#: A step is so much shorter than its error allows: of 0.7, 0.8 and 0.9 what costs the fewest
#: evaluations at one error, as fewer steps are rejected.
SAFETY = 0.8
#: A motion is stiff after so many steps that stability limits; so many in a row that it does not
#: take one off.
STIFF_LIMIT, SMOOTH_STEPS = 15.0, 6.0
#: What is left of the fastest rate after a step that does not see it.
FADING = 0.7


@njit
def combined(weights, count, K, total, w):
    """total ← Σ weights[r] K[r] over the first `count` rows."""
    first = weights[0]
    for n in range(total.shape[0]):
        st(total, n, first * ld(K[0], n, w), w)
    for r in range(1, count):
        weight, row = weights[r], K[r]
        if weight != 0.0:
            for n in range(total.shape[0]):
                st(total, n, ld(total, n, w) + weight * ld(row, n, w), w)


@njit
def stage_state(weights, count, K, y, h, target, w):
    """target ← y + h Σ weights[r] K[r]: the state of a stage, or of the end."""
    combined(weights, count, K, target, w)
    for n in range(target.shape[0]):
        st(target, n, ld(y, n, w) + h * ld(target, n, w), w)


@njit
def along(F, n, x, w):
    """What number n of a polynomial has gained at the part x of the step:
    x (F₀ + (1 − x) (F₁ + x (F₂ + (1 − x) (F₃ + …)))), by Horner's rule.
    """
    total = 0.0 * x
    for m in range(F.shape[0]):
        row = F.shape[0] - 1 - m
        total = (total + ld(F[row], n, w)) * (x if row % 2 == 0 else 1.0 - x)
    return total


@njit
def along_rate(F, n, x, w):
    """Its derivative by x."""
    total, rate = 0.0 * x, 0.0 * x
    for m in range(F.shape[0]):
        row = F.shape[0] - 1 - m
        total = total + ld(F[row], n, w)
        if row % 2 == 0:
            total, rate = total * x, rate * x + total
        else:
            total, rate = total * (1.0 - x), rate * (1.0 - x) - total
    return rate


@inline
def hermite_cubic(F, n, change, first, both):
    """F₀, F₁ and F₂ of number n by what it gains over the step, h f₀, and h (f₀ + f₁); see
    `mbody.kernels.dense_output`. Of one motion: lanes sum up in another order.
    """
    F[0, n] = change
    F[1, n] = first - change
    F[2, n] = 2.0 * change - both


@njit
def higher_rows(D, h, K, F, w):
    """Rows of F from the third on: h Σ D K."""
    for m in range(D.shape[0]):
        row = F[3 + m]
        combined(D[m], D.shape[1], K, row, w)
        for n in range(row.shape[0]):
            st(row, n, h * ld(row, n, w), w)


@njit
def stiffness_estimate(h, y, z, Ky, Kz, scale, w):
    """h |λ| by two states y and z near the end of a step and their derivatives: |f(y) − f(z)| / |y
    − z| bounds |λ| from below, and is near it where errors grow in its direction.

    Hairer, Wanner: Solving Ordinary Differential Equations II, IV.2.
    """
    turned, apart = 0.0 * ld(y, 0, w), 0.0 * ld(y, 0, w)
    for n in range(y.shape[0]):
        per = 1.0 / ld(scale, n, w)
        k, d = (ld(Ky, n, w) - ld(Kz, n, w)) * per, (ld(y, n, w) - ld(z, n, w)) * per
        turned, apart = turned + k * k, apart + d * d
    # where both states are the same nothing is stiff
    zero = 0.0 * apart
    ratio = turned / larger(apart, zero + 1e-300)
    return h * np.sqrt(select_le(apart, zero, zero, ratio))


@inline
def next_length(h, e3, e5, count, order, safety):
    """Error of a step, in tolerances, and by how much the next one may be longer, at most 6 times.

    e3, e5: sums of squares of the errors of low and of high order, over `count` numbers. The error
    is  h e₅² / √(count (e₅² + e₃²/100))  (Hairer, Nørsett, Wanner, II.10), which is never much
    greater than e₅ and falls faster with h; it goes with h^order, so that the best length is
    h · error^(−1/order).
    """
    error = 0.0 if e5 == 0.0 else h * e5 / math.sqrt((e5 + 0.01 * e3) * count)
    growth = 6.0 if error < 1e-9 else min(6.0, safety * error ** (-1.0 / order))
    return error, growth


@inline
def stable_growth(state, h, stiffness, stable):
    """By how much the step after one of length h, of h |λ| = `stiffness`, may be longer and still
    be stable for the fastest rate |λ| of the last steps. What decays fast is too small to be seen
    in many of them, and would grow in longer steps until it is.
    """
    state[FASTEST] = max(stiffness / h, FADING * state[FASTEST])
    return stable / max(h * state[FASTEST], 1e-300)


@inline
def count_stiff(state, limited):
    """Count an accepted step in the slots of one motion; `limited`: stability limits it."""
    state[SMOOTH_COUNT] = 0.0 if limited else state[SMOOTH_COUNT] + 1.0
    if limited or state[SMOOTH_COUNT] >= SMOOTH_STEPS:
        state[STIFF_COUNT] = state[STIFF_COUNT] + 1.0 if limited else 0.0
