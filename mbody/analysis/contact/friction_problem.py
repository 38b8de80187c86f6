"""Contacts, ropes and frictional joints at one instant: who opens, sticks and slides; impacts.

`FrictionProblem` and `ClosedContacts` state what `mbody.kernels.contact_decision` solves.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.kernels import contact_decision as kernels
from mbody.kernels.complementarity import (
    CONE,
    ContactProblem,
    joint_arms,
    law_sizes,
    problem_memory,
)
from mbody.kernels.contact_decision import ContactDecision, solve_decision
from mbody.kernels.contact_geometry import FOUND, ContactWork
from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.layout import Work
from mbody.system.system import System

Array = np.ndarray


class _Memory(threading.local):
    """Memory of the kernel of every size, one for each thread."""

    def __init__(self) -> None:
        self.problems: dict[int, tuple[ContactDecision, ContactProblem]] = {}

    def of(self, n: int) -> tuple[ContactDecision, ContactProblem]:
        if n not in self.problems:
            self.problems[n] = kernels.decision_memory(n), problem_memory(n)
        return self.problems[n]


_memory = _Memory()


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


# -- The problem of one instant ----------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Tangent:
    """One tangent row of a contact, with friction.

    `normal`: The row of the normal that presses it.
    `friction`: The coefficient of a contact: the static one of what is at rest.
    `begun`: The tangent once it slides, whose friction is kinetic; None where it is the same.
    `sliding`: Sign of the rate of what slides, zero of what is at rest.
    `given`: Normal impulse that counts beside the unknown one.
    """

    normal: int
    friction: float = 0.0
    sliding: float = 0.0
    given: float = 0.0
    begun: Tangent | None = None


@dataclass(frozen=True, eq=False)
class FrictionProblem:
    """All that may open or slide at one instant.

    `normals`: Contacts that are closed.
    `accelerations` (normals + tangents,): c₀, along the rows with the forces f₀.
    `delassus` (normals + tangents, normals + tangents)
    `forces` (normals + tangents,): f₀.
    `noise` (normals + tangents,): Rounding of the accelerations.
    `soft` (normals + tangents,): Delassus's diagonal without joints, the scale of what is driven.
    """

    normals: int
    tangents: tuple[Tangent, ...]
    accelerations: Array
    delassus: Array
    forces: Array
    noise: Array | None = None
    soft: Array | None = None

    def __len__(self) -> int:
        return len(self.accelerations)

    @property
    def without(self) -> Array:
        """Accelerations without the forces f."""
        return self.accelerations - self.delassus @ self.forces

    def solve(self) -> FrictionSolution | None:
        """One solution; None where none was found."""
        found, _ = self.solutions(every=False)
        return found[0] if found else None

    def solutions(
        self, *, every: bool = True, begins: bool = False
    ) -> tuple[list[FrictionSolution], bool]:
        """Solutions with different accelerations, the one to be taken first, and whether all sets
        of modes were tried: of few rows that are connected all are, unless one of them is enough.
        Where something `begins` to slide with its kinetic friction, as it goes on.

        Of several that of the least contact force is taken. Rows that depend on each other leave
        forces open; by them solutions are not told apart.

        Examples
        --------
        A block on a floor, pushed by less than its friction, and by more:

        >>> def block(push):
        ...     c = np.array([-9.81, push])
        ...     return FrictionProblem(1, (cone(0, 0.3),), c, np.eye(2), np.zeros(2))
        >>> [block(push).solutions()[0][0].modes() for push in (2.0, 4.0)]
        [(('closed',), ('stick',)), (('closed',), ('slip+',))]
        """
        D, P = self.loaded()
        count = solve_decision(D, P, kernels.FIND, int(every))
        found = []
        for number in range(count):
            solve_decision(D, P, kernels.BEGIN if begins else kernels.TAKE, number)
            found.append(FrictionSolution.taken(self, D))
        return found, bool(D.count[kernels.TRIED])

    def loaded(self) -> tuple[ContactDecision, ContactProblem]:
        """The memory of the kernels with the problem."""
        n, m = len(self), self.normals
        D, P = _memory.of(n)
        D.count[:2] = n, m
        D.delassus[:], D.c[:], D.f0[:] = self.delassus, self.accelerations, self.forces
        D.noise[:] = 0.0 if self.noise is None else self.noise
        D.soft[:] = 0.0 if self.soft is None else self.soft
        for r, one in enumerate(self.tangents, start=m):
            begun = one.begun or one
            D.sliding[r], D.kinetic[r], D.given[r] = one.sliding, begun is not one, one.given
            D.normal[r], D.mu[r], D.kinetic_mu[r] = one.normal, one.friction, begun.friction
            D.law[r] = CONE
        return D, P


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """Forces that fulfil the law of Coulomb.

    `forces` (normals + tangents,)
    `accelerations` (normals + tangents,): Along all rows.
    `mode` (normals + tangents,): Of normals 0 open, 1 closed; of tangents 0 stick, ±1 slip.
    `residual`: What the laws are violated by, without dimensions.
    """

    problem: FrictionProblem
    forces: Array
    accelerations: Array
    mode: Array
    residual: float = 0.0

    @classmethod
    def taken(cls, problem: FrictionProblem, D: ContactDecision) -> FrictionSolution:
        """That which the kernels have taken."""
        return cls(problem, D.f.copy(), D.w.copy(), D.mode.copy(), float(D.worst[0]))

    def modes(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Of the contacts "open" or "closed", of the tangents "stick", "slip+" or "slip-"."""
        m = self.problem.normals
        words = {0: "stick", 1: "slip+", -1: "slip-"}
        return (
            tuple("closed" if one else "open" for one in self.mode[:m]),
            tuple(words[int(one)] for one in self.mode[m:]),
        )


