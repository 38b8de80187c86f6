"""The motion that a moving picture shows of a model: a turn, the requested instants, or free."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.analysis.driven.driver_range import driver_range
from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.analysis.driven.requests import analyse_system_at
from mbody.analysis.dynamics.simulate import simulate
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.study import Instants
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System
from mbody.views.cycle import SMOOTH, cycle

__all__ = ["motion"]

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

    Parameters
    ----------
    model : Mechanism or System
        A system may have other numbers than its description.
    wanted : Instants, optional
        Of a driven motion; by default the model's own, with as many between as are smooth; a whole
        turn where it has one instant only, else the range of the driver.
    to : number or str, optional
        The last time, of free or driven motion.
    progress : function, optional
        Of free motion, as of `simulate`.
    assembly : str or int, optional
        Of driven motion, the assembly mode at its first instant, as of `kinetostatics`.

    Raises
    ------
    ModelError, SolveError
        As of the analysis.

    Examples
    --------
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
            free = True  # drivers leave a freedom: the rest moves by itself
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
