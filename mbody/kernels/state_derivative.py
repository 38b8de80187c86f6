"""Right-hand side of the equations of motion: the derivative of the state, and powers.

    ẏ = (v, a, ż) of y = (q, v, z), with  M a + Gᵀ λ = f,  G a = γ  and the rates ż of a user's own
    states z (`mbody.kernels.measured_formulas`).

The accelerations are those of `mbody.kernels.accelerations`. A load of generalised force f_c has
the power f_c · v; a driver, whose effort is −λ and whose rate is ν = ∂/∂t of its law, has −λ ν.
"""

from __future__ import annotations

from mbody.core.bundle import Rows
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import ld, st
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import friction_loss
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import keep
from mbody.kernels.projection import constrained_accelerations
from mbody.kernels.singularity_monitor import sample_conditioning
from mbody.kernels.step_state import BEST_CONDITIONING, CONDITIONING, TIME, Stepping

__all__ = [
    "first_derivative",
    "initial_derivative",
    "load_state",
    "state_derivative",
    "store_derivative",
    "store_state",
]


@inline
def load_state(L, W, w, y):
    """(q, v) and own states ← the state y (2·coordinates + owns, ·)."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(W.q, n, ld(y, n, w), w)
        st(W.v, n, ld(y, n3 + n, w), w)
    for n in range(L.owns):
        st(W.own, n, ld(y, 2 * n3 + n, w), w)


@inline
def store_state(L, W, w, y):
    """The state y ← (q, v); own states are not projected."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(y, n, ld(W.q, n, w), w)
        st(y, n3 + n, ld(W.v, n, w), w)


@inline
def store_derivative(L, W, w, K):
    """The derivative K (2·coordinates + owns, ·) ← (v, a) and the rates of own states."""
    n3 = 3 * L.bodies
    for n in range(n3):
        st(K, n, ld(W.v, n, w), w)
        st(K, n3 + n, ld(W.a, n, w), w)
    for n in range(L.owns):
        st(K, 2 * n3 + n, ld(W.own_rate, n, w), w)


@njit
def powers(L, W, P):
    """P (causes,) ← the power of every load, or of all together where P has one number for them,
    then of every driver and of every rough pair, below zero where it takes, and of every stop that
    moves. W.force holds the sum of all loads.
    """
    pairs, moving = L.friction_kind.shape[0], L.moving.shape[0]
    count = P.shape[0] - L.driver_row.shape[0] - pairs - moving
    alone = count > 1
    for cause in range(count):
        if alone:
            forces(L, W, 0.0, cause)
        total = 0.0
        for n in range(3 * L.bodies):
            total += W.force[n, 0] * W.v[n, 0]
        if not alone:
            # friction is among the forces, and no load
            for f in range(pairs):
                total += friction_loss(L, W, f)
        P[cause] = total
    for d in range(L.driver_row.shape[0]):
        # an effort is −λ
        P[count + d] = -W.lam[2 * L.driver_node[d], 0] * W.signal[L.driver_row[d] + 1, 0]
    for f in range(pairs):
        P[count + L.driver_row.shape[0] + f] = -friction_loss(L, W, f)
    for m in range(moving):
        node = 2 * L.primitive_node[L.switched[L.moving[m]]]
        # as of a driver: the row gives ν where it is on
        P[count + L.driver_row.shape[0] + pairs + m] = -W.lam[node, 0] * W.nu[node, 0]


@njit
def state_derivative(L, W, S, t, y, row, refinements, projected):
    """Row `row` of K and P ← the derivative of the state y at t and its powers;
    `projected`: of the projection of y onto the constraints, which y becomes.

    S: a `Stepping`. Returns how far the projection moves position and velocity, and whether it
    converged.
    """
    W.time[0, 0] = t
    load_state(L, W, 0.0, y)
    far, fast, good = constrained_accelerations(L, W, 0.0, S.regularization, refinements, projected)
    if projected:
        store_state(L, W, 0.0, y)
    store_derivative(L, W, 0.0, S.K[row])
    powers(L, W, S.P[row])
    return far, fast, good


@kernel
def initial_derivative(L: Layout, W: Work, S: Stepping, refinements: int, page: Rows) -> bool:
    """Project the first state S.y at the time in its slot, evaluate its derivative, page (rows, 1)
    ← what is kept of it. Returns whether the projection converged.
    """
    return first_derivative(L, W, S, refinements, page)


@njit
def first_derivative(L, W, S, refinements, page):
    """See `initial_derivative`."""
    signals(L, W, 0.0, L.signal_law.shape[0])
    _, _, good = state_derivative(L, W, S, S.state[TIME], S.y, 0, refinements, True)
    S.state[CONDITIONING] = S.state[BEST_CONDITIONING] = sample_conditioning(L, W, 0.0, 0)
    keep(L, W, 0.0, page)
    return good
