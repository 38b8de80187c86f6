"""Rest positions in dual numbers, by the implicit function theorem.

A driver is put on the leader of every free motion; it rests where the efforts e of these drivers
vanish. Statics of the driven mechanism in dual numbers has ∂e/∂p by the numbers and, by the values
ξ of the drivers, the stiffness ∂e/∂ξ, so that

    dξ/dp = −(∂e/∂ξ)⁻¹ ∂e/∂p,

and every quantity m of the position has dm/dp = ∂m/∂p + ∂m/∂ξ dξ/dp.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from mbody.analysis.driven.statics import statics
from mbody.analysis.equilibria.equilibrium import Equilibrium
from mbody.analysis.freedom.free_motions import FreeMotion
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.dual_solution import DualRecord, DualSolution, dual_solution
from mbody.derivatives.event_time import EventTime
from mbody.derivatives.number_tangents import dual_values
from mbody.laws import ConstantSpeed
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker
from mbody.solution.places import link_poses
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.system import System

__all__ = ["RestInstants"]

#: A stiffness whose least singular value is this part of its greatest is none.
NEUTRAL = 1e-9


class RestInstants:
    """Derivatives of one rest position by some numbers.

    Parameters
    ----------
    rest : Equilibrium
    names : iterable of str
        Dotted names of numbers.
    """

    def __init__(self, rest: Equilibrium, names: Iterable[str]) -> None:
        self.rest, self.names = rest, list(names)
        self.events: list[EventTime] = []
        self.notes: list[str] = []
        run = rest.solution
        self.driven, self.drivers = _driven(run.system, rest.motions, link_poses(run))
        t = float(run.t[0])
        self.run = statics(self.driven, t=[t], guess=link_poses(run))
        by = [*self.names, *(f"{name}.law.value" for name in self.drivers)]
        self.instants = DrivenInstants(self.run, by)

    @property
    def unclosed(self) -> set[str]:
        """Numbers by which there are none: with others redundant loops do not close."""
        return self.instants.unclosed

    def at(self, instants: np.ndarray, with_loads: bool) -> DualSolution:
        """The position with derivatives.

        Raises
        ------
        SolveError
            Where a user's function failed.
        """
        whole = self.instants.at(np.zeros(1, dtype=int), with_loads)
        record: Any = whole.record
        count = len(self.names)
        efforts = np.array([whole.effort(name).tangents[0] for name in self.drivers])
        stiffness = efforts[:, count:]
        sizes = np.linalg.svd(stiffness / self._units(), compute_uv=False)
        by_numbers = record.tangents[:, :, :count]
        if sizes[-1] > NEUTRAL * sizes[0]:
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
        """What efforts by values are compared by: lengths by the model length."""
        length = self.driven.length
        one = np.array([1.0 if motion.turns else length for motion in self.rest.motions])
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
