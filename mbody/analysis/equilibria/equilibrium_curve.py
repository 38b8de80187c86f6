"""The analysis `equilibrium_curve`: rest positions as one number changes, round turning points."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from mbody.analysis.driven.runner import Runner
from mbody.analysis.driven.time_grid import by_time
from mbody.analysis.equilibria.arclength import FIRST, LONGEST, SHORTEST, STRAIGHT, Follower, Point
from mbody.analysis.equilibria.branch_points import GAP, crossing, together
from mbody.analysis.equilibria.curve_walk import AWAY
from mbody.analysis.equilibria.equilibrium import Equilibrium, search, stability_of
from mbody.analysis.equilibria.search import Rest, RestSearch
from mbody.analysis.equilibria.sentences import Words
from mbody.analysis.freedom.single_design import single_design
from mbody.analysis.position.assembly_analysis import closed
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.core.presentation import present
from mbody.errors import ModelError, SolveError
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.solution.doubts import Doubt, Inherited, doubted
from mbody.solution.heading import heading, unit_symbols
from mbody.solution.histories import BodyHistory, PointHistory, Reaction, Record
from mbody.solution.solution import Solution
from mbody.system.read_only import lock
from mbody.system.system import System

__all__ = ["EquilibriumCurve", "equilibrium_curve"]

History = TypeVar("History", BodyHistory, PointHistory, Reaction)

#: Points that a curve has at most, unless the caller says how many.
POINTS = 1000
#: A step below which branches that do not cross are no longer distinguished.
LEAST = 1e-5


@dataclass(frozen=True, eq=False)
class EquilibriumCurve(Inherited):
    """Rest positions along a curve: arrays (points,) by name, like a solution's over instants.

    Attributes
    ----------
    parameter : str
        The number that changes.
    values : array (points,)
        Of it.
    arclength : array (points,)
        Along the curve, without units: lengths by the model length, angles in rad, the number by
        the width of its span.
    unit : str
        Of the number.
    stability : tuple of str
        Of each point: ``"stable"``, ``"unstable"`` or ``"neutral"``.
    folds : tuple of int
        Points at which the curve turns round: limit points, where the position snaps through.
    crossings : tuple of int
        Points at which another branch crosses.
    kinds : tuple of str
        Of each crossing: ``"pitchfork"`` where one of the branches turns round in it,
        ``"transcritical"`` where none does, ``"multiple"`` where more than two branches meet, as
        at a position where branches of the motion itself meet.
    solution : Solution
        Statics of all points as a batch of designs, one instant each.
    status : str
        ``"completed"``, or ``"doubtful: …"`` with the first doubt.
    doubts : tuple of Doubt
        Where the curve ends before its span does, where it may have gone over to another branch,
        and what is in doubt of the statics. Points are balanced as parts of the greatest load,
        since sums of forces may vanish: what is left beside those sums is reported by
        ``solution.doubts`` alone.
    notes : tuple of str
        Where and why the curve ends, and the sentences of the doubts.
    """

    parameter: str
    values: Array
    arclength: Array
    unit: str
    stability: tuple[str, ...]
    folds: tuple[int, ...]
    crossings: tuple[int, ...]
    solution: Solution = field(repr=False)
    kinds: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        lock(self)

    @property
    def stable(self) -> Array:
        """Whether each point is stable (points,)."""
        return np.array([word == "stable" for word in self.stability])

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, body: str) -> BodyHistory:
        return _flat(self.solution[body])

    def point(self, place: Any) -> PointHistory:
        """A place on a body, such as ``"arm.B"``, at every point."""
        return _flat(self.solution.point(place))

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint at every point."""
        return _flat(self.solution.reaction(joint, on))

    def effort(self, driver: str) -> Array:
        """Effort of a driver that holds, at every point."""
        return self.solution.effort(driver)[:, 0]

    def data(self) -> dict[str, Any]:
        """Everything as a plain dict of numbers, text, lists and dicts, ready for JSON."""
        mechanism = self.solution.mechanism
        bodies = mechanism.bodies
        return {
            **heading(mechanism.name, "equilibrium_curve", unit_symbols(mechanism.units), self),
            "parameter": self.parameter,
            "unit": self.unit,
            "values": self.values.tolist(),
            "arclength": self.arclength.tolist(),
            "stability": list(self.stability),
            "folds": list(self.folds),
            "crossings": list(self.crossings),
            "kinds": list(self.kinds),
            "bodies": {
                body.name: {
                    key: getattr(self[body.name], key).tolist() for key in ("x", "y", "angle")
                }
                for body in bodies
            },
        }

    def __str__(self) -> str:
        return str(present("sheet", self))


