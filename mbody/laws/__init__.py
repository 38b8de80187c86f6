"""Laws: scalar functions of one variable with first and second derivative.

Drivers and forces take laws of time, springs and dampers laws of deflection or rate. The common
laws and formulas are compiled; `Function` takes any Python function.

>>> from mbody.laws import Harmonic
>>> Harmonic(mean=1.0, amplitude=2.0, frequency=3.0)(0.0)
1.0
"""

from __future__ import annotations

from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import Law, finite
from mbody.laws.cams import Cam, Dwell, Rise
from mbody.laws.expression import (
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Expression,
    Harmonic,
    Polynomial,
    compile_formula,
)
from mbody.laws.function import Function
from mbody.laws.kernels import LAW_KINDS, SHAPES, evaluate, law
from mbody.laws.measured_formula import MeasuredFormula, compile_measured
from mbody.laws.table import Table, Table2
from mbody.laws.times import times_of
from mbody.quantities import VARIABLES, Formula, FormulaError, dimension_text, read
from mbody.quantities.units import DIMENSIONS, Dimension

__all__ = [
    "LAW_KINDS",
    "SHAPES",
    "Law",
    "Constant",
    "ConstantSpeed",
    "ConstantAcceleration",
    "Polynomial",
    "Harmonic",
    "Table",
    "Table2",
    "Rise",
    "Dwell",
    "Cam",
    "Expression",
    "Function",
    "as_law",
    "MeasuredFormula",
    "compile_formula",
    "compile_measured",
    "law",
    "evaluate",
    "times_of",
]


def as_law(
    value: Any, dimension: Dimension | None = None, argument: Dimension = DIMENSIONS["time"]
) -> Law | Formula:
    """The law for a value: `Constant` for a number, `Function` for a Python function.

    Parameters
    ----------
    value : Law, float, str, quantity or callable
        Text may have units, parameters and the variable: ``t`` of time, else ``x``.
    dimension : Dimension, optional
        Of the law's value; the units of text are checked against it.
    argument : Dimension
        Of the variable.

    Returns
    -------
    Law or Formula
        A formula where the text contains the variable: it becomes a law when it is added to a
        mechanism.

    Raises
    ------
    ModelError
        Anything else, or a unit that does not fit.

    >>> as_law(3)
    Constant(value=3.0)
    """
    try:
        if isinstance(value, Law):
            return value if dimension is None else value.dimensioned(dimension, argument)
        if isinstance(value, str | Formula) or hasattr(value, "dimensionality"):
            return _as_formula(read(value, dimension, curves=True), argument)
    except FormulaError as error:
        raise ModelError(str(error)) from None
    if isinstance(value, Real) and not isinstance(value, bool | np.bool_):
        return Constant(finite(value, "law", "value"))
    if isinstance(value, type) and issubclass(value, Law):
        raise ModelError(
            f"a law is made from its numbers: {value.__name__}(...), not the class "
            f"{value.__name__} itself"
        )
    if type(value).__name__ == "LowLevelCallable":  # of SciPy: a function of C that it wraps
        value = value.function
    if callable(value) and not isinstance(value, type):
        return Function(value)
    raise ModelError(
        f"a law must be a number, a law such as ConstantSpeed(0, 10), or a function of "
        f"one number, not {value!r}; for points use Table(x, y)"
    )


def _as_formula(formula: Formula, argument: Dimension) -> Law | Formula:
    """A constant, or the formula itself if it contains the variable of such a law."""
    if not formula.variable:
        return Constant(formula)  # becomes a float in a mechanism
    wanted = "t" if argument == DIMENSIONS["time"] else "x"
    others = formula.names & set(VARIABLES) - {wanted}
    if others:
        raise FormulaError(
            f"{formula.text!r} is a formula of '{min(others)}', but the variable here is "
            f"'{wanted}', {dimension_text(argument)}"
        )
    return replace(formula, argument=argument)
