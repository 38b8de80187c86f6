"""Exact solutions of linear systems with constant coefficients, for tests of motions."""

import numpy as np

__all__ = ["discrete", "exponential"]


def exponential(A):
    """exp A by scaling and squaring of its series, to rounding for matrices of a few rows."""
    A = np.asarray(A, dtype=float)
    doublings = max(0, int(np.ceil(np.log2(max(np.abs(A).sum(axis=1).max(), 1e-300)))) + 4)
    scaled, term, total = A / 2.0**doublings, np.eye(len(A)), np.eye(len(A))
    for n in range(1, 20):
        term = term @ scaled / n
        total = total + term
    for _ in range(doublings):
        total = total @ total
    return total


def discrete(A, B, h):
    """(exp A h, ∫ exp A s ds B): a step of x′ = A x + B u with constant u."""
    n, m = np.shape(B)
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = A, B
    found = exponential(whole * h)
    return found[:n, :n], found[:n, n:]
