"""A motion with contacts, ropes and frictional joints, from one change of modes to the next.

Steps go on as long as all guards of the present modes are positive (`mbody.kernels.watched_steps`).
What a guard means that is zero, impacts of what approaches, the modes that go on and their guards
follow, stage by stage. `advance_motion` returns after each of them, so that whoever leads the
motion reads what has happened, and goes on from there when it is called again: all that the motion
is lies in the arrays of one `UnilateralMotion`.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import (
    CONTACT_GAP_BEGINNING,
    GUARD_FALLING,
    GUARD_ROUNDING_FORCE,
    GUARD_ROUNDING_GAP,
    GUARD_ROUNDING_STOP,
    GUARD_ZERO,
    MASSES_LOST,
    RATE_NONE_FRICTION,
    TIMES_SAME_MODES,
)
from mbody.kernels.complementarity import ContactProblem
from mbody.kernels.contact_guards import (
    BEGIN,
    CLOSE,
    EDGE,
    ENTER,
    LIFT,
    LOCK,
    PARADOX,
    SHARE,
    SLIP,
    STOP,
    Guards,
    collect_guards,
    find_shared,
    find_sizes,
    look,
    look_at_guards,
    watched,
)
from mbody.kernels.contact_impacts import (
    COLLISIONLESS,
    QUIET,
    SMALL,
    WEDGED,
    ContactImpact,
    resolve,
    set_jump,
    strike,
    switch_off,
)
from mbody.kernels.contact_modes import (
    FORWARD,
    FULL,
    NONE,
    ONE,
    OPEN,
    UnilateralModes,
    all_off,
    coordinate_unit,
    decide,
    evaluate_state,
    find_speeds,
    find_touching,
    read_state,
    tangent_of,
)
from mbody.kernels.contact_rows import (
    UnilateralLayout,
    approach_of,
    fill_row,
    gap_of,
    is_within,
)
from mbody.kernels.force_programs import limits_of
from mbody.kernels.held_forces import NORMALS, hold_record, weakest
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work, keep
from mbody.kernels.methods import Methods, begin_method
from mbody.kernels.mode_problem import ContactDecision
from mbody.kernels.state_derivative import derivative_anew, first_derivative, load_state
from mbody.kernels.step_state import (
    JACOBIAN_VALID,
    NEAR_SINGULAR,
    TIME,
    ZERO,
    Outputs,
    Stepping,
    Tolerances,
)
from mbody.kernels.watched_steps import watched_steps

#: What comes next: steps; what the guard decides that is zero; impacts, and the modes that go on;
#: an impact without collision, where none do; guards of the modes that were decided. Or first
#: modes, at a state that was set; others, where forces have jumped beyond what the present ones
#: allow. Or steps again, with other inputs.
STEPPING, PASSED, SETTLING, COLLIDING, BEGINNING, STARTING, JUMPED, CHANGED = range(8)
#: What `advance_motion` returns beside what `mbody.kernels.step_state` names: an impact has
#: happened; one without collision; modes were decided; steps begin in these. An impact has no
#: solution; no modes go on, nor an impact without collision; masses that touch differ by more than
#: numbers carry. Forces of what slides have a pole; impacts, or changes of modes, do not end at one
#: instant. There is memory for fewer rows, or fewer forces that no equation decides. Forces that
#: have jumped are within what the modes allow, or beyond.
(
    IMPACT,
    COLLISION,
    DECIDED,
    BEGUN,
    NO_IMPACT,
    NO_MODES,
    NO_COLLISION,
    LOST,
    POLE,
    IMPACTS_WITHOUT_END,
    CHANGES_WITHOUT_END,
    MEMORY,
    UNBROKEN,
    BROKEN,
) = range(11, 25)
#: Impacts, and changes of modes, at one instant, at most.
MOST_STRIKES, MOST_CHANGES = 500, 200
#: Numbers in `UnilateralMotion.count`: impacts, and changes of modes, at this instant; what
#: `resolve` and `decide` have found; whether an impact without collision was tried.
STRIKES, CHANGES, FOUND, TRIED_COLLISION = range(4)


class UnilateralMotion(Bundle):
    """A motion with contacts, ropes and frictional joints.

    `whole`, `work`: Layout with the rows of all that may act, and its workspace.
    `layout`, `reduced`: The same as steps take it, without what is off.
    `joints`, `joint_work`: The same without contacts, by which impacts and forces of contact are
      found.
    `stage` (1,): What comes next: see above.
    `count` (4,): See above.
    `changed` (1,): When modes have changed last.
    """

    whole: Layout
    layout: Layout
    work: Work
    reduced: Work
    joints: Layout
    joint_work: Work
    method: Methods
    stepping: Stepping
    tolerances: Tolerances
    unilateral: UnilateralLayout
    guards: Guards
    modes: UnilateralModes
    decision: ContactDecision
    problem: ContactProblem
    impact: ContactImpact
    stage: Ints
    count: Ints
    changed: Floats


# -- What a guard decides that is zero ---------------------------------------------------------


@njit
def forget_transition(M):
    """Nothing was just decided."""
    for k in range(M.closed.shape[0]):
        M.closed[k] = M.opened[k] = 0
    for k in range(M.stopped.shape[0]):
        M.stopped[k], M.begun[k] = 0, 0.0


@inline
def impending(L, U, G, k):
    """The direction in which owner k would slide that sticks: that of its multiplier."""
    e = L.active_set[tangent_of(U, k)]
    return -1.0 if G.page[9 * L.bodies + PER_PRIMITIVE * e, 0] < 0.0 else 1.0


@njit
def begin_together(L, W, S, U, M, k, sign):
    """All slides that sticks by the row of owner k, in this direction of k."""
    M.begun[k] = sign
    if k >= U.normal.shape[0] or M.leader[k] != k:
        return
    read_state(L, W, S.y)
    fill_row(L, W, U, U.tangent[k], 1.0, M.row)
    for other in range(U.normal.shape[0]):
        if other == k or M.leader[other] != k:
            continue
        fill_row(L, W, U, U.tangent[other], 1.0, M.trial)
        along = 0.0
        for n in range(3 * L.bodies):
            unit = coordinate_unit(W, n)
            along += M.row[n] * M.trial[n] * unit * unit
        M.begun[other] = sign if along > 0.0 else -sign if along < 0.0 else 0.0


@njit
def pass_shared(L, W, S, U, G, M):
    """What begins to slide, and opens, where forces that no equation decides come to their limits,
    at the state S.y.
    """
    H, O = G.held, G.open
    load_state(L, W, 0.0, S.y)
    hold_record(L, W, U, H, O, G.page[:, 0])
    _, part = weakest(O, G.program)
    for i in range(limits_of(O) if part >= 0 else 0):
        if not O.active[part, i]:
            continue
        if i < H.count[NORMALS]:
            M.opened[H.owner[i]] = 1
        else:
            ahead = (i - H.count[NORMALS]) % 2 == 0
            begin_together(L, W, S, U, M, H.owner[i], 1.0 if ahead else -1.0)


@njit
def pass_guard(L, W, S, U, G, M):
    """What the guard decides that is zero at the state S.y, whose record is in G.page."""
    kind, k = G.kind[G.passed[0]], G.owner[G.passed[0]]
    if kind in (CLOSE, LOCK):
        M.closed[k] = 1
    elif kind in (LIFT, EDGE):
        M.opened[k] = 1
        M.beyond[k] = 1 if kind == EDGE else M.beyond[k]
    elif kind == ENTER:
        M.beyond[k] = 0
    elif kind == SLIP:
        begin_together(L, W, S, U, M, k, impending(L, U, G, k))
    elif kind == SHARE:
        pass_shared(L, W, S, U, G, M)
    elif kind == STOP:
        M.stopped[k] = 1


@inline
def is_stuck(A):
    """Whether modes change without end at this instant; counts them."""
    t, before = A.stepping.state[TIME], A.changed[0]
    again = t - before <= TIMES_SAME_MODES * abs(t)
    A.count[CHANGES], A.changed[0] = A.count[CHANGES] + 1 if again else 0, t
    return A.count[CHANGES] > MOST_CHANGES


# -- Impacts, and the modes that go on ---------------------------------------------------------


@njit
def collide(A):
    """Painlevé's paradox: no accelerations are consistent, an impact without collision is."""
    L, W, S, U, M, I = A.joints, A.joint_work, A.stepping, A.unilateral, A.modes, A.impact
    touching, uneven = 0, 0.0
    load_state(L, W, 0.0, S.y)
    find_touching(L, W, S, U, M)
    for k in range(M.touches.shape[0]):
        touching += M.touches[k]
        for side in range(2 if M.touches[k] == 1 else 0):
            if U.bodies[k, side] < L.bodies:
                uneven = max(uneven, U.uneven[U.bodies[k, side]])
    if touching == 0 or A.count[TRIED_COLLISION] == 1:
        return NO_MODES
    if uneven > MASSES_LOST:
        return LOST
    for j in range(I.held.shape[0]):
        I.held[j] = 0
    for k in range(M.y.shape[0]):
        M.y[k] = S.y[k]
    found = strike(L, W, U, M, A.decision, A.problem, I, COLLISIONLESS)
    if found == FULL:
        return MEMORY
    A.count[TRIED_COLLISION] = 1
    if found != ONE:
        return NO_COLLISION
    switch_off(L, W, U)
    set_jump(L, W, S, M, A.decision, I)
    forget_transition(M)
    return COLLISION


