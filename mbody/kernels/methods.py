"""What steps of a motion are made by: one of the methods, which a step is tried by and accepted.

All leave the end of a step that was tried in S.end, and its derivative in a row of K that is not
row 1, and polynomials of state and work in S.F and S.G.
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import kernel, njit
from mbody.core.tolerances import CONDITIONING_INTO_SINGULAR, CONDITIONING_NEAR_SINGULAR
from mbody.kernels.fixed_step import FixedStep, accept_even, attempt_even
from mbody.kernels.layout import Layout, Work
from mbody.kernels.radau import (
    Radau,
    accept_implicit,
    attempt_implicit,
    dense_implicit,
    forget_factors,
    forget_polynomial,
)
from mbody.kernels.runge_kutta import Explicit, accept, attempt, dense_output
from mbody.kernels.state_derivative import derivative_anew, state_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    ARTIFICIAL_LIMIT,
    BEST_CONDITIONING,
    CONDITIONING,
    EVALUATIONS,
    JACOBIAN_VALID,
    KNOWN_UNTIL,
    MORE,
    NEAR_SINGULAR,
    NEXT,
    NOT_FINITE,
    SHORTENED_UNTIL,
    SINGULAR_AHEAD,
    STEP_VANISHED,
    TIME,
    TRIED,
    TRIED_END,
    Outputs,
    Stepping,
    Tolerances,
)

#: Kinds of methods: explicit, implicit, of steps of one length.
EXPLICIT, IMPLICIT, EVEN = range(3)


class Methods(Bundle):
    """The method of a motion, by its `kind`; of others the coefficients alone, or nothing.

    `explicit`: Also by which other methods pass singular positions.
    `tried` (1,): By which kind the last step was tried.
    """

    kind: int
    explicit: Explicit
    implicit: Radau
    even: FixedStep
    tried: Ints


@njit
def begin_method(L, M, S):
    """Derivatives have jumped, or others have set the state: what is carried on begins anew."""
    if M.kind == EVEN:
        for n in range(M.even.acceleration.shape[0]):
            M.even.acceleration[n] = S.K[0, 3 * L.bodies + n]


@njit
def resume_method(L, M, S):
    """Others may have set what the method carries on, but not all that follows from it; nor
    anything before the first step.
    """
    if M.kind == IMPLICIT:
        forget_factors(M.implicit)
    elif M.kind == EVEN and math.isnan(M.even.acceleration[0]):
        begin_method(L, M, S)


@njit
def forget_steps(L, M, S):
    """After an explicit step of another method: what that carried on is of before it."""
    state = S.state
    state[JACOBIAN_VALID] = 0.0
    if M.kind == IMPLICIT:
        forget_polynomial(M.implicit)
        return
    begin_method(L, M, S)
    weak = state[CONDITIONING] < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]
    if not (weak or state[NEAR_SINGULAR] > 0.5):
        state[NEXT] = M.even.length


@njit
def attempt_explicit(L, W, M, S, T, until):
    """An explicit step is tried, see `attempt_step`."""
    M.tried[0] = EXPLICIT
    return attempt(L, W, M.explicit, S, T, until)


@njit
def attempt_step(L, W, M, S, T, until):
    """One step towards `until` is tried from S.y: TRIED where it is good; MORE where it is to be
    tried again; else why there is none. Explicit steps pass what other methods do not.
    """
    if M.kind == EXPLICIT:
        return attempt_explicit(L, W, M, S, T, until)
    state = S.state
    t, best = state[TIME], state[BEST_CONDITIONING]
    near = state[NEAR_SINGULAR] > 0.5 or t <= state[KNOWN_UNTIL] or t < state[SHORTENED_UNTIL]
    if near or state[CONDITIONING] < CONDITIONING_NEAR_SINGULAR * best:
        return attempt_explicit(L, W, M, S, T, until)
    M.tried[0] = M.kind
    if M.kind == IMPLICIT:
        code = attempt_implicit(L, W, M.implicit, S, T, until)
    else:
        code = attempt_even(L, W, M.even, S, T, until)
    nearly = state[CONDITIONING] < CONDITIONING_INTO_SINGULAR * best
    failed = code in (STEP_VANISHED, NOT_FINITE)
    if code == SINGULAR_AHEAD or (nearly and failed):
        return attempt_explicit(L, W, M, S, T, until)
    return code


@njit
def attempt_watched(L, W, M, S, T, until):
    """`attempt_step`, its end being what was evaluated last: looks are at that."""
    code = attempt_step(L, W, M, S, T, until)
    if code == TRIED and M.tried[0] == EVEN:
        # row 1 is workspace
        state_derivative(L, W, S, S.state[TRIED_END], S.end, 1, T.full_refinements, False)
        S.state[EVALUATIONS] += 1
    return code


@njit
def dense_step(L, W, M, S, h, refinements):
    """S.F and S.G of the polynomials of state and work over the step that was tried."""
    if M.tried[0] == EXPLICIT:
        dense_output(L, W, M.explicit, S, h, refinements)
    elif M.tried[0] == IMPLICIT:
        dense_implicit(M.implicit, S)


@njit
def accept_step(L, W, M, S, T, O, until, dense):
    """Accept the step that was tried, keeping every output instant that it meets: MORE to go on,
    or STIFF. `dense`: whether its polynomials are known.
    """
    if M.tried[0] == EXPLICIT:
        code = accept(L, W, M.explicit, S, T, O, until, dense)
        if M.kind != EXPLICIT:
            forget_steps(L, M, S)
        return code
    if M.tried[0] == IMPLICIT:
        accept_implicit(L, W, M.implicit, S, T, O, until, dense)
    else:
        accept_even(L, W, M.even, S, T, O)
    return MORE


@njit
def unwatched_steps(L, W, M, S, T, O, until, count):
    """At most so many steps towards `until` of a motion of which nothing is watched, every output
    instant that is met being kept: a code of `mbody.kernels.step_state`.
    """
    for _ in range(count):
        code = attempt_step(L, W, M, S, T, until)
        if code == TRIED:
            code = accept_step(L, W, M, S, T, O, until, False)
            if S.state[ARTIFICIAL_ENERGY] > S.state[ARTIFICIAL_LIMIT]:
                return MORE
        if code != MORE:
            return code
    return MORE


@kernel
def unwatched_motion(
    L: Layout,
    W: Work,
    M: Methods,
    S: Stepping,
    T: Tolerances,
    O: Outputs,
    asked: Floats,
    record: Rows,
) -> int:
    """Steps of a motion of which nothing is watched; every output instant that is met is kept.

    `asked` (3,): until when; how many at most; whether inputs have changed since the derivative was
    evaluated, of which `record` (rows, 1) is then what is kept.
    Returns DONE, MORE, STEP_VANISHED, NOT_FINITE, STIFF, LAST_STEP or BRANCH_UNCERTAIN.
    """
    resume_method(L, M, S)
    if asked[2] > 0.0:
        S.state[JACOBIAN_VALID] = 0.0
        derivative_anew(L, W, S, T.full_refinements, record)
        begin_method(L, M, S)
    return unwatched_steps(L, W, M, S, T, O, asked[0], int(asked[1]))
