"""Free motion over time: explicit Runge–Kutta steps, each ended on the manifold.

Every step ends with the projection of position and velocity onto Φ = 0 and Φ_q v = ν in the metric
of the masses, and the next begins with the slope there. Between, stages run off the manifold by as
much as their error. That is harmless but near a singular position, where the right-hand side has
no smooth continuation off the manifold: there every stage is projected too, a = f(P(y)), with the
corrections that nearly dependent rows want, and the error is asked only of what a projection
keeps. Neither the multipliers, which grow without bound there, nor the noise across the manifold
then have a say in the size of a step.

Hairer, Nørsett, Wanner: Solving Ordinary Differential Equations I, II.10 (the method of order 8);
Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4 (projection).
"""

from __future__ import annotations

import math

from mbody._jit import kernel, njit
from mbody._reference import by_reference
from mbody.core.forces import forces, signals
from mbody.core.manifold import accelerate, tangential, weakest
from mbody.core.output import keep

__all__ = ["DONE", "LOST", "MORE", "SMALL", "begin", "flow"]

DONE, MORE, SMALL, LOST = 0, 1, 2, 3

#: A step is careful where the weakest pivot falls below this part of what it was.
NEAR = 3e-3
#: A projection is sure of its branch where it moves by less than this part of the distance to a
#: singular position, of which the root of the weakest pivot is the measure.
CONE = 0.05
#: What it moves along the manifold may be so many times the error of a step.
ASTRAY = 10.0
#: Nearer than this, as the root of the weakest pivot, it is worth a try with another step.
CLOSE = 5e-3
#: A step does not end where the weakest pivot is this part of what it was.
BEHIND = 1e-6
#: Steps of one passage that are tried again so that no stage, or no end, lies at the position.
STAGES_AGAIN, ENDS_AGAIN = 3.0, 8.0


@njit
def powers(L, W, P):
    """Power of every load, or of all together where P has no room, then of every driver; after
    `accelerate`, which leaves the sum of all loads.
    """
    count = P.shape[0] - L.driver_row.shape[0]
    alone = count > 1
    for cause in range(count):
        if alone:
            forces(L, W, 0.0, cause)
        total = 0.0
        for n in range(3 * L.bodies):
            total += W.force[n, 0] * W.v[n, 0]
        P[cause] = total
    for d in range(L.driver_row.shape[0]):
        # an effort is −λ
        P[count + d] = -W.lam[2 * L.driver_node[d], 0] * W.signal[L.driver_row[d] + 1, 0]


@njit
def stage(L, W, y, K, P, s, soft, passes, careful):
    """Slope of the state y into row s of K, powers into row s of P; careful: of the projection of
    y, which y becomes.
    """
    n3 = 3 * L.bodies
    for n in range(n3):
        W.q[n, 0], W.v[n, 0] = y[n], y[n3 + n]
    far, fast, good = accelerate(L, W, 0.0, soft, passes, careful)
    if careful:
        for n in range(n3):
            y[n], y[n3 + n] = W.q[n, 0], W.v[n, 0]
    for n in range(n3):
        K[s, n], K[s, n3 + n] = W.v[n, 0], W.a[n, 0]
    powers(L, W, P[s])
    return far, fast, good


@kernel
def begin(L, W, soft, passes, y, K, P, page, state):
    """Project the first state, take its slope and keep it: y (2·coordinates,), row 0 of K and of
    P, page (rows, 1); state[0] is the time.
    """
    L, W = by_reference(L), by_reference(W)
    signals(L, W, 0.0, L.signal_law.shape[0])
    W.time[0, 0] = state[0]
    _, _, good = stage(L, W, y, K, P, 0, soft, passes, True)
    state[8] = state[10] = weakest(L, W)
    keep(L, W, 0.0, page)
    return good


