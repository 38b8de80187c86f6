"""The flywheel for a given fluctuation of speed."""

from __future__ import annotations

import math
import warnings

import numpy as np

from mbody.engineering.fluctuation import angle_driver, fluctuation
from mbody.engineering.flywheel_sizing import check_coefficient
from mbody.errors import ModelError, ModelWarning
from mbody.solution.solution import Solution

__all__ = ["flywheel"]


def flywheel(run: Solution, coefficient: float, driver: str | None = None) -> float:
    """Moment of inertia [mass·length²] for a given coefficient of fluctuation of speed of a
    driver: flywheel calculation.

    I = ΔE / (C_s ω²),  C_s = (ω_max − ω_min)/ω,  ω the mean speed

    Parameters
    ----------
    run : Solution
        With forces, over whole turns at a constant speed; see `fluctuation`.
    coefficient : float
        Coefficient of fluctuation of speed C_s, such as 0.02.
    driver : str, optional
        Name of the driver of an angle, on whose shaft the flywheel is.

    Returns
    -------
    float
        Of the flywheel alone, without the inertia already on that shaft. A result in doubt causes a
        `ModelWarning`.

    Raises
    ------
    ModelError
        For an invalid coefficient, or a driver without speed.

    Notes
    -----
    The fluctuation of energy is that at the constant speed ω; the effect of the varying speed on
    the inertia forces of the links is neglected, which is of the order C_s; `size_flywheel` counts
    it.

    Source: R. S. Khurmi and J. K. Gupta, *Theory of Machines*, chapter 16, ΔE = I ω² C_s; R. L.
    Norton, *Design of Machinery*, section 11.11.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> run = mbody.kinetostatics(engine, turn=True)
    >>> round(flywheel(run, 0.02) / flywheel(run, 0.01), 9)
    0.5
    """
    coefficient = check_coefficient(coefficient)
    name = angle_driver(run, driver)
    speed = float(np.mean(run.driven(name)[1]))
    if speed == 0.0 or not math.isfinite(speed):
        raise ModelError(
            f"driver '{name}' has no speed, which a flywheel needs: give its law a speed", name
        )
    found = fluctuation(run, name)
    if found.doubts:  # a number cannot have doubts
        warnings.warn(
            f"flywheel: the motion for its size is doubtful: {found.doubts[0].message}",
            ModelWarning,
            stacklevel=2,
        )
    return found.fluctuation / (coefficient * speed**2)
