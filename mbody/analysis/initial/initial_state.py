"""Initial state of a motion: positions and velocities of bodies as a description has them."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_positions import fitted_note, fitted_places, misplaced
from mbody.analysis.initial.initial_velocities import branch_rates, fitting_rates
from mbody.analysis.position.assembly_analysis import closed, set_drive
from mbody.analysis.position.initial_guess import placed
from mbody.analysis.singular.branches import BESIDE
from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.singular_positions import SUSPECT, singular
from mbody.errors import ModelError
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker, listed
from mbody.model.event import Event
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.simulation import STATE, SimulationSettings
from mbody.model.study import Measure, measure_named
from mbody.quantities import Formula, FormulaError
from mbody.quantities.units import DIMENSIONS
from mbody.solution.histories import Record
from mbody.solution.measures import check_measure
from mbody.solution.places import link_poses
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.rank import too_large
from mbody.system.system import System

__all__ = [
    "begins_so",
    "check_release",
    "check_simulation",
    "checked_events",
    "initial_state_of",
    "start_drivers",
    "with_start_drivers",
    "state_of",
    "StartDriver",
    "event_measure",
]

#: Name of a driver; body, coordinate and direction; value and rate.
StartDriver = tuple[str, tuple[str, str, float], Any, Any]

#: A coordinate, its rate, and the direction in which it is measured.
PAIRS = (("angle", "omega", 0.0), ("x", "vx", 0.0), ("y", "vy", 0.5 * math.pi))
#: What is prescribed of the first instant is met to this part of its size.
MET = 1e-7
RATES = {place: rate for place, rate, _ in PAIRS}


def check_simulation(mechanism: Mechanism, simulation: SimulationSettings) -> None:
    """Refuse a motion that begins with what the mechanism has not.

    Raises
    ------
    ModelError
    """
    bodies = {body.name: body for body in mechanism.bodies}
    _number(mechanism, simulation.until, "time", "until")
    for body, given in simulation.start.items():
        if body not in bodies:
            known = ", ".join(bodies)
            raise ModelError(f"simulation: there is no body '{body}' to start (there are: {known})")
        for key, value in given.items():
            _number(mechanism, value, STATE[key], f"start.{body}.{key}")
        guess = bodies[body].guess
        for place, rate, _ in PAIRS:
            if rate in given and place not in given and getattr(guess, place) is None:
                raise ModelError(
                    f"simulation: start.{body} has {rate} without {place}: say where it begins, "
                    "or give a guess"
                )
    checked_events(mechanism, simulation.events)
    for name in ("step", "every"):
        if getattr(simulation, name) is not None:
            _number(mechanism, getattr(simulation, name), "time", name)
    check_release(mechanism, simulation.release)


def checked_events(mechanism: Mechanism, events: Iterable[Event]) -> tuple[Event, ...]:
    """Events as the mechanism can have them.

    Raises
    ------
    ModelError
        For a name that is taken, and a quantity that there is not.
    """
    found = tuple(events)
    for event in found:
        if event.name in mechanism:
            taken = type(mechanism[event.name]).__name__
            raise ModelError(
                f"event '{event.name}': the name is taken by a {taken}: choose another", event.name
            )
        try:
            check_measure(mechanism, event_measure(mechanism, event))
        except ModelError as error:
            reason = str(error).removeprefix("measure ")
            raise ModelError(f"event '{event.name}': {reason}", event.name) from None
    return found


def event_measure(mechanism: Mechanism, event: Event) -> Measure:
    """What is to be zero: one of the mechanism's measures by its name, or a formula."""
    return measure_named(mechanism.measures, event.of)


#: The first instant of motions that were requested, as long as their systems live.
_BEGUN: weakref.WeakKeyDictionary[System, tuple[SimulationSettings, Solution]] = (
    weakref.WeakKeyDictionary()
)


def initial_state_of(system: System, simulation: SimulationSettings) -> Solution:
    """The first instant of a motion: bodies where it prescribes, moving as it prescribes.

    Raises
    ------
    ModelError
        As `check_simulation`.
    SolveError
        Where the loops do not close so, or no velocities agree.
    """
    check_simulation(system.mechanism, simulation)
    known, found = _BEGUN.get(system, (None, None))
    if found is None or known is not simulation:
        found = _first_instant(system, simulation)
        _BEGUN[system] = simulation, found
    return found


