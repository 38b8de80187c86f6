"""Interruptions at set times of a motion: inputs that jump, samples of controllers, corners of
laws.

Steps end there. Inputs that jump keep their value in a signal of their own until the next time, so
that no step sees two values.
"""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import functools
import math
import sys
import time
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, cast

import numpy as np

from mbody.core.callbacks import raise_failure, register, release
from mbody.core.tolerances import ENERGY_IMPACT, TIMES_SAME_SAMPLE
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.layout import Layout, Work, integers
from mbody.kernels.number_program import NumberProgram
from mbody.kernels.step_state import PROGRESS, TIME
from mbody.laws import Expression, Law, Table
from mbody.laws.measured_formula import MeasuredFormula
from mbody.model.driver import DRIVEN
from mbody.model.simulation import Event, Measure
from mbody.model.states import Controller, Quantity, State, expanded
from mbody.quantities import parse
from mbody.solution.doubts import Doubt
from mbody.solution.histories import Record
from mbody.solution.measures import evaluate_measure
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import Present, Read, of_what_is_read, recorded_instant
from mbody.system.rank import dense
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.kernels.watched_events import WatchedEvents

# -- Events of users as the kernel of steps takes them: programs on what is kept, or Python ----

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
        return _watched(_unread(0, 0), np.zeros(0), False, every)
    if key not in known:
        known[key] = _program(system, key)
    if (found := known[key]) is None:
        return None
    (program, read), rows = found, system.record_rows
    own = program.replaced(slots=program.slots.copy())
    return _watched(own, read[read < rows], rows in read, every)


def _unread(rows: int, count: int) -> NumberProgram:
    from mbody.kernels.watched_events import python_program

    return python_program(rows, count)


def _watched(
    program: NumberProgram, row: np.ndarray, timed: bool, every: EveryEvent
) -> WatchedEvents:
    from mbody.kernels.watched_events import watched_events

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
        E = _watched(_unread(rows + 1, count), np.arange(rows), True, self.every)
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


# -- Progress of a long motion, on one line of standard error ----------------------------------

#: Seconds after which a long run shows how far it is, and between two such lines.
PATIENCE, BETWEEN = 1.0, 0.2
#: Signs of the bar.
WIDTH = 32


def progress_display(until: float) -> Callable[[float], None]:
    """Progress display: a function of the time reached, silent for the first seconds, cleared at
    the last time.
    """
    begun = last = time.monotonic()
    first: float | None = None

    def show(t: float) -> None:
        nonlocal last, first
        now = time.monotonic()
        first = t if first is None else first
        if t >= until and last > begun:
            _over(f"\r{'':{WIDTH + 40}}\r")
        elif now - begun > PATIENCE and now - last > BETWEEN:
            last = now
            done = (t - first) / (until - first) if until > first else 1.0
            _over(f"\r{bar(done)}  t = {t:.6g} of {until:.6g}  ")

    return show


