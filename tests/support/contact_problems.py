"""Problems of contacts stated by arrays, solved by the kernels that decide modes and impacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.kernels import mode_problem as kernels
from mbody.kernels.complementarity import CONE, ContactProblem, problem_memory
from mbody.kernels.mode_problem import ContactDecision, solve_decision

Array = np.ndarray


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
        D, P = kernels.decision_memory(n), problem_memory(n)
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


def impulses(contacts, before, restitution, newton, *, without_collision=False):
    """Impulses (2 m,) of an impact from velocities `before` (2 m,), normals before tangents; None
    where there is no solution. `restitution`, `newton` (m,): which contacts follow Newton's law,
    γ_N⁺ = −e γ_N⁻ where they take part; the others follow Poisson's.
    """
    m, rows, found = len(contacts), contacts.rows, np.zeros(2 * len(contacts))
    D, P = contacts.loaded()
    D.before[:], D.restitution[:m], D.newton[:m] = before[rows], restitution, newton
    task = kernels.WITHOUT_COLLISION if without_collision else kernels.IMPACT
    if not solve_decision(D, P, task, 0):
        return None
    found[rows] = D.impulse
    return found


def outcomes(contacts, before):
    """How many velocities fulfil the laws of an impact without restitution from `before` (2 m,)."""
    m, (D, P) = len(contacts), contacts.loaded()
    D.before[:], D.restitution[:m], D.newton[:m] = before[contacts.rows], 0.0, 0
    found = solve_decision(D, P, kernels.IMPACT, 0)
    return int(D.outcomes[: len(contacts.rows)].max()) if found else 0
