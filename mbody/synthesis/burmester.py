"""Rigid-body guidance: circle points and centre points of a plane in three, four or five poses.

A circle point is a point of the moving plane whose places in all poses lie on a circle, about its
centre point; crank and rocker of a four-bar that guides the plane are two such pairs. With Q the
point in the first pose, its places are r Q + t, r = e^{iα}, and m is the centre where

    t̄ r Q + t r̄ Q̄ + |t|² − m̄ ((r − 1) Q + t) − m ((r̄ − 1) Q̄ + t̄) = 0

for each further pose: two linear equations for m where there are three poses, a curve of pairs
where there are four (Burmester's), and at most four pairs where there are five.

Sources: J. M. McCarthy and G. S. Soh, *Geometric Design of Linkages*, 2nd ed. 2011, chapter 5;
A. G. Erdman and G. N. Sandor, *Mechanism Design* vol. 2, 1984, chapter 3 (compatibility linkage).
"""

from __future__ import annotations

import numpy as np

__all__ = ["Displacements", "displaced", "dyads", "places", "sliding_points"]

#: Relative deviation by which an eigenvector counts as a real pair.
REAL = 1e-6
#: Steps of Newton's method that refine a pair.
STEPS = 3
#: Angles of the first link by which the curves of four poses are sampled.
SAMPLES = 720
#: A determinant below this share of its terms counts as zero.
SINGULAR = 1e-9

#: Rotations r and translations t from the first pose to each further one, both complex.
Displacements = tuple[np.ndarray, np.ndarray]


def displaced(where: np.ndarray, angle: np.ndarray) -> Displacements:
    """Displacements from the first of poses: places of the origin (complex), angles [rad]."""
    r = np.exp(1j * (angle[1:] - angle[0]))
    return r, where[1:] - r * where[0]


def places(point: complex, moves: Displacements) -> np.ndarray:
    """Where a point of the moving plane is in all poses."""
    return np.concatenate([[point], moves[0] * point + moves[1]])


def dyads(moves: Displacements, points: np.ndarray) -> np.ndarray:
    """Pairs (Q, m) of circle points in the first pose and centre points, complex (pairs, 2).

    All real ones of five poses; along the curves of four; of three those of the given points Q.
    """
    if len(moves[0]) == 4:
        return _of_five(moves)
    if len(moves[0]) == 3:
        return _of_four(moves)
    found = [(q, _centre(q, moves)) for q in points]
    return np.array([(q, m) for q, m in found if np.isfinite(m)])


def sliding_points(moves: Displacements, count: int) -> np.ndarray:
    """Points of the moving plane in the first pose whose places lie on a line, complex (points,).

    Of three poses they form a circle, of which some are chosen; of four poses there is at most
    one, of five none.
    """
    r, t = moves
    found = [_circle(r[[0, k]], t[[0, k]]) for k in range(1, len(r))]
    circles = [circle for circle in found if circle is not None]
    if len(circles) < len(found):
        return np.empty(0, dtype=complex)
    centre, radius = circles[0]
    if len(circles) == 1:
        return centre + radius * np.exp(1j * (np.arange(count) + 0.5) * 2.0 * np.pi / count)
    if len(circles) > 2:
        return np.empty(0, dtype=complex)
    other, second = circles[1]
    # both circles pass the pole of the first displacement, where the point does not move
    pole = t[0] / (1.0 - r[0])
    axis = (other - centre) / abs(other - centre)
    point = centre + axis**2 * np.conj(pole - centre)
    return np.array([point]) if abs(point - pole) > SINGULAR * (abs(pole) + second) else point[:0]


def _circle(r: np.ndarray, t: np.ndarray) -> tuple[complex, float] | None:
    """Points whose places in three poses lie on a line: Im((p₂ − Q) conj(p₃ − Q)) = 0."""
    a, b = r - 1.0, t
    square = (a[0] * np.conj(a[1])).imag
    linear = 1j * (np.conj(a[0]) * b[1] - np.conj(a[1]) * b[0])
    rest = (b[0] * np.conj(b[1])).imag
    if abs(square) < SINGULAR:
        return None
    # square |Q|² + Re(conj(linear) Q) + rest = 0
    centre = -linear / (2.0 * square)
    radius = abs(centre) ** 2 - rest / square
    return (complex(centre), float(np.sqrt(radius))) if radius > 0.0 else None


def _centre(q: complex, moves: Displacements) -> complex:
    """The centre of the circle through three places; NaN where they lie on a line."""
    r, t = moves
    row = (r - 1.0) * q + t  # Re(conj(m) row) = right
    right = 0.5 * (np.abs(r * q + t) ** 2 - abs(q) ** 2)
    determinant = row[0].real * row[1].imag - row[0].imag * row[1].real
    if abs(determinant) <= SINGULAR * abs(row[0]) * abs(row[1]):
        return complex(np.nan, np.nan)
    x = (right[0] * row[1].imag - right[1] * row[0].imag) / determinant
    y = (right[1] * row[0].real - right[0] * row[1].real) / determinant
    return complex(x, y)


