"""Edits of a drawing: each changes the text of a model file in place, or says why it cannot."""

from __future__ import annotations

import contextlib
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from mbody.core.other_words import KINDS
from mbody.edit.places import (
    Dragging,
    DrawingState,
    EditError,
    Pair,
    evaluate,
    fixed,
    group_of,
    handles,
    is_number,
    pin_groups,
    place_name,
    plain,
    point_path,
)
from mbody.errors import ModelError, SolveError
from mbody.files.model.other_units import in_units
from mbody.files.model.problems import SECTIONS, TEXT_ATTRIBUTE, kind_in, written_fields
from mbody.files.model.toml_text import key_text, toml_value
from mbody.files.model.write import as_it_was, to_toml, unit_of_text
from mbody.files.toml_spans import Path, Spans, Splice, spliced, value_at
from mbody.model.numbers import dimension_named, number_in
from mbody.quantities.units import DIMENSIONS

# -- What of a model file refers to an element or a point: other names for them, and deletion --

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


Names = Sequence[Sequence[str]]
#: Letters of points, without those that are taken for digits.
LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ"
#: Digits behind those of the length of a mechanism, where no grain is given.
DIGITS = 9
#: Loads whose mirror images are theirs.
SYMMETRIC = ("spring", "damper")
#: Rounds in which parameters bring a point to a place.
ROUNDS = 12
#: Sections of elements that edits add, and how these are called.
ADDED = {
    "joint": ("joints", "J"),
    "load": ("loads", ""),
    "driver": ("drivers", "motor"),
    "contact": ("contacts", ""),
    "coupling": ("couplings", "coupling"),
}


