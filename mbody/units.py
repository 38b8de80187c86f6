"""Consistent unit systems, chosen by name, and the one door through which numbers enter.

The equations are homogeneous, so a mechanism works in one consistent system and no kernel ever
sees a unit: masses are in the unit that makes force = mass · length / time² hold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

from mbody.errors import ModelError

__all__ = ["UNIT_SYSTEMS", "UnitSystem", "number", "unit_system"]


@dataclass(frozen=True)
class UnitSystem:
    """One consistent system of units: the names that go beside numbers, and standard gravity.

    Attributes
    ----------
    name : str
        As the user chooses it, for example ``"in-lbf-s"``.
    length, force, time, mass : str
        Unit symbols; angles are radians inside and degrees beside printed numbers.
    g : float
        Standard gravity in length/time²: the default by which a weight becomes a mass.
    """

    name: str
    length: str
    force: str
    time: str
    mass: str
    g: float

    def of(self, dimension: str) -> str:
        """Unit symbol of a dimension, for example ``of("torque")`` → ``"lbf·in"``.

        >>> unit_system("in-lbf-s").of("acceleration")
        'in/s²'
        """
        length, force, time, mass = self.length, self.force, self.time, self.mass
        return {
            "length": length,
            "force": force,
            "time": time,
            "mass": mass,
            "weight": force,
            "angle": "rad",
            "velocity": f"{length}/{time}",
            "acceleration": f"{length}/{time}²",
            "angular velocity": f"rad/{time}",
            "angular acceleration": f"rad/{time}²",
            "torque": f"{force}·{length}",
            "inertia": f"{force}·{length}·{time}²",
            "stiffness": f"{force}/{length}",
            "damping": f"{force}·{time}/{length}",
            "torsion stiffness": f"{force}·{length}/rad",
            "torsion damping": f"{force}·{length}·{time}/rad",
            "power": f"{force}·{length}/{time}",
        }[dimension]


UNIT_SYSTEMS = {
    system.name: system
    for system in (
        UnitSystem("SI", "m", "N", "s", "kg", 9.80665),
        UnitSystem("mm-N-s", "mm", "N", "s", "t", 9806.65),
        UnitSystem("in-lbf-s", "in", "lbf", "s", "blob", 9.80665 / 0.0254),
        UnitSystem("ft-lbf-s", "ft", "lbf", "s", "slug", 9.80665 / 0.3048),
    )
}


def unit_system(name: str | UnitSystem) -> UnitSystem:
    """The unit system of that name.

    Raises
    ------
    ModelError
        When there is none; the sentence lists those that there are.
    """
    if isinstance(name, UnitSystem):
        return name
    try:
        return UNIT_SYSTEMS[name]
    except (KeyError, TypeError):
        known = ", ".join(repr(known) for known in UNIT_SYSTEMS)
        raise ModelError(f"there is no unit system {name!r}: choose one of {known}") from None


def number(value: Any, dimension: str, element: str, field: str) -> float:
    """Let one number in: a finite float in the mechanism's unit system.

    Every number that a user writes passes here, so that text with units has one place to enter.

    Raises
    ------
    ModelError
        When it is no number, or not finite; the sentence names the element and the field.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ModelError(
            f"'{element}': {field} must be a number ({dimension}), not {value!r}", element
        )
    result = float(value)
    if not math.isfinite(result):
        raise ModelError(f"'{element}': {field} is {result}, it must be finite", element)
    return result
