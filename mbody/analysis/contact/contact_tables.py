"""Shapes, laws and groups of a mechanism as the kernels of steps with impulses take them."""

from __future__ import annotations

import itertools
import math
import threading
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import (
    Corner,
    Edge,
    corner_at,
    covered_edges,
    points_outwards,
)
from mbody.core.tolerances import DIRECTION_SAME
from mbody.errors import ModelError
from mbody.kernels import mode_problem as kernels
from mbody.kernels.complementarity import (
    CONE,
    ContactProblem,
    joint_arms,
    law_sizes,
    problem_memory,
)
from mbody.kernels.contact_geometry import (
    ALONE,
    CIRCLE,
    INNER,
    LINE,
    POLYGON,
    SEGMENT,
    SHARED,
    ContactShapes,
)
from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.layout import (
    OF_NODES,
    Layout,
    Work,
    first_beyond,
    frame_of,
    integers,
    inverse_masses,
)
from mbody.kernels.mode_problem import ContactDecision, solve_decision
from mbody.model.contact import (
    Between,
    Contact,
    Rope,
    body_fixed,
    circle_of,
    edge_of_side,
    shape_names,
)
from mbody.model.joints.fixed import Fixed
from mbody.model.mechanism import Mechanism
from mbody.model.touching_shapes import (
    CurveShape,
    Disc,
    Line,
    Ring,
    Segment,
    Shape,
    Vertex,
    points_of,
)
from mbody.system.assembler import eliminate, split
from mbody.system.system import System, welds

# -- Friction of joints by what presses them, and impulses of closed contacts by their matrix,
#    which `mbody.kernels.mode_problem` finds --------------------------------------------------

Array = np.ndarray


class _ProblemMemory(threading.local):
    """Memory of the kernel of every size, one for each thread."""

    def __init__(self) -> None:
        self.problems: dict[int, tuple[ContactDecision, ContactProblem]] = {}

    def of(self, n: int) -> tuple[ContactDecision, ContactProblem]:
        if n not in self.problems:
            self.problems[n] = kernels.decision_memory(n), problem_memory(n)
        return self.problems[n]


_memory = _ProblemMemory()


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


# -- Impulses of closed contacts -----------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ClosedContacts:
    """Closed contacts at one instant.

    `delassus` (2 m, 2 m): Normals before tangents.
    `friction` (m,): Coefficients; zero of what has no tangent.
    """

    delassus: Array
    friction: Array

    def __len__(self) -> int:
        return len(self.friction)

    @property
    def rows(self) -> Array:
        """Normals and those tangents that have friction."""
        m = len(self)
        return np.concatenate([np.arange(m), m + np.flatnonzero(self.friction > 0.0)])

    def loaded(self) -> tuple[ContactDecision, ContactProblem]:
        """The memory of the kernels with the rows, at rest."""
        m, rows = len(self), self.rows
        D, P = _memory.of(len(rows))
        D.count[:2] = len(rows), m
        D.delassus[:] = self.delassus[np.ix_(rows, rows)]
        for array in (D.noise, D.soft, D.sliding, D.given, D.kinetic, D.given_law, D.outcomes):
            array[:] = 0
        D.law[:], D.normal[m:], D.mu[m:] = CONE, rows[m:] - m, self.friction[rows[m:] - m]
        return D, P

    def solve(self, before: Array, given: Array) -> Array | None:
        """(Λ_N, Λ_T) (2 m,) from velocities `before` (2 m,) without them, with normal impulses
        `given` (m,) that count in the cones; None where there are none.
        """
        D, P = self.loaded()
        D.shifted[:], D.given_law[: len(self)] = before[self.rows], given
        if not solve_decision(D, P, kernels.STAGE, 0):
            return None
        found = np.zeros(2 * len(self))
        found[self.rows] = D.f
        return found


def arresting_impulses(D: Array, rates: Array) -> Array:
    """Impulses −D⁺ rates that stop rows; of least scaled norm where rows depend on each other."""
    n, found = len(D), np.zeros(len(D))
    memory, _ = _memory.of(n)
    memory.count[0], memory.delassus[:] = n, D
    kernels.find_arrest(memory, np.ascontiguousarray(rates), found)
    return found


