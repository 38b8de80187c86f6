"""From a state to how everything goes on that may open, stick or slide: the decision of modes.

What is closed and what is at rest follow from gaps and rates. With all rows of the active set off
the motion has accelerations without contacts; how these change by forces along the rows of what is
closed or frictional follows from the factor of the joints. That is one problem of complementarity
(`mbody.kernels.mode_problem`), whose solutions are modes. Rows of the modes that go on are set
as far as they do not depend on others, and what begins to slide, or opens, has to do so by the
accelerations with these rows, too.

Contact points come first, then frictional joints; both are called owners of modes.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import inline, njit
from mbody.core.tolerances import (
    ACCELERATION_NONE,
    ARTIFICIAL_MASS,
    COMPLEMENTARITY_PIVOT,
    CONTACT_ACCELERATION_ROUNDING,
    CONTACT_FORCE_NONE,
    CONTACT_GAP_CLOSED,
    CONTACT_ROW_LED,
    FORCE_NONE,
    MASSES_LOST,
    RATE_NONE_FRICTION,
    RATE_NONE_STOPPED,
    ROWS_DEPENDENT,
)
from mbody.kernels.complementarity import CONE, find_arms
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.contact_rows import (
    approach_of,
    fill_row,
    find_ends,
    gap_of,
    is_within,
    phase_offset,
    row_rate,
    row_value,
    written,
)
from mbody.kernels.forces import balanced_motion, signals
from mbody.kernels.friction import APART, ARMS, REACHED_PART
from mbody.kernels.mode_problem import (
    ALL_NORMALS,
    ALL_ROWS,
    EVALUATED,
    OF_RESPONSES,
    arresting_impulses,
    begin_sliding,
    find_solutions,
    take_solution,
)
from mbody.kernels.schur_ldl import factor
from mbody.kernels.state_derivative import load_state, state_derivative
from mbody.kernels.step_state import TIME

#: Modes; what slides does so along or against its tangent. A contact point is redundant where it is
#: closed and has no row, as others hold it already: forces are those of the others, of all that no
#: equation decides.
OPEN, STICK, FORWARD, BACKWARD = range(4)
#: What `decide` returns: no modes go on, one set does, one of several does; more rows than
#: there is memory for, whose number is in `ContactDecision.count`.
NONE, ONE, SEVERAL, FULL = range(4)
#: How much softer motions without mass are to impulses than their artificial mass says.
MASSLESS = 1e6


class UnilateralModes(Bundle):
    """Modes of a motion, what an event has just decided, and memory of the decision: c contact
    points, then j joints, of n coordinates, those of the ground after them.

    `mode` (c + j,): The modes.
    `leader` (c + j,): By whose row what sticks is held, often its own, and with which what is
      redundant slides; −1 where there is none.
    `closed`, `opened`, `beyond` (c,): Whether it is closed though its gap is rounding; has just
      opened; is open past the end of its edge.
    `stopped` (c + j,): Whether it has just ceased to slide.
    `begun` (c + j,): Direction in which it has just begun to slide, zero of all others.
    `touches` (c,): Whether it is closed.
    `slip` (c + j,): Signs of the rates of what slides, zero of what is at rest.
    `speed` (c + j,): Velocity scales: the fastest motion of both bodies.
    `solved` (c + j,): Modes of a solution.
    `pressing` (c,): Its normal forces, without those that are rounding.
    `place`, `order`, `ends`: Rows of normals, contact points in the order of their forces, as of
      `find_ends`.
    `y` (states,), `lam` (2 nodes,): The state; multipliers without contacts.
    `terms` (n + 3,): Sums of the terms of accelerations.
    `row`, `trial` (n + 3 or 7,), `basis` (n, n): Memory; rows that do not depend on each other.
    `count` (1,): How many these are.
    """

    mode: Ints
    leader: Ints
    closed: Ints
    opened: Ints
    beyond: Ints
    stopped: Ints
    begun: Floats
    touches: Ints
    slip: Floats
    speed: Floats
    solved: Ints
    pressing: Floats
    place: Ints
    order: Ints
    ends: Rows
    y: Floats
    lam: Floats
    terms: Floats
    row: Floats
    trial: Floats
    basis: Rows
    count: Ints


def modes_memory(
    points: int, joints: int, coordinates: int, nodes: int, states: int
) -> UnilateralModes:
    """Modes of so many contact points and frictional joints."""
    n = coordinates
    owners = ("mode", "leader", "stopped", "begun", "slip", "speed", "solved")
    shapes: dict[str, tuple[int, ...]] = {name: (points + joints,) for name in owners}
    shapes |= {"ends": (points, 2), "y": (states,), "lam": (2 * nodes,), "count": (1,)}
    shapes |= {
        "basis": (n, n),
        **dict.fromkeys(("terms", "row", "trial"), (max(n + 3, 7),)),
    }
    arrays = {
        name: np.zeros(shapes.get(name, (points,)), np.int64 if kind == "Ints" else np.float64)
        for name, kind in UnilateralModes.__annotations__.items()
    }
    return UnilateralModes(**arrays)


# -- What is closed, and what is at rest -------------------------------------------------------


@inline
def tangent_of(U, k):
    """The row along which owner k slides; −1 without friction."""
    points = U.normal.shape[0]
    return U.tangent[k] if k < points else U.joint_tangent[k - points]


@inline
def read_state(L, W, y):
    """Positions, velocities and rows ← those of a state."""
    load_state(L, W, 0.0, y)
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)


@njit
def find_speeds(L, W, U, S, M):
    """M.speed ← velocity scales of all owners, in lengths a time."""
    n3 = 3 * L.bodies
    for k in range(M.speed.shape[0]):
        most = 0.0
        for side in range(2):
            b = U.bodies[k, side]
            for n in range(3 if b < L.bodies else 0):
                most = max(most, S.scale[n3 + 3 * b + n] / S.scale[3 * b + n])
        M.speed[k] = W.size[0, 0] * most


@njit
def find_closed(L, W, U, M):
    """M.touches ← which contact points are closed at the position and velocities that were read:
    gaps that are none, within the ends of their edges.
    """
    none = CONTACT_GAP_CLOSED * W.size[0, 0]
    find_ends(L, W, U, M.ends)
    for k in range(U.normal.shape[0]):
        touches = M.closed[k] == 1
        if not touches and abs(gap_of(L, W, U, k)) <= none:
            touches = is_within(L, W, U, M.ends, k, none, RATE_NONE_FRICTION * M.speed[k])
        M.touches[k] = 1 if touches and M.opened[k] == 0 and M.beyond[k] == 0 else 0


@njit
def find_touching(L, W, S, U, M):
    """M.touches, M.speed ← those of the position and velocities in W."""
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)
    find_speeds(L, W, U, S, M)
    find_closed(L, W, U, M)


@inline
def speed_along(L, W, U, k):
    """The rate of sliding of owner k as a velocity; zero without friction."""
    s = tangent_of(U, k)
    return U.speed_unit[s] * row_rate(L, W, U, s) if s >= 0 else 0.0


@inline
def sticks(L, W, U, M, k):
    """Whether owner k is at rest."""
    slow = abs(speed_along(L, W, U, k)) <= RATE_NONE_FRICTION * M.speed[k]
    return slow or M.stopped[k] == 1


@njit
def find_slip(L, W, U, M, D):
    """M.slip ← signs of the rates of what slides. What was located as stopped moves by rounding,
    and others with it: what rests where these are stopped, too.
    """
    points, owners, n, any_stopped = U.normal.shape[0], M.slip.shape[0], 0, False
    for k in range(owners):
        any_stopped = any_stopped or M.stopped[k] == 1
    for k in range(owners if any_stopped else 0):
        s = tangent_of(U, k)
        if s >= 0 and sticks(L, W, U, M, k) and (k >= points or M.touches[k] == 1):
            fill_row(L, W, U, s, 1.0, D.R[n])
            D.before[n] = row_rate(L, W, U, s)
            n += 1
    if n > 0:
        find_delassus(L, W, D, n, MASSLESS)
        arresting_impulses(D, 0, n, D.before, D.impulse)
    for k in range(3 * L.bodies):
        M.row[k] = 0.0
        for r in range(n):
            M.row[k] += D.Y[r, k] * D.impulse[r]
    for k in range(owners):
        speed, still = speed_along(L, W, U, k), sticks(L, W, U, M, k)
        slow = abs(speed) <= RATE_NONE_STOPPED * M.speed[k]
        if any_stopped and not still and slow:
            s, left = tangent_of(U, k), 0.0
            fill_row(L, W, U, s, U.speed_unit[s], M.trial)
            for i in range(3 * L.bodies):
                left += M.trial[i] * M.row[i]
            most = max(RATE_NONE_FRICTION * M.speed[k], RATE_NONE_STOPPED * abs(speed))
            still = abs(speed + left) <= most
        M.slip[k] = 0.0 if still else 1.0 if speed > 0.0 else -1.0
        if M.begun[k] != 0.0:
            M.slip[k] = M.begun[k]


# -- The problem -------------------------------------------------------------------------------


@inline
def set_row(L, W, U, s, on):
    """Switch row s on, 1, or off, 0."""
    node = 2 * L.primitive_node[L.active_set[s]]
    W.on[s, 0], W.pad[node, 0] = on, 1.0 - on
    W.regularization_weight[node, 0] = on / (U.speed_unit[s] * U.speed_unit[s])


@njit
def all_off(L, W, U):
    """No row of the active set is on, and nothing slides."""
    for s in range(L.active_set.shape[0]):
        set_row(L, W, U, s, 0.0)
    for f in range(L.friction_kind.shape[0]):
        W.slip_sign[f, 0] = 0.0


@inline
def weight_of(L, W, k):
    """The inverse mass or inertia of coordinate k of one slot of its body, with artificial ones
    where there are none.
    """
    return W.weight[3 * L.body_slot[k // 3] + k % 3, 0]


@njit
def responses_along(L, W, D, n, softer):
    """D.Y, D.X ← motions by a unit force along each of the first n rows D.R, as far as joints
    allow, and how the multipliers of all nodes change: those of [M Gᵀ; G 0] [y; x] = [rᵀ; 0], with
    the rows that are on at W.q. What has no mass and is free to move is `softer` than its
    artificial mass.
    """
    w, refinements = 0.0, D.refinements[OF_RESPONSES]
    body_rotations(L, W, w)
    rows(L, W, w, True, True)
    for k in range(2 * L.nodes):
        W.gamma[k, 0] = 0.0
    factor(L, W, w, D.regularization[0], COMPLEMENTARITY_PIVOT)
    coordinates = 3 * L.bodies
    for r in range(n):
        for k in range(coordinates):
            W.force[k, 0] = D.R[r, k]
        for k in range(coordinates, W.force.shape[0]):
            W.force[k, 0] = 0.0
        balanced_motion(L, W, w, refinements)
        for k in range(coordinates):
            D.Y[r, k] = W.a[k, 0]
        for k in range(2 * L.nodes):
            D.X[r, k] = W.lam[k, 0]
        if refinements == 0 or softer <= 1.0:
            continue
        # one refinement more moves it by as much again
        balanced_motion(L, W, w, refinements + 1)
        for b in range(L.bodies):
            for i in range(3):
                k = 3 * b + i
                more = W.a[k, 0] - D.Y[r, k]
                # of what joints hold it is rounding
                free = abs(more) > ACCELERATION_NONE * abs(D.Y[r, k])
                if free and W.mass[k, 0] * W.weight[3 * L.body_slot[b] + i, 0] < 0.5:
                    D.Y[r, k] += softer * more


@njit
def find_delassus(L, W, D, n, softer):
    """D.Y, D.X, D.delassus, D.soft ← how velocities and joints respond to a unit impulse along each
    of the first n rows D.R, by the factor of the joints; zero of what joints and drivers lead.
    """
    responses_along(L, W, D, n, softer)
    n3 = 3 * L.bodies
    for r in range(n):
        D.soft[r] = 0.0
        for k in range(n3):
            weight = weight_of(L, W, k)
            # of what has no mass what replaces it says nothing: what it is a part of does
            part = ARTIFICIAL_MASS if W.mass[k, 0] * weight < 0.5 else 1.0
            D.soft[r] += D.R[r, k] * D.R[r, k] * part * weight
        for c in range(r + 1):
            total, other = 0.0, 0.0
            for k in range(n3):
                total += D.R[r, k] * D.Y[c, k]
                other += D.R[c, k] * D.Y[r, k]
            D.delassus[r, c] = D.delassus[c, r] = 0.5 * (total + other)
    for r in range(n):
        if D.delassus[r, r] <= CONTACT_ROW_LED * D.soft[r]:
            for c in range(n):
                D.delassus[r, c] = D.delassus[c, r] = 0.0


@njit
def find_terms(L, W, M):
    """M.terms ← sums of the terms of which accelerations are made."""
    n3 = 3 * L.bodies
    for k in range(n3 + 3):
        M.terms[k] = 0.0
    for e in range(L.primitive_node.shape[0]):
        node, i, j = L.primitive_node[e], 3 * L.primitive_i[e], 3 * L.primitive_j[e]
        if node != L.written_node[e]:
            continue  # of the active set
        for row in range(2):
            size, o = abs(W.lam[2 * node + row, 0]), 12 * node + 3 * row
            for n in range(3):
                M.terms[i + n] += abs(W.block[o + n, 0]) * size
                M.terms[j + n] += abs(W.block[o + 6 + n, 0]) * size
    for side in range(L.more.shape[0]):
        b, size = L.slot_body[L.more[side, 1] // 3], abs(W.lam[2 * L.more[side, 0], 0])
        for n in range(3):
            M.terms[3 * b + n] += abs(W.block[12 * L.nodes + 6 * side + n, 0]) * size
    for k in range(n3):
        M.terms[k] = abs(W.a[k, 0]) + weight_of(L, W, k) * M.terms[k]


@inline
def add_row(L, W, U, M, D, s, sign, owner):
    """One row more of the problem, at rest, with the acceleration along it and its rounding."""
    r = D.count[ALL_ROWS]
    D.count[ALL_ROWS] = r + 1
    D.owner[r] = owner
    fill_row(L, W, U, s, sign, D.R[r])
    gamma = sign * U.row_unit[s] * W.gamma[2 * written(L, s), 0]
    total, terms = -gamma, abs(gamma)
    for k in range(3 * L.bodies):
        total += D.R[r, k] * W.a[k, 0]
        terms += abs(D.R[r, k]) * M.terms[k]
    D.c[r], D.noise[r] = total, CONTACT_ACCELERATION_ROUNDING * terms
    D.f0[r] = D.sliding[r] = D.given[r] = 0.0
    D.kinetic[r], D.law[r], D.normal[r] = 0, CONE, -1
    return r


@inline
def add_joint(L, W, U, M, D, f, slip, owner):
    """The tangent row of frictional joint pair f."""
    s, node = L.friction_tangent[f], 2 * L.friction_node[f]
    r, o = add_row(L, W, U, M, D, s, 1.0, owner), L.friction_par[f]
    rate = row_rate(L, W, U, s)
    D.law[r], D.sliding[r], D.pair[r] = L.friction_kind[f], slip, f
    D.at[r, 0], D.at[r, 1] = M.lam[node], M.lam[node + 1]
    D.f0[r] = W.par[o + 3, 0] * rate - M.lam[2 * L.primitive_node[L.active_set[s]]]
    W.rate[f, 0] = rate
    find_arms(L, W, f, slip == 0.0, M.row)
    for n in range(2 * ARMS):
        D.arm[r, n] = M.row[n]
    coefficient, W.rate[f, 0] = M.row[2 * ARMS], 0.0
    find_arms(L, W, f, False, M.row)
    differs = M.row[2 * ARMS] != coefficient
    for n in range(2 * ARMS):
        D.kinetic_arm[r, n] = M.row[n]
        differs = differs or M.row[n] != D.arm[r, n]
    D.kinetic[r] = 1 if slip == 0.0 and differs else 0


@njit
def state_problem(L, W, U, M, D):
    """The problem ← all that is closed or frictional, at the state that was just evaluated without
    contacts.
    """
    points = U.normal.shape[0]
    for k in range(2 * L.nodes):
        M.lam[k] = W.lam[k, 0]
    find_terms(L, W, M)
    D.count[ALL_ROWS] = 0
    for k in range(points):
        if M.touches[k] == 1:
            M.place[k] = add_row(L, W, U, M, D, U.normal[k], U.gap_sign[k], k)
    D.count[ALL_NORMALS] = D.count[ALL_ROWS]
    for k in range(points):
        if M.touches[k] == 1 and U.static[k] > 0.0:
            r, slip = add_row(L, W, U, M, D, U.tangent[k], 1.0, k), M.slip[k]
            D.normal[r], D.sliding[r], D.kinetic_mu[r] = M.place[k], slip, U.friction[k]
            D.mu[r] = U.static[k] if slip == 0.0 else U.friction[k]
            D.kinetic[r] = 1 if D.mu[r] != U.friction[k] else 0
    for j in range(U.joint_pair.shape[0]):
        add_joint(L, W, U, M, D, U.joint_pair[j], M.slip[points + j], points + j)
    for f in range(L.friction_kind.shape[0]):
        if L.friction_kind[f] == APART:
            add_joint(L, W, U, M, D, f, W.par[L.friction_par[f] + 4, 0], -1)
    n = D.count[ALL_ROWS]
    find_delassus(L, W, D, n, 1.0)
    for r in range(D.count[ALL_NORMALS], n):
        if D.law[r] != CONE:
            node = 2 * L.friction_node[D.pair[r]]
            for c in range(n):
                D.by_force[r, 0, c], D.by_force[r, 1, c] = D.X[c, node], D.X[c, node + 1]


# -- Modes of a solution, and the rows that do not depend on others ----------------------------


@njit
def modes_of_solution(U, M, D):
    """M.solved, M.pressing ← modes and normal forces of the solution in D. Of what a light body
    presses against a heavy one its own motion tells.
    """
    points, n, m = U.normal.shape[0], D.count[ALL_ROWS], D.count[ALL_NORMALS]
    for k in range(M.solved.shape[0]):
        M.solved[k] = OPEN
    for r in range(n):
        k = D.owner[r]
        if k < 0:
            continue
        if r < m:
            terms = abs(D.without[r])
            for c in range(n):
                terms += abs(D.delassus[r, c]) * abs(D.f[c])
            presses = D.delassus[r, r] * abs(D.f[r]) > CONTACT_FORCE_NONE * terms
            M.pressing[k] = D.f[r] if presses else 0.0
            # smooth: its direction changes nothing
            M.solved[k] = FORWARD if D.mode[r] == 1 else OPEN
        elif k >= points or M.solved[k] != OPEN:
            slip = D.mode[r]
            M.solved[k] = FORWARD if slip > 0 else BACKWARD if slip < 0 else STICK


@njit
def is_independent(L, W, M):
    """Whether the row M.row depends on none of M.basis, lengths by those of the parts; it is one of
    them then. By the method of Gram and Schmidt, twice.
    """
    n3, size, part = 3 * L.bodies, 0.0, 0.0
    for k in range(n3):
        M.trial[k] = M.row[k] * coordinate_unit(W, k)
        size += M.trial[k] * M.trial[k]
    if size == 0.0:
        return False
    size = math.sqrt(size)
    for k in range(n3):
        M.trial[k] /= size
    for _ in range(2):
        for b in range(M.count[0]):
            along = 0.0
            for k in range(n3):
                along += M.basis[b, k] * M.trial[k]
            for k in range(n3):
                M.trial[k] -= along * M.basis[b, k]
    for k in range(n3):
        part += M.trial[k] * M.trial[k]
    part = math.sqrt(part)
    if part <= ROWS_DEPENDENT or M.count[0] == n3:
        return False
    for k in range(n3):
        M.basis[M.count[0], k] = M.trial[k] / part
    M.count[0] += 1
    return True


@inline
def coordinate_unit(W, k):
    """The length of its part of a coordinate that is a length, 1 of an angle."""
    return W.size[1 + k // 3, 0] if k % 3 < 2 else 1.0


@njit
def joints_in_basis(L, W, M):
    """M.basis ← the rows of the joints."""
    n3 = 3 * L.bodies
    M.count[0] = 0
    for e in range(L.primitive_node.shape[0]):
        node, i, j = L.primitive_node[e], 3 * L.primitive_i[e], 3 * L.primitive_j[e]
        for row in range(2 if node == L.written_node[e] else 0):
            o = 12 * node + 3 * row
            for k in range(n3 + 3):
                M.row[k] = 0.0
            for n in range(3):
                M.row[i + n] += W.block[o + n, 0]
                M.row[j + n] += W.block[o + 6 + n, 0]
            for side in range(L.more.shape[0] if row == 0 else 0):
                if L.more[side, 0] == node:
                    b = L.slot_body[L.more[side, 1] // 3]
                    for n in range(3):
                        M.row[3 * b + n] += W.block[12 * L.nodes + 6 * side + n, 0]
            is_independent(L, W, M)


@inline
def row_joins(L, W, U, M, s):
    """Whether row s of the active set depends on none of those that are on; it is on then."""
    fill_row(L, W, U, s, 1.0, M.row)
    if not is_independent(L, W, M):
        return False
    set_row(L, W, U, s, 1.0)
    return True


@njit
def along_one_row(L, W, U, M, k, other):
    """Whether two contact points of the same bodies slide together, as corners on one edge do."""
    a, b, c, d = U.bodies[k, 0], U.bodies[k, 1], U.bodies[other, 0], U.bodies[other, 1]
    if (a != c or b != d) and (a != d or b != c):
        return False
    fill_row(L, W, U, U.tangent[k], 1.0, M.row)
    fill_row(L, W, U, U.tangent[other], 1.0, M.trial)
    one, two, both = 0.0, 0.0, 0.0
    for n in range(3 * L.bodies):
        x, y = M.row[n] * coordinate_unit(W, n), M.trial[n] * coordinate_unit(W, n)
        one, two, both = one + x * x, two + y * y, both + x * y
    return abs(both) >= (1.0 - ROWS_DEPENDENT) * (math.sqrt(one) * math.sqrt(two))


@njit
def set_independent(L, W, U, M):
    """Switch on rows of M.solved that do not depend on others: of contact points normal and
    tangent, those that press first, then of frictional joints that stick, last of contact points
    without force. M.leader ← by whose row what sticks is held.
    """
    points, n = U.normal.shape[0], 0
    joints_in_basis(L, W, M)
    for k in range(M.leader.shape[0]):
        M.leader[k] = -1
    for k in range(points):
        if M.solved[k] != OPEN:
            i = n
            while i > 0 and M.pressing[M.order[i - 1]] < M.pressing[k]:
                M.order[i] = M.order[i - 1]
                i -= 1
            M.order[i], n = k, n + 1
    for i in range(n):
        if M.pressing[M.order[i]] > 0.0:
            row_joins(L, W, U, M, U.normal[M.order[i]])
    for k in range(points):
        sticks = M.solved[k] == STICK and W.on[U.normal[k], 0] != 0.0
        if sticks and row_joins(L, W, U, M, U.tangent[k]):
            M.leader[k] = k
    for k in range(points, M.leader.shape[0]):
        if M.solved[k] == STICK and row_joins(L, W, U, M, tangent_of(U, k)):
            M.leader[k] = k
    for i in range(n):
        if not M.pressing[M.order[i]] > 0.0:
            row_joins(L, W, U, M, U.normal[M.order[i]])
    for k in range(points):
        if M.leader[k] < 0 and M.solved[k] != OPEN and U.tangent[k] >= 0:
            find_leader(L, W, U, M, k)


@njit
def find_leader(L, W, U, M, k):
    """M.leader ← by whose row contact point k sticks, or with which one it slides that is
    redundant.
    """
    for other in range(U.normal.shape[0]):
        leads = other != k and M.leader[k] < 0 and M.solved[other] == M.solved[k]
        if leads and M.solved[k] == STICK:
            leads = M.leader[other] == other
        elif leads:
            leads = is_redundant(W, U, M.solved, k) and not is_redundant(W, U, M.solved, other)
        if leads and along_one_row(L, W, U, M, other, k):
            M.leader[k] = other


@inline
def is_redundant(W, U, mode, k):
    """Whether contact point k is closed by these modes and has no row."""
    return mode[k] != OPEN and W.on[U.normal[k], 0] == 0.0


@njit
def set_modes(L, W, U, M):
    """Set the modes M.solved at the position that was read: rows, directions of sliding, and where
    what is held begins.
    """
    points = U.normal.shape[0]
    all_off(L, W, U)
    set_independent(L, W, U, M)
    for k in range(M.mode.shape[0]):
        M.mode[k], s = M.solved[k], tangent_of(U, k)
        f = U.pair[k] if k < points else U.joint_pair[k - points]
        if k < points:
            normal = U.normal[k]
            if M.mode[k] == OPEN or W.on[normal, 0] == 0.0:
                continue
            if U.one_way[k]:
                W.anchor[normal, 0] = W.phi[2 * written(L, normal), 0]
        if M.mode[k] != STICK:
            if f >= 0:
                W.slip_sign[f, 0] = 1.0 if M.mode[k] == FORWARD else -1.0
        elif M.leader[k] == k:
            if k < points and U.circles[k]:
                phase = L.primitive_par[L.active_set[s]] + 6
                W.par[phase, 0] += phase_offset(L, W, U, k)
            else:
                W.anchor[s, 0] = row_value(L, W, U, s)


# -- The decision ------------------------------------------------------------------------------


@njit
def evaluate_state(L, W, S, D):
    """Project the state and evaluate its derivative."""
    signals(L, W, 0.0, L.signal_law.shape[0])
    state_derivative(L, W, S, S.state[TIME], S.y, 0, D.refinements[EVALUATED], True)


@njit
def acceleration_along(L, W, U, M, s, sign):
    """The acceleration along row s, and the sum of its terms."""
    fill_row(L, W, U, s, sign, M.row)
    gamma = sign * U.row_unit[s] * W.gamma[2 * written(L, s), 0]
    total, terms = -gamma, abs(gamma)
    for k in range(3 * L.bodies):
        part = M.row[k] * W.a[k, 0]
        total, terms = total + part, terms + abs(part)
    return total, terms


@inline
def moves_along(L, W, U, M, s, sign):
    """Whether the acceleration along row s has a sign, or is rounding of its terms."""
    total, terms = acceleration_along(L, W, U, M, s, sign)
    return total >= -FORCE_NONE * terms


@njit
def goes_on(L, W, U, M):
    """Whether the accelerations that were just evaluated agree with the solution: what slides may
    jam though its modes are consistent, friction that is followed from none reach another solution,
    and the problem have lost the heavy beside the light.
    """
    points, uneven = U.normal.shape[0], 0.0
    if L.friction_kind.shape[0] > 0 and W.friction[REACHED_PART, 0] < 1.0:
        return False
    for k in range(M.solved.shape[0]):
        # of what is smooth the direction changes nothing
        if M.solved[k] not in (FORWARD, BACKWARD) or M.slip[k] != 0.0:
            continue
        sign = 1.0 if M.solved[k] == FORWARD else -1.0
        frictional = k >= points or U.static[k] > 0.0
        if frictional and not moves_along(L, W, U, M, tangent_of(U, k), sign):
            return False
    for k in range(points):
        for side in range(2 if M.touches[k] == 1 else 0):
            if U.bodies[k, side] < L.bodies:
                uneven = max(uneven, U.uneven[U.bodies[k, side]])
    for k in range(points if uneven > MASSES_LOST else 0):
        opens = M.touches[k] == 1 and M.solved[k] == OPEN
        if opens and not moves_along(L, W, U, M, U.normal[k], U.gap_sign[k]):
            return False
    return True


@njit
def most_rows(L, U, M):
    """How many rows the problem of what is closed has, at most."""
    n = U.joint_pair.shape[0]
    for k in range(M.touches.shape[0]):
        n += 2 * M.touches[k]
    for f in range(L.friction_kind.shape[0]):
        n += 1 if L.friction_kind[f] == APART else 0
    return n


@njit
def decide(A):
    """M.mode, M.leader, rows and directions of sliding ← modes that go on from the state S.y, which
    stays as it is. A: a `UnilateralMotion`; the problem is stated by the rows of joints alone.
    """
    L, W, S, U, M, D = A.joints, A.joint_work, A.stepping, A.unilateral, A.modes, A.decision
    points, P = U.normal.shape[0], A.problem
    for k in range(M.y.shape[0]):
        M.y[k] = S.y[k]
    for k in range(M.mode.shape[0]):
        M.mode[k], M.leader[k] = OPEN if k < points else STICK, -1
    all_off(A.whole, A.work, U)
    all_off(L, W, U)
    W.time[0, 0] = S.state[TIME]
    signals(L, W, 0.0, L.signal_law.shape[0])
    load_state(L, W, 0.0, S.y)
    find_touching(L, W, S, U, M)
    for k in range(points):
        rate = approach_of(L, W, U, k)
        if abs(rate) > RATE_NONE_FRICTION * M.speed[k] and M.closed[k] == 0:
            M.touches[k] = 0
    D.count[ALL_ROWS] = most_rows(L, U, M)
    if D.count[ALL_ROWS] > D.c.shape[0]:
        return FULL
    find_slip(L, W, U, M, D)
    evaluate_state(L, W, S, D)
    state_problem(L, W, U, M, D)
    restore_state(S, M)
    found, number = find_solutions(D, P, True), 0
    while number < found:
        take_solution(D, number)
        begin_sliding(D, P)
        modes_of_solution(U, M, D)
        read_state(A.whole, A.work, S.y)
        set_modes(A.whole, A.work, U, M)
        evaluate_state(A.whole, A.work, S, D)
        restore_state(S, M)
        number += 1
        if goes_on(A.whole, A.work, U, M):
            return SEVERAL if found > 1 else ONE
    return NONE


@inline
def restore_state(S, M):
    """The state as it was before it was projected."""
    for k in range(M.y.shape[0]):
        S.y[k] = M.y[k]
