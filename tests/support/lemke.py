"""Lemke's path of `mbody.kernels.complementarity` by itself, for problems of the tests."""

from __future__ import annotations

import numpy as np

from mbody.core import tolerances as tol
from mbody.kernels.complementarity import PATHS, lemke_path

Array = np.ndarray


def lemke(A: Array, b: Array) -> Array | None:
    """z of one solution of 0 ≤ A z + b ⊥ z ≥ 0; None where all paths end on a ray, which for
    copositive A means that there is no solution. A (n, n), `b` (n,).

    >>> lemke(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])).round(12)
    array([1.33333333, 2.33333333])
    >>> lemke(np.array([[0.0]]), np.array([-1.0])) is None
    True
    """
    n = len(b)
    z, table, basis = np.zeros(n), np.zeros((n, 2 * n + 2)), np.zeros(n, dtype=np.int64)
    A, b = np.ascontiguousarray(A, dtype=float), np.ascontiguousarray(b, dtype=float)
    for path in range(PATHS):
        if lemke_path(A, b, z, table, basis, n, path) and _solves(A, b, z):
            return z
    return None


def _solves(A: Array, b: Array, z: Array) -> bool:
    """Whether w and z are not negative, and of each pair one is zero."""
    w, size = (A @ z + b) / max(np.abs(b).max(initial=0.0), tol.TINY), max(z.max(initial=0.0), 1.0)
    return bool(np.abs(np.minimum(w, z / size)).max(initial=0.0) <= tol.COMPLEMENTARITY_RESIDUAL)
