"""Mean, deviation and band of a quantity by its derivatives, and of a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["ToleranceBand", "first_order", "of_samples", "second_order"]

Array = np.ndarray

#: Deviations of a normal distribution within which 99.73 % are.
SIGMAS = 3.0
#: The part of the values below the band of 99.73 %.
BELOW = 0.0013498980316300933


@dataclass(frozen=True)
class ToleranceBand:
    """Where a quantity is.

    Attributes
    ----------
    mean, deviation : float
        Mean and standard deviation.
    low, high : float
        99.73 % of the values are between them.
    count : int
        Designs of a sample, else 0.
    """

    mean: float
    deviation: float
    low: float
    high: float
    count: int = 0


def first_order(value: float, row: Array, sigma: Array) -> ToleranceBand:
    """Mean m, variance Σ (m_i σ_i)², band ± 3 σ.

    >>> first_order(1.0, np.array([3.0, 4.0]), np.array([1.0, 1.0]))
    ToleranceBand(mean=1.0, deviation=5.0, low=-14.0, high=16.0, count=0)
    """
    deviation = float(np.linalg.norm(row * sigma))
    centre = float(value)
    return ToleranceBand(
        centre, deviation, centre - SIGMAS * deviation, centre + SIGMAS * deviation
    )


def second_order(
    value: float, row: Array, curvature: Array, sigma: Array, excess: Array
) -> ToleranceBand:
    """Moments of m + Σ b_i x_i + ½ Σ H_ij x_i x_j with independent symmetric x of mean 0.

    With b and H by standard deviations and the excess e: mean m + ½ tr H; variance |b|² + ½ tr H²
    + ¼ Σ H_ii² e_i; third cumulant 3 bᵀH b + (3/2) Σ b_i² H_ii e_i + tr H³; fourth
    Σ b_i⁴ e_i + 12 bᵀH²b + 3 tr H⁴, both without the excess of terms in H alone. The band is that
    of a normal distribution bent by skewness and excess (Cornish and Fisher 1938).

    >>> band = second_order(0.0, np.array([0.0]), np.array([[2.0]]), np.ones(1), np.zeros(1))
    >>> round(band.mean, 12), round(band.deviation**2, 12)   # x² of a normal x
    (1.0, 2.0)
    """
    b, h = row * sigma, curvature * np.outer(sigma, sigma)
    own = np.diag(h)
    mean = float(value) + 0.5 * float(np.trace(h))
    variance = float(b @ b + 0.5 * np.sum(h * h) + 0.25 * np.sum(own**2 * excess))
    third = 3.0 * float(b @ h @ b) + 1.5 * float(np.sum(b**2 * own * excess))
    third += float(np.trace(h @ h @ h))
    deviation = float(np.sqrt(max(variance, 0.0)))
    if not deviation:
        return ToleranceBand(mean, 0.0, mean, mean)
    fourth = float(b**4 @ excess) + 12.0 * float(b @ h @ h @ b) + 3.0 * float(np.sum((h @ h) ** 2))
    skewness, heavy = third / deviation**3, fourth / deviation**4
    low, high = (mean + deviation * _bent(z, skewness, heavy) for z in (-SIGMAS, SIGMAS))
    return ToleranceBand(mean, deviation, low, high)


def _bent(z: float, g: float, e: float) -> float:
    """z + (z² − 1) g/6 + (z³ − 3z) e/24 − (2z³ − 5z) g²/36."""
    return (
        z
        + (z * z - 1.0) * g / 6.0
        + (z**3 - 3.0 * z) * e / 24.0
        - (2.0 * z**3 - 5.0 * z) * g * g / 36.0
    )


def of_samples(values: Array) -> ToleranceBand:
    """Of random designs: the quantiles of 0.135 and 99.865 %."""
    low, high = np.quantile(values, (BELOW, 1.0 - BELOW))
    return ToleranceBand(
        float(values.mean()), float(values.std(ddof=1)), float(low), float(high), len(values)
    )
