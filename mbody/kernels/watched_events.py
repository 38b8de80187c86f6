"""Events of users within a step: what is to be zero, by programs of numbers on what is kept.

They are looked at where guards are. The looks at a long step are as near to each other as those of
the whole motion are asked to be, so that it is looked at part by part.
"""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import inline, njit
from mbody.core.tolerances import DIFFERENCE_STEP_FORWARD, EVENT_TOGETHER, MACHINE_EPSILON
from mbody.kernels.layout import PER_PRIMITIVE, keep_some
from mbody.kernels.number_program import NumberProgram, run

#: Intervals between looks at a part of a step.
INTERVALS = 4
#: Numbers of `WatchedEvents.number`: the greatest time between two looks; begin and length of the
#: part of the step that is looked at, as parts of it; by how much later rates are taken.
APART, FIRST_PART, PART_LENGTH, LATER = range(4)


class WatchedEvents(Bundle):
    """Events, e of them.

    `row` (r,): The rows of a record that they read, ascending; `timed` (1,): whether the time, too.
    `record` (r and room for a primitive, 1): These.
    `program`: From these, and the time, to the values.
    `direction` (e,): 1 where an event rises through zero only, −1 where it falls, 0 either way.
    `stops` (e,): Whether the motion ends there.
    `rated` (e,): Whether it is made of positions, velocities and the time alone.
    `seen` (e,): Up to this part of the step its zeros are known.
    `number` (4,): See above.
    `saved` (slots,): The slots of a state before a step.
    """

    row: Ints
    timed: Ints
    record: Rows
    direction: Ints
    stops: Ints
    rated: Ints
    seen: Floats
    number: Floats
    saved: Floats
    program: NumberProgram


def no_program() -> NumberProgram:
    """A program without inputs and targets."""
    none = np.zeros(0, dtype=np.int64)
    return NumberProgram(
        slots=none, lowest=none, strict=none, operations=none.reshape(0, 4), targets=none
    )


def watched_events(
    program: NumberProgram, row: np.ndarray, timed: bool, rated: np.ndarray, slots: int
) -> WatchedEvents:
    """Events by their program."""
    events, whole = len(program.targets), np.int64
    return WatchedEvents(
        row=np.asarray(row, whole), timed=np.array([timed], whole),
        record=np.zeros((len(row) + PER_PRIMITIVE, 1)), direction=np.zeros(events, whole),
        stops=np.zeros(events, whole), rated=np.asarray(rated, whole),
        seen=np.full(events, -1.0), number=np.zeros(4), saved=np.zeros(slots), program=program,
    )  # fmt: skip


@inline
def events_of(E):
    """How many events there are."""
    return E.direction.shape[0]


@njit
def run_later(L, W, E, later):
    """The program of all events, so much later along the motion; at the present instant with 0."""
    slots, n3, rows = E.program.slots, 3 * L.bodies, E.row.shape[0]
    for n in range(rows):
        row = E.row[n]
        slots[n] = E.record[n, 0]
        if row < n3:
            slots[n] += later * (W.v[row, 0] + 0.5 * later * W.a[row, 0])
        elif row < 2 * n3:
            slots[n] += later * W.a[row - n3, 0]
    if E.timed[0]:
        slots[rows] = W.time[0, 0] + later
    run(E.program)


@njit
def find_events(L, W, E, value, rate):
    """value, rate (e,) ← those of all events at the state that was just evaluated; rates are not a
    number if unknown.
    """
    count, wanted, slots, targets = events_of(E), False, E.program.slots, E.program.targets
    keep_some(L, W, 0.0, E.row, E.record)
    for e in range(count):
        wanted = wanted or E.rated[e] == 1
        rate[e] = np.nan
    if wanted:
        later = E.number[LATER]
        run_later(L, W, E, later)
        for e in range(count):
            rate[e] = slots[targets[e]]
        run_later(L, W, E, -later)
        for e in range(count):
            rate[e] = (rate[e] - slots[targets[e]]) / (2.0 * later)
            rate[e] = rate[e] if E.rated[e] else np.nan
    run_later(L, W, E, 0.0)
    for e in range(count):
        value[e] = slots[targets[e]]


@njit
def find_rounding(L, W, E, scale, value, rounding):
    """rounding (e,) ← what rounding of positions and velocities is in the events, whose values at
    the state that was looked at last are given: by a difference, all of them moved by the same part
    of their `scale`, to and fro.
    """
    slots, targets = E.program.slots, E.program.targets
    for n in range(E.row.shape[0]):
        row, moved = E.row[n], 0.0
        if row < 6 * L.bodies:
            moved = DIFFERENCE_STEP_FORWARD * scale[row]
        slots[n] = E.record[n, 0] + (moved if n % 2 == 0 else -moved)
    if E.timed[0]:
        slots[E.row.shape[0]] = W.time[0, 0]
    run(E.program)
    for e in range(events_of(E)):
        change = abs(slots[targets[e]] - value[e])
        rounding[e] = change * (MACHINE_EPSILON / DIFFERENCE_STEP_FORWARD)


@inline
def is_new(E, e, x):
    """Whether a zero of event e at the part x of what is looked at was not known."""
    return E.number[FIRST_PART] + x * E.number[PART_LENGTH] > E.seen[e]


@inline
def together(E):
    """Within this part of what is looked at zeros count as being at one instant."""
    return EVENT_TOGETHER / E.number[PART_LENGTH]


@njit
def forget_seen(E):
    """Another step: no zeros are known."""
    for e in range(events_of(E)):
        E.seen[e] = -1.0
