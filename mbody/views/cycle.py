"""The cycle of a mechanism: the times that plots and paths run over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.questions import Ask

if TYPE_CHECKING:
    from mbody.mechanism import Mechanism

__all__ = ["SMOOTH", "cycle", "times"]

#: Instants of a smooth curve.
SMOOTH = 181


def times(mechanism: Mechanism, ask: Ask | None) -> np.ndarray | None:
    """Times (instants,) between the first and the last that are asked for; None where it is not a
    row of times.
    """
    row = ask.at.get("t", ()) if ask else ()
    if len(row) < 2:
        return None
    values = [mechanism.number(value, "time", "ask", "t") for value in row]
    return np.asarray(values if len(values) >= SMOOTH else np.linspace(*_ends(values), SMOOTH))


def _ends(values: list[float]) -> tuple[float, float]:
    return values[0], values[-1]


def cycle(mechanism: Mechanism, ask: Ask | None) -> Ask:
    """What a plot runs over: the turn or the times that are asked for, a turn where it is one
    instant.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> cycle(machine, Ask(at={"t": 0.0})).over, len(cycle(machine, Ask(at={"t": [0, 1]})).at["t"])
    ('turn', 181)
    """
    smooth = times(mechanism, ask)
    if smooth is not None:
        return Ask(at={"t": smooth.tolist()})
    if ask is None or (not ask.over and max(map(len, ask.at.values()), default=1) == 1):
        return Ask(over="turn")
    return ask
