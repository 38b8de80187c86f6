"""The symbolic phase: in which order the nodes of rows are eliminated, and what each step touches.

Nodes that share a slot are neighbours. Minimum degree keeps chains, trees and ladders linear. A
body with many nodes would make all of them neighbours of each other; it is split into slots of few
nodes, tied in a row by welds (`schur` of trees of slots stays narrow), so a hub costs as a chain.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["Elimination", "Slots", "eliminate", "split"]

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
    """Split busy bodies into slots.

    Parameters
    ----------
    bodies : int
        Number of moving bodies; the ground is body number `bodies`.
    ends : sequence of tuples
        Bodies that the rows of each node act on, two or more.
    """
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
    ground = len(slots.body)
    at: list[list[tuple[int, int]]] = [[] for _ in range(ground)]
    for node, pair in enumerate(slots.sides):
        for side, slot in enumerate(pair):
            if slot < ground:
                at[slot].append((node, side))
    nodes = len(slots.sides)
    neighbours: list[set[int]] = [set() for _ in range(nodes)]
    for touching in at:
        names = {node for node, _ in touching}
        for node in names:
            neighbours[node] |= names - {node}
    order, columns = _minimum_degree(neighbours)
    place = {node: k for k, node in enumerate(order)}
    below = [sorted(place[m] for m in columns[node]) for node in order]
    more = [(place[m], side) for m in order for side in range(2, len(slots.sides[m]))]
    numbers = {(k, side): 12 * k + 6 * side for k in range(nodes) for side in range(2)}
    numbers |= {which: 12 * nodes + 6 * n for n, which in enumerate(more)}

    base = 3 * nodes
    # of each column the number of the block in each of its rows
    block: list[dict[int, int]] = []
    start = [0]
    rows: list[int] = []
    for later in below:
        block.append(dict(zip(later, range(len(rows), len(rows) + len(later)), strict=True)))
        rows += later
        start.append(len(rows))
    update: list[int] = []
    for later in below:
        columns_of = [block[r] for r in later]
        for n, r in enumerate(later):
            update += [column[r] for column in columns_of[:n]]
    form = []
    for slot, touching in enumerate(at):
        placed = sorted((place[node], side) for node, side in touching)
        for n, (r, side_r) in enumerate(placed):
            for k, side_k in placed[:n]:
                if r != k:
                    a, b = numbers[r, side_r], numbers[k, side_k]
                    form.append((base + 4 * block[k][r], a, b, 3 * slot))
    form.sort()
    table = np.array(form, dtype=np.int64).reshape(-1, 4)

    def ints(values: list[int]) -> np.ndarray:
        return np.array(values, dtype=np.int64)

    blocks = base + 4 * np.arange(len(rows), dtype=np.int64)
    return Elimination(
        order,
        ints(start),
        ints(rows),
        base + 4 * ints(update),
        form_block=np.ascontiguousarray(table[:, 0]),
        form_a=np.ascontiguousarray(table[:, 1]),
        form_b=np.ascontiguousarray(table[:, 2]),
        form_column=np.ascontiguousarray(table[:, 3]),
        form_more=np.diff(table[:, 0], prepend=-1) == 0,
        fill=np.setdiff1d(blocks, table[:, 0]),
        more_node=ints([k for k, _ in more]),
        more_slot=ints([slots.sides[order[k]][side] for k, side in more]),
    )


def _minimum_degree(graph: list[set[int]]) -> tuple[list[int], list[set[int]]]:
    """Order of elimination, and for each node its neighbours when it is eliminated."""
    graph = [set(neighbours) for neighbours in graph]
    waiting = [(len(neighbours), node) for node, neighbours in enumerate(graph)]
    heapq.heapify(waiting)
    done = [False] * len(graph)
    order: list[int] = []
    columns: list[set[int]] = [set() for _ in graph]
    while waiting:
        degree, node = heapq.heappop(waiting)
        if done[node] or degree != len(graph[node]):
            continue
        done[node] = True
        order.append(node)
        columns[node] = graph[node]
        for other in graph[node]:
            graph[other] |= graph[node]
            graph[other] -= {other, node}
        for other in graph[node]:
            heapq.heappush(waiting, (len(graph[other]), other))
    return order, columns
