"""Diagonal blocks of a square pattern (Assur groups of driven mechanisms): its finest order in
which everything is on the diagonal blocks or on one side of them.

A transversal of the pattern (rows matched with columns) makes a graph of the columns, whose
strongly connected parts are the blocks (Duff, Erisman & Reid, *Direct Methods for Sparse
Matrices*, chapter 6). Each of them has a determinant of its own, and the motion leaves its branch
only where one of these vanishes.
"""

from __future__ import annotations

import numpy as np

from mbody.kernels.square_pivots import divide_blocks

__all__ = ["diagonal_blocks"]


def diagonal_blocks(pattern: np.ndarray) -> np.ndarray | None:
    """Number of the block of every row and of every column, (2, size); None where no transversal
    exists, so that every matrix of this pattern is singular.

    Parameters
    ----------
    pattern : array of bool (size, size)

    >>> diagonal_blocks(np.array([[True, False], [True, True]]))
    array([[0, 1],
           [0, 1]])
    """
    size = len(pattern)
    found = np.empty((2, size), dtype=np.int64)
    present = np.ascontiguousarray(pattern, dtype=np.int64)
    count = divide_blocks(present, found[0], found[1], np.empty((6, size), dtype=np.int64))
    return None if count < 0 else found
