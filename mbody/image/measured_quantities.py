"""What is measured of an instant, as a program of what the kernels keep of it.

The histories of a result are computed by mbody's own functions (`mbody.solution`), from a record of
one instant whose numbers are traced. Drivers' motions are those of the bodies, and loads those of
their formulas: neither is among what the kernels keep.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.image.changeable import Changeable
from mbody.kernels.number_program import NumberProgram
from mbody.model.joints import Joint
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension
from mbody.solution.measures import quantity, valued
from mbody.solution.own_histories import own_history
from mbody.solution.places import ends
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import ORDER, TracedInstant, TracedRecord
from mbody.solution.tracing import Recording, Rule, Untraceable

__all__ = ["MeasuredProgram", "measured_quantities"]

#: What a measure of joints is that no result has: Python checks it when loops are closed.
MISFIT = "distance of the places, less the one by the radii"


@dataclass
class MeasuredProgram:
    """MeasuredProgram quantities of an image.

    Attributes
    ----------
    program : NumberProgram
        From what is kept of an instant, the time and the changeable numbers.
    names, units, of : list of str
        Of every target.
    notes : list of str
        What could not be recorded.
    """

    program: NumberProgram
    names: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    of: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def measured_quantities(changeable: Changeable) -> MeasuredProgram:
    """Of every body its motion; of joints, couplings, drivers and loads what results have of them;
    and the measures of the mechanism.
    """
    system = changeable.system
    rows = system.page_rows
    inputs = {f"row {n}": Rule(0.0) for n in range(rows)} | {"time": Rule(0.0)}
    # names of numbers, of which one may be that of a row
    inputs |= {f"number {name}": rule for name, rule in changeable.rules.items()}
    recording = Recording(inputs)
    traced = list(recording.inputs.values())
    numbers = dict(zip(changeable.rules, traced[rows + 1 :], strict=True))
    instant = TracedInstant(
        system=replace(system, values=changeable.values(numbers), plans={}),
        analysis="kinetostatics",
        t=traced[rows],  # type: ignore[arg-type]
        record=TracedRecord(traced[:rows]),  # type: ignore[arg-type]
        given=None,
    )
    found = MeasuredProgram(recording.program([]))
    targets: list[Any] = []
    for name, of, make in _wanted(instant):
        try:
            value, dimension, unit = make()
            if isinstance(value, np.ndarray):
                value = value[()]
            recording.place_of(value)
        except Exception as error:  # whatever Python does with a number that is none
            why = (
                str(error) if isinstance(error, ModelError | Untraceable) else type(error).__name__
            )
            found.notes.append(f"'{name}' is not among the measures of the image: {why}")
            continue
        targets.append(value)
        found.names.append(name)
        found.units.append(unit or system.mechanism.units.of(dimension))
        found.of.append(of)
    found.program = recording.program(targets)
    return found


def _wanted(instant: Solution) -> Iterator[tuple[str, str, Any]]:
    """Name, formula, and a function for value, dimension and unit (none for that of the system)."""
    machine = instant.mechanism

    def history(owner: str, key: str) -> Any:
        return lambda: (*quantity(instant, owner, key), "")

    for body in machine.bodies:
        for key in ORDER:
            yield f"{body.name}.{key}", f"{body.name}.{key}", history(body.name, key)
    own: tuple[Any, ...] = (*machine.states, *machine.inputs)
    for one in own:
        plain = one.dimension or NUMBER
        yield (
            one.name,
            one.name,
            lambda name=one.name, unit=plain: (own_history(instant, name), unit, ""),
        )
    known = {one.name for one in own}
    for element in (*machine.constraints, *machine.loads):
        for key in element.quantities():
            if f"{element.name}.{key}" in known:
                continue
            yield f"{element.name}.{key}", f"{element.name}.{key}", history(element.name, key)
    for joint in machine.joints:
        if joint.spaced:
            yield f"{joint.name}.misfit", MISFIT, functools.partial(_misfit, instant, joint)
    for name, measure in machine.measures.items():
        yield name, measure.of, lambda own=measure: valued(instant, own)


def _misfit(instant: Solution, joint: Joint) -> tuple[Any, Dimension, str]:
    """How far a joint is from where it fits, which others decide."""
    found, fitting = joint.fit(*ends(instant, joint))
    return found - fitting, DIMENSIONS["length"], ""
