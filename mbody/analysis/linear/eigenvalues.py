"""The quadratic eigenproblem of small motions, free motions without inertia among them.

F. Tisseur, K. Meerbergen: The quadratic eigenvalue problem, SIAM Review 43 (2001), 235-286.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["eigenvalues"]

Array = np.ndarray

#: A part of its size below which a real or an imaginary part of an eigenvalue is rounding; a double
#: root is found to half the digits.
ROUNDING, HALF = 1e-9, 1e-7
#: A part of the greatest singular value below which one is none, once masses are out.
NONE = 1e-9
#: A root below this part of the natural rate is that of a motion that nothing drives back.
SLOW = 1e-6
#: A mass matrix whose least eigenvalue is below this part of the greatest has no inverse.
MASSLESS = 1e-12


def eigenvalues(M: Array, C: Array, K: Array) -> tuple[list[complex], list[Array], int] | None:
    """Roots s of (s² M + s C + K) u = 0, their vectors u, and how many motions have no inertia;
    None where every s is a root.
    """
    free = len(M)
    parts = [float(np.abs(part).max()) for part in (M, C, K)]
    inertia = np.linalg.eigvalsh(M)
    infinite = int((inertia <= MASSLESS * parts[0]).sum())
    # a unit of time in which the greatest numbers are one
    if parts[0] and parts[2]:
        fast = math.sqrt(parts[2] / parts[0])
    elif parts[1]:
        fast = parts[1] / parts[0] if parts[0] else parts[2] / parts[1]
    else:
        fast = 1.0
    fast = fast or 1.0
    whole = max(parts[0] * fast**2, parts[1] * fast, parts[2]) or 1.0
    M, C, K = M * fast**2 / whole, C * fast / whole, K / whole
    zero, one = np.zeros((free, free)), np.eye(free)
    still = np.linalg.svd(K)
    rigid = still[2][still[1] <= NONE * max(float(still[1].max()), 1e-300)]
    damped = np.abs(C).max() > MASSLESS
    if damped:
        E, A = np.block([[one, zero], [zero, M]]), np.block([[zero, one], [-K, -C]])
        solved = _finite(E, A)
    else:
        solved = _finite(M, -K)
    if solved is None:
        return None
    roots, vectors = solved
    if not damped:
        squares, roots = roots, np.sqrt(roots.astype(complex))
        # flutter: the other two of four roots
        twins = np.abs(squares.imag) > HALF * np.abs(squares)
        roots = np.append(roots, -roots[twins])
        vectors = np.hstack([vectors, vectors[:, twins]])
    found, shapes = [0j] * len(rigid), [way.astype(complex) for way in rigid]
    for root, vector in zip(roots, vectors[:free].T, strict=True):
        size = abs(root)
        if len(rigid) and size < SLOW:
            continue
        real = 0.0 if abs(root.real) <= ROUNDING * size else root.real
        imaginary = 0.0 if abs(root.imag) <= HALF * size else root.imag
        if imaginary < 0.0:
            continue
        found.append(fast * complex(real, imaginary))
        shapes.append(vector.astype(complex))
    return found, shapes, infinite


def _finite(E: Array, A: Array) -> tuple[Array, Array] | None:
    """Finite roots and vectors of A z = s E z, E singular or not; None where every s is a root.

    Where uᵀ E = 0, uᵀ A z = 0 holds for every finite root: z is sought among those, and again,
    until E has an inverse there. Then no infinite root is left, of whatever order it was.
    """
    Z, zero = np.eye(len(A)), MASSLESS
    while len(A):
        u, sizes, _ = np.linalg.svd(E)
        rank = int((sizes > zero * max(float(sizes.max()), 1e-300)).sum())
        if rank == len(A):
            roots, vectors = np.linalg.eig(np.linalg.solve(E, A))
            return roots, Z @ vectors
        fixed = u[:, rank:].T @ A
        _, parts, vt = np.linalg.svd(fixed)
        if not parts.min() > NONE:
            return None
        kept = vt[len(fixed) :].T
        E, A = u[:, :rank].T @ E @ kept, u[:, :rank].T @ A @ kept
        Z, zero = Z @ kept, NONE
    return np.zeros(0), Z
