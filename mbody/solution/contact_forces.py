"""Reactions of joints, contacts and ropes: what has one, and the forces of contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.tolerances import CONTACT_FORCE_AT_REST
from mbody.errors import ModelError
from mbody.kernels.finished_instants import PER_PAIR, StoredMotion, rates_of_pairs
from mbody.kernels.friction import FRICTION_KINDS, LASTING
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.model.contact import OneSided
from mbody.model.element import unknown_name
from mbody.model.joint_limits import JointContact
from mbody.model.stop import Stop
from mbody.solution.histories import Reaction, Result, Unique, column, motion_at, motion_rows
from mbody.system.system import System, locked

Array = np.ndarray


def acting_contacts(solution: Any) -> tuple[OneSided, ...]:
    """The contacts that acted, between two bodies: they have a reaction."""
    every: tuple[OneSided, ...] = solution.mechanism.contacts
    return tuple(one for one in every if one.bodies and (solution.modes or one.closed))


def with_reaction(solution: Result, name: Any) -> Any:
    """The joint, contact or rope of that name."""
    machine = solution.mechanism
    element: Any = None
    if isinstance(name, str) and (name in machine or machine.contacts_of(name)):
        element = machine.element_or_group(name)
    if element is not None and element.role == "coupling":
        raise ModelError(
            f"'{name}' is a coupling of several bodies, it has no reaction between two: ask "
            "for its effort",
            name,
        )
    if element is None or element.role not in ("joint", "contact"):
        known = (*machine.joints, *machine.contacts, *machine.groups)
        raise unknown_name("joint", name, known)
    if not solution.has_forces:
        raise ModelError(
            f"{solution.analysis} finds no forces, as of '{name}': use kinetostatics", name
        )
    return element


def contact_reaction(solution: Any, contact: Any, on: str | None, unique: Unique) -> Reaction:
    """Force and torque of a contact or rope on body `on`, by default j: the torque about the mass
    centre of that body.
    """
    if isinstance(contact, Stop):
        raise ModelError(
            f"'{contact.name}' is a stop of all bodies that it measures, it has no reaction "
            "between two: ask for its contact",
            contact.name,
        )
    if not contact.bodies:
        return _group_reaction(solution, contact, on, unique)
    i, j = contact.bodies
    if on not in (None, i, j):
        raise ModelError(f"contact '{contact.name}' is between '{i}' and '{j}', not {on!r}")
    body, by = (i, j) if on == i else (j, i)
    parts = contact_wrench(solution, contact, body, solution.primitive_history)
    return Reaction(contact.name, body, by, *parts, unique)


def contact_wrench(
    solution: Any, contact: Any, body: str, forces: Callable[[int, int], Array]
) -> tuple[Array, Array, Array]:
    """Force components and torque of a contact on a body; `forces` gives a component, 2 to 4, of a
    primitive on the second body of its row.
    """
    i, j = contact.bodies
    own = solution[body]
    fx: Any = 0.0
    fy: Any = 0.0
    torque: Any = 0.0
    candidates = contact.candidates(solution.system.numbers)
    for n, e in enumerate(solution.system.primitives_of[contact.name]):
        candidate = candidates[n % len(candidates)]
        x, y, couple = (forces(e, k) for k in (2, 3, 4))
        second = i if candidate.swapped else j
        at = solution[second]
        px, py = _point_of_torque(contact, solution, at)
        sign = 1.0 if second == body else -1.0
        fx, fy = fx + sign * x, fy + sign * y
        dx, dy = at.x + px - own.x, at.y + py - own.y
        torque = torque + sign * (couple + dx * y - dy * x)
    return fx, fy, torque


def _group_reaction(solution: Any, group: Any, on: str | None, unique: Unique) -> Reaction:
    """The sum of the forces of a group of contacts on all shapes of its j, or of its i, with the
    torque about the origin of the world.
    """
    if on not in (None, group.i, group.j):
        raise ModelError(f"group '{group.name}' is between '{group.i}' and '{group.j}', not {on!r}")
    sign = -1.0 if on == group.i != group.j else 1.0
    stepped = solution.stepped
    if stepped is None:
        parts = group_wrench(solution, group, on, solution.primitive_history)
    else:
        fx, fy, torque = stepped.force(group.name)
        parts = sign * fx, sign * fy, sign * torque
    ends = (group.i, group.j) if sign < 0.0 else (group.j, group.i)
    return Reaction(group.name, *ends, *parts, unique)


def group_wrench(
    solution: Any, group: Any, on: str | None, forces: Callable[[int, int], Array]
) -> tuple[Array, Array, Array]:
    """The sum of the forces of the contacts of a group on their j, or i, and its torque about the
    origin of the world; `forces` as of `contact_wrench`.
    """
    sign = -1.0 if on == group.i != group.j else 1.0
    total = [np.zeros(1)] * 3
    for one in solution.mechanism.contacts_of(group.name):
        j = one.bodies[1]
        fx, fy, torque = contact_wrench(solution, one, j, forces)
        at = solution[j]
        parts = fx, fy, torque + at.x * fy - at.y * fx
        total = [whole + sign * part for whole, part in zip(total, parts, strict=True)]
    return total[0], total[1], total[2]


def _point_of_torque(contact: Any, solution: Any, body: Any) -> tuple[Array, Array]:
    """From the mass centre of the second body of a row to where its torque is taken: the mass
    centre, of a rope its end.
    """
    if "j" not in contact.places():
        return np.zeros(np.shape(body.x)), np.zeros(np.shape(body.x))
    ax, ay = (column(part) for part in solution.system.numbers.arm(contact, "j"))
    c, s = np.cos(body.angle), np.sin(body.angle)
    return c * ax - s * ay, s * ax + c * ay


def pressing_force(solution: Any, contact: Any) -> Array:
    """Sum of the normal forces of a contact, or pull of a rope: (instants,); not negative but where
    it is closed for good and would have to pull, or push.
    """
    if solution.stepped is not None:
        whole: Array = locked(solution.stepped.pressing(contact.name))
        return whole
    group = solution.mechanism.contacts_of(contact.name)
    if group:
        every: Array = locked(sum(pressing_force(solution, one) for one in group))
        return every
    first, *more = pressing_forces(solution, contact)
    total: Array = sum(more, start=first)
    return locked(total) if isinstance(total, np.ndarray) else total  # derivatives with them


def least_pressing(solution: Any, contact: Any) -> Array:
    """The least pressing force of the places of a contact that is closed for good, where it rests
    the best that friction leaves possible: (instants,).
    """
    found = np.minimum.reduce(pressing_forces(solution, contact))
    if not solution.has_forces or contact.name not in solution.resting:
        return np.asarray(found)
    choices = solution.forces_at_rest

    def of_choice(e: int, k: int) -> Array:
        return np.asarray(choices[..., PER_PRIMITIVE * e + k])

    every = np.minimum.reduce(pressing_forces(solution, contact, of_choice))
    return np.asarray(np.fmax(found, np.fmax.reduce(every)) if len(every) else found)


def pressing_forces(
    solution: Any, contact: Any, forces: Callable[[int, int], Array] | None = None
) -> list[Array]:
    """Normal force at every point of a contact: arrays (instants,); `forces` as of
    `contact_wrench`.
    """
    forces = solution.primitive_history if forces is None else forces
    found = []
    candidates = contact.candidates(solution.system.numbers)
    for candidate, e in zip(candidates, solution.system.primitives_of[contact.name], strict=False):
        if type(contact) is JointContact:
            # a row of a cam has not the gradient one
            found.append(np.hypot(forces(e, 2), forces(e, 3)))
        else:
            found.append(-candidate.sign * forces(e, 0))
    return found


# -- Friction pairs of a result: sliding velocities and forces ---------------------------------


@dataclass(frozen=True)
class FrictionPair:
    """One place with friction.

    `joint`: Name of the joint.
    `kind`: One of `FRICTION_KINDS`.
    `primitive`: That of its tangent row.
    `parameter`: Row of its coefficients among the numbers of the kernels.
    `separable`: Whether it is of a contact that may be open.
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


