"""A result whose histories are dual numbers: values with their derivatives."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mbody.analysis.dynamics.integrators import natural_size
from mbody.core import tolerances as tol
from mbody.core.lanes import LANES, TANGENTS, DualNumber, aligned, value
from mbody.core.recorded_numbers import Untraceable
from mbody.core.tolerances import QUANTITY_ROUNDING
from mbody.errors import ModelError, brief
from mbody.image.model_image import Changeable, changeable_numbers
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.motion_duals import DualInstants, DualOutput
from mbody.kernels.number_program import NumberProgram, number_duals
from mbody.model.element import listed
from mbody.model.joints import CamFollower
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import IMMOVABLE, dimension_named
from mbody.model.simulation import STATE
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension
from mbody.solution.histories import Reaction, Record
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- The numbers by which derivatives are taken: which there are, and their units --------------


def start_numbers(mechanism: Mechanism) -> dict[str, str]:
    """Numbers that a description prescribes of the beginning, "start.crank.angle", with what they
    measure.
    """
    given = {} if mechanism.simulation is None else mechanism.simulation.start
    return {f"start.{body}.{key}": STATE[key] for body, state in given.items() for key in state}


def checked_names(
    system: System, by: Sequence[str] | str | None, verb: str = "gradient", *, starts: bool = False
) -> dict[str, str]:
    """Dotted names of the requested numbers by the names that were given; by default of all that
    have no formula. Sentences begin with the verb; `starts`: numbers of a beginning may be named.
    """
    if by is None:
        left = {*system.mechanism.fixed_parameters, *system.formulas}
        # a delay that is zero may only be more
        delays = (f"{one.name}.delay" for one in system.mechanism.controllers)
        left |= {name for name in delays if not system.values[name]}
        left |= set(IMMOVABLE)
        return {name: name for name in system.values if name not in left}
    if not isinstance(by, str | Sequence):
        raise ModelError(f'{verb}: by must be names such as ["crank.A.x"], not {brief(by)}')
    found: dict[str, str] = {}
    begins = start_numbers(system.mechanism) if starts else {}
    for name in [by] if isinstance(by, str) else by:
        own = name if name in begins else _checked(system, name, verb)
        if own in found.values():
            raise ModelError(f"{verb}: '{name}' is given twice in by: give it once", name)
        found[name] = own
    if not found:
        raise ModelError(f"{verb}: by is empty: name at least one number, or leave it out")
    return found


def _checked(system: System, given: Any, verb: str) -> str:
    if not isinstance(given, str):
        raise ModelError(
            f'{verb}: by must be names such as ["crank.A.x"], not {brief(given)}', str(given)
        )
    name = system.number_name(given)
    if name not in system.values:
        raise ModelError(_unknown(system, name), name)
    if name in system.mechanism.fixed_parameters:
        raise ModelError(
            f"parameter '{name}' is used in a table, a program, a guess or g of "
            f"'{system.mechanism.name}', which a system cannot change: there is no derivative by "
            "it; describe the mechanism with another value",
            name,
        )
    formula = system.formulas.get(name)
    if formula is not None:
        used = listed(sorted(system.mechanism.parameters.used_by(formula)))
        raise ModelError(
            f"'{name}' is made by the formula '{formula.text}': name {used} instead, or give "
            f"'{name}' a number of its own by with_values",
            name,
        )
    return name


def _unknown(system: System, name: str) -> str:
    known = list(system.values)
    owner = name.partition(".")[0]
    own = [one for one in known if one.partition(".")[0] == owner and "." in one]
    close = difflib.get_close_matches(name, own or known, n=6, cutoff=0.5 if own else 0.6)
    machine = system.mechanism
    # of the mass of the ground nothing depends
    found = [*machine.parameters, *(one for one in known if not one.startswith("ground."))]
    there = close or own[:12] or list(dict.fromkeys(found))[:12]
    return f"there is no number {brief(name)} (there are: {listed(there)})"


def influential(
    system: System, names: Sequence[str], value: np.ndarray, row: np.ndarray
) -> np.ndarray:
    """Which of the numbers change a quantity by more than rounding, if they change by their own
    size, (names,): from its values and derivatives (…, names).
    """
    effect = np.abs(np.nan_to_num(row)) * natural_sizes(system, names)
    most = effect.reshape(-1, len(names)).max(axis=0, initial=0.0)
    return np.asarray(most > QUANTITY_ROUNDING * np.abs(value).max(initial=0.0))


def number_sizes(system: System, names: Sequence[str]) -> np.ndarray:
    """By how much a number may change, (names,): its own size, of lengths that of the mechanism at
    least; 0 of others that are zero.
    """
    sizes = np.array([abs(float(system.values.get(name, 1.0))) for name in names])
    lengths = [unit_of(system.mechanism, name) == system.mechanism.units.length for name in names]
    return np.where(lengths, np.maximum(sizes, system.length), sizes)


def natural_sizes(system: System, names: Sequence[str]) -> np.ndarray:
    """The same, (names,), with natural sizes of those that are zero."""
    sizes = zip(names, number_sizes(system, names).tolist(), strict=True)
    return np.array([size or size_of_zero(system, name) for name, size in sizes])


def size_of_zero(system: System, name: str) -> float:
    """A natural size of a number that is zero."""
    return natural_size(system, dimension_of_number(system.mechanism, name))


def dimension_of_number(mechanism: Mechanism, name: str) -> Dimension:
    """Dimension of a number."""
    begins = start_numbers(mechanism)
    if name in begins:
        return DIMENSIONS[begins[name]]
    owner = name.partition(".")[0]
    if owner not in (*mechanism.parameters, "ground") and owner not in mechanism:
        return NUMBER  # of a driver that was released
    return dimension_named(mechanism, name) or NUMBER


def unit_of(mechanism: Mechanism, name: str) -> str:
    """Unit of a number, empty of a plain one."""
    return mechanism.units.of(dimension_of_number(mechanism, name))


# -- Derivatives of the numbers that kernels take by the numbers of a description --------------
# What makes the ones of the others is plain Python, as each element has it. It is recorded once for
# a topology as a list of operations (`mbody.image.model_image`), which is repeated in dual numbers
# for every set of numbers. Where that cannot be, as of numbers that an element looks at, the same
# Python runs on dual numbers itself, some hundred times slower.


def dual_values(system: System, names: Sequence[str]) -> dict[str, Any]:
    """All numbers of a system by dotted name; those that depend on the named ones are dual."""
    count = len(names)
    parameters = system.mechanism.parameters
    found: dict[str, Any] = dict(system.values)
    for name, row in zip(names, np.eye(count), strict=True):
        found[name] = DualNumber(float(system.values[name]), row)
    if not any(name in parameters for name in names):
        return found
    made = {name: formula for name, formula in system.formulas.items() if name not in names}
    own = {name: found[name] for name in parameters if name not in made}
    scope = parameters.scope(own)
    for name, formula in made.items():
        number = scope.names[name].value if name in parameters else formula.value(scope)
        if isinstance(number, DualNumber):
            found[name] = number
    return found


def number_tangents(system: System, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the rows of `par` and `mass` by the named numbers: (rows, names) each."""
    recorded = recorded_numbers(system)
    if recorded is None or not recorded.has(names):
        return tangents_by_elements(system, dual_values(system, names), len(names))
    rows, (_, tangents) = len(system.par), recorded.evaluated(system.values, names)
    return tangents[:rows], tangents[rows:]


