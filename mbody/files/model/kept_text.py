"""The text of a model file with what has changed: comments, order, formulas and units of all else
stay as they were written.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from mbody.files.model.fields import plain
from mbody.files.model.problems import SECTIONS, TEXT_ATTRIBUTE, KeyPath, kind_in
from mbody.files.model.toml_text import toml, toml_value
from mbody.files.toml_spans import Spans, spliced, value_at
from mbody.model.mechanism import Mechanism
from mbody.quantities import FormulaError, Scope, evaluate, parse_unit
from mbody.quantities.units import DIMENSIONS, UnitSystem

#: Parts by which two numbers may differ that are one: a change of units and back, each rounded.
CONVERTED = 4.0 * 2.0**-52

#: A number with its unit, or without one; formulas have further signs.
NUMBER_TEXT = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*((?:[A-Za-zµ°%][^+()]*)?)"
)


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


def _own_path(path: KeyPath, written: Any) -> KeyPath:
    """A path by the word that the file has for the kind of an element."""
    entry = value_at(written, path[:2])
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
    spans = Spans(text)
    made = spans.tree
    wanted, sections = json.loads(json.dumps(after)), {}
    edits: dict[tuple[int, int], str] = {}
    anew: set[KeyPath] = set()
    for path in _changes(before, after):
        own, value = _own_path(path, made), value_at(after, path)
        above = value_at(made, own[:-1])
        if value is None and own in spans.entries and not spans.entries[own].inline:
            start, end, _ = spans.statement(own)
            edits[start, end] = ""
        elif value is not None and own in spans.entries:
            above[own[-1]] = kept = in_unit_of(above[own[-1]], value, units)
            if kept != value:
                value_at(wanted, path[:-1])[path[-1]] = kept
            anew.add(own)
        elif own[:-1] in spans.entries and isinstance(above, dict):
            above |= {own[-1]: value}
            if value is None:
                del above[own[-1]]
            anew.add(own[:-1])
        elif value is not None and len(own) == 1 and isinstance(value, dict):
            sections[own[0]] = value
        elif value is not None and own[:-1] in spans.tables:
            start, end, line = spans.inserted(own[:-1], own[-1], value)
            edits[start, end] = edits.get((start, end), "") + line
        else:  # of another form than in the text: the nearest that holds it is written anew
            inside = [own[:n] for n in range(len(own) - 1, 0, -1) if own[:n] in spans.entries]
            if not inside:
                return None
            nearest = inside[0]
            value_at(made, nearest[:-1])[nearest[-1]] = value_at(after, path[: len(nearest)])
            anew.add(nearest)
    whole = [path for path in anew if not any(path[:n] in anew for n in range(len(path)))]
    splices = [(start, end, new) for (start, end), new in edits.items()]
    splices += [spans.replaced(path, toml_value(value_at(made, path))) for path in whole]
    text = spliced(text, splices)
    return text + ("\n" + toml(sections) if sections else ""), wanted


def unit_of_text(written: Any, units: UnitSystem) -> tuple[str, float] | None:
    """The unit that the text of a number has, and its size in the unit that a plain number has in a
    file, which is a degree of angles; None where it has none.

    >>> from mbody.quantities.units import unit_system
    >>> unit_of_text("3 in", unit_system("mm-N-s"))
    ('in', 25.4)
    """
    number = NUMBER_TEXT.fullmatch(written) if isinstance(written, str) else None
    if number is None or not number[2]:
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
