"""Explicit steps of a motion with contacts, as long as its modes hold.

A step is tried, its end looked at, and accepted if it is quiet: if no guard can have been zero
within it (`mbody.kernels.contact_guards`). A step that is short beside what the tolerance allows
resolves what is watched by its ends; within others it is looked at in three more places. Where a
guard is zero the step is tried again up to there, by secants of whole steps. A step of which the
looks do not show what it meets is left as it was tried.
"""

from __future__ import annotations

import math

from mbody.core.decorators import njit
from mbody.core.tolerances import (
    CONTACT_GAP_CLOSED,
    EVENT_LOCATED,
    GUARD_GRAZING,
    GUARD_ROUNDING_GAP,
    GUARD_ZERO,
    RATE_NONE_FRICTION,
    STEP_SHORT,
)
from mbody.kernels.contact_guards import (
    BEGIN,
    CLOSE,
    COUNT,
    END,
    INSIDE,
    LOCATES,
    LOOKS,
    PARADOX,
    SWINGS,
    UNTIL,
    look,
    look_again,
    place,
    quiet_by_ends,
    quiet_by_looks,
)
from mbody.kernels.contact_rows import (
    approach_of,
    gap_of,
    is_within,
    row_acceleration,
)
from mbody.kernels.dense_output import along
from mbody.kernels.guard_zeros import NO_ZERO, UNCLEAR, first_guard, slope
from mbody.kernels.layout import keep
from mbody.kernels.runge_kutta import accept, attempt, dense_output
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    ARTIFICIAL_LIMIT,
    EVALUATIONS,
    LAST_STEP_ALLOWED,
    MORE,
    NEAR_SINGULAR,
    NEXT,
    NOT_QUIET,
    TIME,
    TRIED,
    TRIED_GROWTH,
    TRIED_LENGTH,
    ZERO,
)

#: Steps by which a zero is located, at most.
LOCATIONS = 8


@njit
def look_at_present(L, W, S, U, G, refinements):
    """Look at the present state as the beginning of a step; row 1 of K and P is workspace."""
    for n in range(S.y.shape[0]):
        S.stage[n] = S.y[n]
    state_derivative(L, W, S, S.state[TIME], S.stage, 1, refinements, True)
    S.state[EVALUATIONS] += 1
    look(L, W, U, G, BEGIN, True)
    G.known[0] = 1


@njit
def look_inside(L, W, method, S, T, U, G):
    """Look at the step that was tried in three places; leaves S.stage as it was."""
    stage, h, t = G.stage, S.state[TRIED_LENGTH], S.state[TIME]
    for n in range(S.y.shape[0]):
        stage[n] = S.stage[n]
    dense_output(L, W, method, S, h, T.refinements)
    for m in range(LOOKS - 2):
        x = place(INSIDE + m)
        for n in range(S.y.shape[0]):
            S.stage[n] = S.last[n] + along(S.F, n, x, 0.0)
        state_derivative(L, W, S, t + x * h, S.stage, 1, T.refinements, True)
        S.state[EVALUATIONS] += 1
        look(L, W, U, G, INSIDE + m, True)
    for n in range(S.y.shape[0]):
        S.stage[n] = stage[n]
    # of the end the velocities are still wanted
    for n in range(3 * L.bodies):
        W.v[n, 0] = S.end[3 * L.bodies + n]


@njit
def find_first(L, W, method, S, T, U, G):
    """G.passed and G.part ← which guard is zero first within the step that was tried, −1 if none,
    and at which part of the step, or NO_ZERO or UNCLEAR. Returns whether it was looked at inside,
    so that its polynomials are known.
    """
    h, state = S.state[TRIED_LENGTH], S.state
    G.passed[0], G.part[0] = -1, UNCLEAR
    if state[NEAR_SINGULAR] > 0.5:
        return False
    look(L, W, U, G, END, True)
    if STEP_SHORT * state[TRIED_GROWTH] >= 1.0 and G.asked[SWINGS] == 0.0 and quiet_by_ends(G, h):
        G.part[0] = NO_ZERO
        return False
    look_inside(L, W, method, S, T, U, G)
    if quiet_by_looks(G, h):
        G.part[0] = NO_ZERO
    else:
        G.passed[0], G.part[0] = first_guard(G, h)
    return True


