"""Close the loops at the first instant and follow the motion through all of them."""

from __future__ import annotations

import functools
import inspect
import warnings
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from mbody.analysis.assemblies.chosen_assembly import chosen_assembly
from mbody.analysis.contact.closed_contacts import with_closed_contacts
from mbody.analysis.driven.batch import batch
from mbody.analysis.driven.change_points import through_change_points
from mbody.analysis.driven.closed_contact_report import with_contact_report
from mbody.analysis.driven.dead_centres import DeadCentre, with_ends
from mbody.analysis.driven.friction_notes import with_friction_notes
from mbody.analysis.driven.runner import PathEnded, Runner
from mbody.analysis.driven.time_grid import (
    BY_DRIVER,
    BY_TIME,
    Drive,
    TimeGrid,
    by_time,
    check_timed,
    time_grid,
)
from mbody.analysis.position.assembly_analysis import as_system, check_determined, closed
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.errors import ModelError, ModelWarning, SolveError
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.quantities.types import PlainNumbers
from mbody.solution.certificate import as_reported, changed
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["documented", "driven"]

#: Way of a driver [rad, length] that is not followed to see whether a position is meant.
FAR = 1e3
#: Positions closer than this are one, in model lengths and radians.
SAME = 1e-6

Analysis = TypeVar("Analysis", bound=Callable[..., Solution])

#: What the docstrings of kinematics, kinetostatics and statics share.
SHARED = {
    "{parameters}": """
Parameters
----------
model : Mechanism or System
    Driven so that no freedom is left.
t : float or array (instants,), optional
    Times at which the laws of the drivers are taken, by default 0.
drive : mapping, optional
    Instead of laws: value, or (value, rate, acceleration), of drivers by name, floats or arrays
    (instants,), angles in rad. Drivers that are not named keep their laws.
turn : str or True, optional
    A whole turn of this driver (or driven body) from t = 0 on, at equal angles, both ends
    included, with the rates of its law.
instants : int, optional
    How many of a turn, by default 361, and 360 more for each further one.
turns : int, optional
    How many turns the driver makes, by default 1; 2 of a four-stroke engine.
guess : mapping, optional
    By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes. It
    chooses the branch; between instants the branch is followed.
assembly : str or int, optional
    In place of a guess the name or the number of one of the `assembly_modes` at the first
    instant, such as ``"open"``, ``"crossed"`` or 1.
""",
    "{raises}": """
Raises
------
ModelError
    For instants, drivers or guesses that do not fit the mechanism.
SolveError
    When loops do not close, the motion is not determined, a dead centre is in the way, or a
    function of the user failed. It carries what was computed before.
""",
}


def documented(analysis: Analysis) -> Analysis:
    """Put the shared sections into the docstring of a driven analysis."""
    if analysis.__doc__ is not None:
        text = inspect.cleandoc(analysis.__doc__)
        for place, section in SHARED.items():
            text = text.replace(place, section.strip())
        analysis.__doc__ = text
    return analysis


def driven(
    model: Mechanism | System,
    analysis: str,
    t: PlainNumbers | None,
    drive: Drive | None,
    turn: str | bool | None,
    instants: int | None,
    turns: int | None,
    guess: Guesses | None,
    assembly: str | int | None = None,
    before: int = 0,
) -> Solution:
    """Run a driven analysis: on lanes where there are many instants, else step by step. The first
    so many instants, `before` those requested, lead there and are left out.
    """
    system = as_system(model)
    check_timed(system)
    grid = time_grid(system, t, drive, turn, instants, turns)
    if assembly is not None:
        if guess:
            raise ModelError("give a guess or an assembly, not both: each chooses the branch")
        guess = chosen_assembly(system, _first_values(system, grid), assembly)
    chosen = with_closed_contacts(system, float(grid.t[0]), grid.first(system), guess)
    system, guess = chosen.system, chosen.guess
    runner = Runner(system, analysis)
    meant = None if guess else functools.partial(_as_from_start, runner, grid)
    start = closed(system, float(grid.t[0]), grid.first(system), guess, meant=meant)
    found = _followed(runner, start, grid, chosen.remedy)
    if before:
        found = found.take(np.arange(before, len(found)))
    found = with_contact_report(with_friction_notes(found), chosen.notes)
    pulling = runner.pulled(start, grid, found)
    if pulling:
        found = changed(found, notes=(*as_reported(found).notes, *pulling))
    return found


def _first_values(system: System, grid: TimeGrid) -> dict[str, float]:
    """Where the drivers of one design stand at the first instant."""
    if system.batch is not None:
        return {}
    laws = {driver.name: float(system.law_of(driver)(grid.t[0])) for driver in system.leaders}
    return laws | grid.first(system)


def _as_from_start(runner: Runner, grid: TimeGrid, found: ClosedPosition) -> bool:
    """Whether a first position is that of the motion which begins at t = 0, where the description's
    guesses are; not where that cannot be decided.
    """
    system, drivers = runner.system, runner.system.drivers
    if system.batch is not None or not drivers or system.leaders != drivers:
        return False
    try:
        begin = np.array([system.law_of(driver).derivatives(0.0) for driver in drivers])
        end = begin.copy()
        if grid.mode == BY_TIME:
            end[:, 0] = [system.law_of(driver)(grid.t[0]) for driver in drivers]
            way = by_time(system, np.array([0.0, grid.t[0]]))
        else:
            end[:, 0] = grid.given[0, :, 0]
            given = np.stack([begin, end])
            s = given[:, 0, 0] if grid.mode == BY_DRIVER else np.array([0.0, 1.0])
            way = TimeGrid(grid.mode, np.ascontiguousarray(s), np.zeros(2), given)
        if (np.abs(end - begin)[:, 0] > FAR).any() or (end[:, 0] == begin[:, 0]).all():
            return False
        with warnings.catch_warnings():
            warnings.simplefilter("error", ModelWarning)
            start = closed(system, 0.0, {})
        q = Runner(system, runner.analysis).scalar(start, way, with_forces=False)[-1, :, 0]
    except (ModelError, SolveError, ModelWarning, PathEnded):
        return False
    n = system.coordinates
    off = (q[:n] - found.work.q[:n, 0]).reshape(-1, 3)
    turned = np.abs(np.exp(1j * off[:, 2]) - 1.0).max()
    return bool(max(np.abs(off[:, :2]).max() / system.length, turned) < SAME)


def _followed(runner: Runner, start: ClosedPosition, grid: TimeGrid, remedy: str) -> Solution:
    """The motion at all instants of the grid; `remedy`: what else may be done where something is
    free.
    """
    system = runner.system
    if system.batch is not None:
        return batch(runner, start, grid)
    try:
        check_determined(system, start, runner.analysis, remedy)
    except SolveError as error:
        return through_change_points(runner, start, grid, {0}, error)
    try:
        return _single(runner, start, grid)
    except DeadCentre as stop:
        raise with_ends(stop, system, start) from None


def _single(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> Solution:
    try:
        record = runner.record(start, grid)
    except PathEnded as stuck:
        error = runner.explain(stuck, start, grid)
        # an instant at which branches meet is reached as a limit, where the path goes on
        near = abs(stuck.place - grid.s[stuck.done]) <= 1e-3 * np.ptp(grid.s)
        if not near:
            raise error from None
        return through_change_points(runner, start, grid, {stuck.done}, error)
    return runner.solution(start, grid, record)
