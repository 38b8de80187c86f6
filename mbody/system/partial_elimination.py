"""The elimination of a system some of whose rows are off: what they would fill is left out.

Rows of contacts that are open are rows of an identity: they have no blocks beside the diagonal, and
elimination works on zeros there. Of many spots where bodies may touch few do, and most of the work
is on zeros. The lists of `mbody.kernels.schur_ldl` without them give the same numbers.
"""

from __future__ import annotations

import numpy as np

from mbody.kernels.layout import Layout, integers

__all__ = ["without_nodes"]

Array = np.ndarray


def without_nodes(layout: Layout, off: Array) -> Layout:
    """The layout whose elimination leaves some nodes alone.

    Parameters
    ----------
    layout : Layout
        With its whole elimination.
    off : array (nodes,) of bool
        Nodes whose blocks beside the diagonal are all zero.
    """
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
