"""Where everything of a drawing is: a text's mechanism at the position of its file, points of the
world and of links, points that are one.
"""

from __future__ import annotations

import contextlib
import functools
import math
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from mbody.analysis.driven.dead_centres import driver_range
from mbody.analysis.driven.driven import driven, kinematics, kinetostatics
from mbody.analysis.freedom.mobility import Mobility, mobility
from mbody.analysis.initial.close_loops import close_loops
from mbody.core.other_words import KINDS
from mbody.core.tolerances import DIFFERENCE_STEP_UNKNOWNS, DISTANCE_TIE, LENGTH_NONE
from mbody.errors import ModelError, ModelWarning, SolveError, at_the_command, brief
from mbody.files.model.fields import (
    ANGLE,
    BODY,
    FLAG,
    PLACE,
    ByName,
    Codec,
    Forms,
    LawCodec,
    ListCodec,
    NumberCodec,
    RowCodec,
    TableCodec,
    WordCodec,
    Wrapper,
)
from mbody.files.model.problems import SECTIONS, kind_in
from mbody.files.model.read import from_toml
from mbody.files.model.schema import Section, file_table, table_of_kind
from mbody.files.model.study_tables import MEASURE
from mbody.files.model.write import unit_of_text
from mbody.files.toml_spans import Path, value_at
from mbody.model.driver import AngleDriver, CoordinateDriver, Driver
from mbody.model.element import Marker, Numbers, point_numbers
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_others
from mbody.model.numbers import dimension_named
from mbody.quantities import FormulaError, parse
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, UnitSystem
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System
from mbody.views.drawing import first_position

# -- What the page asks for in a form of any element, made of the codecs of the file's fields --

Form = dict[str, Any]

#: Inputs for a list of tables, such as the parts of a cam's program.
PARTS = 4


def element_forms(units: UnitSystem, angle: str = "deg") -> Form:
    """Forms of the tables of the file whose entries have names: what they are, and their entries;
    `angle`: unit of plain angles.

    >>> from mbody.quantities.units import unit_system
    >>> form = element_forms(unit_system("mm-N-s"))["joints"]["entry"]["kinds"]["belt"]
    >>> [one["key"] for one in form["fields"]][3:6]
    ['tension', 'radius_i', 'radius_j']
    >>> form["fields"][4]["unit"]
    'mm'
    """

    def unit(of: Dimension | None) -> str:
        return angle if of == ANGLE else units.of(of) if of is not None and of != NUMBER else ""

    tables: dict[str, Any] = {
        key: one for key, one in file_table().keys.items() if isinstance(one.codec, ByName)
    }
    elements_first = sorted(tables, key=lambda name: name not in SECTIONS)
    return {
        name: {"about": tables[name].about, "entry": form_of(tables[name].codec.item, unit)}
        for name in elements_first
    }


def form_of(codec: Codec, unit: Callable[[Dimension | None], str]) -> Form:
    """The form of a field: a table has `fields`, a choice `kinds`, a row or list `items`; any other
    is one input, which takes a `place`, a `body`, a word of `choices`, a number in its `unit`.
    """
    if codec is PLACE or codec is BODY:
        return {"takes": codec.takes(), "picks": "place" if codec is PLACE else "body"}
    if isinstance(codec, Section):
        every: Any = codec.kinds.items()
        return {"kinds": {k: form_of(table_of_kind(cls, k).inner, unit) for k, cls in every}}
    if isinstance(codec, LawCodec):
        number, table = (form.codec for form in codec.forms)
        found = {one["key"]: one for one in form_of(table, unit)["fields"]}
        return {"kinds": {"": form_of(number, unit), **found}, "named": True}
    if isinstance(codec, TableCodec):
        fields = [
            {"key": key, "about": one.about, "needed": one.needed, **form_of(one.codec, unit)}
            for key, one in codec.keys.items()
        ]
        return {"fields": fields, "about": codec.about}
    if isinstance(codec, RowCodec):
        return {"items": [form_of(one, unit) for one in codec.items], "row": True}
    if isinstance(codec, ListCodec) and isinstance(codec.item, TableCodec):
        return {"items": [form_of(codec.item, unit)] * PARTS}
    if isinstance(codec, Forms):
        return form_of(codec.forms[-1 if codec is MEASURE else 0].codec, unit)
    if isinstance(codec, NumberCodec):
        return {"unit": unit(codec.dimension), "takes": "a number"}
    if codec is FLAG or isinstance(codec, WordCodec):
        return {"choices": [*codec.words] if isinstance(codec, WordCodec) else ["true", "false"]}
    return form_of(codec.inner, unit) if isinstance(codec, Wrapper) else {"takes": codec.takes()}


