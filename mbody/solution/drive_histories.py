"""What drivers drive: values, rates and accelerations at the instants of a result."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import Numbers, listed
from mbody.model.numbers import varied
from mbody.solution.own_histories import own_history
from mbody.solution.places import column
from mbody.solution.result import Result
from mbody.solution.tracing import Untraceable
from mbody.system.driver_formulas import followed_states, recorded_driver
from mbody.system.formula_derivatives import SIGNALS, Differentiated, along_motion
from mbody.system.formula_steps import StepList, driven_coordinate
from mbody.system.polar_points import polar_points
from mbody.system.read_only import locked
from mbody.system.step_values import step_values

__all__ = ["drive_states", "driven", "prescribed_rate"]

Array = np.ndarray


def driven(solution: Result, driver: str) -> tuple[Array, Array, Array]:
    """Value, rate and acceleration of what a driver drives; see `Solution.driven`.

    Raises
    ------
    ModelError
        For a driver that does not exist.
    """
    names = [d.name for d in solution.mechanism.drivers]
    if driver not in names:
        raise ModelError(f"there is no driver {driver!r} (there are: {listed(names)})", str(driver))
    states = solution.drive_states
    if states is None:
        element = solution.mechanism.drivers[names.index(driver)]
        if _follows(solution, element):
            found = _measured(solution, element)
        elif solution.given is not None:
            found = solution.given[:, names.index(driver)].T[:, None]
        else:
            designs = range(solution.record.count if varied(solution.system.values, element) else 1)
            laws = [solution.system.law_of(element, design=n) for n in designs]
            found = np.array([law.derivatives(solution.t) for law in laws]).swapaxes(0, 1)
        whole = np.broadcast_to(found, (3, solution.record.count, len(solution.t)))
        value, rate, change = _since_release(solution, element, whole)
    else:
        value, rate, change = states[:, names.index(driver)].T
    return value, rate, change


def drive_states(solution: Result) -> Array | None:
    """Value, rate, acceleration (instants, drivers, 3), None where designs differ in them."""
    drivers = solution.mechanism.drivers
    if solution.record.batch and solution.given is None:
        return None
    following = [n for n, driver in enumerate(drivers) if _follows(solution, driver)]
    if solution.given is not None and not following:
        return solution.given
    if solution.record.batch:
        return None
    states = np.zeros((len(solution), len(drivers), 3))
    for n, driver in enumerate(drivers):
        if n in following:
            states[:, n] = _measured(solution, driver).T
        elif solution.given is not None:
            states[:, n] = solution.given[:, n]
        else:
            for k, part in enumerate(solution.system.law_of(driver).derivatives(solution.t)):
                states[:, n, k] = part
        states[:, n] = _since_release(solution, driver, states[:, n].T).T
    read: Array = locked(states)
    return read


def prescribed_rate(solution: Result, driver: str) -> Array:
    """The rate by which the power of a driver comes, of the shape of its effort: that of its
    coordinate, less what positions that it follows give.
    """
    element: Any = solution.mechanism[driver]
    if not _follows(solution, element):
        rate: Array = solution.driven(driver)[1]
        return rate
    if not isinstance(solution.t, np.ndarray):
        raise Untraceable("the power of a driver that follows positions or states")
    at = _columns(solution)
    found = recorded_driver(element, at.law(element, "law"), solution.mechanism, at)
    return _values(solution, found.steps, (found.rate,))[0]


def _follows(solution: Result, driver: Any) -> bool:
    """Whether a driver follows positions or own states, so that only the motion says its value."""
    system = solution.system
    if driver not in system.leaders:
        return True
    return bool(followed_states(driver, system.mechanism, system.numbers))


def _since_release(solution: Result, driver: Any, prescribed: Array) -> Array:
    """Value, rate and acceleration (3, …, instants): from its release on nothing follows the law,
    and they are those of the motion.
    """
    free = solution.t >= solution.released.get(driver.name, np.inf)
    if not free.any():
        return prescribed
    return np.where(free, _measured(solution, driver), prescribed)


def _measured(solution: Result, driver: Any) -> Array:
    """Value, rate and acceleration of the coordinate of a driver, by the motion (3, …)."""
    steps = StepList()
    value = driven_coordinate(steps, driver, _columns(solution))
    along = Differentiated(steps, along_motion(lambda _: None, accelerated=True))
    rate = along.of(value)
    change = along.of(rate)
    assert rate is not None and change is not None, "coordinates move"
    return np.array(_values(solution, steps, (value.place, rate.place, change.place)))


def _columns(solution: Result) -> Numbers:
    """The numbers of a system, those of designs as columns (designs, 1)."""
    system = solution.system
    values = {name: column(value) for name, value in system.values.items()}
    return Numbers(values, polar_points(system.mechanism), system.mechanism.bodies)


def _values(solution: Result, steps: StepList, goals: tuple[int, ...]) -> list[Array]:
    """Recorded numbers at the instants of a result."""
    shape = solution.t.shape
    if solution.record.batch:
        shape = (solution.record.count, *shape)
    system = solution.system
    kinds = ("position", "velocity", "acceleration")

    def read(kind: str, *rest: Any) -> Any:
        if kind == "time":
            return solution.t
        if kind == "own":
            return own_history(solution, rest[0])
        if kind.startswith("signal"):
            return _signal(solution, rest[0], SIGNALS.index(kind))
        body, axis = rest
        if body == "ground":
            return 1.0 if kind == "turn" and axis == 0 else 0.0
        row = 3 * system.bodies[body]
        if kind == "turn":
            angle = solution.record.take(row + 2)
            return np.sin(angle) if axis else np.cos(angle)
        return solution.record.take(kinds.index(kind) * system.coordinates + row + axis)

    return step_values(steps, goals, read, shape)


def _signal(solution: Result, name: str, order: int) -> Array:
    """An input, or a derivative of it; inputs that jump stay between."""
    if order == 0:
        return own_history(solution, name)
    one = next(each for each in solution.mechanism.inputs if each.name == name)
    law: Array = solution.system.law_of(one, "value").derivatives(solution.t)[order]
    return law
