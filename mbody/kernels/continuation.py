"""Scalar continuation: every instant of one motion, followed along its branch.

Predictor and corrector (Allgower & Georg, *Numerical Continuation Methods*): the polynomial of
`mbody.kernels.predictor` gives a position at the path parameter s + h, Newton's method on
Φ(q, s + h) = 0 corrects it. The step h is halved until

* Newton's first correction is small beside the step, |Δ₁| ≤ 0.1 |Δq|,
* the derivative has not turned, |q′ − q′₀ − h q″₀| ≤ 0.2 of its terms,
* no body turns by more than `SPREAD` from another one,
* the branch monitor (`mbody.kernels.branch_monitor`) accepts it,

so that the branch is kept however coarse the output is. A step that would have to be shorter than
any means a dead centre. A change point is passed where the derivative continues smoothly.

Lanes cannot halve their steps one by one: `mbody.kernels.continuation_lanes` takes fixed steps with
the same predictor and the same tests, and gives a lane that fails one to this path. The two solve
by different factors for the reason given there, and neither loop serves both: of a four-bar, driven
through 3601 instants with its reactions, an instant takes 245 ns on lanes and 1050 ns here (one
core); alone on the loop of lanes it takes 3050 ns, and nothing halves a step.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import st
from mbody.kernels.branch_monitor import (
    CHANGE_AHEAD,
    MIDDLE,
    NEAR_SINGULAR,
    SOUND,
    UNSURE,
    judge_step,
    mark_redundant,
    rates_fit,
    restart_after_change,
    shift_pages,
    store_earlier_parts,
    store_parts,
)
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import viscous_friction
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import keep
from mbody.kernels.position_velocity import (
    accelerations,
    multipliers,
    newton,
    set_rates,
    velocities,
)
from mbody.kernels.predictor import compare_step, predict, store_place
from mbody.kernels.schur_ldl import VANISHED, constraint_conditioning

__all__ = [
    "BRANCH_UNSURE",
    "BY_DRIVER",
    "BY_INSTANT",
    "BY_TIME",
    "CHANGE_POINTS",
    "CORRECTION",
    "DONE",
    "INSTANTS",
    "LOST",
    "PROGRESS",
    "REACHED",
    "SLIGHT",
    "SPREAD",
    "STEPS",
    "STUCK",
    "TURNED",
    "UNBALANCED",
    "DrivenPath",
    "FollowedPath",
    "follow",
]

#: How `follow` ends: at the last instant; at a dead centre, or where the branch is not certain;
#: without a position at the first instant.
DONE, STUCK, LOST = 0, 1, 2
#: What the path parameter is: time; the value of the one driver; the number of the instant.
BY_TIME, BY_DRIVER, BY_INSTANT = 0, 1, 2
#: Numbers of `FollowedPath.progress`: instants finished; path parameter reached; least pivot;
#: steps; greatest unbalanced part of the loads; change points passed; one where the path ended
#: because the branch was not certain. And how many they are.
INSTANTS, REACHED, LEAST_PIVOT, STEPS, UNBALANCED, CHANGE_POINTS, BRANCH_UNSURE = range(7)
PROGRESS = 7
#: Numbers of `FollowedPath.nearest`: least part that elimination leaves of a node, path parameter
#: there, instant before which that is.
PART, PLACE, BEFORE = 0, 1, 2

#: Accepted correction, in parts of the greatest coordinate: rounding. The last correction is not in
#: Φ_q any more, so it is what velocities and forces are off by, times their condition.
TOLERANCE = 1e-14
#: A first correction larger than this part of the step requires a smaller step, in squares.
CORRECTION = 0.1**2
#: A derivative that is off by this part of itself requires a smaller step, in squares.
TURNED = 0.2**2
#: Most by which a body turns from another one in a step [rad]. The branch monitor compares sines of
#: such angles: up to 0.75 it accepts none that has been zero, and no sine is zero twice.
SPREAD = 0.55
#: What is as small as this counts as zero in both tests, in squares.
SLIGHT = 1e-9**2
#: A step shorter than this part of the longest one is not made: stuck.
SHORTEST = 2.0**-40
#: A step that turns and is shorter than this part of the longest one may be at a kink of a law.
KINK = 2.0**-20
#: At a kink the position is regular: Newton's first correction and the conditioning show it.
KINK_CORRECTION, KINK_CONDITIONING = 1e-6, 1e-8
#: An instant is at a change point that is no farther from it than this part of the way to it.
AT = 1e-3
#: So many successive steps shorter than this part of the longest one lead nowhere: rounding decides
#: what the monitor sees. Bends of a margin of 1e-8 take some hundred.
CRAWLED, CRAWL = 2000, 2.0**-16
#: As many steps that were cut short, and move the mechanism by less than `CRAWL` [model lengths and
#: radians], lead nowhere either where a part is less than this.
VANISHING = 1e-6
#: Newton's iterations, and the correction from which on it diverges.
ITERATIONS, DIVERGED = 12, 1e3


class DrivenPath(Bundle):
    """What the drivers prescribe, and how it is followed."""

    mode: int  # BY_TIME, BY_DRIVER or BY_INSTANT
    s: Floats  # (instants,) path parameter
    t: Floats  # (instants,) time
    given: Stacks  # (instants, drivers, 3): value, rate and acceleration, except by time
    chords: Rows  # (instants, drivers): change of the value to the next instant, by instant only
    with_forces: int  # whether reactions are computed
    at_rest: int  # whether velocities and accelerations are zero (statics)
    monitored: int  # whether the branch is made certain; else it is only likely to be kept
    regularization: float  # of redundant rows, zero where there are none
    reach: float  # greatest coordinate in model lengths and radians, of which TOLERANCE is a part


class FollowedPath(Bundle):
    """Where `follow` puts what it finds."""

    output: Stacks  # (instants, rows, 1), rows as of `mbody.kernels.output.keep`
    progress: Floats  # (PROGRESS,)
    nearest: Floats  # (3,)
    passed: Rows  # (change points, 1 + coordinates): path parameter, a position close before it


@inline
def set_drivers(L, W, w, path, s, k):
    """Signals at path parameter s on the way to instant k. By time the laws give all of them. By
    driver s is its value. By instant the drivers go in a straight line from instant k − 1 to k.
    """
    if path.mode == BY_TIME:
        W.time[0, 0] = s
        signals(L, W, w, L.varying)
        return
    W.time[0, 0] = path.t[k]
    signals(L, W, w, L.varying)
    begin = max(k - 1, 0)
    for d in range(L.driver_row.shape[0]):
        o = L.driver_row[d]
        if path.mode == BY_DRIVER:
            W.signal[o, 0], W.signal[o + 1, 0], W.signal[o + 2, 0] = s, 1.0, 0.0
        else:
            slope = path.chords[begin, d]
            W.signal[o, 0] = path.given[begin, d, 0] + (s - begin) * slope
            W.signal[o + 1, 0] = slope
            W.signal[o + 2, 0] = 0.0


@njit
def correct(L, W, w, regularization, reach):
    """Newton's method to convergence: (converged, size of the first correction, least pivot)."""
    first, last, least = 0.0, 1e300, 0.0
    for iteration in range(ITERATIONS):
        e, least = newton(L, W, w, regularization, VANISHED)
        if iteration == 0:
            first = e
        if not e < DIVERGED * (1.0 + reach):
            return False, first, least
        # at rounding level corrections no longer shrink
        if e <= TOLERANCE * reach or (e <= 1e-9 * reach and e > 0.5 * last):
            return True, first, least
        last = e
    return False, first, least


