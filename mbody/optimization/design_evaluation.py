"""One design analysed over all instants with derivatives by its numbers, again and again."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.path_following import PathEnded, Runner
from mbody.analysis.driven.time_grid import TimeGrid, time_grid
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.assembly_analysis import check_determined, closed, rounding
from mbody.analysis.position.closed_position import ClosedPosition, close_in_stages
from mbody.core.lanes import DualNumber
from mbody.core.tolerances import PIVOT_SUSPICIOUS, RATE_SLOW_DRIVER, TINY
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.free_instants import MotionInstants, motion_instants
from mbody.derivatives.reduced_measures import integral_derivative, mean_derivative
from mbody.errors import ModelError, SolveError, brief
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import varied
from mbody.model.simulation import Measure, check_times, mean_over
from mbody.quantities import parse
from mbody.solution.measures import check_measure, checked_sides, evaluate_measure, measured
from mbody.solution.solution import Solution
from mbody.sweeps.job import Job, MeasuredColumn, columns_of
from mbody.system.system import System

# -- Objectives and limits of an optimization, read from text, and as rows with derivatives ----

_SIGN = re.compile(r"<=|>=|==|[=<>≤≥]")
#: A reduction that is kept below a bound where every instant is, and one above.
GREATEST, SMALLEST = ("max", "peak"), ("min",)


@dataclass(frozen=True)
class AimRows:
    """Numbers with derivatives.

    `values` (rows,)
    `derivatives` (rows, numbers)
    `instants` (rows,): Which instant each is of; -1 where all count.
    """

    values: np.ndarray
    derivatives: np.ndarray
    instants: np.ndarray

    def times(self, factor: float) -> AimRows:
        """All multiplied by a number."""
        return AimRows(factor * self.values, factor * self.derivatives, self.instants)

    def minus(self, other: AimRows) -> AimRows:
        """The difference, of rows or of all with the one row of the other."""
        of_self = len(self.values) >= len(other.values)
        return AimRows(
            self.values - other.values,
            self.derivatives - other.derivatives,
            self.instants if of_self else other.instants,
        )


def _rows(column: MeasuredColumn, at: Evaluation, every: bool) -> AimRows:
    """A quantity in one row, or in a row an instant (two of ± where it is a peak)."""
    value, derivative = at.history(column.measure)
    count = np.arange(len(value))
    if not column.by and (value == value[0]).all() and (derivative == derivative[0]).all():
        return AimRows(value[:1], derivative[:1], np.array([-1]))  # the same at all instants
    if every and (not column.by or column.by in (*GREATEST, *SMALLEST)):
        rows = AimRows(value, derivative, count)
        if column.by != "peak":
            return rows
        both = np.concatenate
        return AimRows(both([value, -value]), both([derivative, -derivative]), both([count, count]))
    if column.by in (*GREATEST, *SMALLEST):
        size = {"peak": np.abs(value), "max": value, "min": -value}[column.by]
        k = int(size.argmax())
        sign = -1.0 if column.by == "peak" and value[k] < 0.0 else 1.0
        return AimRows(sign * value[[k]], sign * derivative[[k]], count[[k]])
    if column.by in ("first", "last", "at"):
        k = {"first": 0, "last": -1, "at": column.instant}[column.by]
        return AimRows(value[[k]], derivative[[k]], count[[k]])
    if column.by == "rms":
        square, t = np.square(value), _times(at)
        root = float(np.sqrt(mean_over(square, t.value)))
        derivative_of_root = mean_derivative(0.5 * square, value[:, None] * derivative, t) / max(
            root, TINY
        )
        return AimRows(np.array([root]), derivative_of_root[None], np.array([-1]))
    if column.by == "span":
        high, low = int(value.argmax()), int(value.argmin())
        return AimRows(
            value[[high]] - value[low], derivative[[high]] - derivative[low], np.array([-1])
        )
    if column.by == "integral":
        t = _times(at)
        check_times(column.by, t.value)
        row = integral_derivative(value, derivative, t)
        return AimRows(np.trapezoid(value, t.value, axis=0)[None], row[None], np.array([-1]))
    if column.by == "mean":
        t = _times(at)
        row = mean_derivative(value, derivative, t)
        return AimRows(mean_over(value, t.value)[None], row[None], np.array([-1]))
    return AimRows(value, derivative, count)


def _times(at: Evaluation) -> DualNumber:
    """The instants [s], with their derivatives where they move."""
    return DualNumber(*at.history(Measure("t", "s")))


@dataclass(frozen=True)
class Aim:
    """A quantity that is to be least, or greatest."""

    text: str
    column: MeasuredColumn
    greatest: bool

    @property
    def each(self) -> bool:
        """Whether the worst of several instants decides: its rows are smooth, it is not."""
        return self.column.by in (SMALLEST if self.greatest else GREATEST)

    @property
    def squared(self) -> bool:
        """Whether it is a root of squares to be least, whose square bends as a quadratic does."""
        return self.column.by == "rms" and not self.greatest

    @property
    def sign(self) -> float:
        """By what it is multiplied to be least."""
        return -1.0 if self.greatest else 1.0

    def rows(self, at: Evaluation) -> AimRows:
        """AimRows of which the greatest is to be least."""
        return _rows(self.column, at, self.each).times(self.sign)

    def value(self, at: Evaluation) -> float:
        """The quantity itself."""
        return float(_rows(self.column, at, False).values[0])


@dataclass(frozen=True)
class Limit:
    """A constraint: left ≤ right, or left = right."""

    text: str
    left: MeasuredColumn
    right: MeasuredColumn
    equal: bool
    unit: str

    def rows(self, at: Evaluation) -> AimRows:
        """right − left: all rows are not to be negative, or are to be zero."""
        if self.equal:
            return _rows(self.right, at, False).minus(_rows(self.left, at, False))
        low = _rows(self.left, at, self.left.by in (*GREATEST, ""))
        high = _rows(self.right, at, self.right.by in (*SMALLEST, ""))
        if len(low.values) > 1 and len(high.values) > 1 and (self.left.by or self.right.by):
            low = _rows(self.left, at, False)
        return high.minus(low)

    def margin(self, at: Evaluation) -> float:
        """By how much it holds; negative where it is broken."""
        values = self.rows(at).values
        return -float(np.abs(values).max()) if self.equal else float(values.min())


def aim_of(mechanism: Mechanism, given: object, greatest: bool, instants: int) -> Aim:
    """Objective to be minimized or maximized."""
    (column,) = columns_of(mechanism, [given], "optimize")  # type: ignore[list-item]
    _check_instant(column, instants)
    if not column.by and instants > 1:
        verb = "maximize" if greatest else "minimize"
        raise ModelError(
            f"optimize: '{column.name}' is a history of {instants} instants: say what of it is to "
            f'be {"greatest" if greatest else "least"}, such as {verb}="peak({column.name})"'
        )
    return Aim(column.name, column, greatest)


def limit_of(mechanism: Mechanism, text: object, instants: int) -> Limit:
    """Constraint from text such as ``"peak(motor.effort) <= 20 N*m"``."""
    wanted = "a limit such as 'peak(motor.effort) <= 20 N*m'"
    if not isinstance(text, str):
        raise ModelError(f"optimize: subject_to takes texts, not {brief(text)}")
    signs = _SIGN.findall(text)
    if len(signs) != 1:
        raise ModelError(f"optimize: {brief(text, 100)} is not {wanted}")
    left, right = (part.strip() for part in text.split(signs[0]))
    if not left or not right:
        raise ModelError(f"optimize: {brief(text, 100)} is not {wanted}: a side of it is empty")
    if signs[0] in (">", ">=", "≥"):
        left, right = right, left
    columns = [_side(mechanism, side) for side in (left, right)]
    dimension = checked_sides(mechanism, text, *(one.measure.of for one in columns))
    equal = signs[0] in ("=", "==")
    for column in columns:
        _check_instant(column, instants)
        if equal and not column.by and instants > 1 and _moves(mechanism, column):
            raise ModelError(
                f"optimize: '{text}': '{column.name}' is a history of {instants} instants, which "
                f"cannot be equal to a number at all: name one, such as first({column.name})"
            )
    unit = mechanism.units.of(dimension)
    return Limit(text, columns[0], columns[1], equal, unit)


def _side(mechanism: Mechanism, text: str) -> MeasuredColumn:
    """A side of a limit, in the units of the mechanism."""
    (column,) = columns_of(mechanism, [text], "optimize")
    plain = Measure(column.measure.of)
    check_measure(mechanism, plain)
    return replace(column, measure=plain)


def _moves(mechanism: Mechanism, column: MeasuredColumn) -> bool:
    """Whether a quantity has more than constants in it."""
    words = set(re.findall(r"[A-Za-z_][\w.]*", column.measure.of))
    return any(word.partition(".")[0] in mechanism for word in words)


def _check_instant(column: MeasuredColumn, instants: int) -> None:
    if column.by == "at" and not -instants <= column.instant < instants:
        raise ModelError(
            f"optimize: '{column.name}': there is no such instant, they are 0 to {instants - 1}"
        )


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
