"""Values of formulas of measured quantities over a result, by NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.laws import MeasuredFormula
from mbody.model.curves import NamedCurve
from mbody.quantities.numpy_operations import ONE, TWO
from mbody.solution.measures import measured
from mbody.solution.places import column
from mbody.solution.result import Result

__all__ = ["formula_history", "formula_value"]

Array = np.ndarray


def formula_value(
    law: MeasuredFormula,
    numbers: Mapping[str, Any],
    variables: Any,
    curves: Mapping[str, NamedCurve] | None = None,
) -> Any:
    """The value of a formula.

    Parameters
    ----------
    law : MeasuredFormula
    numbers : mapping
        Its constants, "c0", "c1", …
    variables : callable
        The value of a variable by its name.
    curves : mapping, optional
        Those of the mechanism, by name.

    >>> from mbody.laws import compile_measured
    >>> from mbody.quantities import Scope, read
    >>> law, _ = compile_measured(read("2*u - 1", None), Scope(), {"u": None}, None)
    >>> float(formula_value(law, law.numbers(), {"u": 3.0}.get))
    5.0
    """
    constants, names = iter(law.parameters(numbers)), iter(law.variables)
    stack: list[Any] = []
    for operation in law.operations:
        if operation == "variable":
            stack.append(variables(next(names)))
        elif operation == "constant":
            stack.append(next(constants))
        elif curves and operation in curves:
            curve = curves[operation]
            taken = [stack.pop() for _ in curve.takes][::-1]
            stack.append(curve.at(*taken))
        elif operation in ONE:
            stack.append(ONE[operation](stack.pop()))
        else:
            sign, _, constant = operation.partition(" ")
            b = next(constants) if constant else stack.pop()
            stack.append(TWO[sign](stack.pop(), b))
    return stack.pop()


def formula_history(solution: Result, law: MeasuredFormula, name: str) -> Array:
    """The values of an element's formula, (instants,), or (designs, instants) of a batch.

    Parameters
    ----------
    solution : Solution
    law : MeasuredFormula
        Without the variable ``x`` of a spring or a damper.
    name : str
        Of the law, such as ``"motor.value"``.
    """
    values = solution.system.values
    numbers = {key: column(values[f"{name}.{key}"]) for key in law.numbers()}

    def variable(one: str) -> Any:
        return solution.t if one == "t" else measured(solution, one)[0]

    shape = solution.t.shape
    if solution.record.batch:
        shape = (solution.record.count, *shape)
    with np.errstate(all="ignore"):
        found = formula_value(law, numbers, variable, solution.mechanism.curves)
    return np.broadcast_to(np.asarray(found, dtype=float), shape)
