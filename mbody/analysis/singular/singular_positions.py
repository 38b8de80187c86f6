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

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.system.rank import close_rows, dense
from mbody.system.system import System, too_large

# -- Real solutions of quadrics yᵀ A_i y = 0 that also meet linear conditions P y = p ----------
# At a singular position the second-order condition on velocities is such a set of quadrics. Where
# one unknown is left they are solved in closed form, otherwise by Gauss–Newton from many fixed
# starts, until every solution that was found was found several times.

Array = np.ndarray

#: Starts of one round, rounds at most, and steps of one search.
STARTS, ROUNDS, STEPS = 64, 12, 60
#: How often each solution must be met before the list counts as complete.
OFTEN = 5
#: Solutions beyond which no more are looked for.
MANY = 64


@dataclass(frozen=True, eq=False)
class Solutions:
    """Real solutions found, and whether all were.

    `points` (unknowns,): The requested points, no two the same: of a branch of several freedoms the
      one of least length.
    `complete`: Whether there are hardly any others.
    `flat`: Whether all belong to branches with a tangent space: second order decides.
    """

    points: list[Array]
    complete: bool = True
    flat: bool = True


@dataclass(frozen=True, eq=False)
class ConeBranches:
    """The branches of a cone.

    `spaces` (dimension, unknowns): Their tangent spaces, orthonormal bases.
    `odd` (points, unknowns): Unit vectors of the cone that belong to none of them: there second
      order does not decide.
    `complete`: Whether hardly any are missing.
    """

    spaces: list[Array]
    odd: Array
    complete: bool = True


def values(A: Array, y: Array) -> Array:
    """yᵀ A_i y: (quadrics,)."""
    return np.asarray(np.einsum("ijk,j,k->i", A, y, y))


def size(A: Array, y: Array) -> float:
    """Scale of the rounding of the quadratic forms `values`."""
    return float(np.abs(A).max(initial=0.0) * (y @ y))


def tangent(A: Array, y: Array) -> Array:
    """Orthonormal basis (dimension, unknowns) of the tangent space ker[A_i y] of the quadrics at
    y.
    """
    D = 2.0 * np.einsum("ijk,k->ij", A, y)
    if not len(D):
        return np.eye(A.shape[1])
    _, sizes, vt = np.linalg.svd(D)
    top = np.abs(A).max(initial=0.0) * np.linalg.norm(y)
    rank = int((sizes > tol.SINGULAR_VALUE_DEAD_CENTRE * max(top, tol.TINY)).sum())
    return np.asarray(vt[rank:])


def is_flat(A: Array, T: Array) -> bool:
    """Whether all quadrics vanish on the whole of a space with the basis T."""
    inside = np.einsum("ijk,aj,bk->iab", A, T, T)
    return bool(np.abs(inside).max(initial=0.0) <= tol.BRANCH_FLAT * np.abs(A).max(initial=0.0))


def solutions(A: Array, P: Array, p: Array) -> Solutions:
    """All y (unknowns,) with yᵀ A_i y = 0 and P y = p, p not zero; of a branch the shortest. A
    (quadrics, unknowns, unknowns), P (conditions, unknowns), `p` (conditions,).
    """
    base, Z = _affine(P, p)
    if not len(Z):
        met = np.abs(values(A, base)).max(initial=0.0) <= tol.BRANCH_CERTIFICATE * size(A, base)
        return Solutions([base] if met else [])
    if len(Z) == 1 and len(A):
        return _in_line(A, base, Z[0])
    return _searched(A, base, Z, P, p)


def _affine(P: Array, p: Array) -> tuple[Array, Array]:
    """The shortest y with P y = p, and a basis of what P leaves open."""
    u, sizes, vt = np.linalg.svd(P)
    rank = int(
        (sizes > tol.SINGULAR_VALUE_DEAD_CENTRE * max(sizes.max(initial=0.0), tol.TINY)).sum()
    )
    base = vt[:rank].T @ ((u.T @ p)[:rank] / sizes[:rank])
    return np.asarray(base), vt[rank:]


