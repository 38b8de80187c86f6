"""An element as a mechanism takes it: floats instead of text, laws instead of formulas."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from mbody.errors import ModelError
from mbody.laws import Law, compile_formula
from mbody.model.element import Element
from mbody.quantities import Formula, FormulaError, Scope
from mbody.quantities.deferred import formulas_in, substituted
from mbody.quantities.units import DIMENSIONS

__all__ = ["resolved"]

TIME = DIMENSIONS["time"]

E = TypeVar("E", bound=Element)


def resolved(element: E, scope: Scope) -> tuple[E, dict[str, Formula], set[str]]:
    """The element with floats for all its text, in the units of the scope.

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
        if isinstance(value, Formula) and "law" in field.metadata:
            name = f"{element.name}.{field.name}"
            try:
                laws[field.name], numbers = compile_formula(value, scope, value.argument or TIME)
            except FormulaError as error:
                raise ModelError(f"'{element.name}': {field.name}: {error}", element.name) from None
            formulas |= {f"{name}.{key}": formula for key, formula in numbers.items()}
            formulas[name] = value
    named = {k: v for k, v in element.numbers().items() if isinstance(v, Formula)}
    formulas |= named
    for name, formula in named.items():
        try:
            formula.value(scope)
        except FormulaError as error:
            field_name = name.removeprefix(f"{element.name}.")
            raise ModelError(f"'{element.name}': {field_name}: {error}", element.name) from None
    open_numbers = {id(formula) for formula in named.values()}
    changes: dict[str, Any] = dict(laws)
    with_laws = dataclasses.replace(element, **changes) if laws else element
    parts: dict[str, Any] = {}
    for field in dataclasses.fields(element):
        value = getattr(with_laws, field.name)
        try:
            parts[field.name] = substituted(value, lambda formula: formula.value(scope))
        except FormulaError as error:
            raise ModelError(f"'{element.name}': {field.name}: {error}", element.name) from None
    made = dataclasses.replace(with_laws, **parts)
    rest = {k: f for k, f in formulas_in(with_laws, element.name) if id(f) not in open_numbers}
    fixed = set().union(*(formula.names for formula in rest.values()))
    formulas |= rest
    return made, formulas, fixed
