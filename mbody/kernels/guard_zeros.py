"""The first zero of the guards of a step, by looks at its ends and inside.

Between looks a guard is the cubic through values and rates or, where rates are not known, the
polynomial of order four through all five values; where that bends too much to be believed, or comes
near to zero without being zero at a look, what it says is unclear.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.core.tolerances import GUARD_NEARLY_ZERO, GUARD_PARADOX_FAR, GUARD_SMOOTH
from mbody.kernels.contact_guards import (
    BEGIN,
    END,
    INSIDE,
    LOOKS,
    PARADOX,
    fourth_difference,
    has_rates,
    node,
)

#: Places at which a guard is scanned for its first change of sign, and rounds that close it in.
PLACES_SCANNED, ROUNDS = 32, 60
#: What `first_zero` returns where there is none, and where it is not clear.
NO_ZERO, UNCLEAR = 2.0, -1.0


@inline
def cubic(z, h, a, b, p, q):
    """The cubic with values a and b and rates p and q, a time h apart, at the part z of it."""
    p, q, d = h * p, h * q, b - a
    return a + z * (p + z * (3.0 * d - 2.0 * p - q + z * (p + q - 2.0 * d)))


@njit
def guard_between(G, n, h, x, rated):
    """Guard n at the part x of a step of length h."""
    if rated:
        before, m = BEGIN, 0
        while m < LOOKS - 2 and x > node(INSIDE + m):
            before = INSIDE + m
            m += 1
        after = INSIDE + m if m < LOOKS - 2 else END
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
def first_zero(G, n, h):
    """The part of a step of length h at which guard n, which begins above zero, is zero first;
    NO_ZERO where there is none, UNCLEAR where the looks do not say.
    """
    rated, most, low = has_rates(G, n), 0.0, math.inf
    for m in range(LOOKS):
        if G.value[m, n] != G.value[m, n]:
            return UNCLEAR
        most, low = max(most, abs(G.value[m, n])), min(low, G.value[m, n])
    if G.kind[n] == PARADOX:
        # it jumps where the side that presses changes
        return NO_ZERO if low > GUARD_PARADOX_FAR else UNCLEAR
    if not rated and abs(fourth_difference(G.value, n)) > GUARD_SMOOTH * most:
        return UNCLEAR
    # what is never above zero crosses nothing
    left, least, above = 0.0, math.inf, G.value[BEGIN, n] > 0.0
    for m in range(1, PLACES_SCANNED + 1):
        x = m / PLACES_SCANNED
        g = guard_between(G, n, h, x, rated)
        if above and g <= 0.0:
            return closed_in(G, n, h, left, x, rated)
        left, above = x, above or g > 0.0
        least = min(least, g)
    if low > 0.0 and least < GUARD_NEARLY_ZERO * low:
        return UNCLEAR
    return NO_ZERO


@njit
def closed_in(G, n, h, left, right, rated):
    """The zero between two places, by bisection."""
    for _ in range(ROUNDS):
        x = 0.5 * (left + right)
        if guard_between(G, n, h, x, rated) > 0.0:
            left = x
        else:
            right = x
    return right


@njit
def slope(G, n, h, x):
    """The rate of guard n at the part x of a step of length h, in values a step."""
    rated, little = has_rates(G, n), 0.5**20
    a, b = max(0.0, x - little), min(1.0, x + little)
    return (guard_between(G, n, h, b, rated) - guard_between(G, n, h, a, rated)) / (b - a)


@njit
def first_guard(G, h):
    """The guard that is zero first, and the part of the step at which it is: NO_ZERO where none is,
    UNCLEAR where the looks do not say.
    """
    first, x = -1, NO_ZERO
    for n in range(G.count[0]):
        here = first_zero(G, n, h)
        if here == UNCLEAR:
            return -1, UNCLEAR
        if here < x:
            first, x = n, here
    return first, x
