"""The rows of a system that belong to the active set: contacts, ropes and frictional joints, with
their modes.

A `ContactPoint` is one candidate of a contact or the distance of a rope: a normal row and a tangent
row. A `JointPair` is the sliding pair of a joint: a tangent row alone. Modes are words: "open",
"stick", "slip+" and "slip-".
"""

from __future__ import annotations

import functools
import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from mbody.core.tolerances import CONTACT_GAP_CLOSED, DIRECTION_SAME, DISTANCE_TIE
from mbody.errors import ModelError
from mbody.kernels.contact_rows import UnilateralLayout, points_within, read_rows
from mbody.kernels.friction import FRICTION_KINDS, LASTING
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.model.contact import ContactCandidate
from mbody.model.element import listed
from mbody.model.joint_limits import contacts_of, with_joint_contacts
from mbody.model.joints import Fixed
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

# -- Which systems have what may open, stick or slide, so that modes are to be decided ---------


def has_modes(system: System) -> bool:
    """Whether something may open, or stick by friction, so that its modes are to be decided."""
    pairs, machine = range(len(system.layout.friction_kind)), system.mechanism
    acting = bool(machine.contacts) or any(contacts_of(joint) for joint in machine.joints)
    return acting or any(may_stick(system, f) for f in pairs)


def may_stick(system: System, f: int) -> bool:
    """Whether a friction pair can stick: not what damps alone, nor what has a sign that lasts."""
    L = system.layout
    if FRICTION_KINDS[int(L.friction_kind[f])] in LASTING:
        return False
    return bool(system.par[int(L.friction_par[f]) + 1, 0] > 0.0)


def with_contacts_of_joints(system: System) -> System:
    """The system with the contacts that its joints bring: limits, and what can separate."""
    machine = system.mechanism
    there = {one.name for one in machine.contacts}
    wanted = {one.name for joint in machine.joints for one in contacts_of(joint)}
    if wanted <= there:
        return system
    return with_numbers_of(assemble(with_joint_contacts(machine)), system.values)


def refuse_modes(system: System, what: str) -> None:
    """Refuse a system with modes where nothing decides them."""
    if not has_modes(system):
        return
    L, machine = system.layout, system.mechanism
    names = [one.described for one in machine.contacts]
    names += [joint.name for joint in machine.joints if contacts_of(joint)]
    names += [system.owners[int(L.active_set[s])][0].name for s in L.friction_tangent]
    raise ModelError(
        f"{listed(dict.fromkeys(names), 4)} of '{machine.name}' may open, stick or slide, which "
        f"{what} does not decide: follow the motion by simulate with dop853, dopri5 or radau5, "
        "or leave out contacts and friction",
        names[0],
    )


# -- Corners that meet: which of the edges about them two bodies touch on ----------------------
# What is struck there `mbody.kernels.contact_rows` says. An edge keeps a corner off only where both
# edges of that corner are on its free side: the sides of boxes of one width, one upon the other, do
# not hold each other.

Array = np.ndarray

#: A corner: its body, and its place in this one.
Corner = tuple[str, float, float]


@dataclass(frozen=True)
class _EdgeEnd:
    """An end of an edge: number of the contact point, 0 where the edge begins and 1 where it ends,
    its direction, its corner, and the corner that touches the edge.
    """

    contact_point: int
    end: int
    direction: tuple[float, float]
    corner: Corner
    other: Corner


