"""Equations as lists of terms, each a product of symbols with values: one source of every form."""

from __future__ import annotations

import cmath
import math
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mbody.reports.latex import escaped
from mbody.sheets.text_table import number

__all__ = ["Equation", "Factor", "Line", "Symbol", "Term", "vanishing"]

#: An equation, or a part of it: pieces of text and LaTeX, between which a line may be broken.
Line = list[tuple[str, str]]

_GREEK = {"θ": r"\theta", "ω": r"\omega", "α": r"\alpha", "φ": r"\varphi", "ρ": r"\rho"}
_DOTS = ("", "\N{COMBINING DOT ABOVE}", "\N{COMBINING DIAERESIS}")
_ACCENTS = ("", r"\dot", r"\ddot")
#: Names as of points, O2, and numbers of links with an axis, 32x.
_SHORT = re.compile(r"[A-Za-z]\d?|(\d{1,2}|\(\d+,\d+\))[xy]?")


@dataclass(frozen=True)
class Symbol:
    """A quantity with its value.

    Attributes
    ----------
    letter : str
        One letter, Latin or Greek.
    index : tuple of str
        Its parts; short ones are written together, as in F32x, others in brackets.
    value : float
        In the units of the mechanism, an angle in rad.
    dots : int
        How often it is differentiated by time.
    """

    letter: str
    index: tuple[str, ...]
    value: float
    dots: int = 0

    @property
    def short(self) -> bool:
        """Whether the parts of the index need no commas between them."""
        return all(_SHORT.fullmatch(part) for part in self.index)

    @property
    def text(self) -> str:
        """As plain text.

        >>> Symbol("F", ("32x",), 1.0).text, Symbol("r", ("pin", "B"), 1.0, dots=1).text
        ('F32x', 'ṙ(pin,B)')
        """
        letter = unicodedata.normalize("NFC", self.letter + _DOTS[self.dots])
        if self.short:
            return letter + "".join(self.index)
        if self.index[0][0] in "0123456789(":
            return letter + ",".join(self.index)
        return f"{letter}({','.join(self.index)})"

    @property
    def rich(self) -> str:
        """As words of a document write it, with an index.

        >>> Symbol("F", ("32x",), 1.0).rich
        'F_{32x}'
        """
        text = self.text
        return f"{text[0]}_{{{text[1:]}}}"

    @property
    def latex(self) -> str:
        r"""In LaTeX.

        >>> print(Symbol("ω", ("3",), 1.0).latex, Symbol("r", ("a_1", "B"), 1.0, dots=2).latex)
        \omega_{3} \ddot{r}_{\mathrm{a\_1},B}
        """
        letter = _GREEK.get(self.letter, self.letter)
        if self.dots:
            letter = f"{_ACCENTS[self.dots]}{{{letter}}}"
        if not self.index:
            return letter
        parts = [
            part if _SHORT.fullmatch(part) else rf"\mathrm{{{escaped(part)}}}"
            for part in self.index
        ]
        return f"{letter}_{{{('' if self.short else ',').join(parts)}}}"


@dataclass(frozen=True)
class Factor:
    """A symbol in a product: itself, its square, or a function of it.

    Attributes
    ----------
    symbol : Symbol
    function : str
        "", "cos" or "sin", or "exp" of i times an angle.
    power : int
    """

    symbol: Symbol
    function: str = ""
    power: int = 1

    @property
    def value(self) -> complex:
        """The number; it is real but of "exp"."""
        x = self.symbol.value
        if self.function == "exp":
            return cmath.exp(1j * x)
        functions = {"": float, "cos": math.cos, "sin": math.sin}
        return float(functions[self.function](x) ** self.power)

    @property
    def symbols(self) -> tuple[str, str]:
        """Text and LaTeX in symbols."""
        text, latex = self.symbol.text, self.symbol.latex
        if self.function == "exp":
            return f"e^(i {text})", rf"e^{{\mathrm{{i}}\,{latex}}}"
        if self.function:
            return f"{self.function} {text}", rf"\{self.function} {latex}"
        return (f"{text}²", f"{latex}^2") if self.power == 2 else (text, latex)

    @property
    def numbers(self) -> tuple[str, str]:
        """Text and LaTeX with the number; angles in degrees."""
        if self.function:
            degrees = round(math.degrees(self.symbol.value), 4) + 0.0
            text = f"{degrees:.4f}".rstrip("0").rstrip(".")
            return f"{self.function} {_bracketed(text)}°".replace(")°", "°)"), (
                rf"\{self.function}({text}^\circ)"
            )
        text, latex = _bracketed(number(self.symbol.value)), _typeset(self.symbol.value)
        return (f"{text}²", f"{latex}^2") if self.power == 2 else (text, latex)


