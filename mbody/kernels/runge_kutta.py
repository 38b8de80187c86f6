"""Free motion over time: explicit Runge–Kutta steps, each ended on the manifold.

Every step ends with the projection of position and velocity onto Φ = 0 and Φ_q v = ν in the metric
of the masses, and the next begins with the slope there. Between, stages run off the manifold by as
much as their error. That is harmless but near a singular position, where the right-hand side has
no smooth continuation off the manifold: there every stage is projected too, a = f(P(y)), with the
corrections that nearly dependent rows want, and the error is asked only of what a projection
keeps. Neither the multipliers, which grow without bound there, nor the noise across the manifold
then have a say in the size of a step.

Hairer, Nørsett, Wanner: Solving Ordinary Differential Equations I, II.5 and II.6 (the methods), and
II, IV.2 (how stiffness shows); Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4
(projection).
"""

from __future__ import annotations

import math

from mbody.compiler.jit import kernel, njit
from mbody.kernels.dense_output import deliver, inside
from mbody.kernels.projection import tangential, weakest
from mbody.kernels.singularity_monitor import sampled, uncertain, watched
from mbody.kernels.state_derivative import slope
from mbody.kernels.step_state import (
    ASKING,
    BRANCH,
    CALM,
    CAREFUL,
    DONE,
    DOUBTED,
    END_TRIES,
    FREED,
    FREEST,
    LAST,
    LAST_ONE,
    LIGHTER,
    LONGEST,
    LOST,
    MEETING,
    MORE,
    NEAR,
    NEXT,
    PIVOT,
    REJECTED,
    SLOPES,
    SMALL,
    STAGE_TRIES,
    STEEP,
    STEPS,
    STIFF,
    TIME,
    WEAK,
)

__all__ = ["flow"]

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
#: A step is so much shorter than its error asks for: of 0.7, 0.8 and 0.9 what costs the fewest
#: slopes at one error, as fewer steps are refused.
SAFETY = 0.8
#: In careful steps this much: the more of them, the nearer to the position some of them come.
NEARBY = 0.9
#: Accelerations are certain to this part, over the square of the distance from a singular position
#: as a part of what it was; and the square that counts at least, for nearer ones are of no use.
ROUNDING, NEAREST = 4e-16, 1e-8
#: A step ends before a singular position that is known at this part of the way to it, or, where it
#: may be as long as the way, as far behind it as it began before. One of these that is refused is
#: made this much shorter.
BEFORE, TWICE, BACK = 0.5, 2.0, 0.2
#: Ways to it that are shorter than this part of the time are not aimed at.
AIMED = 1e-9
#: So many steps in a row that stability holds, less so many that it does not, are stiff.
STIFF_STEPS, CALM_STEPS = 15.0, 6.0


@njit
def weighted(weights, count, K, total):
    """total ← Σ weights[r] K[r] over the first rows."""
    for n in range(total.shape[0]):
        total[n] = weights[0] * K[0, n]
    for r in range(1, count):
        weight = weights[r]
        if weight != 0.0:
            for n in range(total.shape[0]):
                total[n] += weight * K[r, n]


@njit
def between(L, W, method, soft, passes, t, h, y, last, K, P, F, G, state):
    """F (rows, 2·coordinates) and G (rows, causes) of the polynomials of state and work over a
    step, by the further slopes that the method takes for them.
    """
    A, B, C, D = method.A, method.B, method.C, method.D
    end = B.shape[0]
    for s in range(end + 1, A.shape[0]):
        weighted(A[s], s, K, F[1])
        for n in range(y.shape[0]):
            F[0, n] = last[n] + h * F[1, n]
        slope(L, W, t + C[s] * h, F[0], K[s], P[s], soft, passes, False)
        state[SLOPES] += 1
    for n in range(y.shape[0]):
        polynomial(D, h, y[n] - last[n], K, n, end, F)
    for c in range(P.shape[1]):
        polynomial(D, h, h * weighed(B, P, c), P, c, end, G)


@njit
def polynomial(D, h, change, K, n, end, F):
    """Column n of F from the slopes in column n of K and the change over the step."""
    F[0, n] = change
    F[1, n] = h * K[0, n] - change
    F[2, n] = 2.0 * change - h * (K[end, n] + K[0, n])
    for m in range(D.shape[0]):
        total = 0.0
        for r in range(D.shape[1]):
            total += D[m, r] * K[r, n]
        F[3 + m, n] = h * total