def _flat(history: History) -> History:
    """A history of a batch of single instants as arrays over the designs."""
    parts: dict[str, Any] = {
        part.name: value[:, 0]
        for part in dataclasses.fields(history)
        if isinstance(value := getattr(history, part.name), np.ndarray)
    }
    return dataclasses.replace(history, **parts)


def equilibrium_curve(
    model: Mechanism | System,
    parameter: str,
    span: tuple[float, float],
    *,
    at: float | None = None,
    free: str | Sequence[str] = (),
    start: Equilibrium | Guesses | None = None,
    t: float = 0.0,
    points: int = POINTS,
) -> EquilibriumCurve:
    """Rest positions as one number changes: equilibrium path, by pseudo-arclength continuation.

    The curve r(q, p) = 0 is followed by its arclength, so that it may turn round in p: at such a
    fold a stable position ends, and the mechanism snaps through (Keller 1977).

    Parameters
    ----------
    model : Mechanism or System
        With free motions; drivers hold what their laws say at t.
    parameter : str
        A changeable number or a parameter, such as ``"field.speed"`` or ``"spring.stiffness"``.
    span : pair of float
        Where it may go, in the sense in which it goes first; it ends where it leaves the span on
        either side.
    at : float, optional
        Where in the span it begins, by default at its first number.
    free : str or sequence of str, optional
        Drivers that are released.
    start : Equilibrium or mapping, optional
        A rest position of `equilibrium`, or a guess of one, where it begins; by default the first
        stable one.
    t : float
        Time at which laws are taken.
    points : int
        At most so many are found.

    Returns
    -------
    EquilibriumCurve
        Values, positions, forces and stability as arrays; folds and crossings of branches, each of
        them a point found to rounding.

    Raises
    ------
    ModelError
        For a parameter that is not there, a span that is none, or a batch of designs.
    SolveError
        When there is no rest position to begin with.

    Examples
    --------
    A pendulum under a torque: it gives way at m g l = 9.81 N·m.

    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81), mbody.Torque("push", "rod", value=0.0))
    >>> curve = equilibrium_curve(machine, "push.value", (-20.0, 20.0), at=0.0)
    >>> [round(float(curve.values[n]), 9) for n in curve.folds]
    [9.81, -9.81]
    """
    system = single_design("equilibrium_curve", model, free)
    low, high = _span(system, parameter, span)
    begin = _begin(at, low, high)
    if isinstance(points, bool) or not hasattr(points, "__index__") or points < 2:
        raise ModelError(f"a curve needs at least 2 points, a whole number, not {points!r}")
    first = system.with_values({parameter: begin})
    place, manifold = _start(first, start, t)
    follower = Follower(system, manifold, parameter, np.array([low, high]))
    return _Tracer(follower, t, int(points)).traced(place, (begin - low) / (high - low))


def _begin(at: Any, low: float, high: float) -> float:
    """Where in the span a curve begins."""
    if at is None:
        return low
    number = isinstance(at, (int, float, np.floating)) and not isinstance(at, bool)
    if not (number and min(low, high) <= at <= max(low, high)):
        raise ModelError(f"at must be a number within the span {low:g} … {high:g}, not {at!r}")
    return float(at)


def _span(system: System, parameter: Any, span: Any) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in span)
        good = bool(np.isfinite([low, high]).all()) and low != high
    except (TypeError, ValueError):
        good = False
    if not good:
        raise ModelError(f"span must be two different numbers, where to begin first, not {span!r}")
    for value in (low, high):
        system.with_values({parameter: value})
    return low, high