def _first_instant(system: System, simulation: SimulationSettings) -> Solution:
    if too_large(system):
        return _by_drivers(system, simulation)
    t, q, notes = 0.0, *_places(system, simulation)
    start = closed(system, t, {}, pose=q)
    work = start.work
    rates = [
        Prescribed(body, RATES[place], float(speed))
        for _, (body, place, _), _, speed in start_drivers(system, simulation, rates=True, poses={})
    ]
    here = None
    if start.regularization or start.ratio < SUSPECT:
        own = system.work()
        own.q[:], own.signal[:], own.time[:] = work.q, work.signal, work.time
        here = singular(system, own, t, BESIDE)
    if here is None:
        v, more = fitting_rates(system, work, rates)
    else:
        v, more = branch_rates(system, here, t, work.q[: system.coordinates, 0], rates)
    n = system.coordinates
    page = np.zeros((1, system.page_rows, 1))
    page[0, :n], page[0, n : 2 * n, 0] = work.q[:n], v
    record = Record([page], 1, batch=False)
    every = (*notes, *start.notes, *more)
    return Solution(
        system,
        "close_loops",
        np.array([t]),
        record,
        None,
        regularization=start.regularization,
        notes=every,
    )


def begins_so(start: Solution, simulation: SimulationSettings) -> bool:
    """Whether a first instant has all that is prescribed of it."""
    system = start.system
    places = start.record.table(slice(0, system.coordinates))
    size = max(float(np.max(system.extent(places))), 1.0)
    for rates in (False, True):
        for _, (body, place, _), value, speed in start_drivers(
            system, simulation, rates=rates, poses={}
        ):
            wanted, key = (speed, RATES[place]) if rates else (value, place)
            history = start[body] if place == "angle" else start.point(body)
            unit = 1.0 if place == "angle" else system.length
            if abs(float(getattr(history, key)[0]) - float(wanted)) > MET * size * unit:
                return False
    return True


def _places(system: System, simulation: SimulationSettings) -> tuple[np.ndarray, tuple[str, ...]]:
    """The first position (coordinates + 3,), and notes."""
    imposed = start_drivers(system, simulation, rates=False, poses={})
    own = {
        body: {key: value for _, (name, key, _), value, _ in imposed if name == body}
        for body in simulation.start
    }
    if imposed and system.rows + len(imposed) > system.coordinates:
        work = system.work()
        drive = set_drive(system, work, 0.0, {})
        guess = {body: _pose(system, body, places) for body, places in own.items()}
        first = placed(system, {k: v for k, v in guess.items() if v is not None}, drive)
        sure = [one for one in imposed if one[1][1] in simulation.start[one[1][0]]]
        for some in (imposed, sure):
            spots = [Prescribed(body, key, float(value)) for _, (body, key, _), value, _ in some]
            found = fitted_places(system, work, spots, first) if spots else None
            if found is not None and found.near:
                return found.q, fitted_note(system, spots, found)
        if found is not None and system.rows + len(sure) > system.coordinates:
            raise misplaced(system, spots, found)
        imposed = sure or imposed
    driven = with_start_drivers(system, imposed)
    start = closed(driven, 0.0, {name: float(value) for name, _, value, _ in imposed})
    return start.work.q[:, 0].copy(), tuple(start.notes)


def _pose(system: System, body: str, places: Mapping[str, Any]) -> Any:
    """The guess of a body by what is prescribed of it; None where that does not matter."""
    if "angle" not in places:
        return None
    if "x" in places and "y" in places:
        return (float(places["x"]), float(places["y"]), float(places["angle"]))
    return float(places["angle"])


def _by_drivers(system: System, simulation: SimulationSettings) -> Solution:
    """Of a mechanism that is too large for dense matrices: drivers impose what is prescribed."""
    found = _closed_by_drivers(system, simulation, rates=False)
    if any(rate in given for given in simulation.start.values() for _, rate, _ in PAIRS):
        found = _closed_by_drivers(system, simulation, rates=True, guess=link_poses(found))
    return found


def _closed_by_drivers(
    system: System, simulation: SimulationSettings, *, rates: bool, guess: Any = None
) -> Solution:
    """The loops closed with drivers for what is prescribed: places, or what has a rate."""
    poses = guess or {}
    imposed = start_drivers(system, simulation, rates=rates, poses=poses)
    drive = {name: (value, rate) for name, _, value, rate in imposed}
    return close_loops(with_start_drivers(system, imposed), drive=drive or None, guess=guess)


