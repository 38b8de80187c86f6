"""What steps of a motion are made by: one of the methods, which a step is tried by and accepted.

All leave the end of a step that was tried in S.end, and its derivative in a row of K that is not
row 1, and polynomials of state and work in S.F and S.G.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle
from mbody.core.decorators import njit
from mbody.core.tolerances import CONDITIONING_INTO_SINGULAR, CONDITIONING_NEAR_SINGULAR
from mbody.kernels.fixed_step import FixedStep, accept_even, attempt_even
from mbody.kernels.radau import (
    Radau,
    accept_implicit,
    attempt_implicit,
    dense_implicit,
    forget_factors,
)
from mbody.kernels.runge_kutta import accept, attempt, dense_output
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    EVALUATIONS,
    KNOWN_UNTIL,
    MORE,
    NEAR_SINGULAR,
    NOT_FINITE,
    SHORTENED_UNTIL,
    SINGULAR_AHEAD,
    STEP_VANISHED,
    TIME,
    TRIED,
    TRIED_END,
)
from mbody.kernels.tableaus import Explicit

#: Kinds of methods: explicit, implicit, of steps of one length.
EXPLICIT, IMPLICIT, EVEN = range(3)


class Methods(Bundle):
    """The method of a motion, by its `kind`; of others the coefficients alone, or nothing."""

    kind: int
    explicit: Explicit
    implicit: Radau
    even: FixedStep


@njit
def begin_method(L, M, S):
    """Derivatives have jumped, or others have set the state: what is carried on begins anew."""
    if M.kind == EVEN:
        for n in range(M.even.acceleration.shape[0]):
            M.even.acceleration[n] = S.K[0, 3 * L.bodies + n]


@njit
def resume_method(M):
    """Others may have set what the method carries on, but not all that follows from it."""
    if M.kind == IMPLICIT:
        forget_factors(M.implicit)


@njit
def attempt_step(L, W, M, S, T, until):
    """One step towards `until` is tried from S.y: TRIED where it is good; MORE where it is to be
    tried again; else why there is none. SINGULAR_AHEAD near what implicit methods do not pass.
    """
    if M.kind == EXPLICIT:
        return attempt(L, W, M.explicit, S, T, until)
    state = S.state
    t, best = state[TIME], state[BEST_CONDITIONING]
    near = state[NEAR_SINGULAR] > 0.5 or t <= state[KNOWN_UNTIL] or t < state[SHORTENED_UNTIL]
    if near or state[CONDITIONING] < CONDITIONING_NEAR_SINGULAR * best:
        return SINGULAR_AHEAD
    if M.kind == IMPLICIT:
        code = attempt_implicit(L, W, M.implicit, S, T, until)
    else:
        code = attempt_even(L, W, M.even, S, T, until)
        if code == TRIED:
            # looks are at what was evaluated last; row 1 is workspace
            state_derivative(L, W, S, state[TRIED_END], S.end, 1, T.full_refinements, False)
            state[EVALUATIONS] += 1
    nearly = state[CONDITIONING] < CONDITIONING_INTO_SINGULAR * best
    failed = code in (STEP_VANISHED, NOT_FINITE)
    return SINGULAR_AHEAD if nearly and failed else code


@njit
def dense_step(L, W, M, S, h, refinements):
    """S.F and S.G of the polynomials of state and work over the step that was tried."""
    if M.kind == EXPLICIT:
        dense_output(L, W, M.explicit, S, h, refinements)
    elif M.kind == IMPLICIT:
        dense_implicit(M.implicit, S)


@njit
def accept_step(L, W, M, S, T, O, until, dense):
    """Accept the step that was tried, keeping every output instant that it meets: MORE to go on,
    or STIFF. `dense`: whether its polynomials are known.
    """
    if M.kind == EXPLICIT:
        return accept(L, W, M.explicit, S, T, O, until, dense)
    if M.kind == IMPLICIT:
        accept_implicit(L, W, M.implicit, S, T, O, until, dense)
    else:
        accept_even(L, W, M.even, S, T, O)
    return MORE
