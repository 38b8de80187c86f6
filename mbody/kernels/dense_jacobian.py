"""∂a/∂q and ∂a/∂v of free motion, and the matrices of implicit steps made of them."""

from __future__ import annotations

from mbody.compiler.jit import njit
from mbody.kernels.state_derivative import slope
from mbody.kernels.step_state import SLOPES, TANGENTS

__all__ = ["eliminate", "iteration_matrix", "substitute", "tangents"]

#: Part of the size of a coordinate by which differences step: the root of rounding.
STEP = 1.5e-8


@njit
def tangents(L, W, t, y, K, P, ys, scale, soft, passes, Jq, Jv, state):
    """Jq ← ∂a/∂q, Jv ← ∂a/∂v, (coordinates, coordinates) each, by differences; row 0 of K holds the
    slope of y, row 3 is room.

    They serve corrections whose end does not depend on them, so that the eight digits of a
    one-sided difference are enough.
    """
    n3 = Jq.shape[0]
    for n in range(2 * n3):
        for m in range(2 * n3):
            ys[m] = y[m]
        step = STEP * max(abs(y[n]), scale[n])
        ys[n] = y[n] + step
        step = ys[n] - y[n]
        slope(L, W, t, ys, K[3], P[3], soft, passes, False)
        for m in range(n3):
            found = (K[3, n3 + m] - K[0, n3 + m]) / step
            if n < n3:
                Jq[m, n] = found
            else:
                Jv[m, n - n3] = found
    state[TANGENTS] += 1
    state[SLOPES] += 2 * n3


@njit
def iteration_matrix(Jq, Jv, one, rate, place, S):
    """S ← one·1 − rate·∂a/∂v − place·∂a/∂q."""
    for m in range(S.shape[0]):
        for n in range(S.shape[0]):
            S[m, n] = -rate * Jv[m, n] - place * Jq[m, n]
        S[m, m] += one


@njit
def eliminate(S, pivots):
    """S ← L U with rows exchanged as `pivots` says; whether there is a solution."""
    size = S.shape[0]
    for k in range(size):
        best = k
        for m in range(k + 1, size):
            if abs(S[m, k]) > abs(S[best, k]):
                best = m
        pivots[k] = best
        if not abs(S[best, k]) > 0.0:
            return False
        if best != k:
            for n in range(size):
                S[k, n], S[best, n] = S[best, n], S[k, n]
        over = 1.0 / S[k, k]
        for m in range(k + 1, size):
            if S[m, k] != 0.0:
                factor = S[m, k] * over
                S[m, k] = factor
                for n in range(k + 1, size):
                    S[m, n] -= factor * S[k, n]
    return True


@njit
def substitute(S, pivots, x):
    """x ← the solution of S x = x, by the factor of `eliminate`."""
    size = S.shape[0]
    for k in range(size):
        x[k], x[pivots[k]] = x[pivots[k]], x[k]
        for n in range(k):
            x[k] -= S[k, n] * x[n]
    for m in range(size):
        k = size - 1 - m
        for n in range(k + 1, size):
            x[k] -= S[k, n] * x[n]
        x[k] /= S[k, k]
