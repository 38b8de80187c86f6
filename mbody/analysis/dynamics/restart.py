"""What is kept of a motion, to be shown or to go on from; checks of it; how a motion stops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import SLIP_SIGNS, Unilateral, unilateral_of
from mbody.analysis.driven.contact_report import OneSidedForce
from mbody.analysis.driven.diagnosis import stuck
from mbody.analysis.driven.time_grid import check_law_ranges
from mbody.analysis.dynamics.branch_passage import KnownCrossings
from mbody.analysis.dynamics.integrators import integrator
from mbody.analysis.position.closed_position import vanishing
from mbody.analysis.singular.nearby_singularity import unpacked_positions
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.kernels.step_state import NEXT, PROGRESS, STIFF, TIME, UNLIMITED
from mbody.model.element import listed
from mbody.model.simulation import EVEN, METHODS, Event
from mbody.solution.energy import causes
from mbody.solution.histories import EventRecord
from mbody.solution.shared_forces import ForceSet
from mbody.solution.solution import ActiveSet, ModalState, Restart, Solution
from mbody.system.system import System

Array = np.ndarray

#: Words for modes; and for guards, in the order of the kernels.
WORDS = ("open", "stick", *SLIP_SIGNS)
GUARDS = ("close", "lock", "open", "edge", "enter", "slip", "share", "stop", "paradox")


def set_active_set(uni: Unilateral, work: Work, found: ActiveSet) -> None:
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
    }
    more = {"page": system.record_rows, "lost": len(system.mechanism.contacts)}
    for part, own in ((found, sizes | more), (found.end, sizes)):
        for name, size in own.items():
            if len(getattr(part, name)) != size:
                return f"'{name}' has not {size} parts"
    ends = found.end
    words = all(one in WORDS for one in (*found.modes, *found.pairs, *ends.modes, *ends.pairs))
    kinds = all(kind in GUARDS for kind, _, _ in found.fresh)
    if not words or not kinds:
        return "it has modes that there are not"
    numbers = [*found.on, *found.anchor, *found.phases, *found.page, *found.lost]
    numbers += [*ends.on, *ends.anchor, *ends.phases]
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
    if not step > 0.0 or not 0.0 <= last - t <= tol.RESTART_STEPS_BEFORE * step:
        return f"its time is {t:g} and its step {step:g}, the last instant {last:g}"
    return None


# -- Events ------------------------------------------------------------------------------------


def is_known(occurred: Sequence[EventRecord], event: Event, t: float, together: float) -> bool:
    """Whether a crossing was recorded beside the change of modes that ended the last step."""
    for one in reversed(occurred):
        if t - one.t > together:
            return False
        if one.name == event.name and not one.contact and one.t - t <= together:
            return True
    return False


# -- Checkpoints: all that the next step depends on, in memory ----------------------------------


@dataclass(frozen=True, eq=False)
class ContactModes:
    """Contact modes of a checkpoint: what a motion with contacts needs besides its state.

    `first`: Mode of every contact and frictional joint when the motion began, by name.
    `rows`: Which rows are on, with what depends on it, their anchors, slip signs of sliding, and
      the numbers of the rows, among which are the phases of circles that stick.
    `tables`: Modes, who leads what sticks, what is closed and what has left its edge, when contact
      points were struck last, what is rounding of guards, whose forces no equation decides, when
      modes changed last and how often then.
    `lost` (contacts,): Energy that impacts of each took.
    """

    first: dict[str, str]
    rows: tuple[Array, ...]
    tables: tuple[Array, ...]
    notes: tuple[str, ...]
    lost: Array
    #: Admissible forces of the first instant.
    forces: ForceSet | None = None


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that the next step depends on.

    `restart`: The state of the integrator, and the work since the reference.
    `regularization`: Of redundant rows.
    `near`: Distances from singular positions at the beginning of the step.
    `passage`: Singular positions ahead, those behind, doubts, and positions that were met.
    `reference`, `record` (rows, 1): When the motion began, what is kept of that instant (see
      `mbody.kernels.layout`), and of the present one.
    `extremes`: Of contacts and ropes the least force and the largest by size.
    `modes`: What is open, sticks and slides.
    """

    restart: Restart
    regularization: float
    near: Array
    passage: KnownCrossings
    first: float
    reference: Array
    record: Array
    extremes: dict[str, OneSidedForce]
    modes: ContactModes | None = None


