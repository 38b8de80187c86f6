"""Initial state of a motion: positions and velocities of bodies as a description has them."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mbody.analysis.initial.close_loops import branch_rates, close_loops, first_rates, fitting_rates
from mbody.analysis.position.assembly_analysis import (
    closed,
    rounding,
    set_driver_values,
)
from mbody.analysis.position.closed_position import by_rows, close_batch, placed
from mbody.analysis.singular.singular_positions import Prescribed, singular
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time, project_designs
from mbody.model.body import Guess, Guesses, GuessLike
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker, Numbers, listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import moves_nothing, number_in
from mbody.model.simulation import STATE, Event, Measure, SimulationSettings, measure_named
from mbody.quantities import Formula, FormulaError
from mbody.quantities.formula import Number
from mbody.quantities.units import DIMENSIONS
from mbody.solution.histories import Record, link_poses
from mbody.solution.measures import check_measure
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.rank import close_rows, dense
from mbody.system.system import System, polar_points, too_large, with_numbers_of

# -- First positions nearest to prescribed coordinates -----------------------------------------

Array = np.ndarray

#: Places that a sentence names.
NAMED = 4


@dataclass(frozen=True, eq=False)
class Fitted:
    """The nearest position to what is prescribed.

    `q` (coordinates + 3,): The position, the ground last.
    `off` (candidates,): What is prescribed less what it is there, in model lengths and radians.
    """

    q: Array
    off: Array


def fitted_places(
    system: System, work: Work, prescribed: Sequence[Prescribed], first: Array
) -> Fitted | None:
    """The nearest position to what is prescribed, from a first one (coordinates + 3,); None where
    the loops do not close near it.
    """
    n, scale = system.coordinates, system.coordinate_units
    work.q[:, 0] = first
    wanted = np.array([one.value / one.unit(system) for one in prescribed])

    def rows(x: Array) -> tuple[Array, Array]:
        """Φ first, then what is prescribed by what Φ leaves free."""
        phi, G = dense(system, work, x)
        q = work.q[:n, 0]
        P = np.array([one.row(system, q) for one in prescribed]).reshape(-1, n)
        off = np.array([one.at(system, q) for one in prescribed]) - wanted
        if np.isfinite(G).all():
            u, sizes, vt = np.linalg.svd(G)
            none = tol.SINGULAR_VALUE_NEAR_SINGULAR * sizes.max(initial=tol.TINY)
            rank = int((sizes > none).sum())
            G = (u[:, :rank] * sizes[:rank]) @ vt[:rank]
            off = off - P @ vt[:rank].T @ ((u.T @ phi)[:rank] / sizes[:rank])
            P = P @ vt[rank:].T @ vt[rank:]
        return np.append(phi, off), np.vstack([G, P])

    zero = tol.SINGULAR_VALUE_NEAR_SINGULAR
    work.q[:n, 0] = scale * close_rows(rows, first[:n] / scale, zero=zero).x
    open_ = float(np.abs(dense(system, work)[0]).max(initial=0.0))
    if not open_ <= tol.LOOP_OPEN_CHECK:
        return None
    q = work.q[:, 0].copy()
    off = wanted - np.array([one.at(system, q[:n]) for one in prescribed])
    found = Fitted(q, off)
    if open_ <= tol.LOOP_CLOSURE_FIRST_INSTANT * (1.0 + float(np.abs(q[:n] / scale).max())):
        return found
    return _at_singular(system, work, prescribed, found) or found


def _at_singular(
    system: System, work: Work, prescribed: Sequence[Prescribed], found: Fitted
) -> Fitted | None:
    """The singular position beside one at which corrections ended, where it has what is prescribed
    as well: rounding decides on which branch, and with which gap, they end.
    """
    n = system.coordinates
    own = system.work()
    own.q[:], own.signal[:], own.time[:] = work.q, work.signal, work.time
    here = singular(system, own, 0.0, tol.SINGULAR_DISTANCE_UNSURE)
    if here is None:
        return None
    q = found.q.copy()
    q[:n] = here.rows.scale * here.x
    moved = np.array([one.at(system, q[:n]) - one.at(system, found.q[:n]) for one in prescribed])
    off = found.off - moved
    worse = float((np.abs(off) - np.abs(found.off)).max(initial=0.0))
    return Fitted(q, off) if worse <= tol.START_CHANGE_ROUNDING else None


def fitted_note(system: System, prescribed: Sequence[Prescribed], found: Fitted) -> tuple[str, ...]:
    """By how much places were changed, where that is more than rounding."""
    worst = int(np.abs(found.off).argmax())
    size = abs(float(found.off[worst]))
    if size <= tol.START_CHANGE_ROUNDING:
        return ()
    candidate = prescribed[worst]
    unit = "deg" if candidate.key == "angle" else system.mechanism.units.length
    change = np.degrees(size) if candidate.key == "angle" else size * candidate.unit(system)
    return (
        f"the places of the start were fitted to joints and drivers: by {change:.2g} {unit} at "
        f"most, of {candidate.name}",
    )


def misplaced(system: System, prescribed: Sequence[Prescribed], found: Fitted) -> SolveError:
    """The sentence of places that joints and drivers do not allow together."""
    order = np.argsort(-np.abs(found.off))
    wrong = [int(n) for n in order if abs(found.off[n]) > 0.1 * tol.START_CHANGE_ALLOWED]
    parts = []
    for n in wrong[:NAMED]:
        candidate = prescribed[n]
        value = candidate.value - candidate.unit(system) * float(found.off[n])
        given = np.degrees(candidate.value) if candidate.key == "angle" else candidate.value
        parts.append(f"{candidate.with_value(system, value)} (not {given:.7g})")
    more = f" and {len(wrong) - NAMED} more" if len(wrong) > NAMED else ""
    return SolveError(
        "the places of the start do not fit together: the nearest position that joints and drivers "
        f"allow has {', '.join(parts)}{more}; correct them, or leave out places that follow from "
        "others",
        prescribed[wrong[0]].body,
    )


#: Name of a driver; body, coordinate and direction; value and rate.
StartDriver = tuple[str, tuple[str, str, float], Any, Any]

#: A coordinate, its rate, and the direction in which it is measured.
PAIRS = (("angle", "omega", 0.0), ("x", "vx", 0.0), ("y", "vy", 0.5 * math.pi))
RATES = {place: rate for place, rate, _ in PAIRS}


def check_simulation(mechanism: Mechanism, simulation: SimulationSettings) -> None:
    """Refuse a motion that begins with what the mechanism has not."""
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
    """Events as the mechanism can have them."""
    found = tuple(events)
    for event in found:
        if event.name in mechanism:
            kind = type(mechanism[event.name]).__name__
            raise ModelError(
                f"event '{event.name}': the name is taken by a {kind}: choose another", event.name
            )
        try:
            check_measure(mechanism, event_measure(mechanism, event))
        except ModelError as error:
            reason = str(error).removeprefix("measure ")
            raise ModelError(f"event '{event.name}': {reason}", event.name) from None
    return found


def event_measure(mechanism: Mechanism, event: Event) -> Measure:
    """Measure that vanishes at an event: one of the mechanism's by its name, or a formula."""
    return measure_named(mechanism.measures, event.of)


