"""Layouts and workspaces of what acts: without the fill, or the nodes, of rows that are off.

Rows of contacts that are open are rows of an identity: they have no blocks beside the diagonal, and
elimination works on zeros there. Of many contact candidates where bodies may touch few do, and most
of the work is on zeros. The lists of `mbody.kernels.schur_ldl` without them give the same numbers.
Bodies that are split for rows that are off alone need no slots for these.
"""

from __future__ import annotations

import numpy as np

from mbody.kernels.layout import (
    OF_NODES,
    Layout,
    Work,
    first_beyond,
    frame_of,
    integers,
    inverse_masses,
)
from mbody.system.assembler import eliminate, split
from mbody.system.system import System, welds

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
