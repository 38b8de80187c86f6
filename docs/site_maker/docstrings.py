"""Docstrings as reStructuredText reads them: bars, stars and primes are signs of mathematics."""

from __future__ import annotations

import re
from typing import Any

__all__ = ["plain"]

_CODE = re.compile(r"(``.*?``|`[^`]*`)")
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
            parts[::2] = [_MARKUP.sub(r"\\\g<0>", part) for part in parts[::2]]
            lines[number] = head + "".join(parts)
