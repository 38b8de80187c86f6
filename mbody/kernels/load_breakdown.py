"""Breakdown by cause: what each load is, and the multipliers that it would have alone.

Φ_qᵀ λ = f − M a is linear in inertia and loads: λ is the sum of what −M a and each load would have
alone, each one solve with the factor of the instant. Friction is one more load: as it is in the
whole, for it would be another one alone.
"""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Floats, Grids, Rows, Stacks
from mbody.core.decorators import inline, kernel
from mbody.core.lanes import ld, st
from mbody.kernels.constraints import rows, turns
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import add_row, tangent
from mbody.kernels.layout import Layout, Work
from mbody.kernels.measured_formulas import measured_formulas, own_numbers
from mbody.kernels.output import keep_primitives
from mbody.kernels.position_velocity import balancing_multipliers, clear
from mbody.kernels.schur_ldl import VANISHED, factor

__all__ = ["NO_FRICTION", "breakdown", "each_load"]

#: Of a breakdown that leaves out friction.
NO_FRICTION = np.zeros((0, 0))


@kernel
def breakdown(
    L: Layout,
    W: Work,
    regularization: float,
    motion: Rows,
    t: Floats,
    causes: int,
    sliding: Rows,
    output: Grids,
) -> None:
    """Fill output (instants, causes + 1, PER_PRIMITIVE·primitives, 1): inertia, then every load,
    then friction.

    motion (instants, 9·bodies + owns + inputs): q, v, a of each instant, and own states
    and inputs unless these are in W; t (instants,); sliding (instants, pairs): multipliers of the
    tangent rows of rough pairs, of no instant where friction is not wanted.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    n3 = 3 * L.bodies
    for k in range(t.shape[0]):
        at_instant(L, W, w, motion, t, k)
        rows(L, W, w, True, None)
        factor(L, W, w, regularization, VANISHED)
        for cause in range(-1, causes):
            for n in range(n3):
                st(W.a, n, motion[k, 2 * n3 + n] if cause < 0 else 0.0, w)
            if cause < 0:
                clear(W.force, w)
            else:
                forces(L, W, w, cause)
            balancing_multipliers(L, W, w)
            keep_primitives(L, W, w, output[k, cause + 1], 0)
        if sliding.shape[0] > 0:
            alone(L, W, w, sliding[k])
            keep_primitives(L, W, w, output[k, causes + 1], 0)


@inline
def alone(L, W, w, sliding):
    """Multipliers by friction alone, those of the tangent rows given."""
    clear(W.force, w)
    for n in range(3 * L.bodies):
        st(W.a, n, 0.0, w)
    for f in range(L.friction_kind.shape[0]):
        m, i, j = tangent(L, W, w, f)
        add_row(W, w, m, i, j, sliding[f])
    balancing_multipliers(L, W, w)
    for f in range(L.friction_kind.shape[0]):
        node = 2 * L.primitive_node[L.switched[L.friction_tangent[f]]]
        st(W.lam, node, sliding[f] + 0.0 * ld(W.size, 0, w), w)


@kernel
def each_load(L: Layout, W: Work, motion: Rows, t: Floats, output: Stacks) -> None:
    """Fill output (instants, loads, 3·bodies): each load alone on the coordinates.

    motion and t as of `breakdown`.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(t.shape[0]):
        at_instant(L, W, w, motion, t, k)
        for cause in range(output.shape[1]):
            forces(L, W, w, cause)
            for n in range(3 * L.bodies):
                output[k, cause, n] = W.force[n, 0]


@inline
def at_instant(L, W, w, motion, t, k):
    """Time, signals, positions, rates, own states and formulas of instant k."""
    W.time[0, 0] = t[k]
    n3 = 3 * L.bodies
    # before the laws, which drivers of own states follow, and after: inputs may have been set
    own_numbers(L, W, motion[k], 3 * n3)
    signals(L, W, w, L.varying)
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = motion[k, n], motion[k, n3 + n]
    own_numbers(L, W, motion[k], 3 * n3)
    turns(L, W, w)
    measured_formulas(L, W, w)
