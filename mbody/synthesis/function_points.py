"""Function generation: the output follows the crank at given pairs, in closed form.

Four-bar (F. Freudenstein, Trans. ASME 77 (1955) 853-861): with a, b, c, d the lengths of crank,
coupler, rocker and ground, K1 = d/a, K2 = d/c, K3 = (a² − b² + c² + d²)/(2ac),

    K1 cos ψ − K2 cos φ + K3 = cos(φ − ψ).

Slider-crank of offset e, travel x along the guide: x² = 2a x cos φ + 2ae sin φ + b² − a² − e².

Three pairs make three linear equations. With the output's zero unknown too there are four pairs,
with both zeros five: cosines and sines of the zeros are taken as unknowns of their own, so that the
equations stay linear; what is left is a line of solutions, on which one relation between the
unknowns, of degree two or three, decides. So all real solutions are found. More pairs are met in
the sense of least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["Generated", "four_bars", "slider_cranks"]

#: Imaginary part by which a root counts as real.
REAL = 1e-7
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
    """The same of travels of the size of 1."""
    if len(phi) == 3:
        matrix = np.column_stack([x * np.cos(phi), np.sin(phi), np.ones(3)])
        solution = _solved(matrix, x**2)
        if solution is None:
            return []
        return _slider(solution[0], solution[1], solution[2], 0.0, 0.0)
    if len(phi) == 4:
        return list(_sliders_of_4(phi, x))
    if len(phi) == 5:
        return list(_sliders_of_5(phi, x))
    return _fitted_sliders(phi, x)


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """Least squares, or None where columns depend on one another."""
    solution, _, rank, _ = np.linalg.lstsq(matrix, right, rcond=1e-12)
    return solution if rank == matrix.shape[1] else None


def _linear_four_bar(phi: np.ndarray, psi: np.ndarray) -> Generated | None:
    matrix = np.column_stack([np.cos(psi), -np.cos(phi), np.ones(len(phi))])
    k = _solved(matrix, np.cos(phi - psi))
    return None if k is None else _four_bar(k[0], k[1], k[2], 0.0, 0.0)


def _four_bar(
    k1: float, k2: float, k3: float, input_zero: float, output_zero: float
) -> Generated | None:
    """Lengths from Freudenstein's numbers; a negative one is a link whose mark is opposite."""
    if min(abs(k1), abs(k2)) < 1e-12:
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


def _slider(
    k1: float, k2: float, k3: float, input_zero: float, output_zero: float
) -> list[Generated]:
    """Lengths of a slider-crank from K1 = 2a, K2 = 2ae, K3 = b² − a² − e²."""
    if abs(k1) < 1e-14:
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
    if sizes[-1] < 1e-12 * sizes[0]:
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
        if abs(root.imag) <= REAL * (1.0 + abs(root)):
            yield start + root.real * along


def _four_bars_of_4(phi: np.ndarray, psi: np.ndarray) -> Iterator[Generated]:
    """Unknowns K1 cos ψ₀, K1 sin ψ₀, K2, K3, cos ψ₀, −sin ψ₀ up to a factor."""
    turn = phi - psi
    rows = [np.cos(psi), -np.sin(psi), -np.cos(phi), np.ones(4), -np.cos(turn), np.sin(turn)]
    line = _line(np.column_stack(rows))
    if line is None:
        return
    for u in _on_line(*line, lambda u: u[0] * u[5] + u[1] * u[4], 2):
        size = np.hypot(u[4], u[5])
        zero = np.arctan2(-u[5], u[4])
        k1 = (u[0] * np.cos(zero) + u[1] * np.sin(zero)) / size
        if found := _four_bar(k1, u[2] / size, u[3] / size, 0.0, zero):
            yield found


def _four_bars_of_5(phi: np.ndarray, psi: np.ndarray) -> Iterator[Generated]:
    """Unknowns K1 e^{iψ₀}, K2 e^{iφ₀}, K3, e^{i(φ₀ − ψ₀)} up to a factor."""
    turn = phi - psi
    rows = [np.cos(psi), -np.sin(psi), -np.cos(phi), np.sin(phi), np.ones(5)]
    line = _line(np.column_stack([*rows, -np.cos(turn), np.sin(turn)]))
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
        if found := _four_bar(abs(first), k2, u[4] / size, input_zero, output_zero):
            yield found