class Corners:
    """The edges that run through the same two corners, of the contact points of a system."""

    def __init__(self, candidates: Sequence[ContactCandidate], length: float) -> None:
        ends = [
            end for n, candidate in enumerate(candidates) for end in _ends(n, candidate, length)
        ]
        edge_of = {
            one.contact_point: (one.corner, two.corner)
            for one, two in zip(ends[::2], ends[1::2], strict=True)
        }
        solid = {edge for n, edge in edge_of.items() if candidates[n].solid == "polygon"}
        covered = covered_edges(set(edge_of.values()), solid)
        under = [n for n, edge in edge_of.items() if edge in covered]
        ends = [one for one in ends if edge_of[one.contact_point] not in covered]
        at: dict[Corner, list[_EdgeEnd]] = defaultdict(list)
        for one in ends:
            at[one.corner].append(one)
        # at a corner that points inwards bodies strike either edge, and it touches nothing itself
        buried = {
            corner
            for corner, about in at.items()
            if not points_outwards([(one.direction, one.end) for one in about])
        }
        meeting: dict[frozenset[Corner], list[int]] = defaultdict(list)
        for one in ends:
            pair = frozenset({one.corner, one.other})
            if not pair & buried:
                meeting[pair].append(one.contact_point)
        #: Contact points by corners that point inwards, or that an edge goes straight on over, and
        #: on edges that another shape covers.
        self.never = np.zeros(len(candidates), dtype=bool)
        self.never[[*under, *(one.contact_point for one in ends if one.other in buried)]] = True
        #: Of a contact point and an end of its edge, the contact points whose edges run through
        #: both corners.
        self.others = {
            (one.contact_point, one.end): meeting.get(frozenset({one.corner, one.other}), [])
            for one in ends
        }
        #: Contact points that may be at ends of their edges; the same edges with the corners
        #: adjacent to those of these contact points.
        self.ended, self.adjacent = _adjacent_corners(ends)


def _ends(n: int, candidate: ContactCandidate, length: float) -> list[_EdgeEnd]:
    """Both ends of the edge of a contact point where corners touch edges."""
    if candidate.edge is None or candidate.round or not np.isfinite(candidate.edge[2]):
        return []
    (x, y), (ux, uy), along = candidate.edge
    # rows of edges begin at the body of the edge
    other = corner_at(candidate.normal.j, candidate.position, length)
    return [
        _EdgeEnd(n, end, (ux, uy), corner_at(candidate.normal.i, place, length), other)
        for end, place in enumerate(((x, y), (x + along * ux, y + along * uy)))
    ]


def _adjacent_corners(ends: list[_EdgeEnd]) -> tuple[Array, Array]:
    """Of contact points by a corner and on an edge that ends, both as numbers: each, and the
    contact point on the same edge of a corner that an edge joins to that one.
    """
    edges: dict[int, list[Corner]] = defaultdict(list)
    for one in ends:
        edges[one.contact_point].append(one.corner)
    joined: dict[Corner, set[Corner]] = defaultdict(set)
    for a, b in edges.values():
        joined[a].add(b)
        joined[b].add(a)
    point_of = {(*edges[one.contact_point], one.other): one.contact_point for one in ends}
    pairs = {
        (n, point_of[a, b, adjacent])
        for (a, b, corner), n in point_of.items()
        for adjacent in joined[corner]
        if (a, b, adjacent) in point_of
    }
    found = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def corner_at(body: str, place: tuple[float, float], length: float) -> Corner:
    """A place of a body as a corner: places that differ by rounding are the same."""
    x, y = (round(float(part) / length, 12) + 0.0 for part in place)
    return body, x, y


#: An edge, free on its left: where it begins and ends.
Edge = tuple[Corner, Corner]


def covered_edges(edges: Iterable[Edge], solid: Iterable[Edge]) -> set[Edge]:
    """Those edges on whose free side a solid shape of the same body is, an edge of which runs back
    along the whole of them.
    """
    of_body: dict[str, list[Edge]] = defaultdict(list)
    for edge in solid:
        of_body[edge[0][0]].append(edge)
    numbers = {
        body: np.array([[corner[1:] for corner in edge] for edge in own])
        for body, own in of_body.items()
    }
    found = set()
    for edge in edges:
        if edge[0][0] not in numbers:
            continue
        begin, end = numbers[edge[0][0]].transpose(1, 0, 2)
        way = end - begin
        span = np.hypot(*way.T)
        a, b = np.array(edge[0][1:]), np.array(edge[1][1:])
        runs_back = way @ (b - a) < 0.0
        for place in (a - begin, b - begin):
            along, across = (
                (place * way).sum(axis=1),
                place[:, 0] * way[:, 1] - place[:, 1] * way[:, 0],
            )
            runs_back &= (np.abs(across) <= CONTACT_GAP_CLOSED * span) & (
                np.abs(along - 0.5 * span**2) <= (0.5 * span + CONTACT_GAP_CLOSED) * span
            )
        if runs_back.any():
            found.add(edge)
    return found


