"""The parameters of a mechanism: named numbers for formulas, some of them formulas of others."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any

from mbody.core.tolerances import PARAMETERS_EQUAL
from mbody.errors import ModelError
from mbody.quantities import formula as number
from mbody.quantities.evaluate import Scope, Valued, evaluate
from mbody.quantities.formula import Formula, read
from mbody.quantities.parse import FUNCTIONS, VARIABLES, FormulaError, parse, parse_unit, shown
from mbody.quantities.tree import Measured, Name
from mbody.quantities.units import DIMENSIONS, SYMBOLS, Dimension, UnitSystem

MAX_NAME = 40
RESERVED = {*FUNCTIONS, *VARIABLES, "pi"}


class Parameters(Mapping[str, "float | Formula"]):
    """Named numbers, each a float or a formula of the others, in any order.

    `given`: By name: a number, text such as ``"2*a"`` or ``"15 in"``, or a quantity.
    `system`: The units of the values.

    Raises
    ------
    ModelError
        For a name that cannot be used in a formula, a value that is not a number, or formulas that
        depend on each other in a circle.

    >>> from mbody.quantities.units import unit_system
    >>> Parameters({"a": 2.0, "b": "3*a"}, unit_system("SI")).scope().names["b"].value
    6.0
    """

    def __init__(self, given: Mapping[str, Any], system: UnitSystem) -> None:
        if not isinstance(given, Mapping):
            raise ModelError(f'parameters must be a dict such as {{"a": 2.0}}, not {given!r}')
        self.system = system
        #: Curves of the mechanism, which formulas call by name.
        self.curves: dict[str, Valued] = {}
        self._values = {name: parameter_value(name, value) for name, value in given.items()}
        self._order = self._ordered()
        self._base = self.scope()

    def __getitem__(self, name: str) -> float | Formula:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def used_by(self, formula: Formula) -> frozenset[str]:
        """The parameters that a formula uses."""
        return formula.names & self._values.keys()

    def scope(self, values: Mapping[str, Any] | None = None) -> Scope:
        """The values of the names: as described, or with other values of some parameters.

        `values`: By name, floats or arrays (batch,) in the unit system, angles that have a unit in
          rad.
        Raises ModelError where a formula of a parameter has no finite value.
        """
        if not values and hasattr(self, "_base"):
            return self._base
        found: dict[str, Valued] = {}
        scope = Scope(self.system, found)
        for name in self._order:
            own = self._values[name]
            try:
                made = evaluate(own.tree, scope) if isinstance(own, Formula) else Valued(own)
                if values and name in values:
                    made = Valued(values[name], made.dimension)
                elif isinstance(own, Formula):
                    made = Valued(own.value(scope), made.dimension)
            except FormulaError as error:
                raise ModelError(f"parameter '{name}': {error}", name) from None
            found[name] = made
        return Scope(self.system, {**found, **self.curves})

    def with_curves(self, curves: Mapping[str, Valued]) -> None:
        """Let formulas call these curves."""
        self.curves = dict(curves)
        self._base = Scope(self.system, {**self._base.names, **self.curves})

    def _ordered(self) -> list[str]:
        """The parameters in an order in which each follows those that it depends on."""
        needs = {
            name: sorted(self.used_by(own)) if isinstance(own, Formula) else []
            for name, own in self._values.items()
        }
        try:
            return list(TopologicalSorter(needs).static_order())
        except CycleError as error:
            ring = " → ".join(reversed(error.args[1][:6]))
            raise ModelError(
                f"the parameters {ring} depend on each other: give one of them a number",
                error.args[1][0],
            ) from None


def _is_one_name(name: str) -> bool:
    """Whether a formula reads it as one name: Python also allows marks, as in a·b."""
    try:
        return len(name) <= MAX_NAME and parse(name) == Name(name)
    except FormulaError:
        return False


def parameter_value(name: Any, value: Any) -> float | Formula:
    """The value of a parameter, read; ModelError for an invalid name or number."""
    if not isinstance(name, str) or not name.isidentifier() or not _is_one_name(name):
        raise ModelError(
            f"{shown(str(name))} cannot name a parameter: a name begins with a letter, has "
            f"letters, digits and _, and at most {MAX_NAME} characters"
        )
    if name in RESERVED:
        raise ModelError(
            f"the name '{name}' is reserved for formulas: choose another name for the parameter",
            name,
        )
    return number.constant_or_formula(value, None, f"parameter '{name}'", name)


def plain_otherwise(name: str, own: Any, units: UnitSystem, angle: str = "deg") -> str:
    """A sentence for a plain number that replaces a parameter which is written in another unit
    than plain numbers have, as "90 rpm"; empty where there is no such unit.

    >>> from mbody.quantities.units import unit_system
    >>> plain_otherwise("h", "90 cm", unit_system("SI"))
    "plain numbers for 'h' are in m, and its own value is '90 cm': write cm if that is meant"
    >>> plain_otherwise("length", "2 m", unit_system("SI"))
    ''
    """
    text = own.text if isinstance(own, Formula) else own
    found = re.fullmatch(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(\S.*?)\s*", str(text))
    if found is None:
        return ""
    try:
        one = evaluate(parse_unit(found[1]), Scope(units))
    except FormulaError:
        return ""
    if one.dimension is None:
        return ""
    plain, size = units.unit(one.dimension), 1.0
    if one.dimension == DIMENSIONS["angle"] and angle == "deg":
        plain, size = SYMBOLS["deg"], math.pi / 180.0
    if math.isclose(one.value, size, rel_tol=PARAMETERS_EQUAL):
        return ""
    return (
        f"plain numbers for '{name}' are in {plain.symbol}, and its own value is '{text}': write "
        f"{found[1]} if that is meant"
    )


def with_unit_of(value: Any, dimension: Dimension, units: UnitSystem, angle: str) -> Any:
    """Another value of a parameter that has a dimension: a plain number gets the unit that plain
    numbers of that dimension have, as ``"0.25 m"`` for 0.25; anything else is unchanged.

    >>> from mbody.quantities.units import unit_system
    >>> with_unit_of("0.25", DIMENSIONS["length"], unit_system("SI"), "deg").text
    '0.25 m'
    """
    text = f"{value!r}" if isinstance(value, (int, float)) else value
    if not isinstance(text, str):
        return value
    formula = read(text, None)
    if formula.names or formula.has_units(Scope(units)):
        return value
    unit = units.unit(dimension)
    if dimension == DIMENSIONS["angle"]:
        unit = SYMBOLS[angle]
    text = f"{formula.text if formula.literal else f'({formula.text})'} {unit.symbol}"
    try:
        made = read(text, None)
        if evaluate(made.tree, Scope(units)).dimension == dimension:
            return made
    except FormulaError:  # the symbol of the unit cannot be read in a formula
        pass
    return Formula(text, None, tree=Measured(formula.tree, unit, ()))
