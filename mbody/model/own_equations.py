"""Equations that an element brings with it: states of its own, and laws made of its numbers.

An element writes them as text, by the names of its own fields and states: a DC motor
``"constant * current"``. They become formulas of measured quantities, in which each of these names
has the element's before it, as ``motor.current``.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.laws.measured_formula import MeasuredFormula
from mbody.laws.postfix_program import PostfixProgram
from mbody.model.primitives import Signal
from mbody.quantities import Scope, evaluate, parse
from mbody.quantities.expansions import expanded
from mbody.quantities.tree import Binary, Call, Measured, Name, Negative, Node
from mbody.quantities.units import DIMENSIONS, Dimension

__all__ = ["AccountedEnergy", "OwnState", "equation", "owned", "signal_of"]


@dataclass(frozen=True)
class OwnState:
    """A state that an element brings, integrated with the motion as a `State`.

    Attributes
    ----------
    name : str
        Dotted: ``"motor.current"``.
    rate : MeasuredFormula
        Its rate.
    measure : str
        What it measures, a name of `DIMENSIONS`.
    start : float or "steady"
        At the first instant.
    start_number : str
        The element's number that is the start, by dotted name; empty where it is always zero.
    size : float, optional
        A typical value, to which its absolute error is relative.
    accounts : bool
        Whether it only adds up, for the account of energy: nothing follows from it.
    """

    name: str
    rate: MeasuredFormula
    measure: str
    start: Any = 0.0
    start_number: str = ""
    size: float | None = None
    accounts: bool = False

    @property
    def dimension(self) -> Dimension:
        """What it measures."""
        return DIMENSIONS[self.measure]


@dataclass(frozen=True)
class AccountedEnergy:
    """A part of the account of energy that an element names beside its work.

    Attributes
    ----------
    kind : str
        "work" (what it takes from outside), "lost" or "stored".
    values : array (instants,)
        Since the beginning, or in store.
    """

    kind: str
    values: np.ndarray[Any, Any]


@functools.lru_cache(maxsize=256)
def equation(text: str, owner: str) -> MeasuredFormula:
    """The formula of an element's own text, whose names are its own; numbers in it are plain.

    >>> equation("constant * current", "motor").variables
    ('motor.constant', 'motor.current')
    """
    tree = owned(expanded(parse(text)), owner)
    program = PostfixProgram(tree.names)
    program.add(tree)
    constants = tuple(float(evaluate(part, Scope()).value) for part in program.constants)
    return MeasuredFormula(text, tuple(program.operations), tuple(program.taken), constants)


def signal_of(law: MeasuredFormula) -> Signal:
    """A law made by `equation`, as the kernels take it."""
    return Signal(law, list(law.constants))


def owned(node: Node, owner: str) -> Node:
    """The tree with the owner's name before every name."""
    match node:
        case Name(name=name):
            return node if name == "t" else Name(f"{owner}.{name}")
        case Measured(of=below) | Negative(of=below):
            return replace(node, of=owned(below, owner))
        case Binary(a=a, b=b):
            return replace(node, a=owned(a, owner), b=owned(b, owner))
        case Call(function=function, arguments=arguments):
            return Call(function, tuple(owned(argument, owner) for argument in arguments))
    return node
