"""Integrators of steps of one length: generalised-α, or RATTLE and its compositions."""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import njit
from mbody.core.tolerances import (
    CONDITIONING_NEAR_SINGULAR,
    FINITE,
    LOOP_CLOSURE_ACCELERATION,
    LOOP_CLOSURE_ACCELERATION_STALLED,
    LOOP_CLOSURE_ACCELERATION_STILL,
    LOOP_CLOSURE_RATTLE,
    LOOP_CLOSURE_RATTLE_STALLED,
    LOOP_CLOSURE_STAGE_LOST,
    PIVOT_VANISHED,
    TIMES_SAME_SAMPLE,
)
from mbody.kernels.constraints import body_rotations, clear, rows, weigh
from mbody.kernels.forces import augmented_solution, forces, signals
from mbody.kernels.loop_closure import may_be_singular, record_accepted, sample_conditioning
from mbody.kernels.runge_kutta import deliver, hermite_output
from mbody.kernels.schur_ldl import apply_g, apply_gt, factor, solve
from mbody.kernels.state_derivative import (
    eliminate,
    iteration_matrix,
    state_derivative,
    state_jacobian,
    substitute,
)
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    DONE,
    EVALUATIONS,
    JACOBIAN_VALID,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    NEXT,
    NOT_FINITE,
    SINGULAR_AHEAD,
    STEPS,
    TIME,
    TRIED,
    TRIED_CONDITIONING,
    TRIED_END,
    TRIED_GROWTH,
    TRIED_LEAST,
    TRIED_LEAST_AT,
    TRIED_LENGTH,
)

# -- One step of the generalised-α method on the accelerations of free motion ------------------
#
#     (1 − α_m) â₁ + α_m â₀ = (1 − α_f) a₁ + α_f a₀,  a = a(q, v, t) with its multipliers,
#     q₁ = q₀ + h v₀ + h² ((½ − β) â₀ + β â₁),  v₁ = v₀ + h ((1 − γ) â₀ + γ â₁).
#
# α_m, α_f, β and γ follow from the spectral radius ρ at infinite frequency. Newton's method for â₁:
# its derivative by (1 − α_m) â₁ − (1 − α_f) a(q₁, v₁) is, with ∂v₁/∂â₁ = h γ and ∂q₁/∂â₁ = h² β,
#
#     (1 − α_m) 1 − (1 − α_f) (h γ ∂a/∂v + h² β ∂a/∂q).
#
# Auxiliary states have the same with their rates r,
#
#     (1 − δ) r̂₁ + δ r̂₀ = (1 − α_f) r₁ + α_f r₀,  z₁ = z₀ + h ((1 − θ) r̂₀ + θ r̂₁),
#
# of order 2 with θ = ½ − δ + α_f, and of the spectral radius ρ with δ = (3 ρ − 1)/(2 ρ + 2).
#
# Chung, Hulbert (1993); the algorithmic acceleration â as of Arnold, Brüls (2007); equations of
# first order: Jansen, Whiting, Hulbert (2000), beside those of mechanisms Brüls, Golinval (2006).

#: Newton iterations, at most; more than so many want a new Jacobian for the next step.
ROUNDS, MANY = 25, 6


@njit
def generalized_alpha_step(L, W, M, S, h, refinements):
    """S.end ← the state after one step from S.y; row 0 of K is its derivative, rows 1 to 3 are
    workspace. M: a `FixedStep`, whose `acceleration` (â, r̂) is carried on to `end_acceleration`.
    Returns whether Newton's method converged.
    """
    y, end, stage, K, state, scale = S.y, S.end, S.stage, S.K, S.state, S.scale
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
    iteration_matrix(M.J, scale, 1.0 - alpha_m, rate, place, 1.0 - delta, own, M.matrix)
    if not eliminate(M.matrix, M.exchanges):
        return False
    new, x = K[2, :count], S.error[0, :count]
    for n in range(count):
        new[n] = K[0, n3 + n]
    last, good, k = FINITE, False, 0
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
        for n in range(count):
            x[n] /= scale[n if n < n3 else n3 + n]
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
        if not off < FINITE:
            return False
        size = math.sqrt(off / whole) if whole > 0.0 else 0.0
        # at rest the accelerations of a driven mechanism are nothing but rounding
        lost = (
            size <= LOOP_CLOSURE_ACCELERATION_STALLED
            or h * h * math.sqrt(off) <= LOOP_CLOSURE_ACCELERATION_STILL
        )
        good = size <= LOOP_CLOSURE_ACCELERATION or (size >= 0.3 * last and lost)
        last = size
    if k > MANY:
        state[JACOBIAN_VALID] = 0.0
    if not good:
        return False
    for n in range(n3):
        end[n] = y[n] + h * (y[n3 + n] + h * ((0.5 - beta) * hat[n] + beta * new[n]))
        end[n3 + n] = y[n3 + n] + h * ((1.0 - gamma) * hat[n] + gamma * new[n])
    for n in range(n3, count):
        end[n3 + n] = y[n3 + n] + h * ((1.0 - theta) * hat[n] + theta * new[n])
    for n in range(count):
        M.end_acceleration[n] = new[n]
    return True


