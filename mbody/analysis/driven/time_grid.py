"""Which instants an analysis is done, and how the drivers move between them."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mbody.errors import ModelError, SolveError, angle_text, brief, remedy
from mbody.kernels.continuation import BY_DRIVER, BY_INSTANT, BY_TIME
from mbody.laws import Expression, Table, times_of
from mbody.model.driver import Driver
from mbody.model.element import Element, listed, unknown_name, whole_number
from mbody.model.mechanism import Mechanism
from mbody.quantities.formula import PlainNumbers
from mbody.system.system import System, driver_states

if TYPE_CHECKING:
    from mbody.analysis.position.design_results import DesignFailures

# -- Requests larger than the memory are refused before anything is begun ----------------------

#: Where Linux says how much memory a container may have.
LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
#: Bytes of what is kept of a number, and of what else is made of an instant on the way.
NUMBER, OTHER_BYTES = 8, 200
#: Bytes that every process has that could load the kernels: to read the limits takes longer than a
#: short analysis.
SMALL = 16e6


def check_room(system: System, instants: int) -> None:
    """Refuse more instants than the memory of this machine can hold."""
    rows = system.record_rows
    wanted = int(instants) * (NUMBER * rows * int(system.batch or 1) + OTHER_BYTES)
    if wanted < SMALL:
        return
    there = memory()
    if wanted > there:
        raise ModelError(
            f"{instants} instants of '{system.mechanism.name}' take {wanted / 1e9:.3g} GB, this "
            f"machine has {there / 1e9:.3g} GB of memory: ask for fewer of them"
        )


def memory() -> float:
    """Bytes of memory that a process may have here; infinite where nothing says it."""
    found = [float("inf")]
    with contextlib.suppress(AttributeError, ValueError, OSError):
        found.append(float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES")))
    for path in LIMITS:
        with contextlib.suppress(OSError, ValueError):  # "max" is no number
            found.append(float(Path(path).read_text("ascii")))
    return min(found)


#: Most turns that are made at one request.
MOST = 1000
#: Instants of a whole turn, both ends included, unless the caller says how many.
REVOLUTION_INSTANTS = 361

#: Laws that need not have a value everywhere.
LIMITED = (Expression, Table)


@dataclass(frozen=True)
class TimeGrid:
    """Instants of an analysis.

    `mode`: What the path parameter is: time, the value of the one driver, or the number of the
      instant.
    `s`, `t` (instants,): Path parameter and time of every instant.
    `given` (instants, drivers, 3): Value, rate and acceleration of every driver.
    """

    mode: int
    s: np.ndarray
    t: np.ndarray
    given: np.ndarray

    def take(self, index: np.ndarray) -> TimeGrid:
        """Only some of the instants, in that order."""
        given = self.given if self.mode == BY_TIME else np.ascontiguousarray(self.given[index])
        s = np.ascontiguousarray(self.s[index])
        t = s if self.t is self.s else np.ascontiguousarray(self.t[index])
        return TimeGrid(self.mode, s, t, given)

    def first(self, system: System, k: int = 0) -> dict[str, float]:
        """Values of the drivers at instant k, where neither laws nor positions say them."""
        if self.mode == BY_TIME:
            return {}
        names = [driver.name for driver in system.mechanism.drivers]
        found = dict(zip(names, self.given[k, :, 0].tolist(), strict=True))
        return {driver.name: found[driver.name] for driver in system.independent_drivers}

    @property
    def chords(self) -> np.ndarray:
        """Change of every driver's value from each instant to the next, (instants, drivers)."""
        values = self.given[:, :, 0]
        return np.ascontiguousarray(np.diff(values, axis=0, append=values[-1:]))


def by_time(system: System, times: np.ndarray) -> TimeGrid:
    """Instants at which the laws say everything."""
    return TimeGrid(BY_TIME, times, times, np.zeros((1, len(system.mechanism.drivers), 3)))


#: Of drivers by name a value, or (value, rate, acceleration), each a number or one an instant.
DriverValues: TypeAlias = "Mapping[str, PlainNumbers | tuple[PlainNumbers, ...]]"


def time_grid(
    system: System,
    t: PlainNumbers | None,
    drive: DriverValues | None,
    turn: str | bool | None,
    instants: int | None,
    turns: int | None = None,
    failures: DesignFailures | None = None,
) -> TimeGrid:
    """The instants that a user requests; `failures`: for designs of which a law has no value."""
    if drive is not None and not isinstance(drive, Mapping):
        raise ModelError(f'drive must be a dict such as {{"motor": 0.5}}, not {drive!r}')
    if turn is False:
        turn = None
    if turn is not None and (t is not None or drive is not None):
        raise ModelError(f"turn goes alone: leave out {'t' if t is not None else 'drive'}")
    if instants is not None and turn is None:
        raise ModelError("instants goes with turn; times and driver values say how many they are")
    if turns is not None and turn is None:
        raise ModelError("turns goes with turn, which says whose they are: turn=True, turns=2")
    if turn is not None:
        grid = _revolution_grid(system, turn, instants, 1 if turns is None else turns)
    elif drive:
        grid = _grid_of_values(system, 0.0 if t is None else t, drive)
    else:
        grid = by_time(system, _numbers(0.0 if t is None else t, "t"))
    check_law_ranges(system, grid.t, drive or {}, failures)
    return grid


