"""Which systems have what may open, stick or slide, so that modes are to be decided."""

from __future__ import annotations

from mbody.errors import ModelError
from mbody.kernels.friction import FRICTION_KINDS, LASTING
from mbody.model.element import listed
from mbody.model.joint_limits import contacts_of, with_joint_contacts
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of


def has_modes(system: System) -> bool:
    """Whether something may open, or stick by friction, so that its modes are to be decided."""
    pairs, machine = range(len(system.layout.friction_kind)), system.mechanism
    acting = bool(machine.contacts) or any(contacts_of(joint) for joint in machine.joints)
    return acting or any(may_stick(system, f) for f in pairs)


def may_stick(system: System, f: int) -> bool:
    """Whether a friction pair can stick: not what damps alone, nor what has a sign that lasts."""
    L = system.layout
    if FRICTION_KINDS[int(L.friction_kind[f])] in LASTING:
        return False
    return bool(system.par[int(L.friction_par[f]) + 1, 0] > 0.0)


def with_contacts_of_joints(system: System) -> System:
    """The system with the contacts that its joints bring: limits, and what can separate."""
    machine = system.mechanism
    there = {one.name for one in machine.contacts}
    wanted = {one.name for joint in machine.joints for one in contacts_of(joint)}
    if wanted <= there:
        return system
    return with_numbers_of(assemble(with_joint_contacts(machine)), system.values)


def refuse_modes(system: System, what: str) -> None:
    """Refuse a system with modes where nothing decides them."""
    if not has_modes(system):
        return
    L, machine = system.layout, system.mechanism
    names = [one.described for one in machine.contacts]
    names += [joint.name for joint in machine.joints if contacts_of(joint)]
    names += [system.owners[int(L.active_set[s])][0].name for s in L.friction_tangent]
    raise ModelError(
        f"{listed(dict.fromkeys(names), 4)} of '{machine.name}' may open, stick or slide, which "
        f"{what} does not decide: follow the motion by simulate with dop853, dopri5 or radau5, "
        "or leave out contacts and friction",
        names[0],
    )
