"""Any mechanism, numbers of which are sought: many designs side by side, each with its best timing
and its best place of the point; the best ones are refined with exact derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.derivatives.gradient import gradient_at
from mbody.errors import SolveError
from mbody.sweeps import latin_hypercube, sweep
from mbody.synthesis.curve_search import INSTANTS, timings
from mbody.system.system import System

__all__ = ["Demand", "FoundDesign", "Refinement", "searched"]

#: Relative changes at which a refinement ends: those of rounding.
ENDS = 1e-15
#: Motions that a refinement may take.
EVALUATIONS = 120
#: Share of bounds by which a start stays within them.
WITHIN = 1e-9


@dataclass(frozen=True, eq=False)
class Demand:
    """What a mechanism is to do.

    Attributes
    ----------
    system : System
    driver : str
    quantities : tuple of str
        Measured ones: x and y of a point, or one output.
    goals : array (quantities, points)
    timing : array (points,) or None
        Values of the driver at the points: of a path their differences count.
    fixed : bool
        Whether the values themselves count.
    closed, angular : bool
        Whether the path is closed, and whether an output is an angle, of which turns do not count.
    span : (float, float)
        Range of the driver that is searched.
    whole : bool
        Whether that is a turn.
    by : mapping
        Bounds by name.
    point : tuple of str
        The numbers of `by` that are coordinates of the point on its body, x and y, or empty.
    body : str
        That body.
    """

    system: System
    driver: str
    quantities: tuple[str, ...]
    goals: np.ndarray
    timing: np.ndarray | None
    fixed: bool
    closed: bool
    angular: bool
    span: tuple[float, float]
    whole: bool
    by: Mapping[str, tuple[float, float]]
    point: tuple[str, ...] = ()
    body: str = ""


@dataclass(frozen=True, eq=False)
class FoundDesign:
    """Numbers, values of the driver at the points, first poses of the bodies, and the misses."""

    values: dict[str, float]
    theta: np.ndarray
    guess: dict[str, tuple[float, float, float]]
    misses: np.ndarray


def searched(demand: Demand, count: int, starts: int, seed: int) -> list[FoundDesign]:
    """The refined designs of the best starts of `count`, the best first."""
    found = [_refined(demand, *start) for start in _starts(demand, count, starts, seed)]
    good = [one for one in found if one is not None]
    return sorted(good, key=lambda one: float(np.square(one.misses).sum()))


def _starts(
    demand: Demand, count: int, keep: int, seed: int
) -> list[tuple[np.ndarray, np.ndarray, dict[str, tuple[float, float, float]]]]:
    """Numbers, values of the driver and first poses of the best designs of a sweep."""
    order, s = _orders(demand)
    place = order % len(s)
    bodies = [body.name for body in demand.system.mechanism.bodies]
    measures = {f"q{n}": of for n, of in enumerate(demand.quantities)}
    measures |= {
        f"{body} {key}": f"{body}.{of}"
        for body in bodies
        for key, of in (("x", "origin.x"), ("y", "origin.y"), ("angle", "angle"))
    }
    samples = latin_hypercube(dict(demand.by), count, seed)
    run = sweep(demand.system, samples, "kinematics", measures, drive={demand.driver: s})
    values = np.column_stack([run.parameter(name) for name in demand.by])
    curves = np.stack([run[f"q{n}"] for n in range(len(demand.quantities))], axis=1)
    poses = np.stack([run[f"{b} {k}"] for b in bodies for k in ("x", "y", "angle")], axis=1)
    found: list[tuple[float, Any]] = []
    for n in np.flatnonzero(np.isfinite(curves).all(axis=(1, 2))):
        off = demand.goals[:, None, :] - curves[n][:, place]  # (quantities, timings, points)
        x = values[n].copy()
        if demand.point:
            off, x = _placed(demand, off, x, run[f"{demand.body} angle"][n][place])
        if demand.angular:
            off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
        errors = np.square(off).sum(axis=(0, 2))
        k = int(errors.argmin())
        theta = s[place[k]] + (order[k] // len(s)) * 2.0 * np.pi * demand.whole
        pose = poses[n][:, place[k][0]].reshape(-1, 3)
        guess = {body: (*map(float, row),) for body, row in zip(bodies, pose, strict=True)}
        best = x[k] if demand.point else x
        found.append((float(errors[k]), (best, theta, guess)))
    found.sort(key=lambda pair: pair[0])
    return [start for _, start in found[:keep]]


def _orders(demand: Demand) -> tuple[np.ndarray, np.ndarray]:
    """Timings as instants, and the values of the driver at those."""
    low, high = demand.span
    if demand.fixed:
        timing = np.asarray(demand.timing)
        return np.arange(len(timing))[None, :], timing
    points = demand.goals[0] + 1j * demand.goals[1]
    s = low + np.arange(INSTANTS) * ((high - low) / INSTANTS)
    order = timings(points, demand.timing, demand.closed and demand.whole, high - low)
    if not demand.whole:
        order = order[((order >= 0) & (order < INSTANTS)).all(axis=1)]
    return order, s


def _placed(
    demand: Demand, off: np.ndarray, x: np.ndarray, angle: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The place of the point on its body that suits every timing best, within bounds: what is left
    of the distances, and the numbers of each timing.
    """
    turned = (off[0] + 1j * off[1]) * np.exp(-1j * angle)  # in the axes of the body
    shift = turned.mean(axis=-1)
    rows = np.tile(x, (len(shift), 1))
    names = list(demand.by)
    for name, part in zip(demand.point, (shift.real, shift.imag), strict=True):
        k = names.index(name)
        rows[:, k] = np.clip(rows[:, k] + part, *demand.by[name])
    moved = [rows[:, names.index(name)] - x[names.index(name)] for name in demand.point]
    left = turned - (moved[0] + 1j * moved[1])[:, None]
    return np.stack([left.real, left.imag]), rows


