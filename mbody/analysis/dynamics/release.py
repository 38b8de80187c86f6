"""Motion in phases: between them drivers are released."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes, refuse_modes
from mbody.analysis.driven.contacts import one_sided
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.analysis.dynamics.events import EventIntegration
from mbody.analysis.dynamics.impulse_stepping import impulse_motion
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.joining import SAME_PARTS, joined
from mbody.analysis.dynamics.options import MotionRequest
from mbody.analysis.dynamics.released_readings import refuse_readings_of_released
from mbody.analysis.dynamics.restart_checks import check_restart
from mbody.analysis.dynamics.singular_start import singular_start
from mbody.analysis.freedom.single_design import released
from mbody.analysis.initial.initial_state import state_of
from mbody.errors import SolveError
from mbody.kernels.step_state import PROGRESS
from mbody.model.simulation import ADAPTIVE
from mbody.solution.restart import Restart, Way
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["integrate_phases"]

Array = np.ndarray

#: What a motion depends on; what else a description has may differ.
PARTS = (*SAME_PARTS, "inputs")


def integrate_phases(
    system: System,
    start: Solution,
    state: tuple[float, Array, Array] | None,
    request: MotionRequest,
    progress: Callable[[float], None] | None,
) -> Solution:
    """The motion from the last instant of `start`, as one result of the whole system; drivers that
    were released there stay so. `state`: time, positions and rates of that instant.
    """
    if request.way.method == "moreau":
        going_on = _restart(system, start, request.way, ())
        return impulse_motion(system, start, state, request, progress, going_on)
    own = {driver.name for driver in system.drivers}
    free_since = {name: t for name, t in start.released.items() if name in own}
    for name, t in request.release.items():
        if t <= request.first:
            free_since.setdefault(name, request.first)
    last = float(request.times[-1])
    later = {
        name: t
        for name, t in request.release.items()
        if request.first < t < last and name not in free_since
    }
    if free_since or later:
        refuse_readings_of_released(system.mechanism, {*free_since, *later}, request.events)
    restart = _restart(system, start, request.way, tuple(free_since))
    # what takes energy by impacts
    struck = [one.name for one in system.mechanism.contacts]
    found: list[Solution] = []
    carried: tuple[dict[str, float], Sequence[Any]] | None = None
    if start.restart is not None:
        carried = start.restart.inputs, start.restart.sampled
    for until in [*sorted(set(later.values())), last]:
        free = released(system, list(free_since)) if free_since else system
        now = {name: t for name, t in later.items() if t == until}
        state = state or state_of(free, start)
        first_part, decided = None, has_modes(free)
        if decided and request.way.method not in ADAPTIVE:
            refuse_modes(free, f"the method '{request.way.method}'")
        if restart is None and not decided:
            first_part = singular_start(free, start, state, request, until)
        if first_part is not None:
            found.append(first_part)
            start, state = first_part, None
            if first_part.t[-1] >= until:
                free_since = free_since | now
                continue
        first, q, v = state or state_of(free, start)
        times = request.times[(request.times >= first) & (request.times <= until)]
        wanted = np.append(times, until) if not times.size or times[-1] < until else times
        kind = EventIntegration if request.events or one_sided(free) else None
        if decided:
            kind = ContactIntegration
        integration = (
            Integration(free, start, request.way)
            if kind is None
            else kind(free, start, request.way, request.events)
        )
        try:
            run = integration.run(first, q, v, wanted, progress, restart, carried)
        except SolveError as error:
            reached = [one for one in (*found, error.solution) if one is not None and len(one)]
            if reached and free_since:
                error.solution = joined(system, reached, free_since, struck, request.times)
            raise
        found.append(run)
        carried = integration.interruptions.inputs(), integration.interruptions.sampled
        if run.t[-1] < until:  # it ended before: in doubt a motion goes on
            break
        start, state, restart = run, None, None
        free_since = free_since | now
    if len(found) == 1 and not free_since:
        return found[0]
    return joined(system, found, free_since, struck, request.times)


def _restart(system: System, start: Solution, way: Way, gone: tuple[str, ...]) -> Restart | None:
    """Where to continue a motion of the same system, integrated in the same way; `gone`: the
    drivers that are released.
    """
    found = start.restart
    if found is None or found.way != way or tuple(start.released) != gone:
        return None
    if len(found.state) != PROGRESS:  # of another version
        return None
    decided = way.method != "moreau" and has_modes(released(system, list(gone)) if gone else system)
    if decided != (found.modal is not None):
        return None
    ours, theirs = system.values, start.system.values
    same = start.system is system or (
        all(getattr(start.mechanism, part) == getattr(system.mechanism, part) for part in PARTS)
        and all(np.array_equal(ours[name], theirs[name]) for name in ours)
    )
    # steps with impulses go on without the rows of contacts, and check that themselves
    if same and way.method != "moreau":
        check_restart(released(system, list(gone)) if gone else system, found, float(start.t[-1]))
    return found if same else None
