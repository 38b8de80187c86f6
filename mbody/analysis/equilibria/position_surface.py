"""The surface of closed positions of two free motions, covered by places.

Places are added beside others until none is left that is further than a spacing from all. Each has
a residual force r and a stiffness K, and its neighbours show how far r − K y misses the residual
force beside it: where that, taken twice, leaves no zero within the radius, there is none.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.position.tangent_space import (
    Array,
    ClosedPositions,
    Manifold,
    ManyPositions,
    Place,
    orthonormal,
)
from mbody.core import tolerances as tol
from mbody.core.bracket import zeros_between
from mbody.model.loads import Load
from mbody.system.system import System

# -- Ends of loads at positions: how far they are apart, and how that changes along the surface


def two_ended(system: System) -> list[Load]:
    """The loads that have two ends."""
    return [one for one in system.mechanism.loads if hasattr(one, "i") and hasattr(one, "j")]


class LoadEnds:
    """From one end of each of some loads to the other, in model lengths, at many positions.

    `numbers`: Of the loads, in the order of the description.
    `along` (loads,): Whether each pulls along the line between its ends.
    """

    def __init__(self, system: System, loads: Sequence[Load]) -> None:
        self.loads, self.length = list(loads), system.length
        every = list(system.mechanism.loads)
        self.numbers = [every.index(load) for load in loads]
        self.along = np.array([load.along_line for load in loads], dtype=np.bool_)
        ends = [(load, side) for side in "ij" for load in loads]
        # the ground is the last body and has no coordinates
        bodies = [system.bodies[load.place(side).body] for load, side in ends]
        body_fixed = [system.numbers.arm(load, side) for load, side in ends]
        self.bodies = np.array(bodies, dtype=np.int64).reshape(2, -1)
        self.body_fixed = np.array(body_fixed, dtype=float).reshape(2, -1, 2) / self.length

    def _poses_and_arms(self, q: Array) -> tuple[Array, Array]:
        """Poses (…, 2, loads, 3) in model lengths, and positions from mass centres in world
        axes (…, 2, loads, 2).
        """
        pose = q.reshape(*q.shape[:-1], -1, 3)
        pose = np.concatenate([pose, np.zeros((*q.shape[:-1], 1, 3))], axis=-2)
        pose = pose[..., self.bodies, :]
        pose[..., :2] /= self.length
        c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        x, y = self.body_fixed[..., 0], self.body_fixed[..., 1]
        return pose, np.stack([c * x - s * y, s * x + c * y], axis=-1)

    def vectors(self, q: Array) -> Array:
        """At positions (…, coordinates): (…, loads, 2)."""
        pose, relative = self._poses_and_arms(q)
        places = pose[..., :2] + relative
        return np.asarray(places[..., 1, :, :] - places[..., 0, :, :])

    def derivatives(self, q: Array, directions: Array) -> Array:
        """Change along directions (…, free, coordinates) without units: (…, loads, 2, free)."""
        relative = self._poses_and_arms(q)[1][..., None, :, :, :]
        rates = directions.reshape(*directions.shape[:-1], -1, 3)
        still = np.zeros((*rates.shape[:-2], 1, 3))
        rates = np.concatenate([rates, still], axis=-2)[..., self.bodies, :]
        rotational = np.stack([-relative[..., 1], relative[..., 0]], axis=-1) * rates[..., 2:]
        moved = rates[..., :2] + rotational
        return np.moveaxis(moved[..., 1, :, :] - moved[..., 0, :, :], -3, -1)


#: Directions to go from each place.
DIRECTIONS = 8
#: Places at most, and how far from the start in model lengths.
MOST, GREATEST_DISTANCE = 2400, 8.0


@dataclass(frozen=True, eq=False)
class CoverNode:
    """A place of the cover.

    `frame` (2, coordinates): Orthonormal free directions, carried along from the first place.
    `radius`: Distance of its neighbours.
    """

    place: Place
    frame: Array
    radius: float
    residual: Array
    name: Array = field(repr=False)


@dataclass(frozen=True, eq=False)
class _Neighbours:
    """Every pair of places that are next to each other, in the tangent plane of the first.

    `first`, `second` (pairs,): Numbers of the places, in the order of the first.
    `begin` (places + 1,): Which pairs each place is the first of.
    `seen` (pairs, 2)
    `chords` (pairs,)
    `rotations` (pairs, 2, 2): From the frame of the second to that of the first, rotated as little
      as possible.
    `level` (pairs,): Least cosine between both planes.
    """

    first: Array
    second: Array
    begin: Array
    seen: Array
    chords: Array
    rotations: Array
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
        self._radii = np.empty(MOST)
        self._add(self.node(start, frame, tol.SURFACE_SPACING))
        self._grow()

    @property
    def closed(self) -> bool:
        """Whether the surface is covered whole."""
        return not (self.full or self.rim)

    def node(self, place: Place, frame: Array, radius: float) -> CoverNode:
        """A place of the cover, its frame rotated as little as possible from one nearby."""
        u, _, vt = np.linalg.svd(frame @ place.motions.T)
        rotation = u @ vt
        name = self.name(place.q)
        return CoverNode(place, rotation @ place.motions, radius, rotation @ place.residual, name)

    def name(self, q: Array) -> Array:
        """Positions (…, coordinates) by numbers that whole revolutions leave alone."""
        pose = (q / self.scale).reshape(*q.shape[:-1], -1, 3)
        parts = [pose[..., 0], pose[..., 1], np.cos(pose[..., 2]), np.sin(pose[..., 2])]
        return np.concatenate(parts, axis=-1)

    def _add(self, node: CoverNode) -> None:
        n = len(self.nodes)
        self._names[n], self._radii[n] = node.name, node.radius
        self.nodes.append(node)

    def distances(self, name: Array) -> Array:
        """Distance of every place."""
        return np.asarray(np.abs(self._names[: len(self.nodes)] - name).max(axis=1))

    def within(self, names: Array, limits: Array | float) -> tuple[Array, Array, Array]:
        """Pairs of positions, by their names (positions, numbers), and places that are nearer than
        `limits` (positions, 1) or (positions, places): numbers of both, and how far they are.
        """
        own = self._names[: len(self.nodes)]
        limit = np.broadcast_to(limits, (len(names), len(own)))
        # most are apart already by the two numbers that differ most all over the surface
        close = np.ones(limit.shape, dtype=bool)
        for column in np.ptp(own, axis=0).argsort()[-2:]:
            close &= np.abs(names[:, column, None] - own[:, column]) < limit
        first, second = np.nonzero(close)
        distance = np.abs(names[first] - own[second]).max(axis=1)
        kept = distance < limit[first, second]
        return first[kept], second[kept], distance[kept]

    def _is_covered(self, names: Array, radius: Array) -> Array:
        """Whether there are places already at each of some positions."""
        own = np.minimum(self._radii[: len(self.nodes)], radius[:, None])
        covered = np.zeros(len(names), dtype=bool)
        covered[self.within(names, tol.SURFACE_SPACING_SAME * own)[0]] = True
        return covered

    def _grow(self) -> None:
        """Add places around places until none is new, all around those that were added last at
        once.
        """
        waiting = list(self.nodes)
        while waiting and not self.full:
            waiting = self._ring(waiting)

    def _ring(self, around: list[CoverNode]) -> list[CoverNode]:
        """Add the places around some; those of them from which the surface goes on."""
        angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
        unit_vectors = np.column_stack([np.cos(angles), np.sin(angles)])
        directions = [
            (node, direction / np.abs(direction).max())
            for node in around
            for direction in unit_vectors @ node.frame
        ]
        left = [
            (node, direction, min(2.0 * node.radius, tol.SURFACE_SPACING))
            for node, direction in directions
        ]
        added: list[CoverNode] = []
        while left:
            # the guess says mostly whether the place is new; closing it is dear
            radii = np.array([radius for *_, radius in left])
            guesses = np.array([n.place.q + self.scale * r * direction for n, direction, r in left])
            names = self.name(guesses)
            tried, later = list[int](), list[int]()
            covered = self._is_covered(names, 0.8 * radii)
            for n, (name, radius) in enumerate(zip(names, 0.8 * radii, strict=True)):
                if covered[n]:
                    continue
                others = np.abs(names[tried] - name).max(axis=1)
                alike = others < tol.SURFACE_SPACING_SAME * np.minimum(0.8 * radii[tried], radius)
                (later if alike.any() else tried).append(n)
            again = [left[n] for n in later]
            if tried:
                frames = np.array([left[n][0].frame for n in tried])
                found = self.many.closed(guesses[tried], frames)
                level = np.zeros(len(tried))
                level[found.good] = orthonormal(found.directions[found.good])[1]
                moved = np.array([found.q[k] - left[n][0].place.q for k, n in enumerate(tried)])
                parts = np.abs(moved / self.scale).max(axis=1) / radii[tried]
                fits = (
                    found.good & (level > tol.CHART_TANGENT_COSINE) & (parts > 0.5) & (parts < 1.6)
                )
                which = np.flatnonzero(fits)
                places = dict(zip(which.tolist(), self.many.places(found, which), strict=True))
                names = self.name(np.where(fits[:, None], found.q, 0.0))
                old, covered = len(self.nodes), self._is_covered(names, radii[tried])
                for k, n in enumerate(tried):
                    node, direction, radius = left[n]
                    place = places.get(k)
                    if place is None or not np.isfinite(place.force).all():
                        if 0.5 * radius > tol.SURFACE_SPACING_LEAST:
                            again.append((node, direction, 0.5 * radius))
                        continue
                    count, name = len(self.nodes), names[k]
                    distances = np.abs(self._names[old:count] - name).max(axis=1)
                    own = tol.SURFACE_SPACING_SAME * np.minimum(self._radii[old:count], radius)
                    if covered[k] or (distances < own).any():
                        continue
                    if count == MOST:
                        self.full = True
                        return []
                    # the directions of the place are the nearest to the frame
                    new = CoverNode(place, place.motions, radius, place.residual, name)
                    self._add(new)
                    if self.has_run_away(place.q):
                        self.rim.append(new)
                    else:
                        added.append(new)
            left = again
        return added

    def has_run_away(self, q: Array) -> bool:
        """Whether a position is further from the start than the cover goes."""
        displacement = (q - self.start.q) / self.scale
        return (
            float(np.abs(displacement.reshape(-1, 3)[:, :2]).max(initial=0.0)) > GREATEST_DISTANCE
        )

    @property
    def borders(self) -> int:
        """Number of closed lines of the rim."""
        left, count = list(self.rim), 0
        while left:
            ring, count = [left.pop()], count + 1
            for one in ring:  # grows on the way
                adjacent = [
                    n for n in left if np.abs(n.name - one.name).max() < 1.6 * tol.SURFACE_SPACING
                ]
                left = [n for n in left if n not in adjacent]
                ring += adjacent
        return count

    def driven_out(self) -> bool:
        """Whether loads drive outward somewhere on the rim of what was covered."""
        for node in self.rim:
            displacement = ((node.place.q - self.start.q) / self.scale).reshape(-1, 3).copy()
            displacement[:, 2] = 0.0
            outward = node.frame.T @ (node.frame @ displacement.reshape(-1))
            if node.place.force @ outward > tol.SURFACE_DRIVEN_OUT * float(
                np.abs(node.place.force).max(initial=0.0)
            ):
                return True
        return False

    def distinguishes_revolutions(self) -> bool:
        """Whether a whole revolution of some body changes the loads, as of a torsion spring."""
        first = self.nodes[0].place
        top = self.manifold.scale_of(first)
        for body in range(len(first.q) // 3):
            angles = np.array([node.place.q[3 * body + 2] for node in self.nodes])
            if np.ptp(angles) < 1.9 * np.pi:
                continue  # it does not turn round
            q = first.q.copy()
            q[3 * body + 2] += 2.0 * np.pi
            if np.abs(self.manifold.force(q) - first.force).max() > tol.SURFACE_TURN_FORCE * top:
                return True
        return False

    def seen(self, node: CoverNode, q: Array) -> Array:
        """Positions (…, coordinates) in the tangent plane of a place, whole revolutions left out:
        (…, 2).
        """
        return np.asarray(without_whole_revolutions((q - node.place.q) / self.scale) @ node.frame.T)

    @functools.cached_property
    def _every(self) -> tuple[Array, Array, Array, Array]:
        """Position, frame, residual force and stiffness of all places."""
        q = np.array([node.place.q for node in self.nodes])
        frames = np.array([node.frame for node in self.nodes])
        rows = np.array([node.place.rows for node in self.nodes])
        forces = np.array([node.place.force for node in self.nodes])
        residuals = np.array([node.residual for node in self.nodes])
        return q, frames, residuals, self.many.stiffness(q, frames, rows, forces)

    @functools.cached_property
    def _neighbours(self) -> _Neighbours:
        q, frames, *_ = self._every
        count = len(self.nodes)
        first, second, distance = self.within(self._names[:count], 1.6 * self._radii[:count, None])
        first, second = first[distance > 0.0], second[distance > 0.0]
        chord = without_whole_revolutions((q[second] - q[first]) / self.scale)
        seen = np.einsum("nfc,nc->nf", frames[first], chord)
        u, sizes, vt = np.linalg.svd(frames[first] @ frames[second].transpose(0, 2, 1))
        begin = np.searchsorted(first, np.arange(count + 1))
        chords = np.linalg.norm(chord, axis=1)
        return _Neighbours(first, second, begin, seen, chords, u @ vt, sizes[:, -1])

    def box(self, number: int, overlap: float) -> tuple[Array, Array]:
        """Lower and upper bounds, in the tangent plane of a place, of what is nearer to it than to
        its neighbours by a factor.
        """
        neighbours = self._neighbours
        own = slice(*neighbours.begin[number : number + 2].tolist())
        seen, lengths = neighbours.seen[own], np.linalg.norm(neighbours.seen[own], axis=1)
        # the tangent plane shows where they are
        visible = (neighbours.chords[own] <= tol.CHART_CHORD * lengths) & (
            neighbours.level[own] > tol.CHART_TANGENT_COSINE
        )
        radius = 1.5 * self.nodes[number].radius
        if visible.any():
            radius = 0.75 * float(lengths[visible].max())
        corners = [(-radius, -radius), (radius, -radius), (radius, radius), (-radius, radius)]
        for x, y in seen[visible].tolist():
            corners = _clipped(corners, x, y, 0.5 * overlap * (x * x + y * y))
        found = np.array(corners)
        return found.min(axis=0), found.max(axis=0)

    def excluded(self) -> Array:
        """Whether no zero lies within the radius of each place."""
        _, _, residuals, stiffness = self._every
        neighbours = self._neighbours
        found = np.zeros(len(self.nodes), dtype=bool)
        own = np.flatnonzero(np.diff(neighbours.begin) >= 3)
        if not own.size:
            return found
        first, y = neighbours.first, neighbours.seen
        rotated = np.einsum("nab,nb->na", neighbours.rotations, residuals[neighbours.second])
        linear = residuals[first] - np.einsum("nab,nb->na", stiffness[first], y)
        lengths = np.linalg.norm(y, axis=1)
        parts = np.linalg.norm(rotated - linear, axis=1) / lengths**2
        bounds = neighbours.begin[:-1]
        kept = np.diff(neighbours.begin) > 0
        second_derivative, longest = np.zeros(len(kept)), np.zeros(len(kept))
        second_derivative[kept] = np.maximum.reduceat(parts, bounds[kept])
        longest[kept] = np.maximum.reduceat(lengths, bounds[kept])
        # places are no further than that from the nearest of the cover
        radius = 0.75 * longest[own]
        least = _least(residuals[own], stiffness[own], radius)
        found[own] = least > tol.SURFACE_ERROR_SURE * second_derivative[own] * radius**2
        return found


def without_whole_revolutions(displacement: Array) -> Array:
    """Differences of positions (…, coordinates) without units, whole revolutions left out."""
    displacement = displacement.copy()
    displacement[..., 2::3] = np.remainder(displacement[..., 2::3] + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(displacement)


def _clipped(
    corners: list[tuple[float, float]], x: float, y: float, most: float
) -> list[tuple[float, float]]:
    """The part of a convex polygon where (x, y) · corner ≤ most."""
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


def _least(r: Array, K: Array, radius: Array) -> Array:
    """The least |r − K y| of |y| up to the radius: (places,), r (places, 2), K (places, 2, 2)."""
    u, s, _ = np.linalg.svd(K)
    part = np.einsum("nba,nb->na", u, r)
    high = np.linalg.norm(part, axis=1) * s[:, 0] / radius + tol.TINY
    low = high * 0.5**40

    def short(multiplier: Array) -> Array:
        """By how much |y| is less than the radius."""
        y = s * part / (s**2 + multiplier[:, None])
        return np.asarray(radius - np.linalg.norm(y, axis=1))

    brackets = zeros_between(short, low, high, short(low), short(high), low)
    y = s * part / (s**2 + np.array([[one.above] for one in brackets]))
    return np.asarray(np.linalg.norm(part - s * y, axis=1))


# -- Points of a surface where the ends of a load coincide and its force has no direction ------
# A spring that keeps a force at zero length pulls one way on one side of such a point and the other
# way beyond it. The potential energy has a cone there, and equilibria may lie close beside it.
# Where the ends only come close, its direction turns as quickly as they pass: a grid shows that
# only where its cells are shorter than the load.
#
# Ends that move along one line relative to each other, as of a spring along a slide, meet in a
# whole curve of the surface: there the energy has a nonsmooth line, and the force keeps its line
# and turns round.

#: Newton steps to a point, and how often one is halved.
ITERATIONS, HALVINGS = 20, 5


@dataclass(frozen=True, eq=False)
class JumpPoint:
    """A point where a load jumps.

    `node`: The place of the cover in whose tangent plane it is.
    `y` (2,): Where it is there.
    `radius`: Of the disc around it that has no other such point.
    """

    node: CoverNode
    q: Array
    y: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Meetings:
    """Where ends of loads meet and a force jumps.

    `sharp`: The loads whose force jumps where their ends meet, or may: those that never meet among
      them.
    `creased`: Of each of these whether its ends meet in curves of the surface.
    """

    points: list[JumpPoint]
    sharp: list[Load]
    creased: list[bool]


def meetings(cover: Cover, ends: LoadEnds, nodes: list[int], may_meet: Array) -> Meetings:
    """All points near some places of a cover where ends of loads meet and a force jumps, and the
    loads whose ends meet in curves. `may_meet` (nodes of the cover, loads).
    """
    found: list[tuple[CoverNode, Array]] = []
    sharp, creased = list[Load](), list[bool]()
    for n, load in enumerate(ends.loads):
        candidates = [k for k in nodes if may_meet[k, n]]
        met, on_line = _met(cover, ends, n, candidates)
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
        others = [_distance(cover, q, other) for _, other in found if other is not q]
        radius = min(tol.CHART_RADIUS, tol.CHART_RADIUS_PART * min(others, default=np.inf))
        points.append(JumpPoint(node, q, cover.seen(node, q), radius))
    return Meetings(points, sharp, creased)


def ends_of(cover: Cover) -> LoadEnds:
    """Those of all loads that have two."""
    system = cover.manifold.system
    return LoadEnds(system, two_ended(system))


def may_meet(cover: Cover, ends: LoadEnds) -> Array:
    """Whether the ends of each load may meet, or pass close by, within the radius of each place of
    the cover: (nodes, loads).
    """
    q = np.array([node.place.q for node in cover.nodes])
    frames = np.array([node.frame for node in cover.nodes])
    radius = np.array([[node.radius] for node in cover.nodes])
    sizes = np.linalg.norm(ends.derivatives(q, frames), axis=(-2, -1))
    return np.asarray(
        np.linalg.norm(ends.vectors(q), axis=-1) <= tol.CHART_FURTHER * radius * sizes + radius**2
    )


def _distance(cover: Cover, one: Array, other: Array) -> float:
    """Distance of two positions from each other, whole revolutions left out."""
    return float(np.abs(cover.name(one) - cover.name(other)).max())


def _is_new(cover: Cover, q: Array, found: list[tuple[CoverNode, Array]]) -> bool:
    return all(_distance(cover, q, other) > tol.POSITION_SAME for _, other in found)


def _met(
    cover: Cover, ends: LoadEnds, n: int, nodes: list[int]
) -> tuple[list[tuple[CoverNode, Array]], bool]:
    """The positions near places at which the ends of a load meet, with these places, and whether
    they move along a line there: by Newton's method from all places at once.
    """
    if not nodes:
        return [], False
    candidates, many, scale = [cover.nodes[k] for k in nodes], cover.many, cover.scale
    names = np.array([node.name for node in candidates])
    radius = np.array([node.radius for node in candidates])
    q = np.array([node.place.q for node in candidates])
    directions = np.array([node.frame for node in candidates])
    d = ends.vectors(q)[:, n]
    met, on_line = list[tuple[CoverNode, Array]](), True
    left = np.arange(len(candidates))
    for _ in range(ITERATIONS):
        J = ends.derivatives(q[left], directions[left])[:, n]
        there = np.linalg.norm(d[left], axis=1) < tol.SURFACE_END_MET
        for k, own in zip(left[there].tolist(), J[there], strict=True):
            sizes = np.linalg.svd(own, compute_uv=False)
            line = bool(sizes[1] <= tol.SURFACE_END_ON_LINE * sizes[0])
            on_line &= line
            # of a curve one is enough
            if not (met and line and on_line) and _is_new(cover, q[k], met):
                met.append((candidates[k], q[k].copy()))
        left, J = left[~there], J[~there]
        if not left.size:
            break
        step = -np.einsum(
            "nfd,nd->nf", np.linalg.pinv(J, rcond=tol.LEAST_SQUARES_RANK_COARSE), d[left]
        )
        along = np.einsum("nf,nfc->nc", step, directions[left])
        size = np.maximum(np.abs(along).max(axis=1), tol.TINY)
        along *= np.minimum(1.0, radius[left] / size)[:, None]
        # where two such points are close to each other a whole step overshoots
        trying, kept = np.arange(len(left)), np.zeros(len(left), dtype=bool)
        for _ in range(HALVINGS):
            own = left[trying]
            found = many.closed(q[own] + scale * along[trying], directions[own])
            moved = np.where(found.good[:, None], ends.vectors(found.q)[:, n], np.inf)
            nearer = np.linalg.norm(moved, axis=1) < np.linalg.norm(d[own], axis=1)
            kept[trying[nearer]] = True
            q[own[nearer]], d[own[nearer]] = found.q[nearer], moved[nearer]
            directions[own[nearer]] = orthonormal(found.directions[nearer])[0]
            along[trying] *= 0.5
            trying = trying[~nearer]
            if not trying.size:
                break
        close = np.abs(cover.name(q[left]) - names[left]).max(axis=1) <= 2.0 * radius[left]
        left = left[kept & close]
        if not left.size:
            break
    return met, on_line


def _jumps(cover: Cover, node: CoverNode, q: Array) -> bool:
    """Whether the forces differ on both sides of a position."""
    manifold = cover.manifold
    for direction in node.frame:
        sides = [
            manifold.closed(q + sign * tol.SURFACE_FORCE_PROBE * manifold.scale * direction)
            for sign in (1.0, -1.0)
        ]
        if sides[0] is None or sides[1] is None:
            continue
        one, other = (manifold.force(side) for side in sides if side is not None)
        if not np.abs(one - other).max() <= tol.SURFACE_FORCE_SMOOTH * manifold.largest(sides[0]):
            return True
    return False


# -- Charts of a surface of closed positions, by coordinates of tangent planes -----------------

#: Cells of a chart along each axis at its finest, a power of two.
FINEST = 2**12
#: Angle [rad] at which a polar chart begins: no direction of symmetry.
BEGINS = 0.7


class TangentChart:
    """The surface around a place of the cover, over a rectangle of the tangent plane there.

    `low`, `high` (2,): Bounds of the rectangle.

    `evaluations`: How often the residual force was evaluated.
    `left`: Corner and size of cells that were left to other charts.
    `samples`: Numbers of the samples at points of the grid where the residual force was evaluated.
    `zeros`: What is known of zeros that the chart leads to, as `ChartZeros` keeps them.
    """

    def __init__(self, cover: Cover, node: CoverNode, low: Array, high: Array) -> None:
        self.cover, self.node, self.evaluations = cover, node, 0
        self.side = self._side()
        self.low, self.step = low, (high - low) / FINEST
        self.left: list[tuple[tuple[int, int], int]] = []
        self.samples: dict[tuple[int, int], int] = {}
        self.zeros: list[Any] = []
        self.zeros_read = 0

    def is_level(self) -> bool:
        """Whether it leads everywhere, and is nowhere steep: so is its border, at least."""
        middles = [(i, j) for i in (0, 1, 2) for j in (0, 1, 2) if (i, j) != (1, 1)]
        y = np.array([self.y(0.5 * i * FINEST, 0.5 * j * FINEST) for i, j in middles])
        found = chart_positions([self] * len(y), y)
        chords = np.linalg.norm((found.q - self.node.place.q) / self.cover.scale, axis=1)
        return bool(
            found.good.all() and (chords <= tol.CHART_BENT * np.linalg.norm(y, axis=1)).all()
        )

    def y(self, i: float, j: float) -> Array:
        """Coordinates of a point of the grid."""
        return np.asarray(self.low + self.step * [i, j])

    def grid(self, y: Array) -> Array:
        """Places of coordinates on the grid: (…, 2)."""
        return np.asarray((y - self.low) / self.step)

    def left_open(self, at: Array) -> bool:
        """Whether a point of the grid is on the chart, and in no cell that was left to others."""
        if (at < 0.0).any() or (at > FINEST).any():
            return False
        return not any(
            np.abs((at - corner) / size - 0.5).max() <= 0.5 for corner, size in self.left
        )

    def holds(self, q: Array) -> bool:
        """Whether the chart leads to a position, and not to one of another sheet above the same
        place of the tangent plane.
        """
        return bool(hold([self], q[None])[0])

    def is_small_rotation(self, ends: Array, moved: Array) -> Array:
        """By how much the ends of loads move to each other in cells (cells, loads), those of cells
        (cells, 2, 2, loads, 2); `moved` is the same in a chart that has no centre.
        """
        return moved

    def _side(self) -> float:
        """The sign of det [Φ_q; frame], which a chart changes nowhere; 0 with redundant rows."""
        square = np.vstack([self.node.place.rows, self.node.frame])
        return float(np.linalg.slogdet(square)[0]) if len(square) == square.shape[1] else 0.0


class PolarChart(TangentChart):
    """Chart by radius and angle around a point where a load jumps: there the residual force is
    smooth in both, down to the radius zero.
    """

    def __init__(self, cover: Cover, point: JumpPoint, ends: LoadEnds) -> None:
        self.centre, self.radius = point.y, point.radius
        low = np.array([tol.CHART_RADIUS_INNERMOST * self.radius, BEGINS])
        super().__init__(cover, point.node, low, np.array([self.radius, BEGINS + 2.0 * np.pi]))
        lengths = np.linalg.norm(ends.vectors(point.q), axis=1)
        self.own = lengths < 1e-3 * tol.CHART_RADIUS_INNERMOST * self.radius

    def y(self, i: float, j: float) -> Array:
        """Coordinates of a point of the grid."""
        radius, angle = self.low + self.step * [i, j]
        return np.asarray(self.centre + radius * np.array([np.cos(angle), np.sin(angle)]))

    def grid(self, y: Array) -> Array:
        """Places of coordinates on the grid: (…, 2)."""
        x, z = np.moveaxis(y - self.centre, -1, 0)
        angle = BEGINS + (np.arctan2(z, x) - BEGINS) % (2.0 * np.pi)
        return np.asarray((np.stack([np.hypot(x, z), angle], axis=-1) - self.low) / self.step)

    def is_small_rotation(self, ends: Array, moved: Array) -> Array:
        """Relative motion of the ends of loads in cells (cells, loads); loads whose ends coincide
        in the centre rotate with the angle only.
        """
        relative = np.linalg.norm(np.diff(ends, axis=2), axis=-1)[:, :, 0]
        lengths = np.linalg.norm(ends, axis=-1)
        part = (relative / np.maximum(lengths.min(axis=2), tol.TINY)).max(axis=1)
        return np.where(self.own, part * lengths.min(axis=(1, 2)), moved)


def chart_positions(charts: Sequence[TangentChart], y: Array) -> ClosedPositions:
    """The positions to which charts lead at coordinates, each at its own (charts, 2)."""
    cover = charts[0].cover
    scale, nodes = cover.scale, [chart.node for chart in charts]
    frames = np.array([node.frame for node in nodes])
    origin = np.array([node.place.q for node in nodes])
    found = cover.many.closed(origin + scale * np.einsum("nf,nfc->nc", y, frames), frames)
    # closing may lead to another sheet, and beside a change point to another circuit
    chords = np.linalg.norm((found.q - origin) / scale, axis=1)
    sides = np.array([chart.side for chart in charts])
    good = found.good & (chords <= tol.CHART_STEEP * np.linalg.norm(y, axis=1) + 1e-9)
    return replace(found, good=good & (found.side == sides))


def hold(charts: Sequence[TangentChart], q: Array) -> Array:
    """Whether charts lead to positions, each to its own (charts, coordinates)."""
    if not charts:
        return np.zeros(0, dtype=bool)
    cover = charts[0].cover
    origin = np.array([chart.node.place.q for chart in charts])
    frames = np.array([chart.node.frame for chart in charts])
    displacement = without_whole_revolutions((q - origin) / cover.scale)
    found = chart_positions(charts, np.einsum("nfc,nc->nf", frames, displacement))
    distance = np.abs(without_whole_revolutions((found.q - q) / cover.scale)).max(axis=1)
    return np.asarray(found.good & (np.where(found.good, distance, np.inf) < tol.POSITION_SAME))


# -- The residual force at points of charts of a surface, and what single loads are of it ----------


class SurfaceSamples:
    """Numbered samples, not a number where a chart does not lead.

    `ends`: Of the loads whose direction turns quickly where their ends come close.

    `q` (samples, coordinates)
    `residual` (samples, 2): The residual force in the frame of the chart.
    `own` (samples, loads, 2): What these loads are of it.
    `ends` (samples, loads, 2): From one end of each to the other.
    `derivatives` (samples, loads, 2, 2): A load that pulls along its line drives by −F
      u·derivatives, u the direction of its ends.
    `force` (samples, loads): F.
    """

    def __init__(self, cover: Cover, ends: LoadEnds) -> None:
        self.cover, self.load_ends = cover, ends
        loads, size = len(ends.loads), cover.manifold.size
        self.count = 0
        self._shapes = {
            "q": (size,),
            "residual": (2,),
            "own": (loads, 2),
            "ends": (loads, 2),
            "derivatives": (loads, 2, 2),
            "force": (loads,),
        }
        self._samples = {name: np.empty((256, *shape)) for name, shape in self._shapes.items()}
        # the force on the end on j, or that on i where j is the ground
        ground = 3 * ends.bodies[1] >= size
        self._coordinate = 3 * np.where(ground, ends.bodies[0], ends.bodies[1])

    def __getattr__(self, name: str) -> Array:
        if name.startswith("_") or name not in self._shapes:
            raise AttributeError(name)
        return self._samples[name][: self.count]

    def add(self, charts: Sequence[TangentChart], y: Array) -> Array:
        """Evaluate the residual force at coordinates of charts, each at its own: numbers of the
        samples.
        """
        many, count = self.cover.many, len(charts)
        found = chart_positions(charts, y)
        new = {name: np.full((count, *shape), np.nan) for name, shape in self._shapes.items()}
        good = np.flatnonzero(found.good)
        q, directions = found.q[good], found.directions[good]
        loads = many.loads(q)
        # frame · P f, P the projection on the free directions: (W Wᵀ)⁻¹ W f
        S = np.linalg.inv(directions @ directions.transpose(0, 2, 1))
        residuals = np.einsum("nab,nbc,nlc->nla", S, directions, loads)
        new["q"][good] = q
        new["residual"][good] = residuals.sum(axis=1)
        if self.load_ends.loads:
            new["own"][good] = residuals[:, self.load_ends.numbers]
            new["ends"][good] = self.load_ends.vectors(q)
            new["derivatives"][good] = self.load_ends.derivatives(q, directions) @ S[:, None]
            own = loads[:, self.load_ends.numbers]
            every = np.arange(len(self.load_ends.loads))
            new["force"][good] = np.hypot(
                own[:, every, self._coordinate % own.shape[-1]],
                own[:, every, self._coordinate % own.shape[-1] + 1],
            )
        first, self.count = self.count, self.count + count
        while self.count > len(self._samples["q"]):
            for name, kept in self._samples.items():
                self._samples[name] = np.concatenate([kept, np.empty_like(kept)])
        for name, values in new.items():
            self._samples[name][first : self.count] = values
        for chart in charts:
            chart.evaluations += 1
        return np.arange(first, self.count)

    def leads(self, numbers: Array) -> Array:
        """Whether the charts lead to samples."""
        return np.isfinite(self.q[numbers]).all(axis=-1)
