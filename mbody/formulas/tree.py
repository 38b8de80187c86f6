"""The tree of a formula: what the text says, before anything is computed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from mbody.units import Unit

__all__ = ["Binary", "Call", "Measured", "Name", "Negative", "Node", "Plain", "names_in", "walk"]


@dataclass(frozen=True)
class Plain:
    """A plain number, exact as it was written."""

    value: Fraction


@dataclass(frozen=True)
class Measured:
    """What stands before a unit, times the unit: ``1.5 lbf``, ``(a + b) mm``."""

    of: Node
    unit: Unit
    symbols: tuple[str, ...]


@dataclass(frozen=True)
class Name:
    """A parameter, the variable, or a unit by itself."""

    name: str


@dataclass(frozen=True)
class Negative:
    """−a."""

    of: Node


@dataclass(frozen=True)
class Binary:
    """a + b, a − b, a · b, a / b or a ^ b."""

    operator: str
    a: Node
    b: Node


@dataclass(frozen=True)
class Call:
    """A function of one or two numbers."""

    function: str
    arguments: tuple[Node, ...]


Node: TypeAlias = Plain | Measured | Name | Negative | Binary | Call


def walk(node: Node, beside: tuple[str, ...] = ()) -> Iterator[Node]:
    """The node and all below it, but not what the functions `beside` take."""
    yield node
    match node:
        case Measured(of=below) | Negative(of=below):
            yield from walk(below, beside)
        case Binary(a=a, b=b):
            yield from walk(a, beside)
            yield from walk(b, beside)
        case Call(function=function, arguments=arguments) if function not in beside:
            for argument in arguments:
                yield from walk(argument, beside)


def names_in(node: Node) -> set[str]:
    """All names that the formula uses."""
    return {part.name for part in walk(node) if isinstance(part, Name)}
