"""Singular positions: the branches of motion that meet there, their directions and curvatures.

Where rows of Φ_q depend on each other, Φ_q v = ν allows velocities that no motion has. With L the
left and N the right null space of Φ_q, a motion q₀ + v t + a t²/2 + … needs also

    Lᵀ γ(v) = 0            (second order, Φ_q a = γ),
    Lᵀ d/dt(Φ_q a − γ) = 0 (third order, for a).

Time counts as one more coordinate where drivers move, so that the second condition is a set of
homogeneous quadrics yᵀ A_i y = 0 in v = N y (`mbody.analysis.singular.quadratic_cones`). A linear
space on which all
of them vanish is the tangent space T of a branch; on it a(y) is a quadratic form.
Coordinates are those of the mass centres with lengths by the model length.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.singular.quadratic_cones import (
    ConeBranches,
    is_flat,
    size,
    tangent,
    through,
    values,
)
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.system.rank import dense, too_large
from mbody.system.system import System

__all__ = ["SUSPECT", "Singular", "singular"]

Array = np.ndarray

#: The least pivot of an elimination, as a part of its diagonal, below which a place may be
#: singular, or too near to one for rates to be more than rounding.
SUSPECT = 1e-3
#: A singular value below this part of the greatest belongs to a singular position nearby.
NEAR = 2e-2
#: How far away that position may be, in model lengths and radians: nearer than that the first
#: accelerations lose more than eight digits to rounding. Corrections to find it.
FAR, CORRECTIONS = 2e-2, 12
#: What closes, and what vanishes at a singular position, within rounding.
CLOSED, VANISHES = 1e-13, 1e-10
#: A singular value below this part of the greatest is zero where rows are dependent for good.
ZERO = 1e-9
#: Step of differences along a motion: of fourth order, its error and rounding are near 1e-12.
STEP = 1e-3


@dataclass
class ConstraintRows:
    """The rows of a system near an instant: Φ, Φ_q, ν and γ without units of length.

    Attributes
    ----------
    work : Work
        A workspace, its signals set at the instant.
    t : float
        The instant.
    """

    system: System
    work: Work
    t: float
    scale: Array = field(init=False)

    def __post_init__(self) -> None:
        self.scale, self.unit = self.system.coordinate_units, self.system.row_units
        self.primitive, self.row, _ = self.system.row_table
        self.moving = 0.0

    @classmethod
    def at_time(cls, system: System, t: float) -> ConstraintRows:
        """The rows of a system near an instant, with a workspace of their own."""
        work = system.work()
        work.time[:] = t
        laws_of_time(system.runtime(), work)
        raise_user_error(system)
        return cls(system, work, t)

    def at(self, x: Array, v: Array | None = None, later: float = 0.0) -> None:
        """Go to x (coordinates,) at the rates v, `later` than the instant."""
        n = self.system.coordinates
        if later != self.moving:
            self.work.time[:] = self.t + later
            laws_of_time(self.system.runtime(), self.work)
            self.moving = later
        self.work.q[:n, 0] = self.scale * x
        self.work.v[:n, 0] = 0.0 if v is None else self.scale * v
        self.phi, self.G = dense(self.system, self.work)
        raise_user_error(self.system)

    @property
    def nu(self) -> Array:
        """ν (rows,) where it was gone to."""
        return self._by_rows(self.work.nu)

    @property
    def gamma(self) -> Array:
        """γ (rows,) at the rates there."""
        return self._by_rows(self.work.gamma)

    def _by_rows(self, numbers: Array) -> Array:
        node = self.system.layout.primitive_node[self.primitive]
        return np.asarray(self.unit * numbers[2 * node + self.row, 0])

    def form(self, x: Array, v: Array, clock: float, later: float = 0.0) -> Array:
        """γ as a homogeneous quadratic form of the rates v and the rate of the clock: (rows,)."""
        forms = []
        for rates in (v, -v, None):
            self.at(x, rates, later)
            forms.append(self.gamma)
        there, back, still = forms
        return np.asarray(
            0.5 * (there + back) - still + 0.5 * clock * (there - back) + clock**2 * still
        )


class Singular:
    """A singular position near a closed one.

    Attributes
    ----------
    x : array (coordinates,)
        The singular position.
    ways : array (unknowns, coordinates)
        Φ_q v = ν has the solutions y @ ways; of them the last where drivers move, at the rate one
        of the clock, else all are free motions to first order.
    clock : array (unknowns,)
        Rate of the clock in each of them.
    A : array (quadrics, unknowns, unknowns)
        The second-order conditions.
    y : array (unknowns,)
        Where the given position is from the singular one.
    """

    def __init__(self, rows: ConstraintRows, x: Array, given: Array, rank: int) -> None:
        self.rows, self.x, self.rank = rows, x, rank
        rows.at(x)
        self.G, nu = rows.G, rows.nu
        u, sizes, vt = np.linalg.svd(self.G)
        self.inverse = (vt[:rank].T / sizes[:rank]) @ u[:, :rank].T
        self.L, self.N = u[:, rank:], vt[rank:]
        driven_rate = max(np.abs(nu).max(initial=0.0), np.abs(rows.gamma).max(initial=0.0))
        self.steady = not driven_rate > 0.0
        self.fits = bool(
            np.abs(self.L.T @ nu).max(initial=0.0) <= 1e-9 * np.abs(nu).max(initial=0.0)
        )
        ways, clock = self.N, np.zeros(len(self.N))
        if not self.steady:
            ways, clock = np.vstack([ways, self.inverse @ nu]), np.append(clock, 1.0)
        self.ways, self.clock = ways, clock
        self.A = self._quadrics()
        self.y = np.append(self.N @ (given - x), [0.0] * (len(ways) - len(self.N)))

    def _quadrics(self) -> Array:
        """Lᵀ γ as a form in y, dependencies that stay left out."""
        K = len(self.ways)
        A = np.zeros((self.L.shape[1], K, K))
        for i in range(K):
            A[:, i, i] = self.L.T @ self.rows.form(self.x, self.ways[i], self.clock[i])
        for i in range(K):
            for j in range(i):
                both = self.rows.form(
                    self.x, self.ways[i] + self.ways[j], self.clock[i] + self.clock[j]
                )
                A[:, i, j] = A[:, j, i] = 0.5 * (self.L.T @ both - A[:, i, i] - A[:, j, j])
        self.basis = np.zeros((0, len(A)))
        if not A.size:
            return A[:0]
        u, sizes, vt = np.linalg.svd(A.reshape(len(A), -1), full_matrices=False)
        kept = sizes > 1e-9 * max(1.0, float(sizes[0]))
        self.basis = u[:, kept].T
        return np.asarray((sizes[kept, None] * vt[kept]).reshape(-1, K, K))

    @property
    def decides(self) -> bool:
        """Whether conditions of second order restrict the velocities."""
        return len(self.A) > 0

    def velocity(self, y: Array) -> Array:
        """Rates (coordinates,) with their units."""
        return np.asarray(self.rows.scale * (y @ self.ways))

    def unknowns(self, v: Array) -> Array:
        """y of rates (coordinates,) with their units."""
        part = self.N @ (v / self.rows.scale)
        if self.steady:
            return np.asarray(part)
        return np.append(part - self.N @ self.ways[-1], 1.0)

    def admits(self, y: Array, part: float) -> bool:
        """Whether rates are those of a motion, within a part of them."""
        return bool(np.abs(values(self.A, y)).max(initial=0.0) <= part * size(self.A, y))

    def branches(self, y: Array) -> ConeBranches:
        """The branches that contain y."""
        return through(self.A, y)

    # -- along a branch -----------------------------------------------------------------------

    def bend(self, T: Array, y: Array) -> Array:
        """Second derivative of the position (coordinates,) along a branch at the velocity y, apart
        from what is along the branch.
        """
        if is_flat(self.A, tangent(self.A, y)) and y.any():
            return self._bend(y)
        # y may lie in other branches too; the form follows from others in this one
        random = np.random.default_rng(3)
        beside = random.normal(size=len(T)) @ T
        beside *= max(float(np.linalg.norm(y)), 1.0) / float(np.linalg.norm(beside))
        return 0.5 * (self._bend(y + beside) + self._bend(y - beside)) - self._bend(beside)

    def bend_of(self, T: Array, y: Array, w: Array) -> Array:
        """The same as a bilinear form."""
        return 0.25 * (self.bend(T, y + w) - self.bend(T, y - w))

    def _bend(self, y: Array) -> Array:
        """By the conditions of second and third order."""
        norm = float(np.linalg.norm(y))
        y = y / norm
        clock, v = float(self.clock @ y), y @ self.ways
        first = self.inverse @ self.rows.form(self.x, v, clock)
        n = len(self.N)
        D = np.einsum("ijk,k->ij", self.A[:, :n, :], y)
        if not len(D):
            return np.asarray(norm**2 * first)
        third = self._third(first, v, clock)
        # Lᵀ d/dt(Φ_q a − γ) changes by −3 D z where a changes by N z
        z = np.linalg.lstsq(3.0 * D, self.basis @ third, rcond=1e-7)[0]
        return np.asarray(norm**2 * (first + z @ self.N))

    def _third(self, a: Array, v: Array, clock: float) -> Array:
        """Lᵀ d/dt(Φ_q a − γ) along x + v s + a s²/2, of which the clock goes at its own rate."""

        def unmet(s: float) -> Array:
            x, later = self.x + s * v + 0.5 * s * s * a, clock * s
            there = self.rows.form(x, v + s * a, clock, later)
            return np.asarray(self.L.T @ (self.rows.G @ a - there))

        near = unmet(STEP) - unmet(-STEP)
        far = unmet(2.0 * STEP) - unmet(-2.0 * STEP)
        return np.asarray((8.0 * near - far) / (12.0 * STEP))


def singular(system: System, work: Work, t: float, far: float = FAR) -> Singular | None:
    """The singular position at or near a closed one; None where there is none.

    Parameters
    ----------
    work : Work
        A workspace of its own at the position, its signals set.
    far : float
        How far away it may be, in model lengths and radians.
    """
    if too_large(system) or not system.rows:
        return None
    rows = ConstraintRows(system, work, t)
    given = work.q[: system.coordinates, 0] / rows.scale
    rows.at(given)
    if not np.isfinite(rows.G).all():
        return None
    sizes = np.linalg.svd(rows.G, compute_uv=False)
    for rank in range(
        int((sizes > NEAR * sizes[0]).sum()), int((sizes > ZERO * sizes[0]).sum()) + 1
    ):
        found = _nearest(rows, given, rank, far)
        if found is not None:
            place = Singular(rows, found, given, rank)
            if not place.fits:
                return None
            return place if place.decides else None
    return None


def _nearest(rows: ConstraintRows, given: Array, rank: int, far: float) -> Array | None:
    """The position nearest to a closed one at which Φ_q has that rank."""
    x = given.copy()
    for _ in range(CORRECTIONS):
        rows.at(x)
        G, phi = rows.G, rows.phi
        u, sizes, vt = np.linalg.svd(G)
        L, N = u[:, rank:], vt[rank:]
        left = L.T @ G @ N.T
        open_, reach = float(np.abs(phi).max()), 1.0 + float(np.abs(x).max())
        if np.abs(left).max(initial=0.0) <= 1e-15 * sizes[0] * reach and open_ <= CLOSED * reach:
            return x
        step = -(vt[:rank].T / sizes[:rank]) @ (u[:, :rank].T @ phi)
        if left.size:
            step = step + _towards(rows, x, L, N, left) @ N
        x = x + step
        if not np.linalg.norm(x - given) < far:
            return None
        if np.abs(step).max() <= 1e-15 * reach:
            break
    rows.at(x)
    u, sizes, _ = np.linalg.svd(rows.G)
    shut = np.abs(rows.phi).max() <= CLOSED * (1.0 + float(np.abs(x).max()))
    gone = sizes[rank:].max(initial=0.0) <= VANISHES * sizes[0]
    return x if shut and gone else None


def _towards(rows: ConstraintRows, x: Array, L: Array, N: Array, left: Array) -> Array:
    """y with which LᵀΦ_q N vanishes: its change along N by differences."""
    change = np.empty((*left.shape, len(N)))
    for n, way in enumerate(N):
        rows.at(x + STEP * way)
        there = rows.G
        rows.at(x - STEP * way)
        change[:, :, n] = L.T @ (there - rows.G) @ N.T / (2.0 * STEP)
    return np.asarray(np.linalg.lstsq(change.reshape(-1, len(N)), -left.reshape(-1), rcond=1e-7)[0])
