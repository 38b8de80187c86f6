"""The two bundles that every kernel takes: the layout (what is where) and the workspace (numbers).

Coordinates: body b has (x, y, θ) of its mass centre at 3b, 3b+1, 3b+2; the ground is the last body.
Constraint rows come in nodes of two, numbered in the order of elimination; a row that is not there
is an identity row. Each node has two sides, each a block of 2×3 numbers on three columns. The
columns are those of the slots: a body with many joints is split into several slots, tied by weld
nodes, so that elimination stays cheap; every other body is one slot.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables, array_words
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import aligned, ld, st
from mbody.core.tolerances import ARTIFICIAL_MASS, MASS_LOST, TINY
from mbody.kernels.friction import ARMS

#: Samples of a step by which its branch is judged, both ends included, at most.
SAMPLES = 7
#: Numbers of what is known of all friction pairs together: uniqueness, the part of friction that
#: was reached, a determinant (`mbody.kernels.friction`).
FRICTION_NUMBERS = 3


class Layout(Bundle):
    """Indices of all numbers; made once for a topology, equal for every set of numbers."""

    bodies: int
    slots: int
    nodes: int
    # states of a user's own; numbers that formulas of measured quantities compute on their way
    owns: int
    formula_numbers: int
    # primitives, sorted by kind: physics, body of either side, first parameter and how many, arm of
    # the marker on j, first signal row, node, own law, user's function
    primitive_kind: Ints
    primitive_i: Ints
    primitive_j: Ints
    primitive_par: Ints
    primitive_count: Ints
    primitive_arm: Ints
    primitive_signal: Ints
    primitive_node: Ints
    primitive_law: Ints
    primitive_handle: Ints
    # node where the physics of each is written: its own, or one beyond all nodes of a row that can
    # be on or off; and which primitives these are
    written_node: Ints
    active_set: Ints
    # friction pairs: kind, node whose multipliers press, tangent row among those of the active set,
    # first parameter, signal row of a friction that is given; how their slip signs are known
    # (`mbody.kernels.friction`)
    friction_kind: Ints
    friction_node: Ints
    friction_tangent: Ints
    friction_par: Ints
    friction_signal: Ints
    slip_signs: int
    # those of the rows of the active set which change with time while all bodies rest: stops
    # that move
    moving: Ints
    # nodes: first column of either side; blocks below the diagonal of each; their rows
    node_column: Ints
    # sides of nodes beyond the second, of one row: (node, first column) of each, (sides, 2); their
    # blocks follow all others
    more: Tables
    # sums: of primitive e parts sum_start[e] to sum_start[e + 1]; of each part its physics, both
    # bodies, and the places of their blocks, −1 for the ground, (parts, 5)
    sum_start: Ints
    part: Tables
    node_start: Ints
    block_row: Ints
    # elimination: block that each pair of blocks of a column updates
    update: Ints
    # forming: block += side a · weights of the column · side bᵀ
    form_block: Ints
    form_a: Ints
    form_b: Ints
    form_column: Ints
    form_more: Ints  # whether it adds to what an earlier line formed
    fill: Ints  # blocks that only elimination fills
    # slots: body of each; first slot of each body
    slot_body: Ints
    body_slot: Ints
    # first body of the connected part of each: what joints, couplings and drivers join, the ground
    # apart
    body_part: Ints
    # laws: physics, parameters, fixed data, user's function
    law_kind: Ints
    law_par: Ints
    law_count: Ints
    law_table: Ints
    law_handle: Ints
    # laws of time in the order varying, constant: which law fills which signal row
    signal_law: Ints
    signal_row: Ints
    varying: int
    # formulas of measured quantities: see `mbody.kernels.constraints`, (steps, 4); how many
    # of them give signals of drivers, of every primitive where its steps for Φ begin, those for γ,
    # and the end, (primitives, 3), the first step of loads and auxiliary states, the first of those
    # that measure accelerations and forces, and the signal rows that these give to loads
    formula_step: Tables
    driver_steps: int
    primitive_steps: Tables
    load_steps: int
    force_steps: int
    loop_row: Ints
    # signal row of every input, in the order of the description
    input_row: Ints
    # signal row and node of every driver, in the order of the description, and one where it follows
    # positions
    driver_row: Ints
    driver_node: Ints
    driver_dependent: Ints
    # actions, sorted by kind: physics, bodies, body that it follows, parameters, first signal row,
    # own law, cause
    action_kind: Ints
    action_i: Ints
    action_j: Ints
    action_by: Ints
    action_par: Ints
    action_count: Ints
    action_signal: Ints
    action_law: Ints
    action_handle: Ints
    action_cause: Ints
    # fixed data of laws
    table: Floats


class Work(Bundle):
    """Numbers of one set or of many lanes: arrays of shape (rows, lanes)."""

    par: Rows  # parameters of primitives, laws and actions
    mass: Rows  # (m, m, I) of each body
    weight: Rows  # inverse of the positive weights, on columns; zero for the ground
    share: Rows  # part of its body's force that each slot takes
    pad: Rows  # one for identity rows, two rows a node
    regularization_weight: Rows  # what the proximal term adds, two rows a node, before it is scaled
    size: Rows  # model length, then the length of each body's part, then each body's own
    time: Rows
    q: Rows
    v: Rows
    a: Rows
    turn: Rows  # (cos θ, sin θ) of each body
    signal: Rows  # (f, f′, f″) of each law of time; f of each formula of measured quantities
    formula: Rows  # numbers of the formulas of measured quantities
    own: Rows  # states of a user's own
    auxiliary_rate: Rows  # their rates
    reaction: Rows  # of all primitives, for formulas that measure them
    loop: Rows  # matrix, magnitudes and vectors of algebraic loops (`mbody.kernels.forces`)
    block: Rows  # 2×3 numbers of each side, both sides of each node, then further sides
    phi: Rows
    nu: Rows
    gamma: Rows
    diagonal: Rows  # of the Schur complement before elimination
    cross: Rows  # the number beside the diagonal of each node, before elimination
    pivot: Rows  # (1/d₀, l, 1/d₁) of each node
    schur: Rows  # (a, b, c) of each node, then its blocks
    lower: Rows  # blocks of the factor
    near: Rows  # distances of each node from a singular position, at the samples of a step
    x: Rows  # right-hand side and solution on nodes
    lam: Rows  # multipliers on nodes
    u: Rows  # on columns
    r: Rows  # on columns
    force: Rows  # on coordinates
    scratch: Rows
    # the path behind: position and its two derivatives at the last three places, in turn
    past: Rows
    # how far rows are from depending on each other at the places behind
    # (`mbody.kernels.continuation`)
    monitor: Rows
    # positions to come back to while loops are closed
    guess: Rows
    base: Rows
    # blocks of the position that was factored, while the factor serves at another one; one lane
    factored_block: Floats
    # rows of the active set: whether they are on, what is subtracted from Φ of them
    on: Rows
    anchor: Rows
    # friction pairs: sign of sliding, rate, coefficient of friction, size x of friction; what is
    # known of all (`mbody.kernels.friction`)
    slip_sign: Rows
    rate: Rows
    coefficient: Rows
    slip: Rows
    friction: Rows
    # by what the size of friction follows from multipliers (`mbody.kernels.friction`)
    arm: Rows
    # how many pairs slide in a lane, and their numbers
    sliding: Rows
    # λ by the friction of each pair that slides, (pairs · rows of all nodes); Newton's matrix and
    # vectors; the sizes that are among the loads
    response: Rows
    newton: Rows
    kept_slip: Rows
    # arguments of a user's function, and its results
    user_arguments: Floats
    user_results: Floats

    if TYPE_CHECKING:
        frame: Frame
        memory: np.ndarray

    def __init__(self, frame: Frame, memory: np.ndarray) -> None:
        words = frame.words.copy()
        words[frame.at] += memory.__array_interface__["data"][0]
        self.__dict__["frame"], self.__dict__["memory"] = frame, memory
        self._keep(words)

    def __getattr__(self, name: str) -> np.ndarray:
        # an array is made when it is first read: most never are
        if name not in self.fields:
            raise AttributeError(f"a workspace has no {name!r}")
        view = self.frame.view(name, self.memory)
        self.__dict__[name] = view
        return view

    def copied(self) -> Work:
        """Another workspace of the same numbers."""
        memory = self.frame.blank()
        memory[:] = self.memory
        return Work(self.frame, memory)

    def __reduce__(self) -> tuple[Any, ...]:
        return Work, (self.frame, self.memory)


class Frame:
    """Where everything is in the memory of a workspace, and the table of its arrays: `count`
    rows of the ones, and numbers of those that have no lanes.

    `rows`: Of the memory, which is (rows, lanes).
    `words`, `at`: The table as `Bundle` has it, for memory that begins at zero, and where in it are
      places.
    """

    def __init__(self, count: dict[str, int], lengths: dict[str, int], lanes: int) -> None:
        self.count, self.lengths, self.lanes = count, lengths, lanes
        self.first: dict[str, int] = {}
        # every array begins on a cache line
        step, self.rows = max(1, 8 // lanes), 0
        words: list[int] = []
        at: list[int] = []
        for name in Work.fields:
            shape = (count[name], lanes) if name in count else (lengths[name],)
            self.first[name] = self.rows
            at.append(len(words) + 4)
            words += array_words(8 * lanes * self.rows, shape)
            size = count[name] if name in count else -(-lengths[name] // lanes)
            self.rows += -(-size // step) * step
        self.words, self.at = np.array(words), np.array(at)

    def view(self, name: str, memory: np.ndarray) -> np.ndarray:
        """An array of the workspace."""
        first = self.first[name]
        if name in self.lengths:
            return memory[first:].reshape(-1)[: self.lengths[name]]
        return memory[first : first + self.count[name]]

    def blank(self) -> np.ndarray:
        """Zeroed memory, beginning on a cache line."""
        return aligned(self.rows, self.lanes)


def frame_of(layout: Layout, parameters: int, signals: int, lanes: int) -> Frame:
    """The frame of the workspaces of a system."""
    L = layout
    numbers = L.bodies, L.slots, L.nodes, len(L.block_row), len(L.more), L.owns
    measuring = L.force_steps < len(L.formula_step)
    late = PER_PRIMITIVE * len(L.primitive_node) if measuring else 0, len(L.loop_row)
    shape = (*numbers, L.formula_numbers, len(L.active_set), len(L.friction_kind), *late)
    return _frame(shape, parameters, signals, lanes)


@functools.lru_cache(maxsize=256)
def _frame(shape: tuple[int, ...], parameters: int, signals: int, lanes: int) -> Frame:
    bodies, slots, nodes, blocks, more, owns, formulas, active_set, pairs, reactions, loops = shape
    written = first_beyond(nodes, more) + active_set if active_set else nodes
    coordinates, columns = 3 * (bodies + 1), 3 * (slots + 1)
    rows = {
        "par": parameters,
        "weight": columns,
        "share": slots,
        "pad": 2 * nodes,
        "regularization_weight": 2 * nodes,
        "size": 1 + 2 * bodies,
        "time": 1,
        "turn": 2 * (bodies + 1),
        "signal": 3 * signals,
        "formula": formulas,
        "own": owns,
        "auxiliary_rate": owns,
        "reaction": reactions,
        "loop": loops * (3 * loops + 2),
        # what further sides of rows of the active set give lies beyond all nodes
        "block": max(12 * nodes + 6 * more, 12 * written + (6 * more if active_set else 0)),
        "phi": 2 * written,
        "nu": 2 * written,
        "gamma": 2 * written,
        "cross": nodes,
        "pivot": 3 * nodes,
        "monitor": 4 * nodes,
        "schur": 3 * nodes + 4 * blocks,
        "lower": 4 * blocks,
        "near": SAMPLES * nodes,
        "u": columns,
        "r": columns,
        "scratch": 32,
        "past": 9 * coordinates,
        "friction": FRICTION_NUMBERS,
        "sliding": pairs + 1,
        "response": 2 * nodes * pairs,
        "newton": pairs * (pairs + 3),
        "arm": ARMS * pairs,
    }
    rows |= dict.fromkeys(("diagonal", "x", "lam"), 2 * nodes)
    rows |= dict.fromkeys(("on", "anchor"), active_set)
    rows |= dict.fromkeys(("slip_sign", "rate", "coefficient", "slip", "kept_slip"), pairs)
    lengths = {
        "user_arguments": 17 + parameters,
        "user_results": 18,
        "factored_block": rows["block"],
    }
    count = {n: max(1, rows.get(n, coordinates)) for n in Work.fields if n not in lengths}
    return Frame(count, lengths, lanes)


#: Fields of a workspace that belong to nodes or slots.
OF_NODES = {
    "weight", "share", "pad", "regularization_weight", "block", "phi", "nu", "gamma", "diagonal",
    "cross", "pivot", "schur", "lower", "x", "lam", "u", "r", "monitor", "factored_block",
    "response",
}  # fmt: skip


def first_beyond(nodes: int, more: int) -> int:
    """The first node whose blocks lie beyond those of all nodes and of their further sides."""
    return nodes + -(-more // 2)


def integers(values: Any) -> np.ndarray:
    """Index table as the kernels take it."""
    return np.ascontiguousarray(values, dtype=np.int64).reshape(-1)


# -- Weights of free motion: inverse masses, and what replaces masses that are missing ---------
#
# A massless body moves as its joints prescribe: a small mass serves, corrected by refinement. It is
# a part of the body's own inertia or mass, else of the least of what the body, with those beside it
# that have no mass either, is joined to: of the second greatest of these, the ground the greatest.
# So it is small beside all that it may load, and nothing that it is not joined to has a say in it.
# A body that has mass keeps it, unless it is so little beside the second greatest that no digit of
# what it passes on would be left.


@inline
def effective_mass(L, mass, size, b, w):
    """The greater of mass and inertia of a body, of inertia by its own length."""
    span = size[1 + L.bodies + b, 0]
    return max(mass[3 * b, w], mass[3 * b + 2, w] / (span * span))


@njit
def joined_mass(L, effective, side, seed, light):
    """The second greatest effective mass that a body is joined to, by others that are less than
    `light`; that of the only one, with its sign changed; zero of none. side (bodies, 1) ← one for
    the body and those others.
    """
    bodies, grounded, found = L.bodies, False, True
    for b in range(bodies):
        side[b, 0] = 0.0
    side[seed, 0] = 1.0
    while found:
        found = False
        for e in range(L.primitive_i.shape[0]):
            i, j = L.primitive_i[e], L.primitive_j[e]
            if L.written_node[e] != L.primitive_node[e]:
                continue
            for _ in range(2):
                i, j = j, i
                if i == bodies or side[i, 0] != 1.0:
                    continue
                if j == bodies:
                    grounded = True
                elif side[j, 0] == 0.0:
                    side[j, 0] = 1.0 if effective[j, 0] < light else 2.0
                    found = True
    first, second = math.inf if grounded else 0.0, 0.0
    for b in range(bodies):
        if side[b, 0] == 2.0:
            first, second = max(first, effective[b, 0]), max(second, min(first, effective[b, 0]))
    return second if second > 0.0 or grounded else -first


@njit
def store_least_masses(L, mass, size, w, effective, side, least):
    """least (3·bodies, ·) ← masses and inertias that replace smaller ones in set w; returns whether
    solutions are to be refined. mass (3·bodies + 3, ·), size as W.size; effective, side (bodies, 1)
    are memory.
    """
    top, refined = 0.0, False
    for b in range(L.bodies):
        effective[b, 0] = effective_mass(L, mass, size, b, w)
        top = max(top, effective[b, 0])
        for n in range(3):
            least[3 * b + n, w] = 0.0
    for b in range(L.bodies):
        own, square = effective[b, 0], size[1 + L.bodies + b, 0] ** 2
        if own == 0.0:
            refined = True
            if least[3 * b, w] == 0.0:
                joined = abs(joined_mass(L, effective, side, b, TINY))
                joined = ARTIFICIAL_MASS * (joined if joined > 0.0 else top if top > 0.0 else 1.0)
                for other in range(L.bodies):
                    if side[other, 0] == 1.0:
                        for n in range(3):
                            unit = size[1 + L.bodies + other, 0] ** 2 if n == 2 else 1.0
                            least[3 * other + n, w] = joined * unit
            continue
        joined = 0.0
        if own < ARTIFICIAL_MASS * top:
            joined = max(0.0, joined_mass(L, effective, side, b, own / ARTIFICIAL_MASS))
        for n in range(3):
            given, unit = mass[3 * b + n, w], square if n == 2 else 1.0
            among = max(joined, own if n == 2 or given == 0.0 else 0.0)
            refined = refined or given < ARTIFICIAL_MASS * among * unit
            part = ARTIFICIAL_MASS * own if given == 0.0 else 0.0
            least[3 * b + n, w] = max(part, MASS_LOST * among) * unit
    return refined


@kernel
def least_masses(
    L: Layout, mass: Rows, size: Rows, effective: Rows, side: Rows, least: Rows, refined: Floats
) -> None:
    """Fill least (3·bodies, sets) and refined (sets,), see `store_least_masses`."""
    for w in range(mass.shape[1]):
        found = store_least_masses(L, mass, size, w, effective, side, least)
        refined[w] = 1.0 if found else 0.0


def _replaced(layout: Layout, mass: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Masses and inertias that replace smaller ones, (3·bodies, sets), and whether solutions are to
    be refined, (sets,).
    """
    n, sets = layout.bodies, mass.shape[1]
    own = mass[: 3 * n].reshape(n, 3, sets)
    unit = np.ones((n, 3, 1))
    unit[:, 2, 0] = size[1 + n :, 0] ** 2
    effective = own / unit
    least, refined = np.zeros((3 * n, sets)), np.zeros(sets)
    if (effective < ARTIFICIAL_MASS * effective.max(axis=(0, 1), initial=TINY)).any():
        room = np.empty((2, n, 1))
        least_masses(layout, np.ascontiguousarray(mass), size, room[0], room[1], least, refined)
    return least, refined


