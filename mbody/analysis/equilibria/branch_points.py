"""Where branches of rest positions cross, by a system of equations that is regular there.

At a simple crossing the Jacobian J = [−K, g] of the drive by position and number loses one rank:
wᵀJ = 0. With w and the null space V of J (two columns) the equations Uᵀr = 0 for the other left
vectors U, and wᵀJV = 0, are as many as their unknowns. Their derivative has full rank where both
branches have tangents of their own: at transcritical points and pitchforks, at perturbed ones too,
where wᵀr is not zero and no branch goes through.

G. Moore: The numerical treatment of non-trivial bifurcation points, Numerical Functional Analysis
and Optimization 2 (1980), 441-472.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.equilibria.arclength import Follower, Point
from mbody.analysis.position.tangent_space import Array, Place
from mbody.errors import ModelError

__all__ = ["GAP", "BranchPoint", "crossing", "together"]

#: Step of the differences of J; they only steer Newton's method and show the kind of crossing.
STEP = 1e-3
#: Corrections at most, the longest of them, and one that is rounding.
ITERATIONS, LONGEST, SMALL = 25, 0.2, 1e-12
#: What is left of the drive, as a part of its second derivatives, above which branches pass each
#: other without meeting: the square of how far they are apart, and rounding leaves 1e-13.
GAP = 1e-10
#: A curvature of the drive along the position, as a part of the greatest, that is none: then one
#: branch turns round in the crossing, as a pitchfork does. Differences leave STEP² of it.
NONE = 1e-4
#: Points of the curve around a crossing of more branches: a step turns by 0.2 rad at most, and the
#: polynomial through eight of them errs by 1e-11.
NODES = 8
#: Distance from it, along the curve, at which it is looked whether branches meet.
NEAR = 1e-4


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A place where two branches cross, or nearly do.

    Attributes
    ----------
    point : Point
        On the curve that is followed.
    kind : str
        ``"pitchfork"``, ``"transcritical"`` or ``"multiple"``.
    gap : float
        What is left of the drive, as a part of its second derivatives: the square of how far
        branches are apart, zero where they cross.
    """

    point: Point
    kind: str
    gap: float


def crossing(follower: Follower, here: Point, there: Point) -> BranchPoint | None:
    """The crossing between two points of a curve; None where there is none near."""

    def side(point: Point) -> float:
        return point.side * (point.size / here.size) ** len(point.place.motions)

    return _simple(follower, here, there) or _multiple(follower, here, there, side)


def together(
    follower: Follower, here: Point, there: Point, which: Sequence[int]
) -> BranchPoint | None:
    """Where an even number of stiffnesses, numbered by `which`, pass zero at once between two
    points: each of them crosses, and the determinant keeps its sign. None where they pass it one by
    one.
    """
    numbers = list(which)
    found = _multiple(follower, here, there, lambda point: float(point.stiffnesses[numbers].sum()))
    if found is None:
        return None
    # the distance to where each passes zero, as the greatest went between the ends
    length, K = there.arc - here.arc, found.point.stiffness
    left = np.linalg.eigvalsh(0.5 * (K + K.T))  # of rounding alone K is not symmetric
    if len(left) != len(here.stiffnesses):
        return None
    went = np.abs(there.stiffnesses[numbers] - here.stiffnesses[numbers])
    apart = float((np.abs(left[numbers]) * length / went).max())
    return found if apart**2 <= GAP else None


def _simple(follower: Follower, here: Point, there: Point) -> BranchPoint | None:
    """A crossing of two branches, by Newton's method."""
    one, other = abs(here.side), abs(there.side)
    part = one / (one + other) if one + other else 0.5
    value = (1.0 - part) * here.value + part * there.value
    q = (1.0 - part) * here.place.q + part * there.place.q
    try:
        found = _solved(follower, q, value, len(here.place.motions))
    except ModelError:  # as of a length that must not be negative
        return None
    if found is None:
        return None
    place, value, H, V, gap = found
    before, after = (
        np.append((place.q - end.place.q) / follower.scale, value - end.value)
        for end in (here, there)
    )
    first, last = float(np.linalg.norm(before)), float(np.linalg.norm(after))
    if first + last > 1.2 * float(np.linalg.norm(before - after)) + 1e-9:
        return None
    arc = here.arc + (there.arc - here.arc) * first / (first + last)
    direction = last * here.direction + first * there.direction
    direction /= np.linalg.norm(direction)
    stiffness = follower.manifold(value).stiffness(place)
    point = Point(place, value, direction, stiffness, arc, 0.0, here.size)
    return BranchPoint(point, _kind(H, V), gap)


