"""Which sheet belongs to which result."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from mbody.analysis.equilibria.equilibrium import Equilibria
from mbody.analysis.equilibria.equilibrium_curve import EquilibriumCurve
from mbody.analysis.freedom.mobility import Mobility
from mbody.analysis.inverse.answers import Answer
from mbody.analysis.linear.modes import Modes
from mbody.sheets import answers, equation_lines, equilibrium, instant, mobility, modes
from mbody.solution.force_equations import Equations
from mbody.solution.solution import Solution

__all__ = ["sheet"]


@singledispatch
def sheet(result: Any) -> str:
    """The sheet of a result, as ``print`` shows it.

    Raises
    ------
    TypeError
        For what has none.
    """
    raise TypeError(f"an object of the type {type(result).__name__} has no sheet")


sheet.register(Solution, instant.sheet)
sheet.register(Modes, modes.sheet)
sheet.register(Equilibria, equilibrium.sheet)
sheet.register(EquilibriumCurve, equilibrium.curve_sheet)
sheet.register(Mobility, mobility.sheet)
sheet.register(Answer, answers.sheet)


@sheet.register
def _(result: Equations) -> str:
    return "\n".join(equation_lines.lines(result))
