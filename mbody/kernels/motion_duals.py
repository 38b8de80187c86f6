"""Exact derivatives of motions in dual numbers: of driven ones, and of free ones."""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import dual, ld, st, value
from mbody.core.tolerances import (
    FINITE,
    PIVOT_VANISHED,
    STEP_SAFETY,
    TIME_END_ROUNDING,
    TIME_STEP_SHORTEST_DUALS,
)
from mbody.kernels.constraints import (
    accelerations,
    body_rotations,
    multipliers,
    newton,
    rows,
    velocities,
)
from mbody.kernels.forces import (
    KNOWN_MOTION,
    all_loads,
    augmented_solution,
    forces,
    free_accelerations,
    measure_solution,
    signals,
)
from mbody.kernels.friction import viscous_friction
from mbody.kernels.layout import Layout, Work, keep
from mbody.kernels.loop_closure import project_velocity
from mbody.kernels.runge_kutta import Explicit, combined, next_length, stage_state
from mbody.kernels.schur_ldl import factor
from mbody.kernels.state_derivative import load_state, store_derivative, store_state
from mbody.kernels.step_state import DONE, MORE, STEP_VANISHED

#: What the drivers go by: time; equal steps of one driver, when its law makes them; given values
#: and rates.
BY_TIME, BY_LAW, BY_VALUE = 0, 1, 2


class DualInstants(Bundle):
    """Instants of a driven motion, closed as far as values go, and what is computed of them."""

    mode: int  # BY_TIME, BY_LAW or BY_VALUE
    leader: int  # number of the driver that goes at equal steps, by law
    t: Floats  # (instants,)
    given: Stacks  # (instants, drivers, 3): value, rate, acceleration, except by time
    q: Rows  # (instants, coordinates)
    rows: int  # of a record of `mbody.kernels.layout.keep`
    regularization: float
    with_forces: int  # whether reactions are computed
    at_rest: int  # whether velocities and accelerations are zero (statics)
    loads: int  # how many loads follow, each alone: all or none


class DualOutput(Bundle):
    """Output arrays of the kernel."""

    # (instants, rows, lanes): rows as of `mbody.kernels.layout.keep`; the time; signals of the
    # drivers, three each; forces of the loads on all coordinates
    output: Stacks
    # (instants, lanes): what is left of the tangents of Φ, the greatest of all rows; not zero where
    # loops with redundant rows do not close with other numbers
    unclosed: Rows


@kernel
def driven_duals(L: Layout, W: Work, instants: DualInstants, found: DualOutput) -> None:
    """The values and tangents of every instant by those of W.par and W.mass."""
    w = dual()
    output = found.output
    st(W.time, 0, 0.0, w)
    signals(L, W, w, L.signal_law.shape[0])
    # where the turn begins
    st(W.scratch, 31, ld(W.signal, L.driver_row[instants.leader], w), w)
    for k in range(instants.t.shape[0]):
        set_signals(L, W, w, instants, k)
        for n in range(3 * L.bodies):
            st(W.q, n, instants.q[k, n], w)
        one_instant(L, W, w, instants)
        keep_unclosed(L, W, w, found, k)
        keep_duals(L, W, w, output[k], instants.rows, instants.loads)


@njit
def keep_duals(L, W, w, output, rows, loads):
    """output (rows, lanes) ← all of an instant: the record, the time, signals of the drivers, three
    each, and forces of each of so many loads on all coordinates.
    """
    keep(L, W, w, output)
    st(output, rows, ld(W.time, 0, w), w)
    row = rows + 1
    for d in range(L.driver_row.shape[0]):
        for n in range(3):
            st(output, row + n, ld(W.signal, L.driver_row[d] + n, w), w)
        row += 3
    for cause in range(loads):
        forces(L, W, w, cause)
        for n in range(3 * L.bodies):
            st(output, row + n, ld(W.force, n, w), w)
        row += 3 * L.bodies


