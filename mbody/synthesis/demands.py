"""What a synthesis is to meet, checked: points, pairs, poses, timing, bounds, conditions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.quantities import Scope
from mbody.quantities.number import evaluated, number
from mbody.quantities.units import Dimension, UnitSystem
from mbody.solution.measures import checked_sides, sides
from mbody.sweeps.columns import MeasuredColumn, columns_of, reduced
from mbody.synthesis.linkage_kinds import Kind

__all__ = [
    "MotionCondition",
    "bounds",
    "conditions",
    "counted",
    "interval",
    "pairs_of",
    "path_of",
    "poses_of",
    "timing_of",
]

#: Fewest points of a path, pairs of a function and poses; fewer are met by nearly any mechanism.
LEAST = 3
#: Most poses that a four-bar passes exactly.
POSES = 5
#: How far numbers may be from the points where no bounds are given, in sizes of the path.
REACH = 5.0
#: Shortest link, in sizes of the path.
SHORTEST = 1e-3
#: Distance between the ends of a closed path, in sizes of the path.
CLOSED = 1e-9


@dataclass(frozen=True)
class MotionCondition:
    """A condition on a measured quantity: not below, or not above, another one or a number."""

    text: str
    column: MeasuredColumn
    sign: float
    limit: str

    def margin(self, run: Any) -> float:
        """By how much a result meets it; negative where it does not."""
        value, limit = sides(run, self.column.measure.of, self.limit)
        found = reduced(self.column, value, run.t / run.mechanism.units.second)
        return float((self.sign * (found - limit)).min())


def counted(name: str, value: Any, least: int = 1) -> int:
    """A whole number of the request."""
    if isinstance(value, bool) or not hasattr(value, "__index__") or int(value) < least:
        raise ModelError(
            f"synthesize: {name} must be a whole number from {least} on, not {value!r}"
        )
    return int(value)


def _table(name: str, given: Any, dimensions: Sequence[str], units: UnitSystem) -> np.ndarray:
    """Rows of numbers, each of its dimension; text may have units."""
    columns = ", ".join(dimensions)
    if isinstance(given, (str, bytes)) or not isinstance(given, (Iterable, np.ndarray)):
        raise ModelError(
            f"synthesize: {name} must be a list of rows ({columns}), not {brief(given)}"
        )
    rows, scope = [], Scope(units)
    for n, row in enumerate(given, 1):
        try:
            cells = list(row) if not isinstance(row, (str, bytes)) else []
        except TypeError:
            cells = []
        if len(cells) != len(dimensions):
            raise ModelError(
                f"synthesize: row {n} of {name} must have {len(dimensions)} numbers ({columns}), "
                f"not {brief(row)}"
            )
        rows.append(
            [
                float(evaluated(number(_plain(cell), kind, name, key), scope, name, key))
                for cell, kind, key in zip(
                    cells,
                    dimensions,
                    (f"row {n}, number {k}" for k in range(1, len(cells) + 1)),
                    strict=True,
                )
            ]
        )
    if len(rows) < LEAST:
        raise ModelError(
            f"synthesize: {name} has {len(rows)} {'row' if len(rows) == 1 else 'rows'}, fewer than "
            f"{LEAST}: a continuum of mechanisms meets them; give at least {LEAST}"
        )
    return np.array(rows)


def _plain(cell: Any) -> Any:
    """Numbers of numpy as those of Python."""
    return cell.item() if isinstance(cell, np.generic) else cell


def path_of(given: Any, units: UnitSystem) -> tuple[np.ndarray, bool]:
    """Points of a path, complex, and whether it is closed: its last point, given again, is left
    out.
    """
    table = _table("path", given, ("length", "length"), units)
    points = table[:, 0] + 1j * table[:, 1]
    size = float(np.abs(points - points.mean()).max())
    if size == 0.0:
        raise ModelError("synthesize: all points of the path are one: give points apart")
    closed = bool(abs(points[-1] - points[0]) <= CLOSED * size)
    points = points[:-1] if closed else points
    if len(points) < LEAST:
        raise ModelError(
            f"synthesize: the closed path has {len(points)} points, at least {LEAST} are needed"
        )
    return points, closed


def timing_of(given: Any, count: int, dimension: str, units: UnitSystem) -> np.ndarray | None:
    """Values of the driver at the points: angles [rad], or lengths."""
    if given is None:
        return None
    if isinstance(given, (str, bytes)) or not isinstance(given, (Iterable, np.ndarray)):
        raise ModelError(
            f"synthesize: timing must be a list of values of the driver, not {brief(given)}"
        )
    scope, cells = Scope(units), [_plain(cell) for cell in given]
    found = np.array(
        [
            float(evaluated(number(cell, dimension, "timing", f"[{n}]"), scope, "timing", f"[{n}]"))
            for n, cell in enumerate(cells)
        ]
    )
    if len(found) != count:
        raise ModelError(
            f"synthesize: timing has {len(found)} values for {count} points: give one for each"
        )
    steps = np.diff(found)
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise ModelError(
            "synthesize: timing must rise or fall from point to point: the driver passes the "
            "points in their order"
        )
    if dimension == "angle" and abs(steps.sum()) > 2.0 * math.pi + 1e-12:
        raise ModelError(
            f"synthesize: timing goes over {math.degrees(abs(steps.sum())):.6g} deg: after a turn, "
            "360 deg, the path begins again"
        )
    return found


def pairs_of(
    given: Any, dimensions: tuple[str, str], units: UnitSystem
) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and outputs of a function, of their dimensions."""
    table = _table("function", given, dimensions, units)
    steps = np.diff(table[:, 0])
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise ModelError(
            "synthesize: the inputs of function must rise or fall from pair to pair: sort the pairs"
        )
    return table[:, 0], table[:, 1]


