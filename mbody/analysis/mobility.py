"""Mobility: rank of the constraints, free motions, redundant rows, by dense linear algebra.

It serves reports and errors; the kernels never need it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.core.close import violation
from mbody.core.layout import Work
from mbody.system import System

__all__ = ["DENSE", "Mobility", "dense", "mobility", "smallest_gap"]

#: Rows up to which dense matrices are made.
DENSE = 1500
#: A singular value below this part of the greatest is zero.
RANK = 1e-9


@dataclass(frozen=True)
class Mobility:
    """Rank of the dimensionless Φ_q at one position.

    Attributes
    ----------
    coordinates, rows, rank : int
        Three coordinates a body; rows of joints and drivers.
    motions : array (free, coordinates)
        Free motions, orthonormal, lengths by the model length.
    dependencies : array (redundant, rows)
        Combinations of dimensionless rows that vanish, orthonormal.
    """

    coordinates: int
    rows: int
    rank: int
    motions: np.ndarray
    dependencies: np.ndarray

    @property
    def free(self) -> int:
        """Degrees of freedom that are left."""
        return self.coordinates - self.rank

    @property
    def redundant(self) -> int:
        """Rows beyond the independent ones."""
        return self.rows - self.rank


def dense(system: System, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """Dimensionless Φ (rows,) and Φ_q (rows, coordinates) at the position in the workspace.

    Rows as in `System.row_table`; the signals must be set.
    """
    L, length = system.layout, system.length
    violation(system.runtime(), work)
    atom, row, is_angle = system.row_table
    unit = np.where(is_angle, 1.0, 1.0 / length)
    node = L.atom_node[atom]
    phi = unit * work.phi[2 * node + row, 0]
    blocks = work.block[: 12 * L.nodes, 0].reshape(-1, 2, 2, 3)
    G = np.zeros((len(atom), L.bodies + 1, 3))
    every = np.arange(len(atom))
    for side, body in enumerate((L.atom_i, L.atom_j)):
        G[every, body[atom]] += unit[:, None] * blocks[node, side, row]
    G[:, :, :2] *= length
    return phi, G[:, :-1].reshape(len(atom), 3 * L.bodies)


def mobility(G: np.ndarray) -> Mobility:
    """Rank, free motions and dependencies of a dimensionless Φ_q (rows, coordinates)."""
    rows, coordinates = G.shape
    if not rows:
        return Mobility(coordinates, 0, 0, np.eye(coordinates), np.empty((0, 0)))
    u, sizes, vt = np.linalg.svd(G)
    rank = int((sizes > RANK * max(1.0, sizes[0])).sum())
    return Mobility(coordinates, rows, rank, vt[rank:], u[:, rank:].T)


def smallest_gap(system: System, work: Work, kept: np.ndarray) -> np.ndarray:
    """Move the workspace to where the rows not in `kept` are violated least while those in `kept`
    (rows,) hold; returns the dimensionless Φ there. Gauss–Newton with a growing penalty.
    """
    size = 3 * system.layout.bodies
    scale = np.tile([system.length, system.length, 1.0], system.layout.bodies)
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
