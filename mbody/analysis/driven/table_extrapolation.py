"""Tables, and curves of formulas, that a result has gone beyond: by how far, and since when."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from mbody.analysis.driven.curve_extrapolation import curve_doubts
from mbody.analysis.driven.range_doubts import MARGIN, range_doubt
from mbody.laws import Table
from mbody.model.element import Element
from mbody.model.mechanism import Mechanism
from mbody.quantities.units import dimension_of
from mbody.solution.doubts import Doubt
from mbody.solution.load_histories import argument, argument_rate
from mbody.solution.solution import Solution

__all__ = ["extrapolated", "open_tables"]

Array = np.ndarray


def extrapolated(solution: Solution) -> list[Doubt]:
    """A doubt for each table or curve that was evaluated outside the range of its points.

    Laws of time, and of the stretch, twist or rate of springs and dampers, are examined at the
    kept instants; of a free motion the argument is followed between them too, by the cubic through
    its values and rates.
    """
    found, system = [], solution.system
    tables = system.once("open tables", lambda: tuple(open_tables(solution.mechanism)))
    for element, field, table in tables:
        if solution.given is not None and any(d is element for d in solution.system.drivers):
            continue  # its motion was given instead of the law
        x = argument(solution, element, field)
        if x is None:
            continue
        x, t = np.atleast_2d(x), solution.t
        low, high = float(table.x[0]), float(table.x[-1])
        margin = MARGIN * (high - low)
        rate = argument_rate(solution, element, field) if solution.analysis == "simulate" else None
        if rate is not None and len(t) > 1:
            within = _between(t, x[0], np.asarray(rate))
            x, t = np.concatenate([x[0], within[1]])[None], np.concatenate([t, within[0]])
        beyond = ((x < low - margin) | (x > high + margin)).any(axis=0)
        if beyond.any():
            since = float(t[beyond].min())
            if solution.analysis == "simulate" and _of_time(element, field):
                since = float(t[0]) if t[0] < low - margin else max(float(t[0]), high)
            met = float(x.min()), float(x.max()), since
            of = dimension_of(element.__dataclass_fields__[field].metadata["of"])
            what, units = (element.name, f"the table of its {field}"), solution.mechanism.units
            found.append(range_doubt(units, what, table.x, of, table.outside, met))
    return [*found, *curve_doubts(solution)]


def open_tables(mechanism: Mechanism) -> Iterator[tuple[Element, str, Table]]:
    """Tables that give numbers outside the range of their points."""
    for element in (*mechanism.drivers, *mechanism.loads):
        for field in dataclasses.fields(element):
            law = getattr(element, field.name)
            if isinstance(law, Table) and not law.periodic and law.outside != "error":
                yield element, field.name, law


def _of_time(element: Element, field: str) -> bool:
    return bool(element.__dataclass_fields__[field].metadata["of"] == "time")


def _between(t: Array, x: Array, rate: Array) -> tuple[Array, Array]:
    """Times within the intervals, and the cubic through values and rates of both ends there."""
    s = np.linspace(0.0, 1.0, 10)[1:-1, None]
    step = np.diff(t)
    a, b = x[:-1], x[1:]
    u, v = step * rate[:-1], step * rate[1:]
    cubic = a + s * (u + s * (3.0 * (b - a) - 2.0 * u - v + s * (2.0 * (a - b) + u + v)))
    return (t[:-1] + s * step).ravel(), cubic.ravel()
