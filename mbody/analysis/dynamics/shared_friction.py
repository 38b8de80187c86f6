"""What sticks where more rows hold than the motion needs: forces that no equation decides.

A wheel with its brake on that stands on the road, a linkage at rest with several rough pins: the
accelerations follow, the forces do not. It goes on to stick as long as there are forces that keep
every limit, which a linear program finds: the greatest reserve t such that for some y

    low(f + Z y) + T ≥ t,   high(f + Z y) − T ≥ t,   N ≥ t,

Z the forces that are in balance with themselves. Limits of pins are convex in f: their tangents lie
below them, so that what the program finds is so; it is repeated with tangents at what it found.
Where t is zero, its multipliers are the motion that begins: what has none goes on to stick.

Limit analysis: Drucker, Prager, Greenberg (1952), here with the limits of friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.joint_friction import JointFriction
from mbody.analysis.contact.unilateral import SENSES
from mbody.analysis.dynamics.friction_model import force_size
from mbody.analysis.dynamics.modal_motion import ModalMotion, Reserve
from mbody.kernels.layout import Work
from mbody.kernels.output import PER_PRIMITIVE
from mbody.system.rank import dense

__all__ = ["SharedFriction", "shared_friction"]

Array = np.ndarray

#: Singular values, and parts of a combination, below this part of the greatest are zero.
ZERO = 1e-8
#: Linear programs with tangents of the limits, at most; a reserve that grows by less, as a part of
#: the greatest force, does not.
PASSES, SAME = 8, 1e-12
#: A reserve is at most so many times the greatest force.
MOST = 10.0
#: Multipliers of the program above this part are some.
MOVES = 1e-7


@dataclass(frozen=True, eq=False)
class SharedFriction:
    """The touches and rough joints that share what no equation decides.

    Attributes
    ----------
    normals, sticking : tuples of int
        Closed touches; those that stick by a row of their own.
    joints : tuple of int
        Rough joints that stick, by number among these.
    members : frozenset of int
        Those of `sticking` and, after the touches, of `joints` whose forces are open.
    pressing : frozenset of int
        Those of `normals` whose forces are open.
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

    def _columns(self, motion: ModalMotion, page: Array, work: Work) -> tuple[Array, Array]:
        """Generalised forces by every force, (coordinates, forces), and these: joints', normal,
        tangential, of rough joints; without units.
        """
        uni, system, n = motion.uni, motion.system, motion.system.coordinates
        rows, units, length = uni.read(work), system.coordinate_units, system.length
        primitive, number, _ = system.row_table
        _, G = dense(system, work)
        own = page[3 * n + PER_PRIMITIVE * primitive + number] / system.row_units
        of_joints, columns, forces = -G.T, list[Array](), list[float]()
        for m, pair in enumerate(uni.rough):
            if (mode := motion.pairs[m]) not in SENSES:
                continue
            law = JointFriction(system, work, pair.pair, rows.rate[pair.tangent])
            at = system.layout.primitive_node[primitive] == law.node
            x, y = self._pressing(motion, page, law.node)
            _, *slopes = law.size(x, y, SENSES[mode])
            for r in np.flatnonzero(at):
                change = -SENSES[mode] * slopes[int(number[r])] * system.row_units[r]
                of_joints[:, r] += change * rows.block[pair.tangent] * units
        for k in self.normals:
            touch, mode = uni.touches[k], motion.modes[k]
            row = touch.spot.sense * rows.block[touch.normal]
            if mode in SENSES and touch.tangent >= 0:
                row = row - touch.friction * SENSES[mode] * rows.block[touch.tangent]
            columns.append(row * units / length)
            forces.append(float(uni.pressing(page, touch)) * length)
        tangents = [uni.touches[k].tangent for k in self.sticking]
        for row in (*tangents, *(uni.rough[m].tangent for m in self.joints)):
            unit = 1.0 if uni.angular[row] else length
            columns.append(rows.block[row] * units / unit)
            forces.append(-float(uni.multiplier(page, row)) * unit)
        return np.column_stack([of_joints, *columns]), np.concatenate([own, forces])

    @staticmethod
    def _pressing(motion: ModalMotion, page: Array, node: int) -> tuple[float, float]:
        e = int(np.flatnonzero(motion.layout.primitive_node == node)[0])
        first = 3 * motion.system.coordinates + PER_PRIMITIVE * e
        return float(page[first]), float(page[first + 1])

    def free_forces(self, motion: ModalMotion, page: Array, work: Work) -> tuple[Array, Array]:
        """Forces in balance with themselves (forces, free) and the present ones; those of joints
        alone are not among them.
        """
        F, forces = self._columns(motion, page, work)
        count = len(self.normals) + len(self.sticking) + len(self.joints)
        _, sizes, vt = np.linalg.svd(F)
        rank = int((sizes > ZERO * max(1.0, float(sizes.max(initial=0.0)))).sum())
        Z = vt[rank:].T
        _, sizes, vt = np.linalg.svd(Z[len(forces) - count :])
        return Z @ vt[: int((sizes > ZERO).sum())].T, forces

    def reserve(self, motion: ModalMotion, page: Array, work: Work) -> Reserve:
        """The greatest reserve by a page (rows,), with the rows of that position."""
        from scipy.optimize import linprog

        Z, forces = self.free_forces(motion, page, work)
        size = max(force_size(motion), 1e-300) * motion.system.length
        y, best, active = np.zeros(Z.shape[1]), -np.inf, list[tuple[int, float]]()
        bounds = [(None, None)] * len(y) + [(None, MOST * size)]
        for _ in range(PASSES):
            limits = self._limits(motion, page, work, forces, Z @ y)
            found = linprog(
                np.append(np.zeros(len(y)), -1.0 / size),
                A_ub=np.array([np.append(-by @ Z, 1.0) for *_, by, _ in limits]) / size,
                b_ub=np.array([value for *_, value in limits]) / size,
                bounds=bounds,
            )
            if found.status != 0 or float(found.x[-1]) <= best + SAME * size:
                break
            y, best = found.x[:-1], float(found.x[-1])
            loads = -found.ineqlin.marginals
            moves = loads > MOVES * float(loads.max())
            active = [one[:2] for one, some in zip(limits, moves, strict=True) if some]
            if all(self._law(motion, work, m).by_law for m in self.joints):
                break
        sliding = {number: sense for number, sense in active if sense}
        opened = {number for number, sense in active if not sense}
        return Reserve(best / motion.system.length, sliding, opened)

    def _limits(
        self, motion: ModalMotion, page: Array, work: Work, forces: Array, change: Array
    ) -> list[tuple[int, float, Array, float]]:
        """What is to be at least the reserve: whose it is, the sense in which that would slide, 0
        of normal forces, by all forces, and its value now; with tangents where forces have changed
        so.
        """
        uni, found = motion.uni, list[tuple[int, float, Array, float]]()
        every = np.eye(len(forces))
        first = len(forces) - len(self.normals) - len(self.sticking) - len(self.joints)
        place = {k: first + n for n, k in enumerate(self.normals)}
        found += [(k, 0.0, every[place[k]], float(forces[place[k]])) for k in self.pressing]
        n = first + len(self.normals)
        for k in self.sticking:
            group = motion.groups.get(k, [k])
            by = np.sum([uni.touches[j].static * every[place[j]] for j in group], axis=0)
            for sense in (1.0, -1.0) if k in self.members else ():
                # low + T of what would slide forwards, high − T of what would backwards
                own = by + sense * every[n]
                found.append((k, sense, own, float(own @ forces)))
            n += 1
        for m in self.joints:
            number = len(uni.touches) + m
            for sense in (1.0, -1.0) if number in self.members else ():
                by, value = self._tangent(motion, page, work, m, sense, change)
                own = by + sense * every[n]
                found.append((number, sense, own, value + sense * float(forces[n])))
            n += 1
        return found

    def _law(self, motion: ModalMotion, work: Work, m: int) -> JointFriction:
        return JointFriction(motion.system, work, motion.uni.rough[m].pair)

    def _tangent(
        self, motion: ModalMotion, page: Array, work: Work, m: int, sense: float, change: Array
    ) -> tuple[Array, float]:
        """The tangent of the limit of a rough joint where forces have changed so: by all forces,
        and its value without the change.
        """
        system, law = motion.system, self._law(motion, work, m)
        primitive, number, _ = system.row_table
        at = np.flatnonzero(system.layout.primitive_node[primitive] == law.node)
        by_rows = np.zeros((2, len(change)))
        by_rows[number[at], at] = system.row_units[at]
        now = np.array(self._pressing(motion, page, law.node)) + by_rows @ change
        value, by_x, by_y = law.size(float(now[0]), float(now[1]), sense)
        unit = 1.0 if motion.uni.angular[motion.uni.rough[m].tangent] else system.length
        by = unit * (by_x * by_rows[0] + by_y * by_rows[1])
        return by, unit * value - float(by @ change)


