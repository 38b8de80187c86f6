"""Time stepping with impulses for many contacts: Moreau's midpoint rule as Jean has it.

    q_m = q + ½h v,   M (v⁺ − v) = h f(q_m, v, t_m) − Gᵀ p + Wᵀ P,   q⁺ = q_m + ½h v⁺,

G and W at q_m. The rows of joints and drivers hold for the mean velocity, G (v + v⁺) = 2ν, so that
joints take no energy; contacts by complementarity at v⁺ (`mbody.kernels.contact_impulses`):

    γ_N⁺ ≥ −g/h of an open gap g,   γ_N⁺ ≥ −e γ_N⁻ of a contact with restitution e that is closed.

At the end of the step positions are projected onto the joints, and velocities onto their rows.
Without contacts and joints this is the leapfrog method. With the mean velocity v̄ the work of all
forces, h f·v̄ − p·ν + P·W v̄, is the change of the kinetic energy ½ vᵀ M v to rounding. The account
has the work of loads on the whole way, so that its balance is what projections have changed.

No event is located and no step refused; order one where contacts close or slip. Moreau (1988);
Jean (1999); Acary, Brogliato: Numerical Methods for Nonsmooth Dynamical Systems (2008), 10.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Rows
from mbody.core.decorators import kernel, njit
from mbody.core.tolerances import CONTACT_IMPULSES_RESCUED, CONTACT_STEP_SHORTEST, PIVOT_VANISHED
from mbody.kernels.constraints import body_rotations, clear, rows, weigh
from mbody.kernels.contact_geometry import (
    FOUND,
    LACKING,
    TESTED,
    ContactShapes,
    ContactWork,
    ImpulseSteps,
    InteriorWork,
    find_contacts,
    remember,
)
from mbody.kernels.contact_impulses import (
    FEW,
    apply_all,
    contact_rows,
    correct_positions,
    keep_pull,
    press,
    rates,
    solve_impulses,
)
from mbody.kernels.forces import forces, signals
from mbody.kernels.layout import Layout, Work, keep
from mbody.kernels.loop_closure import project_position, project_velocity
from mbody.kernels.schur_ldl import apply_g, apply_gt, factor, solve

#: Time; length of the last step; from when on an instant is to be kept; counts of steps, sweeps and
#: pairs looked at; contacts with impulses in the last step, most contacts of a step.
(NOW, LENGTH, DELIVER, STEPS_DONE, SWEEPS_DONE, PAIRS, CONTACTS) = range(7)
#: The deepest overlap, when, and the greatest as a part of the size of its shapes, and when.
DEEPEST, DEEPEST_AT, DEEPEST_PART, PART_AT = range(7, 11)
#: Steps whose impulses did not converge: how many, the last change of the worst, and when first;
#: of the present step; and whether its impulses were sought elsewhere.
UNSOLVED_COUNT, UNSOLVED_MOST, UNSOLVED_AT, LEFT, SOUGHT = range(11, 16)
#: Iterations of the interior-point method, and how far, in parts of its size, a contact came nearer
#: or left in a step because its sliding changed.
ITERATIONS_DONE, NEARER = range(16, 18)
#: Whether it was said that the next step is the last one, cut to end in time.
CUT = 18
#: How many slots there are.
IMPULSE_SLOTS = 19
#: What `moreau` returns: the end is reached; an instant is to be kept; more is to do; there is no
#: memory for so many contacts; a number is not finite, or loops do not close; the impulses of the
#: step that is under way did not converge; the next step is the last one, and is cut.
REACHED, KEEP, UNDERWAY, CROWDED, LOST, UNSOLVED, LAST = range(7)


@kernel
def moreau(
    L: Layout,
    W: Work,
    C: ContactShapes,
    B: ContactWork,
    N: InteriorWork,
    M: ImpulseSteps,
    until: float,
    steps: int,
) -> int:
    """At most so many steps towards `until`, the last one shorter; a code as above.

    After UNSOLVED the step goes on with the impulses in B.impulse; after CROWDED it is made anew
    with more memory.
    """
    n3, state = 3 * L.bodies, M.state
    for _ in range(steps):
        t = state[NOW]
        if until - t <= CONTACT_STEP_SHORTEST * M.length:
            return REACHED
        clipped = t + M.length >= until - CONTACT_STEP_SHORTEST * M.length
        h = until - t if clipped else M.length
        if clipped and state[CUT] == 0.0:
            state[CUT] = 1.0
            return LAST
        if state[SOUGHT] > 0.0:
            state[SOUGHT] = 0.0
            apply_all(B)
        else:
            state[LENGTH] = h
            begin(L, W, B, M, t, h)
            B.counts[TESTED] = 0
            find_contacts(W, C, B, h)
            if B.counts[LACKING] > 0 or not impulses(W, C, B, N, M, h):
                for n in range(M.y.shape[0]):
                    M.y[n] = M.last[n]
                return CROWDED
            state[PAIRS] += B.counts[TESTED]
            few = B.counts[FOUND] <= FEW
            if few and state[LEFT] > max(M.tolerance, CONTACT_IMPULSES_RESCUED):
                return UNSOLVED
        if state[LEFT] > M.tolerance:
            if state[UNSOLVED_COUNT] == 0.0:
                state[UNSOLVED_AT] = t
            state[UNSOLVED_COUNT] += 1
            state[UNSOLVED_MOST] = max(state[UNSOLVED_MOST], state[LEFT])
        end(L, W, C, B, M, t, h)
        now = until if clipped else t + h
        good = project(L, W, B, M, now)
        work_of_loads(L, M)
        remember(B, 1.0)
        keep_pull(N, 1.0)
        if not good or not math.isfinite(M.y[0] + M.y[n3]):
            return LOST
        state[NOW] = now
        state[CUT] = 0.0
        state[STEPS_DONE] += 1
        if now >= state[DELIVER] - CONTACT_STEP_SHORTEST * M.length:
            return KEEP
    return UNDERWAY


@njit
def impulses(W, C, B, N, M, h):
    """The impulses of a step; returns False where there is no memory."""
    state = M.state
    contact_rows(C, B, h)
    sweeps, iterations, change, nearer = solve_impulses(W, B, N, M.tolerance, h)
    if iterations < 0:
        return False
    state[SWEEPS_DONE] += sweeps
    state[ITERATIONS_DONE] += iterations
    state[LEFT], state[NEARER] = change, max(state[NEARER], nearer)
    return True


@njit
def begin(L, W, B, M, t, h):
    """Rows, forces and velocities without contacts at the middle of the step."""
    n3, w, y = 3 * L.bodies, 0.0, M.y
    for n in range(y.shape[0]):
        M.last[n] = y[n]
    for n in range(M.work.shape[0]):
        M.work_before[n] = M.work[n]
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = y[n] + 0.5 * h * y[n3 + n], y[n3 + n]
        B.start[n] = y[n3 + n]
    for n in range(L.owns):
        W.own[n, 0] = y[2 * n3 + n]
    W.time[0, 0] = t + 0.5 * h
    signals(L, W, w, L.varying)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    causes = M.loads.shape[0] - 1
    forces(L, W, w, -1)
    for n in range(L.owns):
        y[2 * n3 + n] += h * W.auxiliary_rate[n, 0]
    for n in range(n3):
        M.loads[causes, n] = W.force[n, 0]
    for cause in range(causes):
        if causes > 1:
            forces(L, W, w, cause)
        for n in range(n3):
            M.loads[cause, n] = W.force[n, 0]
    if L.nodes > 0:
        factor(L, W, w, M.regularization, PIVOT_VANISHED)
        rates_of_mean(L, W, B)
    for n in range(n3):
        B.free[n] = B.start[n] + h * B.inverse[n] * M.loads[causes, n]
    joint_impulses(L, W, B, M, B.free)


@njit
def rates_of_mean(L, W, B):
    """B.row_rate ← 2ν − G v, what G v⁺ is to be."""
    to_slots(L, W, B.start)
    apply_g(L, W, 0.0, W.u, W.x)
    for n in range(2 * L.nodes):
        B.row_rate[n] = 2.0 * W.nu[n, 0] - W.x[n, 0]


@njit
def to_slots(L, W, u):
    """W.u ← velocities (coordinates,) of all slots."""
    clear(W.u, 0.0)
    for s in range(L.slots):
        for n in range(3):
            W.u[3 * s + n, 0] = u[3 * L.slot_body[s] + n]


@njit
def joint_impulses(L, W, B, M, u):
    """u ← the velocities with the impulses of joints, which B.row_impulse becomes."""
    if L.nodes == 0:
        return
    w = 0.0
    to_slots(L, W, u)
    for n in range(2 * L.nodes):
        B.row_impulse[n] = 0.0
    for _ in range(1 + M.refinements):
        apply_g(L, W, w, W.u, W.x)
        for n in range(2 * L.nodes):
            W.x[n, 0] -= B.row_rate[n]
        solve(L, W, w)
        for n in range(2 * L.nodes):
            B.row_impulse[n] += W.x[n, 0]
        clear(W.r, w)
        apply_gt(L, W, w, W.x, W.r)
        weigh(L, W, w, W.r)
        for n in range(3 * L.slots):
            W.u[n, 0] -= W.r[n, 0]
    for b in range(L.bodies):
        for n in range(3):
            u[3 * b + n] = W.u[3 * L.body_slot[b] + n, 0]


@njit
def end(L, W, C, B, M, t, h):
    """The end of a step by its impulses: M.y, what they did, the residual of its equation."""
    n3, y, causes = 3 * L.bodies, M.y, M.loads.shape[0] - 1
    u, count = B.velocity, B.counts[FOUND]
    if L.nodes > 0:
        # once more with all impulses: rows of joints to rounding
        contact_impulses(B, B.moved)
        for n in range(n3):
            u[n] = B.start[n] + B.inverse[n] * (h * M.loads[causes, n] + B.moved[n])
        joint_impulses(L, W, B, M, u)
    residual(L, W, B, M, h)
    drivers = L.driver_row.shape[0]
    for d in range(drivers):
        effort = -B.row_impulse[2 * L.driver_node[d]]
        M.work[causes + d] += effort * W.signal[L.driver_row[d] + 1, 0]
    touching = 0
    for c in range(count):
        p, along = B.impulse[c, 0], B.impulse[c, 1]
        if p > 0.0:
            touching += 1
            normal, aside = rates(B, c, u)
            given = 0.5 * p * (normal + B.rate[c, 0]) + 0.5 * along * (aside + B.rate[c, 1])
            M.work[causes + drivers + B.who[c, 2]] += given
        overlap(W, B, M, c, t + 0.5 * h)
    M.state[CONTACTS] = max(M.state[CONTACTS], float(touching))
    for n in range(n3):
        M.change[n] = (u[n] - B.start[n]) / h
        y[n] = W.q[n, 0] + 0.5 * h * u[n]
        y[n3 + n] = u[n]
    if correct_positions(W, B, h, B.moved):
        for n in range(n3):
            y[n] += B.moved[n]


@njit
def work_of_loads(L, M):
    """The work of loads on the whole way, corrections of positions included."""
    for cause in range(M.loads.shape[0] - 1):
        for n in range(3 * L.bodies):
            M.work[cause] += M.loads[cause, n] * (M.y[n] - M.last[n])


@njit
def contact_impulses(B, f):
    """f ← Wᵀ P of all contacts."""
    for n in range(f.shape[0]):
        f[n] = 0.0
    for c in range(B.counts[FOUND]):
        press(B, c, B.impulse[c, 0], B.impulse[c, 1], f)


@njit
def overlap(W, B, M, c, t):
    """Record how deep a contact is."""
    state, deep = M.state, -B.geometry[c, 6]
    size = B.geometry[c, 7]
    if not size < math.inf:
        size = W.size[0, 0]
    if deep > state[DEEPEST]:
        state[DEEPEST], state[DEEPEST_AT] = deep, t
    if deep > state[DEEPEST_PART] * size:
        state[DEEPEST_PART], state[PART_AT] = deep / size, t


@njit
def residual(L, W, B, M, h):
    """M.residual ← of M (v⁺ − v) − h f + Gᵀ p − Wᵀ P, with masses instead of their inverses: its
    greatest part and term, torques by the model length, as forces; the power that is left, and the
    sum of the magnitudes of all power.
    """
    n3, w, causes, u = 3 * L.bodies, 0.0, M.loads.shape[0] - 1, B.velocity
    contact_impulses(B, B.moved)
    clear(W.r, w)
    if L.nodes > 0:
        for n in range(2 * L.nodes):
            W.lam[n, 0] = B.row_impulse[n] / h
        apply_gt(L, W, w, W.lam, W.r)
    for n in range(n3):
        W.force[n, 0] = 0.0
    for s in range(L.slots):
        for n in range(3):
            W.force[3 * L.slot_body[s] + n, 0] += W.r[3 * s + n, 0]
    worst, term, power, flow = 0.0, 0.0, 0.0, 0.0
    for n in range(n3):
        unit = 1.0 / W.size[0, 0] if n % 3 == 2 else 1.0
        inertia, load = W.mass[n, 0] * (u[n] - B.start[n]) / h, M.loads[causes, n]
        pressed, carried = B.moved[n] / h, W.force[n, 0]
        left = inertia - load + carried - pressed
        worst = max(worst, unit * abs(left))
        term = max(term, unit * max(abs(inertia), abs(load), abs(carried), abs(pressed)))
        mean = 0.5 * (u[n] + B.start[n])
        power += left * mean
        flow += (abs(inertia) + abs(load) + abs(carried) + abs(pressed)) * abs(mean)
    M.residual[0], M.residual[1], M.residual[2], M.residual[3] = worst, term, power, flow


@njit
def project(L, W, B, M, t):
    """M.y ← its projection onto the joints at time t; returns whether loops close."""
    if L.nodes == 0:
        return True
    n3, w = 3 * L.bodies, 0.0
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = M.y[n], M.y[n3 + n]
    W.time[0, 0] = t
    signals(L, W, w, L.varying)
    _, failed = project_position(L, W, w, M.regularization, 1.0)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, M.regularization, PIVOT_VANISHED)
    project_velocity(L, W, w, M.refinements)
    for n in range(n3):
        M.y[n], M.y[n3 + n] = W.q[n, 0], W.v[n, 0]
    return failed < 0.5


@kernel
def kept_instant(
    L: Layout, W: Work, B: ContactWork, M: ImpulseSteps, t: float, record: Rows
) -> bool:
    """record (rows, 1) ← the instant t within the last step, on a straight line between its ends,
    with the forces of the step: impulses by its length. Returns whether loops close.
    """
    n3, w, h, now = 3 * L.bodies, 0.0, M.state[LENGTH], M.state[NOW]
    part = (t - (now - h)) / h
    if part > 1.0 - CONTACT_STEP_SHORTEST:
        part = 1.0
    for n in range(n3):
        W.q[n, 0] = (1.0 - part) * M.last[n] + part * M.y[n]
        W.v[n, 0] = (1.0 - part) * M.last[n3 + n] + part * M.y[n3 + n]
        W.a[n, 0] = M.change[n]
    for n in range(L.owns):
        W.own[n, 0] = (1.0 - part) * M.last[2 * n3 + n] + part * M.y[2 * n3 + n]
    W.time[0, 0] = t
    signals(L, W, w, L.signal_law.shape[0])
    failed = 0.0
    if L.nodes > 0 and 0.0 < part < 1.0:
        _, failed = project_position(L, W, w, M.regularization, 1.0)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    if L.nodes > 0 and 0.0 < part < 1.0:
        factor(L, W, w, M.regularization, PIVOT_VANISHED)
        project_velocity(L, W, w, M.refinements)
    for n in range(2 * L.nodes):
        W.lam[n, 0] = B.row_impulse[n] / h
    keep(L, W, w, record)
    return failed < 0.5
