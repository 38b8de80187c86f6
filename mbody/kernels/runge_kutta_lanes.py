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
`mbody.kernels.runge_kutta_lanes_control`, and all lanes wait for the longest path. Measured on a
free four-bar over 20 s at rtol 1e-8, on one core: 64 designs take 0.54 ms each on lanes and 4.0 ms
each alone, so lanes cannot follow the loop of one motion; one design takes 10.9 ms on lanes, 2.7
times as long as alone, so one motion cannot take the loop of lanes. Norms of errors and the cubic
of the dense output are summed up in two orders, of which neither would keep the last digit of the
other.
"""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import larger, ld, select_le, smaller, st, wide
from mbody.core.tolerances import (
    ARTIFICIAL_MASS_ENERGY,
    CONDITIONING_NEAR_SINGULAR,
    CONDITIONING_NO_END,
    FINITE,
    MONITOR_STEEPER,
    STEP_FIRST_LITTLE,
    STEP_FIRST_MOST,
    STEP_FIRST_ORIGIN,
    STEP_FIRST_SILENT,
    STEP_INTERPOLATION_DOUBTFUL,
    STEP_SAFETY,
    STEP_STIFF_LIMIT,
    TIME_END_ROUNDING,
    TIME_STEP_SHORTEST,
)
from mbody.kernels.constraints import put_column
from mbody.kernels.forces import free_accelerations, signals
from mbody.kernels.layout import Layout, Work, keep
from mbody.kernels.loop_closure import (
    artificial_energy,
    keep_last_sample,
    largest_rotation,
    least_conditioning,
    projected_accelerations,
    sample_conditioning,
    singularity_risk,
)
from mbody.kernels.runge_kutta import (
    Explicit,
    along,
    along_rate,
    count_stiff,
    higher_rows,
    next_length,
    stable_growth,
    stage_state,
    stiffness_estimate,
)
from mbody.kernels.state_derivative import load_state, store_derivative, store_state
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    DELIVERED,
    NEXT,
    PROGRESS,
    REJECTED,
    STEPS,
    STIFF_COUNT,
    TIME,
    Tolerances,
)

# -- Right-hand side of free motion in many lanes, and the first states of a batch -------------
#
# What a lane gets does not depend on its neighbours, bit for bit: a lane whose projection has
# converged keeps its position while the others go on (`mbody.kernels.projection`).


class Batch(Bundle):
    """Designs, a column each, and what is kept of their motions.

    `par`, `mass`, `weight` (parameters, designs) (coordinates + 3, designs) (columns, designs):
      Numbers of the designs.
    `y`, `derivative`, `scale` (2·coordinates, designs): First states, their derivatives, sizes of
      the coordinates.
    `near` (nodes, designs): Distances from singular positions at the first states.
    `step`, `conditioning` (designs,): First length of step; conditioning of the constraints at the
      first state.
    `begin`: The first time.
    `times` (instants,): Output instants.
    `rows` (kept,): Which rows are kept (see `mbody.kernels.layout`).
    `output` (kept, designs, instants): What is kept.
    `bad` (designs,): One where a design must go alone.
    """

    par: Rows
    mass: Rows
    weight: Rows
    y: Rows
    derivative: Rows
    scale: Rows
    near: Rows
    step: Floats
    conditioning: Floats
    begin: float
    times: Floats
    rows: Ints
    output: Stacks
    bad: Floats


@njit
def projected_derivative(L, W, y, K, refinements, among):
    """K ← the derivative of the projection of the states y, which they become, at W.time, in the
    lanes where `among` is one. Returns one in lanes where the projection did not converge, else
    zero.
    """
    w = wide()
    load_state(L, W, w, y)
    _, _, failed = projected_accelerations(L, W, w, 0.0, refinements, among)
    store_state(L, W, w, y)
    store_derivative(L, W, w, K)
    return failed


@njit
def not_finite(record, w):
    """Zero in lanes in which all rows of a record are finite, else NaN."""
    total = 0.0 * ld(record, 0, w)
    for n in range(1, record.shape[0]):
        total = total + 0.0 * ld(record, n, w)
    return total


@kernel
def initial_derivatives(L: Layout, W: Work, refinements: int, batch: Batch, record: Rows) -> None:
    """Project the first state of every design and evaluate its derivative: batch.y and
    batch.derivative, conditioning, near and bad; the first output instant is kept where it is the
    first time.

    record (rows, lanes): workspace. The last lanes repeat the last design.
    """
    w = wide()
    designs, lanes = batch.par.shape[1], record.shape[1]
    n3, t = 3 * L.bodies, batch.begin
    kept = batch.times[0] <= t
    for low in range(0, designs, lanes):
        for lane in range(lanes):
            design = min(low + lane, designs - 1)
            put_numbers(W, batch, lane, design)
            W.time[0, lane] = t
            for n in range(n3):
                W.q[n, lane], W.v[n, lane] = batch.y[n, design], batch.y[n3 + n, design]
            for n in range(L.owns):
                W.own[n, lane] = batch.y[2 * n3 + n, design]
        signals(L, W, w, L.signal_law.shape[0])
        _, _, failed = projected_accelerations(L, W, w, 0.0, refinements, 1.0 + 0.0 * wide())
        conditioning = sample_conditioning(L, W, w, 0)
        keep(L, W, w, record)
        failed = failed + not_finite(record, w)
        many = min(lanes, designs - low)
        if kept:
            for n in range(batch.rows.shape[0]):
                for lane in range(many):
                    batch.output[n, low + lane, 0] = record[batch.rows[n], lane]
        for lane in range(many):
            design = low + lane
            for n in range(n3):
                batch.y[n, design], batch.y[n3 + n, design] = W.q[n, lane], W.v[n, lane]
                batch.derivative[n, design] = W.v[n, lane]
                batch.derivative[n3 + n, design] = W.a[n, lane]
            for n in range(L.owns):
                batch.derivative[2 * n3 + n, design] = W.auxiliary_rate[n, lane]
        st(record, 0, conditioning, w)
        st(record, 1, failed, w)
        for lane in range(many):
            batch.conditioning[low + lane] = record[0, lane]
            for k in range(L.nodes):
                batch.near[k, low + lane] = W.near[k, lane]
            batch.bad[low + lane] = 0.0 if record[1, lane] == 0.0 else 1.0


@inline
def put_numbers(W, batch, lane, design):
    """The numbers of a design into a lane."""
    put_column(batch.par, design, W.par, lane)
    put_column(batch.mass, design, W.mass, lane)
    put_column(batch.weight, design, W.weight, lane)


# -- Control of the lanes of `mbody.kernels.runge_kutta_lanes`: designs, steps, output instants
#
# All of it lane by lane, by the numbers of one lane alone.

#: Slots of a lane beside those of `mbody.kernels.step_state`: start, length and end of this step,
#: whether that is the last one, whether the step is accepted, how much longer the next one is.
STEP_START, STEP_LENGTH, STEP_END, CLIPPED, ACCEPTED, GROWTH = range(PROGRESS, PROGRESS + 6)
#: Errors of the step; conditioning of its stages and at its end; its h |λ|; what failed.
LOW_ERROR, ERROR, STAGE_CONDITIONING, END_CONDITIONING, STIFFNESS, FAILED = range(
    PROGRESS + 6, PROGRESS + 12
)
#: Whether an output instant lies in the step, when, and at which part of it.
HAS_INSTANT, INSTANT, FRACTION = range(PROGRESS + 12, PROGRESS + 15)
#: Steps and time when the mean length was last judged; whether the step may have met a singular
#: position; kinetic energy of masses that replace missing ones.
MEAN_STEPS, MEAN_TIME, RISK, ARTIFICIAL_ENERGY = range(PROGRESS + 15, PROGRESS + 19)
#: The time that the lane goes on to.
UNTIL = PROGRESS + 19
CONTROLS = PROGRESS + 20
#: Of so many steps the mean length is judged.
MANY_STEPS = 10_000


class LaneWorkspace(Bundle):
    """Memory of the lanes.

    `state` (CONTROLS, lanes): The slots.
    `design` (lanes + 1,): The design of every lane, −1 of none, and the next one.
    `y`, `last`, `stage`, `end`, `scale` (2·coordinates, lanes): As of
      `mbody.kernels.step_state.Stepping`.
    `K`, `F` (derivatives, 2·coordinates, lanes) (terms, 2·coordinates, lanes): Derivatives and
      polynomials.
    `record` (rows, lanes): What is kept of an instant.
    """

    state: Rows
    design: Ints
    y: Rows
    last: Rows
    stage: Rows
    end: Rows
    scale: Rows
    K: Stacks
    F: Stacks
    record: Rows


@njit
def refill_lanes(L, W, batch, lanes, until):
    """Give lanes that are done the next designs, and every lane its step; whether any has one."""
    S, design, count = lanes.state, lanes.design, lanes.design.shape[0] - 1
    fresh, busy = False, False
    for lane in range(count):
        if design[lane] >= 0 and S[TIME, lane] >= until:
            design[lane] = -1
        while design[lane] < 0 and design[count] < batch.par.shape[1]:
            following = design[count]
            design[count] += 1
            if batch.bad[following] == 0.0:
                load_design(L, W, batch, lanes, lane, following)
                fresh = True
        S[UNTIL, lane] = until
        busy = begin_step(lanes, batch, lane) or busy
    if fresh:
        st(W.time, 0, ld(S, TIME, wide()), wide())
        signals(L, W, wide(), L.signal_law.shape[0])
    return busy


@inline
def begin_step(lanes, batch, lane):
    """Start and length of the next step of a lane; whether it has a design, and so one to make."""
    S = lanes.state
    t, h, until = S[TIME, lane], S[NEXT, lane], S[UNTIL, lane]
    S[ACCEPTED, lane] = 0.0
    busy = lanes.design[lane] >= 0
    if busy:
        S[ACCEPTED, lane] = 1.0
        S[CLIPPED, lane] = 1.0 if t + h >= until - TIME_END_ROUNDING * abs(until) else 0.0
        if S[CLIPPED, lane] > 0.5:
            h = until - t
        elif h < TIME_STEP_SHORTEST * max(abs(t), abs(until)):
            leave_design(lanes, batch, lane)
    # a lane without a design does not move
    S[STEP_START, lane], S[STEP_LENGTH, lane] = t, h if S[ACCEPTED, lane] > 0.5 else 0.0
    S[STEP_END, lane] = until if S[CLIPPED, lane] > 0.5 else t + S[STEP_LENGTH, lane]
    return busy


@njit
def load_design(L, W, batch, lanes, lane, design):
    """A design into a lane, at its first state."""
    S = lanes.state
    put_numbers(W, batch, lane, design)
    for n in range(lanes.y.shape[0]):
        lanes.y[n, lane] = batch.y[n, design]
        lanes.K[0, n, lane] = batch.derivative[n, design]
        lanes.scale[n, lane] = batch.scale[n, design]
    for k in range(L.nodes):
        W.near[k, lane] = batch.near[k, design]
    lanes.design[lane] = design
    for n in range(S.shape[0]):
        S[n, lane] = 0.0
    S[TIME, lane] = S[MEAN_TIME, lane] = batch.begin
    S[DELIVERED, lane] = 1.0 if batch.times[0] <= batch.begin else 0.0
    S[NEXT, lane] = batch.step[design]
    S[CONDITIONING, lane] = S[BEST_CONDITIONING, lane] = batch.conditioning[design]


@inline
def leave_design(lanes, batch, lane):
    """Leave the design of a lane to go alone."""
    batch.bad[lanes.design[lane]] = 1.0
    lanes.design[lane] = -1
    lanes.state[ACCEPTED, lane] = 0.0


@njit
def accept_or_reject(lanes, batch, order):
    """Which lanes accept their step by its error; whether any does. Rejected ones get a shorter
    one.
    """
    S, any_accepted = lanes.state, False
    for lane in range(lanes.design.shape[0] - 1):
        if S[ACCEPTED, lane] < 0.5:
            continue
        h, e3, e5 = S[STEP_LENGTH, lane], S[LOW_ERROR, lane], S[ERROR, lane]
        weak = S[STAGE_CONDITIONING, lane] < CONDITIONING_NEAR_SINGULAR * S[BEST_CONDITIONING, lane]
        if not e5 < FINITE or weak:
            leave_design(lanes, batch, lane)
            continue
        error, growth = next_length(h, e3, e5, lanes.y.shape[0], order, STEP_SAFETY)
        S[GROWTH, lane] = max(0.2, growth)
        if error > 1.0:
            S[REJECTED, lane] += 1.0
            S[NEXT, lane] = h * S[GROWTH, lane]
            S[ACCEPTED, lane] = 0.0
            continue
        any_accepted = True
    return any_accepted


@njit
def finish_steps(lanes, batch, patience, stable):
    """Lengths of the next steps of lanes that accept theirs; some leave their design instead."""
    S = lanes.state
    for lane in range(lanes.design.shape[0] - 1):
        if S[ACCEPTED, lane] < 0.5:
            continue
        best, end = S[BEST_CONDITIONING, lane], S[END_CONDITIONING, lane]
        lost = not S[FAILED, lane] < 0.5 or not end >= CONDITIONING_NO_END * best
        if lost or S[RISK, lane] > 0.0 or S[ARTIFICIAL_ENERGY, lane] > ARTIFICIAL_MASS_ENERGY:
            leave_design(lanes, batch, lane)
            continue
        S[CONDITIONING, lane] = end
        S[BEST_CONDITIONING, lane] = max(end, best)
        S[STEPS, lane] += 1.0
        S[TIME, lane] = S[STEP_END, lane]
        h, growth = S[STEP_LENGTH, lane], S[GROWTH, lane]
        if S[CLIPPED, lane] < 0.5:
            stiffness = S[STIFFNESS, lane]
            count_stiff(S[:, lane], growth * stiffness > stable)
            growth = max(0.2, min(growth, stable_growth(S[:, lane], h, stiffness, stable)))
        wanted = h * growth
        # a step that is cut to end in time says nothing against longer ones
        S[NEXT, lane] = max(wanted, S[NEXT, lane]) if S[CLIPPED, lane] > 0.5 else wanted
        left = S[UNTIL, lane] - S[STEP_END, lane]
        stiff = S[STIFF_COUNT, lane] >= STEP_STIFF_LIMIT and left > patience * S[NEXT, lane]
        lagging = False
        if S[STEPS, lane] - S[MEAN_STEPS, lane] >= MANY_STEPS:
            mean = (S[STEP_END, lane] - S[MEAN_TIME, lane]) / MANY_STEPS
            lagging = left > patience * mean
            S[MEAN_STEPS, lane], S[MEAN_TIME, lane] = S[STEPS, lane], S[STEP_END, lane]
        if stiff or lagging:
            leave_design(lanes, batch, lane)


@njit
def any_instant(lanes, times):
    """Whether an output instant lies before the end of a step."""
    S = lanes.state
    for lane in range(lanes.design.shape[0] - 1):
        k = int(S[DELIVERED, lane])
        if S[ACCEPTED, lane] > 0.5 and k < times.shape[0] and times[k] < S[STEP_END, lane]:
            return True
    return False


@njit
def next_instants(lanes, times):
    """The next output instant of every lane that has one in its step; whether any has."""
    S, found = lanes.state, False
    for lane in range(lanes.design.shape[0] - 1):
        k = int(S[DELIVERED, lane])
        S[HAS_INSTANT, lane], S[INSTANT, lane] = 0.0, S[STEP_END, lane]
        S[FRACTION, lane] = 1.0
        if S[ACCEPTED, lane] > 0.5 and k < times.shape[0] and times[k] <= S[STEP_END, lane]:
            found = True
            S[HAS_INSTANT, lane], S[INSTANT, lane] = 1.0, times[k]
            if times[k] < S[STEP_END, lane]:
                length = S[STEP_LENGTH, lane]
                S[FRACTION, lane] = (times[k] - S[STEP_START, lane]) / length
    return found


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
    st(S, RISK, singularity_risk(L, W, w, method.at, MONITOR_STEEPER, turned), w)
    st(S, ARTIFICIAL_ENERGY, artificial_energy(L, W, w, W.v) if regular > 0 else 0.0 * turned, w)
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
    see `mbody.kernels.runge_kutta`.
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
    A design of which one is doubtful (`mbody.kernels.runge_kutta`) is left to go alone.
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
        keep(L, W, w, lanes.record)
        st(S, FAILED, failed + not_finite(lanes.record, w), w)
        store_derivative(L, W, w, lanes.K[1])
        interpolation_errors(T, lanes, x)
        for lane in range(count):
            if S[HAS_INSTANT, lane] < 0.5:
                continue
            sound = S[FRACTION, lane] == 1.0 or S[ERROR, lane] <= STEP_INTERPOLATION_DOUBTFUL
            if S[FAILED, lane] == 0.0 and sound:
                k = int(S[DELIVERED, lane])
                for n in range(batch.rows.shape[0]):
                    batch.output[n, design[lane], k] = lanes.record[batch.rows[n], lane]
                S[DELIVERED, lane] += 1.0
            else:
                leave_design(lanes, batch, lane)


@njit
def interpolation_errors(T, lanes, x):
    """Defects of the polynomials' derivatives from those in row 1 of K at the parts x of the steps;
    see `mbody.kernels.runge_kutta`.
    """
    w, count = wide(), lanes.y.shape[0]
    h, total = ld(lanes.state, STEP_LENGTH, w), 0.0 * wide()
    for n in range(count):
        size = larger(np.abs(ld(lanes.y, n, w)), np.abs(ld(lanes.last, n, w)))
        unit = T.absolute * ld(lanes.scale, n, w) + T.relative * size
        lacks = (h * ld(lanes.K[1], n, w) - along_rate(lanes.F, n, x, w)) / unit
        total = total + lacks * lacks
    st(lanes.state, ERROR, total / count, w)


# -- Motions of many states side by side that another program leads on, step by step -----------
#
# States are in groups of ``LANES``. A group is loaded into the lanes, every lane goes on to a time
# of its own by the steps of `mbody.kernels.runge_kutta_lanes`, and the group is stored. What a lane
# gets depends on its own numbers alone, so neither its neighbours nor the number of threads matter;
# a lane that meets anything out of the ordinary stays at its last step and is marked, to go on
# alone.


class LaneStates(Bundle):
    """Many states, in groups of lanes.

    `rounds`: Steps of lanes in one call of `step_lanes`, at most.
    `own_numbers`: One where designs differ, so that each group brings its numbers; else zero.
    `par`, `mass`, `weight` (groups, rows, lanes): Numbers of the designs; empty where none differ.
    `y`, `derivative`, `scale` (groups, 2·coordinates + auxiliary states, lanes): States, their
      derivatives, sizes.
    `near` (groups, nodes, lanes): Distances from singular positions.
    `state` (groups, CONTROLS, lanes): See `mbody.kernels.runge_kutta_lanes`; UNTIL is where a lane
      goes on to.
    `inputs` (groups, inputs, lanes): Values of the inputs that are set from outside.
    `input_row` (inputs,): The signal row of each.
    `stale` (groups, lanes): One where inputs have changed since the derivative was evaluated.
    `fresh` (groups, lanes): One where a motion begins anew (see `evaluate_lanes`).
    `bad` (groups·lanes,): One where a state has to go on alone.
    """

    rounds: int
    own_numbers: int
    par: Stacks
    mass: Stacks
    weight: Stacks
    y: Stacks
    derivative: Stacks
    scale: Stacks
    near: Stacks
    state: Stacks
    inputs: Stacks
    input_row: Ints
    stale: Rows
    fresh: Rows
    bad: Floats


@kernel
def step_lanes(
    L: Layout,
    W: Work,
    method: Explicit,
    T: Tolerances,
    many: LaneStates,
    lanes: LaneWorkspace,
    first: int,
    last: int,
) -> int:
    """Lead the groups from `first` to before `last` on to their times UNTIL, by at most
    `many.rounds` steps of lanes.

    Returns the group that is not done yet, `last` if all are.
    """
    count = lanes.design.shape[0] - 1
    left = many.rounds
    if many.own_numbers == 0:
        signals(L, W, wide(), L.signal_law.shape[0])
    for group in range(first, last):
        if not is_behind(many, group, count):
            continue
        load_group(L, W, many, lanes, group)
        choose_lanes(many, lanes, group)
        refresh(L, W, T, many, lanes, group)
        first_lengths(T, lanes)
        while begin_steps(lanes, many):
            if left == 0:
                store_group(L, W, many, lanes, group)
                return group
            left -= 1
            if take_steps(L, W, method, T, many, lanes):
                go_on(method, lanes)
        store_group(L, W, many, lanes, group)
    return last


@njit
def is_behind(many, group, count):
    """Whether a lane of the group is to go on."""
    for lane in range(count):
        if many.state[group, TIME, lane] < many.state[group, UNTIL, lane]:
            return True
    return False


@inline
def load_rows(source, target):
    """target ← source, both (rows, lanes)."""
    w = wide()
    for n in range(source.shape[0]):
        st(target, n, ld(source, n, w), w)


@njit
def load_group(L, W, many, lanes, group):
    """A group into the lanes."""
    w = wide()
    load_rows(many.y[group], lanes.y)
    load_rows(many.derivative[group], lanes.K[0])
    load_rows(many.scale[group], lanes.scale)
    load_rows(many.near[group], W.near)
    load_rows(many.state[group], lanes.state)
    st(W.time, 0, ld(lanes.state, TIME, w), w)
    if many.own_numbers == 1:
        load_rows(many.par[group], W.par)
        load_rows(many.mass[group], W.mass)
        load_rows(many.weight[group], W.weight)
        signals(L, W, w, L.signal_law.shape[0])
    for n in range(many.input_row.shape[0]):
        st(W.signal, many.input_row[n], ld(many.inputs[group], n, w), w)


@njit
def store_group(L, W, many, lanes, group):
    """The lanes into their group."""
    load_rows(lanes.y, many.y[group])
    w, near = wide(), many.near[group]
    for n in range(lanes.y.shape[0]):
        st(many.derivative[group], n, ld(lanes.K[0], n, w), w)
    for n in range(near.shape[0]):
        st(near, n, ld(W.near, n, w), w)
    load_rows(lanes.state, many.state[group])


@njit
def choose_lanes(many, lanes, group):
    """Lanes that are to go on have the number of their state, others none."""
    S, count = lanes.state, lanes.design.shape[0] - 1
    for lane in range(count):
        number = group * count + lane
        behind = S[TIME, lane] < S[UNTIL, lane] and many.bad[number] == 0.0
        lanes.design[lane] = number if behind else -1


@njit
def begin_steps(lanes, many):
    """Give every lane that is behind its next step; whether there is any."""
    S, busy = lanes.state, False
    for lane in range(lanes.design.shape[0] - 1):
        if S[TIME, lane] >= S[UNTIL, lane]:
            lanes.design[lane] = -1
        busy = begin_step(lanes, many, lane) or busy
    return busy


@njit
def refresh(L, W, T, many, lanes, group):
    """The derivatives anew where inputs have changed: the states are on the manifold."""
    w, stale, any_stale = wide(), many.stale[group], False
    for lane in range(lanes.design.shape[0] - 1):
        if stale[lane] > 0.0 and lanes.design[lane] >= 0:
            any_stale = True
    if not any_stale:
        return
    off_manifold_derivative(L, W, lanes.y, ld(lanes.state, TIME, w), lanes.K[1], T.full_refinements)
    for lane in range(lanes.design.shape[0] - 1):
        if stale[lane] > 0.0 and lanes.design[lane] >= 0:
            for n in range(lanes.y.shape[0]):
                lanes.K[0, n, lane] = lanes.K[1, n, lane]
            stale[lane] = 0.0


@njit
def first_lengths(T, lanes):
    """The lengths of first steps, as of `mbody.analysis.dynamics.integrators.first_step`."""
    S = lanes.state
    for lane in range(lanes.design.shape[0] - 1):
        if lanes.design[lane] < 0 or S[STEPS, lane] > 0.0 or S[NEXT, lane] > 0.0:
            continue
        d0, d1, count = 0.0, 0.0, lanes.y.shape[0]
        for n in range(count):
            y = lanes.y[n, lane]
            size = T.absolute * lanes.scale[n, lane] + T.relative * abs(y)
            if abs(y) > STEP_FIRST_ORIGIN * lanes.scale[n, lane]:
                d0 += (y / size) ** 2
            d1 += (lanes.K[0, n, lane] / size) ** 2
        d0, d1 = np.sqrt(d0 / count), np.sqrt(d1 / count)
        whole = S[UNTIL, lane] - S[TIME, lane]
        length = (
            0.01 * d0 / d1
            if d0 > STEP_FIRST_SILENT and whole * d1 > STEP_FIRST_SILENT
            else STEP_FIRST_LITTLE * whole
        )
        S[NEXT, lane] = min(length, STEP_FIRST_MOST * whole)


@kernel
def evaluate_lanes(
    L: Layout,
    W: Work,
    refinements: int,
    many: LaneStates,
    lanes: LaneWorkspace,
    records: Stacks,
    first: int,
    last: int,
) -> None:
    """Records of the present instant of every state: records (groups, rows, lanes).

    States marked `fresh` begin there: they become their projection, with derivative, conditioning
    and distances; those that cannot are marked bad. Others are left as they are.
    """
    w, S = wide(), lanes.state
    if many.own_numbers == 0:
        signals(L, W, w, L.signal_law.shape[0])
    for group in range(first, last):
        load_group(L, W, many, lanes, group)
        fresh, record = many.fresh[group], records[group]
        load_state(L, W, w, lanes.y)
        _, _, failed = projected_accelerations(L, W, w, 0.0, refinements, 1.0 + 0.0 * wide())
        keep(L, W, w, record)
        begins = ld(many.fresh, group, w)
        near = many.near[group]
        conditioning = sample_conditioning(L, W, w, 0)
        for n in range(near.shape[0]):
            st(near, n, select_le(1.0, begins, ld(W.near, n, w), ld(near, n, w)), w)
        for row in range(2):
            old = ld(S, CONDITIONING if row == 0 else BEST_CONDITIONING, w)
            new = select_le(1.0, begins, conditioning, old)
            st(S, CONDITIONING if row == 0 else BEST_CONDITIONING, new, w)
        # NaN is bad
        st(S, FAILED, larger(failed, not_finite(record, w)), w)
        store_state(L, W, w, lanes.stage)
        for n in range(L.owns):
            st(lanes.stage, 6 * L.bodies + n, ld(W.own, n, w), w)
        store_derivative(L, W, w, lanes.K[1])
        for n in range(lanes.y.shape[0]):
            y, rate = ld(lanes.y, n, w), ld(lanes.K[0], n, w)
            st(lanes.y, n, select_le(1.0, begins, ld(lanes.stage, n, w), y), w)
            st(lanes.K[0], n, select_le(1.0, begins, ld(lanes.K[1], n, w), rate), w)
        for lane in range(lanes.design.shape[0] - 1):
            if fresh[lane] > 0.0:
                bad = S[FAILED, lane] != 0.0
                many.bad[group * (lanes.design.shape[0] - 1) + lane] = 1.0 if bad else 0.0
                S[MEAN_TIME, lane] = S[TIME, lane]
                fresh[lane] = 0.0
        load_rows(lanes.y, many.y[group])
        for n in range(lanes.y.shape[0]):
            st(many.derivative[group], n, ld(lanes.K[0], n, w), w)
        load_rows(lanes.state, many.state[group])
