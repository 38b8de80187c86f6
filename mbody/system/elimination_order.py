"""The symbolic phase: in which order the nodes of rows are eliminated, and what each step touches.

Nodes that share a slot are neighbours. Minimum degree keeps chains, trees and ladders linear. A
body with many nodes would make all of them neighbours of each other; it is split into slots of few
nodes, tied in a row by welds (`schur` of trees of slots stays narrow), so a hub costs as a chain.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.kernels.constraints import KINDS
from mbody.kernels.layout import Layout, first_beyond, integers
from mbody.model.primitives import ConstraintPrimitive

#: A body with more nodes than this is split into slots that take so many each.
MOST, EACH = 6, 3


@dataclass(frozen=True)
class Slots:
    """Slots of all bodies; the one after the last belongs to the ground.

    Attributes
    ----------
    body : list of int
        Body of each slot.
    sides : list of tuples of int
        Slots on which the sides of each node stand, two as a rule; welds last.
    welds : int
        How many of the last nodes are welds, two for each pair of neighbouring slots.
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
    apart = at[later] != at[earlier]
    later, earlier = later[apart], earlier[apart]
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
    """Where each of groups of these sizes begins, and the end of the last."""
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
            beside = graph[other]
            if not known:
                beside |= own
                beside.discard(other)
            beside.discard(node)
            size = len(beside)
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
    writes, another one of those that can be on or off.
    """
    nodes = len(plan.order)
    switched = [e for e, primitive in enumerate(primitives) if primitive.switched]
    apart = 12 * (first_beyond(nodes, len(plan.more_node)) + len(switched))
    further: dict[int, list[int]] = {}
    for n, k in enumerate(plan.more_node):
        further.setdefault(int(k), []).append(6 * n)
    found = []
    for e, primitive in enumerate(primitives):
        k, first = written[e], apart if primitive.switched else 12 * nodes
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


# -- Elimination without the fill of inactive rows ---------------------------------------------
#
# Rows of contacts that are open are rows of an identity: they have no blocks beside the diagonal,
# and elimination works on zeros there. Of many contact candidates where bodies may touch few do,
# and most of the work is on zeros. The lists of `mbody.kernels.schur_ldl` without them give the
# same numbers.

Array = np.ndarray


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
