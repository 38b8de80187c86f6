"""What of a result was compared by an engine that has no formulas of mbody."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from mbody.engines.crosscheck_result import CrosscheckResult
from mbody.model.stop import Stop
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.solution import Solution

#: Keys of rows that are of forces.
FORCES = ("fx", "fy", "force", "torque", "effort", "contact")


def not_compared(run: Solution, opinions: Mapping[str, CrosscheckResult]) -> tuple[str, ...]:
    """Names of bodies, joints, drivers, couplings, contacts, loads, states and controllers of which
    no engine compared anything of its own; the balance takes motion and forces from the result.
    """
    machine, moving = run.mechanism, run.analysis == "simulate"
    others = {name: one for name, one in opinions.items() if name != "balance" and one.rows}
    seen = {name: _subjects(one, moving and name == "pinocchio") for name, one in others.items()}
    moved = {name for one in seen.values() for name, forces in one if not forces}
    # of elements of which the engine took no force from the result
    pushed = {
        name
        for engine, subjects in seen.items()
        for name, forces in subjects
        if forces and name not in others[engine].adopted
    }
    missing = [body.name for body in machine.bodies if body.name not in moved]
    missing += [name for name in _with_forces(run) if name not in pushed]
    for load in machine.loads:
        if all(load.name in one.adopted for one in others.values()):
            missing.append(load.name)
    if moving:
        missing += [one.name for one in machine.states if one.name not in moved]
        missing += [one.name for one in machine.controllers]
    return tuple(missing)


def _subjects(result: CrosscheckResult, kinematics: bool) -> set[tuple[str, bool]]:
    """The elements and states that rows are about, and whether forces of them were compared. Rows
    of `kinematics` alone, of the motion that the result has, are left out.
    """
    found = set()
    for row in result.rows:
        name = row.quantity.partition(":")[0]
        owner, _, key = name.rpartition(".")
        key, _, told = key.partition(" ")
        if kinematics and key not in FORCES and told not in ("over time", "by the forces"):
            continue
        found.add((owner or name, key in FORCES))
        if told == "over time":
            found.add((f"{owner}.{key}".removeprefix("."), False))
    return found


def _with_forces(run: Solution) -> Iterable[str]:
    """Joints, couplings, drivers and contacts with a unique force."""
    machine, moving = run.mechanism, run.analysis == "simulate"
    for joint in machine.joints:
        if not (moving and joint.can_separate) and any(run.reaction(joint.name).unique or ()):
            yield joint.name
    for one in (*machine.couplings, *run.system.drivers):
        yield one.name
    for one in acting_contacts(run):
        force = run.reaction(one.name)
        if any((force.unique or (True, True))[:2]) and np.any((force.fx, force.fy)):
            yield one.name
    for one in machine.contacts:
        if isinstance(one, Stop) and moving and np.any(run.contact(one.name)):
            yield one.name
