"""Constraint equations: Φ, Φ_q, ν and γ of every primitive, each by the physics of its joint."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from mbody.core.callbacks import call_user
from mbody.core.decorators import inline, njit
from mbody.core.lanes import (
    chained,
    constant,
    count,
    entry,
    highest,
    lane_at,
    larger,
    ld,
    passes_more,
    put_entry,
    rounds,
    sincos,
    smaller,
    st,
    st_varying,
    tangent,
    tangents,
    value,
    with_tangent,
)
from mbody.core.tolerances import DIFFERENCE_STEP_FOURTH_ORDER, RESIDUAL_ROUNDING, TINY
from mbody.kernels.friction import (
    BY_RATES,
    add_sliding,
    friction_changes,
    friction_sizes,
    responses,
    slip_signs_by_rates,
    store_sliding,
)
from mbody.kernels.schur_ldl import apply_g, apply_gt, factor, solve
from mbody.laws.contour import foot
from mbody.laws.kernels import (
    ABS,
    ADD,
    COS,
    DIVIDE,
    LOG,
    MAX,
    MIN,
    MULTIPLY,
    NEGATIVE,
    OPERATIONS,
    SIN,
    SQRT,
    SUBTRACT,
    USER,
    binary,
    built_in,
    unary,
)
from mbody.laws.table import surface
from mbody.model.joints import CONSTRAINTS
from mbody.model.joints.angle import angle
from mbody.model.joints.coordinate import coordinate
from mbody.model.joints.distance import distance

# -- Laws of what the position gives, lane by lane: they have branches that lanes cannot take --

REVOLUTION = 2.0 * math.pi


@inline
def law_at(L, W, n, lane, x):
    """(f, f′, f″) of law n at x in one lane; NaN where a user's function raised."""
    code = L.law_kind[n]
    if code == USER:
        return user_law(L, W, n, x)
    size, k = L.law_count[n], L.law_table[n]
    return built_in(code, W.par, L.law_par[n], size, lane, L.table, k, x)


@inline
def law_of_direction(L, W, w, n, x, y):
    """(f, f′, f″) of law n at the angle of the vector (x, y), 0 … 2π."""
    st(W.scratch, 0, x, w)
    st(W.scratch, 1, y, w)
    around(L, W, w, n)
    return ld(W.scratch, 2, w), ld(W.scratch, 3, w), ld(W.scratch, 4, w)


@njit
def around(L, W, w, n):
    """Law n at the angle of scratch rows (0, 1), into rows 2 to 4."""
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        x = np.arctan2(entry(W.scratch, 1, lane), entry(W.scratch, 0, lane))
        f, f1, f2 = law_at(L, W, n, lane, x + REVOLUTION if x < 0.0 else x)
        put_entry(W.scratch, 2, f, lane)
        put_entry(W.scratch, 3, f1, lane)
        put_entry(W.scratch, 4, f2, lane)


#: Scratch rows of the last foot on a contour: its table, the place, and what `foot` gave.
FOOT = 23


@inline
def law_of_place(L, W, w, n, x, y):
    """(D, s, φ, κ/(1 − κ D)) of the contour that is law n, at a place in its axes."""
    st(W.scratch, 0, x, w)
    st(W.scratch, 1, y, w)
    beside(L, W, w, n)
    distance, s = ld(W.scratch, FOOT + 3, w), ld(W.scratch, FOOT + 4, w)
    return distance, s, ld(W.scratch, FOOT + 5, w), ld(W.scratch, FOOT + 6, w)


@njit
def beside(L, W, w, n):
    """The foot on contour n of the place in scratch rows (0, 1), where it is not the last one: both
    rows of a contact, and how far along it is, are of one foot.
    """
    F, k = W.scratch, L.law_table[n]
    for m in range(rounds(F, w)):
        lane = lane_at(m, w)
        x, y = entry(F, 0, lane), entry(F, 1, lane)
        same = value(entry(F, FOOT, lane)) == k + 1.0
        here = value(entry(F, FOOT + 1, lane)) == x and value(entry(F, FOOT + 2, lane)) == y
        if tangents(w) > 0 or not (same and here):
            last = int(value(entry(F, FOOT + 7, lane))) if same else -1
            distance, s, phi, curvature, piece = foot(L.table, k, x, y, last)
            put_entry(F, FOOT, k + 1.0, lane)
            put_entry(F, FOOT + 1, x, lane)
            put_entry(F, FOOT + 2, y, lane)
            put_entry(F, FOOT + 3, distance, lane)
            put_entry(F, FOOT + 4, s, lane)
            put_entry(F, FOOT + 5, phi, lane)
            put_entry(F, FOOT + 6, curvature, lane)
            put_entry(F, FOOT + 7, float(piece), lane)


