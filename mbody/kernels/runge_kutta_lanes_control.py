"""Which lane of `runge_kutta_lanes` does what: designs that come and go, steps, instants.

All of it lane by lane, with one lane's numbers alone.
"""

from __future__ import annotations

import math

from mbody.compiler.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.compiler.jit import inline, njit
from mbody.compiler.lanes import ld, st, wide
from mbody.kernels.forces import signals
from mbody.kernels.runge_kutta import BEHIND, CALM_STEPS, SAFETY, STIFF_STEPS
from mbody.kernels.runge_kutta_lanes_rhs import put_numbers
from mbody.kernels.singularity_monitor import LIGHT
from mbody.kernels.step_state import (
    CALM,
    FREEST,
    MET,
    NEXT,
    PIVOT,
    PROGRESS,
    REJECTED,
    STEPS,
    STIFF,
    TIME,
    WEAK,
)

__all__ = [
    *("AT", "BEGUN", "CONTROLS", "END", "ERROR_3", "ERROR_5", "FAILED", "KEPT", "LEAST", "PART"),
    *("LIGHTNESS", "STEEPNESS", "STEP", "TAKEN", "UNCERTAIN"),
    *("Lot", "Room", "conclude", "decide", "leave", "manned", "meeting", "next_instants"),
]

#: What a lane carries beside `mbody.kernels.step_state`: when this step began, its length, its end,
#: whether that is the last one, whether it is made, how much longer the next one is; its errors,
#: the weakest pivot of its stages and that at its end, its steepness, what failed; whether an
#: instant is kept, when, and at which part of the step; steps and time when its pace was last
#: judged; whether it may have met a singular position, what missing masses have of the energy.
BEGUN, STEP, NOW, CLIPPED, TAKEN, GROWTH, ERROR_3, ERROR_5, LEAST, END, STEEPNESS = range(
    PROGRESS, PROGRESS + 11
)
FAILED, KEPT, AT, PART, JUDGED, SINCE = range(PROGRESS + 11, PROGRESS + 17)
UNCERTAIN, LIGHTNESS = range(PROGRESS + 17, PROGRESS + 19)
CONTROLS = PROGRESS + 19
#: Of so many steps the mean is judged.
MANY_STEPS = 10_000


class Lot(Bundle):
    """The designs, a column each: numbers, first states, slopes there, sizes of the coordinates.

    par (parameters, designs), mass (coordinates + 3, designs), weight (columns, designs); y, slope,
    scale (2·coordinates, designs); near (nodes, designs): distances from singular positions there;
    step, pivot (designs,): first step and weakest pivot; begin
    (2,): the first time, and how many instants are met there.
    """

    par: Rows
    mass: Rows
    weight: Rows
    y: Rows
    slope: Rows
    scale: Rows
    near: Rows
    step: Floats
    pivot: Floats
    begin: Floats


class Room(Bundle):
    """Memory of the lanes.

    state (CONTROLS, lanes); who (lanes + 1,): the design of every lane, −1 of none, and the next
    one; y, last, ys, end, scale (2·coordinates, lanes): the state, that before the step, those of a
    stage and of the end, sizes; K (slopes, 2·coordinates, lanes); F (polynomial, 2·coordinates,
    lanes); page (rows, lanes).
    """

    state: Rows
    who: Ints
    y: Rows
    last: Rows
    ys: Rows
    end: Rows
    scale: Rows
    K: Stacks
    F: Stacks
    page: Rows


@njit
def manned(L, W, lot, room, until, bad):
    """Give lanes that are done the next designs, and every lane its step; whether any has one."""
    S, who, lanes = room.state, room.who, room.who.shape[0] - 1
    fresh, busy = False, False
    for lane in range(lanes):
        if who[lane] >= 0 and S[TIME, lane] >= until:
            who[lane] = -1
        while who[lane] < 0 and who[lanes] < lot.par.shape[1]:
            design = who[lanes]
            who[lanes] += 1
            if bad[design] == 0.0:
                settle_in(L, W, lot, room, lane, design)
                fresh = True
        t, h = S[TIME, lane], S[NEXT, lane]
        S[TAKEN, lane] = 0.0
        if who[lane] >= 0:
            busy = True
            S[TAKEN, lane] = 1.0
            S[CLIPPED, lane] = 1.0 if t + h >= until - 1e-14 * abs(until) else 0.0
            if S[CLIPPED, lane] > 0.5:
                h = until - t
            elif h < 1e-13 * max(abs(t), abs(until)):
                leave(room, lane, bad)
        # a lane without a design stands still
        S[BEGUN, lane], S[STEP, lane] = t, h if S[TAKEN, lane] > 0.5 else 0.0
        S[NOW, lane] = until if S[CLIPPED, lane] > 0.5 else t + S[STEP, lane]
    if fresh:
        st(W.time, 0, ld(S, TIME, wide()), wide())
        signals(L, W, wide(), L.signal_law.shape[0])
    return busy


