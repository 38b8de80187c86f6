"""Which contacts open, stick or slide, and what an impact gives: complementarity problems.

Closed contacts have relative velocities γ = (γ_N, γ_T) and Delassus's matrix D = W M⁻¹ Wᵀ of what
the joints leave free, rows of all normals before those of all tangents, so that contact forces λ
add D λ to the accelerations b that there would be without. With λ_R = μ λ_N + λ_T, the reserve of
friction on one side, a contact that may stick has

    0 ≤ w_N ⊥ λ_N ≥ 0,   0 ≤ a_T⁺ ⊥ λ_R ≥ 0,   0 ≤ 2 μ λ_N − λ_R ⊥ a_T⁻ ≥ 0,

a_T = a_T⁺ − a_T⁻; one that slides with sense s has λ_T = −μ s λ_N and the first of them alone. The
same with velocities and impulses is an impact.

Pfeiffer, Glocker: Multibody Dynamics with Unilateral Contacts (1996), 6 and 8.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.complementarity import lemke

__all__ = ["ClosedContacts", "impact_impulses"]

Array = np.ndarray

#: Part of the greatest impulse below which one is none.
NO_FORCE = 1e-12
#: How far the approach is shifted, in parts of the greatest velocity, where an impact without
#: collision is sought; the support that is found is solved without the shift.
SHIFT = 1e-9


@dataclass(frozen=True, eq=False)
class ClosedContacts:
    """Closed contacts at one instant.

    Attributes
    ----------
    delassus : array (2 m, 2 m)
        Normals before tangents.
    friction : array (m,)
        Coefficients: kinetic of those that slide and in impacts, static of those that may stick.
    sliding : array (m,)
        Signs of the tangential velocities, zero of contacts that do not slide.
    """

    delassus: Array
    friction: Array
    sliding: Array

    def __len__(self) -> int:
        return len(self.friction)

    def problem(self, normal: Array, tangential: Array) -> tuple[Array, Array, Array]:
        """(A, b) in (λ_N, λ_R, a_T⁻), and which contacts have the last two.

        Parameters
        ----------
        normal, tangential : arrays (m,)
            Accelerations, or velocities, without contact forces.
        """
        m, mu, D = len(self), self.friction, self.delassus
        open_ones = np.flatnonzero(self.sliding == 0.0)
        E = np.zeros((m, len(open_ones)))
        E[open_ones, np.arange(len(open_ones))] = 1.0
        # λ_T = λ_R − μ λ_N of what may stick, −μ s λ_N of what slides
        factor = -mu * np.where(self.sliding == 0.0, 1.0, self.sliding)
        NN, TN = D[:m, :m] + D[:m, m:] * factor, D[m:, :m] + D[m:, m:] * factor
        s = len(open_ones)
        A = np.block(
            [
                [NN, D[:m, m:] @ E, np.zeros((m, s))],
                [E.T @ TN, E.T @ D[m:, m:] @ E, np.eye(s)],
                [2.0 * (E * mu[:, None]).T, -np.eye(s), np.zeros((s, s))],
            ]
        )
        return A, np.concatenate([normal, tangential[open_ones], np.zeros(s)]), open_ones

    def forces(self, z: Array) -> Array:
        """(λ_N, λ_T) (2 m,) of a solution."""
        m, mu, along = len(self), self.friction, self.sliding
        may_stick = np.flatnonzero(along == 0.0)
        tangential = -mu * along * z[:m]
        tangential[may_stick] = z[m : m + len(may_stick)] - (mu * z[:m])[may_stick]
        return np.concatenate([z[:m], tangential])


def impact_impulses(
    contacts: ClosedContacts,
    before: Array,
    restitution: Array,
    newton: Array | None = None,
    *,
    without_collision: bool = False,
    solve: Callable[[Array, Array], Array | None] = lemke,
) -> Array | None:
    """Impulses (2 m,) of an impact, normals before tangents; None where there is no solution.

    Parameters
    ----------
    contacts : ClosedContacts
        With `sliding` zero: the impact decides it.
    before : array (2 m,)
        Relative velocities.
    restitution : array (m,)
    newton : array (m,) of bool, optional
        Which contacts follow Newton's law, γ_N⁺ = −e γ_N⁻ where they take part; the others, by
        default all, Poisson's: compression until nothing approaches, then each gives back its part
        of what it took, or more where others need it.
    without_collision : bool
        The solution that has an impulse though nothing approaches: Painlevé's.
    solve : callable
        What solves the problems of complementarity (A, b).

    Examples
    --------
    A ball of mass 1 that falls by 2 and keeps half:

    >>> ball = ClosedContacts(np.eye(2), np.zeros(1), np.zeros(1))
    >>> impact_impulses(ball, np.array([-2.0, 0.0]), np.array([0.5]))
    array([3., 0.])
    """
    m, mu, D = len(contacts), contacts.friction, contacts.delassus
    by_newton = np.zeros(m, dtype=bool) if newton is None else newton
    shifted = before.copy()
    shifted[:m] += np.where(by_newton, restitution, 0.0) * np.minimum(before[:m], 0.0)
    if without_collision:
        shifted[:m] -= SHIFT * float(np.abs(before).max())
    A, b, _ = contacts.problem(shifted[:m], shifted[m:])
    z = solve(A, b)
    if z is None:
        return None
    if without_collision:
        support = np.flatnonzero(z > NO_FORCE * z.max())
        exact = np.zeros_like(z)
        _, right, _ = contacts.problem(before[:m], before[m:])
        try:
            exact[support] = np.linalg.solve(A[np.ix_(support, support)], -right[support])
        except np.linalg.LinAlgError:
            return None  # impulses of rows that depend on each other have no one solution
        z = exact
    impulse = contacts.forces(z)
    given = np.where(by_newton, 0.0, restitution) * impulse[:m]
    if not given.any():
        return impulse
    # expansion: Λ_N = given + more, Λ_T within the cone of all of it
    # what follows Newton's law has its velocity already
    after = shifted + D @ impulse
    resting = np.where(contacts.sliding == 0.0, mu * given, 0.0)
    start = after + D[:, :m] @ given - D[:, m:] @ resting
    A, b, may_stick = contacts.problem(start[:m], start[m:])
    b[m + len(may_stick) :] = 2.0 * (mu * given)[may_stick]
    z = solve(A, b)
    if z is None:
        return None
    more = contacts.forces(z)
    more[:m] += given
    more[m:] -= resting
    return impulse + more
