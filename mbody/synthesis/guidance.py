"""Candidates for functions and poses: linkages in closed form, as positions to be followed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.least_squares import least_squares
from mbody.synthesis.judging import Positions
from mbody.synthesis.linkage_kinds import FourBar, Kind, SliderCrank

# -- Rigid-body guidance: circle and centre points of three, four or five poses ----------------
# A circle point is a point of the moving plane whose places in all poses lie on a circle, about its
# centre point; crank and rocker of a four-bar that guides the plane are two such pairs. With Q the
# point in the first pose, its places are r Q + t, r = e^{iα}, and m is the centre where
#
#     t̄ r Q + t r̄ Q̄ + |t|² − m̄ ((r − 1) Q + t) − m ((r̄ − 1) Q̄ + t̄) = 0
#
# for each further pose: two linear equations for m where there are three poses, a curve of pairs
# where there are four (Burmester's), and at most four pairs where there are five.
#
# Sources: J. M. McCarthy and G. S. Soh, *Geometric Design of Linkages*, 2nd ed. 2011, chapter 5;
# A. G. Erdman and G. N. Sandor, *Mechanism Design* vol. 2, 1984, chapter 3 (compatibility linkage).

#: Steps of Newton's method that refine a pair.
STEPS = 3
#: Angles of the first link by which the curves of four poses are sampled.
SAMPLES = 720

#: Rotations r and translations t from the first pose to each further one, both complex.
Displacements = tuple[np.ndarray, np.ndarray]


def displaced(where: np.ndarray, angle: np.ndarray) -> Displacements:
    """Displacements from the first of poses: places of the origin (complex), angles [rad]."""
    r = np.exp(1j * (angle[1:] - angle[0]))
    return r, where[1:] - r * where[0]


def places(point: complex, moves: Displacements) -> np.ndarray:
    """Places of a point of the moving plane in all poses."""
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
    return (
        np.array([point])
        if abs(point - pole) > tol.DETERMINANT_ZERO * (abs(pole) + second)
        else point[:0]
    )


def _circle(r: np.ndarray, t: np.ndarray) -> tuple[complex, float] | None:
    """Points whose places in three poses lie on a line: Im((p₂ − Q) conj(p₃ − Q)) = 0."""
    a, b = r - 1.0, t
    square = (a[0] * np.conj(a[1])).imag
    linear = 1j * (np.conj(a[0]) * b[1] - np.conj(a[1]) * b[0])
    constant = (b[0] * np.conj(b[1])).imag
    if abs(square) < tol.DETERMINANT_ZERO:
        return None
    # square |Q|² + Re(conj(linear) Q) + constant = 0
    centre = -linear / (2.0 * square)
    radius = abs(centre) ** 2 - constant / square
    return (complex(centre), float(np.sqrt(radius))) if radius > 0.0 else None


def _centre(q: complex, moves: Displacements) -> complex:
    """The centre of the circle through three places; NaN where they lie on a line."""
    r, t = moves
    row = (r - 1.0) * q + t  # Re(conj(m) row) = right
    right = 0.5 * (np.abs(r * q + t) ** 2 - abs(q) ** 2)
    determinant = row[0].real * row[1].imag - row[0].imag * row[1].real
    if abs(determinant) <= tol.DETERMINANT_ZERO * abs(row[0]) * abs(row[1]):
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
    others = np.vstack(
        [np.column_stack([-t, -a, zero, zero]), np.column_stack([zero, -t, -a, np.conj(t) * r])]
    )
    left = np.linalg.svd(others)[0][:, 4:].conj().T
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
        if abs(value - np.conj(q)) > tol.ROOT_REAL * (abs(q) + np.abs(t).max()):
            continue
        found.append(_refined_pair(complex(q), complex(m), moves))
    return np.array(found).reshape(-1, 2)


def _refined_pair(q: complex, m: complex, moves: Displacements) -> tuple[complex, complex]:
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
    """Pairs along Burmester's curves of four poses, by the compatibility linkage: with the
    rotations β of the link, w (e^{iβ} − 1) + z (e^{iα} − 1) = δ has a solution where a determinant
    vanishes, Δ₁ + Δ₂ e^{iβ₂} + Δ₃ e^{iβ₃} + Δ₄ e^{iβ₄} = 0: a four-bar whose crank turns by β₂.
    """
    r, t = moves
    a, d = r - 1.0, t  # of the point of the plane that is at the origin in the first pose
    minors = [a[1] * d[2] - a[2] * d[1], a[2] * d[0] - a[0] * d[2], a[0] * d[1] - a[1] * d[0]]
    first = np.exp(2j * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    others = sum(minors) - minors[0] * first  # Δ₃ e^{iβ₃} + Δ₄ e^{iβ₄}
    square = np.abs(others) ** 2
    found = []
    with np.errstate(all="ignore"):
        along = 0.5 * (square + abs(minors[1]) ** 2 - abs(minors[2]) ** 2)
        across = np.sqrt(abs(minors[1]) ** 2 * square - along**2)
        for side in (1.0, -1.0):
            second = (along + 1j * side * across) / np.conj(others) / minors[1]
            determinant = (first - 1.0) * a[1] - (second - 1.0) * a[0]
            w = (d[0] * a[1] - d[1] * a[0]) / determinant
            z = ((first - 1.0) * d[1] - (second - 1.0) * d[0]) / determinant
            # that point is z from the pin, which is w from its centre
            good = np.isfinite(w) & np.isfinite(z) & (np.abs(w) > 0.0)
            found.append(np.column_stack([-z, -z - w])[good])
    return np.vstack(found)


# -- Function generation: the output follows the crank at given pairs, in closed form ----------
# Four-bar (F. Freudenstein, Trans. ASME 77 (1955) 853-861): with a, b, c, d the lengths of crank,
# coupler, rocker and ground, K1 = d/a, K2 = d/c, K3 = (a² − b² + c² + d²)/(2ac),
#
#     K1 cos ψ − K2 cos φ + K3 = cos(φ − ψ).
#
# Slider-crank of offset e, travel x along the guide: x² = 2a x cos φ + 2ae sin φ + b² − a² − e².
#
# Three pairs make three linear equations. With the output's zero unknown too there are four pairs,
# with both zeros five: cosines and sines of the zeros are taken as unknowns of their own, so that
# the equations stay linear; what is left is a line of solutions, on which one relation between the
# unknowns, of degree two or three, decides. So all real solutions are found. More pairs are met in
# the sense of least squares.

#: Zeros of the dials that are tried where pairs are met by least squares, and how many of the best
#: are refined.
GRID, KEEP = 24, 24


@dataclass(frozen=True)
class Generated:
    """A function generator: lengths, and the zeros that are added to the given input and output.

    Of a four-bar `third` is the rocker; of a slider-crank it is the offset.
    """

    crank: float
    coupler: float
    third: float
    input_zero: float
    output_zero: float


def four_bars(phi: np.ndarray, psi: np.ndarray) -> list[Generated]:
    """All four-bars on a ground of 1 that have ψ at φ, with 3, 4 or 5 pairs; with more the best."""
    if len(phi) == 3:
        return [one for one in [_linear_four_bar(phi, psi)] if one]
    if len(phi) == 4:
        return list(_four_bars_of_4(phi, psi))
    if len(phi) == 5:
        return list(_four_bars_of_5(phi, psi))
    return _fitted_four_bars(phi, psi)


def slider_cranks(phi: np.ndarray, x: np.ndarray) -> list[Generated]:
    """All slider-cranks with travel x at φ, with 3, 4 or 5 pairs; with more the best."""
    # by its own size, so that no unit has a say in what is small
    size = float(np.abs(x).max()) or 1.0
    return [
        replace(
            one,
            crank=size * one.crank,
            coupler=size * one.coupler,
            third=size * one.third,
            output_zero=size * one.output_zero,
        )
        for one in _slider_cranks(phi, x / size)
    ]


def _slider_cranks(phi: np.ndarray, x: np.ndarray) -> list[Generated]:
    """Slider-cranks for angles and travels, scaled to travels of size 1."""
    if len(phi) == 3:
        matrix = np.column_stack([x * np.cos(phi), np.sin(phi), np.ones(3)])
        solution = _solved(matrix, x**2)
        if solution is None:
            return []
        return _generating_sliders(solution[0], solution[1], solution[2], 0.0, 0.0)
    if len(phi) == 4:
        return list(_sliders_of_4(phi, x))
    if len(phi) == 5:
        return list(_sliders_of_5(phi, x))
    return _fitted_sliders(phi, x)


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """Least squares, or None where columns depend on one another."""
    solution, _, rank, _ = np.linalg.lstsq(matrix, right, rcond=tol.LEAST_SQUARES_RANK_FINE)
    return solution if rank == matrix.shape[1] else None


def _linear_four_bar(phi: np.ndarray, psi: np.ndarray) -> Generated | None:
    matrix = np.column_stack([np.cos(psi), -np.cos(phi), np.ones(len(phi))])
    k = _solved(matrix, np.cos(phi - psi))
    return None if k is None else _generating_four_bar(k[0], k[1], k[2], 0.0, 0.0)


def _generating_four_bar(
    k1: float, k2: float, k3: float, input_zero: float, output_zero: float
) -> Generated | None:
    """Lengths from Freudenstein's numbers; a negative one is a link whose mark is opposite."""
    if min(abs(k1), abs(k2)) < tol.SYNTHESIS_COEFFICIENT_NONE:
        return None  # a link without end
    crank, rocker = 1.0 / k1, 1.0 / k2
    square = crank**2 + rocker**2 + 1.0 - 2.0 * crank * rocker * k3
    if not square > 0.0:
        return None
    input_zero += 0.0 if crank > 0.0 else np.pi
    output_zero += 0.0 if rocker > 0.0 else np.pi
    return Generated(
        abs(crank), float(np.sqrt(square)), abs(rocker), float(input_zero), float(output_zero)
    )


