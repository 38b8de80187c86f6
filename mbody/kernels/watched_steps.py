"""Steps of a motion with contacts and events, as long as its modes hold.

A step is tried, its end looked at, and accepted if it is quiet: if no guard can have been zero
within it (`mbody.kernels.contact_guards`). A step that is short beside what the tolerance allows
resolves what is watched by its ends; within others it is looked at in three more places, and in
shorter and shorter parts where these do not show what it meets. Where a guard is zero the step is
tried again up to there, by secants of whole steps between those that bracket it. A step that looks
do not show is made shorter, until they are believed.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.core.tolerances import (
    CONTACT_GAP_CLOSED,
    EVENT_RATE_STEP,
    EVENT_TOGETHER,
    FRICTION_POLE,
    FRICTION_SINGULAR,
    GUARD_PART_LEAST,
    GUARD_ROUNDING_GAP,
    GUARD_ZERO,
    MACHINE_EPSILON,
    STEP_SHORT,
)
from mbody.kernels.contact_guards import (
    BEGIN,
    CLOSE,
    COUNT,
    EDGE,
    END,
    ENTER,
    EVENT,
    FIRST,
    INSIDE,
    LAST,
    LIFT,
    LOCATES,
    LOOKS,
    PARADOX,
    SHARE,
    SLIP,
    SWINGS,
    UNTIL,
    find_sides,
    forget_seen,
    is_behind,
    look,
    look_again,
    look_at_events,
    node,
    quiet_by_ends,
    watched,
)
from mbody.kernels.contact_rows import (
    approach_of,
    gap_of,
    is_within,
    row_acceleration,
)
from mbody.kernels.guard_zeros import NO_ZERO, UNCLEAR, first_guard, note_fast_events, slope
from mbody.kernels.layout import keep
from mbody.kernels.methods import (
    accept_step,
    attempt_watched,
    dense_step,
    resume_method,
    unwatched_steps,
)
from mbody.kernels.runge_kutta import along
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    ARTIFICIAL_LIMIT,
    CROSSED,
    DONE,
    EVALUATIONS,
    LAST_STEP_ALLOWED,
    MORE,
    NEAR_SINGULAR,
    NEXT,
    NOT_FINITE,
    NOT_QUIET,
    STEP_VANISHED,
    TIME,
    TRIED,
    TRIED_END,
    TRIED_GROWTH,
    TRIED_LENGTH,
    ZERO,
)
from mbody.kernels.watched_events import (
    APART,
    FINEST,
    FINEST_OF_EVENTS,
    FIRST_PART,
    INTERVALS,
    LATER,
    NOW,
    PART,
    PART_END,
    PART_LENGTH,
    events_of,
    find_rounding,
    find_row_rounding,
)

#: Numbers of `Guards.part`: whether the polynomials of the step are known; when det(I − φ′ B) would
#: vanish.
DENSE, POLE_TIME = 2, 3
#: What `Guards.known` is where guards and events are known.
KNOWN_ALL = 2
#: Steps by which a zero is located, at most; parts of a step that are looked at beside those that
#: events ask for, at most; how much nearer looks are then where events vary faster.
LOCATIONS, MORE_PARTS, NEARER = 60, 256, 16
#: What `step_to_zero` finds: no step that ends at the zero; one; or that it is not one.
LOST, LOCATED, IGNORED = range(3)


@njit
def look_at_all(L, W, U, G, at):
    """Row `at` of the looks ← guards and events at the state that was just evaluated."""
    look(L, W, U, G, at, True)
    look_at_events(L, W, G, at)


@njit
def look_at_present(L, W, S, U, G, refinements):
    """Look at the present state as the beginning of a step; row 1 of K and P is workspace."""
    for n in range(S.y.shape[0]):
        S.stage[n] = S.y[n]
    state_derivative(L, W, S, S.state[TIME], S.stage, 1, refinements, True)
    S.state[EVALUATIONS] += 1
    look_at_all(L, W, U, G, BEGIN)
    round_events(L, W, S, G, refinements, BEGIN)
    find_sides(G, BEGIN, NOW, NOW)
    G.known[0] = KNOWN_ALL


@inline
def refinements_of(S, T):
    """Corrections by the residual at looks within a step."""
    return T.full_refinements if S.state[NEAR_SINGULAR] > 0.5 else T.refinements


@njit
def round_events(L, W, S, G, refinements, at):
    """G.fresh ← what is rounding of the events in a step whose end, or beginning, was just
    evaluated, in row `at` of the looks: the greater of both ends; where modes have changed, that
    of the modes before, too.
    """
    E = G.events
    if events_of(E) == 0:
        return
    h = S.state[NEXT] if at == BEGIN else S.state[TRIED_LENGTH]
    find_row_rounding(L, W, S, E, refinements, h)
    find_rounding(L, W, E, G.event_value, G.event_rate)
    for n in range(G.count[0], watched(G)):
        e, greatest = n - G.count[0], max(abs(G.value[BEGIN, n]), abs(G.value[at, n]))
        E.last[1, e] = G.event_rate[e]
        found = max(E.last[0, e], E.last[1, e])
        if at == BEGIN:
            E.last[0, e] = found
        G.fresh[n] = max(MACHINE_EPSILON * greatest, found)


@njit
def look_inside(L, W, S, T, U, G, last):
    """Look at a part of the step that was tried, by its polynomials: in three places, and at its
    end unless it is the last.
    """
    h, part, refinements = S.state[TRIED_LENGTH], G.events.number, refinements_of(S, T)
    begin, length = part[FIRST_PART], part[PART_LENGTH]
    for m in range(LOOKS - 2 if last else LOOKS - 1):
        at = INSIDE + m if m < LOOKS - 2 else END
        x = begin + length * node(at)
        for n in range(S.y.shape[0]):
            S.stage[n] = S.last[n] + along(S.F, n, x, 0.0)
        state_derivative(L, W, S, S.state[TIME] + x * h, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        look_at_all(L, W, U, G, at)
    if last:
        look_again(G, END, LAST)


@njit
def search(L, W, S, T, U, G):
    """G.passed, G.part ← the first zero within the step that was tried, whose polynomials are
    known, part by part: as long as events ask for, shorter where the looks do not say what happens.
    Events that vary faster than very many looks show are looked at as near as a sixteenth of what
    they ask for, which is noted.
    """
    h, E, begin, tries, last = S.state[TRIED_LENGTH], G.events, 0.0, 0, False
    closed, finest = CONTACT_GAP_CLOSED * W.size[0, 0], E.number[FINEST]
    for e in range(events_of(E)):
        E.side[PART, e] = E.side[NOW, e]
    parts = max(1, math.ceil(h / (INTERVALS * E.number[APART]))) if events_of(E) > 0 else 1
    longest, most = 1.0 / parts, parts + MORE_PARTS
    length, E.number[FINEST_OF_EVENTS] = longest, finest
    while not last:
        last = begin + length > 1.0 - GUARD_PART_LEAST * longest
        length = 1.0 - begin if last else length
        E.number[FIRST_PART], E.number[PART_LENGTH] = begin, length
        look_inside(L, W, S, T, U, G, last)
        tries, (first, x) = tries + 1, first_guard(G, length * h, closed)
        if x < 0.0:
            if G.asked[SWINGS] > 0.0 and G.kind[first] in (LIFT, SLIP, SHARE):
                return  # shorter steps: the next one begins with what shows the loads
            if tries > most:
                if G.kind[first] != EVENT or E.number[FINEST_OF_EVENTS] > finest:
                    return
                E.number[FINEST_OF_EVENTS], most = longest / NEARER, most + NEARER * parts
                length = 4.0 * E.number[FINEST_OF_EVENTS]
            length, last = max(0.25 * length, finest), False
            continue
        if E.number[FINEST_OF_EVENTS] > finest:
            note_fast_events(G, length * h)
        if first >= 0:
            G.passed[0], G.part[0] = first, begin + x * length
            rate = slope(G, first, length * h, x)
            if G.kind[first] != EVENT and rate >= 0.0:  # where it bends
                rate = G.value[END, first] - G.value[BEGIN, first]
            G.part[1] = rate / (length * h)
            return
        begin, length = begin + length, min(longest, 4.0 * length)
        for e in range(events_of(E)):
            E.side[PART, e] = E.side[PART_END, e]
        look_again(G, BEGIN, END)
    G.part[0] = NO_ZERO


@njit
def find_first(L, W, method, S, T, U, G):
    """G.passed and G.part ← which guard is zero first within the step that was tried, −1 if none,
    and at which part of the step, or NO_ZERO or UNCLEAR; its rate there. Returns whether it was
    looked at inside, so that its polynomials are known.
    """
    h, state, stage = S.state[TRIED_LENGTH], S.state, G.stage
    G.passed[0], G.part[0] = -1, UNCLEAR
    look_at_all(L, W, U, G, END)
    closed = CONTACT_GAP_CLOSED * W.size[0, 0]
    short = events_of(G.events) == 0 or h <= G.events.number[APART]
    short = short and STEP_SHORT * state[TRIED_GROWTH] >= 1.0
    if short and G.asked[SWINGS] == 0.0 and quiet_by_ends(G, h, closed):
        G.part[0] = NO_ZERO
        return False
    round_events(L, W, S, G, T.refinements, END)
    for n in range(S.y.shape[0]):
        stage[n] = S.stage[n]
    dense_step(L, W, method, S, h, refinements_of(S, T))
    look_again(G, FIRST, BEGIN)
    look_again(G, LAST, END)
    search(L, W, S, T, U, G)
    look_again(G, BEGIN, FIRST)
    look_again(G, END, LAST)
    for n in range(S.y.shape[0]):
        S.stage[n] = stage[n]
    # of the end the velocities are still wanted
    for n in range(3 * L.bodies):
        W.v[n, 0] = S.end[3 * L.bodies + n]
    return True


@njit
def locate(L, W, method, S, T, U, G, h):
    """Try steps until one ends where guard or event G.passed is zero, within a time h, near the
    part G.part of it; whether one does.
    """
    state, n, rate = S.state, G.passed[0], G.part[1]
    # what is rounding at the beginning may leave that at once
    t, least = state[TIME], state[TIME] + 4.0 * MACHINE_EPSILON * max(abs(state[TIME]), h)
    end, before, value = max(t + G.part[0] * h, least), t, math.inf
    beyond, low, high = False, t, t + h
    if not (rate < 0.0 or (G.kind[n] == EVENT and rate > 0.0)):
        rate = -G.value[BEGIN, n] / (end - t)
    side = 1.0 if rate < 0.0 else -1.0
    for _ in range(LOCATIONS):
        state[LAST_STEP_ALLOWED] = 1.0
        if not end > t or attempt_watched(L, W, method, S, T, end) != TRIED:
            return False
        look(L, W, U, G, END, False)
        look_at_events(L, W, G, END)
        here = G.value[END, n]
        falls = G.kind[n] == EVENT or (low == t and side * here <= 0.0 and end - here / rate <= t)
        if abs(here) <= G.fresh[n] and falls:
            return True  # from where it began
        if abs(here) >= abs(value) and abs(here) <= abs(rate) * GUARD_ZERO * h:
            return True  # what is left is rounding
        if side * here > 0.0:
            low = end
        else:
            high, beyond = end, True
        if before > t and (here - value) / (end - before) * rate > 0.0:
            rate = (here - value) / (end - before)
        before, value, away = end, here, -here / rate
        if abs(away) <= 16.0 * MACHINE_EPSILON * h or end + away == end:
            return True
        end += away
        if not low < end < high:
            end = 0.5 * (low + high)
            if not low < end < high:
                return beyond
    return False


@njit
def passed_before(W, G, h):
    """The guard that was zero first before the end of a step of length h that was tried, if its
    values fall evenly; −1 if none was. A gap that touches at its least only there was not.
    """
    first, part, closed = -1, 1.0, CONTACT_GAP_CLOSED * W.size[0, 0]
    for m in range(G.count[0]):
        begin, end, gap = G.value[BEGIN, m], G.value[END, m], G.kind[m] in (CLOSE, EDGE, ENTER)
        least = GUARD_ROUNDING_GAP * W.size[0, 0] if gap else 0.0
        passed = begin > 0.0 and end < -max(GUARD_ZERO * begin, max(G.fresh[m], least))
        earlier = passed and m != G.passed[0] and begin / (begin - end) < part
        if earlier and not is_behind(G, m, BEGIN, END, h, closed):
            first, part = m, begin / (begin - end)
    return first


@njit
def step_to_zero(L, W, method, S, T, U, G):
    """Try a step that ends where guard or event G.passed is zero, near the part G.part of the step
    that was looked at, so that its end has the order of the method: LOCATED, LOST or IGNORED. Where
    another guard was zero before, G.passed ← that, unless time has no digits between them.
    """
    state, first = S.state, G.passed[0]
    t, h = state[TIME], state[TRIED_LENGTH]
    for _ in range(1 + G.count[0]):
        if not locate(L, W, method, S, T, U, G, h):
            return LOST
        n, end, same = G.passed[0], state[TRIED_END], 16.0 * MACHINE_EPSILON * max(abs(t), h)
        m, h = passed_before(W, G, end - t), t + h - end
        if m < 0 or h <= same:
            if G.kind[n] != CLOSE or closes(L, W, U, G, G.owner[n]):
                return LOCATED
            return IGNORED if n == first else LOST
        h, G.passed[0] = end - t, m
        G.part[1] = (G.value[END, m] - G.value[BEGIN, m]) / h
        G.part[0] = -G.value[BEGIN, m] / (G.part[1] * h)
    return LOST


@njit
def closes(L, W, U, G, k):
    """Whether a gap that is none closes within the ends of its edge: what comes round an end from
    behind closes none, nor does what touches on its way and goes away by itself, as the end of an
    arc on which a disc slides.
    """
    closed = CONTACT_GAP_CLOSED * W.size[0, 0]
    if gap_of(L, W, U, k) < -closed:
        return False
    pull = U.gap_sign[k] * row_acceleration(L, W, U, U.normal[k])
    rate, overlap = approach_of(L, W, U, k), GUARD_ROUNDING_GAP * W.size[0, 0]
    if 0.0 < rate * rate <= 2.0 * overlap * pull:
        return False
    return is_within(L, W, U, G.ends, k, closed, G.slow[k])


@njit
def shorten_before_pole(G, S, h):
    """Steps come no nearer than half way to where det(I − φ′ B) would vanish: beyond it forces have
    the other sign. Where a guard is zero the modes change, and with them what would vanish.
    """
    changes = G.part[0] != NO_ZERO and G.kind[G.passed[0]] != EVENT
    G.part[POLE_TIME] = math.inf
    for n in range(0 if changes else G.count[0]):
        if G.kind[n] == PARADOX and G.value[END, n] < G.value[BEGIN, n]:
            until = h * G.value[END, n] / (G.value[BEGIN, n] - G.value[END, n])
            G.part[POLE_TIME] = S.state[TIME] + until
            S.state[NEXT] = min(S.state[NEXT], 0.5 * until)


@njit
def meets_pole(G, S, T, code):
    """G.passed ← det(I − φ′ B) of what slides, where steps have come up to its zero, or vanish a
    little before; whether they have. What steps leave of the velocities decides closer by whether
    the contact still presses. G.part ← when it would be zero.
    """
    vanished = code in (STEP_VANISHED, NOT_FINITE)
    none = FRICTION_SINGULAR if vanished else FRICTION_POLE * T.relative
    for n in range(G.count[0] if vanished or code in (MORE, DONE) else 0):
        if G.kind[n] == PARADOX and abs(G.value[BEGIN, n]) < none:
            G.passed[0] = n
            return True
    return False


@njit
def go_back(E, S):
    """The step that was tried is to be made again; the count of evaluations goes on."""
    evaluations, end = S.state[EVALUATIONS], S.state[TRIED_END]
    for n in range(S.state.shape[0]):
        S.state[n] = E.saved[n]
    S.state[EVALUATIONS], S.state[TRIED_END] = evaluations, end


@njit
def try_quiet(L, W, method, S, T, U, G):
    """Try the next step until it is quiet, or ends at the first zero of a guard or an event:
    TRIED, what else `attempt_step` returns, or NOT_QUIET; how long the step after a cut one may be.
    """
    E, state, shortest = G.events, S.state, 0.0
    while True:
        for n in range(state.shape[0]):
            E.saved[n] = state[n]
        E.number[LATER] = EVENT_RATE_STEP * state[NEXT] / INTERVALS
        code, longest = attempt_watched(L, W, method, S, T, G.asked[UNTIL]), state[NEXT]
        if code != TRIED:
            return code, longest
        h, found = state[TRIED_LENGTH], LOST
        shortest = max(shortest, GUARD_PART_LEAST * h)
        E.number[FINEST] = min(1.0, shortest / h)
        G.part[DENSE] = 1.0 if find_first(L, W, method, S, T, U, G) else 0.0
        n, part, quiet = G.passed[0], G.part[0], G.part[0] == NO_ZERO
        if n >= 0 and not quiet and G.asked[LOCATES] > 0.0:
            found = step_to_zero(L, W, method, S, T, U, G)
        python_failed = E.handle[0] < 0
        if (quiet or found == LOCATED) and not python_failed:
            return TRIED, longest
        go_back(E, S)
        if python_failed or G.asked[LOCATES] == 0.0:
            return NOT_QUIET, longest
        if found == IGNORED or (n >= 0 and G.kind[n] == EVENT and h <= shortest):
            G.seen[n] = part
        elif h <= shortest:
            return NOT_QUIET, longest
        else:
            known = 0.5 * part if n >= 0 else E.number[FIRST_PART]
            state[NEXT] = max(known * h if known > 1.0 / NEARER else 0.25 * h, shortest)


@njit
def watched_steps(L, W, method, S, T, O, U, G):
    """Steps of a method, as G.asked says, up to the first zero of a guard.

    Returns what the kernels of methods do; ZERO at a zero of guard G.passed; CROSSED at an event,
    where the motion ends, or else is still before the step in which the event lies; or NOT_QUIET:
    the next step, which is not made, meets a zero that is not located. G.page is the record of
    where the steps end, or of the event.
    """
    code, until, E, state, waits = MORE, G.asked[UNTIL], G.events, S.state, False
    resume_method(L, method, S)
    if watched(G) == 0 and G.asked[LOCATES] == 0.0:
        return unwatched_steps(L, W, method, S, T, O, until, int(G.asked[COUNT]))
    E.number[LATER] = EVENT_RATE_STEP * state[NEXT] / INTERVALS
    if G.known[0] < KNOWN_ALL:
        look_at_present(L, W, S, U, G, T.refinements)
    for _ in range(int(G.asked[COUNT])):
        code, longest = try_quiet(L, W, method, S, T, U, G)
        if code == TRIED:
            quiet, n = G.part[0] == NO_ZERO, G.passed[0]
            event = not quiet and G.kind[n] == EVENT
            waits = event and E.stops[G.owner[n]] == 0
            if waits:
                code = CROSSED
                break
            h, G.known[0] = state[TRIED_LENGTH], 0
            code = accept_step(L, W, method, S, T, O, until, quiet and G.part[DENSE] > 0.0)
            for e in range(events_of(E)):
                if G.part[DENSE] > 0.0:
                    E.last[0, e] = E.last[1, e]
                if not quiet and G.seen[G.count[0] + e] >= 0.0:
                    E.side[PART, e] = 0.0  # it has crossed, and is at zero
            find_sides(G, END, PART if G.part[DENSE] > 0.0 else NOW, NOW)
            forget_seen(G)
            if not quiet:
                state[NEXT] = longest  # the step was only cut short
                code = CROSSED if event else ZERO
            shorten_before_pole(G, S, h)
            look_again(G, BEGIN, END)
            G.known[0] = KNOWN_ALL
            if state[ARTIFICIAL_ENERGY] > state[ARTIFICIAL_LIMIT]:
                break
        if meets_pole(G, S, T, code):
            code = ZERO
        if code != MORE:
            break
    if G.asked[LOCATES] > 0.0:
        for n in range(S.y.shape[0]):
            S.stage[n] = S.end[n] if waits else S.y[n]
        t = state[TRIED_END] if waits else state[TIME]
        state_derivative(L, W, S, t, S.stage, 1, T.full_refinements, True)
        state[EVALUATIONS] += 1
        keep(L, W, 0.0, G.page)
    if waits:
        go_back(E, S)
        G.seen[G.passed[0]] = G.part[0] + EVENT_TOGETHER
    return code
