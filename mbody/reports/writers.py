"""A report in each of its formats: a page of HTML, Markdown, LaTeX, and PDF by Typst."""

from __future__ import annotations

import html
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mbody._version import __version__
from mbody.errors import ModelError
from mbody.reports.described import (
    Block,
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
from mbody.summaries.text_table import Column
from mbody.views import labels
from mbody.views.labels import content_of

#: Colours of pictures that a dark page shows otherwise, by the name of their variable.
COLORS = {
    "ink": labels.INK,
    "link": labels.LINK,
    "plate": labels.PLATE,
    "wheel": labels.WHEEL,
    "ground": labels.GROUND,
    "soft": labels.SOFT,
    "load": labels.LOAD,
    "force": labels.FORCE,
    "drive": labels.DRIVER,
    "paper": labels.PAPER,
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
HTML_MARKS = {"good": "✓", "doubt": "!", "note": "i"}

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
        f"<dt>{_html_text(what)}</dt><dd>{_html_text(value)}</dd>" for what, value in document.about
    )
    nav = "".join(
        f'<li><a href="#{one.key}">{_html_text(one.title)}</a></li>' for one in document.chapters
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
<header><h1>{_html_text(document.title)}</h1><dl>{about}</dl></header>
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
    blocks = "\n".join(_html_block(block, numbered) for block in chapter.blocks)
    title = f'<h2 id="{chapter.key}-title">{_html_text(chapter.title)}</h2>'
    label = f'aria-labelledby="{chapter.key}-title"'
    return f'<section id="{chapter.key}" {label}>{title}\n{blocks}\n</section>'


def _html_block(block: Block, numbered: Iterator[int]) -> str:
    if isinstance(block, Text):
        return f"<p>{_html_text(block.text)}</p>"
    if isinstance(block, Items):
        return f"<ul>{''.join(f'<li>{_html_text(item)}</li>' for item in block.items)}</ul>"
    if isinstance(block, Grid):
        return _html_grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        svg = picture_text(block, n)
        caption = f"<figcaption><b>Figure {n}.</b> {_html_text(block.caption)}</figcaption>"
        return f"<figure>{svg}{caption}</figure>"
    if isinstance(block, Notice):
        mark = f'<b aria-hidden="true">{HTML_MARKS[block.kind]}</b>'
        return f'<div class="notice {block.kind}">{mark}<span>{_html_text(block.text)}</span></div>'
    if isinstance(block, DisplayedEquations):
        lines = (" ".join(text for text, _ in line) for line in block.lines)
        return f'<p class="formula">{"<br>".join(map(html.escape, lines))}</p>'
    return _file(block)


def _html_grid(grid: Grid) -> str:
    """A table; the first column names the rows, a column without a title says what the rows are."""
    filled = grid.filled_columns
    heads = "".join(
        f'<th role="columnheader" scope="col"{_class(column.text)}>'
        f"{_html_text(column.title) or '<span>what</span>'}"
        f"{f'<span class=unit>{html.escape(column.unit)}</span>' if column.unit else ''}</th>"
        for column in filled
    )
    rows = []
    for row in grid.rows:
        first, *values = row
        cells = "".join(
            f'<td role="cell" data-label="{_label(column)}"{_class(column.text)}>'
            f"{_html_text(cell)}</td>"
            for column, cell in zip(filled[1:], values, strict=True)
        )
        rows.append(
            f'<tr role="row"><th role="rowheader" scope="row">{_html_text(first)}</th>{cells}</tr>'
        )
    caption = f"<caption>{_html_text(grid.title)}</caption>"
    body = "".join(rows)
    head = f'<thead role="rowgroup"><tr role="row">{heads}</tr></thead>'
    # roles are named, as a narrow screen shows rows as blocks, which would lose them
    table = f'<table role="table">{caption}{head}<tbody role="rowgroup">{body}</tbody></table>'
    name = html.escape(f"Table: {grid.title}")  # another name than that of its chapter
    kind = "table wide" if len(filled) > NARROW else "table"
    return f'<div class="{kind}" tabindex="0" role="region" aria-label="{name}">{table}</div>'


def _label(column: Column) -> str:
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


def _html_text(text: str) -> str:
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


# -- A report as Markdown, its pictures as SVG files beside it ---------------------------------

#: Letters of a line of an equation.
MARKDOWN_LINE_WIDTH = 100
NOTICE_MARKS = {"good": "✓", "doubt": "⚠", "note": "Note:"}


def markdown(document: ReportDocument, folder: str) -> str:
    """The text; pictures are named in `folder`, which the caller writes."""
    lines = [f"# {_markdown_text(document.title)}", ""]
    lines += [
        f"- {_markdown_text(what)}: {_markdown_text(value)}" for what, value in document.about
    ]
    numbered = iter(range(1, 1000))
    for chapter in document.chapters:
        lines += ["", f"## {_markdown_text(chapter.title)}"]
        for block in chapter.blocks:
            lines += ["", *_markdown_block(block, folder, numbered)]
    return "\n".join(lines) + "\n"


def _markdown_block(block: Block, folder: str, numbered: Iterator[int]) -> list[str]:
    if isinstance(block, Text):
        return [_markdown_text(block.text)]
    if isinstance(block, Items):
        return [f"- {_markdown_text(item)}" for item in block.items]
    if isinstance(block, Grid):
        return _markdown_grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        caption = _markdown_text(block.caption)
        file = f"{folder}/{block.name}.svg".replace(" ", "%20")
        return [f"![{caption}]({file})", "", f"*Figure {n}.* {caption}"]
    if isinstance(block, Notice):
        return [f"> {NOTICE_MARKS[block.kind]} {_markdown_text(block.text)}"]
    if isinstance(block, DisplayedEquations):
        rows = (" ".join(latex for _, latex in row) for row in block.broken(MARKDOWN_LINE_WIDTH))
        lines = " \\\\\n".join(f"& {row}" for row in rows)
        return ["$$", r"\begin{aligned}", lines, r"\end{aligned}", "$$"]
    return _markdown_file(block)


def _markdown_file(block: FileText) -> list[str]:
    fence = "`" * max(3, 1 + max(map(len, re.findall(r"`+", block.text)), default=0))
    return [f"{fence}{block.language}", block.text.rstrip("\n"), fence]


def _markdown_grid(grid: Grid) -> list[str]:
    heads = [
        _cell(f"{column.title} [{column.unit}]" if column.unit else column.title)
        for column in grid.filled_columns
    ]
    rules = [
        ":--" if n == 0 or column.text else "--:" for n, column in enumerate(grid.filled_columns)
    ]
    rows = [" | ".join(map(_cell, row)) for row in grid.rows]
    table = [" | ".join(heads), " | ".join(rules), *rows]
    return [f"**{_markdown_text(grid.title)}**", "", *(f"| {line} |" for line in table)]


def _cell(text: str) -> str:
    return _markdown_text(text).replace("|", r"\|").replace("\n", " ")


def _markdown_text(text: str) -> str:
    r"""Text with indices in HTML, which Markdown lets through, and its own signs escaped.

    >>> print(_markdown_text("F_{32} of *this* in `a_b`, x_y"))
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


# -- A report as LaTeX, its pictures as PDF files beside it; for one's own document too --------

LATEX_HEAD = r"""\documentclass[11pt,a4paper]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage{amsmath,booktabs,longtable,array,graphicx,xcolor}
\usepackage[margin=22mm]{geometry}
\usepackage[hidelinks]{hyperref}
\setlength{\parindent}{0pt}\setlength{\parskip}{4pt}
\newcommand{\notice}[1]{\par\smallskip\fbox{\parbox{0.96\linewidth}{#1}}\par\smallskip}
"""
#: Sizes of the type of tables, with the letters of a line in each, beside its gaps.
SIZES = ((r"\small", 88), (r"\footnotesize", 98), (r"\scriptsize", 112))
#: Letters of a column from which on it may be broken into lines.
LONG = 22
#: Letters of a line of an equation.
LATEX_LINE_WIDTH = 84
#: Signs that need a command of LaTeX.
SIGNS = {
    **{"\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#"},
    **{"%": r"\%", "_": r"\_", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"},
    **{"−": "$-$", "·": r"$\cdot$", "°": r"$^\circ$", "√": r"$\surd$", "∞": r"$\infty$"},
    **{"½": r"$\tfrac12$", "≤": r"$\le$", "≥": r"$\ge$", "→": r"$\to$", "…": r"\ldots{}"},
    **{"–": "--", "“": "``", "”": "''", "’": "'", "×": r"$\times$", "✓": "OK", "\u2009": r"\,"},
    **{"Φ": r"$\Phi$", "λ": r"$\lambda$", "α": r"$\alpha$", "ω": r"$\omega$", "Δ": r"$\Delta$"},
    **{"Σ": r"$\Sigma$", "θ": r"$\theta$", "β": r"$\beta$", "γ": r"$\gamma$", "δ": r"$\delta$"},
    **{"π": r"$\pi$", "μ": r"$\mu$", "ρ": r"$\rho$", "ψ": r"$\psi$", "∂": r"$\partial$"},
    **{"²": r"$^2$", "³": r"$^3$", "ᵀ": r"$^{\mathsf T}$", "⁻": r"$^-$", "∫": r"$\int$"},
    **dict(zip("⁰¹⁴⁵⁶⁷⁸⁹", (f"$^{n}$" for n in "01456789"), strict=True)),
}


def latex(document: ReportDocument, folder: str) -> str:
    """The text; pictures are named in `folder`, which the caller writes."""
    about = [f"{_latex_text(what)} & {_latex_text(value)} \\\\" for what, value in document.about]
    lines = [
        LATEX_HEAD + rf"\title{{{_latex_text(document.title)}}}",
        r"\date{}",
        r"\begin{document}",
    ]
    lines += [r"\maketitle", r"\begin{tabular}{@{}ll@{}}", *about, r"\end{tabular}"]
    numbered = iter(range(1, 1000))
    for chapter in document.chapters:
        lines += ["", rf"\section{{{_latex_text(chapter.title)}}}"]
        for block in chapter.blocks:
            lines += ["", *_latex_block(block, folder, numbered)]
    return "\n".join([*lines, r"\end{document}", ""])


def _latex_block(block: Block, folder: str, numbered: Iterator[int]) -> list[str]:
    if isinstance(block, Text):
        return [_latex_text(block.text)]
    if isinstance(block, Items):
        items = [rf"\item {_latex_text(item)}" for item in block.items]
        return [r"\begin{itemize}", *items, r"\end{itemize}"]
    if isinstance(block, Grid):
        return _latex_grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        file = f"{folder}/{block.name}.pdf"
        size = r"width=\linewidth,height=0.42\textheight,keepaspectratio"
        picture = rf"\includegraphics[{size}]{{\detokenize{{{file}}}}}"
        caption = rf"\\[2pt]{{\small\textbf{{Figure {n}.}} {_latex_text(block.caption)}}}"
        return [r"\begin{center}", picture + caption, r"\end{center}"]
    if isinstance(block, Notice):
        return [rf"\notice{{{_latex_text(block.text)}}}"]
    if isinstance(block, DisplayedEquations):
        lines = [
            "& " + " ".join(latex for _, latex in row) for row in block.broken(LATEX_LINE_WIDTH)
        ]
        return [r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"]
    # the empty box keeps a line that begins with a bracket from being an option of the break
    text = "\n".join(r"\mbox{}" + escaped(line) + r"\\" for line in block.text.splitlines())
    return [
        rf"\textbf{{{_latex_text(block.title)}}}",
        r"{\ttfamily\scriptsize\raggedright\obeyspaces",
        text,
        "}",
    ]


def _latex_grid(grid: Grid) -> list[str]:
    """A table that may go on on the next page; text columns share what is left."""
    filled, widths = grid.filled_columns, grid.widths
    size, letters = next((one for one in SIZES if sum(widths) + len(widths) <= one[1]), SIZES[-1])
    left = letters - len(widths) - sum(w for w in widths if w <= LONG)
    long = [n for n, w in enumerate(widths) if w > LONG] if sum(widths) > letters else []
    share = max(LONG, left / max(1, len(long)))
    kinds = [
        rf">{{\raggedright\arraybackslash}}p{{{share / letters:.2f}\linewidth}}"
        if n in long
        else ("l" if n == 0 or column.text else "r")
        for n, column in enumerate(filled)
    ]
    heads = [_latex_text(column.title) for column in filled]
    units = [_latex_text(column.unit) for column in filled]
    rows = [" & ".join(map(_latex_text, row)) + r" \\" for row in grid.rows]
    head = [r"\toprule", " & ".join(heads) + r" \\"]
    if any(units):
        head.append(" & ".join(units) + r" \\")
    head.append(r"\midrule")
    return [
        rf"{{{size}\setlength{{\tabcolsep}}{{3pt}}",
        rf"\begin{{longtable}}[l]{{@{{}}{''.join(kinds)}@{{}}}}",
        # the title is a row, so that no page ends with it
        rf"\multicolumn{{{len(filled)}}}{{@{{}}l@{{}}}}{{\textbf{{{_latex_text(grid.title)}}}}} \\",
        *head,
        r"\endfirsthead",
        *head,
        r"\endhead",
        *rows,
        r"\bottomrule",
        r"\end{longtable}}",
    ]


def _latex_text(text: str) -> str:
    r"""Text with its indices, bold words and code.

    >>> _latex_text("F_{32} = 5% of **all** `a_b`")
    '$F_{32}$ = 5\\% of \\textbf{all} \\texttt{a\\_b}'
    """
    found = []
    for kind, part, index in parts_of(text):
        if kind == "index":
            base = SIGNS.get(part, part).strip("$")
            inner = ",".join(
                piece
                if re.fullmatch(r"[0-9A-Za-z]{1,2}", piece)
                else rf"\mathrm{{{escaped(piece)}}}"
                for piece in index.split(",")
            )
            found.append(f"${base}_{{{inner}}}$")
        elif kind == "bold":
            found.append(rf"\textbf{{{escaped(part)}}}")
        else:
            found.append(rf"\texttt{{{escaped(part)}}}" if kind == "code" else escaped(part))
    return "".join(found)


def escaped(text: str) -> str:
    """Text with the commands of LaTeX for its signs."""
    # two hyphens, as of an option, would become a dash
    parts = re.split(r"(-(?=-))", text)
    return "".join(
        "-{}" if part == "-" and n % 2 else "".join(SIGNS.get(sign, sign) for sign in part)
        for n, part in enumerate(parts)
    )


# -- A report as PDF, typeset by Typst, which is a package without other programs --------------

TYPST_HEAD = """#set document(title: {title})
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
NOTICE_COLORS = {"good": "#00795a", "doubt": "#d55e00", "note": "#7d8894"}
#: Points: a picture is drawn in its own size, or as wide as the text.
WIDTH = 490.0
#: Letters that a line of a table has.
LETTERS = 118
#: Letters of a line of an equation.
TYPST_LINE_WIDTH = 120
#: Part of its own size that a picture has, as the text is smaller than on a screen.
PART = 0.86


def check_typst() -> Any:
    """The package."""
    try:
        import typst
    except ImportError:
        raise ModelError(
            "a PDF needs typst, which is not installed: pip install typst, or write .html and print"
        ) from None
    return typst


def pdf(document: ReportDocument) -> bytes:
    """The content of the file."""
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
    lines = [TYPST_HEAD.format(title=_quoted(document.title))]
    lines.append(f'#text(size: 17pt, weight: "bold")[{_typst_text(document.title)}]\n')
    pairs = "".join(
        f'[#text(fill: rgb("#56616c"))[{_typst_text(what)}]], [{_typst_text(value)}], '
        for what, value in document.about
    )
    lines.append(f"#grid(columns: (auto, 1fr), gutter: 5pt, {pairs})\n")
    numbered = iter(range(1, 1000))
    for chapter in document.chapters:
        lines.append(f"= {_typst_text(chapter.title)}\n")
        lines += [_typst_block(block, numbered) for block in chapter.blocks]
    return "\n".join(lines)


def _typst_block(block: Block, numbered: Iterator[int]) -> str:
    if isinstance(block, Text):
        return f"{_typst_text(block.text)}\n"
    if isinstance(block, Items):
        return "".join(f"- {_typst_text(item)}\n" for item in block.items)
    if isinstance(block, Grid):
        return _typst_grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        wide = min(WIDTH, PART * 72.0 * float(block.figure.get_size_inches()[0]))
        image = f"image({_quoted(f'{block.name}.svg')}, width: {wide:.0f}pt)"
        caption = f"*Figure {n}.* {_typst_text(block.caption)}"
        return (
            f"#block(breakable: false, above: 1em, below: 1.2em)[#{image}\n"
            f'#text(size: 8.5pt, fill: rgb("#56616c"))[{caption}]]\n'
        )
    if isinstance(block, Notice):
        return f'#notice(rgb("{NOTICE_COLORS[block.kind]}"))[{_typst_text(block.text)}]\n'
    if isinstance(block, DisplayedEquations):
        lines = "\n".join(
            " ".join(text for text, _ in row) for row in block.broken(TYPST_LINE_WIDTH)
        )
        return f"#raw({_quoted(lines)}, block: true)\n"
    return f"*{_typst_text(block.title)}*\n#raw({_quoted(block.text)}, block: true)\n"


def _typst_grid(grid: Grid) -> str:
    """A table; columns of long text share the width that is left."""
    filled = grid.filled_columns
    # only where the table is wider than the page, and columns of text alone
    full = sum(grid.widths) + 2 * len(filled) > LETTERS
    long = [
        full and width > 22 and column.text
        for column, width in zip(filled, grid.widths, strict=True)
    ]
    widths = ", ".join("1fr" if wide else "auto" for wide in long)
    sides = ", ".join(
        "left" if n == 0 or column.text else "right" for n, column in enumerate(filled)
    )
    heads = []
    for column in filled:
        unit = f'\\ #text(fill: rgb("#56616c"))[{_typst_text(column.unit)}]' if column.unit else ""
        heads.append(f"[*{_typst_text(column.title)}*{unit}]")
    cells = ", ".join(f"[{_typst_text(cell)}]" for row in grid.rows for cell in row)
    return (
        f"#grid-table([{_typst_text(grid.title)}], ({widths},), ({sides},), ({', '.join(heads)},), "
        f"{cells})\n"
    )


def _typst_text(text: str) -> str:
    r"""Text with its indices, bold words and code; signs of the language escaped.

    >>> _typst_text("F_{32} is *not* `A.force`")
    '#emph[F]#sub[32] is \\*not\\* #raw("A.force")'
    """
    found = []
    for kind, part, index in parts_of(text):
        if kind == "index":
            found.append(f"#emph[{_typst_plain(part)}]#sub[{_typst_plain(index)}]")
        elif kind == "bold":
            found.append(f"#strong[{_typst_plain(part)}]")
        else:
            found.append(f"#raw({_quoted(part)})" if kind == "code" else _typst_plain(part))
    return "".join(found)


def _typst_plain(text: str) -> str:
    return "".join(f"\\{sign}" if sign in "\\#$*_`<>@[]~'\"/=-+" else sign for sign in text)


def _quoted(text: str) -> str:
    inner = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "  ")
    return f'"{inner}"'
