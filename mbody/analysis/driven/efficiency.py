"""Efficiency of a motion: work given, useful and lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import kinetostatics
from mbody.core.tolerances import LAW_VALUES_SAME, WORK_AGREES, WORK_NONE
from mbody.errors import ModelError
from mbody.model.element import unknown_name
from mbody.solution.checks import each_load_of
from mbody.solution.doubts import inherited
from mbody.solution.friction_results import Efficiency
from mbody.solution.histories import link_poses, one_design
from mbody.solution.solution import Solution

Array = np.ndarray

#: Nodes of Gauss's rule in each part of a motion, and parts at first.
NODES, PARTS = 8, 24
#: How often parts of the motion are halved, at most, until the work of a part and of its halves
#: agree.
HALVINGS = 36


def efficiency(found: Solution, output: str) -> Efficiency:
    """Work put in by the drivers, delivered at the output and lost to friction and damping; the
    body of `Solution.efficiency`.
    """
    machine = found.mechanism
    drivers = [driver.name for driver in machine.drivers]
    loads = [load.name for load in machine.loads]
    if not found.has_forces:
        raise ModelError(f"{found.analysis} finds no forces, and no work: use kinetostatics")
    one_design(found, "an efficiency is of one design")
    if output not in (*drivers, *loads):
        raise unknown_name(
            "load or driver",
            output,
            [*loads, *drivers],
            more=": name what the mechanism works against",
        )
    if len(found) < 2:
        raise ModelError(
            "an efficiency is of a motion, this is one instant: analyse a turn, or several times"
        )
    inputs = [name for name in drivers if name != output]
    given, useful, lost = _works(found, output, inputs)
    if not given > WORK_NONE * max(abs(given), abs(useful), lost):
        raise ModelError(
            f"the drivers of '{machine.name}' give no work over this motion: what gives it must be "
            "a driver, or take a part of the motion in which one drives"
        )
    said = inherited(found, of=[lambda one: _powers(one, output, inputs)])
    return Efficiency(useful / given, given, useful, lost, **said)


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


def _works(found: Solution, output: str, inputs: list[str]) -> tuple[float, float, float]:
    """Work given by the drivers, done on the output, lost in joints."""
    energy = found.energy
    if energy is not None and output in energy.by:  # where loads are very many only all are
        given = sum(float(energy.by[name][-1] - energy.by[name][0]) for name in inputs)
        useful = float(energy.by[output][0] - energy.by[output][-1])
        return given, useful, float(sum(part[-1] - part[0] for part in energy.lost.values()))
    if found.analysis == "kinetostatics" and _by_laws(found):
        given, useful, lost = _integrated(found, lambda run: _powers(run, output, inputs))
    else:
        powers, h = _powers(found, output, inputs), np.diff(found.t)
        given, useful, lost = (0.5 * (powers[1:] + powers[:-1]) * h[:, None]).sum(axis=0)
    return float(given), float(useful), float(lost)


def _powers(run: Solution, output: str, inputs: list[str]) -> Array:
    """Powers given, useful and lost: (instants, 3)."""
    found = np.zeros((len(run), 3))
    for name in inputs:
        found[:, 0] += _power(run, name)
    found[:, 1] = -_power(run, output)
    for power in run.losses.values():
        found[:, 2] += power
    return found


def _integrated(found: Solution, powers: Callable[[Solution], Array]) -> Array:
    """Integrals of powers over the motion by Gauss's rule.

    Powers bend and jump where a joint slides the other way, or a slider the end that
    presses: parts whose halves have another work are halved until they are so narrow that nothing
    of it is left.
    """
    poses = dict(link_poses(found.take([0])))
    posts = np.linspace(found.t[0], found.t[-1], PARTS + 1)
    x, weights = np.polynomial.legendre.leggauss(NODES)

    def works(low: Array, high: Array) -> tuple[Array, Array]:
        half = 0.5 * (high - low)[:, None]
        nodes = 0.5 * (high + low)[:, None] + half * x
        # posts keep the distance from node to node short
        t, places = np.unique(np.append(posts, nodes), return_inverse=True)
        run = kinetostatics(found.system, t, guess=poses)
        values = powers(run)[places[len(posts) :]].reshape(*nodes.shape, -1)
        both = (half[:, :, None] * one for one in (values, np.abs(values)))
        own, size = (np.einsum("n,pnc->pc", weights, one) for one in both)
        return own, size

    low, high = posts[:-1], posts[1:]
    coarse, size = works(low, high)
    total, accepted = np.zeros(coarse.shape[1]), WORK_AGREES * float(size.sum(axis=0).max())
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = np.append(low, middle), np.append(middle, high)
        halves = works(low, high)[0]
        both = halves.reshape(2, *coarse.shape).sum(axis=0)
        uneven = np.abs(both - coarse).max(axis=1) > accepted
        total += both[~uneven].sum(axis=0)
        kept = np.tile(uneven, 2)
        low, high, coarse = low[kept], high[kept], halves[kept]
        if not len(low):
            break
    return np.asarray(total + coarse.sum(axis=0))


def _by_laws(found: Solution) -> bool:
    """Whether the laws of the drivers, at the times of the instants, led the motion."""
    if found.given is None:
        return True
    for n, driver in enumerate(found.system.drivers):
        if driver not in found.system.independent_drivers:
            continue
        law = found.system.law_of(driver)
        own = np.array([law.derivatives(float(t)) for t in found.t])
        size = np.abs(own).max(axis=0)
        if (np.abs(found.given[:, n] - own) > LAW_VALUES_SAME * size + LAW_VALUES_SAME).any():
            return False
    return True
