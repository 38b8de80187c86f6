"""Friction of joints by what presses them, and impulses of closed contacts by their matrix, which
`mbody.kernels.mode_problem` finds.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.kernels import mode_problem as kernels
from mbody.kernels.complementarity import (
    CONE,
    ContactProblem,
    joint_arms,
    law_sizes,
    problem_memory,
)
from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.layout import Work
from mbody.kernels.mode_problem import ContactDecision, solve_decision
from mbody.system.system import System

Array = np.ndarray


class _ProblemMemory(threading.local):
    """Memory of the kernel of every size, one for each thread."""

    def __init__(self) -> None:
        self.problems: dict[int, tuple[ContactDecision, ContactProblem]] = {}

    def of(self, n: int) -> tuple[ContactDecision, ContactProblem]:
        if n not in self.problems:
            self.problems[n] = kernels.decision_memory(n), problem_memory(n)
        return self.problems[n]


_memory = _ProblemMemory()


# -- Friction of a joint for the multipliers that press it, with its derivatives ----------------


class JointFriction:
    """Friction of friction pair f at the position, rates and signals in a workspace: the static
    one, or that of a rate of sliding.
    """

    def __init__(self, system: System, work: Work, f: int, rate: float | None = None) -> None:
        L = system.runtime()
        self.number, self.node = int(L.friction_kind[f]), int(L.friction_node[f])
        self.kind, self.first = (
            FRICTION_KINDS[self.number],
            float(work.par[L.friction_par[f] + 4, 0]),
        )
        self.arm = np.zeros(7)
        if rate is not None:
            work.rate[f, 0] = rate
        joint_arms(L, work, f, rate is None, self.arm)
        self.mu = float(self.arm[6])

    @property
    def by_law(self) -> bool:
        """Whether its size follows a law alone."""
        return self.kind in ("torque", "force")

    def size(self, x: Any, y: Any, slip_sign: float) -> tuple[Any, Any, Any]:
        """φ by both multipliers, numbers or arrays, and its derivatives by them; `slip_sign` of the
        sliding, or of that which would begin.
        """
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        found = np.empty((3, x.size))
        arm = self.arm[:3] if slip_sign >= 0.0 else self.arm[3:6]
        law_sizes(self.number, arm, x.ravel(), y.ravel(), found)
        size, by_x, by_y = found.reshape(3, *x.shape)
        return size[()], by_x[()], by_y[()]


# -- Impulses of closed contacts -----------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ClosedContacts:
    """Closed contacts at one instant.

    `delassus` (2 m, 2 m): Normals before tangents.
    `friction` (m,): Coefficients; zero of what has no tangent.
    """

    delassus: Array
    friction: Array

    def __len__(self) -> int:
        return len(self.friction)

    @property
    def rows(self) -> Array:
        """Normals and those tangents that have friction."""
        m = len(self)
        return np.concatenate([np.arange(m), m + np.flatnonzero(self.friction > 0.0)])

    def loaded(self) -> tuple[ContactDecision, ContactProblem]:
        """The memory of the kernels with the rows, at rest."""
        m, rows = len(self), self.rows
        D, P = _memory.of(len(rows))
        D.count[:2] = len(rows), m
        D.delassus[:] = self.delassus[np.ix_(rows, rows)]
        for array in (D.noise, D.soft, D.sliding, D.given, D.kinetic, D.given_law):
            array[:] = 0
        D.law[:], D.normal[m:], D.mu[m:] = CONE, rows[m:] - m, self.friction[rows[m:] - m]
        return D, P

    def solve(self, before: Array, given: Array) -> Array | None:
        """(Λ_N, Λ_T) (2 m,) from velocities `before` (2 m,) without them, with normal impulses
        `given` (m,) that count in the cones; None where there are none.
        """
        D, P = self.loaded()
        D.shifted[:], D.given_law[: len(self)] = before[self.rows], given
        if not solve_decision(D, P, kernels.STAGE, 0):
            return None
        found = np.zeros(2 * len(self))
        found[self.rows] = D.f
        return found


def arresting_impulses(D: Array, rates: Array) -> Array:
    """Impulses −D⁺ rates that stop rows; of least scaled norm where rows depend on each other."""
    n, found = len(D), np.zeros(len(D))
    memory, _ = _memory.of(n)
    memory.count[0], memory.delassus[:] = n, D
    kernels.find_arrest(memory, np.ascontiguousarray(rates), found)
    return found
