"""Numbers and tables as text: six significant digits, aligned columns, at most `WIDTH` wide."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = [
    "WIDTH",
    "Column",
    "angles",
    "cut",
    "even",
    "number",
    "numbers",
    "paragraph",
    "polars",
    "table",
    "there",
    "unit_text",
]

WIDTH = 100
DIGITS = 6  # significant, of the greatest number of a column
LEAST = 3  # significant, of the smallest one
GAPS = "   ", "  "  # between columns, and where space is short


def there(values: Any) -> np.ndarray:
    """The values that there are, of any shape in a row; forces without a limit are none (NaN).

    >>> there([1.0, math.nan, 3.0]).max()
    np.float64(3.0)
    """
    array = np.asarray(values, dtype=float).reshape(-1)
    finite = np.isfinite(array)
    return array[finite] if finite.any() else array[:1]


def unit_text(unit: str) -> str:
    """A unit as it is printed: products with a dot, whether it was given with a star or a space.

    >>> unit_text("lbf*in"), unit_text("lbf in"), unit_text("rad/s")
    ('lbf·in', 'lbf·in', 'rad/s')
    """
    return re.sub(r"\s*\*\s*|\s+", "·", unit.strip())


def numbers(values: Any, floor: float = 0.0) -> list[str]:
    """The cells of one column: decimal points in line, what is not above `floor` is 0.

    >>> numbers([243.237591, -1.3412, 1e-13], floor=1e-9)
    ['243.238', '-1.341', '0.000']
    """
    array = np.atleast_1d(np.asarray(values, dtype=float))
    array = np.where(np.abs(array) <= floor, 0.0, array)
    sizes = np.abs(array[np.isfinite(array) & (array != 0.0)])
    if not sizes.size:
        return [f"{value:g}" for value in array + 0.0]
    top, least = (math.floor(math.log10(size)) for size in (sizes.max(), sizes.min()))
    decimals = max(0, DIGITS - 1 - top, LEAST - 1 - least)
    if top > DIGITS or decimals > DIGITS + 3 or decimals > DIGITS + 2 - max(top, 0):
        return [f"{value + 0.0:.{DIGITS}g}" for value in array]
    cells = [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in array.tolist()]
    spare = min(len(cell) - len(cell.rstrip("0")) for cell in cells) if decimals else 0
    keep = spare if spare < decimals else decimals + 1
    return [cell[: len(cell) - keep] if spare and "." in cell else cell for cell in cells]


def number(value: float) -> str:
    """One number, six significant digits.

    >>> number(-0.0), number(19.0), number(243.2375908)
    ('0', '19', '243.238')
    """
    return f"{float(value) + 0.0:.{DIGITS}g}"


def angles(values: Any) -> list[str]:
    """Angles [rad] as cells of a column, 0 … 360 deg.

    >>> angles([-1e-12, np.pi / 3])
    ['0.000', '60.000']
    """
    degrees = np.degrees(np.atleast_1d(np.asarray(values, dtype=float)))
    return [f"{round(angle % 360.0, 3) % 360.0:.3f}" for angle in degrees]


def polars(x: Any, y: Any, floor: float = 0.0) -> list[str]:
    """Vectors as cells of a column, "magnitude @ direction"; one that is not above `floor` is 0.

    >>> polars([0.0, 3.0], [2.0, 0.0])
    ['2 @  90.000°', '3 @   0.000°']
    """
    x, y = np.atleast_1d(x), np.atleast_1d(y)
    size = np.hypot(x, y)
    directions = angles(np.arctan2(np.where(np.abs(y) <= floor, 0.0, y), x))
    return [
        f"{cell} @ {direction:>7}°" if s > floor else f"{cell}{'':11}"
        for cell, direction, s in zip(numbers(size, floor), directions, size, strict=True)
    ]


@dataclass
class Column:
    """One column: heading, unit, cells; text is at the left and may be cut where space is short,
    unless it is to be kept whole."""

    title: str
    cells: Sequence[str]
    unit: str = ""
    text: bool = False
    whole: bool = False

    @property
    def width(self) -> int:
        """Characters of the widest cell or heading."""
        return max(map(len, (self.title, self.unit, *self.cells)))


def table(columns: Iterable[Column]) -> list[str]:
    r"""Headings, units, a rule, rows; columns without any cell are left out.

    >>> print(*table([Column("LINK", ["2 crank"], text=True), Column("ω", ["25"], "rad/s")]),
    ...       sep="\n")
    LINK          ω
              rad/s
    ───────────────
    2 crank      25
    """
    shown = [column for column in columns if any(column.cells)]
    widths = [column.width for column in shown]
    texts = [n for n, column in enumerate(shown) if column.text and not column.whole]

    def excess(gap: str) -> int:
        return sum(widths) + len(gap) * (len(widths) - 1) - WIDTH

    gap = GAPS[excess(GAPS[0]) > 0]
    while texts and excess(gap) > 0:
        longest = max(texts, key=lambda n: widths[n])
        if widths[longest] <= max(8, len(shown[longest].title)):
            break
        widths[longest] -= 1

    def line(cells: Iterable[str]) -> str:
        parts = [
            cut(cell, width).ljust(width) if column.text else cell.rjust(width)
            for cell, width, column in zip(cells, widths, shown, strict=True)
        ]
        return gap.join(parts).rstrip()

    head = [line(column.title for column in shown)]
    if any(column.unit for column in shown):
        head.append(line(column.unit for column in shown))
    rows = [line(cells) for cells in zip(*(column.cells for column in shown), strict=True)]
    return [*head, "─" * max(map(len, (*head, *rows))), *rows]


def even(lines: Sequence[str]) -> list[str]:
    """The same lines, all rules as wide as the widest.

    >>> even(["──", "text", "───"])
    ['───', 'text', '───']
    """
    rule = max((line for line in lines if line.startswith("─")), key=len, default="")
    return [rule if line.startswith("─") else line for line in lines]


def cut(text: str, width: int) -> str:
    """The text, its end replaced by an ellipsis where it is too long.

    >>> cut("connecting rod", 8)
    'connect…'
    """
    return text if len(text) <= width else text[: max(0, width - 1)] + "…"


def paragraph(text: str, mark: str = "") -> list[str]:
    """Lines of a text, at most `WIDTH` wide, those after the first indented below its mark."""
    return textwrap.wrap(mark + text, WIDTH, subsequent_indent=" " * len(mark)) or [mark]
