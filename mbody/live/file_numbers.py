"""Which numbers of a model stand in its file, where, and in which unit: what a page can change and
write back.
"""

from __future__ import annotations

import itertools
import math
import random
import tomllib
from dataclasses import dataclass, field
from typing import Any

from mbody.core.tolerances import DIFFERENCE_RATIOS_SAME, DIFFERENCE_STEP_NUMBERS
from mbody.errors import ModelError
from mbody.files.model import to_toml
from mbody.files.model.kept_text import NUMBER_TEXT
from mbody.files.model.read import built
from mbody.files.model.write import as_it_was
from mbody.files.toml_spans import Spans
from mbody.model.mechanism import Mechanism
from mbody.system.assembler import assemble

#: Tables whose numbers describe the mechanism; others say what is asked of it.
DESCRIBING = (
    "parameters", "inputs", "ground", "bodies", "joints", "couplings", "drivers", "states", "loads",
)  # fmt: skip

Path = tuple[str | int, ...]


@dataclass(frozen=True)
class FileNumber:
    """A number in the text of a model file.

    `value`: As it stands there.
    `unit`: As it stands there; "" where the text has none.
    `factors`: By dotted name the numbers of the mechanism that it gives: each is the value times
      this.
    """

    value: float
    unit: str
    factors: dict[str, float]


@dataclass
class CutFile:
    """The text of a model file, cut at its numbers: text, number, text, …, text; empty where that
    text would not give the model.
    """

    parts: list[str] = field(default_factory=list)
    numbers: list[FileNumber] = field(default_factory=list)


def file_numbers(mechanism: Mechanism, names: list[str]) -> CutFile:
    """The file of a mechanism, and which of its numbers give which of the mechanism's.

    Every number of the file is changed by a random part, twice; a number of the mechanism whose two
    changes have the ratio of those of one in the file comes from it.

    >>> from mbody import gallery
    >>> found = file_numbers(gallery.load("norton_fourbar"), ["coupler.weight", "crank.cg.angle"])
    >>> [(one.value, one.unit, list(one.factors)) for one in found.numbers]
    [(30.0, '', ['crank.cg.angle']), (7.7, 'lbf', ['coupler.weight'])]
    """
    text = as_it_was(mechanism) or to_toml(mechanism)
    tree = tomllib.loads(text)
    places = [path for path, value in _leaves(tree) if _parsed(value) is not None]
    places = [path for path in places if path[0] in DESCRIBING]
    chance = random.Random(1)
    variants: list[dict[Path, float]] = [{}, {}]
    for path in places:
        value = _number(tree, path)
        for one in variants:
            part = chance.uniform(0.5, 1.5)
            one[path] = value * (1.0 + DIFFERENCE_STEP_NUMBERS * part) if value else part
    good = _allowed(tree, places, variants)
    before = _values(tree, {})
    first, second = (_values(tree, {p: c[p] for p in good}) for c in variants)
    ratios = {
        path: (variants[1][path] - _number(tree, path)) / (variants[0][path] - _number(tree, path))
        for path in good
    }
    found: dict[Path, dict[str, float]] = {}
    for name in names:
        if name not in before or first[name] == before[name]:
            continue
        ratio = (second[name] - before[name]) / (first[name] - before[name])
        matching = [path for path in good if abs(ratios[path] - ratio) <= DIFFERENCE_RATIOS_SAME]
        if len(matching) != 1:
            continue
        path = matching[0]
        value, x = _number(tree, path), variants[0][path]
        factor = before[name] / value if value else first[name] / x
        if abs(factor * x - first[name]) <= DIFFERENCE_RATIOS_SAME * abs(first[name]):
            found.setdefault(path, {})[name] = factor
    return _cut(text, tree, found)


def _leaves(tree: Any, path: Path = ()) -> list[tuple[Path, Any]]:
    pairs = tree.items() if isinstance(tree, dict) else enumerate(tree)
    found: list[tuple[Path, Any]] = []
    for key, value in pairs:
        if isinstance(value, (dict, list)):
            found += _leaves(value, (*path, key))
        else:
            found.append(((*path, key), value))
    return found


def _parsed(value: Any) -> tuple[float, str] | None:
    """Number and unit of an entry; None where it is no number.

    >>> _parsed("120 lbf*in"), _parsed(3), _parsed("ground.A"), _parsed("3 in + r")
    ((120.0, 'lbf*in'), (3.0, ''), None, None)
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return (float(value), "") if math.isfinite(value) else None
    parts = NUMBER_TEXT.fullmatch(value) if isinstance(value, str) else None
    if parts is None or " - " in value or not math.isfinite(float(parts[1])):
        return None
    return float(parts[1]), parts[2].strip()


def _value_at(tree: Any, path: Path) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def _number(tree: Any, path: Path) -> float:
    parsed = _parsed(_value_at(tree, path))
    assert parsed is not None
    return parsed[0]


def _with(tree: Any, new: dict[Path, Any], path: Path = ()) -> Any:
    """The tables with other entries."""
    if path in new:
        return new[path]
    if isinstance(tree, dict):
        return {key: _with(value, new, (*path, key)) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_with(value, new, (*path, n)) for n, value in enumerate(tree)]
    return tree


def _values(tree: Any, numbers: dict[Path, float]) -> dict[str, float]:
    """All numbers of the mechanism of these tables."""
    new: dict[Path, Any] = {}
    for path, number in numbers.items():
        old = _value_at(tree, path)
        parsed = _parsed(old) if isinstance(old, str) else None
        new[path] = number if parsed is None else f"{number!r} {parsed[1]}"
    return dict(assemble(built(_with(tree, new))).values)


def _allowed(tree: Any, places: list[Path], variants: list[dict[Path, float]]) -> list[Path]:
    """Places whose numbers may be changed: counts and choices may not."""
    try:
        for one in variants:
            _values(tree, {path: one[path] for path in places})
    except (ModelError, ValueError, TypeError):
        if len(places) < 2:
            return []
        half = len(places) // 2
        return [*_allowed(tree, places[:half], variants), *_allowed(tree, places[half:], variants)]
    return places


def _cut(text: str, tree: Any, found: dict[Path, dict[str, float]]) -> CutFile:
    """The text, cut at the numbers that were found."""
    spans, cut = Spans(text), CutFile()
    start = 0
    for begin, path in sorted((spans.entries[path].start, path) for path in found):
        number, unit = _parsed(_value_at(tree, path))  # type: ignore[misc]
        place = NUMBER_TEXT.match(text, begin + isinstance(_value_at(tree, path), str))
        if place is None or float(place[1]) != number:  # with signs that only TOML has
            return CutFile()
        cut.parts.append(text[start : place.start(1)])
        cut.numbers.append(FileNumber(number, unit, found[path]))
        start = place.end(1)
    cut.parts.append(text[start:])
    whole = "".join(
        part if number is None else part + repr(number.value)
        for part, number in itertools.zip_longest(cut.parts, cut.numbers)
    )
    if _values(tomllib.loads(whole), {}) != _values(tree, {}):
        return CutFile()  # rather no numbers than others
    return cut
