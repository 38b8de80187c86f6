"""What drivers drive: values, rates and accelerations at the instants of a result."""

from __future__ import annotations

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.model.numbers import varied
from mbody.solution.result import Result
from mbody.system.read_only import locked

__all__ = ["drive_states", "driven"]

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
        designs = range(solution.record.count if varied(solution.system.values, element) else 1)
        laws = [solution.system.law_of(element, design=n) for n in designs]
        parts = np.array([law.derivatives(solution.t) for law in laws]).swapaxes(0, 1)
        value, rate, change = np.broadcast_to(parts, (3, solution.record.count, len(solution.t)))
    else:
        value, rate, change = states[:, names.index(driver)].T
    return value, rate, change


def drive_states(solution: Result) -> Array | None:
    """Value, rate, acceleration (instants, drivers, 3), None where designs differ in them."""
    drivers = solution.mechanism.drivers
    if solution.given is not None:
        return solution.given
    if solution.record.batch:
        return None
    states = np.zeros((len(solution), len(drivers), 3))
    for n, driver in enumerate(drivers):
        for k, part in enumerate(solution.system.law_of(driver).derivatives(solution.t)):
            states[:, n, k] = part
    read: Array = locked(states)
    return read
