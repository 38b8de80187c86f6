"""Conversion of a mechanism to another unit system."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from mbody.errors import ModelError
from mbody.files.model.fields import plain
from mbody.files.model.read import built
from mbody.files.model.write import Writer
from mbody.model.mechanism import Mechanism
from mbody.model.states import measured_names
from mbody.quantities import VARIABLES, Formula, FormulaError, Scope, evaluate
from mbody.quantities.evaluate import PLAIN_FUNCTIONS, Valued, has_units
from mbody.quantities.tree import Call, walk
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, unit_system


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
