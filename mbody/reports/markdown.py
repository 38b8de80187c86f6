"""A report as Markdown, its pictures as SVG files beside it."""

from __future__ import annotations

import re
from collections.abc import Iterator

from mbody.reports.blocks import (
    Block,
    DisplayedEquations,
    FileText,
    Grid,
    Items,
    Notice,
    Picture,
    ReportDocument,
    Text,
    parts_of,
)

__all__ = ["markdown"]

#: Letters of a line of an equation.
LINE = 100
MARKS = {"good": "✓", "doubt": "⚠", "note": "Note:"}


def markdown(document: ReportDocument, folder: str) -> str:
    """The text; pictures are named in `folder`, which the caller writes."""
    lines = [f"# {_rich(document.title)}", ""]
    lines += [f"- {_rich(what)}: {_rich(value)}" for what, value in document.about]
    numbered = iter(range(1, 1000))
    for chapter in document.chapters:
        lines += ["", f"## {_rich(chapter.title)}"]
        for block in chapter.blocks:
            lines += ["", *_block(block, folder, numbered)]
    return "\n".join(lines) + "\n"


def _block(block: Block, folder: str, numbered: Iterator[int]) -> list[str]:
    if isinstance(block, Text):
        return [_rich(block.text)]
    if isinstance(block, Items):
        return [f"- {_rich(item)}" for item in block.items]
    if isinstance(block, Grid):
        return _grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        caption = _rich(block.caption)
        file = f"{folder}/{block.name}.svg".replace(" ", "%20")
        return [f"![{caption}]({file})", "", f"*Figure {n}.* {caption}"]
    if isinstance(block, Notice):
        return [f"> {MARKS[block.kind]} {_rich(block.text)}"]
    if isinstance(block, DisplayedEquations):
        rows = (" ".join(latex for _, latex in row) for row in block.broken(LINE))
        lines = " \\\\\n".join(f"& {row}" for row in rows)
        return ["$$", r"\begin{aligned}", lines, r"\end{aligned}", "$$"]
    return _file(block)


def _file(block: FileText) -> list[str]:
    fence = "`" * max(3, 1 + max(map(len, re.findall(r"`+", block.text)), default=0))
    return [f"{fence}{block.language}", block.text.rstrip("\n"), fence]


def _grid(grid: Grid) -> list[str]:
    heads = [
        _cell(f"{column.title} [{column.unit}]" if column.unit else column.title)
        for column in grid.shown
    ]
    rules = [":--" if n == 0 or column.text else "--:" for n, column in enumerate(grid.shown)]
    rows = [" | ".join(map(_cell, row)) for row in grid.rows]
    table = [" | ".join(heads), " | ".join(rules), *rows]
    return [f"**{_rich(grid.title)}**", "", *(f"| {line} |" for line in table)]


def _cell(text: str) -> str:
    return _rich(text).replace("|", r"\|").replace("\n", " ")


def _rich(text: str) -> str:
    r"""Text with indices in HTML, which Markdown lets through, and its own signs escaped.

    >>> print(_rich("F_{32} of *this* in `a_b`, x_y"))
    *F*<sub>32</sub> of \*this\* in `a_b`, x\_y
    """
    found = []
    for kind, part, index in parts_of(text):
        safe = re.sub(r"([\\*_\[\]<>`#])", r"\\\1", part)
        if kind == "index":
            found.append(f"*{safe}*<sub>{index}</sub>")
        elif kind == "bold":
            found.append(f"**{safe}**")
        else:
            found.append(f"`{part}`" if kind == "code" else safe)
    return "".join(found)
