"""In which line of a file a key stands: looked for only when there is an error to report."""

from __future__ import annotations

import functools
import json
import re
import tomllib
from collections.abc import Iterator
from typing import Any

__all__ = ["line_of"]

Path = tuple[Any, ...]

_TOML = re.compile(
    r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*|[\[\]{}\n]',
    re.DOTALL,
)
_JSON = re.compile(r'"(?:\\.|[^"\\])*"|[{}\[\]:,\n]', re.DOTALL)


def line_of(text: str, is_json: bool, path: Path) -> int | None:
    r"""The line, from 1, of the key at that path, or of the nearest one that holds it.

    >>> line_of('a = 1\n[b]\nc = 2', False, ("b", "c"))
    3
    >>> line_of('{"a": 1,\n"b": {"c": 2}}', True, ("b",))
    2
    """
    text = text.replace("\r\n", "\n")
    places = _json_places(text) if is_json else _toml_places(text, path)
    best, line = 0, None
    for found, where in places:
        shared = 0
        while shared < min(len(found), len(path)) and found[shared] == path[shared]:
            shared += 1
        if shared == len(found) and shared > best:
            best, line = shared, where
    return line


def _toml_places(text: str, path: Path) -> Iterator[tuple[Path, int]]:
    """Paths of headers and of keys, as far as they lead towards the path."""
    section: Path = ()
    for header, tables, line in _read_statements(text):
        read: Any = tables
        found: Path = () if header else section
        while isinstance(read, dict) and read:
            key = next(iter(read)) if header else _towards(read, path[len(found) :])
            read = read[key]
            found = (*found, key)
            if isinstance(read, list) and header:
                read = read[0]
            yield found, line
        if header:
            section = found


@functools.lru_cache(maxsize=1)  # for all that is wrong in one file
def _read_statements(text: str) -> list[tuple[bool, dict[str, Any], int]]:
    """Whether it is a header, its tables, and the line, of every statement that can be read."""
    found = []
    for statement, line in _statements(text):
        try:
            read = tomllib.loads(statement)
        except (tomllib.TOMLDecodeError, RecursionError, ValueError):
            continue
        found.append((statement.lstrip().startswith("["), read, line))
    return found


def _towards(table: dict[str, Any], rest: Path) -> str:
    """The key of a table that leads on, else its first."""
    return rest[0] if rest and rest[0] in table else next(iter(table))


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
            stack[-1] = json.loads(last, strict=False)
            yield tuple(stack), line
        elif token.startswith('"'):
            last = token
        line += token.count("\n")
