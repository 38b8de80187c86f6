"""A report as LaTeX, its pictures as PDF files beside it; for one's own document too."""

from __future__ import annotations

import re
from collections.abc import Iterator

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

__all__ = ["escaped", "latex"]

HEAD = r"""\documentclass[11pt,a4paper]{article}
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
LINE = 84
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
    about = [f"{_rich(what)} & {_rich(value)} \\\\" for what, value in document.about]
    lines = [HEAD + rf"\title{{{_rich(document.title)}}}", r"\date{}", r"\begin{document}"]
    lines += [r"\maketitle", r"\begin{tabular}{@{}ll@{}}", *about, r"\end{tabular}"]
    numbered = iter(range(1, 1000))
    for chapter in document.chapters:
        lines += ["", rf"\section{{{_rich(chapter.title)}}}"]
        for block in chapter.blocks:
            lines += ["", *_block(block, folder, numbered)]
    return "\n".join([*lines, r"\end{document}", ""])


def _block(block: Block, folder: str, numbered: Iterator[int]) -> list[str]:
    if isinstance(block, Text):
        return [_rich(block.text)]
    if isinstance(block, Items):
        items = [rf"\item {_rich(item)}" for item in block.items]
        return [r"\begin{itemize}", *items, r"\end{itemize}"]
    if isinstance(block, Grid):
        return _grid(block)
    if isinstance(block, Picture):
        n = next(numbered)
        file = f"{folder}/{block.name}.pdf"
        size = r"width=\linewidth,height=0.42\textheight,keepaspectratio"
        picture = rf"\includegraphics[{size}]{{\detokenize{{{file}}}}}"
        caption = rf"\\[2pt]{{\small\textbf{{Figure {n}.}} {_rich(block.caption)}}}"
        return [r"\begin{center}", picture + caption, r"\end{center}"]
    if isinstance(block, Notice):
        return [rf"\notice{{{_rich(block.text)}}}"]
    if isinstance(block, DisplayedEquations):
        lines = ["& " + " ".join(latex for _, latex in row) for row in block.broken(LINE)]
        return [r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"]
    # the empty box keeps a line that begins with a bracket from being an option of the break
    text = "\n".join(r"\mbox{}" + escaped(line) + r"\\" for line in block.text.splitlines())
    return [
        rf"\textbf{{{_rich(block.title)}}}",
        r"{\ttfamily\scriptsize\raggedright\obeyspaces",
        text,
        "}",
    ]


def _grid(grid: Grid) -> list[str]:
    """A table that may go on on the next page; text columns share what is left."""
    shown, widths = grid.shown, grid.widths
    size, letters = next((one for one in SIZES if sum(widths) + len(widths) <= one[1]), SIZES[-1])
    left = letters - len(widths) - sum(w for w in widths if w <= LONG)
    long = [n for n, w in enumerate(widths) if w > LONG] if sum(widths) > letters else []
    share = max(LONG, left / max(1, len(long)))
    kinds = [
        rf">{{\raggedright\arraybackslash}}p{{{share / letters:.2f}\linewidth}}"
        if n in long
        else ("l" if n == 0 or column.text else "r")
        for n, column in enumerate(shown)
    ]
    heads = [_rich(column.title) for column in shown]
    units = [_rich(column.unit) for column in shown]
    rows = [" & ".join(map(_rich, row)) + r" \\" for row in grid.rows]
    head = [r"\toprule", " & ".join(heads) + r" \\"]
    if any(units):
        head.append(" & ".join(units) + r" \\")
    head.append(r"\midrule")
    return [
        rf"{{{size}\setlength{{\tabcolsep}}{{3pt}}",
        rf"\begin{{longtable}}[l]{{@{{}}{''.join(kinds)}@{{}}}}",
        # the title is a row, so that no page ends with it
        rf"\multicolumn{{{len(shown)}}}{{@{{}}l@{{}}}}{{\textbf{{{_rich(grid.title)}}}}} \\",
        *head,
        r"\endfirsthead",
        *head,
        r"\endhead",
        *rows,
        r"\bottomrule",
        r"\end{longtable}}",
    ]


def _rich(text: str) -> str:
    r"""Text with its indices, bold words and code.

    >>> _rich("F_{32} = 5% of **all** `a_b`")
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
