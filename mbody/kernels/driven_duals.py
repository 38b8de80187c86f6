"""Exact derivatives of driven motions: two more steps of Newton's method in dual numbers.

At a closed position q of numbers p the first step, Φ_q Δq = −Φ, has Δq = 0 in its value and
q̇ = −Φ_q⁻¹ Φ_p ṗ in its tangents (implicit function theorem); the second evaluates all rows with
these, so that velocities, accelerations, loads and multipliers follow with theirs.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.dual_number import value
from mbody.core.duals import dual
from mbody.core.lanes import ld, st
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import viscous_friction
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import keep
from mbody.kernels.position_velocity import accelerations, multipliers, newton, velocities
from mbody.kernels.schur_ldl import VANISHED

__all__ = [
    "BY_LAW",
    "BY_TIME",
    "BY_VALUE",
    "DualInstants",
    "FoundDuals",
    "driven_duals",
    "keep_duals",
]

#: What the drivers go by: time; equal steps of one driver, when its law makes them; given values
#: and rates.
BY_TIME, BY_LAW, BY_VALUE = 0, 1, 2


class DualInstants(Bundle):
    """Instants of a driven motion, closed as far as values go, and what is computed of them."""

    mode: int  # BY_TIME, BY_LAW or BY_VALUE
    leader: int  # number of the driver that goes at equal steps, by law
    t: Floats  # (instants,)
    given: Stacks  # (instants, drivers, 3): value, rate, acceleration, except by time
    q: Rows  # (instants, coordinates)
    rows: int  # of a page of `mbody.kernels.output.keep`
    regularization: float
    with_forces: int  # whether reactions are computed
    at_rest: int  # whether velocities and accelerations are zero (statics)
    loads: int  # how many loads follow, each alone: all or none


class FoundDuals(Bundle):
    """Where the kernel puts what it finds."""

    # (instants, rows, lanes): rows as of `mbody.kernels.output.keep`; the time; signals of the
    # drivers, three each; forces of the loads on all coordinates
    output: Stacks
    # (instants, lanes): what is left of the tangents of Φ, the greatest of all rows; not zero where
    # loops with redundant rows do not close with other numbers
    unclosed: Rows


@kernel
def driven_duals(L: Layout, W: Work, instants: DualInstants, found: FoundDuals) -> None:
    """The values and tangents of every instant by those of W.par and W.mass."""
    w = dual()
    output = found.output
    st(W.time, 0, 0.0, w)
    signals(L, W, w, L.signal_law.shape[0])
    # where the turn begins
    st(W.scratch, 31, ld(W.signal, L.driver_row[instants.leader], w), w)
    for k in range(instants.t.shape[0]):
        set_signals(L, W, w, instants, k)
        for n in range(3 * L.bodies):
            st(W.q, n, instants.q[k, n], w)
        one_instant(L, W, w, instants)
        keep_unclosed(L, W, w, found, k)
        keep_duals(L, W, w, output[k], instants.rows, instants.loads)


@njit
def keep_duals(L, W, w, output, rows, loads):
    """output (rows, lanes) ← all of an instant: the page, the time, signals of the drivers, three
    each, and forces of each of so many loads on all coordinates.
    """
    keep(L, W, w, output)
    st(output, rows, ld(W.time, 0, w), w)
    row = rows + 1
    for d in range(L.driver_row.shape[0]):
        for n in range(3):
            st(output, row + n, ld(W.signal, L.driver_row[d] + n, w), w)
        row += 3
    for cause in range(loads):
        forces(L, W, w, cause)
        for n in range(3 * L.bodies):
            st(output, row + n, ld(W.force, n, w), w)
        row += 3 * L.bodies


@inline
def keep_unclosed(L, W, w, found, k):
    """Tangents of Φ as the last step of Newton's method found them."""
    for lane in range(found.unclosed.shape[1]):
        most = 0.0
        for n in range(2 * L.nodes):
            most = max(most, abs(W.phi[n, lane]))
        found.unclosed[k, lane] = most


@inline
def set_signals(L, W, w, instants, k):
    """Signals of instant k."""
    st(W.time, 0, instants.t[k], w)
    signals(L, W, w, L.varying)
    if instants.mode == BY_LAW:
        # the time at which the law is so far from its beginning depends on the numbers of the law
        o = L.driver_row[instants.leader]
        way = ld(W.signal, o, w) - ld(W.scratch, 31, w)
        off, rate = way - value(way), ld(W.signal, o + 1, w)
        if rate != 0.0:
            st(W.time, 0, instants.t[k] - off / rate, w)
            signals(L, W, w, L.varying)
    elif instants.mode == BY_VALUE:
        for d in range(L.driver_row.shape[0]):
            if L.driver_follows[d] == 0:
                for n in range(3):
                    st(W.signal, L.driver_row[d] + n, instants.given[k, d, n], w)


@njit
def one_instant(L, W, w, instants):
    """Position, velocity, acceleration and multipliers with their tangents."""
    regularization = instants.regularization
    # the proximal term leaves a part of 1e-9 of a step to the next one
    steps = 2 if regularization == 0.0 else 3
    for _ in range(steps):
        newton(L, W, w, regularization, VANISHED)
    if instants.at_rest:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
    else:
        velocities(L, W, w, True)
        accelerations(L, W, w, True)
    if instants.with_forces:
        forces(L, W, w, -1)
        if L.friction_kind.shape[0] > 0:
            viscous_friction(L, W, w)
        multipliers(L, W, w)
