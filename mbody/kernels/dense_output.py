"""States and work within a step, by polynomials, and the instants that are kept of them.

A polynomial is told by rows F as  x (F₀ + (1 − x) (F₁ + x (F₂ + (1 − x) (F₃ + …)))), x the part
of the step: all rows but the first vanish at both ends, so that the end is exact.
"""

from __future__ import annotations

import math

from mbody.compiler.jit import njit
from mbody.kernels.output import keep
from mbody.kernels.singularity_monitor import sampled
from mbody.kernels.state_derivative import slope
from mbody.kernels.step_state import MET, SLOPES

__all__ = ["FIRST", "SECOND", "along", "deliver", "hermite", "inside"]

#: Nodes of Lobatto's rule of order 6, between the ends.
FIRST, SECOND = 0.5 - math.sqrt(0.05), 0.5 + math.sqrt(0.05)


@njit
def along(F, n, x):
    """What column n of a polynomial has gained at the part x of the step."""
    total = 0.0
    for m in range(F.shape[0]):
        row = F.shape[0] - 1 - m
        total = (total + F[row, n]) * (x if row % 2 == 0 else 1.0 - x)
    return total


@njit
def inside(times, state, now):
    """Whether an instant that is to be kept lies before the end of the step."""
    k = int(state[MET])
    return k < times.shape[0] and times[k] < now


@njit
def deliver(L, W, soft, passes, t, h, now, y, last, F, G, ys, K, P, times, output, gained, state):
    """Keep every instant of `times` from t to `now`, the step's end.

    y, last (2·coordinates,): the states of both ends; F and G the polynomials of state and work,
    of which G₀ alone must be there where no instant lies inside. ys, K, P: room for a state, its
    slope and its powers.
    """
    k = int(state[MET])
    while k < times.shape[0] and times[k] <= now:
        whole = times[k] >= now
        x = 1.0 if whole else (times[k] - t) / h
        for n in range(y.shape[0]):
            ys[n] = y[n] if whole else last[n] + along(F, n, x)
        slope(L, W, times[k], ys, K, P, soft, passes, True)
        state[SLOPES] += 1
        keep(L, W, 0.0, output[k])
        for c in range(G.shape[1]):
            gained[k, c] = gained[times.shape[0], c]
            gained[k, c] += G[0, c] if whole else along(G, c, x)
        k += 1
    for c in range(G.shape[1]):
        gained[times.shape[0], c] += G[0, c]
    state[MET] = k


@njit
def hermite(L, W, soft, passes, t, h, y, last, K, P, F, G, ys, state):
    """F (5, 2·coordinates) and G (4, causes) of a step by the states and slopes of both ends.

    The position of order 5, by velocities and accelerations too; the velocity is its slope. Work by
    Lobatto's rule of order 6. Rows 0 of K and P belong to the step's beginning, rows 1 to its end;
    rows 2 and 3 are room. Returns the weakest pivot of its two nodes, which are samples 1 and 2 of
    the step, and the node.
    """
    least, least_at = 1.0, SECOND
    n3 = 3 * L.bodies
    for n in range(n3):
        m = n3 + n
        change = y[n] - last[n]
        F[0, n] = change
        F[1, n] = h * K[0, n] - change
        F[2, n] = 2.0 * change - h * (K[0, n] + K[1, n])
        F[3, n] = 0.5 * h * h * K[0, m] + F[1, n] - F[2, n]
        F[4, n] = 0.5 * h * h * K[1, m] + F[1, n] + 2.0 * F[2, n] - F[3, n]
        change = y[m] - last[m]
        F[0, m] = change
        F[1, m] = h * K[0, m] - change
        F[2, m] = 2.0 * change - h * (K[0, m] + K[1, m])
        # the slope of the position in the middle of the step
        middle = (F[0, n] + 0.25 * F[2, n] + 0.0625 * F[4, n]) / h
        cubic = last[m] + 0.5 * (F[0, m] + 0.5 * (F[1, m] + 0.5 * F[2, m]))
        F[3, m] = 16.0 * (middle - cubic)
        F[4, m] = 0.0
    for row in range(2, 4):
        x = FIRST if row == 2 else SECOND
        for n in range(2 * n3):
            ys[n] = last[n] + along(F, n, x)
        slope(L, W, t + x * h, ys, K[row], P[row], soft, passes, False)
        state[SLOPES] += 1
        part = sampled(L, W, 0.0, row - 1)
        if part < least:
            least, least_at = part, x
    x = FIRST
    for c in range(G.shape[1]):
        first, end = h * P[0, c], h * P[1, c]
        G[0, c] = (first + end + 5.0 * h * (P[2, c] + P[3, c])) / 12.0
        G[1, c] = first - G[0, c]
        G[2, c] = 2.0 * G[0, c] - first - end
        left = h * P[2, c] - G[0, c] - (1.0 - 2.0 * x) * G[1, c] - x * (2.0 - 3.0 * x) * G[2, c]
        G[3, c] = left / (2.0 * x * (1.0 - x) * (1.0 - 2.0 * x))
    return least, least_at
