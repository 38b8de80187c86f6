"""Numbers of the nodes that no position changes."""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from mbody.kernels.layout import Layout

__all__ = ["fixed_rows"]


def fixed_rows(
    layout: Layout, row_kinds: Sequence[str], switched: Container[int], length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Proximal terms, identity rows, and blocks of the welds of one body's slots, each (rows, 1):
    equal x and y, then equal angle.

    Parameters
    ----------
    row_kinds : sequence of str
        By primitive a letter for each of its rows, "l" for lengths.
    switched : container of int
        Primitives that can be on or off.
    length : float
        Model length.
    """
    L = layout
    weights, pad, blocks = (np.zeros((size * L.nodes, 1)) for size in (2, 2, 12))
    pairs = zip(row_kinds, L.primitive_node, strict=True)
    for e, (kinds, node) in enumerate(pairs):
        for row in range(2):
            if row < len(kinds) and e not in switched:
                weights[2 * node + row] = 1.0 if kinds[row] == "l" else length**-2
            else:
                pad[2 * node + row] = 1.0
    seen: set[tuple[int, int]] = set()
    for node in np.setdiff1d(np.arange(L.nodes), L.primitive_node):
        o = 12 * node
        pair = (int(L.node_column[2 * node]), int(L.node_column[2 * node + 1]))
        if pair not in seen:
            seen.add(pair)
            blocks[[o, o + 4]], blocks[[o + 6, o + 10]] = 1.0, -1.0
        else:
            blocks[o + 2], blocks[o + 8] = 1.0, -1.0
            pad[2 * node + 1] = 1.0
    return weights, pad, blocks
