"""The constraint assembler: a description becomes flat arrays, index lists and names.

    Mechanism ──▶ primitives ──▶ slots, nodes, elimination order ──▶ System

The symbolic phase depends on the topology alone. Numbers reach the kernels through one function of
the user's numbers (`Numbers`), for one set and for a batch alike.
"""

from __future__ import annotations

import bisect
import dataclasses
import functools
import heapq
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from mbody.core.tolerances import LENGTH_FAR, LENGTH_NONE
from mbody.errors import ModelError
from mbody.kernels.constraints import KINDS
from mbody.kernels.constraints import KINDS as PRIMITIVE_KINDS
from mbody.kernels.forces import KINDS as ACTION_KINDS
from mbody.kernels.friction import BY_RATES, FRICTION_KINDS
from mbody.kernels.layout import Layout, first_beyond, integers
from mbody.laws import LAW_KINDS, Constant, Law
from mbody.model.driver import Constraint
from mbody.model.element import AuxiliaryState, Element, Numbers, signal_of
from mbody.model.joints import Joint
from mbody.model.loads import Load
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import snapshot
from mbody.model.primitives import ConstraintPrimitive, ForcePrimitive, FrictionPrimitive, Signal
from mbody.model.touching_shapes import Polygon, Segment, points_of
from mbody.quantities import Formula
from mbody.system.system import (
    FormulaRows,
    RecordedLaw,
    System,
    driver_law,
    following,
    numbered,
    polar_points,
    recorded,
)

if TYPE_CHECKING:
    from mbody.model.states import State


# -- The symbolic phase: in which order the nodes of rows are eliminated, and what each step
#    touches -----------------------------------------------------------------------------------
# Nodes that share a slot are neighbours. Minimum degree keeps chains, trees and ladders linear. A
# body with many nodes would make all of them neighbours of each other; it is split into slots of
# few nodes, tied in a row by welds (`schur` of trees of slots stays narrow), so a hub costs as a
# chain.

#: A body with more nodes than this is split into slots that take so many each.
MOST, EACH = 6, 3


@dataclass(frozen=True)
class Slots:
    """Slots of all bodies; the one after the last belongs to the ground.

    `body`: Body of each slot.
    `sides`: Slots on which the sides of each node stand, two as a rule; welds last.
    `welds`: How many of the last nodes are welds, two for each pair of neighbouring slots.
    """

    body: list[int]
    sides: list[tuple[int, ...]]
    welds: int