class Editor:
    """The text of a model file while one edit changes it, and what it gives so far.

    `remark`: What came otherwise than it was asked for.
    """

    def __init__(
        self,
        text: str,
        state: DrawingState,
        name: str,
        folder: FilePath | None,
        spans: Spans | None = None,
    ) -> None:
        self.text = self.start = text
        self.state, self.name, self.folder = state, name, folder
        self.grain: Any = None
        self.remark = ""
        self._spans = spans

    @property
    def spans(self) -> Spans:
        """Where everything of the present text stands."""
        if self._spans is None or self._spans.text is not self.text:
            self._spans = Spans(self.text)
        return self._spans

    @property
    def tree(self) -> dict[str, Any]:
        """The tables of the present text."""
        return self.spans.tree

    def do(self, edit: Mapping[str, Any]) -> None:
        """Change the text by one edit: its name under "do", its arguments by theirs."""
        rest = {key: value for key, value in edit.items() if key not in ("do", "what", "grain")}
        word = str(edit.get("do"))
        self.grain = edit.get("grain")
        if word in ADDED:
            return self._element(*ADDED[word], **rest)
        act = getattr(self, f"do_{word}", None)
        if act is None:
            raise EditError(f"there is no edit '{word}'")
        act(**rest)

    def do_all(self, steps: Sequence[Mapping[str, Any]]) -> None:
        """Several edits as one."""
        for n, step in enumerate(steps):
            if n:
                self._look()
            self.do(step)

    def _say(self, remark: str) -> None:
        self.remark += f"; {remark}" if self.remark else remark

    # -- the text ----------------------------------------------------------------------------------

    def _look(self) -> None:
        self.state = evaluate(self.text, self.name, self.folder, whole=False)

    def _splice(self, *splices: Splice) -> None:
        self.text = spliced(self.text, list(splices))

    def _put(self, path: Path, value: Any, raw: str = "") -> None:
        """Set a key, new or not; `raw`: as it is to be written."""
        if path not in self.spans.entries:
            if isinstance(value_at(self.tree, path), dict):
                self.text = self.spans.without(path)
            self._splice(self.spans.inserted(path[:-1], path[-1], value))
        if path in self.spans.entries:
            self._splice(self.spans.replaced(path, raw or toml_value(value)))

    def do_text(self, text: str) -> None:
        """The whole file."""
        self.text = str(text)

    def do_set(self, path: Sequence[Any], text: Any) -> None:
        """An entry of the file as it is typed: a number, one with its unit, a formula, a word."""
        own, typed = self._path(path), str(text).strip()
        if not typed:
            raise EditError(
                f"'{_dotted(own)}' is empty: give a value, or remove the entry", "", own
            )
        above = [value_at(self.tree, own[:n]) for n in range(1, len(own))]
        if not all(isinstance(one, (dict, list, type(None))) for one in above):
            raise EditError(f"'{_dotted(own[:-1])}' is no table for an entry", "", own)
        if len(own) < 2 and isinstance(value_at(self.tree, own), dict):
            raise EditError(f"'{own[-1]}' is a table of the file: set an entry of it", "", own)
        value, raw = (typed, "") if own[-1] in SILENT else _typed(typed)
        self._put(own, value, raw)

    def do_unset(self, path: Sequence[Any]) -> None:
        """Remove an entry of the file, so that its default counts."""
        own = self._path(path)
        if value_at(self.tree, own) is None:
            raise EditError(f"there is no '{_dotted(own)}' in the file", "", own)
        self.text = self.spans.without(own)

    def do_add(self, path: Sequence[Any], key: str, text: Any) -> None:
        """A further entry of a table, as it is typed, or an element with its fields."""
        table = isinstance(text, Mapping)
        like = next(iter(text), "") if table else ""
        own = (*self._path(path), str(key) or self._new(str(like)))
        if value_at(self.tree, own) is not None:
            raise EditError(f"'{_dotted(own)}' is in the file already", "", own)
        if table:
            return self._put(own, self._given(text))
        self.do_set(own, text)

    def _path(self, path: Sequence[Any]) -> Path:
        """A path of a request, numbers of entries as numbers."""
        own: list[Any] = []
        for key in path:
            holder = value_at(self.tree, tuple(own))
            own.append(int(key) if isinstance(holder, list) else str(key))
        if not own:
            raise EditError("the path of an entry is empty: name its table and key")
        return tuple(own)

    # -- names and numbers -------------------------------------------------------------------------

    def _names(self) -> set[str]:
        tables = ["parameters", "inputs", "curves", "bodies", "states", "quantities", "measures"]
        tables += SECTIONS
        used = {"ground", *(name for table in tables for name in self.tree.get(table, {}))}
        points = [self.tree.get("ground", {}), *self.tree.get("bodies", {}).values()]
        return used.union(*(one.get("points", {}) for one in points))

    def _new(self, *stems: str, first: int = 0, also: Iterable[str] = ()) -> str:
        """A name that nothing has: the first of some stems, or one of these with a number."""
        used = self._names().union(also)
        every = (f"{stem}{k or ''}" for k in range(first, 99999) for stem in stems)
        return next(name for name in every if name not in used)

    def _unused(self, name: str) -> str:
        """A name that was asked for."""
        if name and name in self._names():
            raise EditError(f"there is a '{name}' already: choose another name", name)
        return name

    @property
    def _exact(self) -> int:
        """Digits behind the point of lengths that are no finer than what closes."""
        size = float(self.state.system.length) if self.state.system else 1.0
        return DIGITS - math.floor(math.log10(size or 1.0))

    @property
    def _digits(self) -> int:
        """Digits behind the point of lengths: those of a tenth of a pixel."""
        whole = isinstance(self.grain, (int, float)) and 0.0 < self.grain < math.inf
        return max(0, math.ceil(-math.log10(self.grain) - 1e-9)) if whole else self._exact

    def _pair(self, values: Sequence[float], digits: int | None = None) -> list[float]:
        x, y = values
        if not (math.isfinite(x) and math.isfinite(y)):
            raise EditError("a place must have two finite numbers")
        return [plain(v, self._digits if digits is None else digits) for v in (x, y)]

    def _angle(self, degrees: float) -> float:
        """A direction as the file has plain angles."""
        radians = self.tree.get("angle") == "rad"
        return plain(math.radians(degrees), 9) if radians else plain(degrees, 6)

    def _body(self, name: str, what: str) -> dict[str, Any]:
        """The table of a moving link."""
        if name == "ground":
            raise EditError(f"the ground does not move: {what} a link", "ground")
        table = self.tree.get("bodies", {}).get(name)
        if table is None:
            raise EditError(f"there is no link '{name}'", name)
        return dict(table)

    def _group(self, place: str) -> list[str]:
        return group_of(pin_groups(self.tree), place)

    def _given(self, value: Any) -> Any:
        """Values of an element as the file has them: {"on": place} is a place, {"xy": [x, y]} a new
        point of the ground or of its "body"; typed text is a number where it is one.
        """
        if isinstance(value, dict) and "on" in value:
            return str(value["on"])
        if isinstance(value, dict) and "xy" in value:
            return self._point(str(value.get("body", "ground")), value["xy"])
        if isinstance(value, dict):
            return {str(key): self._given(one) for key, one in value.items()}
        if isinstance(value, (list, tuple)):
            return [self._given(one) for one in value]
        return _typed(value.strip())[0] if isinstance(value, str) and value.strip() else value

    def _point(
        self, body: str, xy: Sequence[float], name: str = "", digits: int | None = None
    ) -> str:
        """A new point at a place of the world."""
        place = f"{body}.{name or self._new(*LETTERS)}"
        self._put(point_path(place), self._pair(self.state.in_link(body, xy), digits))
        return place

    # -- points and links --------------------------------------------------------------------------

    def do_point(self, body: str, xy: Sequence[float], name: str = "") -> None:
        """A point of a link, or a pivot of the ground."""
        if body != "ground":
            self._body(body, "choose")
        path = point_path(f"{body}.{name}")
        if value_at(self.tree, path) is not None:
            raise EditError(f"'{body}' has a point '{name}' already", body, path)
        self._point(body, xy, name)

    def do_link(self, at: Sequence[Mapping[str, Any]], name: str = "") -> None:
        """A link through places, each new, {"xy": [x, y]}, or pinned to one, {"on": "crank.A"}; or
        at a length and an angle from the one before as they are typed, {"polar": ["3 cm", "60"]}.
        """
        body, points, pins = self._unused(name), dict[str, list[float]](), []
        body = body or self._new("link", first=1)
        for one in at:
            on, typed = str(one.get("on", "")), one.get("polar") if points else None
            letter = on.partition(".")[2]
            if on:
                self._group(on)
            if letter in ("", *points):
                letter = self._new(*LETTERS, also=points)
            if typed:
                xy = np.add([*points.values()][-1], self._polar(*map(str, typed)))
            else:
                xy = self.state.place(on) if on else one["xy"]
            points[letter] = self._pair(xy, self._exact if on or typed else None)
            pins += [(on, f"{body}.{letter}")] if on else []
        if len({tuple(xy) for xy in points.values()}) < max(len(points), 2):
            raise EditError(
                "a link needs points at two places or more: draw it from one place to another"
            )
        self._splice(self.spans.section(("bodies", body), {"points": points}))
        for on, own in pins:
            self._pin(on, own)

    def _polar(self, length: str, angle: str) -> Any:
        """A length and an angle as they are typed, plain angles as the file has them."""
        values = {"length": _typed(length)[0], "angle": _typed(angle)[0]}
        if isinstance(values["angle"], (int, float)) and self.tree.get("angle") != "rad":
            values["angle"] = math.radians(values["angle"])
        machine = self.state.mechanism
        long, way = (number_in(machine, one, kind, "link", kind) for kind, one in values.items())
        return np.multiply(long, (math.cos(way), math.sin(way)))

    def _pin(self, on: str, own: str) -> None:
        """A pin of the name of its point."""
        point = own.partition(".")[2]
        used = {name for table in ("bodies", *SECTIONS) for name in self.tree.get(table, {})}
        every = (point, *(f"{point}_{n}" for n in range(2, 9999)))
        name = next(one for one in every if one not in used)
        self._put(("joints", name), {"revolute": [on, own]})

    def do_join(self, place: str, to: str) -> None:
        """Bring a point onto another and pin it there."""
        group, other = self._group(place), self._group(to)
        if group == other:
            raise EditError(f"'{place}' and '{to}' are pinned to each other already", place)
        both = {p.partition(".")[0] for p in group} & {p.partition(".")[0] for p in other}
        if both and both != {"ground"}:
            raise EditError(f"'{place}' and '{to}' are of '{min(both)}': join two links", place)
        goal = self.state.place(to)
        if max(abs(np.subtract(self.state.place(place), goal))) > 0.5 * 10.0**-self._exact:
            self.grain = None
            self.do_move(place, goal)
        if place.startswith("ground."):
            place, to = to, place
        self._pin(to, place)

    def do_ground(self, place: str) -> None:
        """Pin a point to the ground."""
        if any(one.startswith("ground.") for one in self._group(place)):
            raise EditError(f"'{place}' is pinned to the ground already", place)
        self._pin(self._pivot(place), place)

    def _pivot(self, place: str) -> str:
        """A new point of the ground where a point is."""
        point, used = place.partition(".")[2], self.tree.get("ground", {}).get("points", {})
        name = "" if point in used else point
        return self._point("ground", self.state.place(place), name, self._exact)

    def do_unground(self, place: str) -> None:
        """Take a point off the ground."""
        pivots = [one for one in self._group(place) if one.startswith("ground.")]
        if not pivots:
            raise EditError(f"'{place}' is not pinned to the ground", place)
        self.text = without(self.text, [("points", one) for one in pivots])

    def do_delete(self, names: Sequence[Sequence[str]]) -> None:
        """Without elements and points, and without what refers to them."""
        self.text = without(self.text, [(str(section), str(name)) for section, name in names])

    def do_rename(self, path: Sequence[Any], to: str) -> None:
        """Another name, in every reference and formula."""
        own = self._path(path)
        own = point_path(str(own[1])) if own[0] == "points" else own
        if not re.fullmatch(r"[^\W\d]\w*", to):
            raise EditError(f"'{to}' is no name: use letters, digits and _")
        used = value_at(self.tree, own[:-1]) if own[-2:-1] == ("points",) else self._names()
        if to in (used or {}):
            raise EditError(f"there is a '{to}' already: names are unique", to)
        if len(own) < 2 or value_at(self.tree, own) is None:
            raise EditError(f"there is no '{_dotted(own)}' in the file", "", own)
        self._splice(*other_name(self.spans, own, to))

    # -- moving ------------------------------------------------------------------------------------

    def do_move(self, place: str, xy: Sequence[float], along: bool = False) -> None:
        """Move a point with all that is pinned there to a place of the world; what is given by
        formulas moves by their parameters.
        """
        group = self._group(place)
        goal = self.state.along(place, xy) if along else (float(xy[0]), float(xy[1]))
        self._pair(goal)
        if reason := fixed(self.state, self.tree, group):
            raise EditError(reason, place, point_path(place))
        names = handles(self.state, self.tree, group)
        if names:
            self._by_parameters(group, place, goal, names)
        else:
            for one in group:
                self._write_point(one, goal)
        self._settle(place, goal, bool(names))

    def _write_point(self, place: str, goal: Pair) -> None:
        """The coordinates of a point in the form in which they are written."""
        body, _, point = place.partition(".")
        if not point:
            return  # an origin goes where its joints bring it
        path, step = point_path(place), 10.0**-self._digits
        old, new = np.array(self.state.own(place)), np.array(self.state.in_link(body, goal))
        if isinstance(value_at(self.tree, path), dict):
            radius, before = float(np.linalg.norm(new)), math.atan2(old[1], old[0])
            angle = before + math.remainder(math.atan2(new[1], new[0]) - before, math.tau)
            self._write_number((*path, "r"), float(np.linalg.norm(old)), radius, step)
            self._write_number((*path, "angle"), before, angle, step / max(radius, step), True)
            return
        for n in (0, 1):
            self._write_number((*path, n), float(old[n]), float(new[n]), step)

    def _write_number(
        self, path: Path, old: float, new: float, step: float, angle: bool = False
    ) -> None:
        """A number of another value [rad of angles] in the unit in which it is written, in steps
        that are seen; one that does not change keeps its text.
        """
        if abs(new - old) <= 0.5 * step:
            return
        written = value_at(self.tree, path)
        unit = unit_of_text(written, self.state.mechanism.units)
        size = unit[1] if unit else 1.0
        if angle and (unit or self.tree.get("angle") != "rad"):
            size = math.radians(size)
        digits = math.ceil(-math.log10(step / size) - 1e-9)
        number = plain(new / size, digits)
        text = f"{number!r} {unit[0]}" if unit else repr(number) if isinstance(written, str) else ""
        self._splice(self.spans.replaced(path, toml_value(text or number)))

    def _by_parameters(self, group: list[str], place: str, goal: Pair, names: list[str]) -> None:
        """Parameters that bring a point nearest to a place."""
        system = self.state.system
        if system is None:
            raise EditError(f"'{place}' is given by {', '.join(names)}: change these", place)
        whole = self.state.mobility is not None
        drag = Dragging(self.state if whole else evaluate(self.text, self.name, self.folder))
        before = np.array(self.state.place(place))
        for _ in range(ROUNDS):
            drag.point(group, goal, names)
            at = np.array(drag.now.place(place))
            if drag.stopped or float(np.abs(at - before).max()) < 0.1 * 10.0**-self._digits:
                break
            before = at
        if drag.stopped and not drag.changed:
            raise EditError(f"'{place}': {drag.stopped}", place, point_path(place))
        moved = math.dist(drag.now.place(place), self.state.place(place))
        for name in names:
            old = float(system.values[name])
            new = float(drag.changed.get(name, old))
            angle = dimension_named(self.state.mechanism, name) == DIMENSIONS["angle"]
            step = 10.0**-self._digits * abs(new - old) / max(moved, 10.0**-self._digits)
            self._write_number(("parameters", name), old, new, step, angle)

    def _settle(self, place: str, goal: Pair, by_parameters: bool) -> None:
        """See where a point came; keep the assembly mode in which it was drawn."""
        before, text = self.state, self.text
        if before.system is None:
            return
        length = float(before.system.length)
        near = max(20.0 * 10.0**-self._digits, 1e-7 * length)
        self._look()
        if math.dist(self.state.place(place), goal) > near and not by_parameters:
            for body in self.tree["bodies"]:
                angle = round(math.degrees(before.pose(body)[2]), 3)
                self._put(("bodies", body, "guess"), self._angle(angle))
            with contextlib.suppress(ModelError, SolveError):
                self._look()
            if math.dist(self.state.place(place), goal) > near:
                self.text = text
                self._look()
        x, y = self.state.place(place)
        if math.dist((x, y), goal) > near:
            if self.text == self.start:
                raise EditError(
                    f"'{place}' cannot be moved there: its joints and parameters hold it", place
                )
            unit = self.state.mechanism.units.length
            self._say(
                f"'{place}' came to {x:.4g}, {y:.4g} {unit}, not to {goal[0]:.4g}, {goal[1]:.4g}: "
                "its joints and parameters let it no nearer"
            )

    # -- elements ----------------------------------------------------------------------------------

    def _add(
        self, section: str, table: Mapping[str, Any], name: str, like: str, first: int = 1
    ) -> None:
        """A new element of a section; `like`: What it is called, with a number, without a name."""
        self._put((section, self._unused(name) or self._new(like, first=first)), dict(table))

    def _element(
        self, section: str, like: str, kind: str, fields: Mapping[str, Any], name: str = ""
    ) -> None:
        """An element of any kind of a section, with the fields of the file."""
        table = {str(key): self._given(value) for key, value in fields.items()}
        if kind_in(section, {kind: None}) is None:
            kinds = ", ".join(SECTIONS[section])
            raise EditError(f"there is no kind of {section} '{kind}' (there are: {kinds})")
        main = table.pop("places") if "places" in table else table.pop(kind, None)
        if main is None:
            raise EditError(f"'{kind}' is missing: give the places or the number of that name")
        self._add(section, {kind: main, **table}, name, like or kind)

    def do_slider(
        self, place: str, angle: float = 0.0, body: str = "ground", name: str = ""
    ) -> None:
        """A point slides along a line of the ground or of a link: a pin in a slot."""
        if any(one.partition(".")[0] == body for one in self._group(place)):
            raise EditError(f"'{place}' is pinned to '{body}': free it before it slides", place)
        point: Any = ""
        if body == "ground":
            point = self._pivot(place).partition(".")[2]
        else:
            self._body(body, "choose")
            point = self._pair(self.state.in_link(body, self.state.place(place)), self._exact)
        direction = self._angle(angle - math.degrees(self.state.pose(body)[2]))
        line = {"body": body, "point": point, "angle": direction}
        self._add("joints", {"pin_slot": [line, place]}, name, "slot")

    do_slot = do_slider

    def do_motor(self, body: str = "", joint: str = "", rate: str = "", name: str = "") -> None:
        """A motor turns a link, or one link from another at a pin, or pushes a slide; from where it
        stands.
        """
        other = "ground"
        if joint:
            own = next((one for one in self.state.mechanism.joints if one.name == joint), None)
            if own is None:
                raise EditError(f"there is no joint '{joint}'", joint)
            if type(own).__name__ in ("Prismatic", "PinSlot"):
                table, value = self._slide(own)
                return self._drive(table, value, rate or "100 mm/s", name)
            ends = [own.i.body, own.j.body]
            other, body = reversed(ends) if ends[1] == "ground" else ends
        self._body(body, "put the motor on")
        table = {"angle": body, **({} if other == "ground" else {"relative_to": other})}
        value = self._angle(math.degrees(self.state.pose(body)[2] - self.state.pose(other)[2]))
        self._drive(table, value, rate or "60 rpm", name)

    def _drive(self, table: dict[str, Any], value: float, rate: str, name: str) -> None:
        law = {"constant_speed": {"value": value, "speed": rate}}
        self._add("drivers", table | {"law": law}, name, "motor", first=0)

    def _slide(self, joint: Any) -> tuple[dict[str, Any], float]:
        """The coordinate along a slide, and its value."""
        system, table = self.state.system, self.tree["joints"][joint.name]
        assert system is not None  # it has a joint
        places = table[kind_in("joints", table)]
        pairs = zip(places, (joint.i, joint.j), strict=True)
        i, j = (self.state.place(place_name(one) or str(marker.body)) for one, marker in pairs)
        angle = self.state.pose(joint.i.body)[2] + float(system.numbers.angle(joint, "i"))
        value = (j[0] - i[0]) * math.cos(angle) + (j[1] - i[1]) * math.sin(angle)
        return {"coordinate": places}, plain(value, self._exact)

    def do_force(self, place: str, force: Any, angle: float = 0.0, name: str = "") -> None:
        """A force at a point, in a direction of the world [deg]."""
        self._group(place)
        table = {"force": self._given(force), "at": place, "angle": self._angle(angle)}
        self._add("loads", table, name, "F")

    def do_torque(self, body: str, torque: Any, name: str = "") -> None:
        """A torque on a link."""
        self._body(body, "put the torque on")
        self._add("loads", {"torque": self._given(torque), "body": body}, name, "T")

    def do_mass(self, body: str, mass: Any) -> None:
        """A mass; its centre amid the points where the file says none."""
        table = self._body(body, "give the mass to")
        if "cg" not in table and table.get("points"):
            own = [self.state.own(f"{body}.{point}") for point in table["points"]]
            centre = [float(value) for value in np.mean(own, axis=0)]
            self._put(("bodies", body, "cg"), self._pair(centre))
        self._put(("bodies", body, "mass"), self._given(mass))

    # -- copies ------------------------------------------------------------------------------------

    def do_copy(self, names: Names, by: Sequence[float]) -> None:
        """Links elsewhere, with what is between them and the ground."""
        self._copied(names, np.eye(2), np.array(by, float))

    def do_mirror(self, names: Names, line: Sequence[Sequence[float]]) -> None:
        """Mirror images of links with their joints, springs and dampers."""
        first, second = np.array(line, float)
        if (first == second).all():
            raise EditError("a line to mirror in needs two places")
        angle = 2.0 * math.atan2(*(second - first)[::-1])
        c, s = math.cos(angle), math.sin(angle)
        matrix = np.array([[c, s], [s, -c]])
        self._copied(names, matrix, first - matrix @ first)

    def _copied(self, names: Names, matrix: Any, shift: Any) -> None:
        links = {str(name): self._body(str(name), "copy") for s, name in names if s == "bodies"}
        if not links or self.state.system is None:
            raise EditError("nothing to copy: choose links")
        tree, image = self.tree, PlaneImage(self, matrix, shift)
        grounds = [point_path(f"ground.{one}") for one in tree.get("ground", {}).get("points", {})]
        every = [(section, name) for section in SECTIONS for name in tree.get(section, {})]
        between = [path for path in every if image.goes(path, links)]
        text, new = self.text, dict[Path, str]()
        for path in (*(("bodies", name) for name in links), *grounds, *between):
            point = f"ground.{path[-1]}" if path in grounds else ""
            if point and not any(mentions(tree, one, "points", point) for one in between):
                continue
            stems, first = (LETTERS, 0) if point else (path[-1:], 2)
            new[path] = self._new(*stems, first=first, also=new.values())
            text = spliced(text, other_name(Spans(text), path, new[path]))
        renamed = Spans(text).tree  # which has the names of the copies wherever they stand
        for (*above, old), name in new.items():
            own = (*above, name)
            if above == ["bodies"]:
                self._splice(self.spans.section(own, image.link(old, links[old])))
            elif above[0] == "ground":
                self._put(own, self._pair(image.place(self.state.place(f"ground.{old}"))))
            else:
                self._put(own, image.element(value_at(renamed, own)))
        if image.left:
            self._say(f"not mirrored are {', '.join(image.left)}: add them")

    # -- the whole file ----------------------------------------------------------------------------

    def do_parameter(self, path: Sequence[Any], name: str) -> None:
        """Give a number of the file a name: it becomes a parameter."""
        own = self._path(path)
        written = value_at(self.tree, own)
        if not is_number(written, self.state):
            raise EditError(f"'{_dotted(own)}' is no number that could have a name", "", own)
        if not name.isidentifier() or name in self._names():
            raise EditError(f"'{name}' is no new name: begin with a letter, choose another", name)
        self._put(("parameters", name), written, self.spans.raw(own))
        self._put(own, name)

    def do_guess(self, body: str, angle: float | None = None) -> None:
        """The rough first angle of a link [deg]; by default where it stands."""
        self._body(body, "choose")
        angle = math.degrees(self.state.pose(body)[2]) if angle is None else angle
        self._put(("bodies", body, "guess"), self._angle(angle))

    def do_mode(self, index: int) -> None:
        """Another assembly mode, by its place in the list of them."""
        from mbody.analysis.assemblies.assembly_modes import assembly_modes

        if self.state.system is None or not self.tree.get("bodies"):
            raise EditError("there are no assembly modes yet: draw a mechanism with a motor")
        modes = assembly_modes(self.state.system).modes
        if not 0 <= index < len(modes):
            raise EditError(f"there is no assembly mode {index + 1}: there are {len(modes)}")
        for body, (x, y, angle) in modes[index].items():
            guess = [*self._pair((x, y), self._exact), self._angle(math.degrees(angle))]
            self._put(("bodies", body, "guess"), guess)

    def do_units(self, units: str, convert: bool = False) -> None:
        """Other units of plain numbers: these are converted, or kept as they are."""
        if not convert:
            self._put(("units",), units)
            return
        made = in_units(self.state.mechanism, units)
        vars(made)[TEXT_ATTRIBUTE] = self.text
        kept = as_it_was(made, self.folder)
        if kept is None:
            self._say("the file was written anew in the other units: comments are gone")
        self.text = kept or to_toml(made).replace("\n", self.spans.newline)


