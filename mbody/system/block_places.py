"""Where the blocks of Φ_q lie that rows over more bodies than two fill: sums, and formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbody.kernels.constraints import KINDS
from mbody.kernels.layout import first_beyond, integers
from mbody.model.primitives import ConstraintPrimitive
from mbody.system.elimination_order import Elimination

__all__ = ["blocks_of", "sums_of"]


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
