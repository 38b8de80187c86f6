"""Positions that the constraints allow, at rest: free directions there, and the forces along them.

Coordinates are those of the mass centres with lengths by the model length; forces are then torques.
With N the null space of Φ_q, and Φ_qᵀ λ the best balance of the loads f, what drives the mechanism
is r = Nᵀ f, and K = −Nᵀ ∂(f − Φ_qᵀ λ)/∂q N (λ fixed) is its tangent stiffness: r changes by −K y
along q + N y on the manifold, and K is symmetric where the loads have a potential.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.kernels import finished_instants
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.loop_closure import close, laws_of_time, project
from mbody.system.rank import ClosedRows, close_rows, dense, pseudo_inverse, rank_of, ranks_of
from mbody.system.system import System

Array = np.ndarray

#: Coordinates below which dense matrices are as fast as kernels called one by one.
FEW = 45


@dataclass(frozen=True, eq=False)
class Place:
    """One closed position at rest.

    `q` (coordinates,): Mass centres and angles, with their units.
    `force` (coordinates,): Of all loads, without units of length.
    `motions` (free, coordinates): Orthonormal free directions.
    `rows` (rows, coordinates): Φ_q without units.
    `residual` (free,): Residual force along the free directions: zero at rest.
    """

    q: Array
    force: Array
    motions: Array
    rows: Array
    residual: Array

    @functools.cached_property
    def multipliers(self) -> Array:
        """λ that balance the loads best: (rows,)."""
        if not len(self.rows):
            return np.zeros(0)
        return np.asarray(
            np.linalg.lstsq(self.rows.T, self.force, rcond=tol.LEAST_SQUARES_RANK_FINE)[0]
        )

    @functools.cached_property
    def undetermined(self) -> float:
        """Size of the force along what is free at a singular position that this one may be, but
        for rounding: constraints far too weak balance it, by reactions without bounds.
        """
        motions = rank_of(self.rows, tol.SINGULAR_VALUE_NEAR_SINGULAR).motions
        more = len(motions) > len(self.motions)
        return float(np.linalg.norm(motions @ self.force)) if more else 0.0

    @property
    def push(self) -> Array:
        """The residual force as a force on all coordinates."""
        return np.asarray(self.residual @ self.motions)

    @property
    def size(self) -> float:
        """Size of the residual force."""
        return float(np.linalg.norm(self.residual))


class Manifold:
    """The closed positions of a system at time t, its drivers holding their values. `own`
    (auxiliary states + inputs,).

    `weight` (bodies,): What forces and masses of each body are multiplied by. Powers of two that
    make the greatest loads of groups which nothing joins about equal, if they are `weighted`: what
    is rounding of one group is none of another.
    """

    def __init__(
        self,
        system: System,
        work: Work,
        t: float,
        own: Array | None = None,
        *,
        weighted: bool = False,
    ) -> None:
        self.system, self.work, self.layout = system, work, system.runtime()
        self.size = system.coordinates
        self.scale = system.coordinate_units
        self.time = np.array([t])
        self.own = own
        self.motion = np.zeros((1, 3 * self.size + (0 if own is None else len(own))))
        if own is not None:
            self.motion[0, 3 * self.size :] = own
        self.instant = finished_instants.Finished(
            motion=self.motion,
            t=self.time,
            lam=np.zeros((1, 2 * len(system.owners))),
            driven=np.zeros(0, dtype=np.int64),
            given=np.zeros((1, max(1, len(system.drivers)), 3)),
            by_law=True,
            at_rest=True,
        )
        self.output = np.empty((1, finished_instants.RESIDUALS))
        self.weight, self.force_unit = np.ones(self.size // 3), self.scale
        if weighted and (system.groups != system.groups[0]).any():
            self.weight = self._weights()
            self.force_unit = self.scale * np.repeat(self.weight, 3)

    def _weights(self) -> Array:
        """`weight` by the loads at the position in the workspace and at one beside it."""
        start, groups = self.work.q[: self.size, 0].copy(), self.system.groups
        beside = start + tol.WEIGHTS_BESIDE * self.scale * np.cos(np.arange(self.size))
        loads = np.abs(ManyPositions(self).loads(np.array([start, beside])))
        own = loads.max(axis=(0, 1), initial=0.0).reshape(-1, 3).max(axis=1)
        top = np.zeros_like(own)
        np.maximum.at(top, groups, np.nan_to_num(own))
        top = top[groups]
        self.work.q[: self.size, 0] = start
        ratio = np.where(top > 0.0, float(top.max()) / np.maximum(top, tol.TINY), 1.0)
        return np.asarray(np.exp2(np.round(np.log2(ratio))))

    def other(self, system: System) -> Manifold:
        """The manifold of a system of equal topology with other parameter values."""
        work = system.work()
        work.time[:] = self.time[0]
        laws_of_time(system.runtime(), work)
        raise_user_error(system)
        found = Manifold(system, work, float(self.time[0]), self.own)
        found.weight, found.force_unit = self.weight, self.force_unit
        return found

    def force(self, q: Array, v: Array | None = None) -> Array:
        """All loads on the coordinates (coordinates,), lengths by the model length; at rest, or at
        the rates v [length/time, rad/time].
        """
        self.motion[0, : self.size] = q
        self.motion[0, self.size : 2 * self.size] = 0.0 if v is None else v
        # the kernel of the residuals sums the loads of an instant, laws included; drivers rest
        finished_instants.residuals_of(self.layout, self.work, self.instant, self.output)
        raise_user_error(self.system)
        return np.asarray(self.work.force[: self.size, 0] * self.force_unit)

    def rows(self, q: Array) -> tuple[Array, Array]:
        """Φ (…, rows) and Φ_q (…, rows, coordinates), without units, at positions (…,
        coordinates).
        """
        return self._dense(q / self.scale)

    def _dense(self, x: Array) -> tuple[Array, Array]:
        found = dense(self.system, self.work, x)
        raise_user_error(self.system)
        return found

    def scale_of(self, here: Place) -> float:
        """Scale of the residual force's rounding: the greatest force of a single load, or how fast
        the forces change. At rest all may vanish, as of a spring without tension.
        """
        changes = [
            self.force(here.q + tol.DIFFERENCE_STEP_FOURTH_ORDER * self.scale * d) - here.force
            for d in here.motions
        ]
        steepest = (
            max((float(np.abs(change).max()) for change in changes), default=0.0)
            / tol.DIFFERENCE_STEP_FOURTH_ORDER
        )
        return max(self.largest(here.q), steepest)

    def largest(self, q: Array) -> float:
        """The greatest force of a single load on a coordinate."""
        loads = self.system.mechanism.loads
        if not loads:
            return 0.0
        parts = np.empty((1, len(loads) + 1, PER_PRIMITIVE * len(self.system.owners), 1))
        top = 0.0
        self.motion[0, : self.size] = q
        for cause in range(len(loads)):
            work = self.work
            work.q[: self.size, 0] = q
            kernel = self.layout, work, tol.REDUNDANT_ROW_SOFTNESS, self.motion, self.time
            finished_instants.breakdown(*kernel, cause + 1, finished_instants.NO_FRICTION, parts)
            top = max(top, float(np.abs(work.force[: self.size, 0] * self.force_unit).max()))
        return top

    def at(self, q: Array) -> Place | None:
        """The position nearest to q that the constraints allow; None where there is none."""
        found = self.closing(q)
        return self._placed(self.scale * found.x, None, found.G) if found.good else None

    def place(self, q: Array) -> Place | None:
        """Force, constraint Jacobian and free directions at a closed position; None where a load or
        a constraint has no value.
        """
        return self._placed(q, None, self.rows(q)[1])

    def _placed(self, q: Array, motions: Array | None, G: Array) -> Place | None:
        """Force and free directions at a closed position, with `motions` where they are known
        already.
        """
        force = self.force(q)
        if not (np.isfinite(force).all() and np.isfinite(G).all()):
            return None
        if motions is None:
            motions = rank_of(G, parts=self.system.coordinate_part).motions
        return Place(q, force, motions, G, motions @ force)

    def closing(self, q: Array, fixed: Array | None = None) -> ClosedRows:
        """Close the constraints from positions (…, coordinates) by least motion, or by none in some
        directions. `fixed` (…, n, coordinates), without units.
        """
        x = q / self.scale
        held = None if fixed is None else (fixed, (fixed @ x[..., None])[..., 0])
        return close_rows(self._dense, x, held)

    def closed(self, q: Array, fixed: Array | None = None) -> Array | None:
        """The position (coordinates,) that `closing` finds; None where it finds none."""
        found = self.closing(q, fixed)
        return self.scale * found.x if found.good else None

    def moved(self, here: Place, along: Array) -> Place | None:
        """The position that a step along (coordinates,) leads to, closed again.

        Of many bodies kernels close it and carry the free directions along, where all rows are far
        from depending on each other: singular values are for singular positions.
        """
        q = here.q + self.scale * along
        if self.size < FEW or len(here.motions) != self.size - self.system.rows:
            return self.at(q)
        work = self.work
        work.q[: self.size, 0] = q
        norm = 1.0 + float(np.abs(q / self.scale).max())
        good, straight, ratio = close(self.layout, work, 0.0, tol.LOOP_CLOSURE_RESIDUAL * norm)
        raise_user_error(self.system)
        if not (good and straight and ratio > tol.PIVOT_REGULAR):
            return self.at(q)
        q = work.q[: self.size, 0].copy()
        motions = self._carried(here.motions)
        return self.at(q) if motions is None else self._placed(q, motions, self.rows(q)[1])

    def _carried(self, motions: Array) -> Array | None:
        """Free directions at the position in the workspace, from those of one nearby; None where
        they do not go on as so many.
        """
        still = self._projected(np.zeros(self.size))
        for _ in range(2):  # the second time takes what the condition of the rows left of the first
            found = np.array([self._projected(motion) - still for motion in motions])
            basis, parts = np.linalg.qr(found.T)
            if np.abs(np.diag(parts)).min(initial=1.0) < 0.1:
                return None
            motions = basis.T
        return np.asarray(motions)

    def _projected(self, motion: Array) -> Array:
        """The nearest rates that the constraints allow, without units."""
        self.work.v[: self.size, 0] = self.scale * motion
        project(self.layout, self.work, 0.0)
        return np.asarray(self.work.v[: self.size, 0] / self.scale)

    def stiffness(self, here: Place) -> Array:
        """K (free, free) in the free directions of the place, as torques a radian."""
        return np.asarray(-(here.motions @ self.change(here, here.motions).T))

    def change(self, here: Place, along: Array) -> Array:
        """∂(f − Φ_qᵀ λ)/∂q along directions, λ fixed: (directions, coordinates)."""

        def forces(every: Array) -> Array:
            return np.array([self.force(q) for q in every]).reshape(every.shape)

        return self.changes(here.q[None], along[None], here.multipliers[None], forces)[0]

    def changes(
        self, q: Array, along: Array, balance: Array, forces: Callable[[Array], Array]
    ) -> Array:
        """∂(f − Φ_qᵀ λ)/∂q at positions along directions (positions, directions, coordinates), λ
        (positions, rows) fixed, by all loads at positions (…, coordinates).
        """
        steps = np.array([-2.0, -1.0, 1.0, 2.0]) * tol.DIFFERENCE_STEP_FOURTH_ORDER
        moved = q[:, None, None] + self.scale * along[:, :, None] * steps[:, None]
        every = moved.reshape(-1, self.size)
        balance = np.repeat(balance, 4 * along.shape[1], axis=0)
        own = forces(every) - (balance[:, None] @ self.rows(every)[1])[:, 0]
        change = np.array([1.0, -8.0, 8.0, -1.0]) @ own.reshape(moved.shape)
        return np.asarray(change / (12.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER))

    def distance(self, one: Array, other: Array) -> float:
        """Distance of two positions from each other, whole revolutions left out."""
        difference = ((one - other) / self.scale).reshape(-1, 3)
        difference[:, 2] = np.remainder(difference[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        return float(np.abs(difference).max())

    def mass(self, motions: Array) -> Array:
        """Mass matrix (free, free) in such directions, as inertias; what is rounding beside the
        heaviest body is none.
        """
        own = self.work.mass[: self.size, 0] * self.scale * self.force_unit
        mass, part = (motions * own) @ motions.T, self.system.coordinate_part
        heaviest = np.zeros_like(own)
        np.maximum.at(heaviest, part, own)
        # the heaviest body that is joined to what a motion moves most
        root = np.sqrt(np.maximum(heaviest[part[np.abs(motions).argmax(axis=1)]], tol.TINY))
        sizes, modes = np.linalg.eigh(mass / np.outer(root, root))
        small = sizes <= tol.INERTIA_NONE
        if not small.any():
            return np.asarray(mass)
        return np.asarray((modes * np.where(small, 0.0, sizes)) @ modes.T * np.outer(root, root))


def massive(mass: Array) -> bool:
    """Whether every free motion has inertia, whatever the units of the leaders."""
    size = np.sqrt(np.abs(np.diag(mass)))
    if not size.all():
        return False
    return bool(np.linalg.eigvalsh(mass / np.outer(size, size))[0] > tol.INERTIA_NONE)


# -- Many positions of a manifold at once: closed over tangent planes, loads and stiffness there
# One by one a position costs the interpreter's time a hundred times over; here the kernels are
# called one after the other and everything else is linear algebra on stacks of matrices.


@dataclass(frozen=True, eq=False)
class ClosedPositions:
    """Closed positions over tangent planes, those that do not close not a number.

    `good` (positions,): Whether it closes there, with as many free motions as the tangent plane.
    `q` (positions, coordinates)
    `rows` (positions, rows, coordinates): Φ_q without units.
    `directions` (positions, free, coordinates): Along the surface for unit steps in the directions
      of the plane.
    `side` (positions,): Sign of det [Φ_q; frame], zero with redundant rows.
    """

    good: Array
    q: Array
    rows: Array
    directions: Array
    side: Array


class ManyPositions:
    """Positions of one manifold, many at once."""

    def __init__(self, manifold: Manifold) -> None:
        self.manifold, self.scale, self.size = manifold, manifold.scale, manifold.size

    def loads(self, q: Array) -> Array:
        """Every load alone on the coordinates, without units of length: (positions, loads,
        coordinates).
        """
        manifold = self.manifold
        manifold.system.refuse_loops("searches for rest positions know")
        loads = len(manifold.system.mechanism.loads)
        output = np.zeros((len(q), loads, self.size))
        if loads and len(q):
            motion = np.repeat(manifold.motion, len(q), axis=0)
            motion[:, : self.size] = q
            motion[:, self.size : 3 * self.size] = 0.0
            times = np.repeat(manifold.time, len(q))
            finished_instants.each_load(manifold.layout, manifold.work, motion, times, output)
            raise_user_error(manifold.system)
        return output * self.manifold.force_unit

    def forces(self, q: Array) -> Array:
        """All loads together: (positions, coordinates)."""
        return np.asarray(self.loads(q).sum(axis=1))

    def closed(self, q: Array, frames: Array) -> ClosedPositions:
        """The positions above points of tangent planes. `q` (positions, coordinates), `frames`
        (positions, free, coordinates).
        """
        found, free = self.manifold.closing(q, frames), frames.shape[1]
        good, q, rows = found.good, self.scale * found.x, found.G
        K = np.concatenate([rows[good], frames[good]], axis=1)
        directions = np.full(frames.shape, np.nan)
        side = np.zeros(len(q))
        if len(K):
            square = K.shape[1] == K.shape[2]
            inverse = pseudo_inverse(K, 0.0 if square else tol.SINGULAR_VALUE_ZERO)
            least = 1.0 / np.maximum(np.linalg.norm(inverse, axis=(1, 2)), tol.TINY)
            own = least > tol.SINGULAR_VALUE_ZERO * np.maximum(np.abs(K).max(axis=(1, 2)), 1.0)
            if square:
                side[good] = np.linalg.slogdet(K)[0]
                own &= side[good] != 0.0
            else:
                own &= ranks_of(rows[good], tol.SINGULAR_VALUE_ZERO) == self.size - free
            directions[good] = inverse[:, :, -free:].transpose(0, 2, 1)
            good = good.copy()
            good[good] = own
        return ClosedPositions(good, np.where(good[:, None], q, np.nan), rows, directions, side)

    def stiffness(self, q: Array, motions: Array, rows: Array, force: Array) -> Array:
        """K (positions, free, free) along free directions, as `Manifold.stiffness`. `motions`
        (positions, free, coordinates).

        Φ_q and all loads there.
        """
        K = np.concatenate([rows, motions], axis=1)
        balance = np.einsum("ncm,nc->nm", pseudo_inverse(K), force)[:, : rows.shape[1]]
        change = self.manifold.changes(q, motions, balance, self.forces)
        return np.asarray(-np.einsum("nac,nbc->nab", motions, change))

    def places(self, found: ClosedPositions, which: Sequence[int] | Array) -> list[Place]:
        """Some of closed positions as places, their free directions the nearest to the frames."""
        motions, _ = orthonormal(found.directions[which])
        forces = self.forces(found.q[which])
        residuals = np.einsum("nfc,nc->nf", motions, forces)
        numbers = zip(found.q[which], forces, motions, found.rows[which], residuals, strict=True)
        return [Place(*one) for one in numbers]


def orthonormal(directions: Array) -> tuple[Array, Array]:
    """The orthonormal directions (positions, free, coordinates) that are the nearest to those along
    which a frame has unit steps, and the least cosine between them and the frame.

    S = W Wᵀ, directions S^(−1/2) W, their products with the frame S^(−1/2).
    """
    S = directions @ directions.transpose(0, 2, 1)
    values, vectors = np.linalg.eigh(S)
    root = (vectors / np.sqrt(values)[:, None]) @ vectors.transpose(0, 2, 1)
    return root @ directions, 1.0 / np.sqrt(values[:, -1])