@njit
def weighed(B, P, c):
    """Mean power of cause c over a step."""
    whole = 0.0
    for r in range(B.shape[0]):
        whole += B[r] * P[r, c]
    return whole


@njit
def steepness(h, y, near, K, s, end, scale):
    """h |λ|: how fast slopes at the end of the step turn with the state, by two states there."""
    turned, apart = 0.0, 0.0
    for n in range(y.shape[0]):
        turned += ((K[end, n] - K[s, n]) / scale[n]) ** 2
        apart += ((y[n] - near[n]) / scale[n]) ** 2
    return h * math.sqrt(turned / apart) if apart > 0.0 else 0.0


@njit
def aimed(t, h, until, state):
    """The length h of a careful step, changed so that neither its end nor a stage lies at the
    singular position that is known: all nodes of the methods keep a tenth of the step from its
    middle. Returns whether there is one ahead, too, and whether the step goes over it.
    """
    way = state[MEETING] - t
    if not way > AIMED * max(abs(t), abs(until)) or t + TWICE * way >= until:
        return h, False, False
    if h >= way:
        return TWICE * way, True, True
    return min(h, BEFORE * way), True, False


@kernel
def flow(
    L, W, method, soft, regular, passes, rtol, atol, scale, until, steps, patient, y, K, P, work,
    F, G, times, output, gained, state,
):  # fmt: skip
    """At most so many steps towards `until`; every instant of `times` that is met is kept.

    `method`: an `Explicit`. `regular` and `passes`: corrections by the residual in ordinary and in
    careful steps. scale (2·coordinates,): size of each coordinate, to which `atol` is relative.
    `patient`: how many steps stiffness may cost. y (2·coordinates,), row 0 of K (rows,
    2·coordinates) and of P (rows, causes): the state, its slope, its powers. work (5,
    2·coordinates), F (rows, 2·coordinates), G (rows, causes). times (instants,), output (instants,
    rows, 1). gained (instants + 1, causes): work done until each instant, the last row until now.
    state: see `mbody.kernels.step_state`.
    Returns DONE, MORE, SMALL, LOST, STEEP or BRANCH.
    """
    A, B, C, E, sample = method.A, method.B, method.C, method.E, method.sample
    end_slope = B.shape[0]
    # whether the error asks for the slope at the end
    early = E.shape[1] > end_slope
    w, n6, causes = 0.0, 6 * L.bodies, P.shape[1]
    n3, swift = 3 * L.bodies, scale[6 * L.bodies - 1]
    ys, end, last = work[0], work[1], work[2]
    for _ in range(steps):
        t, h = state[TIME], state[NEXT]
        if t >= until:
            return DONE
        clipped = t + h >= until - 1e-14 * abs(until)
        if clipped and state[LAST_ONE] < 0.5:
            return LAST
        careful, known, over = state[NEAR] > 0.5, False, False
        if clipped:
            h = until - t
        elif careful:
            h, known, over = aimed(t, h, until, state)
        if h < 1e-13 * max(abs(t), abs(until)) and not clipped:
            return SMALL
        more = passes if careful else regular
        good, astray, least, least_at = True, False, state[PIVOT], t
        for s in range(1, end_slope):
            weighted(A[s], s, K, work[3])
            for n in range(n6):
                ys[n] = y[n] + h * work[3, n]
            far, fast, good = slope(L, W, t + C[s] * h, ys, K[s], P[s], soft, more, careful)
            state[SLOPES] += 1
            if not good:
                break
            part = weakest(L, W, w) if sample[s] == 0 else sampled(L, W, w, sample[s])
            if part < least:
                least, least_at = part, t + C[s] * h
            if careful:
                # what projections move along the manifold is of second order in what they move
                # across it, by how far the singular position is
                apart = math.sqrt(part / state[FREEST])
                moved = far * far / apart + h * (fast / apart) ** 2 / swift
                close = apart < CLOSE and moved > ASTRAY * rtol
                astray = astray or close or far > CONE * apart
        if not good:
            state[REJECTED] += 1
            state[NEXT] = (BACK if over else 0.5) * h
            continue
        if astray and not known and state[STAGE_TRIES] < STAGES_AGAIN:
            state[STAGE_TRIES] += 1.0
            state[NEXT] = 0.91 * h
            continue
        if least < WEAK * state[FREEST] and not careful:
            # errors of stages fall with the fourth power of the step, and here their squares count
            state[NEAR], state[LONGEST] = 1.0, 0.25 * h
            state[NEXT] = state[LONGEST]
            continue
        weighted(B, end_slope, K, work[3])
        for n in range(n6):
            end[n] = y[n] + h * work[3, n]
            last[n] = y[n]
        now = until if clipped else t + h
        if careful or early:
            _, _, good = slope(L, W, t + h, end, K[end_slope], P[end_slope], soft, more, True)
            state[SLOPES] += 1
        weighted(E[0], E.shape[1], K, work[3])
        weighted(E[1], E.shape[1], K, work[4])
        if careful:
            for row in range(3, 5):
                for half in range(2):
                    tangential(L, W, w, work[row, half * n3 : (half + 1) * n3])
        e3, e5, noise = 0.0, 0.0, 0.0
        if careful:
            noise = ROUNDING * h * swift / max(least / state[FREEST], NEAREST)
        for n in range(n6):
            size = (atol + noise) * scale[n] + rtol * max(abs(y[n]), abs(end[n]))
            e3 += (work[3, n] / size) ** 2
            e5 += (work[4, n] / size) ** 2
        if not (e5 < 1e300) or not good:
            state[NEXT] = (BACK if over else 0.5 if careful else 0.25) * h
            state[REJECTED] += 1
            if h < 1e-12 * max(abs(t), abs(until)):
                return LOST
            continue
        error = 0.0 if e5 == 0.0 else h * e5 / math.sqrt((e5 + 0.01 * e3) * n6)
        safety = NEARBY if careful else SAFETY
        growth = 6.0 if error < 1e-9 else min(6.0, safety * error ** (-1.0 / method.order))
        if error > 1.0:
            state[REJECTED] += 1
            state[NEXT] = h * (BACK if over else max(0.2, growth))
            continue
        if not (careful or early):
            _, _, good = slope(L, W, t + h, end, K[end_slope], P[end_slope], soft, regular, True)
            state[SLOPES] += 1
            if not good:
                state[REJECTED] += 1
                state[NEXT] = 0.5 * h
                continue
        part = sampled(L, W, w, sample[end_slope])
        if uncertain(L, W, method.at, t, y, end, careful, state):
            state[REJECTED] += 1
            state[NEXT] = 0.5 * h
            if t > state[DOUBTED]:
                # an ordinary step is tried shorter first
                state[DOUBTED], state[ASKING] = t + h, (2.0 if careful else 0.3) * h
            if h < state[ASKING]:
                return BRANCH
            continue
        if (
            part < BEHIND * state[FREEST]
            and state[END_TRIES] < ENDS_AGAIN
            and not (clipped or known)
        ):
            # a step begins badly at a singular position: end after it, or before
            state[END_TRIES] += 1
            state[NEXT] = h * (1.2 if state[END_TRIES] < 5.0 else 0.5)
            continue
        for n in range(n6):
            y[n] = end[n]
        # ---- the step is made
        state[PIVOT], state[FREEST] = part, max(part, state[FREEST])
        if part < least:
            least, least_at = part, now
        watched(L, W, sample[end_slope], least, least_at, regular > 0, state)
        state[STEPS] += 1
        state[LAST_ONE] = 0.0
        state[CAREFUL] += 1.0 if careful else 0.0
        state[NEAR] = 1.0 if careful and least < WEAK * state[FREEST] else 0.0
        if not (careful or clipped):
            held = steepness(h, y, ys, K, end_slope - 1, end_slope, scale) > method.stable
            state[CALM] = 0.0 if held else state[CALM] + 1.0
            if held or state[CALM] >= CALM_STEPS:
                state[STIFF] = state[STIFF] + 1.0 if held else 0.0
        for c in range(causes):
            G[0, c] = h * weighed(B, P, c)
        if inside(times, state, now):
            between(L, W, method, soft, regular, t, h, y, last, K, P, F, G, state)
        for n in range(n6):
            K[0, n] = K[end_slope, n]
        for c in range(causes):
            P[0, c] = P[end_slope, c]
        deliver(
            *(L, W, soft, passes, t, h, now, y, last, F, G, ys),
            *(K[end_slope], P[end_slope], times, output, gained, state),
        )
        state[TIME] = now
        wanted = h * max(0.2, growth)
        state[NEXT] = max(wanted, state[NEXT]) if clipped else wanted
        if state[NEAR] > 0.5:
            state[NEXT] = min(state[NEXT], state[LONGEST])
        else:
            state[END_TRIES] = state[STAGE_TRIES] = 0.0
        if state[FREED] > state[LIGHTER]:
            return MORE
        if state[STIFF] >= STIFF_STEPS and until - now > patient * state[NEXT]:
            return STEEP
    return MORE
