"""Statics: reactions and driver efforts at rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mbody.analysis.driven.driven import driven
from mbody.model.mechanism import Mechanism
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["statics"]


def statics(
    model: Mechanism | System,
    t: Any = None,
    *,
    drive: Mapping[str, Any] | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    guess: Mapping[str, Any] | None = None,
) -> Solution:
    """Every joint force and driver effort at rest: velocities and accelerations are zero.

    Φ_qᵀ λ = f; the drivers hold their positions, their efforts are what holding takes.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left.
    t : float or array (instants,), optional
        Times at which the laws of the drivers are taken, by default 0.
    drive : mapping, optional
        Instead of laws: value, or (value, rate, acceleration), of drivers by name, floats or arrays
        (instants,), angles in rad. Drivers that are not named keep their laws.
    turn : str or True, optional
        A whole turn of this driver (or driven body) from t = 0 on, at equal angles, both ends
        included, with the rates of its law.
    instants : int, optional
        How many of a turn, by default 361.
    guess : mapping, optional
        By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes. It
        chooses the branch; between instants the branch is followed.

    Returns
    -------
    Solution
        Positions, reactions, efforts, breakdown by load, residuals.

    Raises
    ------
    ModelError
        For instants, drivers or guesses that do not fit the mechanism.
    SolveError
        When loops do not close, the motion is not determined, a dead centre is in the way, or a
        function of the user failed. It carries what was computed before.

    Notes
    -----
    Laws of the drivers give positions only; loads see no velocity.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> machine.add(mbody.Torque("load", "rocker", value=10.0))
    >>> run = mbody.statics(machine, drive={"motor": 0.5})
    >>> bool(run.effort("motor")[0] != 0.0)
    True
    """
    return driven(model, "statics", t, drive, turn, instants, guess)
