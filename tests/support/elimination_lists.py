"""The order of elimination and its lists by the rule written out, number by number."""

from __future__ import annotations

from itertools import combinations

from mbody.system.assembler import Slots


def order_of(slots: Slots) -> tuple[list[int], list[set[int]]]:
    """Minimum degree, of equal degrees the first node; and the neighbours of each in that order."""
    ground, left = len(slots.body), list(range(len(slots.sides)))
    graph = [
        {m for m in left if m != n and (set(slots.sides[n]) & set(slots.sides[m])) - {ground}}
        for n in left
    ]
    order, columns = [], []
    while left:
        node = min(left, key=lambda n: (len(graph[n]), n))
        left.remove(node)
        order.append(node)
        columns.append(graph[node])
        for a, b in combinations(graph[node], 2):
            graph[a].add(b)
            graph[b].add(a)
        for other in graph[node]:
            graph[other].discard(node)
    return order, columns


def lists_of(slots: Slots) -> dict[str, list]:
    """The fields of `Elimination`."""
    order, columns = order_of(slots)
    ground, nodes = len(slots.body), len(slots.sides)
    place = {node: k for k, node in enumerate(order)}
    below = [sorted(place[m] for m in own) for own in columns]
    pairs = [(k, r) for k, later in enumerate(below) for r in later]
    block = {pair: 3 * nodes + 4 * n for n, pair in enumerate(pairs)}
    more = [(place[m], side) for m in order for side in range(2, len(slots.sides[m]))]
    numbers = {(k, side): 12 * k + 6 * side for k in range(nodes) for side in range(2)}
    numbers |= {which: 12 * nodes + 6 * n for n, which in enumerate(more)}
    form = []
    for slot in range(ground):
        at = sorted(
            (place[m], side)
            for m, pair in enumerate(slots.sides)
            for side, own in enumerate(pair)
            if own == slot
        )
        form += [
            (block[a[0], b[0]], numbers[b], numbers[a], 3 * slot)
            for a, b in combinations(at, 2)
            if a[0] != b[0]
        ]
    form.sort()
    formed = [line[0] for line in form]
    return {
        "order": order,
        "node_start": [sum(map(len, below[:k])) for k in range(nodes + 1)],
        "block_row": [r for _, r in pairs],
        "update": [block[a, b] for later in below for n, b in enumerate(later) for a in later[:n]],
        "form_block": formed,
        "form_a": [line[1] for line in form],
        "form_b": [line[2] for line in form],
        "form_column": [line[3] for line in form],
        "form_more": [n > 0 and formed[n - 1] == own for n, own in enumerate(formed)],
        "fill": [number for number in block.values() if number not in formed],
        "more_node": [k for k, _ in more],
        "more_slot": [slots.sides[order[k]][side] for k, side in more],
    }
