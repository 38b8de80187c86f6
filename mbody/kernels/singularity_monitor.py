"""Distance of a free motion from singular positions, and whether a step keeps its branch.

Branches of the constraints meet where rows of G become dependent, and nowhere else. The
distance d from such a position is the root of what elimination leaves of the determinant of a node
(`node_conditioning`); where a motion runs through one, d falls to zero and rises again as |t − t₀|.

Each step is sampled at several times. If d is zero at some time between two samples d₀ and d₁, a
gap g apart, and changes at most at the rate ρ, then d₀ + d₁ ≤ ρ g: a value that falls from d₀ to
zero and rises to d₁, however often, needs at least the time (d₀ + d₁)/ρ. So d₀ + d₁ > ρ g proves
that there was none; ρ is estimated by the neighbouring gaps. A step for which this does not hold is
made again with a shorter one, and so is one in which bodies turn so far that the samples do not
show how d varies.
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import njit
from mbody.core.lanes import larger, ld, select_le, smaller, st
from mbody.core.tolerances import (
    MONITOR_BEND,
    MONITOR_NOISE,
    MONITOR_STEEPER,
    MONITOR_SWEEP,
    MONITOR_VARIED,
    TINY,
)
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    DECIDE_BELOW,
    KNOWN_UNTIL,
    LEAST_AT,
    LEAST_CONDITIONING,
    SHORTENED_UNTIL,
    TIME,
)


@njit
def node_conditioning(L, W, w, k):
    """Determinant of node k after elimination as a part of its value before: how far its two rows
    are from depending on those before, whatever their axes and the masses of the bodies.

    With the diagonal block S_kk = [a b; b c] of the Schur complement before elimination, and pivots
    d₀, d₁ after it, the part is  d₀ d₁ / (a c − b²),  0 where rows depend, 1 where they are
    orthogonal to all before.
    """
    B, V = W.block, W.weight
    b = 0.0 * ld(W.size, 0, w)
    zero = b
    for side in range(2):
        i, o = L.node_column[2 * k + side], 12 * k + 6 * side
        for m in range(3):
            b = b + ld(V, i + m, w) * ld(B, o + m, w) * ld(B, o + 3 + m, w)
    both = ld(W.diagonal, 2 * k, w) * ld(W.diagonal, 2 * k + 1, w)
    # W.pivot holds 1/d₀ and 1/d₁; a pivot that vanished is zero there
    left = ld(W.pivot, 3 * k, w) * ld(W.pivot, 3 * k + 2, w) * (both - b * b)
    return select_le(TINY, left, 1.0 / left, zero)


@njit
def sample_conditioning(L, W, w, n):
    """Keep the distances of all nodes at the present factor as sample n of the step; returns the
    square of the least, the conditioning of the constraints.
    """
    least = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(L.nodes):
        left = node_conditioning(L, W, w, k)
        least = smaller(least, left)
        st(W.near, n * L.nodes + k, np.sqrt(left), w)
    return least


@njit
def singularity_risk(L, W, w, at, steeper, turned):
    """Above zero where a step may have met a singular position: its samples were taken at the
    parts `at` (samples,) of it. A rate may be `steeper` times that of the neighbouring gaps;
    `turned`: by how much a body turned.
    """
    zero = 0.0 * ld(W.size, 0, w)
    worst, widest = zero - 1.0, 0.0
    for n in range(1, at.shape[0]):
        widest = max(widest, at[n] - at[n - 1])
    blurred = turned * widest - MONITOR_SWEEP
    for k in range(L.nodes):
        d = ld(W.near, k, w)
        rate, both, low, high = zero, zero, d, d
        for n in range(1, at.shape[0]):
            gap = at[n] - at[n - 1]
            here = ld(W.near, n * L.nodes + k, w)
            new, sum_here = np.abs(here - d) / gap, d + here
            # ρ g − (d₀ + d₁): of this gap by the rate of the last one, and the other way round
            worst = larger(worst, steeper * rate * gap - sum_here - MONITOR_NOISE)
            if n > 1:
                worst = larger(
                    worst, steeper * new * (at[n - 1] - at[n - 2]) - both - MONITOR_NOISE
                )
            low, high = smaller(low, here), larger(high, here)
            d, rate, both = here, new, sum_here
        worst = larger(worst, smaller(blurred, high - low - MONITOR_VARIED * high))
    return worst


@njit
def may_be_singular(L, W, S, at, other, near_singular):
    """Whether a step between S.y and the state `other` (2·coordinates,), of either direction, may
    have met a singular position that is not known. Steps that are near one (see
    `mbody.kernels.runge_kutta`) take it for granted that they are short beside the distance from
    it.
    """
    state = S.state
    t = state[TIME]
    if t <= state[KNOWN_UNTIL]:
        return False
    turned = largest_rotation(L, 0.0, S.y, other)
    bend = near_singular or (t < state[SHORTENED_UNTIL] and state[DECIDE_BELOW] == 0.0)
    return singularity_risk(L, W, 0.0, at, MONITOR_BEND if bend else MONITOR_STEEPER, turned) > 0.0


@njit
def record_accepted(L, W, S, sample, least, least_at, artificial):
    """Record a step that is accepted, whose last sample was number `sample`: where it was nearest
    to a singular position, and, with `artificial`, the energy of what replaces missing masses.
    """
    state = S.state
    keep_last_sample(L, W, 0.0, sample, 1.0)
    if least < state[LEAST_CONDITIONING]:
        state[LEAST_CONDITIONING], state[LEAST_AT] = least, least_at
    if artificial:
        state[ARTIFICIAL_ENERGY] = artificial_energy(L, W, 0.0, W.v)


@njit
def artificial_energy(L, W, w, v):
    """Kinetic energy of masses that replace missing ones, as a part of that of the masses, at
    the velocities v (coordinates, ·).
    """
    own, lent = 0.0 * ld(W.size, 0, w), 0.0 * ld(W.size, 0, w)
    for b in range(L.bodies):
        s = L.body_slot[b]
        share = ld(W.share, s, w)
        for n in range(3):
            rate, mass = ld(v, 3 * b + n, w), ld(W.mass, 3 * b + n, w)
            own = own + mass * rate * rate
            lent = lent + (1.0 / (ld(W.weight, 3 * s + n, w) * share) - mass) * rate * rate
    return lent / (own + TINY)


@njit
def largest_rotation(L, w, y, end):
    """By how much the body that turns most does, from the state y to `end` (2·coordinates, ·)."""
    most = 0.0 * ld(y, 0, w)
    for b in range(L.bodies):
        most = larger(most, np.abs(ld(end, 3 * b + 2, w) - ld(y, 3 * b + 2, w)))
    return most


@njit
def keep_last_sample(L, W, w, n, accepted):
    """Where `accepted` is one the last sample, number n, becomes the first of the next step."""
    for k in range(L.nodes):
        new = ld(W.near, n * L.nodes + k, w)
        st(W.near, k, select_le(1.0, accepted, new, ld(W.near, k, w)), w)
