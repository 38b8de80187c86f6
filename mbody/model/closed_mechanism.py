"""Copies of a mechanism that are closed to additions: what systems keep."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.laws import Law
from mbody.model.element import Element
from mbody.model.joints import Joint, Revolute
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula, FormulaError, read

if TYPE_CHECKING:
    from mbody.model.states import Described, State
    from mbody.model.stop import Stop


# -- Formulas that are compiled when a mechanism is closed, for they may measure all that it has


def compiled_state(machine: Described, state: State) -> tuple[State, dict[str, Formula]]:
    """An auxiliary state with its rate as a law, and what the numbers of that were made of."""
    from mbody.model.states import measured_names

    names = state.rate.names if isinstance(state.rate, Formula) else frozenset[str]()
    try:
        quantities = measured_names(machine, names)
    except FormulaError as error:
        raise ModelError(f"'{state.name}': rate: {error}", state.name) from None
    return state.compiled(machine.parameters.scope(), quantities)


def compiled_stop(machine: Described, stop: Stop) -> tuple[Stop, dict[str, Formula]]:
    """A stop with its formula as a law, and what the numbers of that were made of."""
    from mbody.model.named_quantities import names_measured
    from mbody.model.states import measured_names

    try:
        quantities = measured_names(machine, stop.names(machine.measures))
    except FormulaError as error:
        raise ModelError(f"stop '{stop.name}': {error}", stop.name) from None
    read = names_measured(machine, quantities) - {"t"}
    return stop.compiled(machine.parameters.scope(), machine.measures, quantities, read)


def snapshot(machine: Mechanism, *, groups: bool = False) -> Mechanism:
    """The mechanism as it is now, closed to additions: what a system keeps; with single contacts in
    the place of their groups, unless these are to stay.
    """
    if machine.is_closed:
        return machine
    kept = machine if groups else _with_single_contacts(machine)
    for one in kept.quantities:
        one.refuse_measure(kept.measures)
    elements, formulas = {one.name: one for one in kept}, dict(kept.formulas)
    for state in kept.described_states:
        elements[state.name], own = compiled_state(kept, state)
        formulas |= own
    for stop in kept.stops:
        elements[stop.name], own = compiled_stop(kept, stop)
        formulas |= own
    return kept.closed_with(elements.values(), formulas)


def _with_single_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism with contacts in the place of their groups."""
    if not machine.groups:
        return machine
    gone = {group.name for group in machine.groups}
    remaining = [one for one in machine if one.name not in gone]
    kept = machine.closed_with(remaining, _without(machine, gone)).copied()
    for group in machine.groups:
        own = machine.described_group(group.name)
        kept.add(*own.contacts((*machine.bodies, machine.ground)))
    return kept


