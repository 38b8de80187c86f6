"""Formulas: numbers with units, of parameters, as text. Read, checked, never executed."""

from mbody.quantities.convert import convert, deg, rpm
from mbody.quantities.evaluate import Scope, Valued, evaluate, told
from mbody.quantities.formula import Formula, read
from mbody.quantities.parameters import Parameters
from mbody.quantities.parse import FUNCTIONS, VARIABLES, FormulaError, parse, parse_unit
from mbody.quantities.text import text_of

__all__ = [
    "FUNCTIONS",
    "VARIABLES",
    "Formula",
    "FormulaError",
    "Parameters",
    "Scope",
    "Valued",
    "convert",
    "deg",
    "evaluate",
    "parse",
    "parse_unit",
    "read",
    "rpm",
    "text_of",
    "told",
]
