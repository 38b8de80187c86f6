"""Scalar continuation: every instant of one motion, followed along its branch.

Between two instants the step is halved until Newton's correction is small beside the step and the
derivative has not turned round, so the branch is kept however coarse the output. A step that
would have to be smaller than any means a dead centre.
"""

from __future__ import annotations

import numpy as np

from mbody._jit import inline, kernel, njit
from mbody._lanes import st
from mbody.core.factor import VANISHED
from mbody.core.forces import forces, signals
from mbody.core.instant import accelerations, multipliers, newton, rates, velocities
from mbody.core.output import keep
from mbody.core.path import behind, predict, step

__all__ = ["DONE", "LOST", "STUCK", "follow", "weakest"]

DONE, STUCK, LOST = 0, 1, 2

#: Accepted correction, in parts of the greatest coordinate: rounding. The last correction is not in
#: Φ_q any more, so it is what velocities and forces are off by, times their condition.
TOLERANCE = 1e-14
#: A first correction larger than this part of the step asks for a smaller step, in squares.
CORRECTION = 0.1**2
#: A derivative that lies off by this part of itself asks for a smaller step, in squares.
TURNED = 0.2**2
#: What is as small as this is neither, in squares.
SLIGHT = 1e-9**2
#: Halvings of one interval before it is called stuck.
HALVINGS = 40
#: Halvings after which a step that turns round may be a kink of a law.
KINK = 20
ITERATIONS = 12


@inline
def drive(L, W, w, mode, s, given, k, t, ahead):
    """Signals at path parameter s. Mode 0: s is time, laws give all. Mode 1: s is the value of the
    one driver. Mode 2: s counts instants, drivers go straight from row k of `given` to the next.
    """
    if mode == 0:
        W.time[0, 0] = s
        signals(L, W, w, L.varying)
        return
    W.time[0, 0] = t
    signals(L, W, w, L.varying)
    for d in range(L.driver_row.shape[0]):
        o = L.driver_row[d]
        if mode == 1:
            W.signal[o, 0], W.signal[o + 1, 0], W.signal[o + 2, 0] = s, 1.0, 0.0
        else:
            slope = ahead[k, d]
            W.signal[o, 0] = given[k, d, 0] + (s - k) * slope
            W.signal[o + 1, 0] = slope
            W.signal[o + 2, 0] = 0.0


@njit
def settle(L, W, w, soft, reach):
    """Newton to convergence: (converged, first correction, least pivot)."""
    first, last, least = 0.0, 1e300, 0.0
    for iteration in range(ITERATIONS):
        e, least = newton(L, W, w, soft, VANISHED)
        if iteration == 0:
            first = e
        if not e < 1e3 * (1.0 + reach):
            return False, first, least
        # at rounding level corrections no longer shrink
        if e <= TOLERANCE * reach or (e <= 1e-9 * reach and e > 0.5 * last):
            return True, first, least
        last = e
    return False, first, least


@njit
def weakest(L, W):
    """Least pivot as a part of its diagonal."""
    least = 1.0
    for k in range(L.nodes):
        for row in range(2):
            part = W.pivot[3 * k + 2 * row, 0] * W.diagonal[2 * k + row, 0]
            least = min(least, 1.0 / part if part > 0.0 else 0.0)
    return least


@kernel
def follow(L, W, soft, mode, s, t, given, ahead, with_loads, still, output, state):
    """Fill output (instants, rows, 1) as `keep` says; the first instant starts from W.q.

    state: [0] instants done, [1] path parameter reached, [2] least pivot met, [3] steps,
    [4] greatest unbalanced part, [5] greatest coordinate. Returns DONE, STUCK (dead centre; the
    place where it ended is the first in W.past), or LOST (Newton failed at the first instant).
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    state[2] = 1e300
    back, quintic, last = 1.0, 0.0, 0
    here = s[0]
    for k in range(s.shape[0]):
        left = s[k] - here
        h = left
        if mode == 2 and k > 0:
            direction(L, W, w, ahead, k - 1, last)
        tries = 0
        while True:
            if k > 0:
                if h != 0.0:
                    predict(L, W, w, h, back, quintic, last)
                row = k - 1 if mode == 2 else k
                drive(L, W, w, mode, here + h, given, row, t[k], ahead)
            else:
                drive(L, W, w, mode, here, given, 0, t[0], ahead)
            good, first, least = settle(L, W, w, soft, state[5])
            if good:
                velocities(L, W, w, True)
                accelerations(L, W, w, True)
            if k == 0:
                if not good:
                    state[2] = min(state[2], least)
                    return LOST
                last = behind(L, W, w, last)
                break
            kink = False
            if good and h != 0.0:
                moved, off, size = step(L, W, w, h, last)
                good = first * first <= CORRECTION * moved + SLIGHT and (
                    off <= TURNED * size + SLIGHT
                )
                # so short a step at a regular position stays on its branch: the law turns sharply
                kink = tries > KINK and first <= 1e-6 and weakest(L, W) > 1e-8
                good = good or kink
            if not good:
                tries += 1
                h = 0.5 * h
                if tries > HALVINGS:
                    state[1] = here
                    first_of(W, last)
                    return STUCK
                continue
            state[2] = min(state[2], least)
            state[3] += 1.0
            if h != 0.0:
                here += h
                last = behind(L, W, w, last)
                back, quintic = h, 0.0 if kink else 1.0
            left = s[k] - here
            if abs(left) <= 1e-14 * (abs(s[k]) + abs(here)) or h == 0.0:
                here = s[k]
                break
            h = left if abs(left) < 2.0 * abs(h) else 2.0 * h
            if mode == 2:
                quintic = 0.0
        finish(L, W, w, mode, given, k, still)
        if with_loads:
            forces(L, W, w, -1)
            rest = multipliers(L, W, w)
            if not rest <= state[4] and not np.isnan(state[4]):
                state[4] = rest
        keep(L, W, w, output[k])
        state[0] = k + 1.0
        state[1] = here
    return DONE


@njit
def direction(L, W, w, ahead, k, last):
    """Mode 2: derivatives at the last place along the chord that begins there."""
    size = W.q.shape[0]
    for d in range(L.driver_row.shape[0]):
        rates(L, W, w, d, ahead[k, d], 0.0)
    velocities(L, W, w, True)
    accelerations(L, W, w, True)
    for n in range(3 * L.bodies):
        W.past[last + size + n, 0] = W.v[n, 0]
        W.past[last + 2 * size + n, 0] = W.a[n, 0]


@njit
def first_of(W, last):
    """Bring the last place to the front."""
    for n in range(3 * W.q.shape[0]):
        W.past[n, 0] = W.past[last + n, 0]


@njit
def finish(L, W, w, mode, given, k, still):
    """Velocities and accelerations by time: from the laws, from the given rates, or none."""
    if mode == 0 and not still:
        return
    if still:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
        return
    if mode != 0:
        for d in range(L.driver_row.shape[0]):
            rates(L, W, w, d, given[k, d, 1], given[k, d, 2])
    velocities(L, W, w, True)
    accelerations(L, W, w, True)
