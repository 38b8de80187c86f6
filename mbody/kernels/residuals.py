"""Residuals of finished instants, by routes that the solution did not take."""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.core.decorators import kernel, njit
from mbody.kernels.constraints import further_block, rows, turns
from mbody.kernels.forces import forces, signals
from mbody.kernels.layout import Layout, Work
from mbody.kernels.measured_formulas import own_numbers
from mbody.kernels.position_velocity import clear
from mbody.kernels.schur_ldl import apply_gt

__all__ = ["CONSTRAINT", "FLOW", "LEFT", "POWER", "RESIDUALS", "TERM", "Finished", "residuals_of"]

#: Columns of the output: greatest |Φ| (model lengths, radians); greatest part of f − M a − Gᵀλ and
#: greatest term of it (forces, torques by the model length); power of loads, inertia and drivers,
#: and the sum of their magnitudes. And how many they are.
CONSTRAINT, LEFT, TERM, POWER, FLOW = range(5)
RESIDUALS = 5


class Finished(Bundle):
    """Stored instants."""

    # (instants, 9·bodies + owns + inputs): q, v, a; own states and inputs unless these are in W
    motion: Rows
    t: Floats  # (instants,)
    lam: Rows  # (instants, 2·primitives): multipliers
    driven: Ints  # primitives of the drivers
    given: Stacks  # (instants, drivers, 3): values and rates of the drivers, unless by law
    by_law: int  # whether the laws of the drivers give these
    at_rest: int  # whether rates are zero (statics)


@njit
def carry_row(L, W, e, size):
    """Add size · gᵀ of primitive e, as its physics gave it, to W.r; returns its power."""
    o, power = 12 * L.written_node[e], 0.0
    for side in range(2):
        b = L.primitive_i[e] if side == 0 else L.primitive_j[e]
        for n in range(3):
            part = size * W.block[o + 6 * side + n, 0] if size != 0.0 else 0.0
            W.r[3 * b + n, 0] += part
            power += part * W.v[3 * b + n, 0]
    k = L.primitive_node[e]
    for side in range(L.more.shape[0]):
        if L.more[side, 0] == k and size != 0.0:
            b, own = L.slot_body[L.more[side, 1] // 3], further_block(L, side)
            for n in range(3):
                part = size * W.block[own + n, 0]
                W.r[3 * b + n, 0] += part
                power += part * W.v[3 * b + n, 0]
    return power


@kernel
def residuals_of(L: Layout, W: Work, found: Finished, output: Rows) -> None:
    """Fill output (instants, RESIDUALS) from stored instants.

    Virtual power, with the drivers' efforts −λ: Σ (f − M a)·v − Σ λ_d ν_d = 0.
    """
    motion, t, lam, driven, given = found.motion, found.t, found.lam, found.driven, found.given
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    n3, size = 3 * L.bodies, W.size[0, 0]
    for k in range(t.shape[0]):
        W.time[0, 0] = t[k]
        # before the laws, which drivers of own states follow, and after: inputs may have been set
        own_numbers(L, W, motion[k], 3 * n3)
        signals(L, W, w, L.varying)
        for d in range(L.driver_row.shape[0]):
            o = L.driver_row[d]
            if not found.by_law:
                W.signal[o, 0], W.signal[o + 1, 0] = given[k, d, 0], given[k, d, 1]
        for n in range(n3):
            W.q[n, 0], W.v[n, 0] = motion[k, n], motion[k, n3 + n]
        own_numbers(L, W, motion[k], 3 * n3)
        turns(L, W, w)
        rows(L, W, w, True, None)
        worst = 0.0
        for n in range(2 * L.nodes):
            if W.regularization_weight[n, 0] > 0.0:
                # rows of lengths weigh one, rows of angles 1/length²
                unit = 1.0 / size if W.regularization_weight[n, 0] == 1.0 else 1.0
                worst = max(worst, abs(W.phi[n, 0]) * unit)
        output[k, CONSTRAINT] = worst
        forces(L, W, w, -1)
        clear(W.lam, w)
        for e in range(L.primitive_node.shape[0]):
            if L.written_node[e] != L.primitive_node[e]:
                continue
            W.lam[2 * L.primitive_node[e], 0] = lam[k, 2 * e]
            W.lam[2 * L.primitive_node[e] + 1, 0] = lam[k, 2 * e + 1]
        clear(W.u, w)
        apply_gt(L, W, w, W.lam, W.u)
        clear(W.r, w)
        for s in range(L.slots):
            for n in range(3):
                W.r[3 * L.slot_body[s] + n, 0] += W.u[3 * s + n, 0]
        worst, term, power, flow = 0.0, 0.0, 0.0, 0.0
        for s in range(L.switched.shape[0]):
            # a row that can be off acts all the same: as a contact or friction
            e = L.switched[s]
            own = carry_row(L, W, e, lam[k, 2 * e])
            power -= own
            flow += abs(own)
        for b in range(L.bodies):
            for n in range(3):
                unit = 1.0 / size if n == 2 else 1.0
                inertia = W.mass[3 * b + n, 0] * motion[k, 2 * n3 + 3 * b + n]
                load = W.force[3 * b + n, 0]
                carried = W.r[3 * b + n, 0]
                worst = max(worst, unit * abs(load - inertia - carried))
                term = max(term, unit * max(abs(load), abs(inertia), abs(carried)))
                v = W.v[3 * b + n, 0]
                power += (load - inertia) * v
            # what a force could do along its body's path: one that is square to it does no work,
            # and its rounding must not be the measure of itself
            o, a = 3 * b, 2 * n3 + 3 * b
            push = np.hypot(W.force[o, 0], W.force[o + 1, 0])
            push += W.mass[o, 0] * np.hypot(motion[k, a], motion[k, a + 1])
            twist = abs(W.force[o + 2, 0]) + abs(W.mass[o + 2, 0] * motion[k, a + 2])
            flow += push * np.hypot(W.v[o, 0], W.v[o + 1, 0]) + twist * abs(W.v[o + 2, 0])
        for d in range(driven.shape[0]):
            rate = 0.0 if found.at_rest else W.signal[L.driver_row[d] + 1, 0]
            p = -lam[k, 2 * driven[d]] * rate
            power += p
            flow += abs(p)
        output[k, LEFT] = worst
        output[k, TERM] = term
        output[k, POWER] = power
        output[k, FLOW] = flow
