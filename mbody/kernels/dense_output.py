"""Dense output: states and work within a step, by polynomials, and the instants that are kept.

A polynomial has rows F as

    Δ(x) = x (F₀ + (1 − x) (F₁ + x (F₂ + (1 − x) (F₃ + …)))),   x the part of the step.

All terms but the first vanish at both ends, so that Δ(1) = F₀ is the change over the step, exactly.
Its rates there give the next two: Δ′(0) = F₀ + F₁ = h f₀ and Δ′(1) = F₀ − F₁ − F₂ = h f₁, hence

    F₀ = y₁ − y₀,   F₁ = h f₀ − F₀,   F₂ = 2 F₀ − h (f₀ + f₁),

which is Hermite's cubic; further rows come from further derivatives within the step.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.lanes import larger, ld, select_le, st
from mbody.core.tolerances import (
    STEP_ERROR_NONE,
    STEP_INTERPOLATION_DOUBTFUL,
    STEP_RATE_FADING,
    STEP_STIFF_SMOOTH,
    TINY,
)
from mbody.kernels.layout import keep
from mbody.kernels.singularity_monitor import sample_conditioning
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    DELIVERED,
    EVALUATIONS,
    FASTEST,
    LIMITED_INSTANTS,
    SMOOTH_COUNT,
    STIFF_COUNT,
    TIME,
)

# -- Runge–Kutta formulas shared by one motion and many lanes ----------------------------------
#
# A step of an explicit method with the coefficients A, b, c is
#
#     Y_s = y + h Σ_{r<s} A_{sr} K_r,   K_s = f(t + c_s h, Y_s),   y₁ = y + h Σ_r b_r K_r.
#
# Arrays are (2·coordinates,) for the witness 0.0 and (2·coordinates, lanes) for lanes.


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
    """Increment of number n of a polynomial at the part x of the step: x (F₀ + (1 − x) (F₁ + x (F₂
    + (1 − x) (F₃ + …)))), by Horner's rule.
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
    ratio = turned / larger(apart, zero + TINY)
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
    growth = 6.0 if error < STEP_ERROR_NONE else min(6.0, safety * error ** (-1.0 / order))
    return error, growth


@inline
def stable_growth(state, h, stiffness, stable):
    """By how much the step after one of length h, of h |λ| = `stiffness`, may be longer and still
    be stable for the fastest rate |λ| of the last steps. What decays fast is too small to be seen
    in many of them, and would grow in longer steps until it is.
    """
    state[FASTEST] = max(stiffness / h, STEP_RATE_FADING * state[FASTEST])
    return stable / max(h * state[FASTEST], TINY)


@inline
def count_stiff(state, limited):
    """Count an accepted step in the slots of one motion; `limited`: stability limits it."""
    state[SMOOTH_COUNT] = 0.0 if limited else state[SMOOTH_COUNT] + 1.0
    if limited or state[SMOOTH_COUNT] >= STEP_STIFF_SMOOTH:
        state[STIFF_COUNT] = state[STIFF_COUNT] + 1.0 if limited else 0.0


#: Nodes of Lobatto's rule of order 6, between the ends.
FIRST, SECOND = 0.5 - math.sqrt(0.05), 0.5 + math.sqrt(0.05)


@njit
def has_instant(S, O, now):
    """Whether an output instant lies before the end of the step."""
    k = int(S.state[DELIVERED])
    return k < O.times.shape[0] and O.times[k] < now


