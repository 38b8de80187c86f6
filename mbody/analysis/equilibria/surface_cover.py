"""The surface of closed positions of two free motions, covered by places.

Places are added beside others until none is left that is further than a spacing from all. Each has
a drive r and a stiffness K, and its neighbours show how far r − K y misses the drive beside it:
where that, taken twice, leaves no zero in reach, there is none.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.position.tangent_space import Array, Manifold, Place

__all__ = ["Cover", "CoverNode"]

#: Distance of neighbours in radians and model lengths of the fastest coordinate, the part of it at
#: which places are the same, and the least.
SPACING, SAME, LEAST = 0.4, 0.7, 0.05
#: Ways to go from each place.
WAYS = 8
#: Places at most, and how far from the start in model lengths.
MOST, FAR = 2400, 8.0
#: The error of r − K y, as a multiple of what neighbours show.
SURE = 2.0
#: Least cosine between the tangent planes of neighbours.
LEVEL = 0.8
#: How much longer than its part in the tangent plane the chord to a neighbour may be that bounds a
#: chart: one round a sharp bend, or on another sheet, is further than the plane shows.
CHORD = 1.1


@dataclass(frozen=True, eq=False)
class CoverNode:
    """A place of the cover.

    Attributes
    ----------
    frame : array (2, coordinates)
        Orthonormal free directions, carried along from the first place.
    reach : float
        Distance of its neighbours.
    """

    place: Place
    frame: Array
    reach: float
    drive: Array
    stiffness: Array
    name: Array = field(repr=False)


class Cover:
    """Places all over the surface that a start lies on."""

    def __init__(self, manifold: Manifold, start: Place, frame: Array) -> None:
        self.manifold, self.scale, self.start = manifold, manifold.scale, start
        self.nodes: list[CoverNode] = []
        self.rim: list[CoverNode] = []
        self.full = self.wound = False
        self._names = np.empty((MOST, 4 * (len(start.q) // 3)))
        self._reaches = np.empty(MOST)
        self._add(self.node(start, frame, SPACING))
        self._grow()

    @property
    def closed(self) -> bool:
        """Whether the surface is covered whole."""
        return not (self.full or self.rim)

    def node(self, place: Place, frame: Array, reach: float) -> CoverNode:
        """A place of the cover, its frame turned as little as possible from one nearby."""
        u, _, vt = np.linalg.svd(frame @ place.motions.T)
        turn = u @ vt
        K = turn @ self.manifold.stiffness(place) @ turn.T
        return CoverNode(
            place, turn @ place.motions, reach, turn @ place.drive, K, self.name(place.q)
        )

    def name(self, q: Array) -> Array:
        """A position by numbers that whole turns leave alone."""
        pose = (q / self.scale).reshape(-1, 3)
        parts = [pose[:, 0], pose[:, 1], np.cos(pose[:, 2]), np.sin(pose[:, 2])]
        return np.concatenate(parts)

    def _add(self, node: CoverNode) -> None:
        n = len(self.nodes)
        self._names[n], self._reaches[n] = node.name, node.reach
        self.nodes.append(node)

    def near(self, name: Array) -> Array:
        """How far every place is."""
        return np.asarray(np.abs(self._names[: len(self.nodes)] - name).max(axis=1))

    def _taken(self, name: Array, reach: float) -> bool:
        """Whether a place is there already."""
        own = np.minimum(self._reaches[: len(self.nodes)], reach)
        return bool((self.near(name) < SAME * own).any())

    def _grow(self) -> None:
        waiting = deque(self.nodes)
        angles = np.arange(WAYS) * (2.0 * np.pi / WAYS)
        while waiting:
            node = waiting.popleft()
            for angle in angles:
                way = np.cos(angle) * node.frame[0] + np.sin(angle) * node.frame[1]
                way /= np.abs(way).max()
                there = self._added(node, way)
                if there is None:
                    continue
                if len(self.nodes) == MOST:
                    self.full = True
                    return
                self._add(there)
                if self.far(there.place.q):
                    self.rim.append(there)
                else:
                    waiting.append(there)

    def _added(self, node: CoverNode, way: Array) -> CoverNode | None:
        """A new place in a direction; None where one is there already, or none closes."""
        reach = min(2.0 * node.reach, SPACING)
        while reach > LEAST:
            # the guess says mostly whether the place is new; closing it is dear
            if self._taken(self.name(node.place.q + self.scale * reach * way), 0.8 * reach):
                return None
            there = self.manifold.moved(node.place, reach * way)
            if there is not None and len(there.motions) == 2:
                level = np.linalg.svd(node.frame @ there.motions.T)[1]
                moved = float(np.abs((there.q - node.place.q) / self.scale).max())
                if level[-1] > LEVEL and 0.5 * reach < moved < 1.6 * reach:
                    if self._taken(self.name(there.q), reach):
                        return None
                    return self.node(there, node.frame, reach)
            reach *= 0.5
        return None

    def far(self, q: Array) -> bool:
        """Whether a position is further from the start than the cover goes."""
        way = (q - self.start.q) / self.scale
        return float(np.abs(way.reshape(-1, 3)[:, :2]).max(initial=0.0)) > FAR

    @property
    def borders(self) -> int:
        """How many closed lines the rim consists of."""
        left, count = list(self.rim), 0
        while left:
            ring, count = [left.pop()], count + 1
            for one in ring:  # grows on the way
                beside = [n for n in left if np.abs(n.name - one.name).max() < 1.6 * SPACING]
                left = [n for n in left if n not in beside]
                ring += beside
        return count

    def driven_out(self) -> bool:
        """Whether loads drive outward somewhere on the rim of what was covered."""
        for node in self.rim:
            way = ((node.place.q - self.start.q) / self.scale).reshape(-1, 3).copy()
            way[:, 2] = 0.0
            outward = node.frame.T @ (node.frame @ way.reshape(-1))
            if node.place.force @ outward > 1e-9 * float(np.abs(node.place.force).max(initial=0.0)):
                return True
        return False

    def tells_turns_apart(self) -> bool:
        """Whether a whole turn of some body changes the loads, as of a torsion spring."""
        first = self.nodes[0].place
        top = self.manifold.scale_of(first)
        for body in range(len(first.q) // 3):
            angles = np.array([node.place.q[3 * body + 2] for node in self.nodes])
            if np.ptp(angles) < 1.9 * np.pi:
                continue  # it does not turn round
            q = first.q.copy()
            q[3 * body + 2] += 2.0 * np.pi
            if np.abs(self.manifold.force(q) - first.force).max() > 1e-6 * top:
                return True
        return False

    def beside(self, node: CoverNode) -> list[CoverNode]:
        """The places next to one."""
        apart = self.near(node.name)
        return [self.nodes[n] for n in np.flatnonzero((apart > 0.0) & (apart < 1.6 * node.reach))]

    def seen(self, node: CoverNode, q: Array) -> Array:
        """A position in the tangent plane of a place, whole turns left out: (2,)."""
        return np.asarray(node.frame @ self._way(node, q))

    def chord(self, node: CoverNode, q: Array) -> float:
        """How far a position is from a place, whole turns left out."""
        return float(np.linalg.norm(self._way(node, q)))

    def _way(self, node: CoverNode, q: Array) -> Array:
        """From a place to a position, whole turns left out: (coordinates,)."""
        way = (q - node.place.q) / self.scale
        way[2::3] = np.remainder(way[2::3] + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(way)

    def _level(self, node: CoverNode, other: CoverNode) -> bool:
        """Whether the tangent plane of a place shows where a neighbour is."""
        q = other.place.q
        if self.chord(node, q) > CHORD * float(np.linalg.norm(self.seen(node, q))):
            return False
        return float(np.linalg.svd(node.frame @ other.frame.T)[1][-1]) > LEVEL

    def box(self, node: CoverNode, overlap: float) -> tuple[Array, Array]:
        """Lower and upper bounds, in the tangent plane of a place, of what is nearer to it than to
        its neighbours by a factor.
        """
        beside = [other for other in self.beside(node) if self._level(node, other)]
        ways = [self.seen(node, other.place.q) for other in beside]
        reach = 0.75 * max((float(np.linalg.norm(y)) for y in ways), default=2.0 * node.reach)
        corners = reach * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        for y in ways:
            corners = _clipped(corners, y, 0.5 * overlap * float(y @ y))
        return corners.min(axis=0), corners.max(axis=0)

    def excluded(self, node: CoverNode) -> bool:
        """Whether no zero lies within reach of a place."""
        beside = self.beside(node)
        bend, longest = 0.0, 0.0
        for other in beside:
            y = self.seen(node, other.place.q)
            u, _, vt = np.linalg.svd(node.frame @ other.frame.T)
            missed = (u @ vt) @ other.drive - (node.drive - node.stiffness @ y)
            length = float(np.linalg.norm(y))
            bend = max(bend, float(np.linalg.norm(missed)) / length**2)
            longest = max(longest, length)
        if len(beside) < 3:
            return False
        # places are no further than that from the nearest of the cover
        reach = 0.75 * longest
        return _least(node.drive, node.stiffness, reach) > SURE * bend * reach**2


def _clipped(corners: Array, way: Array, most: float) -> Array:
    """What of a convex polygon lies where way · y is at most so much."""
    left = most - corners @ way
    found = []
    for n in range(len(corners)):
        one, other = left[n - 1], left[n]
        if one * other < 0.0:
            part = one / (one - other)
            found.append(corners[n - 1] + part * (corners[n] - corners[n - 1]))
        if other >= 0.0:
            found.append(corners[n])
    return np.array(found)


def _least(r: Array, K: Array, reach: float) -> float:
    """The least |r − K y| of |y| up to reach."""
    y = np.linalg.lstsq(K, r, rcond=1e-12)[0]
    if np.linalg.norm(y) <= reach:
        return float(np.linalg.norm(r - K @ y))
    u, s, _ = np.linalg.svd(K)
    part = u.T @ r
    low, high = 0.0, float(np.linalg.norm(part) * s[0] / reach) + 1e-300
    for _ in range(40):  # the multiplier of |y| = reach
        middle = 0.5 * (low + high)
        long = float(np.linalg.norm(s * part / (s**2 + middle))) > reach
        low, high = (middle, high) if long else (low, middle)
    return float(np.linalg.norm(part - s * (s * part / (s**2 + high))))