def tangents_by_elements(
    system: System, values: dict[str, Any], count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of parameters and masses by the elements themselves, from the dual `values` of
    `dual_values`.
    """
    par, mass = system.kernel_numbers(values)
    return _tangents(par, count), _tangents(mass, count)


def _tangents(rows: list[Any], count: int) -> np.ndarray:
    found = np.zeros((len(rows), count))
    for row, number in zip(found, rows, strict=True):
        if isinstance(number, DualNumber):
            row[:] = number.tangents
        else:
            float(value(number))
    return found


@dataclass(frozen=True)
class RecordedNumbers:
    """The operations from the numbers of a description to those of the kernels.

    `place`: Place of every input by name.
    `fixed`: Numbers that are constants in it, with their values.
    `outputs`: Rows of par and mass; what follows them is looked at by others.
    """

    program: NumberProgram
    place: dict[str, int]
    fixed: dict[str, float]
    outputs: int

    def has(self, names: Sequence[str]) -> bool:
        """Whether all of these are inputs."""
        return all(name in self.place for name in names)

    def evaluated(
        self, values: Mapping[str, Any], names: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray]:
        """The rows of par, then of mass, (rows,), and their derivatives by the named numbers,
        (rows, names).
        """
        tangents = np.zeros((self.outputs, len(names)))
        found, slots = aligned(self.outputs, LANES), aligned(len(self.program.slots), LANES)
        slots[: len(self.place), 0] = [values[name] for name in self.place]
        for first in range(0, max(len(names), 1), TANGENTS):
            part = names[first : first + TANGENTS]
            slots[: len(self.place), 1:] = 0.0
            slots[[self.place[name] for name in part], range(1, 1 + len(part))] = 1.0
            number_duals(self.program, slots, found)
            tangents[:, first : first + len(part)] = found[:, 1 : 1 + len(part)]
        return found[:, 0].copy(), tangents


def recorded_numbers(system: System) -> RecordedNumbers | None:
    """Recorded operations that make the numbers of this topology, recorded once; None where an
    element does something that cannot be recorded.
    """
    key = ("number tangents", frozenset(system.formulas))
    plans: dict[Any, Any] = system.plans
    found: RecordedNumbers | None = plans.get(key)
    if found is not None and all(system.values[n] == x for n, x in found.fixed.items()):
        return found
    if key in plans and found is None:
        return None
    try:
        found = _record(system, changeable_numbers(system))
    except Untraceable:
        found = None
    plans[key] = found
    return found


def _record(system: System, changeable: Changeable) -> RecordedNumbers:
    place = {name: n for n, name in enumerate(changeable.rules)}
    others = system.values.keys() - place.keys() - changeable.dependent.keys()
    fixed = {name: system.values[name] for name in others}
    outputs = len(system.par) + len(system.mass)
    return RecordedNumbers(changeable.program(), place, fixed, outputs)


# -- Times of events, with derivatives ---------------------------------------------------------


@dataclass(frozen=True, eq=False)
class EventTime:
    """When something happens in a motion, with derivatives.

    `name`, `contact`: As of `EventRecord`.
    `row` (numbers,): NaN where there is none.
    """

    name: str
    contact: str
    t: float
    row: np.ndarray


class DualRecord(Record):
    """Rows of values (instants, rows) and of tangents (instants, rows, numbers)."""

    def __init__(self, values: np.ndarray, tangents: np.ndarray, loads: int, size: int) -> None:
        super().__init__([values[:, :, None]], len(values), batch=False)
        self.values, self.tangents = values, tangents
        #: Row of the first load, and rows of each.
        self.loads, self.size = loads, size

    def take(self, row: int) -> Any:
        """One row as a dual number."""
        return DualNumber(self.values[:, row], self.tangents[:, row])

    def some(self, first: int, count: int) -> list[Any]:
        """Rows that follow each other."""
        return [self.take(row) for row in range(first, first + count)]

    def table(self, rows: slice) -> np.ndarray:
        """Raises: compiled code reads tables without derivatives."""
        raise TypeError("compiled code computes it without derivatives")

    def at(self, rows: slice, instants: np.ndarray, design: int = 0) -> np.ndarray:
        """Raises: compiled code reads instants without derivatives."""
        raise TypeError("compiled code computes it without derivatives")

    def load_on(self, cause: int, first: int) -> tuple[Any, Any, Any]:
        """Force and torque of a load on a body."""
        row = self.loads + self.size * cause + first
        fx, fy, torque = self.some(row, 3)
        return fx, fy, torque


class DualSolution(Solution):
    """A result with derivatives. What has none is refused."""

    def part(self, instants: np.ndarray) -> DualSolution:
        """Only some of the instants."""
        whole: Any = self.record
        values, tangents = whole.values[instants], whole.tangents[instants]
        return _dual_solution(
            self, self.system, DualRecord(values, tangents, whole.loads, whole.size)
        )

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint. That of a cam has no torque at its point of contact, whose
        place would have to be differentiated to find that.
        """
        element: Any = next((one for one in self.mechanism.joints if one.name == joint), None)
        if not isinstance(element, CamFollower):
            return super().reaction(joint, on)
        first = 3 * self.system.coordinates + 2
        parts = [
            self.record.some(first + PER_PRIMITIVE * e, 2) for e in self.system.primitives_of[joint]
        ]
        fx, fy = (sum(more, start=one) for one, *more in zip(*parts, strict=True))
        i, j = element.i.body, element.j.body
        if on == i:
            return Reaction(joint, i, j, -fx, -fy, 0.0 * fx)
        return Reaction(joint, j, i, fx, fy, 0.0 * fx)

    def driven(self, driver: str) -> tuple[Any, Any, Any]:
        """Value, rate and acceleration of what a driver drives, as its law has them."""
        names = [one.name for one in self.mechanism.drivers]
        if driver not in names:
            return super().driven(driver)
        value, rate, change = self.record.some(
            self.system.record_rows + 1 + 3 * names.index(driver), 3
        )
        return value, rate, change

    def effort(self, driver: str) -> Any:
        """Effort of a driver or a coupling."""
        if driver not in self.system.primitives_of:
            return super().effort(driver)
        return -self.primitive_history(self.system.primitives_of[driver][0], 0)


def dual_solution(run: Solution, values: dict[str, Any], record: DualRecord) -> DualSolution:
    """A result of the analysis of `run` with the numbers `values` and the histories of `record`."""
    return _dual_solution(run, dataclasses.replace(run.system, values=values), record)


def _dual_solution(run: Solution, system: System, record: DualRecord) -> DualSolution:
    t: Any = record.take(system.record_rows)
    return DualSolution(
        system=system,
        analysis=run.analysis,
        t=t,
        record=record,
        given=None,
        regularization=run.regularization,
        dependencies=run.dependencies,
    )


# -- Forces that no equation decides, with derivatives -----------------------------------------
# What is reported of them is the end of linear programs. Along the tangents of all else at an
# instant it is a function of one number alone, of which differences over four places are taken.


class ReportedForces:
    """Derivatives of the forces of a result that no equation decides.

    `lost`: Times at which what stops them changes, so that there is no derivative.
    `bounds`: Why there is none by a number, by name: it cannot be moved to both sides.
    """

    def __init__(self, run: Solution, names: Sequence[str]) -> None:
        self.run, self.names, self.lost = run, list(names), list[float]()
        self.bounds: dict[str, str] = {}
        self.sizes = number_sizes(run.system, names)
        self.systems: dict[tuple[str, float], System] = {}
        first = 3 * run.system.coordinates
        self.forces = slice(first, first + PER_PRIMITIVE * len(run.system.owners))

    def open_at(self, instants: np.ndarray) -> np.ndarray:
        """Which of these instants have such forces: their places."""
        sets = () if self.run.shared is None else self.run.shared.sets
        return np.array([n for n, k in enumerate(instants) if sets and sets[k] is not None], int)

    def derive(
        self,
        k: int,
        values: np.ndarray,
        tangents: np.ndarray,
        shown: Callable[[System, np.ndarray, int, float], np.ndarray | None],
    ) -> None:
        """Set the rows (rows,) of instant k and their tangents (rows, names) to what is reported.
        `shown`: That of a system and rows beside it, by so much of a number.
        """
        own, plain = self.forces, values.copy()
        middle = shown(self.run.system, plain, 0, 0.0)
        if middle is None:
            return
        greatest = float(np.abs(middle[own]).max(initial=0.0))
        values[own] = middle[own]
        for n, name in enumerate(self.names):
            way = tangents[:, n].copy()
            moves = float(np.abs(way[own]).max(initial=0.0)) / (greatest or 1.0)
            steps = [x for x in (self.sizes[n], 1.0 / moves if moves else 0.0) if x]
            if not steps or not np.isfinite(way).all():
                continue
            h = tol.DIFFERENCE_STEP_FOURTH_ORDER * min(steps)
            try:
                ends = [
                    shown(self.system_at(name, c * h), plain + c * h * way, n, c * h)
                    for c in (-2, -1, 1, 2)
                ]
            except ModelError as error:
                self.bounds[name], tangents[own, n] = str(error), np.nan
                continue
            found = [one[own] for one in ends if one is not None]
            if len(found) < len(ends):
                tangents[own, n] = np.nan
                self.lost.append(float(self.run.t[k]))
                continue
            low, down, up, most = found
            tangents[own, n] = (8.0 * (up - down) - (most - low)) / (12.0 * h)
            # where it bends, second differences grow as the step, else as its square
            bend = np.abs(4.0 * (up + down) - (most + low) - 6.0 * middle[own])
            fine = np.abs(up - down).max(initial=0.0) + tol.BALANCE_LEFT * greatest
            if bend.max(initial=0.0) > tol.DERIVATIVE_ALLOWED * fine:
                tangents[own, n] = np.nan
                self.lost.append(float(self.run.t[k]))

    def system_at(self, name: str, change: float) -> System:
        """The system with another number."""
        key, system = (name, change), self.run.system
        if name not in system.values:  # of the start
            return system
        if key not in self.systems:
            moved = {name: float(system.values[name]) + change}
            self.systems[key] = system.with_values(moved)
        return self.systems[key]

    @property
    def notes(self) -> list[str]:
        """Sentences of where there is no derivative."""
        found = [
            f"forces that are not unique have no derivative by '{name}', at its bound: {why}"
            for name, why in self.bounds.items()
        ]
        if self.lost:
            when = f"t = {min(self.lost):.6g} {self.run.mechanism.units.time}"
            found.append(
                f"forces that are not unique have no derivative at {when}: other limits decide "
                "beside it which of them are given"
            )
        return found


# -- Workspaces of the kernels for instants in dual numbers ------------------------------------
# Tables of bundles take as long to make as an instant takes to compute: searches, which compute one
# instant of each of many designs, keep them.


class WorkspaceKind(NamedTuple):
    """Properties that tell apart the workspaces of one topology, as `DualInstants` has them;
    `loads`: every load is computed alone.
    """

    instants: int
    loads: bool
    regularization: float
    with_forces: bool
    at_rest: bool
    mode: int
    leader: int


class DualWorkspace:
    """A workspace, the instants that are computed in it, and what is found.

    `work`: Of dual numbers.
    `first_load`: Row of the first load: after the record, the time and three signals of each
      driver.
    """

    def __init__(self, system: System, kind: WorkspaceKind) -> None:
        count, drivers = kind.instants, len(system.drivers)
        loads = len(system.mechanism.loads) if kind.loads else 0
        self.kind = kind
        self.first_load = system.record_rows + 1 + 3 * drivers
        self.work: Work = system.work(LANES)
        self.instants = DualInstants(
            mode=kind.mode,
            leader=max(kind.leader, 0),
            t=np.zeros(count),
            given=np.zeros((count, max(1, drivers), 3)),
            q=np.zeros((count, system.coordinates)),
            rows=system.record_rows,
            regularization=kind.regularization,
            with_forces=kind.with_forces,
            at_rest=kind.at_rest,
            loads=loads,
        )
        rows = self.first_load + loads * system.coordinates
        self.found = DualOutput(
            output=np.zeros((count, rows, LANES)), unclosed=np.zeros((count, LANES))
        )

    def begin(self, system: System, par: np.ndarray, mass: np.ndarray) -> None:
        """The numbers of a system in lane 0 and their derivatives (rows, numbers) in those after;
        nothing is left of what was computed before.
        """
        memory, width = self.work.memory, par.shape[1]
        memory.fill(0.0)
        memory[:, :1] = system.blank(LANES)[1]
        self.work.par[:, 1 : 1 + width] = par
        self.work.mass[: len(mass), 1 : 1 + width] = mass
