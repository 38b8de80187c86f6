"""Parse a formula: numbers with units, parameters, the usual arithmetic. Nothing is executed.

    formula := term (("+" | "-") term)*
    term    := factor (("*" | "·" | "/") factor)*
    factor  := ("-" | "+") factor | power
    power   := part (("^" | "**") factor)?
    part    := (number | name | call | "(" formula ")") unit?

A unit follows a number, a name or a bracket directly and binds more tightly than arithmetic:
``20 lbf/in``, ``-40 rad/s^2``, ``1/4 in``, ``(a + b) mm``. Within it ``*``, ``/`` and ``-`` are
written without spaces, as in ``5 N*m`` and ``12 in-lbf``.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import ClassVar, TypeAlias

from mbody.quantities.units import SYMBOLS, Unit, known, pint_unit

# -- The syntax tree of a formula, before evaluation -------------------------------------------
#
# Every node has the set of names that occur in it and below it.


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


#: Functions of a formula, and how many numbers each takes.
FUNCTIONS = {
    **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan"), 1),
    **dict.fromkeys(("sqrt", "abs", "exp", "log", "sign", "step"), 1),
    **dict.fromkeys(("atan2", "hypot", "min", "max", "deadband"), 2),
    "clamp": 3,
}
#: Variables of laws: time, and the argument of a spring's or damper's law.
VARIABLES = ("t", "x")

MAX_CHARACTERS = 2000
MAX_NESTING = 40  # of brackets
MAX_OPERATIONS = 200  # a larger tree may exceed the recursion limit of Python
MAX_POWER = 400  # of ten in a number: larger ones are no doubles

RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹"

_TOKEN = re.compile(
    r"""(?P<space>\s+)
    |(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    |(?P<name>[^\W\d⁰¹²³⁴-⁹][^\W⁰¹²³⁴-⁹]*(?:\.[^\W\d⁰¹²³⁴-⁹][^\W⁰¹²³⁴-⁹]*)*|["'°])
    |(?P<operator>\*\*|[-+*/^(),·−⁰¹²³⁴-⁹])""",
    re.VERBOSE,
)


class FormulaError(ValueError):
    """An invalid formula; the message follows the name of the element and the field."""


class _Token:
    __slots__ = ("after_space", "kind", "text")

    def __init__(self, kind: str, text: str, after_space: bool) -> None:
        self.kind, self.text, self.after_space = kind, text, after_space


END = _Token("end", "", True)


def shown(text: str) -> str:
    """A text for an error message: quoted, and cut where it is long."""
    return repr(text if len(text) <= 60 else text[:57] + "...")


def parse(text: str, *, curves: bool = False) -> Node:
    """The tree of a formula.

    `text`: The formula.
    `curves`: Whether functions may be called that are not known here: curves of a mechanism.
    Raises FormulaError for anything that is not a formula; the message names the reason.

    >>> parse("2*a")
    Binary(operator='*', a=Plain(value=Fraction(2, 1)), b=Name(name='a'))
    """
    if len(text) > MAX_CHARACTERS:
        raise FormulaError(f"it is {len(text)} characters long, at most {MAX_CHARACTERS} are read")
    return _tree(text, curves)


@functools.lru_cache(maxsize=4096)
def _tree(text: str, curves: bool) -> Node:
    # trees are immutable, and designs of a search ask for the same quantities again and again
    tokens = _tokens(text)
    operations = sum(token.kind == "operator" and token.text not in "()," for token in tokens)
    if operations > MAX_OPERATIONS:
        raise FormulaError(
            f"{shown(text)} has {operations} operations, at most {MAX_OPERATIONS} are read"
        )
    return _Reader(tokens, text, curves).whole()


def parse_unit(text: str) -> Node:
    """The tree of one such unit, ``"N m"`` or ``"1/s"``.

    Raises FormulaError as of `parse`.

    >>> parse_unit("mm") == parse("1 mm")
    True
    """
    above, *below = text.split("/") if text.startswith("1/") else [text]
    node: Node = Plain(Fraction(1)) if below else parse(f"1 {above}")
    for unit in below:
        node = Binary("/", node, parse(f"1 {unit}"))
    return node


def _tokens(text: str) -> list[_Token]:
    found: list[_Token] = []
    at, space = 0, True
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise FormulaError(
                f"{shown(text)} contains {text[at]!r}, which is not allowed in a formula"
            )
        kind, word = str(match.lastgroup), match.group()
        at = match.end()
        if kind == "space":
            space = True
            continue
        found.append(_Token(kind, word.replace("−", "-").replace("·", "*"), space))
        space = False
    return found


#: What else the greatest and least of two numbers may be meant to be.
OF_ALL_INSTANTS = (
    "; the greatest of all instants is max(…) of a whole measure, greatest less least is span(…)"
)


def _apart(text: str) -> str:
    """Units that are written as one word with a sign between them; "" where it has others.

    >>> _apart("kgmm2")
    'kg*mm^2'
    """
    for end in range(min(len(text), 20), 0, -1):
        if text[:end] not in SYMBOLS:
            continue
        power = text[end : end + 1] if text[end : end + 1] in ("2", "3") else ""
        rest = text[end + len(power) :]
        first = f"{text[:end]}^{power}" if power else text[:end]
        if not rest or (more := _apart(rest)):
            return f"{first}*{more}" if rest else first
    return ""


class _Reader:
    """Recursive descent over the tokens."""

    def __init__(self, tokens: list[_Token], text: str, curves: bool) -> None:
        self.tokens, self.text, self.curves = tokens, text, curves
        self.at, self.depth = 0, 0

    def peek(self, ahead: int = 0) -> _Token:
        return self.tokens[self.at + ahead] if self.at + ahead < len(self.tokens) else END

    def take(self) -> _Token:
        token = self.peek()
        self.at += 1
        return token

    def operator(self, *texts: str) -> str:
        """The next operator if it is one of these, which is then consumed; else empty."""
        token = self.peek()
        if token.kind == "operator" and token.text in texts:
            self.at += 1
            return token.text
        return ""

    def whole(self) -> Node:
        if not self.tokens:
            raise FormulaError("it is empty: give a number")
        node = self.sum()
        token = self.peek()
        if token is not END:
            remedy = self.why_stray(token)
            raise FormulaError(f"{shown(self.text)} is not a formula: {remedy}")
        return node

    def why_stray(self, token: _Token) -> str:
        before = self.tokens[self.at - 1]
        if token.text == "," and before.kind == "number":
            return "write a decimal point, not a comma"
        if token.text == ",":
            return "the ',' is not within a function"
        if token.text == ")":
            return "a '(' is missing"
        if token.kind == "name" and self.peek(1).text == "(":
            if known(token.text):
                return "an operator is missing before '('"
            if token.text in FUNCTIONS:
                return f"an operator is missing before {token.text!r}"
            return f"there is no function {token.text[:40]!r} (there are: {', '.join(FUNCTIONS)})"
        if token.kind == "name" and before.kind in ("number", "name"):
            from mbody.core.other_words import meant

            near, apart = meant(token.text, SYMBOLS, 0.75), _apart(token.text)
            close = near or apart or meant(token.text, SYMBOLS, 0.5)
            hint = f", did you mean {close!r}?" if close else ""
            return f"there is no unit {token.text[:40]!r}{hint}"
        if before.text in RAISED and self.unit_of(token):
            base = self.tokens[self.at - 2].text
            power = f"({base if base != ')' else '(…)'}{before.text})"
            following = self.tokens[self.at + 1 :]
            joined = itertools.takewhile(lambda one: not one.after_space, following)
            unit = "".join([token.text, *(one.text for one in joined)])
            return f"put brackets before the unit, as in '{power} {unit}'"
        return f"an operator is missing before {token.text[:40]!r}"

    def nested(self, read: Callable[[], Node]) -> Node:
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise FormulaError(f"{shown(self.text)} is nested more than {MAX_NESTING} deep")
        node = read()
        self.depth -= 1
        return node

    def sum(self) -> Node:
        node = self.product()
        while operator := self.operator("+", "-"):
            node = Binary(operator, node, self.product())
        return node

    def product(self) -> Node:
        node = self.factor()
        while operator := self.operator("*", "/"):
            node = Binary(operator, node, self.factor())
        return node

    def factor(self) -> Node:
        if self.operator("-"):
            return Negative(self.nested(self.factor))
        if self.operator("+"):
            return self.nested(self.factor)
        return self.power()

    def power(self) -> Node:
        base = self.part()
        if self.operator("^", "**"):
            return Binary("^", base, self.nested(self.factor))
        if digit := self.operator(*RAISED):
            return Binary("^", base, Plain(Fraction(RAISED.index(digit))))
        return base

    def part(self) -> Node:
        token = self.take()
        node: Node
        if token.kind == "number":
            node = self.number(token)
        elif token.kind == "name":
            node = self.call(token) if self.peek().text == "(" else Name(token.text)
            if token.text in ('"', "'", "°"):
                raise FormulaError(f"{shown(self.text)} has a {token.text} without a number")
        elif token.text == "(":
            node = self.nested(self.sum)
            if not self.operator(")"):
                raise FormulaError(f"{shown(self.text)} lacks a ')'")
        elif token is END:
            raise FormulaError(f"{shown(self.text)} ends where a number is expected")
        else:
            raise FormulaError(f"{shown(self.text)} has {token.text!r} where a number is expected")
        return self.with_unit(node, token)

    def number(self, token: _Token) -> Node:
        value = self.exact(token.text)
        # a fraction before a unit is one number, as on a drawing: 1/4 in
        slash, below, unit = (self.peek(k) for k in range(3))
        tight = slash.text == "/" and not (slash.after_space or below.after_space)
        whole = token.text.isdigit() and below.kind == "number" and below.text.isdigit()
        if tight and whole and unit.kind == "name" and int(below.text[:9]) and self.unit_of(unit):
            self.at += 2
            value /= self.exact(below.text)
        return Plain(value)

    def exact(self, text: str) -> Fraction:
        digits, _, power = text.lower().partition("e")
        if len(digits) > MAX_POWER or abs(int(power[:6] or "0")) > MAX_POWER:
            raise FormulaError(
                f"{shown(text)} is too large or too small for a number of double precision"
            )
        return Fraction(text)

    def call(self, token: _Token) -> Node:
        known = token.text in FUNCTIONS
        if not known and not (self.curves and token.text.isidentifier()):
            self.at += 1
            raise FormulaError(
                f"{shown(self.text)}: there is no function {token.text[:40]!r} (there are: "
                f"{', '.join(FUNCTIONS)})"
            )
        self.take()
        arguments = [self.nested(self.sum)]
        while self.operator(","):
            arguments.append(self.nested(self.sum))
        if not self.operator(")"):
            raise FormulaError(f"{shown(self.text)} lacks a ')'")
        wanted = FUNCTIONS.get(token.text, 0)
        if known and len(arguments) != wanted:
            number = ("one number", "two numbers", "three numbers")[wanted - 1]
            raise FormulaError(
                f"{shown(self.text)}: {token.text} takes {number}, not {len(arguments)}"
                + (OF_ALL_INSTANTS if token.text in ("max", "min") else "")
            )
        return Call(token.text, tuple(arguments))

    # -- units --------------------------------------------------------------------------------

    def unit_of(self, token: _Token) -> Unit | None:
        """The unit of a symbol, one of mbody's own or of pint; None if there is none."""
        if token.kind != "name":
            return None
        return known(token.text) or pint_unit(token.text)

    def with_unit(self, node: Node, before: _Token) -> Node:
        """The node, times the unit that follows it."""
        token = self.peek()
        if token.kind != "name" or self.peek(1).text == "(":
            return node
        unit = known(token.text) if before.kind == "name" else self.unit_of(token)
        if unit is None:
            return node
        self.take()
        symbols = [token.text]
        unit = self.to_power(unit)
        while step := self.chained():
            operator, word, skip = step
            self.at += skip
            symbols.append(word)
            further = self.to_power(SYMBOLS[word])
            unit = unit / further if operator == "/" else unit * further
        return Measured(node, unit, tuple(symbols))

    def to_power(self, unit: Unit) -> Unit:
        """The unit to the power that follows it."""
        token, power, digits = self.peek(), self.peek(1), self.peek(2)
        if token.after_space or token.kind != "operator":
            return unit
        if token.text in RAISED:
            self.at += 1
            return unit ** RAISED.index(token.text)
        if token.text not in ("^", "**"):
            return unit
        minus = power.text == "-"
        digits = digits if minus else power
        if digits.kind != "number" or not digits.text.isdigit() or len(digits.text) > 1:
            raise FormulaError(
                f"{shown(self.text)}: the power of the unit '{unit.symbol}' must be one digit"
            )
        self.at += 3 if minus else 2
        return unit ** (-int(digits.text) if minus else int(digits.text))

    def chained(self) -> tuple[str, str, int] | None:
        """The continuation of a unit: operator, symbol, and their number of tokens."""
        token, word = self.peek(), self.peek(1)
        if token.kind == "name" and token.text in SYMBOLS and token.text not in VARIABLES:
            return ("*", token.text, 1) if self.peek(1).text != "(" else None
        tight = not (token.after_space or word.after_space)
        if tight and token.text in ("*", "/", "-") and word.kind == "name":
            following = self.peek(2).text
            if word.text in SYMBOLS and word.text not in VARIABLES and following != "(":
                return token.text, word.text, 2
        return None
