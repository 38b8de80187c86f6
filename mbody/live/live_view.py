"""A view that solves its model again: the core for browsers, the image and the rules of shapes."""

from __future__ import annotations

import base64
import gzip
import itertools
import math
import random
import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import ANALYSES
from mbody.analysis.initial.close_loops import close_loops
from mbody.core.recorded_numbers import Untraceable
from mbody.core.tolerances import (
    DIFFERENCE_RATIOS_SAME,
    DIFFERENCE_SHAPES_SAME,
    DIFFERENCE_STEP_NUMBERS,
    DIFFERENCE_STEP_SHAPES,
    POINT_SAME,
    TINY,
)
from mbody.errors import ModelError, SolveError
from mbody.files.model import to_toml
from mbody.files.model.read import built
from mbody.files.model.write import NUMBER_TEXT, as_it_was
from mbody.files.toml_spans import Spans
from mbody.image.arena import MODULE, browser_core
from mbody.image.model_image import Changeable, changeable_numbers, to_image
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.laws.kernels import OPERATIONS
from mbody.model.element import Numbers
from mbody.model.joints import PinSlot, Prismatic, Revolute
from mbody.model.loads import ReciprocatingCylinder
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS
from mbody.solution.contact_forces import friction_pairs
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import Recording
from mbody.system.assembler import assemble
from mbody.system.system import System, polar_points
from mbody.views.acting import friction_radius
from mbody.views.body_shapes import guide, travel
from mbody.views.joint_symbols import places as link_places
from mbody.views.page import Viewer, runs_of, view
from mbody.views.page_data import scene_data
from mbody.views.scene import Scene, scene, sketched
from mbody.views.shapes import Carrier, Pose, on
from mbody.views.sketch import KeptShape, SceneSketch

# -- Which numbers of a model stand in its file, where, and in which unit: what a page can
#    change and write back ---------------------------------------------------------------------

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


# -- Shapes of a scene as functions of changeable numbers --------------------------------------
# A shape is made for certain numbers. Here every corner of it is put down as a place between two
# anchors: places on its body that follow from the numbers by a recorded program, the ends of
# guides, or of cylinders. What moves with what is not guessed from coincidences: the scene is made
# for two sets of numbers that differ at random, and only an anchor that moves as the corner does is
# taken. Numbers that move a corner for which there is none cannot be changed on a page.

# -- Places on bodies that shapes of a live page are drawn at, as they follow from the numbers -

Array = np.ndarray

#: Directions of markers, such as those of guides.
MARKER = re.compile(r"\.(i|j|at|axis)\.angle$")
#: Instants of the motion for which the shapes are made again, those of guides among them.
INSTANTS = 13


@dataclass
class Anchor:
    """A place on a body, in axes at its mass centre: in the scene, and in both sets of numbers."""

    body: str
    made: Any
    in_scene: Array
    base: Array
    other: Array
    key: str = ""

    @property
    def moved(self) -> Array:
        """The change between the sets."""
        return np.asarray(self.other - self.base)