# -- One step of RATTLE: symmetric, symplectic with potentials, exact on constraints -----------
#
#     M (v½ − v₀) = ½h (f(q₀, v½, t₀) − G₀ᵀ λ),  q₁ = q₀ + h v½,  Φ(q₁, t₁) = 0,
#     M (v₁ − v½) = ½h (f(q₁, v½, t₁) − G₁ᵀ μ),  G₁ v₁ = ν(t₁).
#
# Both halves are accelerations u = (v½ − v₀)/(½h) and u = (v₁ − v½)/(½h).
#
# The first one is found by Newton's method with the factor of the beginning. The residuals of
# M u + G₀ᵀ λ = f and of Φ(q₁) = 0, where ∂q₁/∂u = ½h² 1, are removed by the augmented system
#
#     [M  G₀ᵀ] [δu]   [f − M u − G₀ᵀ λ]
#     [G₀ 0  ] [δλ] = [−2 Φ(q₁)/h²   ],
#
# that is S δλ = G₀ M⁻¹ (f − M u − G₀ᵀ λ) + 2 Φ/h² with S = G₀ M⁻¹ G₀ᵀ.
#
# The second one is the augmented system of `mbody.kernels.forces` as it is, since
# G₁ v₁ = ν requires G₁ u = (ν − G₁ v½)/(½h), which takes the place of γ.
#
# Loads take the velocity in the middle in both halves, so that the step is its own reverse with
# dampers too. Andersen, Rattle (1983); Hairer, Lubich, Wanner: Geometric Numerical Integration,
# VII.1.

#: Newton iterations for the position, at most.
RATTLE_ITERATIONS = 60


@njit
def rattle_step(L, W, M, S, t, h, refinements):
    """S.end ← the state after one step from there, at t.

    Row 0 of K holds an acceleration to begin with, and that of the end. M: a `FixedStep`, whose
    `blocks` is workspace for those of the rows. Needs the rows and the factor of the position (of
    `factor_position` or of the step before) and its multipliers; leaves those of the end. Returns
    whether Newton's method converged.
    """
    n3, w, y, blocks = 3 * L.bodies, 0.0, S.end, M.blocks
    u = S.K[0, n3:]
    for n in range(blocks.shape[0]):
        blocks[n] = W.block[n, 0]
    last, good = FINITE, False
    for _ in range(RATTLE_ITERATIONS):
        size = first_half(L, W, y, u, t, h, blocks)
        if not size < LOOP_CLOSURE_STAGE_LOST:
            return False
        if size <= LOOP_CLOSURE_RATTLE or (
            size <= LOOP_CLOSURE_RATTLE_STALLED and size >= 0.5 * last
        ):
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
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, None)
    factor(L, W, 0.0, regularization, PIVOT_VANISHED)


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
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    for n in range(blocks.shape[0]):
        W.block[n, 0] = blocks[n]
    # f(q₀, v½, t₀)
    W.time[0, 0] = t
    signals(L, W, w, L.varying)
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = y[n], y[n3 + n] + 0.5 * h * u[n]
    body_rotations(L, W, w)
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


class FixedStep(Bundle):
    """A method of steps of one length, and what it carries on.

    `length`: Of a step.
    `composition` (steps,): Parts of a step of which each is one step of RATTLE; none for
      generalised-α.
    `spectral_radius`: Of generalised-α at infinite frequency.
    `samples` (samples,): The parts of a step at which it is sampled (see
      `mbody.kernels.loop_closure`).
    `acceleration`, `end_acceleration` (coordinates + owns,): The algorithmic acceleration, with the
      algorithmic rates of auxiliary states, and that at the end of a step that was tried.
    `multipliers`, `end_multipliers` (2·nodes,): Carried on by RATTLE, and at that end.
    `blocks`: Workspace for the blocks of the rows.
    `J` (coordinates + owns, states): See `mbody.kernels.state_derivative`.
    `matrix` (coordinates + owns, coordinates + owns): The iteration matrix and its factors.
    `exchanges` (coordinates + owns,): Exchanges of rows of the factors.
    """

    length: float
    composition: Floats
    spectral_radius: float
    samples: Floats
    acceleration: Floats
    end_acceleration: Floats
    multipliers: Floats
    end_multipliers: Floats
    blocks: Floats
    J: Rows
    matrix: Rows
    exchanges: Ints


