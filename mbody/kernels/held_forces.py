"""All forces that hold at an instant, as the program of those that no equation decides takes them.

Multipliers of joints and drivers, then normal forces of closed contact points, then friction of
contact points and joints that stick. Friction of what slides follows what presses it: of a contact
point it goes with the normal force, of a joint to first order in both multipliers.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import FRICTION_RESERVE_MOST
from mbody.kernels.complementarity import find_arms
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.contact_modes import BACKWARD, FORWARD, OPEN, STICK, is_redundant
from mbody.kernels.contact_rows import UnilateralLayout, fill_row, row_rate
from mbody.kernels.force_programs import BENT, COORDINATES, FORCES, LINES, OpenForces, share
from mbody.kernels.friction import APART, ARMS, FORCE, PIN, TORQUE, law_size
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work

#: Numbers in `HeldForceTable.count`: closed contact points; those and the frictional joints that
#: stick; those that are redundant.
NORMALS, STICKS, JOINTS, SHARED = range(4)


class HeldForceTable(Bundle):
    """Which forces hold: r rows of joints and drivers, n closed contact points, t of them and j
    frictional joints that stick.

    `count` (4,): How many of n, t and j there are, and are redundant; the arrays may be longer.
    `row` (r, 2): Primitive and number of each row.
    `normal` (n,), `slip` (n,): Contact points, and the direction in which each slides by a friction
      of its own, else 0.
    `leader` (n,): By whose friction each sticks, −1 of none.
    `stick` (t,): Contact points that stick by a tangent of their own.
    `joint` (j,): Frictional joints, by number among those that may stick.
    `pair_slip` (friction pairs,): Direction of those of joints that slide, and of teeth that press
      apart, else 0.
    `owner` (limits,): Whose the limits are; contact points, then frictional joints.
    `change` (friction pairs, 2): By both multipliers that press it, how the friction of each pair
      that slides changes.
    `along` (coordinates,), `arm` (2 ARMS + 1,): Memory.
    """

    count: Ints
    row: Tables
    normal: Ints
    slip: Floats
    leader: Ints
    stick: Ints
    joint: Ints
    pair_slip: Floats
    owner: Ints
    change: Rows
    along: Floats
    arm: Floats


def held_force_table(
    row: np.ndarray, points: int, joints: int, pairs: int, coordinates: int
) -> HeldForceTable:
    """Memory for the rows of joints, and so many contact points, frictional joints and pairs."""

    def ints(n: int) -> np.ndarray:
        return np.zeros(n, dtype=np.int64)

    return HeldForceTable(
        count=ints(4), row=row, normal=ints(points), slip=np.zeros(points), leader=ints(points),
        stick=ints(points), joint=ints(joints), pair_slip=np.zeros(pairs),
        owner=ints(3 * points + 2 * joints), change=np.zeros((pairs, 2)),
        along=np.zeros(coordinates), arm=np.zeros(2 * ARMS + 1),
    )  # fmt: skip


@njit
def find_held(L, W, U, M, H):
    """H ← the forces of the present modes."""
    points, normals, sticks, joints, shared = U.normal.shape[0], 0, 0, 0, 0
    for k in range(points):
        mode = M.mode[k]
        if mode == OPEN:
            continue
        slides = mode in (FORWARD, BACKWARD) and U.tangent[k] >= 0
        H.normal[normals], H.leader[normals] = k, M.leader[k]
        H.slip[normals] = 0.0 if not slides else 1.0 if mode == FORWARD else -1.0
        normals, shared = normals + 1, shared + (1 if is_redundant(W, U, M.mode, k) else 0)
        if mode == STICK and U.static[k] > 0.0 and (M.leader[k] == k or M.leader[k] < 0):
            H.stick[sticks] = k
            sticks += 1
    for f in range(H.pair_slip.shape[0]):
        apart = L.friction_kind[f] == APART
        H.pair_slip[f] = W.par[L.friction_par[f] + 4, 0] if apart else 0.0
    for m in range(U.joint_pair.shape[0]):
        mode, f = M.mode[points + m], U.joint_pair[m]
        if mode == STICK:
            H.joint[joints] = m
            joints += 1
        else:
            H.pair_slip[f] = 1.0 if mode == FORWARD else -1.0
    H.count[NORMALS], H.count[STICKS], H.count[JOINTS] = normals, sticks, joints
    H.count[SHARED] = shared


@njit
def may_share(H):
    """Whether there may be forces that no equation decides."""
    # what joints guide may be held twice by one contact that sticks
    few = 1 if H.row.shape[0] > 0 else 2
    return H.count[JOINTS] > 0 or H.count[STICKS] >= few or H.count[SHARED] > 0


@njit
def has_room(L, U, H, S):
    """Whether the memory S is enough for the forces H; S.count ← how many there are, and limits."""
    by_law = 0
    for n in range(H.count[JOINTS]):
        kind = L.friction_kind[U.joint_pair[H.joint[n]]]
        by_law += 1 if kind in (TORQUE, FORCE) else 0
    held = H.count[NORMALS] + H.count[STICKS] + H.count[JOINTS]
    S.count[FORCES] = H.row.shape[0] + held
    S.count[LINES] = H.count[NORMALS] + 2 * (H.count[STICKS] + by_law)
    S.count[BENT] = H.count[JOINTS] - by_law
    return (
        S.count[FORCES] <= S.force.shape[0]
        and S.count[LINES] <= S.line.shape[0]
        and S.count[BENT] <= S.bent.shape[0]
    )


@inline
def lam_of(L, W, s):
    """The multiplier of row s of the active set."""
    return W.lam[2 * L.primitive_node[L.active_set[s]], 0]


@njit
def pressing_row(L, H, f, number):
    """The row with this number of what presses friction pair f; −1 where there is none."""
    for r in range(H.row.shape[0]):
        if H.row[r, 1] == number and L.primitive_node[H.row[r, 0]] == L.friction_node[f]:
            return r
    return -1


@inline
def add_force(L, H, S, k, part):
    """The generalised force of force k grows by a part of the row H.along."""
    for n in range(3 * L.bodies):
        S.column[n, k] += part * H.along[n]


@njit
def find_columns(L, W, U, H, S):
    """S.column, S.force ← all forces by W.lam, at the position and velocities that were read."""
    n3, rows_count, points = 3 * L.bodies, H.row.shape[0], H.count[NORMALS]
    sticks = rows_count + points
    joints = sticks + H.count[STICKS]
    S.count[COORDINATES], S.count[FORCES] = n3, joints + H.count[JOINTS]
    for k in range(S.count[FORCES]):
        S.own[k] = 1 if k >= rows_count else 0
        for n in range(n3):
            S.column[n, k] = 0.0
    for r in range(rows_count):
        e, number = H.row[r, 0], H.row[r, 1]
        node, i, j = L.primitive_node[e], 3 * L.primitive_i[e], 3 * L.primitive_j[e]
        S.force[r], o = W.lam[2 * node + number, 0], 12 * node + 3 * number
        for n in range(3):
            if i < n3:
                S.column[i + n, r] -= W.block[o + n, 0]
            if j < n3:
                S.column[j + n, r] -= W.block[o + 6 + n, 0]
        for side in range(L.more.shape[0] if number == 0 else 0):
            b = L.slot_body[L.more[side, 1] // 3]
            if L.more[side, 0] == node and b < L.bodies:
                for n in range(3):
                    S.column[3 * b + n, r] -= W.block[12 * L.nodes + 6 * side + n, 0]
    for n in range(points):
        k, s = H.normal[n], U.normal[H.normal[n]]
        S.force[rows_count + n] = -U.gap_sign[k] * lam_of(L, W, s)
        fill_row(L, W, U, s, U.gap_sign[k] / U.row_unit[s], H.along)
        add_force(L, H, S, rows_count + n, 1.0)
        if H.slip[n] != 0.0:
            fill_row(L, W, U, U.tangent[k], 1.0, H.along)
            add_force(L, H, S, rows_count + n, -U.friction[k] * H.slip[n])
    for n in range(sticks, S.count[FORCES]):
        m = n - joints
        s = U.tangent[H.stick[n - sticks]] if m < 0 else U.joint_tangent[H.joint[m]]
        S.force[n] = -lam_of(L, W, s)
        fill_row(L, W, U, s, 1.0, H.along)
        add_force(L, H, S, n, 1.0)
    for f in range(H.pair_slip.shape[0]):
        kind, sign = L.friction_kind[f], H.pair_slip[f]
        H.change[f, 0] = H.change[f, 1] = 0.0
        if sign == 0.0 or kind in (TORQUE, FORCE):
            continue
        s, node, o = L.friction_tangent[f], 2 * L.friction_node[f], 0 if sign > 0.0 else ARMS
        W.rate[f, 0] = row_rate(L, W, U, s)
        find_arms(L, W, f, False, H.arm)
        x, y, a = W.lam[node, 0], W.lam[node + 1, 0], H.arm
        _, by_x, by_y = law_size(kind, a[o], a[o + 1], a[o + 2], x, y)
        H.change[f, 0], H.change[f, 1] = sign * by_x, sign * by_y
        fill_row(L, W, U, s, 1.0, H.along)
        for number in range(2):
            r = pressing_row(L, H, f, number)
            if r >= 0:
                add_force(L, H, S, r, -H.change[f, number])


@inline
def add_line(S, H, owner, given):
    """One linear limit more, without parts."""
    i = S.count[LINES]
    S.count[LINES] = i + 1
    for k in range(S.count[FORCES]):
        S.line[i, k] = 0.0
    S.given[i], S.counts[i], S.relative[i], H.owner[i] = given, 1.0, 0, owner
    return i


@njit
def find_limits(L, W, U, H, S):
    """S.line and limits that bend ← normal forces, friction of what sticks, of sliding forwards and
    back, at the position that was read. Those that stick by the row of one share its limit.
    """
    rows_count, points = H.row.shape[0], H.count[NORMALS]
    sticks = rows_count + points
    joints = sticks + H.count[STICKS]
    S.count[LINES] = S.count[BENT] = 0
    for n in range(points):
        per = 1.0 / U.row_unit[U.normal[H.normal[n]]]  # of limits of angles a torque, else 1
        S.line[add_line(S, H, H.normal[n], 0.0), rows_count + n] = per
    for n in range(sticks, joints):
        k = H.stick[n - sticks]
        for side in range(2):
            i = add_line(S, H, k, 0.0)
            S.line[i, n] = 1.0 - 2.0 * side
            for m in range(points):
                if H.normal[m] == k or H.leader[m] == k:
                    S.line[i, rows_count + m] = U.static[H.normal[m]]
    for n in range(joints, S.count[FORCES]):
        m = H.joint[n - joints]
        f, a = U.joint_pair[m], H.arm
        kind = L.friction_kind[f]
        if kind not in (TORQUE, FORCE):
            continue
        find_arms(L, W, f, True, a)
        whole = max(a[0], a[ARMS])
        per = 1.0 / (whole if whole != 0.0 else U.speed_unit[U.joint_tangent[m]])
        for side in range(2):
            i = add_line(S, H, U.normal.shape[0] + m, a[ARMS * side] * per)
            S.line[i, n] = (1.0 - 2.0 * side) * per
            S.counts[i], S.relative[i] = 1.0 if whole > 0.0 else 0.0, 1 if S.given[i] != 0.0 else 0
    for n in range(joints, S.count[FORCES]):
        m = H.joint[n - joints]
        f = U.joint_pair[m]
        kind, b = L.friction_kind[f], S.count[BENT]
        if kind in (TORQUE, FORCE):
            continue
        find_arms(L, W, f, True, H.arm)
        for number in range(2):
            S.bent[b, 1 + number] = pressing_row(L, H, f, number)
            H.owner[S.count[LINES] + 2 * b + number] = U.normal.shape[0] + m
        for k in range(2 * ARMS):
            S.arm[b, k] = H.arm[k]
        S.bent[b, 0], S.bent[b, 3], pin = n, kind, W.par[L.friction_par[f] + 4, 0]
        S.length[b] = pin if kind == PIN else U.speed_unit[U.joint_tangent[m]]
        S.count[BENT] = b + 1


@njit
def hold(L, W, U, H, S):
    """S ← all forces that hold, by W.lam, and their limits, at the position that was read."""
    find_columns(L, W, U, H, S)
    find_limits(L, W, U, H, S)


@njit
def weakest(S, P):
    """The least of the greatest least margins of all parts of the forces that hold, in forces, and
    whose it is; infinite, and −1, where all are determined.
    """
    least, part = math.inf, -1
    for n in range(share(S, P, FRICTION_RESERVE_MOST, False)):
        if part < 0 or S.least[n] * S.size[n] < least:
            least, part = S.least[n] * S.size[n], n
    return least, part


@njit
def least_margin(L, W, U, H, S, P):
    """That margin by W.lam, at the position that was read."""
    hold(L, W, U, H, S)
    least, _ = weakest(S, P)
    return least


# -- As Python calls them ----------------------------------------------------------------------


@inline
def load_multipliers(L, W, record):
    """W.lam ← the multipliers of a record (numbers,)."""
    for e in range(L.primitive_node.shape[0]):
        k, row = 2 * L.primitive_node[e], 9 * L.bodies + PER_PRIMITIVE * e
        W.lam[k, 0], W.lam[k + 1, 0] = record[row], record[row + 1]


@njit
def hold_record(L, W, U, H, S, record):
    """The same by a record (numbers,), at the position and velocities in W."""
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)
    load_multipliers(L, W, record)
    hold(L, W, U, H, S)


@kernel
def hold_forces(
    L: Layout, W: Work, U: UnilateralLayout, H: HeldForceTable, S: OpenForces, record: Floats
) -> None:
    """All forces that hold and their limits by a record (numbers,)."""
    hold_record(L, W, U, H, S, record)
