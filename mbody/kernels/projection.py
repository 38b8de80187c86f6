"""The manifold Φ = 0, Φ_q v = ν in free motion: onto it, and how far it is from singular.

All of it is in the metric of the masses, by the factor that the accelerations take too.
"""

from __future__ import annotations

from mbody.compiler.jit import njit
from mbody.compiler.lanes import ld, smaller, st
from mbody.kernels.accelerations import balance
from mbody.kernels.constraints import rows, turns
from mbody.kernels.forces import signals
from mbody.kernels.position_velocity import (
    clear,
    least_motion,
    newton,
    rates_of_rows,
    reach,
    take_off,
)
from mbody.kernels.schur_ldl import VANISHED, apply_g, factor
from mbody.kernels.singularity_monitor import left_of

__all__ = ["accelerate", "project_velocity", "tangential", "weakest"]

#: Corrections of the position below this are rounding, in model lengths and radians.
CLOSED = 1e-13
#: Newton steps of one projection.
NEWTON = 12


@njit
def project_position(L, W, w, soft):
    """q ← the nearest position with Φ = 0, in the metric of the masses. Returns how far the first
    step goes, and whether they converge.
    """
    first, last = 0.0, 1e300
    for n in range(NEWTON):
        size, _ = newton(L, W, w, soft, VANISHED)
        if not size < 1e6:
            return first, False
        if n == 0:
            first = size
        # what a step of this size leaves is of second order: rounding
        if size <= CLOSED or size < (1e-7 if n > 0 else 1e-9):
            return first, True
        if n > 1 and size > 0.5 * last:
            return first, size <= 1e3 * CLOSED
        last = size
    return first, False


@njit
def project_velocity(L, W, w, passes):
    """v ← the nearest velocity with Φ_q v = ν, by the present factor. Returns how far it goes."""
    first = 0.0 * ld(W.size, 0, w)
    for n in range(1 + passes):
        rates_of_rows(L, W, w)
        for m in range(2 * L.nodes):
            st(W.x, m, ld(W.x, m, w) - ld(W.nu, m, w), w)
        least_motion(L, W, w, W.x, False)
        if n == 0:
            first = reach(L, W, w)
        take_off(L, w, W.u, W.v)
    return first


@njit
def accelerate(L, W, w, soft, passes, on_manifold):
    """a and λ at W.q, W.v, W.time into W.a and W.lam; `on_manifold` projects position and velocity
    first. Returns how far each was moved, and whether the projection converged.
    """
    signals(L, W, w, L.varying)
    far, fast, good = 0.0, 0.0, True
    if on_manifold:
        far, good = project_position(L, W, w, soft)
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, soft, VANISHED)
    if on_manifold:
        fast = project_velocity(L, W, w, passes)
    rows(L, W, w, None, True)
    balance(L, W, w, passes)
    return far, fast, good


@njit
def weakest(L, W, w):
    """The least part that elimination leaves of the determinant of a node; see `left_of`."""
    least = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(L.nodes):
        least = smaller(least, left_of(L, W, w, k))
    return least


@njit
def tangential(L, W, w, e):
    """e ← the part of e (coordinates,) along the manifold, in the metric of the masses."""
    clear(W.u, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.u, 3 * s + n, e[3 * L.slot_body[s] + n], w)
    apply_g(L, W, w, W.u, W.x)
    least_motion(L, W, w, W.x, False)
    for b in range(L.bodies):
        for n in range(3):
            e[3 * b + n] -= ld(W.u, 3 * L.body_slot[b] + n, w)