def unfit_checkpoint(motion: Any, given: Checkpoint, inputs: Array) -> str:
    """Why a motion in its modes cannot go on from there."""
    restart, n = given.restart, motion.system.coordinates
    sampled = [one.controller.name for one in restart.sampled]
    if sampled != [one.name for one in motion.system.mechanism.controllers]:
        return "is of another mechanism, with other controllers"
    parts = (restart.y, restart.gained, given.reference, given.near)
    mine = (motion.y, motion.total, motion.present_record, motion.work.near)
    if [part.shape for part in parts] != [part.shape for part in mine]:
        return "is of another mechanism, with other elements"
    before, t = motion.y.copy(), float(motion.state[TIME])
    motion.y[:], motion.state[TIME] = restart.y, restart.state[TIME]
    try:
        a = motion.instant(inputs, restart.inputs)[2 * n : 3 * n, 0]
    finally:
        motion.y[:], motion.state[TIME] = before, t
    off = np.abs((a - restart.slope[n : 2 * n]) / motion.system.coordinate_units)
    # at rest what accelerations there are is rounding
    velocity_scale = float((restart.scale[n : 2 * n] / restart.scale[:n]).max(initial=0.0))
    size = velocity_scale**2 + np.abs(a / motion.system.coordinate_units).max(initial=0.0)
    moved = np.abs((motion.present_record[:n, 0] - restart.y[:n]) / motion.system.coordinate_units)
    if (
        off.max(initial=0.0) > tol.ACCELERATIONS_AGREE * size
        or moved.max(initial=0.0) > tol.ACCELERATIONS_AGREE
    ):
        return (
            "has other accelerations than this mechanism: its numbers differ; reset(state) "
            "takes its positions and rates alone"
        )
    return ""


# -- A motion that cannot be integrated --------------------------------------------------------


def stopped(motion: Any, found: Solution, code: int) -> SolveError:
    """The sentence of a motion that cannot be integrated."""
    state = motion.state
    unit = motion.system.mechanism.units.time
    t = float(state[TIME])
    when = f"t = {t:.6g} {unit}"
    if code == STIFF:
        left = (motion.until - t) / state[NEXT]
        return SolveError(
            f"the loads are too stiff for explicit steps: at {when} the step has shrunk to "
            f"{state[NEXT]:.2g} {unit}, the end would take {left:.1g} more; ask for the "
            "method 'radau5'",
            solution=found,
        )
    beyond = np.array([t + part * max(t, 1e-6) for part in (0.0, 1e-9, 1e-6, 1e-3)])
    try:
        check_law_ranges(motion.system, beyond, {})
    except ModelError as error:
        why = f"the motion ends at {when}: {error}"
        return SolveError(why, error.element, found)
    q = motion.y[: motion.system.coordinates]
    reason = vanishing(motion.system, q, when) or stuck(motion.system, t, q)
    if reason is not None:
        reason.solution = found
        return reason
    if motion.settings.method in EVEN:
        return SolveError(
            f"the equations of a step of '{motion.settings.method}' have no solution at {when}: "
            f"{motion.settings.step:g} {unit} is too long there, or the loads jump or grow "
            "without bound; take shorter steps, or the method 'dop853'",
            solution=found,
        )
    curves = [
        name
        for name, curve in motion.system.mechanism.curves.items()
        if getattr(curve.law, "outside", "") == "error"
    ]
    motion.vanished = motion.settings.method != "radau5"
    looped = ", or an algebraic loop has no unique solution" if motion.system.has_loops else ""
    ended = f", or are beyond the points of the curves {listed(curves)}" if curves else ""
    return SolveError(
        f"the steps vanish at {when}: the loads jump there, grow without bound, or are too "
        f"stiff{ended}{looped}; smooth them, or ask for less accuracy",
        solution=found,
    )


def no_progress(motion: Any, mean: float, left: float, steps: int) -> SolveError:
    """The sentence of a motion whose last steps were so short that it does not come to its end."""
    t, unit = float(motion.state[TIME]), motion.system.mechanism.units.time
    what = "the loads jump to and fro"
    remedy = "smooth what jumps, as dry friction and valves do where rates change their sign"
    late = [one.contact for one in motion.occurred if one.contact and one.t >= t - mean * steps]
    if len(late) > steps / 10:
        what = f"{listed(dict.fromkeys(late))} strike and open by turns"
        remedy = "take less restitution there, or the method 'moreau'"
    return SolveError(
        f"{what} at t = {t:.6g} {unit}: the last {steps} steps were {mean:.1g} "
        f"{unit} each, the end would take {left:.1g} more; {remedy}",
        solution=motion.solution(""),
    )
