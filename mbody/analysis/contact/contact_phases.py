"""Instants of a motion at which the same contacts are closed, which are joints then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.closed_contacts import has_closed_contacts, reclosed
from mbody.model.contact import Contact
from mbody.model.joint_contacts import limits_of
from mbody.solution.solution import Solution
from mbody.solution.touch_places import touches_of
from mbody.system.system import System

__all__ = ["ContactPhase", "contact_phases"]


@dataclass(frozen=True, eq=False)
class ContactPhase:
    """Instants at which the same contacts are closed.

    Attributes
    ----------
    system : System
        With these contacts closed for good, of the same bodies in the same order.
    instants : array (n,) of int
    open : frozenset of str
        Joints that are separated.
    """

    system: System
    instants: np.ndarray
    open: frozenset[str]


def contact_phases(run: Solution) -> list[ContactPhase]:
    """The instants of a result by what is closed; one of all where no contact opens or closes.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True, instants=5)
    >>> [phase.instants.tolist() for phase in contact_phases(run)]
    [[0, 1, 2, 3, 4]]
    """
    machine = run.mechanism
    if not run.modes or run.stepped is not None or has_closed_contacts(machine):
        return [ContactPhase(run.system, np.arange(len(run)), frozenset())]
    places: list[tuple[str, int, np.ndarray]] = []
    for one in (*machine.contacts, *limits_of(machine)):
        if one.name not in run.modes:
            continue
        if isinstance(one, Contact):
            touches = touches_of(run, one)
            places += [(one.name, n, touch.closed) for n, touch in enumerate(touches)]
        else:
            shut = np.array([word != "open" for word in run.mode(one.name)])
            places.append((one.name, 0, shut))
    parted = [
        (joint.name, np.array([word == "open" for word in run.mode(joint.name)]))
        for joint in machine.joints
        if joint.name in run.modes
    ]
    every = [row for _, _, row in places] + [row for _, row in parted]
    table = np.array(every, dtype=bool).reshape(len(every), len(run)).T
    found = []
    for kept in np.unique(table, axis=0):
        closed: dict[str, tuple[int, ...]] = {}
        for (name, n, _), is_shut in zip(places, kept, strict=False):
            if is_shut:
                closed[name] = (*closed.get(name, ()), n)
        apart = (name for (name, _), off in zip(parted, kept[len(places) :], strict=True) if off)
        system = reclosed(run.system, {name: (own, ()) for name, own in closed.items()})
        instants = np.flatnonzero((table == kept).all(axis=1))
        found.append(ContactPhase(system, instants, frozenset(apart)))
    return found
