"""The line of a file that has a key: found only when there is an error to report."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Sequence
from typing import Any

__all__ = ["TEXTS", "lines_of"]

Path = tuple[Any, ...]

#: Whatever in TOML may hold signs that mean nothing there: long texts and comments. One that does
#: not end goes on to the end of the file, so that a search never looks twice at it.
TEXTS = (
    r'"""(?:[^"\\]++|\\.|"{1,2}(?!"))*+(?:"{3,5}|\Z)'
    r"|'{3}(?:[^']++|'{1,2}(?!'))*+(?:'{3,5}|\Z)"
    r"|#[^\n]*+"
)
_TOML = re.compile(TEXTS + r"""|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+'|[\[\]{}\n]""", re.DOTALL)
_JSON = re.compile(r'"(?:[^"\\]++|\\.)*+"|[{}\[\]:,\n]', re.DOTALL)


def lines_of(text: str, is_json: bool, paths: Sequence[Path]) -> list[int | None]:
    r"""The lines, from 1, of the keys at these paths, or of the nearest that contain them.

    >>> lines_of('a = 1\n[b]\nc = 2', False, [("b", "c"), ("b", "d")])
    [3, 2]
    >>> lines_of('{"a": 1,\n"b": {"c": 2}}', True, [("b",)])
    [2]
    """
    text = text.replace("\r\n", "\n")
    holders = {path[:n] for path in paths for n in range(1, len(path) + 1)}
    found: dict[Path, int] = {}
    for place, line in _json_places(text) if is_json else _toml_places(text, holders):
        if place in holders:
            found.setdefault(place, line)
    return [
        next((found[path[:n]] for n in range(len(path), 0, -1) if path[:n] in found), None)
        for path in paths
    ]


def _toml_places(text: str, holders: set[Path]) -> Iterator[tuple[Path, int]]:
    """Paths of headers, and of keys as far as they lead to what is looked for."""
    section: Path = ()
    for statement, line in _statements(text):
        try:
            read = tomllib.loads(statement)
        except (tomllib.TOMLDecodeError, RecursionError, ValueError):
            continue
        header = statement.lstrip().startswith("[")
        if header:
            section = ()
            while isinstance(read, dict) and read:
                key = next(iter(read))
                section, read = (*section, key), read[key]
                read = read[0] if isinstance(read, list) else read
                yield section, line
        else:
            yield from ((place, line) for place in _within(read, section, holders))


def _within(table: Any, above: Path, holders: set[Path]) -> Iterator[Path]:
    """The paths of keys in a table, and in tables in it that contain what is searched."""
    for key, value in table.items():
        if (place := (*above, key)) in holders:
            yield place
            if isinstance(value, dict):
                yield from _within(value, place, holders)


def _statements(text: str) -> Iterator[tuple[str, int]]:
    """Every header or pair of key and value, with the line where it begins."""
    start, depth, line, first = 0, 0, 1, 1
    for match in _TOML.finditer(text):
        token = match.group()
        if token in "[{":
            depth += 1
        elif token in "]}":
            depth -= 1
        elif token == "\n" and depth <= 0:
            if text[start : match.start()].strip():
                yield text[start : match.start()], first
            start, depth = match.end(), 0
            first = line + 1
        line += token.count("\n")
    if text[start:].strip():
        yield text[start:], first


def _json_places(text: str) -> Iterator[tuple[Path, int]]:
    """Paths of all keys and of all entries of lists."""
    stack: list[Any] = []
    line, last = 1, ""
    for match in _JSON.finditer(text):
        token = match.group()
        if token == "{":
            stack.append(None)
        elif token == "[":
            stack.append(0)
        elif token in "}]":
            if stack:
                stack.pop()
        elif token == "," and stack and isinstance(stack[-1], int):
            stack[-1] += 1
        elif token == ":" and stack:
            stack[-1] = _key(last)
            yield tuple(stack), line
        elif token.startswith('"'):
            last = token
        line += token.count("\n")


def _key(written: str) -> str:
    try:
        return str(json.loads(written))
    except ValueError:
        return written
