"""Rank of the constraints, free motions, redundant rows, by dense linear algebra.

It serves reports and errors; the kernels never need it.
"""

from __future__ import annotations

import functools
import heapq
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.least_squares import least_squares
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import violation
from mbody.system.system import System

Array = np.ndarray
#: Rows from which on independent ones are recognised by Householder's reflections first, and the
#: steps of inverse iteration for their least singular value.
LARGE, ITERATIONS = 100, 6


@dataclass(frozen=True, eq=False)
class RankCounts:
    """Numbers of coordinates (three a body), rows (of joints and drivers) and independent rows."""

    coordinates: int
    rows: int
    rank: int

    @property
    def free(self) -> int:
        """Degrees of freedom that are left."""
        return self.coordinates - self.rank

    @property
    def redundant(self) -> int:
        """Rows beyond the independent ones."""
        return self.rows - self.rank


@dataclass(frozen=True, eq=False)
class Rank(RankCounts):
    """Rank of the dimensionless Φ_q at one position.

    `motions` (free, coordinates): Free motions, orthonormal, lengths by the model length.
    `dependencies` (redundant, rows): Combinations of dimensionless rows that vanish, orthonormal.
    """

    motions: np.ndarray
    dependencies: np.ndarray


def jacobian(system: System, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """Φ (rows,) and Φ_q (rows, coordinates) at the position in the workspace, with their units.

    Rows as in `System.row_table`; the signals must be set.
    """
    violation(system.runtime(), work)
    return work.phi[system.row_numbers, 0], joint_rows(system, work.block[:, 0])


def joint_rows(system: System, block: np.ndarray) -> np.ndarray:
    """Φ_q (rows, coordinates, …) by the numbers of the blocks (numbers, …) of a workspace."""
    places, numbers, more = system.once("places of rows", lambda: _row_places(system))
    rows, width = len(system.row_table[0]), 3 * (system.layout.bodies + 1)
    lanes = block.shape[1:]
    G = np.zeros((rows * width, *lanes))
    G[places] = block[numbers]
    for place, first in more:
        G[place : place + 3] += block[first : first + 3]
    return G.reshape(rows, width, *lanes)[:, :-3]


def _row_places(system: System) -> tuple[np.ndarray, np.ndarray, list[tuple[int, int]]]:
    """Place in Φ_q, row by row with the ground as last body, of each number of the blocks: places
    and numbers, no place twice, then (place, number) of three numbers each that are added.
    """
    L = system.layout
    primitive, row, _ = system.row_table
    every, width = np.arange(len(primitive)), 3 * (L.bodies + 1)
    node = L.primitive_node[primitive]
    bodies = np.column_stack([L.primitive_i[primitive], L.primitive_j[primitive]])
    place = width * every[:, None] + 3 * bodies
    number = 12 * node[:, None] + 6 * np.arange(2) + 3 * row[:, None]
    more = [
        (width * int(line) + 3 * int(L.slot_body[column // 3]), 12 * L.nodes + 6 * n)
        for n, (k, column) in enumerate(L.more)
        for line in np.flatnonzero((node == k) & (row == 0))  # none of the active set
    ]
    both = bodies[:, 0] == bodies[:, 1]  # two sides of one body add up
    more += list(zip(place[both, 1].tolist(), number[both, 1].tolist(), strict=True))
    own = np.column_stack([np.ones(len(both), dtype=bool), ~both])
    three = np.arange(3)
    return (place[own][:, None] + three).ravel(), (number[own][:, None] + three).ravel(), more


def dense(system: System, work: Work, x: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Dimensionless Φ (…, rows) and Φ_q (…, rows, coordinates), lengths by the model length: at
    positions x (…, coordinates) without units, one by one or stacked, or where the workspace is.
    """
    if x is None or x.ndim == 1:
        if x is not None:
            work.q[: len(x), 0] = x * system.coordinate_units
        phi, G = jacobian(system, work)
    else:
        layout, own = system.runtime(), work.q[: x.shape[1], 0]
        every, blocks = np.empty((len(x), len(work.phi))), np.empty((len(x), len(work.block)))
        phi, block = work.phi[:, 0], work.block[:, 0]
        for k, one in enumerate(x * system.coordinate_units):
            own[:] = one
            violation(layout, work)
            every[k], blocks[k] = phi, block
        phi, G = every[:, system.row_numbers], joint_rows(system, blocks.T).transpose(2, 0, 1)
    return system.row_units * phi, np.multiply(system.jacobian_units, G, order="C")


# -- Positions at which rows vanish ------------------------------------------------------------

#: Corrections of one closing, at most: near a singular position each halves the distance to it.
CORRECTIONS = 24


class ClosedRows(NamedTuple):
    """Where rows were closed.

    `x` (…, coordinates): Positions without units; where they did not close, the last ones.
    `good` (…): Whether all rows vanish there, those that are held included.
    `G` (…, rows, coordinates): Φ_q there but for rounding, without what is held.
    """

    x: Array
    good: Array
    G: Array


def close_rows(
    rows: Callable[[Array], tuple[Array, Array]],
    x: Array,
    held: tuple[Array, Array] | None = None,
    *,
    zero: float = tol.SINGULAR_VALUE_ZERO,
) -> ClosedRows:
    """The positions near x (coordinates,) or (positions, coordinates) at which rows vanish, by
    Newton steps of least norm; none turns a body by more than half a radian.

    `rows`: Φ and Φ_q of such x, all without units. `held`: Directions (…, coordinates) and the
    values of their products with x. `zero`: Singular values below this part of the greatest count
    as none, so that rows which depend on others have no say. Rows that cannot all vanish are left
    where the steps end.
    """
    y, left, last, inverse = x, np.arange(len(x)), np.inf, np.empty(0)
    frames, values = (x, x) if held is None else held
    for n in range(CORRECTIONS):
        phi, G = rows(y)
        own = G
        if held is not None:
            phi = np.concatenate([phi, _times(frames, y) - values], axis=-1)
            G = np.concatenate([G, frames], axis=-2)
        worst, norm = _greatest(phi), 1.0 + _greatest(y)
        # a distance of zero has no direction
        on = np.isfinite(worst + G.sum(axis=(-2, -1))) & ((worst < 1e3 * norm) | (n == 0))
        near = worst <= tol.LOOP_CLOSURE_RESIDUAL_STALLED * norm
        done = near & False
        if np.count_nonzero(near):
            # the step by the Jacobian before; where it is not rounding, the position is singular,
            # and half of the digits is what Φ has there when it no longer falls
            more = _times(inverse, phi) if n else np.zeros_like(y)
            small = _greatest(more) <= 1e3 * tol.LOOP_CLOSURE_CORRECTION * norm
            ends = (small | (n == CORRECTIONS - 1)) & (worst <= tol.LOOP_CLOSURE_RESIDUAL * norm)
            done = on & near & (ends | (worst > 0.5 * last))
            y = y - np.where((done & small)[..., None], more, 0.0)
            on = on & ~done
        if n == 0 and x.ndim > 1:
            found = ClosedRows(np.empty(x.shape), np.empty(len(x), dtype=bool), np.empty(own.shape))
        if not np.count_nonzero(on):
            break
        if x.ndim > 1 and not on.all():
            found.x[left], found.good[left], found.G[left] = y, done, own
            every = (left, y, done, own, phi, G, worst, norm)
            left, y, done, own, phi, G, worst, norm = (one[on] for one in every)
            if held is not None:
                frames, values = frames[on], values[on]
        inverse, last = pseudo_inverse(G, zero), worst
        step = _times(inverse, phi)
        size = _greatest(step)
        if np.count_nonzero(size > 0.5):  # what is far is brought there at once
            turn = np.where(size > tol.GUESS_FAR, _greatest(step[..., 2::3]), size)
            step *= np.minimum(1.0, 0.5 / np.maximum(turn, tol.TINY))[..., None]
        y = y - step
        still = size <= tol.LOOP_CLOSURE_FIRST_INSTANT * norm
        still = still & (worst > tol.LOOP_CLOSURE_RESIDUAL_STALLED * norm)
        if np.count_nonzero(still) == still.size:
            break  # rows that cannot all vanish
    if x.ndim == 1:
        return ClosedRows(y, done, own)
    found.x[left], found.good[left], found.G[left] = y, done, own
    return found


def _greatest(x: Array) -> Any:
    """Of the sizes of numbers (…, numbers): (…)."""
    return np.abs(x).max(axis=-1, initial=0.0)


def _times(A: Array, x: Array) -> Array:
    """Products (…, rows) of matrices (…, rows, columns) and vectors (…, columns)."""
    return (A @ x[..., None])[..., 0]


def pseudo_inverse(G: Array, zero: float = tol.SINGULAR_VALUE_ZERO) -> Array:
    """Pseudo-inverses (…, columns, rows); singular values below this part of the greatest count as
    none. Rows far from depending on each other need no singular values, Gᵀ (G Gᵀ)⁻¹.
    """
    rows, columns = G.shape[-2:]
    if rows > columns or not rows:
        return np.asarray(np.linalg.pinv(G, rcond=zero))
    T = np.swapaxes(G, -1, -2)
    try:
        found = np.linalg.inv(G) if rows == columns else T @ np.linalg.inv(G @ T)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(G, rcond=zero))
    condition = np.einsum("...ij,...ij->...", G, G) * np.einsum("...ij,...ij->...", found, found)
    near = ~(condition * max(zero, tol.SINGULAR_VALUE_NEAR_SINGULAR) ** 2 < 1.0)
    if np.count_nonzero(near):
        found[near] = np.linalg.pinv(G[near], rcond=zero)
    return np.asarray(found)


def side_of(
    rows: np.ndarray, along: np.ndarray, before: np.ndarray | None
) -> tuple[float, np.ndarray | None]:
    """Sign of the determinant of the rows of a curve and its tangent, and the frame (coordinates −
    1, rows) of the space that dependent rows span, in which it is taken; `before`: that of a point
    nearby, with which this one has its orientation in common.
    """
    frame, rank = None, len(along) - 1
    if len(rows) != rank:
        frame = np.linalg.svd(rows, full_matrices=False)[0][:, :rank].T
        if len(frame) < rank:
            return 0.0, None
        if before is not None and np.linalg.slogdet(frame @ before.T)[0] < 0.0:
            frame[0] *= -1.0
        rows = frame @ rows
    return float(np.linalg.slogdet(np.vstack([rows, along]))[0]), frame


def dense_rates(system: System, work: Work) -> np.ndarray:
    """ν of every row in the workspace, lengths by the model length."""
    return np.asarray(system.row_units * work.nu[system.row_numbers, 0])


def rank_of(
    G: np.ndarray, zero: float = tol.SINGULAR_VALUE_ZERO, parts: np.ndarray | None = None
) -> Rank:
    """Rank, free motions and dependencies of a dimensionless Φ_q (rows, coordinates).

    A singular value below the part `zero` of the greatest counts as none. With the `parts` that
    coordinates belong to (coordinates,) each motion and each dependency is of one part.
    """
    if parts is not None and (parts != parts[0]).any():
        return _rank_by_parts(G, zero, parts)
    rows, coordinates = G.shape
    if not rows:
        return Rank(coordinates, 0, 0, np.eye(coordinates), np.empty((0, 0)))
    if LARGE <= rows <= coordinates:
        motions = _null_space(G, zero)
        if motions is not None:
            return Rank(coordinates, rows, rows, motions, np.empty((0, rows)))
    u, sizes, vt = np.linalg.svd(G)
    rank = int((sizes > zero * max(1.0, sizes[0])).sum())
    return Rank(coordinates, rows, rank, vt[rank:], u[:, rank:].T)


def ranks_of(G: np.ndarray, zero: float) -> np.ndarray:
    """Ranks (…) of dimensionless Φ_q (…, rows, coordinates), see `rank_of`."""
    sizes = np.linalg.svd(G, compute_uv=False)
    return np.asarray((sizes > zero * np.maximum(sizes[..., :1], 1.0)).sum(axis=-1))


def independent_rows(G: np.ndarray) -> list[int]:
    """Rows that do not depend on those before them, by Gram and Schmidt's method."""
    kept, basis = list[int](), np.empty((0, G.shape[1]))
    for n, row in enumerate(G):
        left = row / max(float(np.linalg.norm(row)), tol.TINY)
        for _ in range(2):
            left = left - (basis @ left) @ basis
        size = float(np.linalg.norm(left))
        if size > tol.ROWS_DEPENDENT:
            kept.append(n)
            basis = np.vstack([basis, left / size])
    return kept


def _rank_by_parts(G: np.ndarray, zero: float, parts: np.ndarray) -> Rank:
    """Rank of a Φ_q whose parts have no row in common but those that join them."""
    label = parts.copy()
    for row in G != 0.0:
        joined = np.unique(label[row])
        if len(joined) > 1:
            label[np.isin(label, joined)] = joined[0]
    motions: list[np.ndarray] = []
    dependencies: list[np.ndarray] = []
    rank = 0
    taken = np.zeros(len(G), dtype=bool)
    for part in np.unique(label):
        columns = label == part
        own = (G[:, columns] != 0.0).any(axis=1)
        taken |= own
        found = rank_of(G[np.ix_(own, columns)], zero)
        rank += found.rank
        for vectors, where, kept in (
            (found.motions, columns, motions),
            (found.dependencies, own, dependencies),
        ):
            whole = np.zeros((len(vectors), len(where)))
            whole[:, where] = vectors
            kept.append(whole)
    dependencies.append(np.eye(len(G))[~taken])
    rows, coordinates = G.shape
    return Rank(coordinates, rows, rank, np.concatenate(motions), np.concatenate(dependencies))


def _null_space(G: np.ndarray, zero: float) -> np.ndarray | None:
    """Free motions where all rows are clearly independent, else None.

    Gᵀ = Q R by Householder's reflections, a tenth of the work of singular values. The least one of
    R, by inverse iteration on RᵀR, must be a hundred times what counts as zero.
    """
    from scipy.linalg import solve_triangular

    rows = G.shape[0]
    Q, R = np.linalg.qr(G.T, mode="complete")
    R = R[:rows]
    greatest = max(1.0, float(np.linalg.norm(G)))
    if np.abs(np.diag(R)).min() <= 100.0 * zero * greatest:
        return None
    x = np.random.default_rng(0).normal(size=rows)
    size = 0.0
    for _ in range(ITERATIONS):
        x = solve_triangular(R, solve_triangular(R, x, trans="T"))
        size = float(np.linalg.norm(x))
        x /= size
    if 1.0 / np.sqrt(size) <= 100.0 * zero * greatest:
        return None
    return np.ascontiguousarray(Q[:, rows:].T)


def shortest(A: np.ndarray, b: np.ndarray, floor: float) -> np.ndarray:
    """The shortest x (columns,) with the least |A x − b|; singular values of A (rows, columns)
    below `floor` count as none, be they all of them.
    """
    u, sizes, vt = np.linalg.svd(A, full_matrices=False)
    kept = sizes > floor
    return np.asarray(((u[:, kept].T @ b) / sizes[kept]) @ vt[kept])


def smallest_gap(system: System, work: Work, kept: np.ndarray) -> np.ndarray:
    """Move the workspace to where the rows not in `kept` are violated least while those in `kept`
    (rows,) hold; returns the dimensionless Φ there. Least squares with a growing penalty.
    """
    rows = functools.partial(dense, system, work)
    x = work.q[: system.coordinates, 0] / system.coordinate_units
    for penalty in (1e1, 1e3, 1e5):
        weight = np.where(kept, penalty, 1.0)
        x = least_squares(
            lambda x, weight=weight: weight * rows(x)[0],  # type: ignore[misc]
            lambda x, weight=weight: weight[:, None] * rows(x)[1],  # type: ignore[misc]
            x,
            most=100,
            ends=tol.LOOP_GAP_ENDS,
        ).x
    return rows(x)[0]


# -- Rank and free motions of large systems by orthogonal elimination, body by body ------------
# Columns of a sparse matrix are eliminated in groups of few (the coordinates of a body) by
# Householder's reflections of the rows that touch them (multifrontal, as of Duff & Reid 1983); what
# is left of these rows is one front on the neighbours. A column without a pivot is free. The order
# is minimum degree, of equal degrees the last group first, so that free columns are near the
# beginning.

#: Columns that are pivots, columns that are free, the rows of the pivots after all reflections, and
#: the vectors of these, each of length √2 or zero.
_Reflected: TypeAlias = "tuple[list[int], list[int], Array, Array]"

#: Null vectors that are solved at once.
CHUNK = 128


@dataclass(frozen=True, eq=False)
class Front:
    """Rows of a sparse matrix that touch the same groups of columns.

    `rows` (rows, columns of these groups)
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

    `free`: Columns without a pivot: null vector n is 1 in column ``free[n]`` and 0 in all others
      free.
    `kept`, `dropped`: The least pivot, and the greatest part of a column that was taken for zero.
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
    """Rank of a matrix of fronts."""
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
        own, trailing = matrix[:, :width], matrix[:, width:]
        found = self._in_order(own)
        if found is None:
            found = self._by_size(own)
        pivots, free, triangle, reflections = found
        self.free += columns[free].tolist()
        rank = len(pivots)
        if not rank:
            return trailing
        _reflect(trailing, reflections)
        right = np.hstack([triangle[:, free], trailing[:rank]]) if free else trailing[:rank].copy()
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
        return trailing[rank:]

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
            if not greatest > self.zero or left[0] < (tol.PIVOT_THRESHOLD * greatest) ** 2:
                return None
            kept = min(kept, greatest)
        self.kept = kept
        triangle, reflections = raw[:, :rank].T.copy(), raw[:rank].copy()
        for k, scale in enumerate(scales.tolist()):
            triangle[k, :k], reflections[k, :k], reflections[k, k] = 0.0, 0.0, 1.0
            reflections[k] *= math.sqrt(scale)
        return list(range(rank)), list(range(rank, width)), triangle, reflections

    def _by_size(self, own: Array) -> _Reflected:
        """Reflections one after the other, each by the first remaining column large enough."""
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
            n = int(np.argmax(sizes >= tol.PIVOT_THRESHOLD * greatest))
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


# -- Rank of the constraints of large systems: Φ_q as fronts of bodies and of joints -----------


@dataclass(frozen=True, eq=False)
class SparseRows:
    """The dimensionless Φ_q by blocks of a row and a body, those of a row together.

    `row`, `body` (blocks,)
    `block` (blocks, 3)
    `element` (rows,): Joint, coupling or driver of each row, by number.
    """

    row: Array
    body: Array
    block: Array
    element: Array


@dataclass(frozen=True, eq=False)
class LargeRank(RankCounts):
    """Rank of the dimensionless Φ_q at one position, as `Rank`, without dense matrices.

    `order` (bodies,): Bodies in whose order free motions have their leaders, as far as elimination
      lets them.
    `basis`: Its columns are three for each body of `order`.
    `parts`: Of these rows.
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
        for chunk in self._null_vectors.chunks():
            yield chunk / np.linalg.norm(chunk, axis=1)[:, None]

    @functools.cached_property
    def _null_vectors(self) -> SparseRank:
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
        if int(k) in first_rows:  # none of the active set
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
