"""Bands of positions at which friction holds a single free motion, their ends located.

A mechanism rests where friction can take what drives it. Along the curve of its positions, with the
unit tangent t and the loads f, it is about to move on where

    g₊ = t·f − Σ_k x_k |g_k t| = 0,   x = φ(λ₀ + B x) for the directions of g_k t,

all frictional joints giving the friction that they can give at rest, and about to move back where
g₋ = t·f + Σ_k x_k |g_k t| = 0 with the opposite directions: it rests where g₊ ≤ 0 ≤ g₋. That is the
test of the bands of holding efforts in statics: where no effort is needed it does not matter what
would give it. Where friction grows without bound, as what jams does, it holds.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from mbody.analysis.equilibria.curve_walk import MotionCurve, Node, Walk, between
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.core import tolerances as tol
from mbody.kernels.finished_instants import PER_PAIR, StoredMotion, forces_by_senses, rates_of_pairs
from mbody.kernels.friction import IMPENDING
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_friction
from mbody.solution.contact_forces import friction_pairs, may_hold
from mbody.solution.friction_results import (
    ContactLimits,
    StickingContacts,
    slip_signs_with_sticking,
)

# -- Friction reserves of closed contacts at rest, by linear programs --------------------------


class ContactReserve:
    """The reserve of contacts at positions of a manifold: not negative where normal forces that
    press, and friction within its limits, balance all loads.
    """

    def __init__(self, manifold: Manifold) -> None:
        self.manifold = manifold
        self.limits = ContactLimits(manifold.system, manifold.work)

    def __bool__(self) -> bool:
        return True

    def at(self, place: Place) -> float:
        """Reserve at a position with one degree of freedom."""
        return self(place, place.motions[0])

    def __call__(self, place: Place, along: Array) -> float:
        """The reserve at a place [force·length]; the tangent `along` does not matter."""
        manifold = self.manifold
        load = manifold.force(place.q)
        manifold.rows(place.q)
        forces = StickingContacts(self.limits, manifold.work, load / manifold.scale)
        return forces.reserve() * float(np.abs(load).max(initial=0.0))


#: A node, the reserve there, and whether the curve is smooth up to the next one.
Sample = tuple[Node, float, bool]

#: Parts of a step of the walk at which the reserve of friction is sampled.
PARTS = 4
#: Halvings of an interval that holds an end, and steps of the search for a least reserve.
HALVINGS, GOLDEN = 60, 40


@dataclass(frozen=True, eq=False)
class EquilibriumBand:
    """Positions along a single free motion at which friction holds, from one end to the other.

    Attributes
    ----------
    low, high : mapping or None
        The position at either end, where the mechanism is about to move out of the band: by body
        (x, y, angle) of its link axes, as a `guess` takes it; None where the band has no end
        there. `low` is where the leader's angle, or displacement, is less.
    leader : str
        The body whose angle, or displacement, tells positions apart.
    positions : tuple of int
        Numbers of the equilibria in it at which no friction is needed.
    """

    low: Mapping[str, tuple[float, float, float]] | None
    high: Mapping[str, tuple[float, float, float]] | None
    leader: str
    positions: tuple[int, ...]

    @property
    def everywhere(self) -> bool:
        """Whether friction holds all positions of the free motion: it is self-locking."""
        return self.low is None and self.high is None

    def data(self) -> dict[str, Any]:
        """Plain dict of the band, ready for JSON."""
        ends = {
            key: None if end is None else {body: list(pose) for body, pose in end.items()}
            for key, end in (("low", self.low), ("high", self.high))
        }
        return {**ends, "leader": self.leader, "positions": list(self.positions)}


@dataclass(frozen=True, eq=False)
class Band:
    """A band of equilibria along a walk: nodes at its ends, None where it has none; nodes inside,
    in order.
    """

    first: Node | None
    last: Node | None
    inside: tuple[Node, ...]


#: What says how much more friction could take, of joints and of contacts.
Reserve: TypeAlias = "FrictionReserve | ContactReserve"


class FrictionReserve:
    """How much more friction at rest could take at positions of a manifold."""

    def __init__(self, manifold: Manifold, regularization: float) -> None:
        self.manifold, self.regularization = manifold, regularization
        system = manifold.system
        self.work, self.pairs = system.work(), friction_pairs(system)
        self.layout = system.runtime().replaced(slip_signs=IMPENDING)
        holds = [may_hold(system, one) and not one.separable for one in self.pairs]
        self.holds = np.array(holds, dtype=bool)

    def __bool__(self) -> bool:
        return bool(self.holds.any())

    def at(self, place: Place) -> float:
        """Reserve at a position with one degree of freedom."""
        return self(place, place.motions[0])

    def __call__(self, place: Place, along: Array) -> float:
        """min(−g₊, g₋) at a place with the tangent `along`, not negative where friction holds;
        infinite where it jams.
        """
        system, n = self.manifold.system, self.manifold.size
        motion = np.zeros((1, *self.manifold.motion.shape[1:]))
        motion[0] = self.manifold.motion[0]
        motion[0, :n], motion[0, n : 3 * n] = place.q, 0.0
        how = {"t": self.manifold.time, "regularization": self.regularization}
        stored = StoredMotion(motion=motion, **how)
        moving = motion.copy()
        moving[0, n : 2 * n] = self.manifold.scale * along
        output = np.zeros((1, len(self.pairs), PER_PAIR))
        rates_of_pairs(self.layout, self.work, StoredMotion(motion=moving, **how), output)
        rates = np.where(self.holds, output[0, :, 0], 0.0)
        rates[np.abs(rates) <= tol.RATE_NONE_SLIDING * np.abs(rates).max(initial=0.0)] = 0.0
        table = np.empty((1, PER_PRIMITIVE * len(system.owners), 1))
        reached = np.empty((1, 2))
        least, residual = np.inf, float(place.force @ along)
        for sign in (1.0, -1.0):
            most = -np.inf
            for slip_signs in slip_signs_with_sticking(
                sign * np.sign(rates), self.holds & (rates == 0.0)
            ):
                forces_by_senses(self.layout, self.work, stored, slip_signs[None], table, reached)
                power = sum(
                    abs(table[0, PER_PRIMITIVE * pair.primitive, 0] * rate)
                    for pair, rate in zip(self.pairs, rates, strict=True)
                )
                most = max(most, np.inf if reached[0, 1] < 1.0 else power)
            least = min(least, most - sign * residual)
        return float(least)


def bands_of(
    curve: MotionCurve, walks: list[Walk], reserve: FrictionReserve | ContactReserve
) -> list[Band]:
    """The bands along the walks of one curve, in their order: one that closes, or the branches to
    both sides of its start.
    """
    found = _Located(curve, reserve)
    points = found.points(walks)
    holds = [value >= 0.0 for _, value, _ in points]
    bands: list[Band] = []
    first, inside = None, list[Node]()
    for n, (node, _, _) in enumerate(points):
        if holds[n]:
            inside.append(node)
        if n + 1 < len(points) and holds[n] == holds[n + 1]:
            continue
        edge = found.end(points[n], points[n + 1]) if n + 1 < len(points) else None
        if holds[n]:
            bands.append(Band(first, edge, tuple(inside)))
        first, inside = edge, []
    round_ = walks[0].closed and len(walks) == 1
    if round_ and len(bands) > 1 and bands[0].first is None and bands[-1].last is None:
        last = bands.pop()
        nodes = walks[0].nodes
        back = nodes[0].place.q - nodes[-1].place.q
        begun = [_revolutions_before(node, back) for node in last.inside]
        first = None if last.first is None else _revolutions_before(last.first, back)
        bands[0] = Band(first, bands[0].last, (*begun, *bands[0].inside))
    return [band for band in bands if not _is_point(band, curve.scale)]


def _revolutions_before(node: Node, back: Array) -> Node:
    """The node whole revolutions before."""
    return replace(node, place=replace(node.place, q=node.place.q + back))


def _is_point(band: Band, scale: Array) -> bool:
    """Whether a band is an equilibrium alone, as one at which nothing with friction would slide."""
    if band.first is None or band.last is None or len(band.inside) > 1:
        return False
    displacement = (band.last.place.q - band.first.place.q) / scale
    return bool(np.abs(displacement).max() < tol.FRICTION_BAND_ENDS_SAME)


def holding_sentences(
    mechanism: Mechanism, bands: tuple[EquilibriumBand, ...], holds: bool
) -> list[str]:
    """Sentences on positions where friction holds beside equilibria that need none."""
    if not holds:
        return []
    names = listed(with_friction(mechanism))
    if any(band.everywhere for band in bands):
        leader = next(band.leader for band in bands if band.everywhere)
        return [f"self-locking: friction of {names} holds '{leader}' in every position"]
    if not bands:
        return []
    many = "a band" if len(bands) == 1 else f"{len(bands)} bands"
    return [
        f"friction of {names} holds {many} of positions, whose ends are those at which it is about "
        "to give way; the forces of rest positions are those without friction"
    ]


class _Located:
    """Samples of the reserve along the walks of a curve, and where it is zero."""

    def __init__(self, curve: MotionCurve, reserve: Reserve) -> None:
        self.curve, self.reserve, self.most = curve, reserve, np.inf

    def points(self, walks: list[Walk]) -> list[Sample]:
        """Places along the walks between which the reserve changes its sign once at most."""
        samples = list(self.samples(walks))
        finite = [abs(value) for _, value, _ in samples if np.isfinite(value)]
        self.most = tol.FRICTION_RESERVE_JAMMED * max(finite, default=1.0)
        limited = [(node, self._limited(value), smooth) for node, value, smooth in samples]
        return list(self.refined(limited))

    def value(self, node: Node) -> float:
        """The reserve at a node, finite."""
        return self._limited(self.reserve(node.place, node.along))

    def _limited(self, value: float) -> float:
        # where nothing slides, as in a dead centre, rounding would decide
        return 0.0 if abs(value) <= tol.FRICTION_RESERVE_NONE * self.most else min(value, self.most)

    def samples(self, walks: list[Walk]) -> Iterator[Sample]:
        """Nodes in order, the reserve there, and whether the curve is smooth up to the next."""
        nodes, smooth = list(walks[0].nodes), list(walks[0].smooth)
        for walk in walks[1:]:
            # the way back, in the direction of the way on
            back = [self._reversed(node) for node in reversed(walk.nodes[1:])]
            nodes, smooth = [*back, *nodes], [*reversed(walk.smooth), *smooth]
        for n, (one, other) in enumerate(itertools.pairwise(nodes)):
            yield one, self.reserve(one.place, one.along), smooth[n]
            if not smooth[n]:
                continue
            for k in range(1, PARTS):
                node = between(self.curve, one, other, k / PARTS)
                if node is not None:
                    yield node, self.reserve(node.place, node.along), True
        last = nodes[-1]
        yield last, self.reserve(last.place, last.along), False

    def _reversed(self, node: Node) -> Node:
        return Node(node.place, -node.along, -node.residual, node.derivative, node.side)

    def refined(self, samples: list[Sample]) -> Iterator[Sample]:
        """The samples, and between them where the reserve comes nearest to zero without having
        passed it.
        """
        for n, sample in enumerate(samples):
            node, value, smooth = sample
            if not 0 < n < len(samples) - 1 or not (smooth and samples[n - 1][2]):
                yield sample
                continue
            before, after = samples[n - 1][1], samples[n + 1][1]
            sign = 1.0 if value >= 0.0 else -1.0
            is_least = sign * value <= min(sign * before, sign * after)
            rise = max(sign * before, sign * after) - sign * value
            if (
                not is_least
                or min(sign * before, sign * after) < 0.0
                or sign * value > tol.FRICTION_RESERVE_DEEP * rise
            ):
                yield sample
                continue
            nearest = self._nearest(samples[n - 1][0], samples[n + 1][0], sign)
            if nearest is None or sign * nearest[1] >= 0.0:
                yield sample
                continue
            chord = nearest[0].place.q - node.place.q
            ahead = float(chord / self.curve.scale @ node.along) > 0.0
            found = (nearest[0], nearest[1], True)
            yield from (sample, found) if ahead else (found, sample)

    def _nearest(self, one: Node, other: Node, sign: float) -> tuple[Node, float] | None:
        """Place at which the sign times the reserve is least between two nodes, by golden sections;
        the first place at which it is negative.
        """
        ratio = 0.5 * (np.sqrt(5.0) - 1.0)
        low, high, best = 0.0, 1.0, None
        inner: dict[float, tuple[Node, float]] = {}
        for _ in range(GOLDEN):
            parts = (high - ratio * (high - low), low + ratio * (high - low))
            for part in parts:
                if part not in inner:
                    node = between(self.curve, one, other, part)
                    if node is None:
                        return best
                    inner[part] = node, self.value(node)
                if best is None or sign * inner[part][1] < sign * best[1]:
                    best = inner[part]
            if best is not None and sign * best[1] < 0.0:
                return best
            if sign * inner[parts[0]][1] <= sign * inner[parts[1]][1]:
                high = parts[1]
            else:
                low = parts[0]
        return best

    def end(self, left: Sample, right: Sample) -> Node:
        """Zero of the reserve between two neighbours; across a corner the one that holds."""
        (one, a, smooth), (other, b, _) = left, right
        holding = one if a >= 0.0 else other
        if not smooth:
            return holding
        low, high, below, above = 0.0, 1.0, a, b
        scale = self.curve.scale
        size = float(np.abs((other.place.q - one.place.q) / scale).max())
        best, side = holding, 0
        for _ in range(HALVINGS):
            if (high - low) * size <= tol.FRICTION_BAND_END:
                break
            # the Illinois rule: a false position that does not stay at one end
            part = (low * above - high * below) / (above - below)
            if not low < part < high:
                part = 0.5 * (low + high)
            node = between(self.curve, one, other, part)
            if node is None:
                break
            value = min(self.reserve(node.place, node.along), self.most)
            best = node
            if value == 0.0:
                break
            if (value >= 0.0) == (b >= 0.0):
                high, above = part, value
                below *= 0.5 if side > 0 else 1.0
                side = 1
            else:
                low, below = part, value
                above *= 0.5 if side < 0 else 1.0
                side = -1
        return best
