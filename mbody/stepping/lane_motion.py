"""Memory of many states in groups of lanes, and the kernels that lead them on, in threads."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, ClassVar

import numpy as np

from mbody.analysis.dynamics.batch_integration import TABLES
from mbody.analysis.dynamics.integrators import (
    PATIENT,
    REFINEMENTS,
    auxiliary_sizes,
    coordinate_sizes,
)
from mbody.analysis.dynamics.interruptions import hold_inputs, without_hold
from mbody.core.lanes import LANES, aligned
from mbody.errors import ModelError, brief
from mbody.kernels.layout import Work, artificial_masses, inverse_masses
from mbody.kernels.runge_kutta_lanes import (
    CONTROLS,
    UNTIL,
    LaneStates,
    LaneWorkspace,
    evaluate_lanes,
    step_lanes,
)
from mbody.kernels.step_state import NEXT, TIME, Tolerances
from mbody.model.element import as_marker, unknown_name
from mbody.model.simulation import Measure, measure_named
from mbody.solution.histories import Record, Unique
from mbody.solution.measures import check_measure, evaluate_measure, measured
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.solution.traced_instant import FUNCTIONS, RowProgram, recorded_instant
from mbody.stepping.readings import jumping
from mbody.stepping.simulator import Simulator
from mbody.system.system import System

Array = np.ndarray

#: Steps of lanes in one call of the kernel; between calls Ctrl-C takes effect.
AT_ONCE = 500
#: Groups that a thread takes at once: some 0.1 ms of work, beside which taking them costs nothing.
SHARE = 8


def usable_cores() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class LaneMotion:
    """n states of one topology, each with its time.

    `system`: One design, or a batch of n.
    `settings`: Method and tolerances.
    `inputs`: Signal row of every input that is set from outside.
    `threads`: At most so many work at the same time.

    `count`: n.
    """

    def __init__(
        self,
        system: System,
        n: int,
        settings: IntegrationSettings,
        inputs: dict[str, int],
        threads: int,
    ) -> None:
        self.system, self.count, self.settings = system, n, settings
        self.groups = -(-n // LANES)
        self.threads = max(1, min(threads, -(-self.groups // SHARE)))
        self.layout = without_hold(system.runtime(), {**hold_inputs(system), **inputs})
        # states that all go alone have no steps on lanes
        self.table = TABLES.get(settings.method, TABLES["dopri5"])()
        light = bool(artificial_masses(system.layout, system.mass, system.sizes).any())
        self.tolerances = Tolerances(
            relative=settings.rtol,
            absolute=settings.atol,
            refinements=REFINEMENTS if light else 0,
            full_refinements=REFINEMENTS,
            patience=PATIENT,
        )
        rows, nodes = system.state_count, max(1, system.layout.nodes)
        par = mass = weight = np.zeros((0, 0, LANES))
        if system.batch is not None:
            own = inverse_masses(system.layout, system.mass, system.sizes)
            par, mass, weight = (self._grouped(one) for one in (system.par, system.mass, own))
        self.many = LaneStates(
            rounds=AT_ONCE,
            own_numbers=int(system.batch is not None),
            par=par,
            mass=mass,
            weight=weight,
            y=self._blank(rows),
            derivative=self._blank(rows),
            scale=self._blank(rows),
            near=self._blank(nodes),
            state=self._blank(CONTROLS),
            inputs=self._blank(max(1, len(inputs))),
            input_row=np.array(list(inputs.values()), dtype=np.int64),
            stale=np.zeros((self.groups, LANES)),
            fresh=np.zeros((self.groups, LANES)),
            bad=np.zeros(self.groups * LANES),
        )
        self.many.scale[:] = 1.0
        self.records = self._blank(system.record_rows)
        self._auxiliary_sizes = auxiliary_sizes(system)
        self._workers = [self._worker() for _ in range(self.threads)]
        self._pool: ThreadPoolExecutor | None = None

    def _blank(self, rows: int) -> Array:
        return aligned(self.groups * rows, LANES).reshape(self.groups, rows, LANES)

    def _grouped(self, numbers: Array) -> Array:
        """Numbers (rows, n) as (groups, rows, lanes); the last lanes repeat the last state."""
        places = np.minimum(np.arange(self.groups * LANES), self.count - 1)
        found = self._blank(len(numbers))
        found[:] = numbers[:, places].reshape(-1, self.groups, LANES).transpose(1, 0, 2)
        return found

    def _worker(self) -> tuple[Work, LaneWorkspace]:
        """Workspaces of one thread."""
        n, terms = self.system.state_count, 3 + len(self.table.D)
        workspace = LaneWorkspace(
            state=aligned(CONTROLS, LANES),
            design=np.full(LANES + 1, -1),
            y=aligned(n, LANES),
            last=aligned(n, LANES),
            stage=aligned(n, LANES),
            end=aligned(n, LANES),
            scale=aligned(n, LANES),
            K=aligned(len(self.table.A) * n, LANES).reshape(-1, n, LANES),
            F=aligned(terms * n, LANES).reshape(-1, n, LANES),
            record=aligned(2, LANES),
        )
        return self.system.work(LANES, masses=True), workspace

    # -- numbers ------------------------------------------------------------------------------

    def row(self, table: Array, row: int) -> Array:
        """A row of numbers (groups, rows, lanes) as a new array (n,)."""
        found: Array = table[:, row, :].reshape(-1)[: self.count]
        return found if found.base is None else found.copy()

    def rows(self, table: Array, first: int, count: int) -> Array:
        """Rows that follow each other: (n, count)."""
        part = table[:, first : first + count, :].transpose(0, 2, 1)
        return np.ascontiguousarray(part.reshape(-1, count)[: self.count])

    def put(self, table: Array, row: int, which: Array, values: Array | float) -> None:
        """Set one row of some states."""
        table[which // LANES, row, which % LANES] = values

    def put_all(self, table: Array, which: Array, values: Array) -> None:
        """Set the first rows of some states: values (states, rows)."""
        table[which // LANES, : values.shape[1], which % LANES] = values

    def some(self, table: Array, which: Array) -> Array:
        """All rows of some states: (states, rows)."""
        return np.asarray(table[which // LANES, :, which % LANES])

    def flag(self, table: Array, which: Array) -> None:
        """Mark some states in `stale` or `fresh`."""
        table[which // LANES, which % LANES] = 1.0

    def fill(self) -> None:
        """Let the lanes beyond the last state have its numbers, so that no lane is empty."""
        last, many = np.array([self.count - 1]), self.many
        beyond = np.arange(self.count, self.groups * LANES)
        for table in (many.y, many.derivative, many.scale, many.near, many.state, many.inputs):
            self.put_all(table, beyond, self.some(table, last))
        self.put(many.state, UNTIL, beyond, -np.inf)

    # -- kernels ------------------------------------------------------------------------------

    def begin(self, which: Array, t: Array, y: Array) -> None:
        """Begin anew in some states: times (states,) and states (states, rows). Those that cannot
        are marked bad.
        """
        many, n = self.many, self.system.coordinates
        self.put_all(many.y, which, y)
        self.put_all(many.state, which, np.zeros((len(which), CONTROLS)))
        self.put(many.state, TIME, which, t)
        self.put(many.state, UNTIL, which, t)
        self.flag(many.fresh, which)
        many.stale[which // LANES, which % LANES] = 0.0
        self.evaluate(np.unique(which // LANES))
        y, rates = self.some(many.y, which), self.some(many.derivative, which)
        with np.errstate(invalid="ignore"):
            sizes = coordinate_sizes(self.system, y[:, n : 2 * n], rates[:, n : 2 * n])
        own = np.broadcast_to(self._auxiliary_sizes, (len(which), len(self._auxiliary_sizes)))
        self.put_all(many.scale, which, np.hstack([sizes, own]))
        self.put(many.state, NEXT, which, 0.0)

    def evaluate(self, groups: Array | None = None) -> None:
        """Keep the present instants of some groups in `records`."""

        def work(worker: tuple[Work, LaneWorkspace], first: int, last: int) -> int:
            evaluate_lanes(
                self.layout, worker[0], REFINEMENTS, self.many, worker[1], self.records, first, last
            )
            return last

        if groups is None:
            self._share(work)
            return
        for group in groups.tolist():
            work(self._workers[0], group, group + 1)

    def go_on(self) -> None:
        """Lead every state on to its time UNTIL, but those that are or become bad."""

        def work(worker: tuple[Work, LaneWorkspace], first: int, last: int) -> int:
            return step_lanes(
                self.layout,
                worker[0],
                self.table,
                self.tolerances,
                self.many,
                worker[1],
                first,
                last,
            )

        self._share(work)

    def _share(self, work: Callable[[tuple[Work, LaneWorkspace], int, int], int]) -> None:
        """Do all groups, some at once in each thread."""
        if self.threads == 1:
            first = 0
            while first < self.groups:
                first = work(self._workers[0], first, self.groups)
            return
        lock, next_group, stopped = threading.Lock(), 0, False

        def take_turns(worker: tuple[Work, LaneWorkspace]) -> None:
            nonlocal next_group
            while not stopped:
                with lock:
                    first = next_group
                    next_group = last = min(first + SHARE, self.groups)
                if first >= self.groups:
                    return
                while first < last and not stopped:
                    first = work(worker, first, last)

        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads - 1, "mbody lanes")
        others = [self._pool.submit(take_turns, one) for one in self._workers[1:]]
        try:
            take_turns(self._workers[0])
        except BaseException:
            stopped = True
            raise
        finally:
            for one in others:
                one.result()


# -- Inputs of many motions: arrays (n,) by name -----------------------------------------------


class LaneInputs(MutableMapping[str, Array]):
    """The present values of the inputs by name, arrays (n,) in the units of the mechanism.

    What is set is a number for all, or an array (n,); it acts from then on. Arrays that are read
    are copies: set them again.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        lanes: LaneMotion,
        others: dict[str, str],
        number: Callable[[str, Any], float],
        on_change: Callable[[], None],
        drivers: Mapping[str, str] | None = None,
    ) -> None:
        self._drivers = dict(drivers or {})
        self.names, self._lanes, self._others = names, lanes, others
        self._number, self._on_change = number, on_change

    def __getitem__(self, name: str) -> Array:
        return self._lanes.row(self._lanes.many.inputs, self._input_index(name))

    def __setitem__(self, name: str, value: Any) -> None:
        place, lanes = self._input_index(name), self._lanes
        values = self._values(name, value)
        table = lanes.many.inputs
        filled = np.full(lanes.groups * table.shape[2], values[-1])
        filled[: lanes.count] = values
        given = filled.reshape(lanes.groups, -1)
        different = given != table[:, place, :]
        if different.any():
            if name in self._drivers:
                raise jumping(name, self._drivers[name])
            table[:, place, :] = given
            lanes.many.stale[different] = 1.0
            self._on_change()

    def _input_index(self, name: str) -> int:
        if name in self.names:
            return self.names.index(name)
        if name in self._others:
            raise ModelError(f"the input '{name}' {self._others[name]}", name)
        raise unknown_name("input", name, self)

    def _values(self, name: str, value: Any) -> Array:
        """A number for every state."""
        n = self._lanes.count
        if isinstance(value, str):
            value = self._number(name, value)
        try:
            values = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise ModelError(
                f"the input '{name}' takes a number or an array of {n}, not {brief(value)}", name
            ) from None
        if values.shape not in ((), (1,), (n,)):
            raise ModelError(
                f"the input '{name}' has an array of shape {values.shape}: give one number, or one "
                f"for each of the {n} motions",
                name,
            )
        if not np.isfinite(values).all():
            first = int(np.flatnonzero(~np.isfinite(np.atleast_1d(values)))[0])
            raise ModelError(
                f"the input '{name}' is {np.atleast_1d(values)[first]} in motion {first}: give "
                "finite numbers",
                name,
            )
        return np.broadcast_to(values.reshape(-1), (n,))

    def __delitem__(self, name: str) -> None:
        self._input_index(name)
        raise ModelError(f"the input '{name}' belongs to the mechanism: set it to a number", name)

    def __iter__(self) -> Iterator[str]:
        return iter((*self.names, *self._others))

    def __len__(self) -> int:
        return len(self.names) + len(self._others)

    def __repr__(self) -> str:
        return f"Inputs of {self._lanes.count} motions: {', '.join(self.names) or 'none'}"


