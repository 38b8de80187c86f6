"""Tables and curves that a result has gone beyond: by how far, and since when."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import TABLE_RANGE_MARGIN
from mbody.laws import MeasuredFormula, Table, Table2
from mbody.model.element import Element
from mbody.model.loads.tyre import Tyre
from mbody.model.mechanism import Mechanism
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, dimension_of
from mbody.solution.histories import column
from mbody.solution.solution import Solution

if TYPE_CHECKING:
    from mbody.model.curves import NamedCurve
    from mbody.solution.doubts import Doubt

#: What holds beyond the points.
INSTEAD = {"hold": "the value at its end", "line": "the tangent at its end"}


def range_doubt(
    units: UnitSystem,
    what: tuple[str, str],
    points: Any,
    dimension: Dimension | None,
    outside: str,
    met: tuple[float, float, float],
) -> Doubt:
    """The doubt."""
    from mbody.solution.doubts import Doubt

    name, table = what
    low, high, since = met
    unit, size = (units.of(dimension), 1.0) if dimension is not None else ("", 1.0)
    if dimension == DIMENSIONS["angle"]:
        unit, size = "deg", float(np.degrees(1.0))
    has = f"{size * points[0]:.6g} to {size * points[-1]:.6g} {unit}".rstrip()
    went = f"{size * low:.6g} to {size * high:.6g} {unit}".rstrip()
    return Doubt(
        "extrapolation",
        f"'{name}': {table} covers {has}, this result goes from {went} and takes "
        f"{INSTEAD[outside]} beyond it, from t = {since:.6g} {units.time} on: add points to the "
        f"{'curve' if 'curve' in table else 'table'}",
        since,
        (name,),
    )


# -- Curves that formulas call beyond their points: by how far, and since when -----------------

Array = np.ndarray

#: What the numbers that a curve of two variables takes are called.
NTH = ("the first number of ", "the second number of ")


def open_curves(mechanism: Mechanism) -> Iterator[tuple[Any, str, MeasuredFormula]]:
    """Formulas of loads and states that call curves which give numbers beyond their points."""
    known = {name for name, curve in mechanism.curves.items() if _ranges(curve)}
    for element in (*mechanism.loads, *mechanism.states) if known else ():
        for field in dataclasses.fields(element):
            law = getattr(element, field.name)
            if isinstance(law, MeasuredFormula) and known.intersection(law.operations):
                yield element, field.name, law


def curve_doubts(solution: Solution) -> list[Doubt]:
    """A doubt for each curve that a formula of an element called beyond its points, at the kept
    instants.
    """
    units, found, record = solution.mechanism.units, [], solution.record
    shape = (record.count if record.batch else 1, len(solution.t))
    machine = solution.mechanism
    curves = solution.system.once("open curves", lambda: tuple(open_curves(machine)))
    for element, field, law in curves:
        for curve, arguments in _calls(solution, element, field, law):
            for place, (points, outside) in enumerate(_ranges(curve.curve)):
                x = np.broadcast_to(arguments[place], shape)
                margin = TABLE_RANGE_MARGIN * (points[-1] - points[0])
                beyond = ((x < points[0] - margin) | (x > points[-1] + margin)).any(axis=0)
                if not beyond.any():
                    continue
                met = float(np.nanmin(x)), float(np.nanmax(x)), float(solution.t[beyond].min())
                nth = NTH[place] if len(arguments) > 1 else ""
                what = element.name, f"{nth}the curve '{curve.name}'"
                found.append(
                    range_doubt(units, what, points, curve.curve.takes[place], outside, met)
                )
    return list({(one.message): one for one in found}.values())


def _ranges(curve: NamedCurve) -> list[tuple[Any, str]]:
    """Of each number that a curve takes the places of its points, and what holds beyond them;
    nothing where it has a value everywhere, or none there.
    """
    law = curve.law
    if isinstance(law, Table) and not law.periodic and law.outside != "error":
        return [(law.x, law.outside)]
    if isinstance(law, Table2) and law.outside != "error":
        return [(law.x, law.outside), (law.y, law.outside)]
    return []


@dataclasses.dataclass(frozen=True)
class _Recorder:
    """A curve as formulas call it, which keeps what it was called with."""

    name: str
    curve: NamedCurve
    calls: list[tuple[_Recorder, tuple[Any, ...]]]

    @property
    def takes(self) -> tuple[Any, ...]:
        """Arguments of the recorded curve."""
        return self.curve.takes

    def at(self, *arguments: Any) -> Any:
        """The value of the curve."""
        self.calls.append((self, arguments))
        return self.curve.at(*arguments)


def _calls(
    solution: Solution, element: Any, field: str, law: MeasuredFormula
) -> list[tuple[_Recorder, tuple[Any, ...]]]:
    """The curves that a formula calls over the instants, with what they are called with."""
    from mbody.solution.measures import argument, formula_value, measured

    calls: list[tuple[_Recorder, tuple[Any, ...]]] = []
    curves: Mapping[str, Any] = {
        name: _Recorder(name, curve, calls) for name, curve in solution.mechanism.curves.items()
    }
    values, name = solution.system.values, f"{element.name}.{field}"
    numbers = {key: column(values[f"{name}.{key}"]) for key in law.numbers()}

    def variable(one: str) -> Any:
        if one == "x":
            return argument(solution, element, field)
        return solution.t if one == "t" else measured(solution, one)[0]

    with np.errstate(all="ignore"):
        formula_value(law, numbers, variable, curves)
    return [(curve, arguments) for curve, arguments in calls if _ranges(curve.curve)]


# -- Tables, and curves of formulas, that a result has gone beyond: by how far, and since when -


def extrapolated(solution: Solution) -> list[Doubt]:
    """A doubt for each table or curve that was evaluated outside the range of its points.

    Laws of time, and of the stretch, twist or rate of springs and dampers, are examined at the
    kept instants; of a free motion the argument is followed between them too, by the cubic through
    its values and rates.
    """
    from mbody.solution.measures import argument, argument_rate

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
        margin = TABLE_RANGE_MARGIN * (high - low)
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
            dimension = dimension_of(element.__dataclass_fields__[field].metadata["of"])
            what, units = (element.name, f"the table of its {field}"), solution.mechanism.units
            found.append(range_doubt(units, what, table.x, dimension, table.outside, met))
    return [*found, *curve_doubts(solution), *tyre_doubts(solution)]


def tyre_doubts(solution: Solution) -> list[Doubt]:
    """A doubt for each tyre that is pressed in by more than its radius, where k (R − h) is no law
    of a wheel.
    """
    from mbody.solution.doubts import Doubt
    from mbody.solution.measures import measured

    found, units = [], solution.mechanism.units
    for tyre in (load for load in solution.mechanism.loads if isinstance(load, Tyre)):
        heights = np.atleast_2d(measured(solution, f"{tyre.name}.height")[0])
        below = (heights < 0.0).any(axis=0)
        if below.any():
            since = float(solution.t[below].min())
            message = (
                f"'{tyre.name}': the wheel's centre is up to {-np.nanmin(heights):.3g} "
                f"{units.length} below the road, from t = {since:.6g} {units.time} on, where the "
                "law of the tyre does not hold: give it more stiffness"
            )
            found.append(Doubt("validity", message, since, (tyre.name,)))
    return found


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
