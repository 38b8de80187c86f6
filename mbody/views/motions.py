"""The motion that a moving picture shows of a model: a turn, the requested instants, or free."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.analysis.driven.driver_range import driver_range
from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.analysis.driven.requests import analyse_at
from mbody.analysis.dynamics.simulate import simulate
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.study import Instants
from mbody.solution.solution import Solution
from mbody.views.cycle import SMOOTH, cycle

__all__ = ["motion"]

#: Instants of free motion between two of which nothing is missed on a screen: 60 a second for some
#: seconds, and more where the motion is longer.
FREE = 601
#: Part of the range of a driver that is left out at its ends, where a dead centre is singular.
SHORT = 0.01


def motion(
    mechanism: Mechanism,
    wanted: Instants | None = None,
    to: Any = None,
    progress: Callable[[float], None] | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """The motion of a model that has not been analysed.

    Parameters
    ----------
    mechanism : Mechanism
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
                mechanism, t=np.linspace(0.0, last, 2 * SMOOTH - 1), assembly=assembly
            )
        except ModelError:
            free = True  # drivers leave a freedom: the rest moves by itself
    if free and wanted is None:
        if assembly is not None:
            raise ModelError(
                "an assembly mode is of driven analyses, and this is a free motion: leave it out, "
                "or choose instants"
            )
        return simulate(mechanism, to, instants=FREE, progress=progress)
    if wanted is not mechanism.ask and wanted is not None:
        run = analyse_at(mechanism, "kinetostatics", wanted, assembly)
        # requested positions are shown in the order in which the motion has them
        return run if np.all(np.diff(run.t) >= 0.0) else run.take(np.argsort(run.t, kind="stable"))
    try:
        return analyse_at(mechanism, "kinetostatics", cycle(mechanism, mechanism.ask), assembly)
    except (ModelError, SolveError) as error:
        # of the mode that the guesses choose
        found = _range(mechanism) if assembly is None else None
        if found is None:
            raise error from None
        return found


def _range(mechanism: Mechanism) -> Solution | None:
    """The motion of a driver that makes no turn, through the range that it has."""
    if len(mechanism.drivers) != 1:
        return None
    driver = mechanism.drivers[0]
    try:
        found = driver_range(mechanism)
        middle = found.start
        size = math.pi if driver.angular else kinetostatics(mechanism).system.length
        low = found.low if math.isfinite(found.low) else middle - size
        high = found.high if math.isfinite(found.high) else middle + size
        spare = SHORT * (high - low)
        values = np.linspace(low + spare, high - spare, SMOOTH)
        run = kinetostatics(mechanism, drive={driver.name: values})
    except (ModelError, SolveError):
        return None
    return run
