"""The text of a model file with what has changed: comments, order, formulas and units of all else
stay as they were written.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from mbody.files.model.fields import plain
from mbody.files.model.problems import SECTIONS, TEXT_ATTRIBUTE, TEXTS, KeyPath, kind_in
from mbody.files.model.toml_text import toml, toml_value
from mbody.model.mechanism import Mechanism
from mbody.quantities import FormulaError, Scope, evaluate, parse_unit
from mbody.quantities.units import DIMENSIONS, UnitSystem

#: Parts by which two numbers may differ that are one: a change of units and back, each rounded.
CONVERTED = 4.0 * 2.0**-52

_SPACE = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_STRING = re.compile(TEXTS + r"""|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+'""", re.DOTALL)
_BARE = re.compile(r"[^,\]\}#\n]+")
_KEY = re.compile(r"""[ \t]*([\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')[ \t]*""")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµ°%][^+()]*)")


def kept_text(mechanism: Mechanism) -> str | None:
    """The text of the TOML file that a mechanism was read from, None of another."""
    return vars(mechanism).get(TEXT_ATTRIBUTE)


def shortest(value: float, within: float = CONVERTED) -> float:
    """The decimal of fewest digits that is within that part of a number.

    >>> shortest(0.1124 / 0.001)
    112.4
    """
    for digits in range(1, 17):
        short = float(f"{value:.{digits}g}")
        if abs(short - value) <= within * abs(value):
            return short
    return value


# -- Where values stand in a text --------------------------------------------------------------


@dataclass
class TextPlaces:
    """Where the values of a text of TOML stand.

    `values`: By path where a value begins and ends.
    `lines`: By path where the statement of a value begins and ends, with its line end.
    `ends`: By path of a table, where a statement may be added, and what its keys begin with.
    """

    values: dict[KeyPath, tuple[int, int]] = field(default_factory=dict)
    lines: dict[KeyPath, tuple[int, int]] = field(default_factory=dict)
    ends: dict[KeyPath, tuple[int, str]] = field(default_factory=dict)


def places_in(text: str) -> TextPlaces | None:
    """The places of a text that `tomllib` reads; None where it has arrays of tables."""
    found, section, at = TextPlaces({}, {}, {(): (0, "")}), (), 0
    while (at := _space(text, at)) < len(text):
        if text.startswith("[[", at):
            return None
        if text[at] == "[":
            section, at = _keys(text, at + 1)
            at = _line_end(text, at + 1)
            found.ends[section] = (at, "")
            continue
        begin = text.rfind("\n", 0, at) + 1
        own, at = _keys(text, at)
        at = _value(text, _space(text, at + 1), (*section, *own), found)
        at = _line_end(text, at)
        found.lines[(*section, *own)] = (begin, at)
        for n in range(len(own)):
            found.ends[(*section, *own[:n])] = (at, "".join(f"{_written(k)}." for k in own[:n]))
    return found


def _space(text: str, at: int) -> int:
    found = _SPACE.match(text, at)
    return found.end() if found else at


def _line_end(text: str, at: int) -> int:
    end = text.find("\n", at)
    return len(text) if end < 0 else end + 1


def _keys(text: str, at: int) -> tuple[KeyPath, int]:
    """The parts of a key, and where it ends: at a sign of equality or a bracket."""
    keys: list[str] = []
    while found := _KEY.match(text, at):
        part = found[1]
        quoted = part[0] in "\"'"
        keys.append(next(iter(tomllib.loads(f"{part} = 0"))) if quoted else part)
        at = found.end()
        if text[at] != ".":
            break
        at += 1
    return tuple(keys), at


def _written(key: str) -> str:
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else json.dumps(key, ensure_ascii=False)


def _value(text: str, at: int, path: KeyPath, found: TextPlaces) -> int:
    """Note a value and what is in it; where it ends."""
    begin = at
    if text[at] == "[":
        at, n = _space(text, at + 1), 0
        while text[at] != "]":
            at = _space(text, _value(text, at, (*path, n), found))
            at, n = _space(text, at + (text[at] == ",")), n + 1
        at += 1
    elif text[at] == "{":
        at = _space(text, at + 1)
        while text[at] != "}":
            own, at = _keys(text, at)
            at = _space(text, _value(text, _space(text, at + 1), (*path, *own), found))
            at = _space(text, at + (text[at] == ","))
        at += 1
    elif text[at] in "\"'":
        match = _STRING.match(text, at)
        assert match is not None  # tomllib has read it
        at = match.end()
    else:
        match = _BARE.match(text, at)
        assert match is not None
        at = begin + len(match.group().rstrip())
    found.values[path] = (begin, at)
    return at


