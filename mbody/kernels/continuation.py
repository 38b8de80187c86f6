"""Scalar continuation: every instant of one motion, followed along its branch.

Predictor and corrector (Allgower & Georg, *Numerical Continuation Methods*): the polynomial of
`mbody.kernels.predictor` gives a position at the path parameter s + h, Newton's method on
Φ(q, s + h) = 0 corrects it. The step h is halved until

* Newton's first correction is small beside the step, |Δ₁| ≤ 0.1 |Δq|,
* the derivative has not turned, |q′ − q′₀ − h q″₀| ≤ 0.2 of its terms,
* no body turns by more than `PATH_SPREAD` from another one,
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
from mbody.core.lanes import larger, ld, select_le, smaller, st
from mbody.core.tolerances import (
    CHANGE_POINT_AT,
    CHANGE_POINT_EXACT,
    CHANGE_POINT_MIDDLE,
    CHANGE_POINT_NEAR,
    CHANGE_POINT_PART,
    CHANGE_POINT_PART_SOFT,
    CHANGE_POINT_SHARP,
    CHANGE_POINT_SHARP_END,
    CHANGE_POINT_VANISHING,
    FINITE,
    LOOP_CLOSURE_PATH,
    LOOP_CLOSURE_PATH_STALLED,
    PATH_BEFORE,
    PATH_CORRECTION_SQUARE,
    PATH_DIVERGED,
    PATH_KINK_CONDITIONING,
    PATH_KINK_CORRECTION,
    PATH_SLIGHT_SQUARE,
    PATH_SPREAD,
    PATH_STEP_COLLAPSE,
    PATH_STEP_KINK,
    PATH_STEP_ROUNDING,
    PATH_STEP_SHORTEST,
    PATH_TURNED_SQUARE,
    PIVOT_REDUNDANT,
    PIVOT_VANISHED,
    TINY,
)
from mbody.kernels.constraints import (
    accelerations,
    body_rotations,
    multipliers,
    newton,
    rows,
    set_rates,
    velocities,
)
from mbody.kernels.forces import KNOWN_MOTION, all_loads, measure_solution, signals
from mbody.kernels.friction import viscous_friction
from mbody.kernels.layout import Layout, Work, keep
from mbody.kernels.schur_ldl import constraint_conditioning, factor

# -- The predictor of the continuation: Hermite polynomials through the places behind ----------
#
# The path parameter s is time, or the value of the one driver. Of the last three places q, q′ and
# q″ are stored (derivatives by s), so a new place is predicted by Hermite's polynomial through two
# of them (degree 5) or all three (degree 8), see Hairer, Nørsett & Wanner, *Solving Ordinary
# Differential Equations I*, II.6. The places take turns in W.past; `last` is the first row of the
# latest.


@njit
def store_place(L, W, w, last):
    """Store q, v, a as the last place; returns its first row."""
    size = W.q.shape[0]
    o = next_place(W, last)
    for n in range(3 * L.bodies):
        st(W.past, o + n, ld(W.q, n, w), w)
        st(W.past, o + size + n, ld(W.v, n, w), w)
        st(W.past, o + 2 * size + n, ld(W.a, n, w), w)
    return o


@njit
def predict(L, W, w, h, back, quintic, last):
    """q at h beyond the last place, the place before being `back` behind it.

    Quintic through both places with both derivatives, or (quintic = 0) the Taylor polynomial of
    the last one. With x = h/back the last place is at x = 0, the one before at x = −1, and

        q = f₀ + α (f₁ − f₀) + β f₀′ + β₁ f₁′ + γ f₀″ + γ₁ f₁″.

    The weights of the place before have a triple zero at x = 0 and are the Hermite basis at −1:
    α = −x³ (10 + 15 x + 6 x²), β₁ = −back x³ (1 + x) (4 + 3 x), γ₁ = −back² x³ (1 + x)²/2. Those of
    the last place follow, as polynomials of degree 0, 1 and 2 must be exact.
    """
    size = W.q.shape[0]
    before = place_before(W, last)
    x = h / back
    y = 1.0 + x
    cubic = x * x * x * quintic
    alpha = -cubic * (10.0 + x * (15.0 + 6.0 * x))
    slope = -cubic * y * (4.0 + 3.0 * x)
    second_difference = -0.5 * cubic * y * y
    beta, beta1 = back * (x + alpha - slope), back * slope
    gamma = back * back * (0.5 * (x * x - alpha) + slope - second_difference)
    gamma1 = back * back * second_difference
    for n in range(3 * L.bodies):
        f, o, o1 = ld(W.past, last + n, w), last + size + n, before + size + n
        near = beta * ld(W.past, o, w) + gamma * ld(W.past, o + size, w)
        far = beta1 * ld(W.past, o1, w) + gamma1 * ld(W.past, o1 + size, w)
        st(W.q, n, f + (alpha * (ld(W.past, before + n, w) - f) + near + far), w)


@njit
def predict_by_three(L, W, w, h, back, longer, last):
    """q at h beyond the last place by three places, the others `back` and `longer` behind it.

    Hermite's polynomial of degree 8: each place adds Lᵢ³ (…), Lᵢ being Lagrange's polynomial of
    the place, which makes value, slope and curvature vanish at the two others. Its terms are some
    hundred times their sum, so that rounding is greater than that of `predict`.
    """
    size = W.q.shape[0]
    one = place_before(W, last)
    two = place_before(W, one)
    a, b, c = 1.0 / back, 1.0 / longer, 1.0 / (longer - back)
    d1, d2 = h + back, h + longer
    _, v0, a0 = hermite_weights(d1 * d2 * a * b, a + b, a * b, h)
    f1, v1, a1 = hermite_weights(-h * d2 * a * c, c - a, -a * c, d1)
    f2, v2, a2 = hermite_weights(h * d1 * b * c, -(b + c), b * c, d2)
    for n in range(3 * L.bodies):
        f, o = ld(W.past, last + n, w), size + n
        d = f1 * (ld(W.past, one + n, w) - f) + f2 * (ld(W.past, two + n, w) - f)
        d = d + v0 * ld(W.past, last + o, w) + a0 * ld(W.past, last + size + o, w)
        d = d + v1 * ld(W.past, one + o, w) + a1 * ld(W.past, one + size + o, w)
        d = d + v2 * ld(W.past, two + o, w) + a2 * ld(W.past, two + size + o, w)
        st(W.q, n, f + d, w)


@inline
def hermite_weights(part, slope, second_difference, d):
    """Weights of f, f′ and f″ of one of three places, d before the new one.

    Lagrange's polynomial of the place, L(d) = 1 + slope d + second_difference d², is `part` at the
    new one. The weights are L³ times the Taylor polynomials of degree 2 of 1/L³, d/L³ and d²/(2
    L³): 1/L³ = 1 − 3 slope d + (6 slope² − 3 second_difference) d² + … .
    """
    cube = part * part * part
    x = slope * d
    f = cube * (1.0 - 3.0 * x + (6.0 * x * x - 3.0 * second_difference * d * d))
    return f, cube * d * (1.0 - 3.0 * x), 0.5 * cube * d * d


@inline
def next_place(W, place):
    """First row of the place after."""
    size = 3 * W.q.shape[0]
    return place + size if place < 2 * size else 0


@inline
def place_before(W, place):
    """First row of the place before."""
    size = 3 * W.q.shape[0]
    return place - size if place > 0 else 2 * size


@njit
def compare_step(L, W, w, h, last):
    """Squares of the step from the last place to q, and of h times how far the derivative at q (in
    W.v) lies from the predicted one, q′₀ + h q″₀, with the size of its terms: a step onto another
    branch turns the derivative. In model lengths and radians. And the most by which one body turns
    from another, the ground among them.
    """
    per_length = 1.0 / ld(W.size, 0, w)
    size = W.q.shape[0]
    moved, off, terms = 0.0 * per_length, 0.0 * per_length, 0.0 * per_length
    turned, turned_off, turned_terms = moved, off, terms
    most, least = moved, moved
    for b in range(L.bodies):
        for n in range(3):
            o = 3 * b + n
            change = ld(W.q, o, w) - ld(W.past, last + o, w)
            now, before = ld(W.v, o, w), ld(W.past, last + size + o, w)
            predicted = h * ld(W.past, last + 2 * size + o, w)
            d = now - before - predicted
            whole = now * now + before * before + predicted * predicted
            if n == 2:
                turned = turned + change * change
                most, least = larger(most, change), smaller(least, change)
                turned_off = turned_off + d * d
                turned_terms = turned_terms + whole
            else:
                moved = moved + change * change
                off = off + d * d
                terms = terms + whole
    square = per_length * per_length
    far, off, terms = (
        square * moved + turned,
        h * h * (square * off + turned_off),
        h * h * (square * terms + turned_terms),
    )
    return far, off, terms, most - least


# -- The branch monitor: no step of a driven motion may pass a position at which branches meet -
#
# Let S = G W⁻¹ Gᵀ, G = Φ_q. Elimination leaves of the determinant of a node of rows the part
#
#     p = det(pivot of the node) / det(its diagonal block of S),    0 < p ≤ 1,
#
# the square of the sine of the angle between these rows and those eliminated before (in the metric
# W⁻¹: S = L D Lᵀ is the Gram–Schmidt process on the rows). All parts are smooth along a motion, and
# one of them vanishes where rows become dependent, which is where branches meet.
#
# Near such a place p = κ (w² + x²), x being the distance from the nearest place and w how far apart
# the branches stay. A step from one branch to another leads from one side of that place to the
# other, so that it is at least |x₁| + |x₂| long, and the second difference of p over it,
#
#     p₂ − p₁ − (p₁ − p₀) h/back ≈ κ h² (1 + back/h) ≥ κ h²,
#
# is then at least four times the smaller p at its ends (h = 2|x|, w → 0). A step is accepted where
# for every node it is no greater than that p: so steps shrink with the distance to other branches,
# and an even number of changes within one step is excluded like a single one, whichever groups of
# links change. Near a meeting the rate of p at the end of the step is compared as well: where two
# meetings follow each other closely, p is concave between them, and three places alone would let a
# step pass that ends behind the second.
#
# On lanes the LU of the square Φ_q gives the determinant of each diagonal block (Assur group) with
# its sign. There a step is accepted where no sign changes and the second difference of each
# determinant is smaller than the determinant.
#
# W.monitor holds three slots: the place before the last one, the last one, the new one; and which
# rows are redundant. Numbers are inverse, so that nothing is divided: with d = 1/e a second
# difference of d times e₀ e₁ e₂ is a sum of products of two.

#: What `judge_step` returns.
UNSURE, CHANGE_AHEAD, SOUND = 0, 1, 2


@njit
def store_parts(L, W, slot, regularization):
    """Put the inverse parts of all nodes, by the present factor, into a slot; returns the greatest,
    where rows are redundant that of the others.
    """
    o, most = slot * L.nodes, 1.0
    for k in range(L.nodes):
        a, c, b = W.diagonal[2 * k, 0], W.diagonal[2 * k + 1, 0], W.cross[k, 0]
        e = (a * c - b * b) * (W.pivot[3 * k, 0] * W.pivot[3 * k + 2, 0])
        W.monitor[o + k, 0] = e
        if regularization != 0.0:
            marked = W.monitor[3 * L.nodes + k, 0]
            if marked >= 2.0:
                e = a * W.pivot[3 * k, 0] if marked == 2.0 else 1.0
            elif marked == 1.0:
                e = c * W.pivot[3 * k + 2, 0]
        most = max(most, e)
    return most


@njit
def mark_redundant(L, W, regularization):
    """Note the redundant rows of the present factor: 1 for the first of a node, 2 for the second,
    their sum for both.
    """
    for k in range(L.nodes):
        W.monitor[3 * L.nodes + k, 0] = 0.0
        for row in range(2):
            greatest = PIVOT_REDUNDANT * regularization * W.regularization_weight[2 * k + row, 0]
            if W.pivot[3 * k + 2 * row, 0] * greatest > 1.0:
                W.monitor[3 * L.nodes + k, 0] += 1.0 + row


@kernel
def branch_distance(L: Layout, W: Work, regularization: float) -> float:
    """Least part that elimination leaves of a node of rows at the position W.q."""
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, None)
    factor(L, W, 0.0, regularization, PIVOT_VANISHED)
    if regularization != 0.0:
        mark_redundant(L, W, regularization)
    return 1.0 / store_parts(L, W, 1, regularization)


@inline
def shift_slots(L, W):
    """The new place becomes the last one, the last one that before it."""
    for k in range(2 * L.nodes):
        W.monitor[k, 0] = W.monitor[L.nodes + k, 0]


@njit
def store_earlier_parts(L, W, w, regularization, last):
    """Fill the slot of the place before from one a little behind the last place, which is at row
    `last` of W.past; returns how far behind it is. W.q stays there.
    """
    size = W.q.shape[0]
    far = greatest_rate(L, W, W.past, last + size)
    back = PATH_BEFORE / far if far > 0.0 else 1.0
    for n in range(3 * L.bodies):
        W.q[n, 0] = W.past[last + n, 0] - back * W.past[last + size + n, 0]
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    store_parts(L, W, 0, regularization)
    return back


@inline
def greatest_rate(L, W, v, o):
    """Greatest rate of a coordinate, in model lengths and radians; rates from row o of v on."""
    far = 0.0
    for b in range(L.bodies):
        for n in range(3):
            rate = abs(v[o + 3 * b + n, 0])
            far = max(far, rate if n == 2 else rate / W.size[0, 0])
    return far


@njit
def rates_fit(L, W, w, h, regularization):
    """Whether the rate of every part at the end of a step h fits its mean over the step.

    The end is the place W.q with the rates W.v and the new slot; the factor is made again there.
    """
    far = greatest_rate(L, W, W.v, 0)
    if not far * abs(h) > 2.0 * PATH_BEFORE:
        return True
    back = math.copysign(PATH_BEFORE / far, h)
    for n in range(3 * L.bodies):
        W.q[n, 0] -= back * W.v[n, 0]
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    smooth = True
    for k in range(L.nodes):
        a, c, b = W.diagonal[2 * k, 0], W.diagonal[2 * k + 1, 0], W.cross[k, 0]
        e = (a * c - b * b) * (W.pivot[3 * k, 0] * W.pivot[3 * k + 2, 0])
        e1, e2 = W.monitor[L.nodes + k, 0], W.monitor[2 * L.nodes + k, 0]
        if not (e > 0.5 and e1 > 0.5 and e2 > 0.5):
            continue
        p1, p2 = 1.0 / e1, 1.0 / e2
        second_difference = (p2 - 1.0 / e) * (h / back) - (p2 - p1)
        smooth = smooth and abs(second_difference) <= CHANGE_POINT_SHARP_END * min(p1, p2)
    for n in range(3 * L.bodies):
        W.q[n, 0] += back * W.v[n, 0]
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    return smooth


@njit
def judge_step(L, W, h, back, regularization):
    """Judge a step h, the one before being `back`, by the three slots: `SOUND`; `UNSURE`, it may
    have left its branch; `CHANGE_AHEAD`, there is a change point at the part of it that is
    returned, which may be beyond its end.

    With p = 1/e the second difference of p, p₂ − p₁ − x (p₁ − p₀), x = h/back, times e₀ e₁ e₂ is
    e₀ e₁ + e₂ (x e₁ − (1 + x) e₀).
    """
    x = h / back
    least = 1.0 / (CHANGE_POINT_PART if regularization == 0.0 else CHANGE_POINT_PART_SOFT)
    found, place = SOUND, 0.0
    for k in range(L.nodes):
        e0, e1, e2 = W.monitor[k, 0], W.monitor[L.nodes + k, 0], W.monitor[2 * L.nodes + k, 0]
        second_difference = e0 * e1 + e2 * (x * e1 - (1.0 + x) * e0)
        # no part is above one; a pivot that was dropped gives zero
        if abs(second_difference) <= CHANGE_POINT_SHARP * e0 * min(e1, e2) and e2 > 0.5:
            continue
        if not (e2 > 0.5 and e1 > least):
            return UNSURE, 0.0
        part, value = lowest_of_parabola(x, e1 / e0, e1 / e2)
        if not (part > 0.0 and value <= CHANGE_POINT_EXACT):
            return UNSURE, 0.0
        found, place = CHANGE_AHEAD, part
    return found, place


@njit
def restart_after_change(L, W, regularization):
    """Instead of the place before a change point one on this side of it, half as far from it as the
    last place: there the small parts are a quarter.
    """
    least = 1.0 / (CHANGE_POINT_PART if regularization == 0.0 else CHANGE_POINT_PART_SOFT)
    for k in range(L.nodes):
        e = W.monitor[L.nodes + k, 0]
        W.monitor[k, 0] = 4.0 * e if e > least else e


@inline
def lowest_of_parabola(x, before, ahead):
    """Where on the step the parabola is lowest that is `before` one step of 1/x back, 1 at the
    beginning and `ahead` at the end; and its value there.
    """
    first, second = (1.0 - before) * x, ahead - 1.0
    second_difference = (second - first) * x / (1.0 + x)
    slope = second - second_difference
    if not second_difference > 0.0:
        return -1.0, 1.0
    return -0.5 * slope / second_difference, 1.0 - 0.25 * slope * slope / second_difference


@njit
def signs_kept(S, W, w, F, step, failed):
    """`failed`, set to one where the determinant of a block has another sign than at the instant
    before, or bends more over the last steps than it is great; and the greatest inverse of one.

    S, F: the LU and its workspace; step: the last step and the one before, and whether there are
    such, one or zero. The second difference is that of `judge_step`.
    """
    zero = 0.0 * failed
    one = zero + 1.0
    h, back, seen, seen_twice = step
    count = S.scale.shape[0]
    x = h / select_le(larger(back, -back), 0.0 * back, 0.0 * back + 1.0, back)
    most = one
    for g in range(count):
        e2 = zero + S.scale[g]
        for n in range(S.group_start[g], S.group_start[g + 1]):
            e2 = e2 * ld(F.factor, S.group[n], w)
        great = larger(e2, -e2)
        most = larger(most, great)
        e1, e0 = ld(W.monitor, count + g, w), ld(W.monitor, g, w)
        failed = larger(failed, seen * select_le(zero + TINY, e1 * e2, zero, one))
        second_difference = e0 * e1 + e2 * (x * e1 - (1.0 + x) * e0)
        small = smaller(e1 * e2, smaller(e0 * e1, e0 * e2))
        second_difference = larger(second_difference, -second_difference)
        failed = larger(
            failed, seen_twice * select_le(second_difference, CHANGE_POINT_SHARP * small, zero, one)
        )
        st(W.monitor, g, e1, w)
        st(W.monitor, count + g, e2, w)
    return failed, most


#: How `follow` ends: at the last instant; at a dead centre, or where the branch is not certain;
#: without a position at the first instant.
DONE, STUCK, LOST = 0, 1, 2
#: What the path parameter is: time; the value of the one driver; the number of the instant.
BY_TIME, BY_DRIVER, BY_INSTANT = 0, 1, 2
#: Numbers of `PathOutput.progress`: instants finished; path parameter reached; least pivot;
#: steps; greatest unbalanced part of the loads; change points passed; one where the path ended
#: because the branch was not certain. And how many they are.
INSTANTS, REACHED, LEAST_PIVOT, STEPS, UNBALANCED, CHANGE_POINTS, BRANCH_UNSURE = range(7)
PROGRESS = 7
#: Numbers of `PathOutput.nearest`: least part that elimination leaves of a node, path parameter
#: there, instant before which that is.
PART, PLACE, INSTANT_BEFORE = 0, 1, 2

#: So many successive steps that are very short lead nowhere.
CRAWLED = 2000
#: Newton's iterations.
ITERATIONS = 12


class DrivenPath(Bundle):
    """Prescribed driver values, and settings for following them."""

    mode: int  # BY_TIME, BY_DRIVER or BY_INSTANT
    s: Floats  # (instants,) path parameter
    t: Floats  # (instants,) time
    given: Stacks  # (instants, drivers, 3): value, rate and acceleration, except by time
    chords: Rows  # (instants, drivers): change of the value to the next instant, by instant only
    with_forces: int  # whether reactions are computed
    at_rest: int  # whether velocities and accelerations are zero (statics)
    monitored: int  # whether the branch is made certain; else it is only likely to be kept
    regularization: float  # of redundant rows, zero where there are none
    position_norm: (
        float  # greatest coordinate in model lengths and radians, of which TOLERANCE is a part
    )


class PathOutput(Bundle):
    """Where `follow` puts what it finds."""

    output: Stacks  # (instants, rows, 1), rows as of `mbody.kernels.layout.keep`
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
def correct(L, W, w, regularization, position_norm):
    """Newton's method to convergence: (converged, size of the first correction, least pivot)."""
    first, last, least = 0.0, FINITE, 0.0
    for iteration in range(ITERATIONS):
        e, least = newton(L, W, w, regularization, PIVOT_VANISHED)
        if iteration == 0:
            first = e
        if not e < PATH_DIVERGED * (1.0 + position_norm):
            return False, first, least
        # at rounding level corrections no longer shrink
        if e <= LOOP_CLOSURE_PATH * position_norm or (
            e <= LOOP_CLOSURE_PATH_STALLED * position_norm and e > 0.5 * last
        ):
            return True, first, least
        last = e
    return False, first, least


