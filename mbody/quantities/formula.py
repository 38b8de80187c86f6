"""Numbers as text: read and checked at once, evaluated with the units and parameters of a
mechanism.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from numbers import Real
from types import NoneType
from typing import Any, cast

import numpy as np

from mbody.errors import ModelError, brief
from mbody.quantities.evaluate import (
    Scope,
    Valued,
    dimension_text,
    evaluate,
    has_units,
    parameters_read_as_units,
)
from mbody.quantities.parse import FUNCTIONS, VARIABLES, FormulaError, parse, shown
from mbody.quantities.tree import Measured, Negative, Node, Plain, called
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of, of_quantity

# frequent mistakes: (what is written, what is meant), tried in this order
COMMON_MISTAKES = (
    ("lbs?|lbm", "lbf"),
    ("oz", "ozf"),
    ("kg", "kgf"),
    ("g", "kgf"),
    ("lbf", "lb"),
    ("kgf", "kg"),
    ("kgf", "N"),
    ("Hz", "rev/s"),
    ("rpm", "rev"),
    ("deg", "deg/s"),
    ("$", "/rad"),
    ("$", "/deg"),
    ("/(rad|deg)", ""),
    ("s", "s^2"),
    (r"s(\^|\*\*)2", "s"),
    ("m", "m/s"),
    ("m", "m/s^2"),
)


@dataclass(frozen=True)
class Formula:
    """A number as text, with the dimension of its field.

    `text`: As it was written.
    `dimension`: Of the field, None while that is not known.
    `angle`: "rad" or "deg": the unit of a plain number that is an angle.
    `argument`: Of a law: the dimension of its variable.
    `tree`: The parsed text.
    """

    text: str
    dimension: Dimension | None = None
    angle: str = "rad"
    argument: Dimension | None = None
    tree: Node = field(kw_only=True, repr=False, compare=False)

    @property
    def names(self) -> frozenset[str]:
        """Parameters, variables and units that it contains."""
        return self.tree.names - {"pi"}

    @property
    def variable(self) -> str:
        """The variable that it depends on, empty where there is none."""
        return next((name for name in VARIABLES if name in self.names), "")

    @property
    def literal(self) -> bool:
        """Whether it is one number with its unit, as in a table of data."""
        node = self.tree.of if isinstance(self.tree, Negative) else self.tree
        return isinstance(node, Plain) or (
            isinstance(node, Measured) and isinstance(node.of, Plain)
        )

    def has_units(self, scope: Scope) -> bool:
        """Whether it has units, of its own or of its parameters."""
        return has_units(self.tree, scope)

    def of(self, dimension: Dimension) -> Formula:
        """A copy for a field of another dimension."""
        return replace(self, dimension=dimension)

    def value(self, scope: Scope) -> Any:
        """A float, or an array over a batch, in the units of the scope, angles in rad.

        Raises FormulaError for an unknown name, units that do not fit, or a value that is not
        finite.
        """
        found = evaluate(self.tree, scope)
        value = found.value * self._scaled(found, scope)
        if not np.isfinite(value).all():
            bad = np.ravel(value)[~np.isfinite(np.ravel(value))][0]
            raise FormulaError(f"{shown(self.text)} evaluates to {bad}, it must be finite")
        return float(value) if isinstance(value, Real) else value

    def _scaled(self, found: Valued, scope: Scope) -> float:
        """The scale; an error also names units that have the name of a parameter."""
        try:
            return self.scale(found)
        except FormulaError as error:
            both = next(parameters_read_as_units(self.tree, scope), None)
            if both is None:
                raise
            raise FormulaError(
                f"{error}; '{both[0]}' in '{both[1].unit.symbol}' is the unit, since it is "
                f"joined to a unit without a space: write '* ({both[0]})' or '/ ({both[0]})' for "
                "the parameter"
            ) from None

    def scale(self, found: Valued) -> float:
        """The factor from a value of this formula to the value of the field: one, except for plain
        degrees.

        Raises FormulaError when the field has another dimension.
        """
        wanted, got = self.dimension, found.dimension
        if got is None or wanted is None:
            degrees = got is None and wanted == DIMENSIONS["angle"] and self.angle == "deg"
            return np.pi / 180.0 if degrees else 1.0
        exact = self.literal and not wanted.current
        if got == wanted or (not exact and got.mechanical == wanted.mechanical):
            return 1.0
        raise FormulaError(
            f"{shown(self.text)} is {dimension_text(got)}, where {dimension_text(wanted)} is "
            f"wanted{self._suggestion()}"
        )

    def _suggestion(self) -> str:
        """A guess of what was meant, as the end of an error message."""
        if not self.literal or self.dimension is None:
            return ""
        for pattern, instead in COMMON_MISTAKES:
            bounds = pattern if pattern[0] in "$/" else rf"(?<![\w])(?:{pattern})(?![\w^])"
            text = re.sub(bounds, instead, self.text.strip(), count=1)
            try:
                found = evaluate(parse(text), Scope())
            except FormulaError:
                continue
            if text != self.text.strip() and found.dimension == self.dimension:
                return f": did you mean {text!r}?"
        return ""


def read(
    value: Any, dimension: Dimension | None, angle: str = "rad", *, curves: bool = False
) -> Formula:
    """A formula from text or from a quantity of pint; `curves` as of `parse`.

    Raises FormulaError for text that is not a formula, or whose units do not fit the field.

    >>> read("1.5 lbf", DIMENSIONS["force"]).value(Scope())
    6.67233242289075
    """
    if isinstance(value, Formula):
        if dimension is None or value.dimension == dimension:
            return value
        return verified(value.of(dimension))
    if isinstance(value, str):
        text = value.strip()
        return verified(Formula(text, dimension, angle, tree=parse(text, curves=curves)))
    unit = of_quantity(value)
    if unit is None:
        raise FormulaError(
            f"{shown(str(value))} is not a quantity of length, mass, time, angle, current or "
            "absolute temperature (K)"
        )
    tree = Plain(unit.ratio) if unit.dimension == NUMBER else Measured(_ONE, unit, ())
    return verified(Formula(str(value), dimension, angle, tree=tree))


_ONE = Plain(Fraction(1))


def verified(formula: Formula) -> Formula:
    """The formula; one without names is evaluated at once, to raise its errors early."""
    curves = called(formula.tree) - FUNCTIONS.keys()
    if formula.dimension is not None and not formula.names and not curves:
        formula.value(Scope())
    return formula


# -- Deferred evaluation: find the formulas in a description and substitute their values -------


#: What has no parts, and is no formula.
class LeftOut(float):
    """A number that nobody gave: the one that stands for it.

    >>> LeftOut(0.0) == 0.0
    True
    """


_PLAIN = frozenset({float, LeftOut, int, bool, str, NoneType})


@functools.cache
def _field_names(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a dataclass; of another class none."""
    return tuple(f.name for f in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else ()


@functools.cache
def _parts_of(kind: Any) -> Callable[[Any], tuple[Any, ...]]:
    """Getter of the values of all fields of a dataclass; of another class one that gives none."""
    names = _field_names(kind)
    if len(names) > 1:
        return operator.attrgetter(*names)
    return lambda value: tuple(getattr(value, name) for name in names)


def formulas_in(value: Any, name: str = "") -> Iterator[tuple[str, Formula]]:
    """Every formula in a value (a number, a point, a law, an element), with its dotted name."""
    if isinstance(value, Formula):
        yield name, value
        return
    parts: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, (tuple, list)):
        parts = enumerate(value)
    elif isinstance(value, dict):
        parts = value.items()
    else:
        parts = ((field, getattr(value, field)) for field in _field_names(cast(Any, type(value))))
    for key, part in parts:
        if type(part) not in _PLAIN:  # so that long tables are searched fast
            yield from formulas_in(part, f"{name}.{key}")


