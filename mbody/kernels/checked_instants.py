"""Output instants within explicit steps, checked against the equations of motion.

A polynomial Δ(x) between the ends of a step is as good as the step where the step is short for all
that moves. Where stability limits steps it is not: what decays fast has h |λ| of five to thirty
there, and is so small that the ends are right to the tolerance, but the polynomial is off by up to
ten thousand of it; nor is it where loads jump within the step. As every instant that is kept is
evaluated, what it lacks to the equations is known,

    δ = h f(Δ(x)) − Δ′(x),

and δ/8 is the error, for a polynomial of order 7 by its derivative, and for h |λ| ≈ 8 by the
Jacobian; measured on motions of either kind it is right to a factor of two. An instant of which it
is more than a few tolerances gets a step of its own from the beginning of the step.
"""

from __future__ import annotations

from mbody.core.decorators import njit
from mbody.kernels.dense_output import interpolate, is_met, keep_instant, keep_work
from mbody.kernels.runge_kutta_stages import along_rate, stage_state
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import DELIVERED, EVALUATIONS, FASTEST, LIMITED_INSTANTS, TIME

__all__ = ["DOUBTFUL", "deliver_checked"]

#: Error of an interpolated instant, in tolerances, above which it gets a step of its own, times the
#: eight above, squared. Ordinary motions stay below nine tolerances.
DOUBTFUL = (8.0 * 10.0) ** 2


@njit
def deliver_checked(L, W, method, S, T, O, h, now):
    """See `mbody.kernels.dense_output.deliver`; rows of K and P but the first, and S.end, are
    workspace.
    """
    refinements, doubtful = T.full_refinements, False
    while is_met(S, O, now):
        x = interpolate(S, O, h, now)
        at = O.times[int(S.state[DELIVERED])]
        state_derivative(L, W, S, at, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        # it changes its sign within the step: what follows a doubtful one is doubtful too
        doubtful = doubtful or interpolation_error(S, T, h, x) > DOUBTFUL
        if x < 1.0 and doubtful:
            if h * S.state[FASTEST] > 0.5 * method.stable:
                S.state[LIMITED_INSTANTS] += 1
            if not step_within(L, W, method, S, T, x * h):
                interpolate(S, O, h, now)
            state_derivative(L, W, S, at, S.stage, 1, refinements, True)
            S.state[EVALUATIONS] += 1
        keep_instant(L, W, S, O, x)
    keep_work(S, O)


@njit
def interpolation_error(S, T, h, x):
    """Mean square of what the polynomial lacks to the derivative in row 1 of K, in tolerances."""
    total, size = 0.0, S.y.shape[0]
    for n in range(size):
        unit = T.absolute * S.scale[n] + T.relative * max(abs(S.y[n]), abs(S.last[n]))
        total += ((h * S.K[1, n] - along_rate(S.F, n, x, 0.0)) / unit) ** 2
    return total / size


@njit
def step_within(L, W, method, S, T, h):
    """S.stage ← the state after a shorter step from S.last; whether its loops close."""
    A, B, C, K, last, stage = method.A, method.B, method.C, S.K, S.last, S.stage
    t, end_row, size = S.state[TIME], method.B.shape[0], S.y.shape[0]
    for n in range(size):
        S.end[n], stage[n] = K[0, n], last[n]
    # row 0 of P is that of the end
    _, _, good = state_derivative(L, W, S, t, stage, 1, T.refinements, False)
    for n in range(size):
        K[0, n] = K[1, n]
    for s in range(1, end_row):
        stage_state(A[s], s, K, last, h, stage, 0.0)
        _, _, closes = state_derivative(L, W, S, t + C[s] * h, stage, s, T.refinements, False)
        good = good and closes
    S.state[EVALUATIONS] += end_row
    stage_state(B, end_row, K, last, h, stage, 0.0)
    for n in range(size):
        K[0, n] = S.end[n]
    return good
