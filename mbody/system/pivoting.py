"""The symbolic phase of the square case: pivots of Φ_q for mechanisms that drivers determine.

There Φ_q is square, and one LU of it serves position, velocity, acceleration and (transposed)
reactions. Pivots are chosen once, from the numbers of several positions, by Markowitz's rule with a
threshold; where they are worst a second choice may be better. The kernel monitors the growth of the
multipliers, takes the other choice where it is large, and gives a lane up where neither is good.
Pivots are in the diagonal blocks, so that those of a block make its determinant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mbody.core.lanes import aligned
from mbody.kernels.constraints import BY_DIRECTION
from mbody.kernels.layout import Layout, Work, integers
from mbody.kernels.square_lu import Square, SquareWork
from mbody.system.assur_groups import diagonal_blocks

__all__ = ["LARGEST", "PivotChoices", "choose_pivots", "lane_workspace"]

#: Columns up to which a plan is made; the search is quadratic in Python.
LARGEST = 240
#: A pivot is at least this part of the greatest number of its column.
THRESHOLD = 0.1


#: Growth (sum of squares of L) below which one choice of pivots is enough.
EVEN = 30.0
#: Part of the positions, those where the first choice is worst, for which the second is made.
WORST = 0.25

#: Two choices of pivots; twice the same where one is enough.
PivotChoices = tuple[Square, Square]


def choose_pivots(
    L: Layout, here: Work, elsewhere: Work, along: Sequence[np.ndarray] = ()
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
    entries = _entries(L, here, elsewhere, rows)
    matrices = np.zeros((1 + len(along), size, size))
    steady = np.zeros((size, size), dtype=bool)
    present = np.zeros((size, size), dtype=bool)
    for (r, c), (place, value, constant) in entries.items():
        matrices[:, r, c] = [value, *(blocks[place] for blocks in along)]
        steady[r, c] = constant
        present[r, c] = True
    blocks = diagonal_blocks(present)
    if blocks is None:
        return None
    diagonal = _DiagonalBlocks(matrices[0], steady, present, blocks, float(here.size[0, 0]))
    found = _pivots(matrices, steady, present, diagonal.inside)
    if found is None:
        return None
    growth = found[-1]
    one = _lists(entries, rows, diagonal, *found[:-1])
    if growth.max() <= EVEN:
        return one, one
    hard = growth >= np.quantile(growth, 1.0 - WORST)
    found = _pivots(matrices[hard], steady, present, diagonal.inside)
    if found is None or found[-1].max() >= growth.max():
        return one, one
    return one, _lists(entries, rows, diagonal, *found[:-1])


def lane_workspace(choices: PivotChoices, lanes: int) -> SquareWork:
    """Memory for the numbers of the LU, and for two right-hand sides."""
    numbers = max(len(square.target) + len(square.fill) for square in choices)
    memory = aligned(numbers + 2 * len(choices[0].pivot), lanes)
    return SquareWork(factor=memory[:numbers], x=memory[numbers:])


def _entries(
    L: Layout, here: Work, elsewhere: Work, rows: np.ndarray
) -> dict[tuple[int, int], tuple[int, float, bool]]:
    """By (row, column): place in the blocks, value, whether it is constant."""
    found = {}
    # what is constant in a dwell of a cam does not elsewhere
    pieces = set(L.primitive_node[np.isin(L.primitive_kind, BY_DIRECTION)].tolist())
    number = {int(row): n for n, row in enumerate(rows)}
    for k in range(L.nodes):
        for row in range(2):
            if 2 * k + row not in number:
                continue
            sides = [(int(L.node_column[2 * k + n]), 12 * k + 6 * n) for n in range(2)]
            sides += [
                (int(L.more[n, 1]), 12 * L.nodes + 6 * int(n))
                for n in np.flatnonzero(L.more[:, 0] == k)
            ]
            for column, first in sides:
                if column >= 3 * L.slots:
                    continue
                for c in range(3):
                    place = first + 3 * row + c
                    value, other = float(here.block[place, 0]), float(elsewhere.block[place, 0])
                    if value != 0.0 or other != 0.0 or k in pieces:
                        entry = (place, value, value == other and k not in pieces)
                        found[number[2 * k + row], column + c] = entry
    return found


class _DiagonalBlocks:
    """The diagonal blocks of Φ_q, and which of their determinants vary.

    Attributes
    ----------
    inside : array of bool (size, size)
        What is in a diagonal block.
    """

    def __init__(
        self,
        matrix: np.ndarray,
        steady: np.ndarray,
        present: np.ndarray,
        blocks: np.ndarray,
        length: float,
    ) -> None:
        self.rows, self.columns = blocks
        self.inside = self.rows[:, None] == self.columns[None, :]
        moving = present & self.inside & ~steady
        self.varying = np.unique(self.rows[moving.any(axis=1)]).tolist()
        # without units, and as parts of the product of the rows' lengths (Hadamard)
        size = np.tile([length, length, 1.0], len(matrix) // 3)
        self.log_size = np.log(size)
        rows = np.where(self.inside, matrix * size, 0.0)
        self.log_length = np.log(np.maximum(np.linalg.norm(rows, axis=1), 1e-300))

    def scale(self, block: int, pivots: list[tuple[int, int]], sign: float) -> float:
        """What the product of the inverse pivots of a block is multiplied by to be that of its
        determinant; `sign` is that of the pivots that are ±1 for good.
        """
        size = self.log_length[self.rows == block].sum()
        size -= self.log_size[self.columns == block].sum()
        exchanges = _sign([r for r, _ in pivots]) * _sign([c for _, c in pivots])
        return float(exchanges * sign * np.exp(size))


def _sign(order: list[int]) -> int:
    """Sign of a permutation, of numbers in any order."""
    place = np.argsort(order).tolist()
    sign = 1
    for n in range(len(place)):
        while place[n] != n:
            m = place[n]
            place[n], place[m] = place[m], m
            sign = -sign
    return sign


def _pivots(
    matrices: np.ndarray, steady: np.ndarray, present: np.ndarray, inside: np.ndarray
) -> tuple[list[tuple[int, int]], np.ndarray, np.ndarray, np.ndarray] | None:
    """Pivots in order, the filled pattern, which numbers stay constant, and the growth of each."""
    a, constant, pattern = matrices.copy(), steady.copy(), present.copy()
    growth = np.zeros(len(matrices))
    size = len(pattern)
    open_rows, open_columns = np.ones(size, dtype=bool), np.ones(size, dtype=bool)
    pivots: list[tuple[int, int]] = []
    for _ in range(size):
        active = pattern & open_rows[:, None] & open_columns[None, :]
        values = np.abs(a) * active
        greatest = values.max(axis=1, keepdims=True)
        # what a pivot is worth at the worst of the positions
        part = (values / np.maximum(greatest, 1e-300)).min(axis=0)
        there = values > 1e-12 * np.maximum(1.0, greatest.max(axis=2, keepdims=True))
        allowed = (part >= min(THRESHOLD, (part * inside).max())) & there.all(axis=0) & inside
        if not allowed.any():
            return None
        cost = (active.sum(axis=1)[:, None] - 1) * (active.sum(axis=0)[None, :] - 1)
        # of equal cost: constants first, they need no division; then the largest
        key = cost - 0.5 * constant - 0.25 * part
        r, c = np.unravel_index(np.where(allowed, key, np.inf).argmin(), key.shape)
        pivots.append((int(r), int(c)))
        open_rows[r] = open_columns[c] = False
        below = np.flatnonzero(active[:, c] & open_rows)
        right = np.flatnonzero(active[r] & open_columns)
        for i in below:
            f = a[:, i, c] / a[:, r, c]
            growth += f * f
            a[:, i, right] -= f[:, None] * a[:, r, right]
            constant[i, right] = False
            pattern[i, right] = True
    return pivots, pattern, constant & steady, growth


def _lists(
    entries: dict[tuple[int, int], tuple[int, float, bool]],
    rows: np.ndarray,
    diagonal: _DiagonalBlocks,
    pivots: list[tuple[int, int]],
    pattern: np.ndarray,
    constant: np.ndarray,
) -> Square:
    """Index lists of the numeric phase."""
    position = {(int(r), int(c)): n for n, (r, c) in enumerate(np.argwhere(pattern))}
    low, change, left, up, above, entry, group = (_Lists() for _ in range(7))
    unit = [bool(constant[key] and abs(entries[key][1]) == 1.0) for key in pivots]
    scale = []
    for block in diagonal.varying:
        own = [n for n, (r, _) in enumerate(pivots) if diagonal.rows[r] == block]
        sign = math.prod(entries[pivots[n]][1] for n in own if unit[n])
        scale.append(diagonal.scale(block, [pivots[n] for n in own], sign))
        for n in own:
            if not unit[n]:
                group.add(position[pivots[n]], block)
        group.end()
    for k, (r, c) in enumerate(pivots):
        right = [c2 for _, c2 in pivots[k + 1 :] if pattern[r, c2]]
        for r2, _ in pivots[k + 1 :]:
            if pattern[r2, c]:
                low.add(position[r2, c], rows[r2])
                for c2 in right:
                    change.add(position[r2, c2], position[r, c2])
                change.end()
        low.end()
        for c2 in right:
            up.add(position[r, c2], c2)
        up.end()
        for place, (r2, c2) in enumerate(pivots[:k]):
            if pattern[r, c2]:
                left.add(position[r, c2], place)
            if pattern[r2, c]:
                above.add(position[r2, c], place)
        left.end()
        above.end()
        for (r2, c2), (block, _, _) in entries.items():
            if c2 == c:
                entry.add(block, rows[r2])
        entry.end()
    return Square(
        source=integers([place for place, _, _ in entries.values()]),
        target=integers([position[key] for key in entries]),
        fill=integers([n for key, n in position.items() if key not in entries]),
        pivot=integers([position[key] for key in pivots]),
        unit=integers(unit),
        **low.named("low_start", "low", "low_row"),
        **change.named("change_start", "change", "change_by"),
        **left.named("left_start", "left", "left_place"),
        **up.named("up_start", "up", "up_column"),
        **above.named("above_start", "above", "above_place"),
        row=integers([rows[r] for r, _ in pivots]),
        column=integers([c for _, c in pivots]),
        **entry.named("entry_start", "entry", "entry_row"),
        group_start=integers(group.start),
        group=integers(group.one),
        scale=np.array(scale),
    )


class _Lists:
    """Pairs of numbers, list after list, and where each list begins."""

    def __init__(self) -> None:
        self.start, self.one, self.other = [0], list[int](), list[int]()

    def add(self, one: int, other: int) -> None:
        """One pair more in the present list."""
        self.one.append(one)
        self.other.append(other)

    def end(self) -> None:
        """The present list is whole."""
        self.start.append(len(self.one))

    def named(self, start: str, one: str, other: str) -> dict[str, np.ndarray]:
        """The three tables by name."""
        return {start: integers(self.start), one: integers(self.one), other: integers(self.other)}
