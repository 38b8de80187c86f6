"""Right-hand side of the equations of motion: the derivative of the state, and powers.

    ẏ = (v, a, ż) of y = (q, v, z), with  M a + Gᵀ λ = f,  G a = γ  and the rates ż of a user's own
    states z (`mbody.kernels.measured_formulas`).

The accelerations are those of `mbody.kernels.forces`. A load of generalised force f_c has
the power f_c · v; a driver, whose effort is −λ and whose rate is ν = ∂/∂t of its law, has −λ ν.
"""

from __future__ import annotations

from mbody.core.bundle import Rows
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import ld, st
from mbody.core.tolerances import DIFFERENCE_STEP_FORWARD
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import friction_loss
from mbody.kernels.layout import Layout, Work, keep
from mbody.kernels.loop_closure import constrained_accelerations, sample_conditioning
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    EVALUATIONS,
    JACOBIANS,
    TIME,
    Stepping,
)


@inline
def load_state(L, W, w, y):
    """(q, v) and auxiliary states ← the state y (2·coordinates + owns, ·)."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(W.q, n, ld(y, n, w), w)
        st(W.v, n, ld(y, n3 + n, w), w)
    for n in range(L.owns):
        st(W.own, n, ld(y, 2 * n3 + n, w), w)


@inline
def store_state(L, W, w, y):
    """The state y ← (q, v); auxiliary states are not projected."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(y, n, ld(W.q, n, w), w)
        st(y, n3 + n, ld(W.v, n, w), w)