@kernel
def follow(L: Layout, W: Work, path: DrivenPath, found: FollowedPath) -> int:
    """Follow the motion from W.q at the first instant through all instants of `path`; returns DONE,
    STUCK (the place where it ended is the first in W.past), or LOST (no position at the first
    instant).
    """
    w = 0.0
    s, regularization = path.s, path.regularization
    progress, nearest = found.progress, found.nearest
    signals(L, W, w, L.signal_law.shape[0])
    progress[LEAST_PIVOT] = 1e300
    # the last step, for the predictor and for the monitor
    back, monitored_back, quintic, last = 1.0, 1.0, 0.0, 0
    # the longest step, or the first that was tried; what the last refusal leaves of a step
    longest, tried, limit = 0.0, 0.0, 1e300
    crawled = 0
    # greatest inverse part at the last place
    previous = 1.0
    here = s[0]
    for k in range(s.shape[0]):
        left = s[k] - here
        h = next_step(left, limit)
        if k > 0 and h != 0.0:
            if path.mode == BY_INSTANT:
                derivatives_along_chord(L, W, w, path, k - 1, last)
                quintic = 0.0
            if path.monitored and (path.mode == BY_INSTANT or longest == 0.0):
                far = store_earlier_parts(L, W, w, regularization, last)
                monitored_back = math.copysign(far, h)
            tried = max(tried, abs(h))
        across, moved = False, 0.0
        while True:
            if k > 0 and h != 0.0:
                predict(L, W, w, h, back, quintic, last)
            set_drivers(L, W, w, path, here + h, k)
            good, first, least = correct(L, W, w, regularization, path.reach)
            verdict, place, worst = SOUND, 0.0, 1.0
            if good and path.monitored and h != 0.0:
                worst = store_parts(L, W, 2, regularization)
                verdict, place = judge_step(L, W, h, monitored_back, regularization)
            if good and verdict != UNSURE:
                velocities(L, W, w, True)
                accelerations(L, W, w, True)
            if k == 0:
                if not good:
                    progress[LEAST_PIVOT] = min(progress[LEAST_PIVOT], least)
                    return LOST
                if regularization != 0.0:
                    mark_redundant(L, W, regularization)
                if path.monitored:
                    previous = store_parts(L, W, 1, regularization)
                    nearest[PART] = 1.0 / previous
                    nearest[PLACE], nearest[BEFORE] = here, 0.0
                last = store_place(L, W, w, last)
                break
            kink = False
            if good and h != 0.0 and verdict != UNSURE:
                moved, off, terms, spread = compare_step(L, W, w, h, last)
                good = first * first <= CORRECTION * moved + SLIGHT and (
                    off <= TURNED * terms + SLIGHT and (spread <= SPREAD or not path.monitored)
                )
                # so short a step at a regular position stays on its branch: the law turns sharply
                whole = longest if longest > 0.0 else tried
                kink = abs(h) <= KINK * whole and first <= KINK_CORRECTION
                kink = kink and constraint_conditioning(L, W) > KINK_CONDITIONING
                good = good or kink
                near_singular = max(worst, previous) * NEAR_SINGULAR > 1.0
                if good and not kink and verdict == SOUND and near_singular:
                    verdict = SOUND if rates_fit(L, W, w, h, regularization) else UNSURE
            at_end = False
            if good and verdict == CHANGE_AHEAD and abs(place - 0.5) > MIDDLE:
                verdict, at_end = UNSURE, abs(place * h - left) <= AT * abs(left)
                if not across and abs(2.0 * place * h) <= abs(left):
                    h, across = 2.0 * place * h, True
                    continue
            if not good or verdict == UNSURE or crawled > CRAWLED:
                whole = longest if longest > 0.0 else tried
                h = 0.5 * h
                limit = abs(h)
                if limit <= SHORTEST * whole or here + h == here or at_end or crawled > CRAWLED:
                    progress[REACHED], progress[BRANCH_UNSURE] = here, 1.0 if good else 0.0
                    put_first(W, last)
                    return STUCK
                continue
            progress[LEAST_PIVOT] = min(progress[LEAST_PIVOT], least)
            progress[STEPS] += 1.0
            if h != 0.0:
                if path.monitored and worst * nearest[PART] > 1.0:
                    nearest[PART], nearest[PLACE], nearest[BEFORE] = 1.0 / worst, here + h, float(k)
                if verdict == CHANGE_AHEAD:
                    record_change_point(L, W, here + place * h, last, found)
                    nearest[PART], nearest[PLACE] = 0.0, here + place * h
                    nearest[BEFORE] = float(k)
                here, previous = here + h, worst
                longest = max(longest, abs(h))
                crawls = abs(h) < abs(left) and moved <= CRAWL * CRAWL
                crawls = crawls and max(worst, previous) * VANISHING > 1.0
                crawled = crawled + 1 if crawls or abs(h) <= CRAWL * longest else 0
                last = store_place(L, W, w, last)
                shift_pages(L, W)
                back, monitored_back = h, h
                quintic = 0.0 if kink or path.mode == BY_INSTANT else 1.0
                if verdict == CHANGE_AHEAD:
                    restart_after_change(L, W, regularization)
                    monitored_back = 0.5 * (1.0 - place) * h
                across = False
            left = s[k] - here
            if abs(left) <= 1e-14 * (abs(s[k]) + abs(here)) or h == 0.0:
                here = s[k]
                break
            if abs(h) >= limit:
                limit = 2.0 * abs(h)
            h = next_step(left, limit)
        derivatives_by_time(L, W, w, path, k)
        if path.with_forces:
            forces(L, W, w, -1)
            if L.friction_kind.shape[0] > 0:
                viscous_friction(L, W, w)
            rest = multipliers(L, W, w)
            if not rest <= progress[UNBALANCED] and not np.isnan(progress[UNBALANCED]):
                progress[UNBALANCED] = rest
        keep(L, W, w, found.output[k])
        progress[INSTANTS] = k + 1.0
        progress[REACHED] = here
    return DONE