def without_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism without contacts, ropes and groups of contacts, closed to additions."""
    gone = {one.name for one in (*machine.contacts, *machine.groups)}
    remaining = [one for one in machine if one.name not in gone]
    return machine.closed_with(remaining, _without(machine, gone))


def with_others(machine: Mechanism, gone: set[str], others: Iterable[Element]) -> Mechanism:
    """The mechanism with other elements, in the place of those of their names or else at the end,
    and without those that are gone, closed to additions; all numbers follow what they followed.
    """
    new = {one.name: one for one in others}
    ground: Any = new.pop("ground", machine.ground)
    old = {one.name: one for one in machine if one.name in new or one.name not in gone}
    made = machine.closed_with((old | new).values())
    made.ground = ground
    return made


def with_element(machine: Mechanism, element: Element) -> Mechanism:
    """The mechanism with another element in the place of the one of that name, closed to additions;
    its numbers follow no parameters.
    """
    elements = {one.name: one for one in machine} | {element.name: element}
    return machine.closed_with(elements.values(), _without(machine, {element.name}))


def _without(machine: Mechanism, gone: set[str]) -> dict[str, Formula]:
    """Formulas of the numbers, except those of some elements."""
    return {
        name: formula
        for name, formula in machine.formulas.items()
        if name.partition(".")[0] not in gone
    }


# -- A mechanism with other numbers in some of its elements ------------------------------------


def with_changed(machine: Mechanism, elements: Iterable[Element], keys: Iterable[str]) -> Mechanism:
    """The mechanism with other elements in the place of those of their names. Their numbers that
    begin with one of the keys, such as ``"mass"``, follow no formulas any more; others do.

    >>> from dataclasses import replace
    >>> from mbody import makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5)
    >>> with_changed(machine, [replace(machine["crank"], mass=2.0)], ["mass"])["crank"].mass
    2.0
    """
    new = list(elements)
    made = with_others(machine, set(), new)
    prefixes = tuple(f"{element.name}.{key}" for element in new for key in keys)
    kept = {k: formula for k, formula in machine.formulas.items() if not k.startswith(prefixes)}
    made.formulas = kept if prefixes else dict(machine.formulas)
    return made.copied()


def with_numbers(machine: Mechanism, values: Mapping[str, float]) -> Mechanism:
    """The mechanism with other numbers, by the dotted names that a system has for them; what was
    made of parameters follows them still.

    >>> from mbody import makers
    >>> machine = with_numbers(makers.four_bar(1, 3, 2, 3.5), {"crank.A.x": 1.5, "crank.mass": 2.0})
    >>> machine["crank"].points["A"], machine["crank"].mass
    ((1.5, 0.0), 2.0)
    """
    changed: dict[str, Element] = {}
    keys: list[str] = []
    for name, value in values.items():
        owner, _, key = name.partition(".")
        element = changed.get(owner) or (machine.ground if owner == "ground" else machine[owner])
        changed[owner] = _with_number(element, key, value)
        keys.append(key)
    return with_changed(machine, changed.values(), keys)


def _with_number(element: Element, key: str, value: float) -> Element:
    """The element with another number."""
    field, _, own = key.partition(".")
    if isinstance(law := getattr(element, field, None), Law):
        other: Any = law.with_numbers({**law.numbers(), own or "value": value})
        return replace(element, **{field: other})
    if field == key and any(one.name == key for one in fields(element)):
        changes: Any = {key: value}
        return replace(element, **changes)
    # each number is a variable of its own, so that the name leads to its place
    count = itertools.count()
    marked = _with_floats(element, lambda _: read(f"place_{next(count)}", None))
    named = str(getattr(marked.numbers().get(f"{element.name}.{key}"), "text", ""))
    if not re.fullmatch(r"place_\d+", named):
        raise ModelError(
            f"'{element.name}.{key}' is made of other numbers of '{element.name}' here: change "
            "these, or give it a parameter",
            element.name,
        )
    count = itertools.count()
    return _with_floats(element, lambda old: value if f"place_{next(count)}" == named else old)


def _with_floats(value: Any, instead: Callable[[float], Any]) -> Any:
    """The value with every float replaced, but for those of laws."""
    if isinstance(value, float):
        return instead(value)
    if isinstance(value, (tuple, list)):
        return type(value)(_with_floats(part, instead) for part in value)
    if isinstance(value, dict):
        return {key: _with_floats(part, instead) for key, part in value.items()}
    if isinstance(value, Law) or not is_dataclass(value) or isinstance(value, type):
        return value
    parts = {one.name: getattr(value, one.name) for one in fields(value) if one.init}
    return replace(value, **{name: _with_floats(one, instead) for name, one in parts.items()})


def may_be_one_sided(machine: Mechanism) -> bool:
    """Whether something in a mechanism may hold in one direction only, as a contact or a rope."""
    own = any(type(joint).normal is not Joint.normal for joint in machine.joints)
    return own or bool(machine.contacts or machine.couplings)


# -- Moving points, which results show ---------------------------------------------------------


def moving_points(mechanism: Mechanism) -> list[str]:
    """Points of links that are not pinned to the ground, such as "coupler.P"; of a pin that on the
    first of its links.

    >>> import mbody
    >>> moving_points(mbody.makers.four_bar(1, 3, 2, 3.5))
    ['crank.A', 'coupler.B']
    """
    order = {name: n for n, name in enumerate(["ground", *(b.name for b in mechanism.bodies)])}
    again: set[str] = set()
    for joint in mechanism.joints:
        if isinstance(joint, Revolute):
            sides = sorted((joint.i, joint.j), key=lambda marker: order[marker.body])
            names = [f"{marker.body}.{marker.point}" for marker in sides]
            again |= set(names if sides[0].body == "ground" else names[1:])
    names = [f"{body.name}.{point}" for body in mechanism.bodies for point in body.points]
    return [name for name in names if name not in again]