def _generating_sliders(
    k1: float, k2: float, k3: float, input_zero: float, output_zero: float
) -> list[Generated]:
    """Lengths of a slider-crank from K1 = 2a, K2 = 2ae, K3 = b² − a² − e²."""
    if abs(k1) < tol.SYNTHESIS_SLIDER_NONE:
        return []
    crank, offset = 0.5 * k1, k2 / k1
    square = k3 + crank**2 + offset**2
    if not square > 0.0:
        return []
    if crank < 0.0:
        crank, input_zero = -crank, input_zero + np.pi
    rod = float(np.sqrt(square))
    return [Generated(float(crank), rod, float(offset), float(input_zero), float(output_zero))]


def _line(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Two vectors that span what the rows leave free; None where they leave more."""
    _, sizes, whole = np.linalg.svd(matrix)
    if sizes[-1] < tol.LEAST_SQUARES_RANK_FINE * sizes[0]:
        return None
    return whole[-2], whole[-1]


def _on_line(
    start: np.ndarray, along: np.ndarray, relation: Callable[[np.ndarray], float], degree: int
) -> Iterator[np.ndarray]:
    """The points start + λ along at which a polynomial relation of a degree holds, λ real."""
    nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    values = [relation(start + node * along) for node in nodes]
    roots = np.roots(np.polyfit(nodes, values, degree))
    for root in roots:
        if abs(root.imag) <= tol.ROOT_REAL_FUNCTION_POINTS * (1.0 + abs(root)):
            yield start + root.real * along


def _four_bars_of_4(phi: np.ndarray, psi: np.ndarray) -> Iterator[Generated]:
    """Unknowns K1 cos ψ₀, K1 sin ψ₀, K2, K3, cos ψ₀, −sin ψ₀ up to a factor."""
    rotation = phi - psi
    rows = [
        np.cos(psi),
        -np.sin(psi),
        -np.cos(phi),
        np.ones(4),
        -np.cos(rotation),
        np.sin(rotation),
    ]
    line = _line(np.column_stack(rows))
    if line is None:
        return
    for u in _on_line(*line, lambda u: u[0] * u[5] + u[1] * u[4], 2):
        size = np.hypot(u[4], u[5])
        zero = np.arctan2(-u[5], u[4])
        k1 = (u[0] * np.cos(zero) + u[1] * np.sin(zero)) / size
        if found := _generating_four_bar(k1, u[2] / size, u[3] / size, 0.0, zero):
            yield found


def _four_bars_of_5(phi: np.ndarray, psi: np.ndarray) -> Iterator[Generated]:
    """Unknowns K1 e^{iψ₀}, K2 e^{iφ₀}, K3, e^{i(φ₀ − ψ₀)} up to a factor."""
    rotation = phi - psi
    rows = [np.cos(psi), -np.sin(psi), -np.cos(phi), np.sin(phi), np.ones(5)]
    line = _line(np.column_stack([*rows, -np.cos(rotation), np.sin(rotation)]))
    if line is None:
        return

    def relation(u: np.ndarray) -> float:
        first, second, third = (complex(*u[k : k + 2]) for k in (0, 2, 5))
        return float((third * second.conjugate() * first).imag)

    for u in _on_line(*line, relation, 3):
        size = np.hypot(u[5], u[6])
        first, second = complex(u[0], u[1]) / size, complex(u[2], u[3]) / size
        output_zero = np.angle(first)
        input_zero = np.arctan2(u[6], u[5]) + output_zero
        k2 = (second * np.exp(-1j * input_zero)).real
        if found := _generating_four_bar(abs(first), k2, u[4] / size, input_zero, output_zero):
            yield found


def _sliders_of_4(phi: np.ndarray, x: np.ndarray) -> Iterator[Generated]:
    """Unknowns K1, K1 x₀, K2, K3 − x₀², x₀ and the factor of the right side."""
    rows = [x * np.cos(phi), np.cos(phi), np.sin(phi), np.ones(4), -2.0 * x, -(x**2)]
    line = _line(np.column_stack(rows))
    if line is None:
        return
    for u in _on_line(*line, lambda u: u[1] * u[5] - u[0] * u[4], 2):
        if abs(u[5]) > tol.SYNTHESIS_COEFFICIENT_NONE * np.abs(u).max():
            u = u / u[5]
            yield from _generating_sliders(u[0], u[2], u[3] + u[4] ** 2, 0.0, u[4])


def _sliders_of_5(phi: np.ndarray, x: np.ndarray) -> Iterator[Generated]:
    """Unknowns u = K1 cos φ₀, v = K1 sin φ₀, A = u x₀ + K2 sin φ₀, B = K2 cos φ₀ − v x₀,
    K3 − x₀², x₀ and the factor of the right side; A u − B v = x₀ (u² + v²).
    """
    c, s = np.cos(phi), np.sin(phi)
    line = _line(np.column_stack([x * c, -x * s, c, s, np.ones(5), -2.0 * x, -(x**2)]))
    if line is None:
        return

    def relation(u: np.ndarray) -> float:
        return float((u[2] * u[0] - u[3] * u[1]) * u[6] - u[5] * (u[0] ** 2 + u[1] ** 2))

    for u in _on_line(*line, relation, 3):
        if abs(u[6]) <= tol.SYNTHESIS_COEFFICIENT_NONE * np.abs(u).max():
            continue
        u = u / u[6]
        zero = np.arctan2(u[1], u[0])
        k2 = (u[2] - u[0] * u[5]) * np.sin(zero) + (u[3] + u[1] * u[5]) * np.cos(zero)
        yield from _generating_sliders(np.hypot(u[0], u[1]), k2, u[4] + u[5] ** 2, zero, u[5])


def _fitted_four_bars(phi: np.ndarray, psi: np.ndarray) -> list[Generated]:
    """Least squares of the output angle, from linear fits at zeros all over the dials."""
    starts = []
    for first in np.arange(GRID) * (2.0 * np.pi / GRID):
        for second in np.arange(GRID) * (2.0 * np.pi / GRID):
            if one := _linear_four_bar(phi + first, psi + second):
                y = np.array([0.0, 0.0, 0.0, first, second]) + astuple(one)
                for sign in (1.0, -1.0):
                    off, _ = _four_bar_deviation(y, phi, psi, sign)
                    if np.isfinite(off).all():
                        starts.append((float(off @ off), y, sign))
    return _refined_generators(starts, _four_bar_deviation, phi, psi)


def _fitted_sliders(phi: np.ndarray, x: np.ndarray) -> list[Generated]:
    """Least squares of the travel, from linear fits at zeros all over the dial."""
    starts = []
    for first in np.arange(GRID * GRID) * (2.0 * np.pi / GRID**2):
        c, s = np.cos(phi + first), np.sin(phi + first)
        u = _solved(np.column_stack([x * c, c, s, np.ones(len(x)), -2.0 * x]), x**2)
        if u is None:
            continue
        for one in _generating_sliders(u[0], u[2], u[3] + u[4] ** 2, first, u[4]):
            y = np.array(astuple(one))
            for sign in (1.0, -1.0):
                off, _ = _slider_deviation(y, phi, x, sign)
                if np.isfinite(off).all():
                    starts.append((float(off @ off), y, sign))
    return _refined_generators(starts, _slider_deviation, phi, x)


def _refined_generators(
    starts: list[tuple[float, np.ndarray, float]],
    deviation: Callable[..., tuple[np.ndarray, np.ndarray]],
    phi: np.ndarray,
    output: np.ndarray,
) -> list[Generated]:
    starts.sort(key=lambda start: start[0])
    found: list[tuple[float, np.ndarray]] = []
    for _, y, sign in starts[:KEEP]:
        one = least_squares(
            lambda y, sign=sign: deviation(y, phi, output, sign)[0],  # type: ignore[misc]
            lambda y, sign=sign: deviation(y, phi, output, sign)[1],  # type: ignore[misc]
            y,
            ends=tol.SYNTHESIS_ENDS,
        )
        if one.x[:2].min() > 0.0 and not any(
            np.allclose(one.x, z, tol.SYNTHESIS_SOLUTIONS_SAME) for _, z in found
        ):
            found.append((one.cost, one.x))
    found.sort(key=lambda pair: pair[0])
    return [Generated(*y.tolist()) for _, y in found]


def _four_bar_deviation(
    y: np.ndarray, phi: np.ndarray, psi: np.ndarray, sign: float
) -> tuple[np.ndarray, np.ndarray]:
    """Output minus function [rad], NaN where the loop does not close, and its derivatives."""
    crank, coupler, rocker, first, second = y
    arm = np.exp(1j * (phi + first))
    q = crank * arm - 1.0  # from O4 to A
    length = np.abs(q)
    with np.errstate(invalid="ignore"):
        opening = np.arccos((length**2 + rocker**2 - coupler**2) / (2.0 * rocker * length))
    angle = np.angle(q) + sign * opening
    out = np.exp(1j * angle)
    slopes = _closure_slopes(y, arm, q - rocker * out, -out, -1j * rocker * out)
    return np.mod(angle - psi - second + np.pi, 2.0 * np.pi) - np.pi, slopes


def _slider_deviation(
    y: np.ndarray, phi: np.ndarray, x: np.ndarray, sign: float
) -> tuple[np.ndarray, np.ndarray]:
    """Travel minus function, NaN where the loop does not close, and its derivatives."""
    crank, rod, offset, first, second = y
    arm = np.exp(1j * (phi + first))
    across = crank * arm.imag - offset
    with np.errstate(invalid="ignore"):
        along = sign * np.sqrt(rod**2 - across**2)
    slopes = _closure_slopes(y, arm, 1j * across - along, -1j, -1.0)
    return crank * arm.real + along - x - second, slopes


def _closure_slopes(y: np.ndarray, arm: Any, link: Any, by_third: Any, by_output: Any) -> Any:
    """Derivatives of the output by y, from |link|² = y₁²: (points, 5)."""
    parts = (arm, 0.0, by_third, 1j * y[0] * arm, 0.0, by_output)
    slopes = np.stack([(link.conj() * part).real for part in parts], axis=1)
    slopes[:, 1] = -y[1]
    slopes[:, 4] = slopes[:, 5]
    return -slopes[:, :5] / slopes[:, 5:]


#: Circle points of three and four poses that are combined with one another.
PAIRS = 120
#: How far circle points of three poses are sought, in sizes of the motion.
SPREAD = 1.5
#: How far poles count, in sizes of the path of the origin.
POLES = 10.0
#: Candidates of a continuum that are followed, those of the greatest transmission angles.
BEST = 200


@dataclass(frozen=True, eq=False)
class FunctionDesign:
    """A function with its zeros: the output at the given pairs in the axes of the design."""

    positions: Positions
    output: np.ndarray
    zeros: tuple[float, float]


@dataclass(frozen=True, eq=False)
class GuidedDesign:
    """A guidance: poses of the plane, in the axes of the plane itself."""

    positions: Positions
    where: np.ndarray
    angle: np.ndarray


def function_candidates(
    kind: Kind, inputs: np.ndarray, outputs: np.ndarray, ground: float
) -> list[FunctionDesign]:
    """All mechanisms in closed form of 3, 4 or 5 pairs, of more the best; a four-bar on a ground
    of the given length.
    """
    found = []
    if kind.name == "four_bar":
        for one in four_bars(inputs, outputs):
            theta, psi = inputs + one.input_zero, outputs + one.output_zero
            lengths = ground * np.array([one.crank, one.coupler, one.third])
            x = np.array([0.0, 0.0, ground, 0.0, *lengths, 0.0, 0.0])
            pin = ground + lengths[2] * np.exp(1j * psi) - lengths[0] * np.exp(1j * theta)
            found.append(_wanted(kind, x, theta, psi, pin, (one.input_zero, one.output_zero)))
        return found
    for one in slider_cranks(inputs, outputs):
        theta, travel = inputs + one.input_zero, outputs + one.output_zero
        x = np.array([0.0, 0.0, 0.0, one.third, one.crank, one.coupler, 0.0, 0.0])
        pin = travel + 1j * one.third - one.crank * np.exp(1j * theta)
        found.append(_wanted(kind, x, theta, travel, pin, (one.input_zero, one.output_zero)))
    return found


def _wanted(
    kind: Kind,
    x: np.ndarray,
    theta: np.ndarray,
    output: np.ndarray,
    pin: np.ndarray,
    zeros: tuple[float, float],
) -> FunctionDesign:
    """With the signs of closure that the pin, seen from the crank's end, has at the pairs."""
    signs = [kind.closure_sign(x, angle, one) for angle, one in zip(theta, pin, strict=True)]
    return FunctionDesign(Positions(kind, x, theta, np.array(signs), fixed=True), output, zeros)


def pose_candidates(
    kind: Kind,
    where: np.ndarray,
    angle: np.ndarray,
    within: tuple[np.ndarray, np.ndarray],
    size: float,
    rng: np.random.Generator,
) -> tuple[list[GuidedDesign], int]:
    """Mechanisms that take the plane through the poses, within bounds: all of five poses, of fewer
    the best of a sample; and how many were tried.
    """
    moves, (low, high) = displaced(where, angle), within
    around = complex(where[0]) + SPREAD * size * (
        rng.normal(size=PAIRS) + 1j * rng.normal(size=PAIRS)
    )
    pairs = dyads(moves, around)
    pairs = np.array([pair for pair in pairs if _fits(pair, kind, low, high)]).reshape(-1, 2)
    if len(pairs) > PAIRS:
        pairs = pairs[np.sort(rng.permutation(len(pairs))[:PAIRS])]
    found: list[tuple[float, GuidedDesign]] = []
    tried = 0
    if kind.name == "four_bar":
        for first, second in itertools.permutations(pairs, 2):
            tried += 1
            found += _guiding_four_bar(first, second, where, angle)
    else:
        for point in sliding_points(moves, PAIRS):
            for pair in pairs:
                tried += 1
                found += _guiding_slider_crank(pair, point, where, angle)
    inside = [
        one
        for one in found
        if (one[1].positions.x >= low).all() and (one[1].positions.x <= high).all()
    ]
    inside.sort(key=lambda pair: -pair[0])
    return [one for _, one in inside[:BEST]], tried


def motion_size(where: np.ndarray, angle: np.ndarray) -> float:
    """Size of a motion: how far the origin comes from its mean place, or the poles of the
    displacements from it, but at most some times as far.
    """
    extent = float(np.abs(where - where.mean()).max())
    r, t = displaced(where, angle)
    with np.errstate(all="ignore"):
        poles = np.abs(t / (1.0 - r) - where.mean())
    distance = float(poles[np.isfinite(poles)].max(initial=0.0))
    return max(extent, min(distance, POLES * extent), tol.TINY)


def _fits(pair: np.ndarray, kind: Kind, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether the centre point may be one of the pivots."""
    x, y = pair[1].real, pair[1].imag
    pivots = (0, 2) if kind.name == "four_bar" else (0,)
    return bool(np.isfinite(pair).all()) and any(
        low[k] <= x <= high[k] and low[k + 1] <= y <= high[k + 1] for k in pivots
    )


def _guiding_four_bar(
    crank: np.ndarray, rocker: np.ndarray, where: np.ndarray, angle: np.ndarray
) -> Iterator[tuple[float, GuidedDesign]]:
    """The four-bar of two pairs, with its least transmission angle at the poses."""
    moves = displaced(where, angle)
    kind = FourBar()
    a, b = places(crank[0], moves), places(rocker[0], moves)
    o2, o4 = crank[1], rocker[1]
    r2, r3, r4 = abs(a[0] - o2), abs(b[0] - a[0]), abs(b[0] - o4)
    if min(r2, r3, r4, abs(o4 - o2)) <= tol.SYNTHESIS_PINS_SAME * max(r2, r3, r4, abs(o4 - o2)):
        return
    point = (where[0] - a[0]) * r3 / (b[0] - a[0])
    x = np.array([o2.real, o2.imag, o4.real, o4.imag, r2, r3, r4, point.real, point.imag])
    across = np.abs(((b - a) * np.conj(b - o4)).imag) / (r3 * r4)
    yield _guided(kind, x, a, b, where, angle, float(across.min()))


def _guiding_slider_crank(
    pair: np.ndarray, sliding: complex, where: np.ndarray, angle: np.ndarray
) -> Iterator[tuple[float, GuidedDesign]]:
    """The slider-crank of a pair and a point on a line."""
    moves = displaced(where, angle)
    kind = SliderCrank()
    a, b = places(pair[0], moves), places(sliding, moves)
    o, farthest = pair[1], int(np.abs(b - b[0]).argmax())
    r2, r3, along = abs(a[0] - o), abs(b[0] - a[0]), b[farthest] - b[0]
    if min(r2, r3, abs(along)) <= tol.SYNTHESIS_PINS_SAME * max(r2, r3, abs(along)):
        return
    guide = along / abs(along)
    if ((b[0] - a[0]) * np.conj(guide)).real < 0.0:
        guide = -guide
    offset = float(((b[0] - o) * np.conj(guide)).imag)
    point = (where[0] - a[0]) * r3 / (b[0] - a[0])
    numbers = [o.real, o.imag, float(np.angle(guide)), offset, r2, r3, point.real, point.imag]
    across = np.abs(((b - a) * np.conj(guide)).real) / r3
    yield _guided(kind, np.array(numbers), a, b, where, angle, float(across.min()))


def _guided(
    kind: Kind,
    x: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    where: np.ndarray,
    angle: np.ndarray,
    transmission: float,
) -> tuple[float, GuidedDesign]:
    theta = np.angle(a - complex(x[0], x[1]))
    coupler = b - a
    signs = [kind.closure_sign(x, at, one) for at, one in zip(theta, coupler, strict=True)]
    plane = math.remainder(float(angle[0] - np.angle(coupler[0])), 2.0 * math.pi)
    positions = Positions(kind, x, theta, np.array(signs), plane=plane)
    return transmission, GuidedDesign(positions, where, angle)