class Anchors:
    """The anchors of a scene, for its numbers and for two sets that differ at random."""

    def __init__(
        self, scene: Scene, data: dict[str, Any], changeable: Changeable, names: list[str]
    ) -> None:
        self.scene, self.data, self.changeable = scene, data, changeable
        self.system: System = changeable.system
        self.sketch = SceneSketch(Pose(scene.run, 0), scene.unit, scene.small)
        chance = random.Random(2)
        steps = {name: self._step(name) * chance.uniform(0.5, 1.5) for name in names}
        steps = {name: step for name, step in steps.items() if step}
        # directions of markers turn shapes, for which there are no rules
        self.rotations = {name: step for name, step in steps.items() if MARKER.search(name)}
        self.steps = {name: step for name, step in steps.items() if name not in self.rotations}
        self.other_system = self._system_with(self.steps)
        self.driven = len(scene.run) > 1 and scene.run.analysis in ANALYSES
        try:
            self.base, self.other = self._sketch(self.system), self._sketch(self.other_system)
        except (ModelError, SolveError):  # other numbers move the ends of its range
            self.driven = False
            self.base, self.other = self._sketch(self.system), self._sketch(self.other_system)
        recording = Recording(changeable.rules)
        self.recording, self.values = recording, changeable.values(dict(recording.inputs))
        machine = self.system.mechanism
        self.traced = Numbers(self.values, polar_points(machine), machine.bodies)
        self.targets: list[Any] = []
        self.anchors: list[Anchor] = []
        self.guides: list[dict[str, Any]] = []
        self.spans: list[tuple[int, int]] = []
        self.radii: dict[str, int] = {}
        self._find_anchors()
        most = max((float(np.abs(one.moved).max()) for one in self.anchors), default=0.0)
        self.same = DIFFERENCE_SHAPES_SAME * max(
            most, DIFFERENCE_STEP_SHAPES * 0.1 * self.system.length
        )

    def _step(self, name: str) -> float:
        """A small change of a number; none of one that is zero and no length and no angle."""
        value = abs(float(self.system.values[name]))
        dimension = dimension_named(self.system.mechanism, name)
        if dimension == DIMENSIONS["length"]:
            return DIFFERENCE_STEP_SHAPES * max(value, 0.1 * self.system.length)
        return (
            DIFFERENCE_STEP_SHAPES
            if dimension == DIMENSIONS["angle"]
            else DIFFERENCE_STEP_SHAPES * value
        )

    def _system_with(self, changes: dict[str, float]) -> System:
        return self.system.with_values(
            {name: float(self.system.values[name]) + by for name, by in changes.items()}
        )

    def _sketch(self, system: System) -> SceneSketch:
        """The scene for some numbers, with a motion as that of the scene where it is driven."""
        return sketched(Pose(self._run(system), 0), self.scene.unit, self.scene.small)

    def _run(self, system: System) -> Solution:
        run = self.scene.run
        drivers = system.mechanism.drivers
        if not self.driven:
            return close_loops(system)
        # the same analysis: pins with friction have circles only beside forces
        analysis = ANALYSES[run.analysis]
        index = np.unique(np.round(np.linspace(0, len(run) - 1, INSTANTS)).astype(np.int64))
        if np.ptp(run.t) > 0.0 or not drivers:
            return analysis(system, t=run.t[index])
        # the ends of a range are dead centres, which other numbers move
        index = np.unique(
            np.round(np.linspace(0.1, 0.9, INSTANTS) * (len(run) - 1)).astype(np.int64)
        )
        drive = {one.name: tuple(part[index] for part in run.driven(one.name)) for one in drivers}
        return analysis(system, drive=drive)

    # -- anchors ----------------------------------------------------------------------------------

    def _add(self, body: str, made: Any, plain: Any, key: str = "") -> int:
        """An anchor: traced, and as the numbers (in_scene, base, other) have it."""
        try:
            for part in made if made is not None else ():
                self.recording.place_of(part)
        except Untraceable:
            made = None
        place, base, other = (np.array(one, dtype=float) for one in plain)
        self.anchors.append(Anchor(body, made, place, base, other, key))
        return len(self.anchors) - 1

    def _find_anchors(self) -> None:
        machine = self.system.mechanism
        sets = self.system.numbers, self.system.numbers, self.other_system.numbers
        for element in machine:
            for side, marker in element.places().items():
                made = self.traced.arm(element, side)
                plain = [one.arm(element, side) for one in sets]
                self._add(marker.body, made, plain, f"{element.name}.{side}")
        for body in (*machine.bodies, machine.ground):
            for point in body.points:
                made, *plain = (_body_fixed(one, body.name, point) for one in (self.traced, *sets))
                self._add(body.name, made, plain, f"{body.name}.{point}")
            self._add(body.name, (0.0, 0.0), [(0.0, 0.0)] * 3, body.name)
        for joint in machine.joints:
            if isinstance(joint, (Prismatic, PinSlot)):
                self._guide(joint)
        for load in machine.loads:
            if isinstance(load, ReciprocatingCylinder):
                self._cylinder(load)

    def _key(self, key: str) -> int:
        return next(n for n, one in enumerate(self.anchors) if one.key == key)

    def _guide(self, joint: Prismatic | PinSlot) -> None:
        """Both ends of a guide, which are those of the travel in the whole motion."""
        body, rail, slides = guide(joint)
        ends = []
        for sketch in (self.sketch, self.base, self.other):
            world = np.array(travel(sketch, joint))
            ends.append(on(body).kept(world, sketch.pose))
        low, high = (
            self._add(body, None, [one[n] for one in ends], f"{joint.name}:{n}") for n in (0, 1)
        )
        more = (
            2.1 * self.base.size("block")
            if isinstance(joint, Prismatic)
            else 2.2 * self.base.size("pin")
        )
        self.guides.append(
            {
                "ends": [low, high],
                "rail": self._key(f"{joint.name}.{rail}"),
                "slides": self._key(f"{joint.name}.{slides}"),
                "angle": self._target(self.traced.angle(joint, rail)),
                "more": more,
            }
        )
        self.spans.append((low, high))

    def _cylinder(self, load: ReciprocatingCylinder) -> None:
        """Head, mouth and piston, as `mbody.views.acting.barrel` has them."""
        block = self.base.size("block")

        def made(values: Any, numbers: Numbers) -> list[Any]:
            head_end, crank_end, spare = (
                values[f"{load.name}.{key}"] for key in ("near", "far", "clearance")
            )
            plain = self.system.values
            sign = math.copysign(1.0, plain[f"{load.name}.near"] - plain[f"{load.name}.far"])
            head_end, crank_end, thick = sign * head_end, sign * crank_end, 0.3 * block
            ahead = head_end - crank_end + spare + thick + 1.3 * block
            if sign * plain[f"{load.name}.near"] < 0.0:
                ahead = np.maximum(np.minimum(ahead, -head_end - spare - thick), 0.0)
            angle, (x, y) = numbers.angle(load, "i"), numbers.arm(load, "i")
            c, s = sign * np.cos(angle), sign * np.sin(angle)
            head, mouth = head_end + ahead + spare + thick, crank_end + ahead - spare - thick
            return [
                (x + head * c, y + head * s),
                (x + mouth * c, y + mouth * s),
                (ahead * c, ahead * s),
            ]

        traced = made(self.values, self.traced)
        own = made(self.system.values, self.system.numbers)
        other = made(self.other_system.values, self.other_system.numbers)
        found = [
            self._add(body, traced[n], [own[n], own[n], other[n]], f"{load.name}:{n}")
            for n, body in enumerate((load.i.body, load.i.body, f"{load.name}.piston"))
        ]
        self._add(f"{load.name}.piston", (0.0, 0.0), [(0.0, 0.0)] * 3)
        self.spans.append((found[0], found[1]))

    def _target(self, value: Any) -> int:
        self.targets.append(value)
        return len(self.targets) - 1

    def _anchors_on(self, body: str) -> list[int]:
        return [n for n, one in enumerate(self.anchors) if one.body == body]

    def _nearest(self, body: str, at: Array) -> int:
        return min(
            self._anchors_on(body), key=lambda n: float(np.hypot(*(self.anchors[n].in_scene - at)))
        )


