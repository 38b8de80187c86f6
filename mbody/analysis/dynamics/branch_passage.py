"""Passage of a free motion by singular positions: which branch it takes, notes and doubts."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from mbody.analysis.driven.diagnosis import inertialess, valueless
from mbody.analysis.dynamics.integrators import (
    REFINEMENTS,
    auxiliary_sizes,
    find_steady,
    first_auxiliary_states,
    refuse_auxiliary_states,
    stepping,
)
from mbody.analysis.dynamics.interruptions import Interruptions
from mbody.analysis.dynamics.options import MotionRequest
from mbody.analysis.initial.initial_state import event_measure
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.tangent_space import Manifold
from mbody.analysis.singular.nearby_singularity import (
    Crossing,
    MetPosition,
    crossing_note,
    look_ahead,
)
from mbody.analysis.singular.singular_positions import (
    Singular,
    along,
    fits,
    frame,
    is_flat,
    nearest,
    nearest_words,
    norm,
    onto,
    place_words,
    singular,
    still,
    tangent,
    undecided,
)
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    ARTIFICIAL_LIMIT,
    BEST_CONDITIONING,
    CROSSING_TIME,
    DECIDE_BELOW,
    KNOWN_UNTIL,
    LEAST_AT,
    LEAST_CONDITIONING,
    NEXT,
    SHORTENED_UNTIL,
    TIME,
)
from mbody.model.element import listed
from mbody.solution.doubts import Doubt
from mbody.solution.energy import account, causes
from mbody.solution.histories import BranchDistance, Record
from mbody.solution.measures import measured
from mbody.solution.solution import Solution
from mbody.system.rank import dense
from mbody.system.system import System

Array = np.ndarray
#: Change points ahead, those behind, doubts, singular positions that were met.
KnownCrossings = tuple[
    tuple[Crossing, ...], tuple[Crossing, ...], tuple[Doubt, ...], tuple[MetPosition, ...]
]


class BranchPassage:
    """Decides for one motion; `state` is that of its steps."""

    def __init__(self, system: System, regularized: bool, state: Array, whole: float) -> None:
        self.system, self.regularized, self.state, self.whole = system, regularized, state, whole
        self.open: tuple[Crossing, ...] = ()
        self.crossings: tuple[Crossing, ...] = ()
        self.doubts: tuple[Doubt, ...] = ()
        self.met: tuple[MetPosition, ...] = ()
        state[KNOWN_UNTIL] = state[SHORTENED_UNTIL] = state[CROSSING_TIME] = -np.inf
        state[LEAST_CONDITIONING], state[ARTIFICIAL_LIMIT] = np.inf, tol.ARTIFICIAL_MASS_ENERGY
        self.first_position = np.zeros(0)

    @property
    def known(self) -> KnownCrossings:
        """Open crossing, crossings, doubts and singular positions until now, for a restart."""
        return self.open, self.crossings, self.doubts, self.met

    @known.setter
    def known(self, given: KnownCrossings) -> None:
        self.open, self.crossings, self.doubts, self.met = given

    def decide(self, y: Array, derivative: Array) -> None:
        """How the next steps pass what is near, from the state y and its derivative (states,)."""
        state, n = self.state, self.system.coordinates
        t, step = float(state[TIME]), 2.0 * float(state[NEXT])
        now = y[:n], y[n : 2 * n], derivative[n : 2 * n]
        ahead = look_ahead(
            self.system, t, now, step / tol.BRANCH_LOOK_FIRST, self.regularized, self.met
        )
        self.met = ahead.met
        if ahead.clear:
            state[KNOWN_UNTIL], state[NEXT] = t, 0.99 * ahead.clear
        elif ahead.crossing is not None:
            at = ahead.crossing
            over = 2.0 * (at.t - t)
            state[KNOWN_UNTIL], state[CROSSING_TIME] = max(t, at.t + 0.5 * (at.t - t)), at.t
            state[NEXT] = (
                over * (1.0 + tol.BRANCH_STEP_LONGER)
                if step < over < tol.BRANCH_STEP_FARTHER * step
                else step
            )
            self.open = (at,) if at.t > t else ()
        elif step < tol.BRANCH_STEP_HOPELESS * self.whole:
            self._give_up(t, step, ahead.elements)
        elif ahead.closest_time < np.inf:
            state[SHORTENED_UNTIL] = ahead.closest_time + max(ahead.closest_time - t, step)
            state[DECIDE_BELOW] = 0.0
        else:
            state[DECIDE_BELOW] = tol.BRANCH_LOOK_AGAIN * step

    def _give_up(self, t: float, step: float, elements: tuple[str, ...]) -> None:
        unit = self.system.mechanism.units.time
        who = f" of {listed(elements, 4)}" if elements else ""
        self.state[KNOWN_UNTIL] = t + 100.0 * step
        self.doubts += (
            Doubt(
                "branch",
                f"from t = {t:.6g} {unit} on it is not certain on which branch the motion goes on: "
                f"rows{who} become dependent there; begin a little beside, or change a "
                "length by more than its rounding",
                t,
                elements,
            ),
        )

    def record_crossings(self, y: Array) -> None:
        """Record change points that were ahead and are behind at the state y."""
        t = float(self.state[TIME])
        if not self.open or t <= self.state[KNOWN_UNTIL]:
            return
        n = self.system.coordinates
        scale = self.system.coordinate_units
        for one in self.open:
            found = one.passed(t, y[:n] / scale, y[n : 2 * n] / scale)
            if found is not None:
                self.crossings += (found,)
        self.open = ()

    def check_inertia(self, y: Array) -> None:
        """Notes in `state` whether the inertia of the free motion vanishes at y, where artificial
        masses take much of the energy.
        """
        state, n = self.state, self.system.coordinates
        if state[ARTIFICIAL_ENERGY] <= state[ARTIFICIAL_LIMIT]:
            return
        t, state[ARTIFICIAL_LIMIT] = (
            float(state[TIME]),
            tol.ARTIFICIAL_MASS_GROWTH * float(state[ARTIFICIAL_ENERGY]),
        )
        always = inertialess(self.system, t, self.first_position)
        if inertialess(self.system, t, y[:n]) <= always:
            return
        state[ARTIFICIAL_LIMIT] = np.inf
        names = _without_mass(self.system, y[n : 2 * n])
        who = f"{listed(names, 4)} {'has' if len(names) == 1 else 'have'} no mass"
        message = (
            f"at t = {t:.6g} {self.system.mechanism.units.time} the inertia of the free motion "
            f"vanishes, for {who}: how the motion goes on from there is not determined; give mass "
            "and inertia"
        )
        self.doubts += (Doubt("inertia", message, t, names),)

    def notes(self, last: float) -> tuple[str, ...]:
        """The sentence of the change points that were passed until `last`, if there are any."""
        found = [one for one in self.crossings if one.t <= last]
        return (crossing_note(found, self.system.mechanism.units.time),) if found else ()

    def least(self, last: float) -> BranchDistance | None:
        """Least distance of the motion from another branch."""
        found = [one for one in self.crossings if one.t <= last]
        if found:
            return BranchDistance(0.0, found[0].t)
        if not np.isfinite(self.state[LEAST_CONDITIONING]):
            return None
        return BranchDistance(
            float(np.sqrt(self.state[LEAST_CONDITIONING])), float(self.state[LEAST_AT])
        )


def _without_mass(system: System, v: Array) -> tuple[str, ...]:
    """Bodies without mass that move at the rates v (coordinates,), the fastest first."""
    scale = system.coordinate_units
    fast = np.abs(v / scale).reshape(-1, 3).max(axis=1)
    order = np.argsort(-fast)
    bodies = system.mechanism.bodies
    own = system.mass[: len(v), 0].reshape(-1, 3)
    return tuple(
        bodies[b].name
        for b in order
        if not own[b].any() and fast[b] > tol.PARTICIPATION * fast.max()
    )


# -- Choice of a branch at a singular position, and its start ----------------------------------
# Velocities choose: a motion that moves goes on along the branch that its velocities belong to. One
# that rests there, or moves along what several branches share, takes the branch on which the least
# force has to be put against what the loads would do by themselves (Gauss's principle of least
# constraint), and a doubt says that others are possible.


@dataclass(frozen=True, eq=False)
class BranchStart:
    """How a motion begins in a singular position.

    `q`, `v`, `a` (coordinates,): With their units.
    `scale` (coordinates,): Sizes of the coordinates.
    `T0` (free, unknowns): What is free along the branch.
    `away`: How far the start is from the singular position, in model lengths and radians.
    `late`: How long ago the motion was there.
    `growth`: Reactions grow as that power of one over the time since then; 0: they have a limit.
    """

    q: Array
    v: Array
    a: Array
    scale: Array
    T0: Array
    away: float
    late: float
    growth: int
    doubts: tuple[Doubt, ...] = ()


def is_suspect(system: System, start: Solution, t: float, q: Array, v: Array) -> bool:
    """Whether a closer look at a start is worth its time: rows depend on each other, or nearly."""
    if start.regularization:
        return True
    work, n = system.work(masses=True), system.coordinates
    record = np.empty((system.record_rows, 1))
    S = stepping(system.state_count, len(causes(system)), 0.0)
    S.y[:n], S.y[n : 2 * n], S.state[TIME] = q, v, t
    S.y[2 * n :] = first_auxiliary_states(system, start)
    initial_derivative(system.runtime(), work, S, 0, record)
    return not S.state[BEST_CONDITIONING] > tol.PIVOT_SUSPECT


def choose_branch(
    system: System, start: Solution, state: tuple[float, Array, Array]
) -> BranchStart | None:
    """How a motion begins where its start is singular; None where it is not, or rests for good."""
    t, q, v = state
    if not system.rows or not is_suspect(system, start, t, q, v):
        return None
    work = system.work()
    work.time[:] = t
    laws_of_time(system.runtime(), work)
    work.q[: len(q), 0] = q
    here = singular(system, work, t)
    if here is None:
        return None
    inputs = work.signal[system.layout.input_row, 0]
    own = np.concatenate([first_auxiliary_states(system, start), inputs])
    return _Choice(system, here, (t, q, v), own).start()


class _Choice:
    def __init__(
        self, system: System, here: Singular, state: tuple[float, Array, Array], own: Array
    ) -> None:
        t, q, v = state
        self.system, self.here, self.t, self.v = system, here, t, v
        scale = here.rows.scale
        self.mass = system.mass[: system.coordinates, 0] * scale**2
        work: Work = system.work()
        work.time[:] = t
        laws_of_time(system.runtime(), work)
        work.q[: len(q), 0] = q
        manifold = Manifold(system, work, t, own)
        self.force = manifold.force(scale * here.x, v)
        top = max(manifold.largest(q), float(np.abs(self.force).max()))
        self.natural = float(np.sqrt(top / max(float(self.mass.max()), tol.TINY)))

    def start(self) -> BranchStart | None:
        here, scale = self.here, self.here.rows.scale
        y = here.unknowns(self.v)
        if np.abs(self.v / scale).max() <= tol.RATE_NONE * self.natural and here.steady:
            y = np.zeros(len(y))
        else:
            found = self._on_branch(y)
            if found is None:
                return None
            y = found
        branches = here.branches(y)
        spaces = [T for T in branches.spaces if fits(here, T)]
        if not spaces and norm(here.y) > tol.SINGULAR_DISTANCE_DETERMINED:
            return None
        if not spaces or (len(branches.odd) and y.any()):
            raise undecided(self.system, self.t)
        motions = [self._motion(T, y) for T in spaces]
        constraint = np.array([one[1] for one in motions])
        order = np.argsort(constraint)
        T, a = spaces[order[0]], motions[order[0]][0]
        # where second order does not decide there is no better way out either
        if any(self._motion(u[None], y)[1] < constraint[order[0]] for u in branches.odd):
            raise undecided(self.system, self.t)
        doubts: tuple[Doubt, ...] = ()
        if len(spaces) > 1 or len(branches.odd):
            unlike = [
                n
                for n in order[1:]
                if np.abs(motions[n][0] - a).max() > tol.BRANCH_TIE * np.abs(a).max()
            ]
            if not np.abs(a).max() > 0.0 and not unlike:
                return None
            tied = not unlike and len(spaces) > 1
            if tied or (
                unlike
                and constraint[unlike[0]] - constraint[order[0]]
                <= tol.BRANCH_TIE * motions[order[0]][2]
            ):
                raise self._tied(len(spaces))
            doubts = (self._several(len(spaces), a),)
        if not y.any() and not np.abs(a).max() > 0.0:
            return None
        return self._branch_start(T, y, a, doubts)

    def _on_branch(self, y: Array) -> Array | None:
        """The velocities as those of a branch, where they differ from one by no more than rounding
        of digits, and by what the start is away from the singular position; None where the start is
        so far away that its rows determine the motion.
        """
        here = self.here
        away = norm(here.y)
        fitted = onto(here.A, y, here.clock)
        if fitted is not None and norm(fitted - y) <= (
            tol.BRANCH_VELOCITIES_SAME + 10.0 * away
        ) * norm(y):
            T = tangent(here.A, fitted)
            if not is_flat(here.A, T):
                return fitted
            if fits(here, T):
                free = still(T, here.clock)
                return np.asarray(fitted + (free @ (y - fitted)) @ free)
        if away > tol.SINGULAR_DISTANCE_DETERMINED:
            return None
        raise SolveError(
            f"no motion of '{self.system.mechanism.name}' has the velocities of the start at "
            f"{place_words(self.system, self.t)}: the position is singular, where joints allow "
            "those velocities to first order only"
            f"{nearest_words(self.system, here, nearest(here, y))}"
        )

    def _motion(self, T: Array, y: Array) -> tuple[Array, float, float]:
        """Accelerations (coordinates,) without units on a branch, their constraint, its size."""
        here = self.here
        second_order = here.second_order(T, y) if y.any() else np.zeros(len(self.mass))
        a = second_order + self._along(still(T, here.clock) @ here.directions, second_order)
        n = len(here.N)
        free = second_order + self._along(here.N, second_order) if n else second_order
        off = a - free
        return a, float(off @ (self.mass * off)), float(free @ (self.mass * free)) or 1.0

    def _along(self, directions: Array, second_order: Array) -> Array:
        """The accelerations along `directions` that the loads make, beside `second_order`."""
        residual = directions @ (self.force - self.mass * second_order)
        return np.asarray(
            np.linalg.lstsq(
                (directions * self.mass) @ directions.T, residual, rcond=tol.LEAST_SQUARES_RANK_FINE
            )[0]
            @ directions
        )

    def _branch_start(self, T: Array, y: Array, a: Array, doubts: tuple[Doubt, ...]) -> BranchStart:
        here, scale = self.here, self.here.rows.scale
        T0, place = still(T, here.clock), along(T, here)
        away, fast = norm(place), norm(y)
        q, directions = frame(here, T, place)
        v = (T @ y) @ directions
        left = here.N @ (self.force - self.mass * a)
        top = np.abs(here.N * self.force).max(initial=0.0) + np.abs(here.N * self.mass * a).max()
        growth = 0
        if np.abs(left).max(initial=0.0) > tol.FORCE_NONE_BRANCH * top:
            growth = 1 if y.any() else 2
        if growth:
            joints = tuple(joint.name for joint in self.system.mechanism.joints)
            why = (
                "the reactions grow without bound towards the singular position at "
                f"{place_words(self.system, self.t)}: they are not given there"
            )
            doubts = (*doubts, Doubt("incomplete", why, self.t, joints))
        late = away / fast * np.sign(place @ y) if fast and away else 0.0
        return BranchStart(scale * q, scale * v, scale * a, scale, T0, away, late, growth, doubts)

    # -- sentences ----------------------------------------------------------------------------

    def _tied(self, count: int) -> SolveError:
        return SolveError(
            f"the motion of '{self.system.mechanism.name}' is not determined at "
            f"{place_words(self.system, self.t)}: the position is singular, {count} branches of "
            "the motion meet there, and the loads drive it along several of them alike; give a "
            "rate that chooses the branch, or begin a little beside"
        )

    def _several(self, count: int, a: Array) -> Doubt:
        speeds = np.abs(a.reshape(-1, 3)).max(axis=1)
        bodies = self.system.mechanism.bodies
        names = [
            bodies[n].name for n in np.flatnonzero(speeds > tol.RATE_NONE_MOTION * speeds.max())
        ]
        return Doubt(
            "singular",
            f"it begins in a singular position at {place_words(self.system, self.t)}, where "
            f"{count} branches of the motion meet that have its velocities; the one with the least "
            "constraint (Gauss) is taken: give a rate that chooses the branch, or begin a little "
            "beside",
            self.t,
            tuple(names),
        )


# -- First span of a motion out of a singular position, along its branch -----------------------
# At the position itself the equations of motion have no one solution, and steps that begin there
# begin with wrong derivatives. So the first part is a polynomial (collocation): the accelerations
# are those of the branch at nodes beside the position, where the rows are independent, and the
# state is their integral. Accelerations, reactions and powers at the first instant are limits.

#: Nodes of the polynomial, and the first of them as a part of the whole.
NODES, FIRST_NODE = 9, Fraction(3, 20)
#: How often the first part is halved for the last term of the polynomial, for iterations that do
#: not settle, and for an event within it.
HALVED = 24
#: Iterations until the accelerations have settled, at most.
ITERATIONS = 60
#: Samples of the first part at which events are looked for.
WATCHED = 33


@dataclass(frozen=True, eq=False)
class Weights:
    """Of a polynomial through NODES values on [0, 1].

    `at` (nodes,): The nodes.
    `powers` (nodes, nodes): Coefficient k of the polynomial that is one at node j: [k, j].
    `last` (nodes,): Of the last Chebyshev polynomial over the nodes.
    """

    at: Array
    powers: Array
    last: Array

    def value(self, c: Array, order: int = 0) -> Array:
        """Weights (…, nodes) of the value at c, of its first or second integral from 0."""
        c = np.asarray(c, dtype=float)[..., None]
        k = np.arange(NODES)
        own: Array = c ** (k + order)
        for n in range(1, order + 1):
            own = own / (k + n)
        return np.asarray(own @ self.powers)


@functools.lru_cache(maxsize=1)
def weights() -> Weights:
    """In rational numbers, since a Vandermonde matrix in floating point would lose eight digits."""
    # near the extrema of Chebyshev's polynomial on [FIRST_NODE, 1]: mild extrapolation to 0
    spread = [round(1000 * np.cos(np.pi * n / (NODES - 1))) for n in range(NODES - 1, -1, -1)]
    middle, half = (1 + FIRST_NODE) / 2, (1 - FIRST_NODE) / 2
    nodes = [middle + half * Fraction(part, 1000) for part in spread]
    powers = [[Fraction(0)] * NODES for _ in range(NODES)]
    for j, node in enumerate(nodes):
        own = [Fraction(1)]
        for other in nodes[:j] + nodes[j + 1 :]:
            low, high = [-other * c for c in own] + [Fraction(0)], [Fraction(0), *own]
            own = [(a + b) / (node - other) for a, b in zip(low, high, strict=True)]
        for k, c in enumerate(own):
            powers[k][j] = c
    last = [float(c * half ** (NODES - 1) / 2 ** (NODES - 2)) for c in powers[-1]]
    return Weights(
        np.array([float(node) for node in nodes]),
        np.array([[float(c) for c in row] for row in powers]),
        np.array(last),
    )


@dataclass(frozen=True, eq=False)
class Collocation:
    """The first part of a motion: values at its nodes.

    `span`: How long it is.
    `a` (nodes, coordinates)
    `rates` (nodes, owns): Of auxiliary states.
    `reactions` (nodes, PER_PRIMITIVE · primitives)
    `powers` (nodes, causes)
    """

    span: float
    a: Array
    rates: Array
    reactions: Array
    powers: Array
    evaluations: int


def singular_start(
    system: System,
    start: Solution,
    state: tuple[float, Array, Array],
    request: MotionRequest,
    until: float,
) -> Solution | None:
    """The first part of a motion whose start is singular; None where it is not. `state`: time,
    positions and rates at the start.
    """
    found = choose_branch(system, start, state)
    if found is None:
        return None
    refuse_auxiliary_states(system, "singular start")
    return _SingularStart(system, start, found, request, until).solution()


class _SingularStart:
    def __init__(
        self,
        system: System,
        start: Solution,
        first: BranchStart,
        request: MotionRequest,
        until: float,
    ) -> None:
        self.system, self.start, self.first, self.request = system, start, first, request
        self.t, self.longest = float(start.t[-1]), until - float(start.t[-1])
        self.layout = system.runtime()
        self.work: Work = system.work(masses=True)
        free = len(first.T0)
        self.regularization = tol.REDUNDANT_ROW_SOFTNESS * (system.rows > system.coordinates - free)
        self.stepping = stepping(system.state_count, len(causes(system)), self.regularization)
        self.K, self.y, self.P = self.stepping.K, self.stepping.y, self.stepping.P
        self.record = np.empty((system.record_rows, 1))
        # reactions, then auxiliary states and inputs
        self.reaction_rows = slice(3 * system.coordinates, system.auxiliary_rows.start)
        self.longest = min(self.longest, self._next_change())
        self.own, self.sizes = first_auxiliary_states(system, start), auxiliary_sizes(system)
        n = system.coordinates
        self.y[:n], self.y[n : 2 * n], self.y[2 * n :] = first.q, first.v, self.own
        if find_steady(self):
            self.own = self.y[2 * n :].copy()

    def _next_change(self) -> float:
        """Time until inputs jump or laws have corners."""
        system = self.system
        return Interruptions(system, self.work, self.t, self.t + self.longest).next(self.t) - self.t

    def evaluate(self) -> bool:
        """Rates of auxiliary states at the start, where accelerations are none."""
        self.stepping.state[TIME] = self.t
        initial_derivative(self.layout, self.work, self.stepping, REFINEMENTS, self.record)
        raise_user_error(self.system)
        return True

    def solution(self) -> Solution:
        """The instants of the first part that are kept, and its end."""
        part = self._longest_span()
        for _ in range(HALVED):
            run = self._solution(part, np.linspace(0.0, part.span, WATCHED))
            if not self._crossed(run):
                break
            part = self._tried(0.5 * part.span)
        end = self.t + min(part.span, self.longest)
        times = self.request.times[(self.request.times >= self.t) & (self.request.times < end)]
        return self._solution(part, np.append(times, end) - self.t)

    def _crossed(self, run: Solution) -> bool:
        """Whether an event may be within the first part."""
        for event in self.request.events:
            value = measured(run, event_measure(self.system.mechanism, event))[0]
            signs = np.sign(value[1:])
            if (signs != signs[0]).any():
                return True
        return False

    # -- the polynomial -----------------------------------------------------------------------

    def _longest_span(self) -> Collocation:
        """Collocation polynomial of the longest admissible first span."""
        first, scale = self.first, self.first.scale
        velocity_scale, pull = (float(np.abs(one / scale).max()) for one in (first.v, first.a))
        # velocity_scale t + pull t²/2 = FAR
        span = (
            2.0
            * tol.SINGULAR_START_SPAN
            / (
                velocity_scale
                + np.sqrt(velocity_scale * velocity_scale + 2.0 * pull * tol.SINGULAR_START_SPAN)
            )
        )
        if span > self.longest:  # what comes later is of use: nodes are farther off
            try:
                return self._tried(float(span))
            except SolveError:
                return self._tried(self.longest)
        return self._tried(float(span))

    def _tried(self, span: float) -> Collocation:
        """Collocation polynomial of a span, halved until its last coefficients are small."""
        best: tuple[float, Collocation] | None = None
        for _ in range(HALVED):
            found = self._settled(span)
            if found is not None:
                even = self._without_units(found.a, found.rates, span)
                top, off = np.abs(even).max(), np.abs(weights().last @ even).max()
                if off <= tol.SINGULAR_START_TERM * top:
                    return found
                if best is None or off < best[0]:
                    best = float(off), found
                elif off > 2.0 * best[0]:  # rounding has begun to grow
                    break
            span *= 0.5
        if best is not None:
            return best[1]
        raise SolveError(
            f"the motion cannot be followed out of the singular position at t = {self.t:.6g} "
            f"{self.system.mechanism.units.time}: the loads jump there, or are too stiff; begin a "
            "little beside it"
        )

    def _without_units(self, a: Array, rates: Array, span: float) -> Array:
        """Accelerations, and rates of auxiliary states as by what they change in the span."""
        return np.hstack([a / self.first.scale, rates / (self.sizes * span)])

    def _settled(self, span: float) -> Collocation | None:
        """Accelerations at the nodes that agree with the motion that they make; None where the
        iteration does not settle, or leaves the branch.
        """
        first, w = self.first, weights()
        once, twice = span * w.value(w.at, 1), span**2 * w.value(w.at, 2)
        n, size = self.system.coordinates, len(w.at)
        a = np.tile(first.a, (size, 1))
        rates = np.zeros((size, len(self.own)))
        reactions = np.empty((size, self.reaction_rows.stop - self.reaction_rows.start))
        powers = np.empty((size, self.P.shape[1]))
        last = np.inf
        for iteration in range(ITERATIONS):
            v = first.v + once @ a
            q = first.q + span * w.at[:, None] * first.v + twice @ a
            z = self.own + once @ rates
            new, fresh = np.empty_like(a), np.empty_like(rates)
            for node in range(size):
                if not self._evaluate(self.t + span * w.at[node], q[node], v[node], z[node]):
                    return None
                projected = np.abs((self.y[:n] - q[node]) / first.scale).max()
                if (
                    iteration > 1
                    and projected > 0.05 * np.abs((q[node] - first.q) / first.scale).max()
                ):
                    return None
                new[node], powers[node] = self.K[0, n : 2 * n], self.P[0]
                fresh[node], reactions[node] = (
                    self.K[0, 2 * n :],
                    self.record[self.reaction_rows, 0],
                )
            change = np.abs(self._without_units(new - a, fresh - rates, span)).max()
            a, rates = new, fresh
            top = np.abs(self._without_units(a, rates, span)).max()
            if not change < 1e3 * max(top, np.abs(first.v / first.scale).max() / span):
                return None
            if change <= tol.SINGULAR_START_SETTLED * top or (
                change <= tol.SINGULAR_START_ROUNDING * top and change > 0.5 * last
            ):
                return Collocation(span, a, rates, reactions, powers, size * (iteration + 1))
            last = change
        return None

    def _evaluate(self, t: float, q: Array, v: Array, z: Array) -> bool:
        """Derivative, powers and record at a state, projected; whether the loops close there."""
        n = self.system.coordinates
        self.y[:n], self.y[n : 2 * n], self.y[2 * n :] = q, v, z
        self.stepping.state[TIME] = t
        good = initial_derivative(self.layout, self.work, self.stepping, REFINEMENTS, self.record)
        raise_user_error(self.system)
        if good and not np.isfinite(self.K).all():
            raise valueless(self.system, self.system.work(), t, self.y[:n], self.y[n : 2 * n])
        return bool(good)

    # -- kept instants -------------------------------------------------------------------------

    def _solution(self, part: Collocation, after: Array) -> Solution:
        """The motion at times after the start."""
        system, first, w = self.system, self.first, weights()
        n = system.coordinates
        c = after / part.span
        records = np.empty((len(after), len(self.record)))
        records[:, :n] = first.q + after[:, None] * first.v + part.span**2 * w.value(c, 2) @ part.a
        records[:, n : 2 * n] = first.v + part.span * w.value(c, 1) @ part.a
        records[:, 2 * n : 3 * n] = w.value(c) @ part.a
        own, owns = system.auxiliary_rows, len(self.own)
        records[:, self.reaction_rows] = self._reactions(part, c)
        records[:, own.start : own.start + owns] = self.own + part.span * w.value(c, 1) @ part.rates
        for instant, later in zip(records, after, strict=True):
            self.work.time[:] = self.t + later
            laws_of_time(self.layout, self.work)
            instant[own.start + owns :] = self.work.signal[system.layout.input_row, 0]
        if self.first.growth and c[0] == 0.0:
            records[0, self.reaction_rows] = np.nan
        if c[0] == 0.0 and first.away <= tol.SINGULAR_DISTANCE_AT:
            onward = (
                (w.value(np.array(1e-3)) - w.value(np.array(0.0))) @ part.a / (1e-3 * part.span)
            )
            records[0, 2 * n : 3 * n] = first.a + first.late * onward
        known = np.isfinite(records[:, self.reaction_rows]).all(axis=1)
        for k in np.flatnonzero((c < 1.0) & known):
            records[k, self.reaction_rows] = self._balanced(self.t + after[k], records[k])
        for k in np.flatnonzero(c == 1.0):  # on the constraints to rounding, from here on
            z = records[k, own.start : own.start + owns]
            self._evaluate(self.t + part.span, records[k, :n], records[k, n : 2 * n], z)
            records[k] = self.record[:, 0]
        gained = part.span * w.value(c, 1) @ part.powers
        output = records[:, :, None]
        before = self.start.notes if self.start.analysis == "close_loops" else ()
        return Solution(
            system=system,
            analysis="simulate",
            t=self.t + after,
            record=Record([output], len(after), batch=False),
            given=None,
            regularization=self.regularization,
            notes=before,
            doubts=first.doubts,
            stats={"steps": 1, "rejected": 0, "careful": 1, "evaluations": part.evaluations},
            energy=account(system, output[:, :, 0], gained),
        )

    def _balanced(self, t: float, record: Array) -> Array:
        """Reactions of an instant: interpolated in the part that depends on other rows, or nearly
        so, all else from the balance of the loads there.
        """
        system, scale, n = self.system, self.first.scale, self.system.coordinates
        L, work, (primitive, row, _) = system.layout, self.work, system.row_table
        unit = system.row_units
        forces = Manifold(system, system.work(), t, record[system.auxiliary_rows])
        forces.work.time[:] = t
        laws_of_time(self.layout, forces.work)
        loads = forces.force(record[:n], record[n : 2 * n])
        work.q[:n, 0] = record[:n]
        G = dense(system, work)[1]
        lam = record[self.reaction_rows].reshape(-1, PER_PRIMITIVE)[:, :2].copy()
        rows = lam[primitive, row] / unit
        left = loads - system.mass[:n, 0] * scale * record[2 * n : 3 * n] - G.T @ rows
        u, sizes, vt = np.linalg.svd(G, full_matrices=False)
        rank = int((sizes > tol.SINGULAR_VALUE_DEPENDS * sizes[0]).sum())
        rows = unit * (rows + u[:, :rank] @ ((vt[:rank] @ left) / sizes[:rank]))
        lam[primitive, row] = rows
        block = work.block[: 12 * L.nodes, 0].reshape(-1, 2, 2, 3)[L.primitive_node, 1]
        force = -np.einsum("erk,er->ek", block, lam)
        ax, ay = (work.par[L.primitive_arm + k, 0] for k in range(2))
        c, s = work.turn[2 * L.primitive_j, 0], work.turn[2 * L.primitive_j + 1, 0]
        px, py = c * ax - s * ay, s * ax + c * ay
        torque = force[:, 2] - (px * force[:, 1] - py * force[:, 0])
        return np.column_stack([lam, force[:, :2], torque]).ravel()

    def _reactions(self, part: Collocation, c: Array) -> Array:
        """Limits of the reactions; where they grow without bound, with the time that they do not
        grow with, and none at the position itself.
        """
        w, power = weights(), self.first.growth
        late = self.first.late / part.span
        if not power:
            return w.value(c) @ part.reactions
        even = w.value(c) @ ((w.at + late)[:, None] ** power * part.reactions)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = even / ((c + late) ** power)[:, None]
        found[c + late <= 0.0] = np.nan
        return np.asarray(found)
