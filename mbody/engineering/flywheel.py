"""The flywheel that keeps the speed of a machine within bounds."""

from __future__ import annotations

import math
import warnings
from numbers import Real

import numpy as np

from mbody.engineering.fluctuation import fluctuation, the_motor
from mbody.errors import ModelError, ModelWarning
from mbody.solution.solution import Solution

__all__ = ["flywheel"]


def flywheel(run: Solution, coefficient: float, driver: str | None = None) -> float:
    """Moment of inertia [mass·length²] that keeps the fluctuation of speed of a driver to a given
    coefficient: flywheel calculation.

    I = ΔE / (C_s ω²),  C_s = (ω_max − ω_min)/ω,  ω the mean speed

    Parameters
    ----------
    run : Solution
        With forces, over whole turns at a constant speed; see `fluctuation`.
    coefficient : float
        Coefficient of fluctuation of speed C_s, such as 0.02.
    driver : str, optional
        Name of the driver of an angle, on whose shaft the flywheel sits.

    Returns
    -------
    float
        Of the flywheel alone, beside what already turns with that shaft. Of a result in doubt a
        `ModelWarning` says so.

    Raises
    ------
    ModelError
        For a coefficient that is none, or a driver that stands still.

    Notes
    -----
    The fluctuation of energy is that at the constant speed ω; what the changing speed makes of the
    inertia of the links is left out, which is small of the order C_s.

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
    if (
        not isinstance(coefficient, Real)
        or isinstance(coefficient, bool)
        or not 0.0 < coefficient < 2.0
    ):
        raise ModelError(
            f"the coefficient of fluctuation of speed is (ω_max − ω_min)/ω, between 0 and 2, not "
            f"{coefficient!r}: a common one is 0.02"
        )
    name = the_motor(run, driver)
    speed = float(np.mean(run.driven(name)[1]))
    if speed == 0.0 or not math.isfinite(speed):
        raise ModelError(
            f"driver '{name}' stands still, a flywheel keeps a speed: give its law one", name
        )
    found = fluctuation(run, name)
    if found.doubts:  # a number can carry none
        warnings.warn(
            f"flywheel: the motion that gives its size is doubtful: {found.doubts[0].message}",
            ModelWarning,
            stacklevel=2,
        )
    return found.fluctuation / (float(coefficient) * speed**2)
