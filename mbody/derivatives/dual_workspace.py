"""Memory in which the kernels compute instants in dual numbers, made once and used again.

Tables of bundles take as long to make as an instant takes to compute: searches, which compute one
instant of each of many designs, keep them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mbody.core.lanes import LANES
from mbody.kernels.driven_duals import DualInstants, FoundDuals
from mbody.kernels.layout import Work
from mbody.system.system import System

__all__ = ["DualWorkspace", "WorkspaceKind"]


class WorkspaceKind(NamedTuple):
    """What tells apart the workspaces of one topology, as `DualInstants` has it; `loads`: whether
    every load is computed alone.
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

    Attributes
    ----------
    work : Work
        Of dual numbers.
    instants : DualInstants
    found : FoundDuals
    first_load : int
        Row of the first load: after the page, the time and three signals of each driver.
    """

    def __init__(self, system: System, kind: WorkspaceKind) -> None:
        count, drivers = kind.instants, len(system.drivers)
        loads = len(system.mechanism.loads) if kind.loads else 0
        self.kind = kind
        self.first_load = system.page_rows + 1 + 3 * drivers
        self.work: Work = system.work(LANES)
        self.instants = DualInstants(
            mode=kind.mode,
            leader=max(kind.leader, 0),
            t=np.zeros(count),
            given=np.zeros((count, max(1, drivers), 3)),
            q=np.zeros((count, system.coordinates)),
            rows=system.page_rows,
            regularization=kind.regularization,
            with_forces=kind.with_forces,
            at_rest=kind.at_rest,
            loads=loads,
        )
        rows = self.first_load + loads * system.coordinates
        self.found = FoundDuals(
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
