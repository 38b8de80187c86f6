"""A mechanism while it is dragged: along its freedom, by its dimensions, by a number."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import driven
from mbody.core.tolerances import DIFFERENCE_STEP_UNKNOWNS, DISTANCE_TIE, LENGTH_NONE
from mbody.edit.places import DrawingState
from mbody.errors import ModelError, SolveError
from mbody.model.closed_mechanism import with_others
from mbody.model.driver import AngleDriver, CoordinateDriver, Driver
from mbody.model.element import Marker
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

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
