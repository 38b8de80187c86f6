"""Contact points at one position: gaps, their rates, and where along its edge each one is.

All of it reads what the physics left in the workspace: coordinates, rotations, rows of the active
set. A contact point touches where its gap is none, within the ends of its edge and of its arcs, and
where no other edge keeps both bodies apart.

A corner on an edge is at the end of that edge where it meets another corner. Several edges run
through both corners, and their gaps are all zero there. Convex bodies are apart as long as one of
these gaps does not close: their distance is the greatest of the gaps, so that its rate is the
greatest of their rates. What slides over the end of a table or from one segment of a floor to the
next strikes none of the edges that it meets there.

Gilbert, Johnson, Keerthi (1988); Ericson: Real-Time Collision Detection (2005), 5.5.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline, kernel, njit
from mbody.kernels.constraints import body_rotations, further_block, law_of_place, rows
from mbody.kernels.constraints import ends as sides_of
from mbody.kernels.layout import Layout, Work
from mbody.model.joints.contour import place_on, speed_along


class UnilateralLayout(Bundle):
    """Contact points, the same throughout a motion: c of them.

    `normal`, `tangent`, `pair` (c,): Rows of gap and sliding, −1 without friction; friction pair,
      −1 without.
    `gap_sign`, `friction`, `static` (c,): Sign of the row of the gap; coefficients.
    `one_way`, `circles` (c,): Whether it is a freewheel; whether two circles touch, so that the row
      along the contact has a phase.
    `joint_tangent`, `joint_pair` (j,): Rows of sliding and friction pairs of joints that may stick.
    `row_unit` (rows,): By what values of the rows are multiplied: of gaps that are angles the model
      length, else 1.
    `speed_unit` (rows,): The model length of rows that are angles, else 1.
    `bodies` (c + j, 2): Both bodies of each contact point and, after these, of each such joint.
    `uneven` (bodies,): Ratio of the greatest mass of what is joined to each or may touch it, and
      the least.
    `edge_point` (e,), `edge_bodies` (e, 2), `edge` (e, 7): Of edges with ends the contact point;
      body of the edge and of what touches; beginning, direction, length and position of what
      touches.
    `arc_point` (a,), `arc_bodies` (a, 3), `arc` (a, 9): Of arcs the contact point; bodies of its
      rows and that of the arc; both positions, what is added to the direction between them, that
      direction where an edge gives it (else not a number), begin, half extent, radius.
    `curve_point`, `curve_end` (n,): Contact points on curves with ends, and how long these are.
    `never` (c,): Whether it is at a corner that points inwards, and so never touches.
    `adjacent_start` (c + 1,), `adjacent`: Of a corner on an edge the contact points of the same
      edge with the corners that are joined to that one.
    `meet_start` (2 c + 1,), `meet`: Contact points whose edges run through the same two corners as
      end 0 or 1 of contact point k: from meet_start[2 k + end] on.
    `has_ends` (c,): Whether what touches may go past an end of an edge or an arc.
    """

    normal: Ints
    tangent: Ints
    pair: Ints
    gap_sign: Floats
    friction: Floats
    static: Floats
    one_way: Ints
    circles: Ints
    joint_tangent: Ints
    joint_pair: Ints
    row_unit: Floats
    speed_unit: Floats
    bodies: Tables
    uneven: Floats
    edge_point: Ints
    edge_bodies: Tables
    edge: Rows
    arc_point: Ints
    arc_bodies: Tables
    arc: Rows
    curve_point: Ints
    curve_end: Floats
    never: Ints
    adjacent_start: Ints
    adjacent: Ints
    meet_start: Ints
    meet: Ints
    has_ends: Ints


@inline
def written(L, s):
    """The node where the physics of row s is written."""
    return L.written_node[L.active_set[s]]


@inline
def row_along(L, W, s, x):
    """Row s times a motion of the coordinates (coordinates, 1)."""
    e = L.active_set[s]
    m, i, j, k = L.written_node[e], L.primitive_i[e], L.primitive_j[e], L.primitive_node[e]
    total = 0.0
    for n in range(3):
        total += W.block[12 * m + n, 0] * x[3 * i + n, 0]
        total += W.block[12 * m + 6 + n, 0] * x[3 * j + n, 0]
    for side in range(L.more.shape[0]):
        if L.more[side, 0] == k:
            b, o = L.slot_body[L.more[side, 1] // 3], further_block(L, side)
            for n in range(3):
                total += W.block[o + n, 0] * x[3 * b + n, 0]
    return total


@njit
def fill_row(L, W, U, s, sign, row):
    """row (coordinates,) ← Φ_q of row s, multiplied by a sign."""
    e, unit, n3 = L.active_set[s], sign * U.row_unit[s], 3 * L.bodies
    m, i, j = L.written_node[e], 3 * L.primitive_i[e], 3 * L.primitive_j[e]
    for n in range(n3):
        row[n] = 0.0
    for n in range(3):
        if i < n3:
            row[i + n] += unit * W.block[12 * m + n, 0]
        if j < n3:
            row[j + n] += unit * W.block[12 * m + 6 + n, 0]
    for side in range(L.more.shape[0]):
        b, o = L.slot_body[L.more[side, 1] // 3], further_block(L, side)
        if L.more[side, 0] == L.primitive_node[e] and b < L.bodies:
            for n in range(3):
                row[3 * b + n] += unit * W.block[o + n, 0]


@inline
def row_value(L, W, U, s):
    """Φ of row s, of gaps as a length."""
    return U.row_unit[s] * W.phi[2 * written(L, s), 0]


@inline
def row_rate(L, W, U, s):
    """Φ_q v − ν of row s."""
    return U.row_unit[s] * (row_along(L, W, s, W.v) - W.nu[2 * written(L, s), 0])


@inline
def row_acceleration(L, W, U, s):
    """Φ_q a − γ of row s."""
    return U.row_unit[s] * (row_along(L, W, s, W.a) - W.gamma[2 * written(L, s), 0])


@inline
def gap_of(L, W, U, k):
    """The gap of contact point k as a length; none of a freewheel."""
    return 0.0 if U.one_way[k] else U.gap_sign[k] * row_value(L, W, U, U.normal[k])


@inline
def approach_of(L, W, U, k):
    """The rate of the gap of contact point k."""
    return U.gap_sign[k] * row_rate(L, W, U, U.normal[k])


@inline
def placed(W, b, x, y):
    """A point of body b from its mass centre, in world axes."""
    c, s = W.turn[2 * b, 0], W.turn[2 * b + 1, 0]
    return W.q[3 * b, 0] + c * x - s * y, W.q[3 * b + 1, 0] + s * x + c * y


@njit
def find_ends(L, W, U, ends):
    """ends (c, 2) ← how far each contact point is along its edge from both ends of it, and round
    its arcs or curve; infinite of what has no ends.
    """
    for k in range(U.normal.shape[0]):
        ends[k, 0] = ends[k, 1] = math.inf
    for n in range(U.edge_point.shape[0]):
        k = U.edge_point[n]
        ends[k, 0], ends[k, 1] = edge_ends(W, U, n)
    for n in range(U.arc_point.shape[0]):
        k, (before, after) = U.arc_point[n], arc_ends(W, U, n)
        ends[k, 0], ends[k, 1] = min(ends[k, 0], before), min(ends[k, 1], after)
    for n in range(U.curve_point.shape[0]):
        k, (along, _) = U.curve_point[n], along_curve(L, W, U, n)
        ends[k, 0], ends[k, 1] = along, U.curve_end[n] - along


@njit
def find_end_rates(L, W, U, ends, rates):
    """ends (c, 2) ← the ways of `find_ends`, and rates (c, 2) ← theirs; of what has no ends not a
    number.
    """
    for k in range(U.normal.shape[0]):
        ends[k, 0] = ends[k, 1] = math.inf
        rates[k, 0] = rates[k, 1] = math.nan
    for n in range(U.edge_point.shape[0]):
        k, rate = U.edge_point[n], edge_rate(W, U, n)
        ends[k, 0], ends[k, 1] = edge_ends(W, U, n)
        rates[k, 0], rates[k, 1] = rate, -rate
    for n in range(U.arc_point.shape[0]):
        k, rate, (before, after) = U.arc_point[n], arc_rate(W, U, n), arc_ends(W, U, n)
        if before < ends[k, 0]:
            ends[k, 0], rates[k, 0] = before, rate
        if after < ends[k, 1]:
            ends[k, 1], rates[k, 1] = after, -rate
    for n in range(U.curve_point.shape[0]):
        k, (along, rate) = U.curve_point[n], along_curve(L, W, U, n)
        ends[k, 0], ends[k, 1] = along, U.curve_end[n] - along
        rates[k, 0], rates[k, 1] = rate, -rate


@inline
def place_and_speed(W, i, b, x, y):
    """A point of body b from the mass centre of body i, and its velocity as that body sees it."""
    px, py = placed(W, b, x, y)
    w, v = W.v[3 * b + 2, 0], W.v[3 * i + 2, 0]
    dx, dy = px - W.q[3 * i, 0], py - W.q[3 * i + 1, 0]
    vx = W.v[3 * b, 0] - w * (py - W.q[3 * b + 1, 0]) - W.v[3 * i, 0] + v * dy
    vy = W.v[3 * b + 1, 0] + w * (px - W.q[3 * b, 0]) - W.v[3 * i + 1, 0] - v * dx
    return dx, dy, vx, vy


@njit
def edge_ends(W, U, n):
    """How far what touches edge n is along it from both ends."""
    i, j, g = U.edge_bodies[n, 0], U.edge_bodies[n, 1], U.edge[n]
    px, py = placed(W, j, g[5], g[6])
    px, py = px - W.q[3 * i, 0], py - W.q[3 * i + 1, 0]
    # into the axes of the edge's body
    c, s = W.turn[2 * i, 0], W.turn[2 * i + 1, 0]
    x, y = c * px + s * py - g[0], c * py - s * px - g[1]
    along = g[2] * x + g[3] * y
    return along, g[4] - along


@njit
def edge_rate(W, U, n):
    """The rate at which what touches edge n goes along it."""
    i, j, g = U.edge_bodies[n, 0], U.edge_bodies[n, 1], U.edge[n]
    _, _, vx, vy = place_and_speed(W, i, j, g[5], g[6])
    c, s = W.turn[2 * i, 0], W.turn[2 * i + 1, 0]
    return g[2] * (c * vx + s * vy) + g[3] * (c * vy - s * vx)


@njit
def arc_ends(W, U, n):
    """How far what touches arc n is round it from both ends."""
    i, j, own, g = U.arc_bodies[n, 0], U.arc_bodies[n, 1], U.arc_bodies[n, 2], U.arc[n]
    direction, begin, half, radius = W.q[3 * i + 2, 0] + g[5], g[6], g[7], g[8]
    if g[5] != g[5]:
        ax, ay = placed(W, i, g[0], g[1])
        bx, by = placed(W, j, g[2], g[3])
        direction = math.atan2(by - ay, bx - ax) + g[4]
    off = direction - W.q[3 * own + 2, 0] - begin - half + math.pi
    off -= 2.0 * math.pi * math.floor(off / (2.0 * math.pi)) + math.pi
    return radius * (half + off), radius * (half - off)


@njit
def arc_rate(W, U, n):
    """The rate at which what touches arc n goes round it, as a length a time."""
    i, j, own, g = U.arc_bodies[n, 0], U.arc_bodies[n, 1], U.arc_bodies[n, 2], U.arc[n]
    turn = W.v[3 * i + 2, 0]
    if g[5] != g[5]:
        dx, dy, vx, vy = place_and_speed(W, i, j, g[2], g[3])
        c, s = W.turn[2 * i, 0], W.turn[2 * i + 1, 0]
        dx, dy = dx - c * g[0] + s * g[1], dy - s * g[0] - c * g[1]
        turn += (dx * vy - dy * vx) / (dx * dx + dy * dy)
    return g[8] * (turn - W.v[3 * own + 2, 0])


@njit
def along_curve(L, W, U, n):
    """How far the foot on curve n is along it, and its rate ṡ = t·u/(1 − κ D): see
    `mbody.laws.contour`.
    """
    e = L.active_set[U.normal[U.curve_point[n]]]
    i, j, p, _ = sides_of(L, W, 0.0, e)
    distance, along, phi, bend = law_of_place(L, W, 0.0, L.primitive_law[e], *place_on(i, j, p))
    return along, speed_along(i, j, p, phi) * (1.0 + distance * bend)


@njit
def is_within(L, W, U, ends, k, closed, slow):
    """Whether contact point k is within the ends of its edge, and no other edge keeps both bodies
    apart; `ends` as of `find_ends`, gaps up to `closed` and rates up to `slow` are none.
    """
    if U.never[k] or min(ends[k, 0], ends[k, 1]) < -closed:
        return False
    at_end = abs(ends[k, 0]) <= closed or abs(ends[k, 1]) <= closed
    if not at_end:
        return True
    for n in range(U.adjacent_start[k], U.adjacent_start[k + 1]):
        # behind the edge but for this corner
        if gap_of(L, W, U, U.adjacent[n]) < -closed:
            return False
    rate = approach_of(L, W, U, k)
    if rate >= -slow:
        return True
    for end in range(2):
        if abs(ends[k, end]) > closed:
            continue
        for n in range(U.meet_start[2 * k + end], U.meet_start[2 * k + end + 1]):
            m = U.meet[n]
            if gap_of(L, W, U, m) >= -closed and approach_of(L, W, U, m) > rate + slow:
                return False
    return True


@njit
def phase_offset(L, W, U, k):
    """Of a contact point k of two circles the angle from ψ of the row along it to the line of
    centres. See `mbody.model.joints.slipping`.
    """
    i, j, o = U.bodies[k, 0], U.bodies[k, 1], L.primitive_par[L.active_set[U.tangent[k]]]
    ax, ay = placed(W, i, W.par[o, 0], W.par[o + 1, 0])
    bx, by = placed(W, j, W.par[o + 2, 0], W.par[o + 3, 0])
    psi = (
        W.par[o + 4, 0] * W.q[3 * i + 2, 0] + W.par[o + 5, 0] * W.q[3 * j + 2, 0] + W.par[o + 6, 0]
    )
    off = math.atan2(by - ay, bx - ax) - psi
    return off - 2.0 * math.pi * math.ceil(off / (2.0 * math.pi) - 0.5)


# -- As Python reads them ----------------------------------------------------------------------


@kernel
def read_rows(
    L: Layout, W: Work, U: UnilateralLayout, numbers: Rows, block: Rows, ends: Rows
) -> None:
    """Values, rates and γ (3, rows) of the rows of the active set, their coefficients (rows,
    coordinates) and the ways from the ends of edges (c, 2) at W.q and W.v, the signals being set.
    """
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)
    for s in range(block.shape[0]):
        numbers[0, s], numbers[1, s] = row_value(L, W, U, s), row_rate(L, W, U, s)
        numbers[2, s] = U.row_unit[s] * W.gamma[2 * written(L, s), 0]
        fill_row(L, W, U, s, 1.0, block[s])
    find_ends(L, W, U, ends)


@kernel
def points_within(
    L: Layout, W: Work, U: UnilateralLayout, ends: Rows, closed: float, slow: Floats, within: Ints
) -> None:
    """Which contact points are within the ends of their edges, (c,), as of `is_within`, at the
    position that was read last; slow (c,).
    """
    for k in range(U.normal.shape[0]):
        within[k] = 1 if is_within(L, W, U, ends, k, closed, slow[k]) else 0
