"""The cycle of a mechanism: the instants of plots and paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.requests import dimension_of_instants
from mbody.model.numbers import number_in
from mbody.model.study import Instants

if TYPE_CHECKING:
    from mbody.model.driver import Driver
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution

__all__ = ["SMOOTH", "cycle", "one_way", "times"]

#: Instants of a smooth curve.
SMOOTH = 181


def one_way(run: Solution) -> tuple[Driver, np.ndarray] | None:
    """The one driver that moves, where it goes one way, and its values (instants,)."""
    values = [(driver, run.driven(driver.name)[0]) for driver in run.mechanism.drivers]
    moving = [(driver, value) for driver, value in values if np.ptp(value) > 0.0]
    if len(moving) != 1:
        return None
    steps = np.diff(moving[0][1])
    return moving[0] if np.all(steps > 0.0) or np.all(steps < 0.0) else None


def times(mechanism: Mechanism, ask: Instants | None) -> np.ndarray | None:
    """Times (instants,) between the first and the last requested; None for other instants."""
    return _smooth(mechanism, "t", ask.at["t"]) if ask and "t" in ask.at else None


def _smooth(mechanism: Mechanism, name: str, row: Sequence[Any]) -> np.ndarray | None:
    """The values of a row, with as many between them as a smooth curve needs."""
    if len(row) < 2:
        return None
    dimension = dimension_of_instants(mechanism, name)
    values = np.array([number_in(mechanism, value, dimension, "ask", name) for value in row])
    if len(values) >= SMOOTH:
        return values
    between = np.linspace(0.0, len(values) - 1.0, SMOOTH)
    return np.asarray(np.interp(between, np.arange(len(values)), values))


def cycle(mechanism: Mechanism, ask: Instants | None) -> Instants:
    """The instants of a plot: a turn, or between the requested times or places of a driver; a turn
    if one instant is requested.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> cycle(machine, Instants(at={"t": 0.0})).over
    'turn'
    >>> len(cycle(machine, Instants(at={"t": [0, 1]})).at["t"])
    181
    """
    if ask and len(ask.at) == 1:
        name, row = next(iter(ask.at.items()))
        smooth = _smooth(mechanism, name, row)
        if smooth is not None:
            return Instants(at={name: smooth.tolist()})
    if ask is None or (not ask.over and max(map(len, ask.at.values()), default=1) == 1):
        return Instants(over="turn")
    return ask