def points_outwards(about: Sequence[tuple[tuple[float, float], int]]) -> bool:
    """Whether the edges at a corner, free on their left, turn to the right there; of each its
    direction, and 0 where it begins there, 1 where it ends.
    """
    for (ax, ay), one in about:
        for (bx, by), two in about:
            if one == 1 and two == 0:
                cross = ax * by - ay * bx
                if cross > DIRECTION_SAME or (cross > -DIRECTION_SAME and ax * bx + ay * by > 0.0):
                    return False
    return True


#: Directions of sliding by mode.
SLIP_SIGNS = {"slip+": 1.0, "slip-": -1.0}


@dataclass(frozen=True, eq=False)
class ContactPoint:
    """A place where two bodies may touch, with its rows.

    `name`: Of the contact or rope.
    `normal`, `tangent`: Numbers of its rows among those of the active set; tangent −1 of a rope.
    `pair`: Its number among the friction pairs; −1 of a rope.
    `law`: Of impacts.
    """

    name: str
    candidate: ContactCandidate
    normal: int
    tangent: int
    pair: int
    friction: float
    static: float
    restitution: float
    law: str


@dataclass(frozen=True, eq=False)
class JointPair:
    """The sliding pair of a joint.

    `name`: Of the joint.
    `tangent`, `pair`: Its row among those of the active set, its number among the friction pairs.
    """

    name: str
    tangent: int
    pair: int


@dataclass(frozen=True, eq=False)
class Rows:
    """Values of the rows of the active set, as their physics gave them, at one position.

    `value`, `rate`, `gamma` (active set,): Φ, Φ_q v − ν, and what −Φ̈ has without accelerations.
    `block` (active set, coordinates): Φ_q.
    `ends` (points, 2): How far along its edge each contact point is, and how far from its end;
      infinite of what has no ends.
    """

    value: Array
    rate: Array
    gamma: Array
    block: Array
    ends: Array


def unilateral_of(system: System) -> Unilateral:
    """All of them of a system, made once."""
    if "unilateral" not in system.derived:
        system.derived["unilateral"] = Unilateral(system)
    return cast(Unilateral, system.derived["unilateral"])


