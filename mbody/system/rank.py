"""Rank of the constraints, free motions, redundant rows, by dense linear algebra.

It serves reports and errors; the kernels never need it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import violation
from mbody.system.system import System

__all__ = [
    "DENSE",
    "Rank",
    "RankCounts",
    "dense",
    "dense_rates",
    "jacobian",
    "joint_rows",
    "rank_of",
    "shortest",
    "smallest_gap",
    "too_large",
]

#: Rows, and pairs of coordinates, up to which dense matrices are made.
DENSE = 1500
#: A singular value below this part of the greatest is zero.
ZERO = 1e-9
#: Rows from which on independent ones are recognised by Householder's reflections first, and the
#: steps of inverse iteration for their least singular value.
LARGE, ITERATIONS = 100, 6


@dataclass(frozen=True, eq=False)
class RankCounts:
    """How many coordinates (three a body), rows (of joints and drivers) and independent rows."""

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

    Attributes
    ----------
    motions : array (free, coordinates)
        Free motions, orthonormal, lengths by the model length.
    dependencies : array (redundant, rows)
        Combinations of dimensionless rows that vanish, orthonormal.
    """

    motions: np.ndarray
    dependencies: np.ndarray


def too_large(system: System) -> bool:
    """Whether dense matrices of a system would be out of proportion."""
    return max(system.rows, system.coordinates // 2) > DENSE


def jacobian(system: System, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """Φ (rows,) and Φ_q (rows, coordinates) at the position in the workspace, with their units.

    Rows as in `System.row_table`; the signals must be set.
    """
    violation(system.runtime(), work)
    primitive, row, _ = system.row_table
    phi = work.phi[2 * system.layout.primitive_node[primitive] + row, 0]
    return phi, joint_rows(system, work.block[:, 0])


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
    """Where in Φ_q, row by row with the ground as last body, each number of the blocks is: places
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
        for line in np.flatnonzero((node == k) & (row == 0))  # none of what can be on or off
    ]
    both = bodies[:, 0] == bodies[:, 1]  # two sides of one body add up
    more += list(zip(place[both, 1].tolist(), number[both, 1].tolist(), strict=True))
    own = np.column_stack([np.ones(len(both), dtype=bool), ~both])
    three = np.arange(3)
    return (place[own][:, None] + three).ravel(), (number[own][:, None] + three).ravel(), more


def dense(system: System, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """The same without units: lengths by the model length."""
    phi, G = jacobian(system, work)
    unit = system.row_units
    return unit * phi, unit[:, None] * G * system.coordinate_units


def dense_rates(system: System, work: Work) -> np.ndarray:
    """ν of every row in the workspace, lengths by the model length."""
    primitive, row, _ = system.row_table
    nu = work.nu[2 * system.layout.primitive_node[primitive] + row, 0]
    return np.asarray(system.row_units * nu)


def rank_of(G: np.ndarray, zero: float = ZERO) -> Rank:
    """Rank, free motions and dependencies of a dimensionless Φ_q (rows, coordinates).

    A singular value below the part `zero` of the greatest counts as none.
    """
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
    (rows,) hold; returns the dimensionless Φ there. Gauss–Newton with a growing penalty.
    """
    size = 3 * system.layout.bodies
    scale = system.coordinate_units
    for penalty in (1e1, 1e3, 1e5):
        weight = np.where(kept, penalty, 1.0)
        phi, G = dense(system, work)
        damping, here = 1e-3, np.linalg.norm(weight * phi)
        for _ in range(100):
            A = np.vstack([weight[:, None] * G, damping * np.eye(size)])
            step = np.linalg.lstsq(A, np.append(-weight * phi, np.zeros(size)), rcond=None)[0]
            step *= min(1.0, 0.5 / max(np.abs(step).max(), 1e-300))
            before = work.q[:size, 0].copy()
            work.q[:size, 0] += scale * step
            new_phi, new_G = dense(system, work)
            now = np.linalg.norm(weight * new_phi)
            if now < here:
                done = here - now < 1e-12 * here
                phi, G, here, damping = new_phi, new_G, now, 0.3 * damping
                if done or here < 1e-13:
                    break
            else:
                work.q[:size, 0] = before
                damping = max(10.0 * damping, 1e-12)
                if damping > 1e8:
                    break
    return dense(system, work)[0]
