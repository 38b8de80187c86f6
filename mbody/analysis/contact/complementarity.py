"""Linear complementarity problems: w = A z + b with 0 ≤ w ⊥ z ≥ 0, small and dense.

`lemke` follows Lemke's path with the lexicographic ratio test, so that it cannot cycle where
several ratios are equal. Where rows depend on each other, as in a pile that contacts hold more
than once, ratios are equal but for rounding, and a path may end on a ray though there are
solutions: then others are tried, which count more ratios as equal or begin with other weights of
the artificial unknown. What they find is checked.

Cottle, Pang, Stone: The Linear Complementarity Problem (1992), 4.4 and 4.9.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.kernels.contact_geometry import FOUND, ContactWork
from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.layout import Work
from mbody.system.system import System

Array = np.ndarray

#: Starts of the weights of the artificial unknown of further paths.
WEIGHTS = 12
#: Exchanges, at most, of a problem of n unknowns: this times n + 1. Lemke's path takes about n.
EXCHANGES = 50


def lemke(A: Array, b: Array) -> Array | None:
    """z of one solution; None where all paths end on a ray, which for copositive A means that there
    is no solution. A (n, n), `b` (n,).

    >>> lemke(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])).round(12)
    array([1.33333333, 2.33333333])
    >>> lemke(np.array([[0.0]]), np.array([-1.0])) is None
    True
    """
    n = len(b)
    if n == 0 or b.min() >= 0.0:
        return np.zeros(n)
    found = _path(A, b, np.ones(n), tol.COMPLEMENTARITY_TIE)
    if found is not None:
        return found
    for equal in tol.COMPLEMENTARITY_TIES_FURTHER:
        found = _path(A, b, np.ones(n), equal)
        if found is not None and _solves(A, b, found):
            return found
    for seed in range(WEIGHTS):
        weights = 1.0 + np.random.default_rng(seed).random(n)
        found = _path(A, b, weights, tol.COMPLEMENTARITY_TIES_FURTHER[-1])
        if found is not None and _solves(A, b, found):
            return found
    return None


def _solves(A: Array, b: Array, z: Array) -> bool:
    """Whether w and z are not negative, and of each pair one is zero."""
    w, size = (A @ z + b) / np.abs(b).max(), max(float(z.max()), tol.TINY)
    return bool(np.abs(np.minimum(w, z / size)).max() <= tol.COMPLEMENTARITY_RESIDUAL)


def _path(A: Array, b: Array, weights: Array, equal: float) -> Array | None:
    """Lemke's path with these weights of the artificial unknown (n,); None on a ray."""
    n = len(b)
    # scaled rows: neither signs nor zeros change
    size = np.maximum(np.abs(A).max(axis=1), tol.TINY)
    # w − A z − d z₀ = b: columns of w, of z, of z₀, and the right-hand side
    table = np.hstack([np.eye(n), -A / size[:, None], -weights[:, None], (b / size)[:, None]])
    basis, row, entering = list(range(n)), int(np.argmin(b / size / weights)), 2 * n
    for _ in range(EXCHANGES * (n + 1)):
        table[row] /= table[row, entering]
        others = np.arange(n) != row
        table[others] -= np.outer(table[others, entering], table[row])
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = table[:, -1]
            return np.maximum(z[n : 2 * n], 0.0)
        entering = leaving + n if leaving < n else leaving - n
        column = table[:, entering]
        able = np.flatnonzero(
            column > tol.COMPLEMENTARITY_PIVOT * max(1.0, float(np.abs(column).max()))
        )
        if not len(able):
            return None
        row = _leaving(table, basis, column, able, equal)
    return None


