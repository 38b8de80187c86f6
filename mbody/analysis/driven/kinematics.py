"""Kinematics: positions, velocities and accelerations of a driven mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mbody.analysis.driven.driven import driven
from mbody.model.mechanism import Mechanism
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["kinematics"]


def kinematics(
    model: Mechanism | System,
    t: Any = None,
    *,
    drive: Mapping[str, Any] | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    guess: Mapping[str, Any] | None = None,
) -> Solution:
    """Positions, velocities and accelerations of all bodies.

    Position, velocity and acceleration analysis: Φ = 0, Φ_q v = ν, Φ_q a = γ (Haug 1989).

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
        Motion by name; no forces.

    Raises
    ------
    ModelError
        For instants, drivers or guesses that do not fit the mechanism.
    SolveError
        When loops do not close, the motion is not determined, a dead centre is in the way, or a
        function of the user failed. It carries what was computed before.

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
    return driven(model, "kinematics", t, drive, turn, instants, guess)
