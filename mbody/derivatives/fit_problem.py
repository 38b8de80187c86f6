"""Data less fit of measured histories, with derivatives by the unknowns."""

from __future__ import annotations

import functools
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import requested_instants
from mbody.analysis.dynamics.simulate import simulate
from mbody.core.tolerances import DIFFERENCE_STEP_NUMBERS, RTOL_FINE, TINY
from mbody.derivatives.driven_instants import DrivenInstants, misfitting
from mbody.derivatives.dual_solution import DualRecord, DualWorkspace, dual_solution
from mbody.derivatives.gradient import gradient
from mbody.derivatives.named_numbers import checked_names, dual_values, recorded_numbers, unit_of
from mbody.derivatives.reduced_measures import (
    MeasureProgram,
    derived,
    instants_of,
    recorded_measure,
)
from mbody.errors import ModelError, SolveError, brief
from mbody.files.tables import measured_data
from mbody.model.element import listed, takes_one_design
from mbody.model.numbers import number_in
from mbody.model.study import Measure
from mbody.solution.measures import check_measure, measured
from mbody.solution.solution import Solution
from mbody.sweeps.job import Measures, columns_of
from mbody.system.system import System

# -- Measures and their derivatives for many sets of numbers, without assembling anew ----------


class PreparedGradient:
    """Measures of one system by some of its numbers, prepared for many sets of these.

    `system`: Of one design.
    `measure`, `by`, `analysis`: As of `mbody.gradient`.
    `**options`: The instants, as of `mbody.gradient`.

    `names`: Dotted names of the numbers, in the order of the arrays.
    `measures`: Names of the measures.
    `start` (names,): The numbers that the system has.
    `spaces`: Workspaces that are free.

    Examples
    --------
    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    >>> prepared = PreparedGradient(system, "peak(A.force)", ["crank.A.x"], turn="motor")
    >>> design = prepared.at([5.25])
    >>> float(design.value[0].round(3)), float(design.jacobian[0, 0].round(3))
    (231.228, 325.526)
    """

    def __init__(
        self,
        system: System,
        measure: Measures | None,
        by: Sequence[str] | str | None,
        analysis: str = "kinetostatics",
        **options: Any,
    ) -> None:
        takes_one_design("gradient", system.batch)
        self.system = system
        self.given = checked_names(system, by)
        self.names = tuple(self.given.values())
        self.columns = columns_of(system.mechanism, measure, "gradient")
        self.measures = tuple(column.name for column in self.columns)
        self.start = np.array([float(system.values[name]) for name in self.names])
        self.wanted = requested_instants(system, analysis, options, "gradient")
        machine, parameters = system.mechanism, system.mechanism.parameters
        self._recorded = recorded_numbers(system)
        self._signs = {name: system.rule(name)[0] for name in self.names}
        self._programs: list[MeasureProgram | None] | None = None
        self._misfits: set[str] | None = None
        self.spaces: list[DualWorkspace] = []
        # what formulas make of the numbers, and what joints and contacts refuse, is Python
        self._plain = (
            self._recorded is None
            or not self._recorded.has(self.names)
            or any(name in parameters for name in self.names)
            or bool(machine.contacts or machine.groups)
        )

    def at(self, numbers: Any) -> DesignPoint:
        """The design of other numbers, (names,): its measures, and their derivatives when read.

        Raises ModelError for numbers that are refused.
        Raises SolveError as of the analysis, where the design does not close.
        """
        numbers = np.array(numbers, dtype=np.float64)
        if numbers.shape != self.start.shape:
            raise ModelError(
                f"gradient: {len(self.start)} numbers are needed, not an array of the shape "
                f"{numbers.shape}"
            )
        system, tangents = self._system_of(numbers)
        return DesignPoint(self, numbers, self.wanted.analysed(system), tangents)

    def programs(self, run: Solution, record: DualRecord) -> list[MeasureProgram | None]:
        """Of every measure its operations, recorded once."""
        if self._programs is None:
            self._programs = [
                recorded_measure(run, record, column.measure, self.names) for column in self.columns
            ]
        return self._programs

    def misfits(self, run: Solution, record: DualRecord) -> set[str]:
        """Numbers that alone would move wheels apart; which they are does not change."""
        if self._misfits is None:
            spaced = any(joint.spaced for joint in self.system.mechanism.joints)
            own = dual_values(run.system, self.names) if spaced else {}
            found = misfitting(dual_solution(run, own, record), self.names) if spaced else set()
            self._misfits = found
        return self._misfits

    def _system_of(self, numbers: np.ndarray) -> tuple[System, Any]:
        """The system with these numbers, and derivatives of the kernels' numbers where they came
        with them.
        """
        given = dict(zip(self.names, numbers.tolist(), strict=True))
        recorded = self._recorded
        allowed = all(map(self._allowed, given, given.values()))
        if recorded is None or self._plain or not allowed:
            return self.system.with_values(given), None
        values = {**self.system.values, **given}
        found, derivatives = recorded.evaluated(values, self.names)
        rows = len(self.system.par)
        system = replace(
            self.system,
            values=values,
            formulas={n: f for n, f in self.system.formulas.items() if n not in given},
            par=found[:rows, None],
            mass=found[rows:, None],
        )
        return system, (derivatives[:rows], derivatives[rows:])

    def _allowed(self, name: str, number: float) -> bool:
        """Whether a number is what its field requires; the sentence is that of `with_values`."""
        sign = self._signs[name]
        least = 0.0 if sign else -math.inf
        return math.isfinite(number) and number >= least and not (sign == "positive" and not number)


