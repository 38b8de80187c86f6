"""Contacts, ropes and frictional joints at one instant: who opens, sticks and slides; impacts.

`FrictionProblem` states what the kernel `mbody.kernels.complementarity` solves, part by part of
what is connected, so that no scale of one reaches another.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.kernels import complementarity as kernels
from mbody.kernels.complementarity import (
    CONE,
    joint_arms,
    law_sizes,
    problem_memory,
    solve_contacts,
)
from mbody.kernels.contact_geometry import FOUND, ContactWork
from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.layout import Work
from mbody.system.system import System

Array = np.ndarray


class _Memory(threading.local):
    """Memory of the kernel of every size, one for each thread."""

    def __init__(self) -> None:
        self.problems: dict[int, kernels.ContactProblem] = {}

    def of(self, n: int) -> kernels.ContactProblem:
        if n not in self.problems:
            self.problems[n] = problem_memory(n)
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


# -- Impacts -----------------------------------------------------------------------------------
# With velocities in place of accelerations and impulses in place of forces the same problem is an
# impact. Poisson: compression by the problem, then expansion with e Λ_N given, limits by all of it.


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

    def solve(self, before: Array, given: Array) -> Array | None:
        """(Λ_N, Λ_T) (2 m,) from velocities `before` (2 m,) without them, with normal impulses
        `given` (m,) that count in the cones; None where there are none.
        """
        m, one = len(self), self.solution(before, given)
        if one is None:
            return None
        impulses, frictional = np.zeros(2 * m), np.flatnonzero(self.friction > 0.0)
        impulses[:m], impulses[m + frictional] = one.forces[:m], one.forces[m:]
        return impulses

    def solution(self, before: Array, given: Array) -> FrictionSolution | None:
        """What `solve` gives, with its modes; before is (2 m,), given (m,)."""
        problem = self.problem(before, given)
        stops = self._stop_at_once(before)[self.friction > 0.0]
        one = problem.sliding(stops).solve() if stops.any() else None
        return one or problem.solve()

    def _stop_at_once(self, before: Array) -> Array:
        """Directions of sliding (m,) of what slides by the motion that approaches, as the end of a
        rod on a pin: both stop together, until when it slides; zero of all others.
        """
        m, D = len(self), np.diag(self.delassus)
        N, T, C = D[:m], D[m:], np.diag(self.delassus[:m, m:])
        one = (N * T > 0.0) & (N * T - C * C <= tol.ROWS_DEPENDENT * N * T)
        apart = np.abs(before[m:] * N - before[:m] * C)
        one &= apart <= tol.ROWS_DEPENDENT * np.abs(before[:m] * C)
        return np.where(one & (before[:m] < 0.0), np.sign(before[m:]), 0.0)

    def modes(self, one: FrictionSolution) -> tuple[Array, Array]:
        """Rows that hold (2 m,) and directions of tangents that slide (m,) by a solution."""
        m, frictional = len(self), np.flatnonzero(self.friction > 0.0)
        hold, slip_signs = np.zeros(2 * m, dtype=bool), np.zeros(m)
        hold[:m], slip_signs[frictional] = one.mode[:m] == 1, one.mode[m:]
        hold[m + frictional] = (one.mode[m:] == 0) & hold[frictional]
        return hold, slip_signs

    def problem(self, before: Array, given: Array) -> FrictionProblem:
        """The problem, with tangents of what has friction alone."""
        m, frictional = len(self), np.flatnonzero(self.friction > 0.0)
        rows = np.concatenate([np.arange(m), m + frictional])
        tangents = tuple(
            Tangent(int(k), float(self.friction[k]), given=float(given[k])) for k in frictional
        )
        D, c = self.delassus[np.ix_(rows, rows)], before[rows]
        noise = None if self.noise is None else self.noise[rows]
        return FrictionProblem(m, tangents, c, D, np.zeros(len(rows)), noise)


def impact_impulses(
    contacts: ClosedContacts,
    before: Array,
    restitution: Array,
    newton: Array | None = None,
    *,
    without_collision: bool = False,
    solve: Callable[[ClosedContacts, Array, Array], Array | None] = ClosedContacts.solve,
) -> Array | None:
    """Impulses (2 m,) of an impact, normals before tangents; None where there is no solution.
    `restitution`, `newton` (m,).

    Which contacts follow Newton's law, γ_N⁺ = −e γ_N⁻ where they take part; the others, by

    Examples
    --------
    A ball of mass 1 that falls by 2 and keeps half:

    >>> ball = ClosedContacts(np.eye(2), np.zeros(1))
    >>> impact_impulses(ball, np.array([-2.0, 0.0]), np.array([0.5]))
    array([3., 0.])
    """
    m, D, none = len(contacts), contacts.delassus, np.zeros(len(contacts))
    if without_collision:
        return _without_collision(contacts, before)
    by_newton = np.zeros(m, dtype=bool) if newton is None else newton
    shifted = before.copy()
    approach = np.where(before[:m].real < 0.0, before[:m], 0.0)
    shifted[:m] += np.where(by_newton, restitution, 0.0) * approach
    impulse = solve(contacts, shifted, none)
    if impulse is None:
        return None
    given = np.where(by_newton, 0.0, restitution) * impulse[:m]
    if not given.any():
        return impulse
    # expansion: Λ_N = given + more, Λ_T within the cone of all of it
    # what follows Newton's law has its velocity already
    more = solve(contacts, shifted + D @ impulse + D[:, :m] @ given, given)
    if more is None:
        return None
    more[:m] += given
    return impulse + more


def _without_collision(contacts: ClosedContacts, before: Array) -> Array | None:
    """Impulses where nothing approaches and yet no accelerations are consistent: those of the
    modes that a little more approach has, without it.
    """
    m = len(contacts)
    D, fastest = np.diag(contacts.delassus)[:m], np.abs(before).max()
    size = np.sqrt(np.maximum(D, tol.TINY))
    shifted = before.copy()
    shifted[:m] -= tol.COMPLEMENTARITY_SHIFT * fastest * size / size.max()
    problem = contacts.problem(shifted, np.zeros(m))
    one = problem.solve()
    if one is None:
        return None
    return impulses_of_modes(contacts, before, np.zeros(m), *contacts.modes(one))


def diagonal_unit(D: Array) -> float:
    """The power of two above the first number on the diagonal: unlike its root, dividing by it
    changes no digit.
    """
    first = np.diag(D).real[np.diag(D).real > 0.0][:1]
    return float(np.ldexp(1.0, np.frexp(first)[1]).sum()) or 1.0


def impulses_of_modes(
    contacts: ClosedContacts, before: Array, given: Array, hold: Array, slip_signs: Array
) -> Array | None:
    """(Λ_N, Λ_T) (2 m,) by linear equations, of any kind of number: of rows that `hold` (2 m,), of
    tangents that slide (m,); other impulses are zero. None where rows depend on each other.
    """
    m, D, mu = len(contacts), contacts.delassus, contacts.friction
    unit = diagonal_unit(D)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(D).real / unit, tol.TINY))
    kind = np.result_type(D, before, given, mu)
    A, b = np.eye(2 * m, dtype=kind), np.zeros(2 * m, dtype=kind)
    A[hold] = (scale[:, None] * (D / unit) * scale)[hold]
    b[hold] = -(scale * before / unit)[hold]
    for k in np.flatnonzero(slip_signs):
        if not hold[m + k]:
            A[m + k, k] += slip_signs[k] * mu[k] * scale[k] / scale[m + k]
            b[m + k] = -slip_signs[k] * mu[k] * given[k] / scale[m + k]
    try:
        return np.asarray(scale * np.linalg.solve(A, b))
    except np.linalg.LinAlgError:
        return None


# -- The problem of one instant ----------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Tangent:
    """One tangent row with friction.

    `normal`: The row of the normal that presses it; −1 of a joint.
    `friction`: The coefficient of a contact: the static one of what is at rest.
    `begun`: The tangent once it slides, whose friction is kinetic; None where it is the same.
    `sliding`: Sign of the rate of what slides, zero of what is at rest.
    `law`: The law of a joint, its multipliers at the present forces (2,), and how these change by
      each force (2, forces).
    `given`: Normal impulse that counts beside the unknown one.
    """

    normal: int
    friction: float = 0.0
    sliding: float = 0.0
    law: tuple[JointFriction, Array, Array] | None = None
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

    def sliding(self, slip_signs: Array) -> FrictionProblem:
        """The problem in which tangents slide that have a direction (tangents,)."""
        pairs = zip(self.tangents, slip_signs, strict=True)
        return replace(
            self, tangents=tuple(replace(t, sliding=float(s)) if s else t for t, s in pairs)
        )

    def parts(self) -> Iterator[Array]:
        """Rows of what is connected."""
        linked = self.delassus != 0.0
        for r, one in enumerate(self.tangents, start=self.normals):
            if one.normal >= 0:
                linked[r, one.normal] = True
            elif one.law is not None:
                linked[r] |= (one.law[2] != 0.0).any(axis=0)
        linked |= linked.T
        left = np.ones(len(self), dtype=bool)
        while left.any():
            part = np.zeros(len(self), dtype=bool)
            part[np.flatnonzero(left)[0]] = True
            while True:
                more = part | linked[part].any(axis=0)
                if (more == part).all():
                    break
                part = more
            left &= ~part
            yield np.flatnonzero(part)

    def solve(self) -> FrictionSolution | None:
        """One solution; None where none was found."""
        found, _ = self.solutions(every=False)
        return found[0] if found else None

    def solutions(self, *, every: bool = True) -> tuple[list[FrictionSolution], bool]:
        """Solutions with different accelerations and, of `every` set of modes, whether all were
        tried; of parts that are not connected another one differs in one of them.
        """
        n, complete, worst = len(self), True, 0.0
        if not n:
            return [FrictionSolution(self, *(np.zeros(0),) * 3)], True
        whole = [[np.zeros(n), np.zeros(n), np.zeros(n)]]
        for rows in self.parts():
            P = self._state(rows)
            count, k = solve_contacts(P, every), len(rows)
            complete &= bool(P.count[kernels.COMPLETE])
            left = float(P.number[kernels.RESIDUAL])
            worst = max(worst, left)
            if not count:
                return [], complete
            own = [(P.f[i], P.w[i], P.mode[i * k : (i + 1) * k]) for i in range(count)]
            if count > 1:
                pressing = rows < self.normals
                own.sort(key=lambda one: float(one[0][pressing].sum()))
            others = [[part.copy() for part in whole[0]] for _ in own[1:]]
            for made, part in ((whole, own[:1] * len(whole)), (others, own[1:])):
                for one, (f, w, mode) in zip(made, part, strict=True):
                    begins = self._begins(rows, f, w, left)
                    one[0][rows], one[1][rows], one[2][rows] = f, w, np.where(begins, mode, 0.0)
            whole += others
        return [FrictionSolution(self, f, w, mode, worst) for f, w, mode in whole], complete

    def begun(self, one: FrictionSolution) -> FrictionSolution:
        """A solution in which what begins to slide has its kinetic friction, as it goes on; the
        given one where none is found.
        """
        m, tried = self.normals, set[tuple[float, ...]]()
        kinetic = np.array([t.begun is not None for t in self.tangents], dtype=bool)
        slip = np.where(kinetic, one.mode[m:], 0.0)
        while slip.any() and (key := tuple(slip.tolist())) not in tried:
            tried.add(key)
            tangents = [
                replace(t.begun, sliding=float(sign)) if sign and t.begun is not None else t
                for t, sign in zip(self.tangents, slip, strict=True)
            ]
            two = replace(self, tangents=tuple(tangents)).solve()
            if two is None:
                break
            terms = np.abs(self.without) + np.abs(self.delassus) @ np.abs(two.forces)
            back = slip * two.accelerations[m:] < -tol.CONTACT_ACCELERATION_NONE * terms[m:]
            more = np.where(kinetic, two.mode[m:], 0.0)
            now = np.where(slip != 0.0, np.where(back, 0.0, slip), more)
            if (now == slip).all():
                return two
            slip = now
        return one

    def _begins(self, rows: Array, f: Array, w: Array, left: float) -> Array:
        """Whether rows that would slide from rest do: not by rounding of what cancels there, nor by
        what is `left` of the laws.
        """
        D = np.abs(self.delassus[np.ix_(rows, rows)])
        none = max(tol.CONTACT_ACCELERATION_NONE, left)
        least = none * (np.abs(self.without[rows]) + D @ np.abs(f))
        still = [r >= self.normals and not self.tangents[r - self.normals].sliding for r in rows]
        return ~np.array(still) | (np.abs(w) > least)

    def _state(self, rows: Array) -> kernels.ContactProblem:
        """The memory of the kernel with the problem of some rows."""
        n, m = len(rows), int((rows < self.normals).sum())
        place = {int(r): k for k, r in enumerate(rows)}
        P = _memory.of(n)
        P.count[:2] = n, m
        P.D[:] = self.delassus[np.ix_(rows, rows)]
        P.c[:] = self.without[rows]
        P.noise[:] = 0.0 if self.noise is None else self.noise[rows]
        P.soft[:] = 0.0 if self.soft is None else self.soft[rows]
        P.sliding[:], P.given[:] = 0.0, 0.0
        for r in range(m, n):
            one = self.tangents[int(rows[r]) - self.normals]
            P.sliding[r] = one.sliding
            if one.law is None:
                P.law[r], P.normal[r] = CONE, place[one.normal]
                P.mu[r], P.given[r] = one.friction, one.given
                continue
            law, at, by = one.law
            P.law[r], P.arm[r] = law.number, law.arm[:6]
            P.pressing[r] = at - by @ self.forces
            P.by_force[r] = by[:, rows]
        return P


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


def decide_modes(problem: FrictionProblem) -> tuple[list[FrictionSolution], bool]:
    """Solutions with different accelerations, the one to be taken first, and whether all sets of
    modes were tried.

    Of several that of the least contact force is taken. Of few rows that are connected all sets of
    modes are tried; of more what Lemke's path finds is taken, and nothing is known of others. Rows
    that depend on each other leave forces open; by them solutions are not told apart.

    Examples
    --------
    A block on a floor, pushed by less than its friction, and by more:

    >>> def block(push):
    ...     c = np.array([-9.81, push])
    ...     return FrictionProblem(1, (cone(0, 0.3),), c, np.eye(2), np.zeros(2))
    >>> [decide_modes(block(push))[0][0].modes() for push in (2.0, 4.0)]
    [(('closed',), ('stick',)), (('closed',), ('slip+',))]
    """
    return problem.solutions()


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