def is_pending(value: Any) -> bool:
    """Whether a value contains formulas, which only a mechanism can evaluate."""
    if type(value) in _PLAIN:
        return False
    if isinstance(value, Formula):
        return True
    parts: Iterable[Any]
    if isinstance(value, (tuple, list)):
        parts = value
    elif isinstance(value, dict):
        parts = value.values()
    else:
        parts = _parts_of(cast(Any, type(value)))(value)
    # no call for a plain number: there are hundreds in a description
    return any(type(part) not in _PLAIN and is_pending(part) for part in parts)


def substituted(value: Any, instead: Callable[[Formula], Any]) -> Any:
    """The value with every formula replaced by ``instead(formula)``; itself where it has none."""
    if type(value) in _PLAIN:
        return value
    if isinstance(value, Formula):
        return instead(value)
    if isinstance(value, (tuple, list)):
        parts = [substituted(part, instead) for part in value]
        same = all(new is old for new, old in zip(parts, value, strict=True))
        return value if same else type(value)(parts)
    if isinstance(value, dict):
        pairs = {key: substituted(part, instead) for key, part in value.items()}
        return pairs if any(pairs[key] is not value[key] for key in pairs) else value
    names = _field_names(cast(Any, type(value)))
    if names:
        fields = {field: getattr(value, field) for field in names}
        made = {name: substituted(part, instead) for name, part in fields.items()}
        differing = {name: part for name, part in made.items() if part is not fields[name]}
        return dataclasses.replace(value, **differing) if differing else value
    return value


# -- Numbers of a description, as they are entered: floats, text with units, quantities of pint


class NotANumber(FormulaError):
    """The value is neither a number nor text."""


class NotFinite(FormulaError):
    """The value is infinite or NaN."""


def float_or_formula(value: Any, dimension: Dimension | None) -> float | Formula:
    """A finite float, or a formula for text or a quantity of pint."""
    if type(value) in (float, LeftOut) and math.isfinite(value):
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
    """One number of an element: a finite float in the mechanism's unit system, or a formula."""
    kind = f" ({dimension})" if isinstance(dimension, str) else ""
    return constant_or_formula(
        value, dimension_of(dimension), f"'{element}': {field}", element, kind
    )


def constant_or_formula(
    value: Any, dimension: Dimension | None, what: str, element: str, kind: str = ""
) -> float | Formula:
    """One number that does not change with time; `what` begins the error message."""
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
    """A number, or a value made of numbers, with floats in the place of its formulas."""
    try:
        return substituted(given, lambda formula: formula.value(scope))
    except FormulaError as error:
        raise ModelError(f"'{element}': {field}: {error}", element) from None
