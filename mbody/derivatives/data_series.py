"""Measured histories for a fit: columns that say the instants, columns that are measured, units."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.files.measured_data import measured_data
from mbody.model.element import listed
from mbody.model.numbers import number_in
from mbody.model.study import Measure
from mbody.solution.measures import check_measure
from mbody.system.system import System

__all__ = ["DataSeries", "series_of", "split_heading"]

#: Endings of the columns that say how a driver moves.
MOTION = ("", ".rate", ".acceleration")
DIMENSIONS = {
    True: ("angle", "angular velocity", "angular acceleration"),
    False: ("length", "velocity", "acceleration"),
}


@dataclass(frozen=True, eq=False)
class DataSeries:
    """The data of one run.

    Attributes
    ----------
    instants : dict
        Arguments of the analysis: ``t``, or ``drive``.
    measures : dict of Measure
        By column.
    values : array (columns, instants)
        NaN where nothing was measured.
    known : dict
        Numbers that were others in this run.
    """

    instants: dict[str, Any]
    measures: dict[str, Measure]
    values: np.ndarray
    known: dict[str, float]


def series_of(system: System, given: Any, free: bool) -> list[DataSeries]:
    """The runs of the data; `free` where it is a motion over time, of `simulate`.

    Raises
    ------
    ModelError
        For data without instants or without measured columns, columns of different lengths, and
        names or units that do not fit.
    """
    several = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    if not several:
        raise ModelError("fit: there are no data: give columns by name, or a CSV file")
    found = [_one(system, one, free) for one in several]
    first = list(found[0].measures)
    for n, one in enumerate(found[1:], 2):
        if list(one.measures) != first:
            raise ModelError(
                f"fit: run {n} has the columns {listed(one.measures)}, run 1 {listed(first)}: give "
                "each the same, in the same order; NaN is no datum"
            )
    return found


def _one(system: System, given: Any, free: bool) -> DataSeries:
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
        of, unit = split_heading(name)
        if name in used:
            continue
        own = system.mechanism.measures.get(of)
        measures[of] = Measure(of if own is None else own.of, unit or (own.unit if own else ""))
        check_measure(system.mechanism, measures[of])
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
    drivers = {one.name: one for one in system.leaders}
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
