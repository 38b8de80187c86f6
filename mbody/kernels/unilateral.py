"""What may open, stick and slide: the tables and the modes of contacts and frictional joints.

Contact points come first, then frictional joints; both are called owners of modes. A contact point
is one place where two bodies may touch, with a row of its gap and, where there is friction, a row
along its tangent; a rope, a stop and a freewheel are contact points too. A frictional joint has a
row along its sliding alone. Rows are numbered as in `Layout.active_set`.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline
from mbody.kernels.constraints import further_block

#: Modes. A contact point is redundant where it is closed without force of its own, as other rows
#: hold it already; what slides does so along or against its tangent.
OPEN, STICK, FORWARD, BACKWARD, REDUNDANT = range(5)


class UnilateralLayout(Bundle):
    """What may open, stick and slide, the same throughout a motion: c contact points, j joints.

    `normal`, `tangent`, `pair` (c,): Rows of gap and sliding, −1 without friction; friction pair,
      −1 without.
    `gap_sign`, `friction`, `static`, `restitution` (c,): Sign of the row of a gap; coefficients.
    `newton`, `one_way`, `circles`, `has_ends` (c,): Whether impacts follow Newton's law; whether it
      is a freewheel; whether two circles touch, so that the row along the contact has a phase;
      whether what touches may go past an end of an edge or an arc.
    `joint_tangent`, `joint_pair` (j,): Rows of sliding and friction pairs of joints.
    `row_unit` (rows,): By what values of the rows are multiplied: of gaps that are angles the model
      length, else 1.
    `speed_unit` (rows,): Model length of rows that are angles, else 1.
    `bodies` (c + j, 2): Both bodies of each owner.
    `arm` (c + j,): By what forces of others are multiplied to be compared with those of each: of
      pins the radius, of other angles the model length, else 1.
    `body_part` (bodies,): The first body of what is joined to each or may touch it.
    `edge_point` (e,), `edge_bodies` (e, 2), `edge` (e, 7): Of edges with ends the contact point;
      body of the edge and of what touches; beginning, direction, length and position of what
      touches.
    `arc_point` (a,), `arc_bodies` (a, 3), `arc` (a, 9): Of arcs the contact point; bodies of its
      rows and that of the arc; both positions, what is added to the direction between them, that
      direction where an edge gives it (else not a number), begin, half extent, radius.
    `never` (c,): Whether it is at a corner that points inwards, and so never touches.
    `adjacent_start` (c + 1,), `adjacent`: Of a corner on an edge the contact points of the same edge
      with the corners that are joined to that one.
    `meet_start` (2 c + 1,), `meet`: Contact points whose edges run through the same two corners as
      end 0 or 1 of contact point k: from meet_start[2 k + end] on.
    `number` (3,): The model length; up to what gaps are none; the regularization of the joints.
    """

    normal: Ints
    tangent: Ints
    pair: Ints
    gap_sign: Floats
    friction: Floats
    static: Floats
    restitution: Floats
    newton: Ints
    one_way: Ints
    circles: Ints
    has_ends: Ints
    joint_tangent: Ints
    joint_pair: Ints
    row_unit: Floats
    speed_unit: Floats
    bodies: Tables
    arm: Floats
    body_part: Ints
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
    number: Floats


#: Places in `UnilateralLayout.number`.
LENGTH, GAP_CLOSED, REGULARIZATION = range(3)


class UnilateralModes(Bundle):
    """Modes of a motion, and what an event has just decided: c contact points, then j joints.

    `mode` (c + j,): The modes.
    `leader` (c + j,): By whose row what sticks is held, often its own; −1 where no row holds it.
    `closed`, `opened`, `beyond` (c,): Whether it is closed though its gap is rounding; has just
      opened; is open past the end of its edge.
    `stopped` (c + j,): Whether it has just ceased to slide.
    `begun` (c + j,): Direction in which it has just begun to slide, zero of all others.
    `struck` (c,): When it was struck last.
    `lost` (c,): Energy that impacts gave, below zero where they took.
    """

    mode: Ints
    leader: Ints
    closed: Ints
    opened: Ints
    beyond: Ints
    stopped: Ints
    begun: Floats
    struck: Floats
    lost: Floats


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


@inline
def row_acceleration(L, W, U, s):
    """Φ_q a − γ of row s."""
    return U.row_unit[s] * (row_along(L, W, s, W.a) - W.gamma[2 * written(L, s), 0])


@inline
def row_multiplier(L, W, s):
    """λ of row s, as it stands in the rows."""
    return W.lam[2 * L.primitive_node[L.active_set[s]], 0]
