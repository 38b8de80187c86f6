"""Kinetostatics: all reactions and driver efforts of a given motion (inverse dynamics)."""

from __future__ import annotations

from mbody.analysis.driven.driven import documented, driven
from mbody.analysis.driven.time_grid import Drive
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.quantities.types import PlainNumbers
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["kinetostatics"]


@documented
def kinetostatics(
    model: Mechanism | System,
    t: PlainNumbers | None = None,
    *,
    drive: Drive | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    turns: int | None = None,
    guess: Guesses | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """Motion, every joint force and every driver effort: inverse dynamics, dynamic force analysis.

    Φ_qᵀ λ = f − M a with the motion of the drivers given; d'Alembert's inertia forces −M a are
    among the loads (Norton, *Design of Machinery*, chapter 11).

    {parameters}

    Returns
    -------
    Solution
        Motion, reactions, efforts, inertia forces, breakdown by cause, residuals.

    {raises}

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
    return driven(model, "kinetostatics", t, drive, turn, instants, turns, guess, assembly)
