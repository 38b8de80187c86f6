"""Dense output: states and work within a step, by polynomials, and the instants that are kept.

A polynomial has rows F as

    Δ(x) = x (F₀ + (1 − x) (F₁ + x (F₂ + (1 − x) (F₃ + …)))),   x the part of the step.

All terms but the first vanish at both ends, so that Δ(1) = F₀ is the change over the step, exactly.
Its rates there give the next two: Δ′(0) = F₀ + F₁ = h f₀ and Δ′(1) = F₀ − F₁ − F₂ = h f₁, hence

    F₀ = y₁ − y₀,   F₁ = h f₀ − F₀,   F₂ = 2 F₀ − h (f₀ + f₁),

which is Hermite's cubic; further rows come from further derivatives within the step.
"""

from __future__ import annotations

import math

from mbody.core.decorators import njit
from mbody.kernels.output import keep
from mbody.kernels.runge_kutta_stages import along, hermite_cubic
from mbody.kernels.singularity_monitor import sample_conditioning
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import DELIVERED, EVALUATIONS, TIME

__all__ = [
    "FIRST",
    "SECOND",
    "deliver",
    "has_instant",
    "hermite_output",
    "interpolate",
    "is_met",
    "keep_instant",
    "keep_work",
]

#: Nodes of Lobatto's rule of order 6, between the ends.
FIRST, SECOND = 0.5 - math.sqrt(0.05), 0.5 + math.sqrt(0.05)


@njit
def has_instant(S, O, now):
    """Whether an output instant lies before the end of the step."""
    k = int(S.state[DELIVERED])
    return k < O.times.shape[0] and O.times[k] < now


@njit
def deliver(L, W, S, O, h, now, refinements):
    """Keep every output instant from the time of the motion to `now`, the end of a step of length
    h from S.last to S.y.

    S: a `Stepping`, whose F and G are the polynomials of state and work; of them G₀ alone must be
    there where no instant lies inside. Rows 1 of K and P are workspace. O: an `Outputs`.
    """
    while is_met(S, O, now):
        x = interpolate(S, O, h, now)
        at = O.times[int(S.state[DELIVERED])]
        state_derivative(L, W, S, at, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        keep_instant(L, W, S, O, x)
    keep_work(S, O)


@njit
def is_met(S, O, now):
    """Whether the next output instant lies within the step, or at its end."""
    k = int(S.state[DELIVERED])
    return k < O.times.shape[0] and O.times[k] <= now


@njit
def interpolate(S, O, h, now):
    """S.stage ← the state at the next output instant; returns its part of the step, 1 at the end,
    where the state is that of the step.
    """
    at = O.times[int(S.state[DELIVERED])]
    whole = at >= now
    x = 1.0 if whole else (at - S.state[TIME]) / h
    for n in range(S.y.shape[0]):
        S.stage[n] = S.y[n] if whole else S.last[n] + along(S.F, n, x, 0.0)
    return x


@njit
def keep_instant(L, W, S, O, x):
    """Keep the next output instant, at the part x of the step, which was evaluated."""
    k, count, G = int(S.state[DELIVERED]), O.times.shape[0], S.G
    keep(L, W, 0.0, O.pages[k])
    for c in range(G.shape[1]):
        O.work[k, c] = O.work[count, c]
        O.work[k, c] += G[0, c] if x == 1.0 else along(G, c, x, 0.0)
    S.state[DELIVERED] = k + 1


@njit
def keep_work(S, O):
    """The work done until now ← with that of the step."""
    for c in range(S.G.shape[1]):
        O.work[O.times.shape[0], c] += S.G[0, c]


@njit
def hermite_output(L, W, S, h, refinements):
    """S.F (5, states) and S.G (4, causes) of a step from S.last to S.y, by derivatives at
    both ends: rows 0 and 1 of K and P; rows 2 and 3 are workspace.

    The position has order 5: F₃ and F₄ follow from the accelerations of both ends, of which
    Δ″(0) = h² a₀ and Δ″(1) = h² a₁ are half of the values below. The velocity is the cubic and one
    term more, with which it has in the middle the rate of the position. Own states have the cubic.
    Work by Lobatto's rule of order 6, (p₀ + 5 p₁ + 5 p₂ + p₃)/12.

    Returns the least conditioning of its two inner nodes, which are samples 1 and 2 of the step,
    and the node.
    """
    least, least_at = 1.0, SECOND
    K, P, F, G, y, last, stage = S.K, S.P, S.F, S.G, S.y, S.last, S.stage
    n3 = 3 * L.bodies
    for n in range(n3):
        m = n3 + n
        change = y[n] - last[n]
        hermite_cubic(F, n, change, h * K[0, n], h * (K[0, n] + K[1, n]))
        # ½ Δ″(0) = −F₁ + F₂ + F₃,  ½ Δ″(1) = −F₁ − 2 F₂ + F₃ + F₄
        F[3, n] = 0.5 * h * h * K[0, m] + F[1, n] - F[2, n]
        F[4, n] = 0.5 * h * h * K[1, m] + F[1, n] + 2.0 * F[2, n] - F[3, n]
        change = y[m] - last[m]
        hermite_cubic(F, m, change, h * K[0, m], h * (K[0, m] + K[1, m]))
        # Δ′(½)/h of the position, and the cubic of the velocity there; F₃ has the factor 1/16
        middle = (F[0, n] + 0.25 * F[2, n] + 0.0625 * F[4, n]) / h
        cubic = last[m] + 0.5 * (F[0, m] + 0.5 * (F[1, m] + 0.5 * F[2, m]))
        F[3, m] = 16.0 * (middle - cubic)
        F[4, m] = 0.0
    for n in range(2 * n3, y.shape[0]):
        hermite_cubic(F, n, y[n] - last[n], h * K[0, n], h * (K[0, n] + K[1, n]))
        F[3, n] = F[4, n] = 0.0
    for row in range(2, 4):
        x = FIRST if row == 2 else SECOND
        for n in range(y.shape[0]):
            stage[n] = last[n] + along(F, n, x, 0.0)
        state_derivative(L, W, S, S.state[TIME] + x * h, stage, row, refinements, False)
        S.state[EVALUATIONS] += 1
        part = sample_conditioning(L, W, 0.0, row - 1)
        if part < least:
            least, least_at = part, x
    x = FIRST
    for c in range(G.shape[1]):
        first, end = h * P[0, c], h * P[1, c]
        G[0, c] = (first + end + 5.0 * h * (P[2, c] + P[3, c])) / 12.0
        G[1, c] = first - G[0, c]
        G[2, c] = 2.0 * G[0, c] - first - end
        # rate of the cubic at the first inner node: what it lacks to the power there is that of F₃
        left = h * P[2, c] - G[0, c] - (1.0 - 2.0 * x) * G[1, c] - x * (2.0 - 3.0 * x) * G[2, c]
        G[3, c] = left / (2.0 * x * (1.0 - x) * (1.0 - 2.0 * x))
    return least, least_at