# -- Motions begin, and forces jump ------------------------------------------------------------


@njit
def start_modes(A):
    """Nothing acts yet, and what touches at the state S.y is closed, but for what moves apart."""
    L, W, S, U, M = A.whole, A.work, A.stepping, A.unilateral, A.modes
    points, none = U.normal.shape[0], CONTACT_GAP_BEGINNING * W.size[0, 0]
    forget_transition(M)
    all_off(L, W, U)
    A.changed[0] = -math.inf
    for k in range(M.mode.shape[0]):
        M.mode[k], M.leader[k] = OPEN if k < points else FORWARD, -1
    for k in range(points):
        M.beyond[k], A.impact.struck[k] = 0, -math.inf
    load_state(L, W, 0.0, S.y)
    find_touching(L, W, S, U, M)
    for k in range(points):
        apart = approach_of(L, W, U, k) > RATE_NONE_FRICTION * M.speed[k]
        if not apart and abs(gap_of(L, W, U, k)) <= none:
            M.closed[k] = 1 if is_within(L, W, U, M.ends, k, none, 0.0) else 0


@njit
def is_broken(A):
    """Whether a guard is below zero at the present state, where forces have jumped; what is closed
    in the present modes is then to be decided anew.
    """
    L, W, S, U, G, M = A.layout, A.reduced, A.stepping, A.unilateral, A.guards, A.modes
    broken = False
    evaluate_state(L, W, S, A.decision)
    keep(L, W, 0.0, G.page)
    look(L, W, U, G, BEGIN, False)
    find_sizes(L, W, S, U, G, G.page)
    for n in range(G.count[0]):
        broken = broken or G.value[BEGIN, n] < -GUARD_ZERO * G.size[n]
    if broken:
        close_present(M)
    else:
        look_at_guards(L, W, U, G)
    return broken