def _leaving(table: Array, basis: list[int], column: Array, able: Array, equal: float) -> int:
    """The row of the least ratio; of equal ones z₀'s, else the lexicographically least."""
    n = len(basis)
    best = able
    for place in (-1, *range(n)):
        ratio = table[best, place] / column[best]
        least = float(ratio.min())
        best = best[ratio <= least + equal * max(1.0, abs(least))]
        if place == -1:
            artificial = [k for k in best if basis[k] == 2 * n]
            best = np.array(artificial) if artificial else best
        if len(best) == 1:
            break
    return int(best[0])


# -- Friction of a pair for the multipliers that press it, with its derivatives ----------------
# The same laws as of `mbody.kernels.friction_laws`, of one pair at one instant, for the static and
# for the kinetic coefficient: decisions of modes need both.


class JointFriction:
    """Friction of friction pair f at the position, rates and signals in a workspace."""

    def __init__(self, system: System, work: Work, f: int, rate: float | None = None) -> None:
        L, o = system.layout, int(system.layout.friction_par[f])
        self.kind, self.node = FRICTION_KINDS[int(L.friction_kind[f])], int(L.friction_node[f])
        kinetic, static, speed = (float(part) for part in system.par[o : o + 3, 0])
        self.first, self.second = (float(part) for part in system.par[o + 4 : o + 6, 0])
        mu = kinetic
        if rate is None:
            mu = static
        elif speed > 0.0:
            mu += (static - kinetic) * math.exp(-((rate / speed) ** 2))
        self.mu, self.given = mu, 0.0
        if self.kind in ("torque", "force"):
            self.given = max(0.0, mu * float(work.signal[int(L.friction_signal[f]), 0]))
        if self.kind == "follower":
            at = 12 * self.node + 6
            self.mu = self._on_cam(float(np.hypot(*work.block[at : at + 2, 0])))

    @property
    def by_law(self) -> bool:
        """Whether its size follows a law alone."""
        return self.kind in ("torque", "force")

    def _on_cam(self, push: float) -> float:
        """Of a follower by its multiplier; `push`: the length of the part of its row that pushes.
        See `mbody.kernels.friction.on_cam`.
        """
        if self.first <= 0.0:
            return self.mu * push
        sine = self.first * self.mu / math.sqrt(1.0 + self.mu**2)
        return push * sine / math.sqrt(1.0 - sine * sine)

    def size(self, x: Any, y: Any, slip_sign: float) -> tuple[Any, Any, Any]:
        """φ by both multipliers, numbers or arrays, and its derivatives by them; `slip_sign` of the
        sliding, or of that which would begin.
        """
        mu, zero = self.mu, 0.0 * (x + y)
        if self.by_law:
            # what helps itself in one direction, as a band brake does, has more in that one
            return max(0.0, self.given * (1.0 + self.second * slip_sign)) + zero, zero, zero
        if self.kind == "pin":
            radius, whole = mu * self.first / math.sqrt(1.0 + mu * mu), np.hypot(x, y)
            per = np.where(whole > 0.0, radius / np.where(whole > 0.0, whole, 1.0), 0.0)
            return radius * whole, per * x, per * y
        uneven = self.second * slip_sign if self.kind == "couple" else 0.0
        size, by_x, by_y = mu * np.abs(x) + uneven * x, mu * np.sign(x) + uneven, zero
        if self.kind == "guide" and self.first > 0.0:
            tilt = 0.5 * mu * slip_sign * self.second
            moment, factor = y + tilt * x, 2.0 * mu / self.first
            ends, by_moment = factor * np.abs(moment) > size, factor * np.sign(moment)
            size = np.where(ends, factor * np.abs(moment), size)
            by_x, by_y = np.where(ends, by_moment * tilt, by_x), np.where(ends, by_moment, by_y)
        return size, by_x, by_y


