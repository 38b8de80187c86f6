"""A document as plain blocks, which every format writes: text, tables, pictures, notices, files.

Text may have an index, as in ``F_{32}``, **bold** words between two stars, and `code` between
backticks; all else is taken as it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.summaries.text_table import Column


#: Rows of a table of links or joints: more of them are not read.
ROWS = 40
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWERS = str.maketrans("23456789", "²³⁴⁵⁶⁷⁸⁹")
_RICH = re.compile(r"\*\*(?P<bold>.+?)\*\*|`(?P<code>[^`]+)`|(?P<base>\w+)_\{(?P<index>[^{}]*)\}")


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    items: Sequence[str]


@dataclass(frozen=True)
class Grid:
    """A table; columns without any cell are left out.

    `title`: What it shows.
    `columns`: The first names the rows.
    """

    title: str
    columns: Sequence[Column]

    @property
    def filled_columns(self) -> list[Column]:
        """The columns that have cells."""
        return [column for column in self.columns if any(column.cells)]

    @property
    def widths(self) -> list[int]:
        """Letters of the longest cell of each column, of its title and unit."""
        heads = [max(len(_bare(one.title)), len(_bare(one.unit))) for one in self.filled_columns]
        cells = zip(*self.rows, strict=True)
        return [
            max(head, *(len(_bare(cell)) for cell in own))
            for head, own in zip(heads, cells, strict=True)
        ]

    @property
    def rows(self) -> Iterator[tuple[str, ...]]:
        """The cells of each row."""
        columns = [
            column.cells if column.text else [typeset(cell) for cell in column.cells]
            for column in self.filled_columns
        ]
        return zip(*columns, strict=True)


def _bare(text: str) -> str:
    return "".join(part + index for _, part, index in parts_of(text))


@dataclass(frozen=True)
class Picture:
    """A figure with its caption.

    `name`: Of its file, where a format has one.
    `caption`: What it shows; read aloud where the picture cannot be seen.
    """

    name: str
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Notice:
    """A sentence that must be seen: "good", "doubt" or "note"."""

    kind: str
    text: str


@dataclass(frozen=True)
class FileText:
    """The text of a file, as it is."""

    title: str
    text: str
    language: str = ""


@dataclass(frozen=True)
class DisplayedEquations:
    """Equations below each other, the parts of each in plain text and in LaTeX.

    `lines`: An equation a line, a term a part; between parts a line may be broken.
    """

    lines: Sequence[Sequence[tuple[str, str]]]

    def broken(self, width: int) -> Iterator[list[tuple[str, str]]]:
        """The equations in lines of at most so many letters of text, where terms are not longer."""
        for line in self.lines:
            row: list[tuple[str, str]] = []
            for part in line:
                if row and sum(len(text) + 1 for text, _ in (*row, part)) > width:
                    yield row
                    row = [("   ", r"\qquad")]
                row.append(part)
            yield row


Block: TypeAlias = Text | Items | Grid | Picture | Notice | FileText | DisplayedEquations


@dataclass(frozen=True)
class Chapter:
    """A part of a document under a heading.

    `key`: The name by which it is chosen.
    """

    key: str
    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class ReportDocument:
    """A whole document.

    `about`: The lines below the title.
    """

    title: str
    about: Sequence[tuple[str, str]]
    chapters: Sequence[Chapter] = field(default_factory=list)

    @property
    def pictures(self) -> list[Picture]:
        """All pictures, in order."""
        blocks = (block for chapter in self.chapters for block in chapter.blocks)
        return [block for block in blocks if isinstance(block, Picture)]


def first_rows(grid: Grid) -> list[Block]:
    """A table with its first rows, and a sentence that says so where it has more."""
    count = max((len(column.cells) for column in grid.columns), default=0)
    if count <= ROWS:
        return [grid]
    columns = [replace(column, cells=column.cells[:ROWS]) for column in grid.columns]
    note = f"The first {ROWS} of {count}; the model file and the results have all."
    return [Grid(grid.title, columns), Text(note)]


def typeset(number: str) -> str:
    """A number with a minus sign and a power of ten, as it is printed.

    >>> typeset("-4.75e+06"), typeset("1.2e-16"), typeset("rad")
    ('−4.75·10⁶', '1.2·10⁻¹⁶', 'rad')
    """
    found = re.fullmatch(r"(-?[\d.]+)e([+-]\d+)(.*)", number)
    if found:
        power = str(int(found[2])).translate(_RAISED)
        return f"{found[1].replace('-', '−')}·10{power}{found[3]}"
    return re.sub(r"^-(?=[\d.])", "−", number)


def printed(text: str) -> str:
    """Words with the signs of print: minus, powers of ten, powers, and dots of products.

    >>> printed("at -40 rad/s^2, 2*half, (-1, 3-4-5), 2.5e-16 of it")
    'at −40 rad/s², 2·half, (−1, 3-4-5), 2.5·10⁻¹⁶ of it'
    """
    text = re.sub(r"(?<![\w.])-?\d+(?:\.\d+)?e[+-]\d+\b", lambda found: typeset(found[0]), text)
    text = re.sub(r"(?<![\w.)\]-])-(?=\.?\d)|(?:(?<=\()|(?<== ))-(?=\w)", "−", text)
    text = re.sub(
        r"(?<=[\w)])\^([2-9])(?!\d|\.\d)", lambda found: found[1].translate(_POWERS), text
    )
    return re.sub(r"(?<=[\w)²³])\*(?=[\w(])", "·", text)


def parts_of(text: str) -> Iterator[tuple[str, str, str]]:
    """A text in parts: (kind, text, index), the kinds "plain", "bold", "code" and "index".

    >>> list(parts_of("F_{32} is `A.force`"))
    [('index', 'F', '32'), ('plain', ' is ', ''), ('code', 'A.force', '')]
    """
    done = 0
    for found in _RICH.finditer(text):
        if found.start() > done:
            yield "plain", printed(text[done : found.start()]), ""
        if found["base"]:
            yield "index", found["base"], found["index"]
        else:
            kind = "bold" if found["bold"] else "code"
            yield kind, found[kind], ""
        done = found.end()
    if done < len(text):
        yield "plain", printed(text[done:]), ""
