"""Words of first velocities: rates by name, and the velocities of branches that meet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.singular_positions import Singular
from mbody.errors import SolveError
from mbody.system.system import System

__all__ = ["nearest_words", "place_words", "rate_words", "undecided", "values_of"]

Array = np.ndarray

#: Rates, and values of one rate, that a sentence names.
NAMED, VALUES = 4, 6
#: Rates that are named to distinguish branches.
RATES = 4
#: A rate below this part of the greatest is none; two that differ by less are one.
STILL = 1e-7


def place_words(system: System, t: float) -> str:
    """Such as "t = 0 s"."""
    return f"t = {t:.6g} {system.mechanism.units.time}"


def undecided(system: System, t: float) -> SolveError:
    """The sentence of a singular position that conditions of second order do not decide."""
    return SolveError(
        f"the motion of '{system.mechanism.name}' is not determined at {place_words(system, t)}: "
        "the position is singular, and conditions of second order do not determine the branches of "
        "its motion; begin a little beside it"
    )


def nearest_words(system: System, here: Singular, y: Array | None) -> str:
    """The nearest velocities that a motion has, as the end of a sentence."""
    if y is None:
        return ""
    return f"; begin with the nearest that one has, {rate_words(system, here.velocity(y))}"


def rate_words(system: System, v: Array) -> str:
    """Angular velocities of the first bodies, or velocities where none turns."""
    units = system.mechanism.units
    rates = v.reshape(-1, 3)
    top = float(np.abs(v).max())
    keys = ("omega",) if np.abs(rates[:, 2]).max() > STILL * top else ("vx", "vy")
    listed_rates = [
        f"{body.name}.{key} = {_plain(rates[n, ('vx', 'vy', 'omega').index(key)], top)}"
        for n, body in enumerate(system.mechanism.bodies)
        for key in keys
    ]
    unit = units.of("angular velocity" if keys[0] == "omega" else "velocity")
    more = f" and {len(listed_rates) - NAMED} more" if len(listed_rates) > NAMED else ""
    return f"{', '.join(listed_rates[:NAMED])} {unit}{more}"


def values_of(
    system: System,
    here: Singular,
    velocities: Sequence[Array],
    prescribed: Sequence[Prescribed],
    which: Prescribed | None = None,
) -> list[str]:
    """Rates that distinguish branches, or that one, each with its values: "c.omega = 0 or 2 rad/s".

    Parameters
    ----------
    velocities : list of array (coordinates,)
        Of the branches, without units of length.
    """
    q = here.rows.scale * here.x
    known = {one.name for one in prescribed}
    candidates = (
        [which]
        if which
        else [
            Prescribed(body.name, key, 0.0)
            for key in ("omega", "vx", "vy")
            for body in system.mechanism.bodies
            if f"{body.name}.{key}" not in known
        ]
    )
    top = max(float(np.abs(v).max()) for v in velocities)
    parts = {one: _classes(one.row(system, q) @ np.array(velocities).T, top) for one in candidates}
    apart: list[tuple[int, ...]] = [()] * len(velocities)
    chosen = list[Prescribed]()
    while len(chosen) < RATES:
        best = max(candidates, key=lambda one: len(set(zip(apart, parts[one], strict=True))))
        finer = [(*a, b) for a, b in zip(apart, parts[best], strict=True)]
        if chosen and len(set(finer)) == len(set(apart)):
            break
        apart, chosen = finer, [*chosen, best]
    return [_with_values(system, one, velocities, q, top) for one in chosen]


def _classes(values: Array, top: float) -> list[int]:
    """Which values are the same, by number."""
    seen = list[float]()
    found = []
    for value in values:
        same = [n for n, other in enumerate(seen) if abs(value - other) <= 1e-6 * top]
        if not same:
            seen.append(float(value))
        found.append(same[0] if same else len(seen) - 1)
    return found


def _with_values(
    system: System, rate: Prescribed, velocities: Sequence[Array], q: Array, top: float
) -> str:
    row, values = rate.row(system, q), list[float]()
    for v in velocities:
        value = float(row @ v)
        if all(abs(value - other) > 1e-6 * top for other in values):
            values.append(value)
    size = rate.unit(system)
    numbers = [_plain(size * value, size * top) for value in sorted(values, key=abs)[:VALUES]]
    more = f" or {len(values) - VALUES} others" if len(values) > VALUES else ""
    return f"{rate.name} = {' or '.join(numbers)}{more} {rate.unit_name(system)}"


def _plain(value: float, top: float) -> str:
    return f"{0.0 if abs(value) <= STILL * top else value:.6g}"
