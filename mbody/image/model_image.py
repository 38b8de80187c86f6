"""The image of a model: the memory of its assembled mechanism with all calls of its analyses."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.analysis.contact.unilateral import has_modes, with_contacts_of_joints
from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import TimeGrid, time_grid
from mbody.analysis.dynamics.active_modes import ActiveModes
from mbody.analysis.dynamics.branch_passage import singular_start
from mbody.analysis.dynamics.contact_log import fit_contacts
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.interruptions import has_corners, holds
from mbody.analysis.dynamics.options import MotionRequest, last_time, motion_request, tolerances
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import initial_state_of, state_of
from mbody.analysis.position.assembly_analysis import as_system, check_determined, closed, rounding
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core.recorded_numbers import Untraceable
from mbody.core.selection import source_hash
from mbody.errors import ModelError, SolveError
from mbody.image.arena import FORMAT, INPUT, MEASURE, NUMBER, STATE, Arena, ImageEntry
from mbody.kernels.advance import UnilateralMotion
from mbody.kernels.continuation import (
    BY_DRIVER,
    BY_INSTANT,
    BY_TIME,
    PROGRESS,
    DrivenPath,
    PathOutput,
)
from mbody.kernels.force_programs import open_forces_memory
from mbody.kernels.image_calls import MotionStart
from mbody.kernels.number_program import NumberProgram
from mbody.kernels.step_state import Outputs
from mbody.laws import Constant
from mbody.model.element import Element, Numbers, listed
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named, number_in
from mbody.model.simulation import INSTANTS, METHODS
from mbody.quantities import Scope, evaluate, parse_unit
from mbody.quantities.units import DIMENSIONS, Dimension, name_of, unit_system
from mbody.quantities.units import NUMBER as DIMENSIONLESS
from mbody.solution.histories import auxiliary_history, ends
from mbody.solution.measures import evaluate_measure, quantity
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.solution.traced_instant import ORDER, Recording, Rule, TracedInstant, TracedRecord
from mbody.system.formula_steps import driver_inputs
from mbody.system.system import System, polar_points

# -- Which numbers of a mechanism can be changed in its image, and the program that makes the
#    numbers of the kernels from them ----------------------------------------------------------

FIXED = "it is used in a table, a program, a guess or g, which an image cannot change"
BEGINNING = "a motion begins there: the start of the state is set by the name of the state"
SIZE = "the error of a state is relative to it, which an image cannot change"


@dataclass
class Changeable:
    """The changeable numbers of a system.

    `rules`: Value and rule of every number that an image takes, by dotted name: its inputs in
      order.
    `dependent`: Of every number that follows from parameters, what it follows from.
    `fixed`: Of every other number why it cannot be changed.
    """

    system: System
    rules: dict[str, Rule] = field(default_factory=dict)
    dependent: dict[str, frozenset[str]] = field(default_factory=dict)
    fixed: dict[str, str] = field(default_factory=dict)

    def values(self, inputs: dict[str, Any]) -> dict[str, Any]:
        """All numbers of the system by dotted name; those that an image takes are `inputs`."""
        system = self.system
        parameters = system.mechanism.parameters
        found = {**system.values, **inputs}
        own = {name: found[name] for name in parameters if name not in self.dependent}
        scope = parameters.scope(own)
        for name in self.dependent:
            if name in parameters:
                found[name] = scope.names[name].value
            elif self.dependent[name] & inputs.keys():
                found[name] = system.formulas[name].value(scope)
        return found

    def not_changeable(self) -> dict[str, str]:
        """Why each of the other numbers cannot be changed."""
        made = {
            name: f"it follows from {listed(sorted(sources))}"
            for name, sources in self.dependent.items()
        }
        return self.fixed | made

    def program(self) -> NumberProgram:
        """From the numbers to the rows of par, then of mass; and what must be finite besides, for
        the numbers that follow to be allowed.
        """
        recording = Recording(self.rules)
        values = self.values(dict(recording.inputs))
        par, mass = self.system.kernel_numbers(values)
        checks = []
        for name in self.dependent:
            value, sign = values[name], self.system.rule(name)[0]
            # roots and logarithms of what is not allowed are no numbers
            checks.append(value)
            if sign:
                checks.append((np.log if sign == "positive" else np.sqrt)(value))
        return recording.program([*par, *mass, *checks])


def changeable_numbers(system: System) -> Changeable:
    """The numbers of a system that its image takes: those of which all that the kernels need of
    each element can be recorded.
    """
    machine = system.mechanism
    parameters = machine.parameters
    found = Changeable(system)
    found.fixed = {name: FIXED for name in sorted(machine.fixed_parameters)}
    own = {state.start_number: BEGINNING for state in machine.states}
    own |= {f"{state.name}.size": SIZE for state in machine.states}
    own = {name: why for name, why in own.items() if name in system.values}
    found.fixed |= own
    free = {*own, *input_numbers(system)}
    for name, formula in system.formulas.items():
        if name in free:  # a number of its own, whatever it was made of
            continue
        found.dependent[name] = _parameters_of(system, parameters.used_by(formula))
    for joint in machine.joints:
        if type(joint).refuse is not Joint.refuse:
            why = f"'{joint.name}' is checked as a whole when the mechanism is described"
            read = _Read(dict(system.values))
            joint.refuse(_numbers(system, read), machine.units.length)
            _fix(found, read.names, why)
    while True:
        found.rules = {
            name: Rule(float(value), system.rule(name)[0])
            for name, value in system.values.items()
            if name not in found.fixed and name not in found.dependent
        }
        problem = _untraceable(found)
        if problem is None:
            return found
        _fix(found, *problem)


def input_numbers(system: System) -> dict[str, str]:
    """Of every input that is a constant, and so may be set, the name by that of its number; the
    position or rate of a driver that followed it would jump.
    """
    constant = [one.name for one in system.mechanism.inputs if isinstance(one.value, Constant)]
    drivers = driver_inputs(system.mechanism, system.numbers)
    return {f"{name}.value": name for name in constant if name not in drivers}


def _parameters_of(system: System, names: Iterable[str]) -> frozenset[str]:
    """The parameters of a formula that are no formulas themselves."""
    parameters, whole = system.mechanism.parameters, set[str]()
    for name in names:
        formula = system.formulas.get(name)
        if formula is None:
            whole.add(name)
        else:
            whole |= _parameters_of(system, parameters.used_by(formula))
    return frozenset(whole)


def _fix(found: Changeable, names: Iterable[str], why: str) -> None:
    """Numbers that cannot be changed, with all that they follow from."""
    for name in names:
        for one in (name, *sorted(found.dependent.get(name, ()))):
            if one not in found.dependent:
                found.fixed.setdefault(one, why)


def _untraceable(found: Changeable) -> tuple[set[str], str] | None:
    """Numbers, with the reason, that must be constants for one more element to be recorded."""
    system = found.system
    recording = Recording(found.rules)
    values = found.values(dict(recording.inputs))
    for element, make in _makers(system):
        read = _Read(values)
        try:
            _floats(make(_numbers(system, read)), recording)
        except Exception as error:  # whatever Python does with a number that is none
            text = str(error) if isinstance(error, Untraceable) else type(error).__name__
            own = {name for name in read.names if _is_traced(values[name])}
            return own, f"'{element}' needs its value before an image is made ({text})"
    return None


def _makers(system: System) -> Iterable[tuple[str, Callable[[Numbers], Any]]]:
    """By name what every element makes of its numbers."""
    for constraint in system.mechanism.constraints:
        yield constraint.name, constraint.primitives
        if "j" in constraint.places():
            yield constraint.name, functools.partial(_position_on_j, constraint)
    for load in system.mechanism.loads:
        yield load.name, load.actions


def _position_on_j(element: Element, at: Numbers) -> Any:
    """The place on j, where a reaction is reported."""
    return at.arm(element, "j")


def _floats(made: Any, recording: Recording) -> None:
    """Refuse what an element made, where a part is no number."""
    for one in made:
        if not hasattr(one, "parameters"):
            recording.place_of(one)
            continue
        laws = (one.law, getattr(one, "signal", None), *getattr(one, "signals", ()))
        numbers = [*one.parameters]
        for law in laws:
            numbers += [] if law is None else law.parameters
        for number in numbers:
            recording.place_of(number)


def _is_traced(value: Any) -> bool:
    return not isinstance(value, float | int)


class _Read(dict[str, Any]):
    """Numbers by name, and which of them were read."""

    def __init__(self, values: dict[str, Any]) -> None:
        super().__init__(values)
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> Any:
        self.names.add(name)
        return super().__getitem__(name)


def _numbers(system: System, values: dict[str, Any]) -> Numbers:
    return Numbers(values, polar_points(system.mechanism), system.mechanism.bodies)


# -- SI units of numbers and measures: what units of co-simulation have ------------------------

#: Names by which SI has what is composed otherwise in mbody's systems.
USUAL = {
    "inertia": "kg.m2",
    "pressure": "Pa",
    "power": "W",
    "density": "kg/m3",
    "angular momentum": "kg.m2/s",
    "resistance": "Ohm",
}
SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹·", "0123456789.")


@dataclass(frozen=True)
class SiUnit:
    """The SI unit of what another unit measures.

    `name`: Such as "N.m"; empty of a plain number.
    `factor`: The other unit in this one.
    """

    name: str
    factor: float
    dimension: Dimension


@functools.cache
def si_unit(text: str) -> SiUnit:
    """The SI unit of what a unit measures, with "." for products and plain exponents.

    >>> si_unit("lbf·in").name, round(si_unit("lbf·in").factor, 6)
    ('N.m', 0.112985)
    >>> si_unit("deg").name, si_unit("").factor
    ('rad', 1.0)
    """
    if not text:
        return SiUnit("", 1.0, DIMENSIONLESS)
    system = unit_system("SI")
    found = evaluate(parse_unit(text), Scope(system))
    dimension = found.dimension or DIMENSIONLESS
    name = USUAL.get(name_of(dimension)) or system.of(dimension).translate(SUPERSCRIPTS)
    return SiUnit(name, float(found.value), dimension)


# -- Measured quantities of an instant, as a program on its record -----------------------------
# The histories of a result are computed by mbody's own functions (`mbody.solution`), from a record
# of one instant whose numbers are traced. Drivers' motions are those of the bodies, and loads those
# of their formulas: neither is among what the kernels keep.

#: What a measure of joints is that no result has: Python checks it when loops are closed.
MISFIT = "distance of the places, less the one by the radii"


@dataclass
class MeasuredProgram:
    """MeasuredProgram quantities of an image.

    `program`: From what is kept of an instant, the time and the changeable numbers.
    `names`, `units`, `of`: Of every target.
    `notes`: What could not be recorded.
    """

    program: NumberProgram
    names: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    of: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def measured_quantities(changeable: Changeable) -> MeasuredProgram:
    """Of every body its motion; of joints, couplings, drivers and loads what results have of them;
    and the measures of the mechanism.
    """
    system = changeable.system
    rows = system.record_rows
    inputs = {f"row {n}": Rule(0.0) for n in range(rows)} | {"time": Rule(0.0)}
    # names of numbers, of which one may be that of a row
    inputs |= {f"number {name}": rule for name, rule in changeable.rules.items()}
    recording = Recording(inputs)
    traced = list(recording.inputs.values())
    numbers = dict(zip(changeable.rules, traced[rows + 1 :], strict=True))
    instant = TracedInstant(
        system=replace(system, values=changeable.values(numbers), plans={}),
        analysis="kinetostatics",
        t=traced[rows],  # type: ignore[arg-type]
        record=TracedRecord(traced[:rows]),  # type: ignore[arg-type]
        given=None,
    )
    found = MeasuredProgram(recording.program([]))
    targets: list[Any] = []
    for name, kind_of, make in _wanted(instant):
        try:
            value, dimension, unit = make()
            recording.place_of(value)
        except Exception as error:  # whatever Python does with a number that is none
            why = (
                str(error) if isinstance(error, ModelError | Untraceable) else type(error).__name__
            )
            found.notes.append(f"'{name}' is not among the measures of the image: {why}")
            continue
        targets.append(value)
        found.names.append(name)
        found.units.append(unit or system.mechanism.units.of(dimension))
        found.of.append(kind_of)
    found.program = recording.program(targets)
    return found


def _wanted(instant: Solution) -> Iterator[tuple[str, str, Any]]:
    """Name, formula, and a function for value, dimension and unit (none for that of the system)."""
    machine = instant.mechanism

    def history(owner: str, key: str) -> Any:
        return lambda: (*quantity(instant, owner, key), "")

    for body in machine.bodies:
        for key in ORDER:
            yield f"{body.name}.{key}", f"{body.name}.{key}", history(body.name, key)
    own: tuple[Any, ...] = (*machine.states, *machine.inputs)
    for one in own:
        plain = one.dimension or DIMENSIONLESS
        yield (
            one.name,
            one.name,
            lambda name=one.name, unit=plain: (auxiliary_history(instant, name), unit, ""),
        )
    known = {one.name for one in own}
    for element in (*machine.constraints, *machine.loads):
        for key in element.quantities():
            if f"{element.name}.{key}" in known:
                continue
            yield f"{element.name}.{key}", f"{element.name}.{key}", history(element.name, key)
    for joint in machine.joints:
        if joint.spaced:
            yield f"{joint.name}.misfit", MISFIT, functools.partial(_misfit, instant, joint)
    for name, measure in machine.measures.items():
        yield name, measure.of, lambda own=measure: evaluate_measure(instant, own)


def _misfit(instant: Solution, joint: Joint) -> tuple[Any, Dimension, str]:
    """Misfit of a joint, which others decide."""
    found, fitting = joint.fit(*ends(instant, joint))
    return found - fitting, DIMENSIONS["length"], ""


# -- The calls of an image for driven motion: closing the loops, a turn, a step of a drag ------

#: Instants of a turn, both ends included, unless the caller says how many.
REVOLUTION_INSTANTS = 361
#: Change points of one motion that are kept, and of a step.
CHANGES, OF_A_STEP = 256, 8
#: What the path parameter is, in words.
MODES = {BY_TIME: "time", BY_DRIVER: "driver", BY_INSTANT: "instant"}


@dataclass(frozen=True)
class _Programs:
    """System and programs shared by all calls: numbers, measures."""

    system: System
    numbers: NumberProgram
    measured: MeasuredProgram


def enter_driven(
    arena: Arena,
    system: System,
    numbers: NumberProgram,
    measured: MeasuredProgram,
    instants: int | None,
) -> dict[str, Any]:
    """Put the calls of driven motion into the image; what the manifest says of them."""
    grid = _grid(system, REVOLUTION_INSTANTS if instants is None else instants)
    start = closed(system, float(grid.t[0]), grid.first(system))
    check_determined(system, start, "kinetostatics")
    work, drivers = start.work, len(system.drivers)
    arena.call("numbers.driven", "set_numbers", numbers, system.layout, work)
    tolerance = float(rounding(system, work.q[:, 0]))
    given = np.full(drivers, np.nan)
    where = float(grid.t[0]), given, start.regularization, tolerance
    at = arena.call("close", "close_at", system.layout, work, *where)
    arena.word("driven.q", arena.place(work, "q"), system.coordinates)
    arena.word("close.t", at["t"])
    arena.array("close.given", given)
    programs = _Programs(system, numbers, measured)
    modes = {"turn": MODES[grid.mode]}
    _enter_path(arena, programs, "turn", start, grid, CHANGES)
    if drivers:
        step = _drag(start, system)
        modes["step"] = MODES[step.mode]
        _enter_path(arena, programs, "step", start, step, OF_A_STEP)
    return {"path parameters": modes, "redundant": bool(start.regularization)}


def _grid(system: System, instants: int) -> TimeGrid:
    """A whole turn of the one driver of an angle, else times of the motion of the description, or
    from 0 to 1.
    """
    angular = [driver.name for driver in system.drivers if driver.angular]
    if len(angular) == 1:
        try:
            return time_grid(system, None, None, angular[0], instants)
        except ModelError:
            if instants < 2:
                raise
    own, last = system.mechanism.simulation, 1.0
    if own is not None:
        last = number_in(system.mechanism, own.until, "time", "simulate", "until")
    return time_grid(system, np.linspace(0.0, last, instants), None, None, None)


def _drag(start: ClosedPosition, system: System) -> TimeGrid:
    """Two instants at the values that the drivers have at the start."""
    rows = system.layout.driver_row
    given = np.zeros((2, len(rows), 3))
    given[:, :, 0] = start.work.signal[rows, 0]
    t = np.full(2, float(start.work.time[0, 0]))
    if len(rows) == 1:
        return TimeGrid(BY_DRIVER, given[:, 0, 0].copy(), t, given)
    return TimeGrid(BY_INSTANT, np.array([0.0, 1.0]), t, given)


def _enter_path(
    arena: Arena,
    programs: _Programs,
    name: str,
    start: ClosedPosition,
    grid: TimeGrid,
    changes: int,
) -> None:
    """A path that is followed, and its measures."""
    system, count = programs.system, len(grid.s)
    runner = Runner(system, "kinetostatics")
    path = DrivenPath(
        mode=grid.mode,
        s=grid.s,
        t=grid.t,
        given=grid.given,
        chords=grid.chords if grid.mode == BY_INSTANT else np.zeros((1, 1)),
        with_forces=True,
        at_rest=False,
        monitored=True,
        regularization=start.regularization,
        position_norm=runner.position_norm(start, grid),
    )
    found = PathOutput(
        output=np.zeros((count, runner.rows, 1)),
        progress=np.zeros(PROGRESS),
        nearest=np.zeros(3),
        passed=np.zeros((changes, 1 + system.coordinates)),
    )
    arena.call(name, "follow", system.layout, start.work, path, found)
    measures = np.zeros((count, len(programs.measured.names)))
    program = programs.measured.program
    values = program, programs.numbers, path.t, found.output, measures
    arena.call(f"{name}.measures", "measures", *values)
    for key in ("s", "t", "given", "chords"):
        arena.array(f"{name}.{key}", getattr(path, key))
    for key in ("output", "progress", "nearest", "passed"):
        arena.array(f"{name}.{key}", getattr(found, key))
    arena.word(f"{name}.reach", arena.field_place(path, "position_norm"))
    arena.array(f"{name}.measured", measures)


# -- The calls of an image for free motion: its beginning, a step of co-simulation, all of it --

#: When a motion ends where the description does not say it, and steps of one call.
LAST, STEPS = 1.0, 500


def enter_free(
    arena: Arena,
    system: System,
    numbers: NumberProgram,
    measured: MeasuredProgram,
    instants: int | None,
) -> dict[str, Any]:
    """Put the calls of free motion into the image; what the manifest says of them."""
    _refuse_another_motion(system)
    start, state, request = _request(system, instants)
    first, q, v = state
    last = float(request.times[-1])
    if singular_start(system, start, state, request, last) is not None:
        raise ModelError(
            f"'{system.mechanism.name}' begins where branches meet, at a singular position, which "
            "an image cannot leave: begin elsewhere"
        )
    contacts = contact_motion(system, start, request.settings) if has_modes(system) else None
    integration = contacts.motion if contacts else Integration(system, start, request.settings)
    integration.begin(first, q, v, last)
    if contacts is not None:
        q = fitted_start(contacts, q)
        keep_phases(contacts, numbers)
    layout, work = integration.layout, integration.work
    stepping, errors = integration.stepping, integration.motion.tolerances
    record, rows, causes = integration.record, integration.rows, integration.causes
    program = measured.program
    own = integration.y[2 * system.coordinates :].copy()
    begin = MotionStart(times=np.array([first, last]), q=q, v=v, own=own)
    arena.call("numbers.free", "set_numbers", numbers, layout, work)
    at = arena.call("begin", "begin_motion", layout, work, stepping, errors, begin, record, False)
    arena.word("begin.goes_on", at["goes_on"])
    if contacts is not None:
        motion = enter_contacts(arena, contacts, STEPS)
        arena.array("motion.numbers", numbers.slots[: len(numbers.lowest)].copy())
    for name, times in (("advance", np.array([first])), ("run", request.times.copy())):
        outputs = Outputs(
            times=times,
            pages=np.zeros((len(times), rows, 1)),
            work=np.zeros((len(times) + 1, causes)),
        )
        if contacts is not None:
            arena.call(name, "advance_motion", motion, outputs)
        else:
            bundles = layout, work, integration.steps.methods.explicit, stepping, errors, outputs
            until = first if name == "advance" else last
            at = arena.call(name, "runge_kutta", *bundles, until, STEPS)
            for key in ("until", "steps"):
                arena.word(f"{name}.{key}", at[key])
        found = np.zeros((len(times), len(measured.names)))
        arena.call(f"{name}.measures", "measures", program, numbers, times, outputs.pages, found)
        for key in ("times", "pages", "work"):
            arena.array(f"{name}.{key}", getattr(outputs, key))
        arena.array(f"{name}.measured", found)
    for key in ("times", "q", "v", "own"):
        arena.array(f"start.{key}", getattr(begin, key))
    for n, one in enumerate(system.mechanism.states):
        # its count is the column of its measure
        place = arena.put(begin.own) + 8 * n
        column = measured.names.index(one.name)
        unit = measured.units[column]
        arena.entries.append(ImageEntry(STATE, place, column, one.name, unit))
    for key in ("relative", "absolute"):
        arena.word(f"motion.{key}", arena.field_place(errors, key))
    arena.array("begin.page", record)
    arena.array("motion.state", stepping.state)
    arena.array("motion.y", stepping.y)
    return {
        "notes": [*_notes(system), *integration.notes],
        "rtol": request.settings.rtol,
        "times": [first, last],
        "every": _interval(system, last - first),
        "contacts": [] if contacts is None else [one.name for one in contacts.uni.contact_points],
    }


def _request(
    system: System, instants: int | None
) -> tuple[Solution, tuple[float, np.ndarray, np.ndarray], MotionRequest]:
    """How the motion begins, and which one it is."""
    own = system.mechanism.simulation
    start = close_loops(system) if own is None else initial_state_of(system, own)
    state = state_of(system, start)
    request = motion_request(
        system,
        state[0],
        state[0] + LAST if own is None else last_time(system, None),
        tolerances(system, None, None),
        method=METHODS[0],
        step=None,
        kept=(instants, None, None),
        events=(),
        release={},
    )
    return start, state, request


def _interval(system: System, whole: float) -> float:
    """How far apart the instants of the description are, however many the image keeps."""
    own = system.mechanism.simulation
    if own is not None and own.every is not None:
        return number_in(system.mechanism, own.every, "time", "simulate", "every")
    return whole / ((INSTANTS if own is None else own.instants) - 1)


def _refuse_another_motion(system: System) -> None:
    """Refuse a motion that would be another one in the image."""
    for one in system.mechanism.inputs:
        if holds(one.value):
            raise ModelError(
                f"input '{one.name}' follows a table that holds its values, which an image cannot: "
                "give it a number, and let the program set it",
                one.name,
            )
    own = system.mechanism.simulation
    if own is None:
        return
    ends = [one.name for one in own.events if one.stop]
    if ends:
        raise ModelError(f"'{ends[0]}' ends the motion, which an image cannot do: leave it out")
    if own.release:
        name = next(iter(own.release))
        raise ModelError(
            f"driver '{name}' is released, which an image cannot do: leave the release out"
        )


def _notes(system: System) -> list[str]:
    """Notes on what the motion of the image leaves out."""
    own = system.mechanism.simulation
    if own is None:
        return []
    notes = [f"event '{one.name}' is not in the image" for one in own.events]
    if has_corners(system):
        notes.append(
            "steps of the image do not end at corners and pulses of laws of time: short ones may "
            "be missed; simulate locates them"
        )
    if own.method != METHODS[0]:
        notes.append(f"the image integrates by {METHODS[0]}, the model by {own.method}")
    return notes


#: What an image can do, and what puts it in.
ENTER = {"driven": enter_driven, "free": enter_free}
ANALYSES = tuple(ENTER)
#: Bases of units that the manifest names.
UNITS = ("length", "mass", "time", "angle", "force", "torque")


@dataclass(frozen=True)
class ModelImage:
    """An image.

    `content`: All of it, as `docs/images.md` describes it.
    `manifest`: What it says of itself.
    `entries`: What it offers by name, in order.
    """

    content: bytes
    manifest: dict[str, Any]
    entries: tuple[ImageEntry, ...] = ()

    @property
    def notes(self) -> list[str]:
        """Notes on what the image leaves out."""
        found: list[str] = self.manifest["notes"]
        return found


def to_image(
    model: Mechanism | System, instants: int | None = None, analyses: Sequence[str] = ANALYSES
) -> ModelImage:
    """The image of a mechanism, on which the compiled core runs without Python.

    Parameters
    ----------
    model : Mechanism or System
        Whose loops close; the position and all numbers are those of the description.
    instants : int, optional
        Of a turn, by default 361, and of a free motion, by default those of the description.
    analyses : sequence of str
        "driven", "free" or both: what the image shall do.

    Raises
    ------
    ModelError
        For a mechanism with users' Python, a batch of designs, and one that has neither a driven
        nor a free motion that an image can make.

    Examples
    --------
    >>> from mbody import makers
    >>> image = to_image(makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    >>> image.manifest["analyses"], image.content[:8]
    (['driven', 'free'], b'mbodyimg')
    """
    system = as_system(model)
    name = system.mechanism.name
    if "free" in analyses and system.batch is None:
        system = with_contacts_of_joints(system)
    if system.batch is not None:
        raise ModelError(
            f"an image has one design, '{name}' has {system.batch}: choose one with design(n)"
        )
    own = [element for element, function in system.functions if function is not None]
    if own:
        raise ModelError(
            f"'{own[0]}' has a function in Python, which an image runs without: give a formula or "
            "a table instead",
            own[0],
        )
    if system.mechanism.controllers:
        controller = system.mechanism.controllers[0]
        raise ModelError(
            f"'{controller.name}' is a controller in Python, which an image runs without: leave it "
            f"out, and let the program set {listed(controller.sets)}",
            controller.name,
        )
    changeable = changeable_numbers(system)
    numbers, measured = changeable.program(), measured_quantities(changeable)
    arena = Arena()
    for n, input_name in enumerate(changeable.rules):
        place = arena.put(numbers.slots) + 8 * n
        arena.entries.append(ImageEntry(NUMBER, place, 1, input_name, _unit(system, input_name)))
    for n, (one, unit) in enumerate(zip(measured.names, measured.units, strict=True)):
        arena.entries.append(ImageEntry(MEASURE, 0, n, one, unit))
    slots = list(changeable.rules)
    for number_name, input_name in input_numbers(system).items():
        if number_name in changeable.rules:
            place = arena.put(numbers.slots) + 8 * slots.index(number_name)
            unit = measured.units[measured.names.index(input_name)]
            arena.entries.append(ImageEntry(INPUT, place, 1, input_name, unit))
    rows = system.record_rows
    arena.word("page.rows", 0, rows)
    about: dict[str, Any] = {}
    notes = [*measured.notes, *_fits(system)]
    known = len(notes)
    for analysis in analyses:
        try:
            about[analysis] = ENTER[analysis](arena, system, numbers, measured, instants)
        except (ModelError, SolveError) as error:
            if len(analyses) == 1:
                raise
            notes.append(f"no {analysis} motion: {error}")
    if not about:
        raise ModelError(f"an image of '{name}' could do nothing; " + "; ".join(notes[known:]))
    factors = [si_unit(entry.unit).factor for entry in arena.entries]
    arena.array("si.factors", np.array(factors))
    arena.array("si.second", np.array([si_unit(system.mechanism.units.time).factor]))
    notes += about.get("free", {}).pop("notes", [])
    manifest = _manifest(system, changeable, measured, numbers) | {
        "analyses": list(about),
        **about,
        "rows": rows,
        "notes": notes,
    }
    sources = source_hash() or "00" * 32
    manifest["sources"] = sources
    content = arena.image(json.dumps(manifest, ensure_ascii=False).encode(), sources)
    return ModelImage(content, manifest, tuple(arena.entries))


def _fits(system: System) -> list[str]:
    """Checks made in Python when loops are closed, and not in an image, in sentences."""
    spaced = [joint.name for joint in system.mechanism.joints if joint.spaced]
    if not spaced:
        return []
    return [
        f"where lengths are changed, whether {listed(spaced)} fit is not checked: their measure "
        "'misfit' must be zero"
    ]


def _unit(system: System, name: str) -> str:
    dimension = dimension_named(system.mechanism, name)
    return "" if dimension is None else system.mechanism.units.of(dimension)


def _manifest(
    system: System, changeable: Changeable, measured: MeasuredProgram, numbers: NumberProgram
) -> dict[str, Any]:
    """Manifest of an image, apart from its analyses."""
    machine = system.mechanism

    def number(name: str, dependent: bool) -> dict[str, Any]:
        value, unit = float(system.values[name]), _unit(system, name)
        return {"name": name, "value": value, "unit": unit, "follows": dependent}

    return {
        "format": FORMAT,
        "mbody": __version__,
        "model": machine.name,
        "title": machine.name,
        "system of units": machine.units.name,
        "units": {dimension: machine.units.of(dimension) for dimension in UNITS},
        "length": float(system.length),
        "numbers": [number(name, False) for name in changeable.rules]
        + [number(name, True) for name in changeable.dependent],
        "not_changeable": changeable.not_changeable(),
        "measures": [
            {"name": name, "unit": unit, "of": dimension}
            for name, unit, dimension in zip(
                measured.names, measured.units, measured.of, strict=True
            )
        ],
        "inputs": list(input_numbers(system).values()),
        "states": [state.name for state in machine.states],
        "bodies": [body.name for body in machine.bodies],
        "drivers": [driver.name for driver in machine.drivers],
        "coordinates": system.coordinates,
        "primitives": [[element.name, part] for element, part in system.owners],
    }


# -- Free motions of an image in which something may open, stick or strike ---------------------

#: Happenings that an image keeps; numbers of each: time, what it is, contact point.
HAPPENINGS, OF_EACH = 1000, 3
#: Bytes for the problem of everything that may act at once, at most.
MOST_BYTES = 64e6


def contact_motion(system: System, start: Solution, settings: IntegrationSettings) -> ActiveModes:
    """The motion of a system, with memory for everything that may act at once."""
    active = Integration(system, start, settings).active
    assert active is not None
    points, joints = len(active.uni.contact_points), len(active.uni.friction_joints)
    rows = 2 * points + len(active.layout.friction_kind)
    forces, lines = system.rows + 2 * points + joints, 3 * points + 2 * joints
    limits = lines + 4 * joints + 2 * forces
    if 8.0 * ((5.0 * rows) ** 2 + 4.0 * limits**2) > MOST_BYTES:
        raise ModelError(
            f"'{system.mechanism.name}' has {points} places that may touch, too many for an image: "
            "leave out contacts that never close"
        )
    active.memory.grow(rows)
    found = open_forces_memory(system.coordinates, forces, lines, joints)
    for name, bundle in zip(("open", "program"), found, strict=True):
        active.guard_table.attach(name, bundle)
    return active


def fitted_start(active: ActiveModes, q: np.ndarray) -> np.ndarray:
    """The first position (coordinates,), fitted to contacts, once the motion has begun; refuses
    shapes that overlap, and what an image cannot begin with.
    """
    active.load()
    if fit_contacts(active.uni, active.work) is not None:
        q = active.work.q[: active.system.coordinates, 0].copy()
    motion, n = active.motion, active.system.coordinates
    trial = Integration(motion.system, motion.start, motion.settings)
    trial.begin(motion.first, q, motion.y[n : 2 * n], motion.until)
    status = "" if trial.active is None else trial.active.begin()
    notes = [] if trial.active is None else trial.active.log.notes
    if status or any("rolls at once" in note for note in notes):
        raise ModelError(
            f"an image cannot begin the motion of '{motion.system.mechanism.name}': "
            f"{status or notes[-1]}"
        )
    return q


def enter_contacts(arena: Arena, active: ActiveModes, steps: int) -> UnilateralMotion:
    """Enter what a program reads and sets of a motion with contacts; the motion."""
    G, motion = active.guard_table, active.motion
    G.asked[:] = motion.first, steps, motion.swings, 1.0
    arena.array("motion.stage", active.stage)
    arena.array("motion.page", G.page)
    arena.array("motion.events", np.zeros(HAPPENINGS * OF_EACH))
    arena.array("motion.happened", np.zeros(1))
    arena.array("motion.struck", active.memory.impact.first)
    for name in ("advance", "run"):
        arena.word(f"{name}.until", arena.put(G.asked))
        arena.word(f"{name}.steps", arena.put(G.asked) + 8)
    found = active.eliminate_rows_that_are_on()
    whole = {"layout": motion.layout, "joints": motion.layout}
    return found.replaced(**whole, reduced=motion.work, joint_work=motion.work)


def keep_phases(active: ActiveModes, numbers: NumberProgram) -> None:
    """Where circles that stick have met is no number of the model: other numbers leave it."""
    numbers.targets[active.uni.phase_rows] = -1
