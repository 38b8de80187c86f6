"""Formulas: numbers as text, with units and parameters. They are parsed, never executed."""

from mbody.quantities.evaluate import Scope, Valued, convert, deg, dimension_text, evaluate, rpm
from mbody.quantities.formula import Formula, Parameters, read
from mbody.quantities.parse import FUNCTIONS, VARIABLES, FormulaError, parse, parse_unit, text_of

__all__ = [
    "FUNCTIONS", "VARIABLES", "Formula", "FormulaError", "Parameters", "Scope", "Valued",
    "convert", "deg", "evaluate", "parse", "parse_unit", "read", "rpm", "text_of", "dimension_text",
]  # fmt: skip
