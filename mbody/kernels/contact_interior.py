"""Impulses of many contacts by an interior-point method: convergent where sweeps are not.

With the cones of `mbody.kernels.contact_impulses` opened by s, the velocities of a step are the
solution of a convex problem,

    min ½ (u − u_free)ᵀ M (u − u_free),   γ_N + b ± μ γ_T ≥ 0,   G u = G u_free,

in the plane with two straight sides of each cone, whose multipliers z± give P_N = z₊ + z₋ and
P_T = μ (z₊ − z₋). The predictor–corrector method of Mehrotra needs 5 to 25 factorisations of
M + Wᵀ Θ W + Gᵀ Δ⁻¹ G (`mbody.kernels.body_blocks`), whatever the friction, and however undetermined
the impulses are. Rows of joints are as stiff as Δ⁻¹, with multipliers that take what is left.

It begins with the impulses of the step before, moved inside the cones. Nocedal, Wright: Numerical
Optimization (2006), 16.6; Acary, Armand, Nguyen, Shpakovych (2023) for friction in space.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.kernels.body_blocks import add_block, arrange, factor_blocks, put_masses, solve_blocks
from mbody.kernels.contact_geometry import FOUND
from mbody.kernels.contact_rows import onto_cone, press, rates, row, takes_part

__all__ = ["NEEDED", "WAITING", "interior", "keep_pull"]

#: Counts: numbers that the matrix needs; steps for which sweeps are not tried.
NEEDED, WAITING = range(2)
#: Iterations at most, and how many without a better residual end them.
MOST, IDLE = 80, 10
#: Where it begins: part of the greatest impulse, and of what the deepest violation asks for.
INSIDE, VIOLATED = 1e-2, 0.1
#: Part of the way to the next bound that a step goes, at most.
SHORT = 0.995
#: Flexibility of a row of joints, as a part of what its bodies give.
FLEXIBLE = 1e-10


@njit
def interior(W, B, N, tolerance):
    """B.impulse and B.velocity ← the impulses of the step; from the impulses in B.impulse. Returns
    iterations and the residual, as a part of the greatest impulse; −1 where the matrix needs more
    memory, N.count[NEEDED] numbers.
    """
    count = B.counts[FOUND]
    N.count[NEEDED] = arrange(B, N)
    if N.count[NEEDED] > N.matrix.shape[0]:
        return -1, math.inf
    start_inside(W, B, N, count)
    best, idle, done = math.inf, 0, 0
    while True:
        left = residuals(W, B, N, count)
        if left < best:
            best, idle = left, 0
            for c in range(count):
                B.kept[c, 0], B.kept[c, 1] = B.impulse[c, 0], B.impulse[c, 1]
        else:
            idle += 1
        if left <= tolerance or done >= MOST or idle >= IDLE:
            break
        form(W, B, N, count)
        factor_blocks(N)
        gap = complementarity(B, N, count, 0.0)
        if not gap > 0.0:
            break
        direction(W, B, N, count, 0.0, False)
        part = complementarity(B, N, count, longest(B, N, count)) / gap
        direction(W, B, N, count, part * part * part * gap, True)
        advance(W, B, N, count, min(1.0, SHORT * longest(B, N, count)))
        done += 1
    for c in range(count):
        B.impulse[c, 0], B.impulse[c, 1] = B.kept[c, 0], B.kept[c, 1]
    return done, best


@inline
def row_rate(W, N, r, u):
    """G u of a row of joints."""
    x = 0.0
    for n in range(N.row_start[r], N.row_start[r + 1]):
        b, o = 3 * N.row_body[n], N.row_block[n]
        x += W.block[o, 0] * u[b] + W.block[o + 1, 0] * u[b + 1] + W.block[o + 2, 0] * u[b + 2]
    return x


@inline
def press_row(W, N, r, x, f):
    """f ← f + Gᵀ x of a row of joints."""
    for n in range(N.row_start[r], N.row_start[r + 1]):
        b, o = 3 * N.row_body[n], N.row_block[n]
        f[b] += W.block[o, 0] * x
        f[b + 1] += W.block[o + 1, 0] * x
        f[b + 2] += W.block[o + 2, 0] * x


@njit
def start_inside(W, B, N, count):
    """Multipliers and slacks from the impulses of the step before, both positive."""
    u, f = B.velocity, N.step
    for n in range(f.shape[0]):
        f[n] = 0.0
    for c in range(count):
        if takes_part(B, c):
            p, t, mu = B.impulse[c, 0], B.impulse[c, 1], B.effect[c, 3]
            half = 0.5 * t / mu if mu > 0.0 else 0.0
            N.dual[c, 0], N.dual[c, 1] = max(0.5 * p + half, 0.0), max(0.5 * p - half, 0.0)
            press(B, c, p, t, f)
        else:
            B.impulse[c, 0] = B.impulse[c, 1] = 0.0
    for r in range(N.row_start.shape[0] - 1):
        effect = 0.0
        for n in range(N.row_start[r], N.row_start[r + 1]):
            b, o = 3 * N.row_body[n], N.row_block[n]
            for k in range(3):
                effect += B.inverse[b + k] * W.block[o + k, 0] * W.block[o + k, 0]
        N.stiffness[r] = 1.0 / (FLEXIBLE * effect) if effect > 0.0 else 0.0
        N.pull[r] = N.old_pull[r]
        press_row(W, N, r, -N.pull[r], f)
    greatest = 0.0
    for n in range(u.shape[0]):
        u[n] = B.free[n] + B.inverse[n] * f[n]
    for c in range(count):
        if takes_part(B, c):
            normal, along = rates(B, c, u)
            bound, aside = normal + B.effect[c, 4] + B.effect[c, 6], B.effect[c, 3] * along
            N.slack[c, 0], N.slack[c, 1] = bound + aside, bound - aside
            lacking = -min(N.slack[c, 0], N.slack[c, 1]) / B.effect[c, 0]
            most = max(N.dual[c, 0], N.dual[c, 1])
            greatest = max(greatest, INSIDE * most, VIOLATED * lacking)
    for c in range(count):
        for k in range(2):
            N.dual[c, k] = max(N.dual[c, k], greatest)
            N.slack[c, k] = max(N.slack[c, k], greatest * B.effect[c, 0])


@njit
def residuals(W, B, N, count):
    """B.impulse ← the multipliers put onto their cones by the present velocities, N.rest what is
    left of the equation of motion. Returns the greatest change that this was, and of forces, rates
    of joints, as a part of the greatest impulse.
    """
    u, f = B.velocity, N.rest
    bodies = N.place.shape[0]
    for n in range(3 * bodies):
        f[n] = -(u[n] - B.free[n]) / B.inverse[n]
    furthest, greatest = 0.0, 0.0
    for c in range(count):
        if takes_part(B, c):
            p, t = N.dual[c, 0] + N.dual[c, 1], B.effect[c, 3] * (N.dual[c, 0] - N.dual[c, 1])
            x, y = onto_cone(B, c, p, t, u)
            furthest = max(furthest, abs(x - p), abs(y - t))
            greatest = max(greatest, p)
            B.impulse[c, 0], B.impulse[c, 1] = x, y
            press(B, c, p, t, f)
    for r in range(N.row_start.shape[0] - 1):
        press_row(W, N, r, -N.pull[r], f)
        N.rate[r] = row_rate(W, N, r, u) - row_rate(W, N, r, B.free)
        furthest = max(furthest, FLEXIBLE * N.stiffness[r] * abs(N.rate[r]))
    for n in range(3 * bodies):
        unit = 1.0 / W.size[0, 0] if n % 3 == 2 else 1.0
        furthest = max(furthest, unit * abs(f[n]))
    return furthest / greatest if greatest > 0.0 else 0.0


@njit
def form(W, B, N, count):
    """The matrix of the present multipliers and slacks."""
    bodies = N.place.shape[0]
    put_masses(B, N)
    for c in range(count):
        if not takes_part(B, c):
            continue
        i, j, mu = B.who[c, 0], B.who[c, 1], B.effect[c, 3]
        up, down = N.dual[c, 0] / N.slack[c, 0], N.dual[c, 1] / N.slack[c, 1]
        nn, nt, tt = up + down, mu * (up - down), mu * mu * (up + down)
        a = row(B, c, 0, 0, False), row(B, c, 0, 1, False), row(B, c, 0, 2, False)
        b = row(B, c, 1, 0, False), row(B, c, 1, 1, False), row(B, c, 1, 2, False)
        x = row(B, c, 0, 0, True), row(B, c, 0, 1, True), row(B, c, 0, 2, True)
        y = row(B, c, 1, 0, True), row(B, c, 1, 1, True), row(B, c, 1, 2, True)
        p = nn * a[0] + nt * x[0], nn * a[1] + nt * x[1], nn * a[2] + nt * x[2]
        q = nt * a[0] + tt * x[0], nt * a[1] + tt * x[1], nt * a[2] + tt * x[2]
        if i < bodies:
            add_block(N, i, i, p, a)
            add_block(N, i, i, q, x)
        if i < bodies and j < bodies and i != j:
            # only one of both is below the diagonal
            add_block(N, i, j, p, b)
            add_block(N, i, j, q, y)
            add_block(N, j, i, b, p)
            add_block(N, j, i, y, q)
        if j < bodies:
            p = nn * b[0] + nt * y[0], nn * b[1] + nt * y[1], nn * b[2] + nt * y[2]
            q = nt * b[0] + tt * y[0], nt * b[1] + tt * y[1], nt * b[2] + tt * y[2]
            add_block(N, j, j, p, b)
            add_block(N, j, j, q, y)
    for r in range(N.row_start.shape[0] - 1):
        k = N.stiffness[r]
        for n in range(N.row_start[r], N.row_start[r + 1]):
            o = N.row_block[n]
            x = k * W.block[o, 0], k * W.block[o + 1, 0], k * W.block[o + 2, 0]
            for m in range(N.row_start[r], N.row_start[r + 1]):
                o = N.row_block[m]
                y = W.block[o, 0], W.block[o + 1, 0], W.block[o + 2, 0]
                add_block(N, N.row_body[n], N.row_body[m], x, y)


@njit
def direction(W, B, N, count, aim, corrected):
    """N.step and the steps of multipliers and slacks towards products z a of `aim`; `corrected` by
    the product of the steps before.
    """
    u, f = B.velocity, N.step
    for n in range(f.shape[0]):
        f[n] = N.rest[n]
    for c in range(count):
        if not takes_part(B, c):
            continue
        mu = B.effect[c, 3]
        normal, along = rates(B, c, u)
        bound = normal + B.effect[c, 4] + B.effect[c, 6]
        for k in range(2):
            z, a = N.dual[c, k], N.slack[c, k]
            N.target[c, k] = aim - z * a
            if corrected:
                N.target[c, k] -= N.dual_step[c, k] * N.slack_step[c, k]
            N.lack[c, k] = bound + (mu * along if k == 0 else -mu * along) - a
        up = (N.target[c, 0] - N.dual[c, 0] * N.lack[c, 0]) / N.slack[c, 0]
        down = (N.target[c, 1] - N.dual[c, 1] * N.lack[c, 1]) / N.slack[c, 1]
        press(B, c, up + down, mu * (up - down), f)
    for r in range(N.row_start.shape[0] - 1):
        press_row(W, N, r, -N.stiffness[r] * N.rate[r], f)
    solve_blocks(N, f)
    for n in range(3 * N.place.shape[0], f.shape[0]):
        f[n] = 0.0
    for c in range(count):
        if not takes_part(B, c):
            continue
        normal, along = rates(B, c, f)
        for k in range(2):
            aside = B.effect[c, 3] * along if k == 0 else -B.effect[c, 3] * along
            N.slack_step[c, k] = normal + aside + N.lack[c, k]
            change = N.target[c, k] - N.dual[c, k] * N.slack_step[c, k]
            N.dual_step[c, k] = change / N.slack[c, k]


@njit
def longest(B, N, count):
    """Part of the step at which the first multiplier or slack vanishes, 1 at most."""
    part = 1.0
    for c in range(count):
        if takes_part(B, c):
            for k in range(2):
                if N.dual_step[c, k] < -N.dual[c, k]:
                    part = min(part, -N.dual[c, k] / N.dual_step[c, k])
                if N.slack_step[c, k] < -N.slack[c, k]:
                    part = min(part, -N.slack[c, k] / N.slack_step[c, k])
    return part


@njit
def complementarity(B, N, count, part):
    """The mean of z a, after a part of the step."""
    total, m = 0.0, 0
    for c in range(count):
        if takes_part(B, c):
            for k in range(2):
                z = N.dual[c, k] + (part * N.dual_step[c, k] if part > 0.0 else 0.0)
                a = N.slack[c, k] + (part * N.slack_step[c, k] if part > 0.0 else 0.0)
                total += z * a
                m += 1
    return total / m if m > 0 else 0.0


@njit
def advance(W, B, N, count, part):
    """Go that part of the step."""
    for c in range(count):
        if takes_part(B, c):
            for k in range(2):
                N.dual[c, k] += part * N.dual_step[c, k]
                N.slack[c, k] += part * N.slack_step[c, k]
    for n in range(3 * N.place.shape[0]):
        B.velocity[n] += part * N.step[n]
    for r in range(N.row_start.shape[0] - 1):
        N.pull[r] += part * N.stiffness[r] * (N.rate[r] + row_rate(W, N, r, N.step))


@njit
def keep_pull(N, part):
    """Begin the next step with this part of what joints took of the impulses of contacts."""
    for r in range(N.pull.shape[0]):
        N.old_pull[r] = part * N.pull[r]