@dataclass(frozen=True)
class Term:
    """A signed product of factors.

    Attributes
    ----------
    sign : int
        1 or -1.
    factors : sequence of Factor
    times : int
        A whole number before them.
    """

    sign: int
    factors: Sequence[Factor]
    times: int = 1

    @property
    def value(self) -> complex:
        """Its number, real but of vectors."""
        found: complex = math.prod((factor.value for factor in self.factors), start=self.times)
        return self.sign * found

    def piece(self, numbers: bool, first: bool) -> tuple[str, str]:
        """Text and LaTeX, with the sign before it."""
        parts = [factor.numbers if numbers else factor.symbols for factor in self.factors]
        if self.times != 1:
            parts.insert(0, (str(self.times), str(self.times)))
        between = ("·", r" \cdot ") if numbers else (" ", r"\,")
        text, latex = (sign.join(part[n] for part in parts) for n, sign in enumerate(between))
        if first and self.sign > 0:
            # a negative number that begins a line needs no brackets
            return re.sub(r"^\((-[^)]*)\)", r"\1", text), re.sub(r"^\((-[^)]*)\)", r"\1", latex)
        sign = "-" if self.sign < 0 else "+"
        return (sign + text, sign + latex) if first else (f"{sign} {text}", f"{sign} {latex}")


@dataclass(frozen=True)
class Equation:
    """Σ left = Σ right.

    Attributes
    ----------
    name : str
        What it is, such as "ΣFx".
    left, right : sequences of Term
        Without any of them 0 is written.
    """

    name: str
    left: Sequence[Term]
    right: Sequence[Term] = ()

    @property
    def residual(self) -> float:
        """Left less right side, its magnitude where it is one of vectors."""
        found = sum(t.value for t in self.left) - sum(t.value for t in self.right)
        return abs(found)

    @property
    def size(self) -> float:
        """Magnitude of the greatest term."""
        return max((abs(t.value) for t in (*self.left, *self.right)), default=0.0)

    def line(self, numbers: bool = False) -> Line:
        """The equation in symbols, or with its numbers."""
        return [*self._side(self.left, numbers), *_equals(self._side(self.right, numbers))]

    def _side(self, terms: Sequence[Term], numbers: bool) -> Line:
        return [t.piece(numbers, first=not n) for n, t in enumerate(terms)] or [("0", "0")]

    @property
    def symbols(self) -> Iterator[Symbol]:
        """All symbols, in order."""
        for t in (*self.left, *self.right):
            for factor in t.factors:
                yield factor.symbol


def _equals(side: Line) -> Line:
    (text, latex), *others = side
    return [(f"= {text}", f"= {latex}"), *others]


def vanishing(value: float, floor: float) -> float:
    """The same, 0 for what is no more than `floor`, rounding beside others of its kind."""
    return 0.0 if abs(value) <= floor else float(value)


def _bracketed(text: str) -> str:
    return f"({text})" if text.startswith("-") else text


def _typeset(value: float) -> str:
    r"""A number in LaTeX.

    >>> print(_typeset(-1.5e-7))
    (-1.5 \cdot 10^{-7})
    """
    text = number(value)
    base, sign, power = text.partition("e")
    return _bracketed(rf"{base} \cdot 10^{{{int(power)}}}" if sign else base)
