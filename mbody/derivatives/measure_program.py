"""A measure as a list of operations on what dual kernels keep of an instant.

The formula of a measure is evaluated once on traced numbers (`mbody.solution.tracing`); the list of
operations is then repeated in dual numbers, in microseconds instead of a tenth of a millisecond.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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
    program : NumberProgram
        Its inputs are what is read alone: the rows, then the numbers.
    rows : array (read,)
        The rows that are read.
    place : dict
        Of the numbers that are read, the place by name.
    memory : list of arrays (slots + 1, lanes)
        Free ones: the slots, and a row for what is found.
    """

    program: NumberProgram
    rows: np.ndarray
    place: dict[str, int]
    memory: list[np.ndarray] = field(default_factory=list, repr=False, compare=False)

    def evaluated(
        self, record: DualRecord, instant: int, values: Mapping[str, Any], names: Sequence[str]
    ) -> tuple[float, np.ndarray]:
        """The measure at one instant, and its derivatives by the named numbers; those of a first
        state change only the rows.
        """
        tangents, read = np.empty(len(names)), len(self.rows)
        try:
            # another thread may take the last one
            memory = self.memory.pop()
        except IndexError:
            memory = aligned(len(self.program.slots) + 1, LANES)
        slots, found = memory[:-1], memory[-1:]
        slots[:read, 0] = record.values[instant, self.rows]
        own = record.tangents[instant, self.rows]
        for first in range(0, max(len(names), 1), TANGENTS):
            part = names[first : first + TANGENTS]
            last = 1 + len(part)
            slots[:read, 1:last] = own[:, first : first + len(part)]
            slots[:read, last:] = 0.0
            for name, place in self.place.items():
                slots[place] = 0.0
                slots[place, 0] = values[name]
                if name in part:
                    slots[place, 1 + part.index(name)] = 1.0
            number_duals(self.program, slots, found)
            tangents[first : first + len(part)] = found[0, 1:last]
        value = float(found[0, 0])
        self.memory.append(memory)
        return value, tangents


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
    return _of_what_is_read(program, rows, list(numbers))


def _of_what_is_read(program: NumberProgram, rows: int, numbers: list[str]) -> MeasureProgram:
    """The program without the inputs that no operation reads."""
    inputs, slots = rows + len(numbers), len(program.slots)
    read = np.unique(np.concatenate([program.operations[:, 1:3].ravel(), program.targets]))
    read = read[read < inputs]
    kept = np.concatenate([read, np.arange(inputs, slots)])
    place = np.zeros(slots, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    operations = program.operations.copy()
    operations[:, 1:] = place[operations[:, 1:]]
    short = NumberProgram(
        slots=program.slots[kept],
        lowest=program.lowest[read],
        strict=program.strict[read],
        operations=operations,
        targets=place[program.targets],
    )
    named = {numbers[k - rows]: int(place[k]) for k in read[read >= rows].tolist()}
    return MeasureProgram(short, read[read < rows], named)


class _Traced(DualRecord):
    """The rows of one instant as traced numbers."""

    def __init__(self, like: DualRecord, rows: list[Any]) -> None:
        super().__init__(like.values, like.tangents, like.loads, like.size)
        self.rows = rows

    def take(self, row: int) -> Any:
        """One number."""
        return self.rows[row]
