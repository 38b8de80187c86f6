"""Derivatives of recorded formulas, as further steps: by time along the motion, by time alone, and
by one coordinate.

Each step is differentiated by the chain rule where it was recorded (automatic differentiation,
forward mode); what does not depend on the variable has no derivative, None, and costs no step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from mbody.system.formula_steps import Recorded, StepList

__all__ = [
    "JUMPS",
    "SIGNALS",
    "Differentiated",
    "NotSmooth",
    "along_motion",
    "by_coordinate",
    "by_time",
]

#: A derivative; None where it is zero.
Derivative: TypeAlias = "Recorded | None"
#: The derivative of a number of the instant, by the step that reads it.
Rule: TypeAlias = "Callable[[StepList, tuple[Any, ...]], Derivative]"

#: What a step reads, not computes.
READ = ("position", "velocity", "turn", "time", "parameter", "signal", "own")
#: Operations that jump; beside their jumps nothing changes.
JUMPS = ("sign", "step")
#: An input and its derivatives by time, as its law gives them.
SIGNALS = ("signal", "signal rate", "signal acceleration")


class NotSmooth(ValueError):
    """A formula has no derivative; the operation is the argument."""


class Differentiated:
    """Derivatives of the steps of a list by one variable.

    Parameters
    ----------
    steps : StepList
    rule : callable
        The derivative of what is read, such as `along_motion`.
    """

    def __init__(self, steps: StepList, rule: Rule) -> None:
        self.steps, self.rule = steps, rule
        self._known: dict[int, Derivative] = {}

    def of(self, one: Derivative) -> Derivative:
        """The derivative of a number.

        Raises
        ------
        NotSmooth
            For a table of two variables, which has no second derivative.
        """
        if one is None:
            return None
        if one.place not in self._known:
            self._known[one.place] = self._derivative(one)
        return self._known[one.place]

    def _derivative(self, one: Recorded) -> Derivative:
        steps = self.steps
        name, *operands = steps.steps[one.place]
        if name in READ or name in SIGNALS:
            return self.rule(steps, steps.steps[one.place])
        if name.startswith("law"):
            return self._of_law(name, operands)
        given = [Recorded(steps, place) for place in operands]
        rates = [self.of(each) for each in given]
        if all(rate is None for rate in rates) or name in JUMPS:
            return None
        if len(given) == 1:
            inner = self._inner(name, given[0], one)
            return inner * _there(rates[0])
        return self._of_two(name, one, *given, *rates)

    def _of_law(self, name: str, operands: list[int]) -> Derivative:
        """A curve at a number: its derivatives are steps of their own."""
        n, *places = operands
        rates = [self.of(Recorded(self.steps, place)) for place in places]
        if all(rate is None for rate in rates):
            return None
        if len(places) == 2:
            raise NotSmooth("table of two variables")
        following = {"law": "law rate", "law rate": "law bend"}[name]
        return self.steps.read(following, n, places[0]) * _there(rates[0])

    def _inner(self, name: str, a: Recorded, g: Recorded) -> Recorded:
        """g′(a) of a function of one number, whose value is g."""
        steps = self.steps

        def one(value: float) -> Recorded:
            return steps.number(value)

        if name == "negative":
            return one(-1.0)
        if name == "sin":
            return steps.operation("cos", a)
        if name == "cos":
            return steps.operation("negative", steps.operation("sin", a))
        if name == "tan":
            return one(1.0) + g * g
        if name == "exp":
            return g
        if name == "log":
            return one(1.0) / a
        if name == "sqrt":
            return one(0.5) / g
        if name == "abs":
            # a rate at a corner is that to the right
            return one(2.0) * steps.operation("step", a) - one(1.0)
        if name == "atan":
            return one(1.0) / (one(1.0) + a * a)
        root = steps.operation("sqrt", (one(1.0) - a) * (one(1.0) + a))
        return one(1.0 if name == "asin" else -1.0) / root

    def _of_two(
        self, name: str, g: Recorded, a: Recorded, b: Recorded, da: Derivative, db: Derivative
    ) -> Derivative:
        """The derivative of g(a, b)."""
        steps = self.steps
        if name == "+":
            return _sum(da, db)
        if name == "-":
            return _sum(da, _product(db, steps.number(-1.0)))
        if name == "*":
            return _sum(_product(da, b), _product(db, a))
        if name == "/":
            top = _sum(da, _product(db, steps.operation("negative", g)))
            return _there(top) / b
        if name == "hypot":
            return _there(_sum(_product(da, a), _product(db, b))) / g
        if name == "atan2":
            top = _sum(_product(da, b), _product(db, steps.operation("negative", a)))
            return _there(top) / (a * a + b * b)
        if name in ("min", "max"):
            first = steps.operation("step", b - a if name == "min" else a - b)
            rest = steps.number(1.0) - first
            return _sum(_product(da, first), _product(db, rest))
        # a ^ b
        by_base = _product(da, b * steps.operation("^", a, b - steps.number(1.0)))
        return _sum(by_base, None if db is None else db * g * steps.operation("log", a))


def _there(one: Derivative) -> Recorded:
    """A derivative that is known to be there."""
    assert one is not None
    return one


def _sum(a: Derivative, b: Derivative) -> Derivative:
    if a is None or b is None:
        return b if a is None else a
    return a + b


def _product(a: Derivative, b: Recorded) -> Derivative:
    return None if a is None else a * b


# -- what is differentiated by ---------------------------------------------------------------------


def _of_time(
    steps: StepList, what: tuple[Any, ...], rate_of: Callable[[str], Derivative]
) -> Derivative:
    """Time itself, inputs and own states by time; numbers of the description stay."""
    kind = what[0]
    if kind == "time":
        return steps.number(1.0)
    if kind in SIGNALS[:2]:
        return steps.read(SIGNALS[SIGNALS.index(kind) + 1], what[1])
    return rate_of(what[1]) if kind == "own" else None


def by_time(rate_of: Callable[[str], Derivative]) -> Rule:
    """∂/∂t at a position that stands still; `rate_of` an own state records its rate."""
    return lambda steps, what: _of_time(steps, what, rate_of)


def along_motion(rate_of: Callable[[str], Derivative], accelerated: bool = False) -> Rule:
    """d/dt along a motion, whose velocities stay as they are unless it is accelerated."""

    def rule(steps: StepList, what: tuple[Any, ...]) -> Derivative:
        kind, *rest = what
        if kind == "position":
            return steps.read("velocity", *rest)
        if kind == "turn":
            return _turning(steps, *rest) * steps.read("velocity", rest[0], 2)
        if kind == "velocity" and accelerated:
            return steps.read("acceleration", *rest)
        return _of_time(steps, what, rate_of)

    return rule


def by_coordinate(body: str, axis: int) -> Rule:
    """∂/∂x, ∂/∂y or ∂/∂θ of a body."""

    def rule(steps: StepList, what: tuple[Any, ...]) -> Derivative:
        if what == ("position", body, axis):
            return steps.number(1.0)
        if axis == 2 and what[:2] == ("turn", body):
            return _turning(steps, *what[1:])
        return None

    return rule


def _turning(steps: StepList, body: str, part: int) -> Recorded:
    """The derivative of a body's cos θ (part 0) or sin θ by θ."""
    if part:
        return steps.read("turn", body, 0)
    return steps.operation("negative", steps.read("turn", body, 1))