def cone(normal: int, friction: float, sliding: float = 0.0) -> Tangent:
    """The tangent of a contact: μ N both ways."""
    return Tangent(normal, friction, sliding)


# -- Impacts -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ClosedContacts:
    """Closed contacts at one instant.

    `delassus` (2 m, 2 m): Normals before tangents.
    `friction` (m,): Coefficients; zero of what has no tangent.
    `noise` (2 m,): Rounding of the velocities.
    """

    delassus: Array
    friction: Array
    noise: Array | None = None

    def __len__(self) -> int:
        return len(self.friction)

    @property
    def rows(self) -> Array:
        """Normals and those tangents that have friction."""
        m = len(self)
        return np.concatenate([np.arange(m), m + np.flatnonzero(self.friction > 0.0)])

    def solution(self, before: Array, given: Array) -> FrictionSolution | None:
        """(Λ_N, Λ_T) and their modes from velocities `before` (2 m,) without them, with normal
        impulses `given` (m,) that count in the cones; None where there are none.
        """
        problem, rows = self.problem(before, given), self.rows
        D, P = problem.loaded()
        D.shifted[:], D.given_law[: len(self)] = before[rows], given
        if not solve_decision(D, P, kernels.STAGE, 0):
            return None
        return FrictionSolution.taken(problem, D)

    def solve(self, before: Array, given: Array) -> Array | None:
        """The impulses (2 m,) of `solution`."""
        one = self.solution(before, given)
        return None if one is None else self.spread(one.forces)

    def impulses(
        self, before: Array, restitution: Array, newton: Array, *, without_collision: bool = False
    ) -> Array | None:
        """Impulses (2 m,) of an impact from velocities `before` (2 m,), normals before tangents;
        None where there is no solution. `restitution`, `newton` (m,): which contacts follow
        Newton's law, γ_N⁺ = −e γ_N⁻ where they take part; the others follow Poisson's.

        Examples
        --------
        A ball of mass 1 that falls by 2 and keeps half:

        >>> ball = ClosedContacts(np.eye(2), np.zeros(1))
        >>> ball.impulses(np.array([-2.0, 0.0]), np.array([0.5]), np.array([False]))
        array([3., 0.])
        """
        m, rows = len(self), self.rows
        D, P = self.problem(before, np.zeros(m)).loaded()
        D.before[:], D.restitution[:m], D.newton[:m] = before[rows], restitution, newton
        task = kernels.WITHOUT_COLLISION if without_collision else kernels.IMPACT
        return self.spread(D.impulse) if solve_decision(D, P, task, 0) else None

    def spread(self, impulses: Array) -> Array:
        """Impulses (2 m,) of those of `rows`."""
        found = np.zeros(2 * len(self))
        found[self.rows] = impulses
        return found

    def modes(self, one: FrictionSolution) -> tuple[Array, Array]:
        """Rows that hold (2 m,) and directions of tangents that slide (m,) by a solution."""
        m, frictional = len(self), np.flatnonzero(self.friction > 0.0)
        hold, slip_signs = np.zeros(2 * m, dtype=bool), np.zeros(m)
        hold[:m], slip_signs[frictional] = one.mode[:m] == 1, one.mode[m:]
        hold[m + frictional] = (one.mode[m:] == 0) & hold[frictional]
        return hold, slip_signs

    def problem(self, before: Array, given: Array) -> FrictionProblem:
        """The problem, with tangents of what has friction alone."""
        m, rows = len(self), self.rows
        tangents = tuple(
            Tangent(int(k), float(self.friction[k]), given=float(given[k])) for k in rows[m:] - m
        )
        noise = None if self.noise is None else self.noise[rows]
        D = self.delassus[np.ix_(rows, rows)]
        return FrictionProblem(m, tangents, before[rows], D, np.zeros(len(rows)), noise)