@inline
def next_step(left, limit):
    """All that is left, or as much of it as the limit allows."""
    return left if abs(left) <= limit else math.copysign(limit, left)


@njit
def record_change_point(L, W, s, last, found):
    """Store a change point at s, and the last place, which is close before it."""
    n = int(found.progress[CHANGE_POINTS])
    if n < found.passed.shape[0]:
        found.passed[n, 0] = s
        for m in range(3 * L.bodies):
            found.passed[n, 1 + m] = W.past[last + m, 0]
    found.progress[CHANGE_POINTS] += 1.0


@njit
def derivatives_along_chord(L, W, w, path, k, last):
    """By instant: derivatives at the last place along the chord that begins at instant k."""
    size = W.q.shape[0]
    for d in range(L.driver_row.shape[0]):
        set_rates(L, W, w, d, path.chords[k, d], 0.0)
    velocities(L, W, w, True)
    accelerations(L, W, w, True)
    for n in range(3 * L.bodies):
        W.past[last + size + n, 0] = W.v[n, 0]
        W.past[last + 2 * size + n, 0] = W.a[n, 0]


@njit
def put_first(W, last):
    """Bring the last place to the first rows of W.past."""
    for n in range(3 * W.q.shape[0]):
        W.past[n, 0] = W.past[last + n, 0]


@njit
def derivatives_by_time(L, W, w, path, k):
    """Velocities and accelerations by time: from the laws, from the given rates, or none."""
    if path.mode == BY_TIME and not path.at_rest:
        return
    if path.at_rest:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
        return
    for d in range(L.driver_row.shape[0]):
        set_rates(L, W, w, d, path.given[k, d, 1], path.given[k, d, 2])
    velocities(L, W, w, True)
    accelerations(L, W, w, True)