#: The first instant of motions that were requested, as long as their systems live.
_BEGUN: weakref.WeakKeyDictionary[System, tuple[SimulationSettings, Solution]] = (
    weakref.WeakKeyDictionary()
)


def initial_state_of(system: System, simulation: SimulationSettings) -> Solution:
    """The first instant of a motion: bodies where it prescribes, moving as it prescribes."""
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
    rates = prescribed_rates(system, simulation)
    here = None
    if start.regularization or start.ratio < tol.PIVOT_SUSPECT:
        own = system.work()
        own.q[:], own.signal[:], own.time[:] = work.q, work.signal, work.time
        here = singular(system, own, t, tol.SINGULAR_DISTANCE_PRECISE)
    if here is None:
        v, more = fitting_rates(
            system, work, rates, float(_number(system.mechanism, simulation.until, "time", "until"))
        )
    else:
        v, more = branch_rates(system, here, t, work.q[: system.coordinates, 0], rates)
    n = system.coordinates
    instant = np.zeros((1, system.record_rows, 1))
    instant[0, :n], instant[0, n : 2 * n, 0] = work.q[:n], v
    record = Record([instant], 1, batch=False)
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
            if (
                abs(float(getattr(history, key)[0]) - float(wanted))
                > tol.START_CONDITION_MET * size * unit
            ):
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
        driver_values = set_driver_values(system, work, 0.0, {})
        bodies = {body.name: body for body in system.mechanism.bodies}
        guess: dict[str, GuessLike] = {}
        for body, places in own.items():
            rough = asdict(bodies[body].guess)
            guess[body] = Guess(**{key: places.get(key, value) for key, value in rough.items()})
        first = placed(system, guess, driver_values)
        sure = [one for one in imposed if one[1][1] in simulation.start[one[1][0]]]
        for some in (imposed, sure):
            candidates = [
                Prescribed(body, key, float(value)) for _, (body, key, _), value, _ in some
            ]
            found = fitted_places(system, work, candidates, first) if candidates else None
            if found is not None and bool(
                np.abs(found.off).max(initial=0.0) <= tol.START_CHANGE_ALLOWED
            ):
                return found.q, fitted_note(system, candidates, found)
        if found is not None and system.rows + len(sure) > system.coordinates:
            raise misplaced(system, candidates, found)
        imposed = sure or imposed
    driven = with_start_drivers(system, imposed)
    start = closed(driven, 0.0, {name: float(value) for name, _, value, _ in imposed})
    return start.work.q[:, 0].copy(), tuple(start.notes)


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


