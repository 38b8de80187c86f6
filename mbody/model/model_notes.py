"""Notes on a description: what is allowed, but perhaps meant otherwise."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from mbody.errors import ModelError
from mbody.laws import Law, Table
from mbody.model.element import Element, listed
from mbody.model.joints import Joint, Revolute
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula, FormulaError, Scope, Valued, read
from mbody.quantities.evaluate import has_units
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, dimension_of

if TYPE_CHECKING:
    from mbody.model.states import Described, State
    from mbody.model.stop import Stop


# -- Copies of a mechanism that are closed to additions: what systems keep ---------------------

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
    from mbody.model.states import measured_names, names_measured

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


def model_notes(mechanism: Mechanism) -> tuple[str, ...]:
    """Sentences for the user, each with the element, the number and what to do; they are among
    the notes of every analysis and leave its status.

    >>> from mbody import makers
    >>> model_notes(makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2)))
    ()
    """
    from mbody.model.traps import traps

    return (
        *mechanism.file_notes,
        *_tables(mechanism),
        *_formulas(mechanism),
        *traps(mechanism),
        *_unused(mechanism),
    )


def _tables(mechanism: Mechanism) -> Iterator[str]:
    """Splines that leave the range of their points, and motions whose rate jumps."""
    for element in mechanism:
        for field in _law_fields(cast(Any, type(element))):
            law = getattr(element, field.name)
            if isinstance(law, Table):
                argument, value = (dimension_of(field.metadata[key]) for key in ("of", "law"))
                yield from _table(mechanism.units, element, field.name, law, argument, value)


@functools.cache
def _law_fields(kind: Any) -> tuple[dataclasses.Field[Any], ...]:
    """Fields of a kind of element that are laws."""
    return tuple(field for field in dataclasses.fields(kind) if "law" in field.metadata)


def _table(
    units: UnitSystem,
    element: Element,
    field: str,
    table: Table,
    argument: Dimension,
    value: Dimension,
) -> Iterator[str]:
    beyond = table.beyond()
    low, high = (_number(end(table.y), value, units) for end in (min, max))
    # between dense points of a smooth motion it does so by less than a number shows
    if beyond is not None and (furthest := _number(beyond[1], value, units)) not in (low, high):
        yield (
            f"'{element.name}': the spline through the table of its {field} leaves the range of "
            f"its points, {low} to {high}: it goes to {furthest} at "
            f"{_number(beyond[0], argument, units)}; give "
            'interpolation = "pchip" or "linear", or more points'
        )
    if element.role == "driver" and table.interpolation == "linear" and len(table.x) > 2:
        yield (
            f"'{element.name}': the table of its {field} goes in straight lines, so that the rate "
            "jumps at every point: accelerations and forces between the points leave the jumps "
            'out; give interpolation = "spline"'
        )


def _formulas(mechanism: Mechanism) -> Iterator[str]:
    """Formulas without units where degrees and radians meet."""
    unit, scope = mechanism.units.time, mechanism.parameters.scope()
    for name, formula in mechanism.formulas.items():
        owner = name.partition(".")[0]
        if formula.angle == "deg" and _of_plain_angles(mechanism, formula):
            yield (
                f"'{owner}': in {formula.text!r}, which has no units, measured angles are in rad, "
                "while plain angles are in degrees: write units, as '-3 N*m/rad*(crank.angle - "
                "30 deg)'"
            )
        if formula.angle != "deg" or formula.has_units(scope) or not formula.variable:
            continue
        if formula.dimension == DIMENSIONS["angle"]:
            yield (
                f"'{owner}': {formula.text!r} has no units, so that its value is in degrees and "
                f"its rate in deg/{unit}: write units, as '30 deg + 25 rad/{unit} * t'"
            )
        elif formula.argument == DIMENSIONS["angle"]:
            yield (
                f"'{owner}': in {formula.text!r}, which has no units, x is in rad, while plain "
                "angles, as of a table, are in degrees: write units, as '3 N*m/rad * x'"
            )


def _of_plain_angles(mechanism: Mechanism, formula: Formula) -> bool:
    """Whether a formula adds plain numbers to measured angles: it has no units."""
    named = {one.name for one in mechanism.quantities}
    if not any("." in name or name in named for name in formula.names):
        return False
    from mbody.model.states import measured_names

    try:
        measured = measured_names(mechanism, formula.names)
    except FormulaError:  # of a state, which is refused where it is assembled
        return False
    scope = mechanism.parameters.scope()
    plain = {name: Valued(1.0) for name in measured}
    return DIMENSIONS["angle"] in measured.values() and not has_units(
        formula.tree, Scope(scope.system, {**scope.names, **plain})
    )


def _unused(mechanism: Mechanism) -> Iterator[str]:
    """Inputs and quantities that no formula of a load, a state, a measure or a controller names."""
    signals = *mechanism.inputs, *mechanism.quantities
    if not signals:
        return
    from mbody.model.states import rate_names

    used = {name for formula in mechanism.formulas.values() for name in formula.names}
    used |= {name for one in mechanism.described_states for name in rate_names(one)}
    used |= {name for measure in mechanism.measures.values() for name in measure.names}
    texts = [text for one in mechanism.controllers for text in one.reads]
    used |= {name for text in texts for name in read(text, None).names}
    for stop in mechanism.stops:
        used |= stop.names(mechanism.measures)
    for question in mechanism.questions.values():
        used |= question.names
    for one in signals:
        if one.name not in used:
            yield (
                f"nothing uses {one.role} '{one.name}': name it in the formula of a load or a "
                "state, or leave it out"
            )


def left_out(mechanism: Mechanism, analysis: str) -> tuple[str, ...]:
    """Notes of an analysis that follows no motion over time: contacts that are open in it."""
    names = [one.name for one in mechanism.contacts if not one.closed]
    limited = [joint.name for joint in mechanism.joints if _limits_left(mechanism, joint)]
    found = []
    if names:
        what = "contact" if len(names) == 1 else "contacts"
        found.append(
            f"{what} {listed(names)}: left out of {analysis}, as if open; simulate decides what is "
            "open, sticks and slides"
        )
    if limited:
        found.append(
            f"limits of {listed(limited)}: left out of {analysis}; simulate stops the joints there"
        )
    return tuple(found)


def _limits_left(mechanism: Mechanism, joint: Joint) -> bool:
    """Whether a joint has limits of which none is closed for good."""
    ends = [f"{joint.name}_{end}" for end in joint.limited]
    return bool(ends) and not any(end in mechanism for end in ends)


def with_friction(mechanism: Mechanism) -> list[str]:
    """Names of joints with friction, and of the contacts that are closed for good and may slip."""
    closed = [one for one in mechanism.contacts if one.closed and not one.rolls]
    names = [joint.name for joint in mechanism.joints if joint.has_friction]
    if not closed:
        return names
    from mbody.model.contact import Contact

    return [*names, *(one.name for one in closed if isinstance(one, Contact))]


def without_friction(mechanism: Mechanism, analysis: str) -> tuple[str, ...]:
    """Notes of an analysis that leaves out friction of joints.

    >>> from mbody import Body, Mechanism, Revolute
    >>> machine = Mechanism("pendulum")
    >>> machine.add(Body("rod"))
    >>> machine.add(Revolute("O", "ground", "rod", friction=0.1, pin_radius=0.01))
    >>> without_friction(machine, "equilibrium")[0][:41]
    "friction of 'O': left out of equilibrium,"
    """
    names = with_friction(mechanism)
    if not names:
        return ()
    return (
        f"friction of {listed(names)}: left out of {analysis}, which is that of smooth joints; "
        "around it there are positions at which friction holds, of which statics gives the bands "
        "of efforts",
    )


def kept_states(
    mechanism: Mechanism, starts: Mapping[str, float], analysis: str
) -> tuple[str, ...]:
    """Notes of an analysis that integrates nothing: the values that auxiliary states have in it.

    >>> from mbody import State, makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5)
    >>> machine.add(State("heat", rate="1 W - 2 W*heat", start=3.0))
    >>> kept_states(machine, {"heat": 3.0}, "statics")
    ("state 'heat' keeps its start, 3, in statics: simulate integrates it",)
    """
    from mbody.model.element import STEADY

    found = []
    for one in mechanism.states:
        if one.name not in starts or getattr(one, "accounts", False):
            continue
        unit = "" if one.dimension is None else mechanism.units.of(one.dimension)
        value = f"{starts[one.name]:.6g} {unit}".strip()
        what = "is not made steady" if one.start == STEADY else "keeps its start"
        found.append(f"state '{one.name}' {what}, {value}, in {analysis}: simulate integrates it")
    return tuple(found)


def _number(value: float, dimension: Dimension, units: UnitSystem) -> str:
    """A number with its unit, angles in degrees."""
    if dimension == DIMENSIONS["angle"]:
        return f"{value * 57.29577951308232:.6g} deg"
    return f"{value:.6g} {units.of(dimension)}".strip()
