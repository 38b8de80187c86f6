"""Free motion of many designs side by side: explicit Runge–Kutta steps, each lane its own.

Every lane has its own time, its own length of step and its own mind whether a step is accepted, as
`flow` has them in ordinary steps; a lane that comes to its end takes the next design. What a lane
gets depends on its design alone, so the numbers are the same in any company. A design that meets
anything out of the ordinary (a singular position near by, no number, steps that vanish or are held
short by stiffness) is marked and left to `flow`.
"""

from __future__ import annotations

import numpy as np

from mbody.compiler.jit import kernel, njit
from mbody.compiler.lanes import larger, ld, select_le, smaller, st, wide
from mbody.kernels.output import keep
from mbody.kernels.projection import weakest
from mbody.kernels.runge_kutta_lanes_control import (
    AT,
    BEGUN,
    END,
    ERROR_3,
    ERROR_5,
    FAILED,
    KEPT,
    LEAST,
    LIGHTNESS,
    PART,
    STEEPNESS,
    STEP,
    TAKEN,
    UNCERTAIN,
    conclude,
    decide,
    leave,
    manned,
    meeting,
    next_instants,
)
from mbody.kernels.runge_kutta_lanes_rhs import arrive, give, given, pass_by, take, unsound
from mbody.kernels.singularity_monitor import STEEPER, judged, lightness, sampled, settled, turn_of
from mbody.kernels.step_state import MET, PIVOT

__all__ = ["drift_designs"]


@kernel
def drift_designs(
    L, W, method, regular, passes, rtol, atol, until, patient, rounds, lot, room, times, wanted,
    output, bad,
):  # fmt: skip
    """At most so many steps, in every lane, of designs from their first states to `until`.

    method: an `Explicit`; regular, passes, rtol, atol, patient: as of `flow`; lot: a `Lot`; room: a
    `Room`, that of the last call where the designs are gone on with. times (instants,); output
    (kept, designs, instants): the rows `wanted`; bad (designs,): set to one where a design must go
    alone. Returns whether all designs are done.
    """
    B, C = method.B, method.C
    stages = B.shape[0]
    early = method.E.shape[1] > stages
    w, S, K = wide(), room.state, room.K
    for _ in range(rounds):
        if not manned(L, W, lot, room, until, bad):
            return True
        t, h = ld(S, BEGUN, w), ld(S, STEP, w)
        least = ld(S, PIVOT, w)
        for s in range(1, stages):
            ahead(method.A[s], s, K, room.y, h, room.ys)
            take(L, W, w, room.ys)
            st(W.time, 0, t + C[s] * h, w)
            pass_by(L, W, w, regular)
            given(L, W, w, K[s])
            n = method.sample[s]
            least = smaller(least, weakest(L, W, w) if n == 0 else sampled(L, W, w, n))
        st(S, LEAST, least, w)
        ahead(B, stages, K, room.y, h, room.end)
        st(W.time, 0, t + h, w)
        if early:
            come(L, W, regular, room, stages, method.sample[stages])
        errors(method.E, rtol, atol, room)
        if not decide(room, method.order, bad):
            continue
        if not early:
            come(L, W, regular, room, stages, method.sample[stages])
        steepness(room, stages)
        turned = turn_of(L, w, room.y, room.end)
        st(S, UNCERTAIN, judged(L, W, w, method.at, STEEPER, turned), w)
        st(S, LIGHTNESS, lightness(L, W, w, W.v) if regular > 0 else 0.0 * turned, w)
        conclude(room, until, patient, method.stable, bad)
        taken = ld(S, TAKEN, w)
        settled(L, W, w, method.sample[stages], taken)
        for n in range(room.y.shape[0]):
            y = ld(room.y, n, w)
            st(room.last, n, y, w)
            st(room.y, n, select_le(1.0, taken, ld(room.end, n, w), y), w)
        if meeting(room, times):
            between(L, W, method, regular, room, t, h)
        for n in range(room.y.shape[0]):
            st(K[0], n, select_le(1.0, taken, ld(K[stages], n, w), ld(K[0], n, w)), w)
        deliver(L, W, passes, room, times, wanted, output, bad)
    return False


@njit
def ahead(weights, count, K, y, h, target):
    """target ← y + h Σ weights[r] K[r] over the first rows."""
    w = wide()
    for n in range(y.shape[0]):
        total = weights[0] * ld(K[0], n, w)
        for r in range(1, count):
            if weights[r] != 0.0:
                total = total + weights[r] * ld(K[r], n, w)
        st(target, n, ld(y, n, w) + h * total, w)


