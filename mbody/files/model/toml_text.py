"""Tables as TOML that reads like a textbook: short tables on one line, long ones as sections."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

WIDTH = 100
SECTIONED = ("bodies",)  # every entry is a section of its own
INLINE = ("inputs",)  # none is: sections would come after plain entries that follow them


def toml(data: dict[str, Any]) -> str:
    """The text of a model file.

    >>> print(toml({"name": "x", "joints": {"A": {"revolute": ["ground", "arm"]}}}))
    name = "x"
    <BLANKLINE>
    [joints]
    A = { revolute = ["ground", "arm"] }
    <BLANKLINE>
    """
    top = {key: value for key, value in data.items() if not isinstance(value, dict)}
    blocks = [list(_pairs(top))]
    for section, table in data.items():
        if isinstance(table, dict):
            blocks += _section(section, table)
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _section(name: str, table: dict[str, Any]) -> Iterator[list[str]]:
    """A table, and those of its entries that are sections of their own."""
    long = {
        key: value
        for key, value in table.items()
        if isinstance(value, dict)
        and name not in INLINE
        and (name in SECTIONED or len(key) + 3 + len(toml_value(value)) > WIDTH)
    }
    # the order of entries is kept: from the first that is long on, all are sections
    keys = list(table)
    first = next((n for n, key in enumerate(keys) if key in long), len(keys))
    nested = [key for key in keys[first:] if isinstance(table[key], dict)]
    sections = set(nested)
    own = {key: value for key, value in table.items() if key not in sections}
    if own or not table:
        yield [f"[{name}]", *_pairs(own)]
    for key in nested:
        yield [f"[{name}.{key_text(key)}]", *_pairs(table[key])]


def _pairs(table: dict[str, Any]) -> Iterator[str]:
    """Lines of keys and values, the signs of equality in one column."""
    wide = max((len(key_text(key)) for key in table), default=0)
    for key, value in table.items():
        line = f"{key_text(key):{wide}} = {toml_value(value)}"
        if len(line) > WIDTH and isinstance(value, list):
            line = f"{key_text(key):{wide}} = [\n{_rows(value)}\n]"
        yield line


def _rows(values: list[Any]) -> str:
    """Entries of a long list, as many on a line as fit."""
    lines, line = [], ""
    for value in values:
        cell = toml_value(value) + ","
        if line and len(line) + len(cell) + 1 > WIDTH - 4:
            lines.append(line)
            line = ""
        line = f"{line} {cell}" if line else cell
    return "\n".join(f"    {line}" for line in [*lines, line])


def key_text(key: Any) -> str:
    """A key, with quotes where it needs them."""
    key = str(key)
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _text(text: str) -> str:
    """A basic string: JSON's escapes are TOML's, but for a lone DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_value(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list):
        return f"[{', '.join(toml_value(part) for part in value)}]"
    if isinstance(value, dict):
        inside = ", ".join(f"{key_text(key)} = {toml_value(part)}" for key, part in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    return repr(value)
