"""Interface of a motion with contacts or frictional joints to the decision of modes and guards."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Protocol

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.dynamics.integrators import Motion
from mbody.core import tolerances as tol
from mbody.kernels.complementarity import ContactProblem, problem_memory
from mbody.kernels.contact_impacts import (
    STILL,
    impact_memory,
    strike_contacts,
    tangent_responses,
)
from mbody.kernels.contact_modes import FORWARD, NONE, OPEN, modes_memory
from mbody.kernels.layout import Layout, Work
from mbody.kernels.mode_problem import ALL_ROWS, ContactDecision, decision_memory

Array = np.ndarray


#: Modes by their numbers in the kernels.
MODES = ("open", "stick", "slip+", "slip-")
#: Rows of the problem for which there is memory at first.
FEW_ROWS = 16


class DecisionMemory:
    """What the kernels need that decide the modes of a motion.

    `modes`: Modes, and what an event has decided.
    `problem`: The problem of closed contacts and frictional joints.
    `impact`: An impact.
    """

    def __init__(self, uni: Unilateral) -> None:
        L, self.uni = uni.layout, uni
        counts = len(uni.contact_points), len(uni.friction_joints), 3 * L.bodies
        self.modes = modes_memory(*counts, L.nodes, uni.system.state_count)
        self.impact = impact_memory(L, *counts[:2])
        points = uni.contact_points
        self.impact.restitution[:] = [one.restitution for one in points]
        self.impact.newton[:] = [one.law == "newton" for one in points]
        self.grow(FEW_ROWS)
        self.forget()

    def grow(self, n: int) -> None:
        """Memory for so many rows."""
        L = self.uni.layout
        self.problem = decision_memory(n, 3 * L.bodies, L.nodes), problem_memory(n)

    def ready(self, motion: ModalMotion, rows: int) -> tuple[ContactDecision, ContactProblem]:
        """The problem, for so many rows, with the numbers of the factor of the joints."""
        if rows > len(self.problem[0].c):
            self.grow(2 * rows)
        D, T = self.problem[0], motion.motion.tolerances
        D.regularization[0] = motion.regularization
        D.refinements[:] = T.refinements, T.full_refinements
        return self.problem

    @property
    def rows_needed(self) -> int:
        """How many rows the problem has, at most, that there was no memory for."""
        return int(self.problem[0].count[ALL_ROWS])

    def forget(self) -> None:
        """All contact points are open, and all frictional joints slip; nothing was struck."""
        points, M = len(self.uni.contact_points), self.modes
        M.mode[:points], M.mode[points:], M.leader[:] = OPEN, FORWARD, -1
        M.leader[points:] = np.arange(points, len(M.leader))
        for table in (M.closed, M.opened, M.beyond, M.stopped, M.begun):
            table[:] = 0
        self.impact.struck[:] = -np.inf

    def rests(self, motion: ModalMotion, closed: list[int]) -> bool:
        """Whether closed contact points can be struck without restitution."""
        M, I = self.modes, self.impact
        M.touches[:], I.held[:] = 0, 0
        M.touches[closed] = 1
        bundles = motion.layout, motion.work, self.uni.table, M
        return int(strike_contacts(*bundles, *self.ready(motion, 0), I, STILL)) != NONE

    def responses(self, motion: ModalMotion, points: Array, softer: float) -> ContactDecision:
        """Responses to the tangents of contact points, motions without mass being `softer`."""
        D, _ = self.ready(motion, len(points))
        which = np.ascontiguousarray(points, dtype=np.int64)
        bundles = motion.layout, motion.work, self.uni.table, D, self.impact
        tangent_responses(*bundles, which, softer)
        return D


class ModalMotion(Protocol):
    """A motion with rows of the active set.

    `work`: The workspace of its steps.
    `regularization`: The proximal term of redundant rows.
    `motion`: Bundles of the kernels of steps.
    """

    layout: Layout
    work: Work
    motion: Motion
    regularization: float


#: Refinements of accelerations, at most.
MOST_REFINEMENTS = 32


def refined_where_uneven(motion: Motion, uni: Unilateral) -> Motion:
    """A motion of the kernels with refinements for masses that differ: forces on the heavy cancel
    on the light.
    """
    tolerances, uneven = motion.tolerances, uni.unevenness.max(initial=0.0)
    if uneven <= tol.MASSES_UNEVEN:
        return motion
    count, left = MOST_REFINEMENTS, tol.REFINEMENT_LEAVES * uneven
    if left < 1.0:
        count = min(count, math.ceil(math.log(tol.MACHINE_EPSILON) / math.log(left)))
    most = max(tolerances.full_refinements, count)
    exact = tolerances.replaced(refinements=most, full_refinements=most)
    return replace(motion, tolerances=exact)