# -- A mechanism while it is dragged: along its freedom, by its dimensions, by a number --------

Array = np.ndarray

#: A driver's change in one step, in rad or lengths of the mechanism, and steps in one frame.
STEP, STEPS = 0.15, 4
#: Of such a change what counts as none: a tenth of a pixel.
SMALL = 1e-4
#: Of a place's displacement by a driver what counts as none, in mechanism lengths a unit step.
STIFF = 1e-3
#: Free motions that are held while something is dragged.
MOST_HANDS = 6
#: Halvings of a step that does not close; rounds in which numbers bring a place to another, and
#: the part of the longest change after which a frame needs no further one.
HALVINGS, ROUNDS, NEAR = 4, 2, 0.03
#: A number's change in one round, as a part of it.
PART = 0.3
#: Instants of a revolution while numbers change, and the time [s] above which it waits.
INSTANTS, LONGEST = 91, 0.02


def with_hands(state: DrawingState) -> tuple[System, list[str]]:
    r"""The mechanism with a driver on each motion that is still free, and their names.

    >>> from mbody.edit.places import evaluate
    >>> with_hands(evaluate("[bodies.link]\npoints = { A = [1, 2] }"))[1]
    ['hand1', 'hand2', 'hand3']
    """
    system, run, found = state.system, state.run, state.mobility
    if system is None or run is None or found is None:
        raise ModelError("there is nothing to drag yet: draw a link first")
    free = list(found.driven_motions[:MOST_HANDS]) if found.driven.freedom else []
    if not free:
        return system, []
    used, hands = {one.name for one in system.mechanism}, list[Driver]()
    for motion in free:
        name = next(f"hand{n}" for n in range(1, 999) if f"hand{n}" not in used)
        used.add(name)
        (x, y, angle), (vx, vy, omega) = state.pose(motion.leader), motion.rates[motion.leader]
        if abs(omega) * system.length >= math.hypot(vx, vy):
            hands.append(AngleDriver(name, motion.leader, angle))
            continue
        direction = math.atan2(vy, vx)
        along = x * math.cos(direction) + y * math.sin(direction)
        line = Marker("ground", (0.0, 0.0), direction)
        centre = Marker(motion.leader, state.own(f"{motion.leader}.cg"))
        hands.append(CoordinateDriver(name, line, centre, along))
    return assemble(with_others(system.mechanism, set(), hands)), [one.name for one in hands]


def laws_at_home(system: System) -> dict[str, tuple[Any, Any, Any]]:
    """Value and rates of each independent driver where the file has it.

    >>> import mbody
    >>> laws_at_home(mbody.assemble(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    {'motor': (1.0471975511965976, 10.0, 0.0)}
    """
    return {one.name: system.law_of(one).derivatives(0.0) for one in system.independent_drivers}


