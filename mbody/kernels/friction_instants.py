"""Friction at stored instants: rates of sliding, and forces for senses that are given.

Where a pair rests its friction may be anything up to its limit, so that reactions and efforts lie
between those of the two senses in which it would begin to slide. These are found here: the same
equations as of the analysis, with senses that no rate decides.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Rows, Stacks
from mbody.core.decorators import inline, kernel
from mbody.core.lanes import ld, st
from mbody.kernels.constraints import rows
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import (
    CERTIFICATE,
    REACHED_PART,
    along_tangent,
    lasting_senses,
    senses_by_rates,
    sliding_rates,
    viscous_friction,
)
from mbody.kernels.layout import Layout, Work
from mbody.kernels.load_breakdown import at_instant
from mbody.kernels.output import keep_primitives
from mbody.kernels.position_velocity import multipliers, velocities
from mbody.kernels.schur_ldl import VANISHED, factor

__all__ = ["PER_PAIR", "StoredMotion", "forces_by_senses", "impending_rates", "rates_of_pairs"]

#: Numbers of a pair in `rates_of_pairs`: rate of sliding, its derivative by time, sense.
PER_PAIR = 3


class StoredMotion(Bundle):
    """Stored instants."""

    # (instants, 9·bodies + owns + inputs): q, v, a; own states and inputs unless these are in W
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
    senses, zero of pairs at rest.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(found.t.shape[0]):
        take_instant(L, W, w, found, k)
        sliding_rates(L, W, w)
        senses_by_rates(L, W, w)
        for f in range(L.friction_kind.shape[0]):
            output[k, f, 0] = ld(W.rate, f, w)
            output[k, f, 1] = along_tangent(L, W, w, f, W.a, W.gamma)
            output[k, f, 2] = ld(W.sense, f, w)


@kernel
def impending_rates(L: Layout, W: Work, found: StoredMotion, output: Stacks) -> None:
    """Fill output (instants, drivers, pairs): rates of sliding if one driver alone moved at the
    rate 1.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(found.t.shape[0]):
        take_instant(L, W, w, found, k)
        factor(L, W, w, found.regularization, VANISHED)
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
    L: Layout, W: Work, found: StoredMotion, senses: Rows, output: Stacks, reached: Rows
) -> None:
    """Fill output (instants, PER_PRIMITIVE·primitives, 1) with the forces for the senses of all
    pairs (instants, pairs), and reached (instants, 2) with the spectral radius below which friction
    is unique and the part of it that was reached. Pairs at rest have their static coefficient.
    """
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    for k in range(found.t.shape[0]):
        take_instant(L, W, w, found, k)
        factor(L, W, w, found.regularization, VANISHED)
        forces(L, W, w, -1)
        viscous_friction(L, W, w)
        senses_by_rates(L, W, w)
        for f in range(L.friction_kind.shape[0]):
            if ld(W.sense, f, w) == 0.0:
                st(W.rate, f, 0.0, w)
            st(W.sense, f, senses[k, f], w)
        lasting_senses(L, W, w)
        multipliers(L, W, w)
        keep_primitives(L, W, w, output[k], 0)
        reached[k, 0] = ld(W.friction, CERTIFICATE, w)
        reached[k, 1] = ld(W.friction, REACHED_PART, w)