def _body_fixed(numbers: Numbers, body: str, point: str) -> tuple[Any, Any]:
    """A named point from the mass centre of its body."""
    (x, y), (cx, cy) = numbers.point(f"{body}.{point}"), numbers.point(f"{body}.cg")
    return x - cx, y - cy


#: Shapes that have dimensions of the mechanism; others are signs, which go with a place.
SOLID = ("link:", "wheel:", "cam:", "base:", "roller:", "face:", "rail:", "road:", "rack:")
JOINED = ("pulley:", "belt:", "rope:", "cylinder:", "rod:", "piston:", "stem:", "block:")
MEASURED = (*SOLID, *JOINED, "cg:", "edge:")
#: Names of friction circles, before that of their pin.
FRICTION = "friction:"
#: The greatest extent of a sign, in points of the paper.
SMALL = 70.0
#: Hatching about a wheel leans less where the wheel is larger: this part is not followed.
LEAN = 0.1


@dataclass
class ShapePlaces:
    """Anchors, and what lies at them.

    `program`: From the numbers that an image takes to the anchors and further numbers.
    `rules`: Of the scene: its shapes, carriers, labels, movers and forces.
    `unmoved`: By name of the numbers that shapes do not follow, why.
    """

    program: dict[str, Any]
    rules: dict[str, Any]
    unmoved: dict[str, str] = field(default_factory=dict)


def shape_places(
    scene: Scene, data: dict[str, Any], changeable: Changeable, names: Iterable[str]
) -> ShapePlaces:
    """The rules by which a scene follows these numbers."""
    return _Follower(scene, data, changeable, list(names)).places()


