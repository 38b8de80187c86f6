"""A report as PDF, typeset by Typst, which is a package without other programs."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mbody.errors import ModelError
from mbody.reports.blocks import (
    Block,
    DisplayedEquations,
    Grid,
    Items,
    Notice,
    Picture,
    ReportDocument,
    Text,
    parts_of,
)
from mbody.views.picture_content import content_of

__all__ = ["check_typst", "pdf", "typst_text"]

HEAD = """#set document(title: {title})
#set page(paper: "a4", margin: (x: 18mm, y: 20mm), numbering: "1 / 1")
#set text(size: 10pt, fill: rgb("#26323f"))
#set par(justify: false, leading: 0.62em)
#set heading(numbering: "1")
#show heading: it => block(above: 1.6em, below: 0.7em, it)
#show figure: set block(breakable: false)
#show table: set text(size: 8pt)
#show raw.where(block: true): set text(size: 6.8pt)
#let grid-table(title, columns, align, header, ..cells) = block(above: 1em, below: 1em, {{
  block(sticky: true, below: 0.5em, text(weight: "bold", title))
  table(columns: columns, align: align, inset: (x: 4pt, y: 3pt), stroke: (x, y) => (
      top: if y == 0 {{ none }} else {{ 0.3pt + rgb("#c8d0d8") }},
    ), table.header(..header), table.hline(stroke: 0.8pt), ..cells)
}})
#let notice(color, body) = block(width: 100%, inset: 7pt, stroke: (left: 3pt + color),
  fill: rgb("#eef2f6"), body)
"""
COLORS = {"good": "#00795a", "doubt": "#d55e00", "note": "#7d8894"}
#: Points: a picture is drawn in its own size, or as wide as the text.
WIDTH = 490.0
#: Letters that a line of a table has.
LETTERS = 118
#: Letters of a line of an equation.
LINE = 120
#: Part of its own size that a picture has, as the text is smaller than on a screen.
PART = 0.86


def check_typst() -> Any:
    """The package.

    Raises
    ------
    ModelError
        Where it is not installed.
    """
    try:
        import typst
    except ImportError:
        raise ModelError(
            "a PDF needs typst, which is not installed: pip install typst, or write .html and print"
        ) from None
    return typst


def pdf(document: ReportDocument) -> bytes:
    """The content of the file.

    Raises
    ------
    ModelError
        Where typst is not installed.
    """
    typst = check_typst()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for picture in document.pictures:
            (folder / f"{picture.name}.svg").write_bytes(content_of(picture.figure, "svg"))
        source = folder / "report.typ"
        source.write_text(typst_text(document), encoding="utf-8")
        whole: bytes = typst.compile(str(source), root=str(folder))
    return whole


def typst_text(document: ReportDocument) -> str:
    """The document in the language of Typst."""
    lines = [HEAD.format(title=_quoted(document.title))]
    lines.append(f'#text(size: 17pt, weight: "bold")[{_rich(document.title)}]\n')
    pairs = "".join(
        f'[#text(fill: rgb("#56616c"))[{_rich(what)}]], [{_rich(value)}], '
        for what, value in document.about
    )
    lines.append(f"#grid(columns: (auto, 1fr), gutter: 5pt, {pairs})\n")
    numbered = iter(range(1, 1000))
    for chapter in document.chapters:
        lines.append(f"= {_rich(chapter.title)}\n")
        lines += [_block(block, numbered) for block in chapter.blocks]
    return "\n".join(lines)


def _block(block: Block, numbered: Iterator[int]) -> str:
    if isinstance(block, Text):
        return f"{_rich(block.text)}\n"
    if isinstance(block, Items):
        return "".join(f"- {_rich(item)}\n" for item in block.items)
    if isinstance(block, Grid):
        return _grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        wide = min(WIDTH, PART * 72.0 * float(block.figure.get_size_inches()[0]))
        image = f"image({_quoted(f'{block.name}.svg')}, width: {wide:.0f}pt)"
        caption = f"*Figure {n}.* {_rich(block.caption)}"
        return (
            f"#block(breakable: false, above: 1em, below: 1.2em)[#{image}\n"
            f'#text(size: 8.5pt, fill: rgb("#56616c"))[{caption}]]\n'
        )
    if isinstance(block, Notice):
        return f'#notice(rgb("{COLORS[block.kind]}"))[{_rich(block.text)}]\n'
    if isinstance(block, DisplayedEquations):
        lines = "\n".join(" ".join(text for text, _ in row) for row in block.broken(LINE))
        return f"#raw({_quoted(lines)}, block: true)\n"
    return f"*{_rich(block.title)}*\n#raw({_quoted(block.text)}, block: true)\n"


def _grid(grid: Grid) -> str:
    """A table; columns of long text share the width that is left."""
    shown = grid.shown
    # only where the table is wider than the page, and columns of text alone
    full = sum(grid.widths) + 2 * len(shown) > LETTERS
    long = [
        full and width > 22 and column.text
        for column, width in zip(shown, grid.widths, strict=True)
    ]
    widths = ", ".join("1fr" if wide else "auto" for wide in long)
    sides = ", ".join(
        "left" if n == 0 or column.text else "right" for n, column in enumerate(shown)
    )
    heads = []
    for column in shown:
        unit = f'\\ #text(fill: rgb("#56616c"))[{_rich(column.unit)}]' if column.unit else ""
        heads.append(f"[*{_rich(column.title)}*{unit}]")
    cells = ", ".join(f"[{_rich(cell)}]" for row in grid.rows for cell in row)
    return (
        f"#grid-table([{_rich(grid.title)}], ({widths},), ({sides},), ({', '.join(heads)},), "
        f"{cells})\n"
    )


def _rich(text: str) -> str:
    r"""Text with its indices, bold words and code; signs of the language escaped.

    >>> _rich("F_{32} is *not* `A.force`")
    '#emph[F]#sub[32] is \\*not\\* #raw("A.force")'
    """
    found = []
    for kind, part, index in parts_of(text):
        if kind == "index":
            found.append(f"#emph[{_plain(part)}]#sub[{_plain(index)}]")
        elif kind == "bold":
            found.append(f"#strong[{_plain(part)}]")
        else:
            found.append(f"#raw({_quoted(part)})" if kind == "code" else _plain(part))
    return "".join(found)


def _plain(text: str) -> str:
    return "".join(f"\\{sign}" if sign in "\\#$*_`<>@[]~'\"/=-+" else sign for sign in text)


def _quoted(text: str) -> str:
    inner = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "  ")
    return f'"{inner}"'
