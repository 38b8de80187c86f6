"""The analysis `equilibrium`: where a mechanism with free motions balances, stable or not."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np

from mbody.analysis.contact.closed_contacts import with_closed_contacts
from mbody.analysis.driven.contact_report import pulled
from mbody.analysis.driven.open_forces import with_admissible_forces
from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import by_time
from mbody.analysis.equilibria.curve_walk import MotionCurve, Node, Walk
from mbody.analysis.equilibria.search import (
    EquilibriumPosition,
    EquilibriumSearch,
    directionless_loads,
    jumping_loads,
    without_stiffness,
)
from mbody.analysis.freedom.mobility import (
    FreeMotion,
    free_motions,
    rates_of,
    released,
    single_time,
)
from mbody.analysis.position.assembly_analysis import as_system, closed, each_design
from mbody.analysis.position.tangent_space import Array, Manifold, Place, massive
from mbody.core import tolerances as tol
from mbody.core.arclength import zero_on
from mbody.core.bracket import zero_between
from mbody.core.presentation import Presented
from mbody.errors import ModelError, SolveError, remedy
from mbody.kernels.finished_instants import PER_PAIR, StoredMotion, forces_by_senses, rates_of_pairs
from mbody.kernels.friction import IMPENDING
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.model.body import Guesses
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import kept_states, left_out, with_friction, without_friction
from mbody.quantities.units import UnitSystem
from mbody.solution.contact_forces import friction_pairs, may_hold
from mbody.solution.declared_result import Value
from mbody.solution.doubts import Doubt, Inherited, doubted
from mbody.solution.friction_results import (
    ContactLimits,
    StickingContacts,
    friction_of_contacts_alone,
    slip_signs_with_sticking,
)
from mbody.solution.histories import BodyHistory, Reaction, Record, link_poses
from mbody.solution.solution import Solution
from mbody.system.system import DENSE, Locked, System, too_large

# -- Bands of positions at which friction holds a single free motion, their ends located -------
#
# A mechanism rests where friction can take what drives it. Along the curve of its positions, with
# the unit tangent t and the loads f, it is about to move on where
#
#     g₊ = t·f − Σ_k x_k |g_k t| = 0,   x = φ(λ₀ + B x) for the directions of g_k t,
#
# all frictional joints giving the friction that they can give at rest, and about to move back where
# g₋ = t·f + Σ_k x_k |g_k t| = 0 with the opposite directions: it rests where g₊ ≤ 0 ≤ g₋. That is
# the test of the bands of holding efforts in statics: where no effort is needed it does not matter
# what would give it. Where friction grows without bound, as what jams does, it holds.

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
        forces = StickingContacts(self.limits, manifold.work, load / manifold.force_unit)
        return forces.reserve() * float(np.abs(load).max(initial=0.0))


#: A node, the reserve there, and whether the curve is smooth up to the next one.
Sample = tuple[Node, float, bool]

#: Parts of a step of the walk at which the reserve of friction is sampled.
PARTS = 4
#: Half of the way, of that between two nodes, over which the rise of a reserve is compared.
APART = 0.5**20


@dataclass(frozen=True, eq=False)
class EquilibriumBand(Presented):
    """Positions along a single free motion at which friction holds, from one end to the other.

    `low`, `high`: The position at either end, where the mechanism is about to move out of the band:
      by body (x, y, angle) of its link axes, as a `guess` takes it; None where the band has no end
      there. `low` is where the leader's angle, or displacement, is less.
    `leader`: The body whose angle, or displacement, tells positions apart.
    `positions`: Numbers of the equilibria in it at which no friction is needed.
    """

    low: Mapping[str, tuple[float, float, float]] | None
    high: Mapping[str, tuple[float, float, float]] | None
    leader: str
    positions: tuple[int, ...]

    declared = (
        Value("low", "", ("length", "length", "angle")),
        Value("high", "", ("length", "length", "angle")),
        "leader positions",
    )

    @property
    def everywhere(self) -> bool:
        """Whether friction holds all positions of the free motion: it is self-locking."""
        return self.low is None and self.high is None


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
        ends = nodes[0], nodes[-1]
        begun = [_revolutions_before(node, *ends) for node in last.inside]
        first = None if last.first is None else _revolutions_before(last.first, *ends)
        bands[0] = Band(first, bands[0].last, (*begun, *bands[0].inside))
    return [band for band in bands if not _is_point(band)]


def _revolutions_before(node: Node, back: Node, ahead: Node) -> Node:
    """The node whole revolutions before, which are those from one node ahead to another."""
    q, x = (node.place.q + (back.place.q - ahead.place.q)), node.x + (back.x - ahead.x)
    return replace(node, x=x, place=replace(node.place, q=q))


def _is_point(band: Band) -> bool:
    """Whether a band is an equilibrium alone, as one at which nothing with friction would slide."""
    if band.first is None or band.last is None or len(band.inside) > 1:
        return False
    displacement = band.last.x - band.first.x
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
            back = [node.reversed() for node in reversed(walk.nodes[1:])]
            nodes, smooth = [*back, *nodes], [*reversed(walk.smooth), *smooth]
        for n, (one, other) in enumerate(itertools.pairwise(nodes)):
            yield one, self.reserve(one.place, one.along), smooth[n]
            if not smooth[n]:
                continue
            for k in range(1, PARTS):
                node = self.curve.between(one, other, k / PARTS)
                if node is not None:
                    yield node, self.reserve(node.place, node.along), True
        last = nodes[-1]
        yield last, self.reserve(last.place, last.along), False

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
            ahead = float((nearest[0].x - node.x) @ node.along) > 0.0
            found = (nearest[0], nearest[1], True)
            yield from (sample, found) if ahead else (found, sample)

    def _nearest(self, one: Node, other: Node, sign: float) -> tuple[Node, float] | None:
        """Place at which the sign times the reserve is least between two nodes, where its rise over
        a short way changes its sign; the first place at which it is negative.
        """
        tried: list[tuple[Node, float]] = []

        def rise(part: float) -> float:
            for place in (part - APART, part + APART):
                node = self.curve.between(one, other, place)
                if node is None:
                    return np.nan
                tried.append((node, self.value(node)))
                if sign * tried[-1][1] < 0.0:
                    return np.nan
            # where it is level, as it is limited, the middle was less
            return sign * (tried[-1][1] - tried[-2][1]) or part - 0.5

        zero_between(rise, (0.0, 1.0), (-np.inf, np.inf), APART)
        return min(tried, key=lambda pair: sign * pair[1], default=None)

    def end(self, left: Sample, right: Sample) -> Node:
        """Zero of the reserve between two neighbours; across a corner the one that holds."""
        (one, a, smooth), (other, _, _) = left, right
        if not smooth:
            return one if a >= 0.0 else other
        width = tol.FRICTION_BAND_END / max(float(np.abs(other.x - one.x).max()), tol.TINY)

        def reserve(node: Node) -> float:
            return min(self.reserve(node.place, node.along), self.most)

        return zero_on(self.curve.close, one, other, reserve, width)[0]


# -- Base of results at several equilibria -----------------------------------------------------

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class AtEquilibria(Inherited, Generic[T], Presented):
    """One result at each equilibrium; ``print`` shows them as tables.

    `mechanism`: Its name.
    `t`: The time at which drivers and loads are taken.
    `positions`: One entry an equilibrium position.
    `status`, `doubts`, `notes`: As of `Inherited`.
    """

    mechanism: str
    units: UnitSystem
    t: float
    positions: tuple[T, ...] = field(repr=False)

    def __len__(self) -> int:
        return len(self.positions)

    def __iter__(self) -> Iterator[T]:
        return iter(self.positions)

    def __getitem__(self, index: int) -> T:
        return self.positions[index]


# -- Sentences about a search for equilibria: what it met, what it may miss, why it failed -----

#: Free motions beyond which the spread of starts is thin.
FEW = 2
#: Why a walk or a cover ended, and what may be missing then.
MISSING = {
    "long": "the free motion was followed as far as {} and goes on: rest positions beyond may be "
    "missing; begin there with starts",
    "stuck": "the free motion could not be followed beyond {}: rest positions beyond may be "
    "missing; begin there with starts",
    "wound": "loads tell whole turns apart: sought up to {}, and half a turn back; rest positions "
    "beyond may be missing; begin there with starts",
    "odd": "an odd number of rest positions was found on the surface of positions around "
    "{}: one at least is missing; begin elsewhere with starts",
    "wide": "the two free motions were searched as far as {} and go on: rest positions beyond may "
    "be missing; begin there with starts",
    "turns": "loads tell whole turns apart: one turn was searched around {}; rest positions in "
    "others may be missing; begin there with starts",
    "unsure": "how many rest positions there are near {} is not certain{}: begin there with starts",
    "alternate": "stable and unstable positions do not alternate near {}: one may be missing; "
    "begin there with starts",
}


class Words:
    """Sentences about one search."""

    def __init__(self, system: System, search: EquilibriumSearch) -> None:
        self.system, self.search = system, search
        self.mechanism, self.manifold = system.mechanism, search.manifold

    def facts(self) -> list[str]:
        """Sentences on singular positions passed and on the bounds of the motion."""
        found = []
        for _, walk in self.search.walks:
            for place in walk.corners:
                where, _ = self.where(place)
                found.append(
                    f"at {where} a prescribed distance is zero: the motion is followed through it"
                )
            for place in walk.crossings:
                where, _ = self.where(place)
                found.append(
                    f"at {where} branches of the motion meet: only the one that goes on smoothly "
                    "was searched; begin on others with starts"
                )
        for why, place in self.search.ends:
            if why == "no value":
                where, _ = self.where(place)
                found.append(f"beyond {where} a load has no value: the search ends there")
        for place in self.search.jumps:
            where, _ = self.where(place)
            note = (
                f"at {where} loads jump and drive it back from both sides: it may stay there, but "
                "no forces balance"
            )
            if note not in found:  # along a nonsmooth line neighbours read alike
                found.append(note)
        for place in self.search.lifts:
            where, _ = self.where(place)
            note = f"at {where} {self.meeting(place)}, and beside it they drive it away"
            if note not in found:
                found.append(note)
        return found

    def meeting(self, place: Place) -> str:
        """Sentence on loads whose ends coincide, where their force has no direction."""
        names = " and ".join(map(repr, directionless_loads(self.manifold, place)))
        return (
            f"the ends of {names} meet, where a force that does not vanish has no direction: no "
            "forces balance"
        )

    def doubts(self, free: int) -> list[Doubt]:
        """Why equilibria may be missing."""
        search, found = self.search, []
        if free > FEW:
            leaders = tuple(motion.leader for motion in self.motions_of(search.found[0].place))
            words = (
                f"{free} free motions: sought from a fixed spread of starts, and by turning over "
                "one leader after the other; further rest positions may be missed; begin near "
                "them with starts"
            )
            found.append(Doubt("incomplete", words, elements=leaders))
        for position in search.found:
            place = position.place
            if place.undetermined > tol.EQUILIBRIUM_BALANCED_GIVEN * position.top:
                where, leader = self.where(place)
                message = (
                    f"at {where} the mechanism is in a singular position but for rounding, and its "
                    "loads act along what is free there: neither the reactions nor the stiffness "
                    "of this rest position are determined"
                )
                found.append(Doubt("residual", message, elements=(leader,)))
        why = [("unsure", place) for place in search.unsure]
        why += [pair for pair in search.ends if pair[0] in MISSING]
        why += [("alternate", place) for place in search.odd]
        for word, place in why:
            where, leader = self.where(place)
            reason, loads = self.reason(place) if word == "unsure" else ("", [])
            message = MISSING[word].format(where, reason)
            if all(message != doubt.message for doubt in found):
                found.append(Doubt("incomplete", message, elements=(leader, *loads)))
        return found

    def reason(self, place: Place) -> tuple[str, list[str]]:
        """Why no number of equilibria is certain near a place, and the loads that are at it."""
        loads = jumping_loads(self.manifold, place)
        if loads:
            forces = "the force of {} jumps" if len(loads) == 1 else "the forces of {} jump"
            return f", as {forces.format(' and '.join(map(repr, loads)))} there", loads
        if without_stiffness(self.manifold, place):
            return ", as nothing drives it back there to first order", []
        return "", []

    def motions_of(self, place: Place) -> tuple[FreeMotion, ...]:
        """The free motions at a place, with their leaders."""
        return free_motions(self.system, np.append(place.q, np.zeros(3)), place.motions)

    def where(self, place: Place, lead: FreeMotion | None = None) -> tuple[str, str]:
        """A place in words, by what a leader does, and that leader."""
        lead = self.motions_of(place)[0] if lead is None else lead
        b = self.system.bodies[lead.leader]
        pose = np.round(place.q[3 * b : 3 * b + 3] / self.manifold.scale[:3], 2) + 0.0
        if lead.turns:
            return f"{math.degrees(pose[2]):.0f} deg of '{lead.leader}'", lead.leader
        x, y = self.system.length * pose[:2]
        return f"({x:.3g}, {y:.3g}) {self.mechanism.units.length} of '{lead.leader}'", lead.leader

    def nothing(self) -> SolveError:
        """The sentence where no equilibrium was found."""
        name, units = self.mechanism.name, self.mechanism.units
        search = self.search
        away, least = search.ran_away, search.least
        if away is not None:
            displacements = (away.q / self.manifold.scale).reshape(-1, 3)[:, :2]
            body = self.mechanism.bodies[int(np.abs(displacements).max(axis=1).argmax())].name
            return SolveError(
                f"no rest position of '{name}': its loads drive '{body}' away without end; hold "
                "it, by a spring or a stop, or drive it",
                body,
            )
        if search.jumps:
            where, body = self.where(search.jumps[0])
            return SolveError(
                f"no rest position of '{name}': its loads drive it from both sides to {where}, "
                "where a distance is zero or a load jumps, so that no forces balance; put a stop "
                "there, or change its loads",
                body,
            )
        if search.lifts:
            where, body = self.where(search.lifts[0])
            return SolveError(
                f"no rest position of '{name}' was met: at {where} "
                f"{self.meeting(search.lifts[0])}; begin beside it with starts",
                body,
            )
        assert least is not None
        motions = self.motions_of(least)
        rates = [rates_of(self.system, [one]).reshape(-1) / self.manifold.scale for one in motions]
        left = [float(least.force @ way) for way in rates]
        # the leader that is driven most; a least residual force is flat: more digits would be noise
        n = int(np.argmax(np.abs(left)))
        where, leader = self.where(least, motions[n])
        unit = units.of("torque") if motions[n].turns else units.of("force")
        return SolveError(
            f"no rest position of '{name}' was met: what drives it is least at {where}, where "
            f"{abs(left[n]):.3g} {unit} are left; begin elsewhere with starts, or change its loads",
            leader,
        )


# -- Speed from which a rotating field moves a mechanism out of a stable position --------------


def lifting(manifold: Manifold, position: EquilibriumPosition) -> list[str]:
    """Sentences of fields that leave a stable position where it would be without them.

    There K(ω) = K₀ + ω² K₁; the position is left where the least root ω² of det K(ω) = 0 is passed.
    """
    system, found = manifold.system, []
    time = system.mechanism.units.time
    for load in system.mechanism.loads:
        if not load.quadratic_in:
            continue
        name = f"{load.name}.{load.quadratic_in}"
        speed = abs(float(system.values[name]))
        used = speed or 1.0
        still, rotating = (
            manifold.other(system.with_values({name: value})) for value in (0.0, used)
        )
        one, other = still.place(position.place.q), rotating.place(position.place.q)
        if one is None or other is None or len(one.motions) != len(position.place.motions):
            continue
        top = max(position.top, rotating.largest(position.place.q))
        if max(one.size, other.size) > 10.0 * tol.EQUILIBRIUM_BALANCED * top:
            continue
        before, field = still.stiffness(one), rotating.stiffness(other)
        if np.linalg.matrix_rank(before) < len(before):
            continue  # the field alone keeps it there
        roots = np.linalg.eigvals(np.linalg.solve(before, before - field))
        real = roots.real[np.abs(roots.imag) <= tol.ROOT_REAL * np.abs(roots).max(initial=0.0)]
        most = float(real.max(initial=0.0))
        if most <= tol.EQUILIBRIUM_GROWTH_NONE:
            continue
        lifts = used / np.sqrt(most)
        if lifts <= speed:
            continue
        found.append(
            f"at {_in_words(speed, time)} '{load.name}' does not move it: it hangs as without the "
            f"field, and lifts above {_in_words(lifts, time)}"
        )
    return found


def _in_words(speed: float, time: str) -> str:
    text = f"{speed:.6g} rad/{time}"
    return f"{text} ({speed * 30.0 / np.pi:.6g} rpm)" if time == "s" else text


#: Free motions up to which equilibria are sought; 30 take some ten seconds, and of 60 a descent
#: no longer ends.
FREE = 40


@dataclass(frozen=True, eq=False)
class Equilibrium(Locked, Presented):
    """One equilibrium.

    `solution`: Statics there: the position, every joint force, the effort of drivers that hold.
    `stability`: ``"stable"``, ``"unstable"`` or ``"neutral"`` (no force to first order).
    `stiffness` (free, free): K = −∂f/∂q along the free motions, joint forces fixed: [torque/rad] or
      [force/length] by what the leaders do.
    `motions`: The free motions in whose rates it is given.
    `frequencies`: Natural frequencies [rad/time] of a stable position whose free motions all have
      inertia, damping left out; empty for others.
    `residual`: What drives it still, as a part of the greatest load, or of how fast the loads
      change.
    `notes`: Sentences.
    """

    solution: Solution
    stability: str
    stiffness: Array
    motions: tuple[FreeMotion, ...]
    frequencies: tuple[float, ...]
    residual: float
    notes: tuple[str, ...] = ()

    angle_unit = "deg"
    declared = (
        "stability stiffness motions frequencies residual notes",
        Value("statics", value="solution"),
    )

    def __getitem__(self, body: str) -> BodyHistory:
        return self.solution[body]

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint, as `Solution.reaction`."""
        return self.solution.reaction(joint, on)


