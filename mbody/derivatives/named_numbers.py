"""The numbers by which derivatives are taken: which there are, and their units."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber, value
from mbody.core.duals import TANGENTS
from mbody.core.lanes import LANES, aligned
from mbody.core.recorded_numbers import Untraceable
from mbody.core.tolerances import QUANTITY_ROUNDING
from mbody.errors import ModelError, brief
from mbody.image.changeable import Changeable, changeable_numbers
from mbody.kernels.number_program import NumberProgram, number_duals
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import IMMOVABLE, dimension_named
from mbody.model.simulation import STATE
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension
from mbody.system.system import System


def start_numbers(mechanism: Mechanism) -> dict[str, str]:
    """Numbers that a description prescribes of the beginning, "start.crank.angle", with what they
    measure.
    """
    given = {} if mechanism.simulation is None else mechanism.simulation.start
    return {f"start.{body}.{key}": STATE[key] for body, state in given.items() for key in state}


def checked_names(
    system: System, by: Sequence[str] | str | None, verb: str = "gradient", *, starts: bool = False
) -> dict[str, str]:
    """Dotted names of the requested numbers by the names that were given; by default of all that
    have no formula. Sentences begin with the verb; `starts`: numbers of a beginning may be named.
    """
    if by is None:
        left = {*system.mechanism.fixed_parameters, *system.formulas}
        # a delay that is zero may only be more
        delays = (f"{one.name}.delay" for one in system.mechanism.controllers)
        left |= {name for name in delays if not system.values[name]}
        left |= set(IMMOVABLE)
        return {name: name for name in system.values if name not in left}
    if not isinstance(by, str | Sequence):
        raise ModelError(f'{verb}: by must be names such as ["crank.A.x"], not {brief(by)}')
    found: dict[str, str] = {}
    begins = start_numbers(system.mechanism) if starts else {}
    for name in [by] if isinstance(by, str) else by:
        own = name if name in begins else _checked(system, name, verb)
        if own in found.values():
            raise ModelError(f"{verb}: '{name}' is given twice in by: give it once", name)
        found[name] = own
    if not found:
        raise ModelError(f"{verb}: by is empty: name at least one number, or leave it out")
    return found


def _checked(system: System, given: Any, verb: str) -> str:
    if not isinstance(given, str):
        raise ModelError(
            f'{verb}: by must be names such as ["crank.A.x"], not {brief(given)}', str(given)
        )
    name = system.number_name(given)
    if name not in system.values:
        raise ModelError(_unknown(system, name), name)
    if name in system.mechanism.fixed_parameters:
        raise ModelError(
            f"parameter '{name}' is used in a table, a program, a guess or g of "
            f"'{system.mechanism.name}', which a system cannot change: there is no derivative by "
            "it; describe the mechanism with another value",
            name,
        )
    formula = system.formulas.get(name)
    if formula is not None:
        used = listed(sorted(system.mechanism.parameters.used_by(formula)))
        raise ModelError(
            f"'{name}' is made by the formula '{formula.text}': name {used} instead, or give "
            f"'{name}' a number of its own by with_values",
            name,
        )
    return name


def _unknown(system: System, name: str) -> str:
    known = list(system.values)
    owner = name.partition(".")[0]
    own = [one for one in known if one.partition(".")[0] == owner and "." in one]
    close = difflib.get_close_matches(name, own or known, n=6, cutoff=0.5 if own else 0.6)
    machine = system.mechanism
    # of the mass of the ground nothing depends
    found = [*machine.parameters, *(one for one in known if not one.startswith("ground."))]
    there = close or own[:12] or list(dict.fromkeys(found))[:12]
    return f"there is no number {brief(name)} (there are: {listed(there)})"


def influential(
    system: System, names: Sequence[str], value: np.ndarray, row: np.ndarray
) -> np.ndarray:
    """Which of the numbers change a quantity by more than rounding, if they change by their own
    size, (names,): from its values and derivatives (…, names).
    """
    sizes = number_sizes(system, names)
    effect = np.abs(np.nan_to_num(row)) * sizes
    greatest = np.abs(value).max(initial=0.0)
    most = effect.reshape(-1, len(names)).max(axis=0, initial=0.0)
    # a number that is zero has no size: its derivative beside those of the others
    plain = np.abs(np.nan_to_num(row)).reshape(-1, len(names)).max(axis=0, initial=0.0)
    return np.where(
        sizes == 0.0,
        plain > QUANTITY_ROUNDING * plain.max(initial=0.0),
        most > QUANTITY_ROUNDING * greatest,
    )


def number_sizes(system: System, names: Sequence[str]) -> np.ndarray:
    """By how much a number may change, (names,): its own size, of lengths that of the mechanism at
    least; 0 of others that are zero.
    """
    sizes = np.array([abs(float(system.values.get(name, 1.0))) for name in names])
    lengths = [unit_of(system.mechanism, name) == system.mechanism.units.length for name in names]
    return np.where(lengths, np.maximum(sizes, system.length), sizes)


def dimension_of_number(mechanism: Mechanism, name: str) -> Dimension:
    """Dimension of a number."""
    begins = start_numbers(mechanism)
    if name in begins:
        return DIMENSIONS[begins[name]]
    owner = name.partition(".")[0]
    if owner not in (*mechanism.parameters, "ground") and owner not in mechanism:
        return NUMBER  # of a driver that was released
    return dimension_named(mechanism, name) or NUMBER


def unit_of(mechanism: Mechanism, name: str) -> str:
    """Unit of a number, empty of a plain one."""
    return mechanism.units.of(dimension_of_number(mechanism, name))


# -- Derivatives of the numbers that kernels take by the numbers of a description --------------
# What makes the ones of the others is plain Python, as each element has it. It is recorded once for
# a topology as a list of operations (`mbody.image.changeable`), which is repeated in dual numbers
# for every set of numbers. Where that cannot be, as of numbers that an element looks at, the same
# Python runs on dual numbers itself, some hundred times slower.


def dual_values(system: System, names: Sequence[str]) -> dict[str, Any]:
    """All numbers of a system by dotted name; those that depend on the named ones are dual."""
    count = len(names)
    parameters = system.mechanism.parameters
    found: dict[str, Any] = dict(system.values)
    for name, row in zip(names, np.eye(count), strict=True):
        found[name] = DualNumber(float(system.values[name]), row)
    if not any(name in parameters for name in names):
        return found
    made = {name: formula for name, formula in system.formulas.items() if name not in names}
    own = {name: found[name] for name in parameters if name not in made}
    scope = parameters.scope(own)
    for name, formula in made.items():
        number = scope.names[name].value if name in parameters else formula.value(scope)
        if isinstance(number, DualNumber):
            found[name] = number
    return found


def number_tangents(system: System, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the rows of `par` and `mass` by the named numbers: (rows, names) each."""
    recorded = recorded_numbers(system)
    if recorded is None or not recorded.has(names):
        return tangents_by_elements(system, dual_values(system, names), len(names))
    rows, (_, tangents) = len(system.par), recorded.evaluated(system.values, names)
    return tangents[:rows], tangents[rows:]


