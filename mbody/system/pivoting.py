"""The symbolic phase of the square case: pivots of Φ_q for mechanisms that drivers determine.

There Φ_q is square, and one LU of it serves position, velocity, acceleration and (transposed)
reactions. Pivots are chosen once, from the numbers of several positions, by Markowitz's rule with a
threshold (`mbody.kernels.square_pivots`); where they are worst a second choice may be better. The
kernel monitors the growth of the multipliers, takes the other choice where it is large, and gives a
lane up where neither is good. Pivots are in the diagonal blocks, so that those of a block make its
determinant.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.lanes import aligned
from mbody.core.tolerances import PIVOT_GROWTH_EVEN, TINY
from mbody.kernels.constraints import BY_DIRECTION
from mbody.kernels.layout import Layout, Work, integers
from mbody.kernels.square_lu import PivotSearch, Square, SquareWork, divide_blocks, search_pivots

# -- Diagonal blocks of a square pattern (Assur groups of driven mechanisms) -------------------
# A transversal of the pattern (rows matched with columns) makes a graph of the columns, whose
# strongly connected parts are the blocks (Duff, Erisman & Reid, *Direct Methods for Sparse
# Matrices*, chapter 6). Each of them has a determinant of its own, and the motion leaves its branch
# only where one of these vanishes.


def diagonal_blocks(pattern: np.ndarray) -> np.ndarray | None:
    """Number of the block of every row and of every column, (2, size); None where no transversal
    exists, so that every matrix of this pattern is singular. `pattern` (size, size).

    >>> diagonal_blocks(np.array([[True, False], [True, True]]))
    array([[0, 1],
           [0, 1]])
    """
    size = len(pattern)
    found = np.empty((2, size), dtype=np.int64)
    present = np.ascontiguousarray(pattern, dtype=np.int64)
    count = divide_blocks(present, found[0], found[1], np.empty((6, size), dtype=np.int64))
    return None if count < 0 else found


#: Columns up to which a plan is made; the search is quadratic, and dense.
LARGEST = 240
#: Part of the positions, those where the first choice is worst, for which the second is made.
WORST = 0.25

#: Numbers of the search that each thread keeps memory for.
KEPT = 2_000_000

_memory = threading.local()

#: Two choices of pivots; twice the same where one is enough.
PivotChoices = tuple[Square, Square]


def choose_pivots(
    L: Layout, here: Work, elsewhere: Work, along: Sequence[np.ndarray] | np.ndarray = ()
) -> PivotChoices | None:
    """Pivots and index lists for Φ_q in the blocks of `here`; None where it is not square, too
    large, or singular.

    `elsewhere` is at another position and of other numbers: what is the same there is taken as
    constant, what is zero in both as never there. `along`: the blocks at further positions, where
    the pivots are to be good too.
    """
    size = 3 * L.slots
    rows = np.flatnonzero(here.pad[: 2 * L.nodes, 0] == 0.0)
    if len(rows) != size or size > LARGEST:
        return None
    entries = _entries(L, here, elsewhere.block[:, 0], rows)
    at = entries.row, entries.column
    values = entries.value[:, None]
    if len(along):
        values = np.hstack([values, np.asarray(along)[:, entries.place].T])
    values *= entries.unit[:, None]
    steady = np.zeros((size, size), dtype=bool)
    present = np.zeros((size, size), dtype=bool)
    steady[at], present[at] = entries.constant, True
    blocks = diagonal_blocks(present)
    if blocks is None:
        return None
    first = np.zeros((size, size))
    first[at] = entries.value
    diagonal = _DiagonalBlocks(first, steady, present, blocks, entries.columns)
    found = _pivots(at, values, steady, present, diagonal.inside)
    if found is None:
        return None
    growth = found[-1]
    one = _lists(entries, rows, diagonal, *found[:-1])
    if growth.max() <= PIVOT_GROWTH_EVEN:
        return one, one
    hard = growth >= np.quantile(growth, 1.0 - WORST)
    found = _pivots(at, values[:, hard], steady, present, diagonal.inside)
    if found is None or found[-1].max() >= growth.max():
        return one, one
    return one, _lists(entries, rows, diagonal, *found[:-1])


def lane_workspace(choices: PivotChoices, lanes: int) -> SquareWork:
    """Memory for the numbers of the LU, and for two right-hand sides."""
    numbers = max(len(square.target) + len(square.fill) for square in choices)
    memory = aligned(numbers + 2 * len(choices[0].pivot), lanes)
    return SquareWork(factor=memory[:numbers], x=memory[numbers:])


@dataclass(frozen=True, eq=False)
class _Entries:
    """The numbers of Φ_q that are there: row and column in it, place in the blocks, value, whether
    it is constant, and what takes its unit off; the units of all rows and columns.
    """

    row: np.ndarray
    column: np.ndarray
    place: np.ndarray
    value: np.ndarray
    constant: np.ndarray
    unit: np.ndarray
    rows: np.ndarray
    columns: np.ndarray


def _entries(L: Layout, work: Work, elsewhere: np.ndarray, rows: np.ndarray) -> _Entries:
    """In the order of the nodes, their rows, sides and columns."""
    here = work.block[:, 0]
    sides = np.arange(2 * L.nodes)
    node = np.concatenate([sides // 2, L.more[:, 0]])
    column = np.concatenate([L.node_column, L.more[:, 1]])
    # (sides, rows, columns)
    place = 6 * np.arange(len(node))[:, None, None] + np.arange(6).reshape(2, 3)
    # what is constant in a dwell of a cam does not elsewhere
    pieces = np.isin(node, L.primitive_node[np.isin(L.primitive_kind, BY_DIRECTION)])
    number = np.full(2 * L.nodes, -1)
    number[rows] = np.arange(len(rows))
    shape = place.shape
    row = np.broadcast_to(number[2 * node[:, None] + np.arange(2)][:, :, None], shape)
    across = np.broadcast_to((column[:, None] + np.arange(3))[:, None, :], shape)
    value, other = here[place], elsewhere[place]
    varies = np.broadcast_to(pieces[:, None, None], shape)
    there = (value != 0.0) | (other != 0.0) | varies
    there &= (row >= 0) & (column < 3 * L.slots)[:, None, None]
    side, which, c = np.nonzero(there)
    order = np.lexsort((c, side, which, node[side]))
    at = side[order], which[order], c[order]
    row, across, value, constant = row[at], across[at], value[at], (value == other)[at]
    # units of lengths: rows by their weights, welds of a body's slots by those of its coordinates
    columns = 1.0 / np.sqrt(work.weight[: 3 * L.slots, 0])
    units = 1.0 / np.sqrt(np.maximum(work.regularization_weight[rows, 0], TINY))
    weld = work.regularization_weight[rows[row], 0] == 0.0
    units[row[weld]] = columns[across[weld]]
    unit = units[row] / columns[across]
    return _Entries(row, across, place[at], value, constant & ~pieces[at[0]], unit, units, columns)


class _DiagonalBlocks:
    """The diagonal blocks of Φ_q, and which of their determinants vary.

    `inside` (size, size): What is in a diagonal block.
    """

    def __init__(
        self,
        matrix: np.ndarray,
        steady: np.ndarray,
        present: np.ndarray,
        blocks: np.ndarray,
        units: np.ndarray,
    ) -> None:
        self.rows, columns = blocks
        self.inside = self.rows[:, None] == columns[None, :]
        moving = present & self.inside & ~steady
        #: Numbers of the blocks whose determinants vary.
        self.varying = np.unique(self.rows[moving.any(axis=1)]).tolist()
        # without units, and as parts of the product of the rows' lengths (Hadamard)
        rows = np.where(self.inside, matrix / units, 0.0)
        length = np.maximum(np.sqrt((rows * rows).sum(axis=1)), TINY)
        #: Of each of these by what the product of the inverse pivots is multiplied to be that of
        #: the determinant, without the sign of the exchanges.
        self.scale = [
            float((length[self.rows == block] * units[columns == block]).prod())
            for block in self.varying
        ]


def _sign(order: np.ndarray) -> int:
    """Sign of a permutation, of numbers in any order, by its cycles."""
    following = np.argsort(order).tolist()
    sign = 1
    for n in range(len(following)):
        # each exchange puts one number in its place
        while following[n] != n:
            other = following[n]
            following[n], following[other] = following[other], other
            sign = -sign
    return sign


def _pivots(
    at: tuple[np.ndarray, np.ndarray],
    values: np.ndarray,
    steady: np.ndarray,
    present: np.ndarray,
    inside: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Pivots in order, (size, 2), the filled pattern, which numbers stay constant, and the growth
    at every position; values (entries, positions) of the entries at these rows and columns.
    """
    size, positions = len(present), values.shape[1]
    numbers = _zeros(size * size, positions)
    numbers[at[0] * size + at[1]] = values
    memory = np.empty((3, positions))
    counts = np.empty((4, size), dtype=np.int64)
    search = PivotSearch(
        numbers=numbers,
        pattern=present.astype(np.int64),
        constant=steady.astype(np.int64),
        inside=inside.astype(np.int64),
        order=np.empty((size, 2), dtype=np.int64),
        growth=np.empty(positions),
        rows_of=np.empty((size, size), dtype=np.int64),
        worth=np.empty((size, size)),
        greatest=np.empty((size, positions)),
        **dict(zip(("count", "open", "stale", "width"), counts, strict=True)),
        **dict(zip(("least", "factor", "product"), memory, strict=True)),
        best=np.zeros(size),
    )
    found, pattern = search_pivots(search), search.pattern != 0
    numbers[pattern.reshape(-1)] = 0.0
    _keep_zeros(numbers)
    if found < size:
        return None
    return search.order, pattern, (search.constant != 0) & steady, search.growth


