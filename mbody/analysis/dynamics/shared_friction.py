"""Sticking with redundant constraints: friction forces that no equation decides.

A wheel with its brake on that stands on the road, a linkage at rest with several pins with
friction: the accelerations follow, the forces do not. It goes on to stick as long as there are
forces that keep every limit, which a linear program finds: the greatest reserve t such that for
some y

    low(f + Z y) + T ≥ t,   high(f + Z y) − T ≥ t,   N ≥ t,

Z the forces that are in balance with themselves. Limits of pins are convex in f: their tangents
lie below them, so that what the program finds is so; it is repeated with tangents at what it
found. Where t is zero, its multipliers are the motion that begins: what has none goes on to
stick.

Limit analysis: Drucker, Prager, Greenberg (1952), here with the limits of friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.complementarity import JointFriction
from mbody.analysis.contact.unilateral import SLIP_SIGNS
from mbody.analysis.dynamics.modal_motion import ModalMotion, Reserve, force_size, multipliers_at
from mbody.core import tolerances as tol
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.system.rank import dense

Array = np.ndarray

#: Linear programs with tangents of the limits, at most.
PASSES = 8


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

    def _columns(self, motion: ModalMotion, record: Array, work: Work) -> tuple[Array, Array]:
        """Generalised forces by every force, (coordinates, forces), and these: joints', normal,
        tangential, of frictional joints; without units.
        """
        uni, system, n = motion.uni, motion.system, motion.system.coordinates
        rows, units, length = uni.read(work), system.coordinate_units, system.length
        primitive, number, _ = system.row_table
        _, G = dense(system, work)
        own = record[3 * n + PER_PRIMITIVE * primitive + number] / system.row_units
        of_joints, columns, forces = -G.T, list[Array](), list[float]()
        for m, pair in enumerate(uni.friction_joints):
            if (mode := motion.pairs[m]) not in SLIP_SIGNS:
                continue
            law = JointFriction(system, work, pair.pair, rows.rate[pair.tangent])
            at = system.layout.primitive_node[primitive] == law.node
            x, y = multipliers_at(system, record, law.node)
            _, *derivatives = law.size(x, y, SLIP_SIGNS[mode])
            for r in np.flatnonzero(at):
                change = -SLIP_SIGNS[mode] * derivatives[int(number[r])] * system.row_units[r]
                of_joints[:, r] += change * rows.block[pair.tangent] * units
        for k in self.normals:
            point, mode = uni.contact_points[k], motion.modes[k]
            row = point.candidate.sign * rows.block[point.normal]
            if mode in SLIP_SIGNS and point.tangent >= 0:
                row = row - point.friction * SLIP_SIGNS[mode] * rows.block[point.tangent]
            columns.append(row * units / length)
            forces.append(float(uni.pressing(record, point)) * length)
        tangents = [uni.contact_points[k].tangent for k in self.sticking]
        for row in (*tangents, *(uni.friction_joints[m].tangent for m in self.joints)):
            unit = 1.0 if uni.angular[row] else length
            columns.append(rows.block[row] * units / unit)
            forces.append(-float(uni.multiplier(record, row)) * unit)
        return np.column_stack([of_joints, *columns]), np.concatenate([own, forces])

    def free_forces(self, motion: ModalMotion, record: Array, work: Work) -> tuple[Array, Array]:
        """Forces in balance with themselves (forces, free) and the present ones; those of joints
        alone are not among them.
        """
        F, forces = self._columns(motion, record, work)
        count = len(self.normals) + len(self.sticking) + len(self.joints)
        _, sizes, vt = np.linalg.svd(F)
        rank = int(
            (
                sizes > tol.SINGULAR_VALUE_SHARED_FRICTION * max(1.0, float(sizes.max(initial=0.0)))
            ).sum()
        )
        Z = vt[rank:].T
        _, sizes, vt = np.linalg.svd(Z[len(forces) - count :])
        return Z @ vt[: int((sizes > tol.SINGULAR_VALUE_SHARED_FRICTION).sum())].T, forces

    def reserve(self, motion: ModalMotion, record: Array, work: Work) -> Reserve:
        """The greatest reserve by a record (rows,), with the rows of that position."""
        from scipy.optimize import linprog

        Z, forces = self.free_forces(motion, record, work)
        size = max(force_size(motion), tol.TINY) * motion.system.length
        y, best, active = np.zeros(Z.shape[1]), -np.inf, list[tuple[int, float]]()
        bounds = [(None, None)] * len(y) + [(None, tol.FRICTION_RESERVE_MOST * size)]
        for _ in range(PASSES):
            limits = self._limits(motion, record, work, forces, Z @ y)
            found = linprog(
                np.append(np.zeros(len(y)), -1.0 / size),
                A_ub=np.array([np.append(-by @ Z, 1.0) for *_, by, _ in limits]) / size,
                b_ub=np.array([value for *_, value in limits]) / size,
                bounds=bounds,
            )
            if found.status != 0 or float(found.x[-1]) <= best + tol.CONTACT_FORCE_SETTLED * size:
                break
            y, best = found.x[:-1], float(found.x[-1])
            loads = -found.ineqlin.marginals
            moves = loads > tol.LINEAR_PROGRAM_MULTIPLIER * float(loads.max())
            active = [one[:2] for one, some in zip(limits, moves, strict=True) if some]
            if all(self._law(motion, work, m).by_law for m in self.joints):
                break
        sliding = {number: slip_sign for number, slip_sign in active if slip_sign}
        opened = {number for number, slip_sign in active if not slip_sign}
        return Reserve(best / motion.system.length, sliding, opened)

    def _limits(
        self, motion: ModalMotion, record: Array, work: Work, forces: Array, change: Array
    ) -> list[tuple[int, float, Array, float]]:
        """Friction reserves that must stay positive: number of the contact or pair, sign of the
        sliding (0 of a normal force), gradient by all forces, and value now; with tangents where
        forces change by `change`.
        """
        uni, found = motion.uni, list[tuple[int, float, Array, float]]()
        every = np.eye(len(forces))
        first = len(forces) - len(self.normals) - len(self.sticking) - len(self.joints)
        place = {k: first + n for n, k in enumerate(self.normals)}
        found += [(k, 0.0, every[place[k]], float(forces[place[k]])) for k in self.pressing]
        n = first + len(self.normals)
        for k in self.sticking:
            group = motion.groups.get(k, [k])
            by = np.sum([uni.contact_points[j].static * every[place[j]] for j in group], axis=0)
            for slip_sign in (1.0, -1.0) if k in self.members else ():
                # low + T of what would slide forwards, high − T of what would backwards
                own = by + slip_sign * every[n]
                found.append((k, slip_sign, own, float(own @ forces)))
            n += 1
        for m in self.joints:
            number = len(uni.contact_points) + m
            for slip_sign in (1.0, -1.0) if number in self.members else ():
                by, value = self._tangent(motion, record, work, m, slip_sign, change)
                own = by + slip_sign * every[n]
                found.append((number, slip_sign, own, value + slip_sign * float(forces[n])))
            n += 1
        return found

    def _law(self, motion: ModalMotion, work: Work, m: int) -> JointFriction:
        return JointFriction(motion.system, work, motion.uni.friction_joints[m].pair)

    def _tangent(
        self,
        motion: ModalMotion,
        record: Array,
        work: Work,
        m: int,
        slip_sign: float,
        change: Array,
    ) -> tuple[Array, float]:
        """The tangent of the limit of a frictional joint where forces have changed so: by all
        forces, and its value without the change.
        """
        system, law = motion.system, self._law(motion, work, m)
        primitive, number, _ = system.row_table
        at = np.flatnonzero(system.layout.primitive_node[primitive] == law.node)
        by_rows = np.zeros((2, len(change)))
        by_rows[number[at], at] = system.row_units[at]
        now = np.array(multipliers_at(system, record, law.node)) + by_rows @ change
        value, by_x, by_y = law.size(float(now[0]), float(now[1]), slip_sign)
        unit = 1.0 if motion.uni.angular[motion.uni.friction_joints[m].tangent] else system.length
        by = unit * (by_x * by_rows[0] + by_y * by_rows[1])
        return by, unit * value - float(by @ change)


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
    if not joints and len(sticking) < 2:
        return None
    every = SharedFriction(normals, sticking, joints)
    motion.load()
    Z, forces = every.free_forces(motion, motion.record[:, 0], motion.work)
    if not Z.shape[1]:
        return None
    moves = np.abs(Z).max(axis=1) > tol.SINGULAR_VALUE_SHARED_FRICTION
    first = len(forces) - len(normals) - len(sticking) - len(joints)
    own = first + len(normals)
    place = {k: first + n for n, k in enumerate(normals)}
    members = {
        k
        for n, k in enumerate(sticking, start=own)
        if moves[n] or any(moves[place[one]] for one in motion.groups.get(k, [k]))
    }
    primitive = motion.system.row_table[0]
    for n, m in enumerate(joints, start=own + len(sticking)):
        node = int(motion.layout.friction_node[uni.friction_joints[m].pair])
        at = motion.layout.primitive_node[primitive] == node
        law = JointFriction(motion.system, motion.work, uni.friction_joints[m].pair)
        if moves[n] or (not law.by_law and moves[np.flatnonzero(at)].any()):
            members.add(len(uni.contact_points) + m)
    pressing = frozenset(k for k in normals if moves[place[k]])
    if not members and not pressing:
        return None
    return SharedFriction(normals, sticking, joints, frozenset(members), pressing)