def inverse_masses(layout: Layout, mass: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Weights of free motion: (3·slots, sets) for masses (3·bodies + 3, sets); size (·, 1) as
    `Work.size`.
    """
    L, sets = layout, mass.shape[1]
    share = 1.0 / np.bincount(L.slot_body, minlength=L.bodies)[L.slot_body]
    own = mass.reshape(-1, 3, sets)[L.slot_body] * share[:, None, None]
    least = _replaced(layout, mass, size)[0].reshape(-1, 3, sets)[L.slot_body]
    return np.asarray(1.0 / np.maximum(own, least)).reshape(-1, sets)


def lost_masses(layout: Layout, mass: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Which bodies have a mass or an inertia of their own that another replaces: (bodies, sets)."""
    own = mass[: 3 * layout.bodies]
    replaced = (own > 0.0) & (own < _replaced(layout, mass, size)[0])
    return np.asarray(replaced.reshape(-1, 3, mass.shape[1]).any(axis=1))


def artificial_masses(layout: Layout, mass: np.ndarray, size: np.ndarray) -> np.ndarray:
    """In which sets a body has so little mass or inertia that solutions are refined: (sets,)."""
    return np.asarray(_replaced(layout, mass, size)[1] > 0.0)


# -- Record of an instant: motion by coordinate, multipliers and reactions by primitive --------

#: Numbers of one primitive: λ₀, λ₁, then force (x, y) and torque on body j at the marker on j.
PER_PRIMITIVE = 5


@njit
def keep(L, W, w, record):
    """Rows of a record: q, v, a of all bodies, `PER_PRIMITIVE` rows a primitive, what is known of
    all friction pairs where there are any, auxiliary states, inputs.
    """
    n3 = 3 * L.bodies
    for n in range(n3):
        st(record, n, ld(W.q, n, w), w)
        st(record, n3 + n, ld(W.v, n, w), w)
        st(record, 2 * n3 + n, ld(W.a, n, w), w)
    keep_primitives(L, W, w, record, 3 * n3)
    first = 3 * n3 + PER_PRIMITIVE * L.primitive_node.shape[0]
    if L.friction_kind.shape[0] > 0:
        for n in range(FRICTION_NUMBERS):
            st(record, first + n, ld(W.friction, n, w), w)
        first += FRICTION_NUMBERS
    for n in range(L.owns):
        st(record, first + n, ld(W.own, n, w), w)
    for n in range(L.input_row.shape[0]):
        st(record, first + L.owns + n, ld(W.signal, L.input_row[n], w), w)


@njit
def keep_primitives(L, W, w, record, first):
    """Reactions of all primitives, from row `first` on."""
    for e in range(L.primitive_node.shape[0]):
        keep_primitive(L, W, w, e, record, first + PER_PRIMITIVE * e)


@inline
def keep_primitive(L, W, w, e, record, row):
    """Reaction of a primitive: −(block of j)ᵀ λ, moved from the mass centre to the marker on j."""
    k, j, arm = L.primitive_node[e], L.primitive_j[e], L.primitive_arm[e]
    o = 12 * L.written_node[e] + 6
    x, y = ld(W.lam, 2 * k, w), ld(W.lam, 2 * k + 1, w)
    fx = -(ld(W.block, o, w) * x + ld(W.block, o + 3, w) * y)
    fy = -(ld(W.block, o + 1, w) * x + ld(W.block, o + 4, w) * y)
    t = -(ld(W.block, o + 2, w) * x + ld(W.block, o + 5, w) * y)
    c, s = ld(W.turn, 2 * j, w), ld(W.turn, 2 * j + 1, w)
    ax, ay = ld(W.par, arm, w), ld(W.par, arm + 1, w)
    px, py = c * ax - s * ay, s * ax + c * ay
    st(record, row, x, w)
    st(record, row + 1, y, w)
    st(record, row + 2, fx, w)
    st(record, row + 3, fy, w)
    st(record, row + 4, t - (px * fy - py * fx), w)


@njit
def keep_some(L, W, w, rows, record):
    """Only these rows (numbered as in `keep`, ascending), one after the other."""
    n3 = 3 * L.bodies
    pairs = 3 * n3 + PER_PRIMITIVE * L.primitive_node.shape[0]
    owns = pairs + (FRICTION_NUMBERS if L.friction_kind.shape[0] > 0 else 0)
    last = -1
    for n in range(rows.shape[0]):
        row = rows[n]
        if row < n3:
            st(record, n, ld(W.q, row, w), w)
        elif row < 2 * n3:
            st(record, n, ld(W.v, row - n3, w), w)
        elif row < 3 * n3:
            st(record, n, ld(W.a, row - 2 * n3, w), w)
        elif row >= owns + L.owns:
            st(record, n, ld(W.signal, L.input_row[row - owns - L.owns], w), w)
        elif row >= owns:
            st(record, n, ld(W.own, row - owns, w), w)
        elif row >= pairs:
            st(record, n, ld(W.friction, row - pairs, w), w)
        else:
            e = (row - 3 * n3) // PER_PRIMITIVE
            spare = rows.shape[0]
            if e != last:
                keep_primitive(L, W, w, e, record, spare)
            last = e
            st(record, n, ld(record, spare + row - 3 * n3 - PER_PRIMITIVE * e, w), w)
