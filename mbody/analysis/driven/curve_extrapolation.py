"""Curves that formulas call beyond their points: by how far, and since when."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mbody.analysis.driven.range_doubts import MARGIN, range_doubt
from mbody.laws import MeasuredFormula, Table, Table2
from mbody.model.curves import NamedCurve
from mbody.model.mechanism import Mechanism
from mbody.solution.doubts import Doubt
from mbody.solution.formula_histories import formula_value
from mbody.solution.load_histories import argument
from mbody.solution.measures import measured
from mbody.solution.places import column
from mbody.solution.solution import Solution

__all__ = ["curve_doubts", "open_curves"]

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
        for curve, taken in _calls(solution, element, field, law):
            for place, (points, outside) in enumerate(_ranges(curve.curve)):
                x = np.broadcast_to(taken[place], shape)
                margin = MARGIN * (points[-1] - points[0])
                beyond = ((x < points[0] - margin) | (x > points[-1] + margin)).any(axis=0)
                if not beyond.any():
                    continue
                met = float(np.nanmin(x)), float(np.nanmax(x)), float(solution.t[beyond].min())
                nth = NTH[place] if len(taken) > 1 else ""
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
        """As of the curve."""
        return self.curve.takes

    def at(self, *taken: Any) -> Any:
        """The value of the curve."""
        self.calls.append((self, taken))
        return self.curve.at(*taken)


def _calls(
    solution: Solution, element: Any, field: str, law: MeasuredFormula
) -> list[tuple[_Recorder, tuple[Any, ...]]]:
    """The curves that a formula calls over the instants, with what they are called with."""
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
    return [(curve, taken) for curve, taken in calls if _ranges(curve.curve)]
