"""Impulses of all contacts of a step: Coulomb's cones and complementarity.

With γ = W v the relative velocities (γ_N, γ_T) of the contacts and u the velocities that impulses
change, the problem of a step is

    γ_N⁺ + b ≥ 0 ⊥ P_N ≥ 0,   |P_T| ≤ μ P_N, against γ_T⁺ where it slides,   u⁺ = u + Y P,

the same as a problem on the cone K of |P_T| ≤ μ P_N, after de Saxcé:

    K ∋ P ⊥ (γ_N⁺ + b + s, γ_T⁺) ∈ K*,   s = μ |γ_T⁺|.

With s of the beginning of the step it is convex, and all of Coulomb's law holds but this: a contact
that slides comes nearer, or leaves, by what the sliding changed in the step. Of few contacts s
follows the sliding until it stays, of many only where that would be more than a small part of their
size in this step, which the next one takes back: within each sweep it would not converge.

Sweeps of Gauss and Seidel go over the contacts to and fro, one after the other, each with the
velocities that the others have changed, and put its impulse onto its cone; they begin with the
impulses of the step before. Between sweeps the change is extrapolated by the nonlinear conjugate
gradients of Silcowitz, Niebe, Erleben (2010), begun anew where it grows. In piles that friction
holds, and where heavy bodies lie on light ones, they do not converge; then, and where joints tie
bodies of contacts, the interior-point method solves the step.

Impulses are found where a change is small beside the greatest of them, and what it changes in rates
of contacts beside what loads and impacts ask for: of heavy bodies on light ones the first alone
would say little.

Positions are corrected by a problem of the same kind in the normals alone, which changes no
velocity. Jean: The non-smooth contact dynamics method (1999).
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.core.tolerances import (
    CONTACT_OVERLAP_CORRECTED,
    CONTACT_OVERLAP_ENOUGH,
    CONTACT_OVERLAP_LEFT,
    CONTACT_RATE_ROUNDING,
    CONTACT_RATES_LOOSER,
    CONTACT_REBOUND,
    CONTACT_ROW_FLEXIBLE,
    CONTACT_SLIDING_SLACK,
    CONTACT_STICKS_BEGINNING,
    FRICTION_STICKS,
    INTERIOR_POINT_START,
    INTERIOR_POINT_STEP,
    INTERIOR_POINT_VIOLATED,
    PIVOT_VANISHED,
)
from mbody.kernels.contact_geometry import (
    APART,
    BOUND,
    CHANGE,
    FOUND,
    MU,
    NN,
    OPENING,
    PART,
    RATE,
    SPEED,
    TT,
)

# -- Contacts of a step as rows: γ = W v, and the bounds of impulses ---------------------------
#
# An impulse changes the velocities of its bodies by Y = M⁻¹ Wᵀ. What joints take of it is a matter
# of the interior-point method, to which own masses serve as a measure.


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
    return B.effect[c, BOUND] < math.inf and B.effect[c, NN] > 0.0


@inline
def onto_cone(B, c, p, t, u):
    """(P_N, P_T) of contact c by its own effect and the velocities u, on its cone."""
    nn, tt, mu = B.effect[c, NN], B.effect[c, TT], B.effect[c, MU]
    normal, along = rates(B, c, u)
    x = p - (normal + B.effect[c, BOUND] + B.effect[c, OPENING]) / nn
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


@inline
def apply(B, c, p, t, u):
    """u ← u + Y (p, t) of contact c."""
    g, i, j, m = B.geometry, 3 * B.who[c, 0], 3 * B.who[c, 1], B.inverse
    fx, fy = p * g[c, 0] + t * g[c, 1], p * g[c, 1] - t * g[c, 0]
    u[i] -= m[i] * fx
    u[i + 1] -= m[i + 1] * fy
    u[i + 2] -= m[i + 2] * (g[c, 2] * fy - g[c, 3] * fx)
    u[j] += m[j] * fx
    u[j + 1] += m[j + 1] * fy
    u[j + 2] += m[j + 2] * (g[c, 4] * fy - g[c, 5] * fx)


@njit
def apply_all(B):
    """B.velocity ← the velocities without contacts and what all impulses change."""
    for n in range(B.velocity.shape[0]):
        B.velocity[n] = B.free[n]
    for c in range(B.counts[FOUND]):
        if B.impulse[c, 0] != 0.0 or B.impulse[c, 1] != 0.0:
            apply(B, c, B.impulse[c, 0], B.impulse[c, 1], B.velocity)


@njit
def any_tied(B):
    """Whether joints tie a body of any contact."""
    found = False
    for c in range(B.counts[FOUND]):
        found = found or B.is_tied[B.who[c, 0]] or B.is_tied[B.who[c, 1]]
    return found


@njit
def contact_rows(C, B, h):
    """Effects and bounds of all contacts; B.start holds the velocities at the beginning, B.free
    those without contacts.
    """
    B.progress[RATE] = B.progress[SPEED] = 0.0
    for c in range(B.counts[FOUND]):
        nn, tt = 0.0, 0.0
        for side in range(2):
            for n in range(3):
                x, y = row(B, c, side, n, False), row(B, c, side, n, True)
                inverse = B.inverse[3 * B.who[c, side] + n]
                nn += inverse * x * x
                tt += inverse * y * y
        B.effect[c, NN], B.effect[c, TT] = nn, tt
        gap, law = B.geometry[c, 6], B.who[c, 2]
        normal, along = rates(B, c, B.start)
        free_normal, free_along = rates(B, c, B.free)
        B.rate[c, 0], B.rate[c, 1] = normal, along
        e = C.law[law, 2]
        if e > 0.0 and -normal > CONTACT_REBOUND * abs(free_normal - normal):
            # it rebounds as it arrives, and is open before
            B.effect[c, BOUND] = e * normal if gap <= 0.0 else math.inf
        else:
            B.effect[c, BOUND] = max(gap, 0.0) / h
        asked = max(abs(free_normal - normal), abs(free_along - along))
        asked = max(asked, -free_normal - B.effect[c, BOUND])
        B.progress[RATE] = max(B.progress[RATE], asked)
        B.progress[SPEED] = max(B.progress[SPEED], abs(free_normal), abs(free_along))
        still = abs(along) <= CONTACT_STICKS_BEGINNING * (abs(free_normal) + abs(free_along))
        B.effect[c, OPENING] = 0.0 if still else C.law[law, 0] * abs(along)
        B.effect[c, MU] = C.law[law, 1] if still else C.law[law, 0]


@inline
def part_of(B, rate, impulse, greatest):
    """A change of rates of contacts as a part of the greatest that loads and impacts ask for; of
    impulses as a part of the greatest one where that is larger, but for a limit.
    """
    if rate <= CONTACT_RATE_ROUNDING * B.progress[SPEED]:
        return 0.0
    part = rate / B.progress[RATE] if B.progress[RATE] > 0.0 else 1.0
    if greatest > 0.0:
        part = min(part, max(impulse / greatest, part / CONTACT_RATES_LOOSER))
    return part


# -- Symmetric positive matrices in blocks of 3×3, one a pair of bodies that touch or are tied -
#
# H = M + Wᵀ Θ W + Gᵀ Δ⁻¹ G has the pattern of what touches what. Bodies are numbered breadth first
# from the end of a longest path through it, and backward (Cuthill, McKee; George): then row p
# reaches from its first body on to the diagonal, and H = L Lᵀ fills nothing else. A row block p has
# three rows of 3 (p − first + 1) numbers one after the other, so that products run along them.


@njit
def arrange(B, N):
    """Number the bodies by the contacts of the step and the joints; returns how many numbers the
    matrix has.
    """
    bodies = N.place.shape[0]
    start = N.start
    for b in range(bodies + 1):
        start[b] = 0
    for c in range(B.counts[FOUND]):
        i, j = B.who[c, 0], B.who[c, 1]
        if i < bodies and j < bodies and i != j:
            start[i + 1] += 1
            start[j + 1] += 1
    for n in range(N.tied.shape[0]):
        start[N.tied[n, 0] + 1] += 1
        start[N.tied[n, 1] + 1] += 1
    for b in range(bodies):
        start[b + 1] += start[b]
        N.place[b] = start[b]
    for c in range(B.counts[FOUND]):
        i, j = B.who[c, 0], B.who[c, 1]
        if i < bodies and j < bodies and i != j:
            join(N, i, j)
    for n in range(N.tied.shape[0]):
        join(N, N.tied[n, 0], N.tied[n, 1])
    return number_bodies(N)


@inline
def join(N, i, j):
    """Bodies i and j as neighbours of each other; `place` is where the next one is written."""
    N.neighbour[N.place[i]] = j
    N.place[i] += 1
    N.neighbour[N.place[j]] = i
    N.place[j] += 1


@njit
def number_bodies(N):
    """N.place of every body, and the first body and the offset of every row."""
    bodies = N.place.shape[0]
    for b in range(bodies):
        N.place[b] = -1
    done = 0
    for b in range(bodies):
        if N.place[b] >= 0:
            continue
        met = breadth_first(N, b, done)
        far = N.order[met - 1]
        for n in range(done, met):
            N.place[N.order[n]] = -1
        done = breadth_first(N, far, done)
    for n in range(bodies):
        N.place[N.order[n]] = bodies - 1 - n
    offset = 0
    for n in range(bodies):
        b = N.order[bodies - 1 - n]
        least = n
        for k in range(N.start[b], N.start[b + 1]):
            least = min(least, N.place[N.neighbour[k]])
        N.first[n], N.offset[n] = least, offset
        offset += 9 * (n - least + 1)
    N.offset[bodies] = offset
    return offset


@njit
def breadth_first(N, root, done):
    """N.order from `done` on ← the bodies that are connected with one; returns where they end."""
    N.order[done] = root
    N.place[root] = done
    end, n = done + 1, done
    while n < end:
        b = N.order[n]
        for k in range(N.start[b], N.start[b + 1]):
            other = N.neighbour[k]
            if N.place[other] < 0:
                N.place[other] = end
                N.order[end] = other
                end += 1
        n += 1
    return end


@njit
def put_masses(B, N):
    """The matrix ← masses alone."""
    for n in range(N.offset[N.place.shape[0]]):
        N.matrix[n] = 0.0
    for b in range(N.place.shape[0]):
        for n in range(3):
            N.matrix[diagonal_of(N, N.place[b]) + n * (width_of(N, N.place[b]) + 1)] = (
                1.0 / B.inverse[3 * b + n]
            )


@inline
def width_of(N, p):
    """Numbers in a row of row block p."""
    return 3 * (p - N.first[p] + 1)


@inline
def diagonal_of(N, p):
    """Where the diagonal block of row block p begins."""
    return N.offset[p] + width_of(N, p) - 3


@inline
def add_block(N, i, j, x, y):
    """Add the block x yᵀ of bodies i and j, three numbers each; only what is on or below the
    diagonal is kept.
    """
    p, q = N.place[i], N.place[j]
    if p >= q:
        o, w = N.offset[p] + 3 * (q - N.first[p]), width_of(N, p)
        N.matrix[o] += x[0] * y[0]
        N.matrix[o + 1] += x[0] * y[1]
        N.matrix[o + 2] += x[0] * y[2]
        N.matrix[o + w] += x[1] * y[0]
        N.matrix[o + w + 1] += x[1] * y[1]
        N.matrix[o + w + 2] += x[1] * y[2]
        N.matrix[o + 2 * w] += x[2] * y[0]
        N.matrix[o + 2 * w + 1] += x[2] * y[1]
        N.matrix[o + 2 * w + 2] += x[2] * y[2]


@njit
def factor_blocks(N):
    """The matrix ← L, with the inverses of its diagonal; returns whether it is positive."""
    A, good = N.matrix, True
    for p in range(N.place.shape[0]):
        start, width = N.first[p], width_of(N, p)
        row = N.offset[p]
        for q in range(start, p + 1):
            other, far = N.first[q], width_of(N, q)
            low = max(start, other)
            a, b, o = (
                row + 3 * (low - start),
                N.offset[q] + 3 * (low - other),
                row + 3 * (q - start),
            )
            s00, s01, s02 = A[o], A[o + 1], A[o + 2]
            s10, s11, s12 = A[o + width], A[o + width + 1], A[o + width + 2]
            s20, s21, s22 = A[o + 2 * width], A[o + 2 * width + 1], A[o + 2 * width + 2]
            for n in range(3 * (q - low)):
                x0, x1, x2 = A[a + n], A[a + width + n], A[a + 2 * width + n]
                y0, y1, y2 = A[b + n], A[b + far + n], A[b + 2 * far + n]
                s00 -= x0 * y0
                s01 -= x0 * y1
                s02 -= x0 * y2
                s10 -= x1 * y0
                s11 -= x1 * y1
                s12 -= x1 * y2
                s20 -= x2 * y0
                s21 -= x2 * y1
                s22 -= x2 * y2
            if q < p:
                d = diagonal_of(N, q)
                i0, i1, i2 = A[d], A[d + far + 1], A[d + 2 * far + 2]
                l10, l20, l21 = A[d + far], A[d + 2 * far], A[d + 2 * far + 1]
                s00, s10, s20 = s00 * i0, s10 * i0, s20 * i0
                s01, s11, s21 = (
                    (s01 - s00 * l10) * i1,
                    (s11 - s10 * l10) * i1,
                    (s21 - s20 * l10) * i1,
                )
                A[o], A[o + 1], A[o + 2] = s00, s01, (s02 - s00 * l20 - s01 * l21) * i2
                A[o + width], A[o + width + 1] = s10, s11
                A[o + width + 2] = (s12 - s10 * l20 - s11 * l21) * i2
                A[o + 2 * width], A[o + 2 * width + 1] = s20, s21
                A[o + 2 * width + 2] = (s22 - s20 * l20 - s21 * l21) * i2
            else:
                d0 = A[o]
                good = good and s00 > PIVOT_VANISHED * d0
                i0 = 1.0 / math.sqrt(s00) if s00 > PIVOT_VANISHED * d0 else 0.0
                l10, l20 = s10 * i0, s20 * i0
                d1 = s11 - l10 * l10
                good = good and d1 > 0.0
                i1 = 1.0 / math.sqrt(d1) if d1 > 0.0 else 0.0
                l21 = (s21 - l20 * l10) * i1
                d2 = s22 - l20 * l20 - l21 * l21
                good = good and d2 > 0.0
                i2 = 1.0 / math.sqrt(d2) if d2 > 0.0 else 0.0
                A[o], A[o + width], A[o + 2 * width] = i0, l10, l20
                A[o + width + 1], A[o + 2 * width + 1], A[o + 2 * width + 2] = i1, l21, i2
    return good


@njit
def solve_blocks(N, x):
    """x ← H⁻¹ x, by bodies; N.sorted is memory."""
    A, y, bodies = N.matrix, N.sorted, N.place.shape[0]
    for b in range(bodies):
        p = 3 * N.place[b]
        y[p], y[p + 1], y[p + 2] = x[3 * b], x[3 * b + 1], x[3 * b + 2]
    for p in range(bodies):
        a, k, w = N.offset[p], 3 * N.first[p], width_of(N, p)
        s0, s1, s2 = y[3 * p], y[3 * p + 1], y[3 * p + 2]
        for n in range(w - 3):
            s0 -= A[a + n] * y[k + n]
            s1 -= A[a + w + n] * y[k + n]
            s2 -= A[a + 2 * w + n] * y[k + n]
        d = a + w - 3
        s0 *= A[d]
        s1 = (s1 - A[d + w] * s0) * A[d + w + 1]
        y[3 * p], y[3 * p + 1] = s0, s1
        y[3 * p + 2] = (s2 - A[d + 2 * w] * s0 - A[d + 2 * w + 1] * s1) * A[d + 2 * w + 2]
    for m in range(bodies):
        p = bodies - 1 - m
        a, k, w = N.offset[p], 3 * N.first[p], width_of(N, p)
        d = a + w - 3
        s2 = y[3 * p + 2] * A[d + 2 * w + 2]
        s1 = (y[3 * p + 1] - A[d + 2 * w + 1] * s2) * A[d + w + 1]
        s0 = (y[3 * p] - A[d + w] * s1 - A[d + 2 * w] * s2) * A[d]
        y[3 * p], y[3 * p + 1], y[3 * p + 2] = s0, s1, s2
        for n in range(w - 3):
            y[k + n] -= A[a + n] * s0 + A[a + w + n] * s1 + A[a + 2 * w + n] * s2
    for b in range(bodies):
        p = 3 * N.place[b]
        x[3 * b], x[3 * b + 1], x[3 * b + 2] = y[p], y[p + 1], y[p + 2]


# -- Impulses of many contacts by an interior-point method: convergent where sweeps are not ----
#
# With the cones of `mbody.kernels.contact_impulses` opened by s, the velocities of a step are the
# solution of a convex problem,
#
#     min ½ (u − u_free)ᵀ M (u − u_free),   γ_N + b ± μ γ_T ≥ 0,   G u = G u_free,
#
# in the plane with two straight sides of each cone, whose multipliers z± give P_N = z₊ + z₋ and P_T
# = μ (z₊ − z₋). The predictor–corrector method of Mehrotra needs 5 to 25 factorisations of M + Wᵀ Θ
# W + Gᵀ Δ⁻¹ G (above), whatever the friction, and however undetermined the
# impulses are. Rows of joints are as stiff as Δ⁻¹, with multipliers that take what is left.
#
# It begins with the impulses of the step before, moved inside the cones. Nocedal, Wright: Numerical
# Optimization (2006), 16.6; Acary, Armand, Nguyen, Shpakovych (2023) for friction in space.

#: Counts: numbers that the matrix needs; steps for which sweeps are not tried.
NEEDED, WAITING = range(2)
#: Iterations at most, and how many without a better residual end them.
MOST, IDLE = 80, 10


@njit
def interior(W, B, N, tolerance):
    """B.impulse and B.velocity ← the impulses of the step; from the impulses in B.impulse. Returns
    iterations and the residual (`part_of`); −1 where the matrix needs more
    memory, N.count[NEEDED] numbers.
    """
    count = B.counts[FOUND]
    N.count[NEEDED] = arrange(B, N)
    if N.count[NEEDED] > N.matrix.shape[0]:
        return -1, math.inf
    start_inside(W, B, N, count)
    best, stalled, done = math.inf, 0, 0
    while True:
        left = residuals(W, B, N, count)
        if left < best:
            best, stalled = left, 0
            for c in range(count):
                B.kept[c, 0], B.kept[c, 1] = B.impulse[c, 0], B.impulse[c, 1]
        else:
            stalled += 1
        if left <= tolerance or done >= MOST or stalled >= IDLE:
            break
        form(W, B, N, count)
        factor_blocks(N)
        gap = complementarity(B, N, count, 0.0)
        if not gap > 0.0:
            break
        direction(W, B, N, count, 0.0, False)
        part = complementarity(B, N, count, longest(B, N, count)) / gap
        direction(W, B, N, count, part * part * part * gap, True)
        advance(W, B, N, count, min(1.0, INTERIOR_POINT_STEP * longest(B, N, count)))
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
            p, t, mu = B.impulse[c, 0], B.impulse[c, 1], B.effect[c, MU]
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
        N.stiffness[r] = 1.0 / (CONTACT_ROW_FLEXIBLE * effect) if effect > 0.0 else 0.0
        N.pull[r] = N.old_pull[r]
        press_row(W, N, r, -N.pull[r], f)
    greatest = 0.0
    for n in range(u.shape[0]):
        u[n] = B.free[n] + B.inverse[n] * f[n]
    for c in range(count):
        if takes_part(B, c):
            normal, along = rates(B, c, u)
            bound = normal + B.effect[c, BOUND] + B.effect[c, OPENING]
            aside = B.effect[c, MU] * along
            N.slack[c, 0], N.slack[c, 1] = bound + aside, bound - aside
            lacking = -min(N.slack[c, 0], N.slack[c, 1]) / B.effect[c, NN]
            most = max(N.dual[c, 0], N.dual[c, 1])
            greatest = max(greatest, INTERIOR_POINT_START * most, INTERIOR_POINT_VIOLATED * lacking)
    for c in range(count):
        for k in range(2):
            N.dual[c, k] = max(N.dual[c, k], greatest)
            N.slack[c, k] = max(N.slack[c, k], greatest * B.effect[c, NN])


@njit
def residuals(W, B, N, count):
    """B.impulse ← the multipliers put onto their cones by the present velocities, N.rest what is
    left of the equation of motion. Returns the greatest change that this was, or that of velocities
    (`part_of`), or of joints as a part of the greatest impulse.
    """
    u, f = B.velocity, N.rest
    bodies = N.place.shape[0]
    for n in range(3 * bodies):
        f[n] = -(u[n] - B.free[n]) / B.inverse[n]
    fastest, furthest, greatest, joints = 0.0, 0.0, 0.0, 0.0
    for c in range(count):
        if takes_part(B, c):
            p, t = N.dual[c, 0] + N.dual[c, 1], B.effect[c, MU] * (N.dual[c, 0] - N.dual[c, 1])
            x, y = onto_cone(B, c, p, t, u)
            fastest = max(fastest, B.effect[c, NN] * abs(x - p), B.effect[c, TT] * abs(y - t))
            furthest = max(furthest, abs(x - p), abs(y - t))
            greatest = max(greatest, p)
            B.impulse[c, 0], B.impulse[c, 1] = x, y
            press(B, c, p, t, f)
    for r in range(N.row_start.shape[0] - 1):
        press_row(W, N, r, -N.pull[r], f)
        N.rate[r] = row_rate(W, N, r, u) - row_rate(W, N, r, B.free)
        joints = max(joints, CONTACT_ROW_FLEXIBLE * N.stiffness[r] * abs(N.rate[r]))
    for n in range(3 * bodies):
        unit = W.size[0, 0] if n % 3 == 2 else 1.0
        fastest = max(fastest, unit * B.inverse[n] * abs(f[n]))
        furthest = max(furthest, abs(f[n]) / unit)
    part = part_of(B, fastest, furthest, greatest)
    return max(part, joints / greatest if greatest > 0.0 else 0.0)


@njit
def form(W, B, N, count):
    """The matrix of the present multipliers and slacks."""
    bodies = N.place.shape[0]
    put_masses(B, N)
    for c in range(count):
        if not takes_part(B, c):
            continue
        i, j, mu = B.who[c, 0], B.who[c, 1], B.effect[c, MU]
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
        mu = B.effect[c, MU]
        normal, along = rates(B, c, u)
        bound = normal + B.effect[c, BOUND] + B.effect[c, OPENING]
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
            aside = B.effect[c, MU] * along if k == 0 else -B.effect[c, MU] * along
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


#: Sweeps of the correction of positions, at most.
SWEEPS = 30
#: Sweeps after which velocities are computed anew from the impulses.
RENEWED = 50
#: Contacts up to which s follows the sliding until it stays; how often at most; the part of the
#: change of s to which impulses are found before.
FEW, FOLLOWED_EXACTLY, AHEAD = 30, 30, 0.01
#: How much of the way to the present sliding s goes at once.
LEAST_PART, MOST_PART = 0.05, 50.0
#: Of many contacts: how often s follows the sliding.
FOLLOWED = 3
#: Sweeps before the interior-point method, and for how many steps it is taken alone after them.
TRIED, ALONE = 160, 8


@njit
def within_cones(B):
    """Impulses within the cones, which the coefficient may have made narrower."""
    for c in range(B.counts[FOUND]):
        bound = B.effect[c, MU] * B.impulse[c, 0]
        B.impulse[c, 1] = min(max(B.impulse[c, 1], -bound), bound)
        if not takes_part(B, c):
            B.impulse[c, 0] = B.impulse[c, 1] = 0.0


@njit
def solve_impulses(W, B, N, tolerance, h):
    """B.impulse and B.velocity ← the impulses of a step of length h. Returns sweeps, iterations of
    the interior-point method, what is left (`part_of`), and how much nearer, in parts of its size,
    a contact comes because s has not followed. −1 iterations where there is no memory.
    """
    count, tied, waiting = B.counts[FOUND], any_tied(B), N.count[WAITING]
    exact, wanted, sweeps, iterations, again = count <= FEW, tolerance, 0, 0, 0
    within_cones(B)
    if exact:
        apply_all(B)
        follow_sliding(B, count, 0)
    while True:
        change = math.inf
        if waiting > 0:
            waiting -= 1 if again == 0 else 0
        elif not tied:
            apply_all(B)
            sweeps += relax(B, count, wanted, TRIED)
            change = B.progress[CHANGE]
            waiting = ALONE if change > wanted else 0
        if change > wanted:
            more, change = interior(W, B, N, wanted)
            if more < 0:
                return sweeps, -1, change, 0.0
            iterations += more
            if change > wanted:
                change = from_afar(W, B, N, wanted, change)
            if not tied:
                apply_all(B)
        N.count[WAITING] = waiting
        nearer = h * unfollowed(W, B, count)
        if not exact and (nearer <= CONTACT_SLIDING_SLACK or again == FOLLOWED):
            return sweeps, iterations, change, nearer
        opened = follow_sliding(B, count, again if exact else 0)
        if exact:
            left = max(change, opened)
            # what is not solved for these cones says nothing of the next ones
            if left <= tolerance or change > wanted or again == FOLLOWED_EXACTLY:
                return sweeps, iterations, left, 0.0
            wanted = max(tolerance, AHEAD * opened)
        again += 1


@njit
def from_afar(W, B, N, tolerance, before):
    """The interior-point method once more, from no impulses; those that B.impulse has stay where
    they are better. Returns what is left.
    """
    count = B.counts[FOUND]
    for c in range(count):
        B.ahead[c, 0], B.ahead[c, 1] = B.impulse[c, 0], B.impulse[c, 1]
        B.impulse[c, 0] = B.impulse[c, 1] = 0.0
    _, change = interior(W, B, N, tolerance)
    if change < before:
        return change
    for c in range(count):
        B.impulse[c, 0], B.impulse[c, 1] = B.ahead[c, 0], B.ahead[c, 1]
    return before


@njit
def relax(B, count, tolerance, most):
    """Sweeps to and fro, at most so many, until impulses change by no more than that (`part_of`),
    which B.progress becomes; the cones stay as they are opened. Returns how many.
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
        fastest, furthest, greatest, square = 0.0, 0.0, 0.0, 0.0
        for c in range(count):
            x, y = B.impulse[c, 0] - B.kept[c, 0], B.impulse[c, 1] - B.kept[c, 1]
            square += x * x + y * y
            fastest = max(fastest, B.effect[c, NN] * abs(x), B.effect[c, TT] * abs(y))
            furthest = max(furthest, abs(x), abs(y))
            greatest = max(greatest, B.impulse[c, 0])
        change = part_of(B, fastest, furthest, greatest)
        B.progress[CHANGE] = change
        if change <= tolerance or done >= most:
            return done
        if done % RENEWED == 0:
            apply_all(B)  # rounding of velocities that were changed so often
        part = square / before if before > 0.0 else 0.0
        extrapolate(B, count, part)
        before = square


@inline
def opening_of(B, c, along):
    """s of a contact by its sliding."""
    opening = B.effect[c, MU] * abs(along)
    if abs(B.impulse[c, 1]) < FRICTION_STICKS * B.effect[c, MU] * B.impulse[c, 0]:
        opening = 0.0  # it sticks: what is left of its rate is what is not solved
    return opening


@njit
def follow_sliding(B, count, again):
    """Open the cones by the present sliding; where that was done before, by so much of the way as
    the last two changes let expect (Irons, Tuck). Returns the greatest change (`part_of`).
    """
    fastest, furthest, greatest, along_before, square = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(count):
        change = 0.0
        if takes_part(B, c):
            normal, along = rates(B, c, B.velocity)
            change = opening_of(B, c, along) - B.effect[c, OPENING]
            if B.impulse[c, 0] > 0.0 or normal + B.effect[c, BOUND] < 0.0:
                fastest = max(fastest, abs(change))
                furthest = max(furthest, abs(change) / B.effect[c, NN])
                greatest = max(greatest, B.impulse[c, 0])
                along_before += B.shift[c] * (change - B.shift[c])
                square += (change - B.shift[c]) ** 2
        B.shift[c] = change
    part = 1.0
    if again > 0 and square > 0.0:
        part = min(max(-B.progress[PART] * along_before / square, LEAST_PART), MOST_PART)
    B.progress[PART] = part
    for c in range(count):
        B.effect[c, OPENING] = max(0.0, B.effect[c, OPENING] + part * B.shift[c])
    return part_of(B, fastest, furthest, greatest)