def _in_line(A: Array, base: Array, z: Array) -> Solutions:
    """Along base + s z: the roots of the quadric that bends most, where all others vanish too."""
    quadratic = np.einsum("ijk,j,k->i", A, z, z)
    linear = 2.0 * np.einsum("ijk,j,k->i", A, z, base)
    constant = values(A, base)
    distance = float(np.linalg.norm(base))
    sizes = np.abs(quadratic) * distance**2 + np.abs(linear) * distance + np.abs(constant)
    top = np.abs(A).max() * distance**2
    if sizes.max() <= tol.BRANCH_CERTIFICATE * top:  # every velocity is one: take the least
        return Solutions([base])
    # a quadric that turns about its double root is no more precise than the root of rounding
    n = int((np.abs(quadratic) * distance**2 + np.abs(linear) * distance).argmax())
    a, b, c = quadratic[n] * distance**2, linear[n] * distance, constant[n]
    roots: list[float] = []
    if abs(a) > tol.BRANCH_CERTIFICATE * top:
        inside = b * b - 4.0 * a * c
        if abs(inside) <= tol.BRANCH_CERTIFICATE * sizes[n] ** 2:
            roots = [-b / (2.0 * a)]
        elif inside > 0.0:
            stable = -0.5 * (b + np.copysign(np.sqrt(inside), b))
            roots = [stable / a, c / stable]
    elif abs(b) > tol.BRANCH_CERTIFICATE * top:
        roots = [-c / b]
    points = [base + distance * root * z for root in roots]
    return Solutions(
        [
            y
            for y in points
            if np.abs(values(A, y)).max() <= 1e3 * tol.BRANCH_CERTIFICATE * size(A, y)
        ]
    )


def _searched(A: Array, base: Array, Z: Array, P: Array, p: Array) -> Solutions:
    """By the branches of the cone over base + span(Z)."""
    hull = np.vstack([base / np.linalg.norm(base), Z])
    branches = _branches(np.einsum("ijk,aj,bk->iab", A, hull, hull))
    found: list[Array] = []
    for T in branches.spaces:
        least = _least(T @ hull, P, p)
        if least is not None and not any(_same(one, least) for one in found):
            found.append(least)
    seen = [y for y in branches.odd if abs(y[0]) > tol.BRANCH_SAME]
    return Solutions(found, branches.complete, flat=not seen)


def _branches(A: Array) -> ConeBranches:
    """The branches of the cone yᵀ A_i y = 0."""
    random = np.random.default_rng(1)
    found: list[Array] = []
    met: list[int] = []
    odd: list[Array] = []
    most = _most(A)
    for _ in range(ROUNDS):
        new = 0
        for w in _directions(A, random):
            T = tangent(A, w)
            if not is_flat(A, T):
                odd.append(w / np.linalg.norm(w))
                continue
            same = [n for n, one in enumerate(found) if _same_space(one, T)]
            if same:
                met[same[0]] += 1
            else:
                found.append(T)
                met.append(1)
                new += 1
        if len(found) == most or (not new and min(met, default=OFTEN) >= OFTEN):
            break
        if len(found) >= MANY:
            return ConeBranches(found, np.array(odd).reshape(-1, A.shape[1]), complete=False)
    else:
        return ConeBranches(found, np.array(odd).reshape(-1, A.shape[1]), complete=not found)
    return ConeBranches(found, np.array(odd).reshape(-1, A.shape[1]))


def _most(A: Array) -> int:
    """Greatest number of lines of such a cone, where lines are all it has (Bézout)."""
    sizes = np.linalg.svd(A.reshape(len(A), -1), compute_uv=False)
    rank = (
        int((sizes > tol.SINGULAR_VALUE_DEAD_CENTRE * sizes[0]).sum())
        if sizes.max(initial=0.0) > 0.0
        else 0
    )
    return 2**rank if rank == A.shape[1] - 1 and rank < 60 else -1


def _same(one: Array, other: Array) -> bool:
    return float(np.linalg.norm(one - other)) <= tol.BRANCH_SAME * max(
        float(np.linalg.norm(one)), float(np.linalg.norm(other))
    )


