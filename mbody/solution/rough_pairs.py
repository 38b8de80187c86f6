"""Rough pairs of a result: which joints rub, how fast they slide, and with what force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.kernels.friction_instants import PER_PAIR, StoredMotion, rates_of_pairs
from mbody.kernels.friction_laws import FRICTION_KINDS, LASTING
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.own_histories import motion_at, motion_rows
from mbody.solution.result import Result
from mbody.system.system import System

__all__ = [
    "RoughPair",
    "losing_pairs",
    "may_hold",
    "pair_rates",
    "rates_at",
    "resting_pairs",
    "rough_pairs",
    "stored_motion",
    "tangent_forces",
]

Array = np.ndarray

#: Part of the greatest force of a pair below which it may be one at rest.
SMALL = 1e-6


@dataclass(frozen=True)
class RoughPair:
    """One place that rubs.

    Attributes
    ----------
    joint : str
        Name of the joint.
    kind : str
        One of `FRICTION_KINDS`.
    primitive : int
        That of its tangent row.
    parameter : int
        Row of its coefficients among the numbers of the kernels.
    separable : bool
        Whether it is of a contact that may be open.
    """

    joint: str
    kind: str
    primitive: int
    parameter: int
    separable: bool

    @property
    def loses(self) -> bool:
        """Whether it slides; teeth that press their wheels apart do not, nor a belt that pulls."""
        return self.kind not in LASTING


def rough_pairs(system: System) -> tuple[RoughPair, ...]:
    """All rough pairs, in the order of the kernels."""
    L = system.layout
    found = []
    for kind, tangent, parameter in zip(
        L.friction_kind, L.friction_tangent, L.friction_par, strict=True
    ):
        e = int(L.switched[tangent])
        owner: Any = system.owners[e][0]
        apart = owner.role == "contact" and not owner.closed
        found.append(RoughPair(owner.name, FRICTION_KINDS[kind], e, int(parameter), apart))
    return tuple(found)


def losing_pairs(solution: Result) -> list[tuple[int, RoughPair]]:
    """The pairs that lose power where they slide, with their numbers: but in `simulate` none of
    contacts that are left out.
    """
    decided = solution.analysis == "simulate"
    return [
        (n, pair)
        for n, pair in enumerate(rough_pairs(solution.system))
        if pair.loses and (decided or not pair.separable)
    ]


def may_hold(system: System, pair: RoughPair) -> bool:
    """Whether a pair takes a force while it rests: not what damps alone, nor teeth that press
    their wheels apart.
    """
    return pair.loses and bool(system.par[pair.parameter + 1].max() > 0.0)


def tangent_forces(solution: Result) -> Array:
    """Multipliers of the tangent rows: (instants, pairs), or (designs, instants, pairs); the force
    on the mechanism is against them.
    """
    first = 3 * solution.system.coordinates
    rows = [
        solution.record.take(first + PER_PRIMITIVE * pair.primitive)
        for pair in rough_pairs(solution.system)
    ]
    shape = np.shape(solution.record.take(0))
    return np.stack(rows, axis=-1) if rows else np.zeros((*shape, 0))


def stored_motion(solution: Result, design: int = 0, instants: Array | None = None) -> StoredMotion:
    """The motion of one design at all instants, or at some, as the kernels take it."""
    t = np.array(solution.t)
    if instants is None:
        motion = motion_rows(solution)
        motion = np.ascontiguousarray(motion[design] if solution.record.batch else motion)
    else:
        motion, t = motion_at(solution, instants, design), t[instants]
    return StoredMotion(motion=motion, t=t, regularization=solution.regularization)


def pair_rates(solution: Result) -> Array:
    """Rate of sliding, its derivative and the sense (zero at rest) of all pairs: (instants, pairs,
    PER_PAIR), or with a first axis of designs.
    """
    designs = range(solution.system.batch or 1)
    found = np.array([rates_at(solution, design) for design in designs])
    return found if solution.record.batch else found[0]


def rates_at(solution: Result, design: int = 0, instants: Array | None = None) -> Array:
    """The same of one design at some instants, by default at all: (instants, pairs, PER_PAIR)."""
    system = solution.system
    motion = stored_motion(solution, design, instants)
    output = np.zeros((len(motion.t), len(system.layout.friction_kind), PER_PAIR))
    if output.size:
        rates_of_pairs(system.runtime(), system.work(designs=design), motion, output)
        slides = [pair.loses for pair in rough_pairs(system)]
        output[:, ~np.array(slides), 2] = 0.0
    return output


def resting_pairs(solution: Result) -> Array:
    """Which pairs rest, and may hold by friction, at which instants: (instants, pairs) of bool, or
    (designs, instants, pairs). The force of a pair at rest is none but its damping: where no force
    is small nothing rests, and no rate is looked at.
    """
    system = solution.system
    pairs = rough_pairs(system)
    acting = {n for n, _ in losing_pairs(solution)}
    holds = [n in acting and may_hold(system, pair) for n, pair in enumerate(pairs)]
    shape = (*np.shape(solution.record.take(0)), len(pairs))
    if solution.analysis == "statics":
        return np.broadcast_to(np.array(holds, dtype=bool), shape)
    found, near = np.zeros(shape, dtype=bool), None
    first = 3 * system.coordinates
    for n in np.flatnonzero(holds):
        force = np.abs(solution.record.take(first + PER_PRIMITIVE * pairs[n].primitive))
        top = force.max(axis=-1, keepdims=True)
        if not (force.min(axis=-1, keepdims=True) > SMALL * top).all():
            near = np.zeros(shape, dtype=bool) if near is None else near
            near[..., n] = ~(force > SMALL * np.fmax.reduce(force, axis=-1, keepdims=True))
    if near is None:
        return found
    every, rest = (one if solution.record.batch else one[None] for one in (near, found))
    for design, own in enumerate(every):
        instants = np.flatnonzero(own.any(axis=1))
        if instants.size:
            senses = rates_at(solution, design, instants)[:, :, 2]
            rest[design, instants] = (senses == 0.0) & np.array(holds, dtype=bool)
    return found
