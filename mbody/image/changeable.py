"""Which numbers of a mechanism can be changed in its image, and the program that makes the numbers
of the kernels from them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core.recorded_numbers import Untraceable
from mbody.kernels.number_program import NumberProgram
from mbody.laws import Constant
from mbody.model.element import Element, Numbers, listed
from mbody.model.joints import Joint
from mbody.solution.tracing import Recording, Rule
from mbody.system.formula_steps import driver_inputs
from mbody.system.system import System, polar_points

FIXED = "it is used in a table, a program, a guess or g, which an image cannot change"
BEGINNING = "a motion begins there: the start of the state is set by the name of the state"
SIZE = "the error of a state is relative to it, which an image cannot change"


@dataclass
class Changeable:
    """The changeable numbers of a system.

    `rules`: Value and rule of every number that an image takes, by dotted name: its inputs in
      order.
    `dependent`: Of every number that follows from parameters, what it follows from.
    `fixed`: Of every other number why it cannot be changed.
    """

    system: System
    rules: dict[str, Rule] = field(default_factory=dict)
    dependent: dict[str, frozenset[str]] = field(default_factory=dict)
    fixed: dict[str, str] = field(default_factory=dict)

    def values(self, inputs: dict[str, Any]) -> dict[str, Any]:
        """All numbers of the system by dotted name; those that an image takes are `inputs`."""
        system = self.system
        parameters = system.mechanism.parameters
        found = {**system.values, **inputs}
        own = {name: found[name] for name in parameters if name not in self.dependent}
        scope = parameters.scope(own)
        for name in self.dependent:
            if name in parameters:
                found[name] = scope.names[name].value
            elif self.dependent[name] & inputs.keys():
                found[name] = system.formulas[name].value(scope)
        return found

    def not_changeable(self) -> dict[str, str]:
        """Why each of the other numbers cannot be changed."""
        made = {
            name: f"it follows from {listed(sorted(sources))}"
            for name, sources in self.dependent.items()
        }
        return self.fixed | made

    def program(self) -> NumberProgram:
        """From the numbers to the rows of par, then of mass; and what must be finite besides, for
        the numbers that follow to be allowed.
        """
        recording = Recording(self.rules)
        values = self.values(dict(recording.inputs))
        par, mass = self.system.kernel_numbers(values)
        checks = []
        for name in self.dependent:
            value, sign = values[name], self.system.rule(name)[0]
            # roots and logarithms of what is not allowed are no numbers
            checks.append(value)
            if sign:
                checks.append((np.log if sign == "positive" else np.sqrt)(value))
        return recording.program([*par, *mass, *checks])


def changeable_numbers(system: System) -> Changeable:
    """The numbers of a system that its image takes: those of which all that the kernels need of
    each element can be recorded.
    """
    machine = system.mechanism
    parameters = machine.parameters
    found = Changeable(system)
    found.fixed = {name: FIXED for name in sorted(machine.fixed_parameters)}
    own = {state.start_number: BEGINNING for state in machine.states}
    own |= {f"{state.name}.size": SIZE for state in machine.states}
    own = {name: why for name, why in own.items() if name in system.values}
    found.fixed |= own
    free = {*own, *input_numbers(system)}
    for name, formula in system.formulas.items():
        if name in free:  # a number of its own, whatever it was made of
            continue
        found.dependent[name] = _parameters_of(system, parameters.used_by(formula))
    for joint in machine.joints:
        if type(joint).refuse is not Joint.refuse:
            why = f"'{joint.name}' is checked as a whole when the mechanism is described"
            read = _Read(dict(system.values))
            joint.refuse(_numbers(system, read), machine.units.length)
            _fix(found, read.names, why)
    while True:
        found.rules = {
            name: Rule(float(value), system.rule(name)[0])
            for name, value in system.values.items()
            if name not in found.fixed and name not in found.dependent
        }
        problem = _untraceable(found)
        if problem is None:
            return found
        _fix(found, *problem)


def input_numbers(system: System) -> dict[str, str]:
    """Of every input that is a constant, and so may be set, the name by that of its number; the
    position or rate of a driver that followed it would jump.
    """
    constant = [one.name for one in system.mechanism.inputs if isinstance(one.value, Constant)]
    drivers = driver_inputs(system.mechanism, system.numbers)
    return {f"{name}.value": name for name in constant if name not in drivers}


def _parameters_of(system: System, names: Iterable[str]) -> frozenset[str]:
    """The parameters of a formula that are no formulas themselves."""
    parameters, whole = system.mechanism.parameters, set[str]()
    for name in names:
        formula = system.formulas.get(name)
        if formula is None:
            whole.add(name)
        else:
            whole |= _parameters_of(system, parameters.used_by(formula))
    return frozenset(whole)


def _fix(found: Changeable, names: Iterable[str], why: str) -> None:
    """Numbers that cannot be changed, with all that they follow from."""
    for name in names:
        for one in (name, *sorted(found.dependent.get(name, ()))):
            if one not in found.dependent:
                found.fixed.setdefault(one, why)


def _untraceable(found: Changeable) -> tuple[set[str], str] | None:
    """Numbers, with the reason, that must be constants for one more element to be recorded."""
    system = found.system
    recording = Recording(found.rules)
    values = found.values(dict(recording.inputs))
    for element, make in _makers(system):
        read = _Read(values)
        try:
            _floats(make(_numbers(system, read)), recording)
        except Exception as error:  # whatever Python does with a number that is none
            text = str(error) if isinstance(error, Untraceable) else type(error).__name__
            own = {name for name in read.names if _is_traced(values[name])}
            return own, f"'{element}' needs its value before an image is made ({text})"
    return None


def _makers(system: System) -> Iterable[tuple[str, Callable[[Numbers], Any]]]:
    """By name what every element makes of its numbers."""
    for constraint in system.mechanism.constraints:
        yield constraint.name, constraint.primitives
        if "j" in constraint.places():
            yield constraint.name, functools.partial(_position_on_j, constraint)
    for load in system.mechanism.loads:
        yield load.name, load.actions


def _position_on_j(element: Element, at: Numbers) -> Any:
    """The place on j, where a reaction is reported."""
    return at.arm(element, "j")


def _floats(made: Any, recording: Recording) -> None:
    """Refuse what an element made, where a part is no number."""
    for one in made:
        if not hasattr(one, "parameters"):
            recording.place_of(one)
            continue
        laws = (one.law, getattr(one, "signal", None), *getattr(one, "signals", ()))
        numbers = [*one.parameters]
        for law in laws:
            numbers += [] if law is None else law.parameters
        for number in numbers:
            recording.place_of(number)


def _is_traced(value: Any) -> bool:
    return not isinstance(value, float | int)


class _Read(dict[str, Any]):
    """Numbers by name, and which of them were read."""

    def __init__(self, values: dict[str, Any]) -> None:
        super().__init__(values)
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> Any:
        self.names.add(name)
        return super().__getitem__(name)


def _numbers(system: System, values: dict[str, Any]) -> Numbers:
    return Numbers(values, polar_points(system.mechanism), system.mechanism.bodies)
