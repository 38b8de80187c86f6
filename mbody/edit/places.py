"""Where everything of a drawing is: a text's mechanism at the position of its file, points of the
world and of links, points that are one.
"""

from __future__ import annotations

import contextlib
import functools
import math
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from mbody.analysis.driven.dead_centres import driver_range
from mbody.analysis.driven.driven import driven, kinematics, kinetostatics
from mbody.analysis.freedom.mobility import Mobility, mobility
from mbody.analysis.initial.close_loops import close_loops
from mbody.core.other_words import KINDS
from mbody.errors import ModelError, ModelWarning, SolveError, at_the_command, brief
from mbody.files.model.kept_text import unit_of_text
from mbody.files.model.problems import kind_in
from mbody.files.model.read import from_toml
from mbody.files.toml_spans import Path, value_at
from mbody.model.element import Numbers, point_numbers
from mbody.model.mechanism import Mechanism
from mbody.quantities import FormulaError, parse
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System
from mbody.views.drawing import first_position

Pair = tuple[float, float]
#: Instants of a motion over a range, and constraint equations above which none is looked for.
INSTANTS, MOST_ROWS = 181, 200
#: Kinds of joints whose two places are at one point.
COINCIDENT = ("revolute", "fixed")


class EditError(ModelError):
    """Why an edit is refused: a sentence, the element, and the key in the file."""

    def __init__(self, sentence: str, element: str = "", path: Path = ()) -> None:
        super().__init__(sentence, element.partition(".")[0] or "".join(map(str, path[1:2])))
        self.path = path


