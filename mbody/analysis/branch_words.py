"""Words of singular starts: where they are, and the velocities of their branches."""

from __future__ import annotations

import numpy as np

from mbody.analysis.singular import Singular
from mbody.system import System

__all__ = ["nearest_words", "place_words", "rate_words"]

Array = np.ndarray

#: Rates that a sentence names.
NAMED = 4
#: A rate below this part of the greatest is none.
STILL = 1e-7


def place_words(system: System, t: float) -> str:
    """Such as "t = 0 s"."""
    return f"t = {t:.6g} {system.mechanism.units.time}"


def nearest_words(system: System, here: Singular, y: Array | None) -> str:
    """The nearest velocities that a motion has, as the end of a sentence."""
    if y is None:
        return ""
    return f"; the nearest are {rate_words(system, here.velocity(y))}"


def rate_words(system: System, v: Array) -> str:
    """Angular velocities of the first bodies, or velocities where none turns."""
    units = system.mechanism.units
    rates = v.reshape(-1, 3)
    parts = []
    keys = ("omega",) if np.abs(rates[:, 2]).max() > STILL * np.abs(v).max() else ("vx", "vy")
    for n, body in enumerate(system.mechanism.bodies):
        for key in keys:
            value = rates[n, ("vx", "vy", "omega").index(key)]
            value = 0.0 if abs(value) <= STILL * np.abs(v).max() else value
            parts.append((f"{body.name}.{key}", value))
    unit = units.of("angular velocity" if keys[0] == "omega" else "velocity")
    told = ", ".join(f"{name} = {value:.6g}" for name, value in parts[:NAMED])
    return f"{told} {unit}" + (f" and {len(parts) - NAMED} more" if len(parts) > NAMED else "")