def shared_friction(motion: ModalMotion) -> SharedFriction | None:
    """What sticks in the present modes with forces that are open; None where all are decided."""
    uni = motion.uni
    normals = tuple(n for n, mode in enumerate(motion.modes) if mode != "open")
    followers = {n for group in motion.groups.values() for n in group[1:]}
    sticking = tuple(
        n
        for n in normals
        if motion.modes[n] == "stick" and n not in followers and uni.touches[n].static > 0.0
    )
    joints = tuple(m for m, mode in enumerate(motion.pairs) if mode == "stick")
    if not joints and len(sticking) < 2:
        return None
    every = SharedFriction(normals, sticking, joints)
    motion.load()
    Z, forces = every.free_forces(motion, motion.page[:, 0], motion.work)
    if not Z.shape[1]:
        return None
    moves = np.abs(Z).max(axis=1) > ZERO
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
        node = int(motion.layout.friction_node[uni.rough[m].pair])
        at = motion.layout.primitive_node[primitive] == node
        law = JointFriction(motion.system, motion.work, uni.rough[m].pair)
        if moves[n] or (not law.by_law and moves[np.flatnonzero(at)].any()):
            members.add(len(uni.touches) + m)
    pressing = frozenset(k for k in normals if moves[place[k]])
    if not members and not pressing:
        return None
    return SharedFriction(normals, sticking, joints, frozenset(members), pressing)