@njit
def between(L, W, A, B, C, D, soft, passes, t, h, y, last, K, P, F, G):
    """F (7, 2·coordinates) and G (7, causes) of the polynomials of order 7 of state and work over a
    step, by three more slopes.
    """
    n6 = 6 * L.bodies
    for s in range(13, 16):
        for n in range(n6):
            total = 0.0
            for r in range(s):
                total += A[s, r] * K[r, n]
            F[0, n] = last[n] + h * total
        W.time[0, 0] = t + C[s] * h
        stage(L, W, F[0], K, P, s, soft, passes, False)
    for n in range(n6):
        polynomial(D, h, y[n] - last[n], K, n, F)
    for c in range(P.shape[1]):
        polynomial(D, h, h * weighed(B, P, c), P, c, G)


@njit
def polynomial(D, h, change, K, n, F):
    """Column n of F from the slopes in column n of K and the change over the step."""
    F[0, n] = change
    F[1, n] = h * K[0, n] - change
    F[2, n] = 2.0 * change - h * (K[12, n] + K[0, n])
    for m in range(4):
        total = 0.0
        for r in range(16):
            total += D[m, r] * K[r, n]
        F[3 + m, n] = h * total


@njit
def along(F, n, x):
    """What a polynomial has gained at the part x of the step."""
    total = 0.0
    for m in range(7):
        total = (total + F[6 - m, n]) * (x if m % 2 == 0 else 1.0 - x)
    return total


