"""The slope of a state, what each load and driver works at it, and where a motion begins."""

from __future__ import annotations

from mbody.compiler.jit import kernel, njit
from mbody.kernels.forces import forces, signals
from mbody.kernels.output import keep
from mbody.kernels.projection import accelerate
from mbody.kernels.singularity_monitor import sampled
from mbody.kernels.step_state import FREEST, PIVOT, TIME

__all__ = ["begin", "slope"]


@njit
def powers(L, W, P):
    """Power of every load, or of all together where P has no room, then of every driver; after
    `accelerate`, which leaves the sum of all loads.
    """
    count = P.shape[0] - L.driver_row.shape[0]
    alone = count > 1
    for cause in range(count):
        if alone:
            forces(L, W, 0.0, cause)
        total = 0.0
        for n in range(3 * L.bodies):
            total += W.force[n, 0] * W.v[n, 0]
        P[cause] = total
    for d in range(L.driver_row.shape[0]):
        # an effort is −λ
        P[count + d] = -W.lam[2 * L.driver_node[d], 0] * W.signal[L.driver_row[d] + 1, 0]


@njit
def slope(L, W, t, y, K, P, soft, passes, projected):
    """K ← the slope of the state y (2·coordinates,) at the time t, P ← powers; `projected`: of the
    projection of y, which y becomes. Returns how far that moved position and velocity, and whether
    it converged.
    """
    n3 = 3 * L.bodies
    W.time[0, 0] = t
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = y[n], y[n3 + n]
    far, fast, good = accelerate(L, W, 0.0, soft, passes, projected)
    if projected:
        for n in range(n3):
            y[n], y[n3 + n] = W.q[n, 0], W.v[n, 0]
    for n in range(n3):
        K[n], K[n3 + n] = W.v[n, 0], W.a[n, 0]
    powers(L, W, P)
    return far, fast, good


@kernel
def begin(L, W, soft, passes, y, K, P, page, state):
    """Project the first state, take its slope and keep it: y (2·coordinates,), row 0 of K and of
    P, page (rows, 1); state (`PROGRESS`,) with the time.
    """
    signals(L, W, 0.0, L.signal_law.shape[0])
    _, _, good = slope(L, W, state[TIME], y, K[0], P[0], soft, passes, True)
    state[PIVOT] = state[FREEST] = sampled(L, W, 0.0, 0)
    keep(L, W, 0.0, page)
    return good