# -- Contact modes and impacts as complementarity problems -------------------------------------
# Closed contacts have relative velocities γ = (γ_N, γ_T) and Delassus's matrix D = W M⁻¹ Wᵀ of what
# the joints leave free, rows of all normals before those of all tangents, so that contact forces λ
# add D λ to the accelerations b that there would be without. With λ_R = μ λ_N + λ_T, the reserve of
# friction on one side, a contact that may stick has
#
#     0 ≤ w_N ⊥ λ_N ≥ 0,   0 ≤ a_T⁺ ⊥ λ_R ≥ 0,   0 ≤ 2 μ λ_N − λ_R ⊥ a_T⁻ ≥ 0,
#
# a_T = a_T⁺ − a_T⁻; one that slides with sign s has λ_T = −μ s λ_N and the first of them alone.
# The same with velocities and impulses is an impact.
#
# Pfeiffer, Glocker: Multibody Dynamics with Unilateral Contacts (1996), 6 and 8.


@dataclass(frozen=True, eq=False)
class ClosedContacts:
    """Closed contacts at one instant.

    `delassus` (2 m, 2 m): Normals before tangents.
    `friction` (m,): Coefficients: kinetic of those that slide and in impacts, static of those that
      may stick.
    `sliding` (m,): Signs of the tangential velocities, zero of contacts that do not slide.
    """

    delassus: Array
    friction: Array
    sliding: Array

    def __len__(self) -> int:
        return len(self.friction)

    def problem(self, normal: Array, tangential: Array) -> tuple[Array, Array, Array]:
        """(A, b) in (λ_N, λ_R, a_T⁻), and which contacts have the last two. `normal`, `tangential`
        (m,): accelerations, or velocities, without contact forces.
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
    `restitution`, `newton` (m,).

    Which contacts follow Newton's law, γ_N⁺ = −e γ_N⁻ where they take part; the others, by

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
        shifted[:m] -= tol.COMPLEMENTARITY_SHIFT * float(np.abs(before).max())
    A, b, _ = contacts.problem(shifted[:m], shifted[m:])
    z = solve(A, b)
    if z is None:
        return None
    if without_collision:
        support = np.flatnonzero(z > tol.CONTACT_FORCE_NONE * z.max())
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
    sticking = np.where(contacts.sliding == 0.0, mu * given, 0.0)
    start = after + D[:, :m] @ given - D[:, m:] @ sticking
    A, b, may_stick = contacts.problem(start[:m], start[m:])
    b[m + len(may_stick) :] = 2.0 * (mu * given)[may_stick]
    z = solve(A, b)
    if z is None:
        return None
    more = contacts.forces(z)
    more[:m] += given
    more[m:] -= sticking
    return impulse + more


# -- Contacts and frictional joints at one instant as one problem: who opens, sticks and slides ----
# Accelerations along the rows of all that may open or slide are c = c₀ + D (f − f₀) for forces f on
# the system: normal ones N ≥ 0 of closed contacts, then tangential ones T of contacts and joints,
# each between its limits −low(f) ≤ T ≤ high(f): μ N of a contact, the friction circle of the whole
# reaction of a pin, which f changes, and so on. What slides has T = −low or +high. With the limits
# linear in f, T = λ_R − low, this is the linear complementarity problem
#
#     0 ≤ w_N ⊥ N ≥ 0,   0 ≤ a_T⁺ ⊥ λ_R ≥ 0,   0 ≤ low + high − λ_R ⊥ a_T⁻ ≥ 0,
#
# a_T = a_T⁺ − a_T⁻. Where limits are not linear it is solved anew with their tangents at the last
# solution (Josephy's and Newton's method) until it is its own.
#
# Pfeiffer, Glocker (1996), 6 and 8; Facchinei, Pang: Finite-Dimensional Variational Inequalities
# (2003), 7.

#: (low, high, ∂low/∂f, ∂high/∂f) of forces f (…, forces): arrays (…,) and (…, forces).
Limits = Callable[[Array], tuple[Array, Array, Array, Array]]

#: Sets of modes, at most, that are all tried.
MOST_MODES = 3**7
#: Problems with tangents of the limits, at most.
PASSES = 40


@dataclass(frozen=True, eq=False)
class Tangent:
    """One tangent row with friction.

    `limits`: See `Limits`.
    `sliding`: Sign of the rate of what slides, zero of what is at rest.
    `normal`: The contact that it belongs to; −1 of a joint.
    `linear`: Whether its limits are linear in the forces.
    """

    limits: Limits
    sliding: float = 0.0
    normal: int = -1
    linear: bool = True


def cone(count: int, normal: int, friction: float, sliding: float = 0.0) -> Tangent:
    """The tangent of a contact among `count` forces: μ N both ways."""
    derivative = np.zeros(count)
    derivative[normal] = friction

    def limits(forces: Array) -> tuple[Array, Array, Array, Array]:
        most, by = forces @ derivative, np.broadcast_to(derivative, forces.shape)
        return most, most, by, by

    return Tangent(limits, sliding, normal)


@dataclass(frozen=True, eq=False)
class FrictionProblem:
    """All that may open or slide at one instant.

    `normals`: Contacts that are closed.
    `accelerations` (normals + tangents,): c₀, along the rows with the forces f₀.
    `delassus` (normals + tangents, normals + tangents)
    `forces` (normals + tangents,): f₀.
    `size`: Of accelerations, where rounding is more than that of c₀.
    """

    normals: int
    tangents: tuple[Tangent, ...]
    accelerations: Array
    delassus: Array
    forces: Array
    size: float = 0.0

    def __len__(self) -> int:
        return len(self.accelerations)

    @property
    def linear(self) -> bool:
        """Whether no limit bends."""
        return all(one.linear for one in self.tangents)

    @property
    def greatest(self) -> float:
        """Of accelerations."""
        return max(float(np.abs(self.without).max(initial=0.0)), self.size, tol.TINY)

    @property
    def without(self) -> Array:
        """Accelerations without the forces f."""
        return self.accelerations - self.delassus @ self.forces

    def accelerations_of(self, forces: Array) -> Array:
        """Along all rows, for forces (normals + tangents,)."""
        return self.without + self.delassus @ forces

    def limits(self, forces: Array) -> tuple[Array, Array, Array, Array]:
        """Those of all tangents at forces (…, forces): (…, tangents) twice, (…, tangents, forces)
        twice.
        """
        shape = (*forces.shape[:-1], len(self.tangents))
        low, high = np.zeros(shape), np.zeros(shape)
        low_by, high_by = np.zeros((*shape, len(self))), np.zeros((*shape, len(self)))
        for k, one in enumerate(self.tangents):
            parts = one.limits(forces)
            low[..., k], high[..., k], low_by[..., k, :], high_by[..., k, :] = parts
        return low, high, low_by, high_by

    # -- linear complementarity problem --------------------------------------------------------

    def solve(self) -> FrictionSolution | None:
        """One solution; None where Lemke's path ends on a ray, or where tangents of the limits lead
        to no solution.
        """
        for start in (self.forces, np.zeros(len(self))):
            forces = start
            for _ in range(PASSES):
                found = self._by_tangents(forces)
                if found is None:
                    break
                change = float(np.abs(found.forces - forces).max(initial=0.0))
                forces = found.forces
                if self.linear or change <= tol.CONTACT_FORCE_SETTLED * float(
                    np.abs(forces).max(initial=0.0)
                ):
                    return found
        return None

    def _by_tangents(self, at: Array) -> FrictionSolution | None:
        """A solution with the tangents of the limits at forces `at`."""
        m, r = self.normals, len(self.tangents)
        low, high, low_by, high_by = self.limits(at)
        low, high = low - low_by @ at, high - high_by @ at
        sliding = np.array([one.sliding for one in self.tangents])
        sticking = np.flatnonzero(sliding == 0.0)
        s = len(sticking)
        E = np.zeros((r, s))
        E[sticking, np.arange(s)] = 1.0
        # T = E λ_R − g₀ − G_N N − G_T T
        back = sliding < 0.0
        g = np.where(back, -high, low)
        G = np.where(back[:, None], -high_by, low_by)
        try:
            K = np.linalg.inv(np.eye(r) + G[:, m:])
        except np.linalg.LinAlgError:
            return None
        by_n, by_r, alone = -K @ G[:, :m], K @ E, -K @ g
        D, c = self.delassus, self.without
        whole, whole_by = (low + high)[sticking], (low_by + high_by)[sticking]
        A = np.block(
            [
                [D[:m, :m] + D[:m, m:] @ by_n, D[:m, m:] @ by_r, np.zeros((m, s))],
                [(D[m:, :m] + D[m:, m:] @ by_n)[sticking], (D[m:, m:] @ by_r)[sticking], np.eye(s)],
                [
                    whole_by[:, :m] + whole_by[:, m:] @ by_n,
                    whole_by[:, m:] @ by_r - np.eye(s),
                    np.zeros((s, s)),
                ],
            ]
        )
        free = c + D[:, m:] @ alone
        free = np.where(np.abs(free) < tol.CONTACT_ACCELERATION_ROUNDING * self.greatest, 0.0, free)
        b = np.concatenate([free[:m], free[m:][sticking], whole + whole_by[:, m:] @ alone])
        z = lemke(A, b)
        if z is None:
            return None
        forces = np.concatenate([z[:m], by_n @ z[:m] + by_r @ z[m : m + s] + alone])
        w = A @ z + b
        along = np.zeros(r)
        along[sticking] = w[m : m + s] - z[m + s :]
        return FrictionSolution(self, forces, np.maximum(w[:m], 0.0), along)

    def at_rest(self) -> FrictionSolution | None:
        """The solution in which nothing moves, with the greatest reserve of all forces from their
        limits, by a linear program; None where there is none, where something slides, or where a
        limit bends.
        """
        from scipy.optimize import linprog

        m, n = self.normals, len(self)
        if not self.linear or any(one.sliding for one in self.tangents):
            return None
        low, high, low_by, high_by = self.limits(np.zeros(n))
        own = np.eye(n)[m:]
        # by forces in parts of `size`, and by their reserve
        size = self.greatest / self._softest
        by = np.concatenate([np.eye(n)[:m], low_by + own, high_by - own])
        value = np.concatenate([np.zeros(m), low, high]) / size
        found = linprog(
            np.append(np.zeros(n), -1.0),
            A_ub=np.column_stack([-by, np.ones(len(by))]),
            b_ub=value,
            A_eq=np.column_stack([self.delassus * size / self.greatest, np.zeros(n)]),
            b_eq=-self.without / self.greatest,
            bounds=[(None, None)] * n + [(0.0, 1.0)],
            options={"primal_feasibility_tolerance": tol.LINEAR_PROGRAM_RESIDUAL},
        )
        if found.status != 0:
            return None
        return FrictionSolution(self, found.x[:n] * size, np.zeros(m), np.zeros(n - m))

    # -- by trying modes ----------------------------------------------------------------------

    def count_modes(self) -> float:
        """Number of sets of modes."""
        found = 1.0
        pressed = {one.normal for one in self.tangents if one.normal >= 0}
        for one in self.tangents:
            if one.normal >= 0:
                found *= 4.0 if one.sliding == 0.0 else 2.0
            elif one.sliding == 0.0:
                found *= 3.0
        return found * 2.0 ** (self.normals - len(pressed))

    def sets_of_modes(self) -> tuple[Array, Array]:
        """All of them: which contacts press (sets, normals), and of every tangent 0 for what
        sticks, ±1 for what slips, NaN for what belongs to an open contact (sets, tangents).
        """
        every = list[tuple[tuple[bool, ...], tuple[float, ...]]]()
        for closed in itertools.product((False, True), repeat=self.normals):
            signs = [
                (np.nan,)
                if one.normal >= 0 and not closed[one.normal]
                else (0.0, 1.0, -1.0)
                if one.sliding == 0.0
                else (one.sliding,)
                for one in self.tangents
            ]
            every += [(closed, slip_signs) for slip_signs in itertools.product(*signs)]
        pressing = np.array([closed for closed, _ in every], dtype=bool)
        slip_signs = np.array([found for _, found in every], dtype=float)
        return pressing.reshape(len(every), -1), slip_signs.reshape(len(every), -1)

    def by_modes(self, closed: Array, slip_signs: Array) -> list[FrictionSolution]:
        """Solutions with sets of modes, see `sets_of_modes`; none where rows depend on each other.

        Where limits bend there may be several with the same modes: Newton's method begins without
        forces, with those at hand, and far out in the direction of either.
        """
        n, good = len(self), list[FrictionSolution]()
        if not n:
            return [FrictionSolution(self, np.zeros(0), np.zeros(0), np.zeros(0))]
        big = 1e3 * max(float(np.abs(self.forces).max()), self.greatest / self._softest)
        bounds = np.concatenate([closed * big, -np.nan_to_num(slip_signs) * big], axis=1)
        starts = [np.zeros_like(bounds)]
        if not self.linear:
            starts += [np.broadcast_to(self.forces, bounds.shape), bounds]
        for start in starts:
            forces, regular = self._newton(closed, slip_signs, start)
            for k in np.flatnonzero(regular & self._keeps(forces, closed, slip_signs)):
                a, m = self.accelerations_of(forces[k]), self.normals
                stationary = [one.sliding == 0.0 for one in self.tangents]
                normal = np.where(closed[k], 0.0, a[:m])
                along = np.where(
                    (slip_signs[k] != 0.0) & np.array(stationary, dtype=bool), a[m:], 0.0
                )
                good.append(FrictionSolution(self, forces[k], normal, along))
        return good

    @property
    def _softest(self) -> float:
        """Greatest motion of a force by itself; 1 where all follows drivers, so that none does."""
        return float(np.diag(self.delassus).max()) or 1.0

    def _newton(self, closed: Array, slip_signs: Array, start: Array) -> tuple[Array, Array]:
        """Forces (sets, forces) that fulfil the equations of modes, and where they do."""
        m, n, c = self.normals, len(self), self.without
        holds = np.concatenate([closed, slip_signs == 0.0], axis=1)
        slips = np.concatenate([np.zeros_like(closed), np.nan_to_num(slip_signs) != 0.0], axis=1)
        slip_sign = np.concatenate([np.zeros(closed.shape), np.nan_to_num(slip_signs)], axis=1)
        scale = np.sqrt(
            np.maximum(np.diag(self.delassus), tol.CONTACT_CONDITION_SINGULAR**-2 * self._softest)
        )
        # forces by 1/scale, what holds by its acceleration
        D = self.delassus / scale[:, None] / scale
        fixed = np.where(holds[..., None], D, np.eye(n))
        forces, regular = start, np.ones(len(start), dtype=bool)
        for _ in range(PASSES):
            low, high, low_by, high_by = self.limits(forces)
            ahead = slip_signs > 0.0
            size = np.where(ahead, low, high)
            by = np.where(ahead[..., None], low_by, high_by)
            A, b = fixed.copy(), np.where(holds, -c / scale, 0.0)
            constant = size - (by @ forces[..., None])[..., 0]
            change = np.zeros((len(start), n, n))
            change[:, m:] = by * scale[m:, None] / scale
            A += np.where(slips[..., None], slip_sign[..., None] * change, 0.0)
            b[:, m:] -= np.where(slips[:, m:], slip_sign[:, m:] * constant * scale[m:], 0.0)
            regular &= np.linalg.cond(A) < tol.CONTACT_CONDITION_SINGULAR
            A[~regular] = np.eye(n)
            new = np.linalg.solve(A, b[..., None])[..., 0] / scale
            new[~regular] = 0.0
            moved = np.abs(new - forces).max(axis=1)
            forces = new
            if (
                self.linear
                or (moved <= tol.CONTACT_FORCE_SETTLED * np.abs(forces).max(axis=1))[regular].all()
            ):
                break
        else:
            regular &= moved <= tol.CONTACT_SOLUTION_RESIDUAL * np.abs(forces).max(axis=1)
        return forces, regular

    def _keeps(self, forces: Array, closed: Array, slip_signs: Array) -> Array:
        """Where forces (sets, forces) keep signs and limits."""
        m = self.normals
        a = self.without + forces @ self.delassus.T
        size = np.maximum(self.greatest, np.abs(a).max(axis=1))[:, None]
        big = np.maximum(np.abs(forces).max(axis=1), tol.TINY)[:, None]
        low, high, _, _ = self.limits(forces)
        own, along = forces[:, m:], a[:, m:]
        stationary = np.array([one.sliding == 0.0 for one in self.tangents], dtype=bool)
        acts = np.isfinite(slip_signs)
        outside = acts & (np.minimum(low, high) < -tol.CONTACT_SOLUTION_RESIDUAL * big)
        outside |= (slip_signs == 0.0) & (
            (own < -low - tol.CONTACT_SOLUTION_RESIDUAL * big)
            | (own > high + tol.CONTACT_SOLUTION_RESIDUAL * big)
        )
        outside |= (
            acts
            & stationary
            & (np.nan_to_num(slip_signs) * along < -tol.CONTACT_SOLUTION_RESIDUAL * size)
        )
        pulling = (forces[:, :m] < -tol.CONTACT_SOLUTION_RESIDUAL * big) | (
            a[:, :m] < -tol.CONTACT_SOLUTION_RESIDUAL * size
        )
        return np.asarray(~outside.any(axis=1) & ~pulling.any(axis=1))


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """Forces that fulfil the law of Coulomb.

    `forces` (normals + tangents,)
    `normal` (normals,): Accelerations of the gaps.
    `along` (tangents,): Accelerations along what is at rest, zero of what slides.
    """

    problem: FrictionProblem
    forces: Array
    normal: Array
    along: Array

    def accelerations(self) -> Array:
        """Those that tell solutions apart: along all rows."""
        return self.problem.accelerations_of(self.forces)

    def modes(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Of the contacts "open" or "closed", of the tangents "stick", "slip+" or "slip-"."""
        m = self.problem.normals
        size = max(self.problem.greatest, float(np.abs(self.normal).max(initial=0.0)))
        size = max(size, float(np.abs(self.along).max(initial=0.0)))
        big = max(float(np.abs(self.forces).max(initial=0.0)), tol.TINY)
        opens = (self.forces[:m] <= tol.CONTACT_FORCE_NONE * big) & (
            self.normal > tol.CONTACT_ACCELERATION_ROUNDING * size
        )
        tangents = []
        for one, ahead in zip(self.problem.tangents, self.along, strict=True):
            slip_sign = one.sliding or (
                0.0 if abs(ahead) <= tol.CONTACT_ACCELERATION_NONE * size else ahead
            )
            tangents.append("slip+" if slip_sign > 0.0 else "slip-" if slip_sign < 0.0 else "stick")
        return tuple("open" if one else "closed" for one in opens), tuple(tangents)


