"""Points of a surface of positions where the ends of a load meet: there its force has no direction.

A spring that keeps a force at zero length pulls one way on one side of such a point and the other
way beyond it. The potential energy has a cone there, and rest positions may lie close beside it.
Where the ends only come close, its direction turns as quickly as they pass: a grid shows that only
where its cells are shorter than the load.

Ends that move along one line relative to each other, as of a spring along a slide, meet in a whole
curve of the surface: there the energy has a crease, and the force keeps its line and turns round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.equilibria.load_ends import LoadEnds, two_ended
from mbody.analysis.equilibria.surface_cover import Cover, CoverNode
from mbody.analysis.position.many_positions import orthonormal
from mbody.analysis.position.tangent_space import Array
from mbody.model.loads import Load

__all__ = ["JumpPoint", "Meetings", "ends_of", "may_meet", "meetings"]

#: Newton steps to a point, how often one is halved, and the distance of the ends there, in model
#: lengths.
ITERATIONS, HALVINGS, MET = 20, 5, 1e-11
#: How far a point may be from the nearest place, in reaches of it.
FURTHER = 1.5
#: Distance from the point at which forces are compared.
BESIDE = 1e-6
#: Forces that differ by less than this part of the greatest do not jump.
SMOOTH = 1e-4
#: Points nearer to each other than this are one.
ONE = 1e-6
#: Greatest radius around a point, and the part of the distance to the next one.
RADIUS, PART = 0.12, 0.45
#: Ends that move across their line by less than this part of what they move along it stay on it.
ON_LINE = 1e-6


@dataclass(frozen=True, eq=False)
class JumpPoint:
    """A point where a load jumps.

    Attributes
    ----------
    node : CoverNode
        The place of the cover in whose tangent plane it is.
    y : array (2,)
        Where it is there.
    radius : float
        Of the disc around it that has no other such point.
    """

    node: CoverNode
    q: Array
    y: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Meetings:
    """Where ends of loads meet and a force jumps.

    Attributes
    ----------
    points : list of JumpPoint
    sharp : list of Load
        The loads whose force jumps where their ends meet, or may: those that never meet among them.
    creased : list of bool
        Of each of these whether its ends meet in curves of the surface.
    """

    points: list[JumpPoint]
    sharp: list[Load]
    creased: list[bool]


def meetings(cover: Cover, ends: LoadEnds, nodes: list[int], near: Array) -> Meetings:
    """All points near some places of a cover where ends of loads meet and a force jumps, and the
    loads whose ends meet in curves.

    Parameters
    ----------
    nodes : list of int
        Numbers of the places.
    near : array (nodes of the cover, loads)
        As of `may_meet`.
    """
    found: list[tuple[CoverNode, Array]] = []
    sharp, creased = list[Load](), list[bool]()
    for n, load in enumerate(ends.loads):
        beside = [k for k in nodes if near[k, n]]
        met, on_line = _met(cover, ends, n, beside)
        # along a curve the force at the distance zero is the same everywhere
        curve = bool(met) and on_line and bool(ends.along[n])
        jumping = [one for one in (met[:1] if curve else met) if _jumps(cover, *one)]
        if not jumping and met:
            continue
        sharp.append(load)
        creased.append(curve)
        if not curve:
            found += [one for one in jumping if _is_new(cover, one[1], found)]
    points = []
    for node, q in found:
        others = [_apart(cover, q, other) for _, other in found if other is not q]
        radius = min(RADIUS, PART * min(others, default=np.inf))
        points.append(JumpPoint(node, q, cover.seen(node, q), radius))
    return Meetings(points, sharp, creased)


def ends_of(cover: Cover) -> LoadEnds:
    """Those of all loads that have two."""
    system = cover.manifold.system
    return LoadEnds(system, two_ended(system))


def may_meet(cover: Cover, ends: LoadEnds) -> Array:
    """Whether the ends of each load may meet, or pass close by, within reach of each place of the
    cover: (nodes, loads).
    """
    q = np.array([node.place.q for node in cover.nodes])
    frames = np.array([node.frame for node in cover.nodes])
    reach = np.array([[node.reach] for node in cover.nodes])
    sizes = np.linalg.norm(ends.slopes(q, frames), axis=(-2, -1))
    return np.asarray(
        np.linalg.norm(ends.vectors(q), axis=-1) <= FURTHER * reach * sizes + reach**2
    )


def _apart(cover: Cover, one: Array, other: Array) -> float:
    """How far two positions are from each other, whole turns left out."""
    return float(np.abs(cover.name(one) - cover.name(other)).max())


def _is_new(cover: Cover, q: Array, found: list[tuple[CoverNode, Array]]) -> bool:
    return all(_apart(cover, q, other) > ONE for _, other in found)


def _met(
    cover: Cover, ends: LoadEnds, n: int, nodes: list[int]
) -> tuple[list[tuple[CoverNode, Array]], bool]:
    """The positions near places at which the ends of a load meet, with these places, and whether
    they move along a line there: by Newton's method from all places at once.
    """
    if not nodes:
        return [], False
    beside, many, scale = [cover.nodes[k] for k in nodes], cover.many, cover.scale
    names = np.array([node.name for node in beside])
    reach = np.array([node.reach for node in beside])
    q = np.array([node.place.q for node in beside])
    ways = np.array([node.frame for node in beside])
    d = ends.vectors(q)[:, n]
    met, on_line = list[tuple[CoverNode, Array]](), True
    left = np.arange(len(beside))
    for _ in range(ITERATIONS):
        J = ends.slopes(q[left], ways[left])[:, n]
        there = np.linalg.norm(d[left], axis=1) < MET
        for k, own in zip(left[there].tolist(), J[there], strict=True):
            sizes = np.linalg.svd(own, compute_uv=False)
            line = bool(sizes[1] <= ON_LINE * sizes[0])
            on_line &= line
            # of a curve one is enough
            if not (met and line and on_line) and _is_new(cover, q[k], met):
                met.append((beside[k], q[k].copy()))
        left, J = left[~there], J[~there]
        if not left.size:
            break
        step = -np.einsum("nfd,nd->nf", np.linalg.pinv(J, rcond=1e-6), d[left])
        along = np.einsum("nf,nfc->nc", step, ways[left])
        size = np.maximum(np.abs(along).max(axis=1), 1e-300)
        along *= np.minimum(1.0, reach[left] / size)[:, None]
        # where two such points are close to each other a whole step overshoots
        trying, kept = np.arange(len(left)), np.zeros(len(left), dtype=bool)
        for _ in range(HALVINGS):
            own = left[trying]
            found = many.closed(q[own] + scale * along[trying], ways[own])
            moved = np.where(found.good[:, None], ends.vectors(found.q)[:, n], np.inf)
            nearer = np.linalg.norm(moved, axis=1) < np.linalg.norm(d[own], axis=1)
            kept[trying[nearer]] = True
            q[own[nearer]], d[own[nearer]] = found.q[nearer], moved[nearer]
            ways[own[nearer]] = orthonormal(found.ways[nearer])[0]
            along[trying] *= 0.5
            trying = trying[~nearer]
            if not trying.size:
                break
        near = np.abs(cover.name(q[left]) - names[left]).max(axis=1) <= 2.0 * reach[left]
        left = left[kept & near]
        if not left.size:
            break
    return met, on_line


def _jumps(cover: Cover, node: CoverNode, q: Array) -> bool:
    """Whether the forces differ on both sides of a position."""
    manifold = cover.manifold
    for way in node.frame:
        sides = [manifold.closed(q + sign * BESIDE * manifold.scale * way) for sign in (1.0, -1.0)]
        if sides[0] is None or sides[1] is None:
            continue
        one, other = (manifold.force(side) for side in sides if side is not None)
        if not np.abs(one - other).max() <= SMOOTH * manifold.largest(sides[0]):
            return True
    return False