class Unilateral:
    """All of them of one system."""

    def __init__(self, system: System) -> None:
        self.system = system
        L = self.layout = system.runtime()
        at = system.numbers
        number = {(one.name, part): e for e, (one, part) in enumerate(system.owners)}
        pair_of = {int(s): f for f, s in enumerate(L.friction_tangent)}
        place = {int(e): s for s, e in enumerate(L.active_set)}
        self.contact_points: list[ContactPoint] = []
        tangent_pairs: set[int] = set()
        welds = {frozenset(j.bodies): j.name for j in system.mechanism.joints if type(j) is Fixed}
        for contact in system.mechanism.contacts:
            if contact.closed:
                continue
            if frozenset(contact.bodies) in welds:
                i, j = contact.bodies
                raise ModelError(
                    f"contact '{contact.name}' is between '{i}' and '{j}', which joint "
                    f"'{welds[frozenset(contact.bodies)]}' ties to each other: leave out one of "
                    "them",
                    contact.name,
                )
            candidates, mu = contact.candidates(at), contact.coefficients(at)
            for n, candidate in enumerate(candidates):
                normal = place[number[contact.name, n]]
                tangent = place.get(number.get((contact.name, len(candidates) + n), -1), -1)
                tangent_pairs.add(pair := pair_of.get(tangent, -1))
                law = getattr(contact, "law", "poisson")
                # limits of a joint with friction have none of their own
                own = mu if tangent >= 0 else (0.0, 0.0)
                numbers = (float(own[0]), float(own[1]), float(contact.restitution_of(at)))
                self.contact_points.append(
                    ContactPoint(contact.name, candidate, normal, tangent, pair, *numbers, law)
                )
        self.friction_joints = [
            JointPair(system.owners[int(L.active_set[s])][0].name, int(s), f)
            for f, s in enumerate(L.friction_tangent)
            if f not in tangent_pairs and may_stick(system, f)
        ]
        #: Which friction pairs are those of contact points.
        self.of_contacts = np.isin(np.arange(len(L.friction_tangent)), list(tangent_pairs))
        units = [system.row_kinds[int(e)] for e in L.active_set]
        #: Of every row of the active set, whether it is an angle.
        self.angular = np.array([kinds == "a" for kinds in units], dtype=bool)
        #: By what values of rows are multiplied: gaps are lengths, those of angles by the model
        #: length, as are all approaches.
        self.units = np.ones(len(L.active_set))
        normals = [point.normal for point in self.contact_points]
        self.units[normals] = np.where(self.angular[normals], system.length, 1.0)

    def __len__(self) -> int:
        return len(self.layout.active_set)

    def unit_of(self, n: int) -> float:
        """By what the gap of contact point n is multiplied."""
        return float(self.units[self.contact_points[n].normal])

    @functools.cached_property
    def table(self) -> UnilateralLayout:
        """The contact points as the kernels take them."""
        points, corners = self.contact_points, self.corners
        count = len(points)

        def ints(values: Any) -> Array:
            return np.array(list(values), dtype=np.int64)

        adjacent = [corners.adjacent[corners.ended == k] for k in range(count)]
        meet = [corners.others.get((k, end), []) for k in range(count) for end in (0, 1)]
        edge_point, edge_bodies, edge = self._edges
        arc_point, arc_bodies, arc = self._arcs
        curves = [
            (n, one.candidate.contour)
            for n, one in enumerate(points)
            if one.candidate.contour is not None and one.candidate.ends
        ]
        return UnilateralLayout(
            normal=ints(one.normal for one in points),
            tangent=ints(one.tangent for one in points),
            pair=ints(one.pair for one in points),
            friction=np.array([one.friction for one in points], dtype=float),
            static=np.array([one.static for one in points], dtype=float),
            joint_tangent=ints(one.tangent for one in self.friction_joints),
            joint_pair=ints(one.pair for one in self.friction_joints),
            speed_unit=np.where(self.angular, self.system.length, 1.0),
            uneven=self.unevenness,
            gap_sign=np.array([one.candidate.sign for one in points], dtype=float),
            one_way=ints(self.one_way),
            circles=ints(one.tangent >= 0 and one.candidate.solid == "circle" for one in points),
            row_unit=self.units,
            bodies=self.every_body,
            edge_point=edge_point,
            edge_bodies=edge_bodies,
            edge=edge,
            arc_point=arc_point,
            arc_bodies=arc_bodies,
            arc=arc,
            curve_point=ints(n for n, _ in curves),
            curve_end=np.array([one.length for _, one in curves], dtype=float),
            never=corners.never.astype(np.int64),
            adjacent_start=ints(np.cumsum([0, *map(len, adjacent)])),
            adjacent=ints(n for one in adjacent for n in one),
            meet_start=ints(np.cumsum([0, *map(len, meet)])),
            meet=ints(n for one in meet for n in one),
            has_ends=ints(one.candidate.ends for one in points),
        )

    # -- active set ----------------------------------------------------------------------------

    def set_rows(self, work: Work, on: Array, slip_signs: Array) -> None:
        """Switch rows (active set,) of a workspace on or off, and set the directions of sliding
        (pairs,).
        """
        node = 2 * self.layout.primitive_node[self.layout.active_set]
        weight = np.where(self.angular, 1.0 / self.system.length**2, 1.0)
        work.on[: len(on), 0] = on
        work.pad[node, 0] = 1.0 - on
        work.regularization_weight[node, 0] = on * weight
        if len(slip_signs):
            work.slip_sign[: len(slip_signs), 0] = slip_signs

    def read(self, work: Work) -> Rows:
        """The rows at the position, velocity and time in a workspace, the signals being set."""
        count, numbers = len(self), np.empty((3, len(self)))
        block, ends = (
            np.empty((count, self.system.coordinates)),
            np.empty((len(self.contact_points), 2)),
        )
        read_rows(self.layout, work, self.table, numbers, block, ends)
        value, rate, gamma = numbers
        return Rows(value, rate, gamma, block, ends)

    @functools.cached_property
    def _normals(self) -> tuple[Array, Array]:
        """Rows of the normals of the contact points, and the signs of their gaps."""
        rows = np.array([point.normal for point in self.contact_points], dtype=np.int64)
        return rows, np.array([point.candidate.sign for point in self.contact_points])

    def gaps(self, rows: Rows) -> Array:
        """Gaps (…, points)."""
        normals, gap_signs = self._normals
        return np.where(self.one_way, 0.0, gap_signs * rows.value[..., normals])

    @functools.cached_property
    def one_way(self) -> Array:
        """Which contact points are freewheels: always closed, until they move ahead."""
        return np.array(
            [point.candidate.solid == "one way" for point in self.contact_points], dtype=bool
        )

    def pulls(self, rows: Rows, number: int, a: Array) -> Array:
        """Terms of the acceleration of a gap at accelerations a (coordinates and more,)."""
        point, n = self.contact_points[number], rows.block.shape[1]
        parts = np.append(rows.block[point.normal] * a[:n], -rows.gamma[point.normal])
        return np.asarray(point.candidate.sign * parts)

    def approach(self, rows: Rows) -> Array:
        """Rates of the gaps (…, points)."""
        normals, gap_signs = self._normals
        return np.asarray(gap_signs * rows.rate[..., normals])

    @functools.cached_property
    def _edges(self) -> tuple[Array, Array, Array]:
        """The rows of `edge_rows`: numbers, bodies (edges, 2), and the rest (edges, 7)."""
        table = np.array(edge_rows(self.candidates, self.bodies), dtype=float).reshape(-1, 10)
        return table[:, 0].astype(int), table[:, 1:3].astype(int), table[:, 3:]

    @functools.cached_property
    def _arcs(self) -> tuple[Array, Array, Array]:
        """The rows of `arc_rows`: numbers, bodies (arcs, 3), and the rest (arcs, 9)."""
        table = np.array(arc_rows(self.candidates, self.bodies), dtype=float).reshape(-1, 13)
        return table[:, 0].astype(int), table[:, 1:4].astype(int), table[:, 4:]

    @property
    def candidates(self) -> list[ContactCandidate]:
        """Where the contact points are."""
        return [one.candidate for one in self.contact_points]

    @functools.cached_property
    def corners(self) -> Corners:
        """Which edges run through the same corners."""
        return Corners(self.candidates, self.system.length)

    def within_edges(
        self, rows: Rows, work: Work, gap_tolerance: float, velocity_tolerance: float | Array
    ) -> Array:
        """Which contact points are within the ends of their edges, (points,): of those at a corner
        that approach not those that another edge there keeps apart.
        """
        count = len(self.contact_points)
        slow = np.empty(count)
        slow[:] = np.broadcast_to(velocity_tolerance, np.shape(velocity_tolerance) or count)[:count]
        within = np.zeros(count, dtype=np.int64)
        points_within(self.layout, work, self.table, rows.ends, gap_tolerance, slow, within)
        return within.astype(bool)

    @functools.cached_property
    def bodies(self) -> list[tuple[int, int]]:
        """The two bodies of the rows of every contact point."""
        L = self.layout
        primitives = [int(L.active_set[t.normal]) for t in self.contact_points]
        return [(int(L.primitive_i[e]), int(L.primitive_j[e])) for e in primitives]

    @functools.cached_property
    def every_body(self) -> Array:
        """Both bodies of every contact point and, after these, of every frictional joint."""
        L = self.layout
        joints = [int(L.active_set[one.tangent]) for one in self.friction_joints]
        pairs = [*self.bodies, *((int(L.primitive_i[e]), int(L.primitive_j[e])) for e in joints)]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def greatest_of(self, own: Array) -> Array:
        """The greater of a size (bodies,) of both bodies of each, that of the ground zero."""
        return np.asarray(np.append(own, 0.0)[self.every_body].max(axis=1))

    @functools.cached_property
    def arms(self) -> Array:
        """By what forces are multiplied to be of the kind of each: 1, of pins their radius, of
        other angles the model length.
        """
        L, par = self.layout, self.system.par
        found = np.ones(len(self.contact_points))
        own = []
        for one in self.friction_joints:
            radius = float(par[int(L.friction_par[one.pair]) + 4, 0])
            pin = FRICTION_KINDS[int(L.friction_kind[one.pair])] == "pin" and radius > 0.0
            own.append(radius if pin else self.system.length if self.angular[one.tangent] else 1.0)
        return np.concatenate([found, own])

    @functools.cached_property
    def parts(self) -> Array:
        """The first body of what is joined to each body or may touch it, the ground apart."""
        L, part = self.layout, np.arange(self.layout.bodies)
        for i, j in zip(L.primitive_i, L.primitive_j, strict=True):
            if max(i, j) < L.bodies and part[i] != part[j]:
                part[part == max(part[i], part[j])] = min(part[i], part[j])
        return part

    @functools.cached_property
    def unevenness(self) -> Array:
        """By how much the greatest mass of what is joined to each body or may touch it exceeds the
        least one.
        """
        mass = self.system.mass[: 3 * self.layout.bodies : 3, 0]
        greatest, least = np.zeros(len(mass)), np.full(len(mass), np.inf)
        np.maximum.at(greatest, self.parts, mass)
        np.minimum.at(least, self.parts, np.where(mass > 0.0, mass, np.inf))
        return np.asarray((greatest / least)[self.parts])

    @functools.cached_property
    def phase_rows(self) -> list[int]:
        """Parameters of the phases of the rows along contact points of two circles."""
        L = self.layout
        circles = [
            t for t in self.contact_points if t.tangent >= 0 and t.candidate.solid == "circle"
        ]
        return [int(L.primitive_par[int(L.active_set[t.tangent])]) + 6 for t in circles]

    # -- forces -------------------------------------------------------------------------------

    def multiplier(self, records: Array, row: int) -> Any:
        """λ of a row of the active set, of records (rows,) or (instants, rows)."""
        e = int(self.layout.active_set[row])
        return records[..., 3 * self.system.coordinates + PER_PRIMITIVE * e]

    def pressing(self, records: Array, point: ContactPoint) -> Any:
        """λ_N ≥ 0 of a contact point."""
        return -point.candidate.sign * self.multiplier(records, point.normal)

    def separates_wheels(self, f: int) -> bool:
        """Whether pair f is of teeth that press their wheels apart."""
        return FRICTION_KINDS[int(self.layout.friction_kind[f])] == "apart"


