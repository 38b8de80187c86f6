"""Formulas: numbers with units, of parameters, as text. Read, checked, never executed."""

from mbody.formulas.convert import convert
from mbody.formulas.evaluate import Scope, Valued, evaluate, told
from mbody.formulas.formula import Formula, read
from mbody.formulas.parameters import Parameters
from mbody.formulas.parse import FUNCTIONS, VARIABLES, FormulaError, parse, parse_unit
from mbody.formulas.text import text_of

__all__ = [
    "FUNCTIONS",
    "VARIABLES",
    "Formula",
    "FormulaError",
    "Parameters",
    "Scope",
    "Valued",
    "convert",
    "evaluate",
    "parse",
    "parse_unit",
    "read",
    "text_of",
    "told",
]
