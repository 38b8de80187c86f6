"""The surface of closed positions of two free motions, covered by places.

Places are added beside others until none is left that is further than a spacing from all. Each has
a drive r and a stiffness K, and its neighbours show how far r − K y misses the drive beside it:
where that, taken twice, leaves no zero in reach, there is none.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.position.many_positions import ManyPositions, orthonormal
from mbody.analysis.position.tangent_space import Array, Manifold, Place

__all__ = ["Cover", "CoverNode", "whole_turns_less"]

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
    name: Array = field(repr=False)


@dataclass(frozen=True, eq=False)
class _Neighbours:
    """Every pair of places that are next to each other, in the tangent plane of the first.

    Attributes
    ----------
    first, second : array (pairs,)
        Numbers of the places, in the order of the first.
    begin : array (places + 1,)
        Which pairs each place is the first of.
    seen : array (pairs, 2)
    chords : array (pairs,)
    turns : array (pairs, 2, 2)
        From the frame of the second to that of the first, turned as little as possible.
    level : array (pairs,)
        Least cosine between both planes.
    """

    first: Array
    second: Array
    begin: Array
    seen: Array
    chords: Array
    turns: Array
    level: Array


class Cover:
    """Places all over the surface that a start lies on."""

    def __init__(self, manifold: Manifold, start: Place, frame: Array) -> None:
        self.manifold, self.scale, self.start = manifold, manifold.scale, start
        self.many = ManyPositions(manifold)
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
        name = self.name(place.q)
        return CoverNode(place, turn @ place.motions, reach, turn @ place.drive, name)

    def name(self, q: Array) -> Array:
        """Positions (…, coordinates) by numbers that whole turns leave alone."""
        pose = (q / self.scale).reshape(*q.shape[:-1], -1, 3)
        parts = [pose[..., 0], pose[..., 1], np.cos(pose[..., 2]), np.sin(pose[..., 2])]
        return np.concatenate(parts, axis=-1)

    def _add(self, node: CoverNode) -> None:
        n = len(self.nodes)
        self._names[n], self._reaches[n] = node.name, node.reach
        self.nodes.append(node)

    def near(self, name: Array) -> Array:
        """How far every place is."""
        return np.asarray(np.abs(self._names[: len(self.nodes)] - name).max(axis=1))

    def within(self, names: Array, apart: Array | float) -> tuple[Array, Array, Array]:
        """Pairs of positions, by their names (positions, numbers), and places that are nearer than
        `apart` (positions, 1) or (positions, places): numbers of both, and how far they are.
        """
        own = self._names[: len(self.nodes)]
        limit = np.broadcast_to(apart, (len(names), len(own)))
        # most are apart already by the two numbers that differ most all over the surface
        near = np.ones(limit.shape, dtype=bool)
        for column in np.ptp(own, axis=0).argsort()[-2:]:
            near &= np.abs(names[:, column, None] - own[:, column]) < limit
        first, second = np.nonzero(near)
        far = np.abs(names[first] - own[second]).max(axis=1)
        kept = far < limit[first, second]
        return first[kept], second[kept], far[kept]

    def _taken(self, names: Array, reach: Array) -> Array:
        """Whether there are places already at each of some positions."""
        own = np.minimum(self._reaches[: len(self.nodes)], reach[:, None])
        taken = np.zeros(len(names), dtype=bool)
        taken[self.within(names, SAME * own)[0]] = True
        return taken

    def _grow(self) -> None:
        """Add places around places until none is new, all around those that were added last at
        once.
        """
        waiting = list(self.nodes)
        while waiting and not self.full:
            waiting = self._ring(waiting)

    def _ring(self, around: list[CoverNode]) -> list[CoverNode]:
        """Add the places around some; those of them from which the surface goes on."""
        angles = np.arange(WAYS) * (2.0 * np.pi / WAYS)
        turns = np.column_stack([np.cos(angles), np.sin(angles)])
        ways = [(node, way / np.abs(way).max()) for node in around for way in turns @ node.frame]
        left = [(node, way, min(2.0 * node.reach, SPACING)) for node, way in ways]
        added: list[CoverNode] = []
        while left:
            # the guess says mostly whether the place is new; closing it is dear
            reaches = np.array([reach for *_, reach in left])
            guesses = np.array([n.place.q + self.scale * r * way for n, way, r in left])
            names = self.name(guesses)
            tried, later = list[int](), list[int]()
            taken = self._taken(names, 0.8 * reaches)
            for n, (name, reach) in enumerate(zip(names, 0.8 * reaches, strict=True)):
                if taken[n]:
                    continue
                others = np.abs(names[tried] - name).max(axis=1)
                alike = others < SAME * np.minimum(0.8 * reaches[tried], reach)
                (later if alike.any() else tried).append(n)
            again = [left[n] for n in later]
            if tried:
                frames = np.array([left[n][0].frame for n in tried])
                found = self.many.closed(guesses[tried], frames)
                level = np.zeros(len(tried))
                level[found.good] = orthonormal(found.ways[found.good])[1]
                moved = np.array([found.q[k] - left[n][0].place.q for k, n in enumerate(tried)])
                parts = np.abs(moved / self.scale).max(axis=1) / reaches[tried]
                fits = found.good & (level > LEVEL) & (parts > 0.5) & (parts < 1.6)
                which = np.flatnonzero(fits)
                places = dict(zip(which.tolist(), self.many.places(found, which), strict=True))
                names = self.name(np.where(fits[:, None], found.q, 0.0))
                old, taken = len(self.nodes), self._taken(names, reaches[tried])
                for k, n in enumerate(tried):
                    node, way, reach = left[n]
                    place = places.get(k)
                    if place is None or not np.isfinite(place.force).all():
                        if 0.5 * reach > LEAST:
                            again.append((node, way, 0.5 * reach))
                        continue
                    count, name = len(self.nodes), names[k]
                    beside = np.abs(self._names[old:count] - name).max(axis=1)
                    own = SAME * np.minimum(self._reaches[old:count], reach)
                    if taken[k] or (beside < own).any():
                        continue
                    if count == MOST:
                        self.full = True
                        return []
                    # the directions of the place are the nearest to the frame
                    new = CoverNode(place, place.motions, reach, place.drive, name)
                    self._add(new)
                    if self.far(place.q):
                        self.rim.append(new)
                    else:
                        added.append(new)
            left = again
        return added

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

    def seen(self, node: CoverNode, q: Array) -> Array:
        """Positions (…, coordinates) in the tangent plane of a place, whole turns left out:
        (…, 2).
        """
        return np.asarray(whole_turns_less((q - node.place.q) / self.scale) @ node.frame.T)

    @functools.cached_property
    def _every(self) -> tuple[Array, Array, Array, Array]:
        """Position, frame, drive and stiffness of all places."""
        q = np.array([node.place.q for node in self.nodes])
        frames = np.array([node.frame for node in self.nodes])
        rows = np.array([node.place.rows for node in self.nodes])
        forces = np.array([node.place.force for node in self.nodes])
        drives = np.array([node.drive for node in self.nodes])
        return q, frames, drives, self.many.stiffness(q, frames, rows, forces)

    @functools.cached_property
    def _neighbours(self) -> _Neighbours:
        q, frames, *_ = self._every
        count = len(self.nodes)
        first, second, apart = self.within(self._names[:count], 1.6 * self._reaches[:count, None])
        first, second = first[apart > 0.0], second[apart > 0.0]
        way = whole_turns_less((q[second] - q[first]) / self.scale)
        seen = np.einsum("nfc,nc->nf", frames[first], way)
        u, sizes, vt = np.linalg.svd(frames[first] @ frames[second].transpose(0, 2, 1))
        begin = np.searchsorted(first, np.arange(count + 1))
        chords = np.linalg.norm(way, axis=1)
        return _Neighbours(first, second, begin, seen, chords, u @ vt, sizes[:, -1])

    def box(self, number: int, overlap: float) -> tuple[Array, Array]:
        """Lower and upper bounds, in the tangent plane of a place, of what is nearer to it than to
        its neighbours by a factor.
        """
        beside = self._neighbours
        own = slice(*beside.begin[number : number + 2].tolist())
        seen, lengths = beside.seen[own], np.linalg.norm(beside.seen[own], axis=1)
        # the tangent plane shows where they are
        shown = (beside.chords[own] <= CHORD * lengths) & (beside.level[own] > LEVEL)
        reach = 1.5 * self.nodes[number].reach
        if shown.any():
            reach = 0.75 * float(lengths[shown].max())
        corners = [(-reach, -reach), (reach, -reach), (reach, reach), (-reach, reach)]
        for x, y in seen[shown].tolist():
            corners = _clipped(corners, x, y, 0.5 * overlap * (x * x + y * y))
        found = np.array(corners)
        return found.min(axis=0), found.max(axis=0)

    def excluded(self) -> Array:
        """Whether no zero lies within reach of each place."""
        _, _, drives, stiffness = self._every
        beside = self._neighbours
        found = np.zeros(len(self.nodes), dtype=bool)
        own = np.flatnonzero(np.diff(beside.begin) >= 3)
        if not own.size:
            return found
        first, y = beside.first, beside.seen
        turned = np.einsum("nab,nb->na", beside.turns, drives[beside.second])
        linear = drives[first] - np.einsum("nab,nb->na", stiffness[first], y)
        lengths = np.linalg.norm(y, axis=1)
        parts = np.linalg.norm(turned - linear, axis=1) / lengths**2
        bounds = beside.begin[:-1]
        kept = np.diff(beside.begin) > 0
        bend, longest = np.zeros(len(kept)), np.zeros(len(kept))
        bend[kept] = np.maximum.reduceat(parts, bounds[kept])
        longest[kept] = np.maximum.reduceat(lengths, bounds[kept])
        # places are no further than that from the nearest of the cover
        reach = 0.75 * longest[own]
        least = _least(drives[own], stiffness[own], reach)
        found[own] = least > SURE * bend[own] * reach**2
        return found


def whole_turns_less(way: Array) -> Array:
    """Differences of positions (…, coordinates) without units, whole turns left out."""
    way = way.copy()
    way[..., 2::3] = np.remainder(way[..., 2::3] + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(way)


def _clipped(
    corners: list[tuple[float, float]], x: float, y: float, most: float
) -> list[tuple[float, float]]:
    """What of a convex polygon lies where (x, y) · corner is at most so much."""
    found: list[tuple[float, float]] = []
    last = corners[-1]
    before = most - x * last[0] - y * last[1]
    for corner in corners:
        left = most - x * corner[0] - y * corner[1]
        if before * left < 0.0:
            part = before / (before - left)
            found.append(
                (last[0] + part * (corner[0] - last[0]), last[1] + part * (corner[1] - last[1]))
            )
        if left >= 0.0:
            found.append(corner)
        last, before = corner, left
    return found


def _least(r: Array, K: Array, reach: Array) -> Array:
    """The least |r − K y| of |y| up to reach: (places,), r (places, 2), K (places, 2, 2)."""
    u, s, _ = np.linalg.svd(K)
    part = np.einsum("nba,nb->na", u, r)
    low, high = np.zeros(len(r)), np.linalg.norm(part, axis=1) * s[:, 0] / reach + 1e-300
    for _ in range(40):  # the multiplier of |y| = reach
        middle = 0.5 * (low + high)
        y = s * part / (s**2 + middle[:, None])
        long = np.linalg.norm(y, axis=1) > reach
        low, high = np.where(long, middle, low), np.where(long, high, middle)
    y = s * part / (s**2 + high[:, None])
    return np.asarray(np.linalg.norm(part - s * y, axis=1))
