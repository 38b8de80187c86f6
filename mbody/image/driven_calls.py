"""The calls of an image for driven motion: closing the loops, a turn, a step of a drag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.runner import Runner
from mbody.analysis.driven.time_grid import BY_DRIVER, BY_INSTANT, BY_TIME, TimeGrid, time_grid
from mbody.analysis.position.assembly_analysis import check_determined, closed, rounding
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.errors import ModelError
from mbody.image.arena import Arena
from mbody.image.measured_quantities import MeasuredProgram
from mbody.kernels.continuation import PROGRESS, DrivenPath, FollowedPath
from mbody.kernels.number_program import NumberProgram
from mbody.model.numbers import number_in
from mbody.system.system import System

__all__ = ["INSTANTS", "enter_driven"]

#: Instants of a turn, both ends included, unless the caller says how many.
INSTANTS = 361
#: Change points of one motion that are kept, and of a step.
CHANGES, OF_A_STEP = 256, 8
#: What the path parameter is, in words.
MODES = {BY_TIME: "time", BY_DRIVER: "driver", BY_INSTANT: "instant"}


@dataclass(frozen=True)
class _Programs:
    """What all calls share: numbers, measures."""

    system: System
    numbers: NumberProgram
    measured: MeasuredProgram


def enter_driven(
    arena: Arena,
    system: System,
    numbers: NumberProgram,
    measured: MeasuredProgram,
    instants: int | None,
) -> dict[str, Any]:
    """Put the calls of driven motion into the image; what the manifest says of them.

    Raises
    ------
    ModelError, SolveError
        Where the drivers do not determine the motion: then nothing was put.
    """
    grid = _grid(system, INSTANTS if instants is None else instants)
    start = closed(system, float(grid.t[0]), grid.first(system))
    check_determined(system, start, "kinetostatics")
    work, drivers = start.work, len(system.drivers)
    arena.call("numbers.driven", "set_numbers", numbers, system.layout, work)
    tolerance = float(rounding(system, work.q[:, 0]))
    given = np.full(drivers, np.nan)
    where = float(grid.t[0]), given, start.regularization, tolerance
    at = arena.call("close", "close_at", system.layout, work, *where)
    arena.word("driven.q", arena.place(work, "q"), system.coordinates)
    arena.word("close.t", at["t"])
    arena.array("close.given", given)
    programs = _Programs(system, numbers, measured)
    modes = {"turn": MODES[grid.mode]}
    _enter_path(arena, programs, "turn", start, grid, CHANGES)
    if drivers:
        step = _drag(start, system)
        modes["step"] = MODES[step.mode]
        _enter_path(arena, programs, "step", start, step, OF_A_STEP)
    return {"path parameters": modes, "redundant": bool(start.regularization)}


def _grid(system: System, instants: int) -> TimeGrid:
    """A whole turn of the one driver of an angle, else times of the motion of the description, or
    from 0 to 1.
    """
    angular = [driver.name for driver in system.drivers if driver.angular]
    if len(angular) == 1:
        try:
            return time_grid(system, None, None, angular[0], instants)
        except ModelError:
            if instants < 2:
                raise
    own, last = system.mechanism.simulation, 1.0
    if own is not None:
        last = number_in(system.mechanism, own.until, "time", "simulate", "until")
    return time_grid(system, np.linspace(0.0, last, instants), None, None, None)


def _drag(start: ClosedPosition, system: System) -> TimeGrid:
    """Two instants at the values that the drivers have at the start."""
    rows = system.layout.driver_row
    given = np.zeros((2, len(rows), 3))
    given[:, :, 0] = start.work.signal[rows, 0]
    t = np.full(2, float(start.work.time[0, 0]))
    if len(rows) == 1:
        return TimeGrid(BY_DRIVER, given[:, 0, 0].copy(), t, given)
    return TimeGrid(BY_INSTANT, np.array([0.0, 1.0]), t, given)


def _enter_path(
    arena: Arena,
    programs: _Programs,
    name: str,
    start: ClosedPosition,
    grid: TimeGrid,
    changes: int,
) -> None:
    """A path that is followed, and its measures."""
    system, count = programs.system, len(grid.s)
    runner = Runner(system, "kinetostatics")
    path = DrivenPath(
        mode=grid.mode,
        s=grid.s,
        t=grid.t,
        given=grid.given,
        chords=grid.chords if grid.mode == BY_INSTANT else np.zeros((1, 1)),
        with_forces=True,
        at_rest=False,
        monitored=True,
        regularization=start.regularization,
        reach=runner.reach(start, grid),
    )
    found = FollowedPath(
        output=np.zeros((count, runner.rows, 1)),
        progress=np.zeros(PROGRESS),
        nearest=np.zeros(3),
        passed=np.zeros((changes, 1 + system.coordinates)),
    )
    arena.call(name, "follow", system.layout, start.work, path, found)
    measures = np.zeros((count, len(programs.measured.names)))
    program = programs.measured.program
    values = program, programs.numbers, path.t, found.output, measures
    arena.call(f"{name}.measures", "measures", *values)
    for key in ("s", "t", "given", "chords"):
        arena.array(f"{name}.{key}", getattr(path, key))
    for key in ("output", "progress", "nearest", "passed"):
        arena.array(f"{name}.{key}", getattr(found, key))
    arena.word(f"{name}.reach", arena.field_place(path, "reach"))
    arena.array(f"{name}.measured", measures)
