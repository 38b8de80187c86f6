"""Computations on finished instants: residuals, the breakdown by cause, and friction."""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Grids, Ints, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import ld, st
from mbody.core.tolerances import PIVOT_VANISHED
from mbody.kernels.constraints import (
    balancing_multipliers,
    body_rotations,
    clear,
    further_block,
    measured_formulas,
    multipliers,
    own_numbers,
    rows,
    velocities,
)
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import (
    CERTIFICATE,
    REACHED_PART,
    add_row,
    along_tangent,
    fixed_slip_signs,
    sliding_rates,
    slip_signs_by_rates,
    tangent,
    viscous_friction,
)
from mbody.kernels.layout import Layout, Work, keep_primitives
from mbody.kernels.schur_ldl import apply_gt, factor

#: Columns of the output: greatest |Φ| (model lengths, radians); greatest part of f − M a − Gᵀλ and
#: greatest term of it (forces, torques by the model length); power of loads, inertia and drivers,
#: and the sum of their magnitudes. And how many they are; where there are further columns, LEFT and
#: TERM of every connected part follow, in those of its first body, zero in those of the others.
CONSTRAINT, LEFT, TERM, POWER, FLOW = range(5)
RESIDUALS = 5


class Finished(Bundle):
    """Stored instants."""

    # (instants, 9·bodies + owns + inputs): q, v, a; auxiliary states and inputs unless these are in
    # W
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
    """Fill output (instants, RESIDUALS or RESIDUALS + 2·bodies) from stored instants.

    Virtual power, with the drivers' efforts −λ: Σ (f − M a)·v − Σ λ_d ν_d = 0.
    """
    motion, t, lam, driven, given = found.motion, found.t, found.lam, found.driven, found.given
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    n3, by_parts = 3 * L.bodies, output.shape[1] > RESIDUALS
    for k in range(t.shape[0]):
        W.time[0, 0] = t[k]
        # before the laws, which drivers of auxiliary states follow, and after: inputs may have been
        # set
        own_numbers(L, W, motion[k], 3 * n3)
        signals(L, W, w, L.varying)
        for d in range(L.driver_row.shape[0]):
            o = L.driver_row[d]
            if not found.by_law:
                W.signal[o, 0], W.signal[o + 1, 0] = given[k, d, 0], given[k, d, 1]
        for n in range(n3):
            W.q[n, 0], W.v[n, 0] = motion[k, n], motion[k, n3 + n]
        own_numbers(L, W, motion[k], 3 * n3)
        body_rotations(L, W, w)
        rows(L, W, w, True, None)
        worst = 0.0
        for n in range(2 * L.nodes):
            if W.regularization_weight[n, 0] > 0.0:
                # rows of lengths weigh one, rows of angles 1/length²
                slot = min(L.node_column[n - n % 2], L.node_column[n - n % 2 + 1]) // 3
                size = W.size[1 + L.slot_body[slot], 0]
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
        if by_parts:
            for n in range(RESIDUALS, output.shape[1]):
                output[k, n] = 0.0
        for s in range(L.active_set.shape[0]):
            # a row that can be off acts all the same: as a contact or friction
            e = L.active_set[s]
            own = carry_row(L, W, e, lam[k, 2 * e])
            power -= own
            flow += abs(own)
        for b in range(L.bodies):
            for n in range(3):
                unit = 1.0 / W.size[1 + b, 0] if n == 2 else 1.0
                inertia = W.mass[3 * b + n, 0] * motion[k, 2 * n3 + 3 * b + n]
                load = W.force[3 * b + n, 0]
                carried = W.r[3 * b + n, 0]
                left = unit * abs(load - inertia - carried)
                part = unit * max(abs(load), abs(inertia), abs(carried))
                worst, term = max(worst, left), max(term, part)
                if by_parts:
                    o = RESIDUALS + 2 * L.body_part[b]
                    output[k, o] = max(output[k, o], left)
                    output[k, o + 1] = max(output[k, o + 1], part)
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


