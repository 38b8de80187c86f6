"""Notebook displays of mechanisms and results: the summary, and a small picture beside it."""

from __future__ import annotations

import html
import io
import re
from typing import Any

from mbody.errors import ModelError, SolveError
from mbody.files.model import to_toml
from mbody.model.mechanism import Mechanism
from mbody.solution.solution import Solution
from mbody.system.system import System

#: Lines of a summary that are shown, and the height of the picture on the screen.
LINES, HIGH = 60, "16em"
STYLE = "display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start"


def html_of(result: Any) -> str:
    """HTML of a mechanism, a system, or a result.

    >>> import mbody
    >>> page = html_of(mbody.mobility(mbody.makers.four_bar(1, 3, 2, 3.5)))
    >>> page.count("<pre"), "four-bar" in page
    (1, True)
    """
    text = html.escape(_text(result))
    parts = [f'<pre style="margin:0;line-height:1.25">{text}</pre>']
    picture = _picture(result)
    if picture:
        parts.append(f'<div style="max-width:30em">{picture}</div>')
    return f'<div style="{STYLE}">{"".join(parts)}</div>'


def _text(result: Any) -> str:
    """The summary of a result, the file of a mechanism; else one line."""
    machine = result.mechanism if isinstance(result, System) else result
    try:
        text = to_toml(machine) if isinstance(machine, Mechanism) else str(result)
    except (ModelError, SolveError):  # Python, which no file has; a batch, which has no summary
        return repr(result)
    lines = text.rstrip().splitlines()
    more = len(lines) - LINES
    if more > 0:
        lines = [*lines[:LINES], f"… and {more} lines more: print it, or write it to a file"]
    return "\n".join(lines)


def _picture(result: Any) -> str:
    """A drawing as SVG, of what can be drawn; empty where that is not possible."""
    if not isinstance(result, Mechanism | System | Solution):
        return ""
    from mbody.views import draw

    buffer = io.StringIO()
    try:
        figure = draw(result.take([0]) if isinstance(result, Solution) else result)
        figure.savefig(buffer, format="svg", bbox_inches="tight")
    except (ModelError, SolveError, ImportError):  # it does not close, a batch, no matplotlib
        return ""
    found = buffer.getvalue()
    found = found[found.index("<svg") :]
    sized = re.sub(r'(<svg\b[^>]*?) (?:width|height)="[^"]*"', r"\1", found, count=2)
    return sized.replace("<svg", f'<svg style="height:{HIGH};width:auto;max-width:100%"', 1)