# -- What has changed --------------------------------------------------------------------------


def _changes(before: Any, after: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Paths at which tables differ."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in {**before, **after}:
            if key in before and key in after:
                yield from _changes(before[key], after[key], (*path, key))
            else:
                yield (*path, key)
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for n, pair in enumerate(zip(before, after, strict=True)):
            yield from _changes(*pair, (*path, n))
    elif repr(before) != repr(after):
        yield path


def _at(data: Any, path: KeyPath) -> Any:
    """The value at a path, None where there is none."""
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _own_path(path: KeyPath, written: Any) -> KeyPath:
    """A path by the word that the file has for the kind of an element."""
    entry = _at(written, path[:2])
    if len(path) > 2 and path[0] in SECTIONS and path[2] in SECTIONS[path[0]]:
        return (*path[:2], kind_in(path[0], entry) or path[2], *path[3:])
    return path


def changed_text(
    text: str, before: dict[str, Any], after: dict[str, Any], units: UnitSystem
) -> tuple[str, dict[str, Any]] | None:
    """The text with the values of `after` where they differ from those of `before`, and the tables
    that it is to be read as; None where it cannot be changed so.

    `before`, `after`: The tables of the mechanism as it was read from the text, and as it is.
    """
    places, made = places_in(text), tomllib.loads(text)
    if places is None:
        return None
    wanted, sections = json.loads(json.dumps(after)), {}
    edits: dict[tuple[int, int], str] = {}
    anew: set[KeyPath] = set()
    for path in _changes(before, after):
        own, value = _own_path(path, made), _at(after, path)
        above = _at(made, own[:-1])
        if value is None and own in places.lines:
            edits[places.lines[own]] = ""
        elif value is not None and own in places.values:
            above[own[-1]] = kept = in_unit_of(above[own[-1]], value, units)
            if kept != value:
                _at(wanted, path[:-1])[path[-1]] = kept
            anew.add(own)
        elif own[:-1] in places.values and isinstance(above, dict):
            above |= {own[-1]: value}
            if value is None:
                del above[own[-1]]
            anew.add(own[:-1])
        elif value is not None and len(own) == 1 and isinstance(value, dict):
            sections[own[0]] = value
        elif value is not None and own[:-1] in places.ends:
            end, prefix = places.ends[own[:-1]]
            key = f"{prefix}{_written(own[-1])}"
            column = text[:end].rstrip("\n").rpartition("\n")[2].find("=")  # of the line above
            first = "" if text[:end].endswith("\n") or not end else "\n"
            line = f"{key:{max(column - 1, 0)}} = {toml_value(value)}\n"
            edits[end, end] = edits.get((end, end), first) + line
        else:  # of another form than in the text: the nearest that holds it is written anew
            inside = [own[:n] for n in range(len(own) - 1, 0, -1) if own[:n] in places.values]
            if not inside:
                return None
            nearest = inside[0]
            _at(made, nearest[:-1])[nearest[-1]] = _at(after, path[: len(nearest)])
            anew.add(nearest)
    whole = [path for path in anew if not any(path[:n] in anew for n in range(len(path)))]
    edits |= {places.values[path]: toml_value(_at(made, path)) for path in whole}
    for (begin, end), new in sorted(edits.items(), reverse=True):
        text = text[:begin] + new + text[end:]
    return text + ("\n" + toml(sections) if sections else ""), wanted


def unit_of_text(written: Any, units: UnitSystem) -> tuple[str, float] | None:
    """The unit that the text of a number has, and its size in the unit that a plain number has in a
    file, which is a degree of angles; None where it has none.

    >>> from mbody.quantities.units import unit_system
    >>> unit_of_text("3 in", unit_system("mm-N-s"))
    ('in', 25.4)
    """
    number = _NUMBER.fullmatch(written) if isinstance(written, str) else None
    if number is None:
        return None
    try:
        unit = evaluate(parse_unit(number[2]), Scope(units), with_units=True)
    except FormulaError:
        return None
    size = float(unit.value)
    if unit.dimension == DIMENSIONS["angle"]:
        size = math.degrees(size)
    whole = unit.dimension is not None and math.isfinite(size) and size > 0.0
    return (number[2], size) if whole else None


def in_unit_of(written: Any, value: Any, units: UnitSystem) -> Any:
    """A plain number of a file in the unit that its text has, where it has one."""
    unit = unit_of_text(written, units)
    if unit is None or isinstance(value, (str, bool)) or not isinstance(value, (int, float)):
        return value
    return f"{plain(shortest(value / unit[1]))!r} {unit[0]}"
