"""From candidates to designs: each is followed, measured, and kept or left out with a reason."""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from mbody.analysis.driven.driven import kinematics
from mbody.core import tolerances as tol
from mbody.core.least_squares import least_squares
from mbody.core.presentation import Presented
from mbody.errors import ModelError, SolveError, brief
from mbody.files.model import save
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.quantities import Scope
from mbody.quantities.formula import evaluated, range_given
from mbody.quantities.formula import number as described_number
from mbody.quantities.units import DIMENSIONS, UnitSystem
from mbody.solution.declared_result import (
    ColumnTable,
    ItemTable,
    Sentence,
    Value,
    in_units,
)
from mbody.solution.measures import checked_sides, found_by, sides
from mbody.sweeps.job import MeasuredColumn, columns_of, reduced
from mbody.synthesis.linkage_kinds import Kind
from mbody.system.assembler import assemble
from mbody.system.system import System

# -- Requirements of a synthesis: points, pairs, poses, timing, bounds, conditions -------------

#: Fewest points of a path, pairs of a function and poses; fewer are met by nearly any mechanism.
LEAST = 3
#: Most poses that a four-bar passes exactly.
POSES = 5
#: How far numbers may be from the points where no bounds are given, in sizes of the path.
SEARCH_HALF_WIDTH = 5.0
#: Shortest link, in sizes of the path.
SHORTEST = 1e-3


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
                float(evaluated(described_number(_plain(cell), kind, name, key), scope, name, key))
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
    closed = bool(abs(points[-1] - points[0]) <= tol.SYNTHESIS_POINT_MET * size)
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
            float(
                evaluated(
                    described_number(cell, dimension, "timing", f"[{n}]"), scope, "timing", f"[{n}]"
                )
            )
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
    if dimension == "angle" and abs(steps.sum()) > 2.0 * math.pi + tol.SYNTHESIS_TURN_ROUNDING_FINE:
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
    rotation = np.abs(np.diff(table[:, 2]))
    if not (rotation > tol.SYNTHESIS_ANGLE_STEP_LEAST).all():
        raise ModelError(
            "synthesize: two poses in succession have one angle: between them circle points are "
            "not determined; turn one of them slightly"
        )
    return table[:, 0] + 1j * table[:, 1], table[:, 2]