def _of_five(moves: Displacements) -> np.ndarray:
    """All real pairs of five poses, by eigenvalues.

    Q̄ = λ is taken as an unknown of its own. The four equations and their products with Q are linear
    in (m, 1, mQ, Q), with coefficients linear in λ, and in (m̄, m̄Q, m̄Q², Q²), without λ: what is
    orthogonal to the columns of these leaves a problem of four eigenvalues.
    """
    r, t = moves
    a, zero = r - 1.0, np.zeros(4, dtype=complex)
    # columns m, 1, mQ, Q: constant and by λ
    constant = np.column_stack([-np.conj(t), np.abs(t) ** 2, zero, np.conj(t) * r])
    linear = np.column_stack([-np.conj(a), t * np.conj(r), zero, zero])
    constant = np.vstack([constant, np.column_stack([zero, zero, -np.conj(t), np.abs(t) ** 2])])
    linear = np.vstack([linear, np.column_stack([zero, zero, -np.conj(a), t * np.conj(r)])])
    # columns m̄, m̄Q, m̄Q², Q²
    rest = np.vstack(
        [
            np.column_stack([-t, -a, zero, zero]),
            np.column_stack([zero, -t, -a, np.conj(t) * r]),
        ]
    )
    left = np.linalg.svd(rest)[0][:, 4:].conj().T
    try:
        values, vectors = np.linalg.eig(np.linalg.solve(left @ linear, -left @ constant))
    except np.linalg.LinAlgError:
        return np.empty((0, 2), dtype=complex)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        with np.errstate(all="ignore"):
            q, m = vector[3] / vector[1], vector[0] / vector[1]
        if not (np.isfinite(q) and np.isfinite(m)):
            continue
        if abs(value - np.conj(q)) > REAL * (abs(q) + np.abs(t).max()):
            continue
        found.append(_refined(complex(q), complex(m), moves))
    return np.array(found).reshape(-1, 2)


def _refined(q: complex, m: complex, moves: Displacements) -> tuple[complex, complex]:
    """Newton's method on the four equations of a pair."""
    r, t = moves
    for _ in range(STEPS):
        row = (r - 1.0) * q + t
        value = 0.5 * (np.abs(r * q + t) ** 2 - abs(q) ** 2) - (np.conj(m) * row).real
        by_q = np.conj(r) * (r * q + t) - q - m * (np.conj(r) - 1.0)
        matrix = np.column_stack([by_q.real, by_q.imag, -row.real, -row.imag])
        step = np.linalg.lstsq(matrix, -value, rcond=None)[0]
        q, m = q + complex(step[0], step[1]), m + complex(step[2], step[3])
    return q, m


def _of_four(moves: Displacements) -> np.ndarray:
    """Pairs along Burmester's curves of four poses, by the compatibility linkage: with the turns β
    of the link, w (e^{iβ} − 1) + z (e^{iα} − 1) = δ has a solution where a determinant vanishes,
    Δ₁ + Δ₂ e^{iβ₂} + Δ₃ e^{iβ₃} + Δ₄ e^{iβ₄} = 0: a four-bar whose crank turns by β₂.
    """
    r, t = moves
    a, d = r - 1.0, t  # of the point of the plane that is at the origin in the first pose
    minors = [
        a[1] * d[2] - a[2] * d[1],
        a[2] * d[0] - a[0] * d[2],
        a[0] * d[1] - a[1] * d[0],
    ]
    first = np.exp(2j * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    rest = sum(minors) - minors[0] * first  # Δ₃ e^{iβ₃} + Δ₄ e^{iβ₄}
    square = np.abs(rest) ** 2
    found = []
    with np.errstate(all="ignore"):
        along = 0.5 * (square + abs(minors[1]) ** 2 - abs(minors[2]) ** 2)
        across = np.sqrt(abs(minors[1]) ** 2 * square - along**2)
        for side in (1.0, -1.0):
            second = (along + 1j * side * across) / np.conj(rest) / minors[1]
            determinant = (first - 1.0) * a[1] - (second - 1.0) * a[0]
            w = (d[0] * a[1] - d[1] * a[0]) / determinant
            z = ((first - 1.0) * d[1] - (second - 1.0) * d[0]) / determinant
            # that point is z from the pin, which is w from its centre
            good = np.isfinite(w) & np.isfinite(z) & (np.abs(w) > 0.0)
            found.append(np.column_stack([-z, -z - w])[good])
    return np.vstack(found)
