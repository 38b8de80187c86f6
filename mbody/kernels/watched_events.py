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
from mbody.core.tolerances import (
    DIFFERENCE_STEP_FORWARD,
    EVENT_TOGETHER,
    GUARD_ROUNDING_FORCE,
    GUARD_ROUNDING_GAP,
    MACHINE_EPSILON,
)
from mbody.kernels.constraints import least_motion
from mbody.kernels.forces import forces
from mbody.kernels.layout import PER_PRIMITIVE, keep_some
from mbody.kernels.loop_closure import constrained_accelerations
from mbody.kernels.number_program import NumberProgram, run

#: Intervals between looks at a part of a step.
INTERVALS = 4
#: Numbers of `WatchedEvents.number`: the greatest time between two looks; begin and length of the
#: part of the step that is looked at, as parts of it; by how much later rates are taken. Looks at a
#: part so long or shorter are believed, of all that is watched; and of events.
APART, FIRST_PART, PART_LENGTH, LATER, FINEST, FINEST_OF_EVENTS = range(6)
#: Rows of `WatchedEvents.side`: as of the present state, of the part of a step that is looked at,
#: and of its end.
NOW, PART, PART_END = range(3)


class WatchedEvents(Bundle):
    """Events, e of them: those of users, then j arguments of formulas that jump.

    `row` (r,): The rows of a record that they read, ascending; `timed` (1,): whether the time, too.
    `record`, `beside` (r and room for a primitive, 1): These; and at a position beside.
    `rounding`, `before` (r,): What is rounding of them; workspace.
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
    `last` (2, e): What is rounding of it at the present state, and at the end of what was tried.
    `side` (3, e): 1 or −1, on which side of zero it was last by more than rounding, else 0.
    `saved` (slots,): The slots of a state before a step.
    """

    row: Ints
    timed: Ints
    record: Rows
    beside: Rows
    rounding: Floats
    before: Floats
    handle: Ints
    argument: Ints
    greatest: Floats
    direction: Ints
    stops: Ints
    rated: Ints
    missed: Floats
    number: Floats
    last: Rows
    side: Rows
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
        record=np.zeros((len(row) + PER_PRIMITIVE, 1)), rounding=np.zeros(len(row)),
        beside=np.zeros((len(row) + PER_PRIMITIVE, 1)), before=np.zeros(len(row)),
        handle=np.zeros(1, whole), argument=np.asarray(argument, whole),
        greatest=np.zeros(events), direction=np.zeros(events, whole),
        stops=np.zeros(events, whole), rated=np.zeros(events, whole), missed=np.zeros(events),
        number=np.zeros(6), last=np.zeros((2, events)), side=np.zeros((3, events)),
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
def find_force_sizes(L, W):
    """W.r ← the sizes of what the equations of motion sum on every column, each load, inertia and
    reaction by itself, in both directions of a body alike, at the state that was just evaluated;
    W.force is workspace.
    """
    lam, block, size = W.lam, W.block, W.r
    for n in range(size.shape[0]):
        size[n, 0] = 0.0
    causes = 0
    for e in range(L.action_cause.shape[0]):
        causes = max(causes, L.action_cause[e] + 1)
    for cause in range(-1, causes):
        if cause >= 0:
            forces(L, W, 0.0, cause)
        for s in range(L.slots):
            o, share = 3 * L.slot_body[s], abs(W.share[s, 0])
            for n in range(3):
                force = W.force[o + n, 0] if cause >= 0 else W.mass[o + n, 0] * W.a[o + n, 0]
                size[3 * s + n, 0] += share * abs(force)
    for k in range(L.nodes):
        x, y = lam[2 * k, 0], lam[2 * k + 1, 0]
        for n in range(6):
            column, o = L.node_column[2 * k + n // 3] + n % 3, 12 * k + n + 3 * (n // 3)
            size[column, 0] += abs(block[o, 0] * x) + abs(block[o + 3, 0] * y)
    for m in range(L.more.shape[0]):
        for n in range(3):
            force = block[12 * L.nodes + 6 * m + n, 0] * lam[2 * L.more[m, 0], 0]
            size[L.more[m, 1] + n, 0] += abs(force)
    for s in range(L.slots):
        size[3 * s, 0] = size[3 * s + 1, 0] = size[3 * s, 0] + size[3 * s + 1, 0]


@njit
def row_rounding(L, W, row):
    """What is rounding of a row of a record that is an acceleration or a reaction, as a part of
    which counts, by the sizes in W.r: M⁻¹ of these, and what that is of the multipliers of a row
    by itself.
    """
    n3 = 3 * L.bodies
    first = 3 * n3
    if row < first:
        column = 3 * L.body_slot[(row - 2 * n3) // 3] + row % 3
        return W.weight[column, 0] * W.r[column, 0]
    e, n = (row - first) // PER_PRIMITIVE, (row - first) % PER_PRIMITIVE
    k, arm = L.primitive_node[e], L.primitive_arm[e]
    x, y = multiplier_rounding(L, W, k, 0), multiplier_rounding(L, W, k, 1)
    if n < 2:
        return x if n == 0 else y
    o = 12 * L.written_node[e] + 6
    fx = abs(W.block[o, 0]) * x + abs(W.block[o + 3, 0]) * y
    fy = abs(W.block[o + 1, 0]) * x + abs(W.block[o + 4, 0]) * y
    if n < 4:
        return fx if n == 2 else fy
    ax, ay = abs(W.par[arm, 0]), abs(W.par[arm + 1, 0])
    return abs(W.block[o + 2, 0]) * x + abs(W.block[o + 5, 0]) * y + (ax + ay) * (fx + fy)


@njit
def multiplier_rounding(L, W, k, r):
    """Of row r of node k: Σ |g| w s over Σ g² w, g being what it has on the columns."""
    top, bottom = 0.0, 0.0
    for n in range(6):
        column = L.node_column[2 * k + n // 3] + n % 3
        g = abs(W.block[12 * k + n + 3 * (n // 3) + 3 * r, 0])
        top += g * W.weight[column, 0] * W.r[column, 0]
        bottom += g * g * W.weight[column, 0]
    return top / bottom if bottom > 0.0 else 0.0


@njit
def add_rate_rounding(L, W, E, sign):
    """E.rounding ← that of velocities and what rounding of the rates of rows makes of them, the
    sums |g| |v| of node k having the sign signᵏ, by the factor of the rows: what two near contact
    points hold turns by the rounding of its speed over their distance.
    """
    n3, turns = 3 * L.bodies, 1.0
    for k in range(L.nodes):
        W.x[2 * k, 0] = W.x[2 * k + 1, 0] = 0.0
        for n in range(6):
            column, o = L.node_column[2 * k + n // 3] + n % 3, 12 * k + n + 3 * (n // 3)
            if column < 3 * L.slots:
                rate = turns * MACHINE_EPSILON * abs(W.v[3 * L.slot_body[column // 3] + n % 3, 0])
                W.x[2 * k, 0] += rate * abs(W.block[o, 0])
                W.x[2 * k + 1, 0] += rate * abs(W.block[o + 3, 0])
        turns *= sign
    least_motion(L, W, 0.0, W.x, False)
    for n in range(E.row.shape[0]):
        k = E.row[n] - n3
        if 0 <= k < n3:
            E.rounding[n] += abs(W.u[3 * L.body_slot[k // 3] + k % 3, 0])


@njit
def find_row_rounding(L, W, S, E, refinements, h):
    """E.rounding ← what is rounding of the rows that events read, at the state that was just
    evaluated: of positions and velocities by their scales, of these by the rates of rows, too; of
    accelerations and reactions by the sizes that are summed in them, and by what rounding of
    positions makes of them; of velocities what that is in a step of length h. The workspace is left
    at a position beside.
    """
    n3, wanted = 3 * L.bodies, False
    last = 3 * n3 + PER_PRIMITIVE * L.primitive_node.shape[0]
    for n in range(E.row.shape[0]):
        row = E.row[n]
        E.rounding[n] = MACHINE_EPSILON * S.scale[row] if row < 2 * n3 else 0.0
        wanted = wanted or n3 <= row < last
    if not wanted:
        return
    for sign in (1.0, -1.0):
        add_rate_rounding(L, W, E, sign)
    find_force_sizes(L, W)
    for n in range(E.row.shape[0]):
        row = E.row[n]
        if n3 <= row < last:
            length, of = (h, row + n3) if row < 2 * n3 else (1.0, row)
            E.rounding[n] += length * GUARD_ROUNDING_FORCE * row_rounding(L, W, of)
            E.before[n] = W.a[of - 2 * n3, 0] if of < 3 * n3 else E.record[n, 0]
    for n in range(n3):
        moved = DIFFERENCE_STEP_FORWARD * S.scale[n]
        W.q[n, 0] += moved if n % 2 == 0 else -moved
    constrained_accelerations(L, W, 0.0, S.regularization, refinements, False)
    keep_some(L, W, 0.0, E.row, E.beside)
    part = GUARD_ROUNDING_GAP / DIFFERENCE_STEP_FORWARD
    for n in range(E.row.shape[0]):
        row = E.row[n]
        if n3 <= row < last:
            length, of = (h, row + n3) if row < 2 * n3 else (1.0, row)
            there = W.a[of - 2 * n3, 0] if of < 3 * n3 else E.beside[n, 0]
            E.rounding[n] += length * part * abs(there - E.before[n])


@njit
def find_rounding(L, W, E, value, rounding):
    """rounding (e,) ← what rounding of the rows that they read is in the events, whose values at
    the state that was looked at last are given, by differences: row by row, or of all together
    where Python has to find them. None is known of arguments.
    """
    slots, targets, rows = E.program.slots, E.program.targets, E.row.shape[0]
    part, count = DIFFERENCE_STEP_FORWARD / MACHINE_EPSILON, targets.shape[0]
    for e in range(events_of(E)):
        rounding[e] = 0.0
    for n in range(rows):
        slots[n] = E.record[n, 0]
    if E.timed[0]:
        slots[rows] = W.time[0, 0]
    for n in range(rows if count > 0 else 0):
        if E.rounding[n] == 0.0 and E.handle[0] == 0:
            continue
        slots[n] += part * E.rounding[n] * (1.0 if n % 2 == 0 else -1.0)
        if E.handle[0] != 0 and n < rows - 1:
            continue
        evaluate_events(E)
        for e in range(count):
            rounding[e] += abs(slots[targets[e]] - value[e]) / part
        slots[n] = E.record[n, 0]


@inline
def together(E):
    """Within this part of what is looked at zeros count as being at one instant."""
    return EVENT_TOGETHER / E.number[PART_LENGTH]
