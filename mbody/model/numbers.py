"""Dimensions of a mechanism's changeable numbers, and the numbers that depend on them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.laws import Law
from mbody.laws.base import dimension_by
from mbody.model.element import Element, is_plain_field, listed, plain_field, unknown_name
from mbody.model.mechanism import Mechanism
from mbody.quantities.formula import evaluated, number
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of

#: Numbers of a body that its points and its mass centre do not depend on.
MASS = ("mass", "weight", "inertia")
#: Numbers of the ground on which nothing depends.
IMMOVABLE = tuple(f"ground.{key}" for key in ("mass", "inertia", "cg.x", "cg.y"))
#: Second moments of its mass.
SPREAD = ("spread.xx", "spread.yy", "spread.xy")


def number_in(
    mechanism: Mechanism, value: Any, dimension: str | Dimension, element: str, field: str
) -> float:
    """A number for an analysis, in the units and with the parameters of a mechanism.

    >>> from mbody import makers
    >>> number_in(makers.four_bar(1, 3, 2, 3.5), "20 ms", "time", "simulate", "until")
    0.02
    """
    given = number(value, dimension, element, field)
    return float(evaluated(given, mechanism.parameters.scope(), element, field))


def resolve_number(mechanism: Mechanism, name: str) -> tuple[str, Dimension | None]:
    """The number that an unknown's name means, by its dotted name, and its dimension; of a driver's
    motion the name itself.

    >>> from mbody import Torque, makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5)
    >>> machine.add(Torque("brake", "rocker", value=1.0))
    >>> resolve_number(machine, "brake")[0], resolve_number(machine, "motor.rate")[0]
    ('brake.value', 'motor.rate')
    """
    if name in mechanism.parameters:
        return name, dimension_named(mechanism, name)
    owner, _, key = name.partition(".")
    if owner not in mechanism and owner != "ground":
        known = listed(_common_unknowns(mechanism))
        raise ModelError(
            f"there is no number {brief(name)} to find (there are: {known}, and those of bodies "
            "and the ground)",
            name,
        )
    element = mechanism[owner]
    motion = getattr(element, "motion", {})
    if key in motion:
        return name, DIMENSIONS[motion[key]]
    numbers = {k: v for k, v in element.numbers().items() if k not in IMMOVABLE}
    for whole in (name, f"{name}.value"):
        if whole in numbers:
            return whole, dimension_named(mechanism, whole)
    if is_plain_field(element, key):
        raise ModelError(plain_field(element, key), name)
    names = [*numbers, *(f"{owner}.{k}" for k in motion)]
    raise unknown_name("number", name, names, use=" to find")


def _common_unknowns(mechanism: Mechanism) -> list[str]:
    """Parameters, accelerations of drivers, and loads and inputs of one number."""
    forces = (*mechanism.loads, *mechanism.inputs)
    loads = [load.name for load in forces if f"{load.name}.value" in load.numbers()]
    return [*mechanism.parameters, *(f"{d.name}.acceleration" for d in mechanism.drivers), *loads]


def dimension_named(mechanism: Mechanism, name: str) -> Dimension | None:
    """The dimension of a number by its dotted name, or of a parameter; None where it has none.

    >>> from mbody import makers
    >>> from mbody.quantities.units import name_of
    >>> machine = makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    >>> name_of(dimension_named(machine, "motor.law.speed"))
    'angular velocity'
    """
    if name in mechanism.parameters:
        return mechanism.parameters.scope().names[name].dimension
    owner, _, key = name.partition(".")
    element: Any = mechanism[owner]
    if element.role in ("input", "state", "quantity"):
        return _of_signal(element, key)
    for field in dataclasses.fields(element):
        if key == field.name and "dimension" in field.metadata:
            return dimension_of(field.metadata["dimension"])
        if "limits" in field.metadata and key.partition(".")[0] == field.name:
            return dimension_of(field.metadata["limits"])
        if "law" in field.metadata and key.partition(".")[0] == field.name:
            return _of_law(getattr(element, field.name), field, key.partition(".")[2])
    if element.role == "body" and key in MASS:
        return DIMENSIONS[key]
    if element.role == "body" and key in SPREAD:
        return DIMENSIONS["inertia"]
    if element.role == "coupling" and key.endswith(".factor"):
        return dimension_of(element.factor_of(element.parts[int(key.partition(".")[0])]))
    return DIMENSIONS["angle" if key.endswith(".angle") else "length"]


def _of_signal(element: Any, key: str) -> Dimension | None:
    """The dimension of a number of an input, an auxiliary state or a quantity; None of a plain
    number, and of the parts of a formula.
    """
    field, _, part = key.partition(".")
    if field == "value" and part:
        value = element.dimension or NUMBER
        return _of_numbers(element.value, value, DIMENSIONS["time"], part)
    found: Dimension | None = element.dimension if field not in ("rate", "formula") else None
    return found


def _of_law(law: Law, field: Any, key: str) -> Dimension | None:
    """The dimension of one number of a law of an element."""
    value, argument = (dimension_of(field.metadata[part]) for part in ("law", "of"))
    return _of_numbers(law, value, argument, key)


def _of_numbers(law: Law, value: Dimension, argument: Dimension, key: str) -> Dimension | None:
    """The dimension of one number of a law."""
    if not key:
        return value
    for part in dataclasses.fields(law):
        if part.name == key and "powers" in part.metadata:
            return dimension_by(part.metadata["powers"], value, argument)
    power = re.fullmatch(r"c(\d+)", key)
    if law.kind == "polynomial" and power:
        return value / argument ** int(power[1])
    return None


def moves_nothing(mechanism: Mechanism, name: str) -> bool:
    """Whether no position depends on a number: one of a load, an input or a state, or a mass.

    >>> from mbody import makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1))
    >>> moves_nothing(machine, "crank.mass"), moves_nothing(machine, "crank.A.x")
    (True, False)
    """
    if name not in mechanism.parameters:
        owner, _, key = name.partition(".")
        element: Element = mechanism[owner]
        own = element.role in ("load", "input", "state")
        return own or (element.role == "body" and key in MASS)
    if name in mechanism.fixed_parameters:
        return False
    scope = mechanism.parameters
    names, before = {name}, 0
    while len(names) > before:  # parameters that are made of it, and of those
        before = len(names)
        names |= {n for n, f in scope.items() if hasattr(f, "names") and f.names & names}
    made = {n for n, formula in mechanism.formulas.items() if formula.names & names}
    return all(moves_nothing(mechanism, n) for n in made)


def varied(values: Mapping[str, Any], element: Element, field: str = "law") -> bool:
    """Whether the designs of a batch differ in a law of a driver or a load, by the batch's numbers.

    >>> from mbody import assemble, makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    >>> two = assemble(machine).with_values({"motor.law.speed": [1.0, 2.0]})
    >>> varied(two.values, machine["motor"])
    True
    """
    name = f"{element.name}.{field}"
    own = (v for k, v in values.items() if k == name or k.startswith(f"{name}."))
    return any(np.ndim(value) for value in own)
