"""Where everything of a TOML text stands, so that a file is changed in place: comments, order,
spacing, units and formulas stay as they were written.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mbody.files.model.toml_text import key_text, toml_value

Path = tuple[Any, ...]
#: Where a piece of a text begins and ends, and what comes in its place.
Splice = tuple[int, int, str]

_SPACE = re.compile(r"[ \t]*+")
_BLANK = re.compile(r"(?:[ \t\r\n]++|#[^\r\n]*+)*+")
_REST = re.compile(r"[ \t]*+(?:#[^\r\n]*+)?")
_KEY = re.compile(r"""[A-Za-z0-9_-]++|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+'""")
_TEXT = re.compile(
    r'"""(?:[^"\\]++|\\.|"{1,2}(?!"))*+"{3,5}'
    r"|'{3}(?:[^']++|'{1,2}(?!'))*+'{3,5}"
    r"""|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+'""",
    re.DOTALL,
)
_PLAIN = re.compile(r"[^\s,\]}#]++(?: [0-9][^\s,\]}#]*+)?")
#: Order in which sections are written into a file that has none of them yet.
SECTION_ORDER = (
    "output_units", "parameters", "curves", "inputs", "ground", "bodies", "joints", "contacts",
    "couplings", "states", "quantities", "drivers", "loads", "gravity", "measures", "ask",
    "simulate", "solve", "optimize", "fit", "report",
)  # fmt: skip


@dataclass
class TomlEntry:
    """A value with its key: where the key begins, where the value begins and ends, and whether it
    is within brackets.
    """

    at: int
    start: int
    end: int
    inline: bool


@dataclass
class OpenTable:
    """A table to which keys may be added: where its header begins, where its last key ends, with
    what its keys begin, and whether it is within brackets. One of dotted keys has no header.
    """

    header: int | None
    last: int
    prefix: str = ""
    inline: bool = False