# -- Readings of many motions at their present instants, by name: arrays (n,) ------------------

#: What reads one number of every state.
ReadAll = Callable[[], Array]


class LaneBody:
    """The present motion of one body in every state.

    `x`, `y`, `vx`, `vy`, `ax`, `ay` (n,): Mass centre, world axes [length, length/time,
      length/time²].
    `angle`, `omega`, `alpha` (n,): Of the link's x axis [rad], and its rates.
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

    `x`, `y`, `vx`, `vy`, `ax`, `ay` (n,): World axes [length, length/time, length/time²].
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

    `fx`, `fy`, `torque`, `magnitude` (n,): [force, force, force·length, force].
    `unique`: Whether each of fx, fy, torque is determined in all states, as of `mbody.Reaction`.
    """

    __slots__ = ("_measure", "_uniques", "name")
    KEYS: ClassVar[dict[str, str]] = {
        "fx": "fx",
        "fy": "fy",
        "torque": "torque",
        "magnitude": "force",
    }

    def __init__(
        self, name: str, measure: Callable[[str], Array], uniques: Callable[[], Iterator[Unique]]
    ) -> None:
        self.name, self._measure, self._uniques = name, measure, uniques

    @property
    def unique(self) -> Unique:
        """Of all states together."""
        every = list(self._uniques())
        if None in every:
            return None
        parts = zip((True,) * 3, *(one for one in every if one is not None), strict=True)
        x, y, torque = (None if None in part and False not in part else all(part) for part in parts)
        return x, y, torque

    def __getattr__(self, key: str) -> Array:
        if key not in self.KEYS:
            raise AttributeError(f"a reaction has no {key!r} (it has: {', '.join(self.KEYS)})")
        return self._measure(f"{self.name}.{self.KEYS[key]}")


