"""Edits of a drawing: each changes the text of a model file in place, or says why it cannot."""

from __future__ import annotations

import contextlib
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from mbody.edit.dragging import Dragging
from mbody.edit.places import (
    DrawingState,
    EditError,
    Pair,
    evaluate,
    fixed,
    handles,
    is_number,
    pin_groups,
    place_name,
    plain,
    point_path,
)
from mbody.edit.references import SILENT, other_name, without
from mbody.errors import ModelError, SolveError
from mbody.files.model.kept_text import unit_of_text
from mbody.files.model.other_units import in_units
from mbody.files.model.problems import SECTIONS, TEXT_ATTRIBUTE, kind_in
from mbody.files.model.toml_text import toml_value
from mbody.files.model.write import as_it_was, to_toml
from mbody.files.toml_spans import Path, Spans, Splice, spliced, value_at
from mbody.model.numbers import dimension_named, number_in
from mbody.quantities.units import DIMENSIONS

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

    def __init__(self, text: str, state: DrawingState, name: str, folder: FilePath | None) -> None:
        self.text = self.start = text
        self.state, self.name, self.folder = state, name, folder
        self.grain: Any = None
        self.remark = ""
        self._spans: Spans | None = None

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
        if any(not isinstance(one, (dict, list)) for one in above if one is not None):
            raise EditError(f"'{_dotted(own[:-1])}' is no table for an entry", "", own)
        if len(own) < 2 and isinstance(value_at(self.tree, own), dict):
            raise EditError(f"'{own[-1]}' is a table of the file: set an entry of it", "", own)
        value, raw = typed, ""
        if own[-1] not in SILENT:
            value, raw = _typed(typed)
        self._put(own, value, raw)

    def do_unset(self, path: Sequence[Any]) -> None:
        """Remove an entry of the file, so that its default counts."""
        own = self._path(path)
        if value_at(self.tree, own) is None:
            raise EditError(f"there is no '{_dotted(own)}' in the file", "", own)
        self.text = self.spans.without(own)

    def do_add(self, path: Sequence[Any], key: str, text: Any) -> None:
        """A further entry of a table."""
        own = (*self._path(path), str(key))
        if value_at(self.tree, own) is not None:
            raise EditError(f"'{_dotted(own)}' is in the file already", "", own)
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
        tables = ("parameters", "inputs", "curves", "bodies", "states", "measures", *SECTIONS)
        used = {"ground", *(name for table in tables for name in self.tree.get(table, {}))}
        points = [self.tree.get("ground", {}), *self.tree.get("bodies", {}).values()]
        return used.union(*(one.get("points", {}) for one in points))

    def _letter(self, more: Mapping[str, Any] | None = None) -> str:
        """A letter for a point, with a number where all are in use."""
        used = self._names().union(more or {})
        every = (f"{sign}{k or ''}" for k in (0, *range(2, 9999)) for sign in LETTERS)
        return next(name for name in every if name not in used)

    def _new(self, kind: str, first: int = 1) -> str:
        used = self._names()
        return next(n for k in range(first, 99999) if (n := f"{kind}{k or ''}") not in used)

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
        """The point of the drawing that a place is of."""
        for group in pin_groups(self.tree):
            if place in group:
                return group
        raise EditError(f"there is no point '{place}'", str(place))

    def _given(self, value: Any) -> Any:
        """Values of an element as the file has them: {"on": place} is a place, {"xy": [x, y]} a new
        point of the ground or of its "body"; typed text is a number where it is one.
        """
        if isinstance(value, dict) and "on" in value:
            return str(value["on"])
        if isinstance(value, dict) and "xy" in value:
            body, name = str(value.get("body", "ground")), self._letter()
            self.do_point(body, value["xy"], name)
            return f"{body}.{name}"
        if isinstance(value, dict):
            return {str(key): self._given(one) for key, one in value.items()}
        if isinstance(value, (list, tuple)):
            return [self._given(one) for one in value]
        return _typed(value.strip())[0] if isinstance(value, str) and value.strip() else value

    # -- points and links --------------------------------------------------------------------------

    def do_point(self, body: str, xy: Sequence[float], name: str = "") -> None:
        """A point of a link, or a pivot of the ground."""
        if body != "ground":
            self._body(body, "choose")
        name = name or self._letter()
        path = point_path(f"{body}.{name}")
        if value_at(self.tree, path) is not None:
            raise EditError(f"'{body}' has a point '{name}' already", body, path)
        self._put(path, self._pair(self.state.in_link(body, xy)))

    def do_link(self, at: Sequence[Mapping[str, Any]], name: str = "") -> None:
        """A link through places, each new, {"xy": [x, y]}, or pinned to one, {"on": "crank.A"}; or
        at a length and an angle from the one before as they are typed, {"polar": ["3 cm", "60"]}.
        """
        if name and name in self._names():
            raise EditError(f"there is a '{name}' already: choose another name", name)
        body, points, pins = name or self._new("link"), dict[str, list[float]](), []
        for one in at:
            on = str(one.get("on", ""))
            letter = on.partition(".")[2]
            if on:
                self._group(on)
            if not letter or letter in points:
                letter = self._letter(points)
            digits = self._exact if on else None
            if "polar" in one and points:
                away = self._polar(*map(str, one["polar"]))
                points[letter] = self._pair(np.add([*points.values()][-1], away), self._exact)
            else:
                points[letter] = self._pair(self.state.place(on) if on else one["xy"], digits)
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
        point, joints = own.partition(".")[2], self.tree.get("joints", {})
        elements = {name for table in ("bodies", *SECTIONS) for name in self.tree.get(table, {})}
        every = [point, *(f"{point}_{n}" for n in range(2, 9999))]
        name = next(one for one in every if one not in joints and one not in elements)
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
        name = point if point not in used else self._letter()
        self._put(("ground", "points", name), self._pair(self.state.place(place), self._exact))
        return f"ground.{name}"

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
        if own[0] == "points":
            own = point_path(str(own[1]))
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
        goal = self._along(place, xy) if along else (float(xy[0]), float(xy[1]))
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

    def _along(self, place: str, xy: Sequence[float]) -> Pair:
        """The nearest place on the line through a point and another of its link."""
        body, at = place.partition(".")[0], np.array(self.state.place(place))
        others = [f"{body}.{one}" for one in self._body(body, "choose").get("points", {})]
        arms = [at - self.state.place(one) for one in others]
        arms = [arm for arm in arms if arm.any()]
        if not arms:
            raise EditError(f"'{body}' has no other point to keep a direction from", body)
        arm = arms[0] / np.linalg.norm(arms[0])
        x, y = at + arm * float(np.dot(np.subtract(xy, at), arm))
        return float(x), float(y)

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
        system, run, mobility = self.state.system, self.state.run, self.state.mobility
        if system is None or run is None:
            raise EditError(f"'{place}' is given by {', '.join(names)}: change these", place)
        mobility = mobility or evaluate(self.text, self.name, self.folder).mobility
        assert mobility is not None  # of what has bodies
        drag, before = Dragging(system, run, mobility), np.array(self.state.place(place))
        for _ in range(ROUNDS):
            drag.point(group, goal, names)
            at = np.array(drag.place(place), float)
            if drag.stopped or float(np.abs(at - before).max()) < 0.1 * 10.0**-self._digits:
                break
            before = at
        if drag.stopped and not drag.changed:
            raise EditError(f"'{place}': {drag.stopped}", place, point_path(place))
        moved = math.dist(drag.place(place), self.state.place(place))
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
                raise EditError(f"'{place}' cannot be moved there: its joints hold it", place)
            unit = self.state.mechanism.units.length
            self.remark = (
                f"'{place}' came to {x:.4g}, {y:.4g} {unit}, not to {goal[0]:.4g}, {goal[1]:.4g}: "
                "its joints and parameters let it no nearer"
            )

    # -- elements ----------------------------------------------------------------------------------

    def _add(self, section: str, table: Mapping[str, Any], name: str, like: str = "") -> None:
        """A new element of a section."""
        name = name or like
        if name in self._names():
            raise EditError(f"there is a '{name}' already: choose another name", name)
        self._put((section, name), dict(table))

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
        self._add(section, {kind: main, **table}, name, self._new(like or kind))

    def do_slider(
        self, place: str, angle: float = 0.0, body: str = "ground", name: str = ""
    ) -> None:
        """A point slides along a line of the ground or of a link: a pin in a slot."""
        group = self._group(place)
        if any(one.partition(".")[0] == body for one in group):
            raise EditError(f"'{place}' is pinned to '{body}': free it before it slides", place)
        if body == "ground":
            line: dict[str, Any] = {"body": body, "point": self._pivot(place).partition(".")[2]}
        else:
            self._body(body, "choose")
            xy = self.state.in_link(body, self.state.place(place))
            line = {"body": body, "point": self._pair(xy, self._exact)}
        line["angle"] = self._angle(angle - math.degrees(self.state.pose(body)[2]))
        self._add("joints", {"pin_slot": [line, place]}, name, self._new("slot"))

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
                return self._pusher(own, rate, name)
            ends = [own.i.body, own.j.body]
            other, body = reversed(ends) if ends[1] == "ground" else ends
        self._body(body, "put the motor on")
        value = math.degrees(self.state.pose(body)[2] - self.state.pose(other)[2])
        law = {"constant_speed": {"value": self._angle(value), "speed": rate or "60 rpm"}}
        relative = {} if other == "ground" else {"relative_to": other}
        self._add("drivers", {"angle": body, **relative, "law": law}, name, self._new("motor", 0))

    def _pusher(self, joint: Any, rate: str, name: str) -> None:
        """A cylinder along a slide."""
        system, table = self.state.system, self.tree["joints"][joint.name]
        assert system is not None  # it has a joint
        places = table[kind_in("joints", table)]
        pairs = zip(places, (joint.i, joint.j), strict=True)
        i, j = (self.state.place(place_name(one) or str(marker.body)) for one, marker in pairs)
        angle = self.state.pose(joint.i.body)[2] + float(system.numbers.angle(joint, "i"))
        value = plain(
            (j[0] - i[0]) * math.cos(angle) + (j[1] - i[1]) * math.sin(angle), self._exact
        )
        law = {"constant_speed": {"value": value, "speed": rate or "100 mm/s"}}
        self._add("drivers", {"coordinate": places, "law": law}, name, self._new("motor", 0))

    def do_force(self, place: str, force: Any, angle: float = 0.0, name: str = "") -> None:
        """A force at a point, in a direction of the world [deg]."""
        self._group(place)
        table = {"force": self._given(force), "at": place, "angle": self._angle(angle)}
        self._add("loads", table, name, self._new("F"))

    def do_torque(self, body: str, torque: Any, name: str = "") -> None:
        """A torque on a link."""
        self._body(body, "put the torque on")
        self._add("loads", {"torque": self._given(torque), "body": body}, name, self._new("T"))

    def do_mass(self, body: str, mass: Any) -> None:
        """A mass; its centre amid the points where the file says none."""
        table = self._body(body, "give the mass to")
        if "cg" not in table and table.get("points"):
            own = [self.state.own(f"{body}.{point}") for point in table["points"]]
            centre = [float(value) for value in np.mean(own, axis=0)]
            self._put(("bodies", body, "cg"), self._pair(centre))
        self._put(("bodies", body, "mass"), self._given(mass))

    # -- copies ------------------------------------------------------------------------------------

    def do_copy(self, names: Sequence[Sequence[str]], by: Sequence[float]) -> None:
        """Links with the joints, loads and drivers that are theirs, elsewhere."""
        dx, dy = by
        self._copied(names, lambda x, y: (x + dx, y + dy), None)

    def do_mirror(self, names: Sequence[Sequence[str]], line: Sequence[Sequence[float]]) -> None:
        """Mirror images of links with their joints, springs and dampers."""
        (ax, ay), (bx, by) = line
        angle = 2.0 * math.atan2(by - ay, bx - ax)
        c, s = math.cos(angle), math.sin(angle)
        if (ax, ay) == (bx, by):
            raise EditError("a line to mirror in needs two places")
        self._copied(
            names,
            lambda x, y: (ax + c * (x - ax) + s * (y - ay), ay + s * (x - ax) - c * (y - ay)),
            math.degrees(angle),
        )

    def _copied(
        self,
        names: Sequence[Sequence[str]],
        goes: Callable[[float, float], Pair],
        mirror: float | None,
    ) -> None:
        """`mirror`: Twice the direction of the line [deg]; None of a copy."""
        bodies = {
            str(name): self._body(str(name), "copy")
            for section, name in names
            if section == "bodies"
        }
        if not bodies or self.state.system is None:
            raise EditError("nothing to copy: choose links")
        copies = Copies(self, goes, mirror)
        for name, table in bodies.items():
            copies.names[name] = self._new(name, 2)
            x, y, angle = self.state.system.numbers.link_axes(name, *self.state.pose(name))
            angle = math.degrees(angle)
            angle = mirror - angle if mirror is not None else angle
            guess = [*self._pair(goes(x, y)), self._angle(angle)]
            own = copies.of_link(table) | {"guess": guess}
            self._splice(self.spans.section(("bodies", copies.names[name]), own))
        sections = ("joints", "loads", "drivers") if mirror is None else ("joints", "loads")
        for section in sections:
            for name, table in list(self.tree.get(section, {}).items()):
                if copies.has(table) and (
                    section != "loads" or mirror is None or kind_in("loads", table) in SYMMETRIC
                ):
                    self._put((section, self._new(name, 2)), copies.of_element(table))

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
            self.remark = "the file was written anew in the other units: comments are gone"
        self.text = kept or to_toml(made)


