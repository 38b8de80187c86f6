"""A number that is still text: read and checked where it was written, worth a float once the
mechanism says its units and parameters.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np

from mbody.quantities.evaluate import Scope, Valued, evaluate, measured, taken_for_units, told
from mbody.quantities.parse import VARIABLES, FormulaError, parse, shown
from mbody.quantities.tree import Measured, Negative, Node, Plain
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, of_quantity

__all__ = ["Formula", "checked", "read"]

# what is often written for what is meant, tried in this order
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
    """A number as text, with the dimension that its field asks for.

    Attributes
    ----------
    text : str
        As it was written.
    dimension : Dimension or None
        What the field takes, None while that is not known.
    angle : str
        "rad" or "deg": the unit of what is a plain angle.
    argument : Dimension or None
        Of a law: what its variable measures.
    tree : Node
        What the text says.
    """

    text: str
    dimension: Dimension | None = None
    angle: str = "rad"
    argument: Dimension | None = None
    tree: Node = field(kw_only=True, repr=False, compare=False)

    @property
    def names(self) -> frozenset[str]:
        """Parameters, variables and units that it names."""
        return self.tree.names - {"pi"}

    @property
    def variable(self) -> str:
        """The variable that it depends on, empty where it is one number."""
        return next((name for name in VARIABLES if name in self.names), "")

    @property
    def literal(self) -> bool:
        """Whether it is one number with its unit, as of a table of data."""
        node = self.tree.of if isinstance(self.tree, Negative) else self.tree
        return isinstance(node, Plain) or (
            isinstance(node, Measured) and isinstance(node.of, Plain)
        )

    def has_units(self, scope: Scope) -> bool:
        """Whether it has units, by itself or through parameters."""
        return measured(self.tree, scope)

    def of(self, dimension: Dimension) -> Formula:
        """The same where a field of that dimension takes it."""
        return replace(self, dimension=dimension)

    def value(self, scope: Scope) -> Any:
        """A float, or an array over a batch, in the units of the scope, angles in rad.

        Raises
        ------
        FormulaError
            For a name that stands for nothing, units that do not fit, or a number that is none.
        """
        found = evaluate(self.tree, scope)
        value = found.value * self._scaled(found, scope)
        if not np.isfinite(value).all():
            bad = np.ravel(value)[~np.isfinite(np.ravel(value))][0]
            raise FormulaError(f"{shown(self.text)} comes to {bad}, it must be finite")
        return float(value) if np.ndim(value) == 0 else value

    def _scaled(self, found: Valued, scope: Scope) -> float:
        """The scale, with a word about units that are called as parameters where it is refused."""
        try:
            return self.scale(found)
        except FormulaError as error:
            both = next(taken_for_units(self.tree, scope), None)
            if both is None:
                raise
            raise FormulaError(
                f"{error}; '{both[0]}' in '{both[1].unit.symbol}' is the unit, as all that is "
                f"joined to a unit without a space: write '* ({both[0]})' or '/ ({both[0]})' for "
                "the parameter"
            ) from None

    def scale(self, found: Valued) -> float:
        """What a value of this formula is multiplied by to be what the field takes: one, but for
        plain degrees.

        Raises
        ------
        FormulaError
            When the field takes another dimension.
        """
        wanted, got = self.dimension, found.dimension
        if got is None or wanted is None:
            degrees = got is None and wanted == DIMENSIONS["angle"] and self.angle == "deg"
            return np.pi / 180.0 if degrees else 1.0
        if got == wanted or (not self.literal and got.mechanical == wanted.mechanical):
            return 1.0
        raise FormulaError(
            f"{shown(self.text)} is {told(got)}, where {told(wanted)} is wanted{self._meant()}"
        )

    def _meant(self) -> str:
        """A guess of what was meant, as the end of a sentence."""
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


def read(value: Any, dimension: Dimension | None, angle: str = "rad") -> Formula:
    """A formula from text or from a quantity of pint.

    Raises
    ------
    FormulaError
        For text that is no formula, or whose units cannot be those of the field.

    >>> read("1.5 lbf", DIMENSIONS["force"]).value(Scope())
    6.67233242289075
    """
    if isinstance(value, Formula):
        return value if dimension is None else checked(value.of(dimension))
    if isinstance(value, str):
        text = value.strip()
        return checked(Formula(text, dimension, angle, tree=parse(text)))
    unit = of_quantity(value)
    if unit is None:
        raise FormulaError(
            f"{shown(str(value))} is no quantity of mechanics: of length, mass, time and angle"
        )
    tree = Plain(unit.ratio) if unit.dimension == NUMBER else Measured(_ONE, unit, ())
    return checked(Formula(str(value), dimension, angle, tree=tree))


_ONE = Plain(Fraction(1))


def checked(formula: Formula) -> Formula:
    """The formula; one that names nothing is tried at once."""
    if formula.dimension is not None and not formula.names:
        formula.value(Scope())
    return formula