def bounds(
    kind: Kind, middle: complex, size: float, given: Mapping[str, Any] | None, units: UnitSystem
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
    low = np.full(len(kind.numbers), -2.0 * SEARCH_HALF_WIDTH * size)
    high = np.full(len(kind.numbers), 2.0 * SEARCH_HALF_WIDTH * size)
    for n, name in enumerate(kind.numbers):
        if name.startswith("ground."):
            centre = middle.real if name.endswith(".x") else middle.imag
            low[n], high[n] = centre - SEARCH_HALF_WIDTH * size, centre + SEARCH_HALF_WIDTH * size
        elif name.endswith(".angle"):
            low[n], high[n] = -math.inf, math.inf
        elif n in kind.lengths:
            low[n] = SHORTEST * size
    for name, pair in given.items():
        n = kind.numbers.index(name)
        what = "angle" if name.endswith(".angle") else "length"
        low[n], high[n] = range_given(
            pair, DIMENSIONS[what], Scope(units), "synthesize", name, equal=True
        )
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


# -- Designs found by a synthesis --------------------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class Design(Presented):
    """One mechanism that was found.

    Attributes
    ----------
    mechanism : Mechanism
        With the instants of the demand as those that it asks for.
    values : dict
        The numbers that were found, by the names of the description; angles in rad. Of a function
        also its `zeros`, ``"input.zero.angle"`` and ``"output.zero.angle"`` or ``"output.zero.x"``.
    error : float
        Sum of squares of `misses`, of the mechanism as it was followed.
    misses : tuple of float
        Point by point: the distance from a point of the path [length], of the output from the
        function [rad or length], or the greatest distance of the pins of a pose [length].
    driven : list of float
        Values of the driver at the points, in the order in which they are passed: what ``drive``
        takes.
    defects : tuple of str
        In words what is wrong when the driver goes through the points: order, branch, circuit.
    order : bool
        Whether the driver passes the points one after the other in one direction.
    grashof : str
        Which links turn round, in words; empty of other mechanisms than four-bars and
        slider-cranks.
    transmission_min : float
        Least angle between coupler and rocker, or of the rod to the normal of the guide [rad]: of a
        whole revolution where the crank turns round, else from the first point to the last; NaN
        where it is not known.
    margins : dict
        Of the conditions in `subject_to`, by how much each is met, in its unit.
    cognates : tuple of Design
        Other mechanisms of the same motion of the point with the same rotation of the crank
        (Roberts).
    zeros : (float, float) or None
        Of a function: what the angles of the crank and the output of the mechanism have more than
        the given inputs and outputs.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.slider_crank(1.0, 3.0)
    >>> Design(machine, {"crank.A.x": 1.0}, 0.25, (0.5,), [0.0])
    Design(slider-crank: error 0.25, no defects)
    """

    mechanism: Mechanism
    values: dict[str, float]
    error: float
    misses: tuple[float, ...]
    driven: list[float]
    defects: tuple[str, ...] = ()
    order: bool = True
    grashof: str = ""
    transmission_min: float = math.nan
    margins: dict[str, float] = field(default_factory=dict)
    cognates: tuple[Design, ...] = ()
    zeros: tuple[float, float] | None = None

    angle_unit = "deg"
    declared = (
        Value("error"),
        Value("values", "", lambda one: {n: "angle" * n.endswith(".angle") for n in one.values}),
        Value("transmission_min", "", "angle"),
        "defects order grashof misses margins cognates",
    )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism to a model file; see `mbody.save`."""
        save(self.mechanism, path)

    def __repr__(self) -> str:
        words = [self.grashof] if self.grashof else []
        words += list(self.defects) or ["no defects"]
        return f"Design({self.mechanism.name}: error {self.error:.6g}, {', '.join(words)})"


class DesignList(list[Design], Presented):
    """The designs of a synthesis, the best first.

    Attributes
    ----------
    searched : int
        How many designs were tried.
    seed : int
        Of the random ones.
    notes : tuple of str

    Examples
    --------
    >>> import mbody
    >>> one = Design(mbody.makers.slider_crank(1.0, 3.0), {"crank.A.x": 1.0}, 0.25, (0.5,), [0.0])
    >>> found = DesignList([one], searched=40, seed=1)
    >>> len(found), found.searched
    (1, 40)
    """

    def __init__(
        self, found: Iterable[Design], searched: int, seed: int, notes: Iterable[str] = ()
    ) -> None:
        super().__init__(found)
        self.searched, self.seed, self.notes = searched, seed, tuple(notes)

    @property
    def mechanism(self) -> Mechanism | None:
        """That of the best."""
        return self[0].mechanism if self else None

    @property
    def declared(self) -> tuple[Any, ...]:
        """What the designs are worth, and their numbers."""
        if not self:
            return (Sentence(lambda found: "no design"),)
        units = self[0].mechanism.shown
        dimensions = {name: _dimension(name) for name in self[0].values}
        symbols = {name: in_units(units, one, 0.0)[1] for name, one in dimensions.items()}
        numbers = [
            {n: float(in_units(units, dimensions[n], value)[0]) for n, value in one.values.items()}
            for one in self
        ]
        rows, designs = (dict(enumerate(parts, 1)) for parts in (numbers, self))
        return (
            Sentence(lambda found: f"{found.searched} designs tried, seed {found.seed}"),
            ItemTable(
                "",
                (
                    Value("", "error", "each", "error"),
                    Value("", "transmission", "angle", "transmission_min", missing=""),
                    Value("", "class", "text", "grashof"),
                    Value("", "defects", "text", "defects"),
                ),
                "DESIGN",
                lambda found: designs,
            ),
            ColumnTable(
                tuple(
                    [Value("", str(n), "each", _always(row)) for n, row in rows.items()]
                    + [Value("", "unit", "text", _always(symbols))]
                ),
                "NUMBER",
            ),
            Sentence(lambda found: [f"note: {note}" for note in found.notes]),
        )


def _always(row: Any) -> Callable[[Any], Any]:
    return lambda found: row


def _dimension(name: str) -> str:
    """What a number measures."""
    if name.endswith(".angle"):
        return "angle"
    return "length" if name.endswith((".x", ".y", "offset")) else ""


# -- Designs followed through their motion: order, branch and circuit defects ------------------
# A design has a circuit defect where some of its positions can be reached only by taking a joint
# apart, a branch defect where the driver meets a dead centre between them, and an order defect
# where it passes them in another order (Erdman and Sandor, *Mechanism Design*, 1984, section 8).

#: Instants of the motion of which the transmission angle and conditions are taken.
MOTION = 181
#: A whole revolution less rounding.
REVOLUTION = 2.0 * math.pi - tol.SYNTHESIS_TURN_ROUNDING


@dataclass(frozen=True, eq=False)
class Positions:
    """A design with the positions that it is to go through: a row of numbers, crank angles, the
    direction in which the loop is closed at each; `fixed` where the rotations between them are
    given; `plane` is the angle of the axes of a plane that is guided to those of the carrier.
    """

    kind: Kind
    x: np.ndarray
    theta: np.ndarray
    signs: np.ndarray
    fixed: bool = False
    plane: float | None = None

    def described(self, theta: np.ndarray, units: str) -> Mechanism:
        """The mechanism as a description, its crank at the first of some angles."""
        return self.kind.mechanism(self.x, theta, float(self.signs[0]), units, self.plane)

    @property
    def carriers(self) -> np.ndarray:
        """Directions e^{iφ} of the axes of the carrier at the positions."""
        at = zip(self.theta, self.signs, strict=True)
        found = [self.kind.poses(self.x, np.array([angle]), sign)[0][0] for angle, sign in at]
        return np.array(found) * np.exp(1j * (self.plane or 0.0))


@dataclass(frozen=True, eq=False)
class DesignMotion:
    """How the mechanism went through its positions.

    `theta` (points,): Crank angles as they were passed.
    `run`: At the points, where all were reached.
    `motion`: Of the whole revolution, or from the first point to the last.
    """

    system: System
    theta: np.ndarray
    order: bool
    defects: tuple[str, ...]
    run: Any
    motion: Any


def follow_design(positions: Positions, units: str) -> DesignMotion:
    """Drive the crank from the first position through the others, and judge what it meets."""
    name, carriers, stop = positions.kind.carrier, positions.carriers, ""
    for theta, in_order in _crank_angles(positions):
        system = assemble(positions.described(theta, units))
        try:
            run = kinematics(system, drive={"motor": theta})
        except SolveError as error:
            stop = stop or str(error).partition(";")[0]
            continue
        off = np.abs(np.exp(1j * run[name].angle) - carriers) > tol.SYNTHESIS_ANGLE_SAME
        doubts = [one.message for one in run.doubts if one.kind == "branch"]
        if off.any() or doubts:
            stop = stop or (doubts[0] if doubts else "")
            continue
        defects = () if in_order else ("order: the crank turns back between the points",)
        return DesignMotion(
            system, theta, in_order, defects, run, _motion(positions, system, theta)
        )
    theta = next(_crank_angles(positions))[0]
    system = assemble(positions.described(theta, units))
    return DesignMotion(system, theta, False, (_defect(positions, stop),), None, None)


def _crank_angles(positions: Positions) -> Any:
    """Crank angles through all points, and whether they go one way within a revolution."""
    theta = positions.theta
    steps = np.diff(theta)
    if positions.fixed:
        one_way = bool((steps > 0.0).all() or (steps < 0.0).all()) and abs(steps.sum()) < REVOLUTION
        yield theta, bool(one_way)
        return
    forward, backward = np.mod(steps, 2.0 * math.pi), -np.mod(-steps, 2.0 * math.pi)
    for rotations in sorted((forward, backward), key=lambda rotations: abs(rotations.sum())):
        if abs(rotations.sum()) < REVOLUTION:
            yield theta[0] + np.concatenate([[0.0], np.cumsum(rotations)]), True
    shortest = np.mod(steps + math.pi, 2.0 * math.pi) - math.pi
    yield theta[0] + np.concatenate([[0.0], np.cumsum(shortest)]), False


def _defect(positions: Positions, stop: str) -> str:
    kind, signs = positions.kind, positions.signs
    circuits = kind.circuit(positions.x, positions.theta, signs)
    if others := _points(circuits != circuits[0]):
        return f"circuit: {others} on another circuit than the first"
    if others := _points(signs != signs[0]):
        return f"branch: {others} beyond a dead centre of the crank, on another branch"
    return f"branch: {stop or 'the crank does not reach all points'}"


def _points(there: np.ndarray) -> str:
    """The numbers of some of the points, in words; empty where there are none."""
    numbers = [str(n + 1) for n in np.flatnonzero(there)]
    if not numbers:
        return ""
    return f"point {numbers[0]} is" if len(numbers) == 1 else f"points {', '.join(numbers)} are"


def _motion(positions: Positions, system: System, theta: np.ndarray) -> Any:
    if positions.kind.revolves(positions.x):
        angles = theta[0] + np.linspace(0.0, 2.0 * math.pi, MOTION)
    else:
        whole = np.linspace(0.0, len(theta) - 1.0, MOTION)
        angles = np.interp(whole, np.arange(len(theta)), theta)
    return kinematics(system, drive={"motor": angles})


# -- The least misses of designs that meet conditions ------------------------------------------

#: Designs of one synthesis that are led to their conditions, steps for each weight of what they
#: lack, and weights.
LED, LED_STEPS = 8, 40
LED_WEIGHTS = (30.0, 30.0, 30.0, 30.0)


@dataclass(frozen=True, eq=False)
class MissProblem:
    """Misses by the unknowns of a design, in parts of the motion's size.

    `residual`, `jacobian`: Of the unknowns.
    `begin`, `low`, `high` (unknowns,)
    `numbers`: How many of them are numbers of the mechanism, on which conditions depend.
    `candidate`: Of the unknowns; None where it does not close.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray], np.ndarray]
    begin: np.ndarray
    low: np.ndarray
    high: np.ndarray
    numbers: int
    candidate: Callable[[np.ndarray], Candidate | None]

    def least(self, most: int) -> np.ndarray | None:
        """The unknowns of the least sum of squares near the beginning, after so many evaluations
        at most; None where that does not close.
        """
        if not np.isfinite(self.residual(self.begin)).all():
            return None
        bounds = self.low, self.high
        return least_squares(self.residual, self.jacobian, self.begin, bounds, most=most).x


