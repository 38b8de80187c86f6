"""Whole cycles of a driver: how many turns they are, and whether a quantity repeats."""

from __future__ import annotations

import math

import numpy as np

from mbody.errors import ModelError

__all__ = ["check_repeats", "counted", "cycle_turns"]

Array = np.ndarray

#: Tolerance of whole turns, relative.
WHOLE = 1e-9
#: Tolerance of the periodicity of a quantity, relative to its size.
SAME = 1e-6


def cycle_turns(angle: Array, what: str) -> int:
    """How many whole turns the angles (instants,) [rad] make, both ends included.

    Raises
    ------
    ModelError
        Where they do not, or turn back; the sentence begins with `what` needs them.
    """
    steps = np.diff(angle)
    turns = abs(angle[-1] - angle[0]) / (2.0 * math.pi) if angle.size else 0.0
    one_way = angle.size > 2 and ((steps > 0.0).all() or (steps < 0.0).all())
    if not one_way or round(turns) < 1 or abs(turns - round(turns)) > WHOLE * turns:
        raise ModelError(
            f"{what} needs whole turns in one sense, both ends included; these "
            f"{angle.size} instants are {360.0 * turns:.6g} deg: analyse with turn=True"
        )
    return round(turns)


def counted(turns: int) -> str:
    """A number of turns in words.

    >>> counted(1), counted(2)
    ('1 turn', '2 turns')
    """
    return "1 turn" if turns == 1 else f"{turns} turns"


def check_repeats(values: Array, size: float, name: str, what: str) -> None:
    """Refuse a quantity (instants,) that does not end as it began.

    Parameters
    ----------
    values : array (instants,)
    size : float
        Beside which the difference is judged.
    name, what : str
        Of the quantity, and of what needs the cycle.

    Raises
    ------
    ModelError
    """
    begin, end = values[0] + 0.0, values[-1] + 0.0  # without the sign of a zero
    if not abs(end - begin) <= SAME * size:
        raise ModelError(
            f"the {name} is {begin:.6g} at the beginning of the cycle and {end:.6g} at its "
            f"end: {what} needs a periodic cycle: give the driver a constant "
            "speed, and use whole cycles of the loads (turns=2 where they take two turns)"
        )