def every_mode(problem: FrictionProblem) -> list[FrictionSolution]:
    """Solutions of all sets of modes whose accelerations differ, those of the least contact force
    first.
    """
    found = problem.by_modes(*problem.sets_of_modes())
    found.sort(key=lambda one: float(one.forces[: problem.normals].sum()))
    return _different(problem, found)


def _different(problem: FrictionProblem, found: list[FrictionSolution]) -> list[FrictionSolution]:
    """The first of those with the same accelerations."""
    kept = list[FrictionSolution]()
    for one in found:
        a = one.accelerations()
        sizes = (float(np.abs(each).max(initial=0.0)) for each in (a, problem.without))
        size = max(*sizes, tol.TINY)
        terms = np.abs(problem.delassus) @ np.abs([each.forces for each in found]).max(axis=0)
        least = max(
            tol.CONTACT_ACCELERATION_SAME * size,
            tol.CONTACT_ACCELERATION_NONE * problem.greatest,
            tol.CONTACT_ACCELERATION_CANCELS * float(terms.max(initial=0.0)),
        )
        if all(np.abs(a - each.accelerations()).max(initial=0.0) > least for each in kept):
            kept.append(one)
    return kept


def _same(one: FrictionSolution, other: FrictionSolution) -> bool:
    """Whether both have the same modes, and forces but for the rounding of nearly singular ones."""
    size = float(np.abs(one.forces).max(initial=0.0))
    close = (
        float(np.abs(one.forces - other.forces).max(initial=0.0)) <= tol.CONTACT_FORCE_SAME * size
    )
    return close and one.modes() == other.modes()