class Spans:
    r"""All keys, entries of lists and sections of a text by their paths.

    Raises what `tomllib` raises of a text that is no TOML.

    >>> text = "[bodies.crank]\nmass = '2 kg'  # weighed"
    >>> spans = Spans(text)
    >>> spans.tree, spans.raw(("bodies", "crank", "mass"))
    ({'bodies': {'crank': {'mass': '2 kg'}}}, "'2 kg'")
    >>> spliced(text, [spans.replaced(("bodies", "crank", "mass"), "3")])
    '[bodies.crank]\nmass = 3  # weighed'
    """

    def __init__(self, text: str) -> None:
        self.text, self.tree = text, tomllib.loads(text)
        self.newline = "\r\n" if "\r\n" in text else "\n"
        self.entries: dict[Path, TomlEntry] = {}
        self.tables: dict[Path, OpenTable] = {(): OpenTable(None, 0)}
        #: Where each path is named first, those of tables that only dotted names have as well.
        self.first: dict[Path, int] = {}
        #: Where the last key of each path is written, in headers and dotted names too.
        self.keys: dict[Path, list[tuple[int, int]]] = {}
        self._lists: dict[Path, int] = {}
        section: Path = ()
        at = 0
        while (at := self._skip(_BLANK, at)) < len(text):
            if text[at] == "[":
                section, at = self._header(at)
            else:
                at = self._pair(at, section, False)
            self.tables[section].last = at

    # -- reading -----------------------------------------------------------------------------------

    def _skip(self, pattern: re.Pattern[str], at: int) -> int:
        found = pattern.match(self.text, at)
        return found.end() if found else at

    def _keys(self, at: int, above: Path) -> tuple[list[str], int]:
        """Names with dots between them, from the path of their table, and where they end."""
        keys: list[str] = []
        while found := _KEY.match(self.text, at):
            word = found[0]
            quoted = word[0] in "\"'"
            keys.append(next(iter(tomllib.loads(f"{word} = 0"))) if quoted else word)
            above = (*above, keys[-1])
            self.keys.setdefault(above, []).append(found.span())
            above = (*above, self._lists[above]) if above in self._lists else above
            at = self._skip(_SPACE, found.end())
            if not self.text.startswith(".", at):
                break
            at = self._skip(_SPACE, at + 1)
        return keys, at

    def _header(self, begin: int) -> tuple[Path, int]:
        """A section, entries of a list of tables with their numbers, and where its line ends."""
        double = self.text.startswith("[[", begin)
        keys, at = self._keys(self._skip(_SPACE, begin + 1 + double), ())
        section: Path = ()
        for n, key in enumerate(keys):
            section = (*section, key)
            self.first.setdefault(section, begin)
            if double and n == len(keys) - 1:
                self._lists[section] = self._lists.get(section, -1) + 1
            if section in self._lists:
                section = (*section, self._lists[section])
                self.first.setdefault(section, begin)
        at = self._skip(_REST, at + 1 + double)
        self.tables[section] = OpenTable(begin, at)
        return section, at

    def _pair(self, at: int, above: Path, inline: bool) -> int:
        keys, start = self._keys(at, above)
        start = self._skip(_SPACE, start + 1)  # behind the sign of equality
        path = (*above, *keys)
        for n in range(len(above) + 1, len(path) + 1):
            self.first.setdefault(path[:n], at)
        end = self._value(start, path)
        self.entries[path] = TomlEntry(at, start, end, inline)
        last = end if inline else self._skip(_REST, end)
        for n in range(1, len(keys)):
            prefix = "".join(f"{key_text(key)}." for key in keys[:n])
            self.tables[(*above, *keys[:n])] = OpenTable(None, last, prefix, inline)
        return last

    def _value(self, at: int, path: Path) -> int:
        text = self.text
        if text[at] in "[{":
            close, n = {"[": "]", "{": "}"}[text[at]], 0
            at = self._skip(_BLANK, at + 1)
            while text[at] != close:
                if close == "}":
                    at = self._pair(at, path, True)
                else:
                    self.first[(*path, n)] = at
                    end = self._value(at, (*path, n))
                    self.entries[(*path, n)] = TomlEntry(at, at, end, True)
                    at, n = end, n + 1
                at = self._skip(_BLANK, at)
                if text[at] == ",":
                    at = self._skip(_BLANK, at + 1)
            return at + 1
        found = _TEXT.match(text, at) or _PLAIN.match(text, at)
        assert found is not None  # tomllib has read it
        return found.end()

    def line(self, path: Path) -> int | None:
        r"""The line, from 1, of a path or of the nearest that contains it.

        >>> Spans("a = 1\n[b]\nc = 2").line(("b", "d"))
        2
        """
        for n in range(len(path), 0, -1):
            if (at := self.first.get(path[:n])) is not None:
                return self.text.count("\n", 0, at) + 1
        return None

    def raw(self, path: Path) -> str:
        """A value as it is written."""
        entry = self.entries[path]
        return self.text[entry.start : entry.end]

    # -- changes -----------------------------------------------------------------------------------

    def replaced(self, path: Path, new: str) -> Splice:
        """Another value in the place of one."""
        entry = self.entries[path]
        return entry.start, entry.end, new

    def inserted(self, table: Path, key: str, value: Any) -> Splice:
        """A further key of a table, however that is written; a table that there is not comes with
        it.
        """
        entry, text = self.entries.get(table), self.text
        if entry is not None:  # { … }
            if text[entry.start] != "{":
                raise ValueError(f"{key_text(table[-1])} is no table")
            inside = text[entry.start + 1 : entry.end - 1].rstrip()
            pair = f"{key_text(key)} = {toml_value(value)}"
            if not inside:
                return entry.start, entry.end, f"{{ {pair} }}"
            at = entry.start + 1 + len(inside)
            return at, at, f"{' ' if inside.endswith(',') else ', '}{pair}"
        own = self.tables.get(table)
        if own is not None and own.inline:
            return own.last, own.last, f", {own.prefix}{key_text(key)} = {toml_value(value)}"
        if own is not None and own.last:
            column = max(text[text.rfind("\n", 0, own.last) + 1 : own.last].find("=") - 1, 0)
            line = f"{own.prefix + key_text(key):{column}} = {toml_value(value)}"
            return own.last, own.last, self.newline + line
        if not table:
            return 0, 0, f"{key_text(key)} = {toml_value(value)}{self.newline}"
        if len(table) > 1 and (table[:-1] in self.entries or table[:-1] in self.tables):
            return self.inserted(table[:-1], table[-1], {key: value})
        return self.section(table, {key: value})

    def section(self, path: Path, entries: Mapping[str, Any]) -> Splice:
        """A section of its own, behind those of its kind."""
        lasts = [one.last for name, one in self.tables.items() if name[:1] == path[:1]]
        if not lasts:
            rank = SECTION_ORDER.index(path[0]) if path[0] in SECTION_ORDER else -1
            later = SECTION_ORDER[rank + 1 :] if rank >= 0 else []
            lasts = [t.last for name, t in self.tables.items() if not name or name[0] not in later]
        at, end = max(lasts), self.newline
        name = ".".join(key_text(part) for part in path)
        lines = [f"[{name}]", *(f"{key_text(k)} = {toml_value(v)}" for k, v in entries.items())]
        before = 2 * end if at else ""
        if not at and not self.tables.keys() - {()}:  # comments alone stay above
            at = len(self.text)
            before = (end if self.text.endswith("\n") else 2 * end) if at else ""
        last = at >= len(self.text) or not at
        return at, at, before + end.join(lines) + (end if last else "") + (end if not at else "")

    def statement(self, path: Path) -> Splice:
        """Without the line or lines of a key, from the end of the line above."""
        entry = self.entries[path]
        return self._lines(self.text.rfind("\n", 0, entry.at) + 1, self._skip(_REST, entry.end))

    def _lines(self, start: int, end: int) -> Splice:
        """Without whole lines."""
        if start:
            return start - len(self.newline), end, ""
        return 0, end + len(self.newline) if self.text[end:] else end, ""

    def without(self, path: Path) -> str:
        """The text without a key, an entry or sections, and without comments about these alone."""
        below = [own for own in self.entries if own[: len(path)] == path]
        inline = next((own for own in below if self.entries[own].inline), None)
        if path in self.entries and self.entries[path].inline:
            return spliced(self.text, [self._entry(path)])
        tables = [one for own, one in self.tables.items() if own[: len(path)] == path and own]
        splices = [self._block(one) for one in tables if one.header is not None]
        for own in below:
            entry = self.entries[own]
            if not entry.inline and not any(a <= entry.at < b for a, b, _ in splices):
                splices.append(self._lines(self._comments(entry.at), self._skip(_REST, entry.end)))
        if splices or inline is None:
            return spliced(self.text, splices)
        # names with dots in braces: one after the other, as each has a comma of its own
        rest = Spans(spliced(self.text, [self._entry(inline)]))
        return rest.without(path) if path in rest.first else rest.text

    def _block(self, table: OpenTable) -> Splice:
        """Without a section."""
        text, end = self.text, table.last
        start = self._comments(table.header or 0)
        end = end + len(self.newline) if text[end:] else end
        blank = start == 0 or text[:start].endswith(2 * self.newline)
        while blank and text.startswith(self.newline, end):
            end += len(self.newline)
        return start, end, ""

    def _entry(self, path: Path) -> Splice:
        """Without an entry in brackets, and without one comma."""
        entry, text = self.entries[path], self.text
        end = self._skip(_BLANK, entry.end)
        if text[end] == "," and not text[entry.end : end].strip():
            return entry.at, self._skip(_SPACE, end + 1), ""
        before = text[: entry.at].rstrip(" \t")
        start = len(before[:-1].rstrip(" \t")) if before.endswith(",") else entry.at
        return start, entry.end, ""

    def _comments(self, at: int) -> int:
        """Where the comments begin that stand right above a line with nothing else above them."""
        start = first = self.text.rfind("\n", 0, at) + 1
        while first:
            above = self.text.rfind("\n", 0, first - 1) + 1
            line = self.text[above:first].strip()
            if not line.startswith("#"):
                return start if line else first
            first = above
        return start


def spliced(text: str, splices: list[Splice]) -> str:
    """A text with pieces exchanged, which do not overlap.

    >>> spliced("a b c", [(0, 1, "x"), (4, 5, "")])
    'x b '
    """
    for start, end, new in sorted(splices, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def value_at(tree: Any, path: Path) -> Any:
    """The value at a path of tables, None where there is none.

    >>> value_at({"a": [1, {"b": 2}]}, ("a", 1, "b"))
    2
    """
    for key in path:
        try:
            tree = tree[key]
        except (KeyError, IndexError, TypeError):
            return None
    return tree