@njit
def come(L, W, regular, room, stages, last):
    """Project the end of the step, which is its sample number `last`, and take its slope."""
    w, S = wide(), room.state
    take(L, W, w, room.end)
    st(S, FAILED, arrive(L, W, w, regular, ld(S, TAKEN, w)), w)
    give(L, W, w, room.end)
    given(L, W, w, room.K[stages])
    st(S, END, sampled(L, W, w, last), w)


@njit
def errors(E, rtol, atol, room):
    """Sums of squares of both errors of the step, in parts of what is allowed."""
    w, K = wide(), room.K
    e3, e5 = 0.0 * wide(), 0.0 * wide()
    for n in range(room.y.shape[0]):
        size = larger(np.abs(ld(room.y, n, w)), np.abs(ld(room.end, n, w)))
        per = 1.0 / (atol * ld(room.scale, n, w) + rtol * size)
        low, high = E[0, 0] * ld(K[0], n, w), E[1, 0] * ld(K[0], n, w)
        for r in range(1, E.shape[1]):
            slope = ld(K[r], n, w)
            low, high = low + E[0, r] * slope, high + E[1, r] * slope
        low, high = low * per, high * per
        e3, e5 = e3 + low * low, e5 + high * high
    st(room.state, ERROR_3, e3, w)
    st(room.state, ERROR_5, e5, w)


@njit
def steepness(room, stages):
    """h |λ| of every lane, as `flow` has it."""
    w, S, K = wide(), room.state, room.K
    turned, apart = 0.0 * wide(), 0.0 * wide()
    for n in range(room.y.shape[0]):
        per = 1.0 / ld(room.scale, n, w)
        k = (ld(K[stages], n, w) - ld(K[stages - 1], n, w)) * per
        y = (ld(room.end, n, w) - ld(room.ys, n, w)) * per
        turned, apart = turned + k * k, apart + y * y
    # where both states are the same nothing is steep
    st(S, STEEPNESS, ld(S, STEP, w) * np.sqrt(turned / larger(apart, 1e-300 + 0.0 * apart)), w)


@njit
def between(L, W, method, regular, room, t, h):
    """F of the polynomials over the steps, by the further slopes that the method takes."""
    A, C, D, K, F, w = method.A, method.C, method.D, room.K, room.F, wide()
    end = method.B.shape[0]
    for s in range(end + 1, A.shape[0]):
        ahead(A[s], s, K, room.last, h, room.ys)
        take(L, W, w, room.ys)
        st(W.time, 0, t + C[s] * h, w)
        pass_by(L, W, w, regular)
        given(L, W, w, K[s])
    for n in range(room.y.shape[0]):
        change = ld(room.y, n, w) - ld(room.last, n, w)
        first = h * ld(K[0], n, w)
        st(F[0], n, change, w)
        st(F[1], n, first - change, w)
        st(F[2], n, 2.0 * change - first - h * ld(K[end], n, w), w)
        for m in range(D.shape[0]):
            total = D[m, 0] * ld(K[0], n, w)
            for r in range(1, D.shape[1]):
                if D[m, r] != 0.0:
                    total = total + D[m, r] * ld(K[r], n, w)
            st(F[3 + m], n, h * total, w)


@njit
def along(F, n, x):
    """What row n of a polynomial has gained at the part x of the step."""
    w = wide()
    total = 0.0 * x
    for m in range(F.shape[0]):
        row = F.shape[0] - 1 - m
        total = (total + ld(F[row], n, w)) * (x if row % 2 == 0 else 1.0 - x)
    return total


@njit
def deliver(L, W, passes, room, times, wanted, output, bad):
    """Keep every instant up to the ends of the steps, in all lanes that have one at once."""
    w, S, who = wide(), room.state, room.who
    lanes = who.shape[0] - 1
    while next_instants(room, times):
        x = ld(S, PART, w)
        for n in range(room.y.shape[0]):
            inside = ld(room.last, n, w) + along(room.F, n, x)
            st(room.ys, n, select_le(1.0, x, ld(room.y, n, w), inside), w)
        take(L, W, w, room.ys)
        st(W.time, 0, ld(S, AT, w), w)
        failed = arrive(L, W, w, passes, ld(S, KEPT, w))
        keep(L, W, w, room.page)
        st(S, FAILED, failed + unsound(room.page, w), w)
        for lane in range(lanes):
            if S[KEPT, lane] < 0.5:
                continue
            if S[FAILED, lane] == 0.0:
                k = int(S[MET, lane])
                for n in range(wanted.shape[0]):
                    output[n, who[lane], k] = room.page[wanted[n], lane]
                S[MET, lane] += 1.0
            else:
                leave(room, lane, bad)
