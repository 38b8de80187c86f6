"""Guards of the modes of contacts and frictional joints: what is positive as long as they hold.

A guard is a gap, a normal force, a reserve of friction, a rate of sliding or det(I − φ′ B) of what
slides. Of places and rates the rate is at hand, so that a cubic bounds them over a step; forces may
change as they like, and count as quiet where both ends are alike beside their distance from zero.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import inline, njit
from mbody.core.tolerances import (
    FORCE_PASSED_ON,
    GUARD_CUBIC_CLEAR,
    GUARD_FALLING,
    GUARD_FORCE_VARIES,
    GUARD_PARADOX_FAR,
    GUARD_ROUNDING_FORCE,
    GUARD_ROUNDING_GAP,
    GUARD_ROUNDING_STOP,
    GUARD_ZERO,
    TINY,
)
from mbody.kernels.contact_points import approach_of, gap_of, nearest_end
from mbody.kernels.friction import DETERMINANT, size_of
from mbody.kernels.unilateral import (
    BACKWARD,
    FORWARD,
    LENGTH,
    OPEN,
    REDUNDANT,
    STICK,
    row_acceleration,
    row_multiplier,
    row_rate,
)

#: Kinds of guards.
CLOSE, LOCK, EDGE, ENTER, STOP, LIFT, SLIP, SHARE, PARADOX = range(9)


class Guards(Bundle):
    """What is watched: at most so many guards, and their values.

    `kind`, `owner` (guards,): See above; contact point, or c and the number of a joint.
    `count` (1,): How many there are.
    `value`, `rate` (4, guards): At the beginning of a step, at its end, and at two places within;
      the rate is not a number where none is at hand.
    `fresh` (guards,): What began at zero counts as this much as long as it is less; else zero.
    `size` (guards,): What values are compared with.
    `speed`, `force` (c + j,): Sizes of velocities and forces of each owner.
    `body_force` (bodies + 1,): Greatest force on each body.
    `part_force`, `part_fastest` (bodies,): Of each connected part the greatest force and
      acceleration.
    """

    kind: Ints
    owner: Ints
    count: Ints
    value: Rows
    rate: Rows
    fresh: Floats
    size: Floats
    speed: Floats
    force: Floats
    body_force: Floats
    part_force: Floats
    part_fastest: Floats


@inline
def add_guard(G, kind, owner):
    """One guard more."""
    n = G.count[0]
    G.kind[n], G.owner[n] = kind, owner
    G.count[0] = n + 1


@njit
def find_guards(L, W, U, M, G, shares):
    """The guards of the present modes; `shares`: whether forces are open that no equation
    decides.
    """
    points, slides = U.normal.shape[0], False
    G.count[0] = 0
    for k in range(points):
        mode = M.mode[k]
        if mode == OPEN:
            add_guard(G, LOCK if U.one_way[k] else ENTER if M.beyond[k] else CLOSE, k)
            continue
        if U.has_ends[k]:
            add_guard(G, EDGE, k)
        if mode == REDUNDANT:
            continue
        if not M.open_normal[k]:
            add_guard(G, LIFT, k)
        if U.static[k] == 0.0:
            continue
        if mode == STICK:
            if M.leader[k] == k and not M.open_tangent[k]:
                add_guard(G, SLIP, k)
        else:
            add_guard(G, STOP, k)
    for j in range(U.joint_tangent.shape[0]):
        k = points + j
        if M.mode[k] != STICK:
            add_guard(G, STOP, k)
        elif not M.open_tangent[k]:
            add_guard(G, SLIP, k)
    if shares:
        add_guard(G, SHARE, 0)
    for f in range(L.friction_kind.shape[0]):
        slides = slides or W.slip_sign[f, 0] != 0.0
    if slides:
        add_guard(G, PARADOX, 0)


@inline
def tangent_of(U, k):
    """The row along which owner k slides."""
    points = U.normal.shape[0]
    return U.tangent[k] if k < points else U.joint_tangent[k - points]


@inline
def pressing(L, W, U, k):
    """N of contact point k, positive where it presses."""
    return -U.gap_sign[k] * row_multiplier(L, W, U.normal[k])


@njit
def reserve(L, W, U, M, k):
    """How much more friction what sticks could have, with all that sticks by its row."""
    points = U.normal.shape[0]
    own = row_multiplier(L, W, tangent_of(U, k))
    if k < points:
        most = 0.0
        for n in range(points):
            if M.leader[n] == k:
                most += U.static[n] * pressing(L, W, U, n)
        return most - abs(own)
    # limits differ with the direction, as of band brakes: the nearer one, without a jump at zero
    f = U.joint_pair[k - points]
    node = 2 * L.friction_node[f]
    x, y = W.lam[node, 0], W.lam[node + 1, 0]
    ahead, back = static_limits(L, W, f, x, y)
    return min(ahead - own, back + own)


@njit
def static_limits(L, W, f, x, y):
    """Friction of joint pair f at rest, forwards and backwards, for multipliers x and y."""
    coefficient, slip_sign = W.coefficient[f, 0], W.slip_sign[f, 0]
    W.coefficient[f, 0] = W.par[L.friction_par[f] + 1, 0]
    W.slip_sign[f, 0] = 1.0
    ahead, _, _ = size_of(L, W, 0.0, f, x, y)
    W.slip_sign[f, 0] = -1.0
    back, _, _ = size_of(L, W, 0.0, f, x, y)
    W.coefficient[f, 0], W.slip_sign[f, 0] = coefficient, slip_sign
    return ahead, back


@njit
def guard_values(L, W, U, M, G, at, shared):
    """Rows `at` of G.value and G.rate ← the guards at the state that was just evaluated; `shared`:
    the greatest reserve of forces that are open.
    """
    points = U.normal.shape[0]
    for n in range(G.count[0]):
        kind, k, rate = G.kind[n], G.owner[n], math.nan
        if kind == CLOSE:
            value, rate = gap_of(L, W, U, k), approach_of(L, W, U, k)
            # past its ends it is as far from there as it is from them
            past = -nearest_end(L, W, U, k) - U.closed_within[k]
            if past > value:
                value, rate = past, math.nan
        elif kind == LOCK:
            value = approach_of(L, W, U, k)
        elif kind == EDGE:
            value = nearest_end(L, W, U, k)
        elif kind == ENTER:
            value = -nearest_end(L, W, U, k)
        elif kind == STOP:
            sense = 1.0 if M.mode[k] == FORWARD else -1.0
            s = tangent_of(U, k)
            value = sense * row_rate(L, W, U, s)
            rate = sense * row_acceleration(L, W, U, s)
        elif kind == LIFT:
            value = pressing(L, W, U, k)
        elif kind == SLIP:
            value = reserve(L, W, U, M, k)
        elif kind == SHARE:
            value = shared
        else:
            value = W.friction[DETERMINANT, 0]
        if G.fresh[n] > 0.0 and abs(value) <= G.fresh[n]:
            value, rate = G.fresh[n], math.nan
        G.value[at, n], G.rate[at, n] = value, rate


@njit
def quiet(G, before, after, h):
    """Whether no guard can have been zero between two looks, a time h apart: values that exceed
    what rates at both ends would take in that time or, of forces, values that hardly change.
    """
    for n in range(G.count[0]):
        a, b = G.value[before, n], G.value[after, n]
        low = min(a, b)
        if not low > 0.0:
            return False
        if G.kind[n] == PARADOX and low > GUARD_PARADOX_FAR:
            continue
        p, q = G.rate[before, n], G.rate[after, n]
        if p == p and q == q:
            # Bézier points of the cubic of both ends bound it
            if min(a + h * p / 3.0, b - h * q / 3.0) < GUARD_CUBIC_CLEAR * low:
                return False
        elif abs(a - b) > GUARD_FORCE_VARIES * low:
            return False
    return True
