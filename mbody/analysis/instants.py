"""Which instants an analysis is asked for, and how the drivers move between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.drivers import AngleDriver, Driver
from mbody.errors import ModelError
from mbody.laws import times_of
from mbody.system import System

__all__ = ["BY_DRIVER", "BY_INSTANT", "BY_TIME", "Plan", "by_time", "check_laws", "plan"]

#: Instants of a whole turn, both ends included, unless the caller says how many.
TURN = 361

BY_TIME, BY_DRIVER, BY_INSTANT = 0, 1, 2


@dataclass(frozen=True)
class Plan:
    """Instants of an analysis.

    Attributes
    ----------
    mode : int
        What the path parameter is: time, the value of the one driver, or the number of the instant.
    s, t : arrays (instants,)
        Path parameter and time of every instant.
    given : array (instants, drivers, 3)
        Value, rate and acceleration of every driver.
    """

    mode: int
    s: np.ndarray
    t: np.ndarray
    given: np.ndarray

    def take(self, index: np.ndarray) -> Plan:
        """Only some of the instants, in that order."""
        given = self.given if self.mode == BY_TIME else np.ascontiguousarray(self.given[index])
        s, t = (np.ascontiguousarray(part[index]) for part in (self.s, self.t))
        return Plan(self.mode, s, t, given)

    def first(self, system: System, k: int = 0) -> dict[str, float]:
        """Values of the drivers at instant k, where the laws do not say them."""
        if self.mode == BY_TIME:
            return {}
        names = [driver.name for driver in system.mechanism.drivers]
        return dict(zip(names, self.given[k, :, 0].tolist(), strict=True))

    @property
    def chords(self) -> np.ndarray:
        """Change of every driver's value from each instant to the next, (instants, drivers)."""
        values = self.given[:, :, 0]
        return np.ascontiguousarray(np.diff(values, axis=0, append=values[-1:]))


def by_time(system: System, times: np.ndarray) -> Plan:
    """Instants at which the laws say everything."""
    return Plan(BY_TIME, times, times, np.zeros((1, len(system.mechanism.drivers), 3)))


def plan(
    system: System,
    t: Any,
    drive: Mapping[str, Any] | None,
    turn: str | bool | None,
    instants: int | None,
) -> Plan:
    """The instants for what the user asked: times, driver values given directly, or a whole turn.

    Raises
    ------
    ModelError
        For times or values that are not finite or do not fit together, a driver that does not
        exist, a turn of a driver that drives no angle, or a law that turns back before the end.
    """
    asked = [name for name, value in (("t", t), ("turn", turn)) if value is not None]
    if turn is not None and (t is not None or drive is not None):
        raise ModelError(f"turn goes alone: leave out {'t' if t is not None else 'drive'}")
    if instants is not None and "turn" not in asked:
        raise ModelError("instants goes with turn; times and driver values say how many they are")
    if turn is not None and turn is not False:
        return _turn(system, turn, TURN if instants is None else instants)
    if drive:
        return _given(system, 0.0 if t is None else t, drive)
    times = _numbers(0.0 if t is None else t, "t")
    return by_time(system, times)


def _numbers(value: Any, name: str) -> np.ndarray:
    try:
        array = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        raise ModelError(f"{name} must be a number or an array of them, not {value!r}") from None
    if array.ndim != 1 or not array.size:
        raise ModelError(f"{name} must be a number or one row of them, not of shape {array.shape}")
    if not np.isfinite(array).all():
        raise ModelError(f"{name} holds a number that is not finite")
    return np.ascontiguousarray(array)


def _law(system: System, driver: Driver, times: np.ndarray) -> np.ndarray:
    """(instants, 3) of a driver's law."""
    try:
        return np.stack(np.broadcast_arrays(*system.law_of(driver).derivatives(times)), axis=-1)
    except ModelError as error:
        raise ModelError(f"the law of driver '{driver.name}': {error}", driver.name) from None


def check_laws(system: System, times: np.ndarray) -> None:
    """Raise the sentence of a driver whose law has no value at one of the times."""
    for driver in system.mechanism.drivers:
        _law(system, driver, times)


def _given(system: System, t: Any, drive: Mapping[str, Any]) -> Plan:
    drivers = system.mechanism.drivers
    known = {driver.name: n for n, driver in enumerate(drivers)}
    parts: dict[str, list[np.ndarray]] = {}
    for name, value in drive.items():
        if name not in known:
            names = ", ".join(map(repr, known)) or "none"
            raise ModelError(f"there is no driver '{name}' (there are: {names})", name)
        values = value if isinstance(value, tuple) else (value,)
        if len(values) > 3:
            raise ModelError(
                f"driver '{name}' takes a value, or (value, rate, acceleration), not "
                f"{len(values)} of them",
                name,
            )
        parts[name] = [_numbers(v, f"driver '{name}'") for v in values]
    times = _numbers(t, "t")
    sizes = {len(a) for arrays in parts.values() for a in arrays} | {len(times)}
    if len(sizes - {1}) > 1:
        raise ModelError(
            f"driver values and times have different numbers of instants: {sorted(sizes - {1})}"
        )
    count = max(sizes)
    times = np.ascontiguousarray(np.broadcast_to(times, count))
    given = np.zeros((count, len(drivers), 3))
    for name, n in known.items():
        if name in parts:
            for k, array in enumerate(parts[name]):
                given[:, n, k] = array
        else:
            given[:, n] = _law(system, drivers[n], times)
    if len(drivers) == 1:
        return Plan(BY_DRIVER, np.ascontiguousarray(given[:, 0, 0]), times, given)
    return Plan(BY_INSTANT, np.arange(count, dtype=np.float64), times, given)


def _turn(system: System, turn: str | bool, instants: int) -> Plan:
    drivers = system.mechanism.drivers
    if turn is True:
        if len(drivers) != 1:
            raise ModelError(f"say which driver's turn is meant: there are {len(drivers)}")
        turn = drivers[0].name
    named = [d for d in drivers if turn in (d.name, getattr(d, "body", None))]
    if not named:
        known = ", ".join(repr(d.name) for d in drivers) or "none"
        raise ModelError(f"there is no driver '{turn}' to turn (there are: {known})", str(turn))
    driver = named[0]
    if not isinstance(driver, AngleDriver):
        raise ModelError(f"driver '{driver.name}' drives no angle, it cannot turn", driver.name)
    if isinstance(instants, bool) or not isinstance(instants, int) or instants < 2:
        raise ModelError(f"a turn needs at least 2 instants, not {instants!r}")
    if system.batch is not None:
        raise ModelError("a turn of a batch of designs: give times or driver values instead")
    law = system.law_of(driver)
    start, speed, change = law.derivatives(0.0)
    sense = math.copysign(1.0, speed or change or 1.0)
    values = start + sense * np.linspace(0.0, 2.0 * math.pi, instants)
    if speed == 0.0 and change == 0.0:
        # a driver at rest is turned slowly: positions without rates
        return _given(system, 0.0, {driver.name: values})
    try:
        times = np.asarray(times_of(law, values, 0.0))
    except ModelError as error:
        raise ModelError(
            f"driver '{driver.name}' does not make a whole turn by its law: {error}", driver.name
        ) from None
    return by_time(system, times)
