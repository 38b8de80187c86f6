"""What friction leaves open where joints rest, and where a mechanism jams: forces for senses of
sliding that the motion does not decide.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mbody.kernels.friction_instants import StoredMotion, forces_by_senses, impending_rates
from mbody.kernels.friction_laws import IMPENDING, SLIDING
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.checks import loaded
from mbody.solution.contact_ranges import ContactLimits, RestingContacts, rubs_by_contacts_alone
from mbody.solution.own_histories import motion_at
from mbody.solution.result import Result
from mbody.solution.rough_pairs import RoughPair, rough_pairs, stored_motion

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["FrictionForces", "Jam", "forces_at_rest", "forces_with", "jams_at", "senses_with_still"]

Array = np.ndarray

#: Pairs at rest of which both senses are tried with all others; beyond, all of them together.
TOGETHER = 6
#: A rate, or its change, below this part of the greatest is rounding.
ROUNDING = 1e-9
#: Jams that are examined, at most.
EXAMINED = 400


class FrictionForces(NamedTuple):
    """Forces of one choice of senses.

    Attributes
    ----------
    table : array (instants, PER_PRIMITIVE·primitives)
        As `mbody.kernels.output` keeps them.
    reached : array (instants,)
        Part of friction that was reached, less than 1 where the mechanism jams.
    """

    table: Array
    reached: Array


class Jam(NamedTuple):
    """A position at which a mechanism jams.

    Attributes
    ----------
    t : float
    joint : str
        The one whose friction takes most of the power.
    coefficient : float
        Of that joint's friction (of teeth without friction the part of power that they lose), from
        which on it jams there; those of all joints are changed by one factor.
    """

    t: float
    joint: str
    coefficient: float


def forces_with(
    solution: Result,
    senses: Array,
    motion: StoredMotion,
    design: int = 0,
    *,
    at_rest: bool = True,
) -> FrictionForces:
    """Forces at the instants of a motion with these senses (instants, pairs).

    Parameters
    ----------
    motion : StoredMotion
        As of `stored_motion`, of the design.
    at_rest : bool
        Whether pairs of the rate zero have their static coefficient.
    """
    system = solution.system
    work = system.work(designs=design)
    output = np.empty((len(senses), PER_PRIMITIVE * len(system.owners), 1))
    reached = np.empty((len(senses), 2))
    forces_by_senses(
        system.runtime().replaced(senses=IMPENDING if at_rest else SLIDING),
        work,
        motion,
        np.ascontiguousarray(senses, dtype=float),
        output,
        reached,
    )
    return FrictionForces(output[:, :, 0], reached[:, 1])


def forces_at_rest(solution: Result, rates: Array, rest: Array, design: int = 0) -> Array:
    """Forces by each choice of the senses in which pairs at rest may begin to slide: (choices,
    instants, PER_PRIMITIVE·primitives), NaN where no pair rests or there are fewer choices. Forces
    that grow without bound, as they do where it jams in one sense, are infinite.

    Parameters
    ----------
    rates : array (instants, pairs, PER_PAIR)
        As of `pair_rates`.
    rest : array (instants, pairs)
        As of `resting_pairs`.
    """
    instants = np.flatnonzero(rest.any(axis=1))
    if not rubs_by_contacts_alone(solution.system):
        return _by_senses(solution, rates, rest, instants, design)
    still = (rates[instants, :, 2] == 0.0).all(axis=1)
    ends = _by_programs(solution, instants[still], design)
    others = _by_senses(solution, rates, rest, instants[~still], design)
    count = max(len(ends), len(others))
    found = np.full((count, *ends.shape[1:]), np.nan)
    found[: len(ends)] = ends
    found[: len(others), instants[~still]] = others[:, instants[~still]]
    return found


def _by_programs(solution: Result, instants: Array, design: int) -> Array:
    """The same where closed contacts alone rub and nothing slides: the ends of the efforts, of each
    driver two, not a number where nothing holds.
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
        forces = RestingContacts(limits, work, work.force[:n, 0] - system.mass[:n, 0] * a)
        for m, (number, way) in enumerate(itertools.product(range(len(drivers)), (-1.0, 1.0))):
            extreme = forces.extreme(drivers[number], way)
            if extreme is not None and np.isfinite(extreme).all():
                found[m, k] = forces.table(extreme)
            elif extreme is not None:
                found[m, k] = _unbounded(solution, found[m, k], (number, way))
    return found


