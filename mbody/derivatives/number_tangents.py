"""Derivatives of the numbers that kernels take by the numbers of a description.

What makes the ones of the others is plain Python, as each element has it. It is recorded once for a
topology as a list of operations (`mbody.image.changeable`), which is repeated in dual numbers for
every set of numbers. Where that cannot be, as of numbers that an element looks at, the same Python
runs on dual numbers itself, some hundred times slower.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber, value
from mbody.core.duals import TANGENTS
from mbody.core.lanes import LANES, aligned
from mbody.image.changeable import Changeable, changeable_numbers
from mbody.kernels.number_program import NumberProgram, number_duals
from mbody.solution.tracing import Untraceable
from mbody.system.system import System

__all__ = [
    "RecordedNumbers",
    "dual_values",
    "number_tangents",
    "recorded_numbers",
    "tangents_by_elements",
]


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
    """The same by the elements themselves, from the dual `values` of `dual_values`."""
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

    Attributes
    ----------
    place : dict
        Place of every input by name.
    fixed : dict
        Numbers that are constants in it, with their values.
    outputs : int
        Rows of par and mass; what follows them is looked at by others.
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
    """What is recorded of this topology for these constants, made once; None where an element does
    what no list of operations repeats.
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
    others = system.values.keys() - place.keys() - changeable.follows.keys()
    fixed = {name: system.values[name] for name in others}
    outputs = len(system.par) + len(system.mass)
    return RecordedNumbers(changeable.program(), place, fixed, outputs)
