"""Motion in phases: between them drivers are released."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbody.analysis.driven.contacts import one_sided
from mbody.analysis.dynamics.events import EventIntegration
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.options import MotionRequest
from mbody.analysis.dynamics.restart_checks import check_restart
from mbody.analysis.dynamics.singular_start import singular_start
from mbody.analysis.freedom.single_design import released
from mbody.analysis.initial.initial_state import state_of
from mbody.errors import SolveError
from mbody.kernels.output import PER_PRIMITIVE
from mbody.kernels.step_state import PROGRESS
from mbody.model.event import Stop
from mbody.solution.certificate import as_reported
from mbody.solution.energy import account, causes
from mbody.solution.histories import Record
from mbody.solution.restart import Restart, Way
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["integrate_phases"]

Array = np.ndarray

#: What a motion depends on; what else a description has may differ.
PARTS = ("units", "ground", "bodies", "joints", "couplings", "drivers", "loads")


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
    restart = _restart(system, start, request.way, tuple(free_since), bool(_stops(request)))
    found: list[Solution] = []
    for until in [*sorted(set(later.values())), last]:
        free = released(system, list(free_since)) if free_since else system
        now = {name: t for name, t in later.items() if t == until}
        state = state or state_of(free, start)
        first_part = None
        if restart is None:
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
        integration = (
            EventIntegration(free, start, request.way, request.events)
            if request.events or one_sided(free)
            else Integration(free, start, request.way)
        )
        try:
            run = integration.run(first, q, v, wanted, progress, restart)
        except SolveError as error:
            reached = [one for one in (*found, error.solution) if one is not None and len(one)]
            if reached and free_since:
                error.solution = _joined(system, request, reached, free_since)
            raise
        found.append(run)
        if run.t[-1] < until:  # it ended before: in doubt a motion goes on
            break
        start, state, restart = run, None, None
        free_since = free_since | now
    if len(found) == 1 and not free_since:
        return found[0]
    return _joined(system, request, found, free_since)


def _stops(request: MotionRequest) -> list[str]:
    return [event.name for event in request.events if isinstance(event, Stop)]


def _restart(
    system: System, start: Solution, way: Way, gone: tuple[str, ...], stops: bool
) -> Restart | None:
    """Where to continue a motion of the same system, integrated in the same way; `gone`: the
    drivers that are released.
    """
    found = start.restart
    if found is None or found.way != way or tuple(start.released) != gone or stops:
        return None
    if len(found.state) != PROGRESS:  # of another version
        return None
    ours, theirs = system.values, start.system.values
    same = start.system is system or (
        all(getattr(start.mechanism, part) == getattr(system.mechanism, part) for part in PARTS)
        and all(np.array_equal(ours[name], theirs[name]) for name in ours)
    )
    if same:
        check_restart(released(system, list(gone)) if gone else system, found, float(start.t[-1]))
    return found if same else None


def _joined(
    system: System, request: MotionRequest, found: Sequence[Solution], released: Mapping[str, float]
) -> Solution:
    """One result of all phases; a released driver has no effort."""
    last, stops = found[-1], _stops(request)
    whole = causes(system, stops)
    t, pages, works = [], [], []
    before = np.zeros(len(whole))
    for run in found:
        keep = np.isin(run.t, request.times)
        if run is last:
            keep[-1] = True
        else:
            keep &= run.t < run.t[-1]
        names = causes(run.system, stops)
        places = [whole.index(name) for name in names]
        work = np.tile(before, (len(run), 1))
        for place, name in zip(places, names, strict=True):
            work[:, place] += run.energy.by.get(name, 0.0) if run.energy else 0.0
        before = work[-1].copy()
        t.append(run.t[keep])
        pages.append(_widened(system, run)[keep])
        works.append(work[keep])
    output, gained = np.concatenate(pages), np.concatenate(works)
    certified = [as_reported(run) for run in found]
    stats = {
        key: sum((run.stats or {}).get(key, 0) for run in found)
        for run in found
        for key in run.stats or {}
    }
    nearest = min(
        (run.branch for run in found if run.branch is not None),
        key=lambda one: one.least,
        default=None,
    )
    return replace(
        last,
        system=system,
        t=np.concatenate(t),
        record=Record([output], len(output), batch=False),
        energy=account(system, output[:, : 2 * system.coordinates, 0], gained, stops),
        status=certified[-1].status,
        doubts=tuple(dict.fromkeys(doubt for one in certified for doubt in one.doubts)),
        notes=tuple(dict.fromkeys(note for one in certified for note in one.notes)),
        stats=stats,
        released=released,
        events=tuple(one for run in found for one in run.events),
        branch=nearest,
    )


def _widened(system: System, run: Solution) -> Array:
    """Pages of a phase as those of the whole system."""
    block = run.record.blocks[0]
    n3 = 3 * system.coordinates
    wide = np.zeros((len(run), n3 + PER_PRIMITIVE * len(system.owners), 1))
    wide[:, :n3] = block[:, :n3]
    here = {(element.name, part): e for e, (element, part) in enumerate(system.owners)}
    for e, (element, part) in enumerate(run.system.owners):
        row, old = n3 + PER_PRIMITIVE * here[element.name, part], n3 + PER_PRIMITIVE * e
        wide[:, row : row + PER_PRIMITIVE] = block[:, old : old + PER_PRIMITIVE]
    return wide
