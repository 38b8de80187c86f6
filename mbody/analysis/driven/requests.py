"""An analysis at the instants that a description or a command requests."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import driven
from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.analysis.driven.statics import statics
from mbody.errors import ModelError, SolveError, angle_text, brief
from mbody.laws import Law, times_of
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.study import Instants
from mbody.quantities import Formula, FormulaError
from mbody.quantities.units import DIMENSIONS
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

__all__ = [
    "ANALYSES",
    "analyse_at",
    "analyse_system_at",
    "dimension_of_instants",
    "check_instants",
    "arguments_at",
]

ANALYSES = {"kinematics": kinematics, "kinetostatics": kinetostatics, "statics": statics}

#: Part of a turn within which a value is where the law begins, not a turn later.
HERE = 1e-12


def analyse_at(
    mechanism: Mechanism,
    analysis: str,
    ask: Instants | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """A driven analysis at requested instants.

    The motion is followed from t = 0, so that the guesses of the bodies, which say the branch at
    the beginning, hold for every instant.

    Parameters
    ----------
    mechanism : Mechanism
        Driven so that no freedom is left.
    analysis : str
        "kinematics", "kinetostatics" or "statics".
    ask : Instants, optional
        By default those of the mechanism, else t = 0.
    assembly : str or int, optional
        The assembly mode at the first of these instants, by its name or number; by default the one
        that the drivers lead to from their beginning.

    Raises
    ------
    ModelError
        For a driver that there is not, or a value that its law never takes.
    SolveError
        As of the analysis.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, start=0.5, speed=10.0)
    >>> run = analyse_at(machine, "kinematics", Instants(at={"crank": "90 deg"}))
    >>> round(float(np.degrees(run["crank"].angle[0])), 6)
    90.0
    """
    wanted = ask or mechanism.ask or Instants()
    return analyse_system_at(assemble(mechanism), analysis, wanted, assembly)


def analyse_system_at(
    system: System, analysis: str, ask: Instants, assembly: str | int | None = None
) -> Solution:
    """The same of a system, with the numbers that it has."""
    verb = ANALYSES[analysis]
    how, before = arguments_at(system, ask)
    if assembly is not None:
        return verb(system, **_from(how, before), assembly=assembly)
    if not before:
        return verb(system, **how)
    try:
        t, drive = how.get("t"), how.get("drive")
        return driven(system, analysis, t, drive, None, None, None, None, before=before)
    except SolveError:
        # where the beginning cannot be reached the instants may be taken by themselves
        return verb(system, **_from(how, before))


def _from(how: dict[str, Any], before: int) -> dict[str, Any]:
    """Arguments without the first instants, which lead to those requested."""
    if "t" in how:
        return {"t": how["t"][before:]}
    if "drive" in how:
        return {"drive": {name: values[before:] for name, values in how["drive"].items()}}
    return how


def arguments_at(system: System, ask: Instants) -> tuple[dict[str, Any], int]:
    """The arguments of an analysis, and how many instants it has before the requested ones."""
    if ask.over:
        turn = True if ask.over == "turn" else ask.over
        return {"turn": turn, "instants": ask.instants, "turns": ask.turns}, 0
    if not ask.at:
        return {}, 0
    wanted = _instants(system, ask)
    if "t" in wanted:
        return {"t": np.concatenate([[0.0], wanted["t"]])}, 1
    return {"drive": {d.name: _before(system, d, wanted) for d in system.leaders}}, 1


def dimension_of_instants(mechanism: Mechanism, name: str) -> str:
    """The dimension of the values that are requested by that name: of t, of a driver.

    Raises
    ------
    ModelError
        For a driver that there is not.
    """
    if name == "t":
        return "time"
    return "angle" if _driver(mechanism, name).angular else "length"


def check_instants(mechanism: Mechanism, ask: Instants) -> None:
    """Refuse a question that no analysis of the mechanism could answer.

    Raises
    ------
    ModelError
        For a driver that there is not, or a value of another dimension.
    """
    for name, row in ask.at.items():
        if name == "t" and len(ask.at) > 1:
            raise ModelError("ask: give t or values of drivers, not both")
        _values(mechanism, name, row)
    drivers = [_driver(mechanism, name).name for name in ask.at if name != "t"]
    if len(set(drivers)) < len(drivers):
        raise ModelError(f"ask: {listed(ask.at)} are one driver: name it once")
    counts = {name: len(row) for name, row in ask.at.items() if len(row) > 1}
    if len(set(counts.values())) > 1:
        counted = " and ".join(f"{count} of '{name}'" for name, count in counts.items())
        raise ModelError(f"ask: there are {counted}: give as many values of each, or one")
    if ask.over not in ("", "turn"):
        _driver(mechanism, ask.over)


def _before(system: System, driver: Driver, wanted: dict[str, np.ndarray]) -> np.ndarray:
    """Values of a driver, its own beginning first."""
    begin = float(system.law_of(driver)(0.0))
    count = max(len(values) for values in wanted.values())
    values = np.broadcast_to(wanted.get(driver.name, np.array([begin])), count)
    return np.concatenate([[begin], values])


def _instants(system: System, ask: Instants) -> dict[str, np.ndarray]:
    """Times, or values of drivers that rest, by name."""
    mechanism = system.mechanism
    check_instants(mechanism, ask)
    if "t" in ask.at:
        return {"t": _values(mechanism, "t", ask.at["t"])}
    wanted: dict[str, np.ndarray] = {}
    for name, row in ask.at.items():
        wanted[_driver(mechanism, name).name] = _values(mechanism, name, row)
    moving = [d for d in system.leaders if not _rests(system, d)]
    named = [d for d in moving if d.name in wanted]
    if not moving:
        return wanted
    if not named:
        raise ModelError(
            f"ask: '{next(iter(wanted))}' rests while '{moving[0].name}' moves: say where "
            f"'{moving[0].name}' is, or give t",
            moving[0].name,
        )
    times = _times(system, named[0], wanted[named[0].name])
    times = np.broadcast_to(times, max(len(values) for values in wanted.values()))
    for driver in system.leaders:
        if driver.name in wanted and driver is not named[0]:
            _check_meets(system, driver, wanted[driver.name], named[0], times)
    return {"t": times}


def _rests(system: System, driver: Driver) -> bool:
    """Whether a driver never moves; a law that begins with a dwell, or gently, does."""
    law = system.law_of(driver)
    return law.kind == "polynomial" and not any(law.parameters(law.numbers())[1:])


def _driver(mechanism: Mechanism, name: str) -> Driver:
    """The driver of that name, or the one that drives the body of that name."""
    found = [d for d in mechanism.drivers if name in (d.name, getattr(d, "body", None))]
    if not found:
        known = listed(d.name for d in mechanism.drivers)
        raise ModelError(
            f"there is no driver {brief(name)} (there are: {known}), and t is time", name
        )
    return found[0]


def _values(mechanism: Mechanism, name: str, row: Any) -> np.ndarray:
    wanted = DIMENSIONS[dimension_of_instants(mechanism, name)]
    scope = mechanism.parameters.scope()
    try:
        return np.array([v.of(wanted).value(scope) if isinstance(v, Formula) else v for v in row])
    except FormulaError as error:
        raise ModelError(f"'{name}': {error}", name) from None


def _times(system: System, driver: Driver, values: np.ndarray) -> np.ndarray:
    """When the law of a driver takes values: an angle at the first turn that has it, and angles in
    a row from the beginning of the law or later at their own turns, as 360 deg after 0.
    """
    law = system.law_of(driver)
    if not driver.angular:
        return np.array([_time(law, driver, [value]) for value in values])
    begin, rate, change = law.derivatives(0.0)
    # where the law begins too gently its derivatives do not show the sense
    sense = math.copysign(1.0, rate or change or 1.0)
    ways = sense * (values - begin)
    if len(ways) > 1 and ways[0] > -HERE and (np.diff(ways) > 0.0).all():
        ways = np.maximum(ways, 0.0)
        ways += _further(ways[0]) - ways[0]
        return np.array([_time(law, driver, [begin + sense * way]) for way in ways])
    senses = (sense, -sense)
    places = [[begin + s * _further(s * (value - begin)) for s in senses] for value in values]
    return np.array([_time(law, driver, both) for both in places])


def _time(law: Law, driver: Driver, places: list[float]) -> float:
    """When the law of a driver is first at one of some places, in their order."""
    why: ModelError | None = None
    for place in places:
        try:
            shown = angle_text if driver.angular else "{:g}".format
            return float(times_of(law, [place], 0.0, shown)[0])
        except ModelError as error:
            why = why or error
    raise ModelError(f"driver '{driver.name}' does not come there by its law: {why}", driver.name)


def _further(way: float) -> float:
    """The way that is left to an angle [rad] when one goes on in the same sense, 0 … 2π."""
    further = math.fmod(way, 2.0 * math.pi)
    further += 2.0 * math.pi if further < -HERE else 0.0
    return 0.0 if 2.0 * math.pi - further < HERE else max(further, 0.0)


def _check_meets(
    system: System, driver: Driver, values: np.ndarray, leader: Driver, times: np.ndarray
) -> None:
    """Refuse values of a second driver that its law does not have at the times of the first."""
    there = system.law_of(driver)(times)
    apart = there - values
    if driver.angular:  # at any turn
        apart = np.remainder(apart + math.pi, 2.0 * math.pi) - math.pi
    if np.abs(apart).max() > 1e-9 * (1.0 + np.abs(there).max()):
        raise ModelError(
            f"by its law '{driver.name}' is at {there[0]:g} when '{leader.name}' is where you "
            "want it: name one of them, or give t",
            driver.name,
        )
