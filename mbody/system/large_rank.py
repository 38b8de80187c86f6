"""Rank of the constraints of large systems: Φ_q as fronts of bodies and of joints."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import violation
from mbody.system.rank import RankCounts
from mbody.system.sparse_rank import Front, SparseRank, sparse_rank
from mbody.system.system import System

__all__ = ["LargeRank", "SparseRows", "large_rank", "row_elements", "sparse_rows"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class SparseRows:
    """The dimensionless Φ_q by blocks of a row and a body, those of a row together.

    Attributes
    ----------
    row, body : arrays of int (blocks,)
    block : array (blocks, 3)
    element : array of int (rows,)
        Joint, coupling or driver of each row, by number.
    """

    row: Array
    body: Array
    block: Array
    element: Array


@dataclass(frozen=True, eq=False)
class LargeRank(RankCounts):
    """Rank of the dimensionless Φ_q at one position, as `Rank`, without dense matrices.

    Attributes
    ----------
    order : array of int (bodies,)
        Bodies in whose order free motions have their leaders, as far as elimination lets them.
    basis : SparseRank
        Its columns are three for each body of `order`.
    parts : SparseRows
        Of these rows.
    zero : float
    """

    order: Array
    basis: SparseRank
    parts: SparseRows
    zero: float

    @property
    def leaders(self) -> Array:
        """The body that leads each free motion (free,)."""
        return np.asarray(self.order[self.basis.free // 3])

    def motions(self, which: Sequence[int] | None = None) -> Array:
        """Free motions by their numbers, of all by default: (motions, coordinates). Each has one
        coordinate 1 that is 0 in all others.
        """
        found = self.basis.null_vectors(which)
        motions = np.empty((len(found), len(self.order), 3))
        motions[:, self.order] = found.reshape(motions.shape)
        return motions.reshape(found.shape)

    def dependencies(self) -> Iterator[Array]:
        """Combinations of rows that vanish, some at a time: (combinations, rows) of length one."""
        if not self.redundant:
            return
        for chunk in self._left.chunks():
            yield chunk / np.linalg.norm(chunk, axis=1)[:, None]

    @functools.cached_property
    def _left(self) -> SparseRank:
        """Null vectors of the transpose: columns are rows of Φ_q, in groups of a joint."""
        parts = self.parts
        widths = np.bincount(parts.element)  # none for an element without rows
        start = np.concatenate([[0], np.cumsum(widths)])
        fronts = []
        sorted_blocks = np.argsort(parts.body, kind="stable")
        ends = np.flatnonzero(np.diff(parts.body[sorted_blocks])) + 1
        for own in np.split(sorted_blocks, ends):
            touched = np.unique(parts.element[parts.row[own]])
            first = np.concatenate([[0], np.cumsum(widths[touched])])
            at = np.searchsorted(touched, parts.element[parts.row[own]])
            column = first[at] + parts.row[own] - start[touched[at]]
            rows = np.zeros((3, int(first[-1])))
            rows[:, column] = parts.block[own].T
            fronts.append(Front(tuple(touched.tolist()), rows))
        return sparse_rank(widths.tolist(), fronts, self.zero)


def row_elements(system: System) -> Array:
    """Of every row its joint, coupling or driver, by number in the order of description: (rows,),
    ascending.
    """
    names = {name: n for n, name in enumerate(system.primitives_of)}
    owner = np.array([names[element.name] for element, _ in system.owners], dtype=np.int64)
    return np.asarray(owner[system.row_table[0]])


def sparse_rows(system: System, work: Work) -> SparseRows:
    """Φ_q at the position in the workspace, rows as in `System.row_table`."""
    violation(system.runtime(), work)
    L = system.layout
    primitive, line, _ = system.row_table
    node, every = L.primitive_node[primitive], np.arange(len(primitive))
    numbers = work.block[:, 0]
    blocks = numbers[: 12 * L.nodes].reshape(-1, 2, 2, 3)
    row, body, block = [every, every], [], []
    for side, bodies in enumerate((L.primitive_i, L.primitive_j)):
        body.append(np.asarray(bodies[primitive], dtype=np.int64))
        block.append(blocks[node, side, line])
    first_rows = {int(k): n for n, k in enumerate(node.tolist()) if line[n] == 0}
    for n, (k, column) in enumerate(L.more):
        if int(k) in first_rows:  # none of what can be on or off
            first = 12 * L.nodes + 6 * n
            row.append(np.array([first_rows[int(k)]]))
            body.append(np.array([L.slot_body[column // 3]]))
            block.append(numbers[None, first : first + 3])
    rows, bodies, values = np.concatenate(row), np.concatenate(body), np.concatenate(block)
    moving = bodies < L.bodies
    order = np.flatnonzero(moving)[np.lexsort((bodies[moving], rows[moving]))]
    values = values * np.array([system.length, system.length, 1.0])
    values *= system.row_units[rows][:, None]
    return SparseRows(rows[order], bodies[order], values[order], row_elements(system))


def large_rank(parts: SparseRows, rows: int, order: Sequence[int], zero: float) -> LargeRank:
    """Rank of the first rows; free motions are led by the first bodies of an order where that can
    be. What is left of a column below the part `zero` of the greatest block counts as none.
    """
    bodies = len(order)
    kept = parts.row < rows
    own = SparseRows(parts.row[kept], parts.body[kept], parts.block[kept], parts.element[:rows])
    place = np.empty(bodies, dtype=np.int64)
    place[np.asarray(order, dtype=np.int64)] = np.arange(bodies)
    floor = zero * max(1.0, float(np.abs(own.block).max(initial=0.0)))
    fronts = []
    # rows of one element that touch the same bodies are one front
    ends = np.flatnonzero(np.diff(own.element[own.row])) + 1
    for blocks in np.split(np.arange(len(own.row)), ends) if len(own.row) else []:
        groups = np.unique(place[own.body[blocks]])
        lines = np.unique(own.row[blocks])
        matrix = np.zeros((len(lines), len(groups), 3))
        line = np.searchsorted(lines, own.row[blocks])
        group = np.searchsorted(groups, place[own.body[blocks]])
        np.add.at(matrix, (line, group), own.block[blocks])
        fronts.append(Front(tuple(groups.tolist()), matrix.reshape(len(lines), -1)))
    basis = sparse_rank([3] * bodies, fronts, floor)
    return LargeRank(
        3 * bodies, rows, basis.rank, np.asarray(order, dtype=np.int64), basis, own, floor
    )