class _Follower(Anchors):
    """Works the rules out."""

    # -- rules ------------------------------------------------------------------------------------

    def places(self) -> ShapePlaces:
        """All rules."""
        own = self._unsorted()
        base, other = (_counterparts(own, one.record.shapes) for one in (self.base, self.other))
        shapes = [self._shape(*three) for three in zip(own, base, other, strict=True)]
        loose = [n for n, rule in enumerate(shapes) if rule == "loose"]
        for n in loose:
            shapes[n] = None
        unmoved = self._unmoved(own, base, loose)
        order = sorted(range(len(own)), key=lambda n: own[n].look.z)
        rules = {
            "shapes": {str(k): shapes[n] for k, n in enumerate(order) if shapes[n] is not None},
            "carriers": [self._carrier(one) for one in self.scene.carriers],
            "labels": [self._label(one) for one in self.scene.labels],
            "movers": [self._mover(one["n"]) for one in self.data["movers"]],
            "forces": [self._force(one["of"], one.get("load")) for one in self.data["forces"]],
            "guides": self.guides,
            "places": {
                one.key: n for n, one in enumerate(self.anchors) if self._is_body_fixed(one.key)
            },
            "points": {one.key: n for n, one in enumerate(self.anchors) if self._is_point(one.key)},
        }
        return ShapePlaces(self._program(rules), rules, unmoved)

    def _unsorted(self) -> list[KeptShape]:
        """The shapes of the scene in the order in which they were drawn: both are sorted alike."""
        drawn = sketched(self.sketch.pose, self.scene.unit, self.scene.small)
        return drawn.record.shapes

    def _shape(self, shape: KeptShape, base: KeptShape | None, other: KeptShape | None) -> Any:
        """The rule of one shape, None where it stays as it is on its carrier, or "loose"."""
        name = shape.look.name
        if name.startswith("link:"):
            return self._link(name.removeprefix("link:"), shape)
        sign = not name.startswith(MEASURED)
        if shape.carrier.end is not None and (sign or name.startswith(("rod:", "rope:"))):
            return None
        if name.startswith("tie:"):
            return self._tie(shape)
        body = self._body(shape.carrier)
        if base is None or other is None:
            return self._sign(body, shape) if sign else "loose"
        pair = self._stretched(body, shape, base, other)
        if pair is not None:
            return self._placed(shape, pair)
        if not base.points.shape == other.points.shape == shape.points.shape:
            return self._other_rule(body, sign, shape, base, other)
        moved, grown = other.points - base.points, other.radius - base.radius
        finite = np.isfinite(moved).all(axis=1)
        if not finite.any() or (
            float(np.abs(moved[finite]).max()) <= self.same and abs(grown) <= self.same
        ):
            return None
        if shape.carrier.end is not None:
            return "loose"
        at = self._rigid(body, base.points, moved, finite)
        if shape.kind == "circle":
            radius = self._radius(grown) if abs(grown) > self.same else -1
            if at is None or radius is None:
                return "loose"
            return self._placed(shape, [(at, at, 0.0)]) | ({"r": radius} if radius >= 0 else {})
        if at is not None:
            return {"at": at}
        rows = self._rows(body, shape, moved, finite)
        if rows is not None:
            return self._placed(shape, rows)
        scaled = self._scaled(body, base, moved, finite)
        if scaled is not None:
            return scaled
        return self._other_rule(body, sign, shape, base, other)

    def _other_rule(
        self, body: str, sign: bool, shape: KeptShape, base: KeptShape, other: KeptShape
    ) -> Any:
        """The rule of what no anchor moves."""
        extent = np.nanmax(shape.points, axis=0) - np.nanmin(shape.points, axis=0)
        if sign and (not self._is_body(body) or extent.max() < SMALL * self.scene.unit):
            return self._sign(body, shape)
        return None if _along(base, other, self.same) else "loose"

    def _sign(self, body: str, shape: KeptShape) -> Any:
        """A sign goes with the nearest anchor of its body, else with its carrier."""
        if not self._is_body(body):
            return None
        return {"at": self._nearest(body, np.nanmean(shape.points, axis=0))}

    def _is_body(self, name: str) -> bool:
        return name in self.system.bodies or name == "ground"

    def _stretched(
        self, body: str, shape: KeptShape, base: KeptShape, other: KeptShape
    ) -> list[tuple[int, int, float]] | None:
        """Rows of what lies between both ends of a guide or a cylinder."""
        if base.points.shape != other.points.shape or shape.kind == "circle":
            return None
        moved = other.points - base.points
        finite = np.isfinite(moved).all(axis=1)
        if not finite.any() or float(np.abs(moved[finite]).max()) <= self.same:
            return None
        for a, b in self.spans:
            if self.anchors[a].body == body:
                rows = self._between(a, b, shape, base, moved, finite)
                if rows is not None:
                    return rows
        return None

    def _body(self, carrier: Carrier) -> str:
        """Whose anchors the points of a carrier have; "" where its axes begin elsewhere."""
        name, x, y = carrier.start
        if x == y == 0.0 and name == carrier.rotates_with:
            return name
        for load in self.system.mechanism.loads:
            if isinstance(load, ReciprocatingCylinder):
                site = self.sketch.pose.site(load, "j")
                if carrier.start == site and carrier.rotates_with == load.i.body:
                    return f"{load.name}.piston"
        return ""

    def _rigid(self, body: str, points: Array, moved: Array, finite: Array) -> int | None:
        """The anchor with which all points move."""
        first = moved[finite][0]
        if float(np.abs(moved[finite] - first).max()) > self.same:
            return None
        fits = [n for n in self._anchors_on(body) if self._equal(self.anchors[n].moved, first)]
        middle = points[finite].mean(axis=0)
        return min(
            fits, key=lambda n: float(np.hypot(*(self.anchors[n].base - middle))), default=None
        )

    def _equal(self, a: Array, b: Array) -> bool:
        return float(np.abs(a - b).max()) <= self.same

    def _rows(
        self, body: str, shape: KeptShape, moved: Array, finite: Array
    ) -> list[tuple[int, int, float]] | None:
        """The anchor with which every point moves."""
        rows = []
        for k in np.flatnonzero(finite):
            own = self._anchors_on(body)
            fits = [n for n in own if self._equal(self.anchors[n].moved, moved[k])]
            if not fits:
                return None
            place = shape.points[k]
            n = min(fits, key=lambda n: float(np.hypot(*(self.anchors[n].in_scene - place))))
            rows.append((n, n, 0.0))
        return rows

    def _between(
        self, a: int, b: int, shape: KeptShape, base: KeptShape, moved: Array, finite: Array
    ) -> list[tuple[int, int, float]] | None:
        one, two = self.anchors[a], self.anchors[b]
        direction, long = two.base - one.base, two.in_scene - one.in_scene
        if not np.hypot(*direction) or not np.hypot(*long):
            return None
        change = two.moved - one.moved
        # hatching is slanted: its ends lie a little farther along than what they belong to
        slack = 0.1 * float(np.abs(change).max())
        for k in np.flatnonzero(finite):
            part = float((base.points[k] - one.base) @ direction / (direction @ direction))
            off = one.moved + min(max(part, 0.0), 1.0) * change - moved[k]
            if float(np.abs(off).max()) > self.same + slack * (not shape.look.name):
                return None
        rows = []
        for point in shape.points[np.isfinite(shape.points).all(axis=1)]:
            there = float((point - one.in_scene) @ long / (long @ long))
            rows.append((a, b, min(max(there, 0.0), 1.0)))
        return rows

    def _placed(self, shape: KeptShape, rows: list[tuple[int, int, float]]) -> dict[str, Any]:
        """Rows with what lies between the place of the anchors and the point."""
        found: list[Any] = []
        remaining = iter(rows)
        for point in shape.points:
            if not np.isfinite(point).all():
                found.append(None)
                continue
            a, b, part = next(remaining)
            one, two = self.anchors[a].in_scene, self.anchors[b].in_scene
            x, y = point - (one + part * (two - one))
            found.append([a, b, part, float(x), float(y)])
        return {"rows": found}

    def _radius(self, grown: float) -> int | None:
        """The number that grows as a radius does, of the model or of a friction circle."""
        pins = [one for one in self.system.mechanism.joints if isinstance(one, Revolute)]
        circles = [one.name for one in pins if None not in (one.friction, one.pin_radius)]
        for name in (*self.system.values, *(f"{FRICTION}{one}" for one in circles)):
            value, other = (
                self._size(name, one.values) for one in (self.system, self.other_system)
            )
            if abs(other - value - grown) < DIFFERENCE_SHAPES_SAME * abs(grown):
                if name not in self.radii:
                    self.radii[name] = self._target(self._size(name, self.values))
                return self.radii[name]
        return None

    def _size(self, name: str, values: Any) -> Any:
        """A number of the model, or the radius of a pin's friction circle as it is drawn."""
        joint = name.removeprefix(FRICTION)
        if joint == name:
            return values[name]
        mu, radius = (values[f"{joint}.{key}"] for key in ("friction", "pin_radius"))
        return self.scene.enlarged * friction_radius(mu, radius)

    def _scaled(self, body: str, base: KeptShape, moved: Array, finite: Array) -> Any:
        """A shape whose points lie about an anchor at distances that grow with a radius."""
        for name, target in self.radii.items():
            value = float(self._size(name, self.system.values))
            grown = float(self._size(name, self.other_system.values)) - value
            for n in self._anchors_on(body) if value and grown else ():
                away = base.points[finite] - self.anchors[n].base
                relative = moved[finite] - self.anchors[n].moved
                if self._equal(relative, grown / value * away):
                    return {"at": n, "by": target}
                size = np.maximum(np.hypot(*away.T), TINY)[:, None]
                if not base.look.name and np.abs(relative - grown * away / size).max() <= (
                    LEAN * abs(grown)
                ):
                    return {"at": n, "out": target}
        return None

    def _tie(self, shape: KeptShape) -> Any:
        """The line from a link to its mass centre, which is the origin of its axes."""
        tolerance = 2.0 * self.sketch.size("pin")
        own = [
            n
            for n in self._anchors_on(shape.carrier.rotates_with)
            if self.anchors[n].key != shape.carrier.rotates_with
        ]
        distant = [
            n
            for n in own
            if np.hypot(*(self.anchors[n].in_scene - self.anchors[own[0]].in_scene)) > tolerance
        ]
        return {"tie": [own[0], distant[0]]} if distant else "loose"

    def _link(self, body: str, shape: KeptShape) -> Any:
        """A plate or bar about its nodes."""
        sketch = self.sketch
        half = sketch.size("link")
        nodes = link_places(sketch, body)
        kept = on(body).kept(np.array(nodes), sketch.pose) if nodes else np.zeros((0, 2))
        own = [n for n in self._anchors_on(body) if self.anchors[n].key != body]
        if len(nodes) < 2:
            if len(nodes) == 0 or np.hypot(*kept[0]) > half:
                own.append(self._key(body))
            half *= 1.0 if len(own) > 1 and len(nodes) else 1.8
        tolerance = POINT_SAME * self.system.length
        if any(
            min(np.hypot(*(self.anchors[n].in_scene - at)) for n in own) > tolerance for at in kept
        ):
            return "loose"
        return {"nodes": own, "half": half}

    def _is_body_fixed(self, key: str) -> bool:
        machine = self.system.mechanism
        owners = {one.name for one in (*machine.loads, *machine.drivers)}
        return key.partition(".")[0] in owners and ":" not in key

    def _is_point(self, key: str) -> bool:
        body, _, point = key.partition(".")
        return body in self.system.bodies and bool(point) and ":" not in key

    def _carrier(self, carrier: Carrier) -> list[int | None]:
        return [
            None if place is None or self._axis(place) is None else self._axis(place)
            for place in (carrier.start, carrier.end)
        ]

    def _axis(self, place: tuple[str, float, float]) -> int | None:
        name, *at = place
        return self._nearest(name, np.array(at)) if any(at) else None

    def _label(self, label: Any) -> int | None:
        body = self._body(label.carrier)
        if body not in self.system.bodies or label.carrier.end is not None:
            return None
        return self._nearest(body, label.anchor[0])

    def _mover(self, name: str) -> int | None:
        return self._key(name) if "." in name else None

    def _force(self, name: str, load: Any) -> int:
        return self._key(f"{name}.at" if load else f"{name}.j")

    # -- numbers that shapes do not follow --------------------------------------------------------

    def _unmoved(
        self, own: list[KeptShape], base: list[KeptShape | None], loose: Sequence[int]
    ) -> dict[str, str]:
        """Which numbers move shapes that have no rule."""
        if not loose and not self.rotations:
            return {}
        found: dict[str, str] = {}
        tolerance = POINT_SAME * self.system.length
        everything = [n for n in range(len(own)) if n in loose or base[n] is not None]
        tested: list[tuple[str, Sequence[int]]] = [(name, loose) for name in self.steps]
        tested += [(name, everything) for name in self.rotations]
        for name, moves in tested:
            step = self.steps.get(name) or self.rotations[name]
            try:
                made = _counterparts(
                    own, self._sketch(self._system_with({name: step})).record.shapes
                )
            except (ModelError, SolveError):
                found[name] = "its loops do not close with it"
                continue
            for n in moves:
                before, after = base[n], made[n]
                if own[n].carrier.end is not None:
                    continue
                if before is None or after is None or not _same(after, before, tolerance):
                    what = own[n].look.name.replace(":", " ") or "picture"
                    found[name] = f"the {what} is drawn for the value that it has"
                    break
        return found

    def _program(self, rules: dict[str, Any]) -> dict[str, Any]:
        count = len(self.targets)
        for one in self.anchors:
            self.targets += one.made if one.made is not None else one.in_scene.tolist()
        program = self.recording.program(self.targets)
        return {
            "inputs": list(self.changeable.rules),
            "slots": program.slots.tolist(),
            "operations": [
                [OPERATIONS[code], *operands] for code, *operands in program.operations.tolist()
            ],
            "targets": program.targets.tolist(),
            "numbers": count,
            "bodies": [self._index(one.body) for one in self.anchors],
            "shown": np.round([one.in_scene for one in self.anchors], 12).tolist(),
        }

    def _index(self, body: str) -> int:
        return self.system.bodies.get(body, -2) + 1