@kernel
def follow(L: Layout, W: Work, path: DrivenPath, found: PathOutput) -> int:
    """Follow the motion from W.q at the first instant through all instants of `path`; returns DONE,
    STUCK (the place where it ended is the first in W.past), or LOST (no position at the first
    instant).
    """
    w = 0.0
    s, regularization = path.s, path.regularization
    progress, nearest = found.progress, found.nearest
    signals(L, W, w, L.signal_law.shape[0])
    progress[LEAST_PIVOT] = FINITE
    # the last step, for the predictor and for the monitor
    back, monitored_back, quintic, last = 1.0, 1.0, 0.0, 0
    # the longest step, or the first that was tried; what the last refusal leaves of a step
    longest, tried, limit = 0.0, 0.0, FINITE
    collapsed_steps = 0
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
            good, first, least = correct(L, W, w, regularization, path.position_norm)
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
                    nearest[PLACE], nearest[INSTANT_BEFORE] = here, 0.0
                last = store_place(L, W, w, last)
                break
            nonsmooth = False
            if good and h != 0.0 and verdict != UNSURE:
                moved, off, terms, spread = compare_step(L, W, w, h, last)
                good = first * first <= PATH_CORRECTION_SQUARE * moved + PATH_SLIGHT_SQUARE and (
                    off <= PATH_TURNED_SQUARE * terms + PATH_SLIGHT_SQUARE
                    and (spread <= PATH_SPREAD or not path.monitored)
                )
                # so short a step at a regular position stays on its branch: the law turns sharply
                whole = longest if longest > 0.0 else tried
                nonsmooth = abs(h) <= PATH_STEP_KINK * whole and first <= PATH_KINK_CORRECTION
                nonsmooth = nonsmooth and constraint_conditioning(L, W) > PATH_KINK_CONDITIONING
                good = good or nonsmooth
                near_singular = max(worst, previous) * CHANGE_POINT_NEAR > 1.0
                if good and not nonsmooth and verdict == SOUND and near_singular:
                    verdict = SOUND if rates_fit(L, W, w, h, regularization) else UNSURE
            at_end = False
            if good and verdict == CHANGE_AHEAD and abs(place - 0.5) > CHANGE_POINT_MIDDLE:
                verdict, at_end = UNSURE, abs(place * h - left) <= CHANGE_POINT_AT * abs(left)
                if not across and abs(2.0 * place * h) <= abs(left):
                    h, across = 2.0 * place * h, True
                    continue
            if not good or verdict == UNSURE or collapsed_steps > CRAWLED:
                whole = longest if longest > 0.0 else tried
                h = 0.5 * h
                limit = abs(h)
                if (
                    limit <= PATH_STEP_SHORTEST * whole
                    or here + h == here
                    or at_end
                    or collapsed_steps > CRAWLED
                ):
                    progress[REACHED], progress[BRANCH_UNSURE] = here, 1.0 if good else 0.0
                    put_first(W, last)
                    return STUCK
                continue
            progress[LEAST_PIVOT] = min(progress[LEAST_PIVOT], least)
            progress[STEPS] += 1.0
            if h != 0.0:
                if path.monitored and worst * nearest[PART] > 1.0:
                    nearest[PART], nearest[PLACE], nearest[INSTANT_BEFORE] = (
                        1.0 / worst,
                        here + h,
                        float(k),
                    )
                if verdict == CHANGE_AHEAD:
                    record_change_point(L, W, here + place * h, last, found)
                    nearest[PART], nearest[PLACE] = 0.0, here + place * h
                    nearest[INSTANT_BEFORE] = float(k)
                here, previous = here + h, worst
                longest = max(longest, abs(h))
                collapses = abs(h) < abs(left) and moved <= PATH_STEP_COLLAPSE * PATH_STEP_COLLAPSE
                collapses = collapses and max(worst, previous) * CHANGE_POINT_VANISHING > 1.0
                collapsed_steps = (
                    collapsed_steps + 1
                    if collapses or abs(h) <= PATH_STEP_COLLAPSE * longest
                    else 0
                )
                last = store_place(L, W, w, last)
                shift_slots(L, W)
                back, monitored_back = h, h
                quintic = 0.0 if nonsmooth or path.mode == BY_INSTANT else 1.0
                if verdict == CHANGE_AHEAD:
                    restart_after_change(L, W, regularization)
                    monitored_back = 0.5 * (1.0 - place) * h
                across = False
            left = s[k] - here
            if abs(left) <= PATH_STEP_ROUNDING * (abs(s[k]) + abs(here)) or h == 0.0:
                here = s[k]
                break
            if abs(h) >= limit:
                limit = 2.0 * abs(h)
            h = next_step(left, limit)
        derivatives_by_time(L, W, w, path, k)
        if path.with_forces:
            all_loads(L, W, w)
            if L.friction_kind.shape[0] > 0:
                viscous_friction(L, W, w)
            rest = multipliers(L, W, w)
            if L.force_steps < L.formula_step.shape[0]:
                measure_solution(L, W, w, KNOWN_MOTION)
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
