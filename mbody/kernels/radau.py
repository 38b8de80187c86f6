"""Implicit integrator of stiff motion: Radau IIA of order 5, each step ended by a projection.

The stages Y_i = y + Z_i of a step solve  Z = h (A ⊗ 1) f(y + Z),  A the matrix of the method. The
simplified Newton method takes the Jacobian J = ∂f/∂y of the step's beginning for all of them,

    (1 − h A ⊗ J) δZ = h (A ⊗ 1) f(y + Z) − Z,   or, times (h A)⁻¹ ⊗ 1,
    (A⁻¹/h ⊗ 1 − 1 ⊗ J) δZ = f(y + Z) − (A⁻¹/h ⊗ 1) Z.

In the eigenvectors of A⁻¹ = T Λ T⁻¹, X = (T⁻¹ ⊗ 1) Z, this falls apart into one real system,
(μ − J) δX₀ = …, and one complex one for δX₁ + i δX₂, with the eigenvalues over h. As the state is
y = (q, v) and J = [0 1; ∂a/∂q ∂a/∂v], the upper half of (μ − J) (q, v) = (r, s) gives v = μ q − r,
and the lower one

    (μ² − μ ∂a/∂v − ∂a/∂q) q = s + μ r − ∂a/∂v r,

a system of the size of the coordinates, not of the states. Iterations end where the error that is
left, Θ/(1 − Θ) |δZ| with the rate Θ of convergence, is a small part of the tolerance.

Auxiliary states z with the rates ż = r(q, v, z, t) are more rows of the same system: with v = μ q −
r

    [μ² − μ ∂a/∂v − ∂a/∂q   −∂a/∂z    ] [q]   [s + μ r − ∂a/∂v r]
    [   −μ ∂r/∂v − ∂r/∂q    μ − ∂r/∂z ] [z] = [w − ∂r/∂v r      ],

so that a fast current and a stiff spring that it pulls are solved for together.

Singular positions are left to explicit steps (`mbody.kernels.runge_kutta`).

Hairer, Wanner: Solving Ordinary Differential Equations II, IV.8, the code RADAU5.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, ComplexRows, Floats, Rows, Tables
from mbody.core.decorators import njit
from mbody.core.tolerances import (
    CONDITIONING_NEAR_SINGULAR,
    FINITE,
    RADAU_EPSILON,
    STEP_ERROR_NONE_RADAU,
    STEP_JACOBIAN_VALID,
    TIME_END_ROUNDING,
    TIME_STEP_SHORTEST,
    TIME_STEP_SHORTEST_REJECTED,
)
from mbody.kernels.loop_closure import may_be_singular, record_accepted, sample_conditioning
from mbody.kernels.runge_kutta import along, clear_rows, deliver
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
    LAST_ERROR,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    MORE,
    NEXT,
    NOT_FINITE,
    REJECTED,
    SINGULAR_AHEAD,
    STEP_VANISHED,
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

#: Newton iterations, at most.
NEWTON = 7
#: Row of `Radau.past` whose first number is the length of the last step, zero before there is one;
#: the places there of the length whose systems are factored, below zero of none, and of the rate of
#: convergence of the step that was tried.
LENGTH = 3
FACTORED, RATE = 1, 2


class Radau(Bundle):
    """The method with its memory; the coefficients as of `mbody.kernels.runge_kutta.Implicit`.

    `Z`, `X` (3, states): What the state gains until the stages, and the same in eigenvectors.
    `xc` (2, states): Workspace, and right-hand sides of the complex system.
    `past` (4, states): The polynomial of the last step; row `LENGTH` has its length and what of a
      step the next one takes.
    `J` (coordinates + owns, states): See `mbody.kernels.state_derivative`.
    `matrix`, `complex_matrix` (coordinates + owns, coordinates + owns): Factors of both systems.
    `exchanges` (2, coordinates + owns): Exchanges of rows of either.
    """

    B: Floats
    C: Floats
    E: Floats
    T: Rows
    inverse: Rows
    eigenvalue: float
    eigenvalue_re: float
    eigenvalue_im: float
    at: Floats
    Z: Rows
    X: Rows
    xc: ComplexRows
    past: Rows
    J: Rows
    matrix: Rows
    complex_matrix: ComplexRows
    exchanges: Tables


@njit
def solve_shifted(matrix, exchanges, mu, J, scale, y, x):
    """y ← the solution of (μ − J) y = y, y = (q, v, z), by the factors of the matrix above; x is
    workspace.
    """
    size, n3 = J.shape[0], J.shape[1] - J.shape[0]
    for m in range(size):
        total = y[n3 + m] + mu * y[m] if m < n3 else y[n3 + m] / scale[n3 + m]
        for n in range(n3):
            total -= J[m, n3 + n] * y[n]
        x[m] = total / scale[m] if m < n3 else total
    substitute(matrix, exchanges, x)
    for m in range(n3):
        y[n3 + m] = mu * x[m] - y[m]
        y[m] = x[m]
    for m in range(n3, size):
        y[n3 + m] = x[m] * scale[n3 + m]


@njit
def error_norm(e, y, end, scale, T):
    """Root of the mean square of e, in tolerances."""
    total = 0.0
    for n in range(e.shape[0]):
        size = T.absolute * scale[n] + T.relative * max(abs(y[n]), abs(end[n]))
        total += (e[n] / size) ** 2
    return math.sqrt(total / e.shape[0])


@njit
def solve_stages(L, W, M, S, T, h):
    """M.Z ← what the state gains until each stage, from the values there; rows 1 to 3 of K and P ←
    derivatives and powers. Returns whether Newton's method converges, and its rate.
    """
    y, stage, K, Z, X, xc, state = S.y, S.stage, S.K, M.Z, M.X, M.xc, S.state
    states, rows = y.shape[0], M.J.shape[0]
    V, inverse, t, rtol = M.T, M.inverse, S.state[TIME], T.relative
    mu, turn = M.eigenvalue / h, complex(M.eigenvalue_re, M.eigenvalue_im) / h
    # what is left of the error after the iterations: the code RADAU5's part of the tolerance
    enough = max(10.0 * RADAU_EPSILON / rtol, min(0.03, math.sqrt(rtol)))
    for i in range(3):
        for n in range(states):
            X[i, n] = inverse[i, 0] * Z[0, n] + inverse[i, 1] * Z[1, n] + inverse[i, 2] * Z[2, n]
    last, rate = -1.0, 0.0
    for k in range(NEWTON):
        for i in range(3):
            for n in range(states):
                stage[n] = y[n] + Z[i, n]
            _, _, good = state_derivative(
                L, W, S, t + M.C[i] * h, stage, 1 + i, T.refinements, False
            )
            state[EVALUATIONS] += 1
            if not good:
                return False, rate
        # (T⁻¹ ⊗ 1) f − (Λ/h) X
        for n in range(states):
            a, b, c = K[1, n], K[2, n], K[3, n]
            Z[0, n] = inverse[0, 0] * a + inverse[0, 1] * b + inverse[0, 2] * c - mu * X[0, n]
            re = inverse[1, 0] * a + inverse[1, 1] * b + inverse[1, 2] * c
            im = inverse[2, 0] * a + inverse[2, 1] * b + inverse[2, 2] * c
            xc[1, n] = re + 1j * im - turn * (X[1, n] + 1j * X[2, n])
        solve_shifted(M.matrix, M.exchanges[0], mu, M.J, S.scale, Z[0], stage[:rows])
        matrix, exchanges = M.complex_matrix, M.exchanges[1]
        solve_shifted(matrix, exchanges, turn, M.J, S.scale, xc[1], xc[0, :rows])
        for n in range(states):
            z = xc[1, n]
            Z[1, n], Z[2, n] = z.real, z.imag
        size = 0.0
        for i in range(3):
            size += error_norm(Z[i], y, y, S.scale, T) ** 2
        size = math.sqrt(size / 3.0)
        if not size < FINITE:
            return False, rate
        small = size <= 0.1 * enough
        if last > 0.0 and not small:
            rate = size / last
            left = rate ** (NEWTON - k) / (1.0 - rate) * size if rate < 1.0 else FINITE
            if left > enough:
                return False, rate
        for i in range(3):
            for n in range(states):
                X[i, n] += Z[i, n]
        for i in range(3):
            for n in range(states):
                Z[i, n] = V[i, 0] * X[0, n] + V[i, 1] * X[1, n] + V[i, 2] * X[2, n]
        if small or (last > 0.0 and rate / (1.0 - rate) * size < enough):
            return True, rate
        last = size
    return False, rate


@njit
def collocation_polynomial(C, Z, F):
    """F (3, numbers) of the cubic that gains Z (3, numbers) until the stages.

    Δ(c)/c − Δ(1) = (1 − c) (F₁ + c F₂) at both inner nodes c.
    """
    for n in range(Z.shape[1]):
        first = (Z[0, n] / C[0] - Z[2, n]) / (1.0 - C[0])
        second = (Z[1, n] / C[1] - Z[2, n]) / (1.0 - C[1])
        F[0, n] = Z[2, n]
        F[2, n] = (second - first) / (C[1] - C[0])
        F[1, n] = first - C[0] * F[2, n]


@njit
def work_polynomial(C, B, h, P, G):
    """G (3, causes) of the work of a step, by the powers at the stages: rows 1 to 3 of P.

    G₀ is the quadrature h Σ b P of order 5; the other two give the cubic, whose rate is
    G₀ + (1 − 2 x) G₁ + (2 x − 3 x²) G₂, the powers of both inner nodes.
    """
    a, b = C[0], C[1]
    for c in range(G.shape[1]):
        G[0, c] = h * (B[0] * P[1, c] + B[1] * P[2, c] + B[2] * P[3, c])
        first, second = h * P[1, c] - G[0, c], h * P[2, c] - G[0, c]
        p, q, r, s = 1.0 - 2.0 * a, a * (2.0 - 3.0 * a), 1.0 - 2.0 * b, b * (2.0 - 3.0 * b)
        G[1, c] = (first * s - second * q) / (p * s - q * r)
        G[2, c] = (p * second - r * first) / (p * s - q * r)


@njit
def error_estimate(L, W, M, S, T, h):
    """S.error[0] ← the error of a step to S.end, damped where the motion is stiff; returns its size
    in tolerances.

    (μ − J)⁻¹ (f(y) + Σ e Z/h), of order 3; where it is great for a first or a doubtful step, f is
    taken beside y by that error once more, which damps it like h J → ∞ (IV.8, 8.20).
    """
    y, stage, K, Z, error, state = S.y, S.stage, S.K, M.Z, S.error[0], S.state
    rows, mu, size = M.J.shape[0], M.eigenvalue / h, 0.0
    for again in range(2):
        for n in range(y.shape[0]):
            ends = (M.E[0] * Z[0, n] + M.E[1] * Z[1, n] + M.E[2] * Z[2, n]) / h
            error[n] = ends + K[1 if again else 0, n]
        solve_shifted(M.matrix, M.exchanges[0], mu, M.J, S.scale, error, stage[:rows])
        size = error_norm(error, y, S.end, S.scale, T)
        if not size > 1.0 or again or not (state[STEPS] == 0 or state[LAST_ERROR] > 1.0):
            break
        for n in range(y.shape[0]):
            stage[n] = y[n] + error[n]
        state_derivative(L, W, S, state[TIME], stage, 1, T.refinements, False)
        state[EVALUATIONS] += 1
    return size


@njit
def forget_factors(M):
    """The systems are to be factored anew, as where others have set the Jacobian."""
    M.past[LENGTH, FACTORED] = -1.0


@njit
def forget_polynomial(M):
    """The stages of the next step do not begin with the polynomial of the last one."""
    M.past[LENGTH, 0] = 0.0


@njit
def factor_stages(L, W, M, S, T, h):
    """Jacobian at S.y where it is not valid, and factors of the systems of a step of length h;
    whether they are regular.
    """
    state, made = S.state, M.past[LENGTH]
    if state[JACOBIAN_VALID] < 0.5:
        state_jacobian(L, W, S, T.refinements, M.J)
        state[JACOBIAN_VALID], made[FACTORED] = 1.0, -1.0
    if made[FACTORED] == h:
        return True
    mu, turn = M.eigenvalue / h, complex(M.eigenvalue_re, M.eigenvalue_im) / h
    iteration_matrix(M.J, S.scale, mu * mu, mu, 1.0, mu, 1.0, M.matrix)
    square = turn * turn
    iteration_matrix(M.J, S.scale, square, turn, 1.0, turn, 1.0, M.complex_matrix)
    regular = eliminate(M.matrix, M.exchanges[0])
    regular = regular and eliminate(M.complex_matrix, M.exchanges[1])
    made[FACTORED] = h if regular else -1.0
    return regular


@njit
def attempt_implicit(L, W, M, S, T, until):
    """One step towards `until` is tried from S.y: TRIED where it is good, its end in S.end and row
    3 of K; MORE where it is to be tried again with another length or Jacobian; else why there is
    none (DONE, LAST_STEP, STEP_VANISHED, NOT_FINITE, SINGULAR_AHEAD).
    """
    states = S.y.shape[0]
    y, stage, end, Z, C, past, state = S.y, S.stage, S.end, M.Z, M.C, M.past, S.state
    t, h, regular = state[TIME], state[NEXT], T.refinements
    if t >= until:
        return DONE
    clipped = t + h >= until - TIME_END_ROUNDING * abs(until)
    if clipped and state[LAST_STEP_ALLOWED] < 0.5:
        return LAST_STEP
    if state[CONDITIONING] < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]:
        return SINGULAR_AHEAD
    if clipped:
        h = until - t
    if h < TIME_STEP_SHORTEST * max(abs(t), abs(until)) and not clipped:
        return STEP_VANISHED
    here = state[JACOBIAN_VALID] < 0.5
    if not factor_stages(L, W, M, S, T, h):
        state[NEXT] = 0.5 * h
        state[REJECTED] += 1
        return MORE
    # ---- stages, first by the polynomial of the last step continued
    for i in range(3):
        x = 1.0 + C[i] * h / past[LENGTH, 0] if past[LENGTH, 0] > 0.0 else 1.0
        for n in range(states):
            Z[i, n] = along(past[:LENGTH], n, x, 0.0) - past[0, n]
    good, past[LENGTH, RATE] = solve_stages(L, W, M, S, T, h)
    if not good:
        state[REJECTED] += 1
        state[JACOBIAN_VALID] = 1.0 if here else 0.0
        state[NEXT] = 0.5 * h if here else h
        if h < TIME_STEP_SHORTEST_REJECTED * max(abs(t), abs(until)):
            return NOT_FINITE
        return MORE
    for n in range(states):
        end[n] = y[n] + Z[2, n]
    error = error_estimate(L, W, M, S, T, h)
    growth = 8.0 if error < STEP_ERROR_NONE_RADAU else min(8.0, 0.9 * error**-0.25)
    state[LAST_ERROR] = error
    if not error <= 1.0:
        state[REJECTED] += 1
        state[NEXT] = h * max(0.2, growth) if error < FINITE else 0.2 * h
        if h < TIME_STEP_SHORTEST_REJECTED * max(abs(t), abs(until)):
            return NOT_FINITE
        return MORE
    for n in range(states):
        S.last[n] = y[n]
    # the stages once more, where they are now, for their powers and their distances
    least, least_at = state[CONDITIONING], t
    for i in range(2):
        for n in range(states):
            stage[n] = y[n] + Z[i, n]
        state_derivative(L, W, S, t + C[i] * h, stage, 1 + i, regular, False)
        state[EVALUATIONS] += 1
        part = sample_conditioning(L, W, 0.0, 1 + i)
        if part < least:
            least, least_at = part, t + C[i] * h
    _, _, good = state_derivative(L, W, S, t + h, end, 3, T.full_refinements, True)
    state[EVALUATIONS] += 1
    if not good:
        state[REJECTED] += 1
        state[NEXT] = 0.5 * h
        return MORE
    part = sample_conditioning(L, W, 0.0, 3)
    weak = part < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]
    if weak or may_be_singular(L, W, S, M.at, end, False):
        state[JACOBIAN_VALID] = 0.0
        return SINGULAR_AHEAD
    state[TRIED_LENGTH], state[TRIED_END] = h, until if clipped else t + h
    state[TRIED_GROWTH], state[TRIED_CONDITIONING] = growth, part
    state[TRIED_LEAST], state[TRIED_LEAST_AT] = least, least_at
    return TRIED


@njit
def dense_implicit(M, S):
    """S.F and S.G of the polynomials of state and work over the step that was tried."""
    for n in range(S.y.shape[0]):
        M.Z[2, n] = S.end[n] - S.last[n]
    collocation_polynomial(M.C, M.Z, S.F)
    work_polynomial(M.C, M.B, S.state[TRIED_LENGTH], S.P, S.G)
    clear_rows(S, 3)


@njit
def accept_implicit(L, W, M, S, T, O, until, dense):
    """Accept the step that was tried, keeping every output instant that it meets. `dense`: whether
    its polynomials are known.
    """
    states, y, past, state = S.y.shape[0], S.y, M.past, S.state
    h, now, growth = state[TRIED_LENGTH], state[TRIED_END], state[TRIED_GROWTH]
    part, least, least_at = state[TRIED_CONDITIONING], state[TRIED_LEAST], state[TRIED_LEAST_AT]
    for n in range(states):
        y[n] = S.end[n]
    state[CONDITIONING] = part
    state[BEST_CONDITIONING] = max(part, state[BEST_CONDITIONING])
    if part < least:
        least, least_at = part, now
    record_accepted(L, W, S, 3, least, least_at, T.refinements > 0)
    state[STEPS] += 1
    state[LAST_STEP_ALLOWED] = 0.0
    if not dense:
        dense_implicit(M, S)
    for n in range(states):
        S.K[0, n] = S.K[3, n]
        for i in range(3):
            past[i, n] = S.F[i, n]
    for c in range(S.P.shape[1]):
        S.P[0, c] = S.P[3, c]
    past[LENGTH, 0] = h
    deliver(L, W, S, O, h, now, T.full_refinements)
    # ---- the length of the next step: one factor serves while steps would grow little
    state[TIME] = now
    wanted = h * max(0.2, growth)
    if 1.0 <= wanted / h < 1.2:
        wanted = h
    state[NEXT] = max(wanted, state[NEXT]) if now == until else wanted
    state[JACOBIAN_VALID] = 1.0 if past[LENGTH, RATE] < STEP_JACOBIAN_VALID else 0.0
