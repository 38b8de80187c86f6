"""Quantities that events are of, and their rates, along a motion."""

from __future__ import annotations

import numpy as np

from mbody.model.driver import DRIVEN
from mbody.model.study import Measure
from mbody.quantities import parse
from mbody.solution.histories import Record
from mbody.solution.measures import measured
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["has_exact_rates", "motion_at", "rates", "values"]

Array = np.ndarray

#: Step of a rate along a motion, as a part of the time between samples: its error is 1e-11 of it.
MOMENT = 6e-6
#: Quantities of a motion that positions, velocities and accelerations carry on.
CARRIED = {"x", "y", "angle", "vx", "vy", "omega", *DRIVEN}


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
