"""Explicit Runge–Kutta integrator of one free motion, each step ended by a projection.

Every step ends with the projection of position and velocity onto Φ = 0 and Φ_q v = ν in the metric
of the masses (`mbody.kernels.loop_closure`), and the next begins with the derivative there.
Between, stages run off the manifold by as much as their error. That is harmless but near a singular
position, where the right-hand side has no smooth continuation off the manifold: there every stage
is projected too, a = f(P(y)), with the refinements that nearly dependent rows want, and the error
is taken of what a projection keeps. Neither the multipliers, which grow without bound there, nor
the noise across the manifold then decide the length of a step.

What a step of one motion and steps on lanes have in common is `mbody.kernels.dense_output`;
why the loops are two is explained in `mbody.kernels.runge_kutta_lanes`.

Hairer, Nørsett, Wanner: Solving Ordinary Differential Equations I, II.5 and II.6 (the methods), and
II, IV.2 (how stiffness shows); Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4
(projection).
"""

from __future__ import annotations

import math

from mbody.core.decorators import kernel, njit
from mbody.core.tolerances import (
    ACCELERATION_ROUNDING,
    ACCELERATION_ROUNDING_NEAREST,
    CONDITIONING_CLOSE,
    CONDITIONING_NEAR_SINGULAR,
    CONDITIONING_NO_END,
    FINITE,
    PROJECTION_GREATEST,
    PROJECTION_SURE,
    SINGULAR_STEP_BACK,
    SINGULAR_STEP_BEFORE,
    SINGULAR_STEP_TWICE,
    SINGULAR_TIME_SHORTEST,
    STEP_SAFETY,
    STEP_SAFETY_NEAR_SINGULAR,
    STEP_STIFF_LIMIT,
    TIME_END_ROUNDING,
    TIME_STEP_SHORTEST,
    TIME_STEP_SHORTEST_REJECTED,
)
from mbody.kernels.dense_output import (
    combined,
    count_stiff,
    deliver,
    deliver_checked,
    has_instant,
    hermite_cubic,
    higher_rows,
    next_length,
    stable_growth,
    stage_state,
    stiffness_estimate,
)
from mbody.kernels.layout import Layout, Work
from mbody.kernels.loop_closure import least_conditioning, tangential_part
from mbody.kernels.singularity_monitor import may_be_singular, record_accepted, sample_conditioning
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    ARTIFICIAL_LIMIT,
    BEST_CONDITIONING,
    BRANCH_UNCERTAIN,
    CONDITIONING,
    CROSSING_TIME,
    DECIDE_BELOW,
    DONE,
    END_TRIES,
    EVALUATIONS,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    LONGEST_STEP,
    MORE,
    NEAR_SINGULAR,
    NEAR_SINGULAR_STEPS,
    NEXT,
    NOT_FINITE,
    REJECTED,
    SHORTENED_UNTIL,
    STAGE_TRIES,
    STEP_VANISHED,
    STEPS,
    STIFF,
    STIFF_COUNT,
    THROUGHPUT,
    TIME,
    TRIED,
    TRIED_CONDITIONING,
    TRIED_END,
    TRIED_GROWTH,
    TRIED_LEAST,
    TRIED_LEAST_AT,
    TRIED_LENGTH,
    Outputs,
    Stepping,
    Tolerances,
)
from mbody.kernels.tableaus import Explicit

#: Steps of one passage that are tried again so that no stage, or no end, lies at the position.
STAGES_AGAIN, ENDS_AGAIN = 3.0, 8.0


@njit
def length_to_target(h, until, state):
    """The length h of a step near a singular position, changed so that neither its end nor a stage
    lies at the one that is known: all nodes of the methods keep a tenth of the step from its
    middle. Returns whether there is one ahead, too, and whether the step goes over it.
    """
    t = state[TIME]
    way = state[CROSSING_TIME] - t
    if (
        not way > SINGULAR_TIME_SHORTEST * max(abs(t), abs(until))
        or t + SINGULAR_STEP_TWICE * way >= until
    ):
        return h, False, False
    if h >= way:
        return SINGULAR_STEP_TWICE * way, True, True
    return min(h, SINGULAR_STEP_BEFORE * way), True, False


