"""Forces of contacts at rest: what friction leaves open, as linear programs.

Where contacts are closed and nothing slides, normal forces and friction may be any that balance all
bodies, with λ_N ≥ 0 and |λ_T| ≤ μ_s λ_N. That is convex: the least and the greatest effort are
those at which something is about to slip, or a contact to open, and where there are no such forces
at all the position cannot be held.
"""

from __future__ import annotations

import numpy as np

from mbody.kernels.layout import Work
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.rough_pairs import rough_pairs
from mbody.system.rank import dense
from mbody.system.system import System

__all__ = ["ContactLimits", "RestingContacts", "rubs_by_contacts_alone"]

Array = np.ndarray

#: Status of a linear program without a bound.
UNBOUNDED = 3
#: A part of the greatest load that a force is at most, in the search of a reserve.
MOST = 1e3


def rubs_by_contacts_alone(system: System) -> bool:
    """Whether all that rubs is contacts that are closed for good."""
    rough = [pair for pair in rough_pairs(system) if pair.loses and not pair.separable]
    closed = {one.name for one in system.mechanism.contacts if one.closed}
    return bool(rough) and all(pair.joint in closed for pair in rough)


class ContactLimits:
    """What the forces of closed contacts are limited by, the same at every position of a system of
    one design: multipliers of all rows, then friction of all closed contacts.

    Parameters
    ----------
    work : Work
        With the numbers of the design.

    Attributes
    ----------
    least : array (limits, forces)
        A line an inequality, each · forces ≥ 0: normal forces, then limits of friction.
    """

    def __init__(self, system: System, work: Work) -> None:
        self.system, self.work = system, work
        self.primitive, self.number, angle = system.row_table
        self.units = np.where(angle, 1.0, system.length)
        self.rows = len(self.primitive)
        self.pairs = [
            (f, pair)
            for f, pair in enumerate(rough_pairs(system))
            if pair.loses and not pair.separable
        ]
        self.least = np.array([*self._normals(), *self._limits()])

    def row(self, e: int) -> int:
        """The row of a primitive, the first of several."""
        return int(np.flatnonzero(self.primitive == e)[0])

    def _pressing(self, e: int, sense: float) -> Array:
        """λ_N of the normal row of a primitive, by all forces."""
        found = np.zeros(self.rows + len(self.pairs))
        found[self.row(e)] = -sense
        return found

    def _normals(self) -> list[Array]:
        at, found = self.system.numbers, list[Array]()
        for contact in self.system.mechanism.contacts:
            if contact.closed:
                own = self.system.primitives_of[contact.name]
                for spot, e in zip(contact.spots(at), own, strict=False):
                    found.append(self._pressing(e, spot.sense))
        return found

    def _limits(self) -> list[Array]:
        L, found = self.system.layout, list[Array]()
        for n, (f, pair) in enumerate(self.pairs):
            e = int(np.flatnonzero(L.primitive_node == L.friction_node[f])[0])
            sense = float(self.work.par[pair.parameter + 4, 0])
            most = float(self.work.par[pair.parameter + 1, 0]) * self._pressing(e, sense)
            for way in (1.0, -1.0):
                own = most.copy()
                own[self.rows + n] = way
                found.append(own)
        return found

    def smooth(self) -> Array:
        """Which inequalities are limits of friction without any coefficient."""
        count = len(self.least) - 2 * len(self.pairs)
        mu = [self.work.par[pair.parameter + 1, 0] == 0.0 for _, pair in self.pairs]
        return np.array([False] * count + [flag for one in mu for flag in (one, one)])


class RestingContacts:
    """The forces of one position, without units of length: multipliers of all rows, then friction
    of all closed contacts.

    Parameters
    ----------
    limits : ContactLimits
        Of the same system.
    work : Work
        At the position, with its rows.
    load : array (coordinates,)
        What constraints must balance, f − M a.
    """

    def __init__(self, limits: ContactLimits, work: Work, load: Array) -> None:
        system = limits.system
        self.system, self.work, self.limits = system, work, limits
        L, scale = system.layout, system.coordinate_units
        G = dense(system, work)[1]
        block = work.block[:, 0].reshape(-1, 3)
        along = np.zeros((len(limits.pairs), system.coordinates + 3))
        for n, (_, pair) in enumerate(limits.pairs):
            node, e = 4 * L.written_node[pair.primitive], pair.primitive
            for side, body in ((0, L.primitive_i[e]), (2, L.primitive_j[e])):
                along[n, 3 * body : 3 * body + 3] += block[node + side]
        tangents = along[:, : system.coordinates] * scale / system.length
        self.balance = np.vstack([G, tangents]).T
        self.load = load * scale
        self.size = float(np.abs(self.load).max(initial=0.0)) or 1.0

    def extreme(self, driver: str, way: float) -> Array | None:
        """The forces at which the effort of a driver is greatest (`way` 1) or least (−1); None
        where nothing holds, infinite where there is no bound.
        """
        aim = np.zeros(self.balance.shape[1])
        # an effort is −λ
        aim[self.limits.row(self.system.primitives_of[driver][0])] = way
        status, forces = self._solved(aim, self.limits.least)
        if status == UNBOUNDED:
            return np.full(len(aim), -way * np.inf)
        return forces if status == 0 else None

    def reserve(self) -> float:
        """How much more every normal force and every limit of rough contacts could take at least,
        as a part of the load: negative where nothing holds.
        """
        aim = np.append(np.zeros(self.balance.shape[1]), -1.0)
        lines = np.column_stack([self.limits.least, np.where(self.limits.smooth(), 0.0, -1.0)])
        status, found = self._solved(aim, lines)
        return float(found[-1]) / self.size if status == 0 and found is not None else -MOST

    def _solved(self, aim: Array, lines: Array) -> tuple[int, Array | None]:
        """Status and forces at the least of aim · forces with lines · forces ≥ 0 in balance; what
        is among `aim` beside the forces is at most `MOST` times the load.
        """
        from scipy.optimize import linprog

        more = aim.size - self.balance.shape[1]
        bounds = [(None, None)] * self.balance.shape[1] + [(None, MOST)] * more
        found = linprog(
            aim,
            A_ub=-lines,
            b_ub=np.zeros(len(lines)),
            A_eq=np.column_stack([self.balance, np.zeros((len(self.balance), more))]),
            b_eq=self.load / self.size,
            bounds=bounds,
        )
        return int(found.status), None if found.x is None else self.size * np.asarray(found.x)

    def table(self, forces: Array) -> Array:
        """The same as numbers of all primitives (PER_PRIMITIVE·primitives,), as results keep
        them; torques about the mass centres.
        """
        L, system = self.system.layout, self.system
        found = np.zeros((len(system.owners), PER_PRIMITIVE))
        block = self.work.block[:, 0].reshape(-1, 3)
        lam = np.zeros((len(system.owners), 2))
        known = self.limits
        lam[known.primitive, known.number] = forces[: known.rows] / known.units
        for (_, pair), force in zip(known.pairs, forces[known.rows :], strict=True):
            lam[pair.primitive, 0] = force / system.length
        for e, (x, y) in enumerate(lam):
            node, j = 4 * L.written_node[e] + 2, int(L.primitive_j[e])
            fx, fy, torque = -(x * block[node] + y * block[node + 1])
            ax, ay = self.work.par[L.primitive_arm[e] : L.primitive_arm[e] + 2, 0]
            c, s = self.work.turn[2 * j : 2 * j + 2, 0]
            px, py = c * ax - s * ay, s * ax + c * ay
            found[e] = x, y, fx, fy, torque - (px * fy - py * fx)
        return found.ravel()
