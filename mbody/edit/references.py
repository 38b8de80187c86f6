"""What of a model file refers to an element or a point: other names for them, and deletion."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from mbody.edit.places import EditError, place_name, point_path
from mbody.files.model.toml_text import key_text, toml_value
from mbody.files.toml_spans import Path, Spans, Splice, value_at

#: Tables of elements, whose entries go with what they refer to.
ELEMENTS = ("joints", "contacts", "couplings", "drivers", "loads", "states", "inputs")
#: Tables of studies by name, and those of one study.
STUDIES, TASKS = ("measures", "solve", "optimize"), ("ask", "simulate", "fit", "report")
#: Tables of names that formulas have without a dot behind them.
BARE = ("parameters", "inputs", "states", "curves", "measures")
#: Keys whose text names no element.
SILENT = ("name", "source", "note", "title", "unit", "units", "file", "column", "$schema")


def renamed(text: str, old: str, new: str, bare: bool = True) -> str:
    """A reference or a formula with another name. `bare`: Also where it is a word of a formula.

    >>> renamed("2*crank.A.x + rcrank", "crank", "arm"), renamed("2 m", "m", "n", bare=False)
    ('2*arm.A.x + rcrank', '2 m')
    """
    if text.strip() == old:
        return new
    end = r"(?!\w)" if bare else r"(?=\.[A-Za-z_])"
    return re.sub(rf"(?<![\w.]){re.escape(old)}{end}", lambda _: new, text)


def is_bare(path: Path, section: str, name: str) -> bool:
    """Whether a text at a path may have the name of an element of a section as a word."""
    return section in BARE or "." in name or path[0] in (*STUDIES, *TASKS, "states", "contacts")


def mentions(value: Any, path: Path, section: str, name: str) -> bool:
    """Whether a value refers to an element or, as "link.A", a point."""
    if isinstance(value, dict):
        if place_name(value) == name:
            return True
        parts = [(key, one) for key, one in value.items() if key not in (*SILENT, "point")]
        study = path[0] in (*STUDIES, *TASKS)
        return any(
            (study and renamed(str(key), name, "") != key)
            or mentions(one, (*path, key), section, name)
            for key, one in parts
        )
    if isinstance(value, list):
        return any(mentions(one, path, section, name) for one in value)
    bare = is_bare(path, section, name)
    return isinstance(value, str) and renamed(value, name, "", bare) != value


def referring(tree: Mapping[str, Any], section: str, name: str) -> Iterator[Path]:
    """Paths of the entries of a file that refer to an element or a point."""
    for table, entries in tree.items():
        if not isinstance(entries, dict):
            continue
        for key, value in entries.items():
            parts = {key: value} if table in TASKS else value
            own = (table, key) == (section, name) or key in SILENT
            if not own and mentions(parts, (table,), section, name):
                yield table, key


def other_name(spans: Spans, path: Path, new: str) -> list[Splice]:
    """Splices that give an element, a point or a parameter another name wherever it stands."""
    point = path[-2] == "points"
    body = "ground" if path[0] == "ground" else path[1]
    section, old = ("points", f"{body}.{path[-1]}") if point else (path[0], path[-1])
    whole = f"{body}.{new}" if point else new
    splices = {(start, end, key_text(new)) for start, end in spans.keys.get(path, [])}
    for own, entry in spans.entries.items():
        value = value_at(spans.tree, own)
        if not isinstance(value, str) or own[0] in SILENT or own[-1] in SILENT:
            continue
        if own[-1] == "point":
            holder = value_at(spans.tree, own[:-1])
            changed = new if point and place_name(holder) == old else value
        else:
            changed = renamed(value, old, whole, is_bare(own, section, old))
        if changed != value:
            splices.add((entry.start, entry.end, toml_value(changed)))
    for own, places in spans.keys.items():
        if own[0] in (*STUDIES, *TASKS) and own != path and len(own) > 1:
            key = renamed(str(own[-1]), old, whole)
            if key != own[-1]:
                splices |= {(start, end, key_text(key)) for start, end in places}
    return sorted(splices)


def without(text: str, names: list[tuple[str, str]]) -> str:
    r"""The text without elements and points, and without what cannot be without them.

    >>> without("[bodies]\na = {}\n[loads]\nT = { torque = 1, body = 'a' }\n", [("bodies", "a")])
    '[bodies]\n[loads]\n'
    """
    tree, waiting, gone = Spans(text).tree, list(names), dict[Path, None]()
    pivots: set[str] = set()
    while waiting:
        section, name = waiting.pop(0)
        path: Path = (section, name)
        if section == "points":
            path = point_path(name)
        if value_at(tree, path) is None:
            raise EditError(f"there is no '{name}' among the {section} of the file", name)
        gone[path] = None
        if section == "joints":
            pivots |= {one for one in _places(value_at(tree, path)) if one.startswith("ground.")}
        for own in referring(tree, section, name):
            if own[0] not in (*ELEMENTS, *STUDIES, *TASKS):
                raise EditError(
                    f"'{'.'.join(own)}' is made of '{name}': change it first", name, path
                )
            if own not in gone and tuple(own) not in waiting:
                waiting.append((own[0], own[1]))
    for path in gone:
        spans = Spans(text)
        text = spans.without(path) if value_at(spans.tree, path) is not None else text
    left = Spans(text).tree
    for pivot in sorted(pivots) if any(path[0] == "bodies" for path in gone) else ():
        own = point_path(pivot)
        if value_at(left, own) is not None and not any(referring(left, "points", pivot)):
            text = Spans(text).without(own)
    for task in TASKS:
        if Spans(text).tree.get(task) == {}:
            text = Spans(text).without((task,))
    return text


def _places(table: Any) -> Iterator[str]:
    for value in table.values() if isinstance(table, dict) else ():
        for one in value if isinstance(value, list) else [value]:
            if name := place_name(one):
                yield name
