"""Real solutions of quadrics yᵀ A_i y = 0 that also meet linear conditions P y = p.

At a singular position the second-order condition on velocities is such a set of quadrics. Where one
unknown is left they are solved in closed form, otherwise by Gauss–Newton from many fixed starts,
until every solution that was found was found several times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = [
    "ConeBranches",
    "Solutions",
    "is_flat",
    "size",
    "solutions",
    "tangent",
    "through",
    "values",
]

Array = np.ndarray

#: A quadric is met, and two solutions are one, within this part of their size.
MET, SAME = 1e-10, 1e-6
#: A singular value below this part of the greatest is zero.
ZERO = 1e-7
#: Starts of one round, rounds at most, and steps of one search.
STARTS, ROUNDS, STEPS = 64, 12, 60
#: How often each solution must be met before the list counts as complete.
OFTEN = 5
#: Solutions beyond which no more are looked for.
MANY = 64


@dataclass(frozen=True, eq=False)
class Solutions:
    """What was found.

    Attributes
    ----------
    points : list of array (unknowns,)
        The requested points, no two the same: of a branch of several freedoms the one of
        least length.
    complete : bool
        Whether there are hardly any others.
    flat : bool
        Whether all belong to branches with a tangent space: second order decides.
    """

    points: list[Array]
    complete: bool = True
    flat: bool = True


@dataclass(frozen=True, eq=False)
class ConeBranches:
    """The branches of a cone.

    Attributes
    ----------
    spaces : list of array (dimension, unknowns)
        Their tangent spaces, orthonormal bases.
    odd : array (points, unknowns)
        Unit vectors of the cone that belong to none of them: there second order does not decide.
    complete : bool
        Whether hardly any are missing.
    """

    spaces: list[Array]
    odd: Array
    complete: bool = True


def values(A: Array, y: Array) -> Array:
    """yᵀ A_i y: (quadrics,)."""
    return np.asarray(np.einsum("ijk,j,k->i", A, y, y))


def size(A: Array, y: Array) -> float:
    """What rounding of `values` is relative to."""
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
    rank = int((sizes > ZERO * max(top, 1e-300)).sum())
    return np.asarray(vt[rank:])


def is_flat(A: Array, T: Array) -> bool:
    """Whether all quadrics vanish on the whole of a space with the basis T."""
    inside = np.einsum("ijk,aj,bk->iab", A, T, T)
    return bool(np.abs(inside).max(initial=0.0) <= 1e-6 * np.abs(A).max(initial=0.0))


def solutions(A: Array, P: Array, p: Array) -> Solutions:
    """All y (unknowns,) with yᵀ A_i y = 0 and P y = p, p not zero; of a branch the shortest.

    Parameters
    ----------
    A : array (quadrics, unknowns, unknowns)
        Symmetric.
    P, p : arrays (conditions, unknowns), (conditions,)
        Conditions that agree with each other.
    """
    base, Z = _affine(P, p)
    if not len(Z):
        met = np.abs(values(A, base)).max(initial=0.0) <= MET * size(A, base)
        return Solutions([base] if met else [])
    if len(Z) == 1 and len(A):
        return _in_line(A, base, Z[0])
    return _searched(A, base, Z, P, p)


def _affine(P: Array, p: Array) -> tuple[Array, Array]:
    """The shortest y with P y = p, and a basis of what P leaves open."""
    u, sizes, vt = np.linalg.svd(P)
    rank = int((sizes > ZERO * max(sizes.max(initial=0.0), 1e-300)).sum())
    base = vt[:rank].T @ ((u.T @ p)[:rank] / sizes[:rank])
    return np.asarray(base), vt[rank:]


def _in_line(A: Array, base: Array, z: Array) -> Solutions:
    """Along base + s z: the roots of the quadric that bends most, where all others vanish too."""
    quadratic = np.einsum("ijk,j,k->i", A, z, z)
    linear = 2.0 * np.einsum("ijk,j,k->i", A, z, base)
    constant = values(A, base)
    far = float(np.linalg.norm(base))
    sizes = np.abs(quadratic) * far**2 + np.abs(linear) * far + np.abs(constant)
    top = np.abs(A).max() * far**2
    if sizes.max() <= MET * top:  # every velocity is one: take the least
        return Solutions([base])
    # a quadric that turns about its double root is no more precise than the root of rounding
    n = int((np.abs(quadratic) * far**2 + np.abs(linear) * far).argmax())
    a, b, c = quadratic[n] * far**2, linear[n] * far, constant[n]
    roots: list[float] = []
    if abs(a) > MET * top:
        inside = b * b - 4.0 * a * c
        if abs(inside) <= MET * sizes[n] ** 2:
            roots = [-b / (2.0 * a)]
        elif inside > 0.0:
            way = -0.5 * (b + np.copysign(np.sqrt(inside), b))
            roots = [way / a, c / way]
    elif abs(b) > MET * top:
        roots = [-c / b]
    points = [base + far * root * z for root in roots]
    return Solutions(
        [y for y in points if np.abs(values(A, y)).max() <= 1e3 * MET * size(A, y)],
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
    seen = [y for y in branches.odd if abs(y[0]) > SAME]
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
    """How many lines such a cone has at most, where lines are all it has (Bézout)."""
    sizes = np.linalg.svd(A.reshape(len(A), -1), compute_uv=False)
    rank = int((sizes > ZERO * sizes[0]).sum()) if sizes.max(initial=0.0) > 0.0 else 0
    return 2**rank if rank == A.shape[1] - 1 and rank < 60 else -1


def _same(one: Array, other: Array) -> bool:
    return float(np.linalg.norm(one - other)) <= SAME * max(
        float(np.linalg.norm(one)), float(np.linalg.norm(other))
    )


def _least(T: Array, P: Array, p: Array) -> Array | None:
    """The shortest y of a space with the basis T that meets P y = p."""
    inside = P @ T.T
    u, sizes, vt = np.linalg.svd(inside, full_matrices=False)
    # of a branch that P does not see there are only rounding errors
    kept = sizes > SAME * np.linalg.norm(P)
    y = (((u[:, kept].T @ p) / sizes[kept]) @ vt[kept]) @ T
    off = np.abs(P @ y - p).max(initial=0.0)
    return np.asarray(y) if off <= 1e-7 * max(np.abs(p).max(initial=0.0), 1e-300) else None


def _newton(A: Array, base: Array, Z: Array, starts: Array) -> list[Array]:
    """Points of base + span(Z) on the quadrics, from every start (starts, dimension)."""
    s = starts.copy()
    top = np.abs(A).max()
    for _ in range(STEPS):
        y = base + s @ Z
        Ay = np.einsum("ijk,nk->nij", A, y)
        f = np.einsum("nij,nj->ni", Ay, y)
        J = 2.0 * np.einsum("nij,dj->nid", Ay, Z)
        step = -np.einsum("ndi,ni->nd", np.linalg.pinv(J, rcond=1e-10), f)
        length = np.linalg.norm(step, axis=1)
        longest = 0.5 * np.linalg.norm(y, axis=1)
        step *= np.minimum(1.0, longest / np.maximum(length, 1e-300))[:, None]
        s = s + step
        if (np.linalg.norm(step, axis=1) <= 1e-15 * longest).all():
            break
    y = base + s @ Z
    off = np.abs(np.einsum("ijk,nj,nk->ni", A, y, y)).max(axis=1)
    good = off <= 1e-13 * top * np.einsum("nj,nj->n", y, y)
    return list(y[good])


def through(A: Array, y: Array) -> ConeBranches:
    """All branches that a velocity y on the quadrics lies in, y = 0 included."""
    own = tangent(A, y)
    # every branch through y lies in its tangent space: if that is one itself, there is no other
    if is_flat(A, own):
        return ConeBranches([own], np.zeros((0, A.shape[1])))
    # those of the cone within the tangent space, and y
    branches = _branches(np.einsum("ijk,aj,bk->iab", A, own, own))
    unit, found = y / max(float(np.linalg.norm(y)), 1e-300), list[Array]()
    for T in branches.spaces:
        both = np.vstack([unit, T @ own]) if y.any() else T @ own
        _, sizes, vt = np.linalg.svd(both)
        space = vt[: int((sizes > ZERO).sum())]
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
        elif np.abs(values(inner, base)).max() <= MET * size(inner, base):
            found.append(base)
    return found


def _same_space(one: Array, other: Array) -> bool:
    if len(one) != len(other):
        return False
    return bool(np.linalg.svd(one @ other.T, compute_uv=False)[-1] > 1.0 - 1e-9)
