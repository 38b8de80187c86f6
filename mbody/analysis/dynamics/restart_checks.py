"""Checks of the state from which a motion is to be continued: sizes, finite numbers, its time."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.dynamics.integrators import integrator
from mbody.analysis.dynamics.modal_restart import unfit_modes
from mbody.analysis.singular.nearby_singularity import unpacked_positions
from mbody.errors import ModelError
from mbody.kernels.step_state import NEXT, PROGRESS, TIME, UNLIMITED
from mbody.model.simulation import EVEN, METHODS
from mbody.solution.energy import causes
from mbody.solution.restart import Restart
from mbody.system.system import System

__all__ = ["check_restart", "finite"]

#: Lengths of its next step that the state may lie before the last instant; it lies one before.
BEFORE = 10.0


def check_restart(system: System, restart: Restart, last: float) -> None:
    """Refuse a state that no motion of a system can have left: going on from it would not end.

    Parameters
    ----------
    system : System
        Without the drivers that are released.
    restart : Restart
    last : float
        The last instant of the result.

    Raises
    ------
    ModelError
    """
    if (why := _unfit(system, restart, last)) is not None:
        raise ModelError(
            f"the state that the motion of '{system.mechanism.name}' is to go on from is damaged: "
            f"{why}; simulate anew, from its beginning"
        )


def finite(state: np.ndarray) -> np.ndarray:
    """The numbers of a state that must be finite: some are infinite where nothing limits them."""
    found = state.copy()
    open_ones = list(UNLIMITED)
    found[open_ones] = np.where(np.isinf(found[open_ones]), 0.0, found[open_ones])
    return found


def _unfit(system: System, restart: Restart, last: float) -> str | None:
    """What is wrong with it."""
    way, width = restart.way, system.state_count
    if way.method not in METHODS:
        return f"there is no method {str(way.method)[:40]!r}"
    numbers = (way.rtol, way.atol, way.step)
    sound = all(isinstance(x, float) and math.isfinite(x) and x >= 0.0 for x in numbers)
    if not sound or way.rtol <= 0.0 or (way.method in EVEN) != (way.step > 0.0):
        return "its tolerances or its step are no positive numbers"
    few, count = len(causes(system)), PROGRESS
    wanted = {"scale": width, "y": width, "slope": width, "powers": few, "gained": few}
    for name, size in (wanted | {"state": count}).items():
        part = getattr(restart, name)
        if part.shape != (size,) or part.dtype != np.float64:
            return f"'{name}' has not {size} numbers"
        if not (np.isfinite(finite(part)) if name == "state" else np.isfinite(part)).all():
            return f"'{name}' holds what is no finite number"
    try:
        unpacked_positions(system, restart.met)
    except ValueError as error:
        return f"'met' holds no singular positions of it: {error}"
    if not np.isfinite(restart.met).all():
        return "'met' holds what is no finite number"
    modal = restart.modal
    wrong = None if modal is None else unfit_modes(system, modal)
    return _unfit_time(restart, last) or _unfit_own(system, restart) or wrong


def _unfit_own(system: System, restart: Restart) -> str | None:
    """What is wrong with the numbers of the method itself."""
    way = restart.way
    if way.method == "moreau":
        widths = [part.shape[1:] for part in restart.own]
        if widths != [(5,), (), (), ()] or any(p.dtype != np.float64 for p in restart.own):
            return "'own' is of other sizes"
        if not all(np.isfinite(part).all() for part in restart.own):
            return "'own' holds what is no finite number"
        return None
    own = integrator(way.method, system.layout, system.work(masses=True), way.step).own
    if len(own) != len(restart.own):
        return f"'own' has {len(restart.own)} parts in place of {len(own)}"
    for part, like in zip(restart.own, own, strict=True):
        # a method that has made no step of its own yet has no numbers of its own
        if part.shape != like.shape or part.dtype != like.dtype:
            return "'own' is of other sizes"
        if not (np.isfinite(part).all() or np.isnan(part).all()):
            return "'own' holds what is no finite number"
    return None


def _unfit_time(restart: Restart, last: float) -> str | None:
    """What is wrong with its sizes and its time."""
    if not (restart.scale > 0.0).all():
        return "'scale' holds sizes that are not positive"
    t, step = float(restart.state[TIME]), float(restart.state[NEXT])
    if not step > 0.0 or not 0.0 <= last - t <= BEFORE * step:
        return f"its time is {t:g} and its step {step:g}, the last instant {last:g}"
    return None
