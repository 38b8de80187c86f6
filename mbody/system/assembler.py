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
from mbody.kernels.forces import KINDS as ACTION_KINDS
from mbody.kernels.friction import BY_RATES, FRICTION_KINDS
from mbody.kernels.layout import Layout, first_beyond, integers
from mbody.laws import LAW_KINDS, Constant
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

    sides = [tuple([slot(b) for b in pair]) for pair in ends]
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
) -> dict[int, dict[str, int]]:
    """Of every sum and formula where its physics writes the blocks of its bodies; −1 of the ground.
    place: node of every primitive in the order of elimination; written: the node that its physics
    writes, another one of the active set.
    """
    nodes = len(plan.order)
    active_set = [e for e, primitive in enumerate(primitives) if primitive.active_set]
    further_begin = 12 * (first_beyond(nodes, len(plan.more_node)) + len(active_set))
    further: dict[int, list[int]] = {}
    for n, k in enumerate(plan.more_node):
        further.setdefault(int(k), []).append(6 * n)
    found = {}
    for e, primitive in enumerate(primitives):
        if not primitive.parts and primitive.kind != "formula":
            continue
        k, first = written[e], further_begin if primitive.active_set else 12 * nodes
        at = [12 * k, 12 * k + 6, *(first + n for n in further.get(place[e], []))]
        found[e] = dict(zip(primitive.bodies, at, strict=True)) | {"ground": -1}
    return found


def sums_of(
    primitives: Sequence[ConstraintPrimitive],
    index: Mapping[str, int],
    blocks: Mapping[int, Mapping[str, int]],
) -> dict[str, Any]:
    """The parts of all sums, and the places of the blocks of their bodies."""
    table = [
        (KINDS.index(part.kind), index[part.i], index[part.j], own[part.i], own[part.j])
        for e, own in blocks.items()
        for part in primitives[e].parts
    ]
    start = _starts([len(primitive.parts) for primitive in primitives])
    return {"sum_start": start, "part": _integers(table).reshape(-1, 5)}


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
        "friction_kind": [FRICTION_KINDS.index(pair.kind) for _, pair in pairs],
        "friction_node": pressing,
        "friction_tangent": tangents,
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


# -- The index lists of the kernels ------------------------------------------------------------

#: Behind the parameters of each primitive: the body-fixed position on j.
POSITION_ON_J = 2


@dataclass(frozen=True, eq=False)
class Topology:
    """What the index lists of kernels follow from.

    `index`: Number of every body by name, the ground the last.
    `owners`: (element, index of its primitive) of every primitive.
    `primitives`, `actions`: In the order of the kernels: sorted by kind.
    `driven`: Primitives of the drivers, in the order of the description.
    `causes`: Number of the load of each action.
    `laws`: The zero that rows without a law read; the signals of primitives, actions and friction
      pairs, inputs; own laws of actions, of primitives; rates of states; what formulas evaluate.
    `pairs`: Friction pairs with their elements.
    `inputs`, `states`: Names.
    """

    index: Mapping[str, int]
    owners: Sequence[tuple[Element, int]]
    primitives: Sequence[ConstraintPrimitive]
    driven: Sequence[int]
    actions: Sequence[ForcePrimitive]
    causes: Sequence[int]
    laws: Sequence[RecordedLaw]
    pairs: Sequence[tuple[Constraint, FrictionPrimitive]] = ()
    inputs: Sequence[str] = ()
    states: Sequence[str] = ()


