"""Friction results: losses, modes, ranges, uniqueness, jams, efficiency."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbody.core.tolerances import (
    FORCES_ADMISSIBLE,
    FRICTION_RESERVE_FORCE_MOST,
    LOAD_BALANCED,
    RATE_NONE_SLIDING,
    SINGULAR_VALUE_SHARED_FRICTION,
    TINY,
)
from mbody.errors import ModelError
from mbody.kernels.finished_instants import StoredMotion, forces_by_senses, impending_rates
from mbody.kernels.friction import CERTIFICATE, IMPENDING, REACHED_PART, SLIDING
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.linear_program import INCONSISTENT, OPTIMAL, UNBOUNDED
from mbody.model.element import listed
from mbody.model.stop import Stop
from mbody.solution import contact_forces
from mbody.solution.checks import loaded
from mbody.solution.doubts import Inherited
from mbody.solution.histories import Result, Unique, motion_at, reaction_torque
from mbody.solution.shared_forces import greatest, primitive_numbers
from mbody.system.rank import dense
from mbody.system.system import Locked, System, locked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mbody.solution.histories import Reaction


# -- Undetermined forces of contacts at rest, as linear programs -------------------------------
# Where contacts are closed and nothing slides, normal forces and friction may be any that balance
# all bodies, with λ_N ≥ 0 and |λ_T| ≤ μ_s λ_N. That is convex: the least and the greatest effort
# are those at which something is about to slip, or a contact to open, and where there are no such
# forces at all the position cannot be held.

Array = np.ndarray


def friction_of_contacts_alone(system: System) -> bool:
    """Whether all friction is of contacts that are closed for good."""
    frictional = [
        pair for pair in contact_forces.friction_pairs(system) if pair.loses and not pair.separable
    ]
    closed = {one.name for one in system.mechanism.contacts if one.closed}
    return bool(frictional) and all(pair.joint in closed for pair in frictional)


class ContactLimits:
    """Limits of the forces of closed contacts, equal at every position of a system of one design:
    multipliers of all rows, then friction of all closed contacts.

    `work`: With the numbers of the design.

    `least` (limits, forces): A line an inequality, each · forces ≥ 0: normal forces, then limits of
      friction.
    """

    def __init__(self, system: System, work: Work) -> None:
        self.system, self.work = system, work
        self.primitive, self.number, angle = system.row_table
        self.units = np.where(angle, 1.0, system.length)
        self.rows = len(self.primitive)
        self.pairs = [
            (f, pair)
            for f, pair in enumerate(contact_forces.friction_pairs(system))
            if pair.loses and not pair.separable
        ]
        self.least = np.array([*self._normals(), *self._limits()])

    def row(self, e: int) -> int:
        """The row of a primitive, the first of several."""
        return int(np.flatnonzero(self.primitive == e)[0])

    def _pressing(self, e: int, slip_sign: float) -> Array:
        """λ_N of the normal row of a primitive, by all forces."""
        found = np.zeros(self.rows + len(self.pairs))
        found[self.row(e)] = -slip_sign
        return found

    def _normals(self) -> list[Array]:
        at, found = self.system.numbers, list[Array]()
        for contact in self.system.mechanism.contacts:
            if contact.closed:
                own = self.system.primitives_of[contact.name]
                for candidate, e in zip(contact.candidates(at), own, strict=False):
                    found.append(self._pressing(e, candidate.sign))
        return found

    def _limits(self) -> list[Array]:
        L, found = self.system.layout, list[Array]()
        for n, (f, pair) in enumerate(self.pairs):
            e = int(np.flatnonzero(L.primitive_node == L.friction_node[f])[0])
            slip_sign = float(self.work.par[pair.parameter + 4, 0])
            most = float(self.work.par[pair.parameter + 1, 0]) * self._pressing(e, slip_sign)
            for sign in (1.0, -1.0):
                own = most.copy()
                own[self.rows + n] = sign
                found.append(own)
        return found

    def smooth(self) -> Array:
        """Which inequalities are limits of friction without any coefficient."""
        count = len(self.least) - 2 * len(self.pairs)
        mu = [self.work.par[pair.parameter + 1, 0] == 0.0 for _, pair in self.pairs]
        return np.array([False] * count + [flag for one in mu for flag in (one, one)])


class StickingContacts:
    """The forces of one position, without units of length: multipliers of all rows, then friction
    of all closed contacts. `load` (coordinates,).
    """

    def __init__(self, limits: ContactLimits, work: Work, load: Array) -> None:
        system = limits.system
        self.system, self.work, self.limits = system, work, limits
        L, scale = system.layout, system.coordinate_units
        G = dense(system, work)[1]
        block = work.block[:, 0].reshape(-1, 3)
        along = np.zeros((len(limits.pairs), system.coordinates + 3))
        for n, (_, pair) in enumerate(limits.pairs):
            node, e = 4 * L.written_node[pair.primitive], pair.primitive
            for side, body in ((0, L.primitive_i[e]), (2, L.primitive_j[e])):
                along[n, 3 * body : 3 * body + 3] += block[node + side]
        tangents = along[:, : system.coordinates] * scale / system.length
        self.balance = np.vstack([G, tangents]).T
        self.load = load * scale
        self.size = float(np.abs(self.load).max(initial=0.0)) or 1.0

    def extreme(self, driver: str, sign: float) -> Array | None:
        """The forces at which the effort of a driver is greatest (`sign` 1) or least (−1); None
        where nothing holds, infinite where there is no bound.
        """
        aim = np.zeros(self.balance.shape[1])
        # an effort is −λ
        aim[self.limits.row(self.system.primitives_of[driver][0])] = sign
        found, forces = self._greatest(-aim, self.limits.least)
        if found == UNBOUNDED:
            return np.full(len(aim), -sign * np.inf)
        return self.size * forces if found == OPTIMAL else None

    def reserve(self) -> float:
        """How much more every normal force and every limit of frictional contacts could take at
        least, as a part of the load: negative where nothing holds.
        """
        aim = np.append(np.zeros(self.balance.shape[1]), 1.0)
        lines = np.column_stack([self.limits.least, np.where(self.limits.smooth(), 0.0, -1.0)])
        found, forces = self._greatest(aim, lines)
        return float(forces[-1]) if found == OPTIMAL else -FRICTION_RESERVE_FORCE_MOST

    @functools.cached_property
    def _balanced(self) -> tuple[Array, Array] | None:
        """Forces that balance the load, as parts of it, and (forces, k) those that balance
        themselves; None where nothing balances it.
        """
        sizes = np.maximum(np.linalg.norm(self.balance, axis=0), TINY)
        u, parts, vt = np.linalg.svd(self.balance / sizes)
        rank = int((parts > SINGULAR_VALUE_SHARED_FRICTION).sum())
        load = self.load / self.size
        along = u.T @ load
        if np.abs(along[rank:]).max(initial=0.0) > LOAD_BALANCED:
            return None
        there = vt[:rank].T @ (along[:rank] / parts[:rank])
        return there / sizes, vt[rank:].T / sizes[:, None]

    def _greatest(self, aim: Array, lines: Array) -> tuple[int, Array]:
        """What was found, and the forces, as parts of the load, with the greatest aim · forces and
        lines · forces ≥ 0 in balance; what is among `aim` beside the forces is at most
        `FRICTION_RESERVE_FORCE_MOST`.
        """
        if self._balanced is None:
            return INCONSISTENT, np.zeros(len(aim))
        (there, free), more = self._balanced, len(aim) - self.balance.shape[1]
        there = np.append(there, np.zeros(more))
        moved = np.zeros((len(aim), free.shape[1] + more))
        moved[: len(free), : free.shape[1]] = free
        moved[len(free) :, free.shape[1] :] = np.eye(more)
        A = np.vstack([-lines @ moved, moved[len(free) :]])
        b = np.append(lines @ there, np.full(more, FRICTION_RESERVE_FORCE_MOST))
        # what is exceeded by rounding alone is not
        for room in (0.0, FORCES_ADMISSIBLE):
            found, x, _ = greatest(aim @ moved, A, b + room)
            if found != INCONSISTENT:
                break
        return found, there + moved @ x

    def table(self, forces: Array) -> Array:
        """Forces as numbers of all primitives, (PER_PRIMITIVE·primitives,), as results keep them;
        torques about the mass centres.
        """
        system, known = self.system, self.limits
        lam = np.zeros((len(system.owners), 2))
        lam[known.primitive, known.number] = forces[: known.rows] / known.units
        for (_, pair), force in zip(known.pairs, forces[known.rows :], strict=True):
            lam[pair.primitive, 0] = force / system.length
        return primitive_numbers(system.layout, self.work, lam).ravel()


# -- Friction forces at rest and in jams, for directions of sliding ----------------------------

#: Pairs at rest of which both directions are tried with all others; beyond, all of them together.
TOGETHER = 6
#: Jams that are examined, at most.
EXAMINED = 400


class FrictionForces(NamedTuple):
    """Forces of one choice of directions.

    `table` (instants, PER_PRIMITIVE·primitives): As `mbody.kernels.layout` keeps them.
    `reached` (instants,): Part of friction that was reached, less than 1 where the mechanism jams.
    """

    table: Array
    reached: Array


class Jam(NamedTuple):
    """A position at which a mechanism jams.

    `joint`: The one whose friction takes most of the power.
    `coefficient`: Of that joint's friction (of teeth without friction the part of power that they
      lose), from which on it jams there; those of all joints are changed by one factor.
    """

    t: float
    joint: str
    coefficient: float


def forces_with(
    solution: Result,
    slip_signs: Array,
    motion: StoredMotion,
    design: int = 0,
    *,
    at_rest: bool = True,
) -> FrictionForces:
    """Forces at the instants of a motion with these directions (instants, pairs)."""
    system = solution.system
    work = system.work(designs=design)
    output = np.empty((len(slip_signs), PER_PRIMITIVE * len(system.owners), 1))
    reached = np.empty((len(slip_signs), 2))
    forces_by_senses(
        system.runtime().replaced(slip_signs=IMPENDING if at_rest else SLIDING),
        work,
        motion,
        np.ascontiguousarray(slip_signs, dtype=float),
        output,
        reached,
    )
    return FrictionForces(output[:, :, 0], reached[:, 1])


def forces_at_rest(solution: Result, rates: Array, sticking: Array, design: int = 0) -> Array:
    """Forces by each choice of the directions in which pairs at rest may begin to slide: (choices,
    instants, PER_PRIMITIVE·primitives), NaN where no pair sticks or there are fewer choices. Forces
    that grow without bound, as they do where it jams in one direction, are infinite. `rates`
    (instants, pairs, PER_PAIR), `sticking` (instants, pairs).
    """
    instants = np.flatnonzero(sticking.any(axis=1))
    if not friction_of_contacts_alone(solution.system):
        return _by_slip_signs(solution, rates, sticking, instants, design)
    still = (rates[instants, :, 2] == 0.0).all(axis=1)
    ends = _by_programs(solution, instants[still], design)
    others = _by_slip_signs(solution, rates, sticking, instants[~still], design)
    count = max(len(ends), len(others))
    found = np.full((count, *ends.shape[1:]), np.nan)
    found[: len(ends)] = ends
    found[: len(others), instants[~still]] = others[:, instants[~still]]
    return found


def _by_programs(solution: Result, instants: Array, design: int) -> Array:
    """Ends of the efforts by linear programs, two of each driver, where closed contacts alone have
    friction and nothing slides; NaN where nothing holds.
    """
    whole, n = solution.system, solution.system.coordinates
    system = whole if whole.batch is None else whole.design(design)
    drivers = [driver.name for driver in system.drivers]
    width = PER_PRIMITIVE * len(system.owners)
    found = np.full((2 * len(drivers), len(solution.t), width), np.nan)
    if not drivers:
        return found  # no effort has ends
    limits = ContactLimits(system, system.work())
    for k in instants.tolist():
        work = loaded(solution, k, design)
        a = motion_at(solution, np.array([k]), design)[0, 2 * n : 3 * n]
        forces = StickingContacts(limits, work, work.force[:n, 0] - system.mass[:n, 0] * a)
        for m, (number, sign) in enumerate(itertools.product(range(len(drivers)), (-1.0, 1.0))):
            extreme = forces.extreme(drivers[number], sign)
            if extreme is not None and np.isfinite(extreme).all():
                found[m, k] = forces.table(extreme)
            elif extreme is not None:
                found[m, k] = _unbounded(solution, found[m, k], (number, sign))
    return found


def _by_slip_signs(
    solution: Result, rates: Array, sticking: Array, instants: Array, design: int
) -> Array:
    """Forces for every combination of directions in which sticking pairs may begin to slide."""
    impending = _impending(solution, instants, design)
    every = [
        list(_choices(rates[k], sticking[k], impending[n])) for n, k in enumerate(instants.tolist())
    ]
    count = max((len(choices) for choices in every), default=0)
    width = PER_PRIMITIVE * len(solution.system.owners)
    found = np.full((count, len(rates), width), np.nan)
    for choice, tables in enumerate(found):
        which = np.array([n for n, choices in enumerate(every) if choice < len(choices)])
        slip_signs = np.array([every[n][choice][0] for n in which])
        motion = contact_forces.stored_motion(solution, design, instants[which])
        forces = forces_with(solution, slip_signs, motion, design)
        for row, n in enumerate(which):
            table = forces.table[row]
            if forces.reached[row] < 1.0:
                table = _unbounded(solution, table, every[n][choice][1])
            tables[instants[n]] = table
    return found


def _unbounded(solution: Result, forces: Array, driver: tuple[int, float] | None) -> Array:
    """Forces where no effort moves the mechanism in one direction: that of the driver is infinite
    in that direction, the others are not known.
    """
    found = np.full(forces.shape, np.nan)
    if driver is not None:
        system = solution.system
        e = system.primitives_of[system.drivers[driver[0]].name][0]
        # an effort is −λ
        found[PER_PRIMITIVE * e] = -driver[1] * np.inf
    return found


def _impending(solution: Result, instants: Array, design: int) -> Array:
    """Rates of pairs if one driver alone moved: (instants, drivers, pairs), without rounding."""
    system = solution.system
    pairs = len(system.layout.friction_kind)
    output = np.zeros((len(instants), len(system.drivers), pairs))
    if output.size:
        motion = contact_forces.stored_motion(solution, design, instants)
        impending_rates(system.runtime(), system.work(designs=design), motion, output)
        whole = np.abs(output).max(axis=2, keepdims=True)
        output[np.abs(output) <= RATE_NONE_SLIDING * whole] = 0.0
    return output


def _choices(
    rates: Array, sticking: Array, impending: Array
) -> Iterator[tuple[Array, tuple[int, float] | None]]:
    """Directions in which pairs at rest of an instant may begin to slide, and with which driver
    they do: where nothing slides those of each driver moving alone, either way; else those just
    before and just after the instant, and both of pairs that stay at rest.
    """
    slip_signs = rates[:, 2].copy()
    if not slip_signs.any():
        for n, one in enumerate(impending):
            for sign in (1.0, -1.0):
                own = np.where(sticking, sign * np.sign(one), 0.0)
                for both in slip_signs_with_sticking(own, sticking & (one == 0.0)):
                    yield both, (n, sign)
        return
    change = rates[:, 1]
    starts = sticking & (np.abs(change) > RATE_NONE_SLIDING * np.abs(change).max(initial=0.0))
    for sign in (-1.0, 1.0):
        own = np.where(starts, sign * np.sign(change), slip_signs)
        yield from ((both, None) for both in slip_signs_with_sticking(own, sticking & ~starts))


def slip_signs_with_sticking(slip_signs: Array, still: Array) -> Iterator[Array]:
    """Directions (pairs,) of what begins to slide, with both directions of the pairs that stay at
    rest.
    """
    which = np.flatnonzero(still)
    combinations: Sequence[tuple[float, ...]] = list(
        itertools.product((1.0, -1.0), repeat=len(which))
    )
    if len(which) > TOGETHER:
        combinations = [(1.0,) * len(which), (-1.0,) * len(which)]
    for combination in combinations:
        found = slip_signs.copy()
        found[which] = combination
        yield found


def jams_at(solution: Result, rates: Array, reached: Array, design: int = 0) -> list[Jam]:
    """Where the mechanism jams: the instants at which less than all friction was reached, with the
    coefficient from which on it does. `rates` (instants, pairs, PER_PAIR), `reached` (instants,).
    """
    pairs = contact_forces.friction_pairs(solution.system)
    found = []
    instants = np.flatnonzero(reached < 1.0)[:EXAMINED]
    motion = contact_forces.stored_motion(solution, design, instants)
    # with as much of friction as there are forces
    forces = forces_with(solution, rates[instants, :, 2], motion, design, at_rest=False)
    for n, k in enumerate(instants):
        power = [
            abs(forces.table[n, PER_PRIMITIVE * pair.primitive] * rates[k, m, 0])
            if pair.loses
            else 0.0
            for m, pair in enumerate(pairs)
        ]
        worst = pairs[int(np.argmax(power))]
        part = float(forces.reached[n])
        found.append(
            Jam(float(solution.t[k]), worst.joint, part * _coefficient(solution, worst, design))
        )
    return found


def _coefficient(solution: Result, pair: contact_forces.FrictionPair, design: int) -> float:
    """The coefficient of friction of a joint by its attribute, or what stands for it."""
    values = solution.system.values
    for name, complement in (("friction", False), ("resistance", False), ("efficiency", True)):
        value = values.get(f"{pair.joint}.{name}")
        if value is not None:
            each = np.ravel(value)
            own = float(each[design % each.size])
            return 1.0 - own if complement else own
    return 0.0


@dataclass(frozen=True)
class ForceRange(Locked):
    """Between what a force may lie, where joints rest that hold by friction.

    `low`, `high` (instants,), or Reaction: Of an effort or a reaction. Where nothing rests both are
      the force itself; infinite where no effort moves the mechanism in that direction; NaN where a
      reaction is not known then.
    """

    low: Any
    high: Any


@dataclass(frozen=True)
class FrictionReport(Locked):
    """Whether friction is unique, and where the mechanism jams.

    `certified` (instants,) of bool, (designs, instants) of a batch: Whether friction is certain to
      have one solution. The condition is sufficient only.
    `jams`: Instants at which no effort moves the mechanism: time, joint, and the coefficient of
      friction from which on it jams.
    """

    certified: Array
    jams: tuple[Jam, ...]


@dataclass(frozen=True)
class Efficiency(Inherited):
    """Work given to a mechanism, and the useful part of it.

    `value`: useful/given.
    `given`: Work of the drivers over the motion.
    `useful`: Work done on the output.
    `lost`: Work that the joints took by friction.
    """

    value: float
    given: float
    useful: float
    lost: float


def _limits(plain: Array, choices: Array) -> tuple[Array, Array]:
    """Least and greatest of choices (choices, …); without any the plain number."""
    if not len(choices):
        return plain, plain
    ends = (np.fmin.reduce(choices), np.fmax.reduce(choices))
    low, high = (locked(np.where(np.isnan(one), plain, one)) for one in ends)
    return low, high


def losses_of(solution: Any) -> Mapping[str, Array]:
    """Power that friction takes in each frictional joint, by its name."""
    if not solution.has_forces:
        return MappingProxyType({})
    found: dict[str, Any] = {}
    power = contact_forces.tangent_forces(solution) * solution.rates_of_pairs[..., 0]
    for n, pair in contact_forces.losing_pairs(solution):
        found[pair.joint] = found.get(pair.joint, 0.0) + power[..., n]
    frictional = (*solution.mechanism.joints, *solution.mechanism.contacts)
    order = [one.name for one in frictional if one.name in found]
    return MappingProxyType({name: locked(found[name]) for name in order})


def mode_of(solution: Any, name: str) -> list[Any]:
    """How a frictional joint moves at each instant, by the sign of its rate."""
    _refuse_smooth(solution, name)
    n = next(n for n, one in contact_forces.losing_pairs(solution) if one.joint == name)
    words = np.array(["slip-", "stick", "slip+", ""], dtype=object)  # none of what failed
    which = np.nan_to_num(solution.rates_of_pairs[..., n, 2] + 1.0, nan=3.0).astype(int)
    found: list[Any] = words[which].tolist()
    return found


def _refuse_smooth(solution: Any, name: str) -> None:
    """Refuse what has no friction."""
    known = list(dict.fromkeys(pair.joint for _, pair in contact_forces.losing_pairs(solution)))
    if name not in known:
        raise ModelError(
            f"{name!r} is no joint with friction (there are: {listed(known)}): give it "
            "friction, as in friction=0.1",
            str(name),
        )


def every_force_at_rest(solution: Any) -> Array:
    """(choices, …instants, PER_PRIMITIVE·primitives), see `forces_at_rest`; of a batch too."""
    if not solution.record.batch:
        return forces_at_rest(solution, solution.rates_of_pairs, solution.pairs_at_rest)
    own = zip(solution.rates_of_pairs, solution.pairs_at_rest, strict=True)
    every = [forces_at_rest(solution, *one, n) for n, one in enumerate(own)]
    count = max(len(one) for one in every)
    found = np.full((count, len(every), *every[0].shape[1:]), np.nan)
    for n, one in enumerate(every):
        found[: len(one), n] = one
    return found


def range_of(solution: Any, name: str, on: str | None) -> ForceRange:
    """Least and greatest effort or reaction, where joints rest or contacts share their forces."""
    known = name in solution.mechanism if isinstance(name, str) else False
    element: Any = solution.mechanism[name] if known else None
    if element is None or element.role in ("joint", "contact"):
        plain = solution.reaction(name, on)
        return _reaction_range(
            solution, plain, element or solution.mechanism.element_or_group(name)
        )
    e = solution.system.primitives_of[element.name][0]
    plain = solution.effort(name)
    if _forgotten(solution) and solution.unique_effort(name) is False:
        return ForceRange(*_unknown(plain))
    if _by_sets(solution):
        none = _rounding(solution)[0 if element.effort_dimension == "force" else 2]
        return ForceRange(
            *_shared_ends(solution, plain, -solution.open_forces.change(_row(e, 0)), none)
        )
    return ForceRange(*_limits(plain, -solution.forces_at_rest[..., PER_PRIMITIVE * e]))


COMPONENTS = ("fx", "fy", "torque")


def _row(e: int, n: int) -> int:
    return PER_PRIMITIVE * e + n


def _reaction_range(solution: Any, plain: Reaction, joint: Any) -> ForceRange:
    """Of each component by itself."""
    every = [getattr(plain, key) for key in COMPONENTS]
    if _forgotten(solution):
        each = zip(every, plain.unique or (None,) * 3, strict=True)
        ends = [_unknown(own) if one is False else (own, own) for own, one in each]
    elif _by_sets(solution):
        changes = _changes(solution, joint, plain.on)
        rounding = _rounding(solution)
        ends = [
            _shared_ends(solution, own, by, none)
            for own, by, none in zip(every, changes, rounding, strict=True)
        ]
    else:
        forces = solution.forces_at_rest
        parts = _wrench(solution, joint, plain.on, lambda e, n: forces[..., _row(e, n)])
        ends = [_limits(own, part) for own, part in zip(every, parts, strict=True)]
    low, high = (
        replace(plain, **dict(zip(COMPONENTS, one, strict=True))) for one in zip(*ends, strict=True)
    )
    return ForceRange(low, high)


def _wrench(
    solution: Any, joint: Any, on: str, forces: Callable[[int, int], Array]
) -> tuple[Array, Array, Array]:
    """Force and torque of a joint or contact on a body, of forces (choices, …instants)."""
    if joint.role == "contact":
        if not joint.bodies:
            return contact_forces.group_wrench(solution, joint, on or None, forces)
        return contact_forces.contact_wrench(solution, joint, on, forces)
    rows = solution.system.primitives_of[joint.name]
    sign = 1.0 if on == joint.j.body else -1.0
    x, y, couple = (sign * np.sum([forces(e, n) for e in rows], axis=0) for n in (2, 3, 4))
    every = [reaction_torque(solution, joint, *one) for one in zip(x, y, couple, strict=True)]
    return x, y, np.array(every).reshape(np.shape(couple))


# -- Forces that no equation decides: `mbody.solution.shared_forces` ---------------------------


def _changes(solution: Any, joint: Any, on: str) -> tuple[Array, Array, Array]:
    """How force and torque on a body change by what is free: (free, instants)."""
    shared = solution.open_forces
    return _wrench(solution, joint, on, lambda e, n: shared.change(_row(e, n)))


def _rounding(solution: Any) -> tuple[float, float, float]:
    """Changes of forces and of torques, by the unit of force, that are rounding."""
    none = SINGULAR_VALUE_SHARED_FRICTION
    return none, none, none * float(solution.system.length)


def _forgotten(solution: Any) -> bool:
    """Whether a motion was read from a file, which has no ranges."""
    unknown = solution.shared is None and solution.dependencies is not None
    return unknown and solution.analysis == "simulate"


def _by_sets(solution: Any) -> bool:
    """Whether ranges are those of all admissible forces; of joints at rest in driven motions they
    are those at which the mechanism begins to move.
    """
    if solution.shared is None and (solution.analysis == "simulate" or solution.record.batch):
        return False
    if solution.analysis != "simulate" and not friction_of_contacts_alone(solution.system):
        return solution.shared is not None and not solution.resting
    return solution.open_forces is not None


def _unknown(plain: Array) -> tuple[Array, Array]:
    nothing = locked(np.full(np.shape(plain), np.nan))
    return nothing, nothing


def _shared_ends(solution: Any, plain: Array, by: Array, none: float) -> tuple[Array, Array]:
    less, more = solution.open_forces.range(by, none)
    return locked(plain + less), locked(plain + more)


def unique_reaction(solution: Any, joint: Any, on: str | None, plain: Unique) -> Unique:
    """Which components of a joint or contact are determined, beside what is known of its rows."""
    if isinstance(joint, Stop):
        return plain  # it has no reaction between two bodies
    body = on or (joint.bodies[-1] if joint.bodies else "")
    found: list[bool | None] = []
    each = zip(plain or (), _changes(solution, joint, body), _rounding(solution), strict=False)
    for known, by, none in each:
        found.append(known and solution.open_forces.unique(by, none))
    return None if plain is None else (found[0], found[1], found[2])


def unique_effort(solution: Any, name: str) -> bool | None:
    """Whether the effort of a driver or coupling is determined."""
    e = solution.system.primitives_of[name][0]
    none = _rounding(solution)[0 if solution.mechanism[name].effort_dimension == "force" else 2]
    found: bool | None = solution.open_forces.unique(-solution.open_forces.change(_row(e, 0)), none)
    return found


def friction_report(solution: Any) -> FrictionReport | None:
    """Whether friction is unique, and where the mechanism jams; None without friction or forces."""
    rows = solution.system.friction_rows
    if rows.start == rows.stop or not solution.has_forces:
        return None
    radius, reached = (
        np.asarray(solution.record.take(rows.start + n)) for n in (CERTIFICATE, REACHED_PART)
    )
    certified = (radius < 1.0) & (reached >= 1.0)
    every = reached if solution.record.batch else reached[None]
    jams = [
        jam
        for n in np.flatnonzero((every < 1.0).any(axis=1)).tolist()
        for jam in jams_at(solution, contact_forces.rates_at(solution, n), every[n], n)
    ]
    return FrictionReport(certified, tuple(jams))


def sticking_joints(solution: Any) -> dict[str, Array]:
    """Frictional joints that rest at some instant, with the instants."""
    sticking = solution.pairs_at_rest
    found: dict[str, Array] = {}
    for n, pair in enumerate(contact_forces.friction_pairs(solution.system)):
        if sticking[..., n].any():
            found[pair.joint] = sticking[..., n]
    return found
