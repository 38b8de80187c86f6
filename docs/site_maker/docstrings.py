"""Docstrings as reStructuredText reads them: bars, stars and primes are signs of mathematics."""

from __future__ import annotations

import re
from typing import Any

__all__ = ["plain"]

_CODE = re.compile(r"(``.*?``|`[^`]*`)")
#: Titles of books and papers.
_TITLE = re.compile(r"(?<![\w*])\*[A-Z][^*`]*[^*`\s]\*(?![\w*])")
_MARKUP = re.compile(r"[*|]|(?<=\w)_(?!\w)")
_BULLET = re.compile(r" *\* ")


def plain(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Escape what reStructuredText would take for markup; code and examples stay."""
    in_example = False
    for number, line in enumerate(lines):
        in_example = line.lstrip().startswith(">>>") or (in_example and bool(line.strip()))
        if not in_example:
            bullet = _BULLET.match(line)
            head = bullet[0] if bullet else ""
            parts = _CODE.split(line[len(head) :])
            parts[::2] = [_escaped(part) for part in parts[::2]]
            lines[number] = head + "".join(parts)


def _escaped(text: str) -> str:
    r"""A text whose only markup are titles.

    >>> _escaped("f* by A. Author, *A Title*, 2 * 3")
    'f\\* by A. Author, *A Title*, 2 \\* 3'
    """
    pieces, at = [], 0
    for title in _TITLE.finditer(text):
        pieces += [_MARKUP.sub(r"\\\g<0>", text[at : title.start()]), title[0]]
        at = title.end()
    return "".join([*pieces, _MARKUP.sub(r"\\\g<0>", text[at:])])


def dashes(app: Any, doctree: Any) -> None:
    """Dashes between a parameter and its meaning, which Sphinx writes as two hyphens."""
    from docutils import nodes

    for text in list(doctree.findall(nodes.Text)):
        if text.astext() == " -- ":
            text.parent.replace(text, nodes.Text(" – "))