def arresting_impulses(D: Array, rates: Array) -> Array:
    """Impulses −D⁺ rates that stop rows; of least scaled norm where rows depend on each other."""
    n, found = len(D), np.zeros(len(D))
    memory, _ = _memory.of(n)
    memory.count[0], memory.delassus[:] = n, D
    kernels.find_arrest(memory, np.ascontiguousarray(rates), found)
    return found


# -- The impulses of one step of a fixed length ------------------------------------------------


def rows_of_contacts(contacts: ContactWork, which: Array) -> Array:
    """W of some contacts: (2 m, coordinates + 3), normals before tangents."""
    g, who = contacts.geometry[which], contacts.who[which]
    m = len(which)
    found = np.zeros((2 * m, len(contacts.velocity)))
    for k, (nx, ny) in enumerate((g[:, :2].T, np.array([g[:, 1], -g[:, 0]]))):
        for side, sign in ((0, -1.0), (1, 1.0)):
            rx, ry = g[:, 2 + 2 * side], g[:, 3 + 2 * side]
            for n, part in enumerate((nx, ny, rx * ny - ry * nx)):
                found[k * m + np.arange(m), 3 * who[:, side] + n] += sign * part
    found[:, -3:] = 0.0
    return found


def delassus(contacts: ContactWork, which: Array) -> tuple[Array, Array]:
    """D of some contacts, normals before tangents, and their rows W."""
    W, m = rows_of_contacts(contacts, which), len(which)
    Y = W * contacts.inverse
    Y[:, contacts.coupled] = 0.0
    for k, c in enumerate(which):
        column = int(contacts.column[c])
        if column >= 0:
            Y[k, contacts.coupled] = contacts.response[2 * column]
            Y[m + k, contacts.coupled] = contacts.response[2 * column + 1]
    return W @ Y.T, W


def impulses_by_lemke(contacts: ContactWork) -> Array | None:
    """(P_N, P_T) of all contacts of the step that is under way; None where no solution is found."""
    count = int(contacts.counts[FOUND])
    which = np.flatnonzero(np.isfinite(contacts.effect[:count, 4]))
    m, found = len(which), np.zeros((count, 2))
    if not m:
        return found
    D, W = delassus(contacts, which)
    before = W @ contacts.free
    before[:m] += contacts.effect[which, 4]
    impulses = ClosedContacts(D, contacts.effect[which, 3]).solve(before, np.zeros(m))
    if impulses is None:
        return None
    found[which] = impulses.reshape(2, m).T
    return found
