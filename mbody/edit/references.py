"""What of a model file refers to an element or a point: other names for them, and deletion."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from mbody.core.other_words import KINDS
from mbody.edit.places import EditError, place_name, point_path
from mbody.files.model.problems import SECTIONS, kind_in, written_fields
from mbody.files.model.toml_text import key_text, toml_value
from mbody.files.toml_spans import Path, Spans, Splice, value_at

#: Tables of elements, whose entries go with what they refer to.
ELEMENTS = (*SECTIONS, "states", "inputs", "quantities")
#: Tables of studies by name, and those of one study.
STUDIES, TASKS = ("measures", "solve", "optimize"), ("ask", "simulate", "fit", "report")
#: Tables whose names are words of formulas; the others have a dot and a quantity behind them.
WORDS = ("parameters", "inputs", "states", "quantities", "curves")
#: Keys whose text names no element.
SILENT = ("name", "source", "note", "title", "unit", "units", "file", "column", "$schema")


def is_reference(tree: Mapping[str, Any], path: Path) -> bool:
    """Whether the text at a path of a file is the name of a body or a place, and no formula."""
    kinds = SECTIONS.get(path[0])
    word = kind_in(path[0], value_at(tree, path[:2])) if kinds is not None else None
    if kinds is None or word is None or len(path) < 3:
        return False
    cls: Any = kinds[KINDS.get(word, word)]
    name, rest = path[2], path[3:]
    if name == word:
        several = len(cls.main) > 1 and rest and isinstance(rest[0], int)
        name = cls.main[min(rest[0], len(cls.main) - 1) if several else 0]
        rest = rest[1:] if several else rest
    own: Any = {one.name: one.metadata for one in written_fields(cls)}.get(name, {})
    if "terms" in own:
        return "factor" not in rest
    if own.keys() & {"dimension", "law", "limits"}:
        return False
    return "place" not in own or not rest or rest[-1] == "body"


def mention(tree: Mapping[str, Any], path: Path, section: str, name: str) -> re.Pattern[str]:
    """What mentions an element of a section, or as "link.A" a point, in the text at a path."""
    study, reference = path[0] in (*STUDIES, *TASKS), is_reference(tree, path)
    tables = (*WORDS, "measures", "bodies", *SECTIONS)
    alone = not any(name in tree.get(one, {}) for one in tables if one != section)
    end = r"(?=\.[^\W\d])"
    if section in WORDS:
        end = r"(?!)" if reference else r"(?!\w|\.[^\W\d])"
    elif section == "measures":
        end = r"(?!\w)" if study and path[0] != section and alone else r"(?!)"
    elif section == "points" or reference or ((study or path[0] in ELEMENTS[-4:]) and alone):
        end = r"(?!\w)"
    return re.compile(rf"(?<![\w.]){re.escape(name)}{end}")


def is_point(value: Any, section: str, name: str) -> bool:
    """Whether a table is the place of a named point."""
    return section == "points" and isinstance(value, dict) and place_name(value) == name


def mentions(tree: Mapping[str, Any], path: Path, section: str, name: str) -> bool:
    """Whether what is at a path refers to an element or a point."""
    value = value_at(tree, path)
    if isinstance(value, str):
        silent = path[-1] in (*SILENT, "point")
        return not silent and bool(mention(tree, path, section, name).search(value))
    if not isinstance(value, (dict, list)):
        return False
    study = isinstance(value, dict) and path[0] in (*STUDIES, *TASKS)
    if is_point(value, section, name) or (
        study and any(mention(tree, path, section, name).match(str(key)) for key in value)
    ):
        return True
    keys = value if isinstance(value, dict) else range(len(value))
    return any(mentions(tree, (*path, key), section, name) for key in keys)


def referring(tree: Mapping[str, Any], section: str, name: str) -> Iterator[Path]:
    """Paths of the entries of a file that refer to an element or a point."""
    for table, entries in tree.items():
        for key in entries if isinstance(entries, dict) else ():
            own = (table, key)
            task = table in TASKS and mention(tree, own, section, name).match(key)
            if own != (section, name) and (task or mentions(tree, own, section, name)):
                yield own


def other_name(spans: Spans, path: Path, new: str) -> list[Splice]:
    """Splices that give an element, a point or a parameter another name wherever it stands."""
    point, tree = path[-2] == "points", spans.tree
    body = "ground" if path[0] == "ground" else path[1]
    section, old = ("points", f"{body}.{path[-1]}") if point else (path[0], path[-1])
    whole = f"{body}.{new}" if point else new
    splices = {(start, end, key_text(new)) for start, end in spans.keys.get(path, [])}
    for own, entry in spans.entries.items():
        value = value_at(tree, own)
        if not isinstance(value, str) or own[0] in SILENT or own[-1] in SILENT:
            continue
        changed = new if is_point(value_at(tree, own[:-1]), section, old) else value
        if own[-1] != "point":
            changed = mention(tree, own, section, old).sub(lambda _: whole, value)
        if changed != value:
            splices.add((entry.start, entry.end, toml_value(changed)))
    for own, places in spans.keys.items():
        if own[0] in (*STUDIES, *TASKS) and own != path and len(own) > 1:
            key = mention(tree, own, section, old).sub(lambda _: whole, str(own[-1]), 1)
            if key != own[-1] and (len(own) > 2 or own[0] in TASKS):
                splices |= {(start, end, key_text(key)) for start, end in places}
    return sorted(splices)


def without(text: str, names: list[tuple[str, str]]) -> str:
    r"""The text without elements and points, and without what cannot be without them.

    >>> without("[bodies]\na = {}\n[loads]\nT = { torque = 1, body = 'a' }\n", [("bodies", "a")])
    '[bodies]\n[loads]\n'
    """
    tree, waiting, gone = Spans(text).tree, list(names), dict[Path, None]()
    while waiting:
        section, name = waiting.pop(0)
        path = point_path(name) if section == "points" else (section, name)
        if value_at(tree, path) is None:
            raise EditError(f"there is no '{name}' among the {section} of the file", name)
        gone[path] = None
        for own in referring(tree, section, name):
            if own[0] not in (*ELEMENTS, *STUDIES, *TASKS):
                raise EditError(
                    f"'{'.'.join(own)}' is made of '{name}': change it first", name, path
                )
            if own not in gone and tuple(own) not in waiting:
                waiting.append((own[0], own[1]))
    text = _without(text, gone)
    if any(path[0] == "bodies" for path in gone):  # its pivots go with a link, unless they are used
        left, joints = Spans(text).tree, [path for path in gone if path[0] == "joints"]
        pivots = (f"ground.{point}" for point in tree.get("ground", {}).get("points", {}))
        gone_too = [
            point_path(one)
            for one in pivots
            if any(mentions(tree, joint, "points", one) for joint in joints)
            and not any(referring(left, "points", one))
        ]
        text = _without(text, gone_too)
    return _without(text, [(task,) for task in TASKS if Spans(text).tree.get(task) == {}])


def _without(text: str, paths: Iterable[Path]) -> str:
    for path in paths:
        spans = Spans(text)
        text = spans.without(path) if value_at(spans.tree, path) is not None else text
    return text