def _least(T: Array, P: Array, p: Array) -> Array | None:
    """The shortest y of a space with the basis T that meets P y = p."""
    inside = P @ T.T
    u, sizes, vt = np.linalg.svd(inside, full_matrices=False)
    # of a branch that P does not see there are only rounding errors
    kept = sizes > tol.BRANCH_SAME * np.linalg.norm(P)
    y = (((u[:, kept].T @ p) / sizes[kept]) @ vt[kept]) @ T
    off = np.abs(P @ y - p).max(initial=0.0)
    return (
        np.asarray(y)
        if off <= tol.BRANCH_ROWS_MET * max(np.abs(p).max(initial=0.0), tol.TINY)
        else None
    )


def _newton(A: Array, base: Array, Z: Array, starts: Array) -> list[Array]:
    """Points of base + span(Z) on the quadrics, from every start (starts, dimension)."""
    s = starts.copy()
    top = np.abs(A).max()
    for _ in range(STEPS):
        y = base + s @ Z
        Ay = np.einsum("ijk,nk->nij", A, y)
        f = np.einsum("nij,nj->ni", Ay, y)
        J = 2.0 * np.einsum("nij,dj->nid", Ay, Z)
        step = -np.einsum("ndi,ni->nd", np.linalg.pinv(J, rcond=tol.LEAST_SQUARES_RANK), f)
        length = np.linalg.norm(step, axis=1)
        longest = 0.5 * np.linalg.norm(y, axis=1)
        step *= np.minimum(1.0, longest / np.maximum(length, tol.TINY))[:, None]
        s = s + step
        if (np.linalg.norm(step, axis=1) <= tol.BRANCH_STEP_ROUNDING * longest).all():
            break
    y = base + s @ Z
    off = np.abs(np.einsum("ijk,nj,nk->ni", A, y, y)).max(axis=1)
    good = off <= tol.BRANCH_QUADRIC_SOLVED * top * np.einsum("nj,nj->n", y, y)
    return list(y[good])


def through(A: Array, y: Array) -> ConeBranches:
    """All branches that a velocity y on the quadrics lies in, y = 0 included."""
    own = tangent(A, y)
    # every branch through y lies in its tangent space: if that is one itself, there is no other
    if is_flat(A, own):
        return ConeBranches([own], np.zeros((0, A.shape[1])))
    # those of the cone within the tangent space, and y
    branches = _branches(np.einsum("ijk,aj,bk->iab", A, own, own))
    unit, found = y / max(float(np.linalg.norm(y)), tol.TINY), list[Array]()
    for T in branches.spaces:
        both = np.vstack([unit, T @ own]) if y.any() else T @ own
        _, sizes, vt = np.linalg.svd(both)
        space = vt[: int((sizes > tol.SINGULAR_VALUE_DEAD_CENTRE).sum())]
        if not any(_same_space(one, space) for one in found):
            found.append(space)
    return ConeBranches(found, branches.odd @ own, branches.complete)


