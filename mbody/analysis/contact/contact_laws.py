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

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.complementarity import MOST_UNKNOWNS, every_solution, lemke

__all__ = ["ClosedContacts", "ModeDecision", "decide_modes", "impact_impulses"]

Array = np.ndarray

#: Part of the greatest acceleration, and of the greatest force, below which one is none.
NO_ACCELERATION, NO_FORCE = 1e-11, 1e-12
#: Accelerations without contact forces below this part of the greatest are zero.
ROUNDING = 1e-13
#: Decimals by which accelerations of several solutions differ.
SAME_KIND = 7
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

    def accelerations(self, w: Array, z: Array, size: float) -> tuple[float, ...]:
        """Those of a solution, normal and, of what may stick, tangential, rounded; forces of
        redundant contacts may differ where accelerations do not.
        """
        m, s = len(self), int((self.sliding == 0.0).sum())
        along = w[m : m + s] - z[m + s : m + 2 * s]
        found = np.concatenate([np.maximum(w[:m], 0.0), along])
        return tuple((np.round(found / size, SAME_KIND) + 0.0).tolist())

    def forces(self, z: Array) -> Array:
        """(λ_N, λ_T) (2 m,) of a solution."""
        m, mu, along = len(self), self.friction, self.sliding
        may_stick = np.flatnonzero(along == 0.0)
        tangential = -mu * along * z[:m]
        tangential[may_stick] = z[m : m + len(may_stick)] - (mu * z[:m])[may_stick]
        return np.concatenate([z[:m], tangential])


@dataclass(frozen=True, eq=False)
class ModeDecision:
    """How closed contacts go on.

    Attributes
    ----------
    modes : tuple of str
        "open", "stick", "slip+" or "slip-" each.
    pressing : array (m,)
        Normal forces of this solution.
    verdict : str
        "" where the accelerations are unique, "indeterminate" where there are several,
        "inconsistent" where there are none.
    """

    modes: tuple[str, ...]
    pressing: Array
    verdict: str = ""


def decide_modes(contacts: ClosedContacts, normal: Array, tangential: Array) -> ModeDecision:
    """How contacts that are closed and neither approach nor part go on, by the accelerations.

    Parameters
    ----------
    normal, tangential : arrays (m,)
        Accelerations without contact forces.

    Notes
    -----
    Of several solutions that of the least contact force is taken. Up to `MOST_UNKNOWNS` unknowns
    all supports are tried; of larger problems that Lemke's path solves nothing is known of others.

    Examples
    --------
    A block on a floor, pushed by less than its friction, and by more:

    >>> block = ClosedContacts(np.eye(2), np.array([0.3]), np.zeros(1))
    >>> [decide_modes(block, np.array([-9.81]), np.array([a])).modes for a in (2.0, 4.0)]
    [('stick',), ('slip+',)]
    """
    m = len(contacts)
    A, b, open_ones = contacts.problem(normal, tangential)
    size = max(float(np.abs(b).max(initial=0.0)), 1e-300)
    b = np.where(np.abs(b) < ROUNDING * size, 0.0, b)
    z, verdict = lemke(A, b), ""
    found = every_solution(A, b) if len(b) <= MOST_UNKNOWNS else []
    if z is None and not found:
        return ModeDecision(("open",) * m, np.zeros(m), "inconsistent")
    kinds = {contacts.accelerations(A @ one + b, one, size) for one in found}
    if len(kinds) > 1:
        verdict = "indeterminate"
    if z is None or verdict:
        z = min(found, key=lambda one: float(one[:m].sum()))
    return ModeDecision(_modes(contacts, A @ z + b, z, open_ones), z[:m], verdict)


def _modes(contacts: ClosedContacts, w: Array, z: Array, open_ones: Array) -> tuple[str, ...]:
    """The modes of a solution."""
    m, found = len(contacts), list[str]()
    size = max(float(np.abs(w).max(initial=0.0)), float(np.abs(z[m:]).max(initial=0.0)), 1e-300)
    big = max(float(z.max(initial=0.0)), 1e-300)
    place = {int(k): n for n, k in enumerate(open_ones)}
    for k in range(m):
        if z[k] <= NO_FORCE * big and w[k] > ROUNDING * size:
            found.append("open")
        elif k not in place:
            found.append("slip+" if contacts.sliding[k] > 0.0 else "slip-")
        else:
            n = m + place[k]
            ahead = w[n] - z[n + len(open_ones)]
            still = abs(ahead) <= NO_ACCELERATION * size
            found.append("stick" if still else "slip+" if ahead > 0.0 else "slip-")
    return tuple(found)


def impact_impulses(
    contacts: ClosedContacts,
    before: Array,
    restitution: Array,
    newton: Array | None = None,
    *,
    without_collision: bool = False,
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
    z = lemke(A, b)
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
    z = lemke(A, b)
    if z is None:
        return None
    more = contacts.forces(z)
    more[:m] += given
    more[m:] -= resting
    return impulse + more
