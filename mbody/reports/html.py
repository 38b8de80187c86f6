"""A report as one page of HTML: no script, no request, dark and light, for screens and paper."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator

from mbody._version import __version__
from mbody.reports.blocks import (
    Block,
    Cells,
    Chapter,
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
from mbody.views import style
from mbody.views.picture_content import content_of

__all__ = ["html_page"]

#: Colours of pictures that a dark page shows otherwise, by the name of their variable.
COLORS = {
    "ink": style.INK,
    "link": style.LINK,
    "plate": style.PLATE,
    "wheel": style.WHEEL,
    "ground": style.GROUND,
    "soft": style.SOFT,
    "load": style.LOAD,
    "force": style.FORCE,
    "drive": style.DRIVE,
    "paper": style.PAPER,
    "grid": "#e3e7eb",
    "fifth": "#cc79a7",
    "sixth": "#e69f00",
}
DARK = {
    "ink": "#e4e9ef",
    "link": "#3a4754",
    "plate": "#303b47",
    "wheel": "#27313b",
    "ground": "#a3adb8",
    "soft": "#a0abb6",
    "load": "#ff9a4d",
    "force": "#5cb8f0",
    "drive": "#3fcba6",
    "paper": "#171c22",
    "grid": "#333d47",
    "fifth": "#e9a9cc",
    "sixth": "#f4c04e",
}
#: Columns of a table that a narrow screen shows beside each other.
NARROW = 3
MARKS = {"good": "✓", "doubt": "!", "note": "i"}

CSS = """
*{box-sizing:border-box}
html{color-scheme:light dark;-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);
 font:16px/1.55 system-ui,"Segoe UI",Roboto,Helvetica,Arial,sans-serif}
.page{max-width:72rem;margin:0 auto;padding:1.5rem 1.25rem 4rem;display:grid;
 grid-template-columns:12rem minmax(0,1fr);gap:0 2rem}
header{grid-column:1/-1;border-bottom:2px solid var(--ink);padding-bottom:1rem;margin-bottom:1.5rem}
h1{font-size:1.75rem;line-height:1.2;margin:.2rem 0 .6rem}
h2{font-size:1.25rem;margin:2.4rem 0 .7rem;padding-top:.3rem;border-top:1px solid var(--line)}
section:first-child h2{margin-top:0;border-top:0}
header dl{display:grid;grid-template-columns:auto 1fr;gap:.1rem 1rem;margin:0;font-size:.9rem}
header dt{color:var(--soft-text)}header dd{margin:0;overflow-wrap:anywhere}
nav{position:sticky;top:1rem;align-self:start;font-size:.9rem;max-height:95vh;overflow:auto}
nav ol{list-style:none;margin:0;padding:0}
nav a{display:block;padding:.22rem .5rem;color:inherit;text-decoration:none;border-radius:4px}
nav a:hover,nav a:focus{background:var(--plate)}
a{color:var(--force)}a:focus-visible{outline:2px solid var(--force);outline-offset:2px}
p{max-width:46rem;margin:.5rem 0}li{max-width:46rem;margin:.2rem 0}ul{padding-left:1.3rem}
code{font:.88em ui-monospace,Menlo,Consolas,monospace;background:var(--plate);
 padding:.08em .3em;border-radius:3px;overflow-wrap:anywhere}
.table{overflow-x:auto;margin:.9rem 0}
table{border-collapse:collapse;font-size:.875rem;font-variant-numeric:tabular-nums}
caption{text-align:left;font-weight:600;padding:.2rem 0 .4rem}
th,td{padding:.28rem .65rem .28rem 0;text-align:right;vertical-align:top;white-space:nowrap}
th.text,td.text{text-align:left;white-space:normal;min-width:4rem}
tbody th{text-align:left;font-weight:400;white-space:normal;min-width:6rem}
thead th{border-bottom:1.5px solid var(--ink);font-weight:600;vertical-align:bottom}
thead .unit{display:block;font-weight:400;color:var(--soft-text)}
tbody tr+tr>*{border-top:1px solid var(--line)}
tbody tr:last-child>*{border-bottom:1.5px solid var(--ink)}
figure{margin:1.1rem 0 1.4rem}figure svg{max-width:100%;height:auto;display:block}
figcaption{font-size:.875rem;color:var(--soft-text);margin-top:.35rem;max-width:46rem}
.notice{display:flex;gap:.7rem;border-left:4px solid;padding:.5rem .8rem;margin:.8rem 0;
 background:var(--plate);max-width:48rem}
