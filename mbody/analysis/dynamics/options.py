"""Request of a motion: the options of the call, else those of the description, as numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.time_grid import check_room
from mbody.analysis.initial.initial_state import check_release, checked_events
from mbody.core.tolerances import RTOL_DEFAULT, RTOL_LEAST, TIMES_COUNT_ROUNDING, TIMES_SAME_SAMPLE
from mbody.errors import ModelError, brief, remedy
from mbody.laws import Table
from mbody.model.element import resolved, unknown_name, whole_number
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_element
from mbody.model.numbers import number_in
from mbody.model.simulation import ADAPTIVE, EVEN, METHODS, Event, as_events, check_method
from mbody.model.states import Input
from mbody.quantities import dimension_text
from mbody.solution.solution import IntegrationSettings
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

#: Steps of one motion, at most, and instants that are kept.
MOST_STEPS, MOST_INSTANTS = 1e9, 10_000_000


@dataclass(frozen=True, eq=False)
class MotionRequest:
    """A motion that is requested.

    `first`: Time of the first instant.
    `times`: The instants that are kept; the last one ends the motion.
    `settings`: How it is integrated.
    `events`: What is located.
    `release`: When drivers are released, by name, ascending.
    """

    first: float
    times: np.ndarray
    settings: IntegrationSettings
    events: tuple[Event, ...]
    release: dict[str, float]


def last_time(system: System, until: Any) -> float:
    """End of the motion."""
    own = system.mechanism.simulation
    if until is None and own is None:
        how = remedy(
            python="give until",
            command="give --to TIME, or the file a table [simulate] with until = …",
        )
        raise ModelError(f"simulate needs the last time: {how}")
    return number_in(
        system.mechanism,
        until if own is None or until is not None else own.until,
        "time",
        "simulate",
        "until",
    )


def tolerances(system: System, rtol: Any, atol: Any) -> tuple[float, float]:
    """Relative and absolute error."""
    own = system.mechanism.simulation
    if rtol is None:
        rtol = RTOL_DEFAULT if own is None else own.rtol
    for name, value in (("rtol", rtol), ("atol", rtol if atol is None else atol)):
        if not isinstance(value, int | float) or not RTOL_LEAST <= value <= 0.1:
            raise ModelError(f"{name} is {value!r}: give a number from 1e-14 to 0.1")
    return float(rtol), float(rtol if atol is None else atol)


def motion_request(
    system: System,
    first: float,
    last: float,
    errors: tuple[float, float],
    *,
    method: Any,
    step: Any,
    kept: tuple[Any, Any, Any],
    events: Any,
    release: Any,
) -> MotionRequest:
    """The motion from `first` to `last`; `kept` are instants, every and times."""
    machine = system.mechanism
    own, unit = machine.simulation, machine.units.time
    if not last > first:
        raise ModelError(
            f"{remedy(python='until', command='the last time')} is {last:g} {unit}, the motion "
            f"begins at {first:g} {unit}: give a later time"
        )
    if own is not None:
        if all(one is None for one in kept):
            kept = (own.instants if own.every is None else None, own.every, None)
        step = own.step if method is None and step is None else step
        method = own.method if method is None else method
        events = own.events if events is None else events
        release = own.release if release is None else release
    times = _times(machine, first, last, *kept)
    check_room(system, len(times))
    return MotionRequest(
        first,
        times,
        _settings(system, METHODS[0] if method is None else method, errors, step, last - first),
        checked_events(machine, as_events(() if events is None else events)),
        _release(system, {} if release is None else release),
    )


def _settings(
    system: System, method: Any, errors: tuple[float, float], step: Any, whole: float
) -> IntegrationSettings:
    """How the motion is integrated."""
    check_method(method)
    if method in ADAPTIVE:
        if step is not None:
            raise ModelError(
                f"the method '{method}' chooses its steps by rtol: leave out "
                f"{remedy(python='step', command='--step')}, or take one of {', '.join(EVEN)}"
            )
        return IntegrationSettings(method, *errors)
    unit = system.mechanism.units.time
    if step is None:
        how = remedy(python=f"step, in {unit}", command=f"--step H, in {unit}")
        raise ModelError(f"the method '{method}' has steps of one length: give {how}")
    length = number_in(system.mechanism, step, "time", "simulate", "step")
    if not length > 0.0 or whole / length > MOST_STEPS:
        raise ModelError(
            f"step is {length:g} {unit}: give a positive time, for at most {MOST_STEPS:.0e} steps"
        )
    return IntegrationSettings(method, *errors, length)


def _release(system: System, given: Any) -> dict[str, float]:
    """Times at which drivers are released, in the order of time."""
    if not isinstance(given, Mapping):
        raise ModelError(f'release must be a table such as {{"motor": 2.0}}, not {given!r}')
    times = check_release(system.mechanism, given)
    return dict(sorted(times.items(), key=lambda one: one[1]))


def _times(
    machine: Mechanism, first: float, last: float, instants: Any, every: Any, times: Any
) -> np.ndarray:
    """The instants that are kept, ascending, from the first to the last."""
    if sum(given is not None for given in (instants, every, times)) > 1:
        raise ModelError("give one of instants, every and times")
    unit = machine.units.time
    if times is not None:
        try:
            kept = np.unique(np.asarray(times, dtype=float).reshape(-1))
        except (TypeError, ValueError):
            raise ModelError(f"times must be numbers, in {unit}, not {brief(times)}") from None
        if not kept.size or not np.isfinite(kept).all() or kept[0] < first or kept[-1] > last:
            raise ModelError(f"times must lie between {first:g} and {last:g} {unit}")
        return kept
    if every is not None:
        step = number_in(machine, every, "time", "simulate", "every")
        if not step > 0.0 or (last - first) / step > MOST_INSTANTS:
            raise ModelError(f"every is {step:g}: give a positive time, for at most 1e7 instants")
        count = math.floor((last - first) / step * (1.0 + TIMES_COUNT_ROUNDING))
        kept = first + step * np.arange(count + 1)
        if last - kept[-1] > TIMES_SAME_SAMPLE * step:
            kept = np.append(kept, last)
        kept[-1] = min(kept[-1], last)
        return kept
    count = 201 if instants is None else whole_number("instants", instants, 2, MOST_INSTANTS)
    return np.linspace(first, last, count)


# -- Input histories given to `simulate` -------------------------------------------------------


def with_inputs(system: System, inputs: Any, first: float, until: float) -> System:
    """The system whose inputs follow other histories."""
    if not isinstance(inputs, Mapping):
        raise ModelError(f'inputs must be a table such as {{"u": 2.0}}, not {brief(inputs)}')
    machine = system.mechanism
    known = {one.name: one for one in machine.inputs}
    for name, given in inputs.items():
        if name not in known:
            raise unknown_name("input", name, known)
        setters = [one.name for one in machine.controllers if name in one.sets]
        if setters:
            raise ModelError(
                f"input '{name}' is set by the controller '{setters[0]}': leave it out", name
            )
        machine = with_element(machine, _follow(machine, known[name], given, first, until))
    if machine is system.mechanism:
        return system
    own = {f"{name}." for name in inputs}
    kept = {k: v for k, v in system.values.items() if not k.startswith(tuple(own))}
    return with_numbers_of(assemble(machine), kept)


def _follow(machine: Mechanism, declared: Input, given: Any, first: float, until: float) -> Input:
    """The input with that history."""
    name = declared.name
    if isinstance(given, tuple) and len(given) == 2:
        given = _table(name, *given)
    elif isinstance(given, list | np.ndarray):
        row = np.asarray(given, dtype=object)
        if row.ndim != 1 or row.size < 2:
            raise ModelError(
                f"input '{name}': a history is a row of at least two numbers, spread over the "
                f"motion, or a pair (t, u) of rows, not of shape {row.shape}",
                name,
            )
        given = _table(name, np.linspace(first, until, row.size), given)
    scope = machine.parameters.scope()
    new = Input(name, given).measured(scope)
    if None not in (new.dimension, declared.dimension) and new.dimension != declared.dimension:
        assert new.dimension is not None and declared.dimension is not None
        raise ModelError(
            f"input '{name}' is {dimension_text(declared.dimension)}, the history is "
            f"{dimension_text(new.dimension)}: give it in a unit of the former",
            name,
        )
    made, _, _ = resolved(Input(name, new.value, declared.dimension), scope, lambda names: {})
    return made


def _table(name: str, t: Any, u: Any) -> Table:
    """A history by points, joined by straight lines; its ends last."""
    try:
        return Table(t, u, interpolation="linear", outside="hold")
    except ModelError as error:
        raise ModelError(f"input '{name}': {str(error).removeprefix('Table: ')}", name) from None
