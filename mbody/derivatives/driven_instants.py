"""Instants of a driven result in dual numbers: motion and forces with derivatives by numbers."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import statics
from mbody.analysis.equilibria.equilibrium import Equilibrium
from mbody.analysis.freedom.mobility import FreeMotion
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core.lanes import TANGENTS, DualNumber
from mbody.core.tolerances import INSTANT_SAME_AGAIN, SINGULAR_VALUE_ZERO, TANGENTS_LEFT, TINY
from mbody.derivatives.dual_solution import (
    DualRecord,
    DualSolution,
    DualWorkspace,
    EventTime,
    ReportedForces,
    WorkspaceKind,
    dual_solution,
    dual_values,
    number_tangents,
)
from mbody.kernels.motion_duals import BY_LAW, BY_TIME, BY_VALUE, DualOutput, driven_duals
from mbody.laws import ConstantSpeed
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker
from mbody.solution.histories import ends, link_poses
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of


def misfitting(solution: DualSolution, names: Sequence[str]) -> set[str]:
    """The numbers that alone move the wheels of a gear pair, or a rack and its pinion, nearer or
    further than their radii let them be, which every analysis refuses.
    """
    found: set[str] = set()
    for joint in solution.mechanism.joints:
        if not joint.spaced:
            continue
        distance, wanted = joint.fit(*ends(solution, joint))
        off = distance - wanted
        if isinstance(off, DualNumber):
            most = np.abs(np.atleast_2d(off.tangents)).max(axis=0)
            # lengths by lengths are near 1, and angles of a marker at most the model length
            found |= {name for name, x in zip(names, most, strict=True) if x > TANGENTS_LEFT}
    return found


class DrivenInstants:
    """Derivatives of the instants of one result by some numbers. `tangents` (parameters, names),
    (masses, names).
    """

    def __init__(
        self,
        run: Solution,
        names: Sequence[str],
        revolving: str = "",
        tangents: tuple[np.ndarray, np.ndarray] | None = None,
        spaces: list[DualWorkspace] | None = None,
    ) -> None:
        self.run, self.names = run, list(names)
        self.spaces: list[DualWorkspace] = [] if spaces is None else spaces
        drivers = [one.name for one in run.system.drivers]
        self.leader = drivers.index(revolving) if revolving else -1
        self.mode = BY_TIME if run.given is None else BY_VALUE
        if revolving and run.given is None:
            self.mode = BY_LAW
        #: Numbers by which there is no derivative: with others alone redundant loops do not close.
        self.unclosed: set[str] = set()
        self.reported = ReportedForces(run, self.names)
        #: Of a driven motion nothing happens at times of its own.
        self.events: list[EventTime] = []
        known = number_tangents(run.system, self.names) if tangents is None else tangents
        self.par, self.mass = known

    @property
    def notes(self) -> list[str]:
        """What is to be said of the derivatives besides."""
        return self.reported.notes

    def at(self, instants: np.ndarray, with_loads: bool) -> Any:
        """The result at some of its instants with derivatives, a `DualSolution`."""
        values = dual_values(self.run.system, self.names)
        found = dual_solution(self.run, values, self.rows_at(instants, with_loads))
        self.unclosed |= misfitting(found, self.names)
        return found

    def rows_at(self, instants: np.ndarray, with_loads: bool) -> DualRecord:
        """Rows of values and tangents of some instants."""
        system, count = self.run.system, len(self.names)
        space = self._workspace(len(instants), with_loads)
        self._set_instants(space, instants)
        output = space.found.output  # the kernel writes all of it
        rows = output.shape[1]
        values = np.empty((len(instants), rows))
        tangents = np.zeros((len(instants), rows, max(count, 1)))
        for first in range(0, max(count, 1), TANGENTS):
            part = slice(first, min(first + TANGENTS, count))
            width = part.stop - part.start
            space.begin(system, self.par[:, part], self.mass[:, part])
            driven_duals(system.runtime(), space.work, space.instants, space.found)
            self._check(system, space.found, part)
            values[:] = output[:, :, 0]
            tangents[:, :, part] = output[:, :, 1 : 1 + width]
        self.spaces.append(space)
        for n in self.reported.open_at(instants):
            k, own = int(instants[n]), slice(0, system.record_rows)
            shown = functools.partial(self._reported, k)
            self.reported.derive(k, values[n, own], tangents[n, own, :count], shown)
        return DualRecord(values, tangents, space.first_load, system.coordinates)

    def _reported(self, k: int, system: System, row: np.ndarray, *_: float) -> np.ndarray | None:
        """The row of instant k with the forces that are reported."""
        from mbody.analysis.driven.open_forces import reported_row

        return reported_row(self.run, k, system, row)

    def without_derivative(self, instants: np.ndarray, record: DualRecord) -> np.ndarray:
        """Which of some instants, with their rows of values, have no derivatives: (instants,).

        Of those the result has no forces, or it has limits, as at change points: the equations of
        the instant itself then give other values.
        """
        system = self.run.system
        whole = self.run.record.table(slice(0, system.record_rows))
        difference = np.abs(record.values[:, : whole.shape[1]] - whole[instants])
        fine = np.isfinite(whole)
        greatest = np.abs(whole[fine]).max(initial=0.0)
        return np.asarray(
            ~(fine[instants] & (difference <= INSTANT_SAME_AGAIN * greatest)).all(axis=1)
        )

    def _workspace(self, count: int, with_loads: bool) -> DualWorkspace:
        """A workspace for so many instants, one that is free where there is one."""
        run = self.run
        kind = WorkspaceKind(
            count,
            with_loads,
            run.regularization,
            run.has_forces,
            run.analysis == "statics",
            self.mode,
            self.leader,
        )
        try:
            # another thread may take the last one
            space = self.spaces.pop()
        except IndexError:
            return DualWorkspace(run.system, kind)
        return space if space.kind == kind else DualWorkspace(run.system, kind)

    def _set_instants(self, space: DualWorkspace, instants: np.ndarray) -> None:
        run = self.run
        space.instants.t[:] = run.t[instants]
        space.instants.q[:] = run.record.at(slice(0, run.system.coordinates), instants)
        if run.given is not None:
            space.instants.given[:] = run.given[instants]

    def _check(self, system: System, found: DualOutput, part: slice) -> None:
        """Collect the numbers with which redundant loops do not close."""
        raise_user_error(system)
        if self.run.regularization == 0.0:
            return
        names = self.names[part]
        left = np.asarray(found.unclosed)[:, 1 : 1 + len(names)].max(axis=0)
        moved = np.abs(np.asarray(found.output)[:, : system.coordinates, 1 : 1 + len(names)])
        most = np.maximum(moved.max(axis=(0, 1)), TINY)
        self.unclosed |= {
            n
            for n, residual, m in zip(names, left, most, strict=True)
            if residual > TANGENTS_LEFT * m
        }


# -- Equilibria in dual numbers, by the implicit function theorem ------------------------------
# A driver is put on the leader of every free motion; in equilibrium the efforts e of these drivers
# vanish. Statics of the driven mechanism in dual numbers has ∂e/∂p by the numbers and, by the
# values ξ of the drivers, the stiffness ∂e/∂ξ, so that
#
#     dξ/dp = −(∂e/∂ξ)⁻¹ ∂e/∂p,
#
# and every quantity m of the position has dm/dp = ∂m/∂p + ∂m/∂ξ dξ/dp.


class EquilibriumInstants:
    """Derivatives of one equilibrium by some numbers."""

    def __init__(self, equilibrium: Equilibrium, names: Iterable[str]) -> None:
        self.equilibrium, self.names = equilibrium, list(names)
        self.events: list[EventTime] = []
        self.notes: list[str] = []
        run = equilibrium.solution
        self.driven, self.drivers = _driven(run.system, equilibrium.motions, link_poses(run))
        t = float(run.t[0])
        self.run = statics(self.driven, t=[t], guess=link_poses(run))
        by = [*self.names, *(f"{name}.law.value" for name in self.drivers)]
        self.instants = DrivenInstants(self.run, by)

    @property
    def unclosed(self) -> set[str]:
        """Numbers by which there are none: with others redundant loops do not close."""
        return self.instants.unclosed

    def at(self, instants: np.ndarray, with_loads: bool) -> DualSolution:
        """The position with derivatives."""
        whole = self.instants.at(np.zeros(1, dtype=int), with_loads)
        record: Any = whole.record
        count = len(self.names)
        efforts = np.array([whole.effort(name).tangents[0] for name in self.drivers])
        stiffness = efforts[:, count:]
        sizes = np.linalg.svd(stiffness / self._units(), compute_uv=False)
        by_numbers = record.tangents[:, :, :count]
        if sizes[-1] > SINGULAR_VALUE_ZERO * sizes[0]:
            moves = -np.linalg.solve(stiffness, efforts[:, :count])
            total = by_numbers + record.tangents[:, :, count:] @ moves
        else:
            total = np.full_like(by_numbers, np.nan)
            self.notes = [
                "the position has no derivative: it is neutral, no force to first order brings it "
                "back or drives it away"
            ]
        values = dual_values(self.driven, self.names)
        found = DualRecord(record.values, total, record.loads, record.size)
        return dual_solution(self.run, values, found)

    def without_derivative(self, instants: np.ndarray, _: DualRecord) -> np.ndarray:
        """Which of some instants have no derivatives by any number, (instants,): none."""
        return np.zeros(len(instants), dtype=bool)

    def _units(self) -> np.ndarray:
        """Units of a stiffness in the leading coordinates: lengths by the model length."""
        length = self.driven.length
        one = np.array([1.0 if motion.turns else length for motion in self.equilibrium.motions])
        return np.asarray(1.0 / np.outer(one, one))


def _driven(
    system: System, motions: tuple[FreeMotion, ...], poses: dict[str, tuple[float, float, float]]
) -> tuple[System, list[str]]:
    """The system with a driver on the leader of each free motion, and their names."""
    machine, names = system.mechanism.copied(), list[str]()
    for motion in motions:
        x, y, angle = poses[motion.leader]
        name = f"{motion.leader} at rest"
        if motion.turns:
            machine.add(AngleDriver(name, motion.leader, ConstantSpeed(angle, 0.0)))
        else:
            vx, vy, _ = motion.rates[motion.leader]
            across = abs(vy) > abs(vx)
            marker = Marker("ground", (0.0, 0.0), 0.5 * math.pi if across else 0.0)
            law = ConstantSpeed(y if across else x, 0.0)
            name += " along y" if across else " along x"
            machine.add(CoordinateDriver(name, marker, motion.leader, law))
        names.append(name)
    return with_numbers_of(assemble(machine), system.values), names