class DesignPoint:
    """One design of a `PreparedGradient`.

    `numbers` (names,)
    `run`: The result of the analysis.
    `value` (measures,), or (measures, instants) of histories
    """

    def __init__(
        self, prepared: PreparedGradient, numbers: np.ndarray, run: Solution, tangents: Any
    ) -> None:
        self.prepared, self.numbers, self.run, self._tangents = prepared, numbers, run, tangents
        self._choices = [instants_of(run, column) for column in prepared.columns]
        self.value = np.array([choice.value for choice in self._choices])

    @functools.cached_property
    def jacobian(self) -> np.ndarray:
        """Derivatives of the measures by the numbers: (measures, names), or (measures, instants,
        names); NaN by numbers with which alone redundant loops do not close.

        Raises ModelError for a measure that has no derivatives.
        """
        prepared, choices = self.prepared, self._choices
        instants = DrivenInstants(
            self.run, prepared.names, prepared.wanted.revolving, self._tangents, prepared.spaces
        )
        deciding = [one.needed[:1] if one.single else one.needed for one in choices]
        # those of one measure are in order
        needed = deciding[0] if len(deciding) == 1 else np.unique(np.concatenate(deciding))
        record = instants.rows_at(needed, any(one.loads for one in choices))
        programs = prepared.programs(self.run, record)
        rows, whole = [], None
        for column, choice, program in zip(prepared.columns, choices, programs, strict=True):
            if choice.single and program is not None:
                first = choice.needed[0]
                place = 0 if needed[0] == first else int(np.searchsorted(needed, first))
                values = self.run.system.values
                found, row = program.evaluated(record, place, values, prepared.names)
                rows.append(-row if column.by == "peak" and found < 0.0 else row)
                continue
            if whole is None:
                own = dual_values(self.run.system, prepared.names)
                whole = dual_solution(self.run, own, record)
            only = replace(choice, needed=choice.needed[:1]) if choice.single else choice
            rows.append(derived(whole, needed, column, only).row)
        jacobian = np.array(rows)
        gone = instants.unclosed | prepared.misfits(self.run, record)
        without = [n for n, name in enumerate(prepared.names) if name in gone] if gone else []
        if without:
            jacobian[..., without] = np.nan
        return jacobian


# -- Measured histories for a fit: columns of instants, of measured quantities, units ----------

