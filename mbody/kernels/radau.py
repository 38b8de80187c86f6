"""Stiff motion over time: the implicit method Radau IIA of order 5, each step ended projected.

The three stages of a step are found together by Newton's method with tangents of the step's
beginning, in the eigenvectors of the method's matrix, where one real and one complex system are
left; as ∂q̇/∂v is the identity, each is of the size of the coordinates, not of the states. Singular
positions are left to explicit steps.

Hairer, Wanner: Solving Ordinary Differential Equations II, IV.8, the code RADAU5.
"""

from __future__ import annotations

import math

from mbody.compiler.jit import kernel, njit
from mbody.kernels.dense_jacobian import eliminate, iteration_matrix, substitute, tangents
from mbody.kernels.dense_output import along, deliver
from mbody.kernels.singularity_monitor import sampled, uncertain, watched
from mbody.kernels.state_derivative import slope
from mbody.kernels.step_state import (
    DONE,
    ERROR,
    FREED,
    FREEST,
    FRESH,
    LAST,
    LAST_ONE,
    LIGHTER,
    LOST,
    MORE,
    NEXT,
    PASSAGE,
    PIVOT,
    REJECTED,
    SLOPES,
    SMALL,
    STEPS,
    TIME,
    WEAK,
)

__all__ = ["radau"]

#: Corrections of the stages, at most.
NEWTON = 7


@njit
def correct(S, pivots, mu, Jv, q, v, x):
    """(q, v) ← the solution of (μ − J) (q, v) = (q, v), J = [0 1; ∂a/∂q ∂a/∂v], by the factor of
    μ² − μ ∂a/∂v − ∂a/∂q; x is room.
    """
    size = x.shape[0]
    for m in range(size):
        total = v[m] + mu * q[m]
        for n in range(size):
            total -= Jv[m, n] * q[n]
        x[m] = total
    substitute(S, pivots, x)
    for m in range(size):
        v[m] = mu * x[m] - q[m]
        q[m] = x[m]


@njit
def size_of(e, y, end, scale, rtol, atol):
    """Root of the mean square of e, in tolerances."""
    total = 0.0
    for n in range(e.shape[0]):
        size = atol * scale[n] + rtol * max(abs(y[n]), abs(end[n]))
        total += (e[n] / size) ** 2
    return math.sqrt(total / e.shape[0])


