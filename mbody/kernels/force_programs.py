"""Forces that no equation decides: what balances itself, the greatest least margin, ends of ranges.

All forces f₀ + Z y balance the bodies alike, Z the forces that are in balance with themselves. Of
those that keep every limit g(f) ≥ 0 the one is sought whose least limit is kept by most,

    max θ,   g(f₀ + Z y) ≥ θ,

and of several such ones the least. All is without dimensions, in each part that hangs together by
itself: arms by its own longest, forces by those that must be carried there. The limits of contacts
are linear. Those of pins, ρ |R|, and of guides bend outwards: their tangents lie within them, so
that what a program with tangents finds is admissible, and it is repeated with tangents there.

Limit analysis: Drucker, Prager, Greenberg (1952). Redundant reactions: Wojtyra and Frączek (2013).
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import (
    CONTACT_FORCE_NONE,
    CONTACT_FORCE_SETTLED,
    FORCES_ROOM,
    FORCES_ROOM_MOST,
    LINEAR_PROGRAM_MULTIPLIER,
    LINEAR_PROGRAM_ZERO,
    SINGULAR_VALUE_SHARED_FRICTION,
    TINY,
)
from mbody.kernels.complementarity import lemke_path
from mbody.kernels.friction import law_size
from mbody.kernels.linear_program import (
    LIMITS,
    OPTIMAL,
    UNBOUNDED,
    UNKNOWNS,
    LinearProgram,
    linear_program_memory,
    solve_program,
)

#: Numbers in `OpenForces.count`: of combinations and parts, which are found, and of coordinates,
#: forces, linear limits and pairs of limits that bend.
COMBINATIONS, PARTS, COORDINATES, FORCES, LINES, BENT = range(6)
#: Linear programs with tangents of limits that bend, at most.
PASSES = 8
#: Directions, as parts of a turn, from which pressing forces of bent limits are tried besides.
TURNS = (0.5, 0.25, 0.75, 0.125, 0.875, 0.375, 0.625)


class OpenForces(Bundle):
    """Memory of at most f forces on c coordinates with m linear limits and b pairs that bend.

    Limits are numbered: linear ones, then two of each that bends, of sliding forwards and back.
    """

    count: Ints
    column: Rows  # (c, f): generalised forces, (x, y, torque about the mass centre) of every body
    force: Floats  # (f,): present ones
    own: Ints  # (f,): whether they are of contacts and friction
    line: Rows  # (m, f): line · f + given ≥ 0
    given: Floats
    relative: Ints  # (m,): whether a limit is a part of itself, no force
    counts: Floats  # (m,): 1, or 0 where its margin does not count
    bent: Tables  # (b, 4): the force that is limited, both that press (−1 none), kind of friction
    arm: Rows  # (b, 6): numbers of `law_size`, sliding forwards and back
    length: Floats  # (b,): by which friction is divided, so that it is a force
    # combinations that balance themselves, part by part
    unit: Floats  # (f,): by what forces are divided, so that they are alike
    free: Rows  # (combinations ≤ f, f): orthonormal in these units
    first: Ints  # (parts + 1 ≤ f + 1,): first combination of each part
    start: Floats  # (combinations,): the least forces that balance the same, from the present ones
    size: Floats  # (parts,): the greatest force that must be carried
    moves: Tables  # (parts, limits): which limits change
    # what was found of them
    least: Floats  # (parts,): the greatest least margin, as a part of that force
    y: Floats  # (combinations,): where, in forces
    active: Tables  # (parts, limits): which limits stop it
    # memory
    label: Ints
    member: Ints
    vector: Rows  # (f + c, f)
    base: Rows  # (f, f)
    product: Rows  # (f, f)
    now: Floats  # (f,)
    by: Floats
    value: Floats  # (limits,)
    gradient: Rows  # (limits, f)
    z: Floats
    best: Floats
    H: Rows  # (rows, f)
    h: Floats
    slack: Floats
    chosen: Ints
    picked: Ints
    stop: Ints
    A: Rows
    q: Floats
    multiplier: Floats
    table: Rows
    basis: Ints


def open_forces_memory(c: int, f: int, m: int, b: int) -> tuple[OpenForces, LinearProgram]:
    """Memory for so many coordinates, forces, linear limits and pairs of limits that bend."""
    limits = m + 2 * b
    rows = limits + 2 * f + 1

    def zeros(*shape: int) -> np.ndarray:
        return np.zeros(shape)

    def ints(*shape: int) -> np.ndarray:
        return np.zeros(shape, dtype=np.int64)

    memory = OpenForces(
        count=np.array([0, 0, c, f, m, b]), column=zeros(c, f), force=zeros(f), own=ints(f),
        line=zeros(m, f), given=zeros(m), relative=ints(m), counts=zeros(m), bent=ints(b, 4),
        arm=zeros(b, 6), length=zeros(b), unit=zeros(f), free=zeros(f, f),
        first=ints(f + 1), start=zeros(f), size=zeros(f), moves=ints(f, limits),
        least=zeros(f), y=zeros(f), active=ints(f, limits), label=ints(f), member=ints(f),
        vector=zeros(f + c, f), base=zeros(f, f), product=zeros(f, f), now=zeros(f), by=zeros(f),
        value=zeros(limits), gradient=zeros(limits, f), z=zeros(f), best=zeros(f),
        H=zeros(rows, f), h=zeros(rows), slack=zeros(rows), chosen=ints(rows), picked=ints(rows),
        stop=ints(limits), A=zeros(rows, rows), q=zeros(rows), multiplier=zeros(rows),
        table=zeros(rows, 2 * rows + 2), basis=ints(rows),
    )  # fmt: skip
    return memory, linear_program_memory(f + 1, rows)


@inline
def limits_of(S):
    """How many limits there are."""
    return S.count[LINES] + 2 * S.count[BENT]


# -- Forces in balance with themselves ---------------------------------------------------------


@njit
def orthonormal(V, count, d, Q, found, most, least):
    """Rows of Q ← orthonormal ones that span those of V (count, d), the largest first, after those
    `found` there already: up to `most` of them, each larger than `least`, of vectors above 1 such a
    part; how many there are then. V is lost.
    """
    while found < most:
        size, at = 0.0, -1
        for i in range(count):
            total = 0.0
            for k in range(d):
                total += V[i, k] * V[i, k]
            if total > size:
                size, at = total, i
        size = math.sqrt(size)
        if found == 0:
            least *= max(1.0, size)
        if at < 0 or size <= least:
            break
        for k in range(d):
            Q[found, k] = V[at, k] / size
        for i in range(found):
            along = 0.0
            for k in range(d):
                along += Q[i, k] * Q[found, k]
            for k in range(d):
                Q[found, k] -= along * Q[i, k]
        size = 0.0
        for k in range(d):
            size += Q[found, k] * Q[found, k]
        size = math.sqrt(size)
        for k in range(d):
            Q[found, k] /= size
        for i in range(count):
            along = 0.0
            for k in range(d):
                along += Q[found, k] * V[i, k]
            for k in range(d):
                V[i, k] -= along * Q[found, k]
        found += 1
    return found


@njit
def complement(V, d, Q, found):
    """The rows of Q that are orthogonal to the first, up to d of them; V is lost."""
    for i in range(d):
        for k in range(d):
            V[i, k] = 1.0 if i == k else 0.0
            for n in range(found):
                V[i, k] -= Q[n, i] * Q[n, k]
    return orthonormal(V, d, d, Q, found, d, 0.0)


@inline
def acts(S, b, k):
    """Whether force k acts on body b."""
    c = S.column
    return c[3 * b, k] != 0.0 or c[3 * b + 1, k] != 0.0 or c[3 * b + 2, k] != 0.0


@njit
def label_by_bodies(S):
    """S.label ← the least number of the forces that hang together with each by bodies."""
    f, changed = S.count[FORCES], True
    for k in range(f):
        S.label[k] = k
    while changed:
        changed = False
        for b in range(S.count[COORDINATES] // 3):
            low = f
            for k in range(f):
                if acts(S, b, k):
                    low = min(low, S.label[k])
            for k in range(f):
                if acts(S, b, k) and S.label[k] > low:
                    S.label[k], changed = low, True


@njit
def balanced(S):
    """S.free ← combinations that balance themselves, S.unit; how many there are."""
    f, c, found = S.count[FORCES], S.count[COORDINATES], 0
    label_by_bodies(S)
    for which in range(f):
        count, length = 0, 0.0
        for k in range(f):
            if S.label[k] != which:
                continue
            S.unit[k], linear, torque = 1.0, 0.0, 0.0
            for i in range(c):
                if i % 3 == 2:
                    torque = max(torque, abs(S.column[i, k]))
                else:
                    linear += S.column[i, k] * S.column[i, k]
            if linear > 0.0:
                length = max(length, torque / math.sqrt(linear))
            if linear > 0.0 or torque > 0.0:
                S.member[count] = k
                count += 1
        length = length if length > 0.0 else 1.0
        for n in range(count):
            k, total = S.member[n], 0.0
            for i in range(c):
                part = S.column[i, k] / (length if i % 3 == 2 else 1.0)
                S.vector[i, n] = part
                total += part * part
            S.unit[k] = 1.0 / math.sqrt(total)
            for i in range(c):
                S.vector[i, n] *= S.unit[k]
        least = SINGULAR_VALUE_SHARED_FRICTION
        rank = orthonormal(S.vector, c, count, S.base, 0, count, least)
        if count > rank:
            complement(S.vector, count, S.base, rank)
        for i in range(rank, count):
            for k in range(f):
                S.free[found, k] = 0.0
            for n in range(count):
                S.free[found, S.member[n]] = S.base[i, n]
            found += 1
    return found


@njit
def with_own(S, found):
    """Of so many combinations those among which none of `own` is left out; how many there are."""
    f, count = S.count[FORCES], 0
    for k in range(f):
        if S.own[k]:
            for i in range(found):
                S.vector[count, i] = S.free[i, k]
            count += 1
    if count == f or found == 0:
        return found
    least = SINGULAR_VALUE_SHARED_FRICTION
    rank = orthonormal(S.vector, count, found, S.base, 0, found, least)
    for i in range(rank):
        for k in range(f):
            S.product[i, k] = 0.0
            for n in range(found):
                S.product[i, k] += S.base[i, n] * S.free[n, k]
    for i in range(rank):
        for k in range(f):
            S.free[i, k] = S.product[i, k]
    return rank


@inline
def depends(S, i, k):
    """Whether limit i depends on force k."""
    m = S.count[LINES]
    if i < m:
        return S.line[i, k] != 0.0
    n = (i - m) // 2
    return k == S.bent[n, 0] or k == S.bent[n, 1] or k == S.bent[n, 2]


@njit
def label_by_limits(S, found):
    """S.product ← the projection on so many combinations, S.label ← the least number of the forces
    that hang together with each by these and by limits, −1 of what does not move; how many there
    are that hang together.
    """
    f, limits, changed, parts = S.count[FORCES], limits_of(S), True, 0
    for k in range(f):
        S.label[k] = -1
        for n in range(f):
            total = 0.0
            for i in range(found):
                total += S.free[i, k] * S.free[i, n]
            S.product[k, n] = total
            if abs(total) > SINGULAR_VALUE_SHARED_FRICTION:
                S.label[k] = k
    while changed:
        changed = False
        for i in range(f + limits):
            low = f
            for k in range(f):
                if S.label[k] >= 0 and joined(S, i, k):
                    low = min(low, S.label[k])
            for k in range(f):
                if S.label[k] > low and joined(S, i, k):
                    S.label[k], changed = low, True
    for k in range(f):
        parts += 1 if S.label[k] == k else 0
    return parts


@inline
def joined(S, i, k):
    """Whether force k hangs together with force i or, after the forces, with what limit i holds."""
    f = S.count[FORCES]
    if i >= f:
        return depends(S, i - f, k)
    return abs(S.product[i, k]) > SINGULAR_VALUE_SHARED_FRICTION


@njit
def open_parts(S):
    """S.free, S.unit ← combinations of forces that balance themselves, part by part; of each its
    start, size and limits.
    """
    f, limits = S.count[FORCES], limits_of(S)
    found = with_own(S, balanced(S))
    parts = label_by_limits(S, found) if found else 0
    for i in range(found):
        for k in range(f):
            if abs(S.free[i, k]) <= SINGULAR_VALUE_SHARED_FRICTION:
                S.free[i, k] = 0.0  # rounding, which light bodies feel
    place, n = 0, 0
    for which in range(f if parts else 0):
        if S.label[which] != which:
            continue
        S.first[n] = place
        if parts == 1:
            place = found
        else:
            trace, count = 0.0, 0
            for k in range(f):
                if S.label[k] == which:
                    trace += S.product[k, k]
                    for i in range(f):
                        S.vector[count, i] = S.product[k, i] if S.label[i] == which else 0.0
                    count += 1
            most = place + int(trace + 0.5)
            # those of other parts are orthogonal already
            place = orthonormal(S.vector, count, f, S.base, place, most, 0.0)
        n += 1
    if parts > 1:
        for i in range(place):
            for k in range(f):
                S.free[i, k] = S.base[i, k]
    S.first[n], S.count[COMBINATIONS], S.count[PARTS] = place, place, n
    n = 0
    for which in range(f if parts else 0):
        if S.label[which] == which:
            carried(S, n, which, limits)
            n += 1


@njit
def carried(S, n, which, limits):
    """S.start, S.moves, S.size of part n, whose forces have this label."""
    f, size, present = S.count[FORCES], 0.0, 0.0
    for k in range(f):
        S.now[k] = S.force[k] / S.unit[k]
        S.member[k] = 1 if S.label[k] == which else 0
    for i in range(limits):
        S.moves[n, i] = 0
        for k in range(f):
            if S.label[k] == which and depends(S, i, k):
                S.moves[n, i] = 1
        for k in range(f if S.moves[n, i] else 0):
            if depends(S, i, k):
                S.member[k] = 1
    for i in range(S.first[n], S.first[n + 1]):
        along = 0.0
        for k in range(f):
            along += S.free[i, k] * (S.force[k] / S.unit[k])
        S.start[i] = -along
        for k in range(f):
            S.now[k] -= along * S.free[i, k]
    for k in range(f):
        if S.member[k]:
            size = max(size, abs(S.now[k]))
            present = max(present, abs(S.force[k] / S.unit[k]))
    size = size if size > 0.0 else present
    S.size[n] = max(size, TINY)


# -- Limits ------------------------------------------------------------------------------------


@njit
def place_of(S, n, z):
    """S.now ← the forces with those of part n that are z times its size from its start."""
    for k in range(S.count[FORCES]):
        total, first = 0.0, S.first[n]
        for i in range(first, S.first[n + 1]):
            total += S.free[i, k] * (S.start[i] + S.size[n] * z[i - first])
        S.now[k] = S.force[k] + S.unit[k] * total


@njit
def gradients(S, n, turn):
    """S.gradient, S.value ← the limits of part n by their tangents at the forces S.now, at pressing
    forces turned by so much, both as parts of what it carries; by its combinations.
    """
    m, f, first, last = S.count[LINES], S.count[FORCES], S.first[n], S.first[n + 1]
    c, s = math.cos(turn), math.sin(turn)
    for i in range(limits_of(S)):
        if not S.moves[n, i]:
            continue
        for k in range(f):
            S.by[k] = S.line[i, k] if i < m else 0.0
        if i < m:
            value, per = S.given[i], 1.0 if S.relative[i] else S.size[n]
            for k in range(f):
                value += S.line[i, k] * S.now[k]
        else:
            b, back = (i - m) // 2, (i - m) % 2
            p, q, slip = S.bent[b, 1], S.bent[b, 2], 1.0 - 2.0 * back
            here, there = S.now[p] if p >= 0 else 0.0, S.now[q] if q >= 0 else 0.0
            x, y, o = c * here - s * there, s * here + c * there, 3 * back
            value, by_x, by_y = law_size(
                S.bent[b, 3], S.arm[b, o], S.arm[b, o + 1], S.arm[b, o + 2], x, y
            )
            value += by_x * (here - x) + by_y * (there - y) + slip * S.now[S.bent[b, 0]]
            if p >= 0:
                S.by[p] += by_x
            if q >= 0:
                S.by[q] += by_y
            S.by[S.bent[b, 0]] += slip
            per = S.length[b] * S.size[n]
        S.value[i] = value / per
        for a in range(first, last):
            total = 0.0
            for k in range(f):
                total += S.by[k] * (S.free[a, k] * S.unit[k])
            total *= S.size[n] / per
            S.gradient[i, a - first] = total if abs(total) > CONTACT_FORCE_NONE else 0.0


# -- The greatest least margin -----------------------------------------------------------------


@njit
def program_of(S, P, n, at, most, room):
    """P ← the program of part n by S.gradient and S.value, which are those at combinations `at`
    from its start, as parts of its size; how many of its limits are no bounds of the forces, and by
    how much its θ is less than the margin.
    """
    f, m, first = S.count[FORCES], S.count[LINES], S.first[n]
    d, rows, begin = S.first[n + 1] - first, 0, most
    for i in range(limits_of(S)):
        if S.moves[n, i]:
            P.A[rows, d] = S.counts[i] if i < m else 1.0
            P.b[rows] = S.value[i]
            for a in range(d):
                P.A[rows, a] = -S.gradient[i, a]
                P.b[rows] -= S.gradient[i, a] * at[a]
            if P.A[rows, d] > 0.0:
                begin = min(begin, P.b[rows])
            rows += 1
    limits = rows
    for r in range(limits):
        P.b[r] -= P.A[r, d] * begin
    for k in range(f):
        size, there = 0.0, S.force[k] / S.unit[k]
        for a in range(first, first + d):
            size += S.free[a, k] * S.free[a, k]
            there += S.free[a, k] * S.start[a]
        if math.sqrt(size) > SINGULAR_VALUE_SHARED_FRICTION:
            for side in range(2):
                sign = 1.0 - 2.0 * side
                for a in range(d):
                    P.A[rows, a] = sign * S.free[first + a, k]
                P.A[rows, d], P.b[rows] = 0.0, room - sign * there / S.size[n]
                rows += 1
    for a in range(d):
        P.A[rows, a] = P.aim[a] = 0.0
    P.A[rows, d], P.aim[d], P.b[rows] = 1.0, 1.0, most - begin
    P.count[UNKNOWNS], P.count[LIMITS] = d + 1, rows + 1
    return limits, begin


@njit
def all_that_stop(P, d):
    """Of one combination all limits that go through its peak count as active."""
    rows, peak = P.count[LIMITS] - 1, False
    for r in range(rows):
        peak = peak or (P.load[r] > 0.0 and P.A[r, 0] != 0.0)
    if d != 1 or not peak:
        return
    size, moved = 0.0, 0.0
    for r in range(rows):
        size, moved = max(size, abs(P.b[r])), max(moved, abs(P.A[r, 0] * P.x[0]))
    for r in range(rows):
        slack = P.b[r] - P.A[r, 0] * P.x[0] - P.A[r, 1] * P.x[1]
        on = P.A[r, 0] != 0.0 and slack <= CONTACT_FORCE_SETTLED * (size + moved)
        P.load[r] = 1.0 if on else 0.0


@njit
def margin(S, P, n, most, room, turn, settle):
    """The greatest least margin of part n up to `most`, with forces up to `room`, both as parts of
    what it carries, from tangents at pressing forces that are turned by so much; with `settle` at
    the least of several such. S.z, S.stop; whether the size of forces stops it.
    """
    first, best, wedged, bends = S.first[n], -math.inf, False, S.count[BENT] > 0
    d = S.first[n + 1] - first
    for a in range(d):
        S.z[a] = 0.0 if turn != 0.0 else -S.start[first + a] / S.size[n]
    for i in range(limits_of(S)):
        S.stop[i] = 0
    for step in range(PASSES):
        place_of(S, n, S.z)
        gradients(S, n, 0.0 if step else turn)
        limits, begin = program_of(S, P, n, S.z, most, room)
        if solve_program(P) != OPTIMAL or begin + P.x[d] <= best + CONTACT_FORCE_SETTLED:
            break
        best, wedged, largest, row = begin + P.x[d], False, 0.0, 0
        all_that_stop(P, d)
        for r in range(P.count[LIMITS] - 1):
            largest = max(largest, P.load[r])
        for r in range(limits, P.count[LIMITS] - 1):
            wedged = wedged or counted(P, r, largest)
        if settle:
            settled(S, P, d, largest)
        for a in range(d):
            S.z[a] = P.x[a]
        for i in range(limits_of(S)):
            if S.moves[n, i]:
                S.stop[i] = 1 if counted(P, row, largest) else 0
                row += 1
        if not bends:
            break
    return best, wedged


@inline
def counted(P, r, largest):
    """Whether limit r has a multiplier, by the largest of all."""
    return P.load[r] > LINEAR_PROGRAM_MULTIPLIER * largest


@njit
def settled(S, P, d, largest):
    """P.x ← of all combinations with these margins that of the least forces."""
    rows, least, H, v, count = P.count[LIMITS] - 1, 0.0, S.H, S.best, 0
    for r in range(rows):
        S.slack[r] = P.b[r] - P.A[r, d] * P.x[d]
        for a in range(d):
            S.slack[r] -= P.A[r, a] * P.x[a]
        least = min(least, S.slack[r])
        if counted(P, r, largest):
            for a in range(d):
                S.vector[count, a] = P.A[r, a]
            count += 1
            if d == 1:
                return
    rank = orthonormal(S.vector, count, d, S.base, 0, d, SINGULAR_VALUE_SHARED_FRICTION)
    if rank == d:
        return
    complement(S.vector, d, S.base, rank)
    free = d - rank
    for i in range(free):
        v[i] = 0.0
        for a in range(d):
            v[i] -= S.base[rank + i, a] * P.x[a]
    for r in range(rows):
        size, S.chosen[r] = 0.0, 0
        for i in range(free):
            H[r, i] = 0.0
            for a in range(d):
                H[r, i] -= P.A[r, a] * S.base[rank + i, a]
            size += H[r, i] * H[r, i]
        size = math.sqrt(size)
        if size <= SINGULAR_VALUE_SHARED_FRICTION:
            S.chosen[r] = -1
            continue
        S.h[r] = (-CONTACT_FORCE_NONE - S.slack[r]) / size
        for i in range(free):
            H[r, i] /= size
    if not nearest(S, rows, free):
        return
    for a in range(d):
        S.by[a] = 0.0
        for i in range(free):
            S.by[a] += S.base[rank + i, a] * v[i]
    for r in range(rows):
        kept = S.slack[r]
        for a in range(d):
            kept -= P.A[r, a] * S.by[a]
        if kept < least - CONTACT_FORCE_NONE - CONTACT_FORCE_SETTLED:
            return
    for a in range(d):
        P.x[a] += S.by[a]


@njit
def nearest(S, rows, d):
    """S.best ← the nearest place to it with H · place ≥ h in all rows but those whose S.chosen is
    below zero; whether one was found. Rows of S.H have the length 1.

    By the multipliers of the rows that it does not keep; of all that are not kept then, again.
    """
    H, h, v = S.H, S.h, S.best
    for a in range(d):
        S.by[a] = v[a]
    while True:
        count, more, size = 0, False, 1.0
        for a in range(d):
            size = max(size, abs(v[a]))
        for r in range(rows):
            if S.chosen[r] == 0:
                kept = -h[r]
                for a in range(d):
                    kept += H[r, a] * v[a]
                if kept < -LINEAR_PROGRAM_ZERO * size:
                    S.chosen[r], more = 1, True
            if S.chosen[r] == 1:
                S.picked[count] = r
                count += 1
        if not more:
            return True
        for i in range(count):
            r = S.picked[i]
            S.q[i] = -h[r]
            for a in range(d):
                S.q[i] += H[r, a] * S.by[a]
            for j in range(count):
                S.A[i, j] = 0.0
                for a in range(d):
                    S.A[i, j] += H[r, a] * H[S.picked[j], a]
        if not lemke_path(S.A, S.q, S.multiplier, S.table, S.basis, count, 0):
            return False
        for a in range(d):
            v[a] = S.by[a]
            for i in range(count):
                v[a] += S.multiplier[i] * H[S.picked[i], a]


@njit
def keep(S, n, least):
    """S.least, S.y, S.active of part n ← what `margin` has found."""
    first = S.first[n]
    S.least[n] = least
    for a in range(first, S.first[n + 1]):
        S.y[a] = S.start[a] + S.size[n] * S.z[a - first]
    for i in range(limits_of(S)):
        S.active[n, i] = S.stop[i]


@njit
def greatest_margin(S, P, n, most, settle):
    """S.least, S.y, S.active of part n: the greatest least margin up to `most`."""
    best, wedged = margin(S, P, n, most, FORCES_ROOM_MOST, 0.0, settle)
    keep(S, n, best)
    for k in range(len(TURNS) if S.count[BENT] > 0 and best < 0.0 else 0):
        least, by_size = margin(S, P, n, most, FORCES_ROOM_MOST, 2.0 * math.pi * TURNS[k], settle)
        if least > best + CONTACT_FORCE_SETTLED:
            best, wedged = least, by_size
            keep(S, n, best)
    if wedged and settle:
        least, _ = margin(S, P, n, most, FORCES_ROOM, 0.0, settle)
        if least >= 0.0:
            keep(S, n, least)


@njit
def share(S, P, most, settle):
    """The parts of the forces that no equation decides, how many; of each its greatest least margin
    up to `most` and where, the least forces of several such ones with `settle`.
    """
    open_parts(S)
    for n in range(S.count[PARTS]):
        greatest_margin(S, P, n, most, settle)
    return S.count[PARTS]


@kernel
def share_forces(S: OpenForces, P: LinearProgram, most: float, settle: bool) -> int:
    """See `share`."""
    return share(S, P, most, settle)


@kernel
def parts_of_forces(S: OpenForces) -> int:
    """The parts of the forces that no equation decides, how many."""
    open_parts(S)
    return S.count[PARTS]


# -- Ends of ranges ----------------------------------------------------------------------------


@kernel
def far_end(S: OpenForces, P: LinearProgram, n: int, aim: Floats) -> bool:
    """S.y ← the combinations of part n, from the present forces, at which aim · y is greatest
    within the limits, by tangents where they bend; False without a bound.
    """
    first, size, best = S.first[n], 0.0, 0.0
    d = S.first[n + 1] - first
    for a in range(d):
        size += aim[a] * aim[a]
        S.z[a] = -S.start[first + a] / S.size[n]
        S.y[first + a] = 0.0
    size = math.sqrt(size)
    for _ in range(PASSES):
        place_of(S, n, S.z)
        gradients(S, n, 0.0)
        rows = 0
        for i in range(limits_of(S)):
            if S.moves[n, i]:
                # what is there counts as within
                P.b[rows] = max(S.value[i], 0.0)
                for a in range(d):
                    P.A[rows, a] = -S.gradient[i, a]
                rows += 1
        gained = 0.0
        for a in range(d):
            P.aim[a] = aim[a] / size
            gained += P.aim[a] * S.y[first + a] / S.size[n]
        P.count[UNKNOWNS], P.count[LIMITS] = d, rows
        found = solve_program(P)
        if found == UNBOUNDED:
            return False
        for a in range(d):
            gained += P.aim[a] * P.x[a]
        if found != OPTIMAL or gained <= best + CONTACT_FORCE_SETTLED:
            break
        best = gained
        for a in range(d):
            S.z[a] += P.x[a]
            S.y[first + a] = S.start[first + a] + S.size[n] * S.z[a]
        if S.count[BENT] == 0:
            break
    return True