@inline
def keep_unclosed(L, W, w, found, k):
    """Tangents of Φ as the last step of Newton's method found them."""
    for lane in range(found.unclosed.shape[1]):
        most = 0.0
        for n in range(2 * L.nodes):
            most = max(most, abs(W.phi[n, lane]))
        found.unclosed[k, lane] = most


@inline
def set_signals(L, W, w, instants, k):
    """Signals of instant k."""
    st(W.time, 0, instants.t[k], w)
    signals(L, W, w, L.varying)
    if instants.mode == BY_LAW:
        # the time at which the law is so far from its beginning depends on the numbers of the law
        o = L.driver_row[instants.leader]
        change = ld(W.signal, o, w) - ld(W.scratch, 31, w)
        off, rate = change - value(change), ld(W.signal, o + 1, w)
        if rate != 0.0:
            st(W.time, 0, instants.t[k] - off / rate, w)
            signals(L, W, w, L.varying)
    elif instants.mode == BY_VALUE:
        for d in range(L.driver_row.shape[0]):
            if L.driver_dependent[d] == 0:
                for n in range(3):
                    st(W.signal, L.driver_row[d] + n, instants.given[k, d, n], w)


@njit
def one_instant(L, W, w, instants):
    """Position, velocity, acceleration and multipliers with their tangents."""
    regularization = instants.regularization
    # the proximal term leaves a part of 1e-9 of a step to the next one
    steps = 2 if regularization == 0.0 else 3
    for _ in range(steps):
        newton(L, W, w, regularization, PIVOT_VANISHED)
    if instants.at_rest:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
    else:
        velocities(L, W, w, True)
        accelerations(L, W, w, True)
    if instants.with_forces:
        all_loads(L, W, w)
        if L.friction_kind.shape[0] > 0:
            viscous_friction(L, W, w)
        multipliers(L, W, w)
        if L.force_steps < L.formula_step.shape[0]:
            measure_solution(L, W, w, KNOWN_MOTION)


# -- Exact derivatives of free motions: the steps of a Runge–Kutta method in dual numbers ------
#
# The tangents obey the variational equations of the motion, and are integrated with it, as parts of
# one state, so that the length of a step is what values and tangents both allow. Every step ends
# with the projection onto Φ = 0 and Φ_q v = ν, with Newton steps for the tangents too, which lag by
# one.
#
# Hairer, Nørsett, Wanner: Solving Ordinary Differential Equations I, I.14 (derivatives by initial
# values and parameters) and II.5.

#: Newton steps of a projection: values of a step's end have converged after two or three.
NEWTON_STEPS = 4
#: Slots of `FreeDuals.state`: time, length of the next step, steps, those rejected.
T_NOW, NEXT_LENGTH, STEP_COUNT, REJECTED_STEPS = range(4)


class FreeDuals(Bundle):
    """A free motion in dual numbers, and where its instants are kept."""

    t: Floats  # (instants,), rising; the first one may be the beginning
    relative: float
    absolute: float
    regularization: float
    refinements: int
    rows: int  # of a record of `mbody.kernels.layout.keep`
    loads: int  # how many loads follow, each alone: all or none
    scale: Floats  # sizes of the numbers of the state
    state: Floats  # see T_NOW
    y: Rows  # the state (numbers, lanes)
    K: Stacks  # its derivatives (stages + 1, numbers, lanes)
    stage: Rows
    end: Rows
    error: Stacks  # of low and of high order (2, numbers, lanes)
    output: Stacks  # (instants, rows, lanes), as of `mbody.kernels.motion_duals`


@njit
def projected(L, W, w, F, y):
    """The state y ← its projection; accelerations and multipliers there."""
    load_state(L, W, w, y)
    signals(L, W, w, L.varying)
    for _ in range(NEWTON_STEPS):
        newton(L, W, w, F.regularization, PIVOT_VANISHED)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, F.regularization, PIVOT_VANISHED)
    project_velocity(L, W, w, F.refinements)
    rows(L, W, w, None, True)
    augmented_solution(L, W, w, F.refinements)
    store_state(L, W, w, y)