# -- Edges and arcs that end, of numbers of any kind -------------------------------------------


def edge_rows(
    candidates: Sequence[ContactCandidate], bodies: Sequence[tuple[int, int]]
) -> list[tuple[Any, ...]]:
    """Of the contact points on edges with ends: number; both bodies; beginning, direction, length
    and position.
    """
    return [
        (n, *bodies[n], *edge[0], *edge[1], edge[2], *candidate.position)
        for n, candidate in enumerate(candidates)
        if (edge := candidate.edge) is not None and np.isfinite(edge[2])
    ]


def arc_rows(
    candidates: Sequence[ContactCandidate], bodies: Sequence[tuple[int, int]]
) -> list[tuple[Any, ...]]:
    """Of the arcs of the contact points: their contact point; bodies of its rows and the one that
    they are on; both body-fixed positions, what to add to the direction from one to the other, that
    direction where an edge gives it, begin, half of the extent and radius.
    """
    found = []
    for n, candidate in enumerate(candidates):
        for arc in candidate.arcs:
            positions, edge = candidate.normal.parameters[:4], candidate.edge
            # a circle touches an edge against the normal of this one
            fixed = np.arctan2(-edge[1][0], edge[1][1]) if edge else math.nan
            flip = math.pi if arc.ahead == -1.0 else 0.0
            own = bodies[n][int(arc.second)]
            numbers = (*positions, flip, fixed, arc.begin, 0.5 * arc.extent, arc.radius)
            found.append((n, *bodies[n], own, *numbers))
    return found