@inline
def store_derivative(L, W, w, K):
    """The derivative K (2·coordinates + owns, ·) ← (v, a) and the rates of auxiliary states."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(K, n, ld(W.v, n, w), w)
        st(K, n3 + n, ld(W.a, n, w), w)
    for n in range(L.owns):
        st(K, 2 * n3 + n, ld(W.auxiliary_rate, n, w), w)


@njit
def powers(L, W, P):
    """P (causes,) ← the power of every load, or of all together where P has one number for them,
    then of every driver and of every friction pair, below zero where it takes, and of every stop
    that moves. W.force holds the sum of all loads.
    """
    pairs, moving = L.friction_kind.shape[0], L.moving.shape[0]
    count = P.shape[0] - L.driver_row.shape[0] - pairs - moving
    alone = count > 1
    for cause in range(count):
        if alone:
            forces(L, W, 0.0, cause)
        total = 0.0
        for n in range(3 * L.bodies):
            total += W.force[n, 0] * W.v[n, 0]
        if not alone:
            # friction is among the forces, and no load
            for f in range(pairs):
                total += friction_loss(L, W, f)
        P[cause] = total
    for d in range(L.driver_row.shape[0]):
        # an effort is −λ
        P[count + d] = -W.lam[2 * L.driver_node[d], 0] * W.signal[L.driver_row[d] + 1, 0]
    for f in range(pairs):
        P[count + L.driver_row.shape[0] + f] = -friction_loss(L, W, f)
    for m in range(moving):
        node = 2 * L.primitive_node[L.active_set[L.moving[m]]]
        # as of a driver: the row gives ν where it is on
        P[count + L.driver_row.shape[0] + pairs + m] = -W.lam[node, 0] * W.nu[node, 0]


@njit
def state_derivative(L, W, S, t, y, row, refinements, projected):
    """Row `row` of K and P ← the derivative of the state y at t and its powers;
    `projected`: of the projection of y onto the constraints, which y becomes.

    S: a `Stepping`. Returns how far the projection moves position and velocity, and whether it
    converged.
    """
    W.time[0, 0] = t
    load_state(L, W, 0.0, y)
    far, fast, good = constrained_accelerations(L, W, 0.0, S.regularization, refinements, projected)
    if projected:
        store_state(L, W, 0.0, y)
    store_derivative(L, W, 0.0, S.K[row])
    powers(L, W, S.P[row])
    return far, fast, good


@kernel
def initial_derivative(L: Layout, W: Work, S: Stepping, refinements: int, record: Rows) -> bool:
    """Project the first state S.y at the time in its slot, evaluate its derivative, record (rows,
    1) ← what is kept of it. Returns whether the projection converged.
    """
    return first_derivative(L, W, S, refinements, record)


@njit
def first_derivative(L, W, S, refinements, record):
    """First derivative of the state, with its record (`initial_derivative`)."""
    signals(L, W, 0.0, L.signal_law.shape[0])
    _, _, good = state_derivative(L, W, S, S.state[TIME], S.y, 0, refinements, True)
    S.state[CONDITIONING] = S.state[BEST_CONDITIONING] = sample_conditioning(L, W, 0.0, 0)
    keep(L, W, 0.0, record)
    return good


@njit
def derivative_anew(L, W, S, refinements, record):
    """As `first_derivative` of a motion that goes on with other inputs, its steps as they were."""
    best = S.state[BEST_CONDITIONING]
    good = first_derivative(L, W, S, refinements, record)
    S.state[BEST_CONDITIONING] = max(S.state[BEST_CONDITIONING], best)
    return good


# -- Jacobian of free motion, and the matrices of implicit steps made of it --------------------
#
# Of ẏ = (v, a, ż) the first part is known, ∂q̇/∂v = 1, and so J has the rows of (a, ż) alone: it is
# (coordinates + auxiliary states, states), its columns those of y = (q, v, z). Matrices of implicit
# steps have the size of its rows, not of the states: q̇ = v is eliminated by hand. Auxiliary
# states, whose units may be anything, are counted in their sizes there, so that pivots are chosen
# among numbers that can be compared.


@njit
def state_jacobian(L, W, S, refinements, J):
    """J ← ∂(a, ż)/∂(q, v, z) at S.y by differences; row 0 of K holds the derivative there, row 3
    is workspace.

    It serves Newton iterations whose limit does not depend on it, so that the eight digits of a
    one-sided difference are enough.
    """
    size, states = J.shape
    n3, y, K, stage, scale = states - size, S.y, S.K, S.stage, S.scale
    for n in range(states):
        for m in range(states):
            stage[m] = y[m]
        step = DIFFERENCE_STEP_FORWARD * max(abs(y[n]), scale[n])
        stage[n] = y[n] + step
        step = stage[n] - y[n]
        state_derivative(L, W, S, S.state[TIME], stage, 3, refinements, False)
        if n >= 2 * n3:
            step /= scale[n]
        for m in range(size):
            J[m, n] = (K[3, n3 + m] - K[0, n3 + m]) / step
        for m in range(n3, size):
            J[m, n] /= scale[n3 + m]
    S.state[JACOBIANS] += 1
    S.state[EVALUATIONS] += states


@njit
def iteration_matrix(J, scale, one, rate, place, own_one, own, matrix):
    """matrix ← the columns  one·1 − rate·∂/∂v − place·∂/∂q  of coordinates, and own_one·1 −
    own·∂/∂z  of auxiliary states. Rows of coordinates are parts of their scale, as those of
    auxiliary states are: pivots are chosen among numbers of one unit.
    """
    size, n3 = J.shape[0], J.shape[1] - J.shape[0]
    for m in range(size):
        for n in range(n3):
            matrix[m, n] = -rate * J[m, n3 + n] - place * J[m, n]
        for n in range(n3, size):
            matrix[m, n] = -own * J[m, n3 + n]
        matrix[m, m] += one if m < n3 else own_one
        for n in range(size if m < n3 else 0):
            matrix[m, n] /= scale[m]


@njit
def eliminate(matrix, exchanges):
    """matrix ← its factors L U by Gaussian elimination with partial pivoting; exchanges: the row
    that each one was exchanged with. Returns whether it is regular.
    """
    size = matrix.shape[0]
    for k in range(size):
        best = k
        for m in range(k + 1, size):
            if abs(matrix[m, k]) > abs(matrix[best, k]):
                best = m
        exchanges[k] = best
        if not abs(matrix[best, k]) > 0.0:
            return False
        if best != k:
            for n in range(size):
                matrix[k, n], matrix[best, n] = matrix[best, n], matrix[k, n]
        over = 1.0 / matrix[k, k]
        for m in range(k + 1, size):
            if matrix[m, k] != 0.0:
                factor = matrix[m, k] * over
                matrix[m, k] = factor
                for n in range(k + 1, size):
                    matrix[m, n] -= factor * matrix[k, n]
    return True


@njit
def substitute(matrix, exchanges, x):
    """x ← the solution of the linear system with the right-hand side x, by the factors of
    `eliminate`: forward and back substitution.
    """
    size = matrix.shape[0]
    for k in range(size):
        x[k], x[exchanges[k]] = x[exchanges[k]], x[k]
        for n in range(k):
            x[k] -= matrix[k, n] * x[n]
    for m in range(size):
        k = size - 1 - m
        for n in range(k + 1, size):
            x[k] -= matrix[k, n] * x[n]
        x[k] /= matrix[k, k]
