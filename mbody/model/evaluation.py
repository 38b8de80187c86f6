"""An element as a mechanism takes it: floats instead of text, laws instead of formulas."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

from mbody.errors import ModelError, brief
from mbody.laws import Constant, Law, compile_formula, compile_measured
from mbody.model.element import Element
from mbody.quantities import FUNCTIONS, Formula, FormulaError, Scope
from mbody.quantities.deferred import formulas_in, substituted
from mbody.quantities.tree import called
from mbody.quantities.units import DIMENSIONS, Dimension, dimension_of

__all__ = ["resolved"]

TIME = DIMENSIONS["time"]

E = TypeVar("E", bound=Element)


#: Dimensions of those of the names in a formula that are measured in a motion.
Measured: TypeAlias = "Callable[[frozenset[str]], Mapping[str, Dimension | None]]"


def resolved(
    element: E, scope: Scope, measured: Measured
) -> tuple[E, dict[str, Formula], set[str]]:
    """The element with floats for all its text, in the units of the scope; laws by formulas of
    what is `measured` in a motion.

    Returns
    -------
    element : Element
        Checked as a whole.
    formulas : dict
        What its numbers were made of, by dotted name.
    fixed : set of str
        Parameters used where a number cannot be changed afterwards, as in a table or a guess.

    Raises
    ------
    ModelError
        For a parameter that there is not, or a unit that does not fit; and as the element's own.
    """
    if not element.pending:
        return element, {}, set()
    formulas: dict[str, Formula] = {}
    laws: dict[str, Law] = {}
    for field in dataclasses.fields(element):
        value = getattr(element, field.name)
        if isinstance(value, Constant) and isinstance(value.value, Formula):
            # without a variable of its own: perhaps of measured quantities
            value = value.value
        if isinstance(value, Formula) and "law" in field.metadata:
            name = f"{element.name}.{field.name}"
            try:
                quantities = measured(value.names)
                calls = called(value.tree) - FUNCTIONS.keys()
                if quantities or (calls and value.variable):
                    laws[field.name], numbers = _of_measured(
                        element, field, value, scope, quantities
                    )
                elif value.variable:
                    of = value.argument or TIME
                    laws[field.name], numbers = compile_formula(value, scope, of)
                else:
                    continue
            except FormulaError as error:
                raise ModelError(f"'{element.name}': {field.name}: {error}", element.name) from None
            formulas |= {f"{name}.{key}": formula for key, formula in numbers.items()}
            formulas[name] = value
    changes: dict[str, Any] = dict(laws)
    with_laws = dataclasses.replace(element, **changes) if laws else element
    named = {k: v for k, v in with_laws.numbers().items() if isinstance(v, Formula)}
    formulas |= named
    values: dict[int, Any] = {}
    for name, formula in named.items():
        try:
            values[id(formula)] = formula.value(scope)
        except FormulaError as error:
            field_name = name.removeprefix(f"{element.name}.")
            raise ModelError(f"'{element.name}': {field_name}: {error}", element.name) from None

    def value_of(formula: Formula) -> Any:
        known = values.get(id(formula))
        return formula.value(scope) if known is None else known

    parts: dict[str, Any] = {}
    for field in dataclasses.fields(element):
        value = getattr(with_laws, field.name)
        try:
            parts[field.name] = substituted(value, value_of)
        except FormulaError as error:
            raise ModelError(f"'{element.name}': {field.name}: {error}", element.name) from None
    made = dataclasses.replace(with_laws, **parts)
    rest = {k: f for k, f in formulas_in(with_laws, element.name) if id(f) not in values}
    fixed = set().union(*(formula.names for formula in rest.values()))
    formulas |= rest
    return made, formulas, fixed


def _of_measured(
    element: Element,
    field: dataclasses.Field[Any],
    formula: Formula,
    scope: Scope,
    quantities: Mapping[str, Dimension | None],
) -> tuple[Law, dict[str, Formula]]:
    """The law of a formula of measured quantities, where the element can follow one."""
    measured = next(iter(quantities), "t")
    if element.role not in ("load", "driver") and not element.follows_formulas:
        raise ModelError(
            f"'{element.name}': {field.name} is {brief(formula.text)}, a formula of '{measured}', "
            f"which a {element.role} cannot follow: a load or a driver may; for coordinates that "
            "follow each other use a Coupling, a Gear, a Cam, a driver or a CustomJoint",
            element.name,
        )
    own = f"{element.name}.{field.name}"
    if own in quantities:
        raise ModelError(
            f"'{element.name}': {field.name}: '{own}' depends on itself: measure what it follows "
            "from, or filter it with a state of your own",
            element.name,
        )
    names = dict(quantities)
    if "t" in formula.names:
        names["t"] = TIME
    if "x" in formula.names:
        names["x"] = dimension_of(field.metadata["of"])
    wanted = dimension_of(field.metadata["law"])
    return compile_measured(formula.of(wanted), scope, names, wanted)