def poses_of(given: Any, units: UnitSystem) -> tuple[np.ndarray, np.ndarray]:
    """Places (complex) and angles [rad] of poses."""
    table = _table("poses", given, ("length", "length", "angle"), units)
    if len(table) > POSES:
        raise ModelError(
            f"synthesize: {len(table)} poses: a four-bar passes {POSES} exactly and no more: leave "
            "some out, or give the path of a point"
        )
    turn = np.abs(np.diff(table[:, 2]))
    if not (turn > 1e-9).all():
        raise ModelError(
            "synthesize: two poses in succession have one angle: between them circle points are "
            "not determined; turn one of them slightly"
        )
    return table[:, 0] + 1j * table[:, 1], table[:, 2]


def interval(
    name: str, given: Any, dimension: str | Dimension, units: UnitSystem
) -> tuple[float, float]:
    """A low and a high bound."""
    pair = list(given) if isinstance(given, (tuple, list, np.ndarray)) else []
    if len(pair) != 2:
        raise ModelError(
            f"synthesize: '{name}' takes a pair of bounds (low, high), not {brief(given)}", name
        )
    scope = Scope(units)
    first, second = (
        float(evaluated(number(_plain(cell), dimension, name, key), scope, name, key))
        for cell, key in zip(pair, ("low", "high"), strict=True)
    )
    if not first < second:
        raise ModelError(
            f"synthesize: the bounds of '{name}' are {first:g} and {second:g}: give the lower one "
            "first",
            name,
        )
    return first, second


def bounds(
    kind: Kind,
    middle: complex,
    size: float,
    given: Mapping[str, Any] | None,
    units: UnitSystem,
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the numbers of a kind: those given, else some sizes of the motion about it."""
    if given is not None and not isinstance(given, Mapping):
        raise ModelError(f"synthesize: by must be a dict of bounds, not {brief(given)}")
    given = dict(given or {})
    for name in given:
        if name not in kind.numbers:
            raise ModelError(
                f"synthesize: a {kind.name} has no number '{name}' (it has: "
                f"{listed(kind.numbers, 9)})",
                str(name),
            )
    low = np.full(len(kind.numbers), -2.0 * REACH * size)
    high = np.full(len(kind.numbers), 2.0 * REACH * size)
    for n, name in enumerate(kind.numbers):
        if name.startswith("ground."):
            centre = middle.real if name.endswith(".x") else middle.imag
            low[n], high[n] = centre - REACH * size, centre + REACH * size
        elif name.endswith(".angle"):
            low[n], high[n] = -math.inf, math.inf
        elif n in kind.lengths:
            low[n] = SHORTEST * size
    for name, pair in given.items():
        n = kind.numbers.index(name)
        what = "angle" if name.endswith(".angle") else "length"
        low[n], high[n] = interval(name, pair, what, units)
        if n in kind.lengths and high[n] <= 0.0:
            raise ModelError(
                f"synthesize: '{name}' is the length of a link, its bounds must be positive, not "
                f"{low[n]:g} to {high[n]:g}",
                name,
            )
        if n in kind.lengths:
            low[n] = max(low[n], SHORTEST * min(size, high[n]))
    return low, high


def conditions(texts: str | Iterable[str], mechanism: Mechanism) -> list[MotionCondition]:
    """Conditions such as ``"min(coupler.P.y) >= 20 mm"`` on the motion of a mechanism."""
    found = []
    for text in [texts] if isinstance(texts, str) else texts:
        match = re.fullmatch(r"(.+?)(<=|>=)(.+)", str(text), re.DOTALL)
        if match is None:
            raise ModelError(
                f'synthesize: a condition is such as "min(coupler.P.y) >= 20 mm", not {brief(text)}'
            )
        (column,) = columns_of(mechanism, [match[1].strip()], "synthesize")
        limit = match[3].strip()
        checked_sides(mechanism, str(text), column.measure.of, limit)
        found.append(MotionCondition(str(text), column, 1.0 if match[2] == ">=" else -1.0, limit))
    return found
