"""Rank, free motions and redundant rows of large systems: orthogonal elimination, body by body.

Columns of a sparse matrix are eliminated in groups of few (the coordinates of a body) by
Householder's reflections of the rows that touch them (multifrontal, as of Duff & Reid 1983); what
is left of these rows is one front on the neighbours. A column without a pivot is free. The order is
minimum degree, of equal degrees the last group first, so that free columns are near the beginning.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

__all__ = ["Front", "SparseRank", "sparse_rank"]

Array = np.ndarray
#: Columns that are pivots, columns that are free, the rows of the pivots after all reflections, and
#: the vectors of these, each of length √2 or zero.
_Reflected: TypeAlias = "tuple[list[int], list[int], Array, Array]"

#: A column is preferred as a pivot while it is at least this part of the greatest that is left.
PREFERRED = 0.1
#: Null vectors that are solved at once.
CHUNK = 128


@dataclass(frozen=True, eq=False)
class Front:
    """Rows of a sparse matrix that touch the same groups of columns.

    Attributes
    ----------
    groups : tuple of int
    rows : array (rows, columns of these groups)
    """

    groups: tuple[int, ...]
    rows: Array


@dataclass(frozen=True, eq=False)
class _EliminationStep:
    """Columns that a step has eliminated: x[pivots] = factor @ x[others] for every null vector."""

    pivots: Array
    others: Array
    factor: Array


@dataclass(frozen=True, eq=False)
class SparseRank:
    """Rank of a sparse matrix, and its null vectors, which are solved when they are wanted.

    Attributes
    ----------
    columns, rank : int
    free : array of int
        Columns without a pivot: null vector n is 1 in column ``free[n]`` and 0 in all others free.
    kept, dropped : float
        The least pivot, and the greatest part of a column that was taken for zero.
    """

    columns: int
    rank: int
    free: Array
    kept: float
    dropped: float
    steps: tuple[_EliminationStep, ...]

    def null_vectors(self, which: Array | Sequence[int] | None = None) -> Array:
        """Null vectors by their numbers, of all by default: (vectors, columns)."""
        numbers = np.arange(len(self.free)) if which is None else np.asarray(which, dtype=np.int64)
        x = np.zeros((self.columns, len(numbers)))
        x[self.free[numbers], np.arange(len(numbers))] = 1.0
        for step in reversed(self.steps):
            x[step.pivots] = step.factor @ x[step.others]
        return np.ascontiguousarray(x.T)

    def chunks(self) -> Iterator[Array]:
        """All null vectors, some at a time: (vectors, columns) each."""
        for first in range(0, len(self.free), CHUNK):
            yield self.null_vectors(range(first, min(first + CHUNK, len(self.free))))


def sparse_rank(widths: Sequence[int], fronts: Sequence[Front], zero: float) -> SparseRank:
    """Rank of a matrix of fronts.

    Parameters
    ----------
    widths : sequence of int
        Columns of each group; within a group the first are preferred as pivots.
    fronts : sequence of Front
    zero : float
        What is left of a column counts as zero below this.
    """
    return _Elimination(widths, fronts, zero).rank()


class _Elimination:
    """Fronts that are alive, by group and by number."""

    def __init__(self, widths: Sequence[int], fronts: Sequence[Front], zero: float) -> None:
        self.widths, self.zero = list(widths), zero
        ends = np.cumsum(self.widths, dtype=np.int64)
        self.count = int(ends[-1])
        #: The columns of each group.
        self.columns = np.split(np.arange(self.count), ends[:-1])
        self.fronts = dict(enumerate(fronts))
        self.at: list[set[int]] = [set() for _ in self.widths]
        for n, front in self.fronts.items():
            for group in front.groups:
                self.at[group].add(n)
        self.steps: list[_EliminationStep] = []
        self.free: list[int] = []
        self.kept, self.dropped = np.inf, 0.0

    def rank(self) -> SparseRank:
        """Eliminate all groups."""
        degrees = [self._degree(group) for group in range(len(self.widths))]
        waiting = [(degree, -group) for group, degree in enumerate(degrees)]
        heapq.heapify(waiting)
        done = [False] * len(degrees)
        while waiting:
            degree, group = heapq.heappop(waiting)
            group = -group
            if done[group] or degree != degrees[group]:
                continue
            done[group] = True
            for other in self._eliminate(group):
                degrees[other] = self._degree(other)
                heapq.heappush(waiting, (degrees[other], -other))
        free = np.array(sorted(self.free), dtype=np.int64)
        rank = self.count - len(free)
        return SparseRank(self.count, rank, free, self.kept, self.dropped, tuple(self.steps))

    def _degree(self, group: int) -> int:
        return len(set().union(*(self.fronts[n].groups for n in self.at[group])))

    def _eliminate(self, group: int) -> list[int]:
        """One group; gives its neighbours."""
        own = [self.fronts.pop(n) for n in sorted(self.at[group])]
        touched = self.at[group]
        neighbours = sorted(set().union(*(front.groups for front in own)) - {group})
        for other in neighbours:
            self.at[other] -= touched
        matrix, columns = self._assembled(own, [group, *neighbours])
        left = self._pivots(matrix, columns, self.widths[group])
        if len(left) > left.shape[1]:
            left = np.asarray(np.linalg.qr(left, mode="r"))
        if left.size:
            number = -1 - group
            self.fronts[number] = Front(tuple(neighbours), left)
            for other in neighbours:
                self.at[other].add(number)
        return neighbours

    def _assembled(self, own: Sequence[Front], groups: Sequence[int]) -> tuple[Array, Array]:
        """The rows of fronts under each other, and the columns of groups."""
        place, wide = {}, 0
        for group in groups:
            place[group] = wide
            wide += self.widths[group]
        matrix = np.zeros((sum(len(front.rows) for front in own), wide))
        row = 0
        for front in own:
            end, column = row + len(front.rows), 0
            for group in front.groups:
                width = self.widths[group]
                at = place[group]
                matrix[row:end, at : at + width] += front.rows[:, column : column + width]
                column += width
            row = end
        return matrix, np.concatenate([self.columns[group] for group in groups])

    def _pivots(self, matrix: Array, columns: Array, width: int) -> Array:
        """Triangular in the first columns by reflections; gives the rows without a pivot."""
        own, rest = matrix[:, :width], matrix[:, width:]
        found = self._in_order(own)
        if found is None:
            found = self._by_size(own)
        pivots, free, triangle, reflections = found
        self.free += columns[free].tolist()
        rank = len(pivots)
        if not rank:
            return rest
        _reflect(rest, reflections)
        right = np.hstack([triangle[:, free], rest[:rank]]) if free else rest[:rank].copy()
        left = triangle[:, pivots].tolist()
        # numbers of few rows: from the last on
        for k in reversed(range(rank)):
            for n in range(k + 1, rank):
                right[k] += left[k][n] * right[n]
            right[k] *= -1.0 / left[k][k]
        others = columns[width:]
        if free:
            others = np.concatenate([columns[free], others])
        self.steps.append(_EliminationStep(columns[pivots], others, right))
        return rest[rank:]

    def _in_order(self, own: Array) -> _Reflected | None:
        """Columns as pivots in their order, where each is preferred when its turn comes, by LAPACK;
        None where one is not.
        """
        rows, width = own.shape
        rank = min(rows, width)
        if not rank:
            return None
        raw, scales = np.linalg.qr(own, mode="raw")
        rows_of = raw[:, :rank].tolist()
        kept = self.kept
        for k in range(rank):
            # what is left of the squares of the columns
            left = [sum(x * x for x in own[k : n + 1]) for n, own in enumerate(rows_of) if n >= k]
            greatest = math.sqrt(max(left))
            if not greatest > self.zero or left[0] < (PREFERRED * greatest) ** 2:
                return None
            kept = min(kept, greatest)
        self.kept = kept
        triangle, reflections = raw[:, :rank].T.copy(), raw[:rank].copy()
        for k, scale in enumerate(scales.tolist()):
            triangle[k, :k], reflections[k, :k], reflections[k, k] = 0.0, 0.0, 1.0
            reflections[k] *= math.sqrt(scale)
        return list(range(rank)), list(range(rank, width)), triangle, reflections

    def _by_size(self, own: Array) -> _Reflected:
        """The same, one after the other, of those that are left the first that is large enough."""
        own, open_columns = own.copy(), list(range(own.shape[1]))
        pivots: list[int] = []
        reflections: list[Array] = []
        while open_columns:
            rank = len(pivots)
            part = own[rank:, open_columns]
            sizes = np.sqrt(np.einsum("ij,ij->j", part, part))
            greatest = float(sizes.max(initial=0.0))
            if not greatest > self.zero:
                self.dropped = max(self.dropped, greatest)
                break
            self.kept = min(self.kept, greatest)
            n = int(np.argmax(sizes >= PREFERRED * greatest))
            v = np.zeros(len(own))
            v[rank:] = part[:, n]
            v[rank] += float(sizes[n]) if v[rank] >= 0.0 else -float(sizes[n])
            v /= np.sqrt(0.5 * (v @ v))
            own -= v[:, None] * (v @ own)
            reflections.append(v)
            pivots.append(open_columns.pop(n))
        return pivots, open_columns, own[: len(pivots)], np.array(reflections)


def _reflect(rows: Array, reflections: Array) -> None:
    """Apply reflections I − v vᵀ, the rows v of V (reflections, rows), one after the other to rows,
    in place: together they are I − Vᵀ T V (Schreiber & Van Loan 1989).
    """
    count, gram = len(reflections), (reflections @ reflections.T).tolist()
    T = [[float(n == k) for k in range(count)] for n in range(count)]
    for n in range(1, count):
        for k in range(n):
            T[n][k] = -sum(gram[n][m] * T[m][k] for m in range(k, n))
    rows -= reflections.T @ (np.array(T) @ (reflections @ rows))