@njit
def errors(F):
    """Sums of squares of the errors of low and of high order, in tolerances, and how many: values
    by their sizes, tangents by the greatest one of the same number of the description.
    """
    y, end, low, high = F.y, F.end, F.error[0], F.error[1]
    e3, e5, count = 0.0, 0.0, 0
    for lane in range(y.shape[1]):
        most = 0.0
        for n in range(y.shape[0]):
            most = max(most, max(abs(y[n, lane]), abs(end[n, lane])) / F.scale[n])
        if lane > 0 and not most > 0.0:
            continue
        for n in range(y.shape[0]):
            size = max(abs(y[n, lane]), abs(end[n, lane]))
            if lane == 0:
                unit = F.absolute * F.scale[n] + F.relative * size
            else:
                unit = F.relative * F.scale[n] * most
            e3 += (low[n, lane] / unit) ** 2
            e5 += (high[n, lane] / unit) ** 2
        count += y.shape[0]
    return e3, e5, count


@kernel
def free_duals(L: Layout, W: Work, method: Explicit, F: FreeDuals, steps: int) -> int:
    """At most so many steps of each of the ways between instants; returns DONE, MORE where these
    were not enough, or STEP_VANISHED.
    """
    w = dual()
    A, B, C, E = method.A, method.B, method.C, method.E
    y, K, stage, end, state = F.y, F.K, F.stage, F.end, F.state
    stages, size = B.shape[0], y.shape[0]
    # of the first instant the time may have tangents, which the workspace holds
    W.time[0, 0] = state[T_NOW]
    signals(L, W, w, L.signal_law.shape[0])
    projected(L, W, w, F, y)
    store_derivative(L, W, w, K[0])
    for k in range(F.t.shape[0]):
        left = steps
        while state[T_NOW] < F.t[k]:
            t, h = state[T_NOW], state[NEXT_LENGTH]
            clipped = t + h >= F.t[k] - TIME_END_ROUNDING * abs(F.t[k])
            if clipped:
                h = F.t[k] - t
            if not h > TIME_STEP_SHORTEST_DUALS * abs(t):
                return STEP_VANISHED
            if left == 0:
                return MORE
            left -= 1
            for s in range(1, stages):
                stage_state(A[s], s, K, y, h, stage, w)
                load_state(L, W, w, stage)
                st(W.time, 0, t + C[s] * h, w)
                free_accelerations(L, W, w, F.regularization, F.refinements)
                store_derivative(L, W, w, K[s])
            stage_state(B, stages, K, y, h, end, w)
            st(W.time, 0, F.t[k] if clipped else t + h, w)
            projected(L, W, w, F, end)
            store_derivative(L, W, w, K[stages])
            combined(E[0], E.shape[1], K, F.error[0], w)
            combined(E[1], E.shape[1], K, F.error[1], w)
            e3, e5, count = errors(F)
            if not e5 < FINITE:
                state[NEXT_LENGTH] = 0.25 * h
                state[REJECTED_STEPS] += 1.0
                continue
            error, growth = next_length(h, e3, e5, count, method.order, STEP_SAFETY)
            if error > 1.0:
                state[NEXT_LENGTH] = h * max(0.2, growth)
                state[REJECTED_STEPS] += 1.0
                continue
            state[T_NOW] = F.t[k] if clipped else t + h
            wanted = h * max(0.2, growth)
            state[NEXT_LENGTH] = max(wanted, state[NEXT_LENGTH]) if clipped else wanted
            state[STEP_COUNT] += 1.0
            for n in range(size):
                st(y, n, ld(end, n, w), w)
                st(K[0], n, ld(K[stages], n, w), w)
        # a record is of the present instant: the last evaluation may be of a step that was rejected
        W.time[0, 0] = state[T_NOW]
        projected(L, W, w, F, y)
        keep_duals(L, W, w, F.output[k], F.rows, F.loads)
    return DONE