@njit
def user_law(L, W, n, x):
    """(f, f′, f″) of a user's law at x; NaN where it raised. The derivative of f″ of a dual number
    is by differences of four places.
    """
    at = value(x)
    f, f1, f2 = called(L, W, n, at)
    slope = 0.0
    if not constant(x):
        h = DIFFERENCE_STEP_FOURTH_ORDER * max(abs(at), 1.0)
        _, _, far = called(L, W, n, at + 2.0 * h)
        _, _, near = called(L, W, n, at + h)
        _, _, back = called(L, W, n, at - h)
        _, _, first = called(L, W, n, at - 2.0 * h)
        slope = (8.0 * (near - back) - (far - first)) / (12.0 * h)
    return chained(f, f1, x), chained(f1, f2, x), chained(f2, slope, x)


@inline
def called(L, W, n, x):
    """Value and derivatives of a user's law at x; NaN where it raised."""
    W.user_arguments[0] = x
    if call_user(L.law_handle[n], W.user_arguments[:1], W.user_results[:3]) != 0:
        return np.nan, np.nan, np.nan
    return W.user_results[0], W.user_results[1], W.user_results[2]


# -- Users' joints and loads in kernels: one call a lane, and derivatives by differences -------
#
# A user's function takes (t, side i, side j, parameters) and fills results. Of dual numbers it gets
# the values; the tangents of its results are differences of four calls along each tangent of its
# arguments, with an error of the fourth power of the step, some 1e-11 of the greatest.

#: Numbers of the time and both sides; the parameters follow.
STATE = 17


@njit
def user_numbers(W, w, handle, i, j, first, size, results):
    """Scratch rows ← what a user's function gives for its parameters from row `first` on; NaN where
    it raised, the caller finds the exception.
    """
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        set_arguments(W, i, j, first, size, lane, 0, 0.0)
        call(W, handle, size, results)
        for n in range(results):
            put_entry(W.scratch, n, W.user_results[n], lane)
        for k in range(tangents(w)):
            h = step(W, i, j, first, size, lane, k)
            if h == 0.0:
                continue
            for part in range(4):
                # places h, −h, 2 h, −2 h and their weights
                far = 2.0 if part > 1 else 1.0
                sign = 1.0 if part % 2 == 0 else -1.0
                weight = sign * (8.0 if part < 2 else -1.0) / (12.0 * h)
                set_arguments(W, i, j, first, size, lane, k, sign * far * h)
                call(W, handle, size, results)
                for n in range(results):
                    x = entry(W.scratch, n, lane)
                    change = tangent(x, k) + weight * W.user_results[n]
                    put_entry(W.scratch, n, with_tangent(x, k, change), lane)


@inline
def set_arguments(W, i, j, first, size, lane, k, h):
    """The arguments of the function, moved by h along tangent k."""
    x = W.user_arguments
    x[0] = moved(W.time, 0, lane, k, h)
    for end in range(2):
        b = i if end == 0 else j
        o = 1 + 8 * end
        for n in range(3):
            x[o + n] = moved(W.q, 3 * b + n, lane, k, h)
            x[o + 5 + n] = moved(W.v, 3 * b + n, lane, k, h)
        if h == 0.0:
            x[o + 3] = value(entry(W.turn, 2 * b, lane))
            x[o + 4] = value(entry(W.turn, 2 * b + 1, lane))
        else:
            x[o + 3], x[o + 4] = np.cos(x[o + 2]), np.sin(x[o + 2])
    for n in range(size):
        x[STATE + n] = moved(W.par, first + n, lane, k, h)


@inline
def call(W, handle, size, results):
    """Call the function; NaN where it raises."""
    if call_user(handle, W.user_arguments[: STATE + size], W.user_results[:results]) != 0:
        for n in range(results):
            W.user_results[n] = np.nan


@inline
def moved(array, row, lane, k, h):
    """A number moved by h along its tangent k."""
    x = entry(array, row, lane)
    return value(x) + h * tangent(x, k)


@njit
def step(W, i, j, first, size, lane, k):
    """A step along tangent k by which no argument changes by more than
    `DIFFERENCE_STEP_FOURTH_ORDER` of its size; zero where none changes.
    """
    length = value(entry(W.size, 0, lane))
    rate = relative(W.time, 0, lane, k, 1.0)
    for end in range(2):
        b = i if end == 0 else j
        for n in range(3):
            unit = 1.0 if n == 2 else length
            rate = max(rate, relative(W.q, 3 * b + n, lane, k, unit))
            rate = max(rate, relative(W.v, 3 * b + n, lane, k, unit))
    for n in range(size):
        rate = max(rate, relative(W.par, first + n, lane, k, 0.0))
    return DIFFERENCE_STEP_FOURTH_ORDER / rate if rate > 0.0 else 0.0


