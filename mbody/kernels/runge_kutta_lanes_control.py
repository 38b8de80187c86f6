"""Control of the lanes of `mbody.kernels.runge_kutta_lanes`: designs, steps, output instants.

All of it lane by lane, by the numbers of one lane alone.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Ints, Rows, Stacks
from mbody.core.decorators import inline, njit
from mbody.core.lanes import ld, st, wide
from mbody.kernels.forces import signals
from mbody.kernels.runge_kutta import END_BELOW
from mbody.kernels.runge_kutta_lanes_rhs import put_numbers
from mbody.kernels.runge_kutta_stages import (
    SAFETY,
    STIFF_LIMIT,
    count_stiff,
    next_length,
    stable_growth,
)
from mbody.kernels.singularity_monitor import STAND_IN_PART
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    DELIVERED,
    NEAR_SINGULAR_BELOW,
    NEXT,
    PROGRESS,
    REJECTED,
    STEPS,
    STIFF_COUNT,
    TIME,
)

__all__ = [
    "ACCEPTED",
    "CONTROLS",
    "END_CONDITIONING",
    "ERROR",
    "FAILED",
    "FRACTION",
    "HAS_INSTANT",
    "INSTANT",
    "LOW_ERROR",
    "RISK",
    "STAGE_CONDITIONING",
    "STAND_INS",
    "STEP_LENGTH",
    "STEP_START",
    "STIFFNESS",
    "UNTIL",
    "LaneWorkspace",
    "accept_or_reject",
    "any_instant",
    "begin_step",
    "finish_steps",
    "leave_design",
    "next_instants",
    "refill_lanes",
]

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
JUDGED_STEPS, JUDGED_TIME, RISK, STAND_INS = range(PROGRESS + 15, PROGRESS + 19)
#: The time that the lane goes on to.
UNTIL = PROGRESS + 19
CONTROLS = PROGRESS + 20
#: Of so many steps the mean length is judged.
MANY_STEPS = 10_000


class LaneWorkspace(Bundle):
    """Memory of the lanes.

    Attributes
    ----------
    state : array (CONTROLS, lanes)
        The slots.
    design : array (lanes + 1,)
        The design of every lane, −1 of none, and the next one.
    y, last, stage, end, scale : arrays (2·coordinates, lanes)
        As of `mbody.kernels.step_state.Stepping`.
    K, F : arrays (derivatives, 2·coordinates, lanes), (terms, 2·coordinates, lanes)
        Derivatives and polynomials.
    page : array (rows, lanes)
        What is kept of an instant.
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
    page: Rows


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
        S[CLIPPED, lane] = 1.0 if t + h >= until - 1e-14 * abs(until) else 0.0
        if S[CLIPPED, lane] > 0.5:
            h = until - t
        elif h < 1e-13 * max(abs(t), abs(until)):
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
    S[TIME, lane] = S[JUDGED_TIME, lane] = batch.begin
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
        weak = S[STAGE_CONDITIONING, lane] < NEAR_SINGULAR_BELOW * S[BEST_CONDITIONING, lane]
        if not e5 < 1e300 or weak:
            leave_design(lanes, batch, lane)
            continue
        error, growth = next_length(h, e3, e5, lanes.y.shape[0], order, SAFETY)
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
        lost = not S[FAILED, lane] < 0.5 or not end >= END_BELOW * best
        if lost or S[RISK, lane] > 0.0 or S[STAND_INS, lane] > STAND_IN_PART:
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
        stiff = S[STIFF_COUNT, lane] >= STIFF_LIMIT and left > patience * S[NEXT, lane]
        slow = False
        if S[STEPS, lane] - S[JUDGED_STEPS, lane] >= MANY_STEPS:
            mean = (S[STEP_END, lane] - S[JUDGED_TIME, lane]) / MANY_STEPS
            slow = left > patience * mean
            S[JUDGED_STEPS, lane], S[JUDGED_TIME, lane] = S[STEPS, lane], S[STEP_END, lane]
        if stiff or slow:
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
