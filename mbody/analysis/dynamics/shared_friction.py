"""Sticking with redundant constraints: forces of contacts and friction that no equation decides.

A wheel with its brake on that stands on the road, a ladder that sticks at both ends, a linkage at
rest with several pins with friction: the accelerations follow, the forces do not. It goes on to
stick as long as there are forces that keep every limit: the greatest least margin, see
`mbody.solution.shared_forces`, is a guard of the motion, and the forces that have it are reported.
Where it is zero the multipliers of the program are the motion that begins: what has none goes on to
stick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mbody.analysis.contact.friction_problem import JointFriction
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Rows, Unilateral
from mbody.analysis.dynamics.modal_motion import ModalMotion, Reserve
from mbody.core import tolerances as tol
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.solution.shared_forces import (
    BentLimit,
    ForceSet,
    Lines,
    free_parts,
    least_margin,
    pressing_rows,
    primitive_numbers,
    reported,
)
from mbody.system.rank import jacobian

Array = np.ndarray


class InstantModes(NamedTuple):
    """Modes of an instant: of the contact points and frictional joints, and which rows are on."""

    modes: list[str]
    pairs: list[str]
    on: Array


class _Sliding(NamedTuple):
    """Friction of a joint that slides: its law, row of the active set, direction, rows of joints
    that press it (2, joints' rows).
    """

    law: JointFriction
    row: int
    slip_sign: float
    pressing: Array


class HeldForces:
    """All forces that hold at an instant, with their units: multipliers of joints, then N of closed
    contact points, then friction of those that stick and of the joints that stick.

    `columns` (coordinates, forces): Generalised forces by each, with the friction of what slides.
    `forces` (forces,): Present ones.
    """

    def __init__(
        self,
        uni: Unilateral,
        work: Work,
        record: Array,
        modes: InstantModes,
        normals: Sequence[int],
        sticking: Sequence[int],
        joints: Sequence[int],
        slipping: dict[int, float],
        rows: Rows | None = None,
    ) -> None:
        system, n = uni.system, uni.system.coordinates
        rows = uni.read(work) if rows is None else rows
        self.uni, self.work, self.system, self.slipping = uni, work, system, slipping
        self.normals, self.sticking, self.joints = tuple(normals), tuple(sticking), tuple(joints)
        self.primitive, self.number, _ = system.row_table
        own = record[3 * n + PER_PRIMITIVE * self.primitive + self.number]
        count = len(own)
        self.first = count  # of what is no joint's
        of_joints = -jacobian(system, work)[1].T
        self.sliding = self._sliding(modes, rows, count)
        for one in self.sliding:
            x, y = one.pressing @ own
            _, by_x, by_y = one.law.size(x, y, one.slip_sign)
            change = one.slip_sign * (by_x * one.pressing[0] + by_y * one.pressing[1])
            of_joints -= np.outer(rows.block[one.row], change)
        columns, forces = list[Array](), list[float]()
        for k in self.normals:
            point = uni.contact_points[k]
            row = point.candidate.sign * rows.block[point.normal] / uni.units[point.normal]
            if k in slipping:
                row = row - point.friction * slipping[k] * rows.block[point.tangent]
            columns.append(row)
            forces.append(float(uni.pressing(record, point)))
        tangents = [uni.contact_points[k].tangent for k in self.sticking]
        for row_number in (*tangents, *(uni.friction_joints[m].tangent for m in self.joints)):
            columns.append(rows.block[row_number])
            forces.append(-float(uni.multiplier(record, row_number)))
        self.columns = np.column_stack([of_joints, *columns])
        self.forces = np.concatenate([own, forces])
        self.own = np.arange(len(self.forces)) >= count

    def _sliding(self, modes: InstantModes, rows: Rows, count: int) -> list[_Sliding]:
        uni, found = self.uni, list[_Sliding]()
        pairs = [
            (one.tangent, one.pair, SLIP_SIGNS.get(mode, 0.0))
            for one, mode in zip(uni.friction_joints, modes.pairs, strict=True)
        ]
        L = uni.layout
        for f in range(len(L.friction_kind)):
            if uni.separates_wheels(f):
                sign = float(self.system.par[int(L.friction_par[f]) + 4, 0])
                pairs.append((int(L.friction_tangent[f]), f, sign))
        for row, f, slip_sign in pairs:
            law = JointFriction(self.system, self.work, f, float(rows.rate[row]))
            if slip_sign and not law.by_law:
                found.append(_Sliding(law, row, slip_sign, self._pressing(law, count)))
        return found

    def _pressing(self, law: JointFriction, count: int) -> Array:
        """Both multipliers that press a joint, by the forces (2, count)."""
        at = np.flatnonzero(self.system.layout.primitive_node[self.primitive] == law.node)
        found = np.zeros((2, count))
        found[self.number[at], at] = 1.0
        return found

    # -- limits --------------------------------------------------------------------------------

    def place(self, k: int) -> int:
        """Number of the normal force of contact point k."""
        return self.first + self.normals.index(k)

    def limits_of(self, groups: dict[int, list[int]]) -> Lines:
        """Normal forces and friction of all; `groups` stick by the friction of the first of them.

        Owners are contact points and, after them, frictional joints.
        """
        uni, lines = self.uni, Lines(len(self.forces))
        for n, k in enumerate(self.normals, start=self.first):
            lines.add((k, 0.0), {n: 1.0})
        first = self.first + len(self.normals)
        for n, k in enumerate(self.sticking, start=first):
            by = {self.place(j): uni.contact_points[j].static for j in groups.get(k, [k])}
            for slip_sign in (1.0, -1.0):
                # low + T of what would slide forwards, high − T of what would backwards
                lines.add((k, slip_sign), by | {n: slip_sign})
        for n, m in enumerate(self.joints, start=first + len(self.sticking)):
            self._limit_joint(lines, n, m)
        return lines

    def _limit_joint(self, lines: Lines, n: int, m: int) -> None:
        pair, number = self.uni.friction_joints[m], len(self.uni.contact_points) + m
        law = JointFriction(self.system, self.work, pair.pair)
        if law.by_law:
            values = [float(law.size(0.0, 0.0, sign)[0]) for sign in (1.0, -1.0)]
            whole = max(values)
            for sign, value in zip((1.0, -1.0), values, strict=True):
                parts = {n: sign / (whole or 1.0)}
                lines.add((number, sign), parts, value / (whole or 1.0), float(whole > 0.0))
            return
        turns = self.uni.angular[pair.tangent]
        length = law.first if law.kind == "pin" else self.system.length if turns else 1.0
        pressing = pressing_rows(self.system, law.node)
        lines.bent.append(BentLimit(number, n, pressing, law.number, law.arm[:6], length))

    # -- records -------------------------------------------------------------------------------

    def multipliers(self, change: Array) -> Array:
        """Changes of the multipliers of all primitives, (primitives, 2, …), by changes of the
        forces (forces, …), to first order in friction of joints that slides.
        """
        uni, L = self.uni, self.uni.layout
        found = np.zeros((len(self.system.owners), 2, *change.shape[1:]))
        found[self.primitive, self.number] = change[: self.first]
        for n, k in enumerate(self.normals, start=self.first):
            point = uni.contact_points[k]
            found[int(L.active_set[point.normal]), 0] = -point.candidate.sign * change[n]
            if k in self.slipping:
                friction = point.friction * self.slipping[k] * change[n]
                found[int(L.active_set[point.tangent]), 0] = friction
        rows = [uni.contact_points[k].tangent for k in self.sticking]
        rows += [uni.friction_joints[m].tangent for m in self.joints]
        for n, row in enumerate(rows, start=self.first + len(self.normals)):
            found[int(L.active_set[row]), 0] = -change[n]
        for one in self.sliding:
            x, y = one.pressing @ self.forces[: self.first]
            _, by_x, by_y = one.law.size(x, y, one.slip_sign)
            moved = np.tensordot(one.pressing, change[: self.first], 1)
            found[int(L.active_set[one.row]), 0] = one.slip_sign * (
                by_x * moved[0] + by_y * moved[1]
            )
        return found


# -- The guard of what sticks ------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class SharedFriction:
    """The contact points and frictional joints that share what no equation decides.

    `normals`, `sticking`: Closed contact points; those that stick by a row of their own.
    `joints`: Frictional joints that stick, by number among these.
    `members`: Those of `sticking` and, after the contact points, of `joints` whose forces are open.
    `pressing`: Those of `normals` whose forces are open.
    """

    normals: tuple[int, ...]
    sticking: tuple[int, ...]
    joints: tuple[int, ...]
    members: frozenset[int] = frozenset()
    pressing: frozenset[int] = frozenset()

    @property
    def parts(self) -> tuple[tuple[int, ...], ...]:
        """All of it, to be kept."""
        every = (self.normals, self.sticking, self.joints, self.members, self.pressing)
        return tuple(tuple(sorted(part)) for part in every)

    def held(self, motion: ModalMotion, record: Array, work: Work) -> HeldForces:
        """The forces of an instant, by the rows that are on."""
        slipping = {
            k: SLIP_SIGNS[motion.modes[k]]
            for k in self.normals
            if motion.modes[k] in SLIP_SIGNS and motion.uni.contact_points[k].tangent >= 0
        }
        modes = InstantModes(motion.modes, motion.pairs, np.zeros(0))
        return HeldForces(
            motion.uni, work, record, modes, self.normals, self.sticking, self.joints, slipping
        )

    def reserve(self, motion: ModalMotion, record: Array, work: Work) -> Reserve:
        """The greatest reserve by a record (rows,), with the rows of that position."""
        held = self.held(motion, record, work)
        limits = held.limits_of(motion.groups).made()
        least, active = least_margin(
            held.columns, held.forces, held.own, limits, tol.FRICTION_RESERVE_MOST
        )
        sliding = {number: slip_sign for number, slip_sign in active if slip_sign}
        opened = {number for number, slip_sign in active if not slip_sign}
        return Reserve(least, sliding, opened)


def shared_friction(motion: ModalMotion) -> SharedFriction | None:
    """Sticking contacts and joints of the present modes whose friction forces are undetermined;
    None where all are determined.
    """
    uni = motion.uni
    normals = tuple(n for n, mode in enumerate(motion.modes) if mode != "open")
    sharing = {n for group in motion.groups.values() for n in group[1:]}
    sticking = tuple(
        n
        for n in normals
        if motion.modes[n] == "stick" and n not in sharing and uni.contact_points[n].static > 0.0
    )
    joints = tuple(m for m, mode in enumerate(motion.pairs) if mode == "stick")
    # what joints guide may be held twice by one contact that sticks
    if not joints and len(sticking) < (1 if motion.system.rows else 2):
        return None
    every = SharedFriction(normals, sticking, joints)
    motion.load()
    held = every.held(motion, motion.record[:, 0], motion.work)
    limits = held.limits_of(motion.groups).made()
    parts = free_parts(held.columns, held.forces, held.own, limits)
    owners = limits.every_owner()
    moved = {owners[n] for part in parts for n in part.limits}
    members = frozenset(owner for owner, slip_sign in moved if slip_sign)
    pressing = frozenset(owner for owner, slip_sign in moved if not slip_sign)
    if not members and not pressing:
        return None
    return SharedFriction(normals, sticking, joints, members, pressing)


# -- What is reported --------------------------------------------------------------------------


class Reported(NamedTuple):
    """A record whose forces are admissible, and all that are; None where they are determined."""

    record: Array
    forces: ForceSet | None


def reported_instant(
    uni: Unilateral, work: Work, rows: Rows, record: Array, modes: InstantModes
) -> Reported:
    """The record (rows,) of an instant with those forces that keep their limits best, at the
    position in a workspace, with its rows.
    """
    held = _all_held(uni, work, rows, record, modes)
    if held is None:
        return Reported(record, None)
    limits = held.limits_of({}).made()
    forces, parts, margins = reported(held.columns, held.forces, held.own, limits)
    if not parts:
        return Reported(record, None)
    system, before = uni.system, held.forces
    first = 3 * system.coordinates
    numbers = slice(first, first + PER_PRIMITIVE * len(system.owners))
    found = record.copy()
    moved = np.column_stack([forces - before, *(part.free for part in parts)])
    changes = primitive_numbers(uni.layout, work, held.multipliers(moved))
    changes = changes.reshape(-1, moved.shape[1])
    found[numbers] += changes[:, 0]
    changes = changes[:, 1:]
    touched = np.flatnonzero(np.abs(changes).max(axis=1) > 0.0)
    least = np.array([one.least for one in margins])
    worst = tuple(owner for one in margins if one.least < 0.0 for owner in one.active)
    every = ForceSet(forces, limits, tuple(parts), least, worst, touched, changes[touched])
    return Reported(found, every)


def _all_held(
    uni: Unilateral, work: Work, rows: Rows, record: Array, modes: InstantModes
) -> HeldForces | None:
    """Every closed contact point and what sticks; None where so few cannot depend on each other."""
    points = uni.contact_points
    normals = [n for n, mode in enumerate(modes.modes) if mode != "open"]
    joints = [m for m, mode in enumerate(modes.pairs) if mode == "stick"]
    # what joints guide may be held twice by one contact that sticks
    guided = bool(uni.system.rows) and any(modes.modes[n] == "stick" for n in normals)
    if not modes.on.any() or (len(normals) < 2 and not joints and not guided):
        return None
    n = uni.system.coordinates
    slipping = {
        k: SLIP_SIGNS[modes.modes[k]]
        for k in normals
        if modes.modes[k] in SLIP_SIGNS and points[k].tangent >= 0
    }
    sticking = [k for k in normals if modes.modes[k] == "stick" and points[k].static > 0.0]
    idle = [k for k in normals if modes.modes[k] == "redundant" and points[k].static > 0.0]
    idle = [k for k in idle if points[k].tangent >= 0]  # limits of joints have none
    if idle:
        holding = _row_space(uni, work, rows, modes.on)
        for k in idle:
            row = rows.block[points[k].tangent] * uni.system.coordinate_units
            left = row - holding.T @ (holding @ row)
            if np.linalg.norm(left) <= tol.SINGULAR_VALUE_SHARED_FRICTION * np.linalg.norm(row):
                sticking.append(k)
                continue
            rate = float(rows.rate[points[k].tangent])
            parts = rows.block[points[k].tangent] * record[2 * n : 3 * n]
            ahead = float(parts.sum() - rows.gamma[points[k].tangent])
            speed = np.abs(rows.block[points[k].tangent] * record[n : 2 * n]).max()
            slides = abs(rate) > tol.RATE_NONE_STOPPED * speed
            slipping[k] = float(np.sign(rate if slides else ahead)) or 1.0
    return HeldForces(uni, work, record, modes, normals, sorted(sticking), joints, slipping, rows)


def _row_space(uni: Unilateral, work: Work, rows: Rows, on: Array) -> Array:
    """Orthonormal rows that span those of joints and those that are on."""
    scale = uni.system.coordinate_units
    every = np.vstack([jacobian(uni.system, work)[1], rows.block[on > 0.0]]) * scale
    every = every / np.maximum(np.linalg.norm(every, axis=1, keepdims=True), tol.TINY)
    _, sizes, vt = np.linalg.svd(every, full_matrices=False)
    return np.asarray(vt[sizes > tol.SINGULAR_VALUE_SHARED_FRICTION])
