"""One design analysed over all instants with derivatives by its numbers, again and again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.path_following import PathEnded, Runner
from mbody.analysis.driven.time_grid import TimeGrid, time_grid
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.assembly_analysis import check_determined, closed, rounding
from mbody.analysis.position.closed_position import ClosedPosition, close_in_stages
from mbody.core.dual_number import DualNumber
from mbody.core.tolerances import PIVOT_SUSPICIOUS, RATE_SLOW_DRIVER, TINY
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.free_instants import MotionInstants, motion_instants
from mbody.errors import ModelError, SolveError
from mbody.model.numbers import varied
from mbody.model.study import Measure
from mbody.quantities import parse
from mbody.solution.measures import evaluate_measure, measured
from mbody.solution.solution import Solution
from mbody.sweeps.job import Job
from mbody.system.system import System


class _NotClosed(Exception):
    """A design that does not close on the branch of the description."""


@dataclass(eq=False)
class Evaluation:
    """A design with the derivatives of its histories.

    `x` (numbers,)
    `whole`: The same histories in dual numbers.
    `pose` (coordinates + 3,): Its first position.
    """

    x: np.ndarray
    run: Solution
    whole: Any
    pose: np.ndarray
    kept: dict[Measure, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def history(self, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
        """A quantity, (instants,), and its derivatives, (instants, numbers)."""
        found = self.kept.get(measure)
        if found is None:
            found = self.kept[measure] = self._history(measure)
        return found

    def _history(self, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
        count, numbers = len(self.run), len(self.x)
        try:
            history, _, _ = evaluate_measure(self.whole, measure)
        except TypeError as error:
            raise ModelError(
                f"optimize: '{measure.of}' has no exact derivatives: {error}; choose another "
                "quantity, or vary the numbers by sweep"
            ) from None
        if isinstance(history, DualNumber):
            value, derivative = history.value, history.tangents
        else:
            value, derivative = np.asarray(history, dtype=float), np.zeros(numbers)
        return (
            np.array(np.broadcast_to(value, (count,))),
            np.array(np.broadcast_to(derivative, (count, numbers))),
        )

    def mobility(self) -> tuple[float, np.ndarray, int]:
        """Distance of the motion from a singular position: the square of the rate of the drivers by
        that of what moves most, in model lengths and radians, where it is least; its derivatives,
        and the instant. It falls to zero like the distance that is left to a dead centre.
        """
        system, record = self.run.system, self.whole.record
        n = system.coordinates
        rates = record.values[:, n : 2 * n] / system.coordinate_units
        units = np.array([one.unit(system.length) for one in system.drivers])
        first = system.record_rows + 1
        speeds = record.values[:, first + 1 : first + 3 * len(units) : 3] / units
        driving = np.abs(speeds).max(axis=1)
        moving = driving > RATE_SLOW_DRIVER * driving.max(initial=0.0)
        if not moving.any():
            return 1.0, np.zeros(len(self.x)), 0
        part = np.where(moving[:, None], np.abs(rates) / np.maximum(driving, TINY)[:, None], 0.0)
        k, j = np.unravel_index(int(part.argmax()), part.shape)
        d = int(np.abs(speeds[k]).argmax())
        top = max(float(part[k, j]), TINY)
        derivative = record.tangents[k, n + j] / rates[k, j] / system.coordinate_units[j]
        derivative = derivative - record.tangents[k, first + 1 + 3 * d] / (speeds[k, d] * units[d])
        return top**-2.0, -2.0 * top**-2.0 * derivative, int(k)


class Evaluator:
    """Analyses of the designs of one system that differ in some numbers.

    `count`: How many designs were analysed.
    """

    def __init__(self, job: Job, names: Sequence[str], revolving: str) -> None:
        assert job.grid is not None
        system = job.system
        self.system, self.names, self.analysis = system, list(names), job.analysis
        self.before, self.revolving, self.count = job.before, revolving, 0
        keys = "t", "drive", "turn", "instants", "turns"
        self.how = [job.how.get(key) for key in keys]
        two = system.with_values({name: [system.values[name]] * 2 for name in names})
        #: Whether the instants depend on the numbers.
        self.timed = any(varied(two.values, driver) for driver in system.drivers)
        self.grid: TimeGrid = job.grid
        first, self.guess = self.grid.first(system), job.how.get("guess")
        start = closed(system, float(self.grid.t[0]), first, self.guess)
        check_determined(system, start, job.analysis)
        self.pose, self.regular = start.work.q[:, 0].copy(), not start.regularization
        #: Closed position of the last design that was analysed, and its numbers.
        self.last = self.pose, system.par[:, 0]
        loads = {load.name for load in system.mechanism.loads}
        texts = [parse(column.measure.of, curves=True).names for column in job.columns]
        #: Whether a quantity has what loads do.
        self.loads = any(name.partition(".")[0] in loads for names in texts for name in names)

    @property
    def instants(self) -> int:
        """Number of instants that are requested."""
        return len(self.grid.t) - self.before

    def present(self) -> np.ndarray:
        """The numbers of the description: (numbers,)."""
        return np.array([float(self.system.values[name]) for name in self.names])

    def design(self, x: np.ndarray) -> System:
        """A design as a system."""
        return self.system.with_values(dict(zip(self.names, x.tolist(), strict=True)))

    def run(self, x: np.ndarray) -> Solution:
        """The analysis of a design on the branch of the description."""
        system = self.design(x)
        grid = self._grid(system)
        try:
            start = self._closed(system, grid)
        except _NotClosed:
            # its smallest gap is looked for
            t = float(grid.t[0])
            start = closed(system, t, grid.first(system), self.guess)
        runner = Runner(system, self.analysis)
        try:
            return self._follow(runner, start, grid)
        except PathEnded as stuck:
            raise runner.explain(stuck, start, grid) from None

    def _grid(self, system: System) -> TimeGrid:
        return time_grid(system, *self.how) if self.timed else self.grid

    def _follow(self, runner: Runner, start: ClosedPosition, grid: TimeGrid) -> Solution:
        """All instants from a closed position; `PathEnded` where it cannot go on."""
        self.count += 1
        run = runner.solution(start, grid, runner.record(start, grid))
        return run.take(np.arange(self.before, len(run))) if self.before else run

    def _closed(self, system: System, grid: TimeGrid) -> ClosedPosition:
        t, first = float(grid.t[0]), grid.first(system)
        if self.regular and not (system.has_user_code or system.has_loops):
            values = np.array([[first.get(d.name, np.nan) for d in system.drivers]])
            small = float(rounding(system, self.pose))
            # from the last design, which is near as a rule, else from the description
            for pose, origin in (self.last, (self.pose, self.system.par[:, 0])):
                found = close_in_stages(system, t, values, pose, origin, small, PIVOT_SUSPICIOUS)
                if found.good[0]:
                    start = ClosedPosition(system.work())
                    start.work.q[:, 0] = found.poses[0]
                    return start
            raise _NotClosed
        start = closed(system, t, first, pose=self.pose)
        check_determined(system, start, self.analysis)
        return start

    def failure(self, x: np.ndarray) -> str:
        """Why a design cannot be analysed with derivatives."""
        try:
            self.run(x)
        except (ModelError, SolveError) as error:
            return str(error)
        return "the quantities have no finite value there"

    def plain(self, x: np.ndarray) -> Evaluation | None:
        """Evaluation of a design before searches: with derivatives, which cost little here."""
        return self(x)

    def __call__(self, x: np.ndarray) -> Evaluation | None:
        """A design with derivatives; None where it cannot be analysed."""
        try:
            system = self.design(x)
            grid = self._grid(system)
            start = self._closed(system, grid)
            pose = start.work.q[:, 0].copy()
            run = self._follow(Runner(system, self.analysis), start, grid)
            instants = DrivenInstants(run, self.names, self.revolving)
            whole = instants.at(np.arange(len(run)), self.loads)
        except (ModelError, SolveError, PathEnded, _NotClosed):
            return None
        record = whole.record
        if not (np.isfinite(record.values).all() and np.isfinite(record.tangents).all()):
            return None
        self.last = pose, system.par[:, 0]
        return Evaluation(np.array(x), run, whole, pose)


# -- One design followed over time with derivatives by its numbers, again and again ------------


class _MotionEvaluation(Evaluation):
    """A motion with the derivatives of its histories."""

    def mobility(self) -> tuple[float, np.ndarray, int]:
        """No limit: what moves freely has no dead centre."""
        return 1.0, np.zeros(len(self.x)), 0


@dataclass(frozen=True, eq=False)
class _PlainMotion:
    """A motion without derivatives."""

    run: Solution

    def history(self, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
        """A quantity, (instants,), and no derivatives."""
        value = np.reshape(measured(self.run, measure)[0], -1)
        return value, np.zeros((len(value), 0))


class MotionEvaluator:
    """Motions of the designs of one system that differ in some numbers.

    `names`: Dotted names of the numbers.
    `options`: Of `simulate`.

    `count`: How many designs were followed.
    `instants`: Of the motion of the description; those of all designs, which do not end earlier.
    """

    def __init__(self, system: System, names: Sequence[str], options: Mapping[str, Any]) -> None:
        self.system, self.names, self.options = system, list(names), dict(options)
        self.count = 0
        self.instants = len(simulate(system, **self.options).t)

    def present(self) -> np.ndarray:
        """The numbers of the description: (numbers,)."""
        return np.array([float(self.system.values[name]) for name in self.names])

    def run(self, x: np.ndarray) -> Solution:
        """The motion of a design."""
        self.count += 1
        system = self.system.with_values(dict(zip(self.names, x.tolist(), strict=True)))
        run = simulate(system, **self.options)
        if len(run.t) != self.instants:
            unit = run.mechanism.units.time
            raise SolveError(
                f"the motion ends at t = {float(run.t[-1]):.6g} {unit} after {len(run.t)} "
                f"instants, that of the description has {self.instants}: leave out the event that "
                "ends it, or choose a shorter time"
            )
        return run

    def failure(self, x: np.ndarray) -> str:
        """Why a design cannot be followed with derivatives."""
        try:
            _, instants = self._derived(x)
        except (ModelError, SolveError) as error:
            return str(error)
        return "; ".join(instants.notes) or "the quantities have no finite value there"

    def plain(self, x: np.ndarray) -> _PlainMotion | None:
        """A design without derivatives; None where it cannot be followed."""
        try:
            return _PlainMotion(self.run(x))
        except (ModelError, SolveError):
            return None

    def __call__(self, x: np.ndarray) -> Evaluation | None:
        """A design with derivatives; None where it cannot be followed, or has none."""
        try:
            whole, instants = self._derived(x)
        except (ModelError, SolveError):
            return None
        if instants.lost.gone.any():  # after a change from which on there is no derivative
            return None
        return _MotionEvaluation(np.array(x), instants.run, whole, np.zeros(0))

    def _derived(self, x: np.ndarray) -> tuple[Any, MotionInstants]:
        """All instants in dual numbers, and what is known of their derivatives."""
        run = self.run(x)
        instants = motion_instants(run, self.names, False)
        whole = instants.at(np.arange(len(run.t)), bool(run.mechanism.loads))
        return whole, instants
