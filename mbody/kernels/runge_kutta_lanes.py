"""Explicit Runge–Kutta integrator of many designs side by side, a lane each.

Every lane has its own time, its own length of step and its own decision whether a step is accepted,
as `mbody.kernels.runge_kutta` has them in ordinary steps; a lane whose motion has ended takes the
next design. What a lane gets depends on its design alone, so the numbers are the same in any
company. A design that meets anything out of the ordinary (a singular position near by, no number,
steps that vanish or that stiffness limits) is marked and left to `runge_kutta`.

One source serves both integrators where lanes bear it: stages, further rows of the dense output,
control of the length and of stiffness (`mbody.kernels.runge_kutta_stages`), projections,
accelerations, samples. The loops are two. Near a singular position one motion projects every stage,
retries a step in several ways and leaves the choice of its branch to Python, each an `if` with one
outcome; on lanes every decision is a number of each lane, taken in
`mbody.kernels.runge_kutta_lanes_control`, and all lanes wait for the longest way. Measured on a
free four-bar over 20 s at rtol 1e-8, on one core: 64 designs take 0.54 ms each on lanes and 4.0 ms
each alone, so lanes cannot follow the loop of one motion; one design takes 10.9 ms on lanes, 2.7
times as long as alone, so one motion cannot take the loop of lanes. Norms of errors and the cubic
of the dense output are summed up in two orders, of which neither would keep the last digit of the
other.
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import kernel, njit
from mbody.core.lanes import larger, ld, select_le, smaller, st, wide
from mbody.kernels.accelerations import free_accelerations
from mbody.kernels.checked_instants import DOUBTFUL
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import keep
from mbody.kernels.projection import least_conditioning, projected_accelerations
from mbody.kernels.runge_kutta_lanes_control import (
    ACCEPTED,
    END_CONDITIONING,
    ERROR,
    FAILED,
    FRACTION,
    HAS_INSTANT,
    INSTANT,
    LOW_ERROR,
    RISK,
    STAGE_CONDITIONING,
    STAND_INS,
    STEP_LENGTH,
    STEP_START,
    STIFFNESS,
    LaneWorkspace,
    accept_or_reject,
    any_instant,
    finish_steps,
    leave_design,
    next_instants,
    refill_lanes,
)
from mbody.kernels.runge_kutta_lanes_rhs import Batch, not_finite, projected_derivative
from mbody.kernels.runge_kutta_stages import (
    along,
    along_rate,
    higher_rows,
    stage_state,
    stiffness_estimate,
)
from mbody.kernels.singularity_monitor import (
    STEEPER,
    keep_last_sample,
    largest_rotation,
    sample_conditioning,
    singularity_risk,
    stand_in_energy,
)
from mbody.kernels.state_derivative import load_state, store_derivative
from mbody.kernels.step_state import CONDITIONING, DELIVERED, Tolerances
from mbody.kernels.tableaus import Explicit

__all__ = ["go_on", "off_manifold_derivative", "runge_kutta_lanes", "take_steps"]


@kernel
def runge_kutta_lanes(
    L: Layout,
    W: Work,
    method: Explicit,
    T: Tolerances,
    batch: Batch,
    lanes: LaneWorkspace,
    until: float,
    rounds: int,
) -> bool:
    """At most so many steps, in every lane, of designs from their first states to `until`.

    method: an `Explicit`; T: a `Tolerances`; batch: a `Batch`; lanes: a `LaneWorkspace`, that of
    the last call where the designs are gone on with. Returns whether all designs are done.
    """
    w, S = wide(), lanes.state
    for _ in range(rounds):
        if not refill_lanes(L, W, batch, lanes, until):
            return True
        if not take_steps(L, W, method, T, batch, lanes):
            continue
        if any_instant(lanes, batch.times):
            t, h = ld(S, STEP_START, w), ld(S, STEP_LENGTH, w)
            dense_output_lanes(L, W, method, T.refinements, lanes, t, h)
        go_on(method, lanes)
        deliver_lanes(L, W, T, batch, lanes)
    return False


@njit
def take_steps(L, W, method, T, batch, lanes):
    """The steps that the lanes have before them; whether any is accepted. In these y becomes the
    end, `last` what y was, and the last row of K is the derivative there (see `go_on`).
    """
    B, C = method.B, method.C
    end_row = B.shape[0]
    early = method.E.shape[1] > end_row
    w, S, K, regular = wide(), lanes.state, lanes.K, T.refinements
    t, h = ld(S, STEP_START, w), ld(S, STEP_LENGTH, w)
    least = ld(S, CONDITIONING, w)
    for s in range(1, end_row):
        stage_state(method.A[s], s, K, lanes.y, h, lanes.stage, w)
        off_manifold_derivative(L, W, lanes.stage, t + C[s] * h, K[s], regular)
        n = method.sample[s]
        if n == 0:
            least = smaller(least, least_conditioning(L, W, w))
        else:
            least = smaller(least, sample_conditioning(L, W, w, n))
    st(S, STAGE_CONDITIONING, least, w)
    stage_state(B, end_row, K, lanes.y, h, lanes.end, w)
    st(W.time, 0, t + h, w)
    if early:
        project_end(L, W, regular, lanes, end_row, method.sample[end_row])
    error_norms(method.E, T, lanes)
    if not accept_or_reject(lanes, batch, method.order):
        return False
    if not early:
        project_end(L, W, regular, lanes, end_row, method.sample[end_row])
    stiffness = stiffness_estimate(
        h, lanes.end, lanes.stage, K[end_row], K[end_row - 1], lanes.scale, w
    )
    st(S, STIFFNESS, stiffness, w)
    turned = largest_rotation(L, w, lanes.y, lanes.end)
    st(S, RISK, singularity_risk(L, W, w, method.at, STEEPER, turned), w)
    st(S, STAND_INS, stand_in_energy(L, W, w, W.v) if regular > 0 else 0.0 * turned, w)
    finish_steps(lanes, batch, T.patience, method.stable)
    accepted = ld(S, ACCEPTED, w)
    keep_last_sample(L, W, w, method.sample[end_row], accepted)
    for n in range(lanes.y.shape[0]):
        y = ld(lanes.y, n, w)
        st(lanes.last, n, y, w)
        st(lanes.y, n, select_le(1.0, accepted, ld(lanes.end, n, w), y), w)
    return True


@njit
def go_on(method, lanes):
    """The derivative at the end of an accepted step becomes the first one of the next."""
    K, w, end_row = lanes.K, wide(), method.B.shape[0]
    accepted = ld(lanes.state, ACCEPTED, w)
    for n in range(lanes.y.shape[0]):
        st(K[0], n, select_le(1.0, accepted, ld(K[end_row], n, w), ld(K[0], n, w)), w)


@njit
def off_manifold_derivative(L, W, y, t, K, refinements):
    """K ← the derivative of the states y, which need not lie on the manifold, at the times t."""
    w = wide()
    load_state(L, W, w, y)
    st(W.time, 0, t, w)
    free_accelerations(L, W, w, 0.0, refinements)
    store_derivative(L, W, w, K)


@njit
def project_end(L, W, refinements, lanes, end_row, sample):
    """Project the end of the step, which is its last sample, and evaluate its derivative."""
    w, S = wide(), lanes.state
    failed = projected_derivative(
        L, W, lanes.end, lanes.K[end_row], refinements, ld(S, ACCEPTED, w)
    )
    st(S, FAILED, failed, w)
    st(S, END_CONDITIONING, sample_conditioning(L, W, w, sample), w)


@njit
def error_norms(E, T, lanes):
    """Sums of squares of both errors of the step, in tolerances."""
    w, K, rtol, atol = wide(), lanes.K, T.relative, T.absolute
    e3, e5 = 0.0 * wide(), 0.0 * wide()
    for n in range(lanes.y.shape[0]):
        size = larger(np.abs(ld(lanes.y, n, w)), np.abs(ld(lanes.end, n, w)))
        per = 1.0 / (atol * ld(lanes.scale, n, w) + rtol * size)
        low, high = E[0, 0] * ld(K[0], n, w), E[1, 0] * ld(K[0], n, w)
        for r in range(1, E.shape[1]):
            rate = ld(K[r], n, w)
            low, high = low + E[0, r] * rate, high + E[1, r] * rate
        low, high = low * per, high * per
        e3, e5 = e3 + low * low, e5 + high * high
    st(lanes.state, LOW_ERROR, e3, w)
    st(lanes.state, ERROR, e5, w)


@njit
def dense_output_lanes(L, W, method, refinements, lanes, t, h):
    """lanes.F of the polynomials over the steps, by the further derivatives that the method takes;
    see `mbody.kernels.dense_output`.
    """
    A, C, D, K, F, w = method.A, method.C, method.D, lanes.K, lanes.F, wide()
    end = method.B.shape[0]
    for s in range(end + 1, A.shape[0]):
        stage_state(A[s], s, K, lanes.last, h, lanes.stage, w)
        off_manifold_derivative(L, W, lanes.stage, t + C[s] * h, K[s], refinements)
    for n in range(lanes.y.shape[0]):
        change = ld(lanes.y, n, w) - ld(lanes.last, n, w)
        first = h * ld(K[0], n, w)
        st(F[0], n, change, w)
        st(F[1], n, first - change, w)
        st(F[2], n, 2.0 * change - first - h * ld(K[end], n, w), w)
    higher_rows(D, h, K, F, w)


@njit
def deliver_lanes(L, W, T, batch, lanes):
    """Keep every output instant up to the ends of the steps, in all lanes that have one at once.
    A design of which one is doubtful (`mbody.kernels.checked_instants`) is left to go alone.
    """
    w, S, design, times = wide(), lanes.state, lanes.design, batch.times
    count = design.shape[0] - 1
    while next_instants(lanes, times):
        x = ld(S, FRACTION, w)
        for n in range(lanes.y.shape[0]):
            inside = ld(lanes.last, n, w) + along(lanes.F, n, x, w)
            st(lanes.stage, n, select_le(1.0, x, ld(lanes.y, n, w), inside), w)
        load_state(L, W, w, lanes.stage)
        st(W.time, 0, ld(S, INSTANT, w), w)
        among = ld(S, HAS_INSTANT, w)
        _, _, failed = projected_accelerations(L, W, w, 0.0, T.full_refinements, among)
        keep(L, W, w, lanes.page)
        st(S, FAILED, failed + not_finite(lanes.page, w), w)
        store_derivative(L, W, w, lanes.K[1])
        interpolation_errors(T, lanes, x)
        for lane in range(count):
            if S[HAS_INSTANT, lane] < 0.5:
                continue
            sound = S[FRACTION, lane] == 1.0 or S[ERROR, lane] <= DOUBTFUL
            if S[FAILED, lane] == 0.0 and sound:
                k = int(S[DELIVERED, lane])
                for n in range(batch.rows.shape[0]):
                    batch.output[n, design[lane], k] = lanes.page[batch.rows[n], lane]
                S[DELIVERED, lane] += 1.0
            else:
                leave_design(lanes, batch, lane)


@njit
def interpolation_errors(T, lanes, x):
    """What the polynomials lack to the derivatives in row 1 of K at the parts x of the steps; see
    `mbody.kernels.checked_instants`.
    """
    w, count = wide(), lanes.y.shape[0]
    h, total = ld(lanes.state, STEP_LENGTH, w), 0.0 * wide()
    for n in range(count):
        size = larger(np.abs(ld(lanes.y, n, w)), np.abs(ld(lanes.last, n, w)))
        unit = T.absolute * ld(lanes.scale, n, w) + T.relative * size
        lacks = (h * ld(lanes.K[1], n, w) - along_rate(lanes.F, n, x, w)) / unit
        total = total + lacks * lacks
    st(lanes.state, ERROR, total / count, w)