def _directions(inner: Array, random: np.random.Generator) -> list[Array]:
    """Points of quadrics (quadrics, unknowns, unknowns) on random planes that miss the origin."""
    found: list[Array] = []
    for _ in range(STARTS // 4):
        row = random.normal(size=(1, inner.shape[1]))
        base, Z = _affine(row, np.linalg.norm(row, axis=1))
        if len(Z) > 1:
            found += _newton(inner, base, Z, random.normal(size=(8, len(Z))))
        elif len(Z) == 1:
            found += _in_line(inner, base, Z[0]).points
        elif np.abs(values(inner, base)).max() <= tol.BRANCH_CERTIFICATE * size(inner, base):
            found.append(base)
    return found


def _same_space(one: Array, other: Array) -> bool:
    if len(one) != len(other):
        return False
    return bool(np.linalg.svd(one @ other.T, compute_uv=False)[-1] > 1.0 - tol.BRANCH_SPACES_SAME)


#: Corrections to find a singular position nearby.
CORRECTIONS = 12


@dataclass
class ConstraintRows:
    """The rows of a system near an instant: Φ, Φ_q, ν and γ without units of length.

    `work`: A workspace, its signals set at the instant.
    `t`: The instant.
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
        if later != self.moving:
            self.work.time[:] = self.t + later
            laws_of_time(self.system.runtime(), self.work)
            self.moving = later
        self.work.v[: len(x), 0] = 0.0 if v is None else self.scale * v
        self.phi, self.G = dense(self.system, self.work, x)
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

    `x` (coordinates,): The singular position.
    `directions` (unknowns, coordinates): Φ_q v = ν has the solutions y @ directions; of them the
      last where drivers move, at the rate one of the clock, else all are free motions to first
      order.
    `clock` (unknowns,): Rate of the clock in each of them.
    `A` (quadrics, unknowns, unknowns): The second-order conditions.
    `y` (unknowns,): Where the given position is from the singular one.
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
            np.abs(self.L.T @ nu).max(initial=0.0)
            <= tol.BRANCH_DRIVERS_FIT * np.abs(nu).max(initial=0.0)
        )
        directions, clock = self.N, np.zeros(len(self.N))
        if not self.steady:
            directions, clock = np.vstack([directions, self.inverse @ nu]), np.append(clock, 1.0)
        self.directions, self.clock = directions, clock
        self.A = self._quadrics()
        self.y = np.append(self.N @ (given - x), [0.0] * (len(directions) - len(self.N)))

    def _quadrics(self) -> Array:
        """Lᵀ γ as a form in y, dependencies that stay left out."""
        K = len(self.directions)
        A = np.zeros((self.L.shape[1], K, K))
        for i in range(K):
            A[:, i, i] = self.L.T @ self.rows.form(self.x, self.directions[i], self.clock[i])
        for i in range(K):
            for j in range(i):
                both = self.rows.form(
                    self.x, self.directions[i] + self.directions[j], self.clock[i] + self.clock[j]
                )
                A[:, i, j] = A[:, j, i] = 0.5 * (self.L.T @ both - A[:, i, i] - A[:, j, j])
        self.basis = np.zeros((0, len(A)))
        if not A.size:
            return A[:0]
        u, sizes, vt = np.linalg.svd(A.reshape(len(A), -1), full_matrices=False)
        kept = sizes > tol.SINGULAR_VALUE_ZERO * max(1.0, float(sizes[0]))
        self.basis = u[:, kept].T
        return np.asarray((sizes[kept, None] * vt[kept]).reshape(-1, K, K))

    @property
    def decides(self) -> bool:
        """Whether conditions of second order restrict the velocities."""
        return len(self.A) > 0

    def velocity(self, y: Array) -> Array:
        """Rates (coordinates,) with their units."""
        return np.asarray(self.rows.scale * (y @ self.directions))

    def unknowns(self, v: Array) -> Array:
        """y of rates (coordinates,) with their units."""
        part = self.N @ (v / self.rows.scale)
        if self.steady:
            return np.asarray(part)
        return np.append(part - self.N @ self.directions[-1], 1.0)

    def branches(self, y: Array) -> ConeBranches:
        """The branches that contain y."""
        return through(self.A, y)

    # -- along a branch -----------------------------------------------------------------------

    def second_order(self, T: Array, y: Array) -> Array:
        """Second derivative of the position (coordinates,) along a branch at the velocity y, apart
        from what is along the branch.
        """
        if is_flat(self.A, tangent(self.A, y)) and y.any():
            return self._quadratic(y)
        # y may lie in other branches too; the form follows from others in this one
        random = np.random.default_rng(3)
        shift = random.normal(size=len(T)) @ T
        shift *= max(float(np.linalg.norm(y)), 1.0) / float(np.linalg.norm(shift))
        return 0.5 * (self._quadratic(y + shift) + self._quadratic(y - shift)) - self._quadratic(
            shift
        )

    def second_order_of(self, T: Array, y: Array, w: Array) -> Array:
        """Second derivative as a bilinear form on (y, w)."""
        return 0.25 * (self.second_order(T, y + w) - self.second_order(T, y - w))

    def _quadratic(self, y: Array) -> Array:
        """By the conditions of second and third order."""
        norm = float(np.linalg.norm(y))
        y = y / norm
        clock, v = float(self.clock @ y), y @ self.directions
        first = self.inverse @ self.rows.form(self.x, v, clock)
        n = len(self.N)
        D = np.einsum("ijk,k->ij", self.A[:, :n, :], y)
        if not len(D):
            return np.asarray(norm**2 * first)
        third = self._third(first, v, clock)
        # Lᵀ d/dt(Φ_q a − γ) changes by −3 D z where a changes by N z
        z = np.linalg.lstsq(3.0 * D, self.basis @ third, rcond=tol.SINGULAR_VALUE_DEAD_CENTRE)[0]
        return np.asarray(norm**2 * (first + z @ self.N))

    def _third(self, a: Array, v: Array, clock: float) -> Array:
        """Lᵀ d/dt(Φ_q a − γ) along x + v s + a s²/2, of which the clock goes at its own rate."""

        def unmet(s: float) -> Array:
            x, later = self.x + s * v + 0.5 * s * s * a, clock * s
            there = self.rows.form(x, v + s * a, clock, later)
            return np.asarray(self.L.T @ (self.rows.G @ a - there))

        inner = unmet(tol.DIFFERENCE_STEP_FOURTH_ORDER) - unmet(-tol.DIFFERENCE_STEP_FOURTH_ORDER)
        outer = unmet(2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER) - unmet(
            -2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER
        )
        return np.asarray((8.0 * inner - outer) / (12.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER))


def singular(
    system: System, work: Work, t: float, distance: float = tol.SINGULAR_DISTANCE_SOUGHT
) -> Singular | None:
    """The singular position at or near a closed one; None where there is none. `distance` in model
    lengths.
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
        int((sizes > tol.SINGULAR_VALUE_NEARBY * sizes[0]).sum()),
        int((sizes > tol.SINGULAR_VALUE_ZERO * sizes[0]).sum()) + 1,
    ):
        found = _nearest(rows, given, rank, distance)
        if found is not None:
            place = Singular(rows, found, given, rank)
            if not place.fits:
                return None
            return place if place.decides else None
    return None


