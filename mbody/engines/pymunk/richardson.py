"""Richardson extrapolation of a first-order method to step size 0, with an error estimate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

__all__ = ["extrapolated", "order"]

Array = np.ndarray


def extrapolated(values: Sequence[Array]) -> tuple[Array, Array]:
    """The limit of results with the steps h, h/2, h/4 … and the change by the last correction.

    Repeated Richardson extrapolation: an error a h + b h² + c h³ … loses one power per level.

    Parameters
    ----------
    values : list of arrays
        All of one shape, the coarsest first.

    Returns
    -------
    extrapolated, spread : arrays
        The spread is the distance from the level before: its error, and far more than that of the
        extrapolated, where the error is such a series.

    Notes
    -----
    L. F. Richardson, The approximate arithmetical solution by finite differences (1911).

    Examples
    --------
    >>> found, spread = extrapolated([np.array(1.0 + h + h * h) for h in (0.4, 0.2, 0.1)])
    >>> round(float(found), 12), round(float(spread), 12)
    (1.0, 0.02)
    """
    level, before = list(values), values[-1]
    for power in range(1, len(values)):
        before = level[-1]
        level = [b + (b - a) / (2.0**power - 1.0) for a, b in pairwise(level)]
    return level[-1], np.abs(level[-1] - before)


def order(values: Sequence[Array]) -> float:
    """Observed order of results with h, h/2, h/4: log₂ of the ratio of their differences.

    Examples
    --------
    >>> round(order([np.array(1.0 + h) for h in (0.4, 0.2, 0.1)]), 9)
    1.0
    """
    coarse, fine = (float(np.abs(b - a).max()) for a, b in pairwise(values))
    return math.log2(coarse / fine) if coarse > 0.0 and fine > 0.0 else math.nan
