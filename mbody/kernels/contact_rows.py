"""Contacts of a step as rows: relative velocities γ = W v, what impulses change, and their bounds.

Of free bodies an impulse changes velocities by Y = M⁻¹ Wᵀ; of bodies that joints tie, by M⁻¹ Wᵀ
less what the joints take of it, M⁻¹ Gᵀ S⁻¹ G M⁻¹ Wᵀ, one solve a column by the factor of the step.
These columns are made of few contacts; of many, which an interior-point method solves with the rows
of joints, the own masses serve as a measure (`mbody.kernels.contact_interior`).
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.kernels.contact_geometry import FOUND
from mbody.kernels.position_velocity import clear, weigh
from mbody.kernels.schur_ldl import apply_g, apply_gt, solve

__all__ = [
    "any_tied",
    "apply",
    "apply_all",
    "contact_rows",
    "onto_cone",
    "press",
    "rates",
    "row",
    "takes_part",
]

#: Part of the velocities without contacts below which a contact sticks at the beginning of a step.
STUCK = 1e-6
#: What arrives slower than so often what the loads of one step give stays closed: steps do not
#: resolve its rebounds.
REBOUND = 2.0


@inline
def rates(B, c, u):
    """(γ_N, γ_T) of contact c by the velocities u."""
    i, j, g = 3 * B.who[c, 0], 3 * B.who[c, 1], B.geometry
    nx, ny = g[c, 0], g[c, 1]
    dx = u[j] - u[j + 2] * g[c, 5] - u[i] + u[i + 2] * g[c, 3]
    dy = u[j + 1] + u[j + 2] * g[c, 4] - u[i + 1] - u[i + 2] * g[c, 2]
    return nx * dx + ny * dy, ny * dx - nx * dy


@inline
def row(B, c, side, n, tangent):
    """Number n of the row of contact c in the columns of body i (side 0) or j: a unit impulse."""
    g = B.geometry
    dx, dy = (g[c, 1], -g[c, 0]) if tangent else (g[c, 0], g[c, 1])
    sign = 1.0 if side == 1 else -1.0
    if n == 0:
        return sign * dx
    if n == 1:
        return sign * dy
    return sign * (g[c, 2 + 2 * side] * dy - g[c, 3 + 2 * side] * dx)


@inline
def takes_part(B, c):
    """Whether a contact may press at all."""
    return B.effect[c, 4] < math.inf and B.effect[c, 0] > 0.0


@inline
def onto_cone(B, c, p, t, u):
    """(P_N, P_T) of contact c by its own effect and the velocities u, on its cone."""
    nn, tt, mu = B.effect[c, 0], B.effect[c, 2], B.effect[c, 3]
    normal, along = rates(B, c, u)
    x = p - (normal + B.effect[c, 4] + B.effect[c, 6]) / nn
    if tt > 0.0:
        # in the measure in which both directions have the same effect
        scale = math.sqrt(tt / nn)
        y, width = (t - along / tt) * scale, mu * scale
    else:
        scale, y, width = 1.0, 0.0, 0.0
    if width * abs(y) <= -x:
        x, y = 0.0, 0.0
    elif abs(y) > width * x:
        x = (width * abs(y) + x) / (1.0 + width * width)
        y = width * x if y > 0.0 else -width * x
    return x, y / scale


@inline
def press(B, c, p, t, f):
    """f ← f + Wᵀ (p, t) of contact c; f has three more numbers for the ground."""
    g, i, j = B.geometry, 3 * B.who[c, 0], 3 * B.who[c, 1]
    fx, fy = p * g[c, 0] + t * g[c, 1], p * g[c, 1] - t * g[c, 0]
    f[i] -= fx
    f[i + 1] -= fy
    f[i + 2] -= g[c, 2] * fy - g[c, 3] * fx
    f[j] += fx
    f[j + 1] += fy
    f[j + 2] += g[c, 4] * fy - g[c, 5] * fx


@njit
def apply(B, c, p, t, u):
    """u ← u + Y (p, t) of contact c."""
    k = B.column[c]
    for side in range(2):
        b = B.who[c, side]
        if k >= 0 and B.is_coupled[b]:
            continue
        for n in range(3):
            change = row(B, c, side, n, False) * p + row(B, c, side, n, True) * t
            u[3 * b + n] += B.inverse[3 * b + n] * change
    if k >= 0:
        Y = B.response
        for m in range(B.coupled.shape[0]):
            u[B.coupled[m]] += Y[2 * k, m] * p + Y[2 * k + 1, m] * t


@njit
def apply_all(B):
    """B.velocity ← the velocities without contacts and what all impulses change."""
    for n in range(B.velocity.shape[0]):
        B.velocity[n] = B.free[n]
    for c in range(B.counts[FOUND]):
        if B.impulse[c, 0] != 0.0 or B.impulse[c, 1] != 0.0:
            apply(B, c, B.impulse[c, 0], B.impulse[c, 1], B.velocity)


@inline
def is_tied(B, c):
    """Whether joints tie a body of a contact."""
    return B.is_coupled[B.who[c, 0]] or B.is_coupled[B.who[c, 1]]


@njit
def any_tied(B):
    """Whether joints tie a body of any contact."""
    found = False
    for c in range(B.counts[FOUND]):
        found = found or is_tied(B, c)
    return found


@njit
def contact_rows(L, W, C, B, h, refinements):
    """Effects and bounds of all contacts, and columns unless `refinements` is negative; returns
    False where columns have no room.

    B.start holds the velocities at the beginning, B.free those without contacts.
    """
    count, columns = B.counts[FOUND], 0
    for c in range(count):
        B.column[c] = -1
        if refinements >= 0 and is_tied(B, c):
            if 2 * columns + 2 > B.response.shape[0]:
                return False
            B.column[c] = columns
            for tangent in range(2):
                respond(L, W, B, c, tangent == 1, refinements)
            columns += 1
        effects(B, c)
        gap, law = B.geometry[c, 6], B.who[c, 2]
        normal, along = rates(B, c, B.start)
        B.rate[c, 0], B.rate[c, 1] = normal, along
        free_normal, free_along = rates(B, c, B.free)
        e = C.law[law, 2]
        if e > 0.0 and -normal > REBOUND * abs(free_normal - normal):
            # it rebounds as it arrives, and is open before
            B.effect[c, 4] = e * normal if gap <= 0.0 else math.inf
        else:
            B.effect[c, 4] = max(gap, 0.0) / h
        still = abs(along) <= STUCK * (abs(free_normal) + abs(free_along))
        B.effect[c, 6] = 0.0 if still else C.law[law, 0] * abs(along)
        B.effect[c, 3] = C.law[law, 1] if still else C.law[law, 0]
    return True


@njit
def respond(L, W, B, c, tangent, refinements):
    """One column of the response: velocities of what joints tie by a unit impulse of contact c."""
    w = 0.0
    clear(W.u, w)
    for side in range(2):
        b = B.who[c, side]
        if B.is_coupled[b]:
            for s in range(L.slots):
                if L.slot_body[s] == b:
                    for n in range(3):
                        x = B.inverse[3 * b + n] * row(B, c, side, n, tangent)
                        W.u[3 * s + n, 0] += x
    for _ in range(1 + refinements):
        apply_g(L, W, w, W.u, W.x)
        solve(L, W, w)
        clear(W.r, w)
        apply_gt(L, W, w, W.x, W.r)
        weigh(L, W, w, W.r)
        for n in range(W.u.shape[0]):
            W.u[n, 0] -= W.r[n, 0]
    k = 2 * B.column[c] + (1 if tangent else 0)
    for m in range(B.coupled.shape[0]):
        b, n = B.coupled[m] // 3, B.coupled[m] % 3
        B.response[k, m] = W.u[3 * L.body_slot[b] + n, 0]


@njit
def effects(B, c):
    """D_NN, D_NT and D_TT of a contact by itself: W Y."""
    nn, nt, tt = 0.0, 0.0, 0.0
    k = B.column[c]
    for side in range(2):
        b = B.who[c, side]
        if k >= 0 and B.is_coupled[b]:
            continue
        for n in range(3):
            x, y = row(B, c, side, n, False), row(B, c, side, n, True)
            inverse = B.inverse[3 * b + n]
            nn += inverse * x * x
            nt += inverse * x * y
            tt += inverse * y * y
    if k >= 0:
        for m in range(B.coupled.shape[0]):
            b, n = B.coupled[m] // 3, B.coupled[m] % 3
            for side in range(2):
                if B.who[c, side] == b:
                    x, y = row(B, c, side, n, False), row(B, c, side, n, True)
                    nn += x * B.response[2 * k, m]
                    nt += y * B.response[2 * k, m]
                    tt += y * B.response[2 * k + 1, m]
    B.effect[c, 0], B.effect[c, 1], B.effect[c, 2] = nn, nt, tt