@njit
def attempt_even(L, W, M, S, T, until):
    """One step of the method's length towards `until`, the last one shorter, is tried from S.y:
    TRIED where it is good, its end in S.end and row 3 of K, its polynomials in S.F and S.G; else
    why there is none (DONE, LAST_STEP, NOT_FINITE, SINGULAR_AHEAD).
    """
    state, length, refinements = S.state, M.length, T.full_refinements
    t = state[TIME]
    if t >= until:
        return DONE
    clipped = t + length >= until - TIMES_SAME_SAMPLE * length
    if clipped and state[LAST_STEP_ALLOWED] < 0.5:
        return LAST_STEP
    if state[CONDITIONING] < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]:
        return SINGULAR_AHEAD
    h = until - t if clipped else length
    now = until if clipped else t + length
    for n in range(S.y.shape[0]):
        S.last[n] = S.end[n] = S.y[n]
    if M.composition.shape[0] > 0:
        good = composed_step(L, W, M, S, h, refinements)
    else:
        good = generalized_alpha_step(L, W, M, S, h, refinements)
    if good:
        # RATTLE ends on the manifold to rounding; its projection is of rounding too
        _, _, good = state_derivative(L, W, S, now, S.end, 3, refinements, True)
        state[EVALUATIONS] += 1
    part = sample_conditioning(L, W, 0.0, 3)
    lost = not good or not math.isfinite(S.end[0])
    refused = lost or part < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]
    least, least_at = 1.0, 0.0
    if not refused:
        for n in range(M.multipliers.shape[0]):
            M.end_multipliers[n] = W.lam[n, 0]
        least, least_at = hermite_output(L, W, S, h, refinements)
        refused = may_be_singular(L, W, S, M.samples, S.end, False)
    if refused:
        state[JACOBIAN_VALID] = 0.0
        return NOT_FINITE if lost else SINGULAR_AHEAD
    state[TRIED_LENGTH], state[TRIED_END] = h, now
    state[TRIED_GROWTH], state[TRIED_CONDITIONING] = 1.0, part
    state[TRIED_LEAST], state[TRIED_LEAST_AT] = least, t + least_at * h
    return TRIED


@njit
def accept_even(L, W, M, S, T, O):
    """Accept the step that was tried, keeping every output instant that it meets."""
    n3, K, P, state = 3 * L.bodies, S.K, S.P, S.state
    h, now, part = state[TRIED_LENGTH], state[TRIED_END], state[TRIED_CONDITIONING]
    least, least_at = state[TRIED_LEAST], state[TRIED_LEAST_AT]
    for n in range(S.y.shape[0]):
        S.y[n], K[0, n] = S.end[n], K[3, n]
    for c in range(P.shape[1]):
        P[0, c] = P[3, c]
    for n in range(M.acceleration.shape[0]):
        M.acceleration[n] = M.end_acceleration[n]
    for n in range(M.multipliers.shape[0]):
        M.multipliers[n] = M.end_multipliers[n]
    state[CONDITIONING] = part
    state[BEST_CONDITIONING] = max(part, state[BEST_CONDITIONING])
    if part < least:
        least, least_at = part, now
    for n in range(n3):
        W.v[n, 0] = S.y[n3 + n]
    record_accepted(L, W, S, 3, least, least_at, True)
    state[STEPS] += 1
    state[LAST_STEP_ALLOWED] = 0.0
    deliver(L, W, S, O, h, now, T.full_refinements)
    state[TIME], state[NEXT] = now, M.length


@njit
def composed_step(L, W, M, S, h, refinements):
    """S.end ← the state after steps of RATTLE of the parts of h, one after the other, from S.y.
    Returns whether all converged.
    """
    n3, t, K = 3 * L.bodies, S.state[TIME], S.K
    # row 0 of K, the derivative at the beginning, serves as the acceleration meanwhile
    for n in range(n3):
        W.q[n, 0], K[3, n3 + n] = S.y[n], K[0, n3 + n]
    factor_position(L, W, t, S.regularization)
    for n in range(M.multipliers.shape[0]):
        W.lam[n, 0] = M.multipliers[n]
    good = True
    for m in range(M.composition.shape[0]):
        part = M.composition[m] * h
        good = good and rattle_step(L, W, M, S, t, part, refinements)
        t += part
    for n in range(n3):
        K[0, n3 + n] = K[3, n3 + n]
    return good