class LaneReadings:
    """Readings of present instants; what steps is in `Simulators`."""

    system: System
    n: int
    _lanes: LaneMotion
    _record_valid = False

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
        """The mechanism's auxiliary states (n, states)."""
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
            raise unknown_name("body", name, self.system.mechanism.bodies)
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

        def uniques() -> Iterator[Unique]:
            # on lanes no rows are redundant, and nothing touches or sticks
            return (sim.reaction(joint).unique for _, sim in self._alone())

        return LaneReaction(joint, self.measure, uniques)

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

    def _compiled(self, measured: str | Measure) -> ReadAll:
        measure = measure_named(self.system.mechanism.measures, measured)
        check_measure(self.system.mechanism, measure)
        if self.system.batch is None:
            try:
                return self._program(measure)
            except Exception:  # whatever Python does with a number that is none
                pass
        return lambda: self._patched(measure, self._by_records(measure))

    def _program(self, measure: Measure) -> ReadAll:
        """A measure as a list of operations on rows."""
        recording, instant = recorded_instant(self.system)
        program = RowProgram(recording.program([evaluate_measure(instant, measure)[0]]))
        lanes, places = self._lanes, [self._source(n) for n in program.rows]
        recorded = any(name == "records" for name, _ in places)

        def source(name: str, n: int) -> ReadAll:
            owner = lanes if name == "records" else lanes.many
            return lambda: lanes.row(getattr(owner, name), n)

        value = program.function([source(*place) for place in places], FUNCTIONS)

        def read() -> Array:
            if recorded:
                self._evaluate()
            with np.errstate(all="ignore"):
                found = np.broadcast_to(np.asarray(value(), dtype=float), (self.n,)).copy()
            return self._patched(measure, found) if recorded else found

        return read

    def _source(self, n: int) -> tuple[str, int]:
        """Where a row of an instant is: the memory of the lanes, and the row there."""
        few, own = 2 * self.system.coordinates, self.system.auxiliary_rows.start
        owns = self.system.layout.owns
        if n == self.system.record_rows:
            return "state", TIME
        if n < few:
            return "y", n
        if own <= n < own + owns:
            return "y", few + n - own
        if n >= own + owns:
            name = self.system.mechanism.inputs[n - own - owns].name
            if name in self._input_names:
                return "inputs", self._input_names.index(name)
        return "records", n

    def _by_records(self, measure: Measure) -> Array:
        """A measure from the records of all instants."""
        self._evaluate()
        records = self._lanes.rows(self._lanes.records, 0, self.system.record_rows)
        batch = self.system.batch is not None
        block, t = (records.T[None], self.t[:, None]) if batch else (records[:, :, None], self.t)
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
        if not self._record_valid:
            self._lanes.evaluate()
            self._record_valid = True

    _measures: dict[Any, ReadAll]
    _input_names: tuple[str, ...]