def _numbers(value: Any, name: str, element: str | None = None) -> np.ndarray:
    try:
        array = np.atleast_1d(np.asarray(value))
        plain = array.dtype.kind in "iuf"
        if not (plain or all(isinstance(v, Real) and not isinstance(v, bool) for v in array.flat)):
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError):
        raise ModelError(
            f"{name} must be a number or an array of them, not {value!r}", element
        ) from None
    if not array.size:
        raise ModelError(f"{name} is empty: give at least one number", element)
    if array.ndim != 1:
        raise ModelError(
            f"{name} must be a number or one row of them, not of shape {array.shape}", element
        )
    finite = np.isfinite(array)
    if not finite.all():
        bad = int(finite.argmin())
        which = f"{name}[{bad}]" if array.size > 1 else name
        raise ModelError(f"{which} is {array[bad]}, it must be finite", element)
    return np.ascontiguousarray(array)


def _law(
    system: System, driver: Driver, times: np.ndarray, design: int | None = None
) -> np.ndarray:
    """(instants, 3) of a driver's law."""
    try:
        law = system.law_of(driver, design=design)
        found = np.stack(np.broadcast_arrays(*law.derivatives(times)), axis=-1)
    except ModelError as error:
        raise ModelError(f"the law of driver '{driver.name}': {error}", driver.name) from None
    except Exception as error:
        raise _failed(driver, error) from error
    bad = np.argwhere(~np.isfinite(found))
    if bad.size:
        word = ("value", "rate", "acceleration")[bad[0, 1]]
        raise ModelError(
            f"the law of driver '{driver.name}', {law}, has an infinite {word} at "
            f"t = {times[bad[0, 0]]:g} {system.mechanism.units.time}: begin after it, or choose "
            "another law",
            driver.name,
        )
    return found


def _failed(driver: Driver, error: Exception) -> SolveError:
    """The sentence for what a user's law raised."""
    return SolveError(
        f"the function of '{driver.name}' failed: {type(error).__name__}: {error}", driver.name
    )


def _designs(system: System, element: Element, field: str) -> Iterable[int | None]:
    """The designs that a law differs between; one None where it is the same for all."""
    from mbody.model.numbers import varied

    own = system.batch is not None and varied(system.values, element, field)
    return range(int(system.batch or 1)) if own else (None,)


def check_law_ranges(
    system: System,
    times: np.ndarray,
    driver_values: DriverValues,
    failures: DesignFailures | None = None,
) -> None:
    """Refuse times at which a law or a load has no value, of a batch the design alone."""
    machine = system.mechanism
    for element, field in system.once("limited laws", lambda: tuple(_limited(machine))):
        if isinstance(element, Driver) and element.name in driver_values:
            continue
        for design in _designs(system, element, field):
            own = None if design is None or failures is None else failures.of(design)
            with own or contextlib.nullcontext():
                if isinstance(element, Driver):
                    _law(system, element, times, design)
                else:
                    _load(system, element, field, times, design)


def _limited(machine: Mechanism) -> Iterator[tuple[Element, str]]:
    """Drivers and loads with laws of time that have no value at some times."""
    for driver in machine.drivers:
        if isinstance(getattr(driver, "law", None), LIMITED):
            yield driver, "law"
    for load in machine.loads:
        for field in fields(load):
            # the law of a spring is one of its stretch, that of a pressure one of an angle
            of_time = field.metadata.get("of") == "time"
            if of_time and isinstance(getattr(load, field.name), LIMITED):
                yield load, field.name


def _load(system: System, load: Element, field: str, times: np.ndarray, design: int | None) -> None:
    """Raise the sentence of a load whose law has no value at one of the times."""
    try:
        system.law_of(load, field, design)(times)
    except ModelError as error:
        raise ModelError(f"the {field} of load '{load.name}': {error}", load.name) from None


def check_laws(system: System, times: np.ndarray) -> None:
    """Raise the sentence of a driver whose law has no value at one of the times."""
    for driver in system.independent_drivers:
        _law(system, driver, times)


