"""The tables [optimize.NAME] of a model file: what `mbody optimize` is to make least or greatest.

They are no part of the description, which is the same with other tasks: they are kept beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from pydantic import Field

from mbody.errors import ModelError
from mbody.files.model import fields as of
from mbody.files.model.write_studies import StudyWriter
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import meant
from mbody.model.optimization_task import OptimizationTask
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS, NUMBER

__all__ = [
    "OptimizeIn",
    "in_radians",
    "keep_task",
    "optimization_tasks",
    "quantity",
    "task_formulas",
    "task_tables",
    "written_number",
]

#: Under which they are kept with the mechanism, so that copies of that have them too.
KEPT = "optimization_tasks"
#: Fields with numbers of the mechanism.
NUMBERS = ("by", "start")


#: A number of the mechanism: plain, or text with units and parameters.
quantity: Any = of.number(None)
time: Any = of.number(DIMENSIONS["time"])


class OptimizeIn(of.Strict):
    """What is to be least or greatest, by which numbers, within which limits."""

    minimize: str | list[str] = Field(default_factory=list, description="One aim, or two.")
    maximize: str | list[str] = Field(default_factory=list, description="One aim, or two.")
    by: dict[str, list[quantity]] = Field(description="[low, high] by number.")
    subject_to: str | list[str] = Field(
        default_factory=list, description="Limits such as 'peak(motor.effort) <= 20 N*m'."
    )
    analysis: str = Field(
        "kinetostatics", description="Or kinematics, statics, simulate: a motion over time."
    )
    over: str = Field("", description="'turn' or a driver; by default the instants of [ask].")
    instants: int | None = None
    turns: int | None = Field(None, description="Turns of a cycle, with over.")
    until: time = Field(None, description="The last time, of analysis = 'simulate'.")
    start: dict[str, quantity] | None = None
    starts: int | None = Field(None, description="How many searches.")
    seed: int | None = None
    points: int | None = Field(None, description="Designs of a Pareto front.")
    note: str = ""


def keep_task(mechanism: Mechanism, name: str, entry: Any, angle: str) -> None:
    """Keep what a file says of one optimization; plain angles are in the unit of the file.

    Raises
    ------
    ModelError
        For numbers that the mechanism does not have, and bounds that are no pair.
    """
    given = {key: getattr(entry, key) for key in entry.model_fields_set}
    for number, pair in given["by"].items():
        if len(pair) != 2:
            raise ModelError(f"by.{number} must be [low, high], not of {len(pair)} values", number)
    for key in NUMBERS:
        if given.get(key) is not None:
            given[key] = {n: in_radians(mechanism, n, v, angle) for n, v in given[key].items()}
    kept = vars(mechanism).setdefault(KEPT, {})
    kept[name] = OptimizationTask(**given)


def in_radians(mechanism: Mechanism, name: str, value: Any, angle: str) -> Any:
    """Plain degrees as radians, where the number is an angle."""
    if isinstance(value, list):
        return tuple(in_radians(mechanism, name, part, angle) for part in value)
    degrees = meant(mechanism, name)[1] == DIMENSIONS["angle"] and angle == "deg"
    return math.radians(value) if degrees and not isinstance(value, Formula) else value


def optimization_tasks(mechanism: Mechanism) -> Mapping[str, OptimizationTask]:
    """What a file said of optimizations of a mechanism, by name."""
    return vars(mechanism).get(KEPT, {})


def task_formulas(mechanism: Mechanism) -> Iterator[Formula]:
    """The texts among their numbers, each with the dimension that it has there."""
    for task in optimization_tasks(mechanism).values():
        for key in NUMBERS:
            for name, value in (getattr(task, key) or {}).items():
                dimension = meant(mechanism, name)[1] or NUMBER
                several = value if isinstance(value, tuple) else (value,)
                yield from (one.of(dimension) for one in several if isinstance(one, Formula))
        if isinstance(task.until, Formula):
            yield task.until.of(DIMENSIONS["time"])


def task_tables(writer: StudyWriter) -> dict[str, Any]:
    """The tables as a file has them, by name."""
    return {
        name: _table(writer, task) for name, task in optimization_tasks(writer.mechanism).items()
    }


def _table(writer: StudyWriter, task: OptimizationTask) -> dict[str, Any]:
    plain, table = OptimizationTask(), {}
    for one in fields(task):
        value = getattr(task, one.name)
        if value is None or value == getattr(plain, one.name):
            continue
        if one.name in NUMBERS:
            value = {name: written_number(writer, name, own) for name, own in value.items()}
        elif one.name == "until":
            value = writer.wanted(value, DIMENSIONS["time"])
        elif isinstance(value, tuple):
            value = list(value) if len(value) > 1 else value[0]
        table[one.name] = value
    return table


def written_number(writer: StudyWriter, name: str, value: Any) -> Any:
    """A number of the mechanism, or a pair of bounds, as a file has it."""
    dimension = meant(writer.mechanism, name)[1] or NUMBER
    if isinstance(value, tuple):
        return [writer.wanted(part, dimension) for part in value]
    return writer.wanted(value, dimension)
