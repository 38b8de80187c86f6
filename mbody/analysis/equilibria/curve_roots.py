"""Zeros of the drive between neighbouring places of a walk, each of them, by its value and slope.

Between two nodes the drive is the cubic through both values and slopes, within an error that the
fourth derivative bounds: |g⁗| D⁴/384, and x²(1−x)² of it beside the ends. The derivative is taken
from how far the cubics of neighbours differ, then, interval by interval, from what the cubic misses
in the middle. An interval is divided until the cubic, taken with its error, can have one number of
zeros only; and where a load along a line, as a spring, turns round, for its ends may meet there and
its force jump.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np

from mbody.analysis.equilibria.curve_walk import MotionCurve, Node, Walk, between
from mbody.analysis.position.joint_places import place
from mbody.analysis.position.tangent_space import Array

__all__ = ["Roots", "out_of_turn", "roots_of"]

#: Places of an interval at which the cubic is compared with its error.
X = np.linspace(0.0, 1.0, 33)
#: The error of a cubic, as a multiple of what neighbours or the middle show.
SURE = 6.0
#: An error of one in the middle is 16 x²(1−x)² beside it, and its slope 12 at most.
BAND, BAND_SLOPE = 16.0, 12.0
#: An interval below this, in radians or model lengths, is not divided further.
SMALLEST = 1e-7
#: Nodes that divisions of one walk add at most.
MOST = 3000
#: A change of the drive that is so many times what slopes and rounding explain is a jump, however
#: small beside the greatest drive of a walk, which may end far away.
JUMP = 100.0
#: A drive below this part of the greatest of a walk is rounding.
ROUNDING = 1e-12


@dataclass
class Roots:
    """What a walk showed.

    Attributes
    ----------
    rests : list of Node
        Where the drive is zero, in order.
    jumps : list of Node
        Beside a place towards which loads drive from both sides, and which no position balances:
        a corner of the curve, or a jump of a load.
    lifts : list of Node
        The same where loads drive to both sides.
    unsure : list of Node
        Where no number of zeros is certain.
    """

    rests: list[Node] = field(default_factory=list)
    jumps: list[Node] = field(default_factory=list)
    lifts: list[Node] = field(default_factory=list)
    unsure: list[Node] = field(default_factory=list)


def roots_of(curve: MotionCurve, walk: Walk, start: bool = False) -> Roots:
    """All zeros of the drive along a walk; one at its very beginning only if `start` says so, for
    there another walk ends or begins.
    """
    return _CurveIsolation(curve, walk, start).found


def out_of_turn(curve: MotionCurve, walk: Walk, roots: Roots) -> list[Node]:
    """Zeros beside which one must be missing: along a smooth drive its slope changes sign from each
    to the next, and all round a closed walk.

    Notes
    -----
    Nothing is said where a load jumps or a distance passes zero, nor beside a double zero.
    """
    flat = 1e-6 * max((abs(node.slope) for node in walk.nodes), default=0.0)
    if roots.jumps or roots.lifts or walk.corners or any(abs(r.slope) <= flat for r in roots.rests):
        return []
    rests = sorted(roots.rests, key=lambda node: curve.arclength_of(node, walk))
    pairs = list(itertools.pairwise(rests))
    whole = abs(walk.nodes[-1].drive - walk.nodes[0].drive) <= 1e-9 * max(
        abs(node.drive) for node in walk.nodes
    )
    if walk.closed and whole and rests:
        pairs.append((rests[-1], rests[0]))
    return [one for one, other in pairs if one.slope * other.slope > 0.0]


class _CurveIsolation:
    def __init__(self, curve: MotionCurve, walk: Walk, start: bool) -> None:
        self.curve, self.walk, self.left = curve, walk, MOST
        self.system = curve.manifold.system
        loads = self.system.mechanism.loads
        self.lines = [load for load in loads if {"i", "j"} <= set(load.places())]
        self.found = Roots()
        drives = np.array([node.drive for node in walk.nodes])
        self.top = max(float(np.abs(drives).max()), 1e-300)
        self.zero = ROUNDING * self.top
        nodes = [self.snapped(node) for node in walk.nodes]
        if start and nodes[0].drive == 0.0:
            self.found.rests.append(nodes[0])
        pairs = list(itertools.pairwise(nodes))
        sizes = [self.size(*pair) for pair in pairs]
        thirds = [6.0 * float(self.cubic(*pair)[3]) / self.size(*pair) ** 3 for pair in pairs]
        for n, (one, other) in enumerate(pairs):
            if not walk.smooth[n]:
                if one.drive > 0.0 > other.drive:
                    self.found.jumps.append(one)
                continue
            beside = [m for m in (n - 1, n + 1) if 0 <= m < len(pairs) and walk.smooth[m]]
            if walk.closed and len(pairs) > 2:
                beside = [(n - 1) % len(pairs), (n + 1) % len(pairs)]
            jump = max((abs(thirds[m] - thirds[n]) for m in beside), default=np.inf)
            self.divide(one, other, SURE * jump * sizes[n] ** 3 / 384.0)

    def snapped(self, node: Node) -> Node:
        """The node, its drive zero where it is rounding: as of a position of symmetry, which one
        processor has on one side of zero, another on the other.
        """
        return replace(node, drive=0.0) if abs(node.drive) <= self.zero else node

    def size(self, one: Node, other: Node) -> float:
        """Length of the chord."""
        return float(np.linalg.norm((other.place.q - one.place.q) / self.curve.scale))

    def turns_round(self, one: Node, other: Node) -> bool:
        """Whether a load along a line turns by a right angle or more between two nodes."""
        n = self.system.coordinates
        here, there = (np.append(node.place.q[:n], np.zeros(3)) for node in (one, other))
        for load in self.lines:
            first, last = (
                place(self.system, q, load, "j") - place(self.system, q, load, "i")
                for q in (here, there)
            )
            if first @ last <= 0.0:
                return True
        return False

    def cubic(self, one: Node, other: Node) -> Array:
        """Coefficients, lowest first, of the drive over the part x of the chord."""
        chord = (other.place.q - one.place.q) / self.curve.scale
        size = float(np.linalg.norm(chord))
        way = chord / size
        a, b = one.drive, other.drive
        da, db = (size * node.slope / float(node.along @ way) for node in (one, other))
        return np.array([a, da, 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db])

    def divide(self, one: Node, other: Node, error: float) -> None:
        """Find the zeros after `one` and up to `other`; error is that of the cubic."""
        cubic = self.cubic(one, other)
        if not self.turns_round(one, other):
            if np.abs(cubic).max() <= 10.0 * self.zero:
                self._small(one, other)
                return
            count = self._certain(cubic, (one.drive, other.drive), error)
            if count == 0:
                return
            if count == 1:
                self._root(one, other)
                return
        size = float(np.abs((other.place.q - one.place.q) / self.curve.scale).max())
        if size < SMALLEST:
            self._small(one, other)
            return
        middle = between(self.curve, one, other, 0.5) if self.left else None
        self.left -= 1
        if middle is None:
            self.found.unsure.append(one)
            if one.drive * other.drive < 0.0:
                self._root(one, other)
            return
        middle = self.snapped(middle)
        chord = (other.place.q - one.place.q) / self.curve.scale
        x = float((middle.place.q - one.place.q) / self.curve.scale @ chord / (chord @ chord))
        missed = abs(middle.drive - float(cubic @ x ** np.arange(4)))
        # by halves the error of a smooth drive falls to a sixteenth; one that is greater than its
        # bound shows that this drive is not smooth
        part = SURE * missed / (16.0 if missed <= error < np.inf else 1.0)
        self.divide(one, middle, part)
        self.divide(middle, other, part)

    def _certain(self, cubic: Array, ends: tuple[float, float], error: float) -> int:
        """How many zeros the drive has, 0 or 1; −1 where that is not certain."""
        x = np.sort(np.append(X, _turning(cubic)))
        powers = x[:, None] ** np.arange(4)
        p = powers @ cubic
        p[0], p[-1] = ends
        slope = powers[:, :3] @ (cubic[1:] * [1.0, 2.0, 3.0])
        open_ = np.abs(p) <= error * BAND * (x * (1.0 - x)) ** 2 + self.zero
        steep = np.abs(slope) > BAND_SLOPE * error
        # the zero lies between places: both sides of a change of sign belong to it
        signs = np.sign(p)
        changed = signs[1:] * signs[:-1] <= 0.0
        near = open_.copy()
        near[1:] |= changed
        near[:-1] |= changed
        if not near.any():
            return 0
        index = np.flatnonzero(near)
        one_run = index[-1] - index[0] + 1 == len(index)
        same = (np.sign(slope[index]) == np.sign(slope[index[0]])).all()
        if not (one_run and same and steep[index].all()):
            return -1
        return int(p[0] * p[-1] < 0.0 or p[-1] == 0.0)

    def _root(self, one: Node, other: Node) -> None:
        """The zero between two nodes of different sign, or at the second of them."""
        if other.drive == 0.0:
            self.found.rests.append(other)
            return
        low, high = one, other
        best = min((low, high), key=lambda node: abs(node.drive))
        for _ in range(80):
            size = float(np.abs((high.place.q - low.place.q) / self.curve.scale).max())
            if abs(best.drive) <= 1e-3 * self.zero or size < 1e-13:
                break
            part = _zero(self.cubic(low, high))
            node = between(self.curve, low, high, part)
            if node is None:
                break
            better = abs(node.drive) < 0.3 * abs(best.drive)
            if abs(node.drive) <= abs(best.drive):
                best = node
            if node.drive * low.drive > 0.0:
                low = node
            else:
                high = node
            if not better and size < 1e-9:
                break
            if not better:  # as of a jump: by halves
                node = between(self.curve, low, high, 0.5)
                if node is None:
                    break
                best = min((best, node), key=lambda node: abs(node.drive))
                if node.drive * low.drive > 0.0:
                    low = node
                else:
                    high = node
        steep = max(abs(low.slope), abs(high.slope)) * self.size(low, high)
        if abs(high.drive - low.drive) > JUMP * (steep + self.zero):
            (self.found.jumps if low.drive > high.drive else self.found.lifts).append(low)
            return
        self.found.rests.append(best)

    def _small(self, one: Node, other: Node) -> None:
        """An interval whose zeros no longer part: a double root, a jump, or what is left of one."""
        if one.drive * other.drive < 0.0 or other.drive == 0.0:
            self._root(one, other)
            return
        nodes = [one, other]
        for x in _turning(self.cubic(one, other)):
            node = between(self.curve, one, other, float(x))
            nodes += [node] if node is not None else []
        # of a drive that touches zero the place where it is least
        best = min(nodes, key=lambda node: abs(node.slope))
        if abs(best.drive) > 100.0 * self.zero or (best is one and one.drive == 0.0):
            return  # none, or that of the interval before
        apart = self.curve.manifold.apart
        if not any(apart(best.place.q, rest.place.q) < 1e-4 for rest in self.found.rests):
            self.found.rests.append(best)


def _turning(cubic: Array) -> Array:
    """Where a cubic is greatest or least within its interval."""
    a, b, c = 3.0 * cubic[3], cubic[2], cubic[1]  # a x² + 2 b x + c = 0
    square = b * b - a * c
    if square < 0.0:
        return np.zeros(0)
    q = -(b + np.copysign(np.sqrt(square), b))
    found = np.array([q / a if a else np.inf, c / q if q else np.inf])
    return found[(found > 0.0) & (found < 1.0)]


def _zero(cubic: Array) -> float:
    """The zero of a cubic between 0 and 1, where its ends have different signs."""
    a, b = float(cubic[0]), float(cubic.sum())
    low, high, x = 0.0, 1.0, a / (a - b) if a != b else 0.5
    for _ in range(60):
        value = ((cubic[3] * x + cubic[2]) * x + cubic[1]) * x + cubic[0]
        if value == 0.0 or high - low < 1e-15:
            break
        low, high = (x, high) if value * a > 0.0 else (low, x)
        slope = (3.0 * cubic[3] * x + 2.0 * cubic[2]) * x + cubic[1]
        step = x - value / slope if slope else low
        x = step if low < step < high else 0.5 * (low + high)
    return float(min(max(x, 1e-9), 1.0 - 1e-9))