@njit
def take_inputs(A):
    """The derivative anew, with other inputs; whether the present modes allow its forces."""
    L, W, S, G = A.layout, A.reduced, A.stepping, A.guards
    S.state[JACOBIAN_VALID] = 0.0
    derivative_anew(L, W, S, A.tolerances.full_refinements, G.page)
    begin_method(L, A.method, S)
    return watched(G) == 0 or look_at_guards(L, W, A.unilateral, G) >= 0.0


@njit
def close_present(M):
    """What is closed in the present modes is closed, though its gap is rounding."""
    forget_transition(M)
    for k in range(M.closed.shape[0]):
        M.closed[k] = 0 if M.mode[k] == OPEN else 1


# -- Steps begin -------------------------------------------------------------------------------


@inline
def rounding_of(kind):
    """Up to what part of its size what begins at zero is rounding."""
    if kind in (CLOSE, EDGE, ENTER):
        return GUARD_ROUNDING_GAP
    return GUARD_ROUNDING_STOP if kind in (STOP, LOCK) else GUARD_ROUNDING_FORCE


@njit
def begin_steps(A):
    """Steps begin in the present modes: derivative and record of the state, and the guards. What
    begins at zero is rounding, and a little more than zero until it leaves that; what begins below
    it falls where it falls further.
    """
    L, W, S, U, G, M = A.layout, A.reduced, A.stepping, A.unilateral, A.guards, A.modes
    S.state[NEAR_SINGULAR] = S.state[JACOBIAN_VALID] = 0.0
    first_derivative(L, W, S, A.tolerances.full_refinements, G.page)
    begin_method(L, A.method, S)
    close_present(M)
    find_speeds(L, W, U, S, M)
    for k in range(M.speed.shape[0]):
        G.slow[k] = RATE_NONE_FRICTION * M.speed[k]
    collect_guards(L, W, U, M, G)
    look(L, W, U, G, BEGIN, False)
    find_sizes(L, W, S, U, G, G.page)
    for n in range(G.count[0]):
        value, size = G.value[BEGIN, n], G.size[n]
        zero = abs(value) <= GUARD_ZERO * size
        G.fresh[n] = max(rounding_of(G.kind[n]) * size, -GUARD_FALLING * value) if zero else 0.0
    look_at_guards(L, W, U, G)


