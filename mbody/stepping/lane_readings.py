"""What can be read of many motions at their present instants, by name: arrays (n,)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import numpy as np

from mbody.errors import ModelError, brief
from mbody.kernels.step_state import TIME
from mbody.laws.postfix import OPERATIONS
from mbody.model.element import as_marker, listed
from mbody.model.study import Measure, measure_named
from mbody.solution.compiled_measures import NUMPY, WRITTEN
from mbody.solution.histories import Record
from mbody.solution.measures import check_measure, measured, valued
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import TracedInstant, TracedRecord
from mbody.solution.tracing import Recording, Rule
from mbody.stepping.lane_motion import LaneMotion
from mbody.stepping.simulator import Simulator
from mbody.system.system import System

__all__ = ["LaneBody", "LanePoint", "LaneReaction", "LaneReadings"]

Array = np.ndarray
#: What reads one number of every state.
ReadAll = Callable[[], Array]

#: Operations by NumPy; all else is a function of its own name there.
SCOPE: dict[str, Any] = {
    name: getattr(np, NUMPY.get(name, name))
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "atan2")
}
SCOPE |= {"hypot": np.hypot, "pow": np.power, "abs": np.abs, "sign": np.sign}
SCOPE |= {"min": np.minimum, "max": np.maximum, "step": lambda x: 1.0 - np.less(x, 0.0)}


class LaneBody:
    """The present motion of one body in every state.

    Attributes
    ----------
    x, y, vx, vy, ax, ay : arrays (n,)
        Mass centre, world axes [length, length/time, length/time²].
    angle, omega, alpha : arrays (n,)
        Of the link's x axis [rad], and its rates.
    """

    __slots__ = ("_first", "_read", "name")
    #: Which derivative, and which coordinate.
    ROWS: ClassVar[dict[str, tuple[int, int]]] = {
        **{"x": (0, 0), "y": (0, 1), "angle": (0, 2), "vx": (1, 0), "vy": (1, 1), "omega": (1, 2)},
        **{"ax": (2, 0), "ay": (2, 1), "alpha": (2, 2)},
    }

    def __init__(self, name: str, first: int, read: Callable[[int, int], Array]) -> None:
        self.name, self._first, self._read = name, first, read

    def __getattr__(self, key: str) -> Array:
        place = self.ROWS.get(key)
        if place is None:
            raise AttributeError(f"a body has no {key!r} (it has: {', '.join(self.ROWS)})")
        return self._read(place[0], self._first + place[1])

    def __repr__(self) -> str:
        return f"{self.name}: angle {self.angle} rad"


class LanePoint:
    """The present motion of a point in every state.

    Attributes
    ----------
    x, y, vx, vy, ax, ay : arrays (n,)
        World axes [length, length/time, length/time²].
    """

    __slots__ = ("_measure", "name")
    KEYS = ("x", "y", "vx", "vy", "ax", "ay")

    def __init__(self, name: str, measure: Callable[[str], Array]) -> None:
        self.name, self._measure = name, measure

    def __getattr__(self, key: str) -> Array:
        if key not in self.KEYS:
            raise AttributeError(f"it has no {key!r} (it has: {', '.join(self.KEYS)})")
        return self._measure(f"{self.name}.{key}")


class LaneReaction:
    """The present force and torque of a joint on its body j in every state, world axes.

    Attributes
    ----------
    fx, fy, torque, magnitude : arrays (n,)
        [force, force, force·length, force].
    """

    __slots__ = ("_measure", "name")
    KEYS: ClassVar[dict[str, str]] = {
        "fx": "fx",
        "fy": "fy",
        "torque": "torque",
        "magnitude": "force",
    }

    def __init__(self, name: str, measure: Callable[[str], Array]) -> None:
        self.name, self._measure = name, measure

    def __getattr__(self, key: str) -> Array:
        if key not in self.KEYS:
            raise AttributeError(f"a reaction has no {key!r} (it has: {', '.join(self.KEYS)})")
        return self._measure(f"{self.name}.{self.KEYS[key]}")


class LaneReadings:
    """Readings of present instants; what steps is in `Simulators`."""

    system: System
    n: int
    _lanes: LaneMotion
    _page_valid = False

    def _alone(self) -> Iterator[tuple[int, Simulator]]:
        """The states that are not on lanes, each with a simulator that is set to it."""
        raise NotImplementedError

    @property
    def t(self) -> Array:
        """Times (n,)."""
        return self._lanes.row(self._lanes.many.state, TIME)

    @property
    def q(self) -> Array:
        """Coordinates (n, coordinates), as of `Simulator.q`."""
        return self._lanes.rows(self._lanes.many.y, 0, self.system.coordinates)

    @property
    def v(self) -> Array:
        """Their rates (n, coordinates)."""
        n3 = self.system.coordinates
        return self._lanes.rows(self._lanes.many.y, n3, n3)

    @property
    def own(self) -> Array:
        """The mechanism's own states (n, states)."""
        owns = self.system.layout.owns
        return self._lanes.rows(self._lanes.many.y, 2 * self.system.coordinates, owns)

    def __getitem__(self, name: str) -> LaneBody | LanePoint:
        """The present motion of a body, ``sims["crank"].angle``, or of a point,
        ``sims["crank.A"].x``: arrays (n,).
        """
        bodies = self.system.bodies
        if isinstance(name, str) and name in bodies and name != "ground":
            return LaneBody(name, 3 * bodies[name], self._coordinate)
        if not isinstance(name, str) or name.partition(".")[0] not in bodies:
            known = listed(body.name for body in self.system.mechanism.bodies)
            raise ModelError(f"there is no body {brief(name)} (there are: {known})", str(name))
        as_marker(name, "point", "place")
        check_measure(self.system.mechanism, Measure(f"{name}.x"))
        return LanePoint(name, self.measure)

    def _coordinate(self, derivative: int, row: int) -> Array:
        if derivative == 2:
            name, key = divmod(row, 3)
            body = self.system.mechanism.bodies[name].name
            return self.measure(f"{body}.{('ax', 'ay', 'alpha')[key]}")
        return self._lanes.row(self._lanes.many.y, derivative * self.system.coordinates + row)

    def reaction(self, joint: str) -> LaneReaction:
        """Present force and torque of a joint on its body j: arrays (n,)."""
        check_measure(self.system.mechanism, Measure(f"{joint}.fx"))
        return LaneReaction(joint, self.measure)

    def effort(self, name: str) -> Array:
        """Present effort of a driver or a coupling (n,) [force·length, or force]."""
        return self.measure(f"{name}.effort")

    def measure(self, of: str | Measure) -> Array:
        """A measured quantity at present (n,), as of `Simulator.measure`.

        The formula is compiled when it is first read; one of positions, rates, inputs and own
        states takes no evaluation.
        """
        read = self._measures.get(of)
        if read is None:
            read = self._measures[of] = self._compiled(of)
        return read()

    def _compiled(self, of: str | Measure) -> ReadAll:
        measure = measure_named(self.system.mechanism.measures, of)
        check_measure(self.system.mechanism, measure)
        if self.system.batch is None:
            try:
                return self._program(measure)
            except Exception:  # whatever Python does with a number that is none
                pass
        return lambda: self._patched(measure, self._by_pages(measure))

    def _program(self, measure: Measure) -> ReadAll:
        """A measure as a list of operations on rows."""
        system, rows = self.system, self.system.page_rows
        recording = Recording({f"row {n}": Rule(0.0) for n in range(rows)} | {"time": Rule(0.0)})
        traced: list[Any] = list(recording.inputs.values())
        record: Any = TracedRecord(traced[:-1])
        value = valued(TracedInstant(system, "simulate", traced[-1], record, None), measure)[0]
        program = recording.program([value[()] if isinstance(value, np.ndarray) else value])
        operations = program.operations.tolist()
        constants = len(program.slots) - len(operations)
        target = int(program.targets[0])
        lines, needs_page = ["def read(row, page, time):"], False
        for n in sorted({m for one in operations for m in one[1:3]} | {target}):
            if n < rows:
                source = self._source(n)
                needs_page |= source.startswith("page")
                lines.append(f"    s{n} = {source}")
            elif n == rows:
                lines.append(f"    s{n} = time()")
            elif n < constants:
                lines.append(f"    s{n} = {float(program.slots[n])!r}")
        for code, a, b, place in operations:
            name = OPERATIONS[code]
            binary = code > OPERATIONS.index("log")
            form = WRITTEN.get(name, f"{name}({{0}}, {{1}})" if binary else f"{name}({{0}})")
            lines.append(f"    s{place} = {form.format(f's{a}', f's{b}')}")
        lines.append(f"    return s{target}")
        scope: dict[str, Any] = {**SCOPE, "inf": np.inf, "nan": np.nan}
        exec("\n".join(lines), scope)
        function, lanes = scope["read"], self._lanes

        def row(of: int, n: int) -> Array:
            return lanes.row((lanes.many.y, lanes.many.inputs)[of], n)

        def page(n: int) -> Array:
            self._evaluate()
            return lanes.row(lanes.pages, n)

        def read() -> Array:
            with np.errstate(all="ignore"):
                found = function(row, page, lambda: self.t)
            found = np.broadcast_to(np.asarray(found, dtype=float), (self.n,)).copy()
            return self._patched(measure, found) if needs_page else found

        return read

    def _source(self, n: int) -> str:
        """Where a row of a page is: among the states, the inputs that are set, or the page."""
        few, own = 2 * self.system.coordinates, self.system.own_rows.start
        if n < few:
            return f"row(0, {n})"
        owns = self.system.layout.owns
        if own <= n < own + owns:
            return f"row(0, {few + n - own})"
        if n >= own + owns:
            name = self.system.mechanism.inputs[n - own - owns].name
            if name in self._input_names:
                return f"row(1, {self._input_names.index(name)})"
        return f"page({n})"

    def _by_pages(self, measure: Measure) -> Array:
        """A measure from the pages of all instants."""
        self._evaluate()
        pages = self._lanes.rows(self._lanes.pages, 0, self.system.page_rows)
        batch = self.system.batch is not None
        block, t = (pages.T[None], self.t[:, None]) if batch else (pages[:, :, None], self.t)
        record = Record([np.ascontiguousarray(block)], self.n, batch=batch)
        if batch and np.ptp(self.t) == 0.0:
            t = self.t[:1]
        solution = Solution(self.system, "simulate", t, record, None)
        return np.reshape(measured(solution, measure)[0], self.n).copy()

    def _patched(self, measure: Measure, found: Array) -> Array:
        """With the values of the states that are not on lanes, as they have them alone."""
        for k, sim in self._alone():
            found[k] = sim.measure(measure)
        return found

    def _evaluate(self) -> None:
        if not self._page_valid:
            self._lanes.evaluate()
            self._page_valid = True

    _measures: dict[Any, ReadAll]
    _input_names: tuple[str, ...]