def _sliders_of_4(phi: np.ndarray, x: np.ndarray) -> Iterator[Generated]:
    """Unknowns K1, K1 x₀, K2, K3 − x₀², x₀ and the factor of the right side."""
    rows = [x * np.cos(phi), np.cos(phi), np.sin(phi), np.ones(4), -2.0 * x, -(x**2)]
    line = _line(np.column_stack(rows))
    if line is None:
        return
    for u in _on_line(*line, lambda u: u[1] * u[5] - u[0] * u[4], 2):
        if abs(u[5]) > 1e-12 * np.abs(u).max():
            u = u / u[5]
            yield from _slider(u[0], u[2], u[3] + u[4] ** 2, 0.0, u[4])


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
        if abs(u[6]) <= 1e-12 * np.abs(u).max():
            continue
        u = u / u[6]
        zero = np.arctan2(u[1], u[0])
        k2 = (u[2] - u[0] * u[5]) * np.sin(zero) + (u[3] + u[1] * u[5]) * np.cos(zero)
        yield from _slider(np.hypot(u[0], u[1]), k2, u[4] + u[5] ** 2, zero, u[5])


def _fitted_four_bars(phi: np.ndarray, psi: np.ndarray) -> list[Generated]:
    """Least squares of the output angle, from linear fits at zeros all over the dials."""
    starts = []
    for first in np.arange(GRID) * (2.0 * np.pi / GRID):
        for second in np.arange(GRID) * (2.0 * np.pi / GRID):
            if one := _linear_four_bar(phi + first, psi + second):
                y = np.array(
                    [
                        one.crank,
                        one.coupler,
                        one.third,
                        first + one.input_zero,
                        second + one.output_zero,
                    ]
                )
                for sense in (1.0, -1.0):
                    off = _four_bar_deviation(y, phi, psi, sense)
                    if np.isfinite(off).all():
                        starts.append((float(off @ off), y, sense))
    return _refined(starts, _four_bar_deviation, phi, psi)


def _fitted_sliders(phi: np.ndarray, x: np.ndarray) -> list[Generated]:
    """Least squares of the travel, from linear fits at zeros all over the dial."""
    starts = []
    for first in np.arange(GRID * GRID) * (2.0 * np.pi / GRID**2):
        c, s = np.cos(phi + first), np.sin(phi + first)
        u = _solved(np.column_stack([x * c, c, s, np.ones(len(x)), -2.0 * x]), x**2)
        if u is None:
            continue
        for one in _slider(u[0], u[2], u[3] + u[4] ** 2, first, u[4]):
            y = np.array([one.crank, one.coupler, one.third, one.input_zero, one.output_zero])
            for sense in (1.0, -1.0):
                off = _slider_deviation(y, phi, x, sense)
                if np.isfinite(off).all():
                    starts.append((float(off @ off), y, sense))
    return _refined(starts, _slider_deviation, phi, x)


def _refined(
    starts: list[tuple[float, np.ndarray, float]],
    deviation: Callable[..., np.ndarray],
    phi: np.ndarray,
    output: np.ndarray,
) -> list[Generated]:
    from scipy.optimize import least_squares

    starts.sort(key=lambda start: start[0])
    found: list[tuple[float, np.ndarray]] = []
    for _, y, sense in starts[:KEEP]:
        one = least_squares(
            deviation, y, "3-point", args=(phi, output, sense), x_scale="jac", xtol=1e-14
        )
        if one.x[:2].min() > 0.0 and not any(np.allclose(one.x, z, 1e-5) for _, z in found):
            found.append((one.cost, one.x))
    found.sort(key=lambda pair: pair[0])
    return [Generated(*(float(value) for value in y)) for _, y in found]


def _four_bar_deviation(
    y: np.ndarray, phi: np.ndarray, psi: np.ndarray, sense: float
) -> np.ndarray:
    """Output minus function [rad]; NaN where the loop does not close."""
    crank, coupler, rocker, first, second = y
    q = crank * np.exp(1j * (phi + first)) - 1.0  # from O4 to A
    length = np.abs(q)
    with np.errstate(invalid="ignore"):
        opening = np.arccos((length**2 + rocker**2 - coupler**2) / (2.0 * rocker * length))
    turn = np.angle(q) + sense * opening - psi - second
    return np.asarray(np.mod(turn + np.pi, 2.0 * np.pi) - np.pi)


def _slider_deviation(y: np.ndarray, phi: np.ndarray, x: np.ndarray, sense: float) -> np.ndarray:
    """Travel minus function; NaN where the loop does not close."""
    crank, rod, offset, first, second = y
    with np.errstate(invalid="ignore"):
        along = np.sqrt(rod**2 - (offset - crank * np.sin(phi + first)) ** 2)
    return np.asarray(crank * np.cos(phi + first) + sense * along - x - second)
