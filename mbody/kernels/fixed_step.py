"""Integrators of steps of one length: generalised-α, or RATTLE and its compositions."""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import kernel, njit
from mbody.kernels.dense_output import deliver, hermite_output
from mbody.kernels.generalized_alpha import generalized_alpha_step
from mbody.kernels.layout import Layout, Work
from mbody.kernels.rattle import factor_position, rattle_step
from mbody.kernels.singularity_monitor import may_be_singular, record_accepted, sample_conditioning
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    DONE,
    EVALUATIONS,
    JACOBIAN_VALID,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    MORE,
    NEAR_SINGULAR_BELOW,
    NEXT,
    NOT_FINITE,
    SINGULAR_AHEAD,
    STAND_IN_ENERGY,
    STAND_IN_LIMIT,
    STEPS,
    TIME,
    Outputs,
    Stepping,
    Tolerances,
)

__all__ = ["FixedStep", "fixed_step"]


class FixedStep(Bundle):
    """A method of steps of one length, and what it carries on.

    Attributes
    ----------
    length : float
        Of a step.
    composition : array (steps,)
        Parts of a step of which each is one step of RATTLE; none for generalised-α.
    spectral_radius : float
        Of generalised-α at infinite frequency.
    samples : array (samples,)
        The parts of a step at which it is sampled (see `mbody.kernels.singularity_monitor`).
    acceleration, saved : arrays (coordinates + owns,)
        The algorithmic acceleration, with the algorithmic rates of own states, and that before the
        step.
    multipliers : array (2·nodes,)
        Carried on by RATTLE.
    blocks : array
        Workspace for the blocks of the rows.
    J : array (coordinates + owns, states)
        See `mbody.kernels.dense_jacobian`.
    matrix : array (coordinates + owns, coordinates + owns)
        The iteration matrix and its factors.
    exchanges : array (coordinates + owns,)
        Exchanges of rows of the factors.
    """

    length: float
    composition: Floats
    spectral_radius: float
    samples: Floats
    acceleration: Floats
    saved: Floats
    multipliers: Floats
    blocks: Floats
    J: Rows
    matrix: Rows
    exchanges: Ints


@kernel
def fixed_step(
    L: Layout,
    W: Work,
    M: FixedStep,
    S: Stepping,
    T: Tolerances,
    O: Outputs,
    until: float,
    steps: int,
) -> int:
    """At most so many steps towards `until`, the last one shorter; every output instant that is met
    is kept.

    M: a `FixedStep`; S: a `Stepping` with K and P (4, ·), F (5, ·); T: a `Tolerances`; O: an
    `Outputs`. Returns DONE, MORE, LAST_STEP, NOT_FINITE or SINGULAR_AHEAD.
    """
    states, n3 = S.y.shape[0], 3 * L.bodies
    y, last, K, P, state = S.y, S.last, S.K, S.P, S.state
    hat, multipliers, length, refinements = (
        M.acceleration,
        M.multipliers,
        M.length,
        T.full_refinements,
    )
    for _ in range(steps):
        t = state[TIME]
        if t >= until:
            return DONE
        clipped = t + length >= until - 1e-9 * length
        if clipped and state[LAST_STEP_ALLOWED] < 0.5:
            return LAST_STEP
        if state[CONDITIONING] < NEAR_SINGULAR_BELOW * state[BEST_CONDITIONING]:
            return SINGULAR_AHEAD
        h = until - t if clipped else length
        now = until if clipped else t + length
        for n in range(states):
            last[n] = y[n]
        for n in range(hat.shape[0]):
            M.saved[n] = hat[n]
        if M.composition.shape[0] > 0:
            good = composed_step(L, W, M, S, h, refinements)
        else:
            good = generalized_alpha_step(L, W, M, S, h, refinements)
        if good:
            # RATTLE ends on the manifold to rounding; its projection is of rounding too
            _, _, good = state_derivative(L, W, S, now, y, 1, refinements, True)
            state[EVALUATIONS] += 1
        part = sample_conditioning(L, W, 0.0, 3)
        lost = not good or not math.isfinite(y[0])
        refused = lost or part < NEAR_SINGULAR_BELOW * state[BEST_CONDITIONING]
        least, least_at = 1.0, 0.0
        if not refused:
            for n in range(multipliers.shape[0]):
                multipliers[n] = W.lam[n, 0]
            least, least_at = hermite_output(L, W, S, h, refinements)
            refused = may_be_singular(L, W, S, M.samples, last, False)
        if refused:
            for n in range(states):
                y[n] = last[n]
            for n in range(hat.shape[0]):
                hat[n] = M.saved[n]
            state[JACOBIAN_VALID] = 0.0
            return NOT_FINITE if lost else SINGULAR_AHEAD
        # ---- the step is accepted
        state[CONDITIONING] = part
        state[BEST_CONDITIONING] = max(part, state[BEST_CONDITIONING])
        if part < least:
            least, least_at = part, 1.0
        for n in range(n3):
            W.v[n, 0] = y[n3 + n]
        record_accepted(L, W, S, 3, least, t + least_at * h, True)
        state[STEPS] += 1
        state[LAST_STEP_ALLOWED] = 0.0
        for n in range(states):
            K[0, n] = K[1, n]
        for c in range(P.shape[1]):
            P[0, c] = P[1, c]
        deliver(L, W, S, O, h, now, refinements)
        state[TIME], state[NEXT] = now, length
        if state[STAND_IN_ENERGY] > state[STAND_IN_LIMIT]:
            return MORE
    return MORE


@njit
def composed_step(L, W, M, S, h, refinements):
    """S.y ← the state after steps of RATTLE of the parts of h, one after the other. Returns whether
    all converged.
    """
    n3, t, K = 3 * L.bodies, S.state[TIME], S.K
    # row 0 of K, the derivative at the beginning, serves as the acceleration meanwhile
    for n in range(n3):
        W.q[n, 0], K[3, n3 + n] = S.y[n], K[0, n3 + n]
    factor_position(L, W, t, S.regularization)
    for n in range(M.multipliers.shape[0]):
        W.lam[n, 0] = M.multipliers[n]
    good = True
    for m in range(M.composition.shape[0]):
        part = M.composition[m] * h
        good = good and rattle_step(L, W, M, S, t, part, refinements)
        t += part
    for n in range(n3):
        K[0, n3 + n] = K[3, n3 + n]
    return good
