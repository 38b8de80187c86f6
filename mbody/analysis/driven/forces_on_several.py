"""Forces of rows that have no place of their own: of couplings, of drivers that follow positions,
of stops, and of contacts that joints bring.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.kernels.layout import Work
from mbody.model.constraint import Constraint
from mbody.model.contact import Contact, Rope
from mbody.model.stop import Stop
from mbody.solution.checks import loaded
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.solution import Solution
from mbody.system.driver_formulas import recorded_driver
from mbody.system.rank import jacobian
from mbody.system.stop_formulas import recorded_stop
from mbody.system.system import System

__all__ = ["acting_on_several", "coupled", "rows_on"]

Array = np.ndarray


def acting_on_several(solution: Solution) -> list[tuple[Constraint, tuple[str, ...]]]:
    """The couplings, the drivers that follow positions and the stops that act, with all bodies that
    each acts on.
    """
    system = solution.system
    machine, at = system.mechanism, system.numbers
    found: list[tuple[Constraint, tuple[str, ...]]] = []
    found += [(coupling, coupling.bodies) for coupling in machine.couplings]
    for driver in system.drivers:
        if driver not in system.leaders:
            follows = recorded_driver(driver, at.law(driver, "law"), machine, at).follows
            # positions are measured from the ground
            found.append((driver, (*dict.fromkeys(("ground", *driver.bodies, *follows)),)))
    for stop in machine.contacts:
        if isinstance(stop, Stop) and (solution.modes or stop.closed):
            found.append((stop, ("ground", *recorded_stop(stop, machine, at).follows)))
    return found


def coupled(solution: Solution, name: str, instant: int) -> Array:
    """What a coupling, a driver that follows positions, or a stop does to the bodies (bodies, 3):
    forces at the mass centres, and torques.
    """
    system = solution.system
    e = system.primitives_of[name][0]
    row = _row(system, loaded(solution, instant), e)
    # what rows do to coordinates is −Φ_qᵀ λ
    return np.asarray(-row.reshape(-1, 3) * solution.primitive_history(e, 0)[instant])


def _row(system: System, work: Work, e: int) -> Array:
    """Φ_q of the row of a primitive (coordinates,)."""
    always = np.flatnonzero(system.row_table[0] == e)
    if len(always):
        return np.asarray(jacobian(system, work)[1][always[0]])
    uni, place = Unilateral(system), int(np.flatnonzero(system.layout.switched == e)[0])
    return np.asarray(uni.read(work).block[place] / uni.units[place])


def rows_on(solution: Solution, body: str) -> Iterator[tuple[str, Array, Array, Array]]:
    """Names, forces and torque about the mass centre of a body (instants,) of the contacts on it
    that joints bring, and of freewheels.
    """
    for contact in acting_contacts(solution):
        if body in contact.bodies and not isinstance(contact, Contact | Rope):
            own = solution.reaction(contact.name, on=body)
            yield contact.name, own.fx, own.fy, own.torque
