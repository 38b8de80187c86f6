"""Whether a step of free motion keeps its branch: how far it stays from singular positions.

Branches of the constraints meet where rows come to depend on each other, and nowhere else. The
distance from such a position is the root d of what elimination leaves of the determinant of a node
(see `left_of`); where a motion runs through one it falls to zero and rises again as |t − t₀|. Each
step is sampled at several times. Between two of them, a gap g apart, no d that changes at a rate ρ
has been zero, however often, where d + d′ > ρ g; ρ is that of the neighbouring gaps. A step for
which this does not hold is made again with a shorter one, and so is one in which bodies turn so far
that the samples do not show how d varies.
"""

from __future__ import annotations

import numpy as np

from mbody.compiler.jit import njit
from mbody.compiler.lanes import larger, ld, select_le, smaller, st
from mbody.kernels.step_state import ASKING, DOUBTED, FREED, LEAST, LEAST_AT, PASSING

__all__ = [
    "LIGHT",
    "STEEPER",
    "judged",
    "left_of",
    "lightness",
    "sampled",
    "settled",
    "turn_of",
    "uncertain",
    "watched",
]

#: A rate may be so many times that of the neighbouring gaps; in the bend of a branch that passes
#: another one, which steps must resolve, this many times.
STEEPER, BEND = 3.0, 10.0
#: Between two samples no body turns by more than this [rad] where distances vary by more than that
#: part of the greatest: they rise from zero to their greatest value, as a sine does, in π/2 by
#: which one body turns from another, and two may turn against each other, faster than in the mean.
SWEEP, VARIED = 0.4, 0.2
#: Where what stands in for missing masses has this part of the kinetic energy, the motion depends
#: on it; elsewhere corrections by the residual take it away.
LIGHT = 1e-3
#: Distances below this are rounding: pivots are squares of them.
NOISE = 1e-6
#: Least part of a determinant that is not zero.
TINY = 1e-300


@njit
def left_of(L, W, w, k):
    """The part that elimination leaves of the determinant of node k: how far its rows are from
    depending on those before, whatever their axes, and whatever the masses of the bodies.
    """
    B, V = W.block, W.weight
    b = 0.0 * ld(W.size, 0, w)
    zero = b
    for side in range(2):
        i, o = L.node_column[2 * k + side], 12 * k + 6 * side
        for m in range(3):
            b = b + ld(V, i + m, w) * ld(B, o + m, w) * ld(B, o + 3 + m, w)
    both = ld(W.diagonal, 2 * k, w) * ld(W.diagonal, 2 * k + 1, w)
    left = ld(W.pivot, 3 * k, w) * ld(W.pivot, 3 * k + 2, w) * (both - b * b)
    return select_le(TINY, left, 1.0 / left, zero)


@njit
def sampled(L, W, w, n):
    """Keep the distances of all nodes at the present factor as sample n of the step; returns the
    square of the least.
    """
    least = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(L.nodes):
        left = left_of(L, W, w, k)
        least = smaller(least, left)
        st(W.near, n * L.nodes + k, np.sqrt(left), w)
    return least


@njit
def judged(L, W, w, at, steeper, turned):
    """Above zero where a step may have met a singular position: its samples were taken at the
    parts `at` (samples,) of it. A rate may be `steeper` times that of the neighbouring gaps;
    `turned`: by how much a body turned.
    """
    zero = 0.0 * ld(W.size, 0, w)
    worst, widest = zero - 1.0, 0.0
    for n in range(1, at.shape[0]):
        widest = max(widest, at[n] - at[n - 1])
    blurred = turned * widest - SWEEP
    for k in range(L.nodes):
        d = ld(W.near, k, w)
        rate, both, low, high = zero, zero, d, d
        for n in range(1, at.shape[0]):
            gap = at[n] - at[n - 1]
            here = ld(W.near, n * L.nodes + k, w)
            new, sum_here = np.abs(here - d) / gap, d + here
            worst = larger(worst, steeper * rate * gap - sum_here - NOISE)
            if n > 1:
                worst = larger(worst, steeper * new * (at[n - 1] - at[n - 2]) - both - NOISE)
            low, high = smaller(low, here), larger(high, here)
            d, rate, both = here, new, sum_here
        worst = larger(worst, smaller(blurred, high - low - VARIED * high))
    return worst


@njit
def uncertain(L, W, at, t, y, end, careful, state):
    """Whether a step from y at t to `end` (2·coordinates,) may have met a singular position that is
    not known. Careful steps (see `mbody.kernels.runge_kutta`) take it for granted that they are
    short beside
    the distance from it.
    """
    if t <= state[PASSING]:
        return False
    turned = 0.0
    for b in range(L.bodies):
        turned = max(turned, abs(end[3 * b + 2] - y[3 * b + 2]))
    bend = careful or (t < state[DOUBTED] and state[ASKING] == 0.0)
    return judged(L, W, 0.0, at, BEND if bend else STEEPER, turned) > 0.0


@njit
def watched(L, W, last, least, least_at, light, state):
    """Take note of a step that was made, whose last sample was number `last`: where it was nearest
    to a singular position, and whether what has no mass takes part in the energy.
    """
    settled(L, W, 0.0, last, 1.0)
    if least < state[LEAST]:
        state[LEAST], state[LEAST_AT] = least, least_at
    if light:
        state[FREED] = lightness(L, W, 0.0, W.v)


@njit
def lightness(L, W, w, v):
    """Kinetic energy of what stands in for missing masses, as a part of that of the masses, at the
    velocities v (coordinates, ·).
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
def turn_of(L, w, y, end):
    """By how much the body that turns most does, from the state y to `end` (2·coordinates, ·)."""
    most = 0.0 * ld(y, 0, w)
    for b in range(L.bodies):
        most = larger(most, np.abs(ld(end, 3 * b + 2, w) - ld(y, 3 * b + 2, w)))
    return most


@njit
def settled(L, W, w, n, taken):
    """Where `taken` is one the last sample, number n, becomes the first of the next step."""
    for k in range(L.nodes):
        new = ld(W.near, n * L.nodes + k, w)
        st(W.near, k, select_le(1.0, taken, new, ld(W.near, k, w)), w)
