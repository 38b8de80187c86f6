"""Kinetostatics: all reactions and driver efforts of a given motion (inverse dynamics)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mbody.analysis.driven.driven import driven
from mbody.model.mechanism import Mechanism
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["kinetostatics"]


def kinetostatics(
    model: Mechanism | System,
    t: Any = None,
    *,
    drive: Mapping[str, Any] | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    guess: Mapping[str, Any] | None = None,
) -> Solution:
    """Motion, every joint force and every driver effort: inverse dynamics, dynamic force analysis.

    Φ_qᵀ λ = f − M a with the motion of the drivers given; d'Alembert's inertia forces −M a stand
    among the loads (Norton, *Design of Machinery*, chapter 11).

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
        Motion, reactions, efforts, inertia forces, breakdown by cause, residuals.

    Raises
    ------
    ModelError
        For instants, drivers or guesses that do not fit the mechanism.
    SolveError
        When loops do not close, the motion is not determined, a dead centre is in the way, or a
        function of the user failed. It carries what was computed before.

    Notes
    -----
    No mass is needed for it to be solvable: massless links are ordinary. Redundant rows give the
    reactions of least norm and mark those that are not unique.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> run = mbody.kinetostatics(machine)
    >>> run.checks.virtual_work < 1e-12
    True
    """
    return driven(model, "kinetostatics", t, drive, turn, instants, guess)
