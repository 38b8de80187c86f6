"""Motion over time by steps of one length: generalised-α, or RATTLE and its compositions."""

from __future__ import annotations

import math

from mbody.compiler.jit import kernel
from mbody.kernels.dense_output import deliver, hermite
from mbody.kernels.generalized_alpha import alpha_step
from mbody.kernels.rattle import rattle_ready, rattle_step
from mbody.kernels.singularity_monitor import sampled, uncertain, watched
from mbody.kernels.state_derivative import slope
from mbody.kernels.step_state import (
    DONE,
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
    SLOPES,
    STEPS,
    TIME,
    WEAK,
)

__all__ = ["pace"]


@kernel
def pace(
    L, W, parts, at, rho, soft, passes, scale, until, steps, length, y, K, P, work, hat, blocks,
    lam, Jq, Jv, S, pivots, F, G, times, output, gained, state,
):  # fmt: skip
    """At most so many steps of that length towards `until`, the last one shorter; every instant of
    `times` that is met is kept.

    parts (steps of RATTLE,): of which a step is composed, none for generalised-α, whose spectral
    radius is rho. at (samples,): the parts of a step at which it is sampled. hat (coordinates,),
    lam (2·nodes,): the acceleration of the algorithm and the multipliers, carried on. Other
    arguments and codes as of `mbody.kernels.runge_kutta.flow` and `mbody.kernels.radau.radau`.
    """
    n6, n3 = 6 * L.bodies, 3 * L.bodies
    ys, last = work[0], work[1]
    symmetric = parts.shape[0] > 0
    for _ in range(steps):
        t = state[TIME]
        if t >= until:
            return DONE
        clipped = t + length >= until - 1e-9 * length
        if clipped and state[LAST_ONE] < 0.5:
            return LAST
        if state[PIVOT] < WEAK * state[FREEST]:
            return PASSAGE
        h = until - t if clipped else length
        now = until if clipped else t + length
        for n in range(n6):
            last[n] = y[n]
        for n in range(hat.shape[0]):
            work[2, n3 + n] = hat[n]
        good = True
        if symmetric:
            begun = t
            for n in range(n3):
                W.q[n, 0], K[3, n3 + n] = y[n], K[0, n3 + n]
            rattle_ready(L, W, t, soft)
            for n in range(lam.shape[0]):
                W.lam[n, 0] = lam[n]
            for m in range(parts.shape[0]):
                good = good and rattle_step(
                    L, W, soft, passes, begun, parts[m] * h, y, K, blocks, state
                )
                begun += parts[m] * h
            for n in range(n3):
                K[0, n3 + n] = K[3, n3 + n]
        else:
            good = alpha_step(
                *(L, W, soft, passes, rho, t, h, y, K, P, ys, work[2, :n3], hat, scale),
                *(Jq, Jv, S, pivots, state),
            )
        if good:
            # RATTLE ends on the manifold to rounding; no projection there but of rounding
            _, _, good = slope(L, W, now, y, K[1], P[1], soft, passes, True)
            state[SLOPES] += 1
        part = sampled(L, W, 0.0, 3)
        lost = not good or not math.isfinite(y[0])
        weak = lost or part < WEAK * state[FREEST]
        least, least_at = 1.0, 0.0
        if not weak:
            for n in range(lam.shape[0]):
                lam[n] = W.lam[n, 0]
            least, least_at = hermite(L, W, soft, passes, t, h, y, last, K, P, F, G, ys, state)
            weak = uncertain(L, W, at, t, last, y, False, state)
        if weak:
            for n in range(n6):
                y[n] = last[n]
            for n in range(hat.shape[0]):
                hat[n] = work[2, n3 + n]
            state[FRESH] = 0.0
            return LOST if lost else PASSAGE
        state[PIVOT], state[FREEST] = part, max(part, state[FREEST])
        if part < least:
            least, least_at = part, 1.0
        for n in range(n3):
            W.v[n, 0] = y[n3 + n]
        watched(L, W, 3, least, t + least_at * h, True, state)
        state[STEPS] += 1
        state[LAST_ONE] = 0.0
        for n in range(n6):
            K[0, n] = K[1, n]
        for c in range(P.shape[1]):
            P[0, c] = P[1, c]
        deliver(
            *(L, W, soft, passes, t, h, now, y, last, F, G, ys),
            *(K[1], P[1], times, output, gained, state),
        )
        state[TIME], state[NEXT] = now, length
        if state[FREED] > state[LIGHTER]:
            return MORE
    return MORE