@dataclass(frozen=True, eq=False)
class Equilibria(AtEquilibria[Equilibrium]):
    """The equilibria that were found, stable ones first; ``print`` shows them as a table.

    Attributes
    ----------
    positions : tuple of Equilibrium
        Stable ones first: those that need no friction.
    bands : tuple of EquilibriumBand
        Of one free motion with frictional joints: positions at which friction holds, from end to
        end, in the order of the equilibria in them.
    status : str
        ``"completed"``, or ``"doubtful: …"`` with the first doubt.
    doubts : tuple of Doubt
        Why some equilibria may be missing.
    notes : tuple of str
        Sentences, those of the doubts among them.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(mbody.Body("bob", mass=1.0, cg=(1.0, 0.0)), mbody.Revolute("O", "ground", "bob"))
    >>> swing.add(mbody.Gravity("gravity", y=-9.81))
    >>> [one.stability for one in mbody.equilibrium(swing)]
    ['stable', 'unstable']
    """

    bands: tuple[EquilibriumBand, ...] = ()

    analysis_name = "equilibrium"
    angle_unit = "deg"
    declared = (
        "t positions",
        Value("bands", value=lambda found: found.bands or ...),
    )

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """Those to which it comes back by itself."""
        return tuple(one for one in self.positions if one.stability == "stable")