def _nearest(rows: ConstraintRows, given: Array, rank: int, distance: float) -> Array | None:
    """The position nearest to a closed one at which Φ_q has that rank."""
    x = given.copy()
    for _ in range(CORRECTIONS):
        rows.at(x)
        G, phi = rows.G, rows.phi
        u, sizes, vt = np.linalg.svd(G)
        L, N = u[:, rank:], vt[rank:]
        left = L.T @ G @ N.T
        open_, norm = float(np.abs(phi).max()), 1.0 + float(np.abs(x).max())
        if (
            np.abs(left).max(initial=0.0) <= tol.BRANCH_STEP_ROUNDING * sizes[0] * norm
            and open_ <= tol.LOOP_CLOSURE_RESIDUAL * norm
        ):
            return x
        step = -(vt[:rank].T / sizes[:rank]) @ (u[:, :rank].T @ phi)
        if left.size:
            step = step + _towards(rows, x, L, N, left) @ N
        x = x + step
        if not np.linalg.norm(x - given) < distance:
            return None
        if np.abs(step).max() <= tol.BRANCH_STEP_ROUNDING * norm:
            break
    rows.at(x)
    u, sizes, _ = np.linalg.svd(rows.G)
    shut = np.abs(rows.phi).max() <= tol.LOOP_CLOSURE_RESIDUAL * (1.0 + float(np.abs(x).max()))
    gone = sizes[rank:].max(initial=0.0) <= tol.SINGULAR_VALUE_VANISHES * sizes[0]
    return x if shut and gone else None