def _counterparts(shapes: list[KeptShape], others: list[KeptShape]) -> list[KeptShape | None]:
    """Of each shape that of another sketch; None of marks of which the motions have not as many:
    an arrow for either direction of a driver, modes of contacts.
    """
    found: dict[Any, tuple[list[int], list[KeptShape]]] = {}
    for n, one in enumerate(shapes):
        found.setdefault(_key(one), ([], []))[0].append(n)
    for one in others:
        found.setdefault(_key(one), ([], []))[1].append(one)
    made: list[KeptShape | None] = [None] * len(shapes)
    for where, there in found.values():
        if len(where) == len(there):
            for n, one in zip(where, there, strict=True):
                made[n] = one
    return made


def _key(shape: KeptShape) -> tuple[str, ...]:
    carrier = shape.carrier
    return shape.kind, shape.look.name, carrier.start[0], carrier.rotates_with


def _same(a: KeptShape, b: KeptShape, tolerance: float) -> bool:
    """Whether two shapes differ by rounding only."""
    return a is b or (
        a.points.shape == b.points.shape
        and abs(a.radius - b.radius) <= tolerance
        and float(np.nanmax(np.abs(a.points - b.points), initial=0.0)) <= tolerance
    )


def _along(a: KeptShape, b: KeptShape, tolerance: float) -> bool:
    """Whether a line, a road or rail, moves along itself only; its ends are no dimension."""
    if a.kind != "line" or (a.look.name and not a.look.name.startswith(("rail:", "road:"))):
        return False
    first = a.points[np.isfinite(a.points).all(axis=1)]
    second = b.points[np.isfinite(b.points).all(axis=1)]
    middle = first.mean(axis=0)
    _, _, axes = np.linalg.svd(first - middle, full_matrices=False)
    off, there = (first - middle) @ axes[1], (second - middle) @ axes[1]
    return bool(
        abs(off.min() - there.min()) <= tolerance and abs(off.max() - there.max()) <= tolerance
    )


