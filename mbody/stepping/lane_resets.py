"""States of many motions by positions and rates by name: on lanes where loops close in ordinary
places, else one by one.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.initial.initial_state import with_start_drivers
from mbody.analysis.position.assembly_analysis import rounding
from mbody.analysis.position.closed_designs import close_batch
from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.singular_positions import SUSPECT
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.loop_closure import project_designs
from mbody.model.numbers import number_in
from mbody.quantities.units import DIMENSIONS
from mbody.stepping.reset import LED, PLACES, nearest_state, prescribed_values
from mbody.system.system import System

__all__ = ["reset_states"]

Array = np.ndarray

#: Velocities that agree with what is prescribed to this part are as good as exact.
AGREE = 1e-9
#: Directions of places in x and y; angles have none.
DIRECTION = {"x": 0.0, "y": math.pi / 2.0}
PLACE = {"vx": "x", "vy": "y", "omega": "angle"}


def reset_states(
    system: System, which: Array, t: Array, base: Array, to: Mapping[str, Any]
) -> tuple[Array, Array]:
    """The states nearest to prescribed values, (states, rows), and how far each is from them.

    Parameters
    ----------
    which : array (states,)
        Numbers of the motions: of a batch, of their designs.
    t : array (states,)
    base : array (states, rows)
        To what all else is near.
    to : mapping
        As of `Simulators.reset`.

    Raises
    ------
    ModelError, SolveError
    """
    n, y = system.coordinates, base.copy()
    places, values = _prescribed(system, to, len(which))
    names = [state.name for state in system.mechanism.states]
    for row, name in enumerate(names):
        if isinstance(to, Mapping) and name in to:
            y[:, 2 * n + row] = _own_values(system, row, to[name], len(which))
    far, left = np.zeros(len(which)), np.ones(len(which), dtype=bool)
    if system.batch is None and np.ptp(t) == 0.0:
        q, v, good = _on_lanes(system, float(t[0]), base[:, :n], places, values)
        y[good, :n], y[good, n : 2 * n] = q[good], v[good]
        left = ~good
    for k in np.flatnonzero(left).tolist():
        one = system.design(int(which[k])) if system.batch is not None else system
        given = [replace(of, value=float(values[m, k])) for m, of in enumerate(places)]
        try:
            near = nearest_state(one, float(t[k]), base[k, :n], given)
        except (ModelError, SolveError) as error:
            raise type(error)(f"motion {which[k]}: {error}", error.element) from error
        y[k, :n], y[k, n : 2 * n], far[k] = near.q, near.v, near.far
    return y, far


def _prescribed(system: System, to: Any, count: int) -> tuple[list[Prescribed], Array]:
    """What is prescribed, and the values (prescribed, states)."""
    own = {state.name for state in system.mechanism.states}
    flat: dict[str, Any] = {}
    if not isinstance(to, Mapping):
        prescribed_values(system, to)
    for name, value in to.items():
        if isinstance(value, Mapping):
            flat |= {f"{name}.{key}": one for key, one in value.items()}
        elif name not in own:
            flat[name] = value
    places, rows = list[Prescribed](), list[Array]()
    for name, value in flat.items():
        numbers = _array(name, value, count)
        sample = value if numbers is None else float(numbers[0])
        (place,) = prescribed_values(system, {name: sample})
        places.append(place)
        rows.append(np.full(count, place.value) if numbers is None else numbers)
    return places, np.array(rows).reshape(len(places), count)


def _array(name: str, value: Any, count: int) -> Array | None:
    """Values of an array; None of a single one."""
    if isinstance(value, str) or np.ndim(value) == 0:
        return None
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"reset: '{name}' must be numbers, not {brief(value)}", name) from None
    if found.shape != (count,):
        raise ModelError(
            f"reset: '{name}' has an array of shape {found.shape} for {count} motions: give one "
            "number, or one for each",
            name,
        )
    if not np.isfinite(found).all():
        raise ModelError(f"reset: '{name}' is not finite everywhere: give finite numbers", name)
    return found


def _own_values(system: System, row: int, value: Any, count: int) -> Any:
    state = system.mechanism.states[row]
    found = _array(state.name, value, count)
    if found is not None:
        return found
    dimension = state.dimension or DIMENSIONS["number"]
    return number_in(system.mechanism, value, dimension, "reset", state.name)


def _on_lanes(
    system: System, t: float, base: Array, given: list[Prescribed], values: Array
) -> tuple[Array, Array, np.ndarray]:
    """Positions and velocities, each (states, coordinates), and which of them are ordinary."""
    count, n = len(base), system.coordinates
    places = [m for m, one in enumerate(given) if one.key in PLACES]
    rates = [m for m, one in enumerate(given) if one.key not in PLACES]
    driven = _driven(system, tuple((given[m].body, given[m].key) for m in places))
    turning = _driven(system, tuple((given[m].body, PLACE[given[m].key]) for m in rates))
    if driven is None or turning is None:
        return base, base, np.zeros(count, dtype=bool)
    # elsewhere something has to be as near as possible, which is not for these kernels
    resting = not rates and not system.drivers
    if driven.rows != n or not (resting or turning.rows == n):
        return base, base, np.zeros(count, dtype=bool)
    driven, turning = _repeated(driven, count), _repeated(turning, count)
    poses = np.hstack([base, np.zeros((count, 3))])
    own = len(system.drivers)
    first = np.full((count, own + len(places)), np.nan)
    start = np.array(
        [[given[m].at(system, q) * given[m].unit(system) for q in base] for m in places]
    )
    goal, good = values[places], np.ones(count, dtype=bool)
    steps = 1
    if places:
        units = np.array([given[m].unit(system) for m in places])[:, None]
        steps = max(1, math.ceil(float(np.abs((goal - start) / units).max()) / LED))
    for k in range(1, steps + 1):
        if places:
            first[:, own:] = (goal if k == steps else start + k / steps * (goal - start)).T
        good &= close_batch(driven, t, first, poses, rounding(driven, poses), SUSPECT)
    speeds = np.full((count, own + len(rates)), np.nan)
    speeds[:, own:] = values[rates].T
    v, off = np.empty((count, n)), np.empty(count)
    work = turning.work()
    work.time[:] = t
    project_designs(turning.layout, work, turning.par, poses, speeds, v, off)
    good &= np.isfinite(poses).all(axis=1) & np.isfinite(v).all(axis=1) & (off <= AGREE)
    return poses[:, :n], v, good


@functools.lru_cache(maxsize=8)
def _driven(system: System, places: tuple[tuple[str, str], ...]) -> System | None:
    """The system with a driver for each place; None where they cannot all be driven."""
    imposed = [
        (f"{body} {key} at the start", (body, key, DIRECTION.get(key, 0.0)), 0.0, 0.0)
        for body, key in places
    ]
    try:
        return with_start_drivers(system, imposed) if imposed else system
    except (ModelError, SolveError):
        return None


def _repeated(system: System, count: int) -> System:
    """A batch of so many equal designs."""
    par, mass = (np.repeat(of, count, axis=1) for of in (system.par, system.mass))
    return replace(system, par=par, mass=mass, batch=count)