def led_to_conditions(
    problem: MissProblem, margins: Callable[[Candidate], np.ndarray | None]
) -> Candidate | None:
    """The candidate of least misses near the beginning whose margins are not negative: by least
    squares with what conditions lack as rows, whose weight grows and whose target moves inwards
    until nothing is lacking. None where none was found.
    """
    one = problem.candidate(problem.begin)
    first = None if one is None else margins(one)
    if first is None:
        return None
    sizes, targets = np.maximum(np.abs(first), tol.TINY), np.full(len(first), tol.SYNTHESIS_LED)
    width = problem.high - problem.low
    known: dict[bytes, np.ndarray] = {}

    def margin(y: np.ndarray) -> np.ndarray:
        key = y[: problem.numbers].tobytes()
        if key not in known:
            made = problem.candidate(y)
            found = None if made is None else margins(made)
            # what does not close is far from every condition
            known[key] = -np.ones(len(first)) if found is None else found / sizes
        return known[key]

    def rows(y: np.ndarray) -> np.ndarray:
        return np.concatenate([problem.residual(y), weight * np.maximum(targets - margin(y), 0.0)])

    def slopes(y: np.ndarray) -> np.ndarray:
        here, found = margin(y), np.zeros((len(first), len(y)))
        lacking = targets > here
        for n in np.flatnonzero(width[: problem.numbers] if lacking.any() else 0.0):
            inward = 1.0 if 2.0 * y[n] < problem.low[n] + problem.high[n] else -1.0
            step = np.zeros(len(y))
            step[n] = tol.SYNTHESIS_LED_STEP * inward * (width[n] if width[n] < np.inf else 1.0)
            found[:, n] = (here - margin(y + step)) / step[n]
        return np.concatenate([problem.jacobian(y), weight * lacking[:, None] * found])

    y, within = problem.begin, (problem.low, problem.high)
    for weight in (1.0, *LED_WEIGHTS):
        if not np.isfinite(rows(y)).all():
            return None
        y = least_squares(rows, slopes, y, within, most=LED_STEPS).x
        lacking = np.maximum(targets - margin(y), 0.0)
        if weight >= LED_WEIGHTS[0]:
            targets = targets + lacking
        if (margin(y) >= 0.0).all():
            break
    return problem.candidate(y)


