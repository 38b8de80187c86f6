"""Linear complementarity problems: w = A z + b with 0 ≤ w ⊥ z ≥ 0, small and dense.

`lemke` follows Lemke's path with the lexicographic ratio test, so that it cannot cycle where
several ratios are equal. Where rows depend on each other, as in a pile that contacts hold more
than once, ratios are equal but for rounding, and a path may end on a ray though there are
solutions: then others are tried, which count more ratios as equal or begin with other weights of
the artificial unknown. What they find is checked.

Cottle, Pang, Stone: The Linear Complementarity Problem (1992), 4.4 and 4.9.
"""

from __future__ import annotations

import numpy as np

__all__ = ["lemke"]

Array = np.ndarray

#: A pivot below this part of its column is none; ratios nearer to each other than this are equal.
PIVOT, EQUAL = 1e-13, 1e-14
#: Equal ratios of further paths; starts of the weights of their artificial unknown.
MORE_EQUAL, WEIGHTS = (1e-12, 1e-10), 12
#: What a solution of theirs may violate, in parts of the greatest |b|; 1e-12 is left of right ones.
RESIDUAL = 1e-9
#: Exchanges, at most, of a problem of n unknowns: this times n + 1. Lemke's path takes about n.
EXCHANGES = 50


def lemke(A: Array, b: Array) -> Array | None:
    """z of one solution; None where all paths end on a ray, which for copositive A means that there
    is no solution.

    Parameters
    ----------
    A : array (n, n)
    b : array (n,)

    Examples
    --------
    >>> lemke(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])).round(12)
    array([1.33333333, 2.33333333])
    >>> lemke(np.array([[0.0]]), np.array([-1.0])) is None
    True
    """
    n = len(b)
    if n == 0 or b.min() >= 0.0:
        return np.zeros(n)
    found = _path(A, b, np.ones(n), EQUAL)
    if found is not None:
        return found
    for equal in MORE_EQUAL:
        found = _path(A, b, np.ones(n), equal)
        if found is not None and _solves(A, b, found):
            return found
    for seed in range(WEIGHTS):
        weights = 1.0 + np.random.default_rng(seed).random(n)
        found = _path(A, b, weights, MORE_EQUAL[-1])
        if found is not None and _solves(A, b, found):
            return found
    return None


def _solves(A: Array, b: Array, z: Array) -> bool:
    """Whether w and z are not negative, and of each pair one is zero."""
    w, size = (A @ z + b) / np.abs(b).max(), max(float(z.max()), 1e-300)
    return bool(np.abs(np.minimum(w, z / size)).max() <= RESIDUAL)


def _path(A: Array, b: Array, weights: Array, equal: float) -> Array | None:
    """Lemke's path with these weights of the artificial unknown (n,); None on a ray."""
    n = len(b)
    # scaled rows: neither signs nor zeros change
    size = np.maximum(np.abs(A).max(axis=1), 1e-300)
    # w − A z − d z₀ = b: columns of w, of z, of z₀, and the right-hand side
    table = np.hstack([np.eye(n), -A / size[:, None], -weights[:, None], (b / size)[:, None]])
    basis, row, entering = list(range(n)), int(np.argmin(b / size / weights)), 2 * n
    for _ in range(EXCHANGES * (n + 1)):
        table[row] /= table[row, entering]
        others = np.arange(n) != row
        table[others] -= np.outer(table[others, entering], table[row])
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = table[:, -1]
            return np.maximum(z[n : 2 * n], 0.0)
        entering = leaving + n if leaving < n else leaving - n
        column = table[:, entering]
        able = np.flatnonzero(column > PIVOT * max(1.0, float(np.abs(column).max())))
        if not len(able):
            return None
        row = _leaving(table, basis, column, able, equal)
    return None


def _leaving(table: Array, basis: list[int], column: Array, able: Array, equal: float) -> int:
    """The row of the least ratio; of equal ones z₀'s, else the lexicographically least."""
    n = len(basis)
    best = able
    for place in (-1, *range(n)):
        ratio = table[best, place] / column[best]
        least = float(ratio.min())
        best = best[ratio <= least + equal * max(1.0, abs(least))]
        if place == -1:
            artificial = [k for k in best if basis[k] == 2 * n]
            best = np.array(artificial) if artificial else best
        if len(best) == 1:
            break
    return int(best[0])
