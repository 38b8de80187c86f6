"""Events of users as the kernel of steps takes them: programs of numbers on what is kept."""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np

from mbody.kernels.number_program import NumberProgram
from mbody.kernels.step_state import PROGRESS
from mbody.kernels.watched_events import WatchedEvents, no_program, watched_events
from mbody.model.simulation import Event
from mbody.model.study import Measure
from mbody.solution.measures import evaluate_measure
from mbody.solution.traced_instant import TracedInstant, TracedRecord
from mbody.solution.tracing import Recording, Rule, of_what_is_read
from mbody.system.system import System

#: Programs of measures, and the rows that they read, by their systems.
_programs: weakref.WeakKeyDictionary[
    System, dict[tuple[Measure, ...], tuple[NumberProgram, np.ndarray] | None]
] = weakref.WeakKeyDictionary()


def watched_by_program(
    system: System, events: Sequence[Event], measures: Sequence[Measure], rated: Sequence[bool]
) -> WatchedEvents:
    """Events for the kernel; none where a measure of them is no list of operations. `rated`: which
    are made of positions, velocities and laws of time alone.
    """
    known, key = _programs.setdefault(system, {}), tuple(measures)
    if key not in known:
        known[key] = _program(system, measures) if measures else None
    found = known[key]
    if found is None:
        none = np.zeros(0, dtype=np.int64)
        return watched_events(no_program(), none, False, none, PROGRESS)
    (program, read), rows = found, system.record_rows
    own = program.replaced(slots=program.slots.copy())
    E = watched_events(own, read[read < rows], rows in read, np.array(rated), PROGRESS)
    E.direction[:] = [one.direction for one in events]
    E.stops[:] = [one.stop for one in events]
    return E


def _program(
    system: System, measures: Sequence[Measure]
) -> tuple[NumberProgram, np.ndarray] | None:
    """The program of measures, and which rows of a record it reads, and the time after these."""
    rows = system.record_rows
    inputs = {f"row {n}": Rule(0.0) for n in range(rows)} | {"time": Rule(0.0)}
    recording = Recording(inputs)
    *traced, time = recording.inputs.values()
    instant = TracedInstant(
        system=system,
        analysis="simulate",
        t=time,  # type: ignore[arg-type]
        record=TracedRecord(traced),  # type: ignore[arg-type]
        given=None,
    )
    try:
        targets = [evaluate_measure(instant, measure)[0] for measure in measures]
        targets = [one[()] if isinstance(one, np.ndarray) else one for one in targets]
        return of_what_is_read(recording.program(targets))
    except Exception:  # whatever Python does with a number that is none
        return None
