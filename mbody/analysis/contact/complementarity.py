"""Linear complementarity problems: w = A z + b with 0 ≤ w ⊥ z ≥ 0, small and dense.

`lemke` follows Lemke's path with the lexicographic ratio test, so that it cannot cycle where
several ratios are equal; `every_solution` tries all 2ⁿ supports, and so tells whether there is
none, one or several: what Painlevé met.

Cottle, Pang, Stone: The Linear Complementarity Problem (1992), 4.4 and 4.9.
"""

from __future__ import annotations

import itertools

import numpy as np

__all__ = ["MOST_UNKNOWNS", "every_solution", "lemke"]

Array = np.ndarray

#: Problems of which all supports are tried, 2⁹ of them, at most.
MOST_UNKNOWNS = 9
#: A pivot below this part of its column is none; ratios nearer to each other than this are equal.
PIVOT, EQUAL = 1e-13, 1e-14
#: Exchanges, at most, of a problem of n unknowns: this times n + 1. Lemke's path takes about n.
EXCHANGES = 50
#: Supports whose matrix is worse conditioned than this are not tried; solutions may violate signs
#: by `ROUGH` of the right-hand side, and are one where they are as near as `SAME`.
SINGULAR, ROUGH, SAME = 1e12, 1e-10, 1e-8


def lemke(A: Array, b: Array) -> Array | None:
    """z of one solution; None where Lemke's path ends on a ray, which for copositive A means that
    there is no solution.

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
    # scaled rows: neither signs nor zeros change
    size = np.maximum(np.abs(A).max(axis=1), 1e-300)
    # w − A z − e z₀ = b: columns of w, of z, of z₀, and the right-hand side
    table = np.hstack([np.eye(n), -A / size[:, None], -np.ones((n, 1)), (b / size)[:, None]])
    basis, row, entering = list(range(n)), int(np.argmin(b / size)), 2 * n
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
        row = _leaving(table, basis, column, able)
    return None


def _leaving(table: Array, basis: list[int], column: Array, able: Array) -> int:
    """The row of the least ratio; of equal ones z₀'s, else the lexicographically least."""
    n = len(basis)
    best = able
    for place in (-1, *range(n)):
        ratio = table[best, place] / column[best]
        least = float(ratio.min())
        best = best[ratio <= least + EQUAL * max(1.0, abs(least))]
        if place == -1:
            artificial = [k for k in best if basis[k] == 2 * n]
            best = np.array(artificial) if artificial else best
        if len(best) == 1:
            break
    return int(best[0])


def every_solution(A: Array, b: Array) -> list[Array]:
    """All solutions z whose support has a regular matrix, those without duplicates.

    Parameters
    ----------
    A : array (n, n)
        With n at most `MOST_UNKNOWNS`.
    b : array (n,)

    Examples
    --------
    A positive diagonal has one solution for every b, a negative one two of them or none:

    >>> A = np.array([[-1.0]])
    >>> [len(every_solution(A, np.array([b]))) for b in (1.0, -1.0)]
    [2, 0]
    """
    n, found = len(b), list[Array]()
    size = max(float(np.abs(b).max(initial=0.0)), 1e-300)
    for mask in itertools.product((False, True), repeat=n):
        support, z = np.flatnonzero(mask), np.zeros(n)
        if len(support):
            part = A[np.ix_(support, support)]
            if np.linalg.cond(part) > SINGULAR:
                continue
            z[support] = np.linalg.solve(part, -b[support])
        w = A @ z + b
        big = max(float(np.abs(z).max(initial=0.0)), 1e-300)
        if z.min(initial=0.0) < -ROUGH * big or w.min(initial=0.0) < -ROUGH * size:
            continue
        if not any(np.allclose(z, other, rtol=0.0, atol=SAME * big) for other in found):
            found.append(z)
    return found
