"""Many positions of a manifold at once: closed over tangent planes, loads and stiffness there.

One by one a position costs the interpreter's time a hundred times over; here the kernels are called
one after the other and everything else is linear algebra on stacks of matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.tangent_space import CLOSED, CORRECTIONS, STEP, Array, Manifold, Place
from mbody.kernels.load_breakdown import each_load
from mbody.kernels.loop_closure import violation
from mbody.system.rank import ZERO, joint_rows

__all__ = ["ClosedPositions", "ManyPositions", "orthonormal"]

#: A singular value below this part of the greatest is none where a position is closed.
RANK = 1e-9


@dataclass(frozen=True, eq=False)
class ClosedPositions:
    """Closed positions over tangent planes, those that do not close not a number.

    Attributes
    ----------
    good : array (positions,)
        Whether it closes there, with as many free motions as the tangent plane.
    q : array (positions, coordinates)
    rows : array (positions, rows, coordinates)
        Φ_q without units.
    ways : array (positions, free, coordinates)
        Along the surface for unit steps in the directions of the plane.
    side : array (positions,)
        Sign of det [Φ_q; frame], zero with redundant rows.
    """

    good: Array
    q: Array
    rows: Array
    ways: Array
    side: Array


class ManyPositions:
    """Positions of one manifold, many at once."""

    def __init__(self, manifold: Manifold) -> None:
        self.manifold, self.scale, self.size = manifold, manifold.scale, manifold.size

    def rows(self, q: Array) -> tuple[Array, Array]:
        """Φ (positions, rows) and Φ_q (positions, rows, coordinates), without units, of positions
        (positions, coordinates).
        """
        manifold = self.manifold
        system, work, layout = manifold.system, manifold.work, manifold.layout
        primitive, row, _ = system.row_table
        number = 2 * system.layout.primitive_node[primitive] + row
        phi, blocks = np.empty((len(q), len(number))), np.empty((len(q), len(work.block)))
        own, found, block = work.q[: self.size, 0], work.phi[:, 0], work.block[:, 0]
        for k, one in enumerate(q):
            own[:] = one
            violation(layout, work)
            phi[k], blocks[k] = found[number], block
        raise_user_error(system)
        G = joint_rows(system, np.ascontiguousarray(blocks.T)).transpose(2, 0, 1)
        unit = system.row_units
        return unit * phi, unit[:, None] * G * self.scale

    def loads(self, q: Array) -> Array:
        """Every load alone on the coordinates, without units of length: (positions, loads,
        coordinates).
        """
        manifold = self.manifold
        loads = len(manifold.system.mechanism.loads)
        output = np.zeros((len(q), loads, self.size))
        if loads and len(q):
            motion = np.repeat(manifold.motion, len(q), axis=0)
            motion[:, : self.size] = q
            motion[:, self.size : 3 * self.size] = 0.0
            times = np.repeat(manifold.time, len(q))
            each_load(manifold.layout, manifold.work, motion, times, output)
            raise_user_error(manifold.system)
        return output * self.scale

    def forces(self, q: Array) -> Array:
        """All loads together: (positions, coordinates)."""
        return np.asarray(self.loads(q).sum(axis=1))

    def closed(self, q: Array, frames: Array) -> ClosedPositions:
        """The positions above points of tangent planes, as `Manifold.closed` finds each of them.

        Parameters
        ----------
        q : array (positions, coordinates)
            In the planes.
        frames : array (positions, free, coordinates)
            Orthonormal directions of the planes, in which a position stays where it is.
        """
        start, q = q, q.copy()
        count, free = frames.shape[:2]
        good = np.zeros(count, dtype=bool)
        rows = np.zeros((count, len(self.manifold.system.row_table[0]), self.size))
        last = np.full(count, np.inf)
        left = np.arange(count)
        for _ in range(CORRECTIONS):
            if not left.size:
                break
            phi, G = self.rows(q[left])
            worst = np.abs(phi).max(axis=1, initial=0.0)
            reach = 1.0 + np.abs(q[left] / self.scale).max(axis=1)
            finite = np.isfinite(phi).all(axis=1) & np.isfinite(G).all(axis=(1, 2))
            # at rounding the violation no longer falls
            still = (worst <= 1e-10 * reach) & (worst > 0.5 * last[left])
            done = finite & ((worst <= CLOSED * reach) | still)
            good[left[done]], rows[left[done]] = True, G[done]
            last[left] = worst
            on = finite & ~done & (worst < 1e3 * reach)
            left, phi, G = left[on], phi[on], G[on]
            if left.size:
                off = np.einsum("nfc,nc->nf", frames[left], (q[left] - start[left]) / self.scale)
                K = np.concatenate([G, frames[left]], axis=1)
                inverse = _inverse(K)
                step = np.einsum("ncm,nm->nc", inverse, np.concatenate([phi, off], axis=1))
                q[left] -= self.scale * step
        return self._spread(good, q, rows, frames, free)

    def _spread(
        self, good: Array, q: Array, rows: Array, frames: Array, free: int
    ) -> ClosedPositions:
        """What holds at closed positions."""
        K = np.concatenate([rows[good], frames[good]], axis=1)
        ways = np.full(frames.shape, np.nan)
        side = np.zeros(len(q))
        if len(K):
            inverse = _inverse(K)
            least = 1.0 / np.maximum(np.linalg.norm(inverse, axis=(1, 2)), 1e-300)
            own = least > ZERO * np.maximum(np.abs(K).max(axis=(1, 2)), 1.0)
            if K.shape[1] == K.shape[2]:
                side[good] = np.linalg.slogdet(K)[0]
            else:
                sizes = np.linalg.svd(rows[good], compute_uv=False)
                rank = (sizes > ZERO * np.maximum(sizes[:, :1], 1.0)).sum(axis=1)
                own &= rank == self.size - free
            ways[good] = inverse[:, :, -free:].transpose(0, 2, 1)
            good = good.copy()
            good[good] = own
        return ClosedPositions(good, np.where(good[:, None], q, np.nan), rows, ways, side)

    def stiffness(self, q: Array, motions: Array, rows: Array, force: Array) -> Array:
        """K (positions, free, free) along free directions, as `Manifold.stiffness`.

        Parameters
        ----------
        motions : array (positions, free, coordinates)
            Orthonormal free directions at q.
        rows, force : arrays
            Φ_q and all loads there.
        """
        count, free = motions.shape[:2]
        K = np.concatenate([rows, motions], axis=1)
        balance = np.einsum("ncm,nc->nm", _inverse(K), force)[:, : rows.shape[1]]
        steps = np.array([-2.0, -1.0, 1.0, 2.0]) * STEP
        moved = self.scale * motions[:, :, None] * steps[:, None]  # positions, free, steps
        every = (q[:, None, None] + moved).reshape(-1, self.size)
        G = self.rows(every)[1].reshape(count, -1, *rows.shape[1:])
        own = self.forces(every).reshape(count, -1, self.size)
        own = own - np.einsum("nsrc,nr->nsc", G, balance)
        own = own.reshape(count, free, 4, self.size)
        change = (own[:, :, 0] - 8.0 * own[:, :, 1] + 8.0 * own[:, :, 2] - own[:, :, 3]) / (
            12.0 * STEP
        )
        return np.asarray(-np.einsum("nac,nbc->nab", motions, change))

    def places(self, found: ClosedPositions, which: Sequence[int] | Array) -> list[Place]:
        """Some of closed positions as places, their free directions the nearest to the frames."""
        motions, _ = orthonormal(found.ways[which])
        forces = self.forces(found.q[which])
        drives = np.einsum("nfc,nc->nf", motions, forces)
        numbers = zip(found.q[which], forces, motions, found.rows[which], drives, strict=True)
        return [Place(*one) for one in numbers]


def orthonormal(ways: Array) -> tuple[Array, Array]:
    """The orthonormal directions (positions, free, coordinates) that are the nearest to those along
    which a frame has unit steps, and the least cosine between them and the frame.

    S = W Wᵀ, directions S^(−1/2) W, their products with the frame S^(−1/2).
    """
    S = ways @ ways.transpose(0, 2, 1)
    values, vectors = np.linalg.eigh(S)
    root = (vectors / np.sqrt(values)[:, None]) @ vectors.transpose(0, 2, 1)
    return root @ ways, 1.0 / np.sqrt(values[:, -1])


def _inverse(K: Array) -> Array:
    """Inverses (positions, columns, rows) of stacked matrices, by least squares where they are not
    square or singular.
    """
    if K.shape[1] == K.shape[2]:
        try:
            return np.asarray(np.linalg.inv(K))
        except np.linalg.LinAlgError:
            pass
    return np.asarray(np.linalg.pinv(K, rcond=RANK))
