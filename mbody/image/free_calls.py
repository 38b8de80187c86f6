"""The calls of an image for free motion: its beginning, a step of co-simulation, all of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.integrators import ExplicitSteps
from mbody.analysis.dynamics.interruptions import holds
from mbody.analysis.dynamics.options import MotionRequest, last_time, motion_request, tolerances
from mbody.analysis.dynamics.singular_start import singular_start
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import initial_state_of, state_of
from mbody.errors import ModelError
from mbody.image.arena import STATE, Arena, ImageEntry
from mbody.image.measured_quantities import MeasuredProgram
from mbody.kernels.image_calls import MotionStart
from mbody.kernels.number_program import NumberProgram
from mbody.kernels.step_state import Outputs
from mbody.model.numbers import number_in
from mbody.model.simulation import INSTANTS, METHODS
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["enter_free"]

#: When a motion ends where the description does not say it, and steps of one call.
LAST, STEPS = 1.0, 500


def enter_free(
    arena: Arena,
    system: System,
    numbers: NumberProgram,
    measured: MeasuredProgram,
    instants: int | None,
) -> dict[str, Any]:
    """Put the calls of free motion into the image; what the manifest says of them.

    Raises
    ------
    ModelError, SolveError
        Where there is no free motion, or one that an image cannot make: then nothing was put.
    """
    _refuse_another_motion(system)
    start, state, request = _request(system, instants)
    first, q, v = state
    last = float(request.times[-1])
    if singular_start(system, start, state, request, last) is not None:
        raise ModelError(
            f"'{system.mechanism.name}' begins where branches meet, at a singular position, which "
            "an image cannot leave: begin elsewhere"
        )
    integration = Integration(system, start, request.way)
    integration.begin(first, q, v, last)
    explicit = integration.steps
    assert isinstance(explicit, ExplicitSteps)
    layout, work = integration.layout, integration.work
    stepping, errors = integration.stepping, integration.motion.tolerances
    page, rows, causes = integration.page, integration.rows, integration.causes
    program = measured.program
    own = integration.y[2 * system.coordinates :].copy()
    begin = MotionStart(times=np.array([first, last]), q=q, v=v, own=own)
    arena.call("numbers.free", "set_numbers", numbers, layout, work)
    at = arena.call("begin", "begin_motion", layout, work, stepping, errors, begin, page, False)
    arena.word("begin.goes_on", at["goes_on"])
    for name, times in (("advance", np.array([first])), ("run", request.times.copy())):
        outputs = Outputs(
            times=times,
            pages=np.zeros((len(times), rows, 1)),
            work=np.zeros((len(times) + 1, causes)),
        )
        bundles = layout, work, explicit.method, stepping, errors, outputs
        until = first if name == "advance" else last
        at = arena.call(name, "runge_kutta", *bundles, until, STEPS)
        found = np.zeros((len(times), len(measured.names)))
        arena.call(f"{name}.measures", "measures", program, numbers, times, outputs.pages, found)
        for key in ("times", "pages", "work"):
            arena.array(f"{name}.{key}", getattr(outputs, key))
        for key in ("until", "steps"):
            arena.word(f"{name}.{key}", at[key])
        arena.array(f"{name}.measured", found)
    for key in ("times", "q", "v", "own"):
        arena.array(f"start.{key}", getattr(begin, key))
    for n, one in enumerate(system.mechanism.states):
        # its count is the column of its measure
        place = arena.put(begin.own) + 8 * n
        column = measured.names.index(one.name)
        unit = measured.units[column]
        arena.entries.append(ImageEntry(STATE, place, column, one.name, unit))
    for key in ("relative", "absolute"):
        arena.word(f"motion.{key}", arena.field_place(errors, key))
    arena.array("begin.page", page)
    arena.array("motion.state", stepping.state)
    arena.array("motion.y", stepping.y)
    return {
        "notes": [*_notes(system), *integration.notes],
        "rtol": request.way.rtol,
        "times": [first, last],
        "every": _apart(system, last - first),
    }


def _request(
    system: System, instants: int | None
) -> tuple[Solution, tuple[float, np.ndarray, np.ndarray], MotionRequest]:
    """How the motion begins, and which one it is."""
    own = system.mechanism.simulation
    start = close_loops(system) if own is None else initial_state_of(system, own)
    state = state_of(system, start)
    request = motion_request(
        system,
        state[0],
        state[0] + LAST if own is None else last_time(system, None),
        tolerances(system, None, None),
        method=METHODS[0],
        step=None,
        kept=(instants, None, None),
        events=(),
        release={},
    )
    return start, state, request


def _apart(system: System, whole: float) -> float:
    """How far apart the instants of the description are, however many the image keeps."""
    own = system.mechanism.simulation
    if own is not None and own.every is not None:
        return number_in(system.mechanism, own.every, "time", "simulate", "every")
    return whole / ((INSTANTS if own is None else own.instants) - 1)


def _refuse_another_motion(system: System) -> None:
    """Refuse a motion that would be another one in the image."""
    for one in system.mechanism.inputs:
        if holds(one.value):
            raise ModelError(
                f"input '{one.name}' follows a table that holds its values, which an image cannot: "
                "give it a number, and let the program set it",
                one.name,
            )
    own = system.mechanism.simulation
    if own is None:
        return
    ends = [one.name for one in own.events if one.stop]
    if ends:
        raise ModelError(f"'{ends[0]}' ends the motion, which an image cannot do: leave it out")
    if own.release:
        name = next(iter(own.release))
        raise ModelError(
            f"driver '{name}' is released, which an image cannot do: leave the release out"
        )


def _notes(system: System) -> list[str]:
    """What the motion of the image lacks."""
    own = system.mechanism.simulation
    if own is None:
        return []
    notes = [f"event '{one.name}' is not in the image" for one in own.events]
    if own.method != METHODS[0]:
        notes.append(f"the image integrates by {METHODS[0]}, the model by {own.method}")
    return notes