@each_design
def equilibrium(
    model: Mechanism | System,
    *,
    free: str | Sequence[str] = (),
    starts: Guesses | Sequence[Guesses] = (),
    t: float = 0.0,
) -> Equilibria:
    """Equilibria of a mechanism with free motions, joint forces there, and their stability.

    Nᵀ f = 0 at a closed position, N spanning its free motions: springs, gravity, fields and other
    loads balance. Stable where the tangent stiffness −Nᵀ ∂(f − Φ_qᵀ λ)/∂q N is positive definite.

    Parameters
    ----------
    model : Mechanism or System
        With free motions; drivers, if there are any, hold what their laws say at t.
    free : str or sequence of str, optional
        Drivers that are released.
    starts : mapping or sequence of mappings, optional
        Further guesses to begin from: by body an angle [rad] or (x, y, angle) of the link axes.
    t : float
        Time at which the laws of drivers and loads are taken.

    Returns
    -------
    Equilibria
        Stable positions first, then the nearest to the start first; of a batch `DesignResults`, the
        equilibria of each design.

    Raises
    ------
    ModelError
        For drivers, starts or times that are none.
    SolveError
        When the loops do not close, nothing is free, or no equilibrium is found: with the least
        force that is left, and where.

    Notes
    -----
    A single free motion is walked all round, or both ways as far as it goes. Between neighbouring
    places the residual force is a cubic, by its values and derivatives, within an error that is
    measured; steps are divided until each has a certain number of zeros, so that all positions on
    the curve of the start are found, stable or not. Where distances in the constraints pass zero,
    as of a weight that is drawn through its pulley, the walk turns over with them. The surface of
    two free motions is covered with charts, which are divided until each cell has one zero or none;
    around points where the ends of a spring meet, and its force jumps, the charts are polar.
    Positions on other circuits of assembly are found from `starts` on them. Of more free motions,
    up to 40, the search goes from a fixed spread of starts, and from each position that it finds on
    by turning over one leader after the other; it may miss some. Its cost grows by the cube of
    their number, and 30 take ten seconds. What may be missing is reported by `doubts` of kind
    "incomplete".

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> for one in equilibrium(machine):
    ...     print(one.stability, round(float(np.degrees(one["rod"].angle[0]))))
    stable -90
    unstable 90
    """
    system = released(as_system(model), free)
    time = single_time("equilibrium", system, t)
    chosen = with_closed_contacts(system, time, {}, free=1)
    _, *others = guesses(starts)
    found = search(chosen.system, [chosen.guess, *others], time)
    found.notes = [*chosen.notes, *found.notes]
    return found.equilibria()