@dataclass
class DrawingState:
    """What a text gives at the position of its file.

    `system`, `run`, `mobility`: None while there are no bodies, or loops that do not close; of the
      run the last instant is that position.
    `home`, `turn`: Forces at that position and over a revolution of the only driver, where they are
      determined; `cost`: seconds of that revolution.
    `troubles`: (element, sentence) of analyses that are not possible, and of what is read otherwise
      than it may be meant.
    """

    mechanism: Mechanism
    system: System | None = None
    run: Solution | None = None
    mobility: Mobility | None = None
    home: Solution | None = None
    turn: Solution | None = None
    troubles: list[tuple[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    cost: float = 0.0

    @functools.cached_property
    def coordinates(self) -> np.ndarray:
        """Poses of all mass centres, the ground last: from them positions nearby are reached."""
        if self.run is None or self.system is None:
            return np.zeros(3)
        last, rows = np.array([len(self.run) - 1]), slice(0, self.system.coordinates)
        return np.append(self.run.record.at(rows, last)[0], np.zeros(3))

    @functools.cached_property
    def poses(self) -> dict[str, list[float]]:
        """x, y of the mass centre and the angle of each body."""
        every = self.coordinates.reshape(-1, 3).tolist()
        return dict(zip((body.name for body in self.mechanism.bodies), every[:-1], strict=False))

    @functools.cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """How far drivers can go that do not go round, in rad and lengths of the model."""
        found: dict[str, tuple[float, float]] = {}
        system, drivers = self.system, self.mechanism.drivers
        if system is None or self.turn is not None or not drivers:
            return found
        if system.rows > MOST_ROWS:
            beyond = f"of a mechanism of more than {MOST_ROWS} constraint equations"
            self.notes.append(f"how far its drivers go is not looked for {beyond}")
            return found
        for driver in drivers:
            with contextlib.suppress(ModelError, SolveError):
                low, high = map(float, driver_range(system, driver.name))
                if math.isfinite(high - low):
                    found[driver.name] = low, high
        return found

    @functools.cached_property
    def motion(self) -> Solution | None:
        """Forces over a revolution of the only driver; of one that does not go round over its
        range, at the rate of its law, a hundredth before the ends, where they grow without bounds.
        """
        if self.turn is not None or len(self.mechanism.drivers) != 1 or not self.ranges:
            return self.turn
        ((name, (low, high)),) = self.ranges.items()
        assert self.system is not None and self.run is not None  # of what has a range
        edge, (value, rate, _) = 0.01 * (high - low), self.run.driven(name)
        path = np.linspace(low + edge, high - edge, INSTANTS)
        # from where it stands, so that the branch is that of the drawing
        before = np.linspace(float(value[-1]), path[0], INSTANTS)[:-1]
        values = np.concatenate([before, path])
        drive = {name: (values, np.full(len(values), float(rate[-1])), 0.0 * values)}
        with contextlib.suppress(ModelError, SolveError):
            return driven(
                self.system,
                "kinetostatics",
                drive=drive,
                before=len(before),
                pose=self.coordinates,
            )
        return None

    def pose(self, body: str) -> list[float]:
        """x, y of the mass centre and the angle of a body."""
        return self.poses.get(body, [0.0, 0.0, 0.0])

    def arm(self, body: str, point: str) -> Pair:
        """A point, or the origin, from the mass centre in link axes."""
        x, y = self.own(f"{body}.{point}" if point else body)
        cx, cy = self.own(f"{body}.cg") if body != "ground" else (0.0, 0.0)
        return x - cx, y - cy

    def own(self, place: str) -> Pair:
        """A point, or the origin, in link axes."""
        point = place.partition(".")[2]
        if not point:
            return 0.0, 0.0
        if self.system is None:
            values = point_numbers(self.mechanism.ground.points[point], place)
            polar = frozenset({place} if f"{place}.r" in values else ())
            x, y = Numbers(values, polar).point(place)
        else:
            x, y = self.system.numbers.point(place)
        return float(x), float(y)

    def place(self, place: str) -> Pair:
        """A point, or the origin of a link, in the world."""
        body, _, point = place.partition(".")
        x, y, angle = self.pose(body)
        u, v = self.arm(body, point)
        c, s = math.cos(angle), math.sin(angle)
        return x + c * u - s * v, y + s * u + c * v

    def in_link(self, body: str, xy: Iterable[float]) -> Pair:
        """A place of the world in the axes of a link."""
        x, y, angle = self.pose(body)
        cx, cy = self.own(f"{body}.cg") if body != "ground" and self.run else (0.0, 0.0)
        dx, dy = (float(a) - b for a, b in zip(xy, (x, y), strict=True))
        c, s = math.cos(angle), math.sin(angle)
        return cx + c * dx + s * dy, cy - s * dx + c * dy

    def along(self, place: str, xy: Iterable[float]) -> Pair:
        """The place nearest to another on the line through a point and the nearest other point of
        its link, which gets another length alone.
        """
        body, at = place.partition(".")[0], np.array(self.place(place))
        link = next((one for one in self.mechanism.bodies if one.name == body), None)
        others = [self.place(f"{body}.{point}") for point in (link.points if link else ())]
        arms = [arm for other in others if (arm := at - other).any()]
        if not arms:
            raise EditError(f"'{body}' has no other point to keep a direction from", body)
        arm = min(arms, key=lambda one: float(one @ one))
        x, y = at + arm * float((np.array([*xy]) - at) @ arm / (arm @ arm))
        return float(x), float(y)


def evaluate(
    text: str, name: str = "model", folder: FilePath | None = None, *, whole: bool = True
) -> DrawingState:
    r"""The state of a text. `whole`: With its freedom, and with forces over a revolution.

    Raises ModelError of what is no mechanism, SolveError of loops that do not close.

    >>> evaluate("[bodies.link]\npoints = { A = [1, 2] }").place("link.A")
    (1.0, 2.0)
    """
    with at_the_command(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ModelWarning)
        state = DrawingState(from_toml(text, name=name, folder=folder))
        if state.mechanism.bodies:
            _analyse(state, whole)
    said = [str(one.message) for one in caught if issubclass(one.category, ModelWarning)]
    state.troubles += [("", sentence) for sentence in dict.fromkeys(said)]
    return state


def _analyse(state: DrawingState, whole: bool) -> None:
    system = assemble(state.mechanism)
    state.run, state.system = position(system), system
    if not whole:
        return
    state.mobility = found = mobility(system)
    if found.freedom or not (state.mechanism.drivers or not found.of_joints.freedom):
        return
    state.home = state.run
    if state.run.analysis != "kinetostatics":
        state.home = None
        with contextlib.suppress(ModelError, SolveError):
            state.home = kinetostatics(system)
    if len(state.mechanism.drivers) == 1:
        began = time.perf_counter()
        try:
            state.turn = kinetostatics(system, turn=True)
        except (ModelError, SolveError) as error:
            state.troubles.append((error.element or "", str(error)))
        state.cost = time.perf_counter() - began


def position(system: System) -> Solution:
    """One instant: where the simulation begins, else of the drivers at t = 0, with forces where
    they are determined; what is half drawn is at rest, as near to its guess as the loops allow.
    """
    machine = system.mechanism
    if machine.ask is None and machine.simulation is not None:
        return first_position(system)
    closing = machine.contacts or any(joint.limited for joint in machine.joints)
    if system.rows >= system.coordinates or closing:
        with contextlib.suppress(ModelError, SolveError):
            return kinetostatics(system)
    if machine.drivers and (system.rows >= system.coordinates or closing):
        with contextlib.suppress(SolveError):
            return kinematics(system)
    # without rates no branches of the motion are looked for
    values = {d.name: float(system.law_of(d)(0.0)) for d in system.independent_drivers}
    return close_loops(system, drive=values or None)


def pin_groups(tree: Mapping[str, Any]) -> list[list[str]]:
    """Places that are one point of the drawing: joined by pins, or alone.

    >>> pin_groups({"ground": {"points": {"A": [0, 0]}}, "bodies": {"b": {"points": {"A": [0, 0]}}},
    ...             "joints": {"A": {"pin": ["ground.A", "b.A"]}}})
    [['ground.A', 'b.A']]
    """
    above: dict[str, str] = {}

    def root(name: str) -> str:
        while above.setdefault(name, name) != name:
            name = above[name]
        return name

    for body, table in (("ground", tree.get("ground", {})), *tree.get("bodies", {}).items()):
        for point in table.get("points", {}):
            root(f"{body}.{point}")
    for joint in tree.get("joints", {}).values():
        word = kind_in("joints", joint) or ""
        places = [place_name(one) for one in joint.get(word, [])]
        if KINDS.get(word, word) in COINCIDENT and all(places):
            above[root(places[0])] = root(places[1])
    groups: dict[str, list[str]] = {}
    for name in above:
        groups.setdefault(root(name), []).append(name)
    return list(groups.values())


def group_of(groups: Iterable[list[str]], place: str) -> list[str]:
    """The point of the drawing that a place is of."""
    for group in groups:
        if place in group:
            return group
    raise EditError(f"there is no point {brief(place)}", place)


def place_name(value: Any) -> str:
    """The text of a place in a file; empty where it has numbers of its own."""
    if isinstance(value, dict):
        point = value.get("point", "")
        body = str(value.get("body", ""))
        return (f"{body}.{point}" if point else body) if isinstance(point, str) else ""
    return value if isinstance(value, str) else ""


def point_path(place: str) -> Path:
    """Where a point stands in the file."""
    body, _, point = place.partition(".")
    return ("ground", "points", point) if body == "ground" else ("bodies", body, "points", point)


def formula_names(value: Any) -> set[str]:
    """Names in a formula; none of a number, or of a number with its unit."""
    try:
        return set(parse(value, curves=True).names) if isinstance(value, str) else set()
    except FormulaError:
        return set()


def handles(state: DrawingState, tree: Mapping[str, Any], group: Sequence[str]) -> list[str]:
    """Parameters by which a point is moved: those in its formulas that are plain numbers, and those
    of which the others are made.
    """
    parameters, found = tree.get("parameters", {}), dict[str, None]()
    waiting: list[Any] = []
    for place in group:
        value = value_at(tree, point_path(place))
        waiting += value.values() if isinstance(value, dict) else value or []
    while waiting:
        for name in sorted(formula_names(waiting.pop(0)) & parameters.keys()):
            if is_number(parameters[name], state):
                found[name] = None
            elif len(found) < 99:
                waiting.append(parameters[name])
    return list(found)


def fixed(state: DrawingState, tree: Mapping[str, Any], group: Sequence[str]) -> str:
    """Why a point cannot be moved; empty where it can."""
    if not any("." in place for place in group):
        return f"'{group[0]}' is the origin of its link: move another point of it"
    if "ground" in group:
        place = next(place for place in group if "." in place)
        return f"'{place}' is pinned to the origin of the ground: name a point there first"
    for place in group:
        value = value_at(tree, point_path(place))
        if value is None and "." not in place:
            continue
        for one in value.values() if isinstance(value, dict) else value or []:
            if not is_number(one, state) and not handles(state, tree, group):
                return (
                    f"'{place}' is given by the formula {one!r}, which has no parameter: give it "
                    "numbers first"
                )
    return ""


def is_number(written: Any, state: DrawingState) -> bool:
    """Whether an entry of a file is a number, plain or with a unit, and no formula."""
    if isinstance(written, str):
        try:
            float(written)
        except ValueError:
            return unit_of_text(written, state.mechanism.units) is not None
        return True
    return isinstance(written, (int, float)) and not isinstance(written, bool)


def plain(value: float, digits: int) -> float | int:
    """A number as one writes it."""
    rounded = round(float(value), digits) + 0.0
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded
