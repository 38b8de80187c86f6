"""Where two shapes touch, or nearly so: normal, point and gap of every place.

Circles touch circles, lines, segments and polygons; corners touch lines and rings. Two polygons
touch along the edge that separates them most (or is least overlapped), on which the nearest edge of
the other is clipped: at most two places, of one normal. Ericson: Real-Time Collision Detection
(2005), 5.5.

A pair is (x, y, law, near, swapped): the normal goes from shape x to shape y; y is the contact's i
where it is swapped.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.kernels.contact_shapes import CIRCLE, LINE, POLYGON, SEGMENT

__all__ = ["FOUND", "LACKING", "TESTED", "rope_spot", "touch"]

#: Counts of a step: contacts found; contacts for which there was no memory; pairs looked at.
FOUND, LACKING, TESTED = range(3)
#: How far a corner may be behind a segment, in parts of it, before it is on its other side.
BEHIND = 0.1
#: The other polygon's edge is taken where it separates more by this part of both sizes.
PREFERRED = 1e-7
#: Numbers of edges and corners, of those of the other shape, and of corners that circles touch.
OTHER, CORNER = 4096, 8192


@inline
def to_world(W, b, x, y):
    """A point of body b from its mass centre, in world axes."""
    c, s = W.turn[2 * b, 0], W.turn[2 * b + 1, 0]
    return W.q[3 * b, 0] + c * x - s * y, W.q[3 * b + 1, 0] + s * x + c * y


@inline
def corners_of(C, a):
    """How many corners a shape has."""
    return C.corner_start[a + 1] - C.corner_start[a]


@inline
def corner_at(W, C, a, n):
    """Corner n of shape a, round about, in world axes."""
    k = C.corner_start[a] + n % corners_of(C, a)
    return to_world(W, C.body[a], C.corner[k, 0], C.corner[k, 1])


@inline
def centre_of(W, C, a):
    """The centre of a shape in world axes."""
    return to_world(W, C.body[a], C.centre[a, 0], C.centre[a, 1])


@inline
def edge_of(W, C, a, n):
    """Beginning, direction, outward normal and length of edge n of shape a."""
    ax, ay = corner_at(W, C, a, n)
    bx, by = corner_at(W, C, a, n + 1)
    dx, dy = bx - ax, by - ay
    length = math.hypot(dx, dy)
    ux, uy = dx / length, dy / length
    return ax, ay, ux, uy, uy, -ux, length


@njit
def put(W, C, B, pair, feature, normal, point, gap):
    """Store a contact."""
    x, y, law, _, swapped = pair
    nx, ny = normal
    i, j = x, y
    if swapped:
        i, j, nx, ny = y, x, -nx, -ny
    size = math.inf
    for a in (i, j):
        if C.reach[a] > 0.0:
            size = min(size, C.reach[a])
    place(W, B, (C.body[i], C.body[j], law, i, j, feature), (nx, ny), point, gap, size)


@njit
def place(W, B, who, normal, point, gap, size):
    """Store a contact of bodies i and j; `who`: these, its law, its shapes and feature."""
    count = B.counts[FOUND]
    if count >= B.who.shape[0]:
        B.counts[LACKING] += 1
        return
    B.counts[FOUND] = count + 1
    i, j, law, a, b, feature = who
    table, geometry = B.who, B.geometry
    table[count, 0], table[count, 1], table[count, 2] = i, j, law
    table[count, 3], table[count, 4], table[count, 5] = a, b, feature
    geometry[count, 0], geometry[count, 1] = normal[0], normal[1]
    geometry[count, 2], geometry[count, 3] = point[0] - W.q[3 * i, 0], point[1] - W.q[3 * i + 1, 0]
    geometry[count, 4], geometry[count, 5] = point[0] - W.q[3 * j, 0], point[1] - W.q[3 * j + 1, 0]
    geometry[count, 6], geometry[count, 7] = gap, size


@njit
def touch(W, C, B, a, b, law, near):
    """Store the places where shapes a and b are nearer than `near`, normals from a to b."""
    ka, kb = C.kind[a], C.kind[b]
    straight, turned = (a, b, law, near, False), (b, a, law, near, True)
    if ka == CIRCLE and kb == CIRCLE:
        centre, ring = centre_of(W, C, b), C.radius[b]
        round_pair(W, C, B, straight, (centre[0], centre[1], ring, 0))
    elif ka == CIRCLE:
        circle_on(W, C, B, turned)
    elif kb == CIRCLE:
        circle_on(W, C, B, straight)
    elif ka == LINE:
        if kb != LINE:
            corners_on_line(W, C, B, straight)
    elif kb == LINE:
        corners_on_line(W, C, B, turned)
    elif ka == SEGMENT and kb == SEGMENT:
        ends_on_segment(W, C, B, straight)
        ends_on_segment(W, C, B, turned)
    else:
        polygons(W, C, B, straight, turned)


@njit
def round_pair(W, C, B, pair, other):
    """Circle x and another circle, or a corner, of y: `other` is its (x, y), radius and feature."""
    x, _, _, near, _ = pair
    bx, by, rb, feature = other
    ax, ay = centre_of(W, C, x)
    ra = C.radius[x]
    dx, dy = bx - ax, by - ay
    far = math.hypot(dx, dy)
    ux, uy = (dx / far, dy / far) if far > 0.0 else (0.0, 1.0)
    if ra < 0.0 or rb < 0.0:  # one within the other
        gap = abs(ra + rb) - far
        if gap < near:
            # on the rim of the ring, half way to what it holds
            out = -ra - 0.5 * gap
            put(W, C, B, pair, feature, (-ux, -uy), (ax + out * ux, ay + out * uy), gap)
        return
    gap = far - ra - rb
    if gap < near:
        out = ra + 0.5 * gap
        put(W, C, B, pair, feature, (ux, uy), (ax + out * ux, ay + out * uy), gap)


@njit
def circle_on(W, C, B, pair):
    """Circle y on a shape x with straight edges, or the corners of x within a ring y."""
    x, y, law, near, swapped = pair
    r = C.radius[y]
    if C.kind[x] == LINE:
        if r >= 0.0:
            cx, cy = centre_of(W, C, y)
            point_on_line(W, C, B, pair, (cx, cy, r, 0))
    elif r < 0.0:
        for n in range(corners_of(C, x)):
            px, py = corner_at(W, C, x, n)
            round_pair(W, C, B, (y, x, law, near, not swapped), (px, py, 0.0, n))
    else:
        circle_on_polygon(W, C, B, pair)


@njit
def point_on_line(W, C, B, pair, point):
    """A circle or corner of y on the endless line x; `point` is its (x, y), radius and feature."""
    x, _, _, near, _ = pair
    cx, cy, r, feature = point
    body = C.body[x]
    c, s = W.turn[2 * body, 0], W.turn[2 * body + 1, 0]
    ux, uy = c * C.along[x, 0] - s * C.along[x, 1], s * C.along[x, 0] + c * C.along[x, 1]
    ax, ay = centre_of(W, C, x)
    nx, ny = -uy, ux
    gap = nx * (cx - ax) + ny * (cy - ay) - r
    if gap < near:
        out = r + 0.5 * gap
        put(W, C, B, pair, feature, (nx, ny), (cx - out * nx, cy - out * ny), gap)


@njit
def corners_on_line(W, C, B, pair):
    """The corners of y on the endless line x."""
    for n in range(corners_of(C, pair[1])):
        px, py = corner_at(W, C, pair[1], n)
        point_on_line(W, C, B, pair, (px, py, 0.0, n))


@njit
def circle_on_polygon(W, C, B, pair):
    """Circle y on segment or convex polygon x: on an edge, or on a corner."""
    x, y, _, near, _ = pair
    cx, cy = centre_of(W, C, y)
    r = C.radius[y]
    best, widest = 0, -math.inf
    single = C.kind[x] == SEGMENT
    for n in range(1 if single else corners_of(C, x)):
        ax, ay, _, _, nx, ny, _ = edge_of(W, C, x, n)
        gap = nx * (cx - ax) + ny * (cy - ay)
        if gap > widest:
            best, widest = n, gap
    if widest - r >= near:
        return
    ax, ay, ux, uy, nx, ny, length = edge_of(W, C, x, best)
    s = ux * (cx - ax) + uy * (cy - ay)
    within = 0.0 <= s <= length
    if single and within and widest < (-BEHIND * length if r == 0.0 else -r):
        return
    if within or (C.kind[x] == POLYGON and widest <= 0.0):
        gap = widest - r
        out = r + 0.5 * gap
        put(W, C, B, pair, best, (nx, ny), (cx - out * nx, cy - out * ny), gap)
        return
    if r == 0.0:  # a corner and a point do not touch
        return
    k = best if s < 0.0 else best + 1
    ax, ay = corner_at(W, C, x, k)
    dx, dy = cx - ax, cy - ay
    far = math.hypot(dx, dy)
    gap = far - r
    if gap < near and far > 0.0:
        nx, ny = dx / far, dy / far
        point = ax + 0.5 * gap * nx, ay + 0.5 * gap * ny
        put(W, C, B, pair, CORNER + k % corners_of(C, x), (nx, ny), point, gap)


@njit
def ends_on_segment(W, C, B, pair):
    """The ends of segment y on segment x."""
    x, y, _, near, swapped = pair
    ax, ay, ux, uy, nx, ny, length = edge_of(W, C, x, 0)
    for n in range(2):
        px, py = corner_at(W, C, y, n)
        s, gap = ux * (px - ax) + uy * (py - ay), nx * (px - ax) + ny * (py - ay)
        if 0.0 <= s <= length and -BEHIND * length < gap < near:
            point = px - 0.5 * gap * nx, py - 0.5 * gap * ny
            put(W, C, B, pair, n + (OTHER if swapped else 0), (nx, ny), point, gap)


@njit
def polygons(W, C, B, pair, turned):
    """Two convex polygons, or a polygon and a segment; the pair both ways round."""
    a, b, _, near, _ = pair
    if C.kind[a] == SEGMENT and behind(W, C, a, b):
        return
    if C.kind[b] == SEGMENT and behind(W, C, b, a):
        return
    edge_a, gap_a = widest_edge(W, C, a, b, near)
    if gap_a >= near:
        return
    edge_b, gap_b = widest_edge(W, C, b, a, near)
    if gap_b >= near:
        return
    if gap_b > gap_a + PREFERRED * (C.reach[a] + C.reach[b]):
        clipped(W, C, B, turned, edge_b)
    else:
        clipped(W, C, B, pair, edge_a)


@njit
def behind(W, C, x, y):
    """Whether polygon y is on the far side of segment x."""
    ax, ay, _, _, nx, ny, _ = edge_of(W, C, x, 0)
    cx, cy = centre_of(W, C, y)
    return nx * (cx - ax) + ny * (cy - ay) < 0.0


@njit
def widest_edge(W, C, x, y, near):
    """The edge of x from which y is farthest, and how far."""
    best, widest = 0, -math.inf
    for n in range(corners_of(C, x)):
        ax, ay, _, _, nx, ny, _ = edge_of(W, C, x, n)
        least = math.inf
        for k in range(corners_of(C, y)):
            px, py = corner_at(W, C, y, k)
            least = min(least, nx * (px - ax) + ny * (py - ay))
        if least > widest:
            best, widest = n, least
            if widest >= near:
                break
    return best, widest


@njit
def clipped(W, C, B, pair, edge):
    """The edge of y that faces an edge of x, clipped to its length: those ends that are near."""
    x, y, _, near, swapped = pair
    ax, ay, ux, uy, nx, ny, length = edge_of(W, C, x, edge)
    facing, least = 0, math.inf
    for k in range(corners_of(C, y)):
        _, _, _, _, mx, my, _ = edge_of(W, C, y, k)
        if nx * mx + ny * my < least:
            facing, least = k, nx * mx + ny * my
    px, py = corner_at(W, C, y, facing)
    qx, qy = corner_at(W, C, y, facing + 1)
    s0, g0 = ux * (px - ax) + uy * (py - ay), nx * (px - ax) + ny * (py - ay)
    s1, g1 = ux * (qx - ax) + uy * (qy - ay), nx * (qx - ax) + ny * (qy - ay)
    if max(s0, s1) < 0.0 or min(s0, s1) > length:
        return
    for k in range(2):
        s, gap = (s0, g0) if k == 0 else (s1, g1)
        bounded = min(max(s, 0.0), length)
        if bounded != s:
            gap = g0 + (g1 - g0) * (bounded - s0) / (s1 - s0)
        if k == 1 and s1 == s0:  # the edge is seen end on: one place
            return
        if gap < near:
            point = ax + bounded * ux + 0.5 * gap * nx, ay + bounded * uy + 0.5 * gap * ny
            feature = 2 * edge + k + (OTHER if swapped else 0)
            put(W, C, B, pair, feature, (nx, ny), point, gap)


@njit
def rope_spot(W, C, B, n, near):
    """Rope n where it is nearly taut: a contact whose gap is what it could still be stretched."""
    i, j, law, r = C.rope[n, 0], C.rope[n, 1], C.rope[n, 2], C.rope_number
    ax, ay = to_world(W, i, r[n, 0], r[n, 1])
    bx, by = to_world(W, j, r[n, 2], r[n, 3])
    dx, dy = bx - ax, by - ay
    far = math.hypot(dx, dy)
    gap = r[n, 4] - far
    if gap >= near or far == 0.0:
        return
    found = B.counts[FOUND]
    place(W, B, (i, j, law, -1 - n, -1 - n, 0), (-dx / far, -dy / far), (bx, by), gap, r[n, 4])
    if B.counts[FOUND] > found:  # it pulls at both of its ends
        B.geometry[found, 2], B.geometry[found, 3] = ax - W.q[3 * i, 0], ay - W.q[3 * i + 1, 0]