def _start(system: System, start: Any, t: float) -> tuple[Place, Manifold]:
    """The rest position that the curve begins at."""
    if isinstance(start, Equilibrium):
        bodies = [start[name] for name in start.solution]
        rows = [(body.x[0], body.y[0], body.angle[0]) for body in bodies]
        pose = np.append(np.array(rows).reshape(-1), np.zeros(3))
        begin = closed(system, t, {}, None, pose=pose)
    elif isinstance(start, Mapping):
        begin = closed(system, t, {}, start)
    elif start is None:
        found = search(system, [None], t)
        rests = found.search.found
        if not rests:
            raise Words(system, found.search).nothing()
        words = [stability_of(r, found.manifold.mass(r.place.motions))[0] for r in rests]
        return rests[words.index("stable") if "stable" in words else 0].place, found.manifold
    else:
        raise ModelError(
            f'start must be a rest position or a guess such as {{"crank": 0.3}}, not {start!r}'
        )
    manifold = Manifold(system, begin.work, t)
    here = manifold.place(begin.work.q[: system.coordinates, 0].copy())
    if here is not None:
        nearest = RestSearch(manifold)
        nearest.nearest(here)
        if nearest.found:
            return nearest.found[0].place, manifold
    raise SolveError(
        f"there is no rest position of '{system.mechanism.name}' near the start: look for one with "
        "equilibrium, and give it as start"
    )


