"""What may open, stick and slide: the table of contact points and their rows.

A contact point is one place where two bodies may touch, with a row of its gap and, where there is
friction, a row along its tangent; a rope, a stop and a freewheel are contact points too. Rows are
numbered as in `Layout.active_set`.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline
from mbody.kernels.constraints import further_block


class UnilateralLayout(Bundle):
    """Contact points, the same throughout a motion: c of them.

    `normal`, `tangent` (c,): Rows of gap and sliding, −1 without friction.
    `gap_sign` (c,): Sign of the row of the gap.
    `one_way`, `circles` (c,): Whether it is a freewheel; whether two circles touch, so that the row
      along the contact has a phase.
    `row_unit` (rows,): By what values of the rows are multiplied: of gaps that are angles the model
      length, else 1.
    `bodies` (c, 2): Both bodies of each.
    `edge_point` (e,), `edge_bodies` (e, 2), `edge` (e, 7): Of edges with ends the contact point;
      body of the edge and of what touches; beginning, direction, length and position of what
      touches.
    `arc_point` (a,), `arc_bodies` (a, 3), `arc` (a, 9): Of arcs the contact point; bodies of its
      rows and that of the arc; both positions, what is added to the direction between them, that
      direction where an edge gives it (else not a number), begin, half extent, radius.
    `never` (c,): Whether it is at a corner that points inwards, and so never touches.
    `adjacent_start` (c + 1,), `adjacent`: Of a corner on an edge the contact points of the same
      edge with the corners that are joined to that one.
    `meet_start` (2 c + 1,), `meet`: Contact points whose edges run through the same two corners as
      end 0 or 1 of contact point k: from meet_start[2 k + end] on.
    """

    normal: Ints
    tangent: Ints
    gap_sign: Floats
    one_way: Ints
    circles: Ints
    row_unit: Floats
    bodies: Tables
    edge_point: Ints
    edge_bodies: Tables
    edge: Rows
    arc_point: Ints
    arc_bodies: Tables
    arc: Rows
    never: Ints
    adjacent_start: Ints
    adjacent: Ints
    meet_start: Ints
    meet: Ints


# -- Rows of the active set, as the physics gave them at the present position ------------------


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


@inline
def row_value(L, W, U, s):
    """Φ of row s, of gaps as a length."""
    return U.row_unit[s] * W.phi[2 * written(L, s), 0]


@inline
def row_rate(L, W, U, s):
    """Φ_q v − ν of row s."""
    return U.row_unit[s] * (row_along(L, W, s, W.v) - W.nu[2 * written(L, s), 0])