def prescribed_rates(system: System, simulation: SimulationSettings) -> list[Prescribed]:
    """The rates that a motion begins with, of one design."""
    return [
        Prescribed(body, RATES[place], float(speed))
        for _, (body, place, _), _, speed in start_drivers(system, simulation, rates=True, poses={})
    ]


def start_drivers(
    system: System, simulation: SimulationSettings, *, rates: bool, poses: Mapping[str, Any]
) -> list[StartDriver]:
    """Conditions imposed at the start: name, (body, coordinate, direction), value and rate."""
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
    """Times at which drivers are released, by name."""
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


#: Parts of a mechanism whose elements a note names where another model goes on without them.
STRUCTURE = ("joints", "couplings", "contacts", "loads")


def other_model_note(system: System, start: Solution) -> tuple[str, ...]:
    """How the model of a motion differs from that of the motion which it goes on from."""
    if start.analysis != "simulate" or start.system is system:
        return ()
    ours, theirs = (
        [one.name for part in STRUCTURE for one in getattr(of.mechanism, part)]
        for of in (system, start.system)
    )
    own, other = system.values, start.system.values
    free = {one.name for one in (*system.mechanism.inputs, *system.mechanism.states)}
    numbers = [
        f"{name} = {float(own[name]):.6g} in place of {float(other[name]):.6g}"
        for name in own
        if name in other and own[name] != other[name] and name.partition(".")[0] not in free
    ]
    less, more = ([one for one in a if one not in b] for a, b in ((theirs, ours), (ours, theirs)))
    texts = [f"without {listed(less, NAMED)}"] if less else []
    texts += [f"with {listed(more, NAMED)}"] if more else []
    texts += numbers[:NAMED]
    texts += [f"{len(numbers) - NAMED} more numbers"] if len(numbers) > NAMED else []
    if not texts:
        return ()
    return (f"the motion goes on from one of another model: {', '.join(texts)}",)


# -- First positions and velocities of many designs, closed in one call ------------------------
# Driven designs close from the one position of the description, so that all are on its branch; here
# each closes from its own guess, as it would alone, which may be on another branch.


