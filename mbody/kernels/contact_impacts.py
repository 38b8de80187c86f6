"""Impacts of closed contact points: velocities jump by impulses along their rows.

Responses to the rows come from the factor of the joints, without rows of the active set; the
impulses are a problem of complementarity (`mbody.kernels.mode_problem`), with those of friction in
joints, which is limited by the impulses of their reactions.

Impacts that follow each other ever faster end in finite time: below the shortest flight that is
resolved one without restitution follows, and what rocks from one place to another stops.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import (
    CONTACT_ACCELERATION_ROUNDING,
    CONTACT_FLIGHT_SHORTEST,
    CONTACT_PULL_NONE,
    RATE_NONE_FRICTION,
    TINY,
)
from mbody.kernels.complementarity import CONE, ContactProblem, find_arms
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.contact_modes import (
    FULL,
    MASSLESS,
    NONE,
    ONE,
    UnilateralModes,
    acceleration_along,
    evaluate_state,
    find_delassus,
    find_touching,
    most_rows,
    set_row,
    weight_of,
)
from mbody.kernels.contact_rows import UnilateralLayout, approach_of, fill_row, row_rate
from mbody.kernels.friction import APART, ARMS, FORCE, PULL, TORQUE
from mbody.kernels.layout import Layout, Work
from mbody.kernels.mode_problem import (
    ALL_NORMALS,
    ALL_ROWS,
    ContactDecision,
    arrested,
    arresting_impulses,
    impact,
    impact_without_collision,
    impulses_of_modes,
    prepare_arrest,
    solve_impulses,
    sticks,
    take_solution,
)
from mbody.kernels.state_derivative import load_state
from mbody.kernels.step_state import NEXT, TIME

#: How contacts are struck: by their laws; without restitution; where nothing approaches (Painlevé);
#: so that they neither open nor close, nor what stuck begins to slide.
BY_LAWS, STILL, COLLISIONLESS, ARREST = range(4)
#: Numbers in `ContactImpact.energy`: what the impulses exchange, what replaced masses take, the
#: terms of what is exchanged.
EXCHANGED, TAKEN, TERMS = range(3)
#: What `resolve` returns: nothing strikes; an impact; one after which what strikes rests; none has
#: a solution; more rows than there is memory for.
QUIET, STRUCK, RESTED, WEDGED, SMALL = range(5)
#: What rocks strikes with at most so many times the rate that its pull gives between two strikes.
ROCKING = 100.0
#: How often velocities after an impact are refined, at most.
REFINEMENTS = 3
#: The first step after a rebound is this much longer than the flight.
FLIGHT = 1.2


class ContactImpact(Bundle):
    """An impact: c contact points, j frictional joints.

    `restitution`, `newton` (c,): Coefficients; whether Newton's law holds, else Poisson's.
    `held` (j,): Whether a frictional joint does not slide.
    `normal` (c,), `tangential` (c + j,): Impulses, of friction in joints too.
    `before` (c,): Rates of gaps before.
    `gained` (c + j,), `moved` (c,): Kinetic energy by each, below zero where it took; what the
      motion of each gave, of stops that move.
    `driven` (drivers,): Work of drivers.
    `jump` (coordinates,): By which velocities change.
    `energy` (3,): See above.
    `hit` (c,), `struck` (c,): Whether it strikes; when it was struck last.
    `first`, `rested` (1,): The contact point that strikes fastest; how long it flies yet until it
      rests.
    `on` (rows,): Memory.
    """

    restitution: Floats
    newton: Ints
    held: Ints
    normal: Floats
    tangential: Floats
    before: Floats
    gained: Floats
    moved: Floats
    driven: Floats
    jump: Floats
    energy: Floats
    hit: Ints
    struck: Floats
    first: Ints
    rested: Floats
    on: Floats


def impact_memory(L: Layout, points: int, joints: int) -> ContactImpact:
    """An impact of so many contact points and frictional joints."""
    shapes = {"held": joints, "jump": 3 * L.bodies, "driven": len(L.driver_node)}
    shapes |= {"energy": 3, "on": len(L.active_set), "first": 1, "rested": 1}
    shapes |= dict.fromkeys(("gained", "tangential"), points + joints)
    arrays = {
        name: np.zeros(shapes.get(name, points), np.int64 if kind == "Ints" else np.float64)
        for name, kind in ContactImpact.__annotations__.items()
    }
    return ContactImpact(**arrays)


@inline
def add_struck(L, W, U, D, s, sign, owner):
    """One row more, with the velocity along it and its rounding."""
    r, terms = D.count[ALL_ROWS], 0.0
    D.count[ALL_ROWS] = r + 1
    fill_row(L, W, U, s, sign, D.R[r])
    for k in range(3 * L.bodies):
        terms += abs(D.R[r, k] * W.v[k, 0])
    D.before[r], D.noise[r] = sign * row_rate(L, W, U, s), CONTACT_ACCELERATION_ROUNDING * terms
    D.owner[r], D.law[r], D.normal[r], D.kinetic[r] = owner, CONE, -1, 0
    D.kept_slip[r], D.outcomes[r] = 0.0, 1
    return r


@inline
def add_struck_joint(L, W, U, M, D, f, owner):
    """The row of friction pair f of a joint, unless its friction is a given force."""
    kind = L.friction_kind[f]
    if kind in (TORQUE, FORCE, PULL):
        return
    r = add_struck(L, W, U, D, L.friction_tangent[f], 1.0, owner)
    D.law[r], D.pair[r], W.rate[f, 0] = kind, f, D.before[r]
    if kind == APART:
        D.kept_slip[r] = W.par[L.friction_par[f] + 4, 0]
    find_arms(L, W, f, False, M.row)
    for n in range(2 * ARMS):
        D.arm[r, n] = M.row[n]


@njit
def responses_without_rows(L, W, U, D, I, softer):
    """Responses to the rows D.R, with no row of the active set on."""
    count = L.active_set.shape[0]
    for s in range(count):
        I.on[s] = W.on[s, 0]
        set_row(L, W, U, s, 0.0)
    find_delassus(L, W, D, D.count[ALL_ROWS], softer)
    for s in range(count):
        set_row(L, W, U, s, I.on[s])


@njit
def struck_rows(L, W, U, M, D, I, kind):
    """D.R ← rows of normals, then of tangents that are struck, then of friction in joints; returns
    their number, after which those of joints that are held follow.
    """
    points, fastest = U.normal.shape[0], 0.0
    D.count[ALL_ROWS] = 0
    for k in range(points):
        I.before[k] = approach_of(L, W, U, k)
        if M.touches[k] == 1:
            fastest = max(fastest, -I.before[k])
    # what opens, or slides, faster than it strikes goes on to
    arrests = kind == ARREST
    for k in range(points):
        if M.touches[k] == 1 and not (arrests and I.before[k] > fastest):
            r = M.place[k] = add_struck(L, W, U, D, U.normal[k], U.gap_sign[k], k)
            D.restitution[r] = 0.0 if kind == STILL else I.restitution[k]
            D.newton[r] = I.newton[k]
    D.count[ALL_NORMALS] = D.count[ALL_ROWS]
    for r in range(D.count[ALL_NORMALS]):
        k = D.owner[r]
        s = U.tangent[k]
        if s >= 0 and (abs(row_rate(L, W, U, s)) <= fastest if arrests else U.friction[k] > 0.0):
            along = add_struck(L, W, U, D, s, 1.0, k)
            D.normal[along], D.mu[along] = r, U.friction[k]
    acts = kind in (BY_LAWS, STILL)
    for j in range(U.joint_pair.shape[0] if acts else 0):
        if kind == BY_LAWS or I.held[j] == 0:
            add_struck_joint(L, W, U, M, D, U.joint_pair[j], points + j)
    for f in range(L.friction_kind.shape[0] if acts else 0):
        if L.friction_kind[f] == APART:
            add_struck_joint(L, W, U, M, D, f, -1)
    n = D.count[ALL_ROWS]
    for j in range(U.joint_tangent.shape[0]):
        if kind == STILL and I.held[j] == 1:
            add_struck(L, W, U, D, U.joint_tangent[j], 1.0, -1)
    return n


@njit
def hold(L, D, n, held):
    """Responses to the first n rows where the `held` ones after them do not move: these take their
    part of every impulse.
    """
    prepare_arrest(D, n, held)
    for c in range(n):
        for i in range(held):
            D.shifted[i] = D.delassus[c, n + i]
        arrested(D, n, held, D.shifted, D.impulse)
        for i in range(held):
            for k in range(3 * L.bodies):
                D.Y[c, k] += D.Y[n + i, k] * D.impulse[i]
            for k in range(2 * L.nodes):
                D.X[c, k] += D.X[n + i, k] * D.impulse[i]
            for r in range(n):
                D.delassus[r, c] += D.delassus[r, n + i] * D.impulse[i]


@njit
def strike(L, W, U, M, D, P, I, kind):
    """I ← an impact of the contact points M.touches at the position and velocities in W; whether
    there is one, or memory for more rows is needed.
    """
    D.count[ALL_ROWS] = most_rows(L, U, M)
    if D.count[ALL_ROWS] > D.c.shape[0]:
        return FULL
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)
    n = struck_rows(L, W, U, M, D, I, kind)
    held = D.count[ALL_ROWS] - n
    responses_without_rows(L, W, U, D, I, MASSLESS)
    D.count[ALL_ROWS] = n
    if held > 0:
        hold(L, D, n, held)
    for r in range(D.count[ALL_NORMALS], n):
        node = 2 * L.friction_node[D.pair[r]] if D.law[r] != CONE else 0
        for c in range(n if D.law[r] != CONE else 0):
            D.by_force[r, 0, c], D.by_force[r, 1, c] = D.X[c, node], D.X[c, node + 1]
    found = True
    if kind == ARREST:
        arresting_impulses(D, 0, n, D.before, D.impulse)
    elif kind == COLLISIONLESS:
        found = impact_without_collision(D, P)
    else:
        found = impact(D, P)
    if found:
        for k in range(3 * L.bodies):
            I.jump[k] = 0.0
        add_jump(L, D, I, n, D.impulse)
        if kind in (BY_LAWS, STILL):
            refine_jump(L, M, D, P, I, n)
        spread_impulses(L, W, D, I, n, kind)
    return ONE if found else NONE


@njit
def add_jump(L, D, I, n, impulse):
    """I.jump ← that by n impulses more."""
    for k in range(3 * L.bodies):
        for r in range(n):
            I.jump[k] += D.Y[r, k] * impulse[r]


@njit
def refine_jump(L, M, D, P, I, n):
    """I.jump, D.impulse ← with what is left of the laws: great impulses that cancel on a light body
    have no digits for its velocities, little ones beside them do. Of the parts of the impact the
    first has these.
    """
    m, little = D.count[ALL_NORMALS], D.f
    take_solution(D, -1)
    for r in range(m):
        D.w[r] = D.given_law[r]
    for _ in range(REFINEMENTS):
        off, strikes = False, False
        for r in range(n):
            if D.law[r] != CONE:
                D.shifted[r] = D.before[r]
                for k in range(3 * L.bodies):
                    D.shifted[r] += D.R[r, k] * I.jump[k]
                continue
            rate = D.before[r]
            for k in range(3 * L.bodies):
                rate += D.R[r, k] * I.jump[k]
            least = RATE_NONE_FRICTION * M.speed[D.owner[r]]
            strikes = strikes or (r < m and rate < -least)
            if r < m and D.newton[r] == 1:
                rate += D.restitution[r] * min(D.before[r], 0.0)
            holds = sticks(D, r) if r >= m else D.mode[r] == 1
            off, D.shifted[r] = off or (holds and abs(rate) > least), rate
        if not (off or strikes):
            return
        found = off and impulses_of_modes(D, D.shifted, little)
        if not found:
            for r in range(m):
                D.given_law[r] = 0.0
            found = solve_impulses(D, P, False, little)
            for r in range(m):
                D.given_law[r] = D.w[r]
        if not found:
            return
        add_jump(L, D, I, n, little)
        for r in range(n):
            D.impulse[r] += little[r]


@njit
def spread_impulses(L, W, D, I, n, kind):
    """I ← the impulses of n rows by contact points, and the energies of the jump."""
    n3 = 3 * L.bodies
    for k in range(I.normal.shape[0]):
        I.normal[k] = I.moved[k] = 0.0
    for k in range(I.gained.shape[0]):
        I.tangential[k] = I.gained[k] = 0.0
    for i in range(I.energy.shape[0]):
        I.energy[i] = 0.0
    for k in range(n3):
        mass, v, jump = W.mass[k, 0], W.v[k, 0], I.jump[k]
        weight = W.share[L.body_slot[k // 3], 0] * weight_of(L, W, k)
        if mass * weight < 0.5:
            I.energy[TAKEN] += jump / (MASSLESS * weight) * (v + 0.5 * jump)
    for r in range(n):
        k, impulse, along, across, terms = D.owner[r], D.impulse[r], 0.0, 0.0, 0.0
        for c in range(n3):
            row, v, jump = D.R[r, c], W.v[c, 0], I.jump[c]
            along, across = along + row * v, across + row * jump
            terms += abs(row) * abs(v + 0.5 * jump)
        I.gained[k] += impulse * (D.before[r] + 0.5 * across) if k >= 0 else 0.0
        I.energy[EXCHANGED] += 0.5 * abs(impulse) * (abs(D.before[r] + across) + abs(D.before[r]))
        I.energy[TERMS] += abs(impulse) * terms
        if r < D.count[ALL_NORMALS]:
            I.normal[k], I.moved[k] = impulse, impulse * (along - D.before[r])
        elif k >= 0:
            I.tangential[k] = impulse
    for d in range(L.driver_node.shape[0]):
        # the impulse of a driver's effort is −λ
        node, effort = 2 * L.driver_node[d], 0.0
        for r in range(n):
            effort -= D.X[r, node] * D.impulse[r]
        I.driven[d] = effort * W.nu[node, 0]
    # what stops that move and drivers give to what is arrested is rounding by then
    for k in range(I.moved.shape[0] if kind == ARREST else 0):
        I.moved[k] = 0.0
    for d in range(I.driven.shape[0] if kind == ARREST else 0):
        I.driven[d] = 0.0


# -- Impacts of what approaches, until it flies or rests ---------------------------------------


@njit
def switch_off(L, W, U):
    """No row of the active set is on: what stuck slips; what slides goes on to, but no contact."""
    for s in range(L.active_set.shape[0]):
        set_row(L, W, U, s, 0.0)
    for k in range(U.pair.shape[0]):
        if U.pair[k] >= 0:
            W.slip_sign[U.pair[k], 0] = 0.0


@njit
def set_jump(L, W, S, M, D, I):
    """The state ← that before the impact with the velocities after it, evaluated."""
    n3 = 3 * L.bodies
    for k in range(n3):
        S.y[n3 + k] = M.y[n3 + k] + I.jump[k]
    evaluate_state(L, W, S, D)


@njit
def find_hits(L, W, S, U, M, I):
    """I.hit, I.first ← which contact points strike, and the one that does so fastest."""
    I.first[0] = -1
    find_touching(L, W, S, U, M)
    for k in range(U.normal.shape[0]):
        rate = approach_of(L, W, U, k)
        strikes = M.touches[k] == 1 and rate < -RATE_NONE_FRICTION * M.speed[k]
        I.hit[k] = 1 if strikes else 0
        if strikes and (I.first[0] < 0 or rate < approach_of(L, W, U, I.first[0])):
            I.first[0] = k


@njit
def resolve(L, W, S, U, M, D, P, I):
    """One impact of what approaches at the state S.y, which becomes that after it; I.rested ← how
    long it flies yet where it rests then.
    """
    n3, t, joints_hold = 3 * L.bodies, S.state[TIME], False
    for k in range(M.y.shape[0]):
        M.y[k] = S.y[k]
    load_state(L, W, 0.0, S.y)
    W.time[0, 0] = t
    find_hits(L, W, S, U, M, I)
    k, I.rested[0] = I.first[0], 0.0
    if k < 0:
        return QUIET
    for j in range(U.joint_tangent.shape[0]):
        I.held[j] = 1 if W.on[U.joint_tangent[j], 0] != 0.0 else 0
        joints_hold = joints_hold or I.held[j] == 1
    found = strike(L, W, U, M, D, P, I, BY_LAWS)
    if found != ONE:
        return SMALL if found == FULL else WEDGED
    rate, touching = I.before[k], 0
    for n in range(M.touches.shape[0]):
        touching += M.touches[n]
    switch_off(L, W, U)
    set_jump(L, W, S, M, D, I)
    up = approach_of(L, W, U, k)
    pull, terms = acceleration_along(L, W, U, M, U.normal[k], U.gap_sign[k])
    flies = up > RATE_NONE_FRICTION * M.speed[k] and pull < 0.0
    flight = -2.0 * up / pull if flies else 0.0
    # where both fall alike nothing brings them back, of which rounding says a little
    pulled = max(abs(pull), CONTACT_PULL_NONE * terms, TINY)
    short = CONTACT_FLIGHT_SHORTEST * math.sqrt(W.size[0, 0] / pulled)
    # what joints that slip and stick again throw back comes sooner each time, too
    again = t - I.struck[k] < short
    soon = again and joints_hold
    # what rocks from one place to another strikes ever sooner without a flight
    rocks = again and -rate <= ROCKING * pulled * short and not (flies or soon) and touching > 1
    I.struck[k] = t
    if not (rocks or soon or (flies and flight < short)):
        if flies:
            S.state[NEXT] = min(S.state[NEXT], FLIGHT * flight)
        return STRUCK
    left = 1.0 - I.restitution[k]
    if flies and not soon:
        I.rested[0] = flight / (left if left != 0.0 else 1.0)
    for n in range(n3):
        S.y[n3 + n] = M.y[n3 + n]
    for j in range(I.held.shape[0]):
        I.held[j] = I.held[j] if soon else 0
    load_state(L, W, 0.0, S.y)
    kind = ARREST if rocks else STILL
    if strike(L, W, U, M, D, P, I, kind) != ONE:
        return WEDGED
    set_jump(L, W, S, M, D, I)
    return RESTED


# -- As Python calls them ----------------------------------------------------------------------


@kernel
def strike_contacts(
    L: Layout,
    W: Work,
    U: UnilateralLayout,
    M: UnilateralModes,
    D: ContactDecision,
    P: ContactProblem,
    I: ContactImpact,
    kind: int,
) -> int:
    """See `strike`."""
    return strike(L, W, U, M, D, P, I, kind)


@kernel
def tangent_responses(
    L: Layout,
    W: Work,
    U: UnilateralLayout,
    D: ContactDecision,
    I: ContactImpact,
    which: Ints,
    softer: float,
) -> None:
    """Rates along the tangents of some contact points, D.before, and responses to them, which have
    no mass `softer` than their artificial one.
    """
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)
    D.count[ALL_ROWS] = 0
    for n in range(which.shape[0]):
        add_struck(L, W, U, D, U.tangent[which[n]], 1.0, which[n])
    responses_without_rows(L, W, U, D, I, softer)
