"""How a motion begins: bodies exactly where, and as fast as, a description says."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbody.analysis.close_loops import close_loops
from mbody.assembler import assemble, with_numbers_of
from mbody.drivers import AngleDriver, CoordinateDriver
from mbody.elements import Marker, listed
from mbody.ends import link_poses
from mbody.errors import ModelError
from mbody.events import Event, Stop, check_restitution
from mbody.formulas import Formula, FormulaError, read
from mbody.measures import check_measure
from mbody.mechanism import Mechanism
from mbody.questions import Measure
from mbody.simulation import STATE, Simulation
from mbody.solution import Solution
from mbody.system import System
from mbody.units import DIMENSIONS

__all__ = [
    *("check_release", "check_simulation", "checked_events", "holding", "said", "started"),
    *("state_of", "watched"),
]

#: Name of a driver; body, coordinate and direction; value and rate.
Said = tuple[str, tuple[str, str, float], Any, Any]

#: A coordinate, its rate, and the direction in which it is measured.
PAIRS = (("angle", "omega", 0.0), ("x", "vx", 0.0), ("y", "vy", 0.5 * math.pi))
#: What a stop may be made of.
COORDINATES = ("x", "y", "angle")


def check_simulation(mechanism: Mechanism, simulation: Simulation) -> None:
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


def checked_events(
    mechanism: Mechanism,
    events: Iterable[Event | Stop],
    parameters: Mapping[str, float] | None = None,
) -> dict[Event | Stop, float]:
    """Events as the mechanism can have them, with the restitution of each stop; `parameters` as a
    system has them.

    Raises
    ------
    ModelError
        For a name that is taken, a quantity that there is not, or a stop of what is no coordinate.
    """
    found: dict[Event | Stop, float] = {}
    for event in events:
        what = "stop" if isinstance(event, Stop) else "event"
        if event.name in mechanism:
            taken = type(mechanism[event.name]).__name__
            raise ModelError(
                f"{what} '{event.name}': the name is taken by a {taken}: choose another", event.name
            )
        try:
            check_measure(mechanism, watched(mechanism, event))
        except ModelError as error:
            told = str(error).removeprefix("measure ")
            raise ModelError(f"{what} '{event.name}': {told}", event.name) from None
        found[event] = 0.0
        if isinstance(event, Stop):
            _check_coordinate(mechanism, event)
            name = f"{event.name}.restitution"
            value = _number(mechanism, event.restitution, "number", name, parameters)
            check_restitution(value, event.name)
            found[event] = value
    return found


def watched(mechanism: Mechanism, event: Event | Stop) -> Measure:
    """What is to be zero: one of the mechanism's measures by its name, or a formula."""
    return mechanism.measures.get(event.of) or Measure(event.of)


def _check_coordinate(mechanism: Mechanism, stop: Stop) -> None:
    """Refuse a stop of what an impact does not leave as it is."""
    coordinates = []
    for name in sorted(read(watched(mechanism, stop).of, None).names - mechanism.parameters.keys()):
        owner, _, key = name.rpartition(".")
        if not owner:
            continue
        if key not in COORDINATES:
            raise ModelError(
                f"stop '{stop.name}': '{name}' is no coordinate: take x, y and angle of bodies and "
                "points",
                stop.name,
            )
        coordinates.append(name)
    if not coordinates:
        raise ModelError(
            f"stop '{stop.name}': '{stop.of}' has no coordinate: name x, y or angle of a body or a "
            "point",
            stop.name,
        )


#: The first instant of motions that were asked for, as long as their systems live.
_BEGUN: weakref.WeakKeyDictionary[System, tuple[Simulation, Solution]] = weakref.WeakKeyDictionary()


def started(system: System, simulation: Simulation) -> Solution:
    """The first instant of a motion: bodies held where it says, moving as it says.

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
        found = _held(system, simulation, rates=False)
        if any(rate in given for given in simulation.start.values() for _, rate, _ in PAIRS):
            found = _held(system, simulation, rates=True, guess=link_poses(found))
        _BEGUN[system] = simulation, found
    return found


def _held(system: System, simulation: Simulation, *, rates: bool, guess: Any = None) -> Solution:
    """The loops closed with drivers in place of what is said: of places, or of what has a rate."""
    poses = guess or {}
    things = said(system, simulation, rates=rates, poses=poses)
    drive = {name: (value, rate) for name, _, value, rate in things}
    return close_loops(holding(system, things), drive=drive or None, guess=guess)


def said(
    system: System,
    simulation: Simulation,
    *,
    rates: bool,
    poses: Mapping[str, Any],
) -> list[Said]:
    """What is held at the start: name, (body, coordinate, direction), value and rate.

    Parameters
    ----------
    system : System
        Of a batch values and rates are arrays where they differ.
    rates : bool
        What has a rate, else what has a place or a rate, which is then zero.
    poses : mapping
        Of link axes, (x, y, angle) by body, in place of what is said.
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


def holding(system: System, things: list[Said]) -> System:
    """The system with a driver, last of all, for each thing that is `said`."""
    held = system.mechanism.copied()
    for name, (body, place, direction), value, _ in things:
        if place == "angle":
            held.add(AngleDriver(name, body, value))
        else:
            held.add(CoordinateDriver(name, Marker("ground", (0.0, 0.0), direction), body, value))
    return with_numbers_of(assemble(held), system.values)


def _number(
    mechanism: Mechanism,
    value: Any,
    dimension: str,
    name: str,
    parameters: Mapping[str, Any] | None = None,
) -> Any:
    """A number of a simulation in the units of the mechanism; parameters as a system has them."""
    found = mechanism.number(value, dimension, "simulation", name)
    if isinstance(value, Formula) and parameters:
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
    """When drivers let go, by name.

    Raises
    ------
    ModelError
        For what is no driver, or no time.
    """
    drivers = [driver.name for driver in mechanism.drivers]
    for name in given:
        if name not in drivers:
            known = listed(drivers) or "none"
            raise ModelError(f"there is no driver {name!r} to let go (there are: {known})")
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
