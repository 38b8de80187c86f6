"""A law given by a formula, compiled to a postfix program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FloatArray, FormulaLaw, finite
from mbody.laws.postfix import CONSTANT, LOG, MAX_OPERATIONS, MAX_STACK, OPERATIONS, POWER_CONSTANT

__all__ = ["Expression", "stack_depth"]

ORDERS = ("value", "rate", "second derivative")


@dataclass(frozen=True, repr=False)
class Expression(FormulaLaw):
    """f = a formula of one variable, compiled to a small program; made by
    `mbody.laws.compile_formula`.

    f, f′ and f″ are exact to rounding. At a corner (of `abs`, `min`, `max`) the values are those to
    the right. Its numbers, "c0", "c1", …, are the parts of the formula that do not contain the
    variable.

    Parameters
    ----------
    text : str
        The formula as it was written.
    program : tuple of int
        Operations in postfix order, by their index in ``mbody.laws.postfix.OPERATIONS``: at most
        200, with at most 32 numbers on the stack.
    constants : tuple of float
        In the order in which the program takes them.

    Raises
    ------
    ModelError
        For an invalid program; later, where the formula has no finite value, or a requested
        derivative does not exist. The kernel returns NaN there.

    >>> Expression("10*sin(5*t)", (0, 3, 7, 3), (5.0, 10.0)).derivatives(0.0)
    (0.0, 50.0, 0.0)
    """

    kind: ClassVar[str] = "expression"

    text: str
    program: tuple[int, ...]
    constants: tuple[float, ...]

    def __post_init__(self) -> None:
        program = tuple(int(code) for code in self.program)
        constants = tuple(
            finite(value, "Expression", f"constants[{n}]") for n, value in enumerate(self.constants)
        )
        object.__setattr__(self, "program", program)
        object.__setattr__(self, "constants", constants)
        if not isinstance(self.text, str):
            raise ModelError(f"Expression: text must be the formula, not {self.text!r}")
        if not program or min(program) < 0 or max(program) >= len(OPERATIONS):
            raise ModelError(
                f"Expression: program must contain indices of operations, not {program}"
            )
        taken = sum(CONSTANT <= code <= POWER_CONSTANT for code in program)
        if taken != len(constants):
            raise ModelError(
                f"Expression: the program takes {taken} constants, there are {len(constants)}"
            )
        if len(program) > MAX_OPERATIONS or stack_depth(program) > MAX_STACK:
            raise ModelError(
                f"Expression: the program has {len(program)} operations and a stack of "
                f"{stack_depth(program)} numbers, at most {MAX_OPERATIONS} and {MAX_STACK} are "
                "possible"
            )

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"

    def table(self) -> FloatArray:
        """[length, operations of the program]."""
        return np.array([len(self.program), *self.program], dtype=float)

    def _check_values(self, xs: FloatArray, out: FloatArray) -> None:
        # a rate may be infinite, as that of sqrt(t) at 0: correct, but of no use for a driver
        bad = np.argwhere(np.isnan(out))
        if bad.size:
            at, order = bad[0]
            raise ModelError(
                f"'{self.text}' has no {ORDERS[order]} at {xs[at]:g}: evaluate it elsewhere, or "
                "choose a formula that has one there, for example with max or min"
            )


def stack_depth(program: tuple[int, ...]) -> int:
    """The largest number of values that a program has on its stack.

    Raises
    ------
    ModelError
        When it uses values that are not on the stack, or leaves more than one.

    >>> stack_depth((0, 0, 19))
    2
    """
    depth = deepest = 0
    for code in program:
        depth += 1 if code <= CONSTANT else -1 if code > LOG else 0
        deepest = max(deepest, depth)
        if depth < 1:
            raise ModelError("Expression: the program uses a number that is not on the stack")
    if depth != 1:
        raise ModelError(f"Expression: the program leaves {depth} numbers, not one")
    return deepest
