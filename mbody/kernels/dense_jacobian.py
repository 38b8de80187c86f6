"""Jacobian of free motion, and the matrices of implicit steps made of it.

Of ẏ = (v, a, ż) the first part is known, ∂q̇/∂v = 1, and so J has the rows of (a, ż) alone: it is
(coordinates + own states, states), its columns those of y = (q, v, z). Matrices of implicit steps
have the size of its rows, not of the states: q̇ = v is eliminated by hand. Own states, whose units
may be anything, are counted in their sizes there, so that pivots are chosen among numbers that can
be compared.
"""

from __future__ import annotations

from mbody.core.decorators import njit
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import EVALUATIONS, JACOBIANS, TIME

__all__ = ["eliminate", "iteration_matrix", "state_jacobian", "substitute"]

#: Part of the size of a coordinate by which differences step: the root of rounding.
STEP = 1.5e-8


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
        step = STEP * max(abs(y[n]), scale[n])
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
def iteration_matrix(J, one, rate, place, own_one, own, matrix):
    """matrix ← the columns  one·1 − rate·∂/∂v − place·∂/∂q  of coordinates, and own_one·1 −
    own·∂/∂z  of own states.
    """
    size, n3 = J.shape[0], J.shape[1] - J.shape[0]
    for m in range(size):
        for n in range(n3):
            matrix[m, n] = -rate * J[m, n3 + n] - place * J[m, n]
        for n in range(n3, size):
            matrix[m, n] = -own * J[m, n3 + n]
        matrix[m, m] += one if m < n3 else own_one


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
