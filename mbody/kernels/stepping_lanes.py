"""Motions of many states side by side that another program leads on, step by step.

States are in groups of ``LANES``. A group is loaded into the lanes, every lane goes on to a time of
its own by the steps of `mbody.kernels.runge_kutta_lanes`, and the group is stored. What a lane gets
depends on its own numbers alone, so neither its neighbours nor the number of threads matter; a lane
that meets anything out of the ordinary stays at its last step and is marked, to go on alone.
"""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import larger, ld, select_le, st, wide
from mbody.kernels.forces import signals
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import keep
from mbody.kernels.projection import projected_accelerations
from mbody.kernels.runge_kutta_lanes import go_on, off_manifold_derivative, take_steps
from mbody.kernels.runge_kutta_lanes_control import (
    FAILED,
    JUDGED_TIME,
    UNTIL,
    LaneWorkspace,
    begin_step,
)
from mbody.kernels.runge_kutta_lanes_rhs import not_finite
from mbody.kernels.singularity_monitor import sample_conditioning
from mbody.kernels.state_derivative import load_state, store_derivative, store_state
from mbody.kernels.step_state import BEST_CONDITIONING, CONDITIONING, NEXT, STEPS, TIME, Tolerances
from mbody.kernels.tableaus import Explicit

__all__ = ["LaneStates", "evaluate_lanes", "step_lanes"]

#: Sizes, in tolerances, below which a state or its derivative says nothing of the first step; parts
#: of the way that it takes then, and at most (Hairer, Nørsett, Wanner, II.4).
SILENT, LITTLE, MOST = 1e-5, 1e-6, 0.1


class LaneStates(Bundle):
    """Many states, in groups of lanes.

    Attributes
    ----------
    rounds : int
        Steps of lanes in one call of `step_lanes`, at most.
    own_numbers : int
        One where designs differ, so that each group brings its numbers; else zero.
    par, mass, weight : arrays (groups, rows, lanes)
        Numbers of the designs; empty where none differ.
    y, derivative, scale : arrays (groups, 2·coordinates + own states, lanes)
        States, their derivatives, sizes.
    near : array (groups, nodes, lanes)
        Distances from singular positions.
    state : array (groups, CONTROLS, lanes)
        See `mbody.kernels.runge_kutta_lanes_control`; UNTIL is where a lane goes on to.
    inputs : array (groups, inputs, lanes)
        Values of the inputs that are set from outside.
    input_row : array (inputs,)
        The signal row of each.
    stale : array (groups, lanes)
        One where inputs have changed since the derivative was evaluated.
    fresh : array (groups, lanes)
        One where a motion begins anew (see `evaluate_lanes`).
    bad : array (groups·lanes,)
        One where a state has to go on alone.
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
    """The lengths of first steps, as of `mbody.analysis.dynamics.initial_step.first_step`."""
    S = lanes.state
    for lane in range(lanes.design.shape[0] - 1):
        if lanes.design[lane] < 0 or S[STEPS, lane] > 0.0 or S[NEXT, lane] > 0.0:
            continue
        d0, d1, count = 0.0, 0.0, lanes.y.shape[0]
        for n in range(count):
            y = lanes.y[n, lane]
            size = T.absolute * lanes.scale[n, lane] + T.relative * abs(y)
            d0 += (y / size) ** 2
            d1 += (lanes.K[0, n, lane] / size) ** 2
        d0, d1 = np.sqrt(d0 / count), np.sqrt(d1 / count)
        whole = S[UNTIL, lane] - S[TIME, lane]
        length = 0.01 * d0 / d1 if d0 > SILENT and d1 > SILENT else LITTLE * whole
        S[NEXT, lane] = min(length, MOST * whole)


@kernel
def evaluate_lanes(
    L: Layout,
    W: Work,
    refinements: int,
    many: LaneStates,
    lanes: LaneWorkspace,
    pages: Stacks,
    first: int,
    last: int,
) -> None:
    """What is kept of the present instant of every state: pages (groups, rows, lanes).

    States marked `fresh` begin there: they become their projection, with derivative, conditioning
    and distances; those that cannot are marked bad. Others are left as they are.
    """
    w, S = wide(), lanes.state
    if many.own_numbers == 0:
        signals(L, W, w, L.signal_law.shape[0])
    for group in range(first, last):
        load_group(L, W, many, lanes, group)
        fresh, page = many.fresh[group], pages[group]
        load_state(L, W, w, lanes.y)
        _, _, failed = projected_accelerations(L, W, w, 0.0, refinements, 1.0 + 0.0 * wide())
        keep(L, W, w, page)
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
        st(S, FAILED, larger(failed, not_finite(page, w)), w)
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
                S[JUDGED_TIME, lane] = S[TIME, lane]
                fresh[lane] = 0.0
        load_rows(lanes.y, many.y[group])
        for n in range(lanes.y.shape[0]):
            st(many.derivative[group], n, ld(lanes.K[0], n, w), w)
        load_rows(lanes.state, many.state[group])
