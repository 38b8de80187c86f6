"""Memory of many states in groups of lanes, and the kernels that lead them on, in threads."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mbody.analysis.dynamics.batch_integration import TABLES
from mbody.analysis.dynamics.initial_step import REFINEMENTS, coordinate_sizes
from mbody.analysis.dynamics.integrators import PATIENT
from mbody.analysis.dynamics.interruptions import held_inputs, without_held
from mbody.analysis.dynamics.own_states import own_sizes
from mbody.core.lanes import LANES, aligned
from mbody.kernels.layout import Work, inverse_masses, stand_ins
from mbody.kernels.runge_kutta_lanes_control import CONTROLS, UNTIL, LaneWorkspace
from mbody.kernels.step_state import NEXT, TIME, Tolerances
from mbody.kernels.stepping_lanes import LaneStates, evaluate_lanes, step_lanes
from mbody.solution.restart import Way
from mbody.system.system import System

__all__ = ["LaneMotion", "usable_cores"]

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

    Parameters
    ----------
    system : System
        One design, or a batch of n.
    n : int
    way : Way
        Method and tolerances.
    inputs : mapping
        Signal row of every input that is set from outside.
    threads : int
        At most so many work at the same time.

    Attributes
    ----------
    many : LaneStates
    count : int
        n.
    """

    def __init__(
        self, system: System, n: int, way: Way, inputs: dict[str, int], threads: int
    ) -> None:
        self.system, self.count, self.way = system, n, way
        self.groups = -(-n // LANES)
        self.threads = max(1, min(threads, -(-self.groups // SHARE)))
        self.layout = without_held(system.runtime(), {**held_inputs(system), **inputs})
        # states that all go alone have no steps on lanes
        self.table = TABLES.get(way.method, TABLES["dopri5"])()
        light = bool(stand_ins(system.layout, system.mass, system.length).any())
        self.tolerances = Tolerances(
            relative=way.rtol,
            absolute=way.atol,
            refinements=REFINEMENTS if light else 0,
            full_refinements=REFINEMENTS,
            patience=PATIENT,
        )
        rows, nodes = system.state_count, max(1, system.layout.nodes)
        par = mass = weight = np.zeros((0, 0, LANES))
        if system.batch is not None:
            own = inverse_masses(system.layout, system.mass, system.length)
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
        self.pages = self._blank(system.page_rows)
        self._own = own_sizes(system)
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
        """What one thread works with."""
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
            page=aligned(2, LANES),
        )
        return self.system.work(LANES, masses=True), workspace

    # -- numbers ------------------------------------------------------------------------------

    def row(self, of: Array, row: int) -> Array:
        """A row of numbers (groups, rows, lanes) as a new array (n,)."""
        found: Array = of[:, row, :].reshape(-1)[: self.count]
        return found if found.base is None else found.copy()

    def rows(self, of: Array, first: int, count: int) -> Array:
        """Rows that follow each other: (n, count)."""
        part = of[:, first : first + count, :].transpose(0, 2, 1)
        return np.ascontiguousarray(part.reshape(-1, count)[: self.count])

    def put(self, of: Array, row: int, which: Array, values: Array | float) -> None:
        """Set one row of some states."""
        of[which // LANES, row, which % LANES] = values

    def put_all(self, of: Array, which: Array, values: Array) -> None:
        """Set the first rows of some states: values (states, rows)."""
        of[which // LANES, : values.shape[1], which % LANES] = values

    def some(self, of: Array, which: Array) -> Array:
        """All rows of some states: (states, rows)."""
        return np.asarray(of[which // LANES, :, which % LANES])

    def flag(self, of: Array, which: Array) -> None:
        """Mark some states in `stale` or `fresh`."""
        of[which // LANES, which % LANES] = 1.0

    def fill(self) -> None:
        """Let the lanes beyond the last state have its numbers, so that no lane is empty."""
        last, many = np.array([self.count - 1]), self.many
        beyond = np.arange(self.count, self.groups * LANES)
        for of in (many.y, many.derivative, many.scale, many.near, many.state, many.inputs):
            self.put_all(of, beyond, self.some(of, last))
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
            sizes = coordinate_sizes(self.system.length, y[:, n : 2 * n], rates[:, n : 2 * n])
        own = np.broadcast_to(self._own, (len(which), len(self._own)))
        self.put_all(many.scale, which, np.hstack([sizes, own]))
        self.put(many.state, NEXT, which, 0.0)

    def evaluate(self, groups: Array | None = None) -> None:
        """Keep the present instants of some groups in `pages`."""

        def work(worker: tuple[Work, LaneWorkspace], first: int, last: int) -> int:
            evaluate_lanes(
                self.layout, worker[0], REFINEMENTS, self.many, worker[1], self.pages, first, last
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
