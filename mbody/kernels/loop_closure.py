"""Closing the loops from a rough guess, and the projection of velocities.

Damped Newton in the affine invariant form (Deuflhard 2004, algorithm NLEQ-ERR): q ← q + κ Δ with
Φ_q Δ = −Φ. The damping κ keeps to the Newton path Φ(q(s)) = (1 − s) Φ(q₀), which leads straight
from the guess to the solution, so that the guess chooses the branch. A step is accepted where the
simplified correction, from the new position by the old Φ_q, falls: |Δ̄| ≤ (1 − κ/4) |Δ|; along the
path it is (1 − κ) Δ + O(κ²), so that some κ > 0 passes wherever Φ_q is regular.

Where the path ends at a singular position, Levenberg–Marquardt finds the nearest closed position,
or the smallest gap.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Floats, Rows
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import highest, larger, ld, select_le, smaller, st
from mbody.core.tolerances import (
    FINITE,
    LOOP_CLOSURE_DAMPING_LOST,
    LOOP_CLOSURE_DAMPING_START,
    LOOP_CLOSURE_DESCENT,
    LOOP_CLOSURE_STAGE_FIRST,
    LOOP_CLOSURE_STAGE_LOST,
    LOOP_CLOSURE_STAGE_NEXT,
    MONITOR_BEND,
    MONITOR_NOISE,
    MONITOR_STEEPER,
    MONITOR_SWEEP,
    MONITOR_VARIED,
    PIVOT_VANISHED,
    TINY,
)
from mbody.kernels.constraints import (
    body_rotations,
    clear,
    copy,
    least_motion,
    motion_norm,
    newton,
    put_column,
    rates_of_rows,
    rows,
    take_off,
    weigh,
)
from mbody.kernels.forces import augmented_solution, signals
from mbody.kernels.layout import Layout, Work
from mbody.kernels.schur_ldl import apply_g, apply_gt, constraint_conditioning, factor, solve
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    DECIDE_BELOW,
    KNOWN_UNTIL,
    LEAST_AT,
    LEAST_CONDITIONING,
    SHORTENED_UNTIL,
    TIME,
)

# -- Distance of a free motion from singular positions, and whether a step keeps its branch ----
#
# Branches of the constraints meet where rows of G become dependent, and nowhere else. The distance
# d from such a position is the root of what elimination leaves of the determinant of a node
# (`node_conditioning`); where a motion runs through one, d falls to zero and rises again as |t −
# t₀|.
#
# Each step is sampled at several times. If d is zero at some time between two samples d₀ and d₁, a
# gap g apart, and changes at most at the rate ρ, then d₀ + d₁ ≤ ρ g: a value that falls from d₀ to
# zero and rises to d₁, however often, needs at least the time (d₀ + d₁)/ρ. So d₀ + d₁ > ρ g proves
# that there was none; ρ is estimated by the neighbouring gaps. A step for which this does not hold
# is made again with a shorter one, and so is one in which bodies turn so far that the samples do
# not show how d varies.


@njit
def node_conditioning(L, W, w, k):
    """Determinant of node k after elimination as a part of its value before: how far its two rows
    are from depending on those before, whatever their axes and the masses of the bodies.

    With the diagonal block S_kk = [a b; b c] of the Schur complement before elimination, and pivots
    d₀, d₁ after it, the part is  d₀ d₁ / (a c − b²),  0 where rows depend, 1 where they are
    orthogonal to all before.
    """
    B, V = W.block, W.weight
    b = 0.0 * ld(W.size, 0, w)
    zero = b
    for side in range(2):
        i, o = L.node_column[2 * k + side], 12 * k + 6 * side
        for m in range(3):
            b = b + ld(V, i + m, w) * ld(B, o + m, w) * ld(B, o + 3 + m, w)
    both = ld(W.diagonal, 2 * k, w) * ld(W.diagonal, 2 * k + 1, w)
    # W.pivot holds 1/d₀ and 1/d₁; a pivot that vanished is zero there
    left = ld(W.pivot, 3 * k, w) * ld(W.pivot, 3 * k + 2, w) * (both - b * b)
    return select_le(TINY, left, 1.0 / left, zero)


@njit
def sample_conditioning(L, W, w, n):
    """Keep the distances of all nodes at the present factor as sample n of the step; returns the
    square of the least, the conditioning of the constraints.
    """
    least = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(L.nodes):
        left = node_conditioning(L, W, w, k)
        least = smaller(least, left)
        st(W.near, n * L.nodes + k, np.sqrt(left), w)
    return least


@njit
def singularity_risk(L, W, w, at, steeper, turned):
    """Above zero where a step may have met a singular position: its samples were taken at the
    parts `at` (samples,) of it. A rate may be `steeper` times that of the neighbouring gaps;
    `turned`: by how much a body turned.
    """
    zero = 0.0 * ld(W.size, 0, w)
    worst, widest = zero - 1.0, 0.0
    for n in range(1, at.shape[0]):
        widest = max(widest, at[n] - at[n - 1])
    blurred = turned * widest - MONITOR_SWEEP
    for k in range(L.nodes):
        d = ld(W.near, k, w)
        rate, both, low, high = zero, zero, d, d
        for n in range(1, at.shape[0]):
            gap = at[n] - at[n - 1]
            here = ld(W.near, n * L.nodes + k, w)
            new, sum_here = np.abs(here - d) / gap, d + here
            # ρ g − (d₀ + d₁): of this gap by the rate of the last one, and the other way round
            worst = larger(worst, steeper * rate * gap - sum_here - MONITOR_NOISE)
            if n > 1:
                worst = larger(
                    worst, steeper * new * (at[n - 1] - at[n - 2]) - both - MONITOR_NOISE
                )
            low, high = smaller(low, here), larger(high, here)
            d, rate, both = here, new, sum_here
        worst = larger(worst, smaller(blurred, high - low - MONITOR_VARIED * high))
    return worst


@njit
def may_be_singular(L, W, S, at, other, near_singular):
    """Whether a step between S.y and the state `other` (2·coordinates,), of either direction, may
    have met a singular position that is not known. Steps that are near one (see
    `mbody.kernels.runge_kutta`) take it for granted that they are short beside the distance from
    it.
    """
    state = S.state
    t = state[TIME]
    if t <= state[KNOWN_UNTIL]:
        return False
    turned = largest_rotation(L, 0.0, S.y, other)
    bend = near_singular or (t < state[SHORTENED_UNTIL] and state[DECIDE_BELOW] == 0.0)
    return singularity_risk(L, W, 0.0, at, MONITOR_BEND if bend else MONITOR_STEEPER, turned) > 0.0


@njit
def record_accepted(L, W, S, sample, least, least_at, artificial):
    """Record a step that is accepted, whose last sample was number `sample`: where it was nearest
    to a singular position, and, with `artificial`, the energy of what replaces missing masses.
    """
    state = S.state
    keep_last_sample(L, W, 0.0, sample, 1.0)
    if least < state[LEAST_CONDITIONING]:
        state[LEAST_CONDITIONING], state[LEAST_AT] = least, least_at
    if artificial:
        state[ARTIFICIAL_ENERGY] = artificial_energy(L, W, 0.0, W.v)


@njit
def artificial_energy(L, W, w, v):
    """Kinetic energy of masses that replace missing ones, as a part of that of the masses, at
    the velocities v (coordinates, ·).
    """
    own, lent = 0.0 * ld(W.size, 0, w), 0.0 * ld(W.size, 0, w)
    for b in range(L.bodies):
        s = L.body_slot[b]
        share = ld(W.share, s, w)
        for n in range(3):
            rate, mass = ld(v, 3 * b + n, w), ld(W.mass, 3 * b + n, w)
            own = own + mass * rate * rate
            lent = lent + (1.0 / (ld(W.weight, 3 * s + n, w) * share) - mass) * rate * rate
    return lent / (own + TINY)


@njit
def largest_rotation(L, w, y, end):
    """By how much the body that turns most does, from the state y to `end` (2·coordinates, ·)."""
    most = 0.0 * ld(y, 0, w)
    for b in range(L.bodies):
        most = larger(most, np.abs(ld(end, 3 * b + 2, w) - ld(y, 3 * b + 2, w)))
    return most


@njit
def keep_last_sample(L, W, w, n, accepted):
    """Where `accepted` is one the last sample, number n, becomes the first of the next step."""
    for k in range(L.nodes):
        new = ld(W.near, n * L.nodes + k, w)
        st(W.near, k, select_le(1.0, accepted, new, ld(W.near, k, w)), w)


# -- Projection onto the constraints Φ = 0 and Φ_q v = ν, in the metric of the masses ----------
#
# The nearest position and the nearest velocity are the solutions of
#
#     min ½ (q − q₀)ᵀ M (q − q₀)  with  Φ(q, t) = 0,     min ½ (v − v₀)ᵀ M (v − v₀)  with  G v = ν.
#
# With multipliers μ the second has M (v − v₀) + Gᵀ μ = 0 and G v = ν, so that S μ = G v₀ − ν and
#
#     v = v₀ − M⁻¹ Gᵀ S⁻¹ (G v₀ − ν),   S = G M⁻¹ Gᵀ.
#
# The first is solved by Newton's method, δq = −M⁻¹ Gᵀ S⁻¹ Φ, with G at the present position: what
# it moves lies across the manifold to first order, so that its limit differs from the nearest
# position by no more than the square of the distance. The same factor of S gives the accelerations
# afterwards.
#
# Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4 and VII.1.

#: Newton steps of one projection, at most.
NEWTON = 12


@njit
def project_position(L, W, w, regularization, among):
    """W.q ← the nearest position with Φ = 0 in the lanes where `among` is one; others get numbers
    of no use. A lane that has converged keeps its position while others go on, so that what it gets
    does not depend on its neighbours.

    Returns how far the first Newton step goes, and one in lanes that did not converge, else zero.
    """
    zero = 0.0 * among
    one = zero + 1.0
    left, failed, first, last = among, zero, zero, one
    for n in range(NEWTON):
        if n > 0:
            copy(W.q, W.base, w)
        size, _ = newton(L, W, w, regularization, PIVOT_VANISHED)
        if n == 0:
            first = size
        else:
            for m in range(3 * L.bodies):
                st(W.q, m, select_le(one, left, ld(W.q, m, w), ld(W.base, m, w)), w)
        # NaN is far
        off = left * select_le(
            size, zero + (LOOP_CLOSURE_STAGE_NEXT if n > 0 else LOOP_CLOSURE_STAGE_FIRST), zero, one
        )
        lost = off * select_le(size, zero + LOOP_CLOSURE_STAGE_LOST, zero, one)
        if n > 1:
            lost = larger(lost, off * select_le(size, 0.5 * last, zero, one))
        failed = larger(failed, lost)
        left = off - lost
        last = size
        if highest(left) <= 0.0:
            break
    return first, larger(failed, left)


@njit
def project_velocity(L, W, w, refinements):
    """W.v ← the nearest velocity with G v = ν, by the present factor. Returns how far it moves."""
    first = 0.0 * ld(W.size, 0, w)
    for n in range(1 + refinements):
        # v ← v − M⁻¹ Gᵀ S⁻¹ (G v − ν)
        rates_of_rows(L, W, w)
        for m in range(2 * L.nodes):
            st(W.x, m, ld(W.x, m, w) - ld(W.nu, m, w), w)
        least_motion(L, W, w, W.x, False)
        if n == 0:
            first = motion_norm(L, W, w)
        take_off(L, w, W.u, W.v)
    return first


@njit
def projected_accelerations(L, W, w, regularization, refinements, among):
    """W.a and W.lam ← a and λ at the projection of W.q and W.v, in the lanes where `among` is one.

    Returns how far position and velocity are moved, and one in lanes where the projection of the
    position did not converge, else zero.
    """
    signals(L, W, w, L.varying)
    far, failed = project_position(L, W, w, regularization, among)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    fast = project_velocity(L, W, w, refinements)
    rows(L, W, w, None, True)
    augmented_solution(L, W, w, refinements)
    return far, fast, failed


@njit
def constrained_accelerations(L, W, w, regularization, refinements, projected):
    """W.a and W.lam ← a and λ at W.q, W.v, W.time of one motion; `projected`: at their projection.
    Returns how far that moves position and velocity, and whether it converged.
    """
    if projected:
        far, fast, failed = projected_accelerations(L, W, w, regularization, refinements, 1.0)
        return far, fast, failed < 0.5
    signals(L, W, w, L.varying)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    rows(L, W, w, None, True)
    augmented_solution(L, W, w, refinements)
    return 0.0, 0.0, True


@njit
def least_conditioning(L, W, w):
    """The least part that elimination leaves of the determinant of a node: the square of how far
    the rows are from depending on each other; see `node_conditioning`.
    """
    least = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(L.nodes):
        least = smaller(least, node_conditioning(L, W, w, k))
    return least


@njit
def tangential_part(L, W, w, e):
    """e (coordinates,) ← e − M⁻¹ Gᵀ S⁻¹ G e, its part along the manifold."""
    clear(W.u, w)
    for s in range(L.slots):
        for n in range(3):
            st(W.u, 3 * s + n, e[3 * L.slot_body[s] + n], w)
    apply_g(L, W, w, W.u, W.x)
    least_motion(L, W, w, W.x, False)
    for b in range(L.bodies):
        for n in range(3):
            e[3 * b + n] -= ld(W.u, 3 * L.body_slot[b] + n, w)


#: Newton steps.
STEPS = 200


@njit
def newton_correction(L, W, w):
    """u = W⁻¹ Gᵀ S⁻¹ Φ by the present factor; its size in model lengths and radians."""
    for n in range(2 * L.nodes):
        W.x[n, 0] = W.phi[n, 0]
    solve(L, W, w)
    clear(W.u, w)
    apply_gt(L, W, w, W.x, W.u)
    weigh(L, W, w, W.u)
    return norm(L, W)


@inline
def norm(L, W):
    """Weighted length of the motion on columns."""
    total = 0.0
    for n in range(3 * L.slots):
        if W.weight[n, 0] > 0.0:
            total += W.u[n, 0] * W.u[n, 0] / W.weight[n, 0]
    return math.sqrt(total)


@inline
def move(L, W, base, u, part):
    """q = base − part · u."""
    for b in range(L.bodies):
        for n in range(3):
            W.q[3 * b + n, 0] = base[3 * b + n, 0] - part * u[3 * L.body_slot[b] + n, 0]


@inline
def exchange_blocks(L, W):
    """The blocks at hand for those in `factored_block`."""
    for n in range(W.factored_block.shape[0]):
        here = W.block[n, 0]
        W.block[n, 0] = W.factored_block[n]
        W.factored_block[n] = here


@njit
def simplified_correction(L, W, w, part):
    """Size of the simplified Newton correction at q = base − part · r: S and G are those of the
    base. G must not be that of q: near a singular position G(q)ᵀ S⁻¹ Φ(q) grows with the step by
    more than Φ falls, however short the step is. Leaves q there, with its blocks.
    """
    move(L, W, W.base, W.r, part)
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    exchange_blocks(L, W)
    size = newton_correction(L, W, w)
    exchange_blocks(L, W)
    return size


@inline
def gap(L, W):
    """½ |Φ|² with angles by the model length."""
    total = 0.0
    for n in range(2 * L.nodes):
        total += (
            W.phi[n, 0]
            * W.phi[n, 0]
            / max(W.regularization_weight[n, 0], TINY)
            * (W.regularization_weight[n, 0] > 0.0)
        )
    return 0.5 * total


@kernel
def violation(L: Layout, W: Work) -> float:
    """Evaluate Φ, Φ_q, ν and γ at W.q and W.v, the signals being set; returns the size of Φ."""
    body_rotations(L, W, 0.0)
    rows(L, W, 0.0, True, True)
    return math.sqrt(2.0 * gap(L, W))


@kernel
def laws_of_time(L: Layout, W: Work) -> None:
    """Set all signals from their laws at W.time."""
    signals(L, W, 0.0, L.signal_law.shape[0])


@kernel
def close(L: Layout, W: Work, regularization: float, tolerance: float) -> tuple[bool, bool, float]:
    """Close the loops from W.q, the signals being set: (closed, by the straight path, least pivot
    as a part of its diagonal).
    """
    return close_from(L, W, regularization, tolerance)


@njit
def close_from(L, W, regularization, tolerance):
    """Closure of the loops from one start (`close`): whether it succeeded, whether Newton's method
    did alone, and the conditioning.
    """
    w = 0.0
    good, _, _ = damped_newton(L, W, w, regularization, tolerance)
    if good:
        return True, True, constraint_conditioning(L, W)
    for n in range(W.q.shape[0]):
        W.q[n, 0] = W.guess[n, 0]
    levenberg_marquardt(L, W, w, tolerance)
    good, _, _ = damped_newton(L, W, w, regularization, tolerance)
    return good, False, constraint_conditioning(L, W)


@kernel
def close_designs(
    L: Layout, W: Work, tolerance: Floats, par: Rows, first: Rows, poses: Rows, state: Rows
) -> None:
    """Close every design of a batch from its own pose.

    tolerance (designs,); par (parameters, designs); first (designs, drivers): value of every
    driver, NaN where its law says it; poses (designs, coordinates): where each begins, and where it
    closed; state (designs, 2): whether it closed by the straight path, and the least pivot as a
    part of its diagonal.
    """
    w = 0.0
    for design in range(par.shape[1]):
        put_column(par, design, W.par, 0)
        for n in range(poses.shape[1]):
            W.q[n, 0] = poses[design, n]
        signals(L, W, w, L.signal_law.shape[0])
        for d in range(L.driver_row.shape[0]):
            if not math.isnan(first[design, d]):
                W.signal[L.driver_row[d], 0] = first[design, d]
        good, _, _ = damped_newton(L, W, w, 0.0, tolerance[design])
        ratio = constraint_conditioning(L, W)
        state[design, 0] = 1.0 if good else 0.0
        state[design, 1] = ratio
        for n in range(poses.shape[1]):
            poses[design, n] = W.q[n, 0]


@njit
def damped_newton(L, W, w, regularization, tolerance):
    """Damped Newton; W.guess keeps the start. Returns (closed, last correction, least pivot)."""
    for n in range(W.q.shape[0]):
        W.guess[n, 0] = W.q[n, 0]
    part, last, least = 1.0, 0.0, 0.0
    smallest = FINITE
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    for iteration in range(STEPS):
        least = factor(L, W, w, regularization, PIVOT_VANISHED)
        size = newton_correction(L, W, w)
        step = motion_norm(L, W, w)
        if not step < LOOP_CLOSURE_DAMPING_LOST:
            return False, step, least
        if step <= tolerance or (step <= 1e3 * tolerance and step >= 0.5 * smallest):
            move(L, W, W.q, W.u, 1.0)
            return True, step, least
        smallest = min(smallest, step)
        if iteration > 0:
            part = min(1.0, part * last / max(size, TINY))
        # no step turns a body by more than half a radian: the straight path is kept
        part = min(part, 0.5 / step) if step > 0.5 else part
        for n in range(W.q.shape[0]):
            W.base[n, 0] = W.q[n, 0]
        for n in range(W.u.shape[0]):
            W.r[n, 0] = W.u[n, 0]
        for n in range(W.factored_block.shape[0]):
            W.factored_block[n] = W.block[n, 0]
        while True:
            ahead = simplified_correction(L, W, w, part)
            if ahead <= (1.0 - 0.25 * part) * size:
                break
            part *= 0.5
            if part < LOOP_CLOSURE_DAMPING_START:
                # near a singular position rounding of Φ alone makes such a correction
                return step <= 1e3 * tolerance, step, least
        last = size
        part = min(1.0, 2.0 * part)
    return False, smallest, least


@njit
def levenberg_marquardt(L, W, w, tolerance):
    """Levenberg–Marquardt on ½|Φ|² from W.q: ends at a closed position or at the smallest gap."""
    body_rotations(L, W, w)
    rows(L, W, w, True, None)
    here, damping = gap(L, W), 1e-2
    for _ in range(4 * STEPS):
        factor(L, W, w, damping, PIVOT_VANISHED)
        newton_correction(L, W, w)
        step = motion_norm(L, W, w)
        part = min(1.0, 0.5 / step) if step > 0.0 else 1.0
        for n in range(W.q.shape[0]):
            W.base[n, 0] = W.q[n, 0]
        move(L, W, W.base, W.u, part)
        body_rotations(L, W, w)
        rows(L, W, w, True, None)
        now = gap(L, W)
        if now < here:
            done = here - now <= LOOP_CLOSURE_DESCENT * here
            here, damping = now, max(0.2 * damping, LOOP_CLOSURE_DESCENT)
            if done or step <= tolerance:
                return
        else:
            for n in range(W.q.shape[0]):
                W.q[n, 0] = W.base[n, 0]
            body_rotations(L, W, w)
            rows(L, W, w, True, None)
            damping *= 5.0
            if damping > LOOP_CLOSURE_DAMPING_LOST:
                return


@kernel
def project(L: Layout, W: Work, regularization: float) -> None:
    """v ← v − W⁻¹Gᵀ S⁻¹ (G v − ν): the nearest velocities that the constraints allow."""
    nearest_velocity(L, W, 0.0, regularization)


@kernel
def project_designs(
    L: Layout, W: Work, par: Rows, poses: Rows, rates: Rows, velocities: Rows, state: Floats
) -> None:
    """The least velocities of every design of a batch, closed at its own pose.

    par (parameters, designs); poses, velocities (designs, coordinates); rates (designs, drivers):
    rate of every driver, NaN where its law says it; state (designs,): by how much they do not agree
    with the drivers, as a part of the requested rates.
    """
    w = 0.0
    for design in range(par.shape[1]):
        put_column(par, design, W.par, 0)
        for n in range(poses.shape[1]):
            W.q[n, 0], W.v[n, 0] = poses[design, n], 0.0
        signals(L, W, w, L.signal_law.shape[0])
        for d in range(L.driver_row.shape[0]):
            if not math.isnan(rates[design, d]):
                W.signal[L.driver_row[d] + 1, 0] = rates[design, d]
        nearest_velocity(L, W, w, 0.0)
        for n in range(velocities.shape[1]):
            velocities[design, n] = W.v[n, 0]
        rows(L, W, w, True, None)
        rates_of_rows(L, W, w)
        rest, requested = 0.0, 0.0
        for n in range(2 * L.nodes):
            unit = W.regularization_weight[n, 0]
            if unit > 0.0:
                rest += (W.x[n, 0] - W.nu[n, 0]) ** 2 / unit
                requested += W.nu[n, 0] ** 2 / unit
        state[design] = math.sqrt(rest / requested) if requested > 0.0 else rest


@njit
def nearest_velocity(L, W, w, regularization):
    """Velocity nearest to the present one that satisfies Φ_q v = ν (`project`)."""
    body_rotations(L, W, w)
    rows(L, W, w, True, True)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    rates_of_rows(L, W, w)
    for n in range(2 * L.nodes):
        st(W.nu, n, W.nu[n, 0] - W.x[n, 0], w)
    least_motion(L, W, w, W.nu, True)
    for b in range(L.bodies):
        for n in range(3):
            W.v[3 * b + n, 0] += W.u[3 * L.body_slot[b] + n, 0]
