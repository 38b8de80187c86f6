"""Impacts on stops: derivatives of a stop's coordinate, and the jump of the velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.kernels.layout import Work
from mbody.model.driver import DRIVEN
from mbody.model.study import Measure
from mbody.quantities import parse
from mbody.solution.histories import Record
from mbody.solution.measures import measured
from mbody.solution.solution import Solution
from mbody.system.rank import dense, rank_of
from mbody.system.system import System

__all__ = [
    "StopCoordinate",
    "has_exact_rates",
    "motion_at",
    "rates",
    "stop_coordinate",
    "values",
    "velocity_jump",
]

Array = np.ndarray

#: Step of the differences, in model lengths and radians; of fourth order, its error is near 1e-12.
STEP = 1e-3
#: Of a rate along a motion, as a part of the time between samples: its error is 1e-11 of it.
MOMENT = 6e-6
#: Quantities of a motion that positions, velocities and accelerations carry on.
CARRIED = {"x", "y", "angle", "vx", "vy", "omega", *DRIVEN}
#: The same for time, as a part of the motion: what moves a stop is slower than that.
INSTANT = 1e-6


@dataclass(frozen=True, eq=False)
class StopCoordinate:
    """A coordinate g and how it changes.

    Attributes
    ----------
    value : float
        g.
    gradient : array (coordinates,)
        ∂g/∂q.
    drift : float
        ∂g/∂t.
    size : float
        |∂g/∂q| with lengths by the model length: what g is to be judged by.
    """

    value: float
    gradient: Array
    drift: float
    size: float

    def rate(self, v: Array) -> float:
        """ġ."""
        return float(self.gradient @ v) + self.drift


def motion_at(system: System, t: Array, pages: Array) -> Solution:
    """Pages (instants, rows, 1) of a motion as a solution."""
    return Solution(system, "simulate", t, Record([pages], len(t), batch=False), None)


def values(system: System, measures: list[Measure], t: Array, pages: Array) -> Array:
    """Measured quantities (measures, instants) of pages (instants, rows, 1)."""
    run = motion_at(system, t, pages)
    return np.array([measured(run, measure)[0] for measure in measures]).reshape(-1, len(t))


def has_exact_rates(of: Measure) -> bool:
    """Whether a quantity is made of positions, velocities and laws of time alone."""
    names = parse(of.of).names
    return all(name.rpartition(".")[2] in CARRIED for name in names if "." in name)


def rates(system: System, measures: list[Measure], t: Array, pages: Array, step: float) -> Array:
    """Rates (measures, instants) of quantities that are `has_exact_rates`, `step` being the time
    between samples: central differences along velocities and accelerations.
    """
    n, moment = system.coordinates, MOMENT * step
    q, v, a = (pages[:, k * n : (k + 1) * n] for k in range(3))
    beside = np.concatenate([pages, pages])
    middle = q + 0.5 * moment * moment * a
    beside[:, :n] = np.concatenate([middle + moment * v, middle - moment * v])
    beside[:, n : 2 * n] = np.concatenate([v + moment * a, v - moment * a])
    times = np.concatenate([t + moment, t - moment])
    found = values(system, measures, times, beside).reshape(len(measures), 2, -1)
    return np.asarray((found[:, 0] - found[:, 1]) / (2.0 * moment))


def stop_coordinate(system: System, of: Measure, t: float, q: Array, span: float) -> StopCoordinate:
    """A coordinate and its derivatives at a position, by differences; `span` is the whole time."""
    n = len(q)
    scale = system.coordinate_units
    ways = np.vstack([STEP * np.diag(scale), np.zeros((1, n))])
    parts = np.array([0.0, 1.0, -1.0, 2.0, -2.0])
    pages = np.zeros((len(parts), n + 1, n))
    pages[:] = q + parts[:, None, None] * ways
    instants, moment = np.full((len(parts), n + 1), t), INSTANT * (span or 1.0)
    instants[:, -1] += moment * parts
    zero = np.zeros((pages.shape[0] * (n + 1), 2 * n))
    rows = np.hstack([pages.reshape(-1, n), zero])[:, :, None]
    found = values(system, [of], instants.reshape(-1), rows)[0].reshape(len(parts), n + 1)
    change = (8.0 * (found[1] - found[2]) - (found[3] - found[4])) / 12.0
    gradient = change[:-1] / (STEP * scale)
    size = float(np.linalg.norm(gradient * scale))
    return StopCoordinate(float(found[0, 0]), gradient, float(change[-1] / moment), size)


def second_rate(system: System, of: Measure, t: float, q: Array, v: Array, a: Array) -> float:
    """g̈ along a motion, by a second difference."""
    n = len(q)
    scale = system.coordinate_units
    swift = max(float(np.abs(v / scale).max()), float(np.sqrt(np.abs(a / scale).max())), 1e-300)
    step = STEP / swift
    way = np.array([[0.0], [step], [-step]])
    rows = np.hstack([q + way * v + 0.5 * way**2 * a, np.zeros((3, 2 * n))])[:, :, None]
    here, ahead, behind = values(system, [of], t + way[:, 0], rows)[0]
    return float((ahead - here + (behind - here)) / step**2)


def velocity_jump(system: System, work: Work, at: StopCoordinate) -> Array | None:
    """How velocities change that the joints allow, for a change of ġ by one; None where nothing
    that is free changes it.

    u/(c u) with u = N (Nᵀ M N)⁻¹ Nᵀ cᵀ, N the free directions: bodies without mass are ordinary.
    """
    n = len(at.gradient)
    scale = system.coordinate_units
    motions = rank_of(dense(system, work)[1]).motions
    along = motions @ (at.gradient * scale)
    if not np.linalg.norm(along) > 1e-9 * at.size:
        return None
    inertia = (motions * (system.mass[:n, 0] * scale**2)) @ motions.T
    way = np.linalg.solve(inertia, along)
    return np.asarray(scale * (way @ motions) / float(along @ way))
