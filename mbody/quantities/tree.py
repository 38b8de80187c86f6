"""The syntax tree of a formula, before evaluation.

Every node has the set of names that occur in it and below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import ClassVar, TypeAlias

from mbody.quantities.units import Unit

__all__ = [
    "Binary",
    "Call",
    "Measured",
    "Name",
    "Negative",
    "Node",
    "Plain",
    "called",
    "units_of_powers",
    "walk",
]


def _names() -> frozenset[str]:
    return field(init=False, repr=False, compare=False)


@dataclass(frozen=True)
class Plain:
    """A plain number, exact as it was written."""

    names: ClassVar[frozenset[str]] = frozenset()
    value: Fraction


@dataclass(frozen=True)
class Measured:
    """The part before a unit, times the unit: ``1.5 lbf``, ``(a + b) mm``."""

    of: Node
    unit: Unit
    symbols: tuple[str, ...]
    names: frozenset[str] = _names()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", self.of.names)


@dataclass(frozen=True)
class Name:
    """A parameter, the variable, or a unit by itself."""

    name: str
    names: frozenset[str] = _names()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", frozenset((self.name,)))


@dataclass(frozen=True)
class Negative:
    """−a."""

    of: Node
    names: frozenset[str] = _names()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", self.of.names)


@dataclass(frozen=True)
class Binary:
    """a + b, a − b, a · b, a / b or a ^ b."""

    operator: str
    a: Node
    b: Node
    names: frozenset[str] = _names()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", self.a.names | self.b.names)


@dataclass(frozen=True)
class Call:
    """A function of one to three numbers, or a curve of a mechanism."""

    function: str
    arguments: tuple[Node, ...]
    names: frozenset[str] = _names()

    def __post_init__(self) -> None:
        found = frozenset[str]().union(*(argument.names for argument in self.arguments))
        object.__setattr__(self, "names", found)


Node: TypeAlias = Plain | Measured | Name | Negative | Binary | Call


def walk(node: Node, except_in: tuple[str, ...] = ()) -> Iterator[Node]:
    """The node and all nodes below it, except the arguments of the functions `except_in`."""
    left = [node]
    while left:
        part = left.pop()
        yield part
        match part:
            case Measured(of=below) | Negative(of=below):
                left.append(below)
            case Binary(a=a, b=b):
                left += (b, a)
            case Call(function=function, arguments=arguments) if function not in except_in:
                left += reversed(arguments)


def called(node: Node) -> frozenset[str]:
    """The functions in a formula."""
    return frozenset(part.function for part in walk(node) if isinstance(part, Call))


def units_of_powers(node: Node) -> Node:
    """The tree in which the units of exponents are those of the powers: (2^3) mm of 2^3 mm.

    >>> from mbody.quantities.parse import parse
    >>> units_of_powers(parse("2^3 mm")) == parse("(2^3) mm")
    True
    """
    match node:
        case Binary(operator="^", a=a, b=Measured(of=below, unit=unit, symbols=symbols)):
            return Measured(Binary("^", units_of_powers(a), below), unit, symbols)
        case Binary(operator="^", a=a, b=Negative(of=Measured(of=below, unit=u, symbols=s))):
            return Measured(Binary("^", units_of_powers(a), Negative(below)), u, s)
        case Binary(operator=operator, a=a, b=b):
            return Binary(operator, units_of_powers(a), units_of_powers(b))
        case Measured(of=below):
            return replace(node, of=units_of_powers(below))
        case Negative(of=below):
            return Negative(units_of_powers(below))
        case Call(function=function, arguments=arguments):
            return Call(function, tuple(units_of_powers(one) for one in arguments))
    return node