@inline
def settle(A):
    """Impacts and modes are decided next."""
    A.stage[0] = SETTLING
    A.count[STRIKES] = A.count[TRIED_COLLISION] = 0


@kernel
def advance_motion(A: UnilateralMotion, O: Outputs) -> int:
    """Go on to the next happening, or as far as A.guards.asked says."""
    L, W, S, U, G, M = A.whole, A.work, A.stepping, A.unilateral, A.guards, A.modes
    if A.stage[0] == CHANGED:
        if not take_inputs(A):
            return BROKEN
        A.stage[0] = STEPPING
    if A.stage[0] == STEPPING:
        code = watched_steps(A.layout, A.reduced, A.method, S, A.tolerances, O, U, G)
        if code == ZERO:
            A.stage[0] = PASSED
        return code
    if A.stage[0] == STARTING:
        start_modes(A)
        settle(A)
    if A.stage[0] == JUMPED:
        if not is_broken(A):
            A.stage[0] = STEPPING
            return UNBROKEN
        settle(A)
    if A.stage[0] == PASSED:
        if is_stuck(A):
            return CHANGES_WITHOUT_END
        kind = G.kind[G.passed[0]]
        pass_guard(L, W, S, U, G, M)
        settle(A)
        if kind == PARADOX:
            return POLE
    if A.stage[0] == SETTLING:
        B, V = A.joints, A.joint_work
        found = resolve(B, V, S, U, M, A.decision, A.problem, A.impact)
        if found in (SMALL, WEDGED):
            return MEMORY if found == SMALL else NO_IMPACT
        A.count[FOUND] = found
        if found != QUIET:
            A.count[STRIKES] += 1
            if A.count[STRIKES] > MOST_STRIKES:
                return IMPACTS_WITHOUT_END
            for k in range(M.touches.shape[0]):
                M.closed[k] = 0 if M.touches[k] == 1 else M.closed[k]
            keep(B, V, 0.0, G.page)
            return IMPACT
        found = decide(A)
        if found == FULL:
            return MEMORY
        A.count[FOUND] = found
        if found == NONE:
            A.stage[0] = COLLIDING
        elif not find_shared(L, W, U, M, G):
            return MEMORY
        else:
            keep(L, W, 0.0, G.page)
            A.stage[0] = BEGINNING
            return DECIDED
    if A.stage[0] == COLLIDING:
        code = collide(A)
        if code == COLLISION:
            keep(A.joints, A.joint_work, 0.0, G.page)
            A.stage[0] = SETTLING
        return code
    begin_steps(A)
    A.stage[0] = STEPPING
    return BEGUN