def index_lists(topology: Topology) -> tuple[Layout, int]:
    """The symbolic phase: the index lists of the kernels, and how many signals they have."""
    primitives, actions, laws = topology.primitives, topology.actions, topology.laws
    index, bodies = topology.index, len(topology.index) - 1
    ends = [tuple([index[body] for body in primitive.bodies]) for primitive in primitives]
    slots = split(bodies, ends)
    plan = eliminate(slots)
    place = {node: k for k, node in enumerate(plan.order)}
    sizes = [len(primitive.parameters) + POSITION_ON_J for primitive in primitives]
    sizes += [len(law.parameters) for law in laws]
    sizes += [len(action.parameters) for action in actions]
    sizes += [len(pair.parameters) for _, pair in topology.pairs]
    offset = _starts(sizes)
    # fixed data of each law once, and where that begins
    tables = {id(law.law): law.law.table() for law in laws}
    starts = dict(zip(tables, _starts([*map(len, tables.values())]).tolist(), strict=False))
    a, b, c = np.cumsum([len(primitives), len(laws), len(actions)]).tolist()
    # first signal row of each; signal 0 is the zero that rows without a law read
    many = [0 if primitive.signal is None else 1 for primitive in primitives]
    many += [len(action.signals) for action in actions]
    many += [0 if pair.capacity is None else 1 for _, pair in topology.pairs]
    signals = _starts([1, *many])
    signal = np.where(many, 3 * signals[1:-1], 0).tolist()
    first_input = int(signals[-1])
    input_row = {name: 3 * (first_input + n) for n, name in enumerate(topology.inputs)}
    of_time = first_input + len(input_row)
    # laws that vary come first
    timed = [n for n in range(of_time) if laws[n].timed]
    order = sorted(timed, key=lambda n: isinstance(laws[n].law, Constant))
    own = iter(range(of_time, len(laws)))
    action_law, primitive_law = (
        [-1 if part.law is None else next(own) for part in parts] for parts in (actions, primitives)
    )
    formulas = FormulaRows(index, input_row, topology.states, numbered(topology.owners))
    # number of the first law that each formula evaluates
    called = [len(law.laws) for law in laws]
    first = (len(laws) - sum(called) + _starts(called)).tolist()
    for n in range(of_time):
        formulas.add_signal(laws[n], offset[a + n], first[n], 3 * n)
    driver_steps = len(formulas.rows)
    active_set = [e for e, primitive in enumerate(primitives) if primitive.active_set]
    beyond = first_beyond(len(slots.sides), len(plan.more_node))
    node = [place[e] for e in range(a)]
    written = node.copy()
    for n, e in enumerate(active_set):
        written[e] = beyond + n
    blocks = blocks_of(primitives, place, written, plan)
    spans = np.zeros((a, 3), dtype=np.int64)
    for e, at in blocks.items():
        row, n = laws[signal[e] // 3].driven, signal[e] // 3
        if row is not None:
            where = offset[a + n], first[n], 3 * n, 2 * written[e]
            spans[e] = formulas.add_rows(row, *where, at)
    load_steps = len(formulas.rows)
    given = {n: 3 * n for n in range(of_time) if laws[n].steps is not None}
    # own laws of loads that are formulas of measured quantities have signals beyond those of time
    all_signals = of_time
    for action, n in enumerate(action_law):
        if n >= 0 and laws[n].steps is not None:
            given[n] = 3 * all_signals
            action_law[action] = -1 - given[n]
            all_signals += 1
    states = len(topology.states)
    rates = {len(laws) - sum(called) - states + n: n for n in range(states)}
    loops = [row for n, row in given.items() if laws[n].of_solution]
    force_steps = 0
    for late in (False, True):
        force_steps = len(formulas.rows)
        for n in (*given, *rates):
            if laws[n].of_solution == late:
                row, rate = given.get(n), rates.get(n)
                formulas.add(laws[n], offset[a + n], laws=first[n], signal=row, rate=rate)
    switched = [laws[signal[e] // 3].driven for e in active_set]
    layout = Layout(
        bodies=bodies,
        slots=len(slots.body),
        nodes=len(slots.sides),
        primitive_kind=[KINDS.index(primitive.kind) for primitive in primitives],
        primitive_i=[index[primitive.i] for primitive in primitives],
        primitive_j=[index[primitive.j] for primitive in primitives],
        primitive_par=offset[:a],
        primitive_count=np.diff(offset[: a + 1]) - POSITION_ON_J,
        primitive_arm=offset[1 : a + 1] - POSITION_ON_J,
        primitive_signal=signal[:a],
        primitive_node=node,
        primitive_law=primitive_law,
        primitive_handle=[-1] * a,
        written_node=written,
        active_set=active_set,
        **friction_table(topology.pairs, topology.owners, place, active_set),
        friction_par=offset[c:-1],
        friction_signal=signal[a + len(actions) :],
        moving=[n for n, row in enumerate(switched) if row is not None and row.explicit],
        node_column=[3 * s for node in plan.order for s in slots.sides[node][:2]],
        more=np.column_stack([plan.more_node, 3 * plan.more_slot]),
        **sums_of(primitives, index, blocks),
        **plan.lists(),
        slot_body=slots.body,
        body_slot=np.searchsorted(slots.body, np.arange(bodies)),
        body_part=connected_parts(
            bodies, [ends[e] for e, one in enumerate(primitives) if not one.active_set]
        ),
        law_kind=[LAW_KINDS.index(law.law.kind) for law in laws],
        law_par=offset[a:b],
        law_count=sizes[a:b],
        law_table=[starts[id(law.law)] for law in laws],
        law_handle=[-1] * len(laws),
        signal_law=order,
        signal_row=[3 * n for n in order],
        varying=sum(not isinstance(laws[n].law, Constant) for n in timed),
        owns=states,
        formula_numbers=formulas.count,
        formula_step=formulas.table(),
        driver_steps=driver_steps,
        primitive_steps=spans,
        load_steps=load_steps,
        force_steps=force_steps,
        loop_row=loops,
        # what loops give to loads is kept as inputs are
        input_row=[*input_row.values(), *loops],
        driver_row=[signal[e] for e in topology.driven],
        driver_node=[node[e] for e in topology.driven],
        driver_dependent=[primitives[e].kind == "formula" for e in topology.driven],
        action_kind=[ACTION_KINDS.index(action.kind) for action in actions],
        action_i=[index[action.i] for action in actions],
        action_j=[index[action.j] for action in actions],
        action_by=[index[action.by] for action in actions],
        action_par=offset[b:c],
        action_count=sizes[b:c],
        action_signal=signal[a : a + len(actions)],
        action_law=action_law,
        action_handle=[-1] * len(actions),
        action_cause=topology.causes,
        table=np.concatenate([*tables.values(), np.zeros(1)]),
    )
    return layout, all_signals


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
    layout, signals = index_lists(compiler.topology())
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
        signals=signals,
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
        bodies = (*mechanism.bodies, mechanism.ground)
        self.index = {body.name: n for n, body in enumerate(bodies)}
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
            (KINDS.index(primitive.kind), element, part, primitive)
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
        pairs: list[tuple[Constraint, FrictionPrimitive]],
        at: Numbers,
    ) -> list[tuple[str, RecordedLaw]]:
        """All laws, with the names of their elements: those of time in the order of the signals,
        inputs last among them; the elements' own; the rates of auxiliary states; those that
        formulas evaluate.
        """
        machine = self.mechanism
        owned = [(element, one) for (element, _), one in zip(self.owners, primitives, strict=True)]
        causes = [self.loads[cause] for cause, _ in self.action_owners]
        loaded = list(zip(causes, actions, strict=True))
        found = [("", RecordedLaw(Signal(Constant(0.0), [0.0])))]
        for element, one in owned:
            if one.signal is not None:
                found.append((element.name, driver_law(one.signal, element, machine, at)))
        names = {n for _, law in found if law.driven is not None for n in law.driven.signals}
        for load, action in loaded:
            found += [(load.name, recorded(signal, machine, at)) for signal in action.signals]
        given = [(one.name, pair.capacity) for one, pair in pairs if pair.capacity is not None]
        found += [(name, recorded(signal, machine, at)) for name, signal in given]
        for entry in machine.inputs:
            law = at.law(entry, "value")
            found.append((entry.name, RecordedLaw(law, derivatives=entry.name in names)))
        for load, action in loaded:
            if action.law is not None:
                found.append((load.name, recorded(action.law, machine, at, load)))
        for element, one in owned:
            if one.law is not None:
                found.append((element.name, RecordedLaw(one.law, derivatives=True)))
        found += [(own.name, recorded(_rate(own, at), machine, at)) for own in machine.states]
        return found + [
            (name, RecordedLaw(signal, derivatives=law.driven is not None))
            for name, law in found
            for signal in law.laws
        ]

    @functools.cached_property
    def first_laws(self) -> list[tuple[str, RecordedLaw]]:
        """Those of the description's numbers."""
        at = self.read(self.numbers)
        return self.laws(self.first_primitives, self.first_actions, self.pairs, at)

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
            pairs, laws = self.pairs, self.first_laws
            primitives, actions = self.first_primitives, self.first_actions
        else:
            made = self.frictions(at)
            pairs = [(one, pair) for one in self.frictional for pair in made[one.name]]
            primitives, actions = self.primitives(at, made), self.actions(at)
            laws = self.laws(primitives, actions, pairs, at)
        if self.loops:
            from mbody.system.formula_steps import check_loops

            check_loops(self.mechanism, self.loops, pairs)
        columns: list[Any] = []
        for (element, _), primitive in zip(self.owners, primitives, strict=True):
            columns += [*primitive.parameters, *_position_on_j(element, at)]
        for _, law in laws:
            columns.extend(law.parameters)
        for action in actions:
            columns.extend(action.parameters)
        for _, pair in pairs:
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
        found += [(name, law.law.hook(law.derivatives)) for name, law in self.first_laws]
        return tuple(found)

    @functools.cached_property
    def loops(self) -> list[tuple[str, RecordedLaw]]:
        """The laws that give loads what follows from accelerations and forces, and their names."""
        rates = {one.name for one in self.mechanism.states}
        return [own for own in self.first_laws if own[1].of_solution and own[0] not in rates]

    def topology(self) -> Topology:
        """What the index lists of the kernels follow from."""
        machine, laws = self.mechanism, [law for _, law in self.first_laws]
        primitive_of = {element.name: e for e, (element, _) in enumerate(self.owners)}
        driven = [primitive_of[driver.name] for driver in machine.drivers]
        causes = [cause for cause, _ in self.action_owners]
        parts = self.first_primitives, driven, self.first_actions, causes, laws, self.pairs
        inputs, states = ([one.name for one in own] for own in (machine.inputs, machine.states))
        return Topology(self.index, self.owners, *parts, inputs, states)


def _position_on_j(element: Element, at: Numbers) -> tuple[Any, Any]:
    """Body-fixed position of the place on j, where the reaction is reported; angles need none."""
    return at.arm(element, "j") if "j" in element.places() else (0.0, 0.0)