class Candidate(Protocol):
    """A design that is to be judged."""

    @property
    def row(self) -> np.ndarray:
        """Its numbers."""
        ...

    @property
    def misses(self) -> np.ndarray:
        """How far it is from the points, as it was found (points,)."""
        ...

    @property
    def zeros(self) -> tuple[float, float] | None:
        """Of a function: what is added to the given input and output."""
        ...

    @property
    def described(self) -> str:
        """Which links turn round, in words."""
        ...

    def revolves(self) -> bool:
        """Whether the crank may turn round."""
        ...

    def follow(self, units: str, full_turn: bool) -> DesignMotion:
        """The assembled mechanism goes through the points."""
        ...

    def motion(self, units: str, full_turn: bool) -> Any:
        """Of which conditions are measured; None where it is not followed."""
        ...

    def measured(self, run: Any) -> np.ndarray:
        """The misses of a result of the assembled mechanism."""
        ...

    def values(self, found: DesignMotion) -> dict[str, float]:
        """The numbers by the names of the description."""
        ...

    def transmission(self, found: DesignMotion) -> float:
        """Least transmission angle of the motion; NaN where it is not known."""
        ...

    def cognate(self) -> Candidate | None:
        """The other mechanism of the same path and the same crank, where it is wanted."""
        ...

    @property
    def problem(self) -> MissProblem | None:
        """What its misses are the least of, near it; None where nothing is sought."""
        ...


