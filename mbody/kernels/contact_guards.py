"""Guards of the modes of contacts and frictional joints: what is positive as long as they hold.

A guard is a gap, a normal force, a reserve of friction, a rate of sliding, the greatest margin of
forces that are shared or det(I − φ′ B) of what slides. Contact points come first, then frictional
joints; both are called owners of modes.

A step is quiet if no guard can have been zero within it. Of places and rates the rate is at hand,
so that a cubic (its four control points) bounds them between two looks; forces count as quiet where
both looks are alike beside their distance from zero, and a fourth difference that is small beside
it says that five looks show how they vary.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import (
    CONTACT_EDGES_FLUSH,
    CONTACT_GAP_CLOSED,
    FORCE_PASSED_ON,
    GUARD_CUBIC_CLEAR,
    GUARD_FORCE_VARIES,
    RATE_NONE_FRICTION,
    TINY,
)
from mbody.kernels.complementarity import find_arms
from mbody.kernels.contact_modes import (
    FORWARD,
    OPEN,
    STICK,
    UnilateralModes,
    is_redundant,
    tangent_of,
)
from mbody.kernels.contact_rows import (
    UnilateralLayout,
    approach_of,
    find_end_rates,
    gap_of,
    row_acceleration,
    row_rate,
)
from mbody.kernels.force_programs import PARTS, OpenForces, limits_of, open_parts
from mbody.kernels.friction import ARMS, DETERMINANT, law_size
from mbody.kernels.held_forces import (
    NORMALS,
    HeldForceTable,
    find_held,
    has_room,
    hold,
    least_margin,
    may_share,
)
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work
from mbody.kernels.linear_program import LinearProgram
from mbody.kernels.watched_events import WatchedEvents, events_of, find_events

#: Kinds of guards.
CLOSE, LOCK, LIFT, EDGE, ENTER, SLIP, SHARE, STOP, PARADOX, EVENT = range(10)

#: Looks at a step, or at a part of it: at its beginning, its end, and in three places between, so
#: unevenly that what swings does not look as if it did not. Kept are those at the ends of the step.
BEGIN, END, INSIDE, LOOKS = 0, 1, 2, 5
FIRST, LAST, KEPT_LOOKS = 5, 6, 7
PLACES = (0.2, 0.528, 0.72)


class Guards(Bundle):
    """What is watched: g guards at most, and their values; events of users after those of modes.

    `count` (1,): How many guards of modes there are.
    `kind`, `owner` (g,): See above; contact point, c and the number of a joint, or an event.
    `value`, `rate` (KEPT_LOOKS, g): At the looks of a step; rates are not a number if unknown.
    `gap`, `past`, `past_rate` (KEPT_LOOKS, g): Of a gap that closes itself, of which `rate` is, how
      far its contact point is past the ends of its edge; the value is the greater of both. Of
      others the value, and minus infinity.
    `fresh` (g,): What began at zero counts as this much as long as it is less; else zero. Of events
      what is rounding of them in a step.
    `seen` (g,): Up to this part of the step its zeros are known.
    `sense` (g,): Of what slides its direction.
    `leader` (c + j,): By whose row what sticks is held, often its own.
    `open_normal`, `open_tangent` (c + j,): Whether no equation decides its normal force, or that of
      its friction.
    `slow` (c + j,): Rates up to this are none.
    `size` (g,): With what the values are compared.
    `body_part`, `length` (bodies,): The first body of what is joined to each or may touch it; the
      length by which its angle is compared with lengths.
    `force_arm` (c + j,): By what forces are multiplied to be of the kind of each: of pins their
      radius, of other angles the model length, else 1.
    `force` (c + j,), `body_force` (bodies + 1,), `part_force` (bodies, 2): The greatest force on
      that body of each on which it is less; on every body; of every part, and acceleration.
    `ends`, `end_rates` (c, 2): Workspace for the ways from the ends of edges.
    `arm` (7,): Workspace for the limits of joint friction.
    `stage` (states,): Workspace for a state of a stage.
    `known` (1,): Whether the look at the beginning is of the present state: 1 of guards alone, 2
      of events, too.
    `passed` (1,), `part` (4,): Which of them is zero first in a step, −1 if none; at which part of
      the step, its rate there, and what `mbody.kernels.watched_steps` says.
    `event_value`, `event_rate` (e,): Of events, as they are looked at.
    `asked` (4,): What is asked of the steps: see below.
    `page` (rows, 1): The record of the instant at which they end.
    `held`, `open`, `program`: Forces that no equation decides, those that hold beside them, and the
      program of their greatest margin: of the present modes.
    `events`: Events of users.
    """

    count: Ints
    kind: Ints
    owner: Ints
    value: Rows
    rate: Rows
    gap: Rows
    past: Rows
    past_rate: Rows
    fresh: Floats
    seen: Floats
    sense: Floats
    leader: Ints
    open_normal: Ints
    open_tangent: Ints
    slow: Floats
    size: Floats
    body_part: Ints
    length: Floats
    force_arm: Floats
    force: Floats
    body_force: Floats
    part_force: Rows
    ends: Rows
    end_rates: Rows
    arm: Floats
    stage: Floats
    known: Ints
    passed: Ints
    part: Floats
    event_value: Floats
    event_rate: Floats
    asked: Floats
    page: Rows
    held: HeldForceTable
    open: OpenForces
    program: LinearProgram
    events: WatchedEvents


#: Numbers of `Guards.asked`: until when steps go on, and how many they are at most; whether loads
#: follow laws of time, of which the length of steps says nothing; whether zeros are located, and
#: the record kept.
UNTIL, COUNT, SWINGS, LOCATES = range(4)


@inline
def add_guard(G, kind, owner, sense):
    """One guard more."""
    n = G.count[0]
    G.kind[n], G.owner[n], G.sense[n] = kind, owner, sense
    G.count[0] = n + 1


@njit
def collect_guards(L, W, U, M, G):
    """The guards of the present modes."""
    points, slides, shared = U.normal.shape[0], False, -1
    G.count[0] = 0
    for k in range(M.leader.shape[0]):
        G.leader[k] = M.leader[k]
        if shared < 0 and (G.open_normal[k] or G.open_tangent[k]):
            shared = k
    for k in range(points):
        mode = M.mode[k]
        if mode == OPEN:
            add_guard(G, LOCK if U.one_way[k] else ENTER if M.beyond[k] else CLOSE, k, 0.0)
            continue
        if U.has_ends[k]:
            add_guard(G, EDGE, k, 0.0)
        idle = is_redundant(W, U, M.mode, k)
        if not (idle or G.open_normal[k]):
            add_guard(G, LIFT, k, 0.0)
        if U.static[k] == 0.0 or (idle and (mode == STICK or M.leader[k] >= 0)):
            continue
        if mode != STICK:
            add_guard(G, STOP, k, 1.0 if mode == FORWARD else -1.0)
        elif not G.open_tangent[k] and (M.leader[k] == k or M.leader[k] < 0):
            add_guard(G, SLIP, k, 0.0)
    for j in range(U.joint_tangent.shape[0]):
        k = points + j
        if M.mode[k] != STICK:
            add_guard(G, STOP, k, 1.0 if M.mode[k] == FORWARD else -1.0)
        elif not G.open_tangent[k]:
            add_guard(G, SLIP, k, 0.0)
    if shared >= 0:
        add_guard(G, SHARE, shared, 0.0)
    for f in range(L.friction_kind.shape[0]):
        slides = slides or W.slip_sign[f, 0] != 0.0
    if slides:
        add_guard(G, PARADOX, 0, 0.0)
    G.known[0] = 0


@inline
def row_multiplier(L, W, s):
    """λ of row s."""
    return W.lam[2 * L.primitive_node[L.active_set[s]], 0]


@inline
def pressing(L, W, U, k):
    """N of contact point k, positive where it presses."""
    return -U.gap_sign[k] * row_multiplier(L, W, U.normal[k])


@njit
def reserve(L, W, U, G, k):
    """How much more friction what sticks could have, with all that sticks by its row."""
    points = U.normal.shape[0]
    own = row_multiplier(L, W, tangent_of(U, k))
    if k < points:
        most = 0.0
        for n in range(points):
            if n == k or G.leader[n] == k:
                most += U.static[n] * pressing(L, W, U, n)
        return most - abs(own)
    # limits differ with the direction, as of band brakes: the nearer one, without a jump at zero
    f, arm = U.joint_pair[k - points], G.arm
    kind, node = L.friction_kind[f], 2 * L.friction_node[f]
    x, y = W.lam[node, 0], W.lam[node + 1, 0]
    find_arms(L, W, f, True, arm)
    ahead, _, _ = law_size(kind, arm[0], arm[1], arm[2], x, y)
    back, _, _ = law_size(kind, arm[ARMS], arm[ARMS + 1], arm[ARMS + 2], x, y)
    return min(ahead - own, back + own)


@njit
def look(L, W, U, G, at, shifts):
    """Row `at` of G.value and G.rate ← the guards at the state that was just evaluated; `shifts`:
    whether what began at zero counts as a little more while it is rounding.
    """
    find_end_rates(L, W, U, G.ends, G.end_rates)
    closed, flush = CONTACT_GAP_CLOSED * W.size[0, 0], CONTACT_EDGES_FLUSH * W.size[0, 0]
    for n in range(G.count[0]):
        kind, k, rate, least = G.kind[n], G.owner[n], math.nan, G.fresh[n]
        past, past_rate = -math.inf, 0.0
        if kind == CLOSE:
            gap, rate = gap_of(L, W, U, k), approach_of(L, W, U, k)
            side = 0 if G.ends[k, 0] < G.ends[k, 1] else 1
            along, opens, slow = G.ends[k, side], rate > 0.0, abs(rate) <= G.slow[k]
            value, least = gap, least if gap >= -closed else -1.0
            if along < math.inf:
                # past its ends it is as far from there as it is from them
                past, past_rate = -along - closed, -G.end_rates[k, side]
                value = max(gap, past)
            if least > 0.0:
                # what opens from there closes later, whatever rounding says
                if abs(value) <= least and opens:
                    value = gap = least
            elif abs(gap) <= flush and slow:
                # what leaves its edge does so first
                value = gap = max(closed - along, -flush)
                rate, past = math.nan, -math.inf
        elif kind == LOCK:
            value = approach_of(L, W, U, k)
        elif kind in (EDGE, ENTER):
            side = 0 if G.ends[k, 0] < G.ends[k, 1] else 1
            sense = 1.0 if kind == EDGE else -1.0
            value, rate = sense * G.ends[k, side], sense * G.end_rates[k, side]
        elif kind == STOP:
            sense, s = G.sense[n], tangent_of(U, k)
            value, rate = sense * row_rate(L, W, U, s), sense * row_acceleration(L, W, U, s)
        elif kind == LIFT:
            value = pressing(L, W, U, k)
        elif kind == SLIP:
            value = reserve(L, W, U, G, k)
        elif kind == SHARE:
            value = least_margin(L, W, U, G.held, G.open, G.program)
        else:
            value = W.friction[DETERMINANT, 0]
        if kind != CLOSE:
            gap = value
        if shifts and abs(value) <= least:
            value = gap = least
            if rate == rate:
                # at which it leaves zero is known; others are rounding
                rate = max(rate, 0.0) if at == BEGIN else 0.0
        G.value[at, n], G.rate[at, n], G.gap[at, n] = value, rate, gap
        G.past[at, n], G.past_rate[at, n] = past, past_rate


@njit
def look_at_events(L, W, G, at):
    """Row `at` of G.value and G.rate ← the events at the state that was just evaluated."""
    E = G.events
    if events_of(E) == 0:
        return
    find_events(L, W, E, G.event_value, G.event_rate)
    for e in range(events_of(E)):
        n = G.count[0] + e
        G.kind[n], G.owner[n], G.sense[n] = EVENT, e, E.direction[e]
        G.value[at, n] = G.gap[at, n] = G.event_value[e]
        G.rate[at, n], G.past[at, n], G.past_rate[at, n] = G.event_rate[e], -math.inf, 0.0


@njit
def find_sides(G, at, before, row):
    """Row `row` of the sides of events ← those at a look; what is rounding there is on its side
    before.
    """
    E = G.events
    for e in range(events_of(E)):
        value, none = G.value[at, G.count[0] + e], G.fresh[G.count[0] + e]
        side = 1.0 if value > none else -1.0 if value < -none else E.side[before, e]
        E.side[row, e] = side


@inline
def watched(G):
    """How many guards and events there are."""
    return G.count[0] + events_of(G.events)


@njit
def forget_seen(G):
    """Another step: no zeros are known."""
    for n in range(G.seen.shape[0]):
        G.seen[n] = -1.0


@inline
def side_of(G, n, at):
    """1, or −1 of an event that is below zero at a look."""
    return -1.0 if G.kind[n] == EVENT and G.value[at, n] < 0.0 else 1.0


@inline
def is_behind(G, n, before, after, h, closed):
    """Whether guard n is a gap that is behind its edge all the time h between two looks, by more
    than `closed`, up to which gaps are none: what comes past the ends of the edge there meets
    nothing.
    """
    if G.kind[n] != CLOSE or max(G.gap[before, n], G.gap[after, n]) >= -closed:
        return False
    return is_clear(-G.gap[before, n], -G.gap[after, n], -G.rate[before, n], -G.rate[after, n], h)


@njit
def between(G, n, before, after, h, closed):
    """Whether guard n may have been zero between two looks, a time h apart, as an event may that
    was rounding before: on which side it was then is remembered.
    """
    if G.kind[n] == EVENT and abs(G.value[before, n]) <= G.fresh[n] < abs(G.value[after, n]):
        return True
    side = side_of(G, n, before)
    p, q, past_p, past_q = (
        side * G.rate[before, n],
        side * G.rate[after, n],
        G.past_rate[before, n],
        G.past_rate[after, n],
    )
    return not (
        is_clear(side * G.gap[before, n], side * G.gap[after, n], p, q, h)
        or is_clear(G.past[before, n], G.past[after, n], past_p, past_q, h)
        or is_behind(G, n, before, after, h, closed)
    )


@inline
def is_clear(a, b, p, q, h):
    """Whether what has the values a and b, with the rates p and q, a time h apart is above zero
    between.
    """
    low = min(a, b)
    if not low > 0.0:
        return False
    if p == p and q == q:
        return min(a + h * p / 3.0, b - h * q / 3.0) >= GUARD_CUBIC_CLEAR * low
    return abs(a - b) <= GUARD_FORCE_VARIES * low


@njit
def quiet_by_ends(G, h, closed):
    """Whether no guard can have been zero within a short step, by its ends."""
    quiet = True
    for n in range(watched(G)):
        quiet = quiet and not between(G, n, BEGIN, END, h, closed)
    return quiet


@inline
def place(at):
    """The part of what is looked at, a step or a part of it, at which a look is."""
    return PLACES[0] if at == INSIDE else PLACES[1] if at == INSIDE + 1 else PLACES[2]


@njit
def is_quiet(G, n, h, closed):
    """Whether guard n cannot have been zero within what was looked at, a time h."""
    before, x, low, bend = BEGIN, 0.0, math.inf, 0.0
    for m in range(LOOKS - 1):
        after = INSIDE + m if m < LOOKS - 2 else END
        there = place(after) if m < LOOKS - 2 else 1.0
        if between(G, n, before, after, (there - x) * h, closed):
            return False
        low = min(low, min(abs(G.value[before, n]), abs(G.value[after, n])))
        before, x = after, there
    if G.kind[n] == EVENT or not has_rates(G, n):
        bend = fourth_difference(G.value, n)
    return abs(bend) <= GUARD_FORCE_VARIES * low


@njit
def has_rates(G, n):
    """Whether all rates of guard n are known."""
    known = True
    for m in range(LOOKS):
        p, q = G.rate[m, n], G.past_rate[m, n]
        known = known and p == p and q == q
    return known


@njit
def fourth_difference(value, n):
    """The fourth divided difference of guard n over a step, times 4!/4⁴: as it is of looks a
    quarter apart.
    """
    total = 0.0
    for a in range(LOOKS):
        x, product = node(a), 1.0
        for b in range(LOOKS):
            if b != a:
                product *= x - node(b)
        total += value[a, n] / product
    return (24.0 / 256.0) * total


@inline
def node(at):
    """The part of a step at which a look is, its ends included."""
    return 0.0 if at == BEGIN else 1.0 if at == END else place(at)


@inline
def look_again(G, at, source):
    """Row `at` ← row `source`."""
    for n in range(watched(G)):
        G.value[at, n], G.rate[at, n] = G.value[source, n], G.rate[source, n]
        G.gap[at, n] = G.gap[source, n]
        G.past[at, n], G.past_rate[at, n] = G.past[source, n], G.past_rate[source, n]


@njit
def look_at_guards(L, W, U, G):
    """Look at the state that was just evaluated as the beginning of a step; the least value, not a
    number where one is none.
    """
    least = math.inf
    look(L, W, U, G, BEGIN, True)
    for n in range(G.count[0]):
        value = G.value[BEGIN, n]
        least = value if value != value or value < least else least
    G.known[0] = 2 if events_of(G.events) == 0 else 1
    return least


@njit
def find_shared(L, W, U, M, G):
    """G.held, G.open_normal, G.open_tangent ← the forces of the present modes, and whose no
    equation decides, at the state that was just evaluated; whether there is memory for it.
    """
    H, S = G.held, G.open
    find_held(L, W, U, M, H)
    for k in range(G.open_normal.shape[0]):
        G.open_normal[k] = G.open_tangent[k] = 0
    if not may_share(H):
        return True
    if not has_room(L, U, H, S):
        return False
    hold(L, W, U, H, S)
    open_parts(S)
    for n in range(S.count[PARTS]):
        for i in range(limits_of(S)):
            if S.moves[n, i]:
                if i < H.count[NORMALS]:
                    G.open_normal[H.owner[i]] = 1
                else:
                    G.open_tangent[H.owner[i]] = 1
    return True


# -- Sizes of guards ---------------------------------------------------------------------------


@njit
def find_body_forces(L, W, S, U, G, record):
    """G.body_force ← the greatest force on every body, by its inertia and the reactions that a
    record has; torques by their lengths.
    """
    n3, own = 3 * L.bodies, G.body_force
    for b in range(L.bodies + 1):
        own[b] = 0.0
    for k in range(n3):
        arm = 1.0 / G.length[k // 3] if k % 3 == 2 else 1.0
        own[k // 3] = max(own[k // 3], abs(W.mass[k, 0] * S.K[0, n3 + k]) * arm)
    for e in range(L.primitive_node.shape[0]):
        row = 3 * n3 + PER_PRIMITIVE * e
        force = max(abs(record[row + 2, 0]), abs(record[row + 3, 0]))
        force = max(force, abs(record[row + 4, 0]) / W.size[0, 0])
        i, j = L.primitive_i[e], L.primitive_j[e]
        own[i], own[j] = max(own[i], force), max(own[j], force)


@njit
def find_owner_forces(L, W, U, G):
    """G.force ← the greatest force on that body of every owner on which it is less; not less than
    what rounding passes on of the accelerations that forces give to what may touch or is joined.
    """
    own, part = G.body_force, G.part_force
    for b in range(L.bodies):
        part[b, 0] = part[b, 1] = 0.0
    for b in range(L.bodies):
        p = G.body_part[b]
        part[p, 0] = max(part[p, 0], own[b])
        part[p, 1] = max(part[p, 1], own[b] / max(W.mass[3 * b, 0], TINY))
    for k in range(G.force.shape[0]):
        least = math.inf
        for side in range(2):
            b = U.bodies[k, side]
            if b < L.bodies:
                mass, passed = W.mass[3 * b, 0], part[G.body_part[b], 0]
                if mass > 0.0:
                    passed = min(passed, mass * part[G.body_part[b], 1])
                least = min(least, max(own[b], FORCE_PASSED_ON * passed))
        G.force[k] = least * G.force_arm[k]


@njit
def find_sizes(L, W, S, U, G, record):
    """G.size ← scales of the guards' values at the instant of a record (rows, 1), whose derivative
    is in row 0 of K: length, velocity, force or torque, or 1.
    """
    find_body_forces(L, W, S, U, G, record)
    find_owner_forces(L, W, U, G)
    for n in range(G.count[0]):
        kind, k = G.kind[n], G.owner[n]
        if kind in (CLOSE, EDGE, ENTER):
            G.size[n] = W.size[0, 0]
        elif kind == LOCK:
            G.size[n] = G.slow[k] / RATE_NONE_FRICTION
        elif kind == STOP:  # of pins a rate of turning
            G.size[n] = G.slow[k] / (RATE_NONE_FRICTION * U.speed_unit[tangent_of(U, k)])
        elif kind == SHARE:  # a margin in forces
            G.size[n] = 0.0
            for m in range(G.force.shape[0]):
                if G.open_normal[m] or G.open_tangent[m]:
                    G.size[n] = max(G.size[n], G.force[m] / G.force_arm[m])
        else:
            G.size[n] = 1.0 if kind == PARADOX else G.force[k]


# -- As Python reads them ----------------------------------------------------------------------


@kernel
def find_guards(L: Layout, W: Work, U: UnilateralLayout, M: UnilateralModes, G: Guards) -> bool:
    """Guards and forces of the present modes; whether there is memory for what no equation
    decides of these.
    """
    find_held(L, W, U, M, G.held)
    collect_guards(L, W, U, M, G)
    return not may_share(G.held) or has_room(L, U, G.held, G.open)


@kernel
def present_guards(L: Layout, W: Work, U: UnilateralLayout, G: Guards) -> float:
    """See `look_at_guards`."""
    return look_at_guards(L, W, U, G)