class _Tracer:
    """Steps along one curve and makes the result."""

    def __init__(self, follower: Follower, t: float, points: int) -> None:
        self.follower, self.t, self.points = follower, t, points
        self.path: list[Point] = []
        self.turned: list[Point] = []
        self.crossed: list[Point] = []
        self.kinds: list[str] = []
        self.notes: list[str] = []
        self.doubts: list[Doubt] = []

    def traced(self, place: Place, value: float) -> EquilibriumCurve:
        """The curve from its first place on."""
        here = self.follower.point(place, value, None, 0.0)
        if here.direction[-1] < 0.0:
            here = dataclasses.replace(here, direction=-here.direction)
        self.path = [here]
        step = FIRST
        while len(self.path) < self.points:
            there = self.follower.ahead(here, step)
            bend = 0.0 if there is None else float(there.direction @ here.direction)
            if there is None or bend < STRAIGHT:
                step *= 0.5
                if step < SHORTEST:
                    self._stops(here)
                    break
                continue
            if not 0.0 <= there.value <= 1.0:
                if not self._end(here, 1.0 if there.value > 1.0 else 0.0):
                    if step > LEAST:
                        step *= 0.5
                        continue
                    self._stops(here)
                break
            if not self._between(here, there):
                if step > LEAST:
                    step *= 0.5  # it leapt from one branch to another that does not cross
                    continue
                said = (
                    f"near {self._where(there)} branches come so near each other that the curve "
                    "may have gone over to another one: change a number a little, and compare"
                )
                self.doubts.append(Doubt("branch", said))
            self.path.append(there)
            if self._round(there):
                self.notes.append("it closes on itself")
                break
            if np.abs((there.place.q - place.q) / self.follower.scale).max() > AWAY:
                self.notes.append(f"it leaves all bounds near {self._where(there)}")
                break
            if bend > 1.0 - 0.25 * (1.0 - STRAIGHT):
                step = min(2.0 * step, LONGEST)
            here = there
        else:
            said = f"{self.points} points were not enough: give more points"
            self.doubts.append(Doubt("incomplete", said))
        return self._curve()

    def _where(self, point: Point) -> str:
        return f"{self.follower.parameter} = {self.follower.number(point.value):.6g}"

    def _round(self, there: Point) -> bool:
        """Whether the curve has come back to its beginning."""
        first, parts = self.path[0], len(self.path)
        apart = self.follower.first.apart(first.place.q, there.place.q)
        near = max(apart, abs(first.value - there.value)) < 0.6 * LONGEST
        return parts > 10 and near and bool(first.direction @ there.direction > STRAIGHT)

    def _stops(self, here: Point) -> None:
        """The curve ends at a point within its span."""
        said = (
            f"it cannot be followed beyond {self._where(here)}: give a rest position beyond it as "
            "start of another curve"
        )
        self.doubts.append(Doubt("incomplete", said))

    def _end(self, here: Point, value: float) -> bool:
        """The last point, where the number leaves its span; whether it is on the same branch."""
        if here.value == value:
            return True
        last = self.follower.at_end(here, value)
        if last is None or not last.arc > here.arc or not self._between(here, last):
            return False
        self.path.append(last)
        return True

    def _between(self, here: Point, there: Point) -> bool:
        """Folds and crossings between neighbours; whether both are on one branch."""
        if here.side * there.side < 0.0:
            found = crossing(self.follower, here, there)
            if found is None or found.gap > GAP:
                return False
            self._crossed(found.point, found.kind)
            return True
        if here.direction[-1] * there.direction[-1] < 0.0:
            turned = self.follower.between(here, there, lambda point: float(point.direction[-1]))
            self.path.append(turned)
            self.turned.append(turned)
            return True
        one, other = here.stiffnesses, there.stiffnesses
        alike = len(one) == len(other)
        changed = [n for n in range(len(one)) if alike and one[n] * other[n] < 0.0]
        if changed:
            found = together(self.follower, here, there, changed)
            if found is None:
                return False
            self._crossed(found.point, found.kind)
        return True

    def _crossed(self, point: Point, kind: str) -> None:
        self.path.append(point)
        self.crossed.append(point)
        self.kinds.append(kind)

    def _curve(self) -> EquilibriumCurve:
        follower, path = self.follower, self.path
        values = np.array([follower.number(point.value) for point in path])
        words = []
        for point in path:
            manifold = follower.manifold(point.value)
            rest = Rest(point.place, point.stiffness, manifold.largest(point.place.q), row=False)
            words.append(stability_of(rest, manifold.mass(point.place.motions))[0])
        # at a fold or a crossing the least stiffness is zero but for the last digits
        for point in (*self.turned, *self.crossed):
            words[path.index(point)] = "neutral"
        system = follower.system.with_values({follower.parameter: values})
        solution = _statics(system, [point.place.q for point in path], self.t)
        curve = EquilibriumCurve(
            parameter=follower.parameter,
            values=values,
            arclength=np.array([point.arc for point in path]),
            unit=_unit(follower.system, follower.parameter),
            stability=tuple(words),
            folds=tuple(path.index(point) for point in self.turned),
            crossings=tuple(path.index(point) for point in self.crossed),
            kinds=tuple(self.kinds),
            solution=solution,
            notes=tuple(self.notes),
        )
        of_statics = (doubt for doubt in solution.doubts if doubt.kind != "residual")
        return doubted(curve, (*self.doubts, *of_statics))


def _unit(system: System, name: str) -> str:
    """Unit of a changeable number, empty where its place does not say it."""
    mechanism = system.mechanism
    element, _, key = name.partition(".")
    if not key:
        dimension = mechanism.parameters.scope().names[name].dimension
        return "" if dimension is None else mechanism.units.of(dimension)
    for part in dataclasses.fields(mechanism[element]):
        if part.name == key:
            dimension = part.metadata.get("dimension") or part.metadata.get("law")
            return mechanism.units.of(dimension) if dimension else ""
    return ""


def _statics(system: System, poses: list[Array], t: float) -> Solution:
    """Every joint force at every position, each a design."""
    runner, instant = Runner(system, "statics", unbalanced=np.inf), by_time(system, np.array([t]))
    blocks, first = [], None
    for design, q in enumerate(poses):
        start = closed(system, t, {}, None, design, np.append(q, np.zeros(3)))
        first = first or start
        blocks.append(runner.scalar(start, instant))
    assert first is not None
    block = np.concatenate(blocks, axis=2)
    return runner.solution(first, instant, Record([block], len(poses), batch=True))