@dataclass
class Judge:
    """Judges candidates one after the other and keeps those that are wanted.

    `size`: Of the motion, by which designs are compared.
    `full_turn`, `defective`: As of `synthesize`.
    `tolerance`: Greatest miss of a point.
    `unit`: Of misses.
    `refused`: Why candidates were left out.
    `nearest`: The best of those that were left out.
    """

    units: str
    size: float
    subject_to: tuple[str, ...]
    full_turn: bool
    defective: bool
    tolerance: float
    unit: str
    kept: list[Design] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)
    nearest: Design | None = None

    def __post_init__(self) -> None:
        self._seen: list[Candidate] = []

    def take(self, candidates: Iterable[Candidate], count: int, exact: float) -> None:
        """Judge candidates in their order until `count` designs are kept, and all whose error is
        below `exact`, which are equals.
        """
        led = 0
        for one in candidates:
            errors = sorted(design.error for design in self.kept)
            # a design that is led to conditions may be worse than those that follow
            worst = max(exact, errors[count - 1] if led else 0.0) if len(errors) >= count else 0.0
            if len(errors) >= count and float(np.square(one.misses).sum()) > worst:
                break
            why = self._judge_candidate(one)
            if why in self.subject_to and one.problem is not None and led < LED:
                led += 1
                nearby = led_to_conditions(one.problem, self._margins)
                if nearby is not None:
                    self._judge_candidate(nearby)

    def _margins(self, candidate: Candidate) -> np.ndarray | None:
        """By how much a design meets each condition; None where it does not move."""
        try:
            motion = candidate.motion(self.units, self.full_turn)
        except (SolveError, ModelError):
            return None
        if motion is None:
            return None
        return np.array([c.margin(motion) for c in conditions(self.subject_to, motion.mechanism)])

    def _judge_candidate(self, candidate: Candidate) -> str:
        """Keep it, or say why not."""
        if any(self._alike(candidate, other) for other in self._seen):
            return "alike"
        self._seen.append(candidate)
        if self.full_turn and not candidate.revolves():
            self.refused["a crank that does not turn round"] += 1
            return "a crank that does not turn round"
        design, why = self._design(candidate)
        if other := candidate.cognate():
            self._seen.append(other)
            design = replace(design, cognates=(self._design(other)[0],))
        if not why:
            self.kept.append(design)
            return ""
        self.refused[why] += 1
        if self.nearest is None or design.error < self.nearest.error:
            self.nearest = design
        return why

    def _alike(self, one: Candidate, other: Candidate) -> bool:
        """Whether two designs are one: their numbers are, or they lie in one flat valley, in which
        searches end some way from each other, and no ridge is between them.
        """
        size = max(self.size, float(np.abs(one.row).max()))
        apart = float(np.abs(one.row - other.row).max()) / size
        if apart < tol.SYNTHESIS_DESIGNS_SAME:
            return True
        a, b = one.problem, other.problem
        exact = tol.SYNTHESIS_POINT_MET * self.size
        met = min(float(np.abs(each.misses).max()) for each in (one, other)) < exact
        if apart > tol.SYNTHESIS_VALLEY or met or a is None or b is None:
            return False
        ends = [float(np.square(a.residual(y)).sum()) for y in (a.begin, b.begin)]
        middle = float(np.square(a.residual(0.5 * (a.begin + b.begin))).sum())
        return middle <= max(ends) * (1.0 + tol.SYNTHESIS_ERROR_SAME)

    def _design(self, candidate: Candidate) -> tuple[Design, str]:
        """The design, and why it is left out."""
        found = candidate.follow(self.units, self.full_turn)
        misses = candidate.misses if found.run is None else candidate.measured(found.run)
        margins, why = {}, ""
        if found.defects and not self.defective:
            why = f"{found.defects[0].partition(':')[0]} defects"
        if misses.max() > self.tolerance and not why:
            why = "misses beyond the tolerance"
        if found.motion is not None:
            for condition in conditions(self.subject_to, found.system.mechanism):
                if not found_by(found.motion, condition.column.measure):
                    raise ModelError(
                        f"synthesize: '{condition.text}' is about a force, and a "
                        f"{found.system.mechanism.name} that is sought by its lengths has neither "
                        "masses nor loads: give a model that has them"
                    )
                margins[condition.text] = margin = condition.margin(found.motion)
                if margin < 0.0 and not why:
                    why = condition.text
        design = Design(
            mechanism=found.system.mechanism,
            values=candidate.values(found),
            error=float(np.square(misses).sum()),
            misses=tuple(float(one) for one in misses),
            driven=[float(one) for one in found.theta],
            defects=found.defects,
            order=found.order,
            grashof=candidate.described,
            transmission_min=candidate.transmission(found),
            margins=margins,
            zeros=candidate.zeros,
        )
        return design, why

    def best(self, count: int, exact: float) -> list[Design]:
        """The best of the kept ones by their errors, of exact ones by their transmission angles."""
        self.kept.sort(key=lambda one: (max(one.error, exact), -_certain(one.transmission_min)))
        return self.kept[:count]

    def off_point_notes(self) -> list[str]:
        """A note where even the first of the kept designs is far from a point."""
        misses = self.kept[0].misses
        worst = int(np.argmax(misses))
        if misses[worst] <= tol.SYNTHESIS_DESIGN_OFF * self.size:
            return []
        return [
            f"no design is near all points: the first is off by {misses[worst]:.3g} {self.unit} at "
            f"point {worst + 1}; widen the bounds or try more designs (search); tolerance leaves "
            "out what is off by more"
        ]

    def require(self, what: str) -> None:
        """Refuse to return nothing: say why candidates were left out, and which was nearest."""
        if self.kept:
            return
        message = f"synthesize: no {what}"
        if self.refused:
            reasons = (f"{count} for {why}" for why, count in self.refused.most_common(3))
            message += f"; left out were {', '.join(reasons)}"
        if self.nearest is not None:
            worst = int(np.argmax(self.nearest.misses))
            off = self.nearest.misses[worst]
            message += "; the nearest "
            if off > tol.SYNTHESIS_POINT_MET * self.size:
                message += f"is off by {off:.3g} {self.unit} at point {worst + 1}"
            else:
                message += "meets all points"
            if self.nearest.defects:
                message += f", with a defect of {self.nearest.defects[0].partition(':')[0]}"
        raise SolveError(
            f"{message}: change the points or widen the bounds, try more designs (search), or keep "
            "those with defects (defective=True)"
        )


def _certain(angle: float) -> float:
    return -1.0 if math.isnan(angle) else angle