# -- Breakdown by cause: what each load is, and the multipliers that it would have alone -------
#
# Φ_qᵀ λ = f − M a is linear in inertia and loads: λ is the sum of what −M a and each load would
# have alone, each one solve with the factor of the instant. Friction is one more load: as it is in
# the whole, for it would be another one alone.

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

    motion (instants, 9·bodies + owns + inputs): q, v, a of each instant, and auxiliary states
    and inputs unless these are in W; t (instants,); sliding (instants, pairs): multipliers of the
    tangent rows of friction pairs, of no instant where friction is not wanted.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    n3 = 3 * L.bodies
    for k in range(t.shape[0]):
        at_instant(L, W, w, motion, t, k)
        rows(L, W, w, True, None)
        factor(L, W, w, regularization, PIVOT_VANISHED)
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
        node = 2 * L.primitive_node[L.active_set[L.friction_tangent[f]]]
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
    """Time, signals, positions, rates, auxiliary states and formulas of instant k."""
    W.time[0, 0] = t[k]
    n3 = 3 * L.bodies
    # before the laws, which drivers of auxiliary states follow, and after: inputs may have been set
    own_numbers(L, W, motion[k], 3 * n3)
    signals(L, W, w, L.varying)
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = motion[k, n], motion[k, n3 + n]
    own_numbers(L, W, motion[k], 3 * n3)
    body_rotations(L, W, w)
    measured_formulas(L, W, w)


# -- Friction at stored instants: rates of sliding, and forces for slip signs that are given ------
#
# Where a pair rests its friction may be anything up to its limit, so that reactions and efforts lie
# between those of the two directions in which it would begin to slide. These are found here: the
# same equations as of the analysis, with slip signs that no rate decides.

#: Numbers of a pair in `rates_of_pairs`: rate of sliding, its derivative by time, slip sign.
PER_PAIR = 3


class StoredMotion(Bundle):
    """Stored instants."""

    # (instants, 9·bodies + owns + inputs): q, v, a; auxiliary states and inputs unless these are in
    # W
    motion: Rows
    t: Floats  # (instants,)
    regularization: float


@inline
def take_instant(L, W, w, found, k):
    """Position, rates, accelerations and rows of instant k."""
    n3 = 3 * L.bodies
    at_instant(L, W, w, found.motion, found.t, k)
    for n in range(n3):
        st(W.a, n, found.motion[k, 2 * n3 + n], w)
    rows(L, W, w, True, True)


@kernel
def rates_of_pairs(L: Layout, W: Work, found: StoredMotion, output: Stacks) -> None:
    """Fill output (instants, pairs, PER_PAIR) with rates of sliding, their derivatives and the
    slip signs, zero of pairs at rest.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(found.t.shape[0]):
        take_instant(L, W, w, found, k)
        sliding_rates(L, W, w)
        slip_signs_by_rates(L, W, w)
        for f in range(L.friction_kind.shape[0]):
            output[k, f, 0] = ld(W.rate, f, w)
            output[k, f, 1] = along_tangent(L, W, w, f, W.a, W.gamma)
            output[k, f, 2] = ld(W.slip_sign, f, w)


@kernel
def impending_rates(L: Layout, W: Work, found: StoredMotion, output: Stacks) -> None:
    """Fill output (instants, drivers, pairs): rates of sliding if one driver alone moved at the
    rate 1.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(found.t.shape[0]):
        take_instant(L, W, w, found, k)
        factor(L, W, w, found.regularization, PIVOT_VANISHED)
        for d in range(L.driver_node.shape[0]):
            for n in range(2 * L.nodes):
                st(W.nu, n, 0.0, w)
            st(W.nu, 2 * L.driver_node[d], 1.0, w)
            velocities(L, W, w, True)
            sliding_rates(L, W, w)
            for f in range(L.friction_kind.shape[0]):
                output[k, d, f] = ld(W.rate, f, w)


@kernel
def forces_by_senses(
    L: Layout, W: Work, found: StoredMotion, slip_signs: Rows, output: Stacks, reached: Rows
) -> None:
    """Fill output (instants, PER_PRIMITIVE·primitives, 1) with the forces for the slip signs of all
    pairs (instants, pairs), and reached (instants, 2) with the spectral radius below which friction
    is unique and the part of it that was reached. Pairs at rest have their static coefficient.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(found.t.shape[0]):
        take_instant(L, W, w, found, k)
        factor(L, W, w, found.regularization, PIVOT_VANISHED)
        forces(L, W, w, -1)
        viscous_friction(L, W, w)
        slip_signs_by_rates(L, W, w)
        for f in range(L.friction_kind.shape[0]):
            if ld(W.slip_sign, f, w) == 0.0:
                st(W.rate, f, 0.0, w)
            st(W.slip_sign, f, slip_signs[k, f], w)
        fixed_slip_signs(L, W, w)
        multipliers(L, W, w)
        keep_primitives(L, W, w, output[k], 0)
        reached[k, 0] = ld(W.friction, CERTIFICATE, w)
        reached[k, 1] = ld(W.friction, REACHED_PART, w)
