"""The motion that a moving picture shows of a model: a turn, the requested instants, or free."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.dead_centres import driver_range
from mbody.analysis.driven.driven import analyse_system_at, dimension_of_instants, kinetostatics
from mbody.analysis.dynamics.simulate import simulate
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.study import Instants
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.model.driver import Driver


# -- The cycle of a mechanism: the instants of plots and paths ---------------------------------

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


#: Instants of free motion between two of which nothing is missed on a screen: 60 a second for some
#: seconds, and more where the motion is longer.
FREE = 601
#: Part of the range of a driver that is left out at its ends, where a dead centre is singular.
SHORT = 0.01


def motion(
    model: Mechanism | System,
    wanted: Instants | None = None,
    to: Any = None,
    progress: Callable[[float], None] | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """The motion of a model that has not been analysed.

    >>> import mbody
    >>> len(motion(mbody.gallery.load("norton_fourbar")))
    361
    """
    system = model if isinstance(model, System) else assemble(model)
    mechanism = system.mechanism
    free = mechanism.simulation is not None or not mechanism.drivers
    if to is not None and not free:
        last = number_in(mechanism, to, "time", "view", "to")
        if not last > 0.0 or not math.isfinite(last):
            unit = mechanism.units.of("time")
            raise ModelError(
                f"the last time of a motion must be positive and finite, not {last:g} {unit}: "
                "give a later one"
            )
        try:
            return kinetostatics(
                system, t=np.linspace(0.0, last, 2 * SMOOTH - 1), assembly=assembly
            )
        except ModelError:
            free = True  # drivers leave a freedom: what is left moves by itself
    if free and wanted is None:
        if assembly is not None:
            raise ModelError(
                "an assembly mode is of driven analyses, and this is a free motion: leave it out, "
                "or choose instants"
            )
        return simulate(system, to, instants=FREE, progress=progress)
    if wanted is not mechanism.ask and wanted is not None:
        run = analyse_system_at(system, "kinetostatics", wanted, assembly)
        # requested positions are shown in the order in which the motion has them
        return run if np.all(np.diff(run.t) >= 0.0) else run.take(np.argsort(run.t, kind="stable"))
    try:
        ask = cycle(mechanism, mechanism.ask)
        return analyse_system_at(system, "kinetostatics", ask, assembly)
    except (ModelError, SolveError) as error:
        # of the mode that the guesses choose
        found = _range(system) if assembly is None else None
        if found is None:
            raise error from None
        return found


def _range(system: System) -> Solution | None:
    """The motion of a driver that makes no turn, through the range that it has."""
    if len(system.mechanism.drivers) != 1:
        return None
    driver = system.mechanism.drivers[0]
    try:
        found = driver_range(system)
        middle = found.start
        size = math.pi if driver.angular else system.length
        low = found.low if math.isfinite(found.low) else middle - size
        high = found.high if math.isfinite(found.high) else middle + size
        spare = SHORT * (high - low)
        values = np.linspace(low + spare, high - spare, SMOOTH)
        run = kinetostatics(system, drive={driver.name: values})
    except (ModelError, SolveError):
        return None
    return run
