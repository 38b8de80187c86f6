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

from mbody.core.decorators import inline, njit
from mbody.kernels.unilateral import row_acceleration, row_rate, row_value


@inline
def gap_of(L, W, U, k):
    """The gap of contact point k as a length; none of a freewheel."""
    return 0.0 if U.one_way[k] else U.gap_sign[k] * row_value(L, W, U, U.normal[k])


@inline
def approach_of(L, W, U, k):
    """The rate of the gap of contact point k."""
    return U.gap_sign[k] * row_rate(L, W, U, U.normal[k])


@inline
def pull_of(L, W, U, k):
    """The acceleration of the gap of contact point k."""
    return U.gap_sign[k] * row_acceleration(L, W, U, U.normal[k])


@inline
def placed(W, b, x, y):
    """A point of body b from its mass centre, in world axes."""
    c, s = W.turn[2 * b, 0], W.turn[2 * b + 1, 0]
    return W.q[3 * b, 0] + c * x - s * y, W.q[3 * b + 1, 0] + s * x + c * y


@njit
def find_ends(L, W, U, ends):
    """ends (c, 2) ← how far each contact point is along its edge from both ends of it, and round
    its arcs; infinite of what has no ends.
    """
    for k in range(U.normal.shape[0]):
        ends[k, 0] = ends[k, 1] = math.inf
    for n in range(U.edge_point.shape[0]):
        k, i, j, g = U.edge_point[n], U.edge_bodies[n, 0], U.edge_bodies[n, 1], U.edge[n]
        px, py = placed(W, j, g[5], g[6])
        px, py = px - W.q[3 * i, 0], py - W.q[3 * i + 1, 0]
        # into the axes of the edge's body
        c, s = W.turn[2 * i, 0], W.turn[2 * i + 1, 0]
        x, y = c * px + s * py - g[0], c * py - s * px - g[1]
        along = g[2] * x + g[3] * y
        ends[k, 0], ends[k, 1] = along, g[4] - along
    for n in range(U.arc_point.shape[0]):
        k, own, g = U.arc_point[n], U.arc_bodies[n, 2], U.arc[n]
        direction = W.q[3 * U.arc_bodies[n, 0] + 2, 0] + g[5]
        if not g[5] == g[5]:
            ax, ay = placed(W, U.arc_bodies[n, 0], g[0], g[1])
            bx, by = placed(W, U.arc_bodies[n, 1], g[2], g[3])
            direction = math.atan2(by - ay, bx - ax) + g[4]
        begin, half, radius = g[6], g[7], g[8]
        off = direction - W.q[3 * own + 2, 0] - begin - half + math.pi
        off -= 2.0 * math.pi * math.floor(off / (2.0 * math.pi)) + math.pi
        ends[k, 0] = min(ends[k, 0], radius * (half + off))
        ends[k, 1] = min(ends[k, 1], radius * (half - off))


@njit
def is_within(L, W, U, ends, k, slow):
    """Whether contact point k is within the ends of its edge, and no other edge keeps both bodies
    apart; `ends` as of `find_ends`, rates up to `slow` are none.
    """
    closed = U.number[1]
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
    return off - 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5)
