"""The analysis `mobility`: how many ways a mechanism can move, which, and what holds it twice."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.analysis.driven.time_grid import time_grid
from mbody.analysis.position.assembly_analysis import as_system, closed, each_design
from mbody.analysis.position.closed_position import ClosedPosition, place
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.core.tolerances import AXIS_DIRECTION, PARTICIPATION_INDEPENDENT, RATE_NONE_MOTION
from mbody.errors import ModelError
from mbody.kernels.layout import Work
from mbody.model.body import Guesses
from mbody.model.contact import Contact, Rope
from mbody.model.element import listed
from mbody.model.joint_limits import JointLimit, contacts_of
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import left_out
from mbody.model.stop import Freewheel, Stop
from mbody.quantities.formula import PlainNumbers
from mbody.quantities.units import UnitSystem
from mbody.system.assembler import assemble
from mbody.system.rank import (
    LargeRank,
    Rank,
    close_rows,
    dense,
    large_rank,
    rank_of,
    ranks_of,
    row_elements,
    sparse_rows,
)
from mbody.system.system import System, with_numbers_of

# -- Free motions in words: a readable basis of what constraints leave open, and a sentence of
#    each --------------------------------------------------------------------------------------
#
# Every motion of the basis has a leader, a body near the ground that turns (or slides) at unit rate
# while the leaders of all others stand still.

Array = np.ndarray

#: Bodies that a sentence names.
NAMED = 5
#: Motions that are put into words together.
AT_ONCE = 64
#: Multiplications of a product of matrices that stays on one thread of OpenBLAS: on a machine that
#: others use, waking a second one took twenty times as long as the product.
ONE_THREAD = 250_000


@dataclass(frozen=True, eq=False)
class FreeMotion(Presented):
    """One free motion: how the bodies move when its leader turns or slides at unit rate.

    `leader`: The body whose rate is one: 1 rad/time, or 1 length/time where it does not turn.
    `words`: The motion as a sentence.
    `rates`: (vx, vy, ω) of the mass centre of every moving body [length/time, rad/time].
    """

    leader: str
    words: str
    rates: dict[str, tuple[float, float, float]]

    @property
    def turns(self) -> bool:
        """Whether its leader turns; else it slides at unit rate."""
        return abs(self.rates[self.leader][2]) > 0.5


def rates_of(system: System, motions: Sequence[FreeMotion]) -> Array:
    """(vx, vy, ω) of every body for unit rates of the leaders: (free, bodies, 3)."""
    found = np.zeros((len(motions), system.layout.bodies, 3))
    for n, motion in enumerate(motions):
        for body, rate in motion.rates.items():
            found[n, system.bodies[body]] = rate
    return found


def leading(system: System, motions: Sequence[FreeMotion], directions: Array) -> Array:
    """Rates of leading bodies as parts of the dimensionless coordinates, (free, coordinates)."""
    parts = np.zeros_like(directions)
    for n, motion in enumerate(motions):
        first = 3 * system.bodies[motion.leader]
        rotates = motion.turns
        own = slice(first + 2, first + 3) if rotates else slice(first, first + 2)
        parts[n, own] = directions[n, own]
    return np.asarray(np.linalg.solve(parts @ directions.T, parts))


def components(mechanism: Mechanism) -> list[list[str]]:
    """Bodies that joints and couplings hold together, the ground and its part first; of each part
    those nearest to its first body first.
    """
    neighbours: dict[str, set[str]] = {"ground": set()}
    neighbours |= {body.name: set() for body in mechanism.bodies}
    for joint in mechanism.joints:
        neighbours[joint.i.body].add(joint.j.body)
        neighbours[joint.j.body].add(joint.i.body)
    for coupling in mechanism.couplings:
        for name in coupling.bodies:
            neighbours[name] |= set(coupling.bodies) - {name}
    place = {name: n for n, name in enumerate(neighbours)}
    found: list[list[str]] = []
    seen: set[str] = set()
    for first in neighbours:
        level = [] if first in seen else [first]
        if level:
            found.append([])
        while level:
            found[-1] += level
            seen.update(level)
            adjacent = set().union(*(neighbours[name] for name in level)) - seen
            level = sorted(adjacent, key=place.__getitem__)
    return found


def leading_order(system: System) -> list[str]:
    """Bodies in the order in which they lead: what is driven, then what is near the ground."""
    names = [name for part in components(system.mechanism) for name in part if name != "ground"]
    driven = {body for driver in system.drivers for body in driver.bodies[1:]}
    return sorted(names, key=lambda name: name not in driven)


class FreeMotions(Sequence[FreeMotion]):
    """Free motions of a large system: each is put into words when it is read. `q` (coordinates +
    3,); `rates` (motions, coordinates), lengths by the model length.
    """

    def __init__(
        self,
        system: System,
        q: Array,
        leaders: Sequence[str],
        rates: Callable[[Sequence[int]], Array],
    ) -> None:
        self._system, self._q, self._leaders, self._rates = system, q, leaders, rates

    def __len__(self) -> int:
        return len(self._leaders)

    # typing's overload would be taken for the compiler's
    def __getitem__(self, n: Any) -> Any:
        numbers = range(len(self))[n]
        if isinstance(numbers, int):
            return self._worded([numbers])[0]
        return self._worded(numbers)

    def __iter__(self) -> Iterator[FreeMotion]:
        for first in range(0, len(self), AT_ONCE):
            yield from self[first : first + AT_ONCE]

    def _worded(self, numbers: Sequence[int]) -> tuple[FreeMotion, ...]:
        leaders = [self._leaders[n] for n in numbers]
        return _worded(self._system, self._q, self._rates(numbers), leaders) if numbers else ()


def free_motions(system: System, q: Array, motions: Array) -> tuple[FreeMotion, ...]:
    """A readable basis of free motions. `q` (coordinates + 3,), `motions` (free, coordinates),
    lengths by those of the parts.
    """
    return _worded(system, q, *_echelon(system, motions, leading_order(system)))


def _worded(
    system: System, q: Array, basis: Array, leaders: Sequence[str]
) -> tuple[FreeMotion, ...]:
    """Motions with words; the basis (motions, coordinates) with lengths by those of the parts."""
    scale = system.coordinate_units.reshape(-1, 3)
    neighbours, found = _JointGraph(system), []
    for row, leader in zip(basis, leaders, strict=True):
        rates = row.reshape(-1, 3) * scale
        own = rates[system.bodies[leader]]
        rotates = abs(row[3 * system.bodies[leader] + 2]) >= RATE_NONE_MOTION
        unit = own[2] if rotates else np.hypot(own[0], own[1])
        found.append(_Words(system, q, neighbours, rates / unit, leader).motion())
    return tuple(found)


def _echelon(system: System, motions: Array, order: Sequence[str]) -> tuple[Array, list[str]]:
    """Reduced rows: each has one coordinate that all others lack, of a body as early in the order
    as can be, of it the angle first; and the bodies that lead.
    """
    basis, left = motions.copy(), np.arange(len(motions))
    found: list[tuple[int, str]] = []
    columns = [3 * system.bodies[name] + k for name in order for k in (2, 0, 1)]
    names = [name for name in order for _ in range(3)]
    top = np.abs(basis).max(axis=1)
    # a row has its greatest number somewhere, so that every pass finds a leader or more
    while left.size:
        for name, c in zip(names, columns, strict=True):
            if not left.size:
                break
            part = np.abs(basis[left, c]) / top[left]
            if part.max(initial=0.0) < PARTICIPATION_INDEPENDENT:
                continue
            n = int(left[part.argmax()])
            basis[n] /= basis[n, c]
            others = np.arange(len(basis)) != n
            basis[others] -= np.outer(basis[others, c], basis[n])
            left = left[left != n]
            top[left] = np.abs(basis[left]).max(axis=1)
            found.append((n, name))
    place = {name: n for n, name in enumerate(order)}
    found.sort(key=lambda pair: place[pair[1]])
    return basis[[n for n, _ in found]], [name for _, name in found]


def panel_echelon(system: System, motions: Array, order: Sequence[str]) -> tuple[Array, list[str]]:
    """Reduced rows and their leaders, as of a few motions, of many, of which each has a coordinate
    1 that is 0 in all others: these coordinates say how large a motion is, and other columns are
    reduced some at a time.
    """
    free, left = len(motions), np.arange(len(motions))
    columns = np.array([3 * system.bodies[name] + k for name in order for k in (2, 0, 1)])
    T, top, wide = np.eye(free), np.ones(free), max(3, ONE_THREAD // max(free**2, 1))
    found: list[tuple[int, int]] = []
    while left.size:
        for first in range(0, len(columns), wide):
            own = columns[first : first + wide]
            work, at = np.hstack([T, T @ motions[:, own]]), 0
            while left.size:
                part = np.abs(work[left, free + at :]) / top[left, None]
                large = np.flatnonzero(part.max(axis=0, initial=0.0) >= PARTICIPATION_INDEPENDENT)
                if not large.size:
                    break
                n, at = int(left[part[:, large[0]].argmax()]), at + int(large[0])
                work[n] /= work[n, free + at]
                others = np.arange(free) != n
                work[others] -= np.outer(work[others, free + at], work[n])
                left = left[left != n]
                top[left] = np.abs(work[left, :free]).max(axis=1)
                found.append((first + at, n))
            T = work[:, :free].copy()
            if not left.size:
                break
    found.sort()
    rows = [n for _, n in found]
    return T[rows] @ motions, [order[column // 3] for column, _ in found]


class _JointGraph:
    """The joints of every body."""

    def __init__(self, system: System) -> None:
        machine = system.mechanism
        self.names = [body.name for body in machine.bodies]
        self.joints: dict[str, list[Joint]] = {name: [] for name in self.names}
        for joint in machine.joints:
            for name in {joint.i.body, joint.j.body} - {"ground"}:
                self.joints[name].append(joint)
        self._free = np.array([not own for own in self.joints.values()], dtype=bool)
        slides = [(joint.i.body, joint.j.body) for joint in machine.joints if joint.slide]
        number = system.bodies
        self._slides = [(number[i], number[j]) for i, j in slides]

    def guided(self, moving: Array) -> Array:
        """Which bodies slide on one that does not move, or have no joints: (bodies,) of bool."""
        found, moves = self._free.copy(), np.append(moving, False)
        for i, j in self._slides:
            for own, other in ((i, j), (j, i)):
                if own < len(found) and not moves[other]:
                    found[own] = True
        return found


class _Words:
    """Finds the words for one motion; rates (bodies, 3) with their units."""

    def __init__(
        self, system: System, q: Array, neighbours: _JointGraph, rates: Array, leader: str
    ) -> None:
        self.system, self.q, self.neighbours, self.leader = system, q, neighbours, leader
        size = np.abs(rates / system.coordinate_units.reshape(-1, 3)).max(axis=1)
        self.small = RATE_NONE_MOTION * float(size.max())
        self.rates, self.names = rates, neighbours.names
        moving = size > self.small
        guided = neighbours.guided(moving)
        # the leader first
        first = system.bodies[leader]
        order = np.flatnonzero(moving)
        order = np.concatenate([order[order == first], order[order != first]])
        rotates = np.abs(rates[order, 2]) > self.small
        self.order, self.rotating, self.gliding = order, order[rotates], order[~rotates]
        self.guided = guided
        self.units = system.mechanism.units

    def motion(self) -> FreeMotion:
        """The sentence: what turns, then what moves without rotation; the leader first."""
        parts = [self._rotates(self._named(self.rotating))] if len(self.rotating) else []
        together = self._together()
        glides = [self._glides(bodies) for bodies in together[:NAMED]]
        if len(together) > NAMED:
            glides.append(f"{len(together) - NAMED} groups more move without turning")
        leads = len(self.rotating) > 0 and self.names[self.rotating[0]] == self.leader
        parts = [*parts, *glides] if leads else [*glides, *parts]
        values = zip(*self.rates[self.order].T.tolist(), strict=True)
        rates = dict(zip(self._named(self.order), values, strict=True))
        return FreeMotion(self.leader, "; ".join(parts), rates)

    def _named(self, bodies: Array) -> list[str]:
        return [self.names[b] for b in bodies.tolist()]

    def _together(self) -> list[Array]:
        """Bodies that do not turn, those with one velocity together."""
        found: list[Array] = []
        left = self.gliding
        velocity, guided = self.rates[left, :2], self.guided[left]
        while left.size:
            least = self.small * self.system.lengths[left]
            alike = np.abs(velocity - velocity[0]).max(axis=1) < least
            alike &= guided == guided[0]
            alike[0] = True
            found.append(left[alike])
            left, velocity, guided = left[~alike], velocity[~alike], guided[~alike]
        return found

    def _rotates(self, names: list[str]) -> str:
        """Such as "crank turns about O2, rocker follows (crank 1 : rocker -0.2 rad/s)"."""
        ratios = [f"{name} {_number(self._rate(name)[2])}" for name in names[:NAMED]]
        text = " : ".join(ratios) + (" …" if len(names) > NAMED else "")
        first, *others = names
        if first != self.leader:
            words = f"{_listed(names)} {'turns' if not others else 'turn'}"
        else:
            words = f"{first} turns about {self._centre(first)}"
            if others:
                words += f", {_listed(others)} {'follows' if len(others) == 1 else 'follow'}"
        if not others:
            text = _number(self._rate(first)[2])
        return f"{words} ({text} rad/{self.units.time})"

    def _rate(self, name: str) -> Array:
        return np.asarray(self.rates[self.system.bodies[name]])

    def _centre(self, name: str) -> str:
        """A pin that does not move, else where the instantaneous centre is."""
        x, y = self.q[3 * self.system.bodies[name] :][:2]
        vx, vy, w = self._rate(name)
        neighbours = self.neighbours.joints[name]
        tolerance = RATE_NONE_MOTION * self.system.lengths[self.system.bodies[name]] * 10.0
        for joint in neighbours:
            side = "i" if joint.i.body == name else "j"
            px, py = place(self.system, self.q, joint, side)
            speed = np.hypot(vx - w * (py - y), vy + w * (px - x))
            if joint.pin and speed < tolerance * abs(w):
                return joint.name
        where = f"({_number(x - vy / w)}, {_number(y + vx / w)})"
        if np.hypot(vx, vy) < tolerance * abs(w):
            where = f"its mass centre {where}"
        return f"{where} at this instant" if neighbours else where

    def _glides(self, bodies: Array) -> str:
        """Along which direction bodies move that do not turn."""
        names = self._named(bodies)
        vx, vy, _ = self.rates[bodies[0]]
        angle = float(np.degrees(np.arctan2(vy, vx))) % 180.0
        speed = float(np.hypot(vx, vy))
        along, sign = f"{angle:.4g}°", np.sign(vy)
        if min(angle, 180.0 - angle) < AXIS_DIRECTION:
            along, sign = "x", np.sign(vx)
        elif abs(angle - 90.0) < AXIS_DIRECTION:
            along = "y"
        rate = f"{_number(sign * speed)} {self.units.of('velocity')}"
        s = "s" if len(names) == 1 else ""
        if self.guided[bodies[0]]:
            return f"{_listed(names)} slide{s} along {along} ({rate})"
        return f"{_listed(names)} move{s} along {along} without turning ({rate})"


def _number(value: Any) -> str:
    return f"{round(float(value), 9) + 0.0:.4g}"


def _listed(names: list[str]) -> str:
    """Names as in "coupler and rocker"; of many the first."""
    if len(names) > NAMED:
        return f"{', '.join(names[: NAMED - 1])} and {len(names) - NAMED + 1} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


# -- Preparation of analyses of free motions: released drivers, one time -----------


def released(system: System, free: str | Sequence[str]) -> System:
    """The system without some of its drivers, with the same numbers."""
    names = tuple(free) if isinstance(free, (list, tuple, set)) else (free,)
    if not names:
        return system
    return with_numbers_of(assemble(system.mechanism.without(*names)), system.values)


def single_time(analysis: str, system: System, t: PlainNumbers) -> float:
    """The one time of an analysis."""
    times = time_grid(system, t, None, None, None).t
    if len(times) != 1:
        raise ModelError(f"{analysis} takes one time, not {len(times)}")
    return float(times[0])


# -- One-sided constraints: contacts, ropes, stops, limits, joints that separate ---------------

#: The kinds that have classes, by the word that heads their names.
KINDS = {"contacts": Contact, "ropes": Rope, "stops": Stop, "freewheels": Freewheel}


def one_sided(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """The names of all that holds in one direction only, by kind: "contacts", "ropes", "stops",
    "freewheels", "limits" of joints by their ends, and "joints" that can separate or have play.
    Kinds of which there is none are left out.

    >>> from mbody import Body, Revolute
    >>> door = Mechanism("door", ground={"O": (0, 0)})
    >>> door.add(Body("leaf", points={"O": (0, 0)}))
    >>> door.add(Revolute("hinge", "ground.O", "leaf.O", limits=(0.0, 1.9)))
    >>> one_sided(door)
    {'limits': ('hinge_low', 'hinge_high')}
    """
    found = {
        kind: tuple(one.name for one in mechanism.contacts if isinstance(one, classes))
        for kind, classes in KINDS.items()
    }
    brought = [one for joint in mechanism.joints for one in contacts_of(joint)]
    found["limits"] = tuple(one.name for one in brought if isinstance(one, JointLimit))
    found["joints"] = tuple(joint.name for joint in mechanism.joints if joint.can_separate)
    return {kind: names for kind, names in found.items() if names}


#: Rows up to which matrices are dense and positions nearby are looked at.
LOOKED = 300
#: Numbers of all free motions up to which every one has its leader as near to the ground as can be.
LISTED = 20_000_000
#: Numbers of free motions that `data` lists, and motions that it always lists.
IN_DATA, FEWEST = 1_500_000, 12
#: Parts that are not joined to the ground up to which each has a note.
MOST_NOTES = 8
#: Step to a position nearby, in model lengths and radians, and how many are tried.
NEARBY, TRIES = 0.05, 6


@dataclass(frozen=True)
class Count:
    """Degrees of freedom by formula and by rank, of the joints alone or with the drivers fixed.

    `rows`: Scalar constraints.
    `gruebler`: 3·bodies − rows: what Grübler's formula counts.
    `rank`: Independent rows at the closed position.
    `rank_nearby`: The greatest rank at closed positions nearby; more than `rank` where this one is
      singular.
    `freedom`, `redundant`: Degrees of freedom and rows too many, here: freedom = gruebler +
      redundant.
    """

    rows: int
    gruebler: int
    rank: int
    rank_nearby: int | None

    declared = ("rows", "gruebler", "rank", "rank_nearby", "freedom", "redundant", "singular")

    @property
    def freedom(self) -> int:
        """Degrees of freedom by the rank."""
        return self.gruebler + self.rows - self.rank

    @property
    def redundant(self) -> int:
        """Rows beyond the independent ones."""
        return self.rows - self.rank

    @property
    def singular(self) -> bool:
        """Whether the rank is lower here than at positions nearby."""
        return self.rank_nearby not in (None, self.rank)


@dataclass(frozen=True, eq=False)
class Mobility(Presented):
    """Degrees of freedom, redundant constraints and free motions, as `mobility` found them;
    ``print`` shows them, `data` makes a plain dict.

    Attributes
    ----------
    mechanism : str
        Title.
    units : UnitSystem
        Of the rates.
    t : float
        Time at which the drivers were taken.
    bodies, joints, couplings, drivers, loops : int
        Moving links; independent loops, of joints, and of couplings between bodies that are joined
        without them.
    of_joints, driven : Count
        Without the drivers, and with the drivers fixed.
    redundant : dict
        By joint, where some can be spared: how many of its rows could be removed without setting
        anything free. Of several joints that share one dependency any one is meant, not all.
    motions, driven_motions : sequence of FreeMotion
        Free motions without the drivers and with the drivers fixed; of a large mechanism each is
        computed when it is read.
    one_sided : dict
        Names by kind of what holds in one direction only: "contacts", "ropes", "stops",
        "freewheels", "limits" of joints, counted as open; "joints" that can separate, counted as
        closed.
    notes : tuple of str
        Singular positions, loose parts and what was not computed, as sentences.

    Examples
    --------
    >>> import mbody
    >>> found = mbody.mobility(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> found.of_joints.freedom, found.driven.freedom, found.redundant
    (1, 0, {})
    """

    mechanism: str
    units: UnitSystem
    t: float
    bodies: int
    joints: int
    couplings: int
    drivers: int
    loops: int
    of_joints: Count
    driven: Count
    redundant: dict[str, int]
    motions: Sequence[FreeMotion] = field(repr=False)
    driven_motions: Sequence[FreeMotion] = field(repr=False)
    one_sided: dict[str, tuple[str, ...]] = field(default_factory=dict, repr=False)
    notes: tuple[str, ...] = ()

    analysis_name = "check"

    @property
    def declared(self) -> tuple[Any, ...]:
        """All that was counted, and the first of the free motions."""
        # a first answer does not print it
        from mbody.solution.declared_result import Value

        first = slice(_in_data(self.bodies))
        return (
            "t bodies joints couplings drivers loops of_joints driven",
            "redundant one_sided",
            Value("motions", value=lambda found: found.motions[first]),
            Value("driven_motions", value=lambda found: found.driven_motions[first]),
        )

    @property
    def freedom(self) -> int:
        """Degrees of freedom with the drivers fixed."""
        return self.driven.freedom


@each_design
def mobility(
    model: Mechanism | System, t: float = 0.0, *, guess: Guesses | None = None
) -> Mobility:
    """Degrees of freedom, redundant constraints and free motions: Grübler's count and the truth.

    Grübler: F = 3·bodies − rows. True at a closed position: F = 3·bodies − rank Φ_q.

    Parameters
    ----------
    model : Mechanism or System
        With or without drivers.
    t : float
        Time at which the laws of the drivers are taken.
    guess : mapping, optional
        By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes.

    Returns
    -------
    Mobility
        Counts without the drivers and with the drivers fixed, rows that can be spared by joint,
        free motions in words.

    Raises
    ------
    ModelError
        For a time or guess that is none, or a batch of designs.
    SolveError
        When the loops cannot close: with the smallest gap and where.

    Notes
    -----
    The rank is found by a singular value decomposition up to 300 rows, and there positions nearby
    distinguish a singular position from redundant constraints; beyond by orthogonal elimination,
    body by body, and free motions are put into words when they are read.

    Examples
    --------
    >>> import mbody
    >>> report = mobility(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> report.of_joints.freedom, report.freedom
    (1, 0)
    >>> report.motions[0].words.partition(" (")[0]
    'crank turns about O2, coupler and rocker follow'
    """
    system = as_system(model)
    time = single_time("mobility", system, t)
    return _Report(system, closed(system, time, {}, guess), time).mobility()


def _loose(parts: Sequence[Sequence[str]]) -> list[str]:
    """Sentences of parts that are not joined to the ground: of many one."""
    if len(parts) <= MOST_NOTES:
        return [f"not joined to the ground: {listed(part)}" for part in parts]
    return [
        f"{len(parts)} parts are not joined to the ground, those of "
        f"{listed(part[0] for part in parts)}: join a body of each to the ground, or to what is "
        "joined to it"
    ]


def _in_data(bodies: int) -> int:
    """Number of free motions that `data` lists."""
    return max(FEWEST, IN_DATA // (3 * max(bodies, 1)))


def _loops(mechanism: Mechanism) -> int:
    """Independent loops: one where a joint, or a coupling, joins nothing that was apart."""
    root: dict[str, str] = {}

    def part(name: str) -> str:
        while (above := root.get(name, name)) != name:
            root[name] = root.get(above, above)
            name = above
        return name

    found = 0
    pairs = [(joint.i.body, joint.j.body) for joint in mechanism.joints]
    for names in (*pairs, *(tuple(coupling.bodies) for coupling in mechanism.couplings)):
        first, *others = dict.fromkeys(part(name) for name in names)
        found += not others
        root.update(dict.fromkeys(others, first))
    return found


class _Report:
    """Puts the report of one closed position together."""

    def __init__(self, system: System, start: ClosedPosition, t: float) -> None:
        self.system, self.start, self.t = system, start, t
        self.mechanism = system.mechanism
        self.work: Work = start.work
        self.joint_rows = system.rows - len(system.drivers)
        self.notes = [*start.notes, *system.notes]
        self.notes += left_out(self.mechanism, "mobility")

    def mobility(self) -> Mobility:
        """Counts, ranks, motions and sentences."""
        mechanism = self.mechanism
        parts = components(mechanism)
        self.notes += _loose(parts[1:])
        joints, driven = self._ranks()
        nearby = self._nearby(joints, driven)
        of_joints = self._count(joints, nearby[0])
        with_drivers = self._count(driven, nearby[1])
        self._say_singular(of_joints, with_drivers)
        self._say_repeated(joints, driven, with_drivers)
        motions = self._motions(joints)
        most = _in_data(len(mechanism.bodies))
        if len(motions) > most:
            self.notes.append(
                f"data and --json list {most} of {len(motions)} free motions, those led by what is "
                "driven or nearest to the ground; report.motions[n] is any of them"
            )
        return Mobility(
            mechanism=mechanism.name,
            units=mechanism.units,
            t=self.t,
            bodies=len(mechanism.bodies),
            joints=len(mechanism.joints),
            couplings=len(mechanism.couplings),
            drivers=len(mechanism.drivers),
            loops=_loops(mechanism),
            of_joints=of_joints,
            driven=with_drivers,
            redundant=self._spared(joints),
            motions=motions,
            driven_motions=motions if driven is joints else self._motions(driven),
            one_sided=one_sided(mechanism),
            notes=tuple(self.notes),
        )

    def _ranks(self) -> tuple[Rank | LargeRank, Rank | LargeRank]:
        """Of the joints alone, and with the drivers."""
        if self.system.rows > LOOKED:
            parts, order = sparse_rows(self.system, self.work), leading_order(self.system)
            bodies = [self.system.bodies[name] for name in order]
            rows = [self.joint_rows, self.system.rows][: 1 + bool(self.system.drivers)]
            found = [
                large_rank(parts, count, bodies, tol.SINGULAR_VALUE_DEAD_CENTRE) for count in rows
            ]
            self._say_unclear(found[-1])
            return found[0], found[-1]
        G = dense(self.system, self.work)[1]
        joints = rank_of(G[: self.joint_rows], tol.SINGULAR_VALUE_DEAD_CENTRE)
        return joints, rank_of(G, tol.SINGULAR_VALUE_DEAD_CENTRE) if self.system.drivers else joints

    @staticmethod
    def _count(found: Rank | LargeRank, nearby: int | None) -> Count:
        return Count(found.rows, found.coordinates - found.rows, found.rank, nearby)

    def _motions(self, found: Rank | LargeRank) -> Sequence[FreeMotion]:
        q = self.work.q[:, 0]
        if isinstance(found, Rank):
            return free_motions(self.system, q, found.motions)
        names = [body.name for body in self.mechanism.bodies]
        if found.free * found.coordinates <= LISTED:
            order = leading_order(self.system)
            basis, leaders = panel_echelon(self.system, found.motions(), order)
            return FreeMotions(self.system, q.copy(), leaders, functools.partial(_rows_of, basis))
        leaders = [names[b] for b in found.leaders.tolist()]
        return FreeMotions(self.system, q.copy(), leaders, found.motions)

    def _spared(self, joints: Rank | LargeRank) -> dict[str, int]:
        """By joint, how many of its rows the others imply: its part in the dependencies."""
        elements = (*self.mechanism.joints, *self.mechanism.couplings)
        ends = np.searchsorted(row_elements(self.system), np.arange(len(elements) + 1))
        products = [np.zeros((b - a, b - a)) for a, b in pairwise(ends.tolist())]
        for part in _combinations(joints):
            for n in np.unique(np.searchsorted(ends, np.flatnonzero(part.any(axis=0)), "right")):
                own = part[:, ends[n - 1] : ends[n]]
                products[n - 1] += own.T @ own
        found = {}
        for element, product in zip(elements, products, strict=True):
            # singular values, squared
            count = (
                int((np.linalg.eigvalsh(product) > tol.PARTICIPATION_NONE**2).sum())
                if product.any()
                else 0
            )
            if count:
                found[element.name] = count
        return found

    # -- positions nearby ---------------------------------------------------------------------

    def _nearby(
        self, joints: Rank | LargeRank, driven: Rank | LargeRank
    ) -> tuple[int | None, int | None]:
        """The greatest ranks at closed positions nearby, to which the joints let it move."""
        best = joints.rank, driven.rank
        if not driven.redundant or not joints.free:
            return best  # no higher rank is possible, or there is no other position
        if isinstance(joints, LargeRank):
            return None, None
        system, count = self.system, self.joint_rows
        before, random = self.work.q.copy(), np.random.default_rng(0)
        here = before[: system.coordinates, 0] / system.coordinate_units
        steps = random.normal(size=(TRIES, joints.free)) @ joints.motions
        steps *= NEARBY / np.linalg.norm(steps, axis=1)[:, None]

        def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            phi, G = dense(system, self.work, x)
            return phi[:, :count], G[:, :count]

        # what is nearly dependent is left alone
        found = close_rows(rows, here + steps, zero=tol.LEAST_SQUARES_RANK_NEARBY)
        reached = found.good & (np.linalg.norm(found.x - here, axis=1) > 0.2 * NEARBY)
        G = dense(system, self.work, found.x[reached])[1]
        one, other = (ranks_of(G[:, :n], tol.SINGULAR_VALUE_DEAD_CENTRE) for n in (count, None))
        best = int(one.max(initial=best[0])), int(other.max(initial=best[1]))
        self.work.q[:] = before
        if not reached.any():
            self.notes.append(
                "the free motion is infinitesimal: the joints allow it to first order, but no "
                "position nearby; the structure is shaky"
            )
        return best

    # -- sentences ----------------------------------------------------------------------------

    def _say_singular(self, joints: Count, driven: Count) -> None:
        if joints.singular:
            self.notes.append(
                f"singular position, a change point: the rank of the joints is {joints.rank} here "
                f"and {joints.rank_nearby} nearby; branches of the motion meet"
            )
        elif driven.singular:
            names = listed(driver.name for driver in self.mechanism.drivers)
            self.notes.append(
                f"singular position, a dead centre: with the drivers fixed the rank is "
                f"{driven.rank} here and {driven.rank_nearby} nearby; {names} cannot drive it "
                "through here"
            )

    def _say_unclear(self, found: LargeRank) -> None:
        """A rank that depends on what counts as zero."""
        if found.basis.kept < tol.PIVOT_CLEAR * found.zero:
            self.notes.append(
                f"the position is nearly singular: the least pivot of the rows is "
                f"{found.basis.kept:.2g}, below {found.zero:.2g} it would count as zero"
            )

    def _say_repeated(
        self, joints: Rank | LargeRank, driven: Rank | LargeRank, count: Count
    ) -> None:
        """Name drivers that repeat what joints and other drivers impose."""
        if count.singular or driven.redundant == joints.redundant:
            return
        part = np.zeros(len(self.mechanism.drivers))
        for combinations in _combinations(driven):
            size = np.abs(combinations[:, self.joint_rows :]).max(axis=0, initial=0.0)
            part = np.maximum(part, size)
        pairs = zip(self.mechanism.drivers, part, strict=True)
        names = [driver.name for driver, size in pairs if size > tol.PARTICIPATION_NONE]
        surplus = driven.redundant - joints.redundant
        self.notes.append(
            f"drivers repeat each other or the joints ({listed(names)}): remove {surplus} of them"
        )


def _combinations(found: Rank | LargeRank) -> Iterable[np.ndarray]:
    """Combinations of rows that vanish, some at a time."""
    return (found.dependencies,) if isinstance(found, Rank) else found.dependencies()


def _rows_of(basis: np.ndarray, numbers: Sequence[int]) -> np.ndarray:
    return np.asarray(basis[list(numbers)])