def start_drivers(
    system: System,
    simulation: SimulationSettings,
    *,
    rates: bool,
    poses: Mapping[str, Any],
) -> list[StartDriver]:
    """What is imposed at the start: name, (body, coordinate, direction), value and rate.

    Parameters
    ----------
    system : System
        Of a batch values and rates are arrays where they differ.
    rates : bool
        What has a rate, else what has a place or a rate, which is then zero.
    poses : mapping
        Of link axes, (x, y, angle) by body, in place of what is prescribed.
    """
    mechanism, values = system.mechanism, parameters_of(system)
    bodies = {body.name: body for body in mechanism.bodies}
    found = []
    for body, given in simulation.start.items():
        own = bodies[body].guess
        for place, rate, direction in PAIRS:
            if (rate if rates else place) not in given and not (rates is False and rate in given):
                continue
            value = given.get(place, getattr(own, place))
            if poses:
                value = dict(zip(("x", "y", "angle"), poses[body], strict=True))[place]
            value = _number(mechanism, value, STATE[place], f"start.{body}.{place}", values)
            speed = given.get(rate, 0.0) if rates else 0.0
            speed = _number(mechanism, speed, STATE[rate], f"start.{body}.{rate}", values)
            found.append((f"{body} {place} at the start", (body, place, direction), value, speed))
    return found


def with_start_drivers(system: System, imposed: list[StartDriver]) -> System:
    """The system with a driver, last of all, for each of `start_drivers`."""
    driven = system.mechanism.copied()
    for name, (body, place, direction), value, _ in imposed:
        if place == "angle":
            driven.add(AngleDriver(name, body, value))
        else:
            driven.add(CoordinateDriver(name, Marker("ground", (0.0, 0.0), direction), body, value))
    return with_numbers_of(assemble(driven), system.values)


def _number(
    mechanism: Mechanism,
    value: Any,
    dimension: str,
    name: str,
    parameters: Mapping[str, Any] | None = None,
) -> Any:
    """A number of a simulation in the units of the mechanism; parameters as a system has them."""
    found = number_in(mechanism, value, dimension, "simulation", name)
    if isinstance(value, Formula) and value.names and parameters:
        scope = mechanism.parameters.scope(parameters)
        try:
            found = value.of(DIMENSIONS[dimension]).value(scope)
        except FormulaError as error:
            raise ModelError(f"simulation: {name}: {error}") from None
    return found


def parameters_of(system: System) -> dict[str, Any]:
    """The parameters as the system has them; of a batch arrays where they differ."""
    own = {name: system.values[name] for name in system.mechanism.parameters}
    return {name: value if np.ndim(value) else float(value) for name, value in own.items()}


def check_release(mechanism: Mechanism, given: Mapping[str, Any]) -> dict[str, float]:
    """When drivers are released, by name.

    Raises
    ------
    ModelError
        For what is no driver, or no time.
    """
    drivers = [driver.name for driver in mechanism.drivers]
    for name in given:
        if name not in drivers:
            known = listed(drivers) or "none"
            raise ModelError(f"there is no driver {name!r} to release (there are: {known})")
    return {name: _number(mechanism, t, "time", f"release.{name}") for name, t in given.items()}


def state_of(system: System, start: Any) -> tuple[float, np.ndarray, np.ndarray]:
    """Time, positions and rates of the last instant of a solution."""
    if not isinstance(start, Solution):
        raise ModelError(f"start must be a Solution, not {start!r}")
    if start.record.batch:
        raise ModelError("start is a batch of designs: give one, of system.design(n)")
    theirs = start.system.bodies
    missing = [name for name in system.bodies if name not in theirs]
    if missing:
        raise ModelError(f"start has no body {listed(missing)}: give a motion of the same bodies")
    own, other = system.mechanism.units, start.mechanism.units
    if own != other:
        raise ModelError(
            f"start is in {other.name}, '{system.mechanism.name}' in {own.name}: ask for both in "
            "the same units"
        )
    if not len(start):
        raise ModelError("start has no instant to begin from: give a motion that has one")
    last = start.record.table(slice(0, 2 * start.system.coordinates))[-1]
    if not np.isfinite([*last, start.t[-1]]).all():
        raise ModelError(
            "start has positions or rates at its last instant that are no finite numbers: give a "
            "motion that was found"
        )
    places = [theirs[body.name] for body in system.mechanism.bodies]
    q, v = last.reshape(2, -1, 3)[:, places].reshape(2, -1)
    return float(start.t[-1]), q, v