class Refinement:
    """Misses and their derivatives by the numbers and the values of the driver that are free."""

    def __init__(self, demand: Demand, guess: dict[str, tuple[float, float, float]]) -> None:
        self.demand, self.guess = demand, guess
        self.names = list(demand.by)
        timing = demand.timing
        self.steps = np.zeros(1) if timing is None else timing - timing[0]
        self.free = 0 if demand.fixed else (1 if timing is not None else demand.goals.shape[1])
        self.run: Any = None
        self.y: np.ndarray | None = None

    def theta(self, y: np.ndarray) -> np.ndarray:
        """Values of the driver at the points."""
        if self.demand.fixed:
            return np.asarray(self.demand.timing)
        return np.asarray(y[len(self.names) :] + self.steps)

    def residual(self, y: np.ndarray) -> np.ndarray:
        """NaN where the mechanism does not close or does not reach all points."""
        system = self.demand.system.with_values(dict(zip(self.names, y.tolist(), strict=False)))
        drive = {self.demand.driver: (self.theta(y), 1.0)}
        try:
            self.run = kinematics(system, drive=drive, guess=self.guess)
        except SolveError:
            return np.full(self.demand.goals.size, np.nan)
        self.y = y.copy()
        off = np.stack([self.run.measure(q) for q in self.demand.quantities]) - self.demand.goals
        if self.demand.angular:
            off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(off.reshape(-1))

    def jacobian(self, y: np.ndarray) -> np.ndarray:
        """Exact derivatives of the misses; the next positions are closed near those of y."""
        if self.y is None or (self.y != y).any():
            self.residual(y)
        self.guess = self.poses()
        found = gradient_at(self.run, list(self.demand.quantities), self.names)
        by = found.jacobian if found.jacobian.ndim == 3 else found.jacobian[:, None, :]
        columns = [by.reshape(-1, len(self.names))]
        if self.free:
            owner = self.demand.quantities[0][:-2]
            rates = np.concatenate([self.run.measure(f"{owner}.v{axis}") for axis in "xy"])
            points = self.demand.goals.shape[1]
            whole = np.zeros((2 * points, self.free))
            places = np.tile(np.arange(points), 2) if self.free > 1 else np.zeros(2 * points, int)
            whole[np.arange(2 * points), places] = rates
            columns.append(whole)
        return np.hstack(columns)

    def poses(self) -> dict[str, tuple[float, float, float]]:
        """Poses of the bodies at the first point."""
        return {
            body.name: (
                float(self.run.measure(f"{body.name}.origin.x")[0]),
                float(self.run.measure(f"{body.name}.origin.y")[0]),
                float(self.run[body.name].angle[0]),
            )
            for body in self.demand.system.mechanism.bodies
        }


def _refined(
    demand: Demand,
    x: np.ndarray,
    theta: np.ndarray,
    guess: dict[str, tuple[float, float, float]],
) -> FoundDesign | None:
    from scipy.optimize import least_squares

    task = Refinement(demand, guess)
    low, high = np.array(list(demand.by.values())).T
    width = WITHIN * (high - low)
    begin = np.concatenate([np.clip(x, low + width, high - width), theta[: task.free]])
    endless = np.full(task.free, np.inf)
    if not np.isfinite(task.residual(begin)).all():
        return None
    # what is small in the gradient is so beside the goals, whatever the unit
    size = 1.0 if demand.angular else float(np.ptp(demand.goals, axis=-1).max()) or 1.0
    found = least_squares(
        lambda y: task.residual(y) / size,
        begin,
        lambda y: task.jacobian(y) / size,
        bounds=(np.concatenate([low, -endless]), np.concatenate([high, endless])),
        x_scale="jac",
        ftol=ENDS,
        xtol=ENDS,
        gtol=ENDS,
        max_nfev=EVALUATIONS,
    )
    off = task.residual(found.x)
    if not np.isfinite(off).all():
        return None
    values = dict(zip(task.names, found.x.tolist(), strict=False))
    misses = np.sqrt(np.square(off.reshape(demand.goals.shape)).sum(axis=0))
    return FoundDesign(values, task.theta(found.x), task.poses(), misses)
