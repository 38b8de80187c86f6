"""Beginning of a model's image without Python: closing loops, and the first state of a free motion
(`mbody.image`).
"""

from __future__ import annotations

import math

from mbody.core.bundle import Bundle, Floats, Rows
from mbody.core.decorators import kernel, njit
from mbody.core.tolerances import (
    ARTIFICIAL_MASS_ENERGY,
    FINITE,
    LOOP_OPEN,
    RATE_NONE_MOTION,
    STEP_FIRST_LITTLE,
    STEP_FIRST_ORIGIN,
    STEP_FIRST_SILENT,
)
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.forces import signals
from mbody.kernels.layout import Layout, Work, store_least_masses
from mbody.kernels.loop_closure import close_from, gap
from mbody.kernels.state_derivative import derivative_anew, first_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_LIMIT,
    CROSSING_TIME,
    KNOWN_UNTIL,
    LEAST_CONDITIONING,
    NEXT,
    SHORTENED_UNTIL,
    TIME,
    Stepping,
    Tolerances,
)

#: How `begin_motion` ends: well; the loops do not close near the start; something has no finite
#: value there; a body has so little mass that its motion needs corrections, for which the image was
#: not made.
BEGUN, OPEN, NO_VALUE, MASSLESS = range(4)


class MotionStart(Bundle):
    """How a free motion begins.

    `times` (2,): First and last time.
    `q`, `v` (coordinates,): Position and velocity near which it begins.
    `own` (owns,): States of a user's own.
    """

    times: Floats
    q: Floats
    v: Floats
    own: Floats


@kernel
def close_at(
    L: Layout, W: Work, t: float, given: Floats, regularization: float, tolerance: float
) -> tuple[bool, bool, float]:
    """Close the loops from W.q at time t: (closed, by the straight path, least pivot as a part of
    its diagonal).

    given (drivers,): values of the drivers; where it is not a number, the law has the word. Where
    rows are redundant Newton's method may rest at the smallest gap: then the loops are not closed.
    """
    W.time[0, 0] = t
    signals(L, W, 0.0, L.signal_law.shape[0])
    for d in range(L.driver_row.shape[0]):
        if given[d] == given[d]:
            W.signal[L.driver_row[d], 0] = given[d]
    good, straight, ratio = close_from(L, W, regularization, tolerance)
    return good and is_closed(L, W), straight, ratio


@njit
def is_closed(L, W):
    """Whether no row is open at W.q."""
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, None)
    return math.sqrt(2.0 * gap(L, W)) < LOOP_OPEN * W.size[0, 0]


@njit
def store_inverse_masses(L, W):
    """W.weight of a free motion from W.mass, as `mbody.kernels.layout` has it of batches; whether
    solutions need no refinement.
    """
    refined = store_least_masses(L, W.mass, W.size, 0, W.u, W.r, W.a)
    for s in range(L.slots):
        for n in range(3):
            row = 3 * L.slot_body[s] + n
            W.weight[3 * s + n, 0] = 1.0 / max(W.mass[row, 0] * W.share[s, 0], W.a[row, 0])
    return not refined


@njit
def store_sizes(L, W, S, v):
    """S.scale: sizes of coordinates and of their rates at the start, to which absolute errors are
    relative; as simulations of batches has it for many motions. Those of auxiliary states stay.
    """
    n3, greatest = 3 * L.bodies, 0.0
    for n in range(n3):
        S.scale[n], S.scale[n3 + n] = 1.0 if n % 3 == 2 else W.size[1 + n // 3, 0], 0.0
    for n in range(n3):
        rate = max(abs(v[n]) / S.scale[n], math.sqrt(abs(S.K[0, n3 + n]) / S.scale[n]))
        o = n3 + 3 * L.body_part[n // 3]
        S.scale[o], greatest = max(S.scale[o], rate), max(greatest, rate)
    greatest = 1.0 if greatest == 0.0 else greatest
    for back in range(n3):
        # the first body of a part, which has its rate, comes last
        n = n3 - 1 - back
        rate = S.scale[n3 + 3 * L.body_part[n // 3]]
        rate = rate if rate > RATE_NONE_MOTION * greatest else greatest
        S.scale[n3 + n] = rate * S.scale[n]


@njit
def first_length(S, T, whole):
    """A rough first step (Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*,
    II.4).
    """
    count = S.y.shape[0]
    d0, d1 = 0.0, 0.0
    for n in range(count):
        size = T.absolute * S.scale[n] + T.relative * abs(S.y[n])
        if abs(S.y[n]) > STEP_FIRST_ORIGIN * S.scale[n]:
            d0 += (S.y[n] / size) ** 2
        d1 += (S.K[0, n] / size) ** 2
    d0, d1 = math.sqrt(d0 / count), math.sqrt(d1 / count)
    step = (
        0.01 * d0 / d1
        if d0 > STEP_FIRST_SILENT and d1 > STEP_FIRST_SILENT
        else STEP_FIRST_LITTLE * whole
    )
    return min(step, 0.1 * whole)


@njit
def has_values(S):
    """Whether the derivative of the state is finite."""
    good = True
    for n in range(S.y.shape[0]):
        good = good and abs(S.K[0, n]) < FINITE
    return good


@njit
def again(L, W, S, T, record):
    """The derivative of the present state anew, with other inputs: the steps go on as they were."""
    if not derivative_anew(L, W, S, T.full_refinements, record):
        return OPEN
    return BEGUN if has_values(S) else NO_VALUE


@kernel
def begin_motion(
    L: Layout, W: Work, S: Stepping, T: Tolerances, start: MotionStart, page: Rows, goes_on: bool
) -> int:
    """First state of a free motion, its derivative and the length of the first step; page (rows, 1)
    is what is kept of it. Where a motion `goes_on`, only inputs have changed: the present state
    stays, and its derivative is evaluated anew. Returns BEGUN, OPEN, NO_VALUE or MASSLESS.
    """
    n3, state = 3 * L.bodies, S.state
    if goes_on:
        return again(L, W, S, T, page)
    if not store_inverse_masses(L, W) and T.refinements == 0:
        return MASSLESS
    for n in range(n3):
        S.y[n], S.y[n3 + n] = start.q[n], start.v[n]
    for n in range(L.owns):
        S.y[2 * n3 + n] = start.own[n]
    for n in range(state.shape[0]):
        state[n] = 0.0
    state[TIME] = start.times[0]
    state[KNOWN_UNTIL] = state[SHORTENED_UNTIL] = state[CROSSING_TIME] = -math.inf
    state[LEAST_CONDITIONING], state[ARTIFICIAL_LIMIT] = math.inf, ARTIFICIAL_MASS_ENERGY
    if not first_derivative(L, W, S, T.full_refinements, page) or not is_closed(L, W):
        return OPEN
    if not has_values(S):
        return NO_VALUE
    store_sizes(L, W, S, start.v)
    state[NEXT] = first_length(S, T, start.times[1] - start.times[0])
    return BEGUN