@kernel
def flow(
    L, W, A, B, C, E, D, soft, regular, passes, rtol, atol, scale, until, steps, y, K, P, work,
    F, G, times, output, gained, state,
):  # fmt: skip
    """At most so many steps towards `until`; every instant of `times` that is met is kept.

    A (16, 16), B (12,), C (16,), E (2, 12), D (4, 16): the method. `regular` and `passes`:
    corrections by the residual in ordinary and in careful steps. scale (2·coordinates,): size of
    each coordinate, to which `atol` is relative. y (2·coordinates,), row 0 of K (16,
    2·coordinates) and of P (16, causes): the state, its slope, its powers. work (5,
    2·coordinates), F (7, 2·coordinates), G (7, causes). times (instants,), output (instants, rows,
    1). gained (instants + 1, causes): work done until each instant, the last row until now.

    state: [0] t, [1] next step, [2] steps done, [3] rejected, [4] careful ones, [5] evaluations,
    [6] instants met, [7] careful now, [8] weakest pivot, [9] and [12] tries so that
    no stage, and no end, lies at a singular position, [10] greatest of the weakest pivots, [11]
    greatest careful step.
    Returns DONE, MORE, SMALL (the step has vanished) or LOST (a slope was no number).
    """
    L, W = by_reference(L), by_reference(W)
    w, n6, causes = 0.0, 6 * L.bodies, P.shape[1]
    n3, swift = 3 * L.bodies, scale[6 * L.bodies - 1]
    ys, end, last = work[0], work[1], work[2]
    for _ in range(steps):
        t, h = state[0], state[1]
        if t >= until:
            return DONE
        clipped = t + h >= until - 1e-14 * abs(until)
        if clipped:
            h = until - t
        if h < 1e-13 * max(abs(t), abs(until)) and not clipped:
            return SMALL
        careful = state[7] > 0.5
        good, inside, least = True, False, state[8]
        for s in range(1, 12):
            for n in range(n6):
                total = 0.0
                for r in range(s):
                    total += A[s, r] * K[r, n]
                ys[n] = y[n] + h * total
            W.time[0, 0] = t + C[s] * h
            far, fast, good = stage(
                L, W, ys, K, P, s, soft, passes if careful else regular, careful
            )
            state[5] += 1
            if not good:
                break
            part = weakest(L, W)
            least = min(least, part)
            if careful:
                # what projections move along the manifold is of second order in what they move
                # across it, by how far the singular position is
                apart = math.sqrt(part / state[10])
                astray = far * far / apart + h * (fast / apart) ** 2 / swift
                close = apart < CLOSE and astray > ASTRAY * rtol
                inside = inside or close or far > CONE * apart
        if not good:
            state[3] += 1
            state[1] = 0.5 * h
            continue
        if inside and state[9] < STAGES_AGAIN:
            state[9] += 1.0
            state[1] = 0.91 * h
            continue
        if least < NEAR * state[10] and not careful:
            # errors of stages fall with the fourth power of the step, and here their squares count
            state[7], state[11] = 1.0, 0.25 * h
            state[1] = state[11]
            continue
        for n in range(n6):
            total, a, b = 0.0, 0.0, 0.0
            for r in range(12):
                total += B[r] * K[r, n]
                a += E[0, r] * K[r, n]
                b += E[1, r] * K[r, n]
            end[n] = y[n] + h * total
            work[3, n], work[4, n] = a, b
            last[n] = y[n]
        W.time[0, 0] = t + h
        if careful:
            _, _, good = stage(L, W, end, K, P, 12, soft, passes, True)
            state[5] += 1
            for row in range(3, 5):
                for half in range(2):
                    tangential(L, W, w, work[row, half * n3 : (half + 1) * n3])
        e3, e5 = 0.0, 0.0
        for n in range(n6):
            size = atol * scale[n] + rtol * max(abs(y[n]), abs(end[n]))
            e3 += (work[3, n] / size) ** 2
            e5 += (work[4, n] / size) ** 2
        if not (e5 < 1e300) or not good:
            state[1] = (0.5 if careful else 0.25) * h
            state[3] += 1
            if h < 1e-12 * max(abs(t), abs(until)):
                return LOST
            continue
        error = 0.0 if e5 == 0.0 else h * e5 / math.sqrt((e5 + 0.01 * e3) * n6)
        growth = 6.0 if error < 1e-9 else min(6.0, 0.9 * error**-0.125)
        if error > 1.0:
            state[3] += 1
            state[1] = h * max(0.2, growth)
            continue
        if not careful:
            _, _, good = stage(L, W, end, K, P, 12, soft, regular, True)
            state[5] += 1
            if not good:
                state[3] += 1
                state[1] = 0.5 * h
                continue
        part = weakest(L, W)
        if part < BEHIND * state[10] and state[12] < ENDS_AGAIN and not clipped:
            # a step begins badly at a singular position: end after it, or before
            state[12] += 1.0
            state[1] = h * (1.2 if state[12] < 5.0 else 0.5)
            continue
        for n in range(n6):
            y[n] = end[n]
        # ---- the step is made
        state[8], state[10] = part, max(part, state[10])
        state[2] += 1
        state[4] += 1.0 if careful else 0.0
        state[7] = 1.0 if careful and least < NEAR * state[10] else 0.0
        k, now = int(state[6]), until if clipped else t + h
        ahead = False
        while k < times.shape[0] and times[k] <= now:
            if times[k] < now and not ahead:
                between(L, W, A, B, C, D, soft, regular, t, h, y, last, K, P, F, G)
                state[5] += 3
                ahead = True
            x = (times[k] - t) / h
            for n in range(n6):
                ys[n] = last[n] + along(F, n, x) if times[k] < now else y[n]
            W.time[0, 0] = times[k]
            stage(L, W, ys, K, P, 13, soft, passes, True)
            state[5] += 1
            keep(L, W, w, output[k])
            for c in range(causes):
                gained[k, c] = gained[times.shape[0], c]
                gained[k, c] += along(G, c, x) if times[k] < now else h * weighed(B, P, c)
            k += 1
        for c in range(causes):
            gained[times.shape[0], c] += h * weighed(B, P, c)
            P[0, c] = P[12, c]
        state[0] = now
        state[1] = max(h * max(0.2, growth), state[1]) if clipped else h * max(0.2, growth)
        if state[7] > 0.5:
            state[1] = min(state[1], state[11])
        else:
            state[12] = state[9] = 0.0
        for n in range(n6):
            K[0, n] = K[12, n]
        state[6] = k
    return MORE


@njit
def weighed(B, P, c):
    """Mean power of cause c over a step."""
    whole = 0.0
    for r in range(12):
        whole += B[r] * P[r, c]
    return whole
