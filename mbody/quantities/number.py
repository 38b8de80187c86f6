"""The one door through which every number of a description enters."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from mbody.errors import ModelError, brief
from mbody.quantities.formula import Formula, read
from mbody.quantities.parse import FormulaError
from mbody.quantities.units import Dimension, dimension_of

__all__ = ["entered", "number", "one_number"]


class NotANumber(FormulaError):
    """What was given is neither a number nor text."""


class NotFinite(FormulaError):
    """What was given is infinite, or no number at all."""


def entered(value: Any, dimension: Dimension | None) -> float | Formula:
    """A finite float, or a formula where it is text or a quantity of the units library.

    Raises
    ------
    FormulaError
        When it is neither; the sentence is to stand behind the name of the field.
    """
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
    raise NotANumber(f"{brief(value)} is no number")


def number(value: Any, dimension: str | Dimension, element: str, field: str) -> Any:
    """Let one number in: a finite float in the mechanism's unit system, or text that becomes one.

    Parameters
    ----------
    value : float, str or quantity
        Text has units, parameters and arithmetic: ``"1.5 lbf"``, ``"2*a"``; a quantity is pint's.
    dimension : str or Dimension
        What the field takes.
    element, field : str
        Whose number it is, for the sentence.

    Returns
    -------
    float or Formula
        A formula becomes a float when a mechanism takes the element, which says its units.

    Raises
    ------
    ModelError
        When it is no number, not finite, or of another dimension.
    """
    told = f" ({dimension})" if isinstance(dimension, str) else ""
    return let_in(value, dimension_of(dimension), f"'{element}': {field}", element, told)


def let_in(
    value: Any, dimension: Dimension | None, what: str, element: str, told: str = ""
) -> float | Formula:
    """One number that does not change with time; `what` begins the sentence where it is none.

    Raises
    ------
    ModelError
        As `number`.
    """
    try:
        result = entered(value, dimension)
    except NotANumber:
        raise ModelError(f"{what} must be a number{told}, not {brief(value)}", element) from None
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
    """A plain number, where no mechanism is at hand to say units and parameters."""
    result = number(value, dimension, element, field)
    if isinstance(result, Formula):
        raise ModelError(
            f"'{element}': {field} must be a plain number here, not {brief(result.text)}", element
        )
    return result
