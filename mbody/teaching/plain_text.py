"""A document as plain text for a terminal."""

from __future__ import annotations

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
    parts_of,
)
from mbody.sheets.text_table import WIDTH, Column, paragraph, table

__all__ = ["plain_text"]

INDENT = "   "


def plain_text(document: ReportDocument) -> str:
    """The text, at most 100 characters wide where a term of an equation is not wider.

    Examples
    --------
    >>> from mbody.reports.blocks import Chapter, Text
    >>> chapter = Chapter("one", "Energy", [Text("F_{12} s")])
    >>> print(plain_text(ReportDocument("Work", [], [chapter])))
    Work
    <BLANKLINE>
    ENERGY
    <BLANKLINE>
    F12 s
    """
    lines = paragraph(_rich(document.title))
    for what, value in document.about:
        lines += paragraph(_rich(value), f"{_rich(what)}: ")
    for chapter in document.chapters:
        lines += ["", _rich(chapter.title).upper()]
        for block in chapter.blocks:
            lines += ["", *_block(block)]
    return "\n".join(lines)


def _block(block: Block) -> Iterator[str]:
    if isinstance(block, DisplayedEquations):
        for row in block.broken(WIDTH - len(INDENT)):
            yield INDENT + " ".join(text for text, _ in row)
    elif isinstance(block, Grid):
        if block.title:
            yield from paragraph(_rich(block.title))
        columns = (
            Column(_rich(one.title), [_rich(cell) for cell in one.cells], one.unit, text=one.text)
            for one in block.columns
        )
        yield from (INDENT + line for line in table(columns))
    elif isinstance(block, Items):
        for item in block.items:
            yield from paragraph(_rich(item), "- ")
    elif isinstance(block, Picture):
        yield from paragraph(_rich(block.caption), f"[{block.name}.svg] ")
    elif isinstance(block, FileText):
        yield from (INDENT + line for line in block.text.splitlines())
    else:
        mark = "NOTE   " if isinstance(block, Notice) else ""
        yield from paragraph(_rich(block.text), mark)


def _rich(text: str) -> str:
    return "".join(part + index for _, part, index in parts_of(text))