def decide_modes(problem: FrictionProblem) -> tuple[list[FrictionSolution], bool]:
    """Solutions with different accelerations, the one to be taken first, and whether all sets of
    modes were tried.

    Of several that of the least contact force is taken. Up to `MOST_MODES` sets of modes all are
    tried; of larger problems rest is taken where it is a solution, else what Lemke's method finds,
    and nothing is known of others. Rows that
    depend on each other leave forces open; by them solutions are not told apart.

    Examples
    --------
    A block on a floor, pushed by less than its friction, and by more:

    >>> def block(push):
    ...     c = np.array([-9.81, push])
    ...     return FrictionProblem(1, (cone(2, 0, 0.3),), c, np.eye(2), np.zeros(2))
    >>> [decide_modes(block(push))[0][0].modes() for push in (2.0, 4.0)]
    [(('closed',), ('stick',)), (('closed',), ('slip+',))]
    """
    if problem.count_modes() > MOST_MODES:
        one = problem.at_rest() or problem.solve()
        return ([] if one is None else [one]), False
    one, found = problem.solve(), every_mode(problem)
    if one is not None:
        known = _different(problem, [one, *(other for other in found if not _same(one, other))])
        if len(known) == 1:
            return [one], True
        known.sort(key=lambda each: float(each.forces[: problem.normals].sum()))
        return known, True
    return found, True


