"""What machines with flyballs have in common: the speed at which the balls alone hold the arms."""

from __future__ import annotations

import math

import mbody
from mbody.model.simulation import Unknown

__all__ = ["AXIS", "SOLVED", "balanced", "rpm", "superposed"]

#: The spindle is upright, along y.
AXIS = mbody.Marker("ground", (0.0, 0.0), math.pi / 2)

#: Tolerance and reason of what is found where an effort is to vanish.
SOLVED = 1e-12, "some thousand roundings of 2.2e-16: loops, a linear solve, a quotient"


def balanced(machine: mbody.Mechanism, driver: str = "theta", field: str = "field") -> float:
    """Speed [rad/time] at which the driver has no effort."""
    unknown = Unknown(f"{field}.speed", low=0.0)
    (found,) = mbody.solve_for(machine, unknown, f"{driver}.effort = 0").solutions
    return found.unknowns[unknown.name]


def superposed(machine: mbody.Mechanism, driver: str = "theta", field: str = "field") -> float:
    """The same from one run: efforts superpose, effort = a + b ω²."""
    at_one = mbody.assemble(machine).with_values({f"{field}.speed": 1.0})
    parts = mbody.statics(at_one).breakdown(driver)
    of_field = float(parts[field][0])
    others = sum(float(part[0]) for cause, part in parts.items() if cause != field)
    return math.sqrt(-others / of_field)


def rpm(speed: float) -> float:
    """rad/s to revolutions a minute."""
    return speed * 30.0 / math.pi
