"""A result whose histories are dual numbers: values with their derivatives."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.dual_number import DualNumber
from mbody.core.lanes import LANES
from mbody.derivatives.named_numbers import number_sizes
from mbody.errors import ModelError
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.motion_duals import DualInstants, DualOutput
from mbody.model.joints import CamFollower
from mbody.solution.histories import Reaction, Record
from mbody.solution.solution import Solution
from mbody.system.system import System

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
