"""Notes on a description: what is allowed, but perhaps meant otherwise."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from typing import Any, cast

from mbody.laws import Table
from mbody.model.element import Element, listed
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula, FormulaError, Scope, Valued, read
from mbody.quantities.evaluate import has_units
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, dimension_of


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