def _towards(rows: ConstraintRows, x: Array, L: Array, N: Array, left: Array) -> Array:
    """y with which LᵀΦ_q N vanishes: its change along N by differences."""
    change = np.empty((*left.shape, len(N)))
    for n, direction in enumerate(N):
        rows.at(x + tol.DIFFERENCE_STEP_FOURTH_ORDER * direction)
        there = rows.G
        rows.at(x - tol.DIFFERENCE_STEP_FOURTH_ORDER * direction)
        change[:, :, n] = L.T @ (there - rows.G) @ N.T / (2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER)
    return np.asarray(
        np.linalg.lstsq(
            change.reshape(-1, len(N)), -left.reshape(-1), rcond=tol.SINGULAR_VALUE_DEAD_CENTRE
        )[0]
    )


# -- Branches of motion at a singular position: velocities in them, and places along them ------

#: Places on a branch from which positions near the singular one are interpolated, in steps: rows
#: are independent there.
PLACES = np.array([-7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0])


def norm(y: Array) -> float:
    """Euclidean."""
    return float(np.linalg.norm(y))


def along(T: Array, here: Singular) -> Array:
    """Place of a start along a branch (unknowns,); time is no displacement."""
    free = still(T, here.clock)
    return np.asarray((free @ here.y) @ free)


def fits(here: Singular, T: Array) -> bool:
    """Whether a start that is away from the singular position is on a branch; positions that are
    closed to rounding do not determine this within the root of rounding.
    """
    return norm(here.y - along(T, here)) <= 1e-2 * norm(here.y) + tol.SINGULAR_DISTANCE_UNDETERMINED


def onto(A: Array, y: Array, clock: Array) -> Array | None:
    """The nearest solution of yᵀ A_i y = 0, the rate of the clock kept, by Gauss–Newton."""
    found = y.copy()
    for _ in range(30):
        D = 2.0 * np.einsum("ijk,k->ij", A, found)
        D[:, clock > 0.0] = 0.0
        step = -np.linalg.lstsq(D, values(A, found), rcond=tol.LEAST_SQUARES_RANK_COARSE)[0]
        found = found + step
        if norm(step) <= tol.BRANCH_STEP_ROUNDING * norm(found):
            break
    good = np.abs(values(A, found)).max(initial=0.0) <= tol.BRANCH_SOLVED * size(A, found)
    return found if good else None


def frame(here: Singular, T: Array, place: Array) -> tuple[Array, Array]:
    """The position (coordinates,) at a place on a branch, near the singular one, and how it changes
    with the directions of T: (dimension, coordinates). Both without units of length.

    The place is measured along the branch, so that rows alone do not determine it near the singular
    position; it is interpolated from places farther off.
    """
    if not place.any():
        return here.x, T @ here.directions
    if here.clock.any():  # of second order where time goes on as well
        x = here.x + place @ here.directions + 0.5 * here.second_order(T, place)
        return x, np.array(
            [one @ here.directions + here.second_order_of(T, place, one) for one in T]
        )
    spread = np.vander(PLACES, increasing=True)
    value, change = np.linalg.inv(spread)[:2]
    x, changes = here.x, []
    for direction in T:
        points = np.array(
            [_on(here, T, place + tol.SINGULAR_BRANCH_STEP * c * direction) for c in PLACES]
        )
        x = value @ points
        changes.append(change @ points / tol.SINGULAR_BRANCH_STEP)
    return x, np.array(changes)


def _on(here: Singular, T: Array, place: Array) -> Array:
    """The position at a place that is away from the singular one, by Newton's method."""
    chart = T @ here.N
    x = here.x + place @ here.directions + 0.5 * here.second_order(T, place)

    def rows(x: Array) -> tuple[Array, Array]:
        here.rows.at(x)
        return here.rows.phi, here.rows.G

    return close_rows(rows, x, (chart, chart @ here.x + T @ place)).x


def still(T: Array, clock: Array) -> Array:
    """Tangent directions that leave the clock unchanged: (free, unknowns), orthonormal."""
    if not clock.any():
        return T
    rates = T @ clock
    _, sizes, vt = np.linalg.svd(rates[None])
    return np.asarray(vt[int((sizes > tol.SINGULAR_VALUE_ZERO).sum()) :] @ T)