@dataclass
class Copies:
    """Tables of copied links and of what is between them.

    `goes`: Where a place of the world goes; `mirror`: as of `_copied`; `names`: of the copies by
      those of their links; `pivots`: likewise of points of the ground.
    """

    editor: Editor
    goes: Callable[[float, float], Pair]
    mirror: float | None
    names: dict[str, str] = field(default_factory=dict)
    pivots: dict[str, str] = field(default_factory=dict)

    def has(self, table: Any) -> bool:
        """Whether an element is between copied links and the ground alone."""
        bodies = {text.partition(".")[0] for text in _texts(table)}
        bodies &= self.editor.tree["bodies"].keys()
        return bool(bodies) and bodies <= self.names.keys()

    def of_link(self, table: Any) -> Any:
        """The table of a link; of a mirrored one in mirrored axes."""
        if self.mirror is None:
            return dict(table)
        own = {key: value for key, value in table.items() if key != "shapes"}
        if "shapes" in table:
            self.editor.remark = "shapes of contacts are not mirrored: draw them"
        if "cg" in own:
            own["cg"] = _mirrored(own["cg"])
        return own | {"points": {key: _mirrored(one) for key, one in own.get("points", {}).items()}}

    def of_element(self, value: Any) -> Any:
        """An element, or a part of one, with the names of the copies."""
        if isinstance(value, list):
            return [self.of_element(one) for one in value]
        if isinstance(value, str):
            body, dot, rest = value.partition(".")
            if body == "ground":
                return f"ground.{self._pivot(rest)}" if rest else self.of_element({"body": body})
            return f"{self.names[body]}{dot}{rest}" if body in self.names else value
        if not isinstance(value, dict):
            return value
        if not isinstance(value.get("body"), str) or value["body"] not in ("ground", *self.names):
            return {key: self.of_element(one) for key, one in value.items()}
        return self._marker(dict(value))

    def _marker(self, value: dict[str, Any]) -> dict[str, Any]:
        """A place with a direction."""
        body, point = value["body"], value.get("point", [0.0, 0.0])
        on_ground = body == "ground"
        value["body"] = self.names.get(body, body)
        if on_ground and isinstance(point, str):
            value["point"] = self._pivot(point)
        elif on_ground:
            whole = isinstance(point, list) and all(isinstance(one, (int, float)) for one in point)
            if not whole:
                raise EditError(f"the place {point!r} of the ground has a formula: name it a point")
            value["point"] = self.editor._pair(self.goes(*point))
        elif self.mirror is not None and not isinstance(point, str) and "point" in value:
            value["point"] = _mirrored(point)
        if self.mirror is not None and (on_ground or "angle" in value):
            value["angle"] = _negated(value.get("angle", 0.0), self.mirror if on_ground else 0.0)
        return value

    def _pivot(self, point: str) -> str:
        """The copy of a point of the ground."""
        if point not in self.pivots:
            name = self.pivots[point] = self.editor._letter()
            xy = self.goes(*self.editor.state.place(f"ground.{point}"))
            self.editor._put(("ground", "points", name), self.editor._pair(xy))
        return self.pivots[point]


def _texts(value: Any) -> Iterator[str]:
    """All texts in a value."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list)):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _texts(one)


def _negated(value: Any, of: float = 0.0) -> Any:
    """A number or a formula less than another, in degrees where that is an angle of the world."""
    if isinstance(value, str):
        return f"{of!r} deg - ({value})" if of else f"-({value})"
    return plain(of - value, 9)


def _mirrored(point: Any) -> Any:
    """A point in mirrored axes."""
    if isinstance(point, dict):
        return {**point, "angle": _negated(point["angle"])}
    return [point[0], _negated(point[1])]


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