def guesses(starts: Any) -> list[Guesses | None]:
    """The guesses to begin from, the description's own first."""
    given = [starts] if isinstance(starts, Mapping) else starts
    if not isinstance(given, (list, tuple)) or not all(isinstance(g, Mapping) for g in given):
        raise ModelError(
            f'starts must be guesses such as [{{"crank": 0.3}}, {{"crank": 2.0}}], not {starts!r}'
        )
    return [None, *given]


def search(system: System, starts: Sequence[Guesses | None], t: float) -> _EquilibriumResults:
    """Look for equilibria from some guesses."""
    found, notes = None, []
    for guess in starts:
        start = closed(system, t, {}, guess)
        notes += [note for note in start.notes if note not in notes]
        if too_large(system):
            raise SolveError(
                f"equilibrium of '{system.mechanism.name}': {system.rows} rows of "
                f"{system.coordinates} coordinates are too many, it takes up to {DENSE} rows"
            )
        manifold = Manifold(system, start.work, t, weighted=True)
        here = manifold.place(start.work.q[: system.coordinates, 0].copy())
        if here is None:
            # a load without a value: statics says which, and why
            Runner(system, "statics").scalar(start, by_time(system, np.array([t])))
        assert here is not None
        if not len(here.motions):
            names = [driver.name for driver in system.drivers]
            how = remedy(python=f"free={names[:1]}", command=f"--free {names[0] if names else ''}")
            or_else = f", or release a driver, {how}" if names else ""
            raise SolveError(
                f"nothing is free in '{system.mechanism.name}': joints and drivers fix every body; "
                f"use statics{or_else}"
            )
        if len(here.motions) > FREE:
            raise SolveError(
                f"equilibrium of '{system.mechanism.name}': {len(here.motions)} free motions are "
                f"too many for its search, it takes up to {FREE}: hold some of them by drivers"
            )
        if found is None:
            reserve: Reserve
            if friction_of_contacts_alone(system):
                reserve = ContactReserve(manifold)
            else:
                reserve = FrictionReserve(manifold, start.regularization)
            found = _EquilibriumResults(system, t, EquilibriumSearch(manifold), reserve)
        found.search.around(here)
    assert found is not None
    machine, own = system.mechanism, system.first_states[:, 0]
    values = {one.name: float(z) for one, z in zip(machine.states, own, strict=True)}
    notes = [*system.notes, *notes, *left_out(machine, "equilibrium")]
    notes += without_friction(machine, "equilibrium")
    found.notes = [*notes, *kept_states(machine, values, "equilibrium")]
    return found


