"""The text of a tree, which `parse` reads as the same tree again."""

from __future__ import annotations

from fractions import Fraction

from mbody.quantities.tree import Binary, Call, Measured, Name, Negative, Node, Plain
from mbody.quantities.units import known

__all__ = ["text_of"]

# precedence: a part within one of higher precedence needs brackets
SUM, PRODUCT, FACTOR, POWER, MEASURED, PART = range(6)
SHOWN = 15  # digits of a number that is written without a power of ten


def text_of(node: Node) -> str:
    """A formula as text, with no more brackets than it needs.

    A number without a finite decimal form, which only results from units or quantities, becomes a
    quotient in brackets.

    >>> from mbody.quantities import parse
    >>> text_of(parse("(2)*((a+b)^2) - -(60 deg)"))
    '2 * (a + b)^2 - -60 deg'
    """
    return _of(node)[0]


def _of(node: Node, least: int = SUM) -> tuple[str, int]:
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
            return f"-{_of(below, FACTOR)[0]}", FACTOR
        case Measured():
            return _measured(node), MEASURED
        case Binary(operator="^", a=a, b=b):
            return f"{_of(a, PART)[0]}^{_of(b, FACTOR)[0]}", POWER
        case Binary(operator=operator, a=a, b=b):
            own = SUM if operator in "+-" else PRODUCT
            return f"{_of(a, own)[0]} {operator} {_of(b, own + 1)[0]}", own


def _measured(node: Measured) -> str:
    if not node.symbols:  # a quantity of pint: its symbol has the number
        return node.unit.symbol
    number = node.of.value if isinstance(node.of, Plain) else None
    if number is not None and number > 0 and _decimals(number) is None:
        return f"{number} {node.unit.symbol}"
    # only mbody's own units may follow a name without brackets
    bare = known(node.symbols[0]) or not isinstance(node.of, Name | Call)
    text = _of(node.of, PART)[0] if bare else f"({text_of(node.of)})"
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
        return (digits if len(digits) <= SHOWN or not short else f"{short}e{zeros}"), PART
    if max(len(digits), decimals) > SHOWN:
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
