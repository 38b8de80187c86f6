"""Points of a surface of positions where the ends of a load meet: there its force has no direction.

A spring that keeps a force at zero length pulls one way on one side of such a point and the other
way beyond it. The potential energy has a cone there, and rest positions may lie close beside it.
Where the ends only come close, its direction turns as quickly as they pass: a grid shows that only
where its cells are shorter than the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.equilibria.surface_cover import Cover, CoverNode
from mbody.analysis.position import joint_places
from mbody.analysis.position.tangent_space import Array
from mbody.model.element import Element
from mbody.system.rank import rank_of

__all__ = ["JumpPoint", "end_vectors", "jump_points", "may_meet"]

#: Newton steps to a point, how often one is halved, and the distance of the ends there, in model
#: lengths.
ITERATIONS, HALVINGS, MET = 20, 5, 1e-11
#: How far a point may be from the nearest place, in reaches of it.
FURTHER = 1.5
#: Step of differences and distance from the point at which forces are compared.
STEP, BESIDE = 1e-5, 1e-6
#: Forces that differ by less than this part of the greatest do not jump.
SMOOTH = 1e-4
#: Greatest radius around a point, and the part of the distance to the next one.
RADIUS, PART = 0.12, 0.45


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


def jump_points(cover: Cover, nodes: list[CoverNode]) -> tuple[list[JumpPoint], list[Element]]:
    """All points near some places of a cover where ends of loads meet and a force jumps.

    Returns
    -------
    list of JumpPoint
    list of Element
        The loads whose force jumps where their ends meet, or may: those that never meet among them.
    """
    found: list[tuple[CoverNode, Array]] = []
    sharp = []
    for load in _with_ends(cover):
        met: list[tuple[CoverNode, Array]] = []
        for node in nodes:
            q = _meeting(cover, node, load)
            if q is not None and all(_apart(cover, q, other) > 1e-6 for _, other in met):
                met.append((node, q))
        jumping = [(node, q) for node, q in met if _jumps(cover, node, q)]
        if jumping or not met:
            sharp.append(load)
        for node, q in jumping:
            if all(_apart(cover, q, other) > 1e-6 for _, other in found):
                found.append((node, q))
    points = []
    for node, q in found:
        others = [_apart(cover, q, other) for _, other in found if other is not q]
        radius = min(RADIUS, PART * min(others, default=np.inf))
        points.append(JumpPoint(node, q, cover.seen(node, q), radius))
    return points, sharp


def end_vectors(cover: Cover, loads: Sequence[Element], q: Array) -> Array:
    """From one end of each load to the other, in model lengths: (loads, 2)."""
    return np.array([_between(cover, load, q) for load in loads]).reshape(-1, 2)


def may_meet(cover: Cover, node: CoverNode) -> bool:
    """Whether the ends of a load may meet, or pass close by, within reach of a place."""
    return any(_in_reach(cover, node, load) for load in _with_ends(cover))


def _with_ends(cover: Cover) -> list[Element]:
    loads = cover.manifold.system.mechanism.loads
    return [load for load in loads if hasattr(load, "i") and hasattr(load, "j")]


def _in_reach(cover: Cover, node: CoverNode, load: Element) -> bool:
    d = _between(cover, load, node.place.q)
    moved = [node.place.q + STEP * cover.manifold.scale * way for way in node.frame]
    rates = [np.linalg.norm(_between(cover, load, one) - d) / STEP for one in moved]
    most = FURTHER * node.reach * float(np.linalg.norm(rates)) + node.reach**2
    return bool(np.linalg.norm(d) <= most)


def _apart(cover: Cover, one: Array, other: Array) -> float:
    """How far two positions are from each other, whole turns left out."""
    return float(np.abs(cover.name(one) - cover.name(other)).max())


def _between(cover: Cover, load: Element, q: Array) -> Array:
    """From one end of a load to the other, in model lengths: (2,)."""
    system, pose = cover.manifold.system, np.append(q, np.zeros(3))
    i, j = (joint_places.place(system, pose, load, side) for side in "ij")
    return np.asarray((j - i) / system.length)


def _meeting(cover: Cover, node: CoverNode, load: Element) -> Array | None:
    """The position near a place at which the ends of a load meet; None where there is none."""
    manifold = cover.manifold
    if not _in_reach(cover, node, load):
        return None
    d = _between(cover, load, node.place.q)
    q, size = node.place.q, float(np.linalg.norm(d))
    for _ in range(ITERATIONS):
        if size < MET:
            return np.asarray(q)
        motions = rank_of(manifold.rows(q)[1]).motions
        moved = [q + STEP * manifold.scale * way for way in motions]
        J = np.column_stack([(_between(cover, load, one) - d) / STEP for one in moved])
        step = -np.linalg.lstsq(J, d, rcond=1e-6)[0] @ motions
        step *= min(1.0, node.reach / max(float(np.abs(step).max()), 1e-300))
        # where two such points are close to each other a whole step overshoots
        for _ in range(HALVINGS):
            there = manifold.closed(q + manifold.scale * step)
            if there is not None:
                d = _between(cover, load, there)
                if np.linalg.norm(d) < size:
                    break
            step *= 0.5
        else:
            return None
        q, size = there, float(np.linalg.norm(d))
        if np.abs(cover.name(q) - node.name).max() > 2.0 * node.reach:
            return None
    return None


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