@njit
def dense_output(L, W, method, S, h, refinements):
    """S.F and S.G of the polynomials of state and work over a step from S.last to S.end, by the
    further derivatives that the method takes for them.

    The first three rows are Hermite's cubic (`mbody.kernels.dense_output`), the others h Σ D K.
    """
    A, B, C, D = method.A, method.B, method.C, method.D
    y, last, K, P, F, G = S.end, S.last, S.K, S.P, S.F, S.G
    end = B.shape[0]
    for s in range(end + 1, A.shape[0]):
        stage_state(A[s], s, K, last, h, S.stage, 0.0)
        state_derivative(L, W, S, S.state[TIME] + C[s] * h, S.stage, s, refinements, False)
        S.state[EVALUATIONS] += 1
    for n in range(y.shape[0]):
        hermite_cubic(F, n, y[n] - last[n], h * K[0, n], h * (K[end, n] + K[0, n]))
    for c in range(P.shape[1]):
        hermite_cubic(G, c, h * mean_power(B, P, c), h * P[0, c], h * (P[end, c] + P[0, c]))
    higher_rows(D, h, K, F, 0.0)
    higher_rows(D, h, P, G, 0.0)


@njit
def mean_power(B, P, c):
    """Mean power of cause c over a step: Σ b_r P_r."""
    whole = 0.0
    for r in range(B.shape[0]):
        whole += B[r] * P[r, c]
    return whole


@njit
def work_errors(L, W, method, S, T, h):
    """Sums of the squares of the errors of all works over a step, in tolerances, of low and of high
    order.

    Where drivers lead, the motion says nothing of how well the steps resolve the work of friction.
    A work may err by a part of all the work so far, and by what the loads do at rates that count
    as none.
    """
    E, P, n3 = method.E, S.P, 3 * L.bodies
    unit = S.state[THROUGHPUT]
    for c in range(P.shape[1]):
        unit += abs(h * mean_power(method.B, P, c))
    unit *= T.relative
    for n in range(n3):
        unit += T.absolute * abs(h * W.force[n, 0]) * S.scale[n3 + n]
    low, high = 0.0, 0.0
    if unit > 0.0:
        for c in range(P.shape[1]):
            e3, e5 = 0.0, 0.0
            for r in range(E.shape[1]):
                e3 += E[0, r] * P[r, c]
                e5 += E[1, r] * P[r, c]
            low += (e3 / unit) ** 2
            high += (e5 / unit) ** 2
    return low, high


