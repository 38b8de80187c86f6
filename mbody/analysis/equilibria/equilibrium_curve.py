"""The analysis `equilibrium_curve`: equilibria as one number changes, round turning points."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import by_time
from mbody.analysis.equilibria.curve_walk import RUN_AWAY
from mbody.analysis.equilibria.equilibrium import Equilibrium, Words, search, stability_of
from mbody.analysis.equilibria.search import EquilibriumPosition, EquilibriumSearch
from mbody.analysis.freedom.mobility import released
from mbody.analysis.position.assembly_analysis import as_system, closed, each_design
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.core import arclength
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.errors import ModelError, SolveError
from mbody.model.body import Guesses
from mbody.model.element import whole_number
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import ItemTable, Value
from mbody.solution.doubts import Doubt, Inherited, doubted
from mbody.solution.histories import BodyHistory, PointHistory, Reaction, Record
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- Pseudo-arclength continuation of equilibria along one number of a system ------------------
# A point is (q, p): a closed position and the number. With c = −Φ_q⁺ Φ_p (how the position follows
# the number at once), steps are q̇ = N y + c ṗ, and along the curve −K y + g ṗ = 0, g being the
# change of the residual force with p. Arclength is without units: lengths by the model length, p by
# its span.

#: Corrections of one step, and lengths of steps.
CORRECTIONS = 8
PACE = arclength.Pace(
    tol.CURVE_STEP_FIRST,
    tol.CURVE_STEP_LONGEST,
    tol.CURVE_STEP_SHORTEST,
    math.acos(tol.CURVE_COSINE),
    leap=tol.BRANCH_POINT_STEP_LEAST,
)


@dataclass(frozen=True, eq=False)
class Point(arclength.CurvePoint):
    """An equilibrium on the curve; in `x` and `along` the number comes last. `side` is the
    determinant of the equations of a step, by their size.

    `value`: The number, from 0 to 1 along its span.
    `stiffness` (free, free): In the free motions of the place.
    `arc`: Arclength from the first point.
    `size`: The greatest of K and of the change of the residual force with the number.
    """

    place: Place
    value: float
    stiffness: Array
    arc: float
    size: float

    @property
    def stiffnesses(self) -> Array:
        """Eigenvalues of the stiffness in order, or its determinant where it is not symmetric: one
        passes zero where the stability changes.
        """
        K = self.stiffness
        if np.abs(K - K.T).max() > tol.STIFFNESS_SYMMETRIC * np.abs(K).max():
            return np.array([np.linalg.det(K)])
        return np.linalg.eigvalsh(0.5 * (K + K.T))


class Follower:
    """Follows one curve of equilibria of `system` as `parameter` goes over `span`."""

    def __init__(self, system: System, start: Manifold, parameter: str, span: Array) -> None:
        self.system, self.first, self.parameter = system, start, parameter
        self.low, self.width = float(span[0]), float(span[1] - span[0])
        self.scale = start.scale
        self._manifolds: dict[float, Manifold] = {}

    def number(self, value: float) -> float:
        """The number at a place of its span; its ends exactly."""
        return self.low + self.width * value

    def manifold(self, value: float) -> Manifold:
        """Closed positions for one value of the number."""
        if value not in self._manifolds:
            if len(self._manifolds) > 8:
                self._manifolds.clear()
            system = self.system.with_values({self.parameter: self.number(value)})
            self._manifolds[value] = self.first.other(system)
        return self._manifolds[value]

    def derivatives(self, here: Place, value: float, fine: bool = False) -> tuple[Array, Array]:
        """c = dq/dp on the constraints (coordinates,), and the change g of the residual force
        (free,); by differences of fourth order where `fine` asks for all digits.
        """

        def both(at: float) -> Array:
            manifold = self.manifold(at)
            phi, G = manifold.rows(here.q)
            return np.append(phi, manifold.force(here.q) - G.T @ here.multipliers)

        low, high = self._around(value)
        rates = (both(high) - both(low)) / (high - low)
        if fine and self._around(value, 2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER) == (
            value - 2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER,
            value + 2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER,
        ):
            inner = both(value + tol.DIFFERENCE_STEP_FOURTH_ORDER) - both(
                value - tol.DIFFERENCE_STEP_FOURTH_ORDER
            )
            outer = both(value + 2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER) - both(
                value - 2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER
            )
            rates = (8.0 * inner - outer) / (12.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER)
        G = self.manifold(value).rows(here.q)[1]
        shift, change = rates[: len(G)], rates[len(G) :]
        parameter_motion = np.zeros(len(here.q))
        if np.abs(shift).max(initial=0.0) > 0.0:
            parameter_motion = -np.linalg.lstsq(G, shift, rcond=tol.SINGULAR_VALUE_ZERO)[0]
        if parameter_motion.any():
            change = change + self.manifold(value).change(here, parameter_motion[None])[0]
        return parameter_motion, here.motions @ change

    def _around(
        self, value: float, step: float = tol.DIFFERENCE_STEP_NUMBERS
    ) -> tuple[float, float]:
        """Two values beside one, those that the system takes."""
        low, high = value - step, value + step
        for shifted in (low, high):
            try:
                self.manifold(shifted)
            except ModelError:  # as of a length that must not be negative
                return (low, value) if shifted == high else (value, high)
        return low, high

    def point(self, here: Place, value: float, ahead: Array, before: Point | None = None) -> Point:
        """An equilibrium with the tangent there, onward in a direction, from the point before."""
        K = self.manifold(value).stiffness(here)
        parameter_motion, change = self.derivatives(here, value)
        size = max(float(np.abs(K).max()), float(np.abs(change).max()), tol.TINY)
        vt = np.linalg.svd(np.column_stack([-K, change]) / size)[2]
        y, rate = vt[-1, :-1], vt[-1, -1]
        along = np.append(y @ here.motions + rate * parameter_motion, rate)
        sign = -1.0 if along @ ahead < 0.0 else 1.0
        along *= sign / np.linalg.norm(along)
        tangent = sign * vt[-1]
        side = float(np.linalg.det(np.vstack([np.column_stack([-K, change]) / size, tangent])))
        x = np.append(here.q / self.scale, value)
        arc = before.arc + abs(float((x - before.x) @ before.along)) if before else 0.0
        return Point(x, along, side, None, here, value, K, arc, size)

    def close(self, here: Point, x: Array, ahead: Array) -> Point | None:
        """The point of the curve near x, in the plane through it across a direction."""
        last, value, q = np.inf, float(x[-1]), self.scale * x[:-1]
        for n in range(CORRECTIONS):
            try:
                manifold = self.manifold(value)
            except ModelError:
                return None
            place = manifold.at(q)
            if place is None or len(place.motions) != len(here.place.motions):
                return None
            K = manifold.stiffness(place)
            parameter_motion, change = self.derivatives(place, value)
            off = (x - np.append(place.q / self.scale, value)) @ ahead
            across = place.motions @ ahead[:-1]
            along = parameter_motion @ ahead[:-1] + ahead[-1]
            size = max(float(np.abs(K).max()), float(np.abs(change).max()), tol.TINY)
            A = np.block(
                [[-K / size, change[:, None] / size], [across[None, :], np.array([[along]])]]
            )
            b = np.append(-place.residual / size, off)
            try:
                move = np.linalg.solve(A, b)
            except np.linalg.LinAlgError:
                return None
            length = float(np.linalg.norm(move))
            if not length < 1.0 or (n > 1 and length > last):
                if n > 1 and length < tol.EQUILIBRIUM_STEP_STALLED:
                    return self.point(place, value, ahead, here)
                return None
            q = place.q + self.scale * (move[:-1] @ place.motions + move[-1] * parameter_motion)
            value += float(move[-1])
            if length < tol.LOOP_CLOSURE_CORRECTION:
                closed = self.manifold(value).at(q)
                return None if closed is None else self.point(closed, value, ahead, here)
            last = length
        return None

    def ahead(self, here: Point, step: float) -> Point | None:
        """The point of the curve at that distance along the tangent of another."""
        return self.close(here, here.x + step * here.along, here.along)

    def at_end(self, here: Point, value: float) -> Point | None:
        """The equilibrium where the number has that value, near a point of the curve."""
        manifold = self.manifold(value)
        rate = float(here.along[-1])
        part = (value - here.value) / rate if rate else 0.0
        place = manifold.at(here.place.q + part * self.scale * here.along[:-1])
        for _ in range(CORRECTIONS):
            if place is None:
                return None
            K = manifold.stiffness(place)
            move = np.linalg.lstsq(K, place.residual, rcond=tol.LEAST_SQUARES_RANK_FINE)[0]
            length = float(np.linalg.norm(move))
            if not length < 1.0:
                return None
            place = manifold.moved(place, move @ place.motions)
            if length < tol.LOOP_CLOSURE_CORRECTION and place is not None:
                return self.point(place, value, here.along, here)
        return None

    def fold(self, here: Point, there: Point) -> Point:
        """The point between two others at which the number turns round."""
        none = tol.CURVE_ZERO_VALUE * max(abs(here.along[-1]), abs(there.along[-1]))

        def rate(point: Point) -> float:
            return float(point.along[-1]) if abs(point.along[-1]) > none else 0.0

        width = tol.CURVE_ZERO_BRACKET / (there.arc - here.arc)
        return arclength.zero_on(self.close, here, there, rate, width)[0]


# -- Branch points of equilibria, by a system of equations that is regular there ---------------
# At a simple crossing the Jacobian J = [−K, g] of the residual force by position and number loses
# one rank: wᵀJ = 0. With w and the null space V of J (two columns) the equations Uᵀr = 0 for the
# other left vectors U, and wᵀJV = 0, are as many as their unknowns. Their derivative has full rank
# where both branches have tangents of their own: at transcritical points and pitchforks, at
# perturbed ones too, where wᵀr is not zero and no branch goes through.
#
# G. Moore: The numerical treatment of non-trivial bifurcation points, Numerical Functional Analysis
# and Optimization 2 (1980), 441-472.

#: Corrections to a branch point, at most.
ITERATIONS = 25
#: Points of the curve around a crossing of more branches: a step turns by 0.2 rad at most, and the
#: polynomial through eight of them errs by 1e-11.
NODES = 8


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A place where two branches cross, or nearly do.

    `point`: On the curve that is followed.
    `kind`: ``"pitchfork"``, ``"transcritical"`` or ``"multiple"``.
    `gap`: What is left of the residual force, as a part of its second derivatives: the square of
      how far branches are apart, zero where they cross.
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
    gap = float((np.abs(left[numbers]) * length / went).max())
    return found if gap**2 <= tol.BRANCH_POINT_GAP else None


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
    x = np.append(place.q / follower.scale, value)
    first, last = arclength.norm(x - here.x), arclength.norm(x - there.x)
    if first + last > 1.2 * arclength.norm(there.x - here.x) + 1e-9:
        return None
    arc = here.arc + (there.arc - here.arc) * first / (first + last)
    along = last * here.along + first * there.along
    stiffness = follower.manifold(value).stiffness(place)
    along /= arclength.norm(along)
    point = Point(x, along, 0.0, None, place, value, stiffness, arc, here.size)
    return BranchPoint(point, _kind(H, V), gap)


def _multiple(
    follower: Follower, here: Point, there: Point, function: Callable[[Point], float]
) -> BranchPoint | None:
    """A crossing in which more branches meet, where `of` passes zero, between points of the curve
    around it: in it, where all that a step goes by vanishes, the last digits alone would lead.
    """
    length = there.arc - here.arc

    def at(part: float) -> tuple[float, Array] | None:
        """Function that changes sign, and position and number, at a part of the step; None where no
        point is found.
        """
        point = follower.ahead(here, 0.5 * (1.0 + part) * length)
        if point is None:
            return None
        return function(point), point.x

    nodes = np.polynomial.chebyshev.chebpts1(NODES)
    found = [at(part) for part in nodes]
    known = [n for n in range(NODES) if found[n] is not None]
    if len(known) < NODES - 1:  # one may lie in the crossing itself
        return None
    rows = [one for one in found if one is not None]
    parameters = nodes[known]
    sides = np.polynomial.Chebyshev.fit(
        parameters, [side for side, _ in rows], len(parameters) - 1, (-1.0, 1.0)
    )
    zeros = [z.real for z in sides.roots() if abs(z.imag) < tol.ROOT_REAL and abs(z.real) <= 1.0]
    if len(zeros) != 1:
        return None
    part = float(zeros[0])

    # beside it what passes zero goes by the distance, or by √(distance² + gap) past each other
    offset = tol.BRANCH_POINT_LOOK / length
    ends = at(part - offset), at(part + offset)
    derivative = float(sides.deriv()(part))
    if ends[0] is None or ends[1] is None or not derivative:
        return None
    gap = (
        abs((ends[1][0] - ends[0][0]) / (2.0 * offset * derivative) - 1.0)
        * tol.BRANCH_POINT_LOOK**2
    )
    fit = np.polynomial.chebyshev.chebfit(
        parameters, np.array([row for _, row in rows]), len(parameters) - 1
    )
    x = np.asarray(np.polynomial.chebyshev.chebval(part, fit))
    value = float(x[-1])
    place = follower.manifold(value).at(follower.scale * x[:-1])
    if place is None:
        return None
    arc = here.arc + 0.5 * (1.0 + part) * length
    along = 0.5 * (1.0 - part) * here.along + 0.5 * (1.0 + part) * there.along
    along /= arclength.norm(along)
    stiffness = follower.manifold(value).stiffness(place)
    x = np.append(place.q / follower.scale, value)
    point = Point(x, along, 0.0, None, place, value, stiffness, arc, here.size)
    return BranchPoint(point, "multiple", gap)


def _kind(H: Array, V: Array) -> str:
    """Kind of the crossing, by the second derivatives H on the null space V (2, free + 1)."""
    still = np.array([V[1, -1], -V[0, -1]])  # the direction in which the number stays
    size = float(np.linalg.norm(still))
    curvature = float(still @ H @ still) / size**2 if size > 1e-6 else 0.0
    return (
        "pitchfork"
        if abs(curvature) <= tol.BRANCH_POINT_CURVATURE_NONE * float(np.abs(H).max())
        else "transcritical"
    )


def _solved(
    follower: Follower, q: Array, value: float, free: int
) -> tuple[Place, float, Array, Array, float] | None:
    """Newton's method; the place, the number, second derivatives, the null space and the gap."""
    place = follower.manifold(value).at(q)
    last = np.inf
    for _ in range(ITERATIONS):
        if place is None or len(place.motions) != free:
            return None
        parameter_motion, J = _jacobian(follower, place, value)
        size = float(np.abs(J).max()) or 1.0
        u, s, vt = np.linalg.svd(J / size)
        w, V = u[:, -1], vt[free - 1 :]

        rows = []
        for kernel in V:
            sides = []
            for step in (tol.DIFFERENCE_STEP_FOURTH_ORDER, -tol.DIFFERENCE_STEP_FOURTH_ORDER):
                moved = _moved(follower, place, value, parameter_motion, step * kernel)
                if moved is None or len(moved.motions) != free:
                    return None
                _, other = _jacobian(follower, moved, value + step * float(kernel[-1]))
                sides.append(_aligned(place, moved, other) / size)
            rows.append(w @ (sides[0] - sides[1]) @ V.T / (2.0 * tol.DIFFERENCE_STEP_FOURTH_ORDER))
        H = np.array(rows)
        r = place.residual / size
        across = -(vt[: free - 1].T @ ((u[:, : free - 1].T @ r) / s[: free - 1]))
        along = np.linalg.lstsq(H.T, -(w @ (J / size) @ V.T), rcond=tol.SINGULAR_VALUE_ZERO)[0]
        x = across + along @ V
        length = float(np.linalg.norm(x))
        if length < tol.LOOP_CLOSURE_CORRECTION or (
            length < tol.EQUILIBRIUM_STEP_STALLED and length > 0.5 * last
        ):
            H = 0.5 * (H + H.T)
            # a form with one sign has no branches: an isolated point
            gap = abs(float(w @ r)) / max(float(np.abs(H).max()), tol.TINY)
            return (place, value, H, V, gap) if np.linalg.det(H) < 0.0 else None
        last = length
        x *= min(1.0, tol.BRANCH_POINT_STEP_LONGEST / length)
        place, value = _moved(follower, place, value, parameter_motion, x), value + float(x[-1])
    return None


