"""Reactions of joints, contacts and ropes: what has one, and the forces of contacts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.kernels.output import PER_PRIMITIVE
from mbody.model.element import listed
from mbody.model.joint_contacts import JointContact
from mbody.model.one_sided_constraint import OneSided
from mbody.model.stop import Stop
from mbody.solution.histories import Reaction
from mbody.solution.result import Result
from mbody.system.read_only import locked

__all__ = [
    "acting_contacts",
    "contact_reaction",
    "contact_wrench",
    "least_pressing",
    "pressing_force",
    "pressing_forces",
    "with_reaction",
]

Array = np.ndarray


def acting_contacts(solution: Any) -> tuple[OneSided, ...]:
    """The contacts that acted, between two bodies: they have a reaction."""
    every: tuple[OneSided, ...] = solution.mechanism.contacts
    return tuple(one for one in every if one.bodies and (solution.modes or one.closed))


def with_reaction(solution: Result, name: Any) -> Any:
    """The joint, contact or rope of that name.

    Raises
    ------
    ModelError
        For what has no reaction, and an analysis without forces.
    """
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
        known = listed(one.name for one in (*machine.joints, *machine.contacts, *machine.groups))
        raise ModelError(f"there is no joint {name!r} (there are: {known})", str(name))
    if not solution.has_forces:
        raise ModelError(
            f"{solution.analysis} finds no forces, as of '{name}': use kinetostatics", name
        )
    return element


def contact_reaction(
    solution: Any, contact: Any, on: str | None, unique: tuple[bool, bool, bool] | None
) -> Reaction:
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
        return _group_reaction(solution, contact, on)
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
    spots = contact.spots(solution.system.numbers)
    for n, e in enumerate(solution.system.primitives_of[contact.name]):
        spot = spots[n % len(spots)]
        x, y, turning = (forces(e, k) for k in (2, 3, 4))
        second = i if spot.swapped else j
        at = solution[second]
        px, py = _arm_of_torque(contact, solution, at)
        sign = 1.0 if second == body else -1.0
        fx, fy = fx + sign * x, fy + sign * y
        dx, dy = at.x + px - own.x, at.y + py - own.y
        torque = torque + sign * (turning + dx * y - dy * x)
    return fx, fy, torque


def _group_reaction(solution: Any, group: Any, on: str | None) -> Reaction:
    """The sum of the forces of a group of contacts on all shapes of its j, or of its i, with the
    torque about the origin of the world.
    """
    if on not in (None, group.i, group.j):
        raise ModelError(f"group '{group.name}' is between '{group.i}' and '{group.j}', not {on!r}")
    sign = -1.0 if on == group.i != group.j else 1.0
    stepped = solution.stepped
    parts = _sum_of(solution, group) if stepped is None else stepped.force(group.name)
    fx, fy, torque = (sign * part for part in parts)
    ends = (group.i, group.j) if sign < 0.0 else (group.j, group.i)
    # where rows are redundant it is not looked at whether the sum is determined
    unique = None if solution.regularization else (True, True, True)
    return Reaction(group.name, *ends, fx, fy, torque, unique)


def _sum_of(solution: Any, group: Any) -> list[Array]:
    """The sum of the forces of the contacts of a group on their j, and its torque about the origin
    of the world.
    """
    total = [np.zeros(1)] * 3
    for one in solution.mechanism.contacts_of(group.name):
        j = one.bodies[1]
        fx, fy, torque = contact_wrench(solution, one, j, solution.primitive_history)
        at = solution[j]
        parts = fx, fy, torque + at.x * fy - at.y * fx
        total = [whole + part for whole, part in zip(total, parts, strict=True)]
    return total


def _arm_of_torque(contact: Any, solution: Any, body: Any) -> tuple[Array, Array]:
    """From the mass centre of the second body of a row to where its torque is taken: the mass
    centre, of a rope its end.
    """
    if "j" not in contact.places():
        return np.zeros(np.shape(body.x)), np.zeros(np.shape(body.x))
    ax, ay = solution.system.numbers.arm(contact, "j")
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
    """The same of every place of a contact: arrays (instants,); `forces` as of `contact_wrench`."""
    forces = solution.primitive_history if forces is None else forces
    found = []
    spots = contact.spots(solution.system.numbers)
    for spot, e in zip(spots, solution.system.primitives_of[contact.name], strict=False):
        if type(contact) is JointContact:
            # a row of a cam has not the gradient one
            found.append(np.hypot(forces(e, 2), forces(e, 3)))
        else:
            found.append(-spot.sense * forces(e, 0))
    return found
