"""Formulas of inputs as actuators: laws that are linear in one input and in a coordinate."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mbody.laws import MeasuredFormula

#: The key of what does not depend on a variable.
PLAIN = ""


@dataclass(frozen=True)
class LinearLaw:
    """A sum of variables with factors and of a constant, kept between two bounds."""

    parts: dict[str, float]
    low: float = -math.inf
    high: float = math.inf

    @property
    def constant(self) -> float | None:
        """Its value, where it has no variable."""
        return self.parts.get(PLAIN, 0.0) if set(self.parts) <= {PLAIN} else None

    @property
    def is_bounded(self) -> bool:
        """Whether a bound is finite."""
        return math.isfinite(self.low) or math.isfinite(self.high)

    def times(self, factor: float) -> LinearLaw:
        """The law times a number."""
        ends = sorted((self.low * factor, self.high * factor)) if factor else (0.0, 0.0)
        return LinearLaw({key: factor * part for key, part in self.parts.items()}, *ends)

    def plus(self, other: LinearLaw, sign: float = 1.0) -> LinearLaw | None:
        """The sum with another; None where both have variables and one is bounded."""
        if (
            other.constant is None
            and self.constant is None
            and (self.is_bounded or other.is_bounded)
        ):
            return None
        first, second = (self, other.times(sign))
        if first.constant is not None:
            first, second = second, first
        shift = second.constant if second.constant is not None else 0.0
        keys = {**first.parts, **second.parts}
        parts = {key: first.parts.get(key, 0.0) + second.parts.get(key, 0.0) for key in keys}
        return LinearLaw(parts, first.low + shift, first.high + shift)


def linear_law(law: MeasuredFormula) -> LinearLaw | None:
    """A formula as a linear law, None where it is none.

    >>> operations = ("variable", "* constant", "+ constant")
    >>> linear_law(MeasuredFormula("2*u - 1", operations, ("u",), (2, -1)))
    LinearLaw(parts={'u': 2.0, '': -1.0}, low=-inf, high=inf)
    """
    stack: list[LinearLaw] = []
    variables, constants = iter(law.variables), iter(law.constants)
    for operation in law.operations:
        if operation == "variable":
            stack.append(LinearLaw({next(variables): 1.0}))
            continue
        if operation == "constant":
            stack.append(LinearLaw({PLAIN: float(next(constants))}))
            continue
        if operation == "negative":
            made: LinearLaw | None = stack.pop().times(-1.0)
        elif operation.endswith(" constant"):
            made = _binary(operation[0], stack.pop(), LinearLaw({PLAIN: float(next(constants))}))
        elif operation in ("+", "-", "*", "/", "min", "max"):
            second = stack.pop()
            made = _binary(operation, stack.pop(), second)
        else:
            return None
        if made is None:
            return None
        stack.append(made)
    return stack[0] if len(stack) == 1 else None


def _binary(operation: str, a: LinearLaw, b: LinearLaw) -> LinearLaw | None:
    """The result of an operation on two laws, None where it is not linear."""
    if operation in ("+", "-"):
        return a.plus(b, 1.0 if operation == "+" else -1.0)
    if operation in ("*", "min", "max") and b.constant is None:
        a, b = b, a
    value = b.constant
    if value is None:
        return None
    if operation == "*":
        return a.times(value)
    if operation == "/" and value:
        return a.times(1.0 / value)
    if operation == "min":
        return LinearLaw(a.parts, min(a.low, value), min(a.high, value))
    if operation == "max":
        return LinearLaw(a.parts, max(a.low, value), max(a.high, value))
    return None
