"""The syntax tree of a formula, before evaluation.

Every node has the set of names that occur in it and below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import ClassVar, TypeAlias

from mbody.quantities.units import Unit, known


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


# -- Functions written out by others: programs need no operation for them ----------------------


def expanded(node: Node) -> Node:
    """The tree with every `clamp` and `deadband` written as sums, `min` and `max`.

    ``clamp(x, low, high)`` is x within low … high (a saturation), ``deadband(x, w)`` is 0 within
    −w … w and x ∓ w beyond it.

    >>> from mbody.quantities import parse, text_of
    >>> text_of(expanded(parse("clamp(x, -1, 2)"))), text_of(expanded(parse("deadband(x, 3)")))
    ('max(min(x, 2), -1)', 'x - max(min(x, 3), -3)')
    """
    match node:
        case Measured(of=below) | Negative(of=below):
            return replace(node, of=expanded(below))
        case Binary(a=a, b=b):
            return replace(node, a=expanded(a), b=expanded(b))
        case Call(function=function, arguments=arguments):
            given = tuple(expanded(argument) for argument in arguments)
            if function == "clamp":
                return _within(*given)
            if function == "deadband":
                x, width = given
                return Binary("-", x, _within(x, Negative(width), width))
            return Call(function, given)
    return node


def _within(x: Node, low: Node, high: Node) -> Node:
    return Call("max", (Call("min", (x, high)), low))


# -- The text of a tree, which `parse` reads as the same tree again ----------------------------

# precedence: a part within one of higher precedence needs brackets
SUM, PRODUCT, FACTOR, POWER, MEASURED, PART = range(6)
MOST_DIGITS = 15  # digits of a number that is written without a power of ten


def text_of(node: Node) -> str:
    """A formula as text, with no more brackets than it needs.

    A number without a finite decimal form, which only results from units or quantities, becomes a
    quotient in brackets.

    >>> from mbody.quantities import parse
    >>> text_of(parse("(2)*((a+b)^2) - -(60 deg)"))
    '2 * (a + b)^2 - -60 deg'
    """
    return _bracketed(node)[0]


def _bracketed(node: Node, least: int = SUM) -> tuple[str, int]:
    """Text and its precedence; in brackets where that is less than `least`."""
    text, binds = _bare(node)
    return (f"({text})", PART) if binds < least else (text, binds)


def _bare(node: Node) -> tuple[str, int]:
    match node:
        case Plain(value=value):
            return _number(value)
        case Name(name=name):
            return name, PART
        case Call(function=function, arguments=arguments):
            return f"{function}({', '.join(text_of(argument) for argument in arguments)})", PART
        case Negative(of=below):
            return f"-{_bracketed(below, FACTOR)[0]}", FACTOR
        case Measured():
            return _measured(node), MEASURED
        case Binary(operator="^", a=a, b=b):
            return f"{_bracketed(a, PART)[0]}^{_bracketed(b, FACTOR)[0]}", POWER
        case Binary(operator=operator, a=a, b=b):
            own = SUM if operator in "+-" else PRODUCT
            return f"{_bracketed(a, own)[0]} {operator} {_bracketed(b, own + 1)[0]}", own


def _measured(node: Measured) -> str:
    if not node.symbols:  # a quantity of pint: its symbol has the number
        return node.unit.symbol
    number = node.of.value if isinstance(node.of, Plain) else None
    if number is not None and number > 0 and _decimals(number) is None:
        return f"{number} {node.unit.symbol}"
    # only mbody's own units may follow a name without brackets
    bare = known(node.symbols[0]) or not isinstance(node.of, Name | Call)
    text = _bracketed(node.of, PART)[0] if bare else f"({text_of(node.of)})"
    return f"{text} {node.unit.symbol}"


def _number(value: Fraction) -> tuple[str, int]:
    """An exact number, whole or with decimals, with a power of ten where it is long."""
    if value < 0:
        return f"-{_number(-value)[0]}", FACTOR
    decimals = _decimals(value)
    if decimals is None:
        return f"{value.numerator} / {value.denominator}", PRODUCT
    digits = str(int(value * 10**decimals))
    if decimals == 0:
        short = digits.rstrip("0")
        zeros = len(digits) - len(short)
        return (digits if len(digits) <= MOST_DIGITS or not short else f"{short}e{zeros}"), PART
    if max(len(digits), decimals) > MOST_DIGITS:
        return f"{digits}e-{decimals}", PART
    return f"{digits[:-decimals] or 0}.{digits[-decimals:].rjust(decimals, '0')}", PART


def _decimals(value: Fraction) -> int | None:
    """Number of decimals of the exact decimal form, None where there is none."""
    below, powers = value.denominator, []
    for prime in (2, 5):
        powers.append(0)
        while below % prime == 0:
            below //= prime
            powers[-1] += 1
    return max(powers) if below == 1 else None