def friction_pairs(system: System) -> tuple[FrictionPair, ...]:
    """All friction pairs, in the order of the kernels."""
    L = system.layout
    found = []
    for kind, tangent, parameter in zip(
        L.friction_kind, L.friction_tangent, L.friction_par, strict=True
    ):
        e = int(L.active_set[tangent])
        owner: Any = system.owners[e][0]
        is_open = owner.role == "contact" and not owner.closed
        found.append(FrictionPair(owner.name, FRICTION_KINDS[kind], e, int(parameter), is_open))
    return tuple(found)


def losing_pairs(solution: Result) -> list[tuple[int, FrictionPair]]:
    """The pairs that lose power where they slide, with their numbers: but in `simulate` none of
    contacts that are left out.
    """
    decided = solution.analysis == "simulate"
    return [
        (n, pair)
        for n, pair in enumerate(friction_pairs(solution.system))
        if pair.loses and (decided or not pair.separable)
    ]


def may_hold(system: System, pair: FrictionPair) -> bool:
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
        for pair in friction_pairs(solution.system)
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
    """Rate of sliding, its derivative and the sign (zero at rest) of all pairs: (instants, pairs,
    PER_PAIR), or with a first axis of designs.
    """
    designs = range(solution.system.batch or 1)
    found = np.array([rates_at(solution, design) for design in designs])
    return found if solution.record.batch else found[0]


