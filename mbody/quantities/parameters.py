"""The parameters of a mechanism: numbers that formulas name, some of them formulas of others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any

from mbody.errors import ModelError
from mbody.quantities import number
from mbody.quantities.evaluate import Scope, Valued, evaluate
from mbody.quantities.formula import Formula, read
from mbody.quantities.parse import FUNCTIONS, VARIABLES, FormulaError, parse, shown
from mbody.quantities.tree import Measured, Name
from mbody.quantities.units import DIMENSIONS, SYMBOLS, Dimension, UnitSystem

__all__ = ["Parameters", "let_in", "with_unit_of"]

LONGEST = 40
KEPT = {*FUNCTIONS, *VARIABLES, "pi"}


class Parameters(Mapping[str, "float | Formula"]):
    """Named numbers, each a float or a formula of the others; the order does not matter.

    Parameters
    ----------
    given : mapping
        By name: a number, text such as ``"2*a"`` or ``"15 in"``, or a quantity.
    system : UnitSystem
        The units that values come out in.

    Raises
    ------
    ModelError
        For a name that cannot stand in a formula, a number that is none, or formulas that go round
        in a circle.

    >>> from mbody.quantities.units import unit_system
    >>> Parameters({"a": 2.0, "b": "3*a"}, unit_system("SI")).scope().names["b"].value
    6.0
    """

    def __init__(self, given: Mapping[str, Any], system: UnitSystem) -> None:
        if not isinstance(given, Mapping):
            raise ModelError(f'parameters must be a dict such as {{"a": 2.0}}, not {given!r}')
        self.system = system
        self._given = {name: let_in(name, value) for name, value in given.items()}
        self._order = self._ordered()
        self._base = self.scope()

    def __getitem__(self, name: str) -> float | Formula:
        return self._given[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)

    def used_by(self, formula: Formula) -> frozenset[str]:
        """The parameters that a formula names."""
        return formula.names & self._given.keys()

    def scope(self, values: Mapping[str, Any] | None = None) -> Scope:
        """What the names stand for: as described, or with other values of some parameters.

        Parameters
        ----------
        values : mapping, optional
            By name, floats or arrays (batch,) in the unit system, angles that have a unit in rad.

        Raises
        ------
        ModelError
            Where a formula of a parameter has no finite value.
        """
        if not values and hasattr(self, "_base"):
            return self._base
        found: dict[str, Valued] = {}
        scope = Scope(self.system, found)
        for name in self._order:
            own = self._given[name]
            try:
                made = evaluate(own.tree, scope) if isinstance(own, Formula) else Valued(own)
                if values and name in values:
                    made = Valued(values[name], made.dimension)
                elif isinstance(own, Formula):
                    made = Valued(own.value(scope), made.dimension)
            except FormulaError as error:
                raise ModelError(f"parameter '{name}': {error}", name) from None
            found[name] = made
        return Scope(self.system, found)

    def _ordered(self) -> list[str]:
        """Every parameter after those that it is made of."""
        needs = {
            name: sorted(self.used_by(own)) if isinstance(own, Formula) else []
            for name, own in self._given.items()
        }
        try:
            return list(TopologicalSorter(needs).static_order())
        except CycleError as error:
            ring = " → ".join(reversed(error.args[1][:6]))
            raise ModelError(
                f"the parameters {ring} are made of each other: give one of them a number",
                error.args[1][0],
            ) from None


def _is_one_name(name: str) -> bool:
    """Whether a formula reads it as one name: Python also grants marks, as in a·b."""
    try:
        return len(name) <= LONGEST and parse(name) == Name(name)
    except FormulaError:
        return False


def let_in(name: Any, value: Any) -> float | Formula:
    """A parameter as it is kept; ModelError for a name or a number that is none."""
    if not isinstance(name, str) or not name.isidentifier() or not _is_one_name(name):
        raise ModelError(
            f"{shown(str(name))} cannot name a parameter: begin with a letter, go on with letters, "
            f"digits and _, at most {LONGEST}"
        )
    if name in KEPT:
        raise ModelError(
            f"the name '{name}' is kept for formulas: call the parameter otherwise", name
        )
    return number.let_in(value, None, f"parameter '{name}'", name)


def with_unit_of(value: Any, dimension: Dimension, units: UnitSystem, angle: str) -> Any:
    """Another value of a parameter that measures something: a plain number in the unit that plain
    numbers of that dimension have, as ``"0.25 m"`` for 0.25; anything else as it is.

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
    except FormulaError:  # a unit that is spelt otherwise than formulas are
        pass
    return Formula(text, None, tree=Measured(formula.tree, unit, ()))