def _moved(
    follower: Follower, place: Place, value: float, parameter_motion: Array, x: Array
) -> Place | None:
    """The position after a step x of the free motions and of the number."""
    increment = x[:-1] @ place.motions + x[-1] * parameter_motion
    return follower.manifold(value + float(x[-1])).at(place.q + follower.scale * increment)


def _jacobian(follower: Follower, place: Place, value: float) -> tuple[Array, Array]:
    """How the position follows the number, and J (free, free + 1) in the motions of the place."""
    K = follower.manifold(value).stiffness(place)
    parameter_motion, change = follower.derivatives(place, value, fine=True)
    return parameter_motion, np.column_stack([-K, change])


def _aligned(place: Place, nearby: Place, J: Array) -> Array:
    """J of a place nearby in the free motions of another: the nearest ones, for a null space has no
    basis of its own.
    """
    u, _, vt = np.linalg.svd(place.motions @ nearby.motions.T)
    rotation = u @ vt
    return np.column_stack([rotation @ J[:, :-1] @ rotation.T, rotation @ J[:, -1]])


History = TypeVar("History", BodyHistory, PointHistory, Reaction)

#: Points that a curve has at most, unless the caller says how many.
POINTS = 1000


@dataclass(frozen=True, eq=False)
class EquilibriumCurve(Inherited, Presented):
    """Equilibria along a curve: arrays (points,) by name, like a solution's over instants.

    `parameter`: The number that changes.
    `values` (points,): Of it.
    `arclength` (points,): Along the curve, without units: lengths by the model length, angles in
      rad, the number by the width of its span.
    `unit`: Of the number.
    `stability`: Of each point: ``"stable"``, ``"unstable"`` or ``"neutral"``.
    `folds`: Points at which the curve turns round: limit points, where the position snaps through.
    `crossings`: Points at which another branch crosses.
    `kinds`: Of each crossing: ``"pitchfork"`` where one of the branches turns round in it,
      ``"transcritical"`` where none does, ``"multiple"`` where more than two branches meet, as at a
      position where branches of the motion itself meet.
    `solution`: Statics of all points as a batch of designs, one instant each.
    `status`: ``"completed"``, or ``"doubtful: …"`` with the first doubt.
    `doubts`: Where the curve ends before its span does, where it may have gone over to another
      branch, and what is in doubt of the statics. Points are balanced as parts of the greatest
      load, since sums of forces may vanish: what is left beside those sums is reported by
      ``solution.doubts`` alone.
    `notes`: Where and why the curve ends, and the sentences of the doubts.
    """

    parameter: str
    values: Array
    arclength: Array
    unit: str
    stability: tuple[str, ...]
    folds: tuple[int, ...]
    crossings: tuple[int, ...]
    solution: Solution = field(repr=False)
    kinds: tuple[str, ...] = ()

    analysis_name = "equilibrium_curve"
    declared = (
        "parameter unit values arclength stability folds crossings",
        Value("kinds"),
        ItemTable(
            "bodies",
            (Value("x", "", "length"), Value("y", "", "length"), Value("angle", "", "angle")),
            value=lambda found: {one: found[one] for one in found.solution},
        ),
    )

    @property
    def stable(self) -> Array:
        """Whether each point is stable (points,)."""
        return np.array([word == "stable" for word in self.stability])

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, body: str) -> BodyHistory:
        return _flat(self.solution[body])

    def point(self, place: Any) -> PointHistory:
        """A place on a body, such as ``"arm.B"``, at every point."""
        return _flat(self.solution.point(place))

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint at every point."""
        return _flat(self.solution.reaction(joint, on))

    def effort(self, driver: str) -> Array:
        """Effort of a driver that holds, at every point."""
        return self.solution.effort(driver)[:, 0]


def _flat(history: History) -> History:
    """A history of a batch of single instants as arrays over the designs."""
    parts: dict[str, Any] = {
        part.name: value[:, 0]
        for part in dataclasses.fields(history)
        if isinstance(value := getattr(history, part.name), np.ndarray)
    }
    return dataclasses.replace(history, **parts)


@each_design
def equilibrium_curve(
    model: Mechanism | System,
    parameter: str,
    span: tuple[float, float],
    *,
    at: float | None = None,
    free: str | Sequence[str] = (),
    start: Equilibrium | Guesses | None = None,
    t: float = 0.0,
    points: int = POINTS,
) -> EquilibriumCurve:
    """Equilibria as one number changes: equilibrium path, by pseudo-arclength continuation.

    The curve r(q, p) = 0 is followed by its arclength, so that it may turn round in p: at such a
    fold a stable position ends, and the mechanism snaps through (Keller 1977).

    Parameters
    ----------
    model : Mechanism or System
        With free motions; drivers hold what their laws say at t.
    parameter : str
        A changeable number or a parameter, such as ``"field.speed"`` or ``"spring.stiffness"``.
    span : pair of float
        Where it may go, in the direction in which it goes first; it ends where it leaves the span
        on either side.
    at : float, optional
        Where in the span it begins, by default at its first number.
    free : str or sequence of str, optional
        Drivers that are released.
    start : Equilibrium or mapping, optional
        An equilibrium of `equilibrium`, or a guess of one, where it begins; by default the first
        stable one.
    t : float
        Time at which laws are taken.
    points : int
        At most so many are found.

    Returns
    -------
    EquilibriumCurve
        Values, positions, forces and stability as arrays; folds and crossings of branches, each of
        them a point found to rounding.

    Raises
    ------
    ModelError
        For a parameter that is not there, or a span that is none.
    SolveError
        When there is no equilibrium to begin with.

    Examples
    --------
    A pendulum under a torque: it gives way at m g l = 9.81 N·m.

    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81), mbody.Torque("push", "rod", value=0.0))
    >>> curve = equilibrium_curve(machine, "push.value", (-20.0, 20.0), at=0.0)
    >>> [round(float(curve.values[n]), 9) for n in curve.folds]
    [9.81, -9.81]
    """
    system = released(as_system(model), free)
    low, high = _span(system, parameter, span)
    begin = _begin(at, low, high)
    points = whole_number("points", points, 2)
    first = system.with_values({parameter: begin})
    place, manifold = _start(first, start, t)
    follower = Follower(system, manifold, parameter, np.array([low, high]))
    return _Tracer(follower, t, points).traced(place, (begin - low) / (high - low))


def _begin(at: Any, low: float, high: float) -> float:
    """Place in the span at which a curve begins."""
    if at is None:
        return low
    number = isinstance(at, (int, float, np.floating)) and not isinstance(at, bool)
    if not (number and min(low, high) <= at <= max(low, high)):
        raise ModelError(f"at must be a number within the span {low:g} … {high:g}, not {at!r}")
    return float(at)


def _span(system: System, parameter: Any, span: Any) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in span)
        good = bool(np.isfinite([low, high]).all()) and low != high
    except (TypeError, ValueError):
        good = False
    if not good:
        raise ModelError(f"span must be two different numbers, where to begin first, not {span!r}")
    for value in (low, high):
        system.with_values({parameter: value})
    return low, high


def _start(system: System, start: Any, t: float) -> tuple[Place, Manifold]:
    """The equilibrium that the curve begins at."""
    if isinstance(start, Equilibrium):
        bodies = [start[name] for name in start.solution]
        rows = [(body.x[0], body.y[0], body.angle[0]) for body in bodies]
        pose = np.append(np.array(rows).reshape(-1), np.zeros(3))
        begin = closed(system, t, {}, None, pose=pose)
    elif isinstance(start, Mapping):
        begin = closed(system, t, {}, start)
    elif start is None:
        found = search(system, [None], t)
        positions = found.search.found
        if not positions:
            raise Words(system, found.search).nothing()
        words = [stability_of(r, found.manifold.mass(r.place.motions))[0] for r in positions]
        return positions[words.index("stable") if "stable" in words else 0].place, found.manifold
    else:
        raise ModelError(
            f'start must be a rest position or a guess such as {{"crank": 0.3}}, not {start!r}'
        )
    manifold = Manifold(system, begin.work, t, weighted=True)
    here = manifold.place(begin.work.q[: system.coordinates, 0].copy())
    if here is not None:
        nearest = EquilibriumSearch(manifold)
        nearest.nearest(here)
        if nearest.found:
            return nearest.found[0].place, manifold
    raise SolveError(
        f"there is no rest position of '{system.mechanism.name}' near the start: look for one with "
        "equilibrium, and give it as start"
    )


class _Tracer:
    """Steps along one curve and makes the result."""

    def __init__(self, follower: Follower, t: float, points: int) -> None:
        self.follower, self.t, self.points = follower, t, points
        self.path: list[Point] = []
        self.folds: list[Point] = []
        self.crossed: list[Point] = []
        self.kinds: list[str] = []
        self.notes: list[str] = []
        self.doubts: list[Doubt] = []

    def traced(self, place: Place, value: float) -> EquilibriumCurve:
        """The curve from its first place on."""
        first = self.follower.point(place, value, np.eye(len(place.q) + 1)[-1])
        self.path = [first]
        for here, there, leapt in arclength.walk(first, self.follower.close, PACE, self._leaps):
            if not 0.0 <= there.value <= 1.0:
                if leapt:
                    self._stops(here)
                break
            if leapt:
                said = (
                    f"near {self._where(there)} branches come so near each other that the curve "
                    "may have gone over to another one: change a number a little, and compare"
                )
                self.doubts.append(Doubt("branch", said))
            self.path.append(there)
            if self._round(there):
                self.notes.append("it closes on itself")
                break
            if np.abs((there.x - first.x)[:-1]).max() > RUN_AWAY:
                self.notes.append(f"it leaves all bounds near {self._where(there)}")
                break
            if len(self.path) >= self.points:
                said = f"{self.points} points were not enough: give more points"
                self.doubts.append(Doubt("incomplete", said))
                break
        else:
            self._stops(self.path[-1])
        return self._curve()

    def _leaps(self, here: Point, there: Point) -> bool:
        """Whether neighbours are on different branches; folds, crossings and an end between them
        are kept.
        """
        if 0.0 <= there.value <= 1.0:
            return not self._between(here, there)
        return not self._end(here, 1.0 if there.value > 1.0 else 0.0)

    def _where(self, point: Point) -> str:
        return f"{self.follower.parameter} = {self.follower.number(point.value):.6g}"

    def _round(self, there: Point) -> bool:
        """Whether the curve has come back to its beginning."""
        first, parts = self.path[0], len(self.path)
        distance = self.follower.first.distance(first.place.q, there.place.q)
        close = max(distance, abs(first.value - there.value)) < 0.6 * tol.CURVE_STEP_LONGEST
        return parts > 10 and close and bool(first.along @ there.along > tol.CURVE_COSINE)

    def _stops(self, here: Point) -> None:
        """The curve ends at a point within its span."""
        said = (
            f"it cannot be followed beyond {self._where(here)}: give a rest position beyond it as "
            "start of another curve"
        )
        self.doubts.append(Doubt("incomplete", said))

    def _end(self, here: Point, value: float) -> bool:
        """The last point, where the number leaves its span; whether it is on the same branch."""
        if here.value == value:
            return True
        last = self.follower.at_end(here, value)
        if last is None or not last.arc > here.arc or not self._between(here, last):
            return False
        self.path.append(last)
        return True

    def _between(self, here: Point, there: Point) -> bool:
        """Folds and crossings between neighbours; whether both are on one branch."""
        if here.side * there.side < 0.0:
            found = crossing(self.follower, here, there)
            if found is None or found.gap > tol.BRANCH_POINT_GAP:
                return False
            self._crossed(found.point, found.kind)
            return True
        if here.along[-1] * there.along[-1] < 0.0:
            fold = self.follower.fold(here, there)
            self.path.append(fold)
            self.folds.append(fold)
            return True
        one, other = here.stiffnesses, there.stiffnesses
        alike = len(one) == len(other)
        sign_changes = [n for n in range(len(one)) if alike and one[n] * other[n] < 0.0]
        if sign_changes:
            found = together(self.follower, here, there, sign_changes)
            if found is None:
                return False
            self._crossed(found.point, found.kind)
        return True

    def _crossed(self, point: Point, kind: str) -> None:
        self.path.append(point)
        self.crossed.append(point)
        self.kinds.append(kind)

    def _curve(self) -> EquilibriumCurve:
        follower, path = self.follower, self.path
        values = np.array([follower.number(point.value) for point in path])
        words = []
        for point in path:
            manifold = follower.manifold(point.value)
            position = EquilibriumPosition(
                point.place, point.stiffness, manifold.largest(point.place.q), row=False
            )
            words.append(stability_of(position, manifold.mass(point.place.motions))[0])
        # at a fold or a crossing the least stiffness is zero but for the last digits
        for point in (*self.folds, *self.crossed):
            words[path.index(point)] = "neutral"
        system = follower.system.with_values({follower.parameter: values})
        solution = _statics(system, [point.place.q for point in path], self.t)
        curve = EquilibriumCurve(
            parameter=follower.parameter,
            values=values,
            arclength=np.array([point.arc for point in path]),
            unit=_unit(follower.system, follower.parameter),
            stability=tuple(words),
            folds=tuple(path.index(point) for point in self.folds),
            crossings=tuple(path.index(point) for point in self.crossed),
            kinds=tuple(self.kinds),
            solution=solution,
            notes=(*system.notes, *self.notes),
        )
        of_statics = (doubt for doubt in solution.doubts if doubt.kind != "residual")
        return doubted(curve, (*self.doubts, *of_statics))


def _unit(system: System, name: str) -> str:
    """Unit of a changeable number, empty where its place does not say it."""
    mechanism = system.mechanism
    element, _, key = name.partition(".")
    if not key:
        dimension = mechanism.parameters.scope().names[name].dimension
        return "" if dimension is None else mechanism.units.of(dimension)
    for part in dataclasses.fields(mechanism[element]):
        if part.name == key:
            dimension = part.metadata.get("dimension") or part.metadata.get("law")
            return mechanism.units.of(dimension) if dimension else ""
    return ""


def _statics(system: System, poses: list[Array], t: float) -> Solution:
    """Every joint force at every position, each a design."""
    from mbody.analysis.driven.batch import joined, report

    instant, blocks, reports = by_time(system, np.array([t])), [], []
    for design, q in enumerate(poses):
        one = system.design(design)
        runner = Runner(one, "statics", unbalanced=np.inf)
        start = closed(one, t, {}, pose=np.append(q, np.zeros(3)))
        blocks.append(runner.scalar(start, instant))
        record = Record(blocks[-1:], 1, batch=False)
        reports.append(report(runner.solution(start, instant, record)))
    record = Record([np.concatenate(blocks, axis=2)], len(poses), batch=True)
    return joined(system, "statics", instant, record, reports)
