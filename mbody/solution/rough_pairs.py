"""Rough pairs of a result: which joints rub, how fast they slide, and with what force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.friction_instants import PER_PAIR, StoredMotion, rates_of_pairs
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.own_histories import motion_rows
from mbody.solution.result import Result
from mbody.system.system import System

__all__ = ["RoughPair", "pair_rates", "rough_pairs", "stored_motion", "tangent_forces"]

Array = np.ndarray


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
    """

    joint: str
    kind: str
    primitive: int
    parameter: int

    @property
    def loses(self) -> bool:
        """Whether it slides; teeth that press their wheels apart do not."""
        return self.kind != "apart"


def rough_pairs(system: System) -> tuple[RoughPair, ...]:
    """All rough pairs, in the order of the kernels."""
    L = system.layout
    found = []
    for kind, tangent, parameter in zip(
        L.friction_kind, L.friction_tangent, L.friction_par, strict=True
    ):
        e = int(L.switched[tangent])
        name = system.owners[e][0].name
        found.append(RoughPair(name, FRICTION_KINDS[kind], e, int(parameter)))
    return tuple(found)


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
    motion, t = motion_rows(solution), np.array(solution.t)
    motion = motion[design] if solution.record.batch else motion
    if instants is not None:
        motion, t = motion[instants], t[instants]
    return StoredMotion(
        motion=np.ascontiguousarray(motion), t=t, regularization=solution.regularization
    )


def pair_rates(solution: Result) -> Array:
    """Rate of sliding, its derivative and the sense (zero at rest) of all pairs: (instants, pairs,
    PER_PAIR), or with a first axis of designs.
    """
    system = solution.system
    count = len(system.layout.friction_kind)
    found = np.zeros((system.batch or 1, len(solution.t), count, PER_PAIR))
    if count:
        for design, output in enumerate(found):
            work = system.work(designs=design)
            rates_of_pairs(system.runtime(), work, stored_motion(solution, design), output)
    return found if solution.record.batch else found[0]
