"""Implicit methods as tables."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

__all__ = ["Implicit", "radau_5", "suzuki_4"]


class Implicit(NamedTuple):
    """Radau IIA with three stages, in the eigenvectors of its inverse matrix.

    Attributes
    ----------
    B, C : arrays (3,)
        Weights and nodes.
    E : array (3,)
        Weights of the error, of what the stages have gained.
    T, inverse : arrays (3, 3)
        Stages from the eigenvectors' coordinates, and back: the first belongs to `real`, the others
        are real and imaginary part of that of `complex`.
    real, complex : float, complex
        Eigenvalues of A⁻¹.
    at : array (samples,)
        The nodes of the samples of a step (see `mbody.kernels.singularity_monitor`).
    """

    B: np.ndarray
    C: np.ndarray
    E: np.ndarray
    T: np.ndarray
    inverse: np.ndarray
    real: float
    complex: complex
    at: np.ndarray


@functools.cache
def radau_5() -> Implicit:
    """Radau IIA of order 5 with the error of order 3 of the code RADAU5.

    E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, second edition, IV.5 and IV.8.

    >>> method = radau_5()
    >>> eigen = np.array([method.real, 0.0, 0.0])
    >>> bool(np.isclose(method.C @ [0.0, 0.0, 1.0], 1.0)), round(method.real, 6)
    (True, 3.637834)
    """
    r = math.sqrt(6.0)
    A = np.array(
        [
            [(88 - 7 * r) / 360, (296 - 169 * r) / 1800, (-2 + 3 * r) / 225],
            [(296 + 169 * r) / 1800, (88 + 7 * r) / 360, (-2 - 3 * r) / 225],
            [(16 - r) / 36, (16 + r) / 36, 1 / 9],
        ]
    )
    values, vectors = np.linalg.eig(np.linalg.inv(A))
    first, second = int(np.abs(values.imag).argmin()), int(values.imag.argmax())
    # A⁻¹ (p − i q) = (α + i β) (p − i q) is A⁻¹ [p q] = [p q] [[α, −β], [β, α]]
    T = np.column_stack([vectors[:, first].real, vectors[:, second].real, -vectors[:, second].imag])
    E = np.array([-13.0 - 7.0 * r, -13.0 + 7.0 * r, -1.0]) / 3.0
    real, turning = float(values[first].real), complex(values[second])
    C = A.sum(axis=1)
    at = np.array([0.0, C[0], C[1], 1.0])
    return Implicit(A[2].copy(), C, E, T, np.linalg.inv(T), real, turning, at)


def suzuki_4() -> np.ndarray:
    """Parts of a step of which five symmetric steps of order 2 make one of order 4.

    M. Suzuki (1990); Hairer, Lubich, Wanner: Geometric Numerical Integration, II.4.

    >>> float(round(suzuki_4().sum(), 15)), float(abs(round((suzuki_4() ** 3).sum(), 15)))
    (1.0, 0.0)
    """
    part = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
    return np.array([part, part, 1.0 - 4.0 * part, part, part])