def tangents_by_elements(
    system: System, values: dict[str, Any], count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of parameters and masses by the elements themselves, from the dual `values` of
    `dual_values`.
    """
    par, mass = system.kernel_numbers(values)
    return _tangents(par, count), _tangents(mass, count)


def _tangents(rows: list[Any], count: int) -> np.ndarray:
    found = np.zeros((len(rows), count))
    for row, number in zip(found, rows, strict=True):
        if isinstance(number, DualNumber):
            row[:] = number.tangents
        else:
            float(value(number))
    return found


@dataclass(frozen=True)
class RecordedNumbers:
    """The operations from the numbers of a description to those of the kernels.

    `place`: Place of every input by name.
    `fixed`: Numbers that are constants in it, with their values.
    `outputs`: Rows of par and mass; what follows them is looked at by others.
    """

    program: NumberProgram
    place: dict[str, int]
    fixed: dict[str, float]
    outputs: int

    def has(self, names: Sequence[str]) -> bool:
        """Whether all of these are inputs."""
        return all(name in self.place for name in names)

    def evaluated(
        self, values: Mapping[str, Any], names: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray]:
        """The rows of par, then of mass, (rows,), and their derivatives by the named numbers,
        (rows, names).
        """
        tangents = np.zeros((self.outputs, len(names)))
        found, slots = aligned(self.outputs, LANES), aligned(len(self.program.slots), LANES)
        slots[: len(self.place), 0] = [values[name] for name in self.place]
        for first in range(0, max(len(names), 1), TANGENTS):
            part = names[first : first + TANGENTS]
            slots[: len(self.place), 1:] = 0.0
            slots[[self.place[name] for name in part], range(1, 1 + len(part))] = 1.0
            number_duals(self.program, slots, found)
            tangents[:, first : first + len(part)] = found[:, 1 : 1 + len(part)]
        return found[:, 0].copy(), tangents


def recorded_numbers(system: System) -> RecordedNumbers | None:
    """Recorded operations that make the numbers of this topology, recorded once; None where an
    element does something that cannot be recorded.
    """
    key = ("number tangents", frozenset(system.formulas))
    plans: dict[Any, Any] = system.plans
    found: RecordedNumbers | None = plans.get(key)
    if found is not None and all(system.values[n] == x for n, x in found.fixed.items()):
        return found
    if key in plans and found is None:
        return None
    try:
        found = _record(system, changeable_numbers(system))
    except Untraceable:
        found = None
    plans[key] = found
    return found


def _record(system: System, changeable: Changeable) -> RecordedNumbers:
    place = {name: n for n, name in enumerate(changeable.rules)}
    others = system.values.keys() - place.keys() - changeable.dependent.keys()
    fixed = {name: system.values[name] for name in others}
    outputs = len(system.par) + len(system.mass)
    return RecordedNumbers(changeable.program(), place, fixed, outputs)
