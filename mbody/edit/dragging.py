"""A mechanism while it is dragged: along its freedom, by its dimensions, by a number."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import driven
from mbody.analysis.freedom.mobility import Mobility
from mbody.core.tolerances import DIFFERENCE_STEP_UNKNOWNS
from mbody.errors import ModelError, SolveError
from mbody.model.closed_mechanism import with_others
from mbody.model.driver import AngleDriver, CoordinateDriver, Driver
from mbody.model.element import Marker
from mbody.model.mechanism import Mechanism
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
#: Halvings of a step that does not close; rounds in which numbers bring a place to another.
HALVINGS, ROUNDS = 4, 2
#: What driver values are the same by, in rad or of themselves.
SAME = 1e-12
#: A number's change in one round, as a part of it.
PART = 0.3
#: Instants of a revolution while numbers change, and the time [s] above which it waits.
INSTANTS, LONGEST = 91, 0.02


def with_hands(system: System, run: Solution, mobility: Mobility) -> tuple[System, list[str]]:
    """The mechanism with a driver on each motion that is still free, and their names.

    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("hoekens"))
    >>> with_hands(system, mbody.kinematics(system), mbody.mobility(system))[1]
    []
    """
    free = list(mobility.driven_motions[:MOST_HANDS]) if mobility.driven.freedom else []
    if not free:
        return system, []
    used, hands = {one.name for one in system.mechanism}, list[Driver]()
    for motion in free:
        name = next(f"hand{n}" for n in range(1, 999) if f"hand{n}" not in used)
        used.add(name)
        pose, (vx, vy, omega) = run[motion.leader], motion.rates[motion.leader]
        if abs(omega) * system.length >= math.hypot(vx, vy):
            hands.append(AngleDriver(name, motion.leader, float(pose.angle[0])))
            continue
        direction = math.atan2(vy, vx)
        along = float(pose.x[0]) * math.cos(direction) + float(pose.y[0]) * math.sin(direction)
        cx, cy = map(float, system.numbers.point(f"{motion.leader}.cg"))
        line = Marker("ground", (0.0, 0.0), direction)
        hands.append(CoordinateDriver(name, line, Marker(motion.leader, (cx, cy)), along))
    return assemble(with_others(system.mechanism, set(), hands)), [one.name for one in hands]


def laws_at_home(system: System) -> dict[str, tuple[Any, Any, Any]]:
    """Value and rates of each independent driver where the file has it.

    >>> import mbody
    >>> laws_at_home(mbody.assemble(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    {'motor': (1.0471975511965976, 10.0, 0.0)}
    """
    return {one.name: system.law_of(one).derivatives(0.0) for one in system.independent_drivers}


@dataclass
class Dragging:
    """A mechanism at the position of its file, and what is dragged from there.

    `system`: As the file has it; `run`: its first position; `mobility`: what is free there.

    Attributes
    ----------
    now : System
        With the numbers that a drag has changed, and a driver on each free motion.
    at : Solution
        One instant: where it stands, with forces where it is driven.
    turn : Solution or None
        A revolution of the only driver with these numbers; None where it does not go round.
    values : dict
        Of drivers and hands by name, in rad and lengths of the model.
    changed : dict
        Numbers other than those of the file, by dotted name.
    words, stopped : str
        What has changed, and why it goes no further.

    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("hoekens"))
    >>> drag = Dragging(system, mbody.kinematics(system), mbody.mobility(system))
    >>> drag.move("crank", (0.0, 0.0), (10.0, 0.0)).stopped
    ''
    """

    system: System
    run: Solution
    mobility: Mobility
    now: System = field(init=False)
    at: Solution = field(init=False)
    turn: Solution | None = field(init=False, default=None)
    values: dict[str, float] = field(init=False)
    changed: dict[str, float] = field(init=False, default_factory=dict)
    words: str = field(init=False, default="")
    stopped: str = field(init=False, default="")

    def __post_init__(self) -> None:
        self._held, self.hands = with_hands(self.system, self.run, self.mobility)
        self._home = laws_at_home(self._held)
        self._angular = {one.name: one.angular for one in self._held.independent_drivers}
        self._cost = 0.0
        self._unit_rates = self.run
        self.home()

    @property
    def machine(self) -> Mechanism:
        """The mechanism of the file."""
        return self.system.mechanism

    @property
    def away(self) -> bool:
        """Whether drivers are elsewhere than in the file."""
        pairs = ((self.values[name], home[0]) for name, home in self._home.items())
        return not all(math.isclose(*pair, rel_tol=SAME, abs_tol=SAME) for pair in pairs)

    def pose(self, body: str) -> Array:
        """x, y of the mass centre and the angle of a body, where it stands."""
        if body == "ground":
            return np.zeros(3)
        one = self.at[body]
        return np.array([one.x[-1], one.y[-1], one.angle[-1]])

    def arm(self, place: str) -> Array:
        """A named point, or the origin, from the mass centre, in the axes of its body."""
        body, _, point = place.partition(".")
        cg = 0.0 if body == "ground" else np.array(self.now.numbers.point(f"{body}.cg"), float)
        return np.array(self.now.numbers.point(place) if point else (0.0, 0.0), float) - cg

    def place(self, name: str) -> Array:
        """Where a named point is in the world."""
        pose = self.pose(name.partition(".")[0])
        return np.asarray(pose[:2] + _rotated(float(pose[2]), self.arm(name)))

    # -- along the freedom --------------------------------------------------------------------

    def home(self) -> Dragging:
        """Everything as the file has it."""
        self.now, self.changed, self.turn = self._held, {}, None
        self.at, self._home = self.run, laws_at_home(self._held)
        self.values = {name: float(value[0]) for name, value in self._home.items()}
        self.words = self.stopped = ""
        if self._home:
            self._stand(self.now, [self.values])
        return self

    def move(self, body: str, at: Sequence[float], to: Sequence[float]) -> Dragging:
        """Bring a place of a body as near to a place of the world as the drivers can; the branch is
        followed. `at`: From the mass centre, in the axes of the body.
        """
        self.words = self.stopped = ""
        if not self._home or body == "ground":
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
        return 1.0 if self._angular[name] else float(self.now.length)

    def _towards(self, body: str, arm: Array, goal: Array) -> Array:
        """The change of the drivers, in rad and mechanism lengths: Newton's step of ½|p − goal|²,
        with second derivatives where they hold back.
        """
        length, one = float(self.now.length), self._unit_rates[body]
        x, y, angle = self.pose(body)
        dx, dy = _rotated(angle, arm)
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
                self._stand(self.now, path)
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
        drive, count = {}, len(self._home)
        for n, (name, home) in enumerate(laws_at_home(system).items()):
            values = [one[name] for one in path]
            unit = self._scale(name) * np.eye(count)[n]
            rates = np.concatenate([np.full(len(path), home[1]), unit])
            still = np.concatenate([np.full(len(path), home[2]), np.zeros(count)])
            drive[name] = (np.array([*values, *[values[-1]] * count]), rates, still)
        found = driven(system, "kinetostatics", drive=drive, pose=self._pose)
        self.at = found.take([len(path) - 1])
        self._unit_rates = found.take(range(len(path), len(found)))

    @property
    def _pose(self) -> Array:
        """The present poses of all mass centres, from which those nearby are reached."""
        own = [float(self.at.record.take(n)[-1]) for n in range(self.now.coordinates)]
        return np.array([*own, 0.0, 0.0, 0.0])  # the ground is last

    # -- by numbers ---------------------------------------------------------------------------

    def number(self, name: str, value: float) -> Dragging:
        """Another value of a number by dotted name, at the position of the file."""
        self.words = self.stopped = ""
        if self._changed({name: value}):
            self._revolution()
        return self

    def point(self, places: Sequence[str], to: Sequence[float], by: Sequence[str]) -> Dragging:
        """Bring the points of one pin to a place of the world, at the position of the file.

        `by`: Parameters that move them; without any the points' own coordinates change.
        """
        self.words = self.stopped = ""
        goal = np.array(to, float)
        if self.away:
            self.home()
        if by:
            lead = next((one for one in places if not one.startswith("ground.")), places[0])
            self._by_parameters(lead, goal, by)
        else:
            values = self.coordinates(places, goal)
            if values:
                self._changed(values)
            else:
                self.stopped = f"nothing moves '{places[0]}': it is held everywhere"
        self._revolution()
        return self

    def coordinates(self, places: Sequence[str], goal: Array) -> dict[str, float]:
        """Numbers of points that are at a place of the world while the bodies stay where the file
        has them; origins go where their joints bring them.
        """
        values = {}
        for name in (one for one in places if "." in one):
            body = name.partition(".")[0]
            u, v = goal
            if body != "ground":
                one = self.run[body]
                u, v = _rotated(-float(one.angle[-1]), goal - (float(one.x[-1]), float(one.y[-1])))
                u, v = np.add((u, v), np.array(self.system.numbers.point(f"{body}.cg"), float))
            if f"{name}.r" in self.now.values:
                old = float(self.now.values[f"{name}.angle"])
                values[f"{name}.r"] = math.hypot(u, v)
                angle = math.atan2(v, u)
                values[f"{name}.angle"] = angle + math.tau * round((old - angle) / math.tau)
            else:
                values[f"{name}.x"], values[f"{name}.y"] = float(u), float(v)
        return values

    def _by_parameters(self, lead: str, goal: Array, names: Sequence[str]) -> None:
        """Gauss-Newton: parameters that bring a point nearest, those nearest to the file's, each
        measured by its own size.
        """
        home = np.array([float(self.system.values[name]) for name in names])
        sizes = np.where(home == 0.0, [self._size(name) for name in names], np.abs(home))
        for _ in range(ROUNDS):
            first = np.array([float(self.now.values[name]) for name in names]) - home
            here, columns, before = self.place(lead), [], self._state
            for name, old, away, size in zip(names, home, first, sizes, strict=True):
                step = DIFFERENCE_STEP_UNKNOWNS * size
                if not self._changed({name: float(old + away + step)}):
                    return
                columns.append((self.place(lead) - here) / DIFFERENCE_STEP_UNKNOWNS)
                self._state = before
                self.changed[name] = float(old + away)
            matrix, own = np.array(columns).T, first / sizes
            whole = np.linalg.lstsq(matrix, goal - here + matrix @ own, rcond=STIFF)[0]
            change = whole - own
            largest = float(np.max(np.abs(change)))
            change *= min(1.0, PART / max(largest, SMALL))
            for n in range(HALVINGS):
                new = home + (own + 0.5**n * change) * sizes
                if self._changed(dict(zip(names, new.tolist(), strict=True))):
                    break
            else:
                return
            if largest < SMALL * PART:
                return

    def _size(self, name: str) -> float:
        """What a parameter that is 0 is measured by."""
        is_length = dimension_named(self.machine, name) == DIMENSIONS["length"]
        return float(self.system.length) if is_length else 1.0

    def _changed(self, values: Mapping[str, float]) -> bool:
        """Other numbers, along the branch; whether the loops close with them."""
        try:
            system = self.now.with_values(dict(values))
            home = laws_at_home(system)
            by = {name: float(home[name][0] - old[0]) for name, old in self._home.items()}
            size = max((abs(one) / self._scale(name) for name, one in by.items()), default=0.0)
            parts = np.linspace(0.0, 1.0, math.ceil(size / STEP) + 1)[size > 0.0 :]
            path = [
                {n: v + part * by[n] for n, v in self.values.items()} for part in parts.tolist()
            ]
            self._stand(system, path)
        except (ModelError, SolveError) as error:
            self.stopped = str(error)
            return False
        self.now, self._home, self.values = system, home, path[-1]
        self.changed.update(values)
        self.stopped = ""
        return True

    @property
    def _state(self) -> tuple[Any, ...]:
        """Where it stands, with which numbers."""
        return self.now, self.at, self._unit_rates, self._home, self.values

    @_state.setter
    def _state(self, state: tuple[Any, ...]) -> None:
        self.now, self.at, self._unit_rates, self._home, self.values = state

    def _revolution(self) -> None:
        """The revolution with these numbers, where one can be had within a frame."""
        self.turn = None
        if self.stopped or self.hands or len(self._home) != 1 or self._cost > LONGEST:
            return
        (name,) = self._home
        began = time.perf_counter()
        with contextlib.suppress(ModelError, SolveError):
            self.turn = driven(
                self.now, "kinetostatics", turn=name, instants=INSTANTS, pose=self._pose
            )
        self._cost = time.perf_counter() - began


def _rotated(angle: float, arm: Any) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
