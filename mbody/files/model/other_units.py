"""Conversion of a mechanism to another unit system."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from mbody.core.tolerances import FILE_NUMBERS_SAME
from mbody.errors import ModelError, ModelWarning
from mbody.files.model.fields import plain
from mbody.files.model.problems import TEXT_ATTRIBUTE
from mbody.files.model.read import built, from_toml
from mbody.files.model.write import Writer, in_unit_of, kept_text, shortest, to_toml, unit_of_text
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_numbers, with_others
from mbody.model.numbers import dimension_named, resolve_number
from mbody.model.simulation import Instants
from mbody.model.states import measured_names
from mbody.quantities import VARIABLES, Formula, FormulaError, Scope, evaluate
from mbody.quantities.evaluate import PLAIN_FUNCTIONS, Valued, has_units
from mbody.quantities.parse import Call, walk
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, unit_system
from mbody.system.assembler import assemble

# -- A mechanism with the numbers of a design, as its model file would have it -----------------

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


def in_units(mechanism: Mechanism, units: str | UnitSystem) -> Mechanism:
    """The mechanism with every number in another unit system: results come out in it.

    Parameters
    ----------
    mechanism : Mechanism
        Without Python code, as for a model file.
    units : str
        Name of the unit system.

    Raises
    ------
    ModelError
        For a unit system that there is not, Python code, or a formula of t whose plain numbers
        belong to the old units.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, units="ft-lbf-s")
    >>> round(in_units(machine, "in-lbf-s")["rocker"].points["B"][0], 9)
    24.0
    """
    system = unit_system(units)
    if system == mechanism.units:
        return mechanism
    made = built(_Converter(mechanism, system).whole())
    made.file_notes = mechanism.file_notes
    return made


class _Converter(Writer):
    """Writer of a mechanism in another unit system."""

    def __init__(self, mechanism: Mechanism, units: UnitSystem) -> None:
        super().__init__(mechanism)
        self.units = units

    def written(self, value: float, dimension: Dimension) -> Any:
        """A float in the new units; exact where both units are."""
        ratio = self.mechanism.units.unit(dimension).ratio / self.units.unit(dimension).ratio
        try:
            converted = value if ratio == 1 else float(Fraction(value) * ratio)
        except OverflowError:
            unit = self.units.of(dimension)
            raise ModelError(f"{value:g} is too large a number in {unit}: choose others") from None
        return super().written(converted, dimension)

    def number(self, name: str, value: float, dimension: Dimension) -> Any:
        """The text where it has units, so that it still follows its parameters; of plain numbers,
        which belong to the old units, its value.
        """
        formula = self.mechanism.formulas.get(name)
        if formula is not None and formula.has_units(self.scope):
            return super().number(name, value, dimension)
        return self.written(value, dimension)

    def parameter(self, name: str) -> Any:
        """A number with its unit, a plain one as it is."""
        return self.parameter_text(name)

    def curve_number(self, name: str, value: Any, dimension: Dimension | None) -> Any:
        """A number of a curve in the new units."""
        if dimension is None:
            raise ModelError(
                f"the curve '{name}' is of plain numbers, which cannot be taken to other units: "
                "give its numbers their units",
                name,
            )
        number = value.value(self.scope) if isinstance(value, Formula) else value
        ratio = self.mechanism.units.unit(dimension).ratio / self.units.unit(dimension).ratio
        return plain(number * float(ratio))

    def wanted(self, value: Any, dimension: Dimension) -> Any:
        """A number of a question, as `number`."""
        if isinstance(value, Formula):
            try:
                self.asked.append(value.of(dimension))
                value = self.asked[-1].value(self.scope)
            except FormulaError:  # it is reported where the question is read
                return super().wanted(value, dimension)
        return self.written(value, dimension)

    def formula_text(self, element: str, formula: Formula, dimension: Dimension) -> Any:
        """The formula of an element, where all its numbers have units."""
        measured = measured_names(self.mechanism, formula.names)
        return self.measured_text(formula.of(dimension), measured, element)

    def measured_text(
        self, formula: Formula, measured: Mapping[str, Dimension | None], element: str
    ) -> Any:
        """The text of a formula of measured quantities that has units throughout."""
        names = {name: Valued(1.0, dimension) for name, dimension in measured.items()}
        names["t"] = Valued(1.0, DIMENSIONS["time"])
        if formula.argument is not None:
            names["x"] = Valued(1.0, formula.argument)
        try:
            scope = Scope(self.scope.system, {**self.scope.names, **names})
            formula.scale(evaluate(formula.tree, scope, with_units=True))
        except FormulaError:
            raise ModelError(
                f"'{element}': the formula {formula.text!r} has plain numbers, which cannot be "
                "taken to other units: give its numbers, and the inputs and states that it names, "
                "their units",
                element,
            ) from None
        return self.text(formula)

    def law_text(self, formula: Formula, name: str, measured: bool) -> Any:
        """The text of a formula that has units; plain numbers would change their meaning."""
        if measured:
            names = measured_names(self.mechanism, formula.names)
            return self.measured_text(formula, names, name.partition(".")[0])
        if not formula.has_units(self.scope) or self.changes(formula):
            raise ModelError(
                f"the law {formula.text!r} is of plain numbers, which cannot be taken to other "
                "units: give its numbers their units"
            )
        return self.text(formula)

    def changes(self, formula: Formula) -> bool:
        """Whether a function of `PLAIN_FUNCTIONS` in it takes the variable as a plain number in a
        unit that is another now.
        """
        argument = formula.argument or DIMENSIONS["time"]
        if self.mechanism.units.unit(argument).ratio == self.units.unit(argument).ratio:
            return False
        return any(
            isinstance(part, Call)
            and part.function in PLAIN_FUNCTIONS
            and not has_units(part.arguments[0], self.scope)
            and part.names & {*VARIABLES}
            for part in walk(formula.tree)
        )