#: Dimensions of numbers that shapes follow, or do not.
SHAPES = (DIMENSIONS["length"], DIMENSIONS["angle"])
#: The files of the live part, each after those that it imports.
PARTS = ("live_shapes", "live_motion", "live_model", "live")
#: Words of the names of masses.
MASSES = ("mass", "weight", "inertia")


def live_view(model: Any, **options: Any) -> Viewer:
    """A page as of `view` that solves its first motion again while the reader drags and changes.

    The page contains the core for browsers and the image of the model, packed, about 250 kB.

    Parameters
    ----------
    model, **options
        As of `view`.

    Raises
    ------
    ModelError
        As of `view`, and where the core for browsers cannot be built, or the model has no image.

    Examples
    --------
    >>> import mbody
    >>> live_view(mbody.gallery.load("norton_fourbar"))  # doctest: +SKIP
    Viewer('Four-bar: dynamic force analysis': kinetostatics, 361 instants)
    """
    runs = runs_of(model)
    page = view(runs, **options)
    part = live_part(next(iter(runs.values())))
    page.add("live", part, live_module())
    return page


def live_part(run: Solution) -> dict[str, Any]:
    """Data that a live HTML page needs beside those of a recorded one."""
    found = scene(run)
    system = run.system
    image = to_image(system, len(found.run))
    changeable = changeable_numbers(system)
    try:
        text = file_numbers(system.mechanism, list(changeable.rules))
        why = ""
    except ModelError as error:
        text, why = CutFile(), str(error)
    names = [name for one in text.numbers for name in one.factors]
    places: dict[str, Any] = {}
    try:
        places_of_shapes = shape_places(found, scene_data(found, []), changeable, names)
        places = {"program": places_of_shapes.program, "rules": places_of_shapes.rules}
        unmoved = places_of_shapes.unmoved
    except (ModelError, SolveError) as error:
        unmoved = {name: str(error) for name in names if _shapes(system, name)}
    return {
        "core": _packed(browser_core().read_bytes()),
        "image": _packed(image.content),
        "places": places,
        "text": text.parts,
        "numbers": [
            {
                "value": one.value,
                "factors": one.factors,
                "unit": one.unit or _unit(image.manifest, one.factors),
                "group": _group(system, next(iter(one.factors))),
                "why": next((unmoved[name] for name in one.factors if name in unmoved), ""),
                "moves": any(_shapes(system, name) for name in one.factors),
                "sign": _sign(changeable, one.factors),
            }
            for one in text.numbers
        ],
        "fixed": _fixed(image.manifest, names),
        "rubs": _friction_rows(run),
        "why": why,
    }


