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
    """What a workspace is made for, as `DualInstants` has it; instants, drivers, and rows
    of what is found.
    """

    mode: int
    leader: int
    instants: int
    drivers: int
    page: int
    rows: int
    loads: int
    regularization: float
    with_forces: bool
    at_rest: bool


class DualWorkspace:
    """A workspace, the instants that are computed in it, and what is found.

    Attributes
    ----------
    work : Work
        Of dual numbers.
    instants : DualInstants
    found : FoundDuals
    """

    def __init__(self, system: System, kind: WorkspaceKind) -> None:
        count = kind.instants
        self.kind = kind
        self.work: Work = system.work(LANES)
        self.instants = DualInstants(
            mode=kind.mode,
            leader=max(kind.leader, 0),
            t=np.zeros(count),
            given=np.zeros((count, max(1, kind.drivers), 3)),
            q=np.zeros((count, system.coordinates)),
            rows=kind.page,
            regularization=kind.regularization,
            with_forces=kind.with_forces,
            at_rest=kind.at_rest,
            loads=kind.loads,
        )
        self.found = FoundDuals(
            output=np.zeros((count, kind.rows, LANES)), unclosed=np.zeros((count, LANES))
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
