"""Memory of steps with impulses: contacts, matrices of bodies, what one step leaves the next."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from mbody.analysis.contact.contact_tables import coupled_bodies
from mbody.kernels.contact_geometry import FOUND, LACKING
from mbody.kernels.contact_interior import NEEDED, WAITING
from mbody.kernels.contact_search import PRIMES
from mbody.kernels.contact_shapes import ContactWork, InteriorWork
from mbody.kernels.layout import Layout, Work, inverse_masses
from mbody.system.system import System

__all__ = ["ImpulseMemory"]

Array = np.ndarray

#: Contacts for which there is memory at first, and columns of bodies that joints tie.
ROOM, COLUMNS = 64, 16
#: What a contact has in `ContactWork`: width by name.
WIDTHS = {"who": 6, "old": 3, "geometry": 8, "effect": 7}


def joint_rows(layout: Layout) -> list[list[tuple[int, int]]]:
    """Of every row of joints its moving bodies, and where the numbers of each are among blocks."""
    sides: list[list[tuple[int, int]]] = [[] for _ in range(2 * layout.nodes)]
    for k in range(layout.nodes):
        for side in range(2):
            column = int(layout.node_column[2 * k + side])
            for row in range(2):
                sides[2 * k + row].append((column, 12 * k + 6 * side + 3 * row))
    for n, (k, column) in enumerate(layout.more):
        sides[2 * int(k)].append((int(column), 12 * layout.nodes + 6 * n))
    bodies = [*layout.slot_body, layout.bodies]
    found = [[(int(bodies[column // 3]), block) for column, block in row] for row in sides]
    # welds of the slots of one body are no rows of bodies
    return [
        [one for one in row if one[0] < layout.bodies] if len({body for body, _ in row}) > 1 else []
        for row in found
    ]


class ImpulseMemory:
    """Memory for contacts and for the interior-point method, as much as there is need for.

    Attributes
    ----------
    contacts : ContactWork
    interior : InteriorWork
    """

    def __init__(self, system: System, layout: Layout, work: Work, shapes: int) -> None:
        self.layout, self.shapes = layout, shapes
        self.room, self.columns = ROOM, COLUMNS
        self.coupled = {system.bodies[name] for name in coupled_bodies(system.mechanism)}
        masses = inverse_masses(layout, system.mass, system.length)[:, 0]
        #: Inverse masses, zero of the ground.
        self.inverse = np.zeros(3 * layout.bodies + 3)
        for b in range(layout.bodies):
            s = int(layout.body_slot[b])
            share = float(work.share[s, 0])
            self.inverse[3 * b : 3 * b + 3] = masses[3 * s : 3 * s + 3] * share
        self.contacts = self._contacts()
        self.interior = self._interior(0)

    def kept(self) -> tuple[Array, Array, Array]:
        """What the next step begins with: contacts (shapes, feature, impulses), what joints take,
        and for how many steps sweeps are not tried.
        """
        B, N = self.contacts, self.interior
        which = np.unique(B.old_slot[B.old_slot >= 0])
        waiting = np.array([float(N.count[WAITING])])
        return np.column_stack([B.old[which], B.old_impulse[which]]), N.old_pull.copy(), waiting

    def begin_with(self, contacts: Array, pull: Array, waiting: Array) -> None:
        """Begin the next step with what was `kept`."""
        while self.room < len(contacts):
            self.room *= 2
        self.contacts, self.interior = self._contacts(), self._interior(0)
        self.recall(contacts[:, :3].astype(np.int64), contacts[:, 3:])
        # a step that needs no interior-point method leaves what joints take as it was
        self.interior.pull[:] = self.interior.old_pull[:] = pull
        self.interior.count[WAITING] = int(waiting[0])

    def _contacts(self) -> ContactWork:
        """Memory for contacts."""
        L, shapes, most = self.layout, self.shapes, self.room
        bodies, n = L.bodies, 3 * L.bodies + 3
        coupled = self.coupled
        coordinates = [3 * b + k for b in sorted(coupled) for k in range(3)]
        is_coupled = np.zeros(bodies + 1, dtype=np.int64)
        is_coupled[list(coupled)] = 1
        wide = {name: np.zeros((most, width)) for name, width in WIDTHS.items()}
        names = ("impulse", "kept", "ahead", "rate", "old_impulse")
        places = 1 << (4 * most - 1).bit_length()
        return ContactWork(
            who=wide["who"].astype(np.int64),
            geometry=wide["geometry"],
            effect=wide["effect"],
            **{name: np.zeros((most, 2)) for name in names},
            shift=np.zeros(most),
            column=np.full(most, -1),
            response=np.zeros((2 * self.columns, max(1, len(coordinates)))),
            coupled=np.array(coordinates, dtype=np.int64),
            is_coupled=is_coupled,
            inverse=self.inverse,
            **{name: np.zeros(n) for name in ("velocity", "free", "start", "moved")},
            row_rate=np.zeros(2 * max(1, L.nodes)),
            row_impulse=np.zeros(2 * max(1, L.nodes)),
            old=wide["old"].astype(np.int64),
            old_slot=np.full(places, -1),
            place=np.zeros((max(1, shapes), 2)),
            margin=np.zeros(max(1, shapes)),
            turning=np.zeros(max(1, shapes)),
            cell=np.zeros((max(1, shapes), 2), dtype=np.int64),
            following=np.full(max(1, shapes), -1),
            bucket=np.full(1 << (2 * max(4, shapes) - 1).bit_length(), -1),
            progress=np.zeros(2),
            counts=np.zeros(3, dtype=np.int64),
        )

    def _interior(self, numbers: int) -> InteriorWork:
        """Memory for the interior-point method, with a matrix of so many numbers."""
        L, most = self.layout, self.room
        rows = joint_rows(L)
        pairs = {
            (min(i, j), max(i, j))
            for row in rows
            for (i, _), (j, _) in combinations(row, 2)
            if i != j
        }
        parts = [part for row in rows for part in row]
        sides = ("dual", "slack", "dual_step", "slack_step", "target", "lack")
        return InteriorWork(
            matrix=np.zeros(numbers),
            **{name: np.zeros(L.bodies, dtype=np.int64) for name in ("place", "order", "first")},
            **{name: np.zeros(L.bodies + 1, dtype=np.int64) for name in ("offset", "start")},
            neighbour=np.zeros(2 * (most + len(pairs)), dtype=np.int64),
            tied=np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2),
            row_start=np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64),
            row_body=np.array([body for body, _ in parts], dtype=np.int64),
            row_block=np.array([block for _, block in parts], dtype=np.int64),
            **{name: np.zeros(len(rows)) for name in ("stiffness", "pull", "old_pull", "rate")},
            **{name: np.zeros((most, 2)) for name in sides},
            **{name: np.zeros(3 * L.bodies + 3) for name in ("rest", "step")},
            sorted=np.zeros(3 * L.bodies),
            count=np.zeros(2, dtype=np.int64),
        )

    def extend(self) -> None:
        """More memory, with the impulses of the step before."""
        old, before = self.contacts, self.interior
        needed = int(before.count[NEEDED])
        if needed > len(before.matrix):
            self.interior = self._interior(needed + needed // 2)
            self._go_on_from(before)
            return
        lacking = int(old.counts[FOUND] + old.counts[LACKING]) > self.room
        if lacking:
            self.room *= 2
        self.columns = 2 * self.columns if not lacking else max(self.columns, COLUMNS)
        self.contacts = self._contacts()
        self.interior = self._interior(len(before.matrix))
        self._go_on_from(before)
        kept = np.unique(old.old_slot[old.old_slot >= 0])
        self.recall(old.old[kept], old.old_impulse[kept])

    def _go_on_from(self, before: InteriorWork) -> None:
        """What new memory of the interior-point method has of the old one."""
        new = self.interior
        new.pull[:], new.old_pull[:], new.count[:] = before.pull, before.old_pull, before.count

    def recall(self, old: Array, impulses: Array) -> None:
        """Begin the next step with contacts (shapes, feature) and their impulses."""
        B = self.contacts
        B.old[: len(old)], B.old_impulse[: len(old)] = old, impulses
        mask = len(B.old_slot) - 1
        B.old_slot[:] = -1
        for n, one in enumerate(old):
            k = int(np.bitwise_xor.reduce(one * np.array(PRIMES))) & mask
            while B.old_slot[k] >= 0:
                k = (k + 1) & mask
            B.old_slot[k] = n
