"""The first zero of the guards of a step, or of a part of it, by looks at its ends and inside.

Between looks a guard is the cubic through values and rates or, where rates are not known, the
polynomial of order four through all five values; where that bends too much to be believed, or comes
near to zero without being zero at a look, what it says is unclear, and shorter parts are looked at.
The shortest ones are believed.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.core.tolerances import (
    GUARD_FORCE_VARIES,
    GUARD_NEARLY_ZERO,
    GUARD_SMOOTH,
    GUARD_TURNS,
    GUARD_ZERO,
)
from mbody.kernels.contact_guards import (
    BEGIN,
    END,
    EVENT,
    INSIDE,
    LOOKS,
    PARADOX,
    find_sides,
    fourth_difference,
    has_rates,
    is_behind,
    is_quiet,
    node,
    side_of,
    watched,
)
from mbody.kernels.watched_events import (
    FINEST,
    FINEST_OF_EVENTS,
    FIRST_PART,
    INTERVALS,
    PART,
    PART_END,
    PART_LENGTH,
    together,
)

#: The fourth difference of looks that are rounding, at most, as a multiple of that.
ROUNDING_OF_BEND = 17.0
#: Places at which a guard is scanned for its first change of sign, and rounds that close it in.
PLACES_SCANNED, ROUNDS = 32, 60
#: What `first_zero` returns where there is none, and where shorter parts are to be looked at.
NO_ZERO, UNCLEAR = 2.0, -1.0


@inline
def cubic(z, h, a, b, p, q):
    """The cubic with values a and b and rates p and q, a time h apart, at the part z of it."""
    p, q, d = h * p, h * q, b - a
    return a + z * (p + z * (3.0 * d - 2.0 * p - q + z * (p + q - 2.0 * d)))


@inline
def looks_beside(x):
    """The looks before and after the part x of what is looked at."""
    before, m = BEGIN, 0
    while m < LOOKS - 2 and x > node(INSIDE + m):
        before = INSIDE + m
        m += 1
    return before, INSIDE + m if m < LOOKS - 2 else END


@inline
def look_of(k):
    """The look that is number k in the order of time."""
    return BEGIN if k == 0 else END if k == LOOKS - 1 else INSIDE + k - 1


@njit
def turns_between(G, n, h):
    """Whether a mode's guard with known rates turns so fast that looks at a time h do not show it,
    and is near enough to zero for that to matter.
    """
    if G.kind[n] == EVENT or not has_rates(G, n):
        return False
    missed, bend, most, low = 0.0, 0.0, 0.0, math.inf
    for k in range(LOOKS):
        value = abs(G.value[look_of(k), n])
        most, low = max(most, value), min(low, value)
    for k in range(LOOKS - 2):
        a, b, c = look_of(k), look_of(k + 1), look_of(k + 2)
        length = node(c) - node(a)
        z, whole = (node(b) - node(a)) / length, length * h
        p, q = G.rate[a, n], G.rate[c, n]
        found = cubic(z, whole, G.gap[a, n], G.gap[c, n], p, q)
        missed = max(missed, abs(found - G.gap[b, n]))
        bend = max(bend, h * abs(p + z * (q - p) - G.rate[b, n]))
    return missed > max(GUARD_TURNS * bend, max(GUARD_ZERO * most, GUARD_FORCE_VARIES * low))


@njit
def guard_between(G, n, h, x, rated):
    """Guard n at the part x of what is looked at, a time h."""
    if rated:
        before, after = looks_beside(x)
        left, length = node(before), node(after) - node(before)
        z, whole = (x - left) / length, h * length
        found = cubic(
            z, whole, G.gap[before, n], G.gap[after, n], G.rate[before, n], G.rate[after, n]
        )
        a, b = G.past[before, n], G.past[after, n]
        if a > -math.inf and b > -math.inf:
            p, q = G.past_rate[before, n], G.past_rate[after, n]
            found = max(found, cubic(z, whole, a, b, p, q))
        return found
    total = 0.0
    for a in range(LOOKS):
        product = G.value[a, n]
        for b in range(LOOKS):
            if b != a:
                product *= (x - node(b)) / (node(a) - node(b))
        total += product
    return total


@njit
def is_behind_there(G, n, h, x, closed):
    """Whether guard n is a gap that is behind its edge all the time between the looks beside x."""
    before, after = looks_beside(x)
    return is_behind(G, n, before, after, (node(after) - node(before)) * h, closed)


@inline
def is_new(G, n, x):
    """Whether a zero of guard n at the part x of what is looked at was not known."""
    E = G.events
    return E.number[FIRST_PART] + x * E.number[PART_LENGTH] > G.seen[n]


@njit
def first_zero(G, n, h, closed):
    """The part of what is looked at, a time h, at which guard n is zero first: one of a mode falls
    through it, an event as it is asked. NO_ZERO where there is none, UNCLEAR where the looks do not
    say. Gaps up to `closed` are none.
    """
    event, rated, most, low = G.kind[n] == EVENT, has_rates(G, n), 0.0, math.inf
    # what is never on one side of zero crosses nothing, nor does what is rounding of it
    none = G.fresh[n] if event else 0.0
    side, swaps, unknown = side_of(G, n, BEGIN), False, 0
    known = side * G.value[BEGIN, n] > none
    if event and not known and G.events.side[PART, G.owner[n]] != 0.0:
        side, known = G.events.side[PART, G.owner[n]], True
    finest = G.events.number[PART_LENGTH] <= G.events.number[FINEST_OF_EVENTS if event else FINEST]
    for m in range(LOOKS):
        value = G.value[m, n]
        if value != value:
            unknown += 1
            continue
        most, low, swaps = max(most, abs(value)), min(low, side * value), swaps or side * value <= 0
    if unknown > 0:  # what has no value crosses nothing
        return NO_ZERO if finest or (event and unknown == LOOKS) else UNCLEAR
    if most <= none:
        return NO_ZERO
    if G.kind[n] == PARADOX and (low > 0.0 or G.value[BEGIN, n] <= 0.0):
        return NO_ZERO  # it jumps where the side that presses changes
    if not (event or rated) and (finest or G.kind[n] == PARADOX):
        return zero_between_looks(G, n) if finest else UNCLEAR
    believed = finest or (rated and not event)
    bend = abs(fourth_difference(G.value, n)) - ROUNDING_OF_BEND * none
    if not believed and bend > GUARD_SMOOTH * most:
        x = UNCLEAR if event else bent_zero(G, n)
        return x if is_new(G, n, x) else UNCLEAR
    left, before, place = 0.0, G.value[BEGIN, n], 1
    least, lowered = low, False
    while place <= PLACES_SCANNED:
        x = place / PLACES_SCANNED
        g = guard_between(G, n, h, x, rated)
        dips = event and known and min(side * before, side * g) <= GUARD_NEARLY_ZERO * most
        dips = dips and not lowered  # from where it is lowest it goes on to the next place
        lowered = dips and side * slope(G, n, h, left) < 0.0 < side * slope(G, n, h, x)
        if lowered:
            x = lowest(G, n, h, left, x, side)
            g = guard_between(G, n, h, x, rated)
        else:
            place += 1
        if side * g < least and not is_behind_there(G, n, h, x, closed):
            least = side * g
        if known and side * g <= -none:
            # what is rounding has left it there
            zero = closed_in(G, n, h, left, x, side, -none if abs(before) <= none else 0.0)
            if not event and (is_behind_there(G, n, h, zero, closed) or not is_new(G, n, zero)):
                left, before, known = x, g, False
                continue
            if not event or (G.sense[n] * side <= 0.0 and is_new(G, n, zero)):
                hides = event and not (swaps or finest)
                return UNCLEAR if hides else zero
            side, known, swaps = -side, abs(g) > none, True
        elif not known and abs(g) > none:
            if event:
                side = 1.0 if g > 0.0 else -1.0
            known = side * g > 0.0
        left, before = x, g
    if not (swaps or finest) and low > 0.0 and least < GUARD_NEARLY_ZERO * low:
        return UNCLEAR
    if event and known:
        G.events.side[PART_END, G.owner[n]] = side
    return NO_ZERO


@njit
def bent_zero(G, n):
    """Where a line through the last two looks before the first below zero is zero: the forces of
    what opens bend there. UNCLEAR where there are no such looks.
    """
    above = 0
    while above < LOOKS and G.value[look_of(above), n] > 0.0:
        above += 1
    for k in range(above, LOOKS):
        if G.value[look_of(k), n] > 0.0:
            return UNCLEAR
    if above < 2 or above == LOOKS:
        return UNCLEAR
    last, before = look_of(above - 1), look_of(above - 2)
    rate = (G.value[last, n] - G.value[before, n]) / (node(last) - node(before))
    x = node(last) - G.value[last, n] / rate if rate < 0.0 else math.inf
    return x if x <= node(look_of(above)) else UNCLEAR


@njit
def zero_between_looks(G, n):
    """The first zero of guard n by lines between looks."""
    for k in range(1, LOOKS):
        before, after = look_of(k - 1), look_of(k)
        a, b = G.value[before, n], G.value[after, n]
        x = node(before) + (node(after) - node(before)) * (a / (a - b) if a > 0.0 >= b else 0.0)
        if a > 0.0 and b <= -G.fresh[n] and is_new(G, n, x):
            return x
    return NO_ZERO


@njit
def note_fast_events(G, h):
    """Events that vary faster than the looks at a part, a time h, show: how far these are apart."""
    for n in range(G.count[0], watched(G)):
        most, e = 0.0, G.owner[n]
        for m in range(LOOKS):
            most = max(most, abs(G.value[m, n]))
        if abs(fourth_difference(G.value, n)) > GUARD_SMOOTH * most:
            G.events.missed[e] = max(G.events.missed[e], h / INTERVALS)


@njit
def lowest(G, n, h, left, right, side):
    """Where guard n, on a side of zero, is nearest to it between two places, between which it is
    once.
    """
    for _ in range(ROUNDS):
        a, b = (2.0 * left + right) / 3.0, (left + 2.0 * right) / 3.0
        rated = has_rates(G, n)
        if side * guard_between(G, n, h, a, rated) <= side * guard_between(G, n, h, b, rated):
            right = b
        else:
            left = a
    return 0.5 * (left + right)


@njit
def closed_in(G, n, h, left, right, side, level):
    """Where guard n is a level between two places, by bisection; `side`: that of the left one."""
    rated = has_rates(G, n)
    for _ in range(ROUNDS):
        x = 0.5 * (left + right)
        if side * guard_between(G, n, h, x, rated) > level:
            left = x
        else:
            right = x
    return right


@njit
def slope(G, n, h, x):
    """The rate of guard n at the part x of what is looked at, a time h, in values that long."""
    rated, little = has_rates(G, n), 0.5**20
    a, b = max(0.0, x - little), min(1.0, x + little)
    return (guard_between(G, n, h, b, rated) - guard_between(G, n, h, a, rated)) / (b - a)


@inline
def comes_first(G, n, here, first, x):
    """Whether guard n, zero at the part `here`, comes before the first so far, at x: an event
    before the change of modes that it meets, one that stops the motion after others.
    """
    E = G.events
    if first < 0 or G.kind[n] != EVENT:
        return here < x
    if G.kind[first] != EVENT:
        return here <= x + together(E)
    stops = E.stops[G.owner[n]] - E.stops[G.owner[first]]
    return here < x - stops * together(E)


@njit
def first_guard(G, h, closed):
    """The guard that is zero first, −1 of none, and the part of what is looked at, a time h, at
    which it is; or one of which the looks do not say, and UNCLEAR. Gaps up to `closed` are none.
    """
    first, x = -1, NO_ZERO
    find_sides(G, END, PART, PART_END)
    for n in range(watched(G)):
        if turns_between(G, n, h):
            if G.events.number[PART_LENGTH] > G.events.number[FINEST]:
                return n, UNCLEAR
        elif is_quiet(G, n, h, closed):
            continue
        here = first_zero(G, n, h, closed)
        if here < 0.0:
            return n, UNCLEAR
        if here <= 1.0 and comes_first(G, n, here, first, x):
            first, x = n, here
    return first, x