def rates_at(solution: Result, design: int = 0, instants: Array | None = None) -> Array:
    """Sliding and rolling rates of one design at some instants, by default at all: (instants,
    pairs, PER_PAIR).
    """
    system = solution.system
    motion = stored_motion(solution, design, instants)
    output = np.zeros((len(motion.t), len(system.layout.friction_kind), PER_PAIR))
    if output.size:
        rates_of_pairs(system.runtime(), system.work(designs=design), motion, output)
        slides = [pair.loses for pair in friction_pairs(system)]
        output[:, ~np.array(slides), 2] = 0.0
        output[np.isnan(output[:, :, 0]), 2] = np.nan  # of a design that failed
    return output


def presses_by_friction(system: System) -> bool:
    """Whether friction of what rests may be given, as it keeps contacts and ropes pressing."""
    machine = system.mechanism
    return any(one.closed for one in machine.contacts) or bool(machine.couplings)


def sticking_pairs(solution: Result) -> Array:
    """Which pairs do not slide, and may hold by friction, at which instants: (instants, pairs) of
    bool, or (designs, instants, pairs). The force of a pair at rest is none but its damping, and of
    closed contacts and ropes what keeps them pressing: where no force is small all slide, and no
    rate is looked at.
    """
    system = solution.system
    pairs = friction_pairs(system)
    acting = {n for n, _ in losing_pairs(solution)}
    holds = [n in acting and may_hold(system, pair) for n, pair in enumerate(pairs)]
    shape = (*np.shape(solution.record.take(0)), len(pairs))
    if solution.analysis == "statics":
        return np.broadcast_to(np.array(holds, dtype=bool), shape)
    found, at_rest = np.zeros(shape, dtype=bool), None
    first = 3 * system.coordinates
    for n in np.flatnonzero(holds):
        force = np.abs(solution.record.take(first + PER_PRIMITIVE * pairs[n].primitive))
        top = force.max(axis=-1, keepdims=True)
        if not (force.min(axis=-1, keepdims=True) > CONTACT_FORCE_AT_REST * top).all():
            at_rest = np.zeros(shape, dtype=bool) if at_rest is None else at_rest
            at_rest[..., n] = ~(
                force > CONTACT_FORCE_AT_REST * np.fmax.reduce(force, axis=-1, keepdims=True)
            )
    if presses_by_friction(system):
        at_rest = np.broadcast_to(np.array(holds, dtype=bool), shape)
    if at_rest is None:
        return found
    every, sticking = (one if solution.record.batch else one[None] for one in (at_rest, found))
    for design, own in enumerate(every):
        instants = np.flatnonzero(own.any(axis=1))
        if instants.size:
            slip_signs = rates_at(solution, design, instants)[:, :, 2]
            sticking[design, instants] = (slip_signs == 0.0) & np.array(holds, dtype=bool)
    return found
