"""Many linkages of one topology on lanes, each in its own lane or in several, a piece of its motion
in each: positions of joints, forces on links, torques of drivers.

The motion is that of `mbody.kernels.continuation_lanes`; what is kept goes where a user reads it.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks, Tables
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import larger, ld, select_le, st, wide
from mbody.kernels.branch_monitor import store_parts
from mbody.kernels.constraints import rows, turns
from mbody.kernels.continuation_lanes import (
    FAILED,
    TWO,
    FollowedLanes,
    LanePath,
    advance,
    begin,
)
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import PER_PRIMITIVE, keep_primitive
from mbody.kernels.position_velocity import put_column
from mbody.kernels.schur_ldl import VANISHED, factor
from mbody.kernels.square_lu import Square, SquareWork

__all__ = ["LinkageBatch", "branch_distances", "follow_linkages", "linkage_rows"]


class LinkageBatch(Bundle):
    """Linkages of one topology, the pieces of their motions, and what is kept of them."""

    par: Rows  # (parameters, linkages)
    mass: Rows  # (masses, linkages)
    arm: Rows  # (2·nodes, linkages): nodes from the mass centres of their bodies, in link axes
    node: Ints  # (nodes,): the body of each
    force_at: Tables  # (primitives, 2): places that the force on i and that on j belong to, or −1
    driver: Ints  # the primitives of the drivers
    length: Floats  # (linkages,): of a unit of length of each in what is kept
    # pieces: linkage, first instant, how many instants, first position, which becomes the last
    member: Ints
    first: Ints
    count: Ints
    q: Rows  # (coordinates + 3, pieces)
    # found: one where a piece must not be trusted; the greatest inverse determinant of a block, and
    # the position there
    failed: Floats
    greatest: Floats
    nearest: Rows  # (coordinates + 3, pieces)
    # workspace: the arms and the lengths of all lanes, what is kept of an instant
    arms: Rows  # (2·nodes, lanes)
    lengths: Rows  # (1, lanes)
    page: Rows  # (numbers + those of a primitive, lanes)
    # results of all linkages, (all, instants, columns): the row of each linkage, and the column of
    # each of its numbers, which are as `linkage_rows` numbers them
    output: Stacks
    row: Ints
    column: Tables  # (linkages, numbers)


def linkage_rows(nodes: int, places: int, drivers: int) -> int:
    """Numbers that are kept of an instant: (x, y) of each node, (x, y) of the force on each place
    of a link, the torque of each driver.
    """
    return 2 * nodes + 2 * places + drivers


@kernel
def follow_linkages(
    L: Layout,
    P: Square,
    Q: Square,
    W: Work,
    F: SquareWork,
    path: LanePath,
    followed: FollowedLanes,
    batch: LinkageBatch,
) -> None:
    """Follow all pieces, as many at a time as there are lanes, the path the same for each time. The
    last lanes repeat the last piece.
    """
    w = wide()
    pieces, lanes = batch.member.shape[0], batch.page.shape[1]
    for low in range(0, pieces, lanes):
        put_pieces(W, batch, low)
        begin(L, W, followed, TWO)
        worst = 0.0 * w
        for k in range(path.s.shape[0]):
            most = advance(L, P, Q, W, F, path, followed, k)
            # the position where a determinant is least; W.base is no part of the motion
            for n in range(3 * L.bodies):
                st(W.base, n, select_le(most, worst, ld(W.base, n, w), ld(W.q, n, w)), w)
            worst = larger(worst, most)
            keep_linkage(L, W, w, batch)
            store_instant(batch, low, min(lanes, pieces - low), k)
        st(batch.page, 0, worst, w)
        store_ends(L, W, followed, batch, low)


@njit
def put_pieces(W, batch, low):
    """Numbers and first positions of the pieces from `low` on, one a lane."""
    pieces, lanes = batch.member.shape[0], batch.page.shape[1]
    for lane in range(lanes):
        piece = min(low + lane, pieces - 1)
        member = batch.member[piece]
        put_column(batch.par, member, W.par, lane)
        put_column(batch.mass, member, W.mass, lane)
        put_column(batch.arm, member, batch.arms, lane)
        batch.lengths[0, lane] = batch.length[member]
        put_column(batch.q, piece, W.q, lane)


@njit
def store_ends(L, W, followed, batch, low):
    """How the pieces in the lanes ended; the page has the greatest growth of each."""
    for lane in range(min(batch.page.shape[1], batch.member.shape[0] - low)):
        batch.failed[low + lane] = followed.found[FAILED, lane]
        batch.greatest[low + lane] = batch.page[0, lane]
        for n in range(3 * L.bodies):
            batch.nearest[n, low + lane] = W.base[n, lane]
            batch.q[n, low + lane] = W.q[n, lane]


@njit
def keep_linkage(L, W, w, batch):
    """Positions of nodes, forces on places, torques of drivers, on the page of this instant."""
    page, nodes, drivers = batch.page, batch.node.shape[0], batch.driver.shape[0]
    spare = page.shape[0] - PER_PRIMITIVE
    zero, length = 0.0 * w, ld(batch.lengths, 0, w)
    for n in range(nodes):
        b = batch.node[n]
        c, s = ld(W.turn, 2 * b, w), ld(W.turn, 2 * b + 1, w)
        x, y = ld(batch.arms, 2 * n, w), ld(batch.arms, 2 * n + 1, w)
        st(page, 2 * n, length * (ld(W.q, 3 * b, w) + c * x - s * y), w)
        st(page, 2 * n + 1, length * (ld(W.q, 3 * b + 1, w) + s * x + c * y), w)
    for n in range(2 * nodes, spare):
        st(page, n, zero, w)
    for e in range(batch.force_at.shape[0]):
        keep_primitive(L, W, w, e, page, spare)
        driven = -1
        for k in range(drivers):
            if e == batch.driver[k]:
                driven = k
        if driven >= 0:
            st(page, spare - drivers + driven, length * ld(page, spare + 4, w), w)
            continue
        fx, fy = ld(page, spare + 2, w), ld(page, spare + 3, w)
        i, j = batch.force_at[e, 0], batch.force_at[e, 1]
        if i >= 0:
            add_force(page, 2 * (nodes + i), zero - fx, zero - fy, w)
        if j >= 0:
            add_force(page, 2 * (nodes + j), fx, fy, w)


@inline
def add_force(page, row, fx, fy, w):
    """Add a force to that of a place."""
    st(page, row, ld(page, row, w) + fx, w)
    st(page, row + 1, ld(page, row + 1, w) + fy, w)


@inline
def store_instant(batch, low, many, k):
    """The page of step k into the results of the linkages."""
    for lane in range(many):
        if k >= batch.count[low + lane]:
            continue
        member, instant = batch.member[low + lane], batch.first[low + lane] + k
        row = batch.row[member]
        for n in range(batch.column.shape[1]):
            batch.output[row, instant, batch.column[member, n]] = batch.page[n, lane]


@kernel
def branch_distances(L: Layout, W: Work, batch: LinkageBatch, distances: Floats) -> None:
    """The square of the distance from other branches of every piece at its nearest position:
    distances (pieces,).
    """
    for piece in range(batch.member.shape[0]):
        member = batch.member[piece]
        put_column(batch.par, member, W.par, 0)
        put_column(batch.nearest, piece, W.q, 0)
        turns(L, W, 0.0)
        rows(L, W, 0.0, True, None)
        factor(L, W, 0.0, 0.0, VANISHED)
        distances[piece] = 1.0 / store_parts(L, W, 1, 0.0)