.notice b{flex:none}.good{border-color:var(--drive)}.doubt{border-color:var(--load)}
.note{border-color:var(--soft)}
details{margin:.8rem 0}summary{cursor:pointer;font-weight:600}
pre{background:var(--plate);padding:.8rem 1rem;overflow-wrap:anywhere;border-radius:4px;
 white-space:pre-wrap;
 font:.8rem/1.45 ui-monospace,Menlo,Consolas,monospace;tab-size:4}
footer{grid-column:1/-1;margin-top:3rem;font-size:.85rem;color:var(--soft-text)}
.skip{position:absolute;left:-99rem}.skip:focus{left:1rem;top:.5rem;background:var(--paper)}
@media (max-width:56rem){.page{display:block}nav{position:static;max-height:none;
 margin-bottom:1.5rem}nav ol{columns:2}}
@media screen and (max-width:40rem){
 .wide :is(table,tbody,tr,th,td,caption){display:block}.wide table{width:100%}
 .wide thead{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
 .wide tbody tr{border-top:1px solid var(--line);padding:.35rem 0}
 .wide tbody tr:last-child{border-bottom:1.5px solid var(--ink)}
 .wide tbody tr>*{border:0!important;padding:.08rem 0;white-space:normal}
 .wide tbody th{font-weight:600}.wide td:empty{display:none}
 .wide td{display:flex;justify-content:space-between;gap:1rem;text-align:right;
  overflow-wrap:anywhere}
 .wide td::before{content:attr(data-label);color:var(--soft-text);text-align:left;flex:none}
 .table td{overflow-wrap:anywhere}}
@media print{@page{margin:16mm 14mm}body{font-size:10pt}
 .page{display:block;padding:0;max-width:none}
 nav,.skip{display:none}h2{break-after:avoid;margin-top:1.4rem}figure,.notice,tr{break-inside:avoid}
 .table{overflow:visible}table{font-size:8pt}th,td{padding-right:.5rem}
 pre{white-space:pre-wrap;background:none;border:1px solid var(--line);font-size:7pt}
 figure svg{max-height:210mm}}
"""


def html_page(document: ReportDocument) -> str:
    """The whole page.

    Pictures are inline, their colours are variables of the page.
    """
    about = "".join(
        f"<dt>{_rich(what)}</dt><dd>{_rich(value)}</dd>" for what, value in document.about
    )
    nav = "".join(
        f'<li><a href="#{one.key}">{_rich(one.title)}</a></li>' for one in document.chapters
    )
    numbered = iter(range(1, 1000))
    chapters = "\n".join(_chapter(one, numbered) for one in document.chapters)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="mbody {__version__}">
<title>{html.escape(document.title)}</title>
<style>{_variables()}{CSS}</style>
</head>
<body>
<a class="skip" href="#report">Skip to the report</a>
<div class="page">
<header><h1>{_rich(document.title)}</h1><dl>{about}</dl></header>
<nav aria-label="Chapters"><ol>{nav}</ol></nav>
<main id="report">
{chapters}
</main>
<footer>Made by mbody {__version__}.</footer>
</div>
</body>
</html>
"""


def _variables() -> str:
    """The colours of the page, light and dark; paper is always light."""

    def rules(colors: dict[str, str], line: str, soft: str) -> str:
        every = {**colors, "line": line, "soft-text": soft}
        return "".join(f"--{name}:{color};" for name, color in every.items())

    light = f":root{{{rules(COLORS, '#d5dbe1', '#56616c')}}}"
    dark = f":root{{{rules(DARK, '#35404b', '#aab4be')}}}"
    return f"\n{light}\n@media screen and (prefers-color-scheme:dark){{{dark}}}"


def _chapter(chapter: Chapter, numbered: Iterator[int]) -> str:
    blocks = "\n".join(_block(block, numbered) for block in chapter.blocks)
    title = f'<h2 id="{chapter.key}-title">{_rich(chapter.title)}</h2>'
    label = f'aria-labelledby="{chapter.key}-title"'
    return f'<section id="{chapter.key}" {label}>{title}\n{blocks}\n</section>'


def _block(block: Block, numbered: Iterator[int]) -> str:
    if isinstance(block, Text):
        return f"<p>{_rich(block.text)}</p>"
    if isinstance(block, Items):
        return f"<ul>{''.join(f'<li>{_rich(item)}</li>' for item in block.items)}</ul>"
    if isinstance(block, Grid):
        return _grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        svg = picture_text(block, n)
        caption = f"<figcaption><b>Figure {n}.</b> {_rich(block.caption)}</figcaption>"
        return f"<figure>{svg}{caption}</figure>"
    if isinstance(block, Notice):
        mark = f'<b aria-hidden="true">{MARKS[block.kind]}</b>'
        return f'<div class="notice {block.kind}">{mark}<span>{_rich(block.text)}</span></div>'
    if isinstance(block, DisplayedEquations):
        lines = (" ".join(text for text, _ in line) for line in block.lines)
        return f'<p class="formula">{"<br>".join(map(html.escape, lines))}</p>'
    return _file(block)


def _grid(grid: Grid) -> str:
    """A table; the first column names the rows, a column without a title says what the rows are."""
    shown = grid.shown
    heads = "".join(
        f'<th role="columnheader" scope="col"{_class(column.text)}>'
        f"{_rich(column.title) or '<span>what</span>'}"
        f"{f'<span class=unit>{html.escape(column.unit)}</span>' if column.unit else ''}</th>"
        for column in shown
    )
    rows = []
    for row in grid.rows:
        first, *rest = row
        cells = "".join(
            f'<td role="cell" data-label="{_label(column)}"{_class(column.text)}>{_rich(cell)}</td>'
            for column, cell in zip(shown[1:], rest, strict=True)
        )
        rows.append(
            f'<tr role="row"><th role="rowheader" scope="row">{_rich(first)}</th>{cells}</tr>'
        )
    caption = f"<caption>{_rich(grid.title)}</caption>"
    body = "".join(rows)
    head = f'<thead role="rowgroup"><tr role="row">{heads}</tr></thead>'
    # roles are named, as a narrow screen shows rows as blocks, which would lose them
    table = f'<table role="table">{caption}{head}<tbody role="rowgroup">{body}</tbody></table>'
    name = html.escape(f"Table: {grid.title}")  # another name than that of its chapter
    kind = "table wide" if len(shown) > NARROW else "table"
    return f'<div class="{kind}" tabindex="0" role="region" aria-label="{name}">{table}</div>'


def _label(column: Cells) -> str:
    """The title of a column as plain text, with its unit."""
    words = _plain(column.title) + (f" [{column.unit}]" if column.unit else "")
    return html.escape(words, quote=True)


def _class(text: bool) -> str:
    return ' class="text"' if text else ""


def _file(block: FileText) -> str:
    text = html.escape(block.text)
    return (
        f"<details><summary>{html.escape(block.title)}</summary>"
        f'<pre tabindex="0" aria-label="{html.escape(block.title)}">{text}</pre></details>'
    )


def _rich(text: str) -> str:
    """Text with its indices, bold words and code."""
    tags = {"bold": "b", "code": "code"}
    found = []
    for kind, part, index in parts_of(text):
        safe = html.escape(part)
        if kind == "index":
            found.append(f"<i>{safe}</i><sub>{html.escape(index)}</sub>")
        elif kind in tags:
            found.append(f"<{tags[kind]}>{safe}</{tags[kind]}>")
        else:
            found.append(safe)
    return "".join(found)


def picture_text(picture: Picture, number: int) -> str:
    """A picture as part of a page: ids of its own, colours of the page, a name that is read."""
    text = content_of(picture.figure, "svg").decode("utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # what nothing refers to needs no id; glyphs and outlines that are used have one in each picture
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', text))
    prefix = f"f{number}-"

    def renamed(found: re.Match[str]) -> str:
        return f' id="{prefix}{found[1]}"' if found[1] in used else ""

    text = re.sub(r' id="([^"]*)"', renamed, text)
    text = re.sub(r'((?:href="#)|(?:url\(#))', rf"\g<1>{prefix}", text)
    for name, color in COLORS.items():
        text = text.replace(color, f"var(--{name})")
    label = html.escape(_plain(picture.caption), quote=True)
    return text.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1)


def _plain(text: str) -> str:
    return "".join(f"{part}{index}" for _, part, index in parts_of(text))