@dataclass(frozen=True, eq=False)
class BatchStart:
    """How the designs of a batch begin.

    `simulation`: What prescribes it; None where guesses do.
    `guess`, `rates`: As of `close_loops`; rates are taken design by design.
    `places`, `rate_system`: With drivers that fix what has a place, and with those that drive what
      has a rate.
    `alike`: Whether all designs begin from the same guess.
    """

    simulation: SimulationSettings | None
    guess: Guesses | None
    rates: Mapping[str, Number] | None
    places: System
    rate_system: System
    alike: bool


def batch_start(
    system: System, names: tuple[str, ...], how: Mapping[str, Any]
) -> tuple[BatchStart, Solution]:
    """How designs of a system begin that differ in `names`, and how the system itself does."""
    own, guess, rates = system.mechanism.simulation, how.get("guess"), how.get("rates")
    machine = system.mechanism
    alike = all(name not in machine.parameters and moves_nothing(machine, name) for name in names)
    if own is None or guess is not None or rates is not None:
        first = close_loops(system, guess=guess, rates=rates)
        return BatchStart(None, guess, rates, system, system, alike), first
    first = initial_state_of(system, own)
    places = rate_system = with_start_drivers(
        system, start_drivers(system, own, rates=False, poses={})
    )
    moving = start_drivers(system, own, rates=True, poses=link_poses(first))
    if moving:
        rate_system = with_start_drivers(system, moving)
    return BatchStart(own, None, None, places, rate_system, alike), first


def initial_states(
    start: BatchStart, system: System, values: Mapping[str, Array]
) -> tuple[Array, Array, np.ndarray]:
    """Positions and velocities, each (designs, coordinates), and which of them can be trusted."""
    if start.rates is not None:
        return _one_by_one(start, system)
    designs, n3 = int(system.batch or 0), system.coordinates
    places = start.places.with_values(values)
    first, still = _driver_values(start, system, places, rates=False)
    poses = _first_poses(start, places, first)
    # at or near a singular position the branch has to be looked at: one by one
    good = close_batch(places, 0.0, first, poses, rounding(places, poses), tol.PIVOT_SINGULAR)
    rate_system, rates = places, still
    if start.rate_system is not start.places:
        rate_system = start.rate_system.with_values(values)
        _, rates = _driver_values(start, system, rate_system, rates=True)
    velocities, off = np.empty((designs, n3)), np.empty(designs)
    project_designs(
        rate_system.layout, rate_system.work(), rate_system.par, poses, rates, velocities, off
    )
    good &= off <= tol.VELOCITIES_AGREE
    if rate_system.rows < n3:
        for design in np.flatnonzero(good & velocities.any(axis=1)).tolist():
            velocities[design], good[design] = _first_rates(start, system, design, poses[design])
    return poses[:, :n3], velocities, good


def _first_rates(start: BatchStart, system: System, design: int, pose: Array) -> tuple[Array, bool]:
    """Velocities (coordinates,) of a design that joints and rates leave free, and whether they have
    what is prescribed.
    """
    one = system.design(design)
    work, rates = one.work(), list[Prescribed]()
    work.q[:, 0] = pose
    laws_of_time(one.runtime(), work)
    if start.simulation is not None:
        rates = prescribed_rates(one, start.simulation)
    found = first_rates(one, work, rates)
    met = np.abs(found.met - found.given.p) <= tol.VELOCITIES_AGREE * found.fast
    return one.coordinate_units * found.v, bool(met.all())


def _one_by_one(start: BatchStart, system: System) -> tuple[Array, Array, np.ndarray]:
    """Positions, velocities and success of each design by itself, where prescribed rates may
    contradict joints.
    """
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
        driver_values = dict(zip(names, values.tolist(), strict=True))
        own = plain | {name: value[design] for name, value in varied.items()}
        numbers = Numbers(own, polar, machine.bodies)
        poses[design] = placed(places, start.guess, driver_values, numbers=numbers)
        by_rows(places, poses[design], driver_values, numbers)
    if start.alike:
        poses[:] = poses[0]
    return poses