@njit
def stages(
    L, W, method, soft, passes, rtol, atol, scale, t, h, y, K, P, Z, X, xc, Jv, real,
    real_pivots, turned, turned_pivots, ys, state,
):  # fmt: skip
    """Z (3, 2·coordinates): what the state gains until each stage, from the values there; rows 1
    to 3 of K their slopes. Returns whether the corrections converge, and their rate.
    """
    n6, n3 = y.shape[0], y.shape[0] // 2
    T, inverse = method.T, method.inverse
    mu, turn = method.real / h, method.complex / h
    enough = max(10.0 * 2.2e-16 / rtol, min(0.03, math.sqrt(rtol)))
    for i in range(3):
        for n in range(n6):
            X[i, n] = inverse[i, 0] * Z[0, n] + inverse[i, 1] * Z[1, n] + inverse[i, 2] * Z[2, n]
    last, rate = -1.0, 0.0
    for k in range(NEWTON):
        for i in range(3):
            for n in range(n6):
                ys[n] = y[n] + Z[i, n]
            _, _, good = slope(
                L, W, t + method.C[i] * h, ys, K[1 + i], P[1 + i], soft, passes, False
            )
            state[SLOPES] += 1
            if not good:
                return False, rate
        for n in range(n6):
            a, b, c = K[1, n], K[2, n], K[3, n]
            Z[0, n] = inverse[0, 0] * a + inverse[0, 1] * b + inverse[0, 2] * c - mu * X[0, n]
            re = inverse[1, 0] * a + inverse[1, 1] * b + inverse[1, 2] * c
            im = inverse[2, 0] * a + inverse[2, 1] * b + inverse[2, 2] * c
            xc[1 + n // n3, n % n3] = re + 1j * im - turn * (X[1, n] + 1j * X[2, n])
        correct(real, real_pivots, mu, Jv, Z[0, :n3], Z[0, n3:], ys[:n3])
        correct(turned, turned_pivots, turn, Jv, xc[1], xc[2], xc[0])
        for n in range(n6):
            z = xc[1 + n // n3, n % n3]
            Z[1, n], Z[2, n] = z.real, z.imag
        far = 0.0
        for i in range(3):
            far += size_of(Z[i], y, y, scale, rtol, atol) ** 2
        far = math.sqrt(far / 3.0)
        if not far < 1e300:
            return False, rate
        small = far <= 0.1 * enough
        if last > 0.0 and not small:
            rate = far / last
            left = rate ** (NEWTON - k) / (1.0 - rate) * far if rate < 1.0 else 1e300
            if left > enough:
                return False, rate
        for i in range(3):
            for n in range(n6):
                X[i, n] += Z[i, n]
        for i in range(3):
            for n in range(n6):
                Z[i, n] = T[i, 0] * X[0, n] + T[i, 1] * X[1, n] + T[i, 2] * X[2, n]
        if small or (last > 0.0 and rate / (1.0 - rate) * far < enough):
            return True, rate
        last = far
    return False, rate


@njit
def collocation(C, Z, F):
    """F (3, numbers) of the cubic that gains Z (3, numbers) until the stages."""
    for n in range(Z.shape[1]):
        first = (Z[0, n] / C[0] - Z[2, n]) / (1.0 - C[0])
        second = (Z[1, n] / C[1] - Z[2, n]) / (1.0 - C[1])
        F[0, n] = Z[2, n]
        F[2, n] = (second - first) / (C[1] - C[0])
        F[1, n] = first - C[0] * F[2, n]


@njit
def worked(C, B, h, P, G):
    """G (3, causes) of the work of a step, by the powers at the stages: rows 1 to 3 of P."""
    a, b = C[0], C[1]
    for c in range(G.shape[1]):
        G[0, c] = h * (B[0] * P[1, c] + B[1] * P[2, c] + B[2] * P[3, c])
        # slopes of the cubic: G₀ + (1 − 2 x) G₁ + (2 x − 3 x²) G₂
        first, second = h * P[1, c] - G[0, c], h * P[2, c] - G[0, c]
        p, q, r, s = 1.0 - 2.0 * a, a * (2.0 - 3.0 * a), 1.0 - 2.0 * b, b * (2.0 - 3.0 * b)
        G[1, c] = (first * s - second * q) / (p * s - q * r)
        G[2, c] = (p * second - r * first) / (p * s - q * r)


@kernel
def radau(
    L, W, method, soft, regular, passes, rtol, atol, scale, until, steps, y, K, P, work, Z, X, xc,
    past, Jq, Jv, real, real_pivots, turned, turned_pivots, F, G, times, output, gained, state,
):  # fmt: skip
    """At most so many steps towards `until`; every instant of `times` that is met is kept.

    Arguments and codes as of `mbody.kernels.runge_kutta.flow`; `method` an `Implicit`, Z and X (3,
    2·coordinates), xc (3, coordinates) complex, past (4, 2·coordinates) the polynomial of the last
    step and its length, the others (coordinates, coordinates) with their exchanges of rows.
    """
    n6, n3 = 6 * L.bodies, 3 * L.bodies
    ys, end, last, error = work[0], work[1], work[2], work[3]
    made = -1.0
    for _ in range(steps):
        t, h = state[TIME], state[NEXT]
        if t >= until:
            return DONE
        clipped = t + h >= until - 1e-14 * abs(until)
        if clipped and state[LAST_ONE] < 0.5:
            return LAST
        if state[PIVOT] < WEAK * state[FREEST]:
            return PASSAGE
        if clipped:
            h = until - t
        if h < 1e-13 * max(abs(t), abs(until)) and not clipped:
            return SMALL
        here = state[FRESH] < 0.5
        if here:
            tangents(
                *(L, W, t, y, K, P, ys, scale, soft, regular),
                *(Jq, Jv, state),
            )
            state[FRESH], made = 1.0, -1.0
        if made != h:
            mu, turn = method.real / h, method.complex / h
            iteration_matrix(Jq, Jv, mu * mu, mu, 1.0, real)
            iteration_matrix(Jq, Jv, turn * turn, turn, 1.0, turned)
            if not (eliminate(real, real_pivots) and eliminate(turned, turned_pivots)):
                state[NEXT] = 0.5 * h
                state[REJECTED] += 1
                continue
            made = h
        for i in range(3):
            x = 1.0 + method.C[i] * h / past[3, 0] if past[3, 0] > 0.0 else 1.0
            for n in range(n6):
                Z[i, n] = along(past[:3], n, x) - past[0, n]
        good, rate = stages(
            *(L, W, method, soft, regular, rtol, atol, scale),
            *(t, h, y, K, P, Z, X, xc, Jv, real, real_pivots, turned, turned_pivots, ys, state),
        )
        if not good:
            state[REJECTED] += 1
            state[FRESH] = 1.0 if here else 0.0
            state[NEXT] = 0.5 * h if here else h
            if h < 1e-12 * max(abs(t), abs(until)):
                return LOST
            continue
        for n in range(n6):
            end[n] = y[n] + Z[2, n]
        # ---- the error, damped where the motion is stiff
        mu = method.real / h
        for again in range(2):
            for n in range(n6):
                ends = (method.E[0] * Z[0, n] + method.E[1] * Z[1, n] + method.E[2] * Z[2, n]) / h
                error[n] = ends + K[1 if again else 0, n]
            correct(real, real_pivots, mu, Jv, error[:n3], error[n3:], ys[:n3])
            off = size_of(error, y, end, scale, rtol, atol)
            if not off > 1.0 or again or not (state[STEPS] == 0 or state[ERROR] > 1.0):
                break
            for n in range(n6):
                ys[n] = y[n] + error[n]
            slope(L, W, t, ys, K[1], P[1], soft, regular, False)
            state[SLOPES] += 1
        growth = 8.0 if off < 1e-10 else min(8.0, 0.9 * off**-0.25)
        state[ERROR] = off
        if not off <= 1.0:
            state[REJECTED] += 1
            state[NEXT] = h * max(0.2, growth) if off < 1e300 else 0.2 * h
            if h < 1e-12 * max(abs(t), abs(until)):
                return LOST
            continue
        for n in range(n6):
            last[n] = y[n]
        # the stages once more, where they are now, for their powers and their distances
        least, least_at = state[PIVOT], t
        for i in range(2):
            for n in range(n6):
                ys[n] = y[n] + Z[i, n]
            slope(L, W, t + method.C[i] * h, ys, K[2], P[1 + i], soft, regular, False)
            state[SLOPES] += 1
            part = sampled(L, W, 0.0, 1 + i)
            if part < least:
                least, least_at = part, t + method.C[i] * h
        _, _, good = slope(L, W, t + h, end, K[1], P[3], soft, passes, True)
        state[SLOPES] += 1
        if not good:
            state[REJECTED] += 1
            state[NEXT] = 0.5 * h
            continue
        part = sampled(L, W, 0.0, 3)
        if part < WEAK * state[FREEST] or uncertain(L, W, method.at, t, y, end, False, state):
            state[FRESH] = 0.0
            return PASSAGE
        # ---- the step is made
        for n in range(n6):
            y[n] = end[n]
        state[PIVOT], state[FREEST] = part, max(part, state[FREEST])
        now = until if clipped else t + h
        if part < least:
            least, least_at = part, now
        watched(L, W, 3, least, least_at, regular > 0, state)
        state[STEPS] += 1
        state[LAST_ONE] = 0.0
        for n in range(n6):
            K[0, n] = K[1, n]
        for c in range(P.shape[1]):
            P[0, c] = P[3, c]
        for n in range(n6):
            Z[2, n] = y[n] - last[n]
        collocation(method.C, Z, F)
        worked(method.C, method.B, h, P, G)
        for i in range(3):
            for n in range(n6):
                past[i, n] = F[i, n]
        past[3, 0] = h
        deliver(
            *(L, W, soft, passes, t, h, now, y, last, F, G, ys),
            *(K[1], P[1], times, output, gained, state),
        )
        state[TIME] = now
        # one factor serves while steps would grow little
        wanted = h * max(0.2, growth)
        if 1.0 <= wanted / h < 1.2:
            wanted = h
        state[NEXT] = max(wanted, state[NEXT]) if clipped else wanted
        state[FRESH] = 1.0 if rate < 1e-3 else 0.0
        if state[FREED] > state[LIGHTER]:
            return MORE
    return MORE
