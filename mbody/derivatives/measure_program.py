"""A measure as a list of operations on what dual kernels keep of an instant.

The formula of a measure is evaluated once on traced numbers (`mbody.solution.tracing`); the list of
operations is then repeated in dual numbers, in microseconds instead of a tenth of a millisecond.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.duals import TANGENTS
from mbody.core.lanes import LANES, aligned
from mbody.derivatives.dual_solution import DualRecord, dual_solution
from mbody.errors import ModelError
from mbody.image.changeable import changeable_numbers
from mbody.kernels.number_program import NumberProgram, number_duals
from mbody.model.study import Measure
from mbody.solution.measures import valued
from mbody.solution.solution import Solution
from mbody.solution.tracing import Recording, Rule, Untraceable

__all__ = ["MeasureProgram", "recorded_measure"]


@dataclass(frozen=True)
class MeasureProgram:
    """Operations from the rows of an instant, and the numbers of the description, to a measure.

    Attributes
    ----------
    rows : int
        Rows of an instant, its first inputs.
    place : dict
        Of the numbers, which follow, the place by name.
    """

    program: NumberProgram
    rows: int
    place: dict[str, int]

    def evaluated(
        self, record: DualRecord, instant: int, values: Mapping[str, Any], names: Sequence[str]
    ) -> tuple[float, np.ndarray]:
        """The measure at one instant, and its derivatives by the named numbers; those of a first
        state change only the rows.
        """
        tangents = np.zeros(len(names))
        found, slots = aligned(1, LANES), aligned(len(self.program.slots), LANES)
        slots[: self.rows, 0] = record.values[instant]
        last = self.rows + len(self.place)
        slots[self.rows : last, 0] = [values[name] for name in self.place]
        for first in range(0, max(len(names), 1), TANGENTS):
            part = names[first : first + TANGENTS]
            width = slice(1, 1 + len(part))
            slots[: self.rows, width] = record.tangents[instant, :, first : first + len(part)]
            slots[: self.rows, 1 + len(part) :] = 0.0
            slots[self.rows : last, 1:] = 0.0
            for lane, name in enumerate(part, 1):
                if name in self.place:
                    slots[self.place[name], lane] = 1.0
            number_duals(self.program, slots, found)
            tangents[first : first + len(part)] = found[0, width]
        return float(found[0, 0]), tangents


def recorded_measure(
    run: Solution, record: DualRecord, measure: Measure, names: Sequence[str]
) -> MeasureProgram | None:
    """The program of a measure without its reduction; None where what it needs cannot be recorded,
    or one of the named numbers is no input of it.
    """
    changeable = changeable_numbers(run.system)
    if not all(name in changeable.rules for name in names if name in run.system.values):
        return None
    rows = record.values.shape[1]
    inputs = {f"row {n}": Rule(0.0) for n in range(rows)}
    # names of numbers, of which one may be that of a row
    inputs |= {f"number {name}": rule for name, rule in changeable.rules.items()}
    recording = Recording(inputs)
    traced = list(recording.inputs.values())
    numbers = dict(zip(changeable.rules, traced[rows:], strict=True))
    found = dual_solution(run, changeable.values(numbers), _Traced(record, traced[:rows]))
    try:
        program = recording.program([valued(found, measure)[0]])
    except (Untraceable, ModelError, TypeError):
        return None
    return MeasureProgram(program, rows, {n: rows + k for k, n in enumerate(numbers)})


class _Traced(DualRecord):
    """The rows of one instant as traced numbers."""

    def __init__(self, like: DualRecord, rows: list[Any]) -> None:
        super().__init__(like.values, like.tangents, like.loads, like.size)
        self.rows = rows

    def take(self, row: int) -> Any:
        """One number."""
        return self.rows[row]