@njit
def attempt(L, W, method, S, T, until):
    """One step towards `until` is tried from S.y: TRIED where it is good, its end in S.end and the
    last row of K; MORE where it is to be tried again with another length; else why there is none
    (DONE, LAST_STEP, STEP_VANISHED, NOT_FINITE, BRANCH_UNCERTAIN).
    """
    A, B, C, E, sample = method.A, method.B, method.C, method.E, method.sample
    y, K, state, scale = S.y, S.K, S.state, S.scale
    stage, end, last, low_error, error_row = S.stage, S.end, S.last, S.error[0], S.error[1]
    end_row = B.shape[0]
    # whether the error takes the derivative at the end
    early = E.shape[1] > end_row
    w, size, frictional = 0.0, y.shape[0], L.friction_kind.shape[0] > 0
    n3, velocity_scale = 3 * L.bodies, scale[6 * L.bodies - 1]
    rtol, atol, regular = T.relative, T.absolute, T.refinements
    t, h = state[TIME], state[NEXT]
    if t >= until:
        return DONE
    clipped = t + h >= until - TIME_END_ROUNDING * abs(until)
    if clipped and state[LAST_STEP_ALLOWED] < 0.5:
        return LAST_STEP
    near_singular, known, over = state[NEAR_SINGULAR] > 0.5, False, False
    if clipped:
        h = until - t
    elif near_singular:
        h, known, over = length_to_target(h, until, state)
    if h < TIME_STEP_SHORTEST * max(abs(t), abs(until)) and not clipped:
        return STEP_VANISHED
    refinements = T.full_refinements if near_singular else regular
    # ---- stages: Y_s = y + h Σ A_sr K_r, K_s = f(t + c_s h, Y_s)
    good, off_branch, least, least_at = True, False, state[CONDITIONING], t
    for s in range(1, end_row):
        stage_state(A[s], s, K, y, h, stage, w)
        far, fast, good = state_derivative(
            L, W, S, t + C[s] * h, stage, s, refinements, near_singular
        )
        state[EVALUATIONS] += 1
        if not good:
            break
        if sample[s] == 0:
            part = least_conditioning(L, W, w)
        else:
            part = sample_conditioning(L, W, w, sample[s])
        if part < least:
            least, least_at = part, t + C[s] * h
        if near_singular:
            # what projections move along the manifold is of second order in what they move
            # across it, by how far the singular position is
            apart = math.sqrt(part / state[BEST_CONDITIONING])
            moved = far * far / apart + h * (fast / apart) ** 2 / velocity_scale
            close = apart < CONDITIONING_CLOSE and moved > PROJECTION_GREATEST * rtol
            off_branch = off_branch or close or far > PROJECTION_SURE * apart
    if not good:
        state[REJECTED] += 1
        state[NEXT] = (SINGULAR_STEP_BACK if over else 0.5) * h
        return MORE
    if off_branch and not known and state[STAGE_TRIES] < STAGES_AGAIN:
        state[STAGE_TRIES] += 1.0
        state[NEXT] = 0.91 * h
        return MORE
    if least < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING] and not near_singular:
        # errors of stages fall with the fourth power of the step, and here their squares count
        state[NEAR_SINGULAR], state[LONGEST_STEP] = 1.0, 0.25 * h
        state[NEXT] = state[LONGEST_STEP]
        return MORE
    # ---- the end: y₁ = y + h Σ b_r K_r, projected
    stage_state(B, end_row, K, y, h, end, w)
    for n in range(size):
        last[n] = y[n]
    if near_singular or early:
        _, _, good = state_derivative(L, W, S, t + h, end, end_row, refinements, True)
        state[EVALUATIONS] += 1
    # ---- the error, in tolerances
    combined(E[0], E.shape[1], K, low_error, w)
    combined(E[1], E.shape[1], K, error_row, w)
    if near_singular:
        for row in range(2):
            for half in range(2):
                tangential_part(L, W, w, S.error[row, half * n3 : (half + 1) * n3])
    e3, e5, noise = 0.0, 0.0, 0.0
    if near_singular:
        noise = (
            ACCELERATION_ROUNDING
            * h
            * velocity_scale
            / max(least / state[BEST_CONDITIONING], ACCELERATION_ROUNDING_NEAREST)
        )
    # both norms in one loop: with one at a time, as in `radau`, the compiler fuses products in
    # another way, to other last digits
    for n in range(size):
        unit = (atol + noise) * scale[n] + rtol * max(abs(y[n]), abs(end[n]))
        e3 += (low_error[n] / unit) ** 2
        e5 += (error_row[n] / unit) ** 2
    if frictional:
        low, high = work_errors(L, W, method, S, T, h)
        e3, e5 = e3 + low, e5 + high
    if not (e5 < FINITE) or not good:
        state[NEXT] = (SINGULAR_STEP_BACK if over else 0.5 if near_singular else 0.25) * h
        state[REJECTED] += 1
        if h < TIME_STEP_SHORTEST_REJECTED * max(abs(t), abs(until)):
            return NOT_FINITE
        return MORE
    safety = STEP_SAFETY_NEAR_SINGULAR if near_singular else STEP_SAFETY
    error, growth = next_length(h, e3, e5, size, method.order, safety)
    if error > 1.0:
        state[REJECTED] += 1
        state[NEXT] = h * (SINGULAR_STEP_BACK if over else max(0.2, growth))
        return MORE
    if not (near_singular or early):
        _, _, good = state_derivative(L, W, S, t + h, end, end_row, regular, True)
        state[EVALUATIONS] += 1
        if not good:
            state[REJECTED] += 1
            state[NEXT] = 0.5 * h
            return MORE
    # ---- the branch: no singular position may lie within the step unseen
    part = sample_conditioning(L, W, w, sample[end_row])
    if may_be_singular(L, W, S, method.at, end, near_singular):
        state[REJECTED] += 1
        state[NEXT] = 0.5 * h
        if t > state[SHORTENED_UNTIL]:
            # an ordinary step is tried shorter first
            state[SHORTENED_UNTIL] = t + h
            state[DECIDE_BELOW] = (2.0 if near_singular else 0.3) * h
        if h < state[DECIDE_BELOW]:
            return BRANCH_UNCERTAIN
        return MORE
    ends_there = part < CONDITIONING_NO_END * state[BEST_CONDITIONING]
    if ends_there and state[END_TRIES] < ENDS_AGAIN and not (clipped or known):
        # a step begins badly at a singular position: end after it, or before
        state[END_TRIES] += 1
        state[NEXT] = h * (1.2 if state[END_TRIES] < 5.0 else 0.5)
        return MORE
    state[TRIED_LENGTH], state[TRIED_END] = h, until if clipped else t + h
    state[TRIED_GROWTH], state[TRIED_CONDITIONING] = growth, part
    state[TRIED_LEAST], state[TRIED_LEAST_AT] = least, least_at
    return TRIED


