"""Interface of a motion with contacts or frictional joints to the decision of modes and guards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.dynamics.events import Guard
from mbody.analysis.dynamics.integrators import Motion
from mbody.core import tolerances as tol
from mbody.kernels.complementarity import ContactProblem, problem_memory
from mbody.kernels.contact_guards import Guards
from mbody.kernels.contact_impacts import (
    SMALL,
    impact_memory,
    resolve_impact,
    strike_contacts,
    tangent_responses,
)
from mbody.kernels.contact_modes import FULL, UnilateralModes, decide_modes, modes_memory
from mbody.kernels.force_programs import OpenForces, open_forces_memory
from mbody.kernels.layout import Layout, Work
from mbody.kernels.linear_program import LinearProgram
from mbody.kernels.mode_problem import ALL_ROWS, ContactDecision, decision_memory
from mbody.system.system import System

Array = np.ndarray


@dataclass
class ModeTransition:
    """Mode changes that an event has just decided, at the limit of complementarity.

    `closed`: Contact points that are closed, though their gap is rounding.
    `opened`: Contact points that open.
    `sliding`: Directions of what begins to slide, by the number of the contact point or, after
      these, of the frictional joint.
    `stopped`: What ceases to slide, likewise.
    """

    closed: set[int] = field(default_factory=set)
    opened: set[int] = field(default_factory=set)
    sliding: dict[int, float] = field(default_factory=dict)
    stopped: set[int] = field(default_factory=set)


@dataclass(frozen=True)
class Reserve:
    """How far forces that no equation decides are from their limits.

    Attributes
    ----------
    least : float
        The greatest reserve that all can have [force].
    sliding : dict
        The directions in which what has no more would slide, by the number of the contact point or,
        after these, of the frictional joint.
    opened : set of int
        Contact points that would open.
    """

    least: float
    sliding: dict[int, float]
    opened: set[int]


class SharedForces(Protocol):
    """Forces of what sticks that no equation decides (`mbody.analysis.dynamics.shared_friction`).

    Attributes
    ----------
    members : frozenset of int
        What sticks, contact points and, after these, frictional joints, whose forces are open.
    pressing : frozenset of int
        Contact points whose normal forces are open.
    """

    @property
    def pressing(self) -> frozenset[int]:
        """Contacts whose normal forces are undetermined."""

    @property
    def parts(self) -> tuple[tuple[int, ...], ...]:
        """All of it, to be kept."""

    @property
    def members(self) -> frozenset[int]:
        """Sticking contacts and frictional joints whose forces are undetermined."""

    def watch(self, motion: ModalMotion) -> None:
        """Give its forces to the guards of a motion."""

    def reserve(self, motion: ModalMotion, record: Array, work: Work) -> Reserve:
        """The greatest reserve by a record (rows,), with the rows of that position."""


#: Modes by their numbers in the kernels.
MODES = ("open", "stick", "slip+", "slip-", "redundant")
#: Rows of the problem for which there is memory at first.
FEW_ROWS = 16


class DecisionMemory:
    """What the kernels need that decide the modes of a motion.

    `modes`: Modes, and what an event has decided.
    `problem`: The problem of closed contacts and frictional joints.
    `impact`: An impact.
    `open`: Forces that no equation decides, and the program of their margin, by their numbers.
    """

    def __init__(self, uni: Unilateral) -> None:
        L, self.uni = uni.layout, uni
        counts = len(uni.contact_points), len(uni.friction_joints), 3 * L.bodies
        self.modes = modes_memory(*counts, L.nodes, uni.system.state_count)
        self.impact = impact_memory(L, *counts[:2])
        points = uni.contact_points
        self.impact.restitution[:] = [one.restitution for one in points]
        self.impact.newton[:] = [one.law == "newton" for one in points]
        self.open: dict[tuple[int, ...], tuple[OpenForces, LinearProgram]] = {}
        self.grow(FEW_ROWS)

    def open_forces(self, *size: int) -> tuple[OpenForces, LinearProgram]:
        """Memory for so many coordinates, forces, linear limits and pairs of limits that bend."""
        if size not in self.open:
            self.open[size] = open_forces_memory(*size)
        return self.open[size]

    def grow(self, n: int) -> None:
        """Memory for so many rows."""
        L = self.uni.layout
        self.problem = decision_memory(n, 3 * L.bodies, L.nodes), problem_memory(n)

    def take(self, motion: ModalMotion) -> UnilateralModes:
        """The modes with what an event has decided."""
        M, transition = self.modes, motion.transition
        sets = (transition.closed, transition.opened, motion.beyond, transition.stopped)
        for into, which in zip((M.closed, M.opened, M.beyond, M.stopped), sets, strict=True):
            into[:] = 0
            into[list(which)] = 1
        M.begun[:] = 0.0
        for n, slip_sign in transition.sliding.items():
            M.begun[n] = slip_sign
        return M

    def ready(self, motion: ModalMotion, rows: int = 0) -> tuple[ContactDecision, ContactProblem]:
        """The problem, for so many rows, with the numbers of the factor of the joints."""
        if rows > len(self.problem[0].c):
            self.grow(2 * rows)
        D, full = self.problem[0], motion.motion.tolerances.full_refinements
        D.regularization[0], D.refinements[:] = (
            self.uni.regularization,
            (self.uni.refinements, full),
        )
        return self.problem

    @property
    def rows_needed(self) -> int:
        """How many rows the problem has, at most, that there was no memory for."""
        return int(self.problem[0].count[ALL_ROWS])

    def decide(self, motion: ModalMotion) -> int:
        """What `mbody.kernels.contact_modes.decide` finds; memory grows as needed."""
        M, rows = self.take(motion), 0
        bundles = motion.layout, motion.work, motion.motion.stepping, self.uni.table, M
        while (found := decide_modes(*bundles, *self.ready(motion, rows))) == FULL:
            rows = self.rows_needed
        return int(found)

    def strike(self, motion: ModalMotion, closed: list[int], kind: int) -> int:
        """What `mbody.kernels.contact_impacts.strike` finds, likewise."""
        M, I, rows = self.modes, self.impact, 0
        M.touches[:] = 0
        M.touches[closed] = 1
        bundles = motion.layout, motion.work, self.uni.table, M
        while (found := strike_contacts(*bundles, *self.ready(motion, rows), I, kind)) == FULL:
            rows = self.rows_needed
        return int(found)

    def resolve(self, motion: ModalMotion, struck: Mapping[int, float]) -> int:
        """What `mbody.kernels.contact_impacts.resolve` finds, likewise. `struck`: when contact
        points were struck last.
        """
        M, I, rows = self.take(motion), self.impact, 0
        I.struck[:] = -np.inf
        I.struck[list(struck)] = list(struck.values())
        bundles = motion.layout, motion.work, motion.motion.stepping, self.uni.table, M
        while (found := resolve_impact(*bundles, *self.ready(motion, rows), I)) == SMALL:
            rows = self.rows_needed
        return int(found)

    def responses(self, motion: ModalMotion, points: Array, softer: float) -> ContactDecision:
        """Responses to the tangents of contact points, motions without mass being `softer`."""
        D, _ = self.ready(motion, len(points))
        which = np.ascontiguousarray(points, dtype=np.int64)
        bundles = motion.layout, motion.work, self.uni.table, D, self.impact
        tangent_responses(*bundles, which, softer)
        return D


class ModalMotion(Protocol):
    """A motion with rows of the active set.

    `uni`: Its contact points and frictional joints.
    `modes`, `pairs`: Their modes.
    `groups`: Contact points that stick by the row of one of them, by its number.
    `shared`: What sticks with forces that no equation decides.
    `beyond`: Open contact points that have left their edge over its end.
    `guards`: What is watched.
    `guard_table`: Guards as the kernels take them.
    `fresh`: What is rounding of guards that began at zero.
    `y`, `K`, `record`, `scale`: State, derivatives, what is kept of the instant, sizes of the
      coordinates.
    `work`, `probe`: That of the steps, and one to look at other positions.
    `motion`, `memory`: Bundles of the kernels of steps, and of those that decide modes.
    """

    system: System
    layout: Layout
    uni: Unilateral
    modes: list[str]
    pairs: list[str]
    transition: ModeTransition
    groups: dict[int, list[int]]
    shared: SharedForces | None
    beyond: set[int]
    guards: list[Guard]
    guard_table: Guards
    fresh: dict[Guard, float]
    y: Array
    K: Array
    record: Array
    scale: Array
    work: Work
    probe: Work
    motion: Motion
    memory: DecisionMemory

    @property
    def speeds(self) -> Array:
        """Velocity scales of contact points and frictional joints."""

    @property
    def gap_tolerance(self) -> float:
        """Gaps up to this are none [length]."""

    def load(self) -> None:
        """The present state into the workspace."""

    def evaluate(self) -> bool:
        """Project the state, evaluate its derivative and its record."""

    def take_modes(self) -> None:
        """The modes and rows that the kernels have set, evaluated."""


#: Refinements of accelerations, at most.
MOST_REFINEMENTS = 32


def refined_where_uneven(motion: Motion, uni: Unilateral) -> Motion:
    """A motion of the kernels with refinements for masses that differ: forces on the heavy cancel
    on the light.
    """
    tolerances, uneven = motion.tolerances, uni.unevenness.max(initial=0.0)
    uni.refinements = tolerances.refinements
    if uneven <= tol.MASSES_UNEVEN:
        return motion
    count, left = MOST_REFINEMENTS, tol.REFINEMENT_LEAVES * uneven
    if left < 1.0:
        count = min(count, math.ceil(math.log(tol.MACHINE_EPSILON) / math.log(left)))
    uni.refinements = most = max(tolerances.full_refinements, count)
    exact = tolerances.replaced(refinements=most, full_refinements=most)
    return replace(motion, tolerances=exact)