@njit
def unfollowed(W, B, count):
    """How fast contacts that press come nearer, or leave, because s has not followed the sliding:
    the greatest, in parts of their size.
    """
    fastest = 0.0
    for c in range(count):
        if takes_part(B, c) and B.impulse[c, 0] > 0.0:
            _, along = rates(B, c, B.velocity)
            change = abs(opening_of(B, c, along) - B.effect[c, OPENING])
            fastest = max(fastest, change / size_of(W, B, c))
    return fastest


@njit
def sweep(B, count, backward):
    """One pass over all contacts: each impulse onto its cone, by its own effect."""
    u = B.velocity
    for n in range(count):
        c = count - 1 - n if backward else n
        if takes_part(B, c):
            p, t = B.impulse[c, 0], B.impulse[c, 1]
            x, y = onto_cone(B, c, p, t, u)
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


@inline
def size_of(W, B, c):
    """The size of the smaller shape of a contact, that of the model where both are points."""
    size = B.geometry[c, 7]
    return size if size < math.inf else W.size[0, 0]


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
        deep = -(B.geometry[c, 6] + 1.5 * h * normal) - CONTACT_OVERLAP_LEFT * size_of(W, B, c)
        B.shift[c] = 0.0
        # what is open may close by as much as it is open
        B.effect[c, APART] = -(CONTACT_OVERLAP_CORRECTED if deep > 0.0 else 1.0) * deep
        any_deep = any_deep or deep > 0.0
    if not any_deep:
        return False
    for n in range(SWEEPS):
        greatest, furthest = 0.0, 0.0
        for m in range(count):
            c = count - 1 - m if n % 2 == 1 else m
            if not B.effect[c, NN] > 0.0:
                continue
            normal, _ = rates(B, c, shift)
            p = max(0.0, B.shift[c] - (normal + B.effect[c, APART]) / B.effect[c, NN])
            if p != B.shift[c]:
                furthest = max(furthest, abs(p - B.shift[c]))
                apply(B, c, p - B.shift[c], 0.0, shift)
                B.shift[c] = p
            greatest = max(greatest, p)
        if furthest <= CONTACT_OVERLAP_ENOUGH * greatest:
            break
    return True
