"""Distributions of a number about its mean: normal, uniform, triangular."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.quantities.types import Number

__all__ = ["SIGMAS", "Normal", "Scatter", "Triangular", "Uniform"]

#: Standard deviations in the tolerance of a normal distribution: 99.73 % of the values are within.
SIGMAS = 3.0


@dataclass(frozen=True)
class Scatter:
    """A distribution of a number; base class.

    Attributes
    ----------
    tolerance : float or str
        ±, in the units of the mechanism or with a unit.
    mean : float or str, optional
        By default the number of the mechanism.
    """

    tolerance: Number | None = None
    mean: Number | None = None

    def __post_init__(self) -> None:
        if self.tolerance is None:
            raise ModelError(f"{type(self).__name__} has no width: give tolerance")

    def spread(self) -> Any:
        """The width as it was given."""
        return self.tolerance

    #: Fourth cumulant by the fourth power of the standard deviation: 0 of a normal distribution.
    excess: ClassVar[float] = 0.0

    def deviation_of(self, width: float) -> float:
        """The standard deviation, of a width in the units of the mechanism."""
        raise NotImplementedError

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """Deviations from the mean at these probabilities (the quantile function).

        Parameters
        ----------
        part : array
            Between 0 and 1, both excluded.
        width : float
            `spread` in the units of the mechanism.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class Normal(Scatter):
    """Normal distribution: p(x) = exp(−(x − mean)²/2σ²)/(σ √2π).

    Parameters
    ----------
    tolerance : float or str, optional
        ±; three standard deviations: 99.73 % of the values are within.
    mean : float or str, optional
        By default the number of the mechanism.
    deviation : float or str, optional
        The standard deviation σ, instead of a tolerance.

    >>> Normal(deviation="0.02 mm").spread()
    '0.02 mm'
    """

    deviation: Number | None = None

    def __post_init__(self) -> None:
        if (self.tolerance is None) == (self.deviation is None):
            raise ModelError("Normal takes one width: give either tolerance or deviation")

    def spread(self) -> Any:
        """The tolerance, or the standard deviation."""
        return self.deviation if self.tolerance is None else self.tolerance

    def deviation_of(self, width: float) -> float:
        """A third of the tolerance, or the width itself."""
        return width if self.tolerance is None else width / SIGMAS

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """σ Φ⁻¹(part)."""
        from scipy.special import ndtri

        return np.asarray(self.deviation_of(width) * ndtri(part))


@dataclass(frozen=True)
class Uniform(Scatter):
    """Uniform distribution within mean ± tolerance.

    >>> Uniform(2.0).at(np.array([0.25]), 2.0)
    array([-1.])
    """

    excess: ClassVar[float] = -1.2

    def deviation_of(self, width: float) -> float:
        """Width / √3."""
        return width / 3.0**0.5

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """Width · (2 part − 1)."""
        return width * (2.0 * part - 1.0)


@dataclass(frozen=True)
class Triangular(Scatter):
    """Triangular distribution: greatest density at the mean, zero at ± tolerance.

    >>> Triangular(2.0).at(np.array([0.125, 0.5]), 2.0)
    array([-1.,  0.])
    """

    excess: ClassVar[float] = -0.6

    def deviation_of(self, width: float) -> float:
        """Width / √6."""
        return width / 6.0**0.5

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """±width · (1 − √(2 part′)), part′ from the nearer end."""
        near = np.minimum(part, 1.0 - part)
        return np.asarray(width * np.sign(part - 0.5) * (1.0 - np.sqrt(2.0 * near)))