# -- The impulses of one step by Lemke's method: the problem of Anitescu and Potra, dense ------
#     0 ≤ γ_N + b ⊥ P_N ≥ 0,   0 ≤ s e ± γ_T ⊥ P_T± ≥ 0,   0 ≤ μ P_N − P_T⁺ − P_T⁻ ⊥ s ≥ 0,
#
# γ = γ_free + D P with Delassus's matrix D = W M⁻¹ Wᵀ of what joints leave free. A solution exists
# always: Anitescu, Potra: Formulating dynamic multi-rigid-body contact problems (1997).


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
    free, mu = W @ contacts.free, contacts.effect[which, 3]
    N, T = slice(0, m), slice(m, 2 * m)
    zero, one = np.zeros((m, m)), np.eye(m)
    A = np.block(
        [
            [D[N, N], D[N, T], -D[N, T], zero],
            [D[T, N], D[T, T], -D[T, T], one],
            [-D[T, N], -D[T, T], D[T, T], one],
            [np.diag(mu), -one, -one, zero],
        ]
    )
    b = np.concatenate([free[N] + contacts.effect[which, 4], free[T], -free[T], np.zeros(m)])
    z = lemke(A, b)
    if z is None:
        return None
    found[which] = np.column_stack([z[:m], z[m : 2 * m] - z[2 * m : 3 * m]])
    return found
