"""Restart of a motion: checks of the state, and the modes that were kept."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.contact.unilateral import SLIP_SIGNS, Unilateral, unilateral_of
from mbody.analysis.dynamics.integrators import integrator
from mbody.analysis.singular.nearby_singularity import unpacked_positions
from mbody.core.tolerances import RESTART_STEPS_BEFORE
from mbody.errors import ModelError
from mbody.kernels.layout import Work
from mbody.kernels.step_state import NEXT, PROGRESS, TIME, UNLIMITED
from mbody.model.simulation import EVEN, METHODS
from mbody.solution.energy import causes
from mbody.solution.solution import ModalState, Restart
from mbody.system.system import System

#: Words for modes; and for guards, in the order of the kernels.
WORDS = ("open", "stick", *SLIP_SIGNS)
GUARDS = ("close", "lock", "open", "edge", "enter", "slip", "share", "stop", "paradox")


def set_active_set(uni: Unilateral, work: Work, found: ModalState) -> None:
    """Set rows, anchors, phases and slip signs of a workspace."""
    on, slip_signs = np.array(found.on), np.zeros(len(uni.layout.friction_kind))
    pairs = [one.pair if on[one.normal] else -1 for one in uni.contact_points]
    pairs += [one.pair for one in uni.friction_joints]
    for pair, mode in zip(pairs, (*found.modes, *found.pairs), strict=True):
        if mode in SLIP_SIGNS and pair >= 0:
            slip_signs[pair] = SLIP_SIGNS[mode]
    work.anchor[: len(on), 0] = found.anchor
    for row, phase in zip(uni.phase_rows, found.phases, strict=True):
        work.par[row, 0] = phase
    uni.set_rows(work, on, slip_signs)


def unfit_modes(system: System, found: ModalState) -> str | None:
    """Reason why modes do not fit a system; None where they fit."""
    uni = unilateral_of(system)
    points, every = len(uni.contact_points), len(uni.contact_points) + len(uni.friction_joints)
    sizes = {
        "modes": points,
        "pairs": len(uni.friction_joints),
        "on": len(uni),
        "anchor": len(uni),
        "phases": len(uni.phase_rows),
        "page": system.record_rows,
        "lost": len(system.mechanism.contacts),
    }
    for name, size in sizes.items():
        if len(getattr(found, name)) != size:
            return f"'{name}' has not {size} parts"
    words = all(one in WORDS for one in (*found.modes, *found.pairs))
    kinds = all(kind in GUARDS for kind, _, _ in found.fresh)
    if not words or not kinds:
        return "it has modes that there are not"
    numbers = [*found.on, *found.anchor, *found.phases, *found.page, *found.lost]
    numbers += [least for *_, least in found.fresh] + [when for _, when in found.struck]
    if not all(math.isfinite(one) for one in numbers):
        return "its modes have what is no finite number"
    if len(found.shared) not in (0, 2):
        return "'shared' has not two parts"
    named = [*found.closed, *found.beyond, *(one for one, _ in found.struck)]
    named += [one for part in (*found.groups, *found.shared) for one in part]
    named += [one for _, one, _ in found.fresh]
    if not all(0 <= one < max(every, 1) for one in named):
        return "its modes name what is not there"
    return None


# -- Checks of the state from which a motion is to be continued: sizes, finite numbers, its time


def check_restart(system: System, restart: Restart, last: float) -> None:
    """Refuse a state that no motion of a system can have left: going on from it would not end."""
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
    """Reason why a restart does not fit a system; None where it fits."""
    settings, width = restart.settings, system.state_count
    if settings.method not in METHODS:
        return f"there is no method {str(settings.method)[:40]!r}"
    numbers = (settings.rtol, settings.atol, settings.step)
    sound = all(isinstance(x, float) and math.isfinite(x) and x >= 0.0 for x in numbers)
    if not sound or settings.rtol <= 0.0 or (settings.method in EVEN) != (settings.step > 0.0):
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
    """Reason why the numbers of the method itself do not fit; None where they fit."""
    settings = restart.settings
    if settings.method == "moreau":
        widths = [part.shape[1:] for part in restart.own]
        if widths != [(5,), (), (), ()] or any(p.dtype != np.float64 for p in restart.own):
            return "'own' is of other sizes"
        if not all(np.isfinite(part).all() for part in restart.own):
            return "'own' holds what is no finite number"
        return None
    own = integrator(settings.method, system.layout, system.work(masses=True), settings.step).own
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
    """Reason why the sizes or the time do not fit; None where they fit."""
    if not (restart.scale > 0.0).all():
        return "'scale' holds sizes that are not positive"
    t, step = float(restart.state[TIME]), float(restart.state[NEXT])
    if not step > 0.0 or not 0.0 <= last - t <= RESTART_STEPS_BEFORE * step:
        return f"its time is {t:g} and its step {step:g}, the last instant {last:g}"
    return None
