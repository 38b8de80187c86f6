"""Which shapes are near each other: a uniform grid, so that what is far apart costs nothing.

Every step the centres of all bounding circles go into square cells as wide as the greatest of them,
found by hashing; each is looked at beside those in its own cell and the eight around it. Shapes
much larger than the others, lines among them, are looked at beside all. Teschner et al.: Optimized
Spatial Hashing (2003).
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.kernels.contact_geometry import FOUND, LACKING, TESTED, centre_of, rope_spot, touch
from mbody.kernels.contact_shapes import LINE

__all__ = ["PRIMES", "find_contacts", "remember"]

#: Primes of the hashes of cells and of contacts.
PRIMES = (73856093, 19349663, 83492791)
#: Contacts whose gap is a larger part of their size than this are looked for where they come near.
NEAR = 1e-6


@njit
def find_contacts(W, C, B, h):
    """B.who and B.geometry ← all places that may touch within a step of length h, with the
    impulses of the step before.
    """
    B.counts[FOUND] = B.counts[LACKING] = 0
    margins(W, C, B, h)
    for n in range(C.pair.shape[0]):
        a, b, law = C.pair[n, 0], C.pair[n, 1], C.pair[n, 2]
        look(W, C, B, a, b, law)
    for n in range(C.rope.shape[0]):
        i, j = C.rope[n, 0], C.rope[n, 1]
        near = body_margin(B, i, h, C.rope_number[n, 0], C.rope_number[n, 1])
        near += body_margin(B, j, h, C.rope_number[n, 2], C.rope_number[n, 3])
        B.counts[TESTED] += 1
        rope_spot(W, C, B, n, near + NEAR * C.rope_number[n, 4])
    if C.group_law.shape[0] > 0:
        grid(W, C, B)
    recall(B)


@inline
def speed_of(B, b):
    """The greatest speed of a mass centre in this step, and of the angle."""
    v, u, o = B.start, B.free, 3 * b
    along = max(math.hypot(v[o], v[o + 1]), math.hypot(u[o], u[o + 1]))
    return along, max(abs(v[o + 2]), abs(u[o + 2]))


@inline
def body_margin(B, b, h, x, y):
    """How far a point of a body may come in a step."""
    along, turning = speed_of(B, b)
    return h * (along + turning * math.hypot(x, y))


@njit
def margins(W, C, B, h):
    """Centres of all shapes, and how far they may come."""
    for a in range(C.kind.shape[0]):
        b = C.body[a]
        B.place[a, 0], B.place[a, 1] = centre_of(W, C, a)
        along, turning = speed_of(B, b)
        arm = math.hypot(C.centre[a, 0], C.centre[a, 1])
        own = C.reach[a] if C.kind[a] != LINE else 0.0
        B.margin[a] = h * (along + turning * (arm + own)) + NEAR * own
        B.turning[a] = h * turning


@njit
def look(W, C, B, a, b, law):
    """Look whether two shapes, the first as i, are near each other."""
    B.counts[TESTED] += 1
    near = B.margin[a] + B.margin[b]
    dx, dy = B.place[b, 0] - B.place[a, 0], B.place[b, 1] - B.place[a, 1]
    far = math.hypot(dx, dy)
    if C.kind[a] == LINE or C.kind[b] == LINE:
        line, other = (a, b) if C.kind[a] == LINE else (b, a)
        near += B.turning[line] * (far + C.reach[other])
    elif far - C.reach[a] - C.reach[b] >= near:
        return
    touch(W, C, B, a, b, law, near)


@inline
def look_in_groups(W, C, B, a, b):
    """The same of two shapes that groups may bring together."""
    p, q = C.group[a], C.group[b]
    if p < 0 or q < 0 or C.body[a] == C.body[b]:
        return
    law, back = C.group_law[p, q], C.group_law[q, p]
    if (law < 0 and back < 0) or are_tied(C, C.body[a], C.body[b]):
        return
    if law >= 0:
        look(W, C, B, a, b, law)
    else:
        look(W, C, B, b, a, back)


@inline
def are_tied(C, i, j):
    """Whether a joint ties two bodies."""
    found = False
    for n in range(C.tied_start[i], C.tied_start[i + 1]):
        found = found or C.tied[n] == j
    return found


@njit
def grid(W, C, B):
    """Look at pairs of groups that are in neighbouring cells, and at large shapes beside all."""
    shapes, mask = C.kind.shape[0], B.bucket.shape[0] - 1
    side = 0.0
    for a in range(shapes):
        if C.group[a] >= 0 and not C.large[a] and B.margin[a] <= C.reach[a] + C.usual[0]:
            side = max(side, C.reach[a] + B.margin[a])
    side *= 2.0
    for n in range(mask + 1):
        B.bucket[n] = -1
    for a in range(shapes):
        if C.group[a] < 0:
            continue
        if C.large[a] or B.margin[a] > C.reach[a] + C.usual[0]:
            # as large are those that fly farther than they are wide
            B.following[a] = -2
            for b in range(shapes):
                if b != a and not (b < a and B.following[b] == -2):
                    look_in_groups(W, C, B, a, b)
            continue
        B.cell[a, 0] = int(np.floor(B.place[a, 0] / side))
        B.cell[a, 1] = int(np.floor(B.place[a, 1] / side))
        x, y = B.cell[a, 0], B.cell[a, 1]
        for n in range(9):
            cx, cy = x + n % 3 - 1, y + n // 3 - 1
            b = B.bucket[((cx * PRIMES[0]) ^ (cy * PRIMES[1])) & mask]
            while b >= 0:
                if B.cell[b, 0] == cx and B.cell[b, 1] == cy:
                    look_in_groups(W, C, B, b, a)
                b = B.following[b]
        k = ((x * PRIMES[0]) ^ (y * PRIMES[1])) & mask
        B.following[a] = B.bucket[k]
        B.bucket[k] = a


@inline
def place_of(B, a, b, feature):
    """Where the search for a contact of the step before begins."""
    mask = B.old_slot.shape[0] - 1
    return ((a * PRIMES[0]) ^ (b * PRIMES[1]) ^ (feature * PRIMES[2])) & mask


@njit
def recall(B):
    """The impulses of contacts that were there in the step before."""
    who, mask = B.who, B.old_slot.shape[0] - 1
    for c in range(B.counts[FOUND]):
        a, b, feature = who[c, 3], who[c, 4], who[c, 5]
        B.impulse[c, 0] = B.impulse[c, 1] = 0.0
        k = place_of(B, a, b, feature)
        while B.old_slot[k] >= 0:
            n = B.old_slot[k]
            if B.old[n, 0] == a and B.old[n, 1] == b and B.old[n, 2] == feature:
                B.impulse[c, 0], B.impulse[c, 1] = B.old_impulse[n, 0], B.old_impulse[n, 1]
                break
            k = (k + 1) & mask


@njit
def remember(B, part):
    """Keep the contacts of this step for the next one, their impulses times `part`."""
    who, mask = B.who, B.old_slot.shape[0] - 1
    for k in range(mask + 1):
        B.old_slot[k] = -1
    for c in range(B.counts[FOUND]):
        a, b, feature = who[c, 3], who[c, 4], who[c, 5]
        B.old[c, 0], B.old[c, 1], B.old[c, 2] = a, b, feature
        B.old_impulse[c, 0] = part * B.impulse[c, 0]
        B.old_impulse[c, 1] = part * B.impulse[c, 1]
        k = place_of(B, a, b, feature)
        while B.old_slot[k] >= 0:
            k = (k + 1) & mask
        B.old_slot[k] = c
