"""Scalar continuation: every instant of one motion, followed along its branch.

Between two instants the step is halved until Newton's correction is small beside the step, the
derivative has not turned round, and the watch (`mbody.kernels.branch_monitor`) lets it pass, so
the branch is
kept however coarse the output. A step that would have to be smaller than any means a dead centre. A
change point is passed where the derivative goes on as before.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.compiler.jit import inline, kernel, njit
from mbody.compiler.lanes import st
from mbody.kernels.branch_monitor import (
    CHANGE_AHEAD,
    MIDDLE,
    NEAR,
    SOUND,
    UNSURE,
    beyond,
    ends_smoothly,
    glance,
    look_back,
    mark,
    shift,
    verdict,
)
from mbody.kernels.forces import forces, signals
from mbody.kernels.output import keep
from mbody.kernels.position_velocity import accelerations, multipliers, newton, rates, velocities
from mbody.kernels.predictor import behind, predict, step
from mbody.kernels.schur_ldl import VANISHED

__all__ = ["DONE", "LOST", "STUCK", "follow", "weakest"]

DONE, STUCK, LOST = 0, 1, 2

#: Accepted correction, in parts of the greatest coordinate: rounding. The last correction is not in
#: Φ_q any more, so it is what velocities and forces are off by, times their condition.
TOLERANCE = 1e-14
#: A first correction larger than this part of the step asks for a smaller step, in squares.
CORRECTION = 0.1**2
#: A derivative that lies off by this part of itself asks for a smaller step, in squares.
TURNED = 0.2**2
#: Most by which a body turns from another one in a step [rad]. What the watch compares are sines of
#: such angles: up to 0.75 it takes none for sound that has been zero, and no sine is zero twice.
SPREAD = 0.55
#: What is as small as this is neither, in squares.
SLIGHT = 1e-9**2
#: A step that would have to be shorter than this part of the longest one is not taken: stuck.
SHORTEST = 2.0**-40
#: A step that turns round and is shorter than this part of the longest one may be at a kink of a
#: law.
KINK = 2.0**-20
#: An instant is at a change point that is no farther from it than this part of the way to it.
AT = 1e-3
#: So many steps one after the other that are shorter than this part of the longest one lead
#: nowhere: rounding decides what the watch sees. Bends of a margin of 1e-8 take some hundred.
CRAWLED, CRAWL = 2000, 2.0**-16
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
def follow(
    L,
    W,
    soft,
    mode,
    s,
    t,
    given,
    ahead,
    with_loads,
    still,
    watched,
    output,
    state,
    nearest,
    passed,
):
    """Fill output (instants, rows, 1) as `keep` says; the first instant starts from W.q.

    watched: whether the branch is watched; else it is only likely to be kept, for less.
    state: [0] instants done, [1] path parameter reached, [2] least pivot met, [3] steps,
    [4] greatest unbalanced part, [5] greatest coordinate, [6] change points passed, [7] one if it
    was the watch over the branch that ended it. nearest (3,): least part that elimination leaves of
    a node, path parameter there, instant before which it is. passed (some, 1 + coordinates): path
    parameter of each change point, and a position close before it. Returns DONE, STUCK (dead
    centre; the place where it ended is the first in W.past), or LOST (Newton failed at the first
    instant).
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    state[2] = 1e300
    # the last step, for the quintic and for the watch
    back, back_watched, quintic, last = 1.0, 1.0, 0.0, 0
    # the longest step, or the first that was tried; what the last refusal leaves of a step
    longest, tried, pace = 0.0, 0.0, 1e300
    crawled = 0
    # greatest inverse part at the last place
    was = 1.0
    here = s[0]
    for k in range(s.shape[0]):
        left = s[k] - here
        h = sized(left, pace)
        if k > 0 and h != 0.0:
            if mode == 2:
                direction(L, W, w, ahead, k - 1, last)
                quintic = 0.0
            if watched and (mode == 2 or longest == 0.0):
                back_watched = math.copysign(look_back(L, W, w, soft, last), h)
            tried = max(tried, abs(h))
        across = False
        while True:
            if k > 0:
                if h != 0.0:
                    predict(L, W, w, h, back, quintic, last)
                row = k - 1 if mode == 2 else k
                drive(L, W, w, mode, here + h, given, row, t[k], ahead)
            else:
                drive(L, W, w, mode, here, given, 0, t[0], ahead)
            good, first, least = settle(L, W, w, soft, state[5])
            found, place, worst = SOUND, 0.0, 1.0
            if good and watched and h != 0.0:
                worst = glance(L, W, 2, soft)
                found, place = verdict(L, W, h, back_watched, soft)
            if good and found != UNSURE:
                velocities(L, W, w, True)
                accelerations(L, W, w, True)
            if k == 0:
                if not good:
                    state[2] = min(state[2], least)
                    return LOST
                if soft != 0.0:
                    mark(L, W, soft)
                if watched:
                    was = glance(L, W, 1, soft)
                    nearest[0] = 1.0 / was
                    nearest[1], nearest[2] = here, 0.0
                last = behind(L, W, w, last)
                break
            kink = False
            if good and h != 0.0 and found != UNSURE:
                moved, off, size, spread = step(L, W, w, h, last)
                good = first * first <= CORRECTION * moved + SLIGHT and (
                    off <= TURNED * size + SLIGHT and (spread <= SPREAD or not watched)
                )
                # so short a step at a regular position stays on its branch: the law turns sharply
                whole = longest if longest > 0.0 else tried
                kink = abs(h) <= KINK * whole and first <= 1e-6 and weakest(L, W) > 1e-8
                good = good or kink
                if good and not kink and found == SOUND and max(worst, was) * NEAR > 1.0:
                    found = SOUND if ends_smoothly(L, W, w, h, soft) else UNSURE
            at_end = False
            if good and found == CHANGE_AHEAD and abs(place - 0.5) > MIDDLE:
                found, at_end = UNSURE, abs(place * h - left) <= AT * abs(left)
                if not across and abs(2.0 * place * h) <= abs(left):
                    h, across = 2.0 * place * h, True
                    continue
            if not good or found == UNSURE or crawled > CRAWLED:
                whole = longest if longest > 0.0 else tried
                h = 0.5 * h
                pace = abs(h)
                if pace <= SHORTEST * whole or here + h == here or at_end or crawled > CRAWLED:
                    state[1], state[7] = here, 1.0 if good else 0.0
                    first_of(W, last)
                    return STUCK
                continue
            state[2] = min(state[2], least)
            state[3] += 1.0
            if h != 0.0:
                if watched and worst * nearest[0] > 1.0:
                    nearest[0], nearest[1], nearest[2] = 1.0 / worst, here + h, float(k)
                if found == CHANGE_AHEAD:
                    pass_by(L, W, here + place * h, last, state, passed)
                    nearest[0], nearest[1], nearest[2] = 0.0, here + place * h, float(k)
                here, was = here + h, worst
                longest = max(longest, abs(h))
                crawled = crawled + 1 if abs(h) <= CRAWL * longest else 0
                last = behind(L, W, w, last)
                shift(L, W)
                back, back_watched, quintic = h, h, 0.0 if kink or mode == 2 else 1.0
                if found == CHANGE_AHEAD:
                    beyond(L, W, soft)
                    back_watched = 0.5 * (1.0 - place) * h
                across = False
            left = s[k] - here
            if abs(left) <= 1e-14 * (abs(s[k]) + abs(here)) or h == 0.0:
                here = s[k]
                break
            if abs(h) >= pace:
                pace = 2.0 * abs(h)
            h = sized(left, pace)
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


@inline
def sized(left, pace):
    """The next step of what is left: all of it, or as the pace is."""
    return left if abs(left) <= pace else math.copysign(pace, left)


@njit
def pass_by(L, W, s, last, state, passed):
    """Note a change point at s, and the last place, which is close before it."""
    n = int(state[6])
    if n < passed.shape[0]:
        passed[n, 0] = s
        for m in range(3 * L.bodies):
            passed[n, 1 + m] = W.past[last + m, 0]
    state[6] += 1.0


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
