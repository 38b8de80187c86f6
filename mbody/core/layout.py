"""The two tuples that every kernel takes: the layout (what is where) and the workspace (numbers).

Coordinates: body b has (x, y, θ) of its mass centre at 3b, 3b+1, 3b+2; the ground is the last body.
Constraint rows come in nodes of two, numbered in the order of elimination; a row that is not there
is an identity row. Each node has two sides, each a block of 2×3 numbers on three columns. The
columns are those of the slots: a body with many joints is split into several slots, tied by weld
nodes, so that elimination stays cheap; every other body is one slot.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from mbody._lanes import aligned

__all__ = ["Layout", "Work", "blank", "integers", "inverse_masses", "stand_ins", "workspace"]

Ints = Any  # int64 arrays, one-dimensional


class Layout(NamedTuple):
    """What is where; made once for a topology, the same for every set of numbers."""

    bodies: int
    slots: int
    nodes: int
    # atoms, sorted by kind: physics, body of either side, first parameter and how many, arm of
    # the marker on j, first signal row, node, own law, user's function
    atom_kind: Ints
    atom_i: Ints
    atom_j: Ints
    atom_par: Ints
    atom_count: Ints
    atom_arm: Ints
    atom_signal: Ints
    atom_node: Ints
    atom_law: Ints
    atom_handle: Ints
    # nodes: first column of either side; blocks below the diagonal of each; their rows
    node_column: Ints
    # sides of nodes beyond the second, of one row: (node, first column) of each, (sides, 2); their
    # blocks follow all others
    more: Any
    # sums: of atom e parts sum_start[e] to sum_start[e + 1]; of each part its physics, both bodies,
    # and the places of their blocks, −1 for the ground, (parts, 5)
    sum_start: Ints
    part: Any
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
    # signal row and node of every driver, in the order of the description
    driver_row: Ints
    driver_node: Ints
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
    table: Any


class Work(NamedTuple):
    """Numbers of one set or of many lanes: arrays of shape (rows, lanes)."""

    par: Any  # parameters of atoms, laws and actions
    mass: Any  # (m, m, I) of each body
    weight: Any  # inverse of the positive weights, on columns; zero for the ground
    share: Any  # part of its body's force that each slot takes
    pad: Any  # one for identity rows, two rows a node
    soft: Any  # what the proximal term adds, two rows a node, before it is scaled
    size: Any  # model length
    time: Any
    q: Any
    v: Any
    a: Any
    turn: Any  # (cos θ, sin θ) of each body
    signal: Any  # (f, f′, f″) of each law of time
    block: Any  # 2×3 numbers of each side, both sides of each node, then further sides
    phi: Any
    nu: Any
    gamma: Any
    diagonal: Any  # of the Schur complement before elimination
    pivot: Any  # (1/d₀, l, 1/d₁) of each node
    schur: Any  # (a, b, c) of each node, then its blocks
    lower: Any  # blocks of the factor
    x: Any  # right-hand side and solution on nodes
    lam: Any  # multipliers on nodes
    u: Any  # on columns
    r: Any  # on columns
    force: Any  # on coordinates
    scratch: Any
    # the path behind: position and its two derivatives at the last three places, in turn
    past: Any
    # positions to come back to while loops are closed
    guess: Any
    base: Any
    # what a user's function is asked and tells: one-dimensional
    asked: Any
    told: Any


def blank(layout: Layout, parameters: int, signals: int, lanes: int) -> np.ndarray:
    """Zeroed memory of a workspace, (rows, lanes), beginning on a cache line."""
    return aligned(_places(*_shape(layout), parameters, signals, lanes)[1][-1], lanes)


def workspace(
    layout: Layout,
    parameters: int,
    signals: int,
    lanes: int,
    memory: np.ndarray,
    *,
    copy: bool = True,
) -> Work:
    """The arrays of a workspace in such memory, or in a copy of it."""
    sizes, starts = _places(*_shape(layout), parameters, signals, lanes)
    if copy:
        fresh = aligned(len(memory), lanes)
        fresh[:] = memory
        memory = fresh
    arrays = [memory[first : first + size] for first, size in zip(starts, sizes, strict=False)]
    return Work._make([*arrays, np.zeros(17 + parameters), np.zeros(18)])


def _shape(layout: Layout) -> tuple[int, int, int, int, int]:
    more = len(layout.more)
    return layout.bodies, layout.slots, layout.nodes, len(layout.block_row), more


@functools.lru_cache(maxsize=256)
def _places(
    bodies: int,
    slots: int,
    nodes: int,
    blocks: int,
    more: int,
    parameters: int,
    signals: int,
    lanes: int,
) -> tuple[list[int], list[int]]:
    """Rows of every array of a workspace, and where each begins in the common block."""
    coordinates, columns = 3 * (bodies + 1), 3 * (slots + 1)
    rows = {
        "par": parameters,
        "weight": columns,
        "share": slots,
        "pad": 2 * nodes,
        "soft": 2 * nodes,
        "size": 1,
        "time": 1,
        "turn": 2 * (bodies + 1),
        "signal": 3 * signals,
        "block": 12 * nodes + 6 * more,
        "pivot": 3 * nodes,
        "schur": 3 * nodes + 4 * blocks,
        "lower": 4 * blocks,
        "u": columns,
        "r": columns,
        "scratch": 32,
        "past": 9 * coordinates,
    }
    rows |= dict.fromkeys(("phi", "nu", "gamma", "diagonal", "x", "lam"), 2 * nodes)
    sizes = [max(1, rows.get(name, coordinates)) for name in Work._fields[:-2]]
    step = max(1, 8 // lanes)
    starts = np.cumsum([0] + [-(-size // step) * step for size in sizes])
    return sizes, starts.tolist()


def integers(values: Any) -> np.ndarray:
    """Index table as the kernels take it."""
    return np.ascontiguousarray(values, dtype=np.int64).reshape(-1)


def inverse_masses(layout: Layout, mass: np.ndarray, length: float) -> np.ndarray:
    """Weights of free motion: (3·slots, sets) for masses (3·bodies + 3, sets).

    A massless body moves as its joints tell it: a small mass serves, corrected later.
    """
    L = layout
    share = 1.0 / np.bincount(L.slot_body, minlength=L.bodies)[L.slot_body]
    own = mass.reshape(-1, 3, mass.shape[1])[L.slot_body] * share[:, None, None]
    return np.asarray(1.0 / np.maximum(own, _least(mass, length))).reshape(-1, mass.shape[1])


def stand_ins(layout: Layout, mass: np.ndarray, length: float) -> np.ndarray:
    """In which sets a body has so little mass or inertia that another stands in for it: (sets,)."""
    own = mass[: 3 * layout.bodies].reshape(-1, 3, mass.shape[1])
    return np.asarray((own < _least(mass, length)).any(axis=(0, 1)))


def _least(mass: np.ndarray, length: float) -> np.ndarray:
    """What stands in for less mass and inertia than that, in every set: (3, sets)."""
    unit = np.array([1.0, 1.0, length**2])[:, None]
    own = mass.reshape(-1, 3, mass.shape[1]) / unit
    return np.asarray(1e-7 * own.max(axis=(0, 1), initial=1e-300) * unit)
