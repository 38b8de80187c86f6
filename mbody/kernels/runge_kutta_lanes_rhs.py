"""Slopes of free motion in many lanes, each on its own: what a lane gets does not depend on its
neighbours, bit for bit.

A lane whose projection has converged keeps its place while the others go on.
"""

from __future__ import annotations

from mbody.compiler.jit import inline, kernel, njit
from mbody.compiler.lanes import highest, larger, ld, select_le, st, wide
from mbody.kernels.accelerations import balance
from mbody.kernels.constraints import rows, turns
from mbody.kernels.forces import signals
from mbody.kernels.output import keep
from mbody.kernels.position_velocity import copy, newton, put_column
from mbody.kernels.projection import NEWTON, project_velocity
from mbody.kernels.schur_ldl import VANISHED, factor
from mbody.kernels.singularity_monitor import sampled

__all__ = ["arrive", "begin_designs", "give", "given", "pass_by", "put_numbers", "take", "unsound"]


@inline
def take(L, W, w, y):
    """Position and velocity ← the state y (2·coordinates, lanes)."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(W.q, n, ld(y, n, w), w)
        st(W.v, n, ld(y, n3 + n, w), w)


@inline
def give(L, W, w, y):
    """The state y ← position and velocity."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(y, n, ld(W.q, n, w), w)
        st(y, n3 + n, ld(W.v, n, w), w)


@inline
def given(L, W, w, K):
    """The slope K ← velocity and acceleration."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(K, n, ld(W.v, n, w), w)
        st(K, n3 + n, ld(W.a, n, w), w)


@njit
def pass_by(L, W, w, passes):
    """a and λ at W.q, W.v and W.time, which need not lie on the manifold."""
    signals(L, W, w, L.varying)
    turns(L, W, w)
    rows(L, W, w, True, True)
    factor(L, W, w, 0.0, VANISHED)
    balance(L, W, w, passes)


@njit
def arrive(L, W, w, passes, among):
    """a and λ at the projection of W.q and W.v in the lanes where `among` is one; what others have
    is of no use. Returns one in lanes where the projection did not converge, else zero.
    """
    signals(L, W, w, L.varying)
    failed = settle(L, W, w, among)
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, 0.0, VANISHED)
    project_velocity(L, W, w, passes)
    rows(L, W, w, None, True)
    balance(L, W, w, passes)
    return failed


@njit
def settle(L, W, w, among):
    """q ← the nearest position with Φ = 0, as `project_position` of the manifold finds it."""
    zero = 0.0 * among
    one = zero + 1.0
    left, failed, last = among, zero, one
    for n in range(NEWTON):
        if n > 0:
            copy(W.q, W.base, w)
        size, _ = newton(L, W, w, 0.0, VANISHED)
        if n > 0:
            for m in range(3 * L.bodies):
                st(W.q, m, select_le(one, left, ld(W.q, m, w), ld(W.base, m, w)), w)
        # what a step of this size leaves is of second order: rounding; NaN is far
        off = left * select_le(size, zero + (1e-7 if n > 0 else 1e-9), zero, one)
        lost = off * select_le(size, zero + 1e6, zero, one)
        if n > 1:
            lost = larger(lost, off * select_le(size, 0.5 * last, zero, one))
        failed = larger(failed, lost)
        left = off - lost
        last = size
        if highest(left) <= 0.0:
            break
    return larger(failed, left)


@njit
def unsound(page, w):
    """Zero in lanes in which all rows of a page are finite, else NaN."""
    total = 0.0 * ld(page, 0, w)
    for n in range(1, page.shape[0]):
        total = total + 0.0 * ld(page, n, w)
    return total


@kernel
def begin_designs(L, W, passes, t, lot, wanted, page, output, bad):
    """Project the first state of every design and take its slope: `lot.y` and `lot.slope`.

    lot: a `Lot`, whose `pivot` and `near` are set too; page (rows, lanes): room; output (kept,
    designs): the rows `wanted`; bad (designs,): set to one where a design must go alone. The last
    lanes repeat the last design.
    """
    w = wide()
    designs, lanes = lot.par.shape[1], page.shape[1]
    n3 = 3 * L.bodies
    for low in range(0, designs, lanes):
        for lane in range(lanes):
            design = min(low + lane, designs - 1)
            put_numbers(W, lot, lane, design)
            W.time[0, lane] = t
            for n in range(n3):
                W.q[n, lane], W.v[n, lane] = lot.y[n, design], lot.y[n3 + n, design]
        signals(L, W, w, L.signal_law.shape[0])
        failed = arrive(L, W, w, passes, 1.0 + 0.0 * wide())
        pivot = sampled(L, W, w, 0)
        keep(L, W, w, page)
        failed = failed + unsound(page, w)
        many = min(lanes, designs - low)
        for n in range(wanted.shape[0]):
            for lane in range(many):
                output[n, low + lane] = page[wanted[n], lane]
        for lane in range(many):
            for n in range(n3):
                lot.y[n, low + lane], lot.y[n3 + n, low + lane] = W.q[n, lane], W.v[n, lane]
                lot.slope[n, low + lane] = W.v[n, lane]
                lot.slope[n3 + n, low + lane] = W.a[n, lane]
        st(page, 0, pivot, w)
        st(page, 1, failed, w)
        for lane in range(many):
            lot.pivot[low + lane] = page[0, lane]
            for k in range(L.nodes):
                lot.near[k, low + lane] = W.near[k, lane]
            bad[low + lane] = 0.0 if page[1, lane] == 0.0 else 1.0


@inline
def put_numbers(W, lot, lane, design):
    """The numbers of a design into a lane."""
    put_column(lot.par, design, W.par, lane)
    put_column(lot.mass, design, W.mass, lane)
    put_column(lot.weight, design, W.weight, lane)