def _zeros(rows: int, positions: int) -> np.ndarray:
    """Zeros (rows, positions), in the memory of the search before: most of it is never written to,
    and fresh memory takes longer than the search.
    """
    count = rows * positions
    # taken away, so that a search that is interrupted leaves nothing
    kept: np.ndarray | None = _memory.__dict__.pop("zeros", None)
    if kept is None or len(kept) < count:
        kept = np.zeros(count)
    return kept[:count].reshape(rows, positions)


def _keep_zeros(numbers: np.ndarray) -> None:
    """Keep the memory of `_zeros`, which is zero again."""
    whole: Any = numbers.base
    if whole.size <= KEPT:
        _memory.zeros = whole


def _lists(
    entries: _Entries,
    rows: np.ndarray,
    diagonal: _DiagonalBlocks,
    pivots: np.ndarray,
    pattern: np.ndarray,
    constant: np.ndarray,
) -> Square:
    """Index lists of the numeric phase."""
    size = len(pivots)
    r, c = pivots[:, 0], pivots[:, 1]
    # number of everything in F, and the same in the order of the pivots
    number = np.cumsum(pattern.reshape(-1)).reshape(size, size) - 1
    numbers, there = number[r][:, c], pattern[r][:, c]
    values = np.zeros((size, size))
    values[entries.row, entries.column] = entries.value
    own = values[r, c]
    unit = constant[r, c] & (np.abs(own) == 1.0)
    block = diagonal.rows[r]
    scale, group, group_start = [], [], [0]
    for which, factor in zip(diagonal.varying, diagonal.scale, strict=True):
        pivot = np.flatnonzero(block == which)
        sign = _sign(r[pivot]) * _sign(c[pivot]) * own[pivot[unit[pivot]]].prod()
        scale.append(sign * factor)
        group.append(number[r, c][pivot[~unit[pivot]]])
        group_start.append(group_start[-1] + len(group[-1]))
    k, j = np.nonzero(there)
    k_up, right = k[k < j], j[k < j]
    k_left, left = k[k > j], j[k > j]
    across_first = np.argsort(j, kind="stable")
    j, k = j[across_first], k[across_first]
    k_low, below = j[k > j], k[k > j]
    k_above, above = j[k < j], k[k < j]
    up_start = _starts(k_up, size)
    # each number below a pivot changes all that are right of the pivot
    many = np.diff(up_start)[k_low]
    change_start = np.concatenate([[0], np.cumsum(many)])
    which = np.repeat(np.arange(len(k_low)), many)
    across = right[up_start[k_low][which] + np.arange(len(which)) - change_start[which]]
    missing = pattern.copy()
    missing[entries.row, entries.column] = False
    by_column = np.argsort(_places(c)[entries.column], kind="stable")
    return Square(
        source=integers(entries.place),
        target=integers(number[entries.row, entries.column]),
        fill=integers(number[missing]),
        pivot=integers(number[r, c]),
        unit=integers(unit),
        low_start=_starts(k_low, size),
        low=integers(numbers[below, k_low]),
        low_row=integers(rows[r[below]]),
        low_unit=(entries.rows[r[below]] / entries.rows[r[k_low]]) ** 2,
        change_start=integers(change_start),
        change=integers(numbers[below[which], across]),
        change_by=integers(numbers[k_low[which], across]),
        left_start=_starts(k_left, size),
        left=integers(numbers[k_left, left]),
        left_place=integers(left),
        up_start=up_start,
        up=integers(numbers[k_up, right]),
        up_column=integers(c[right]),
        above_start=_starts(k_above, size),
        above=integers(numbers[above, k_above]),
        above_place=integers(above),
        row=integers(rows[r]),
        column=integers(c),
        row_unit=entries.rows[r] ** 2,
        entry_start=_starts(_places(c)[entries.column], size),
        entry=integers(entries.place[by_column]),
        entry_row=integers(rows[entries.row[by_column]]),
        group_start=integers(group_start),
        group=integers(np.concatenate([*group, np.zeros(0, dtype=np.int64)])),
        scale=np.array(scale),
    )


def _places(order: np.ndarray) -> np.ndarray:
    """Place of each number of a permutation."""
    found = np.empty_like(order)
    found[order] = np.arange(len(order))
    return found


def _starts(owner: np.ndarray, size: int) -> np.ndarray:
    """Beginning of the list of each of so many owners, and the end of the last."""
    return integers(np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=size))]))
