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
from typing import NamedTuple

import numpy as np

from mbody.analysis.contact.unilateral import SLIP_SIGNS, Unilateral
from mbody.kernels import held_forces as kernels
from mbody.kernels.friction import ARMS, FRICTION_KINDS
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.solution.shared_forces import (
    BentLimit,
    ForceLimits,
    ForceSet,
    open_forces,
    pressing_rows,
    primitive_numbers,
    reported,
)

Array = np.ndarray


class InstantModes(NamedTuple):
    """Modes of an instant: of the contact points and frictional joints, and which rows are on."""

    modes: list[str]
    pairs: list[str]
    on: Array


class HeldForces:
    """All forces that hold at an instant, with their units: multipliers of joints, then N of closed
    contact points, then friction of those that stick and of the joints that stick.

    `columns` (coordinates, forces): Generalised forces by each, with the friction of what slides.
    `forces` (forces,): Present ones.
    `limits`: Normal forces and friction; owners are contact points and, after them, frictional
      joints.
    """

    def __init__(
        self,
        uni: Unilateral,
        pairs: Sequence[str],
        normals: Sequence[int],
        sticking: Sequence[int],
        joints: Sequence[int],
        slipping: dict[int, float],
    ) -> None:
        system, L, self.uni, self.layout = uni.system, uni.layout, uni, uni.layout
        self.slipping, self.normals = slipping, tuple(normals)
        rows = [uni.contact_points[k].tangent for k in sticking]
        rows += [uni.friction_joints[m].tangent for m in joints]
        self.primitive, self.number, _ = system.row_table
        first = len(self.primitive)  # of what is no joint's
        pair_slip = np.zeros(len(L.friction_kind))
        for one, mode in zip(uni.friction_joints, pairs, strict=True):
            pair_slip[one.pair] = SLIP_SIGNS.get(mode, 0.0)
        for f in filter(uni.separates_wheels, range(len(pair_slip))):
            pair_slip[f] = float(system.par[int(L.friction_par[f]) + 4, 0])
        pressed = [uni.friction_joints[m].pair for m in joints]
        by_law = [FRICTION_KINDS[int(L.friction_kind[f])] in ("torque", "force") for f in pressed]
        lines, bent = len(normals) + 2 * len(sticking) + 2 * sum(by_law), len(joints) - sum(by_law)
        forces = first + len(normals) + len(rows)
        self.size = 3 * L.bodies, forces, lines, bent
        whole = np.int64
        self.held = kernels.HeldForceTable(
            count=np.array([len(normals), len(sticking), len(joints)], whole),
            row=np.column_stack([self.primitive, self.number]),
            normal=np.array(self.normals, whole),
            slip=np.array([slipping.get(k, 0.0) for k in normals], float),
            leader=np.full(len(normals), -1, whole),
            stick=np.array(sticking, whole),
            joint=np.array(joints, whole),
            pair_slip=pair_slip,
            owner=np.zeros(lines + 2 * bent, whole),
            change=np.zeros((len(pair_slip), 2)),
            along=np.zeros(3 * L.bodies),
            arm=np.zeros(2 * ARMS + 1),
        )
        signs = [0.0] * len(normals) + [1.0, -1.0] * ((lines - len(normals)) // 2 + bent)
        self.signs = np.array(signs)
        self.own = np.arange(forces) >= first
        self.columns, self.forces = np.zeros((3 * L.bodies, forces)), np.zeros(forces)
        self.which, self.parts = self._parts(rows)
        #: Their numbers in a record, from the first of all.
        each = PER_PRIMITIVE * self.which[:, None] + np.arange(PER_PRIMITIVE)
        self.numbers = each.ravel()

    def read(self, work: Work, record: Array) -> ForceLimits:
        """The forces by a record (rows,) at the position and velocities in a workspace; their
        limits.
        """
        S, _ = open_forces(*self.size)
        kernels.hold_forces(self.uni.layout, work, self.uni.table, self.held, S, record)
        self.columns, self.forces = S.column.copy(), S.force.copy()
        bent = tuple(
            BentLimit(int(owner), int(one[0]), (int(one[1]), int(one[2])), int(one[3]), arm, size)
            for owner, one, arm, size in zip(
                self.held.owner[len(S.line) :: 2],
                S.bent,
                S.arm.copy(),
                S.length.tolist(),
                strict=True,
            )
        )
        own, relative = self.owners()[: len(S.line)], S.relative > 0
        return ForceLimits(own, S.line.copy(), S.given.copy(), relative, S.counts.copy(), bent)

    def owners(self) -> list[tuple[int, float]]:
        """Whose the limits are, and the sign of the sliding, 0 of normal forces."""
        return list(zip(self.held.owner.tolist(), self.signs.tolist(), strict=True))

    def multipliers(self, change: Array) -> Array:
        """Changes of the multipliers of the primitives `which`, (which, 2, …), by changes of the
        forces (forces, …), to first order in friction of joints that slides.
        """
        found = (self.parts @ change).reshape(len(self.which), 2, *change.shape[1:])
        for f in np.flatnonzero(self.held.change.any(axis=1)):
            e = np.searchsorted(self.which, self.layout.active_set[self.layout.friction_tangent[f]])
            rows = pressing_rows(self.uni.system, int(self.layout.friction_node[f]))
            for part, row in zip(self.held.change[f], rows, strict=True):
                if row >= 0:
                    found[e, 0] += part * change[row]
        return found

    def _parts(self, rows: Sequence[int]) -> tuple[Array, Array]:
        """The primitives with forces, (which,), and their multipliers by each of the forces,
        (2·which, forces): of joints, of contacts with the friction of those that slide, of `rows`.
        """
        uni, active, first = self.uni, self.layout.active_set, len(self.primitive)
        entries = list(zip(self.primitive, self.number, range(first), [1.0] * first, strict=True))
        for n, k in enumerate(self.normals, start=first):
            point = uni.contact_points[k]
            entries.append((active[point.normal], 0, n, -point.candidate.sign))
            if k in self.slipping:
                entries.append((active[point.tangent], 0, n, point.friction * self.slipping[k]))
        for n, row in enumerate(rows, start=first + len(self.normals)):
            entries.append((active[row], 0, n, -1.0))
        tangents = active[self.layout.friction_tangent[self.held.pair_slip != 0.0]]
        which = np.unique([*(one[0] for one in entries), *tangents.tolist()]).astype(np.int64)
        parts = np.zeros((len(which), 2, len(self.forces)))
        for primitive, number, n, sign in entries:
            parts[np.searchsorted(which, primitive), number, n] = sign
        return which, parts.reshape(2 * len(which), -1)


# -- What is reported --------------------------------------------------------------------------


class Reported(NamedTuple):
    """A record whose forces are admissible, and all that are; None where they are determined."""

    record: Array
    forces: ForceSet | None


class SharedForces:
    """What is reported where a motion has redundant constraints; what holds in some modes is kept.

    `uni`: What may touch, slide or stop.
    """

    def __init__(self, uni: Unilateral) -> None:
        self.uni = uni
        self._held = dict[tuple[str, ...], HeldForces | None]()

    def reported(self, work: Work, record: Array, modes: InstantModes) -> Reported:
        """The record (rows,) of an instant with those forces that keep their limits best, at the
        position in a workspace.
        """
        held = self._all_held(modes) if modes.on.any() else None
        if held is None:
            return Reported(record, None)
        limits, uni = held.read(work, record), self.uni
        forces, parts, margins = reported(held.columns, held.forces, held.own, limits)
        if not parts:
            return Reported(record, None)
        moved = np.column_stack([forces - held.forces, *(part.free for part in parts)])
        changes = primitive_numbers(uni.layout, work, held.multipliers(moved), held.which)
        changes = changes.reshape(-1, moved.shape[1])
        found = record.copy()
        found[3 * uni.system.coordinates + held.numbers] += changes[:, 0]
        touched = changes[:, 1:].any(axis=1)
        least = np.array([one.least for one in margins])
        worst = tuple(owner for one in margins if one.least < 0.0 for owner in one.active)
        rows, free = held.numbers[touched], changes[touched, 1:]
        every = ForceSet(forces, limits, tuple(parts), least, worst, rows, free)
        return Reported(found, every)

    def _all_held(self, modes: InstantModes) -> HeldForces | None:
        """Every closed contact point and what sticks; None where so few cannot depend on each
        other.
        """
        key = (*modes.modes, *modes.pairs)
        if key in self._held:
            return self._held[key]
        uni, points = self.uni, self.uni.contact_points
        normals = [n for n, mode in enumerate(modes.modes) if mode != "open"]
        joints = [m for m, mode in enumerate(modes.pairs) if mode == "stick"]
        # what joints guide may be held twice by one contact that sticks
        guided = bool(uni.system.rows) and any(modes.modes[n] == "stick" for n in normals)
        if len(normals) >= 2 or joints or guided:
            slipping = {
                k: SLIP_SIGNS[modes.modes[k]]
                for k in normals
                if modes.modes[k] in SLIP_SIGNS and points[k].tangent >= 0
            }
            sticking = [k for k in normals if modes.modes[k] == "stick" and points[k].static > 0.0]
            held = HeldForces(uni, modes.pairs, normals, sticking, joints, slipping)
        else:
            held = None
        self._held[key] = held
        return held