class _EquilibriumResults:
    """Makes results of what a search found."""

    def __init__(
        self, system: System, t: float, search: EquilibriumSearch, reserve: Reserve
    ) -> None:
        self.system, self.t, self.search, self.reserve = system, t, search, reserve
        self.mechanism, self.manifold = system.mechanism, search.manifold
        self.notes: list[str] = []

    def equilibria(self) -> Equilibria:
        """All equilibria."""
        positions, words = self.search.found, Words(self.system, self.search)
        own = self._bands()
        if not positions and not own:
            raise words.nothing()
        pairs = [(self.one(position), position) for position in positions]
        order = {"stable": 0, "neutral": 1, "unstable": 2}
        pairs.sort(key=lambda pair: order[pair[0].stability])
        found = [one for one, _ in pairs]
        free = max((len(one.motions) for one in found), default=1)
        places = [position.place for _, position in pairs]
        bands = tuple(
            sorted(
                (self._band(band, own, places) for band in own),
                key=lambda band: band.positions or (len(found),),
            )
        )
        self.notes += [note for note in words.facts() if note not in self.notes]
        if self.search.walks:
            left = without_friction(self.mechanism, "equilibrium")
            self.notes = [note for note in self.notes if note not in left]
        self.notes += holding_sentences(self.mechanism, bands, bool(self.reserve))
        every = Equilibria(
            self.mechanism.name,
            self.mechanism.units,
            self.t,
            tuple(found),
            notes=tuple(self.notes),
            bands=bands,
        )
        return doubted(every, words.doubts(free))

    def _bands(self) -> list[Band]:
        """The bands of single free motions in which friction holds."""
        curves = {id(curve): curve for curve, _ in self.search.walks} if self.reserve else {}
        found = []
        for key, curve in curves.items():
            walks = [walk for one, walk in self.search.walks if id(one) == key]
            found += bands_of(curve, walks, self.reserve)
        return found

    def _band(self, band: Band, every: list[Band], places: list[Place]) -> EquilibriumBand:
        """A band in the poses of its ends; the numbers of the equilibria in it."""
        numbers = tuple(
            n
            for n, place in enumerate(places)
            if self.reserve.at(place) > tol.STIFFNESS_ZERO * self.manifold.scale_of(place)
            and min(every, key=lambda one: self._distance(one, place)) is band
        )
        inside = band.inside[0]
        motion = free_motions(
            self.system, np.append(inside.place.q, np.zeros(3)), inside.place.motions
        )[0]
        b = 3 * self.system.bodies[motion.leader]
        directions = inside.along[b + 2 : b + 3] if motion.turns else inside.along[b : b + 2]
        ends = [
            None if node is None else self._pose(node.place) for node in (band.first, band.last)
        ]
        if directions[np.abs(directions).argmax()] < 0.0:
            ends.reverse()
        return EquilibriumBand(ends[0], ends[1], motion.leader, numbers)

    def _distance(self, band: Band, place: Place) -> float:
        """Distance of a place from what is known of a band."""
        return min(self.manifold.distance(node.place.q, place.q) for node in band.inside)

    def _pose(self, place: Place) -> dict[str, tuple[float, float, float]]:
        """Link axes of every body."""
        return link_poses(self._statics(place))

    def _statics(self, place: Place) -> Solution:
        """Statics of a place that is balanced already, as a part of the greatest load: their sums
        may vanish.
        """
        start = closed(self.system, self.t, {}, None, pose=np.append(place.q, np.zeros(3)))
        instant = by_time(self.system, np.array([self.t]))
        runner = Runner(self.system, "statics", unbalanced=np.inf)
        record = Record([runner.scalar(start, instant)], 1, batch=False)
        return runner.solution(start, instant, record)

    def one(self, position: EquilibriumPosition) -> Equilibrium:
        """One equilibrium with its forces and its stiffness."""
        place, system = position.place, self.system
        motions = free_motions(system, np.append(place.q, np.zeros(3)), place.motions)
        word, frequencies, notes = stability_of(position, self.manifold.mass(place.motions))
        if position.row:
            notes.append("one of a row of rest positions: nothing drives it back along them")
        if position.singular:
            notes.append(
                "singular position: more is free here, to first order, than nearby; branches of "
                "the motion meet"
            )
        if word == "stable":
            notes += lifting(self.manifold, position)
        solution = with_admissible_forces(self._statics(place))
        notes += pulled(solution)
        return Equilibrium(
            solution=solution,
            stability=word,
            stiffness=self.in_leaders(place, motions, position.stiffness),
            motions=motions,
            frequencies=frequencies,
            residual=place.size / position.top if position.top else 0.0,
            notes=tuple(notes),
        )

    def in_leaders(self, place: Place, motions: Sequence[FreeMotion], K: Array) -> Array:
        """The stiffness for unit rates of the leaders."""
        rates = rates_of(self.system, motions).reshape(len(motions), -1)
        basis = rates / self.manifold.scale @ place.motions.T
        own = self.manifold.weight[[self.system.bodies[motion.leader] for motion in motions]]
        return np.asarray(basis @ K @ basis.T) / own[:, None]