class Dragging:
    r"""A mechanism at the position of its file, and what is dragged from there.

    Attributes
    ----------
    drawn : DrawingState
        As the file has it.
    now : DrawingState
        Where it stands: with the numbers that a drag has changed, a driver on each free motion, and
        forces where it is driven.
    values : dict
        Of drivers and hands by name, in rad and lengths of the model.
    changed : dict
        Numbers other than those of the file, by dotted name.
    words, stopped : str
        Parameters that have changed, and why it goes no further.

    >>> from mbody.edit.places import evaluate
    >>> drag = Dragging(evaluate("[bodies.link]\npoints = { A = [1, 2] }"))
    >>> drag.move("link", (0.0, 0.0), (0.5, 0.25)).now.place("link.A")
    (1.5, 2.25)
    """

    def __init__(self, drawn: DrawingState) -> None:
        self.drawn = drawn
        self._held, self.hands = with_hands(drawn)
        self._angular = {one.name: one.angular for one in self._held.independent_drivers}
        self._cost = drawn.cost / 4.0  # of a quarter of its instants
        self.home()

    @property
    def system(self) -> System:
        """With the numbers that have changed, and a driver on each free motion."""
        assert self.now.system is not None  # else there is nothing to drag
        return self.now.system

    @property
    def away(self) -> bool:
        """Whether drivers are elsewhere than in the file."""
        pairs = ((self.values[name], law[0]) for name, law in self._laws.items())
        same = {"rel_tol": DISTANCE_TIE, "abs_tol": LENGTH_NONE}
        return not all(math.isclose(*pair, **same) for pair in pairs)

    # -- along the freedom --------------------------------------------------------------------

    def home(self) -> Dragging:
        """Everything as the file has it."""
        self.now = replace(self.drawn, system=self._held)
        self._unit_rates: Any = self.drawn.run
        self.changed, self._laws = dict[str, float](), laws_at_home(self._held)
        self._turn: Solution | None = None
        #: Of points and parameters that move them, a value and a place before.
        self._before: dict[tuple[str, str], tuple[float, Array]] = {}
        self.values = {name: float(law[0]) for name, law in self._laws.items()}
        self.words = self.stopped = ""
        if self._laws:
            self._stand(self._held, [self.values])
        return self

    def move(self, body: str, at: Sequence[float], to: Sequence[float]) -> Dragging:
        """Bring a place of a body as near to a place of the world as the drivers can; the branch is
        followed. `at`: From the mass centre, in the axes of the body.
        """
        self.words = self.stopped = ""
        if not self._laws or body == "ground":
            self.stopped = f"nothing moves '{body}': it is held everywhere"
            return self
        arm, goal = np.array(at, float), np.array(to, float)
        for _ in range(STEPS):
            change = self._towards(body, arm, goal)
            size = float(np.max(np.abs(change)))
            if size < SMALL:
                break
            change *= min(1.0, STEP / size)
            if not self._step(dict(zip(self.values, change.tolist(), strict=True))):
                break
        return self

    def drive(self, values: Mapping[str, float]) -> Dragging:
        """Drivers at these values, in steps along the branch."""
        self.words = self.stopped = ""
        change = {name: float(values.get(name, v)) - v for name, v in self.values.items()}
        size = max((abs(by) / self._scale(name) for name, by in change.items()), default=0.0)
        count = max(1, math.ceil(size / STEP))
        self._step({n: by / self._scale(n) for n, by in change.items()}, count)
        return self

    def _scale(self, name: str) -> float:
        return 1.0 if self._angular[name] else float(self._held.length)

    def _towards(self, body: str, arm: Array, goal: Array) -> Array:
        """The change of the drivers, in rad and mechanism lengths: Newton's step of ½|p − goal|²,
        with second derivatives where they hold back.
        """
        length, one = float(self._held.length), self._unit_rates[body]
        x, y, angle = self.now.pose(body)
        c, s = math.cos(angle), math.sin(angle)
        dx, dy = c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]
        off = (goal - (x + dx, y + dy)) / length
        w, alpha = one.omega, one.alpha
        columns = np.array([one.vx - w * dy, one.vy + w * dx]) / length
        bends = np.array([one.ax - alpha * dy - w * w * dx, one.ay + alpha * dx - w * w * dy])
        # a driver that hardly moves the place is left where it is
        columns[:, np.hypot(*columns) < STIFF] = 0.0
        hold = len(self.values) * np.maximum(-(off @ bends) / length, 0.0)
        matrix = np.vstack([columns, np.diag(np.sqrt(hold))])
        return np.asarray(np.linalg.lstsq(matrix, [*off, *np.zeros_like(hold)], rcond=STIFF)[0])

    def _step(self, change: Mapping[str, float], count: int = 1) -> bool:
        """Drivers by a change, in `count` steps; half as far where that does not close."""
        for n in range(HALVINGS):
            path = [
                {
                    name: value + 0.5**n * k / count * change[name] * self._scale(name)
                    for name, value in self.values.items()
                }
                for k in range(count + 1)
            ]
            try:
                self._stand(self.system, path)
            except (ModelError, SolveError) as error:
                self.stopped = str(error)
                continue
            self.values = path[-1]
            return n == 0
        return False

    def _stand(self, system: System, path: Sequence[Mapping[str, float]]) -> None:
        """Be at the end of a path of driver values, with the rates of the laws at home; the same
        position with one driver at a time is what a place can be brought to.
        """
        drive, count = {}, len(self._laws)
        for n, (name, law) in enumerate(laws_at_home(system).items()):
            values = [one[name] for one in path]
            unit = self._scale(name) * np.eye(count)[n]
            rates = np.concatenate([np.full(len(path), law[1]), unit])
            still = np.concatenate([np.full(len(path), law[2]), np.zeros(count)])
            drive[name] = (np.array([*values, *[values[-1]] * count]), rates, still)
        found = driven(system, "kinetostatics", drive=drive, pose=self.now.coordinates)
        self.now = DrawingState(self.drawn.mechanism, system, found.take([len(path) - 1]))
        self._unit_rates = found.take(range(len(path), len(found)))

    # -- by numbers ---------------------------------------------------------------------------

    def number(self, name: str, value: float) -> Dragging:
        """Another value of a number by dotted name, at the position of the file."""
        self.words = self.stopped = ""
        self._change({name: value})
        return self

    def point(self, places: Sequence[str], to: Sequence[float], by: Sequence[str]) -> Dragging:
        """Bring the points of one pin to a place of the world, at the position of the file.

        `by`: Parameters that move them; without any the points' own coordinates change.
        """
        self.words = self.stopped = ""
        if self.away:
            self.home()
        if by:
            lead = next((one for one in places if not one.startswith("ground.")), places[0])
            self._by_parameters(lead, np.array(to, float), list(by))
        elif values := self._own_numbers(places, to):
            self._change(values)
        else:
            self.stopped = f"nothing moves '{places[0]}': it is held everywhere"
        return self

    def _own_numbers(self, places: Sequence[str], to: Sequence[float]) -> dict[str, float]:
        """Numbers of points that are at a place of the world while the bodies stay where the file
        has them; origins go where their joints bring them.
        """
        known: Mapping[str, float] = self.system.values
        values = dict[str, float]()
        for name in (one for one in places if "." in one):
            u, v = self.drawn.in_link(name.partition(".")[0], to)
            if f"{name}.r" in known:
                before = float(known[f"{name}.angle"])
                by = math.remainder(math.atan2(v, u) - before, math.tau)
                values |= {f"{name}.r": math.hypot(u, v), f"{name}.angle": before + by}
            else:
                values |= {f"{name}.x": u, f"{name}.y": v}
        return values

    def _by_parameters(self, lead: str, goal: Array, names: list[str]) -> None:
        """Gauss–Newton: parameters that bring a point nearest, those nearest to the file's, each
        measured by its own size.
        """
        system = self.drawn.system
        assert system is not None  # else there is nothing to drag
        home = np.array([float(system.values[name]) for name in names])
        sizes = np.where(home == 0.0, [self._size(name) for name in names], np.abs(home))
        for _ in range(ROUNDS):
            here = np.array(self.now.place(lead))
            own = (np.array([float(self.system.values[name]) for name in names]) - home) / sizes
            columns = self._columns(lead, here, names, sizes)
            if columns is None:
                return
            whole = np.linalg.lstsq(columns, goal - here + columns @ own, rcond=STIFF)[0]
            largest = float(np.max(np.abs(whole - own)))
            change = (whole - own) * min(1.0, PART / max(largest, SMALL))
            for n in range(HALVINGS):
                new = home + (own + 0.5**n * change) * sizes
                if self._change(dict(zip(names, new.tolist(), strict=True))):
                    break
            else:
                return
            if largest < NEAR * PART:
                return

    def _columns(self, lead: str, here: Array, names: list[str], sizes: Array) -> Array | None:
        """How a point goes with parameters, by their sizes (2, parameters): by differences, of one
        alone from where it came; None where loops do not close.
        """
        columns, stand = [], self._state
        for name, size in zip(names, sizes.tolist(), strict=True):
            value = float(self.system.values[name])
            before, place = self._before.get((lead, name), (value, here))
            if len(names) > 1 or abs(before - value) < DIFFERENCE_STEP_UNKNOWNS * size:
                before = value + DIFFERENCE_STEP_UNKNOWNS * size
                if not self._change({name: before}):
                    return None
                place, self._state = np.array(self.now.place(lead)), stand
                self.changed[name] = value
            columns.append((place - here) / ((before - value) / size))
            self._before[lead, name] = value, here
        return np.array(columns).T

    def _size(self, name: str) -> float:
        """What a parameter that is 0 is measured by."""
        is_length = dimension_named(self.drawn.mechanism, name) == DIMENSIONS["length"]
        return float(self._held.length) if is_length else 1.0

    def _change(self, values: Mapping[str, float]) -> bool:
        """Other numbers, along the branch; whether the loops close with them."""
        try:
            system = self.system.with_values(dict(values))
            laws = laws_at_home(system)
            by = {name: float(laws[name][0] - old[0]) for name, old in self._laws.items()}
            size = max((abs(one) / self._scale(name) for name, one in by.items()), default=0.0)
            parts = np.linspace(0.0, 1.0, math.ceil(size / STEP) + 1)[size > 0.0 :]
            path = [
                {n: v + part * by[n] for n, v in self.values.items()} for part in parts.tolist()
            ]
            self._stand(system, path)
        except (ModelError, SolveError) as error:
            self.stopped = str(error)
            return False
        self._laws, self.values = laws, path[-1]
        self.changed.update(values)
        self._turn, self.stopped = None, ""
        parameters = self.drawn.mechanism.parameters
        self.words = ", ".join(self._worded(n, v) for n, v in values.items() if n in parameters)
        return True

    @property
    def _state(self) -> tuple[Any, ...]:
        """Where it stands, with which numbers."""
        return self.now, self._unit_rates, self._laws, self.values

    @_state.setter
    def _state(self, state: tuple[Any, ...]) -> None:
        self.now, self._unit_rates, self._laws, self.values = state

    def _worded(self, name: str, value: float) -> str:
        """A parameter that has changed, as people read it."""
        units, dimension = self.drawn.mechanism.units, dimension_named(self.drawn.mechanism, name)
        if dimension == DIMENSIONS["angle"]:
            return f"{name} = {math.degrees(value):.4g}°"
        return f"{name} = {value:.4g} {units.of(dimension) if dimension else ''}".rstrip()

    @property
    def turn(self) -> Solution | None:
        """A revolution of the only driver with these numbers, where one can be had within a frame;
        None where it does not go round.
        """
        alone = len(self._laws) == 1 and not self.hands
        if self._turn is None and self.changed and alone and self._cost <= LONGEST:
            (name,) = self._laws
            began = time.perf_counter()
            with contextlib.suppress(ModelError, SolveError):
                self._turn = driven(
                    self.system,
                    "kinetostatics",
                    turn=name,
                    instants=INSTANTS,
                    pose=self.now.coordinates,
                )
            self._cost = time.perf_counter() - began
        return self._turn


Pair = tuple[float, float]
#: Instants of a motion over a range, and constraint equations above which none is looked for.
PATH_INSTANTS, MOST_ROWS = 181, 200
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
        path = np.linspace(low + edge, high - edge, PATH_INSTANTS)
        # from where it stands, so that the branch is that of the drawing
        before = np.linspace(float(value[-1]), path[0], PATH_INSTANTS)[:-1]
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