def _friction_rows(run: Solution) -> dict[str, int]:
    """By frictional joint the row of the record of an instant that has the multiplier of its
    friction, whose sign is that of the sliding; of what the kinetostatics of a page solves.
    """
    first = 3 * run.system.coordinates
    found: dict[str, int] = {}
    for pair in friction_pairs(run.system) if not run.modes else ():
        if pair.loses:
            found.setdefault(pair.joint, first + PER_PRIMITIVE * pair.primitive)
    return found


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _shapes(system: System, name: str) -> bool:
    dimension = dimension_named(system.mechanism, name)
    return dimension in SHAPES or dimension is None


def _unit(manifest: dict[str, Any], factors: dict[str, float]) -> str:
    """The unit of a number that stands alone: that of the model, degrees of angles."""
    name, factor = next(iter(factors.items()))
    unit = next((str(one["unit"]) for one in manifest["numbers"] if one["name"] == name), "")
    return "deg" if unit == "rad" and factor != 1.0 else unit


def _group(system: System, name: str) -> str:
    if "." not in name:
        return "parameters"
    owner, _, key = name.partition(".")
    if key in MASSES:
        return "masses"
    machine = system.mechanism
    if any(one.name == owner for one in machine.drivers):
        return "drivers"
    if any(one.name == owner for one in machine.loads):
        return "loads"
    return "lengths and places"


