"""Derivatives of a motion beside differences, where what jumps on the way cannot be seen.

Users' functions, valves and pressures by tables may jump anywhere. Along one direction in all the
numbers the derivatives are compared with differences of motions at four places.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mbody.derivatives.gradient_result import Gradient
from mbody.derivatives.named_numbers import number_sizes
from mbody.derivatives.reduced_measures import instants_of
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed
from mbody.model.loads import PistonPressure, ReciprocatingCylinder
from mbody.solution.solution import Solution
from mbody.sweeps.columns import MeasuredColumn
from mbody.system.system import System

__all__ = ["compared_with_differences", "may_jump_unseen"]

Array = np.ndarray

#: Steps, as parts of the sizes of the numbers.
PART = 1e-4
#: Derivatives may differ by this part of what all numbers do together, or by so many times what
#: differences of two steps differ by; motions have errors of so many times their rtol.
ALLOWED, BANDS, ERRORS = 2e-3, 3.0, 1e2
#: Motions for differences are so much more exact than the motion itself, as far as they can be.
FINER, FINEST = 1e-2, 1e-12


def may_jump_unseen(system: System) -> list[str]:
    """Elements that may jump where nothing shows it."""
    own = [name for name, function in system.functions if function is not None]
    valves = (ReciprocatingCylinder, PistonPressure)
    own += [load.name for load in system.mechanism.loads if isinstance(load, valves)]
    own += [one.name for one in system.mechanism.controllers]
    return list(dict.fromkeys(own))


def compared_with_differences(
    found: Gradient,
    system: System,
    by: Sequence[str],
    columns: Sequence[MeasuredColumn],
    run_of: Callable[[System, float], Solution],
    rtol: float,
) -> Gradient:
    """The gradient; NaN, and a note, of measures that change otherwise.

    by: dotted names, in the order of the gradient; run_of: the motion of a system with an rtol.
    """
    fine = max(FINER * rtol, FINEST)
    sizes = np.array([name in system.values for name in by]) * number_sizes(system, by)
    sizes[np.isnan(found.jacobian).any(axis=tuple(range(found.jacobian.ndim - 1)))] = 0.0
    # both signs, so that numbers that act alike do not always act together
    way = PART * sizes * np.where(np.arange(len(by)) % 2, -0.7, 1.0)
    if not way.any():
        return found
    names = listed(may_jump_unseen(system))
    try:
        ends = [
            _measured(system, by, k * way, columns, lambda other: run_of(other, fine))
            for k in (-2, -1, 1, 2)
        ]
    except (ModelError, SolveError):
        note = f"{names} may jump on the way, which differences of motions could not rule out"
        return replace(found, notes=(*found.notes, note))
    jacobian, notes = found.jacobian.copy(), list(found.notes)
    for k, column in enumerate(columns):
        low, near, up, most = (np.asarray(one[k]) for one in ends)
        wide, narrow = 0.5 * (most - low), up - near
        rows = np.nan_to_num(jacobian[k])
        apart = np.abs(2.0 * rows @ way - narrow)
        scale = 2.0 * np.abs(rows * way).sum(axis=-1)
        limit = ALLOWED * np.maximum(scale, np.abs(narrow)) + BANDS * np.abs(wide - narrow)
        # below the noise of the motions nothing can be said
        noise = ERRORS * fine * np.abs(np.asarray(found.value[column.name])).max(initial=0.0)
        if (apart > np.maximum(limit, noise)).any():
            jacobian[k] = np.nan
            notes.append(
                f"'{column.name}' has no derivative: differences of motions are others, as "
                f"{names} jump on the way, or change fast"
            )
    return replace(found, jacobian=jacobian, notes=tuple(notes))


def _measured(
    system: System,
    by: Sequence[str],
    change: Array,
    columns: Sequence[MeasuredColumn],
    run_of: Callable[[System], Solution],
) -> list[Array]:
    moved = {
        name: float(system.values[name]) + float(more)
        for name, more in zip(by, change, strict=True)
        if more
    }
    run = run_of(system.with_values(moved))
    return [np.asarray(instants_of(run, column).value) for column in columns]
