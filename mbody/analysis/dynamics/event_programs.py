"""Events of users as the kernel of steps takes them: programs on what is kept, or Python."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from mbody.core.callbacks import raise_failure, register, release
from mbody.kernels.number_program import NumberProgram
from mbody.kernels.step_state import PROGRESS
from mbody.kernels.watched_events import WatchedEvents, python_program, watched_events
from mbody.model.driver import DRIVEN
from mbody.model.simulation import Event
from mbody.model.study import Measure
from mbody.quantities import parse
from mbody.solution.measures import evaluate_measure
from mbody.solution.traced_instant import recorded_instant
from mbody.solution.tracing import of_what_is_read
from mbody.system.system import System

#: Programs of measures, and the rows that they read, by their systems.
_programs: weakref.WeakKeyDictionary[
    System, dict[tuple[Measure, ...], tuple[NumberProgram, np.ndarray] | None]
] = weakref.WeakKeyDictionary()


#: Events, their measures, which have exact rates, and arguments of formulas that jump.
EveryEvent = tuple[Sequence[Event], Sequence[Measure], np.ndarray, Sequence[int]]
#: Quantities of a motion that positions, velocities and accelerations carry on.
CARRIED = {"x", "y", "angle", "vx", "vy", "omega", *DRIVEN}


def has_exact_rates(measure: Measure) -> bool:
    """Whether a quantity is made of positions, velocities and laws of time alone."""
    names = parse(measure.of).names
    return all(name.rpartition(".")[2] in CARRIED for name in names if "." in name)


def watched_by_program(system: System, every: EveryEvent) -> WatchedEvents | None:
    """Events for the kernel; None where a measure of them is no list of operations."""
    known, key = _programs.setdefault(system, {}), tuple(every[1])
    if not key:
        return _watched(python_program(0, 0), np.zeros(0), False, every)
    if key not in known:
        known[key] = _program(system, key)
    if (found := known[key]) is None:
        return None
    (program, read), rows = found, system.record_rows
    own = program.replaced(slots=program.slots.copy())
    return _watched(own, read[read < rows], rows in read, every)


def _watched(
    program: NumberProgram, row: np.ndarray, timed: bool, every: EveryEvent
) -> WatchedEvents:
    events, _, rated, jumps = every
    E, count = watched_events(program, row, timed, rated, PROGRESS, jumps), len(events)
    E.direction[:count] = [one.direction for one in events]
    E.stops[:count] = [one.stop for one in events]
    return E


class EventMotion(Protocol):
    """A motion whose events Python finds."""

    system: System

    def values_at(self, t: float, record: np.ndarray) -> np.ndarray:
        """Values (events,) by a record (rows, 1)."""


class PythonEvents:
    """Events of a motion that Python finds for the kernel, from records and the time."""

    def __init__(self, motion: EventMotion, every: EveryEvent) -> None:
        self.motion, self.every = weakref.ref(motion), every

    @functools.cached_property
    def watched(self) -> WatchedEvents:
        """Events for the kernel."""
        motion = self.motion()
        assert motion is not None
        rows, count = motion.system.record_rows, len(self.every[0])
        E = _watched(python_program(rows + 1, count), np.arange(rows), True, self.every)
        E.rated[:] = 0  # it is slow
        self.handle = E.handle[0] = register(functools.partial(_evaluate, self.motion))
        weakref.finalize(self, release, self.handle)
        return E

    def raise_failure(self) -> None:
        """Raise what Python raised in the kernel; it is called again from now on."""
        self.watched.handle[0] = self.handle
        raise_failure(self.handle)


def _evaluate(motion: Callable[[], EventMotion | None], x: np.ndarray, values: np.ndarray) -> None:
    """Values of events by a record and the time."""
    if (found := motion()) is not None:
        values[:] = found.values_at(float(x[-1]), x[:-1, None])


def _program(
    system: System, measures: Sequence[Measure]
) -> tuple[NumberProgram, np.ndarray] | None:
    """The program of measures, and which rows of a record it reads, and the time after these."""
    recording, instant = recorded_instant(system)
    try:
        targets = [evaluate_measure(instant, measure)[0] for measure in measures]
        return of_what_is_read(recording.program(targets))
    except Exception:  # whatever Python does with a number that is none
        return None