@inline
def relative(array, row, lane, k, unit):
    """Tangent k of a number as a part of its size, or of the unit if that is greater."""
    x = entry(array, row, lane)
    size, change = max(abs(value(x)), unit), abs(tangent(x, k))
    if size > 0.0:
        return change / size
    return change


# -- Formulas of the present instant: laws of loads, rates of states, drivers ------------------
#
# All formulas of a mechanism are one list of steps on numbers W.formula. A step is (code, a, b,
# place): it reads a number of the instant, or computes with those at the places a and b, by the
# operations of `mbody.laws.postfix`, or hands the number at a over to a signal, a rate or a
# constraint row. There is nothing to choose while it runs, so that lanes take it as single motions
# do. The list has four parts: what drivers follow of time, inputs and auxiliary states, with both
# derivatives by time, is evaluated with the laws of time; rows of drivers that follow positions, Φ,
# Φ_q and ν, then γ, with the rows of all joints; laws of loads and rates of states where the loads
# are, at their position, velocity and time; and what measures accelerations and forces when these
# are known (`mbody.kernels.forces`). Derivatives are steps too.

FIRST = len(OPERATIONS)
#: Steps that read row a: of the position, of the velocity, of the cosines and sines of the bodies,
#: the time, a parameter, a signal, an auxiliary state.
POSITION, VELOCITY, TURN, TIME, PARAMETER, SIGNAL, OWN = range(FIRST, FIRST + 7)
#: Law b at the number at place a; its first derivative is LAW + 1, its second LAW + 2.
LAW = FIRST + 7
#: Steps that hand over the number at place a: to a row of signals, to the rate of an auxiliary
#: state.
TO_SIGNAL, TO_RATE = FIRST + 10, FIRST + 11
#: The same to a row of Φ, of the blocks of Φ_q, of ν and of γ.
TO_PHI, TO_BLOCK, TO_NU, TO_GAMMA = range(FIRST + 12, FIRST + 16)
#: Steps that read row a: of the accelerations, of the reactions as `keep_primitive` gives them.
ACCELERATION, REACTION = FIRST + 16, FIRST + 17
#: The table of two variables that is law n, at the numbers at places a and b: SURFACE + n.
SURFACE = FIRST + 18


@njit
def driver_formulas(L, W, w):
    """Signals of the drivers that follow a formula of time, inputs and auxiliary states."""
    steps(L, W, w, 0, L.driver_steps)


@njit
def formula_rows(L, W, w, e, position, velocity):
    """Φ, Φ_q and ν of primitive e, a driver that follows positions, unless `position` is None, and
    γ unless `velocity` is None.
    """
    if position is not None:
        steps(L, W, w, L.primitive_steps[e, 0], L.primitive_steps[e, 1])
    if velocity is not None:
        steps(L, W, w, L.primitive_steps[e, 1], L.primitive_steps[e, 2])


@njit
def measured_formulas(L, W, w):
    """Evaluate the formulas of loads and auxiliary states at W.q, W.v, W.turn, W.time, W.own and
    the signals of time; not those that measure accelerations and forces.
    """
    steps(L, W, w, L.load_steps, L.force_steps)


@njit
def steps(L, W, w, first, end):
    """Steps `first` to before `end`."""
    for n in range(first, end):
        code, a, b = L.formula_step[n, 0], L.formula_step[n, 1], L.formula_step[n, 2]
        place = L.formula_step[n, 3]
        if code < FIRST:
            operate(W, w, code, a, b, place)
        elif code == POSITION:
            st(W.formula, place, ld(W.q, a, w), w)
        elif code == VELOCITY:
            st(W.formula, place, ld(W.v, a, w), w)
        elif code == TURN:
            st(W.formula, place, ld(W.turn, a, w), w)
        elif code == TIME:
            st(W.formula, place, ld(W.time, 0, w), w)
        elif code == PARAMETER:
            st(W.formula, place, ld(W.par, a, w), w)
        elif code == SIGNAL:
            st(W.formula, place, ld(W.signal, a, w), w)
        elif code == OWN:
            st(W.formula, place, ld(W.own, a, w), w)
        elif code <= LAW + 2:
            law_of_number(L, W, w, b, code - LAW, a, place)
        elif code == TO_SIGNAL:
            st(W.signal, place, ld(W.formula, a, w), w)
        elif code == TO_RATE:
            st(W.auxiliary_rate, place, ld(W.formula, a, w), w)
        elif code == TO_PHI:
            st_varying(W.phi, place, ld(W.formula, a, w), w)
        elif code == TO_BLOCK:
            st_varying(W.block, place, ld(W.formula, a, w), w)
        elif code == TO_NU:
            st_varying(W.nu, place, ld(W.formula, a, w), w)
        elif code == TO_GAMMA:
            st_varying(W.gamma, place, ld(W.formula, a, w), w)
        elif code == ACCELERATION:
            st(W.formula, place, ld(W.a, a, w), w)
        elif code == REACTION:
            st(W.formula, place, ld(W.reaction, a, w), w)
        else:
            surface_of_numbers(L, W, w, L.law_table[code - SURFACE], a, b, place)


