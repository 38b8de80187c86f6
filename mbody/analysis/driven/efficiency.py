"""Efficiency of a motion: work given, useful and lost, integrated between changes of sense."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.solution.checks import each_load_of, one_design
from mbody.solution.friction_results import Efficiency
from mbody.solution.places import link_poses
from mbody.solution.rough_pairs import pair_rates, rough_pairs
from mbody.solution.solution import Solution

__all__ = ["efficiency"]

Array = np.ndarray

#: Nodes of Gauss's rule between two changes of sense, in so many equal parts of the motion.
NODES, PARTS = 8, 24
#: Work below this part of the greatest that goes in or out is none.
NOTHING = 1e-9
#: Values and rates of a driver that differ by less are those of its law.
ALIKE = 1e-9
#: Halvings by which an instant is found at which a joint changes the sense of its sliding, after
#: the cubic through both rates and their changes.
HALVINGS = 60


def efficiency(found: Solution, output: str) -> Efficiency:
    """See `Solution.efficiency`."""
    machine = found.mechanism
    drivers = [driver.name for driver in machine.drivers]
    loads = [load.name for load in machine.loads]
    if not found.has_forces:
        raise ModelError(f"{found.analysis} finds no forces, and no work: use kinetostatics")
    one_design(found, "an efficiency is of one design")
    if output not in (*drivers, *loads):
        raise ModelError(
            f"there is no load or driver {output!r} (there are: {listed([*loads, *drivers])}): "
            "name what the mechanism works against",
            str(output),
        )
    if len(found) < 2:
        raise ModelError(
            "an efficiency is of a motion, this is one instant: analyse a turn, or several times"
        )
    run, weights = _integrated(found)
    efforts = {name: _power(run, name) for name in drivers if name != output}
    given = float(sum(weights @ power for power in efforts.values()))
    useful = -float(weights @ _power(run, output))
    lost = float(sum(weights @ power for power in run.losses.values()))
    if not given > NOTHING * max(abs(given), abs(useful), lost):
        raise ModelError(
            f"the drivers of '{machine.name}' give no work over this motion: what gives it must be "
            "a driver, or take a part of the motion in which one drives",
        )
    return Efficiency(useful / given, given, useful, lost)


def _power(run: Solution, name: str) -> Array:
    """Power that a load or a driver gives to the mechanism."""
    element: Any = run.mechanism[name]
    if element.role == "driver":
        own: Array = run.measure(f"{name}.power")
        return own
    total = np.zeros(len(run))
    bodies = [body.name for body in run.mechanism.bodies]
    n = [load.name for load in run.mechanism.loads].index(name)
    for k in range(len(run)):
        for body, (fx, fy, torque) in zip(bodies, each_load_of(run, k)[n], strict=True):
            now = run[body]
            total[k] += fx * now.vx[k] + fy * now.vy[k] + torque * now.omega[k]
    return total


def _integrated(found: Solution) -> tuple[Solution, Array]:
    """Instants by which the motion is integrated, with their weights."""
    if found.analysis != "kinetostatics" or not _by_laws(found):
        t = found.t
        weights = np.zeros(len(t))
        weights[:-1] += 0.5 * np.diff(t)
        weights[1:] += 0.5 * np.diff(t)
        return found, weights
    ends = np.linspace(found.t[0], found.t[-1], PARTS + 1)
    ends = np.unique(np.concatenate([ends, _changes(found)]))
    x, w = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * np.diff(ends)
    nodes = (0.5 * (ends[1:] + ends[:-1])[:, None] + half[:, None] * x).ravel()
    weights = (half[:, None] * w).ravel()
    poses = dict(link_poses(found.take([0])))
    return kinetostatics(found.system, nodes, guess=poses), weights


def _by_laws(found: Solution) -> bool:
    """Whether the laws of the drivers, at the times of the instants, led the motion."""
    if found.given is None:
        return True
    for n, driver in enumerate(found.system.drivers):
        if driver not in found.system.leaders:
            continue
        law = found.system.law_of(driver)
        own = np.array([law.derivatives(float(t)) for t in found.t])
        size = np.abs(own).max(axis=0)
        if (np.abs(found.given[:, n] - own) > ALIKE * size + ALIKE).any():
            return False
    return True


def _changes(found: Solution) -> Array:
    """Times at which a joint changes the sense of its sliding."""
    rates, t = pair_rates(found), found.t
    times = []
    for n, pair in enumerate(rough_pairs(found.system)):
        if not pair.loses:
            continue
        rate, change = rates[:, n, 0], rates[:, n, 1]
        for k in np.flatnonzero(rate[1:] * rate[:-1] < 0.0):
            h = t[k + 1] - t[k]
            low, high = 0.0, 1.0
            for _ in range(HALVINGS):
                s = 0.5 * (low + high)
                # Hermite's cubic
                a, b = (1.0 + 2.0 * s) * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)
                c, d = s * (1.0 - s) ** 2, s * s * (s - 1.0)
                here = a * rate[k] + b * rate[k + 1] + h * (c * change[k] + d * change[k + 1])
                low, high = (s, high) if here * rate[k] > 0.0 else (low, s)
            times.append(t[k] + high * h)
    return np.array(times)
