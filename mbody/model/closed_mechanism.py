"""Copies of a mechanism that are closed to additions: what systems keep."""

from __future__ import annotations

from collections.abc import Iterable

from mbody.model.compiled_formulas import compiled_state, compiled_stop
from mbody.model.element import Element
from mbody.model.mechanism import Mechanism
from mbody.model.stop import Stop
from mbody.quantities import Formula

__all__ = ["snapshot", "with_element", "with_others", "without_contacts"]


def snapshot(machine: Mechanism, *, groups: bool = False) -> Mechanism:
    """The mechanism as it is now, closed to additions: what a system keeps; with single contacts in
    the place of their groups, unless these are to stay.
    """
    if machine.is_closed:
        return machine
    kept = machine if groups else _with_single_contacts(machine)
    elements, formulas = {one.name: one for one in kept}, dict(kept.formulas)
    for state in kept.described_states:
        elements[state.name], own = compiled_state(kept, state)
        formulas |= own
    for stop in (one for one in kept.contacts if isinstance(one, Stop)):
        elements[stop.name], own = compiled_stop(kept, stop)
        formulas |= own
    return kept.closed_with(elements.values(), formulas)


def _with_single_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism with contacts in the place of their groups."""
    if not machine.groups:
        return machine
    gone = {group.name for group in machine.groups}
    rest = [one for one in machine if one.name not in gone]
    kept = machine.closed_with(rest, _without(machine, gone)).copied()
    for group in machine.groups:
        own = machine.described_group(group.name)
        kept.add(*own.contacts((*machine.bodies, machine.ground)))
    return kept


def without_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism without contacts, ropes and groups of contacts, closed to additions."""
    gone = {one.name for one in (*machine.contacts, *machine.groups)}
    rest = [one for one in machine if one.name not in gone]
    return machine.closed_with(rest, _without(machine, gone))


def with_others(machine: Mechanism, gone: set[str], others: Iterable[Element]) -> Mechanism:
    """The mechanism with other elements, in the place of those of their names or else at the end,
    and without those that are gone, closed to additions; all numbers follow what they followed.
    """
    new = {one.name: one for one in others}
    old = {one.name: one for one in machine if one.name in new or one.name not in gone}
    return machine.closed_with((old | new).values())


def with_element(machine: Mechanism, element: Element) -> Mechanism:
    """The mechanism with another element in the place of the one of that name, closed to additions;
    its numbers follow no parameters.
    """
    elements = {one.name: one for one in machine} | {element.name: element}
    return machine.closed_with(elements.values(), _without(machine, {element.name}))


def _without(machine: Mechanism, gone: set[str]) -> dict[str, Formula]:
    """What numbers are made of, but for those of some elements."""
    return {
        name: formula
        for name, formula in machine.formulas.items()
        if name.partition(".")[0] not in gone
    }