@njit
def settle_in(L, W, lot, room, lane, design):
    """A design into a lane, at its first state."""
    S, who = room.state, room.who
    put_numbers(W, lot, lane, design)
    for n in range(room.y.shape[0]):
        room.y[n, lane] = lot.y[n, design]
        room.K[0, n, lane] = lot.slope[n, design]
        room.scale[n, lane] = lot.scale[n, design]
    for k in range(L.nodes):
        W.near[k, lane] = lot.near[k, design]
    who[lane] = design
    for n in range(S.shape[0]):
        S[n, lane] = 0.0
    S[TIME, lane] = S[SINCE, lane] = lot.begin[0]
    S[MET, lane] = lot.begin[1]
    S[NEXT, lane] = lot.step[design]
    S[PIVOT, lane] = S[FREEST, lane] = lot.pivot[design]


@inline
def leave(room, lane, bad):
    """Leave the design of a lane to go alone."""
    bad[room.who[lane]] = 1.0
    room.who[lane] = -1
    room.state[TAKEN, lane] = 0.0


@njit
def decide(room, order, bad):
    """Which lanes make their step; whether any does. Refused ones get a shorter one."""
    S, any_taken = room.state, False
    for lane in range(room.who.shape[0] - 1):
        if S[TAKEN, lane] < 0.5:
            continue
        h, e3, e5 = S[STEP, lane], S[ERROR_3, lane], S[ERROR_5, lane]
        if not e5 < 1e300 or S[LEAST, lane] < WEAK * S[FREEST, lane]:
            leave(room, lane, bad)
            continue
        error = 0.0
        if e5 > 0.0:
            error = h * e5 / math.sqrt((e5 + 0.01 * e3) * room.y.shape[0])
        growth = 6.0 if error < 1e-9 else min(6.0, SAFETY * error ** (-1.0 / order))
        S[GROWTH, lane] = max(0.2, growth)
        if error > 1.0:
            S[REJECTED, lane] += 1.0
            S[NEXT, lane] = h * S[GROWTH, lane]
            S[TAKEN, lane] = 0.0
            continue
        any_taken = True
    return any_taken


@njit
def conclude(room, until, patient, stable, bad):
    """The lengths of the next steps of lanes that make theirs; some leave their design instead."""
    S = room.state
    for lane in range(room.who.shape[0] - 1):
        if S[TAKEN, lane] < 0.5:
            continue
        lost = not S[FAILED, lane] < 0.5 or not S[END, lane] >= BEHIND * S[FREEST, lane]
        if lost or S[UNCERTAIN, lane] > 0.0 or S[LIGHTNESS, lane] > LIGHT:
            leave(room, lane, bad)
            continue
        S[PIVOT, lane] = S[END, lane]
        S[FREEST, lane] = max(S[END, lane], S[FREEST, lane])
        S[STEPS, lane] += 1.0
        S[TIME, lane] = S[NOW, lane]
        S[NEXT, lane] = S[STEP, lane] * S[GROWTH, lane]
        left = until - S[NOW, lane]
        if S[CLIPPED, lane] < 0.5:
            held = S[STEEPNESS, lane] > stable
            S[CALM, lane] = 0.0 if held else S[CALM, lane] + 1.0
            if held or S[CALM, lane] >= CALM_STEPS:
                S[STIFF, lane] = S[STIFF, lane] + 1.0 if held else 0.0
        steep = S[STIFF, lane] >= STIFF_STEPS and left > patient * S[NEXT, lane]
        slow = False
        if S[STEPS, lane] - S[JUDGED, lane] >= MANY_STEPS:
            mean = (S[NOW, lane] - S[SINCE, lane]) / MANY_STEPS
            slow = left > patient * mean
            S[JUDGED, lane], S[SINCE, lane] = S[STEPS, lane], S[NOW, lane]
        if steep or slow:
            leave(room, lane, bad)


@njit
def meeting(room, times):
    """Whether an instant that is to be kept lies before the end of a step."""
    S = room.state
    for lane in range(room.who.shape[0] - 1):
        k = int(S[MET, lane])
        if S[TAKEN, lane] > 0.5 and k < times.shape[0] and times[k] < S[NOW, lane]:
            return True
    return False


@njit
def next_instants(room, times):
    """The next instant of every lane that has one in its step; whether any has."""
    S, found = room.state, False
    for lane in range(room.who.shape[0] - 1):
        k = int(S[MET, lane])
        S[KEPT, lane], S[AT, lane], S[PART, lane] = 0.0, S[NOW, lane], 1.0
        if S[TAKEN, lane] > 0.5 and k < times.shape[0] and times[k] <= S[NOW, lane]:
            found = True
            S[KEPT, lane], S[AT, lane] = 1.0, times[k]
            if times[k] < S[NOW, lane]:
                S[PART, lane] = (times[k] - S[BEGUN, lane]) / S[STEP, lane]
    return found
