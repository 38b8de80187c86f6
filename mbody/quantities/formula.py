"""Numbers as text: read and checked at once, evaluated with the units and parameters of a
mechanism.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from fractions import Fraction
from numbers import Real
from typing import Any

import numpy as np

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
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, of_quantity

__all__ = ["Formula", "verified", "read"]

# frequent mistakes: (what is written, what is meant), tried in this order
MEANT = (
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

    Attributes
    ----------
    text : str
        As it was written.
    dimension : Dimension or None
        Of the field, None while that is not known.
    angle : str
        "rad" or "deg": the unit of a plain number that is an angle.
    argument : Dimension or None
        Of a law: the dimension of its variable.
    tree : Node
        The parsed text.
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
        """The same formula for a field of that dimension."""
        return replace(self, dimension=dimension)

    def value(self, scope: Scope) -> Any:
        """A float, or an array over a batch, in the units of the scope, angles in rad.

        Raises
        ------
        FormulaError
            For an unknown name, units that do not fit, or a value that is not finite.
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

        Raises
        ------
        FormulaError
            When the field has another dimension.
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
            f"wanted{self._meant()}"
        )

    def _meant(self) -> str:
        """A guess of what was meant, as the end of an error message."""
        if not self.literal or self.dimension is None:
            return ""
        for pattern, instead in MEANT:
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

    Raises
    ------
    FormulaError
        For text that is not a formula, or whose units do not fit the field.

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