#: Endings of the columns that say how a driver moves.
MOTION = ("", ".rate", ".acceleration")
DIMENSIONS = {
    True: ("angle", "angular velocity", "angular acceleration"),
    False: ("length", "velocity", "acceleration"),
}


@dataclass(frozen=True, eq=False)
class DataSeries:
    """The data of one run.

    `instants`: Arguments of the analysis: ``t``, or ``drive``.
    `measures`: By column.
    `values` (columns, instants): NaN where nothing was measured.
    `known`: Numbers that were others in this run.
    """

    instants: dict[str, Any]
    measures: dict[str, Measure]
    values: np.ndarray
    known: dict[str, float]


def series_of(system: System, given: Any, free: bool) -> list[DataSeries]:
    """The runs of the data; `free` where it is a motion over time, of `simulate`."""
    several = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    if not several:
        raise ModelError("fit: there are no data: give columns by name, or a CSV file")
    found = [_data_series(system, one, free) for one in several]
    first = list(found[0].measures)
    for n, one in enumerate(found[1:], 2):
        if list(one.measures) != first:
            raise ModelError(
                f"fit: run {n} has the columns {listed(one.measures)}, run 1 {listed(first)}: give "
                "each the same, in the same order; NaN is no datum"
            )
    return found


def _data_series(system: System, given: Any, free: bool) -> DataSeries:
    if isinstance(given, str | os.PathLike):
        given = measured_data(given)
    if not isinstance(given, Mapping):
        raise ModelError(
            'fit: data are columns by name, such as {"t": […], "slider.x [mm]": […]}, or a CSV '
            f"file, not {brief(given)}"
        )
    known = {name: value for name, value in given.items() if np.ndim(value) == 0}
    columns = {name: _column(name, value) for name, value in given.items() if name not in known}
    sizes = {name: len(column) for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        text = ", ".join(f"{size} of '{name}'" for name, size in sizes.items())
        raise ModelError(f"fit: there are {text}: give as many values of each column")
    plain = {split_heading(name)[0]: name for name in columns}
    instants, used = _instants(system, columns, plain, free)
    measures, rows = {}, []
    for name, column in columns.items():
        quantity, unit = split_heading(name)
        if name in used:
            continue
        own = system.mechanism.measures.get(quantity)
        measures[quantity] = Measure(
            quantity if own is None else own.of, unit or (own.unit if own else "")
        )
        check_measure(system.mechanism, measures[quantity])
        rows.append(column)
    if not rows:
        raise ModelError("fit: the data have no measured column beside the instants")
    for name in known:
        system.with_values({name: known[name]})
    return DataSeries(instants, measures, np.array(rows), known)


def _column(name: Any, value: Any) -> np.ndarray:
    try:
        column = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        column = np.zeros((0, 0))
    if column.ndim != 1 or not len(column):
        raise ModelError(f"fit: column {brief(name)} must be a row of numbers, not {brief(value)}")
    if np.isinf(column).any():
        raise ModelError(f"fit: column '{name}' has an infinite value: NaN is no datum", str(name))
    return column


def split_heading(name: str) -> tuple[str, str]:
    """Name and unit of a heading such as "slider.x [mm]"."""
    match = re.fullmatch(r"\s*(.*?)\s*(?:\[([^\]]*)\])?\s*", str(name))
    assert match is not None
    return match[1], match[2] or ""


def _instants(
    system: System, columns: Mapping[str, np.ndarray], plain: Mapping[str, str], free: bool
) -> tuple[dict[str, Any], set[str]]:
    """Arguments that say the instants, and the columns that they are from."""
    drivers = {one.name: one for one in system.independent_drivers}
    if "t" in plain:
        t = _converted(system, columns, plain["t"], "time")
        if free and ((np.diff(t) <= 0.0).any() or t[0] < 0.0):
            raise ModelError(
                "fit: the times of a free motion must rise from 0 on: sort the data, or begin "
                "where the motion does"
            )
        return {"t": t}, {plain["t"]}
    if free or not drivers or not all(name in plain for name in drivers):
        wanted = f", or of all drivers: {listed(drivers)}" if drivers and not free else ""
        raise ModelError(
            f"fit: the data do not say their instants: give a column t{wanted} (there are: "
            f"{listed(columns)})"
        )
    drive, used = {}, set()
    for name, driver in drivers.items():
        kinds = DIMENSIONS[bool(getattr(driver, "angular", False))]
        there = [(f"{name}{end}", kind) for end, kind in zip(MOTION, kinds, strict=True)]
        parts = [
            _converted(system, columns, plain[key], kind) if key in plain else None
            for key, kind in there
        ]
        if parts[1] is None and parts[2] is not None:
            raise ModelError(
                f"fit: the data have '{name}.acceleration' and no '{name}.rate': give both", name
            )
        drive[name] = tuple(part for part in parts if part is not None)
        used |= {plain[key] for key, _ in there if key in plain}
    return {"drive": drive}, used


def _converted(
    system: System, columns: Mapping[str, np.ndarray], name: str, dimension: str
) -> np.ndarray:
    """A column that says instants, in the units of the mechanism."""
    key, unit = split_heading(name)
    column = columns[name]
    if not np.isfinite(column).all():
        raise ModelError(f"fit: column '{key}' says the instants and has gaps: leave them out", key)
    factor = number_in(system.mechanism, f"1 {unit}", dimension, key, "unit") if unit else 1.0
    return np.asarray(column * factor)


# -- Predicted histories of the measured quantities for other numbers --------------------------

Array = np.ndarray


class DrivenPrediction:
    """Histories of a driven analysis with exact derivatives."""

    exact = True
    #: The result with the last numbers.
    run: Solution

    def __init__(
        self,
        system: System,
        series: DataSeries,
        names: Sequence[str],
        analysis: str,
        options: Mapping[str, Any],
    ) -> None:
        own = system.with_values(series.known) if series.known else system
        self.shape = series.values.shape
        how = {**options, **series.instants}
        self.prepared = PreparedGradient(own, dict(series.measures), names, analysis, **how)

    def at(self, numbers: Array) -> tuple[Array, Any]:
        """Values (columns, instants), and what makes derivatives of them."""
        point = self.prepared.at(numbers)
        self.run = point.run
        return point.value.reshape(self.shape), point

    def jacobian(self, point: Any) -> Array:
        """Derivatives (columns, instants, numbers)."""
        return np.asarray(point.jacobian.reshape(*self.shape, -1))


class FreePrediction:
    """Histories of `simulate`, with exact derivatives where there are, else differences."""

    #: The result with the last numbers.
    run: Solution

    def __init__(
        self, system: System, series: DataSeries, names: Sequence[str], options: Mapping[str, Any]
    ) -> None:
        self.system = system.with_values(series.known) if series.known else system
        self.names, self.measures = list(names), dict(series.measures)
        self.shape = series.values.shape
        t = series.instants["t"]
        # a motion has its beginning, whether it was measured or not
        self.first = 0 if t[0] == 0.0 else 1
        times = t if self.first == 0 else np.concatenate([[0.0], t])
        self.options = {"rtol": RTOL_FINE, **options, "until": float(t[-1]), "times": times}
        lengths = max(self.system.length, TINY)
        self.sizes = np.array(
            [abs(float(self.system.values[name])) or lengths for name in self.names]
        )
        try:
            self.exact = bool(np.isfinite(self._gradient(self.system)).all())
        except (ModelError, SolveError):
            # methods and beginnings whose motions have no derivatives
            self.exact = False
        self.least = np.array([0.0 if self.system.rule(n)[0] else -np.inf for n in self.names])

    def at(self, numbers: Array) -> tuple[Array, Any]:
        """Values (columns, instants), and where they are."""
        return self._histories(numbers[None, :])[:, 0], numbers

    def jacobian(self, numbers: Any) -> Array:
        """Derivatives (columns, instants, numbers)."""
        if self.exact:
            values = dict(zip(self.names, numbers.tolist(), strict=True))
            found = self._gradient(self.system.with_values(values))
            # NaN where changes of modes have no derivative
            if np.isfinite(found).all():
                return found
        return self._differences(numbers)

    def _gradient(self, system: System) -> Array:
        found = gradient(system, self.measures, self.names, "simulate", **self.options).jacobian
        return np.asarray(found.reshape(len(self.measures), -1, len(self.names))[:, self.first :])

    def _differences(self, numbers: Array) -> Array:
        """By two differences each; where a number may not be less, to one side, of second order
        too.
        """
        count = len(numbers)
        steps = DIFFERENCE_STEP_NUMBERS * np.maximum(np.abs(numbers), self.sizes)
        one_sided = numbers - steps < self.least
        low = np.where(one_sided, 2.0, -1.0)
        here = np.repeat(numbers[None, :], 2 * count + 1, axis=0)
        for k in range(count):
            here[2 * k, k] += steps[k]
            here[2 * k + 1, k] += low[k] * steps[k]
        found = self._histories(here)
        middle = found[:, -1]
        parts = []
        for k in range(count):
            ahead, other = found[:, 2 * k], found[:, 2 * k + 1]
            if one_sided[k]:
                parts.append((4.0 * ahead - other - 3.0 * middle) / (2.0 * steps[k]))
            else:
                parts.append((ahead - other) / (2.0 * steps[k]))
        return np.stack(parts, axis=-1)

    def _histories(self, designs: Array) -> Array:
        """(columns, designs, instants)."""
        found = np.empty((len(self.measures), len(designs), *self.shape[1:]))
        for n, design in enumerate(designs.tolist()):
            system = self.system.with_values(dict(zip(self.names, design, strict=True)))
            self.run = run = simulate(system, **self.options)
            if run.t[-1] < self.options["until"]:
                unit = run.mechanism.units.time
                raise SolveError(
                    f"fit: the motion is {run.status}, at t = {run.t[-1]:.6g} {unit}, data go on "
                    f"to {self.options['until']:.6g} {unit}: leave out those that come later"
                )
            for row, measure in zip(found, self.measures.values(), strict=True):
                row[n] = measured(run, measure)[0][self.first :]
        return found


class FitProblem:
    """Residuals of all runs, with their derivatives."""

    def __init__(
        self,
        system: System,
        series: Sequence[DataSeries],
        names: Mapping[str, str],
        analysis: str,
        offsets: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        self.system, self.series = system, series
        self.names = own = list(names.values())
        self.runs: list[Any] = [
            FreePrediction(system, one, own, options)
            if analysis == "simulate"
            else DrivenPrediction(system, one, own, analysis, options)
            for one in series
        ]
        self.exact = all(run.exact for run in self.runs)
        self.start = np.array([float(system.values[name]) for name in own])
        self.columns = list(series[0].measures)
        self.units = {
            name: check_measure(system.mechanism, one) for name, one in series[0].measures.items()
        }
        self.masks = [np.isfinite(one.values) for one in series]
        self.count = sum(int(mask.sum()) for mask in self.masks)
        self.shifts = self._shifts(offsets)
        self.evaluations = 0
        self._last: tuple[bytes, list[Any]] | None = None

    def column(self, given: Any, what: str) -> str:
        """The name of a column that is named by it or by its heading, "slider.x [mm]"; what is
        given of it, such as "an offset", is in the sentence where there is no such column.
        """
        for name in (split_heading(given)[0] if isinstance(given, str) else given, given):
            if name in self.columns:
                return str(name)
        raise ModelError(
            f"fit: there is no column {brief(given)} with {what} (there are: "
            f"{listed(self.columns)})",
            str(given),
        )

    def _shifts(self, offsets: Sequence[str]) -> dict[str, tuple[int, str]]:
        """Names of the offsets, and the run and column of each."""
        given = [offsets] if isinstance(offsets, str) else list(offsets)
        wanted = [self.column(name, "an offset") for name in given]
        several = len(self.series) > 1
        return {
            _shift(name, n + 1 if several else 0): (n, name)
            for name in wanted
            for n in range(len(self.series))
        }

    def _predictions(self, numbers: Array) -> list[Any]:
        """Histories of all runs, and what makes their derivatives; those of the last numbers are
        kept.
        """
        key = numbers.tobytes()
        if self._last is None or self._last[0] != key:
            own = numbers[: len(self.start)]
            self._last = key, [run.at(own) for run in self.runs]
            self.evaluations += 1
        return self._last[1]

    def results(self, numbers: Array) -> list[Solution]:
        """The results of all runs."""
        for run in self.runs:
            run.at(numbers[: len(self.start)])
        return [run.run for run in self.runs]

    def histories(self, numbers: Array) -> list[Array]:
        """Data less fit of every run, (columns, instants)."""
        found = []
        for n, (values, _) in enumerate(self._predictions(numbers)):
            values = values.copy()
            for k, (run, name) in enumerate(self.shifts.values()):
                if run == n:
                    values[self.columns.index(name)] += numbers[len(self.start) + k]
            found.append(self.series[n].values - values)
        return found

    def residual(self, numbers: Array, sigma: Array) -> Array:
        """Fit less data by the deviations of the columns, all in a row."""
        parts = [
            (-left / sigma[:, None])[mask]
            for left, mask in zip(self.histories(numbers), self.masks, strict=True)
        ]
        return np.concatenate(parts)

    def jacobian(self, numbers: Array, sigma: Array) -> Array:
        """Its derivatives, (data, unknowns)."""
        rows = []
        for n, (_, point) in enumerate(self._predictions(numbers)):
            own = self.runs[n].jacobian(point)
            shifts = np.zeros((*own.shape[:2], len(self.shifts)))
            for k, (run, name) in enumerate(self.shifts.values()):
                if run == n:
                    shifts[self.columns.index(name), :, k] = 1.0
            whole = np.concatenate([own, shifts], axis=-1) / sigma[:, None, None]
            rows.append(whole[self.masks[n]])
        return np.concatenate(rows)

    def sizes(self, numbers: Array) -> tuple[Array, Array]:
        """Sum of squares and number of the residuals of each column."""
        squares, counts = np.zeros(len(self.columns)), np.zeros(len(self.columns))
        for left, mask in zip(self.histories(numbers), self.masks, strict=True):
            squares += np.square(np.where(mask, left, 0.0)).sum(axis=1)
            counts += mask.sum(axis=1)
        return squares, counts

    def number_sizes(self, numbers: Array) -> Array:
        """Sizes of the unknowns, of lengths that of the mechanism at least; 1 of what is zero."""
        first = np.concatenate([self.start, np.zeros(len(self.shifts))])
        sizes = np.maximum(np.abs(numbers), np.abs(first))
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        unit = self.system.mechanism.units.length
        lengths = np.array(
            [unit_of(self.system.mechanism, name) == unit for name in self.names]
            + [self.units[column] == unit for _, column in self.shifts.values()]
        )
        return np.where(lengths, np.maximum(sizes, self.system.length), sizes)

    def data_size(self, sigma: Array) -> float:
        """Norm of all data by the deviations of the columns."""
        parts = [
            (one.values / sigma[:, None])[mask]
            for one, mask in zip(self.series, self.masks, strict=True)
        ]
        return float(np.linalg.norm(np.concatenate(parts)))

    def ranges(self) -> Array:
        """Range of the data of each column."""
        rows = [
            np.concatenate([one.values[k] for one in self.series]) for k in range(len(self.columns))
        ]
        return np.array([max(np.nanmax(np.abs(row)), TINY) for row in rows])


def _shift(column: str, run: int) -> str:
    """The name of an offset, of the one run or of several."""
    return f"{column} offset, run {run}" if run else f"{column} offset"