def nearest(here: Singular, y: Array) -> Array | None:
    """The velocities of a branch nearest to others, the rate of the clock kept; None of none."""
    best: Array | None = None
    for T in here.branches(np.zeros(len(y))).spaces:
        free = still(T, here.clock)
        base = np.zeros(len(y))
        if here.clock.any():
            rates = T @ here.clock
            if not np.abs(rates).max() > tol.BRANCH_CLOCK_NONE:
                continue
            base = rates / (rates @ rates) * float(here.clock @ y) @ T
        found = base + ((y - base) @ free.T) @ free
        if best is None or np.linalg.norm(found - y) < np.linalg.norm(best - y):
            best = found
    return best


# -- Values that a start prescribes: coordinates of bodies and rates, as equations in q and v --

#: Keys of coordinates and rates by the row that both share: ∂(x, y, θ)/∂q = ∂(vx, vy, ω)/∂v.
X, Y, ROTATION = ("x", "vx"), ("y", "vy"), ("angle", "omega")


@dataclass(frozen=True)
class Prescribed:
    """A coordinate of a body, or its rate, and the value that it is to have.

    `key` is x or y of the origin of the body's axes, or angle; vx or vy of that origin, or omega.
    """

    body: str
    key: str
    value: float

    @property
    def name(self) -> str:
        """Such as "crank.angle"."""
        return f"{self.body}.{self.key}"

    def unit(self, system: System) -> float:
        """The length of the body's part, or one of angles: what values are divided by for
        `row`.
        """
        return 1.0 if self.key in ROTATION else self._length(system)

    def _length(self, system: System) -> float:
        return float(system.coordinate_units[3 * system.bodies[self.body]])

    def row(self, system: System, q: Array) -> Array:
        """Derivative by coordinates without units of length, (coordinates,), at a position q.

        The origin is r − A(θ) c with the mass centre r and its place c on the body, so that its
        derivative by θ is −A′(θ) c.
        """
        first = 3 * system.bodies[self.body]
        row = np.zeros(system.coordinates)
        if self.key in ROTATION:
            row[first + 2] = 1.0
            return row
        x, y = self._mass_centre(system, q)
        row[first + (self.key in Y)] = 1.0
        row[first + 2] = (-x if self.key in Y else y) / self._length(system)
        return row

    def at(self, system: System, q: Array) -> float:
        """The coordinate at a position q, by its unit."""
        first = 3 * system.bodies[self.body]
        if self.key in ROTATION:
            return float(q[first + 2])
        k = int(self.key in Y)
        return float(q[first + k] - self._mass_centre(system, q)[k]) / self._length(system)

    def _mass_centre(self, system: System, q: Array) -> tuple[float, float]:
        """The mass centre from the origin of the body's axes: A(θ) c."""
        cx, cy = system.numbers.point(f"{self.body}.cg")
        theta = q[3 * system.bodies[self.body] + 2]
        c, s = np.cos(theta), np.sin(theta)
        return c * cx - s * cy, s * cx + c * cy

    def unit_name(self, system: System) -> str:
        """Unit in which the value is written: angles in degrees, all else in the model's units."""
        units = system.mechanism.units
        names = {"angle": "deg", "x": units.length, "y": units.length}
        rate = "angular velocity" if self.key in ROTATION else "velocity"
        return names.get(self.key) or units.of(rate)

    def with_value(self, system: System, value: float) -> str:
        """Such as "crank.angle = 30 deg" or "crank.omega = 6 rad/s"."""
        number, digits = value, 6
        if self.key in ("x", "y", "angle"):
            number, digits = (np.degrees(value) if self.key == "angle" else value), 7
        return f"{self.name} = {number:.{digits}g} {self.unit_name(system)}"


# -- Words of first velocities: rates by name, and the velocities of branches that meet --------

#: Rates, and values of one rate, that a sentence names.
NAMED, VALUES = 4, 6
#: Rates that are named to distinguish branches.
RATES = 4


def place_words(system: System, t: float) -> str:
    """Such as "t = 0 s"."""
    return f"t = {t:.6g} {system.mechanism.units.time}"