@njit
def deliver(L, W, S, O, h, now, refinements):
    """Keep every output instant from the time of the motion to `now`, the end of a step of length
    h from S.last to S.y.

    S: a `Stepping`, whose F and G are the polynomials of state and work; of them G₀ alone must be
    there where no instant lies inside. Rows 1 of K and P are workspace. O: an `Outputs`.
    """
    while is_met(S, O, now):
        x = interpolate(S, O, h, now)
        at = O.times[int(S.state[DELIVERED])]
        state_derivative(L, W, S, at, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        keep_instant(L, W, S, O, x)
    keep_work(S, O)


@njit
def is_met(S, O, now):
    """Whether the next output instant lies within the step, or at its end."""
    k = int(S.state[DELIVERED])
    return k < O.times.shape[0] and O.times[k] <= now


@njit
def interpolate(S, O, h, now):
    """S.stage ← the state at the next output instant; returns its part of the step, 1 at the end,
    where the state is that of the step.
    """
    at = O.times[int(S.state[DELIVERED])]
    whole = at >= now
    x = 1.0 if whole else (at - S.state[TIME]) / h
    for n in range(S.y.shape[0]):
        S.stage[n] = S.y[n] if whole else S.last[n] + along(S.F, n, x, 0.0)
    return x


@njit
def keep_instant(L, W, S, O, x):
    """Keep the next output instant, at the part x of the step, which was evaluated."""
    k, count, G = int(S.state[DELIVERED]), O.times.shape[0], S.G
    keep(L, W, 0.0, O.pages[k])
    for c in range(G.shape[1]):
        O.work[k, c] = O.work[count, c]
        O.work[k, c] += G[0, c] if x == 1.0 else along(G, c, x, 0.0)
    S.state[DELIVERED] = k + 1


@njit
def keep_work(S, O):
    """The work done until now ← with that of the step."""
    for c in range(S.G.shape[1]):
        O.work[O.times.shape[0], c] += S.G[0, c]


@njit
def clear_rows(S, first):
    """No terms of polynomials from that row on, which those of explicit steps have."""
    for row in range(first, S.F.shape[0]):
        for n in range(S.F.shape[1]):
            S.F[row, n] = 0.0
        for c in range(S.G.shape[1]):
            S.G[row, c] = 0.0


@njit
def hermite_output(L, W, S, h, refinements):
    """S.F (5, states) and S.G (5, causes) of a step from S.last to S.end, by derivatives at both
    ends: rows 0 and 3 of K and P; rows 1 and 2 are workspace.

    The position has order 5: F₃ and F₄ follow from the accelerations of both ends, of which
    Δ″(0) = h² a₀ and Δ″(1) = h² a₁ are half of the values below. The velocity is the cubic and one
    term more, with which it has in the middle the rate of the position. Auxiliary states have the
    cubic. Work by Lobatto's rule of order 6, (p₀ + 5 p₁ + 5 p₂ + p₃)/12.

    Returns the least conditioning of its two inner nodes, which are samples 1 and 2 of the step,
    and the node.
    """
    least, least_at = 1.0, SECOND
    K, P, F, G, y, last, stage = S.K, S.P, S.F, S.G, S.end, S.last, S.stage
    n3 = 3 * L.bodies
    for n in range(n3):
        m = n3 + n
        change = y[n] - last[n]
        hermite_cubic(F, n, change, h * K[0, n], h * (K[0, n] + K[3, n]))
        # ½ Δ″(0) = −F₁ + F₂ + F₃,  ½ Δ″(1) = −F₁ − 2 F₂ + F₃ + F₄
        F[3, n] = 0.5 * h * h * K[0, m] + F[1, n] - F[2, n]
        F[4, n] = 0.5 * h * h * K[3, m] + F[1, n] + 2.0 * F[2, n] - F[3, n]
        change = y[m] - last[m]
        hermite_cubic(F, m, change, h * K[0, m], h * (K[0, m] + K[3, m]))
        # Δ′(½)/h of the position, and the cubic of the velocity there; F₃ has the factor 1/16
        middle = (F[0, n] + 0.25 * F[2, n] + 0.0625 * F[4, n]) / h
        cubic = last[m] + 0.5 * (F[0, m] + 0.5 * (F[1, m] + 0.5 * F[2, m]))
        F[3, m] = 16.0 * (middle - cubic)
        F[4, m] = 0.0
    for n in range(2 * n3, y.shape[0]):
        hermite_cubic(F, n, y[n] - last[n], h * K[0, n], h * (K[0, n] + K[3, n]))
        F[3, n] = F[4, n] = 0.0
    for row in range(1, 3):
        x = FIRST if row == 1 else SECOND
        for n in range(y.shape[0]):
            stage[n] = last[n] + along(F, n, x, 0.0)
        state_derivative(L, W, S, S.state[TIME] + x * h, stage, row, refinements, False)
        S.state[EVALUATIONS] += 1
        part = sample_conditioning(L, W, 0.0, row)
        if part < least:
            least, least_at = part, x
    x = FIRST
    for c in range(G.shape[1]):
        first, end = h * P[0, c], h * P[3, c]
        G[0, c] = (first + end + 5.0 * h * (P[1, c] + P[2, c])) / 12.0
        G[1, c] = first - G[0, c]
        G[2, c] = 2.0 * G[0, c] - first - end
        # rate of the cubic at the first inner node: what it lacks to the power there is that of F₃
        left = h * P[1, c] - G[0, c] - (1.0 - 2.0 * x) * G[1, c] - x * (2.0 - 3.0 * x) * G[2, c]
        G[3, c] = left / (2.0 * x * (1.0 - x) * (1.0 - 2.0 * x))
        G[4, c] = 0.0
    clear_rows(S, 5)
    return least, least_at


# -- Output instants within explicit steps, checked against the equations of motion ------------
#
# A polynomial Δ(x) between the ends of a step is as good as the step where the step is short for
# all that moves. Where stability limits steps it is not: what decays fast has h |λ| of five to
# thirty there, and is so small that the ends are right to the tolerance, but the polynomial is off
# by up to ten thousand of it; nor is it where loads jump within the step. As every instant that is
# kept is evaluated, what it lacks to the equations is known,
#
#     δ = h f(Δ(x)) − Δ′(x),
#
# and δ/8 is the error, for a polynomial of order 7 by its derivative, and for h |λ| ≈ 8 by the
# Jacobian; measured on motions of either kind it is right to a factor of two. An instant of which
# it is more than a few tolerances gets a step of its own from the beginning of the step.


@njit
def deliver_checked(L, W, method, S, T, O, h, now):
    """Delivery of the times within a step (`deliver`), each interpolation checked; rows of K and P
    but the first, and S.end, are workspace.
    """
    refinements, doubtful = T.full_refinements, False
    while is_met(S, O, now):
        x = interpolate(S, O, h, now)
        at = O.times[int(S.state[DELIVERED])]
        state_derivative(L, W, S, at, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        # it changes its sign within the step: what follows a doubtful one is doubtful too
        doubtful = doubtful or interpolation_error(S, T, h, x) > STEP_INTERPOLATION_DOUBTFUL
        if x < 1.0 and doubtful:
            if h * S.state[FASTEST] > 0.5 * method.stable:
                S.state[LIMITED_INSTANTS] += 1
            if not step_within(L, W, method, S, T, x * h):
                interpolate(S, O, h, now)
            state_derivative(L, W, S, at, S.stage, 1, refinements, True)
            S.state[EVALUATIONS] += 1
        keep_instant(L, W, S, O, x)
    keep_work(S, O)


@njit
def interpolation_error(S, T, h, x):
    """Mean square of what the polynomial lacks to the derivative in row 1 of K, in tolerances."""
    total, size = 0.0, S.y.shape[0]
    for n in range(size):
        unit = T.absolute * S.scale[n] + T.relative * max(abs(S.y[n]), abs(S.last[n]))
        total += ((h * S.K[1, n] - along_rate(S.F, n, x, 0.0)) / unit) ** 2
    return total / size


@njit
def step_within(L, W, method, S, T, h):
    """S.stage ← the state after a shorter step from S.last; whether its loops close."""
    A, B, C, K, last, stage = method.A, method.B, method.C, S.K, S.last, S.stage
    t, end_row, size = S.state[TIME], method.B.shape[0], S.y.shape[0]
    for n in range(size):
        S.end[n], stage[n] = K[0, n], last[n]
    # row 0 of P is that of the end
    _, _, good = state_derivative(L, W, S, t, stage, 1, T.refinements, False)
    for n in range(size):
        K[0, n] = K[1, n]
    for s in range(1, end_row):
        stage_state(A[s], s, K, last, h, stage, 0.0)
        _, _, closes = state_derivative(L, W, S, t + C[s] * h, stage, s, T.refinements, False)
        good = good and closes
    S.state[EVALUATIONS] += end_row
    stage_state(B, end_row, K, last, h, stage, 0.0)
    for n in range(size):
        K[0, n] = S.end[n]
    return good