def split(bodies: int, ends: Sequence[tuple[int, ...]]) -> Slots:
    """Split busy bodies into slots."""
    degree = [0] * (bodies + 1)
    for pair in ends:
        for b in pair:
            degree[b] += 1
    body: list[int] = []
    first: list[int] = []
    for b in range(bodies):
        first.append(len(body))
        body += [b] * (1 if degree[b] <= MOST else -(-degree[b] // EACH))
    ground = len(body)
    used = [0] * bodies

    def slot(b: int) -> int:
        if b == bodies:
            return ground
        if degree[b] <= MOST:
            return first[b]
        used[b] += 1
        return first[b] + (used[b] - 1) // EACH

    sides = [tuple(slot(b) for b in pair) for pair in ends]
    ties = [(s, s + 1) for s in range(ground - 1) if body[s] == body[s + 1]]
    for tie in ties:
        sides += [tie, tie]
    return Slots(body, sides, 2 * len(ties))


@dataclass(frozen=True)
class Elimination:
    """Order of elimination, and the index lists of `mbody.kernels.schur_ldl`."""

    order: list[int]
    node_start: np.ndarray
    block_row: np.ndarray
    update: np.ndarray
    form_block: np.ndarray
    form_a: np.ndarray
    form_b: np.ndarray
    form_column: np.ndarray
    form_more: np.ndarray
    fill: np.ndarray
    # sides beyond the second: their nodes, and the slots that they stand on
    more_node: np.ndarray
    more_slot: np.ndarray

    def lists(self) -> dict[str, np.ndarray]:
        """The lists by their names in `Layout`."""
        names = ["node_start", "block_row", "update", "fill"]
        names += [f"form_{key}" for key in ("block", "a", "b", "column", "more")]
        return {name: getattr(self, name) for name in names}


def eliminate(slots: Slots) -> Elimination:
    """Order the nodes by minimum degree and list what the numeric phase does.

    Nodes are renumbered: number k of the result is node ``order[k]`` of the slots.
    """
    ground, nodes = len(slots.body), len(slots.sides)
    sides = [
        (slot, node, side)
        for node, pair in enumerate(slots.sides)
        for side, slot in enumerate(pair)
        if slot < ground
    ]
    touching: list[set[int]] = [set() for _ in range(ground)]
    for slot, node, _ in sides:
        touching[slot].add(node)
    neighbours: list[set[int]] = [set() for _ in range(nodes)]
    for own in touching:
        for node in own:
            neighbours[node] |= own
    for node, own in enumerate(neighbours):
        own.discard(node)
    order, columns = _minimum_degree(neighbours)
    place = np.empty(nodes, dtype=np.int64)
    place[order] = np.arange(nodes)
    start = _starts([len(columns[node]) for node in order])
    rows = place[_integers([m for node in order for m in columns[node]])]
    column = np.repeat(np.arange(nodes), np.diff(start))
    rows = rows[np.lexsort((rows, column))]
    base = 3 * nodes
    blocks = base + 4 * np.arange(len(rows))
    # ascending, as columns are, and the rows of each
    key = column * nodes + rows

    def block_at(column: np.ndarray, row: np.ndarray) -> np.ndarray:
        return np.asarray(blocks[np.searchsorted(key, column * nodes + row)])

    later, earlier = _pairs(start)
    update = block_at(rows[earlier], rows[later])
    more = [(int(place[m]), side) for m in order for side in range(2, len(slots.sides[m]))]
    on, node_at, side_at = _integers(sides).reshape(-1, 3).T
    at = place[node_at]
    numbers = 12 * at + 6 * side_at
    if more:
        which = {pair: 12 * nodes + 6 * n for n, pair in enumerate(more)}
        for n in np.flatnonzero(side_at >= 2).tolist():
            numbers[n] = which[int(at[n]), int(side_at[n])]
    by_slot = np.lexsort((side_at, at, on))
    on, at, numbers = on[by_slot], at[by_slot], numbers[by_slot]
    later, earlier = _pairs(_starts(np.bincount(on, minlength=ground)))
    distinct = at[later] != at[earlier]
    later, earlier = later[distinct], earlier[distinct]
    formed = block_at(at[earlier], at[later])
    order_of_forms = np.lexsort((on[later], numbers[earlier], numbers[later], formed))
    later, earlier, formed = (part[order_of_forms] for part in (later, earlier, formed))
    only_filled = np.ones(len(rows), dtype=bool)
    only_filled[(formed - base) // 4] = False
    return Elimination(
        order,
        start,
        rows,
        update,
        form_block=formed,
        form_a=numbers[later],
        form_b=numbers[earlier],
        form_column=3 * on[later],
        form_more=np.diff(formed, prepend=-1) == 0,
        fill=blocks[only_filled],
        more_node=_integers([k for k, _ in more]),
        more_slot=_integers([slots.sides[order[k]][side] for k, side in more]),
    )


def _integers(values: Sequence[Any]) -> np.ndarray:
    return np.array(values, dtype=np.int64)


def _starts(sizes: Sequence[int] | np.ndarray) -> np.ndarray:
    """Beginning of each of groups of these sizes, and the end of the last."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])


def _pairs(start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of members of one group, the later member first: of groups one after the other that
    begin at `start`, by the later member, then by the earlier.
    """
    sizes, count = np.diff(start), int(start[-1])
    first = np.repeat(start[:-1], sizes)
    many = np.arange(count) - first
    later = np.repeat(np.arange(count), many)
    ends = np.cumsum(many)
    earlier = np.arange(len(later)) - (ends - many - first)[later]
    return later, earlier


def _minimum_degree(graph: list[set[int]]) -> tuple[list[int], list[set[int]]]:
    """Order of elimination, and for each node its neighbours when it is eliminated. Changes the
    graph.
    """
    # of each node a degree that it has or had, at most that of today
    queued = [len(neighbours) for neighbours in graph]
    waiting = list(zip(queued, range(len(graph)), strict=True))
    heapq.heapify(waiting)
    done = [False] * len(graph)
    # whether a node and its neighbours are known to be neighbours of each other: then nothing is
    # united, which is most of the work where many nodes stay together to the end
    closed = [False] * len(graph)
    order: list[int] = []
    columns: list[set[int]] = [set() for _ in graph]
    while waiting:
        degree, node = heapq.heappop(waiting)
        if done[node] or degree != queued[node]:
            continue
        if degree != len(graph[node]):
            queued[node] = len(graph[node])
            heapq.heappush(waiting, (queued[node], node))
            continue
        done[node] = True
        order.append(node)
        own = columns[node] = graph[node]
        known = closed[node]
        for other in own:
            adjacent = graph[other]
            if not known:
                adjacent |= own
                adjacent.discard(other)
            adjacent.discard(node)
            size = len(adjacent)
            closed[other] = size == degree - 1 or (known and closed[other])
            if size < queued[other]:
                queued[other] = size
                heapq.heappush(waiting, (size, other))
    return order, columns


# -- Blocks of Φ_q of rows over more than two bodies: sums, and formulas -----------------------


def blocks_of(
    primitives: Sequence[ConstraintPrimitive],
    place: Mapping[int, int],
    written: Sequence[int],
    plan: Elimination,
) -> list[dict[str, int]]:
    """Of every primitive where its physics writes the blocks of its bodies; −1 of the ground.
    place: node of every primitive in the order of elimination; written: the node that its physics
    writes, another one of the active set.
    """
    nodes = len(plan.order)
    active_set = [e for e, primitive in enumerate(primitives) if primitive.active_set]
    further_begin = 12 * (first_beyond(nodes, len(plan.more_node)) + len(active_set))
    further: dict[int, list[int]] = {}
    for n, k in enumerate(plan.more_node):
        further.setdefault(int(k), []).append(6 * n)
    found = []
    for e, primitive in enumerate(primitives):
        k, first = written[e], further_begin if primitive.active_set else 12 * nodes
        at = [12 * k, 12 * k + 6, *(first + n for n in further.get(place[e], []))]
        found.append(dict(zip(primitive.bodies, at, strict=True)) | {"ground": -1})
    return found


def sums_of(
    primitives: Sequence[ConstraintPrimitive],
    index: Mapping[str, int],
    blocks: Sequence[Mapping[str, int]],
) -> dict[str, Any]:
    """The parts of all sums, and the places of the blocks of their bodies; index: number of every
    body.
    """
    start, table = [0], []
    for block, primitive in zip(blocks, primitives, strict=True):
        table += [
            (KINDS.index(part.kind), index[part.i], index[part.j], block[part.i], block[part.j])
            for part in primitive.parts
        ]
        start.append(len(table))
    parts = np.array(table, dtype=np.int64).reshape(-1, 5)
    return {"sum_start": integers(start), "part": parts}


# -- Columns of numbers: of one description a number a row, of a batch of designs an array -----


def designs_of(numbers: Mapping[str, Any]) -> int:
    """Number of designs in numbers by name, floats or arrays (designs,).

    >>> designs_of({"a": 1.0, "b": np.zeros(3)})
    3
    """
    arrays = [value for value in numbers.values() if type(value) is not float]
    return max((np.size(value) for value in arrays if np.ndim(value)), default=1)


def stacked(rows: list[Any], designs: int) -> np.ndarray:
    """Numbers and arrays (designs,) as rows of one array (rows, designs)."""
    if designs == 1 and all(isinstance(row, float) for row in rows):
        return np.array(rows, dtype=np.float64).reshape(-1, 1)
    found = np.empty((len(rows), designs))
    for n, row in enumerate(rows):
        found[n] = row
    return found


# -- Rows of the friction pairs ----------------------------------------------------------------


def friction_table(
    pairs: Sequence[tuple[Constraint, FrictionPrimitive]],
    owners: Sequence[tuple[Element, int]],
    place: Mapping[int, int],
    active_set: Sequence[int],
) -> dict[str, Any]:
    """Columns of the layout, a line a friction pair, in the order of the description."""
    number = {(one.name, part): e for e, (one, part) in enumerate(owners)}
    rows = Counter(one.name for one, _ in owners)
    left = Counter(element.name for element, _ in pairs)
    tangents = []
    for element, _ in pairs:
        part = rows[element.name] - left[element.name]
        tangents.append(active_set.index(number[element.name, part]))
        left[element.name] -= 1
    pressing = [place[number[element.name, pair.presses]] for element, pair in pairs]
    return {
        "friction_kind": integers([FRICTION_KINDS.index(pair.kind) for _, pair in pairs]),
        "friction_node": integers(pressing),
        "friction_tangent": integers(tangents),
        "slip_signs": BY_RATES,
    }


# -- Users' plain Python as the kernels call it: functions of arrays (x, y) that fill y --------
# A number that is not finite is an error of the user's function, and raised at once.

Hook = Callable[[np.ndarray, np.ndarray], None]


def primitive_hook(primitive: ConstraintPrimitive) -> Hook | None:
    """Rows of a user's joint: y = (Φ, blocks, ν, γ)."""
    return None if primitive.function is None else _Hook(primitive.function, 18)


def action_hook(action: ForcePrimitive) -> Hook | None:
    """Forces of a user's load: y = (Fx, Fy, T on i, then on j)."""
    return None if action.function is None else _Hook(action.function, 6)


class _Hook:
    """Unpacks (t, side i, side j, parameters) for a user's physics, checks what it returns."""

    def __init__(self, function: Callable[..., Any], size: int) -> None:
        self.function = function
        self.size = size

    def __call__(self, x: np.ndarray, y: np.ndarray) -> None:
        sides = tuple(x[1:9].tolist()), tuple(x[9:17].tolist())
        result = self.function(*sides, x[17:].copy(), float(x[0]))
        if result is None:
            raise ValueError("physics returned nothing")
        values = np.concatenate([np.ravel(part) for part in result]).astype(np.float64)
        if values.shape != (self.size,):
            raise ValueError(f"physics gave {values.size} numbers, {self.size} are wanted")
        if not np.isfinite(values).all():
            raise ValueError(f"physics gave a number that is not finite at t = {x[0]:g}")
        y[:] = values


# -- Lengths, by which lengths and angles are compared with each other -------------------------


def connected_parts(bodies: int, joined: Iterable[Sequence[int]]) -> np.ndarray:
    """The first body of the part that each body belongs to (bodies,); `joined`: groups of bodies
    that something joins, the ground, which joins nothing, being the one after the last.

    >>> connected_parts(4, [(0, 2), (1, 4)]).tolist()
    [0, 1, 0, 3]
    """
    root = list(range(bodies))

    def found(b: int) -> int:
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        return b

    for group in joined:
        moving = [found(b) for b in group if b < bodies]
        for b in moving:
            root[b] = min(moving)
    return integers([found(b) for b in range(bodies)])


@dataclass(frozen=True)
class Lengths:
    """`model`: The model length. `parts` (bodies,): That of the part of each body. `spans`
    (bodies,): Each body's own, the farthest of its joints from its mass centre, or its radius of
    gyration where that is longer and no longer than its part's length.
    """

    model: float
    parts: np.ndarray
    spans: np.ndarray


class _Sizes:
    """Lengths of one part, the sorts that are taken first first: of joints from mass centres; of
    places on the ground, wheels and rods from each other; of loads and shapes; of gyration.
    """

    def __init__(self) -> None:
        self.arms: list[float] = []
        self.distances: list[float] = []
        self.own: list[float] = []
        self.gyration: list[float] = []
        self.fixed: list[tuple[float, float]] = []

    def length(self) -> tuple[float, bool]:
        """The part's length, zero where it has none, and whether it is one of its geometry."""
        x = np.array(self.fixed).reshape(-1, 2)
        if len(x) > 1:
            self.distances.append(float(np.hypot(*np.ptp(x, axis=0))))
        sorts = self.arms, self.distances, self.own, self.gyration
        every = [size for sort in sorts for size in sort]
        none = LENGTH_NONE * max(every, default=0.0)
        known = sorted(size for size in every if size > none)
        for sort in sorts:
            for size in sorted(sort, reverse=True):
                # one far point, or one remainder, is no length of what has others
                near = bisect.bisect_left(known, size / LENGTH_FAR)
                fits = bisect.bisect_right(known, size * LENGTH_FAR) - near > 1
                if size > none and (fits or len(known) == 1):
                    return size, sort is not self.gyration
        return (known[(len(known) - 1) // 2], True) if known else (0.0, False)


def lengths_of(mechanism: Mechanism, at: Numbers, part: np.ndarray, masses: np.ndarray) -> Lengths:
    """The lengths of a mechanism whose bodies belong to these parts (bodies,); masses (m, m, I)
    of each body in turn.

    A part's length is the farthest joint from a mass centre of it, unless nothing else in it is
    nearly as long; where it has none, that of the model, the greatest of its parts. A model without
    any takes how far apart bodies are guessed to be or begin, else one.
    """
    bodies = {body.name: b for b, body in enumerate(mechanism.bodies)}
    sizes = {b: _Sizes() for b in part.tolist()}
    spans = np.zeros(len(bodies))
    mass, inertia = masses[: 3 * len(bodies)].reshape(-1, 3)[:, 1:].T.tolist()
    for element in mechanism.constraints:
        markers = element.places()
        own = [bodies[m.body] for m in markers.values() if m.body != "ground"]
        for key, marker in markers.items():
            if marker.body != "ground":
                b = bodies[marker.body]
                distance = _distance(element, key, at)
                sizes[part[b]].arms.append(distance)
                spans[b] = max(spans[b], distance)
            elif own:
                x, y = at.arm(element, key)
                sizes[part[own[0]]].fixed.append((float(x), float(y)))
        if isinstance(element, Joint) and own:
            sizes[part[own[0]]].distances.append(abs(float(element.apart(at))))
    for load in mechanism.loads:
        markers = load.places()
        loaded = [sizes[part[bodies[m.body]]] for m in markers.values() if m.body != "ground"]
        own_lengths = _own_lengths(load, at)
        own_lengths += [
            _distance(load, key, at) for key, marker in markers.items() if marker.body != "ground"
        ]
        fixed = [at.arm(load, key) for key, marker in markers.items() if marker.body == "ground"]
        for one in loaded:
            one.own += own_lengths
            one.fixed += [(float(x), float(y)) for x, y in fixed]
    for b, body in enumerate(mechanism.bodies):
        own_sizes = sizes[part[b]]
        for name, shape in body.shapes.items():
            if hasattr(shape, "radius"):
                own_sizes.own.append(abs(float(at[f"{body.name}.{name}.radius"])))
            elif isinstance(shape, Polygon | Segment):
                cx, cy = at.point(f"{body.name}.cg")
                corners = (at.point(f"{body.name}.{point}") for point in points_of(shape))
                own_sizes.own += [math.hypot(float(x - cx), float(y - cy)) for x, y in corners]
        if mass[b] > 0.0 and inertia[b] > 0.0:
            own_sizes.gyration.append(math.sqrt(inertia[b] / mass[b]))
    found = {b: one.length() for b, one in sizes.items()}
    known = [size for size, geometric in found.values() if geometric]
    known = known or [size for size, _ in found.values()]
    model = max(known, default=0.0) or _spread(mechanism) or 1.0
    parts = np.array([found[b][0] or model for b in part.tolist()])
    # nor is a joint all but at the mass centre the size of a body that has both mass and inertia
    heavy = (np.array(mass) > 0.0) & (np.array(inertia) > 0.0)
    gyration = np.sqrt(np.where(heavy, inertia, 0.0) / np.where(heavy, mass, 1.0))
    spans = np.where(spans * LENGTH_FAR > parts, spans, 0.0)
    spans = np.maximum(spans, np.minimum(gyration, parts))
    return Lengths(model, parts, np.where(spans > 0.0, spans, parts))


def _distance(element: Element, key: str, at: Numbers) -> float:
    """From a mass centre to a marker; zero where it is a rounding remainder of both places."""
    x, y = (float(number) for number in at.place(element, key))
    dx, dy = (float(number) for number in at.arm(element, key))
    distance = math.hypot(dx, dy)
    return distance if distance > LENGTH_NONE * math.hypot(x, y) else 0.0


def _own_lengths(load: Load, at: Numbers) -> list[float]:
    """Lengths that a load has itself: they do not depend on where the origin is."""
    return [
        abs(float(at[f"{load.name}.{field.name}"]))
        for field in dataclasses.fields(cast(Any, load))
        if field.metadata.get("dimension") == "length" and getattr(load, field.name) is not None
    ]


def _spread(mechanism: Mechanism) -> float:
    """How far apart bodies are guessed to be and begin."""
    places = [body.guess for body in mechanism.bodies if body.guess is not None]
    given = [(one.x, one.y) for one in places]
    if mechanism.simulation is not None:
        given += [(one.get("x"), one.get("y")) for one in mechanism.simulation.start.values()]
    known = [(x, y) for x, y in given if isinstance(x, float) and isinstance(y, float)]
    return float(np.hypot(*np.ptp(np.array(known), axis=0))) if len(known) > 1 else 0.0


# the loops of the kernels read a fixed number of parameters and drop those beyond the own ones
SPARE = 8
#: Friction pairs by the name of their element.
Pairs: TypeAlias = Mapping[str, Sequence[FrictionPrimitive]]


def assemble(mechanism: Mechanism, *, groups: bool = False, machine_code: bool = False) -> System:
    """Assemble a mechanism: the constraint assembler.

    Parameters
    ----------
    mechanism : Mechanism
        Any number of bodies, joints, loops and drivers; redundant rows are allowed.
    groups : bool
        Whether groups of contacts stay groups, as ``method="moreau"`` of `simulate` takes them, or
        are contacts one by one.
    machine_code : bool
        For a mechanism that is analysed again and again: driven motions of 48 instants and more,
        and sweeps of any size, run machine code of this topology alone, which takes a third of
        the time of the code that serves all. It is made when it is first needed, in a second, and
        kept on disk. Forces agree with those of the other code to 1e-11 of the greatest.
        Where there is none (with cams, friction and laws that branch, beyond 24 bodies, or
        without a compiler) the code that serves all runs.

    Returns
    -------
    System
        Flat arrays, names and the order of elimination. Cost: a few ms for ten bodies, linear in
        their number.

    Raises
    ------
    ModelError
        For a mechanism without bodies.

    Examples
    --------
    >>> from mbody import Body, Mechanism, Revolute, assemble
    >>> machine = Mechanism("pendulum")
    >>> machine.add(Body("rod", mass=1.0, cg=(0.5, 0.0)), Revolute("O", "ground", "rod"))
    >>> system = assemble(machine)
    >>> system.coordinates, system.rows
    (3, 2)
    """
    if not mechanism.bodies:
        raise ModelError(f"'{mechanism.name}' has no bodies: add at least one Body")
    mechanism = snapshot(mechanism, groups=groups)
    compiler = _Compiler(mechanism)
    numbers = compiler.numbers
    par, mass = compiler.compile(numbers)
    layout = compiler.layout()
    lengths = lengths_of(mechanism, compiler.read(numbers), layout.body_part, mass[:, 0])
    return System(
        mechanism=mechanism,
        layout=layout,
        values=numbers,
        formulas=compiler.formulas(numbers),
        par=par,
        mass=mass,
        batch=None,
        length=lengths.model,
        lengths=lengths.parts,
        spans=lengths.spans,
        heaviest=float(mass[:-3:3].max()) or 1.0,
        owners=tuple(compiler.owners),
        row_kinds=tuple(primitive.rows for primitive in compiler.first_primitives),
        signals=len(compiler.signal_laws) + compiler.formula_signals,
        plans={},
        functions=compiler.functions(),
        _compile=compiler.compile,
        _columns=compiler.columns,
        machine_code=machine_code,
    )


def _rate(state: State | AuxiliaryState, at: Numbers) -> Signal:
    return signal_of(state.rate) if isinstance(state, AuxiliaryState) else at.law(state, "rate")


class _Compiler:
    """Works out, once for a topology, where every number of a mechanism goes."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.loads = mechanism, mechanism.loads
        self.bodies = (*mechanism.bodies, mechanism.ground)
        self.index = {body.name: n for n, body in enumerate(self.bodies)}
        self.polar = polar_points(mechanism)
        at = self._numbers_by_name = Numbers(self.numbers, self.polar, mechanism.bodies)
        #: Drivers that follow positions, with their moving bodies.
        self.following = following(mechanism, at)
        # shapes that cannot touch have no rows
        self._refuse_contacts(at)
        made = {one.name: one.frictions(at) for one in mechanism.constraints}
        #: Elements with friction pairs.
        self.frictional = [one for one in mechanism.constraints if made[one.name]]
        self.pairs = [(one, pair) for one in self.frictional for pair in made[one.name]]
        found = [
            (PRIMITIVE_KINDS.index(primitive.kind), element, part, primitive)
            for element in mechanism.constraints
            for part, primitive in enumerate(self.own_primitives(element, at, made[element.name]))
        ]
        found.sort(key=lambda entry: entry[0])
        self.owners = [(element, part) for _, element, part, _ in found]
        self.first_primitives = [primitive for *_, primitive in found]
        loads = [
            (ACTION_KINDS.index(action.kind), cause, part, action)
            for cause, load in enumerate(mechanism.loads)
            for part, action in enumerate(load.actions(at))
        ]
        loads.sort(key=lambda entry: entry[0])
        self.action_owners = [(cause, part) for _, cause, part, _ in loads]
        self.first_actions = [action for *_, action in loads]
        # signal 0 is the zero that rows without a law read
        zero = Constant(0.0)
        self.signal_laws: list[Law] = [zero]
        self.primitive_signal = [
            self._signals((primitive.signal,)) for primitive in self.first_primitives
        ]
        self.action_signal = [self._signals(action.signals) for action in self.first_actions]
        self.friction_signal = [self._signals((pair.capacity,)) for _, pair in self.pairs]
        #: Signals of elements' own laws that are formulas of measured quantities.
        self.formula_signals = 0
        first = len(self.signal_laws)
        self.input_row = {one.name: 3 * (first + n) for n, one in enumerate(mechanism.inputs)}
        self.signal_laws += [one.value for one in mechanism.inputs]

    def _signals(self, signals: tuple[Signal | None, ...]) -> int:
        if not signals or signals[0] is None:
            return 0
        first = len(self.signal_laws)
        self.signal_laws += [signal.law for signal in signals if signal is not None]
        return 3 * first

    def read(self, numbers: dict[str, Any]) -> Numbers:
        """Numbers by dotted name, as elements read them; of the description each body-fixed
        position once.
        """
        moving = self.mechanism.bodies
        return (
            self._numbers_by_name
            if numbers is self.numbers
            else Numbers(numbers, self.polar, moving)
        )

    @functools.cached_property
    def numbers(self) -> dict[str, Any]:
        """All changeable numbers by dotted name."""
        names = self.mechanism.parameters.scope().names
        result: dict[str, Any] = {name: names[name].value for name in self.mechanism.parameters}
        result |= self.mechanism.ground.numbers()
        for element in self.mechanism:
            result |= element.numbers()
        return result

    def formulas(self, numbers: dict[str, Any]) -> dict[str, Formula]:
        """Formulas of parameters: of the changeable numbers, and of other parameters."""
        parameters = self.mechanism.parameters
        own = {name: value for name, value in parameters.items() if isinstance(value, Formula)}
        found = {**own, **self.mechanism.formulas}
        return {
            name: formula
            for name, formula in found.items()
            if name in numbers and parameters.used_by(formula)
        }

    def frictions(self, at: Numbers) -> dict[str, list[FrictionPrimitive]]:
        """The friction pairs of every element that has any, in their order, with their numbers."""
        return {one.name: one.frictions(at) for one in self.frictional}

    def primitives(self, at: Numbers, pairs: Pairs) -> list[ConstraintPrimitive]:
        """All primitives in the order of the kernels, with their numbers."""
        made = {
            one.name: self.own_primitives(one, at, pairs.get(one.name, ()))
            for one in self.mechanism.constraints
        }
        return [made[element.name][part] for element, part in self.owners]

    def own_primitives(
        self, element: Constraint, at: Numbers, pairs: Sequence[FrictionPrimitive]
    ) -> list[ConstraintPrimitive]:
        """The rows of an element, then the tangent rows of its friction pairs; of a stop, and
        of a driver that follows positions, a row of a formula.
        """
        own, bodies = element.primitives(at), self.following.get(element.name)
        if bodies is None:
            return [*own, *(pair.tangent for pair in pairs)]
        i, j, *more = (*bodies, "ground")[: max(2, len(bodies))]
        return [replace(own[0], kind="formula", i=i, j=j, parameters=[], more=tuple(more))]

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """All actions in the order of the kernels, with their numbers."""
        made = [load.actions(at) for load in self.mechanism.loads]
        return [made[cause][part] for cause, part in self.action_owners]

    def laws(
        self,
        primitives: list[ConstraintPrimitive],
        actions: list[ForcePrimitive],
        pairs: list[FrictionPrimitive],
        at: Numbers,
    ) -> list[RecordedLaw]:
        """All laws: those of time in the order of the signals, inputs last among them; the
        elements' own; the rates of auxiliary states; those that formulas evaluate.
        """
        machine = self.mechanism
        found = [RecordedLaw(Signal(Constant(0.0), [0.0]))]
        for (element, _), primitive in zip(self.owners, primitives, strict=True):
            if primitive.signal is not None:
                found.append(driver_law(primitive.signal, element, machine, at))
        names = {name for law in found if law.driven is not None for name in law.driven.signals}
        found += [recorded(signal, machine, at) for action in actions for signal in action.signals]
        given = [pair.capacity for pair in pairs if pair.capacity is not None]
        found += [recorded(signal, machine, at) for signal in given]
        for one in machine.inputs:
            found.append(RecordedLaw(at.law(one, "value"), derivatives=one.name in names))
        for (cause, _), action in zip(self.action_owners, actions, strict=True):
            if action.law is not None:
                found.append(recorded(action.law, machine, at, self.loads[cause]))
        own = [one.law for one in primitives if one.law is not None]
        found += [RecordedLaw(law, derivatives=True) for law in own]
        found += [recorded(_rate(one, at), machine, at) for one in machine.states]
        curves = [(signal, law.driven is not None) for law in found for signal in law.laws]
        return found + [RecordedLaw(signal, derivatives=driven) for signal, driven in curves]

    @functools.cached_property
    def first_laws(self) -> list[RecordedLaw]:
        """Those of the description's numbers."""
        pairs = [pair for _, pair in self.pairs]
        at = self.read(self.numbers)
        return self.laws(self.first_primitives, self.first_actions, pairs, at)

    def _refuse_contacts(self, at: Numbers) -> None:
        for contact in (*self.mechanism.contacts, *self.mechanism.groups):
            contact.refuse(at, self.mechanism.units.length)

    def compile(self, numbers: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (rows, batch) and masses (3·bodies + 3, batch) from the user's numbers."""
        at = self.read(numbers)
        for joint in self.mechanism.joints:
            joint.refuse(at, self.mechanism.units.length)
        self._refuse_contacts(at)
        columns, masses = self.columns(numbers)
        designs = designs_of(numbers)
        return stacked(columns, designs), stacked(masses, designs)

    def columns(self, numbers: dict[str, Any]) -> tuple[list[Any], list[Any]]:
        """The rows of parameters and masses, each a number or an array (batch,)."""
        at = self.read(numbers)
        if numbers is self.numbers:
            # those of the description were made already
            pairs = [pair for _, pair in self.pairs]
            owned = self.pairs
            primitives, actions, laws = self.first_primitives, self.first_actions, self.first_laws
        else:
            made = self.frictions(at)
            owned = [(one, pair) for one in self.frictional for pair in made[one.name]]
            pairs = [pair for own in made.values() for pair in own]
            primitives, actions = self.primitives(at, made), self.actions(at)
            laws = self.laws(primitives, actions, pairs, at)
        if self.loops:
            from mbody.system.formula_steps import check_loops

            names = self._law_names(self.first_laws)
            check_loops(self.mechanism, [(names[n], self.first_laws[n]) for n in self.loops], owned)
        columns: list[Any] = []
        for (element, _), primitive in zip(self.owners, primitives, strict=True):
            columns += [*primitive.parameters, *_position_on_j(element, at)]
        for law in laws:
            columns.extend(law.parameters)
        for action in actions:
            columns.extend(action.parameters)
        for pair in pairs:
            columns.extend(pair.parameters)
        columns += [0.0] * SPARE
        masses: list[Any] = []
        for body in self.mechanism.bodies:
            weight = numbers.get(f"{body.name}.weight")
            mass = numbers[f"{body.name}.mass"] if weight is None else weight / self.mechanism.g
            masses += [mass, mass, numbers[f"{body.name}.inertia"]]
        masses += [0.0] * 3
        return columns, masses

    def functions(self) -> tuple[tuple[str, Callable[..., Any] | None], ...]:
        """The users' functions of constraints, loads, laws, wrapped for kernels, with names."""
        found: list[tuple[str, Callable[..., Any] | None]] = []
        for (element, _), primitive in zip(self.owners, self.first_primitives, strict=True):
            found.append((element.name, primitive_hook(primitive)))
        causes = self.mechanism.loads
        for (cause, _), action in zip(self.action_owners, self.first_actions, strict=True):
            found.append((causes[cause].name, action_hook(action)))
        laws = self.first_laws
        names = self._law_names(laws)
        found += [(n, law.law.hook(law.derivatives)) for n, law in zip(names, laws, strict=True)]
        return tuple(found)

    @functools.cached_property
    def loops(self) -> list[int]:
        """Numbers of the laws that give loads what follows from accelerations and forces."""
        laws = self.first_laws
        end = len(laws) - sum(len(law.laws) for law in laws) - len(self.mechanism.states)
        return [n for n in range(end) if laws[n].of_solution]

    def _law_names(self, laws: list[RecordedLaw]) -> list[str]:
        """Name of the element that each law belongs to."""
        names = [""]
        pairs = zip(self.owners, self.first_primitives, strict=True)
        names += [element.name for (element, _), primitive in pairs if primitive.signal is not None]
        loads = self.mechanism.loads
        actions = list(zip(self.action_owners, self.first_actions, strict=True))
        names += [loads[c].name for (c, _), action in actions for _ in action.signals]
        names += [one.name for one, pair in self.pairs if pair.capacity is not None]
        names += [one.name for one in self.mechanism.inputs]
        names += [loads[c].name for (c, _), action in actions if action.law is not None]
        pairs = zip(self.owners, self.first_primitives, strict=True)
        names += [element.name for (element, _), primitive in pairs if primitive.law is not None]
        names += [one.name for one in self.mechanism.states]
        own = [name for name, law in zip(names, laws, strict=False) for _ in law.laws]
        return names + own

    def layout(self) -> Layout:
        """The index lists of the kernels: the symbolic phase."""
        primitives, actions = self.first_primitives, self.first_actions
        index, bodies = self.index, len(self.bodies) - 1
        slots = split(
            bodies, [tuple(index[body] for body in primitive.bodies) for primitive in primitives]
        )
        plan = eliminate(slots)
        place = {node: k for k, node in enumerate(plan.order)}
        columns = [3 * s for node in plan.order for s in slots.sides[node][:2]]
        laws = self.first_laws
        sizes = [len(primitive.parameters) + 2 for primitive in primitives]
        sizes += [len(law.parameters) for law in laws]
        sizes += [len(action.parameters) for action in actions]
        sizes += [len(pair.parameters) for _, pair in self.pairs]
        offset = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        # fixed data of each law once, and where that begins
        tables = {id(law.law): law.law.table() for law in laws}
        starts = dict(zip(tables, np.cumsum([0, *map(len, tables.values())]), strict=False))
        a, b = len(primitives), len(primitives) + len(laws)
        c = b + len(actions)
        of_time = len(self.signal_laws)
        timed = [n for n in range(of_time) if laws[n].timed]
        order = sorted(timed, key=lambda n: isinstance(self.signal_laws[n], Constant))
        own = iter(range(of_time, len(laws)))
        action_law, primitive_law = (
            integers([-1 if part.law is None else next(own) for part in parts])
            for parts in (actions, primitives)
        )
        states = self.mechanism.states
        formulas = FormulaRows(
            index, self.input_row, [one.name for one in states], numbered(self.owners)
        )
        # number of the first law that each formula evaluates
        called = [len(law.laws) for law in laws]
        first = (len(laws) - sum(called) + np.cumsum([0, *called])).tolist()
        rows = [n for n in range(of_time) if laws[n].driven is not None]
        for n in rows:
            formulas.add_signal(laws[n], offset[a + n], first[n], 3 * n)
        driver_steps = len(formulas.rows)
        active_set = [e for e, primitive in enumerate(primitives) if primitive.active_set]
        beyond = first_beyond(len(slots.sides), len(plan.more_node))
        written = [place[e] for e in range(a)]
        for n, e in enumerate(active_set):
            written[e] = beyond + n
        blocks = blocks_of(primitives, place, written, plan)
        spans = np.zeros((a, 3), dtype=np.int64)
        for e in range(a):
            n = self.primitive_signal[e] // 3
            recorded_row = laws[n].driven
            if n and recorded_row is not None and recorded_row.measured_bodies:
                spans[e] = formulas.add_rows(
                    recorded_row, offset[a + n], first[n], 3 * n, 2 * written[e], blocks[e]
                )
        load_steps = len(formulas.rows)
        given = {n: 3 * n for n in range(of_time) if laws[n].steps is not None}
        for action in np.flatnonzero(action_law >= 0):
            n = int(action_law[action])
            if laws[n].steps is not None:
                given[n] = 3 * (of_time + self.formula_signals)
                self.formula_signals += 1
                action_law[action] = -1 - given[n]
        rates = {len(laws) - sum(called) - len(states) + n: n for n in range(len(states))}
        loops = [given[n] for n in self.loops]
        force_steps = 0
        for late in (False, True):
            force_steps = len(formulas.rows)
            for n in (*given, *rates):
                if laws[n].of_solution == late:
                    row, rate = given.get(n), rates.get(n)
                    formulas.add(laws[n], offset[a + n], laws=first[n], signal=row, rate=rate)
        primitive_of = {element.name: e for e, (element, _) in enumerate(self.owners)}
        driven = [primitive_of[driver.name] for driver in self.mechanism.drivers]
        moving = [
            number
            for number, e in enumerate(active_set)
            if (own_row := laws[self.primitive_signal[e] // 3].driven) and own_row.explicit
        ]
        dependent = [driver.name in self.following for driver in self.mechanism.drivers]
        return Layout(
            bodies=bodies,
            slots=len(slots.body),
            nodes=len(slots.sides),
            primitive_kind=integers(
                [PRIMITIVE_KINDS.index(primitive.kind) for primitive in primitives]
            ),
            primitive_i=integers([index[primitive.i] for primitive in primitives]),
            primitive_j=integers([index[primitive.j] for primitive in primitives]),
            primitive_par=integers(offset[:a]),
            primitive_count=integers(sizes[:a]) - 2,
            primitive_arm=integers(offset[1 : a + 1]) - 2,
            primitive_signal=integers(self.primitive_signal),
            primitive_node=integers([place[e] for e in range(a)]),
            primitive_law=primitive_law,
            primitive_handle=integers([-1] * a),
            written_node=integers(written),
            active_set=integers(active_set),
            **friction_table(self.pairs, self.owners, place, active_set),
            friction_par=integers(offset[c:-1]),
            friction_signal=integers(self.friction_signal),
            moving=integers(moving),
            node_column=integers(columns),
            more=np.column_stack([plan.more_node, 3 * plan.more_slot]),
            **sums_of(primitives, self.index, blocks),
            **plan.lists(),
            slot_body=integers(slots.body),
            body_slot=np.searchsorted(slots.body, np.arange(bodies)),
            body_part=connected_parts(
                bodies, ([index[b] for b in p.bodies] for p in primitives if not p.active_set)
            ),
            law_kind=integers([LAW_KINDS.index(law.law.kind) for law in laws]),
            law_par=integers(offset[a:b]),
            law_count=integers(sizes[a:b]),
            law_table=integers([starts[id(law.law)] for law in laws]),
            law_handle=integers([-1] * len(laws)),
            signal_law=integers(order),
            signal_row=integers([3 * n for n in order]),
            varying=sum(not isinstance(self.signal_laws[n], Constant) for n in timed),
            owns=len(states),
            formula_numbers=formulas.count,
            formula_step=formulas.table(),
            driver_steps=driver_steps,
            primitive_steps=spans,
            load_steps=load_steps,
            force_steps=force_steps,
            loop_row=integers(loops),
            # what loops give to loads is kept as inputs are
            input_row=integers([*self.input_row.values(), *loops]),
            driver_row=integers([self.primitive_signal[e] for e in driven]),
            driver_node=integers([place[e] for e in driven]),
            driver_dependent=integers(dependent),
            action_kind=integers([ACTION_KINDS.index(action.kind) for action in actions]),
            action_i=integers([index[action.i] for action in actions]),
            action_j=integers([index[action.j] for action in actions]),
            action_by=integers([index[action.by] for action in actions]),
            action_par=integers(offset[b:c]),
            action_count=integers(sizes[b:c]),
            action_signal=integers(self.action_signal),
            action_law=action_law,
            action_handle=integers([-1] * len(actions)),
            action_cause=integers([cause for cause, _ in self.action_owners]),
            table=np.concatenate([*tables.values(), np.zeros(1)]),
        )


def _position_on_j(element: Element, at: Numbers) -> tuple[Any, Any]:
    """Body-fixed position of the place on j, where the reaction is reported; angles need none."""
    return at.arm(element, "j") if "j" in element.places() else (0.0, 0.0)