def undecided(system: System, t: float) -> SolveError:
    """The sentence of a singular position that conditions of second order do not decide."""
    return SolveError(
        f"the motion of '{system.mechanism.name}' is not determined at {place_words(system, t)}: "
        "the position is singular, and conditions of second order do not determine the branches of "
        "its motion; begin a little beside it"
    )


def nearest_words(system: System, here: Singular, y: Array | None) -> str:
    """The nearest velocities that a motion has, as the end of a sentence."""
    if y is None:
        return ""
    return f"; begin with the nearest that one has, {rate_words(system, here.velocity(y))}"


def rate_words(system: System, v: Array) -> str:
    """Angular velocities of the first bodies, or velocities where none turns."""
    units = system.mechanism.units
    rates = v.reshape(-1, 3)
    top = float(np.abs(v).max())
    keys = ("omega",) if np.abs(rates[:, 2]).max() > tol.BRANCH_RATE_NONE * top else ("vx", "vy")
    listed_rates = [
        f"{body.name}.{key} = {_plain(rates[n, ('vx', 'vy', 'omega').index(key)], top)}"
        for n, body in enumerate(system.mechanism.bodies)
        for key in keys
    ]
    unit = units.of("angular velocity" if keys[0] == "omega" else "velocity")
    more = f" and {len(listed_rates) - NAMED} more" if len(listed_rates) > NAMED else ""
    return f"{', '.join(listed_rates[:NAMED])} {unit}{more}"


def values_of(
    system: System,
    here: Singular,
    velocities: Sequence[Array],
    prescribed: Sequence[Prescribed],
    which: Prescribed | None = None,
) -> list[str]:
    """Rates that distinguish branches, each with its values: "c.omega = 0 or 2 rad/s". `velocities`
    (coordinates,) without units of length.
    """
    q = here.rows.scale * here.x
    known = {one.name for one in prescribed}
    candidates = (
        [which]
        if which
        else [
            Prescribed(body.name, key, 0.0)
            for key in ("omega", "vx", "vy")
            for body in system.mechanism.bodies
            if f"{body.name}.{key}" not in known
        ]
    )
    top = max(float(np.abs(v).max()) for v in velocities)
    parts = {one: _classes(one.row(system, q) @ np.array(velocities).T, top) for one in candidates}
    distinct: list[tuple[int, ...]] = [()] * len(velocities)
    chosen = list[Prescribed]()
    while len(chosen) < RATES:
        best = max(candidates, key=lambda one: len(set(zip(distinct, parts[one], strict=True))))
        finer = [(*a, b) for a, b in zip(distinct, parts[best], strict=True)]
        if chosen and len(set(finer)) == len(set(distinct)):
            break
        distinct, chosen = finer, [*chosen, best]
    return [_with_values(system, one, velocities, q, top) for one in chosen]


def _classes(values: Array, top: float) -> list[int]:
    """Which values are the same, by number."""
    seen = list[float]()
    found = []
    for value in values:
        same = [n for n, other in enumerate(seen) if abs(value - other) <= tol.BRANCH_SAME * top]
        if not same:
            seen.append(float(value))
        found.append(same[0] if same else len(seen) - 1)
    return found


def _with_values(
    system: System, rate: Prescribed, velocities: Sequence[Array], q: Array, top: float
) -> str:
    row, values = rate.row(system, q), list[float]()
    for v in velocities:
        value = float(row @ v)
        if all(abs(value - other) > tol.BRANCH_SAME * top for other in values):
            values.append(value)
    size = rate.unit(system)
    numbers = [_plain(size * value, size * top) for value in sorted(values, key=abs)[:VALUES]]
    more = f" or {len(values) - VALUES} others" if len(values) > VALUES else ""
    return f"{rate.name} = {' or '.join(numbers)}{more} {rate.unit_name(system)}"


def _plain(value: float, top: float) -> str:
    return f"{0.0 if abs(value) <= tol.BRANCH_RATE_NONE * top else value:.6g}"
