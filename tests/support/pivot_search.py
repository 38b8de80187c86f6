"""The symbolic phase written out: one pivot after another from whole matrices, lists number by
number. What `mbody.system.pivoting` finds in compiled code must be the same.
"""

from __future__ import annotations

import numpy as np

from mbody.kernels.constraints import BY_DIRECTION

Array = np.ndarray
#: A pivot is at least this part of the greatest number of its column.
THRESHOLD = 0.1


def entries_of(
    L, here: Array, elsewhere: Array, rows: Array
) -> dict[tuple[int, int], tuple[int, float, bool]]:
    """By (row, column): place in the blocks, value, whether it is constant."""
    found = {}
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
                    value, other = float(here[place]), float(elsewhere[place])
                    if value != 0.0 or other != 0.0 or k in pieces:
                        entry = (place, value, value == other and k not in pieces)
                        found[number[2 * k + row], column + c] = entry
    return found


def pivots_of(
    matrices: Array, steady: Array, present: Array, inside: Array
) -> tuple[list[tuple[int, int]], Array, Array, Array] | None:
    """Pivots in order, the filled pattern, which numbers stay constant, and the growth of each;
    matrices (positions, size, size).
    """
    a, constant, pattern = matrices.copy(), steady.copy(), present.copy()
    growth = np.zeros(len(matrices))
    size = len(pattern)
    open_rows, open_columns = np.ones(size, dtype=bool), np.ones(size, dtype=bool)
    pivots: list[tuple[int, int]] = []
    for _ in range(size):
        active = pattern & open_rows[:, None] & open_columns[None, :]
        values = np.abs(a) * active
        greatest = values.max(axis=1, keepdims=True)
        part = (values / np.maximum(greatest, 1e-300)).min(axis=0)
        there = values > 1e-12 * np.maximum(1.0, greatest.max(axis=2, keepdims=True))
        allowed = (part >= min(THRESHOLD, (part * inside).max())) & there.all(axis=0) & inside
        if not allowed.any():
            return None
        cost = (active.sum(axis=1)[:, None] - 1) * (active.sum(axis=0)[None, :] - 1)
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


def lists_of(
    entries: dict[tuple[int, int], tuple[int, float, bool]],
    rows: Array,
    pivots: list[tuple[int, int]],
    pattern: Array,
    constant: Array,
) -> dict[str, list[int]]:
    """The index lists of `mbody.kernels.square_lu.Square`, those of the determinants left out."""
    position = {(int(r), int(c)): n for n, (r, c) in enumerate(np.argwhere(pattern))}
    names = ("low", "low_row", "change", "change_by", "left", "left_place", "up", "up_column")
    names += ("above", "above_place", "entry", "entry_row")
    found: dict[str, list[int]] = {name: [] for name in names}
    starts = {f"{n}_start": [0] for n in ("low", "change", "left", "up", "above", "entry")}

    def add(first: str, second: str, one: int, other: int) -> None:
        found[first].append(one)
        found[second].append(other)

    def end(name: str) -> None:
        starts[f"{name}_start"].append(len(found[name]))

    for k, (r, c) in enumerate(pivots):
        right = [c2 for _, c2 in pivots[k + 1 :] if pattern[r, c2]]
        for r2, _ in pivots[k + 1 :]:
            if pattern[r2, c]:
                add("low", "low_row", position[r2, c], int(rows[r2]))
                for c2 in right:
                    add("change", "change_by", position[r2, c2], position[r, c2])
                end("change")
        for c2 in right:
            add("up", "up_column", position[r, c2], c2)
        for place, (r2, c2) in enumerate(pivots[:k]):
            if pattern[r, c2]:
                add("left", "left_place", position[r, c2], place)
            if pattern[r2, c]:
                add("above", "above_place", position[r2, c], place)
        for (r2, c2), (block, _, _) in entries.items():
            if c2 == c:
                add("entry", "entry_row", block, int(rows[r2]))
        for name in ("low", "up", "left", "above", "entry"):
            end(name)
    found |= starts
    found["source"] = [place for place, _, _ in entries.values()]
    found["target"] = [position[key] for key in entries]
    found["fill"] = [n for key, n in position.items() if key not in entries]
    found["pivot"] = [position[key] for key in pivots]
    found["unit"] = [int(constant[key] and abs(entries[key][1]) == 1.0) for key in pivots]
    found["row"] = [int(rows[r]) for r, _ in pivots]
    found["column"] = [c for _, c in pivots]
    return found
