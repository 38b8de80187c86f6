"""Contacts and frictional joints at one instant: one complementarity problem without dimensions.

Rows r are the normals of closed contacts, then tangents of contacts and of frictional joints.
Forces f along the rows give accelerations (or, of impulses, velocities)

    w = c + D f,    D = W M⁻¹ Wᵀ less what joints take (Delassus's matrix),

and the laws of Signorini and Coulomb are

    0 ≤ w_N ⊥ N ≥ 0,    T = proj(T − w_T) onto −low(f) ≤ T ≤ high(f),    T = ∓limit where it slides:

μ N of a contact, the friction circle of the whole reaction of a pin, which f changes, and so on.

With p ≈ 1/D_00, s_r ≈ 1/√(p D_rr) and κ ≈ max |s_r c_r|, all rounded to powers of two, the
unknowns are g = f/(κ p s): diagonal and ĉ are of the order of 1, limits μ s_N/s_T. Nothing inside
has a unit, and scaling changes no digit: other units that are powers of two give the same ones.

In (N, λ_R, a⁻), λ_R = T + low, it is a linear complementarity problem where the limits are linear,
which Lemke's path solves; limits that bend are replaced by their tangents at the last solution
until it is its own (Josephy and Newton). Where all paths end on rays all sets of modes are tried. A
solution is accepted by its residual max |g − proj(g − w)| alone, recomputed from D, c and the
limits themselves.

Pfeiffer, Glocker: Multibody Dynamics with Unilateral Contacts (1996), 6 and 8; Cottle, Pang, Stone:
The Linear Complementarity Problem (1992), 4.4 and 4.9; Facchinei, Pang: Finite-Dimensional
Variational Inequalities (2003), 7.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import lane_at
from mbody.core.tolerances import (
    COMPLEMENTARITY_CONVERGED,
    COMPLEMENTARITY_DETERMINED,
    COMPLEMENTARITY_PIVOT,
    COMPLEMENTARITY_RESIDUAL,
    COMPLEMENTARITY_SOFTER,
    COMPLEMENTARITY_TIE,
    CONTACT_ACCELERATION_CANCELS,
    CONTACT_ACCELERATION_NONE,
    CONTACT_ACCELERATION_ROUNDING,
    CONTACT_ACCELERATION_SAME,
    CONTACT_FORCE_NONE,
    CONTACT_FORCE_SAME,
    ROWS_DEPENDENT,
    TINY,
)
from mbody.kernels.friction import ARMS, FORCE, PULL, TORQUE, at_rate, law_size, store_arms
from mbody.kernels.layout import Layout, Work

#: `ContactProblem.law` of what a normal force presses; of joints the number of their kind.
CONE = -1
#: Numbers in `ContactProblem.count`: rows, normals, solutions, whether all modes were tried.
ROWS, NORMALS, SOLUTIONS, COMPLETE = range(4)
#: Numbers in `ContactProblem.number`: κ, the residual of the worst solution, κ p.
SCALE, RESIDUAL, FORCES = range(3)
#: Problems with tangents of the limits, at most; starts of Lemke's path.
PASSES, PATHS = 40, 6
#: Passes that look for rest alone.
RESTING = 5
#: Sets of modes, at most, that are all tried; different solutions, at most.
MOST_MODES, MOST_SOLUTIONS = 3.0**7, 8
#: Exchanges of Lemke's path with n unknowns, at most: this times n + 1; it takes about n.
EXCHANGES = 50


class ContactProblem(Bundle):
    """Memory of one problem of at most n rows."""

    count: Ints
    law: Ints  # of tangents
    normal: Ints  # of cones: the row of the normal
    mu: Floats
    arm: Rows  # of joints: the three numbers of `law_size`, sliding forwards and backwards, (n, 6)
    pressing: Rows  # of joints: the multipliers that press them without forces f, (n, 2)
    by_force: Stacks  # and how these change by each force, (n, 2, n)
    sliding: Floats  # direction of what slides, zero of what is at rest
    given: Floats  # of cones: normal impulse that counts beside the unknown one
    D: Rows
    c: Floats
    noise: Floats  # rounding of c
    soft: Floats  # D_rr without joints, the scale of rows that joints and drivers lead
    f: Rows  # forces and accelerations of each solution
    w: Rows
    mode: Ints  # of the solutions: normals 0 open, 1 closed; tangents 0 stick, ±1 slip
    number: Floats
    # without dimensions
    scale: Floats
    S: Rows
    b: Floats
    g: Floats
    v: Floats
    low: Floats
    high: Floats
    low_by: Rows
    high_by: Rows
    force_by: Rows
    trial: Ints
    dense: Rows
    A: Rows
    q: Floats
    z: Floats
    table: Rows
    basis: Ints


def problem_memory(n: int) -> ContactProblem:
    """A problem of at most n rows."""
    k, most = 2 * n + 1, MOST_SOLUTIONS

    def ints(*shape: int) -> np.ndarray:
        return np.zeros(shape, dtype=np.int64)

    return ContactProblem(
        count=ints(4), law=ints(n), normal=ints(n), mu=np.zeros(n), arm=np.zeros((n, 6)),
        pressing=np.zeros((n, 2)), by_force=np.zeros((n, 2, n)), sliding=np.zeros(n),
        given=np.zeros(n), D=np.zeros((n, n)), c=np.zeros(n), noise=np.zeros(n), soft=np.zeros(n),
        f=np.zeros((most, n)), w=np.zeros((most, n)), mode=ints(most * n), number=np.zeros(3),
        scale=np.zeros(n), S=np.zeros((n, n)), b=np.zeros(n), g=np.zeros(n), v=np.zeros(n),
        low=np.zeros(n), high=np.zeros(n), low_by=np.zeros((n, n)), high_by=np.zeros((n, n)),
        force_by=np.zeros((n, n + 1)), trial=ints(n), dense=np.zeros((n, n + 1)),
        A=np.zeros((k, k)), q=np.zeros(k), z=np.zeros(k), table=np.zeros((k, 2 * k + 2)),
        basis=ints(k),
    )  # fmt: skip


# -- Linear complementarity: 0 ≤ A z + q ⊥ z ≥ 0 -----------------------------------------------


@inline
def power_of_two(x):
    """The power of two at or below x > 0."""
    p = 1.0
    while 2.0 * p <= x:
        p *= 2.0
    while p > x:
        p *= 0.5
    return p


@njit
def lemke_path(A, q, z, table, basis, k, path):
    """z ← a solution of k unknowns; False where the path ends on a ray. Lexicographic, so that it
    cannot cycle; rows are scaled; `path` numbers the weights of the artificial unknown.
    """
    last, artificial, least, row = 2 * k + 1, 2 * k, 0.0, -1
    for r in range(k):
        z[r] = 0.0
        largest = TINY
        for c in range(k):
            largest = max(largest, abs(A[r, c]))
        per = 1.0 / power_of_two(largest)
        for c in range(k):
            table[r, c] = 1.0 if c == r else 0.0
            table[r, k + c] = -A[r, c] * per
        weight = 1.0 if path == 0 else 1.0 + ((r + 1) * (2 * path + 1) * 0.6180339887) % 1.0
        table[r, artificial], table[r, last], basis[r] = -weight, q[r] * per, r
        if q[r] * per / weight < least:
            row, least = r, q[r] * per / weight
    if row < 0:
        return True
    entering = artificial
    for _ in range(EXCHANGES * (k + 1)):
        per = 1.0 / table[row, entering]
        for c in range(last + 1):
            table[row, c] *= per
        for r in range(k):
            part = table[r, entering]
            if r != row and part != 0.0:
                for c in range(last + 1):
                    table[r, c] -= part * table[row, c]
        leaving = basis[row]
        basis[row] = entering
        if leaving == artificial:
            for r in range(k):
                if k <= basis[r] < artificial:
                    z[basis[r] - k] = max(table[r, last], 0.0)
            return True
        entering = leaving + k if leaving < k else leaving - k
        row = leaving_row(table, basis, entering, k)
        if row < 0:
            return False
    return False


@njit
def leaving_row(table, basis, entering, k):
    """The row of the least ratio; of equal ones that of the artificial unknown, else the
    lexicographically least; −1 on a ray.
    """
    size, row, last = 1.0, -1, 2 * k + 1
    for r in range(k):
        size = max(size, abs(table[r, entering]))
    for r in range(k):
        if table[r, entering] <= COMPLEMENTARITY_PIVOT * size:
            continue
        if row < 0:
            row = r
            continue
        for n in range(-1, k):
            at = last if n < 0 else n
            new = table[r, at] / table[r, entering]
            old = table[row, at] / table[row, entering]
            if abs(new - old) > COMPLEMENTARITY_TIE * max(1.0, abs(old)):
                if new < old:
                    row = r
                break
            if n < 0 and (basis[r] == 2 * k or basis[row] == 2 * k):
                row = r if basis[r] == 2 * k else row
                break
    return row


# -- Scales and limits -------------------------------------------------------------------------


@njit
def without_dimensions(P):
    """P.scale, κ, and the problem in them: P.S, P.b. What is rounding in c is zero."""
    n, most, driven, per = P.count[ROWS], 0.0, 0.0, 0.0
    for r in range(n):
        soft = P.D[r, r] if P.D[r, r] > 0.0 else P.soft[r]
        if soft > 0.0 and per == 0.0:
            per = 1.0 / power_of_two(soft)
    per = per if per > 0.0 else 1.0
    for r in range(n):
        soft = per * (P.D[r, r] if P.D[r, r] > 0.0 else P.soft[r])
        scale = 1.0
        if soft > 0.0:
            while scale * scale * soft >= 4.0:
                scale *= 0.5
            while scale * scale * soft < 1.0:
                scale *= 2.0
        P.scale[r] = scale
        P.b[r] = P.c[r] * scale if abs(P.c[r]) > P.noise[r] else 0.0
        if P.D[r, r] > 0.0 and not slides(P, r):
            most = max(most, abs(P.b[r]))
        else:
            driven = max(driven, abs(P.b[r]))
        most = max(most, given_size(P, r) / per)
    kappa = most if most > 0.0 else driven
    kappa = power_of_two(kappa) if kappa > 0.0 else 1.0
    P.number[SCALE], P.number[FORCES] = kappa, kappa * per
    for r in range(n):
        P.b[r] /= kappa
        if abs(P.b[r]) <= CONTACT_ACCELERATION_ROUNDING:
            P.b[r] = 0.0
        for c in range(n):
            P.S[r, c] = P.D[r, c] * (P.scale[r] * P.scale[c] * per)


@inline
def slides(P, r):
    """Whether row r is a tangent that slides, which it does at any acceleration."""
    return r >= P.count[NORMALS] and P.sliding[r] != 0.0


@inline
def given_size(P, r):
    """The size of friction of a sliding joint without forces f, of the scale of forces."""
    if r < P.count[NORMALS] or P.law[r] == CONE or P.sliding[r] == 0.0:
        return 0.0
    size, _, _ = law_size(
        P.law[r], P.arm[r, 0], P.arm[r, 1], P.arm[r, 2], P.pressing[r, 0], P.pressing[r, 1]
    )
    return abs(size) / P.scale[r]


@njit
def limits(P):
    """Limits −low ≤ T ≤ high of all tangents at the forces P.g, and their derivatives."""
    n, m, kappa = P.count[ROWS], P.count[NORMALS], P.number[FORCES]
    for r in range(m, n):
        own = 1.0 / P.scale[r]
        if P.law[r] == CONE:
            k = P.normal[r]
            for c in range(n):
                P.low_by[r, c] = P.high_by[r, c] = 0.0
            by = P.mu[r] * P.scale[k] * own
            P.low_by[r, k] = P.high_by[r, k] = by
            P.low[r] = P.high[r] = by * P.g[k] + P.mu[r] * P.given[r] * own / kappa
            continue
        x, y = P.pressing[r, 0] / kappa, P.pressing[r, 1] / kappa
        for c in range(n):
            x += P.by_force[r, 0, c] * P.scale[c] * P.g[c]
            y += P.by_force[r, 1, c] * P.scale[c] * P.g[c]
        kind = P.law[r]
        # sizes that a law gives are forces, all others are multiples of multipliers
        per = 1.0 / kappa if kind in (TORQUE, FORCE, PULL) else 1.0
        low, low_x, low_y = law_size(kind, P.arm[r, 0] * per, P.arm[r, 1], P.arm[r, 2], x, y)
        high, high_x, high_y = law_size(kind, P.arm[r, 3] * per, P.arm[r, 4], P.arm[r, 5], x, y)
        P.low[r], P.high[r] = low * own, high * own
        for c in range(n):
            by_x, by_y = P.by_force[r, 0, c] * P.scale[c], P.by_force[r, 1, c] * P.scale[c]
            P.low_by[r, c] = (low_x * by_x + low_y * by_y) * own
            P.high_by[r, c] = (high_x * by_x + high_y * by_y) * own


@inline
def is_linear(P):
    """Whether all limits are linear in the forces."""
    linear = True
    for r in range(P.count[NORMALS], P.count[ROWS]):
        linear = linear and (P.law[r] == CONE or P.law[r] in (TORQUE, FORCE, PULL))
    return linear


@inline
def is_convex(P):
    """Whether no limit depends on the forces: accelerations that solve the problem are unique."""
    convex = is_linear(P)
    for r in range(P.count[NORMALS], P.count[ROWS]):
        convex = convex and P.law[r] != CONE
    return convex


# -- Certificate -------------------------------------------------------------------------------


@njit
def residual(P):
    """How far P.g is from a solution; P.v ← w, P.low, P.high at it."""
    n, m, big, off = P.count[ROWS], P.count[NORMALS], 1.0, 0.0
    for r in range(n):
        total, terms = P.b[r], abs(P.b[r])
        for c in range(n):
            total += P.S[r, c] * P.g[c]
            terms += abs(P.S[r, c] * P.g[c])
        rounding = CONTACT_ACCELERATION_CANCELS * terms
        rounding += P.noise[r] * P.scale[r] / P.number[SCALE]
        P.v[r] = total if abs(total) > rounding else 0.0
        big = max(big, abs(P.g[r]), 0.0 if slides(P, r) else abs(P.b[r]))
    limits(P)
    for r in range(n):
        g, w = P.g[r] / big, P.v[r] / big
        if r < m:
            off = max(off, abs(min(g, w)))
            continue
        low, high = P.low[r] / big, P.high[r] / big
        off = max(off, -min(low, high))
        if P.sliding[r] > 0.0:
            off = max(off, abs(g + low))
        elif P.sliding[r] < 0.0:
            off = max(off, abs(g - high))
        else:
            off = max(off, abs(g - min(max(g - w, -low), high)))
    return off if off == off else math.inf


# -- By Lemke's path ---------------------------------------------------------------------------


@njit
def tangent_forces(P):
    """P.force_by ← T = force_by (N, λ_R, 1) with the tangents of the limits at P.g, whose constants
    replace P.low and P.high; returns how many tangents are at rest, −1 where no T follows.
    """
    n, m, M, resting = P.count[ROWS], P.count[NORMALS], P.table, 0
    for r in range(m, n):
        for c in range(n):
            P.low[r] -= P.low_by[r, c] * P.g[c]
            P.high[r] -= P.high_by[r, c] * P.g[c]
        resting += 1 if P.sliding[r] == 0.0 else 0
    t, width, s = n - m, m + resting + 1, 0
    # (I + G_T) T = E λ_R − G_N N − g₀
    for r in range(m, n):
        i, back = r - m, P.sliding[r] < 0.0
        for c in range(m, n):
            by = -P.high_by[r, c] if back else P.low_by[r, c]
            M[i, c - m] = (1.0 if c == r else 0.0) + by
        for c in range(m):
            M[i, t + c] = P.high_by[r, c] if back else -P.low_by[r, c]
        for c in range(m, width):
            M[i, t + c] = 0.0
        if P.sliding[r] == 0.0:
            M[i, t + m + s] = 1.0
            s += 1
        M[i, t + width - 1] = P.high[r] if back else -P.low[r]
    for k in range(t):
        best, at = 0.0, k
        for i in range(k, t):
            if abs(M[i, k]) > best:
                best, at = abs(M[i, k]), i
        if best <= COMPLEMENTARITY_PIVOT:
            return -1
        for c in range(t + width):
            M[k, c], M[at, c] = M[at, c], M[k, c]
        per = 1.0 / M[k, k]
        for c in range(k, t + width):
            M[k, c] *= per
        for i in range(t):
            if i != k and M[i, k] != 0.0:
                part = M[i, k]
                for c in range(k, t + width):
                    M[i, c] -= part * M[k, c]
    for i in range(t):
        for c in range(width):
            P.force_by[m + i, c] = M[i, t + c]
    return resting


@njit
def linear_problem(P, resting, softer):
    """P.A, P.q ← the problem in (N, λ_R, a⁻) by P.force_by, S being `softer` on its diagonal."""
    n, m = P.count[ROWS], P.count[NORMALS]
    known, s = m + resting, 0
    for r in range(known + resting):
        for c in range(known + resting):
            P.A[r, c] = 0.0
    for r in range(n):
        if slides(P, r):
            continue
        at = r if r < m else m + s
        for c in range(known + 1):
            total = P.b[r] if c == known else (P.S[r, c] if c < m else 0.0)
            for j in range(m, n):
                total += P.S[r, j] * P.force_by[j, c]
            if r >= m:
                total += softer * (P.force_by[r, c] - (P.g[r] if c == known else 0.0))
            elif c in (r, known):
                total += softer * (1.0 if c == r else -P.g[r])
            if c < known:
                P.A[at, c] = total
            else:
                P.q[at] = total if abs(total) > CONTACT_ACCELERATION_ROUNDING else 0.0
        if r < m:
            continue
        P.A[at, known + s] = 1.0
        for c in range(known + 1):
            total = P.low[r] + P.high[r] if c == known else 0.0
            if c < m:
                total = P.low_by[r, c] + P.high_by[r, c]
            for j in range(m, n):
                total += (P.low_by[r, j] + P.high_by[r, j]) * P.force_by[j, c]
            if c < known:
                P.A[known + s, c] = total - (1.0 if c == m + s else 0.0)
            else:
                P.q[known + s] = total
        s += 1


@njit
def independent(P):
    """Whether no row of what presses and of what is at rest depends on others: by Cholesky."""
    n, F = P.count[ROWS], P.dense
    for r in range(n):
        if slides(P, r):
            continue
        left = P.S[r, r]
        for c in range(r):
            if slides(P, c):
                continue
            x = P.S[r, c]
            for k in range(c):
                if not slides(P, k):
                    x -= F[r, k] * F[c, k]
            F[r, c] = x / F[c, c]
            left -= F[r, c] * F[r, c]
        if left <= ROWS_DEPENDENT * P.S[r, r]:
            return False
        F[r, r] = math.sqrt(left)
    return True


@njit
def by_lemke(P):
    """P.g ← a solution by Lemke's path; whether one was found, which its residual says."""
    n, m, linear = P.count[ROWS], P.count[NORMALS], is_linear(P)
    for r in range(n):
        P.g[r] = 0.0
    # nothing has to act
    if residual(P) == 0.0:
        return True
    # of forces that no equation decides small ones are found by rows that are a little softer about
    # the last ones, which is taken back pass by pass
    softer = 0.0 if independent(P) else COMPLEMENTARITY_SOFTER
    # rest is taken where it is a solution
    if by_cones(P, softer, RESTING):
        return True
    for path in range(PATHS):
        before = math.inf
        for r in range(n):
            P.g[r] = 0.0
        for _ in range(PASSES):
            limits(P)
            resting = tangent_forces(P)
            if resting < 0:
                break
            linear_problem(P, resting, softer if path % 2 == 1 else 0.0)
            known = m + resting
            if not lemke_path(P.A, P.q, P.z, P.table, P.basis, known + resting, path):
                break
            change, most = 0.0, 1.0
            for r in range(n):
                g = P.z[r] if r < m else P.force_by[r, known]
                for c in range(known if r >= m else 0):
                    g += P.force_by[r, c] * P.z[c]
                change, most = max(change, abs(g - P.g[r])), max(most, abs(g))
                P.g[r] = g
            off = residual(P)
            done = linear and path % 2 == 0
            if done or settled(off, before) or change <= COMPLEMENTARITY_CONVERGED * most:
                break
            before = off
        if residual(P) <= COMPLEMENTARITY_RESIDUAL:
            return True
    return by_cones(P, softer, PASSES)


