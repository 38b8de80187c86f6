"""Branches of motion at a singular position: velocities in them, and places along them."""

from __future__ import annotations

import numpy as np

from mbody.analysis.singular.quadratic_cones import size, values
from mbody.analysis.singular.singular_positions import Singular

__all__ = ["BESIDE", "SAID", "along", "fits", "frame", "nearest", "norm", "onto", "still"]

Array = np.ndarray

#: Velocities are those of a branch where they differ from it by less than this part: as of a start
#: that is written with five digits.
SAID = 1e-4
#: Within this, in model lengths and radians, a closed position does not determine the branch.
UNDETERMINED = 1e-6
#: Further away from a singular position than this rates by rows alone are as precise.
BESIDE = 2e-3
#: Places on a branch from which positions near the singular one are interpolated, in radians and
#: model lengths: the error is 2e-12 of the eighth derivative, and rows are independent there.
STEP, PLACES = 0.04, np.array([-7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0])


def norm(y: Array) -> float:
    """Euclidean."""
    return float(np.linalg.norm(y))


def along(T: Array, here: Singular) -> Array:
    """Where a start is along a branch (unknowns,); time is no way away."""
    free = still(T, here.clock)
    return np.asarray((free @ here.y) @ free)


def fits(here: Singular, T: Array) -> bool:
    """Whether a start that is away from the singular position is on a branch; positions that are
    closed to rounding do not determine this within the root of rounding.
    """
    return norm(here.y - along(T, here)) <= 1e-2 * norm(here.y) + UNDETERMINED


def onto(A: Array, y: Array, clock: Array) -> Array | None:
    """The nearest solution of yᵀ A_i y = 0, the rate of the clock kept, by Gauss–Newton."""
    found = y.copy()
    for _ in range(30):
        D = 2.0 * np.einsum("ijk,k->ij", A, found)
        D[:, clock > 0.0] = 0.0
        step = -np.linalg.lstsq(D, values(A, found), rcond=1e-6)[0]
        found = found + step
        if norm(step) <= 1e-15 * norm(found):
            break
    good = np.abs(values(A, found)).max(initial=0.0) <= 1e-12 * size(A, found)
    return found if good else None


def frame(here: Singular, T: Array, place: Array) -> tuple[Array, Array]:
    """The position (coordinates,) at a place on a branch, near the singular one, and how it changes
    with the directions of T: (dimension, coordinates). Both without units of length.

    The place is measured along the branch, so that rows alone do not determine it near the singular
    position; it is interpolated from places farther off.
    """
    if not place.any():
        return here.x, T @ here.ways
    if here.clock.any():  # of second order where time goes on as well
        x = here.x + place @ here.ways + 0.5 * here.bend(T, place)
        return x, np.array([one @ here.ways + here.bend_of(T, place, one) for one in T])
    spread = np.vander(PLACES, increasing=True)
    value, change = np.linalg.inv(spread)[:2]
    x, changes = here.x, []
    for way in T:
        points = np.array([_on(here, T, place + STEP * c * way) for c in PLACES])
        x = value @ points
        changes.append(change @ points / STEP)
    return x, np.array(changes)


def _on(here: Singular, T: Array, place: Array) -> Array:
    """The position at a place that is away from the singular one, by Newton's method."""
    chart = T @ here.N
    x = here.x + place @ here.ways + 0.5 * here.bend(T, place)
    for _ in range(8):
        here.rows.at(x)
        off = np.append(here.rows.phi, chart @ (x - here.x) - T @ place)
        step = np.linalg.lstsq(np.vstack([here.rows.G, chart]), off, rcond=1e-9)[0]
        x = x - step
        if np.abs(step).max() <= 1e-14:
            break
    return np.asarray(x)


def still(T: Array, clock: Array) -> Array:
    """What of a branch leaves the clock alone: (free, unknowns), orthonormal."""
    if not clock.any():
        return T
    rates = T @ clock
    _, sizes, vt = np.linalg.svd(rates[None])
    return np.asarray(vt[int((sizes > 1e-9).sum()) :] @ T)


def nearest(here: Singular, y: Array) -> Array | None:
    """The velocities of a branch nearest to others, the rate of the clock kept; None of none."""
    best: Array | None = None
    for T in here.branches(np.zeros(len(y))).spaces:
        free = still(T, here.clock)
        base = np.zeros(len(y))
        if here.clock.any():
            rates = T @ here.clock
            if not np.abs(rates).max() > 1e-9:
                continue
            base = rates / (rates @ rates) * float(here.clock @ y) @ T
        found = base + ((y - base) @ free.T) @ free
        if best is None or np.linalg.norm(found - y) < np.linalg.norm(best - y):
            best = found
    return best
