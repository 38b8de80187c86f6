"""The verb `simulate`: free motion under loads, over time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes, refuse_modes, with_contacts_of_joints
from mbody.analysis.dynamics.branch_passage import singular_start
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.options import (
    MotionRequest,
    last_time,
    motion_request,
    tolerances,
    with_inputs,
)
from mbody.analysis.dynamics.restart import check_restart
from mbody.analysis.freedom.mobility import released
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import (
    begins_so,
    event_measure,
    initial_state_of,
    other_model_note,
    state_of,
)
from mbody.analysis.position.assembly_analysis import as_system, each_design
from mbody.core import tolerances as tol
from mbody.core.former_names import refuses_former_arguments
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.finished_instants import TERM
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.kernels.step_state import PROGRESS, TIME
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import EVEN, WITH_MODES, Event, Measure, measure_named
from mbody.quantities.formula import Number, PlainNumbers
from mbody.solution.doubts import Doubt, doubted
from mbody.solution.energy import account, causes
from mbody.solution.histories import Record, one_design, reported_certificate, with_fields
from mbody.solution.shared_forces import joined_forces
from mbody.solution.solution import InitialState, IntegrationSettings, Restart, Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

# -- Readers of released drivers are refused before the motion begins --------------------------


def refuse_readings_of_released(
    mechanism: Mechanism, gone: Collection[str], events: Sequence[Event] = ()
) -> None:
    """Refuse formulas, controllers and events that read drivers which are released."""
    mechanism.without(*gone)  # which refuses those that formulas read
    for name, what, measure in _readings(mechanism, events):
        for quantity in sorted(measure.names):
            driver = quantity.partition(".")[0]
            if driver in gone:
                raise ModelError(
                    f"driver '{driver}' cannot be released, {what} '{name}' reads '{quantity}': "
                    "read the body that it drives, or a joint",
                    name,
                )


def _readings(mechanism: Mechanism, events: Sequence[Event]) -> Iterator[tuple[str, str, Measure]]:
    """Names of controllers and events, what they are, and what they read."""
    for one in mechanism.controllers:
        for text in one.reads:
            yield one.name, "controller", measure_named(mechanism.measures, text)
    for event in events:
        yield event.name, "event", event_measure(mechanism, event)


# -- Several motions, each of which goes on from the one before, as one result -----------------

Array = np.ndarray

#: What a motion depends on; what else a description has may differ.
SAME_PARTS: tuple[str, ...] = ("units", "ground", "bodies", "joints", "couplings", "drivers")
SAME_PARTS += ("contacts", "loads", "curves", "states", "quantities", "controllers")


def stops_of(run: Solution) -> list[str]:
    """Names of the stops whose impacts are in the account of energy."""
    known = causes(run.system)
    return [name for name in (run.energy.by if run.energy else ()) if name not in known]


def sizes(run: Solution, state: Array) -> Array:
    """Scales of differences of positions and rates, (2·coordinates,): of rates not less than what
    goes a model length or a radian in the time of the motion.
    """
    system, n = run.system, run.system.coordinates
    place, rate = system.extent(state[:n]), system.extent(state[n:])
    whole, units = float(run.t[-1] - run.t[0]), system.coordinate_units
    rate += 1.0 / whole if whole > 0.0 else tol.TINY
    return np.concatenate([(1.0 + place) * units, rate * units])


def same_motion(one: System, other: System) -> bool:
    """Whether motions of two systems are of the same mechanism; inputs may have other histories."""
    if one is other:
        return True
    inputs = {each.name for system in (one, other) for each in system.mechanism.inputs}
    ours, theirs = (
        {k: v for k, v in system.values.items() if k.partition(".")[0] not in inputs}
        for system in (one, other)
    )
    names = [[(each.name, each.dimension) for each in s.mechanism.inputs] for s in (one, other)]
    return (
        names[0] == names[1]
        and all(
            getattr(one.mechanism, part) == getattr(other.mechanism, part) for part in SAME_PARTS
        )
        and ours.keys() == theirs.keys()
        and all(np.array_equal(ours[name], theirs[name]) for name in ours)
    )


def then(first: Solution, *later: Solution) -> Solution:
    """Motions that follow each other as one; see `Solution.then`."""
    runs = [first, *later]
    for run in runs:
        if not isinstance(run, Solution) or run.analysis != "simulate":
            what = run.analysis if isinstance(run, Solution) else type(run).__name__
            raise ModelError(
                f"then joins motions of simulate, not a result of {what}: simulate it with "
                "start=run"
            )
        if not len(run):
            raise ModelError("then joins motions that have instants: one of them has none")
    if any(run.record.batch for run in runs):
        return _each_then(first, *later)
    for before, after in itertools.pairwise(runs):
        unit = before.mechanism.units.time
        if not same_motion(before.system, after.system):
            raise ModelError(
                f"'{after.mechanism.name}' is not the mechanism of the motion before, or has other "
                "numbers: join motions of one system, whose inputs alone may differ"
            )
        end, begin = float(before.t[-1]), float(after.t[0])
        rows = slice(0, 2 * before.system.coordinates)
        left, right = before.record.table(rows)[-1], after.record.table(rows)[0]
        difference = float((np.abs(left - right) / sizes(before, left)).max(initial=0.0))
        if begin != end or not difference <= tol.STATE_SAME:
            how = (
                f"begins at t = {begin:.6g} {unit}, the one before ends at {end:.6g} {unit}"
                if begin != end
                else f"begins at t = {begin:.6g} {unit} in another position or at other rates, "
                f"{difference:.2g} of their size apart"
            )
            raise ModelError(
                f"a motion {how}: simulate it with start=run, and keep its first instant"
            )
    if not later:
        return first
    stops = list(dict.fromkeys(name for run in runs for name in stops_of(run)))
    whole = joined(runs[-1].system, runs, runs[-1].released, stops)
    known = all(run.initial_states for run in runs)
    return with_fields(
        whole,
        initial_states=tuple(one for run in runs for one in run.initial_states) if known else (),
    )


def _each_then(*runs: Solution) -> Solution:
    """The motions of every design of batches as one; of a design that did not go on, as it was."""
    counts = [run.record.count if run.record.batch else 1 for run in runs]
    if len(set(counts)) > 1 or not all(run.record.batch for run in runs):
        told = ", ".join(map(str, counts))
        raise ModelError(
            f"then joins motions of as many designs, not of {told}: of a batch that of all "
            "designs, of run.design(n) its own"
        )
    from mbody.analysis.position.design_results import solution_of_designs

    found = list[Any]()
    for n in range(counts[0]):
        own: list[Any] = [run.reports[n] for run in runs]
        failed = [one for one in own if isinstance(one, Exception)]
        if failed:
            found.append(failed[0])
            continue
        whole = then(*began) if (began := [one for one in own if len(one)]) else own[0]
        found.append(with_fields(whole, status=own[-1].ending))
    return solution_of_designs(runs[-1].system, found)


def joined(
    system: System,
    found: Sequence[Solution],
    released: Mapping[str, float],
    stops: Sequence[str],
    times: Array | None = None,
) -> Solution:
    """One result of all phases, of which these times are kept, or all; a released driver has no
    effort.
    """
    last = found[-1]
    whole = causes(system, stops)
    t, records, works, kept = [], [], [], []
    before = np.zeros(len(whole))
    for run in found:
        keep = np.ones(len(run), dtype=bool) if times is None else np.isin(run.t, times)
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
        records.append(_widened(system, run)[keep])
        works.append(work[keep])
        kept.append(keep)
    output, gained = np.concatenate(records), np.concatenate(works)
    certified = [reported_certificate(run) for run in found]
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
        energy=account(system, output[:, :, 0], gained, stops),
        status=certified[-1].status,
        doubts=tuple(dict.fromkeys(doubt for one in certified for doubt in one.doubts)),
        notes=tuple(dict.fromkeys(note for one in certified for note in one.notes)),
        stats=stats,
        released=released,
        events=tuple(one for run in found for one in run.events),
        branch=nearest,
        modes={
            name: [
                word
                for run, keep in zip(found, kept, strict=True)
                for word in _modes_at(run, name, keep)
            ]
            for name in last.modes
        },
        shared=joined_forces(
            [
                (run.shared, keep, _places(system, run.system))
                for run, keep in zip(found, kept, strict=True)
            ]
        ),
    )


def _places(system: System, part: System) -> Array:
    """Where the numbers of the primitives of a phase are in the whole system."""
    whole, own = phase_rows(system, part)
    n3 = 3 * system.coordinates
    found = np.zeros(part.record_rows, dtype=np.int64)
    found[own] = whole
    return found[n3:] - n3


def _modes_at(run: Solution, name: str, keep: Array) -> list[str]:
    """The modes of a contact at the instants that are kept."""
    return [run.modes[name][k] for k in np.flatnonzero(keep).tolist()]


def phase_rows(system: System, part: System) -> tuple[Array, Array]:
    """Rows of the records of the whole system, and those of a phase without some of its drivers
    that they are.
    """
    n3 = 3 * system.coordinates
    here = {(element.name, number): e for e, (element, number) in enumerate(system.owners)}
    each = np.arange(PER_PRIMITIVE)
    whole, own = [np.arange(n3)], [np.arange(n3)]
    for rows, one_of in ((whole, system), (own, part)):
        for some in (one_of.friction_rows, one_of.auxiliary_rows):
            rows.append(np.arange(some.start, some.stop))
    for e, (element, number) in enumerate(part.owners):
        whole.append(n3 + PER_PRIMITIVE * here[element.name, number] + each)
        own.append(n3 + PER_PRIMITIVE * e + each)
    return np.concatenate(whole), np.concatenate(own)


def _widened(system: System, run: Solution) -> Array:
    """Records of a phase as those of the whole system."""
    block = run.record.blocks[0]
    wide = np.zeros((len(run), system.record_rows, 1))
    whole, own = phase_rows(system, run.system)
    wide[:, whole] = block[:, own]
    return wide


# -- Motion in phases: between them drivers are released ---------------------------------------

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
    if request.settings.method == "moreau":
        from mbody.analysis.dynamics.impulse_stepping import impulse_motion

        going_on = _restart(system, start, request.settings, ())
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
    restart = _restart(system, start, request.settings, tuple(free_since))
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
        parts = free, start, request.settings, request.events
        integration = motion_of(*parts, meets_forces=True)
        try:
            run = integration.run(first, q, v, wanted, progress, restart, carried)
        except SolveError as error:
            if integration.vanished and _implicit_goes_on(integration, request.events, carried):
                error.args = (f"{error}, or take the method 'radau5', which goes on from there",)
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


def motion_of(
    system: System,
    start: Solution,
    settings: IntegrationSettings,
    events: tuple[Event, ...],
    meets_forces: bool = False,
) -> Integration:
    """What integrates a motion. `meets_forces`: Whether forces of what holds in one direction only
    are met within its steps.
    """
    decided = has_modes(system)
    if decided and settings.method not in WITH_MODES:
        refuse_modes(system, f"the method '{settings.method}'")
    return Integration(system, start, settings, events, meets_forces=meets_forces)


def _implicit_goes_on(
    stopped: Integration,
    events: tuple[Event, ...],
    carried: tuple[dict[str, float], Sequence[Any]] | None,
) -> bool:
    """Whether the implicit method passes the state at which explicit steps vanished."""
    n, t = stopped.system.coordinates, float(stopped.state[TIME])
    if len(stopped.y) > 2 * n:  # auxiliary states begin where the start has them
        return False
    end = np.array([t + tol.STEPS_VANISHED_BEYOND * (stopped.until - stopped.first)])
    try:
        settings = replace(stopped.settings, method="radau5")
        again = motion_of(stopped.system, stopped.start, settings, events, meets_forces=True)
        again.run(t, stopped.y[:n].copy(), stopped.y[n:].copy(), end, None, None, carried)
    except (ModelError, SolveError):
        return False
    return True


def _restart(
    system: System, start: Solution, settings: IntegrationSettings, gone: tuple[str, ...]
) -> Restart | None:
    """Where to continue a motion of the same system, integrated by the same settings; `gone`: the
    drivers that are released.
    """
    found = start.restart
    if found is None or found.settings != settings or tuple(start.released) != gone:
        return None
    if len(found.state) != PROGRESS:  # of another version
        return None
    decided = settings.method != "moreau" and has_modes(
        released(system, list(gone)) if gone else system
    )
    if decided != (found.modal is not None):
        return None
    ours, theirs = system.values, start.system.values
    same = start.system is system or (
        all(getattr(start.mechanism, part) == getattr(system.mechanism, part) for part in PARTS)
        and all(np.array_equal(ours[name], theirs[name]) for name in ours)
    )
    # steps with impulses go on without the rows of contacts, and check that themselves
    if same and settings.method != "moreau":
        check_restart(released(system, list(gone)) if gone else system, found, float(start.t[-1]))
    return found if same else None


# -- A motion at other instants, followed again from its beginning -----------------------------


def motion_start(system: System, start: Solution, request: MotionRequest) -> InitialState:
    """Initial state and request by which a motion can be followed again; of `start` its last
    instant alone is kept.
    """
    instant = start.record.table(slice(None))[-1:, :, None]
    last = Solution(
        system=start.system,
        analysis=start.analysis,
        t=start.t[-1:],
        record=Record([instant.copy()], 1, batch=False),
        given=None if start.given is None else start.given[-1:],
        regularization=start.regularization,
        dependencies=start.dependencies,
        notes=reported_certificate(start).notes if start.analysis == "close_loops" else (),
        restart=start.restart,
        released=start.released,
    )
    return InitialState(system, last, request, request.first)


def repeated_at(run: Solution, t: Any) -> Solution:
    """The motion at other instants; see `Solution.at`."""
    one_design(run, "a motion is followed again for one design")
    if run.analysis != "simulate":
        raise ModelError(
            f"at follows a motion of simulate again, this is a result of {run.analysis}: give its "
            "instants to the analysis, as in t=[0.1, 0.2]"
        )
    if not run.initial_states:
        raise ModelError(
            "how this motion began is not known, as of one that was read from a file: simulate "
            "the mechanism again, with times= or every="
        )
    times = _times(run, t)
    firsts = np.array([one.first for one in run.initial_states])
    part = np.maximum(np.searchsorted(firsts, times, side="right") - 1, 0)
    records = np.empty((len(times), run.system.record_rows, 1))
    stops = stops_of(run)
    names = causes(run.system, stops)
    work = np.zeros((len(times), len(names)))
    modes = {name: [""] * len(times) for name in run.modes}
    for n in np.unique(part):
        mine = np.flatnonzero(part == n)
        ends = float(firsts[n + 1]) if n + 1 < len(firsts) else np.inf
        found, before = _again(run, run.initial_states[n], times[mine], ends)
        at = np.searchsorted(found.t, times[mine])
        records[mine] = found.record.table(slice(None))[at][:, :, None]
        for name, row in modes.items():
            for k, instant in zip(mine.tolist(), at.tolist(), strict=True):
                row[k] = found.modes[name][instant]
        for k, name in enumerate(names):
            if found.energy is not None and name in found.energy.by:
                work[mine, k] = found.energy.by[name][at] + before.get(name, 0.0)
    energy = account(run.system, records[:, :, 0], work, stops)
    record = Record([records], len(times), batch=False)
    whole = with_fields(run, t=times, record=record, energy=energy, restart=None, given=None)
    whole = with_fields(whole, modes=modes)
    return whole.take(np.arange(len(times)))


def _times(run: Solution, t: Any) -> Array:
    """The times, checked."""
    unit = run.mechanism.units.time
    try:
        times = np.asarray(t, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        raise ModelError(f"at takes times, in {unit}, not {brief(t)}") from None
    first = run.initial_states[0].first
    last = float(run.t[-1]) if len(run) else first
    wrong = times[~((times >= first) & (times <= last))]
    if not times.size or wrong.size:
        given = f"{wrong[0]:.6g} {unit} is not among them" if wrong.size else "none is given"
        raise ModelError(
            f"at takes times of the motion, from {first:.6g} to {last:.6g} {unit}: {given}"
        )
    return times


def _again(
    run: Solution, initial: InitialState, times: Array, ends: float
) -> tuple[Solution, dict[str, float]]:
    """The motion from a beginning, at these times, and the work that was done before it."""
    request = initial.request
    kept = np.flatnonzero((run.t >= initial.first) & (run.t < ends) & (run.t <= times.max()))
    known = run.t[kept[-1:]]
    wanted = np.unique(np.concatenate([times, known, request.times[-1:]]))
    enough = max(float(times.max()), float(known.max(initial=-np.inf)))

    def progress(reached: float) -> None:
        if reached > enough:
            raise KeyboardInterrupt  # by which a motion ends where it is

    state = state_of(initial.system, initial.start)
    request = replace(request, times=wanted)
    try:
        found = integrate_phases(initial.system, initial.start, state, request, progress)
    except SolveError as error:
        if not isinstance(error.solution, Solution):
            raise
        found = error.solution
    if not np.isin(times, found.t).all():
        raise SolveError(
            f"the motion from t = {initial.first:.6g}, followed again, ends before "
            f"{times.max():.6g} {run.mechanism.units.time}: controllers or loads in Python that "
            "are not functions of what they are given make another motion",
            solution=found,
        )
    before: dict[str, float] = {}
    if known.size:
        k, n = int(kept[-1]), int(np.searchsorted(found.t, known[0]))
        _check_same(run, k, found, n)
        if run.energy is not None and found.energy is not None and len(run.initial_states) > 1:
            before = {
                name: float(row[k] - found.energy.by[name][n])
                for name, row in run.energy.by.items()
                if name in found.energy.by
            }
    return found, before


def _check_same(run: Solution, k: int, found: Solution, n: int) -> None:
    """Refuse a motion that does not pass through an instant that was kept."""
    rows = slice(0, 2 * run.system.coordinates)
    ours, theirs = run.record.table(rows)[k], found.record.table(rows)[n]
    difference = float((np.abs(ours - theirs) / sizes(run, ours)).max(initial=0.0))
    if not difference <= tol.STATE_REPEATED:
        raise SolveError(
            f"the motion, followed again, is at t = {run.t[k]:.6g} {run.mechanism.units.time} "
            f"apart from what was kept, by {difference:.2g} of its size: controllers or loads in "
            "Python that are not functions of what they are given make another motion",
            solution=found,
        )


# -- Doubts by the balance of energy: the one place that decides them --------------------------
# The balance is what a motion's energy changed beside what loads and drivers gave, by a route that
# its steps did not take. A step may err by `rtol` of each coordinate, and so by that part of the
# energy that takes part, or of what the forces do along the size of the model; steps add up. Steps
# of one length have no tolerance: a motion by them can be trusted where it keeps a certain part of
# the energy. Efforts of drivers may jump where the motion does not, and the work of a jump comes
# out as well as the steps resolve it; a motion that follows drivers does not depend on that.


def energy_doubts(run: Solution, method: str, rtol: float) -> list[Doubt]:
    """A doubt where the balance of energy of a motion is out of proportion; else none.

    >>> import mbody
    >>> run = mbody.simulate(mbody.gallery.load("double_pendulum"), 1.0)
    >>> energy_doubts(run, "dop853", 1e-8)
    []
    """
    energy = run.energy
    if energy is None or not len(run):
        return []
    steps = max(1, (run.stats or {}).get("steps", 1))
    size, forces = energy.size, _force(run) * run.system.length
    part = tol.ENERGY_ROUNDING_STEP * steps
    if method in EVEN:
        part = max(part, tol.ENERGY_ERROR_FIXED_STEPS)
    else:
        part = max(part, tol.STEP_ERROR_TOLERANCES * rtol * steps)
        if any(run.released.get(one.name, math.inf) > run.t[0] for one in run.system.drivers):
            part = max(part, tol.ENERGY_ERROR_DRIVEN)
    allowed = (
        part * size + (tol.STEP_ERROR_TOLERANCES * rtol * steps + tol.ENERGY_ROUNDING_STEP) * forces
    )
    off = np.abs(energy.balance)
    beyond = np.flatnonzero(off > allowed)
    if not len(beyond):
        return []
    units = run.mechanism.units
    t, worst, unit = float(run.t[beyond[0]]), float(off.max()), units.of("torque")
    remedy = "ask for a smaller rtol, or look at what the motion runs into there"
    if method in EVEN:
        remedy = "take shorter steps"
    message = (
        f"the balance of energy is out by {worst:.3g} {unit}, of {size:.3g} {unit} that took part: "
        f"from t = {t:.6g} {units.time} on by more than steps like these err by; {remedy}"
    )
    return [Doubt("energy", message, t)]


def _force(run: Solution) -> float:
    """The greatest force of joints and drivers at an ordinary instant; of steps with impulses the
    greatest term of their equation.
    """
    if run.stepped is not None:
        return float(np.median(run.stepped.residuals[0, :, TERM]))
    first = 3 * run.system.coordinates
    primitives = run.record.table(slice(first, first + PER_PRIMITIVE * len(run.system.owners)))
    if not primitives.size:
        return 0.0
    forces = np.abs(primitives.reshape(len(run), -1, PER_PRIMITIVE)[:, :, 2:4]).max(axis=(1, 2))
    return float(np.median(forces))


@refuses_former_arguments("simulate")
@each_design
def simulate(
    model: Mechanism | System,
    until: Number | None = None,
    *,
    start: Solution | None = None,
    guess: Guesses | None = None,
    rates: Mapping[str, Number] | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    step: Number | None = None,
    instants: int | None = None,
    every: Number | None = None,
    times: PlainNumbers | None = None,
    events: Sequence[Event] | None = None,
    release: Mapping[str, Number] | None = None,
    inputs: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] | bool | None = None,
) -> Solution:
    """Motion of what is free under all loads: forward dynamics.

    M a + Φ_qᵀ λ = f with Φ(q, t) = 0, by default by an explicit Runge–Kutta method of order 8 with
    control of the error; every step ends on Φ = 0 and Φ_q v = ν to rounding. Drivers, where there
    are any, follow their laws until they are released.

    Parameters
    ----------
    model : Mechanism or System
        With any number of free motions; massless bodies are ordinary where joints guide them.
    until : float or str, optional
        The last time, met exactly; by default that of the mechanism's own `simulation`, as all
        options below.
    start : Solution, optional
        Whose last instant is the first one here: of `close_loops`, of an analysis at an instant, or
        of another `simulate`; a motion of the same mechanism in the same way goes on bit for bit as
        if it had not ended, unless there are contacts; of another model a note says what differs.
        By default the `simulation` of the mechanism says it, else the loops are closed from the
        guesses, at rest, at t = 0.
    guess, rates : mapping, optional
        As of `close_loops`: first positions, and angular velocities, of bodies by name.
    method : str, optional
        ``"dop853"`` (the default) and ``"dopri5"``, explicit, of order 8 and 5; ``"radau5"``,
        implicit, of order 5, for stiff loads; of steps of one length ``"generalized-alpha"`` (order
        2, spectral radius 0.9), ``"rattle"`` and ``"rattle4"`` (order 2 and 4, symmetric and
        symplectic: energy stays bounded over any time), ``"moreau"`` for many contacts (order 1:
        impulses, no event is located).
    rtol, atol : float
        Error of a step, as a part of each coordinate and of the model's size; `atol` is `rtol` if
        it is not given. Of ``"moreau"`` the error of impulses, as a part of the greatest.
    step : float or str, optional
        Length of the steps of methods that have one.
    instants : int, optional
        How many instants are kept, both ends included, by default 201; or
    every : float, optional
        how far they are apart, or
    times : array, optional
        which ones they are.
    events : list of Event, optional
        Zero crossings that are recorded or end the motion; by default those of the mechanism's
        `simulation`.
    release : mapping, optional
        When drivers are released, by name: from then on they have no effort.
    inputs : mapping, optional
        Histories of inputs by name: a number or text such as ``"2 N*m"`` or ``"3 N*m*sin(2 rad/s
        *t)"``, a law of time (a `Table` with ``interpolation="hold"`` for a sampled signal), a
        function of time, a pair (t, u) of rows joined by straight lines, or one row spread evenly
        over the motion.
    progress : callable or bool, optional
        Called with the time reached, now and then; True shows on standard error how far it is.

    Returns
    -------
    Solution
        Motion, reactions, efforts at every instant; `energy`, the account of energy with its
        balance; `events`, an `EventRecord` each; `stats`, the counts of the steps; `status`.

    Raises
    ------
    ModelError
        For times or a start that do not fit the mechanism.
    SolveError
        Where loops do not close, the motion is not determined, a user's function fails, or the
        steps vanish; it carries what was computed before.

    Notes
    -----
    Singular positions (change points, dead centres under inertia) are passed at any tolerance;
    redundant joints are ordinary. Every step is checked for other branches of the constraints: a
    bend in which one passes near is resolved, a change point is passed by the smooth continuation
    with a note, and what cannot be made certain is a doubt, as are a balance of energy out of
    proportion to the tolerance and an inertia that vanishes for want of masses (`doubts`);
    `checks.branch` reports how near the motion came to a singular position, and when. Ctrl-C
    leaves what was done, with a status that says so.
    Events are looked for by values and rates at four samples a step and 400 of the motion, or more:
    two crossings between two of them are found by the extremum that lies between them. Where a
    function varies faster more samples are taken, four times as many of the motion; a note says up
    to which rate crossings are found of one that varies faster still.
    Steps end at corners of tables and of formulas of time (`abs`, `min`, `max`, `clamp`, `step`,
    `sign`), and at the peaks of pulses in formulas that are short beside the motion; of Python
    functions at the `corners` that are given, else a note says how far apart they were evaluated.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(
    ...     mbody.Body("bob", mass=1.0, cg=(1.0, 0.0), guess=0.0),
    ...     mbody.Revolute("O", "ground", "bob"),
    ...     mbody.Gravity("gravity", y=-9.81),
    ... )
    >>> run = mbody.simulate(swing, 2.0)
    >>> float(abs(run.energy.balance).max()) < 1e-6
    True
    """
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise ModelError(
            f"progress must be True or a function of the time reached, not {brief(progress)}"
        )
    system = _as_system(model, method)
    last, errors = last_time(system, until), tolerances(system, rtol, atol)
    if inputs:
        # before the first instant is found: drivers may follow inputs
        first = 0.0 if start is None else float(start.t[-1])
        system = with_inputs(system, inputs, first, last)
    closed_system, system = system, with_contacts_of_joints(system)
    start = first_instant_with_contacts(closed_system, system, start, guess, rates)
    state, notes = state_of(system, start), other_model_note(system, start)
    request = motion_request(
        system,
        state[0],
        last,
        errors,
        method=method,
        step=step,
        kept=(instants, every, times),
        events=events,
        release=release,
    )
    if progress is True:
        from mbody.analysis.dynamics.interruptions import progress_display

        progress = progress_display(last)
    try:
        run = integrate_phases(system, start, state, request, progress or None)
    except SolveError as error:
        if isinstance(error.solution, Solution):
            error.solution = certified_motion(error.solution, request.settings)
            for one in error.solution.doubts:
                if one.kind in ("validity", "derivative"):
                    said = f"{error}; {one.message}"
                    raise SolveError(said, one.elements[0], error.solution) from None
        raise
    run = certified_motion(run, request.settings)
    return with_fields(
        run,
        initial_states=(motion_start(system, start, request),),
        notes=(*reported_certificate(run).notes, *notes),
    )


def _as_system(model: Mechanism | System, method: str | None) -> System:
    """The system of a model; its groups of contacts stay groups where the method takes them."""
    if isinstance(model, Mechanism):
        own = model.simulation
        chosen = own.method if method is None and own is not None else method
        return assemble(model, groups=chosen == "moreau")
    return as_system(model)


def first_instant_with_contacts(
    closed_system: System,
    system: System,
    start: Solution | None,
    guess: Guesses | None,
    rates: Mapping[str, Number] | None,
) -> Solution:
    """The first instant with the joints that can separate closed, as in `closed_system`; where what
    is given does not agree with that, with them as they are in `system`.
    """
    if not any(joint.can_separate for joint in closed_system.mechanism.joints):
        return first_instant(system, start, guess, rates)
    try:
        found = first_instant(closed_system, start, guess, rates)
    except (ModelError, SolveError):
        return first_instant(system, start, guess, rates)
    own = closed_system.mechanism.simulation
    if start is None and own is not None and not begins_so(found, own):
        return first_instant(system, start, guess, rates)
    return found


def first_instant(
    system: System,
    start: Solution | None,
    guess: Guesses | None,
    rates: Mapping[str, Number] | None,
) -> Solution:
    """Whose last instant a motion begins with: `start`, else what the mechanism's own `simulation`
    says, else the loops closed from guesses.
    """
    own = system.mechanism.simulation
    if start is not None:
        if guess is not None or rates is not None:
            raise ModelError("start says positions and rates: leave out guess and rates")
        return start
    if own is not None and guess is None and rates is None:
        return initial_state_of(system, own)
    return close_loops(system, guess=guess, rates=rates)


def certified_motion(
    run: Solution, settings: IntegrationSettings, beyond: Sequence[Doubt] | None = None
) -> Solution:
    """The motion with notes and doubts of its description, its laws and its energy; `beyond`: of
    tables that it left, where these are known already.
    """
    system = run.system
    notes, added = reported_certificate(run).notes, list[str]()
    if system.has_limited_laws:
        from mbody.analysis.driven.law_doubts import gap_notes, law_doubts

        added = [note for note in gap_notes(system) if note not in notes]
    found = with_fields(run, notes=(*notes, *added)) if added else run
    energy = energy_doubts(found, settings.method, settings.rtol)
    if beyond is None:
        beyond = law_doubts(found, _near(found, energy)) if system.has_limited_laws else []
    return doubted(found, [*beyond, *energy])


def _near(run: Solution, doubts: Sequence[Doubt]) -> list[float]:
    """Times near those at which doubts begin, where laws are to be looked at."""
    part = float(np.ptp(run.t)) / max(len(run), 2)
    at = [one.t for one in doubts if one.t is not None]
    return [min(max(t + part * x, run.t[0]), run.t[-1]) for t in at for x in AROUND]


#: Places around such a time, in distances of instants.
AROUND = (-1.71, -0.83, -0.37, 0.41)
