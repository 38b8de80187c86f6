"""What is watched beside the guards of modes: events of users, and arguments of formulas that jump.

Events are programs of numbers on what is kept, or Python where there is none. They are looked at
where guards are. The looks at a long step are as near to each other as those of the whole motion
are asked to be, so that it is looked at part by part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.callbacks import call_user
from mbody.core.decorators import inline, njit
from mbody.core.tolerances import DIFFERENCE_STEP_FORWARD, EVENT_TOGETHER, MACHINE_EPSILON
from mbody.kernels.layout import PER_PRIMITIVE, keep_some
from mbody.kernels.number_program import NumberProgram, run

#: Intervals between looks at a part of a step.
INTERVALS = 4
#: Numbers of `WatchedEvents.number`: the greatest time between two looks; begin and length of the
#: part of the step that is looked at, as parts of it; by how much later rates are taken. Looks at a
#: part so long or shorter are believed, of all that is watched; and of events.
APART, FIRST_PART, PART_LENGTH, LATER, FINEST, FINEST_OF_EVENTS = range(6)


class WatchedEvents(Bundle):
    """Events, e of them: those of users, then j arguments of formulas that jump.

    `row` (r,): The rows of a record that they read, ascending; `timed` (1,): whether the time, too.
    `record` (r and room for a primitive, 1): These.
    `program`: From these, and the time, to the values of users' events.
    `handle` (1,): The Python function that fills the last slots of the program from the first
      instead; 0 where the program does, −1 where Python has failed.
    `argument` (j,): The places of the arguments among the numbers of formulas.
    `greatest` (e,): Their greatest values by size.
    `direction` (e,): 1 where an event rises through zero only, −1 where it falls, 0 either way.
    `stops` (e,): Whether the motion ends there.
    `rated` (e,): Whether it is made of positions, velocities and the time alone.
    `missed` (e,): Where it varies faster than it was looked at, how far apart looks were; else 0.
    `number` (6,): See above.
    `saved` (slots,): The slots of a state before a step.
    """

    row: Ints
    timed: Ints
    record: Rows
    handle: Ints
    argument: Ints
    greatest: Floats
    direction: Ints
    stops: Ints
    rated: Ints
    missed: Floats
    number: Floats
    saved: Floats
    program: NumberProgram


def python_program(inputs: int, events: int) -> NumberProgram:
    """No operations: inputs, and events that Python finds from them."""
    none = np.zeros(0, dtype=np.int64)
    return NumberProgram(
        slots=np.zeros(inputs + events), lowest=none, strict=none,
        operations=none.reshape(0, 4), targets=inputs + np.arange(events),
    )  # fmt: skip


def watched_events(
    program: NumberProgram,
    row: np.ndarray,
    timed: bool,
    rated: np.ndarray,
    slots: int,
    argument: Sequence[int] = (),
) -> WatchedEvents:
    """Events by their program, and arguments of formulas that jump, of which no rates are known."""
    events, whole = len(program.targets) + len(argument), np.int64
    found = WatchedEvents(
        row=np.asarray(row, whole), timed=np.array([timed], whole),
        record=np.zeros((len(row) + PER_PRIMITIVE, 1)), handle=np.zeros(1, whole),
        argument=np.asarray(argument, whole), greatest=np.zeros(events),
        direction=np.zeros(events, whole), stops=np.zeros(events, whole),
        rated=np.zeros(events, whole), missed=np.zeros(events), number=np.zeros(6),
        saved=np.zeros(slots), program=program,
    )  # fmt: skip
    found.rated[: len(rated)] = rated
    return found


@inline
def events_of(E):
    """How many events there are."""
    return E.direction.shape[0]


@njit
def evaluate_events(E):
    """Users' events by the first slots of the program; not a number where Python fails."""
    slots, inputs = E.program.slots, E.row.shape[0] + E.timed[0]
    if E.handle[0] == 0:
        run(E.program)
    elif E.handle[0] < 0 or call_user(E.handle[0], slots[:inputs], slots[inputs:]) != 0:
        E.handle[0] = -1
        for n in range(inputs, slots.shape[0]):
            slots[n] = math.nan


@njit
def run_later(L, W, E, later):
    """Users' events so much later along the motion; at the present instant with 0."""
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
    evaluate_events(E)


@njit
def find_events(L, W, E, value, rate):
    """value, rate (e,) ← those of all events at the state that was just evaluated; rates are not a
    number if unknown.
    """
    wanted, slots, targets = False, E.program.slots, E.program.targets
    count = targets.shape[0]
    for e in range(events_of(E)):
        wanted = wanted or E.rated[e] == 1
        rate[e] = np.nan
    if count > 0:
        keep_some(L, W, 0.0, E.row, E.record)
    if wanted:
        later = E.number[LATER]
        run_later(L, W, E, later)
        for e in range(count):
            rate[e] = slots[targets[e]]
        run_later(L, W, E, -later)
        for e in range(count):
            rate[e] = (rate[e] - slots[targets[e]]) / (2.0 * later)
            rate[e] = rate[e] if E.rated[e] else np.nan
    if count > 0:
        run_later(L, W, E, 0.0)
    for e in range(events_of(E)):
        place = E.argument[e - count] if e >= count else 0
        value[e] = slots[targets[e]] if e < count else W.formula[place, 0]
        E.greatest[e] = max(E.greatest[e], abs(value[e]))


@njit
def find_rounding(L, W, E, scale, value, rounding):
    """rounding (e,) ← what rounding of positions and velocities is in the events, whose values at
    the state that was looked at last are given: by a difference, all of them moved by the same part
    of their `scale`, to and fro. None is known of arguments.
    """
    slots, targets = E.program.slots, E.program.targets
    for n in range(E.row.shape[0]):
        row, moved = E.row[n], 0.0
        if row < 6 * L.bodies:
            moved = DIFFERENCE_STEP_FORWARD * scale[row]
        slots[n] = E.record[n, 0] + (moved if n % 2 == 0 else -moved)
    if E.timed[0]:
        slots[E.row.shape[0]] = W.time[0, 0]
    if targets.shape[0] > 0:
        evaluate_events(E)
    for e in range(events_of(E)):
        change = abs(slots[targets[e]] - value[e]) if e < targets.shape[0] else 0.0
        rounding[e] = change * (MACHINE_EPSILON / DIFFERENCE_STEP_FORWARD)


@inline
def together(E):
    """Within this part of what is looked at zeros count as being at one instant."""
    return EVENT_TOGETHER / E.number[PART_LENGTH]