@njit
def own_numbers(L, W, record, first):
    """Auxiliary states and inputs ← those of a record from row `first` on, where it has them."""
    if record.shape[0] <= first:
        return
    for n in range(L.owns):
        W.own[n, 0] = record[first + n]
    for n in range(L.input_row.shape[0]):
        W.signal[L.input_row[n], 0] = record[first + L.owns + n]


@njit
def operate(W, w, code, a, b, place):
    """One operation; those that lanes have, in all lanes at once."""
    F = W.formula
    x, y = ld(F, a, w), ld(F, b, w)
    if code == MULTIPLY:
        st(F, place, x * y, w)
    elif code == ADD:
        st(F, place, x + y, w)
    elif code == SUBTRACT:
        st(F, place, x - y, w)
    elif code == NEGATIVE:
        st(F, place, -x, w)
    elif code == DIVIDE:
        st(F, place, x / y, w)
    elif code == MIN:
        st(F, place, smaller(x, y), w)
    elif code == MAX:
        st(F, place, larger(x, y), w)
    elif code == ABS:
        st(F, place, np.abs(x), w)
    elif code == SQRT:
        st(F, place, np.sqrt(x), w)
    elif code in (SIN, COS):
        s, c = sincos(x)
        if code == SIN:
            st(F, place, s, w)
        else:
            st(F, place, c, w)
    else:
        others(W, w, code, a, b, place)


@njit
def others(W, w, code, a, b, place):
    """An operation that lanes do not have, one after the other."""
    F = W.formula
    for m in range(rounds(W.formula, w)):
        lane = lane_at(m, w)
        x, y = entry(F, a, lane), entry(F, b, lane)
        if code <= LOG:
            found, _, _ = unary(code, x, 0.0, 0.0)
        else:
            found, _, _ = binary(code, x, 0.0, 0.0, y, 0.0, 0.0)
        put_entry(F, place, found, lane)


@njit
def law_of_number(L, W, w, n, order, a, place):
    """Law n, or its first or second derivative, at the number at place a."""
    for m in range(rounds(W.formula, w)):
        lane = lane_at(m, w)
        f, f1, f2 = law_at(L, W, n, lane, entry(W.formula, a, lane))
        put_entry(W.formula, place, f if order == 0 else f1 if order == 1 else f2, lane)


@njit
def surface_of_numbers(L, W, w, k, a, b, place):
    """The table of two variables that begins at k, at the numbers at places a and b."""
    for m in range(rounds(W.formula, w)):
        lane = lane_at(m, w)
        f, _, _ = surface(L.table, k, entry(W.formula, a, lane), entry(W.formula, b, lane))
        put_entry(W.formula, place, f, lane)


#: Kinds of physics; the number of a kind is its place. Those of joints in the order of
#: `mbody.model.joints`, then the sum of a coupling, then a driver that follows positions, then a
#: user's own.
KINDS = (*CONSTRAINTS, "sum", "formula", "user")
ANGLE, DISTANCE, SUM, FORMULA = map(KINDS.index, ("angle", "distance", "sum", "formula"))
#: Numbers of the kinds with a law of a direction or a place that the position gives, as cams have.
BY_DIRECTION = tuple(n for n, one in enumerate(CONSTRAINTS.values()) if one.argument)


@njit
def rows(L, W, w, position, velocity):
    """Fill Φ, Φ_q and ν (unless `position` is None) and γ (unless `velocity` is None)."""
    for e in range(L.primitive_kind.shape[0]):
        every_kind(L, W, w, e, L.primitive_kind[e], position, velocity)
    # on lanes no row is switched on
    if count(w) == 1 and L.active_set.shape[0] > 0:
        switch(L, W, w, position, velocity)


@njit
def switch(L, W, w, position, velocity):
    """Rows of the active set ← what their physics gave, less the anchor of Φ, or nothing."""
    for s in range(L.active_set.shape[0]):
        e = L.active_set[s]
        k, m = L.primitive_node[e], L.written_node[e]
        # a row that is off may be no number, as where two centres coincide
        on = highest(ld(W.on, s, w)) != 0.0
        if position is not None:
            phi = ld(W.phi, 2 * m, w) - ld(W.anchor, s, w)
            st(W.phi, 2 * k, phi if on else 0.0, w)
            st(W.nu, 2 * k, ld(W.nu, 2 * m, w) if on else 0.0, w)
            for n in range(3):
                st(W.block, 12 * k + n, ld(W.block, 12 * m + n, w) if on else 0.0, w)
                st(W.block, 12 * k + 6 + n, ld(W.block, 12 * m + 6 + n, w) if on else 0.0, w)
            for side in range(L.more.shape[0]):
                if L.more[side, 0] == k:
                    o, own = 12 * L.nodes + 6 * side, further_block(L, side)
                    for n in range(3):
                        st(W.block, o + n, ld(W.block, own + n, w) if on else 0.0, w)
        if velocity is not None:
            st(W.gamma, 2 * k, ld(W.gamma, 2 * m, w) if on else 0.0, w)