def stability_of(
    position: EquilibriumPosition, mass: Array
) -> tuple[str, tuple[float, ...], list[str]]:
    """Word, natural frequencies and sentences of an equilibrium.

    A symmetric stiffness is judged by its eigenvalues. One that is not, as of loads that follow a
    body, is judged by those of M⁻¹K, which show flutter too; where a free motion has no inertia,
    by its own.
    """
    K = position.stiffness
    zero = tol.STIFFNESS_ZERO * max(float(np.abs(K).max(initial=0.0)), position.top)
    inert = massive(mass)
    if np.abs(K - K.T).max() <= tol.STIFFNESS_SYMMETRIC * float(np.abs(K).max()) + zero:
        sizes = np.linalg.eigvalsh(0.5 * (K + K.T))
        word = "neutral"
        if sizes.min() < -zero:
            word = "unstable"
        elif sizes.min() > zero:
            word = "stable"
        if word != "stable" or not inert:
            return word, (), []
        squares = np.linalg.eigvals(np.linalg.solve(mass, 0.5 * (K + K.T))).real
        return word, tuple(np.sqrt(np.sort(squares)).tolist()), []
    note = "its stiffness is not symmetric: the loads have no potential"
    roots = np.linalg.eigvals(np.linalg.solve(mass, K) if inert else K)
    top = float(np.abs(roots).max())
    if (np.abs(roots.imag) > tol.STIFFNESS_SYMMETRIC * top).any() and inert:
        return "unstable", (), [f"{note}, and it flutters"]
    if not inert:
        note += "; a free motion has no inertia, so that only divergence is looked for, no flutter"
    if roots.real.min() < -tol.STIFFNESS_SYMMETRIC * top:
        return "unstable", (), [note]
    if roots.real.min() <= tol.STIFFNESS_SYMMETRIC * top:
        return "neutral", (), [note]
    frequencies = tuple(np.sqrt(np.sort(roots.real)).tolist()) if inert else ()
    return "stable", frequencies, [note]
