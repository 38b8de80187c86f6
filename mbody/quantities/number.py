"""Numbers of a description, as they are entered: floats, text with units, quantities of pint."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from mbody.errors import ModelError, brief
from mbody.quantities.deferred import substituted
from mbody.quantities.evaluate import Scope
from mbody.quantities.formula import Formula, read
from mbody.quantities.parse import FormulaError
from mbody.quantities.units import Dimension, dimension_of

__all__ = ["constant_or_formula", "evaluated", "float_or_formula", "number", "one_number"]


class NotANumber(FormulaError):
    """The value is neither a number nor text."""


class NotFinite(FormulaError):
    """The value is infinite or NaN."""


def float_or_formula(value: Any, dimension: Dimension | None) -> float | Formula:
    """A finite float, or a formula for text or a quantity of pint.

    Raises
    ------
    FormulaError
        When it is neither; the message follows the name of the field.
    """
    if type(value) is float and math.isfinite(value):
        return value
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            result = float(value)
        except OverflowError:
            result = math.inf
        if not math.isfinite(result):
            raise NotFinite(f"{result}")
        return result
    if isinstance(value, (str, Formula)) or hasattr(value, "dimensionality"):
        return read(value, dimension)
    raise NotANumber(f"{brief(value)} is not a number")


def number(value: Any, dimension: str | Dimension, element: str, field: str) -> Any:
    """One number of an element: a finite float in the mechanism's unit system, or a formula.

    Parameters
    ----------
    value : float, str or quantity
        Text has units, parameters and arithmetic: ``"1.5 lbf"``, ``"2*a"``; a quantity is pint's.
    dimension : str or Dimension
        Dimension of the field.
    element, field : str
        Names for the error message.

    Returns
    -------
    float or Formula
        A formula becomes a float when the element is added to a mechanism, which has the units.

    Raises
    ------
    ModelError
        When it is not a number, not finite, or of another dimension.
    """
    kind = f" ({dimension})" if isinstance(dimension, str) else ""
    return constant_or_formula(
        value, dimension_of(dimension), f"'{element}': {field}", element, kind
    )


def constant_or_formula(
    value: Any, dimension: Dimension | None, what: str, element: str, kind: str = ""
) -> float | Formula:
    """One number that does not change with time; `what` begins the error message.

    Raises
    ------
    ModelError
        As `number`.
    """
    try:
        result = float_or_formula(value, dimension)
    except NotANumber:
        raise ModelError(f"{what} must be a number{kind}, not {brief(value)}", element) from None
    except NotFinite as error:
        raise ModelError(f"{what} is {error}, it must be finite", element) from None
    except FormulaError as error:
        raise ModelError(f"{what}: {error}", element) from None
    if isinstance(result, Formula) and result.variable:
        raise ModelError(
            f"{what} is {brief(result.text)}, but only a law may change with '{result.variable}'",
            element,
        )
    return result


def one_number(value: Any, dimension: str, element: str, field: str) -> float:
    """A plain number, for places without a mechanism that has units and parameters."""
    result = number(value, dimension, element, field)
    if isinstance(result, Formula):
        raise ModelError(
            f"'{element}': {field} must be a plain number here, not {brief(result.text)}", element
        )
    return result


def evaluated(given: Any, scope: Scope, element: str, field: str) -> Any:
    """A number, or a value made of numbers, with floats in the place of its formulas.

    Raises
    ------
    ModelError
        For a parameter that there is not; the sentence names the element and the field.
    """
    try:
        return substituted(given, lambda formula: formula.value(scope))
    except FormulaError as error:
        raise ModelError(f"'{element}': {field}: {error}", element) from None
