"""Statics: reactions and driver efforts at rest."""

from __future__ import annotations

from mbody.analysis.driven.driven import documented, driven
from mbody.analysis.driven.time_grid import Drive
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.quantities.types import PlainNumbers
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["statics"]


@documented
def statics(
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
    """Every joint force and driver effort at rest: velocities and accelerations are zero.

    Φ_qᵀ λ = f; the drivers hold their positions, their efforts are what holding takes.

    {parameters}

    Returns
    -------
    Solution
        Positions, reactions, efforts, breakdown by load, residuals.

    {raises}

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
    return driven(model, "statics", t, drive, turn, instants, turns, guess, assembly)
