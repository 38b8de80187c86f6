"""Jacobians ∂a/∂q and ∂a/∂v of free motion, and the matrices of implicit steps made of them.

Dense matrices of the size of the coordinates, not of the states: as ∂q̇/∂v is the identity, half of
the system of an implicit step is eliminated by hand.
"""

from __future__ import annotations

from mbody.core.decorators import njit
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import EVALUATIONS, JACOBIANS, TIME

__all__ = ["acceleration_jacobians", "eliminate", "iteration_matrix", "substitute"]

#: Part of the size of a coordinate by which differences step: the root of rounding.
STEP = 1.5e-8


@njit
def acceleration_jacobians(L, W, S, refinements, Jq, Jv):
    """Jq ← ∂a/∂q, Jv ← ∂a/∂v, (coordinates, coordinates) each, at S.y by differences; row 0 of K
    holds the derivative there, row 3 is workspace.

    They serve Newton iterations whose limit does not depend on them, so that the eight digits of a
    one-sided difference are enough.
    """
    n3, y, K, stage = Jq.shape[0], S.y, S.K, S.stage
    for n in range(2 * n3):
        for m in range(2 * n3):
            stage[m] = y[m]
        step = STEP * max(abs(y[n]), S.scale[n])
        stage[n] = y[n] + step
        step = stage[n] - y[n]
        state_derivative(L, W, S, S.state[TIME], stage, 3, refinements, False)
        for m in range(n3):
            found = (K[3, n3 + m] - K[0, n3 + m]) / step
            if n < n3:
                Jq[m, n] = found
            else:
                Jv[m, n - n3] = found
    S.state[JACOBIANS] += 1
    S.state[EVALUATIONS] += 2 * n3


@njit
def iteration_matrix(Jq, Jv, one, rate, place, matrix):
    """matrix ← one·1 − rate·∂a/∂v − place·∂a/∂q."""
    for m in range(matrix.shape[0]):
        for n in range(matrix.shape[0]):
            matrix[m, n] = -rate * Jv[m, n] - place * Jq[m, n]
        matrix[m, m] += one


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