def counted(what: str) -> Callable[[int, int], None]:
    """Progress display: a function of the number done and of the total, silent for the first
    seconds, in a terminal and in a notebook.
    """
    begun = last = time.monotonic()

    def show(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done >= total and last > begun:
            _over(f"\r{'':{WIDTH + 40}}\r")
        elif now - begun > PATIENCE and now - last > BETWEEN:
            last = now
            _over(f"\r{bar(done / total)}  {done} of {total} {what}  ")

    return show


def _over(text: str) -> None:
    if sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print(text, end="", file=sys.stderr, flush=True)


def bar(done: float) -> str:
    """A part as a bar.

    >>> bar(0.5)
    '████████████████················  50 %'
    """
    full = round(WIDTH * min(max(done, 0.0), 1.0))
    return f"{'█' * full}{'·' * (WIDTH - full)} {100.0 * done:3.0f} %"


Array = np.ndarray

# -- Readings of controllers: measures compiled when they are first read -----------------------


def solution_of_records(
    system: System, t: Array, records: Array, regularization: float = 0.0
) -> Solution:
    """Records (instants, rows, 1) of a motion at times (instants,) as a result, without what the
    motion says beside them.
    """
    kept = Record([records], len(t), batch=False)
    return Solution(system, "simulate", t, kept, None, regularization=regularization)


class ControllerReadings:
    """Readings of the present instant of a motion."""

    def __init__(
        self,
        system: System,
        y: Array,
        state: Array,
        record: Callable[[], Array],
        regularization: float,
    ) -> None:
        self.system, self.state, self.record = system, state, record
        self.regularization = regularization
        slots = memoryview(state.data)
        self.present = Present(
            system, memoryview(y.data), slots, lambda: memoryview(record().reshape(-1).data)
        )
        self._readers: dict[str, list[Read]] = {}

    def of(self, controller: Controller) -> list[float]:
        """Measured values that a controller reads at the present instant."""
        found = self._readers.get(controller.name)
        if found is None:
            measure = self.present.measure
            found = [measure(text, self._instant) for text in controller.reads]
            self._readers[controller.name] = found
        return [read() for read in found]

    def _instant(self) -> Solution:
        """The present instant as a result."""
        t, records = np.array([self.state[TIME]]), self.record()[None].copy()
        return solution_of_records(self.system, t, records, self.regularization)


# -- Times at which driver rates jump, as at the points of a table in straight lines -----------
# There the driver gives an impulse μ, and velocities jump with it: M (v⁺ − v⁻) = Gᵀ μ, G v⁺ = ν⁺.
# Its work is μ (ν⁻ + ν⁺)/2. Steps end just before such a time, so that no step sees two rates.


def jump_times(system: System, first: float, until: float, located: bool = False) -> Array:
    """Times after `first`, up to `until`, at which the rate of a driver may jump, ascending:
    corners of its own law, or of inputs that its formula may follow; without those of formulas
    where they are located by others.
    """
    machine = system.mechanism
    owners: tuple[Any, ...] = machine.drivers
    if any(isinstance(getattr(one, "law", None), MeasuredFormula) for one in owners):
        owners += machine.inputs
    beyond = float(np.nextafter(until, np.inf))
    laws = laws_with_corners(system, owners)
    kept = (law for law in laws if not (located and isinstance(law, Expression)))
    found = [law.rate_jumps(first, beyond) for law in kept]
    return np.unique(np.concatenate([np.empty(0), *found]))


def works_of_drivers(system: System, work: Work, momentum: Array, nu: Array) -> dict[str, float]:
    """Work of the impulses of drivers, by name, where velocities jump at the position in the
    workspace. `momentum` (coordinates,), `nu` (rows,).

    M Δv less the impulses of what else acts, that is Gᵀ μ of the rows that hold.
    """
    if not system.drivers:
        return {}
    scale = system.coordinate_units
    rows = dense(system, work)[1]
    works = np.linalg.lstsq(rows.T, momentum * scale, rcond=None)[0] * nu
    owners = [system.owners[int(e)][0].name for e in system.row_table[0]]
    found = dict.fromkeys((driver.name for driver in system.drivers), 0.0)
    for name, part in zip(owners, works, strict=True):
        if name in found:
            found[name] += float(part)
    return found


def jump_doubt(
    system: System, t: float, change: tuple[float, float], works: Mapping[str, float]
) -> Doubt | None:
    """A doubt where a jump of velocities changes the energy by more or less than drivers do;
    `change`: what it gains, and what is rounding of that.
    """
    (gained, rounding), given = change, sum(works.values())
    allowed = rounding + ENERGY_IMPACT * sum(map(abs, works.values()))
    if abs(gained - given) <= allowed:
        return None
    units = system.mechanism.units
    energy = units.of("torque")
    message = (
        f"at t = {t:.6g} {units.time} rates of drivers jump, which changes the energy by "
        f"{gained:.3g} {energy}, their impulses by {given:.3g} {energy}: do not rely on the "
        "motion from there on, and look at bodies without mass or inertia"
    )
    return Doubt("energy", message, t, tuple(works))


#: What measures the quantities that a controller reads, at the present instant; whether inputs have
#: changed since it did so last.
Reader = Callable[[Controller, bool], "list[float]"]

#: Samples of a motion, at most.
MOST_SAMPLES = 1e8
#: Steps end so many units in the last place before rates of drivers jump: t + h is rounded by one.
ULPS = 4


@dataclass
class SampledState:
    """A controller at work.

    `function`: Its own copy of the function, with its memory.
    `anchor`: The time of its first sample.
    `count`: Samples taken.
    `pending`: Values that are still to be set, with the time when.
    """

    controller: Controller
    function: Any
    anchor: float
    count: int = 0
    pending: list[tuple[float, dict[str, float]]] = field(default_factory=list)

    def next(self) -> float:
        """The time of its next sample or change."""
        sample = self.anchor + self.count * self.controller.every
        return min([sample, *(t for t, _ in self.pending[:1])])

    def copied(self) -> SampledState:
        """A copy with its own function state and pending samples."""
        return dataclasses.replace(
            self, function=copy.deepcopy(self.function), pending=list(self.pending)
        )


def hold_inputs(system: System) -> dict[str, int]:
    """Inputs that keep their value between set times, with the signal row of each: those of a
    table that holds its values, and those that controllers set.
    """
    machine, rows = system.mechanism, system.input_rows
    by_controllers = {name for one in machine.controllers for name in one.sets}
    return {
        one.name: int(row)
        for one, row in zip(machine.inputs, rows, strict=True)
        if one.name in by_controllers or holds(one.value)
    }


def holds(law: Any) -> bool:
    """Whether it is a table that holds its values."""
    return isinstance(law, Table) and law.interpolation == "hold"


def without_hold(layout: Layout, rows_by_name: Mapping[str, int]) -> Layout:
    """The layout whose kernels leave the signals of held inputs as they are."""
    if not rows_by_name:
        return layout
    rows = set(rows_by_name.values())
    kept = np.array([row not in rows for row in layout.signal_row], dtype=bool)
    varying = int(kept[: layout.varying].sum())
    return layout.replaced(
        signal_law=integers(layout.signal_law[kept]),
        signal_row=integers(layout.signal_row[kept]),
        varying=varying,
        # drivers that are held follow their formulas no more
        driver_steps=0 if rows & set(layout.driver_row.tolist()) else layout.driver_steps,
    )


class Interruptions:
    """The set times of one motion. `located`: Whether jumps in formulas, and corners of what
    drivers follow, are located by others, and no set times.
    """

    def __init__(
        self, system: System, work: Work, first: float, until: float, located: bool = False
    ) -> None:
        self.system, self.work, self.located = system, work, located
        machine = system.mechanism
        self.hold = hold_inputs(system)
        by_controllers = {name for one in machine.controllers for name in one.sets}
        self.first, self.known = first, until if until < math.inf else first
        self.corners = _corners(system, first, self.known, located)
        #: Those at which rates of drivers may jump: steps end just before them.
        self.jumps = jump_times(system, first, self.known, located)
        self.tables = {
            one.name: one.value
            for one in machine.inputs
            if one.name in self.hold and one.name not in by_controllers
        }
        self.sampled = [
            SampledState(_with_times_of(system, one), copy.deepcopy(one.function), first)
            for one in machine.controllers
        ]
        for one in self.sampled:
            _check_samples(one.controller, first, until, machine.units.time)
        for given in machine.inputs:
            if given.name in self.hold:
                self._set(given.name, input_value(given.value, given.name, system, first))

    @property
    def any(self) -> bool:
        """Whether there are any."""
        return bool(self.sampled or self.corners.size or self.jumps.size or self.tables)

    def look_until(self, until: float) -> None:
        """Find the corners of laws up to there, where they are not known yet, and as far beyond as
        it is from the beginning, so that they are seldom looked for.
        """
        if until > self.known:
            until += until - self.first
            self.known = until
            self.corners = _corners(self.system, self.first, until, self.located)
            self.jumps = jump_times(self.system, self.first, until, self.located)

    def jump_after(self, t: float) -> float | None:
        """The time at which rates of drivers may jump, where t is the last one before it."""
        jump = _first_after(self.jumps, t)
        return jump if self._just_before(jump) <= t else None

    def _just_before(self, jump: float) -> float:
        """Where the step before a jump ends: no rounding of t + h meets it from there."""
        if jump == math.inf:
            return jump
        return float(jump - ULPS * np.spacing(max(abs(jump), abs(self.first))))

    def due(self, t: float) -> bool:
        """Whether t is a set time, at which nothing was done yet, or a corner."""
        if any(one.next() <= t + TIMES_SAME_SAMPLE * one.controller.every for one in self.sampled):
            return True
        if self.jump_after(t) is not None:
            return True
        place = int(np.searchsorted(self.corners, t))
        return place < self.corners.size and bool(self.corners[place] == t)

    def next(self, t: float) -> float:
        """The first set time after t; infinite where there is none."""
        jump = self._just_before(_first_after(self.jumps, t))
        found = min(_first_after(self.corners, t), jump)
        for one in self.sampled:
            found = min(found, one.next())
        return found

    def at(self, t: float, read: Reader) -> bool:
        """Do what is due at a set time; whether inputs changed."""
        differs = False
        for name, law in self.tables.items():
            differs = self._set(name, float(law(t))) or differs
        for one in self.sampled:
            close = TIMES_SAME_SAMPLE * one.controller.every
            if one.anchor + one.count * one.controller.every <= t + close:
                one.count += 1
                values = self._called(one, t, read(one.controller, differs))
                one.pending.append((t + one.controller.delay, values))
            while one.pending and one.pending[0][0] <= t + close:
                for name, value in one.pending.pop(0)[1].items():
                    differs = self._set(name, value) or differs
        return differs

    def inputs(self) -> dict[str, float]:
        """The values of the held inputs."""
        return {name: float(self.work.signal[row, 0]) for name, row in self.hold.items()}

    def restore(self, values: Mapping[str, float], sampled: Sequence[SampledState]) -> None:
        """Go on from what a motion of the same controllers left."""
        if [one.controller for one in sampled] != [one.controller for one in self.sampled]:
            return
        self.go_on_from(values, sampled)

    def go_on_from(self, values: Mapping[str, float], sampled: Sequence[SampledState]) -> None:
        """Restores input values and sampled states, with copies of the controllers' functions."""
        for name, value in values.items():
            self._set(name, value)
        self.sampled = [one.copied() for one in sampled]

    def _set(self, name: str, value: float) -> bool:
        """Set a held input; whether it changes."""
        row = self.hold[name]
        differs = bool(self.work.signal[row, 0] != value)
        self.work.signal[row, 0] = value
        return differs

    def _called(self, one: SampledState, t: float, reads: list[float]) -> dict[str, float]:
        """Values that a controller sets at time t, checked."""
        controller, unit = one.controller, self.system.mechanism.units.time
        when = f"controller '{controller.name}' at t = {t:.6g} {unit}"
        try:
            found = one.function(t, *reads)
        except (KeyboardInterrupt, SystemExit):
            raise
        except Exception as error:
            raise SolveError(
                f"{when} raised {type(error).__name__}: {error}", controller.name
            ) from error
        values = dict(_by_name(controller, found, when))
        for name, value in values.items():
            if not math.isfinite(value):
                raise SolveError(
                    f"{when} sets '{name}' to {value}, which is no finite number: look at what it "
                    "computes",
                    controller.name,
                )
        return values


def _by_name(controller: Controller, found: Any, when: str) -> Iterator[tuple[str, float]]:
    """Names and values of the inputs that a controller returned."""
    names = controller.sets
    if isinstance(found, Mapping):
        strange = [name for name in found if name not in names]
        if strange:
            raise SolveError(
                f"{when} sets {brief(strange[0])}, which is not among what it sets "
                f"({', '.join(names)})",
                controller.name,
            )
        pairs = list(found.items())
    elif type(found) is float and len(names) == 1:  # the usual answer, read fast
        pairs = [(names[0], found)]
    else:
        try:
            row = np.asarray(found, dtype=float).reshape(-1)
        except (TypeError, ValueError):
            raise SolveError(
                f"{when} returned {brief(found)}, where numbers for {', '.join(names)} are wanted",
                controller.name,
            ) from None
        if row.size != len(names):
            raise SolveError(
                f"{when} returned {row.size} numbers, it sets {len(names)}: {', '.join(names)}",
                controller.name,
            )
        pairs = list(zip(names, row.tolist(), strict=True))
    for name, value in pairs:
        yield name, float(value)


def _with_times_of(system: System, controller: Controller) -> Controller:
    """The controller with the sample time and the delay that the numbers of the system are."""
    every, delay = (float(system.values[f"{controller.name}.{key}"]) for key in ("every", "delay"))
    if (every, delay) == (controller.every, controller.delay):
        return controller
    return dataclasses.replace(controller, every=every, delay=delay)


def _check_samples(controller: Controller, first: float, until: float, unit: str) -> None:
    """Refuse a sample time that is absurdly short."""
    count = (until - first) / controller.every if until < math.inf else 0.0
    if count > MOST_SAMPLES:
        raise ModelError(
            f"controller '{controller.name}' samples every {controller.every:g} {unit}, that is "
            f"{count:.2g} times in this motion: give a longer sample time (at most "
            f"{MOST_SAMPLES:.0e} samples)",
            controller.name,
        )


def laws_with_corners(system: System, elements: Iterable[Any]) -> Iterator[Law]:
    """Laws of time that may have corners, with the numbers that are in force; of formulas of
    measured quantities the parts that follow from time alone.
    """

    def law_of(one: Quantity) -> MeasuredFormula:
        return in_force(system, one.formula, f"{one.name}.formula")

    machine = system.mechanism
    for element in elements:
        for key, of in _law_fields(cast(Any, type(element))):
            law, name = getattr(element, key), f"{element.name}.{key}"
            if isinstance(law, MeasuredFormula):
                whole = expanded(in_force(system, law, name), machine, law_of)
                parts = whole.laws_of_time(machine.curves)
                yield from (part for part in parts if part.may_have_corners)
            elif of == "time" and isinstance(law, Law) and law.may_have_corners:
                yield in_force(system, law, name)


def timed_elements(system: System) -> tuple[Any, ...]:
    """Elements with laws of time."""
    machine = system.mechanism
    return (
        *machine.joints,
        *machine.drivers,
        *machine.loads,
        *machine.inputs,
        *machine.states,
    )


def has_corners(system: System) -> bool:
    """Whether laws of time may have corners."""
    return next(laws_with_corners(system, timed_elements(system)), None) is not None


def has_short_pulses(system: System, first: float, until: float) -> bool:
    """Whether corners of formulas of time are close together, so that steps that do not end there
    may miss what is between.
    """
    laws = laws_with_corners(system, timed_elements(system))
    found = [law.corners_between(first, until) for law in laws if isinstance(law, Expression)]
    gaps = np.diff(np.unique(np.concatenate([np.empty(0), *found])))
    if not len(gaps):
        return False
    from mbody.laws.steep_places import SHORT

    apart = gaps > 2 * ULPS * np.spacing(max(abs(first), abs(until)))
    return bool((gaps[apart] < SHORT * (until - first)).any())


L = TypeVar("L", bound=Law)


def in_force(system: System, law: L, name: str) -> L:
    """A law of that name with the numbers that the system has."""
    own = law.numbers()
    plain = set(own) == {"value"}
    numbers = {k: float(system.values[name if plain else f"{name}.{k}"]) for k in own}
    return cast(L, law.with_numbers(numbers))


@functools.cache
def _law_fields(kind: Any) -> tuple[tuple[str, str], ...]:
    """Fields of an element that are laws, with what they are laws of: to look for them took a tenth
    of a short motion of many bodies.
    """
    given = dataclasses.fields(kind)
    found = [(one.name, one.metadata["of"]) for one in given if "law" in one.metadata]
    return (*found, ("rate", "time")) if issubclass(kind, State) else tuple(found)


def _first_after(times: Array, t: float) -> float:
    """The first of ascending times after t; infinite where there is none."""
    place = int(np.searchsorted(times, t, side="right"))
    return float(times[place]) if place < times.size else math.inf


def _corners(system: System, first: float, until: float, located: bool) -> Array:
    """Times within a motion at which laws of time have corners, ascending."""
    found = [np.empty(0)]
    for element in timed_elements(system):
        for law in laws_with_corners(system, (element,)):
            if not (located and isinstance(law, Expression)):
                found.append(law.corners_between(first, until))
                continue
            from mbody.laws.steep_places import steep_places

            places = steep_places(law, first, until)
            found.append(places.pulses)
            if element.role == "load":
                found.append(places.kinks)
    return np.unique(np.concatenate(found))


def input_value(law: Any, name: str, system: System, t: float) -> float:
    """The value of an input's law at a time."""
    return float(in_force(system, law, f"{name}.value")(t))
