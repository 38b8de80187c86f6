"""A mechanism with the numbers of a design, as its model file would have it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.core.tolerances import FILE_NUMBERS_SAME
from mbody.errors import ModelError, ModelWarning
from mbody.files.model.kept_text import in_unit_of, kept_text, shortest, unit_of_text
from mbody.files.model.problems import TEXT_ATTRIBUTE
from mbody.files.model.read import from_toml
from mbody.files.model.write import to_toml
from mbody.model.closed_mechanism import with_numbers, with_others
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named, resolve_number
from mbody.model.study import Instants
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS
from mbody.system.assembler import assemble

#: Digits of numbers that are found and have no band of their own.
DIGITS = 6


def described_with(
    machine: Mechanism,
    values: Mapping[str, float],
    guesses: Mapping[str, tuple[float, float, float]],
    ask: Instants | None = None,
) -> Mechanism:
    """A mechanism that is read from the file of one with other numbers: what `save` writes again.

    `values`: Of numbers and parameters by name, angles in rad. What is made of a parameter follows
      it; a number that followed a formula has its own now.
    `guesses`: First poses by body: x, y and angle in rad.
    `ask`: The instants that it asks for, where these change.
    Raises ModelError where the file would have other numbers than these.
    """
    parameters = {name: values[name] for name in values if name in machine.parameters}
    made = with_numbers(machine, {k: v for k, v in values.items() if k not in parameters})
    bodies = [replace(one, guess=guesses[one.name]) for one in made.bodies if one.name in guesses]
    made = with_others(made, set(), bodies)
    made.ask = made.ask if ask is None else ask
    texts = {name: _text(machine, name, value) for name, value in parameters.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        made = from_toml(to_toml(made), parameters=texts)
    vars(made).pop(TEXT_ATTRIBUTE)
    if (written := kept_text(machine)) is not None:
        vars(made)[TEXT_ATTRIBUTE] = written
    _check(made, values)
    return made


def file_unit(machine: Mechanism, name: str) -> float:
    """The unit that a number has in the file of a mechanism, in that of the mechanism.

    >>> from mbody import gallery
    >>> file_unit(gallery.load("norton_fourbar"), "crank.cg.angle")
    0.017453292519943295
    """
    whole, dimension = resolve_number(machine, name)
    formula = machine.parameters.get(whole) or machine.formulas.get(whole)
    text = formula.text if isinstance(formula, Formula) else ""
    size = (unit_of_text(text, machine.units) or ("", 1.0))[1]
    return math.radians(size) if dimension == DIMENSIONS["angle"] else size


def rounded(made: Mechanism, before: Mechanism) -> Mechanism:
    """A mechanism that an analysis made of another, its new numbers to `DIGITS` of the greatest of
    their element that measures the same, in the units of the file.
    """
    after, old = assemble(made).values, assemble(before).values
    new = {k: float(v) for k, v in after.items() if k not in old or float(old[k]) != float(v)}
    sizes: dict[Any, float] = {}
    for name, value in new.items():
        kind = name.partition(".")[0], dimension_named(made, name)
        sizes[kind] = max(sizes.get(kind, 0.0), abs(value))
    values = {}
    for name, value in new.items():
        unit = file_unit(before if name in old else made, name)
        size = sizes[name.partition(".")[0], dimension_named(made, name)] / unit
        places = DIGITS - 1 - math.floor(math.log10(size)) if size else 0
        values[name] = round(value / unit, places) * unit
    return described_with(made, values, {})


def _text(machine: Mechanism, name: str, value: float) -> Any:
    """Another value of a parameter in the unit that it is described in."""
    old = machine.parameters[name]
    if dimension_named(machine, name) == DIMENSIONS["angle"]:
        value = shortest(math.degrees(value))
    return in_unit_of(old.text if isinstance(old, Formula) else old, value, machine.units)


def same_number(one: Any, other: Any) -> bool:
    """Whether a number of a file is the one that was meant, but for the rounding of its text."""
    return bool(np.isclose(float(one), other, rtol=FILE_NUMBERS_SAME, atol=0.0))


def _check(made: Mechanism, values: Mapping[str, float]) -> None:
    """Refuse a mechanism whose numbers are not those that are wanted."""
    found = assemble(made).values
    wrong = [name for name, value in values.items() if not same_number(found[name], value)]
    if wrong:
        raise ModelError(
            f"the model file of '{made.name}' has no number of its own for {listed(wrong)}: "
            "name a parameter for it; run.system has the numbers of the design",
            wrong[0],
        )
