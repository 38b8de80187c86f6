"""Impacts of closed contact points: velocities jump by impulses along their rows.

Responses to the rows come from the factor of the joints, without rows of the active set; the
impulses are a problem of complementarity (`mbody.kernels.contact_decision`). Frictional joints that
are held take their part of every impulse.
"""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import CONTACT_ACCELERATION_ROUNDING
from mbody.kernels.complementarity import CONE, ContactProblem
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.contact_decision import (
    ALL_NORMALS,
    ALL_ROWS,
    ContactDecision,
    arrested,
    arresting_impulses,
    impact,
    impact_without_collision,
    prepare_arrest,
)
from mbody.kernels.contact_modes import (
    FULL,
    MASSLESS,
    NONE,
    ONE,
    UnilateralModes,
    find_delassus,
    most_rows,
    set_row,
    weight_of,
)
from mbody.kernels.contact_rows import UnilateralLayout, approach_of, fill_row, row_rate
from mbody.kernels.layout import Layout, Work

#: How contacts are struck: by their laws; without restitution; where nothing approaches (Painlevé);
#: so that they neither open nor close, nor what stuck begins to slide.
BY_LAWS, STILL, COLLISIONLESS, ARREST = range(4)
#: Numbers in `ContactImpact.energy`: what the impulses exchange, what replaced masses take, the
#: terms of what is exchanged.
EXCHANGED, TAKEN, TERMS = range(3)


class ContactImpact(Bundle):
    """An impact: c contact points, j frictional joints.

    `restitution`, `newton` (c,): Coefficients; whether Newton's law holds, else Poisson's.
    `held` (j,): Whether a frictional joint does not slide.
    `normal`, `tangential` (c,): Impulses.
    `before` (c,): Rates of gaps before.
    `gained`, `moved` (c,): Kinetic energy by each, below zero where it took; what the motion of
      each gave, of stops that move.
    `jump`, `momentum` (coordinates,): By which velocities change; momentum that joints gave.
    `energy` (3,): See above.
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
    jump: Floats
    momentum: Floats
    energy: Floats
    on: Floats


def impact_memory(points: int, joints: int, coordinates: int, rows_on: int) -> ContactImpact:
    """An impact of so many contact points, frictional joints and rows of the active set."""
    shapes = {"held": joints, "jump": coordinates, "momentum": coordinates}
    shapes |= {"energy": 3, "on": rows_on}
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
    return r


@njit
def responses_without_rows(L, W, U, D, I, regularization, refinements, softer):
    """Responses to the rows D.R, with no row of the active set on."""
    count = L.active_set.shape[0]
    for s in range(count):
        I.on[s] = W.on[s, 0]
        set_row(L, W, U, s, 0.0)
    find_delassus(L, W, D, D.count[ALL_ROWS], regularization, refinements, softer)
    for s in range(count):
        set_row(L, W, U, s, I.on[s])


@njit
def struck_rows(L, W, U, M, D, I, kind):
    """D.R ← rows of normals, then of tangents that are struck; returns their number, after which
    those of joints that are held follow.
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
            for r in range(n):
                D.delassus[r, c] += D.delassus[r, n + i] * D.impulse[i]


@njit
def strike(L, W, U, M, D, P, I, kind, regularization, refinements):
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
    responses_without_rows(L, W, U, D, I, regularization, refinements, MASSLESS)
    D.count[ALL_ROWS] = n
    if held > 0:
        hold(L, D, n, held)
    found = True
    if kind == ARREST:
        arresting_impulses(D, 0, n, D.before, D.impulse)
    elif kind == COLLISIONLESS:
        found = impact_without_collision(D, P)
    else:
        found = impact(D, P)
    if found:
        spread_impulses(L, W, D, I, n)
    return ONE if found else NONE


@njit
def spread_impulses(L, W, D, I, n):
    """I ← the impulses of n rows by contact points, the jump, and its energies."""
    n3 = 3 * L.bodies
    for k in range(I.normal.shape[0]):
        I.normal[k] = I.tangential[k] = I.gained[k] = I.moved[k] = 0.0
    for i in range(I.energy.shape[0]):
        I.energy[i] = 0.0
    for k in range(n3):
        I.jump[k] = 0.0
        for r in range(n):
            I.jump[k] += D.Y[r, k] * D.impulse[r]
        mass, v, jump = W.mass[k, 0], W.v[k, 0], I.jump[k]
        I.momentum[k] = mass * jump
        weight = W.share[L.body_slot[k // 3], 0] * weight_of(L, W, k)
        if mass * weight < 0.5:
            I.energy[TAKEN] += jump / (MASSLESS * weight) * (v + 0.5 * jump)
    for r in range(n):
        k, impulse, along, across, terms = D.owner[r], D.impulse[r], 0.0, 0.0, 0.0
        for c in range(n3):
            row, v, jump = D.R[r, c], W.v[c, 0], I.jump[c]
            along, across = along + row * v, across + row * jump
            terms += abs(row) * abs(v + 0.5 * jump)
            I.momentum[c] -= row * impulse
        I.gained[k] += impulse * (D.before[r] + 0.5 * across)
        I.energy[EXCHANGED] += 0.5 * abs(impulse) * (abs(D.before[r] + across) + abs(D.before[r]))
        I.energy[TERMS] += abs(impulse) * terms
        if r < D.count[ALL_NORMALS]:
            I.normal[k], I.moved[k] = impulse, impulse * (along - D.before[r])
        else:
            I.tangential[k] = impulse


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
    regularization: float,
    refinements: int,
) -> int:
    """See `strike`."""
    return strike(L, W, U, M, D, P, I, kind, regularization, refinements)


@kernel
def tangent_responses(
    L: Layout,
    W: Work,
    U: UnilateralLayout,
    D: ContactDecision,
    I: ContactImpact,
    which: Ints,
    regularization: float,
    refinements: int,
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
    responses_without_rows(L, W, U, D, I, regularization, refinements, softer)