@inline
def settled(off, before):
    """Whether a residual is rounding, or a small one that falls no more."""
    small = off <= COMPLEMENTARITY_RESIDUAL
    return off <= COMPLEMENTARITY_CONVERGED or (small and off > 0.5 * before)


# -- By cones ----------------------------------------------------------------------------------
# On the edges of Coulomb's cones, N = α + β and T = μ (α − β), what rests is a convex problem, for
# which Lemke's path always leads to a solution. With μ |w_T| of the last solution added to w_N it
# is that of what slides, too (de Saxcé), but need not converge.
#
# Acary, Cadoux, Lemaréchal, Malick: A formulation of the linear discrete Coulomb friction problem
# via convex optimization (2011).


@inline
def edge_of(P, k, side):
    """The tangent of normal k and the part of its force that goes with N along an edge of the cone;
    −1 and 0 without friction.
    """
    for r in range(P.count[NORMALS], P.count[ROWS]):
        if P.normal[r] == k:
            return r, (1.0 - 2.0 * side) * P.mu[r] * P.scale[k] / P.scale[r]
    return -1, 0.0


@njit
def by_cones(P, softer, passes):
    """P.g ← a solution of contacts at rest by their cones; whether one was found."""
    n, m = P.count[ROWS], P.count[NORMALS]
    for r in range(m, n):
        if P.law[r] != CONE or P.sliding[r] != 0.0 or P.given[r] != 0.0:
            return False
    for i in range(2 * m):
        k = i // 2
        t, part = edge_of(P, k, i % 2)
        for j in range(2 * m):
            c = j // 2
            s, other = edge_of(P, c, j % 2)
            total = P.S[k, c] + (softer if k == c else 0.0)
            if s >= 0:
                total += P.S[k, s] * other
            if t >= 0:
                total += part * P.S[t, c]
            if t >= 0 and s >= 0:
                total += part * other * (P.S[t, s] + (softer if t == s else 0.0))
            P.A[i, j] = total
    before = math.inf
    for r in range(n):
        P.g[r] = P.v[r] = 0.0
    for _ in range(passes):
        for i in range(2 * m):
            k = i // 2
            t, part = edge_of(P, k, i % 2)
            P.q[i] = P.b[k] - softer * P.g[k]
            if t >= 0:
                P.q[i] += part * (P.b[t] - softer * P.g[t])
                P.q[i] += abs(part * P.v[t]) if passes > RESTING else 0.0
        if not lemke_path(P.A, P.q, P.z, P.table, P.basis, 2 * m, 0):
            return False
        for r in range(n):
            P.g[r] = 0.0
        for i in range(2 * m):
            t, part = edge_of(P, i // 2, i % 2)
            P.g[i // 2] += P.z[i]
            if t >= 0:
                P.g[t] += part * P.z[i]
        off = residual(P)
        if settled(off, before):
            break
        before = off
    return residual(P) <= COMPLEMENTARITY_RESIDUAL


# -- By modes ----------------------------------------------------------------------------------


@njit
def eliminate(M, n):
    """Gauss's elimination with row pivots of (n, n + 1) numbers, the solution in the last column;
    False where a pivot vanishes.
    """
    for k in range(n):
        best, at = 0.0, k
        for r in range(k, n):
            if abs(M[r, k]) > best:
                best, at = abs(M[r, k]), r
        if not best > COMPLEMENTARITY_DETERMINED:
            return False
        if at != k:
            for c in range(k, n + 1):
                M[k, c], M[at, c] = M[at, c], M[k, c]
        per = 1.0 / M[k, k]
        for r in range(k + 1, n):
            part = M[r, k] * per
            if part != 0.0:
                for c in range(k + 1, n + 1):
                    M[r, c] -= part * M[k, c]
    for i in range(n):
        k = n - 1 - i
        x = M[k, n]
        for c in range(k + 1, n):
            x -= M[k, c] * M[c, n]
        M[k, n] = x / M[k, k]
    return True


@njit
def by_modes(P):
    """P.g by the equations of the modes in P.trial, from P.g on; whether it is a solution."""
    n, m, M, linear = P.count[ROWS], P.count[NORMALS], P.dense, is_linear(P)
    for _ in range(PASSES):
        limits(P)
        for r in range(n):
            cone = r >= m and P.law[r] == CONE
            acts = True
            if r < m:
                acts = P.trial[r] == 1
            elif cone:
                # an open contact has the friction of impulses that are given
                acts = P.trial[P.normal[r]] == 1 or P.given[r] > 0.0
            slip = 0.0 if r < m else (P.sliding[r] if P.sliding[r] != 0.0 else float(P.trial[r]))
            for c in range(n + 1):
                M[r, c] = 1.0 if c == r else 0.0
            if not acts:
                continue
            if slip == 0.0:
                for c in range(n):
                    M[r, c] = P.S[r, c]
                M[r, n] = -P.b[r]
                continue
            size = P.low[r] if slip > 0.0 else P.high[r]
            for c in range(n):
                by = P.low_by[r, c] if slip > 0.0 else P.high_by[r, c]
                M[r, c] += slip * by
                size -= by * P.g[c]
            M[r, n] = -slip * size
        if not eliminate(M, n):
            return False
        change, most = 0.0, 1.0
        for r in range(n):
            change, most = max(change, abs(M[r, n] - P.g[r])), max(most, abs(M[r, n]))
            P.g[r] = M[r, n]
        if linear or change <= COMPLEMENTARITY_CONVERGED * most:
            break
    return residual(P) <= COMPLEMENTARITY_RESIDUAL


@njit
def next_modes(P):
    """The next set of modes in P.trial; False after the last."""
    n, m = P.count[ROWS], P.count[NORMALS]
    for r in range(n):
        if r < m:
            P.trial[r] = 1 - P.trial[r]
            if P.trial[r]:
                return True
        elif P.sliding[r] == 0.0:
            if P.trial[r] >= 0:
                P.trial[r] = 1 if P.trial[r] == 0 else -1
                return True
            P.trial[r] = 0
    return False


@njit
def number_of_modes(P):
    """How many sets of modes there are."""
    n, m, sets = P.count[ROWS], P.count[NORMALS], 1.0
    for r in range(n):
        sets *= 2.0 if r < m else 3.0 if P.sliding[r] == 0.0 else 1.0
    for r in range(m, n):
        # of what is open one mode of the tangent is tried
        if P.law[r] == CONE and P.sliding[r] == 0.0 and P.given[r] == 0.0:
            sets *= 4.0 / 6.0
    return sets


@njit
def try_all_modes(P):
    """Keep the solutions of all sets of modes that have other accelerations."""
    n, m, linear = P.count[ROWS], P.count[NORMALS], is_linear(P)
    for r in range(n):
        P.trial[r] = 0
    while True:
        skip = False
        for r in range(m, n):
            if P.law[r] == CONE and P.trial[P.normal[r]] == 0 and P.trial[r] != 0:
                skip = skip or P.given[r] == 0.0
        # where limits bend there may be several with the same modes
        for start in range(0 if skip else 1 if linear else 3):
            for r in range(n):
                far = float(P.trial[r]) if r < m else -float(P.trial[r])
                P.g[r] = 0.0 if start == 0 else 1e3 * far
                if start == 1:
                    P.g[r] = P.f[0, r] if P.count[SOLUTIONS] > 0 else 1.0
            if by_modes(P):
                keep(P)
        if not next_modes(P):
            return


@njit
def keep(P):
    """Keep the solution P.g, P.v unless one with its accelerations, or with its modes and nearly
    its forces, is kept: nearly singular ones have few digits. As D is positive no two have modes in
    which nothing slides.
    """
    n, m, found, slides_on = P.count[ROWS], P.count[NORMALS], P.count[SOLUTIONS], False
    if found == MOST_SOLUTIONS:
        return
    most, fastest, here = 0.0, 1.0, found * n
    for r in range(n):
        most = max(most, abs(P.g[r]))
        fastest = max(fastest, 0.0 if slides(P, r) else abs(P.v[r]))
    for r in range(n):
        P.mode[here + r] = mode_of(P, r, most, fastest)
        presses = r >= m and (P.law[r] != CONE or P.mode[here + P.normal[r]] == 1)
        slides_on = slides_on or (presses and P.mode[here + r] != 0)
    for k in range(found):
        differs, other, moved = False, False, 0.0
        for r in range(n):
            terms = 0.0
            for c in range(n):
                terms += abs(P.S[r, c]) * max(abs(P.g[c]), abs(P.f[k, c]))
            least = max(CONTACT_ACCELERATION_SAME * fastest, CONTACT_ACCELERATION_CANCELS * terms)
            differs = differs or abs(P.v[r] - P.w[k, r]) > least
            other = other or P.mode[here + r] != P.mode[k * n + r]
            moved = max(moved, abs(P.g[r] - P.f[k, r]))
        alike = not slides_on or moved <= CONTACT_FORCE_SAME * most
        if not differs or (not other and alike):
            return
    for r in range(n):
        P.f[found, r], P.w[found, r] = P.g[r], P.v[r]
    P.count[SOLUTIONS] = found + 1


@inline
def mode_of(P, r, most, fastest):
    """The mode of row r by P.g and P.v, whose greatest are given."""
    g, w = P.g[r], P.v[r]
    if r < P.count[NORMALS]:
        opens = g <= CONTACT_FORCE_NONE * most and w > CONTACT_ACCELERATION_NONE * fastest
        return 0 if opens else 1
    slip = P.sliding[r]
    if slip == 0.0 and abs(w) > CONTACT_ACCELERATION_NONE * fastest:
        edge = COMPLEMENTARITY_RESIDUAL * max(most, 1.0)
        slip = w if g - edge <= -P.low[r] or g + edge >= P.high[r] else 0.0
    return 1 if slip > 0.0 else -1 if slip < 0.0 else 0


@njit
def contact_solutions(P, every):
    """P.f, P.w, P.mode ← solutions with different accelerations, that of Lemke's path first; of
    `every` set of modes where these are few. Returns how many; none without modes that go on.
    """
    n = P.count[ROWS]
    P.count[SOLUTIONS] = P.count[COMPLETE] = 0
    P.number[RESIDUAL] = 0.0
    without_dimensions(P)
    found = by_lemke(P)
    if found:
        P.number[RESIDUAL] = residual(P)
        keep(P)
    if found and is_convex(P):
        P.count[COMPLETE] = 1
    elif (every or not found) and number_of_modes(P) <= MOST_MODES:
        try_all_modes(P)
        P.count[COMPLETE] = 1
    kappa = P.number[SCALE]
    for k in range(P.count[SOLUTIONS]):
        for r in range(n):
            P.f[k, r] *= P.number[FORCES] * P.scale[r]
            P.w[k, r] *= kappa / P.scale[r]
        # what rounding leaves outside of the cones is none
        for r in range(n):
            if r < P.count[NORMALS]:
                P.f[k, r] = max(P.f[k, r], 0.0)
            elif P.law[r] == CONE:
                most = P.mu[r] * (P.f[k, P.normal[r]] + P.given[r])
                P.f[k, r] = min(max(P.f[k, r], -most), most)
    return P.count[SOLUTIONS]


# -- Friction of joints ------------------------------------------------------------------------


@njit
def find_arms(L, W, f, rests, arm):
    """arm (7,) ← the numbers of `law_size` of friction pair f at the present position, for the
    static coefficient or that of W.rate, of sliding forwards, then backwards; the coefficient.
    """
    w, o = 0.0, L.friction_par[f]
    coefficient, slip_sign = W.coefficient[f, 0], W.slip_sign[f, 0]
    W.coefficient[f, 0] = W.par[o + 1, 0] if rests else W.par[o, 0]
    if not rests:
        at_rate(L, W, f, o, lane_at(0, w))
    arm[2 * ARMS] = W.coefficient[f, 0]
    for side in range(2):
        W.slip_sign[f, 0] = 1.0 - 2.0 * side
        store_arms(L, W, w, f, 1.0)
        for n in range(ARMS):
            arm[ARMS * side + n] = W.arm[ARMS * f + n, 0]
    W.coefficient[f, 0], W.slip_sign[f, 0] = coefficient, slip_sign


@kernel
def joint_arms(L: Layout, W: Work, f: int, rests: bool, arm: Floats) -> None:
    """See `find_arms`."""
    find_arms(L, W, f, rests, arm)


@kernel
def law_sizes(kind: int, arm: Floats, x: Floats, y: Floats, found: Rows) -> None:
    """found (3, n) ← the size of friction for multipliers (n,), and its derivatives by them."""
    for n in range(x.shape[0]):
        size, by_x, by_y = law_size(kind, arm[0], arm[1], arm[2], x[n], y[n])
        found[0, n], found[1, n], found[2, n] = size, by_x, by_y