@njit
def accept(L, W, method, S, T, O, until, dense):
    """Accept the step that was tried, keeping every output instant that it meets: MORE to go on,
    or STIFF. `dense`: whether its polynomials are known.
    """
    y, K, P, state, end = S.y, S.K, S.P, S.state, S.end
    end_row, size, causes = method.B.shape[0], y.shape[0], P.shape[1]
    h, now, growth = state[TRIED_LENGTH], state[TRIED_END], state[TRIED_GROWTH]
    part, least, least_at = state[TRIED_CONDITIONING], state[TRIED_LEAST], state[TRIED_LEAST_AT]
    near_singular, clipped, regular = state[NEAR_SINGULAR] > 0.5, now == until, T.refinements
    for n in range(size):
        y[n] = end[n]
    state[CONDITIONING] = part
    state[BEST_CONDITIONING] = max(part, state[BEST_CONDITIONING])
    if part < least:
        least, least_at = part, now
    record_accepted(L, W, S, method.sample[end_row], least, least_at, regular > 0)
    state[STEPS] += 1
    state[LAST_STEP_ALLOWED] = 0.0
    state[NEAR_SINGULAR_STEPS] += 1.0 if near_singular else 0.0
    still_near = near_singular and least < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]
    state[NEAR_SINGULAR] = 1.0 if still_near else 0.0
    if not (near_singular or clipped):
        stiffness = stiffness_estimate(h, y, S.stage, K[end_row], K[end_row - 1], S.scale, 0.0)
        count_stiff(state, growth * stiffness > method.stable)
        growth = min(growth, stable_growth(state, h, stiffness, method.stable))
    for c in range(causes):
        S.G[0, c] = h * mean_power(method.B, P, c)
        state[THROUGHPUT] += abs(S.G[0, c])
    if not dense and has_instant(S, O, now):
        dense_output(L, W, method, S, h, regular)
    for n in range(size):
        K[0, n] = K[end_row, n]
    for c in range(causes):
        P[0, c] = P[end_row, c]
    if near_singular:
        deliver(L, W, S, O, h, now, T.full_refinements)
    else:
        deliver_checked(L, W, method, S, T, O, h, now)
    # ---- the length of the next step
    state[TIME] = now
    wanted = h * max(0.2, growth)
    state[NEXT] = max(wanted, state[NEXT]) if clipped else wanted
    if state[NEAR_SINGULAR] > 0.5:
        state[NEXT] = min(state[NEXT], state[LONGEST_STEP])
    else:
        state[END_TRIES] = state[STAGE_TRIES] = 0.0
    if state[STIFF_COUNT] >= STEP_STIFF_LIMIT and until - now > T.patience * state[NEXT]:
        return STIFF
    return MORE


@kernel
def runge_kutta(
    L: Layout,
    W: Work,
    method: Explicit,
    S: Stepping,
    T: Tolerances,
    O: Outputs,
    until: float,
    steps: int,
) -> int:
    """At most so many steps towards `until`; every output instant that is met is kept.

    method: an `Explicit`; S: a `Stepping` with K (len(A), ·), F and G (3 + len(D), ·); T: a
    `Tolerances`; O: an `Outputs`.
    Returns DONE, MORE, STEP_VANISHED, NOT_FINITE, STIFF, LAST_STEP or BRANCH_UNCERTAIN.
    """
    for _ in range(steps):
        code = attempt(L, W, method, S, T, until)
        if code == TRIED:
            code = accept(L, W, method, S, T, O, until, False)
            if S.state[ARTIFICIAL_ENERGY] > S.state[ARTIFICIAL_LIMIT]:
                return MORE
        if code != MORE:
            return code
    return MORE