# -- Overlapping shapes ------------------------------------------------------------------------


@dataclass(frozen=True)
class Overlap:
    """Two shapes that overlap.

    `contact`: Its name.
    `contact_point`: Number of the contact point that is nearest to being open.
    `depth`: In the unit of its row.
    """

    contact: str
    contact_point: int
    depth: float


def deepest_overlap(
    uni: Unilateral, rows: Rows, work: Work, gap_tolerance: float
) -> Overlap | None:
    """The contact that overlaps most at the position in a workspace, by more than
    `gap_tolerance`; None where none does.
    """
    gaps, along = uni.gaps(rows), rows.ends.min(axis=1, initial=np.inf)
    worst: dict[str, tuple[float, int]] = {}
    edges: dict[tuple[str, str, tuple[float, ...], float], list[int]] = {}
    for n, (point, gap) in enumerate(zip(uni.contact_points, gaps, strict=True)):
        candidate = point.candidate
        if candidate.solid == "polygon" and not candidate.arcs:
            position = tuple(float(part) for part in candidate.position)
            key = point.name, str(candidate.swapped), position, float(candidate.edge_radius)
            edges.setdefault(key, []).append(n)
        elif gap >= -gap_tolerance:
            continue
        elif candidate.solid == "segment" or candidate.arcs:
            # from behind a thin wall, or an arc, nothing overlaps it but a disc
            if along[n] >= 0.0 and gap > -2.0 * float(candidate.edge_radius):
                worst.setdefault(point.name, (float(gap), n))
        else:
            worst[point.name] = min(worst.get(point.name, (0.0, n)), (float(gap), n))
    whole = rows.ends
    for (name, _, _, radius), about in edges.items():
        gap, n = _to_polygon(gaps[about] + radius, whole[about])
        if gap - radius < -gap_tolerance:
            worst[name] = min(worst.get(name, (0.0, 0)), (gap - radius, about[n]))
    if not worst:
        return None
    name = min(worst, key=lambda one: worst[one][0])
    gap, n = worst[name]
    return Overlap(name, n, -gap / uni.unit_of(n))


def _to_polygon(across: Array, along: Array) -> tuple[float, int]:
    """The distance of a point from a polygon, negative within, and the number of the nearest edge;
    of every edge the distance `across` its line (edges,), positive outside, and those `along` it
    from both ends (edges, 2). The polygon may bend inwards.
    """
    past = np.maximum(-along.min(axis=1), 0.0)
    distances = np.hypot(across, past)
    least = distances.min()
    # nearest to a corner both edges there are as near: the one that is seen more squarely decides
    nearest = np.flatnonzero(distances <= least + DISTANCE_TIE * distances.max())
    n = int(nearest[np.argmax(np.abs(across[nearest]))])
    return float(np.copysign(least, across[n])), n
