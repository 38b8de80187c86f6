"""States of a user's own in a motion: how they begin, their sizes, methods that integrate them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.model.states import STEADY
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = [
    "find_steady",
    "first_own_states",
    "own_sizes",
    "refuse_own_states",
    "unresolved_states",
]

Array = np.ndarray

#: Methods whose steps take no own states.
WITHOUT = ("rattle", "rattle4")
#: Newton iterations towards a steady start, and the part of the first rates at which it is found.
ITERATIONS, FOUND = 30, 1e-12
#: Where it begins, in sizes of the states: where a rate is flat Newton's method cannot.
TRIED = (0.0, 1.0, -1.0, 10.0, -10.0, 0.1)
#: Part of a state by which differences step: the root of rounding.
STEP = 1.5e-8
#: A state whose size nobody gave is said to be small below this part of it.
SMALL = 1e-3


class Evaluated(Protocol):
    """A motion at its first instant, whose derivative can be evaluated."""

    system: System
    start: Solution
    y: Array
    K: Array

    def evaluate(self) -> bool:
        """Derivative at the state; whether the loops close there."""


def refuse_own_states(system: System, method: str) -> None:
    """Refuse own states where they cannot be integrated.

    Raises
    ------
    ModelError
    """
    machine = system.mechanism
    if method == "singular start" and machine.controllers:
        name = machine.controllers[0].name
        raise ModelError(
            f"the motion begins at a singular position, where there are no accelerations yet for "
            f"controllers such as '{name}' to sample: begin a little beside it",
            name,
        )
    if not machine.states or method not in WITHOUT:
        return
    name = machine.states[0].name
    raise ModelError(
        f"the method '{method}' is of positions and velocities, whose steps it takes in two "
        f"symmetric halves, and has none for equations of first order such as that of '{name}': "
        "take 'generalized-alpha' for steps of one length, or dop853, dopri5, radau5",
        name,
    )


def first_own_states(system: System, start: Solution) -> Array:
    """Own states at the beginning: as a motion left them that is continued, else as described."""
    owns = system.layout.owns
    if owns and start.analysis == "simulate" and start.system.layout.owns == owns:
        return np.asarray(start.record.table(system.own_rows)[-1][:owns])
    return system.first_states[:, 0].copy()


def own_sizes(system: System) -> Array:
    """Sizes of own states, to which absolute errors are relative: as given, else the magnitude of
    the start, else one.
    """
    found = np.ones(system.layout.owns)
    for n, state in enumerate(system.mechanism.states):
        size = system.values.get(f"{state.name}.size", state.size)
        start = np.max(np.abs(system.first_states[n]), initial=0.0)
        if size is not None:
            found[n] = float(np.max(size))
        elif start > 0.0:
            found[n] = float(start)
    return found


def find_steady(motion: Evaluated) -> bool:
    """Set the own states that begin where they are steady, by Newton's method on their rates;
    whether there are any. A motion that is continued keeps its own.

    Raises
    ------
    SolveError
        Where no steady value is found.
    """
    states = motion.system.mechanism.states
    wanted = [n for n, one in enumerate(states) if one.start == STEADY]
    if not wanted or motion.start.analysis == "simulate":
        return False
    rows = 2 * motion.system.coordinates + np.array(wanted)
    z, sizes = motion.y[rows], own_sizes(motion.system)[wanted]

    def rates(at: Array) -> Array:
        motion.y[rows] = at
        motion.evaluate()
        return motion.K[0, rows].copy()

    found = rates(z)
    first = np.abs(found).max()
    for part in TRIED:
        steady = _newton(rates, z + part * sizes, sizes, FOUND * first)
        if steady is not None:
            motion.y[rows] = steady
            return True
    names = ", ".join(f"'{states[n].name}'" for n in wanted)
    raise SolveError(
        f"no steady start is found for {names}: the rates do not vanish near the values tried; "
        "give start a number",
        states[wanted[0]].name,
    )


def _newton(rates: Callable[[Array], Array], z: Array, sizes: Array, small: float) -> Array | None:
    """Where rates vanish, by Newton's method from z; None where it does not converge."""
    found = rates(z)
    for _ in range(ITERATIONS):
        if np.abs(found).max() <= small:
            return z
        slopes = np.empty((len(z), len(z)))
        for n in range(len(z)):
            moved = z.copy()
            moved[n] += STEP * max(abs(z[n]), sizes[n])
            slopes[:, n] = (rates(moved) - found) / (moved[n] - z[n])
        if not np.isfinite(slopes).all() or np.linalg.matrix_rank(slopes) < len(z):
            return None
        z = z - np.linalg.solve(slopes, found)
        found = rates(z)
    return None


def unresolved_states(run: Solution) -> tuple[str, ...]:
    """Notes on own states that stay far below the size by which their error is controlled."""
    notes = []
    system, owns = run.system, run.system.layout.owns
    if not owns or not len(run):
        return ()
    pages = run.record.table(system.own_rows)
    for n, state in enumerate(system.mechanism.states):
        given = state.size is not None
        most, size = float(np.abs(pages[:, n]).max()), float(own_sizes(system)[n])
        if not given and 0.0 < most < SMALL * size:
            unit = "" if state.dimension is None else system.mechanism.units.of(state.dimension)
            notes.append(
                f"state '{state.name}' stays below {most:.3g} {unit}".rstrip()
                + f", its error is controlled as a part of {size:.3g} {unit}".rstrip()
                + ": give it a typical value as size"
            )
    return tuple(notes)