@inline
def further_block(L, side):
    """Where the physics of a row of the active set writes the block of a further side, which
    is that number of `L.more`.
    """
    return 12 * (L.nodes + (L.more.shape[0] + 1) // 2 + L.active_set.shape[0]) + 6 * side


@inline
def ends(L, W, w, e):
    """Both sides, the parameters and the signal of primitive e, as the physics takes them."""
    o, f = L.primitive_par[e], L.primitive_signal[e]
    p = (
        ld(W.par, o, w),
        ld(W.par, o + 1, w),
        ld(W.par, o + 2, w),
        ld(W.par, o + 3, w),
        ld(W.par, o + 4, w),
        ld(W.par, o + 5, w),
        ld(W.par, o + 6, w),
    )
    signal = (ld(W.signal, f, w), ld(W.signal, f + 1, w), ld(W.signal, f + 2, w))
    return side(W, L.primitive_i[e], w), side(W, L.primitive_j[e], w), p, signal


@inline
def side(W, b, w):
    """(x, y, θ, cos θ, sin θ, vx, vy, ω) of body b."""
    o = 3 * b
    return (
        ld(W.q, o, w),
        ld(W.q, o + 1, w),
        ld(W.q, o + 2, w),
        ld(W.turn, 2 * b, w),
        ld(W.turn, 2 * b + 1, w),
        ld(W.v, o, w),
        ld(W.v, o + 1, w),
        ld(W.v, o + 2, w),
    )


@inline
def put(L, W, w, e, position, velocity, physics):
    """Store what the physics of primitive e gave at its node; constants are there already."""
    phi, blocks, nu, gamma = physics
    k = L.written_node[e]
    if position is not None:
        st_varying(W.phi, 2 * k, phi[0], w)
        st_varying(W.phi, 2 * k + 1, phi[1], w)
        o = 12 * k
        st_varying(W.block, o, blocks[0], w)
        st_varying(W.block, o + 1, blocks[1], w)
        st_varying(W.block, o + 2, blocks[2], w)
        st_varying(W.block, o + 3, blocks[3], w)
        st_varying(W.block, o + 4, blocks[4], w)
        st_varying(W.block, o + 5, blocks[5], w)
        st_varying(W.block, o + 6, blocks[6], w)
        st_varying(W.block, o + 7, blocks[7], w)
        st_varying(W.block, o + 8, blocks[8], w)
        st_varying(W.block, o + 9, blocks[9], w)
        st_varying(W.block, o + 10, blocks[10], w)
        st_varying(W.block, o + 11, blocks[11], w)
        st_varying(W.nu, 2 * k, nu[0], w)
        st_varying(W.nu, 2 * k + 1, nu[1], w)
    if velocity is not None:
        st_varying(W.gamma, 2 * k, gamma[0], w)
        st_varying(W.gamma, 2 * k + 1, gamma[1], w)


@njit
def total(L, W, w, e, position, velocity):
    """Φ = Σ c·(coordinate) − p₀ over the parts of primitive e, in the first row of its node."""
    k, o = L.primitive_node[e], L.primitive_par[e]
    first, end = L.sum_start[e], L.sum_start[e + 1]
    if position is not None:
        st(W.phi, 2 * k, -ld(W.par, o, w), w)
        for n in range(first, end):
            clear_block(W, w, L.part[n, 3])
            clear_block(W, w, L.part[n, 4])
    if velocity is not None:
        st(W.gamma, 2 * k, 0.0, w)
    none = (0.0, 0.0, 0.0)
    for n in range(first, end):
        at = o + 1 + 7 * (n - first)
        i, j, c = side(W, L.part[n, 1], w), side(W, L.part[n, 2], w), ld(W.par, at, w)
        p = (
            ld(W.par, at + 1, w),
            ld(W.par, at + 2, w),
            ld(W.par, at + 3, w),
            ld(W.par, at + 4, w),
            ld(W.par, at + 5, w),
            ld(W.par, at + 6, w),
        )
        kind = L.part[n, 0]
        if kind == ANGLE:
            add_part(L, W, w, k, n, position, velocity, weighted(c, angle(i, j, p, none)))
        elif kind == DISTANCE:
            add_part(L, W, w, k, n, position, velocity, weighted(c, distance(i, j, p, none)))
        else:
            add_part(L, W, w, k, n, position, velocity, weighted(c, coordinate(i, j, p, none)))


@inline
def clear_block(W, w, o):
    """Zeros in the first row of a block that is not the ground's."""
    if o >= 0:
        for m in range(3):
            st(W.block, o + m, 0.0, w)


@inline
def weighted(c, physics):
    """c times Φ, Φ_q by both bodies and γ, of the first row of a part."""
    phi, blocks, _, gamma = physics
    by_i = c * blocks[0], c * blocks[1], c * blocks[2]
    by_j = c * blocks[6], c * blocks[7], c * blocks[8]
    return c * phi[0], by_i, by_j, c * gamma[0]


@inline
def add_part(L, W, w, k, n, position, velocity, part):
    """Add what part n gives, as `weighted`, to node k."""
    phi, by_i, by_j, gamma = part
    if position is not None:
        st(W.phi, 2 * k, ld(W.phi, 2 * k, w) + phi, w)
        o = L.part[n, 3]
        if o >= 0:
            st(W.block, o, ld(W.block, o, w) + by_i[0], w)
            st(W.block, o + 1, ld(W.block, o + 1, w) + by_i[1], w)
            st(W.block, o + 2, ld(W.block, o + 2, w) + by_i[2], w)
        o = L.part[n, 4]
        if o >= 0:
            st(W.block, o, ld(W.block, o, w) + by_j[0], w)
            st(W.block, o + 1, ld(W.block, o + 1, w) + by_j[1], w)
            st(W.block, o + 2, ld(W.block, o + 2, w) + by_j[2], w)
    if velocity is not None:
        st(W.gamma, 2 * k, ld(W.gamma, 2 * k, w) + gamma, w)


@inline
def custom(L, W, w, e):
    """Rows of a user's joint, lane by lane through the hook."""
    i, j, first = L.primitive_i[e], L.primitive_j[e], L.primitive_par[e]
    user_numbers(W, w, L.primitive_handle[e], i, j, first, L.primitive_count[e], 18)
    s = W.scratch
    phi = (ld(s, 0, w), ld(s, 1, w))
    blocks = (
        ld(s, 2, w),
        ld(s, 3, w),
        ld(s, 4, w),
        ld(s, 5, w),
        ld(s, 6, w),
        ld(s, 7, w),
        ld(s, 8, w),
        ld(s, 9, w),
        ld(s, 10, w),
        ld(s, 11, w),
        ld(s, 12, w),
        ld(s, 13, w),
    )
    return phi, blocks, (ld(s, 14, w), ld(s, 15, w)), (ld(s, 16, w), ld(s, 17, w))


@njit
def body_rotations(L, W, w):
    """Cosine and sine of every body's angle: once a body, not once a joint."""
    for b in range(L.bodies):
        s, c = sincos(ld(W.q, 3 * b + 2, w))
        st(W.turn, 2 * b, c, w)
        st(W.turn, 2 * b + 1, s, w)


@njit(forceinline=True)
def last_kinds(L, W, w, e, kind, position, velocity):
    """Rows of kinds that are no joint's physics: a sum, a driver that follows positions, or a
    user's own.
    """
    if kind == SUM:
        total(L, W, w, e, position, velocity)
    elif kind == FORMULA:
        formula_rows(L, W, w, e, position, velocity)
    else:
        put(L, W, w, e, position, velocity, custom(L, W, w, e))


def branch(otherwise, number):
    """Compiled ``if kind == number: … else: otherwise(…)`` with the physics of that kind.

    Numba compiles no table of functions that lanes could take, so that the chain of branches over
    `CONSTRAINTS` is made here, one inside the other. None of them is kept on disk: `rows` is, with
    all of them.
    """
    one: Any = CONSTRAINTS[KINDS[number]]
    physics, direction = one.function, one.argument
    law = law_of_place if one.of_place else law_of_direction

    @njit(forceinline=True, cache=False)
    def direct(L, W, w, e, kind, position, velocity):
        if kind == number:
            put(L, W, w, e, position, velocity, physics(*ends(L, W, w, e)))
        else:
            otherwise(L, W, w, e, kind, position, velocity)

    # a function of its own: with its loop over lanes inside `rows` all other kinds would be slower
    @njit(cache=False)
    def evaluated(L, W, w, e, position, velocity):
        i, j, p, _ = ends(L, W, w, e)
        f = law(L, W, w, L.primitive_law[e], *direction(i, j, p))
        put(L, W, w, e, position, velocity, physics(i, j, p, f))

    @njit(forceinline=True, cache=False)
    def by_direction(L, W, w, e, kind, position, velocity):
        if kind == number:
            evaluated(L, W, w, e, position, velocity)
        else:
            otherwise(L, W, w, e, kind, position, velocity)

    return by_direction if direction else direct


#: The branch of the first kind is the outermost one.
every_kind = functools.reduce(branch, reversed(range(len(CONSTRAINTS))), last_kinds)


# -- One instant: position by Newton, velocity, acceleration and multipliers, from one factor --
#
# With G = Φ_q, positive weights W and the Schur complement S = G W⁻¹ Gᵀ = L D Lᵀ
# (`mbody.kernels.schur_ldl`), each is one half of [W Gᵀ; G 0] [u; λ] = [f; c] and costs one solve:
#
#     position       Δq = −W⁻¹ Gᵀ S⁻¹ Φ          (Newton: Φ_q Δq = −Φ)
#     velocity       v  =  W⁻¹ Gᵀ S⁻¹ ν          (Φ_q v = ν = −Φ_t)
#     acceleration   a  =  W⁻¹ Gᵀ S⁻¹ γ          (Φ_q a = γ)
#     multipliers    λ  =  S⁻¹ G W⁻¹ (f − M a)   (Φ_qᵀ λ = f − M a)
#
# Near a singular position the least singular value σ of G W^(−½) is small, as a part of the
# greatest, and S has σ²: with rounding ε a solution x = S⁻¹ c is off by ε/σ² |x|. That error is
# along the left singular vector of σ, which Gᵀ multiplies by σ, so that u is off by ε/σ |x|. For λ
# nothing damps it. Both are refined by their residuals, c − G u and f − M a − Gᵀ λ, which
# multiplies the error by ε/σ² each time.

#: Corrections by the residual: one as a rule, more where rows are redundant or nearly so.
REFINEMENTS = 6


@inline
def clear(array, w):
    """Every row zero."""
    for n in range(array.shape[0]):
        st(array, n, 0.0, w)


@inline
def copy(source, target, w):
    """Row by row."""
    for n in range(target.shape[0]):
        st(target, n, ld(source, n, w), w)


@inline
def square_on_nodes(L, W, w, x):
    """Sum of squares on nodes, each row by its diagonal of S, so that rows of lengths and of angles
    are of one unit; NaN where there is one.
    """
    total = 0.0 * ld(x, 0, w)
    for n in range(2 * L.nodes):
        y = ld(x, n, w)
        total = total + y * y / (ld(W.diagonal, n, w) + TINY)
    return total


@inline
def weigh(L, W, w, u):
    """u ← W⁻¹ u, and zero on the ground."""
    for n in range(u.shape[0]):
        st(u, n, ld(u, n, w) * ld(W.weight, n, w), w)


@njit
def least_motion(L, W, w, c, checked):
    """u = W⁻¹ Gᵀ S⁻¹ c: the u with G u = c that makes uᵀ W u least, refined by its residual c − G u
    if `checked`, which nearly dependent rows need.
    """
    copy(c, W.x, w)
    solve(L, W, w)
    clear(W.u, w)
    apply_gt(L, W, w, W.x, W.u)
    weigh(L, W, w, W.u)
    if not checked:
        return
    terms = square_on_nodes(L, W, w, c)
    left = passes_more(w)
    for _ in range(REFINEMENTS + left):
        apply_g(L, W, w, W.u, W.x)
        for n in range(2 * L.nodes):
            st(W.x, n, ld(c, n, w) - ld(W.x, n, w), w)
        if (
            highest(square_on_nodes(L, W, w, W.x) - RESIDUAL_ROUNDING * RESIDUAL_ROUNDING * terms)
            <= 0.0
        ):
            if left == 0:
                break
            left -= 1
        solve(L, W, w)
        clear(W.r, w)
        apply_gt(L, W, w, W.x, W.r)
        weigh(L, W, w, W.r)
        for n in range(W.u.shape[0]):
            st(W.u, n, ld(W.u, n, w) + ld(W.r, n, w), w)


@inline
def columns_to_bodies(L, w, u, target):
    """Columns to coordinates: a body moves as its first slot."""
    for b in range(L.bodies):
        o, s = 3 * b, 3 * L.body_slot[b]
        st(target, o, ld(u, s, w), w)
        st(target, o + 1, ld(u, s + 1, w), w)
        st(target, o + 2, ld(u, s + 2, w), w)


@inline
def take_off(L, w, u, target):
    """Subtract columns from coordinates: a body moves as its first slot."""
    for b in range(L.bodies):
        o, s = 3 * b, 3 * L.body_slot[b]
        st(target, o, ld(target, o, w) - ld(u, s, w), w)
        st(target, o + 1, ld(target, o + 1, w) - ld(u, s + 1, w), w)
        st(target, o + 2, ld(target, o + 2, w) - ld(u, s + 2, w), w)


@njit
def rates_of_rows(L, W, w):
    """x = Φ_q v on nodes."""
    clear(W.u, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.u, 3 * s + n, ld(W.v, 3 * L.slot_body[s] + n, w), w)
    apply_g(L, W, w, W.u, W.x)


@inline
def put_column(source, column, target, lane):
    """A column of numbers, one of a set, into a lane."""
    for n in range(source.shape[0]):
        target[n, lane] = source[n, column]


@njit
def newton(L, W, w, regularization, guard):
    """One Newton step on Φ; returns its size (in model lengths and radians) and factor's pivot."""
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    least = factor(L, W, w, regularization, guard)
    copy(W.phi, W.x, w)
    solve(L, W, w)
    clear(W.u, w)
    apply_gt(L, W, w, W.x, W.u)
    weigh(L, W, w, W.u)
    size = motion_norm(L, W, w)
    take_off(L, w, W.u, W.q)
    return size, least


@inline
def motion_norm(L, W, w):
    """Size of a motion on columns, lengths by the model length: root of the sum of squares."""
    return np.sqrt(size_square(L, W, w))


@inline
def size_square(L, W, w):
    """The square of `motion_norm`."""
    per_length = 1.0 / ld(W.size, 0, w)
    far, turned = 0.0 * per_length, 0.0 * per_length
    for b in range(L.bodies):
        s = 3 * L.body_slot[b]
        x, y, t = ld(W.u, s, w), ld(W.u, s + 1, w), ld(W.u, s + 2, w)
        far = far + x * x + y * y
        turned = turned + t * t
    return far * per_length * per_length + turned


@njit
def velocities(L, W, w, checked):
    """v from G v = ν, with the ν of the last position."""
    least_motion(L, W, w, W.nu, checked)
    columns_to_bodies(L, w, W.u, W.v)


@njit
def set_rates(L, W, w, d, rate, acceleration):
    """Set rate and acceleration of driver d, instead of those that its law gave; one that follows
    positions has those of its formula.
    """
    if L.driver_dependent[d] == 1:
        return
    st(W.nu, 2 * L.driver_node[d], rate, w)
    st(W.signal, L.driver_row[d] + 1, rate, w)
    st(W.signal, L.driver_row[d] + 2, acceleration, w)


@njit
def accelerations(L, W, w, checked):
    """a from G a = γ, the velocities being set."""
    rows(L, W, w, None, True)
    least_motion(L, W, w, W.gamma, checked)
    columns_to_bodies(L, w, W.u, W.a)


@inline
def force_residual(L, W, w):
    """r = f − M a − Gᵀ λ on columns, each slot taking its share of f − M a.

    Returns the sums of squares of r and of its terms, forces and torques in the metric W⁻¹."""
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    terms = 0.0 * ld(W.size, 0, w)
    rest = terms
    for s in range(L.slots):
        for n in range(3):
            f, g = applied_share(L, W, w, s, n), ld(W.r, 3 * s + n, w)
            x, unit = f - g, ld(W.weight, 3 * s + n, w)
            terms = terms + (f * f + g * g) * unit
            rest = rest + x * x * unit
            st(W.r, 3 * s + n, x, w)
    return rest, terms


@inline
def applied_share(L, W, w, s, n):
    """Share of slot s in f − M a of its body, component n."""
    o = 3 * L.slot_body[s] + n
    return ld(W.share, s, w) * (ld(W.force, o, w) - ld(W.mass, o, w) * ld(W.a, o, w))


@njit
def multipliers(L, W, w):
    """λ from Gᵀ λ = f − M a, the loads being in W.force, friction included; returns the size of the
    residual, as a part of the terms.
    """
    rest = balancing_multipliers(L, W, w)
    if L.friction_kind.shape[0] == 0:
        return rest
    if L.slip_signs == BY_RATES:
        slip_signs_by_rates(L, W, w)
    responses(L, W, w)
    friction_sizes(L, W, w)
    left = passes_more(w)
    for _ in range(REFINEMENTS + left):
        add_sliding(L, W, w)
        rest = balancing_multipliers(L, W, w)
        if not friction_changes(L, W, w):
            if left == 0:
                break
            left -= 1
    store_sliding(L, W, w)
    return rest


@njit
def balancing_multipliers(L, W, w):
    """λ from Gᵀ λ = f − M a for the loads in W.force; see `multipliers`."""
    clear(W.lam, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.r, 3 * s + n, applied_share(L, W, w, s, n), w)
    for n in range(3 * L.slots, W.r.shape[0]):
        st(W.r, n, 0.0, w)
    rest = 0.0 * ld(W.size, 0, w)
    terms = rest
    left = passes_more(w)
    for _ in range(REFINEMENTS + left):
        weigh(L, W, w, W.r)
        apply_g(L, W, w, W.r, W.x)
        solve(L, W, w)
        for n in range(2 * L.nodes):
            st(W.lam, n, ld(W.lam, n, w) + ld(W.x, n, w), w)
        rest, terms = force_residual(L, W, w)
        if highest(rest - RESIDUAL_ROUNDING * RESIDUAL_ROUNDING * terms) <= 0.0:
            if left == 0:
                break
            left -= 1
    return np.sqrt(rest / (terms + TINY))
