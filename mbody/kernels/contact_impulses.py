"""Impulses of all contacts of a step: Coulomb's cones and complementarity, by Gauss–Seidel.

With γ = W v the relative velocities (γ_N, γ_T) of the contacts and u the velocities that impulses
change, the problem of a step is

    γ_N⁺ ≥ b ⊥ P_N ≥ 0,   |P_T| ≤ μ P_N, against γ_T⁺ where it slides,   u⁺ = u + Y P,

with Y = M⁻¹ Wᵀ of free bodies; of bodies that joints tie, M⁻¹ Wᵀ less what the joints take of it,
M⁻¹ Gᵀ S⁻¹ G M⁻¹ Wᵀ, one solve a column by the factor of the step. The same as a problem on the cone
K of |P_T| ≤ μ P_N, after de Saxcé:

    K ∋ P ⊥ (γ_N⁺ − b + s, γ_T⁺) ∈ K*,   s = μ |γ_T⁺|.

Sweeps go over the contacts to and fro, one after the other, each with the velocities that the
others have changed, and put its impulse onto its cone; they begin with the impulses of the step
before. At
first s is that of the beginning of the step: the problem is then convex, and contacts that stick
have it exactly. Then s follows: of few contacts until it stays, of many three times, for what is
left of it is an error of order one as all of the step; within each sweep it would not converge.
Between sweeps the change is extrapolated by the nonlinear conjugate
gradients of Silcowitz, Niebe, Erleben (2010), begun anew where it grows: projection row by row onto
μ P_N, without the cone, wanders among the many solutions of a pile and does not converge.

Positions are corrected by a problem of the same kind in the normals alone, which changes no
velocity. Jean: The non-smooth contact dynamics method (1999).
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.kernels.contact_geometry import FOUND
from mbody.kernels.position_velocity import clear, weigh
from mbody.kernels.schur_ldl import apply_g, apply_gt, solve

__all__ = ["apply_all", "contact_rows", "correct_positions", "rates", "solve_impulses"]

#: Part of the velocities without contacts below which a contact sticks at the beginning of a step.
STUCK = 1e-6
#: What arrives slower than so often what the loads of one step give stays closed: steps do not
#: resolve its rebounds.
REBOUND = 2.0
#: Positions: overlap in parts of the size that is left alone, the part of the rest that one step
#: takes away, and sweeps.
LEFT_ALONE, CORRECTED, SWEEPS = 1e-6, 0.2, 30
#: Sweeps after which velocities are computed anew from the impulses.
RENEWED = 50
#: How often s follows the sliding of many contacts, and the part of its change to which sweeps go
#: then.
FOLLOWED, PART = 3, 0.1
#: After so many times s goes half the way, then a third, and so on: it may jump to and fro.
DAMPED = 6
#: Part of its limit below which friction holds a contact.
INSIDE = 1.0 - 1e-6


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


@njit
def apply(B, c, p, t, u):
    """u ← u + Y (p, t) of contact c."""
    for side in range(2):
        b = B.who[c, side]
        if B.is_coupled[b]:
            continue
        for n in range(3):
            change = row(B, c, side, n, False) * p + row(B, c, side, n, True) * t
            u[3 * b + n] += B.inverse[3 * b + n] * change
    k = B.column[c]
    if k >= 0:
        Y = B.response
        for m in range(B.coupled.shape[0]):
            u[B.coupled[m]] += Y[2 * k, m] * p + Y[2 * k + 1, m] * t


@njit
def contact_rows(L, W, C, B, h, refinements):
    """Columns, effects and bounds of all contacts; returns False where columns have no room.

    B.start holds the velocities at the beginning, B.free those without contacts.
    """
    count, columns = B.counts[FOUND], 0
    for c in range(count):
        B.column[c] = -1
        if B.is_coupled[B.who[c, 0]] or B.is_coupled[B.who[c, 1]]:
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
    for side in range(2):
        b = B.who[c, side]
        if B.is_coupled[b]:
            continue
        for n in range(3):
            x, y = row(B, c, side, n, False), row(B, c, side, n, True)
            inverse = B.inverse[3 * b + n]
            nn += inverse * x * x
            nt += inverse * x * y
            tt += inverse * y * y
    k = B.column[c]
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


@njit
def apply_all(B):
    """B.velocity ← the velocities without contacts and what all impulses change."""
    for n in range(B.velocity.shape[0]):
        B.velocity[n] = B.free[n]
    for c in range(B.counts[FOUND]):
        if B.impulse[c, 0] != 0.0 or B.impulse[c, 1] != 0.0:
            apply(B, c, B.impulse[c, 0], B.impulse[c, 1], B.velocity)


@njit
def solve_impulses(B, tolerance, most, few):
    """B.impulse and B.velocity ← the impulses of the step. Returns the sweeps that it took, and the
    last change as a part of the greatest impulse; of up to `few` contacts also what the present
    sliding would change.
    """
    count = B.counts[FOUND]
    if count == 0:
        apply_all(B)
        return 0, 0.0
    for c in range(count):  # within the cones, which the coefficient may have made narrower
        bound = B.effect[c, 3] * B.impulse[c, 0]
        B.impulse[c, 1] = min(max(B.impulse[c, 1], -bound), bound)
        if B.effect[c, 4] == math.inf:
            B.impulse[c, 0] = B.impulse[c, 1] = 0.0
    apply_all(B)
    wanted, again = tolerance, 0
    done = relax(B, count, tolerance, most - most // 4)
    while True:
        change, opened = B.progress[0], follow_sliding(B, count, 1.0 / (1 + again // DAMPED))
        exact = max(change, opened)
        if exact <= tolerance:
            return done, exact
        # what is not solved for these cones says nothing of the next ones
        if change > wanted or done >= most or (count > few and again >= FOLLOWED):
            return done, exact if count <= few else change
        wanted, again = max(tolerance, PART * opened), again + 1
        done += relax(B, count, wanted, most - done)


@njit
def relax(B, count, tolerance, most):
    """Sweeps to and fro, at most so many, until impulses change by no more than that part of the
    greatest one, which B.progress becomes; the cones stay as they are opened. Returns how many.
    """
    for c in range(count):
        B.ahead[c, 0] = B.ahead[c, 1] = 0.0
    done, before, change = 0, 0.0, 1.0
    while True:
        for c in range(count):
            B.kept[c, 0], B.kept[c, 1] = B.impulse[c, 0], B.impulse[c, 1]
        sweep(B, count, False)
        sweep(B, count, True)
        done += 2
        greatest, furthest, square = 0.0, 0.0, 0.0
        for c in range(count):
            x, y = B.impulse[c, 0] - B.kept[c, 0], B.impulse[c, 1] - B.kept[c, 1]
            square += x * x + y * y
            furthest = max(furthest, abs(x), abs(y))
            greatest = max(greatest, B.impulse[c, 0])
        change = furthest / greatest if greatest > 0.0 else 0.0
        B.progress[0], B.progress[1] = change, greatest
        if change <= tolerance or done >= most:
            return done
        if done % RENEWED == 0:
            apply_all(B)  # rounding of velocities that were changed so often
        part = square / before if before > 0.0 else 0.0
        extrapolate(B, count, part)
        before = square


@njit
def follow_sliding(B, count, part):
    """Open the cones by the present sliding, or go that part of the way. Returns the greatest
    change of what that asks of an impulse, as a part of the greatest one.
    """
    furthest = 0.0
    for c in range(count):
        if B.effect[c, 4] < math.inf and B.effect[c, 0] > 0.0:
            normal, along = rates(B, c, B.velocity)
            opening = B.effect[c, 3] * abs(along)
            if abs(B.impulse[c, 1]) < INSIDE * B.effect[c, 3] * B.impulse[c, 0]:
                opening = 0.0  # it sticks: what is left of its rate is what is not solved
            if B.impulse[c, 0] > 0.0 or normal + B.effect[c, 4] < 0.0:
                furthest = max(furthest, abs(opening - B.effect[c, 6]) / B.effect[c, 0])
            B.effect[c, 6] += part * (opening - B.effect[c, 6])
    return furthest / B.progress[1] if B.progress[1] > 0.0 else 0.0


@njit
def sweep(B, count, backward):
    """One pass over all contacts: each impulse onto its cone, by its own effect."""
    u = B.velocity
    for n in range(count):
        c = count - 1 - n if backward else n
        bound, nn, tt = B.effect[c, 4], B.effect[c, 0], B.effect[c, 2]
        if bound == math.inf or not nn > 0.0:
            continue
        p, t = B.impulse[c, 0], B.impulse[c, 1]
        normal, along = rates(B, c, u)
        mu = B.effect[c, 3]
        x = p - (normal + bound + B.effect[c, 6]) / nn
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
        y /= scale
        if x != p or y != t:
            apply(B, c, x - p, y - t, u)
            B.impulse[c, 0], B.impulse[c, 1] = x, y


@njit
def extrapolate(B, count, part):
    """Go on along `part` of the direction before the last change, and add this to it; where changes
    grow, begin with no direction.
    """
    for c in range(count):
        if part > 1.0:
            B.ahead[c, 0] = B.ahead[c, 1] = 0.0
            continue
        x, y = B.impulse[c, 0] - B.kept[c, 0], B.impulse[c, 1] - B.kept[c, 1]
        ahead, aside = part * B.ahead[c, 0], part * B.ahead[c, 1]
        B.ahead[c, 0], B.ahead[c, 1] = ahead + x, aside + y
        if ahead != 0.0 or aside != 0.0:
            B.impulse[c, 0] += ahead
            B.impulse[c, 1] += aside
            apply(B, c, ahead, aside, B.velocity)


@njit
def correct_positions(W, B, h, shift):
    """shift (coordinates + 3,) ← the motion that takes away a part of the overlap which is beyond
    rounding and would be there after the next step too; B.velocity holds the velocities at the end
    of this one, of length h. Returns whether there is any.
    """
    count, any_deep = B.counts[FOUND], False
    for n in range(shift.shape[0]):
        shift[n] = 0.0
    for c in range(count):
        normal, _ = rates(B, c, B.velocity)
        size = B.geometry[c, 7]
        if not size < math.inf:
            size = W.size[0, 0]
        deep = -(B.geometry[c, 6] + 1.5 * h * normal) - LEFT_ALONE * size
        B.shift[c] = 0.0
        # what is open may close by as much as it is open
        B.effect[c, 5] = -(CORRECTED if deep > 0.0 else 1.0) * deep
        any_deep = any_deep or deep > 0.0
    if not any_deep:
        return False
    for n in range(SWEEPS):
        for m in range(count):
            c = count - 1 - m if n % 2 == 1 else m
            if not B.effect[c, 0] > 0.0:
                continue
            normal, _ = rates(B, c, shift)
            p = max(0.0, B.shift[c] - (normal + B.effect[c, 5]) / B.effect[c, 0])
            if p != B.shift[c]:
                apply(B, c, p - B.shift[c], 0.0, shift)
                B.shift[c] = p
    return True
