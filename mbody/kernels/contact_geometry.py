"""Where two shapes touch, or nearly so: normal, point and gap of every place.

Circles touch circles, lines, segments and polygons; corners touch lines and rings. Two polygons
touch along the edge that separates them most (or is least overlapped), on which the nearest edge of
the other is clipped: at most two places, of one normal. Ericson: Real-Time Collision Detection
(2005), 5.5.

What slides from one shape of a body to the next strikes no edge where they meet: edges that another
shape of the body covers are none, and a corner that shapes share is touched only from directions
between the normals of the edges that are left there, from none where it does not point outwards.

A pair is (x, y, law, near, swapped): the normal goes from shape x to shape y; y is the contact's i
where it is swapped.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline, njit
from mbody.core.tolerances import (
    CONTACT_CORNER_BEHIND,
    CONTACT_EDGE_PREFERRED,
    CONTACT_GAP_CANDIDATE,
    CONTACT_OVERLAP_LEFT,
)
from mbody.kernels.contact_rows import placed

# -- Tables of shapes that may touch, of the contacts of one step, and of the steps themselves -
#
# A shape is a circle, an endless line, a segment or a convex polygon of one body, all numbers from
# the mass centre in link axes. Edges are free on their left, so that those of polygons go round
# clockwise, each from the corner of its number; a segment is a polygon of two edges, of which the
# first faces what touches it, a line has one without end.

#: Kinds of shapes.
CIRCLE, LINE, SEGMENT, POLYGON = range(4)
#: What corners are beside those of other shapes.
ALONE, SHARED, INNER = range(3)


class ContactShapes(Bundle):
    """Shapes that may touch, their pairs and laws.

    `kind`, `body` (shapes,): Kind and body of each shape.
    `edge_start` (shapes + 1,): Where the edges of each are.
    `edge` (edges, 5): Beginning, direction and length.
    `covered` (edges,): Whether another shape of the body is on its free side.
    `joined` (edges,): Whether another shape shares the corner where it begins: ALONE, SHARED where
      it points outwards, else INNER.
    `cone` (edges, 4): Normals between which a shared corner is touched, counter-clockwise.
    `centre` (shapes, 2): Of the bounding circle: of a circle itself; of a line its point.
    `bounding_radius` (shapes,): Radius of the bounding circle, infinite of lines.
    `radius` (shapes,): Of circles: zero of points, negative of rings.
    `large` (shapes,): Whether it is looked at beside all others instead of in the grid.
    `usual` (1,): The radius that is usual among the others.
    `group` (shapes,): The sets of groups that it is in, by number; −1 in none.
    `group_law` (sets, sets): The law between shapes of two such sets, the first as i; −1 where none
      is.
    `pair` (pairs, 3): Shapes i and j of the contacts that are named one by one, and their laws.
    `rope` (ropes, 3): Bodies i and j of ropes, and their laws.
    `rope_number` (ropes, 5): Arms of both ends, and the length.
    `law` (laws, 3): Kinetic and static friction, restitution.
    `tied_start`, `tied` (bodies + 2,) (ties,): Bodies that joints tie to each: no group makes
      contacts between these.
    """

    kind: Ints
    body: Ints
    edge_start: Ints
    edge: Rows
    covered: Ints
    joined: Ints
    cone: Rows
    centre: Rows
    bounding_radius: Floats
    radius: Floats
    large: Ints
    usual: Floats
    group: Ints
    group_law: Tables
    pair: Tables
    rope: Tables
    rope_number: Rows
    law: Rows
    tied_start: Ints
    tied: Ints


class ContactWork(Bundle):
    """Contacts of a step, at most as many as there is memory for.

    `who` (most, 6): Bodies i and j, law, shapes i and j, feature (which corner on which edge).
    `geometry` (most, 8): Normal from i to j, arms of the contact on i and on j, gap, size of the
      smaller shape.
    `effect` (most, 6): D_NN and D_TT of the contact itself; coefficient of friction; what γ_N⁺ must
      be at least, negative, of velocities and of the correction of positions; s of its cone.
    `impulse`, `kept`, `ahead` (most, 2): (P_N, P_T), those before a sweep, and the direction in
      which the solver goes on.
    `rate` (most, 2): (γ_N, γ_T) at the beginning of the step.
    `shift` (most,): Changes of s; impulses of the correction of positions.
    `is_tied` (bodies + 1,): Whether joints or drivers act on a body.
    `inverse` (coordinates + 3,): Inverse masses, zero of the ground.
    `velocity`, `free`, `start`, `moved` (coordinates + 3,): As impulses change it; without
      contacts; at the beginning of a step; what a correction of positions moves.
    `row_rate`, `row_impulse` (2·nodes,): Rates of the rows of joints at the beginning, and their
      impulses.
    `old`, `old_impulse` (most, 3) (most, 2): Shapes and feature of the contacts of the step before,
      and their impulses.
    `old_slot` (places,): Where they are found by hashing.
    `place` (shapes, 2): Centres of bounding circles.
    `margin` (shapes,): How far a shape may come in a step.
    `turning` (shapes,): How far it may turn.
    `cell` (shapes, 2): Its cell of the grid.
    `following` (shapes,): The next shape in the same bucket.
    `bucket` (buckets,): The first shape of each.
    `progress` (4,): The last change of impulses; the greatest change of rates that is asked for;
      the greatest rate without contacts; how much of the way s went at last.
    `counts` (3,): See `mbody.kernels.contact_geometry`.
    """

    who: Tables
    geometry: Rows
    effect: Rows
    impulse: Rows
    kept: Rows
    ahead: Rows
    rate: Rows
    shift: Floats
    is_tied: Ints
    inverse: Floats
    velocity: Floats
    free: Floats
    start: Floats
    moved: Floats
    row_rate: Floats
    row_impulse: Floats
    old: Tables
    old_impulse: Rows
    old_slot: Ints
    place: Rows
    margin: Floats
    turning: Floats
    cell: Tables
    following: Ints
    bucket: Ints
    progress: Floats
    counts: Ints


class InteriorWork(Bundle):
    """Memory of the interior-point method.

    `matrix`: Row blocks of bodies, see `mbody.kernels.contact_impulses`.
    `place`, `order` (bodies,): Number of each body in the matrix, and the body of each number,
      backward.
    `first`, `offset` (bodies,) (bodies + 1,): The first body of each row block, and where it
      begins.
    `start`, `neighbour` (bodies + 1,) (most + ties): Bodies that each touches or is tied to.
    `tied` (ties, 2): Pairs of bodies that rows of joints tie.
    `row_start`, `row_body`, `row_block` (2·nodes + 1,) (parts,) (parts,): Rows of joints: bodies,
      and where the three numbers of each are in `Work.block`.
    `stiffness`, `pull`, `old_pull`, `rate` (2·nodes,): Of each row: stiffness, impulse beside that
      without contacts, the same of the step before, and how far its rate is off.
    `dual`, `slack`, `dual_step`, `slack_step`, `target`, `lack` (most, 2): Multipliers of both
      sides of a cone, slacks, their steps; what the change of a product is to be, and what is left
      of the equation of a slack.
    `rest`, `step` (coordinates + 3,): What is left of the equation of motion; forces, then the step
      of velocities.
    `sorted` (coordinates,): Numbers in the order of the matrix.
    `count` (2,): See `mbody.kernels.contact_impulses`.
    """

    matrix: Floats
    place: Ints
    order: Ints
    first: Ints
    offset: Ints
    start: Ints
    neighbour: Ints
    tied: Tables
    row_start: Ints
    row_body: Ints
    row_block: Ints
    stiffness: Floats
    pull: Floats
    old_pull: Floats
    rate: Floats
    dual: Rows
    slack: Rows
    dual_step: Rows
    slack_step: Rows
    target: Rows
    lack: Rows
    rest: Floats
    step: Floats
    sorted: Floats
    count: Ints


class ImpulseSteps(Bundle):
    """Steps of one motion by impulses.

    `length`: Of a step.
    `tolerance`: Change of impulses, as a part of the greatest one, at which they are found.
    `regularization`: Of redundant rows.
    `refinements`: Corrections by the residual of the rows of joints.
    `y`, `last` (2·coordinates + auxiliary states,): State, and that before the step.
    `change` (coordinates,): (v⁺ − v)/h of the step, before velocities are projected.
    `loads` (causes, coordinates): Forces of each load, and their sum in the last row.
    `work` (causes,): Work since the beginning: of loads, drivers, laws of contact.
    `work_before` (causes,): The same before the step.
    `residual` (4,): Of the equation of a step: greatest part left, greatest term, power left, sum
      of all power.
    `state`: See `mbody.kernels.moreau`.
    """

    length: float
    tolerance: float
    regularization: float
    refinements: int
    y: Floats
    last: Floats
    change: Floats
    loads: Rows
    work: Floats
    work_before: Floats
    residual: Floats
    state: Floats


#: Counts of a step: contacts found; contacts for which there was no memory; pairs looked at.
FOUND, LACKING, TESTED = range(3)
#: Columns of `effect`, and what is in `progress`.
NN, TT, MU, BOUND, APART, OPENING = range(6)
CHANGE, RATE, SPEED, PART = range(4)
#: Numbers of edges and corners, of those of the other shape, and of corners that circles touch.
OTHER, CORNER = 4096, 8192


@inline
def edges_of(C, a):
    """How many edges a shape has."""
    return C.edge_start[a + 1] - C.edge_start[a]


@inline
def edge_number(C, a, n):
    """Number of edge n of shape a, round about."""
    return C.edge_start[a] + n % edges_of(C, a)


@inline
def corner_at(W, C, a, n):
    """The beginning of edge n of shape a, round about, in world axes."""
    k = edge_number(C, a, n)
    return placed(W, C.body[a], C.edge[k, 0], C.edge[k, 1])


@inline
def centre_of(W, C, a):
    """The centre of a shape in world axes."""
    return placed(W, C.body[a], C.centre[a, 0], C.centre[a, 1])


@inline
def edge_of(W, C, a, n):
    """Beginning, direction, normal to the free side, and length of edge n of shape a."""
    k, b = edge_number(C, a, n), C.body[a]
    c, s = W.turn[2 * b, 0], W.turn[2 * b + 1, 0]
    ax, ay = placed(W, b, C.edge[k, 0], C.edge[k, 1])
    ux, uy = c * C.edge[k, 2] - s * C.edge[k, 3], s * C.edge[k, 2] + c * C.edge[k, 3]
    return ax, ay, ux, uy, -uy, ux, C.edge[k, 4]


@inline
def may_touch(W, C, a, n, nx, ny):
    """Whether corner n of shape a is touched along a normal (nx, ny) away from it."""
    k, b = edge_number(C, a, n), C.body[a]
    if C.joined[k] == ALONE:
        return True
    c, s, cone = W.turn[2 * b, 0], W.turn[2 * b + 1, 0], C.cone
    x, y = c * nx + s * ny, c * ny - s * nx
    after, before = cone[k, 0] * y - cone[k, 1] * x, x * cone[k, 3] - y * cone[k, 2]
    return C.joined[k] == SHARED and min(after, before) >= 0.0


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
        if C.bounding_radius[a] > 0.0:
            size = min(size, C.bounding_radius[a])
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
def add_contact(W, C, B, a, b, law, near):
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
    elif ka == LINE or kb == LINE:
        if ka != kb:
            corners_on_edge(W, C, B, straight if ka == LINE else turned)
    elif ka == SEGMENT and kb == SEGMENT:
        corners_on_edge(W, C, B, straight)
        corners_on_edge(W, C, B, turned)
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
    """Circle y on a shape x with edges, or the corners of x within a ring y."""
    x, y, law, near, swapped = pair
    if C.radius[y] >= 0.0:
        circle_on_edges(W, C, B, pair)
    elif C.kind[x] != LINE:
        for n in range(edges_of(C, x)):
            px, py = corner_at(W, C, x, n)
            round_pair(W, C, B, (y, x, law, near, not swapped), (px, py, 0.0, n))


@njit
def circle_on_edges(W, C, B, pair):
    """Circle y on line, segment or convex polygon x: on an edge, or on a corner."""
    x, y, _, near, _ = pair
    cx, cy = centre_of(W, C, y)
    r, kind = C.radius[y], C.kind[x]
    best, widest, outside = -1, -math.inf, -math.inf
    for n in range(edges_of(C, x) if kind == POLYGON else 1):
        ax, ay, _, _, nx, ny, _ = edge_of(W, C, x, n)
        gap = nx * (cx - ax) + ny * (cy - ay)
        outside = max(outside, gap)
        if gap > widest and not C.covered[edge_number(C, x, n)]:
            best, widest = n, gap
    if best < 0 or outside - r >= near:
        return
    ax, ay, ux, uy, nx, ny, length = edge_of(W, C, x, best)
    s = ux * (cx - ax) + uy * (cy - ay)
    within = kind == LINE or 0.0 <= s <= length
    deepest = -CONTACT_CORNER_BEHIND * length if r == 0.0 else -r
    if kind == SEGMENT and within and widest < deepest:
        return
    if within or (kind == POLYGON and outside <= 0.0):
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
        if may_touch(W, C, x, k, nx, ny):
            point = ax + 0.5 * gap * nx, ay + 0.5 * gap * ny
            put(W, C, B, pair, CORNER + k % edges_of(C, x), (nx, ny), point, gap)


@njit
def corners_on_edge(W, C, B, pair):
    """The corners of y on the line or segment x."""
    x, y, _, near, swapped = pair
    ax, ay, ux, uy, nx, ny, length = edge_of(W, C, x, 0)
    for n in range(edges_of(C, y)):
        px, py = corner_at(W, C, y, n)
        s, gap = ux * (px - ax) + uy * (py - ay), nx * (px - ax) + ny * (py - ay)
        within = C.kind[x] == LINE or 0.0 <= s <= length
        within = within and C.joined[edge_number(C, y, n)] != INNER
        if within and -CONTACT_CORNER_BEHIND * length < gap < near:
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
    size = min(C.bounding_radius[a], C.bounding_radius[b])
    none = 2.0 * CONTACT_OVERLAP_LEFT * max(C.bounding_radius[a], C.bounding_radius[b])
    edge_a, gap_a, level_a = widest_edge(W, C, a, b, near, none)
    if gap_a >= near:
        return
    edge_b, gap_b, level_b = widest_edge(W, C, b, a, near, none)
    if gap_b >= near or max(edge_a, edge_b) < 0:
        return
    wider = gap_b > gap_a + CONTACT_EDGE_PREFERRED * size
    if edge_a < 0 or (level_b if level_a != level_b else wider):
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
def widest_edge(W, C, x, y, near, none):
    """The edge of x from which y is farthest, how far, and whether y lies on it: one of which y is
    on the free side but for an overlap that is `none` parts both, however far others do. −1 where y
    is near to all of them and touches none, as edges are covered or the corner of y has no such
    direction.
    """
    best, widest, level = -1, -math.inf, False
    for n in range(edges_of(C, x)):
        ax, ay, _, _, nx, ny, _ = edge_of(W, C, x, n)
        corner, least = 0, math.inf
        for k in range(edges_of(C, y)):
            px, py = corner_at(W, C, y, k)
            gap = nx * (px - ax) + ny * (py - ay)
            if gap < least:
                corner, least = k, gap
        if least >= near:
            return n, least, False
        touches = not C.covered[edge_number(C, x, n)] and may_touch(W, C, y, corner, -nx, -ny)
        lies = abs(least) <= none
        if touches and (lies if lies != level else least > widest):
            best, widest, level = n, least, lies
    return best, widest, level


@njit
def clipped(W, C, B, pair, edge):
    """The edge of y that faces an edge of x, clipped to its length: those ends that are near."""
    x, y, _, near, swapped = pair
    ax, ay, ux, uy, nx, ny, length = edge_of(W, C, x, edge)
    facing, least = 0, math.inf
    for k in range(edges_of(C, y)):
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
def rope_point(W, C, B, n, near):
    """Rope n where it is nearly taut: a contact whose gap is what it could still be stretched."""
    i, j, law, r = C.rope[n, 0], C.rope[n, 1], C.rope[n, 2], C.rope_number
    ax, ay = placed(W, i, r[n, 0], r[n, 1])
    bx, by = placed(W, j, r[n, 2], r[n, 3])
    dx, dy = bx - ax, by - ay
    far = math.hypot(dx, dy)
    gap = r[n, 4] - far
    if gap >= near or far == 0.0:
        return
    found = B.counts[FOUND]
    place(W, B, (i, j, law, -1 - n, -1 - n, 0), (-dx / far, -dy / far), (bx, by), gap, r[n, 4])
    if B.counts[FOUND] > found:  # it pulls at both of its ends
        B.geometry[found, 2], B.geometry[found, 3] = ax - W.q[3 * i, 0], ay - W.q[3 * i + 1, 0]


# -- Broad phase: a uniform grid, so that distant shapes cost nothing --------------------------
#
# Every step the centres of all bounding circles go into square cells as wide as the greatest of
# them, found by hashing; each is looked at beside those in its own cell and the eight around it.
# Shapes much larger than the others, lines among them, are looked at beside all. Teschner et al.:
# Optimized Spatial Hashing (2003).

#: Primes of the hashes of cells and of contacts.
PRIMES = (73856093, 19349663, 83492791)


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
        rope_point(W, C, B, n, near + CONTACT_GAP_CANDIDATE * C.rope_number[n, 4])
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
        own = C.bounding_radius[a] if C.kind[a] != LINE else 0.0
        B.margin[a] = h * (along + turning * (arm + own)) + CONTACT_GAP_CANDIDATE * own
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
        near += B.turning[line] * (far + C.bounding_radius[other])
    elif far - C.bounding_radius[a] - C.bounding_radius[b] >= near:
        return
    add_contact(W, C, B, a, b, law, near)


@inline
def look_in_groups(W, C, B, a, b):
    """Looks for contacts of two shapes that groups may bring together."""
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
        if C.group[a] >= 0 and not C.large[a] and B.margin[a] <= C.bounding_radius[a] + C.usual[0]:
            side = max(side, C.bounding_radius[a] + B.margin[a])
    side *= 2.0
    for n in range(mask + 1):
        B.bucket[n] = -1
    for a in range(shapes):
        if C.group[a] < 0:
            continue
        if C.large[a] or B.margin[a] > C.bounding_radius[a] + C.usual[0]:
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
