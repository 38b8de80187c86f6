"""Formulas of measured quantities of the present instant: laws of loads, rates of own states, and
what drivers follow.

All formulas of a mechanism are one list of steps on numbers W.formula. A step is (code, a, b,
place): it reads a number of the instant, or computes with those at the places a and b, by the
operations of `mbody.laws.postfix`, or hands the number at a over to a signal, a rate or a
constraint row. There is nothing to choose while it runs, so that lanes take it as single motions
do. The list has three parts: what drivers follow of time, inputs and own states, with both
derivatives by time, is evaluated with the laws of time; rows of drivers that follow positions,
Φ, Φ_q and ν, then γ, with the rows of all joints; the rest where the loads are, at their position,
velocity and time. Derivatives are steps too (`mbody.system.formula_derivatives`).
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import njit
from mbody.core.duals import entry, lane_at, put_entry, rounds
from mbody.core.lanes import larger, ld, sincos, smaller, st, st_varying
from mbody.kernels.law_values import law_at
from mbody.laws.bicubic import surface
from mbody.laws.postfix import (
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
    binary,
    unary,
)

__all__ = [
    "LAW",
    "OWN",
    "PARAMETER",
    "POSITION",
    "SIGNAL",
    "SURFACE",
    "TIME",
    "TO_BLOCK",
    "TO_GAMMA",
    "TO_NU",
    "TO_PHI",
    "TO_RATE",
    "TO_SIGNAL",
    "TURN",
    "VELOCITY",
    "driver_formulas",
    "formula_rows",
    "measured_formulas",
    "own_numbers",
]

FIRST = len(OPERATIONS)
#: Steps that read row a: of the position, of the velocity, of the cosines and sines of the bodies,
#: the time, a parameter, a signal, an own state.
POSITION, VELOCITY, TURN, TIME, PARAMETER, SIGNAL, OWN = range(FIRST, FIRST + 7)
#: Law b at the number at place a; its first derivative is LAW + 1, its second LAW + 2.
LAW = FIRST + 7
#: Steps that hand over the number at place a: to a row of signals, to the rate of an own state.
TO_SIGNAL, TO_RATE = FIRST + 10, FIRST + 11
#: The same to a row of Φ, of the blocks of Φ_q, of ν and of γ.
TO_PHI, TO_BLOCK, TO_NU, TO_GAMMA = range(FIRST + 12, FIRST + 16)
#: The table of two variables that is law n, at the numbers at places a and b: SURFACE + n.
SURFACE = FIRST + 16


@njit
def driver_formulas(L, W, w):
    """Signals of the drivers that follow a formula of time, inputs and own states."""
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
    """Evaluate the formulas of loads and own states at W.q, W.v, W.turn, W.time, W.own and the
    signals of time.
    """
    steps(L, W, w, L.load_steps, L.formula_step.shape[0])


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
            st(W.own_rate, place, ld(W.formula, a, w), w)
        elif code == TO_PHI:
            st_varying(W.phi, place, ld(W.formula, a, w), w)
        elif code == TO_BLOCK:
            st_varying(W.block, place, ld(W.formula, a, w), w)
        elif code == TO_NU:
            st_varying(W.nu, place, ld(W.formula, a, w), w)
        elif code == TO_GAMMA:
            st_varying(W.gamma, place, ld(W.formula, a, w), w)
        else:
            surface_of_numbers(L, W, w, L.law_table[code - SURFACE], a, b, place)


@njit
def own_numbers(L, W, page, first):
    """Own states and inputs ← those of a page from row `first` on, where it has them."""
    if page.shape[0] <= first:
        return
    for n in range(L.owns):
        W.own[n, 0] = page[first + n]
    for n in range(L.input_row.shape[0]):
        W.signal[L.input_row[n], 0] = page[first + L.owns + n]


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