@dataclass
class PlaneImage:
    """Images of links and of what is between them, by a map of the plane: x → matrix x + shift.

    `left`: What has no mirror image here.
    """

    editor: Editor
    matrix: Any
    shift: Any
    left: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        #: −1 of mirror images: of angles, and of second coordinates in the axes of links.
        self.sign = round(np.linalg.det(self.matrix))
        #: What is added to angles of the world [deg].
        self.turn = math.degrees(math.atan2(self.matrix[1, 0], self.matrix[0, 0]))

    def place(self, xy: Sequence[float]) -> Any:
        """That of a place of the world."""
        return self.matrix @ xy + self.shift

    def goes(self, path: Path, links: Mapping[str, Any]) -> bool:
        """Whether an element is between these links and the ground alone, and goes with them."""
        tree = self.editor.tree
        bodies = {body for body in tree["bodies"] if mentions(tree, path, "bodies", body)}
        if not bodies or not bodies <= links.keys():
            return False
        kind = kind_in(path[0], value_at(tree, path))
        goes = self.sign > 0 or path[0] == "joints" or kind in SYMMETRIC
        self.left += [] if goes else [path[1]]
        return goes

    def link(self, name: str, table: Mapping[str, Any]) -> dict[str, Any]:
        """That of a link; of a mirror image in mirrored axes."""
        state, own = self.editor.state, dict(table)
        assert state.system is not None  # there are links
        if self.sign < 0 and own.pop("shapes", None):
            self.left.append(f"the shapes of {name}")
        if "cg" in own:
            own["cg"] = self._in_link(own["cg"])
        own["points"] = {key: self._in_link(one) for key, one in own.get("points", {}).items()}
        x, y, angle = state.system.numbers.link_axes(name, *state.pose(name))
        direction = self.editor._angle(self.turn + self.sign * math.degrees(angle))
        return own | {"guess": [*self.editor._pair(self.place((x, y))), direction]}

    def element(self, value: Any) -> Any:
        """That of an element, or of a part of one: of places and directions that have numbers."""
        if isinstance(value, list):
            return [self.element({"body": one} if one == "ground" else one) for one in value]
        if not isinstance(value, dict):
            return value
        own = {key: self.element(one) for key, one in value.items()}
        if "body" not in value:
            return own
        ground, point = value["body"] == "ground", value.get("point")
        if ground and not isinstance(point, str):
            numbers = [0.0, 0.0] if point is None else point
            if not all(isinstance(one, (int, float)) for one in [*numbers]):
                raise EditError(f"the place {point!r} of the ground has a formula: name it a point")
            own["point"] = self.editor._pair(self.place(numbers))
        elif isinstance(point, (list, dict)):
            own["point"] = self._in_link(point)
        turn = self.turn if ground else 0.0
        if "angle" in value or turn:
            own["angle"] = self._number(value.get("angle", 0.0), turn)
        return own

    def _number(self, value: Any, turn: float = 0.0) -> Any:
        """That of an angle or a second coordinate, which is a number or a formula."""
        if self.sign > 0:
            return value
        if isinstance(value, str):
            return f"{turn!r} deg - ({value})" if turn else f"-({value})"
        return plain(self.editor._angle(turn) - value, 9)

    def _in_link(self, point: Any) -> Any:
        """That of a point in the axes of its link."""
        if isinstance(point, dict):
            return {**point, "angle": self._number(point["angle"])}
        return [point[0], self._number(point[1])]


def _dotted(path: Path) -> str:
    return ".".join(map(str, path))


def _typed(text: str) -> tuple[Any, str]:
    """The value of a typed text, and how it is written in TOML; "" of one that is text."""
    try:
        value = tomllib.loads(f"x = {text}")
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return text, ""
    if len(value) != 1 or not isinstance(value["x"], (bool, int, float, list, dict)):
        return text, ""
    return value["x"], text if "\n" not in text and "#" not in text else ""
