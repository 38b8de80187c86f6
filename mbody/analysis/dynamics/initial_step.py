"""What the steps of a free motion begin with: sizes of the coordinates, the first length.

Of one motion, or of many along a first axis.
"""

from __future__ import annotations

import numpy as np

from mbody.solution.restart import Way

__all__ = ["REFINEMENTS", "coordinate_sizes", "first_step"]

#: Corrections by the residual where masses are stood in for, or rows are redundant, and of what is
#: kept.
REFINEMENTS = 2


def coordinate_sizes(length: float, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Sizes of coordinates and rates, to which absolute errors are relative: (…, 2·coordinates).

    Parameters
    ----------
    length : float
        The model length.
    v, a : arrays (…, coordinates)
        Velocities and accelerations at the beginning.
    """
    unit = np.broadcast_to(np.tile([length, length, 1.0], v.shape[-1] // 3), v.shape)
    swift = np.maximum(
        np.abs(v / unit).max(axis=-1, initial=0.0),
        np.sqrt(np.abs(a / unit).max(axis=-1, initial=0.0)),
    )
    rates = np.where(swift == 0.0, 1.0, swift)[..., None] * unit
    return np.concatenate([unit, rates], axis=-1)


def first_step(
    way: Way, y: np.ndarray, derivative: np.ndarray, scale: np.ndarray, whole: float
) -> np.ndarray:
    """A rough first step (Hairer, Nørsett, Wanner, II.4): (…,).

    Parameters
    ----------
    y, slope, scale : arrays (…, 2·coordinates)
        The first state, its derivative, and the sizes of the coordinates.
    whole : float
        How long the motion goes on.
    """
    size = way.atol * scale + way.rtol * np.abs(y)
    d0, d1 = (np.sqrt(np.mean((part / size) ** 2, axis=-1)) for part in (y, derivative))
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where((d0 > 1e-5) & (d1 > 1e-5), 0.01 * d0 / d1, 1e-6 * whole)
    return np.minimum(step, 0.1 * whole)
