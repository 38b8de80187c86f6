"""Kinematics: positions, velocities and accelerations of a driven mechanism."""

from __future__ import annotations

from mbody.analysis.driven.driven import documented, driven
from mbody.analysis.driven.time_grid import Drive
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.quantities.types import PlainNumbers
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["kinematics"]


@documented
def kinematics(
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
    """Positions, velocities and accelerations of all bodies.

    Position, velocity and acceleration analysis: Φ = 0, Φ_q v = ν, Φ_q a = γ (Haug 1989).

    {parameters}

    Returns
    -------
    Solution
        Motion by name; no forces.

    {raises}

    Notes
    -----
    One Newton step and two solves an instant; the step between instants is halved until the
    branch is kept, however far apart they are.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> len(run)
    361
    """
    return driven(model, "kinematics", t, drive, turn, instants, turns, guess, assembly)