def _grid_of_values(system: System, t: PlainNumbers, driver_values: DriverValues) -> TimeGrid:
    drivers = system.mechanism.drivers
    known = {driver.name: n for n, driver in enumerate(drivers)}
    parts: dict[str, list[np.ndarray]] = {}
    for name, value in driver_values.items():
        if name not in known:
            raise unknown_name("driver", name, known)
        _check_independent(system, drivers[known[name]])
        values = value if isinstance(value, tuple) else (value,)
        if not 1 <= len(values) <= 3:
            raise ModelError(
                f"driver '{name}' takes a value, or (value, rate, acceleration), not "
                f"{len(values)} of them",
                name,
            )
        words = ("value", "rate", "acceleration")
        parts[name] = [
            _numbers(v, f"{word} of driver '{name}'", name)
            for v, word in zip(values, words, strict=False)
        ]
    times = _numbers(t, "t")
    sizes = {len(a) for arrays in parts.values() for a in arrays} | {len(times)}
    if len(sizes - {1}) > 1:
        raise ModelError(
            f"driver values and times have different numbers of instants, {sorted(sizes - {1})}: "
            "give as many of each, or one"
        )
    count = max(sizes)
    times = np.ascontiguousarray(np.broadcast_to(times, count))
    given = np.zeros((count, len(drivers), 3))
    for name, n in known.items():
        if name in parts:
            for k, array in enumerate(parts[name]):
                given[:, n, k] = array
        elif drivers[n] in system.independent_drivers:
            given[:, n] = _law(system, drivers[n], times)
        else:
            _check_still(system, drivers[n])
    if system.independent_drivers == drivers[:1]:
        return TimeGrid(BY_DRIVER, np.ascontiguousarray(given[:, 0, 0]), times, given)
    return TimeGrid(BY_INSTANT, np.arange(count, dtype=np.float64), times, given)


def check_timed(system: System) -> None:
    """Refuse drivers that follow auxiliary states, which only `simulate` gives values."""
    for driver in system.drivers:
        states = driver_states(driver, system.mechanism, system.numbers)
        if states:
            raise ModelError(
                f"'{driver.name}' follows the state '{states[0]}', which is integrated with the "
                "motion: use simulate, or let it follow a formula of t",
                driver.name,
            )


def _check_independent(system: System, driver: Driver) -> None:
    """Refuse a value of a driver that follows positions."""
    if driver not in system.independent_drivers:
        known = listed(one.name for one in system.independent_drivers) or "none"
        raise ModelError(
            f"driver '{driver.name}' follows positions, by its law: give values of the drivers "
            f"that lead ({known})",
            driver.name,
        )


def _check_still(system: System, driver: Driver) -> None:
    """Refuse a driver that moves by itself where positions are requested, not times."""
    from mbody.system.formula_steps import recorded_driver

    formula = recorded_driver(
        driver, system.numbers.law(driver, "law"), system.mechanism, system.numbers
    )
    if formula.explicit:
        raise ModelError(
            f"driver '{driver.name}' follows positions and time: values of the other drivers do "
            "not say where it is; give times t",
            driver.name,
        )


def _revolution_grid(
    system: System, turn: str | bool, instants: int | None, turns: int
) -> TimeGrid:
    drivers = system.independent_drivers
    if turn is True:
        if len(drivers) != 1:
            names = listed(d.name for d in drivers)
            option = remedy(python="turn=True", command="--over turn")
            raise ModelError(
                f"{option} goes with one driver, '{system.mechanism.name}' has {len(drivers)} "
                f"({names}): " + ("name one of them" if drivers else "add one")
            )
        turn = drivers[0].name
    named = [d for d in drivers if turn in (d.name, getattr(d, "body", None))]
    if not named:
        known = listed(d.name for d in drivers)
        sentence = f"there is no driver {brief(turn)} to turn (there are: {known})"
        raise ModelError(sentence, str(turn))
    driver = named[0]
    if not driver.angular:
        raise ModelError(
            f"driver '{driver.name}' drives no angle, it cannot turn: "
            + remedy(
                python="give times t, or drive",
                command=f"give its lengths with --at {driver.name}=…, or times with --at t=…",
            ),
            driver.name,
        )
    turns = whole_number("turns", turns, 1, MOST)
    if instants is None:
        instants = (REVOLUTION_INSTANTS - 1) * turns + 1
    instants = whole_number("instants", instants, 2)
    check_room(system, instants)
    if system.batch is not None:
        raise ModelError("a turn of a batch of designs: give times or driver values instead")
    start, speed, change = _law(system, driver, np.zeros(1))[0].tolist()
    sign = math.copysign(1.0, speed or change or 1.0)
    values = start + sign * np.linspace(0.0, 2.0 * math.pi * turns, instants)
    if speed == 0.0 and change == 0.0:
        # a driver at rest is turned slowly: positions without rates
        return _grid_of_values(system, 0.0, {driver.name: values})
    try:
        times = np.asarray(times_of(system.law_of(driver), values, 0.0, angle_text))
    except ModelError as error:
        raise ModelError(
            f"driver '{driver.name}' does not make "
            f"{'a whole turn' if turns == 1 else f'{turns} turns'} by its law: {error}",
            driver.name,
        ) from None
    except Exception as error:
        raise _failed(driver, error) from error
    return by_time(system, times)