def _multiple(
    follower: Follower, here: Point, there: Point, of: Callable[[Point], float]
) -> BranchPoint | None:
    """A crossing in which more branches meet, where `of` passes zero, between points of the curve
    around it: in it, where all that a step goes by vanishes, the last digits alone would lead.
    """
    length = there.arc - here.arc

    def at(part: float) -> tuple[float, Array] | None:
        """What passes zero, and number and position, at a part of the step."""
        point = follower.ahead(here, 0.5 * (1.0 + part) * length)
        if point is None:
            return None
        return of(point), np.append(point.value, (point.place.q - here.place.q) / follower.scale)

    nodes = np.polynomial.chebyshev.chebpts1(NODES)
    found = [at(part) for part in nodes]
    known = [n for n in range(NODES) if found[n] is not None]
    if len(known) < NODES - 1:  # one may lie in the crossing itself
        return None
    rows = [one for one in found if one is not None]
    way = nodes[known]
    sides = np.polynomial.Chebyshev.fit(way, [side for side, _ in rows], len(way) - 1, (-1.0, 1.0))
    zeros = [z.real for z in sides.roots() if abs(z.imag) < 1e-6 and abs(z.real) <= 1.0]
    if len(zeros) != 1:
        return None
    part = float(zeros[0])

    # beside it what passes zero goes by the distance, or by √(distance² + gap) past each other
    beside = NEAR / length
    near = at(part - beside), at(part + beside)
    slope = float(sides.deriv()(part))
    if near[0] is None or near[1] is None or not slope:
        return None
    gap = abs((near[1][0] - near[0][0]) / (2.0 * beside * slope) - 1.0) * NEAR**2
    fit = np.polynomial.chebyshev.chebfit(way, np.array([row for _, row in rows]), len(way) - 1)
    middle = np.asarray(np.polynomial.chebyshev.chebval(part, fit))
    value = float(middle[0])
    place = follower.manifold(value).at(here.place.q + follower.scale * middle[1:])
    if place is None:
        return None
    arc = here.arc + 0.5 * (1.0 + part) * length
    direction = 0.5 * (1.0 - part) * here.direction + 0.5 * (1.0 + part) * there.direction
    direction /= np.linalg.norm(direction)
    stiffness = follower.manifold(value).stiffness(place)
    point = Point(place, value, direction, stiffness, arc, 0.0, here.size)
    return BranchPoint(point, "multiple", gap)


def _kind(H: Array, V: Array) -> str:
    """What crosses, by the second derivatives H on the null space V (2, free + 1)."""
    still = np.array([V[1, -1], -V[0, -1]])  # the way on which the number stays
    size = float(np.linalg.norm(still))
    bend = float(still @ H @ still) / size**2 if size > 1e-6 else 0.0
    return "pitchfork" if abs(bend) <= NONE * float(np.abs(H).max()) else "transcritical"


def _solved(
    follower: Follower, q: Array, value: float, free: int
) -> tuple[Place, float, Array, Array, float] | None:
    """Newton's method; the place, the number, second derivatives, the null space and the gap."""
    place = follower.manifold(value).at(q)
    last = np.inf
    for _ in range(ITERATIONS):
        if place is None or len(place.motions) != free:
            return None
        follows, J = _jacobian(follower, place, value)
        size = float(np.abs(J).max()) or 1.0
        u, s, vt = np.linalg.svd(J / size)
        w, V = u[:, -1], vt[free - 1 :]

        rows = []
        for way in V:
            sides = []
            for step in (STEP, -STEP):
                near = _moved(follower, place, value, follows, step * way)
                if near is None or len(near.motions) != free:
                    return None
                _, other = _jacobian(follower, near, value + step * float(way[-1]))
                sides.append(_aligned(place, near, other) / size)
            rows.append(w @ (sides[0] - sides[1]) @ V.T / (2.0 * STEP))
        H = np.array(rows)
        r = place.drive / size
        across = -(vt[: free - 1].T @ ((u[:, : free - 1].T @ r) / s[: free - 1]))
        along = np.linalg.lstsq(H.T, -(w @ (J / size) @ V.T), rcond=1e-9)[0]
        x = across + along @ V
        length = float(np.linalg.norm(x))
        if length < SMALL or (length < 1e-9 and length > 0.5 * last):
            H = 0.5 * (H + H.T)
            # a form with one sign has no branches: an isolated point
            gap = abs(float(w @ r)) / max(float(np.abs(H).max()), 1e-300)
            return (place, value, H, V, gap) if np.linalg.det(H) < 0.0 else None
        last = length
        x *= min(1.0, LONGEST / length)
        place, value = _moved(follower, place, value, follows, x), value + float(x[-1])
    return None


def _moved(
    follower: Follower, place: Place, value: float, follows: Array, x: Array
) -> Place | None:
    """The position after a step x of the free motions and of the number."""
    way = x[:-1] @ place.motions + x[-1] * follows
    return follower.manifold(value + float(x[-1])).at(place.q + follower.scale * way)


def _jacobian(follower: Follower, place: Place, value: float) -> tuple[Array, Array]:
    """How the position follows the number, and J (free, free + 1) in the motions of the place."""
    K = follower.manifold(value).stiffness(place)
    follows, change = follower.slopes(place, value, fine=True)
    return follows, np.column_stack([-K, change])


def _aligned(place: Place, near: Place, J: Array) -> Array:
    """J of a place nearby in the free motions of another: the nearest ones, for a null space has no
    basis of its own.
    """
    u, _, vt = np.linalg.svd(place.motions @ near.motions.T)
    turn = u @ vt
    return np.column_stack([turn @ J[:, :-1] @ turn.T, turn @ J[:, -1]])
