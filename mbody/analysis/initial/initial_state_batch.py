"""How the free motions of many designs begin: positions and velocities as `simulate` of each has
them, closed in one call of the kernels.

Driven designs close from the one position of the description, so that all are on its branch; here
each closes from its own guess, as it would alone, which may be on another branch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import (
    initial_state_of,
    start_drivers,
    state_of,
    with_start_drivers,
)
from mbody.analysis.position.assembly_analysis import rounding
from mbody.analysis.position.closed_designs import close_batch
from mbody.analysis.position.initial_guess import placed
from mbody.analysis.position.whole_turns import by_rows
from mbody.errors import ModelError, SolveError
from mbody.kernels.loop_closure import laws_of_time, project_designs
from mbody.model.body import Guesses
from mbody.model.element import Numbers
from mbody.model.numbers import moves_nothing
from mbody.model.simulation import SimulationSettings
from mbody.quantities.types import Number
from mbody.solution.places import link_poses
from mbody.solution.solution import Solution
from mbody.system.polar_points import polar_points
from mbody.system.system import System

__all__ = ["BatchStart", "batch_start", "initial_states"]

Array = np.ndarray

#: The least pivot, as a part of its diagonal, of a start that is about 1e-3 rad away from a
#: singular position: from there on rows alone give rates to nine digits.
SINGULAR = 1e-6
#: Velocities that agree with drivers to this part of the rates are as good as exact.
AGREE = 1e-9


@dataclass(frozen=True, eq=False)
class BatchStart:
    """How the designs of a batch begin.

    Attributes
    ----------
    simulation : SimulationSettings or None
        What prescribes it; None where guesses do.
    guess, rates : mapping or None
        As of `close_loops`; rates are taken design by design.
    places, turning : System
        With drivers that fix what has a place, and with those that drive what has a rate.
    alike : bool
        Whether all designs begin from the same guess.
    """

    simulation: SimulationSettings | None
    guess: Guesses | None
    rates: Mapping[str, Number] | None
    places: System
    turning: System
    alike: bool


def batch_start(
    system: System, names: tuple[str, ...], how: Mapping[str, Any]
) -> tuple[BatchStart, Solution]:
    """How designs of a system begin that differ in `names`, and how the system itself does.

    Raises
    ------
    ModelError, SolveError
        Where the system itself does not begin.
    """
    own, guess, rates = system.mechanism.simulation, how.get("guess"), how.get("rates")
    machine = system.mechanism
    alike = all(name not in machine.parameters and moves_nothing(machine, name) for name in names)
    if own is None or guess is not None or rates is not None:
        first = close_loops(system, guess=guess, rates=rates)
        return BatchStart(None, guess, rates, system, system, alike), first
    first = initial_state_of(system, own)
    places = turning = with_start_drivers(system, start_drivers(system, own, rates=False, poses={}))
    moving = start_drivers(system, own, rates=True, poses=link_poses(first))
    if moving:
        turning = with_start_drivers(system, moving)
    return BatchStart(own, None, None, places, turning, alike), first


def initial_states(
    start: BatchStart, system: System, values: Mapping[str, Array]
) -> tuple[Array, Array, np.ndarray]:
    """Positions and velocities, each (designs, coordinates), and which of them can be trusted.

    Parameters
    ----------
    system : System
        A batch.
    values : mapping
        What the designs differ in.
    """
    if start.rates is not None:
        return _one_by_one(start, system)
    designs, n3 = int(system.batch or 0), system.coordinates
    places = start.places.with_values(values)
    first, still = _driver_values(start, system, places, rates=False)
    poses = _first_poses(start, places, first)
    # at or near a singular position the branch has to be looked at: one by one
    good = close_batch(places, 0.0, first, poses, rounding(places, poses), SINGULAR)
    turning, rates = places, still
    if start.turning is not start.places:
        turning = start.turning.with_values(values)
        _, rates = _driver_values(start, system, turning, rates=True)
    velocities, off = np.empty((designs, n3)), np.empty(designs)
    project_designs(turning.layout, turning.work(), turning.par, poses, rates, velocities, off)
    return poses[:, :n3], velocities, good & (off <= AGREE)


def _one_by_one(start: BatchStart, system: System) -> tuple[Array, Array, np.ndarray]:
    """The same where rates are prescribed that joints may not allow."""
    designs, n3 = int(system.batch or 0), system.coordinates
    q, v, good = np.zeros((designs, n3)), np.zeros((designs, n3)), np.zeros(designs, dtype=bool)
    for design in range(designs):
        one = system.design(design)
        try:
            first = close_loops(one, guess=start.guess, rates=start.rates)
        except (ModelError, SolveError):
            continue
        _, q[design], v[design] = state_of(one, first)
        good[design] = not first.regularization
    return q, v, good


def _driver_values(
    start: BatchStart, system: System, driven: System, *, rates: bool
) -> tuple[Array, Array]:
    """Values and rates of all drivers, NaN where their laws give them: (designs, drivers) each."""
    designs, count = int(system.batch or 0), len(driven.drivers)
    values, speeds = np.full((2, designs, count), np.nan)
    if start.simulation is not None:
        last = start_drivers(system, start.simulation, rates=rates, poses={})
        for column, (_, _, value, speed) in enumerate(last, count - len(last)):
            values[:, column], speeds[:, column] = value, speed
    return values, speeds


def _first_poses(start: BatchStart, places: System, first: Array) -> Array:
    """First pose of every design: (designs, coordinates + 3)."""
    designs, names = len(first), [driver.name for driver in places.drivers]
    work, rows = places.work(), places.layout.driver_row
    poses = np.empty((designs, places.coordinates + 3))
    machine, polar = places.mechanism, polar_points(places.mechanism)
    plain = {name: value for name, value in places.values.items() if not np.ndim(value)}
    varied = {name: value for name, value in places.values.items() if np.ndim(value)}
    for design in range(1 if start.alike else designs):
        work.par[:, 0] = places.par[:, design]
        laws_of_time(places.layout, work)
        values = np.where(np.isnan(first[design]), work.signal[rows, 0], first[design])
        drive = dict(zip(names, values.tolist(), strict=True))
        own = plain | {name: value[design] for name, value in varied.items()}
        numbers = Numbers(own, polar, machine.bodies)
        poses[design] = placed(places, start.guess, drive, numbers=numbers)
        by_rows(places, poses[design], drive, numbers)
    if start.alike:
        poses[:] = poses[0]
    return poses