# -- Layouts and workspaces of what acts: without the fill, or the nodes, of rows that are off -
#
# Rows of contacts that are open are rows of an identity: they have no blocks beside the diagonal,
# and elimination works on zeros there. Of many contact candidates where bodies may touch few do,
# and most of the work is on zeros. The lists of `mbody.kernels.schur_ldl` without them give the
# same numbers. Bodies that are split for rows that are off alone need no slots for these.


def without_nodes(layout: Layout, off: Array) -> Layout:
    """The layout whose elimination leaves some nodes alone. `off` (nodes,)."""
    if not off.any():
        return layout
    L, base = layout, 3 * layout.nodes
    count = np.diff(L.node_start)
    column = np.repeat(np.arange(L.nodes), count)
    kept = ~(off[column] | off[L.block_row])
    blocks = np.flatnonzero(kept)
    # the number of a block among those that are kept, by its number among all
    number = np.cumsum(kept) - 1
    start = np.append(0, np.cumsum(np.bincount(column[blocks], minlength=L.nodes)))
    # a block of a column updates those of the rows of each that stands before it
    first = np.arange(len(kept)) - L.node_start[column]
    updates = np.cumsum(first) - first
    before = np.arange(len(blocks)) - start[column[blocks]]
    later = np.repeat(np.arange(len(blocks)), before)
    earlier = np.arange(len(later)) - np.repeat(np.cumsum(before) - before, before)
    earlier += start[column[blocks[later]]]
    pairs = updates[blocks[later]] + blocks[earlier] - L.node_start[column[blocks[later]]]
    formed = kept[(L.form_block - base) // 4]
    filled = kept[(L.fill - base) // 4]

    def moved(places: Array) -> Array:
        return integers(base + 4 * number[(places - base) // 4])

    return layout.replaced(
        node_start=integers(start),
        block_row=integers(L.block_row[blocks]),
        update=moved(L.update[pairs]),
        form_block=moved(L.form_block[formed]),
        form_a=integers(L.form_a[formed]),
        form_b=integers(L.form_b[formed]),
        form_column=integers(L.form_column[formed]),
        form_more=integers(L.form_more[formed]),
        fill=moved(L.fill[filled]),
    )


def layout_of_rows(layout: Layout, off: Array) -> Layout:
    """The layout without some rows of the active set, with nodes and slots of its own. `off`
    (primitives,): those, which share one node that holds nothing.
    """
    L, kept = layout, np.flatnonzero(~off)
    ends = zip(L.primitive_i[kept].tolist(), L.primitive_j[kept].tolist(), strict=True)
    slots = split(L.bodies, [*ends, (L.bodies, L.bodies)])
    plan, nodes = eliminate(slots), len(slots.sides)
    place = np.empty(nodes, dtype=np.int64)
    place[plan.order] = np.arange(nodes)
    nothing = place[len(kept)]
    node = np.full(len(off), nothing)
    node[kept] = place[: len(kept)]
    written = node.copy()
    written[L.active_set] = first_beyond(nodes, 0) + np.arange(len(L.active_set))
    # by the nodes that they have in the whole
    now = np.full(L.nodes, nothing)
    now[L.primitive_node] = node
    names = ("node_start", "block_row", "update", "form_block", "form_a", "form_b", "form_column")
    return layout.replaced(
        slots=len(slots.body),
        nodes=nodes,
        primitive_node=node,
        written_node=written,
        friction_node=now[L.friction_node],
        driver_node=now[L.driver_node],
        node_column=integers([3 * s for n in plan.order for s in slots.sides[n]]),
        **{name: getattr(plan, name) for name in names},
        form_more=integers(plan.form_more),
        fill=plan.fill,
        slot_body=integers(slots.body),
        body_slot=np.searchsorted(slots.body, np.arange(L.bodies)),
    )


def work_of_rows(system: System, layout: Layout, whole: Work, off: np.ndarray) -> Work:
    """The workspace of one set for `layout_of_rows`, of a layout whose workspace is `whole`: they
    have all in common that belongs to no node.
    """
    L = layout
    frame = frame_of(L, system.par.shape[0], system.signals, 1)
    work = Work(frame, frame.blank())
    before, now = system.layout.primitive_node, L.primitive_node
    for row in range(2):
        work.pad[2 * now + row] = 1.0
        kept, old = 2 * now[~off] + row, 2 * before[~off] + row
        work.pad[kept] = whole.pad[old]
        work.regularization_weight[kept] = whole.regularization_weight[old]
    work.block[: 12 * L.nodes] = welds(L, work.pad)
    work.share[: L.slots] = 1.0 / np.bincount(L.slot_body, minlength=L.bodies)[L.slot_body][:, None]
    work.weight[: 3 * L.slots] = inverse_masses(L, whole.mass, system.sizes)
    work.take(whole, OF_NODES)
    return work


#: A shape is large that is so much larger than is usual.
LARGE = 3.0
#: Corners of a polygon, at most.
MOST_CORNERS = 2000


@dataclass(frozen=True, eq=False)
class ContactTables:
    """The tables, and what their numbers mean.

    `laws`: Names of the contacts, ropes and groups, by the number of their law.
    `names`: Dotted names of the shapes, by number.
    """

    shapes: ContactShapes
    laws: tuple[str, ...]
    names: tuple[str, ...]


def coupled_bodies(machine: Mechanism) -> set[str]:
    """The moving bodies on which joints, couplings or drivers act."""
    acting = (*machine.joints, *machine.couplings, *machine.drivers)
    return {body for one in acting for body in one.bodies} - {"ground"}


def contact_tables(system: System) -> ContactTables:
    """The tables of a system with its groups."""
    machine, at = system.mechanism, system.numbers
    contacts: list[Any] = list(machine.contacts)
    groups = list(machine.groups)
    laws = [one.name for one in (*contacts, *groups)]
    numbers = [(*one.coefficients(at), one.restitution_of(at)) for one in (*contacts, *groups)]
    known = shape_names((*machine.bodies, machine.ground))
    sides = [one.sides(known) for one in groups]
    pairs = [(one.i, one.j) for one in contacts if isinstance(one, Contact)]
    grouped = itertools.chain.from_iterable(one for both in sides for one in both)
    names = tuple(dict.fromkeys([*itertools.chain(*pairs), *grouped]))
    number = {name: n for n, name in enumerate(names)}
    found = [_Outline(machine, at, name) for name in names]
    bounding_radius = np.array([one.bounding_radius for one in found])
    finite = bounding_radius[np.isfinite(bounding_radius) & (bounding_radius > 0.0)]
    usual = float(np.median(finite)) if finite.size else system.length
    large = [
        not one.bounding_radius <= LARGE * usual or one.kind == LINE or one.radius < 0.0
        for one in found
    ]
    group, table = _sets(groups, sides, names, len(contacts))
    ropes = [(n, one) for n, one in enumerate(contacts) if isinstance(one, Rope)]
    index = system.bodies
    tied = _ties(machine, index)
    shapes = ContactShapes(
        kind=integers([one.kind for one in found]),
        body=integers([index[one.body] for one in found]),
        edge_start=integers(np.cumsum([0, *(len(one.edges) for one in found)])),
        edge=np.vstack([*(one.edges for one in found), np.zeros(5)]),
        **_corners_beside(found, _welded(machine, at), system.length),
        centre=_rows([one.centre for one in found], 2),
        bounding_radius=bounding_radius,
        radius=np.array([one.radius for one in found]),
        large=integers(large),
        usual=np.array([usual]),
        group=integers(group),
        group_law=table,
        pair=_integer_table(
            [
                (number[one.i], number[one.j], n)
                for n, one in enumerate(contacts)
                if isinstance(one, Contact)
            ],
            3,
        ),
        rope=_integer_table([(*(index[b] for b in one.bodies), n) for n, one in ropes], 3),
        rope_number=_rows(
            [(*at.arm(one, "i"), *at.arm(one, "j"), at[f"{one.name}.length"]) for _, one in ropes],
            5,
        ),
        law=_rows(numbers, 3),
        tied_start=integers(np.concatenate([[0], np.cumsum([len(one) for one in tied])])),
        tied=integers([*itertools.chain(*tied), -1]),
    )
    return ContactTables(shapes, tuple(laws), names)


def _rows(rows: Any, width: int) -> Array:
    return np.array(rows, dtype=float).reshape(-1, width)


def _integer_table(rows: Any, width: int) -> Array:
    return np.array(rows, dtype=np.int64).reshape(-1, width)


def _ties(machine: Mechanism, index: dict[str, int]) -> list[list[int]]:
    """The bodies that joints tie to each, the ground last."""
    found: list[set[int]] = [set() for _ in index]
    for joint in machine.joints:
        for one, other in itertools.permutations(set(joint.bodies), 2):
            found[index[one]].add(index[other])
    return [sorted(one) for one in found]


#: Where a body is in the axes of the first of those it is welded to: this one, angle and place.
Welded = tuple[str, float, tuple[float, float]]


def _welded(machine: Mechanism, at: Any) -> dict[str, Welded]:
    """Of every body with shapes where it is among those that it is welded to, the ground apart."""
    found: dict[str, Welded] = {}
    beside: dict[str, list[tuple[str, float, Any, Any]]] = defaultdict(list)
    for joint in machine.joints:
        if isinstance(joint, Fixed):
            turn = at.angle(joint, "i") - at.angle(joint, "j")
            i, j = at.arm(joint, "i"), at.arm(joint, "j")
            beside[joint.i.body].append((joint.j.body, turn, i, j))
            beside[joint.j.body].append((joint.i.body, -turn, j, i))
    for first in ("ground", *(body.name for body in machine.bodies)):
        if first in found:
            continue
        found[first], reached = (first, 0.0, (0.0, 0.0)), [first]
        for body in reached:
            for other, turn, near, far in beside[body]:
                if other not in found:
                    _, angle, place = found[body]
                    x, y = turned(angle, *near), turned(angle + turn, *far)
                    there = place[0] + x[0] - y[0], place[1] + x[1] - y[1]
                    found[other] = first, angle + turn, there
                    reached.append(other)
    return found


def turned(angle: float, x: float, y: float) -> tuple[float, float]:
    """A direction, turned."""
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y


def _sets(
    groups: list[Between],
    sides: list[tuple[list[str], list[str]]],
    names: Iterable[str],
    first: int,
) -> tuple[list[int], Array]:
    """Of every shape the number of the set of groups that it is in, −1 of none; the law between
    such sets.
    """
    member: dict[str, set[tuple[int, int]]] = {}
    for n, both in enumerate(sides):
        for side in range(2):
            for name in both[side]:
                member.setdefault(name, set()).add((n, side))
    kinds: dict[frozenset[tuple[int, int]], int] = {}
    found = []
    for name in names:
        own = frozenset(member.get(name, ()))
        found.append(kinds.setdefault(own, len(kinds)) if own else -1)
    table = np.full((len(kinds), len(kinds)), -1, dtype=np.int64)
    for (ours, p), (theirs, q) in itertools.product(kinds.items(), repeat=2):
        for n, group in enumerate(groups):
            if (n, 0) in ours and (n, 1) in theirs:
                other = table[p, q] if table[p, q] >= 0 else table[q, p]
                if other >= 0 and other != first + n:
                    raise ModelError(
                        f"'{groups[other - first].name}' and '{group.name}' both bring together "
                        f"{_example(names, found, p)} and {_example(names, found, q)}: give "
                        "each pair of shapes one group",
                        group.name,
                    )
                table[p, q] = first + n
    return found, table


def _example(names: Iterable[str], sets: list[int], which: int) -> str:
    return next(f"'{name}'" for name, own in zip(names, sets, strict=True) if own == which)


class _Outline:
    """One shape in numbers, from the mass centre of its body."""

    def __init__(self, machine: Mechanism, at: Any, name: str) -> None:
        self.body, _, key = name.partition(".")
        body: Any = machine.ground if self.body == "ground" else machine[self.body]
        shape: Shape = body.shapes[key] if key in body.shapes else Vertex(key)
        self.radius, self.edges = 0.0, np.empty((0, 5))
        _refuse_bent(shape, name)
        if isinstance(shape, Vertex | Disc | Ring):
            self.centre, self.bounding_radius = circle_of(at, (name, shape))
            self.kind = CIRCLE
            self.radius = -self.bounding_radius if isinstance(shape, Ring) else self.bounding_radius
        elif isinstance(shape, Line):
            self.centre, way, length = edge_of_side(at, (name, shape), 0)
            self.kind, self.bounding_radius = LINE, math.inf
            self.edges = np.array([[*self.centre, *way, length]], dtype=float)
        else:
            self.kind = SEGMENT if isinstance(shape, Segment) else POLYGON
            points = [body_fixed(at, name, point) for point in points_of(shape)]
            corners = np.array(points, dtype=float)
            if self.kind == POLYGON:
                corners = corners[:: -1 if _area(corners) > 0.0 else 1]
                _refuse_concave(corners[::-1], name)
            self.centre = tuple(0.5 * (corners.min(axis=0) + corners.max(axis=0)))
            self.bounding_radius = float(np.hypot(*(corners - self.centre).T).max())
            way = np.roll(corners, -1, axis=0) - corners
            length = np.hypot(*way.T)[:, None]
            self.edges = np.hstack([corners, way / length, length])

    def ends(self, n: int, welded: Welded, length: float) -> Edge | None:
        """Where edge n begins and ends; None of lines and of the far side of a segment."""
        if self.kind == LINE or (self.kind == SEGMENT and n > 0):
            return None
        begin, end = (self.corner(m % len(self.edges), welded, length) for m in (n, n + 1))
        return begin, end

    def corner(self, n: int, welded: Welded, length: float) -> Corner:
        """The beginning of edge n."""
        first, angle, (x, y) = welded
        along, across = turned(angle, *self.edges[n, :2])
        return corner_at(first, (x + along, y + across), length)


def _corners_beside(
    found: list[_Outline], welded: dict[str, Welded], length: float
) -> dict[str, Array]:
    """Which edges other shapes of their body, or of what it is welded to, cover, which corners
    shapes share, and between which normals these are touched.
    """
    rows = [(one, n) for one in found for n in range(len(one.edges))]
    edges = [one.ends(n, welded[one.body], length) for one, n in rows]
    solid = [edge for edge, (one, _) in zip(edges, rows, strict=True) if one.kind == POLYGON]
    under = covered_edges(filter(None, edges), filter(None, solid))
    about: dict[Corner, list[tuple[_Outline, tuple[float, float], int]]] = defaultdict(list)
    for edge, (one, n) in zip(edges, rows, strict=True):
        way = turned(welded[one.body][1], *one.edges[n, 2:4])
        for end, corner in enumerate(edge or ()):
            about[corner].append((one, way, end if edge not in under else -1))
    joined, cone = np.full(len(rows) + 1, ALONE), np.zeros((len(rows) + 1, 4))
    for row, (one, n) in enumerate(rows):
        if one.kind == LINE:
            continue
        place = one.corner(n, welded[one.body], length)
        if len({id(other) for other, _, _ in about[place]}) < 2:
            continue
        left = [(way, end) for _, way, end in about[place] if end >= 0]
        begins, ends = ([way for way, side in left if side == end] for end in (0, 1))
        if not left or not points_outwards(left):
            joined[row] = INNER
        elif len(begins) == len(ends) == 1:
            joined[row] = SHARED
            ways = [turned(-welded[one.body][1], *way) for way in (*begins, *ends)]
            cone[row] = [part for x, y in ways for part in (-y, x)]
    covered = [edge in under for edge in edges] + [False]
    return {"covered": integers(covered), "joined": integers(joined), "cone": cone}


def _area(corners: Array) -> float:
    x, y = corners.T
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def _refuse_bent(shape: Shape, name: str) -> None:
    """Refuse a curve, and a part of a circle."""
    body, _, key = name.partition(".")
    if isinstance(shape, CurveShape):
        raise ModelError(
            f"'{body}': {key} is a curve: the method 'moreau' takes straight edges and "
            "circles; give segments along it, or follow the motion by 'dop853'",
            body,
        )
    if isinstance(shape, Disc | Ring) and shape.begin is not None:
        raise ModelError(
            f"'{body}': {key} is an arc: the method 'moreau' takes whole circles; give segments "
            "along it, or follow the motion by 'dop853'",
            body,
        )


def _refuse_concave(corners: Array, name: str) -> None:
    """Refuse a polygon that bends inwards, or has too many corners."""
    ahead = np.roll(corners, -1, axis=0) - corners
    following = np.roll(ahead, -1, axis=0)
    cross = ahead[:, 0] * following[:, 1] - ahead[:, 1] * following[:, 0]
    size = np.hypot(*ahead.T) * np.hypot(*following.T)
    body, _, key = name.partition(".")
    if len(corners) > MOST_CORNERS:
        raise ModelError(
            f"'{body}': {key} has {len(corners)} corners: give at most {MOST_CORNERS}", body
        )
    inward = np.flatnonzero(cross < -DIRECTION_SAME * size)
    whole = np.arctan2(cross, (ahead * following).sum(axis=1)).sum()
    if inward.size or whole > 3.0 * math.pi:
        raise ModelError(
            f"'{body}': {key} is a polygon that bends inwards: the method 'moreau' takes convex "
            "ones, give it as several of them",
            body,
        )
