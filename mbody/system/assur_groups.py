"""Diagonal blocks of a square pattern (Assur groups of driven mechanisms): its finest order in
which everything is on the diagonal blocks or on one side of them.

A transversal of the pattern (rows matched with columns) makes a graph of the columns, whose
strongly connected parts are the blocks (Duff, Erisman & Reid, *Direct Methods for Sparse
Matrices*, chapter 6). Each of them has a determinant of its own, and the motion leaves its branch
only where one of these vanishes.
"""

from __future__ import annotations

import numpy as np

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
    row_of = _transversal(pattern)
    if row_of is None:
        return None
    # column c needs those that are in its row; reached in ever more steps
    reached = pattern[row_of] | np.eye(len(pattern), dtype=bool)
    while True:
        further = (reached.astype(np.float32) @ reached.astype(np.float32)) > 0.0
        if (further == reached).all():
            break
        reached = further
    both = reached & reached.T
    first = both.argmax(axis=1)
    columns = np.unique(first, return_inverse=True)[1].reshape(-1)
    rows = np.empty_like(columns)
    rows[row_of] = columns
    return np.array([rows, columns])


def _transversal(pattern: np.ndarray) -> np.ndarray | None:
    """The row that is matched with every column, by augmenting paths; None where there is none."""
    size = len(pattern)
    row_of = np.full(size, -1)
    column_of = np.full(size, -1)
    there = [np.flatnonzero(row).tolist() for row in pattern]
    for start in range(size):
        seen = np.zeros(size, dtype=bool)
        came: dict[int, int] = {}
        waiting, end = [start], -1
        while waiting and end < 0:
            row = waiting.pop()
            for column in there[row]:
                if not seen[column]:
                    seen[column] = True
                    came[column] = row
                    if row_of[column] < 0:
                        end = column
                        break
                    waiting.append(int(row_of[column]))
        if end < 0:
            return None
        while end >= 0:
            row = came[end]
            row_of[end], column_of[row], end = row, end, int(column_of[row])
    return row_of