def _sign(changeable: Changeable, factors: dict[str, float]) -> str:
    signs = [changeable.rules[name].sign for name in factors]
    return next((sign for sign in signs if sign), "")


def _fixed(manifest: dict[str, Any], names: list[str]) -> dict[str, str]:
    """Numbers that no image can change, with the reason; those that follow from others not."""
    dependent = {one["name"] for one in manifest["numbers"] if one["follows"]}
    fixed = manifest["not_changeable"]
    return {name: why for name, why in fixed.items() if name not in dependent}


@cache
def live_module() -> str:
    """The core's module and that of live pages, as the end of the viewer's module."""
    folder = resources.files(__package__)
    live = "\n".join((folder / f"{name}.mjs").read_text("utf-8") for name in PARTS)
    parts = []
    for name, text in (("mbodyCore", MODULE.read_text("utf-8")), ("mbodyLive", live)):
        exported = re.findall(r"^export (?:class|const|function) (\w+)", text, re.M)
        plain = re.sub(r"^export |^import .*?;\n", "", text, flags=re.M)
        names = ", ".join(exported)
        parts.append(f"const {name} = (() => {{\n{plain}\nreturn {{ {names} }};\n}})();")
    parts.append("mbodyLive.begin(Viewer, mbodyCore);")
    return "\n".join(parts)