@njit
def step_to_zero(L, W, method, S, T, U, G):
    """Try a step that ends where guard G.passed is zero, near the part G.part of the step that was
    looked at, so that its end has the order of the method; whether one is found.
    """
    state, n, x = S.state, G.passed[0], G.part[0]
    t, h = state[TIME], state[TRIED_LENGTH]
    rate, end, before, value = slope(G, n, h, x) / h, t + x * h, t, math.inf
    if not rate < 0.0:
        return False
    for _ in range(LOCATIONS):
        state[LAST_STEP_ALLOWED] = 1.0
        if not end > t or attempt(L, W, method, S, T, end) != TRIED or state[NEAR_SINGULAR] > 0.5:
            return False
        look(L, W, U, G, END, False)
        here = G.value[END, n]
        if abs(here) >= abs(value) and abs(here) <= -rate * GUARD_ZERO * h:
            break  # what is left is rounding
        if before > t and (here - value) / (end - before) < 0.0:
            rate = (here - value) / (end - before)
        before, value, away = end, here, -here / rate
        if abs(away) <= EVENT_LOCATED * h or end + away == end:
            break
        end += away
    else:
        return False
    # another guard may be zero a little before
    for m in range(G.count[0]):
        begin = G.value[BEGIN, m]
        least = -max(GUARD_ZERO * begin, G.fresh[m])
        if m != n and begin > 0.0 and G.value[END, m] < least:
            return False
    return G.kind[n] != CLOSE or closes(L, W, U, G, G.owner[n])


@njit
def closes(L, W, U, G, k):
    """Whether a gap that is none closes within the ends of its edge: what comes round an end from
    behind closes none, nor does what touches on its way and goes away by itself, as the end of an
    arc on which a disc slides. What grazes is not for secants.
    """
    closed = CONTACT_GAP_CLOSED * W.size[0, 0]
    if gap_of(L, W, U, k) < -closed:
        return False
    pull = U.gap_sign[k] * row_acceleration(L, W, U, U.normal[k])
    rate, overlap = approach_of(L, W, U, k), GUARD_ROUNDING_GAP * W.size[0, 0]
    grazes = abs(rate) <= GUARD_GRAZING / RATE_NONE_FRICTION * G.slow[k]
    if grazes or rate * rate <= 2.0 * overlap * pull:
        return False
    return is_within(L, W, U, G.ends, k, closed, G.slow[k])


@njit
def shorten_before_pole(G, S, h):
    """Steps come no nearer than half way to where det(I − φ′ B) would vanish: beyond it forces have
    the other sign.
    """
    for n in range(G.count[0]):
        if G.kind[n] == PARADOX and G.value[END, n] < G.value[BEGIN, n]:
            until = h * G.value[END, n] / (G.value[BEGIN, n] - G.value[END, n])
            S.state[NEXT] = min(S.state[NEXT], 0.5 * until)


@njit
def watched_steps(L, W, method, S, T, O, U, G):
    """Steps as `runge_kutta` makes them, as G.asked says, up to the first zero of a guard.

    Returns what `runge_kutta` does; ZERO at a zero of guard G.passed; or NOT_QUIET: the next step,
    which is not made, may meet one that its looks do not show, or that is not to be located.
    """
    code, until = MORE, G.asked[UNTIL]
    if not G.known[0]:
        look_at_present(L, W, S, U, G, T.refinements)
    for _ in range(int(G.asked[COUNT])):
        code, longest = attempt(L, W, method, S, T, until), S.state[NEXT]
        if code == TRIED:
            dense = find_first(L, W, method, S, T, U, G)
            quiet, located = G.part[0] == NO_ZERO, False
            if G.asked[LOCATES] > 0.0 and G.passed[0] >= 0:
                located = step_to_zero(L, W, method, S, T, U, G)
            if not (quiet or located):
                code = NOT_QUIET
                break
            h, G.known[0] = S.state[TRIED_LENGTH], 0
            code = accept(L, W, method, S, T, O, until, dense and quiet)
            if not quiet:
                S.state[NEXT] = min(S.state[NEXT], longest)
                code = ZERO
            shorten_before_pole(G, S, h)
            look_again(G, BEGIN, END)
            G.known[0] = 1
            if S.state[ARTIFICIAL_ENERGY] > S.state[ARTIFICIAL_LIMIT]:
                break
        if code != MORE:
            break
    if G.asked[LOCATES] > 0.0:
        for n in range(S.y.shape[0]):
            S.stage[n] = S.y[n]
        state_derivative(L, W, S, S.state[TIME], S.stage, 1, T.full_refinements, True)
        S.state[EVALUATIONS] += 1
        keep(L, W, 0.0, G.page)
    return code
