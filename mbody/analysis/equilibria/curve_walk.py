"""The curve of closed positions of a single free motion, walked along, and the residual force
there.

Arclength s is that of all coordinates, lengths by the model length. With the unit tangent t(s) the
residual force is g = t·f, and g′ = −K exactly (λ fixed, see `tangent_space`), away from equilibria
too: t′ is across the curve and f − Φ_qᵀλ along it. So every place of the walk gives g and its
derivative.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from mbody.analysis.position.closed_position import place
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.core import arclength
from mbody.core import tolerances as tol
from mbody.core.bracket import zero_between
from mbody.system.rank import side_of

#: Steps in each direction, and the distance in model lengths beyond which bodies have run away.
STEPS, RUN_AWAY = 120, 1e3
#: Lengths of steps, those of the fastest coordinate.
PACE = arclength.Pace(
    tol.WALK_STEP,
    tol.WALK_STEP,
    tol.WALK_STEP_SHORTEST * tol.WALK_STEP,
    tol.WALK_TURN_GREATEST,
    leap=100.0 * tol.WALK_STEP_SHORTEST * tol.WALK_STEP,
)


@dataclass(frozen=True, eq=False)
class Node(arclength.CurvePoint):
    """A place of the walk.

    `place`: Angles go on over whole revolutions.
    `residual`, `derivative`: g and dg/ds.
    """

    odd = ("residual",)
    place: Place
    residual: float
    derivative: float


@dataclass
class Walk:
    """The curve in one direction.

    `nodes`: In order; the first is the start.
    `smooth`: Of each interval between neighbours: false where it has a corner.
    `closed`: Whether it came back to its beginning, whole revolutions left out.
    `end`: Why it ended before: "far" away, at its "longest", after too many steps ("long"), where a
      load has "no value", or where no step goes on ("stuck"); empty where it closed.
    `crossings`, `corners`: Where branches meet that it went through, and where a distance in the
      constraints is zero.
    """

    nodes: list[Node]
    smooth: list[bool] = field(default_factory=list)
    closed: bool = False
    end: str = ""
    crossings: list[Place] = field(default_factory=list)
    corners: list[Place] = field(default_factory=list)


class MotionCurve:
    """The curve through one place whose motions are a single one."""

    def __init__(self, manifold: Manifold, start: Place) -> None:
        self.manifold, self.scale = manifold, manifold.scale
        self.start, self._why = self.node(start, forward(start.motions[0])), ""

    def node(self, place: Place, along: Array, before: Node | None = None) -> Node:
        """Tangential residual force and its derivative at a position; `along` is near the tangent
        there.
        """
        found = along @ place.motions.T @ place.motions
        along = found / np.linalg.norm(found)
        derivative = float(along @ self.manifold.change(place, along[None])[0])
        side, frame = side_of(place.rows, along, before.frame if before else None)
        residual = float(place.force @ along)
        return Node(place.q / self.scale, along, side, frame, place, residual, derivative)

    def close(self, here: Node, x: Array, ahead: Array) -> Node | None:
        """The nearest node."""
        there = self.manifold.moved(here.place, x - here.x)
        if there is None:
            # a load that has no value where a step leads ends the walk
            q = self.manifold.closed(self.scale * x)
            if q is not None and not np.isfinite(self.manifold.force(q)).all():
                self._why = "no value"
            return None
        turned = np.linalg.norm(there.motions @ ahead)
        return self.node(there, ahead, here) if turned > np.cos(PACE.turn) else None

    def between(self, one: Node, other: Node, part: float) -> Node | None:
        """The node at a part of the chord between two neighbours."""
        return arclength.between(self.close, one, other, part)

    def walk(self, sign: float, longest: float = np.inf) -> Walk:
        """From the start on in the direction of the tangent, or against it, no further than
        `longest`.
        """
        first = self.start if sign > 0.0 else self.start.reversed()
        walk, length = Walk([first]), 0.0
        for here, there, smooth, crossing in itertools.islice(self._steps(first), STEPS):
            if crossing:
                walk.crossings.append(there.place)
            last = self._closing(first, here, there) if smooth else None
            if last is not None and len(walk.nodes) > 2:
                walk.nodes.append(last)
                walk.smooth.append(True)
                walk.closed = True
                return walk
            walk.nodes.append(there)
            walk.smooth.append(smooth)
            length += arclength.norm(there.x - here.x)
            if self._has_run_away(there) or length > longest:
                walk.end = "far" if length <= longest else "longest"
                return walk
            if not smooth:
                walk.corners.append(here.place)
        walk.end = "long" if len(walk.nodes) > STEPS else self._why
        return walk

    def _steps(self, here: Node) -> Iterator[tuple[Node, Node, bool, bool]]:
        """Neighbours, whether the curve is smooth between them, and whether branches meet there;
        behind a corner it goes on.
        """

        def leaps(here: Node, there: Node) -> bool:
            crosses = here.crosses(there)
            self._why = "crossing" if crosses else self._why
            return crosses

        def longest(here: Node, there: Node) -> float:
            # a straight path is followed in growing steps; what turns comes round
            still = np.abs(there.along[2::3]).max() < tol.RATE_NONE
            straight = arclength.norm(there.along - here.along) < tol.WALK_TURN_STRAIGHT
            return 0.1 * RUN_AWAY if still and straight else PACE.longest

        behind: Node | None = here
        while behind is not None:
            here, self._why = behind, "stuck"
            for step in arclength.walk(here, self.close, PACE, leaps, longest, _greatest):
                yield step[0], step[1], True, step[2]
                here, self._why = step[1], "stuck"
            behind = self._across(here)
            if behind is not None:
                yield here, behind, False, False

    def arclengths(self, walk: Walk) -> Array:
        """Arc lengths of the nodes of a walk."""
        q = np.array([node.x for node in walk.nodes])
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1)))

    def arclength_of(self, node: Node, walk: Walk) -> float:
        """Arc length of a node of a walk."""
        displacements = np.array([one.x - walk.nodes[0].x for one in walk.nodes])
        own = node.x - walk.nodes[0].x
        arclengths = self.arclengths(walk)
        nearest = int(np.linalg.norm(displacements - own, axis=1).argmin())
        return float(
            arclengths[nearest] + (own - displacements[nearest]) @ walk.nodes[nearest].along
        )

    def passes(self, walk: Walk, place: Place) -> bool:
        """Whether a walk goes through a place, whole revolutions left out."""
        for one, other in zip(walk.nodes[:-1], walk.nodes[1:], strict=True):
            chord = other.x - one.x
            to = place.q / self.scale - one.x
            to[2::3] = np.remainder(to[2::3] + np.pi, 2.0 * np.pi) - np.pi
            part = float(to @ chord / (chord @ chord))
            if not -0.01 < part < 1.01 or np.linalg.norm(to) > 2.0 * np.linalg.norm(chord):
                continue
            middle = self.between(one, other, part)
            if (
                middle is not None
                and self.manifold.distance(middle.place.q, place.q) < tol.POSITION_SAME_LOOSE
            ):
                return True
        return False

    def balanced_beyond(self, walk: Walk) -> bool:
        """Whether positions whole revolutions beyond a closed walk, and beyond half a revolution
        before it, may rest: where loads differ between revolutions they change by as much with
        every revolution.
        """
        revolutions = walk.nodes[-1].place.q - walk.nodes[0].place.q
        residuals = np.array([node.residual for node in walk.nodes])
        forces = [self.manifold.force(node.place.q + revolutions) for node in walk.nodes]
        pairs = zip(walk.nodes, forces, strict=True)
        more = np.array([float(force @ node.along) for node, force in pairs]) - residuals
        arclengths = self.arclengths(walk)
        before = arclengths < 0.5 * arclengths[-1]
        sign = np.sign(more)
        beyond = (
            (residuals + more) * sign,
            -(residuals - 2.0 * more) * sign,
            -(residuals - more) * sign,
        )
        return not all((part > 0.0).all() for part in (*beyond[:2], beyond[2][before]))

    def _has_run_away(self, here: Node) -> bool:
        displacement = here.x - self.start.x
        return float(np.abs(displacement.reshape(-1, 3)[:, :2]).max(initial=0.0)) > RUN_AWAY

    def _closing(self, first: Node, here: Node, there: Node) -> Node | None:
        """The node at which the walk is at its beginning again, if that lies in this step."""
        revolutions = np.zeros(len(first.x))
        revolutions[2::3] = 2.0 * np.pi * np.round((here.x - first.x)[2::3] / (2.0 * np.pi))
        target, chord = first.x + revolutions, there.x - here.x
        size = arclength.norm(chord)
        to = target - here.x
        part = float(to @ chord) / size**2
        if not (0.0 < part <= 1.0 and first.along @ here.along > 0.5):
            return None
        if arclength.norm(to - part * chord) > 0.2 * size:
            return None
        middle = self.between(here, there, part)
        if middle is None or np.abs(middle.x - target).max() > 0.02 * size:
            return None
        # along the tangent both may still be apart, across it they are not on one curve
        off = middle.x - target
        along = float(off @ middle.along)
        if arclength.norm(off - along * middle.along) > max(
            1e-2 * abs(along), tol.POSITION_SAME_FINE
        ):
            return None
        place = self.manifold.place(self.scale * target)
        return None if place is None else self.node(place, middle.along)

    def _across(self, here: Node) -> Node | None:
        """The first place behind a corner: where a distance in the constraints passes zero its
        direction turns over, and so does the curve.
        """
        scale, manifold = self.scale, self.manifold
        # walk up to the corner: the last place that goes on straight
        pace = PACE._replace(shortest=tol.WALK_BEHIND_CORNER, growth=1.0, leap=0.0)
        steps = arclength.walk(here, self.close, pace, _singular, size=_greatest)
        corner = [here, *(there for _, there, _ in steps)][-1]
        fastest = corner.along / np.abs(corner.along).max()
        before = corner.place.rows.reshape(len(corner.place.rows), -1, 3)
        beyond = corner.place.q + scale * fastest * 4.0 * tol.WALK_BEHIND_CORNER
        after = manifold.rows(beyond)[1].reshape(before.shape)
        dots = (before * after).sum(axis=2)
        sizes = np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
        reversed_rows = np.argwhere((dots < -0.5 * sizes) & (sizes > 0.0))
        for body in dict.fromkeys(int(b) for _, b in reversed_rows):
            fixed = np.zeros(len(corner.along))
            fixed[3 * body : 3 * body + 3] = fastest[3 * body : 3 * body + 3]
            size = float(fixed @ fixed)
            if size < tol.WALK_CORNER_NONE:
                continue
            q = manifold.closed(beyond, fixed[None] / np.sqrt(size))
            place = None if q is None else manifold.place(q)
            if place is None or len(place.motions) != 1:
                continue
            displacement = (place.q - corner.place.q) / scale
            if (
                np.abs(displacement).max() > 100.0 * tol.WALK_BEHIND_CORNER
                or not abs(displacement @ fixed) > tol.WALK_BEHIND_CORNER * size
            ):
                continue
            onward = place.motions[0] * np.sign(place.motions[0] @ fixed)
            return self.node(place, onward)
        return None


def _singular(_: Node, there: Node) -> bool:
    """Whether a node has several motions."""
    return len(there.place.motions) != 1


def _greatest(along: Array) -> float:
    """How fast the fastest coordinate is."""
    return float(np.abs(along).max())


def forward(motion: Array) -> Array:
    """A direction with its greatest part positive; of equal ones the last, an angle where there is
    one. A null space has no sign of its own, and one processor gives the other.
    """
    sizes = np.abs(motion)
    equal = np.flatnonzero(sizes > 0.999 * sizes.max())
    return np.asarray(motion * np.sign(motion[equal[-1]]))


# -- Zeros of the residual force between neighbours of a walk, by value and derivative ---------
# Between two nodes the residual force is the cubic through both values and derivatives, within an
# error that the fourth derivative bounds: |g⁗| D⁴/384, and x²(1−x)² of it beside the ends. The
# derivative is taken from how far the cubics of neighbours differ, then, interval by interval, from
# what the cubic misses in the middle. An interval is divided until the cubic, taken with its error,
# can have one number of zeros only; and where a load along a line, as a spring, turns round, for
# its ends may meet there and its force jump.

#: Places of an interval at which the cubic is compared with its error.
X = np.linspace(0.0, 1.0, 33)
#: An error of one in the middle is 16 x²(1−x)² beside it, and its derivative 12 at most.
BAND, BAND_DERIVATIVE = 16.0, 12.0
#: Nodes that divisions of one walk add at most.
MOST = 3000


@dataclass
class Roots:
    """Equilibria, jumps and lift-offs found along a walk.

    `equilibria`: Where the residual force is zero, in order.
    `jumps`: Beside a place towards which loads drive from both sides, and which no position
      balances: a corner of the curve, or a jump of a load.
    `lifts`: The same where loads drive to both sides.
    `unsure`: Where no number of zeros is certain.
    """

    equilibria: list[Node] = field(default_factory=list)
    jumps: list[Node] = field(default_factory=list)
    lifts: list[Node] = field(default_factory=list)
    unsure: list[Node] = field(default_factory=list)


def roots_of(curve: MotionCurve, walk: Walk, start: bool = False) -> Roots:
    """All zeros of the residual force along a walk; one at its very beginning only if `start` says
    so, for there another walk ends or begins.
    """
    return _CurveIsolation(curve, walk, start).found


def out_of_order(curve: MotionCurve, walk: Walk, roots: Roots) -> list[Node]:
    """Zeros beside which one must be missing: along a smooth residual force its derivative changes
    sign from each to the next, and all round a closed walk.

    Nothing is said where a load jumps or a distance passes zero, nor beside a double zero.
    """
    flat = tol.WALK_SLOPE_FLAT * max((abs(node.derivative) for node in walk.nodes), default=0.0)
    if (
        roots.jumps
        or roots.lifts
        or walk.corners
        or any(abs(r.derivative) <= flat for r in roots.equilibria)
    ):
        return []
    equilibria = sorted(roots.equilibria, key=lambda node: curve.arclength_of(node, walk))
    pairs = list(itertools.pairwise(equilibria))
    whole = abs(walk.nodes[-1].residual - walk.nodes[0].residual) <= tol.WALK_CLOSED_RESIDUAL * max(
        abs(node.residual) for node in walk.nodes
    )
    if walk.closed and whole and equilibria:
        pairs.append((equilibria[-1], equilibria[0]))
    return [one for one, other in pairs if one.derivative * other.derivative > 0.0]


class _CurveIsolation:
    def __init__(self, curve: MotionCurve, walk: Walk, start: bool) -> None:
        self.curve, self.walk, self.left = curve, walk, MOST
        self.system = curve.manifold.system
        loads = self.system.mechanism.loads
        self.lines = [load for load in loads if {"i", "j"} <= set(load.places())]
        self.found = Roots()
        residuals = np.array([node.residual for node in walk.nodes])
        self.top = max(float(np.abs(residuals).max()), tol.TINY)
        self.zero = tol.FORCE_NONE_WALK * self.top
        nodes = [self.snapped(node) for node in walk.nodes]
        if start and nodes[0].residual == 0.0:
            self.found.equilibria.append(nodes[0])
        pairs = list(itertools.pairwise(nodes))
        sizes = [self.size(*pair) for pair in pairs]
        thirds = [6.0 * float(self.cubic(*pair)[3]) / self.size(*pair) ** 3 for pair in pairs]
        for n, (one, other) in enumerate(pairs):
            if not walk.smooth[n]:
                if one.residual > 0.0 > other.residual:
                    self.found.jumps.append(one)
                continue
            adjacent = [m for m in (n - 1, n + 1) if 0 <= m < len(pairs) and walk.smooth[m]]
            if walk.closed and len(pairs) > 2:
                adjacent = [(n - 1) % len(pairs), (n + 1) % len(pairs)]
            jump = max((abs(thirds[m] - thirds[n]) for m in adjacent), default=np.inf)
            self.divide(one, other, tol.WALK_CUBIC_SURE * jump * sizes[n] ** 3 / 384.0)

    def snapped(self, node: Node) -> Node:
        """The node, its residual force zero where it is rounding: as of a position of symmetry,
        which one processor has on one side of zero, another on the other.
        """
        return replace(node, residual=0.0) if abs(node.residual) <= self.zero else node

    def size(self, one: Node, other: Node) -> float:
        """Length of the chord."""
        return arclength.norm(other.x - one.x)

    def rotates_far(self, one: Node, other: Node) -> bool:
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
        """Coefficients, lowest first, of the residual force over the part x of the chord."""
        chord = other.x - one.x
        size = float(np.linalg.norm(chord))
        direction = chord / size
        a, b = one.residual, other.residual
        da, db = (size * node.derivative / float(node.along @ direction) for node in (one, other))
        return np.array([a, da, 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db])

    def divide(self, one: Node, other: Node, error: float) -> None:
        """Find the zeros after `one` and up to `other`; error is that of the cubic."""
        cubic = self.cubic(one, other)
        if not self.rotates_far(one, other):
            if np.abs(cubic).max() <= 10.0 * self.zero:
                self._small(one, other)
                return
            count = self._certain(cubic, (one.residual, other.residual), error)
            if count == 0:
                return
            if count == 1:
                self._root(one, other)
                return
        size = float(np.abs(other.x - one.x).max())
        if size < tol.WALK_INTERVAL_SMALLEST:
            self._small(one, other)
            return
        middle = self.curve.between(one, other, 0.5) if self.left else None
        self.left -= 1
        if middle is None:
            self.found.unsure.append(one)
            if one.residual * other.residual < 0.0:
                self._root(one, other)
            return
        middle = self.snapped(middle)
        chord = other.x - one.x
        x = float((middle.x - one.x) @ chord / (chord @ chord))
        missed = abs(middle.residual - float(cubic @ x ** np.arange(4)))
        # by halves the error of a smooth residual force falls to a sixteenth; one that is greater
        # than its bound shows that this residual force is not smooth
        part = tol.WALK_CUBIC_SURE * missed / (16.0 if missed <= error < np.inf else 1.0)
        self.divide(one, middle, part)
        self.divide(middle, other, part)

    def _certain(self, cubic: Array, ends: tuple[float, float], error: float) -> int:
        """Number of zeros of the residual force, 0 or 1; −1 where that is not certain."""
        x = np.sort(np.append(X, _extrema(cubic)))
        powers = x[:, None] ** np.arange(4)
        p = powers @ cubic
        p[0], p[-1] = ends
        derivative = powers[:, :3] @ (cubic[1:] * [1.0, 2.0, 3.0])
        open_ = np.abs(p) <= error * BAND * (x * (1.0 - x)) ** 2 + self.zero
        steep = np.abs(derivative) > BAND_DERIVATIVE * error
        # the zero lies between places: both sides of a change of sign belong to it
        signs = np.sign(p)
        sign_changes = signs[1:] * signs[:-1] <= 0.0
        uncertain = open_.copy()
        uncertain[1:] |= sign_changes
        uncertain[:-1] |= sign_changes
        if not uncertain.any():
            return 0
        index = np.flatnonzero(uncertain)
        one_run = index[-1] - index[0] + 1 == len(index)
        same = (np.sign(derivative[index]) == np.sign(derivative[index[0]])).all()
        if not (one_run and same and steep[index].all()):
            return -1
        return int(p[0] * p[-1] < 0.0 or p[-1] == 0.0)

    def _root(self, one: Node, other: Node, begins: bool = True) -> None:
        """The zero between two nodes of different sign, or at the second of them."""
        if other.residual == 0.0:
            self.found.equilibria.append(other)
            return
        part = _zero(self.cubic(one, other))
        node = self.curve.between(one, other, part) if begins else None
        if node is not None:  # the next cubic has the derivative there
            ahead = node.residual * one.residual > 0.0
            self._root(*((node, other) if ahead else (one, node)), begins=False)
            return
        size = float(np.abs(other.x - one.x).max())
        root, low, high = arclength.zero_on(
            self.curve.close,
            one,
            other,
            lambda node: node.residual if abs(node.residual) > 1e-3 * self.zero else 0.0,
            tol.EQUILIBRIUM_STEP_ROUNDING / size,
            part,
        )
        steep = max(abs(low.derivative), abs(high.derivative)) * self.size(low, high)
        if abs(high.residual - low.residual) > tol.WALK_FORCE_JUMPS * (steep + self.zero):
            (self.found.jumps if low.residual > high.residual else self.found.lifts).append(low)
            return
        self.found.equilibria.append(self._nearer(root))

    def _nearer(self, root: Node) -> Node:
        """A root after a step of Newton's method: cubics leave the rounding of their chord."""
        if root.residual == 0.0 or root.derivative == 0.0:
            return root
        x = root.x - root.residual / root.derivative * root.along
        found = self.curve.close(root, x, root.along)
        better = found is not None and abs(found.residual) < abs(root.residual)
        return found if found is not None and better else root

    def _small(self, one: Node, other: Node) -> None:
        """An interval whose zeros no longer part: a double root, a jump, or what is left of one."""
        if one.residual * other.residual < 0.0 or other.residual == 0.0:
            self._root(one, other)
            return
        nodes = [one, other]
        for x in _extrema(self.cubic(one, other)):
            node = self.curve.between(one, other, float(x))
            nodes += [node] if node is not None else []
        # of a residual force that touches zero the place where it is least
        best = min(nodes, key=lambda node: abs(node.derivative))
        if abs(best.residual) > 100.0 * self.zero or (best is one and one.residual == 0.0):
            return  # none, or that of the interval before
        distance = self.curve.manifold.distance
        if not any(
            distance(best.place.q, known.place.q) < tol.POSITION_SAME_WALK
            for known in self.found.equilibria
        ):
            self.found.equilibria.append(best)


def _extrema(cubic: Array) -> Array:
    """Places at which a cubic is greatest or least within its interval."""
    a, b, c = 3.0 * cubic[3], cubic[2], cubic[1]  # a x² + 2 b x + c = 0
    square = b * b - a * c
    if square < 0.0:
        return np.zeros(0)
    q = -(b + np.copysign(np.sqrt(square), b))
    found = np.array([q / a if a else np.inf, c / q if q else np.inf])
    return found[(found > 0.0) & (found < 1.0)]


def _zero(cubic: Array) -> float:
    """The zero of a cubic between 0 and 1, where its ends have different signs."""
    a, b, c, d = cubic.tolist()
    ends = a, a + b + c + d
    x = zero_between(
        lambda x: ((d * x + c) * x + b) * x + a, (0.0, 1.0), ends, tol.WALK_ZERO_BRACKET
    ).x
    return min(max(x, tol.WALK_ZERO_INSIDE), 1.0 - tol.WALK_ZERO_INSIDE)