def _by_senses(solution: Result, rates: Array, rest: Array, instants: Array, design: int) -> Array:
    """The same by the senses in which what rests may begin to slide."""
    impending = _impending(solution, instants, design)
    every = [
        list(_choices(rates[k], rest[k], impending[n])) for n, k in enumerate(instants.tolist())
    ]
    count = max((len(choices) for choices in every), default=0)
    width = PER_PRIMITIVE * len(solution.system.owners)
    found = np.full((count, len(rates), width), np.nan)
    for choice, tables in enumerate(found):
        which = np.array([n for n, choices in enumerate(every) if choice < len(choices)])
        senses = np.array([every[n][choice][0] for n in which])
        motion = stored_motion(solution, design, instants[which])
        forces = forces_with(solution, senses, motion, design)
        for row, n in enumerate(which):
            table = forces.table[row]
            if forces.reached[row] < 1.0:
                table = _unbounded(solution, table, every[n][choice][1])
            tables[instants[n]] = table
    return found


def _unbounded(solution: Result, forces: Array, driver: tuple[int, float] | None) -> Array:
    """Forces where no effort moves the mechanism in one sense: that of the driver is infinite in
    that sense, the others are not known.
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
        motion = stored_motion(solution, design, instants)
        impending_rates(system.runtime(), system.work(designs=design), motion, output)
        whole = np.abs(output).max(axis=2, keepdims=True)
        output[np.abs(output) <= ROUNDING * whole] = 0.0
    return output


def _choices(
    rates: Array, rest: Array, impending: Array
) -> Iterator[tuple[Array, tuple[int, float] | None]]:
    """Senses in which pairs at rest of an instant may begin to slide, and with which driver they
    do: where nothing slides those of each driver moving alone, either way; else those just before
    and just after the instant, and both of pairs that stay at rest.
    """
    senses = rates[:, 2].copy()
    if not senses.any():
        for n, one in enumerate(impending):
            for way in (1.0, -1.0):
                own = np.where(rest, way * np.sign(one), 0.0)
                for both in senses_with_still(own, rest & (one == 0.0)):
                    yield both, (n, way)
        return
    change = rates[:, 1]
    turns = rest & (np.abs(change) > ROUNDING * np.abs(change).max(initial=0.0))
    for way in (-1.0, 1.0):
        own = np.where(turns, way * np.sign(change), senses)
        yield from ((both, None) for both in senses_with_still(own, rest & ~turns))


def senses_with_still(senses: Array, still: Array) -> Iterator[Array]:
    """Senses (pairs,) of what begins to slide, with both senses of the pairs that stay at rest."""
    which = np.flatnonzero(still)
    ways: Sequence[tuple[float, ...]] = list(itertools.product((1.0, -1.0), repeat=len(which)))
    if len(which) > TOGETHER:
        ways = [(1.0,) * len(which), (-1.0,) * len(which)]
    for way in ways:
        found = senses.copy()
        found[which] = way
        yield found


def jams_at(solution: Result, rates: Array, reached: Array, design: int = 0) -> list[Jam]:
    """Where the mechanism jams: the instants at which less than all friction was reached, with the
    coefficient from which on it does.

    Parameters
    ----------
    rates : array (instants, pairs, PER_PAIR)
    reached : array (instants,)
        Part of friction that was reached.
    """
    pairs = rough_pairs(solution.system)
    found = []
    instants = np.flatnonzero(reached < 1.0)[:EXAMINED]
    motion = stored_motion(solution, design, instants)
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


def _coefficient(solution: Result, pair: RoughPair, design: int) -> float:
    """The coefficient of friction of a joint by its attribute, or what stands for it."""
    values = solution.system.values
    for name, turned in (("friction", False), ("resistance", False), ("efficiency", True)):
        value = values.get(f"{pair.joint}.{name}")
        if value is not None:
            each = np.ravel(value)
            own = float(each[design % each.size])
            return 1.0 - own if turned else own
    return 0.0
